"""A tack on a shift: on a leg that the autopilot beats, where the table of the wind's shifts says that it pays.

The autopilot would stand on to its corridor's edge whatever the wind does. The tack is asked for within that corridor,
which the plan's scorer found clear to both edges, so nothing is sailed that was not judged.
"""

from __future__ import annotations

import math

from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.deeds.helm import TACK, is_busy, tack
from companion.skipper.deeds.short_tack import LEAST_MPS
from companion.skipper.planning.autopilot_beats import is_left_to_beat, tacks_fail
from companion.skipper.step.shifting import shifting
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import along_m, bearing_rad, cross_track_m, distance_m

LAST_S = 20.0        # so near the leg's end the layline decides, which the autopilot sees
TURNING = 0.5        # of her angle to the wind, more or less: then she is turning, or has borne away


def shift_tack(turn: Turn) -> None:
    """Ask for a tack where it gains more than it costs."""
    boat, leg, wind, vehicle, status = turn.boat_en, turn.leg(), turn.wind_now, turn.snapshot.vehicle, turn.autopilot
    if not turn.config.shifts or boat is None or leg is None or wind is None or vehicle is None or status is None:
        return
    if not turn.ahead() or status.mode is not Mode.AUTO or turn.speed_mps < LEAST_MPS or tacks_fail(turn) or (
            not turn.voyage.boat.can_tack):
        return
    is_too_soon = turn.t_s - turn.state.steering.tacked_s < turn.config.shift_tacks_apart_s
    if is_too_soon or is_busy(turn, TACK) or turn.state.pending.upload is not None:
        return
    half_rad = turn.no_go_half_rad
    off_rad = difference_rad(wind[0], vehicle.heading_rad)
    if not turn.is_closed(boat, leg[1], wind) or abs(abs(off_rad) - half_rad) > TURNING * half_rad:
        return
    beat = shifting(turn, bearing_rad(*leg), distance_m(*leg) - along_m(boat, *leg))
    if beat is None:
        return
    to_go_s = math.dist(boat, leg[1]) / beat.table.made_good_mps
    if to_go_s < LAST_S:
        return
    is_port = off_rad < 0.0
    shift_rad = difference_rad(wind[0], beat.mean_rad)
    gain_s = beat.table.gain_s(cross_track_m(boat, *leg), shift_rad, is_port=is_port)
    if gain_s <= 0.0 or not is_left_to_beat(turn, boat, leg[1]):
        return
    headed_deg = math.degrees(shift_rad if is_port else -shift_rad)
    edge = "layline" if beat.table.corridor_m < turn.tack_corridor_m - 0.1 else "corridor's edge"
    words = f"headed {headed_deg:.0f}°" if headed_deg >= 0.5 else (
        f"lifted {max(0.0, -headed_deg):.0f}°, near the {edge}")
    tack(turn, "shift tack", f"{words}: tack; expected gain {gain_s:.1f} s of {to_go_s:.0f} to go")

"""A tack before the corridor's edge: where the autopilot's own beat would come too near to something.

On a leg that the wind has closed ArduRover sails at its no-go angle until it is SAIL_XTRACK_MAX off the line, whatever
lies there; a margin narrower than that corridor does not bear it. A plan takes seconds and, after a great shift, may
not be found at all. The autopilot tacks at once when it is asked to (DO_AUX_FUNCTION 63), on such a leg and 5 s after
its last tack at the earliest.
"""

from __future__ import annotations

import math

from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import Mode
from companion.skipper.deeds.helm import TACK, is_busy, tack
from companion.skipper.planning.autopilot_beats import tacks_fail
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import bearing_rad, moved
from companion.skipper.way.voyage import PointEn

LEAD_S = 3.5         # a step to see it, the command, and the turn until the boat goes no farther that way
LEAST_MPS = 1.0      # slower she may not get through the wind
APART_S = 6.0        # between two tacks: the autopilot's own 5 s, and a step
LOOK_S = 8.0         # of the other tack, which must be better
GAIN_M = 1.0


def short_tack(turn: Turn) -> None:
    """Ask for a tack where the present one is about to come below the margin's floor and the other is clearer."""
    boat, leg, wind, vehicle = turn.boat_en, turn.leg(), turn.wind_now, turn.snapshot.vehicle
    status = turn.autopilot
    if boat is None or leg is None or wind is None or vehicle is None or status is None or not turn.ahead():
        return
    if status.mode is not Mode.AUTO or turn.speed_mps < LEAST_MPS or not turn.voyage.boat.can_tack or tacks_fail(turn):
        return
    if turn.t_s - turn.state.tacked_s < APART_S or is_busy(turn, TACK) or turn.state.pending_upload is not None:
        return
    if abs(difference_rad(wind[0], bearing_rad(boat, leg[1]))) >= turn.no_go_half_rad:
        return   # the leg is open: the autopilot follows it
    off = difference_rad(wind[0], vehicle.heading_rad)
    if not 0.5 * turn.no_go_half_rad < abs(off) < 1.5 * turn.no_go_half_rad:
        return   # she is not close-hauled: turning, or bearing away
    side = 1.0 if off >= 0.0 else -1.0
    floor_m = min(turn.config.margin_floor_m, turn.config.margin_m)
    now_m = _clearance_m(turn, boat, vehicle.heading_rad, LEAD_S)
    if now_m >= floor_m:
        return
    other_rad = wrap_pi(wind[0] + side * turn.no_go_half_rad)
    if _clearance_m(turn, boat, other_rad, LOOK_S) > now_m + GAIN_M:
        tack(turn, "short tack",
             f"{now_m:.0f} m clear ahead on this tack in {LEAD_S:g} s: tacking before the corridor's edge")


def _clearance_m(turn: Turn, boat: PointEn, course_rad: float, span_s: float) -> float:
    """Return how clear the water is that a heading takes her through in ``span_s``, the current with her [m]."""
    east, north = turn.current_en_mps
    vehicle = turn.snapshot.vehicle
    velocity = (0.0, 0.0) if vehicle is None else vehicle.velocity_en_mps
    through_m = math.hypot(velocity[0] - east, velocity[1] - north) * span_s
    there = moved((boat[0] + east * span_s, boat[1] + north * span_s), course_rad, through_m)
    return turn.voyage.area.path_clearance_m([boat, there])

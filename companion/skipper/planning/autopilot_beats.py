"""Beats that are left to the autopilot: whether, and how much room each needs (``problem.evaluate``)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from companion.boat import AutopilotLimits
from companion.boat.failed_tack import TRIES
from companion.boat.tracking import GuidanceModel, beat_band_m
from companion.geo.angles import difference_rad
from companion.skipper.step.shifting import shifting
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import bearing_rad, cross_track_m
from companion.skipper.way.voyage import PointEn

IRONS_MEMORY_S = 600.0
TACKS_FAIL_AFTER = TRIES    # failures in a row, or times in irons within IRONS_MEMORY_S, before tacks are left
WIDEST_M = 50.0         # a wider corridor is no corridor ...
WIDEST_BY_SHIFTS_M = 200.0   # ... but where she tacks on the shifts: then its edges are seldom met
CARRIED_S = 2.5         # of a tack, at the corridor's edge: where the water takes her meanwhile
OFF_LINE_M = 2.0        # so near the line a leg that begins anew is the same leg
FOLLOWS_RAD = math.radians(10.0)   # this far outside its no-go zone the autopilot keeps to the line


def tacks_fail(turn: Turn) -> bool:
    """Return whether tacks failed, or she was in irons, so often of late that they are not tried."""
    recent = [t for t in turn.state.steering.irons_s if turn.t_s - t < IRONS_MEMORY_S]
    tacking, given = turn.state.tacking, turn.voyage.boat.tack_fails
    in_a_row = tacking.in_a_row if given > 0.0 and turn.t_s - tacking.failed_s < IRONS_MEMORY_S else 0
    return max(len(recent), in_a_row) >= TACKS_FAIL_AFTER


def boards_within_m(turn: Turn) -> float | None:
    """Return what the boards of the autopilot's beat keep within, to either side of the leg [m].

    The overshoot of a tack at the corridor's edge is in it, and where the current sets her meanwhile. None without a
    corridor: the autopilot then sails to the layline, wherever that is.
    """
    corridor, wind = turn.tack_corridor_m, turn.wind_mean
    widest = WIDEST_BY_SHIFTS_M if turn.config.shifts else WIDEST_M
    if wind is None or not 0.0 < corridor <= widest or not turn.config.sails:
        return None
    boat = turn.voyage.boat
    limits = turn.snapshot.limits or AutopilotLimits(sail_xtrack_max_m=corridor)
    helm = replace(GuidanceModel.of(limits), corridor_m=corridor, no_go_half_rad=turn.no_go_half_rad)
    return beat_band_m(helm, boat.polar, tws_mps=wind[1]) + CARRIED_S * math.hypot(*turn.current_en_mps)


def corridor_room_m(turn: Turn) -> float | None:
    """Return how far from everything solid a closed leg must be for the autopilot's beat about it [m].

    What its boards keep within, the hull's reach, and the margin's floor beyond that; None where that is none. Whether
    each board keeps the floor in the wind's spread is the planner's to say (``companion.planner.track``).
    """
    within_m = boards_within_m(turn)
    if within_m is None:
        return None
    return within_m + turn.voyage.boat.hull.reach_m + turn.config.margin_floor_m


def room_m(turn: Turn) -> float | None:
    """Return ``corridor_room_m`` where beats may be planned for the autopilot, None where not."""
    if not turn.config.autopilot_beats or turn.snapshot.limits is None or tacks_fail(turn):
        return None
    return corridor_room_m(turn)


def problem_beat(turn: Turn, margin_m: float) -> dict[str, Any] | None:
    """Return the ``beat`` of a problem whose obstacles are grown by ``margin_m``, None without one."""
    room = room_m(turn)
    if room is None:
        return None
    boat, by_shifts = turn.voyage.boat, shifting(turn)
    tack_s = 2.0 * turn.no_go_half_rad / boat.turn_rate_radps + boat.tack_loss_s
    return {
        # the angle that her bow is held at, with leeway too: a leg at her course's angle she would be held below
        "no_go_half_deg": math.degrees(turn.no_go_half_rad),
        "corridor_m": turn.tack_corridor_m,
        "clearance_m": max(0.0, room - margin_m),
        "tack_s": tack_s if by_shifts is None else min(tack_s, by_shifts.tack_s),
    }


def may_restart_leg(turn: Turn) -> bool:
    """Return whether an upload may come now: it makes the present leg begin at the boat, and its corridor with it.

    On a beat the boat may be the corridor's width off the line already; from there it could get as far off again.
    """
    boat, leg, wind = turn.boat_en, turn.leg(), turn.wind_now
    if boat is None or leg is None or wind is None or abs(cross_track_m(boat, *leg)) <= OFF_LINE_M:
        return True
    room = corridor_room_m(turn)
    if room is None or abs(difference_rad(wind[0], bearing_rad(boat, leg[1]))) > turn.no_go_half_rad + FOLLOWS_RAD:
        return True
    return turn.voyage.area.path_clearance_m([boat, leg[1]]) >= room


def is_left_to_beat(turn: Turn, a: PointEn, b: PointEn) -> bool:
    """Return whether the autopilot may beat from a to b: the water is clear by ``room_m``."""
    room = room_m(turn)
    return room is not None and turn.voyage.area.path_clearance_m([a, b]) >= room


def beaten_within_m(turn: Turn) -> float:
    """Return how far off the present leg the autopilot's own beat takes her [m]; 0 where it does not beat.

    It beats where the leg lies in the no-go zone, by the wind that there is or by its mean: a lift does not end a beat.
    """
    leg = turn.leg()
    if leg is None or not any(turn.is_closed(*leg, wind) for wind in (turn.wind_now, turn.wind_mean)):
        return 0.0
    return (boards_within_m(turn) or 0.0) if is_left_to_beat(turn, *leg) else 0.0

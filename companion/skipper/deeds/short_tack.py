"""A tack before the corridor's edge: where the autopilot's own beat would come too near to something.

On a leg that the wind has closed ArduRover sails at its no-go angle until it is SAIL_XTRACK_MAX off the line, whatever
lies there; a margin narrower than that corridor does not bear it. A plan takes seconds and, after a great shift, may
not be found at all. The autopilot tacks at once when it is asked to (DO_AUX_FUNCTION 63), on such a leg and 5 s after
its last tack at the earliest. Where tacks can fail she is asked while there is room for one that does: the corridor's
edge knows of none.
"""

from __future__ import annotations

import math

from companion.boat.failed_tack import AGAIN_SHARE, IRONS_S, RISKY, SET_SHARE, TRIES, failed_tack, lee_set
from companion.current import UNTOLD_MPS
from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import Mode
from companion.skipper.deeds.helm import TACK, is_busy, tack
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import moved
from companion.skipper.way.voyage import PointEn

LEAD_S = 3.5         # a step to see it, the command, and the turn until the boat goes no farther that way
LEAST_MPS = 1.0      # slower she may not get through the wind
APART_S = 6.0        # between two tacks: the autopilot's own 5 s, and a step
LOOK_S = 8.0         # of the other tack, which must be better
GAIN_M = 1.0
HAIR_M = 0.5
NEXT_S = 2.0         # the tack that is asked for in the next step begins so far on


def short_tack(turn: Turn) -> None:
    """Ask for a tack where the present one is about to come below the margin's floor and the other is clearer."""
    boat, leg, wind, vehicle = turn.boat_en, turn.leg(), turn.wind_now, turn.snapshot.vehicle
    status = turn.autopilot
    if boat is None or leg is None or wind is None or vehicle is None or status is None or not turn.ahead():
        return
    if status.mode is not Mode.AUTO or turn.speed_mps < LEAST_MPS or not turn.voyage.boat.can_tack:
        return
    is_uploading = turn.state.pending.upload is not None
    if turn.t_s - turn.state.steering.tacked_s < APART_S or is_busy(turn, TACK) or is_uploading:
        return
    if not turn.is_closed(boat, leg[1], wind):
        return   # the leg is open: the autopilot follows it
    off = difference_rad(wind[0], vehicle.heading_rad)
    if not 0.5 * turn.no_go_half_rad < abs(off) < 1.5 * turn.no_go_half_rad:
        return   # she is not close-hauled: turning, or bearing away
    side = 1.0 if off >= 0.0 else -1.0
    floor_m = min(turn.config.margin_floor_m, turn.config.margin_m)
    now_m = _clearance_m(turn, boat, vehicle.heading_rad, LEAD_S)
    why = f"{now_m:.0f} m clear ahead on this tack in {LEAD_S:g} s"
    if now_m >= floor_m:
        if now_m >= float(turn.voyage.area.clearance_m([boat])[0]) - HAIR_M or _may_fail(turn, boat, wind, floor_m):
            return
        why = "a tack that failed later would bring her below the floor"
    other_rad = wrap_pi(wind[0] + side * turn.no_go_half_rad)
    if _clearance_m(turn, boat, other_rad, LOOK_S) > now_m + GAIN_M:
        tack(turn, "short tack", f"{why}: tacking before the corridor's edge")


def _may_fail(turn: Turn, boat: PointEn, wind: tuple[float, float], floor_m: float) -> bool:
    """Return whether a tack in the next step may fail, as often in a row as is likely, and she keeps the floor.

    While she lies the current that is believed carries her, planned for or not, and as much as is not told brings her
    nearer to whatever is near; she is blown back, or is not, or is set to lee.
    """
    vehicle, water = turn.snapshot.vehicle, turn.snapshot.current
    chance = turn.state.tacking.chance(turn.voyage.boat.tack_fails)
    if vehicle is None or chance <= 0.0:
        return True
    course, speed = vehicle.heading_rad, math.hypot(*turn.through_en_mps)
    there = _there(turn, boat, course, NEXT_S)
    tacking, is_starboard = turn.state.tacking, difference_rad(wind[0], course) > 0.0
    irons_s = max(IRONS_S, tacking.irons_s)
    need_m = floor_m + irons_s * min(water.sigma_mps, UNTOLD_MPS)
    learned_mps = tacking.starboard_lee_mps if is_starboard else tacking.port_lee_mps
    lee = lee_set(course_rad=course, twd_from_rad=wind[0], lee_mps=max(learned_mps, SET_SHARE * wind[1]))
    set_en_mps = (water.en_mps[0] + lee[0], water.en_mps[1] + lee[1])
    for failures in range(1, TRIES + 1):
        blown, still = _failed(there, course, speed, wind, water.en_mps, irons_s)
        _, aside = _failed(there, course, speed, wind, set_en_mps, irons_s)
        if min(turn.voyage.area.path_clearance_m(way) for way in (blown, still, aside)) < need_m:
            return False
        if chance ** (failures + 1) <= RISKY:
            return True
        there, speed = aside[-1], AGAIN_SHARE * math.hypot(*turn.through_en_mps)
    return True


def _failed(
    there: PointEn, course_rad: float, speed_mps: float, wind: tuple[float, float], carried_en_mps: PointEn,
    irons_s: float,
) -> tuple[list[PointEn], list[PointEn]]:
    """Return the tracks of a tack that fails, blown back and not, as lists of places."""
    blown, still = failed_tack(there, course_rad=course_rad, speed_mps=speed_mps, twd_from_rad=wind[0],
                               tws_mps=wind[1], current_en_mps=carried_en_mps, irons_s=irons_s)
    return [(float(e), float(n)) for e, n in blown], [(float(e), float(n)) for e, n in still]


def _clearance_m(turn: Turn, boat: PointEn, course_rad: float, span_s: float) -> float:
    """Return how clear the water is that a heading takes her through in ``span_s``, the current with her [m]."""
    return turn.voyage.area.path_clearance_m([boat, _there(turn, boat, course_rad, span_s)])


def _there(turn: Turn, boat: PointEn, course_rad: float, span_s: float) -> PointEn:
    """Return where a heading takes her in ``span_s``."""
    (east, north), through_m = turn.current_en_mps, math.hypot(*turn.through_en_mps) * span_s
    return moved((boat[0] + east * span_s, boat[1] + north * span_s), course_rad, through_m)

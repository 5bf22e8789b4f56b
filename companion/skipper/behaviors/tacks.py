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
from companion.skipper.behaviors.helm import TACK, is_busy, tack
from companion.skipper.planning.autopilot_beats import is_left_to_beat, tacks_fail
from companion.skipper.step.context import StepContext
from companion.skipper.step.wind_shifts import shifting
from companion.skipper.way.geometry import along_m, bearing_rad, cross_track_m, distance_m, moved
from companion.skipper.way.voyage import PointEn

LEAD_S = 3.5         # a step to see it, the command, and the turn until the boat goes no farther that way
LEAST_MPS = 1.0      # slower she may not get through the wind
APART_S = 6.0        # between two tacks: the autopilot's own 5 s, and a step
LOOK_S = 8.0         # of the other tack, which must be better
GAIN_M = 1.0
HAIR_M = 0.5
NEXT_S = 2.0         # the tack that is asked for in the next step begins so far on
LAST_S = 20.0        # so near the leg's end the layline decides, which the autopilot sees
TURNING = 0.5        # of her angle to the wind, more or less: then she is turning, or has borne away


def short_tack(ctx: StepContext) -> None:
    """Ask for a tack where the present one is about to come below the margin's floor and the other is clearer."""
    boat, leg, wind, vehicle = ctx.boat_en, ctx.leg(), ctx.wind_now, ctx.snapshot.vehicle
    status = ctx.autopilot
    if boat is None or leg is None or wind is None or vehicle is None or status is None or not ctx.ahead():
        return
    if status.mode is not Mode.AUTO or ctx.speed_mps < LEAST_MPS or not ctx.voyage.boat.can_tack:
        return
    is_uploading = ctx.state.pending.upload is not None
    if ctx.t_s - ctx.state.steering.tacked_s < APART_S or is_busy(ctx, TACK) or is_uploading:
        return
    if not ctx.is_closed(boat, leg[1], wind):
        return   # the leg is open: the autopilot follows it
    off = difference_rad(wind[0], vehicle.heading_rad)
    if not 0.5 * ctx.no_go_half_rad < abs(off) < 1.5 * ctx.no_go_half_rad:
        return   # she is not close-hauled: turning, or bearing away
    side = 1.0 if off >= 0.0 else -1.0
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    now_m = _clearance_m(ctx, boat, vehicle.heading_rad, LEAD_S)
    why = f"{now_m:.0f} m clear ahead on this tack in {LEAD_S:g} s"
    if now_m >= floor_m:
        if now_m >= float(ctx.voyage.area.clearance_m([boat])[0]) - HAIR_M or _may_fail(ctx, boat, wind, floor_m):
            return
        why = "a tack that failed later would bring her below the floor"
    other_rad = wrap_pi(wind[0] + side * ctx.no_go_half_rad)
    if _clearance_m(ctx, boat, other_rad, LOOK_S) > now_m + GAIN_M:
        tack(ctx, "short tack", f"{why}: tacking before the corridor's edge")


def _may_fail(ctx: StepContext, boat: PointEn, wind: tuple[float, float], floor_m: float) -> bool:
    """Return whether a tack in the next step may fail, as often in a row as is likely, and she keeps the floor.

    While she lies the current that is believed carries her, planned for or not, and as much as is not told brings her
    nearer to whatever is near; she is blown back, or is not, or is set to lee.
    """
    vehicle, water = ctx.snapshot.vehicle, ctx.snapshot.current
    chance = ctx.state.tacking.chance(ctx.voyage.boat.tack_fails)
    if vehicle is None or chance <= 0.0:
        return True
    course, speed = vehicle.heading_rad, math.hypot(*ctx.through_en_mps)
    there = _there(ctx, boat, course, NEXT_S)
    tacking, is_starboard = ctx.state.tacking, difference_rad(wind[0], course) > 0.0
    irons_s = max(IRONS_S, tacking.irons_s)
    need_m = floor_m + irons_s * min(water.sigma_mps, UNTOLD_MPS)
    learned_mps = tacking.starboard_lee_mps if is_starboard else tacking.port_lee_mps
    lee = lee_set(course_rad=course, twd_from_rad=wind[0], lee_mps=max(learned_mps, SET_SHARE * wind[1]))
    set_en_mps = (water.en_mps[0] + lee[0], water.en_mps[1] + lee[1])
    for failures in range(1, TRIES + 1):
        blown, still = _failed(there, course, speed, wind, water.en_mps, irons_s)
        _, aside = _failed(there, course, speed, wind, set_en_mps, irons_s)
        if min(ctx.voyage.area.path_clearance_m(way) for way in (blown, still, aside)) < need_m:
            return False
        if chance ** (failures + 1) <= RISKY:
            return True
        there, speed = aside[-1], AGAIN_SHARE * math.hypot(*ctx.through_en_mps)
    return True


def _failed(
    there: PointEn, course_rad: float, speed_mps: float, wind: tuple[float, float], carried_en_mps: PointEn,
    irons_s: float,
) -> tuple[list[PointEn], list[PointEn]]:
    """Return the tracks of a tack that fails, blown back and not, as lists of places."""
    blown, still = failed_tack(there, course_rad=course_rad, speed_mps=speed_mps, twd_from_rad=wind[0],
                               tws_mps=wind[1], current_en_mps=carried_en_mps, irons_s=irons_s)
    return [(float(e), float(n)) for e, n in blown], [(float(e), float(n)) for e, n in still]


def _clearance_m(ctx: StepContext, boat: PointEn, course_rad: float, span_s: float) -> float:
    """Return how clear the water is that a heading takes her through in ``span_s``, the current with her [m]."""
    return ctx.voyage.area.path_clearance_m([boat, _there(ctx, boat, course_rad, span_s)])


def _there(ctx: StepContext, boat: PointEn, course_rad: float, span_s: float) -> PointEn:
    """Return where a heading takes her in ``span_s``."""
    (east, north), through_m = ctx.current_en_mps, math.hypot(*ctx.through_en_mps) * span_s
    return moved((boat[0] + east * span_s, boat[1] + north * span_s), course_rad, through_m)


# --------------------
# A tack on a shift: on a leg that the autopilot beats, where the table of the wind's shifts says that it pays.
# The autopilot would stand on to its corridor's edge whatever the wind does. The tack is asked for within that
# corridor, which the plan's scorer found clear to both edges, so nothing is sailed that was not judged.


def shift_tack(ctx: StepContext) -> None:
    """Ask for a tack where it gains more than it costs."""
    boat, leg, wind, vehicle, status = ctx.boat_en, ctx.leg(), ctx.wind_now, ctx.snapshot.vehicle, ctx.autopilot
    if not ctx.config.shifts or boat is None or leg is None or wind is None or vehicle is None or status is None:
        return
    if not ctx.ahead() or status.mode is not Mode.AUTO or ctx.speed_mps < LEAST_MPS or tacks_fail(ctx) or (
            not ctx.voyage.boat.can_tack):
        return
    is_too_soon = ctx.t_s - ctx.state.steering.tacked_s < ctx.config.shift_tacks_apart_s
    if is_too_soon or is_busy(ctx, TACK) or ctx.state.pending.upload is not None:
        return
    half_rad = ctx.no_go_half_rad
    off_rad = difference_rad(wind[0], vehicle.heading_rad)
    if not ctx.is_closed(boat, leg[1], wind) or abs(abs(off_rad) - half_rad) > TURNING * half_rad:
        return
    beat = shifting(ctx, bearing_rad(*leg), distance_m(*leg) - along_m(boat, *leg))
    if beat is None:
        return
    to_go_s = math.dist(boat, leg[1]) / beat.table.made_good_mps
    if to_go_s < LAST_S:
        return
    is_port = off_rad < 0.0
    shift_rad = difference_rad(wind[0], beat.mean_rad)
    gain_s = beat.table.gain_s(cross_track_m(boat, *leg), shift_rad, is_port=is_port)
    if gain_s <= 0.0 or not is_left_to_beat(ctx, boat, leg[1]):
        return
    headed_deg = math.degrees(shift_rad if is_port else -shift_rad)
    edge = "layline" if beat.table.corridor_m < ctx.tack_corridor_m - 0.1 else "corridor's edge"
    words = f"headed {headed_deg:.0f}°" if headed_deg >= 0.5 else (
        f"lifted {max(0.0, -headed_deg):.0f}°, near the {edge}")
    tack(ctx, "shift tack", f"{words}: tack; expected gain {gain_s:.1f} s of {to_go_s:.0f} to go")

"""Beats that are left to the autopilot: whether, and how much room each needs (``problem.evaluate``)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from companion.boat import AutopilotLimits
from companion.boat.failed_tack import TRIES
from companion.boat.tracking import GuidanceModel, beat_band_m
from companion.geo.angles import difference_rad
from companion.skipper.step import StepContext
from companion.skipper.step.wind_shifts import shifting
from companion.skipper.way import PointEn, bearing_rad, cross_track_m
from companion.skipper.way.geometry import GYBE_RADIUS_M, LOOP_RADII

IRONS_MEMORY_S = 600.0
TACKS_FAIL_AFTER = TRIES  # failures in a row, or times in irons within IRONS_MEMORY_S, before tacks are left
WIDEST_M = 50.0  # a wider corridor is no corridor ...
WIDEST_BY_SHIFTS_M = 200.0  # ... but where the boat tacks on the shifts: then its edges are seldom met
CARRIED_S = 2.5  # of a tack, at the corridor's edge: where the water takes the boat meanwhile
OFF_LINE_M = 2.0  # so near the line a leg that begins anew is the same leg
LEAST_MPS = 0.5  # slower than this gybing round takes no longer
FOLLOWS_RAD = math.radians(10.0)  # this far outside its no-go zone the autopilot keeps to the line


def tacks_fail(ctx: StepContext) -> bool:
    """Return whether tacks failed, or the boat was in irons, so often of late that they are not tried."""
    recent = [t for t in ctx.state.steering.irons_s if ctx.t_s - t < IRONS_MEMORY_S]
    tacking, given = ctx.state.tacking, ctx.voyage.boat.tack_fails
    in_a_row = tacking.in_a_row if given > 0.0 and ctx.t_s - tacking.failed_s < IRONS_MEMORY_S else 0
    return max(len(recent), in_a_row) >= TACKS_FAIL_AFTER


def gybing_radius_m(ctx: StepContext) -> float:
    """Return the radius of the circle on which the boat gybes round [m]: her own, no less than waypoints ask for."""
    return max(GYBE_RADIUS_M, _full_mps(ctx) / ctx.voyage.boat.turn_rate_radps)


def gybing_s(ctx: StepContext) -> float:
    """Return what gybing round costs over the turn through the wind that a plan counts [s, at least 0]."""
    turn_s = 2.0 * ctx.no_go_half_rad / ctx.voyage.boat.turn_rate_radps
    return max(0.0, LOOP_RADII * gybing_radius_m(ctx) / max(_full_mps(ctx), LEAST_MPS) - turn_s)


def _full_mps(ctx: StepContext) -> float:
    wind = ctx.wind_mean
    return 0.0 if wind is None else ctx.voyage.boat.polar.max_speed_mps(wind[1])


def boards_within_m(ctx: StepContext) -> float | None:
    """Return what the boards of the autopilot's beat keep within, to either side of the leg [m].

    The overshoot of a tack at the corridor's edge is in it, and where the current sets it meanwhile. None without a
    corridor: the autopilot then sails to the layline, wherever that is.
    """
    corridor, wind = ctx.tack_corridor_m, ctx.wind_mean
    widest = WIDEST_BY_SHIFTS_M if ctx.config.shifts else WIDEST_M
    if wind is None or not 0.0 < corridor <= widest or not ctx.config.sails:
        return None
    boat = ctx.voyage.boat
    limits = ctx.snapshot.limits or AutopilotLimits(sail_xtrack_max_m=corridor)
    helm = replace(GuidanceModel.of(limits), corridor_m=corridor, no_go_half_rad=ctx.no_go_half_rad)
    return beat_band_m(helm, boat.polar, tws_mps=wind[1]) + CARRIED_S * math.hypot(*ctx.current_en_mps)


def corridor_room_m(ctx: StepContext) -> float | None:
    """Return how far from everything solid a closed leg must be for the autopilot's beat about it [m].

    What its boards keep within, the hull's reach, and the margin's floor beyond that; None where that is none. Whether
    each board keeps the floor in the wind's spread is the planner's to say (``companion.planner.track``).
    """
    within_m = boards_within_m(ctx)
    if within_m is None:
        return None
    return within_m + ctx.voyage.boat.hull.reach_m + ctx.config.margin_floor_m


def room_m(ctx: StepContext) -> float | None:
    """Return ``corridor_room_m`` where beats may be planned for the autopilot, None where not."""
    if not (ctx.config.autopilot_beats and ctx.voyage.boat.can_tack) or ctx.snapshot.limits is None or tacks_fail(ctx):
        return None
    return corridor_room_m(ctx)


def problem_beat(ctx: StepContext, margin_m: float) -> dict[str, Any] | None:
    """Return the ``beat`` of a problem whose obstacles are grown by ``margin_m``, None without one."""
    room = room_m(ctx)
    if room is None:
        return None
    boat, by_shifts = ctx.voyage.boat, shifting(ctx)
    tack_s = 2.0 * ctx.no_go_half_rad / boat.turn_rate_radps + boat.tack_loss_s
    return {
        # the angle that the boat's bow is held at, with leeway too: on a leg at its course's angle it would be held
        # below
        "no_go_half_deg": math.degrees(ctx.no_go_half_rad),
        "corridor_m": ctx.tack_corridor_m,
        "clearance_m": max(0.0, room - margin_m),
        "tack_s": tack_s if by_shifts is None else min(tack_s, by_shifts.tack_s),
    }


def may_restart_leg(ctx: StepContext) -> bool:
    """Return whether an upload may come now: it makes the present leg begin at the boat, and its corridor with it.

    On a beat the boat may be the corridor's width off the line already; from there it could get as far off again.
    """
    boat, leg, wind = ctx.boat_en, ctx.leg(), ctx.wind_now
    if boat is None or leg is None or wind is None or abs(cross_track_m(boat, *leg)) <= OFF_LINE_M:
        return True
    room = corridor_room_m(ctx)
    if room is None or abs(difference_rad(wind[0], bearing_rad(boat, leg[1]))) > ctx.no_go_half_rad + FOLLOWS_RAD:
        return True
    return ctx.voyage.area.path_clearance_m([boat, leg[1]]) >= room


def is_left_to_beat(ctx: StepContext, a: PointEn, b: PointEn) -> bool:
    """Return whether the autopilot may beat from a to b: the water is clear by ``room_m``."""
    room = room_m(ctx)
    return room is not None and ctx.voyage.area.path_clearance_m([a, b]) >= room


def beaten_within_m(ctx: StepContext) -> float:
    """Return how far off the present leg the autopilot's own beat takes the boat [m]; 0 where it does not beat.

    It beats where the leg lies in the no-go zone, by the wind that there is or by its mean: a lift does not end a beat.
    """
    leg = ctx.leg()
    if leg is None or not any(ctx.is_closed(*leg, wind) for wind in (ctx.wind_now, ctx.wind_mean)):
        return 0.0
    return (boards_within_m(ctx) or 0.0) if is_left_to_beat(ctx, *leg) else 0.0

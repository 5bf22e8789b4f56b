"""Other vessels under way: what plans are told of them, and the route being sailed held against them.

A plan gets the vessels as predictions with their spread, and their part of its promise
(``companion.planner.risk.chance_constraint``): on the ladder's first step that is within 1 - delta_s, later steps risk
more for them and the promise says so. A plan keeps farther away than where the active route is given up, so that it is
not made again for the next report.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from companion.geo.angles import difference_rad
from companion.messages import Target
from companion.planner.problem import VESSELS_SHARE, sigmas_for, vessel_count
from companion.skipper.planning.ladder import first_of_auto
from companion.skipper.planning.right_of_way import MEET_SHARE, bow_discs, held_of, is_stood_on_to, regions
from companion.skipper.step.context import StepContext
from companion.skipper.way import PointEn, bearing_rad, distance_m
from companion.skipper.way.geometry import leg_distance_m
from companion.skipper.way.judge import LOST_MPS
from companion.traffic import Conflict, Vessel, check_legs, path_distance_m, peril_m, planning_discs, predict
from companion.traffic.colregs import expected
from companion.traffic.occupancy import Keep
from companion.traffic.plans import PlainLeg, TimedLeg, pressing
from companion.traffic.predict import tail_factor

PART_BY_RUNG = (1.0, 4.0, 8.0)  # times the vessels' part of the promise, by the ladder's rung
LEAST_DELTA_S = 0.5  # no plan promises less: of the ladder's last rungs the vessels get what is left
GIVE_UP_RISK = 1e-1  # the active route is given up for a likelier meeting, at an instant, only
OWN_TIMING_MPS = 0.1  # how fast our own place along the route becomes uncertain: a sailboat's speed, tacks
HORIZON_S = 600.0  # the plan is made again long before
ALIKE_S = 300.0  # successive ways are compared over this time
SETTLED_M = 50.0  # discs this uncertain grow no more: else later ones would close a lake
UNKNOWN_S = 30.0  # a vessel of unknown course could be anywhere soon: only the next moments count
NEAREST = 12  # vessels that a plan looks at: half of them those that come nearest, if both go on or we
#                              stay; then those that could be met soonest, however the boat turns and we do
OWN_MPS = 4.0  # no boat of ours closes faster by itself
FAR_RISK = 1e-2  # that a vessel is nearer than counted when those that could be met are chosen
HAIR_M = 1.0  # a boat within a disc is let out of it: the disc ends this much before the boat


def near(ctx: StepContext) -> tuple[Vessel, ...]:
    """Return the vessels that could be met within the horizon, the soonest first; of too many those that matter most.

    Encounters that are held stay; then half of the places are of those that come nearest: a ship that comes straight at
    us is not left out for a dozen at their moorings near by.
    """
    picture, boat = ctx.snapshot.traffic, ctx.boat_en
    if picture is None or boat is None:
        return ()
    soon = []
    for vessel in picture.vessels:
        there = predict(vessel, ctx.t_s)
        closing_mps = OWN_MPS + math.hypot(*there.velocity_en_mps)
        gap_m = distance_m(boat, there.mean_en_m) - there.radius_m(FAR_RISK) - ctx.config.traffic_clearance_m
        if gap_m < closing_mps * HORIZON_S:
            soon.append((gap_m / closing_mps, vessel.mmsi, vessel.branch, vessel))
    soon.sort(key=lambda s: s[:3])
    if len(soon) > NEAREST:
        own = ctx.snapshot.vehicle
        velocities = ((0.0, 0.0), own.velocity_en_mps if own is not None else (0.0, 0.0))
        held = {(h.mmsi, h.branch) for h in ctx.state.traffic.encounters}
        by_peril = sorted(
            soon,
            key=lambda s: (
                s[1:3] not in held,
                min(peril_m(boat, velocity, s[3], ctx.t_s) for velocity in velocities),
                s[1:3],
            ),
        )
        kept = {s[1:3] for s in by_peril[: NEAREST // 2]}
        kept.update(s[1:3] for s in [s for s in soon if s[1:3] not in kept][: NEAREST - len(kept)])
        soon = [s for s in soon if s[1:3] in kept]
    return tuple(vessel for *_, vessel in soon)


def lies_at_goal(ctx: StepContext) -> str:
    """Return which vessel lies so near to the next goal that no plan leads there, and what helps; empty: none does."""
    gate, keep_m = ctx.gate, ctx.config.traffic_clearance_m
    for vessel in () if gate is None else _lying(ctx):
        assert gate is not None
        off_m = max(0.0, distance_m(vessel.centre_en_m, gate.en_m) - vessel.reach_m)
        if off_m < keep_m - gate.radius_m:
            return (
                f"{vessel.label} lies {off_m:.0f} m from {gate.name}, and [traffic] safe_distance_m keeps {keep_m:g} m "
                f"from her{_assumed(vessel)}: it is not reached while she lies there; the order skip_goal gives it up"
            )
    return ""


def lies_in_the_way(ctx: StepContext) -> str:
    """Return which vessel lies at the next goal or beside the straight way to it, and what helps; empty: none does."""
    gate, boat, keep_m = ctx.gate, ctx.boat_en, ctx.config.traffic_clearance_m
    at_goal = lies_at_goal(ctx)
    if at_goal or gate is None or boat is None:
        return at_goal
    for vessel in _lying(ctx):
        off_m = max(0.0, leg_distance_m(vessel.centre_en_m, boat, gate.en_m) - vessel.reach_m)
        if off_m < keep_m:
            return (
                f"{vessel.label} lies {off_m:.0f} m from the straight way to {gate.name}, and [traffic] "
                f"safe_distance_m keeps {keep_m:g} m from her{_assumed(vessel)}: where no other way leads there she "
                "has to go first, or the order skip_goal gives it up"
            )
    return ""


def _assumed(vessel: Vessel) -> str:
    """Return in words which size is assumed of a vessel that tells none; empty: she does."""
    hull = vessel.hull
    if hull.is_known:
        return ""
    size = f"{hull.length_m:.0f} by {hull.beam_m:.0f} m"
    return f" (her size is not told and taken to be {size}: a receiver as a feed has it)"


def _lying(ctx: StepContext) -> list[Vessel]:
    return [v for v in near(ctx) if v.lies]


def discs(ctx: StepContext, vessels: Sequence[Vessel], t_s: float, sigmas: float) -> tuple[Target, ...]:
    """Return where not to be because of ``vessels``, in times from ``t_s`` on [s], ``sigmas`` wide."""
    hull = ctx.voyage.boat.hull
    keep = Keep(
        sigmas=sigmas,
        clearance_m=ctx.config.traffic_clearance_m,
        horizon_s=HORIZON_S,
        own_timing_mps=OWN_TIMING_MPS,
        own_radius_m=hull.reach_m,
        ahead_m=ctx.config.traffic_clearance_m,
        settled_m=SETTLED_M,
    )
    known = [v for v in vessels if v.is_moving_known]
    unknown = [v for v in vessels if not v.is_moving_known]
    met = {(h.mmsi, h.branch) for h in ctx.state.traffic.encounters}
    holding = [v for v in known if (v.mmsi, v.branch) in met]
    known = [v for v in known if (v.mmsi, v.branch) not in met]
    return (
        *(d for v in holding for d in planning_discs([v], t_s, keep, motion=expected(v))),
        *planning_discs(known, t_s, keep),
        *planning_discs(unknown, t_s, replace(keep, horizon_s=UNKNOWN_S)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Shares:
    """The vessels of a plan and how the promise is shared: ``delta_s`` of both, ``wind_delta_s``, the vessels' part.

    ``part`` is None without vessels: then all of it is the wind's.
    """

    targets: tuple[Target, ...]
    delta_s: float
    wind_delta_s: float
    part: float | None


def shares(ctx: StepContext, start_en: PointEn, after_s: float, rung: int, delta_s: float) -> Shares:
    """Return what a plan is told that starts at ``start_en`` in ``after_s``, on a rung of the ladder.

    The wind keeps its part on every rung. Where the start is within a vessel's disc already, its discs shrink to let
    the boat out: none nearer than now. What that risks is in the plan's path risk. By the rules of the road a vessel
    that keeps out of our way is left to do so, unless another has to be kept clear of: whoever alters course does it
    clear of all. One that we give way to adds regions on the first rung.
    """
    vessels = near(ctx)
    is_met = bool(ctx.state.traffic.encounters) and bool(meetings(ctx))
    if not is_met:
        vessels = tuple(v for v in vessels if not ((held := held_of(ctx, v)) is not None and held.stands_on))
    found = discs(ctx, vessels, ctx.t_s + after_s, 0.0)
    if not found:
        return Shares(targets=(), delta_s=delta_s, wind_delta_s=delta_s, part=None)
    of_wind = (1.0 - VESSELS_SHARE) * (1.0 - delta_s)
    wanted = VESSELS_SHARE * (1.0 - delta_s) * PART_BY_RUNG[min(rung, len(PART_BY_RUNG) - 1)]
    part = min(wanted, 1.0 - LEAST_DELTA_S - of_wind)
    inside_m: dict[int, float] = {}
    sigmas = sigmas_for(part, vessel_count(found))
    for target in found:
        if target.from_s <= 0.0 and target.spread is not None:
            gap_m = distance_m(start_en, target.centre_en_m(0.0)) - target.radius_m - sigmas * target.spread.sigma_m
            inside_m[target.spread.vessel] = HAIR_M - gap_m
    out = []
    for target in found:
        assert target.spread is not None
        radius_m = target.radius_m - max(0.0, inside_m.get(target.spread.vessel, 0.0))
        growth_mps = target.growth_mps + sigmas * target.spread.sigma_mps
        if radius_m + sigmas * target.spread.sigma_m + growth_mps * target.from_s > 0.0:
            out.append(replace(target, radius_m=radius_m))
    if not out:
        return Shares(targets=(), delta_s=delta_s, wind_delta_s=delta_s, part=None)
    if rung <= first_of_auto(ctx.config) and ctx.state.traffic.encounters:
        out += regions(ctx, vessels, start_en, after_s, is_met=is_met)
    least = max(LEAST_DELTA_S, 1.0 - of_wind - part)  # a half and not the last digit below it
    return Shares(targets=tuple(out), delta_s=least, wind_delta_s=1.0 - of_wind, part=part)


def timed_legs(ctx: StepContext, points: Sequence[PointEn] | None = None) -> tuple[PlainLeg, ...]:
    """Return a way from the boat through ``points``, or what is left of the route, timed by the polar in mean wind."""
    boat, wind, vehicle = ctx.boat_en, ctx.wind_mean, ctx.snapshot.vehicle
    if boat is None or wind is None or vehicle is None:
        return ()
    model, legs, t_s, heading = ctx.voyage.boat, [], 0.0, vehicle.heading_rad
    for a, b in pairwise((boat, *(ctx.ahead() if points is None else points))):
        length = distance_m(a, b)
        if length < 1e-6:
            continue
        course = bearing_rad(a, b)
        twa = abs(difference_rad(wind[0], course))
        closed = ctx.no_go_half_rad
        speed = model.polar.speed_mps(max(twa, closed), wind[1])
        if twa < closed:
            speed *= math.cos(closed) / math.cos(twa)  # the autopilot will beat there
        begin = t_s + abs(difference_rad(course, heading)) / model.turn_rate_radps
        t_s = begin + length / max(speed, LOST_MPS)
        legs.append(PlainLeg(from_en=a, to_en=b, start_s=begin, end_s=t_s))
        heading = course
    return tuple(legs)


def apart_m(ctx: StepContext, points: Sequence[PointEn]) -> float | None:
    """Return how different a new way through ``points`` looks from what is left of the route [m].

    The discrete Fréchet distance of the next ``ALIKE_S`` of both; None without a route or a position.
    """
    old, new = soon(timed_legs(ctx), ALIKE_S), soon(timed_legs(ctx, points), ALIKE_S)
    if not old or not new:
        return None
    return path_distance_m(old, new)


def soon(legs: Sequence[TimedLeg], seconds: float) -> list[PointEn]:
    """Return the points of a way up to where the boat is after ``seconds``."""
    points = [legs[0].from_en] if legs else []
    for leg in legs:
        if leg.start_s >= seconds:
            break
        share = min(1.0, (seconds - leg.start_s) / (leg.end_s - leg.start_s))
        points.append(
            (
                leg.from_en[0] + share * (leg.to_en[0] - leg.from_en[0]),
                leg.from_en[1] + share * (leg.to_en[1] - leg.from_en[1]),
            )
        )
    return points


def meetings(ctx: StepContext) -> tuple[Conflict, ...]:
    """Return where the route meets vessels soon enough to act, in order of time; empty when it is clear."""
    vessels, boat = [v for v in near(ctx) if not is_stood_on_to(ctx, v)], ctx.boat_en
    if not vessels or boat is None:
        return ()
    bows = (d for d in bow_discs(ctx, vessels, ctx.t_s, MEET_SHARE) if distance_m(boat, (d.x_m, d.y_m)) > d.radius_m)
    found = (*discs(ctx, vessels, ctx.t_s, tail_factor(GIVE_UP_RISK)), *bows)
    return pressing(check_legs(timed_legs(ctx), found))

"""Other vessels under way: the discs that plans keep out of, and the route being sailed held against them.

Plans keep out of discs of a smaller risk than the one for which the active route is given up, so that a plan just
made is not made again for the next report. A plan that cannot be found is tried with the next risk of the ladder.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from companion.geo.angles import difference_rad
from companion.planner.problem import Target
from companion.skipper.geometry import bearing_rad, distance_m
from companion.skipper.judge import LOST_MPS
from companion.skipper.turn import Turn
from companion.skipper.voyage import PointEn
from companion.traffic import Conflict, Disc, Vessel, check_legs, planning_discs, predict
from companion.traffic.occupancy import Keep

RISKS = (1e-2, 5e-2, 2e-1)   # that a vessel is outside its disc, by the ladder's rung
GIVE_UP_RISK = 1e-1          # the active route is given up for a likelier meeting only
HORIZON_S = 300.0            # the plan is made again long before; later discs would close a lake
SETTLED_S = 120.0            # discs of later windows grow no more: by then there are new reports, and each step checks
UNKNOWN_S = 30.0             # a vessel of unknown course could be anywhere soon: only the next moments count
NEAREST = 12                 # vessels that a plan looks at: those that could be met soonest
OWN_MPS = 4.0                # no boat of ours closes faster by itself
HAIR_M = 1.0                 # a boat within a disc is let out of it: the disc ends this much before the boat


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A leg of the route in time, from now on [s]; ``companion.traffic.plans.TimedLeg``."""

    from_en: PointEn
    to_en: PointEn
    start_s: float
    end_s: float


def near(turn: Turn) -> tuple[Vessel, ...]:
    """Return the vessels that could be met within the horizon, the soonest first."""
    picture, boat = turn.snapshot.traffic, turn.boat_en
    if picture is None or boat is None:
        return ()
    soon = []
    for vessel in picture.vessels:
        there = predict(vessel, turn.t_s)
        closing_mps = OWN_MPS + math.hypot(*there.velocity_en_mps)
        gap_m = distance_m(boat, there.mean_en_m) - there.radius_m(RISKS[0]) - turn.config.traffic_clearance_m
        if gap_m < closing_mps * HORIZON_S:
            soon.append((gap_m / closing_mps, vessel.mmsi, vessel.branch, vessel))
    return tuple(vessel for *_, vessel in sorted(soon, key=lambda s: s[:3])[:NEAREST])


def discs(turn: Turn, vessels: Sequence[Vessel], t_s: float, risk: float) -> tuple[Disc, ...]:
    """Return where not to be because of ``vessels``, in times from ``t_s`` on [s]."""
    hull = turn.voyage.boat.hull
    keep = Keep(
        risk=risk, clearance_m=turn.config.traffic_clearance_m, horizon_s=HORIZON_S,
        own_radius_m=0.5 * math.hypot(hull.length_m, hull.beam_m), ahead_m=turn.config.traffic_clearance_m,
    )
    known = [v for v in vessels if v.is_moving_known]
    unknown = [v for v in vessels if not v.is_moving_known]
    found = (*planning_discs(known, t_s, keep), *planning_discs(unknown, t_s, replace(keep, horizon_s=UNKNOWN_S)))
    return tuple(_settled(disc) for disc in found)


def _settled(disc: Disc) -> Disc:
    """Return the disc with the radius that it has at its window's begin, if that is late.

    A route that had to keep out of everywhere that a vessel might be in five minutes would flee from all of them.
    """
    if disc.from_s < SETTLED_S - 1e-6:
        return disc
    return replace(disc, radius_m=disc.radius_at_m(disc.from_s), growth_mps=0.0)


def targets(turn: Turn, start_en: PointEn, after_s: float, rung: int) -> tuple[Target, ...]:
    """Return the planner's targets for a plan that starts at ``start_en`` in ``after_s``, on a rung of the ladder.

    Where the start is within a vessel's disc already, its discs shrink to let the boat out: none nearer than now.
    """
    found = discs(turn, near(turn), turn.t_s + after_s, RISKS[min(rung, len(RISKS) - 1)])
    inside_m: dict[tuple[int, str], float] = {}
    for disc in found:
        if disc.from_s <= 0.0:
            gap_m = distance_m(start_en, disc.centre_en_m(0.0)) - disc.radius_at_m(0.0)
            inside_m[disc.mmsi, disc.name] = HAIR_M - gap_m
    out = []
    for disc in found:
        radius_m = disc.radius_m - max(0.0, inside_m.get((disc.mmsi, disc.name), 0.0))
        if radius_m + disc.growth_mps * disc.from_s > 0.0:
            out.append(Target(
                x_m=disc.x_m, y_m=disc.y_m, vx_mps=disc.vx_mps, vy_mps=disc.vy_mps, radius_m=radius_m,
                growth_mps=disc.growth_mps, from_s=disc.from_s, until_s=disc.until_s, name=disc.name))
    return tuple(out)


def timed_legs(turn: Turn) -> tuple[Leg, ...]:
    """Return what is left of the route, timed by the polar in the mean wind."""
    boat, wind, vehicle = turn.boat_en, turn.wind_mean, turn.snapshot.vehicle
    if boat is None or wind is None or vehicle is None:
        return ()
    model, legs, t_s, heading = turn.voyage.boat, [], 0.0, vehicle.heading_rad
    for a, b in pairwise((boat, *turn.ahead())):
        length = distance_m(a, b)
        if length < 1e-6:
            continue
        course = bearing_rad(a, b)
        twa = abs(difference_rad(wind[0], course))
        closed = turn.no_go_half_rad
        speed = model.polar.speed_mps(max(twa, closed), wind[1])
        if twa < closed:
            speed *= math.cos(closed) / math.cos(twa)   # the autopilot will beat there
        begin = t_s + abs(difference_rad(course, heading)) / model.turn_rate_radps
        t_s = begin + length / max(speed, LOST_MPS)
        legs.append(Leg(from_en=a, to_en=b, start_s=begin, end_s=t_s))
        heading = course
    return tuple(legs)


def meetings(turn: Turn) -> tuple[Conflict, ...]:
    """Return where the route being sailed meets vessels, in order of time; empty when it is clear."""
    vessels = near(turn)
    if not vessels:
        return ()
    return check_legs(timed_legs(turn), discs(turn, vessels, turn.t_s, GIVE_UP_RISK))

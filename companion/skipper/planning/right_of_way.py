"""How a plan gives way: regions that a planner in time keeps out of beside the vessels' own discs.

Under the rules of the road (``companion.traffic.colregs``) a change of course is to be early, apparent (rule 8) and
not across the other's bow (rule 15). All three are regions that go with time, so that every planner that knows moving
discs obeys them, and nothing else of it changes:

- ahead of a vessel that we give way to a row of discs goes before its bow, as long as it sails in ``AHEAD_S``. What is
  left is to pass astern, or so far ahead that there is no risk. (Fujii's and Coldwell's domains are longer ahead, too.)
- a disc stands on our old course in front of us for the first moments: its tangents are 30 degrees off the course, so
  that a change of course is no smaller. When the change has shown, it is gone, and the way may come back.
- discs to port of our old course close that side where the rules do not want a turn to port (14, 17 c).

A region that the boat is in already cannot be kept out of and is left out; where no plan is found, the ladder's next
step is made without any of them: to be clear comes before to be correct.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from companion.messages import Target
from companion.skipper.step.context import StepContext
from companion.skipper.way import PointEn, distance_m, moved
from companion.traffic import Policy, Role, Vessel, predict
from companion.traffic.colregs import APPARENT_RAD, OngoingEncounter

AHEAD_S = 60.0  # crossing ahead of a bow by more than this is no risk
BOW_STEP = 1.0  # of their radius: the row's discs overlap, nothing slips through
BOW_HORIZON_S = 300.0
MEET_SHARE = 0.6  # of their radius: a route is given up later than a plan keeps away
LEAST_MPS = 0.5
PASSES_CLEAR = 2.0  # times the clearance: who will pass so far off needs nobody's steady course
APPARENT_S, APPARENT_M = 30.0, (50.0, 150.0)  # how long, and how far ahead of us, the change of course is to show
CROSSING_RAD = (math.radians(20.0), math.radians(160.0))  # between the courses of two vessels that cross
PORT_RAD = (math.radians(-45.0), math.radians(-95.0))


def held_of(ctx: StepContext, vessel: Vessel) -> OngoingEncounter | None:
    """Return the encounter with a vessel."""
    key = (vessel.mmsi, vessel.branch)
    return next((h for h in ctx.state.traffic.encounters if (h.mmsi, h.branch) == key), None)


def is_stood_on_to(ctx: StepContext, vessel: Vessel) -> bool:
    """Return whether a vessel is left to keep out of our way: no plan is made because of it."""
    if ctx.config.traffic_policy is not Policy.RULES:
        return False
    held = held_of(ctx, vessel)
    if held is not None:
        return held.stands_on
    # A boat that hardly moves meets nobody: it has no course to keep.
    return ctx.speed_mps >= LEAST_MPS and any(
        a.encounter.role is Role.STAND_ON
        for a in ctx.state.traffic.watch
        if (a.vessel.mmsi, a.vessel.branch) == (vessel.mmsi, vessel.branch)
    )


def stands_on(ctx: StepContext) -> bool:
    """Return whether course and speed are to be kept: there is an encounter in which we stand on."""
    return any(
        h.stands_on and h.apart_s is None and h.cpa_m < PASSES_CLEAR * ctx.config.traffic_clearance_m
        for h in ctx.state.traffic.encounters
    )


def bow_discs(ctx: StepContext, vessels: Sequence[Vessel], t_s: float, share: float = 1.0) -> tuple[Target, ...]:
    """Return the rows ahead of the bows that we must not cross, in times from ``t_s`` on [s]."""
    out: list[Target] = []
    for vessel in vessels:
        held = held_of(ctx, vessel)
        if held is None or not held.must_act or held.encounter.role is Role.KEEP_CLEAR:
            continue
        there = predict(vessel, t_s)
        speed = math.hypot(*there.velocity_en_mps)
        between = abs(math.remainder(there.course_rad - held.course_rad, 2.0 * math.pi))
        if speed < LEAST_MPS or not CROSSING_RAD[0] < between < CROSSING_RAD[1]:
            continue
        radius = share * (there.reach_m + ctx.voyage.boat.hull.reach_m + ctx.config.traffic_clearance_m)
        reach = there.reach_m + AHEAD_S * speed
        for n in range(1, 1 + math.ceil(reach / (BOW_STEP * radius))):
            centre = moved(there.mean_en_m, there.course_rad, min(n * BOW_STEP * radius, reach))
            out.append(
                Target(
                    x_m=centre[0],
                    y_m=centre[1],
                    vx_mps=there.velocity_en_mps[0],
                    vy_mps=there.velocity_en_mps[1],
                    radius_m=radius,
                    growth_mps=0.0,
                    from_s=0.0,
                    until_s=BOW_HORIZON_S,
                    name=vessel.label,
                    mmsi=vessel.mmsi,
                )
            )
    return tuple(out)


def regions(
    ctx: StepContext, vessels: Sequence[Vessel], start_en: PointEn, after_s: float, *, is_met: bool
) -> tuple[Target, ...]:
    """Return what a plan that starts at ``start_en`` in ``after_s`` keeps out of by the rules.

    ``is_met``: the way sailed now meets a vessel, so that there is a change of course to be seen.
    """
    out = [replace(d, name=f"ahead of {d.name}") for d in bow_discs(ctx, vessels, ctx.t_s + after_s)]
    for vessel in vessels if is_met else ():
        held = held_of(ctx, vessel)
        if held is not None and held.must_act and not held.altered:
            out += _apparent(ctx, held, start_en)
    return tuple(t for t in out if distance_m(start_en, (t.x_m, t.y_m)) > t.radius_m)


def _apparent(ctx: StepContext, held: OngoingEncounter, start_en: PointEn) -> list[Target]:
    """Return what stands before us until the change of course shows."""
    speed = max(ctx.speed_mps, 1.0)
    ahead_m = min(max(APPARENT_S * speed, APPARENT_M[0]), APPARENT_M[1])
    courses = [0.0] if held.gives_way else []
    if held.not_to_port:
        courses += PORT_RAD
    out = []
    for off in courses:
        centre = moved(start_en, held.course_rad + off, ahead_m)
        out.append(
            Target(
                x_m=centre[0],
                y_m=centre[1],
                vx_mps=0.0,
                vy_mps=0.0,
                radius_m=ahead_m * math.sin(APPARENT_RAD),
                growth_mps=0.0,
                from_s=0.0,
                until_s=2.0 * ahead_m / speed,
                name=f"apparent to {held.label}",
            )
        )
    return out

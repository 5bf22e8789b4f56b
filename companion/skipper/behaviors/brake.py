"""Too near to plan round: a leg that meets something sooner than a plan can be in place is not sailed on.

It happens to a boat that has not come where she is by a plan: handed back by a person, put right after a false
position. A plan, its upload, the reading back and the turn take six seconds, a command one: LOITER first, whose circle
begins where she could stop, then a plan from there.
"""

from __future__ import annotations

import math

from companion.frozen import changed
from companion.messages import Mode, Severity
from companion.skipper.behaviors.headings import course_rad
from companion.skipper.behaviors.helm import is_busy, set_mode
from companion.skipper.step.context import StepContext
from companion.skipper.step.state import Phase
from companion.skipper.way.drift import DriftAhead, drift_ahead
from companion.skipper.way.geometry import bearing_rad, distance_m
from companion.skipper.way.voyage import water_at

REACT_S = 8.0        # a step to see it, a plan, its upload and reading back, the turn: six seconds; and two to spare
LEAST_M = 2.0        # how far the autopilot wanders off its line
SLOW_MPS = 0.5       # slower she does not come far in that time
HAIR_M = 0.5


def ahead_of(ctx: StepContext) -> DriftAhead | None:
    """Return what the way to the present waypoint meets within ``REACT_S``, None when nothing or nobody sails it."""
    boat, leg, status = ctx.boat_en, ctx.leg(), ctx.autopilot
    if boat is None or leg is None or status is None or not ctx.ahead():
        return None
    if status.mode not in {Mode.AUTO, ctx.sails_in} or ctx.is_by_field:
        return None   # the field looks ahead by itself, and follows no leg
    speed, left_m = ctx.speed_mps, distance_m(boat, leg[1])
    if speed < SLOW_MPS or left_m < 1.0:
        return None
    course = bearing_rad(boat, leg[1])
    if status.mode is Mode.GUIDED and ctx.is_closed(boat, leg[1], ctx.wind_now):
        steered = course_rad(ctx)   # nothing turns her there but another plan
        if steered is None:
            return None
        course, left_m = steered, math.inf
    hull_m, water = ctx.voyage.boat.hull.reach_m, water_at(ctx.voyage.area, boat)
    here_m = float(water.clearance_m([boat])[0])
    found = drift_ahead(
        water, boat, (speed * math.sin(course), speed * math.cos(course)),
        floor_m=max(0.0, min(hull_m + LEAST_M, here_m - HAIR_M)), horizon_s=min(REACT_S, left_m / speed))
    return None if found.is_clear else found


def brakes(ctx: StepContext) -> bool:
    """Ask for LOITER where the leg is shut too near to plan; True in the step in which it is asked for."""
    state = ctx.state
    if state.steering.until_s is not None or state.by_field.resort.engaged:
        return False
    if state.pending.upload is not None or not ctx.snapshot.permissions.may_set_mode:
        return False
    met = ahead_of(ctx)
    if met is None or is_busy(ctx, Mode.LOITER.name):
        return False
    text = f"{met.name} is {met.floor_s or 0.0:.0f} s ahead, too near to plan round: waiting in a loiter for a plan"
    if not set_mode(ctx, Mode.LOITER, text):
        return False
    ctx.set(operator=changed(ctx.state.operator, is_back=True))
    ctx.say(Severity.WARNING, "too near", text, every_s=0.0)
    ctx.phase(Phase.HOLDING, text)
    return True

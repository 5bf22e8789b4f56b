"""A boat that somebody or something has stopped, in words: where she drifts, what she meets and when, what to press.

A failsafe's stop is told every minute for as long as it lasts, whoever may end it. A person who has stopped her knows
that; he is told only when she drifts onto something.
"""

from __future__ import annotations

import math

from companion.frozen import changed
from companion.geo.angles import wrap_two_pi
from companion.messages import Mode, Severity
from companion.safety import CAUSES, HOMEWARD, PERSON
from companion.skipper.behaviors.failsafe import TOLD_S, is_answered
from companion.skipper.step.context import StepContext
from companion.skipper.way.drift import DriftAhead, drift_ahead
from companion.skipper.way.voyage import PointEn, outside_m, water_at

EVERY_S = 60.0
MOVES_MPS = 0.15      # slower than this the fixes' noise tells no drift
CARRIED_MPS = 3.0     # faster than this a disarmed boat is towed or carried
LOITER_M = 20.0       # so near to where RTL ends it loiters there
PATIENCE_S = 30.0     # an answer that is on its way is given this long before it is spoken of
ANOTHER_MPS = 0.25       # it is said again when it has changed by so much
REMIND_S = 1800.0


def speak_of_stop(ctx: StepContext) -> None:
    """Say how she drifts while a stop lasts."""
    stop = ctx.state.operator.stop
    if stop is None or ctx.autopilot is None or ctx.t_s - stop.t_s <= (
        PATIENCE_S if is_answered(ctx) else TOLD_S
    ) or ctx.is_said("adrift", EVERY_S):
        return
    here, vehicle = ctx.snapshot.position_en_m, ctx.snapshot.vehicle
    ahead = None if here is None or vehicle is None else _ahead(ctx, here, vehicle.velocity_en_mps)
    meets = ahead is not None and not ahead.is_clear
    if stop.cause == PERSON and not (meets and ahead is not None and MOVES_MPS <= ahead.speed_mps <= CARRIED_MPS):
        return
    mode = stop.mode.name if stop.mode is not None else "an unknown mode"
    by = "a person" if stop.cause == PERSON else f"the {stop.cause} failsafe"
    what = f"{mode if stop.is_armed else 'disarmed'} by {by}"
    where = "; her position is not known" if here is None or ahead is None else _where(ctx, here, ahead)
    ctx.say(Severity.CRITICAL if meets or not is_answered(ctx) else Severity.WARNING, "adrift",
             f"{what}{where}; {_remedy(ctx)}", every_s=EVERY_S)


def _ahead(ctx: StepContext, here: PointEn, velocity: tuple[float, float]) -> DriftAhead:
    """Follow the drift; in RTL the straight way to where the autopilot takes her. A loiter goes nowhere.

    Outside the fence the fence is left out.
    """
    status, area = ctx.snapshot.autopilot, water_at(ctx.voyage.area, here)
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    speed = math.hypot(*velocity)
    homeward = status is not None and status.mode in HOMEWARD
    far_m = status.waypoint_distance_m if status is not None and homeward else None
    course = status.target_bearing_rad if status is not None else None
    if status is not None and (status.mode is Mode.LOITER or (homeward and (far_m is None or far_m < LOITER_M))):
        return drift_ahead(area, here, (0.0, 0.0), floor_m=floor_m)
    if course is None or far_m is None:
        return drift_ahead(area, here, velocity, floor_m=floor_m)
    way = (speed * math.sin(course), speed * math.cos(course))
    return drift_ahead(area, here, way, floor_m=floor_m, horizon_s=max(1.0, far_m / max(speed, MOVES_MPS)))


def _where(ctx: StepContext, here: PointEn, ahead: DriftAhead) -> str:
    vehicle, far_m = ctx.snapshot.vehicle, outside_m(ctx.voyage.area, here)
    place = "" if vehicle is None else f" at {vehicle.position.lat_deg:.5f}, {vehicle.position.lon_deg:.5f}"
    fence = f", {far_m:.0f} m outside the fence" if far_m > 0.0 else ""
    if ctx.autopilot is not None and ctx.autopilot.mode in HOMEWARD and ahead.speed_mps > 0.0:
        course = math.degrees(wrap_two_pi(math.atan2(*ahead.velocity_en_mps)))
        way = f"sailing straight home, {course:03.0f}°"
        if ahead.floor_s is not None:
            meets = f"onto {ahead.name}" if ahead.contact_s is not None else f"past {ahead.name}"
            way += f", {meets} in {ahead.contact_s if ahead.contact_s is not None else ahead.floor_s:.0f} s"
    else:
        way = ahead.sentence() if ahead.speed_mps >= MOVES_MPS else "staying there"
    return f": {way}{place}{fence}"


def _remedy(ctx: StepContext) -> str:
    """Return what to press, and what would let the companion do it."""
    stop, may = ctx.state.operator.stop, ctx.snapshot.permissions
    if is_answered(ctx):
        return ctx.state.why
    if stop is not None and not stop.is_armed:
        return "arm her and press AUTO, or take her in MANUAL"
    cause = CAUSES.get(stop.cause) if stop is not None else None
    if cause is None:
        return "press AUTO to sail on, or take her in MANUAL"
    leave = "" if may.may_set_mode else " (the mission's [operator] set_auto would let the companion)"
    return f"press {cause.press}{leave}"


# --------------------
# What is said of the current: when plans begin to reckon with one, when it has become another, and what is not known.
# A tide table that has ended, or that no time can be found in, is said as soon as she is under way and every half hour.


def watch_water(ctx: StepContext) -> None:
    """Say what is new of the current."""
    current, told = ctx.snapshot.current, ctx.state.announced.water_en_mps
    if not ctx.state.voyage.sailing:
        return
    if current.verdict:
        ctx.say(Severity.WARNING, "tide table", current.verdict, every_s=REMIND_S)
    if not current.is_significant:
        if told is not None:
            ctx.set(announced=changed(ctx.state.announced, water_en_mps=None))
            ctx.say(Severity.INFO, "current", "the current is no longer told from still water: plans leave it out",
                     every_s=0.0)
        return
    if told is None or math.dist(told, current.en_mps) >= ANOTHER_MPS:
        ctx.set(announced=changed(ctx.state.announced, water_en_mps=current.en_mps))
        ctx.say(Severity.INFO, "current", f"{current.sentence()}: plans reckon with it", every_s=0.0)

"""The lookout: every vessel's approach, alarm and rule each step, and what is said of them.

An alarm needs CPA and TCPA both under their limits. Of each vessel one line is said in half a minute, one vessel a
step and the worst first: among many nobody can read more. The rules of the road are shown, and not relied upon: the
boat keeps clear of everyone (``companion.traffic.colregs``). Under the policy "rules" encounters are followed to past
and clear, and each is said when it begins and when what we do changes (``companion.traffic.colregs``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from companion.frozen import changed
from companion.messages import Severity
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.context import StepContext
from companion.traffic import Alarm, AlarmLimits, Assessment, OwnShip, Policy, assess
from companion.traffic.colregs import follow

SHOWN = 8                # vessels kept in the state: the worst
EVERY_S = 30.0           # between two lines of one vessel
# Acting begins nearer than warning: the shares of a lake's limits (``companion.traffic.LAKE``).
ACT_CPA, ACT_TCPA = 0.4, 0.5
SEVERITY = {Alarm.WARN: Severity.WARNING, Alarm.ACT: Severity.CRITICAL, Alarm.TOUCH: Severity.CRITICAL}


def limits(config: SkipperConfig) -> AlarmLimits:
    """Return when to warn and to act, from the distance and the time that the mission calls safe."""
    return AlarmLimits(
        warn_cpa_m=config.traffic_clearance_m, warn_tcpa_s=config.traffic_time_s,
        act_cpa_m=ACT_CPA * config.traffic_clearance_m, act_tcpa_s=ACT_TCPA * config.traffic_time_s)


def look_out(ctx: StepContext) -> None:
    """Judge the vessels in view and announce alarms that are new or go on."""
    picture, vehicle, boat = ctx.snapshot.traffic, ctx.snapshot.vehicle, ctx.boat_en
    if picture is None or vehicle is None or boat is None or not picture.vessels:
        if ctx.state.traffic.watch:
            ctx.set(traffic=changed(ctx.state.traffic, watch=()))
        return
    hull, wind, adrift = ctx.voyage.boat.hull, ctx.wind_now, ctx.state.adrift
    own = OwnShip(
        t_s=ctx.t_s, en_m=boat, velocity_en_mps=vehicle.velocity_en_mps, heading_rad=vehicle.heading_rad,
        radius_m=hull.reach_m,
        is_sailing=ctx.config.sails and not (adrift.motor and adrift.since_s is not None))   # rule 3 c
    found = assess(own, picture, limits(ctx.config), None if wind is None else wind[0])
    if ctx.config.traffic_policy is Policy.RULES:
        found = _meet(ctx, own, found)
    ctx.set(traffic=changed(ctx.state.traffic, watch=found[:SHOWN]))
    _say(ctx, found[:SHOWN])


def _meet(ctx: StepContext, own: OwnShip, found: Sequence[Assessment]) -> tuple[Assessment, ...]:
    """Follow the encounters, say which have changed, and return the vessels with what the rules gave each of them."""
    state, mean = ctx.state, ctx.wind_mean
    before = {(h.mmsi, h.branch): h for h in state.traffic.encounters}
    held = follow(state.traffic.encounters, own, found, t_s=ctx.t_s, clearance_m=ctx.config.traffic_clearance_m,
                  twd_from_rad=None if mean is None else mean[0])
    now = {(h.mmsi, h.branch): h for h in held}
    told = {t[:2]: t for t in state.announced.encounters}
    for one in found:
        key = one.vessel.mmsi, one.vessel.branch
        after, last = now.get(key), told.get(key)
        if after is None:
            continue
        what = "evident" if after.evident else after.encounter.role.value
        if last is not None and (last[2] == what or (ctx.t_s - last[3] < EVERY_S and not after.evident)):
            continue
        severity = (Severity.CRITICAL if after.evident else Severity.WARNING if after.stands_on else Severity.NOTICE)
        ctx.say(severity, "encounter", after.sentence(one.approach), every_s=0.0)
        told[key] = (*key, what, ctx.t_s)
    for key, gone in before.items():
        if key not in now:
            ctx.say(Severity.INFO, "encounter", f"{gone.label}: past and clear", every_s=0.0)
            told.pop(key, None)
    ctx.set(
        traffic=changed(ctx.state.traffic, encounters=held),
        announced=changed(ctx.state.announced, encounters=tuple(told.values())))
    return tuple(replace(one, encounter=now[key].encounter) if (
        key := (one.vessel.mmsi, one.vessel.branch)) in now else one for one in found)


def _say(ctx: StepContext, found: Sequence[Assessment]) -> None:
    """Say the worst of the alarms that were not said lately."""
    lately = tuple(told for told in ctx.state.announced.watch if ctx.t_s - told[2] < EVERY_S)
    known = {told[:2] for told in lately}
    news = next((a for a in found if a.alarm is not Alarm.NONE and (a.vessel.mmsi, a.vessel.branch) not in known), None)
    if news is not None:
        ctx.say(SEVERITY[news.alarm], "vessel near", news.sentence(), every_s=0.0)
        lately = (*lately, (news.vessel.mmsi, news.vessel.branch, ctx.t_s))
    ctx.set(announced=changed(ctx.state.announced, watch=lately))

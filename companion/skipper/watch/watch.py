"""The watch: watchdogs of the table, the lookout for vessels, and what is said of a boat that was stopped."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from companion.current import span_words
from companion.frozen import changed
from companion.geo.angles import direction, heading_of
from companion.messages import Mode, Severity
from companion.safety import BY_NAME, CAUSES, HOMEWARD, PERSON, TABLE, Response, Watchdog
from companion.skipper.behaviors.drifting import STEERAGE_MPS, is_driven_astern
from companion.skipper.behaviors.failsafe import TOLD_S, is_answered
from companion.skipper.planning.diversions import words
from companion.skipper.planning.fallback import may_fall_back
from companion.skipper.planning.vessels import lies_at_goal
from companion.skipper.step import SkipperConfig, StepContext
from companion.skipper.step.state import Raised
from companion.skipper.watch.measures import as_watched, measure
from companion.skipper.way.drift import DriftAhead, drift_ahead
from companion.skipper.way.shoals import beyond_words
from companion.skipper.way.voyage import PointEn, outside_m, water_at
from companion.traffic import Alarm, AlarmLimits, Assessment, OwnShip, Policy, Role, assess
from companion.traffic.colregs import follow

SHOWN = 8  # vessels kept in the state: the worst
VESSEL_EVERY_S = 30.0  # between two lines of one vessel
# Acting begins nearer than warning: the shares of a lake's limits (``companion.traffic.LAKE``).
ACT_CPA, ACT_TCPA = 0.4, 0.5
SEVERITY = {Alarm.WARN: Severity.WARNING, Alarm.ACT: Severity.CRITICAL, Alarm.TOUCH: Severity.CRITICAL}


def limits(config: SkipperConfig) -> AlarmLimits:
    """Return when to warn and to act, from the distance and the time that the mission calls safe."""
    return AlarmLimits(
        warn_cpa_m=config.traffic_clearance_m,
        warn_tcpa_s=config.traffic_time_s,
        act_cpa_m=ACT_CPA * config.traffic_clearance_m,
        act_tcpa_s=ACT_TCPA * config.traffic_time_s,
    )


def look_out(ctx: StepContext) -> None:
    """Judge the vessels in view and announce alarms that are new or go on.

    An alarm needs CPA and TCPA both under their limits. Of each vessel one line is said in half a minute, one vessel a
    step and the worst first: among many nobody can read more. The rules of the road are shown, and not relied upon: the
    boat keeps clear of everyone (``companion.traffic.colregs``). Under the policy "rules" encounters are followed to
    past and clear, and each is said when it begins and when what we do changes.
    """
    picture, vehicle, boat = ctx.snapshot.traffic, ctx.snapshot.vehicle, ctx.boat_en
    if picture is None or vehicle is None or boat is None or not picture.vessels:
        if ctx.state.traffic.watch:
            ctx.set(traffic=changed(ctx.state.traffic, watch=()))
        return
    hull, wind, adrift = ctx.voyage.boat.hull, ctx.wind_now, ctx.state.adrift
    own = OwnShip(
        t_s=ctx.t_s,
        en_m=boat,
        velocity_en_mps=vehicle.velocity_en_mps,
        heading_rad=vehicle.heading_rad,
        radius_m=hull.reach_m,
        is_sailing=ctx.config.sails and not (adrift.motor and adrift.since_s is not None),
    )  # rule 3 c
    found = assess(own, picture, limits(ctx.config), None if wind is None else wind[0])
    if ctx.config.traffic_policy is Policy.RULES:
        found = _meet(ctx, own, found)
    else:  # we do what we do, whatever the rule gives us: that we stand on would not be true
        found = tuple(replace(a, encounter=replace(a.encounter, role=Role.KEEP_CLEAR)) for a in found)
    ctx.set(traffic=changed(ctx.state.traffic, watch=found[:SHOWN]))
    _say(ctx, found[:SHOWN])
    _speak_of_goal(ctx)


def _meet(ctx: StepContext, own: OwnShip, found: Sequence[Assessment]) -> tuple[Assessment, ...]:
    """Follow the encounters, say which have changed, and return the vessels with what the rules gave each of them."""
    state, mean = ctx.state, ctx.wind_mean
    before = {(h.mmsi, h.branch): h for h in state.traffic.encounters}
    held = follow(
        state.traffic.encounters,
        own,
        found,
        t_s=ctx.t_s,
        clearance_m=ctx.config.traffic_clearance_m,
        twd_from_rad=None if mean is None else mean[0],
    )
    now = {(h.mmsi, h.branch): h for h in held}
    told = {t[:2]: t for t in state.announced.encounters}
    for one in found:
        key = one.vessel.mmsi, one.vessel.branch
        after, last = now.get(key), told.get(key)
        if after is None:
            continue
        what = "evident" if after.evident else after.encounter.role.value
        if last is not None and (last[2] == what or (ctx.t_s - last[3] < VESSEL_EVERY_S and not after.evident)):
            continue
        severity = Severity.CRITICAL if after.evident else Severity.WARNING if after.stands_on else Severity.NOTICE
        ctx.say(severity, "encounter", after.sentence(one.approach), every_s=0.0)
        told[key] = (*key, what, ctx.t_s)
    for key, gone in before.items():
        if key not in now:
            ctx.say(Severity.INFO, "encounter", f"{gone.label}: past and clear", every_s=0.0)
            told.pop(key, None)
    ctx.set(
        traffic=changed(ctx.state.traffic, encounters=held),
        announced=changed(ctx.state.announced, encounters=tuple(told.values())),
    )
    return tuple(
        replace(one, encounter=now[key].encounter) if (key := (one.vessel.mmsi, one.vessel.branch)) in now else one
        for one in found
    )


def _say(ctx: StepContext, found: Sequence[Assessment]) -> None:
    """Say the worst of the alarms that were not said lately."""
    lately = tuple(told for told in ctx.state.announced.watch if ctx.t_s - told[2] < VESSEL_EVERY_S)
    known = {told[:2] for told in lately}
    news = next((a for a in found if a.alarm is not Alarm.NONE and (a.vessel.mmsi, a.vessel.branch) not in known), None)
    if news is not None:
        ctx.say(SEVERITY[news.alarm], "vessel near", news.sentence(), every_s=0.0)
        lately = (*lately, (news.vessel.mmsi, news.vessel.branch, ctx.t_s))
    ctx.set(announced=changed(ctx.state.announced, watch=lately))


def _speak_of_goal(ctx: StepContext) -> None:
    """Say that a vessel lies where the next goal is, so near that no plan leads there, before setting sail too."""
    why = lies_at_goal(ctx)
    if why:
        ctx.say(Severity.WARNING, "goal occupied", why, every_s=REMIND_S)


EVERY_S = 60.0
MOVES_MPS = 0.15  # slower than this the fixes' noise tells no drift
CARRIED_MPS = 3.0  # faster than this a disarmed boat is towed or carried
LOITER_M = 20.0  # so near to where RTL ends it loiters there
PATIENCE_S = 30.0  # an answer that is on its way is given this long before it is spoken of
ANOTHER_MPS = 0.25  # it is said again when it has changed by so much
REMIND_S = 1800.0


def speak_of_stop(ctx: StepContext) -> None:
    """Say how the boat drifts while a stop lasts, what it meets and when, and what to press.

    A failsafe's stop is told every minute for as long as it lasts, whoever may end it. A person who has stopped the
    boat knows that, and is told only when it drifts onto something.
    """
    stop = ctx.state.operator.stop
    if (
        stop is None
        or ctx.autopilot is None
        or ctx.t_s - stop.t_s <= (PATIENCE_S if is_answered(ctx) else TOLD_S)
        or ctx.is_said("adrift", EVERY_S)
    ):
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
    ctx.say(
        Severity.CRITICAL if meets or not is_answered(ctx) else Severity.WARNING,
        "adrift",
        f"{what}{where}; {_remedy(ctx)}",
        every_s=EVERY_S,
    )


def _ahead(ctx: StepContext, here: PointEn, velocity: tuple[float, float]) -> DriftAhead:
    """Follow the drift; in RTL the straight way to where the autopilot takes the boat. A loiter goes nowhere.

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
    fence = f", {far_m:.0f} m {beyond_words(ctx.voyage.area, here)}" if far_m > 0.0 else ""
    if ctx.autopilot is not None and ctx.autopilot.mode in HOMEWARD and ahead.speed_mps > 0.0:
        way = f"sailing straight home, {direction(heading_of(*ahead.velocity_en_mps))}°"
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
# A tide table that has ended, or that no time can be found in, is said as soon as it is under way and every half hour;
# so is one of heights that does not hold now, where water that dries is open by it.


def watch_water(ctx: StepContext) -> None:
    """Say what is new of the current."""
    current, told = ctx.snapshot.current, ctx.state.announced.water_en_mps
    if not ctx.state.voyage.sailing:
        return
    if current.verdict:
        ctx.say(Severity.WARNING, "tide table", current.verdict, every_s=REMIND_S)
    heights, now_s = ctx.config.tide, ctx.utc_s
    if ctx.voyage.drying and heights is not None and now_s is not None and heights.height_m(now_s) is None:
        text = f"nothing is known of the tide now: {span_words(heights)}; water that dries is closed"
        ctx.say(Severity.WARNING, "tide heights", text, every_s=REMIND_S)
    if not current.is_significant:
        if told is not None:
            ctx.set(announced=changed(ctx.state.announced, water_en_mps=None))
            ctx.say(
                Severity.INFO,
                "current",
                "the current is no longer told from still water: plans leave it out",
                every_s=0.0,
            )
        return
    if told is None or math.dist(told, current.en_mps) >= ANOTHER_MPS:
        ctx.set(announced=changed(ctx.state.announced, water_en_mps=current.en_mps))
        ctx.say(Severity.INFO, "current", f"{current.sentence()}: plans reckon with it", every_s=0.0)


def watch(ctx: StepContext) -> None:
    """Raise and clear watchdogs; those raised in this very step are ``ctx.fresh``."""
    raised = {r.name: r for r in ctx.state.alarms.raised}
    entering = dict(ctx.state.alarms.entering)
    fresh: list[str] = []
    for row in TABLE:
        dog = as_watched(ctx, row)
        value = measure(ctx, dog.name) if _is_watched(ctx, dog) else None
        above = dog.enter >= dog.exit  # the figure is bad when it is large
        enters = value is not None and (value >= dog.enter if above else value <= dog.enter)
        leaves = value is None or (value <= dog.exit if above else value >= dog.exit)
        if dog.enter == dog.exit:
            leaves = not enters
        if dog.name not in raised:
            if not enters:
                entering.pop(dog.name, None)
                continue
            since = entering.setdefault(dog.name, ctx.t_s)
            if ctx.t_s - since >= _patience_s(ctx, dog):
                raised[dog.name] = Raised(name=dog.name, since_s=ctx.t_s)
                entering.pop(dog.name)
                fresh.append(dog.name)
            continue
        now = raised[dog.name]
        if not leaves:
            raised[dog.name] = replace(now, clear_since_s=None)
            continue
        clear = now.clear_since_s if now.clear_since_s is not None else ctx.t_s
        if ctx.t_s - clear >= dog.exit_s:
            del raised[dog.name]
            if _is_watched(ctx, dog):  # else nothing is known of it: a voyage that has ended looks at few of them
                ctx.say(Severity.INFO, f"{dog.name} over", f"{dog.name}: over", every_s=0.0)
        else:
            raised[dog.name] = replace(now, clear_since_s=clear)
    order = {dog.name: n for n, dog in enumerate(TABLE)}
    ctx.set(
        alarms=changed(
            ctx.state.alarms,
            raised=tuple(sorted(raised.values(), key=lambda r: order[r.name])),
            entering=tuple(sorted(entering.items(), key=lambda e: order[e[0]])),
        )
    )
    for name in fresh:
        dog = BY_NAME[name]
        value = measure(ctx, name)
        figure = "" if value is None or not dog.unit else f" ({value:.1f} {dog.unit})"
        text = dog.told.format(abs(value)) if dog.told and value is not None else f"{name}{figure}"
        done = _done_about(ctx, dog)
        ctx.say(dog.severity, name, text + f": {done}" * (done != Response.SAY.value), every_s=0.0)
    ctx.fresh = tuple(fresh)


def _patience_s(ctx: StepContext, dog: Watchdog) -> float:
    """Return how long the entry condition must hold [s]."""
    wind = ctx.wind_now
    is_sure = is_driven_astern(ctx) or (wind is not None and wind[1] < STEERAGE_MPS)
    return dog.unsailed_enter_s if is_sure and dog.unsailed_enter_s is not None else dog.enter_s


def _done_about(ctx: StepContext, dog: Watchdog) -> str:
    if ctx.is_given_up:
        return Response.SAY.value
    if dog.response is Response.REPLAN and ctx.is_field_steered and dog.name == "no progress":
        return "a plan is asked for, to be sailed in AUTO" if may_fall_back(ctx) else "steered on by field"
    return words(ctx.config, dog.name) if dog.response is Response.AS_SET else dog.response.value


def _is_watched(ctx: StepContext, dog: Watchdog) -> bool:
    if dog.at_rest:
        return True
    if ctx.state.voyage.over and not ctx.ahead():
        return dog.loitering and _is_under_way(ctx)
    return _is_under_way(ctx)


def _is_under_way(ctx: StepContext) -> bool:
    status = ctx.autopilot
    own = ctx.state.steering.own_mode
    return ctx.state.voyage.sailing and status is not None and status.is_armed and status.mode in {Mode.AUTO, own}

"""A stop that we did not ask for: whose doing it is, and the taking over of one that is nobody's wish.

It stops being sailed when the mode leaves the ones that sail a mission or a course, or it is disarmed. The cause is
sought among the signs around that moment, on both sides of it: on a slow link the sign comes after the mode. Without
one it was a person, and so it was when the sticks or the mode switch moved.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from companion.boat import AutopilotLimits
from companion.frozen import changed
from companion.messages import AutopilotStatus, Command, Mode, Severity, StatusText
from companion.safety import (
    CRITICAL,
    EMPTY,
    FAILSAFES,
    HOMEWARD,
    PERSON,
    RECEIVER,
    SHORE,
    STOPPING,
    Recovery,
    failsafe_named_by,
    standing,
)
from companion.skipper.behaviors.helm import is_busy, set_mode
from companion.skipper.step import CancelPlan, Phase, StepContext
from companion.skipper.step.state import PATIENT, Adrift, FieldSteering, Signs, Stop
from companion.skipper.way import PointEn, bearing_rad, distance_m, moved

TOLD_S = 5.0  # a sign this long before or after the change of mode belongs to it
ASKED_S = 30.0  # an AUTO that shows so long after it was accepted is the one that was asked for
FILTER_S = 30.0  # a heartbeat that is critical so soon after the filter failed is critical because of it
NEAR_S = 25.0  # somebody else's way is let be until what it leads over is so near ...
LOITER_S = (
    0.5 * NEAR_S
)  # ... for a LOITER needs half of it; while a way of ours is on its way to the autopilot, until then
SLOW_MPS = 1.0
HULL_M = 2.0  # the way of the boat's antenna is not that of its hull
CLOSER_M = 1.0  # what leads away from something is let be
KEPT_OFF, KEPT_OFF_S = "kept off", 1800.0
_SAILED_TO = frozenset(
    {Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TIME, Command.NAV_LOITER_TURNS}
)
REBOOT_RACE_S = 15.0  # a mode change this long before a reboot shows was the reboot, not the operator
MOVED_US = 100  # a stick or switch that is moved moves by more than this; at rest it trembles by a few
UNCHOSEN = frozenset({None, Mode.INITIALISING})
SAILED = frozenset({Mode.AUTO, Mode.GUIDED, *STOPPING}) - {Mode.HOLD}


def note(ctx: StepContext, text: StatusText) -> None:
    """Remember a text that is a sign."""
    cause = failsafe_named_by(text)
    if cause:
        ctx.set(operator=changed(ctx.state.operator, signs=_seen(ctx.state.operator.signs, cause, ctx.t_s)))
    if cause == "battery" and EMPTY in text.text:
        ctx.set(alarms=changed(ctx.state.alarms, battery_critical=True))


def _seen(signs: Signs, cause: str, t_s: float) -> Signs:
    return replace(signs, seen_s=(*(s for s in signs.seen_s if s[0] != cause), (cause, t_s)))


def follow_stops(ctx: StepContext) -> None:
    """Take in the signs of this step; notice a stop, name its cause, and notice that it is over."""
    status = ctx.autopilot
    if status is None:
        return
    before = ctx.state.operator.signs
    signs = _sticks(before, status, ctx.snapshot.limits or AutopilotLimits(), ctx.t_s)
    up = standing(status)
    for cause in up:
        of_filter = cause == SHORE and ctx.t_s - dict(signs.seen_s).get("position", -math.inf) <= FILTER_S
        if cause not in before.standing and not of_filter:
            signs = _seen(signs, cause, ctx.t_s)
    if None not in {before.breaches, status.fence_breaches} and status.fence_breaches != before.breaches:
        signs = _seen(signs, "fence", ctx.t_s)  # outside already, and the autopilot acts again
    helm = (status.mode, status.is_armed)
    if status.battery_failed is False and "battery" in before.standing:
        ctx.set(alarms=changed(ctx.state.alarms, battery_critical=False))
    ctx.set(
        operator=changed(
            ctx.state.operator,
            signs=replace(signs, standing=up, breaches=status.fence_breaches, helm=helm, helm_s=ctx.t_s),
        )
    )
    _follow_put(ctx, before)
    stop = ctx.state.operator.stop
    if status.is_armed and status.mode not in STOPPING:
        ctx.set(operator=changed(ctx.state.operator, stop=None))
    elif stop is not None and _is_ours(ctx):
        # a loiter that we asked for in it
        ctx.set(operator=changed(ctx.state.operator, stop=replace(stop, mode=status.mode, is_armed=True)))
    elif (stop is not None and (stop.mode, stop.is_armed) != helm) or (stop is None and _was_sailed(ctx, before)):
        ctx.set(
            operator=changed(
                ctx.state.operator,
                stop=Stop(
                    t_s=ctx.t_s, before_s=before.helm_s, mode=status.mode, is_armed=status.is_armed, cause=PERSON
                ),
            )
        )
    stop = ctx.state.operator.stop
    if stop is not None and ctx.t_s - stop.t_s <= TOLD_S:
        ctx.set(operator=changed(ctx.state.operator, stop=replace(stop, cause=_cause(stop, ctx.state.operator.signs))))


def _follow_put(ctx: StepContext, before: Signs) -> None:
    """Notice that somebody changed the mode before she sets sail, and AUTO, which ends it.

    What she is switched on in, whatever it is, nobody has chosen while we listened.
    """
    status, put = ctx.autopilot, ctx.state.operator.put
    if status is None or status.mode in UNCHOSEN:
        return
    if ctx.state.voyage.sailing or status.mode is Mode.AUTO:
        put = None
    elif before.helm is not None and before.helm[0] not in {status.mode, *UNCHOSEN} and not ctx.is_own(status.mode):
        put = Stop(t_s=ctx.t_s, before_s=before.helm_s, mode=status.mode, is_armed=status.is_armed, cause=PERSON)
    if put is not None and ctx.t_s - put.t_s <= TOLD_S and _cause(put, ctx.state.operator.signs) != PERSON:
        put = None
    ctx.set(operator=changed(ctx.state.operator, put=put))


def _was_sailed(ctx: StepContext, before: Signs) -> bool:
    """Return whether somebody's mission or course was being sailed; at the first look, whether the state says so."""
    if before.helm is None:
        saved = ctx.state.mission.adoptable
        return saved is not None and saved.sailing
    return before.helm[1] and before.helm[0] in SAILED and not _is_ours(ctx)


def _is_ours(ctx: StepContext) -> bool:
    """Return whether the mode is one that we asked for."""
    status = ctx.autopilot
    return status is not None and status.is_armed and ctx.is_own(status.mode)


def _sticks(signs: Signs, status: AutopilotStatus, limits: AutopilotLimits, t_s: float) -> Signs:
    """Notice a rudder, a throttle or a mode switch that moved; a receiver without its transmitter tells nothing."""
    channels = [n for n in limits.rc_channels if 1 <= n <= len(status.rc_us)]
    now = tuple(status.rc_us[n - 1] for n in channels)
    if not now or status.receiver_lost:
        return signs
    if len(now) != len(signs.rc_us):
        return replace(signs, rc_us=now)
    if all(abs(a - b) <= MOVED_US for a, b in zip(now, signs.rc_us, strict=True)):
        return signs
    return replace(signs, rc_us=now, rc_moved_s=t_s)


def _cause(stop: Stop, signs: Signs) -> str:
    first, last = stop.before_s - TOLD_S, stop.t_s + TOLD_S
    told = {name for name, t_s in signs.seen_s if first <= t_s <= last}
    # A receiver that loses its transmitter may put its channels where its maker likes.
    if first <= signs.rc_moved_s <= last and RECEIVER not in told:
        return PERSON
    return next((cause.name for cause in FAILSAFES if cause.name in told), PERSON)


def take_over(ctx: StepContext) -> bool:
    """Make a failsafe's stop ours to end, where the table and the operator allow it; False: somebody else's."""
    stop = ctx.state.operator.stop
    answer = _answer(ctx)
    if stop is None or answer is None or stop.mode is None:
        return False
    ctx.set(
        steering=changed(ctx.state.steering, own_mode=stop.mode),
        operator=changed(
            ctx.state.operator, since_s=None, is_back=True, answering=stop.cause, sent_home=stop.mode in HOMEWARD
        ),
        plans=changed(ctx.state.plans, retry=PATIENT),
    )
    ctx.phase(Phase.HOLDING, waits_for(ctx) or "stopped: waiting for a plan from where she is")
    ctx.say(
        Severity.WARNING,
        f"{stop.cause} failsafe",
        f"put into {stop.mode.name} by the autopilot's {stop.cause} failsafe: {answer.value}",
        every_s=0.0,
    )
    return True


def _answer(ctx: StepContext) -> Recovery | None:
    """Return what ends the stop, None where that is not ours to do."""
    stop, may = ctx.state.operator.stop, ctx.snapshot.permissions
    if stop is None or not stop.is_armed or stop.cause == PERSON or not (may.may_set_mode and may.may_upload):
        return None
    answer = ctx.config.ends.answer(stop.cause)
    return None if answer is Recovery.LEAVE else answer


def keeps_off(ctx: StepContext) -> bool:
    """Loiter before the hull touches, where a way is sailed that is not of our planning; True: it is asked.

    A mission that is not ours stays on board, and so does a mode that a person set. But legs that lead over something
    solid, and a failsafe's straight way home, are nobody's wish. Once: who sets AUTO again has been told, and means it.
    Not where drawings are adopted: there somebody at the helm has just drawn this way, it is on offer, and a boat that
    loiters beside what it leads over is no place to begin the voyage that comes of it. Out of a failsafe that is
    answered a way of ours leads; a slow link may bring it to the autopilot too late.
    """
    boat, vehicle = ctx.boat_en, ctx.snapshot.vehicle
    is_answer = not ctx.state.mission.foreign and _answer(ctx) is not None
    whose, way = _others_way(ctx)
    if boat is None or vehicle is None or not way:
        return False
    if not is_answer and (ctx.config.adopts or ctx.is_said(KEPT_OFF, KEPT_OFF_S)):
        return False
    near = _begin([boat, *way], (LOITER_S if is_answer else NEAR_S) * max(vehicle.speed_mps, SLOW_MPS))
    solid = ctx.voyage.area.unfenced
    if solid.path_clearance_m(near) > min(HULL_M, float(solid.clearance_m([boat])[0]) - CLOSER_M):
        return False
    text = f"{whose} leads over {ctx.voyage.area.nearest_name(near[-1]) or 'something'}: loitering"
    if is_answer:
        text += ", waiting for our own way to be on board"
    if not set_mode(ctx, Mode.LOITER, text):
        return False
    if is_answer:
        ctx.phase(Phase.HOLDING, text)
        ctx.say(Severity.WARNING, KEPT_OFF, text, every_s=0.0)
        return True
    ctx.phase(Phase.HOLDING, f"{text}; waiting for a person")
    ctx.say(Severity.CRITICAL, KEPT_OFF, f"{text}; take her in MANUAL, or AUTO if it is meant", every_s=0.0)
    return True


def _others_way(ctx: StepContext) -> tuple[str, list[PointEn]]:
    """Return whose way is sailed that is not of our planning, and its points ahead; none where it is ours."""
    state, stop, status = ctx.state, ctx.state.operator.stop, ctx.autopilot
    if status is None or not status.is_armed:
        return "", []
    aboard = state.mission.read_items
    if status.mode is Mode.AUTO and state.mission.foreign and aboard is not None and status.mission_seq:
        items = [item for item in aboard[status.mission_seq - 1 :] if item.command in _SAILED_TO]
        return "the mission on the autopilot, which is not ours,", [
            ctx.voyage.frame.en_from_geo(item.point) for item in items
        ]
    far_m, course, boat = status.waypoint_distance_m, status.target_bearing_rad, ctx.boat_en
    is_homeward = stop is not None and stop.cause != PERSON and {stop.mode, status.mode} <= HOMEWARD
    if stop is None or not is_homeward or far_m is None or course is None or boat is None:
        return "", []
    return f"the straight way home of the {stop.cause} failsafe", [moved(boat, course, far_m)]


def _begin(way: list[PointEn], far_m: float) -> list[PointEn]:
    """Return the beginning of a way."""
    out = way[:1]
    for a, b in itertools.pairwise(way):
        step_m = distance_m(a, b)
        if step_m >= far_m:
            return [*out, moved(a, bearing_rad(a, b), far_m)]
        out.append(b)
        far_m -= step_m
    return out


def is_answered(ctx: StepContext) -> bool:
    """Return whether the boat lies in a stop that is ours to end."""
    status = ctx.autopilot
    held = (
        status is not None
        and ctx.state.operator.stop is not None
        and (status.mode is ctx.state.steering.own_mode or ctx.is_leaving)
    )
    return bool(ctx.state.operator.answering) and held


def waits_for(ctx: StepContext) -> str:
    """Return what is missing before the boat can be planned for; empty: nothing."""
    status = ctx.autopilot
    stop = ctx.state.operator.stop
    ill = status is None or not status.ekf_ok
    if not ill and status is not None and stop is not None and ctx.state.operator.answering == "position":
        # The filter takes a jump before its failsafe is over.
        shore_s = dict(ctx.state.operator.signs.seen_s).get(SHORE, -math.inf)
        ill = status.system_status == CRITICAL and shore_s < stop.before_s
    if ill:
        return "stopped: waiting until the autopilot's position filter is well"
    if ctx.boat_en is None:
        return "stopped: waiting for a position that can be believed"
    return ""


def follow_answer(ctx: StepContext) -> None:
    """Let go of an answer whose cause is over, or that a person has taken out of our hands."""
    state, stop = ctx.state, ctx.state.operator.stop
    if not state.operator.answering or ctx.autopilot is None:
        return
    if is_answered(ctx):
        if stop is not None and (
            stop.cause == PERSON
            or (state.operator.signs.rc_moved_s > stop.t_s and RECEIVER not in state.operator.signs.standing)
        ):
            ctx.set(
                operator=changed(ctx.state.operator, answering="", stop=replace(stop, cause=PERSON)),
                steering=changed(ctx.state.steering, own_mode=None),
            )
        elif stop is not None and ctx.config.ends.answer(stop.cause) is not Recovery.LEAVE:
            ctx.set(operator=changed(ctx.state.operator, answering=stop.cause))  # a better sign came late
        return
    if ctx.autopilot.mode is Mode.AUTO and not _has_asked_for_auto(ctx):
        ctx.say(Severity.NOTICE, "answered", "a person has set AUTO: sailing on", every_s=0.0)
        ctx.set(operator=changed(ctx.state.operator, answering=""))
        return
    # of the others a person says so
    is_over = state.operator.answering == SHORE and SHORE not in state.operator.signs.standing
    if is_over or ctx.config.ends.answer(state.operator.answering) is Recovery.SAIL_ON:
        ctx.set(operator=changed(ctx.state.operator, answering=""))


def _has_asked_for_auto(ctx: StepContext) -> bool:
    """Return whether AUTO shows by our own order: at the change of mode, the only moment when it matters."""
    state = ctx.state
    if state.steering.own_mode is None:
        return True  # seen before
    pending = state.pending.command is not None and state.pending.command[2] == Mode.AUTO.name
    accepted = (
        state.pending.accepted is not None
        and state.pending.accepted[0] == Mode.AUTO.name
        and (ctx.t_s - state.pending.accepted[1] <= ASKED_S)
    )
    return pending or accepted


def begin_again(ctx: StepContext) -> None:
    """Begin again after the autopilot's reboot: the mission is compared, mode and arming are gone."""
    since = ctx.state.operator.since_s
    keeps = ctx.state.phase is Phase.OPERATOR and since is not None and ctx.t_s - since > REBOOT_RACE_S
    ctx.set(
        mission=changed(ctx.state.mission, checked=False, read_since_s=ctx.t_s),
        steering=changed(ctx.state.steering, own_mode=None, until_s=None),
        pending=changed(ctx.state.pending, command=None),
        by_field=FieldSteering(),
        operator=changed(ctx.state.operator, answering="", stop=None, put=None, signs=Signs()),
        adrift=Adrift(),
    )
    if not keeps:
        ctx.set(voyage=changed(ctx.state.voyage, sailing=False), operator=changed(ctx.state.operator, since_s=None))
        ctx.phase(Phase.WAITING, "the autopilot rebooted: waiting for its mission to be read")


def operator_has_it(ctx: StepContext) -> bool:
    """Notice that somebody else has the boat, and that it is given back. Nothing is asked of it meanwhile."""
    status, state = ctx.autopilot, ctx.state
    if status is None or not state.voyage.sailing or state.mission.foreign:
        return False  # a stranger's mission is not an operator's mode: ``mission_is_known`` stands by it
    gone = ctx.is_taken
    if state.phase is not Phase.OPERATOR:
        if not gone:
            held = (
                state.steering.until_s is not None
                or state.by_field.resort.engaged
                or ctx.steers
                or (state.steering.own_mode is Mode.LOITER and is_busy(ctx, Mode.LOITER.name))
            )
            if status.mode is Mode.AUTO and state.steering.own_mode is not None and not held:
                ctx.set(steering=changed(ctx.state.steering, own_mode=None))
            return False
        if state.pending.plan is not None:
            ctx.act(CancelPlan(request_id=state.pending.plan.request_id))
        ctx.set(
            operator=changed(ctx.state.operator, since_s=ctx.t_s),
            pending=changed(ctx.state.pending, plan=None, command=None),
            steering=changed(ctx.state.steering, own_mode=None, until_s=None),
            by_field=FieldSteering(),
        )
        if take_over(ctx):
            return False
        ctx.phase(Phase.OPERATOR, f"{_taken(ctx)}, not by us: the companion does nothing until AUTO comes back")
        ctx.say(Severity.NOTICE, "operator", ctx.state.why, every_s=0.0)
        return True
    if gone or status.mode is not Mode.AUTO:
        if gone and take_over(ctx):  # its sign came later than the change of mode
            return False
        ctx.phase(Phase.OPERATOR, f"{_taken(ctx)}: waiting for AUTO")
        return True
    since = state.operator.since_s
    ctx.set(
        operator=changed(ctx.state.operator, since_s=None, is_back=True, answering=""),
        mission=changed(ctx.state.mission, checked=False, read_since_s=ctx.t_s),
        plans=changed(ctx.state.plans, retry=PATIENT),
        progress=changed(ctx.state.progress, history=()),
    )
    if since is None:  # nobody took her: what was heard was not known to be ours for a while
        ctx.phase(Phase.WAITING, "the autopilot is ours again: waiting for the mission on board to be compared")
        return False
    ctx.set(operator=changed(ctx.state.operator, given_back_s=ctx.t_s))
    ctx.phase(Phase.WAITING, "AUTO is back: waiting for the mission on board to be compared")
    ctx.say(Severity.NOTICE, "operator back", f"AUTO is back after {ctx.t_s - since:.0f} s", every_s=0.0)
    return False


def _taken(ctx: StepContext) -> str:
    """Return in words what the boat was put into, and by which failsafe if by one."""
    status, stop = ctx.autopilot, ctx.state.operator.stop
    mode = status.mode.name if status is not None and status.mode is not None else "unknown"
    what = f"mode {mode}" if status is None or status.is_armed else f"mode {mode}, disarmed"
    return what if stop is None or stop.cause == PERSON else f"{what} by the {stop.cause} failsafe"

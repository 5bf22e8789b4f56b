"""Orders: each is judged once, refused with its reason before anything moves, or taken; what stands is seen through.

What an order makes her do is an errand like any other (``companion.skipper.planning.errands``) or a plan that is asked
for; nothing is uploaded here. The same order of the same station within ten seconds is a repetition, for its answer may
have been lost: it gets the same answer, and nothing is done twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from companion.frozen import changed
from companion.messages import Mode
from companion.orders import FAR, LOCAL, MAVLINK, Answer, Order, Result, Verb, lead_in, permitted
from companion.skipper.board.adoption import adopt
from companion.skipper.deeds.ordered_places import goal_place, home_place, refuge_place
from companion.skipper.deeds.rest import UNTIL_TOLD
from companion.skipper.planning.errands import errand, is_at_rest, pressing
from companion.skipper.planning.next_tack import next_tack_s
from companion.skipper.planning.not_found import hold
from companion.skipper.step.actions import Acknowledge, CancelPlan, Severity, StopOrders
from companion.skipper.step.route import Kind
from companion.skipper.step.standing import Standing
from companion.skipper.step.state import PATIENT, Answered, ByField, Phase
from companion.skipper.step.turn import Turn
from companion.skipper.way.gates import Approach
from companion.skipper.way.geometry import distance_m

REMEMBERED_S = 10.0   # longer than any station repeats a command that is not answered
STATIONS = 8          # whose last order is remembered
HERE_M = 40.0         # a loiter that is farther from her than this is not here
CODE = "order"        # what is said of orders
# The key of the mission's [operator] that permits what comes on each way, and the name of it in ``Permissions``.
_PERMITTED_BY = {MAVLINK: "orders", LOCAL: "local_orders", FAR: "far_orders"}


def take_orders(turn: Turn) -> None:
    """Answer the orders of this step, each once and in the order in which they came; see what stands through."""
    standing = turn.state.orders.standing
    if standing is not None and standing.since_s is None:
        turn.set(orders=changed(turn.state.orders, standing=replace(standing, since_s=turn.t_s)))
        turn.say(Severity.NOTICE, CODE, f"since before this start she is under an order: {standing.words}, "
                 f"{standing.why}", every_s=0.0)
    for event in turn.snapshot.events:
        if isinstance(event, Order):
            _answer(turn, event)
    _see_through(turn)


def _answer(turn: Turn, order: Order) -> None:
    lately = tuple(a for a in turn.state.orders.answered if turn.t_s - a.t_s <= REMEMBERED_S)
    before = next((a for a in lately if a.order.key == order.key), None)
    if before is not None and order.wanted.verb is not Verb.WHY:
        answer = before.answer
    else:
        answer = _judged(turn, order)
        others = tuple(a for a in lately if a.order.source != order.source)
        turn.set(orders=changed(
            turn.state.orders, answered=(*others, Answered(order=order, answer=answer, t_s=turn.t_s))[-STATIONS:]))
    source = order.source
    turn.act(Acknowledge(way=source.kind, system=source.system, component=source.component, command=order.command,
                         result=answer.result, text=answer.text))
    turn.say(Severity.NOTICE if answer.result is Result.DONE else Severity.WARNING, CODE,
             f"{lead_in(order.wanted)}{answer.text}", every_s=0.0)


def _judged(turn: Turn, order: Order) -> Answer:
    """Judge an order that is no repetition, and do it if it can be done."""
    wanted = order.wanted
    if wanted.verb is None:
        return Answer(result=Result.UNKNOWN, text=wanted.fault)
    if wanted.fault:
        return Answer(result=Result.REFUSED, text=wanted.fault)
    key = _PERMITTED_BY[order.source.kind]
    verbs = getattr(turn.snapshot.permissions, key)
    if not permitted(wanted.verb, verbs):
        which = f"does not name {wanted.verb}" if verbs else "permits none"
        return Answer(result=Result.REFUSED, text=f"not permitted: the mission's [operator] {key} {which}")
    if turn.is_given_up and wanted.verb not in {Verb.GO_ON, Verb.STOP, Verb.WHY}:
        return _not_now(f"she is given up, {_why(turn)}: {Verb.GO_ON} first")
    return _DEEDS[wanted.verb](turn, order)


def _not_now(text: str) -> Answer:
    return Answer(result=Result.NOT_NOW, text=text)


def _done(text: str) -> Answer:
    return Answer(result=Result.DONE, text=text)


def _why(turn: Turn) -> str:
    return turn.state.orders.standing.why if turn.state.orders.standing is not None else ""


def _stand(turn: Turn, order: Order, text: str, *, place: tuple[str, tuple[float, float]] | None = None) -> Answer:
    """Let an order stand, in place of the one that stood."""
    assert order.wanted.verb is not None
    before, by = turn.state.orders.standing, order.source.words
    name, en_m = place if place is not None else ("", None)
    turn.set(
        orders=changed(
            turn.state.orders,
            standing=Standing(verb=order.wanted.verb, by=by, name=name, en_m=en_m, since_s=turn.t_s)),
        plans=changed(turn.state.plans, retry=PATIENT))
    instead = f"; in place of {before.words}, {before.why}" if before is not None and before.by != by else ""
    return _done(text + instead)


def _hindrance(turn: Turn, *, ashore: bool = False) -> str:
    """Return why she cannot be sent anywhere now; empty: she can. ``ashore``: nor need she be under way."""
    state = turn.state
    if not state.vehicle.is_ours:
        return f"no orders: {state.why}"
    if not turn.snapshot.permissions.may_upload:
        return "uploading is not permitted: the mission's [operator] set_auto"
    if state.mission.foreign:
        return f"{state.mission.foreign}: {Verb.REPLACE} or take it away first"
    if state.phase is Phase.OPERATOR or turn.is_taken:
        return f"a person has her: {state.why}"
    if not state.voyage.sailing and not ashore:
        return f"she is not under way: {state.why}"
    first = pressing(turn)
    return "" if first is None else f"this comes first: {first.sentence}"


# ------------------------------------------------------------------------------------------ one by one
def _hold(turn: Turn, order: Order) -> Answer:
    trouble = _hindrance(turn, ashore=True)
    if trouble:
        return _not_now(trouble)
    turn.set(plans=changed(turn.state.plans, asked=""))
    if not turn.state.voyage.sailing:
        return _stand(turn, order, f"she stays where she is, and is not set sailing until {Verb.GO_ON}")
    answer = _stand(turn, order, f"loitering here, where there is room, until {Verb.GO_ON}")
    _let_go_of_plan(turn)
    route, boat = turn.state.mission.route, turn.boat_en
    if route is not None and boat is not None and turn.state.pending.upload is None and not turn.ahead() and (
        distance_m(boat, route.points_en_m[-1]) > HERE_M
    ):
        hold(turn, _why(turn), anew=True)   # on her way to the loiter that ends the mission: that is not here
    return answer


def _go_on(turn: Turn, _: Order) -> Answer:
    was = turn.state.orders.standing
    if was is None:
        turn.set(plans=changed(turn.state.plans, retry=PATIENT))
        gate = turn.gate
        if gate is not None and (gate.box or gate.field) is not None and turn.state.progress.inside is not None:
            turn.set(progress=changed(turn.state.progress, released=gate.goal))
            after = turn.state.progress.gate + 1
            following = turn.gates[after] if after < len(turn.gates) else None
            what = "her stay in" if gate.box is not None else "the field of"
            return _done(f"the end of {what} {gate.name}" + (f": on to {following.name}" if following else ""))
        return _done(f"no order stands: {_next(turn)}")
    turn.set(
        orders=changed(turn.state.orders, standing=None),
        plans=changed(turn.state.plans, retry=PATIENT),
        progress=changed(turn.state.progress, history=()))
    if was.verb is Verb.STOP and turn.state.voyage.sailing:
        # As when a person gives her back: what is on board is compared, and planned from where she is.
        turn.set(
            mission=changed(turn.state.mission, checked=False, read_since_s=turn.t_s),
            operator=changed(turn.state.operator, is_back=True))
        turn.phase(Phase.WAITING, "to go on: waiting for the mission on board to be compared")
    return _done(f"the end of {was.words}: {_next(turn)}")


def _next(turn: Turn) -> str:
    if turn.state.voyage.over or turn.gate is None:
        return "no goal is left"
    return f"on to {turn.gate.name}" if turn.state.voyage.sailing else f"to {turn.gate.name} when she sails"


def _skip_goal(turn: Turn, _: Order) -> Answer:
    gate, boat = turn.gate, turn.boat_en
    if gate is None or turn.state.voyage.over:
        return _not_now("no goal is left")
    following = gate.goal + 1
    if following >= len(turn.voyage.legs):
        return _not_now(f"{gate.name} is the last goal: {Verb.HOLD} to stay here, {Verb.HOME} or {Verb.REFUGE}")
    if boat is None or turn.state.mission.adoptable is not None:
        return _not_now("her position is not known" if boat is None else "the mission on board is being compared")
    _let_go_of_plan(turn)
    turn.approach(Approach(goal=following, en_m=boat))
    text = f"{gate.name} is given up"
    turn.set(
        orders=changed(turn.state.orders, skipped=turn.state.orders.skipped + 1),
        progress=changed(turn.state.progress, missed_s=None),
        plans=changed(turn.state.plans, retry=PATIENT, asked=text))
    return _done(f"{text}: {_next(turn)}")


def _sail_to(turn: Turn, order: Order, found: tuple[str, tuple[float, float]] | str, then: str) -> Answer:
    if isinstance(found, str):
        return Answer(result=Result.REFUSED, text=found)
    trouble = _hindrance(turn)
    if trouble:
        return _not_now(trouble)
    turn.set(plans=changed(turn.state.plans, asked=""))
    answer = _stand(turn, order, "", place=found)
    bound = errand(turn)
    return replace(answer, text=f"to {bound.name if bound is not None else found[0]}, {then}{answer.text}")


def _refuge(turn: Turn, order: Order) -> Answer:
    return _sail_to(turn, order, refuge_place(turn, order.wanted), f"and stay there until {Verb.GO_ON}")


def _home(turn: Turn, order: Order) -> Answer:
    return _sail_to(turn, order, home_place(turn), f"and stay there until {Verb.GO_ON}")


def _goal(turn: Turn, order: Order) -> Answer:
    return _sail_to(turn, order, goal_place(turn, order.wanted), f"then {_next(turn)}")


def _replan(turn: Turn, order: Order) -> Answer:
    bound = errand(turn)
    trouble = _hindrance(turn)
    if not trouble and (turn.state.voyage.over if bound is None else not bound.has_place or is_at_rest(turn)):
        trouble = f"there is nothing to plan: {turn.state.why}"
    if trouble:
        return _not_now(trouble)
    turn.set(plans=changed(turn.state.plans, asked=f"asked for by {order.source.words}", retry=PATIENT))
    return _done("a new plan from here is asked for")


def _stop(turn: Turn, order: Order) -> Answer:
    if turn.is_given_up:
        return _stand(turn, order, "she is given up already")
    _let_go_of_plan(turn)
    status, is_busy = turn.autopilot, turn.state.pending.upload is not None
    if not is_busy:
        turn.act(StopOrders(text="she is given up"))
    turn.set(
        pending=changed(turn.state.pending, read=None, command=None),
        steering=changed(turn.state.steering, until_s=None),
        by_field=ByField(),
        plans=changed(turn.state.plans, asked="", ready_route=None))
    mode = "an unknown mode" if status is None or status.mode is None else status.mode.name
    upload = ", but for the end of an upload that is under way" if is_busy else ""
    return _stand(turn, order, f"nothing more is asked of her until {Verb.GO_ON}{upload}; she is in {mode}")


def _adopt(turn: Turn, _: Order) -> Answer:
    why = adopt(turn)
    return _not_now(why) if why else _done("what was drawn is read, and this voyage ends for it if it can be sailed")


def _replace(turn: Turn, _: Order) -> Answer:
    if not turn.state.mission.foreign:
        return _not_now("the mission on board is not a stranger's, or is not known yet")
    if not turn.snapshot.permissions.may_upload:
        return Answer(result=Result.REFUSED, text="uploading is not permitted: the mission's [operator] set_auto")
    text = turn.state.mission.foreign
    turn.set(mission=changed(turn.state.mission, foreign="", adoptable=None, replace_foreign=True))
    return _done(f"it is replaced: {text}")


def _say_why(turn: Turn, _: Order) -> Answer:
    state = turn.state
    tack_s = next_tack_s(turn, turn.voyage.boat.polar) if turn.config.sails else None
    tack = "" if tack_s is None else f"; next tack in {tack_s:.0f} s"
    order = state.orders.standing
    under = "" if order is None else f"; {order.words} for {order.age_s(turn.t_s) / 60.0:.0f} min, {order.why}"
    return _done(f"{state.phase.value}: {state.why}{tack}{under}")


_DEEDS: dict[Verb, Callable[[Turn, Order], Answer]] = {
    Verb.HOLD: _hold, Verb.GO_ON: _go_on, Verb.SKIP_GOAL: _skip_goal, Verb.REFUGE: _refuge, Verb.HOME: _home,
    Verb.GOAL: _goal, Verb.REPLAN: _replan, Verb.STOP: _stop, Verb.ADOPT: _adopt, Verb.REPLACE: _replace,
    Verb.WHY: _say_why,
}


def _let_go_of_plan(turn: Turn) -> None:
    if turn.state.pending.plan is not None:
        turn.act(CancelPlan(request_id=turn.state.pending.plan.request_id))
        turn.set(pending=changed(turn.state.pending, plan=None))


# --------------------------------------------------------------------------------------------- standing
def _see_through(turn: Turn) -> None:
    """End an order to sail to a place once she is there: the goals that are left are next."""
    standing, bound, boat = turn.state.orders.standing, errand(turn), turn.boat_en
    if standing is None or bound is None or bound.kind is not Kind.GOAL or boat is None or (
            not turn.state.voyage.sailing):
        return
    off_m = distance_m(boat, bound.en_m)
    if off_m > bound.radius_m and not is_at_rest(turn):
        return
    turn.set(orders=changed(turn.state.orders, standing=None), plans=changed(turn.state.plans, retry=PATIENT))
    turn.say(Severity.NOTICE, CODE, f"{standing.words} reached, {off_m:.1f} m from it: {_next(turn)}", every_s=0.0)


def holds_ashore(turn: Turn) -> bool:
    """Say that an order keeps her from being set sailing, while it does."""
    status, standing = turn.autopilot, turn.state.orders.standing
    is_under_way = turn.state.voyage.sailing or (
        turn.state.mission.route is not None and status is not None and status.is_armed and status.mode is Mode.AUTO)
    if standing is None or standing.verb is not Verb.HOLD or is_under_way:
        return False
    turn.phase(Phase.WAITING, f"held, {standing.why}: waiting {UNTIL_TOLD}")
    return True


def leaves_alone(turn: Turn) -> bool:
    """Say that she is given up, while she is; True: nothing is asked of her."""
    if not turn.is_given_up:
        return False
    turn.phase(Phase.OPERATOR if turn.state.voyage.sailing else Phase.WAITING,
               f"given up, {_why(turn)}: nothing is asked of her, waiting {UNTIL_TOLD}")
    return True

"""Orders: each is judged once, refused with its reason before anything moves, or taken; what stands is seen through.

What an order makes it do is a diversion like any other (``companion.skipper.planning.diversions``) or a plan that is
asked for; nothing is uploaded here. The same order of the same station within ten seconds is a repetition, for its
answer may have been lost: it gets the same answer, and nothing is done twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import shapely

from companion.frozen import changed
from companion.messages import Mode, Severity
from companion.orders import FAR, LOCAL, MAVLINK, Answer, Order, Place, Result, Verb, Wanted, lead_in, permitted, which
from companion.skipper.behaviors.rest import UNTIL_TOLD
from companion.skipper.behaviors.shoaling import SHOALING
from companion.skipper.board.on_board import adopt
from companion.skipper.planning.asking import lacks, request
from companion.skipper.planning.diversions import (
    GOAL_RADIUS_M,
    LACK_M,
    diversion,
    home_trouble,
    is_at_rest,
    place_trouble,
    pressing,
    refuge_name,
    refuges_by_way,
    room_lacking_m,
    to_be_held,
)
from companion.skipper.planning.next_tack import next_tack
from companion.skipper.planning.not_found import hold
from companion.skipper.planning.waits import stay_left_s
from companion.skipper.step.actions import Acknowledge, ReplanReason, RequestPlan, StopOrders
from companion.skipper.step.config import Learning
from companion.skipper.step.context import StepContext
from companion.skipper.step.route import DiversionKind
from companion.skipper.step.saved import Standing
from companion.skipper.step.state import PATIENT, Answered, FieldSteering, Phase
from companion.skipper.way import PointEn, distance_m
from companion.words import counted

REMEMBERED_S = 10.0  # longer than any station repeats a command that is not answered
STATIONS = 8  # whose last order is remembered
HERE_M = 40.0  # a loiter that is farther from the boat than this is not here
CODE = "order"  # what is said of orders
# The key of the mission's [operator] that permits what comes on each way, and the name of it in ``Permissions``.
_PERMITTED_BY = {MAVLINK: "orders", LOCAL: "local_orders", FAR: "far_orders"}
Found = tuple[str, PointEn]


def take_orders(ctx: StepContext) -> None:
    """Answer the orders of this step, each once and in the order in which they came; see what stands through."""
    standing = ctx.state.orders.standing
    if standing is not None and standing.since_s is None:
        ctx.set(orders=changed(ctx.state.orders, standing=replace(standing, since_s=ctx.t_s)))
        ctx.say(
            Severity.NOTICE,
            CODE,
            f"since before this start she is under an order: {standing.words}, {standing.why}",
            every_s=0.0,
        )
    for event in ctx.snapshot.events:
        if isinstance(event, Order):
            _answer(ctx, event)
    _see_through(ctx)


def _answer(ctx: StepContext, order: Order) -> None:
    lately = tuple(a for a in ctx.state.orders.answered if ctx.t_s - a.t_s <= REMEMBERED_S)
    before = next((a for a in lately if a.order.key == order.key), None)
    if before is not None and order.wanted.verb is not Verb.WHY:
        answer = before.answer
    else:
        answer = _judged(ctx, order)
        others = tuple(a for a in lately if a.order.source != order.source)
        ctx.set(
            orders=changed(
                ctx.state.orders, answered=(*others, Answered(order=order, answer=answer, t_s=ctx.t_s))[-STATIONS:]
            )
        )
    source = order.source
    ctx.act(
        Acknowledge(
            way=source.kind,
            system=source.system,
            component=source.component,
            command=order.command,
            result=answer.result,
            text=answer.text,
        )
    )
    ctx.say(
        Severity.NOTICE if answer.result is Result.DONE else Severity.WARNING,
        CODE,
        f"{lead_in(order.wanted)}{answer.text}",
        every_s=0.0,
    )


def _judged(ctx: StepContext, order: Order) -> Answer:
    """Judge an order that is no repetition, and do it if it can be done."""
    wanted = order.wanted
    if wanted.verb is None:
        return Answer(result=Result.UNKNOWN, text=wanted.fault)
    if wanted.fault:
        return Answer(result=Result.REFUSED, text=wanted.fault)
    key = _PERMITTED_BY[order.source.kind]
    verbs = getattr(ctx.snapshot.permissions, key)
    if not permitted(wanted.verb, verbs):
        which = f"does not name {wanted.verb}" if verbs else "permits none"
        return Answer(result=Result.REFUSED, text=f"not permitted: the mission's [operator] {key} {which}")
    if ctx.is_given_up and wanted.verb not in {Verb.GO_ON, Verb.STOP, Verb.WHY}:
        return _not_now(f"she is given up, {_why(ctx)}: {Verb.GO_ON} first")
    return _DEEDS[wanted.verb](ctx, order)


def _not_now(text: str) -> Answer:
    return Answer(result=Result.NOT_NOW, text=text)


def _done(text: str) -> Answer:
    return Answer(result=Result.DONE, text=text)


def _why(ctx: StepContext) -> str:
    return ctx.state.orders.standing.why if ctx.state.orders.standing is not None else ""


def _stand(
    ctx: StepContext, order: Order, text: str, *, place: tuple[str, tuple[float, float]] | None = None
) -> Answer:
    """Let an order stand, in place of the one that stood."""
    assert order.wanted.verb is not None
    before, by = ctx.state.orders.standing, order.source.words
    name, en_m = place if place is not None else ("", None)
    ctx.set(
        orders=changed(
            ctx.state.orders, standing=Standing(verb=order.wanted.verb, by=by, name=name, en_m=en_m, since_s=ctx.t_s)
        ),
        plans=changed(ctx.state.plans, retry=PATIENT),
    )
    instead = f"; in place of {before.words}, {before.why}" if before is not None and before.by != by else ""
    return _done(text + instead)


def _hindrance(ctx: StepContext, *, ashore: bool = False) -> str:
    """Return why the boat cannot be sent anywhere now; empty: it can. ``ashore``: nor need it be under way."""
    state = ctx.state
    if not state.vehicle.is_ours:
        return f"no orders: {state.why}"
    if not ctx.snapshot.permissions.may_upload:
        return "uploading is not permitted: the mission's [operator] set_auto"
    if state.mission.foreign:
        return f"{state.mission.foreign}: {Verb.REPLACE} or take it away first"
    if state.phase is Phase.OPERATOR or ctx.is_taken:
        return f"a person has her: {state.why}"
    if not state.voyage.sailing and not ashore:
        return f"she is not under way: {state.why}"
    first = pressing(ctx)
    return "" if first is None else f"this comes first: {first.sentence}"


# ------------------------------------------------------------------------------------------ one by one
def _hold(ctx: StepContext, order: Order) -> Answer:
    trouble = _hindrance(ctx, ashore=True)
    if trouble:
        return _not_now(trouble)
    ctx.set(plans=changed(ctx.state.plans, asked=""))
    if not ctx.state.voyage.sailing:
        return _stand(ctx, order, f"she stays where she is, and is not set sailing until {Verb.GO_ON}")
    route, boat = ctx.state.mission.route, ctx.boat_en
    answer = _stand(ctx, order, f"{_held(ctx)}, until {Verb.GO_ON}")
    ctx.let_go_of_plan()
    if (
        route is not None
        and boat is not None
        and ctx.state.pending.upload is None
        and not ctx.ahead()
        and (distance_m(boat, route.points_en_m[-1]) > HERE_M)
    ):
        hold(ctx, _why(ctx), anew=True)  # on the boat's way to the loiter that ends the mission: that is not here
    return answer


def _held(ctx: StepContext) -> str:
    """Return in words where she is held."""
    boat, bound = ctx.boat_en, to_be_held(ctx, "")
    lacks_m = -1.0 if boat is None else room_lacking_m(ctx, boat)
    if bound is not None and bound.has_place:
        lacks = f": here a loiter has {lacks_m:.0f} m less than it takes in this wind" if lacks_m > LACK_M else ""
        return f"to {bound.name}{lacks or ' near by'}"
    if lacks_m > LACK_M:
        return f"loitering here, with {lacks_m:.0f} m less of room than a loiter takes in this wind"
    return "loitering here, where there is room"


def _go_on(ctx: StepContext, _: Order) -> Answer:
    was = ctx.state.orders.standing
    ctx.set(operator=changed(ctx.state.operator, put=None))
    if was is None:
        ctx.set(plans=changed(ctx.state.plans, retry=PATIENT))
        gate = ctx.gate
        if gate is not None and (gate.box or gate.field) is not None and ctx.state.progress.inside is not None:
            ctx.set(progress=changed(ctx.state.progress, released=gate.goal))
            after = ctx.state.progress.gate + 1
            following = ctx.gates[after] if after < len(ctx.gates) else None
            what = "her stay in" if gate.box is not None else "the field of"
            return _done(f"the end of {what} {gate.name}" + (f": on to {following.name}" if following else ""))
        return _done(f"no order stands: {_next(ctx)}")
    ctx.set(
        orders=changed(ctx.state.orders, standing=None),
        plans=changed(ctx.state.plans, retry=PATIENT),
        progress=changed(ctx.state.progress, history=()),
    )
    if was.verb is Verb.STOP and ctx.state.voyage.sailing:
        # As when a person gives the boat back: what is on board is compared, and planned from where it is.
        ctx.set(
            mission=changed(ctx.state.mission, checked=False, read_since_s=ctx.t_s),
            operator=changed(ctx.state.operator, is_back=True),
        )
        ctx.phase(Phase.WAITING, "to go on: waiting for the mission on board to be compared")
    return _done(f"the end of {was.words}: {_going_on(ctx)}")


def _going_on(ctx: StepContext) -> str:
    """Return what is next when an order ends: where she is in a box, or was sailed by a field, that goes on."""
    gate, boat, inside = ctx.gate, ctx.boat_en, ctx.state.progress.inside
    if gate is None or boat is None or inside is None or inside.goal != gate.goal or ctx.state.voyage.over:
        return _next(ctx)
    if gate.field is not None:
        return f"on with the field of {gate.name}"
    if gate.box is None or not shapely.contains_xy(gate.box.area_en, *boat):
        return _next(ctx)
    left_s = stay_left_s(ctx, gate)
    return f"she stays in {gate.name} {UNTIL_TOLD if math.isinf(left_s) else f'for {left_s:.0f} s more'}"


def _next(ctx: StepContext) -> str:
    if ctx.state.voyage.over or ctx.gate is None:
        return "no goal is left"
    return f"on to {ctx.gate.name}" if ctx.state.voyage.sailing else f"to {ctx.gate.name} when she sails"


def _skip_goal(ctx: StepContext, _: Order) -> Answer:
    gate, boat = ctx.gate, ctx.boat_en
    if gate is None or ctx.state.voyage.over:
        return _not_now("no goal is left")
    if gate.goal + 1 >= len(ctx.voyage.legs):
        return _not_now(f"{gate.name} is the last goal: {Verb.HOLD} to stay here, {Verb.HOME} or {Verb.REFUGE}")
    if boat is None or ctx.state.mission.adoptable is not None:
        return _not_now("her position is not known" if boat is None else "the mission on board is being compared")
    text = ctx.give_up(gate, ReplanReason.ORDER)
    standing = ctx.state.orders.standing
    then = f"{ctx.gates[ctx.state.progress.gate].name} is next when {standing.words} ends" if standing else _next(ctx)
    return _done(f"{text}: {then}")


def _sail_to(ctx: StepContext, order: Order, found: tuple[str, tuple[float, float]] | str, then: str) -> Answer:
    if isinstance(found, str):
        return Answer(result=Result.REFUSED, text=found)
    trouble = _hindrance(ctx)
    if trouble:
        return _not_now(trouble)
    ctx.set(plans=changed(ctx.state.plans, asked=""))
    answer = _stand(ctx, order, "", place=found)
    bound = diversion(ctx)
    return replace(answer, text=f"to {bound.name if bound is not None else found[0]}, {then}{answer.text}")


def _refuge(ctx: StepContext, order: Order) -> Answer:
    return _sail_to(ctx, order, refuge_place(ctx, order.wanted), f"and stay there until {Verb.GO_ON}")


def _home(ctx: StepContext, order: Order) -> Answer:
    return _sail_to(ctx, order, home_place(ctx), f"and stay there until {Verb.GO_ON}")


def _goal(ctx: StepContext, order: Order) -> Answer:
    return _sail_to(ctx, order, goal_place(ctx, order.wanted), f"then {_next(ctx)}")


def _replan(ctx: StepContext, order: Order) -> Answer:
    bound = diversion(ctx)
    trouble = _hindrance(ctx)
    if not trouble and (ctx.state.voyage.over if bound is None else not bound.has_place or is_at_rest(ctx)):
        trouble = f"there is nothing to plan: {ctx.state.why}"
    if trouble:
        return _not_now(trouble)
    ctx.set(
        plans=changed(
            ctx.state.plans, asked=f"asked for by {order.source.words}", asked_as=ReplanReason.ORDER, retry=PATIENT
        )
    )
    return _done("a new plan from here is asked for")


def _stop(ctx: StepContext, order: Order) -> Answer:
    if ctx.is_given_up:
        return _stand(ctx, order, "she is given up already")
    ctx.let_go_of_plan()
    status, is_busy = ctx.autopilot, ctx.state.pending.upload is not None
    if not is_busy:
        ctx.act(StopOrders(text="she is given up"))
    ctx.set(
        pending=changed(ctx.state.pending, read=None, command=None),
        steering=changed(ctx.state.steering, until_s=None),
        by_field=FieldSteering(),
        plans=changed(ctx.state.plans, asked="", ready_route=None),
    )
    mode = "an unknown mode" if status is None or status.mode is None else status.mode.name
    if status is not None and status.mode is Mode.GUIDED:  # which nobody steers from now on
        mode += ", and stops there: set AUTO for the mission on board, or take her"
    upload = ", but for the end of an upload that is under way" if is_busy else ""
    return _stand(ctx, order, f"nothing more is asked of her until {Verb.GO_ON}{upload}; she is in {mode}")


def _adopt(ctx: StepContext, _: Order) -> Answer:
    why = adopt(ctx)
    return _not_now(why) if why else _done("what was drawn is read, and this voyage ends for it if it can be sailed")


def _replace(ctx: StepContext, _: Order) -> Answer:
    if not ctx.state.mission.foreign:
        return _not_now("the mission on board is not a stranger's, or is not known yet")
    if not ctx.snapshot.permissions.may_upload:
        return Answer(result=Result.REFUSED, text="uploading is not permitted: the mission's [operator] set_auto")
    text = ctx.state.mission.foreign
    ctx.set(mission=changed(ctx.state.mission, foreign="", adoptable=None, replace_foreign=True))
    return _done(f"it is replaced: {text}")


def _freeze(ctx: StepContext, _: Order) -> Answer:
    return _learning(ctx, is_frozen=True)


def _learn(ctx: StepContext, _: Order) -> Answer:
    return _learning(ctx, is_frozen=False)


def _learning(ctx: StepContext, *, is_frozen: bool) -> Answer:
    if ctx.config.learn is Learning.OFF or not ctx.config.sails:
        return Answer(result=Result.REFUSED, text="the boat is not learned: the mission's [boat] learn is off")
    afloat = ctx.state.afloat
    ctx.set(afloat=afloat.with_known(replace(afloat.known, is_frozen=is_frozen)))
    is_used = afloat.known.is_used and ctx.config.learn is Learning.USE
    plans = f"plans are of {'the boat as she was found to sail' if is_used else 'her file'}"
    return _done(f"nothing more is learned of the boat until {Verb.LEARN}: {plans}" if is_frozen else "she is learned")


def _forget_shoal(ctx: StepContext, order: Order) -> Answer:
    """Give a shoal back to the water; what the sounder tells there is believed again."""
    shoals, here, number = ctx.state.soundings.shoals, ctx.boat_en or ctx.snapshot.position_en_m, order.wanted.number
    if not shoals:
        return _not_now("no shoal was sounded on this voyage")
    if number > len(shoals):
        return Answer(
            result=Result.REFUSED, text=f"there is no shoal {number}: {counted(len(shoals), 'shoal')} are known"
        )
    if ctx.is_raised(SHOALING) or ctx.state.soundings.turned_en_m is not None:
        return _not_now("it shoals now: once she has turned back")
    if number == 0 and here is None:
        return _not_now("her position is not known: name the shoal's number")
    if number == 0 and here is not None:
        number = 1 + min(range(len(shoals)), key=lambda n: distance_m(here, shoals[n].en_m) - shoals[n].radius_m)
    gone = shoals[number - 1]
    place = ctx.voyage.frame.geo_from_en(*gone.en_m)
    ctx.learn_shoals(shoals[: number - 1] + shoals[number:])
    text = f"the shoal {number} of {gone.radius_m:.0f} m about {place.lat_deg:.5f} {place.lon_deg:.5f} is forgotten"
    bound = diversion(ctx)
    is_bound = not ctx.state.voyage.over if bound is None else bound.has_place and not is_at_rest(ctx)
    if is_bound and not _hindrance(ctx):
        ctx.set(plans=changed(ctx.state.plans, asked=text, asked_as=ReplanReason.ORDER, retry=PATIENT))
    return _done(f"{text}, {len(shoals) - 1} left")


def _say_why(ctx: StepContext, _: Order) -> Answer:
    state = ctx.state
    comes = next_tack(ctx, ctx.voyage.boat)
    tack = "" if comes is None else f"; next tack in {comes.words}"
    order = state.orders.standing
    under = "" if order is None else f"; {order.words} for {order.age_s(ctx.t_s) / 60.0:.0f} min, {order.why}"
    return _done(f"{state.phase.value}: {state.why}{tack}{under}")


_DEEDS: dict[Verb, Callable[[StepContext, Order], Answer]] = {
    Verb.HOLD: _hold,
    Verb.GO_ON: _go_on,
    Verb.SKIP_GOAL: _skip_goal,
    Verb.REFUGE: _refuge,
    Verb.HOME: _home,
    Verb.GOAL: _goal,
    Verb.REPLAN: _replan,
    Verb.STOP: _stop,
    Verb.ADOPT: _adopt,
    Verb.REPLACE: _replace,
    Verb.WHY: _say_why,
    Verb.FREEZE: _freeze,
    Verb.LEARN: _learn,
    Verb.FORGET_SHOAL: _forget_shoal,
}


# --------------------------------------------------------------------------------------------- standing
def _see_through(ctx: StepContext) -> None:
    """End an order to sail to a place once the boat is there: the goals that are left are next."""
    standing, bound, boat = ctx.state.orders.standing, diversion(ctx), ctx.boat_en
    if (
        standing is None
        or bound is None
        or bound.kind is not DiversionKind.GOAL
        or boat is None
        or (not ctx.state.voyage.sailing)
    ):
        return
    off_m = distance_m(boat, bound.en_m)
    if off_m > bound.radius_m and not is_at_rest(ctx):
        return
    ctx.set(orders=changed(ctx.state.orders, standing=None), plans=changed(ctx.state.plans, retry=PATIENT))
    ctx.say(Severity.NOTICE, CODE, f"{standing.words} reached, {off_m:.1f} m from it: {_next(ctx)}", every_s=0.0)


def holds_ashore(ctx: StepContext) -> bool:
    """Say that an order keeps the boat from being set sailing, while it does."""
    status, standing = ctx.autopilot, ctx.state.orders.standing
    is_under_way = ctx.state.voyage.sailing or (
        ctx.state.mission.route is not None and status is not None and status.is_armed and status.mode is Mode.AUTO
    )
    if standing is None or standing.verb is not Verb.HOLD or is_under_way:
        return False
    ctx.phase(Phase.WAITING, f"held, {standing.why}: waiting {UNTIL_TOLD}")
    return True


def leaves_alone(ctx: StepContext) -> bool:
    """Say that the boat is given up, while it is; True: nothing is asked of it."""
    if not ctx.is_given_up:
        return False
    ctx.phase(
        Phase.OPERATOR if ctx.state.voyage.sailing else Phase.WAITING,
        f"given up, {_why(ctx)}: nothing is asked of her, waiting {UNTIL_TOLD}",
    )
    return True


# -------- Where an order to sail somewhere leads, or why it leads nowhere: judged before anything moves.


def refuge_place(ctx: StepContext, wanted: Wanted) -> Found | str:
    """Return the refuge's name and place, or what is wrong."""
    refuges = ctx.voyage.refuges
    if not refuges:
        return "the mission has no refuge"
    if not (wanted.name or wanted.mark or wanted.number):
        lasting = refuges_by_way(ctx)
        return (lasting[0].name, lasting[0].en_m) if lasting else "every refuge of the mission lies in water that dries"
    number = which(wanted, [r.name for r in refuges])
    if number is None:
        named = ", ".join(f"{n} {r.name}".rstrip() for n, r in enumerate(refuges, start=1))
        return f"the mission has no such refuge: it has {named}"
    chosen = refuges[number]
    return place_trouble(ctx, refuge_name(chosen), chosen.en_m, chosen.radius_m) or (chosen.name, chosen.en_m)


def home_place(ctx: StepContext) -> Found | str:
    """Return home, or why there is no way to it."""
    trouble, status = home_trouble(ctx), ctx.snapshot.autopilot
    if trouble or status is None or status.home is None:
        return trouble or "the autopilot is not heard"
    return "", ctx.voyage.frame.en_from_geo(status.home)


def goal_place(ctx: StepContext, wanted: Wanted) -> Found | str:
    """Return the place that was named, or what is wrong with it."""
    place = wanted.place
    if place is None:
        return "a goal needs a position"
    trouble = _trouble(ctx, place)
    if trouble:
        far_m = ctx.voyage.far_m
        is_near = not place.swapped.trouble and distance_m(_en(ctx, place.swapped), (0.0, 0.0)) <= far_m
        is_far = bool(place.trouble) or distance_m(_en(ctx, place), (0.0, 0.0)) > far_m
        return f"{trouble}; latitude and longitude are swapped?" if is_near and is_far else trouble
    return f"{place.lat_deg:.5f} {place.lon_deg:.5f}", _en(ctx, place)


def _trouble(ctx: StepContext, place: Place) -> str:
    return place.trouble or place_trouble(ctx, "the place", _en(ctx, place), GOAL_RADIUS_M)


def _en(ctx: StepContext, place: Place) -> PointEn:
    return ctx.voyage.frame.en_from_geo(place.point)


# -------- What an order to sail somewhere would lead to: the plan that would be asked for, and nothing is done.


def preview(ctx: StepContext, wanted: Wanted) -> RequestPlan | str:
    """Return the request for a plan that the order would make, or why it would make none. The context is used up."""
    if wanted.verb is Verb.GOAL:
        found = goal_place(ctx, wanted)
    elif wanted.verb is Verb.REFUGE:
        found = refuge_place(ctx, wanted)
    elif wanted.verb is Verb.HOME:
        found = home_place(ctx)
    else:
        return f"{wanted.words} leads nowhere that could be shown"
    if isinstance(found, str):
        return found
    name, en_m = found
    ctx.set(
        pending=changed(ctx.state.pending, plan=None),
        orders=changed(
            ctx.state.orders, standing=Standing(verb=wanted.verb, by="a preview", name=name, en_m=en_m, since_s=ctx.t_s)
        ),
    )
    missing = lacks(ctx)
    if missing:
        return f"for a plan there is no {missing}"
    ctx.actions.clear()
    request(ctx, ReplanReason.ORDER)
    return next((a for a in ctx.actions if isinstance(a, RequestPlan)), "no plan can be asked for from where she is")

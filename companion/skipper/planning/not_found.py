"""Nothing found, or no answer: the old plan while it is sound, the ladder's next step, at last a loiter."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.frozen import changed
from companion.messages import Command, Severity, waypoint
from companion.planners import AUTO
from companion.skipper.planning.asking import out_of_reach, request, speak_of_reach
from companion.skipper.planning.diversions import LACK_M, diversion, held_at, is_led_to, room_lacking_m
from companion.skipper.planning.ladder import first_of_auto
from companion.skipper.planning.tides import closes_ahead, opens_next
from companion.skipper.planning.track import of_way, steps
from companion.skipper.planning.uploads import is_on_board_sound, is_sound, is_way_clear, leads_there, too_risky, upload
from companion.skipper.planning.vessels import lies_in_the_way, meetings
from companion.skipper.step import DiversionKind, ReplanReason
from companion.skipper.step.context import StepContext
from companion.skipper.step.missions import lacking_m
from companion.skipper.step.state import PendingPlan, Phase
from companion.skipper.way.drying import AHEAD_S
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.stemming import waiting_place

FOUL = "current too strong"  # the code under which it is said
TIDE = "waiting for the tide"  # the same
TIDE_S = 120.0  # between two tries then, at most ...
LATER_S = 1800.0  # ... and where the tide opens nothing as far as a plan looks ahead
TRIES = 3  # of a planner that does not answer, before the next step of the ladder
LESS, LEAST_EFFORT = 0.5, 0.05  # of the planning budget: after each request that was not answered; never less
MORE = 1.2  # ... and after each that was


def asks_again(ctx: StepContext, pending: PendingPlan, reason: str) -> bool:
    """Ask again, with less effort, of a planner that did not answer; False where the ladder is to be climbed.

    Want of a processor is no want of a way: it costs effort and time, neither margin nor promise, and what is on board
    and sound is sailed on meanwhile. The ladder is climbed where what is on board is not sound or meets a vessel, for a
    problem may be what the planner dies of; and for its first step where that is another planner.
    """
    state = ctx.state
    ctx.set(
        plans=changed(
            ctx.state.plans, unanswered=state.plans.unanswered + 1, effort=max(LEAST_EFFORT, LESS * state.plans.effort)
        )
    )
    if ctx.state.plans.unanswered < TRIES and request(
        ctx, pending.reason, from_index=pending.from_index, rung=pending.rung, text=reason
    ):
        ctx.say(Severity.WARNING, "no answer", f"{reason}: asked again, with less effort", every_s=0.0)
        return True
    ctx.set(plans=changed(ctx.state.plans, unanswered=0))
    sails = state.voyage.sailing and state.mission.route is not None
    if pending.rung == 0 and ctx.config.planner.algorithm != AUTO.algorithm:
        return False
    if sails and (meetings(ctx) or not is_on_board_sound(ctx)):
        return False
    ctx.set(plans=changed(ctx.state.plans, retry=ctx.failed(state.plans.retry), rung=0))
    wait_s = ctx.state.plans.retry.not_before_s - ctx.t_s
    stays = "what is on board is sound and stays; " if sails else ""
    ctx.say(
        Severity.WARNING, "no answer", f"{reason}: {stays}asked again in {wait_s:.0f} s, with less effort", every_s=0.0
    )
    return True


def _keeps_floor(ctx: StepContext, pending: PendingPlan) -> bool:
    """Return whether the track of what is left of the mission keeps the floor, within the prediction's own error."""
    boat, vehicle, leg, ahead = ctx.boat_en, ctx.snapshot.vehicle, ctx.leg(), ctx.ahead()
    if boat is None or vehicle is None or leg is None or not ahead:
        return True
    return of_way(
        pending.problem,
        [boat, *ahead],
        heading_rad=vehicle.heading_rad,
        before_en=None,
        sailed_m=distance_m(leg[0], boat),
    ).is_within_error


def _risk_of_old(ctx: StepContext, pending: PendingPlan) -> str:
    """Return what of the mission sailed now is a greater risk than is allowed, by today's knowledge; empty: nothing."""
    boat, vehicle, ahead = ctx.boat_en, ctx.snapshot.vehicle, ctx.ahead()
    if boat is None or vehicle is None or not ahead:
        return ""
    return too_risky(pending.problem, [boat, *ahead], heading_rad=vehicle.heading_rad)


def _stays_as_it_is(ctx: StepContext, pending: PendingPlan) -> str:
    """Return why what is on board is sailed on at the ladder's end rather than left for a loiter; empty: it is left.

    A loiter, and the turn to it, take room that nobody has judged: where there is too little, what is on board stays
    as long as its legs keep the floor. Where it is sound, it stays for a loiter's sake only.
    """
    boat, vehicle = ctx.boat_en, ctx.snapshot.vehicle
    if boat is None or vehicle is None or not ctx.ahead():
        return ""
    is_sound = is_on_board_sound(ctx) and _keeps_floor(ctx, pending)
    risk = _risk_of_old(ctx, pending)
    if is_sound and risk:
        return risk
    lack_m = room_lacking_m(ctx, boat)
    if lack_m > LACK_M and (is_sound or (is_way_clear(ctx) and closes_ahead(ctx) is None)):
        return f"a loiter near by has {lack_m:.0f} m less than it takes in this wind"
    to_it = of_way(pending.problem, [boat, held_at(ctx, boat)[0]], heading_rad=vehicle.heading_rad, before_en=None)
    return "the turn to a loiter near by comes below the floor" if is_sound and not to_it.is_within_error else ""


def not_found(ctx: StepContext, pending: PendingPlan, reason: str) -> None:
    """Keep the old plan while it is sound, else take the next step of the ladder, at last hold.

    What a planner of somebody's choice does not find is looked for by ``auto`` before either: that costs nothing.
    One that leads elsewhere than she is bound for, to the goals instead of a refuge, or that ends short of them where a
    loiter has too little room, is kept at the ladder's end only.
    """
    ladder, first = steps(ctx), first_of_auto(ctx.config)
    state = ctx.state
    if pending.rung < first and _is_climbed(ctx, pending, reason, from_index=pending.from_index):
        return
    met = meetings(ctx) if state.mission.route is not None else ()
    is_last, is_cramped = pending.rung + 1 >= len(ladder), _ends_cramped(ctx, pending)
    is_to_stay = _is_bound_alike(ctx) and not is_cramped
    if (
        ((pending.rung <= first and is_to_stay) or (is_last and not is_to_stay) or leads_there(ctx, pending))
        and state.mission.route is not None
        and not met
        and is_on_board_sound(ctx)
        and _keeps_floor(ctx, pending)
        and not _risk_of_old(ctx, pending)
    ):
        ctx.set(plans=changed(ctx.state.plans, retry=ctx.failed(state.plans.retry), rung=0))
        ctx.say(Severity.WARNING, "no plan", f"no new plan ({reason}): the old one is sound and stays", every_s=0.0)
        return
    foul = _foul(ctx, pending)
    if foul:
        _wait_against(ctx, pending, foul, count=len(ladder))
        return
    # Only the boat's own place helps when the way from a waypoint ahead is closed: the rungs start at the boat.
    keeps = is_cramped or (pending.rung <= first and state.mission.route is not None and _tail_only(ctx))
    from_index = pending.from_index if keeps else None
    if _is_climbed(ctx, pending, reason, from_index=from_index):
        return
    ctx.set(plans=changed(ctx.state.plans, retry=ctx.failed(state.plans.retry), rung=0))
    stays = "" if met else _stays_as_it_is(ctx, pending)
    if stays:
        ctx.say(
            Severity.WARNING,
            "no plan",
            f"no plan, whatever is given up for one ({reason}): the old one stays; {stays}",
            every_s=0.0,
        )
        return
    if met and is_on_board_sound(ctx):
        # Loitering in a vessel's way is no better than sailing on through it: the operator must know.
        ctx.say(
            Severity.CRITICAL,
            "no way clear",
            f"no plan keeps clear of {met[0].name}, met in {met[0].time_s:.0f} s: the old plan stays",
            every_s=0.0,
        )
        return
    wait = ctx.state.plans.retry.not_before_s - ctx.t_s
    lies = lies_in_the_way(ctx) or out_of_reach(ctx, ctx.gate)
    reason += f"; {lies}" if lies else ""
    opens = opens_next(ctx)
    if opens is not None:
        retry = ctx.state.plans.retry
        patience_s = min(max(retry.not_before_s - ctx.t_s, 0.0), TIDE_S)
        if opens.in_s > AHEAD_S + LATER_S:  # no plan looks so far: only another wind could find a way
            patience_s = LATER_S
        ctx.set(plans=changed(ctx.state.plans, retry=replace(retry, not_before_s=ctx.t_s + patience_s)))
        ctx.say(Severity.WARNING, TIDE, f"no way before the tide is higher ({reason}): waiting; {opens.words}")
        hold(ctx, opens.words)
        return
    stays = "steered on by field" if ctx.is_by_field else "holding"
    ctx.say(
        Severity.CRITICAL,
        "no plan at all",
        f"no plan, whatever is given up for one ({reason}): {stays}, trying again in {wait:.0f} s",
        every_s=0.0,
    )
    hold(ctx, f"no plan found: {reason}")


def _is_climbed(ctx: StepContext, pending: PendingPlan, reason: str, *, from_index: int | None) -> bool:
    """Ask for a plan by the ladder's next step, and say so; False: there is none, or it cannot be asked for."""
    ladder = steps(ctx)
    if pending.rung + 1 >= len(ladder):
        return False
    where, following = ladder[pending.rung].name or "as configured", ladder[pending.rung + 1].name
    text = f"no plan {where} ({reason}): trying {following}"
    ctx.say(Severity.WARNING, f"ladder {pending.rung}", text, every_s=0.0)
    if ladder[pending.rung + 1].nearer_goal and pending.gate >= 0 and not lies_in_the_way(ctx):
        speak_of_reach(ctx, ctx.gates[pending.gate])
    return request(ctx, pending.reason, from_index=from_index, rung=pending.rung + 1, text=reason)


def _is_bound_alike(ctx: StepContext) -> bool:
    """Return whether what is on board is bound for where she is to go, or another refuge is asked for before it."""
    route, bound = ctx.state.mission.route, diversion(ctx)
    if route is None or bound is None:
        return route is not None and not route.bound_for
    is_refuge = bound.kind is DiversionKind.REFUGE and not bound.is_ordered
    if is_refuge and ctx.state.plans.retry.failures + 1 < len(ctx.voyage.refuges):
        return True  # margin is given up for one when none has a way with all of it
    return is_led_to(ctx, bound)


def _ends_cramped(ctx: StepContext, pending: PendingPlan) -> bool:
    """Return whether the mission ends with goals left, for which this was to be the plan, where a loiter lacks room."""
    route = ctx.state.mission.route
    if route is None or pending.reason is not ReplanReason.NEXT_GOAL or pending.from_index is None:
        return False
    return lacking_m(ctx.known_config, ctx.to_stay_in.area, route.points_en_m[-1]) > LACK_M


def _foul(ctx: StepContext, pending: PendingPlan) -> str:
    """Return why the current keeps the boat from where the plan leads, empty: it does not."""
    water = ctx.water
    return "" if water is None else water.trouble(pending.start_en_m, pending.problem.goal_en)


def _wait_against(ctx: StepContext, pending: PendingPlan, foul: str, *, count: int) -> None:
    """Wait for a weaker current: here where the boat is carried clear, else where it will be (the ladder's last step).

    No margin and no promise given up makes way against a current: the steps between are left out.
    """
    water, boat = ctx.water, ctx.boat_en
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    place = None if water is None or boat is None else waiting_place(water, ctx.voyage.area, boat, floor_m)
    is_here = place is None or place == boat
    where = "first to water where she is carried clear" if not is_here else "waiting against it"
    if place is None:
        where = f"nowhere near is she carried clear, {where}"
    ctx.say(Severity.CRITICAL, FOUL, f"{foul}: {where}")
    if not is_here and pending.rung + 1 < count and request(ctx, pending.reason, rung=count - 1, text=foul):
        return
    ctx.set(plans=changed(ctx.state.plans, retry=ctx.failed(ctx.state.plans.retry), rung=0))
    hold(ctx, foul)


def _tail_only(ctx: StepContext) -> bool:
    """Return whether the way to the present target is sound by itself, so that only the tail needs a plan."""
    boat, leg = ctx.boat_en, ctx.leg()
    return boat is not None and leg is not None and is_sound(ctx, [boat, leg[1]])


def hold(ctx: StepContext, why: str, *, anew: bool = False) -> None:
    """Loiter in the roomiest place near by, in a mission that ends there at once; ``anew``: out of another loiter."""
    boat, state = ctx.boat_en, ctx.state
    ctx.phase(Phase.HOLDING if state.voyage.sailing else Phase.WAITING, f"waiting for a plan: {why}")
    if boat is None or not state.voyage.sailing or state.mission.route is None:
        return  # not under way
    deep = ctx.to_stay_in
    is_there = state.mission.index >= len(state.mission.route.items) - 1 and not anew
    if is_there and not (deep.drying and float(deep.area.clearance_m([state.mission.route.points_en_m[-1]])[0]) <= 0.0):
        return  # already in the safe end of the mission
    place, room = held_at(ctx, boat)
    if is_there and room <= 0.0:
        return  # in water that dries, as any place about here
    end = waypoint(ctx.voyage.frame.geo_from_en(*place), command=Command.NAV_LOITER_UNLIM)
    why = f"{why}; loitering " + (f"with {room:.0f} m of room" if math.isfinite(room) else "in open water")
    n, route = state.mission.index, state.mission.route
    upload(ctx, route.led_aside(n, boat, [(end, place)], rung="hold", why=why), n + 1, why)

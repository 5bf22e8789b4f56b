"""Uploads: asking for one, and taking its end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from companion.boat import required_margin
from companion.frozen import changed
from companion.messages import Command, Mode, Severity
from companion.planner import Leg, Problem
from companion.planner.problem import evaluate, resolved
from companion.planner.risk import of_risky, path_risk, tacks_at_risk
from companion.planner.track import ExpectedTrack
from companion.skipper.board.mark import marked
from companion.skipper.planning.autopilot_beats import room_m, tacks_fail
from companion.skipper.planning.tides import closes_ahead
from companion.skipper.planning.track import of_way
from companion.skipper.planning.vessels import meetings
from companion.skipper.step import Route, StepContext, UploadMission, UploadOutcome, UploadResult
from companion.skipper.step.actions import Change
from companion.skipper.step.config import Guidance
from companion.skipper.step.missions import common_prefix, stopgap
from companion.skipper.step.state import PendingPlan, PendingUpload, Retry
from companion.skipper.way import PointEn, distance_m
from companion.skipper.way.judge import judge
from companion.skipper.way.voyage import water_to_keep
from companion.words import below_words, counted

SPARE_M = 0.3  # a boat below the floor may come no nearer than this more: the turn away takes room
TACKS_RISK = 1e-3  # a chance of contact by failed tacks is greater than another by more than this
NO_NEARER_M = 0.5  # a way clears what a boat lies in to within this
MARGIN_M = 0.1  # margins that differ by less are the same
NOT_PERMITTED_S = 3600.0  # a dry run plans anew each minute; that it uploads nothing is told with no more of them


def upload(
    ctx: StepContext,
    route: Route,
    set_current: int | None,
    text: str,
    *,
    whole: bool = False,
    change: Change | None = None,
) -> None:
    """Ask for the upload of a route, with our mark; without permission it stays ready and the status says so.

    A route that was planned must have been admitted (``judged``).
    """
    route = replace(route, items=marked(route.items))
    old = ctx.state.mission.route
    known = old is not None and not ctx.state.mission.foreign and ctx.state.mission.checked and not whole
    on_board = old.items if old is not None and known else ()
    number = ctx.new_id()
    keep = common_prefix(on_board, route.items)
    if old is not None and known:
        closing = stopgap(old, keep, ctx.state.mission.index)
    else:
        # A list that is not ours to keep a part of: whoever gives an armed boat AUTO meanwhile must not sail a mixture.
        closing = stopgap(route, 0, 0) if ctx.autopilot is not None and ctx.autopilot.is_armed else None
    action = UploadMission(
        upload_id=number,
        items=route.items,
        keep_first=keep,
        set_current=set_current,
        plan_id=route.plan_id,
        text=text,
        stopgap=None if closing is None else marked([closing])[0],
        change=change or Change(),
    )
    if not ctx.act(action):
        ctx.set(plans=changed(ctx.state.plans, ready_route=route))
        ready = f"a plan is ready: {_in_words(route)}{text and '; '}{text}"
        ctx.say(
            Severity.WARNING, "upload not permitted", f"{ready}; uploading is not permitted", every_s=NOT_PERMITTED_S
        )
        return
    # A read that is still under way will tell of the mission before this upload: its answer is not wanted.
    ctx.set(
        pending=changed(
            ctx.state.pending,
            read=None,
            upload=PendingUpload(
                upload_id=number, t_s=ctx.t_s, route=route, set_current=set_current, keep_first=action.keep_first
            ),
        ),
        plans=changed(ctx.state.plans, ready_route=None),
    )


def _in_words(route: Route) -> str:
    """Return how long a route is, in what time she is there and in how many legs."""
    ways = list(zip(route.leg_from_en_m, route.points_en_m, route.items, strict=True))
    sailed = [(a, b) for a, b, item in ways if item.command == Command.NAV_WAYPOINT]
    time = "" if route.cost_s is None else f" in {route.cost_s:.0f} s"
    return f"{sum(math.dist(a, b) for a, b in sailed):.0f} m{time}, {counted(len(sailed), 'leg')}"


def take_upload(ctx: StepContext, outcome: UploadOutcome) -> None:
    """Take the end of an upload: the new route sails, or the mission on board must be looked at."""
    pending = ctx.state.pending.upload
    if pending is None or pending.upload_id != outcome.upload_id:
        return
    if outcome.result is UploadResult.OK:
        index, missed_s = ctx.state.mission.index, ctx.state.progress.missed_s
        if pending.set_current is not None:
            index = pending.set_current - 1
        ctx.set(
            pending=changed(ctx.state.pending, upload=None, upload_retry=Retry()),
            mission=changed(
                ctx.state.mission,
                route=pending.route,
                index=index,
                own_index=max(index, 0),
                checked=True,
                foreign="",
                unsure_route=None,
                replace_foreign=False,
                uploaded_s=ctx.t_s,
                asked_s=ctx.t_s if pending.set_current is not None else ctx.state.mission.asked_s,
                asked_seq=pending.set_current if ctx.state.voyage.sailing else None,
            ),
            progress=changed(  # an upload that was on its way at the miss does not lead back
                ctx.state.progress, missed_s=missed_s if missed_s is not None and pending.t_s <= missed_s else None
            ),
            plans=changed(
                ctx.state.plans,
                no_go_since_s=None,
                replanned_index=ctx.state.plans.replanned_index if pending.set_current != 1 else -1,
            ),
        )
        if ctx.state.voyage.sailing:
            look_at_margin(ctx, every_s=math.inf)
        return
    ctx.set(
        pending=changed(ctx.state.pending, upload=None, upload_retry=ctx.failed(ctx.state.pending.upload_retry)),
        mission=changed(ctx.state.mission, unsure_route=pending.route, checked=False, read_since_s=ctx.t_s),
    )
    ctx.say(
        Severity.ERROR,
        "upload failed",
        f"upload {outcome.result.value}: {outcome.text or 'no words'}; reading what is on board",
        every_s=0.0,
    )


def look_at_margin(ctx: StepContext, *, every_s: float | None = None) -> None:
    """Say so when the autopilot's habits ask for more than the margin that plans keep, and the way needs it.

    A way that keeps off everything by what they ask for may be left as far as they lead. Without a corridor nothing
    bounds that, and in a field there is no way that is followed: then it is always said.
    """
    limits, wind, route = ctx.snapshot.limits, ctx.wind_mean, ctx.state.mission.route
    if limits is None or wind is None or ctx.is_said("margin", every_s or ctx.config.announce_interval_s):
        return
    boat, corridor_m = ctx.voyage.boat, ctx.tack_corridor_m
    limits = replace(limits, sail_xtrack_max_m=corridor_m)
    asked = required_margin(limits, speed_mps=boat.polar.max_speed_mps(wind[1]), hull=boat.hull)
    if asked.total_m <= ctx.config.margin_m + 0.5:
        return
    is_bounded = corridor_m > 0.0 or ctx.steers_plans
    if is_bounded and ctx.guidance is not Guidance.FIELD and route is not None and ctx.boat_en is not None:
        way = [ctx.boat_en, *route.points_en_m[max(ctx.state.mission.index, 0) :]]
        if len(way) > 1 and ctx.voyage.area.path_clearance_m(way) >= asked.total_m:
            return
    ctx.say(
        Severity.WARNING,
        "margin",
        f"the margin is {ctx.config.margin_m:g} m; the autopilot's habits ask for {asked.describe()}",
        every_s=every_s,
    )


# --------------------
# A plan that is there, held against what is known today: the chance that a tack fails, the current, the wind.
# A plan was within what the mission allows when it was made. Since then tacks have failed, or a current was told. What
# is there stays for being there only while it is within that still.


def is_riskier(problem: Problem, old: Sequence[Leg], new: Sequence[Leg]) -> bool:
    """Return whether the old legs are too risky to stay beside the new ones.

    That is above the limit on a path's risk, where the mission has one; or with tacks that may bring the boat onto
    something when they fail, where the new legs have fewer or less likely ones.
    """
    before = of_risky(tacks_at_risk(problem, old))
    return _over_limit(problem, old) > 0.0 or (before > 0.0 and of_risky(tacks_at_risk(problem, new)) < before)


def is_begun_risky(problem: Problem, legs: Sequence[Leg]) -> bool:
    """Return whether the turn that begins the legs is a tack that may bring the boat onto something when it fails."""
    return any(tack.is_risky and tack.leg == 0 and not legs[0].is_beat for tack in tacks_at_risk(problem, legs))


def too_risky(problem: Problem, way: Sequence[PointEn], *, heading_rad: float) -> str:
    """Return what of a way that begins elsewhere than the problem is too great a risk, in words; empty: nothing."""
    here = replace(problem, start_en=way[0], start_heading_rad=heading_rad)
    legs = evaluate(here, np.asarray(way)).legs
    over = _over_limit(here, legs)
    if over > 0.0:
        return f"its risk of {100.0 * over:.2g} % is above the limit"
    touches = of_risky(tacks_at_risk(here, legs))
    return f"tacks of it that fail would bring her onto something: {100.0 * touches:.2g} %" if touches > 0.0 else ""


def _over_limit(problem: Problem, legs: Sequence[Leg]) -> float:
    """Return the risk of legs that is above the limit on a path's; 0: within it, or there is none."""
    total = 0.0 if problem.risk is None else path_risk(problem, legs).total
    return total if problem.risk is not None and total > problem.risk.max_path_risk else 0.0


# ----------- Admission: whether a plan may go to the autopilot, held against what is on board there.
# Every plan passes here before its upload. The way on board and the new one, both
# from where the boat is now, are judged by one problem: the same wind, current, obstacles and predicted track. Two
# rules:
#
# 1. **Not below the floor.** The hull keeps the margin's floor all along the predicted track. From a place that is
#    below it already, the way comes no nearer to anything solid than the boat is, or than the way on board would
#    bring it.
# 2. **Not less than what is on board**: not a smaller margin or delta_s, not tacks whose failure is likelier to end in
#    a contact, not a risk above the mission's limit and above that of the way on board. Unless what is on board is
#    closed: it leads elsewhere, meets a vessel, does not keep the floor within the prediction's own error, or the wind
#    of now or the forecast's has shut it.


class Judgement(NamedTuple):
    """Why a plan's route may not replace the one on board, in words, empty: it may; and the track it was judged by.

    The track is None where nothing is sailed yet: then nothing is refused.
    """

    refused: str = ""
    track: ExpectedTrack | None = None


def judged(ctx: StepContext, route: Route, set_current: int | None, pending: PendingPlan) -> Judgement:
    """Return whether a plan's route may replace the one on board.

    ``set_current`` is the item number (1: the first) that is made current with it, None: the present one stays.
    """
    boat, vehicle = ctx.boat_en, ctx.snapshot.vehicle
    if boat is None or vehicle is None or not ctx.state.voyage.sailing:
        return Judgement()
    problem = pending.problem
    here_m = clearance_here_m(ctx, boat)
    # Below the floor, and where it has to be gybed round, a way of short legs is better than none.
    has_loops = not tacks_fail(ctx) and (problem.tracking is None or here_m >= problem.tracking.floor_m)
    first = ctx.state.mission.index if set_current is None else set_current - 1
    heading_rad, begins = vehicle.heading_rad, boat
    if set_current is not None and pending.from_index is None and not pending.lead_in:
        # where the boat is by the time that it is on board
        begins, heading_rad = pending.start_en_m, problem.start_heading_rad
    new = [begins, *route.points_en_m[first:-1]]
    old, ahead, leg = [boat, *ctx.ahead()], ctx.ahead(), ctx.leg()
    sailed_m = 0.0 if leg is None else distance_m(leg[0], boat)
    before = (
        ExpectedTrack()
        if not ahead
        else of_way(
            problem, old, heading_rad=vehicle.heading_rad, before_en=None, sailed_m=sailed_m, has_loops=has_loops
        )
    )
    seen = of_way(
        problem,
        new,
        heading_rad=heading_rad,
        before_en=None,
        has_loops=has_loops,
        sailed_m=sailed_m if set_current is None else 0.0,
    )
    low = _below_floor(problem, seen, before if ahead and _is_sailed(ctx) else None, here_m=here_m)
    if low or not ahead or not is_open(ctx, pending, before):
        return Judgement(low, seen)
    return Judgement(_less(ctx, pending, new, old, heading_rad=heading_rad), seen)


def clearance_here_m(ctx: StepContext, boat: PointEn) -> float:
    """Return the clearance of a boat's hull where it is [m]: outside the limits, of what is solid."""
    return float(water_to_keep(ctx.voyage.area, boat).clearance_m([boat])[0]) - ctx.voyage.boat.hull.reach_m


def _is_sailed(ctx: StepContext) -> bool:
    """Return whether the autopilot sails the mission on board, or we by it, rather than loiter."""
    return ctx.autopilot is not None and ctx.autopilot.mode in {Mode.AUTO, Mode.GUIDED}


def _below_floor(problem: Problem, new: ExpectedTrack, old: ExpectedTrack | None, *, here_m: float) -> str:
    """Return how a new way breaks the first rule, empty: it does not."""
    floor_m = 0.0 if problem.tracking is None else problem.tracking.floor_m
    if new.lack_m <= 0.0:
        return ""
    says = f"it would pass {below_words(new.clearance_m, floor_m)} m clear, the floor is {floor_m:g} m"
    if here_m >= floor_m:
        return says
    least_m = here_m if old is None else min(here_m, old.clearance_m)
    return "" if new.clearance_m >= least_m - SPARE_M else f"{says}, and the boat is {here_m:.1f} m clear"


def is_open(ctx: StepContext, pending: PendingPlan, seen: ExpectedTrack) -> bool:
    """Return whether the way on board leads where the new one does, keeps the floor and can be sailed."""
    return leads_there(ctx, pending) and seen.is_within_error and not meetings(ctx) and is_on_board_sound(ctx)


def leads_there(ctx: StepContext, pending: PendingPlan) -> bool:
    """Return whether the mission on board is ours and leads where a plan was asked for."""
    route = ctx.state.mission.route
    if route is None or ctx.state.mission.foreign or route.bound_for != pending.facts.bound_for:
        return False
    if pending.gate < 0:
        return bool(pending.facts.bound_for)
    return pending.gate in route.gate_of[ctx.state.mission.index : -1]


def is_on_board_sound(ctx: StepContext) -> bool:
    """Return whether what is left of the mission on board is sound from where the boat is."""
    boat, ahead = ctx.boat_en, ctx.ahead()
    return boat is not None and bool(ahead) and is_sound(ctx, [boat, *ahead]) and closes_ahead(ctx) is None


def is_way_clear(ctx: StepContext) -> bool:
    """Return whether what is left of the way on board, straight from where the boat is, comes no nearer than it may.

    That is the margin's floor, or what the boat has about it now where that is less.
    """
    boat, leg, area = ctx.boat_en, ctx.leg(), ctx.voyage.area
    if boat is None or leg is None:
        return False
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m, float(area.clearance_m([boat])[0]) - NO_NEARER_M)
    return area.path_clearance_m([boat, leg[1], *ctx.ahead()[1:]]) >= max(0.0, floor_m)


def is_sound(ctx: StepContext, way: Sequence[PointEn]) -> bool:
    """Return whether a way is good for the mean wind and for the present one, and keeps the margin's floor.

    After a shift the mean is of a wind that blows no more; only the leg that is sailed now is held against the present.
    """
    mean, now = ctx.wind_mean, ctx.wind_now
    if mean is None or now is None:
        return False
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    return all(
        judge(
            part,
            boat=ctx.voyage.boat,
            no_go_half_rad=ctx.no_go_half_rad,
            twd_from_rad=wind[0],
            tws_mps=wind[1],
            area=ctx.voyage.area,
            beat_room_m=room_m(ctx),
            current_en_mps=ctx.current_en_mps,
        ).is_sound(floor_m)
        for part, wind in ((way, mean), (way[:2], now))
    )


def _less(ctx: StepContext, pending: PendingPlan, new: list[PointEn], old: list[PointEn], *, heading_rad: float) -> str:
    """Return what a new way promises less of than the open one on board, in words; empty: nothing."""
    route, facts = ctx.state.mission.route, pending.facts
    assert route is not None
    if facts.margin_m < route.margin_m - MARGIN_M:
        return f"its margin is {facts.margin_m:.1f} m, that of the way on board, which is open, {route.margin_m:.1f} m"
    if facts.delta_s < route.delta_s - 1e-9:
        return f"its delta_s is {facts.delta_s:g}, that of the way on board, which is open, {route.delta_s:g}"
    here = replace(resolved(pending.problem), start_en=new[0], start_heading_rad=heading_rad)
    legs = [evaluate(replace(here, start_en=way[0]), np.asarray(way)).legs for way in (new, old)]
    tacks = [min(1.0, of_risky(tacks_at_risk(here, each))) for each in legs]  # a union bound may be above 1
    if tacks[0] > tacks[1] + TACKS_RISK:
        return (
            f"tacks of it that fail are likelier to end in a contact: {100.0 * tacks[0]:.2g} %, "
            f"of the way on board {100.0 * tacks[1]:.2g} %"
        )
    limit = ctx.config.max_path_risk
    if limit is not None and here.risk is not None:
        risks = [path_risk(here, each).total for each in legs]
        if risks[0] > max(limit, risks[1]):
            return f"its risk is {100.0 * risks[0]:.2g} %, that of the way on board {100.0 * risks[1]:.2g} %"
    return ""

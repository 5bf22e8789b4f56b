"""Passing: which gates the boat has passed, by nearness, round a buoy, or across a line; which it missed."""

from __future__ import annotations

import math
from typing import Any

import shapely

from companion.frozen import changed
from companion.messages import Severity
from companion.orders import Verb
from companion.skipper.behaviors.field_guidance import has_sailed
from companion.skipper.planning.diversions import LACK_M
from companion.skipper.planning.tides import dries_under
from companion.skipper.planning.waits import gun_in_s, stay_left_s, waits_for_gun
from companion.skipper.step.actions import CancelPlan, ReplanReason
from companion.skipper.step.context import FRESH_S, StepContext
from companion.skipper.step.missions import lacking_m, roomy_m
from companion.skipper.step.state import Inside
from companion.skipper.way.gates import Approach, Gate, again, has_come_round, is_on_wrong_side
from companion.skipper.way.geometry import distance_m, leg_distance_m
from companion.skipper.way.line import BEFORE_M, BEYOND_M, STRAY_M, ahead_m, crossing, is_between, width_m
from companion.skipper.way.sweeps import coverage, grown, is_off, left_over, sweeps_over
from companion.skipper.way.voyage import PointEn, Search

GAP_S = 2.0 + FRESH_S  # between two fixes that belong together
AT_MOST = 4  # rounds: the sweeps, and what they left; the wind's own anew are not counted
HAIR_M = 0.5
DECIDES_M = 100.0  # so near to a box she decides whether she can stay in it: later the way out of it may have no room
COUNTED_M = 30.0
WIDE_RAD = math.radians(60.0)  # by headings corners are cut within the grid size, which is wider than a buoy's circle
UPON_M = 6.0  # before a line: a waypoint close beyond it may be left, or said to be left, a moment before she crosses
OFTEN = 3  # misses on one voyage, and then somebody should know


def pass_gates(ctx: StepContext) -> None:
    """Count the gates passed: by being there, or by the autopilot's count."""
    boat = ctx.boat_en
    if boat is None:
        return
    by_field = ctx.is_field_steered
    standing = ctx.state.orders.standing
    if standing is not None and standing.verb is Verb.HOLD:  # what she comes by meanwhile is not sailed to
        follow_search(ctx)
        return
    _approach(ctx)
    _cross(ctx)
    if ctx.gate is not None and ctx.gate.line is not None and not waits_for_gun(ctx, ctx.gate):
        ctx.set(progress=changed(ctx.state.progress, released=ctx.gate.goal))
    follow_search(ctx)
    while ctx.gate is not None and ctx.state.mission.route is not None:
        gate, number = ctx.gate, ctx.state.progress.gate
        if gate.box is not None:
            if not _has_stayed(ctx, gate, boat):
                return
            continue
        if gate.field is not None:
            if not has_sailed(ctx, gate, boat):
                return
            continue
        if gate.search is not None and gate.sweep[1] == 0:
            lay_sweeps(ctx, gate)
            return
        if gate.is_crossed:
            counted = number in ctx.state.mission.route.gate_of[: ctx.state.mission.index]
            if (counted and not _is_upon(gate, boat)) or _is_outside(gate, boat):
                _begin_again(ctx, gate, boat, f"{gate.name} was passed by outside of its marks: again")
            return
        left = distance_m(boat, gate.en_m)
        counted = number in ctx.state.mission.route.gate_of[: ctx.state.mission.index]
        near = max(gate.radius_m, 0.0 if _is_own_count(ctx, gate) else _grid_m(ctx))
        # A field leads to the last place itself, whatever of the mission on board is left.
        leaves = counted and left > near and (not _is_last(ctx) or (_is_own_count(ctx, gate) and not by_field))
        if not (
            ctx.state.progress.closest_m <= gate.radius_m
            or (counted and left <= near and not _is_last(ctx))
            or _is_near_enough(ctx, gate, counted)
            or _is_before(gate, boat)
        ):
            if leaves:
                # It was left behind and we were never near.
                ctx.void_route()
                missed(ctx)
            return
        spare_rad = WIDE_RAD if counted and ctx.is_steered else 0.0
        if not has_come_round(gate, ctx.state.progress.bearing_rad, spare_rad=spare_rad):
            is_wrong = is_on_wrong_side(gate, ctx.state.progress.bearing_rad)
            if not is_wrong and not leaves:
                return  # she is on her way round
            how = "left on the wrong side" if is_wrong else "not rounded"
            if is_wrong:
                ctx.approach(again(gate, boat, ctx.state.progress.bearing_rad))
            else:
                ctx.void_route()  # from here on round it
            missed(ctx)
            ctx.say(Severity.WARNING, "buoy missed", f"{gate.name} was {how}: again", every_s=0.0)
            return
        if gate.search is not None and gate.ends_goal:
            if lay_sweeps(ctx, gate):
                return
            end_search(ctx, gate)
            return
        closest = ctx.state.progress.closest_m
        reached = (*ctx.state.progress.reached, gate.goal) if gate.ends_goal else ctx.state.progress.reached
        ctx.set(progress=changed(ctx.state.progress, gate=number + 1, reached=reached, closest_m=math.inf))
        if gate.ends_goal:
            ctx.set(progress=changed(ctx.state.progress, bearing_rad=0.0))
            least_m = min(left, closest)
            is_counted = counted and least_m > gate.radius_m
            how = f"{least_m:.1f} m from it"
            if gate.buoy_en_m is not None:
                how = f"left to {gate.side.value}, {distance_m(boat, gate.buoy_en_m):.1f} m off"
            elif is_counted:
                passed = "passed in a turn" if ctx.is_steered else "the autopilot has passed it"
                how += f": {passed}, its radius is {gate.radius_m:g} m"
            ctx.say(Severity.NOTICE, "goal", f"{gate.name} reached, {how}", every_s=0.0)


def _has_stayed(ctx: StepContext, gate: Gate, boat: PointEn) -> bool:
    """Count the time in a box from entry on; True when it is over, it was told to go on, or she cannot stay there."""
    box, inside = gate.box, ctx.state.progress.inside
    assert box is not None
    if inside is None or inside.goal != gate.goal:
        if not shapely.covers(box.area_en, shapely.points(boat)):
            _leave_out(ctx, gate, boat)
            return False
        inside = Inside(goal=gate.goal, t_s=ctx.t_s, utc_s=ctx.utc_s)
        ctx.set(progress=changed(ctx.state.progress, inside=inside))
        ctx.say(Severity.NOTICE, "box", f"{gate.name} entered", every_s=0.0)
    is_told = ctx.state.progress.released == gate.goal
    ends = _cannot_stay(ctx, gate)
    if stay_left_s(ctx, gate) > 0.0 and not is_told and not ends:
        return False
    ctx.set(
        progress=changed(
            ctx.state.progress,
            gate=ctx.state.progress.gate + 1,
            reached=(*ctx.state.progress.reached, gate.goal),
            closest_m=math.inf,
            inside=None,
        )
    )
    why = "told to go on" if is_told else ends or "her time is over"
    ctx.say(
        Severity.WARNING if ends else Severity.NOTICE,
        "goal",
        f"{gate.name}: {why} after {inside.age_s(ctx.t_s, ctx.utc_s):.0f} s in it",
        every_s=0.0,
    )
    return True


def _leave_out(ctx: StepContext, gate: Gate, boat: PointEn) -> None:
    """Give up a box that she comes to and cannot stay in, for the goal behind it."""
    if gate.goal + 1 >= len(ctx.voyage.legs) or distance_m(boat, gate.en_m) > DECIDES_M:
        return
    why = _cannot_stay(ctx, gate)
    if why:
        ctx.say(Severity.WARNING, "box", f"{ctx.give_up(gate, ReplanReason.NEXT_GOAL)}: {why}", every_s=0.0)


def _cannot_stay(ctx: StepContext, gate: Gate) -> str:
    """Return why she cannot stay in a box any longer, empty: she can."""
    dries = dries_under(ctx, gate.en_m)
    if dries:
        return f"{dries} is about to dry"
    needs_m, lacks_m = roomy_m(ctx.known_config), lacking_m(ctx.known_config, ctx.voyage.area, gate.en_m)
    if lacks_m > LACK_M:
        return f"a loiter takes {needs_m:.0f} m to each side in this wind, and has {needs_m - lacks_m:.0f}"
    return ""


def _is_before(gate: Gate, boat: PointEn) -> bool:
    """Return whether the boat is where the way across the gate's line may begin, though not at the place for it."""
    return (
        gate.is_before_line
        and gate.line is not None
        and is_between(gate.line, boat)
        and (ahead_m(gate.line, boat) <= -0.5 * BEFORE_M)
    )


def _is_upon(gate: Gate, boat: PointEn) -> bool:
    """Return whether the boat is straight before the gate's line and all but over it."""
    line = gate.line
    return line is not None and is_between(line, boat) and -UPON_M < ahead_m(line, boat) <= 0.0


def _is_outside(gate: Gate, boat: PointEn) -> bool:
    """Return whether the boat has got beyond the gate's line beside its marks: no way from here crosses it."""
    line = gate.line
    return line is not None and ahead_m(line, boat) > STRAY_M and not is_between(line, boat)


def _cross(ctx: StepContext) -> None:
    """Count a line that was crossed since the last fix; say so where that was too early, or the wrong way."""
    boat, gate, last = ctx.boat_en, ctx.gate, ctx.state.position.last_seen
    if boat is None or ctx.is_raised("position jump"):
        return
    is_blind = ctx.state.progress.is_blind or last is None or ctx.t_s - last.t_s > GAP_S
    ctx.set(progress=changed(ctx.state.progress, is_blind=False))
    if gate is None or gate.line is None:
        return
    found = crossing(gate.line, last.en_m, boat) if last is not None and not is_blind else None
    # Sailed on by the autopilot while nobody looked, the boat is straight behind the line: its leg led across it.
    unseen = (
        is_blind
        and gate.is_crossed
        and is_between(gate.line, boat)
        and (0.0 < ahead_m(gate.line, boat) <= BEYOND_M + _grid_m(ctx))
    )
    if not unseen and (found is None or (not found.is_forward and not gate.is_crossed)):
        return
    if found is not None and not found.is_forward:
        text = f"{gate.name} was crossed the wrong way: it does not count"
        ctx.say(Severity.WARNING, "wrong way", text, every_s=0.0)
        return
    left_s = gun_in_s(ctx, gate.line)
    if gate.line.is_start and (left_s is None or left_s > 0.0):
        early = "before its time is known" if left_s is None else f"{left_s:.0f} s before the gun"
        ctx.set(progress=changed(ctx.state.progress, released=-1))
        _begin_again(ctx, gate, boat, f"{gate.name} was crossed {early}: back and again", code="early start")
        return
    following = next((n for n, g in enumerate(ctx.gates) if g.goal > gate.goal), len(ctx.gates))
    if not gate.is_crossed:
        # The boat's route leads to the place before the line, which is behind it.
        ctx.set(plans=changed(ctx.state.plans, asked=f"{gate.name} is crossed", asked_as=ReplanReason.NEXT_GOAL))
    ctx.set(
        progress=changed(
            ctx.state.progress,
            gate=following,
            reached=(*ctx.state.progress.reached, gate.goal),
            closest_m=math.inf,
            bearing_rad=0.0,
            missed_s=None,
        )
    )
    how = (
        "while nobody looked"
        if found is None
        else (f"{min(found.from_port_m, width_m(gate.line) - found.from_port_m):.1f} m inside of the nearer mark")
    )
    after = f", {-left_s:.0f} s after the gun" if gate.line.is_start and left_s is not None else ""
    ctx.say(Severity.NOTICE, "goal", f"{gate.name} crossed {how}{after}", every_s=0.0)


def _begin_again(ctx: StepContext, gate: Gate, boat: PointEn, why: str, *, code: str = "gate missed") -> None:
    """Sail to a line once more, from where the boat is."""
    ctx.approach(Approach(goal=gate.goal, en_m=boat))
    missed(ctx)
    ctx.say(Severity.WARNING, code, why, every_s=0.0)


def _approach(ctx: StepContext) -> None:
    """Keep the smallest distance to the gate, between the last fix and this one too."""
    boat, gate, last = ctx.boat_en, ctx.gate, ctx.state.position.last_seen
    if boat is None or gate is None:
        return
    way = distance_m(boat, gate.en_m)
    if last is not None and ctx.t_s - last.t_s <= GAP_S and not ctx.is_raised("position jump"):
        way = min(way, leg_distance_m(gate.en_m, last.en_m, boat))
    ctx.set(progress=changed(ctx.state.progress, closest_m=min(ctx.state.progress.closest_m, way)))


def _is_near_enough(ctx: StepContext, gate: Gate, counted: bool) -> bool:
    """Return whether the last goal counts as reached although its radius was not: Büsser's grid size, and no better.

    The boat has been at the waypoint by the count of who steers by the mission, and loiters in its safe end. A field
    knows no waypoint: it leads to the goal itself.
    """
    route = ctx.state.mission.route
    if route is None or not counted or not _is_last(ctx) or ctx.state.progress.closest_m > _grid_m(ctx):
        return False
    if ctx.is_field_steered:
        return False
    at_end = ctx.state.mission.index >= len(route.items) - 1
    return at_end and (distance_m(route.points_en_m[-1], gate.en_m) > gate.radius_m or ctx.is_raised("mission ended"))


def _grid_m(ctx: StepContext) -> float:
    """Return how near the autopilot's count of a waypoint is believed [m]: as she may be off a leg, but no farther."""
    return min(ctx.config.grid_size_m, COUNTED_M)


def _is_own_count(ctx: StepContext, gate: Gate) -> bool:
    """Return whether we count a place's waypoint, who steer, and not the autopilot: we know of its radius.

    Of a buoy it is how she comes round that counts.
    """
    return ctx.is_steered and gate.buoy_en_m is None


def _is_last(ctx: StepContext) -> bool:
    return ctx.state.progress.gate == len(ctx.gates) - 1


def missed(ctx: StepContext) -> None:
    """Have the gate that is next planned for from where the boat is; what is being planned was for another."""
    if ctx.state.pending.plan is not None:
        ctx.act(CancelPlan(request_id=ctx.state.pending.plan.request_id))
    count = ctx.state.progress.missed + 1
    ctx.set(
        progress=changed(ctx.state.progress, missed=count, missed_s=ctx.t_s),
        pending=changed(ctx.state.pending, plan=None),
    )
    if count >= OFTEN:
        text = f"marks were missed {count} times on this voyage; the order skip_goal gives the next one up"
        ctx.say(Severity.CRITICAL, "missed often", text, every_s=0.0)


# -------- Searching an area: its sweeps laid and laid anew, what the track has covered, when it is done.


def follow_search(ctx: StepContext) -> None:
    """Note where the boat is while it searches, and lay the rest anew between two sweeps where the wind has turned."""
    gate, boat = ctx.gate, ctx.boat_en
    if gate is None or gate.search is None:
        if ctx.state.progress.task:
            ctx.set(progress=changed(ctx.state.progress, searched=(), task=""))
        return
    if boat is None:
        return
    search = gate.search
    if float(shapely.distance(search.area_en, shapely.points(boat))) <= search.swath_m:
        ctx.set(progress=changed(ctx.state.progress, searched=grown(ctx.state.progress.searched, boat, search.swath_m)))
    share = coverage(search.area_en, ctx.state.progress.searched, search.swath_m)
    number, count = gate.sweep
    ctx.set(
        progress=changed(
            ctx.state.progress,
            task=f"sweep {number} of {count}, {100.0 * share:.0f} % covered" if count else "sweeps not laid yet",
        )
    )
    if count and ctx.wind_mean is not None and _begins(ctx, gate) and is_off(ctx.wind_mean[0], _laid(ctx, gate)[1]):
        lay_sweeps(ctx, gate, is_shift=True)


def _begins(ctx: StepContext, gate: Gate) -> bool:
    """Return whether the gate is where a sweep begins: the boat is not on one."""
    before = ctx.gates[ctx.state.progress.gate - 1] if ctx.state.progress.gate > 0 else None
    return before is None or before.goal != gate.goal or before.sweep != gate.sweep


def _laid(ctx: StepContext, gate: Gate) -> tuple[int, float]:
    """Return how often the sweeps of a gate's goal were laid, and for which wind."""
    approach = next((a for a in ctx.state.progress.approaches if a.goal == gate.goal), None)
    return (0, 0.0) if approach is None else (approach.round, approach.twd_from_rad)


def lay_sweeps(ctx: StepContext, gate: Gate, *, is_shift: bool = False) -> bool:
    """Lay what is left to be searched in sweeps for the present wind; False when nothing is, or it was tried enough."""
    search, boat, wind = gate.search, ctx.boat_en, ctx.wind_mean
    if search is None or boat is None or wind is None:
        return False
    rounds, _ = _laid(ctx, gate)
    share = coverage(search.area_en, ctx.state.progress.searched, search.swath_m)
    if not is_shift and rounds > 0 and (share >= search.coverage or rounds >= AT_MOST):
        return False
    # What lies between the margin and the shore is seen from the sweep beside it, or not at all.
    sweeps = sweeps_over(_water(ctx, search), search.swath_m, wind[0], boat)
    if not sweeps:
        return False
    if ctx.state.pending.plan is not None:
        ctx.act(CancelPlan(request_id=ctx.state.pending.plan.request_id))
    count = max(1, rounds if is_shift else rounds + 1)
    ctx.approach(Approach(goal=gate.goal, en_m=boat, sweeps=sweeps, twd_from_rad=wind[0], round=count))
    why = "the wind has turned: " if is_shift else f"{100.0 * share:.0f} % covered: " if rounds else ""
    ctx.set(
        pending=changed(ctx.state.pending, plan=None),
        plans=changed(
            ctx.state.plans, asked=f"{why}{len(sweeps)} sweeps of {gate.name}", asked_as=ReplanReason.NEXT_GOAL
        ),
    )
    ctx.say(
        Severity.NOTICE,
        "sweeps",
        f"{gate.name}: {why}{len(sweeps)} sweeps across a wind from {math.degrees(wind[0]) % 360.0:.0f} deg",
        every_s=0.0,
    )
    return True


def _water(ctx: StepContext, search: Search) -> Any:
    """Return what of a search is left and may be sailed over: at the plan's margin, with room to turn behind."""
    area, margin_m, boat, wind = ctx.voyage.area, ctx.config.margin_m, ctx.voyage.boat, ctx.wind_mean
    room_m = HAIR_M + (0.0 if wind is None else boat.polar.max_speed_mps(wind[1]) / boat.turn_rate_radps)
    water = left_over(search.area_en, ctx.state.progress.searched, search.swath_m)
    solid = [shapely.from_wkt(w) for w in area.obstacles_wkt(margin_m)]
    if solid:
        water = shapely.difference(water, shapely.buffer(shapely.union_all(solid), room_m))
    fence = area.fence_wkt(margin_m)
    return water if fence is None else shapely.intersection(water, shapely.buffer(shapely.from_wkt(fence), -room_m))


def end_search(ctx: StepContext, gate: Gate) -> None:
    """The search is over: say what was covered."""
    search = gate.search
    assert search is not None
    share = coverage(search.area_en, ctx.state.progress.searched, search.swath_m)
    following = next((n for n, g in enumerate(ctx.gates) if g.goal > gate.goal), len(ctx.gates))
    ctx.set(
        progress=changed(
            ctx.state.progress,
            gate=following,
            reached=(*ctx.state.progress.reached, gate.goal),
            closest_m=math.inf,
            searched=(),
            task="",
            covered=(*ctx.state.progress.covered, (gate.goal, round(share, 4))),
        )
    )
    less = "" if share >= search.coverage else f", less than the {100.0 * search.coverage:.0f} % that were asked for"
    severity = Severity.WARNING if less else Severity.NOTICE
    ctx.say(severity, "goal", f"{gate.name} searched: {100.0 * share:.0f} % covered{less}", every_s=0.0)

"""A plan that is there, judged by what is known today: kept while its risk is allowed, not for being there."""

import math
from dataclasses import replace

import shapely

from companion.planner import plan
from companion.planner.problem import RiskLimit, evaluate
from companion.planner.risk.tacks import of_risky, tacks_at_risk
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.asking import request
from companion.skipper.planning.not_found import not_found
from companion.skipper.planning.uploads import is_begun_risky, is_riskier, too_risky
from companion.skipper.step.actions import Announce, ReplanReason, RequestPlan, UploadMission
from companion.skipper.step.snapshot import PlanOutcome
from companion.skipper.way.voyage import Goal
from tests.planner.risk.test_tacks import channel
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.test_voyage import make
from tests.skipper.world import with_parts

WALLS = (shapely.box(-90.0, -80.0, -46.0, 500.0), shapely.box(46.0, -80.0, 90.0, 500.0))
LEARNED = {"tried": 10, "failed": 9}  # 47 % from now on


def careless(fails=0.3):
    """Return a channel where tacks fail so often, and legs up to its walls."""
    return channel(fails), plan(channel(0.0), expansions=20_000).legs


def test_old_legs_stay_no_longer_when_tacks_fail_and_new_ones_have_room_for_it():
    problem, old = careless()
    new = plan(problem, expansions=20_000).legs
    assert is_riskier(problem, old, new)
    assert not is_riskier(problem, new, old)
    assert not is_riskier(problem, old, old)  # no better: no reason to change
    assert not is_riskier(channel(0.0), old, new)  # nobody knew of it when they were planned


def test_a_limit_on_the_risk_of_a_path_holds_for_what_is_there():
    problem, old = careless()
    limited = replace(problem, risk=RiskLimit(max_path_risk=0.01))
    assert is_riskier(limited, old, old)
    assert "above the limit" in too_risky(
        limited, [old[0].from_en, *(leg.to_en for leg in old)], heading_rad=problem.start_heading_rad
    )
    assert not is_riskier(replace(problem, risk=RiskLimit(max_path_risk=1.0)), old, old)


def test_what_may_touch_is_said_of_a_way_from_elsewhere():
    problem = channel()
    assert "bring her onto something" in too_risky(problem, [(0, 100), (28, 128), (0, 156)], heading_rad=math.pi / 4)
    assert too_risky(problem, [(0, 100), (5, 105), (0, 110)], heading_rad=math.pi / 4) == ""


def test_only_the_turn_that_begins_a_plan_begins_it():
    problem = replace(channel(), start_en=(28.0, 128.0))
    at_once = evaluate(problem, [(28, 128), (0, 156), (5, 161)]).legs
    later = evaluate(channel(), [(0, 0), (28, 28), (0, 56)]).legs
    assert is_begun_risky(problem, at_once)
    assert not is_begun_risky(channel(), later)


def sailing(obstacles=WALLS):
    """Return a boat under way between walls, on a mission whose one tack is 10 m from a wall."""
    world = make(
        Goal(en_m=(0.0, 50.0), radius_m=5.0),
        obstacles=obstacles,
        wind=lambda t: (0.0, 5.0),
        config={"margin_m": 6.0, "margin_floor_m": 3.0},
    )
    voyage = world.skipper.voyage
    world.skipper = replace(world.skipper, voyage=replace(voyage, boat=replace(voyage.boat, tack_fails=0.001)))
    assert world.run(120, lambda w: w.state.voyage.sailing)
    route, corner, goal = world.state.mission.route, (36.0, 26.0), (0.0, 50.0)
    world.state = with_parts(
        world.state,
        mission={
            "index": 0,
            "route": replace(
                route,
                items=(*route.items[:1] * 2, route.items[-1]),
                points_en_m=(corner, goal, route.points_en_m[-1]),
                leg_from_en_m=((0.0, 0.0), corner, goal),
                gate_of=(-1, 0, -1),
            ),
        },
    )
    return world


def asked(ctx, reason=ReplanReason.ORDER, **more):
    """Return the problem that the turn asks for, its action taken off."""
    assert request(ctx, reason, **more)
    [action] = [a for a in ctx.actions if isinstance(a, RequestPlan)]
    ctx.actions.clear()
    return action.problem


def test_the_skipper_takes_the_new_plan_when_a_tack_of_the_old_one_has_become_too_risky():
    world = sailing()
    taken = []
    for tacking in ({}, LEARNED):
        ctx = turn_of(world, tacking=replace(world.state.tacking, **tacking))
        problem = asked(ctx)
        found = plan(problem, expansions=8000)
        way = [problem.start_en, *ctx.ahead()]
        old = evaluate(problem, way)
        assert old.is_feasible
        before, after = (of_risky(tacks_at_risk(problem, legs)) for legs in (old.legs, found.legs))
        assert (before > after) == bool(tacking)
        # as fast as the old one, so that nothing else speaks for it
        take_plan(
            ctx, PlanOutcome(request_id=ctx.state.pending.plan.request_id, plan=replace(found, cost_s=old.time_s))
        )
        taken.append(any(isinstance(a, UploadMission) for a in ctx.actions))
    assert taken == [False, True]


def test_the_ladder_is_climbed_by_name_while_the_old_plan_is_too_risky_and_at_its_end_it_stays():
    world = sailing()
    for tacking, code in (({}, "no plan"), (LEARNED, "ladder 0")):
        ctx = turn_of(world, tacking=replace(world.state.tacking, **tacking))
        asked(ctx)
        not_found(ctx, ctx.state.pending.plan, "nothing")
        assert [a.code for a in ctx.actions if isinstance(a, Announce)] == [code]
    while ctx.state.pending.plan is not None and any(isinstance(a, RequestPlan) for a in ctx.actions):
        ctx.actions.clear()
        not_found(ctx, ctx.state.pending.plan, "nothing")
    [said] = [a.text for a in ctx.actions if isinstance(a, Announce)]
    assert "the old one stays; tacks of it that fail would bring her onto something" in said


def test_a_tack_at_the_next_waypoint_that_has_become_too_risky_is_planned_away_from_the_boat():
    world = sailing()
    for tacking, from_seq in (({}, []), (LEARNED, [None])):
        ctx = turn_of(world, tacking=replace(world.state.tacking, **tacking))
        problem = asked(ctx, ReplanReason.WAYPOINT, from_index=ctx.state.mission.index)
        take_plan(ctx, PlanOutcome(request_id=ctx.state.pending.plan.request_id, plan=plan(problem, expansions=8000)))
        assert [a.from_seq for a in ctx.actions if isinstance(a, RequestPlan)] == from_seq


def test_so_near_that_waypoint_no_plan_is_made_from_the_boat_for_it_would_turn_beyond_it():
    world = sailing()
    for budget_s, from_seq in ((0.5, [None]), (30.0, [])):
        world.skipper = replace(world.skipper, config=replace(world.skipper.config, plan_budget_s=budget_s))
        ctx = turn_of(world, tacking=replace(world.state.tacking, **LEARNED))
        problem = asked(ctx, ReplanReason.WAYPOINT, from_index=ctx.state.mission.index)
        take_plan(ctx, PlanOutcome(request_id=ctx.state.pending.plan.request_id, plan=plan(problem, expansions=8000)))
        assert [a.from_seq for a in ctx.actions if isinstance(a, RequestPlan)] == from_seq


def test_the_tack_that_begins_a_plan_is_gybed_round_too_after_two_that_failed():
    world = sailing(obstacles=())
    ctx = turn_of(world, tacking=replace(world.state.tacking, tried=2, failed=2, in_a_row=2, failed_s=world.t))
    problem = asked(ctx)
    found = plan(problem, expansions=8000)
    came_from_the_other_side = replace(problem, start_heading_rad=-problem.start_heading_rad)
    ctx.state = with_parts(
        ctx.state, pending={"plan": replace(ctx.state.pending.plan, problem=came_from_the_other_side)}
    )
    take_plan(ctx, PlanOutcome(request_id=ctx.state.pending.plan.request_id, plan=found))
    loop = ctx.state.pending.upload.route.points_en_m[:2]
    assert all(point[1] < problem.start_en[1] for point in loop)  # to leeward, before anything else

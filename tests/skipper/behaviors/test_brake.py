"""Too near to plan round, and too near to beat on: one command first."""

import math
from dataclasses import replace

import pytest
import shapely

from companion.messages import Mode
from companion.planner import plan
from companion.skipper.behaviors.headings import ahead_of
from companion.skipper.behaviors.sailing import _plan_and_resume, _stay
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.asking import request
from companion.skipper.step import Diversion, DiversionKind
from companion.skipper.step import actions as act
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.snapshot import PlanOutcome
from companion.skipper.step.state import Retry
from companion.skipper.way.voyage import Goal
from tests.skipper.moments import moment, route
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.test_voyage import FAST, is_done, is_sailing, make, nothing, said
from tests.skipper.world import World, skipper, voyage, with_parts

ISLAND = shapely.box(-60.0, 100.0, 60.0, 130.0)
GOAL = Goal(en_m=(0.0, 300.0), radius_m=8.0)
BEAM = lambda t: (-math.pi / 2.0, 5.0)  # noqa: E731 - a wind


def lying():
    """Return a route of which the loiter at its end is left, south of the island."""
    return route((0.0, 40.0), (0.0, 40.0))


def handed_back(away_m, **how):
    """A person has taken the boat behind the island and gives her back ``away_m`` off it, heading for it."""
    world = make(GOAL, obstacles=(ISLAND,), wind=BEAM, **how)
    assert world.run(60, is_sailing)
    world.set_mode(Mode.HOLD)
    world.run(3)
    world.run(2)
    world.position, world.heading, world.speed = (0.0, 130.0 + away_m), math.pi, 3.0
    world.track.clear()
    world.set_mode(Mode.AUTO)
    return world


@pytest.mark.parametrize("away_m", [9.0, 14.0])
def test_a_boat_given_back_before_an_island_is_stopped_before_she_is_planned_for(away_m):
    world = handed_back(away_m)
    since = world.t
    assert world.run(4, lambda w: w.mode is Mode.LOITER)
    assert world.t - since <= 3.0
    assert said(world, "too near")
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    assert world.run(900, is_done)
    assert world.clearance() > 0.0


def test_farther_away_a_plan_is_enough():
    world = handed_back(60.0)
    world.run(20)
    assert not said(world, "too near")
    assert world.run(900, is_done)
    assert world.clearance() > 0.0


@pytest.mark.parametrize(("towards", "is_braked"), [(1.0, False), (-1.0, True)])
def test_inside_of_what_is_drawn_the_way_out_is_not_braked(towards, is_braked):
    """A shore that was drawn too wide, or a position put right: LOITER was asked for whenever a plan led out."""
    world = make(GOAL, obstacles=(ISLAND,), wind=BEAM)
    assert world.run(60, is_sailing)
    world.position, world.speed = (0.0, 126.0), 2.0  # 4 m inside
    world.state = with_parts(world.state, position={"last_seen": None})
    ctx = turn_of(world)
    route = ctx.state.mission.route
    ends = ((0.0, 128.0 + 60.0 * towards), *route.points_en_m[-1:])
    route = replace(
        route,
        items=(route.items[0], route.items[-1]),
        points_en_m=ends,
        leg_from_en_m=(ends[0], ends[0]),
        gate_of=(0, -1),
    )
    ctx.state = with_parts(ctx.state, mission={"route": route, "index": 0})
    assert (ahead_of(ctx) is not None) is is_braked


@pytest.mark.parametrize(("north_m", "obstacles", "is_met"), [(142.0, (ISLAND,), True), (142.0, (), False)])
def test_the_way_back_to_the_last_loiter_is_looked_at_as_a_leg_is(north_m, obstacles, is_met):
    """No leg of the mission is left when she lies at its end, and the autopilot sails straight back to it."""
    ctx = moment(lying(), at=(0.0, north_m), heading_deg=180.0, twd_deg=90.0, obstacles=obstacles, mission={"index": 1})
    assert not ctx.ahead()
    assert (ahead_of(ctx) is not None) is is_met


@pytest.mark.parametrize("obstacles", [(ISLAND,), ()])
def test_stopped_before_a_wall_she_is_not_given_back_to_the_loiter_behind_it_without_a_plan(obstacles):
    stopped = {"steering": {"own_mode": Mode.LOITER}, "plans": {"retry": Retry(failures=1, not_before_s=1e9)}}
    ctx = moment(lying(), at=(0.0, 170.0), twd_deg=90.0, obstacles=obstacles, mission={"index": 1}, **stopped)
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=Mode.LOITER))
    _plan_and_resume(ctx)
    assert ("sailing on" in ctx.state.why) is (not obstacles)
    assert bool(ctx.actions) is (not obstacles)


@pytest.mark.parametrize("obstacles", [(ISLAND,), ()])
def test_to_stay_where_she_is_she_gets_a_loiter_on_this_side_of_the_wall(obstacles):
    ctx = moment(lying(), at=(0.0, 170.0), twd_deg=90.0, obstacles=obstacles, mission={"index": 1})
    _stay(ctx, Diversion(kind=DiversionKind.STAY, name="", why="told to"))
    sent = [a for a in ctx.actions if isinstance(a, act.UploadMission)]
    assert bool(sent) is bool(obstacles)


def test_without_permission_the_plan_is_all_there_is():
    world = handed_back(22.0)
    world.permissions = replace(world.permissions, may_set_mode=False)
    world.run(20)
    assert not any(isinstance(a, act.SetMode) and a.mode is Mode.LOITER for _, a in world.actions)


def test_a_voyage_without_trouble_is_never_braked():
    for seed in range(3):
        world = make(wind=lambda t, seed=seed: (0.15 * math.sin(t / 23.0 + seed), 5.0))
        assert world.run(1500, is_done)
        assert not said(world, "too near")


# ------------------------------------------------------------------------------------- short tack
def in_the_narrows(half_m=14.0, tack_fails=0.0):
    """A channel, 28 m wide; in its middle the wind comes ahead, and nothing is found."""
    sides = [shapely.box(-80.0, 60.0, -half_m, 260.0), shapely.box(half_m, 60.0, 80.0, 260.0)]
    made = voyage(Goal(en_m=(0.0, 320.0), radius_m=8.0), obstacles=sides)
    made = replace(made, boat=replace(made.boat, tack_fails=tack_fails))
    world = World(
        skipper=skipper(made, autopilot_beats=False, margin_m=12.0, margin_floor_m=5.0),
        wind=lambda t: (-math.pi / 2.0 if t < 45.0 else 0.0, 5.0),
        **FAST,
    )
    assert world.run(44, is_sailing)
    world.run(44 - world.t)
    assert 60.0 < world.position[1] < 150.0
    world.planner = nothing
    world.track.clear()
    return world


def test_the_autopilots_own_beat_is_turned_before_it_comes_too_near():
    world = in_the_narrows()
    world.run(60)
    assert world.count(act.Tack) >= 1
    assert said(world, "short tack")
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_without_it_the_corridor_would_have_been_too_wide(monkeypatch):
    monkeypatch.setattr("companion.skipper.behaviors.sailing.short_tack", lambda ctx: None)
    world = in_the_narrows()
    world.run(60)
    assert world.clearance() < world.skipper.config.margin_floor_m - 1.0


def test_where_tacks_can_fail_there_is_room_for_one_that_does():
    def narrows(tack_fails):
        world = in_the_narrows(half_m=20.0, tack_fails=tack_fails)  # at the corridor's edge she is 10 m clear
        world.run(60)
        return world

    certain, doubtful = narrows(0.0), narrows(0.03)
    assert not said(certain, "short tack")
    assert "failed" in said(doubtful, "short tack")[0][2]
    assert doubtful.clearance() > certain.clearance() + 1.0


@pytest.mark.parametrize(("tack_fails", "is_asked"), [(0.03, False), (0.4, True)])
def test_where_she_cannot_gybe_round_after_two_that_fail_there_is_room_for_more(tack_fails, is_asked):
    world = in_the_narrows(half_m=28.0, tack_fails=tack_fails)
    world.run(60)
    assert bool(said(world, "short tack")) is is_asked


def test_a_boat_whose_tacks_have_failed_is_asked_too_for_the_leg_that_she_was_to_gybe_on_has_closed():
    world = in_the_narrows(tack_fails=0.03)
    world.state = replace(
        world.state, tacking=replace(world.state.tacking, tried=4, failed=2, in_a_row=2, failed_s=world.t)
    )
    world.run(10)
    assert said(world, "short tack")


def test_in_open_water_the_autopilot_beats_as_it_likes():
    world = make(
        Goal(en_m=(0.0, 320.0), radius_m=8.0),
        obstacles=(),
        wind=lambda t: (0.1 * math.sin(t / 20.0), 5.0),
        config={"autopilot_beats": True},
    )
    assert world.run(900, is_done)
    assert not any(isinstance(a, act.Tack) for _, a in world.actions)


# -------------------------------------------------------------------------- the planner does not answer
def test_a_planner_that_hangs_before_the_start_costs_no_margin():
    world = make(planner=lambda problem, seed: None)
    world.run(60)
    assert said(world, "no answer")
    world.planner = None
    assert world.run(120, is_sailing)
    assert world.state.mission.route.margin_m == world.skipper.config.margin_m


def test_want_of_a_processor_costs_effort_and_neither_margin_nor_mission():
    """Under way nothing is answered: less is asked of the planner each time, and what is on board stays."""
    world = make(Goal(en_m=(200.0, 200.0), radius_m=8.0), obstacles=(), wind=lambda t: (-math.pi / 4.0, 5.0))
    assert world.run(120, is_sailing)
    sound, world.planner = world.state.mission.route, lambda problem, seed: None
    budgets = []
    for _ in range(3):
        ctx = turn_of(world)
        assert request(ctx, ReplanReason.ORDER)
        while ctx.state.pending.plan is not None:
            budgets += [a.budget_s for a in ctx.actions if isinstance(a, act.RequestPlan)]
            ctx.actions.clear()
            take_plan(ctx, PlanOutcome(request_id=ctx.state.pending.plan.request_id, text="no answer"))
        assert ctx.state.mission.route == sound
        assert not any(isinstance(a, act.UploadMission | act.SetMode) for a in ctx.actions)
        world.state = ctx.state
    assert budgets == sorted(budgets, reverse=True)
    assert budgets[-1] < 0.1 * budgets[0]
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.ORDER)
    pending = ctx.state.pending.plan
    take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=plan(pending.problem, expansions=500)))
    assert ctx.state.plans.effort > world.state.plans.effort  # what is answered gives it back


def test_an_old_plan_that_the_present_wind_has_closed_is_not_sound():
    """The mean of 90 s still blows from where it was."""
    world = in_the_narrows()
    world.run(12)
    assert not any("the old one is sound" in text for _, _, text in world.log)

"""A plan in AUTO in place of the mission's guidance: a field makes no progress, or by headings no plan is found."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box
from shapely.ops import unary_union

from companion.messages import Mode
from companion.planner import plan
from companion.planner.plan import Plan, PlanStatus
from companion.skipper.behaviors.fallback import follow_fallback
from companion.skipper.planning.diversions import diversion
from companion.skipper.planning.fallback import to_go
from companion.skipper.step import DiversionKind
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, Guidance
from companion.skipper.step.state import Fallback
from companion.skipper.way.voyage import Goal
from tests.skipper.moments import moment, route
from tests.skipper.test_voyage import is_done, is_sailing, make, said

GOAL = Goal(en_m=(0.0, 260.0), name="the goal")
BAY = unary_union([box(-60.0, 120.0, 60.0, 135.0), box(-60.0, 30.0, -45.0, 135.0), box(45.0, 30.0, 60.0, 135.0)])
BY_FIELD = {"guidance": Guidance.FIELD, "margin_m": 8.0, "margin_floor_m": 4.0}
BY_HEADING = {"guidance": Guidance.HEADING, "autopilot_beats": True}
NOTHING = Plan(status=PlanStatus.NOT_FOUND, reason="nothing is found", waypoints_en=np.empty((0, 2)))


def asked(world, reason):
    return [t for t, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is reason]


# ------------------------------------------------------------------------------------------ by field
def embayed(**how):
    return make(GOAL, obstacles=(BAY,), config=BY_FIELD, wind=lambda t: (math.pi / 2.0, 5.0), **how)


def test_where_a_field_makes_no_progress_a_plan_is_made_and_sailed_to_the_goal():
    world = embayed()
    assert world.run(700, lambda w: said(w, "fallback"))
    assert said(world, "no progress")
    assert asked(world, act.ReplanReason.NO_PROGRESS)
    assert world.run(3, lambda w: w.mode is Mode.AUTO)
    world.run(3)
    assert "by plan in AUTO: by field no progress is made" in world.state.why
    assert world.run(600, is_done)
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_what_is_said_of_no_progress_by_field_is_what_is_done():
    for may_upload, words in ((True, "a plan is asked for, to be sailed in AUTO"), (False, "steered on by field")):
        world = embayed()
        assert world.run(60, is_sailing)
        world.permissions = replace(ALL_PERMITTED, may_upload=may_upload)
        assert world.run(500, lambda w: said(w, "no progress"))
        world.run(5)
        texts = [a.text for _, a in world.actions if isinstance(a, act.Announce) and a.code == "no progress"]
        assert texts[0].endswith(words)
        assert bool(asked(world, act.ReplanReason.NO_PROGRESS)) == may_upload


@pytest.mark.parametrize(
    ("planned_s", "asked_s", "twd_deg", "begins"),
    [
        (950.0, 950.0, 0.0, True),  # planned since
        (800.0, 950.0, 0.0, True),  # no other was found, and what is on board is sound
        (800.0, 950.0, 90.0, False),  # ... and is shut
        (800.0, 800.0, 0.0, False),  # not asked for yet: the field may have brought her where no way is judged
    ],
)
def test_auto_sails_what_was_judged_from_where_the_field_has_brought_her(planned_s, asked_s, twd_deg, begins):
    way = route((300.0, 0.0), (600.0, 0.0), gate_of=(-1, -1), plan_t_s=planned_s)
    ctx = moment(
        way,
        twd_deg=twd_deg,
        config={"guidance": Guidance.FIELD, "autopilot_beats": False},
        fallback=Fallback(gate=0, goal=0, since_s=900.0, why="because"),
        plans={"last_s": asked_s},
    )
    follow_fallback(ctx)
    assert ctx.falls_back == begins


def test_by_field_way_is_made_good_towards_the_goals_and_not_the_waypoints_on_board():
    way = route((90.0, 0.0), (0.0, 600.0), (600.0, 600.0), (600.0, 600.0), gate_of=(-1, 0, 1, -1))
    assert to_go(moment(way, config={"guidance": Guidance.FIELD})) == ((0.0, 600.0), (600.0, 600.0))
    assert to_go(moment(way)) == way.points_en_m[:-1]


@pytest.mark.parametrize(("north_m", "left"), [(580.0, 0), (540.0, 1)])
def test_by_field_no_way_is_to_go_about_a_station(north_m, left):
    """ "no progress: a plan is asked for" was said every few minutes of a boat that kept her station by 3 m."""
    way = route((0.0, 300.0), (0.0, 600.0), (0.0, 600.0), gate_of=(-1, 0, -1))
    goals = (Goal(name="G", en_m=(0.0, 600.0)),)
    config = {"guidance": Guidance.FIELD, "station_s": 600.0}
    ctx = moment(way, goals=goals, at=(0.0, north_m), config=config, progress={"gate": 1})
    assert diversion(ctx).kind is DiversionKind.STATION
    assert len(to_go(ctx)) == left


@pytest.mark.parametrize(("gate", "goal", "lasts"), [(0, 0, True), (1, 0, False), (1, 1, True)])
def test_it_lasts_to_the_goal_and_the_field_steers_again(gate, goal, lasts):
    way = route((0.0, 600.0), (600.0, 600.0), (600.0, 600.0), gate_of=(0, 1, -1))
    ctx = moment(
        way,
        config={"guidance": Guidance.FIELD},
        fallback=Fallback(gate=0, goal=goal, since_s=900.0, sails=True, why="because"),
        progress={"gate": gate},
    )
    follow_fallback(ctx)
    assert ctx.falls_back == lasts
    assert (ctx.guidance is Guidance.PLAN) == lasts
    assert ctx.is_field_steered != lasts


# --------------------------------------------------------------------------------------- by headings
def beats_only(problem, seed):
    """Return a plan where the autopilot may beat, none where every tack is to be planned."""
    return NOTHING if problem.beat is None else plan(problem, expansions=2000, seed=seed)


@pytest.mark.parametrize("beats", [True, False])
def test_where_by_headings_no_plan_is_found_the_autopilot_beats(beats):
    config = {**BY_HEADING, "autopilot_beats": beats}
    world = make(Goal(en_m=(0.0, 250.0)), obstacles=(), config=config, wind=lambda t: (0.0, 5.0))
    world.planner = beats_only
    arrives = world.run(400, is_done)
    assert arrives == beats
    assert bool(said(world, "fallback")) == beats
    if beats:
        assert not [t for t, a in world.actions if isinstance(a, act.SetMode) and a.mode is Mode.GUIDED]


def test_want_of_a_plan_by_headings_is_not_waited_out_in_a_loiter():
    way = route((0.0, 0.0))
    ctx = moment(way, config=BY_HEADING, mission={"route": way, "index": 0})
    ctx.set(plans=replace(ctx.state.plans, retry=ctx.failed(ctx.failed(ctx.state.plans.retry))))
    assert ctx.state.plans.retry.not_before_s > ctx.t_s
    follow_fallback(ctx)
    assert ctx.state.plans.retry.not_before_s <= ctx.t_s

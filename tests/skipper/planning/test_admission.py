"""What may go to the autopilot: nothing below the floor, and nothing that promises less than what is on board."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from companion.boat.margins import AutopilotLimits
from companion.current import WaterCurrent
from companion.messages import Mode
from companion.orders import Verb
from companion.planner import plan
from companion.planner.track import ExpectedTrack
from companion.planners import PlannerChoice
from companion.skipper.behaviors.helm import leave_passed, push_on
from companion.skipper.intake import locate
from companion.skipper.planning.answers import _told_m, take_plan
from companion.skipper.planning.asking import request
from companion.skipper.planning.diversions import diversion
from companion.skipper.planning.not_found import not_found
from companion.skipper.planning.track import steps
from companion.skipper.planning.uploads import _below_floor, clearance_here_m, judged
from companion.skipper.step.actions import Announce, ReplanReason, RequestPlan, SetCurrent, UploadMission
from companion.skipper.step.config import Ends, Guidance
from companion.skipper.step.saved import Standing
from companion.skipper.step.snapshot import PlanOutcome
from companion.skipper.step.state import Retry
from companion.skipper.way.voyage import Goal, Refuge
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.test_voyage import make
from tests.skipper.world import with_parts

GOAL = (0.0, 220.0)
ROCK = shapely.box(-30.0, 80.0, -10.0, 120.0)  # its eastern side is 10 m west of the straight way
MARGIN_M, FLOOR_M = 14.0, 4.0


@pytest.mark.parametrize("is_significant", [True, False])
def test_in_a_stream_that_plans_reckon_with_she_is_led_out_to_where_she_is_soonest(is_significant):
    """Up the stream to the nearest place she stood before the rock, until it had her."""
    stream = WaterCurrent(east_mps=-2.6, north_mps=0.0, is_significant=is_significant)
    rock = shapely.Point(-12.0, 0.0).buffer(8.0)
    ctx = moment(route((200.0, 0.0), (200.0, 0.0)), obstacles=(rock,), speed_mps=0.1, seen={"current": stream})
    assert request(ctx, ReplanReason.CURRENT)
    [place] = ctx.state.pending.plan.lead_in
    assert (abs(math.degrees(math.atan2(place[0], place[1])) - 90.0) < 20.0) is not is_significant


DOCK = (
    shapely.box(-60.0, 200.0, -40.0, 345.0),
    shapely.box(40.0, 200.0, 60.0, 345.0),
    shapely.box(-60.0, 345.0, 60.0, 365.0),
)


@pytest.mark.parametrize("rate_deg_s", [120.0, 10.0])
def test_into_a_dock_that_is_narrower_than_her_turn_she_does_not_sail(rate_deg_s):
    """At 10 degrees a second she struck its side in the turn behind the goal: "the old one is sound and stays"."""
    world = make(Goal(en_m=(0.0, 300.0), radius_m=10.0, name="the head"), obstacles=DOCK)
    world.wind = lambda t: (math.radians(270.0), 9.0)
    world.extra = {"limits": AutopilotLimits(rate_max_radps=math.radians(rate_deg_s))}
    world.run(200)
    texts = " ".join(a.text for _, a in world.actions if isinstance(a, Announce))
    assert ("the head is a dead end: at" in texts) is (rate_deg_s == 10.0)
    assert bool(world.state.progress.reached) is (rate_deg_s == 120.0)
    assert world.clearance() > 5.0


def sailing(way=((0.0, 60.0), GOAL), *, rock=ROCK, **config):
    """Return a boat under way to the north on a beam reach, past a rock to port, on ``way``."""
    world = make(
        Goal(en_m=GOAL, radius_m=6.0, name="the goal"),
        obstacles=(rock,),
        wind=lambda t: (math.pi / 2, 5.0),
        config={"margin_m": MARGIN_M, "margin_floor_m": FLOOR_M, **config},
    )
    assert world.run(150, lambda w: w.state.voyage.sailing and w.position[1] > 10.0)
    route, boat = world.state.mission.route, world.position
    end = route.points_en_m[-1]
    points = (*way, end)
    world.state = with_parts(
        world.state,
        mission={
            "index": 0,
            "own_index": 0,
            "route": replace(
                route,
                items=(*route.items[:1] * len(way), route.items[-1]),
                points_en_m=points,
                leg_from_en_m=(boat, *points[:-1]),
                gate_of=(*(-1,) * (len(way) - 1), 0, -1),
                margin_m=MARGIN_M,
            ),
        },
        pending={"plan": None, "upload": None},
    )
    return world


def offered(ctx, way, *, reason=ReplanReason.ORDER, rung=0):
    """Let the planner answer a request from the boat with the waypoints ``way``; return the actions that follow."""
    assert request(ctx, reason, rung=rung)
    pending = ctx.state.pending.plan
    ctx.actions.clear()
    found = plan(pending.problem, expansions=4000)
    answer = replace(found, waypoints_en=np.asarray([pending.problem.start_en, *way]), cost_s=1.0)
    take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=answer))
    return ctx.actions


def uploads(actions):
    return [a for a in actions if isinstance(a, UploadMission)]


def test_a_plan_that_keeps_what_is_asked_goes_on_board():
    ctx = turn_of(sailing())
    assert uploads(offered(ctx, [(8.0, 100.0), GOAL]))


def test_a_plan_with_less_margin_is_no_failure_and_one_to_a_nearer_place_is():
    """Eight goals along a quay, each found with less margin, took three times as long: for the wait between plans."""
    ctx = turn_of(sailing(way=((-20.0, 100.0), GOAL)))
    names = [rung.nearer_goal for rung in steps(ctx)]
    assert names[-1]
    assert not names[1]
    ctx.set(plans=replace(ctx.state.plans, retry=Retry(failures=2, not_before_s=ctx.t_s + 80.0)))
    assert uploads(offered(ctx, [(8.0, 100.0), GOAL], rung=1))
    assert ctx.state.plans.retry == Retry()
    ctx.set(pending=replace(ctx.state.pending, upload=None))
    offered(ctx, [(8.0, 100.0), (6.0, 150.0)], rung=len(names) - 1)
    assert ctx.state.plans.retry.failures == 1


def test_a_plan_to_the_same_goal_begins_from_what_is_on_board():
    ctx = turn_of(sailing(way=((4.0, 60.0), (9.0, 140.0), GOAL)))
    for from_index, rest in ((None, ((4.0, 60.0), (9.0, 140.0), GOAL)), (0, ((9.0, 140.0), GOAL))):
        ctx.actions.clear()
        assert request(ctx, ReplanReason.ORDER, from_index=from_index)
        [asked] = [a for a in ctx.actions if isinstance(a, RequestPlan)]
        assert asked.problem.known_en == rest


def test_a_plan_to_elsewhere_begins_anew():
    ctx = turn_of(sailing(way=((4.0, 60.0), (-200.0, 20.0))))
    assert request(ctx, ReplanReason.ORDER)
    [asked] = [a for a in ctx.actions if isinstance(a, RequestPlan)]
    assert asked.problem.known_en == ()


def test_nothing_below_the_floor_goes_on_board_from_a_place_that_is_not():
    """What is on board is closed by a rock here, and that is no reason: the ladder's next answer is asked for."""
    ctx = turn_of(sailing(way=((-20.0, 100.0), GOAL)))
    actions = offered(ctx, [(-9.0, 100.0), GOAL])
    assert uploads(actions) == []
    [ladder] = [a for a in actions if isinstance(a, Announce) and a.code.startswith("ladder")]
    assert "clear, the floor is 4 m" in ladder.text
    assert any(isinstance(a, RequestPlan) for a in actions)


def test_plans_that_are_refused_on_one_ladder_are_one_failure():
    """Each of five was counted, and the next plan was asked for 160 s later, beside a rock."""
    ctx = turn_of(sailing(way=((-20.0, 100.0), GOAL)))
    offered(ctx, [(-9.0, 100.0), GOAL])
    for _ in range(20):
        pending = ctx.state.pending.plan
        if pending is None:
            break
        found = plan(pending.problem, expansions=4000)
        points = np.asarray([pending.problem.start_en, (-9.0, 100.0), GOAL])
        take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=replace(found, waypoints_en=points, cost_s=1.0)))
    assert [a for a in ctx.actions if isinstance(a, Announce) and a.code == "no plan at all"]
    assert ctx.state.plans.retry.failures == 1


@pytest.mark.parametrize(("way", "is_open"), [(((12.0, 100.0), GOAL), True), (((-20.0, 100.0), GOAL), False)])
def test_a_smaller_margin_goes_on_board_only_where_what_is_there_is_closed(way, is_open):
    ctx = turn_of(sailing(way=way))
    assert request(ctx, ReplanReason.ORDER, rung=1)
    assert ctx.state.pending.plan.facts.margin_m < MARGIN_M
    actions = offered(ctx, [(3.0, 100.0), GOAL], rung=1)
    assert bool(uploads(actions)) is not is_open
    if is_open:
        assert not any(isinstance(a, RequestPlan) for a in actions)  # it stays: no further step down the ladder
        assert ctx.state.mission.route.points_en_m[:2] == way


def test_a_way_that_lacks_less_than_the_predictions_error_stays_when_nothing_better_is_found():
    """A tenth of a metre at the floor is no reason to give up margin, and to change course before a waypoint."""
    for east, stays in ((-4.8, True), (-9.5, False)):
        ctx = turn_of(sailing(way=((east, 100.0), GOAL)))
        assert request(ctx, ReplanReason.ORDER)
        ctx.actions.clear()
        not_found(ctx, ctx.state.pending.plan, "none")
        asks_for_less = any(isinstance(a, RequestPlan) for a in ctx.actions)
        assert asks_for_less is not stays


BANKS = (shapely.box(-60.0, -300.0, -16.0, 400.0), shapely.box(16.0, -300.0, 60.0, 400.0))


@pytest.mark.parametrize(
    ("obstacles", "stays"),
    [(BANKS, True), ((*BANKS, shapely.box(-2.0, 60.0, 2.0, 70.0)), False), ((), False)],
    ids=["between banks", "with a rock on the way on board", "in open water"],
)
def test_at_the_ladders_end_what_is_on_board_is_not_left_for_a_loiter_without_room(obstacles, stays):
    """Between two banks a loiter was uploaded on "no plan at all", and she turned onto one of them."""
    way = route((0.0, 100.0), (0.0, 200.0), (0.0, 200.0))
    ctx = moment(way, obstacles=obstacles, heading_deg=0.0, twd_deg=90.0, config={"margin_m": 10.0})
    assert request(ctx, ReplanReason.ORDER, rung=len(steps(ctx)) - 1)
    pending = ctx.state.pending.plan
    ctx.actions.clear()
    not_found(ctx, replace(pending, facts=replace(pending.facts, bound_for="home")), "none")
    assert bool(uploads(ctx.actions)) is not stays
    [says] = [a.text for a in ctx.actions if isinstance(a, Announce)]
    assert ("the old one stays; a loiter near by has" in says) is stays


def test_from_below_the_floor_only_what_comes_no_nearer_goes_on_board():
    world = sailing()
    beside = (-7.0, 100.0)  # 3 m from the rock, on its eastern side, heading along it
    world.position, world.state = beside, with_parts(world.state, position={"last_seen": None})
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.OFF_LEG)
    pending = ctx.state.pending.plan

    def refused(*points):
        ways = (*points, GOAL, ctx.state.mission.route.points_en_m[-1])
        route = replace(
            ctx.state.mission.route,
            points_en_m=ways,
            items=ctx.state.mission.route.items[:1] * len(ways),
            leg_from_en_m=(beside, *ways[:-1]),
            gate_of=(*(-1,) * len(points), 0, -1),
        )
        return judged(ctx, route, 1, replace(pending, start_en_m=beside)).refused

    assert refused((20.0, 120.0)) == ""
    assert "the boat is" in refused((-14.0, 115.0))


def test_a_plan_from_a_place_that_she_is_led_to_tells_the_clearance_of_the_way_there_too():
    """ "Passes -7.1 m clear or more": the planner's figure begins where she is led to, on another heading."""
    world = sailing()
    world.position, world.state = (-7.0, 100.0), with_parts(world.state, position={"last_seen": None})
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.OFF_LEG)
    pending = ctx.state.pending.plan
    assert pending.lead_in
    found = replace(plan(pending.problem, expansions=4000), expected_clearance_m=-7.1)
    take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=found))
    [told] = uploads(ctx.actions)
    passes_m = float(re.search(r"passes (-?[\d.]+) m clear", told.text)[1])
    assert 0.0 < passes_m <= 3.0


def test_the_clearance_that_is_told_is_of_the_track_that_admitted_the_plan():
    """ "Passes -3.1 m clear or more (floor 4 m)": the planner's own began at a waypoint, a tight corner before it."""
    world = sailing()
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.RETRY)
    pending = ctx.state.pending.plan
    found = replace(plan(pending.problem, expansions=4000), expected_clearance_m=-3.1)
    take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=found))
    [told] = uploads(ctx.actions)
    new = ctx.state.pending.upload
    track = judged(ctx, new.route, new.set_current, pending).track
    assert new.route.expected_clearance_m == pytest.approx(track.clearance_m)
    assert track.clearance_m >= FLOOR_M
    assert f"passes {track.clearance_m:.1f} m clear" in told.text


def test_no_plan_is_told_with_more_clearance_than_she_has():
    """ "45.1 m" stood beside 36.7 for five seconds: the track begins where she is by the time that it is on board."""
    world = sailing()
    world.position, world.state = (0.0, 135.0), with_parts(world.state, position={"last_seen": None})  # past the rock
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.RETRY)
    pending = ctx.state.pending.plan
    take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=plan(pending.problem, expansions=4000)))
    new, here_m = ctx.state.pending.upload, clearance_here_m(ctx, world.position)
    assert judged(ctx, new.route, new.set_current, pending).track.clearance_m > here_m + 1.0
    assert new.route.expected_clearance_m == pytest.approx(here_m)


@pytest.mark.parametrize(
    ("is_beat", "planned_m", "told_m"), [(False, 5.0, 9.0), (True, 5.0, 5.0), (True, -3.1, 9.0), (True, None, 9.0)]
)
def test_what_the_planner_alone_looks_at_is_told_too(is_beat, planned_m, told_m):
    ctx, found = turn_of(sailing()), SimpleNamespace(legs=(SimpleNamespace(is_beat=is_beat),))
    assert _told_m(ctx, found, planned_m, ExpectedTrack(clearance_m=9.0)) == told_m
    assert _told_m(ctx, found, planned_m, None) == planned_m
    assert _told_m(ctx, found, None, ExpectedTrack()) is None


@pytest.mark.parametrize(("mode", "is_admitted"), [(Mode.AUTO, True), (Mode.LOITER, False)])
def test_what_is_on_board_and_not_sailed_excuses_no_way_onto_a_rock(mode, is_admitted):
    """In LOITER the boat need not go: that the way on board leads onto the rock, too, made one of -7 m good enough."""
    world = sailing(way=((-20.0, 110.0), GOAL))
    beside = (-7.0, 100.0)
    world.position, world.mode, world.state = beside, mode, with_parts(world.state, position={"last_seen": None})
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.OFF_LEG)
    ways = ((-11.0, 115.0), GOAL, ctx.state.mission.route.points_en_m[-1])
    route = replace(
        ctx.state.mission.route,
        points_en_m=ways,
        items=ctx.state.mission.route.items[:1] * 3,
        leg_from_en_m=(beside, *ways[:-1]),
        gate_of=(-1, 0, -1),
    )
    assert (judged(ctx, route, 1, replace(ctx.state.pending.plan, start_en_m=beside)).refused == "") is is_admitted


def test_an_item_that_was_passed_during_its_upload_is_not_turned_back_for():
    """An upload of six seconds brought a list that begins behind the boat, and a rock lay where it turned round."""
    way = ((0.0, 20.0), (3.0, 26.0), (4.0, 60.0), GOAL)
    world = sailing(way=way)
    world.position, world.state = (0.0, 34.0), with_parts(world.state, position={"last_seen": None})
    for uploaded_s, wanted in ((world.t, [3]), (world.t - 30.0, [])):
        ctx = turn_of(world)
        ctx.state = with_parts(ctx.state, mission={"uploaded_s": uploaded_s})
        leave_passed(ctx)
        assert [a.seq for a in ctx.actions if isinstance(a, SetCurrent)] == wanted


@pytest.mark.parametrize(("sails_for", "wanted"), [(1, [3]), (2, [3]), (3, []), (4, [])])
def test_a_stuck_waypoint_is_pushed_on_and_never_back(sails_for, wanted):
    """While the mission was read anew the autopilot had come two items farther than our count: she was sent back."""
    ctx = moment(route((0.0, 20.0), (3.0, 26.0), (4.0, 60.0), GOAL), mission={"index": 0, "own_index": 2})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mission_seq=sails_for))
    push_on(ctx)
    assert [a.seq for a in ctx.actions if isinstance(a, SetCurrent)] == wanted


@pytest.mark.parametrize("checked", [True, False])
def test_an_autopilot_lags_only_where_its_number_is_known_to_be_of_our_route(checked):
    ctx = moment(route((0.0, 20.0), (0.0, 60.0), GOAL), at=(0.0, 24.0), mission={"index": 0, "checked": checked})
    locate(ctx)
    assert ctx.state.mission.own_index == 1
    assert (ctx.state.mission.passed_since_s is not None) is checked


@pytest.mark.parametrize(("mission_seq", "failures"), [(2, 3), (3, 0)])
def test_what_failed_on_the_way_is_tried_anew_at_the_missions_end(mission_seq, failures):
    """Tries to lead on from the last waypoint had doubled the wait: she loitered 40 s with the way open."""
    way = route((0.0, 20.0), (0.0, 60.0), GOAL)
    told = replace(moment(way).autopilot, mission_seq=mission_seq)
    retry = Retry(failures=3, not_before_s=NOW_S + 36.0)
    ctx = moment(
        way, at=(0.0, 40.0), mission={"index": 1, "checked": True}, plans={"retry": retry}, seen={"autopilot": told}
    )
    locate(ctx)
    assert ctx.state.plans.retry.failures == failures


def test_a_gate_is_never_left_out_as_passed():
    world = sailing(way=((0.0, 20.0), (4.0, 60.0), GOAL))
    world.position = (0.0, 34.0)
    route = replace(world.state.mission.route, gate_of=(0, -1, -1, -1))
    world.state = with_parts(world.state, mission={"uploaded_s": world.t, "route": route}, position={"last_seen": None})
    ctx = turn_of(world)
    leave_passed(ctx)
    assert ctx.actions == []


def test_a_plan_that_is_refused_for_a_hair_says_by_how_much():
    """ "it would pass 3.0 m clear, the floor is 3 m"."""
    problem = SimpleNamespace(tracking=SimpleNamespace(floor_m=3.0))
    track = ExpectedTrack(clearance_m=2.97, lack_m=0.03, is_kept=False)
    assert _below_floor(problem, track, None, here_m=9.0) == "it would pass 2.97 m clear, the floor is 3 m"


@pytest.mark.parametrize(("leads_to", "rung", "stays"), [("", 0, False), ("", -1, True), ("home", 0, True)])
def test_a_sound_way_that_leads_elsewhere_than_she_is_bound_for_is_kept_at_the_ladders_end_only(leads_to, rung, stays):
    """Leaking, her refuge behind a gap that the margin closed, she sailed on to her goals: "the old one is sound"."""
    order = Standing(verb=Verb.HOME, by="crew", name="home", en_m=(0.0, -200.0), since_s=0.0)
    way = replace(route((0.0, 100.0), (0.0, 200.0), (0.0, 200.0)), bound_for=leads_to)
    ctx = moment(way, heading_deg=0.0, twd_deg=90.0, orders={"standing": order})
    assert diversion(ctx).name == "home"
    assert request(ctx, ReplanReason.HOME, rung=rung % len(steps(ctx)))
    ctx.actions.clear()
    not_found(ctx, ctx.state.pending.plan, "none")
    [says] = [a.text for a in ctx.actions if isinstance(a, Announce)]
    assert ("the old one is sound and stays" in says) is stays
    assert any(isinstance(a, RequestPlan) for a in ctx.actions) is not stays
    assert not uploads(ctx.actions)


@pytest.mark.parametrize(("rung", "asks"), [(0, "planner auto"), (1, None)])
def test_what_the_chosen_planner_does_not_find_auto_is_asked_for_though_the_way_on_board_is_sound(rung, asks):
    """By A* no leg between the gates of a buoy was found; "the old one is sound and stays", and auto was not asked."""
    way = route((0.0, 100.0), (0.0, 200.0), (0.0, 200.0))
    config = {"planner": PlannerChoice(algorithm="astar")}
    ctx = moment(way, heading_deg=0.0, twd_deg=90.0, config=config)
    assert request(ctx, ReplanReason.NEXT_GOAL, from_index=0, rung=rung)
    ctx.actions.clear()
    not_found(ctx, ctx.state.pending.plan, "none")
    [says] = [a.text for a in ctx.actions if isinstance(a, Announce)]
    asked = [(a.rung, a.planner.algorithm, a.from_seq) for a in ctx.actions if isinstance(a, RequestPlan)]
    assert asked == ([] if asks is None else [(asks, "auto", 1)])  # from the same place, with nothing given up
    wanted = "the old one is sound and stays" if asks is None else "no plan as configured (none): trying planner auto"
    assert wanted in says


@pytest.mark.parametrize(
    ("mode", "goes_on"), [(Mode.GUIDED, "steered on by field, trying"), (Mode.AUTO, "holding, trying")]
)
def test_where_no_plan_is_found_by_field_she_is_steered_on_and_not_held(mode, goes_on):
    way, wall = route((0.0, 100.0), (0.0, 200.0), (0.0, 200.0)), shapely.box(-50.0, 140.0, 50.0, 160.0)
    ctx = moment(way, obstacles=(wall,), heading_deg=0.0, twd_deg=90.0, config={"guidance": Guidance.FIELD})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=mode))
    assert request(ctx, ReplanReason.NO_PROGRESS, rung=len(steps(ctx)) - 1)
    ctx.actions.clear()
    not_found(ctx, ctx.state.pending.plan, "none")
    [says] = [a.text for a in ctx.actions if isinstance(a, Announce)]
    assert f"whatever is given up for one (none): {goes_on}" in says


@pytest.mark.parametrize(("count", "failures", "stays"), [(1, 0, False), (2, 0, True), (2, 1, False)])
def test_margin_is_given_up_for_a_refuge_when_none_has_a_way_with_all_of_it(count, failures, stays):
    refuges = tuple(Refuge(en_m=(0.0, -200.0 - 100.0 * n), name=f"R{n}") for n in range(count))
    way = route((0.0, 100.0), (0.0, 200.0), (0.0, 200.0))
    ctx = moment(way, heading_deg=0.0, twd_deg=90.0, up=("leaking",), config={"ends": Ends.of(leak="refuge")})
    ctx.voyage = replace(ctx.voyage, refuges=refuges)
    ctx.set(plans=replace(ctx.state.plans, retry=Retry(failures=failures)))
    assert diversion(ctx).name == f"the refuge R{failures}"
    assert request(ctx, ReplanReason.REFUGE)
    ctx.actions.clear()
    not_found(ctx, ctx.state.pending.plan, "none")
    assert any(isinstance(a, RequestPlan) for a in ctx.actions) is not stays


@pytest.mark.parametrize(
    ("rock_m", "rung", "stays"), [(14.0, 0, False), (14.0, 1, False), (14.0, -1, True), (60.0, 0, True)]
)
def test_a_way_that_ends_without_room_is_led_on_with_less_margin_before_she_lies_there(rock_m, rung, stays):
    """In a pocket "the old one is sound and stays" was said until she lay in its loiter, and came to 5.4 m of 6."""
    goals = tuple(Goal(name=name, en_m=(0.0, north_m)) for name, north_m in (("A", 200.0), ("B", 400.0)))
    rock = shapely.box(rock_m, 190.0, rock_m + 4.0, 210.0)
    way = route((0.0, 100.0), (0.0, 200.0), (0.0, 200.0), gate_of=(-1, 0, -1))
    ctx = moment(way, goals=goals, obstacles=(rock,), heading_deg=0.0, twd_deg=90.0)
    assert request(ctx, ReplanReason.NEXT_GOAL, from_index=1, rung=rung % len(steps(ctx)))
    ctx.actions.clear()
    not_found(ctx, ctx.state.pending.plan, "none")
    asked = [a for a in ctx.actions if isinstance(a, RequestPlan)]
    assert not asked if stays else [a.from_seq for a in asked] == [2]
    assert any("the old one is sound and stays" in a.text for a in ctx.actions if isinstance(a, Announce)) is stays

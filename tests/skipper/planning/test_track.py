"""What the skipper makes of the track: its ladder, its problems, the way that it would keep, what it says."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.boat import AutopilotLimits
from companion.boat.tracking import SHORT_S, GuidanceModel, stated_error_m
from companion.planner import Problem, plan
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.ladder import rungs
from companion.skipper.planning.statement import Start, problem_dict
from companion.skipper.planning.track import clearance_text, of_way, problem_tracking, steps
from companion.skipper.rules import Skipper
from companion.skipper.step.actions import Announce, ReplanReason
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.context import StepContext
from companion.skipper.step.snapshot import PlanOutcome, WindEstimate
from companion.skipper.way.geometry import moved
from tests.skipper.moments import moment, route
from tests.skipper.planning.test_beating import ctx
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.way.test_rejudged import asked, sailing

WALL = box(-4.0, 60.0, 60.0, 61.0)


def tracking(now, **more):
    return problem_tracking(
        now,
        Start(en_m=(0.0, 0.0), heading_rad=0.0),
        None,
        area=now.voyage.area,
        floor_m=6.0,
        forecast=now.snapshot.wind.forecast,
        **more,
    )


def test_the_ladder_ends_where_the_floor_is_left_beside_the_track():
    plain, track = (
        rungs(SkipperConfig(margin_m=12.0, margin_floor_m=6.0)),
        rungs(SkipperConfig(margin_m=12.0, margin_floor_m=6.0), track_m=2.5),
    )
    assert min(step.margin_m for step in plain) == 6.0
    assert min(step.margin_m for step in track) == 8.5
    assert track[0] == plain[0]


def test_a_margin_that_leaves_too_little_is_widened_by_name_before_it_shrinks():
    ladder = rungs(SkipperConfig(margin_m=8.0, margin_floor_m=6.0), track_m=4.0)
    assert [step.margin_m for step in ladder[:2]] == [8.0, 10.0]
    assert ladder[1].name == "margin 10.0 m for her track"
    assert all(step.margin_m >= 8.0 for step in ladder)


def test_unread_parameters_leave_more_beside_the_track():
    now = ctx()
    read = replace(now.snapshot, limits=AutopilotLimits(wp_speed_mps=5.0))
    unread = replace(now.snapshot, limits=AutopilotLimits())
    lowest = []
    for snapshot in (read, unread):
        now.snapshot = snapshot
        lowest.append(min(step.margin_m for step in steps(now)))
    assert lowest[0] < lowest[1]


def test_a_problem_says_how_it_is_sailed_and_what_is_solid_as_it_is():
    now = ctx(WALL)
    now.snapshot = replace(now.snapshot, limits=AutopilotLimits(wp_radius_m=7.0, wp_speed_mps=5.0))
    part = tracking(now)
    assert (part["wp_radius_m"], part["wp_speed_mps"], part["floor_m"]) == (7.0, 5.0, 6.0)
    assert part["known"] is True
    assert len(part["solids"]) == 1
    assert part["reach_m"] == now.voyage.boat.hull.reach_m
    assert "l1_period_s" not in part
    old = AutopilotLimits.from_params({"NAVL1_PERIOD": 12.0, "NAVL1_DAMPING": 0.8})
    now.snapshot = replace(now.snapshot, limits=old)
    assert (tracking(now)["l1_period_s"], tracking(now)["l1_damping"]) == (12.0, 0.8)
    now.snapshot = replace(now.snapshot, limits=None)
    assert tracking(now)["known"] is False


def test_a_way_whose_track_comes_too_near_is_seen():
    now = ctx(WALL)
    problem = Problem.from_json(
        problem_dict(
            now.voyage,
            now.gates[0],
            start=Start(en_m=(0.0, 0.0), heading_rad=0.0),
            aim=_aim(),
            forecast=now.snapshot.wind.forecast,
            margin_m=12.0,
            delta_s=0.9,
            no_go_half_rad=0.8,
            tracking=tracking(now),
        )
    )
    wide = of_way(problem, [(-60.0, 40.0), (-25.0, 60.0), (40.0, 110.0)], heading_rad=1.0, before_en=None)
    near = of_way(problem, [(-60.0, 40.0), (-8.0, 62.0), (40.0, 110.0)], heading_rad=1.0, before_en=None)
    assert wide.is_kept
    assert not near.is_kept
    assert of_way(replace(problem, tracking=None), [(0.0, 0.0), (0.0, 60.5)], heading_rad=0.0, before_en=None).is_kept


def _aim():
    from companion.skipper.planning.statement import Aim

    return Aim(en_m=(0.0, 400.0), radius_m=6.0, gate=0)


@pytest.mark.parametrize(("clearance", "words"), [(None, ""), (8.44, "; passes 8.4 m clear or more (floor 6 m)")])
def test_what_is_expected_is_said(clearance, words):
    assert clearance_text(clearance, 6.0) == words


def test_what_is_left_of_a_leg_is_no_short_leg_while_it_is_sailed():
    now = ctx(WALL)
    problem = Problem.from_json(
        problem_dict(
            now.voyage,
            now.gates[0],
            start=Start(en_m=(0.0, 0.0), heading_rad=0.0),
            aim=_aim(),
            forecast=now.snapshot.wind.forecast,
            margin_m=12.0,
            delta_s=0.9,
            no_go_half_rad=0.8,
            tracking={**tracking(now), "known": True},
        )
    )
    left = [(-60.0, 44.0), (-54.0, 46.0), (80.0, 46.0)]
    whole, rest = (of_way(problem, left, heading_rad=1.25, before_en=None, sailed_m=m) for m in (40.0, 0.0))
    assert whole.is_kept
    assert not rest.is_kept


@pytest.mark.parametrize(("left_s", "is_late"), [(SHORT_S - 0.5, True), (SHORT_S + 0.5, False)])
def test_no_upload_begins_a_leg_of_which_too_little_is_left_to_be_followed(left_s, is_late):
    world = sailing(obstacles=())
    boat, heading, speed = world.position, world.snapshot().vehicle.heading_rad, turn_of(world).speed_mps
    corner = moved(boat, heading, left_s * speed)
    route = world.state.mission.route
    now = turn_of(world, mission={"route": replace(route, points_en_m=(corner, *route.points_en_m[1:]))})
    problem = asked(now, ReplanReason.WAYPOINT, from_index=0)
    take_plan(now, PlanOutcome(request_id=now.state.pending.plan.request_id, plan=plan(problem, expansions=2000)))
    assert speed > 1.0
    assert any(isinstance(a, Announce) and a.code == "plan late" for a in now.actions) == is_late


WAY = route((100.0, 0.0), (200.0, 50.0), (300.0, 50.0), (300.0, 50.0))


@pytest.mark.parametrize(
    ("from_index", "lead_in", "way", "before"),
    [
        (None, (), WAY, None),
        (0, (), WAY, {"x": 0.0, "y": 0.0}),  # where the leg begins that ends at the plan's start
        (1, (), WAY, {"x": 100.0, "y": 0.0}),
        (1, (), None, None),
        (None, ((5.0, 5.0),), WAY, {"x": 7.0, "y": 8.0}),  # a start that was repaired is come to from the boat
    ],
)
def test_a_problem_says_where_the_leg_before_it_begins(from_index, lead_in, way, before):
    now = moment(way, at=(7.0, 8.0))
    start = Start(en_m=(0.0, 0.0), heading_rad=0.0, lead_in=lead_in)
    part = problem_tracking(
        now, start, from_index, area=now.voyage.area, floor_m=6.0, forecast=now.snapshot.wind.forecast
    )
    assert part["before"] == before


def test_a_problem_says_all_that_shapes_the_track():
    limits = AutopilotLimits(
        wp_radius_m=7.0, wp_speed_mps=5.0, sail_no_go_angle_rad=math.radians(50.0), rate_max_radps=0.5
    )
    now = moment(WAY, obstacles=(WALL,))
    now.snapshot = replace(now.snapshot, limits=limits)
    assert tracking(now) == {
        "wp_radius_m": 7.0,  # and of the rest what is not ArduRover's own
        "wp_speed_mps": 5.0,
        "rate_max_radps": 0.5,
        "no_go_half_deg": pytest.approx(50.0),
        "floor_m": 6.0,
        "reach_m": now.voyage.boat.hull.reach_m,
        "solids": now.voyage.area.obstacles_wkt(0.0),
        "limits": None,
        "before": None,
        "correlation_s": 30.0,
        "known": True,
    }
    now.snapshot = replace(now.snapshot, limits=None)
    assert tracking(now).keys().isdisjoint({"corridor_m", "wp_radius_m", "rate_max_radps"})


@pytest.mark.parametrize("tws_mps", [1.0, 3.0, 5.0, 8.0, 14.0])
@pytest.mark.parametrize("wp_speed_mps", [None, 5.0])
def test_the_ladder_s_track_is_the_next_of_few_steps(tws_mps, wp_speed_mps):
    now = moment(WAY, tws_mps=tws_mps)
    now.snapshot = replace(now.snapshot, limits=AutopilotLimits(wp_speed_mps=wp_speed_mps))
    best = now.voyage.boat.polar.max_speed_mps(tws_mps)
    need_m = stated_error_m(best, GuidanceModel(), has_short=wp_speed_mps is None) + now.voyage.boat.hull.reach_m
    track_m = next((step for step in (2.0, 2.5, 4.0, 8.0) if step >= need_m), need_m)
    assert steps(now) == rungs(now.config, track_m=track_m)


def test_without_a_wind_the_ladder_knows_no_track():
    now = moment(WAY)
    now.snapshot = replace(now.snapshot, wind=WindEstimate())
    assert steps(now) == rungs(now.config)


@pytest.mark.parametrize("rate_deg", [20.0, 120.0])
def test_the_boat_turns_no_faster_than_her_autopilot_lets_her(rate_deg):
    now = ctx()
    snapshot = replace(now.snapshot, limits=AutopilotLimits(rate_max_radps=math.radians(rate_deg)))
    told = StepContext(now.voyage, now.config, now.state, snapshot)
    reckoned_radps = min(math.radians(rate_deg), now.voyage.boat.turn_rate_radps)
    assert told.voyage.boat.turn_rate_radps == reckoned_radps
    assert told.boat_of_file is now.voyage.boat
    told = Skipper(voyage=now.voyage, config=now.config).sailed(now.state, snapshot.limits)
    assert told.boat.turn_rate_radps == reckoned_radps
    slow = StepContext(now.voyage, now.config, now.state, snapshot).loiter_swing_m
    assert (slow > now.loiter_swing_m) is (rate_deg < 120.0)

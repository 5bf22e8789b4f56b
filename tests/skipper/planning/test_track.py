"""What the skipper makes of the track: its ladder, its problems, the way that it would keep, what it says."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.boat import AutopilotLimits
from companion.boat.tracking import SHORT_S
from companion.planner import Problem, plan
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.ladder import rungs
from companion.skipper.planning.statement import Start, problem_dict
from companion.skipper.planning.track import clearance_text, of_way, problem_tracking, steps
from companion.skipper.step.actions import Announce, ReplanReason
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.snapshot import PlanOutcome
from companion.skipper.way.geometry import moved
from tests.skipper.planning.test_beating import ctx
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.way.test_rejudged import asked, sailing

WALL = box(-4.0, 60.0, 60.0, 61.0)


def tracking(now, **more):
    return problem_tracking(
        now, Start(en_m=(0.0, 0.0), heading_rad=0.0), None, floor_m=6.0, forecast=now.snapshot.wind.forecast, **more
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

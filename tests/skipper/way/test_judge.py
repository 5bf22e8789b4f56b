"""Is a path still good, what will the autopilot make of a closed leg, and the problem that is handed to the planner."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, box

from companion.boat import Boat, ardurover_sitl
from companion.boat.polar import constant
from companion.planner import Problem, plan
from companion.planner.problem.value import defect_of
from companion.planners import AUTO, AstarSettings, PlannerChoice
from companion.skipper.planning.ladder import rungs
from companion.skipper.planning.statement import Aim, Start, aim_at, problem_dict, repaired, wind_part
from companion.skipper.step.config import SkipperConfig
from companion.skipper.way.gates import gates_of
from companion.skipper.way.judge import half_width_rad, judge, predicted_beat
from companion.skipper.way.shoals import NAME, Shoal, beyond_words, shoaled
from companion.skipper.way.shortest import way_m
from companion.skipper.way.stemming import Water
from companion.skipper.way.voyage import Goal
from tests.skipper.world import area, forecast, voyage

BOAT = Boat(polar=ardurover_sitl())
NO_GO = math.radians(45.0)
CHECK = settings(max_examples=60)


def verdict(path, twd=0.0, **more):
    return judge(
        path, boat=BOAT, no_go_half_rad=NO_GO, twd_from_rad=twd, tws_mps=5.0, area=more.pop("area", area()), **more
    )


def test_a_leg_into_the_wind_is_not_sound_and_a_reach_is():
    assert not verdict([(0, 0), (0, 100)]).is_sound(0.0)
    reach = verdict([(0, 0), (100, 0)])
    assert reach.is_sound(1000.0)
    assert reach.time_s == pytest.approx(100.0 / BOAT.polar.speed_mps(math.pi / 2, 5.0), rel=1e-6)


def test_a_forecast_narrows_what_is_sound():
    path = [(0, 0), (100, 80)]  # TWA 51 degrees
    assert verdict(path).is_sound(0.0)
    wide = forecast(0.0, 0.0, sigma_rad=0.2)
    assert not verdict(path, forecast=wide, level=0.9).is_sound(0.0)


def test_clearance_counts():
    rock = area(box(40, 5, 60, 20))
    assert verdict([(0, 0), (100, 0)], area=rock).clearance_m == pytest.approx(5.0)
    assert not verdict([(0, 0), (100, 0)], area=rock).is_sound(8.0)


@CHECK
@given(st.floats(-math.pi, math.pi), st.floats(-0.6, 0.6), st.floats(20.0, 300.0))
def test_predicted_beat_stays_off_the_wind_and_turns_with_it(twd, off, length):
    target = (length * math.sin(twd + off), length * math.cos(twd + off))
    heading = twd - NO_GO
    drift = predicted_beat(
        (0.0, 0.0), heading, (0.0, 0.0), target, twd_from_rad=twd, no_go_half_rad=NO_GO, corridor_m=10.0, area=area()
    )
    first, second = drift.path[0], drift.path[1]
    course = math.atan2(second[0] - first[0], second[1] - first[1])
    assert math.isclose(abs(math.remainder(course - twd, 2 * math.pi)), NO_GO, abs_tol=1e-6)
    assert drift.off_leg_m <= 10.0 + length / 40.0 + 1.0


@CHECK
@given(st.floats(0.01, 0.6), st.floats(0.0, 3000.0))
def test_half_width_grows_with_the_level(sigma, horizon):
    table = forecast(0.0, 0.0, sigma_rad=sigma)
    widths = [half_width_rad(table, horizon, level) for level in (0.1, 0.5, 0.8, 0.9, 0.95, 0.99)]
    assert widths == sorted(widths)
    assert widths[4] == pytest.approx(1.96 * sigma, rel=1e-6)


def test_wind_part_carries_a_swing_as_width():
    table = forecast(0.0, 0.0, sigma_rad=0.05)
    still = wind_part(table, after_s=0.0, length_s=120.0, delta_s=0.95)
    swing = np.array(table.mean_twd_from_rad)
    swing[:3] = 0.3
    turned = table.__class__(**{f: getattr(table, f) for f in table.__slots__} | {"mean_twd_from_rad": swing})
    wide = wind_part(turned, after_s=0.0, length_s=120.0, delta_s=0.95)
    assert wide["sigma"]["half_width_deg"][0] > still["sigma"]["half_width_deg"][0] + 5.0
    assert 0.0 < wide["from_deg"] < 17.2


@pytest.mark.parametrize("after", [0.0, 7.0, 45.0, 5000.0])
def test_problem_is_one_that_the_planner_reads(after):
    made = voyage(
        Goal(en_m=(0.0, 400.0), radius_m=6.0, bandwidth_m=80.0),
        obstacles=(box(-40, 120, 30, 160),),
        limits=box(-300, -100, 300, 600),
    )
    gate = gates_of(made)[0]
    data = problem_dict(
        made,
        gate,
        start=Start(en_m=(0.0, 0.0), heading_rad=1.0, after_s=after),
        aim=Aim(en_m=gate.en_m, radius_m=6.0, gate=0),
        forecast=forecast(0.0, 0.2),
        margin_m=15.0,
        delta_s=0.95,
        no_go_half_rad=math.radians(47.0),
    )
    problem = Problem.from_json(data)
    assert defect_of(problem) is None
    assert problem.boat.no_go_half_rad == pytest.approx(math.radians(47.0))
    # The band bounds the plan, and the margin is in the obstacles.
    assert problem.fence is not None
    assert problem.fence.bounds[0] >= -80.1
    assert problem.obstacles[0].area > box(-40, 120, 30, 160).area
    assert list(problem.wind.sigma.horizon_s) == sorted(set(problem.wind.sigma.horizon_s))


def test_a_start_inside_the_margin_is_led_out():
    made = voyage(obstacles=(box(-50, -50, 50, -4),))
    start = Start(en_m=(0.0, 0.0), heading_rad=0.0)
    out = repaired(made, start, margin_m=15.0, floor_m=8.0, twd_from_rad=0.0)
    assert out.lead_in
    assert made.area.clearance_m([out.en_m])[0] >= 15.0
    assert "from an obstacle" in out.text
    assert repaired(made, start, margin_m=3.0, floor_m=2.0, twd_from_rad=0.0) is start


@pytest.mark.parametrize("set_deg", [90.0, 270.0])
def test_in_a_stream_the_free_water_is_the_one_that_she_is_soonest_at(set_deg):
    """The nearest lay up the stream: she stood before the rock until it had her."""
    made = voyage(obstacles=(Point(-12.0, 0.0).buffer(8.0),))
    start = Start(en_m=(0.0, 0.0), heading_rad=math.radians(90.0))
    flows = 0.9 * math.sin(math.radians(set_deg)), 0.9 * math.cos(math.radians(set_deg))
    slow = replace(made.boat, polar=constant(1.0))
    water = Water(boat=slow, wind=(0.0, 5.0), current_en_mps=flows, no_go_half_rad=math.radians(45.0))
    still = repaired(made, start, margin_m=12.0, floor_m=6.0, twd_from_rad=0.0)
    out = repaired(made, start, margin_m=12.0, floor_m=6.0, twd_from_rad=0.0, water=water)
    assert still.lead_in[0][0] > 5.0
    by_nearest, by_soonest = (math.hypot(*s.en_m) / water.made_good_mps(s.heading_rad) for s in (still, out))
    assert by_soonest <= by_nearest
    assert (by_soonest < 0.5 * by_nearest) == (set_deg == 270.0)
    assert made.area.clearance_m([out.en_m])[0] >= 12.0


def test_where_the_stream_lets_her_nowhere_she_is_led_out_as_in_still_water():
    made = voyage(obstacles=(Point(-12.0, 0.0).buffer(8.0),))
    start = Start(en_m=(0.0, 0.0), heading_rad=math.radians(90.0))
    calm = Water(boat=made.boat, wind=(0.0, 0.0), current_en_mps=(-3.0, 0.0), no_go_half_rad=math.radians(45.0))
    ways = [repaired(made, start, margin_m=12.0, floor_m=6.0, twd_from_rad=0.0, water=w) for w in (None, calm)]
    assert ways[0] == ways[1] != start


def test_out_of_a_shoal_there_is_only_the_way_off_it():
    """Of a boat in one the whole shoal was opened, as a fence is: "the old plan stays", over the bank at 3.7 m/s."""
    shoal = Shoal(en_m=(0.0, 12.0), radius_m=20.0, doubt_m=0.0, depth_m=0.4)
    made = voyage(Goal(en_m=(0.0, 300.0), radius_m=6.0))
    made = replace(made, area=shoaled(made.area, (shoal,)))
    out = repaired(made, Start(en_m=(0.0, 0.0), heading_rad=0.0), margin_m=12.0, floor_m=6.0, twd_from_rad=math.pi)
    assert out.lead_in[0][1] < 0.0
    assert made.area.clearance_m([out.en_m])[0] >= 12.0
    assert not out.back_en
    assert "the fence" not in out.text
    for name, en_m in {f"inside {NAME}": (0.0, 0.0), "outside the fence": (900.0, 0.0)}.items():
        water = shoaled(voyage(limits=box(-500, -500, 500, 500)).area, (shoal,))
        assert beyond_words(water, en_m) == name


def test_a_start_just_outside_the_margin_gets_a_notch_where_the_water_is_drawn_narrower():
    """Corners are drawn 4.5 % outwards: 8.7 m off, with 8.5 m of margin, she never set sail."""
    made = voyage(obstacles=(box(-50, -50, 50, -8.7),))
    start = Start(en_m=(0.0, 0.0), heading_rad=0.0)
    out = repaired(made, start, margin_m=8.5, floor_m=6.0, twd_from_rad=0.0)
    assert out.notch_m > 0.0
    assert repaired(made, start, margin_m=8.3, floor_m=6.0, twd_from_rad=0.0) is start


@pytest.mark.parametrize("limits", [None, box(-300, -5, 300, 900)])
def test_a_start_between_floor_and_margin_gets_a_notch(limits):
    made = voyage(Goal(en_m=(0.0, 300.0), radius_m=6.0), obstacles=(box(-50, -50, 50, 30),), limits=limits)
    start = Start(en_m=(0.0, 40.0), heading_rad=0.0)
    out = repaired(made, start, margin_m=15.0, floor_m=8.0, twd_from_rad=math.pi)
    assert out.en_m == start.en_m
    assert not out.lead_in
    assert out.notch_m > 5.0
    gate = gates_of(made)[0]
    problem = Problem.from_json(
        problem_dict(
            made,
            gate,
            start=out,
            aim=Aim(en_m=gate.en_m, radius_m=6.0, gate=0),
            forecast=forecast(0.0, math.pi),
            margin_m=15.0,
            delta_s=0.95,
            no_go_half_rad=math.radians(47.0),
            floor_m=8.0,
        )
    )
    answer = plan(problem, expansions=500)
    assert answer.has_path
    assert made.area.path_clearance_m(answer.waypoints_en) >= 8.0


def test_a_start_inside_the_obstacle_is_led_out_too():
    made = voyage(obstacles=(box(-50, -50, 50, 10),))
    out = repaired(made, Start(en_m=(0.0, 0.0), heading_rad=0.0), margin_m=15.0, floor_m=8.0, twd_from_rad=math.pi)
    assert made.area.clearance_m([out.en_m])[0] >= 15.0


@pytest.mark.parametrize("shore", [None, box(-300, -100, 190, 400)])
def test_from_outside_the_limits_a_plan_leads_back_round_what_is_solid(shore):
    """No straight line did, and none was found: she held for ever. Limits that hold her stay what they are."""
    isle, spit = box(-60, 120, 40, 170), box(60, -20, 80, 120)
    water = area(isle, spit, limits=shore).within((-100.0, 250.0), 80.0, "the circle")
    made = replace(voyage(Goal(en_m=(-100.0, 250.0), radius_m=8.0)), area=water)
    out = repaired(
        made, Start(en_m=(130.0, 20.0), heading_rad=0.0), margin_m=12.0, floor_m=6.0, twd_from_rad=-math.pi / 2.0
    )
    assert out.en_m == (130.0, 20.0)
    assert "m outside the fence: planned back into it" in out.text
    gate = gates_of(made)[0]
    problem = Problem.from_json(
        problem_dict(
            made,
            gate,
            start=out,
            aim=Aim(en_m=gate.en_m, radius_m=6.0, gate=0),
            forecast=forecast(0.0, -math.pi / 2.0),
            margin_m=12.0,
            delta_s=0.95,
            no_go_half_rad=math.radians(47.0),
            floor_m=6.0,
        )
    )
    assert shore is None or problem.fence.within(shore.buffer(-11.9))
    answer = plan(problem, expansions=2000)
    assert answer.has_path
    assert area(isle, spit, limits=shore).path_clearance_m(answer.waypoints_en) >= 12.0 - 0.01
    assert water.clearance_m([answer.waypoints_en[-1]])[0] > 12.0


@pytest.mark.parametrize("fence_m", [None, 120.0])
def test_just_outside_the_missions_own_limits_no_plan_leads_farther_out(fence_m):
    """They may be the shore: opened about the way back inside, plans led 80 m over it of a boat 2 m off."""
    shore = box(-300, -100, 190, 400)
    made = voyage(Goal(en_m=(-100.0, 250.0), radius_m=8.0), limits=shore)
    if fence_m is not None:
        made = replace(made, area=made.area.within((-100.0, 250.0), fence_m, "the circle"))
    start = Start(en_m=(192.0, 100.0), heading_rad=0.0)
    out = repaired(made, start, margin_m=12.0, floor_m=6.0, twd_from_rad=-math.pi / 2.0)
    assert out.lead_in
    assert not out.back_en
    gate = gates_of(made)[0]
    data = problem_dict(
        made,
        gate,
        start=out,
        aim=Aim(en_m=gate.en_m, radius_m=6.0, gate=0),
        forecast=forecast(0.0, -math.pi / 2.0),
        margin_m=12.0,
        delta_s=0.95,
        no_go_half_rad=math.radians(47.0),
    )
    assert Problem.from_json(data).fence.within(shore.buffer(2.5))


def test_the_local_plan_covers_the_next_miles_only():
    made = voyage(Goal(en_m=(0.0, 50_000.0), radius_m=50.0))
    config = SkipperConfig()
    aim = aim_at(made, config, gates_of(made)[0], 0, (0.0, 0.0))
    assert aim.gate == -1
    assert math.hypot(*aim.en_m) <= config.horizon_m + 1.0
    assert aim_at(made, config, gates_of(made)[0], 0, (0.0, 46_000.0)).gate == 0


def test_the_local_plan_leads_out_of_a_bay_and_round_it_not_deeper_into_it():
    """The straight line to the goal leads deeper in: planned so, she turns back and forth for ever."""
    bay = (box(-800, 850, 800, 900), box(-800, 0, -750, 900), box(750, 0, 800, 900))
    made = voyage(Goal(en_m=(100.0, 1200.0), radius_m=10.0), obstacles=bay)
    config, gates = SkipperConfig(horizon_m=500.0), gates_of(made)
    here, left_m = (100.0, 400.0), math.inf
    for _ in range(10):
        aim = aim_at(made, config, gates[0], 0, here)
        assert made.area.clearance_m([aim.en_m])[0] >= config.margin_m
        if aim.gate == 0:
            return
        assert math.dist(here, aim.en_m) <= 1.1 * config.horizon_m
        here, before_m = aim.en_m, left_m
        left_m = way_m(made.area, here, (100.0, 1200.0), config.margin_m)
        assert left_m < before_m - 200.0, "on the way round, and never back in"
    raise AssertionError("the goal never came into sight")


def test_the_local_plan_leads_to_no_lake():
    ring = Point(0.0, 700.0).buffer(170.0).difference(Point(0.0, 700.0).buffer(130.0))
    made = voyage(Goal(en_m=(0.0, 1400.0), radius_m=10.0), obstacles=(ring,))
    aim = aim_at(made, SkipperConfig(horizon_m=700.0), gates_of(made)[0], 0, (0.0, 0.0))
    assert aim.gate == -1
    assert math.dist(aim.en_m, (0.0, 700.0)) > 170.0


def test_the_ladder_never_goes_below_the_floor_and_never_repeats_itself():
    steps = rungs(SkipperConfig())
    assert steps[0].name == ""
    assert len({(s.margin_m, s.delta_s, s.nearer_goal) for s in steps}) == len(steps)
    assert min(s.margin_m for s in steps) == SkipperConfig().margin_floor_m
    assert [s.delta_s for s in steps] == sorted((s.delta_s for s in steps), reverse=True)
    tight = rungs(SkipperConfig(margin_m=5.0, margin_floor_m=8.0))
    assert all(s.margin_m == 5.0 for s in tight)


def test_a_planner_of_somebodys_choice_is_the_first_thing_to_be_given_up():
    chosen = PlannerChoice(algorithm="astar", settings=AstarSettings(grid_m=5.0))
    steps, plain = rungs(SkipperConfig(planner=chosen)), rungs(SkipperConfig())
    assert [s.planner for s in steps] == [chosen, *[AUTO] * (len(steps) - 1)]
    assert steps[1].name == "planner auto"
    assert (steps[1].margin_m, steps[1].delta_s) == (steps[0].margin_m, steps[0].delta_s)
    assert steps[2:] == plain[1:]


def test_a_limit_on_the_paths_risk_reaches_the_problem_and_is_given_up_before_delta_s():
    steps = rungs(SkipperConfig(max_path_risk=0.2))
    given_up = next(n for n, s in enumerate(steps) if s.max_path_risk is None)
    assert all(s.max_path_risk == 0.2 for s in steps[:given_up])
    assert "not bounded" in steps[given_up].name
    assert steps[given_up].delta_s == SkipperConfig().delta_s
    assert all(s.max_path_risk is None for s in steps[given_up:])
    made = voyage(Goal(en_m=(0.0, 400.0), radius_m=6.0))
    config = SkipperConfig(max_path_risk=0.2)
    start, gates = Start(en_m=(0.0, 0.0), heading_rad=0.8), gates_of(made)
    aim = aim_at(made, config, gates[0], 0, start.en_m)
    problem = Problem.from_json(
        problem_dict(
            made,
            gates[0],
            start=start,
            aim=aim,
            forecast=forecast(0.0, 0.0, sigma_rad=0.1),
            margin_m=15.0,
            delta_s=0.9,
            no_go_half_rad=NO_GO,
            max_path_risk=0.2,
        )
    )
    assert problem.risk is not None
    answer = plan(problem, expansions=8000)
    assert answer.has_path
    assert answer.risk is not None
    assert answer.risk <= 0.2


@pytest.mark.parametrize(("margin_m", "floor_m"), [(6.0, 3.0), (12.0, 6.0), (6.0, 6.0)])
@pytest.mark.parametrize("is_fence", [False, True])
def test_from_wherever_she_lies_about_the_floor_a_plan_begins(margin_m, floor_m, is_fence):
    """The notch is drawn 4.5 % wider than the floor: 3.0 m off, or 6.1, none was found; 2.0 and 3.2 m off one was."""
    limits, solids = (box(-300, 0, 300, 900), ()) if is_fence else (None, (box(-300, -50, 300, 0),))
    made = voyage(Goal(en_m=(0.0, 100.0), radius_m=6.0), obstacles=solids, limits=limits)
    gate = gates_of(made)[0]
    for off_m in np.arange(2.9, 6.55, 0.1):
        start = Start(en_m=(0.0, float(off_m)), heading_rad=0.0)
        out = repaired(made, start, margin_m=margin_m, floor_m=floor_m, twd_from_rad=math.pi / 2.0)
        problem = Problem.from_json(
            problem_dict(
                made,
                gate,
                start=out,
                aim=Aim(en_m=gate.en_m, radius_m=6.0, gate=0),
                forecast=forecast(0.0, math.pi / 2.0),
                margin_m=margin_m,
                delta_s=0.95,
                no_go_half_rad=math.radians(47.0),
                floor_m=floor_m,
            )
        )
        assert defect_of(problem) is None, off_m
        assert plan(problem, expansions=200).has_path, off_m


@pytest.mark.parametrize("off_m", [13.0, 20.5])
def test_a_start_inside_an_obstacles_own_margin_is_led_out(off_m):
    """By the mission's margin it was free, and no plan began there."""
    made = voyage(obstacles=(box(-50, -50, 50, 0),))
    made = replace(made, area=replace(made.area, own_margins_m=(20.0,)))
    out = repaired(made, Start(en_m=(0.0, off_m), heading_rad=0.0), margin_m=12.0, floor_m=6.0, twd_from_rad=math.pi)
    assert out.lead_in
    assert made.area.spare_m([out.en_m], 12.0)[0] > 0.0

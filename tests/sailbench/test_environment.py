"""The environment: Gymnasium's own check, the boat that sails in it, what ends a voyage, and the sailors."""

import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import sailbench
from companion.errors import InputError
from sailbench.environment import ENVIRONMENTS, SailingEnv
from sailbench.sailors import SAILORS, lines, sail, steer
from sitl.scenario import scenario_wind


def made(name="Rocks", **options):
    return gymnasium.make(f"sailbench/{name}-v0", **options)


@pytest.mark.parametrize("action", ["heading", "tack"])
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_gymnasium_finds_nothing_wrong(name, action):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(name, action=action).unwrapped)


def test_what_is_seen_is_the_boat_the_goal_and_the_wind_of_that_weather():
    env = made()
    seen, told = env.reset(seed=3)
    inner = env.unwrapped
    (goal, _), *_ = inner.goals
    assert seen[:4] == pytest.approx([*goal, 0.0, 0.0])
    assert math.degrees(math.atan2(seen[4], seen[5])) == pytest.approx(60.0)
    twd_from_rad, tws_mps = scenario_wind(inner.scenario, inner.source, 3).at(35.0)  # where the companion sets sail
    assert math.remainder(math.atan2(seen[7], seen[8]) - twd_from_rad, math.tau) == pytest.approx(0.0, abs=1e-3)
    assert seen[9] == pytest.approx(tws_mps, abs=1e-3)
    assert told == {"t_s": 0.0, "weather": 3}


def test_the_bearings_say_how_far_the_water_is_free():
    env = made()
    env.reset(seed=1)
    inner = env.unwrapped
    free_m = inner._free_m((0.0, 0.0))
    rock = min(inner.solid.geoms, key=lambda g: g.distance(inner.solid.centroid))
    assert free_m[0] == pytest.approx(rock.bounds[1], abs=2.0)  # the middle rock, due north
    assert (free_m[4:13] == 100.0).all()


def test_a_heading_is_steered_and_time_is_what_it_costs():
    env = made()
    env.reset(seed=1)
    rewards = []
    for _ in range(20):
        seen, reward, *_ = env.step(steer(math.radians(90.0)))
        rewards.append(reward)
    assert rewards == [-1.0] * 20
    assert math.degrees(math.atan2(seen[4], seen[5])) == pytest.approx(90.0, abs=10.0)
    assert seen[2] > 20.0
    assert seen[6] > 1.0
    assert abs(seen[3]) < 10.0


def test_a_tack_goes_about_and_otherwise_she_stays_on_hers():
    env = made("Beat", action="tack")
    seen, _ = env.reset(seed=1)

    def side(seen):
        return math.copysign(1.0, math.remainder(math.atan2(seen[4], seen[5]) - math.atan2(seen[7], seen[8]), math.tau))

    for _ in range(30):
        seen, *_ = env.step(0)
    before = side(seen)
    seen, *_ = env.step(1)
    for _ in range(20):
        seen, *_ = env.step(0 if side(seen) != before else 1)
    assert side(seen) == -before
    for _ in range(20):
        seen, *_ = env.step(0)
    assert side(seen) == -before


def test_who_touches_has_not_arrived():
    touched = sail("sailbench/Rocks-v0", "greedy", 0)
    assert (touched["outcome"], touched["time_s"]) == ("touched", None)


def test_touching_takes_what_is_left_of_the_limit():
    env = made()
    seen, told = env.reset(seed=0)
    helm, total, over = SAILORS["greedy"](env.unwrapped), 0.0, False
    while not over:
        seen, reward, terminated, truncated, told = env.step(helm(seen))
        total, over = total + reward, terminated or truncated
    assert told["touched"]
    assert terminated
    assert total == pytest.approx(-env.unwrapped.limit_s)


def test_the_limit_truncates():
    env = made()
    env.reset(seed=0)
    env.unwrapped.limit_s = 3.0
    ends = [env.step(steer(math.radians(90.0)))[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]


def test_who_plans_comes_through_the_rocks_and_the_same_again():
    first, again = (sail("sailbench/Rocks-v0", "auto", 0) for _ in range(2))
    assert first["outcome"] == "arrived"
    assert 60.0 < first["time_s"] < 250.0
    assert abs(first["time_s"] - again["time_s"]) < 30.0  # plans end by the clock


def test_the_companion_sails_the_same_weather():
    row = sail("sailbench/Rocks-v0", "companion", 0)
    assert row["outcome"] == "arrived"
    assert 60.0 < row["time_s"] < 250.0


def test_the_lake_blows_as_it_was_recorded():
    env = made("Lake")
    first, again = (env.reset(seed=seed)[0] for seed in (1, 2))
    assert np.array_equal(first, again)
    assert sail("sailbench/Lake-v0", "greedy", 0)["outcome"] == "arrived"


def test_a_scenario_with_more_than_wind_is_refused():
    with pytest.raises(InputError, match=r"crossing\.toml: has vessel, and here is wind alone"):
        SailingEnv("crossing")
    with pytest.raises(InputError, match="heading or tack"):
        SailingEnv(action="gybe")


def test_before_reset_there_is_no_boat():
    env = SailingEnv()
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(steer(0.0))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.problem()


def test_the_problem_of_the_moment_is_where_she_is():
    env = made()
    env.reset(seed=2)
    for _ in range(10):
        seen, *_ = env.step(steer(math.radians(90.0)))
    near, far = env.unwrapped.problem(), env.unwrapped.problem(12.0)
    assert near.start_en == pytest.approx(seen[2:4], abs=1e-3)
    assert near.goal_en == pytest.approx(env.unwrapped.goals[0][0])
    assert far.obstacle_union.area > 1.5 * near.obstacle_union.area


def test_the_table_of_sailors_has_who_touches_least_first():
    rows = [
        {"environment": "E", "sailor": s, "seed": n, "outcome": o, "time_s": t}
        for s, results in {
            "a": [("touched", None), ("arrived", 90.0)],
            "b": [("arrived", 110.0), ("arrived", 130.0)],
        }.items()
        for n, (o, t) in enumerate(results)
    ]
    assert lines(rows) == [("E", "b", "2", "2", "0", "0", "120", "128"), ("E", "a", "2", "1", "1", "0", "90", "90")]


def test_what_is_registered_twice_is_registered_once():
    sailbench.register()
    assert set(ENVIRONMENTS) <= set(gymnasium.registry)

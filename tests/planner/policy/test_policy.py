"""The best policy: against closed forms, against drawn winds sailed by it, and what it keeps clear of."""

import itertools
import math

import numpy as np
import pytest
import shapely

from companion.planner import Problem
from companion.planner.policy import PORT, STARBOARD, solve, steady, wandering

NO_GO_DEG = 45.0
CLOSE_HAULED_MPS = 2.5
TACK_S = 1.0
MADE_GOOD_MPS = CLOSE_HAULED_MPS * math.cos(math.radians(NO_GO_DEG))
WANDERING = wandering(math.radians(9.0), 28.0)


def problem(goal=(0.0, 400.0), obstacles=(), boat=None, **fields):
    """Return a sail from the origin in a wind from the north."""
    return Problem.from_json(
        {
            "id": "test",
            "start": {"x": 0.0, "y": 0.0, "heading_deg": 0.0},
            "goal": {"x": goal[0], "y": goal[1], "radius": 10.0},
            "obstacles": [shape.wkt for shape in obstacles],
            "wind": {"from_deg": 0.0, "speed_mps": 5.0, "sigma": {"model": "none"}},
            "boat": {
                "no_go_half_deg": NO_GO_DEG,
                "max_twa_deg": 170.0,
                "turn_rate_rad_s": math.pi / 2.0,
                "speed": {
                    "model": "polar",
                    "twa_deg": [0, 45, 60, 90, 120, 150, 180],
                    "v_mps": [0, CLOSE_HAULED_MPS, 2.8, 3.0, 2.9, 2.4, 2.0],
                },
                **(boat or {}),
            },
            "delta_s": 0.5,
            **fields,
        }
    )


def expected_s(policy, tack=PORT, at=(0.0, 0.0), draws=400):
    """Return the mean of the time to go over the shifts that a voyage may begin in."""
    shifts = policy.shifts.spread_rad * np.random.default_rng(1).standard_normal(draws)
    return float(np.mean([policy.time_to_go_s(at, float(shift), tack) for shift in shifts]))


# ------------------------------------------------------------------------------------------ the wind
@pytest.mark.parametrize("after_s", [0.5, 5.0, 60.0])
def test_the_chain_has_mean_variance_and_correlation_of_the_process(after_s):
    chain, kept = WANDERING.after(after_s), math.exp(-after_s / WANDERING.tau_s)
    shift, states = WANDERING.shift_rad, len(WANDERING.shift_rad)
    settled = np.array([math.comb(states - 1, k) for k in range(states)]) / 2.0 ** (states - 1)
    assert chain.sum(axis=1) == pytest.approx(1.0)
    assert settled @ chain == pytest.approx(settled), "the stationary spread stays"
    assert settled @ shift**2 == pytest.approx(WANDERING.spread_rad**2)
    assert chain @ shift == pytest.approx(kept * shift, abs=1e-12)
    assert chain @ shift**2 - (chain @ shift) ** 2 == pytest.approx(
        np.full(states, WANDERING.spread_rad**2 * (1.0 - kept**2)), rel=0.25, abs=0.02 * WANDERING.spread_rad**2
    )


@pytest.mark.parametrize(("states", "tau_s"), [(2, 28.0), (11, 0.0)])
def test_a_process_that_is_none_is_refused(states, tau_s):
    with pytest.raises(ValueError, match="at least 3"):
        wandering(0.1, tau_s, states=states)


# --------------------------------------------------------------------------------------- closed forms
def test_a_steady_beat_takes_what_it_must():
    policy = solve(problem(), steady(), cell_m=4.0)
    assert policy.time_to_go_s((0.0, 0.0), 0.0) == pytest.approx(390.0 / MADE_GOOD_MPS + TACK_S, rel=0.01)


def test_a_reach_is_sailed_straight():
    policy = solve(problem(goal=(400.0, 0.0)), steady(), cell_m=4.0)
    assert policy.time_to_go_s((0.0, 0.0), 0.0, PORT) == pytest.approx(130.0, rel=0.005)
    assert policy.decide((0.0, 0.0), 0.0, PORT).course_rad == pytest.approx(math.pi / 2.0, abs=math.radians(8.0))


def test_dead_down_wind_is_gybed_where_that_is_faster():
    policy = solve(problem(goal=(0.0, -400.0)), steady(), cell_m=4.0)
    best_mps = max(v * -math.cos(math.radians(a)) for a, v in ((120, 2.9), (135, 2.65), (150, 2.4), (170, 2.13)))
    assert policy.time_to_go_s((0.0, 0.0), 0.0) == pytest.approx(390.0 / best_mps + TACK_S, rel=0.015)


def test_a_current_carries_her():
    with_it = solve(problem(goal=(400.0, 0.0), current={"set_deg": 90.0, "drift_mps": 0.5}), steady(), cell_m=4.0)
    assert with_it.time_to_go_s((0.0, 0.0), 0.0, PORT) == pytest.approx(390.0 / 3.5, rel=0.01)


def test_what_follows_the_goal_is_counted():
    second = solve(problem(goal=(400.0, 400.0)), steady(), cell_m=4.0)
    first = solve(problem(), steady(), cell_m=4.0, onward=second)
    alone = solve(problem(), steady(), cell_m=4.0)
    onward_s = second.time_to_go_s((0.0, 400.0), 0.0)
    assert 100.0 < onward_s < 200.0
    assert first.time_to_go_s((0.0, 0.0), 0.0) == pytest.approx(
        alone.time_to_go_s((0.0, 0.0), 0.0) + onward_s, rel=0.01
    )


def test_where_no_way_leads_it_says_so():
    wall = shapely.Point(0.0, 400.0).buffer(60.0).difference(shapely.Point(0.0, 400.0).buffer(40.0))
    policy = solve(problem(obstacles=[wall]), steady(), cell_m=4.0)
    assert math.isinf(policy.time_to_go_s((0.0, 0.0), 0.0))
    with pytest.raises(ValueError, match="no way"):
        policy.sailed((0.0, 0.0), PORT, count=1)


# ----------------------------------------------------------------------------------------- drawn winds
WALL = shapely.box(-150.0, 180.0, 20.0, 220.0)


@pytest.mark.parametrize("obstacles", [(), (WALL,)], ids=["open", "a wall"])
@pytest.mark.parametrize(("spread_deg", "tau_s"), [(9.0, 28.0), (18.6, 28.0), (9.0, 120.0)])
def test_drawn_winds_take_what_it_expects(spread_deg, tau_s, obstacles):
    policy = solve(problem(obstacles=obstacles), wandering(math.radians(spread_deg), tau_s), cell_m=8.0)
    drawn = policy.sailed((0.0, 0.0), PORT, count=400)
    assert drawn.time_s.mean() == pytest.approx(expected_s(policy), rel=0.015)
    assert not drawn.has_touched.any()
    for track, shape in itertools.product(drawn.tracks[:20], obstacles):
        assert not shapely.LineString(track).intersects(shape)


def test_shifts_are_worth_time():
    still = solve(problem(), steady(), cell_m=8.0).time_to_go_s((0.0, 0.0), 0.0)
    assert expected_s(solve(problem(), WANDERING, cell_m=8.0)) < 0.96 * still


def test_a_header_is_tacked_on_and_a_lift_is_not():
    policy = solve(problem(), WANDERING, cell_m=8.0)
    header = math.radians(15.0)  # a veer heads a boat on port tack
    assert policy.decide((0.0, 0.0), header, PORT).is_tack
    assert not policy.decide((0.0, 0.0), -header, PORT).is_tack
    assert policy.decide((0.0, 0.0), -header, STARBOARD).is_tack


def test_the_layline_is_where_the_other_tack_fetches():
    policy = solve(problem(), steady(), cell_m=4.0)
    row, column = (round(x) for x in policy.chart.cells((220.0, 200.0)))  # beyond the layline of starboard tack
    assert policy.tacks_at_once(PORT)[row, column]
    assert not policy.tacks_at_once(STARBOARD)[row, column]
    assert policy.chart_s(STARBOARD)[row, column] == pytest.approx(policy.chart_s(PORT)[row, column] - TACK_S, abs=0.1)


# ------------------------------------------------------------------------------------------ in irons
def test_a_tack_that_may_fail_is_paid_for():
    fails, irons_s = 0.2, 15.0
    sure = solve(problem(), steady(), cell_m=4.0)
    unsure = solve(problem(boat={"tack_fails": fails, "irons_s": irons_s}), steady(), cell_m=4.0)
    paid_s = unsure.time_to_go_s((0.0, 0.0), 0.0) - sure.time_to_go_s((0.0, 0.0), 0.0)
    again = fails / (1.0 - fails)  # tries that fail before one comes off
    assert paid_s == pytest.approx(again * (irons_s + TACK_S), abs=0.01 * sure.time_to_go_s((0.0, 0.0), 0.0))
    drawn = unsure.sailed((0.0, 0.0), PORT, count=400)
    assert drawn.time_s.mean() == pytest.approx(unsure.time_to_go_s((0.0, 0.0), 0.0, PORT), rel=0.01)


def test_near_a_lee_shore_a_tack_that_may_fail_is_not_left_to_the_last():
    """In irons she is set 15 m to leeward: without room for that a tack costs what a touch does."""
    shore = shapely.box(-400.0, 150.0, 400.0, 200.0).difference(shapely.box(150.0, 140.0, 200.0, 210.0))
    lee = {"tack_fails": 0.3, "irons_s": 15.0, "lee_mps": [1.0, 1.0]}
    where = problem(goal=(170.0, 300.0), obstacles=[shore, shapely.box(-400.0, -60.0, 400.0, -10.0)], boat=lee)
    policy = solve(where, WANDERING, cell_m=6.0)
    drawn = policy.sailed((0.0, 20.0), PORT, count=400)
    assert drawn.tacks.mean() > 1.0
    assert drawn.has_touched.mean() < 0.02, "who does not reckon with it touches in 11 %"


# -------------------------------------------------------------------------------------------- effort
def test_what_it_takes_ends_with_its_budget_and_it_says_how_far_it_is():
    policy = solve(problem(), WANDERING, cell_m=8.0, budget_s=0.01)
    assert policy.rounds < solve(problem(), WANDERING, cell_m=8.0).rounds
    assert policy.change_s > 1.0


def test_a_budget_that_ends_first_is_told():
    hurried = solve(problem(), WANDERING, cell_m=10.0, budget_s=1e-9)
    assert hurried.rounds == 0
    assert not hurried.is_settled
    assert math.isinf(hurried.time_to_go_s((0.0, 0.0), 0.0))
    assert solve(problem(), WANDERING, cell_m=10.0).is_settled

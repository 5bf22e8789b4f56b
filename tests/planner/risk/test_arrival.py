"""Quantiles of arrival: against an independent simulation, in order, and honest about what is not known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import Boat, ardurover_sitl, avalon
from companion.errors import InputError
from companion.planner import Problem, plan
from companion.planner.explain import explain
from companion.planner.plan import Plan
from companion.planner.problem import defect_of, evaluate
from companion.planner.risk.arrival import _Averaged, _smear, arrival, in_words, limits_in_words
from tests.planner.problem_json import to_dict

BOAT = Boat(polar=ardurover_sitl())


def problem(tws=5.0, sigma=1.0, tau=60.0, goal=(600.0, 0.0), *, known=True, boat=BOAT, sigma_deg=0.0, **more):
    spread = (
        {"model": "kalman", "sigma0_deg": sigma_deg, "growth_deg_per_sqrt_s": 0.0} if sigma_deg else {"model": "none"}
    )
    return Problem.from_json(
        {
            "start": {"x": 0, "y": 0, "heading_deg": 90},
            "goal": {"x": goal[0], "y": goal[1], "radius": 1},
            "obstacles": [],
            "delta_s": 0.9,
            "wind": {
                "from_deg": 0,
                "speed_mps": tws,
                "sigma": spread,
                "strength": {
                    "horizon_s": [0.0, 600.0],
                    "mean_mps": [tws, tws],
                    "sigma_mps": [sigma, sigma],
                    "correlation_s": tau,
                    "known": known,
                },
            },
            "boat": boat.problem_boat(tws) | {"speeds": boat.problem_speeds()} | more,
        }
    )


def reach(p):
    """Return the legs of a straight reach."""
    return evaluate(p, [p.start_en, p.goal_en]).legs


def simulated(tws, sigma, tau, length_m, planned_s, count=4000, step_s=0.5):
    """Return the arrival in drawn winds, second by second, by the polar itself."""
    polar, rng = ardurover_sitl(), np.random.default_rng(1)
    speeds = np.array([polar.speed_mps(math.pi / 2.0, w) for w in np.linspace(0.0, 15.0, 601)])
    x, phi = rng.standard_normal(count), math.exp(-step_s / tau)
    done, out, t = np.zeros(count), np.full(count, math.inf), 0.0
    while t < 5.0 * planned_s and not np.all(np.isfinite(out)):
        wind = np.clip(tws + sigma * x, 0.0, 15.0)
        v = np.interp(wind, np.linspace(0.0, 15.0, 601), speeds)
        v = np.where(wind < 3.0, v * wind / 3.0, v)  # the polar begins at 3 m/s
        ends = np.isinf(out) & (done + v * step_s >= length_m)
        out[ends] = t + (length_m - done[ends]) / v[ends]
        done += v * step_s
        x = phi * x + math.sqrt(1.0 - phi * phi) * rng.standard_normal(count)
        t += step_s
    return np.quantile(out, [0.1, 0.5, 0.9])


def test_a_boat_whose_speeds_may_be_off_spreads_its_arrivals_by_that():
    """In a wind that does not spread, its quantiles are those of the factor alone."""
    p = problem(sigma=1e-3, boat=replace(BOAT, speed_error=0.35))
    planned_s = reach(p)[-1].end_s
    found = arrival(p, reach(p))
    for quantile, z in ((found.early_s, -0.6408), (found.median_s, 0.0), (found.late_s, 1.2816)):
        assert quantile == pytest.approx(planned_s * math.exp(0.35 * z), rel=0.02)


def test_a_boat_that_is_seen_to_make_half_of_its_speeds_takes_twice_the_time():
    p = problem()
    seen = replace(p, boat=replace(p.boat, speed_share=0.5))
    for name in ("early_s", "median_s", "late_s"):
        assert getattr(arrival(seen, reach(p)), name) == pytest.approx(2.0 * getattr(arrival(p, reach(p)), name))


@pytest.mark.parametrize(
    ("tws", "sigma", "tau"), [(5.0, 1.0, 5.0), (5.0, 1.5, 60.0), (4.0, 1.0, 600.0), (8.0, 2.0, 20.0)]
)
def test_the_quantiles_are_those_of_an_independent_simulation(tws, sigma, tau):
    p = problem(tws, sigma, tau)
    found = arrival(p, reach(p))
    truth = simulated(tws, sigma, tau, 600.0, reach(p)[-1].end_s)
    stated = [found.early_s, found.median_s, found.late_s]
    assert stated == pytest.approx(list(truth), rel=0.05)


def test_less_wind_costs_more_than_more_wind_gains():
    p = problem(4.0, 1.5, 600.0)
    found, planned = arrival(p, reach(p)), reach(p)[-1].end_s
    assert found.late_s - found.median_s > 1.5 * (found.median_s - found.early_s)
    assert found.late_s > planned > found.early_s


@settings(max_examples=25)
@given(
    tws=st.floats(1.0, 12.0),
    share=st.floats(0.0, 0.6),
    tau=st.floats(1.0, 3000.0),
    turn=st.floats(0.0, 20.0),
    fails=st.floats(0.0, 0.5),
)
def test_quantiles_are_in_order_and_the_same_when_asked_again(tws, share, tau, turn, fails):
    p = problem(tws, share * tws, tau, goal=(300.0, 300.0), sigma_deg=turn, tack_fails=fails)
    legs = evaluate(p, [p.start_en, (200.0, 0.0), p.goal_en]).legs
    found = arrival(p, legs)
    assert 0.0 < found.early_s <= found.median_s <= found.late_s
    assert arrival(p, legs) == found


def test_no_spread_no_turn_is_the_plans_own_time_and_tacks_that_fail_take_longer():
    sure = problem(sigma=0.0)
    found = arrival(sure, reach(sure))
    assert [found.early_s, found.late_s] == pytest.approx([reach(sure)[-1].end_s] * 2, rel=0.01)
    beat = problem(sigma=0.0, goal=(0.0, 300.0))
    failing = replace(beat, boat=replace(beat.boat, tack_fails=0.3))
    legs = plan(beat, expansions=5000).legs
    assert arrival(failing, legs).late_s > arrival(beat, legs).late_s + 10.0


def test_a_problem_that_says_nothing_of_the_strength_promises_nothing_of_the_time():
    p = problem()
    silent = replace(p, wind=replace(p.wind, strength=None))
    assert arrival(silent, reach(silent)) is None
    assert "arrival" not in plan(silent, expansions=2000).to_dict()


def test_what_is_not_known_is_said_and_makes_late_later():
    p = problem(5.0, 1.2, 60.0)
    assert [d[:24] for d in arrival(p, reach(p)).doubts] == ["her polar begins at 3.0 "]
    whole = problem(5.0, 1.2, 60.0, boat=Boat(polar=avalon()))  # from no wind at all
    assert arrival(whole, reach(whole)).doubts == ()
    assumed = problem(5.0, 1.2, 60.0, boat=Boat(polar=avalon()), known=False)
    assert "assumed" in in_words(arrival(assumed, reach(assumed)), 100.0)
    low = problem(2.5, 0.8, 300.0)
    linear = replace(
        low.boat.speeds, tws_mps=(0.0, *low.boat.speeds.tws_mps), v_mps=((0.0,) * 73, *low.boat.speeds.v_mps)
    )
    as_if = replace(low, boat=replace(low.boat, speeds=linear))
    assert arrival(low, reach(low)).late_s > 1.05 * arrival(as_if, reach(as_if)).late_s
    bare = replace(p, boat=replace(p.boat, speeds=None))
    assert any("goes with" in d or "go with" in d for d in arrival(bare, reach(bare)).doubts)


def test_a_wind_that_dies_may_never_bring_her_there():
    p = problem(0.6, 0.6, 1e5)
    found = arrival(p, reach(p))
    assert math.isinf(found.late_s)
    plan_of = Plan.from_dict(plan(p, expansions=2000).to_dict())
    assert math.isinf(plan_of.arrival.late_s)
    assert "later than" in in_words(found, 100.0)


def test_the_boats_limits_are_chance_constraints():
    calm, windy = problem(7.0, 0.5, max_tws_mps=10.0, min_tws_mps=2.0), problem(9.5, 1.0, max_tws_mps=10.0)
    assert limits_in_words(calm, arrival(calm, reach(calm))) == ""
    assert arrival(windy, reach(windy)).over_max == pytest.approx(0.3085, abs=1e-3)  # half a sigma
    said = explain(windy, plan(windy, expansions=2000), expansions=500).why.text
    assert "Not to be sailed: more wind than 10 m/s with 31 %" in said
    light = problem(1.5, 0.5, min_tws_mps=2.0)
    assert "less wind than 2 m/s" in limits_in_words(light, arrival(light, reach(light)))


def test_a_problem_is_written_and_read_the_same():
    p = problem(max_tws_mps=10.0, min_tws_mps=2.0, tack_fails=0.1, irons_s=14.0, lee_mps=[0.5, 0.25])
    again = Problem.from_json(to_dict(p))
    assert (again.boat.irons_s, again.boat.lee_mps) == (14.0, (0.5, 0.25))
    assert again.wind.strength == p.wind.strength
    assert again.boat.speeds.v_mps == p.boat.speeds.v_mps
    assert (again.boat.max_tws_mps, again.boat.min_tws_mps, again.boat.tack_fails) == (10.0, 2.0, 0.1)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tack_fails": 1.0}, "tack_fails"),
        ({"max_tws_mps": 0.0}, "limit of wind"),
        ({"max_tws_mps": 3.0, "min_tws_mps": 4.0}, "min_tws_mps"),
        ({"irons_s": -1.0}, "irons_s"),
        ({"lee_mps": [0.1]}, "lee_mps"),
        ({"lee_mps": [0.1, -0.1]}, "lee_mps"),
    ],
)
def test_nonsense_is_a_defect(change, said):
    assert said in defect_of(problem(**change))


def test_a_table_of_the_wrong_shape_is_one_clear_line():
    raw = to_dict(problem())
    raw["wind"]["strength"]["sigma_mps"] = [1.0]
    with pytest.raises(InputError, match=r"wind.strength.*differ in length"):
        Problem.from_json(raw)
    raw = to_dict(problem())
    raw["boat"]["speeds"]["v_mps"] = [[1.0, 2.0]]
    with pytest.raises(InputError, match=r"boat.speeds"):
        Problem.from_json(raw)


def lasting(p, *shares):
    """Return the legs of a straight reach as those of a path with these angles to the wind, of equal times."""
    (leg,) = reach(p)
    part_s = leg.end_s / len(shares)
    return [
        replace(leg, twa_rad=math.radians(twa_deg), start_s=i * part_s, end_s=(i + 1) * part_s)
        for i, twa_deg in enumerate(shares)
    ]


def test_what_one_speed_may_be_off_by_spreads_a_leg_and_less_of_a_path_of_many_angles():
    def spread(error, *angles_deg):
        p = problem(sigma=1e-3, boat=BOAT)
        p = replace(p, boat=replace(p.boat, shape_error=(error,) * 7))
        found = arrival(p, lasting(p, *angles_deg))
        return math.log(found.late_s / found.early_s) / (2.0 * 1.2816)

    one, alike, apart = spread(0.2, 90.0), spread(0.2, 90.0, 100.0), spread(0.2, 45.0, 90.0, 135.0, 180.0)
    assert one == pytest.approx(0.2, rel=0.1)
    assert alike == pytest.approx(0.2, rel=0.12)
    # Five-and-thirty degrees are what speeds are off alike over: of four angles a right angle or half of one apart.
    nodes = np.radians([45.0, 90.0, 135.0, 180.0])
    like = np.exp(-0.5 * (np.subtract.outer(nodes, nodes) / math.radians(35.0)) ** 2)
    assert apart == pytest.approx(0.2 * math.sqrt(like.mean()), rel=0.2)
    assert spread(0.0, 90.0) < 0.01


def test_a_leg_has_the_doubt_of_its_own_angle():
    p = problem(sigma=1e-3)
    p = replace(p, boat=replace(p.boat, shape_error=(0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0)))
    wide, narrow = (arrival(p, lasting(p, twa_deg)) for twa_deg in (90.0, 150.0))
    assert wide.late_s > 1.3 * narrow.late_s


def test_a_shape_error_of_another_length_is_refused():
    p = problem()
    for wrong in ((0.1,), (0.1,) * 6 + (1.5,), (-0.1,) * 7):
        assert "shape_error is not 7 numbers" in defect_of(replace(p, boat=replace(p.boat, shape_error=wrong)))
    assert defect_of(replace(p, boat=replace(p.boat, shape_error=(0.1,) * 7))) == defect_of(p)


@pytest.mark.parametrize("a", [3e-4, 9e-4, 2e-3, 0.05, 0.7, 4.0])
def test_the_mean_over_a_step_has_the_variance_and_the_memory_of_such_a_process(a):
    """Of a Gauss-Markov process, integrated over two steps that follow each other."""
    x, w = np.polynomial.legendre.leggauss(60)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    share = float(np.sum(w * 2.0 * (1.0 - x) * np.exp(-a * x)))
    next_one = float(np.sum(w * x * np.exp(-a * x)) + np.sum(w * (1.0 - x) * np.exp(-a * (1.0 + x))))
    found = _Averaged.of(a * 60.0, 60.0)
    assert found.share == pytest.approx(share, rel=1e-6)
    assert found.keep == pytest.approx(next_one / share, abs=4e-4)
    drawn = found.drawn(np.random.default_rng(1).standard_normal((40, 20_000)))
    assert drawn.std(axis=1) == pytest.approx(np.ones(40), abs=0.03)
    assert np.mean(drawn[20] * drawn[21]) == pytest.approx(found.keep, abs=0.03)


@pytest.mark.parametrize("bearing_deg", [50.0, 75.0, 120.0, 165.0, -120.0])
def test_in_a_wind_that_does_not_spread_she_arrives_when_the_plan_says(bearing_deg):
    to = math.radians(bearing_deg)
    p = problem(sigma=0.0, goal=(600.0 * math.sin(to), 600.0 * math.cos(to)))
    found, planned_s = arrival(p, reach(p)), reach(p)[-1].end_s
    assert (found.early_s, found.late_s) == (pytest.approx(planned_s, rel=3e-4), pytest.approx(planned_s, rel=3e-4))


def test_a_tack_that_seldom_fails_takes_no_time_in_most_winds():
    p = problem(sigma=0.0, goal=(0.0, 300.0), tack_fails=0.01)
    legs = evaluate(p, [(0.0, 0.0), (150.0, 150.0), (0.0, 300.0)]).legs
    found, sure = (arrival(replace(p, boat=replace(p.boat, tack_fails=f)), legs) for f in (0.01, 0.0))
    assert (found.early_s, found.median_s) == (
        pytest.approx(sure.early_s, abs=1e-6),
        pytest.approx(sure.median_s, abs=1),
    )


def test_where_she_may_never_arrive_the_boats_limit_is_asked_for_five_times_the_plans_time():
    p = problem(0.6, 0.6, 1e5, max_tws_mps=4.0)
    planned_s = reach(p)[-1].end_s
    strength = replace(
        p.wind.strength,
        horizon_s=(0.0, planned_s, 4.9 * planned_s, 5.1 * planned_s),
        mean_mps=(0.6,) * 4,
        sigma_mps=(0.6, 0.6, 0.6, 5.0),
    )
    p = replace(p, wind=replace(p.wind, strength=strength))
    found = arrival(p, reach(p))
    assert math.isinf(found.late_s)
    assert found.over_max == pytest.approx(strength.over(4.0, 5.0 * planned_s))
    assert found.over_max > 10.0 * strength.over(4.0, 4.9 * planned_s)


def test_what_is_smeared_is_weighed_by_the_normal_density():
    nodes = np.linspace(-2.0, 2.0, 9)
    weights = _smear(nodes, 0.8)
    assert weights.sum(axis=1) == pytest.approx(np.ones(9))
    for n in range(9):
        assert weights[n] / weights[n, n] == pytest.approx(
            [math.exp(-0.5 * ((x - nodes[n]) / 0.8) ** 2) for x in nodes]
        )
    assert (_smear(nodes, 0.1) == np.eye(9)).all()

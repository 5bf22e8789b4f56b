"""What a problem is made of: speeds in every wind, how strong it may be, room to turn; and what of it is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.messages import Target
from companion.planner import Problem
from companion.planner.problem.parts import BoatLimits, Sigma, Speeds, Strength, assumed
from companion.planner.problem.tracking import Tracking
from companion.planner.problem.value import defect_of
from tests.planner.problems import box, simple

TABLE = Speeds(tws_mps=(2.0, 6.0), twa_rad=(0.0, 1.0, 2.0), v_mps=((0.0, 1.0, 2.0), (0.4, 3.0, 5.0)))


@pytest.mark.parametrize(
    ("twa", "tws", "speed"),
    [
        (1.0, 2.0, 1.0),
        (-1.0, 6.0, 3.0),  # either side of the wind
        (1.5, 6.0, 4.0),  # half way between two angles
        (1.0, 4.0, 2.0),  # and two winds
        (1.25, 3.0, 1.25 + 0.25 * (3.5 - 1.25)),  # a quarter of the way between both
        (2.5, 6.0, 5.0),  # beyond the last angle as there
        (1.0, 20.0, 3.0),  # and above the last wind
        (1.0, 1.0, 0.25),  # below the first by the square of the wind
        (1.0, 0.0, 0.0),
    ],
)
def test_a_boats_speed_is_linear_between_what_was_measured_and_falls_by_the_square_below_it(twa, tws, speed):
    assert float(TABLE.at(twa, tws)) == pytest.approx(speed)
    assert TABLE.at([twa, twa], tws).tolist() == pytest.approx([speed, speed])


def test_a_table_from_no_wind_on_and_one_of_one_wind():
    assert float(replace(TABLE, tws_mps=(0.0, 6.0)).at(1.0, 3.0)) == pytest.approx(2.0)
    single = Speeds(tws_mps=(4.0,), twa_rad=(0.0, 2.0), v_mps=((0.0, 2.0),))
    assert single.at(1.0, [2.0, 4.0, 9.0]).tolist() == pytest.approx([0.25, 1.0, 1.0])
    assert TABLE.is_sound
    for bad in (-1.0, math.nan, math.inf):
        assert not replace(TABLE, v_mps=((0.0, 1.0, 2.0), (0.4, bad, 5.0))).is_sound


RISING = Strength(horizon_s=(0.0, 600.0), mean_mps=(6.0, 10.0), sigma_mps=(1.0, 2.0))


def test_more_wind_than_a_limit_is_as_likely_as_at_the_worst_instant_until_then():
    """One standard deviation is 15.87 %; the wind rises, so more is likeliest at the end and less at the beginning."""
    one = 0.158655
    assert RISING.over(7.0, 0.0) == pytest.approx(one, abs=1e-5)
    assert RISING.over(12.0, 600.0) == pytest.approx(one, abs=1e-5)
    assert RISING.over(9.5, 300.0) == pytest.approx(one, abs=1e-5)
    assert RISING.under(5.0, 0.0) == RISING.under(5.0, 600.0) == pytest.approx(one, abs=1e-5)
    assert RISING.over(6.0, -5.0) == pytest.approx(0.5)
    sure = Strength(horizon_s=(0.0,), mean_mps=(6.0,), sigma_mps=(0.0,))
    assert [sure.over(5.9, 10.0), sure.over(6.1, 10.0), sure.under(5.9, 10.0), sure.under(6.1, 10.0)] == [1, 0, 0, 1]


def test_a_wind_of_which_only_the_mean_is_known_spreads_by_a_quarter_of_it():
    wind = assumed(8.0)
    assert (wind.mean_at(99.0), wind.sigma_at(99.0), wind.is_known) == (8.0, 2.0, False)
    assert RISING.mean_at([300.0, 9e9]).tolist() == [8.0, 10.0]
    assert RISING.sigma_at([300.0, 9e9]).tolist() == [1.5, 2.0]
    assert RISING.is_sound
    assert not replace(RISING, correlation_s=0.0).is_sound
    assert not replace(RISING, sigma_mps=(1.0, -0.1)).is_sound
    assert not replace(RISING, mean_mps=(math.nan, 1.0)).is_sound


def test_the_spread_of_the_wind_by_each_model():
    kalman = Sigma(model="kalman", sigma0_rad=0.3, growth_rad_per_sqrt_s=0.04)
    assert (kalman.at(0.0), kalman.at(100.0)) == (0.3, pytest.approx(0.5))
    ar1 = Sigma(model="ar1", sigma0_rad=0.1, sigma_inf_rad=0.3, rho_hz=0.01)
    assert ar1.at(50.0) == pytest.approx(math.sqrt(0.09 - 0.08 / math.e))
    table = Sigma(model="forecast", horizon_s=(0.0, 10.0), sigma_rad=(0.1, 0.2), half_width_rad=(0.4, 0.9))
    assert (table.at(5.0), table.at(99.0), Sigma().at(5.0)) == (pytest.approx(0.15), 0.2, 0.0)
    wind = {"from_deg": 0, "sigma": {"model": "none"}}
    problem = Problem.from_json(simple(wind=wind))
    problem = replace(problem, wind=replace(problem.wind, sigma=table))
    assert problem.no_go_half_rad(5.0) - problem.boat.no_go_half_rad == pytest.approx(0.65)  # the widening itself
    assert problem.is_time_varying


def boat(**changes):
    limits = {"no_go_half_rad": 0.8, "turn_rate_radps": 0.5, "polar_twa_rad": (0.0, 3.1), "polar_mps": (1.0, 2.0)}
    return BoatLimits(**(limits | changes))


def test_a_boat_that_pays_for_a_tack_a_gybe_or_has_none_needs_room_to_turn_the_long_way_round():
    assert boat().room_m == 0.0
    radii = 2.0 * math.tan(math.radians(67.5))  # from close-hauled to dead down wind and on
    for change in ({"tack_loss_s": 1.0}, {"gybe_loss_s": 1.0}, {"can_tack": False}):
        assert boat(**change).room_m == pytest.approx(radii * 2.0 / 0.5, rel=0.05)
        assert boat(**change, gybe_room_m=7.0).room_m == 7.0
    assert boat().most_turn_rad == math.pi > boat(can_tack=False).most_turn_rad > 0.9 * math.pi


SOUND = Problem.from_json(simple())


def with_boat(**changes):
    return replace(SOUND, boat=replace(SOUND.boat, **changes))


@pytest.mark.parametrize(
    "problem",
    [
        replace(SOUND, goal_radius_m=0.0),
        replace(SOUND, delta_s=0.5),
        with_boat(no_go_half_rad=0.0),
        with_boat(tack_fails=0.99, speed_error=1.0, speed_share=0.1),
        with_boat(max_tws_mps=5.0, min_tws_mps=4.9),
        replace(SOUND, start_en=(1e9, 0.0)),
    ],
)
def test_what_is_just_within_is_planned(problem):
    assert defect_of(problem) is None


@pytest.mark.parametrize(
    ("problem", "says"),
    [
        (with_boat(no_go_half_rad=-0.1), "no-go half angle"),
        (with_boat(max_twa_rad=0.0), "max_twa_deg"),
        (with_boat(polar_mps=(1.0, -0.1)), "negative speed"),
        (with_boat(tack_loss_s=-1.0), "loss"),
        (with_boat(gybe_loss_s=-1.0), "loss"),
        (with_boat(gybe_room_m=-1.0), "gybe_room_m"),
        (with_boat(tack_fails=1.0), "tack_fails"),
        (with_boat(tack_fails=-0.1), "tack_fails"),
        (with_boat(speed_error=1.1), "speed_error"),
        (with_boat(speed_share=0.09), "speed_share"),
        (with_boat(speed_share=11.0), "speed_share"),
        (with_boat(irons_s=math.inf), "irons_s"),
        (with_boat(irons_s=-1.0), "irons_s"),
        (with_boat(lee_mps=(0.1,)), "lee_mps"),
        (with_boat(lee_mps=(0.1, math.inf)), "lee_mps"),
        (with_boat(max_tws_mps=0.0), "limit of wind"),
        (with_boat(min_tws_mps=math.inf), "limit of wind"),
        (with_boat(max_tws_mps=5.0, min_tws_mps=5.0), "min_tws_mps"),
        (replace(SOUND, start_en=(1.1e9, 0.0)), "local frame"),
        (replace(SOUND, goal_en=(0.0, -1.1e9)), "local frame"),
        (replace(SOUND, obstacles=(shapely.box(0.0, 0.0, 1.0, 2e9),)), "local frame"),
        (replace(SOUND, clearance_floor_m=-0.1), "clearance floor"),
        (replace(SOUND, leg_saving=-0.1), "leg_saving"),
        (replace(SOUND, known_en=((0.0, math.nan),)), "known"),
        (replace(SOUND, fence=shapely.Polygon()), "the fence is empty"),
        (replace(SOUND, fence=shapely.box(-4, -4, 4, 4), clearance_floor_m=5.0), "less the clearance floor"),
        (replace(SOUND, vessels_part=0.4), "allocation"),
        (replace(SOUND, vessels_part=0.0), "allocation"),
        (replace(SOUND, targets=(Target(x_m=0.0, y_m=math.nan, radius_m=1.0),)), "targets"),
        (replace(SOUND, current=replace(SOUND.current, drift_mps=-0.1)), "drift"),
        (replace(SOUND, adrift=replace(SOUND.current, drift_mps=-0.1)), "drift"),
    ],
)
def test_what_cannot_be_is_refused_by_its_name(problem, says):
    assert says in (defect_of(problem) or "")


def test_the_floor_grows_rocks_and_shrinks_the_fence_and_what_is_outside_is_solid():
    problem = Problem.from_json(
        simple(obstacles=[box(20, 0, 30, 10)], fence=box(-60, -40, 60, 200), clearance_floor_m=3.0)
    )
    assert problem.obstacle_union.bounds == pytest.approx((17.0, -3.0, 33.0, 13.0))
    assert problem.fence_polygon.bounds == pytest.approx((-57.0, -37.0, 57.0, 197.0))
    for place, is_solid in (((0, 0), False), ((18, 5), True), ((-58, 0), True), ((-150, 0), True), ((0, 300), True)):
        assert problem.solid.intersects(shapely.Point(place)) is is_solid
        assert problem.eval_solid.intersects(shapely.Point(place)) is is_solid
    assert [problem.obstacle_name(0), replace(problem, obstacle_names=("Rock",)).obstacle_name(0)] == [
        "obstacle 1",
        "Rock",
    ]
    assert np.isfinite(problem.no_go_max_rad)


def test_a_tracks_distance_is_to_rocks_and_to_the_line_of_its_limits():
    """Inside a rock it is 0, and from the limits' line it counts on either side: both are no water."""
    bow_tie = shapely.Polygon([(60, 0), (70, 10), (60, 10), (70, 0)])  # drawn across itself, it is solid all the same
    track = Tracking(
        helm=None,
        floor_m=1.0,
        solids=(shapely.box(20, 0, 30, 10), shapely.Polygon(), bow_tie),
        limits=shapely.box(-100, -100, 100, 100),
    )
    places = np.array([(10.0, 5.0), (25.0, 5.0), (0.0, 97.0), (0.0, 104.0), (65.0, 12.0)])
    assert track.distance_m(places).tolist() == pytest.approx([10.0, 0.0, 3.0, 4.0, 2.0])
    assert [float(track.tree.geometries.take(0).distance(shapely.Point(10, 5))), len(track.tree)] == [10.0, 3]
    open_water = replace(track, solids=(), limits=None)
    assert open_water.distance_m(places).tolist() == [math.inf] * 5
    assert len(replace(track, limits=shapely.Polygon()).tree) == 2


@pytest.mark.parametrize(
    "bad", [{"floor_m": -0.1}, {"reach_m": math.nan}, {"correlation_s": -1.0}, {"before_en": (0.0, math.inf)}]
)
def test_a_track_of_numbers_that_are_none_is_refused(bad):
    track = Tracking(helm=None, floor_m=0.0, before_en=(1.0, 2.0))
    assert track.is_finite
    assert not replace(track, **bad).is_finite

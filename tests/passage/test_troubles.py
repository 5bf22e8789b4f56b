"""What other programs of this kind got wrong, one test each."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely

from companion.boat import Polar, constant
from companion.passage import Outcome, PassageFrame, plan
from companion.passage.kernels import made_good
from companion.passage.plan import widest_rooms_m
from tests.passage.world import HOURS, LAT, LON, T0, cube, passage, place, steady

WALL = shapely.box(0.45, -3.0, 0.47, 3.0)  # from edge to edge, 2 km thick
A, B = place(0.0, 0.0), place(0.0, 0.9)


def test_no_edge_steps_over_a_wall_that_no_node_stands_on():
    """Nodes are 3.3 km apart, the wall is 20 m."""
    thin = shapely.box(0.4501, -3.0, 0.4503, 3.0)
    assert plan(passage(A, B, land=[thin]), T0, nodes=30).outcome is Outcome.NO_WATER


def test_what_goes_one_way_round_an_island_goes_back():
    """A to B right, and B to A over land."""
    island = shapely.box(0.40, -0.05, 0.50, 0.30)
    times = []
    for start, goal in ((A, B), (B, A)):
        asked = passage(start, goal, land=[island])
        route = plan(asked, T0, nodes=40)
        assert asked.land.is_free(asked.frame.xy_from_geo(*route.sailed.places.T))
        times.append(route.time_s)
    assert times[0] == pytest.approx(times[1], rel=2e-3)


@pytest.mark.parametrize("margin_m", [500.0, 4000.0])
def test_the_margin_is_kept_by_what_is_sailed(margin_m):
    """Over Tonga with a margin of half a mile; the last leg is held against the land as every other."""
    island = shapely.box(0.84, -0.02, 0.86, 0.10)
    asked = passage(A, B, land=[island], margin_m=margin_m)
    route = plan(asked, T0, nodes=40)
    bare = passage(A, B, land=[island])
    sailed = bare.frame.xy_from_geo(*route.sailed.places.T)
    dense = np.concatenate([np.linspace(p, q, 20) for p, q in pairwise(sailed)])
    assert bare.land.distance_m(dense).min() > margin_m - 20.0


def test_the_end_of_the_forecast_is_not_land():
    asked = passage(A, B, wind=cube(LAT, LON, [0.0, 3.0, 6.0], steady(0.0, -5.0)))
    assert plan(asked, T0, nodes=30).outcome is Outcome.NO_WEATHER


def test_a_goal_that_the_forecast_does_not_reach_is_not_land():
    asked = passage(A, B, wind=cube(LAT, np.linspace(-2.0, 0.5, 26), HOURS, steady(0.0, -5.0)))
    assert plan(asked, T0, nodes=30).outcome is Outcome.NO_WEATHER


def test_too_much_wind_is_said_and_gone_round():
    blow = lambda t, y, x: (0.0 * x, np.where((x > 0.3) & (x < 0.6) & (y < 0.4), -20.0, -8.0))  # noqa: E731
    free = plan(passage(A, B, wind=cube(LAT, LON, HOURS, blow)), T0, nodes=40)
    asked = passage(A, B, wind=cube(LAT, LON, HOURS, blow), max_tws_mps=12.0)
    round_it = plan(asked, T0, nodes=40)
    assert free.sailed.strongest_mps > 15.0
    assert round_it.sailed.arrived
    assert round_it.sailed.strongest_mps <= 12.0
    assert round_it.time_s > 1.05 * free.time_s
    everywhere = passage(A, B, wind=cube(LAT, LON, HOURS, steady(0.0, -20.0)), max_tws_mps=12.0)
    assert plan(everywhere, T0, nodes=30).outcome is Outcome.TOO_MUCH


def heights(field):
    """A cube of one component."""
    pair = cube(LAT, LON, HOURS, lambda t, y, x: (field(t, y, x), 0.0 * x))
    return replace(pair, values=np.ascontiguousarray(pair.values[..., :1]))


def test_a_sea_that_is_too_high_is_said_and_gone_round_and_what_is_not_known_of_it_is_no_limit():
    sea = heights(lambda t, y, x: np.where((x > 0.3) & (x < 0.6) & (y < 0.4) & (y > -1.5), 6.0, 1.0) + 0.0 * x)
    free = plan(passage(A, B, waves=sea), T0, nodes=40)
    asked = passage(A, B, waves=sea, max_wave_m=3.0)
    round_it = plan(asked, T0, nodes=40)
    assert round_it.sailed.arrived
    assert round_it.time_s > 1.05 * free.time_s
    [through] = asked.sail((A, B), T0, (0,))
    assert (through.arrived, through.is_too_much, through.why) == (
        False, True, "the sea is higher than she is to be out in"
    )  # fmt: skip
    assert plan(passage(A, B, waves=heights(lambda t, y, x: 6.0 + 0.0 * x), max_wave_m=3.0), T0, nodes=30).outcome is (
        Outcome.TOO_MUCH
    )
    unknown = heights(lambda t, y, x: np.nan + 0.0 * x)
    assert plan(passage(A, B, waves=unknown, max_wave_m=3.0), T0, nodes=30).sailed.arrived


def test_a_lee_shore_is_kept_off_and_a_weather_shore_is_none():
    """The wind is from the north, an island to the south of the way or to the north of it."""
    wind = cube(LAT, LON, HOURS, steady(0.0, -10.0))
    south, north = shapely.box(0.3, -0.3, 0.6, -0.05), shapely.box(0.3, 0.05, 0.6, 0.3)
    times = {}
    for name, island in (("lee", south), ("weather", north)):
        asked = passage(A, B, wind=wind, land=[island], lee_shore_m=12_000.0, lee_tws_mps=8.0)
        route = plan(asked, T0, nodes=40)
        assert route.sailed.arrived
        times[name] = route.time_s
        xy = asked.frame.xy_from_geo(*route.sailed.places.T)
        beside = (xy[:, 0] > 40_000.0) & (xy[:, 0] < 60_000.0)
        off_m = asked.land.distance_m(xy[beside]).min()
        assert (off_m > 11_900.0) == (name == "lee")
        [straight] = asked.sail((A, B), T0, (0,))
        assert straight.arrived == (name == "weather")
    assert straight.why == ""
    assert times["lee"] > times["weather"]
    calm = passage(A, B, land=[south], lee_shore_m=12_000.0, lee_tws_mps=8.0)
    assert plan(calm, T0, nodes=40).time_s == pytest.approx(times["weather"], rel=1e-3)


def by_longitude(lon):
    east = (lon + 1.2 + 180.0) % 360.0 - 180.0
    wind = cube(np.linspace(-20.0, -14.0, 13), lon + np.linspace(-3.0, 4.0, 15), HOURS, steady(3.0, -4.0))
    island = shapely.box(lon + 0.5, -17.2, lon + 0.7, -16.95)
    asked = passage(place(-17.0, lon), place(-17.0, east), wind=wind, land=[island])
    return plan(asked, T0, nodes=30).time_s


def test_the_date_line_changes_nothing():
    there = by_longitude(60.0)
    assert 60_000.0 < there < 70_000.0
    for lon in (-0.5, 179.5, -179.5):
        assert by_longitude(lon) == pytest.approx(there, rel=1e-3)


def test_wind_above_the_polar_is_not_more_speed():
    polar = Polar(
        twa_rad=np.radians([50.0, 90.0, 180.0]),
        tws_mps=np.array([5.0, 10.0]),
        speed_mps_table=np.array([[1.0, 2.0]] * 3),
    )
    craft = passage(A, B, polar=polar).craft
    for tws, want in ((5.0, 1.0), (7.5, 1.5), (10.0, 2.0), (30.0, 2.0), (70.0, 2.0)):
        assert made_good(craft, 0.0, -tws, 0.0, 0.0, 1.0, 0.0) == pytest.approx(want, rel=2e-3)


def test_the_polar_wants_the_wind_over_the_water():
    """In a calm a stream of 3 m/s against her makes a wind of its own."""
    polar = Polar(
        twa_rad=np.radians([0.0, 180.0]), tws_mps=np.array([0.0, 3.0]), speed_mps_table=np.array([[0.0, 4.0]] * 2)
    )
    craft = passage(A, B, polar=polar).craft
    assert made_good(craft, 0.0, 0.0, -3.0, 0.0, 1.0, 0.0) == pytest.approx(1.0, rel=2e-3)
    assert made_good(craft, -3.0, 0.0, -3.0, 0.0, 1.0, 0.0) == 0.0


def test_a_stream_that_is_faster_than_she_is_waited_for():
    """A tidal gate: 3 m/s against her for six hours, then slack."""
    hours = [0.0, 3.0, 5.9, 6.0, 12.0, 24.0]
    stream = cube(LAT, LON, hours, lambda t, y, x: (np.where(t < 5.95 * 3600.0, -3.0, 0.0) + 0.0 * x, 0.0 * y))
    asked = passage(A, place(0.0, 0.3), stream=stream)
    route = plan(asked, T0, nodes=20)
    assert route.time_s == pytest.approx(6.0 * 3600.0 + asked.frame.length_m / 2.0, rel=0.04)
    assert route.sailed.hours("waiting") == pytest.approx(6.0, abs=0.6)


def test_at_night_she_may_heave_to():
    free, lies = (plan(passage(A, B, night_share=share), T0, nodes=20) for share in (1.0, 0.0))
    assert free.sailed.hours("night") == pytest.approx(5.57, abs=0.1)  # the sun is 6 degrees down until 05:34
    assert lies.time_s == pytest.approx(free.time_s + 3600.0 * lies.sailed.hours("waiting"), rel=1e-3)


def test_the_frame_is_exact_on_its_way_and_turns_vectors():
    frame = PassageFrame(place(52.0, 177.3), place(51.6, -177.1))
    ends = frame.xy_from_geo([52.0, 51.6], [177.3, -177.1])
    assert ends == pytest.approx(np.array([[0.0, 0.0], [frame.length_m, 0.0]]), abs=1e-3)
    lat, lon = frame.geo_from_xy([[1e5, 5e4]])
    east, north = frame.turned(np.array([3.0]), np.array([4.0]), lat, lon)
    assert np.hypot(east, north) == pytest.approx(5.0)
    step = frame.xy_from_geo(lat + 4e-5, lon + 3e-5 / np.cos(np.radians(lat))) - [[1e5, 5e4]]
    assert (step / np.hypot(*step[0]))[0] == pytest.approx([east[0] / 5.0, north[0] / 5.0], abs=2e-3)
    with pytest.raises(ValueError, match="one place"):
        PassageFrame(A, A)


@pytest.mark.parametrize("length_m", [1e4, 1e6, 5.5e6, 1.2e7, 1.88e7])
def test_the_widest_search_ends_before_the_frames_poles(length_m):
    """What lies beyond a pole of the frame, or is met again all round, would be two places in one."""
    side_m, ends_m = widest_rooms_m(length_m)
    assert 15_000.0 <= side_m < 0.48 * math.pi * 6_371_000.0
    assert ends_m >= 0.0
    assert length_m + 2.0 * ends_m < 1.9 * math.pi * 6_371_000.0


def test_a_slower_boat_is_later_in_the_same_share():
    from companion.passage import sail

    asked = passage(A, B, polar=constant(2.0))
    whole, half = sail(asked.weather, asked.craft, (A, B), T0, 1.0, (0,), (1.0, 0.5))
    assert half.time_s == pytest.approx(2.0 * whole.time_s, rel=1e-6)
    assert math.isfinite(whole.time_s)

"""Routes against solutions that are known: of closed form, or by other people's methods. The bound is below each."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.boat import Boat, Polar, ardurover_sitl, avalon
from companion.passage import Outcome, plan
from companion.weather import read_stations
from tests.passage.world import EAST_DEG_M, HOURS, LAT, LON, NORTH_DEG_M, T0, cube, passage, place, steady

H, V = 20_000.0, 2.0  # the length and the speed that the flows are scaled by


def flow(u, v, hours=HOURS):
    """A stream of (u, v) in units of V, of places in units of H and times in units of H / V."""
    return cube(
        LAT,
        LON,
        hours,
        lambda t, y, x: tuple(V * f(x * EAST_DEG_M / H, y * NORTH_DEG_M / H, t * V / H) + 0.0 * x for f in (u, v)),
    )


def solved(asked, want_s, error, *, nodes=60, gap=0.1):
    route = plan(asked, T0, nodes=nodes)
    assert route.outcome is Outcome.FOUND
    assert route.sailed.arrived
    assert route.time_s == pytest.approx(want_s, rel=error)
    assert route.time_s >= want_s * 0.999
    assert (1.0 - gap) * want_s < route.bound_s <= want_s
    return route


def test_a_uniform_current_is_set_off():
    """100 km east at 2 m/s over a stream of (0.3, 0.4): one leg, the bow to starboard of it."""
    asked = passage(place(0.0, 0.0), place(0.0, 1e5 / EAST_DEG_M), stream=cube(LAT, LON, HOURS, steady(0.3, 0.4)))
    assert len(solved(asked, 44_255.78, 2e-4).waypoints) == 2


def test_zermelos_problem():
    """u = -V y / h: headings turn from 105 to 240 degrees of x (Bryson and Ho 1975, section 2.7)."""
    start = place(-1.86370 * H / NORTH_DEG_M, 3.65866 * H / EAST_DEG_M)
    asked = passage(start, place(0.0, 0.0), stream=flow(lambda x, y, t: -y, lambda x, y, t: 0.0))
    solved(asked, (2.0 + 2.0 * math.sqrt(3.0)) * H / V, 0.01)


START = place(math.sin(math.pi / 6) * H / NORTH_DEG_M, math.cos(math.pi / 6) * H / EAST_DEG_M)
GOAL = place(H / NORTH_DEG_M, 0.0)


def test_a_stream_that_turns_about_a_point():
    """Techy 2011: the places that can be reached are a disc that turns with it."""
    asked = passage(START, GOAL, stream=flow(lambda x, y, t: 0.9 * y, lambda x, y, t: -0.9 * x))
    solved(asked, 1.9750 * H / V, 0.01)


def test_a_stream_that_turns_with_time():
    hours = np.arange(0.0, 4.5, 1.0 / 12.0)
    stream = flow(lambda x, y, t: -0.3 * x - (t - 0.5) * y, lambda x, y, t: (t - 0.5) * x - 0.3 * y, hours)
    solved(passage(START, GOAL, stream=stream), 1.0301 * H / V, 0.005)


@pytest.mark.parametrize("polar", [ardurover_sitl(), avalon()], ids=["ardurover", "avalon"])
def test_dead_to_windward_it_is_vmg_and_tacks(polar):
    """54 NM against 5 m/s, with a tack of 100 s after each board of 5 km."""
    way = passage(place(0.0, 0.0), place(0.9, 0.0)).frame.length_m
    best = polar.best_beat(5.0, no_go_half_rad=math.radians(47.0))
    asked = passage(place(0.0, 0.0), place(0.9, 0.0), polar=polar, no_go_deg=47.0)
    free = solved(asked, way / best.vmg_mps, 0.002)
    lossy = plan(passage(place(0.0, 0.0), place(0.9, 0.0), polar=polar, no_go_deg=47.0, tack_loss_s=100.0,
    board_m=5000.0),
                 T0, nodes=60)  # fmt: skip
    tacks = way / best.vmg_mps * best.speed_mps / 5000.0
    assert lossy.time_s - free.time_s == pytest.approx(100.0 * tacks, rel=0.02)
    assert free.sailed.hours("beating") == pytest.approx(free.time_s / 3600.0, rel=1e-3)


@pytest.mark.parametrize("polar", [ardurover_sitl(), avalon()], ids=["ardurover", "avalon"])
def test_with_leeway_it_makes_good_what_the_boat_does(polar):
    """To windward the best beat of the boat, leeway taken off; across the wind what plans of hours say."""
    boat = Boat(polar=polar, no_go_half_rad=math.radians(45.0), leeway_rad=math.radians(6.0))
    beat = boat.best_beat(5.0)
    assert beat.vmg_mps < 0.95 * polar.best_beat(5.0, no_go_half_rad=boat.no_go_half_rad).vmg_mps
    upwind = passage(place(0.0, 0.0), place(0.9, 0.0), polar=polar, no_go_deg=45.0, leeway_deg=6.0)
    solved(upwind, upwind.frame.length_m / beat.vmg_mps, 0.01)
    speeds = boat.problem_speeds()
    reach_mps = [row[speeds["twa_deg"].index(90.0)] for row in speeds["v_mps"]]
    across = passage(place(0.0, 0.0), place(0.0, 0.9), polar=polar, no_go_deg=45.0, leeway_deg=6.0)
    solved(across, across.frame.length_m / float(np.interp(5.0, speeds["tws_mps"], reach_mps)), 0.02)


def test_round_an_island_by_tangents_and_arc():
    way, radius = 100_000.0, 20_000.0
    turn = np.linspace(0.0, 2.0 * math.pi, 721)
    island = shapely.Polygon(
        np.stack(
            [0.5 * way / EAST_DEG_M + radius / EAST_DEG_M * np.cos(turn), radius / NORTH_DEG_M * np.sin(turn)], axis=-1
        )
    )
    half = 0.5 * way
    want_m = 2.0 * (math.sqrt(half**2 - radius**2) + radius * (math.pi / 2.0 - math.acos(radius / half)))
    asked = passage(place(0.0, 0.0), place(0.0, way / EAST_DEG_M), land=[island])
    route = plan(asked, T0, nodes=60)
    assert route.time_s == pytest.approx(want_m / V, rel=0.005)
    assert asked.land.is_free(asked.frame.xy_from_geo(*route.sailed.places.T))


def test_two_winds_side_by_side_refract_the_course():
    """Snell: twice the wind north of the line of the start, in a boat as fast as a fifth of it."""
    slow, fast = 1.0, 2.0
    polar = Polar(
        twa_rad=np.array([0.0, math.pi]), tws_mps=np.array([0.0, 10.0]), speed_mps_table=np.array([[0.0, 2.0]] * 2)
    )
    lat = np.array([-2.0, 0.0, 0.001, 2.0])
    wind = cube(lat, LON, HOURS, lambda t, y, x: (np.where(y > 0.0, 10.0, 5.0), 0.0 * x))
    south, north = place(-0.4, 0.0), place(0.4, 0.8)
    asked = passage(south, north, polar=polar, wind=wind)

    def time(x):
        return (
            math.hypot(0.4 * NORTH_DEG_M, x * EAST_DEG_M) / slow
            + math.hypot(0.4 * NORTH_DEG_M, (0.8 - x) * EAST_DEG_M) / fast
        )

    want = min(time(x) for x in np.linspace(0.0, 0.8, 2001))
    straight = time(0.4)
    assert straight > 1.02 * want
    solved(asked, want, 0.01)


def test_a_wind_of_time_only_is_waited_out_and_used():
    """It blows for 3 h from the side, is calm for 6, and blows again: a calm is a wait and no failure."""
    hours = [0.0, 3.0, 3.01, 9.0, 9.01, 30.0]
    blows = [5.0, 5.0, 0.0, 0.0, 5.0, 5.0]
    wind = cube(LAT, LON, hours, lambda t, y, x: (0.0 * x, -np.interp(t / 3600.0, hours, blows) + 0.0 * y))
    polar = Polar(
        twa_rad=np.array([0.0, math.pi]), tws_mps=np.array([0.0, 5.0]), speed_mps_table=np.array([[0.0, 2.0]] * 2)
    )
    asked = passage(place(0.0, 0.0), place(0.0, 43_200.0 / EAST_DEG_M), polar=polar, wind=wind)
    route = solved(asked, 12.0 * 3600.0, 0.01, gap=0.6)  # which knows not that she cannot be elsewhere in the calm
    assert route.sailed.hours("waiting") == pytest.approx(6.0, abs=0.6)


def test_a_tide_by_its_constants_is_a_stream_of_the_way():
    """Six hours along a tide of M2: the time of replay and plan is that of its integral."""
    text = """reach_km = 400.0
[[station]]
name = "mid"
lat = 0.0
lon = 0.2
[[station.stream]]
towards_deg = 90.0
waves = { M2 = [0.8, 200.0] }
"""
    a, b = place(0.0, 0.0), place(0.0, 43_200.0 / EAST_DEG_M)
    ready = passage(a, b)
    ready = replace(ready, weather=replace(ready.weather, tides=read_stations(text, "")))
    [sailed] = ready.sail((a, b), T0, (0,))
    t = T0 + np.arange(0.0, 40_000.0, 10.0)
    flow = ready.weather.current_en_mps(t, 0.0, 0.2)[:, 0]
    gone = np.cumsum((2.0 + flow) * 10.0)
    assert sailed.time_s == pytest.approx(10.0 * np.searchsorted(gone, 43_199.0), rel=2e-3)
    assert abs(sailed.time_s - 21_600.0) > 1500.0
    route = plan(ready, T0, nodes=20)
    assert route.time_s == pytest.approx(sailed.time_s, rel=2e-3)

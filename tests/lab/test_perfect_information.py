"""The clairvoyant against what can be worked out by hand, and against its own bound."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.boat.polar import ardurover_sitl, constant
from companion.errors import JobError
from lab.perfect_information import Race, RaceBoat, RaceMark, Weather, best
from sitl.world import AR1

VEER_RAD, VEERS_S = math.radians(20.0), 40.0


def steady(twd_rad=0.0, tws_mps=5.0):
    return Weather(t_s=np.array([0.0]), twd_from_rad=np.array([twd_rad]), tws_mps=np.array([tws_mps]))


def craft(tack_s, polar=None, no_go_deg=45.0):
    return RaceBoat(
        polar=polar or ardurover_sitl(),
        no_go_half_rad=math.radians(no_go_deg),
        max_twa_rad=math.pi,
        tack_s=tack_s,
        board_s=5.0,
    )


def race(weather, tack_s, length_m=150.0, **changes):
    return replace(
        Race(
            craft=craft(tack_s),
            weather=weather,
            start_en_m=(0.0, 0.0),
            solid=shapely.Polygon(),
            goals=(RaceMark(en_m=(0.0, length_m), radius_m=5.0),),
        ),
        **changes,
    )


@pytest.fixture(scope="module")
def unsteady():
    wind = AR1(0.0, 5.0, seed=3, sd_rad=math.radians(15.0))
    t_s = np.arange(0.0, 200.0, 0.25)
    twd, tws = np.array([wind.at(t) for t in t_s]).T
    return Weather(t_s=t_s, twd_from_rad=twd, tws_mps=tws)


@pytest.mark.parametrize("tack_s", [0.4, 3.0])
def test_a_beat_in_a_steady_wind_takes_its_length_over_the_speed_made_good_and_one_tack(tack_s):
    found = best(race(steady(), tack_s), 300.0)
    beat_s = 145.0 / ardurover_sitl().best_beat(5.0, no_go_half_rad=math.radians(45.0)).vmg_mps
    assert found.time_s == pytest.approx(beat_s + tack_s, rel=1e-3)
    assert found.bound_s == pytest.approx(beat_s, rel=1e-3)  # along the wind alone no tack is needed
    assert found.tacks == 1


def test_before_a_known_veer_she_sails_to_where_the_wind_will_come_from():
    """Free tacks: the goal must lie in the sum of what is reached before and after, so T = max over n of a quotient."""
    weather = Weather(
        t_s=np.array([0.0, VEERS_S, VEERS_S + 0.01]),
        twd_from_rad=np.array([0.0, 0.0, VEER_RAD]),
        tws_mps=np.full(3, 5.0),
    )
    n = np.linspace(-math.pi / 2.0, math.pi / 2.0, 2001)
    angles = np.radians(np.concatenate([np.linspace(-180.0, -45.0, 541), np.linspace(45.0, 180.0, 541)]))
    speeds = ardurover_sitl().speeds_mps(angles, 5.0)

    def most_mps(twd_rad):
        return np.max(speeds * np.cos(twd_rad + angles - n[:, None]), axis=1)

    by_hand_s = VEERS_S + np.max((150.0 * np.cos(n) - 5.0 - most_mps(0.0) * VEERS_S) / most_mps(VEER_RAD))
    found = best(race(weather, 0.0), 300.0)
    assert found.bound_s == pytest.approx(by_hand_s, rel=2e-3)
    assert found.time_s == pytest.approx(by_hand_s, rel=1e-2)
    there = np.searchsorted(found.track[:, 0], VEERS_S)
    assert found.track[there, 1] > 40.0  # far to the right by then: of its 57 m on port tack alone


def test_round_a_wall_it_is_the_shortest_way():
    wall = shapely.box(-200.0, 60.0, 40.0, 70.0)
    found = best(race(steady(math.pi), 0.0, craft=craft(0.0, constant(2.0), 0.0), solid=wall, clear_m=0.5), 300.0)
    # from the start over both corners to the goal's edge
    shortest_m = math.hypot(40.0, 60.0) + 10.0 + math.hypot(40.0, 80.0) - 5.0
    assert found.time_s == pytest.approx(shortest_m / 2.0, rel=0.01)
    assert not shapely.LineString(found.track[:, 1:3]).intersects(wall)
    assert found.bound_s == pytest.approx(145.0 / 2.0, rel=2e-3)  # it knows of no wall


def test_a_track_can_be_sailed_and_is_between_bound_and_grid(unsteady):
    race_ = race(unsteady, 0.4)
    found = best(race_, 300.0)
    assert found.bound_s <= found.time_s <= found.coarser_s
    assert found.time_s / found.bound_s < 1.02
    t_s, places, side = found.track[:, 0], found.track[:, 1:3], found.track[:, 3]
    assert math.dist(places[-1], (0.0, 150.0)) == pytest.approx(5.0, abs=1e-6)
    for k in range(1, len(t_s)):
        took_s, way = t_s[k] - t_s[k - 1], places[k] - places[k - 1]
        twd, tws = unsteady.at(np.linspace(t_s[k - 1], t_s[k], 30))
        most_m = took_s * ardurover_sitl().speeds_mps(np.linspace(math.radians(45.0), math.pi, 200), tws.mean()).max()
        assert np.hypot(*way) <= most_m + 1e-6
        off = math.atan2(*way) - twd
        assert np.all(np.sign(np.sin(off)) == side[k])
        assert np.abs(np.angle(np.exp(1j * off))).mean() > math.radians(44.0)


def test_the_second_goal_comes_after_the_first():
    goals = (RaceMark(en_m=(100.0, 0.0), radius_m=5.0), RaceMark(en_m=(0.0, 0.0), radius_m=5.0))
    found = best(race(steady(), 0.4, start_en_m=(0.0, 0.0), goals=goals), 300.0)
    reach_s = 190.0 / ardurover_sitl().max_speed_mps(5.0)
    assert reach_s - 0.5 < found.time_s < 1.05 * (reach_s + 0.4)
    assert found.track[:, 1].max() > 94.0


def test_a_shut_way_is_told():
    ring = shapely.Point(0.0, 150.0).buffer(40.0).difference(shapely.Point(0.0, 150.0).buffer(30.0))
    with pytest.raises(JobError, match="within 150 s"):
        best(race(steady(), 0.4, solid=ring), 150.0)

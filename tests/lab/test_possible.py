"""What is possible without foresight lies between the clairvoyant's time and that of the mean wind."""

import math

import numpy as np
import pytest
import shapely

from companion.boat import ardurover_sitl
from lab.perfect_information import Race, RaceBoat, RaceMark, Weather, best
from lab.possible import policies, possible_s, shifts_of
from sitl.commands.run import scenario_file
from sitl.scenario import load_scenario
from sitl.world import AR1

UPWIND = load_scenario(scenario_file("upwind"))
SPREAD_RAD, TAU_S = math.radians(UPWIND.wind.sd_deg), UPWIND.wind.tau_s


def race(seed):
    """Return a beat of 300 m in the scenario's wind."""
    t_s = np.arange(0.0, 400.0, 1.0)
    wind = AR1(0.0, UPWIND.wind.tws_mps, seed=seed, sd_rad=SPREAD_RAD, rho_hz=1.0 / TAU_S)
    return Race(
        craft=RaceBoat(
            polar=ardurover_sitl(),
            no_go_half_rad=math.radians(45.0),
            max_twa_rad=math.radians(170.0),
            tack_s=1.0,
            board_s=1.0,
        ),
        weather=Weather(
            t_s=t_s,
            twd_from_rad=np.array([wind.at(float(t))[0] for t in t_s]),
            tws_mps=np.full(len(t_s), UPWIND.wind.tws_mps),
        ),
        start_en_m=(0.0, 0.0),
        goals=(RaceMark(en_m=(0.0, 300.0), radius_m=10.0),),
        solid=shapely.Polygon(),
    )


def test_it_lies_between_foresight_and_none():
    races = [race(seed) for seed in range(6)]
    known = np.mean([best(r, 400.0).time_s for r in races])
    possible = np.mean([possible_s(UPWIND, r, cell_m=6.0) for r in races])
    assert 1.0 < possible / known < 1.12


def test_legs_are_sailed_one_after_the_other():
    one = race(0)
    two = Race(
        craft=one.craft,
        weather=one.weather,
        start_en_m=one.start_en_m,
        goals=(*one.goals, RaceMark(en_m=(300.0, 300.0), radius_m=10.0)),
        solid=one.solid,
    )
    legs = policies(two, shifts_of(UPWIND), twd_from_rad=0.0, tws_mps=5.0, cell_m=8.0)
    assert len(legs) == 2
    onward_s = legs[1].time_to_go_s((0.0, 300.0), 0.0)
    assert onward_s > 60.0
    assert legs[0].time_to_go_s((0.0, 0.0), 0.0) == pytest.approx(
        policies(one, shifts_of(UPWIND), twd_from_rad=0.0, tws_mps=5.0, cell_m=8.0)[0].time_to_go_s((0.0, 0.0), 0.0)
        + onward_s,
        rel=0.02,
    )


@pytest.mark.parametrize("name", ["shift", "front"])
def test_of_a_wind_that_is_no_process_nothing_is_said(name):
    assert shifts_of(load_scenario(scenario_file(name))) is None

"""The wind dies: a mean is of what was measured, light winds included."""

import math
from pathlib import Path

import pytest

from companion.compose import config_of, permissions_of, voyage_of
from companion.fold import VoyageFold
from companion.geofence import load_mission
from companion.messages import VehicleState, WindSample
from companion.skipper import Skipper
from companion.skipper.step.snapshot import WindHealth
from companion.wind import VaneParameters, WindTracker, WindVerdict, apparent_wind, make
from tests.wind.boat import HERE

BREEZE_S, END_S = 300.0, 900.0
SET = (0.5, 0.0)  # the current that carries her, east north [m/s]


def wind_dies(*, tws_mps=0.0, current=SET, vane_sticks=True):
    """Yield (boat, apparent, WIND): a breeze of 5 m/s for five minutes, then what is left of it.

    She swings slowly under a vane that so little wind does not turn.
    """
    stuck = None
    for k in range(int(END_S)):
        t = float(k)
        blows = t < BREEZE_S
        heading = 0.8 + (0.0 if blows else 0.01 * (t - BREEZE_S))
        velocity = (2.0 * math.sin(heading), 2.0 * math.cos(heading)) if blows else current
        boat = VehicleState(t_s=t, boot_s=t, position=HERE, velocity_en_mps=velocity, heading_rad=heading)
        tws = 5.0 + 0.3 * math.sin(t / 5.0) if blows else tws_mps
        true = WindSample(t_s=t, twd_from_rad=0.1 * math.sin(t / 9.0), tws_mps=tws)
        felt = apparent_wind(true, boat)
        if not blows and vane_sticks:
            stuck = felt.awa_rad if stuck is None else stuck
            felt = type(felt)(t_s=t, awa_rad=stuck, aws_mps=felt.aws_mps)
        yield boat, felt, true


def sail(room, **how):
    log = []
    for boat, felt, true in wind_dies(**how):
        room.update(boat)
        room.update(felt)
        log.append((boat.t_s, room.update(true)))
    return log


@pytest.mark.parametrize("tws_mps", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("parameters", [None, VaneParameters(vane_type=3, speed_type=3)], ids=["unread", "read"])
def test_a_calm_is_a_calm_and_no_fault_of_the_sensor(tws_mps, parameters):
    room = WindTracker(parameters)
    log = sail(room, tws_mps=tws_mps)
    after = [set(s.verdicts) for t, s in log if t > BREEZE_S + 60.0]
    assert all(v == {WindVerdict.CALM} for v in after), after[-1]
    table = room.forecast_table(END_S, [0.0, 60.0])
    assert table.mean_tws_mps[0] == pytest.approx(tws_mps, abs=0.4)


def test_a_calm_in_a_fast_current_is_no_missing_sensor():
    log = sail(WindTracker(), current=(1.5, 0.0))
    assert WindVerdict.NO_SPEED_SENSOR not in log[-1][1].verdicts


def test_below_the_vanes_least_speed_the_anemometer_still_measures():
    """ArduRover then holds the true wind of before: 5 m/s, with 0.5 m/s on the anemometer."""
    room, held = WindTracker(VaneParameters(vane_type=3, speed_type=3, speed_min_mps=0.8)), None
    for boat, felt, true in wind_dies():
        room.update(boat)
        room.update(felt)
        held = true if boat.t_s < BREEZE_S else held
        status = room.update(WindSample(t_s=true.t_s, twd_from_rad=held.twd_from_rad, tws_mps=held.tws_mps))
    assert WindVerdict.HELD in status.verdicts
    assert WindVerdict.CALM in status.verdicts
    assert room.forecast_table(END_S, [0.0]).mean_tws_mps[0] < 1.2


def test_every_estimator_follows_a_speed_that_has_no_direction(name):
    estimator = make(name)
    for k in range(300):
        estimator.update(float(k), 1.0 + 0.02 * math.sin(k / 7.0), 4.0)
    before = estimator.forecast(0.0)[0]
    for k in range(300, 600):
        estimator.update(float(k), float(k), 0.0, weight=0.0, speed_weight=1.0)
    direction, _, speed, _ = estimator.forecast(0.0)
    assert direction == pytest.approx(before, abs=0.03)  # within what the wind showed
    assert speed < 0.3


def test_a_weight_of_nothing_still_only_moves_the_clock(name):
    estimator = make(name)
    for k in range(60):
        estimator.update(float(k), 1.0, 4.0)
    before = estimator.forecast(0.0)
    for k in range(60, 120):
        estimator.update(float(k), -2.0, 0.0, weight=0.0)
    assert estimator.forecast(0.0)[::2] == pytest.approx(before[::2])


def test_the_skippers_means_fall_with_the_wind():
    mission = load_mission(Path("sitl/missions/open-water.toml"))
    skipper = Skipper(voyage=voyage_of(mission), config=config_of(mission))
    fold = VoyageFold(skipper, WindTracker(), permissions_of(mission))
    seen = {}
    for boat, felt, true in wind_dies():
        for value in (boat, felt, true):
            fold.take(value)
        seen[boat.t_s] = fold.tick(boat.t_s).snapshot.wind
    assert seen[BREEZE_S - 1.0].mean_tws_mps == pytest.approx(5.0, abs=0.2)
    assert seen[BREEZE_S + 10.0].present_tws_mps < 0.1
    assert seen[BREEZE_S + 45.0].mean_tws_mps == pytest.approx(2.5, abs=0.2)  # half of the 90 s
    assert seen[BREEZE_S + 95.0].mean_tws_mps < 0.1
    assert seen[END_S - 1.0].health is WindHealth.LIGHT

"""Energy as a limit: the sun by its height, nights that cost, a reserve that ends a run."""

import math

import numpy as np
import pytest

from companion.passage import Energy, left_wh, sweep
from tests.passage.test_sweep import POLAR, A, B
from tests.passage.world import HOURS, LAT, LON, T0, cube, passage, place, steady

FAR = place(0.0, 2.0)


def battery(**more):
    said = {"battery_wh": 100.0, "start_wh": 100.0, "reserve_wh": 20.0, "solar_w": 0.0, "day_w": 4.0, "night_w": 4.0}
    return Energy(**{**said, **more})


def sailed(energy, *, goal=FAR):
    ready = passage(A, goal, polar=POLAR)
    return passage_with(ready, energy).sail((A, goal), T0, (0,))[0]


def passage_with(ready, energy):
    from dataclasses import replace

    return replace(ready, energy=energy)


def test_a_run_ends_at_its_reserve():
    run = sailed(battery())
    assert (run.arrived, run.is_too_much) == (False, True)
    assert run.why == "the battery is down to 20 Wh after 20 h"
    assert run.time_s == pytest.approx(20.0 * 3600.0, abs=301.0)
    assert sailed(battery(day_w=2.0, night_w=2.0)).arrived  # 31 h at 2 W


def test_the_sun_gives_by_its_height_and_a_full_battery_takes_no_more():
    run = sailed(battery(solar_w=30.0, day_w=5.0, night_w=5.0, battery_wh=1e6, start_wh=0.0, reserve_wh=-1e6))
    left = left_wh(battery(solar_w=30.0, day_w=0.0, night_w=0.0, battery_wh=1e6, start_wh=0.0), run)
    day = np.searchsorted(run.rows[:, 0], T0 + 86_400.0)
    # At the equator, by the declination of 20 April (11.5 degrees): the mean of the sine of its height over a day.
    assert left[day] == pytest.approx(24.0 * 30.0 * math.cos(math.radians(11.5)) / math.pi, rel=0.01)
    full = left_wh(battery(solar_w=30.0, day_w=0.0, night_w=0.0), run)
    assert full.max() == 100.0


def test_nights_cost_what_they_cost():
    dark = sailed(battery(day_w=0.0, night_w=10.0, start_wh=100.0, reserve_wh=0.0))
    plain = passage(A, FAR, polar=POLAR).sail((A, FAR), T0, (0,))[0]
    used = 10.0 * plain.hours("night")
    assert used > 100.0
    assert not dark.arrived
    assert sailed(battery(day_w=0.0, night_w=90.0 / plain.hours("night"), reserve_wh=0.0)).arrived


def test_a_departure_is_as_sure_as_its_battery():
    """In one member of two the wind is slow, and the battery is down before she is there."""
    ready = passage(A, B, polar=POLAR, wind=cube(LAT, LON, HOURS, [steady(0.0, -5.0), steady(0.0, -2.0)]))
    [d] = sweep(passage_with(ready, battery()), [T0], 0.0, nodes=20)
    assert (d.chance(), d.chance_of_too_much()) == (0.5, 0.5)

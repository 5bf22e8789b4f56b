"""What a forecast says of shifts: how long one lasts is read off the growth of its spread."""

import math

import numpy as np
import pytest

from companion.messages import WindForecast
from companion.skipper.step.wind_shifts import TAU_S, shift_time_s, shifts_of

HORIZONS_S = np.array([0.0, 1.0, 10.0, 30.0, 60.0, 300.0, 900.0])


def forecast(sigma_deg, measured_s=300.0):
    n = len(HORIZONS_S)
    return WindForecast(
        t_s=0.0,
        horizon_s=HORIZONS_S,
        mean_twd_from_rad=np.zeros(n),
        sigma_twd_rad=np.radians(sigma_deg) * np.ones(n),
        mean_tws_mps=np.full(n, 5.0),
        sigma_tws_mps=np.zeros(n),
        level=np.zeros(0),
        half_width_rad=np.zeros((n, 0)),
        correlation_time_s=measured_s,
    )


def grown(tau_s, spread_deg=9.0):
    """Return the spread of an Ornstein-Uhlenbeck process that is known now."""
    return spread_deg * np.sqrt(1.0 - np.exp(-2.0 * HORIZONS_S / tau_s))


@pytest.mark.parametrize("tau_s", [20.0, 28.0, 60.0, 120.0])
def test_the_growth_of_a_known_process_gives_its_time_whatever_was_measured(tau_s):
    found = {shift_time_s(forecast(grown(tau_s), measured_s)) for measured_s in (5.0, 3000.0)}
    assert len(found) == 1
    assert found.pop() == pytest.approx(tau_s, rel=0.02)


def test_a_spread_that_is_all_there_or_that_hardly_begins_stays_within_limits():
    assert shift_time_s(forecast(9.0)) == TAU_S[0]
    assert shift_time_s(forecast(np.where(HORIZONS_S < 300.0, 0.0, 9.0))) == TAU_S[1]


@pytest.mark.parametrize(("ahead_m", "least_m", "most_m"), [(1000.0, 200.0, 200.0), (100.0, 80.0, 100.0)])
def test_near_the_legs_end_the_laylines_are_the_corridor(ahead_m, least_m, most_m):
    beat = shifts_of(
        forecast(grown(28.0)),
        corridor_m=200.0,
        speed_mps=1.2,
        half_rad=math.radians(45.0),
        tack_s=1.0,
        leg_rad=0.0,
        ahead_m=ahead_m,
    )
    assert least_m <= beat.table.corridor_m <= most_m + 0.1


def test_at_the_legs_end_there_is_no_room_left():
    assert (
        shifts_of(
            forecast(grown(28.0)),
            corridor_m=200.0,
            speed_mps=1.2,
            half_rad=math.radians(45.0),
            tack_s=1.0,
            leg_rad=0.0,
            ahead_m=15.0,
        )
        is None
    )


@pytest.mark.parametrize(
    ("sigma_deg", "corridor_m", "leg_deg", "pays"),
    [
        (grown(28.0), 50.0, 0.0, True),
        (grown(28.0), 15.0, 0.0, False),
        (grown(28.0), 50.0, 40.0, False),
        (0.0, 50.0, 0.0, False),
    ],
    ids=["wide", "narrow", "across", "steady"],
)
def test_a_beat_has_a_table_where_there_is_room_and_wind_for_it(sigma_deg, corridor_m, leg_deg, pays):
    beat = shifts_of(
        forecast(sigma_deg),
        corridor_m=corridor_m,
        speed_mps=1.2,
        half_rad=math.radians(45.0),
        tack_s=1.0,
        leg_rad=math.radians(leg_deg),
    )
    assert (beat is not None) == pays

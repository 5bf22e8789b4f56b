"""The made-up weather: belts and seasons as they are, forecasts as wrong as they say, and read by every router."""

import datetime as dt

import numpy as np
import pytest

from companion.weather import Weather, assemble, walk
from lab.climate import error_mps, forecast, mean_wind, truth, usual
from lab.grib import grib_of

DAY = 86_400.0
JANUARY, JULY = (dt.datetime(2026, month, 15, tzinfo=dt.UTC).timestamp() for month in (1, 7))
BOX = (-60.0, 30.0, 10.0, 60.0)


def test_trades_blow_to_the_west_and_westerlies_to_the_east_stronger_in_winter():
    east, north = mean_wind(JANUARY, np.array([-20.0, 15.0, 50.0])).T
    assert (east[0] < -3.0, east[1] < -3.0, east[2] > 3.0) == (True, True, True)
    assert north[0] > 1.0 > -1.0 > north[1]  # both towards the equator
    assert mean_wind(JANUARY, np.array([47.0]))[0, 0] > 1.2 * mean_wind(JULY, np.array([47.0]))[0, 0]


def test_weather_is_stronger_in_winter_and_weak_in_the_trades():
    times = JANUARY + np.arange(0.0, 60 * DAY, 2 * DAY)
    winter, summer = (
        np.std([truth(s, t, (-60.0, 45.0, 10.0, 55.0), 5.0).wind[0].values for s in range(6)])
        for t in (times, times - JANUARY + JULY)
    )
    trades = np.std([truth(s, times, (-60.0, 10.0, 10.0, 15.0), 5.0).wind[0].values[..., 1] for s in range(6)])
    assert 2.5 < 1.3 * summer < winter < 7.0
    assert trades < 2.5


def test_a_forecast_errs_as_it_says_and_truth_is_like_one_more_member():
    times = JANUARY + np.arange(0.0, 12 * DAY, 3 * DAY)
    wrong, apart = [], []
    for seed in range(30):
        true = truth(seed, times, (-60.0, 40.0, 10.0, 60.0), 5.0).wind[0].values[0]
        members = forecast(seed, times, (-60.0, 40.0, 10.0, 60.0), members=4, step_deg=5.0).wind[0].values
        middle = forecast(seed, times, (-60.0, 40.0, 10.0, 60.0), step_deg=5.0).wind[0].values[0]
        wrong.append(middle - true)
        apart.append(members - middle)
    asked = [error_mps(t - times[0]) for t in times]
    assert np.sqrt(np.mean(np.square(wrong), axis=(0, 2, 3, 4))) == pytest.approx(asked, rel=0.2)
    assert np.sqrt(np.mean(np.square(apart), axis=(0, 1, 3, 4, 5))) == pytest.approx(asked, rel=0.2)


def test_runs_of_one_truth_err_half_alike():
    times = JANUARY + np.array([0.0, 5 * DAY])
    true = truth(2, times, BOX, 5.0).wind[0].values
    a, b = (forecast(2, times, BOX, run=n, step_deg=5.0).wind[0].values - true for n in (0, 1))
    assert 0.2 < np.corrcoef(a[0, 1].ravel(), b[0, 1].ravel())[0, 1] < 0.8


@pytest.mark.parametrize("box", [BOX, (172.0, -25.0, 190.0, -12.0)])
def test_it_is_read_from_a_grib_file_as_it_was(box):
    times = JANUARY + np.arange(0.0, 2 * DAY, DAY / 2.0)
    made = forecast(5, times, box, members=3, step_deg=2.0).wind[0]
    read = assemble(list(walk(grib_of(made), "made.grb2")), None)
    assert read.members == (0, 1, 2)
    lat, lon = np.meshgrid(made.lat_deg, made.lon_deg)
    found = read.wind_over(times, lat.ravel(), lon.ravel())
    assert found == pytest.approx(Weather(wind=(made,)).wind_over(times, lat.ravel(), lon.ravel()), abs=2e-3)


def test_the_usual_weather_is_one_member_without_lows():
    cube = usual(JANUARY + np.arange(0.0, 2 * DAY, DAY), BOX).wind[0]
    assert cube.values[0, 0, :, 0] == pytest.approx(mean_wind(JANUARY, cube.lat_deg), abs=1e-5)

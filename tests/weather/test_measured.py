"""The wind measured on board corrects the first hours of a forecast, by as much as it knows, and no longer."""

import dataclasses
import math

import numpy as np
import pytest

from companion.errors import InputError
from companion.telemetry.winds import measured_wind
from companion.weather import Measured, Weather, corrected, off_by
from companion.weather.measured import GUST_MPS, MEMORY_S, OFF_MPS
from tests.passage.world import HOURS, LAT, LON, T0, cube, steady

NOW = T0 + 24.0 * 3600.0


def weather(*winds):
    return Weather(wind=(cube(LAT, LON, HOURS, [steady(*wind) for wind in winds]),))


def measured(wind, hours=6.0, *, until=NOW, every_s=60.0):
    utc = until - np.arange(0.0, hours * 3600.0, every_s)[::-1]
    return Measured(
        utc_s=utc, lat_deg=np.zeros(utc.size), lon_deg=np.full(utc.size, 0.1), wind_en_mps=np.tile(wind, (utc.size, 1))
    )


def at(forecast, hours, lon=0.1):
    return forecast.wind_en_mps(NOW + 3600.0 * hours, 0.0, lon)


def test_now_the_measured_wind_counts_and_after_days_the_forecast():
    plain = weather((0.0, -5.0))
    off = off_by(plain, measured((2.0, -7.0)), NOW)
    assert off.off_en_mps[0] == pytest.approx([2.0, -2.0], abs=0.15)
    assert off.sd_mps < 0.55
    after = corrected(plain, off)
    assert at(after, 0.0)[0] == pytest.approx([2.0, -7.0], abs=0.15)
    for hours in (3.0, 6.0, 12.0):
        left = math.exp(-hours * 3600.0 / MEMORY_S)
        assert at(after, hours)[0] == pytest.approx([2.0 * left, -5.0 - 2.0 * left], abs=0.15)
    assert at(after, 48.0)[0] == pytest.approx([0.0, -5.0], abs=0.01)
    assert at(after, -1.0)[0] == pytest.approx([0.0, -5.0], abs=1e-5)
    assert abs(at(after, 0.0, 2.8)[0][0]) < 0.3  # 300 km away


def test_ten_minutes_over_the_date_line_are_a_place_on_it():
    """Their mean was at longitude 0: nothing was measured there, or it was held against the wind of Greenwich."""
    here = measured((7.0, 0.0))
    lon_deg = np.where(np.arange(here.utc_s.size) % 2, 179.99, -179.99)
    away = Weather(wind=(cube(LAT, LON + 180.0, HOURS, [steady(5.0, 0.0)]),))
    off = off_by(away, dataclasses.replace(here, lon_deg=lon_deg), NOW)
    assert off.off_en_mps[0] == pytest.approx([2.0, 0.0], abs=0.15)
    assert abs(off.lon_deg) == pytest.approx(180.0, abs=0.02)


def test_a_gap_that_it_is_now_in_stays_one():
    """The wind just before now was set into the gap, which made two steps of it that are none: a wind was made up."""
    hours = np.array([h for h in HOURS if not 21.0 < h < 27.0])
    plain = Weather(wind=(cube(LAT, LON, hours, steady(0.0, -5.0)),))
    off = off_by(plain, measured((2.0, -7.0), until=NOW - 3 * 3600.0), NOW)
    after = corrected(plain, off)
    assert after.wind[0].holes_s() == plain.wind[0].holes_s() == ((NOW - 3 * 3600.0, NOW + 3 * 3600.0),)
    assert np.isnan(at(after, 0.5)).all()
    assert np.isfinite(at(after, 3.0)).all()


def test_each_member_is_corrected_and_keeps_what_is_not_known():
    plain = weather(*((0.0, -5.0 - 0.5 * k) for k in range(15)))
    off = off_by(plain, measured((1.0, -6.0)), NOW)
    now, later = (at(corrected(plain, off), h) for h in (0.0, 48.0))
    assert now.mean(axis=0) == pytest.approx([1.0, -6.0], abs=0.2)
    assert now.std(axis=0) == pytest.approx([off.sd_mps, off.sd_mps], rel=0.15)
    assert later[:, 1] == pytest.approx(plain.wind_en_mps(NOW, 0.0, 0.0)[:, 1], abs=0.01)


def test_what_little_was_measured_counts_little_and_what_is_old_nothing():
    plain = weather((0.0, -5.0))
    one = off_by(plain, measured((2.0, -5.0), 0.15), NOW)
    share = OFF_MPS**2 / (OFF_MPS**2 + GUST_MPS**2)
    assert one.count == 1
    assert one.off_en_mps[0] == pytest.approx([2.0 * share, 0.0], abs=0.03)
    stale = off_by(plain, measured((2.0, -5.0), until=NOW - 6 * 3600.0), NOW)
    assert stale.off_en_mps[0][0] == pytest.approx(2.0 * math.exp(-1.0), abs=0.06)
    assert off_by(plain, measured((2.0, -5.0), until=NOW - 20 * 3600.0), NOW) is None
    assert off_by(plain, measured((2.0, -5.0), until=NOW + 20 * 3600.0, hours=6.0), NOW) is None


def test_what_it_promises_is_kept_by_errors_of_its_kind():
    """Over 400 errors of six hours' memory: the corrected forecast is off by what it says, and by less than before."""
    rng = np.random.default_rng(41)
    plain = weather((0.0, -5.0))
    step, before, ahead = 600.0, 36, 6
    left = math.exp(-step / MEMORY_S)
    rows = []
    for _ in range(400):
        error = OFF_MPS * rng.standard_normal(2)
        track = []
        for _ in range(before + 6 * ahead):
            track.append(error)
            error = left * error + math.sqrt(1.0 - left**2) * OFF_MPS * rng.standard_normal(2)
        track = np.array(track)
        utc = NOW + step * (np.arange(before) - before + 0.5)
        seen = (0.0, -5.0) + track[:before] + GUST_MPS * rng.standard_normal((before, 2))
        off = off_by(
            plain, Measured(utc_s=utc, lat_deg=0.0 * utc, lon_deg=0.0 * utc, wind_en_mps=seen), NOW - 0.5 * step
        )
        hours = np.array([0, 1, 3, 5])
        truth = track[before - 1 + 6 * hours]
        for h, true in zip(hours, truth, strict=True):
            told = off.off_en_mps[0] * off.share(3600.0 * h)
            kept = off.share(3600.0 * h) ** 2
            sd_mps = math.sqrt(kept * off.sd_mps**2 + (1.0 - kept) * OFF_MPS**2)
            rows.append((h, *((true - told) / sd_mps), *(true - told), *true))
    rows = np.array(rows)
    for h in (0, 1, 3, 5):
        here = rows[rows[:, 0] == h]
        assert here[:, 1:3].std() == pytest.approx(1.0, abs=0.08)
        assert here[:, 3:5].std() < (0.55, 0.75, 0.9, 0.97)[(0, 1, 3, 5).index(h)] * here[:, 5:7].std()


def test_a_table_of_winds(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text("time, lat, lon, from_deg, speed_mps\n2026-04-20T06:00:00Z, 47.1, -6.3, 270, 7.5\n")
    found = measured_wind(path)
    assert found.wind_en_mps[0] == pytest.approx([7.5, 0.0], abs=1e-9)
    assert (found.utc_s[0], found.lat_deg[0], found.lon_deg[0]) == (T0 + 6 * 3600.0, 47.1, -6.3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "w.csv: has no line of a wind"),
        ("2026-04-20T06:00:00, 47.1, -6.3, 270, 7.5\n", "w.csv: line 1: is not time, lat, lon, from_deg, speed_mps"),
        ("2026-04-20T06:00:00Z, 47.1, -6.3, 270\n", "w.csv: line 1: is not time, lat, lon, from_deg, speed_mps"),
        ("2026-04-20T06:00:00Z, 47.1, -6.3, 270, nan\n", "w.csv: line 1: is not time, lat, lon, from_deg, speed_mps"),
        ("2026-04-20T06:00:00Z, 97.1, -6.3, 270, 7.5\n", "w.csv: line 1: is no wind that can be"),
    ],
)
def test_what_is_no_table_of_winds_is_said(text, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "w.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        measured_wind((tmp_path / "w.csv").relative_to(tmp_path))
    assert str(caught.value).startswith(said)

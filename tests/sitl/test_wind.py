"""Winds: spread at any step, repeatability, composition, bad files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.errors import InputError
from companion.geo.angles import difference_rad, wrap_pi
from sitl.world.environment import (
    AR1,
    NOISE_RAD,
    RHO_HZ,
    SPREAD_RAD,
    Constant,
    Recorded,
    Scripted,
    WindEvent,
    parse_wind,
)


def directions(wind: AR1, step_s: float, count: int) -> np.ndarray:
    return np.array([wrap_pi(wind.at(n * step_s)[0]) for n in range(count)])


def test_equation_17_spread() -> None:
    assert math.degrees(SPREAD_RAD) == pytest.approx(18.6, abs=0.05)
    assert pytest.approx(NOISE_RAD**2 / (2.0 * RHO_HZ)) == SPREAD_RAD**2


@pytest.mark.parametrize("step_s", [0.1, 0.5, 1.0])
def test_spread_and_correlation_are_the_same_at_every_step(step_s: float) -> None:
    # 60,000 s hold 1,080 correlation times: the spread is known to 2.2 % (one sigma)
    x = directions(AR1(0.0, 5.0, seed=11, step_s=step_s), 1.0, 60_000)
    assert math.degrees(x.std()) == pytest.approx(18.6, rel=0.07)
    for lag_s in (5, 20, 60):
        assert np.corrcoef(x[:-lag_s], x[lag_s:])[0, 1] == pytest.approx(math.exp(-RHO_HZ * lag_s), abs=0.06)


def test_many_seeds_start_in_the_stationary_spread_and_one_second_adds_its_noise() -> None:
    start = np.array([wrap_pi(AR1(0.0, 5.0, seed=n).at(0.0)[0]) for n in range(1500)])
    step = np.array([wrap_pi(AR1(0.0, 5.0, seed=n, from_mean=True).at(1.0)[0]) for n in range(1500)])
    assert math.degrees(start.std()) == pytest.approx(18.6, rel=0.06)
    assert step.std() == pytest.approx(NOISE_RAD * math.sqrt((1 - math.exp(-2 * RHO_HZ)) / (2 * RHO_HZ)), rel=0.06)


@settings(max_examples=40)
@given(seed=st.integers(0, 1 << 31), times=st.lists(st.floats(0.0, 3000.0), min_size=1, max_size=20))
def test_a_wind_is_a_function_of_time(seed: int, times: list[float]) -> None:
    forward, backward = AR1(6.0, 5.0, seed=seed, tws_sd_mps=1.0), AR1(6.0, 5.0, seed=seed, tws_sd_mps=1.0)
    ahead = [forward.at(t) for t in sorted(times)]
    back = [backward.at(t) for t in sorted(times, reverse=True)]
    assert ahead == back[::-1]
    for twd, tws in ahead:
        assert 0.0 <= twd < 2.0 * math.pi
        assert tws >= 0.0


def test_events_compose() -> None:
    wind = Scripted(
        Constant(math.radians(350.0), 5.0),
        (
            WindEvent(at_s=10.0, veer_rad=math.radians(20.0), over_s=10.0),
            WindEvent(at_s=50.0, tws_mps=0.0, over_s=5.0, for_s=20.0),
            WindEvent(at_s=100.0, tws_mps=7.5, for_s=5.0),
        ),
    )
    assert wind.at(9.0) == (pytest.approx(math.radians(350.0)), 5.0)
    assert math.degrees(difference_rad(wind.at(15.0)[0], 0.0)) == pytest.approx(0.0, abs=1e-6)
    assert math.degrees(wind.at(30.0)[0]) == pytest.approx(10.0)
    assert wind.at(60.0)[1] == 0.0
    assert wind.at(72.5)[1] == pytest.approx(2.5)
    assert wind.at(80.0)[1] == 5.0
    assert wind.at(102.0)[1] == pytest.approx(7.5)
    assert wind.at(106.0)[1] == 5.0


def test_record(tmp_path: Path) -> None:
    path = tmp_path / "wind.csv"
    path.write_text("# made here\nt_s,wind_from_deg,wind_speed_ms\n5,350,4\n7,10,6\n8,,\n9,10,6\n")
    wind = Recorded.from_csv(path)
    assert wind.duration_s == 4.0
    assert wind.at(1.0) == (pytest.approx(0.0, abs=1e-9), pytest.approx(5.0))
    assert wind.at(-3.0)[1] == 4.0
    assert wind.at(99.0)[1] == 6.0


def test_a_record_that_is_not_there_is_told_without_the_system_s_words(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.csv: no such file; name a wind CSV$"):
        Recorded.from_csv(tmp_path / "nowhere.csv")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("t_s,wind_from_deg\n1,2\n", "line 1"),
        ("t_s,wind_from_deg,wind_speed_ms\n1,2,x\n", "line 2"),
        ("t_s,wind_from_deg,wind_speed_ms\n1,2,3\n1,2,3\n", "line 3"),
        ("t_s,wind_from_deg,wind_speed_ms\n", "no wind"),
        ("t_s,wind_from_deg,wind_speed_ms\n1,2,500\n", "line 2"),
    ],
)
def test_bad_records_are_named(tmp_path: Path, text: str, place: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        Recorded.from_csv(path)
    assert str(path) in str(error.value)
    assert place in str(error.value)


@pytest.mark.parametrize(
    "text", ["", "5", "5@x", "ar1:", "ar1:5@0,sd", "storm:5@0", "5@0,sd=3", "nan@0", "-1@0", "no.csv"]
)
def test_bad_wind_options(text: str) -> None:
    with pytest.raises(InputError):
        parse_wind(text)


def test_wind_options() -> None:
    assert parse_wind("5@90").at(0.0) == (pytest.approx(math.pi / 2), 5.0)
    wind = parse_wind("ar1:6@200,sd=9,rho=0.05,gust=0.5", seed=3)
    assert isinstance(wind, AR1)
    assert (math.degrees(wind.sd_rad), wind.rho_hz, wind.tws_sd_mps) == (pytest.approx(9.0), 0.05, 0.5)

"""The papers' own equations, written again by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.errors import InputError
from companion.wind import make
from companion.wind.study.records import Record, fit_ar1, parse_csv
from companion.wind.study.score import crps_circular, crps_normal, score
from lab.simulated_wind import NOISE_RADPS, RHO_HZ, equation_17, weather


@pytest.mark.parametrize("veers_rad", [0.0, 4.0])
def test_the_kalman_filter_is_equations_1_to_8(veers_rad):
    """With (8)'s window full for long, in a wind that stays and in one that goes round more than half the circle."""
    n, r = 20, np.diag([0.5**2, math.radians(3.0) ** 2])
    record = weather(9, seconds=200.0, mean_rad=0.0)
    kalman = make("kalman", n=n, r_deg=3.0)
    w = p = q = None
    window = []
    wind = record.twd_from_rad + veers_rad * record.t_s / 200.0
    for t, d, s in zip(record.t_s.tolist(), wind.tolist(), record.tws_mps.tolist(), strict=True):
        kalman.update(t, d, s)
        z = np.array([s, d if w is None else w[1] + math.remainder(d - w[1], 2.0 * math.pi)])
        if w is None:
            w, p, q = z, r.copy(), np.zeros((2, 2))
            continue
        prior = p + q  # (2)
        gain = prior @ np.linalg.inv(prior + r)  # (3)
        v = z - w  # (4)
        w = w + gain @ v  # (5)
        p = (np.eye(2) - gain) @ prior  # (6)
        window = [*window[-(n - 1) :], np.outer(v, v)]
        q = gain @ (sum(window) / len(window)) @ gain.T  # (8), (7)
    mean, sigma, speed, sigma_speed = kalman.forecast(100.0)
    ahead = p + 100.0 * q
    assert math.remainder(mean - w[1], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert speed == pytest.approx(w[0], abs=1e-6)
    assert sigma == pytest.approx(math.sqrt(ahead[1, 1]), rel=1e-6)
    assert sigma_speed == pytest.approx(math.sqrt(ahead[0, 0]), rel=1e-6)


@pytest.mark.parametrize(("name", "window"), [("mean90", 90), ("mean5", 5)])
def test_buesser_means_are_vector_means_of_their_window(name, window):
    record = weather(10, seconds=400.0)
    e = make(name)
    for t, d, s in zip(record.t_s.tolist(), record.twd_from_rad.tolist(), record.tws_mps.tolist(), strict=True):
        e.update(t, d, s)
    last = record.twd_from_rad[-window:]
    expected = math.atan2(float(np.mean(np.sin(last))), float(np.mean(np.cos(last))))
    assert e.forecast(60.0)[0] == pytest.approx(expected, abs=1e-6)
    assert e.forecast(60.0)[2] == pytest.approx(float(np.mean(record.tws_mps[-window:])))


def test_equation_17_does_not_depend_on_the_step_of_the_observer():
    """As printed its spread is 18.7 deg at a step of 1 s and 5.9 at 0.1 s; the process is that of 1 s."""
    expected = NOISE_RADPS / math.sqrt(1.0 - (1.0 - RHO_HZ) ** 2)
    assert math.degrees(expected) == pytest.approx(18.7, abs=0.05)
    for dt_s in (0.1, 1.0, 5.0):
        record = equation_17(1, seconds=40000.0, dt_s=dt_s)
        x = (record.twd_from_rad + math.pi) % (2 * math.pi) - math.pi
        assert float(np.std(x)) == pytest.approx(expected, rel=0.08)


@pytest.mark.parametrize("dt_s", [1.0, 4.0])
def test_ar1_is_recovered_within_its_errors(dt_s):
    off = []
    for seed in range(6):
        found = fit_ar1(equation_17(seed, seconds=14400.0, dt_s=dt_s, mean_rad=3.1))
        keep = (1.0 - RHO_HZ) ** dt_s
        rho = (1.0 - keep) / dt_s
        stationary = NOISE_RADPS / math.sqrt(1.0 - (1.0 - RHO_HZ) ** 2)
        noise = stationary * math.sqrt(1.0 - keep * keep) / dt_s
        off += [(found.rho_hz - rho) / found.rho_error_hz, (found.noise_radps - noise) / found.noise_error_radps]
        assert found.step_s == dt_s
        assert 0.01 < found.rho_error_hz / rho < 0.2
    assert max(abs(v) for v in off) < 4.0
    assert 0.4 < float(np.std(off)) < 1.8  # the errors are neither boast nor alibi


def test_ar1_takes_irregular_steps():
    record = equation_17(3, seconds=14400.0)
    keep = np.random.default_rng(2).random(len(record)) < 0.5
    thin = Record(
        name="thin",
        t_s=record.t_s[keep],
        twd_from_rad=record.twd_from_rad[keep],
        tws_mps=record.tws_mps[keep],
        turning=record.turning[keep],
    )
    found = fit_ar1(thin)
    assert 1.0 / found.correlation_time_s == pytest.approx(-math.log(1.0 - RHO_HZ), rel=0.35)


def test_ar1_wants_a_record():
    with pytest.raises(InputError, match="at least 100"):
        fit_ar1(equation_17(1, seconds=50.0))


# --------------------------------------------------------------------------------------------------- scores
@settings(max_examples=30)
@given(error=st.floats(-math.pi, math.pi), sigma=st.floats(0.02, 3.0))
def test_circular_crps_is_its_definition(error, sigma):
    """E d(X, y) - E d(X, X') / 2 by quadrature over the wrapped normal."""
    x = np.linspace(-math.pi, math.pi, 2001)[:-1]
    density = sum(np.exp(-0.5 * ((x + 2 * math.pi * k) / sigma) ** 2) for k in range(-8, 9))
    density /= density.sum()

    def arc(a):
        return np.abs((a + math.pi) % (2 * math.pi) - math.pi)

    fft = np.fft.fft
    apart = np.real(np.fft.ifft(fft(density) * fft(density)))  # of X + X', symmetric: X - X' has the same law
    near = float(np.sum(density * arc(x - error)))
    spread = float(np.sum(np.roll(apart, 0) * arc(2 * x[0] + np.arange(2000) * (2 * math.pi / 2000))))
    assert crps_circular(error, sigma) == pytest.approx(near - 0.5 * spread, abs=3e-3)


def test_crps_limits():
    assert crps_circular(0.3, 0.1) == pytest.approx(crps_normal(0.3, 0.1))
    assert math.degrees(crps_circular(0.3, 3.1)) == pytest.approx(45.0, abs=1.0)
    assert crps_normal(0.2, 1e-9) == pytest.approx(0.2, abs=1e-6)


def test_turning_and_calm_are_not_targets():
    record = weather(4, seconds=2000.0)
    marked = Record(
        name="m",
        t_s=record.t_s,
        twd_from_rad=record.twd_from_rad,
        tws_mps=record.tws_mps,
        turning=record.t_s % 60.0 < 30.0,
    )
    everything, half = score(record, make("mean90")), score(marked, make("mean90"))
    assert half.at(60.0) is None or half.at(60.0).count < everything.at(60.0).count


# -------------------------------------------------------------------------------------------------- records
def test_csv_is_read():
    lines = ["t_s,wind_from_deg,wind_speed_ms,turning,heading_deg,awa_deg", "0,350,5,0,40,310", "1,10,6,1,41,300"]
    record = parse_csv(lines, "r.csv")
    assert record.turning.tolist() == [False, True]
    assert math.degrees(record.awa_rad[0]) == pytest.approx(-50.0)
    assert record.duration_s == 1.0


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["a,b", "1,2"], "line 1: no column t_s"),
        (["t_s,wind_from_deg,wind_speed_ms", "0,x,5", "1,2,3"], "line 2: wind_from_deg is 'x'"),
        (["t_s,wind_from_deg,wind_speed_ms", "0,1,5", "0,2,3"], "line 3: time 0 is not after 0"),
        (["t_s,wind_from_deg,wind_speed_ms", "0,1,-5", "1,2,3"], "line 2: wind speed -5 is negative"),
        (["t_s,wind_from_deg,wind_speed_ms", "0,nan,5", "1,2,3"], "line 2: wind_from_deg is nan"),
        (["t_s,wind_from_deg,wind_speed_ms", "0,1"], "line 2: wind_speed_ms is ''"),
        (["t_s,wind_from_deg,wind_speed_ms", "0,1,5"], "1 reading"),
        ([], "no column t_s"),
    ],
)
def test_bad_csv_is_refused_in_one_line(lines, words):
    with pytest.raises(InputError) as caught:
        parse_csv(lines, "bad.csv")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("bad.csv")

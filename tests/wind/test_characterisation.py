"""Wolsieffer's filter over records, by R and N: what was put in is found again; what is drawn and printed of it."""

import json
import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

from companion.cli import main
from companion.plots.wind import filter_figure
from companion.wind import make
from companion.wind.estimators.kalman import R_DEG, WINDOW
from companion.wind.study import Record, characterise, runs, score
from companion.wind.study.score import NOISES_DEG, WINDOWS
from lab.simulated_wind import weather
from tests.wind.test_command import write_csv

NOISE_DEG = 6.0


def wandering(seed, *, noise_deg, step_deg=0.6, seconds=5400):
    """Return the wind that the filter is made for: a random walk of the direction under a vane's white noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds)
    walk = np.cumsum(math.radians(step_deg) * rng.normal(size=t.size))
    read = walk + math.radians(noise_deg) * rng.normal(size=t.size)
    return Record(
        name=f"walk_{seed}",
        t_s=t,
        twd_from_rad=read,
        tws_mps=6.0 + 0.5 * rng.normal(size=t.size),
        turning=np.zeros(t.size, dtype=np.bool_),
    )


@pytest.fixture(scope="module")
def found():
    return characterise(
        [wandering(seed, noise_deg=NOISE_DEG) for seed in (1, 2)],
        noises_deg=(1.5, 3.0, NOISE_DEG, 12.0, 24.0),
        windows=(30, 300),
    )


def test_the_noise_that_was_put_in_scores_best_at_every_horizon(found):
    assert found.horizons_s == (10.0, 60.0, 300.0)
    for horizon_s in found.horizons_s:
        assert found.best(horizon_s).r_deg == NOISE_DEG
    other = characterise([wandering(3, noise_deg=2.5)], noises_deg=(1.0, 2.5, NOISE_DEG), windows=(300,))
    assert {other.best(h).r_deg for h in other.horizons_s} == {2.5}


def test_below_the_noise_the_band_is_too_wide_and_above_it_the_filter_stops(found):
    inside = {(c.r_deg, c.window): c.at(60.0).coverage[-1] for c in found.cells}
    for n in (30, 300):
        assert inside[1.5, n] > 0.99
        assert inside[12.0, n] < 0.3
        assert inside[24.0, n] < 0.3


def test_a_window_longer_than_the_noise_s_scatter_is_better(found):
    crps = {(c.r_deg, c.window): c.at(60.0).crps_rad for c in found.cells}
    assert crps[NOISE_DEG, 300] < crps[NOISE_DEG, 30]


def test_a_cell_is_the_score_of_the_filter_itself_and_progress_hears_every_reading():
    record, heard = wandering(4, noise_deg=3.0, seconds=1500), []
    found = characterise([record], noises_deg=(3.0,), windows=(50,), horizons_s=(10.0,), advance=heard.append)
    assert found.cells[0].horizons == score(record, make("kalman", r_deg=3.0, n=50), horizons_s=(10.0,)).horizons
    assert found.default == score(record, make("default"), horizons_s=(10.0,)).horizons
    assert sum(heard) == runs((3.0,), (50,)) * len(record)


def test_the_mission_s_default_is_one_of_the_cells():
    assert R_DEG in NOISES_DEG
    assert WINDOW in WINDOWS


def test_the_picture_has_a_curve_for_each_n_and_the_forecaster_across(found):
    figure = filter_figure(found)
    assert [ax.get_title() for ax in figure.axes[:3]] == ["10 s ahead", "60 s ahead", "300 s ahead"]
    above, below = figure.axes[1], figure.axes[4]
    curve = next(line for line in above.lines if line.get_label() == "N = 300")
    assert list(curve.get_xdata()) == [1.5, 3.0, NOISE_DEG, 12.0, 24.0]
    assert min(zip(curve.get_ydata(), curve.get_xdata(), strict=True))[1] == NOISE_DEG
    reference = next(line for line in below.lines if line.get_label() == "default forecaster")
    assert reference.get_ydata()[0] == pytest.approx(100.0 * found.default[1].coverage[-1])
    plt.close(figure)


def test_the_star_stands_at_the_mission_s_default():
    found = characterise([wandering(5, noise_deg=R_DEG, seconds=1500)], noises_deg=(R_DEG,), windows=(WINDOW,))
    figure = filter_figure(found)
    (star,) = [line for line in figure.axes[0].lines if line.get_marker() == "*"]
    assert star.get_xdata()[0] == R_DEG
    assert star.get_ydata()[0] == pytest.approx(math.degrees(found.cells[0].at(10.0).crps_rad))
    plt.close(figure)


# ------------------------------------------------------------------------------------- the command
def test_the_command_prints_writes_and_draws_the_grid(tmp_path, capsys):
    record = write_csv(tmp_path / "r.csv", weather(3, seconds=1500.0), extra=False)
    picture, figures = tmp_path / "f.png", tmp_path / "f.json"
    assert main(["wind", str(record), "--filter", str(picture), "--json", str(figures)]) == 0
    out = capsys.readouterr().out
    assert "60 s ahead: CRPS of direction [deg] / inside the 95 % band [%]" in out
    assert out.count("best: R = ") == 3
    assert picture.read_bytes()[:4] == b"\x89PNG"
    document = json.loads(figures.read_text())
    assert document["records"] == ["r.csv"]
    assert {(c["r_deg"], c["window"]) for c in document["filter"]} == {(r, n) for r in NOISES_DEG for n in WINDOWS}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.csv", "--filter", "f.png"], "nowhere.csv: no such file; name a CSV"),
        ([".", "--filter", "f.png"], "no CSV records in the folder; name a record"),
        (["short.csv", "--filter", "f.png"], "short.csv: too short to score; a horizon needs 20 forecasts"),
        (["short.csv", "--filter", "f"], "end it in one of .png"),
        (["short.csv", "--filter", "no/such/f.png"], "make the folder first"),
        (["short.csv", "--filter"], "expected one argument"),
        (["short.csv", "--filter", "f.png", "--cost"], "not allowed with argument"),
        (["short.csv", "--filter", "f.png", "--plot", "p.png"], "not allowed with argument"),
        (["short.csv", "--filter", "f.png", "--estimator", "all"], "leave one of them out"),
    ],
)
def test_bad_usage_is_one_line_and_draws_nothing(arguments, words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    if "short.csv" in arguments:
        write_csv(tmp_path / "short.csv", weather(7, seconds=300.0), extra=False)
    assert main(["wind", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.glob("*.png"))

"""What ``companion wind RECORD --plot`` draws: Wolsieffer's characterisation of the wind, Figures 4 and 5."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

from companion.plots.wind import autocorrelation, wind_figure
from companion.wind import make
from companion.wind.study import score
from lab.simulated_wind import NOISE_RADPS, RHO_HZ, equation_17

STATIONARY_DEG = math.degrees(NOISE_RADPS / math.sqrt(1.0 - (1.0 - RHO_HZ) ** 2))


@pytest.fixture(scope="module")
def record():
    return equation_17(4, seconds=20_000.0, mean_rad=6.0)


@pytest.fixture(scope="module")
def axes(record):
    figure = wind_figure(record, [score(record, make("mean90"))])
    yield {ax.get_title(): ax for ax in figure.axes}
    plt.close(figure)


@pytest.mark.parametrize("what", ["direction", "strength"])
def test_figure_4_is_the_share_of_the_readings_and_the_normal_beside_it(axes, record, what):
    ax = axes[f"distribution of {what}"]
    assert sum(bar.get_width() * bar.get_height() for bar in ax.patches) == pytest.approx(1.0)
    curve = ax.lines[0]
    assert np.trapezoid(curve.get_ydata(), curve.get_xdata()) == pytest.approx(1.0, abs=0.02)
    top = curve.get_xdata()[np.argmax(curve.get_ydata())]
    assert top == pytest.approx(0.0 if what == "direction" else np.mean(record.tws_mps), abs=1.0)


def test_figure_4_of_equation_17_has_its_spread(axes):
    (label,) = [text.get_text() for text in axes["distribution of direction"].get_legend().get_texts()]
    assert float(label.split()[2].rstrip("°")) == pytest.approx(STATIONARY_DEG, rel=0.08)


def test_figure_5_decays_as_the_process_forgets(axes, record):
    lags, correlation = autocorrelation(record, 6.0)
    assert correlation[0] == pytest.approx(1.0)
    for lag_s in (10, 30, 60):
        assert correlation[int(np.searchsorted(lags, lag_s))] == pytest.approx((1.0 - RHO_HZ) ** lag_s, abs=0.08)
    assert abs(float(np.mean(correlation[300:]))) < 0.1
    assert axes["autocorrelation of direction"].lines[0].get_ydata() == pytest.approx(correlation, abs=1e-3)

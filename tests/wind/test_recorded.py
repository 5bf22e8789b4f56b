"""The promises on recorded wind; run where the records are ($COMPANION_WIND_DATA)."""

import numpy as np
import pytest

from companion.wind import make
from companion.wind.estimators.forecaster import CONSTANTS
from companion.wind.study.records import parse_csv
from companion.wind.study.score import SCORED_HORIZONS_S, average, score
from lab.wind_fit import Prepared, figures

pytestmark = pytest.mark.winddata


@pytest.fixture
def records(wind_data):
    return [parse_csv(p.read_text().splitlines(), p.name) for p in sorted(wind_data.glob("*.csv"))]


def test_coverage_on_the_average_of_records(records):
    mean = np.nanmean(figures(CONSTANTS, [Prepared(r) for r in records]), axis=0)
    assert np.all((mean[:, 1] >= 0.45) & (mean[:, 1] <= 0.55)), mean[:, 1]
    assert np.all((mean[:, 2] >= 0.76) & (mean[:, 2] <= 0.84)), mean[:, 2]
    assert np.all((mean[:, 3] >= 0.93) & (mean[:, 3] <= 0.97)), mean[:, 3]


def test_better_than_the_kalman_filter_and_the_mean(records):
    mean = np.nanmean(figures(CONSTANTS, [Prepared(r) for r in records]), axis=0)[:, 0]
    rivals = {
        name: {s.horizon_s: s.crps_rad for s in average([score(r, make(name)) for r in records])}
        for name in ("kalman", "mean90")
    }
    default = dict(zip(SCORED_HORIZONS_S, mean.tolist(), strict=True))
    assert default[120.0] <= 0.65 * rivals["kalman"][120.0]
    assert default[10.0] <= 0.72 * rivals["kalman"][10.0]
    assert default[120.0] <= 0.93 * rivals["mean90"][120.0]

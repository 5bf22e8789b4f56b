"""Büsser's figures of voyages: ``python -m bench.avalon``."""

import math

import numpy as np
import pytest
import shapely

from bench.avalon import WINDS, means, sail, told_wind


@pytest.mark.parametrize("name", WINDS)
def test_figures_10_11_and_3_2_are_of_voyages(name, tmp_path):
    record = sail(name, 0, tmp_path / "v")
    assert record.summary.arrived
    east, north = record.columns["east_m"], record.columns["north_m"]
    known = np.isfinite(east)
    track = shapely.LineString(np.column_stack([east[known], north[known]]))
    rocks = shapely.union_all([shapely.from_wkt(wkt) for wkt in record.chart.obstacles])
    assert track.distance(rocks) > 4.0
    assert record.plans[0].plan.waypoints[0][1] < 50.0 < 150.0 < record.plans[0].plan.waypoints[-1][1]
    told = told_wind(tmp_path / "v")
    assert len(told) > 60
    assert np.all(np.diff(told[:, 0]) > 0.0)
    both = means(told)
    assert np.max(np.abs(np.angle(np.exp(1j * (both["mean90"] - math.radians(WINDS[name])))))) < math.radians(12.0)
    # the short mean follows what is told, the long one lies still
    late = told[:, 0] > 30.0
    off = {n: np.angle(np.exp(1j * (both[n] - told[:, 1])))[late] for n in both}
    assert np.std(off["mean5"]) < 0.5 * np.std(off["mean90"])
    assert np.ptp(np.unwrap(both["mean90"][late])) < 0.5 * np.ptp(np.unwrap(both["mean5"][late]))

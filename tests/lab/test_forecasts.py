"""Does a forecast help: five ways to sail a departure, and the table of them."""

import math

import numpy as np
import pytest

import lab.forecasts as f
from companion.messages import GeoPoint
from lab.climate import truth


@pytest.fixture
def near(monkeypatch):
    """Two hundred kilometres of it, planned again every twelve hours."""
    monkeypatch.setattr(f, "GOAL", GeoPoint(lat_deg=50.0, lon_deg=-14.0))
    monkeypatch.setattr(f, "BOX", (-19.0, 46.0, -6.0, 55.0))
    monkeypatch.setattr(f, "NODES", 16)
    monkeypatch.setattr(f, "EVERY_S", 12 * 3600.0)
    monkeypatch.setattr(f, "MOST_S", 8 * 86_400.0)


def by_way(rows):
    return {row.way: row for row in rows}


def test_who_knows_what_comes_is_not_slower_and_all_of_them_arrive(near):
    found = by_way(f.sailed(3, 50))
    assert tuple(found) == f.WAYS
    assert all(0.5 < row.days < 8.0 and 100.0 < row.distance_nm < 300.0 for row in found.values())
    assert found["foresight"].days < 1.005 * min(row.days for row in found.values())


def test_a_forecast_that_is_right_comes_to_foresight_and_none_to_the_season_s_wind(near, monkeypatch):
    monkeypatch.setattr(f, "forecast", lambda seed, times, box, run: truth(seed, times, box))
    found = by_way(f.sailed(3, 50))
    assert found["forecast"].days == pytest.approx(found["foresight"].days, rel=0.01)
    assert found["season"].days > 1.005 * found["foresight"].days


def test_each_plan_of_a_forecast_is_of_a_run_of_its_own(near, monkeypatch):
    runs = []
    real = f.forecast
    monkeypatch.setattr(
        f, "forecast", lambda seed, times, box, run: runs.append((run, times[0])) or real(seed, times, box, run=run)
    )
    f.sailed(3, 50)
    assert [run for run, _ in runs] == list(range(len(runs)))
    assert len(runs) >= 2
    assert np.diff([at for _, at in runs]) == pytest.approx(12 * 3600.0, abs=301.0)


def test_the_table_compares_the_same_departures_and_counts_who_did_not_arrive():
    rows = [
        f.Row(departure=d, way=way, days=days, strong_h=1.0, distance_nm=100.0)
        for d, four in enumerate([(10.0, 10.5, 9.0, 8.0), (20.0, 19.0, 19.0, 16.0)])
        for way, days in zip(f.WAYS[1:], four, strict=True)
    ]
    rows += [f.Row(departure=2, way=way, days=math.inf, strong_h=4.0, distance_nm=9.0) for way in f.WAYS]
    rows += [f.Row(departure=3, way=way, days=math.inf, strong_h=0.0, distance_nm=9.0) for way in f.WAYS[1:4]]
    rows.append(f.Row(departure=3, way="foresight", days=12.0, strong_h=0.0, distance_nm=90.0))
    said = f.table(rows).splitlines()
    assert said[3] == "| fixed | 2 of 4 | 15.0 | 20.0 |  |  |  | 1.5 |"
    assert said[4].startswith("| season | 2 of 4 | 14.8 | 19.0 | 0.0 % |")
    assert said[5] == "| forecast | 2 of 4 | 14.0 | 19.0 | 7.5 % | 2.6 to 12.4 | 2 | 1.5 |"
    assert said[6] == "| foresight | 3 of 4 | 12.0 | 16.0 | 20.0 % | 20.0 to 20.0 | 2 | 1.5 |"


def test_rows_that_the_file_holds_are_not_sailed_again(tmp_path, capsys, monkeypatch):
    made = [f.Row(departure=0, way=way, days=3.0, strong_h=0.0, distance_nm=100.0) for way in f.WAYS]
    monkeypatch.setattr(f, "sailed", lambda departure, of: made)
    asked = ["--departures", "1", "--out", str(tmp_path / "rows.csv")]
    assert f.main(asked) == 0
    monkeypatch.setattr(f, "sailed", None)
    assert f.main(asked) == 0
    assert capsys.readouterr().out.count("| fixed | 1 of 1 | 3.0 |") == 2

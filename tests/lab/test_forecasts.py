"""Does a forecast help: six ways to sail a departure, and the table of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

import lab.forecasts as f
from companion.messages import GeoPoint
from companion.weather import Weather
from lab.climate import truth

NEAR = f.Course(name="near", by_hand=((51.0, -11.5), (50.0, -14.0)), box=(-19.0, 46.0, -6.0, 55.0), land=())


@pytest.fixture
def near(monkeypatch):
    """Two hundred kilometres, planned again every twelve hours by three members."""
    for name, value in {"NODES": 16, "EVERY_S": 12 * 3600.0, "MOST_S": 8 * 86_400.0, "MEMBERS": 3}.items():
        monkeypatch.setattr(f, name, value)
    return f.made_voyage(NEAR, 3, 50)


def by_way(voyage):
    return {row.way: row for row, _ in f.sailed(voyage)}


def test_who_knows_what_comes_is_not_slower_and_all_of_them_arrive(near):
    found = by_way(near)
    assert tuple(found) == f.WAYS
    assert all(12.0 < row.hours < 192.0 and 100.0 < row.distance_nm < 300.0 for row in found.values())
    assert found["foresight"].hours < 1.005 * min(row.hours for row in found.values())


def test_a_forecast_that_is_right_comes_to_foresight(near, monkeypatch):
    monkeypatch.setattr(f, "MEMBERS", 1)
    monkeypatch.setattr(f, "forecast_of", lambda true, seed, times, box, members, run: truth(seed, times, box))
    [row, _] = f._again(near, "forecast")
    [foresight] = [r for r, _ in f.sailed(near) if r.way == "foresight"]
    assert row.hours == pytest.approx(foresight.hours, rel=0.015)


def test_each_plan_of_a_forecast_is_of_a_run_of_its_own_and_of_all_members(near, monkeypatch):
    runs = []
    real = f.forecast_of

    def kept(true, seed, times, box, members, run):
        runs.append((run, times[0]))
        return real(true, seed, times, box, members=members, run=run)

    monkeypatch.setattr(f, "forecast_of", kept)
    f._again(near, "forecast")
    assert [run for run, _ in runs] == list(range(len(runs)))
    assert len(runs) >= 2
    assert np.diff([at for _, at in runs]) == pytest.approx(12 * 3600.0, abs=301.0)
    weather = near.forecast(near.begins, 0)
    assert weather.members == (0, 1, 2)
    late = near.begins + 7.9 * 86_400.0
    assert not np.isnan(weather.wind_en_mps(late, 50.5, -12.0)).any()


def test_only_who_is_careful_plans_round_strong_wind(near, monkeypatch):
    asked = []
    monkeypatch.setattr(f, "_of_members", lambda *more: asked.append(more[-1]) or NEAR.points)
    for way in ("forecast", "careful"):
        f._again(near, way)
    assert set(asked[: len(asked) // 2]) == {math.inf}
    assert set(asked[len(asked) // 2 :]) == {f.STRONG_MPS}


def test_what_is_measured_is_the_wind_here_and_now_and_the_season_s_far_away_and_late(near):
    here, now = GeoPoint(lat_deg=50.6, lon_deg=-12.2), near.begins + 30_000.0
    believed = near.measured(here, now)
    true, usual = (w.wind_en_mps(now, 50.6, -12.2)[0] for w in (near.true, near.mean))
    # The grid's own step is a degree: at its nodes about her a little less of what is measured is believed.
    assert believed.wind_en_mps(now, 50.6, -12.2)[0] - usual == pytest.approx(true - usual, rel=0.2)
    late = now + 7 * 86_400.0
    assert believed.wind_en_mps(late, 50.6, -12.2) == pytest.approx(near.mean.wind_en_mps(late, 50.6, -12.2), abs=0.1)


def test_the_way_by_hand_and_every_plan_keep_off_the_land_and_land_is_counted(near):
    island = shapely.box(-13.2, 50.0, -12.6, 51.0)
    land = replace(near, course=replace(NEAR, land=(island,)))
    found = by_way(land)
    line = shapely.LineString([p[::-1] for p in NEAR.by_hand])
    dry_m = f.GEOD.geometry_length(shapely.intersection(line, island))
    assert found["fixed"].land_km == pytest.approx(dry_m / 1000.0, rel=0.02)
    assert {row.way for row in found.values() if row.land_km > 0.0} == {"fixed"}
    for course in f.COURSES:
        way = shapely.LineString([p[::-1] for p in course.by_hand])
        straight = shapely.LineString([course.by_hand[0][::-1], course.by_hand[-1][::-1]])
        assert not any(way.intersects(shape) for shape in f.LAND)
        assert any(straight.intersects(shape) for shape in f.LAND)
        assert 1480.0 < f.GEOD.geometry_length(way) / 1000.0 < 1530.0


def test_a_departure_in_the_wind_of_files_is_drawn_by_its_number_far_from_their_edges():
    made = truth(1, 1.7e9 + np.arange(0.0, 10 * 86_400.0, 43_200.0), (-50.0, -50.0, 20.0, -10.0), 2.0)
    a, b = (f.drawn_voyage(Weather(wind=made.wind), n) for n in (4, 4))
    assert (a.course, a.begins) == (b.course, b.begins) != (f.drawn_voyage(made, 5).course, b.begins)
    for number in range(20):
        voyage = f.drawn_voyage(made, number)
        lats, lons = zip(*voyage.course.by_hand, strict=True)
        assert -45.0 < min(lats) < max(lats) < -15.0
        assert -40.0 < min(lons) < max(lons) < 8.0
        assert voyage.ends - voyage.begins >= 5 * 86_400.0 - 1.0
        assert not np.isnan(voyage.forecast(voyage.begins, 0).wind_en_mps(voyage.ends, lats[0], lons[0])).any()


def test_the_table_compares_the_same_departures_and_counts_who_did_not_arrive():
    def row(departure, way, hours, strong_h=1.0):
        return f.Row(
            course="west", departure=departure, way=way, hours=hours, strong_h=strong_h, distance_nm=9.0, land_km=0.0
        )

    rows = [
        row(d, way, hours)
        for d, four in enumerate([(100.0, 105.0, 90.0, 80.0), (200.0, 190.0, 190.0, 160.0)])
        for way, hours in zip(("fixed", "measured", "forecast", "foresight"), four, strict=True)
    ]
    rows += [row(2, way, math.inf, 4.0) for way in f.WAYS]
    rows += [row(3, way, math.inf, 0.0) for way in ("fixed", "measured", "forecast")] + [
        row(3, "foresight", 120.0, 0.0)
    ]
    said = f.table(rows).splitlines()
    assert said[2] == "| fixed | 2 of 4 | 110 | 150 | 190 | 150 |  |  |  | 3 | 1.5 | 0 |"
    assert said[4].startswith("| measured | 2 of 4 | 114 | 148 | 182 | 148 | 0.0 % |")
    assert said[5] == "| forecast | 2 of 4 | 100 | 140 | 180 | 140 | 7.5 % | 2.6 to 12.4 | 2 | 3 | 1.5 | 0 |"
    assert said[7].startswith("| foresight | 3 of 4 | 88 | 120 | 152 | 120 | 20.0 % | 20.0 to 20.0 | 2 |")


def test_rows_that_the_file_holds_are_not_sailed_again_and_are_drawn(near, tmp_path, capsys, monkeypatch):
    made = f.sailed(near)
    monkeypatch.setattr(f, "sailed", lambda voyage: made)
    monkeypatch.setattr(f, "COURSES", (replace(NEAR, name="west"),))
    made[:] = [(replace(row, course="west", departure=0), places) for row, places in made]
    asked = ["--departures", "1", "--out", str(tmp_path / "rows.csv")]
    assert f.main([*asked, "--plot", str(tmp_path / "rows.png")]) == 0
    assert (tmp_path / "rows.png").stat().st_size > 10_000
    monkeypatch.setattr(f, "sailed", None)
    assert f.main(asked) == 0
    assert capsys.readouterr().out.count("| fixed | 1 of 1 |") == 2

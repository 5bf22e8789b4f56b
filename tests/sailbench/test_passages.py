"""The passages of the bench: twelve ways in four seasons, and a judge whom no router's own figures move."""

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import shapely
from pyproj import Geod

from companion.errors import InputError
from companion.messages import GeoPoint
from companion.passage import Land
from companion.passage.plan import is_free
from sailbench.__main__ import main
from sailbench.isochrones import isochrones
from sailbench.passage_bench import (
    ROUTERS,
    PassageRow,
    companion,
    held_out,
    judged,
    read,
    router_named,
    rows,
    shortest,
    table,
    write,
)
from sailbench.passage_set import FOLDER, SEASONS, WAYS, box_of, coast, departs_utc_s, passage

GEOD = Geod(ellps="WGS84")
CELTIC, ALBORAN, FIJI = (next(w for w in WAYS if w.name == n) for n in ("celtic-sea", "alboran", "fiji-tonga"))


@pytest.fixture(scope="module")
def celtic():
    return passage(CELTIC, "summer"), departs_utc_s("summer")


def row(**more):
    base = PassageRow(
        passage="a",
        season="winter",
        router="companion",
        outcome="arrived",
        hours=10.0,
        land_km=0.0,
        over_limit_h=0.0,
        strongest_mps=9.0,
        distance_nm=60.0,
        processor_s=1.0,
        why="",
    )
    return replace(base, **more)


def test_there_are_twelve_in_four_seasons_and_all_of_them_begin_and_end_at_sea():
    assert (len(WAYS), len({w.name for w in WAYS}), len(SEASONS)) == (12, 12, 4)
    land = shapely.union_all(list(coast()))
    for way in WAYS:
        for lat, lon in (way.start, way.goal):
            assert shapely.distance(land, shapely.Point(lon, lat)) > 0.05, way.name
        west, south, east, north = box_of(way)
        assert (east - west, north - south) > (24.0, 20.0)


def test_the_weather_is_the_same_each_time_and_another_in_each_season(celtic):
    again, other = passage(CELTIC, "summer"), passage(CELTIC, "winter")
    assert np.array_equal(again.weather.wind[0].values, celtic[0].weather.wind[0].values)
    assert not np.array_equal(other.weather.wind[0].values, celtic[0].weather.wind[0].values)
    assert celtic[0].weather.wind[0].values[0, 3, 10, 10] == pytest.approx((4.6551, 5.4498), abs=0.01)


def test_our_route_is_no_slower_than_the_shortest_way(celtic):
    asked, departs = celtic
    ours, plain = (judged(asked, departs, router(asked, departs)) for router in (companion, shortest))
    assert ours["outcome"] == plain["outcome"] == "arrived"
    assert ours["hours"] < 1.005 * plain["hours"]
    assert plain["distance_nm"] < ours["distance_nm"]


def test_a_way_over_land_is_told_with_all_of_it():
    asked, departs = passage(ALBORAN, "summer"), departs_utc_s("summer")
    found = judged(asked, departs, [ALBORAN.start, ALBORAN.goal])
    places = np.array(GEOD.npts(*ALBORAN.start[::-1], *ALBORAN.goal[::-1], 500))
    line = shapely.LineString([ALBORAN.start[::-1], *places, ALBORAN.goal[::-1]])
    over = shapely.intersection(shapely.union_all(list(coast())), line).length / line.length
    assert found["outcome"] == "land"
    assert found["land_km"] == pytest.approx(over * asked.frame.length_m / 1000.0, rel=0.1)
    assert math.isfinite(found["hours"])


def test_more_wind_than_she_is_to_be_out_in_is_counted_by_the_hour(celtic):
    asked, departs = celtic
    low = replace(asked, craft=asked.craft._replace(max_tws_mps=0.5))
    found = judged(low, departs, [CELTIC.start, CELTIC.goal])
    assert found["outcome"] == "limit"
    assert found["over_limit_h"] == pytest.approx(found["hours"], rel=0.05)


def test_a_route_that_ends_short_of_the_goal_is_led_there(celtic):
    asked, departs = celtic
    whole = judged(asked, departs, [CELTIC.start, CELTIC.goal])
    middle = (0.5 * (CELTIC.start[0] + CELTIC.goal[0]), 0.5 * (CELTIC.start[1] + CELTIC.goal[1]))
    short = judged(asked, departs, [CELTIC.start, middle])
    assert short["distance_nm"] == pytest.approx(whole["distance_nm"], rel=0.01)


def test_longitudes_may_be_counted_over_the_date_line():
    asked, departs = passage(FIJI, "summer"), departs_utc_s("summer")
    far = [FIJI.start, (FIJI.goal[0], FIJI.goal[1] + 360.0)]
    assert judged(asked, departs, far) == judged(asked, departs, [FIJI.start, FIJI.goal])


def test_a_router_s_error_is_its_own(celtic):
    def broken(asked, departs):
        raise ValueError("no such wind")

    [found] = rows({"mine": broken}, ways=[CELTIC], seasons=["summer"])
    assert (found.outcome, found.why) == ("error", "ValueError: no such wind")
    assert list(rows({"mine": broken}, ways=[CELTIC], seasons=["summer"], is_made=lambda _: True)) == []


def test_rows_are_kept_as_they_were(tmp_path):
    made = [row(), row(router="mine", outcome="nothing", hours=math.inf, why='a "reason", with a comma')]
    write(tmp_path / "rows.csv", made)
    assert read(tmp_path / "rows.csv") == made
    (tmp_path / "bad.csv").write_text("passage,hours\na,b\n")
    with pytest.raises(InputError, match="holds no rows of passages"):
        read(tmp_path / "bad.csv")


def test_what_nobody_has_a_legal_route_of_is_held_out_and_land_is_no_short_cut():
    made = [
        row(),
        row(router="mine", hours=11.0),
        row(passage="b", outcome="nothing", hours=math.inf),
        row(passage="b", router="mine", outcome="limit", over_limit_h=3.0),
        row(passage="c", hours=20.0),
        row(passage="c", router="mine", outcome="land", land_km=5.0, hours=10.0),
    ]
    assert held_out(made) == [("b", "winter")]
    said = table(made)
    assert "| mine | 1 of 2 | 1 | 0 | 0 | +10.00 % | +10.00 % | +10.00 % | 2 |" in said
    assert said.endswith("held out, for nobody has a legal route: b winter")


def test_the_command_keeps_rows_and_makes_none_twice(tmp_path, capsys, monkeypatch):
    asked = ["passages", "--passages", "celtic-sea", "--seasons", "summer", "--routers", "shortest"]
    asked += ["--out", str(tmp_path / "rows.csv")]
    assert main(asked) == 0
    assert "| shortest | 1 of 1 |" in capsys.readouterr().out
    monkeypatch.setitem(ROUTERS, "shortest", None)  # which would be an error
    assert main(asked) == 0
    assert len(read(tmp_path / "rows.csv")) == 1
    assert main([*asked, "--passages", "nowhere"]) == 2
    assert "nowhere: there is no such passage" in capsys.readouterr().err


def test_a_router_that_is_not_there_is_told():
    with pytest.raises(InputError, match="there is no such router"):
        router_named("nobody")
    with pytest.raises(InputError, match="is its folder in PYTHONPATH"):
        router_named("no_module:route")
    assert router_named("companion.passage:plan")


def test_goals_are_of_the_file():
    assert passage(CELTIC, "winter").goal == GeoPoint(lat_deg=CELTIC.goal[0], lon_deg=CELTIC.goal[1])


def test_each_route_is_a_file_whose_seed_does_not_hang_on_the_others():
    for way in WAYS:
        of = tomllib.loads((FOLDER / f"{way.name}.toml").read_text(encoding="utf-8"))
        assert of.keys() == {"name", "why", "start", "goal", "seed"}
        assert (way.name, way.start, way.goal) == (of["name"], tuple(of["start"]), tuple(of["goal"]))
    assert [way.seed for way in WAYS] == [100 * (k + 1) for k in range(12)]


def test_isochrones_find_a_way_round_a_cape_that_is_little_slower(celtic):
    asked, departs = celtic
    ours, plain = (judged(asked, departs, router(asked, departs)) for router in (companion, isochrones))
    assert plain["outcome"] == "arrived"
    assert 0.99 * ours["hours"] < plain["hours"] < 1.05 * ours["hours"]
    land = shapely.box(0.2 * asked.frame.length_m, -60_000.0, 0.4 * asked.frame.length_m, 30_000.0)
    shut = replace(asked, land=Land(land))
    way = isochrones(shut, departs)
    assert is_free(shut, [GeoPoint(lat_deg=lat, lon_deg=lon) for lat, lon in way])
    assert judged(shut, departs, way)["hours"] > plain["hours"]


def _until(cube, count):
    return replace(cube, utc_s=cube.utc_s[:count], base_utc_s=cube.base_utc_s[:count], values=cube.values[:, :count])


def test_isochrones_find_none_where_no_water_leads_and_where_she_is_not_to_be_out(celtic):
    asked, departs = celtic
    ring = shapely.box(-30_000.0, -30_000.0, 30_000.0, 30_000.0).exterior.buffer(5_000.0, quad_segs=1)
    first = replace(asked.weather, wind=(_until(asked.weather.wind[0], 3),))
    assert isochrones(replace(asked, weather=first, land=Land(ring)), departs) is None
    assert isochrones(replace(asked, craft=asked.craft._replace(max_tws_mps=0.0)), departs) is None

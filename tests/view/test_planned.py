"""A passage as it is drawn: what the file holds of a route, how large it is, what is refused, where it lies."""

import math
from itertools import pairwise

import msgspec
import numpy as np
import pytest
import shapely

from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geofence.mission import MOST_PASSAGE_BYTES
from companion.messages import GeoPoint
from companion.page import LiveSource, read_planned
from companion.view.area import AreaView
from companion.view.passage import parse_planned, passage_view
from companion.view.planned import level_lines
from tests.passage.world import T0
from tests.view.planning import MEMBERS, planned


def test_it_holds_what_the_planner_found():
    _, found, drawn = planned()
    assert (drawn.members, drawn.runs, len(drawn.members_m)) == (MEMBERS, 5 * MEMBERS, MEMBERS)
    assert (drawn.departs_unix_s, drawn.run_unix_s, drawn.until_unix_s) == (T0, T0, T0 + 96 * 3600.0)
    last = drawn.waypoints[-1]
    assert (last.at, last.name) == ((0.0, 0.5), "landfall")
    for seconds, quantile in ((last.early_s, 0.1), (last.middle_s, 0.5), (last.late_s, 0.9)):
        assert seconds == pytest.approx(3600.0 * found.hours(quantile), abs=1.0)
    assert drawn.arrived == len(drawn.arrivals_s) == 5 * MEMBERS
    assert list(drawn.arrivals_s) == sorted(drawn.arrivals_s)
    assert drawn.middle_m[-1] == pytest.approx(drawn.line[-1][0], abs=1.0)
    assert all(b >= a for row in drawn.members_m for a, b in pairwise(row))
    assert any("arrives in 100 % of 45 runs" in line for line in drawn.binds)


def test_wind_and_current_are_those_that_she_meets_and_the_members_spread_is_beside_them():
    _, found, drawn = planned()
    own = found.route.sailed.member
    assert {w.wind_from_deg for w in drawn.met} <= {0.0}
    for met in drawn.met:
        assert met.wind_mps == pytest.approx(9.0 - 0.5 * own, abs=0.06)
        assert (met.low_mps, met.high_mps) == (5.0, 9.0)
        assert met.current_mps == pytest.approx(math.hypot(0.3, 0.1), abs=0.01)
        assert met.current_towards_deg == pytest.approx(72.0, abs=1.0)
    assert {0.0, drawn.waypoints[-1].middle_s} & {met.t_s for met in drawn.met}
    assert {m.current_mps for m in planned(stream=False)[2].met} == {None}


def test_what_keeps_runs_from_arriving_has_its_place():
    _, _, drawn = planned(max_tws_mps=8.2)
    assert drawn.arrived < drawn.runs == sum(end.runs for end in drawn.ends) + drawn.arrived
    assert all("more than she is to be out in" in end.why for end in drawn.ends)
    assert None in drawn.members_m[0]
    assert None not in drawn.members_m[-1]


def test_isochrones_are_where_the_search_had_those_hours():
    asked, found, drawn = planned()
    x, y, arrive = found.route.searched
    assert len(drawn.isochrones) >= 3
    for one in drawn.isochrones:
        lat, lon = np.array([place for line in one.lines for place in line]).T
        near = asked.frame.xy_from_geo(lat, lon)
        i, j = np.searchsorted(y, near[:, 1]).clip(1, len(y) - 1), np.searchsorted(x, near[:, 0]).clip(1, len(x) - 1)
        around = np.stack([arrive[i - a, j - b] for a in (0, 1) for b in (0, 1)])
        level = T0 + 3600.0 * one.hours
        assert (around.min(axis=0) <= level + 900.0).all()
        assert (around.max(axis=0) >= level - 900.0).all()


def test_lines_of_a_level_are_whole_and_where_it_is():
    x = np.linspace(-1000.0, 1000.0, 81)
    far = np.hypot(*np.meshgrid(x, x))
    [ring] = level_lines(x, x, far, 600.0)
    assert (ring[0] == ring[-1]).all()
    assert np.abs(np.hypot(*ring.T) - 600.0).max() < 2.0
    far[40, 64] = np.inf  # a place that is not known
    assert len(level_lines(x, x, far, 600.0)) >= 1
    assert level_lines(x, x, far, 5000.0) == []


def test_the_file_is_small_and_read_as_it_was_written(tmp_path):
    drawn = planned()[2]
    assert len(msgspec.json.encode(drawn)) < 30_000
    # of 64 members, with the most points, isochrones and arrivals that are written
    many = {"members_m": (drawn.members_m * 8)[:64], "arrivals_s": (drawn.arrivals_s * 9)[:400]}
    lines = tuple(msgspec.structs.replace(drawn.isochrones[0], lines=drawn.isochrones[0].lines * 20) for _ in range(32))
    drawn = msgspec.structs.replace(drawn, isochrones=lines, **{k: tuple(v) for k, v in many.items()})
    drawn = msgspec.structs.replace(drawn, arrivals_s=tuple(sorted(drawn.arrivals_s)))
    data = msgspec.json.encode(drawn)
    assert len(data) < MOST_PASSAGE_BYTES
    (tmp_path / "m.passage.json").write_bytes(data)
    assert read_planned(tmp_path / "m.toml") == drawn
    assert read_planned(tmp_path / "other.toml") is None


def changed(**to):
    raw = msgspec.json.decode(msgspec.json.encode(planned()[2]))
    return msgspec.json.encode(raw | to)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"{", "is no planned passage"),
        (b"\xff\xfe", "is no planned passage"),
        (b'{"more": ' + b"[" * 10_000, "is no planned passage"),
        (b" " * (MOST_PASSAGE_BYTES + 1), "is larger than 400 kB"),
        (lambda: changed(form="companion.passage/2"), "form: "),
        (lambda: changed(line=[[0.0, 91.0, 0.0], [1.0, 0.0, 0.0]]), "line[0][1]: "),
        (lambda: changed(line=[[5.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), "goes backwards"),
        (lambda: changed(middle_m=[0.0, 1.0]), "a value for each of `at_s`"),
        (lambda: changed(said=["x" * 301]), "said[0]: "),
        (lambda: changed(members_m=[[0.0] * 97] * 65), "members_m: "),
    ],
)
def test_what_is_no_such_file_is_one_line(data, says):
    with pytest.raises(InputError) as error:
        parse_planned(data() if callable(data) else data, "m.passage.json")
    words = str(error.value)
    assert words.startswith("m.passage.json: ")
    assert says in words
    assert words.endswith("write it anew with companion passage plan --out")
    assert "\n" not in words


def test_on_a_chart_it_lies_where_it_is_and_north_is_true():
    _, _, drawn = planned()
    origin = GeoPoint(lat_deg=60.0, lon_deg=0.0)
    north = msgspec.structs.replace(drawn, met=tuple(msgspec.structs.replace(m, at=(60.0, 4.0)) for m in drawn.met[:1]))
    view = passage_view(north, LocalFrame(origin).array_en_from_lonlat)
    # an azimuthal chart turns a meridian that is 4 degrees off by 4 sin 60 degrees, towards its own
    assert view.met[0].north_deg == pytest.approx(-4.0 * math.sin(math.radians(60.0)), abs=0.1)
    here = LocalFrame(GeoPoint(lat_deg=0.0, lon_deg=0.0))
    view = passage_view(drawn, here.array_en_from_lonlat)
    assert view.waypoints[-1].at_en_m == pytest.approx(here.en_from_geo(GeoPoint(lat_deg=0.0, lon_deg=0.5)), abs=1.0)
    [band] = view.band
    water = shapely.Polygon(band[0])
    middle = shapely.Point(view.line[len(view.line) // 2][1:])
    assert water.contains(middle)
    assert water.exterior.distance(middle) == pytest.approx(drawn.waypoints[1].band_m, rel=0.05)
    assert msgspec.json.decode(msgspec.json.encode(view))["name"] == "along the line"


def test_the_page_makes_it_once_for_an_area():
    live = LiveSource(name="line", planned=planned()[2])
    assert live.passage() is None  # not before it is known where its metres are
    live.area = AreaView(hash="a", name="l", origin_lat_deg=0.0, origin_lon_deg=0.0, lat_m=1.1e5, lon_m=1.1e5)
    first = live.passage()()
    assert live.passage()() is first
    live.area = AreaView(hash="b", name="l", origin_lat_deg=0.0, origin_lon_deg=0.1, lat_m=1.1e5, lon_m=1.1e5)
    assert live.passage()() != first
    assert live.hello()["passage"] is True
    assert LiveSource(name="x").hello()["passage"] is False
    assert LiveSource(name="x", area=live.area).passage() is None

"""Charts under the page: both formats give the same tiles, what is none is refused in a line."""

import contextlib
import json
import os
import sqlite3

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from companion.errors import InputError
from companion.page import LiveSource, open_charts
from companion.page.charts import NO_TILE, open_chart
from tests.page.asking import with_page
from tests.page.charting import BOUNDS, mbtiles, painted, pmtiles, tile_of

PLACE = (50.7, -1.8)
ZOOMS = range(10, 14)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    folder = tmp_path_factory.mktemp("charts")
    first = mbtiles(folder / "a.mbtiles", zooms=ZOOMS)
    return first, pmtiles(folder / "a.pmtiles", first)


def test_both_formats_give_the_same_tiles_and_say_the_same(both):
    one, other = open_charts(both)
    for chart in (one, other):
        assert chart.name == "Painted depths"
        assert chart.credit == "© nobody"
        assert chart.bounds_deg == pytest.approx(BOUNDS)
        assert (chart.least_zoom, chart.most_zoom) == (10, 13)
    for z in ZOOMS:
        x, y = tile_of(*PLACE, z)
        assert one.tile(z, x, y) == other.tile(z, x, y) == ("image/png", painted(z, x, y))
    assert one.tag != other.tag


@given(z=st.integers(-3, 40), x=st.integers(-5, 1 << 40), y=st.integers(-5, 1 << 40))
@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_where_there_is_no_tile_the_water_is_clear(both, z, x, y):
    for chart in open_charts(both):
        kind, data = chart.tile(z, x, y)
        assert kind == "image/png"
        assert data == NO_TILE or (z in ZOOMS and data == painted(z, x, y))


@pytest.mark.parametrize(
    ("made", "problem"),
    [
        (lambda path: path.write_bytes(b"KAP/BSB chart"), "neither MBTiles nor PMTiles"),
        (lambda path: path.write_bytes(b""), "neither MBTiles nor PMTiles"),
        (lambda path: path.write_bytes(b"SQLite format 3\0" + b"\xff" * 3000), "broken chart"),
        (lambda path: path.write_bytes(b"PMTiles\x03" + b"\xff" * 300), "chart"),
        (lambda path: sqlite3.connect(path).execute("CREATE TABLE voyages (a)").connection.close(), "no MBTiles"),
        (lambda path: mbtiles(path, zooms=()), "without tiles"),
        (lambda path: mbtiles(path, zooms=(10,), format="pbf"), "vector tiles"),
        (lambda path: mbtiles(path, zooms=(10,), format="geojson"), "not known"),
        (lambda path: path.mkdir(), "is a folder"),
        (lambda path: None, "no such file"),
    ],
)
def test_what_is_no_chart_is_refused_in_one_line(tmp_path, made, problem):
    path = tmp_path / "what #1 100%.mbtiles"
    made(path)
    with pytest.raises(InputError, match=problem) as refused:
        open_chart(path)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_vector_tiles_in_pmtiles_are_refused(tmp_path):
    vectors = mbtiles(
        tmp_path / "v.mbtiles",
        zooms=(10,),
        tile=lambda *_: b"\x1f\x8b vectors",
        format="pbf",
        json=json.dumps({"vector_layers": []}),
    )
    with pytest.raises(InputError, match="vector tiles"):
        open_chart(pmtiles(tmp_path / "v.pmtiles", vectors))


def test_what_is_no_picture_is_not_served_as_one(tmp_path):
    evil = b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'/>"
    chart = open_chart(mbtiles(tmp_path / "e.mbtiles", zooms=(10,), tile=lambda *_: evil))
    assert chart.tile(10, *tile_of(*PLACE, 10)) == ("image/png", NO_TILE)


def test_a_chart_without_bounds_or_with_such_as_cannot_be_is_looked_for_everywhere(tmp_path):
    for number, bounds in enumerate((None, "1,2,3", "nan,0,1,1", "10,5,-10,7", "0,0,400,10")):
        chart = open_chart(_with_bounds(tmp_path / f"{number}.mbtiles", bounds))
        assert chart.bounds_deg == (-180.0, -90.0, 180.0, 90.0)


def _with_bounds(path, bounds):
    mbtiles(path, zooms=(10,))
    with sqlite3.connect(path) as base:
        base.execute("DELETE FROM metadata WHERE name = 'bounds'")
        if bounds is not None:
            base.execute("INSERT INTO metadata VALUES ('bounds', ?)", (bounds,))
    base.close()
    return path


@given(data=st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_chart_with_flipped_bytes_is_refused_or_gives_pictures(both, tmp_path, data):
    path = data.draw(st.sampled_from(both))
    raw = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 20))):
        raw[data.draw(st.integers(0, min(len(raw), 20_000) - 1))] = data.draw(st.integers(0, 255))
    broken = tmp_path / path.name
    broken.write_bytes(raw[: data.draw(st.integers(100, len(raw)))])
    with contextlib.suppress(InputError):
        chart = open_chart(broken)
        for z in ZOOMS:
            assert chart.tile(z, *tile_of(*PLACE, z))[0] == "image/png"


def test_a_chart_that_is_cut_short_or_replaced_under_way_is_clear_water(both, tmp_path):
    """Of PMTiles the companion died with the voyage (SIGBUS): copying a newer chart over it cuts it short first."""
    z, (x, y) = 13, tile_of(*PLACE, 13)
    for source in both:
        path = tmp_path / source.name
        path.write_bytes(source.read_bytes())
        chart = open_chart(path)
        assert chart.tile(z, x, y) == ("image/png", painted(z, x, y))
        os.truncate(path, 200)
        assert chart.tile(z, x, y) == ("image/png", NO_TILE)
        path.write_bytes(source.read_bytes())
        assert chart.tile(z, x, y) == ("image/png", painted(z, x, y))


def test_the_page_serves_tiles_that_a_browser_keeps_and_no_others(both):
    charts = open_charts(both)

    async def talk(browser, *_):
        x, y = tile_of(*PLACE, 12)
        hello = json.loads((await browser.get("/api/hello"))[2])
        told = [
            await browser.get(f"/tiles/{chart['tag']}/12/{x}/{y}", Accept_Encoding="gzip") for chart in hello["charts"]
        ]
        others = [
            (await browser.get(path))[0]
            for path in (
                "/tiles/000000000000/12/1/1",
                f"/tiles/{charts[0].tag}/12/1",
                f"/tiles/{charts[0].tag}/-1/1/1",
                f"/tiles/{charts[0].tag}/1/1/999999999",
                f"/tiles/..%2f{charts[0].tag}/1/1/1",
            )
        ]
        return hello, told, others, painted(12, x, y)

    hello, told, others, right = with_page(talk, LiveSource(name="a"), charts=charts)
    assert [chart["name"] for chart in hello["charts"]] == ["Painted depths"] * 2
    assert "path" not in json.dumps(hello)
    for status, headers, body in told:
        assert (status, body) == (200, right)
        assert headers["content-type"] == "image/png"
        assert "immutable" in headers["cache-control"]
        assert "content-encoding" not in headers
    assert others == [404] * 5

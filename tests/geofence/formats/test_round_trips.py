"""Every format, there and back: equal but for what the writer announced."""

import itertools
from dataclasses import replace

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from companion.geofence.document import Document, FindingLevel
from companion.geofence.formats.registry import parse, write
from companion.geofence.shapes import Circle, Zone, ZoneKind
from tests.geofence.strategies import QUIET, documents

SETTINGS = settings(**QUIET, max_examples=40)
EXTENSION = {
    "wkt": ".wkt",
    "ewkt": ".wkt",
    "geojson": ".geojson",
    "plan": ".plan",
    "waypoints": ".waypoints",
    "fen": ".fen",
    "poly": ".poly",
    "gpx": ".gpx",
    "kml": ".kml",
    "kmz": ".kmz",
    "rally": ".rally",
}


def there_and_back(document: Document, name: str, **options) -> tuple[Document, tuple]:
    written = write(document, "", format_name=name, **options)
    back = parse(written.data, f"x{EXTENSION[name]}", extension=EXTENSION[name])
    assert not [f for f in back.findings if f.severity is FindingLevel.ERROR], back.findings
    return back, written.losses


def zone_key(zone, *, name=True, margin=True):
    """A zone as a comparable value: rings start and turn as they like."""
    if isinstance(zone.shape, Circle):
        shape = ("circle", zone.shape.center.lat_deg, zone.shape.center.lon_deg, zone.shape.radius_m)
    else:
        shape = ("polygon", shapely.to_wkb(shapely.normalize(zone.shape)))
    return (zone.kind.value, shape, zone.name if name else "", zone.margin_m if margin else None)


def mark_key(mark):
    return (mark.kind.value, mark.geometry.wkb, mark.name, mark.margin_m)


@SETTINGS
@given(documents())
def test_geojson_carries_everything(document):
    back, losses = there_and_back(document, "geojson") if not document.is_empty else (document, ())
    assert losses == ()
    assert [zone_key(z) for z in back.zones] == [zone_key(z) for z in document.zones]
    assert [mark_key(m) for m in back.marks] == [mark_key(m) for m in document.marks]
    for part in ("items", "rally", "tracks", "home", "return_point"):
        assert getattr(back, part) == getattr(document, part), part


@SETTINGS
@given(documents(holes=False, tracks=False, marks=False, names=False, margins=False))
def test_plan_carries_mission_fence_and_rally(document):
    back, losses = there_and_back(document, "plan")
    assert all(f.severity is FindingLevel.NOTE for f in losses) or document.is_empty, losses
    assert sorted(map(repr, map(zone_key, back.zones))) == sorted(map(repr, map(zone_key, document.zones)))
    assert (back.items, back.rally, back.return_point) == (document.items, document.rally, document.return_point)
    if document.home is not None:
        assert back.home == document.home
    else:
        assert not document.items or losses or not any(i.lat_e7 for i in document.items)


@SETTINGS
@given(documents(item_count=(1, 8), zone_count=(0, 0), rally=False, tracks=False, marks=False, extras=True))
def test_waypoints_carry_missions(document):
    document = replace(document, return_point=None)
    back, _ = there_and_back(document, "waypoints", part="mission")
    assert back.items == document.items
    if document.home is not None:
        assert back.home == document.home


@SETTINGS
@given(
    documents(
        zone_count=(1, 5),
        item_count=(0, 0),
        holes=False,
        rally=False,
        tracks=False,
        marks=False,
        names=False,
        margins=False,
    )
)
def test_waypoints_carry_fences(document):
    back, losses = there_and_back(replace(document, home=None), "waypoints", part="fence")
    assert losses == ()  # all coordinates are on the wire's lattice
    assert [zone_key(z) for z in back.zones] == [zone_key(z) for z in document.zones]
    assert back.return_point == document.return_point


@SETTINGS
@given(
    documents(
        zone_count=(1, 5), item_count=(0, 0), circles=False, margins=False, rally=False, tracks=False, extras=False
    ),
    st.sampled_from(["wkt", "ewkt"]),
)
def test_wkt_carries_polygons_and_marks(document, name):
    back, losses = there_and_back(document, name)
    assert losses == ()

    def clean(text):
        return " ".join(text.split())

    assert [zone_key(replace(z, name=clean(z.name))) for z in back.zones] == [zone_key(z) for z in document.zones]
    assert [mark_key(m) for m in back.marks] == [mark_key(m) for m in document.marks]


@SETTINGS
@given(documents(circles=False, holes=False, commands=False, margins=False))
def test_gpx_carries_routes_areas_and_tracks(document):
    if document.is_empty:
        return
    back, losses = there_and_back(document, "gpx")
    assert all(f.severity is FindingLevel.NOTE for f in losses), losses
    assert [zone_key(z) for z in back.zones] == [zone_key(z) for z in document.zones]
    assert sorted(map(repr, map(mark_key, back.marks))) == sorted(map(repr, map(mark_key, document.marks)))
    assert (back.items, back.rally, back.tracks) == (document.items, document.rally, document.tracks)
    assert (back.home, back.return_point) == (document.home, document.return_point)


@SETTINGS
@given(documents(circles=False, commands=False), st.sampled_from(["kml", "kmz"]))
def test_kml_carries_routes_areas_and_tracks(document, name):
    if document.is_empty:
        return
    back, losses = there_and_back(document, name)
    assert all(f.severity is FindingLevel.NOTE for f in losses), losses
    assert [zone_key(z) for z in back.zones] == [zone_key(z) for z in document.zones]
    assert [mark_key(m) for m in back.marks] == [mark_key(m) for m in document.marks]
    assert (back.items, back.rally, back.tracks) == (document.items, document.rally, document.tracks)
    assert (back.home, back.return_point) == (document.home, document.return_point)


@SETTINGS
@given(
    documents(
        zone_count=(1, 1),
        item_count=(0, 0),
        circles=False,
        holes=False,
        names=False,
        margins=False,
        marks=False,
        rally=False,
        tracks=False,
        kinds=ZoneKind.INCLUSION,
    )
)
def test_fen_carries_one_ring_and_the_return_point(document):
    back, losses = there_and_back(replace(document, home=None), "fen")
    assert [zone_key(z) for z in back.zones] == [zone_key(z) for z in document.zones]
    assert back.return_point == document.return_point or any("return point" in f.text for f in losses)


@SETTINGS
@given(
    documents(
        zone_count=(1, 1),
        item_count=(0, 0),
        circles=False,
        holes=False,
        names=False,
        margins=False,
        marks=False,
        rally=False,
        tracks=False,
        kinds=ZoneKind.EXCLUSION,
        extras=False,
    )
)
def test_poly_carries_one_ring(document):
    back, _ = there_and_back(document, "poly")
    assert [zone_key(z) for z in back.zones] == [zone_key(z) for z in document.zones]


@pytest.mark.parametrize(("name", "part"), [("plan", None), ("waypoints", "fence"), ("gpx", None)])
def test_a_keep_out_zone_with_holes_keeps_their_water(name, part):
    """What no chart covers lies all round the water of an import: filled, it covered the start and the goal."""
    inside = [shapely.box(x, y, x + 0.01, y + 0.02) for x in (0.02, 0.05) for y in (0.02, 0.06)]
    atoll = Polygon(shapely.box(0.0, 0.0, 0.1, 0.1).exterior, [lagoon.exterior for lagoon in inside])
    document = Document(zones=(Zone(kind=ZoneKind.EXCLUSION, shape=atoll, name="atoll"),))
    back, losses = there_and_back(document, name, **({} if part is None else {"part": part}))
    assert all(f.severity is FindingLevel.NOTE for f in losses)
    assert shapely.symmetric_difference(water(back), shapely.union_all(inside)).area < 1e-12


def water(document: Document) -> shapely.Geometry:
    """What the keep-in zones leave less the keep-out zones; everything round the place without keep-in zones."""
    from companion.geofence.shapes import drawn

    inside = [drawn(z) for z in document.zones if z.kind is ZoneKind.INCLUSION]
    sea = shapely.box(*shapely.total_bounds([drawn(z) for z in document.zones]))
    for polygon in inside:
        sea = shapely.intersection(sea, polygon)
    return shapely.difference(
        sea, shapely.union_all([drawn(z) for z in document.zones if z.kind is ZoneKind.EXCLUSION] or [Polygon()])
    )


PAIRS = list(itertools.permutations(["wkt", "geojson", "plan", "waypoints", "gpx", "kml"], 2))


@pytest.mark.parametrize(("first", "second"), PAIRS)
@settings(**QUIET, max_examples=5)
@given(documents(zone_count=(1, 4), item_count=(0, 0), marks=False, rally=False, tracks=False, extras=False))
def test_no_pair_of_formats_makes_the_sea_larger(first, second, document):
    options = {"part": "fence"}
    one, _ = there_and_back(document, first, **options)
    two, losses = there_and_back(one, second, **options)
    grown = shapely.difference(water(two), shapely.buffer(water(document), 2e-7))
    assert grown.area < 1e-13
    announced = bool(losses) or bool(write(document, "", format_name=first, **options).losses)
    if not announced:
        assert shapely.difference(water(document), shapely.buffer(water(two), 2e-7)).area < 1e-13


def test_what_is_left_out_is_announced():
    document = parse(b"Rock|exclusion|POLYGON ((0 0, 1 0, 1 1, 0 0))\n|exclusion|POINT (2 2)\n", "a.wkt")
    losses = write(document, "b.fen").losses
    assert {f.severity for f in losses} >= {FindingLevel.ERROR}
    assert any("keep-in ring" in f.text for f in losses)
    assert any("point or line" in f.text for f in losses)


@pytest.mark.parametrize("kind", list(ZoneKind))
def test_a_poly_of_ours_is_read_again_as_the_kind_that_it_was(kind):
    """A zone to keep in came back as one to keep out of."""
    ring = Polygon([(147.355, -42.91), (147.39, -42.91), (147.39, -42.89), (147.355, -42.89)])
    back, _ = there_and_back(Document(zones=(Zone(kind=kind, shape=ring),)), "poly")
    assert [z.kind for z in back.zones] == [kind]

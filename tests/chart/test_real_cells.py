"""Harbours of a real cell: each in seconds, every charted danger in an obstacle, hardly any free water lost.

The cell is fetched by nobody here: put NOAA's US4MD81M.000 (and its updates) into a folder and name it in $ENC_CELLS.
What the cell says is read again by a reader of its own: OGR's rows as they are, none of ``companion.chart``.
"""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import numpy as np
import pytest
import shapely

from companion.chart import Wanted, area_of, box_about, read_chart
from companion.geofence.shapes import polygon_en
from companion.messages import GeoPoint

CELL = Path(os.environ.get("ENC_CELLS", "")) / "US4MD81M.000"
pytestmark = pytest.mark.skipif(
    "ENC_CELLS" not in os.environ or not CELL.is_file(), reason="no real cell: $ENC_CELLS names no folder with it"
)
HARBOURS = {
    "Annapolis": (38.970, -76.470),
    "South River": (38.925, -76.490),
    "Rhode River": (38.880, -76.520),
    "Deale": (38.780, -76.540),
    "Chesapeake Beach": (38.690, -76.525),
    "Knapps Narrows": (38.719, -76.335),
    "Saint Michaels": (38.790, -76.220),
    "Kent Island Narrows": (38.965, -76.246),
    "Queenstown Creek": (38.995, -76.165),
    "Choptank River": (38.600, -76.120),
}
RADIUS_M, DEPTH_M = 3000.0, 1.4
MOST_S, MOST_LOST = 10.0, 0.02


def rows(layer):
    """Return the shapes of a class and their attributes, as OGR has them; SOUNDG comes point by point, with depths."""
    pyogrio = pytest.importorskip("pyogrio")
    options = {"SPLIT_MULTIPOINT": "ON", "ADD_SOUNDG_DEPTH": "ON"}
    if layer not in {str(name) for name, _ in pyogrio.list_layers(CELL)}:
        return []
    meta, _, shapes, columns = pyogrio.raw.read(CELL, layer=layer, **options)
    names = [str(name) for name in meta["fields"]]
    return [
        (shapely.from_wkb(shape), {name: column[n] for name, column in zip(names, columns, strict=True)})
        for n, shape in enumerate(shapes)
        if shape is not None
    ]


def number(value):
    return None if value is None or not math.isfinite(float(value)) else float(value)


def dangers(layer):
    """Yield the shapes of a class that are land or less deep than the boat needs."""
    for shape, told in rows(layer):
        if layer in {"DEPARE", "DRGARE"}:
            depth = number(told.get("DRVAL1"))
        elif layer == "SOUNDG":
            depth = number(told.get("DEPTH"))
        elif layer in {"WRECKS", "OBSTRN", "UWTROC"}:
            depth = number(told.get("VALSOU"))
        else:
            depth = None
        if layer == "SOUNDG" and depth is None:
            continue
        if layer == "WRECKS" and told.get("CATWRK") in (1, "1"):
            continue  # a harmless wreck
        if depth is None or depth < DEPTH_M:
            yield shape


def parts_en(shape, frame):
    """Yield the points, lines and polygons of a shape in metres."""
    for part in shapely.get_parts(shape):
        flat = shapely.force_2d(part)
        yield shapely.transform(flat, frame.array_en_from_lonlat)


@pytest.fixture(scope="module", params=sorted(HARBOURS))
def harbour(request):
    lat, lon = HARBOURS[request.param]
    center = GeoPoint(lat_deg=lat, lon_deg=lon)
    began = time.process_time()
    chart = read_chart(CELL, box_about(center, RADIUS_M), Wanted(safety_depth_m=DEPTH_M))
    area = area_of([chart], center, RADIUS_M)
    took_s = time.process_time() - began
    return request.param, area, took_s


def test_it_is_made_within_seconds(harbour):
    name, area, took_s = harbour
    assert took_s < MOST_S, name
    assert area.solids
    assert not area.is_too_much


def test_every_charted_danger_lies_in_an_obstacle(harbour):
    name, area, _ = harbour
    solid = shapely.union_all([shapely.make_valid(polygon_en(s.shape, area.frame)) for s in area.solids])
    shapely.prepare(solid)
    disc = shapely.buffer(shapely.points(0.0, 0.0), RADIUS_M - 5.0, quad_segs=16)
    looked_at = 0
    for layer in ("LNDARE", "DEPARE", "DRGARE", "UNSARE", "SOUNDG", "WRECKS", "OBSTRN", "UWTROC", "SLCONS"):
        for shape in dangers(layer):
            for part in parts_en(shape, area.frame):
                near = shapely.intersection(part if part.is_valid else shapely.make_valid(part), disc)
                if near.is_empty:
                    continue
                looked_at += 1
                missed = shapely.difference(near, solid)
                assert missed.is_empty or (shapely.area(missed) < 1.0 and shapely.length(missed) < 5.0), (name, layer)
    assert looked_at > 5, name


def test_hardly_any_free_water_is_lost(harbour):
    name, area, _ = harbour
    solid = shapely.union_all([shapely.make_valid(polygon_en(s.shape, area.frame)) for s in area.solids])
    disc = shapely.buffer(shapely.points(0.0, 0.0), RADIUS_M, quad_segs=16)
    true = [
        shapely.make_valid(part)
        for layer in ("LNDARE", "DEPARE", "DRGARE", "UNSARE")
        for shape in dangers(layer)
        for part in parts_en(shape, area.frame)
        if part.geom_type == "Polygon"
    ]
    charted = shapely.union_all(
        [
            shapely.make_valid(part)
            for layer in ("LNDARE", "DEPARE", "DRGARE")
            for shape, _ in rows(layer)
            for part in parts_en(shape, area.frame)
            if part.geom_type == "Polygon" and shapely.intersects(shapely.make_valid(part), disc)
        ]
    )
    free = shapely.area(shapely.intersection(shapely.difference(charted, shapely.union_all(true)), disc))
    # what is only a mark on the chart is drawn with its radius: that is its margin, and no loss
    marks = shapely.union_all(
        [
            shapely.buffer(part, 15.0)
            for layer in (
                "SOUNDG",
                "WRECKS",
                "OBSTRN",
                "UWTROC",
                "SLCONS",
                "BCNLAT",
                "BCNSPP",
                "BOYLAT",
                "BOYSPP",
                "PILPNT",
                "BRIDGE",
                "CBLOHD",
                "MORFAC",
                "PONTON",
                "OFSPLF",
                "MARCUL",
                "FSHFAC",
            )
            for shape, _ in rows(layer)
            for part in parts_en(shape, area.frame)
            if shapely.dwithin(part, disc, 20.0)
        ]
    )
    taken = shapely.difference(shapely.intersection(solid, disc), shapely.union_all([*true, marks]))
    lost = shapely.area(shapely.intersection(taken, charted)) / free
    print(f"{name}: {len(area.solids)} obstacles, {100.0 * lost:.2f} % of {free / 1e6:.1f} km2 of free water lost")
    assert lost <= MOST_LOST, name
    assert np.isfinite(lost)

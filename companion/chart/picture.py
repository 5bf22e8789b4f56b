"""A chart as a picture: depths, shores, contours, soundings and names, cut into tiles for every scale of a screen.

A level of detail has a tolerance: what is smaller is not in its tiles, shapes are simplified by it, of soundings the
least depth of a neighbourhood is kept. So a tile holds as much as a screen can show, whatever the chart holds. What is
solid for a boat is made from the chart itself (``companion.chart.compile``), never from its picture.
"""

from __future__ import annotations

import functools
import json
import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.chart.features import Chart, Row, Source
from companion.chart.s57 import BUOYS, DEPTH_AREAS
from companion.geo import DEGREE_M

FINEST_M = 0.5  # what level 0 leaves out; each further level twice that
LEVELS = 13
UNITS = 4  # positions of a tile are counted in, for each tolerance: a screen shows half of a tolerance at the most
TILE_UNITS = 4096
OVERLAP_UNITS = 8  # beyond a tile's edge, so that no seam shows between two
KEPT_TILES = 256
EQUATOR_DEGREE_M = 111_320.0

# How far apart they are kept, in tolerances: 30 to 60 pixels between two soundings.
APART = {"sounding": 120.0, "name": 360.0, "mark": 30.0}

AREAS = ("depth", "unknown", "land", "built")  # painted in this order, depths from deep to shallow
LINES = ("contour", "shore", "danger")
_BUILT = frozenset({"FLODOC", "HULKES", "PONTON", "SLCONS", "DAMCON", "OFSPLF", "PYLONS", "BRIDGE", "GATCON"})
_SHORES = frozenset({"COALNE", "SLCONS", "LNDARE", "DYKCON", "DAMCON", "PONTON"})
_NAMED = frozenset({"SEAARE", "LNDRGN", "BUAARE", "LNDARE"})
_DANGERS = {"UWTROC": "rock", "WRECKS": "wreck", "OBSTRN": "obstruction"}
DRAWN = frozenset({"DEPCNT", "COALNE", "SEAARE", "LNDRGN", "BUAARE"})
"""Classes of a cell that are drawn and say nothing of what is solid."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """Something drawn: its kind, its shape in longitude and latitude [deg], the depth [m] and the words beside it."""

    kind: str
    geometry: BaseGeometry
    depth_m: float | None = None
    text: str = ""


def marks_of_rows(rows: Iterable[Row]) -> list[Mark]:
    """Return what is drawn of a cell's features."""
    return [mark for row in rows if not row.geometry.is_empty for mark in _marks_of(row)]


def _marks_of(row: Row) -> list[Mark]:
    layer, shape, name = row.layer, row.geometry, row.text("OBJNAM")
    is_area, is_line = shape.geom_type.endswith("Polygon"), shape.geom_type.endswith("LineString")
    out: list[Mark] = []
    if name and layer in _NAMED:
        out.append(Mark(kind="name", geometry=shapely.point_on_surface(shape), depth_m=-_size(shape), text=name))
    if layer in DEPTH_AREAS and is_area:
        depth_m = row.number("DRVAL1")
        out.append(Mark(kind="unknown" if depth_m is None else "depth", geometry=shape, depth_m=depth_m))
    elif layer == "SOUNDG":
        points = shapely.get_parts(shape)
        for point, depth_m in zip(shapely.force_2d(points), shapely.get_z(points), strict=True):
            if math.isfinite(depth_m):
                out.append(Mark(kind="sounding", geometry=point, depth_m=float(depth_m)))
    elif layer == "DEPCNT" and is_line:
        out.append(Mark(kind="contour", geometry=shape, depth_m=row.number("VALDCO")))
    elif layer in _DANGERS:
        depth_m = row.number("VALSOU")
        if is_area:
            out.append(Mark(kind="danger", geometry=shapely.boundary(shape), depth_m=depth_m))
        out.append(Mark(kind=_DANGERS[layer], geometry=shapely.point_on_surface(shape), depth_m=depth_m, text=name))
    elif layer == "UNSARE" and is_area:
        out.append(Mark(kind="unknown", geometry=shape))
    elif layer == "LNDARE" and is_area:
        out.append(Mark(kind="land", geometry=shape))
    elif layer in _BUILT and is_area:
        out.append(Mark(kind="built", geometry=shape))
    elif layer in _SHORES and is_line:
        out.append(Mark(kind="shore", geometry=shape))
    elif layer == "LNDARE":
        out.append(Mark(kind="rock", geometry=shape, text=name))
    elif layer[:3] in BUOYS or layer in {"LITFLT", "LITVES"}:
        kind = "beacon" if layer.startswith("BCN") else "buoy"
        out.append(Mark(kind=kind, geometry=shapely.point_on_surface(shape), text=name))
    elif shape.geom_type == "Point" and layer in {"PILPNT", "MORFAC", "OFSPLF", "PYLONS"}:
        out.append(Mark(kind="pile", geometry=shape, text=name))
    return out


def _size(shape: BaseGeometry) -> float:
    west, south, east, north = shapely.bounds(shape)
    return float((east - west) * math.cos(math.radians((south + north) / 2.0)) + north - south)


_POINTS = frozenset({"rock", "wreck", "obstruction", "buoy", "beacon", "pile"})


def marks_of_chart(chart: Chart) -> list[Mark]:
    """Return what is drawn of a chart that is no cell: its dangers as land, shores, shallows and points."""
    out: list[Mark] = []
    for danger in chart.dangers:
        kind = danger.geometry.geom_type
        if kind.endswith("Polygon"):
            is_shallow = danger.depth_m is not None
            out.append(Mark(kind="depth" if is_shallow else "land", geometry=danger.geometry, depth_m=danger.depth_m))
            if danger.name:
                at = shapely.point_on_surface(danger.geometry)
                out.append(Mark(kind="name", geometry=at, depth_m=-_size(danger.geometry), text=danger.name))
        elif kind.endswith("LineString"):
            out.append(Mark(kind="shore", geometry=danger.geometry))
        else:
            word = danger.reason if danger.reason in _POINTS else "danger"
            out += [
                Mark(kind=word, geometry=point, depth_m=danger.depth_m, text=danger.name)
                for point in shapely.get_parts(danger.geometry)
            ]
    return out


@dataclass(frozen=True, slots=True)
class _Level:
    tolerance_m: float
    marks: tuple[Mark, ...]
    shapes: NDArray[np.object_]  # in the picture's metres
    tree: shapely.STRtree


class ChartPicture:
    """The marks of one chart in metres east and north of its south-western corner, by levels of detail and tiles."""

    def __init__(self, source: Source, marks: Sequence[Mark], resolution_m: float = math.inf) -> None:
        self.source, self.resolution_m = source, resolution_m
        shapes = np.array([shapely.force_2d(m.geometry) for m in marks], dtype=object)
        kept = [n for n, shape in enumerate(shapes) if not shape.is_empty]
        self.marks = tuple(marks[n] for n in kept)
        west, south, east, north = shapely.total_bounds(shapes[kept]) if kept else (0.0, 0.0, 0.0, 0.0)
        self.bounds_deg = (float(west), float(south), float(east), float(north))
        self.lon_m = EQUATOR_DEGREE_M * max(0.01, math.cos(math.radians((south + north) / 2.0)))
        corner, scale = np.array([west, south]), np.array([self.lon_m, DEGREE_M])
        self._shapes = shapely.transform(shapes[kept], lambda lonlat: (lonlat - corner) * scale) if kept else shapes[:0]
        self.level = functools.lru_cache(LEVELS)(self._made)
        self.tile = functools.lru_cache(KEPT_TILES)(self._cut)

    def facts(self) -> dict[str, object]:
        """Return what a page has to know of it."""
        west, south, east, north = self.bounds_deg
        return {
            "name": str(self.source),
            "corner": [south, west],
            "lat_m": DEGREE_M,
            "lon_m": self.lon_m,
            "wide_m": round((east - west) * self.lon_m, 1),
            "tall_m": round((north - south) * DEGREE_M, 1),
            "finest_m": FINEST_M,
            "levels": LEVELS,
            "units": UNITS,
            "tile_units": TILE_UNITS,
        }

    def _made(self, level: int) -> _Level:
        """Return what is drawn at a level of detail."""
        tolerance_m = FINEST_M * 2.0**level
        kinds = np.array([m.kind for m in self.marks], dtype=object)
        is_shape = np.isin(kinds, (*AREAS, *LINES))
        shapes = self._shapes.copy()
        shapes[is_shape] = shapely.simplify(shapes[is_shape], tolerance_m, preserve_topology=False)
        is_area = np.isin(kinds, AREAS)
        keep = ~shapely.is_empty(shapes)
        keep[is_area] &= shapely.area(self._shapes[is_area]) > tolerance_m**2
        keep[is_shape & ~is_area] &= shapely.length(shapes[is_shape & ~is_area]) > 2.0 * tolerance_m
        for word, apart in APART.items():
            mine = np.nonzero((kinds == word) if word != "mark" else ~is_shape & ~np.isin(kinds, list(APART)))[0]
            keep[mine] &= self._thinned(mine, apart * tolerance_m)
        chosen = np.nonzero(keep)[0]
        return _Level(
            tolerance_m, tuple(self.marks[n] for n in chosen), shapes[chosen], shapely.STRtree(shapes[chosen])
        )

    def _thinned(self, mine: NDArray[np.intp], cell_m: float) -> NDArray[np.bool_]:
        """Return which of some points are kept: of each cell the one that is least deep (or the largest name)."""
        if not len(mine):
            return np.zeros(0, dtype=bool)
        xy = shapely.get_coordinates(self._shapes[mine])[: len(mine)]
        depths = np.array([math.inf if (d := self.marks[n].depth_m) is None else d for n in mine])
        cells = np.floor(xy / cell_m).astype(np.int64)
        order = np.lexsort((np.arange(len(mine)), depths))
        _, first = np.unique(cells[order], axis=0, return_index=True)
        out = np.zeros(len(mine), dtype=bool)
        out[order[first]] = True
        return out

    def _cut(self, level: int, x: int, y: int) -> bytes:
        """Return a tile as JSON: areas, lines and points, in whole units from its south-western corner."""
        of = self.level(level)
        unit_m = of.tolerance_m / UNITS
        west_m, south_m, wide_m, more_m = (
            unit_m * n for n in (x * TILE_UNITS, y * TILE_UNITS, TILE_UNITS, OVERLAP_UNITS)
        )
        box = (west_m - more_m, south_m - more_m, west_m + wide_m + more_m, south_m + wide_m + more_m)
        found = np.sort(of.tree.query(shapely.box(*box)))
        corner = np.array([west_m, south_m])
        areas: dict[tuple[int, float], list[list[int]]] = defaultdict(list)
        lines: dict[tuple[int, float | None], list[list[int]]] = defaultdict(list)
        points: list[list[object]] = []
        for n, shape in zip(found, shapely.clip_by_rect(of.shapes[found], *box), strict=True):
            mark = of.marks[n]
            if shape.is_empty:
                continue
            if mark.kind in AREAS:
                # -depth: those are painted from deep to shallow
                key = AREAS.index(mark.kind), -mark.depth_m if mark.depth_m is not None else 0.0
                # all one way round: where two areas lie over each other nothing is open
                whole = [shapely.orient_polygons(p) for p in shapely.get_parts(shape) if p.geom_type == "Polygon"]
                rings = shapely.get_rings(whole)
                areas[key] += [flat for ring in rings if (flat := _flat(ring, corner, unit_m))]
            elif mark.kind in LINES:
                parts = [p for p in shapely.get_parts(shape) if p.geom_type == "LineString"]
                lines[LINES.index(mark.kind), mark.depth_m] += [
                    flat for part in parts if (flat := _flat(part, corner, unit_m))
                ]
            elif west_m <= shape.x < west_m + wide_m and south_m <= shape.y < south_m + wide_m:
                at = np.rint((np.array([shape.x, shape.y]) - corner) / unit_m).astype(int).tolist()
                depth_m = None if mark.kind == "name" or mark.depth_m is None else round(mark.depth_m, 1)
                points.append([mark.kind, *at, depth_m, mark.text[:60]])
        told = {
            "areas": [[AREAS[kind], -deep, rings] for (kind, deep), rings in sorted(areas.items())],
            "lines": [[LINES[kind], deep, found] for (kind, deep), found in lines.items()],
            "points": points,
        }
        return json.dumps(told, ensure_ascii=False, separators=(",", ":")).encode()


def _flat(line: BaseGeometry, corner: NDArray[np.float64], unit_m: float) -> list[int]:
    """Return x, y of the first position and the steps to the next ones; what falls onto the one before is left out."""
    at = np.rint((shapely.get_coordinates(line) - corner) / unit_m).astype(np.int64)
    steps = np.diff(at, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    return [] if not len(steps) else [int(v) for v in np.concatenate([at[:1], steps]).ravel()]

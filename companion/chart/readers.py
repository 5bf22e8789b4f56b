"""Chart files read: S-57 cells, shapefiles, GeoPackages, GeoJSON, OSM extracts, and grids of depths.

Only here are files of charts opened. What GDAL reads (by pyogrio and rasterio) needs the extra
``chart``; GeoJSON, WKT and ASCII grids do not.
"""

from __future__ import annotations

import contextlib
import json
import math
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.chart import grid as grids
from companion.chart import s57, tags
from companion.chart.features import Box, Chart, Danger, Row, Source, Wanted
from companion.chart.picture import DRAWN, ChartPicture, Mark, marks_of_chart, marks_of_rows
from companion.disk import open_regular, read_regular
from companion.errors import InputError, unreadable
from companion.geo import DEGREE_M
from companion.geofence import Circle, Code, Finding, FindingLevel, Zone, ZoneKind, read
from companion.geofence.document import Mark as DrawnMark
from companion.geofence.formats import decode, zone_kind
from companion.words import counted, listed

TEXT_BYTES = 512 * 1024 * 1024  # of an ASCII grid or a GeoJSON: a coast of a country
LEADER = re.compile(rb"\d{5}[ 1-3][LD ]")  # how ISO 8211 begins, which S-57 is written in
GEOTIFFS = frozenset({".tif", ".tiff"})
GRIDS = frozenset({".tif", ".tiff", ".nc", ".asc", ".grd", ".bag"})
OSM = frozenset({".osm", ".pbf"})
LAYERED = OSM | {".shp", ".gpkg", ".fgb", ".gml", ".sqlite"}
GEOGRAPHIC = re.compile(r"EPSG:(4326|4979)|OGC:CRS84|WGS[ _]?(19)?84", re.IGNORECASE)
WATER = re.compile(r"water[-_ ]?polygons|ocean|seas?\b", re.IGNORECASE)
S57_OPTIONS = {"UPDATES": "APPLY", "LIST_AS_STRING": "ON", "RETURN_PRIMITIVES": "OFF", "LNAM_REFS": "OFF"}
SAME_DATUM_M = 1.0  # a position is good to 2.5 m
DATUM_DEG = 0.01  # no datum lies farther from WGS 84
ELSEWHERE, FETCH_IT = "and holds nothing of the place that is asked for", "fetch it for the mission's water"
LINE_M = 3.0
POINT_M = 10.0


def read_chart(path: Path, box: Box, wanted: Wanted, *, positive: str = "auto", without_depths: bool = False) -> Chart:
    """Return what of a file lies in the box. Raises InputError: one line with file, place and remedy."""
    chart = _read(path, box, wanted, positive=positive, without_depths=without_depths)
    shapes = [danger.geometry for danger in chart.dangers] + ([] if chart.coverage is None else [chart.coverage])
    if any(_touches(shape, box) for shape in shapes if not shape.is_empty):
        return chart
    return _unless_elsewhere(chart, path, box)


def _unless_elsewhere(chart: Chart, path: Path, box: Box) -> Chart:
    """Return a chart of which nothing lies in the box: it is water without a danger if the file reaches there."""
    everything = _read(path, EVERYWHERE, Wanted(safety_depth_m=math.inf), without_depths=True)
    shapes = [danger.geometry for danger in everything.dangers]
    shapes += [] if everything.coverage is None else [everything.coverage]
    whole = shapely.GeometryCollection([shape for shape in shapes if not shape.is_empty])
    if whole.is_empty or _touches(whole, box):
        return chart
    west, south, east, north = whole.bounds
    is_swapped = _touches(shapely.box(south, west, north, east), box)
    finding = Finding(
        severity=FindingLevel.WARNING,
        code=Code.SWAPPED_AXES if is_swapped else Code.FAR_AWAY,
        place="",
        text=f"reaches from {south:.4f}, {west:.4f} to {north:.4f}, {east:.4f} {ELSEWHERE}",
        remedy="are latitude and longitude swapped in it?" if is_swapped else FETCH_IT,
        source=str(path),
    )
    return replace(chart, dangers=(), is_elsewhere=True, findings=(finding,))


def _read(path: Path, box: Box, wanted: Wanted, *, positive: str = "auto", without_depths: bool = False) -> Chart:
    ending = path.suffix.lower()
    try:
        with open_regular(path) as file:
            is_empty = not file.read(1)
    except OSError as error:
        raise unreadable(str(path), error) from None
    if is_empty:
        raise InputError(str(path), "", "is empty", "fetch it again, or name another file")
    if re.fullmatch(r"\.\d{3}", ending):
        return _read_cell(path, box, wanted, without_depths=without_depths)
    if ending == ".asc":
        return _read_ascii(path, box, wanted, positive)
    if ending in GRIDS:
        return _read_raster(path, box, wanted, positive)
    if WATER.search(path.stem):
        raise InputError(
            str(path), "", "holds the water, by its name, and not the land", "take the land polygons of the same place"
        )
    if ending in {".geojson", ".json"}:
        return _of_rows(_rows_of_geojson(path, box), path, wanted, without_depths=without_depths)
    if ending in {".wkt", ".kml", ".kmz", ".gpx"}:
        return _of_document(path)
    return _of_rows(_rows_of_layers(path, box), path, wanted, without_depths=without_depths)


EVERYWHERE: Box = (-180.0, -90.0, 180.0, 90.0)
BANDS_M = (0.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # of a grid's picture


def read_picture(path: Path) -> ChartPicture:
    """Return what a file shows of the water, to be drawn. Raises InputError as ``read_chart`` does."""
    if re.fullmatch(r"\.\d{3}", path.suffix):
        rows = _rows_of_cell(path, lambda layer: s57.is_read(layer) or layer in DRAWN)
        source, scale = s57.source_of(next((r for r in rows if r.layer == "DSID"), None), str(path))
        return ChartPicture(source, marks_of_rows(rows), s57.resolution_m(scale))
    if path.suffix.lower() not in GRIDS:
        chart = read_chart(path, EVERYWHERE, Wanted(safety_depth_m=math.inf), without_depths=True)
        return ChartPicture(chart.source, marks_of_chart(chart), chart.resolution_m)
    marks: list[Mark] = []
    for least_m, depth_m in zip((None, *BANDS_M), BANDS_M, strict=False):
        chart = read_chart(path, EVERYWHERE, Wanted(safety_depth_m=depth_m))
        kind = "land" if least_m is None else "depth"
        marks += [Mark(kind=kind, geometry=danger.geometry, depth_m=least_m) for danger in chart.dangers]
    if chart.coverage is not None:
        marks.append(Mark(kind="depth", geometry=chart.coverage, depth_m=BANDS_M[-1]))
    return ChartPicture(chart.source, marks, chart.resolution_m)


# ---------------------------------------------------------------------------------- S-57
def _read_cell(path: Path, box: Box, wanted: Wanted, *, without_depths: bool) -> Chart:
    rows = _rows_of_cell(path, s57.is_read)
    if not (s57.has_depths(rows) or without_depths):
        raise s57.no_depths(str(path))
    return s57.chart_of([r for r in rows if r.geometry.is_empty or _touches(r.geometry, box)], str(path), wanted)


def _rows_of_cell(path: Path, is_read: Callable[[str], bool]) -> list[Row]:
    """Return the features of a cell with its updates, whole. Raises InputError."""
    if path.suffix != ".000":
        raise InputError(str(path), "", "is an update of a cell", f"name {path.stem}.000: its updates are read with it")
    try:
        head = read_regular(path, 24)
    except OSError as error:
        raise unreadable(str(path), error) from None
    if not LEADER.match(head):
        raise InputError(
            str(path),
            "byte 0",
            "is no S-57 cell: it is encrypted (S-63), or damaged",
            "ask for the cell unencrypted (S-57), as NOAA's and many inland authorities' are",
        )
    numbers = sorted(int(p.suffix[1:]) for p in path.parent.glob(f"{path.stem}.[0-9][0-9][0-9]"))
    for expected, number in enumerate(numbers):
        if number != expected:
            raise InputError(
                str(path),
                f"update {expected:03}",
                f"is missing, and {number:03} is there",
                "fetch it, or remove the later ones",
            )
    rows = list(_rows_of_layers(path, None, is_read=is_read, options=S57_OPTIONS))
    lost = next((r for r in rows if r.geometry.is_empty and r.number("PRIM") in s57.DRAWN), None)
    if lost is not None:
        raise InputError(str(path), lost.place, "has lost its shape", "fetch it again")
    return rows


# ---------------------------------------------------------------------------------- vectors
def _of_rows(rows: Iterator[Row], path: Path, wanted: Wanted, *, without_depths: bool) -> Chart:
    """Return what features say: by S-57's classes where layers are called so, by tags, else areas are land."""
    found: list[Danger] = []
    cell: list[Row] = []
    kept_in = 0
    is_osm = path.suffix.lower() in OSM
    for row in rows:
        if row.geometry is None or row.geometry.is_empty:
            continue
        if s57.is_read(row.layer.upper()):
            cell.append(Row(layer=row.layer.upper(), place=row.place, geometry=row.geometry, attributes=row.attributes))
        elif is_osm or tags.is_tagged(row):
            found += tags.dangers_of(row, wanted)
        elif zone_kind(row.text("kind")) is ZoneKind.INCLUSION:
            kept_in += 1
        else:
            found += _plain(row, wanted, path)
    if cell:
        if not (s57.has_depths(cell) or without_depths):
            raise s57.no_depths(str(path))
        chart = s57.chart_of(cell, str(path), wanted)
        return Chart(
            source=Source(name=path.name),
            dangers=(*chart.dangers, *found),
            coverage=chart.coverage,
            knows_depths=chart.knows_depths,
            findings=_findings(cell, kept_in, path),
        )
    return Chart(source=Source(name=path.name), dangers=tuple(found), findings=_findings(found, kept_in, path))


def _plain(row: Row, wanted: Wanted, path: Path) -> list[Danger]:
    """Return what a feature without class or tags is, by what an obstacle file says of it; none: deep enough.

    Raises InputError where it says a figure that is none: a radius in feet would be another.
    """
    for key in ("radius_m", "depth_m", "margin_m"):
        if row.text(key) and row.number(key) is None:
            said = f"{row.text(key)[:20]!r} is no number of metres"
            raise InputError(str(path), f"{row.place} {key}", said, "write metres, as 12.2")
    shape, radius_m, depth_m = row.geometry.geom_type, row.number("radius_m"), row.number("depth_m")
    if depth_m is not None and depth_m >= wanted.safety_depth_m:
        return []
    if shape.endswith("Polygon"):
        reason, radius_m = "land", 0.0
    elif shape.endswith("LineString"):
        reason, radius_m = "shore", LINE_M
    else:
        reason, radius_m = "danger", POINT_M if radius_m is None or radius_m <= 0.0 else radius_m
    reason = row.text("reason") or reason
    name = row.text("name").removesuffix(f" ({reason})")  # with which a file of ours has it
    return [
        Danger(
            reason=reason,
            geometry=row.geometry,
            name="" if name == reason else name,
            depth_m=depth_m,
            radius_m=radius_m,
            doubt_m=max(0.0, row.number("margin_m") or 0.0),
        )
    ]


def _of_document(path: Path) -> Chart:
    """Return what a file of drawings holds: its zones and marks to keep out of."""
    document = read(path, areas=True).require_clean()
    found: list[Danger] = []
    drawn: list[Zone | DrawnMark] = [*document.zones, *document.marks]
    for each in drawn:
        if each.kind is ZoneKind.INCLUSION:
            continue
        geometry: BaseGeometry
        if isinstance(each, DrawnMark):
            geometry, radius_m = each.geometry, POINT_M
        elif isinstance(each.shape, Circle):
            center, radius_m = each.shape.center, each.shape.radius_m
            geometry = shapely.Point(center.lon_deg, center.lat_deg)
        else:
            geometry, radius_m = each.shape, 0.0
        found.append(
            Danger(reason="drawn", geometry=geometry, name=each.name, radius_m=radius_m, doubt_m=each.margin_m or 0.0)
        )
    kept_in = len(drawn) - len(found)
    return Chart(source=Source(name=path.name), dangers=tuple(found), findings=_findings(found, kept_in, path))


def _findings(found: Sequence[Danger | Row], kept_in: int, path: Path) -> tuple[Finding, ...]:
    """Return what there is to say of a file with ``kept_in`` zones to keep in, which are nothing solid."""

    def noted(code: Code, text: str, remedy: str = "") -> Finding:
        return Finding(severity=FindingLevel.NOTE, code=code, place="", text=text, remedy=remedy, source=str(path))

    said = [] if found else [noted(Code.EMPTY, "holds nothing solid here")]
    if kept_in:
        text = f"holds {counted(kept_in, 'zone')} to keep in: only what to keep out of is taken"
        said.append(noted(Code.NOT_CARRIED, text, "name the file as the mission's fence"))
    return tuple(said)


def _rows_of_geojson(path: Path, box: Box) -> Iterator[Row]:
    try:
        root = json.loads(decode(read_regular(path, TEXT_BYTES), str(path)))
    except OSError as error:
        raise unreadable(str(path), error) from None
    except (ValueError, RecursionError) as error:
        raise InputError(str(path), "", f"is no JSON ({error})", "fetch it again") from None
    features = root.get("features") if isinstance(root, dict) else None
    if not isinstance(features, list):
        raise InputError(str(path), "", "is no FeatureCollection", "export it as GeoJSON (RFC 7946)")
    crs = json.dumps(root.get("crs"))
    if root.get("crs") is not None and not GEOGRAPHIC.search(crs.replace("::", ":")):
        raise InputError(str(path), "crs", f"{crs[:60]} is not WGS 84", "export it as WGS 84 (RFC 7946)")
    for n, feature in enumerate(features):
        place = f"features[{n}]"
        try:
            shape = shapely.from_geojson(json.dumps(feature["geometry"]))
        except (KeyError, TypeError, shapely.errors.GEOSException) as error:
            raise InputError(str(path), place, f"has no geometry ({error})", "draw it or remove it") from None
        if shape is None:
            continue
        properties = feature.get("properties") or {}
        _require_on_globe(shape, path, place)
        if shape.is_empty or _touches(shape, box):
            yield Row(layer=str(properties.get("layer", "")), place=place, geometry=shape, attributes=properties)


def _rows_of_layers(
    path: Path,
    box: Box | None,
    *,
    is_read: Callable[[str], bool] = lambda _: True,
    options: dict[str, str] | None = None,
) -> Iterator[Row]:
    """Yield the features of every layer, in longitude and latitude."""
    _require_no_text(path)
    from pyogrio import list_layers
    from pyogrio.errors import DataLayerError, DataSourceError
    from pyogrio.raw import read as read_layer

    try:
        with _whole(path) if options else contextlib.nullcontext():
            layers = [str(name) for name, _ in list_layers(path) if is_read(str(name).upper())]
        has_places = False
        for layer in layers:
            with _whole(path) if options else contextlib.nullcontext():
                meta, _, geometries, fields = read_layer(path, layer=layer, **(options or {}))
            has_places |= geometries is not None
            if geometries is None:  # a table
                geometries = [None] * (len(fields[0]) if fields else 0)
            has_shapes = any(data is not None for data in geometries)
            to_lonlat = _to_lonlat(meta.get("crs"), path, layer) if has_shapes else None
            names = [str(name) for name in meta["fields"]]
            for n, data in enumerate(geometries):
                shape = shapely.Point() if data is None else shapely.from_wkb(data)
                if to_lonlat is not None:
                    shape = shapely.transform(shape, to_lonlat, include_z=False)
                place = f"{layer} feature {n + 1}"
                _require_on_globe(shape, path, place)
                attributes = {name: _value(column[n]) for name, column in zip(names, fields, strict=True)}
                if box is None or shape.is_empty or _touches(shape, box):
                    yield Row(layer=layer, place=place, geometry=shape, attributes=attributes)
        if not (has_places or options):  # a spreadsheet would else be water without a danger
            raise _no_chart(path, "holds no places, as a table does")
    except (DataLayerError, DataSourceError, shapely.errors.GEOSException) as error:
        # what is called as a chart and is none may have been cut short
        if "not recognized" in str(error) and path.suffix.lower() not in LAYERED and not options:
            raise _no_chart(path) from None
        raise _damaged(path, str(error)) from None


def _require_no_text(path: Path) -> None:
    """Refuse what is plain text and no markup, in whatever format GDAL is asked for: nobody needs the library to know.

    OSM's and GML's text is markup, which begins with ``<``; every other layer that is read here is binary or JSON.
    """
    if path.suffix.lower() in {".csv", ".tab", ".mif", ".dxf"} or not path.is_file():
        return
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise unreadable(str(path), error) from None
    begins = head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
    if begins not in {b"<", b"{", b"["} and not re.search(rb"[\x00-\x08\x0e-\x1f]", head):
        raise _no_chart(path)


def _no_chart(path: Path, why: str = "is no chart file") -> InputError:
    return InputError(
        str(path),
        "",
        why,
        "name an S-57 cell (.000), a shapefile (.shp), GeoPackage, GeoJSON, OSM extract or a grid of depths",
    )


@contextlib.contextmanager
def _whole(path: Path) -> Iterator[None]:
    """Refuse a cell that GDAL reads with a warning: it goes on without what it did not understand, perhaps a rock."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        yield
    if told:
        raise _damaged(path, str(told[0].message))


def _damaged(path: Path, why: str) -> InputError:
    return InputError(str(path), "", f"cannot be read whole ({' '.join(why.split())[:100]})", "fetch it again")


def _value(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else value


def _touches(shape: BaseGeometry, box: Box) -> bool:
    west, south, east, north = shapely.bounds(shape)
    return bool(
        south <= box[3]
        and north >= box[1]
        and any(west + turn <= box[2] and east + turn >= box[0] for turn in (-360.0, 0.0, 360.0))
    )


def _require_on_globe(shape: BaseGeometry, path: Path, place: str) -> None:
    if shape.is_empty:
        return
    west, south, east, north = shapely.bounds(shape)
    if not (south >= -90.0 and north <= 90.0 and west >= -360.0 and east <= 360.0):
        raise InputError(
            str(path),
            place,
            f"lies at {west:.6g}, {south:.6g}, which is no longitude and latitude",
            "export it as WGS 84, longitude first",
        )


Transform = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def _to_lonlat(crs: str | None, path: Path, place: str) -> Transform | None:
    """Return what brings positions of a reference system to longitude and latitude; None where they are that."""
    from pyproj import CRS, Transformer
    from pyproj.exceptions import CRSError

    if not crs:
        raise InputError(
            str(path), place, "does not say its reference system", "put its .prj beside it, or export it as WGS 84"
        )
    if re.fullmatch(r"EPSG:4326|OGC:CRS84", crs):
        return None
    try:
        transformer = Transformer.from_crs(CRS.from_user_input(crs), "EPSG:4326", always_xy=True)
    except CRSError as error:
        raise InputError(
            str(path), place, f"its reference system is not known ({str(error)[:80]})", "export it as WGS 84"
        ) from None
    return lambda xy: np.column_stack(transformer.transform(xy[:, 0], xy[:, 1]))


# ---------------------------------------------------------------------------------- grids
def _read_ascii(path: Path, box: Box, wanted: Wanted, positive: str) -> Chart:
    try:
        text = decode(read_regular(path, TEXT_BYTES), str(path))
    except OSError as error:
        raise unreadable(str(path), error) from None
    grid = grids.parse_ascii_grid(text, str(path))
    beside = path.with_suffix(".prj")
    if beside.is_file():
        crs: str | None = beside.read_text(encoding="utf-8", errors="replace")
    else:
        crs = "EPSG:4326" if _is_lonlat(grid) else None
    to_lonlat = _to_lonlat(crs, path, "header")
    cell_m = None if to_lonlat is None or _is_lonlat(grid) else float(abs(grid.y[1] - grid.y[0]))
    if cell_m is None:
        to_lonlat = _of_datum(to_lonlat, box, path)
        grid = _cut(grid, box if to_lonlat is None else _grown(box), path)
    return _of_grid(grid, path, Source(name=path.name), wanted, to_lonlat, positive=positive, cell_m=cell_m)


def _of_grid(
    grid: grids.Grid,
    path: Path,
    source: Source,
    wanted: Wanted,
    to_lonlat: Transform | None,
    *,
    positive: str,
    cell_m: float | None,
) -> Chart:
    """Return what a grid says, and that it has numbers which stand for nothing."""
    grid, filled = grids.without_fill(grid)
    chart = grids.chart_of(grids.signed(grid, str(path), positive), source, wanted, to_lonlat, cell_m=cell_m)
    if not filled:
        return chart
    numbers = listed([f"{value:g}" for value in filled[:3]])
    text = f"has cells of {numbers}, which it does not call nothing and no depth is: solid, as all that is not known"
    finding = Finding(
        severity=FindingLevel.WARNING,
        code=Code.FORMAT,
        place="",
        text=text,
        remedy="declare it (gdal_edit.py -a_nodata)",
        source=str(path),
    )
    return replace(chart, findings=(*chart.findings, finding))


def _of_datum(to_lonlat: Transform | None, box: Box, path: Path) -> Transform | None:
    """Return what brings degrees of another datum to WGS 84; None where they are that within a metre.

    Raises InputError where nothing is known of how the two lie to each other.
    """
    if to_lonlat is None:
        return None
    middle = np.array([[0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])]])

    def unturned(xy: NDArray[np.float64]) -> NDArray[np.float64]:
        found = to_lonlat(xy)
        found[:, 0] += 360.0 * np.round((xy[:, 0] - found[:, 0]) / 360.0)  # a grid may lie a turn from the box
        return found

    off_m = float(np.hypot(*(unturned(middle) - middle)[0]) * DEGREE_M)
    if not math.isfinite(off_m):
        raise InputError(
            str(path), "header", "its datum cannot be brought to WGS 84 here", "export it as WGS 84 (EPSG:4326)"
        )
    return None if off_m < SAME_DATUM_M else unturned


def _grown(box: Box) -> Box:
    """Return a box that holds what lies in it by another datum."""
    return (box[0] - DATUM_DEG, box[1] - DATUM_DEG, box[2] + DATUM_DEG, box[3] + DATUM_DEG)


def _is_lonlat(grid: grids.Grid) -> bool:
    return bool(np.abs(grid.x).max() <= 360.0 and np.abs(grid.y).max() <= 90.0)


def _cut(grid: grids.Grid, box: Box, path: Path) -> grids.Grid:
    """Return the part of a grid in longitude and latitude that holds the box, its longitudes the box's."""
    rows, parts = _within(grid.x, grid.y, box, path)
    return grids.Grid(
        x=_joined(parts, grid.x),
        y=grid.y[rows],
        heights_m=np.concatenate([grid.heights_m[rows, columns] for columns, _ in parts], axis=1),
    )


def _read_raster(path: Path, box: Box, wanted: Wanted, positive: str) -> Chart:
    import rasterio
    from rasterio.errors import RasterioError
    from rasterio.windows import Window

    try:
        with rasterio.open(_subdataset(path)) as raster:
            affine = raster.transform
            if raster.crs is None and affine.is_identity:
                raise InputError(str(path), "", "does not say where it lies", "export it with its reference system")
            if raster.crs is None and path.suffix.lower() in GEOTIFFS:
                raise InputError(
                    str(path),
                    "",
                    "does not say its reference system",
                    "write it in (gdal_edit.py -a_srs EPSG:4326 where it is longitude and latitude of WGS 84)",
                )
            if affine.b or affine.d:
                raise InputError(str(path), "", "is a turned grid", "export it north up")
            x = affine.c + affine.a * (np.arange(raster.width) + 0.5)
            y = affine.f + affine.e * (np.arange(raster.height) + 0.5)
            crs = "EPSG:4326" if raster.crs is None else raster.crs.to_wkt()
            is_lonlat = raster.crs is None or raster.crs.is_geographic
            shift = _of_datum(_to_lonlat(crs, path, "header"), box, path) if is_lonlat else None
            if shift is not None:
                box = _grown(box)
            if not is_lonlat:
                box = _from_lonlat(crs).transform_bounds(*box)
            rows, parts = _within(x, y, box, path, is_round=is_lonlat)
            windows = [
                Window(columns.start, rows.start, columns.stop - columns.start, rows.stop - rows.start)
                for columns, _ in parts
            ]
            bands = [raster.read(1, window=window, masked=True) for window in windows]
            heights = np.concatenate([np.ma.filled(band.astype(np.float64), np.nan) for band in bands], axis=1)
            heights = heights * raster.scales[0] + raster.offsets[0]
            said = {**raster.tags(), **raster.tags(1)}
    except RasterioError as error:
        raise InputError(str(path), "", f"cannot be read ({str(error)[:100]})", "is it a grid, and whole?") from None
    grid = grids.Grid(x=_joined(parts, x), y=y[rows], heights_m=heights)
    heading = " ".join(str(v).lower() for k, v in said.items() if k.rpartition("#")[2] in {"positive", "standard_name"})
    if positive == "auto" and ("down" in heading.split() or "depth" in heading):
        positive = "down"
    return _of_grid(
        grid,
        path,
        Source(name=path.name, edition=said.get("TIFFTAG_SOFTWARE", ""), date=said.get("TIFFTAG_DATETIME", "")[:10]),
        wanted,
        shift if is_lonlat else _to_lonlat(crs, path, "header"),
        positive=positive,
        cell_m=None if is_lonlat else float(abs(affine.e)),
    )


def _subdataset(path: Path) -> str:
    """Return what of a netCDF file is the depths: its only variable, or the one of a name that says so."""
    import rasterio

    with rasterio.open(path) as raster:
        inside = [str(name) for name in raster.subdatasets]
    for wanted in ("elevation", "depth", "z", "band1", "altitude", "topo"):
        for name in inside:
            if name.rpartition(":")[2].lower() == wanted:
                return name
    if inside:
        raise InputError(str(path), "", f"holds {len(inside)} grids and none by the name elevation or depth")
    return str(path)


def _from_lonlat(crs: str) -> Any:
    from pyproj import Transformer

    return Transformer.from_crs("EPSG:4326", crs, always_xy=True)


def _within(
    x: NDArray[np.float64], y: NDArray[np.float64], box: Box, path: Path, *, is_round: bool = True
) -> tuple[slice, list[tuple[slice, float]]]:
    """Return which rows and columns of a grid hold the box, with one more to each side.

    The columns come in parts with what is added to their x, from west to east: with ``is_round`` a grid may lie a turn
    of 360 degrees from the box, and its two ends join in it.
    """
    step = abs(y[1] - y[0])
    rows = np.nonzero((y >= box[1] - step) & (y <= box[3] + step))[0]
    parts, east, wide = [], -math.inf, abs(x[1] - x[0])
    for turn in (-360.0, 0.0, 360.0) if is_round else (0.0,):
        from_x = max(box[0] - wide, east + 0.5 * wide)  # the first meridian may be there twice
        columns = np.nonzero((x + turn >= from_x) & (x + turn <= box[2] + wide))[0]
        if columns.size:
            parts.append((slice(int(columns[0]), int(columns[-1]) + 1), turn))
            east = float(x[columns].max()) + turn
    count = sum(columns.stop - columns.start for columns, _ in parts)
    if rows.size < 2 or count < 2:
        form = ".4f" if is_round else ".0f"
        raise InputError(
            str(path),
            "",
            f"reaches from {y.min():{form}}, {x.min():{form}} to {y.max():{form}}, {x.max():{form}} {ELSEWHERE}",
            FETCH_IT,
        )
    if rows.size * count > grids.MOST_CELLS:
        raise InputError(str(path), "", "has too many cells in reach", "say a smaller --radius")
    return slice(int(rows[0]), int(rows[-1]) + 1), parts


def _joined(parts: Sequence[tuple[slice, float]], x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([x[columns] + turn for columns, turn in parts])

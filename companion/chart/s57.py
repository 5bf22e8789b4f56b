"""S-57: which classes of a cell are solid for a boat of a depth, and what its headers must say to be believed.

Classes and attributes are those of the IHO's object catalogue (S-57, appendix A), in metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.chart.features import Chart, Danger, Row, Source, Wanted
from companion.errors import InputError
from companion.words import counted

# The skin of the earth: every place of a cell's coverage is in one of these.
DEPTH_AREAS = frozenset({"DEPARE", "DRGARE"})
SKIN = DEPTH_AREAS | {"LNDARE", "UNSARE", "FLODOC", "HULKES", "PONTON"}

# Solid whatever the depth: what it is called.
SOLID = {
    "LNDARE": "land",
    "UNSARE": "not surveyed",
    "FLODOC": "floating dock",
    "HULKES": "hulk",
    "PONTON": "pontoon",
    "SLCONS": "shore construction",
    "MORFAC": "mooring",
    "PILPNT": "pile",
    "PYLONS": "pylon",
    "OFSPLF": "platform",
    "FSHFAC": "fishing stakes",
    "MARCUL": "marine farm",
    "DAMCON": "dam",
    "DYKCON": "dyke",
    "GATCON": "gate",
    "LOGPON": "log pond",
    "OILBAR": "oil barrier",
    "LITFLT": "light float",
    "LITVES": "light vessel",
}
BUOYS = ("BOY", "BCN")
# Solid where there is less room below than the boat is high, or nobody says how high she is.
OVERHEAD = {"BRIDGE": "bridge", "CBLOHD": "overhead cable", "CONVYR": "conveyor", "PIPOHD": "overhead pipe"}
CLEARANCES = ("VERCCL", "VERCSA", "VERCLR")
# Solid where the depth over them is less than the safety depth, or is not told.
SUBMERGED = {"WRECKS": "wreck", "OBSTRN": "obstruction", "UWTROC": "rock"}
RESTRICTED = {"RESARE": "restricted area", "MIPARE": "military area", "DMPGRD": "dumping ground"}
ENTRY_PROHIBITED = frozenset({7, 14})  # of RESTRN: entry prohibited, area to be avoided

# Of dangers that are only points [m]: what they measure beside their symbol.
POINT_M = {"WRECKS": 20.0, "LNDARE": 20.0, "BRIDGE": 20.0}
OTHER_POINT_M = 10.0
SOUNDING_M = 5.0
SYMBOL_MM = 0.25  # at the chart's scale: nothing of the size is drawn better

# CATZOC (S-57 appendix A, attribute 177): how far off a place may be [m]. D is worse than C, U was never assessed.
ZONES = {1: ("A1", 5.0), 2: ("A2", 20.0), 3: ("B", 50.0), 4: ("C", 500.0), 5: ("D", 1000.0), 6: ("U", 1000.0)}
UNASSESSED_M = 1000.0

LAYERS = frozenset({*SKIN, *SOLID, *OVERHEAD, *SUBMERGED, *RESTRICTED, "SOUNDG", "M_COVR", "M_QUAL", "DSID"})
WGS_84, METRES = 2, 1
DRAWN = frozenset({1, 2, 3})  # of PRIM: what is a point, a line or an area


def is_read(layer: str) -> bool:
    """Return whether a class says something of what is solid, or of the chart."""
    return layer in LAYERS or layer[:3] in BUOYS


def source_of(row: Row | None, path: str) -> tuple[Source, float]:
    """Return a cell's name, edition and date, and its scale's denominator (0: not told), of its DSID.

    Raises InputError where its depths or places are in other units than this reads.
    """
    if row is None:
        return Source(name=path.rpartition("/")[2]), 0.0
    datum, units = row.number("DSPM_HDAT"), row.number("DSPM_DUNI")
    if datum not in {None, WGS_84}:
        raise InputError(
            path, "DSID", f"its horizontal datum (HDAT {datum:g}) is not WGS 84", "take an edition in WGS 84"
        )
    if units not in {None, METRES}:
        unit = {2: "fathoms and feet", 3: "feet", 4: "fathoms"}.get(int(units or 0), f"units DUNI {units:g}")
        raise InputError(path, "DSID", f"its depths are in {unit}", "take an edition in metres")
    edition, update, issued = row.text("DSID_EDTN"), row.text("DSID_UPDN"), row.text("DSID_ISDT")
    date = f"{issued[:4]}-{issued[4:6]}-{issued[6:]}" if len(issued) == 8 and issued.isdigit() else issued
    whole = f"{edition}.{update}" if update not in {"", "0"} else edition
    return Source(name=row.text("DSID_DSNM").removesuffix(".000") or path, edition=whole, date=date), row.number(
        "DSPM_CSCL"
    ) or 0.0


def resolution_m(scale: float) -> float:
    """Return how fine a chart is drawn [m], of its scale's denominator: half a millimetre; 0 is not told."""
    return 0.0005 * scale if scale else math.inf


def has_depths(rows: Iterable[Row]) -> bool:
    """Return whether a cell says anything of its water's depth."""
    return any(r.layer in DEPTH_AREAS or r.layer == "SOUNDG" for r in rows)


def no_depths(path: str) -> InputError:
    """Return what to raise for a cell that does not."""
    return InputError(
        path,
        "",
        "holds no depth area and no sounding: nothing is known of its water's depth",
        "take another cell, or say --without-depths",
    )


def chart_of(rows: Sequence[Row], path: str, wanted: Wanted) -> Chart:
    """Return what a cell's features say. Raises InputError where its header is not to be believed."""
    source, scale = source_of(next((r for r in rows if r.layer == "DSID"), None), path)
    symbol_m = SYMBOL_MM / 1000.0 * scale
    found = [
        danger for row in rows if not row.geometry.is_empty for danger in dangers_of(row, wanted, symbol_m=symbol_m)
    ]
    doubts = _doubts([d.geometry for d in found], rows, wanted.most_doubt_m)
    dangers = tuple(
        Danger(
            reason=d.reason,
            geometry=d.geometry,
            name=d.name,
            depth_m=d.depth_m,
            radius_m=d.radius_m,
            doubt_m=doubt if is_submerged else 0.0,
        )
        for (d, is_submerged), doubt in zip(((d, d.doubt_m > 0.0) for d in found), doubts, strict=True)
    )
    return Chart(
        source=source,
        dangers=dangers,
        coverage=coverage_of(rows),
        resolution_m=resolution_m(scale),
        supersedes=scale > 0.0,
        knows_depths=has_depths(rows),
    )


def coverage_of(rows: Iterable[Row]) -> BaseGeometry:
    """Return where a cell speaks of the water: its coverage, less what is no area of depth, land or the like."""
    rows = list(rows)
    skin = shapely.union_all([shapely.make_valid(r.geometry) for r in rows if r.layer in SKIN and _is_area(r)])
    told = [shapely.make_valid(r.geometry) for r in rows if r.layer == "M_COVR" and r.number("CATCOV") in {None, 1.0}]
    return shapely.intersection(skin, shapely.union_all(told)) if told else skin


def dangers_of(row: Row, wanted: Wanted, *, symbol_m: float = 0.0) -> list[Danger]:
    """Return what of a feature is solid. Its ``doubt_m`` is 1 where the survey's quality speaks of it, else 0."""
    layer, name = row.layer, row.text("OBJNAM")
    radius_m = 0.0 if _is_area(row) else max(POINT_M.get(layer, OTHER_POINT_M), symbol_m)
    if layer in SOLID:
        doubt_m = 1.0 if layer == "UNSARE" else 0.0
        return [Danger(reason=SOLID[layer], geometry=row.geometry, name=name, radius_m=radius_m, doubt_m=doubt_m)]
    if layer[:3] in BUOYS:
        kind = "buoy" if layer.startswith("BOY") else "beacon"
        return [Danger(reason=kind, geometry=row.geometry, name=name, radius_m=wanted.buoy_radius_m)]
    if layer in OVERHEAD:
        room_m = min((m for m in map(row.number, CLEARANCES) if m is not None), default=None)
        if room_m is not None and room_m > wanted.air_draft_m:
            return []
        return [Danger(reason=OVERHEAD[layer], geometry=row.geometry, name=name, radius_m=radius_m)]
    if layer in DEPTH_AREAS:
        depth_m = row.number("DRVAL1")
        if not _is_area(row) or (depth_m is not None and depth_m >= wanted.safety_depth_m):
            return []
        reason = "no depth told" if depth_m is None else "dries" if depth_m < 0.0 else "shallow"
        return [Danger(reason=reason, geometry=row.geometry, name=name, depth_m=depth_m, doubt_m=1.0)]
    if layer in SUBMERGED:
        depth_m = row.number("VALSOU")
        is_deep = depth_m is not None and depth_m >= wanted.safety_depth_m
        is_harmless = depth_m is None and layer == "WRECKS" and row.number("CATWRK") == 1.0  # "non-dangerous wreck"
        if is_deep or is_harmless:
            return []
        reason = SUBMERGED[layer]
        return [
            Danger(reason=reason, geometry=row.geometry, name=name, depth_m=depth_m, radius_m=radius_m, doubt_m=1.0)
        ]
    if layer == "SOUNDG":
        points = shapely.get_parts(row.geometry)
        depths_m = shapely.get_z(points)
        shoal = ~(depths_m >= wanted.safety_depth_m)  # one without a depth is one
        return [
            Danger(
                reason="sounding",
                geometry=shapely.force_2d(point),
                depth_m=None if np.isnan(depth_m) else float(depth_m),
                radius_m=SOUNDING_M,
                doubt_m=1.0,
            )
            for point, depth_m in zip(points[shoal], depths_m[shoal], strict=True)
        ]
    if layer in RESTRICTED and _is_area(row):
        is_shut = bool(row.codes("RESTRN") & ENTRY_PROHIBITED)
        if wanted.restricted == "all" or (wanted.restricted == "prohibited" and is_shut):
            reason = "entry prohibited" if is_shut else RESTRICTED[layer]
            return [Danger(reason=reason, geometry=row.geometry, name=name)]
    return []


def told_of(chart: Chart) -> str:
    """Return what was made of a chart, in a few words."""
    counts: dict[str, int] = {}
    for danger in chart.dangers:
        counts[danger.reason] = counts.get(danger.reason, 0) + 1
    words = (counted(n, *_NOUNS[reason]) if reason in _NOUNS else f"{n} {reason}" for reason, n in counts.items())
    return ", ".join(words) or "no danger"


# One and more of a thing. A file may give reasons of its own, which are left as they are.
_NOUNS: dict[str, tuple[str] | tuple[str, str]] = {
    **{word: (word,) for kinds in (SOLID, OVERHEAD, SUBMERGED, RESTRICTED) for word in kinds.values()},
    **{word: (word,) for word in ("sounding", "buoy", "beacon", "pier", "breakwater", "groyne")},
    **{word: (word,) for word in ("shore", "reef", "shoal")},
    "drawn": ("drawn shape",),
    "shallow or land": ("shallow or dry area",),
    "land": ("piece of land", "pieces of land"),
    "not surveyed": ("area not surveyed", "areas not surveyed"),
    "no depth told": ("area without a depth", "areas without a depth"),
    "shallow": ("shallow area",),
    "dries": ("area that dries", "areas that dry"),
    "entry prohibited": ("area of no entry", "areas of no entry"),
    "fishing stakes": ("fishing stake",),
    "beach": ("beach", "beaches"),
}


def _is_area(row: Row) -> bool:
    return row.geometry.geom_type in {"Polygon", "MultiPolygon"}


def _doubts(shapes: Sequence[BaseGeometry], rows: Sequence[Row], most_m: float) -> list[float]:
    """Return how far off each shape may be [m]: by the worst zone of survey quality that it lies in."""
    zones = [r for r in rows if r.layer == "M_QUAL" and not r.geometry.is_empty]
    worst = np.zeros(len(shapes))
    if zones and shapes:
        metres = np.array(
            [
                row.number("POSACC") or ZONES.get(int(row.number("CATZOC") or 6.0), ("", UNASSESSED_M))[1]
                for row in zones
            ]
        )
        tree = shapely.STRtree([shapely.make_valid(z.geometry) for z in zones])
        of, zone = tree.query(np.array(shapes, dtype=object), predicate="intersects")
        np.maximum.at(worst, of, metres[zone])
    return [float(m) for m in np.minimum(np.where(worst > 0.0, worst, UNASSESSED_M), most_m)]

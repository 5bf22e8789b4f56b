"""The page of a composed field: Schmitt's interactive picture in one file that asks for nothing.

The wind is turned by a slider, the boat is dragged, the fan of possible directions can be shown, and a button switches
to the field of another boat (section 4.1.3). What is computed in the browser is what the companion computes: a test
holds the two together.
"""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

import msgspec
import shapely
from shapely.geometry.base import BaseGeometry

from companion.compose import boat_of
from companion.field.look_ahead import BEYOND_M, LOOK_S, MOST_LOOK_S
from companion.field.tree import (
    Added,
    Along,
    Atom,
    AwayFrom,
    AwayFromLine,
    Expression,
    Heading,
    Longest,
    Named,
    OutOf,
    PointTo,
    Round,
    StayAt,
    Weighed,
)
from companion.geofence import Mission
from companion.mission_check import FieldPreview, field_preview

WINDS_MPS = [0.5 * n for n in range(2, 31)]  # what the slider stops at


def field_page(
    mission: Mission, seen: FieldPreview, words: list[str], other: tuple[str, Mission] | None = None
) -> bytes:
    """Return the page of a goal's field as one HTML file; see ``page_data``."""
    web = resources.files("companion.page.fields").joinpath("web")
    data = msgspec.json.encode(page_data(mission, seen, words, other)).replace(b"<", b"\\u003c").decode()
    page = web.joinpath("page.html").read_text()
    for name, text in (
        ("CALC", web.joinpath("calc.js").read_text()),
        ("DRAW", web.joinpath("draw.js").read_text()),
        ("DATA", data),
    ):
        page = page.replace(f"\n{name}\n", f"\n{text}\n")
    return page.encode()


def page_data(
    mission: Mission, seen: FieldPreview, words: list[str], other: tuple[str, Mission] | None = None
) -> dict[str, Any]:
    """Return what the page is made of; ``other`` is another boat by its name, and the same mission sailed by it."""
    tws = min(WINDS_MPS, key=lambda w: abs(w - seen.conditions.seen.tws_mps))
    area = seen.area
    return {
        "title": f"{mission.name}, goal {seen.number}: {seen.tree.text}",
        "words": words,
        "solid": [ring for polygon in area.polygons for ring in _rings(polygon)],
        "fence": [] if area.limits is None else _rings(area.limits),
        "boat": seen.here_en,
        "place": seen.place_en,
        "radius": seen.radius_m,
        "centre": seen.centre_en,
        "half": seen.half_m,
        "wind": {"twd": seen.conditions.seen.twd_from_rad or 0.0, "tws": tws},
        "marks": [_mark(name, atom) for name, atom in seen.tree.atoms if not isinstance(atom, Heading)],
        "field": _field(mission, seen),
        "other": None if other is None else {"name": other[0], "field": _field(other[1], _sailed_by(other[1], seen))},
    }


def _sailed_by(mission: Mission, seen: FieldPreview) -> FieldPreview:
    wind = seen.conditions.seen
    return field_preview(mission, number=seen.number, wind=(wind.tws_mps, math.degrees(wind.twd_from_rad or 0.0)))


def _field(mission: Mission, seen: FieldPreview) -> dict[str, Any]:
    habits, polar = seen.conditions.habits, boat_of(mission).polar
    look_s = max(habits.polar_mps)
    return {
        "tree": _node(seen.tree.expression),
        "atoms": {name: _atom(atom, look_s) for name, atom in seen.tree.atoms},
        "sails": habits.is_sailing,
        "noGo": habits.no_go_half_rad,
        "turnRate": habits.turn_rate_radps,
        "tackS": habits.tack_s,
        "lagS": max(habits.lag_s, 0.1),
        "leeway": habits.leeway_share,
        "winds": WINDS_MPS,
        "twa": [float(a) for a in polar.curve(WINDS_MPS[0])[0]],
        "speeds": [[float(v) for v in polar.curve(w)[1]] for w in WINDS_MPS],
    }


def _node(node: Expression) -> dict[str, Any]:
    if isinstance(node, Named):
        return {"op": "name", "name": node.name}
    if isinstance(node, Weighed):
        return {"op": "weigh", "weight": node.weight, "parts": [_node(node.part)]}
    if isinstance(node, Added | Longest):
        return {"op": "add" if isinstance(node, Added) else "max", "parts": [_node(p) for p in node.parts]}
    return {"op": "project", "parts": [_node(node.part)]}


def _atom(atom: Atom, fastest_mps: float) -> dict[str, Any]:
    if isinstance(atom, PointTo | StayAt):
        return {"kind": "station" if isinstance(atom, StayAt) else "point", "at": atom.at_en, "zone": atom.zone_m}
    if isinstance(atom, Along):
        return {"kind": "line", "from": atom.from_en, "to": atom.to_en, "zone": atom.zone_m}
    if isinstance(atom, Round):
        return {
            "kind": "circle",
            "at": atom.at_en,
            "radius": atom.radius_m,
            "clockwise": atom.is_clockwise,
            "zone": atom.zone_m,
        }
    if isinstance(atom, AwayFrom):
        return {"kind": "repulsive_point", "at": atom.at_en, "range": atom.range_m}
    if isinstance(atom, AwayFromLine):
        return {"kind": "repulsive_line", "from": atom.from_en, "to": atom.to_en, "range": atom.range_m}
    if isinstance(atom, Heading):
        return {"kind": "heading", "heading": atom.heading_rad}
    west, south, east, north = atom.water_en.bounds
    look_s = min(MOST_LOOK_S, max(LOOK_S, 1.5 * math.hypot(east - west, north - south) / max(fastest_mps, 0.3)))
    return {
        "kind": "leave",
        "rings": _rings(shapely.buffer(atom.water_en, BEYOND_M, join_style="mitre")),
        "range": look_s,
    }


def _mark(name: str, atom: Atom) -> dict[str, Any]:
    if isinstance(atom, Along | AwayFromLine):
        kind = "line" if isinstance(atom, Along) else "repulsive_line"
        return {"kind": kind, "name": name, "at": atom.from_en, "to": atom.to_en}
    if isinstance(atom, OutOf):
        return {
            "kind": "leave",
            "name": name,
            "at": (atom.water_en.bounds[0], atom.water_en.bounds[3]),
            "rings": _rings(atom.water_en),
        }
    if isinstance(atom, Round):
        return {"kind": "circle", "name": name, "at": atom.at_en, "radius": atom.radius_m}
    if isinstance(atom, AwayFrom):
        return {"kind": "repulsive_point", "name": name, "at": atom.at_en, "radius": atom.range_m}
    assert isinstance(atom, PointTo | StayAt)
    return {"kind": "point", "name": name, "at": atom.at_en}


def _rings(shape: BaseGeometry) -> list[list[tuple[float, float]]]:
    """Return the rings of polygons."""
    polygons = [p for p in shapely.get_parts(shape) if p.geom_type == "Polygon"]
    return [
        [(float(x), float(y)) for x, y in ring.coords[:-1]] for p in polygons for ring in (p.exterior, *p.interiors)
    ]

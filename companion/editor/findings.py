"""What is found in a draft, for the page: each thing with where on the chart it is, and the water as it is grown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from companion.editor.draft import Draft
from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geofence import Area, Mission, Severity
from companion.geofence.area import parts
from companion.geofence.mission import PointOptions, load_area
from companion.geofence.shapes import center_of
from companion.messages import GeoPoint
from companion.sailable import Judged, judge

SIMPLER_M = 0.25
_PLACE = re.compile(r"\[\[(goal|refuge)\]\] (\d+)|\[(start)\]|\b(goal) (\d+)|^(start)$")
_AT = re.compile(r"at (-?\d+\.\d+), (-?\d+\.\d+)$")


def looked_at(draft: Draft, from_deg: float | None) -> tuple[Judged, dict[str, Any]]:
    """Return a draft judged as ``companion mission check`` does, and the same for the page.

    ``from_deg``: where the wind comes from, None: the mission's own.
    """
    judged = judge(draft.path, from_deg=from_deg, given=draft.files)
    mission = judged.mission
    area = mission.area if mission is not None else _area_alone(draft)
    rows = [_of_error(error, draft, area) for error in judged.refusals]
    rows += [_row(f.severity, f.place, f.text, f.remedy, area) for f in judged.findings]
    is_bad = any(row["severity"] == Severity.ERROR.value for row in rows)
    return judged, {"findings": rows, "is_in_order": not is_bad, **_grown(area, draft, mission)}


def _area_alone(draft: Draft) -> Area:
    """Return the area of a draft that is no mission yet; empty where its files are in no order."""
    goals = [g for g in draft.options.goal if isinstance(g, PointOptions)]
    near = draft.options.start or (goals[0] if goals else None)
    if near is None:
        return Area()
    try:
        return load_area(draft.options.area, draft.path, GeoPoint(lat_deg=near.lat, lon_deg=near.lon), draft.files)[0]
    except InputError:
        return Area()


def _of_error(error: InputError, draft: Draft, area: Area) -> dict[str, Any]:
    source = "" if error.source == str(draft.path) else error.source.removeprefix(f"{draft.path.parent}/")
    place = ": ".join(part for part in (source, error.place) if part)
    return _row(Severity.ERROR, place, error.problem, error.remedy, area)


def _row(severity: Severity, place: str, text: str, remedy: str, area: Area) -> dict[str, Any]:
    """Return a finding; ``at`` is where it is (lat, lon), ``of`` and ``number`` what it is about."""
    match = _PLACE.search(place)
    words = [word for word in (match.groups() if match else ()) if word]
    row: dict[str, Any] = {
        "severity": severity.value, "place": place, "text": text, "remedy": remedy, "at": None,
        "of": words[0] if words else None, "number": int(words[1]) - 1 if len(words) > 1 else None}
    exact = _AT.search(place)
    if exact:
        row["at"] = [float(exact[1]), float(exact[2])]
    elif not words:
        row["at"] = _middle_of(place, area)
    return row


def _middle_of(name: str, area: Area) -> list[float] | None:
    """Return where the solid or the limit of a name is."""
    for n, solid in enumerate(area.solids, start=1):
        if name == (solid.name or f"obstacle {n}"):
            middle = center_of(solid.shape)
            return [middle.lat_deg, middle.lon_deg]
    for n, zone in enumerate(area.fence.inclusions, start=1):
        if name in {zone.name or f"zone {n}", "the fence", "keep-in zone"}:
            middle = center_of(zone.shape)
            return [middle.lat_deg, middle.lon_deg]
    return None


def _grown(area: Area, draft: Draft, mission: Mission | None) -> dict[str, Any]:
    """Return what the margin adds to the obstacles, and what it leaves of the limits, as (lat, lon) rings."""
    shapes = [o.shape for o in area.solids] + [z.shape for z in area.fence.inclusions]
    if not shapes:
        return {"grown": [], "water": []}
    frame = mission.frame() if mission is not None else LocalFrame(center_of(shapes[0]))
    local, margin_m = area.local(frame), draft.options.area.margin_m
    water = local.water(margin_m)
    return {"grown": _rings(parts(local.buffered(margin_m)), frame) if local.polygons else [],
            "water": [] if water is None else _rings(parts(water), frame)}


def _rings(polygons: Sequence[shapely.Polygon], frame: LocalFrame) -> list[list[list[list[float]]]]:
    out = []
    for polygon in polygons:
        simple = shapely.simplify(polygon, SIMPLER_M)
        out.append([
            np.round(frame.array_lonlat_from_en(shapely.get_coordinates(ring)[:-1])[:, ::-1], 7).tolist()
            for ring in (simple.exterior, *simple.interiors)])
    return out

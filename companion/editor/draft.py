"""A draft: the files that a sketch makes of its base, not written yet, and the mission that they would be."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import shapely

from companion.editor.base import Ground, SourceFiles, can_hold, new_ground, written
from companion.editor.sketch import Shape, Sketch, options_of
from companion.editor.toml import rewritten
from companion.errors import InputError, JobError
from companion.geo.frame import LocalFrame
from companion.geofence import Area, FindingLevel, Mission
from companion.geofence.area import parts
from companion.geofence.mission import PERMITS, MissionOptions, PointOptions, load_area
from companion.geofence.shapes import center_of
from companion.messages import GeoPoint
from companion.mission_check import CheckedMission, check_mission

HEAD = "name = {name}\n" + PERMITS


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """What would be written: ``files`` are the mission file and all files of its area that are drawn in."""

    path: Path
    options: MissionOptions
    files: Mapping[Path, bytes]


def draft_of(base: SourceFiles, sketch: Sketch, own: AbstractSet[Path] = frozenset()) -> Draft:
    """Return the files that a sketch makes of its base. ``own``: files that were made here before, and may be again.

    Raises:
        InputError: a value is out of its range; JobError: the mission file cannot be changed in place.
    """
    source = str(base.path)
    for name, count, keys in (
        ("goal", len(base.options.goal), [g.key for g in sketch.goals]),
        ("refuge", len(base.options.refuge), [r.key for r in sketch.refuges]),
    ):
        known = [key for key in keys if key is not None]
        if len(set(known)) != len(known) or any(key >= count for key in known):
            raise JobError(f"{source}: the sketch names a {name} that is not in the file; load it again")
    options = options_of(sketch, base.options, source)
    texts, options = _area(base, sketch, options, own)
    before, text = base.options, base.toml.text
    if base.is_new:
        named = msgspec.structs.replace(MissionOptions(), name=options.name or base.path.stem)
        options = msgspec.structs.replace(options, name=named.name)
        before, text = named, HEAD.format(name=_toml(named.name or ""))
    toml = rewritten(
        text,
        before,
        options,
        {"goal": [g.key for g in sketch.goals], "refuge": [r.key for r in sketch.refuges]},
        source,
    )
    files = {base.path: base.toml.data(toml)}
    for name, text in texts.items():
        was = base.texts.get(name)
        files[base.path.parent / name] = was.data(text) if was is not None else text.encode()
    return Draft(path=base.path, options=options, files=files)


def _toml(text: str) -> str:
    import tomlkit

    return tomlkit.item(text).as_string()


def _area(
    base: SourceFiles, sketch: Sketch, options: MissionOptions, own: AbstractSet[Path]
) -> tuple[dict[str, str], MissionOptions]:
    """Return the texts of the area's files with the sketch's shapes in them, and the options that name them."""
    grounds = dict(base.grounds)
    at_home: dict[str, list[Shape]] = {name: [] for name in grounds}
    homeless: list[Shape] = []
    for shape in sketch.shapes:
        ground = grounds.get(shape.of)
        if ground is None or shape.key is None:
            homeless.append(msgspec.structs.replace(shape, of="", key=None))
        elif shape.key >= len(ground.shapes) or any(shape.key == other.key for other in at_home[shape.of]):
            raise JobError(f"{base.path}: the sketch names a shape that is not in {shape.of}; load it again")
        elif can_hold(ground.kind, shape):
            at_home[shape.of].append(shape)
        else:
            homeless.append(msgspec.structs.replace(shape, of="", key=None))
    for shape in homeless:
        name = _place_for(shape, base, options, grounds, own)
        grounds.setdefault(name, new_ground(name, shape.zone))
        at_home.setdefault(name, []).append(shape)
    empty = {name for name, ground in grounds.items() if not at_home[name] and ground.shapes}
    names = [n for n in options.area.obstacles if n not in empty]
    names += [n for n, g in grounds.items() if g.stands_for == "exclusion" and n not in names and n not in empty]
    fence = options.area.fence if options.area.fence not in empty else None
    fence = next((n for n, g in grounds.items() if g.stands_for == "inclusion" and n not in empty), fence)
    area = msgspec.structs.replace(options.area, obstacles=tuple(names), fence=fence)
    texts = {name: written(ground, at_home[name]) for name, ground in grounds.items() if name not in empty}
    return texts, msgspec.structs.replace(options, area=area)


def _place_for(
    shape: Shape, base: SourceFiles, options: MissionOptions, grounds: Mapping[str, Ground], own: AbstractSet[Path]
) -> str:
    """Return the file that a new shape goes into: one of its zone that has words for it, else a new one."""
    for name, ground in grounds.items():
        if ground.stands_for == shape.zone and can_hold(ground.kind, shape):
            return name
    if shape.zone == "inclusion" and options.area.fence is not None:
        raise InputError(
            str(base.path),
            "[area] fence",
            f"is {options.area.fence}, which cannot be drawn in here",
            "convert it: companion fence convert, or take it out of the mission",
        )
    stem = re.sub(r"[^\w-]+", "-", base.path.stem).strip("-").lower() or "mission"
    ending = "wkt" if can_hold("wkt", shape) else "geojson"
    noun = "fence" if shape.zone == "inclusion" else "obstacles"
    number = 1
    while True:
        name = f"{stem}-{noun}{'' if number == 1 else f'-{number}'}.{ending}"
        path = base.path.parent / name
        if name not in base.texts and (not path.exists() or path in own):
            return name
        number += 1


SIMPLER_M = 0.25
_PLACE = re.compile(r"\[\[(goal|refuge)\]\] (\d+)|\[(start)\]|\b(goal) (\d+)|^(start)$")
_AT = re.compile(r"at (-?\d+\.\d+), (-?\d+\.\d+)$")


def looked_at(draft: Draft, from_deg: float | None) -> tuple[CheckedMission, dict[str, Any]]:
    """Return a draft judged as ``companion mission check`` does, and the same for the page.

    ``from_deg``: where the wind comes from, None: the mission's own.
    """
    judged = check_mission(draft.path, from_deg=from_deg, given=draft.files)
    mission = judged.mission
    area = mission.area if mission is not None else _area_alone(draft)
    rows = [_of_error(error, draft, area) for error in judged.refusals]
    rows += [_row(f.severity, _place_in(f.source, f.place, draft), f.text, f.remedy, area) for f in judged.findings]
    is_bad = any(row["severity"] == FindingLevel.ERROR.value for row in rows)
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
    return _row(FindingLevel.ERROR, _place_in(error.source, error.place, draft), error.problem, error.remedy, area)


def _place_in(source: str, place: str, draft: Draft) -> str:
    """Return a place with its file, if that is another than the mission's."""
    name = "" if source == str(draft.path) else source.removeprefix(f"{draft.path.parent}/")
    return ": ".join(part for part in (name, place) if part)


def _row(severity: FindingLevel, place: str, text: str, remedy: str, area: Area) -> dict[str, Any]:
    """Return a finding; ``at`` is where it is (lat, lon), ``of`` and ``number`` what it is about."""
    match = _PLACE.search(place)
    words = [word for word in (match.groups() if match else ()) if word]
    row: dict[str, Any] = {
        "severity": severity.value,
        "place": place,
        "text": text,
        "remedy": remedy,
        "at": None,
        "of": words[0] if words else None,
        "number": int(words[1]) - 1 if len(words) > 1 else None,
    }
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
        if name in {zone.name or f"fence {n}", "the fence", "keep-in zone"}:
            middle = center_of(zone.shape)
            return [middle.lat_deg, middle.lon_deg]
    return None


def _grown(area: Area, draft: Draft, mission: Mission | None) -> dict[str, Any]:
    """Return what the margin adds to the obstacles and takes from the limits, as (lat, lon) rings."""
    shapes = [o.shape for o in area.solids] + [z.shape for z in area.fence.inclusions]
    if not shapes:
        return {"grown": []}
    frame = mission.frame() if mission is not None else LocalFrame(center_of(shapes[0]))
    local, margin_m = area.local(frame), draft.options.area.margin_m
    grown = [local.buffered(margin_m)] if local.polygons else []
    water = local.water(margin_m)
    if local.limits is not None and water is not None:
        grown.append(shapely.difference(local.limits, water))
    return {"grown": _rings(parts(shapely.union_all(grown)), frame)}


def _rings(polygons: Sequence[shapely.Polygon], frame: LocalFrame) -> list[list[list[list[float]]]]:
    out = []
    for polygon in polygons:
        simple = shapely.simplify(polygon, SIMPLER_M)
        out.append(
            [
                np.round(frame.array_lonlat_from_en(shapely.get_coordinates(ring)[:-1])[:, ::-1], 7).tolist()
                for ring in (simple.exterior, *simple.interiors)
            ]
        )
    return out

"""What the page is told of a mission as it was read: its sketch, what is shown beside it, where its metres begin."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from companion import __version__
from companion.editor.base import Base, area_files
from companion.editor.sketch import Sketch
from companion.errors import InputError
from companion.geofence import Circle, Document, Zone
from companion.geofence.formats import FORMATS
from companion.geofence.mission import MissionOptions, read_options
from companion.geofence.shapes import center_of
from companion.messages import GeoPoint
from companion.view.area import drawn as area_drawn

SIMPLER_DEG = 2e-6        # 0.2 m
DEGREE_M = 111_195.0      # of latitude
SIDES, FEW_SIDES = 48, 8  # of a circle, and of one of many
MANY = 500
MOST_SIBLINGS = 200       # missions in the folder that are asked whether they share a file
PARTS = {"waypoints": ("mission", "fence", "rally")}
_UNKNOWN = GeoPoint(lat_deg=50.817, lon_deg=-1.31)   # where a mission without any place begins: where the examples are
_DRAWN = {"name", "goal", "refuge", "start", "area"}


def state_of(base: Base) -> dict[str, Any]:
    """Return what the page begins with."""
    sketch = base.sketch()
    frame = area_drawn("", _origin(base, sketch), [], [], [], None)
    wind = base.options.wind
    return {
        "version": __version__, "file": base.path.name, "folder": str(base.path.parent), "is_new": base.is_new,
        "called": base.options.name or base.path.stem, "disk": base.revision, "sketch": sketch,
        "frame": {"lat": frame.origin_lat_deg, "lon": frame.origin_lon_deg, "lat_m": frame.lat_m, "lon_m": frame.lon_m},
        "is_placed": _places(base, sketch) != [],
        "files": [{"name": n, "zone": zone, "why": next((o.why for o in base.locked if o.name == n), ""),
                   "shared_by": _sharing(base, n)} for n, zone in area_files(base.options)],
        "locked": [part for other in base.locked for part in _shown(other.name, other.document, base)],
        "wind": {"from_deg": wind.preview_from_deg, "speed_mps": wind.preview_speed_mps},
        "formats": [{"ending": row.endings[0][1:], "said": row.said, "part": part}
                    for row in FORMATS for part in PARTS.get(row.name, ("",))],
        "kept": [t for t in MissionOptions.__struct_fields__ if t not in _DRAWN
                 and getattr(base.options, t) != getattr(MissionOptions(), t)],
        "said": "",
    }


def _origin(base: Base, sketch: Sketch) -> GeoPoint:
    places = _places(base, sketch)
    return GeoPoint(lat_deg=places[0][0], lon_deg=places[0][1]) if places else _UNKNOWN


def _places(base: Base, sketch: Sketch) -> list[tuple[float, float]]:
    """Return places of a mission, the best to begin its metres at first."""
    out = [sketch.start.at] if sketch.start is not None else []
    out += [p for g in sketch.goals for p in (g.at, g.port_mark, g.ring[0] if g.ring else None) if p is not None]
    out += [r.at for r in sketch.refuges] + [ring[0] for s in sketch.shapes for ring in s.rings if ring]
    for other in base.locked:
        out += [(c.lat_deg, c.lon_deg) for c in (center_of(z.shape) for z in other.document.zones[:1])]
        out += [(m.geometry.coords[0][1], m.geometry.coords[0][0]) for m in other.document.marks[:1]]
    return out


def _sharing(base: Base, name: str) -> list[str]:
    """Return the names of other missions in the folder that name the same file."""
    out = []
    siblings = sorted(base.path.parent.glob("*.toml"))[:MOST_SIBLINGS] if Path(name).name == name else []
    for path in siblings:
        if path == base.path:
            continue
        with contextlib.suppress(InputError, OSError):
            if name in {n for n, _ in area_files(read_options(path))}:
                out.append(path.name)
    return out


def _shown(name: str, document: Document, base: Base) -> list[dict[str, Any]]:
    """Return the zones of a file that is shown and not edited, as (lat, lon) rings."""
    marks = document.with_zones(()).as_obstacles(base.options.area.point_radius_m)
    zones = [*document.zones, *(o.zone() for o in marks)]
    sides = SIDES if len(zones) <= MANY else FEW_SIDES
    return [{"of": name, "zone": zone.kind.value, "rings": _rings(zone, sides)} for zone in zones]


def _rings(zone: Zone, sides: int) -> list[list[list[float]]]:
    """Return a zone as it is drawn: nothing is decided by the picture."""
    if isinstance(zone.shape, Circle):
        center, turns = zone.shape.center, 2.0 * np.pi * np.arange(sides) / sides
        high_deg = zone.shape.radius_m / DEGREE_M
        wide_deg = high_deg / max(0.01, math.cos(math.radians(center.lat_deg)))
        ring = [center.lat_deg + high_deg * np.cos(turns), center.lon_deg + wide_deg * np.sin(turns)]
        return [np.round(np.column_stack(ring), 7).tolist()]
    polygon = shapely.simplify(zone.shape, SIMPLER_DEG)
    return [np.round(shapely.get_coordinates(ring)[:-1, ::-1], 7).tolist()
            for ring in (polygon.exterior, *polygon.interiors)]

"""What a voyage's folder says of it before it begins: the chart and the run."""

from __future__ import annotations

import contextlib
import platform
import sys
from collections.abc import Iterator
from importlib import metadata
from typing import Any

from companion import __version__
from companion.geofence import Mission
from companion.skipper.step import Permissions
from companion.skipper.way import Goal, Voyage


def chart_record(mission: Mission, voyage: Voyage, margin_m: float) -> dict[str, Any]:
    """Return the content of area.json: local metres about its origin, obstacles as drawn and grown by the margin."""
    area, origin = voyage.area, voyage.frame.origin
    return {
        "name": mission.name,
        "origin": {"lat_deg": origin.lat_deg, "lon_deg": origin.lon_deg},
        "goals": [
            {"x": g.en_m[0], "y": g.en_m[1], "radius_m": g.radius_m, "name": g.name, "side": g.side.value,
             **_task(g)}
            for g in voyage.goals
        ],
        "obstacles": area.obstacles_wkt(0.0),
        "grown": area.obstacles_wkt(margin_m),
        "fence": area.fence_wkt(0.0),
        "margin_m": margin_m,
        "no_go_half_deg": mission.boat.no_go_half_deg,
    }


def _task(goal: Goal) -> dict[str, Any]:
    """Return what else a chart says of a goal that is no point."""
    if goal.line is not None:
        return {"line": [list(goal.line.port_en_m), list(goal.line.starboard_en_m)]}
    water = goal.box or goal.search
    return {} if water is None else {"water": water.area_en.wkt}


def voyage_record(mission: Mission, permissions: Permissions, run: dict[str, Any], copy: str) -> dict[str, Any]:
    """Return the content of voyage.toml: the mission and its copy, how it is run, what is permitted, the versions."""
    return {
        "mission": {"name": mission.name, "path": str(mission.path), "copy": copy},
        "run": run,
        "permissions": {name: getattr(permissions, name) for name in type(permissions).__slots__},
        "versions": {
            "companion": __version__, "python": platform.python_version(), "machine": platform.machine(),
            **dict(_versions("numpy", "numba", "shapely", "pymavlink", "filterpy")),
        },
        "argv": sys.argv[1:],
    }


def _versions(*names: str) -> Iterator[tuple[str, str]]:
    """Yield those that are installed: filterpy is an extra's."""
    for name in names:
        with contextlib.suppress(metadata.PackageNotFoundError):
            yield name, metadata.version(name)

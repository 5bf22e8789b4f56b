"""What ``companion setup`` writes: a mission, and the settings of its instance of the unit."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from companion.errors import InputError


def mission_of(args: argparse.Namespace, system: int | None) -> dict[str, Any]:
    """Return the mission, as its file has it; its operator permits nothing."""
    boat: dict[str, Any] = {"no_go_half_deg": args.no_go}
    if args.polar is not None:
        boat["polar"] = args.polar.name
    mission: dict[str, Any] = {"name": args.name}
    if args.drawn:
        mission["from_autopilot"] = True
    else:
        mission["start"] = _place(args.start)
        mission["goal"] = [_place(goal) for goal in args.goal]
    mission["boat"] = boat
    if system is not None:
        mission["autopilot"] = {"system": system}
    mission["operator"] = {"set_auto": False, "arm": False}
    return mission


def _place(point: Any) -> dict[str, float]:
    return {"lat": point.lat_deg, "lon": point.lon_deg}


def settings_of(link: str) -> str:
    """Return the instance's settings."""
    return f"# How companion@ reaches the autopilot; OPTIONS= has more options of `companion run`.\nLINK={link}\n"


def write(folder: Path, name: str, mission: dict[str, Any], settings: str, polar: Path | None) -> list[Path]:
    """Write them once the mission has been read as the boat will read it; return the paths, the mission's first.

    Raises:
        InputError: it could not be sailed; nothing is written.
    """
    import tomli_w

    from companion.disk import Disk
    from companion.geofence.mission import load_mission, load_settings

    files = {f"{name}.toml": tomli_w.dumps(mission).encode(), f"{name}.env": settings.encode()}
    if polar is not None:
        files[polar.name] = polar.read_bytes()
    with tempfile.TemporaryDirectory() as scratch:
        for file, data in files.items():
            Path(scratch, file).write_bytes(data)
        try:
            path = Path(scratch, f"{name}.toml")
            if mission.get("from_autopilot"):
                load_settings(path)
            else:
                load_mission(path)
        except InputError as error:
            raise InputError(str(folder / Path(error.source).name), error.place, error.problem,
                             error.remedy or "nothing is written") from None
    for file, data in files.items():
        Disk().replace(folder / file, data)
    return [folder / file for file in files]

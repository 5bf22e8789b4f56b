"""The copy of its mission that a voyage keeps, with every file that the mission names: a replay needs nothing else.

The copy is the mission as it was sailed, every option written out, with the names of the copied files in it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import tomli_w

from companion.disk import read_regular
from companion.geofence import Mission
from companion.geofence.mission import is_file
from companion.telemetry.folder.names import COPIES
from companion.telemetry.folder.recorder import Recorder, without_none

MISSION = "mission.toml"


def write_copies(mission: Mission, recorder: Recorder) -> str:
    """Put the copy into the voyage's folder; return its place there, "" when a file of the mission has gone."""
    source = mission.path.parent
    options: dict[str, Any] = {**msgspec.to_builtins(mission.options), "name": mission.name}
    files: dict[str, Path] = {}

    def copied(name: str) -> str:
        # two files of one name may come from two folders
        known = next((k for k, path in files.items() if path == source / name), None)
        if known is not None:
            return known
        base, number = Path(name).name, 1
        while (kept := base if number == 1 else f"{number}-{base}") in {*files, MISSION}:
            number += 1
        files[kept] = source / name
        return kept

    area = options["area"]
    area["obstacles"] = [copied(name) for name in mission.options.area.obstacles]
    if mission.options.area.fence is not None:
        area["fence"] = copied(mission.options.area.fence)
    for goal in options["goal"]:
        if is_file(goal.get("polygon") or "("):
            goal["polygon"] = copied(goal["polygon"])
    for atom in options["field"].values():
        if is_file(atom.get("polygon", "(")):
            atom["polygon"] = copied(atom["polygon"])
    if mission.polar_path is not None:
        options["boat"]["polar"] = copied(str(mission.boat.polar))
    if mission.current is not None and mission.current.table is not None:
        options["current"]["table"] = copied(mission.current.table)
    try:
        for kept, path in files.items():
            recorder.whole(f"{COPIES}/{kept}", read_regular(path))
    except OSError:
        return ""
    recorder.whole(f"{COPIES}/{MISSION}", tomli_w.dumps(without_none(options)).encode())
    return f"{COPIES}/{MISSION}"

"""What a voyage writes down, step by step: track, decisions, figures, and what a replay needs to sail it again.

The copy is the mission as it was sailed, every option written out, with the names of the copied files in it.
"""

from __future__ import annotations

import contextlib
import json
import math
import platform
import sys
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec
import tomli_w

from companion import __version__
from companion.clock import now_s
from companion.current import TideTable, closed_spans
from companion.disk import read_regular
from companion.fold import Step
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.geofence import Mission
from companion.geofence.mission import MOST_PASSAGE_BYTES, is_file, planned_beside
from companion.mavlink.tlog import stamp
from companion.skipper import SkipperConfig, Voyage
from companion.skipper.step import Permissions, Persisted
from companion.skipper.way import Goal
from companion.telemetry.folder.recorder import AREA, COPIES, Recorder, without_none
from companion.telemetry.folder.records import VoyageFigures, action_record, track_row, water_record

MISSION = "mission.toml"
PASSAGE = planned_beside(Path(MISSION)).name


def mission_copy(folder: Path) -> Path:
    """Return where a voyage's folder has the copy of its mission, if it has one."""
    return folder / COPIES / MISSION


def write_copies(mission: Mission, recorder: Recorder) -> str:
    """Put the copy into the voyage's folder; return its place there, "" when a file of the mission has gone.

    The passage that the mission was planned as goes with it, as it is: nobody sails by it.
    """
    source = mission.path.parent
    options: dict[str, Any] = {**msgspec.to_builtins(mission.options), "name": mission.name}
    files: dict[str, Path] = {}

    def copied(name: str) -> str:
        # two files of one name may come from two folders
        known = next((k for k, path in files.items() if path == source / name), None)
        if known is not None:
            return known
        base, number = Path(name).name, 1
        while (kept := base if number == 1 else f"{number}-{base}") in {*files, MISSION, PASSAGE}:
            number += 1
        files[kept] = source / name
        return kept

    area = options["area"]
    area["obstacles"] = [copied(name) for name in mission.options.area.obstacles]
    area["drying"] = [copied(name) for name in mission.options.area.drying]
    if mission.options.area.tide is not None:
        area["tide"] = copied(mission.options.area.tide)
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
    with contextlib.suppress(OSError):
        data = read_regular(planned_beside(mission.path), MOST_PASSAGE_BYTES + 1)
        if len(data) <= MOST_PASSAGE_BYTES:
            recorder.whole(f"{COPIES}/{PASSAGE}", data)
    return f"{COPIES}/{MISSION}"


def chart_record(mission: Mission, voyage: Voyage, margin_m: float, tide: TideTable | None = None) -> dict[str, Any]:
    """Return the content of area.json: local metres about its origin, obstacles as drawn and grown by the margin.

    ``tide`` tells when water that dries is solid.
    """
    area, origin = voyage.area, voyage.frame.origin
    return {
        "name": mission.name,
        "origin": {"lat_deg": origin.lat_deg, "lon_deg": origin.lon_deg},
        "goals": [
            {"x": g.en_m[0], "y": g.en_m[1], "radius_m": g.radius_m, "name": g.name, "side": g.side.value, **_task(g)}
            for g in voyage.goals
        ],
        "obstacles": area.obstacles_wkt(0.0),
        "names": area.obstacle_names(0.0),
        "grown": area.obstacles_wkt(margin_m),
        "fence": area.fence_wkt(0.0),
        "drying": [
            {
                "name": water.name,
                "area": water.polygon.wkt,
                "solid_unix_s": [
                    [round(at_s) if math.isfinite(at_s) else None for at_s in span]
                    for span in closed_spans(tide, water.opens_at_m)
                ],
            }
            for water in voyage.drying
        ],
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
            "companion": __version__,
            "python": platform.python_version(),
            "machine": platform.machine(),
            **dict(_versions("numpy", "numba", "shapely", "pymavlink", "filterpy")),
        },
        "argv": sys.argv[1:],
    }


def _versions(*names: str) -> Iterator[tuple[str, str]]:
    """Yield those that are installed: filterpy is an extra's."""
    for name in names:
        with contextlib.suppress(metadata.PackageNotFoundError):
            yield name, metadata.version(name)


class Logbook:
    """The records of one voyage and its figures.

    ``epoch_s`` is the Unix time [s] of the loop's time 0. Beside a hurried simulator the loop is ``pace`` times as fast
    as the clock, which stood at ``clock_epoch_s`` [s since 1970] then: ``utc`` is the clock's, of frames the loop's.
    """

    def __init__(
        self,
        recorder: Recorder,
        config: SkipperConfig,
        epoch_s: float,
        *,
        clock_epoch_s: float | None = None,
        pace: float = 1.0,
    ) -> None:
        self.recorder, self.figures = recorder, VoyageFigures()
        self._config, self._epoch_s = config, epoch_s
        self._clock_epoch_s, self._pace = epoch_s if clock_epoch_s is None else clock_epoch_s, pace
        self._frames = 0
        self._framed_s, self._framed_us = float("nan"), 0
        self._phase = ""
        self._frame: LocalFrame | None = None  # of the chart, and of the last record that says which
        self._water: LocalFrame | None = None

    # ---------------------------------------------------------------------------------------------- time
    def quantised(self, t_s: float) -> tuple[int, float]:
        """Return a stamp [µs since 1970] as a tlog keeps it, and the loop time [s] that it stands for."""
        stamp_us = 4 * round((self._epoch_s + t_s) * 1e6 / 4.0)
        return stamp_us, stamp_us / 1e6 - self._epoch_s

    def stamped_s(self, t_s: float) -> float:
        """Return a loop time [s] as the records have it."""
        return self.quantised(t_s)[1]

    def now_s(self) -> float:
        """Return the loop's time as the records have it [s]."""
        return self.stamped_s(now_s())

    def stamps(self, t_s: float) -> dict[str, Any]:
        """Return what says when in every record."""
        unix_s = self._clock_epoch_s + t_s / self._pace
        utc = datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds")
        return {"t_s": t_s, "utc": utc.replace("+00:00", "Z")}

    # ------------------------------------------------------------------------------------------- records
    def note(self, t_s: float, record: Mapping[str, Any]) -> None:
        """Write a decision down."""
        self.recorder.decision({**self.stamps(t_s), **record})

    def frame(self, t_s: float, frame: bytes) -> None:
        """Write a frame of the link down."""
        if t_s != self._framed_s:  # the frames of one piece of bytes are of one moment
            self._framed_s, self._framed_us = t_s, self.quantised(t_s)[0]
        self.recorder.frame(stamp(self._framed_us, frame))

    def message(self) -> None:
        """Count a message that the fold has heard: a replay gives it as many before the next step."""
        self._frames += 1

    def begin(
        self,
        t_s: float,
        mission: Mission,
        voyage: Voyage,
        permissions: Permissions,
        persisted: Persisted | None,
        known: tuple[str, ...],
        run: Mapping[str, Any],
    ) -> None:
        """Write down what is sailed, with copies of its files, and what was known of earlier voyages."""
        self._frame = self._water = voyage.frame
        self.recorder.whole(
            AREA, json.dumps(chart_record(mission, voyage, self._config.margin_m, self._config.tide)).encode()
        )
        copy = write_copies(mission, self.recorder)
        started = datetime.fromtimestamp(self._epoch_s + t_s, UTC).isoformat()
        self.recorder.voyage(
            voyage_record(mission, permissions, {**run, "epoch_s": self._epoch_s, "started_utc": started}, copy)
        )
        self.note(
            t_s,
            {
                "kind": "start",
                "persisted": None if persisted is None else persisted.to_dict(),
                "known": list(known),
                "epoch_s": self._epoch_s,
            },
        )

    def step(self, step: Step, clearance_m: float | None) -> None:
        """Write a step down: where the boat is, what was decided, and by which numbers."""
        snapshot, frame = step.snapshot, step.voyage.frame
        self.figures.take(step, clearance_m)
        if self._water is not None and frame != self._water:
            self.note(snapshot.t_s, water_record(step, Shift(self._water, frame)))
            self._water = frame
        self.recorder.track(track_row(step, self._frames, clearance_m, self._frame))
        self._frames = 0
        for action in step.actions:
            self.note(snapshot.t_s, action_record(action, snapshot, self._config))
        phase = step.state.phase.value
        if phase != self._phase:
            self.note(snapshot.t_s, {"kind": "phase", "phase": phase, "why": step.state.why})
        self._phase = phase

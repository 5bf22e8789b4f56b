"""The voyage folder: what a voyage writes while it is sailed, so that a power cut costs at most the last line.

Every record is one ``write`` to a file opened for appending; ``sync`` forces the files to the disk and is called
from the outside every few seconds (on a boat, in a worker thread: a slow card must not hold the event loop).
Whole files are written beside their place, synced and renamed.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import tomli_w

from companion.errors import JobError

DECISIONS = "decisions.jsonl"
TRACK = "track.csv"
TLOG = "telemetry.tlog"
SUMMARY = "summary.json"
VOYAGE = "voyage.toml"
STATE = "state.json"

# The files of one voyage end here [bytes], restarts included: what comes later is dropped and counted. A day of the
# endurance scenario writes about a tenth of it.
MAX_BYTES = {TLOG: 2_500_000_000, DECISIONS: 500_000_000, TRACK: 150_000_000}
TAIL_BYTES = 1 << 20   # looked at for the end of the last whole line: no record is longer

TRACK_COLUMNS = (
    "t_s", "frames", "outcomes", "lat_deg", "lon_deg", "east_m", "north_m", "heading_deg", "sog_mps", "cog_deg",
    "twd_deg", "twd_sigma_deg", "tws_mps", "mode", "phase", "waypoint", "cross_track_m", "clearance_m",
)


def write_atomically(path: Path, data: bytes, *, is_durable: bool = True) -> None:
    """Write ``data`` to ``path`` whole or not at all: a new file beside it, synced if durable, renamed."""
    beside = path.with_name(path.name + ".new")
    with beside.open("wb") as file:
        file.write(data)
        file.flush()
        if is_durable:
            os.fsync(file.fileno())
    beside.replace(path)


def jsonable(value: Any) -> Any:
    """Return ``value`` as JSON can hold it: arrays as lists, NaN and infinities as None, enums by name."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): jsonable(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return jsonable(value.tolist())
    if isinstance(value, np.generic):
        return jsonable(value.item())
    if isinstance(value, list | tuple):
        return [jsonable(v) for v in value]
    if isinstance(value, Path):
        return value.as_posix()
    name = getattr(value, "name", None)
    if isinstance(name, str) and not isinstance(value, str | int):
        return name
    return value


class Recorder:
    """The files of one voyage. A context manager; ``folder`` is made if it is not there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.dropped = 0
        self._bytes: dict[str, int] = {}
        self._fds: dict[str, int] = {}

    def __enter__(self) -> Self:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for name in (DECISIONS, TRACK, TLOG):
                path = self.folder / name
                if name != TLOG:  # whose readers find the next frame by themselves
                    _cut_torn_line(path)
                self._fds[name] = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
                self._bytes[name] = os.fstat(self._fds[name]).st_size
        except OSError as error:
            raise JobError(f"cannot write the voyage to {self.folder}: {error.strerror}") from error
        if self._bytes[TRACK] == 0:
            self._append(TRACK, (",".join(TRACK_COLUMNS) + "\n").encode())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for fd in self._fds.values():
            os.close(fd)
        self._fds.clear()

    def _append(self, name: str, data: bytes) -> None:
        # A full disk must not end a voyage: the record is dropped, counted, and told in the summary.
        if self._bytes[name] + len(data) > MAX_BYTES[name]:
            self.dropped += 1
            return
        try:
            os.write(self._fds[name], data)
        except OSError:
            self.dropped += 1
            return
        self._bytes[name] += len(data)

    def decision(self, record: Mapping[str, Any]) -> None:
        """Append one decision record."""
        line = json.dumps(jsonable(record), separators=(",", ":"), ensure_ascii=False)
        self._append(DECISIONS, line.encode() + b"\n")

    def track(self, row: Sequence[Any]) -> None:
        """Append one row of the track, in the order of TRACK_COLUMNS; None is an empty cell."""
        cells = ("" if v is None else f"{v:.10g}" if isinstance(v, float) else str(v) for v in row)
        self._append(TRACK, (",".join(cells) + "\n").encode())

    def frame(self, stamped: bytes) -> None:
        """Append one stamped frame to the telemetry log."""
        self._append(TLOG, stamped)

    def sync(self) -> None:
        """Force what was written to the disk."""
        for fd in list(self._fds.values()):
            try:
                os.fdatasync(fd)
            except OSError:
                self.dropped += 1

    def voyage(self, description: Mapping[str, Any]) -> None:
        """Write voyage.toml: what ran, with which versions and seed."""
        write_atomically(self.folder / VOYAGE, tomli_w.dumps(_without_none(description)).encode())

    def summary(self, values: Mapping[str, Any]) -> None:
        """Write summary.json."""
        text = json.dumps(jsonable(values), indent=1, ensure_ascii=False)
        write_atomically(self.folder / SUMMARY, text.encode() + b"\n")


def _cut_torn_line(path: Path) -> None:
    """Cut off the half line that a power cut left: what is appended must not join it."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            begin = file.seek(max(0, size - TAIL_BYTES))
            tail = file.read()
    except FileNotFoundError:
        return
    whole = tail.rfind(b"\n") + 1
    if whole < len(tail):
        os.truncate(path, begin + whole)


def _without_none(value: Any) -> Any:
    """Drop unknown values: TOML has no null."""
    if isinstance(value, Mapping):
        return {str(k): _without_none(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_without_none(v) for v in value]
    return jsonable(value)


def read_jsonl(path: Path) -> list[dict[str, Any]]:
    """Return the records of a JSON-lines file; a torn last line is left out."""
    records: list[dict[str, Any]] = []
    lines = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        try:
            records.append(json.loads(line))
        except ValueError:
            if number < len(lines) - 2:
                raise JobError(f"{path}: line {number + 1} is not JSON; only the last line may be torn") from None
    return records

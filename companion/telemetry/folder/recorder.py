"""The voyage folder: what a voyage writes while it is sailed, so that a power cut costs at most the last line.

Every record is one ``write`` to a file opened for appending; ``tend`` forces the files to the disk and is called
from the outside every few seconds (on a boat, in a worker thread: a slow card must not hold the event loop).
Whole files are written beside their place, synced and renamed.

No record is worth the voyage. A disk that is full, read-only or sick pauses all records at once, so that none tells of
what another lacks; they are counted, ``trouble`` says why, and ``tend`` takes them up again when the disk does, with a
record of the gap. They stop before the disk is quite full: the state for a restart has the last of the room.

``telemetry.tlog`` is written; when it is large or a day old it becomes ``telemetry-000001.tlog``, soon
``telemetry-000001.tlog.gz``, and an empty one takes its place. So do track and decisions. Whoever reads a record reads
its parts and then the open file (``parts``).

The oldest finished voyages give way: first their telemetry logs, which are nearly all of it, then tracks and pictures,
at last their decisions. A voyage that is being recorded holds the lock on its folder and is never touched, nor is a
file that this program did not write.
"""

from __future__ import annotations

import contextlib
import errno
import gzip
import json
import math
import os
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import tomli_w

from companion.disk import Disk, FolderLock, is_mistake, open_regular, reason, unpacked
from companion.errors import InputError, JobError

DECISIONS = "decisions.jsonl"
TRACK = "track.csv"
TLOG = "telemetry.tlog"
SUMMARY = "summary.json"
VOYAGE = "voyage.toml"
AREA = "area.json"
STATE = "state.json"
PICTURE = "voyage.png"
VERDICT = "verdict.json"  # of a scenario
COPIES = "mission"  # the mission as it is sailed, with the files that it names


MOST_BYTES = 8 << 20  # of the open file; compressing takes as much memory
MOST_S = 86_400.0
SHARE = 64  # a part is at most this share of what all may take
DROPPED_IN_ORDER = (TLOG, TRACK, DECISIONS)


def closed(path: Path) -> list[Path]:
    """Return the closed parts of the record at ``path``, the oldest first."""
    found = [p for p in path.parent.glob(f"{path.stem}-*") if _number(path, p)]
    return sorted(found, key=lambda p: _number(path, p))


def parts(path: Path) -> list[Path]:
    """Return all parts of the record at ``path``: the closed ones, and the open file if it is there."""
    return [*closed(path), *([path] if path.is_file() else [])]


def is_from_the_start(path: Path) -> bool:
    """Return whether no part of the record has been dropped."""
    kept = closed(path)
    return not kept or _number(path, kept[0]) == 1


def read_part(path: Path) -> bytes:
    """Return what is in a part. Raises gzip.BadGzipFile where it is damaged."""
    data = path.read_bytes()
    return unpacked(data) if path.suffix == ".gz" else data


def _number(path: Path, part: Path) -> int:
    found = re.fullmatch(rf"{re.escape(path.stem)}-(\d{{6}}){re.escape(path.suffix)}(\.gz)?", part.name)
    return int(found[1]) if found else 0


class Segments:
    """The parts of one voyage's records. ``budget_bytes`` is what all voyages may take together."""

    def __init__(self, folder: Path, disk: Disk, budget_bytes: int) -> None:
        self._folder, self._disk = folder, disk
        self.part_bytes = min(MOST_BYTES, budget_bytes // SHARE)
        self.headroom_bytes = 2 * len(DROPPED_IN_ORDER) * self.part_bytes  # what is open, and its compressed copies
        self._since_s: dict[str, float] = {}
        self._plain: list[Path] | None = None  # closed and not yet compressed; None: not looked for yet

    def is_due(self, name: str, size: int, t_s: float) -> bool:
        """Return whether the open file of a record is to be closed."""
        since_s = self._since_s.setdefault(name, t_s)
        return size >= self.part_bytes or (size > 0 and t_s - since_s >= MOST_S)

    def close(self, name: str, t_s: float) -> None:
        """Give the open file its number. Raises OSError."""
        path = self._folder / name
        before = closed(path)
        number = _number(path, before[-1]) + 1 if before else 1
        part = path.with_name(f"{path.stem}-{number:06d}{path.suffix}")
        self._disk.rename(path, part)
        self._plain = [*(self._plain or []), part]
        self._since_s[name] = t_s

    def compress(self) -> None:
        """Compress the closed parts that are not yet, also those that a power cut left. Raises OSError."""
        if self._plain is None:
            self._plain = [
                part for name in DROPPED_IN_ORDER for part in closed(self._folder / name) if part.suffix != ".gz"
            ]
        while self._plain:
            part = self._plain[0]
            self._disk.replace(part.with_name(f"{part.name}.gz"), gzip.compress(part.read_bytes(), mtime=0))
            part.unlink()
            del self._plain[0]

    def drop(self, over_bytes: int) -> tuple[str, ...]:
        """Remove the oldest parts, telemetry first and decisions last; return what was removed, in words.

        The newest part of each stays: by its number it is known that others were there.
        """
        said: list[str] = []
        for name in DROPPED_IN_ORDER:
            for part in closed(self._folder / name)[:-1]:
                if over_bytes <= 0:
                    return tuple(said)
                size = part.stat().st_size
                part.unlink()
                over_bytes -= size
                said.append(f"{self._folder.name}: {part.name} ({size / 1e6:.1f} MB)")
        return tuple(said)


# Enough for half a month under way: a day of the endurance scenario writes 0.3 GB [bytes].
DEFAULT_BUDGET_BYTES = 5_000_000_000
# What is dropped first, second, last; a folder (the mission's copy) with all that is in it.
_STAGES = ((TLOG,), (TRACK, PICTURE, AREA, COPIES), (DECISIONS, SUMMARY, VERDICT, STATE, VOYAGE))


@dataclass(frozen=True, slots=True, kw_only=True)
class VoyageArchive:
    """The voyages in ``folder``, which may take ``budget_bytes`` together."""

    folder: Path
    budget_bytes: int = DEFAULT_BUDGET_BYTES

    def used_bytes(self) -> int:
        """Return what all voyages take now."""
        return sum(_size(voyage) for voyage in self._voyages())

    def tidy(self, kept_free_bytes: int = 0) -> tuple[str, ...]:
        """Drop what is over the budget, less what is to stay free of it; return what was dropped, in words."""
        return self._drop(self.used_bytes() + kept_free_bytes - self.budget_bytes, stages=len(_STAGES))

    def make_room(self, wanted_bytes: int) -> tuple[str, ...]:
        """Drop telemetry logs, and nothing else, for a disk that something else has filled."""
        return self._drop(wanted_bytes, stages=1)

    def _drop(self, wanted_bytes: int, *, stages: int) -> tuple[str, ...]:
        dropped: list[str] = []
        for names in _STAGES[:stages]:
            for voyage in self._voyages():
                if wanted_bytes <= 0:
                    return tuple(dropped)
                lock = FolderLock(voyage)
                try:
                    if not lock.take():
                        continue  # being recorded
                    freed = _remove(voyage, names)
                except OSError:
                    continue
                finally:
                    lock.release()
                if freed:
                    dropped.append(f"{voyage.name}: {', '.join(names)} ({freed / 1e6:.1f} MB)")
                wanted_bytes -= freed
        return tuple(dropped)

    def _voyages(self) -> list[Path]:
        """Return the voyages, the oldest first: by when something was last decided."""
        found: list[tuple[float, Path]] = []
        with contextlib.suppress(OSError):
            for entry in os.scandir(self.folder):
                folder = Path(entry.path)
                for name in (DECISIONS, VOYAGE):
                    with contextlib.suppress(OSError):
                        if entry.is_dir(follow_symlinks=False):
                            found.append(((folder / name).stat().st_mtime, folder))
                            break
        return [folder for _, folder in sorted(found)]


def _files(path: Path) -> Iterator[Path]:
    """Yield ``path`` if it is a file, or the files below it."""
    if path.is_symlink() or path.is_file():
        yield path
    elif path.is_dir():
        for folder, _, names in os.walk(path):
            yield from (Path(folder) / name for name in names)


def _size(path: Path) -> int:
    size = 0
    for file in _files(path):
        with contextlib.suppress(OSError):
            size += file.lstat().st_size
    return size


def _remove(voyage: Path, names: tuple[str, ...]) -> int:
    """Remove these of a voyage's files, and its folder when nothing is left in it; return the bytes freed."""
    freed = 0
    for name in names:
        for file in [*_files(voyage / name), *closed(voyage / name)]:
            with contextlib.suppress(OSError):
                size = file.lstat().st_size
                file.unlink()
                freed += size
        if (voyage / name).is_dir():
            with contextlib.suppress(OSError):
                (voyage / name).rmdir()
    with contextlib.suppress(OSError):
        voyage.rmdir()
    return freed


# The files of one voyage end here [bytes], restarts included: what comes later is dropped and counted. A day of the
# endurance scenario writes about a tenth of it. Where all voyages together may take less, these are less in proportion.
MAX_BYTES = {TLOG: 2_500_000_000, DECISIONS: 500_000_000, TRACK: 150_000_000}
TIDY_EVERY = 12  # older voyages are looked through at so many calls of ``tend`` only: once a minute
TAIL_BYTES = 1 << 20  # looked at for the end of the last whole line: no record is longer

TRACK_COLUMNS = (
    "t_s",
    "frames",
    "outcomes",
    "lat_deg",
    "lon_deg",
    "east_m",
    "north_m",
    "heading_deg",
    "sog_mps",
    "cog_deg",
    "twd_deg",
    "twd_sigma_deg",
    "tws_mps",
    "mode",
    "phase",
    "waypoint",
    "cross_track_m",
    "clearance_m",
    "current_deg",
    "current_mps",
    "current_sigma_mps",
)
_HEADER = (",".join(TRACK_COLUMNS) + "\n").encode()


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
    """The files of one voyage. A context manager; ``folder`` is made if it is not there.

    Records are written in the voyage's own loop, while ``tend`` may be at work in a thread; it has ended before the
    context does.

    Args:
        folder: of the voyage.
        disk: what is written to.
        archive: all voyages beside this one and what they may take together; None: there is no end to it.
        is_durable: force files to the disk, against power cuts.

    Attributes:
        trouble: why nothing is recorded now; empty: all is well.
        dropped: records that are not there.
    """

    def __init__(
        self, folder: Path, *, disk: Disk | None = None, archive: VoyageArchive | None = None, is_durable: bool = True
    ) -> None:
        self.folder = folder
        self.dropped = 0
        self.trouble = ""
        self._disk, self._shelf, self._is_durable = disk or Disk(), archive, is_durable
        share = 1.0 if archive is None else min(1.0, archive.budget_bytes / sum(MAX_BYTES.values()))
        self._caps = {name: int(share * most) for name, most in MAX_BYTES.items()}
        self._segments = Segments(
            folder, self._disk, sum(MAX_BYTES.values()) if archive is None else archive.budget_bytes
        )
        self._retired: list[int] = []  # files that were closed but for a write that may be under way
        self._lock = FolderLock(folder)
        self._bytes: dict[str, int] = {}
        self._fds: dict[str, int] = {}
        self._wanted: dict[str, bytes] = {}  # whole files that the disk would not take
        self._row_t_s: float | None = None  # of the last row of the track that is on the disk
        self._gap: tuple[float | None, int] = (None, 0)  # since that row; so many were dropped before it
        self._ended: dict[str, float | None] = {}  # files that have all that they may hold, since that row
        self._gone: tuple[str, ...] = ()  # of older voyages, and not yet told
        self._told: set[str] = set()  # of those, which a record says to have ended
        self._tends = 0
        self._counting = threading.Lock()  # of loop and thread, over the counts and ``_wanted``; never over disk work

    def __enter__(self) -> Self:
        self._tidy()
        try:
            self._open()
        except BlockingIOError as error:
            raise JobError(f"{self.folder}: {error.strerror}; name another folder with --out") from error
        except OSError as error:
            if is_mistake(error):
                raise JobError(f"cannot write the voyage to {self.folder}: {reason(error)}") from error
            self._pause(reason(error))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):  # the last moment for what the disk would not take
            for name in list(self._wanted):
                self._write_wanted(name)
        self._close()
        self._lock.release()

    # ----------------------------------------------------------------------------------------- records
    def decision(self, record: Mapping[str, Any]) -> None:
        """Append one decision record."""
        line = json.dumps(jsonable(record), separators=(",", ":"), ensure_ascii=False)
        self._append(DECISIONS, line.encode() + b"\n")

    def track(self, row: Sequence[Any]) -> None:
        """Append one row of the track, in the order of TRACK_COLUMNS; None is an empty cell."""
        cells = ("" if v is None else f"{v:.10g}" if isinstance(v, float) else str(v) for v in row)
        if self._append(TRACK, (",".join(cells) + "\n").encode()):
            self._row_t_s = float(row[0])

    def frame(self, stamped: bytes) -> None:
        """Append one stamped frame to the telemetry log."""
        self._append(TLOG, stamped)

    def voyage(self, description: Mapping[str, Any]) -> None:
        """Write voyage.toml: what ran, with which versions and seed."""
        self.whole(VOYAGE, tomli_w.dumps(without_none(description)).encode())

    def summary(self, values: Mapping[str, Any]) -> None:
        """Write summary.json."""
        self.whole(SUMMARY, json.dumps(jsonable(values), indent=1, ensure_ascii=False).encode() + b"\n")

    def whole(self, name: str, data: bytes) -> None:
        """Write a whole file (``name`` may lead into a folder of its own), now or when the disk takes it.

        The summary is tried whatever the trouble: no other moment comes.
        """
        with self._counting:
            self._wanted[name] = data
            if self.trouble and name != SUMMARY:
                return
        try:
            self._write_wanted(name)
        except OSError as error:
            self._pause(reason(error))

    def _write_wanted(self, name: str) -> None:
        path = self.folder / name
        if path.parent != self.folder:
            self._disk.make_folder(path.parent)
        data = self._wanted[name]
        self._disk.replace(path, data, is_durable=self._is_durable)
        with self._counting:
            if self._wanted[name] is data:  # and not what is wanted since
                del self._wanted[name]

    def _append(self, name: str, data: bytes) -> bool:
        with self._counting:
            if not self.trouble and self._bytes[name] + len(data) > self._caps[name] and name not in self._ended:
                self._ended[name] = self._row_t_s
            if self.trouble or name in self._ended:
                self.dropped += 1
                return False
            fd = self._fds[name]
        try:
            self._disk.append(fd, data)
        except OSError as error:
            self._pause(reason(error))
            with self._counting:
                self.dropped += 1
            return False
        with self._counting:
            if self._fds.get(name) == fd:  # and not closed as a part meanwhile
                self._bytes[name] += len(data)
        return True

    # -------------------------------------------------------------------------------------------- care
    def tend(self, stamps: Mapping[str, Any]) -> None:
        """Force what was written to the disk; look for room; take up records that trouble had stopped.

        ``stamps`` say when this is, as a record of it has them.
        """
        self._tends += 1
        if self._tends % TIDY_EVERY == 0:
            self._tidy()
        try:
            if self.trouble:
                self._disk.make_folder(self.folder)
            room = self._disk.room(self.folder)
            if room.is_short and self._shelf is not None:
                self._gone += self._shelf.make_room(2 * room.reserve_bytes - room.free_bytes)
                room = self._disk.room(self.folder)
            if room.is_short or (self.trouble and not room.is_ample):
                self._pause(f"{room.free_bytes / 1e6:.1f} MB left on the disk, kept for the state")
            elif self.trouble:
                self._take_up(stamps)
            elif self._is_durable:
                for fd in self._fds.values():
                    self._disk.sync(fd)
            if not self.trouble:
                self._rotate(float(stamps["t_s"]))
        except OSError as error:
            self._pause(reason(error))
        if self._gone and not self.trouble:
            self.decision({**stamps, "kind": "dropped", "voyages": list(self._gone)})
            self._gone = ()
        for name in self._ended.keys() - self._told:
            self._told.add(name)
            self.decision({**stamps, "kind": "gap", "since_s": self._ended[name], "why": f"{name} is full"})

    def _tidy(self) -> None:
        """Drop what is over the budget: of other voyages, and the oldest parts of this one."""
        if self._shelf is not None:
            budget_bytes = self._shelf.budget_bytes - self._segments.headroom_bytes
            self._gone += self._shelf.tidy(self._segments.headroom_bytes)
            over_bytes = self._shelf.used_bytes() - budget_bytes
        else:
            held = (part for name in MAX_BYTES for part in closed(self.folder / name))
            over_bytes = sum(part.stat().st_size for part in held) - sum(MAX_BYTES.values())
        with contextlib.suppress(OSError):
            self._gone += self._segments.drop(over_bytes)

    def _rotate(self, t_s: float) -> None:
        """Close what is large or old, and compress it; a write of the voyage's own loop may be under way meanwhile."""
        while self._retired:
            os.close(self._retired.pop())
        self._segments.compress()
        for name in MAX_BYTES:
            if self._segments.is_due(name, self._bytes[name], t_s):
                self._disk.sync(self._fds[name])
                self._segments.close(name, t_s)
                self._retired.append(self._fds[name])
                self._begin(name)

    def _begin(self, name: str) -> None:
        """Open a record's file, the track's with its header."""
        fd = self._disk.open_to_append(self.folder / name)
        size = os.fstat(fd).st_size
        if name == TRACK and size == 0:
            self._disk.append(fd, _HEADER)
            size = len(_HEADER)
        with self._counting:
            self._fds[name], self._bytes[name] = fd, size

    def _pause(self, why: str) -> None:
        """Record nothing any more, until ``tend`` finds that it can be."""
        with self._counting:
            if not self.trouble:
                self._gap = (self._row_t_s, self.dropped)
            self.trouble = why

    def _take_up(self, stamps: Mapping[str, Any]) -> None:
        """Record again, after what came too early and a record of what is missing."""
        self._close()
        self._open()
        for name in list(self._wanted):
            self._write_wanted(name)
        since_s, before = self._gap
        gap = {**stamps, "kind": "gap", "since_s": since_s, "dropped": self.dropped - before, "why": self.trouble}
        self._disk.append(self._fds[DECISIONS], json.dumps(gap).encode() + b"\n")
        self.trouble = ""

    def _open(self) -> None:
        self._disk.make_folder(self.folder)
        if not self._lock.is_held:
            try:
                is_ours = self._lock.take()
            except OSError:
                is_ours = True  # a file system without locks
            if not is_ours:
                raise BlockingIOError(errno.EWOULDBLOCK, "another companion is recording there")
        for name in (DECISIONS, TRACK, TLOG):
            path = self.folder / name
            if name != TLOG:  # whose readers find the next frame by themselves
                _cut_torn_line(path)
            self._begin(name)
        if self._is_durable:
            self._disk.sync_folder(self.folder)
            self._disk.sync_folder(self.folder.parent)

    def _close(self) -> None:
        for fd in (*self._fds.values(), *self._retired):
            with contextlib.suppress(OSError):
                os.close(fd)
        self._fds.clear()
        self._retired.clear()


def _cut_torn_line(path: Path) -> None:
    """Cut off the half line that a power cut left: what is appended must not join it."""
    try:
        with open_regular(path) as file:
            size = file.seek(0, os.SEEK_END)
            begin = file.seek(max(0, size - TAIL_BYTES))
            tail = file.read()
    except FileNotFoundError:
        return
    whole = tail.rfind(b"\n") + 1
    if whole < len(tail):
        os.truncate(path, begin + whole)


def without_none(value: Any) -> Any:
    """Drop unknown values: TOML has no null."""
    if isinstance(value, Mapping):
        return {str(k): without_none(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [without_none(v) for v in value]
    return jsonable(value)


def read_jsonl(path: Path) -> list[dict[str, Any]]:
    """Return the records of a JSON-lines file and its closed parts; a torn last line is left out.

    Raises:
        FileNotFoundError: it is not there.
        InputError: it is damaged; the sentence says where.
    """
    records: list[dict[str, Any]] = []
    for part in parts(path) or [path]:
        try:
            lines = read_part(part).split(b"\n")
        except gzip.BadGzipFile as error:
            raise InputError(str(part), "", f"is damaged ({error})", "take it from its copy") from None
        for number, line in enumerate(lines):
            if not line.strip():
                continue
            try:
                records.append(json.loads(line))
            except (ValueError, RecursionError):
                if number < len(lines) - 2:
                    place, problem = f"line {number + 1}", "is not JSON; only the last line may be torn"
                    raise InputError(str(part), place, problem, "take it from its copy") from None
    return records

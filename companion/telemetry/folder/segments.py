"""The closed parts of a voyage's records: what is appended for months is cut into parts, compressed, and the oldest go.

``telemetry.tlog`` is written; when it is large or a day old it becomes ``telemetry-000001.tlog``, soon
``telemetry-000001.tlog.gz``, and an empty one takes its place. So do track and decisions. Whoever reads a record reads
its parts and then the open file (``parts``).
"""

from __future__ import annotations

import gzip
import re
from pathlib import Path

from companion.disk import Disk
from companion.telemetry.folder.names import DECISIONS, TLOG, TRACK

MOST_BYTES = 8 << 20   # of the open file; compressing takes as much memory
MOST_S = 86_400.0
SHARE = 64             # a part is at most this share of what all may take
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
    """Return what is in a part."""
    data = path.read_bytes()
    return gzip.decompress(data) if path.suffix == ".gz" else data


def _number(path: Path, part: Path) -> int:
    found = re.fullmatch(rf"{re.escape(path.stem)}-(\d{{6}}){re.escape(path.suffix)}(\.gz)?", part.name)
    return int(found[1]) if found else 0


class Segments:
    """The parts of one voyage's records. ``budget_bytes`` is what all voyages may take together."""

    def __init__(self, folder: Path, disk: Disk, budget_bytes: int) -> None:
        self._folder, self._disk = folder, disk
        self.part_bytes = min(MOST_BYTES, budget_bytes // SHARE)
        self.headroom_bytes = 2 * len(DROPPED_IN_ORDER) * self.part_bytes   # what is open, and its compressed copies
        self._since_s: dict[str, float] = {}
        self._plain: list[Path] | None = None   # closed and not yet compressed; None: not looked for yet

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
            self._plain = [part for name in DROPPED_IN_ORDER for part in closed(self._folder / name)
                           if part.suffix != ".gz"]
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

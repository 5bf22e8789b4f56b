"""The voyages in one folder, and what they may take together.

The oldest finished voyages give way: first their telemetry logs, which are nearly all of it, then tracks and pictures,
at last their decisions. A voyage that is being recorded holds the lock on its folder and is never touched, nor is a
file that this program did not write.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from companion.lock import FolderLock
from companion.telemetry.folder.names import (
    AREA,
    COPIES,
    DECISIONS,
    PICTURE,
    STATE,
    SUMMARY,
    TLOG,
    TRACK,
    VERDICT,
    VOYAGE,
)
from companion.telemetry.folder.segments import closed

# Enough for half a month under way: a day of the endurance scenario writes 0.3 GB [bytes].
DEFAULT_BUDGET_BYTES = 5_000_000_000
# What is dropped first, second, last; a folder (the mission's copy) with all that is in it.
_STAGES = ((TLOG,), (TRACK, PICTURE, AREA, COPIES), (DECISIONS, SUMMARY, VERDICT, STATE, VOYAGE))


@dataclass(frozen=True, slots=True, kw_only=True)
class Shelf:
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
                        continue   # being recorded
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

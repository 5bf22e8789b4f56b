"""A disk that can be full, sick or read-only for a while: what a card does to the companion's files."""

from __future__ import annotations

import errno
import os
from collections import deque
from pathlib import Path
from typing import Final

from companion.clock import now_s
from companion.disk import Disk, Room
from companion.telemetry.folder import STATE

STATES: Final = {"full": errno.ENOSPC, "sick": errno.EIO, "read_only": errno.EROFS, "ok": 0}
KEPT = 600   # earlier contents of the saved state, which changes once a second at most


class SickDisk(Disk):
    """A disk that is well until ``become``. What is there can always be read."""

    def __init__(self) -> None:
        self._errno = 0
        self._states: deque[tuple[float, bytes]] = deque(maxlen=KEPT)

    def become(self, state: str) -> None:
        """Be "full", "sick", "read_only" or "ok" from now on."""
        self._errno = STATES[state]

    def _fail(self) -> None:
        if self._errno:
            raise OSError(self._errno, os.strerror(self._errno))

    def make_folder(self, path: Path) -> None:
        """Make a folder, where there is none yet."""
        if not path.is_dir():
            self._fail()
        super().make_folder(path)

    def open_to_append(self, path: Path) -> int:
        """Open a file; on a full disk too."""
        if self._errno != errno.ENOSPC:
            self._fail()
        return super().open_to_append(path)

    def create(self, path: Path) -> int:
        """Open a new file; on a full disk too, where it is nothing but a name."""
        if self._errno != errno.ENOSPC:
            self._fail()
        return super().create(path)

    def write(self, fd: int, data: bytes) -> int:
        """Write, unless there is something wrong."""
        self._fail()
        return super().write(fd, data)

    def sync(self, fd: int) -> None:
        """Sync; only a sick disk says that it could not."""
        if self._errno == errno.EIO:
            self._fail()
        super().sync(fd)

    def rename(self, source: Path, target: Path) -> None:
        """Rename, where names can be changed."""
        if self._errno in {errno.EIO, errno.EROFS}:
            self._fail()
        super().rename(source, target)
        if target.name == STATE:
            self._states.append((now_s(), target.read_bytes()))

    def spoil(self, path: Path, how: str, aged_s: float) -> None:
        """Lose or tear a saved state, or put back what it was ``aged_s`` ago; one that there is not stays so."""
        if how == "lost":
            path.unlink(missing_ok=True)
        elif how == "torn" and path.is_file():
            content = path.read_bytes()
            path.write_bytes(content[: len(content) // 2])
        elif how == "old" and self._states:
            before = [content for t_s, content in self._states if t_s <= now_s() - aged_s]
            path.write_bytes(before[-1] if before else self._states[0][1])

    def room(self, folder: Path) -> Room:
        """Return what is left: nothing on a full disk."""
        room = super().room(folder)
        return Room(free_bytes=0, reserve_bytes=room.reserve_bytes) if self._errno == errno.ENOSPC else room

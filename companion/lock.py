"""A lock on a folder: held by one process for as long as it lives, whatever ends it.

The folder itself is locked (flock), so nothing is written, nothing is left behind by a kill, and a full or read-only
disk can be locked too.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path


class FolderLock:
    """The lock on ``folder``; not taken until ``take``."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._fd: int | None = None

    @property
    def is_held(self) -> bool:
        """Whether this process holds it."""
        return self._fd is not None

    def take(self) -> bool:
        """Take the lock; False when somebody else holds it.

        Raises:
            OSError: the folder is not there, or its file system knows no locks.
        """
        fd = os.open(self._folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(fd)
            return False
        except OSError:
            os.close(fd)
            raise
        self._fd = fd
        return True

    def release(self) -> None:
        """Give it back, if it is held."""
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None

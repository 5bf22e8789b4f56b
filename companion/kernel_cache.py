"""The compiled kernels where the card has become read-only: numba wants a place to write even for what it only reads.

A Pi's card that fails is mounted read-only by the kernel. The boat sails on, and a companion that starts again then
must find its kernels: they are copied into memory, where new ones can be written too.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"
PACKAGE = Path(__file__).parent
IN_MEMORY = (Path("/dev/shm"), Path("/run"))  # noqa: S108 - see _is_private


def keep_usable(environment: Mapping[str, str], places: Iterable[Path] = IN_MEMORY) -> Path | None:
    """Return where numba's cache must be instead, ``None`` where it is can be written.

    To be called before numba is imported; the answer belongs into the environment as ``NUMBA_CACHE_DIR``.
    """
    chosen = environment.get(VARIABLE, "")
    user_wide = Path(environment.get("XDG_CACHE_HOME") or Path(environment.get("HOME", "/")) / ".cache") / "numba"
    asked = [Path(chosen)] if chosen else [PACKAGE / "planner/__pycache__", user_wide]   # in numba's order
    if any(_is_writable(place) for place in asked):
        return None
    for place in places:
        copy = place / f"companion-kernels-{os.getuid()}"
        with contextlib.suppress(OSError):
            if _is_private(copy):
                if asked[-1].is_dir():
                    shutil.copytree(asked[-1], copy, dirs_exist_ok=True)
                if not chosen:
                    _copy_from_tree(copy)
                return copy
    return None


def _is_private(folder: Path) -> bool:
    """Make a folder and return whether nobody else can put anything into it: what lies there is run."""
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077


def _copy_from_tree(copy: Path) -> None:
    """Copy what lies beside the sources to where numba looks for it in a folder of its own."""
    for cache in PACKAGE.rglob("__pycache__"):
        folder = str(cache.parent)
        named = copy / f"{cache.parent.name}_{hashlib.sha1(folder.encode()).hexdigest()}"  # noqa: S324 - numba's name
        for file in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
            named.mkdir(exist_ok=True)
            shutil.copyfile(file, named / file.name)


def _is_writable(place: Path) -> bool:
    """Return whether numba would take this place: it asks in the same way."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=place).close()
    except OSError:
        return False
    return True

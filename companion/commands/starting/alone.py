"""Before ``companion run`` sails: alone with the boat, and asked whether a mission that has arrived is sailed again."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from companion.telemetry.console import Console


@contextlib.contextmanager
def alone(state_path: Path, folder: Path, err: Console) -> Iterator[None]:
    """Hold the lock on the folder of the state: it is one boat's, and one companion commands a boat.

    A state within the voyage's own folder is guarded by whoever records there.
    """
    from companion.disk import Disk, is_mistake, reason
    from companion.errors import InputError, JobError
    from companion.lock import FolderLock

    if state_path.is_dir():
        raise InputError("--state", str(state_path), "is a folder", "name a file")
    if state_path.parent.resolve() == folder.resolve():
        yield
        return
    lock = FolderLock(state_path.parent)
    try:
        Disk().make_folder(state_path.parent)
        is_alone = lock.take()
    except OSError as error:
        if is_mistake(error):
            raise InputError(str(state_path.parent), "", f"cannot hold the state: {reason(error)}",
                             "name another place with --state or --out") from error
        err.write(f"companion run: {state_path.parent} cannot be locked: {reason(error)}; sailing all the same\n")
        is_alone = True
    if not is_alone:
        raise JobError(f"{state_path.parent}: another companion is sailing with the state kept here, and two must not "
                       "command one boat; end that one, or keep another boat's state elsewhere with --state")
    try:
        yield
    finally:
        lock.release()


def asked(mission: Any, state_path: Path, err: Console) -> bool | None:
    """Return whether a mission that has arrived is sailed again: what a terminal answers; None: it is not wanted."""
    if not (state_path.is_file() and sys.stdin is not None and sys.stdin.isatty() and err.isatty()):
        return False
    from companion.compose import config_of, voyage_of
    from companion.skipper import Skipper
    from companion.telemetry.state_file import read_state

    try:
        saved = read_state(state_path)
    except (OSError, ValueError):
        return False   # the voyage says what is wrong with it
    if not Skipper(voyage=voyage_of(mission), config=config_of(mission)).has_arrived(saved):
        return False
    day = datetime.fromtimestamp(state_path.stat().st_mtime, UTC)
    err.write(f"{mission.name} has arrived already ({day:%d %b %Y %H:%M} UTC). Sail it again? [y/N] ")
    if sys.stdin.readline().strip().lower() in {"y", "yes"}:
        return True
    return None

"""Saving a draft: all files or none, whole or not at all, and never over what another program has written meanwhile."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path

from companion.disk import NEW, Disk, reason
from companion.errors import JobError


def changed_meanwhile(expected: Mapping[Path, bytes], files: Mapping[Path, bytes]) -> list[Path]:
    """Return which of the ``files`` that are to be written are not what they are expected to be on the disk.

    A file that is not among ``expected`` is expected not to be there.
    """
    out = []
    for path in files:
        try:
            now: bytes | None = path.read_bytes()
        except FileNotFoundError:
            now = None
        except OSError as error:
            raise JobError(f"{path}: cannot be read ({reason(error)}); nothing is saved") from None
        if now != expected.get(path):
            out.append(path)
    return out


def save(files: Mapping[Path, bytes], disk: Disk) -> None:
    """Write all files or none: each beside its place first, synced, then all renamed.

    Raises:
        JobError: one cannot be written; what was there is there.
    """
    beside: list[tuple[Path, Path]] = []
    path = Path()
    try:
        for path, data in files.items():
            new = path.with_name(path.name + NEW)
            fd = disk.create(new)
            beside.append((new, path))
            try:
                done = 0
                while done < len(data):
                    done += disk.write(fd, data[done:])
                with contextlib.suppress(OSError):
                    os.fchmod(fd, path.stat().st_mode & 0o777)
                disk.sync(fd)
            finally:
                os.close(fd)
        for new, path in beside:
            disk.rename(new, path)
        for folder in {path.parent for path in files}:
            disk.sync_folder(folder)
    except OSError as error:
        for new, _ in beside:
            with contextlib.suppress(OSError):
                new.unlink(missing_ok=True)
        raise JobError(f"{path}: cannot be written ({reason(error)}); what was there is there") from None

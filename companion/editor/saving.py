"""Saving a draft: all files or none, whole or not at all, and never over what another program has written meanwhile."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from companion.disk import Disk, reason
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
    """Write all files or none.

    Raises:
        JobError: one cannot be written; what was there is there.
    """
    try:
        disk.replace_all(files)
    except OSError as error:
        raise JobError(f"{error.filename}: cannot be written ({reason(error)}); what was there is there") from None

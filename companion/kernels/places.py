"""Where machine code is kept, and the mark that says that all of it is there. Does not load numba.

It is kept in a folder, which is ``$COMPANION_KERNELS``, the service manager's ``$CACHE_DIRECTORY``, or
``sailboat-companion/kernels`` under ``$XDG_CACHE_HOME`` (``~/.cache``); where that cannot be written, in memory: a Pi's
card that fails is mounted read-only by the kernel, and a companion that starts again then must not compile for minutes
at every start.

What lies there is run. So a folder that another user owns (root, and who owns the package, may as well change the
program) or that others may write to is not used, and that is said once; one of ours is closed to everybody else.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import logging
import os
import platform
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

FILE = "kernels.txt"  # in each package: see ``listed``
PACKAGES = Path(__file__).resolve().parents[2]
IN_MEMORY = (Path("/dev/shm"), Path("/run"))  # noqa: S108 - see _is_private
CARRIED = Path(__file__).resolve().parent / "carried"  # filled when a package is built: see ``carry``
CARRIED_FOR = "carried.json"  # in it: the sources that it was made from, and the library
KEPT_BYTES = 200 * 2**20  # beyond this, a dozen versions of everything, the oldest files go
_LOG = logging.getLogger(__name__)
ROOT = 0  # the user who may change everything
_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def folder() -> Path:
    """Return the user's folder of machine code; it need not exist."""
    for name, below in (
        ("COMPANION_KERNELS", ""),
        ("CACHE_DIRECTORY", "kernels"),
        ("XDG_CACHE_HOME", "sailboat-companion/kernels"),
    ):
        place = os.environ.get(name, "").partition(":")[0]  # the service manager separates several by colons
        if place and Path(place).is_absolute():
            return Path(place, below)
    return Path("~/.cache/sailboat-companion/kernels").expanduser()


def looked_in() -> tuple[Path, ...]:
    """Return where machine code may lie, in the order in which it is looked for."""
    places = [folder()] if _is_ours(folder()) else []
    return *places, *(place for place in map(_of_user, IN_MEMORY) if _is_private(place))


def written_to() -> Path:
    """Return where machine code is written: the folder, or memory where the folder takes nothing. It exists.

    Raises:
        OSError: there is no such place.
    """
    try:
        return _tried(folder())
    except OSError as error:
        for place in map(_of_user, IN_MEMORY):
            with contextlib.suppress(OSError):
                place.mkdir(mode=0o700, exist_ok=True)
                if _is_private(place):
                    return _tried(place)
        raise error from None


def objection(status: os.stat_result, place: Path) -> str:
    """Return why a folder, ``place``, or a file in it is not believed to be ours, empty: it is.

    Of what the package carries others may write what they may write of its code: they can be no worse.
    """
    code, is_carried = Path(__file__).stat(), place == CARRIED
    if status.st_uid not in {os.geteuid(), ROOT, *([code.st_uid] if is_carried else [])}:
        return f"it is another user's, of uid {status.st_uid}"
    others = status.st_mode & _OTHERS & ~(code.st_mode if is_carried else 0)
    return "others may write to it" if others else ""


@functools.cache
def refuse(path: Path, why: str) -> None:
    """Say, once, that what lies at a place is not used."""
    _LOG.warning(
        "%s: %s: compiled kernels are run, so none of it is used; make it yours alone (chown, chmod go-w)", path, why
    )


def _is_ours(place: Path) -> bool:
    """Return whether a folder is ours, or not there."""
    try:
        why = objection(place.stat(), place)
    except OSError:
        return True
    if why:
        refuse(place, why)
    return not why


def _of_user(place: Path) -> Path:
    return place / f"companion-kernels-{os.getuid()}"


def _is_private(place: Path) -> bool:
    """Return whether nobody else can put anything into it: what lies there is run."""
    try:
        status = place.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077


def _tried(place: Path) -> Path:
    place.mkdir(parents=True, exist_ok=True, mode=0o700)
    if not _is_ours(place):
        raise OSError(errno.EPERM, "it is not ours alone", str(place))
    if place.stat().st_mode & 0o077:
        place.chmod(0o700)  # numba's files are as open as the user's umask has them
    with tempfile.TemporaryFile(dir=place):
        return place


@functools.cache
def versions() -> str:
    """Return what machine code depends on besides kernels, types and processor.

    Of Python the tag of its byte code: within a minor version neither that nor the layout of its objects changes.
    """
    from importlib import metadata  # which brings e-mail and archives: 3 MB that carried kernels do not ask for

    libraries = " ".join(f"{name} {metadata.version(name)}" for name in ("numba", "llvmlite", "numpy"))
    return f"{sys.implementation.cache_tag} {libraries} {platform.machine()}"


def source(package: str) -> str:
    """Return a digest of all that a package's kernels can be made from: its files and its list, as they are now."""
    seen = hashlib.sha256()
    for path in sorted((PACKAGES / package).rglob("*.py")):
        seen.update(path.read_bytes())
    seen.update((PACKAGES / package / FILE).read_bytes())
    return seen.hexdigest()


def mark(package: str) -> str:
    """Return the name of the empty file that says: all that the package lists, as its files are now, is compiled."""
    return f"all-{package}-{hashlib.sha256(f'{source(package)} {versions()}'.encode()).hexdigest()[:24]}"


def sweep() -> int:
    """Remove the oldest files beyond the limit; return how many."""
    held = removed = 0
    for _, size, path in sorted((file for place in looked_in() for file in _files(place)), reverse=True):
        held += size
        if held > KEPT_BYTES:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
                removed += 1
    return removed


def _files(place: Path) -> Iterator[tuple[float, int, Path]]:
    for path in place.glob("*") if place.is_dir() else ():
        with contextlib.suppress(OSError):
            status = path.stat()
            yield status.st_mtime, status.st_size, path

"""What the shore's commands print of a file, and how they write one: never over another without a word."""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from companion.disk import Disk, reason, what_is_there
from companion.errors import InputError, JobError
from companion.kernels.jit import begun
from companion.program import control
from companion.words import counted, listed

# Beyond this it is told why nothing happens [s]: cached, planning and drawing each take less.
PATIENCE_S = 3.0

if TYPE_CHECKING:
    from companion.geofence import Document, Finding
    from companion.geofence.formats import Written


def print_findings(findings: tuple[Finding, ...], source: str) -> bool:
    """Print findings and return whether one of them is an error."""
    from companion.geofence import FindingLevel

    for finding in findings:
        print(finding.line(source))
    return any(f.severity is FindingLevel.ERROR for f in findings)


def print_losses(losses: tuple[Finding, ...], out: str) -> None:
    """Print what a file does not carry."""
    for loss in losses:
        print(loss.line(out))


def summary(document: Document) -> str:
    """Return what a document holds in a few words."""
    from companion.geofence import Circle, ZoneKind

    counts = [
        (sum(z.kind is ZoneKind.INCLUSION for z in document.zones), "keep-in zone"),
        (sum(z.kind is ZoneKind.EXCLUSION for z in document.zones), "keep-out zone"),
        (len(document.marks), "point or line obstacle"),
        (len(document.items), "mission item"),
        (len(document.rally), "rally point"),
        (len(document.tracks), "track"),
    ]
    vertices = sum(1 if isinstance(z.shape, Circle) else len(z.shape.exterior.coords) - 1 for z in document.zones)
    words = ", ".join(counted(n, word) for n, word in counts if n)
    return (words or "nothing") + (f" ({counted(vertices, 'fence item')})" if document.zones else "")


def write_out(written: Written, out: str, *, lossy: bool, force: bool, remedy: str = "choose another format") -> None:
    """Write a file, or refuse: when it would hold nothing, or protect less than its source without ``--lossy``."""
    from companion.geofence import FindingLevel

    print_losses(written.losses, out)
    if written.is_empty:
        raise JobError(f"{out}: not written: it would be empty; {remedy}")
    if any(f.severity is FindingLevel.ERROR for f in written.losses) and not lossy:
        raise JobError(f"{out}: not written: zones would be missing; {remedy}, or say --lossy")
    write_files({out: written.data}, force=force)


def write_files(files: dict[str, bytes], *, force: bool) -> None:
    """Write all files or none: what exists is not overwritten without ``force``. Raises InputError.

    A pipe or a device is written to; nothing takes its place.
    """
    refuse_existing(list(files), force=force)
    whole = {Path(name): data for name, data in files.items()}
    name: str | Path = ""
    try:
        for name in [path for path in whole if path.is_fifo() or path.absolute().parent == Path("/dev")]:
            name.write_bytes(whole.pop(name))
        Disk().replace_all(whole)
    except OSError as error:
        place = str(error.filename or name)
        problem = f"cannot be written ({reason(error)})" + (f"; {what_is_there(error)}" if len(files) > 1 else "")
        raise InputError(place, "", problem, "name another place") from None


def refuse_existing(names: Sequence[str], *, force: bool) -> None:
    """Raise InputError when one of the files is a folder, or exists and nobody said ``force``."""
    for name in names:
        if Path(name).is_dir():  # no force writes over it
            raise InputError(name, "", "is a folder", "name a file in it")
    there = [name for name in names if Path(name).exists()]
    if there and not force:
        raise InputError(there[0], "", "exists", "say --force to overwrite it")


@contextlib.contextmanager
def patience(doing: str, why: str = "") -> Iterator[None]:
    """Say on stderr what is done and why nothing happens when the work within takes long.

    What is done once on a machine is named where it is done now; ``why``: what takes long otherwise.
    """
    before = begun()

    def say() -> None:
        once = [
            what
            for what, is_so in (("kernels are compiled", begun() > before), ("fonts are listed", _fonts_are_unlisted()))
            if is_so
        ]
        because = f"{listed(once)}, once on each machine" if once else why
        sys.stderr.write(f"note: {doing}; {because}\n" if because else f"note: still {doing}\n")

    waiting = threading.Timer(PATIENCE_S, say)
    waiting.daemon = True
    waiting.start()
    try:
        yield
    finally:
        waiting.cancel()


def _fonts_are_unlisted() -> bool:
    """Return whether matplotlib, which is here to draw, has kept no list of the machine's fonts yet."""
    folder = getattr(sys.modules.get("matplotlib"), "get_cachedir", None)
    return folder is not None and not any(Path(folder()).glob("fontlist-*.json"))


SAID_EVERY_S = 0.5


class Folding:
    """Tells on stderr how much of a voyage is folded again, where somebody looks on; a context manager."""

    def __init__(self) -> None:
        self._is_seen = sys.stderr.isatty()
        self._said_s = -math.inf

    def __enter__(self) -> Self:
        if self._is_seen:
            control(sys.stderr, "\rreading the voyage")
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_seen:
            control(sys.stderr, "\r\x1b[K")

    def __call__(self, number: int, count: int) -> None:
        """Take that ``number`` of ``count`` steps are folded."""
        if self._is_seen and time.monotonic() - self._said_s >= SAID_EVERY_S:
            self._said_s = time.monotonic()
            control(sys.stderr, f"\rfolding the voyage again: {100 * number // max(1, count)} %")


def force_option(parser: argparse.ArgumentParser) -> None:
    """Add --force."""
    parser.add_argument("--force", action="store_true", help="overwrite a file that exists")

"""A whole list, up or down, with a bar; what is written is read back and compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from companion.commands.shore.shore import OnProgress, Shore
from companion.commands.shore.wording import NAMES
from companion.errors import TransferError
from companion.messages import GeoPoint, MissionItem, MissionType


@contextmanager
def progress_bar(title: str) -> Iterator[OnProgress]:
    """Show a bar on a terminal's stderr; elsewhere nothing."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description:>18}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"),
               TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=1.0)
        yield lambda done: progress.update(task, completed=done)
        progress.update(task, completed=1.0)


def upload_and_compare(
    shore: Shore, kind: MissionType, items: Sequence[MissionItem], *, home: GeoPoint | None = None,
) -> str:
    """Write a list, read it back, compare, and return its hash. Raises TransferError where they differ."""
    from companion.mavlink.wire import first_difference, mission_hash

    name = NAMES[kind]
    with progress_bar(f"{name} upload") as on_progress:
        shore.upload(kind, items, home=home, on_progress=on_progress)
    with progress_bar("read back") as on_progress:
        found = shore.download(kind, on_progress=on_progress)
    difference = first_difference(items, found)
    if difference:
        raise TransferError(f"{name} read back differs: {difference}")
    sent, back = mission_hash(items), mission_hash(found)
    if sent != back:
        raise TransferError(f"{name} read back differs: hash {back}, sent {sent}")
    return sent


def download_list(shore: Shore, kind: MissionType) -> tuple[MissionItem, ...]:
    """Read a list with a progress bar."""
    with progress_bar(f"{NAMES[kind]} download") as on_progress:
        return shore.download(kind, on_progress=on_progress)

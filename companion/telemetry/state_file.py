"""The state for a restart: on the disk before the actions of a step, and never worth the voyage.

A state that cannot be written is kept and tried again; the voyage sails on meanwhile, and the mark in our missions lets
a restart know them without it. A state that is damaged is put aside and not believed.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
from collections.abc import Awaitable, Callable
from pathlib import Path

from companion.clock import now_s
from companion.disk import Disk, read_regular, reason
from companion.skipper.step import Persisted

Offload = Callable[[Callable[[], None]], Awaitable[None]]

ASIDE = ".damaged"
MAX_BYTES = 4 << 20  # 655 items in each of three lists take a tenth of it
PATIENCE_S = 5.0  # a card that answers later than this is not waited for
TRY_EVERY_S = 5.0  # a state that did not change is tried again so often
MOST_OTHERS = 50  # states of other missions in the folder that are looked into, the newest first


class StateFile:
    """The file that the state is kept in.

    Args:
        path: of the file.
        disk: what is written to.
        offload: where disk work is done.
        is_durable: force it to the disk.
        pace: seconds of the loop's time in a second, for the patience with the card.

    Attributes:
        trouble: why the present state is not on the disk; empty: it is.
        refusal: why the saved state was not believed; empty: it was, or there was none.
    """

    def __init__(self, path: Path, *, disk: Disk, offload: Offload, is_durable: bool = True, pace: float = 1.0) -> None:
        self.path = path
        self.trouble = ""
        self.refusal = ""
        self._disk, self._offload, self._is_durable, self._pace = disk, offload, is_durable, pace
        self._wanted: Persisted | None = None
        self._is_there = False
        self._tried_s = float("-inf")
        self._writing: asyncio.Future[None] | None = None

    # -------------------------------------------------------------------------------------------- read
    def load(self) -> Persisted | None:
        """Return the saved state, None when there is none that can be believed."""
        try:
            return read_state(self.path)
        except FileNotFoundError:
            return None
        except OSError as error:
            self.refusal = f"{self.path.name} cannot be read: {reason(error)}"
        except ValueError as error:
            self.refusal = f"{self.path.name} is not used: {error}{self._put_aside()}"
        return None

    def known(self) -> tuple[str, ...]:
        """Return the hashes of the lists that other missions, whose states lie beside this one, may have left."""
        return known_beside(self.path)

    def _put_aside(self) -> str:
        """Keep a damaged file under another name, for whoever wants to know; the next save takes its place."""
        aside = self.path.with_name(self.path.name + ASIDE)
        try:
            self._disk.rename(self.path, aside)
        except OSError:
            return ""
        return f"; it is kept as {aside.name}"

    # ------------------------------------------------------------------------------------------- write
    async def save(self, persisted: Persisted) -> None:
        """See that ``persisted`` is on the disk; where that fails say so in ``trouble`` and try again later."""
        if persisted != self._wanted:
            self._wanted, self._is_there, self._tried_s = persisted, False, float("-inf")
        if self._is_there or now_s() - self._tried_s < TRY_EVERY_S * self._pace:
            return
        if self._writing is not None and not self._writing.done():
            return  # the card still has the last one
        self._tried_s = now_s()
        data = json.dumps(persisted.to_dict()).encode()
        writing = self._writing = asyncio.ensure_future(self._write(data))
        writing.add_done_callback(lambda done: done.cancelled() or done.exception())  # heard below, or too late
        if not (await asyncio.wait({writing}, timeout=PATIENCE_S * self._pace))[0]:
            self.trouble = "the disk does not answer"
            return
        try:
            await writing
        except OSError as error:
            self.trouble = reason(error)
        else:
            self._is_there, self.trouble = True, ""

    async def _write(self, data: bytes) -> None:
        def work() -> None:
            self._disk.make_folder(self.path.parent)
            self._disk.replace(self.path, data, is_durable=self._is_durable)

        await self._offload(work)


def read_state(path: Path) -> Persisted:
    """Read a state file.

    Raises:
        OSError: it is not there, or cannot be read.
        ValueError: it cannot be believed, whatever it holds.
    """
    data = read_regular(path, MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise ValueError(f"it is longer than {MAX_BYTES >> 20} MB")
    if not data:
        raise ValueError("it is empty")
    try:
        values = json.loads(data)
    except RecursionError:
        raise ValueError("it is damaged: nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"it is damaged: {str(error)[:80]}") from None
    return Persisted.from_dict(values)


def known_beside(path: Path) -> tuple[str, ...]:
    """Return the hashes of the lists of all states that lie beside the one at ``path``."""
    found: list[tuple[float, Path]] = []
    with contextlib.suppress(OSError):
        for entry in os.scandir(path.parent):
            if entry.name.endswith("state.json") and entry.name != path.name:
                with contextlib.suppress(OSError):
                    found.append((entry.stat().st_mtime, Path(entry.path)))
    names: list[str] = []
    for _, other in sorted(found, reverse=True)[:MOST_OTHERS]:
        with contextlib.suppress(OSError, ValueError):
            names += [name for name in read_state(other).names if name not in names]
    return tuple(names)

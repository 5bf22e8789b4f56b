"""The planner's process as its worker sees it: two streams of bytes, a number, and an end."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from collections.abc import Sequence
from typing import Protocol

from companion.planner.fork_server import ForkServer


class Child(Protocol):
    """A process that plans."""

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter

    @property
    def pid(self) -> int:
        """Process id."""

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""

    async def end(self) -> None:
        """End it."""


class Started:
    """A program of its own, spoken to on its standard input and output."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        self._process, self.reader, self.writer = process, process.stdout, process.stdin

    @classmethod
    async def begin(cls, command: Sequence[str]) -> Started:
        """Start it, in a session of its own: Ctrl-C is for this process, which ends its child itself."""
        return cls(
            await asyncio.create_subprocess_exec(
                *command, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, start_new_session=True
            )
        )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.returncode is None

    async def end(self) -> None:
        """Kill it and wait for its end."""
        with contextlib.suppress(ProcessLookupError):
            self._process.kill()
        await self._process.wait()


class Forked:
    """A process of the fork server; its end is the end of its socket."""

    def __init__(self, pid: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.pid, self.reader, self.writer = pid, reader, writer

    @classmethod
    async def begin(cls, fork_server: ForkServer) -> Forked:
        """Have it forked. Raises JobError: there is nobody to do it."""
        pid, connection = fork_server.planner()
        return cls(pid, *await asyncio.open_connection(sock=connection))

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return not self.reader.at_eof()

    async def end(self) -> None:
        """Kill it, if it has not ended by itself, and forget it."""
        if self.is_alive:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)
        self.writer.close()
        with contextlib.suppress(OSError):
            await self.writer.wait_closed()

"""The planners' fork server: a process forked from this one when all is loaded, which forks a planner when it is asked.

The libraries and the machine code of all kernels are then in the memory once, for the companion and its planner
together. A fork of a process with threads, or with an event loop that turns, is not safe; so it is made before either
and has none itself. One that dies is begun anew as a program of its own (``python -m companion.planner.worker
--fork-server FD``), which shares the memory with its planners alone. It is never needed: where there is none, or it is
not ready, a planner is started as a program of its own.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from companion.errors import JobError
from companion.kernels.build import is_ready
from companion.kernels.memory import settle

_PID = struct.Struct("<q")
_PATIENCE_S = 1.0  # a fork takes milliseconds, and the voyage's loop waits for it
_REST_S = 10.0  # until one is begun anew: what kills it at once must not have the processor for itself
FORK_SERVER_READY = b"r"
FORK_SERVER = "--fork-server"  # of the worker's program: be a fork server on the socket of this number


def call_process(name: str) -> None:
    """Give the calling process the name by which ``ps``, ``top`` and the journal know it, of 15 letters at the most."""
    with contextlib.suppress(OSError):
        Path("/proc/self/comm").write_text(name, encoding="ascii")


class ForkServer:
    """The way to the process that forks planners."""

    def __init__(self, control: socket.socket, serve: Callable[[Any, Any], None], pid: int = 0) -> None:
        self._control, self._serve, self._pid = control, serve, pid
        self._program: subprocess.Popen[bytes] | None = None  # where it is one of its own
        self._is_ready, self._begun_s = True, -math.inf

    @classmethod
    def begin(cls, serve: Callable[[Any, Any], None]) -> ForkServer | None:
        """Load everything and fork; return None where that would not be safe or kernels have to be compiled first.

        Args:
            serve: answers the requests on a stream of bytes until it ends; called in a planner's process with that
                stream and the one for answers.
        """
        if threading.active_count() > 1 or not is_ready(("companion",)):
            return None
        load()
        settle()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(AttributeError, OSError, ValueError):
                stream.flush()
        ours, theirs = socket.socketpair()
        pid = os.fork()
        if pid == 0:
            ours.close()
            _until_the_end(cls(theirs, serve).tend)
        theirs.close()
        ours.settimeout(_PATIENCE_S)
        return cls(ours, serve, pid)

    @property
    def pid(self) -> int:
        """Process id."""
        return self._pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        if self._program is not None:
            return self._program.poll() is None
        try:
            return os.waitpid(self._pid, os.WNOHANG) == (0, 0)
        except ChildProcessError:
            return False

    def revive(self) -> bool:
        """Begin it anew, if it has died and that was not just done; return whether it was. It does not wait."""
        if self.is_alive or time.monotonic() < self._begun_s + _REST_S:
            return False
        self._begun_s = time.monotonic()  # one that cannot be begun is not tried again at once, either
        self._control.close()
        self._control, theirs = socket.socketpair()
        with theirs:
            self._program = subprocess.Popen(  # noqa: S603 - our own program
                [sys.executable, "-m", "companion.planner.worker", FORK_SERVER, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self._control.settimeout(_PATIENCE_S)
        self._pid, self._is_ready = self._program.pid, False
        return True

    def _hear(self) -> None:
        """Note that it is ready, when it has said so. Raises JobError: it has not."""
        if not self._is_ready:
            try:
                self._is_ready = self._control.recv(1, socket.MSG_DONTWAIT) == FORK_SERVER_READY
            except OSError:
                self._is_ready = False
        if not self._is_ready:
            raise JobError("no planner could be forked: the fork server is not ready")

    def planner(self) -> tuple[int, socket.socket]:
        """Return a new planner's process id and the socket to it. Raises JobError: there is nobody to fork it."""
        self._hear()
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                socket.send_fds(self._control, [b"p"], [theirs.fileno()])
                (pid,) = _PID.unpack(self._control.recv(_PID.size))
        except (OSError, struct.error) as error:
            ours.close()
            if self.is_alive:  # it hangs, and would keep the loop waiting again
                os.kill(self._pid, signal.SIGKILL)
            raise JobError(f"no planner could be forked: {error}") from error
        return pid, ours

    def close(self) -> None:
        """End the fork server; the planners end with their own sockets."""
        self._control.close()
        if self._program is not None:
            self._program.kill()
            self._program.wait()
        with contextlib.suppress(OSError):
            os.waitpid(self._pid, 0)

    # ------------------------------------------------------------------------------- in the fork server
    def tend(self) -> None:
        """Fork a planner for each socket that comes, until the companion has gone."""
        with contextlib.suppress(OSError):
            os.setsid()  # Ctrl-C is for the companion, which ends the planner itself
        call_process("fork-server")
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for a planner: none is left as a zombie
        while True:
            said, (*fds,), _, _ = socket.recv_fds(self._control, 1, 1)
            if not said:
                return
            pid = os.fork()
            if pid == 0:
                self._control.close()
                _until_the_end(lambda fd=fds[0]: self._plan(fd))  # type: ignore[misc]
            os.close(fds[0])
            self._control.sendall(_PID.pack(pid))

    def _plan(self, fd: int) -> None:
        call_process("planner")
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        with contextlib.suppress(OSError):
            os.nice(5)
        with os.fdopen(fd, "rb") as source, os.fdopen(os.dup(fd), "wb") as sink:
            self._serve(source, sink)


def load() -> None:
    """Load all that planners have in common: code, machine code, and the draws that each would else make for itself."""
    from companion.planner.risk.arrival import draws
    from companion.planner.solve import warm

    warm()
    draws()


def _until_the_end(work: Callable[[], None]) -> NoReturn:
    """Do the work of a forked process and end it there: what it was forked from has an end of its own to come to."""
    code = 1
    try:
        work()
        code = 0
    finally:
        os._exit(code)

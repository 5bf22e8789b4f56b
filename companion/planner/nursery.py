"""A nursery of planners: a process forked from this one when all is loaded, which forks a planner when it is asked.

The libraries and the machine code of all kernels are then in the memory once, for the companion and its planner
together. A fork of a process with threads, or with an event loop that turns, is not safe; so the nursery is made before
either and has none itself. It is never needed: where there is none, or it dies, a planner is started as a program of
its own.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import socket
import struct
import sys
import threading
from collections.abc import Callable
from typing import Any, NoReturn

from companion.errors import JobError
from companion.kernels.build import is_ready
from companion.kernels.memory import let_go, trim

_PID = struct.Struct("<q")
_PATIENCE_S = 1.0   # a fork takes milliseconds, and the voyage's loop waits for it


class Nursery:
    """The way to the process that forks planners."""

    def __init__(self, control: socket.socket, serve: Callable[[Any, Any], None], pid: int = 0) -> None:
        self._control, self._serve, self._pid = control, serve, pid

    @classmethod
    def begin(cls, serve: Callable[[Any, Any], None]) -> Nursery | None:
        """Load everything and fork; return None where that would not be safe or kernels have to be compiled first.

        Args:
            serve: answers the requests on a stream of bytes until it ends; called in a planner's process with that
                stream and the one for answers.
        """
        if threading.active_count() > 1 or not is_ready(("companion",)):
            return None
        from companion.planner.solve import warm

        warm()
        gc.collect()
        gc.freeze()   # what is there now is never looked at again, so its pages stay shared
        trim()
        let_go("libllvmlite")   # if it was loaded at all: nobody calls it any more
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(AttributeError, OSError, ValueError):
                stream.flush()
        ours, theirs = socket.socketpair()
        pid = os.fork()
        if pid == 0:
            ours.close()
            _until_the_end(cls(theirs, serve)._tend)  # noqa: SLF001
        theirs.close()
        ours.settimeout(_PATIENCE_S)
        return cls(ours, serve, pid)

    def planner(self) -> tuple[int, socket.socket]:
        """Return a new planner's process id and the socket to it. Raises JobError: there is nobody to fork it."""
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                socket.send_fds(self._control, [b"p"], [theirs.fileno()])
                (pid,) = _PID.unpack(self._control.recv(_PID.size))
        except (OSError, struct.error) as error:
            ours.close()
            raise JobError(f"no planner could be forked: {error}") from error
        return pid, ours

    def close(self) -> None:
        """End the nursery; the planners end with their own sockets."""
        self._control.close()
        with contextlib.suppress(OSError):
            os.waitpid(self._pid, 0)

    # ------------------------------------------------------------------------------- in the nursery
    def _tend(self) -> None:
        """Fork a planner for each socket that comes, until the companion has gone."""
        os.setsid()   # Ctrl-C is for the companion, which ends the planner itself
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)   # nobody waits for a planner: none is left as a zombie
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
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        with contextlib.suppress(OSError):
            os.nice(5)
        with os.fdopen(fd, "rb") as source, os.fdopen(os.dup(fd), "wb") as sink:
            self._serve(source, sink)


def _until_the_end(work: Callable[[], None]) -> NoReturn:
    """Do the work of a forked process and end it there: what it was forked from has an end of its own to come to."""
    code = 1
    try:
        work()
        code = 0
    finally:
        os._exit(code)

"""The console: what is printed while a boat sails, written by a thread of its own. No output is worth the boat.

A reader that has gone (``| head -1``, a dropped ssh), a full disk behind ``> log`` or a terminal that was stopped with
Ctrl-S costs lines and nothing else: nothing here raises, and nobody waits for it but ``close``, and that not for long.
"""

from __future__ import annotations

import contextlib
import errno
import os
import queue
import threading
from types import TracebackType
from typing import Self, TextIO

from companion.words import printable

MOST_WAITING = 64     # lines; a reader that is this far behind misses the next
_GONE = frozenset({errno.EPIPE, errno.EIO, errno.EBADF, errno.ENXIO})
LAST_WORDS_S = 1.0    # what is still waiting at the end gets so long


class Console:
    """A stream like ``sys.stdout`` (or None, where the process was started without), for progress and last words."""

    def __init__(self, stream: TextIO | None) -> None:
        self._encoding = "utf-8" if stream is None else stream.encoding
        self._fd: int | None = None
        self._is_terminal = False
        with contextlib.suppress(OSError, ValueError, AttributeError):
            if stream is not None:
                stream.flush()
                self._is_terminal = stream.isatty()
                self._fd = stream.fileno()
        self._lines: queue.Queue[bytes | None] = queue.Queue(MOST_WAITING)
        self._thread = threading.Thread(target=self._run, name="console", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(queue.Full):
            self._lines.put(None, timeout=LAST_WORDS_S)
        self._thread.join(LAST_WORDS_S)

    def write(self, text: str) -> None:
        """Print ``text`` some time soon, if anybody reads; it can do nothing to a terminal."""
        self.control(printable(text))

    def control(self, text: str) -> None:
        """Print text as it is: what moves the cursor, and what has been made printable."""
        if self._fd is not None:
            with contextlib.suppress(queue.Full):
                self._lines.put_nowait(text.encode(self._encoding, "replace"))

    def flush(self) -> None:
        """Nothing waits to be flushed: here for those who print to a stream."""

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return self._is_terminal

    def _run(self) -> None:
        while (data := self._lines.get()) is not None:
            try:
                while data and self._fd is not None:
                    data = data[os.write(self._fd, data):]
            except OSError as error:
                if error.errno in _GONE:
                    self._fd = None   # for good: the number may be another file's by and by

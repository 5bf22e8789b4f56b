"""What is said while kernels are compiled: in place on a terminal, elsewhere a line now and then."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

from companion.telemetry.progress import Stream

PATIENCE_S = 4.0      # loading what was compiled before takes about two seconds, and nothing is said of it
PLAIN_EVERY_S = 10.0  # between two lines where there is no terminal


class Preparing:
    """Says how far it is on ``stream``. A context manager: the last line is left standing."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self._is_terminal = stream.isatty()
        self._last = ""
        self._due_s = time.monotonic() + PATIENCE_S

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._last and self._is_terminal:
            self._stream.write("\n")
            self._stream.flush()

    def say(self, text: str) -> None:
        """Say it, if it is new and due."""
        now_s = time.monotonic()
        if text == self._last or now_s < self._due_s:
            return
        self._last = text
        if self._is_terminal:
            self._stream.write(f"\r{text:<100}")
        else:
            self._due_s = now_s + PLAIN_EVERY_S
            self._stream.write(f"{text}\n")
        self._stream.flush()

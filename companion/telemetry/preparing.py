"""What is said while kernels are compiled, if it takes long enough to be asked about."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

from companion.telemetry.standing import StandingLine, Stream

PATIENCE_S = 4.0      # loading what was compiled before takes about two seconds, and nothing is said of it
PLAIN_EVERY_S = 10.0  # between two lines where there is no terminal


class Preparing:
    """Says how far it is on ``stream``. A context manager: the last line is left standing."""

    def __init__(self, stream: Stream) -> None:
        self._line = StandingLine(stream, PLAIN_EVERY_S)
        self._patient_until_s = time.monotonic() + PATIENCE_S

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._line.end()

    def say(self, text: str) -> None:
        """Say it, if it is due."""
        if time.monotonic() >= self._patient_until_s:
            self._line.show(text)

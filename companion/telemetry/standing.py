"""A line that tells how far something is: rewritten in place on a terminal, elsewhere written now and then."""

from __future__ import annotations

import math
import time
from typing import Protocol

from companion.program import control
from companion.words import printable


class Stream(Protocol):
    """What lines are written to: a file, or the console of a voyage."""

    def write(self, text: str, /) -> object:
        """Write ``text``."""
        ...

    def flush(self) -> object:
        """Let it be seen."""
        ...

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        ...


class StandingLine:
    """One line on ``stream``; where that is no terminal it is written every ``every_s`` at most, and at the end."""

    def __init__(self, stream: Stream, every_s: float) -> None:
        self._stream, self._every_s = stream, every_s
        self._is_terminal = stream.isatty()
        self._widest, self._last = 0, ""
        self._unsaid, self._said_s = "", -math.inf

    def show(self, text: str) -> None:
        """Let it stand in place of what stood."""
        if text == self._last:
            return
        self._last = text
        if self._is_terminal:
            self._widest = max(self._widest, len(text) + 3)
            self._write(text.ljust(self._widest), back="\r")
            return
        self._unsaid = text
        if time.monotonic() - self._said_s >= self._every_s:
            self._say()

    def give_way(self) -> None:
        """Leave the line to what is printed next."""
        if self._is_terminal:
            self._write("", back="\r")

    def stay(self, text: str) -> None:
        """Write a line that stays, above the one that stands."""
        self.give_way()
        self._write(f"{text}\n")

    def end(self) -> None:
        """Leave what was shown last."""
        if self._widest:
            self._write("\n")
        if self._unsaid:
            self._say()

    def _say(self) -> None:
        self._write(f"{self._unsaid}\n")
        self._unsaid, self._said_s = "", time.monotonic()

    def _write(self, text: str, *, back: str = "") -> None:
        control(self._stream, back + printable(text))
        self._stream.flush()

"""What is printed can do nothing to a terminal: the two streams of a command line, made safe in one place.

Names come from charts, from other vessels and from file systems; one with an escape sequence in it clears the screen,
moves the cursor over what was said, or types into the shell of who reads.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Iterator
from typing import Any, Protocol, TextIO, cast

from companion.words import printable


class Writes(Protocol):
    """What takes text."""

    def write(self, text: str, /) -> object:
        """Write ``text``."""
        ...


class SafeStream:
    """A text stream on which nothing but ``control`` moves a cursor; else as the stream that it writes to."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text as ``printable`` shows it."""
        self._stream.write(printable(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write each of them so."""
        for line in lines:
            self.write(line)

    def control(self, text: str) -> None:
        """Write text as it is."""
        self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def control(stream: Writes, text: str) -> None:
    """Write text as it is: what moves the cursor, and what has been made printable."""
    getattr(stream, "control", stream.write)(text)


@contextlib.contextmanager
def safe_streams() -> Iterator[None]:
    """Let standard output and standard error be safe while the body runs, whatever prints there."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if stream is None or isinstance(stream, SafeStream) else cast("TextIO", SafeStream(stream))
        for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before

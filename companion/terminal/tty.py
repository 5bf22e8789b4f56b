"""The terminal: its size and its keys, as few bytes as will do, and as it was when it is left."""

from __future__ import annotations

import asyncio
import codecs
import contextlib
import os
import re
import signal
import sys
import termios
import tty
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self, TextIO

from companion.terminal.screen import Frame, changes

# The alternate screen, no cursor, no line wrap; and back.
ENTER, LEAVE = "\x1b[?1049h\x1b[?25l\x1b[?7l", "\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"


# Arrows and their like, as a terminal sends them: no key of ours.
FUNCTION_KEYS = re.compile(r"\x1b(?:\[[0-9;?]*[ -/]*[@-~]|O.)")


def can_draw(out: TextIO, environment: Mapping[str, str]) -> bool:
    """Can a dashboard be drawn here: a terminal on both ends that knows where its cursor is?"""
    return out.isatty() and sys.stdin.isatty() and environment.get("TERM", "dumb") not in {"", "dumb"}


class Terminal:
    """Draws frames on a terminal and hands over its keys. A context manager that leaves it as it was.

    Nothing is written while the terminal has not taken what it was given: a frame that it was too slow for is left out.
    """

    def __init__(self, on_key: Callable[[str], None], on_size: Callable[[], None], *, has_colour: bool = True) -> None:
        self._in, self._out = sys.stdin.fileno(), sys.stdout.fileno()
        self._on_key, self._on_size, self._has_colour = on_key, on_size, has_colour
        self._encoding = sys.stdout.encoding or "utf-8"
        self._shown: Frame | None = None
        self._waiting = b""
        self._keys = codecs.getincrementaldecoder("utf-8")("replace")
        self.bytes_out = 0
        self.is_gone = False      # hung up: nobody looks any more

    def __enter__(self) -> Self:
        self._before = termios.tcgetattr(self._in)
        self._blocking = os.get_blocking(self._out)
        tty.setcbreak(self._in)
        os.set_blocking(self._out, False)
        loop = asyncio.get_running_loop()
        loop.add_reader(self._in, self._read)
        loop.add_signal_handler(signal.SIGWINCH, self._resized)
        self._write(ENTER.encode())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._in)
        loop.remove_writer(self._out)
        loop.remove_signal_handler(signal.SIGWINCH)
        with contextlib.suppress(OSError, termios.error):
            os.set_blocking(self._out, self._blocking)
            os.write(self._out, LEAVE.encode())
            termios.tcsetattr(self._in, termios.TCSADRAIN, self._before)

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        try:
            columns, rows = os.get_terminal_size(self._out)
        except OSError:
            return 80, 24
        return columns or 80, rows or 24

    def show(self, frame: Frame) -> None:
        """Show a frame, unless the one before is still on its way."""
        if self._waiting or self.is_gone:
            return
        data = changes(self._shown, frame, has_colour=self._has_colour).encode(self._encoding, "replace")
        self._shown = frame
        self._write(data)

    def anew(self) -> None:
        """Draw the whole of the next frame: something else may have written here."""
        self._shown = None

    def _resized(self) -> None:
        self.anew()
        self._on_size()

    def _read(self) -> None:
        try:
            data = os.read(self._in, 1024)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._hang_up()
            return
        for key in FUNCTION_KEYS.sub("", self._keys.decode(data)):
            self._on_key(key)

    def _hang_up(self) -> None:
        self.is_gone = True
        asyncio.get_running_loop().remove_reader(self._in)
        self._on_key("\x03")

    def _write(self, data: bytes) -> None:
        self.bytes_out += len(data)
        self._waiting += data
        self._flush()

    def _flush(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            while self._waiting:
                self._waiting = self._waiting[os.write(self._out, self._waiting):]
            loop.remove_writer(self._out)
        except BlockingIOError:
            loop.add_writer(self._out, self._flush)
        except OSError:
            self._waiting = b""
            loop.remove_writer(self._out)
            self._hang_up()

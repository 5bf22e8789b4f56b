"""A screen as a value, and the terminal that shows it by as few bytes as will do."""

from __future__ import annotations

import asyncio
import codecs
import contextlib
import enum
import os
import re
import signal
import sys
import termios
import tty
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from types import TracebackType
from typing import Self, TextIO

NEAR = 6  # unchanged cells between two changed ones that are cheaper to write again than to jump over


class Style(enum.Enum):
    """How a cell looks; the value is its SGR code. Nothing is told by colour alone."""

    PLAIN = ""
    BOLD = "1"
    DIM = "2"
    TITLE = "7"
    GOOD = "32"
    PORT = "31"  # the tack on which the wind is over the port side, and what is bad
    STARBOARD = "32;1"
    BAD = "31;1"
    WARN = "33;1"
    ALARM = "7;31"


COLOURLESS = {Style.GOOD: "", Style.PORT: "", Style.STARBOARD: "1", Style.BAD: "1", Style.WARN: "1", Style.ALARM: "7;1"}

Cell = tuple[str, Style]
BLANK: Cell = (" ", Style.PLAIN)


@dataclass(slots=True)
class Frame:
    """``rows`` of ``columns`` cells; what is written beyond an edge is cut off."""

    columns: int
    rows: int
    cells: list[list[Cell]] = field(init=False)

    def __post_init__(self) -> None:
        self.cells = [[BLANK] * self.columns for _ in range(self.rows)]

    def put(self, row: int, column: int, text: str, style: Style = Style.PLAIN, *, width: int | None = None) -> int:
        """Write ``text``, at most ``width`` cells of it, and return the column behind it."""
        room = self.columns - column if width is None else min(width, self.columns - column)
        shown = clean(text)
        if len(shown) > room:
            shown = shown[: max(0, room - 1)] + "…" if room > 0 else ""
        if 0 <= row < self.rows:
            for offset, character in enumerate(shown):
                if 0 <= column + offset < self.columns:
                    self.cells[row][column + offset] = (character, style)
        return column + len(shown)

    def fade(self) -> None:
        """Let all that is plain look old."""
        for row in self.cells[1:]:
            row[:] = [(c, Style.DIM if style in {Style.PLAIN, Style.BOLD, Style.GOOD} else style) for c, style in row]

    @property
    def text(self) -> str:
        """The characters alone, line by line."""
        return "\n".join("".join(c for c, _ in row).rstrip() for row in self.cells)


def clean(text: str) -> str:
    """Return text that takes one cell a character and can do nothing to a terminal.

    >>> clean(chr(27) + "[2J" + chr(0x202E))
    '�[2J�'
    """
    return "".join(
        c if c.isprintable() and not unicodedata.combining(c) and unicodedata.east_asian_width(c) not in "WF" else "�"
        for c in text
    )


def changes(before: Frame | None, after: Frame, *, has_colour: bool = True) -> str:
    """Return what to write to a terminal that shows ``before`` (None: anything) so that it shows ``after``."""
    out = []
    if before is None or (before.columns, before.rows) != (after.columns, after.rows):
        before = Frame(columns=after.columns, rows=after.rows)
        out.append("\x1b[0m\x1b[2J")
    for number, (old, new) in enumerate(zip(before.cells, after.cells, strict=True)):
        for start, end in _runs(old, new):
            out.append(f"\x1b[{number + 1};{start + 1}H")
            for style, cells in groupby(new[start:end], key=lambda cell: cell[1]):
                code = style.value if has_colour else COLOURLESS.get(style, style.value)
                text = "".join(c for c, _ in cells)
                out.append(f"\x1b[{code}m{text}\x1b[0m" if code else text)
    return "".join(out)


def _runs(old: list[Cell], new: list[Cell]) -> list[tuple[int, int]]:
    """Return the stretches of a row to write again."""
    runs: list[tuple[int, int]] = []
    for column, (was, is_) in enumerate(zip(old, new, strict=True)):
        if was == is_:
            continue
        if runs and column - runs[-1][1] < NEAR:
            runs[-1] = (runs[-1][0], column + 1)
        else:
            runs.append((column, column + 1))
    return runs


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
        self.is_gone = False  # hung up: nobody looks any more

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
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
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
        self._waiting += data
        self._flush()

    def _flush(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            while self._waiting:
                self._waiting = self._waiting[os.write(self._out, self._waiting) :]
            loop.remove_writer(self._out)
        except BlockingIOError:
            loop.add_writer(self._out, self._flush)
        except OSError:
            self._waiting = b""
            loop.remove_writer(self._out)
            self._hang_up()

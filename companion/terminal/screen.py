"""A screen as a value: cells with a style, and the few bytes that turn one into the next."""

from __future__ import annotations

import enum
import unicodedata
from dataclasses import dataclass, field
from itertools import groupby

NEAR = 6   # unchanged cells between two changed ones that are cheaper to write again than to jump over


class Style(enum.Enum):
    """How a cell looks; the value is its SGR code. Nothing is told by colour alone."""

    PLAIN = ""
    BOLD = "1"
    DIM = "2"
    TITLE = "7"
    GOOD = "32"
    PORT = "31"          # the tack on which the wind is over the port side, and what is bad
    STARBOARD = "32;1"
    BAD = "31;1"
    WARN = "33;1"
    ALARM = "7;31"


COLOURLESS = {
    Style.GOOD: "", Style.PORT: "", Style.STARBOARD: "1", Style.BAD: "1", Style.WARN: "1", Style.ALARM: "7;1"}

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
            shown = shown[:max(0, room - 1)] + "…" if room > 0 else ""
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
    return "".join(c if c.isprintable() and not unicodedata.combining(c)
                   and unicodedata.east_asian_width(c) not in "WF" else "�" for c in text)


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

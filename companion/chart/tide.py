"""A table of the tide's heights: the least water of a voyage's hours."""

from __future__ import annotations

from dataclasses import dataclass

from companion.current.prior import MOST_ROWS, SPAN_S, table_lines
from companion.errors import InputError

MOST_M = 20.0  # the highest tides reach 17


@dataclass(frozen=True, slots=True, kw_only=True)
class TideRow:
    """Height of the tide above the chart's datum [m] at a Unix time [s]."""

    utc_s: float
    height_m: float


def read_tide(text: str, source: str, times: tuple[float | None, ...]) -> tuple[TideRow, ...]:
    """Return the rows of lines ``time, height_m``; ``times`` are those of its lines, None where one names no time.

    Raises:
        InputError: a line is no row, times do not increase, or there are fewer than two.
    """
    rows: list[TideRow] = []
    for (number, line), utc_s in zip(table_lines(text), times, strict=True):
        place = f"line {number}"
        parts = [part.strip() for part in line.split(",")]
        if utc_s is None:
            raise InputError(
                source, place, f"{parts[0][:40]!r} is no time with its zone", "write 2026-11-21T12:00:00Z, height_m"
            )
        try:
            (height_m,) = (float(part) for part in parts[1:])
        except ValueError:
            raise InputError(source, place, "is not a time and one height in metres", "write time, height_m") from None
        if not -MOST_M <= height_m <= MOST_M:
            raise InputError(source, place, f"a tide of {height_m:g} m cannot be", "write metres above chart datum")
        if rows and utc_s - rows[-1].utc_s < SPAN_S:
            raise InputError(source, place, "is not a minute or more after the line before", "sort the table by time")
        rows.append(TideRow(utc_s=utc_s, height_m=height_m))
        if len(rows) > MOST_ROWS:
            raise InputError(source, place, f"has more than {MOST_ROWS} rows", "leave out what is past")
    if len(rows) < 2:
        raise InputError(source, "", "has fewer than two rows", "a tide table needs the times between which it holds")
    return tuple(rows)


def lowest_m(rows: tuple[TideRow, ...], from_s: float, to_s: float, source: str) -> float:
    """Return the least height [m] that the table knows of a span of time: its rows there, and those on either side.

    Between high and low water the tide lies between them, so no lower one is left out where both are in the table.
    Raises InputError where the table does not hold for all of the span.
    """
    if from_s < rows[0].utc_s or to_s > rows[-1].utc_s:
        raise InputError(source, "", "does not hold for all of --from to --to", "take a table of those hours")
    first = max(n for n, row in enumerate(rows) if row.utc_s <= from_s)
    last = min(n for n, row in enumerate(rows) if row.utc_s >= to_s)
    return min(row.height_m for row in rows[first : last + 1])

"""A table of the tide's heights: the least water of a voyage's hours."""

from __future__ import annotations

from dataclasses import dataclass

from companion.current.prior import timed_rows
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
        InputError: a line is no row, or as of ``timed_rows``.
    """
    rows: list[TideRow] = []
    for place, utc_s, cells in timed_rows(text, source, times, "height_m"):
        try:
            (height_m,) = map(float, cells)
        except ValueError:
            raise InputError(source, place, "is not a time and one height in metres", "write time, height_m") from None
        if not -MOST_M <= height_m <= MOST_M:
            raise InputError(source, place, f"a tide of {height_m:g} m cannot be", "write metres above chart datum")
        rows.append(TideRow(utc_s=utc_s, height_m=height_m))
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

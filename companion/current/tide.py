"""A table of the tide's heights: the least water of a voyage's hours.

Between two rows the tide is known where half a wave from one to the other is right: where they are an hour apart at
most, or are high and low water that follow each other. High waters alone, a row each three hours, a table with a day
left out tell nothing of the water between: it may have dried.
"""

from __future__ import annotations

import bisect
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.current.prior import timed_rows
from companion.errors import InputError

MOST_M = 20.0  # the highest tides reach 17
HOUR_S = 3600.0 + 60.0  # rows that near are sailed between, whatever they are: a tide of 6 m errs by 0.2 m
HALF_TIDE_S = 8.0 * 3600.0  # from high to low water, in rivers too; from one high water to the next it is 9 at least
SAMPLED = 3  # so many equal steps of whole hours are a choice of the table's: half a tide takes 6 h 12 min
ROWS_REMEDY = "write each high and each low water, or a row for each hour"


@dataclass(frozen=True, slots=True, kw_only=True)
class TideRow:
    """Height of the tide above the chart's datum [m] at a Unix time [s]."""

    utc_s: float
    height_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TideTable:
    """Heights over a span of time: each high and low water, or each hour. ``name`` is its file's, for what is said."""

    rows: tuple[TideRow, ...]
    name: str = ""

    def height_m(self, utc_s: float | None) -> float | None:
        """Return the height above the chart's datum at a Unix time, a half wave from row to row; None: not known."""
        rows = self.rows
        if utc_s is None or not rows or not rows[0].utc_s <= utc_s <= rows[-1].utc_s:
            return None
        n = bisect.bisect_right(rows, utc_s, key=lambda row: row.utc_s) - 1
        a = rows[n]
        if utc_s == a.utc_s:
            return a.height_m
        if not is_known_after(rows, n):
            return None
        b = rows[n + 1]
        share = (utc_s - a.utc_s) / (b.utc_s - a.utc_s)
        return a.height_m + (b.height_m - a.height_m) * (1.0 - math.cos(math.pi * share)) / 2.0

    def near_s(self, utc_s: float) -> float:
        """Return a Unix time that the table holds for: this one, else the one at which it begins."""
        return utc_s if self.height_m(utc_s) is not None or not self.rows else self.rows[0].utc_s

    def gaps(self) -> tuple[tuple[float, float], ...]:
        """Return when nothing is known of the tide between its rows, as spans of Unix time in order."""
        spans: list[tuple[float, float]] = []
        for n, row in enumerate(self.rows[:-1]):
            if not is_known_after(self.rows, n):
                begin = spans.pop()[0] if spans and spans[-1][1] == row.utc_s else row.utc_s
                spans.append((begin, self.rows[n + 1].utc_s))
        return tuple(spans)


def is_known_after(rows: Sequence[TideRow], n: int) -> bool:
    """Return whether rows tell the tide from row ``n`` to the next."""
    span_s = rows[n + 1].utc_s - rows[n].utc_s
    if span_s <= HOUR_S:
        return True
    return span_s <= HALF_TIDE_S and not _is_sampled(rows, n) and _turns(rows, n, n - 1) and _turns(rows, n + 1, n + 2)


def _turns(rows: Sequence[TideRow], at: int, beyond: int) -> bool:
    """Return whether a row is high or low water, seen from an interval beside it: as high and low go on beyond it.

    Where the table ends, or has a gap, nothing speaks against it; rows each hour do: what lies beside them is a hole.
    """
    step_m = rows[at].height_m - rows[2 * at - beyond].height_m
    if step_m == 0.0:
        return False
    span_s = abs(rows[beyond].utc_s - rows[at].utc_s) if 0 <= beyond < len(rows) else math.inf
    if span_s > HALF_TIDE_S:
        return True
    return span_s > HOUR_S and (rows[beyond].height_m - rows[at].height_m) * step_m < 0.0


def _is_sampled(rows: Sequence[TideRow], n: int) -> bool:
    """Return whether the interval after row ``n`` is one of a table with a row each two, three or six hours."""
    span_s = rows[n + 1].utc_s - rows[n].utc_s
    if span_s % 3600.0 != 0.0:
        return False
    near = range(max(0, n - SAMPLED + 1), min(len(rows) - 1, n + SAMPLED))
    run = longest = 0
    for k in near:
        run = run + 1 if rows[k + 1].utc_s - rows[k].utc_s == span_s else 0
        longest = max(longest, run)
    return longest >= SAMPLED


def hour_words(utc_s: float) -> str:
    """Return a Unix time as tables and commands have it.

    >>> hour_words(1_795_510_800.0)
    '2026-11-24T09:00Z'
    """
    return f"{np.datetime_as_string(np.datetime64(round(utc_s), 's'), unit='m')}Z"


def span_words(table: TideTable) -> str:
    """Return what a table holds for, and what it leaves out, in words."""
    rows, gaps = table.rows, table.gaps()
    words = f"{table.name or 'the tide table'} holds from {hour_words(rows[0].utc_s)} to {hour_words(rows[-1].utc_s)}"
    if not gaps:
        return words
    first, rest = gaps[0], len(gaps) - 1
    more = f", nor in {rest} more gap{'s' if rest > 1 else ''}" if rest else ""
    return f"{words}, but not between its rows of {hour_words(first[0])} and {hour_words(first[1])}{more}"


@functools.lru_cache(maxsize=256)  # by the level: asked for at each step of a voyage
def open_spans(table: TideTable, level_m: float) -> tuple[tuple[float, float], ...]:
    """Return when the tide is known to stand at a level or higher, as spans of Unix time in order.

    From row to row the height is half a wave, as ``TideTable.height_m`` has it, so each crossing is exact.
    """
    spans: list[tuple[float, float]] = []
    for n, a in enumerate(table.rows[:-1]):
        b = table.rows[n + 1]
        low, high = min(a.height_m, b.height_m), max(a.height_m, b.height_m)
        if high < level_m or b.utc_s <= a.utc_s or not is_known_after(table.rows, n):
            continue
        begin, end = a.utc_s, b.utc_s
        if low < level_m:
            share = math.acos(1.0 - 2.0 * (level_m - a.height_m) / (b.height_m - a.height_m)) / math.pi
            at_s = a.utc_s + share * (b.utc_s - a.utc_s)
            begin, end = (at_s, end) if b.height_m > a.height_m else (begin, at_s)
        if spans and spans[-1][1] >= begin:
            spans[-1] = (spans[-1][0], end)
        else:
            spans.append((begin, end))
    return tuple(spans)


def closed_spans(table: TideTable | None, level_m: float) -> tuple[tuple[float, float], ...]:
    """Return when the tide is not known to stand at a level or higher, as spans of Unix time in order.

    The first may begin at minus infinity, the last end at infinity; without a table it is one: for ever.
    """
    spans = () if table is None else open_spans(table, level_m)
    edges = [-math.inf, *(edge for span in spans for edge in span), math.inf]
    return tuple(zip(edges[::2], edges[1::2], strict=True))


def read_tide(text: str, source: str, times: tuple[float | None, ...]) -> tuple[TideRow, ...]:
    """Return the rows of lines ``time, height_m``; ``times`` are those of its lines, None where one names no time.

    Raises:
        InputError: a line is no row, no two rows tell of the tide between them, or as of ``timed_rows``.
    """
    rows: list[TideRow] = []
    places: list[str] = []
    for place, utc_s, cells in timed_rows(text, source, times, "height_m"):
        try:
            (height_m,) = map(float, cells)
        except ValueError:
            raise InputError(source, place, "is not a time and one height in metres", "write time, height_m") from None
        if not -MOST_M <= height_m <= MOST_M:
            raise InputError(source, place, f"a tide of {height_m:g} m cannot be", "write metres above chart datum")
        rows.append(TideRow(utc_s=utc_s, height_m=height_m))
        places.append(place)
    if not any(is_known_after(rows, n) for n in range(len(rows) - 1)):
        raise InputError(source, places[1], f"{_apart(rows, 0)}: nothing is known of the tide at any hour", ROWS_REMEDY)
    return tuple(rows)


def _apart(rows: Sequence[TideRow], n: int) -> str:
    """Return why the tide after row ``n`` is not known, in words for the row after it."""
    minutes = round((rows[n + 1].utc_s - rows[n].utc_s) / 60.0)
    apart = f"is {minutes // 60} h {minutes % 60:02d} min after the row before"
    if minutes * 60.0 > HALF_TIDE_S:
        return f"{apart}, more than high and low water are apart"
    return f"{apart}, and the two are not high and low water that follow each other"


def lowest_m(rows: tuple[TideRow, ...], from_s: float, to_s: float, source: str) -> float:
    """Return the least height [m] that the table knows of a span of time: its rows there, and those on either side.

    Between high and low water the tide lies between them, so no lower one is left out where both are in the table.
    Raises InputError where the table does not hold for all of the span.
    """
    if from_s < rows[0].utc_s or to_s > rows[-1].utc_s:
        raise InputError(source, "", "does not hold for all of --from to --to", "take a table of those hours")
    first = max(n for n, row in enumerate(rows) if row.utc_s <= from_s)
    last = min(n for n, row in enumerate(rows) if row.utc_s >= to_s)
    for n in range(first, last):
        if not is_known_after(rows, n):
            raise InputError(source, f"row of {hour_words(rows[n + 1].utc_s)}", _apart(rows, n), ROWS_REMEDY)
    return min(row.height_m for row in rows[first : last + 1])

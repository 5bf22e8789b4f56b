"""A table of the tide's heights: the least water of a voyage's hours."""

from __future__ import annotations

import bisect
import functools
import math
from dataclasses import dataclass
from itertools import pairwise

from companion.current.prior import timed_rows
from companion.errors import InputError

MOST_M = 20.0  # the highest tides reach 17


@dataclass(frozen=True, slots=True, kw_only=True)
class TideRow:
    """Height of the tide above the chart's datum [m] at a Unix time [s]."""

    utc_s: float
    height_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TideTable:
    """Heights over a span of time: each high and low water, or each hour."""

    rows: tuple[TideRow, ...]

    def height_m(self, utc_s: float | None) -> float | None:
        """Return the height above the chart's datum at a Unix time, a half wave from row to row; None: not in it."""
        rows = self.rows
        if utc_s is None or not rows or not rows[0].utc_s <= utc_s <= rows[-1].utc_s:
            return None
        after = min(bisect.bisect_right([row.utc_s for row in rows], utc_s), len(rows) - 1)
        a, b = rows[max(0, after - 1)], rows[after]
        if a is b:
            return a.height_m
        share = (utc_s - a.utc_s) / (b.utc_s - a.utc_s)
        return a.height_m + (b.height_m - a.height_m) * (1.0 - math.cos(math.pi * share)) / 2.0

    def near_s(self, utc_s: float) -> float:
        """Return a Unix time that the table holds for: this one, else the one at which it begins."""
        return utc_s if self.height_m(utc_s) is not None or not self.rows else self.rows[0].utc_s


@functools.lru_cache(maxsize=256)  # by the level: asked for at each step of a voyage
def open_spans(table: TideTable, level_m: float) -> tuple[tuple[float, float], ...]:
    """Return when the tide stands at a level or higher, as spans of Unix time in order; beyond its rows it does not.

    From row to row the height is half a wave, as ``TideTable.height_m`` has it, so each crossing is exact.
    """
    spans: list[tuple[float, float]] = []
    for a, b in pairwise(table.rows):
        low, high = min(a.height_m, b.height_m), max(a.height_m, b.height_m)
        if high < level_m or b.utc_s <= a.utc_s:
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

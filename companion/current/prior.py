"""What the mission expects of the current: nothing, a constant set and drift, or a tide table with times.

A table that has ended, has not begun, or has a gap keeps its nearest row and widens it to the strength of the tide
within an hour: it is never silently still water. Without the time of day no row can be chosen: the current is then
unknown by as much as the strongest row.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator
from dataclasses import dataclass

from companion.errors import InputError
from companion.geo.angles import wrap_two_pi

DEFAULT_SIGMA_MPS = 0.5  # of water of which the mission says nothing: most tidal waters are within twice of it
ENDED_S = 3600.0  # a tide has become another within the hour
APART_S = 8.0 * 3600.0  # between rows farther apart nothing is told: from strongest flood to strongest ebb it is six
MOST_ROWS = 20_000  # two years of hours
MOST_MPS = 10.0  # the strongest tidal races reach 8
SPAN_S = 60.0  # rows nearer together than this are a mistake


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """The current at one time: Unix time [s], towards east and north [m/s]."""

    utc_s: float
    east_mps: float
    north_mps: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedCurrent:
    """What is expected at a time: towards east and north [m/s], how far it may be wrong [m/s], what is to be said."""

    east_mps: float = 0.0
    north_mps: float = 0.0
    sigma_mps: float = DEFAULT_SIGMA_MPS
    verdict: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """What the mission expects. With ``rows`` a tide table, else constant; ``sigma_mps`` is how far it may be wrong.

    ``name`` is the table's file, for what is said of it.
    """

    east_mps: float = 0.0
    north_mps: float = 0.0
    sigma_mps: float = DEFAULT_SIGMA_MPS
    rows: tuple[TableRow, ...] = ()
    name: str = ""

    @property
    def strongest_mps(self) -> float:
        """The strongest drift that is expected at any time [m/s]."""
        if not self.rows:
            return math.hypot(self.east_mps, self.north_mps)
        return max(math.hypot(r.east_mps, r.north_mps) for r in self.rows)

    def at(self, utc_s: float | None) -> ExpectedCurrent:
        """Return what is expected at a Unix time [s]; None: the time of day is not known."""
        rows = self.rows
        if not rows:
            return ExpectedCurrent(east_mps=self.east_mps, north_mps=self.north_mps, sigma_mps=self.sigma_mps)
        if utc_s is None:
            widest = max(self.sigma_mps, self.strongest_mps)
            return ExpectedCurrent(
                sigma_mps=widest, verdict=f"{self.name}: no row can be chosen before the time is known"
            )
        if utc_s < rows[0].utc_s or utc_s > rows[-1].utc_s:
            is_over = utc_s > rows[-1].utc_s
            row = rows[-1] if is_over else rows[0]
            off_s = abs(utc_s - row.utc_s)
            what = f"ended {_span(off_s)} ago" if is_over else f"begins in {_span(off_s)}"
            return self._widened(row, off_s, what)
        after = min(max(1, bisect.bisect_right([r.utc_s for r in rows], utc_s)), len(rows) - 1)
        a, b = rows[after - 1], rows[after]
        if b.utc_s - a.utc_s > APART_S:
            row = min(a, b, key=lambda r: abs(r.utc_s - utc_s))
            return self._widened(row, abs(row.utc_s - utc_s), f"has rows {_span(b.utc_s - a.utc_s)} apart here")
        share = (utc_s - a.utc_s) / (b.utc_s - a.utc_s)
        return ExpectedCurrent(
            east_mps=a.east_mps + share * (b.east_mps - a.east_mps),
            north_mps=a.north_mps + share * (b.north_mps - a.north_mps),
            sigma_mps=self.sigma_mps,
        )

    def _widened(self, row: TableRow, off_s: float, what: str) -> ExpectedCurrent:
        """Return a row at a time ``off_s`` from it, which it holds for the less the farther off it is."""
        widest = max(self.sigma_mps, self.strongest_mps)
        share = min(1.0, off_s / ENDED_S)
        return ExpectedCurrent(
            east_mps=row.east_mps,
            north_mps=row.north_mps,
            verdict=f"{self.name} {what}: its nearest row, widened",
            sigma_mps=self.sigma_mps + share * (math.hypot(widest, self.sigma_mps) - self.sigma_mps),
        )


STILL = Prior()


def _span(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.0f} h"


def timed_rows(
    text: str, source: str, times: tuple[float | None, ...], columns: str
) -> Iterator[tuple[str, float, list[str]]]:
    """Yield place, Unix time [s] and the other cells of each line of a table over time.

    Args:
        text: its content. Empty lines, lines that begin with # and one line of headings are passed over.
        source: what a complaint names.
        times: the Unix time [s] of each line that is left, None where the line names no time.
        columns: what stands behind the time, as a complaint has it.

    Raises:
        InputError: a line has no time, times do not increase, or there are fewer than two.
    """
    before_s: float | None = None
    count = 0
    for (number, line), utc_s in zip(table_lines(text), times, strict=True):
        place = f"line {number}"
        first, *cells = (part.strip() for part in line.split(","))
        if utc_s is None:
            raise InputError(
                source, place, f"{first[:40]!r} is no time with its zone", f"write 2026-11-21T12:00:00Z, {columns}"
            )
        if before_s is not None and utc_s - before_s < SPAN_S:
            raise InputError(source, place, "is not a minute or more after the line before", "sort the table by time")
        before_s, count = utc_s, count + 1
        if count > MOST_ROWS:
            raise InputError(source, place, f"has more than {MOST_ROWS} rows", "leave out what is past")
        yield place, utc_s, cells
    if count < 2:
        raise InputError(source, "", "has fewer than two rows", "a tide table needs the times between which it holds")


def read_table(text: str, source: str, times: tuple[float | None, ...]) -> tuple[TableRow, ...]:
    """Return the rows of a tide table: lines of time, set [deg, towards], drift [m/s], separated by commas.

    Raises:
        InputError: a line is no row, or as of ``timed_rows``.

    """
    rows: list[TableRow] = []
    for place, utc_s, cells in timed_rows(text, source, times, "set_deg, drift_mps"):
        try:
            set_deg, drift_mps = float(cells[0]), float(cells[1])
        except (IndexError, ValueError):
            raise InputError(
                source, place, "a set in degrees and a drift in m/s are missing", "write time, set_deg, drift_mps"
            ) from None
        if len(cells) > 2 or not (0.0 <= set_deg <= 360.0 and 0.0 <= drift_mps <= MOST_MPS):
            raise InputError(
                source,
                place,
                f"set {set_deg:g}, drift {drift_mps:g} cannot be",
                f"write 0..360 degrees towards which it sets and 0..{MOST_MPS:g} m/s",
            )
        set_rad = wrap_two_pi(math.radians(set_deg))
        rows.append(
            TableRow(utc_s=utc_s, east_mps=drift_mps * math.sin(set_rad), north_mps=drift_mps * math.cos(set_rad))
        )
    return tuple(rows)


def table_lines(text: str) -> tuple[tuple[int, str], ...]:
    """Return the numbered lines of a tide table that are rows: no comments, no headings."""
    lines = [
        (n, line.strip())
        for n, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.strip().startswith("#")
    ]
    if lines and lines[0][1].lower().startswith("time"):
        lines = lines[1:]
    return tuple(lines)

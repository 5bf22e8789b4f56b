"""When to set sail: the same mission rehearsed at each hour of a span, and the chances side by side."""

from __future__ import annotations

import argparse
import datetime as dt
import math
import re
import sys
from argparse import ArgumentTypeError
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from companion.errors import InputError
from companion.program.arguments import moment
from companion.words import counted
from sitl.options import options_of
from sitl.rehearse.estimates import Estimates, lasting, percent
from sitl.rehearse.prepared import PreparedRehearsal
from sitl.rehearse.rehearsal import Follower, Limits
from sitl.rehearse.report import RESULTS
from sitl.rehearse.voyage import RehearsalCase, rehearsal
from sitl.runner import Job

MOST = 100
_HOUR = re.compile(r"([01]?\d|2[0-3]):([0-5]\d)")


@dataclass(frozen=True, slots=True)
class Span:
    """From one departure to the last: times of day (UTC), or times with their date."""

    first: dt.datetime | dt.time
    last: dt.datetime | dt.time

    def hours(self, day: dt.datetime, every_s: float) -> list[dt.datetime]:
        """Return the departures; those of a time of day are of that ``day``, over midnight where need be.

        Raises:
            InputError: it ends before it begins, or there are too many.
        """
        first, last = (
            at if isinstance(at, dt.datetime) else dt.datetime.combine(day.date(), at, dt.UTC)
            for at in (self.first, self.last)
        )
        if last < first and isinstance(self.last, dt.time):
            last += dt.timedelta(days=1)
        count = math.floor((last - first).total_seconds() / every_s + 1e-9) + 1
        if count < 1:
            raise InputError("--depart", "", "ends before it begins", "write the earlier time first")
        if count > MOST:
            raise InputError("--every", "", f"makes {count} departures of it", "say a longer time")
        return [first + dt.timedelta(seconds=every_s * n) for n in range(count)]


def departure(text: str) -> dt.datetime | Span:
    """Take the argument of ``--depart``: a time, or a span of times or of hours of the day.

    >>> departure("06:00..18:00")
    Span(first=datetime.time(6, 0), last=datetime.time(18, 0))
    """
    first, dots, last = text.partition("..")
    if not dots:
        return moment(text)
    found = [_HOUR.fullmatch(end) for end in (first, last)]
    if all(found):
        begins, ends = (dt.time(int(m[1]), int(m[2])) for m in found if m)
        return Span(begins, ends)
    if any(found):
        raise ArgumentTypeError(f"{text[:50]!r} names an hour and a date; write two of a kind")
    return Span(moment(first), moment(last))


def compare(
    args: argparse.Namespace,
    limits: Limits,
    folder: Path,
    make: Callable[[Path, dt.datetime | None], PreparedRehearsal],
) -> int:
    """Rehearse each departure of ``args.depart``, print a line of each as it is known; return the exit code.

    ``make`` reads and plans a departure, or the one that there would be without a span.
    """
    hours = args.depart.hours(make(folder, None).scenario.begins, args.every)
    found: list[tuple[dt.datetime, Estimates]] = []
    code, share = 0, 0.0
    sys.stdout.write(
        f"{'departs (UTC)':<18}{'voyages':>8}  {'arrives':<16}{'below the floor':<17}there within (half, 9 of 10)\n"
    )
    for n, hour in enumerate(hours, start=1):
        place = folder / f"{hour:%Y-%m-%dT%H%M}"
        made = make(place, hour)
        share = n / len(hours)
        follower = Follower(limits, share=share)
        jobs = [Job(scenario=made.source, seed=s, case=RehearsalCase(doubts=made.doubts)) for s in range(limits.runs)]
        code |= rehearsal(jobs).results(options_of(args, out=place / RESULTS), watch=follower).exit_code(is_good=True)
        found.append((hour, follower.known))
        sys.stdout.write(_line(hour, follower.known) + "\n")
        sys.stdout.flush()
    sys.stdout.write("\n".join(advice(found)) + "\n")
    return code


def _line(hour: dt.datetime, known: Estimates) -> str:
    _, half, most = known.times
    times = f"{lasting(half.value)}, {lasting(most.value)}"
    shares = f"{percent(known.arrives):<16}{percent(known.low):<17}"
    return f"{hour:%Y-%m-%d %H:%M}  {len(known.records):>8}  {shares}{times}"


def advice(found: Sequence[tuple[dt.datetime, Estimates]]) -> list[str]:
    """Return in words which departure is the best, and which cannot be told from it.

    The best is the one of which most is sure: the lower end of its chance to arrive, less the upper end of its chance
    to come below the floor; of equals the faster one, and where all are equal there is none. Others whose intervals
    reach to its are as good for all that is known.
    """
    known = [(hour, e) for hour, e in found if e.records]
    if not known:
        return ["no chances yet: more --minutes, and the same command goes on"]

    def worth(row: tuple[dt.datetime, Estimates]) -> tuple[float, float]:
        e = row[1]
        half_s = e.times[1].value
        return round(e.arrives.low - e.low.high, 3), -(round(half_s) if math.isfinite(half_s) else half_s)

    hour, best = max(known, key=worth)
    if best.arrives.came == 0:
        return ["none of these departures arrives"]
    alike = [h for h, e in known if h != hour and e.arrives.high >= best.arrives.low and e.low.low <= best.low.high]
    told = f"for all that {counted(len(best.records), 'voyage')} {'tells' if len(best.records) == 1 else 'tell'}"
    if len(known) > 1 and all(worth(row) == worth((hour, best)) for row in known):
        return [f"none of these departures is better than another, {told}"]
    words = f"best: {hour:%Y-%m-%d %H:%M}"
    if not alike:
        return [words + ", surely"]
    others = ", ".join(f"{h:%Y-%m-%d %H:%M}" for h in alike)
    return [f"{words}; as good {told}: {others}"]

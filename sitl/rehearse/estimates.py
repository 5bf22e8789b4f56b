"""What is known of a mission from the voyages so far: chances with anytime-valid intervals, times, the worst.

A run that ends when its interval is narrow looks at it after every voyage, and an interval for one look (Wilson's)
would then be wrong more often than it says. These hold at all looks together: the share p is inside at every number of
voyages with the stated probability. The likelihood of p is held against its mean over Beta(1/2, 1/2); for the true p
that quotient is a martingale, which exceeds 20 at any time with a chance of 1/20 at most (Ville 1939; Robbins 1970,
Statistical methods related to the law of the iterated logarithm).

Only voyages whose seeds come without a gap from the first on are counted: quick ones are done before slow ones, and
whoever stops at some moment with all that there is has seen too many quick ones. So the answer is the same by however
many workers it was sailed.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from companion.safety import TABLE
from companion.words import counted, time_words

LEVEL = 0.95
_STEPS = 50  # halvings of a share


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """How often something came, and between which shares it is by 95 %."""

    came: int
    of: int
    low: float
    high: float

    @property
    def width(self) -> float:
        """How far the bounds are apart."""
        return self.high - self.low


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantile:
    """The value that a share ``of_all`` of them are at or below; ``inf`` where it is not reached."""

    of_all: float
    value: float
    low: float
    high: float


def _evidence(came: int, of: int, p: float) -> float:
    """Return the logarithm of the quotient against ``p``."""
    missed = of - came
    if (p <= 0.0 and came) or (p >= 1.0 and missed):
        return math.inf
    mean = math.lgamma(came + 0.5) + math.lgamma(missed + 0.5) - math.lgamma(of + 1.0) - math.log(math.pi)
    return mean - (came * math.log(p) if came else 0.0) - (missed * math.log1p(-p) if missed else 0.0)


def share_of(came: int, of: int) -> Share:
    """Return a share with its interval.

    >>> found = share_of(0, 100)
    >>> found.low, round(found.high, 3)
    (0.0, 0.057)
    """
    if of == 0:
        return Share(came=0, of=0, low=0.0, high=1.0)
    most, best = -math.log1p(-LEVEL), came / of

    def bound(outside: float) -> float:
        if _evidence(came, of, outside) < most:
            return outside
        inside = best
        for _ in range(_STEPS):
            middle = 0.5 * (inside + outside)
            if _evidence(came, of, middle) < most:
                inside = middle
            else:
                outside = middle
        return inside

    return Share(came=came, of=of, low=bound(0.0), high=bound(1.0))


def quantile_of(values: Sequence[float], of_all: float) -> Quantile:
    """Return a quantile with its interval, which holds at all looks too: of each value one asks how many are below it.

    ``values`` are in order; what never ends is ``inf``. Without any: nothing is known.
    """
    count, most = len(values), -math.log1p(-LEVEL)
    if not count:
        return Quantile(of_all=of_all, value=math.inf, low=0.0, high=math.inf)
    likely = [below for below in range(count + 1) if _evidence(below, count, of_all) < most]
    low = values[likely[0] - 1] if likely[0] else 0.0
    high = values[likely[-1]] if likely[-1] < count else math.inf
    return Quantile(of_all=of_all, value=values[max(0, math.ceil(of_all * count) - 1)], low=low, high=high)


QUANTILES = (0.1, 0.5, 0.9)
WATCHDOGS = tuple(dog.name for dog in TABLE)
Record = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimates:
    """What is known.

    Attributes:
        records: the voyages, by their seeds.
        arrives, low, touches: the chances of arriving, of coming below the margin's floor, of touching something.
        times: quantiles of the time until the boat arrives [s], of all voyages: who does not arrive takes for ever.
        watchdogs: the chance that each is raised, the most frequent first; those that never were are left out.
    """

    records: tuple[Record, ...]
    arrives: Share
    low: Share
    touches: Share
    times: tuple[Quantile, ...]
    watchdogs: Mapping[str, Share]

    def line(self) -> str:
        """Return it for a line on a terminal."""
        middle = next(time for time in self.times if time.of_all == 0.5)
        return (
            f"of {len(self.records)}: arrives {percent(self.arrives)}, below the floor {percent(self.low)}, "
            f"half by {lasting(middle.value)}"
        )

    def worst(self, most: int) -> list[Record]:
        """Return the worst voyages: errors, contacts, the floor, then those that do not arrive, then the longest."""
        return sorted(self.records, key=_badness, reverse=True)[:most]

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON; a time that is not reached is None."""
        return {
            "voyages": len(self.records),
            "arrives": _share(self.arrives),
            "below_floor": _share(self.low),
            "touches": _share(self.touches),
            "time_s": [
                {"quantile": q.of_all, "value": _finite(q.value), "low": _finite(q.low), "high": _finite(q.high)}
                for q in self.times
            ],
            "watchdogs": {name: _share(share) for name, share in self.watchdogs.items()},
        }


def estimates_of(there: Sequence[Record | None]) -> Estimates:
    """Return what is known from the results of seeds in their order; None: none yet, empty: it was lost."""
    gap = next((n for n, record in enumerate(there) if record is None), len(there))
    records = tuple(record for record in there[:gap] if record)
    count = len(records)

    def share(what: str) -> Share:
        return share_of(sum(bool(record.get(what)) for record in records), count)

    raised = Counter(name for record in records for name in WATCHDOGS if name in record.get("alerts", {}))
    times = sorted(record["time_s"] if record.get("arrived") else math.inf for record in records)
    return Estimates(
        records=records,
        arrives=share("arrived"),
        low=share("below_floor"),
        touches=share("contacts"),
        times=tuple(quantile_of(times, of_all) for of_all in QUANTILES),
        watchdogs={name: share_of(came, count) for name, came in raised.most_common()},
    )


def _badness(record: Record) -> tuple[float, ...]:
    clear_m = record.get("min_clearance_m")
    return (
        bool(record.get("error")),
        bool(record.get("contacts")),
        bool(record.get("below_floor")),
        not record.get("arrived"),
        -(clear_m if clear_m is not None else math.inf) if record.get("below_floor") else 0.0,
        record.get("time_s") or 0.0,
        -record["seed"],
    )


def why_bad(record: Record) -> str:
    """Return in words how a voyage went."""
    clear_m = record.get("min_clearance_m")
    clear = "" if clear_m is None else f", {clear_m:.1f} m clear at the nearest"
    if record.get("error"):
        return f"an error of the program: {record['error']}"
    if record.get("contacts"):
        return "touched something" + ("" if record.get("arrived") else ", did not arrive")
    how = (
        f"arrived after {lasting(record['time_s'])}"
        if record.get("arrived")
        else (f"did not arrive ({record.get('end_reason') or 'time is up'})")
    )
    return how + clear


def percent(share: Share) -> str:
    """Return a share's interval.

    >>> percent(share_of(50, 100))
    '34 to 66 %'
    """
    low, high = 100.0 * share.low, 100.0 * share.high
    return f"{low:.0f} to {high:.0f} %" if high >= 10.0 else f"{low:.1f} to {high:.1f} %"


def lasting(seconds: float) -> str:
    """Return a time in words.

    >>> lasting(75.0), lasting(7300.0), lasting(math.inf)
    ('1 min 15 s', '2 h 2 min', 'never')
    """
    return time_words(seconds) if math.isfinite(seconds) else "never"


def reached(time: Quantile) -> str:
    """Return in words when a share of the voyages is there."""
    share = f"{100.0 * time.of_all:.0f} %"
    return (
        f"{share} are there within {lasting(time.value)}"
        if math.isfinite(time.value)
        else (f"fewer than {share} arrive")
    )


def between(time: Quantile) -> str:
    """Return in words between which times a quantile is by 95 %.

    >>> between(Quantile(of_all=0.1, value=60.0, low=0.0, high=75.0))
    '1 min 15 s at the latest'
    """
    is_bound = math.isfinite(time.high)
    if time.low <= 0.0:
        return f"{lasting(time.high)} at the latest" if is_bound else "any time: too few voyages"
    return f"{lasting(time.low)} to {lasting(time.high)}"


def as_lines(known: Estimates) -> list[str]:
    """Return what is known, a line for each thing."""
    if not known.records:
        return ["no voyage was sailed to its end: nothing is known yet"]
    lines = [f"{counted(len(known.records), 'voyage')}; in brackets what is 95 % sure, at whichever voyage one stops"]
    for words, share in (
        ("arrives", known.arrives),
        ("below the margin's floor", known.low),
        ("touches something", known.touches),
    ):
        lines.append(f"  {words}: {share.came} of {share.of} ({percent(share)})")
    for time in known.times:
        lines.append(f"  {reached(time)} ({between(time)})")
    for name, share in known.watchdogs.items():
        lines.append(f"  {name}: {share.came} of {share.of} ({percent(share)})")
    quiet = len(WATCHDOGS) - len(known.watchdogs)
    lines.append(f"  {counted(quiet, 'other watchdog')} never raised ({percent(share_of(0, len(known.records)))} each)")
    return lines


def _share(share: Share) -> dict[str, Any]:
    return {"came": share.came, "of": share.of, "low": round(share.low, 5), "high": round(share.high, 5)}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None

"""Reliability: what was promised with a probability, and how often it came, over the voyages of a campaign.

Of each leg that a plan sails itself: the chance that the true wind puts its heading into the no-go zone, and, where it
was sailed on the plan's course, whether the wind's angle to the bow was in the central intervals of its spread. A leg
that was begun elsewhere has another course, which no spread of the wind is about: it is counted by itself. Of each
voyage: whether it came below the margin's floor, by how much was not the plan's; its time as a share of what the first
plan promised; and whether it was later than each quantile of that plan's arrival.
"""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

from lab.campaigns.mismatch import QUANTILES, share_interval

EDGES = (0.0, 0.001, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # of what is promised; the last of a bin belongs to it
LEVELS = (0.5, 0.8, 0.9, 0.95)  # of central intervals
SAME_COURSE_DEG = 10.0  # a leg farther off the plan's course was begun elsewhere
KINDS = ((0, 0), (1, 3), (4, 5), (6, 7), (8, 10))  # how much is not the plan's: from, to


@dataclass(frozen=True, slots=True, kw_only=True)
class Bin:
    """What was promised alike.

    Attributes:
        promised: the mean of the promises; of a floor: None, nobody promised a share.
        name: of the bin.
        came, of: how often it came, of how many.
    """

    promised: float | None
    name: str
    came: int
    of: int

    @property
    def share(self) -> float:
        """How often it came."""
        return self.came / self.of

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of it."""
        return share_interval(self.came, self.of)


def no_go_curve(records: Sequence[Mapping[str, Any]]) -> list[Bin]:
    """Return how often legs were in the no-go zone half way, by what was promised; empty bins are left out."""
    legs = _own_legs(records)
    bins = []
    for n, (low, high) in enumerate(itertools.pairwise(EDGES)):
        mine = [leg for leg in legs if (low < leg["promised"] or n == 0) and leg["promised"] <= high]
        if mine:
            bins.append(
                Bin(
                    promised=statistics.fmean(leg["promised"] for leg in mine),
                    name=f"{low:g} to {high:g}",
                    came=sum(leg["came"] for leg in mine),
                    of=len(mine),
                )
            )
    return bins


def where_begun(records: Sequence[Mapping[str, Any]]) -> list[Bin]:
    """Return how often legs were in the no-go zone, by whether they were sailed on the plan's course."""
    legs = _own_legs(records)
    return [
        Bin(
            promised=statistics.fmean(leg["promised"] for leg in mine),
            name=name,
            came=sum(leg["came"] for leg in mine),
            of=len(mine),
        )
        for name, is_same in (("plan's course", True), ("begun elsewhere", False))
        if (mine := [leg for leg in legs if _is_on_course(leg) == is_same])
    ]


def _is_on_course(leg: Mapping[str, Any]) -> bool:
    # of a record from before it was told: nobody knows, and it was counted as if it were
    return abs(float(leg.get("course_off_deg", 0.0))) <= SAME_COURSE_DEG


def coverage(records: Sequence[Mapping[str, Any]]) -> list[Bin]:
    """Return how often the wind's angle to the bow was in the central interval of each level, as of a normal.

    Of legs on the plan's course.
    """
    legs = [leg for leg in _own_legs(records) if _is_on_course(leg)]
    wide = [(level, NormalDist().inv_cdf(0.5 + 0.5 * level)) for level in LEVELS if legs]
    return [
        Bin(
            promised=level,
            name=f"central {100.0 * level:g} %",
            of=len(legs),
            came=sum(abs(leg["off_deg"]) <= z * leg["sigma_deg"] for leg in legs),
        )
        for level, z in wide
    ]


def _own_legs(records: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return [leg for r in records for leg in r.get("legs", ()) if not leg["is_beat"]]


def floor_curve(records: Sequence[Mapping[str, Any]]) -> list[Bin]:
    """Return how often voyages with something to be clear of came below the floor, by the kinds that differ."""
    sailed = [r for r in records if r.get("min_clearance_m") is not None]
    bins = []
    for low, high in KINDS:
        mine = [r for r in sailed if low <= len(r["kinds"]) <= high]
        if mine:
            bins.append(
                Bin(
                    promised=None,
                    name=f"{low}" if low == high else f"{low} to {high}",
                    came=sum(r["below_floor"] for r in mine),
                    of=len(mine),
                )
            )
    return bins


def late_curve(records: Sequence[Mapping[str, Any]]) -> list[Bin]:
    """Return how often arrivals were later than each quantile that the first plan stated; what is never is not late."""
    sailed = [r for r in records if r.get("arrived") and r.get("arrival")]
    return [
        Bin(
            promised=1.0 - p,
            name=f"after {name[1:3]} %",
            of=len(sailed),
            came=sum(r["arrival"][name] is not None and r["time_s"] > r["arrival"][name] for r in sailed),
        )
        for name, p in QUANTILES.items()
        if sailed
    ]


def time_shares(records: Sequence[Mapping[str, Any]]) -> list[float]:
    """Return the times of arrivals as shares of what the first plan promised, in order."""
    return sorted(r["time_s"] / r["promised_s"] for r in records if r.get("arrived") and r.get("promised_s"))


def as_text(records: Sequence[Mapping[str, Any]]) -> str:
    """Return the curves as text."""
    lines = [f"{len(records)} voyages"]
    for title, bins in (
        (
            "in the no-go zone half way along a leg that the plan sails itself, by what was promised",
            no_go_curve(records),
        ),
        ("the same, by where the leg was begun", where_begun(records)),
        ("the wind's angle to her bow there, in the intervals of its spread", coverage(records)),
        ("below the margin's floor, by how many things were not the plan's", floor_curve(records)),
        ("later than the plan's quantiles of arrival", late_curve(records)),
    ):
        lines.append(title)
        for b in bins:
            low, high = b.interval
            mean = "" if b.promised is None else f"promised {100.0 * b.promised:5.1f} %, "
            lines.append(
                f"  {b.name:>14}: {mean}came {100.0 * b.share:5.1f} % ({b.came} of {b.of}; "
                f"{100.0 * low:.1f} to {100.0 * high:.1f})"
            )
    shares = time_shares(records)
    if shares:
        late = sum(share > 1.0 for share in shares)
        low, high = share_interval(late, len(shares))
        lines.append(
            f"later than the expected time: {late} of {len(shares)} arrivals "
            f"({100.0 * low:.0f} to {100.0 * high:.0f} %); a median of {statistics.median(shares):.2f} of it"
        )
    return "\n".join(lines)


def to_dict(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the curves as plain values."""

    def plain(bins: Sequence[Bin]) -> list[dict[str, Any]]:
        return [
            {"name": b.name, "promised": b.promised, "came": b.came, "of": b.of, "interval": list(b.interval)}
            for b in bins
        ]

    return {
        "voyages": len(records),
        "no_go": plain(no_go_curve(records)),
        "where_begun": plain(where_begun(records)),
        "coverage": plain(coverage(records)),
        "floor": plain(floor_curve(records)),
        "late": plain(late_curve(records)),
        "time_shares": time_shares(records),
    }

"""When to go: departures compared, each route sailed in every member, by a boat that is not quite her polar.

A chance is a share of members, and no more than they can show: of 31 members none that fails only says that it fails
less than one time in eleven (``at_most``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.passage.plan import Outcome, Passage, Route, plan
from companion.passage.replay import Sailed, sail

CANDIDATES = 3  # members whose own best routes are tried
# Of the normal distribution, the middles of five parts of equal weight.
_MIDDLES = (-1.2816, -0.5244, 0.0, 0.5244, 1.2816)
_SURE = 0.95


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Departure:
    """A departure: its route, and that sailed in every member by every share of her speeds.

    ``why`` says why there is no route; it is empty where there is one.
    """

    utc_s: float
    route: Route
    runs: tuple[Sailed, ...]
    why: str = ""

    @property
    def members(self) -> int:
        """How many members it was sailed in."""
        return len({run.member for run in self.runs})

    def chance(self, by_utc_s: float = math.inf) -> float:
        """Return the share of runs that arrive, by a time where one is named."""
        if not self.runs:
            return 0.0
        return float(np.mean([run.arrived and self.utc_s + run.time_s <= by_utc_s for run in self.runs]))

    def chance_of_too_much_wind(self) -> float:
        """Return the share of runs that end in more wind than she is to be out in."""
        return float(np.mean([run.is_too_much for run in self.runs])) if self.runs else 0.0

    def chance_of_night(self) -> float:
        """Return the share of those that arrive which arrive by night."""
        there = [run.rows[-1, 5] > 0.5 for run in self.runs if run.arrived]
        return float(np.mean(there)) if there else 0.0

    def mean_s(self) -> float:
        """Return the mean time of those that arrive [s]; inf where none does."""
        return float(np.mean([run.time_s for run in self.runs if run.arrived] or [math.inf]))

    def hours(self, quantile: float) -> float:
        """Return a quantile of the hours under way; inf where so many do not arrive."""
        hours = sorted(run.time_s / 3600.0 if run.arrived else math.inf for run in self.runs)
        return hours[min(len(hours) - 1, int(quantile * len(hours)))] if hours else math.inf


def sweep(passage: Passage, departures: Sequence[float], speed_error: float, *, nodes: int) -> tuple[Departure, ...]:
    """Return what each departure [Unix s] comes to; ``speed_error`` is the deviation of the logarithm of her speeds.

    Of the best routes of up to three members the one counts that is first there in the mean of all that arrive, of
    those that arrive most often.
    """
    shares = tuple(math.exp(speed_error * z) for z in _MIDDLES) if speed_error > 0.0 else (1.0,)
    members = passage.weather.members
    chosen = [
        members[i] for i in np.unique(np.linspace(0, len(members) - 1, min(CANDIDATES, len(members))).astype(int))
    ]
    return tuple(_departure(passage, t, members, chosen, shares, nodes) for t in departures)


def _departure(
    passage: Passage, utc_s: float, members: Sequence[int], chosen: Sequence[int], shares: Sequence[float], nodes: int
) -> Departure:
    routes = [plan(passage, utc_s, member, nodes=nodes) for member in chosen]
    found = [route for route in routes if route.outcome is Outcome.FOUND]
    if not found:
        return Departure(utc_s=utc_s, route=routes[0], runs=(), why=routes[0].outcome.value)
    tried = [
        Departure(
            utc_s=utc_s,
            route=route,
            runs=tuple(sail(passage.weather, passage.craft, route.waypoints, utc_s, passage.radius_m, members, shares)),
        )
        for route in found
    ]
    return min(
        tried, key=lambda d: (-d.chance(), float(np.mean([r.time_s for r in d.runs if r.arrived] or [math.inf])))
    )


def at_most(share: float, members: int) -> float:
    """Return what a chance is at most, for 95 %, when a share of so many members shows it (Clopper and Pearson).

    >>> [round(at_most(0.0, n), 3) for n in (1, 31, 51)]
    [0.95, 0.092, 0.057]
    """
    seen = round(share * members)
    if seen >= members:
        return 1.0
    low, high = share, 1.0
    for _ in range(60):
        p = 0.5 * (low + high)
        below = sum(math.comb(members, k) * p**k * (1.0 - p) ** (members - k) for k in range(seen + 1))
        low, high = (p, high) if below > 1.0 - _SURE else (low, p)
    return high


def best(departures: Sequence[Departure], by_utc_s: float = math.inf) -> Departure | None:
    """Return the departure that most surely arrives (by a time), of equals the one that is least long under way."""
    able = [d for d in departures if d.runs and d.chance(by_utc_s) > 0.0]
    return min(able, key=lambda d: (-d.chance(by_utc_s), d.hours(0.5))) if able else None

"""Departures, and the route of each: sailed in every member of the forecast, by a boat that is not quite her polar.

A route is chosen for all members, under a chance: of those that arrive often enough the one that is there first in the
mean. A chance is a share of members, and no more than they can show: of 31 members none that fails only says that it
fails less than one time in eleven (``at_most``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from companion.messages import GeoPoint
from companion.passage.plan import Outcome, Passage, Route, plan
from companion.passage.replay import Sailed

CANDIDATES = 3  # members whose own best routes are tried, beside that of their mean
SURE = 0.9  # the share of runs that must arrive, where nobody says
# Of the normal distribution, the middles of five parts of equal weight.
_MIDDLES = (-1.2816, -0.5244, 0.0, 0.5244, 1.2816)
CONFIDENCE = 0.95  # of what members show
SEARCH_ERROR = 0.01  # a share of the time that ways may differ by which are as fast (tests/passage/test_oracles.py)


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

    def chance_of_too_much(self) -> float:
        """Return the share of runs that end in more wind or sea, or nearer to a lee shore, than she is to be out in."""
        return float(np.mean([run.is_too_much for run in self.runs])) if self.runs else 0.0

    def chance_of_night(self) -> float:
        """Return the share of those that arrive which arrive by night."""
        there = [run.rows[-1, 5] > 0.5 for run in self.runs if run.arrived]
        return float(np.mean(there)) if there else 0.0

    def middle(self) -> Sailed:
        """Return the run, by her own polar, that half of them are no longer than; of none that arrives the farthest."""
        share = min({run.share for run in self.runs}, key=lambda share: abs(share - 1.0))
        plain = [run for run in self.runs if run.share == share]
        there = sorted((run for run in plain if run.arrived), key=lambda run: run.time_s)
        return there[len(there) // 2] if there else max(plain, key=lambda run: run.way_m)

    def mean_s(self) -> float:
        """Return the mean time of those that arrive [s]; inf where none does."""
        return float(np.mean([run.time_s for run in self.runs if run.arrived] or [math.inf]))

    def hours(self, quantile: float) -> float:
        """Return a quantile of the hours under way; inf where so many do not arrive.

        It is one of the runs: members beyond which nothing was seen say no quantile nearer to 0 or 1 (``shown``).
        """
        hours = sorted(run.time_s / 3600.0 if run.arrived else math.inf for run in self.runs)
        return hours[min(len(hours) - 1, int(quantile * len(hours)))] if hours else math.inf


def sweep(
    passage: Passage,
    departures: Sequence[float],
    speed_error: float,
    *,
    nodes: int,
    by_utc_s: float = math.inf,
    sure: float = SURE,
    candidates: int = CANDIDATES,
) -> tuple[Departure, ...]:
    """Return what each departure [Unix s] comes to; ``speed_error`` is the deviation of the logarithm of her speeds.

    Tried are the best routes of so many members, from the slowest to the fastest, and of their mean. Of those by which
    ``sure`` of all runs arrive (by a time) the one counts that is first there in the mean; where none is so sure, the
    surest.
    """
    shares = shares_of(speed_error)
    return tuple(_departure(passage, t, shares, nodes, by_utc_s, sure, candidates) for t in departures)


def shares_of(speed_error: float) -> tuple[float, ...]:
    """Return shares of her polar of equal weight, ``speed_error`` the deviation of their logarithm."""
    return tuple(math.exp(speed_error * z) for z in _MIDDLES) if speed_error > 0.0 else (1.0,)


def departure_of(
    passage: Passage, waypoints: Sequence[GeoPoint], utc_s: float, shares: Sequence[float], bound_s: float = 0.0
) -> Departure:
    """Return what a route comes to in every member of a passage's weather."""
    runs = tuple(passage.sail(waypoints, utc_s, passage.weather.members, shares))
    found = Departure(utc_s=utc_s, route=Route(outcome=Outcome.FOUND, depart_utc_s=utc_s), runs=runs)
    route = replace(found.route, waypoints=tuple(waypoints), sailed=found.middle(), bound_s=bound_s)
    return replace(found, route=route)


def _departure(
    passage: Passage, utc_s: float, shares: Sequence[float], nodes: int, by_utc_s: float, sure: float, candidates: int
) -> Departure:
    members = passage.weather.members
    routes: list[Route] = []
    chosen = list(members)
    if len(members) > 1:
        mean = replace(passage, weather=passage.weather.mean())
        routes.append(plan(mean, utc_s, nodes=nodes))
        chosen = _spread(passage, utc_s, routes[0], candidates)
    routes += [plan(passage, utc_s, member, nodes=nodes) for member in chosen]
    chosen_one: tuple[tuple[float, float], Route] | None = None
    for route in routes:
        if not route.waypoints:
            continue
        tried = departure_of(passage, route.waypoints, utc_s, shares)
        rank = -min(sure, tried.chance(by_utc_s)), tried.mean_s()
        if tried.chance() > 0.0 and (chosen_one is None or rank < chosen_one[0]):
            chosen_one = rank, route
        del tried  # the runs of weeks are large, and two of them are not kept
    if chosen_one is None:
        last = next((route for route in routes if route.outcome is not Outcome.FOUND), routes[-1])
        why = last.outcome.value if last.sailed is None else last.sailed.why
        return Departure(utc_s=utc_s, route=last, runs=(), why=why)
    route = chosen_one[1]
    found = departure_of(passage, route.waypoints, utc_s, shares, route.bound_s)
    return replace(found, route=replace(found.route, searched=route.searched))


def _spread(passage: Passage, utc_s: float, first: Route, count: int) -> list[int]:
    """Return so many members, from the one in which a first route is the fastest to the one where it is the slowest."""
    members = passage.weather.members
    points = first.waypoints or (passage.start, passage.goal)
    runs = passage.sail(points, utc_s, members)
    gone = sorted(runs, key=lambda run: (not run.arrived, run.time_s if run.arrived else -run.way_m))
    return [gone[i].member for i in np.unique(np.linspace(0, len(gone) - 1, min(count, len(gone))).astype(int))]


def shown(members: int) -> tuple[float, float]:
    """Return a tenth and nine tenths, or the quantiles that so many members show where they show less.

    What comes next is beyond the least and the greatest of n as often as twice in n + 1 times.

    >>> shown(9), shown(4)
    ((0.1, 0.9), (0.2, 0.8))
    """
    return max(0.1, 1.0 / (members + 1)), min(0.9, members / (members + 1))


def at_least(share: float, members: int) -> float:
    """Return what a chance is at least, for 95 %, when a share of so many members shows it (Clopper and Pearson).

    >>> [round(at_least(1.0, n), 3) for n in (1, 31, 51)]
    [0.05, 0.908, 0.943]
    """
    return 1.0 - at_most(1.0 - math.floor(share * members + 1e-9) / members, members)


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
        low, high = (p, high) if below > 1.0 - CONFIDENCE else (low, p)
    return high


def best(departures: Sequence[Departure], by_utc_s: float = math.inf) -> Departure | None:
    """Return the departure that most surely arrives (by a time), of equals the one that is least long under way."""
    able = [d for d in departures if d.runs and d.chance(by_utc_s) > 0.0]
    return min(able, key=lambda d: (-d.chance(by_utc_s), d.hours(0.5))) if able else None

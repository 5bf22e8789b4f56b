"""A route in words: when she is there, what she meets, what bounds it, where it turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from companion.geo import M_PER_NM
from companion.passage.again import Again
from companion.passage.frame import GEOD
from companion.passage.mission import arrivals_s
from companion.passage.plan import Route
from companion.passage.replay import Sailed
from companion.passage.sweep import CONFIDENCE, SEARCH_ERROR, Departure, at_least, at_most, best, shown
from companion.weather import iso
from companion.words import counted

_HOURS = {"night": "by night", "beating": "beating", "waiting": "waiting"}


def told_of(route: Route, of: Departure | None = None) -> tuple[str, ...]:
    """Return lines about a route that was found; of one that was not, why. ``of`` is what all members make of it."""
    sailed = route.sailed
    if sailed is None:
        return (f"no way: {route.outcome.value}",)
    if not sailed.arrived:
        return (f"not there: after {_span(sailed.time_s)}, {_way_left(route)} from the goal: {sailed.why}",)
    arrives = route.depart_utc_s + sailed.time_s
    minutes = round(arrives / 60.0) - round(route.depart_utc_s / 60.0)  # of the hours as they are told
    made = sailed.length_m / max(1.0, sailed.time_s)
    wind = sailed.rows[:, 3]
    way = f"{sailed.length_m / M_PER_NM:.0f} NM at {made:.2f} m/s"
    hours = [f"{sailed.hours(word):.0f} h {said}" for word, said in _HOURS.items()]
    short_m = _length_m(route) - sailed.length_m  # she is there at the edge of the goal, the legs end in its middle
    if short_m >= 0.05 * M_PER_NM:
        way += f" to within {short_m / M_PER_NM:.1f} NM of the goal"
    lines = [
        f"departs {iso(route.depart_utc_s)}, arrives {iso(arrives)}, {_span(60.0 * minutes)} later: {way}",
        _bound(route, sailed.time_s)
        if of is None or of.members == 1
        else f"so in member {sailed.member}, of {of.members} the middle one",
        f"wind {wind.min():.1f} to {wind.max():.1f} m/s, mean {wind.mean():.1f}; {', '.join(hours)}",
    ]
    runs = (sailed,) if of is None or not of.runs else of.runs
    often = "" if len(runs) == 1 else " as often as not"
    for k, [there_s] in enumerate(arrivals_s(runs, route.waypoints, (0.5,))):
        if k:
            by = f" by {iso(route.depart_utc_s + there_s)}{often}" if math.isfinite(there_s) else ""
            lines.append(_leg(route, k) + by)
    return tuple(lines)


def _bound(route: Route, time_s: float) -> str:
    bound_s = min(route.bound_s, time_s)
    gained = 100.0 * (1.0 - bound_s / max(1.0, time_s))
    return f"no way is faster than about {_span(bound_s)} in this forecast: at most {gained:.1f} % could be gained"


def told_of_chances(d: Departure, by_utc_s: float | None, sure: float) -> tuple[str, ...]:
    """Return lines about what all members make of a route, and whether it is as sure as was asked for."""
    if not d.runs:
        return ()
    by = math.inf if by_utc_s is None else by_utc_s
    chance, until = d.chance(by), "" if by_utc_s is None else f" by {iso(by_utc_s)}"
    least, most = at_least(chance, d.members), at_least(1.0, d.members)
    of = f"{counted(len(d.runs), 'run')} in {counted(d.members, 'member')}"
    low, high = shown(d.members)
    often, *ends = (_number(d.hours(q)) for q in (0.5, low, high))
    is_one, arrives = d.members == 1, f"arrives{until} in {100.0 * chance:.0f} % of"
    if is_one:
        runs = counted(len(d.runs), "run")
        lines = [f"{arrives} {runs} in the one forecast there is, which says nothing of how sure that is"]
    else:
        lines = [f"{arrives} {of}: in at least {100.0 * least:.0f} %, with 95 % confidence"]
    lines.append(
        f"hours: {often} as often as not" + ("" if is_one else f", {ends[0]} to {ends[1]} in {_share(low, high)}")
    )
    for run, words in _failures(d):
        lines.append(f"in {words} of all runs: {run.why}")
    if chance < sure:
        lines.append(f"not as sure as {100.0 * sure:g} %: no route that was tried is")
    elif most < sure and not is_one:
        enough = math.ceil(math.log(1.0 - CONFIDENCE) / math.log(sure)) if sure < 1.0 else 0  # none shows certainty
        lines.append(
            f"[depart] sure asks for {100.0 * sure:g} %: {counted(d.members, 'member')} that all arrive would show no "
            f"more than {100.0 * most:.0f} %, " + (f"{enough} members would do" if enough else "and nothing shows that")
        )
    return tuple(lines)


def told_of_again(found: Again, by_utc_s: float | None, sure: float) -> tuple[str, ...]:
    """Return lines about an old route and a new one, and which of them to sail."""
    lines: list[str] = []
    for name, d in (("old", found.old), ("new", found.new)):
        lines += [f"{name}: {line}" for line in told_of_chances(d, by_utc_s, sure)] or [f"{name}: no way: {d.why}"]
    lines.append(f"{'change' if found.is_changed else 'keep the old one'}: {found.why}")
    if found.chosen.runs:
        lines.append(f"the {'new' if found.is_changed else 'old'} one from here:")
    return tuple(lines)


def _failures(d: Departure) -> list[tuple[Sailed, str]]:
    """Return why runs do not arrive, one of each reason, with its share."""
    kinds = {"too much": [r for r in d.runs if r.is_too_much]}
    kinds["other"] = [r for r in d.runs if not r.arrived and not r.is_too_much]
    return [(runs[0], f"{100.0 * len(runs) / len(d.runs):.0f} %") for runs in kinds.values() if runs]


def _share(low: float, high: float) -> str:
    """Return what lies between two quantiles.

    >>> _share(0.1, 0.9), _share(0.2, 0.8)
    ('8 of 10', '6 of 10')
    """
    return f"{10.0 * (high - low):.0f} of 10"


def told_of_departures(departures: Sequence[Departure], by_utc_s: float | None) -> tuple[str, ...]:
    """Return a table of departures, a line each, and what the figures in it are."""
    by = math.inf if by_utc_s is None else by_utc_s
    count = max((d.members for d in departures), default=0)
    least, most = shown(max(1, count))
    head = f"hours (middle {_share(least, most)})" if count > 1 else "hours"
    lines = [f"{'depart':<22}{head:<26} arrives  too much  by night"]
    for d in departures:
        if not d.runs:
            lines.append(f"{iso(d.utc_s)}   no way: {d.why}")
            continue
        low, middle, high = (_number(d.hours(q)) for q in (least, 0.5, most))
        chances = (d.chance(by), d.chance_of_too_much(), d.chance_of_night())
        said = f"{iso(d.utc_s)}   {middle:>6}" + (f" ({low} to {high})" if count > 1 else "")
        lines.append(said.ljust(47) + "".join(f"{100.0 * p:8.0f} %" for p in chances))
    if count:
        unseen = f"{100.0 * at_most(0.0, count):.0f} %"
        lines.append(
            f"of {counted(count, 'member')} of the forecast: what none of them shows may still come in {unseen}"
        )
    return tuple(lines)


def explained(departures: Sequence[Departure], by_utc_s: float | None) -> tuple[str, ...]:
    """Return in words which departure is the best, what waiting costs, and what stands against the others."""
    by = math.inf if by_utc_s is None else by_utc_s
    first = best(departures, by)
    if first is None:
        return ("none of these departures arrives" + ("" if by_utc_s is None else f" by {iso(by_utc_s)}"),)
    often = first.hours(0.5)
    others = [d for d in departures if d is not first and d.runs]
    said = f"{often:.1f} h as often as not" if math.isfinite(often) else f"{100.0 * first.chance(by):.0f} % of all"
    if others and all(_is_as_good(d, first, by) for d in others):
        ways = "these departures" if len(others) + 1 == len(departures) else "those that have a way"
        against = _against(first, by)
        alike = f"none of {ways} is surer or faster than another: each is there in {said}"
        return (alike + (f", {against}" if against else ""),)
    lines = [f"best, of the surest the least long under way: {iso(first.utc_s)}, there in {said}"]
    for d in others:
        later = (d.utc_s - first.utc_s) / 3600.0
        there = later + d.hours(0.5) - first.hours(0.5)
        said = f"{abs(later):.3g} h {'later' if later > 0.0 else 'earlier'}"
        comes = (
            f"there {abs(there):.1f} h {'later' if there > 0.0 else 'earlier'}" if math.isfinite(there) else "not there"
        )
        longer = (
            "as good"
            if _is_as_good(d, first, by)
            else f"{max(0.0, d.hours(0.5) - often):.1f} h longer under way"  # there earlier, and not the best
        )
        lines.append(f"{said}: {comes}, {_against(d, by) or longer}")
    return tuple(lines)


def _is_as_good(d: Departure, first: Departure, by: float) -> bool:
    """Return whether a departure arrives as surely as the best one, and as fast for all that the search tells."""
    often, best_h = d.hours(0.5), first.hours(0.5)
    return d.chance(by) >= first.chance(by) and (often == best_h or often <= best_h * (1.0 + SEARCH_ERROR))


def _against(d: Departure, by: float) -> str:
    """Return what keeps a departure from arriving most often; empty: nothing does."""
    failed = [run for run in d.runs if not run.arrived]
    if failed:
        worst = max(failed, key=lambda run: (run.is_too_much, run.strongest_mps))
        return f"in {100.0 * len(failed) / len(d.runs):.0f} % {worst.why}"
    late = 1.0 - d.chance(by)
    return f"too late in {100.0 * late:.0f} %" if late > 0.0 else ""


def _number(hours: float) -> str:
    return f"{hours:.1f}" if math.isfinite(hours) else "never"


def _leg(route: Route, k: int) -> str:
    a, b = route.waypoints[k - 1], route.waypoints[k]
    azimuth, _, length = GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
    return f"  {k}: {b.lat_deg:.4f}, {b.lon_deg:.4f}  {length / M_PER_NM:.1f} NM on {azimuth % 360.0:03.0f}"


def _length_m(route: Route) -> float:
    """Return how long the legs are [m]."""
    places = pairwise(route.waypoints)
    return sum(float(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2]) for a, b in places)


def _way_left(route: Route) -> str:
    assert route.sailed is not None
    left = route.sailed.length_m - (route.sailed.rows[-1, 1] if len(route.sailed.rows) else 0.0)
    return f"{left / M_PER_NM:.0f} NM"


def _span(seconds: float) -> str:
    """Return how long something takes; a colon would make it an hour of the day.

    >>> _span(105_600.0), _span(15_360.0), _span(300.0)
    ('1 d 5 h 20 min', '4 h 16 min', '5 min')
    """
    minutes = round(seconds / 60.0) if math.isfinite(seconds) else 0
    days, hours = divmod(minutes // 60, 24)
    return (f"{days} d " if days else "") + (f"{hours} h " if minutes >= 60 else "") + f"{minutes % 60} min"

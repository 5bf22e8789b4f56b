"""What comes of tacks that fail: how often in a row one may before a contact, and what that adds to a path's risk.

At each failure it is carried on along the old course, and tries again. After ``TRIES`` of them it gybes round where
there is room (``companion.boat.failed_tack``): so the skipper does. A tack that cannot fail so often, or is to be tried
on for want of that room, is a risk: the chance of one failure to the power of how many it takes to touch. Tacks add up
by the union bound. A beat that is left to the autopilot has its tacks anywhere along the edges of its corridor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.boat.failed_tack import AGAIN_SHARE, MOST_FAILURES, RISKY, TRIES, failed_tack, gybing_centre, lee_set
from companion.boat.tracking import stated_error_m
from companion.geo.angles import wrap_pi
from companion.planner.plan import Leg
from companion.planner.problem.evaluate import beat_s, shore_of
from companion.planner.problem.value import Problem

EDGE_STEP_M = 10.0  # between the places of a corridor's edge at which a tack is looked at
Place = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TackAtRisk:
    """A planned tack near something solid.

    Attributes:
        leg: that it leads into; of a beat that is left to the autopilot the leg itself.
        at_en: where.
        failures: in a row until it touches.
        risk: the probability of it.
        lack_m: the room that is missing for so many.

    """

    leg: int
    at_en: Place
    failures: int
    risk: float
    lack_m: float

    @property
    def is_risky(self) -> bool:
        """Whether it is to be avoided."""
        return self.failures == 1 or self.risk > RISKY


def tacks_at_risk(problem: Problem, legs: Sequence[Leg]) -> tuple[TackAtRisk, ...]:
    """Return the tacks of a path whose failures would bring the boat onto something, the riskiest of each leg."""
    if problem.boat.tack_fails <= 0.0 or not problem.boat.can_tack or not legs:
        return ()
    return _at_risk(problem, tuple(replace(leg, risk=0.0, clearance_m=0.0) for leg in legs))


@lru_cache(maxsize=16)  # by identity and value: the search asks of its best path, and who writes the plan again
def _at_risk(problem: Problem, legs: tuple[Leg, ...]) -> tuple[TackAtRisk, ...]:
    chance = problem.boat.tack_fails
    solids = _Solids(problem)
    found = []
    for n, leg in enumerate(legs):
        if leg.manoeuvre == "tack" and not leg.is_beat:
            before = legs[n - 1] if n else None
            course = before.heading_rad if before is not None else problem.start_heading_rad
            speed = before.speed_mps if before is not None else leg.speed_mps
            tack = solids.tack(problem, n, leg.from_en, course, speed, chance)
            if tack is not None:
                found.append(tack)
        if leg.is_beat:
            tack = _beaten(problem, solids, n, leg, chance)
            if tack is not None:
                found.append(tack)
    return tuple(found)


def of_risky(tacks: Sequence[TackAtRisk]) -> float:
    """Return what a path's risky tacks add to its risk."""
    return round(sum(tack.risk for tack in tacks if tack.is_risky), 6)


def tack_risks(legs: Sequence[Leg], tacks: Sequence[TackAtRisk]) -> tuple[float, ...]:
    """Return what tacks that fail add to the risk of each leg."""
    out = [0.0] * len(legs)
    for tack in tacks:
        out[tack.leg] += tack.risk
    return tuple(out)


def _beaten(problem: Problem, solids: _Solids, n: int, leg: Leg, chance: float) -> TackAtRisk | None:
    """Return the worst of a beaten leg's tacks, with the risk of all of them: each is as likely anywhere."""
    beat = problem.beat
    if beat is None:
        return None
    dx, dy = leg.to_en[0] - leg.from_en[0], leg.to_en[1] - leg.from_en[1]
    _, tacks = beat_s(problem, beat, dx, dy)
    ux, uy = dx / leg.length_m, dy / leg.length_m
    line = shapely.LineString([leg.from_en, leg.to_en])
    speed = problem.boat.speed_mps(beat.no_go_half_rad)
    reach_m = beat.corridor_m + solids.far_m(speed, problem.wind.tws_mps or 0.0)
    if solids.distance_m(line) > reach_m:
        return None  # the whole beat is far from everything
    steps = max(1, math.ceil(leg.length_m / EDGE_STEP_M))
    sides, places = [], []
    for k in range(steps):
        along = (k + 0.5) / steps * leg.length_m
        for side in (-1.0, 1.0):
            sides.append(side)
            places.append(
                (
                    leg.from_en[0] + along * ux + side * beat.corridor_m * uy,
                    leg.from_en[1] + along * uy - side * beat.corridor_m * ux,
                )
            )
    worst: TackAtRisk | None = None
    risk = 0.0
    for side, at, distance_m in zip(sides, places, solids.distances_m(shapely.points(places)), strict=True):
        # to the right of the line the boat comes on port tack, whose course is to the right of the wind
        course = problem.wind.twd_from_rad + side * beat.no_go_half_rad
        tack = solids.tack(problem, n, at, course, speed, chance, distance_m)
        if tack is not None:
            risk += tack.risk / (2.0 * steps)
            worst = (
                tack
                if worst is None
                or tack.failures < worst.failures
                or (tack.failures == worst.failures and tack.lack_m > worst.lack_m)
                else worst
            )
    if worst is None:
        return None
    return TackAtRisk(
        leg=n, at_en=worst.at_en, failures=worst.failures, risk=min(1.0, tacks * risk), lack_m=worst.lack_m
    )


class _Solids:
    """What is solid, as it is where the problem says so, and what the hull and the track's error need beside it."""

    def __init__(self, problem: Problem) -> None:
        tracking = problem.tracking
        self.need_m = 0.0
        if tracking is not None:
            best = max(problem.boat.polar_mps)
            self.need_m = tracking.reach_m + stated_error_m(best, tracking.helm, has_short=not tracking.is_known)
        self.irons_s, self.most_lee_mps = problem.boat.irons_s, max(problem.boat.lee_mps)
        self._tree = tracking.tree if tracking is not None else shore_of(problem).tree
        self._far_m: dict[tuple[float, float], float] = {}

    def distance_m(self, shape: shapely.Geometry) -> float:
        """Return how far something is from everything solid, inf where nothing is."""
        return self.distances_m(np.array([shape]))[0]

    def distances_m(self, shapes: NDArray[np.object_]) -> list[float]:
        """Return how far each of some things is: asked for together, a query takes a fraction of its time."""
        if not len(self._tree.geometries):
            return [math.inf] * len(shapes)
        (which, _), distance = self._tree.query_nearest(shapes, return_distance=True, all_matches=False)
        out = [math.inf] * len(shapes)
        for i, value in zip(which.tolist(), distance.tolist(), strict=True):
            out[i] = value
        return out

    def far_m(self, speed_mps: float, tws_mps: float) -> float:
        """Return how far from a corner the failures of a tack can lead, and need room."""
        if (speed_mps, tws_mps) not in self._far_m:
            first = np.concatenate(
                failed_tack(
                    (0.0, 0.0),
                    course_rad=0.0,
                    speed_mps=speed_mps,
                    twd_from_rad=0.0,
                    tws_mps=tws_mps,
                    irons_s=self.irons_s,
                )
            )
            lee_m = self.irons_s * self.most_lee_mps
            self._far_m[speed_mps, tws_mps] = MOST_FAILURES * (float(np.max(np.hypot(*first.T))) + lee_m) + self.need_m
        return self._far_m[speed_mps, tws_mps]

    def tack(
        self,
        problem: Problem,
        leg: int,
        at: Place,
        course_rad: float,
        speed_mps: float,
        chance: float,
        distance_m: float | None = None,
    ) -> TackAtRisk | None:
        """Return what a tack there comes to when it fails, None: it has room for what it does then.

        ``distance_m`` of the place from everything solid; None: it is asked for.
        """
        tws = problem.wind.tws_mps or 0.0
        distance_m = self.distance_m(shapely.Point(at)) if distance_m is None else distance_m
        if distance_m > self.far_m(speed_mps, tws):
            return None
        speed, place = speed_mps, at
        (east, north), (east_too, north_too) = problem.current.en_mps, problem.adrift.en_mps
        carried, twd = (east + east_too, north + north_too), problem.wind.twd_from_rad
        starboard_mps, port_mps = problem.boat.lee_mps
        lee_mps = starboard_mps if wrap_pi(twd - course_rad) > 0.0 else port_mps
        lee = lee_set(course_rad=course_rad, twd_from_rad=twd, lee_mps=lee_mps)
        waters = [carried] if lee_mps == 0.0 else [carried, (carried[0] + lee[0], carried[1] + lee[1])]
        for failures in range(1, MOST_FAILURES + 1):
            tracks = [
                track
                for water in waters
                for track in failed_tack(
                    place,
                    course_rad=course_rad,
                    speed_mps=speed,
                    twd_from_rad=twd,
                    tws_mps=tws,
                    current_en_mps=water,
                    irons_s=problem.boat.irons_s,
                )
            ]
            room = min(self.distances_m(shapely.linestrings(np.array(tracks)))) - self.need_m
            if room <= 0.0:
                lack = max(-room, self._lack_m(at, np.concatenate(tracks)))
                return TackAtRisk(leg=leg, at_en=at, failures=failures, risk=chance**failures, lack_m=lack)
            speed, place = AGAIN_SHARE * speed_mps, _point(tracks)
            if failures == TRIES and self._may_gybe(problem, place, course_rad, speed_mps):
                return None
        return None

    def _lack_m(self, at: Place, track: NDArray[np.float64]) -> float:
        """Return how much farther from what is nearest a corner must be for the track to clear that, were it a wall."""
        corner = shapely.Point(at)
        near = self._tree.geometries[int(self._tree.nearest(corner))]
        wall = np.asarray(shapely.shortest_line(corner, near).coords[1]) - np.asarray(at)
        gap = float(np.hypot(*wall))
        if gap < 1e-6:
            return self.need_m
        return self.need_m + float(np.max((track - np.asarray(at)) @ wall)) / gap - gap

    def _may_gybe(self, problem: Problem, place: Place, course_rad: float, speed_mps: float) -> bool:
        """Return whether there is room to gybe round to leeward of a place."""
        radius = speed_mps / problem.boat.turn_rate_radps
        centre = gybing_centre(place, course_rad=course_rad, twd_from_rad=problem.wind.twd_from_rad, radius_m=radius)
        return self.distance_m(shapely.Point(centre)) - radius >= self.need_m


def _point(tracks: Sequence[NDArray[np.float64]]) -> Place:
    """Return where the boat tries again: the farthest on."""
    return float(tracks[-1][-1][0]), float(tracks[-1][-1][1])


def in_words(problem: Problem, tacks: Sequence[TackAtRisk]) -> Iterator[str]:
    """Yield a sentence for each tack that may bring the boat onto something."""
    for tack in tacks:
        where = f"{tack.at_en[0]:.0f} E, {tack.at_en[1]:.0f} N"
        often = "once" if tack.failures == 1 else f"{tack.failures} times in a row"
        yield (
            f"A tack that fails {often} at {where} would bring her onto something: {100.0 * tack.risk:.2g} % "
            f"at {100.0 * problem.boat.tack_fails:.2g} % for one."
        )

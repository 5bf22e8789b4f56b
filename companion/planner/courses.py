"""Courses: what a sailor calls one leg where a plan has many, bending with a no-go zone that grows under way."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from companion.geo.angles import difference_rad
from companion.planner.plan import Leg

# A smaller bend than this between two legs, without tack or gybe, is the same course to the helmsman.
BEND_RAD = math.radians(4.0)
# A leg shorter than this is a corner, not a course [m].
CORNER_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """Consecutive legs of a plan on one tack; ``first`` counts from 0."""

    first: int
    legs: tuple[Leg, ...]

    @property
    def length_m(self) -> float:
        """What all its legs are long [m]."""
        return sum(leg.length_m for leg in self.legs)

    @property
    def numbers(self) -> range:
        """The places of its legs in the plan, from 0."""
        return range(self.first, self.first + len(self.legs))

    @property
    def headings_rad(self) -> tuple[float, float]:
        """The headings at its ends [rad], its corners left out."""
        sailed = self._sailed()
        return sailed[0].heading_rad, sailed[-1].heading_rad

    def span(self, value: Callable[[Leg], float]) -> tuple[float, float]:
        """Return the least and the greatest of a figure of its legs, its corners left out."""
        values = [value(leg) for leg in self._sailed()]
        return min(values), max(values)

    def _sailed(self) -> Sequence[Leg]:
        return [leg for leg in self.legs if leg.length_m >= CORNER_M] or self.legs


def courses(legs: Sequence[Leg]) -> tuple[Board, ...]:
    """Return the legs merged into courses, in order; every leg is in one of them."""
    out: list[Board] = []
    for number, leg in enumerate(legs):
        if out and _goes_on(out[-1], leg):
            out[-1] = Board(first=out[-1].first, legs=(*out[-1].legs, leg))
        else:
            out.append(Board(first=number, legs=(leg,)))
    return tuple(out)


def _goes_on(course: Board, leg: Leg) -> bool:
    """Return whether a leg belongs to the course before it: no turn that the crew would notice lies between."""
    if leg.manoeuvre:
        return False
    before = course.legs[-1]
    if leg.twa_rad * before.twa_rad <= 0.0 or leg.is_beat != before.is_beat:
        return False
    sailed = next((item for item in reversed(course.legs) if item.length_m >= CORNER_M), None)
    if leg.length_m < CORNER_M or sailed is None:  # a corner belongs to the course that it ends or begins
        return True
    return abs(difference_rad(leg.heading_rad, sailed.heading_rad)) <= BEND_RAD

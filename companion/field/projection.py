"""Out of the no-go zone: what a field asks for, turned to what a sailboat can do.

A vector inside the no-go zone is turned to one of its two edges. Which one is the state q of Jaulin and Le Bars:
+1 is the edge clockwise of the wind (the wind then comes over the port bow), -1 the other. q is fixed by the side
of the trajectory that the boat is on outside a zone of 50 m about it, and kept inside: it beats up the line in
long boards instead of shivering on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.field.vector_fields import ZONE_M, Field, Vectors
from companion.geo.angles import wrap_pi

NO_GO_HALF_RAD = math.pi / 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HysteresisZone:
    """The hysteresis zone: a band about the line through ``at_en`` along ``course_rad``.

    For a line that is followed this is the line. For an attractive point it is the line of the wind through the
    point (Schmitt 4.1.2): ``HysteresisZone.of_point``.
    """

    at_en: tuple[float, float]
    course_rad: float
    half_m: float = ZONE_M

    @classmethod
    def of_point(cls, at_en: tuple[float, float], twd_from_rad: float, half_m: float = ZONE_M) -> HysteresisZone:
        """Return the zone about the line of the wind through a point."""
        return cls(at_en=at_en, course_rad=twd_from_rad, half_m=half_m)

    @classmethod
    def of_line(cls, a_en: tuple[float, float], b_en: tuple[float, float], half_m: float = ZONE_M) -> HysteresisZone:
        """Return the zone about the line from a to b."""
        return cls(at_en=a_en, course_rad=math.atan2(b_en[0] - a_en[0], b_en[1] - a_en[1]), half_m=half_m)

    def offset_m(self, points_en: Vectors) -> NDArray[np.float64]:
        """Return how far each point is to the LEFT of the line [m], (n,): Jaulin's e."""
        s, c = math.sin(self.course_rad), math.cos(self.course_rad)
        d = points_en - np.asarray(self.at_en)
        return np.asarray(s * d[:, 1] - c * d[:, 0], dtype=np.float64)

    def courses_rad(self, points_en: Vectors) -> NDArray[np.float64]:
        """Return the trajectory's course beside each point (n,) [rad]."""
        return np.full(len(points_en), self.course_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class HysteresisRing:
    """The hysteresis zone about a circle that is followed."""

    at_en: tuple[float, float]
    radius_m: float
    is_clockwise: bool = True
    half_m: float = ZONE_M

    def offset_m(self, points_en: Vectors) -> NDArray[np.float64]:
        """Return how far each point is to the LEFT of the way round [m], (n,): outside where that is clockwise."""
        d = points_en - np.asarray(self.at_en)
        outside = np.hypot(d[:, 0], d[:, 1]) - self.radius_m
        return np.asarray(outside if self.is_clockwise else -outside, dtype=np.float64)

    def courses_rad(self, points_en: Vectors) -> NDArray[np.float64]:
        """Return the course round the circle beside each point (n,) [rad]."""
        d = points_en - np.asarray(self.at_en)
        return np.asarray(np.arctan2(d[:, 0], d[:, 1]) + (0.5 if self.is_clockwise else -0.5) * math.pi)


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """A field projected out of the no-go zone about ``twd_from_rad``."""

    field: Field
    twd_from_rad: float
    no_go_half_rad: float = NO_GO_HALF_RAD
    zone: HysteresisZone | HysteresisRing | None = None

    def side(self, points_en: Vectors, q: int) -> NDArray[np.int64]:
        """Return q at each point: by its side outside the zone, ``q`` inside it."""
        inside = np.full(len(points_en), 1 if q >= 0 else -1, dtype=np.int64)
        if self.zone is None:
            return inside
        e = self.zone.offset_m(points_en)
        return np.where(np.abs(e) > self.zone.half_m, np.where(e > 0.0, 1, -1), inside)

    def evaluate(self, points_en: ArrayLike, q: int = 1) -> Vectors:
        """Return the sailable vectors (n, 2); lengths are kept. Does not change q: for pictures."""
        p = np.asarray(points_en, dtype=np.float64).reshape(-1, 2)
        v = self.field.evaluate(p)
        heading = np.arctan2(v[:, 0], v[:, 1])
        side = self.side(p, q)
        edge = self.twd_from_rad + side * self.no_go_half_rad
        chosen = np.where(self._needs_projection(p, heading), edge, heading)
        length = np.hypot(v[:, 0], v[:, 1])
        unit = np.column_stack([np.sin(chosen), np.cos(chosen)])
        return np.asarray(length[:, None] * unit, dtype=np.float64)

    def steer(self, at_en: tuple[float, float], q: int) -> tuple[float, float, int]:
        """Return (heading [rad, -π..π), length, q after) for the boat at ``at_en``."""
        p = np.asarray([at_en], dtype=np.float64)
        q = int(self.side(p, q)[0])
        v = self.evaluate(p, q)[0]
        return wrap_pi(math.atan2(v[0], v[1])), math.hypot(v[0], v[1]), q

    def fan(self, points_en: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the headings (n,), (n,) between which each vector may be turned: Schmitt's fan of directions.

        Both sides by pi / 4 within the zone, the side of q alone outside it.
        """
        p = np.asarray(points_en, dtype=np.float64).reshape(-1, 2)
        v = self.field.evaluate(p)
        heading = np.arctan2(v[:, 0], v[:, 1])
        low = heading - self.no_go_half_rad * (self.side(p, -1) < 0)
        high = heading + self.no_go_half_rad * (self.side(p, 1) > 0)
        return low, high

    def _needs_projection(self, p: Vectors, heading: NDArray[np.float64]) -> NDArray[np.bool_]:
        limit = math.cos(self.no_go_half_rad)
        inside = np.cos(heading - self.twd_from_rad) > limit + 1e-12
        if self.zone is not None:
            # Jaulin and Le Bars, line 5: near a line that cannot be sailed, do not pinch along it either.
            course = self.zone.courses_rad(p)
            shut = np.cos(course - self.twd_from_rad) > limit + 1e-12
            near = np.abs(self.zone.offset_m(p)) < self.zone.half_m
            ahead = np.cos(heading - course) > math.cos(self.no_go_half_rad + 1e-9)
            inside = inside | (shut & near & ahead)
        return np.asarray(inside, dtype=np.bool_)


_AHEAD_HALF_RAD = math.radians(110.0)
_ALWAYS_M = 30.0


def near_and_ahead(
    own_en: tuple[float, float], heading_rad: float | None, other_en: tuple[float, float], *, near_m: float = 300.0
) -> bool:
    """Return whether an obstacle matters: within ``near_m`` and in the sector ahead, or within _ALWAYS_M anywhere.

    Schmitt's section 4.2: obstacles behind a robot that sails forwards do not influence its field.
    """
    de, dn = other_en[0] - own_en[0], other_en[1] - own_en[1]
    d = math.hypot(de, dn)
    if d > near_m:
        return False
    if d < _ALWAYS_M or heading_rad is None:
        return True
    return abs(wrap_pi(math.atan2(de, dn) - heading_rad)) <= _AHEAD_HALF_RAD

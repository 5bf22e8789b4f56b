"""Vector fields as values: Schmitt's five atoms and the operations that compose them.

A field maps points to vectors, both (n, 2) arrays of east and north: where the boat should head from there, and
how strongly. The thesis's constants are the defaults: nominal fields have length 10, repulsive ones up to 20 with a
Gaussian of 100 m, so that far from an obstacle the trajectory decides and close to it the obstacle does.
Equations: S. Schmitt, Obstacle Avoidance for an Autonomous Marine Robot, 2013, section 4.1.2; its x is east here
and its y north.
"""

from __future__ import annotations

import abc
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vectors = NDArray[np.float64]

NOMINAL = 10.0
REPULSIVE = 20.0
REPULSIVE_SIGMA_M = 100.0  # listing 4.1 divides by 100²: a Gaussian exp(-(d / 100)²)
CIRCLE_RADIUS_M = 10.0
ZONE_M = 50.0  # half width of the hysteresis zone


class Field(abc.ABC):
    """A vector field. Subclasses are frozen dataclasses."""

    __slots__ = ()

    def __call__(self, points_en: ArrayLike) -> Vectors:
        """Return the vectors (n, 2) at the points (n, 2), one point (2,) included."""
        return self.evaluate(np.asarray(points_en, dtype=np.float64).reshape(-1, 2))

    @abc.abstractmethod
    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2) at the points (n, 2) [m]."""

    def __add__(self, other: Field) -> Field:
        """Return the sum."""
        return Sum(self, other)

    def rotated(self, angle_rad: float) -> Field:
        """Return the field turned clockwise about the origin, as headings are counted."""
        return Rotated(self, angle_rad)

    def shifted(self, east_m: float, north_m: float) -> Field:
        """Return the field moved; Schmitt's shiftX and shiftY."""
        return Shifted(self, east_m, north_m)

    def enlarged(self, factor: float) -> Field:
        """Return the field with its pattern ``factor`` times as large: Schmitt's scalar; lengths are kept."""
        return Enlarged(self, factor)

    def __mul__(self, gain: float) -> Field:
        """Return the field with its vectors ``gain`` times as long."""
        return Gain(self, gain)

    __rmul__ = __mul__


# --------------------------------------------------------------------------------------------- atoms
@dataclass(frozen=True, slots=True)
class AttractiveLine(Field):
    """Along the line through A = (-100, 0) and B = (100, 0), eastwards, inclined to it by up to 45 degrees.

    The angle to the line is -(2 gamma / pi) atan(e / r): Jaulin and Le Bars 2012, line 4 of their controller.
    """

    r_m: float = ZONE_M
    gamma_rad: float = math.pi / 4.0

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        angle = -(2.0 * self.gamma_rad / math.pi) * np.arctan(p[:, 1] / self.r_m)
        return NOMINAL * np.column_stack([np.cos(angle), np.sin(angle)])


@dataclass(frozen=True, slots=True)
class AttractiveCircle(Field):
    """Onto the circle of 10 m about the origin and round it clockwise (Jaulin's circle regulation, v0 = vr = 10).

    With ``v0`` negative anticlockwise.
    At the centre, where the formula has no direction, it points east.
    """

    v0: float = 10.0
    vr: float = 10.0
    rho: float = 0.1

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        d = np.hypot(p[:, 0], p[:, 1])
        pull = self.vr * np.arctan(self.rho * (CIRCLE_RADIUS_M - d))
        x, y = np.where(d > 0.0, p[:, 0], 1.0), p[:, 1]
        return _to_nominal(np.column_stack([x * pull + self.v0 * y, y * pull - self.v0 * x]))


@dataclass(frozen=True, slots=True)
class AttractivePoint(Field):
    """To the origin from everywhere, weakening within a few metres: length 10 exp(-1 / d)."""

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        d = np.hypot(p[:, 0], p[:, 1])
        safe = np.maximum(d, 1e-9)
        return np.asarray(-p * (NOMINAL * np.exp(-1.0 / safe) / safe)[:, None], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class RepulsivePoint(Field):
    """Away from the origin: length 20 exp(-(d / 100 m)²), listing 4.1; east at the very centre, as atan2 has it."""

    sigma_m: float = REPULSIVE_SIGMA_M

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        force = REPULSIVE * np.exp(-(p[:, 0] ** 2 + p[:, 1] ** 2) / self.sigma_m**2)
        angle = np.arctan2(p[:, 1], p[:, 0])
        return np.column_stack([force * np.cos(angle), force * np.sin(angle)])


@dataclass(frozen=True, slots=True)
class RepulsiveLine(Field):
    """Away from the east-west line through the origin: length 20 exp(-(y / 100 m)²); northwards on the line."""

    sigma_m: float = REPULSIVE_SIGMA_M

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        force = REPULSIVE * np.exp(-((p[:, 1] / self.sigma_m) ** 2))
        return np.column_stack([np.zeros(len(p)), np.where(p[:, 1] >= 0.0, force, -force)])


@dataclass(frozen=True, slots=True)
class Uniform(Field):
    """The same everywhere: a constant heading."""

    heading_rad: float
    length: float = NOMINAL

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        vector = (self.length * math.sin(self.heading_rad), self.length * math.cos(self.heading_rad))
        return np.tile(np.asarray(vector), (len(p), 1))


# ---------------------------------------------------------------------------------------- operations
@dataclass(frozen=True, slots=True)
class Sum(Field):
    """The sum of two fields: Schmitt's operator+."""

    left: Field
    right: Field

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        return self.left.evaluate(p) + self.right.evaluate(p)


@dataclass(frozen=True, slots=True)
class Longer(Field):
    """At each place the longer of two vectors, the left one where they are alike: what is strongest has its way."""

    left: Field
    right: Field

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        a, b = self.left.evaluate(p), self.right.evaluate(p)
        is_left = np.hypot(a[:, 0], a[:, 1]) >= np.hypot(b[:, 0], b[:, 1])
        return np.asarray(np.where(is_left[:, None], a, b), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Rotated(Field):
    """A field turned clockwise about the origin."""

    left: Field
    angle_rad: float

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        s, c = math.sin(self.angle_rad), math.cos(self.angle_rad)
        back = np.column_stack([c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1]])
        v = self.left.evaluate(back)
        return np.column_stack([c * v[:, 0] + s * v[:, 1], -s * v[:, 0] + c * v[:, 1]])


@dataclass(frozen=True, slots=True)
class Shifted(Field):
    """A field moved to another place."""

    left: Field
    east_m: float
    north_m: float

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        return self.left.evaluate(p - np.array([self.east_m, self.north_m]))


@dataclass(frozen=True, slots=True)
class Enlarged(Field):
    """A field whose pattern is ``factor`` times as large."""

    left: Field
    factor: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.factor) and self.factor > 0.0):
            raise ValueError(f"factor {self.factor} must be positive")

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        return self.left.evaluate(p / self.factor)


@dataclass(frozen=True, slots=True)
class Gain(Field):
    """A field whose vectors are ``gain`` times as long."""

    left: Field
    gain: float

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        return self.gain * self.left.evaluate(p)


def _to_nominal(v: Vectors) -> Vectors:
    norm = np.hypot(v[:, 0], v[:, 1])
    return np.asarray(v * (NOMINAL / np.maximum(norm, 1e-12))[:, None], dtype=np.float64)


def line_between(a_en: tuple[float, float], b_en: tuple[float, float], r_m: float = ZONE_M) -> Field:
    """Return the line field from a towards b: the atom, rotated and shifted."""
    middle = (0.5 * (a_en[0] + b_en[0]), 0.5 * (a_en[1] + b_en[1]))
    course = math.atan2(b_en[0] - a_en[0], b_en[1] - a_en[1])
    return AttractiveLine(r_m=r_m).rotated(course - math.pi / 2.0).shifted(*middle)


def repulsive_line_between(a_en: tuple[float, float], b_en: tuple[float, float], sigma_m: float) -> Field:
    """Return the repulsive field about the (endless) line through a and b."""
    course = math.atan2(b_en[0] - a_en[0], b_en[1] - a_en[1])
    return RepulsiveLine(sigma_m=sigma_m).rotated(course - math.pi / 2.0).shifted(*a_en)

"""Angles on the circle: wrapping, differences, means.

Angles are radians. Compass angles run clockwise from true north; ``wrap_pi`` gives [-π, π), ``wrap_two_pi``
gives [0, 2π). A heading h and an east-north vector are related by (east, north) = (sin h, cos h).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

TWO_PI = 2.0 * math.pi


def wrap_pi(angle_rad: float) -> float:
    """Return the angle on [-π, π).

    >>> round(wrap_pi(math.radians(190.0)), 6) == round(math.radians(-170.0), 6)
    True
    """
    wrapped = (angle_rad + math.pi) % TWO_PI - math.pi
    return wrapped if wrapped < math.pi else -math.pi


def wrap_pi_array(angle_rad: ArrayLike) -> NDArray[np.float64]:
    """Return ``wrap_pi`` of each.

    >>> np.degrees(wrap_pi_array(np.radians([190.0, -190.0]))).round(6).tolist()
    [-170.0, 170.0]
    """
    return np.asarray((np.asarray(angle_rad, dtype=np.float64) + math.pi) % TWO_PI - math.pi)


def wrap_two_pi(angle_rad: float) -> float:
    """Return the angle on [0, 2π)."""
    wrapped = angle_rad % TWO_PI
    return wrapped if wrapped < TWO_PI else 0.0


def direction(angle_rad: float) -> str:
    """Return a direction in degrees, in three digits.

    >>> direction(math.radians(7.2)), direction(math.radians(-90.0)), direction(math.radians(359.6))
    ('007', '270', '000')
    """
    return f"{round(math.degrees(angle_rad)) % 360:03d}"


def difference_rad(a_rad: float, b_rad: float) -> float:
    """Return a - b the shorter way round, on [-π, π); positive when a is clockwise of b.

    >>> round(math.degrees(difference_rad(math.radians(10.0), math.radians(350.0))))
    20
    """
    return wrap_pi(a_rad - b_rad)


def mean_direction_rad(angles_rad: NDArray[np.float64], weights: NDArray[np.float64] | None = None) -> float:
    """Return the direction of the (weighted) mean unit vector, on [-π, π); NaN when it vanishes."""
    angles = np.asarray(angles_rad, dtype=np.float64)
    w = np.ones_like(angles) if weights is None else np.asarray(weights, dtype=np.float64)
    s, c = float(np.sum(w * np.sin(angles))), float(np.sum(w * np.cos(angles)))
    return math.atan2(s, c) if math.hypot(s, c) > 1e-12 * max(1.0, float(np.sum(np.abs(w)))) else math.nan


def heading_of(east: float, north: float) -> float:
    """Return the compass heading [rad, -π..π] of an east-north vector.

    >>> round(math.degrees(heading_of(1.0, 0.0)))
    90
    """
    return math.atan2(east, north)


def unit_en(heading_rad: float) -> tuple[float, float]:
    """Return the unit vector (east, north) of a compass heading."""
    return math.sin(heading_rad), math.cos(heading_rad)

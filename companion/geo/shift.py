"""From the metres of one local frame to those of another: a boat that sails far takes its frame along.

Places are carried over latitude and longitude, so nothing is lost but what a double rounds away. Velocities are turned
by how far the north of one frame is off the other's there. Headings and winds are of true north at the boat and stay.

``carried`` finds places by the names that the whole project gives them: ``en_m``, ``..._en_m``, ``..._en`` are metres
east and north, alone or in rows, ``..._en_mps`` velocities. What bears another name is named here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from companion.geo.frame import LocalFrame

# Places that are named by what they are for.
PLACES = frozenset({"en_m", "sweeps", "searched", "lead_in"})
_PLACE_ENDS, _VELOCITY_ENDS = ("_en_m", "_en"), ("en_mps",)
_PROBE_M = 100.0  # north of the new origin: by this the frames' norths are compared

T = TypeVar("T")
Point = tuple[float, float]


def is_place(name: str) -> bool:
    """Return whether a field of this name holds metres east and north."""
    return name in PLACES or name.endswith(_PLACE_ENDS)


def is_velocity(name: str) -> bool:
    """Return whether a field of this name holds a velocity, east and north."""
    return name.endswith(_VELOCITY_ENDS)


@dataclass(frozen=True)
class Shift:
    """From the metres of ``before`` to those of ``after``."""

    before: LocalFrame
    after: LocalFrame

    def point(self, en_m: Point) -> Point:
        """Return a place in the new metres."""
        return self.after.en_from_geo(self.before.geo_from_en(*en_m))

    @cached_property
    def turn_rad(self) -> float:
        """How far a direction turns clockwise from the old grid to the new one, at the new origin [rad]."""
        here = self.before.en_from_geo(self.after.origin)
        east_m, north_m = self.point((here[0], here[1] + _PROBE_M))
        return math.atan2(east_m, north_m)

    def vector(self, en: Point) -> Point:
        """Return a velocity, or a way, in the new grid."""
        cos, sin = math.cos(self.turn_rad), math.sin(self.turn_rad)
        return en[0] * cos + en[1] * sin, en[1] * cos - en[0] * sin


def carried(value: T, shift: Shift) -> T:
    """Return a value with every place and velocity in it in the new metres; the same object where it has none."""
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        items = tuple(carried(item, shift) for item in value)
        return value if all(a is b for a, b in zip(items, value, strict=True)) else items  # type: ignore[return-value]
    if not is_dataclass(value) or isinstance(value, type):
        return value
    changes: dict[str, Any] = {}
    for each in fields(value):
        old = getattr(value, each.name)
        new = (
            _rows(old, shift.point)
            if is_place(each.name)
            else _rows(old, shift.vector)
            if is_velocity(each.name)
            else carried(old, shift)
        )
        if new is not old:
            changes[each.name] = new
    return replace(value, **changes) if changes else value


def _rows(value: Any, over: Any) -> Any:
    """Return a place, or rows of places in rows, carried over; None, and what is no place, as it is."""
    if isinstance(value, np.ndarray):
        return np.array([over((float(e), float(n))) for e, n in value]).reshape(value.shape)
    if not isinstance(value, tuple) or not value:
        return value
    if len(value) == 2 and all(isinstance(x, int | float) for x in value):
        return over(value)
    return tuple(_rows(item, over) for item in value)

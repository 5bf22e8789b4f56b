"""Numbers as the view has them: degrees, rounded to what anybody can see."""

from __future__ import annotations

import math
from typing import overload

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.view.air import PointEn, Tack


def metres(value_m: float) -> float:
    """Return metres to the decimetre."""
    return round(float(value_m), 1)


def place(en_m: PointEn) -> PointEn:
    """Return a place to the decimetre."""
    return metres(en_m[0]), metres(en_m[1])


@overload
def rounded(value: float, digits: int = ...) -> float: ...
@overload
def rounded(value: float | None, digits: int = ...) -> float | None: ...
def rounded(value: float | None, digits: int = 2) -> float | None:
    """Return a figure rounded; None for what is unknown or not finite."""
    return None if value is None or not math.isfinite(value) else round(float(value), digits)


def compass(angle_rad: float) -> float:
    """Return a direction in degrees, [0, 360).

    >>> compass(-math.pi / 2), compass(2.0 * math.pi - 1e-9)
    (270.0, 0.0)
    """
    return round(math.degrees(wrap_two_pi(angle_rad)), 1) % 360.0


def signed(angle_rad: float) -> float:
    """Return an angle in degrees, [-180, 180)."""
    return round(math.degrees(wrap_pi(angle_rad)), 1)


def degrees(angle_rad: float) -> float:
    """Return the size of an angle in degrees."""
    return round(math.degrees(angle_rad), 2)


def tack_of(twa_rad: float) -> Tack:
    """Return the tack by the angle of the wind to the bow: starboard, when it comes over the starboard side."""
    return "starboard" if twa_rad > 0.0 else "port"

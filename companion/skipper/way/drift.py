"""Where a boat that does not sail is taken: its drift, and what stands in the way of it.

A drift is the velocity over ground of a boat that nobody sails: becalmed, stopped, in irons. It is followed in a
straight line for as long as a crew needs to do something about it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import direction, heading_of
from companion.skipper.way.voyage import AreaLike, PointEn

HORIZON_S = 300.0  # time to wake a crew, clear an anchor and let it go
HAIR_M = 1e-6  # what rounding may make of a distance
NEARER_M = 0.5  # what a boat that is too near already may come nearer still, for rounding and the turn away
LOOKS = 241  # places looked at on the way; a dip between two of them still counts, at the nearest


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftAhead:
    """Where the drift goes within its horizon, and what it meets.

    Attributes:
        velocity_en_mps: The drift over ground [m/s, east north].
        end_en_m: Where the boat is after the horizon if nothing stops it.
        clearance_m: Least distance of the way to anything solid [m], at most 0 where it touches.
        floor_s: When it first comes within the floor asked for [s from now], None when it does not.
        contact_s: When it touches, None when it does not.
        at_en_m: Where it first comes within the floor.
        name: What it comes nearest to, in the words of the mission's files; empty when it keeps the floor.

    """

    velocity_en_mps: tuple[float, float]
    end_en_m: PointEn
    clearance_m: float
    floor_s: float | None = None
    contact_s: float | None = None
    at_en_m: PointEn | None = None
    name: str = ""

    @property
    def speed_mps(self) -> float:
        """How fast it drifts [m/s]."""
        return math.hypot(*self.velocity_en_mps)

    @property
    def is_clear(self) -> bool:
        """Whether it keeps the floor all the way."""
        return self.floor_s is None

    def sentence(self) -> str:
        """Return one line: how fast, where to, what it meets."""
        text = f"drifting {self.speed_mps:.2g} m/s towards {direction(heading_of(*self.velocity_en_mps))}°"
        if self.floor_s is None:
            return f"{text}, {self.clearance_m:.0f} m clear" if math.isfinite(self.clearance_m) else f"{text}, clear"
        if self.contact_s is not None:
            return f"{text}, onto {self.name} in {self.contact_s:.0f} s"
        return f"{text}, past {self.name} in {self.floor_s:.0f} s, {max(0.0, self.clearance_m):.0f} m off"


def drift_ahead(
    area: AreaLike,
    here_en_m: PointEn,
    velocity_en_mps: tuple[float, float],
    *,
    floor_m: float,
    horizon_s: float = HORIZON_S,
) -> DriftAhead:
    """Follow a drift from a place for ``horizon_s`` and say what it meets.

    Args:
        area: What stands still: obstacles and fence.
        here_en_m: Where the boat is.
        velocity_en_mps: Its drift over ground [m/s, east north]; 0 is allowed, a boat that lies still meets what it
            is too near to already.
        floor_m: What to keep clear of everything [m]; below 0 from inside something: how deep it may lead.
        horizon_s: How far ahead to look [s, above 0].

    Raises:
        ValueError: when the floor is not a number, or the horizon is out of range.

    """
    if not (math.isfinite(floor_m) and horizon_s > 0.0):
        raise ValueError(f"floor {floor_m} m must be finite, horizon {horizon_s} s above 0")
    end = (here_en_m[0] + horizon_s * velocity_en_mps[0], here_en_m[1] + horizon_s * velocity_en_mps[1])
    path_m = area.path_clearance_m([here_en_m, end])
    if floor_m >= 0.0 and path_m > floor_m + HAIR_M:  # no place on it is nearer
        return DriftAhead(velocity_en_mps=velocity_en_mps, end_en_m=end, clearance_m=path_m)
    t_s = np.linspace(0.0, horizon_s, LOOKS)
    places = np.asarray(here_en_m) + t_s[:, None] * np.asarray(velocity_en_mps)
    clear_m = area.clearance_m(places)
    least_m = float(clear_m.min()) if floor_m < 0.0 else min(path_m, float(clear_m.min()))
    if least_m > floor_m:
        return DriftAhead(velocity_en_mps=velocity_en_mps, end_en_m=end, clearance_m=least_m)
    floor_s = _first_s(t_s, clear_m, floor_m)
    at = (here_en_m[0] + floor_s * velocity_en_mps[0], here_en_m[1] + floor_s * velocity_en_mps[1])
    return DriftAhead(
        velocity_en_mps=velocity_en_mps,
        end_en_m=end,
        clearance_m=least_m,
        floor_s=floor_s,
        contact_s=_first_s(t_s, clear_m, 0.0) if least_m <= 0.0 else None,
        at_en_m=at,
        name=area.nearest_name(places[int(np.argmin(clear_m))]),
    )


def floor_from_m(here_m: float, floor_m: float) -> float:
    """Return the floor that a way keeps from a place ``here_m`` clear: from below the floor it comes no nearer.

    >>> floor_from_m(9.0, 6.0), floor_from_m(3.0, 6.0), floor_from_m(0.2, 6.0), floor_from_m(-4.0, 6.0)
    (6.0, 2.5, 0.0, -4.5)
    """
    return min(floor_m, here_m - NEARER_M if here_m <= 0.0 else max(0.0, here_m - NEARER_M))


def floor_after_s(area: AreaLike, here_en_m: PointEn, velocity_en_mps: tuple[float, float], *, floor_m: float) -> float:
    """Return when a drift first comes within ``floor_m`` of something [s], ``HORIZON_S`` where it does not by then.

    What ``drift_ahead`` tells, in a tenth of the time: no clearance changes faster than the boat moves, so a wide one
    is a long time without another look.
    """
    speed_mps, t_s = math.hypot(*velocity_en_mps), 0.0
    while t_s < HORIZON_S:
        place = np.array([[here_en_m[0] + t_s * velocity_en_mps[0], here_en_m[1] + t_s * velocity_en_mps[1]]])
        left_m = float(area.clearance_m(place)[0]) - floor_m
        if left_m <= 0.0:
            return t_s
        t_s += max(HORIZON_S / (LOOKS - 1), left_m / max(speed_mps, HAIR_M))
    return HORIZON_S


def _first_s(t_s: NDArray[np.float64], clear_m: NDArray[np.float64], least_m: float) -> float:
    """Return when a clearance that is known to fall to ``least_m`` first does [s], straight between two looks."""
    within = clear_m <= least_m
    if not within.any():
        return float(t_s[int(np.argmin(clear_m))])
    first = int(np.argmax(within))
    if first == 0:
        return 0.0
    a, b = float(clear_m[first - 1]) - least_m, float(clear_m[first]) - least_m
    return float(t_s[first - 1] + (t_s[first] - t_s[first - 1]) * a / (a - b))

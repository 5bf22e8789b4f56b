"""What a boat makes good over the ground in a current, on one heading and by beating."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.boat.boat import Boat

_HEADINGS, _NORMALS = 180, 360


def made_good_mps(
    boat: Boat, course_rad: float, *, twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float],
    no_go_half_rad: float,
) -> float | None:
    """Return the most that she makes good over the ground along a course [m/s], tacking and gybing as it takes.

    Her velocities over the ground are the convex hull of what her polar allows outside the no-go zone, moved by the
    current; she stays on the line on the whole where the line meets the hull. None: nowhere, she makes no way along it
    whatever she does, and is carried off it or back.

    Args:
        boat: her polar and deepest angle.
        course_rad: over the ground.
        twd_from_rad: where the wind over the water comes from.
        tws_mps: how fast it is.
        current_en_mps: where the water goes.
        no_go_half_rad: what she keeps out of.

    """
    # s (n . course) <= reach holds for every normal n of the hull
    normals, reach = _reach(boat, twd_from_rad, tws_mps, current_en_mps, no_go_half_rad, course_rad)
    along = normals @ np.array([math.sin(course_rad), math.cos(course_rad)])
    ahead, astern = along > 1e-9, along < -1e-9
    most = float(np.min(reach[ahead] / along[ahead]))
    least = float(np.max(reach[astern] / along[astern]))
    return most if most > 0.0 and most >= least else None


def slowest_en_mps(
    boat: Boat, *, twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float], no_go_half_rad: float,
) -> tuple[float, float]:
    """Return the slowest that she can be carried over the ground on the whole [m/s east, north]; 0, 0: she can stay.

    It is the point of the hull of ``made_good_mps`` that is nearest to lying still (arguments as there).
    """
    normals, reach = _reach(boat, twd_from_rad, tws_mps, current_en_mps, no_go_half_rad, 0.0)
    worst = int(np.argmin(reach))
    if reach[worst] >= 0.0:
        return 0.0, 0.0
    return float(reach[worst] * normals[worst, 0]), float(reach[worst] * normals[worst, 1])


def _reach(
    boat: Boat, twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float], no_go_half_rad: float,
    first_rad: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit normals (n, 2), the first towards ``first_rad``, and how far the hull reaches along each [m/s]."""
    off = np.linspace(min(no_go_half_rad, boat.max_twa_rad), boat.max_twa_rad, _HEADINGS)
    speed = boat.polar.speeds_mps(off, tws_mps)
    headings = np.concatenate([twd_from_rad + off, twd_from_rad - off])
    both = np.concatenate([speed, speed])
    velocities = np.column_stack([both * np.sin(headings), both * np.cos(headings)]) + np.asarray(current_en_mps)
    bearings = np.linspace(-math.pi, math.pi, _NORMALS, endpoint=False) + first_rad
    normals = np.column_stack([np.sin(bearings), np.cos(bearings)])
    return normals, np.max(normals @ velocities.T, axis=1)


def can_hold(
    boat: Boat, *, twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float], no_go_half_rad: float,
) -> bool:
    """Return whether she can stay where she is on the whole, and so make way everywhere (arguments as above)."""
    return slowest_en_mps(boat, twd_from_rad=twd_from_rad, tws_mps=tws_mps, current_en_mps=current_en_mps,
                          no_go_half_rad=no_go_half_rad) == (0.0, 0.0)

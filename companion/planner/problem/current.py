"""Headings in a current: which way to point so that the track over the ground is the leg."""

from __future__ import annotations

import math

import numpy as np

from companion.geo.angles import wrap_pi
from companion.planner.problem.value import Problem

_HEADINGS = 720


def solve_heading(p: Problem, course_rad: float, t_s: float) -> tuple[float, float]:
    """Return (heading [rad], speed over ground [m/s]) that makes ``course_rad`` good in the current.

    All headings whose velocity over the ground lies along the course are found between 720 samples by bisection
    on the cross product. The fastest that keeps clear of the no-go zone at ``t_s`` and of the deepest angle wins;
    without such a one the fastest at all (its leg then fails the no-go check); (course, 0) when none makes way.
    """
    dx, dy = math.sin(course_rad), math.cos(course_rad)
    cx = p.current.drift_mps * math.sin(p.current.set_rad)
    cy = p.current.drift_mps * math.cos(p.current.set_rad)
    twd, half = p.wind.twd_from_rad, p.no_go_half_rad(t_s)

    def speed(h: float) -> float:
        return p.boat.speed_mps(wrap_pi(h - twd))

    def cross(h: float) -> float:
        v = speed(h)
        return (v * math.sin(h) + cx) * dy - (v * math.cos(h) + cy) * dx

    grid = course_rad + np.linspace(-math.pi, math.pi, _HEADINGS + 1)
    v = np.interp(np.abs((grid - twd + math.pi) % (2.0 * math.pi) - math.pi), p.boat.polar_twa_rad, p.boat.polar_mps)
    side = (v * np.sin(grid) + cx) * dy - (v * np.cos(grid) + cy) * dx
    best, best_any = (course_rad, 0.0), (course_rad, 0.0)
    for i in np.nonzero(side[:-1] * side[1:] <= 0.0)[0]:
        lo, hi = float(grid[i]), float(grid[i + 1])
        low = cross(lo)
        for _ in range(60):
            mid = 0.5 * (lo + hi)
            value = cross(mid)
            lo, hi, low = (mid, hi, value) if (value > 0.0) == (low > 0.0) else (lo, mid, low)
        h = 0.5 * (lo + hi)
        made = speed(h)
        along = (made * math.sin(h) + cx) * dx + (made * math.cos(h) + cy) * dy
        twa = abs(wrap_pi(h - twd))
        if along > best_any[1]:
            best_any = (h, along)
        if along > best[1] and twa >= half - 1e-9 and twa <= p.boat.max_twa_rad + 1e-9:
            best = (h, along)
    return best if best[1] > 0.0 else best_any

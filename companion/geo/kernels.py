"""Compiled geometry that kernels of several rooms share: an angle on the circle, a moving disc that is met."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.kernels.jit import kernel

ENDLESS_S = 1e15  # what has no end is looked at for so long


@kernel
def wrap(angle_rad: float) -> float:
    """Return the angle on [-π, π)."""
    angle = angle_rad + math.pi
    if 0.0 <= angle < 2.0 * math.pi:  # what a remainder comes to within a turn either way, without its division
        return angle - math.pi
    if -2.0 * math.pi < angle < 0.0:
        return (angle + 2.0 * math.pi) - math.pi
    return angle % (2.0 * math.pi) - math.pi


@kernel
def first_inside(rx: float, ry: float, wx: float, wy: float, radius: float, growth: float, last: float) -> float:
    """Return the first time on [0, last] at which r + w t is nearer to 0 than ``radius + growth t``; inf: none is.

    The squared distance less the squared radius is a quadratic in time.
    """
    c0 = rx * rx + ry * ry - radius * radius
    if c0 < 0.0:
        return 0.0
    c1 = rx * wx + ry * wy - radius * growth
    c2 = wx * wx + wy * wy - growth * growth
    under = c1 * c1 - c2 * c0
    # within at the end, or at the least in between
    if not ((c2 * last + 2.0 * c1) * last + c0 < 0.0 or (c1 < 0.0 < c1 + c2 * last and under > 0.0)):
        return math.inf
    root = math.sqrt(max(0.0, under))
    return min(last, c0 / (root - c1) if c1 < 0.0 else -(c1 + root) / c2)  # the forms that cancel nothing


@kernel
def first_met(
    ax: float, ay: float, bx: float, by: float, t0: float, t1: float, discs: NDArray[np.float64]
) -> tuple[int, float]:
    """Return which disc a boat, at a at ``t0`` and at b at ``t1``, is in at some time, and when first; -1, inf: none.

    ``discs`` (n, 8): the disc is at (x + vx t, y + vy t), of radius r + g t, from its begin to its end. The first in
    order counts. What a boat may be within a disc's edge is taken off r before.
    """
    span = t1 - t0
    ux = (bx - ax) / span if 0.0 < span < math.inf else 0.0
    uy = (by - ay) / span if 0.0 < span < math.inf else 0.0
    for i in range(discs.shape[0]):
        d = discs[i]
        lo, hi = max(t0, d[6]), min(t1, d[7])
        if lo <= hi:
            rx = ax + ux * (lo - t0) - d[0] - d[2] * lo
            ry = ay + uy * (lo - t0) - d[1] - d[3] * lo
            after = first_inside(
                rx, ry, ux - d[2], uy - d[3], max(0.0, d[4] + d[5] * lo), d[5], min(hi - lo, ENDLESS_S)
            )
            if after < math.inf:
                return i, lo + after
    return -1, math.inf


@kernel
def meets_discs(discs: NDArray[np.float64], ax: float, ay: float, bx: float, by: float, t0: float, t1: float) -> bool:
    """Return whether ``first_met`` finds a disc."""
    return bool(first_met(ax, ay, bx, by, t0, t1, discs)[0] >= 0)

"""Kernels of the reference RRT*: what uncertain vessels make of one edge of its tree."""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from companion.planner.reference.kernels import meets_target
from companion.planner.risk.vessel_kernels import inside, piece, spread_at

# Columns of ``vessel``, a row for each window of a prediction, those of one vessel together and in order of time:
# whose, window, mean at t = 0 and its velocity, distance to keep, the axis along (sine, cosine), standard deviations
# along and across and their growth, growth of our own, and what the vessel is given of the promise at an instant.
WHOSE, FROM, UNTIL, VX0, VY0, VVX, VVY, KEEP, SINE, COSINE, ALONG, ALONG_G, ACROSS, ACROSS_G, OWN, PART = range(16)
COLUMNS = 16


@kernel
def _errors(row, course, out):  # type: ignore[no-untyped-def]
    """Fill out (3, 4) with the three errors: the vessel's along and across, ours along our course."""
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = row[SINE], row[COSINE], row[ALONG], row[ALONG_G]
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = row[COSINE], -row[SINE], row[ACROSS], row[ACROSS_G]
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = math.sin(course), math.cos(course), 0.0, row[OWN]


@kernel
def passing(  # type: ignore[no-untyped-def]
    ax, ay, bx, by, t, t0, t1, before_course, has_before, is_summed, vessel, disc,
):
    """Return (ok, expected entries) of the edge from a to b: a turn on the spot from t to t0, then the leg to t1.

    Not ok: at some instant a vessel is nearer than its distance with a greater chance than its part. ``before_course``
    is that of the leg that led to a, if there was one. ``disc`` (n, 8, as targets) are regions outside which no
    vessel's part is reached: without a sum of entries (``is_summed``) an edge clear of them all is not looked at.
    The pieces are those that the judge of whole paths takes (``companion.planner.risk.vessels``).
    """
    if not is_summed and not meets_target(ax, ay, ax, ay, t, t0, disc) and not meets_target(
            ax, ay, bx, by, t0, t1, disc):
        return True, 0.0
    course, span = math.atan2(bx - ax, by - ay), t1 - t0
    out, spread, errors = np.empty(3), np.empty(9), np.empty((3, 4))
    total, whose, before = 0.0, -1.0, -1.0
    first = 0
    n = vessel.shape[0]
    while first < n:
        whose, last = vessel[first, WHOSE], first
        while last < n and vessel[last, WHOSE] == whose:
            last += 1
        before = -1.0
        if has_before:
            for k in range(first, last):
                if vessel[k, FROM] < t <= vessel[k, UNTIL]:
                    _errors(vessel[k], before_course, errors)
                    spread_at(t, errors, spread)
                    before = inside(ax - vessel[k, VX0] - vessel[k, VVX] * t, ay - vessel[k, VY0] - vessel[k, VVY] * t,
                                    spread, vessel[k, KEEP])
        for phase in range(2):
            begin, end, ux, uy = t, t0, 0.0, 0.0
            if phase == 1:
                begin, end = t0, t1
                if span > 1e-9:
                    ux, uy = (bx - ax) / span, (by - ay) / span
            for k in range(first, last):
                lo, hi = max(begin, vessel[k, FROM]), min(end, vessel[k, UNTIL])
                if hi <= lo:
                    continue
                _errors(vessel[k], course, errors)
                piece(
                    lo, hi, ax + ux * (lo - begin) - vessel[k, VX0] - vessel[k, VVX] * lo,
                    ay + uy * (lo - begin) - vessel[k, VY0] - vessel[k, VVY] * lo, ux - vessel[k, VVX],
                    uy - vessel[k, VVY], errors, vessel[k, KEEP], before, out)
                if out[2] > vessel[k, PART]:
                    return False, total
                total += out[0]
                before = out[1]
        first = last
    return True, total

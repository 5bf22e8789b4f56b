"""The bound: how far along a direction she can get at most, and so when at the earliest she can be at the goal.

Along any direction n her speed made good is at most the largest of n . v over the angles of the tack that she is on.
The best sequence of tacks for that alone is a small dynamic programme over time and tack, exact, whatever she does
across n. She is at the goal by T only if for every n the way to it along n is no longer. Where nothing is in the way
these conditions are nearly enough: in a wind that is the same everywhere an optimum has one costate, a constant n.
"""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from sitl.clairvoyant.race import Floats, Race
from sitl.clairvoyant.steps import PARTS, PORT, STARBOARD, Steps

DIRECTIONS = 72


def directions() -> Floats:
    """Return (n, 2) unit vectors all round."""
    angles = np.arange(DIRECTIONS) * 2.0 * math.pi / DIRECTIONS
    return np.column_stack([np.sin(angles), np.cos(angles)])


def made_good_m(steps: Steps, units: Floats) -> Floats:
    """Return (2, count * PARTS, n): the most that a part of a step makes good along each direction, by tack."""
    out = np.zeros((2, len(steps.twd_rad), len(units)))
    for row in (PORT, STARBOARD):
        heading = steps.twd_rad[:, None] + (1.0 if row == PORT else -1.0) * steps.angle_rad
        east, north = steps.speed_mps * np.sin(heading), steps.speed_mps * np.cos(heading)
        for n, (ue, un) in enumerate(units):
            out[row, :, n] = np.maximum(0.0, (ue * east + un * north).max(axis=1))
    return out * (steps.step_s / PARTS)


@kernel
def most_m(gain: Floats, last: int, part_s: float, tack_s: float, board: int) -> Floats:
    """Return (2, last + 1, n): the most that is made good along each direction from a step to step ``last``.

    ``gain`` (2, parts, n) of ``made_good_m``.
    """
    n = gain.shape[2]
    out = np.zeros((2, last + 1, n))
    parts = PARTS
    for j in range(last - 1, -1, -1):
        upto = min(j + board, last)
        for row in range(2):
            for i in range(n):
                on, over = out[row, j + 1, i], out[1 - row, upto, i]
                for q in range(parts):
                    on += gain[row, j * parts + q, i]
                for q in range((upto - j) * parts):
                    share = (q + 1) - tack_s / part_s
                    if share > 0.0:
                        over += min(share, 1.0) * gain[1 - row, j * parts + q, i]
                out[row, j, i] = max(on, over)
    return out


def bound_s(race: Race, steps: Steps, gain: Floats, units: Floats) -> float:
    """Return the time before which nobody has been at all goals; the last step's where that is not enough."""
    ways = np.max([units @ (np.array(goal.en_m) - np.array(race.start_en_m)) - goal.radius_m for goal in race.goals],
                  axis=0)

    def most(last: int) -> Floats:
        made: Floats = most_m(gain, last, steps.step_s / PARTS, steps.tack_s, steps.board)[:, 0].max(axis=0)
        return made

    low, high = 0, steps.count - steps.board
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if bool(np.all(most(middle) >= ways)) else (middle, high)
    before, after = most(low), most(high)
    late = ways > before
    if not late.any():
        return low * steps.step_s
    # within the last step: straight, along the direction that takes longest
    share = float(np.max((ways[late] - before[late]) / np.maximum(after[late] - before[late], 1e-9)))
    return (low + min(1.0, share)) * steps.step_s

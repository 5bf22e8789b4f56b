"""A trial: the few minutes of sailing that settle what a boat's logs cannot tell apart.

Seven boards of a beat are six tacks; a reach there and back parts leeway, compass and stream; broad reaches and a run
on both tacks end where it began. Those headings are what a circle would be for, and no boat sails one head to wind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

BOARDS = 7
OFF_NO_GO_DEG = 12.0  # so far from the no-go zone a beat is a leg, not a plan with tacks of its own
REACH_DEG, BROAD_DEG, RUN_DEG = 95.0, 120.0, 155.0  # of the ground: leeway makes the reach be sailed at 90
REACH = 2.0  # boards long
BOARD_S, LEAST_BOARD_S = 90.0, 40.0  # of a board; shorter ones leave no steady sailing between two tacks
SCALES = np.linspace(1.0, LEAST_BOARD_S / BOARD_S, 8)
STEPS = 24  # places that are tried, along and across


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """Marks (n, 2) [m] in the order in which they are sailed, what each ends, and how long a board is [m]."""

    marks_en_m: NDArray[np.float64]
    names: tuple[str, ...]
    board_m: float


def trial_in(
    water: BaseGeometry, near_en_m: tuple[float, float], *, twd_from_rad: float, no_go_half_rad: float, speed_mps: float
) -> Trial | None:
    """Return the longest trial that fits into the water, as near to a place as it can be; None: there is no room.

    Args:
        water: where the boat may be [m], whatever is kept off taken away.
        near_en_m: where it begins from.
        twd_from_rad: the wind's direction.
        no_go_half_rad: of the boat.
        speed_mps: on a beat.
    """
    beat_deg = math.degrees(no_go_half_rad) + OFF_NO_GO_DEG
    legs = [(beat_deg if n % 2 == 0 else -beat_deg, 1.0, f"tack {n}" if n else "begin") for n in range(BOARDS)]
    legs += [(REACH_DEG, REACH, "beat"), (-REACH_DEG, REACH, "reach there"), (BROAD_DEG, 1.0, "reach back")]
    legs += [(-BROAD_DEG, 1.0, "broad reach")]
    down = sum(share * math.cos(math.radians(a)) for a, share, _ in legs)
    runs = 2 * max(1, round(0.25 * down / math.cos(math.radians(180.0 - RUN_DEG))))
    length = down / runs / math.cos(math.radians(180.0 - RUN_DEG))
    legs += [
        (RUN_DEG * (1 if n % 2 == 0 else -1), length, f"run {n}" if n else "broad reach back") for n in range(runs)
    ]
    angle = twd_from_rad + np.radians([a for a, _, _ in legs])
    steps = np.array([share for _, share, _ in legs])[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
    shape = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    names = (*(name for _, _, name in legs), "end")
    for scale in SCALES:
        board_m = float(scale) * BOARD_S * speed_mps
        place = _place(water, board_m * shape, near_en_m)
        if place is not None:
            return Trial(marks_en_m=board_m * shape + place, names=names, board_m=board_m)
    return None


def _place(water: BaseGeometry, marks: NDArray[np.float64], near: tuple[float, float]) -> NDArray[np.float64] | None:
    """Return where the first mark lies so that all legs are in the water, the nearest that is tried; None: nowhere."""
    west, south, east, north = water.bounds
    low = np.array([west, south]) - marks.min(axis=0)
    high = np.array([east, north]) - marks.max(axis=0)
    if water.is_empty or bool(np.any(high < low)):
        return None
    tried = np.stack(np.meshgrid(*(np.linspace(low[i], high[i], STEPS) for i in (0, 1))), axis=-1).reshape(-1, 2)
    shapely.prepare(water)
    fits = shapely.covers(water, shapely.linestrings(tried[:, None, :] + marks[None, :, :]))
    if not bool(np.any(fits)):
        return None
    free = tried[fits]
    return np.asarray(free[int(np.argmin(np.hypot(*(free - np.array(near)).T)))])

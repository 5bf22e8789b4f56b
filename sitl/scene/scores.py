"""Official scores of station keeping, as functions of a track.

WRSC 2018: within 20 m for 5 minutes from the first point inside; the score is the radius of the circle about the
mean position that holds 95 % of the points, per boat length; the mean must be within 20 m. WRSC 2019: the mean
distance, 15 m, and sqrt(1 + N) for N touches of a buoy. SailBot: a box of 40 m, 2 points a minute up to 10, -2 a
minute after 5.5 minutes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TASK_S = 300.0
SAILBOT_HALF_M = 20.0
SAILBOT_MINUTES_FREE = 5.5


@dataclass(frozen=True, slots=True, kw_only=True)
class StationScore:
    """The scores of one track; distances in metres."""

    kept: bool             # WRSC 2018: five minutes were sailed and their mean position is within the radius
    radius95_m: float      # WRSC 2018: about the mean position
    lengths: float         # WRSC 2018: that per boat length
    mean_m: float          # WRSC 2019: mean distance to the point
    sailbot: float         # SailBot: points, 10 at best, left out of the box in time
    farthest_m: float


def station_score(
    track: NDArray[np.float64], point_en: tuple[float, float], *, radius_m: float = 20.0, length_m: float = 1.0
) -> StationScore:
    """Score the five minutes from the first point inside.

    Args:
        track: (n, 3) or wider: t [s], east, north [m].
        point_en: the station.
        radius_m: of the task's circle.
        length_m: of the boat.

    """
    d = np.hypot(track[:, 1] - point_en[0], track[:, 2] - point_en[1])
    inside = np.flatnonzero(d <= radius_m)
    if not inside.size:
        return StationScore(kept=False, radius95_m=math.inf, lengths=math.inf, mean_m=math.inf, sailbot=0.0,
                            farthest_m=float(d.max(initial=math.inf)))
    begin = float(track[inside[0], 0])
    during = (track[:, 0] >= begin) & (track[:, 0] <= begin + TASK_S)
    p = track[during, 1:3]
    mean = p.mean(axis=0)
    # The organisers' rule: the farthest of the nearest 95 % of the points, their number rounded.
    apart = np.sort(np.hypot(p[:, 0] - mean[0], p[:, 1] - mean[1]))
    radius95 = float(apart[max(0, round(0.95 * len(apart)) - 1)])
    long_enough = float(track[during, 0][-1]) - begin >= TASK_S - 1.5
    return StationScore(
        kept=long_enough and math.dist((float(mean[0]), float(mean[1])), point_en) < radius_m, radius95_m=radius95,
        lengths=radius95 / length_m, mean_m=float(d[during].mean()), sailbot=sailbot_points(track, point_en),
        farthest_m=float(d[during].max()),
    )


def sailbot_points(track: NDArray[np.float64], point_en: tuple[float, float]) -> float:
    """Return SailBot's points: 2 per minute inside the box up to 10, -2 per minute inside after 5.5 minutes.

    The track counts from its first point inside; minutes outside are not counted.
    """
    inside = np.max(np.abs(track[:, 1:3] - np.asarray(point_en)), axis=1) <= SAILBOT_HALF_M
    if not inside.any():
        return 0.0
    t = track[:, 0] - track[int(np.argmax(inside)), 0]
    dt = np.diff(t, append=t[-1])
    free = SAILBOT_MINUTES_FREE * 60.0
    early = float(np.sum(dt[inside & (t >= 0.0) & (t < TASK_S)])) / 60.0
    late = float(np.sum(dt[inside & (t >= free)])) / 60.0
    return max(0.0, min(10.0, 2.0 * early) - 2.0 * late)

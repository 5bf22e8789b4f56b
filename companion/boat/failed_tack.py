"""Where a tack that fails carries the boat: it shoots up into the wind, lies there, falls off to the old tack.

Measured on the simulator's hull (winds of 3 to 9 m/s, 4 to 14 s in irons): it shoots 1.9 to 2.1 s of its speed, half
way between the old course and the wind, and has sailed 0.3 to 0.6 s of it on the old course when it tries again, at
half the speed; ``tests/boat/test_failed_tack.py`` holds these figures against it. That hull hardly goes astern. One
with a rig does: what it is blown back is reckoned from its windage, beside the track without it. One that makes
leeway is set to the lee side while it lies a little on its old tack, farther on than it was going (``lee_set``).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi

SHOOT_S = 2.1  # of the boat's speed, before it lies
FILL_S = 0.8  # of the boat's speed, on the old course until it tries again
AGAIN_SHARE = 0.6  # of the boat's speed, at the next try
TRIES = 2  # then the boat gybes round where there is room
MOST_FAILURES = 5  # in a row that are looked at, where there is none
RISKY = 0.01  # one failure must not touch; several in a row may, with no more than this probability
IRONS_S = 10.0  # it lies head to wind: the skipper bears away after 8 s (``in irons``), and that takes it two
# Of the wind's speed: hull and flogging sails. A skiff under bare poles is blown at 3 to 6 % of it.
BLOWN_SHARE = 0.04
# Likewise, abeam: a hull whose leeway is 5 degrees on a beat, the wind 15 degrees off its bow and its sails flogging
# (``companion.boat.boat``, of the push a quarter).
SET_SHARE = 0.05

Track = NDArray[np.float64]


def failed_tack(
    corner_en: tuple[float, float],
    *,
    course_rad: float,
    speed_mps: float,
    twd_from_rad: float,
    tws_mps: float,
    current_en_mps: tuple[float, float] = (0.0, 0.0),
    irons_s: float = IRONS_S,
) -> tuple[Track, Track]:
    """Return two tracks (n, 2) [m] of one failed tack: blown back while the boat lies, and not.

    Both end where it tries again, on the old course. ``course_rad`` and ``speed_mps`` are its own before the corner.
    """
    up = course_rad + 0.5 * wrap_pi(twd_from_rad - course_rad)
    shot = _moved(corner_en, up, SHOOT_S * speed_mps)
    blown = _moved(shot, twd_from_rad + math.pi, BLOWN_SHARE * tws_mps * irons_s)
    east, north = irons_s * current_en_mps[0], irons_s * current_en_mps[1]
    lain = (blown[0] + east, blown[1] + north), (shot[0] + east, shot[1] + north)
    ends = [_moved(place, course_rad, FILL_S * speed_mps) for place in lain]
    return np.array([corner_en, shot, lain[0], ends[0]]), np.array([corner_en, shot, lain[1], ends[1]])


def lee_set(*, course_rad: float, twd_from_rad: float, lee_mps: float) -> tuple[float, float]:
    """Return how a hull that is set at ``lee_mps`` is while it lies (east, north) [m/s]: abeam, to its old lee."""
    abeam = twd_from_rad - math.copysign(0.5 * math.pi, wrap_pi(twd_from_rad - course_rad))
    return lee_mps * math.sin(abeam), lee_mps * math.cos(abeam)


def gybing_centre(
    place: tuple[float, float], *, course_rad: float, twd_from_rad: float, radius_m: float
) -> tuple[float, float]:
    """Return the centre [m] of the circle on which the boat gybes round, to leeward of a place."""
    side = -1.0 if wrap_pi(twd_from_rad - course_rad) > 0.0 else 1.0
    return _moved(place, course_rad + side * 0.5 * math.pi, radius_m)


def _moved(place: tuple[float, float], course_rad: float, length_m: float) -> tuple[float, float]:
    return place[0] + length_m * math.sin(course_rad), place[1] + length_m * math.cos(course_rad)

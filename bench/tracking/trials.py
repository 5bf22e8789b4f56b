"""Trials: legs, wind and parameters that an autopilot is given, drawn by seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

PointEn = tuple[float, float]

# A beam reach of about 0.6, 1.2, 2.2, 3.2 and 4.1 m/s.
WINDS_MPS = (0.25, 1.0, 3.0, 6.0, 9.5)
RADII_M = (1.0, 2.0, 3.0, 5.0, 10.0)
CORNERS_DEG = (10.0, 30.0, 50.0, 70.0, 90.0, 110.0, 130.0, 150.0, 170.0)
SHORTEST_M, LONGEST_M = 2.0, 100.0
OPEN_DEG = (62.0, 298.0)  # courses that are clear of the no-go zone in a wind from north: 45 degrees and its pad
LEAD_M = 60.0  # the first leg, from rest
LEGS = {0.25: 14, 1.0: 22}  # in little wind she takes her time
MANY = 34
BEAT_M = 240.0
BEAT_CORRIDORS_M = (5.0, 10.0, 20.0)
BEAT_WINDS = ((3.0, 0.0), (5.0, 9.0), (5.0, 18.6), (9.5, 9.0))  # strength [m/s], spread [deg]
# Strength of the wind, the current's drift [m/s] and where it sets to [deg]; four long legs on all sides of the wind.
STREAMS = (
    (1.5, 0.25, 90.0),
    (1.5, 0.5, 225.0),
    (3.0, 0.3, 0.0),
    (3.0, 0.6, 135.0),
    (6.0, 0.5, 90.0),
    (6.0, 1.0, 270.0),
)
STREAM_COURSES_DEG, STREAM_LEG_M = (90.0, 190.0, 265.0, 130.0), 110.0
SPREAD_TAU_S = 27.8  # of the wind's direction: Wolsieffer 2020, equation 17


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One voyage of a trial.

    Attributes:
        name: What it is called.
        points_en_m: Waypoints; she lies at the origin, bow to the first of them.
        tws_mps: True wind speed over the ground, the wind from north.
        spread_rad: Standard deviation of the wind's direction, 0: constant.
        wp_radius_m: WP_RADIUS.
        corridor_m: SAIL_XTRACK_MAX.
        seed: Of the wind.
        drift_mps: The current's speed, 0: none.
        set_rad: Where it sets to.

    """

    name: str
    points_en_m: tuple[PointEn, ...]
    tws_mps: float
    wp_radius_m: float = 3.0
    corridor_m: float = 10.0
    spread_rad: float = 0.0
    seed: int = 0
    drift_mps: float = 0.0
    set_rad: float = 0.0

    @property
    def current_en_mps(self) -> PointEn:
        """The water's velocity over the ground."""
        return self.drift_mps * math.sin(self.set_rad), self.drift_mps * math.cos(self.set_rad)

    @property
    def water_wind(self) -> tuple[float, float]:
        """Where the wind over the water comes from [rad], and its speed [m/s]."""
        east, north = self.current_en_mps[0], self.tws_mps + self.current_en_mps[1]
        return math.atan2(east, north), math.hypot(east, north)

    @property
    def first_rad(self) -> float:
        """Course of the first leg [rad]."""
        return math.atan2(self.points_en_m[0][0], self.points_en_m[0][1])


def corners() -> list[Trial]:
    """Return the trials of corners: each wind with each radius, every kind of corner and of leg in each."""
    out = []
    for i, tws in enumerate(WINDS_MPS):
        for j, radius in enumerate(RADII_M):
            rng = np.random.default_rng([15, i, j])
            out.append(
                Trial(
                    name=f"corners-{tws:g}-{radius:g}",
                    points_en_m=_legs(rng, LEGS.get(tws, MANY)),
                    tws_mps=tws,
                    wp_radius_m=radius,
                )
            )
    return out


def beats() -> list[Trial]:
    """Return the trials of legs dead to windward that the autopilot beats, and a reach from their end."""
    points = ((0.0, 15.0), (0.0, BEAT_M), (80.0, BEAT_M - 20.0))
    return [
        Trial(
            name=f"beat-{corridor:g}-{tws:g}-{spread:g}",
            points_en_m=points,
            tws_mps=tws,
            corridor_m=corridor,
            spread_rad=math.radians(spread),
            seed=n,
        )
        for n, corridor in enumerate(BEAT_CORRIDORS_M)
        for tws, spread in BEAT_WINDS
    ]


def streams() -> list[Trial]:
    """Return the trials of long legs across currents, and with and against them."""
    points, here = [], (0.0, 0.0)
    for course in map(math.radians, STREAM_COURSES_DEG):
        here = (here[0] + STREAM_LEG_M * math.sin(course), here[1] + STREAM_LEG_M * math.cos(course))
        points.append(here)
    return [
        Trial(
            name=f"stream-{tws:g}-{drift:g}-{set_deg:g}",
            points_en_m=tuple(points),
            tws_mps=tws,
            drift_mps=drift,
            set_rad=math.radians(set_deg),
        )
        for tws, drift, set_deg in STREAMS
    ]


def _legs(rng: np.random.Generator, count: int) -> tuple[PointEn, ...]:
    """Return a row of legs: corners of every size in turn, lengths log-uniform, no course near the wind."""
    low, high = (math.radians(a) for a in OPEN_DEG)
    course, here = math.radians(180.0), (0.0, -LEAD_M)
    points = [here]
    turns: list[float] = []
    while len(points) < count:
        if not turns:
            turns = [float(math.radians(c)) for c in rng.permutation(CORNERS_DEG)]
        for turn in list(turns):
            sides = [s for s in (1.0, -1.0) if low <= course + s * turn <= high]
            if sides:
                turns.remove(turn)
                course += float(rng.choice(sides)) * turn
                break
        else:
            # none of those left fits: the wide ones must begin near an edge of what is open
            course = float(np.clip(course + rng.uniform(-1.0, 1.0), low, high))
            if len(turns) < 3:
                turns = []
        length = math.exp(rng.uniform(math.log(SHORTEST_M), math.log(LONGEST_M)))
        here = (here[0] + length * math.sin(course), here[1] + length * math.cos(course))
        points.append(here)
    return tuple(points)

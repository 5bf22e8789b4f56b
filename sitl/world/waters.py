"""A stretch of water: the wind over it and the current in it, by place and time.

Places are metres east and north of a home, as the autopilots count them; ``home_en_m`` is that home in the frame in
which islands and shear are given. A question has one answer, in whatever order it is asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from companion.geo.angles import wrap_two_pi
from sitl.world.wind import Process, Wind

Place = tuple[float, float]
_KM = 1000.0
# A wake grows wider by this share of the way downwind (Jensen 1983, A note on wind generator interaction: 0.1; 0.04 to
# 0.075 are in use for it since).
WAKE_WIDENING = 0.07
# The wind's strength is never multiplied by less or more than this, however far out a gradient is followed.
LEAST_SHARE, MOST_SHARE = 0.2, 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Lee:
    """An island that takes the wind from the water behind it.

    Attributes:
        en_m: its middle.
        radius_m: of what stands in the wind.
        loss: the share of the wind's strength that is lost close behind it.
        reach_m: downwind of which a third of that is left (1 / e).
    """

    en_m: Place
    radius_m: float
    loss: float
    reach_m: float

    def share(self, en_m: Place, twd_from_rad: float) -> float:
        """Return the share of the wind's strength that is left at a place."""
        east, north = en_m[0] - self.en_m[0], en_m[1] - self.en_m[1]
        sin, cos = math.sin(twd_from_rad), math.cos(twd_from_rad)
        behind_m, across_m = -(east * sin + north * cos), east * cos - north * sin
        if behind_m <= -self.radius_m:
            return 1.0
        width_m = self.radius_m + WAKE_WIDENING * max(behind_m, 0.0)
        depth = math.exp(-behind_m / self.reach_m) if behind_m > 0.0 else 1.0 + behind_m / self.radius_m
        return 1.0 - self.loss * depth * math.exp(-((across_m / width_m) ** 2))


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """The water's motion: a constant part, a tide, and how both change over the water.

    Attributes:
        set_to_rad, drift_mps: the constant part.
        tide_to_rad, tide_mps: the tide's greatest stream, at ``tide_high_s`` ...
        tide_s: ... and again after this; it falls as a cosine.
        tide_turns: its stream across, as a share: 0 runs to and fro, 1 turns with the clock, -1 against it.
        shear_per_km: the stream is stronger by this share of itself for each km ...
        shear_to_rad: ... in this direction. It never turns round.
    """

    set_to_rad: float = 0.0
    drift_mps: float = 0.0
    tide_to_rad: float = 0.0
    tide_mps: float = 0.0
    tide_s: float = 44_712.0
    tide_high_s: float = 0.0
    tide_turns: float = 0.0
    shear_per_km: float = 0.0
    shear_to_rad: float = 0.0

    def at(self, t_s: float, en_m: Place) -> Place:
        """Return the stream at a time and a place, east and north [m/s]."""
        phase = 2.0 * math.pi * (t_s - self.tide_high_s) / self.tide_s
        along, across = self.tide_mps * math.cos(phase), self.tide_mps * self.tide_turns * math.sin(phase)
        sin, cos = math.sin(self.tide_to_rad), math.cos(self.tide_to_rad)
        east = self.drift_mps * math.sin(self.set_to_rad) + along * sin + across * cos
        north = self.drift_mps * math.cos(self.set_to_rad) + along * cos - across * sin
        there_m = en_m[0] * math.sin(self.shear_to_rad) + en_m[1] * math.cos(self.shear_to_rad)
        share = max(0.0, 1.0 + self.shear_per_km * there_m / _KM)
        return east * share, north * share


class Gusty:
    """Another wind with gusts: its strength times a factor whose mean is 1 and that wanders as AR(1) does.

    ``spread`` is the standard deviation of the factor's logarithm, ``tau_s`` its correlation time.
    """

    def __init__(self, base: Wind, *, spread: float, tau_s: float, seed: int) -> None:
        self._base, self._spread = base, spread
        self._process = Process(1.0 / tau_s, 0.1, seed, 2, from_mean=False)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at ``t_s``."""
        twd, tws = self._base.at(t_s)
        return twd, tws * math.exp(self._spread * self._process.at(t_s) - 0.5 * self._spread**2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Waters:
    """Wind and stream by place and time.

    Attributes:
        wind: at the frame's origin, far from any island.
        lees: the islands.
        stronger_per_km: the wind is stronger by this share for each km ...
        stronger_to_rad: ... in this direction ...
        bends_rad_per_km: ... and veers by so much there (positive: clockwise).
        stream: of the water.
        home_en_m: from which places are counted, in the frame of the islands.
    """

    wind: Wind
    lees: Sequence[Lee] = ()
    stronger_per_km: float = 0.0
    stronger_to_rad: float = 0.0
    bends_rad_per_km: float = 0.0
    stream: Stream = field(default_factory=Stream)
    home_en_m: Place = (0.0, 0.0)

    def wind_at(self, t_s: float, en_m: Place) -> tuple[float, float]:
        """Return (direction it comes from [rad, 0..2π), speed [m/s]) at a time and a place."""
        twd, tws = self.wind.at(t_s)
        here = en_m[0] + self.home_en_m[0], en_m[1] + self.home_en_m[1]
        there_km = (here[0] * math.sin(self.stronger_to_rad) + here[1] * math.cos(self.stronger_to_rad)) / _KM
        share = min(max(1.0 + self.stronger_per_km * there_km, LEAST_SHARE), MOST_SHARE)
        for lee in self.lees:
            share *= lee.share(here, twd)
        return wrap_two_pi(twd + self.bends_rad_per_km * there_km), tws * share

    def stream_at(self, t_s: float, en_m: Place) -> Place:
        """Return the stream at a time and a place, east and north [m/s]."""
        return self.stream.at(t_s, (en_m[0] + self.home_en_m[0], en_m[1] + self.home_en_m[1]))

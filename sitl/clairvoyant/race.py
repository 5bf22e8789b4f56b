"""What a clairvoyant sails: start, goals, boat, the wind that she meets, and what is solid. What she makes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Polar

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """A wind that is known, the same everywhere: straight between its readings, held after the last.

    Attributes:
        t_s: (n,) from the start, increasing.
        twd_from_rad: (n,) where it comes from.
        tws_mps: (n,) how fast.
    """

    t_s: Floats
    twd_from_rad: Floats
    tws_mps: Floats

    def at(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Return direction [rad, not wrapped] and speed [m/s]."""
        twd = np.interp(t_s, self.t_s, np.unwrap(self.twd_from_rad))
        return np.asarray(twd), np.asarray(np.interp(t_s, self.t_s, self.tws_mps))


@dataclass(frozen=True, slots=True, kw_only=True)
class Craft:
    """A point that sails by a polar and follows the wind at once; on one tack turning costs nothing.

    Attributes:
        polar: speed by wind angle and strength.
        no_go_half_rad: she sails no nearer to the wind.
        max_twa_rad: and no deeper.
        tack_s: so long she stands still in each change of side, tack or gybe.
        board_s: least time on a tack from its beginning, that included.
    """

    polar: Polar
    no_go_half_rad: float
    max_twa_rad: float
    tack_s: float
    board_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A disc to be reached [m]."""

    en_m: tuple[float, float]
    radius_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Race:
    """One start, the goals in their order, and the water between: nothing nearer than ``clear_m`` to ``solid``."""

    craft: Craft
    weather: Weather
    start_en_m: tuple[float, float]
    goals: tuple[Goal, ...]
    solid: BaseGeometry
    clear_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Best:
    """The best that was found, and what nothing can beat.

    Attributes:
        time_s: of ``track``, which that craft can sail exactly.
        bound_s: no track in this wind is faster, to the steps of time; near ``time_s`` where nothing is in the way.
        coarser_s: the time on the grid of twice the size: what refining still gained.
        track: (n, 4) time from the start [s], east and north [m], 1 on port tack and -1 on starboard.
    """

    time_s: float
    bound_s: float
    coarser_s: float
    track: Floats

    @property
    def tacks(self) -> int:
        """Changes of side, gybes too."""
        return int(np.count_nonzero(np.diff(self.track[:, 3])))

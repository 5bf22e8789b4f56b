"""A policy: what it is expected to take from any place, on any tack, in any shift, and what is best done there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.geo.segments import PolygonIndex
from companion.planner.policy.kernels import (
    FAR_S,
    HALF,
    TACK,
    TOUCH_S,
    Field,
    between,
    between_shifts,
    looked_ahead,
    sail,
    tacked_s,
)
from companion.planner.policy.shifts import Shifts

Floats = NDArray[np.float64]
PointEn = tuple[float, float]

PORT, STARBOARD = 0, 1
"""The tacks, by the side that the wind is on."""
SETTLED_S = 0.02
"""The values are settled where no round changes one by more."""
TIMES_OVER = 4.0
"""A drawn voyage is given up after so many times the expected one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """Places on a square grid: where the middle of the first lies, how far apart they are, which are water."""

    corner_en_m: PointEn
    cell_m: float
    is_water: NDArray[np.bool_]

    def cells(self, en_m: PointEn) -> PointEn:
        """Return a place's row and column."""
        return (en_m[1] - self.corner_en_m[1]) / self.cell_m, (en_m[0] - self.corner_en_m[0]) / self.cell_m

    def en_m(self, places: NDArray[np.int64]) -> Floats:
        """Return (n, 2) places of a flat index."""
        row, column = np.divmod(places, self.is_water.shape[1])
        return np.column_stack([self.corner_en_m[0] + column * self.cell_m, self.corner_en_m[1] + row * self.cell_m])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Handling:
    """What the boat does.

    Attributes:
        sailing: (a, 2) the angles to the wind that are sailed [rad], and how fast she is there [m/s].
        tack_s: what a tack takes.
        fails: the chance that one does not come off; she then lies in irons ...
        irons_s: ... for so long, before she is on the tack that she began on ...
        lee_mps: ... set to leeward so fast, where that was port tack, and starboard.
        current_en_mps: what carries her.

    """

    sailing: Floats
    tack_s: float
    fails: float
    irons_s: float
    lee_mps: PointEn
    current_en_mps: PointEn


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What is best done now.

    Attributes:
        is_tack: she tacks, else she stands on.
        course_rad: the heading on the present tack where she stands on; on the other where not.
        time_s: the expected time to go.
        gain_s: what it is worth over the other of the two: standing on, or tacking [s]; inf: there is no other.

    """

    is_tack: bool
    course_rad: float
    time_s: float
    gain_s: float


class DrawnVoyages(NamedTuple):
    """Voyages by the policy in drawn winds.

    ``time_s`` (n,) with inf for one that did not end, ``has_touched`` (n,), ``tacks`` (n,), ``tracks`` a list of (k, 2)
    places.
    """

    time_s: Floats
    has_touched: NDArray[np.bool_]
    tacks: NDArray[np.int64]
    tracks: list[Floats]


@dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """The values over a chart. Arrays are (rows, columns, tack, shift); ``hopes`` are those of a step later.

    ``beyond`` (tack, shift) is what is to go from the goal, where that is not the last. ``change_s`` is what the last
    round changed a value by at the most: how far from settled they are.
    """

    chart: Chart
    shifts: Shifts
    twd_from_rad: float
    goal_en_m: PointEn
    goal_radius_m: float
    solid: PolygonIndex
    handling: Handling
    step_s: float
    beyond: Floats
    values: Floats
    hopes: Floats
    best: NDArray[np.int16]
    rounds: int
    change_s: float
    took_s: float

    @property
    def is_settled(self) -> bool:
        """Whether another round would change nothing: not where its budget ended before."""
        return self.change_s <= SETTLED_S

    def time_to_go_s(self, en_m: PointEn, shift_rad: float, tack: int | None = None) -> float:
        """Return the expected time to go from a place, inf where there is no way; on the better tack by default."""
        found = [self._value(self.values, en_m, shift_rad, q) for q in ((PORT, STARBOARD) if tack is None else (tack,))]
        return math.inf if min(found) >= FAR_S * HALF else min(found)

    def chart_s(self, tack: int) -> Floats:
        """Return (rows, columns) the time to go in the mean wind, NaN where there is no way."""
        value = self.values[:, :, tack, len(self.shifts.shift_rad) // 2]
        return np.where(value < FAR_S * HALF, value, np.nan)

    def tacks_at_once(self, tack: int, shift: int | None = None) -> NDArray[np.bool_]:
        """Return (rows, columns) where she tacks at once, in one of the shifts; None: in the mean wind."""
        at = len(self.shifts.shift_rad) // 2 if shift is None else shift
        return np.asarray((self.best[:, :, tack, at] == TACK) & (self.values[:, :, tack, at] < FAR_S * HALF))

    def decide(self, en_m: PointEn, shift_rad: float, tack: int) -> Decision:
        """Return what is best done at a place, by one look ahead from exactly there."""
        on_s, course_rad, _ = looked_ahead(self._field, *en_m, tack, shift_rad)
        other_s, other_rad, _ = looked_ahead(self._field, *en_m, 1 - tack, shift_rad)
        about_s = tacked_s(self._field, *en_m, tack, shift_rad, other_s)
        gain_s = on_s - about_s
        if max(on_s, about_s) >= FAR_S * HALF:
            gain_s = math.copysign(math.inf, gain_s)
        if gain_s > 0.0:
            return Decision(is_tack=True, course_rad=other_rad, time_s=about_s, gain_s=gain_s)
        return Decision(is_tack=False, course_rad=course_rad, time_s=on_s, gain_s=-gain_s)

    def sailed(self, en_m: PointEn, tack: int, *, count: int, seed: int = 0) -> DrawnVoyages:
        """Sail drawn winds from a place by the policy, looking ahead each step from where she is then."""
        if math.isinf(expected_s := self.time_to_go_s(en_m, 0.0, tack)):
            raise ValueError(f"there is no way from {en_m}")
        draw = np.random.default_rng(seed)
        steps = max(50, math.ceil(TIMES_OVER * expected_s / self.step_s))
        times, touched = np.empty(count), np.zeros(count, dtype=np.bool_)
        tacks, tracks = np.zeros(count, dtype=np.int64), []
        for n in range(count):
            track = np.empty((steps, 3))
            times[n], touched[n], tacks[n], places = sail(
                self._field,
                np.array([self.shifts.spread_rad, self.shifts.tau_s]),
                np.array([*en_m, float(tack)]),
                draw.standard_normal(steps),
                draw.random(steps),
                track,
            )
            tracks.append(track[:places, :2])
        times[times >= FAR_S * HALF] = math.inf
        return DrawnVoyages(times, touched, tacks, tracks)

    @cached_property
    def _field(self) -> Field:
        """What the kernels look ahead by."""
        handling = self.handling
        return Field(
            hopes=self.hopes,
            beyond=self.beyond,
            water=np.array([*self.chart.corner_en_m, self.chart.cell_m]),
            edges=self.solid.tables,
            goal=np.array([*self.chart.cells(self.goal_en_m), self.goal_radius_m / self.chart.cell_m]),
            sailing=handling.sailing,
            current=np.array(handling.current_en_mps),
            shift_rad=self.shifts.shift_rad,
            twd_rad=self.twd_from_rad,
            step_s=self.step_s,
            tack=np.array([handling.tack_s, handling.fails, handling.irons_s, TOUCH_S]),
            lee=np.array(handling.lee_mps),
        )

    def _value(self, table: Floats, en_m: PointEn, shift_rad: float, tack: int) -> float:
        row, column = self.chart.cells(en_m)
        low, high, share = between_shifts(self.shifts.shift_rad, shift_rad)
        near, far = between(table, row, column, tack, low), between(table, row, column, tack, high)
        return float((1.0 - share) * near + share * far)

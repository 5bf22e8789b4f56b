"""The polar: boat speed by true wind angle and true wind speed.

Between its nodes a polar is linear in |TWA| and in TWS. Outside them it never promises more than was measured:
above the last wind column it stays at that column, below the first it falls linearly to nothing at no wind,
below the first angle it falls linearly to nothing head to wind, beyond the last angle it stays at that row.
"""

from __future__ import annotations

import bisect
import csv
import math
from dataclasses import dataclass, field
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.geo import MPS_PER_KNOT

_SEARCH_STEP_RAD = math.radians(0.05)  # of the best angles; VMG is flat there, finer changes nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class SailingAngle:
    """An angle worth sailing: |TWA| [rad, 0..π], the speed there, and the speed made good to or from the wind."""

    twa_rad: float
    speed_mps: float
    vmg_mps: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Polar:
    """Boat speed [m/s] on a grid of |TWA| and TWS.

    Attributes:
        twa_rad: (n,) strictly increasing, within [0, π].
        tws_mps: (m,) strictly increasing, 0 or more. A first column at 0 m/s holds without wind too.
        speed_mps: (n, m) finite and never negative.
        name: What a reader calls it.

    Raises:
        ValueError: when the table breaks one of these rules.
    """

    twa_rad: NDArray[np.float64]
    tws_mps: NDArray[np.float64]
    speed_mps_table: NDArray[np.float64]
    name: str = ""
    # the curve in the wind of the moment, which a step asks for several times: (wind speed, angles, boat speeds)
    _last: list[tuple[float, list[float], list[float]]] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        twa = np.array(self.twa_rad, dtype=np.float64)
        tws = np.array(self.tws_mps, dtype=np.float64)
        table = np.array(self.speed_mps_table, dtype=np.float64)
        if twa.ndim != 1 or tws.ndim != 1 or twa.size == 0 or tws.size == 0 or table.shape != (twa.size, tws.size):
            raise ValueError(f"{twa.shape} angles and {tws.shape} winds need a matching table, not {table.shape}")
        for array, what in ((twa, "angles"), (tws, "wind speeds"), (table, "boat speeds")):
            if not bool(np.all(np.isfinite(array))):
                raise ValueError(f"the {what} hold a value that is not a finite number")
        if bool(np.any(np.diff(twa) <= 0.0)) or twa[0] < 0.0 or twa[-1] > math.pi + 1e-9:
            raise ValueError("wind angles must increase strictly from 0 or more to 180 degrees or less")
        if bool(np.any(np.diff(tws) <= 0.0)) or tws[0] < 0.0:
            raise ValueError("wind speeds must increase strictly from 0 or more")
        if bool(np.any(table < 0.0)):
            raise ValueError("a boat speed is negative")
        for array, name in ((twa, "twa_rad"), (tws, "tws_mps"), (table, "speed_mps_table")):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Polar):
            return NotImplemented
        return (
            self.name == other.name
            and np.array_equal(self.twa_rad, other.twa_rad)
            and np.array_equal(self.tws_mps, other.tws_mps)
            and np.array_equal(self.speed_mps_table, other.speed_mps_table)
        )

    def __hash__(self) -> int:
        return hash((self.name, self.twa_rad.tobytes(), self.tws_mps.tobytes(), self.speed_mps_table.tobytes()))

    # ------------------------------------------------------------------------------------------ speed
    def column_mps(self, tws_mps: float) -> NDArray[np.float64]:
        """Return the boat speed (n,) [m/s] at each of ``twa_rad`` in this true wind speed."""
        if not (math.isfinite(tws_mps) and tws_mps >= 0.0):
            raise ValueError(f"true wind speed {tws_mps} is not a finite speed")
        tws, table = self.tws_mps, self.speed_mps_table
        if tws_mps >= tws[-1]:
            return np.array(table[:, -1])
        if tws_mps <= tws[0]:
            return np.array(table[:, 0]) * (tws_mps / tws[0] if tws[0] > 0.0 else 1.0)
        i = int(np.searchsorted(tws, tws_mps, side="right")) - 1
        f = (tws_mps - tws[i]) / (tws[i + 1] - tws[i])
        return np.array((1.0 - f) * table[:, i] + f * table[:, i + 1])

    def curve(self, tws_mps: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the nodes |TWA| [rad] and speed [m/s] at this wind speed, linear between, from 0 to π."""
        twa, speed = self.twa_rad, self.column_mps(tws_mps)
        if twa[0] > 0.0:
            twa, speed = np.concatenate([[0.0], twa]), np.concatenate([[0.0], speed])
        if twa[-1] < math.pi:
            twa, speed = np.concatenate([twa, [math.pi]]), np.concatenate([speed, speed[-1:]])
        return np.array(twa), np.array(speed)

    def speed_mps(self, twa_rad: float, tws_mps: float) -> float:
        """Return the boat speed [m/s] at a true wind angle [rad, any wrap, either side] and speed [m/s].

        >>> from companion.boat.polar import constant
        >>> constant(2.0).speed_mps(-1.0, 5.0)
        2.0
        """
        if not math.isfinite(twa_rad):
            raise ValueError("a true wind angle is not a finite number")
        folded = abs((twa_rad + math.pi) % (2.0 * math.pi) - math.pi)
        nodes, speed = self._curve_of(tws_mps)
        i = bisect.bisect_right(nodes, folded) - 1
        if i + 1 >= len(nodes) or nodes[i] == folded:
            return speed[min(i, len(nodes) - 1)]
        return (speed[i + 1] - speed[i]) / (nodes[i + 1] - nodes[i]) * (folded - nodes[i]) + speed[i]   # as np.interp

    def _curve_of(self, tws_mps: float) -> tuple[list[float], list[float]]:
        """Return ``curve`` as lists."""
        for known, nodes, speed in self._last:
            if known == tws_mps:
                return nodes, speed
        nodes, speed = (array.tolist() for array in self.curve(tws_mps))
        self._last[:] = [(tws_mps, nodes, speed), *self._last[:3]]
        return nodes, speed

    def speeds_mps(self, twa_rad: ArrayLike, tws_mps: float) -> NDArray[np.float64]:
        """Return the boat speeds [m/s] at an array of true wind angles [rad]."""
        angle = np.asarray(twa_rad, dtype=np.float64)
        if not bool(np.all(np.isfinite(angle))):
            raise ValueError("a true wind angle is not a finite number")
        folded = np.abs((angle + math.pi) % (2.0 * math.pi) - math.pi)
        nodes, speed = self.curve(tws_mps)
        return np.asarray(np.interp(folded, nodes, speed), dtype=np.float64)

    def max_speed_mps(self, tws_mps: float) -> float:
        """Return the highest speed [m/s] at any angle."""
        return float(np.max(self.column_mps(tws_mps)))

    # ------------------------------------------------------------------------------------ best angles
    def vmg_mps(self, twa_rad: float, tws_mps: float) -> float:
        """Return the speed made good to windward [m/s]; negative when sailing away from the wind."""
        return self.speed_mps(twa_rad, tws_mps) * math.cos(twa_rad)

    def best_beat(self, tws_mps: float, *, no_go_half_rad: float = 0.0) -> SailingAngle:
        """Return the angle of the best speed to windward outside the no-go zone [rad, 0..π/2]."""
        return self._best(tws_mps, min(max(no_go_half_rad, 0.0), math.pi / 2.0), math.pi / 2.0, 1.0)

    def best_run(self, tws_mps: float, *, max_twa_rad: float = math.pi) -> SailingAngle:
        """Return the angle of the best speed away from the wind, no deeper than ``max_twa_rad`` [rad, π/2..π]."""
        return self._best(tws_mps, math.pi / 2.0, min(max(max_twa_rad, math.pi / 2.0), math.pi), -1.0)

    def _best(self, tws_mps: float, low_rad: float, high_rad: float, sign: float) -> SailingAngle:
        count = max(2, 1 + math.ceil((high_rad - low_rad) / _SEARCH_STEP_RAD))
        angles = np.unique(np.concatenate([
            np.linspace(low_rad, high_rad, count),
            self.twa_rad[(self.twa_rad >= low_rad) & (self.twa_rad <= high_rad)],
        ]))
        speeds = self.speeds_mps(angles, tws_mps)
        vmg = sign * speeds * np.cos(angles)
        # Of equal angles take the one nearest a beam reach: faster through the water, and clear of trouble.
        best = np.flatnonzero(vmg >= np.max(vmg) - 1e-12)
        i = int(best[-1] if sign > 0.0 else best[0])
        return SailingAngle(twa_rad=float(angles[i]), speed_mps=float(speeds[i]), vmg_mps=float(vmg[i]))


# --- the polars that come with the program: constant, AVALON's polynomial, ArduRover's simulated sailboat.

# [1], eq. 4.1: boat speed per wind speed against the true wind angle in RADIANS; both speeds in knots.
AVALON_COEFFICIENTS = (-0.0048, 0.0335, -0.2460, 0.7465, -0.01109)
AVALON_TESTED_KNOTS = 25.0  # "tested in conditions ranging from almost 0 to 25 knots": the last column


def constant(speed_mps: float) -> Polar:
    """Return a boat that sails at one speed at every angle in any wind (Wolsieffer 2020, section 3.2)."""
    return Polar(
        twa_rad=np.array([0.0, math.pi]), tws_mps=np.array([0.0]),
        speed_mps_table=np.full((2, 1), float(speed_mps)), name=f"constant {speed_mps:g} m/s",
    )


def avalon() -> Polar:
    """Return AVALON's polar ([1], eq. 4.1), sampled each degree; proportional to the wind up to 25 kn.

    The polynomial is slightly negative head to wind; there the boat stands still.

    References:
        [1] G.-A. Büsser, Design and Implementation of a Navigation Algorithm for an Autonomous Sailboat, 2009.

    >>> round(avalon().speed_mps(math.radians(90.0), 10.0 * MPS_PER_KNOT) / MPS_PER_KNOT, 2)
    6.56
    """
    twa = np.radians(np.arange(181.0))
    per_wind = np.clip(np.polyval(AVALON_COEFFICIENTS, twa), 0.0, None)
    tws = AVALON_TESTED_KNOTS * MPS_PER_KNOT
    table = np.column_stack([np.zeros_like(twa), per_wind * tws])
    return Polar(twa_rad=twa, tws_mps=np.array([0.0, tws]), speed_mps_table=table, name="AVALON")


def ardurover_sitl() -> Polar:
    """Return the measured polar of ArduRover SITL's sailboat (4.7-dev, heading held, automatic trim).

    Measured at 3, 6 and 12 m/s; the boat drifts astern head to wind, which counts as no speed.
    """
    text = files("companion.boat").joinpath("data/ardurover_sitl.csv").read_text(encoding="utf-8")
    reader = csv.DictReader(text.splitlines())
    rows = [(float(row["twa_deg"]), float(row["tws_mps"]), float(row["speed_mps"])) for row in reader]
    twa = sorted({row[0] for row in rows})
    tws = sorted({row[1] for row in rows})
    by_place = {(row[0], row[1]): max(0.0, row[2]) for row in rows}
    table = np.array([[by_place[a, w] for w in tws] for a in twa])
    return Polar(twa_rad=np.radians(np.array(twa)), tws_mps=np.array(tws), speed_mps_table=table, name="ArduRover SITL")

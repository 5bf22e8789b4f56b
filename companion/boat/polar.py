r"""The polar: boat speed by true wind angle and true wind speed.

Between its nodes a polar is linear in |TWA| and in TWS. Outside them it never promises more than was measured:
above the last wind column it stays at that column, below the first it falls linearly to nothing at no wind,
below the first angle it falls linearly to nothing head to wind. Beyond a last angle abaft the beam it falls so fast
that gybing at that angle makes more way to leeward; beyond another it stays at that row.

Files are those that sailors have: OpenCPN's and qtVlm's .pol and .csv, Expedition's pairs. The grid is a header
``TWA\\TWS;4;6;8`` of wind speeds [kn], then rows of a wind angle [deg] and boat speeds [kn], separated by ``;``, tab,
``,`` or spaces; a decimal comma is understood where ``;`` or tab separates. A blank cell and a bare ``0`` mean "not
known" and are interpolated; ``0.0`` means "cannot sail"; below 0.05 kn is 0.
"""

from __future__ import annotations

import bisect
import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.geo import MPS_PER_KNOT
from companion.geo.angles import wrap_pi_array
from companion.geo.distinct import distinct

Floats = NDArray[np.float64]

_TO_WINDWARD_RAD = math.radians(60.0)  # every boat sails there, and is pressed as on a beat
_NO_FASTER = 0.01
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
    # the curves that were asked for last, which a step asks for several times: (wind speed, angles, boat speeds)
    _last: list[tuple[float, list[float], list[float]]] = field(default_factory=list, init=False, repr=False)
    # the table as lists, made when one speed is first asked for: a step asks for fifty, each in a wind of its own
    _lists: list[_Lists] = field(default_factory=list, init=False, repr=False)

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
            deeper, share = _beyond(float(twa[-1]))
            twa, speed = np.concatenate([twa, deeper]), np.concatenate([speed, share * speed[-1]])
        return np.array(twa), np.array(speed)

    def speed_mps(self, twa_rad: float, tws_mps: float) -> float:
        """Return the boat speed [m/s] at a true wind angle [rad, any wrap, either side] and speed [m/s].

        >>> from companion.boat.polar import constant
        >>> constant(2.0).speed_mps(-1.0, 5.0)
        2.0
        """
        if not math.isfinite(twa_rad):
            raise ValueError("a true wind angle is not a finite number")
        folded = abs((float(twa_rad) + math.pi) % (2.0 * math.pi) - math.pi)
        if not self._lists:
            self._lists.append(_lists_of(self))
        of, nodes = self._lists[0], self._lists[0].nodes
        wind = of.wind(float(tws_mps))
        i = bisect.bisect_right(nodes, folded) - 1
        if i + 1 >= len(nodes) or nodes[i] == folded:
            return of.speed(min(i, len(nodes) - 1), wind)
        a, b = of.speed(i, wind), of.speed(i + 1, wind)
        return (b - a) / (nodes[i + 1] - nodes[i]) * (folded - nodes[i]) + a  # as np.interp

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
        folded = np.abs(wrap_pi_array(angle))
        nodes, speed = self.curve(tws_mps)
        return np.asarray(np.interp(folded, nodes, speed), dtype=np.float64)

    def max_speed_mps(self, tws_mps: float) -> float:
        """Return the highest speed [m/s] at any angle."""
        return max(self._curve_of(tws_mps)[1])

    @property
    def full_tws_mps(self) -> float:
        """The wind [m/s] from which on the boat goes no faster to windward: there it carries all that it can.

        Infinite for a polar of one column, which says nothing of it.
        """
        speeds = np.array([np.interp(_TO_WINDWARD_RAD, self.twa_rad, column) for column in self.speed_mps_table.T])
        if speeds.size == 1 or speeds.max() == 0.0:
            return math.inf
        return float(self.tws_mps[int(np.argmax(speeds >= (1.0 - _NO_FASTER) * speeds.max()))])

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
        angles = distinct(
            np.concatenate(
                [
                    np.linspace(low_rad, high_rad, count),
                    self.twa_rad[(self.twa_rad >= low_rad) & (self.twa_rad <= high_rad)],
                ]
            )
        )
        speeds = self.speeds_mps(angles, tws_mps)
        vmg = sign * speeds * np.cos(angles)
        # Of equal angles take the one nearest a beam reach: faster through the water, and clear of trouble.
        best = np.flatnonzero(vmg >= np.max(vmg) - 1e-12)
        i = int(best[-1] if sign > 0.0 else best[0])
        return SailingAngle(twa_rad=float(angles[i]), speed_mps=float(speeds[i]), vmg_mps=float(vmg[i]))


@dataclass(frozen=True, slots=True)
class _Lists:
    """A polar's table for one speed at a time: what ``curve`` has, to the last bit, at two of its nodes.

    ``first`` nodes stand before the table's, and behind them those whose speeds are ``shares`` of its last.
    """

    nodes: list[float]
    first: int
    shares: list[float]
    tws_mps: list[float]
    rows: list[list[float]]

    def wind(self, tws_mps: float) -> tuple[int, float]:
        """Return where a wind speed lies: the column before it and how far on to the next; -1: so much of the first."""
        if not (math.isfinite(tws_mps) and tws_mps >= 0.0):
            raise ValueError(f"true wind speed {tws_mps} is not a finite speed")
        tws = self.tws_mps
        if tws_mps >= tws[-1]:
            return len(tws) - 1, 0.0
        if tws_mps <= tws[0]:
            return -1, tws_mps / tws[0] if tws[0] > 0.0 else 1.0
        i = bisect.bisect_right(tws, tws_mps) - 1
        return i, (tws_mps - tws[i]) / (tws[i + 1] - tws[i])

    def speed(self, node: int, wind: tuple[int, float]) -> float:
        """Return the speed at a node in such a wind [m/s]."""
        at, (i, f) = node - self.first, wind
        if at < 0:
            return 0.0
        row = self.rows[min(at, len(self.rows) - 1)]
        speed = row[0] * f if i < 0 else row[i] if i + 1 == len(row) else (1.0 - f) * row[i] + f * row[i + 1]
        return speed if at < len(self.rows) else self.shares[at - len(self.rows)] * speed


def _lists_of(polar: Polar) -> _Lists:
    nodes, _ = polar.curve(0.0)
    twa = polar.twa_rad
    return _Lists(
        nodes=nodes.tolist(),
        first=1 if twa[0] > 0.0 else 0,
        shares=_beyond(float(twa[-1]))[1].tolist() if twa[-1] < math.pi else [],
        tws_mps=polar.tws_mps.tolist(),
        rows=polar.speed_mps_table.tolist(),
    )


def _beyond(last_rad: float) -> tuple[Floats, Floats]:
    """Return nodes beyond the last angle of a polar, to π, and the speed there as a share of the speed at it.

    Abaft the beam it falls along the tangent of the curve on which the way made to leeward stays what it is at the last
    angle: from there on gybing at that angle makes more.
    """
    off_rad = math.pi - last_rad
    if last_rad <= 0.5 * math.pi:
        return np.array([math.pi]), np.array([1.0])
    left = 1.0 - off_rad * math.tan(off_rad)
    if left >= 0.0:
        return np.array([math.pi]), np.array([left])
    return np.array([last_rad + 1.0 / math.tan(off_rad), math.pi]), np.array([0.0, 0.0])


# --- the polars that come with the program: constant, AVALON's polynomial, ArduRover's simulated sailboat.

# [1], eq. 4.1: boat speed per wind speed against the true wind angle in RADIANS; both speeds in knots.
AVALON_COEFFICIENTS = (-0.0048, 0.0335, -0.2460, 0.7465, -0.01109)
AVALON_TESTED_KNOTS = 25.0  # "tested in conditions ranging from almost 0 to 25 knots": the last column


def constant(speed_mps: float) -> Polar:
    """Return a boat that sails at one speed at every angle in any wind (Wolsieffer 2020, section 3.2)."""
    return Polar(
        twa_rad=np.array([0.0, math.pi]),
        tws_mps=np.array([0.0]),
        speed_mps_table=np.full((2, 1), float(speed_mps)),
        name=f"constant {speed_mps:g} m/s",
    )


def avalon() -> Polar:
    """Return AVALON's polar ([1], eq. 4.1), sampled each degree; proportional to the wind up to 25 kn.

    The polynomial is slightly negative head to wind; there the boat stands still.

    References:
        [1] G.-A. Büsser, Design and Implementation of a Navigation Algorithm for an Autonomous Sailboat, 2009.

    >>> round(avalon().speed_mps(math.radians(90.0), 10.0 * MPS_PER_KNOT) / MPS_PER_KNOT, 2)
    6.55
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


MAX_TWS_KN = 200.0
MAX_SPEED_KN = 100.0
MIN_SPEED_KN = 0.05  # OpenCPN stores "cannot sail" as 0.01
MOST_TIMES = 3.0  # the wind: no boat but a foiler in its best breeze comes near
LEAST_JUDGED_MPS = 1.0  # in less a boat is carried by its way and the gusts
MAX_FILE_BYTES = 2_000_000  # a polar is a few kilobytes; anything else is another file

_HEADER = re.compile(r"^(twa\s*[/\\]?\s*tws|twa|tws)$", re.IGNORECASE)
_EXTRA_ROW = re.compile(r"^(opt|beat|run|gybe|jibe|vmg|up|down|dn)", re.IGNORECASE)
_NUMBER = re.compile(r"^[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?$")


@dataclass(frozen=True, slots=True, kw_only=True)
class PolarFile:
    """A polar read from a file, and what had to be guessed or left out to read it."""

    polar: Polar
    warnings: tuple[str, ...] = ()


def read_polar(path: str | Path) -> PolarFile:
    """Read a polar file.

    Raises:
        InputError: naming the file, the line, the problem and the remedy.
    """
    source = str(path)
    try:
        raw = read_regular(Path(path), MAX_FILE_BYTES + 1)
    except OSError as error:
        raise unreadable(source, error) from error
    if len(raw) > MAX_FILE_BYTES:
        raise InputError(
            source, "", f"more than {MAX_FILE_BYTES} bytes is no polar", "give a .pol or .csv file of boat speeds"
        )
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return parse_polar(text, source=source)


def parse_polar(text: str, *, source: str = "polar") -> PolarFile:
    """Return the polar that ``text`` holds; see ``read_polar``."""
    lines = [
        (number, line.strip())
        for number, line in enumerate(text.replace("\ufeff", "").splitlines(), start=1)
        if line.strip() and line.strip()[0] not in "#!"
    ]
    if not lines:
        raise InputError(source, "", "holds no polar", "give rows of wind angle and boat speeds")
    header = _find_header(lines)
    if header is not None:
        return _parse_grid(lines[header:], source)
    pairs = _parse_pairs(lines, source)
    if pairs is not None:
        return pairs
    numeric = [i for i, (_, line) in enumerate(lines) if len(_cells(line)) >= 2 and _is_numeric_row(line)]
    if not numeric:
        raise InputError(
            source, f"line {lines[0][0]}", "no header of wind speeds", "start with a line like TWA\\TWS;4;6;8;10"
        )
    return _parse_grid(lines[numeric[0] :], source)


def _check_speeds(twa_deg: Floats, tws_mps: Floats, speed_mps: Floats, source: str) -> None:
    """Raise InputError where a boat is far faster than the wind that drives it; NaN is not looked at."""
    most = np.where(tws_mps >= LEAST_JUDGED_MPS, MOST_TIMES * tws_mps, math.inf)
    wrong = np.argwhere(speed_mps > most[None, :])
    if len(wrong):
        i, j = wrong[0]
        raise InputError(
            source,
            f"{twa_deg[i]:g} degrees, wind {tws_mps[j] / MPS_PER_KNOT:.1f} kn ({tws_mps[j]:.1f} m/s)",
            f"a boat speed of {speed_mps[i, j] / MPS_PER_KNOT:.1f} kn ({speed_mps[i, j]:.1f} m/s) is more than "
            f"{MOST_TIMES:g} times the wind",
            "are its columns shifted, or knots and m/s mixed?",
        )


def polar_of_table(
    twa_deg: ArrayLike, tws_mps: ArrayLike, speed_mps: Sequence[Sequence[float]], *, name: str, source: str
) -> Polar:
    """Return the polar of a boat file's table. Raises InputError where it is none."""
    remedy = "speed_mps has a row for each of twa_deg, with a speed for each of tws_mps"
    if len({len(row) for row in speed_mps}) > 1:
        raise InputError(source, "[polar]", "its rows are not of one length", remedy)
    try:
        polar = Polar(
            twa_rad=np.radians(np.asarray(twa_deg)),
            tws_mps=np.asarray(tws_mps),
            speed_mps_table=np.asarray(speed_mps),
            name=name,
        )
    except ValueError as error:
        raise InputError(source, "[polar]", str(error), remedy) from None
    _check_speeds(np.degrees(polar.twa_rad), polar.tws_mps, polar.speed_mps_table, source)
    return polar


def pol_text(polar: Polar, share: float = 1.0) -> str:
    """Return a polar in knots, as ``read_polar`` and OpenCPN take it, its speeds times ``share``."""
    winds = [w for w in polar.tws_mps.tolist() if w > 0.0] or [5.0]
    lines = ["TWA\\TWS;" + ";".join(f"{w / MPS_PER_KNOT:.2f}" for w in winds)]
    for angle in polar.twa_rad.tolist():
        speeds = (share * polar.speed_mps(angle, w) / MPS_PER_KNOT for w in winds)
        lines.append(f"{math.degrees(angle):g};" + ";".join(f"{v:.2f}" for v in speeds))
    return "\n".join(lines) + "\n"


# ------------------------------------------------------------------------------------------- cells
def _separator(line: str) -> str | None:
    for candidate in (";", "\t", ","):
        if candidate in line:
            return candidate
    return None


def _cells(line: str, separator: str | None = "?") -> list[str]:
    if separator == "?":
        separator = _separator(line)
    if separator is None:
        return line.split()
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    if separator != ",":
        cells = [re.sub(r"^([+-]?\d*),(\d+)", r"\1.\2", cell) for cell in cells]
    return cells


def _is_numeric_row(line: str) -> bool:
    cells = [cell.split(":")[0] for cell in _cells(line)]
    return bool(_NUMBER.match(cells[0])) and all(not cell or _NUMBER.match(cell) for cell in cells)


def _find_header(lines: list[tuple[int, str]]) -> int | None:
    for i, (_, line) in enumerate(lines[:20]):
        cells = _cells(line)
        if len(cells) >= 2 and _HEADER.match(cells[0]):
            return i
        # "TWA TWS 4 6 8" or "twa / tws 4 6": the token itself was split by spaces.
        if re.match(r"^twa\s*[/\\ ]\s*tws\b", line, re.IGNORECASE) and _separator(line) is None:
            return i
    return None


def _number(cell: str, source: str, line: int, column: int, what: str) -> float:
    if not _NUMBER.match(cell):
        raise InputError(source, f"line {line}, column {column}", f"{cell!r} is not a {what}", "write a plain number")
    return float(cell)


# -------------------------------------------------------------------------------------------- grid
def _parse_grid(lines: list[tuple[int, str]], source: str) -> PolarFile:
    warnings: list[str] = []
    header_number, header = lines[0]
    separator = _separator(header)
    if separator is None:
        header = re.sub(r"^twa\s*[/\\ ]\s*tws", "twa", header, flags=re.IGNORECASE)
    cells = _cells(header, separator)[1:]
    while cells and not cells[-1]:
        cells.pop()
    tws_kn = [_number(cell, source, header_number, i, "wind speed") for i, cell in enumerate(cells, start=2)]
    if not tws_kn:
        raise InputError(source, f"line {header_number}", "no wind speeds", "start with a line like TWA\\TWS;4;6;8")
    for i, (low, high) in enumerate(pairwise(tws_kn), start=3):
        if not high > low:
            raise InputError(
                source,
                f"line {header_number}, column {i}",
                f"wind speed {high:g} kn after {low:g} kn",
                "wind speeds must increase",
            )
    if tws_kn[0] < 0.0 or tws_kn[-1] > MAX_TWS_KN:
        raise InputError(
            source,
            f"line {header_number}",
            f"wind speeds {tws_kn[0]:g}..{tws_kn[-1]:g} kn",
            f"they must be within 0..{MAX_TWS_KN:g} kn",
        )
    twa_deg: list[float] = []
    rows: list[list[float]] = []
    for number, line in lines[1:]:
        row = _cells(line, separator)
        if _EXTRA_ROW.match(row[0]):
            warnings.append(f"line {number}: row {row[0]!r} is not used")
            continue
        angle = _number(row[0], source, number, 1, "wind angle")
        if not 0.0 <= angle <= 180.0:
            raise InputError(source, f"line {number}", f"wind angle {angle:g} degrees", "angles run from 0 to 180")
        if twa_deg and angle <= twa_deg[-1]:
            raise InputError(
                source,
                f"line {number}",
                f"wind angle {angle:g} after {twa_deg[-1]:g} degrees",
                "angles must increase from row to row",
            )
        values = row[1:]
        while len(values) > len(tws_kn) and not values[-1]:
            values.pop()
        if len(values) != len(tws_kn):
            warnings.append(f"line {number}: {len(values)} speeds for {len(tws_kn)} winds")
        values = (values + [""] * len(tws_kn))[: len(tws_kn)]
        twa_deg.append(angle)
        # Before the first speed, or under no wind, a boat that does not sail; elsewhere a gap in the file.
        is_head = all(value == 0.0 for known in rows for value in known) and all(cell == "0" for cell in values)
        rows.append(
            [
                0.0 if cell == "0" and (is_head or wind_kn == 0.0) else _speed(cell, source, number, i, warnings)
                for i, (cell, wind_kn) in enumerate(zip(values, tws_kn, strict=True), start=2)
            ]
        )
    if not rows:
        raise InputError(source, f"line {header_number}", "no rows of boat speeds", "add rows like 45;2.1;3.0;3.6")
    return _finish(np.array(twa_deg), np.array(tws_kn), np.array(rows, dtype=np.float64), source, warnings)


def _speed(cell: str, source: str, line: int, column: int, warnings: list[str]) -> float:
    """Return the boat speed [kn]; NaN when it is not known."""
    text = cell.split(":", maxsplit=1)[0].strip()  # "1.9:1" names a sail after the speed
    if not text or text in {"-", "--"}:
        return math.nan
    if text == "0":
        warnings.append(f"line {line}, column {column}: a bare 0 is taken as not known; write 0.0 for 'cannot sail'")
        return math.nan
    value = _number(text, source, line, column, "boat speed")
    if value < 0.0 or value > MAX_SPEED_KN:
        raise InputError(
            source,
            f"line {line}, column {column}",
            f"boat speed {value:g} kn",
            f"speeds are within 0..{MAX_SPEED_KN:g} kn",
        )
    return value if value >= MIN_SPEED_KN else 0.0


def _finish(
    twa_deg: NDArray[np.float64],
    tws_kn: NDArray[np.float64],
    speed_kn: NDArray[np.float64],
    source: str,
    warnings: list[str],
) -> PolarFile:
    if not bool(np.any(np.isfinite(speed_kn))):
        raise InputError(source, "", "holds no boat speed at all", "fill in the table")
    _check_speeds(twa_deg, tws_kn * MPS_PER_KNOT, speed_kn * MPS_PER_KNOT, source)
    filled = speed_kn.copy()
    for i in range(twa_deg.size):  # between two known winds of the same row
        known = np.flatnonzero(np.isfinite(speed_kn[i]))
        if known.size >= 2:
            inside = slice(known[0], known[-1] + 1)
            filled[i, inside] = np.interp(tws_kn[inside], tws_kn[known], speed_kn[i, known])
    known_columns = [j for j in range(tws_kn.size) if bool(np.any(np.isfinite(filled[:, j])))]
    for j in known_columns:  # then along the angle
        known = np.flatnonzero(np.isfinite(filled[:, j]))
        filled[:, j] = _along(twa_deg, twa_deg[known], filled[known, j])
    for i in range(twa_deg.size):  # then along the wind: nothing at no wind, above the last known column no more
        x, y = tws_kn[known_columns], filled[i, known_columns]
        if x[0] > 0.0:
            x, y = np.concatenate([[0.0], x]), np.concatenate([[0.0], y])
        filled[i, :] = np.interp(tws_kn, x, y)
    if not bool(np.any(filled > 0.0)):
        warnings.append("the boat cannot sail at any angle in any wind")
    if bool(np.any(np.diff(np.max(filled, axis=0)) < 0.0)):
        warnings.append("the boat gets slower as the wind rises")
    polar = Polar(
        twa_rad=np.minimum(np.radians(twa_deg), math.pi),
        tws_mps=tws_kn * MPS_PER_KNOT,
        speed_mps_table=filled * MPS_PER_KNOT,
        name=Path(source).stem,
    )
    return PolarFile(polar=polar, warnings=tuple(warnings))


# ------------------------------------------------------------------------------------------- pairs
def _parse_pairs(lines: list[tuple[int, str]], source: str) -> PolarFile | None:
    """Read Expedition's form: one row per wind speed, then pairs of angle and speed, in either order."""
    rows: list[tuple[int, list[float]]] = []
    for number, line in lines:
        if not _is_numeric_row(line):
            return None
        cells = _cells(line)
        while cells and not cells[-1]:
            cells.pop()
        if len(cells) < 5 or len(cells) % 2 == 0 or not all(_NUMBER.match(cell) for cell in cells):
            return None
        rows.append((number, [float(cell) for cell in cells]))
    first, second = rows[0][1][1::2], rows[0][1][2::2]
    angles_first, angles_second = _looks_like_angles(first), _looks_like_angles(second)
    if rows[0][1][0] == 0.0 and rows[0][1][1] < 60.0 and not angles_first and not angles_second:
        return None
    if not angles_first and not angles_second:
        return None
    angle_at = 1 if angles_first and (not angles_second or max(first) >= max(second)) else 2
    winds: list[float] = []
    columns: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for number, values in rows:
        if not 0.0 <= values[0] <= MAX_TWS_KN or (winds and values[0] <= winds[-1]):
            raise InputError(source, f"line {number}", f"wind speed {values[0]:g} kn", "wind speeds must increase")
        angles = np.array(values[angle_at::2])
        speeds = np.array(values[3 - angle_at :: 2])
        if bool(np.any(np.diff(angles) <= 0.0)) or angles[0] < 0.0 or angles[-1] > 180.0:
            raise InputError(
                source,
                f"line {number}",
                "wind angles do not increase within 0..180 degrees",
                "write TWS, then pairs of angle and speed",
            )
        if bool(np.any(speeds < 0.0)) or bool(np.any(speeds > MAX_SPEED_KN)):
            raise InputError(
                source, f"line {number}", "a boat speed is out of range", f"speeds are within 0..{MAX_SPEED_KN:g} kn"
            )
        winds.append(values[0])
        columns.append((angles, np.where(speeds >= MIN_SPEED_KN, speeds, 0.0)))
    twa_deg = distinct(np.concatenate([angles for angles, _ in columns]))
    table = np.empty((twa_deg.size, len(winds)))
    for j, (angles, speeds) in enumerate(columns):
        table[:, j] = _along(twa_deg, angles, speeds)
    return _finish(twa_deg, np.array(winds), table, source, [])


def _along(twa_deg: Floats, known_deg: Floats, speed: Floats) -> Floats:
    """Return speeds at angles by those at known ones: head to wind a boat stands, beyond the last as ``_beyond``."""
    if known_deg[0] > 0.0:
        known_deg, speed = np.r_[0.0, known_deg], np.r_[0.0, speed]
    if known_deg[-1] < 180.0:
        deeper, share = _beyond(math.radians(known_deg[-1]))
        known_deg, speed = np.r_[known_deg, np.degrees(deeper)], np.r_[speed, share * speed[-1]]
    return np.asarray(np.interp(twa_deg, known_deg, speed))


def _looks_like_angles(values: list[float]) -> bool:
    return max(values) >= 90.0 and max(values) <= 180.0 and all(b > a for a, b in pairwise(values))

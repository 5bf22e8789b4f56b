"""The policy's solver against an independent one: the four cases of Wang and others (arXiv 2309.13436).

    python -m bench.policy                          some minutes; exit code 1 where a value is more than 2 % off
    python -m bench.policy --plot boundaries.png    where either tacks

A boat sails to a target of radius 0.1 in a disc of radius 2.0; a tack takes 2.0, the fastest speed is 0.05 (units of
the paper), the wind's direction drifts and diffuses. By symmetry two numbers and the tack are the state: the distance
to the target, and the angle from the bearing of the target to where the wind comes from. That is what is solved here,
on a fine grid (semi-Lagrangian, the wind's change by two points of its spread); ``companion.planner.policy`` solves the
same as any water: places east and north by shifts all round. The polar is a 40-foot cruiser's in 8 knots of
wind, of which the angles that are told are sailed.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.kernels.jit import kernel
from companion.planner import Problem
from companion.planner.policy import PORT, Policy, Shifts, solve
from companion.program.arguments import picture
from sitl.results import markdown

Floats = NDArray[np.float64]

CASES = ((0.0, 0.0), (0.0, 0.1), (0.05, 0.05), (0.15, 0.05))
"""Drift [rad/s] and spread [rad per root second] of the wind's direction."""
TARGET, RIM, TACK_COST, FASTEST = 0.1, 2.0, 2.0, 0.05
TWA_DEG = (5, 10, 15, 20, 25, 32, 36, 40, 45, 52, 60, 70, 80, 90, 100, 110, 120, 130, 140, 150, 160, 170, 180)
KNOTS = (
    *(0.6, 1.2, 1.8, 2.1, 2.5, 4.1, 4.6, 5.0, 5.4, 5.8, 6.2, 6.4),
    *(6.5, 6.5, 6.5, 6.4, 6.2, 5.7, 5.2, 4.7, 4.2, 3.9, 3.6),
)
AT = (1.8, 1.2, 0.6)
"""How far from the target the two are compared, all round."""
ALLOWED = 0.02
UNIT_M = 200.0
"""Metres of a unit, for the solver that wants metres."""
STATES = 90
FAR = 1e6


def speeds() -> Floats:
    """Return the speeds at ``TWA_DEG``, the fastest 0.05."""
    return FASTEST * np.array(KNOTS) / max(KNOTS)


# -------------------------------------------------------------------------------- the reduced problem
@dataclass(frozen=True, slots=True, kw_only=True)
class Reduced:
    """Values and switches over distance and angle: (distances, angles, 2); the wind is on the port side first."""

    distance: Floats
    angle_rad: Floats
    values: Floats
    tacks: NDArray[np.bool_]

    def around(self, distance: float) -> Floats:
        """Return (angles, 2) the values at a distance."""
        place = (distance - self.distance[0]) / (self.distance[1] - self.distance[0])
        low = min(int(place), len(self.distance) - 2)
        share = place - low
        return np.asarray((1.0 - share) * self.values[low] + share * self.values[low + 1])


@kernel
def _at(values: Floats, row: float, column: float, tack: int) -> float:
    rows, columns = values.shape[0], values.shape[1]
    if row < 0.0:
        return 0.0
    if row > rows - 1.0:
        return FAR
    r = min(int(row), rows - 2)
    whole = math.floor(column)
    f, g = row - r, column - whole
    c = int(whole) % columns
    d = (c + 1) % columns
    near = (1.0 - g) * values[r, c, tack] + g * values[r, d, tack]
    far = (1.0 - g) * values[r + 1, c, tack] + g * values[r + 1, d, tack]
    return float((1.0 - f) * near + f * far)


@kernel
def _round(
    values: Floats,
    tacks: NDArray[np.bool_],
    first: float,
    across: float,
    turn: float,
    twa: Floats,
    speed: Floats,
    drift: float,
    spread: float,
) -> float:
    """Go once outwards over the grid; return the largest change."""
    rows, columns = values.shape[0], values.shape[1]
    largest = 0.0
    for r in range(1, rows):
        distance = first + r * across
        for c in range(columns):
            for tack in range(2):
                side = 1.0 if tack == 0 else -1.0
                least = FAR
                for a in range(twa.shape[0]):
                    off = c * turn + side * twa[a]  # from the target's bearing to the course
                    closing, turning = -speed[a] * math.cos(off), speed[a] * math.sin(off) / distance + drift
                    step = 1.5 * across / max(abs(closing), 0.05 * speed[a])
                    step = min(step, 3.0 * turn / (abs(turning) + 1e-9))
                    row, column = r + closing * step / across, c + turning * step / turn
                    wide = spread * math.sqrt(step) / turn
                    if row < 0.0:
                        time = -r * across / closing
                    elif spread > 0.0:
                        time = step + 0.5 * (
                            _at(values, row, column - wide, tack) + _at(values, row, column + wide, tack)
                        )
                    else:
                        time = step + _at(values, row, column, tack)
                    least = min(least, time)
                middle, wide = c + drift * TACK_COST / turn, spread * math.sqrt(3.0 * TACK_COST) / turn
                other = 2.0 / 3.0 * _at(values, r, middle, 1 - tack) + 1.0 / 6.0 * (
                    _at(values, r, middle - wide, 1 - tack) + _at(values, r, middle + wide, 1 - tack)
                )
                tacks[r, c, tack] = TACK_COST + other < least
                least = min(least, TACK_COST + other)
                largest = max(largest, abs(least - values[r, c, tack]))
                values[r, c, tack] = least
    return largest


def reduced(drift: float, spread: float, *, rows: int = 761, columns: int = 720) -> Reduced:
    """Solve the reduced problem."""
    values = np.full((rows, columns, 2), FAR)
    values[0] = 0.0
    tacks = np.zeros(values.shape, dtype=np.bool_)
    across, turn = (RIM - TARGET) / (rows - 1), 2.0 * math.pi / columns
    twa, speed = np.radians(np.array(TWA_DEG, dtype=float)), speeds()
    for _ in range(2000):
        if _round(values, tacks, TARGET, across, turn, twa, speed, drift, spread) < 1e-3:
            break
    return Reduced(
        distance=TARGET + across * np.arange(rows, dtype=np.float64),
        angle_rad=turn * np.arange(columns, dtype=np.float64),
        values=values,
        tacks=tacks,
    )


# --------------------------------------------------------------------------------- the same as a water
def all_round(drift: float, spread: float) -> Shifts:
    """Return the wind's process on the circle, its mean and variance after any time exact."""
    turn = 2.0 * math.pi / STATES

    def after(seconds: float) -> Floats:
        mean, variance = drift * seconds / turn, spread * spread * seconds / (turn * turn)
        parts = max(1, math.ceil(variance + 0.25))
        mean, variance = mean / parts, variance / parts
        whole = round(mean)
        off = mean - whole
        square = max(variance + off * off, abs(off))  # less cannot be on a grid: it spreads by itself
        part = np.zeros((STATES, STATES))
        for n in range(STATES):
            for step, chance in ((-1, 0.5 * (square - off)), (0, 1.0 - square), (1, 0.5 * (square + off))):
                part[n, (n + whole + step) % STATES] += chance
        return np.asarray(np.linalg.matrix_power(part, parts))

    return Shifts(shift_rad=turn * np.arange(STATES, dtype=np.float64), after=after)


def as_water(drift: float, spread: float, *, cell: float) -> Policy:
    """Return the policy of the same problem, sailed northwards from the rim; ``cell`` is in units of the paper."""
    problem = Problem.from_json(
        {
            "id": "disc",
            "start": {"x": 0.0, "y": -RIM * UNIT_M + 1.0, "heading_deg": 0.0},
            "goal": {"x": 0.0, "y": 0.0, "radius": TARGET * UNIT_M},
            "obstacles": [],
            "fence": shapely.Point(0.0, 0.0).buffer(RIM * UNIT_M, quad_segs=64).wkt,
            "wind": {"from_deg": 0.0, "speed_mps": 4.1, "sigma": {"model": "none"}},
            "boat": {
                "no_go_half_deg": TWA_DEG[0],
                "max_twa_deg": TWA_DEG[-1],
                "turn_rate_rad_s": 2.0 * math.radians(TWA_DEG[0]) / TACK_COST,  # a tack takes its cost, turning
                "speed": {"model": "polar", "twa_deg": [0, *TWA_DEG], "v_mps": [0.0, *(UNIT_M * speeds()).tolist()]},
            },
            "delta_s": 0.5,
        }
    )
    return solve(
        problem, all_round(drift, spread), cell_m=cell * UNIT_M, angle_rad=np.radians(np.array(TWA_DEG, dtype=float))
    )


def compared(truth: Reduced, policy: Policy) -> list[tuple[float, float, float, float]]:
    """Return (distance, mean value, mean and largest share that the policy's is off) over all angles and tacks."""
    rows = []
    for distance in AT:
        wanted = np.array(
            [np.interp(policy.shifts.shift_rad, truth.angle_rad, truth.around(distance)[:, tack]) for tack in range(2)]
        )
        here = (0.0, -distance * UNIT_M)
        found = np.array(
            [[policy.time_to_go_s(here, float(s), tack) for s in policy.shifts.shift_rad] for tack in range(2)]
        )
        off = found / wanted - 1.0
        rows.append((distance, float(wanted.mean()), float(off.mean()), float(np.abs(off).max())))
    return rows


def save_boundaries(path: Path, solved: Sequence[tuple[tuple[float, float], Reduced, Policy]]) -> None:
    """Draw where either solver tacks off port tack, about the target with the wind from above."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, len(solved), figsize=(3.2 * len(solved), 6.6), subplot_kw={"aspect": "equal"})
    for column, ((drift, spread), truth, policy) in enumerate(solved):
        chart, turn = policy.chart, policy.shifts.shift_rad[1]
        distance = np.linspace(TARGET, 0.97 * RIM, 160)
        angle = policy.shifts.shift_rad
        mine = np.zeros((len(distance), len(angle)))
        tacks = [policy.tacks_at_once(PORT, shift) for shift in range(len(angle))]
        for i, d in enumerate(distance):
            row, place = (round(x) for x in chart.cells((0.0, -d * UNIT_M)))
            mine[i] = [given_up[row, place] for given_up in tacks]
        wide = truth.tacks[:, :: len(truth.angle_rad) // len(angle), 0]
        for axis, at, grid, name in (
            (axes[0, column], truth.distance, wide, "reduced"),
            (axes[1, column], distance, mine, "as a water"),
        ):
            # She lies at angle theta from dead to leeward of the target, the wind from above.
            theta = np.append(angle, 2.0 * math.pi) - 0.5 * turn
            edges = np.append(at, at[-1] + at[1] - at[0])
            axis.pcolormesh(
                np.outer(edges, np.sin(theta)), -np.outer(edges, np.cos(theta)), grid, cmap="Blues", vmin=0, vmax=1.6
            )
            axis.plot(0.0, 0.0, "r.")
            axis.set_title(f"{name}: drift {drift:g}, spread {spread:g}", fontsize=8)
            axis.tick_params(labelsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main(argv: Sequence[str] | None = None) -> int:
    """Solve the cases by both."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.policy", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cell", type=float, default=0.011, metavar="UNITS", help="of the water's grid (0.011)")
    parser.add_argument("--plot", type=picture, metavar="FILE", help="draw where either tacks")
    args = parser.parse_args(argv)
    rows, solved, is_good = [], [], True
    for drift, spread in CASES:
        truth, policy = reduced(drift, spread), as_water(drift, spread, cell=args.cell)
        solved.append(((drift, spread), truth, policy))
        for distance, value, mean, most in compared(truth, policy):
            rows.append(
                [
                    f"{drift:g}, {spread:g}",
                    f"{distance:g}",
                    f"{value:.2f}",
                    f"{100.0 * mean:+.2f} %",
                    f"{100.0 * most:.2f} %",
                    f"{policy.took_s:.0f}",
                ]
            )
            is_good &= most <= ALLOWED
    print(markdown(("drift, spread", "distance", "time to go", "off, mean", "off, most", "CPU s"), rows))
    if args.plot is not None:
        save_boundaries(args.plot, solved)
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())

"""Fit the default forecaster's few constants to recorded wind, and say what the fit is worth.

    python -m lab.wind_fit FOLDER [--leave-one-out] [--evaluations N]

FOLDER holds CSV records (``records.parse_csv``). Six numbers are found by minimising the mean circular CRPS over all
horizons, relative to the starting constants, on the records and (with a third of the weight) on simulated
equation 17, so that no constant may serve the records at the expense of a process whose answer is known; two for the
speed by its CRPS; the expected errors and the tails are read off. ``--leave-one-out`` fits once per record without it
and scores that record: the figure to expect on other days.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import erf

from companion.errors import InputError
from companion.wind.estimators import CONSTANTS, SIGMA_MAX_RAD, normal_half_width
from companion.wind.estimators import forecaster_kernels as kernel
from companion.wind.study import FEWEST, SCORED_HORIZONS_S, SCORED_LEVELS, Record, asked_rows, parse_csv, targets
from lab.simulated_wind import equation_17

Array = NDArray[np.float64]

_Z = np.array([normal_half_width(float(p)) for p in kernel.QUANTILE_P])
_ZP = np.array([normal_half_width(p) for p in SCORED_LEVELS])
_ODD = np.arange(1, 60, 2, dtype=np.float64)[:, None]
_SIMULATED_WEIGHT = 0.35

# Where every fit starts: round numbers that no record has influenced.
NEUTRAL = CONSTANTS._replace(
    survival=np.array([3.0, 1.0]),
    speed_survival=np.array([3.0, 1.0]),
    sigma=np.array([0.22, 0.0, 0.3, -0.3, 1500.0]),
    error=np.array([0.2, 0.25]),
    speed_error=np.array([0.1, 0.25]),
    quantile=np.array([normal_half_width(float(p)) for p in kernel.QUANTILE_P]),
)


class Prepared:
    """A record with its forecast times and targets worked out once."""

    def __init__(self, record: Record) -> None:
        self.name = record.name
        self.t_s = record.t_s - record.t_s[0]
        self.x = (record.twd_from_rad - record.twd_from_rad[0] + math.pi) % (2.0 * math.pi) - math.pi
        self.speed = record.tws_mps
        rows = asked_rows(record)
        self.ask = np.zeros(len(record), dtype=np.bool_)
        self.ask[rows] = True
        self.target = [targets(record, h, rows) for h in SCORED_HORIZONS_S]

    def errors(self, constants: kernel.Constants) -> list[tuple[Array, Array, Array, Array, Array]]:
        """Return per horizon: direction error, sigma, speed error, its sigma, half widths (n, levels)."""
        state = kernel.new_state(constants)
        prior = state.quantile.copy()
        out = kernel.replay(
            state, constants, prior, self.t_s, self.x, self.speed, self.ask, np.array(SCORED_HORIZONS_S), _Z, _ZP
        )
        found = []
        for a in range(len(SCORED_HORIZONS_S)):
            good = self.target[a] >= 0
            row, o = self.target[a][good], out[good, a]
            error = (self.x[row] - o[:, 0] + math.pi) % (2.0 * math.pi) - math.pi
            sigma = np.clip(o[:, 1], 1e-4, SIGMA_MAX_RAD)
            speed_error, speed_sigma = self.speed[row] - o[:, 2], np.maximum(o[:, 3], 1e-3)
            found.append((error, sigma, speed_error, speed_sigma, o[:, 4:] * sigma[:, None]))
        return found


def crps_normal(error: Array, sigma: Array) -> Array:
    """Return the Gaussian CRPS of each error."""
    z = error / sigma
    pdf = np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return np.asarray(sigma * (z * erf(z / math.sqrt(2.0)) + 2.0 * pdf - 1.0 / math.sqrt(math.pi)))


def crps_circular(error: Array, sigma: Array) -> Array:
    """Return the circular CRPS of each error (``score.crps_circular`` for arrays)."""
    found = crps_normal(error, sigma)
    wide = np.abs(error) + 5.0 * sigma >= math.pi
    if np.any(wide):
        e = np.exp(-0.5 * _ODD**2 * sigma[wide] ** 2)
        near = np.sum(e * np.cos(_ODD * error[wide]) / _ODD**2, axis=0)
        apart = np.sum(e * e / _ODD**2, axis=0)
        found[wide] = (math.pi / 2 - 4 / math.pi * near) - 0.5 * (math.pi / 2 - 4 / math.pi * apart)
    return found


def figures(constants: kernel.Constants, prepared: Sequence[Prepared]) -> Array:
    """Return (records, horizons, 7): CRPS [rad], three coverages, speed CRPS, mean |error|, speed mean |error|."""
    table = np.full((len(prepared), len(SCORED_HORIZONS_S), 7), np.nan)
    for i, p in enumerate(prepared):
        for a, (error, sigma, speed_error, speed_sigma, half) in enumerate(p.errors(constants)):
            if error.size >= FEWEST:
                table[i, a] = (
                    np.mean(crps_circular(error, sigma)),
                    *np.mean(np.abs(error)[:, None] <= np.minimum(half, math.pi), axis=0),
                    np.mean(crps_normal(speed_error, speed_sigma)),
                    np.mean(np.abs(error)),
                    np.mean(np.abs(speed_error)),
                )
    return table


def _simplex(start: Array, steps: Sequence[float], objective: Callable[[Array], float], evaluations: int) -> Array:
    simplex = np.vstack([start, start + np.diag(steps)])
    options = {"maxfev": evaluations, "initial_simplex": simplex, "adaptive": True, "xatol": 1e-3, "fatol": 1e-5}
    return np.asarray(minimize(objective, start, method="Nelder-Mead", options=options).x)


def fit(
    prepared: Sequence[Prepared],
    simulated: Sequence[Prepared],
    *,
    start: kernel.Constants = NEUTRAL,
    evaluations: int = 150,
) -> kernel.Constants:
    """Return the constants fitted to ``prepared`` (and, lightly, to ``simulated``)."""
    # Expected errors: a power law in the horizon through the records' mean |error|.
    table = np.nanmean(figures(start, prepared), axis=0)
    log_h = np.log(np.array(SCORED_HORIZONS_S) / 60.0)
    slope, level = np.polyfit(log_h, np.log(table[:, 5]), 1)
    speed_slope, speed_level = np.polyfit(log_h, np.log(table[:, 6]), 1)
    wind = float(np.mean([max(2.0, float(np.mean(p.speed))) for p in prepared]))
    start = start._replace(
        error=np.array([math.exp(level), slope]), speed_error=np.array([math.exp(speed_level) / wind, speed_slope])
    )
    unit, unit_simulated = table[:, 0], np.nanmean(figures(start, simulated), axis=0)[:, 0]

    def unpack(th: Array) -> kernel.Constants:
        return start._replace(
            survival=np.array([math.exp(th[0]), max(0.05, th[1])]), sigma=np.array([*th[2:6], start.sigma[4]])
        )

    def objective(th: Array) -> float:
        con = unpack(th)
        here = np.nanmean(figures(con, prepared), axis=0)[:, 0] / unit
        there = np.nanmean(figures(con, simulated), axis=0)[:, 0] / unit_simulated
        return float(np.mean(here) + _SIMULATED_WEIGHT * np.mean(there))

    first = np.array([math.log(start.survival[0]), start.survival[1], *start.sigma[:4]])
    con = unpack(_simplex(first, (0.3, 0.1, 0.1, 0.05, 0.1, 0.15), objective, evaluations))

    def speed(th: Array) -> kernel.Constants:
        return con._replace(speed_survival=np.array([math.exp(th[0]), max(0.05, th[1])]))

    def speed_objective(th: Array) -> float:
        return float(np.mean(np.nanmean(figures(speed(th), prepared), axis=0)[:, 4]))

    first = np.array([math.log(con.speed_survival[0]), con.speed_survival[1]])
    con = speed(_simplex(first, (0.3, 0.1), speed_objective, max(20, evaluations // 5)))
    return con._replace(quantile=_tails(con, prepared))


def _tails(constants: kernel.Constants, prepared: Sequence[Prepared]) -> Array:
    """Return the quantiles of |error| / sigma, every record and horizon with the same weight."""
    z, w = [], []
    for p in prepared:
        for error, sigma, _, _, _ in p.errors(constants):
            if error.size >= FEWEST:
                z.append(np.abs(error) / sigma)
                w.append(np.full(error.size, 1.0 / error.size))
    value, weight = np.concatenate(z), np.concatenate(w)
    order = np.argsort(value)
    cumulated = np.cumsum(weight[order]) / np.sum(weight)
    found = np.interp(kernel.QUANTILE_P, cumulated, value[order])
    found[0] = 0.0
    return np.asarray(np.minimum(found, kernel.Z_MAX))


def _report(title: str, table: Array) -> str:
    mean = np.nanmean(table, axis=0)
    lines = [title, "  horizon s     " + " ".join(f"{h:7.0f}" for h in SCORED_HORIZONS_S)]
    lines.append("  CRPS deg      " + " ".join(f"{math.degrees(v):7.2f}" for v in mean[:, 0]))
    lines.append("  MAE deg       " + " ".join(f"{math.degrees(v):7.2f}" for v in mean[:, 5]))
    lines.extend(
        f"  within {100 * p:.0f} %   " + " ".join(f"{100 * v:7.1f}" for v in mean[:, 1 + i])
        for i, p in enumerate(SCORED_LEVELS)
    )
    lines.append("  least 95 %    " + " ".join(f"{100 * v:7.1f}" for v in np.nanmin(table[:, :, 3], axis=0)))
    lines.append("  speed CRPS    " + " ".join(f"{v:7.3f}" for v in mean[:, 4]))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the fit and print it."""
    parser = argparse.ArgumentParser(prog="python -m lab.wind_fit", description="Fit the forecaster's constants.")
    parser.add_argument("folder", type=Path, help="CSV records")
    parser.add_argument("--leave-one-out", action="store_true", help="also fit without each record and score it")
    parser.add_argument("--evaluations", type=int, default=150, help="of the objective, per fit (default 150)")
    args = parser.parse_args(arguments)
    paths = sorted(args.folder.glob("*.csv"))
    if not paths:
        raise InputError(str(args.folder), "", "no CSV records in it")
    prepared = [Prepared(parse_csv(path.read_text().splitlines(), path.name)) for path in paths]
    simulated = [Prepared(equation_17(900 + i, mean_rad=i * math.pi / 3)) for i in range(6)]
    say = sys.stdout.write
    say(_report("committed constants, recorded", figures(CONSTANTS, prepared)) + "\n")
    say(_report("committed constants, equation 17", figures(CONSTANTS, simulated)) + "\n")
    con = fit(prepared, simulated, evaluations=args.evaluations)
    for name, value in con._asdict().items():
        say(f"{name} = {np.round(value, 4).tolist()}\n")
    say(_report("fitted, recorded (in sample)", figures(con, prepared)) + "\n")
    say(_report("fitted, equation 17", figures(con, simulated)) + "\n")
    if args.leave_one_out:
        held = []
        for i, p in enumerate(prepared):
            others = [q for k, q in enumerate(prepared) if k != i]
            con = fit(others, simulated, evaluations=args.evaluations)
            held.append(figures(con, [p])[0])
            fitted = (np.round(con.survival, 3).tolist(), np.round(con.sigma, 3).tolist())
            say(f"without {p.name}: survival {fitted[0]} sigma {fitted[1]}\n")
            sys.stdout.flush()
        say(_report("leave one record out", np.array(held)) + "\n")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InputError as error:
        sys.exit(f"lab.wind_fit: {error}")

"""How well real boats are learned: speeds of days not learned from, against what others make of the same logs.

    python -m lab.boat_scores LOG... --length 10 --displacement 3500 --sail-area 65

Each day of the logs is left out by turns. Of every stretch of steady sailing in it the speed is foretold, in the wind
that its own sensors tell, by the boat that is learned from the other days, by the guess alone, and by what the table of
cells of 2 kn and 5 degrees says (OpenCPN's polar_pi): the mean, the most and the 90 % quantile of each. What a cell
without a sample says is the guess. Speeds are over the ground: logs of tidal water are not to be scored so.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar, Sizes
from companion.boat.guess import guessed_polar
from companion.boat.learn import STEEPEST, TWA_DEG, TWS_MPS, LearnedBoat, learn
from companion.boat.log import Stretches, stretches_of
from companion.boat_logs import logs_under, read_logs
from companion.geo import MPS_PER_KNOT
from companion.geo.angles import wrap_pi_array

Floats = NDArray[np.float64]

PRIOR_ERROR = 0.35
DAY_S = 86_400.0
CELL_MPS, CELL_DEG = 2.0 * MPS_PER_KNOT, 5.0
LEAST_SD = 0.02  # of a cell's own spread (logarithm): one sample has none
LEVELS = (0.80, 0.95)


@dataclass(frozen=True, slots=True, kw_only=True)
class Foretold:
    """Of stretches: logarithm of the speed in the mean, and its deviation; 0: only a number is foretold."""

    log_mps: Floats
    sd: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Winds:
    """Of stretches: the true wind's angle (starboard positive) and speed, and the speed made good over the ground."""

    twa_rad: Floats
    tws_mps: Floats
    made_mps: Floats


def winds_of(s: Stretches, vane_rad: float = 0.0) -> Winds:
    """Return the winds over the ground, by a vane that is off by so much."""
    angle = s.heading_rad + s.awa_rad - vane_rad
    wind = s.aws_mps[:, None] * np.column_stack([np.sin(angle), np.cos(angle)]) - s.velocity_en_mps
    twa = wrap_pi_array(np.arctan2(wind[:, 0], wind[:, 1]) - s.heading_rad)
    return Winds(twa_rad=twa, tws_mps=np.hypot(*wind.T), made_mps=np.hypot(*s.velocity_en_mps.T))


def part_of(s: Stretches, of: NDArray[np.bool_]) -> Stretches:
    """Return some of the stretches, their outings counted anew."""
    outings, outing = np.unique(s.outing[of], return_inverse=True)
    rest = {n: getattr(s, n)[of] for n in ("t_s", "length_s", "velocity_en_mps", "heading_rad", "awa_rad", "aws_mps")}
    return replace(
        s, **rest, stw_mps=s.stw_mps[of], outing=outing, outing_names=tuple(s.outing_names[o] for o in outings.tolist())
    )


def by_polar(polar: Polar, winds: Winds) -> Floats:
    """Return the logarithm of a polar's speeds in these winds."""
    pairs = zip(winds.twa_rad.tolist(), winds.tws_mps.tolist(), strict=True)
    return np.log(np.maximum([polar.speed_mps(a, w) for a, w in pairs], 0.05))


def by_boat(boat: LearnedBoat, s: Stretches) -> Foretold:
    """Return what a learned boat foretells of stretches, by its vane as it was learned."""
    winds = winds_of(s, boat.vane.mean)
    lean = 0.5 * boat.lean.mean * np.sign(winds.twa_rad) * (1.0 + np.cos(winds.twa_rad))
    error = replace(boat.polar, speed_mps_table=boat.error, name="error")
    off = np.clip(np.abs(winds.twa_rad), math.radians(TWA_DEG[0]), math.pi)
    strong = np.clip(winds.tws_mps, TWS_MPS[0], TWS_MPS[-1])
    sd = np.array([error.speed_mps(a, w) for a, w in zip(off.tolist(), strong.tolist(), strict=True)])
    # One stretch's wind, as the vane tells it, is not the wind that drives her.
    pairs = zip(winds.twa_rad.tolist(), strong.tolist(), strict=True)
    slope = np.array([_steepness(boat.polar, a, w) for a, w in pairs])
    own = np.hypot(boat.noise[0], boat.wind_mps * slope)
    # Over the ground, in a stream that nobody knows beforehand: as strong as those of the outings learned from.
    told = by_polar(boat.polar, winds) + lean
    stream = math.sqrt(float(np.mean([k.mean**2 for pair in boat.currents for k in pair]))) / np.exp(told)
    return Foretold(log_mps=told, sd=np.sqrt(sd**2 + own**2 + stream**2))


def _steepness(polar: Polar, twa_rad: float, tws_mps: float) -> float:
    """Return by what share a polar's speed changes with a m/s of wind."""
    more, less = (max(polar.speed_mps(twa_rad, w), 0.05) for w in (1.1 * tws_mps, tws_mps / 1.1))
    return min(max(math.log(more / less) / math.log(1.21), 0.0), STEEPEST) / tws_mps


def by_cells(train: Winds, asked: Winds, prior: Polar, what: str) -> Foretold:
    """Return what the cells' mean, most or quantile of the logged days foretells."""
    cells: dict[tuple[int, int], list[float]] = defaultdict(list)
    for key, made in zip(_cells(train), train.made_mps.tolist(), strict=True):
        cells[key].append(math.log(max(made, 0.05)))
    known = by_polar(prior, asked)
    sd = np.full(known.shape, PRIOR_ERROR if what == "mean" else 0.0)
    for i, key in enumerate(_cells(asked)):
        if key in cells:
            found = np.array(cells[key])
            known[i] = float(np.mean(found) if what == "mean" else np.quantile(found, 1.0 if what == "most" else 0.9))
            sd[i] = max(float(np.std(found)), LEAST_SD) if what == "mean" else 0.0
    return Foretold(log_mps=known, sd=sd)


def _cells(winds: Winds) -> list[tuple[int, int]]:
    strong = np.floor(winds.tws_mps / CELL_MPS).astype(int).tolist()
    off = np.floor(np.degrees(np.abs(winds.twa_rad)) / CELL_DEG).astype(int).tolist()
    return list(zip(strong, off, strict=True))


def crps(log_mps: Floats, told: Foretold) -> Floats:
    """Return the continuous ranked probability score of each, of the logarithm; of a number alone the error."""
    off = log_mps - told.log_mps
    sd = np.maximum(told.sd, 1e-9)
    z = off / sd
    normal = NormalDist()
    below = np.array([normal.cdf(float(v)) for v in z])
    density = np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    spread = sd * (z * (2.0 * below - 1.0) + 2.0 * density - 1.0 / math.sqrt(math.pi))
    return np.asarray(np.where(told.sd > 0.0, spread, np.abs(off)))


def scored(stretches: Stretches, prior: Polar) -> dict[str, tuple[Floats, Foretold]]:
    """Return by method the logarithms of the speeds of all days, each left out once, and what is foretold of them."""
    days = np.floor(stretches.t_s / DAY_S).astype(int)
    rows: dict[str, list[tuple[Floats, Foretold]]] = defaultdict(list)
    for day in np.unique(days).tolist():
        held, rest = part_of(stretches, days == day), part_of(stretches, days != day)
        boat = learn(rest, prior, PRIOR_ERROR)
        asked, train = winds_of(held), winds_of(rest)
        seen = np.log(np.maximum(asked.made_mps, 0.05))
        guess = by_polar(prior, asked)
        rows["learned"].append((seen, by_boat(boat, held)))
        rows["the guess alone"].append((seen, Foretold(log_mps=guess, sd=np.full(guess.shape, PRIOR_ERROR))))
        for name, what in (("mean of a cell", "mean"), ("most of a cell", "most"), ("90 % of a cell", "quantile")):
            rows[name].append((seen, by_cells(train, asked, prior, what)))
    return {
        name: (
            np.concatenate([seen for seen, _ in parts]),
            Foretold(
                log_mps=np.concatenate([told.log_mps for _, told in parts]),
                sd=np.concatenate([told.sd for _, told in parts]),
            ),
        )
        for name, parts in rows.items()
    }


def table(found: dict[str, tuple[Floats, Foretold]]) -> list[str]:
    """Return the scores as lines."""
    lines = [f"{'':<20}{'error %':>9}{'CRPS %':>9}{'in 80 %':>9}{'in 95 %':>9}"]
    for name, (seen, told) in found.items():
        off = np.abs(seen - told.log_mps)
        cells = [f"{100.0 * float(np.mean(off)):>9.1f}", f"{100.0 * float(np.mean(crps(seen, told))):>9.1f}"]
        for level in LEVELS:
            z = NormalDist().inv_cdf(0.5 + 0.5 * level)
            is_told = bool(np.all(told.sd > 0.0))
            cells.append(f"{100.0 * float(np.mean(off < z * told.sd)):>9.1f}" if is_told else f"{'-':>9}")
        lines.append(f"{name:<20}" + "".join(cells))
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the logs, leave each day out by turns, and print the scores."""
    parser = argparse.ArgumentParser(prog="python -m lab.boat_scores", description="How well a real boat is learned.")
    parser.add_argument("logs", type=Path, nargs="+", metavar="LOG", help="logs, or folders of them, of one boat")
    parser.add_argument("--length", type=float, required=True, metavar="M", help="[m]")
    parser.add_argument("--displacement", type=float, required=True, metavar="KG", help="[kg]")
    parser.add_argument("--sail-area", type=float, required=True, metavar="M2", help="[m2]")
    args = parser.parse_args(arguments)
    say = sys.stdout.write
    sizes = Sizes(length_m=args.length, displacement_kg=args.displacement, sail_area_m2=args.sail_area)
    prior = guessed_polar(sizes)
    read, skipped = read_logs(logs_under(args.logs))
    for left in skipped:
        say(f"skipped {left.name}: {left.why}\n")
    stretches = stretches_of([one.log for one in read], prior, PRIOR_ERROR)
    days = np.unique(np.floor(stretches.t_s / DAY_S)).shape[0]
    if days < 2:
        say("the logs are of one day or none: nothing can be left out\n")
        return 1
    why = ", ".join(f"{n} ({reason.value})" for reason, n in stretches.left_out.most_common())
    say(f"{len(stretches)} stretches of {days} days; left out: {why or 'none'}\n")
    say("\n".join(table(scored(stretches, prior))) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

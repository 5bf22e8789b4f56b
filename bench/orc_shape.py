"""Make companion/boat/data/orc_shape.csv, rated yachts' speeds by their size: ``python -m bench.orc_shape FILE``.

FILE is orc-data.json of github.com/jieter/orc-data at d0bc370b (its code is MIT's, the certificates are the ORC's: it
is not ours to pass on, and not here). By Froude's law two boats of one shape are as fast for the root of g times their
length in a wind that is as strong for it; what is left is fitted by sail area and displacement, in each wind. Half of
the boats are fitted and the others tested, which is printed; the table is of all of them.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.boat.guess import GRAVITY_MPS2, SAIL, WATER_KGPM3, WEIGHT
from companion.geo import MPS_PER_KNOT

Floats = NDArray[np.float64]

OUT = Path(__file__).resolve().parents[1] / "companion" / "boat" / "data" / "orc_shape.csv"
RATED_KN = [4, 6, 8, 10, 12, 14, 16, 20, 24]
RATED_DEG = [52, 60, 75, 90, 110, 120, 135, 150]
ANGLES_DEG = np.array([40.0, 44.0, 52.0, 60.0, 75.0, 90.0, 110.0, 120.0, 135.0, 150.0, 165.0, 180.0])
SAILED = slice(1, 11)  # of those angles: rated, or near it
WINDS = np.array([0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2])  # over the root of g times the length
LEAST_M, LEAST_KG, LEAST_M2 = 4.0, 200.0, 5.0
NEAREST = 0.5  # of the beat's angle: there a boat stands still
BEFORE_WIND_LOSS = 0.05  # of the speed made good, of a run 30 degrees off, when it is sailed dead downwind
HEAD = (
    "# How fast rated yachts are for their size: the geometric mean over {count:,} boats of 5.5 to 28 m, one of each "
    "type and length,\n# of the speeds that their ORC certificates predict (jieter/orc-data at d0bc370b, 2025); speeds "
    "over the root of g times the length.\n"
    "# wind: the true wind's speed so measured; sail, weight: exponents of sail area / length^2 / 0.6 and of\n"
    "# displacement / (1025 kg/m3 length^3) / 0.0042; then the boat's speed at each true wind angle [deg].\n"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rated:
    """Boats (n,): logarithms of sail and weight about the middle, and of speed (n, winds, angles), NaN unrated."""

    sail: Floats
    weight: Floats
    log_speed: Floats


def rated(boats: list[dict[str, Any]]) -> Rated:
    """Return the boats of which a certificate says everything, one of each type and length."""
    rows, seen = [], set()
    for boat in boats:
        sizes, vpp = boat["boat"]["sizes"], boat["vpp"]
        length, weight, sail = sizes["loa"], sizes["displacement"], sizes["main"] + sizes["genoa"]
        kind = (boat["boat"]["type"], round(length, 1))
        is_whole = length > LEAST_M and weight > LEAST_KG and sail > LEAST_M2 and vpp["speeds"] == RATED_KN
        if not is_whole or kind in seen:
            continue
        seen.add(kind)
        speeds = _speeds(vpp)
        if speeds is not None:
            rows.append((length, weight, sail, speeds))
    length, weight, sail = (np.array([row[i] for row in rows], dtype=np.float64) for i in range(3))
    fast = np.sqrt(GRAVITY_MPS2 * length)
    log_speed = np.full((len(rows), WINDS.shape[0], ANGLES_DEG.shape[0]), np.nan)
    for i, row in enumerate(rows):
        winds = np.array(RATED_KN) * MPS_PER_KNOT / fast[i]
        inside = (winds[0] * 0.999 <= WINDS) & (winds[-1] * 1.001 >= WINDS)
        for k in range(ANGLES_DEG.shape[0]):
            speed = np.interp(WINDS[inside], winds, row[3][:, k]) * MPS_PER_KNOT / fast[i]
            log_speed[i, inside, k] = np.log(np.maximum(speed, 1e-3))
    return Rated(
        sail=np.log(sail / length**2 / SAIL),
        weight=np.log(weight / (WATER_KGPM3 * length**3) / WEIGHT),
        log_speed=log_speed,
    )


def _speeds(vpp: dict[str, Any]) -> Floats | None:
    """Return the speeds (winds, angles) [kn] of a certificate; None where it has holes."""
    beat_deg, run_deg = np.array(vpp["beat_angle"], float), np.array(vpp["run_angle"], float)
    table = np.array([vpp[str(angle)] for angle in RATED_DEG], float)
    beat = np.array(vpp["beat_vmg"], float) / np.cos(np.radians(beat_deg))
    run = np.array(vpp["run_vmg"], float) / -np.cos(np.radians(run_deg))
    if not (np.isfinite(table).all() and (table > 0.0).all() and (beat > 0.0).all() and (run > 0.0).all()):
        return None
    out = np.empty((len(RATED_KN), ANGLES_DEG.shape[0]))
    for j in range(len(RATED_KN)):
        first = 0 if beat_deg[j] < RATED_DEG[0] - 1.0 else 1
        angles = [NEAREST * beat_deg[j], beat_deg[j], *RATED_DEG[first:]]
        speeds = [0.0, beat[j], *table[first:, j]]
        if RATED_DEG[-1] + 1.0 < run_deg[j] < 179.0:  # apart from both ends
            angles, speeds = [*angles, run_deg[j]], [*speeds, run[j]]
        loss = BEFORE_WIND_LOSS * max(0.0, 180.0 - run_deg[j]) / 30.0
        angles, speeds = [*angles, 180.0], [*speeds, run[j] * -np.cos(np.radians(run_deg[j])) * (1.0 - loss)]
        order = np.argsort(angles)
        out[j] = np.interp(ANGLES_DEG, np.array(angles)[order], np.array(speeds)[order])
    return out


def fitted(boats: Rated, chosen: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the logarithm of the mean speed (winds, angles) and the exponents of sail and weight (winds, 2)."""
    means, exponents = [], []
    for j in range(WINDS.shape[0]):
        known = chosen & np.isfinite(boats.log_speed[:, j, 0])
        columns = np.column_stack([np.ones(int(known.sum())), boats.sail[known], boats.weight[known]])
        found = np.linalg.lstsq(columns, boats.log_speed[known, j], rcond=None)[0]
        means.append(found[0])
        exponents.append(found[1:, SAILED].mean(axis=1))
    return np.array(means), np.array(exponents)


def tested(boats: Rated) -> tuple[float, float, float]:
    """Return the error of the half that was not fitted: all of it, what is common to a boat's speeds, and the rest."""
    half = np.asarray(np.random.default_rng(0).random(boats.sail.shape[0]) < 0.5)
    means, exponents = fitted(boats, half)
    sail, weight = boats.sail[:, None, None], boats.weight[:, None, None]
    expected = means + sail * exponents[:, 0, None] + weight * exponents[:, 1, None]
    error = (boats.log_speed - expected)[~half][:, :, 1:]
    common = np.nanmean(error, axis=(1, 2))
    rest = error - common[:, None, None]
    return float(np.sqrt(np.nanmean(error**2))), float(np.std(common)), float(np.sqrt(np.nanmean(rest**2)))


def text_of(boats: Rated) -> str:
    """Return the table."""
    means, exponents = fitted(boats, np.ones(boats.sail.shape[0], dtype=np.bool_))
    lines = [HEAD.format(count=boats.sail.shape[0]) + "wind,sail,weight," + ",".join(f"{a:g}" for a in ANGLES_DEG)]
    for wind, (sail, weight), row in zip(WINDS, exponents, np.exp(means), strict=True):
        lines.append(f"{wind:g},{sail:.3f},{weight:.3f}," + ",".join(f"{v:.3f}" for v in row))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Read the certificates, print the error, write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, metavar="FILE", help="orc-data.json")
    parser.add_argument("--out", type=Path, default=OUT, metavar="CSV", help=f"(default: {OUT.name} of the package)")
    args = parser.parse_args()
    boats = rated(json.loads(args.file.read_text(encoding="utf-8")))
    whole, common, rest = tested(boats)
    print(
        f"{boats.sail.shape[0]} boats; of those not fitted the error of the logarithm of speed is {100 * whole:.1f} % "
        f"(root mean square): common to a boat {100 * common:.1f}, of its shape {100 * rest:.1f}"
    )
    args.out.write_text(text_of(boats), encoding="utf-8")
    print(f"{args.out}: written")


if __name__ == "__main__":
    main()

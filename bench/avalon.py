"""Büsser's figures 10, 11 and 3.2, of voyages: paths by his planner up and down wind, and the two means of the wind.

    python -m bench.avalon --out FOLDER [--seed N]

sails the scenario ``by-astar`` as it is and with the wind from behind, and draws ``avalon-voyages.png``: above, the
tracks and first plans among the rocks (11); below, what the vane told, its mean over 5 s that his helm steers by, and
that over 90 s that his planner plans by (10 and 3.2).
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.axes import Axes
from msgspec import structs
from numpy.typing import NDArray

from companion.clock import run_virtual
from companion.geo.angles import wrap_pi
from companion.mavlink.tlog import read_tlog
from companion.mavlink.wire.frames import Codec
from companion.telemetry.folder import VoyageRecord, read_voyage
from companion.wind import make
from sitl.run.embedded import run_embedded
from sitl.runner import SCENARIO_FOLDER
from sitl.scenario import load_scenario

WINDS = {"up wind": 0.0, "down wind": 180.0}
MEANS = {"mean5": "5 s: the helm's", "mean90": "90 s: the planner's"}


def sail(name: str, seed: int, folder: Path) -> VoyageRecord:
    """Sail one of ``WINDS``; return its record."""
    path = SCENARIO_FOLDER / "by-astar.toml"
    scenario = load_scenario(path)
    scenario = structs.replace(scenario, wind=structs.replace(scenario.wind, from_deg=WINDS[name]))
    run_virtual(run_embedded(scenario, path, seed, folder))
    return read_voyage(folder)


def told_wind(folder: Path) -> NDArray[np.float64]:
    """Return (n, 3): time from the first reading [s], direction [rad] and strength [m/s] that the autopilot told."""
    codec, rows = Codec(255, 190), []
    for record in read_tlog(folder / "telemetry.tlog"):
        rows += [
            (record.unix_us * 1e-6, math.radians(message.direction), message.speed)
            for message in codec.feed(record.frame)
            if message.get_type() == "WIND" and message.speed > 0.0
        ]
    told = np.array(rows)
    told[:, 0] -= told[0, 0]
    return told


def means(told: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Return his two means of the direction [rad] at each reading."""
    found = {}
    for name in MEANS:
        estimator, rows = make(name), []
        for t_s, twd, tws in told.tolist():
            estimator.update(t_s, twd, tws)
            rows.append(estimator.forecast(0.0)[0])
        found[name] = np.array(rows)
    return found


def draw_track(axes: Axes, record: VoyageRecord, title: str) -> None:
    """Draw figure 11: the rocks, the first plan and the track."""
    for wkt in record.chart.obstacles:
        for rock in shapely.get_parts(shapely.from_wkt(wkt)):
            axes.fill(*np.asarray(rock.exterior.coords).T, color="#e7dcc3", edgecolor="#8a7a55")
    first = next(p.plan for p in record.plans if p.plan is not None and p.plan.waypoints)
    axes.plot(*np.asarray(first.waypoints).T[:2], "--o", color="#5b6472", ms=3.5, lw=1.2, label="first plan")
    axes.plot(record.columns["east_m"], record.columns["north_m"], color="#1f5fa8", lw=1.8, label="sailed")
    axes.set(title=title, xlabel="east [m]", ylabel="north [m]", aspect="equal")
    axes.legend(fontsize=8)


def draw_wind(axes: Axes, told: NDArray[np.float64], centre_rad: float) -> None:
    """Draw figures 10 and 3.2: the direction about where the wind is from, and its two means."""

    def about(angles: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.degrees([wrap_pi(float(a) - centre_rad) for a in angles])

    axes.plot(told[:, 0], about(told[:, 1]), ".", ms=2.5, color="#999999", label="told")
    for (name, label), colour in zip(MEANS.items(), ("#e08a1e", "#b3261e"), strict=True):
        axes.plot(told[:, 0], about(means(told)[name]), color=colour, lw=1.4, label=label)
    axes.set(xlabel="time [s]", ylabel="off the wind's mean [°]")
    axes.legend(fontsize=8)


def main() -> None:
    """Sail and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    if args.out.exists():
        parser.error(f"{args.out} is there already: name a folder that is not")
    figure, axes = plt.subplots(2, 2, figsize=(11.0, 9.0), layout="constrained", height_ratios=(2.0, 1.0))
    for column, name in enumerate(WINDS):
        folder = args.out / name.replace(" ", "-")
        draw_track(axes[0, column], sail(name, args.seed, folder), name)
        draw_wind(axes[1, column], told_wind(folder), math.radians(WINDS[name]))
    figure.savefig(args.out / "avalon-voyages.png", dpi=110)
    print(args.out / "avalon-voyages.png")


if __name__ == "__main__":
    main()

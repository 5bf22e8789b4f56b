"""Pictures of policies: the time to go over the water, where either tack is given up, drawn winds sailed by it."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle

from companion.planner import Problem
from companion.planner.policy import PORT, STARBOARD, Policy
from companion.plots.chart import save, scale_bar
from companion.plots.plan import GOAL, SEA, START, draw_solids, draw_wind

FAN = 12
EVERY_S = 20.0
NAMES = {PORT: "on port tack", STARBOARD: "on starboard tack"}
COLORS = {PORT: "#b5423c", STARBOARD: "#2e7d4f"}
"""The sides' own: red is port."""


def save_policy(problem: Problem, policy: Policy, tack: int, path: str | Path) -> None:
    """Draw a policy in the mean wind and save it: for each tack the time to go, and where she tacks at once.

    Raises InputError when the file cannot be written or its kind is unknown.
    """
    figure, axes = plt.subplots(1, 2, figsize=(11.0, 6.4), layout="constrained", sharex=True, sharey=True)
    chart = policy.chart
    rows, columns = chart.is_water.shape
    east = chart.corner_en_m[0] + chart.cell_m * np.arange(columns)
    north = chart.corner_en_m[1] + chart.cell_m * np.arange(rows)
    fan = policy.sailed(problem.start_en, tack, count=FAN)
    for side, axis in zip((PORT, STARBOARD), axes, strict=True):
        value, tacks = policy.chart_s(side), policy.tacks_at_once(side).astype(float)
        axis.set_facecolor(SEA)
        draw_solids(axis, problem)
        levels = np.arange(0.0, math.ceil(float(np.nanmax(value)) / EVERY_S) * EVERY_S + EVERY_S, EVERY_S)
        lines = axis.contour(east, north, value, levels=levels, colors="#4a6a80", linewidths=0.6, zorder=2)
        axis.clabel(lines, levels[::3], fmt="%d s", fontsize=6)
        axis.contourf(east, north, tacks, levels=[0.5, 1.5], colors=[COLORS[side]], alpha=0.22, zorder=1)
        for track in fan.tracks:
            axis.plot(track[:, 0], track[:, 1], "-", color="#333333", lw=0.6, alpha=0.7, zorder=5)
        axis.plot(*problem.start_en, "o", color=START, ms=7, mec="black", mew=0.6, zorder=7)
        axis.add_patch(Circle(problem.goal_en, max(problem.goal_radius_m, 1e-6), fc="none", ec=GOAL, lw=1.4, zorder=7))
        draw_wind(axis, problem)
        axis.set(xlim=(east[0], east[-1]), ylim=(north[0], north[-1]), aspect="equal")
        axis.tick_params(labelsize=7)
        axis.set_title(
            f"{NAMES[side]}: time to go every {EVERY_S:.0f} s; shaded: she tacks at once", fontsize=9, loc="left"
        )
    axes[0].set_ylabel("north [m]", fontsize=8)
    for axis in axes:
        axis.set_xlabel("east [m]", fontsize=8)
    scale_bar(axes[0])
    figure.suptitle(
        f"{problem.id}: the best policy in a wind that shifts, and {FAN} drawn winds sailed by it", fontsize=10
    )
    save(figure, path)

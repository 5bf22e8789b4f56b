"""Wolsieffer's filter over recorded wind: CRPS and coverage of its forecasts by measurement noise R and window N.

One column for each horizon. Above, the CRPS of the direction; below, how much of the wind fell inside the 95 % band
that the planner widens the no-go zone by. The default forecaster is the dashed line; a star is what a mission has that
says nothing of R and N.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt

from companion.plots.chart import save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from companion.wind.study import Characterisation, HorizonScore

_FIRST, _LAST = 0.05, 0.85      # of the colour map: its last yellow is not seen on white
_REFERENCE = "#b3541e"


def save_filter(found: Characterisation, path: str | Path, *, title: str = "") -> None:
    """Write the picture; see ``filter_figure``. Raises InputError when the file cannot be written."""
    save(filter_figure(found, title=title), path)


def filter_figure(found: Characterisation, *, title: str = "") -> Figure:
    """Return the picture of a characterisation with at least one horizon."""
    horizons = found.horizons_s
    figure, axes = plt.subplots(
        2, len(horizons), figsize=(1.2 + 3.9 * len(horizons), 7.4), layout="constrained", squeeze=False, sharex=True,
    )
    for column, horizon_s in enumerate(horizons):
        above, below = axes[0, column], axes[1, column]
        _draw(above, found, horizon_s, lambda s: math.degrees(s.crps_rad))
        _draw(below, found, horizon_s, lambda s: 100.0 * s.coverage[-1])
        above.set_ylim(bottom=0.0)
        above.set_title(f"{horizon_s:g} s ahead", fontsize=10)
        below.axhspan(93.0, 97.0, color="#2e8b3d", alpha=0.15, lw=0.0)
        below.set_ylim(0.0, 101.0)
        below.set_xlabel("R, the noise of a reading [°]")
    axes[0, 0].set_ylabel("CRPS of direction [°]: smaller is better")
    axes[1, 0].set_ylabel("inside the stated 95 % band [%]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False)
    figure.suptitle(title or f"Wolsieffer's filter over {_of(found)}, by R and N", fontsize=12)
    return figure


def _of(found: Characterisation) -> str:
    return found.records[0] if len(found.records) == 1 else f"{len(found.records)} records"


def _draw(axes: Axes, found: Characterisation, horizon_s: float, value: Callable[[HorizonScore], float]) -> None:
    """Draw one figure of the scores over R, a curve for each N."""
    windows = sorted({cell.window for cell in found.cells})
    noises = sorted({cell.r_deg for cell in found.cells})
    colours = plt.get_cmap("viridis")
    for i, n in enumerate(windows):
        of = [(cell.r_deg, value(s)) for cell in found.cells if cell.window == n and (s := cell.at(horizon_s))]
        share = i / max(1, len(windows) - 1)
        axes.plot(*zip(*of, strict=True), marker="o", ms=3, lw=1.4, label=f"N = {n}",
                  color=colours(_FIRST + (_LAST - _FIRST) * share))
    chosen = found.chosen
    if chosen is not None and (there := chosen.at(horizon_s)) is not None:
        axes.plot([chosen.r_deg], [value(there)], marker="*", ms=15, mfc="#f2c14e", mec="black", ls="none", zorder=5,
                  label=f"the mission's default: R = {chosen.r_deg:g}°, N = {chosen.window}")
    reference = next(s for s in found.default if s.horizon_s == horizon_s)
    axes.axhline(value(reference), color=_REFERENCE, ls="--", lw=1.6, label="default forecaster")
    axes.set_xscale("log")
    axes.set_xticks(noises, [f"{r:g}" for r in noises])
    axes.xaxis.minorticks_off()
    axes.grid(alpha=0.3)

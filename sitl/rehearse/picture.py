"""The picture of a rehearsal: the way sailed and how often, where the trouble is, chances, times, what changes gain."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from companion.plots.chart import save, scale_bar
from companion.plots.drying import draw_drying, drying_picture
from companion.plots.mission import draw_area, draw_marks, extent_of
from companion.words import brief_time, counted
from sitl.rehearse.changes import Tried, scaled
from sitl.rehearse.estimates import Estimates, lasting, percent
from sitl.rehearse.prepared import PreparedRehearsal
from sitl.rehearse.report import RehearsalOutcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes


CELLS = 90  # along the longer side of the map
MOST_BARS = 8
MOST_KINDS = 6  # of trouble, each with a colour of its own
BLUE, AMBER = "#1f5fa8", "#b3541e"
WORST = ("#7b1fa2", "#ad1457", "#4e342e")
KINDS = ("#d62728", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#111111")


def save_rehearsal(made: PreparedRehearsal, outcome: RehearsalOutcome, path: Path) -> None:
    """Write the picture. Raises InputError when the file cannot be written."""
    has_changes = any(pair.comparison.changes for pair in outcome.changes)
    figure = plt.figure(figsize=(15.0, 9.6), layout="constrained")
    grid = figure.add_gridspec(3 if has_changes else 2, 2, width_ratios=(1.25, 1.0))
    _map(figure.add_subplot(grid[:, 0]), made, outcome)
    _chances(figure.add_subplot(grid[0, 1]), outcome.known)
    _times(figure.add_subplot(grid[1, 1]), outcome.known, made.planned_s)
    if has_changes:
        _changes(figure.add_subplot(grid[2, 1]), outcome.changes)
    figure.suptitle(
        f"{made.mission.name}, rehearsed: {counted(len(outcome.known.records), 'voyage')}, {outcome.ends}   ·   "
        f"arrives {percent(outcome.known.arrives)} (95 %)\n{made.doubts.wind.told}",
        fontsize=11,
        ha="left",
        x=0.01,
    )
    save(figure, path)


def _map(axes: Axes, made: PreparedRehearsal, outcome: RehearsalOutcome) -> None:
    mission, records = made.mission, outcome.known.records
    frame = mission.frame()
    local = mission.water()
    start = None if mission.start is None else frame.en_from_geo(mission.start)
    goals = [frame.en_from_geo(goal.point) for goal in mission.goals]
    tracks = [np.asarray(record["track"]) for record in records if record.get("track")]
    extent = extent_of(local, [*([start] if start else []), *goals], tracks)
    drying = draw_drying(axes, drying_picture(mission, made.scenario.epoch_s))
    handles = [*draw_area(axes, local, mission.margin_m), *drying, *draw_marks(axes, mission, start, goals)]
    density = shares_of(tracks, extent)
    image = axes.imshow(
        np.ma.masked_less_equal(density, 0.0),
        origin="lower",
        cmap="viridis",
        alpha=0.75,
        vmin=0.0,
        vmax=1.0,
        extent=(extent[0], extent[2], extent[1], extent[3]),
        zorder=3.5,
        aspect="equal",
    )
    figure = axes.get_figure(root=True)
    if figure is not None:
        figure.colorbar(image, ax=axes, shrink=0.5, label="share of the voyages that pass here")
    for number, ((record, _), colour) in enumerate(zip(outcome.folders, WORST, strict=False), start=1):
        track = np.asarray(record.get("track") or np.zeros((0, 2)))
        axes.plot(track[:, 0], track[:, 1], color=colour, lw=1.3, zorder=6)
        handles.append(Line2D([], [], color=colour, lw=1.3, label=f"worst {number}: seed {record['seed']}"))
    places = Counter(code for record in records for code, *_ in record.get("troubles", ()))
    for (code, count), colour in zip(places.most_common(MOST_KINDS), KINDS, strict=False):
        at = np.array([place for record in records for name, *place in record.get("troubles", ()) if name == code])
        axes.plot(at[:, 0], at[:, 1], "x", color=colour, ms=6, mew=1.6, zorder=7)
        handles.append(Line2D([], [], ls="", marker="x", color=colour, mew=1.6, label=f"{code}: {count}"))
    low = np.array([record["nearest"] for record in records if record.get("nearest")])
    if len(low):
        axes.plot(low[:, 0], low[:, 1], "*", color="#ffd400", mec="black", mew=0.7, ms=12, zorder=9)
        handles.append(
            Line2D(
                [],
                [],
                ls="",
                marker="*",
                color="#ffd400",
                mec="black",
                ms=10,
                label=f"nearest, below the floor: {len(low)}",
            )
        )
    axes.set(
        xlim=(extent[0], extent[2]),
        ylim=(extent[1], extent[3]),
        xlabel="east of the start, m",
        ylabel="north of the start, m",
    )
    scale_bar(axes)
    for word in axes.texts:  # tracks and the fence run through them
        word.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.08), ncols=3, fontsize=8, frameon=False)


def shares_of(tracks: Sequence[NDArray[np.float64]], extent: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Return the share of tracks that pass each cell of a map, (rows from the south, columns from the west)."""
    west, south, east, north = extent
    size_m = max(east - west, north - south) / CELLS
    shape = max(1, math.ceil((north - south) / size_m)), max(1, math.ceil((east - west) / size_m))
    counts = np.zeros(shape)
    for track in tracks:
        points = shapely.get_coordinates(shapely.segmentize(shapely.linestrings(track), 0.5 * size_m))
        rows = ((points[:, 1] - south) / size_m).astype(int)
        columns = ((points[:, 0] - west) / size_m).astype(int)
        inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
        passed = np.zeros(shape, dtype=bool)
        passed[rows[inside], columns[inside]] = True
        counts += passed
    return counts / max(1, len(tracks))


def _chances(axes: Axes, known: Estimates) -> None:
    bars = [
        ("arrives", known.arrives),
        ("below the floor", known.low),
        ("touches", known.touches),
        *list(known.watchdogs.items())[:MOST_BARS],
    ]
    for row, (_, share) in enumerate(bars):
        middle = share.came / share.of if share.of else 0.0
        axes.errorbar(
            middle,
            row,
            xerr=[[max(0.0, middle - share.low)], [max(0.0, share.high - middle)]],
            fmt="o",
            color=BLUE if row < 3 else AMBER,
            capsize=3,
        )
    axes.set_yticks(range(len(bars)), [name for name, _ in bars], fontsize=9)
    axes.invert_yaxis()
    axes.set(xlim=(-0.02, 1.02), xlabel="share of the voyages, with what is 95 % sure", title="Chances")
    axes.grid(visible=True, axis="x", alpha=0.3)


def _times(axes: Axes, known: Estimates, planned_s: float) -> None:
    times = sorted(record["time_s"] for record in known.records if record.get("arrived"))
    if times:
        axes.step([0.0, *times], [n / len(known.records) for n in range(len(times) + 1)], where="post", color=BLUE)
    for time in known.times:
        if math.isfinite(time.value):
            high = time.high if math.isfinite(time.high) else (times[-1] if times else time.value)
            axes.plot([time.low, high], [time.of_all, time.of_all], color=AMBER, lw=1.6)
            axes.plot(time.value, time.of_all, "o", color=AMBER)
            axes.annotate(
                lasting(time.value), (time.value, time.of_all), xytext=(5, -11), textcoords="offset points", fontsize=8
            )
    if planned_s > 0.0:
        axes.axvline(planned_s, color="black", lw=0.9, ls=":", label=f"first plan: {lasting(planned_s)}")
        axes.legend(loc="lower right", fontsize=8, frameon=False)
    low_s = min([*times, *([planned_s] if planned_s else [])], default=0.0)
    axes.set(
        ylim=(0.0, 1.02),
        xlim=(0.9 * low_s, None),
        xlabel="time since setting sail, min:s or h min",
        ylabel="share that is there",
        title="Times, with three quantiles and what is 95 % sure of them",
    )
    axes.xaxis.set_major_formatter(FuncFormatter(lambda time_s, _: brief_time(time_s)))
    axes.grid(visible=True, alpha=0.3)


def _changes(axes: Axes, changes: Sequence[Tried]) -> None:
    """Draw what each change does to the time, and to the clearance, by pairs."""
    right = axes.twiny()
    for row, pair in enumerate(changes):
        for change in pair.comparison.changes:
            if change.measure.name in {"time", "clearance"}:
                is_time = change.measure.name == "time"
                low, middle, high = scaled(change)
                around = [[max(0.0, middle - low)], [max(0.0, high - middle)]]
                (axes if is_time else right).errorbar(
                    middle,
                    row + (-0.12 if is_time else 0.12),
                    xerr=around,
                    fmt="o" if is_time else "s",
                    color=BLUE if is_time else AMBER,
                    capsize=3,
                )
    axes.axvline(0.0, color="black", lw=0.8, ls=":")
    for each in (axes, right):
        reach = max(map(abs, each.get_xlim()))
        each.set_xlim(-reach, reach)
    axes.set_yticks(range(len(changes)), [pair.change.told for pair in changes], fontsize=9)
    axes.set_ylim(len(changes) - 0.5, -0.5)
    axes.set_title("What a change is worth, of voyages by pairs")
    axes.set_xlabel("time, % (95 %)", color=BLUE)
    right.set_xlabel("least clearance, m", color=AMBER, fontsize=9)
    axes.grid(visible=True, axis="x", alpha=0.3)

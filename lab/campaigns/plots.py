"""Pictures of campaigns: reliability (promised beside what came), and regret by tack with the wind's shifts."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, PathPatch
from numpy.typing import NDArray

from companion.plots.chart import legend_below, save, scale_bar
from companion.plots.mission import outline
from companion.plots.voyage import GOAL, LAND, LAND_EDGE, PORT_RED, STARBOARD_GREEN, WATER, WIND_BLUE
from lab.campaigns.baselines import BaselineTrack, BaselineVoyage
from lab.campaigns.reliability import Bin, floor_curve, late_curve, no_go_curve, time_shares
from lab.perfect_information import Best

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


GROUPS = (("as planned", "#1f5fa8", "o"), ("another boat and water", "#b3541e", "s"))
_LEAST = 1e-3  # what is less is drawn at this: the axes are of tenths and hundredths
LEAST_VOYAGES = 10  # of a group, or its interval would be all that is seen


def save_reliability(records: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the picture. Raises InputError when the file cannot be written or its kind is unknown."""
    save(reliability_figure(records), path)


def reliability_figure(records: Sequence[Mapping[str, Any]]) -> Figure:
    """Return the curves: the no-go zone, the floor, the time."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13.0, 4.4), layout="constrained")
    for is_control, (name, colour, mark) in zip((True, False), GROUPS, strict=True):
        mine = [r for r in records if bool(r.get("as_planned")) == is_control]
        if not mine:
            continue
        label = f"{name}: {len(mine)} voyages"
        bins = no_go_curve(mine)
        _bars(left, [max(b.promised or 0.0, _LEAST) for b in bins], bins, colour, mark, label)
        late = late_curve(mine)
        if late:
            left.plot(
                [b.promised or _LEAST for b in late],
                [max(b.share, _LEAST) for b in late],
                color=colour,
                marker="^",
                ls="none",
                mfc="none",
                label=f"{name}: later than a quantile",
            )
        shares = time_shares(mine)
        if shares:
            right.step(
                shares,
                [(n + 1) / len(shares) for n in range(len(shares))],
                where="post",
                color=colour,
                label=f"{name}: {len(shares)} arrivals",
            )
    left.plot([_LEAST, 1.0], [_LEAST, 1.0], color="black", lw=0.8, ls=":", label="as promised")
    left.set(
        xscale="log",
        yscale="log",
        xlim=(0.7 * _LEAST, 1.3),
        ylim=(0.7 * _LEAST, 1.3),
        xlabel="promised",
        ylabel="came",
        title="In the no-go zone, half way along a leg; late",
    )
    floors = floor_curve(records)
    floors = [b for b in floors if b.of >= LEAST_VOYAGES] or floors
    _bars(middle, list(range(len(floors))), floors, GROUPS[1][1], GROUPS[1][2], "")
    middle.axhline(0.01, color="black", lw=0.8, ls=":")
    middle.set(
        ylim=(0.0, None),
        xlabel="how many things are not the plan's",
        ylabel="share of voyages",
        title="Below the margin's floor (dotted: 1 %)",
    )
    middle.set_xticks(range(len(floors)), [f"{b.name}\n({b.of})" for b in floors])
    right.axvline(1.0, color="black", lw=0.8, ls=":")
    right.set(
        xlabel="time, share of the first plan's",
        ylabel="share of arrivals",
        ylim=(0.0, 1.0),
        title="Time against the expected time",
    )
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), fontsize=8)  # below: no corner is free of points
    right.legend(loc="lower right", fontsize=8)
    return figure


def _bars(axes: Axes, places: Sequence[float], bins: Sequence[Bin], colour: str, mark: str, label: str) -> None:
    shares = [max(b.share, _LEAST) for b in bins]
    low = [max(0.0, share - max(b.interval[0], _LEAST)) for b, share in zip(bins, shares, strict=True)]
    high = [max(0.0, b.interval[1] - share) for b, share in zip(bins, shares, strict=True)]
    axes.errorbar(places, shares, yerr=[low, high], color=colour, marker=mark, ls="none", capsize=3, label=label)


COLOURS = {True: PORT_RED, False: STARBOARD_GREEN}


def save_regret(voyages: Sequence[tuple[BaselineVoyage, Best | None]], path: Path) -> None:
    """Draw a column for each voyage. Raises InputError when the file cannot be written or its kind is unknown."""
    figure, axes = plt.subplots(
        2,
        len(voyages),
        figsize=(1.0 + 4.8 * len(voyages), 9.0),
        layout="constrained",
        squeeze=False,
        height_ratios=(3.0, 1.0),
    )
    for column, (voyage, ideal) in enumerate(voyages):
        _chart(axes[0, column], voyage, ideal)
        _shifts(axes[1, column], voyage.track, ideal)
    save(figure, path)


def _is_port(track: BaselineTrack) -> Any:
    truth = track.truth
    off = np.array(truth.heading_rad) - np.array(truth.twd_from_rad)
    return np.sin(off) > 0.0


def _chart(axes: Axes, voyage: BaselineVoyage, ideal: Best | None) -> None:
    track = voyage.track
    mission, places = track.mission, track.truth.positions_m()
    frame = mission.frame()
    area = mission.area.local(frame)
    axes.set_facecolor(WATER)
    for shape in area.polygons:
        axes.add_patch(PathPatch(outline(shape), fc=LAND, ec=LAND_EDGE, lw=0.9, zorder=2))
    if area.limits is not None:
        axes.add_patch(PathPatch(outline(area.limits), fc="none", ec="#444444", lw=1.2, zorder=2))
    for goal in mission.goals:
        axes.add_patch(Circle(frame.en_from_geo(goal.point), goal.radius_m, fc=GOAL, ec="black", alpha=0.8, zorder=3))
    _line(axes, places, _is_port(track), lw=3.0, alpha=0.55)
    words = "did not arrive"
    if ideal is not None:
        _line(axes, ideal.track[:, 1:3], ideal.track[1:, 3] > 0.0, lw=1.6, ls=(0, (3.0, 1.2)))
        time_s = voyage.record["time_s"]
        words = (
            f"{time_s:.0f} s, {voyage.record['tacks']} tacks; clairvoyant {ideal.time_s:.0f} s, {ideal.tacks}: "
            f"{100.0 * (time_s / ideal.time_s - 1.0):+.1f} %"
        )
    axes.set_title(f"{voyage.record['who']}, seed {voyage.record['seed']}\n{words}", fontsize=10)
    axes.plot([], [], color=PORT_RED, lw=3.0, alpha=0.55, label="sailed on port tack")
    axes.plot([], [], color=STARBOARD_GREEN, lw=3.0, alpha=0.55, label="on starboard tack")
    axes.plot([], [], color="black", lw=1.6, ls=(0, (3.0, 1.2)), label="clairvoyant")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.05)
    axes.autoscale_view()
    axes.apply_aspect()
    scale_bar(axes)
    axes.set(xlabel="east, m", ylabel="north, m")
    axes.grid(visible=True, color="white", lw=0.8, zorder=0)
    legend_below(axes, columns=3)


def _line(axes: Axes, places: NDArray[np.float64], is_port: Any, **style: Any) -> None:
    """Draw a track, each board in one piece; ``is_port`` is of the pieces between places."""
    for first, last in _boards(is_port[: len(places) - 1]):
        axes.plot(
            *places[first : last + 1].T, color=COLOURS[bool(is_port[first])], solid_capstyle="butt", zorder=5, **style
        )


def _boards(is_port: Any) -> list[tuple[int, int]]:
    """Return where each board begins and ends.

    >>> _boards(np.array([True, True, False]))
    [(0, 2), (2, 3)]
    """
    cuts = [0, *(np.flatnonzero(np.diff(is_port)) + 1).tolist(), len(is_port)]
    return list(itertools.pairwise(cuts))


def _shifts(axes: Axes, track: BaselineTrack, ideal: Best | None) -> None:
    """Draw where the wind came from, and on which tack either was meanwhile: port tack is lifted by a back."""
    t_s = np.array(track.truth.t_s) - track.truth.t_s[0]
    twd = np.degrees(np.unwrap(np.array(track.truth.twd_from_rad)))
    twd -= 360.0 * np.round(twd.mean() / 360.0)
    axes.plot(t_s, twd, color=WIND_BLUE, lw=1.2)
    axes.axhline(float(twd.mean()), color=WIND_BLUE, lw=0.7, ls=":")
    low, high = float(twd.min()), float(twd.max())
    band = 0.08 * max(high - low, 10.0)
    rows = [("sailed", t_s, _is_port(track))]
    if ideal is not None:
        rows.append(("clairvoyant", ideal.track[:, 0], ideal.track[1:, 3] > 0.0))
    for n, (name, times, is_port) in enumerate(rows):
        at = low - (1.5 + 1.8 * n) * band
        for first, last in _boards(is_port[: len(times) - 1]):
            axes.barh(
                at, times[last] - times[first], left=times[first], height=band, color=COLOURS[bool(is_port[first])]
            )
        axes.annotate(
            name,
            (1.0, at),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            fontsize=7,
            va="center",
            annotation_clip=False,
        )
    axes.set(xlabel="time since setting sail, s", ylabel="wind from, °", ylim=(low - 5.0 * band, high + band))
    axes.grid(visible=True, alpha=0.3)

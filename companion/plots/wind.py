"""Pictures of wind: what a sailor and an engineer look for in a record and its forecasts.

Direction and speed over time with the forecast made two minutes before; the last hour as a vertical strip, newest at
the top, a left shift to the left, red on port tack and green on starboard; reliability; CRPS by horizon beside the
references; histograms of direction and strength, autocorrelation of the direction (Wolsieffer 2020, Figures 4 and 5).

One column for each horizon. Above, the CRPS of the direction; below, how much of the wind fell inside the 95 % band
that the planner widens the no-go zone by. The default forecaster is the dashed line; a star is what a mission has that
says nothing of R and N.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from numpy.typing import NDArray

from companion.geo.angles import mean_direction_rad, wrap_pi_array
from companion.plots.chart import save
from companion.wind import NAMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from companion.wind.study import Characterisation, HorizonScore, Record, Score


Array = NDArray[np.float64]

TRUE, BAND, MEDIAN = "#1f5fa8", "#e08a1e", "#b3541e"  # true wind is blue, as on other displays
PORT, STARBOARD, PLAIN = "#c1272d", "#2e8b3d", "#1f5fa8"
# Of the estimators' curves, in the order of their table; one more gets the next.
_STYLES = (
    ("#b3541e", "o"),
    ("#777777", "s"),
    ("#2e8b3d", "D"),
    ("#8e44ad", "P"),
    ("#c2185b", "X"),
    ("#1f5fa8", "^"),
    ("#6fa8dc", "v"),
    ("#8c6d1f", "<"),
    ("#17a2a2", ">"),
    ("#222222", "*"),
)
_STRIP_MIN = 60.0
_LAG_S = 600.0


def save_wind(record: Record, scores: Sequence[Score], path: str | Path) -> None:
    """Write the picture of a record; see ``wind_figure``.

    Raises InputError when the file cannot be written or its kind is unknown.
    """
    save(wind_figure(record, scores), path)


def wind_figure(record: Record, scores: Sequence[Score]) -> Figure:
    """Return a record drawn with the scores of one or more estimators; the first one's forecasts are shown."""
    figure = plt.figure(figsize=(16.5, 9.4), layout="constrained")
    whole = figure.add_gridspec(1, 2, width_ratios=(1.7, 4.0))
    left = whole[0].subgridspec(1, 2, width_ratios=(0.95, 0.75))
    right = whole[1].subgridspec(2, 1, height_ratios=(2.1, 1.1))
    upper = right[0].subgridspec(2, 1, height_ratios=(1.25, 0.85))
    lower = right[1].subgridspec(1, 5)
    strip = figure.add_subplot(left[0])
    strip_speed = figure.add_subplot(left[1], sharey=strip)
    direction = figure.add_subplot(upper[0])
    speed = figure.add_subplot(upper[1], sharex=direction)
    below = [figure.add_subplot(lower[i]) for i in range(5)]
    centre = _centre(record)
    draw_strips(strip, strip_speed, record, centre)
    draw_direction(direction, record, scores[0], centre)
    draw_speed(speed, record, scores[0])
    draw_reliability(below[0], scores)
    draw_crps(below[1], scores)
    draw_histogram(below[2], record, centre)
    draw_strength(below[3], record)
    draw_autocorrelation(below[4], record, centre)
    figure.suptitle(
        f"{record.name}: true wind, mean {np.mean(record.tws_mps):.1f} m/s from "
        f"{math.degrees(centre) % 360.0:.0f}°, {record.duration_s / 60.0:.0f} min; forecasts by "
        f"“{scores[0].estimator}”",
        fontsize=12,
    )
    return figure


def _centre(record: Record) -> float:
    centre = mean_direction_rad(record.twd_from_rad, record.tws_mps)
    return 0.0 if math.isnan(centre) else centre


def _about(angle_rad: Array, centre_rad: float) -> Array:
    """Return degrees on the branch within half a turn of the centre, the centre itself in 0..360."""
    off = wrap_pi_array(angle_rad - centre_rad)
    return np.asarray(np.degrees(off) + math.degrees(centre_rad) % 360.0)


def _compass(axis: Any) -> None:
    axis.set_major_formatter(lambda value, _: f"{value % 360.0:.0f}°")


def draw_direction(axes: Axes, record: Record, score: Score, centre_rad: float) -> None:
    """Draw direction over time and the band forecast two minutes before."""
    minutes = record.t_s / 60.0
    axes.plot(minutes, _about(record.twd_from_rad, centre_rad), ".", ms=1.1, color=TRUE, alpha=0.45, label="measured")
    trace = score.trace
    if trace.shape[0]:
        t = trace[:, 0] / 60.0
        middle = _about(trace[:, 1], centre_rad)
        for column, alpha, name in ((3, 0.22, "95 %"), (2, 0.38, "50 %")):
            half = np.degrees(trace[:, column])
            axes.fill_between(
                t, middle - half, middle + half, color=BAND, alpha=alpha, lw=0.0, label=f"forecast 2 min before, {name}"
            )
        # A mean that crosses the edge of the picture is not a line across it.
        axes.plot(t, np.where(np.abs(np.diff(middle, prepend=middle[0])) > 180.0, np.nan, middle), color=MEDIAN, lw=0.9)
    low, high = np.percentile(_about(record.twd_from_rad, centre_rad), [0.5, 99.5])
    axes.set_ylim(low - 25.0, high + 25.0)
    _compass(axes.yaxis)
    axes.set_ylabel("wind from")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=8, ncols=4, markerscale=6.0, frameon=False)
    axes.tick_params(labelbottom=False)


def draw_speed(axes: Axes, record: Record, score: Score) -> None:
    """Draw speed over time and its forecast."""
    axes.plot(record.t_s / 60.0, record.tws_mps, lw=0.4, color=TRUE, alpha=0.8)
    trace = score.trace
    if trace.shape[0]:
        t, half = trace[:, 0] / 60.0, 1.96 * trace[:, 5]
        axes.fill_between(t, np.maximum(0.0, trace[:, 4] - half), trace[:, 4] + half, color=BAND, alpha=0.25, lw=0.0)
        axes.plot(t, trace[:, 4], color=MEDIAN, lw=0.9)
    axes.set_ylim(0.0, float(np.percentile(record.tws_mps, 99.8)) * 1.2 + 0.5)
    axes.set_xlim(record.t_s[0] / 60.0, record.t_s[-1] / 60.0)
    axes.set_ylabel("wind speed [m/s]")
    axes.set_xlabel("time [min]")
    axes.grid(alpha=0.3)


def draw_strips(direction: Axes, speed: Axes, record: Record, centre_rad: float) -> None:
    """Draw the last hour upwards: direction and speed, with low, middle and high."""
    t = record.t_s
    step = 10.0
    recent = t >= t[-1] - 60.0 * _STRIP_MIN
    cell = ((t[-1] - t[recent]) // step).astype(int)
    count = np.bincount(cell)
    keep = count > 0
    count = np.maximum(count, 1)
    d, v = record.twd_from_rad[recent], record.tws_mps[recent]
    sine, cosine = np.bincount(cell, v * np.sin(d)), np.bincount(cell, v * np.cos(d))
    ago = (np.arange(count.size) + 0.5) * step / 60.0
    mean = _about(np.arctan2(sine, cosine), centre_rad)
    mean[~keep] = np.nan
    wind = np.where(keep, np.bincount(cell, v) / count, np.nan)
    colours: list[str] = [PLAIN] * ago.size
    if record.awa_rad is not None:
        side = np.bincount(cell, np.sign(np.sin(record.awa_rad[recent])))
        colours = [STARBOARD if s > 0 else PORT for s in side]
    points = np.stack([mean, ago], axis=1)
    gap = np.abs(np.diff(mean)) > 120.0
    lines = [points[i : i + 2] for i in range(len(points) - 1) if not gap[i] and np.all(np.isfinite(points[i : i + 2]))]
    shown = [c for i, c in enumerate(colours[:-1]) if not gap[i] and np.all(np.isfinite(points[i : i + 2]))]
    direction.add_collection(LineCollection(lines, colors=shown, linewidths=1.6))
    good = mean[np.isfinite(mean)]
    low, middle, high = np.percentile(good, [5, 50, 95])
    for value, style in ((low, ":"), (middle, "--"), (high, ":")):
        direction.axvline(value, color="#444444", lw=0.9, ls=style)
    direction.set_xlim(min(low - 12.0, good.min() - 3.0), max(high + 12.0, good.max() + 3.0))
    direction.set_ylim(min(_STRIP_MIN, (t[-1] - t[0]) / 60.0), 0.0)
    _compass(direction.xaxis)
    direction.set_title(f"shifts {low % 360:.0f}° · {middle % 360:.0f}° · {high % 360:.0f}°", fontsize=9)
    direction.set_xlabel("← backed   from   veered →")
    direction.set_ylabel("minutes ago (newest at the top)")
    direction.grid(alpha=0.3)
    if record.awa_rad is not None:
        direction.plot([], [], color=PORT, lw=2, label="P  port tack")
        direction.plot([], [], color=STARBOARD, lw=2, label="S  starboard tack")
        direction.legend(loc="upper left", bbox_to_anchor=(-0.1, -0.09), ncols=2, fontsize=7, frameon=False)
    gust, lull = np.full(ago.size, np.nan), np.full(ago.size, np.nan)
    order = np.argsort(cell, kind="stable")
    parts = np.split(v[order], np.cumsum(np.bincount(cell))[:-1])
    for i, part in enumerate(parts):
        if part.size:
            lull[i], gust[i] = part.min(), part.max()
    speed.fill_betweenx(ago, lull, gust, color=TRUE, alpha=0.2, lw=0.0, label="lull, gust")
    speed.plot(wind, ago, color=TRUE, lw=1.4)
    speed.set_xlim(0.0, float(np.nanmax(gust)) * 1.1 + 0.3)
    speed.set_xlabel("m/s")
    speed.set_title("speed, lulls and gusts", fontsize=9)
    speed.grid(alpha=0.3)
    speed.tick_params(labelleft=False)


def draw_reliability(axes: Axes, scores: Sequence[Score]) -> None:
    """Draw promised against observed coverage at two minutes; a point below the diagonal promises too much."""
    level = np.linspace(0.05, 0.99, 48)
    axes.plot([0, 100], [0, 100], color="#999999", lw=0.8)
    axes.axhspan(93, 97, color="#2e8b3d", alpha=0.10, lw=0)
    for score in scores:
        if score.pit.size:
            inside = 2.0 * np.abs(score.pit - 0.5)
            axes.plot(
                100.0 * level,
                [100.0 * float(np.mean(inside <= p)) for p in level],
                color=_style(score)[0],
                lw=2.0 if score is scores[0] else 1.1,
                label=score.estimator,
            )
    axes.set_xlabel("promised: within interval [%]")
    axes.set_ylabel("observed [%]")
    axes.set_title("reliability at 2 min", fontsize=9)
    axes.set_xlim(0, 100)
    axes.set_ylim(0, 100)
    axes.grid(alpha=0.3)
    _legend_or_reason(axes)


def _style(score: Score) -> tuple[str, str]:
    """Return colour and mark of an estimator's curves."""
    return _STYLES[NAMES.index(score.estimator) % len(_STYLES)]


def _legend_or_reason(axes: Axes) -> None:
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7, loc="best")
    else:
        axes.text(0.5, 0.5, "too short\nto score", transform=axes.transAxes, ha="center", va="center", color="#777777")


def draw_crps(axes: Axes, scores: Sequence[Score]) -> None:
    """Draw CRPS by horizon."""
    for score in scores:
        if score.horizons:
            colour, mark = _style(score)
            axes.plot(
                [h.horizon_s for h in score.horizons],
                [math.degrees(h.crps_rad) for h in score.horizons],
                color=colour,
                marker=mark,
                ms=4,
                lw=2.0 if score is scores[0] else 1.1,
                label=score.estimator,
            )
    axes.set_xscale("log")
    axes.set_xlim(8, 750)
    ticks = [10, 30, 60, 120, 300, 600]
    axes.set_xticks(ticks, [str(t) for t in ticks])
    axes.minorticks_off()
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("horizon [s]")
    axes.set_ylabel("CRPS of direction [°]")
    axes.set_title("CRPS: smaller is better", fontsize=9)
    axes.grid(alpha=0.3)
    _legend_or_reason(axes)


def draw_histogram(axes: Axes, record: Record, centre_rad: float) -> None:
    """Draw the distribution of direction about its mean with the normal of the same spread (Figure 4)."""
    off = np.degrees(wrap_pi_array(record.twd_from_rad - centre_rad))
    spread = float(np.std(off))
    reach = min(180.0, max(15.0, 3.5 * spread))
    axes.hist(off, bins=60, range=(-reach, reach), density=True, color=TRUE, alpha=0.6)
    x = np.linspace(-reach, reach, 200)
    axes.plot(
        x,
        np.exp(-0.5 * (x / spread) ** 2) / (spread * math.sqrt(2.0 * math.pi)),
        color=MEDIAN,
        lw=1.4,
        label=f"normal, sd {spread:.1f}°",
    )
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])  # room for the legend over the curve
    axes.set_xlabel("direction about its mean [°]")
    axes.set_yticks([])
    axes.set_title("distribution of direction", fontsize=9)
    axes.legend(fontsize=7)


def draw_strength(axes: Axes, record: Record) -> None:
    """Draw the distribution of the wind's speed with the normal of the same mean and spread (Figure 4)."""
    speed = record.tws_mps
    mean, spread = float(np.mean(speed)), max(0.05, float(np.std(speed)))
    top = float(np.max(speed)) + 0.5
    axes.hist(speed, bins=40, range=(0.0, top), density=True, color=TRUE, alpha=0.6)
    x = np.linspace(0.0, top, 200)
    axes.plot(
        x,
        np.exp(-0.5 * ((x - mean) / spread) ** 2) / (spread * math.sqrt(2.0 * math.pi)),
        color=MEDIAN,
        lw=1.4,
        label=f"normal, sd {spread:.1f} m/s",
    )
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])  # room for the legend over the curve
    axes.set_xlabel("wind speed [m/s]")
    axes.set_yticks([])
    axes.set_title("distribution of strength", fontsize=9)
    axes.legend(fontsize=7)


def draw_autocorrelation(axes: Axes, record: Record, centre_rad: float) -> None:
    """Draw the autocorrelation of direction (Figure 5) and the exponential of the same 1/e time."""
    lags, correlation = autocorrelation(record, centre_rad)
    axes.plot(lags, correlation, color=TRUE, lw=1.6)
    axes.axhline(0.0, color="#999999", lw=0.8)
    axes.axhline(math.exp(-1.0), color="#999999", lw=0.8, ls=":")
    under = np.flatnonzero(correlation < math.exp(-1.0))
    if under.size:
        tau = float(lags[under[0]])
        axes.plot(lags, np.exp(-lags / tau), color=MEDIAN, lw=1.1, label=f"exp(−lag / {tau:.0f} s)")
        axes.legend(fontsize=7)
    axes.set_xlabel("lag [s]")
    axes.set_ylim(min(-0.2, float(np.nanmin(correlation)) - 0.05), 1.02)
    axes.set_title("autocorrelation of direction", fontsize=9)
    axes.grid(alpha=0.3)


def autocorrelation(record: Record, centre_rad: float) -> tuple[Array, Array]:
    """Return lags [s] to ten minutes and the correlation of the direction at each, on the record's usual step."""
    step = max(1.0, float(np.median(np.diff(record.t_s))))
    grid = np.arange(record.t_s[0], record.t_s[-1], step, dtype=np.float64)
    off = wrap_pi_array(record.twd_from_rad - centre_rad)
    x = off[np.clip(np.searchsorted(record.t_s, grid, side="right") - 1, 0, None)]
    x -= np.mean(x)
    most = min(int(_LAG_S / step), x.size // 2)
    variance = max(1e-12, float(np.mean(x * x)))
    values = [float(np.mean(x[: x.size - k] * x[k:])) / variance for k in range(most + 1)]
    return np.arange(most + 1, dtype=np.float64) * step, np.array(values, dtype=np.float64)


_FIRST, _LAST = 0.05, 0.85  # of the colour map: its last yellow is not seen on white
_REFERENCE = "#b3541e"


def save_filter(found: Characterisation, path: str | Path) -> None:
    """Write the picture; see ``filter_figure``. Raises InputError when the file cannot be written."""
    save(filter_figure(found), path)


def filter_figure(found: Characterisation, *, title: str = "") -> Figure:
    """Return the picture of a characterisation with at least one horizon."""
    horizons = found.horizons_s
    figure, axes = plt.subplots(
        2, len(horizons), figsize=(1.2 + 3.9 * len(horizons), 7.4), layout="constrained", squeeze=False, sharex=True
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
        axes.plot(
            *zip(*of, strict=True),
            marker="o",
            ms=3,
            lw=1.4,
            label=f"N = {n}",
            color=colours(_FIRST + (_LAST - _FIRST) * share),
        )
    chosen = found.chosen
    if chosen is not None and (there := chosen.at(horizon_s)) is not None:
        axes.plot(
            [chosen.r_deg],
            [value(there)],
            marker="*",
            ms=15,
            mfc="#f2c14e",
            mec="black",
            ls="none",
            zorder=5,
            label=f"the mission's default: R = {chosen.r_deg:g}°, N = {chosen.window}",
        )
    reference = next(s for s in found.default if s.horizon_s == horizon_s)
    axes.axhline(value(reference), color=_REFERENCE, ls="--", lw=1.6, label="default forecaster")
    axes.set_xscale("log")
    axes.set_xticks(noises, [f"{r:g}" for r in noises])
    axes.xaxis.minorticks_off()
    axes.grid(alpha=0.3)

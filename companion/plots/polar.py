"""The picture of a boat's polar: a curve for each wind, and the band that its speeds may lie in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from companion.boat import Polar
from companion.plots.chart import save

NINETY = 1.645  # standard deviations to either side that nine in ten lie in
MOST_CURVES = 4


def save_polar(
    polar: Polar, error: Polar | float, path: str | Path, *, title: str, stretches: Sequence[Sequence[int]] = ()
) -> None:
    """Draw a polar; see ``polar_figure``."""
    save(polar_figure(polar, error, title=title, stretches=stretches), path)


def polar_figure(polar: Polar, error: Polar | float, *, title: str, stretches: Sequence[Sequence[int]] = ()) -> Figure:
    """Return the picture: the wind comes from above, boat speed [m/s] outward, starboard tack on the right.

    Args:
        polar: the speeds.
        error: deviation of their logarithm, of all of them, or by angle and wind as a polar's table has speeds.
        title: of the picture.
        stretches: (angles, winds) of how many stretches of sailing each speed is; a dot, the larger the more.

    """
    figure = plt.figure(figsize=(6.4, 7.6))
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetamax(180.0)
    winds = [float(w) for w in polar.tws_mps if w > 0.0] or [5.0]
    angles = np.radians(np.arange(0.0, 181.0, 1.0))
    words = "nine in ten, of that wind" if isinstance(error, float) else "nine in ten"
    shown = winds[::-1][:: math.ceil(len(winds) / MOST_CURVES)]
    if stretches and len(winds) == polar.tws_mps.shape[0]:
        most = np.argsort(-np.array(stretches).sum(axis=0), kind="stable")[:MOST_CURVES]  # the winds she was sailed in
        shown = sorted((winds[int(j)] for j in most), reverse=True)
    for n, tws_mps in enumerate(shown):
        speeds, colour = polar.speeds_mps(angles, tws_mps), plt.get_cmap("viridis")(0.2 + 0.22 * n)
        doubt = np.full(angles.shape, error) if isinstance(error, float) else error.speeds_mps(angles, tws_mps)
        axes.plot(angles, speeds, color=colour, label=f"{tws_mps:.1f} m/s of wind")
        if float(doubt.max()) > 0.0 and (n == 0 or not isinstance(error, float)):
            low, high = (speeds * np.exp(sign * NINETY * doubt) for sign in (-1.0, 1.0))
            axes.fill_between(angles, low, high, color=colour, alpha=0.15, label="" if n else words)
        if stretches:
            j = int(np.argmin(np.abs(polar.tws_mps - tws_mps)))
            many = np.array(stretches)[:, j]
            at = np.flatnonzero(many)
            axes.scatter(polar.twa_rad[at], polar.speed_mps_table[at, j], s=8.0 * np.sqrt(many[at]) + 6.0, color=colour)
    axes.set_title(f"{title}: boat speed [m/s]", pad=24.0)
    axes.legend(loc="center right", bbox_to_anchor=(0.36, 0.93), fontsize=8, framealpha=1.0)
    return figure

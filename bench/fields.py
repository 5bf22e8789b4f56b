"""The papers' pictures of vector fields: Schmitt's atoms (Figures 6.1 to 6.5), the trees (4.2 to 4.4), an encounter."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Disc
from matplotlib.patches import Polygon, Rectangle
from numpy.typing import NDArray

from companion.field.projection import HysteresisZone, Projection
from companion.field.vector_fields import (
    AttractiveCircle,
    AttractiveLine,
    AttractivePoint,
    Field,
    RepulsiveLine,
    RepulsivePoint,
)
from companion.plots.field import BLUE, GREEN, GREY, RED, SAND, draw_boat, draw_wind, draw_zone, grid

EVERY_S = 20.0  # between drawn boats


def draw_field(
    ax: Axes, field: Field | Projection, half_m: float, *, count: int = 21, fan: bool = False, colour: str = BLUE
) -> None:
    """Draw the arrows of a field; ``fan`` adds the sector of possible directions of a projected one."""
    points = grid(half_m, count)
    v = field.evaluate(points, 1) if isinstance(field, Projection) else field(points)
    length = np.hypot(v[:, 0], v[:, 1])
    step = 2.0 * half_m / count
    # Square-root lengths: the twentyfold range of a repulsive field stays readable.
    drawn = v / np.maximum(length, 1e-9)[:, None] * (0.85 * step * np.sqrt(length / 20.0))[:, None]
    if fan and isinstance(field, Projection):
        low, high = field.fan(points)
        for p, a, b in zip(points, low, high, strict=True):
            turn = np.linspace(a, b, 7)
            edge = p + 0.62 * step * np.column_stack([np.sin(turn), np.cos(turn)])
            ax.add_patch(Polygon(np.vstack([p, edge]), closed=True, facecolor=SAND, alpha=0.38, edgecolor="none"))
    ax.quiver(
        points[:, 0],
        points[:, 1],
        drawn[:, 0],
        drawn[:, 1],
        angles="xy",
        scale_units="xy",
        scale=1.0,
        color=colour,
        width=0.0032,
        headwidth=4.0,
        headlength=5.0,
        zorder=3,
    )
    ax.set(xlim=(-half_m, half_m), ylim=(-half_m, half_m))
    ax.set_aspect("equal")
    ax.grid(visible=False)


def atoms_figure() -> Figure:
    """Return the five atoms, Figures 6.1 to 6.5."""
    figure = Figure(figsize=(12.0, 8.2), layout="constrained")
    axes = figure.subplots(2, 3)
    atoms: list[tuple[str, Field, float]] = [
        ("6.1 Line following", AttractiveLine(), 120.0),
        ("6.2 Circle following (10 m)", AttractiveCircle(), 25.0),
        ("6.3 Attractive point", AttractivePoint(), 12.0),
        ("6.4 Repulsive line", RepulsiveLine(), 200.0),
        ("6.5 Repulsive point", RepulsivePoint(), 200.0),
    ]
    for ax, (title, field, half) in zip(axes.flat, atoms, strict=False):
        draw_field(ax, field, half, count=17, colour=RED if "Repulsive" in title else BLUE)
        ax.set_title(title, fontsize=10)
        ax.set_xlabel("east [m]", fontsize=8)
        ax.tick_params(labelsize=8)
        if "Line following" in title:
            ax.axhline(0.0, color="black", lw=1.2)
        if "Circle" in title:
            ax.add_patch(Disc((0.0, 0.0), 10.0, fill=False, lw=1.2))
        if "Attractive" in title or "point" in title:
            ax.plot(0.0, 0.0, "o", color=GREEN, ms=5, zorder=5)
        if "Repulsive line" in title:
            ax.axhline(0.0, color="black", lw=1.2)
    axes.flat[0].set_ylabel("north [m]", fontsize=8)
    axes.flat[3].set_ylabel("north [m]", fontsize=8)
    last = axes.flat[5]
    last.axis("off")
    last.text(
        0.0,
        0.6,
        "Arrows: direction of the field; their length grows with\nthe square root of its strength "
        "(nominal 10, repulsive\nup to 20 with a Gaussian of 100 m).",
        fontsize=9,
        va="center",
    )
    figure.suptitle("Schmitt's atomic vector fields", fontsize=12)
    return figure


def trees_figure() -> Figure:
    """Return the two example trees with zones and fans, as in Figure 4.4."""
    twd_from_rad = math.radians(90.0)
    figure = Figure(figsize=(13.0, 6.7), layout="constrained")
    one, two = (-110.0, 10.0), (40.0, 55.0)
    line = HysteresisZone(at_en=(0.0, 0.0), course_rad=math.pi / 2.0)
    point = HysteresisZone.of_point((0.0, 0.0), twd_from_rad)
    boats = (
        ("Boat 1: line following", AttractiveLine() + RepulsivePoint().shifted(*two), line, one, two),
        ("Boat 2: attractive point", AttractivePoint() + RepulsivePoint().shifted(*one), point, two, one),
    )
    for ax, (title, field, zone, own, other) in zip(figure.subplots(1, 2), boats, strict=True):
        tree = Projection(field=field, twd_from_rad=twd_from_rad, zone=zone)
        draw_field(ax, tree, 200.0, count=21, fan=True)
        draw_zone(ax, zone, 600.0, with_line="line" in title)
        draw_boat(ax, own, tree.steer(own, 1)[0], 26.0, RED)
        draw_boat(ax, other, math.radians(-90.0), 26.0, BLUE)
        ax.plot(0.0, 0.0, "o", color=GREEN, ms=7, zorder=6)
        draw_wind(ax, twd_from_rad)
        ax.set_title(title, fontsize=11)
        ax.set_xlabel("east [m]")
    figure.axes[0].set_ylabel("north [m]")
    figure.suptitle("Vectorfield1 and Vectorfield2, fan of possible directions; q = +1 inside the zone", fontsize=12)
    return figure


def encounter_figure(
    track: NDArray[np.float64],
    intruder: NDArray[np.float64],
    *,
    half_m: float,
    twd_from_rad: float,
    tws_mps: float,
    title: str,
    entered_s: float,
) -> Figure:
    """Return the square, both tracks with boats at equal times, and where they were nearest.

    Args:
        track: (n, 4) or wider: t, east, north, heading of our boat.
        intruder: (n, 2) of the other, at the same times.
        half_m: half side of the square.
        twd_from_rad: wind for the arrow.
        tws_mps: its speed.
        title: of the picture.
        entered_s: when the intruder entered; boats are drawn from then on.

    """
    figure = Figure(figsize=(8.2, 8.0), layout="constrained")
    ax = figure.subplots()
    ax.add_patch(Rectangle((-half_m, -half_m), 2 * half_m, 2 * half_m, fill=False, lw=1.6, color="black"))
    t = track[:, 0]
    before, after = t <= entered_s, t >= entered_s
    ax.plot(track[before, 1], track[before, 2], color=GREY, lw=0.8, label="waiting")
    ax.plot(track[after, 1], track[after, 2], color=RED, lw=1.8, label="ours, after the entry")
    ax.plot(intruder[:, 0], intruder[:, 1], color=BLUE, lw=1.8, label="intruder")
    course = math.atan2(intruder[-1, 0] - intruder[0, 0], intruder[-1, 1] - intruder[0, 1])
    for k, at in enumerate(np.arange(entered_s, float(t[-1]), EVERY_S)):
        i = int(np.searchsorted(t, at))
        draw_boat(ax, (float(track[i, 1]), float(track[i, 2])), float(track[i, 3]), 9.0, RED)
        draw_boat(ax, (float(intruder[i, 0]), float(intruder[i, 1])), course, 9.0, BLUE)
        for p in (track[i, 1:3], intruder[i]):
            ax.annotate(
                f"{k * EVERY_S:.0f} s",
                (float(p[0]), float(p[1])),
                textcoords="offset points",
                xytext=(6, 5),
                fontsize=7,
                annotation_clip=True,
            )
    d = np.hypot(*(track[:, 1:3] - intruder).T)
    i = int(np.argmin(d))
    ax.plot(
        [track[i, 1], intruder[i, 0]],
        [track[i, 2], intruder[i, 1]],
        color=GREEN,
        lw=1.3,
        ls=":",
        label=f"nearest, {d[i]:.0f} m between centres",
    )
    reach = 1.45 * half_m
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_aspect("equal")
    ax.set_xlabel("east [m]")
    ax.set_ylabel("north [m]")
    draw_wind(ax, twd_from_rad, tws_mps)
    ax.legend(loc="lower left", fontsize=8)
    ax.set_title(title, fontsize=11)
    return figure

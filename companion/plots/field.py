"""The picture of a composed field, and of a sail through it."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle as Disc
from matplotlib.patches import Patch, PathPatch, Polygon, Wedge
from numpy.typing import NDArray

from companion.field.projection import HysteresisRing, HysteresisZone
from companion.field.tree import LEAST, Along, AwayFrom, AwayFromLine, OutOf, PointTo, Round, StayAt
from companion.geo.angles import direction
from companion.mission_check import FieldPreview, HeadingFan
from companion.plots.chart import save, scale_bar
from companion.plots.mission import draw_area, outline

BLUE, RED, GREY, GREEN, SAND = "#1f5fa8", "#c23b22", "#8a8a8a", "#2d8a4e", "#d9a441"


def grid(half_m: float, count: int, centre: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    """Return (count², 2) points of a square grid, a half step off the middle so that no centre is hit."""
    x = np.linspace(-half_m, half_m, count) + half_m / count / 3.0
    return np.column_stack([m.ravel() for m in np.meshgrid(x + centre[0], x + centre[1])])


def draw_wind(ax: Axes, twd_from_rad: float, tws_mps: float | None = None) -> None:
    """Draw the wind's arrow in the upper right corner, blowing the way that it points."""
    at = np.array([0.91, 0.89])
    to = -np.array([math.sin(twd_from_rad), math.cos(twd_from_rad)])
    a, b = at - 0.055 * to, at + 0.055 * to
    ax.annotate(
        "",
        xy=(b[0], b[1]),
        xytext=(a[0], a[1]),
        xycoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "lw": 2.2, "color": "black"},
        zorder=6,
    )
    speed = "" if tws_mps is None else f" {tws_mps:.0f} m/s"
    ax.text(
        0.91,
        0.795,
        f"wind{speed}",
        transform=ax.transAxes,
        ha="center",
        va="top",
        fontsize=8,
        bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8},
        zorder=6,
    )


def draw_boat(ax: Axes, en_m: tuple[float, float], heading_rad: float, size_m: float, colour: str) -> None:
    """Draw a boat as a directed triangle."""
    s, c = math.sin(heading_rad), math.cos(heading_rad)
    shape = np.array([(0.0, 0.6), (0.32, -0.4), (-0.32, -0.4)]) * size_m
    turned = np.column_stack([shape[:, 0] * c + shape[:, 1] * s, -shape[:, 0] * s + shape[:, 1] * c])
    ax.add_patch(Polygon(turned + np.asarray(en_m), closed=True, facecolor=colour, edgecolor="black", lw=0.6, zorder=7))


def draw_zone(ax: Axes, zone: HysteresisZone, reach_m: float, *, with_line: bool = True) -> None:
    """Draw the hysteresis zone: its line black, its edges grey."""
    along = np.array([math.sin(zone.course_rad), math.cos(zone.course_rad)]) * reach_m
    left = np.array([-math.cos(zone.course_rad), math.sin(zone.course_rad)]) * zone.half_m
    at = np.asarray(zone.at_en)
    if with_line:
        ax.plot(*np.vstack([at - along, at + along]).T, color="black", lw=1.4, zorder=4)
    for side in (-1.0, 1.0):
        edge = at + side * left
        ax.plot(*np.vstack([edge - along, edge + along]).T, color=GREY, lw=1.0, ls="--", zorder=4)


TURNED = "#d97a1f"  # an arrow that the no-go zone has turned
TRACK = "#7a3fa0"
COUNT = 23


def save_field(
    seen: FieldPreview,
    fan: HeadingFan,
    track: NDArray[np.float64],
    path: str | Path,
    *,
    title: str,
    has_fans: bool = False,
) -> None:
    """Draw a goal's field; ``has_fans``: with Schmitt's fan of possible directions at every arrow."""
    save(field_figure(seen, fan, track, title=title, has_fans=has_fans), path)


def field_figure(
    seen: FieldPreview, fan: HeadingFan, track: NDArray[np.float64], *, title: str, has_fans: bool = False
) -> Figure:
    """Return the picture."""
    figure = plt.figure(figsize=(12.4, 9.2))
    axes, rose, words = (
        figure.add_axes(part)
        for part in ((0.055, 0.06, 0.662, 0.892), (0.745, 0.6, 0.235, 0.317), (0.738, 0.06, 0.25, 0.5))
    )
    handles = draw_area(axes, seen.area, 0.0)
    _draw_arrows(axes, seen, has_fans=has_fans)
    _draw_trajectory(axes, seen)
    _draw_zone(axes, seen)
    if len(track) > 1:
        axes.plot(track[:, 1], track[:, 2], color=TRACK, lw=2.0, alpha=0.85, zorder=6)
        handles.append(Line2D([], [], color=TRACK, lw=2.0, label=f"sailed by it, {_time(track[-1, 0])}"))
    axes.add_patch(Disc(seen.place_en, seen.radius_m, fc="none", ec=GREEN, lw=1.4, zorder=7))
    axes.plot(*seen.place_en, "o", color=GREEN, ms=6, mec="black", mew=0.5, zorder=8)
    axes.annotate(
        seen.name,
        seen.place_en,
        xytext=(7, 7),
        textcoords="offset points",
        fontsize=9,
        zorder=9,
        bbox={"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.75},
    )
    draw_boat(axes, seen.here_en, fan.chosen_rad, 0.055 * seen.half_m, RED)
    axes.set(
        xlim=(seen.centre_en[0] - seen.half_m, seen.centre_en[0] + seen.half_m),
        aspect="equal",
        ylim=(seen.centre_en[1] - seen.half_m, seen.centre_en[1] + seen.half_m),
    )
    axes.set_xlabel("east [m]", fontsize=8)
    axes.set_ylabel("north [m]", fontsize=8)
    axes.tick_params(labelsize=8)
    _draw_rose(rose, seen, fan)
    scale_bar(axes)
    if seen.conditions.twd_from_rad is not None:
        draw_wind(axes, seen.conditions.twd_from_rad, seen.conditions.seen.tws_mps)
    words.axis("off")
    words.legend(
        handles=[*handles, *_handles(seen, has_fans=has_fans)],
        loc="upper left",
        fontsize=9,
        frameon=False,
        borderaxespad=0.0,
    )
    figure.suptitle(title, fontsize=11, x=0.02, ha="left")
    return figure


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"


def _draw_arrows(axes: Axes, seen: FieldPreview, *, has_fans: bool) -> None:
    """Draw arrows in the water: length by the square root of the strength, another colour where they were turned."""
    points = grid(seen.half_m, COUNT, seen.centre_en)
    points = points[seen.area.clearance_m(points) > 0.0]
    if not len(points):
        return
    wanted, v = seen.wanted(points), seen.sailable(points)
    length = np.hypot(v[:, 0], v[:, 1])
    step = 2.0 * seen.half_m / COUNT
    drawn = v / np.maximum(length, 1e-9)[:, None] * (0.9 * step * np.sqrt(np.minimum(length, 30.0) / 20.0))[:, None]
    says = length >= LEAST
    points, wanted, v, drawn, length = points[says], wanted[says], v[says], drawn[says], length[says]
    turned = np.hypot(*(wanted - v).T) > 1e-6 * np.maximum(length, 1e-9)
    if has_fans and seen.projection is not None:
        low, high = seen.projection.fan(points)
        wedges = [
            Wedge((float(p[0]), float(p[1])), 0.6 * step, 90.0 - math.degrees(b), 90.0 - math.degrees(a))
            for p, a, b in zip(points, low, high, strict=True)
            if b > a
        ]
        axes.add_collection(PatchCollection(wedges, facecolor=SAND, alpha=0.35, edgecolor="none", zorder=2.5))
    for which, colour in ((~turned, BLUE), (turned, TURNED)):
        axes.quiver(
            points[which, 0],
            points[which, 1],
            drawn[which, 0],
            drawn[which, 1],
            angles="xy",
            scale_units="xy",
            scale=1.0,
            color=colour,
            width=0.0028,
            headwidth=4.2,
            headlength=5.0,
            zorder=3.5,
        )


def _draw_trajectory(axes: Axes, seen: FieldPreview) -> None:
    """Draw the atoms by what they are."""
    reach = 3.0 * seen.half_m
    for name, atom in seen.tree.atoms:
        at = None
        if isinstance(atom, Round):
            axes.add_patch(Disc(atom.at_en, atom.radius_m, fc="none", ec="black", lw=1.5, zorder=4.5))
            at = atom.at_en[0], atom.at_en[1] + atom.radius_m
        elif isinstance(atom, Along | AwayFromLine):
            e, n = atom.to_en[0] - atom.from_en[0], atom.to_en[1] - atom.from_en[1]
            unit = np.array([e, n]) / max(math.hypot(e, n), 1e-9)
            ends = np.array([atom.from_en - reach * unit, np.asarray(atom.to_en) + reach * unit])
            is_lane = isinstance(atom, Along)
            axes.plot(*ends.T, color="black" if is_lane else RED, lw=0.8, ls=":", zorder=4.5)
            axes.plot(*np.array([atom.from_en, atom.to_en]).T, color="black" if is_lane else RED, lw=1.6, zorder=4.5)
            at = atom.to_en
        elif isinstance(atom, AwayFrom):
            axes.add_patch(Disc(atom.at_en, atom.range_m, fc=RED, alpha=0.10, ec="none", zorder=2.2))
            axes.add_patch(Disc(atom.at_en, atom.range_m, fc="none", ec=RED, lw=1.0, ls=(0, (4, 3)), zorder=4.5))
            axes.plot(*atom.at_en, "x", color=RED, ms=8, mew=1.8, zorder=5)
            at = atom.at_en
        elif isinstance(atom, PointTo | StayAt):
            axes.plot(*atom.at_en, "s" if isinstance(atom, StayAt) else "D", color="black", ms=5, zorder=5)
            at = atom.at_en
        elif isinstance(atom, OutOf):
            axes.add_patch(PathPatch(outline(atom.water_en), fc="none", ec="black", lw=1.5, ls="--", zorder=4.5))
            at = atom.water_en.bounds[0], atom.water_en.bounds[3]
        if at is not None:
            axes.annotate(
                name,
                at,
                xytext=(5, -12),
                textcoords="offset points",
                fontsize=8,
                style="italic",
                zorder=9,
                annotation_clip=True,
                bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7},
            )


def _draw_zone(axes: Axes, seen: FieldPreview) -> None:
    zone = seen.zone
    if isinstance(zone, HysteresisRing):
        for radius in (zone.radius_m - zone.half_m, zone.radius_m + zone.half_m):
            axes.add_patch(Disc(zone.at_en, radius, fc="none", ec=GREY, lw=1.0, ls="--", zorder=4))
    elif isinstance(zone, HysteresisZone):
        draw_zone(axes, zone, 4.0 * seen.half_m, with_line=False)


def _draw_rose(rose: Axes, seen: FieldPreview, fan: HeadingFan) -> None:
    """Draw the boat's candidate headings as a rose: as long as the polar makes it fast."""
    rose.set(xlim=(-1.36, 1.36), ylim=(-1.36, 1.36), aspect="equal", xticks=[], yticks=[])
    twd, half = seen.conditions.twd_from_rad, seen.conditions.habits.no_go_half_rad
    if twd is not None:
        middle = 90.0 - math.degrees(twd)
        shut = math.degrees(half)
        rose.add_patch(Wedge((0.0, 0.0), 1.0, middle - shut, middle + shut, fc=RED, alpha=0.15))
        east, north = math.sin(twd), math.cos(twd)
        rose.annotate(
            "",
            xy=(1.0 * east, 1.0 * north),
            xytext=(1.3 * east, 1.3 * north),
            arrowprops={"arrowstyle": "-|>", "lw": 2.2, "color": "black"},
        )
    fastest = max(float(fan.speeds_mps.max()), 1e-9)
    best = max(float(fan.worth_mps.max()), 1e-9)
    width = math.radians(5.0) * 0.42
    for heading, speed, worth in zip(fan.headings_rad, fan.speeds_mps, fan.worth_mps, strict=True):
        if speed > 0.0:
            reach = speed / fastest
            edge = [(reach * math.sin(heading + d), reach * math.cos(heading + d)) for d in (-width, width)]
            corners = [(0.0, 0.0), *edge]
            share = max(0.0, worth / best)
            rose.add_patch(Polygon(corners, fc=mpl.colormaps["YlGn"](0.15 + 0.75 * share), ec="none"))
    for heading, colour, style in ((fan.wanted_rad, BLUE, "--"), (fan.chosen_rad, RED, "-")):
        rose.annotate(
            "",
            xy=(1.08 * math.sin(heading), 1.08 * math.cos(heading)),
            xytext=(0.0, 0.0),
            arrowprops={"arrowstyle": "-|>", "lw": 1.8, "color": colour, "ls": style},
        )
    wind = "no wind needed" if twd is None else (f"wind {seen.conditions.seen.tws_mps:g} m/s from {direction(twd)}°")
    for knot in (0.5, 1.0):
        rose.add_patch(Disc((0.0, 0.0), knot, fc="none", ec=GREY, lw=0.6, ls=":"))
    told = ", ".join(
        f"{word} {direction(angle)}°" for word, angle in (("wanted", fan.wanted_rad), ("steered", fan.chosen_rad))
    )
    rose.set_title(f"the boat's fan, {wind}\nouter ring {fastest:.1f} m/s; {told}", fontsize=9)


def _handles(seen: FieldPreview, *, has_fans: bool) -> list[Patch | Line2D]:
    def line(colour: str, label: str, **how: object) -> Line2D:
        return Line2D([], [], color=colour, label=label, **how)  # type: ignore[arg-type]

    out: list[Patch | Line2D] = [line(BLUE, "the field", marker=r"$\rightarrow$", ls="", ms=11)]
    if seen.projection is not None:
        out.append(line(TURNED, "turned out of the no-go zone", marker=r"$\rightarrow$", ls="", ms=11))
    if seen.zone is not None:
        out.append(line(GREY, "band in which a tack is kept", ls="--", lw=1.0))
    if any(isinstance(atom, AwayFrom | AwayFromLine) for _, atom in seen.tree.atoms):
        out.append(line(RED, "repels: 37 % of its strength here", ls=(0, (4, 3)), lw=1.0))
    if has_fans and seen.projection is not None:
        out.append(Patch(fc=SAND, alpha=0.5, label="fan of possible directions (Schmitt 4.4)"))
    out += [
        line(BLUE, "in the fan: wanted", ls="--", lw=1.8),
        line(RED, "in the fan: steered", lw=1.8),
        Patch(fc="#4aa85f", label="candidates: as long as fast, as green as good"),
    ]
    return out

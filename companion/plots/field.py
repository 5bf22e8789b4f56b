"""Pictures of vector fields, as in Schmitt's Figures 4.4 and 6.1 to 6.5, and of a sail through one."""

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
from matplotlib.patches import Patch, PathPatch, Polygon, Rectangle, Wedge
from numpy.typing import NDArray

from companion.field.projection import HysteresisRing, HysteresisZone, Projection
from companion.field.tree import LEAST, Along, AwayFrom, AwayFromLine, OutOf, PointTo, Round, StayAt
from companion.field.vector_fields import (
    AttractiveCircle,
    AttractiveLine,
    AttractivePoint,
    Field,
    RepulsiveLine,
    RepulsivePoint,
)
from companion.mission_check import FieldPreview, HeadingFan
from companion.plots.chart import save, scale_bar
from companion.plots.mission import draw_area, outline

BLUE, RED, GREY, GREEN, SAND = "#1f5fa8", "#c23b22", "#8a8a8a", "#2d8a4e", "#d9a441"


def grid(half_m: float, count: int, centre: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    """Return (count², 2) points of a square grid, a half step off the middle so that no centre is hit."""
    x = np.linspace(-half_m, half_m, count) + half_m / count / 3.0
    return np.column_stack([m.ravel() for m in np.meshgrid(x + centre[0], x + centre[1])])


def draw_field(
    ax: Axes, field: Field | Projection, half_m: float, *, count: int = 21, fan: bool = False, q: int = 1,
    colour: str = BLUE, centre: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Draw the arrows of a field; ``fan`` adds the sector of possible directions of a projected one."""
    points = grid(half_m, count, centre)
    v = field.evaluate(points, q) if isinstance(field, Projection) else field(points)
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
    ax.quiver(points[:, 0], points[:, 1], drawn[:, 0], drawn[:, 1], angles="xy", scale_units="xy", scale=1.0,
              color=colour, width=0.0032, headwidth=4.0, headlength=5.0, zorder=3)
    ax.set_xlim(centre[0] - half_m, centre[0] + half_m)
    ax.set_ylim(centre[1] - half_m, centre[1] + half_m)
    ax.set_aspect("equal")
    ax.grid(visible=False)


def draw_wind(ax: Axes, twd_from_rad: float, tws_mps: float | None = None) -> None:
    """Draw the wind's arrow in the upper right corner, blowing the way that it points."""
    at = np.array([0.91, 0.89])
    to = -np.array([math.sin(twd_from_rad), math.cos(twd_from_rad)])
    a, b = at - 0.055 * to, at + 0.055 * to
    ax.annotate("", xy=(b[0], b[1]), xytext=(a[0], a[1]), xycoords="axes fraction",
                arrowprops={"arrowstyle": "-|>", "lw": 2.2, "color": "black"}, zorder=6)
    speed = "" if tws_mps is None else f" {tws_mps:.0f} m/s"
    ax.text(0.91, 0.795, f"wind{speed}", transform=ax.transAxes, ha="center", va="top", fontsize=8,
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8}, zorder=6)


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


def atoms_figure() -> Figure:
    """Return the five atoms, Figures 6.1 to 6.5."""
    figure = Figure(figsize=(12.0, 8.2), layout="constrained")
    axes = figure.subplots(2, 3)
    atoms: list[tuple[str, Field, float]] = [
        ("6.1 Line following", AttractiveLine(), 120.0), ("6.2 Circle following (10 m)", AttractiveCircle(), 25.0),
        ("6.3 Attractive point", AttractivePoint(), 12.0), ("6.4 Repulsive line", RepulsiveLine(), 200.0),
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
    last.text(0.0, 0.6, "Arrows: direction of the field; their length grows with\nthe square root of its strength "
              "(nominal 10, repulsive\nup to 20 with a Gaussian of 100 m).", fontsize=9, va="center")
    figure.suptitle("Schmitt's atomic vector fields", fontsize=12)
    return figure


def trees_figure(twd_from_rad: float = math.radians(90.0)) -> Figure:
    """Return the two example trees with zones and fans, as in Figure 4.4."""
    figure = Figure(figsize=(13.0, 6.7), layout="constrained")
    one, two = (-110.0, 10.0), (40.0, 55.0)
    line = HysteresisZone(at_en=(0.0, 0.0), course_rad=math.pi / 2.0)
    point = HysteresisZone.of_point((0.0, 0.0), twd_from_rad)
    boats = (("Boat 1: line following", AttractiveLine() + RepulsivePoint().shifted(*two), line, one, two),
             ("Boat 2: attractive point", AttractivePoint() + RepulsivePoint().shifted(*one), point, two, one))
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
    track: NDArray[np.float64], intruder: NDArray[np.float64], *, half_m: float, twd_from_rad: float, tws_mps: float,
    title: str, entered_s: float, every_s: float = 20.0,
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
        every_s: between drawn boats.

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
    for k, at in enumerate(np.arange(entered_s, float(t[-1]), every_s)):
        i = int(np.searchsorted(t, at))
        draw_boat(ax, (float(track[i, 1]), float(track[i, 2])), float(track[i, 3]), 9.0, RED)
        draw_boat(ax, (float(intruder[i, 0]), float(intruder[i, 1])), course, 9.0, BLUE)
        for p in (track[i, 1:3], intruder[i]):
            ax.annotate(f"{k * every_s:.0f} s", (float(p[0]), float(p[1])), textcoords="offset points",
                        xytext=(6, 5), fontsize=7, annotation_clip=True)
    d = np.hypot(*(track[:, 1:3] - intruder).T)
    i = int(np.argmin(d))
    ax.plot([track[i, 1], intruder[i, 0]], [track[i, 2], intruder[i, 1]], color=GREEN, lw=1.3, ls=":",
            label=f"nearest, {d[i]:.0f} m between centres")
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


TURNED = "#d97a1f"     # an arrow that the no-go zone has turned
TRACK = "#7a3fa0"
COUNT = 23


def save_field(
    seen: FieldPreview, fan: HeadingFan, track: NDArray[np.float64], path: str | Path, *, title: str,
    has_fans: bool = False,
) -> None:
    """Draw a goal's field; ``has_fans``: with Schmitt's fan of possible directions at every arrow."""
    save(field_figure(seen, fan, track, title=title, has_fans=has_fans), path)


def field_figure(
    seen: FieldPreview, fan: HeadingFan, track: NDArray[np.float64], *, title: str, has_fans: bool = False,
) -> Figure:
    """Return the picture."""
    figure = plt.figure(figsize=(12.4, 9.2))
    axes, rose, words = (figure.add_axes(part) for part in (
        (0.055, 0.06, 0.662, 0.892), (0.745, 0.6, 0.235, 0.317), (0.738, 0.06, 0.25, 0.5)))
    handles = draw_area(axes, seen.area, 0.0)
    _draw_arrows(axes, seen, has_fans=has_fans)
    _draw_trajectory(axes, seen)
    _draw_zone(axes, seen)
    if len(track) > 1:
        axes.plot(track[:, 1], track[:, 2], color=TRACK, lw=2.0, alpha=0.85, zorder=6)
        handles.append(Line2D([], [], color=TRACK, lw=2.0, label=f"sailed by it, {_time(track[-1, 0])}"))
    axes.add_patch(Disc(seen.place_en, seen.radius_m, fc="none", ec=GREEN, lw=1.4, zorder=7))
    axes.plot(*seen.place_en, "o", color=GREEN, ms=6, mec="black", mew=0.5, zorder=8)
    axes.annotate(seen.name, seen.place_en, xytext=(7, 7), textcoords="offset points", fontsize=9, zorder=9,
                  bbox={"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.75})
    draw_boat(axes, seen.here_en, fan.chosen_rad, 0.055 * seen.half_m, RED)
    axes.set(xlim=(seen.centre_en[0] - seen.half_m, seen.centre_en[0] + seen.half_m), aspect="equal",
             ylim=(seen.centre_en[1] - seen.half_m, seen.centre_en[1] + seen.half_m))
    axes.set_xlabel("east [m]", fontsize=8)
    axes.set_ylabel("north [m]", fontsize=8)
    axes.tick_params(labelsize=8)
    _draw_rose(rose, seen, fan)
    scale_bar(axes)
    if seen.conditions.twd_from_rad is not None:
        draw_wind(axes, seen.conditions.twd_from_rad, seen.conditions.seen.tws_mps)
    words.axis("off")
    words.legend(handles=[*handles, *_handles(seen, has_fans=has_fans)], loc="upper left", fontsize=9, frameon=False,
                 borderaxespad=0.0)
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
        wedges = [Wedge((float(p[0]), float(p[1])), 0.6 * step, 90.0 - math.degrees(b), 90.0 - math.degrees(a))
                  for p, a, b in zip(points, low, high, strict=True) if b > a]
        axes.add_collection(PatchCollection(wedges, facecolor=SAND, alpha=0.35, edgecolor="none", zorder=2.5))
    for which, colour in ((~turned, BLUE), (turned, TURNED)):
        axes.quiver(points[which, 0], points[which, 1], drawn[which, 0], drawn[which, 1], angles="xy", scale_units="xy",
                    scale=1.0, color=colour, width=0.0028, headwidth=4.2, headlength=5.0, zorder=3.5)


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
            axes.annotate(name, at, xytext=(5, -12), textcoords="offset points", fontsize=8, style="italic", zorder=9,
                          annotation_clip=True,
                          bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7})


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
        rose.annotate("", xy=(1.0 * east, 1.0 * north), xytext=(1.3 * east, 1.3 * north),
                      arrowprops={"arrowstyle": "-|>", "lw": 2.2, "color": "black"})
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
        rose.annotate("", xy=(1.08 * math.sin(heading), 1.08 * math.cos(heading)), xytext=(0.0, 0.0),
                      arrowprops={"arrowstyle": "-|>", "lw": 1.8, "color": colour, "ls": style})
    wind = "no wind needed" if twd is None else (
        f"wind {seen.conditions.seen.tws_mps:g} m/s from {math.degrees(twd) % 360.0:03.0f}°")
    for knot in (0.5, 1.0):
        rose.add_patch(Disc((0.0, 0.0), knot, fc="none", ec=GREY, lw=0.6, ls=":"))
    told = ", ".join(f"{word} {math.degrees(angle) % 360.0:03.0f}°" for word, angle in (
        ("wanted", fan.wanted_rad), ("steered", fan.chosen_rad)))
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
    out += [line(BLUE, "in the fan: wanted", ls="--", lw=1.8), line(RED, "in the fan: steered", lw=1.8),
            Patch(fc="#4aa85f", label="candidates: as long as fast, as green as good")]
    return out

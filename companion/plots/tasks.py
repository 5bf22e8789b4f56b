"""What regatta and area tasks look like on a chart: lines, which way they are crossed, water to stay in or search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.geo.angles import heading_of, unit_en
from companion.geofence import LocalArea, Mission
from companion.geofence.mission import free_water
from companion.geofence.shapes import polygon_en
from companion.skipper.way import Sweep, sweeps_over

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

PORT, STARBOARD, LINE = "#c0392b", "#1e8449", "#5b2c83"
TASK_WATER = "box to stay in, area to search"
ARROW_SHARE = 0.35   # of the line's length

En = tuple[float, float]


def draw_gate(axes: Axes, port: En, starboard: En, name: str) -> None:
    """Draw two marks, the line between them and an arrow in the direction of crossing."""
    axes.plot(*zip(port, starboard, strict=True), color=LINE, lw=1.4, ls=(0, (5, 2)), zorder=7)
    for mark, colour in ((port, PORT), (starboard, STARBOARD)):
        axes.plot(*mark, "o", color=colour, ms=6, mec="black", mew=0.6, zorder=8)
    middle = ((port[0] + starboard[0]) / 2.0, (port[1] + starboard[1]) / 2.0)
    way = heading_of(starboard[0] - port[0], starboard[1] - port[1]) - math.pi / 2.0
    east, north = unit_en(way)
    length_m = ARROW_SHARE * math.dist(port, starboard)
    axes.annotate("", (middle[0] + length_m * east, middle[1] + length_m * north), middle,
                  arrowprops={"arrowstyle": "-|>", "lw": 1.4, "color": LINE}, zorder=8)
    axes.annotate(name, starboard, xytext=(8, 6), textcoords="offset points", fontsize=8, zorder=9)


def gate_handles() -> list[Line2D]:
    """Return what a legend says of gates."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=LINE, lw=1.4, ls=(0, (5, 2)), label="gate, crossed as its arrow points"),
        Line2D([], [], color=PORT, marker="o", ls="", ms=6, mec="black", mew=0.6, label="port mark"),
        Line2D([], [], color=STARBOARD, marker="o", ls="", ms=6, mec="black", mew=0.6, label="starboard mark"),
    ]


def draw_water(axes: Axes, area: BaseGeometry, name: str) -> None:
    """Draw water that is a goal: a box to stay in, an area to search."""
    for part in shapely.get_parts(area):
        ring = np.asarray(part.exterior.coords)
        axes.fill(ring[:, 0], ring[:, 1], fc=LINE, alpha=0.12, ec="none", zorder=3.5)
        axes.plot(ring[:, 0], ring[:, 1], color=LINE, lw=1.3, zorder=7)
    corners = shapely.get_coordinates(area)
    top = corners[int(np.argmax(corners[:, 1]))]
    axes.annotate(name, (float(top[0]), float(top[1])), xytext=(0, 4), textcoords="offset points", fontsize=8, zorder=9)


def water_handle(label: str) -> Line2D:
    """Return what a legend says of it."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=LINE, lw=1.3, marker="s", mfc="none", label=label)


def corners_of(mission: Mission) -> list[En]:
    """Return what must be seen of goals that are no points: marks of gates, corners of boxes and searches."""
    frame, out = mission.frame(), list[En]()
    for goal in mission.goals:
        water = goal.box or goal.search
        if goal.gate is not None:
            out += [frame.en_from_geo(goal.gate.port), frame.en_from_geo(goal.gate.starboard)]
        elif water is not None:
            west, south, east, north = polygon_en(water.shape, frame, cover=False).bounds
            out += [(west, south), (east, north)]
    return out


def sweeps_of(
    mission: Mission, local: LocalArea, start: En | None, twd_from_rad: float,
) -> list[tuple[str, tuple[Sweep, ...]]]:
    """Return the sweeps of each search as they would be laid for this wind; under way they are for the wind then."""
    out = []
    for goal in mission.goals:
        if goal.search is None:
            continue
        water = free_water(goal.search.shape, mission.frame(), mission.area)
        if local.polygons:
            water = shapely.difference(water, local.buffered(mission.margin_m))
        inner = local.water(mission.margin_m)
        water = water if inner is None else shapely.intersection(water, inner)
        near = start or mission.frame().en_from_geo(goal.point)
        out.append((goal.name or "search", sweeps_over(water, goal.search.swath_m, twd_from_rad, near)))
    return out


def draw_sweeps(axes: Axes, sweeps: Sequence[tuple[str, tuple[Sweep, ...]]]) -> list[Line2D]:
    """Draw sweeps; return the legend's handles."""
    from matplotlib.lines import Line2D

    for _, laid in sweeps:
        for a, b in laid:
            axes.plot(*zip(a, b, strict=True), color=LINE, lw=1.0, zorder=6)
    return [Line2D([], [], color=LINE, lw=1.0, label="sweeps in this wind")] if sweeps else []

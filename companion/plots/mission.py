"""Pictures of missions before they are sailed: land, margins, fences, marks, laylines for a wind, a plan."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.lines import Line2D
from matplotlib.patches import Circle as Disc
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as DrawnPath
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from companion.errors import InputError
from companion.geo.angles import difference_rad, direction, heading_of, unit_en
from companion.geo.frame import LocalFrame
from companion.geofence import Area, LocalArea, Mission, ZoneKind
from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot
from companion.geofence.mission import free_water
from companion.geofence.shapes import center_of, polygon_en
from companion.messages import GeoPoint
from companion.mission_check import is_of_unknown_length, wait_words, waits_s
from companion.planner.courses import courses
from companion.plots.chart import place_words, save, scale_bar
from companion.plots.drying import DryingPicture, draw_drying
from companion.skipper.way import Sweep, length_m, sweeps_over
from companion.words import counted, listed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from companion.planner import Plan


PORT, STARBOARD, LINE = "#c0392b", "#1e8449", "#5b2c83"
TASK_WATER = "box to stay in, area to search"
ARROW_SHARE = 0.35  # of the line's length

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
    axes.annotate(
        "",
        (middle[0] + length_m * east, middle[1] + length_m * north),
        middle,
        arrowprops={"arrowstyle": "-|>", "lw": 1.4, "color": LINE},
        zorder=8,
    )
    axes.annotate(name, starboard, xytext=(8, 6), textcoords="offset points", fontsize=8, zorder=9)


def gate_handles() -> list[Line2D]:
    """Return what a legend says of gates."""
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


def water_handle() -> Line2D:
    """Return what a legend says of water that is a task."""
    return Line2D([], [], color=LINE, lw=1.3, marker="s", mfc="none", label=TASK_WATER)


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
    mission: Mission, local: LocalArea, start: En | None, twd_from_rad: float
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
    for _, laid in sweeps:
        for a, b in laid:
            axes.plot(*zip(a, b, strict=True), color=LINE, lw=1.0, zorder=6)
    return [Line2D([], [], color=LINE, lw=1.0, label="sweeps in this wind")] if sweeps else []


LAND, LAND_EDGE, SEA = "#d9cfb4", "#8d7f5a", "#eaf3f8"
MARGIN, LIMIT, AUTOPILOT = "#f0b27a", "#34495e", "#8e44ad"
PATH, START, GOAL, WIND = "#1f4e9c", "#00a3b4", "#d68910", "#1f4e79"

Handle = Patch | Line2D
Points = NDArray[np.float64]


def save_mission(
    mission: Mission,
    path: str | Path,
    *,
    tws_mps: float,
    twd_from_rad: float,
    beat_rad: float,
    plans: Sequence[Plan] = (),
    drying: DryingPicture | None = None,
) -> list[str]:
    """Draw a mission and save it; return what the picture has to say in words.

    ``beat_rad`` is the angle to the wind of the course by which plans lay a mark in this wind, for the laylines;
    ``plans`` lead from goal to goal; ``drying`` is the water that dries. Raises InputError when the file cannot be
    written.
    """
    frame = mission.frame()
    local = mission.water()
    start = frame.en_from_geo(mission.start) if mission.start is not None else None
    goals = [frame.en_from_geo(g.point) for g in mission.goals]
    figure, axes = plt.subplots(figsize=(8.0, 8.6), layout="constrained")
    handles = draw_area(axes, local, mission.margin_m)
    handles += draw_drying(axes, drying) if drying is not None else []
    handles += _draw_autopilot(axes, mission, frame)
    legs = [np.asarray(p.waypoints_en) for p in plans if p.has_path]
    places = [*([start] if start is not None else []), *goals]
    refuges = [(frame.en_from_geo(r.point), f"refuge {r.name}") for r in mission.refuges]
    extent = extent_of(local, [*places, *(place for place, _ in refuges), *corners_of(mission)], legs)
    handles += _draw_laylines(axes, places, twd_from_rad, beat_rad, extent)
    for leg in legs:
        axes.plot(leg[:, 0], leg[:, 1], "-", color=PATH, lw=1.8, zorder=6, solid_joinstyle="round")
        axes.plot(leg[1:-1, 0], leg[1:-1, 1], "o", color=PATH, ms=3.0, zorder=6)
    if legs:
        handles.append(Line2D([], [], color=PATH, lw=1.8, label="plan in this wind, held steady"))
    sweeps = sweeps_of(mission, local, start, twd_from_rad)
    handles += [*draw_marks(axes, mission, start, goals), *draw_sweeps(axes, sweeps)]
    for place, name in refuges:
        axes.plot(*place, "P", color=GOAL, ms=8, mec="black", mew=0.6, zorder=8)
        axes.annotate(name, place, xytext=(8, 6), textcoords="offset points", fontsize=8, zorder=9)
    if refuges:
        handles.append(Line2D([], [], ls="", marker="P", color=GOAL, ms=8, mec="black", mew=0.6, label="refuge"))
    _finish(axes, extent, twd_from_rad, tws_mps, handles)
    words = _words(mission, plans, tws_mps=tws_mps, twd_from_rad=twd_from_rad) + [
        f"{name}: {counted(len(laid), 'sweep')}, {length_m(laid):.0f} m, beside the time of the way there"
        for name, laid in sweeps
    ]
    subtitle = words[0] if words else mission.options.description
    where = place_words(mission.origin.lat_deg, mission.origin.lon_deg)
    figure.suptitle(f"{mission.name}   ·   {where}\n{subtitle}", fontsize=10, x=0.1, ha="left")
    save(figure, path)
    return words


def save_area(
    area: Area,
    path: str | Path,
    *,
    start: GeoPoint | None = None,
    goals: tuple[GeoPoint, ...] = (),
    margin_m: float = 0.0,
    twd_from_rad: float | None = None,
    no_go_half_rad: float = math.radians(47.0),
    title: str = "",
    names: Sequence[str] = (),
) -> None:
    """Draw an area alone and save it; ``names`` are the goals'. Raises InputError when the file cannot be written."""
    shapes = [z.shape for z in area.fence.inclusions] + [o.shape for o in area.solids]
    if not shapes and start is None:
        raise InputError(str(path), "", "there is nothing to draw")
    frame = LocalFrame(start or (goals[0] if goals else center_of(shapes[0])))
    local = area.local(frame)
    places = [frame.en_from_geo(p) for p in ((start,) if start else ()) + goals]
    figure, axes = plt.subplots(figsize=(8.0, 8.6), layout="constrained")
    handles = draw_area(axes, local, margin_m)
    extent = extent_of(local, places, [])
    if twd_from_rad is not None:
        handles += _draw_laylines(axes, places, twd_from_rad, no_go_half_rad, extent)
    for index, place in enumerate(places):
        is_start = start is not None and index == 0
        axes.plot(*place, "o", color=START if is_start else GOAL, ms=8, mec="black", mew=0.6, zorder=8)
        number = index + (start is None)  # of a goal, from 1
        name = "start" if is_start else (names[number - 1] if number <= len(names) else "") or f"goal {number}"
        axes.annotate(
            name, place, xytext=(7, -10) if is_start else (8, 6), textcoords="offset points", fontsize=8, zorder=9
        )
    handles += [_dot(START, "start")] if start is not None else []
    handles += [_dot(GOAL, "goal")] if goals else []
    _finish(axes, extent, twd_from_rad, None, handles)
    where = place_words(frame.origin.lat_deg, frame.origin.lon_deg)
    figure.suptitle(f"{title}   ·   {where}", fontsize=10, x=0.1, ha="left")
    save(figure, path)


def draw_area(axes: Axes, local: LocalArea, margin_m: float) -> list[Handle]:
    """Draw land, the margin round it, and the limits; return the legend's handles."""
    handles: list[Handle] = []
    axes.set_facecolor(SEA)
    water = local.limits
    if water is not None:
        beyond = shapely.difference(shapely.box(-1e5, -1e5, 1e5, 1e5), water)
        axes.add_patch(PathPatch(outline(beyond), fc="#c9d3da", ec="none", zorder=1))
        axes.add_patch(PathPatch(outline(water), fc="none", ec=LIMIT, lw=1.4, zorder=4))
        handles.append(Patch(fc="#c9d3da", ec=LIMIT, label="outside the fence"))
    if margin_m > 0.0:
        closed: BaseGeometry = local.buffered(margin_m) if local.polygons else MultiPolygon()
        inner = local.water(margin_m)
        if water is not None and inner is not None:
            closed = shapely.intersection(shapely.union(closed, shapely.difference(water, inner)), water)
        if not closed.is_empty:
            axes.add_patch(PathPatch(outline(closed), fc=MARGIN, alpha=0.35, ec=MARGIN, lw=0.8, zorder=2))
            handles.append(Patch(fc=MARGIN, alpha=0.35, label=f"margin of {margin_m:g} m: no plan enters"))
    if local.polygons:
        axes.add_patch(PathPatch(outline(local.solid), fc=LAND, ec=LAND_EDGE, lw=0.9, zorder=3))
        handles.append(Patch(fc=LAND, ec=LAND_EDGE, label="obstacles"))
        if len(local.polygons) <= 30:
            for name, polygon in zip(local.names, local.polygons, strict=True):
                at = polygon.representative_point()
                axes.annotate(
                    name,
                    (at.x, at.y),
                    fontsize=6.5,
                    ha="center",
                    va="center",
                    color="#5b5135",
                    zorder=5,
                    annotation_clip=True,
                )
    return handles


def _draw_autopilot(axes: Axes, mission: Mission, frame: LocalFrame) -> list[Handle]:
    """Draw the autopilot's own fence where there is one."""
    inside = [*([mission.start] if mission.start else []), *mission.places]
    result = fence_for_autopilot(mission.area, mission.margin_m, inside=inside)
    if result.status is not FenceStatus.OK:
        return []
    for zone in result.zones:
        ring = polygon_en(zone.shape, frame, cover=zone.kind is ZoneKind.EXCLUSION)
        axes.add_patch(PathPatch(outline(ring), fc="none", ec=AUTOPILOT, lw=0.9, ls=(0, (3, 2)), zorder=4))
    held = f", {result.reach_m:.0f} m about the straight way" if result.left_out else ""
    label = f"fence on the autopilot ({counted(len(result.items), 'item')}{held})"
    return [Line2D([], [], color=AUTOPILOT, lw=0.9, ls=(0, (3, 2)), label=label)]


def _draw_laylines(
    axes: Axes, places: list[En], twd_from_rad: float, beat_rad: float, extent: tuple[float, float, float, float]
) -> list[Handle]:
    """Draw the two laylines of each mark that lies to windward of the place before it."""
    reach_m = math.hypot(extent[2] - extent[0], extent[3] - extent[1])
    drawn = False
    for before, mark in itertools.pairwise(places):
        course_rad = heading_of(mark[0] - before[0], mark[1] - before[1])
        if abs(difference_rad(course_rad, twd_from_rad)) >= beat_rad:
            continue
        drawn = True
        length_m = min(reach_m, 1.1 * math.hypot(mark[0] - before[0], mark[1] - before[1]))
        for side, colour in ((-1.0, STARBOARD), (1.0, PORT)):  # wind over starboard: heading = from - angle
            east, north = unit_en(twd_from_rad + side * beat_rad)
            axes.plot(
                [mark[0], mark[0] - length_m * east],
                [mark[1], mark[1] - length_m * north],
                color=colour,
                lw=1.0,
                ls=(0, (7, 3)),
                zorder=4,
            )
    if not drawn:
        return []
    angle = f"{math.degrees(beat_rad):.0f}° off the wind"
    return [
        Line2D([], [], color=colour, lw=1.0, ls=(0, (7, 3)), label=f"layline, {tack} tack ({angle})")
        for tack, colour in (("starboard", STARBOARD), ("port", PORT))
    ]


def draw_marks(axes: Axes, mission: Mission, start: En | None, goals: list[En]) -> list[Handle]:
    """Draw start and goals by their names; return the legend's handles."""
    handles: list[Handle] = []
    if start is not None:
        axes.plot(*start, "o", color=START, ms=8, mec="black", mew=0.6, zorder=8)
        axes.annotate("start", start, xytext=(7, -10), textcoords="offset points", fontsize=8, zorder=9)
        handles.append(_dot(START, "start"))
    for index, (place, goal) in enumerate(zip(goals, mission.goals, strict=True)):
        name = goal.name or (f"goal {index + 1}" if len(goals) > 1 else "goal")
        if goal.gate is not None:
            draw_gate(
                axes,
                mission.frame().en_from_geo(goal.gate.port),
                mission.frame().en_from_geo(goal.gate.starboard),
                name,
            )
            continue
        water = goal.box or goal.search
        if water is not None:
            draw_water(axes, polygon_en(water.shape, mission.frame(), cover=False), name)
            continue
        colour = {"port": PORT, "starboard": STARBOARD}.get(goal.rounding or "", GOAL)
        axes.add_patch(Disc(place, goal.radius_m, fc="none", ec=colour, lw=1.3, zorder=7))
        axes.plot(*place, "o", color=colour, ms=6, mec="black", mew=0.6, zorder=8)
        text = f"{name}\nleave to {goal.rounding}" if goal.rounding else name
        axes.annotate(text, place, xytext=(8, 6), textcoords="offset points", fontsize=8, zorder=9)
    for side, colour in (("", GOAL), ("port", PORT), ("starboard", STARBOARD)):
        if any((goal.rounding or "") == side and not (goal.gate or goal.box or goal.search) for goal in mission.goals):
            handles.append(_dot(colour, f"mark to leave to {side}" if side else "goal and its radius"))
    if any(goal.gate is not None for goal in mission.goals):
        handles += gate_handles()
    if any(goal.box or goal.search for goal in mission.goals):
        handles.append(water_handle())
    return handles


def _dot(colour: str, label: str) -> Line2D:
    return Line2D([], [], color=colour, marker="o", ls="", ms=7, mec="black", mew=0.6, label=label)


def _finish(
    axes: Axes,
    extent: tuple[float, float, float, float],
    twd_from_rad: float | None,
    tws_mps: float | None,
    handles: list[Handle],
) -> None:
    axes.set(xlim=(extent[0], extent[2]), ylim=(extent[1], extent[3]), aspect="equal")
    axes.tick_params(labelsize=7)
    axes.set_xlabel("east of the start [m]", fontsize=8)
    axes.set_ylabel("north of the start [m]", fontsize=8)
    axes.grid(visible=True, color="white", lw=0.6, zorder=0)
    scale_bar(axes)
    if twd_from_rad is not None:
        east, north = unit_en(twd_from_rad)
        cx, cy, size = 0.91, 0.91, 0.05
        axes.annotate(
            "",
            (cx - size * east, cy - size * north),
            (cx + size * east, cy + size * north),
            xycoords="axes fraction",
            textcoords="axes fraction",
            arrowprops={"arrowstyle": "-|>", "lw": 2.0, "color": WIND},
            zorder=10,
        )
        speed = f", {tws_mps:g} m/s" if tws_mps is not None else ""
        axes.text(
            cx,
            cy - 0.075,
            f"from {direction(twd_from_rad)}°{speed}",
            transform=axes.transAxes,
            ha="center",
            va="top",
            fontsize=8,
            color=WIND,
            zorder=10,
            bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 1.5},
        )
    figure = axes.get_figure(root=True)
    if handles and figure is not None:
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8, frameon=False)


def extent_of(local: LocalArea, places: list[En], paths: list[Points]) -> tuple[float, float, float, float]:
    """Return a square that holds the places, the paths, and what land lies about them."""
    xy = [np.array(places).reshape(-1, 2), *paths]
    points = np.vstack(xy)
    if points.shape[0] == 0:
        shapes = [*local.polygons, *([local.limits] if local.limits is not None else [])]
        west, south, east, north = shapely.total_bounds(shapes)
    else:
        (west, south), (east, north) = points.min(axis=0), points.max(axis=0)
        span = max(east - west, north - south)
        near = shapely.box(west, south, east, north).buffer(max(150.0, 0.35 * span))
        shapes = [p for p in local.polygons if shapely.intersects(near, p)]
        if local.limits is not None and not local.limits.is_empty:
            near = shapely.box(west, south, east, north).buffer(max(300.0, 1.5 * span))
            shapes.append(local.limits)
        clipped = [shapely.intersection(near, s) for s in shapes]
        bounds = np.array([c.bounds for c in clipped if not c.is_empty] or [(west, south, east, north)])
        west, south = min(west, bounds[:, 0].min()), min(south, bounds[:, 1].min())
        east, north = max(east, bounds[:, 2].max()), max(north, bounds[:, 3].max())
    half = 0.54 * max(east - west, north - south, 20.0)
    cx, cy = (west + east) / 2.0, (south + north) / 2.0
    return float(cx - half), float(cy - half), float(cx + half), float(cy + half)


def _words(mission: Mission, plans: Sequence[Plan], *, tws_mps: float, twd_from_rad: float) -> list[str]:
    """Return what came of the plans in that wind, one line each."""
    out = []
    are_many = len(mission.goals) > 1
    names = [goal.name or (f"goal {n}" if are_many else "goal") for n, goal in enumerate(mission.goals, start=1)]
    names.append("home")
    waits = waits_s(mission, [p.cost_s for p in plans if p.has_path])
    told = [wait_words(goal, wait_s) for goal, wait_s in zip(mission.goals, waits, strict=False)]
    for name, answer, wait in zip(names, plans, [*told, ""], strict=False):
        if answer.has_path:
            sails = f"{name}: {answer.cost_s:.0f} s in {counted(len(courses(answer.legs)), 'course')}"
            out.append(f"{sails}, {wait}" if wait else sails)
        else:
            out.append(f"{name}: no path ({answer.status.value}): {answer.reason}")
    if len(out) > 1 and all(p.has_path for p in plans):
        sailing_s, waiting_s = sum(p.cost_s for p in plans), sum(waits)
        open_ended = [name for name, goal in zip(names, mission.goals, strict=False) if is_of_unknown_length(goal)]
        out.insert(
            0,
            f"{sailing_s + waiting_s:.0f} s to all {min(len(plans), len(mission.goals))} goals"
            + (" and home" if len(plans) > len(mission.goals) else "")
            + f" in {tws_mps:g} m/s of wind from {direction(twd_from_rad)}°"
            + (f": {sailing_s:.0f} s of sailing, {waiting_s:.0f} s of waiting" if waiting_s else "")
            + (f", {listed(open_ended)} itself not counted" if open_ended else ""),
        )
    if plans and any(g.rounding or g.gate for g in mission.goals):
        out.append("the preview sails to the marks; on which side they are left is the skipper's part")
    return out


def outline(shape: BaseGeometry) -> DrawnPath:
    """Return the rings of a polygonal geometry as a path; holes stay holes."""
    points: list[Points] = []
    codes: list[int] = []
    for part in shapely.get_parts(shape):
        if not isinstance(part, Polygon) or part.is_empty:
            continue
        oriented = shapely.geometry.polygon.orient(part)
        for ring in (oriented.exterior, *oriented.interiors):
            xy = np.asarray(ring.coords)[:, :2]
            points.append(xy)
            codes += [int(DrawnPath.MOVETO), *([int(DrawnPath.LINETO)] * (len(xy) - 2)), int(DrawnPath.CLOSEPOLY)]
    if not points:
        return DrawnPath(np.zeros((0, 2)))
    return DrawnPath(np.vstack(points), codes)

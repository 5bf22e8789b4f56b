"""Pictures of plans: the problem, the search, the path with its no-go fans widening along it, the bound."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

from companion.planner.problem import resolved

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle, PathPatch, Wedge
from matplotlib.path import Path as DrawnPath

from companion.planner.courses import courses
from companion.plots.chart import legend_below, save, scale_bar
from companion.plots.drying import DryingPicture, draw_drying
from companion.plots.mission import draw_area
from companion.words import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from companion.geofence import LocalArea
    from companion.planner import Plan, Problem

LAND, LAND_EDGE = "#d9cfb4", "#8d7f5a"
SEA, TREE, MARGIN = "#f2f7fa", "#9db4c4", "#d98c5f"
PATH, START, GOAL = "#c1272d", "#00a3b4", "#2e8b3d"
# Pale, and opaque: where they lie over one another they stay the colours of the legend.
FAN, WIDER = "#efcc9b", "#caafdb"
CLOSED = "#4f7a5c"
FANS_MOST = 14


def save_plan(
    problem: Problem,
    plan: Plan,
    path: str | Path,
    *,
    area: LocalArea | None = None,
    margin_m: float = 0.0,
    drying: DryingPicture | None = None,
) -> None:
    """Draw a plan and save it.

    Args:
        problem: What was planned.
        plan: Its plan, with or without a path.
        path: The picture.
        area: What the problem's obstacles are without the margin that they have grown by.
        margin_m: That margin [m].
        drying: The water that dries, when the plan begins.

    Raises:
        InputError: the file cannot be written or its kind is unknown.
    """
    figure, axes = plt.subplots(figsize=(8.0, 8.6), layout="constrained")
    handles = [] if area is None else draw_area(axes, area, margin_m)
    handles += [] if drying is None else draw_drying(axes, drying)
    draw_plan(axes, problem, plan, solids=area is None)
    scale_bar(axes)
    legend_below(axes, columns=3, more=handles)
    save(figure, path)


def draw_plan(
    axes: Axes, problem: Problem, plan: Plan, *, title: str | None = None, fans: bool = True, solids: bool = True
) -> None:
    """Draw problem, search, path, fans and a wind arrow into axes in local metres."""
    x0, y0, x1, y1 = _frame(problem, plan)
    axes.set_facecolor(SEA)
    if solids:
        draw_solids(axes, problem)
    tree = plan.trace.get("tree") if plan.trace else None
    if tree is not None and len(tree):
        segments = np.asarray(tree, dtype=np.float64).reshape(-1, 2, 2)
        axes.add_collection(LineCollection(list(segments), colors=TREE, linewidths=0.35, alpha=0.8, zorder=1))
        axes.plot([], [], color=TREE, lw=0.6, label="search tree")
    for k, other in enumerate(plan.trace.get("paths", ()) if plan.trace else ()):  # the candidates that auto weighed
        way = np.asarray(other)
        axes.plot(
            way[:, 0], way[:, 1], "-", color=TREE, lw=1.0, zorder=2, label=None if k else "ways that were weighed"
        )
    axes.plot(
        [problem.start_en[0], problem.goal_en[0]],
        [problem.start_en[1], problem.goal_en[1]],
        ls=":",
        lw=0.8,
        color="#777777",
        zorder=2,
        label="straight line",
    )
    if plan.has_path:
        way = np.asarray(plan.waypoints_en)
        if fans:
            _fans(axes, problem, plan, 0.055 * max(x1 - x0, y1 - y0))
        axes.plot(way[:, 0], way[:, 1], "-", color=PATH, lw=1.9, zorder=5, solid_joinstyle="round", label="plan")
        axes.plot(way[1:-1, 0], way[1:-1, 1], "o", color=PATH, ms=3.2, zorder=6)
    axes.plot(*problem.start_en, "o", color=START, ms=8, mec="black", mew=0.6, zorder=7, ls="", label="start")
    axes.add_patch(Circle(problem.goal_en, max(problem.goal_radius_m, 1e-6), fc="none", ec=GOAL, lw=1.2, zorder=7))
    axes.plot(
        *problem.goal_en, "o", color=GOAL, ms=8, mec="black", mew=0.6, zorder=7, ls="", label="goal and its radius"
    )
    draw_wind(axes, problem)
    targets = resolved(problem).targets
    still = [t for t in targets if math.hypot(t.vx_mps, t.vy_mps) == 0.0 and t.spread is None]
    for target in still:
        axes.add_patch(Circle((target.x_m, target.y_m), target.radius_m, fc="none", ec=CLOSED, ls=":", zorder=4))
    if still:
        axes.plot([], [], color=CLOSED, ls=":", label="kept out of while it is closed")
    for k, target in enumerate(t for t in targets if t not in still):
        axes.plot([], [], color="#7a3fa0", ls="--", label=None if k else "vessel, and where it is in a minute")
        axes.add_patch(Circle((target.x_m, target.y_m), target.radius_m, fc="none", ec="#7a3fa0", ls="--", zorder=4))
        axes.annotate(
            "",
            (target.x_m + 60.0 * target.vx_mps, target.y_m + 60.0 * target.vy_mps),
            (target.x_m, target.y_m),
            arrowprops={"arrowstyle": "->", "color": "#7a3fa0"},
            zorder=4,
        )
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal")
    axes.tick_params(labelsize=7)
    axes.set_xlabel("east [m]", fontsize=8)
    axes.set_ylabel("north [m]", fontsize=8)
    axes.set_title(_title(problem, plan) if title is None else title, fontsize=9, loc="left")


def draw_solids(axes: Axes, problem: Problem) -> None:
    """Draw obstacles, what they are grown by and, with a fence, the edge of the water inside it."""
    bare = replace(problem, clearance_floor_m=0.0).obstacle_union
    for shape in shapely.get_parts(bare):
        axes.add_patch(PathPatch(_outline(shape), fc=LAND, ec=LAND_EDGE, lw=0.8, zorder=3))
    if problem.obstacles:
        axes.plot([], [], "s", color=LAND, mec=LAND_EDGE, label="obstacle")
    if problem.obstacles and problem.clearance_floor_m > 0.0:
        for shape in shapely.get_parts(problem.obstacle_union):
            axes.add_patch(PathPatch(_outline(shape), fc="none", ec=MARGIN, lw=0.8, zorder=3))
        axes.plot([], [], color=MARGIN, lw=0.8, label=f"clearance of {problem.clearance_floor_m:g} m")
    if problem.fence_polygon is not None:
        for shape in shapely.get_parts(problem.fence_polygon):
            axes.add_patch(PathPatch(_outline(shape), fc="none", ec="#555555", ls=(0, (6, 3)), lw=1.1, zorder=3))
        axes.plot([], [], color="#555555", ls=(0, (6, 3)), lw=1.1, label="fence")


def draw_wind(axes: Axes, problem: Problem) -> None:
    """Draw an arrow with the wind, blowing from where it comes, and its fan of one sigma at the start."""
    east, north = math.sin(problem.wind.twd_from_rad), math.cos(problem.wind.twd_from_rad)
    cx, cy, size = 0.09, 0.91, 0.055
    axes.annotate(
        "",
        (cx - size * east, cy - size * north),
        (cx + size * east, cy + size * north),
        xycoords="axes fraction",
        textcoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "lw": 1.8, "color": "#1f4e79"},
        zorder=9,
    )
    axes.text(
        cx, cy - 0.075, "wind", transform=axes.transAxes, ha="center", va="top", fontsize=7, color="#1f4e79", zorder=9
    )


def _outline(shape: shapely.Geometry) -> DrawnPath:
    points: list[Any] = []
    codes: list[Any] = []
    for ring in shapely.get_rings(shape):
        xy = shapely.get_coordinates(ring)
        points += list(xy)
        codes += [DrawnPath.MOVETO, *([DrawnPath.LINETO] * (len(xy) - 2)), DrawnPath.CLOSEPOLY]
    return DrawnPath(np.array(points).reshape(-1, 2), codes if points else None)


def _fans(axes: Axes, problem: Problem, plan: Plan, radius_m: float) -> None:
    """Draw the no-go zone about the wind as it stands when the boat gets there: the boat's own, and widened."""
    total = plan.legs[-1].end_s if plan.legs else 0.0
    if total <= 0.0:
        return
    windward_deg = 90.0 - math.degrees(problem.wind.twd_from_rad)
    own = math.degrees(problem.boat.no_go_half_rad)
    entries = [(FAN, "no-go zone of the boat")]
    if problem.no_go_half_rad(total) > problem.boat.no_go_half_rad:
        entries.append((WIDER, "no-go zone as widened by then"))
    for colour, label in entries:
        axes.plot([], [], "s", color=colour, label=label)
    for t in np.linspace(0.0, total, FANS_MOST):
        leg = next((item for item in plan.legs if t <= item.end_s), plan.legs[-1])
        span = leg.end_s - leg.start_s
        share = 0.0 if span <= 0.0 else min(1.0, max(0.0, (t - leg.start_s) / span))
        at = (
            leg.from_en[0] + share * (leg.to_en[0] - leg.from_en[0]),
            leg.from_en[1] + share * (leg.to_en[1] - leg.from_en[1]),
        )
        wide = min(180.0, math.degrees(problem.no_go_half_rad(float(t))))
        for half, colour, zorder in ((wide, WIDER, 0.6), (own, FAN, 0.7)):
            axes.add_patch(
                Wedge(at, radius_m, windward_deg - half, windward_deg + half, fc=colour, lw=0, zorder=zorder)
            )


def _frame(problem: Problem, plan: Plan) -> tuple[float, float, float, float]:
    x, y = [problem.start_en[0], problem.goal_en[0]], [problem.start_en[1], problem.goal_en[1]]
    for shape in (problem.obstacle_union, problem.fence_polygon):
        if shape is not None and not shape.is_empty:
            bounds = shape.bounds
            x += [bounds[0], bounds[2]]
            y += [bounds[1], bounds[3]]
    if plan.has_path:
        x += [float(v) for v in plan.waypoints_en[:, 0]]
        y += [float(v) for v in plan.waypoints_en[:, 1]]
    pad = 0.08 * max(max(x) - min(x), max(y) - min(y), 1.0)
    half = max(max(x) - min(x), max(y) - min(y)) / 2.0 + pad
    cx, cy = (min(x) + max(x)) / 2.0, (min(y) + max(y)) / 2.0
    wide = max((max(x) - min(x)) / 2.0 + pad, 0.55 * half)
    high = max((max(y) - min(y)) / 2.0 + pad, 0.55 * half)
    return cx - wide, cy - high, cx + wide, cy + high


def _title(problem: Problem, plan: Plan) -> str:
    name = problem.title or problem.id or "plan"
    if not plan.has_path:
        return f"{name}\nno path ({plan.status.value}): {plan.reason[:90]}"
    text = f"{name}\n{plan.algorithm}: {plan.cost_s:.0f} s in {counted(len(courses(plan.legs)), 'course')}"
    if math.isfinite(plan.gap) and plan.lower_bound_s > 0.0 and not problem.targets:  # of which no bound knows
        text += f", {100.0 * plan.gap:.1f} % above the bound of {plan.lower_bound_s:.0f} s"
    if plan.risk is not None and problem.wind.sigma.model != "none":
        text += f"; risk at most {100.0 * plan.risk:.1f} %"
    return text

"""``astar``: AVALON's planner (Büsser 2009, chapters 2, 4 and 5.3), as a reference.

A* over a grid of places and 16 headings. From a node the boat steps to one of 24 neighbours (the two rings around
it), turning at most 90 degrees, on headings 45 to 160 degrees off the wind. The cost is sailing time, plus
``turn_s_per_rad`` (f = 8) per radian of heading change, plus costs of a tack and a gybe, plus the tunnel cost of
eq. 4.6. The remaining time is estimated at 7 knots. The goal is a place and a heading: the bearing from start to
goal, turned away from the wind until it can be sailed. Ships become fixed discs where they would be met (eq. 4.7).

What the thesis leaves open: the grid is stretched so that start and goal are both nodes (a goal less than a quarter
of a cell off the start's row or column counts as on it, and the last leg makes up for it);
the first turn may exceed 90 degrees; a problem's own limits and its widened no-go zone narrow the range of
headings further, and in a current so do the courses that the autopilot does not follow (``zone``); a boat faster
than 7 knots is estimated at its own top speed, or the estimate would overestimate.
The grid refuses to be larger than ``memory_bytes``, the weak spot that the thesis names in its conclusion.

References:
    [1] G.-A. Büsser, Design and Implementation of a Navigation Algorithm for an Autonomous Sailboat, 2009.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import difference_rad, heading_of, wrap_pi
from companion.planner.effort import Effort, Outcome
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import endpoint_error, ground_track, is_zoned
from companion.planner.problem.parts import Target
from companion.planner.problem.value import Problem
from companion.planner.reference import astar_kernels as kernels
from companion.planner.reference.flat import FlatPlane
from companion.planner.reference.rrtstar import simple_bound_s
from companion.planner.reference.world import bounds_of, world_of
from companion.planner.settings import AstarSettings

CELLS_ACROSS = 40        # of the default grid, start to goal: 20 m for the 800 m legs that AVALON was tested on
STATE_BYTES = 8 + 8 + 4 + 1 + 2 * 12  # cost, clock, parent, closed, and room for two heap entries
CHUNK = 2000
BORDER_S = 60.0          # of each step outside an abrupt tunnel: a tack is worth it, a long board is not
LEAST_SHARE = 0.25       # of the spacing: a goal nearer to the start's row or column than this counts as on it

DEFAULTS = AstarSettings()


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Where the nodes are: (column, row) lies at (x0 + column dx, y0 + row dy)."""

    x0_m: float
    y0_m: float
    dx_m: float
    dy_m: float
    columns: int
    rows: int
    start: int
    goal: int

    @property
    def memory_bytes(self) -> int:
        """What the search on it needs."""
        return (self.columns * self.rows * kernels.HEADINGS + 1) * STATE_BYTES

    def place(self, node: int) -> tuple[float, float]:
        """Return a node's place (east, north) [m]."""
        return self.x0_m + (node % self.columns) * self.dx_m, self.y0_m + (node // self.columns) * self.dy_m


def grid_of(problem: Problem, grid_m: float) -> Grid:
    """Return the grid of about that spacing [m] on which start and goal are nodes."""
    x0, y0, x1, y1 = bounds_of(problem)
    (sx, sy), (gx, gy) = problem.start_en, problem.goal_en

    def fit(low: float, high: float, start: float, goal: float) -> tuple[float, float, int, int, int]:
        apart = abs(goal - start)
        between = max(round(apart / grid_m), int(apart >= LEAST_SHARE * grid_m))
        d = abs(goal - start) / between if between > 0 else grid_m
        below = max(0, math.floor((min(start, goal) - low) / d + 1e-9))
        above = max(0, math.floor((high - max(start, goal)) / d + 1e-9))
        at_start = below if start <= goal else below + between
        at_goal = below + between if start <= goal else below
        return start - at_start * d, d, below + between + above + 1, at_start, at_goal

    x, dx, columns, start_column, goal_column = fit(x0, x1, sx, gx)
    y, dy, rows, start_row, goal_row = fit(y0, y1, sy, gy)
    return Grid(x0_m=x, y0_m=y, dx_m=dx, dy_m=dy, columns=columns, rows=rows,
                start=start_row * columns + start_column, goal=goal_row * columns + goal_column)


def steps_of(grid: Grid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the 24 steps (columns, rows, heading number, length) and the 16 courses [rad] that they make."""
    offsets = [(i, j) for j in range(-2, 3) for i in range(-2, 3) if (i, j) != (0, 0)]
    courses = sorted({_course(i, j, grid) for i, j in offsets})
    number = {course: k for k, course in enumerate(courses)}
    rows = [
        (i, j, number[_course(i, j, grid)], math.hypot(i * grid.dx_m, j * grid.dy_m)) for i, j in offsets
    ]
    return np.array(rows, dtype=np.float64), np.array(courses)


def _course(i: int, j: int, grid: Grid) -> float:
    divisor = math.gcd(i, j)  # (2, 2) is the same course as (1, 1), to the last bit
    return heading_of(i // divisor * grid.dx_m, j // divisor * grid.dy_m)


def target_heading(courses: NDArray[np.float64], sailable: NDArray[np.bool_], bearing_rad: float) -> int:
    """Return the number of the sailable course nearest to the direct bearing (4.1.4); -1 when there is none."""
    if not bool(np.any(sailable)):
        return -1
    off = np.array([abs(difference_rad(float(c), bearing_rad)) for c in courses])
    return int(np.argmin(np.where(sailable, off, np.inf)))


def ship_discs(problem: Problem, settings: AstarSettings) -> NDArray[np.float64]:
    """Return discs (x, y, radius) where a ship could be met: |t - d(t) / v| < 20 s (eq. 4.7), (n, 3).

    d(t) is the distance from the boat's place now to where the ship will be at t, v the boat's mean speed.
    """
    twa = np.linspace(settings.min_twa_rad, settings.max_twa_rad, 60)
    mean_mps = float(np.mean(np.interp(twa, problem.boat.polar_twa_rad, problem.boat.polar_mps)))
    if mean_mps <= 0.0:
        return np.empty((0, 3))
    horizon_s = 4.0 * math.dist(problem.start_en, problem.goal_en) / mean_mps + 600.0
    rows: list[tuple[float, float, float]] = []
    for ship in problem.targets:
        rows += _discs_of(problem, ship, mean_mps, horizon_s, settings.ship_match_s)
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _discs_of(
    problem: Problem, ship: Target, mean_mps: float, horizon_s: float, match_s: float,
) -> list[tuple[float, float, float]]:
    until = min(ship.until_s, horizon_s)
    if until < ship.from_s:
        return []
    times = np.linspace(ship.from_s, until, max(2, min(2000, int((until - ship.from_s) / 2.0) + 2)))
    x, y = ship.x_m + ship.vx_mps * times, ship.y_m + ship.vy_mps * times
    away = np.hypot(x - problem.start_en[0], y - problem.start_en[1])
    met = np.abs(times - away / mean_mps) < match_s
    radius = np.maximum(0.0, ship.radius_m + ship.growth_mps * times)
    out: list[tuple[float, float, float]] = []
    for i in np.flatnonzero(met):
        place = (float(x[i]), float(y[i]), float(radius[i]))
        if not out or math.dist(place[:2], out[-1][:2]) > 0.1 * max(1.0, place[2]):
            out.append(place)
    return out


def search(
    problem: Problem, effort: Effort, seed: int, settings: AstarSettings = DEFAULTS,  # noqa: ARG001
) -> Outcome:
    """Search one grid until the goal is reached, the heap is empty or the effort is over; the seed is not used.

    An expansion is one state taken from the heap. With ``settings.projection`` "flat" the grid is laid in Büsser's own
    plane.
    """
    if settings.projection == "flat":
        return _by_flat(problem, effort, settings)
    error = endpoint_error(problem)
    if error is not None:
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=error)
    distance_m = math.dist(problem.start_en, problem.goal_en)
    if distance_m <= problem.goal_radius_m:
        effort.found()
        return Outcome(waypoints_en=np.array([problem.start_en]))
    grid_m = settings.grid_m if settings.grid_m is not None else distance_m / CELLS_ACROSS
    grid = grid_of(problem, grid_m)
    trace: dict[str, Any] = {"grid_m": grid_m, "columns": grid.columns, "rows": grid.rows}
    if grid.memory_bytes > settings.memory_bytes:
        fits = grid_m * math.sqrt(grid.memory_bytes / settings.memory_bytes)
        reason = (f"a grid of {grid_m:.3g} m needs {grid.memory_bytes / 1e6:.0f} MB, more than the "
                  f"{settings.memory_bytes / 1e6:.0f} MB allowed; one of {fits:.3g} m would fit")
        return Outcome(waypoints_en=None, status=PlanStatus.TIMEOUT, reason=reason, trace=trace)
    return _run(problem, effort, settings, grid, trace)


def _by_flat(problem: Problem, effort: Effort, settings: AstarSettings) -> Outcome:
    """Search in the metres of eq. 4.2 and bring the path back."""
    if settings.origin is None:
        reason = "the flat projection needs to know where the problem's metres count from"
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=reason)
    error = endpoint_error(problem)
    if error is not None:
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=error)
    plane = FlatPlane(settings.origin)
    outcome = search(plane.problem(problem), effort, 0, replace(settings, projection="local"))
    if outcome.waypoints_en is None:
        return outcome
    way = plane.back(outcome.waypoints_en)
    way[0] = problem.start_en
    return replace(outcome, waypoints_en=way, lower_bound_s=simple_bound_s(problem),
                   trace={**outcome.trace, "flat_en": outcome.waypoints_en})


def _run(problem: Problem, effort: Effort, settings: AstarSettings, grid: Grid, trace: dict[str, Any]) -> Outcome:
    step, courses = steps_of(grid)
    way = np.zeros((kernels.HEADINGS, 3))
    deepest = min(settings.max_twa_rad, problem.boat.max_twa_rad)
    for k, course in enumerate(courses):
        heading, speed = ground_track(problem, math.sin(course), math.cos(course))
        twa = abs(wrap_pi(heading - problem.wind.twd_from_rad))
        is_sailable = (max(settings.min_twa_rad, problem.no_go_min_rad) - 1e-9 <= twa <= deepest + 1e-9
                       and not is_zoned(problem, math.sin(course), math.cos(course)))
        way[k] = wrap_pi(heading), speed if is_sailable else 0.0, twa
    (sx, sy), (gx, gy) = problem.start_en, problem.goal_en
    goal_heading = target_heading(courses, way[:, 1] > 0.0, heading_of(gx - sx, gy - sy))
    if goal_heading < 0:
        reason = "none of the 16 headings can be sailed in this wind"
        return Outcome(waypoints_en=None, status=PlanStatus.TIMEOUT, reason=reason, trace=trace)
    states = grid.columns * grid.rows * kernels.HEADINGS + 1
    g, clock = np.full(states, np.inf), np.zeros(states)
    parent, closed = np.full(states, -1, dtype=np.int32), np.zeros(states, dtype=np.bool_)
    heap_f, heap_state = np.zeros(2 * states), np.zeros(2 * states, dtype=np.int32)
    count = np.zeros(4, dtype=np.int64)
    g[states - 1], heap_state[0], count[kernels.HEAP] = 0.0, states - 1, 1
    fast = 0.0
    if settings.heuristic_mps is not None:
        fast = max(settings.heuristic_mps, max(problem.boat.polar_mps) + problem.current.drift_mps)
    # Eq. 4.6: 10 d GRID SIZE / TUNNEL WIDTH, with d counted in cells, is 10 s a step at one tunnel width off the line.
    tunnel, border_m = 0.0, 0.0
    if settings.tunnel_width_m is not None:
        tunnel, border_m = 10.0 / settings.tunnel_width_m, 0.0
        if settings.is_tunnel_abrupt:
            tunnel, border_m = BORDER_S, 0.5 * settings.tunnel_width_m
    weight = np.array([
        settings.turn_s_per_rad, settings.tack_s, settings.gybe_s, tunnel, fast, border_m, settings.max_turn_rad])
    frame = np.array([grid.x0_m, grid.y0_m, grid.dx_m, grid.dy_m, problem.start_heading_rad])
    disc, w = ship_discs(problem, settings), world_of(problem)
    while count[kernels.REACHED] == 0 and count[kernels.HEAP] > 0 and not effort.is_over:
        chunk = effort.remaining(CHUNK)
        if chunk <= 0:
            break
        effort.spend(int(kernels.expand(
            chunk, g, clock, parent, closed, heap_f, heap_state, count, frame,
            np.array([grid.columns, grid.rows]), grid.start, grid.goal, goal_heading, step, way, weight, disc, w.edge,
            w.cell_first, w.cell_edge, w.grid, w.shape, w.number, w.no_go_model, w.table, w.target,
        )))
    trace |= {"expanded": int(count[kernels.EXPANDED]), "seen": int(count[kernels.SEEN])}
    if count[kernels.REACHED] != 1:
        why = "no path on this grid" if count[kernels.HEAP] == 0 else "the effort ended first"
        if count[kernels.REACHED] < 0:
            why = "the heap is full"
        reason = f"{why}: {grid.columns} x {grid.rows} nodes of {trace['grid_m']:.3g} m, {trace['expanded']} expanded"
        return Outcome(waypoints_en=None, status=PlanStatus.TIMEOUT, reason=reason, trace=trace)
    effort.found()
    goal_state = grid.goal * kernels.HEADINGS + goal_heading
    trace["objective"] = float(g[goal_state])
    way_en = _path(problem, grid, parent, goal_state)
    return Outcome(waypoints_en=way_en, lower_bound_s=simple_bound_s(problem), trace=trace)


def _path(problem: Problem, grid: Grid, parent: NDArray[np.int32], state: int) -> NDArray[np.float64]:
    """Return the places where the heading changes, start and goal included, (n, 2)."""
    first = grid.columns * grid.rows * kernels.HEADINGS
    states = [state]
    while states[-1] != first:
        states.append(int(parent[states[-1]]))
    states.reverse()
    nodes = [grid.start, *(s // kernels.HEADINGS for s in states[1:])]
    headings = [s % kernels.HEADINGS for s in states[1:]]
    keep = [nodes[0], *(nodes[i] for i in range(1, len(nodes) - 1) if headings[i - 1] != headings[i]), nodes[-1]]
    way = [grid.place(n) for n in keep]
    if math.dist(way[-1], problem.goal_en) > problem.goal_radius_m:
        way.append(problem.goal_en)
    return np.array(way)

"""``astar``: AVALON's planner (Büsser 2009, chapters 2, 4 and 5.3), as a reference.

A* over a grid of places and 16 headings. From a node the boat steps to one of 24 neighbours (the two rings around
it), turning at most 90 degrees, on headings 45 to 160 degrees off the wind. The cost is sailing time, plus
``turn_s_per_rad`` (f = 8) per radian of heading change, plus costs of a tack and a gybe, plus the tunnel cost of
eq. 4.6. The remaining time is estimated at 7 knots. The goal is a place and a heading: the bearing from start to
goal or, for short courses, one set by hand, turned away from the wind until it can be sailed.
Ships become fixed discs where they would be met (eq. 4.7).

What the thesis leaves open: the grid is stretched so that start and goal are both nodes (a goal less than a quarter
of a cell off the start's row or column counts as on it, and the last leg makes up for it);
the first turn may exceed 90 degrees; a problem's own limits and its widened no-go zone narrow the range of
headings further, and in a current so do the courses that the autopilot does not follow (``zone``); a boat faster
than 7 knots is estimated at its own top speed, or the estimate would overestimate.
A grid that is asked for refuses to be larger than ``memory_bytes``, the weak spot that the thesis names in its
conclusion; the default is laid as coarse as fits.

References:
    [1] G.-A. Büsser, Design and Implementation of a Navigation Algorithm for an Autonomous Sailboat, 2009.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from companion.geo.angles import difference_rad, heading_of, wrap_pi, wrap_pi_array
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint, Target
from companion.planner.effort import Effort, Outcome
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import endpoint_error, ground_track, is_zoned
from companion.planner.problem.value import Problem
from companion.planner.reference import kernels
from companion.planner.reference.rrtstar import simple_bound_s
from companion.planner.reference.world import bounds_of, world_of
from companion.planners import AstarSettings

# A problem in the metres of Büsser's flat earth (2009, eq. 4.2), for ``astar``, and its path back.
#
# Every place of the problem goes over latitude and longitude into his plane; the path's places come back the same way,
# so corners lose nothing. Between them a straight leg of his plane is a slightly bent one, and his courses are not
# quite true (docs/lab/frames.md has the figures). What that may cost is kept clear of beforehand: solids are grown by
# the bend, the sailable angles are narrowed by the error of course. The answer is judged in the problem's own metres by
# the exact scorer, like every other.

# Büsser's flat earth, kept as a reference: a plane of latitude and longitude scaled at the origin.
#
# Büsser 2009, equation 4.2: x = R_E cos(lat) π/180 lon, y = R_E π/180 lat, then an offset is subtracted; here lat in
# the cosine is the origin's, without which x would not be a function of longitude alone. Fine within a kilometre or so;
# the boat uses ``companion.geo.frame``. ``docs/lab/frames.md`` has the table of its errors.

EARTH_RADIUS_M = 6_371_000.0  # mean radius of the sphere


def flat_en_from_lonlat(origin: GeoPoint, lonlat_deg: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) east, north [m] of (n, 2) lon, lat [deg] by Büsser's equation 4.2."""
    lonlat = np.asarray(lonlat_deg, dtype=np.float64).reshape(-1, 2)
    delta_lon = np.radians((lonlat[:, 0] - origin.lon_deg + 180.0) % 360.0 - 180.0)
    east_m = EARTH_RADIUS_M * delta_lon * math.cos(math.radians(origin.lat_deg))
    return np.column_stack([east_m, EARTH_RADIUS_M * np.radians(lonlat[:, 1] - origin.lat_deg)])


def flat_lonlat_from_en(origin: GeoPoint, en_m: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) lon, lat [deg] of (n, 2) east, north [m]; the inverse of ``flat_en_from_lonlat``."""
    en = np.asarray(en_m, dtype=np.float64).reshape(-1, 2)
    lon = origin.lon_deg + np.degrees(en[:, 0] / (EARTH_RADIUS_M * math.cos(math.radians(origin.lat_deg))))
    return np.column_stack([(lon + 180.0) % 360.0 - 180.0, origin.lat_deg + np.degrees(en[:, 1] / EARTH_RADIUS_M)])


DIRECTIONS = 24
STEP_M = 1.0
EDGE_M = 500.0  # an edge of a solid is cut into pieces so long: each bends by millimetres
OBLIQUE = 1.09  # the most of sin(course) (1 + cos² course)
SAFETY = 1.05  # of the errors found on the box's edge and in its middle


class FlatPlane:
    """The two planes about one origin: the problem's metres (``LocalFrame``) and Büsser's."""

    def __init__(self, origin: GeoPoint) -> None:
        self._origin, self._frame = origin, LocalFrame(origin)

    def to(self, en_m: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) places [m] of the problem's frame in his plane."""
        return flat_en_from_lonlat(self._origin, self._frame.array_lonlat_from_en(en_m))

    def back(self, flat_m: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) places [m] of his plane in the problem's frame."""
        return self._frame.array_en_from_lonlat(flat_lonlat_from_en(self._origin, flat_m))

    def turn_rad(self, box: tuple[float, float, float, float]) -> float:
        """Return the largest difference of a course between the two planes within a box of the frame [rad]."""
        x, y = (np.linspace(box[0], box[2], 5), np.linspace(box[1], box[3], 5))
        place = np.column_stack([g.ravel() for g in np.meshgrid(x, y)])
        here, worst = self.to(place), 0.0
        for course in np.linspace(0.0, 2.0 * math.pi, DIRECTIONS, endpoint=False):
            step = STEP_M * np.array([math.sin(course), math.cos(course)])
            moved = self.back(here + step) - place
            off = np.arctan2(moved[:, 0], moved[:, 1]) - course
            worst = max(worst, float(np.max(np.abs(wrap_pi_array(off)))))
        return SAFETY * worst

    def bend_m(self, length_m: float, off_m: float) -> float:
        """Return how far a straight leg of his plane bends in the other at most, ``off_m`` from the origin.

        A parallel by L² tan(latitude) / 8 R; a leg that leads polewards, too, by 1.09 times that.
        """
        lat_rad = math.radians(abs(self._origin.lat_deg)) + off_m / EARTH_RADIUS_M
        steep = OBLIQUE * math.tan(min(math.radians(89.0), lat_rad)) + off_m / EARTH_RADIUS_M
        return SAFETY * length_m * length_m * steep / (8.0 * EARTH_RADIUS_M)

    def problem(self, p: Problem) -> Problem:
        """Return the problem stated in his plane, with room for what the plane is wrong by."""
        box = bounds_of(p)
        turn = self.turn_rad(box)
        scale = float(np.max(np.abs(self._scales(box))))
        far_m = max(math.hypot(x, y) for x in box[0::2] for y in box[1::2])
        bend = min(self.bend_m(math.dist(p.start_en, p.goal_en), far_m), 0.5 * _room_m(p))

        def flat(shape: shapely.Geometry) -> shapely.Geometry:
            return shapely.transform(shapely.segmentize(shape, EDGE_M), self.to)

        start, goal = (tuple(float(c) for c in row) for row in self.to([p.start_en, p.goal_en]))
        boat = replace(
            p.boat,
            no_go_half_rad=p.boat.no_go_half_rad + turn,
            max_twa_rad=p.boat.max_twa_rad - (turn if p.boat.max_twa_rad < math.pi else 0.0),
        )
        zone = p.zone and replace(p.zone, half_rad=p.zone.half_rad + turn)
        return replace(
            p,
            start_en=(start[0], start[1]),
            goal_en=(goal[0], goal[1]),
            boat=boat,
            zone=zone,
            obstacles=tuple(flat(shape).buffer(bend, join_style="mitre") for shape in p.obstacles),
            fence=None if p.fence is None else flat(p.fence).buffer(-bend, join_style="mitre"),
            goal_radius_m=p.goal_radius_m / (1.0 + scale),
            targets=tuple(self._target(t, scale) for t in p.targets),
        )

    def _scales(self, box: tuple[float, float, float, float]) -> NDArray[np.float64]:
        corner = np.array([[box[0], box[1]], [box[0], box[3]], [box[2], box[1]], [box[2], box[3]]])
        here = self.to(corner)
        return np.array([np.hypot(*(self.to(corner + d) - here).T) - 1.0 for d in ((1.0, 0.0), (0.0, 1.0))])

    def _target(self, t: Target, scale: float) -> Target:
        at = np.array([t.x_m + t.vx_mps * t.from_s, t.y_m + t.vy_mps * t.from_s])
        here, later = self.to([at, at + np.array([t.vx_mps, t.vy_mps])])
        vx, vy = later - here
        x, y = here - np.array([vx, vy]) * t.from_s
        return replace(
            t,
            x_m=float(x),
            y_m=float(y),
            vx_mps=float(vx),
            vy_mps=float(vy),
            radius_m=t.radius_m * (1.0 + scale),
            growth_mps=t.growth_mps * (1.0 + scale),
        )


def _room_m(p: Problem) -> float:
    """Return how far start and goal are from anything solid [m]: what is grown must not reach them."""
    ends = shapely.points([p.start_en, p.goal_en])
    shapes = [*p.obstacles, *([] if p.fence is None else [p.fence.boundary])]
    return min((float(shapely.distance(shape, end)) for shape in shapes for end in ends), default=math.inf)


CELLS_ACROSS = 40  # of the default grid, start to goal: 20 m for the 800 m legs that AVALON was tested on
LEAST_M = 2.0  # of a cell of the default grid: a finer one says nothing more of a boat, and takes a plan's whole time
COARSER = 1.1  # from one try to the next, at the least: start and goal are nodes, so that cells shrink by jumps
STATE_BYTES = 8 + 8 + 4 + 1 + 2 * 12  # cost, clock, parent, closed, and room for two heap entries
CHUNK = 2000
BORDER_S = 60.0  # of each step outside a tunnel with borders: a tack is worth it, a long board is not
CONVEX = 4.0  # power of a convex tunnel's rise: half-way to the border a sixteenth of what a step there costs
LEAST_SHARE = 0.25  # of the spacing: a goal nearer to the start's row or column than this counts as on it

DEFAULTS = AstarSettings()


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeGrid:
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


def grid_of(problem: Problem, grid_m: float, room_m: float | None = None) -> NodeGrid:
    """Return the grid of about that spacing [m] on which start and goal are nodes, with ``room_m`` about both."""
    x0, y0, x1, y1 = bounds_of(problem)
    (sx, sy), (gx, gy) = problem.start_en, problem.goal_en
    if room_m is not None and problem.fence is None:
        x0, y0 = min(x0, min(sx, gx) - room_m), min(y0, min(sy, gy) - room_m)
        x1, y1 = max(x1, max(sx, gx) + room_m), max(y1, max(sy, gy) + room_m)

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
    return NodeGrid(
        x0_m=x,
        y0_m=y,
        dx_m=dx,
        dy_m=dy,
        columns=columns,
        rows=rows,
        start=start_row * columns + start_column,
        goal=goal_row * columns + goal_column,
    )


def _default_grid(problem: Problem, settings: AstarSettings) -> tuple[float, NodeGrid]:
    """Return the default spacing [m] and its grid: a fortieth of the distance, or as fine as is sensible and fits."""
    grid_m = max(math.dist(problem.start_en, problem.goal_en) / CELLS_ACROSS, LEAST_M)
    grid = grid_of(problem, grid_m, settings.room_m)
    while grid.memory_bytes > settings.memory_bytes:
        grid_m *= max(COARSER, math.sqrt(grid.memory_bytes / settings.memory_bytes))
        grid = grid_of(problem, grid_m, settings.room_m)
    return grid_m, grid


def steps_of(grid: NodeGrid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the 24 steps (columns, rows, heading number, length) and the 16 courses [rad] that they make."""
    offsets = [(i, j) for j in range(-2, 3) for i in range(-2, 3) if (i, j) != (0, 0)]
    courses = sorted({_course(i, j, grid) for i, j in offsets})
    number = {course: k for k, course in enumerate(courses)}
    rows = [(i, j, number[_course(i, j, grid)], math.hypot(i * grid.dx_m, j * grid.dy_m)) for i, j in offsets]
    return np.array(rows, dtype=np.float64), np.array(courses)


def _course(i: int, j: int, grid: NodeGrid) -> float:
    divisor = math.gcd(i, j)  # (2, 2) is the same course as (1, 1), to the last bit
    return heading_of(i // divisor * grid.dx_m, j // divisor * grid.dy_m)


def target_heading(courses: NDArray[np.float64], sailable: NDArray[np.bool_], bearing_rad: float) -> int:
    """Return the number of the sailable course nearest to the bearing or what is set by hand (4.1.4); -1: none."""
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
    problem: Problem, ship: Target, mean_mps: float, horizon_s: float, match_s: float
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
    problem: Problem,
    effort: Effort,
    seed: int,  # noqa: ARG001
    settings: AstarSettings = DEFAULTS,
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
    grid_m = settings.grid_m
    if grid_m is None:
        grid_m, grid = _default_grid(problem, settings)
    else:
        grid = grid_of(problem, grid_m, settings.room_m)
    trace: dict[str, Any] = {"grid_m": grid_m, "columns": grid.columns, "rows": grid.rows}
    if grid.memory_bytes > settings.memory_bytes:
        fits = grid_m * math.sqrt(grid.memory_bytes / settings.memory_bytes)
        reason = (
            f"a grid of {grid_m:.3g} m needs {grid.memory_bytes / 1e6:.0f} MB, more than the "
            f"{settings.memory_bytes / 1e6:.0f} MB allowed; one of {fits:.3g} m would fit: [planner] grid_m sets it"
        )
        return Outcome(waypoints_en=None, status=PlanStatus.NOT_FOUND, reason=reason, trace=trace)
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
    return replace(
        outcome,
        waypoints_en=way,
        lower_bound_s=simple_bound_s(problem),
        trace={**outcome.trace, "flat_en": outcome.waypoints_en},
    )


def _run(problem: Problem, effort: Effort, settings: AstarSettings, grid: NodeGrid, trace: dict[str, Any]) -> Outcome:
    step, courses = steps_of(grid)
    way = np.zeros((kernels.HEADINGS, 3))
    deepest = min(settings.max_twa_rad, problem.boat.max_twa_rad)
    for k, course in enumerate(courses):
        heading, speed = ground_track(problem, math.sin(course), math.cos(course))
        twa = abs(wrap_pi(heading - problem.wind.twd_from_rad))
        is_sailable = max(settings.min_twa_rad, problem.no_go_min_rad) - 1e-9 <= twa <= deepest + 1e-9 and not is_zoned(
            problem, math.sin(course), math.cos(course)
        )
        way[k] = wrap_pi(heading), speed if is_sailable else 0.0, twa
    (sx, sy), (gx, gy) = problem.start_en, problem.goal_en
    is_any = settings.goal_heading == "any" and settings.goal_heading_rad is None
    wanted_rad = heading_of(gx - sx, gy - sy) if settings.goal_heading_rad is None else settings.goal_heading_rad
    goal_heading = target_heading(courses, way[:, 1] > 0.0, wanted_rad)
    if goal_heading < 0:
        reason = "none of the 16 headings can be sailed in this wind"
        return Outcome(waypoints_en=None, status=PlanStatus.NOT_FOUND, reason=reason, trace=trace)
    states = grid.columns * grid.rows * kernels.HEADINGS + 1
    g, clock = np.full(states, np.inf), np.zeros(states)
    parent, closed = np.full(states, -1, dtype=np.int32), np.zeros(states, dtype=np.bool_)
    heap_f, heap_state = np.zeros(2 * states), np.zeros(2 * states, dtype=np.int32)
    count = np.zeros(5, dtype=np.int64)
    g[states - 1], heap_state[0], count[kernels.HEAP] = 0.0, states - 1, 1
    fast = 0.0
    if settings.heuristic_mps is not None:
        fast = max(settings.heuristic_mps, max(problem.boat.polar_mps) + problem.current.drift_mps)
    # Eq. 4.6: 10 d GRID SIZE / TUNNEL WIDTH, with d counted in cells, is 10 s a step at one tunnel width off the line.
    tunnel, border_m, rise = 0.0, 0.0, 0.0
    if settings.tunnel_width_m is not None:
        tunnel, border_m = 10.0 / settings.tunnel_width_m, 0.0
        if settings.tunnel != "linear":
            tunnel, border_m = BORDER_S, 0.5 * settings.tunnel_width_m
            rise = CONVEX if settings.tunnel == "convex" else 0.0
    weight = np.array(
        [settings.turn_s_per_rad, settings.tack_s, settings.gybe_s, tunnel, fast, border_m, settings.max_turn_rad, rise]
    )
    frame = np.array([grid.x0_m, grid.y0_m, grid.dx_m, grid.dy_m, problem.start_heading_rad])
    disc, w = ship_discs(problem, settings), world_of(problem)
    while count[kernels.REACHED] == 0 and count[kernels.HEAP] > 0 and not effort.is_over:
        chunk = effort.remaining(CHUNK)
        if chunk <= 0:
            break
        effort.spend(
            int(
                kernels.expand(
                    chunk,
                    g,
                    clock,
                    parent,
                    closed,
                    heap_f,
                    heap_state,
                    count,
                    frame,
                    np.array([grid.columns, grid.rows]),
                    grid.start,
                    grid.goal,
                    -1 if is_any else goal_heading,
                    step,
                    way,
                    weight,
                    disc,
                    w.edge,
                    w.cell_first,
                    w.cell_edge,
                    w.grid,
                    w.shape,
                    w.number,
                    w.no_go_model,
                    w.table,
                    w.target,
                )
            )
        )
    trace |= {"expanded": int(count[kernels.EXPANDED]), "seen": int(count[kernels.SEEN])}
    if count[kernels.REACHED] != 1:
        status, why = PlanStatus.TIMEOUT, "the effort ended first"
        if count[kernels.REACHED] < 0:
            why = "the heap is full"
        elif count[kernels.HEAP] == 0:
            status, why = PlanStatus.NOT_FOUND, "no path on this grid"
        reason = f"{why}: {grid.columns} x {grid.rows} nodes of {trace['grid_m']:.3g} m, {trace['expanded']} expanded"
        return Outcome(waypoints_en=None, status=status, reason=reason, trace=trace)
    effort.found()
    goal_state = int(count[kernels.LAST])
    trace["objective"] = float(g[goal_state])
    way_en = _path(problem, grid, parent, goal_state)
    return Outcome(waypoints_en=way_en, lower_bound_s=simple_bound_s(problem), trace=trace)


def _path(problem: Problem, grid: NodeGrid, parent: NDArray[np.int32], state: int) -> NDArray[np.float64]:
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

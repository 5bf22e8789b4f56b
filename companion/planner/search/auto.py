"""``auto``: exact proposals first, then lattices and the metric's geodesics, all of them annealed.

The straight leg, the fewest tacks and the way that was found before are tried at once; a coarse lattice and the
visibility graph give a first path round obstacles; finer and differently fitted lattices, and the routes round the
other sides, give other candidates. Each is annealed in cycles; a bandit gives more of them to the candidates that may
still win. The search stops when its budget ends or when the bound says that there is nothing left to find.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.kernels.xorshift import uniform
from companion.planner.effort import Effort, Outcome
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import shore_of, solid_words, target_hit
from companion.planner.problem.value import Problem
from companion.planner.search.annealing import MOST_POINTS, anneal, timetable
from companion.planner.search.bound import Bound, cut_off, no_course
from companion.planner.search.drift import run_drift
from companion.planner.search.gauge import Gauge, make_gauge
from companion.planner.search.kernels import Floats, is_free
from companion.planner.search.lattice import run_lattice
from companion.planner.search.moves import check_path, fitted, follow, rounded, zigzag
from companion.planner.search.visibility import crossings, geodesics, graph_nodes, least_through
from companion.planner.search.world import SearchWorld, make_world

LEG_PRICE = 8e-5
"""What a leg must save, as a share of the path's time, while ways are compared; at the end the problem's share counts.

A beat into a closing wind follows a curve, of which each further leg cuts off a little; but many legs make a
candidate slow to improve, and the wrong way round then wins."""
FINE_FROM = 0.85
"""Share of the effort after which only the best path is improved."""
STOP_GAP = 2e-4
"""Stop when the path is this close to the bound."""
_CHUNK = 4_000
_MOVE_S, _POINT_S = 4e-6, 9e-7
"""What a move of a candidate takes before one has been timed: at the least, and for each point of its path [s]."""
_LEAST = 50
"""Moves below which a chunk is not worth its call."""
_LEG_S = 1.5e-4
"""What the exact check and the risk of the found path take for each of its legs [s]."""
_TESTS_PER_S = 1.2e6
"""Visibility tests that take a second."""
_FIRST_CYCLE = 8_000
_LONGEST_CYCLE = 512_000
_HOT, _COLD = 2e-3, 1e-7
"""Temperatures of an annealing cycle, as a share of the path's time."""
_POOL = 16
_MOST_SIDES = 12
"""Routes round the other sides of obstacles that are offered."""
_MANY = 5_000
"""Corners above which those near a path are looked for now and then only."""


@dataclass(slots=True, eq=False)
class Candidate:
    """One path under annealing: the best of it, and where its present cycle stands."""

    points: Floats
    cost_s: float
    side: bytes
    origin: str = ""
    last: Floats = field(default_factory=lambda: np.empty((0, 2)))
    moves: int = 0
    cycle: int = _FIRST_CYCLE
    done: int = 0
    cycles: int = 0
    spots: Floats = field(default_factory=lambda: np.empty((0, 2)))
    spots_at: int = 0
    move_s: float = 0.0

    def worth(self, price_s: float) -> float:
        """Return the cost with every point priced [s]."""
        return self.cost_s + price_s * len(self.points)


class Searcher:
    """The state of one search."""

    def __init__(self, world: SearchWorld, gauge: Gauge, bound: Bound, effort: Effort, seed: int) -> None:
        self.world, self.gauge, self.bound, self.effort = world, gauge, bound, effort
        self.goal = np.array([*world.goal, world.goal_radius])
        self.rng: NDArray[np.uint64] = np.array([(seed * 2 + 1) * 0x9E3779B97F4A7C15 % 2**64 or 1], np.uint64)
        self.pool: list[Candidate] = []
        self.best: Candidate | None = None
        self.turns = 0
        self.is_finishing = False
        self.pops_per_s = 6e5
        self._judged: Floats | None = None

    # ------------------------------------------------------------------------------------ candidates
    @property
    def upper_s(self) -> float:
        """Cost of the best path [s]."""
        return self.best.cost_s if self.best is not None else math.inf

    @property
    def leg_price(self) -> float:
        """What a leg must save now, as a share of the path's time."""
        least = self.world.problem.leg_saving
        return max(LEG_PRICE, least) if self.effort.fraction < FINE_FROM else least

    @property
    def is_done(self) -> bool:
        """Return whether nothing is left to find, or nothing left to spend."""
        return self.effort.is_over or self.upper_s <= self.bound.tight_s * (1.0 + STOP_GAP)

    def offer(self, points: Floats | None, origin: str, within: float = math.inf) -> Candidate | None:
        """Take a path as a candidate if it is feasible, new, and not above ``within`` times the best."""
        if points is None or len(points) < 2:
            return None
        points = np.ascontiguousarray(points)
        taken = self._take(points, origin, within)
        world = self.world
        if world.boat.room > 0.0:
            way = rounded(world.grid, world.boat, points, world.h0)
            if len(way) > len(points):
                way = way if world.boat.kind == 0 else fitted(world.boat, way, world.h0)
                return self._take(way, f"{origin}, turned the long way round", within) or taken
        return taken

    def _take(self, points: Floats, origin: str, within: float) -> Candidate | None:
        cost = float(check_path(self.world.grid, self.world.boat, points, self.world.h0))
        if not math.isfinite(cost) or cost > within * self.upper_s:
            return None
        side = crossings(points, self.world.marks).tobytes()
        if any(abs(c.cost_s - cost) < 1e-6 * cost and c.side == side for c in self.pool):
            return None
        candidate = Candidate(points=points, cost_s=cost, side=side, origin=origin, last=points)
        if len(points) < MOST_POINTS:
            self.pool.append(candidate)
        self.note(candidate)
        if len(self.pool) > _POOL:
            self.pool.remove(max(self.pool, key=lambda c: c.cost_s))
        return candidate

    def note(self, candidate: Candidate) -> None:
        """Remember the best."""
        price = self.leg_price * candidate.cost_s
        if self.best is None or candidate.worth(price) < self.best.worth(price):
            self.best = candidate
            self.effort.found()
        self.effort.after_s = self.effort.judging_s + _LEG_S * len(self.best.points)
        self.have_judged()

    def have_judged(self) -> None:
        """Have the best path judged, if it was not and it is time for that."""
        if self.best is None:
            return
        points = self.best.points
        if points is not self._judged and self.effort.improved(self.waypoints_en, self.best.cost_s):
            self._judged = points

    def waypoints_en(self) -> Floats:
        """Return the best path in the problem's frame, without points that are not needed."""
        assert self.best is not None
        waypoints = self.world.to_en(_tidy(self.world, self.best.points))
        waypoints[0] = self.world.problem.start_en
        return waypoints

    # ---------------------------------------------------------------------------------------- guides
    def along(self, guide: Floats, *, most: int = 3, halving: int = 0) -> Floats | None:
        """Return the guide made sailable, or None: each leg direct or with up to ``most`` equal tacks, or (with
        ``halving``) with tacks as short as the room needs."""  # noqa: D205, D209
        world = self.world
        points, t, h = [guide[0]], 0.0, world.h0
        for i in range(len(guide) - 1):
            (ax, ay), (ex, ey) = points[-1], guide[i + 1]
            if halving:
                legs, t, h, ok = follow(world.grid, world.boat, ax, ay, h, t, ex, ey, halving)
            else:
                legs, t, h, ok = zigzag(world.grid, world.boat, ax, ay, h, t, ex, ey, most)
            if not ok:
                return None
            points += list(legs)
        return np.array(points)

    def end_points(self) -> list[Floats]:
        """Return ends in the goal's disc worth a straight try: nearest, centre, up or down wind side."""
        gx, gy, r = self.goal
        d = math.hypot(gx, gy)
        ends = [np.array([gx, gy])]
        if d > r > 0.0:
            ends = [
                np.array([gx - a * r * 0.999999, gy - c * r * 0.999999])
                for a, c in ((gx / d, gy / d), (0.0, math.copysign(1.0, gy)))
            ] + ends
        return ends

    def quick(self) -> None:
        """Try the straight leg and the fewest tacks."""
        for end in self.end_points():
            guide = np.vstack([np.zeros((1, 2)), end[None, :]])
            for most in (1, 3):
                self.offer(self.along(guide, most=most), "direct")
                self.effort.spend(50)

    def known(self) -> None:
        """Try the way that was found before: as it is, and made sailable again where the wind or the boat has moved."""
        if self.world.problem.known_en:
            self.effort.spend(50)
            way = self.world.to_wind(np.asarray(self.world.problem.known_en))
            self.try_guide(np.vstack([np.zeros((1, 2)), way]), "known way")

    def geodesic(self, tests: int) -> None:
        """Sharpen the bound and try its path."""
        self.effort.spend(self.bound.sharpen(self.upper_s, tests) // 8)
        if self.bound.path is not None:
            self.try_guide(self.bound.path, "geodesic")

    def try_guide(self, guide: Floats, origin: str) -> bool:
        """Offer the guide (start .. last corner) made sailable in several ways; return whether one was."""
        gx, gy, r = self.goal
        (x, y) = guide[-1]
        d = math.hypot(gx - x, gy - y)
        end = (
            [guide]
            if d <= r
            else [np.vstack([guide, [[gx - f * r * (gx - x) / d, gy - f * r * (gy - y) / d]]]) for f in (0.0, 0.999999)]
        )
        found = False
        for path in end:
            found = self.offer(self.along(path, most=12), origin) is not None or found
        if found:
            return True
        scale = float(np.max(np.ptp(end[0], axis=0)))
        for shift in (0.001, 0.01, 0.05):
            moved = self.pushed_off(end[0], shift * scale)
            if self.offer(self.along(moved, halving=8), origin) is not None:
                return True
        return False

    def pushed_off(self, guide: Floats, shift_m: float) -> Floats:
        """Return the guide with its inner points moved off the obstacles' corners, half of the room at most."""
        out, world = guide.copy(), self.world
        for i in range(1, len(guide) - 1):
            match = np.nonzero(np.all(world.corners == guide[i], axis=1))[0]
            if len(match) == 0:
                continue
            ux, uy = world.outward[match[0]]
            x, y = guide[i]
            room = 2.0 * shift_m
            while room > 1e-3 and not is_free(world.grid, x, y, x + room * ux, y + room * uy):
                room *= 0.7
            out[i] = (x + 0.5 * room * ux, y + 0.5 * room * uy)
        return out

    def other_sides(self) -> int:
        """Offer the routes round the other sides of obstacles: shortest of the metric through each corner.

        The time to each corner plus the time from it tells what a detour through it costs at least; of each
        combination of sides the cheapest is made sailable. Returns how many were new.
        """
        world, gauge = self.world, self.gauge
        limit = self.upper_s - self.bound.turning_s
        nodes = graph_nodes(world.corners, gauge, (*world.goal, world.goal_radius), limit)
        if len(nodes) < 2 or len(nodes) > 900:
            return 0
        args = (world.grid, nodes, gauge.normals, gauge.blocked, gauge.table, self.goal)
        to, before, _, _, n1 = geodesics(*args, 1, limit, self.tests(200_000, 0.12), self.bound.ends)
        back, after, _, _, n2 = geodesics(*args, 2, limit, self.tests(200_000, 0.12), self.bound.ends)
        self.effort.spend((n1 + n2) // 8 + 1)
        through = to + back
        known = {c.side for c in self.pool}
        count = 0
        for v in np.argsort(through, kind="stable"):
            if not through[v] < limit or count >= _MOST_SIDES or self.is_done:
                break
            left, right, k = [], [], int(v)
            while k >= 0:
                left.append(nodes[k])
                k = int(before[k])
            k = int(after[v])
            while k >= 0:
                right.append(nodes[k])
                k = int(after[k])
            guide = np.array(left[::-1] + right)
            side = crossings(np.vstack([guide, self.goal[None, :2]]), world.marks).tobytes()
            if side in known:
                continue
            known.add(side)
            count += 1
            self.effort.spend(100)
            self.try_guide(guide, "other side")
        return count

    # -------------------------------------------------------------------------------------- lattices
    def box(self, margin: float) -> tuple[float, float, float, float]:
        """Return where a lattice lives: within the fence, or about everything that matters."""
        x0, y0, x1, y1 = self.world.box
        if self.world.fence_box:
            return x0, y0, x1, y1
        gx, gy = self.world.goal
        m = margin * max(math.hypot(gx, gy), 1.0)
        if margin < 0.5:
            return min(0.0, gx) - m, min(0.0, gy) - m, max(0.0, gx) + m, max(0.0, gy) + m
        return x0 - m, y0 - m, x1 + m, y1 + m

    def inner_box(self, margin: float) -> tuple[float, float, float, float]:
        """Return ``box`` cut down to where a path better than the best can be."""
        x0, y0, x1, y1 = self.box(margin)
        upper = self.upper_s - self.bound.turning_s
        if not math.isfinite(upper):
            return x0, y0, x1, y1
        side = 48
        xs, ys = np.linspace(x0, x1, side), np.linspace(y0, y1, side)
        gx, gy = np.meshgrid(xs, ys)
        q = np.column_stack([gx.ravel(), gy.ravel()])
        inside = q[least_through(self.gauge, q, (*self.world.goal, self.world.goal_radius)) <= upper * 1.001]
        if len(inside) == 0:
            return x0, y0, x1, y1
        px, py = (x1 - x0) / (side - 1), (y1 - y0) / (side - 1)
        return (
            max(x0, float(inside[:, 0].min()) - px),
            max(y0, float(inside[:, 1].min()) - py),
            min(x1, float(inside[:, 0].max()) + px),
            min(y1, float(inside[:, 1].max()) + py),
        )

    def left(self) -> tuple[float, float]:
        """Return (expansions, seconds) that a search for other paths may take: the end belongs to the best path."""
        share = 1.0 - FINE_FROM if self.best is not None else 0.0
        steps = 1e9 if self.effort.limit is None else (1.0 - share) * self.effort.limit - self.effort.used
        seconds = self.effort.remaining_s
        if math.isfinite(self.effort.budget_s):
            seconds -= share * self.effort.budget_s
        return max(0.0, steps), max(0.0, seconds)

    @property
    def deciding_s(self) -> float:
        """Computing time left [s]; inf where expansions decide, so that nothing depends on the machine."""
        return self.effort.remaining_s if self.effort.limit is None else math.inf

    def lattice(
        self,
        cells: int,
        reach: int,
        *,
        margin: float,
        half_at_s: float,
        stretch: float = 1.0,
        bound_s: float | None = None,
        side: int = 0,
    ) -> Candidate | None:
        """Run one lattice whose axes fit the no-go zone at ``half_at_s`` and offer its path."""
        b = self.world.boat
        half = self.world.problem.no_go_half_rad(half_at_s)
        began_s = self.effort.elapsed_s
        steps, seconds = self.left()
        most = min(8.0 * steps, max(2_000.0, 0.8 * self.pops_per_s * seconds))
        downwind = self.world.goal[1] < 0.0 and b.down < math.pi - 1e-6
        found = run_lattice(
            self.world,
            self.gauge,
            cells=cells,
            reach=reach,
            half_rad=math.pi - b.down if downwind else max(half, b.up, b.zone_open),
            box=self.inner_box(margin),
            downwind=downwind,
            stretch=stretch,
            bound_s=self.upper_s if bound_s is None else bound_s,
            max_pops=int(most),
            side=side,
        )
        if found.pops > 20_000:
            self.pops_per_s = found.pops / max(1e-6, self.effort.elapsed_s - began_s)
        self.effort.spend(max(1, found.pops // 8))
        return self.offer(found.points, f"lattice {cells}")

    def drift(self, cells: int, stride: float, bound_s: float, side: int = 0) -> Candidate | None:
        """Run one search whose courses follow the no-go zone in time and offer its path."""
        began_s = self.effort.elapsed_s
        steps, seconds = self.left()
        most = min(2.0 * steps, max(500.0, 0.2 * self.pops_per_s * seconds))
        found = run_drift(
            self.world,
            self.gauge,
            cells=cells,
            box=self.inner_box(0.5),
            bound_s=bound_s,
            max_pops=int(most),
            stride=stride,
            side=side,
        )
        self.effort.spend(max(1, found.pops // 2))
        if found.pops > 5_000:
            self.pops_per_s = 4.0 * found.pops / max(1e-6, self.effort.elapsed_s - began_s)
        return self.offer(found.points, f"drift {cells}")

    def other_tack(self) -> None:
        """Search again with the first leg on the tack that the best path does not begin on."""
        if self.best is None or len(self.best.points) < 2:
            return
        side = -1 if self.best.points[1, 0] > 0.0 else 1
        if self.world.boat.kind != 0:
            self.drift(3_000, 2.0, 1.04 * self.upper_s, side)
        self.lattice(6_000, 2, margin=0.5, half_at_s=self.upper_s, bound_s=1.04 * self.upper_s, side=side)

    def zoom(self) -> None:
        """Search a stretch of the best path again on a fine lattice of its own, between two points of the path."""
        best = self.best
        if best is None or len(best.points) < 2:
            return
        n = len(best.points)
        at, course = np.empty(n), np.empty(n)
        timetable(self.world.boat, best.points[:, 0].copy(), best.points[:, 1].copy(), n, self.world.h0, at, course)
        span = at[-1] * (0.06, 0.12, 0.25, 0.45)[int(4.0 * uniform(self.rng))]
        begin = uniform(self.rng) * (at[-1] - span)
        i = int(np.searchsorted(at, begin, side="right")) - 1
        j = int(np.searchsorted(at, begin + span, side="left"))
        a, e = self._on_leg(best.points, at, i, begin), self._on_leg(best.points, at, j - 1, begin + span)
        inside = best.points[i + 1 : j]
        part = np.vstack([a[None, :], inside, e[None, :]])
        low, high = part.min(axis=0), part.max(axis=0)
        margin = 0.25 * float(np.hypot(*(high - low))) + 1e-6
        moving = (best.points[i + 1] - best.points[i]) if i + 1 < n else part[1] - part[0]
        h = math.atan2(*moving) if self.world.boat.cx == self.world.boat.cy == 0.0 else float(course[min(i + 1, n - 1)])
        half = max(self.world.problem.no_go_half_rad(begin + 0.7 * span), self.world.boat.up)
        downwind = e[1] < a[1] and self.world.boat.down < math.pi - 1e-6
        found = run_lattice(
            self.world,
            self.gauge,
            cells=(800, 2_000, 5_000)[int(3.0 * uniform(self.rng))],
            reach=2 + int(2.0 * uniform(self.rng)),
            half_rad=math.pi - self.world.boat.down if downwind else half,
            box=(low[0] - margin, low[1] - margin, high[0] + margin, high[1] + margin),
            downwind=downwind,
            origin=(float(a[0]), float(a[1]), h, begin),
            goal=(float(e[0]), float(e[1]), 0.0),
            bound_s=begin + span * 1.01 + 0.5 / self.world.boat.omega,
            max_pops=int(min(60_000.0, max(2_000.0, 0.4 * self.pops_per_s * self.deciding_s))),
        )
        self.effort.spend(max(20, found.pops // 8))
        if found.points is None:
            return
        joined = np.vstack([best.points[: i + 1], found.points, best.points[j:]])
        self.offer(joined, f"{best.origin}, zoomed", within=1.01)

    def _on_leg(self, points: Floats, at: Floats, i: int, t: float) -> Floats:
        """Return about where the boat is at time ``t`` on leg ``i`` (its turn counts as sailing)."""
        if i + 1 >= len(points):
            return np.asarray(points[-1])
        f = min(1.0, max(0.0, (t - at[i]) / max(1e-9, at[i + 1] - at[i])))
        return np.asarray(points[i] + f * (points[i + 1] - points[i]))

    # ------------------------------------------------------------------------------------- annealing
    def refine(self, c: Candidate) -> None:
        """Take the candidate one chunk further through its annealing cycle."""
        chunk = max(400, min(_CHUNK, 60_000 // len(c.last)))
        moves = max(1, min(self._in_time(c, chunk), self.effort.remaining(chunk), c.cycle - c.done))
        cold, price = _COLD, self.leg_price * c.cost_s * (2 if c.cycles == 0 else 1)
        hot = _HOT * (0.25 ** (c.cycles % 3))
        f0, f1 = c.done / c.cycle, (c.done + moves) / c.cycle
        at = [c.cost_s * hot * (cold / hot) ** f for f in (f0, f1)]
        size, began_s = float(np.max(np.ptp(c.points, axis=0))) + 1e-9, self.effort.elapsed_s
        cost, points, _, last = anneal(
            self.world.grid,
            self.world.boat,
            c.last,
            self.world.h0,
            self.goal,
            0.5 * size,
            self._spots(c),
            moves,
            at[0],
            at[1],
            price,
            self.rng,
        )
        self.effort.spend(moves)
        c.move_s = (self.effort.elapsed_s - began_s) / moves
        c.last, c.moves, c.done = last, c.moves + moves, c.done + moves
        if cost + price * len(points) < c.worth(price):
            c.cost_s, c.points = float(cost), points
            c.side = crossings(points, self.world.marks).tobytes()
        if c.done >= c.cycle:
            c.done, c.cycles = 0, c.cycles + 1
            c.cycle = min(_LONGEST_CYCLE, 2 * c.cycle)
            c.last = c.points
        self.note(c)

    def _in_time(self, c: Candidate, moves: int) -> int:
        """Return as many moves of a candidate as the time left allows."""
        # half of what fits: how long a move takes changes with the path
        fits = 0.5 * self.deciding_s / (c.move_s or _MOVE_S + _POINT_S * len(c.last))
        return int(min(moves, max(_LEAST, fits)))

    def tests(self, most: int, share: float) -> int:
        """Return as many visibility tests as take a share of the time left."""
        return max(1, int(min(most, share * _TESTS_PER_S * self.deciding_s)))

    def next_turn(self) -> None:
        """Give one chunk to the best candidate or to one that may still beat it."""
        ranked = sorted(self.pool, key=lambda c: c.cost_s)
        kept: list[Candidate] = []
        for c in ranked:
            twin = any(k.side == c.side and abs(k.cost_s - c.cost_s) < 1e-5 * c.cost_s for k in kept)
            if not (twin and c.cycles > 0):
                kept.append(c)
        self.pool = kept
        self.turns += 1
        # A candidate that has been through many moves must be close to the best to go on.
        rivals = [c for c in kept[1:] if c.cost_s < self.upper_s * (1.0 + 0.08 / (1.0 + c.moves / 4_000.0))]
        if rivals and self.turns % 2 == 0:
            self.refine(min(rivals, key=lambda c: (c.cost_s / self.upper_s - 1.0) * 1e6 + c.moves))
        else:
            self.refine(kept[0])

    def finish(self) -> None:
        """Give a chunk to the best candidate: its way is chosen, its curves are drawn, in cycles that are not hot."""
        best = self.best
        if best is None:
            return
        if not self.is_finishing:
            self.is_finishing = True
            best.last, best.done, best.cycle, best.cycles = best.points, 0, _FIRST_CYCLE, 2
        self.refine(best)

    def _spots(self, candidate: Candidate) -> Floats:
        """Return up to 200 obstacle corners near the path."""
        corners = self.world.corners
        if len(corners) == 0:
            return corners
        if len(corners) > _MANY:
            if len(candidate.spots) and candidate.moves < 2 * candidate.spots_at:
                return candidate.spots
            candidate.spots_at = max(_CHUNK, candidate.moves)
        near = np.full(len(corners), np.inf)
        for p, q in zip(candidate.points[:-1], candidate.points[1:], strict=True):
            d = q - p
            f = np.clip((corners - p) @ d / max(float(d @ d), 1e-18), 0.0, 1.0)
            near = np.minimum(near, np.sum((p + f[:, None] * d - corners) ** 2, axis=1))
        keep = np.argsort(near, kind="stable")[:200]
        candidate.spots = np.ascontiguousarray(corners[keep])
        return candidate.spots


def _tidy(world: SearchWorld, points: Floats) -> Floats:
    """Drop points that are not needed: doubles, and those on a straight line."""
    keep = [points[0]]
    for i in range(1, len(points)):
        if math.dist(points[i], keep[-1]) > 1e-6 or i == len(points) - 1:
            keep.append(points[i])
    cost = float(check_path(world.grid, world.boat, points, world.h0))
    out = np.array(keep)
    i = 1
    while i < len(out) - 1:
        fewer = np.delete(out, i, axis=0)
        if check_path(world.grid, world.boat, fewer, world.h0) <= cost + 1e-9:
            out = fewer
        else:
            i += 1
    return out


_LADDER = ((400, 2), (1_600, 2), (6_000, 2), (24_000, 2), (100_000, 2), (400_000, 2), (1_600_000, 2))
_LATTICES = (
    (6_000, 3),
    (2_500, 3),
    (24_000, 2),
    (12_000, 3),
    (40_000, 3),
    (100_000, 2),
    (60_000, 3),
    (160_000, 2),
    (200_000, 3),
    (400_000, 2),
    (800_000, 2),
)
_GYBED_LATE = 5.5
"""When the zone of a lattice for a beat of gybes is fitted, in multiples of the bound.

The bound knows nothing of the way that a gybe loses: through narrow water the beat takes several times as long, and on
a lattice that fits the zone of an earlier time its last boards are closed."""
_TURNS_S, _TURNS_TESTS = 0.25, 60_000
"""What must be left, in seconds or in visibility tests, for the bound on turns, which takes some 30 ms."""
_DRIFTS = (
    (1_600, 1.45),
    (6_000, 4.0),
    (6_000, 2.5),
    (6_000, 1.45),
    (12_000, 4.0),
    (12_000, 2.5),
    (24_000, 4.0),
    (24_000, 1.45),
    (24_000, 2.5),
    (60_000, 2.5),
    (60_000, 1.45),
)


def search(problem: Problem, effort: Effort, seed: int) -> Outcome:
    """Return the best path found within ``effort``, or what was proved."""
    gauge = make_gauge(problem)
    reason = None if gauge.can_move else no_course(problem)
    if reason:
        return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=reason)
    world = make_world(problem)
    wrong = _endpoint_in_solid(world)
    if wrong:
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=wrong)
    if math.hypot(*world.goal) <= world.goal_radius:
        effort.found()
        return Outcome(waypoints_en=np.asarray([problem.start_en]))
    for i, target in enumerate(problem.targets):
        if target_hit(problem, problem.start_en, problem.start_en, 0.0, 0.0) == i:
            name = target.name or f"target {i}"
            return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=f"the start is inside {name}")
    bound = Bound(world, gauge)
    if not math.isfinite(bound.value_s):
        return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=_hopeless(problem))
    searcher = Searcher(world, gauge, bound, effort, seed)
    searcher.quick()
    searcher.known()
    if not searcher.is_done:
        closed = _first_paths(searcher)
        if closed:
            return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=closed)
    if not searcher.is_done and searcher.best is not None:
        _improve(searcher)
    if searcher.best is None:
        return Outcome(waypoints_en=None, lower_bound_s=bound.value_s)
    return Outcome(
        waypoints_en=searcher.waypoints_en(),
        lower_bound_s=bound.value_s,
        trace={
            "origin": searcher.best.origin,
            "candidates": len(searcher.pool),
            "paths": tuple(world.to_en(c.points) for c in searcher.pool),
        },
    )


def _endpoint_in_solid(world: SearchWorld) -> str | None:
    """Return which endpoint no path can have, or None."""
    p = world.problem
    for name, en in (("start", p.start_en), ("goal", p.goal_en)):
        if not world.is_open(en) and shore_of(p).hits(shapely.Point(en)):
            return f"{name} is {solid_words(p, en)}"
    return None


def _hopeless(problem: Problem) -> str:
    return (
        f"the goal lies where the no-go zone lets no path lead: {math.degrees(problem.no_go_half_rad(0.0)):.1f} "
        f"deg on each side at the start, {math.degrees(min(problem.no_go_max_rad, math.pi)):.1f} deg later"
    )


def _first_paths(s: Searcher) -> str | None:
    """Find a first path; return why there is none if that is proved."""
    if len(s.world.grid.edges) == 0:
        return None if s.best is not None else _lattices(s)
    s.lattice(400, 2, margin=0.5, half_at_s=1.3 * s.bound.value_s)
    if s.world.boat.zone_half > 0.0:  # the metric knows nothing of courses that the autopilot does not keep to
        s.lattice(1_600, 2, margin=0.5, half_at_s=1.3 * s.bound.value_s)
    s.geodesic(4_000)
    return None if s.best is not None else _lattices(s)


def _lattices(s: Searcher) -> str | None:
    """Run ever finer lattices until there is a path; return why there is none if that is proved."""
    for step, (cells, reach) in enumerate(_LADDER):
        if s.world.boat.kind != 0 and step < 4:
            if s.world.boat.can_tack:
                s.drift(2 * cells, 1.45, math.inf)
            else:  # a drift takes a gybe for time alone: where its way has no room, none of the paths can be sailed
                s.lattice(2 * cells, 1, margin=0.5, half_at_s=_GYBED_LATE * s.bound.value_s)
        late = (1.3, 2.5, 1.0)[step % 3] * s.bound.value_s
        for margin in (0.25, 0.5):
            if s.effort.is_over:
                return None
            s.lattice(cells, reach, margin=margin, half_at_s=late)
            if s.best is not None:
                return None
            if s.world.fence_box:
                break
        if step == 0:
            closed = cut_off(s.world)
            if closed:
                return closed
        if step == 2:
            s.geodesic(40_000)
            if s.best is not None:
                return None
    return None


def _improve(s: Searcher) -> None:
    """Anneal the candidates and look for others until the effort ends."""
    if not shore_of(s.world.problem).is_large:
        _ = s.world.problem.eval_solid  # made now, so that the exact check at the end takes no time then
    has_solid = len(s.world.grid.edges) > 0
    lattices = list(_LATTICES) if has_solid else []
    drifts = list(_DRIFTS) if s.world.boat.kind != 0 else []
    spent, looked, turned, sharpened = 0.0, not has_solid, False, False
    s.next_turn()
    if has_solid and not s.is_done:
        s.geodesic(s.tests(40_000, 0.15))
    while not s.is_done:
        s.have_judged()  # also where the first path stays the best
        before = s.effort.fraction
        if before >= FINE_FROM:
            s.finish()
            continue
        if not looked and before > 0.08:
            looked = True
            s.other_sides()
        elif not turned and before > 0.15:
            turned = True
            s.other_tack()
        elif has_solid and not sharpened and before > 0.4:
            sharpened = True
            left = 8.0 * (s.effort.limit - s.effort.used) if s.effort.limit is not None else 2e6 * s.effort.remaining_s
            s.geodesic(int(0.25 * left))
            s.effort.spend(s.bound.sharpen_late(s.upper_s, min(40_000, int(0.1 * left))) // 8)
            if s.effort.remaining_s > _TURNS_S if s.effort.limit is None else left > _TURNS_TESTS:
                s.bound.sharpen_turns(s.upper_s)  # draws no path: no step is counted for it
        elif drifts and spent <= 0.35 * before and len(drifts) >= len(lattices):
            s.drift(*drifts.pop(0), 1.05 * s.upper_s)
        elif lattices and spent <= 0.35 * before:
            cells, reach = lattices.pop(0)
            late = s.upper_s * (1.0, 0.5, 0.8)[len(lattices) % 3]
            s.lattice(
                cells,
                reach,
                margin=0.5,
                half_at_s=late,
                stretch=1.0 + 0.07 * (len(lattices) % 4),
                bound_s=1.05 * s.upper_s,
            )
        else:
            s.next_turn()
            if has_solid and s.turns % 3 == 0 and not s.is_done:
                s.zoom()
            continue
        spent += s.effort.fraction - before

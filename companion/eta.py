"""Where the boat will be, and when it is there: the present wind, and the pace that it keeps.

The boat is walked along the legs that are left as the autopilot steers: straight to a waypoint where that can be
sailed, else close-hauled within its corridor, at its polar's speed, with the time that tacks lose. ``Pace`` is what it
has lately made of such walks: a boat that is slower than its polar, or loses more in its tacks, is there later.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from companion.boat import AutopilotLimits, Boat
from companion.current import over_water
from companion.geo.angles import difference_rad, heading_of, unit_en
from companion.geo.segments import enters_disc
from companion.messages import Command, Mode
from companion.safety import LIGHT_MPS, SAILS_MPS
from companion.skipper import SkipperState, Voyage
from companion.skipper.planning import FOLLOWS
from companion.skipper.step import Phase, Route, Snapshot, SpeedSeen, WindEstimate
from companion.skipper.way import PointEn, cross_track_m, gates_of, moved

Winds = tuple[tuple[float, float], ...]  # from [rad] and speed [m/s], for WIND_S each

STEP_S = 5.0  # of a walk
REACH_S = 900.0  # walked so far in steps; the legs beyond that are taken whole
WIND_S = 30.0  # the wind is taken to be one for so long
SLOW_MPS = 0.2  # the least that it is taken to make
SHARPEST_RAD = math.radians(150.0)  # a turn that is sharper cuts no more of its corner
LOOK_S = 30.0  # a walk to the end of the leg that is sailed then is held against what comes ...
TRIED_S = 20.0  # ... after so long
KEPT = math.exp(-TRIED_S / 150.0)  # of a try's weight with each that follows: they count for two and a half minutes
PRIOR = 1.0  # tries that the polar counts as at first
SLOWEST, FASTEST = 0.25, 1.6  # of the polar: what is outside says something else than how fast it sails
SPREAD, SPREAD_TRIES = 0.15, 2.0  # standard deviation of what tries make of a walk, and how many it counts as at first
HERE_M, STRAYS = 2.5, 2.2  # nine in ten are within so much of a place, and of the pace's doubt of the way (sitl shown)
ELSEWHERE = 1.5  # of how far a boat is from her polar here: how far she may be from that in what comes
SHOWN = (
    4.0  # a boat that has sailed a fifth of the time that is left has shown half of what it makes of it (sitl shown)
)
EVENS_OUT = 0.45  # of a try's scatter, with the root of the time: what one loses the next one gains
HALTING, HALTING_TRIES = 0.5, 3.0  # less of the polar in so many tries, a minute and a half: nothing tells when
LATE_LEAST_S = 1.0  # standard deviation of any time
LATE_SIGMAS = 1.28  # of a normal: nine in ten are below


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedPlace:
    """A place that the boat is expected at, ``in_s`` from now, on which tack.

    In nine cases of ten it is within ``within_m`` of there.
    """

    in_s: float
    at_en_m: PointEn
    is_starboard: bool
    within_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PaceTrial:
    """A walk to be held against what comes: to the end of item ``until`` of a plan, in ``winds``, in ``walk_s``.

    In the first one after a stop she gathers way (``sets_out``): that tells nothing of the pace that she keeps.
    """

    t_s: float
    plan_id: int
    until: int
    winds: Winds
    walk_s: float
    sets_out: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How much of a walk the boat makes good: of the last minutes, in tries of ``TRIED_S``.

    ``tries`` is how many it rests on, the older the less, ``took_s`` what they took and ``made_s`` by how much less was
    then left to be walked; ``scatter`` is the sum of the squares by which each was off the pace before it. ``prior`` is
    what the polar counts beside them, and ``tried`` the walk that is being sailed.
    """

    tries: float = 0.0
    prior: float = PRIOR
    took_s: float = 0.0
    made_s: float = 0.0
    scatter: float = 0.0
    tried: PaceTrial | None = None

    @property
    def share(self) -> float:
        """Return the pace as a share of the polar's."""
        prior_s = self.prior * TRIED_S
        return (
            1.0 if self.tries == 0.0 else min(max((self.made_s + prior_s) / (self.took_s + prior_s), SLOWEST), FASTEST)
        )

    @property
    def is_halting(self) -> bool:
        """Return whether it has made less than half of its polar's pace for long: nothing tells how it goes on."""
        return self.share < HALTING and self.tries >= HALTING_TRIES

    @property
    def spread(self) -> float:
        """Return the standard deviation of what a try makes of its walk, as the last ones show it."""
        return math.sqrt((SPREAD_TRIES * SPREAD * SPREAD + self.scatter) / (SPREAD_TRIES + self.tries))

    @property
    def doubt(self) -> float:
        """Return how far off the pace may be in what comes.

        A boat that is not its polar's on this course is not on the next, by another share.
        """
        return math.hypot(self.spread, 1.0 - self.share)

    @property
    def seen_speed(self) -> SpeedSeen:
        """Return what plans are told of it: the boat's share of its speeds, and how far that may be off later."""
        return SpeedSeen(share=self.share, error=self._error() if self.tries else 0.0, tries=self.tries)

    def _error(self) -> float:
        """Return how far the pace may be off in what comes, as a share of the time, beside what is untried."""
        each = self.spread / self.share
        return math.hypot(each / math.sqrt(max(1.0, self.tries + self.prior)), ELSEWHERE * (1.0 - self.share))

    def is_due(self, t_s: float, plan_id: int) -> bool:
        """Return whether a walk is to be begun: the last one is over, or was of another plan."""
        return self.tried is None or self.tried.plan_id != plan_id or t_s - self.tried.t_s >= TRIED_S

    def seen(self, t_s: float, left_s: float | None, fresh: PaceTrial | None) -> Pace:
        """Return the pace where a walk ends and ``fresh`` begins.

        ``left_s`` is what is left of the walk that was tried; None: that is not known, or the walk was given up.
        """
        tried, after = self.tried, replace(self, tried=fresh)
        if tried is None or tried.sets_out or left_s is None or t_s - tried.t_s > 1.5 * TRIED_S:
            return after
        took_s, made_s = t_s - tried.t_s, tried.walk_s - left_s
        return replace(
            after,
            tries=KEPT * self.tries + 1.0,
            prior=KEPT * self.prior,
            took_s=KEPT * self.took_s + took_s,
            made_s=KEPT * self.made_s + made_s,
            scatter=KEPT * self.scatter + (made_s / took_s - self.share) ** 2,
        )

    def left_s(self, walk_s: float) -> float:
        """Return how long a walk of ``walk_s`` will take [s]: half of the boats are there."""
        return walk_s / self.share

    def late_s(self, walk_s: float, speed_error: float) -> float:
        """Return by when nine boats in ten have made a walk [s]; ``speed_error``: what is not known of their speeds.

        What is not known of the pace itself goes with the time, what tacks and gusts do with its root.
        """
        time_s = self.left_s(walk_s)
        each = self.spread / self.share
        untried = speed_error / (1.0 + SHOWN * self.tries * TRIED_S / max(time_s, TRIED_S))
        known = math.hypot(self._error(), untried)
        sigma_s = math.hypot(time_s * known, EVENS_OUT * each * math.sqrt(TRIED_S * time_s), LATE_LEAST_S)
        return time_s + LATE_SIGMAS * sigma_s


PRIOR_PACE = Pace()


@dataclass(frozen=True, slots=True, kw_only=True)
class Eta:
    """The way ahead at the boat's pace: places in the order of time, and when the goal that is next is reached.

    Or the place that she is bound for in its stead. ``there_s`` is in half of the cases [s], ``there_late_s`` in nine
    of ten; None: the way on board does not end there, she no longer sails to there, or nothing tells when she can.
    """

    points: tuple[ExpectedPlace, ...] = ()
    there_s: float | None = None
    there_late_s: float | None = None


UNKNOWN = Eta()


def eta_of(snapshot: Snapshot, state: SkipperState, voyage: Voyage, pace: Pace) -> Eta:
    """Return where the boat is expected from here on; empty where it is not being sailed, or nothing is known."""
    walk = _walk(snapshot, state, voyage)
    if walk is None or state.mission.route is None:
        return UNKNOWN
    way_m = itertools.accumulate(
        (math.dist(a.at_en_m, b.at_en_m) for a, b in itertools.pairwise(walk.points)), initial=0.0
    )
    strays = STRAYS * pace.doubt
    points = tuple(
        replace(p, in_s=round(pace.left_s(p.in_s), 1), within_m=HERE_M + strays * so_far_m)
        for p, so_far_m in zip(walk.points, way_m, strict=True)
    )
    if walk.goal_s is None or pace.is_halting or _is_becalmed(snapshot, state) or _is_leaving(state):
        return Eta(points=points)
    return Eta(
        points=points, there_s=pace.left_s(walk.goal_s), there_late_s=pace.late_s(walk.goal_s, voyage.boat.speed_error)
    )


def _is_becalmed(snapshot: Snapshot, state: SkipperState) -> bool:
    """Return whether the boat lies in a calm, or has no wind to sail by and does not sail.

    The mean that the watchdog waits for is of a wind that has gone a minute ago.
    """
    wind_mps, vehicle = snapshot.wind.present_tws_mps, snapshot.vehicle
    is_calm = wind_mps is not None and vehicle is not None and wind_mps < LIGHT_MPS and vehicle.speed_mps < SAILS_MPS
    return is_calm or any(raised.name == "becalmed" for raised in state.alarms.raised)


def _is_leaving(state: SkipperState) -> bool:
    """Return whether the boat is held, or bound elsewhere than the way on board leads: another is made or uploaded."""
    route, order, plan, upload = state.mission.route, state.orders.standing, state.pending.plan, state.pending.upload
    if state.phase is Phase.HOLDING or route is None:
        return True
    if order is not None and not route.bound_for:
        return True
    on_board = _bound_for(route, state.mission.index)
    if upload is not None:
        return _bound_for(upload.route, state.mission.index) != on_board
    return plan is not None and plan.from_index is None and plan.facts.bound_for != on_board


def _bound_for(route: Route, index: int) -> str:
    """Return where what is left from an item on leads in the first place: empty: to a goal."""
    return "" if route.is_for_goals(index) else route.bound_for


def paced(pace: Pace, snapshot: Snapshot, state: SkipperState, voyage: Voyage) -> Pace:
    """Return the pace after a step."""
    route, tried = state.mission.route, pace.tried
    autopilot = snapshot.autopilot
    if (
        route is None
        or state.position.doubt is not None
        or autopilot is None
        or not autopilot.is_armed
        or state.phase is Phase.HOLDING  # where she lies tells nothing of how fast she sails
    ):
        return pace if tried is None else replace(pace, tried=None)
    if not pace.is_due(snapshot.t_s, route.plan_id):
        return pace
    walk = _walk(snapshot, state, voyage, whole_s=LOOK_S)
    fresh = (
        None
        if walk is None or walk.last < 0
        else PaceTrial(
            t_s=snapshot.t_s,
            plan_id=route.plan_id,
            until=walk.last,
            winds=walk.winds,
            walk_s=walk.points[-1].in_s,
            sets_out=tried is None or (tried.sets_out and snapshot.t_s - tried.t_s < TRIED_S),
        )
    )
    left = None
    if tried is not None and tried.plan_id == route.plan_id and state.mission.index <= tried.until:
        left = _walk(snapshot, state, voyage, until=tried.until, winds=tried.winds)
        if left is not None and left.last != tried.until:  # a loiter lies on her way: the walk does not end there
            left = None
    return pace.seen(snapshot.t_s, None if left is None else left.points[-1].in_s, fresh)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Walked:
    points: tuple[ExpectedPlace, ...]
    winds: Winds
    last: int  # the item to whose end it has come, -1: none
    goal_s: float | None


def _walk(
    snapshot: Snapshot,
    state: SkipperState,
    voyage: Voyage,
    *,
    whole_s: float = math.inf,
    until: int | None = None,
    winds: Winds | None = None,
) -> _Walked | None:
    """Walk along the legs that are left; None where the boat is not being sailed.

    The walk ends with the leg that is sailed after ``whole_s``, or with item ``until``; ``winds`` are taken in place of
    those that are expected.
    """
    here, wind, vehicle, route = snapshot.position_en_m, snapshot.wind, snapshot.vehicle, state.mission.route
    autopilot = snapshot.autopilot
    if (
        here is None
        or vehicle is None
        or route is None
        or wind.mean_twd_from_rad is None
        or (wind.mean_tws_mps is None)
        or not state.voyage.sailing
        or state.voyage.over
        or autopilot is None
        or (autopilot.mode not in FOLLOWS)
    ):
        return None
    limits = snapshot.limits or AutopilotLimits()
    if autopilot.mode is Mode.GUIDED:
        limits = replace(limits, sail_xtrack_max_m=0.0)  # GUIDED has no corridor
    winds = _winds(wind, wind.mean_twd_from_rad, wind.mean_tws_mps) if winds is None else winds
    walker = _Walker(winds, snapshot.current.planned_en_mps, voyage.boat, limits, heading_rad=vehicle.heading_rad)
    gates = gates_of(voyage, state.progress.approaches)
    goal = next((n for n in range(state.progress.gate, len(gates)) if gates[n].ends_goal), None)
    is_for_goals = route.is_for_goals(state.mission.index)
    if not is_for_goals:
        goal = None  # home, a refuge, a place that was named: there at the last waypoint
    mark = None if goal is None else (gates[goal].en_m, gates[goal].radius_m)
    at, time_s, last = here, 0.0, -1
    goal_s: float | None = None
    points = [ExpectedPlace(in_s=0.0, at_en_m=at, is_starboard=walker.is_starboard)]
    for n in range(state.mission.index, len(route.items)):
        if route.items[n].command != Command.NAV_WAYPOINT or time_s >= whole_s or (until is not None and n > until):
            break
        start, end, last = route.leg_from_en_m[n], route.points_en_m[n], n
        ends_goal = goal is not None and route.gate_of[n] == goal if is_for_goals else n == route.bound_at
        while time_s < REACH_S:
            to_go_m = math.dist(at, end)
            if to_go_m <= limits.wp_radius_m:
                break
            velocity_en, lost_s = walker.steer(time_s, at, start, end)
            if lost_s > 0.0:
                time_s += lost_s
                points.append(ExpectedPlace(in_s=time_s, at_en_m=at, is_starboard=walker.is_starboard))
            step_s = min(STEP_S, to_go_m / math.hypot(*velocity_en))
            before, at = at, (at[0] + step_s * velocity_en[0], at[1] + step_s * velocity_en[1])
            if ends_goal and goal_s is None and mark is not None and (part := _entered(before, at, mark)) is not None:
                goal_s = time_s + part * step_s
            time_s += step_s
            points.append(ExpectedPlace(in_s=time_s, at_en_m=at, is_starboard=walker.is_starboard))
        if math.dist(at, end) > limits.wp_radius_m:  # what is farther is taken whole
            time_s, at = time_s + walker.whole_s(at, end), end
            if until is not None or whole_s < math.inf:
                points.append(ExpectedPlace(in_s=time_s, at_en_m=at, is_starboard=walker.is_starboard))
        if ends_goal and goal_s is None:
            goal_s = time_s
    return _Walked(points=tuple(points), winds=winds, last=last, goal_s=goal_s)


def _entered(before: PointEn, at: PointEn, mark: tuple[PointEn, float]) -> float | None:
    """Return where a step enters a mark's circle (centre, radius [m]), as a share of the step; None: it does not."""
    disc = np.array([*mark[0], mark[1]])
    share = enters_disc(before[0], before[1], at[0] - before[0], at[1] - before[1], disc)
    return share if share <= 1.0 else None


def _winds(wind: WindEstimate, twd_rad: float, tws_mps: float) -> Winds:
    """Return the wind that is expected (from [rad], speed [m/s]) at the middle of each ``WIND_S`` from now."""
    forecast = wind.forecast
    if forecast is None:
        return ((twd_rad, tws_mps),)
    at_s = (np.arange(math.ceil(REACH_S / WIND_S)) + 0.5) * WIND_S
    at_s = at_s[: 1 + int(np.searchsorted(at_s, forecast.horizon_s[-1]))]
    twd = np.interp(at_s, forecast.horizon_s, np.unwrap(forecast.mean_twd_from_rad))
    tws = np.interp(at_s, forecast.horizon_s, forecast.mean_tws_mps)
    return tuple(zip(twd.tolist(), tws.tolist(), strict=True))


class _Walker:
    """Steers as the autopilot does in the wind that is expected and a steady current."""

    def __init__(
        self, winds: Winds, current_en_mps: PointEn, boat: Boat, limits: AutopilotLimits, *, heading_rad: float
    ) -> None:
        self._winds = winds
        self._twd_rad, self._tws_mps = over_water(*winds[0], current_en_mps)
        self._current, self._boat, self._limits, self._heading_rad = current_en_mps, boat, limits, heading_rad
        self.is_starboard = difference_rad(self._twd_rad, heading_rad) > 0.0  # the wind is to the right of the bow

    def steer(self, time_s: float, at: PointEn, start: PointEn, end: PointEn) -> tuple[PointEn, float]:
        """Return the velocity over ground [m/s] from ``at`` along the leg, and what a tack or gybe to it loses [s]."""
        wind = self._winds[min(int(time_s / WIND_S), len(self._winds) - 1)]
        self._twd_rad, self._tws_mps = over_water(*wind, self._current)
        was_starboard = self.is_starboard
        course_rad = heading_of(end[0] - at[0], end[1] - at[1])
        off_rad = difference_rad(self._twd_rad, course_rad)
        if abs(off_rad) < self._limits.sail_no_go_angle_rad:
            self._tack_at(at, start, end)
            course_rad = self._close_rad(is_starboard=self.is_starboard)
            velocity_en = self._over_ground(course_rad)
        else:
            self.is_starboard = off_rad > 0.0
            velocity_en = self._along(course_rad, off_rad)
        turn_rad = abs(difference_rad(course_rad, self._heading_rad))
        self._heading_rad = course_rad
        if was_starboard == self.is_starboard:
            return velocity_en, 0.0
        is_tack = abs(difference_rad(self._twd_rad, course_rad)) < math.pi / 2.0
        loss_s = self._boat.tack_loss_s if is_tack else self._boat.gybe_loss_s
        return velocity_en, max(0.0, loss_s - self._cut_s(turn_rad))

    def _cut_s(self, turn_rad: float) -> float:
        """Return what a turn saves against its corner [s]: a boat that turns keeps her way, and sails an arc."""
        half_rad = 0.5 * min(turn_rad, SHARPEST_RAD)
        return 2.0 * (math.tan(half_rad) - half_rad) / self._boat.turn_rate_radps

    def whole_s(self, at: PointEn, end: PointEn) -> float:
        """Return how long the way to ``end`` takes, beaten where it asks for that [s]."""
        length_m = math.dist(at, end)
        if length_m < 1e-9:
            return 0.0
        no_go_rad = self._limits.sail_no_go_angle_rad
        course_rad = heading_of(end[0] - at[0], end[1] - at[1])
        off_rad = difference_rad(self._twd_rad, course_rad)
        if abs(off_rad) >= no_go_rad:
            return length_m / math.hypot(*self._along(course_rad, off_rad))
        speed_mps = self._boat.polar.speed_mps(no_go_rad, self._tws_mps) * math.cos(no_go_rad) / math.cos(off_rad)
        east, north = unit_en(course_rad)
        return length_m / max(SLOW_MPS, speed_mps + east * self._current[0] + north * self._current[1])

    def _close_rad(self, *, is_starboard: bool) -> float:
        """Return the close-hauled course on a tack [rad]."""
        no_go_rad = self._limits.sail_no_go_angle_rad
        return self._twd_rad - no_go_rad if is_starboard else self._twd_rad + no_go_rad

    def _over_ground(self, heading_rad: float) -> PointEn:
        """Return the velocity over ground on a heading [m/s]."""
        speed_mps = max(
            SLOW_MPS, self._boat.polar.speed_mps(abs(difference_rad(self._twd_rad, heading_rad)), self._tws_mps)
        )
        east, north = unit_en(heading_rad)
        return speed_mps * east + self._current[0], speed_mps * north + self._current[1]

    def _along(self, course_rad: float, off_rad: float) -> PointEn:
        """Return the velocity over ground of a boat that keeps to a course in the current [m/s]."""
        speed_mps = self._boat.polar.speed_mps(abs(off_rad), self._tws_mps)
        east, north = unit_en(course_rad)
        along_mps = self._current[0] * east + self._current[1] * north
        across_mps = self._current[0] * north - self._current[1] * east
        made_mps = max(SLOW_MPS, along_mps + math.sqrt(max(0.0, speed_mps * speed_mps - across_mps * across_mps)))
        return made_mps * east, made_mps * north

    def _tack_at(self, at: PointEn, start: PointEn, end: PointEn) -> None:
        """Tack at the corridor's edge, as the autopilot does."""
        most_m, off_m = self._limits.sail_xtrack_max_m, cross_track_m(at, start, end)
        if most_m <= 0.0 or abs(off_m) < most_m:
            return
        close_rad = self._close_rad(is_starboard=self.is_starboard)
        if abs(cross_track_m(moved(at, close_rad, 1.0), start, end)) > abs(off_m):
            self.is_starboard = not self.is_starboard

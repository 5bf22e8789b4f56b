"""Who sails WRSC 2013: guidance by field with look-ahead, by plan with the field as last resort, Schmitt's bare field.

All see the intruder through its datagrams alone: JSON to report, report to track, track to predicted discs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.field.guidance import LastResort, go_to, helm, step
from companion.field.look_ahead import way_out_rad
from companion.field.values import GuidanceSettings, GuidanceState, Intent, MovingObstacle, Situation
from companion.field.vector_fields import Uniform
from companion.geo.frame import LocalFrame
from companion.messages import Target
from companion.planner import Problem, plan
from companion.planner.problem import BoatLimits, ProblemWind, Sigma, evaluate
from companion.traffic import (
    Conflict,
    Decision,
    TargetLimits,
    Targets,
    Vessel,
    check_legs,
    decide,
    decode_json,
    planning_discs,
    predict,
)
from companion.traffic.occupancy import Keep
from companion.traffic.predict import STEADY, risk_factor
from lab.tasks.controllers import line_following
from sitl.world import LENGTH_M

HALF_M = 100.0
SHUTTLE_M = 30.0  # while waiting: to and fro across the wind, this far each side of the centre
WAIT_BOX_M = 85.0
FAR_M = 600.0  # beyond what both can run in a minute and a half
CLEARANCE_M = 12.0  # between hulls; the task asks for 5
KEEP = Keep(
    sigmas=risk_factor(1e-4),
    clearance_m=CLEARANCE_M,
    own_radius_m=0.5 * LENGTH_M,
    own_timing_mps=0.05,
    ahead_m=25.0,
    horizon_s=180.0,
)


class FieldSkipper:
    """Waits by shuttling through the centre, leaves by the side that is soonest reached clear of the intruder."""

    def __init__(
        self,
        habits_for: Callable[..., GuidanceSettings],
        frame: LocalFrame,
        *,
        look_ahead: bool,
        half_m: float = HALF_M,
    ) -> None:
        self.irons = self.plans = 0
        self.last_resort_s = 0.0
        self._habits_for = habits_for
        self._targets = Targets.empty(frame, TargetLimits())
        self._state = GuidanceState()
        self._look_ahead = look_ahead
        self._end = 1
        self._exit_rad: float | None = None
        self._half_m = half_m
        self.entered = False

    def watch(self, seen: Situation, datagram: bytes | None) -> tuple[Vessel, ...]:
        """Fold the datagram in; return the vessels now."""
        if datagram is not None:
            report = decode_json(datagram, seen.t_s)
            if report is not None:
                self._targets = self._targets.heard(report)
        vessels = self._targets.picture(seen.t_s).vessels
        for vessel in vessels:
            east, north = predict(vessel, seen.t_s, STEADY).mean_en_m
            # A metre inside, so that the noise of its position does not open the gate too early.
            if max(abs(east), abs(north)) < self._half_m - 1.5:
                self.entered = True
        return vessels

    def decide(self, seen: Situation, datagram: bytes | None) -> tuple[float, float]:
        """Return (heading, thrust)."""
        return self.by_field(seen, self.watch(seen, datagram))

    def by_field(self, seen: Situation, vessels: tuple[Vessel, ...]) -> tuple[float, float]:
        """Steer by the field."""
        seen = replace(seen, obstacles=obstacles_of(vessels, seen))
        habits = self._habits_for(seen.tws_mps, look_ahead=self._look_ahead, horizon_s=90.0 if self.entered else 60.0)
        intent = self._leave(seen, habits) if self.entered else self._wait(seen)
        self._state, setpoint = step(self._state, seen, intent, habits)
        self.irons = self._state.irons
        return setpoint.heading_rad, setpoint.thrust

    def _wait(self, seen: Situation) -> Intent:
        assert seen.twd_from_rad is not None
        across = seen.twd_from_rad + math.pi / 2.0
        # Upwind of the centre a little: leeway and tacks lose ground to leeward.
        up = 10.0
        centre = (up * math.sin(seen.twd_from_rad), up * math.cos(seen.twd_from_rad))
        reach = self._end * SHUTTLE_M
        end = (centre[0] + reach * math.sin(across), centre[1] + reach * math.cos(across))
        if math.dist(seen.en_m, end) < 15.0 or self._beyond(seen, centre, across):
            self._end = -self._end
        box = (-WAIT_BOX_M, -WAIT_BOX_M, WAIT_BOX_M, WAIT_BOX_M)
        intent = go_to(end, seen.twd_from_rad, half_m=15.0)
        is_near_edge = max(abs(seen.en_m[0]), abs(seen.en_m[1])) > 0.6 * WAIT_BOX_M
        return replace(intent, stay_in=box) if self._look_ahead and is_near_edge else intent

    def _beyond(self, seen: Situation, centre: tuple[float, float], across: float) -> bool:
        along = (seen.en_m[0] - centre[0]) * math.sin(across) + (seen.en_m[1] - centre[1]) * math.cos(across)
        return along * self._end > SHUTTLE_M

    def _leave(self, seen: Situation, habits: GuidanceSettings) -> Intent:
        """Head for the side of the square that is reached soonest on a heading that stays clear."""
        assert seen.twd_from_rad is not None
        if max(abs(seen.en_m[0]), abs(seen.en_m[1])) > self._half_m + 30.0 and self._exit_rad is not None:
            return Intent(field=Uniform(self._exit_rad))
        square = shapely.box(-self._half_m, -self._half_m, self._half_m, self._half_m)
        self._exit_rad = way_out_rad(seen, square, habits, self._exit_rad)
        return Intent(field=Uniform(self._exit_rad))


def obstacles_of(vessels: tuple[Vessel, ...], seen: Situation) -> tuple[MovingObstacle, ...]:
    """Return the discs of the vessels as obstacles of the guidance, at the sigmas and clearance of ``KEEP``."""
    out = []
    for vessel in vessels:
        now = predict(vessel, seen.t_s, STEADY)
        if math.dist(now.mean_en_m, seen.en_m) > FAR_M:
            continue
        later = predict(vessel, seen.t_s + 90.0, STEADY)
        k = KEEP.sigmas
        sigma_now = max(now.sigma_along_m, now.sigma_across_m)
        sigma_later = max(later.sigma_along_m, later.sigma_across_m)
        keep = now.reach_m + KEEP.own_radius_m + KEEP.clearance_m + k * sigma_now
        out.append(
            MovingObstacle(
                en_m=now.mean_en_m,
                velocity_en_mps=now.velocity_en_mps,
                keep_m=keep,
                growth_mps=k * (sigma_later - sigma_now) / 90.0,
            )
        )
    return tuple(out)


EXPANSIONS = 4000
CHECK_S = 2.0
RETRY_S = 10.0
# Where to leave: two places on each side of the square, 30 m outside it.
_OUT_M = HALF_M + 30.0
_GOALS = tuple(goal for side in (-_OUT_M, _OUT_M) for off in (-45.0, 45.0) for goal in ((side, off), (off, side)))
GOAL_RADIUS_M = 22.0
WIND_SIGMA = Sigma(model="ar1", sigma0_rad=math.radians(3.0), sigma_inf_rad=math.radians(9.0), rho_hz=0.036)


def problem_for(
    seen: Situation, habits: GuidanceSettings, goal_en: tuple[float, float], discs: tuple[Target, ...]
) -> Problem:
    """Return the planning problem of the moment; its clock starts now, as the discs' does."""
    assert seen.twd_from_rad is not None
    return Problem(
        start_en=seen.en_m,
        start_heading_rad=seen.heading_rad,
        goal_en=goal_en,
        goal_radius_m=GOAL_RADIUS_M,
        wind=ProblemWind(twd_from_rad=seen.twd_from_rad, tws_mps=seen.tws_mps, sigma=WIND_SIGMA),
        boat=BoatLimits(
            no_go_half_rad=habits.no_go_half_rad,
            turn_rate_radps=habits.turn_rate_radps,
            polar_twa_rad=habits.polar_twa_rad,
            polar_mps=habits.polar_mps,
            tack_loss_s=habits.tack_s,
        ),
        delta_s=0.7,
        targets=tuple(replace(disc, spread=None) for disc in discs),
    )


class PlanSkipper(FieldSkipper):
    """Waits on the shuttle line by line following, leaves by plan."""

    def __init__(self, habits_for: Callable[..., GuidanceSettings], frame: LocalFrame, seed: int) -> None:
        super().__init__(habits_for, frame, look_ahead=True)
        self._seed = seed
        self._way: NDArray[np.float64] | None = None
        self._goal: tuple[float, float] | None = None
        self._planned_s = -math.inf
        self._checked_s = -math.inf
        self._q = 1
        self._helm = GuidanceState()
        self._resort = LastResort()

    def decide(self, seen: Situation, datagram: bytes | None) -> tuple[float, float]:
        """Return (heading, thrust)."""
        vessels = self.watch(seen, datagram)
        if not self.entered:
            return self._along_shuttle(seen)
        habits = self._habits_for(seen.tws_mps)
        if seen.t_s - self._checked_s >= CHECK_S or self._way is None:
            self._checked_s = seen.t_s
            self._check(seen, vessels, habits)
        if self._resort.engaged or self._way is None:
            self.last_resort_s += 1.0
            return self.by_field(seen, vessels)
        return self._along_plan(seen)

    def _along_shuttle(self, seen: Situation) -> tuple[float, float]:
        assert seen.twd_from_rad is not None
        across = seen.twd_from_rad + math.pi / 2.0
        centre = (10.0 * math.sin(seen.twd_from_rad), 10.0 * math.cos(seen.twd_from_rad))
        reach = SHUTTLE_M * self._end
        b = (centre[0] + reach * math.sin(across), centre[1] + reach * math.cos(across))
        a = (2.0 * centre[0] - b[0], 2.0 * centre[1] - b[1])
        if self._beyond(seen, centre, across):
            self._end = -self._end
            a, b = b, a
        return self._follow(seen, a, b)

    def _follow(self, seen: Situation, a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
        assert seen.twd_from_rad is not None
        habits = self._habits_for(seen.tws_mps)
        command = line_following(
            seen.en_m,
            seen.heading_rad,
            seen.twd_from_rad,
            a,
            b,
            self._q,
            r_m=12.0,
            close_hauled_rad=habits.no_go_half_rad,
        )
        self._q = command.q
        self._helm, heading, _ = helm(self._helm, seen, command.heading_rad, habits)
        self.irons = self._helm.irons + self._state.irons
        return heading, 1.0

    def _along_plan(self, seen: Situation) -> tuple[float, float]:
        assert self._way is not None
        way = self._way
        while len(way) > 2 and (_past(seen.en_m, way[0], way[1]) or math.dist(seen.en_m, way[1]) < 6.0):
            way = way[1:]
        self._way = way
        a, b = way[0], way[1]
        if len(way) == 2 and _past(seen.en_m, a, b):
            # Out: on as before.
            b = b + (b - a)
        if float(np.hypot(*(b - a))) < 1e-6:
            return self.by_field(seen, ())
        return self._follow(seen, (float(a[0]), float(a[1])), (float(b[0]), float(b[1])))

    def _check(self, seen: Situation, vessels: tuple[Vessel, ...], habits: GuidanceSettings) -> None:
        """Check the active plan against the targets; plan again where that says so."""
        discs = planning_discs(vessels, seen.t_s, KEEP, motion=STEADY)
        own_discs = tuple(d for d in discs if d.from_s == 0.0)
        near = any(math.hypot(seen.en_m[0] - d.x_m, seen.en_m[1] - d.y_m) < d.radius_m for d in own_discs)
        conflicts: tuple[Conflict, ...] = ()
        verdict = Decision.REPLAN
        if self._way is not None and self._goal is not None:
            rest = np.vstack([np.asarray(seen.en_m), self._way[1:]])
            legs = evaluate(problem_for(seen, habits, self._goal, ()), rest).legs
            conflicts = check_legs(legs, discs)
            verdict = decide(conflicts, since_replan_s=seen.t_s - self._planned_s)
        if self._way is None and seen.t_s - self._planned_s < RETRY_S:
            verdict = Decision.WAIT  # nothing was found a moment ago: the field has the helm meanwhile
        is_out = max(abs(seen.en_m[0]), abs(seen.en_m[1])) > HALF_M + 10.0
        if verdict is Decision.REPLAN and not near and not (is_out and not conflicts):
            self._plan(seen, habits, discs)
        self._resort = self._resort.step(seen.t_s, too_near=near, can_plan=self._way is not None and not near)

    def _plan(self, seen: Situation, habits: GuidanceSettings, discs: tuple[Target, ...]) -> None:
        """Plan to the goals that look nearest in time; keep the best that keeps clear."""
        self._planned_s = seen.t_s
        self._way = None
        best_s = math.inf
        for _, goal in sorted((_estimate_s(seen, habits, goal), goal) for goal in _GOALS)[:3]:
            self.plans += 1
            answer = plan(problem_for(seen, habits, goal, discs), expansions=EXPANSIONS, seed=self._seed)
            if answer.legs and answer.cost_s < best_s and len(answer.waypoints_en) >= 2:
                best_s, self._way, self._goal = answer.cost_s, np.array(answer.waypoints_en), goal
        self._q = 1
        self._helm = replace(self._helm, failed_tacks=0)


def _past(at_en: tuple[float, float], a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Is the boat past the perpendicular at b of the leg a to b?"""
    return float((at_en[0] - b[0]) * (b[0] - a[0]) + (at_en[1] - b[1]) * (b[1] - a[1])) > 0.0


def _estimate_s(seen: Situation, habits: GuidanceSettings, goal: tuple[float, float]) -> float:
    """Return about how long the way to a goal takes: straight, or a beat's two boards."""
    assert seen.twd_from_rad is not None
    de, dn = goal[0] - seen.en_m[0], goal[1] - seen.en_m[1]
    off = abs(math.remainder(math.atan2(de, dn) - seen.twd_from_rad, 2.0 * math.pi))
    half = habits.no_go_half_rad + math.radians(5.0)
    angle = max(off, half)
    speed = float(np.interp(angle, habits.polar_twa_rad, habits.polar_mps)) * math.cos(max(0.0, half - off))
    turn = abs(math.remainder(math.atan2(de, dn) - seen.heading_rad, 2.0 * math.pi)) / habits.turn_rate_radps
    return (math.hypot(de, dn) - GOAL_RADIUS_M) / max(speed, 0.1) + 0.5 * turn

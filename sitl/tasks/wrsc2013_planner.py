"""WRSC 2013 by plan: wait on a line, leave by a plan made in time around the intruder, the field as last resort."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from companion.field.controllers import line_following
from companion.field.guidance import LastResort, helm
from companion.field.values import GuidanceSettings, GuidanceState, Situation
from companion.geo.frame import LocalFrame
from companion.planner import Problem, plan
from companion.planner.problem import BoatLimits, ProblemWind, Sigma, Target, evaluate
from companion.traffic import Vessel, check_legs, decide, planning_discs
from companion.traffic.occupancy import Disc
from companion.traffic.plans import Conflict, Decision
from companion.traffic.predict import STEADY
from sitl.tasks.wrsc2013_skippers import HALF_M, KEEP, SHUTTLE_M, FieldSkipper

EXPANSIONS = 4000
CHECK_S = 2.0
RETRY_S = 10.0
# Where to leave: two places on each side of the square, 30 m outside it.
_OUT_M = HALF_M + 30.0
_GOALS = tuple(
    goal for side in (-_OUT_M, _OUT_M) for off in (-45.0, 45.0) for goal in ((side, off), (off, side))
)
GOAL_RADIUS_M = 22.0
WIND_SIGMA = Sigma(model="ar1", sigma0_rad=math.radians(3.0), sigma_inf_rad=math.radians(9.0), rho_hz=0.036)


def problem_for(
    seen: Situation, habits: GuidanceSettings, goal_en: tuple[float, float], discs: tuple[Disc, ...], *,
    goal_radius_m: float = GOAL_RADIUS_M,
) -> Problem:
    """Return the planning problem of the moment; its clock starts now, as the discs' does."""
    assert seen.twd_from_rad is not None
    return Problem(
        start_en=seen.en_m, start_heading_rad=seen.heading_rad, goal_en=goal_en, goal_radius_m=goal_radius_m,
        wind=ProblemWind(twd_from_rad=seen.twd_from_rad, tws_mps=seen.tws_mps, sigma=WIND_SIGMA),
        boat=BoatLimits(
            no_go_half_rad=habits.no_go_half_rad, turn_rate_radps=habits.turn_rate_radps,
            polar_twa_rad=habits.polar_twa_rad, polar_mps=habits.polar_mps, tack_loss_s=habits.tack_s,
        ),
        delta_s=0.7, targets=tuple(target_of(disc) for disc in discs),
    )


def target_of(disc: Disc) -> Target:
    """Return the planner's target for a disc."""
    return Target(x_m=disc.x_m, y_m=disc.y_m, vx_mps=disc.vx_mps, vy_mps=disc.vy_mps, radius_m=disc.radius_m,
                  growth_mps=disc.growth_mps, from_s=disc.from_s, until_s=disc.until_s, name=disc.name)


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
        command = line_following(seen.en_m, seen.heading_rad, seen.twd_from_rad, a, b, self._q, r_m=12.0,
                                 close_hauled_rad=habits.no_go_half_rad)
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
        near = any(
            math.hypot(seen.en_m[0] - d.x_m, seen.en_m[1] - d.y_m) < d.radius_m for d in own_discs
        )
        conflicts: tuple[Conflict, ...] = ()
        verdict = Decision.REPLAN
        if self._way is not None and self._goal is not None:
            rest = np.vstack([np.asarray(seen.en_m), self._way[1:]])
            legs = evaluate(problem_for(seen, habits, self._goal, ()), rest).legs
            conflicts = check_legs(legs, discs)
            verdict = decide(conflicts, since_replan_s=seen.t_s - self._planned_s)
        if self._way is None and seen.t_s - self._planned_s < RETRY_S:
            verdict = Decision.WAIT          # nothing was found a moment ago: the field has the helm meanwhile
        is_out = max(abs(seen.en_m[0]), abs(seen.en_m[1])) > HALF_M + 10.0
        if verdict is Decision.REPLAN and not near and not (is_out and not conflicts):
            self._plan(seen, habits, discs)
        self._resort = self._resort.step(seen.t_s, too_near=near, can_plan=self._way is not None and not near)

    def _plan(self, seen: Situation, habits: GuidanceSettings, discs: tuple[Disc, ...]) -> None:
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

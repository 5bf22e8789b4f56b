"""Sailing by plan among ships: AVALON's four at once, and ships ten times faster crossing, overtaking and head-on.

The boat sails its plan with a speed that is off by a tenth; ships are seen by noisy AIS reports every 10 s. The
plan is checked against the picture every 5 s, made again only where ``companion.traffic.decide`` says that it has
become unsafe, and the distance between successive plans is taken over the next five minutes (Büsser 2009, section 5.2:
four ships, no replanning every 20 s, paths that look more or less the same).

    python -m lab.tasks.ships --seeds 5
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from companion.geo.frame import LocalFrame
from companion.messages import AisReport, GeoPoint, Target
from companion.planner import Plan, Problem, plan
from companion.planner.problem import VESSELS_SHARE, BoatLimits, ProblemWind, Sigma, evaluate
from companion.skipper.planning import ALIKE_S, GIVE_UP_RISK, HORIZON_S, OWN_TIMING_MPS, PART_BY_RUNG, SETTLED_M, soon
from companion.traffic import (
    Decision,
    Targets,
    TrafficPicture,
    Vessel,
    check_legs,
    decide,
    path_distance_m,
    planning_discs,
)
from companion.traffic.occupancy import Keep
from companion.traffic.plans import MIN_INTERVAL_S, pressing
from companion.traffic.predict import tail_factor
from lab.tasks.wrsc2013 import least_distance_m
from sitl.world import polar_at

ORIGIN = GeoPoint(lat_deg=48.0, lon_deg=-6.0)
STEP_S = 5.0
REPORT_S = 10.0
DELTA_S = 0.7
CLEARANCE_M = 50.0
EXPANSIONS = 4000
LIMIT_S = 5400.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskShip:
    """A ship on a straight course: where it is at t = 0, how it goes, how long it is."""

    en_m: tuple[float, float]
    course_deg: float
    speed_mps: float
    length_m: float = 150.0
    turn_at_s: float | None = None
    turn_deg: float = 0.0

    def course_at(self, t_s: float) -> float:
        """Return the course [rad]."""
        turned = self.turn_deg if self.turn_at_s is not None and t_s >= self.turn_at_s else 0.0
        return math.radians(self.course_deg + turned)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the position of its middle, which is its antenna's."""
        first = t_s if self.turn_at_s is None else min(t_s, self.turn_at_s)
        a, b = math.radians(self.course_deg), self.course_at(t_s)
        x, y = self.en_m[0] + first * self.speed_mps * math.sin(a), self.en_m[1] + first * self.speed_mps * math.cos(a)
        rest = t_s - first
        return x + rest * self.speed_mps * math.sin(b), y + rest * self.speed_mps * math.cos(b)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """From the origin to ``goal_en`` among ships."""

    name: str
    goal_en: tuple[float, float]
    ships: tuple[TaskShip, ...]
    twd_deg: float = 0.0
    tws_mps: float = 6.0


def meeting(
    goal: tuple[float, float],
    share: float,
    course_deg: float,
    speed: float,
    own_mps: float,
    miss_m: float = 0.0,
    **more: float,
) -> TaskShip:
    """Return a ship that would meet a boat going straight to ``goal`` after ``share`` of the way."""
    x, y = goal[0] * share, goal[1] * share
    t = math.hypot(x, y) / own_mps
    c = math.radians(course_deg)
    east = x - t * speed * math.sin(c) + miss_m * math.cos(c)
    north = y - t * speed * math.cos(c) - miss_m * math.sin(c)
    return TaskShip(en_m=(east, north), course_deg=course_deg, speed_mps=speed, **more)


def scenes() -> tuple[Scene, ...]:
    """Return the four scenes; the boat makes about 2.2 m/s on a beam reach, to the east."""
    goal, own = (3000.0, 0.0), 2.2
    fast = 10.0 * own
    four = (
        meeting(goal, 0.25, 180.0, 6.0, own),
        meeting(goal, 0.45, 0.0, 4.0, own, length_m=90.0),
        meeting(goal, 0.6, 225.0, 8.0, own),
        meeting(goal, 0.8, 320.0, 5.0, own, length_m=60.0),
    )
    return (
        Scene(name="four ships (AVALON)", goal_en=goal, ships=four),
        Scene(name="crossing, ten times faster", goal_en=goal, ships=(meeting(goal, 0.5, 180.0, fast, own),)),
        Scene(name="overtaking, ten times faster", goal_en=goal, ships=(meeting(goal, 0.5, 90.0, fast, own),)),
        Scene(name="head-on, ten times faster", goal_en=goal, ships=(meeting(goal, 0.5, 270.0, fast, own),)),
        Scene(
            name="four ships, one turns",
            goal_en=goal,
            ships=(*four[1:], meeting(goal, 0.5, 180.0, 6.0, own, miss_m=900.0, turn_at_s=400.0, turn_deg=40.0)),
        ),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ShipsOutcome:
    """What came of a voyage. Distances [m] between hulls; path distances between successive plans, one each replan."""

    scene: str
    seed: int
    arrived: bool
    time_s: float
    least_m: float
    plans: int
    shortest_interval_s: float
    path_distances_m: tuple[float, ...]
    checks_unsafe: int
    no_plan: int


class ShipsVoyage:
    """One voyage among ships."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self._scene, self._seed = scene, seed
        self._rng = np.random.default_rng((4, seed))
        self._frame = LocalFrame(ORIGIN)
        self._targets = Targets.empty(self._frame)
        self._en, self._heading = (0.0, 0.0), math.radians(90.0)
        self._way: NDArray[np.float64] | None = None
        self._planned: list[float] = []
        self._distances: list[float] = []
        self._unsafe = self._none = 0
        self._pace = 1.0 + float(self._rng.normal(0.0, 0.05))

    def sail(self) -> ShipsOutcome:
        """Sail to the goal or to the limit."""
        scene = self._scene
        least, t, arrived = math.inf, 0.0, False
        while t < LIMIT_S and not arrived:
            if t % REPORT_S < STEP_S:
                self._hear(t)
            self._check(t, self._targets.picture(t))
            before = self._en
            self._advance(STEP_S)
            for ship in scene.ships:
                track = np.array([before, self._en]), np.array([ship.at(t), ship.at(t + STEP_S)])
                # The hull as its half diagonal: a little more than the rectangle.
                least = min(least, least_distance_m(*track) - 0.5 * ship.length_m * 1.02 - 1.8)
            t += STEP_S
            arrived = math.dist(self._en, scene.goal_en) < 40.0
        gaps = np.diff(self._planned)
        return ShipsOutcome(
            scene=scene.name,
            seed=self._seed,
            arrived=arrived,
            time_s=t,
            least_m=least,
            plans=len(self._planned),
            shortest_interval_s=float(gaps.min()) if len(gaps) else math.inf,
            path_distances_m=tuple(round(d) for d in self._distances),
            checks_unsafe=self._unsafe,
            no_plan=self._none,
        )

    def _hear(self, t_s: float) -> None:
        for number, ship in enumerate(self._scene.ships):
            x, y = (float(p + self._rng.normal(0.0, 4.0)) for p in ship.at(t_s))
            half = 0.5 * ship.length_m
            self._targets = self._targets.heard(
                AisReport(
                    t_s=t_s,
                    mmsi=211000001 + number,
                    position=self._frame.geo_from_en(x, y),
                    nav_status=0,
                    ship_type=70,
                    course_rad=ship.course_at(t_s) + float(self._rng.normal(0.0, 0.01)),
                    speed_mps=max(0.0, ship.speed_mps + float(self._rng.normal(0.0, 0.05))),
                    heading_rad=ship.course_at(t_s),
                    bow_m=half,
                    stern_m=half,
                    port_m=0.1 * half,
                    starboard_m=0.1 * half,
                )
            )

    def _problem(self, discs: Sequence[Target], part: float | None = None) -> Problem:
        twa, speed = polar_at(self._scene.tws_mps)
        return Problem(
            start_en=self._en,
            start_heading_rad=self._heading,
            goal_en=self._scene.goal_en,
            goal_radius_m=30.0,
            wind=ProblemWind(
                twd_from_rad=math.radians(self._scene.twd_deg),
                tws_mps=self._scene.tws_mps,
                sigma=Sigma(model="ar1", sigma0_rad=0.05, sigma_inf_rad=0.15, rho_hz=0.036),
            ),
            boat=BoatLimits(
                no_go_half_rad=math.radians(47.0),
                turn_rate_radps=0.2,
                polar_twa_rad=twa,
                polar_mps=speed,
                tack_loss_s=7.0,
            ),
            delta_s=DELTA_S,
            targets=tuple(discs),
            vessels_part=part,
        )

    def _discs(self, vessels: Sequence[Vessel], t_s: float, sigmas: float) -> tuple[Target, ...]:
        keep = Keep(
            sigmas=sigmas,
            clearance_m=CLEARANCE_M,
            own_radius_m=1.8,
            own_timing_mps=OWN_TIMING_MPS,
            ahead_m=CLEARANCE_M,
            horizon_s=HORIZON_S,
            settled_m=SETTLED_M,
        )
        return planning_discs(vessels, t_s, keep)

    def _check(self, t_s: float, picture: TrafficPicture) -> None:
        """Check the active plan; plan again where the decision says so."""
        if self._planned and t_s - self._planned[-1] < MIN_INTERVAL_S:
            return
        if self._way is not None:
            legs = evaluate(self._problem(()), np.vstack([np.asarray(self._en), self._way[1:]])).legs
            conflicts = pressing(check_legs(legs, self._discs(picture.vessels, t_s, tail_factor(GIVE_UP_RISK))))
            self._unsafe += bool(conflicts)
            since = t_s - self._planned[-1] if self._planned else math.inf
            if decide(conflicts, since_replan_s=since, urgent_s=0.0) is not Decision.REPLAN:
                return
        answer = self._plan(picture.vessels, t_s)
        self._planned.append(t_s)
        if answer is None:
            self._none += 1
            return
        way = np.array(answer.waypoints_en)
        if self._way is not None:
            old = np.vstack([np.asarray(self._en), self._way[1:]])
            self._distances.append(path_distance_m(self._next(old), self._next(way)))
        self._way = way

    def _plan(self, vessels: Sequence[Vessel], t_s: float) -> Plan | None:
        discs = self._discs(vessels, t_s, 0.0)
        for times in PART_BY_RUNG:
            problem = self._problem(discs, times * VESSELS_SHARE * (1.0 - DELTA_S) if discs else None)
            answer = plan(problem, expansions=EXPANSIONS, seed=self._seed)
            if answer.legs:
                return answer
        return None

    def _next(self, way: NDArray[np.float64]) -> list[tuple[float, float]]:
        """Return the next five minutes of a way."""
        return soon(evaluate(self._problem(()), way).legs, ALIKE_S)

    def _advance(self, seconds: float) -> None:
        """Sail along the plan; without one, hold the heading slowly."""
        twa, speed = polar_at(self._scene.tws_mps)
        left = seconds
        while left > 1e-6:
            if self._way is None or len(self._way) < 2:
                return
            b = self._way[1]
            de, dn = float(b[0]) - self._en[0], float(b[1]) - self._en[1]
            run = math.hypot(de, dn)
            if run < 1e-6:
                self._way = self._way[1:]
                continue
            course = math.atan2(de, dn)
            off = abs(math.remainder(course - math.radians(self._scene.twd_deg), 2.0 * math.pi))
            v = max(0.2, self._pace * float(np.interp(off, twa, speed)))
            gone = min(run, v * left)
            self._en = (self._en[0] + gone * de / run, self._en[1] + gone * dn / run)
            self._heading = course
            left -= gone / v
            if gone >= run - 1e-9:
                self._way = self._way[1:]


def main(argv: list[str] | None = None) -> int:
    """Sail each scene with each seed; a line each."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.tasks.ships",
        description="By plan among ships.",
        epilog="example: python -m lab.tasks.ships --seeds 5",
    )
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    args = parser.parse_args(argv)
    good = True
    for scene in scenes():
        for seed in range(args.seeds):
            o = ShipsVoyage(scene, seed).sail()
            good = good and o.arrived and o.least_m > 5.0 and o.shortest_interval_s >= 20.0
            if args.json:
                sys.stdout.write(json.dumps(asdict(o)) + "\n")
            else:
                sys.stdout.write(
                    f"{o.scene:28s} seed {o.seed}  {'arrived' if o.arrived else 'LOST'} after {o.time_s:.0f} s  "
                    f"nearest hulls {o.least_m:.0f} m  plans {o.plans}, {o.shortest_interval_s:.0f} s apart at least, "
                    f"successive paths {list(o.path_distances_m)} m apart  without a plan {o.no_plan}\n"
                )
            sys.stdout.flush()
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

"""A motorboat by the same guidance, without the no-go zone (Schmitt 2013, section 5.2): marks, a rock, an intruder.

Four marks, the first straight into the wind; a rock stands on the second leg, and an intruder comes at the boat on the
third. The boat is a model with Schmitt's two motors, u1 and u2, or ArduRover's motorboat in GUIDED. The model's numbers
are those of a boat of 1.5 m and 40 kg that makes 2 m/s with both motors at one half, which is what u1 and u2 add up to;
no measured boat stands behind them::

    python -m lab.tasks.motor --seeds 10
    python -m lab.tasks.motor --seeds 3 --autopilot ardurover
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from shapely.geometry import Point, box

from companion.field.guidance import follow_line, go_to, step
from companion.field.values import GuidanceSettings, GuidanceState, MovingObstacle, Situation
from companion.geo.angles import wrap_pi
from companion.geo.frame import LocalFrame
from companion.geofence import LocalArea
from companion.mavlink.autopilot import Autopilot
from lab.tasks.controllers import motor_commands, rudder_for
from lab.tasks.guided import sail_guided, with_boat
from lab.tasks.wrsc2013 import ORIGIN
from sitl.autopilot import Truth
from sitl.world import AR1

STEP_S = 0.05
MARKS = ((0.0, 80.0), (110.0, 80.0), (110.0, 0.0), (0.0, 0.0))
REACHED_M = 5.0
NEAR_M = 40.0  # from here on to the mark itself: a line has no end
ROCK = box(45.0, 70.0, 60.0, 95.0)
KEEP_M = 8.0
INTRUDER_KEEP_M = 15.0
INTRUDER_GAP_M = 90.0
LIMIT_S = 900.0
SLOW = 0.3  # of full thrust, at least
HABITS = GuidanceSettings(
    is_sailing=False,
    polar_mps=(2.0, 2.0),
    turn_rate_radps=math.radians(20.0),
    tack_s=0.0,
    lag_s=2.0,
    horizon_s=60.0,
    repulsive_sigma_m=30.0,
    keep_m=KEEP_M,
)

MASS_KG = 40.0
INERTIA_KGM2 = 12.0
MOTOR_N = 32.0  # each at u = 1
ARM_M = 0.35  # of a motor from the keel
DRAG_KGPM = 8.0  # 2 m/s at 32 N
TURN_DRAG_NMS = 14.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorBoat:
    """Where it is: east, north [m], heading [rad], speed ahead [m/s], turn rate [rad/s] to starboard."""

    en_m: tuple[float, float] = (0.0, 0.0)
    heading_rad: float = 0.0
    speed_mps: float = 0.0
    turn_radps: float = 0.0

    @property
    def velocity_en_mps(self) -> tuple[float, float]:
        """Velocity over ground."""
        return self.speed_mps * math.sin(self.heading_rad), self.speed_mps * math.cos(self.heading_rad)

    def step(self, u1: float, u2: float, seconds: float = STEP_S) -> MotorBoat:
        """Return the boat after a step with the left motor at ``u1`` and the right one at ``u2``, both in [-1, 1]."""
        u1, u2 = max(-1.0, min(1.0, u1)), max(-1.0, min(1.0, u2))
        push = MOTOR_N * (u1 + u2) - DRAG_KGPM * self.speed_mps * abs(self.speed_mps)
        turn = MOTOR_N * ARM_M * (u1 - u2) - TURN_DRAG_NMS * self.turn_radps
        speed = self.speed_mps + seconds * push / MASS_KG
        rate = self.turn_radps + seconds * turn / INERTIA_KGM2
        heading = wrap_pi(self.heading_rad + seconds * rate)
        east = self.en_m[0] + seconds * speed * math.sin(heading)
        north = self.en_m[1] + seconds * speed * math.cos(heading)
        return MotorBoat(en_m=(east, north), heading_rad=heading, speed_mps=speed, turn_radps=rate)

    def steer(self, wanted_rad: float, seconds: float = 1.0) -> MotorBoat:
        """Return the boat after ``seconds`` of steering a heading by the rudder law and u1, u2."""
        boat = self
        for _ in range(round(seconds / STEP_S)):
            boat = boat.step(*motor_commands(rudder_for(boat.heading_rad, wanted_rad)))
        return boat


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorScore:
    """What came of a run; distances [m] of the boat's middle."""

    seed: int
    marks: int
    time_s: float
    rock_m: float
    intruder_m: float
    sailed_upwind: bool

    @property
    def complete(self) -> bool:
        """All marks, nothing touched, and the leg into the wind sailed straight."""
        return self.marks == len(MARKS) and self.rock_m > 3.0 and self.intruder_m > 8.0 and self.sailed_upwind


class MotorPilot:
    """The marks in turn by the guidance; the intruder appears when the third leg begins."""

    def __init__(self, seed: int, speed_mps: float) -> None:
        self._rng = np.random.default_rng((5, 2, seed))
        self._state = GuidanceState()
        self._habits = replace(HABITS, polar_mps=(speed_mps, speed_mps))
        self._area = LocalArea(
            frame=LocalFrame(ORIGIN), names=("rock",), polygons=(ROCK,), own_margins_m=(0.0,), limits=None
        )
        self._intruder: tuple[float, tuple[float, float], tuple[float, float]] | None = None
        self._speed_mps = speed_mps
        self.mark = 0

    def decide(self, seen: Situation) -> tuple[float, float]:
        """Return heading and thrust."""
        if self.mark < len(MARKS) and math.dist(seen.en_m, MARKS[self.mark]) < REACHED_M:
            self.mark += 1
        a, b = MARKS[self.mark - 1], MARKS[min(self.mark, len(MARKS) - 1)]
        if self.mark == 2 and self._intruder is None and seen.en_m[1] < 65.0:
            self._appear(seen)
        if self._intruder is not None:
            noise = self._rng.normal(0.0, 1.0, 2)
            x, y = self.intruder_at(seen.t_s)
            other = MovingObstacle(
                en_m=(x + noise[0], y + noise[1]),
                velocity_en_mps=self._intruder[2],
                keep_m=INTRUDER_KEEP_M,
                growth_mps=0.1,
            )
            seen = replace(seen, obstacles=(other,))
        # Without the wind there is no no-go zone: the boat goes where the field points.
        seen = replace(seen, twd_from_rad=None)
        near = math.dist(seen.en_m, b) < NEAR_M
        intent = replace(go_to(b, 0.0) if near else follow_line(a, b, 20.0), clearance=self._area.clearance_m)
        self._state, setpoint = step(self._state, seen, intent, self._habits)
        # Slower through sharp turns: at full speed the boat would circle a mark that lies inside its turning circle.
        return setpoint.heading_rad, max(SLOW, math.cos(wrap_pi(setpoint.heading_rad - seen.heading_rad)))

    def _appear(self, seen: Situation) -> None:
        """Put the intruder on collision course, from somewhere ahead."""
        bearing = math.pi + float(self._rng.uniform(-1.2, 1.2))
        speed = float(self._rng.uniform(1.0, 3.0))
        x, y = seen.en_m[0] + INTRUDER_GAP_M * math.sin(bearing), seen.en_m[1] + INTRUDER_GAP_M * math.cos(bearing)
        meet_s = INTRUDER_GAP_M / (speed + self._speed_mps)
        aim = seen.en_m[0] + seen.velocity_en_mps[0] * meet_s, seen.en_m[1] + seen.velocity_en_mps[1] * meet_s
        course = math.atan2(aim[0] - x, aim[1] - y)
        self._intruder = seen.t_s, (x, y), (speed * math.sin(course), speed * math.cos(course))

    def intruder_at(self, t_s: float) -> tuple[float, float]:
        """Return where the intruder is; far away before it appears."""
        if self._intruder is None:
            return 1e6, 1e6
        since, (x, y), (vx, vy) = self._intruder
        return x + vx * (t_s - since), y + vy * (t_s - since)


def _score(seed: int, pilot: MotorPilot, rows: Any) -> MotorScore:
    """Score rows of (t, east, north, ...) [s, m]."""
    track = np.asarray(rows, dtype=np.float64)
    first = np.flatnonzero(np.hypot(track[:, 1] - MARKS[0][0], track[:, 2] - MARKS[0][1]) < REACHED_M + 1.0)
    upwind = track[: first[0] + 1] if first.size else track
    return MotorScore(
        seed=seed,
        marks=pilot.mark,
        time_s=float(track[-1, 0] - track[0, 0]),
        rock_m=min(ROCK.distance(Point(e, n)) for e, n in track[:, 1:3]),
        intruder_m=min(math.dist((e, n), pilot.intruder_at(t)) for t, e, n in track[:, :3]),
        sailed_upwind=bool(first.size) and float(np.abs(upwind[:, 1] - upwind[0, 1]).max()) < 15.0,
    )


def run(seed: int) -> MotorScore:
    """Run the model with two motors."""
    rng = np.random.default_rng((5, 2, seed, 1))
    boat, pilot, rows, t = MotorBoat(), MotorPilot(seed, 2.0), [(0.0, 0.0, 0.0)], 0.0
    while pilot.mark < len(MARKS) and t < LIMIT_S:
        noise = rng.normal(0.0, 0.7, 2)
        heading, _ = pilot.decide(
            Situation(
                t_s=t,
                en_m=(boat.en_m[0] + noise[0], boat.en_m[1] + noise[1]),
                velocity_en_mps=boat.velocity_en_mps,
                heading_rad=boat.heading_rad,
                twd_from_rad=None,
            )
        )
        boat = boat.steer(heading)
        t += 1.0
        rows.append((t, *boat.en_m))
    return _score(seed, pilot, rows)


def run_ardurover(seed: int, speedup: float = 8.0) -> MotorScore:
    """Run ArduRover's motorboat in GUIDED, the wind from the first mark."""
    pilot = MotorPilot(seed, 3.0)

    async def job(facade: Autopilot, truth: Callable[[], Truth]) -> Any:
        return await sail_guided(
            facade,
            truth,
            LocalFrame(ORIGIN),
            pilot.decide,
            lambda _: pilot.mark >= len(MARKS),
            LIMIT_S,
            needs_wind=False,
        )

    wind = AR1(0.0, 4.0, seed=seed)
    return _score(seed, pilot, with_boat(wind, seed, 0.0, job, "ardurover", speedup, "motorboat"))


def main(argv: list[str] | None = None) -> int:
    """Run the seeds and print one line each."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.tasks.motor",
        description="A motorboat by field guidance.",
        epilog="example: python -m lab.tasks.motor --seeds 10",
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--autopilot", choices=["model", "ardurover"], default="model")
    parser.add_argument("--speedup", type=float, default=8.0, help="of the real ArduRover (default 8)")
    args = parser.parse_args(argv)
    passed = 0
    for seed in range(args.seeds):
        result = run(seed) if args.autopilot == "model" else run_ardurover(seed, args.speedup)
        passed += result.complete
        row = {k: round(v, 2) if isinstance(v, float) else v for k, v in asdict(result).items()}
        sys.stdout.write(json.dumps({**row, "complete": result.complete}) + "\n")
        sys.stdout.flush()
    sys.stdout.write(f"motorboat ({args.autopilot}): {passed}/{args.seeds}\n")
    return 0 if passed == args.seeds else 1


if __name__ == "__main__":
    sys.exit(main())

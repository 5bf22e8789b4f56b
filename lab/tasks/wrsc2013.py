"""WRSC 2013, avoiding a mobile obstacle, as Schmitt 2013 gives it: scenario, scorer, campaign.

Stay in a square of 200 m. Within 45 minutes an intruder crosses it at constant speed and heading; its position,
heading and speed are broadcast. Never come nearer than 5 m to it, do not leave before it has entered, be out
within 15 minutes of its entry. Four booleans and a least distance.

    python -m lab.tasks.wrsc2013 --runs 500            # by field, by plan and by Schmitt's bare field
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from lab.tasks.wrsc2013_skippers import HALF_M, FieldSkipper, PlanSkipper
from sitl.options import add_options, options_of
from sitl.runner import Experiment, Job
from sitl.world import LENGTH_M, SimulatedVaimos, habits_for, summary, wind_for

APPROACH_M = 5.0
ENTRY_LIMIT_S = 2700.0
LEAVE_WITHIN_S = 900.0
ORIGIN = GeoPoint(lat_deg=48.360, lon_deg=-4.540)  # the roads of Brest
INTRUDER_LENGTH_M = 4.0
METHODS = ("field", "plan", "schmitt")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wrsc2013Course:
    """The draw of one run: the wind and the intruder."""

    seed: int
    twd_from_rad: float
    tws_mps: float
    entry_s: float
    heading_rad: float
    speed_mps: float
    entry_en: tuple[float, float]

    def at(self, t_s: float | NDArray[np.float64]) -> tuple[Any, Any]:
        """Return the intruder's position (east, north) at ``t_s``."""
        d = (t_s - self.entry_s) * self.speed_mps
        return self.entry_en[0] + d * math.sin(self.heading_rad), self.entry_en[1] + d * math.cos(self.heading_rad)

    @property
    def crossing_s(self) -> float:
        """How long it is inside the square [s]."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        ends = [(math.copysign(HALF_M, v) - p) / v for p, v in zip(self.entry_en, (s, c), strict=True) if abs(v) > 1e-9]
        return min(ends) / self.speed_mps


def draw(seed: int) -> Wrsc2013Course:
    """Return the course of a seed: wind from anywhere at 3 to 10 m/s, an intruder from anywhere at 0.5 to 3 m/s.

    It passes through a point drawn in the middle quarter of the square, where a boat that stays must be near.
    """
    rng = np.random.default_rng((2013, seed))
    twd, tws = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(3.0, 10.0))
    heading, speed = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(0.5, 3.0))
    x, y = (float(v) for v in rng.uniform(-0.5 * HALF_M, 0.5 * HALF_M, 2))
    s, c = math.sin(heading), math.cos(heading)
    back = min((p + math.copysign(HALF_M, v)) / v for p, v in ((x, s), (y, c)) if abs(v) > 1e-9)
    return Wrsc2013Course(
        seed=seed,
        twd_from_rad=twd,
        tws_mps=tws,
        entry_s=float(rng.uniform(60.0, ENTRY_LIMIT_S)),
        heading_rad=heading,
        speed_mps=speed,
        entry_en=(x - back * s, y - back * c),
    )


# ------------------------------------------------------------------------------------------- scorer
@dataclass(frozen=True, slots=True, kw_only=True)
class Wrsc2013Score:
    """The task's four booleans and its figures; distances are between hulls' discs [m]."""

    seed: int
    stayed: bool  # in the square until the intruder entered
    left_in_time: bool  # out within 15 minutes of its entry
    kept_clear: bool  # never under 5 m
    crossed: bool  # the intruder did enter within 45 minutes
    least_m: float
    left_after_s: float | None

    @property
    def complete(self) -> bool:
        """Is the task done?"""
        return self.stayed and self.left_in_time and self.kept_clear and self.crossed


def score(track: NDArray[np.float64], intruder: NDArray[np.float64], *, seed: int = 0) -> Wrsc2013Score:
    """Score a run from two tracks on the same times.

    Args:
        track: (n, 3) or wider: t [s], east, north [m] of the boat, the square's centre at the origin.
        intruder: (n, 2) east, north [m] of the intruder at those times.
        seed: for the record.

    """
    t, p = track[:, 0], track[:, 1:3]
    inside_it = np.max(np.abs(intruder), axis=1) <= HALF_M
    entered = int(np.argmax(inside_it)) if inside_it.any() else len(t)
    outside = np.max(np.abs(p), axis=1) > HALF_M
    stayed = not bool(outside[:entered].any())
    left = np.flatnonzero(outside[entered:])
    left_after = float(t[entered + left[0]] - t[entered]) if left.size else None
    least = least_distance_m(p, intruder) - 0.5 * (LENGTH_M + INTRUDER_LENGTH_M)
    return Wrsc2013Score(
        seed=seed,
        stayed=stayed,
        left_in_time=left_after is not None and left_after <= LEAVE_WITHIN_S,
        kept_clear=least >= APPROACH_M,
        crossed=entered < len(t) and float(t[entered]) <= ENTRY_LIMIT_S,
        least_m=least,
        left_after_s=left_after,
    )


def least_distance_m(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the least distance of two tracks (n, 2), taken as straight between samples [m]."""
    d = a - b
    e = np.diff(d, axis=0)
    if len(e) == 0:
        return float(np.min(np.hypot(d[:, 0], d[:, 1]))) if len(d) else math.inf
    share = np.clip(-np.sum(d[:-1] * e, axis=1) / np.maximum(np.sum(e * e, axis=1), 1e-12), 0.0, 1.0)
    near = d[:-1] + share[:, None] * e
    return float(np.min(np.hypot(near[:, 0], near[:, 1])))


# ---------------------------------------------------------------------------------------------- run
def broadcast(course: Wrsc2013Course, t_s: float, rng: np.random.Generator, frame: LocalFrame) -> bytes | None:
    """Return the intruder's datagram of this second, with the noise of its GPS; one in twenty is lost."""
    if rng.random() < 0.05:
        return None
    x, y = course.at(t_s)
    noise = rng.normal(0.0, 0.7, 2)
    point = frame.geo_from_en(float(x) + float(noise[0]), float(y) + float(noise[1]))
    return json.dumps(
        {
            "id": 1,
            "lat": round(point.lat_deg, 7),
            "lon": round(point.lon_deg, 7),
            "heading_deg": round(math.degrees(course.heading_rad), 1),
            "speed_mps": round(course.speed_mps, 2),
            "length_m": INTRUDER_LENGTH_M,
            "name": "INTRUDER",
        }
    ).encode()


@dataclass(slots=True)
class Run:
    """A run's tracks and score."""

    course: Wrsc2013Course
    track: NDArray[np.float64]
    intruder: NDArray[np.float64]
    score: Wrsc2013Score
    irons: int
    plans: int
    last_resort_s: float


def run(seed: int, method: str = "field") -> Run:
    """Sail one seed in the fast closed loop and score it."""
    course = draw(seed)
    rng = np.random.default_rng((2013, seed, 7))
    frame = LocalFrame(ORIGIN)
    boat = SimulatedVaimos.launch(
        wind_for(course.twd_from_rad, course.tws_mps, seed), rng, (0.0, 0.0), course.twd_from_rad + math.pi / 2.0
    )
    skipper = (
        PlanSkipper(habits_for, frame, seed)
        if method == "plan"
        else FieldSkipper(habits_for, frame, look_ahead=method != "schmitt")
    )
    end = course.entry_s + LEAVE_WITHIN_S + 30.0
    done_s: float | None = None
    while boat.t_s < end:
        t = boat.t_s
        datagram = broadcast(course, t, rng, frame)
        heading, thrust = skipper.decide(boat.sense(), datagram)
        boat.sail(heading, thrust)
        x, y = boat.en_m
        ix, iy = course.at(boat.t_s)
        is_out = max(abs(x), abs(y)) > HALF_M and boat.t_s > course.entry_s
        if is_out and done_s is None and math.hypot(x - ix, y - iy) > 30.0:
            done_s = boat.t_s + 60.0  # a minute more, or until the intruder has left: it must stay clear outside
        gone = boat.t_s > course.entry_s + course.crossing_s
        if done_s is not None and boat.t_s > done_s and (gone or math.hypot(x - ix, y - iy) > 80.0):
            break
    track = boat.positions()
    intruder = np.column_stack(course.at(track[:, 0]))
    return Run(
        course=course,
        track=track,
        intruder=intruder,
        score=score(track, intruder, seed=seed),
        irons=skipper.irons,
        plans=skipper.plans,
        last_resort_s=skipper.last_resort_s,
    )


def sail(job: Job[str]) -> dict[str, Any]:
    """Sail a seed by the method of the case; return its score."""
    result = run(job.seed, job.case)
    out = {
        **asdict(result.score),
        "method": job.case,
        "complete": result.score.complete,
        "irons": result.irons,
        "plans": result.plans,
        "last_resort_s": result.last_resort_s,
        "tws_mps": round(result.course.tws_mps, 2),
        "intruder_mps": round(result.course.speed_mps, 2),
    }
    return {k: (round(v, 2) if isinstance(v, float) else v) for k, v in out.items()}


def wrsc2013(seeds: Iterable[int], methods: Iterable[str]) -> Experiment[str]:
    """Return each seed by each method."""
    return Experiment(
        name="wrsc2013",
        sail=sail,
        jobs=[Job(seed=seed, case=method) for method in methods for seed in seeds],
        key=lambda job: {"scenario": "wrsc2013", "method": job.case, "seed": job.seed},
        is_failed=lambda row: not row["complete"],
    )


def table(rows: list[dict[str, Any]], method: str) -> dict[str, Any]:
    """Return the figures of a campaign."""
    n = len(rows)
    return {
        "method": method,
        "runs": n,
        "complete": sum(r["complete"] for r in rows),
        "share_complete": sum(r["complete"] for r in rows) / max(1, n),
        "stayed": sum(r["stayed"] for r in rows),
        "left_in_time": sum(r["left_in_time"] for r in rows),
        "kept_clear": sum(r["kept_clear"] for r in rows),
        "least_m": min((r["least_m"] for r in rows), default=math.inf),
        "failed_seeds": [r["seed"] for r in rows if not r["complete"]],
        "irons": sum(r["irons"] for r in rows),
        "plans": sum(r["plans"] for r in rows),
        "last_resort_s": sum(r["last_resort_s"] for r in rows),
        "quantiles": summary(
            {"least_m": [r["least_m"] for r in rows], "left_after_s": [r["left_after_s"] or math.nan for r in rows]}
        ),
    }


def main(argv: list[str] | None = None) -> int:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.tasks.wrsc2013",
        description=__doc__.split("\n", 1)[0],
        epilog="example: python -m lab.tasks.wrsc2013 --runs 500 --method field",
    )
    parser.add_argument("--runs", type=int, default=50, help="seeds 0..N-1 (default 50)")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--method", choices=[*METHODS, "all"], default="all", help="who steers (default: all)")
    parser.add_argument("--json", type=Path, help="write the tables' figures here")
    parser.add_argument("--rows", type=Path, help="write one JSON line per run here")
    add_options(parser)
    args = parser.parse_args(argv)
    methods = METHODS if args.method == "all" else (args.method,)
    sailed = wrsc2013(range(args.first, args.first + args.runs), methods).results(options_of(args))
    lines, tables = sailed.records, []
    for method in methods:
        rows = [row for row in lines if row["method"] == method]
        t = table(rows, method)
        tables.append(t)
        q = t["quantiles"]
        sys.stdout.write(
            f"{method:8s} {t['complete']}/{t['runs']} complete ({100 * t['share_complete']:.1f} %)  "
            f"stayed {t['stayed']}  left in time {t['left_in_time']}  kept clear {t['kept_clear']}  "
            f"least distance {t['least_m']:.1f} m (5 %: {q['least_m']['p05']:.1f} m)  "
            f"left after {q['left_after_s']['median']:.0f} s median  "
            f"irons {t['irons']}  plans {t['plans']}  last resort {t['last_resort_s']:.0f} s\n"
        )
        if t["failed_seeds"]:
            sys.stdout.write(f"         failed seeds: {t['failed_seeds'][:40]}\n")
        sys.stdout.flush()
    if args.json:
        args.json.write_text(json.dumps(tables, indent=1) + "\n", encoding="utf-8")
    if args.rows:
        args.rows.write_text("".join(json.dumps(r) + "\n" for r in lines), encoding="utf-8")
    return sailed.exit_code(is_good=True)


if __name__ == "__main__":
    sys.exit(main())

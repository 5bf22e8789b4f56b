"""How well a boat is learned whose truth is known: error, coverage of what is promised, and time lost by what is wrong.

    python -m lab.boat_learning --boats 24 --hours 0.5 2 10

Boats are drawn about the guess by which they are learned, each with a vane, compass, leeway and stream of its own, and
sail outings of an hour at most on days of their own. Each row of the table is one thing more that is not as the learner
believes (``DISTURBED``). Speeds are those of a day that was not sailed: that is what a plan is for.

Time lost: a mark lies in each direction of the circle by turns, in open water. Who believes the learned speeds sails
there on the one heading or two that they say are quickest, and is as fast on them as the boat really is.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from companion.boat import BoatLog, Polar, Why
from companion.boat.guess import guessed_polar
from companion.boat.learn import LEAST_STRETCHES, TWA_DEG, TWS_MPS, learn
from companion.boat.log import stretches_of
from lab.simulated_logs import SIZES, Truth, sailed

Floats = NDArray[np.float64]

PRIOR_ERROR = 0.35
ANGLES_DEG = np.array([50.0, 60.0, 75.0, 90.0, 110.0, 130.0, 150.0])
OUTING_H = 1.0
NODE = 3  # of the learner's winds: outings are sailed in it
NO_GO_DEG = 45.0
LEVELS = (0.80, 0.95)
SPREAD = {"scale": 0.3, "shape": 0.1, "lean": 0.04, "day": 0.05}  # logarithms
TOWED_SHARE = 0.33
DISTURBED: dict[str, dict[str, float | int]] = {
    "nothing": {},
    "tide of 0.4 m/s": {"tide_mps": 0.4},
    "waves of 15 %": {"waves": 0.15},
    "vane 5 degrees wider": {"vane_width_deg": 5.0},
    "compass swings by 5 degrees": {"swing_deg": 5.0},
    "velocity 2 s late": {"lag_s": 2},
    "vane tells 10 % more": {"vane_scale": 1.1},
    "vane tells 10 % less": {"vane_scale": 0.9},
    "leeway of 15 degrees": {"leeway_deg": 15.0},
    "log tells 20 % less by half": {"log_step": 0.2},
    "vane sticks for a third": {"stuck_share": 0.33},
    "towed for a third": {"towed_share": TOWED_SHARE},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Marks:
    """Of one boat: errors of the logarithm of the speed at ``ANGLES_DEG`` and what deviation is promised of them.

    ``offsets`` are errors of vane, compass and leeway in promised deviations; ``lost`` and ``lost_before`` are the
    shares of time that plans lose by what is learned, and by what was believed before.
    """

    error: Floats
    promised: Floats
    before: Floats
    offsets: Floats
    lost: float
    lost_before: float


def drawn(rng: np.random.Generator) -> Truth:
    """Return a boat that is not as she was guessed."""
    scale, beat, run, lean = rng.standard_normal(4)
    return Truth(
        scale=math.exp(SPREAD["scale"] * scale),
        beat=math.exp(SPREAD["shape"] * beat),
        run=math.exp(SPREAD["shape"] * run),
        lean=SPREAD["lean"] * lean,
        day_sd=SPREAD["day"],
        leeway_deg=float(rng.choice([0.0, 4.0, 8.0])),
        vane_deg=float(rng.uniform(-10.0, 10.0)),
        compass_deg=float(rng.uniform(-6.0, 6.0)),
        current_en_mps=(0.0, 0.0),
    )


def outings(truth: Truth, hours: float, rng: np.random.Generator) -> list[BoatLog]:
    """Return the logs of so many hours in outings of an hour at most, a day apart, each in a stream of its own."""
    count = max(1, math.ceil(hours / OUTING_H))
    logs = []
    for day in range(count):
        strength, to = float(rng.choice([0.0, 0.2, 0.5])), float(rng.uniform(0.0, 2.0 * math.pi))
        stream = strength * math.sin(to), strength * math.cos(to)
        logs.append(
            sailed(
                replace(truth, current_en_mps=stream),
                hours=hours / count,
                seed=int(rng.integers(2**31)),
                tws_mps=float(TWS_MPS[NODE]),
                t0_s=1.75e9 + 86_400.0 * day,
                name=f"day {day}",
            )
        )
    return logs


def marks_of(seed: int, disturbed: str, hours: float) -> Marks | None:
    """Return how well boat ``seed`` is learned from so many hours; None: she hardly sails, and nothing is."""
    rng = np.random.default_rng([seed, 38])
    truth = replace(drawn(rng), **DISTURBED[disturbed])  # type: ignore[arg-type]
    prior, wind = guessed_polar(SIZES), float(TWS_MPS[NODE])
    # Speeds are told in the wind of the boat's own vane.
    real_wind = wind / truth.vane_scale
    stretches = stretches_of(outings(truth, hours, rng), prior, PRIOR_ERROR)
    if len(stretches) < LEAST_STRETCHES:
        return None
    boat = learn(stretches, prior, PRIOR_ERROR)
    day = truth.day_sd * rng.standard_normal()
    even = replace(truth, lean=0.0)
    true = np.array([even.speed_mps(prior, math.radians(a), real_wind) for a in ANGLES_DEG])
    told = boat.polar.speeds_mps(np.radians(ANGLES_DEG), wind)
    offsets = [
        (math.degrees(known.mean) - at) / math.degrees(known.sd)
        for known, at in (
            (boat.vane, truth.vane_deg),
            (boat.compass, truth.compass_deg),
            (boat.leeway, truth.leeway_deg),
        )
    ]
    return Marks(
        error=np.log(told / true) - day,
        promised=np.interp(ANGLES_DEG, TWA_DEG, boat.error[:, NODE]),
        before=np.log(prior.speeds_mps(np.radians(ANGLES_DEG), wind) / true) - day,
        offsets=np.array(offsets),
        lost=time_lost(boat.polar, even, prior, wind, real_wind),
        lost_before=time_lost(prior, even, prior, wind, real_wind),
    )


def time_lost(believed: Polar, truth: Truth, prior: Polar, wind_mps: float, real_wind_mps: float) -> float:
    """Return the share of time that is lost, in the mean over all directions, by steering as ``believed`` says."""
    headings = np.radians(np.arange(NO_GO_DEG, 360.0 - NO_GO_DEG + 0.1, 2.5))
    off = np.abs((headings + math.pi) % (2.0 * math.pi) - math.pi)
    units = np.column_stack([np.sin(headings), np.cos(headings)])
    thought = believed.speeds_mps(off, wind_mps)[:, None] * units
    real = np.array([truth.speed_mps(prior, float(a), real_wind_mps) for a in off])[:, None] * units
    wanted = np.radians(np.arange(0.0, 181.0, 7.5))
    lost = []
    for to in wanted:
        course = np.array([math.sin(to), math.cos(to)])
        best = _time(real, *_quickest(real, course), course)
        lost.append(_time(real, *_quickest(thought, course), course) / best - 1.0)
    return float(np.mean(lost))


def _quickest(velocity: Floats, course: Floats) -> tuple[int, int]:
    """Return the two headings by which a course is sailed soonest: the chord of the polar that reaches farthest."""
    across = velocity @ np.array([course[1], -course[0]])
    along = velocity @ course
    left, right = np.flatnonzero(across <= 0.0), np.flatnonzero(across >= 0.0)
    a, b = across[left][:, None], across[right][None, :]
    width = np.maximum(b - a, 1e-12)
    reach = (along[left][:, None] * b - along[right][None, :] * a) / width
    on_it = (b - a) < 1e-9
    reach = np.where(on_it, along[left][:, None], reach)
    i, j = np.unravel_index(int(np.argmax(reach)), reach.shape)
    return int(left[i]), int(right[j])


def _time(velocity: Floats, i: int, j: int, course: Floats) -> float:
    """Return the time for 1 m on a course, sailed on two headings (which may be the same)."""
    if i == j:
        return 1.0 / max(float(velocity[i] @ course), 1e-6)
    shares = np.linalg.lstsq(np.column_stack([velocity[i], velocity[j]]), course, rcond=None)[0]
    return float(np.sum(np.maximum(shares, 0.0)))


def tows_told(seed: int, share: float, hours: float) -> tuple[int, int, int]:
    """Return of boat ``seed``, towed for the last ``share`` of each outing, how many stretches are taken for driven.

    And how many are not: of those that were towed, and of those that were sailed.
    """
    rng = np.random.default_rng([seed, 38])
    logs = outings(replace(drawn(rng), towed_share=share), hours, rng)
    found = stretches_of(logs, guessed_polar(SIZES), PRIOR_ERROR)
    begins = {log.name: (1.0 - share) * (log.t_s[-1] - log.t_s[0]) + log.t_s[0] for log in logs}
    towed = np.array([t > begins[found.outing_names[o]] for t, o in zip(found.t_s, found.outing, strict=True)])
    return found.left_out[Why.DRIVEN], int(np.sum(towed)), int(np.sum(~towed))


def inside(marks: Sequence[Marks], level: float) -> float:
    """Return the share of speeds that are within the band of this level."""
    z = np.concatenate([m.error / m.promised for m in marks])
    return float(np.mean(np.abs(z) < NormalDist().inv_cdf(0.5 + 0.5 * level)))


def _row(name: str, hours: float, marks: Sequence[Marks]) -> str:
    rms = math.sqrt(float(np.mean([m.error**2 for m in marks])))
    before = math.sqrt(float(np.mean([m.before**2 for m in marks])))
    offsets = float(np.mean(np.abs([m.offsets for m in marks]) < 1.96))
    lost, lost_before = (100.0 * np.array([getattr(m, n) for m in marks]) for n in ("lost", "lost_before"))
    return (
        f"{name:<28}{hours:>6g}{100 * before:>9.1f}{100 * rms:>9.1f}"
        + "".join(f"{100 * inside(marks, level):>8.1f}" for level in LEVELS)
        + f"{100 * offsets:>9.1f}{lost_before.mean():>9.2f}{lost.mean():>8.2f}{(lost - lost_before).max():>8.2f}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Learn the boats and print the table."""
    parser = argparse.ArgumentParser(prog="python -m lab.boat_learning", description="How well boats are learned.")
    parser.add_argument("--boats", type=int, default=24, metavar="N", help="of each row (default: 24)")
    parser.add_argument("--hours", type=float, nargs="+", default=[0.5, 2.0], metavar="H", help="(default: 0.5 2)")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="of the boats (default: 0)")
    parser.add_argument(
        "--tows", action="store_true", help="how many stretches are taken for a tow, of boats with and without"
    )
    parser.add_argument("--only", choices=DISTURBED, metavar="ROW", help="one row, by its name")
    parser.add_argument("--workers", type=int, default=1, metavar="W", help="processes (default: 1)")
    args = parser.parse_args(arguments)
    say, seeds = sys.stdout.write, range(args.first, args.first + args.boats)
    if args.tows:
        with ProcessPoolExecutor(args.workers) as pool:
            for share in (0.0, TOWED_SHARE):
                for hours in args.hours:
                    told = np.array(list(pool.map(partial(tows_told, share=share, hours=hours), seeds)))
                    driven, towed, sailed_ = told.sum(axis=0).tolist()
                    any_told = int(np.sum(told[:, 0] > 0))
                    say(
                        f"towed for {share:.2f}, {hours:g} h: {driven} stretches taken for driven, of {any_told} of "
                        f"{args.boats} boats; {towed} towed ones are kept, {sailed_} sailed ones\n"
                    )
        return 0
    say(
        f"{'not as believed':<28}{'hours':>6}{'guessed':>9}{'learned':>9}{'in 80':>8}{'in 95':>8}{'offsets':>9}"
        f"{'guessed':>9}{'learned':>8}{'worst':>8}\n"
        f"{'':<34}{'rms error of speed %':>18}{'of speeds %':>16}{'in 95 %':>9}{'time lost by plans %':>25}\n"
    )
    with ProcessPoolExecutor(args.workers) as pool:
        for name in DISTURBED if args.only is None else [args.only]:
            for hours in args.hours:
                found = list(pool.map(partial(marks_of, disturbed=name, hours=hours), seeds))
                marks = [m for m in found if m is not None]
                absent = len(found) - len(marks)
                say(_row(name, hours, marks) + (f"   {absent} not learned" if absent else "") + "\n")
                sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())

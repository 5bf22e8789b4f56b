"""When a plan arrives in winds whose strength and direction spread: quantiles, by sailing it in many of them.

Less wind costs more than as much more wind gains, and no speed is below none: so the spread of the time is not
symmetric, and its median is later than the plan's own time. The plan is sailed on paper in ``WINDS`` drawn winds.
Strength and direction are independent Gauss-Markov processes of the problem's own spreads. In each, a leg's progress at
an instant is its planned one times the ratio of its speeds in that wind and in the plan's; where the wind has closed a
leg it beats along it. Turns take their time in any wind, and a tack that fails takes ``FAILED_S`` more. A boat whose
speeds may all be off together takes a drawn factor longer, and one that is seen to make a share of them as much. What
each speed may be off by beside that is drawn alike at like angles.

Where a step is long against the correlation time, the mean over a step has less spread than an instant: the
remainder is averaged over within the step.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from companion.boat.boat import SHAPE_TWA_RAD
from companion.boat.failed_tack import IRONS_S
from companion.kernels.jit import kernel
from companion.planner.plan import Arrival, Leg
from companion.planner.problem.evaluate import beat_s
from companion.planner.problem.parts import Speeds, Strength
from companion.planner.problem.value import Problem

WINDS = 200
SEED = 15
STEPS_OF_PLAN, LONGEST = 50, 5  # steps in the plan's own time; a wind in which it takes longer does not get there
QUANTILES = (0.1, 0.5, 0.9)
NODES_MPS, NODES_RAD, NODES_TWA = 33, 17, 361  # of the tables of progress: winds, their turns, angles to them
REACH = 3.5  # standard deviations that they reach to
FAILED_S = IRONS_S + 4.0  # head to wind, and until the boat has way on again
MOST_FAILURES = 20
SHAPE_REACH_DEG, SHAPE_STEP_DEG = 35.0, 5.0  # over which speeds are off alike, as they are learned
FASTER = 0.5  # of how much slower than its polar a boat may be: how much faster

Floats = NDArray[np.float64]


def arrival(problem: Problem, legs: Sequence[Leg]) -> Arrival | None:
    """Return when a path arrives, None: the problem says nothing of the wind's strength."""
    strength = problem.wind.strength
    if strength is None or not legs or not math.isfinite(legs[-1].end_s):
        return None
    speeds, doubts = _speeds(problem, strength)
    times = _times_s(problem, legs, strength, speeds)
    early, median, late = (_quantile(times, q) for q in QUANTILES)
    until_s = late if math.isfinite(late) else LONGEST * legs[-1].end_s
    boat = problem.boat
    return Arrival(
        early_s=early,
        median_s=median,
        late_s=late,
        doubts=doubts,
        over_max=None if boat.max_tws_mps is None else strength.over(boat.max_tws_mps, until_s),
        under_min=None if boat.min_tws_mps is None else strength.under(boat.min_tws_mps, until_s),
    )


def _speeds(problem: Problem, strength: Strength) -> tuple[Speeds, tuple[str, ...]]:
    """Return the boat's speeds in every wind, and what is not known."""
    doubts = [] if strength.is_known else ["the spread of the wind's strength is assumed"]
    speeds, boat = problem.boat.speeds, problem.boat
    if speeds is None:
        tws = problem.wind.tws_mps or float(strength.mean_at(0.0))
        doubts.append("her speed is taken to go with the wind's")
        zero = (0.0,) * len(boat.polar_mps)
        speeds = Speeds(
            tws_mps=(0.0, tws, 2.0 * tws),
            twa_rad=boat.polar_twa_rad,
            v_mps=(zero, boat.polar_mps, tuple(2.0 * v for v in boat.polar_mps)),
        )
    elif float(min(strength.mean_mps)) - 2.0 * float(max(strength.sigma_mps)) < speeds.lowest_mps:
        doubts.append(
            f"her polar begins at {speeds.lowest_mps:.1f} m/s: in less wind she is taken to be slower than "
            "in proportion to it"
        )
    return speeds, tuple(doubts)


@functools.lru_cache(maxsize=1)
def draws() -> Floats:
    """Return the draws (3, steps, winds): one set, so that a plan's quantiles are a function of the plan."""
    return np.random.default_rng(SEED).standard_normal((3, LONGEST * STEPS_OF_PLAN, WINDS))


@dataclass(frozen=True, slots=True)
class _Averaged:
    """A Gauss-Markov process by its means over steps: their share of the variance, and from step to step."""

    share: float  # of the variance of an instant
    keep: float  # of a step's mean in the next

    @classmethod
    def of(cls, step_s: float, correlation_s: float) -> _Averaged:
        a = step_s / correlation_s
        decay = math.exp(-a)
        share = 2.0 * (a - 1.0 + decay) / (a * a) if a > 1e-3 else 1.0 - a / 3.0
        keep = ((1.0 - decay) / a) ** 2 / share if a > 1e-3 else 1.0 - a
        return cls(share=min(share, 1.0), keep=min(keep, 1.0))

    def drawn(self, noise: Floats) -> Floats:
        """Return unit processes (steps, winds) of independent draws."""
        return np.asarray(_drawn(noise, self.keep, math.sqrt(max(0.0, 1.0 - self.keep * self.keep))))


@kernel
def _drawn(noise: Floats, keep: float, fresh: float) -> Floats:
    """Return x' = keep x + fresh noise, column by column, from the noise's first row on."""
    out = np.empty_like(noise)
    for j in range(noise.shape[1]):
        x = noise[0, j]
        out[0, j] = x
        for i in range(1, noise.shape[0]):
            x = keep * x + fresh * noise[i, j]
            out[i, j] = x
    return out


@kernel
def _sailed(
    edges: Floats, table: Floats, at_wind: NDArray[np.int64], at_turn: NDArray[np.int64], step_s: float
) -> Floats:
    """Return how long the path takes in each wind [s], inf where the steps end before it does.

    ``edges`` are the ends of turns and legs in the plan's time, ``table`` how fast each goes in a wind and a turn of
    it, and ``at_wind`` and ``at_turn`` (steps, winds) the places in it.
    """
    steps, winds = at_wind.shape
    times = np.full(winds, np.inf)
    for j in range(winds):
        done, part = 0.0, 0
        for i in range(steps):
            while part < edges.shape[0] - 1 and edges[part] <= done:
                part += 1
            made = step_s * table[part, at_wind[i, j], at_turn[i, j]]
            left = edges[-1] - done
            if made >= left:
                times[j] = (i + left / max(made, 1e-12)) * step_s
                break
            done = done + made
    return times


def _times_s(problem: Problem, legs: Sequence[Leg], strength: Strength, speeds: Speeds) -> Floats:
    """Return how long the path takes in each drawn wind [s]; inf: it does not get there."""
    step_s = legs[-1].end_s / STEPS_OF_PLAN
    noise = draws()
    clock = (np.arange(noise.shape[1]) + 0.5) * step_s
    mean, sigma = strength.mean_at(clock), strength.sigma_at(clock)
    turned = np.minimum([problem.wind.sigma.at(float(t)) for t in clock], 0.5)
    of_strength = _Averaged.of(step_s, strength.correlation_s)
    root = math.sqrt(of_strength.share)
    wind = np.maximum(mean[:, None] + root * sigma[:, None] * of_strength.drawn(noise[0]), 0.0)
    turn = root * turned[:, None] * of_strength.drawn(noise[1])
    most = max(float(np.max(sigma)), 1e-3)
    winds = np.linspace(max(0.0, float(np.min(mean)) - REACH * most), float(np.max(mean)) + REACH * most, NODES_MPS)
    turns = np.linspace(-REACH, REACH, NODES_RAD) * max(float(np.max(turned)), 1e-6)
    rest = math.sqrt(1.0 - of_strength.share)
    table = _progress(problem, legs, speeds, winds, turns)
    table = _smear(winds, rest * most) @ table @ _smear(turns, rest * float(np.max(turned))).T
    at_wind = np.clip(np.rint((wind - winds[0]) / max(winds[1] - winds[0], 1e-9)), 0, NODES_MPS - 1).astype(np.int64)
    at_turn = np.clip(np.rint((turn - turns[0]) / (turns[1] - turns[0])), 0, NODES_RAD - 1).astype(np.int64)
    edges = np.array([t for leg in legs for t in (leg.start_s, leg.end_s)])
    times = np.asarray(_sailed(edges, np.ascontiguousarray(table), at_wind, at_turn, step_s))
    slower = _slower(problem.boat.speed_error) * _otherwise(problem, legs) / problem.boat.speed_share
    return (times + _lost_s(problem, legs, noise[2])) * slower


@functools.lru_cache(maxsize=4)
def _slower(speed_error: float) -> Floats:
    """Return how much longer a boat whose speeds are all off by one factor takes in each wind: its even quantiles.

    What a polar leaves out (waves, growth, a slow crew) takes speed: a boat is faster than it by half as much.
    """
    ranks = (np.random.default_rng(SEED).permutation(WINDS) + 0.5) / WINDS
    z = np.array([NormalDist().inv_cdf(float(p)) for p in ranks])
    return np.exp(speed_error * np.where(z > 0.0, z, FASTER * z))


def _otherwise(problem: Problem, legs: Sequence[Leg]) -> Floats | float:
    """Return how much longer a boat takes whose speeds are off by another factor at another angle, in each wind.

    What is off at one angle is nearly as much at the next, and something else a right angle away: a path of many angles
    has less of it than one long leg. Each leg weighs by its time.
    """
    errors = problem.boat.shape_error
    if not any(errors):
        return 1.0
    half = problem.boat.no_go_half_rad
    twa = np.array([half if leg.is_beat else max(abs(leg.twa_rad), half) for leg in legs])
    share = np.array([leg.end_s - leg.start_s for leg in legs])
    deviation = np.interp(twa, SHAPE_TWA_RAD, errors)
    off = np.exp(deviation[:, None] * _shapes(tuple(np.round(np.degrees(twa)).astype(int).tolist())))
    return np.asarray(share @ off / share.sum())


@functools.lru_cache(maxsize=16)
def _shapes(twa_deg: tuple[int, ...]) -> Floats:
    """Return what speeds at these angles are off by (angles, winds), of unit deviation, alike at like angles."""
    nodes = np.arange(0.0, 181.0, SHAPE_STEP_DEG)
    apart = (nodes[:, None] - nodes) / SHAPE_REACH_DEG
    root = np.linalg.cholesky(np.exp(-0.5 * apart**2) + 1e-6 * np.eye(nodes.shape[0]))
    fields = root @ np.random.default_rng(SEED + 1).standard_normal((nodes.shape[0], WINDS))
    at = np.clip(np.rint(np.array(twa_deg) / SHAPE_STEP_DEG).astype(np.int64), 0, nodes.shape[0] - 1)
    drawn = fields[at]
    return np.asarray((drawn - drawn.mean(axis=1, keepdims=True)) / drawn.std(axis=1, keepdims=True))


def _progress(problem: Problem, legs: Sequence[Leg], speeds: Speeds, winds: Floats, turns: Floats) -> Floats:
    """Return (2 legs, winds, turns): how fast the turn before each leg, and the leg, go against the plan."""
    half = problem.boat.no_go_half_rad
    tws = problem.wind.tws_mps or float(np.mean(winds))
    drift = problem.current.drift_mps
    angles = np.linspace(0.0, math.pi, NODES_TWA)
    made = _made_good(speeds, angles[None, :], np.append(winds, tws)[:, None], half)
    out = np.ones((2 * len(legs), len(winds), len(turns)))
    for n, leg in enumerate(legs):
        off = np.abs(leg.twa_rad + turns) / math.pi * (NODES_TWA - 1)
        now = made[:-1, np.minimum(np.rint(off), NODES_TWA - 1).astype(np.int64)]
        planned = float(made[-1, round(abs(leg.twa_rad) / math.pi * (NODES_TWA - 1))])
        if drift > 0.0:
            course = math.atan2(leg.to_en[0] - leg.from_en[0], leg.to_en[1] - leg.from_en[1])
            along = drift * math.cos(problem.current.set_rad - course)
            share = 1.0 if leg.is_beat else math.cos(leg.heading_rad - course)
            now, planned = share * now + along, share * planned + along
        out[2 * n + 1] = np.maximum(now, 0.0) / max(planned, 1e-3)
    return out


def _made_good(speeds: Speeds, off_rad: Floats, tws_mps: Floats, half_rad: float) -> Floats:
    """Return the speed along a leg: sailed, or beaten at the zone's edge where it lies inside."""
    inside = off_rad < half_rad
    speed = speeds.at(np.where(inside, half_rad, np.minimum(off_rad, math.pi)), tws_mps)
    return np.asarray(np.where(inside, speed * math.cos(half_rad) / np.cos(np.minimum(off_rad, half_rad)), speed))


def _smear(nodes: Floats, sigma: float) -> Floats:
    """Return weights (n, n) of the mean about each node over a Gaussian of that spread."""
    if sigma < 0.25 * (nodes[1] - nodes[0]):
        return np.eye(len(nodes))
    weights = np.exp(-0.5 * ((nodes[None, :] - nodes[:, None]) / sigma) ** 2)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _lost_s(problem: Problem, legs: Sequence[Leg], noise: Floats) -> Floats | float:
    """Return what tacks that fail cost in each wind [s]."""
    chance = problem.boat.tack_fails
    if chance == 0.0:
        return 0.0
    tacks = float(sum(leg.manoeuvre == "tack" for leg in legs))
    if problem.beat is not None:
        tacks += sum(
            beat_s(problem, problem.beat, leg.to_en[0] - leg.from_en[0], leg.to_en[1] - leg.from_en[1])[1]
            for leg in legs
            if leg.is_beat
        )
    # of so many tacks, each tried until it comes off: a number with this mean and variance, drawn as a normal
    mean = tacks * chance / (1.0 - chance)
    failures = np.clip(mean + math.sqrt(mean / (1.0 - chance)) * noise[0], 0.0, MOST_FAILURES * max(tacks, 1.0))
    return np.asarray(FAILED_S * failures)


def _quantile(times_s: Floats, p: float) -> float:
    ranked = np.sort(times_s)
    return float(ranked[min(math.ceil(p * len(ranked)) - 1, len(ranked) - 1)])


def in_words(found: Arrival, cost_s: float, *, is_boat_sure: bool = True) -> str:
    """Return when a plan arrives, for a person; ``is_boat_sure``: its speeds are taken to be as they stand."""

    def by(t_s: float) -> str:
        return f"{t_s:.0f} s" if math.isfinite(t_s) else f"later than {LONGEST * cost_s:.0f} s"

    where, case = ("In the wind's spread", "wind") if is_boat_sure else ("As wind and boat may be,", "case")
    text = (
        f"{where} it arrives after {by(found.median_s)} (median), {by(found.early_s)} in one {case} of ten, "
        f"{by(found.late_s)} at the latest in nine of ten."
    )
    return text + "".join(f" {doubt[0].upper()}{doubt[1:]}." for doubt in found.doubts)


def limits_in_words(problem: Problem, found: Arrival) -> str:
    """Return which of the boat's limits of wind the plan breaks, and by what chance; empty: none."""
    allowed, boat = 1.0 - problem.delta_s, problem.boat
    broken = [
        f"{name} than {limit:g} m/s with {100.0 * chance:.0f} %"
        for name, limit, chance in (
            ("more wind", boat.max_tws_mps, found.over_max),
            ("less wind", boat.min_tws_mps, found.under_min),
        )
        if limit is not None and chance is not None and chance > allowed
    ]
    return f"{' and '.join(broken)} at the worst instant of it; {100.0 * allowed:.0f} % is allowed" if broken else ""

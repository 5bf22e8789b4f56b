"""How likely the wind is to force a plan into the no-go zone, over its whole length.

Assumed: the true wind direction is the forecast mean plus a Gaussian Markov process X(t) whose standard deviation
is the problem's own sigma(t). Its correlation follows from the model of sigma:

- ``kalman``: a random walk, as the open-loop filter itself assumes (cov(s, t) = sigma(min)^2);
- ``ar1``: an Ornstein-Uhlenbeck process of rate rho, the continuous AR(1) of Wolsieffer's eq. 17;
- ``forecast``: sigma from the table (from its half widths where those are given, which carry the heavy tails),
  times a stationary process of correlation exp(-d / tau), tau = ``problem.risk.correlation_time_s`` or 60 s.

Steps are not independent: a wind that is 2 sigma off now is 2 sigma off a second later. Multiplying per-step
probabilities would call every long path hopeless; bounding each instant (eq. 13) says nothing of the whole. What
is computed is the first-passage probability: that on some leg, at some instant, |TWA| falls below the boat's own
no-go half angle. Passing through the wind in a tack does not count; X runs on while the boat turns.

``PathRisk.total`` comes from the density of the winds still free, moved through time on a grid, absorbed in the
zone, with Chernoff's correction for what happens between steps, times ``PROMISE_FACTOR``; it is the promise that
`python -m bench.reliability` checks against simulated winds. ``kernels.leg_risk`` is the union bound over entries and
up-crossings, which the reference RRT* adds up edge by edge.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.messages import Spread, Target
from companion.planner.effort import Effort, Outcome, Search
from companion.planner.plan import Leg, Plan, PlanStatus, Why
from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.sigma import AR1, NONE, TABLE
from companion.planner.problem.value import LEAST_PART, Problem, sigmas_for, uncertain, vessel_count
from companion.planner.risk import kernels
from companion.planner.risk.tacks import TackAtRisk, tack_risks, tacks_at_risk

# A path's risk from uncertain vessels: how often it is expected to enter the disc of hulls and clearance of any.
#
# Over a whole path a vessel's error is one draw, not one at each instant: a ship that is late is late all the way. The
# risk is the expected number of entries into its disc of hulls and clearance, first inside or later (Rice's formula,
# ``kernels.entry_rate``), which bounds the probability of any. Vessels and wind add up, by the union bound again.

VESSELS_PROMISE_FACTOR = 1.15
"""What is promised over what is computed: simulated futures scatter, and bends of a predicted track are chords."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VesselRisk:
    """What vessels add to a path's risk: ``computed`` is the expected entries, ``total`` what is promised.

    ``worst_instant`` bounds the probability to be too near to any vessel at the worst instant; ``by_name`` has the
    promise of each vessel, ``legs`` of each leg.
    """

    computed: float = 0.0
    total: float = 0.0
    worst_instant: float = 0.0
    by_name: tuple[tuple[str, float], ...] = ()
    legs: tuple[float, ...] = ()


def vessel_risk(problem: Problem, legs: Sequence[Leg]) -> VesselRisk:
    """Return what the problem's uncertain vessels add to the risk of a path."""
    found = uncertain(problem.targets)
    if not found or not legs:
        return VesselRisk(legs=(0.0,) * len(legs))
    by_leg = np.zeros(len(legs))
    by_name: dict[str, float] = {}
    worst: dict[int, float] = {}
    for vessel in sorted({spread.vessel for _, spread in found}):
        windows = sorted(((t, s) for t, s in found if s.vessel == vessel), key=lambda w: w[0].from_s)
        entries, worst[vessel] = _walk(legs, windows, problem.beat.corridor_m if problem.beat is not None else 0.0)
        by_leg += entries
        name = windows[0][0].name or f"vessel {vessel}"
        by_name[name] = min(1.0, by_name.get(name, 0.0) + VESSELS_PROMISE_FACTOR * float(entries.sum()))
    computed = float(min(1.0, by_leg.sum()))
    total = min(1.0, VESSELS_PROMISE_FACTOR * computed)
    by_leg *= total / float(by_leg.sum()) if computed > 0.0 else 0.0
    return VesselRisk(
        computed=computed,
        total=total,
        worst_instant=min(1.0, sum(worst.values())),
        by_name=tuple(sorted(by_name.items(), key=lambda n: -n[1])),
        legs=tuple(float(x) for x in by_leg),
    )


def _walk(
    legs: Sequence[Leg], windows: Sequence[tuple[Target, Spread]], wide_m: float
) -> tuple[NDArray[np.float64], float]:
    """Return the expected entries on each leg, and the largest P(inside) of any instant, for one vessel.

    On a leg that the autopilot beats the boat may be ``wide_m`` off the line.
    """
    entries, worst, before, t = np.zeros(len(legs)), 0.0, -1.0, 0.0
    out = np.empty(3)
    for i, leg in enumerate(legs):
        span = leg.end_s - leg.start_s
        if not math.isfinite(span):
            break
        east, north = leg.to_en[0] - leg.from_en[0], leg.to_en[1] - leg.from_en[1]
        length = math.hypot(east, north)
        along = (east / length, north / length) if length > 1e-9 else (0.0, 1.0)
        way = (east / span, north / span) if span > 1e-9 else (0.0, 0.0)
        # The turn before the leg is made on the spot.
        for begin, end, velocity in ((t, leg.start_s, (0.0, 0.0)), (leg.start_s, leg.end_s, way)):
            for target, spread in windows:
                lo, hi = max(begin, target.from_s), min(end, target.until_s)
                if hi <= lo:
                    continue
                bx = leg.from_en[0] + velocity[0] * (lo - begin) - spread.x_m - target.vx_mps * lo
                by = leg.from_en[1] + velocity[1] * (lo - begin) - spread.y_m - target.vy_mps * lo
                kernels.piece(
                    lo,
                    hi,
                    bx,
                    by,
                    velocity[0] - target.vx_mps,
                    velocity[1] - target.vy_mps,
                    _errors(spread, along),
                    spread.keep_m + (wide_m if leg.is_beat else 0.0),
                    before,
                    out,
                )
                entries[i] += out[0]
                before, worst = float(out[1]), max(worst, float(out[2]))
        t = leg.end_s
    return entries, worst


def _errors(spread: Spread, along: tuple[float, float]) -> NDArray[np.float64]:
    s, c = math.sin(spread.course_rad), math.cos(spread.course_rad)
    return np.array(
        [
            [s, c, spread.along_m, spread.along_mps],
            [c, -s, spread.across_m, spread.across_mps],
            [along[0], along[1], 0.0, spread.own_mps],
        ]
    )


PROMISE_FACTOR = 1.15
"""What is promised over what is computed: a simulation of 2,000 winds scatters by a tenth at a share of 5 %."""
DEFAULT_CORRELATION_S = 60.0
RISK_ROUNDS = 8  # parts that the bisection under a limit divides its effort into
RISK_TURNS = 16
MOST_EXTRA_SIGMAS = 8.0
EXTRA_RESOLUTION = 0.02  # of the bisection [standard deviations]


class WindProcess(NamedTuple):
    """The wind's deviation from its mean, as ``kernels`` describe it [rad, s]."""

    model: int
    s0: float = 0.0
    s1: float = 0.0
    rho: float = 0.0
    tau: float = DEFAULT_CORRELATION_S
    table_t: NDArray[np.float64] = np.zeros(1)
    table_s: NDArray[np.float64] = np.zeros(1)

    @property
    def correlation_time_s(self) -> float:
        """Time over which the correlation falls to 1/e [s]; infinite for a random walk."""
        if self.model == TABLE:
            return self.tau
        return 1.0 / self.rho if self.model == AR1 and self.rho > 0.0 else math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class LegRisk:
    """One leg: the chance that it is the first to be forced into the zone, and the worst of its instants."""

    first_entry: float
    worst_instant: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PathRisk:
    """The risk of a path: of the wind, and of the vessels that the problem calls uncertain.

    Attributes:
        legs: For each leg; the wind's.
        computed: First-passage probability of the whole path, by the wind.
        wind: What is promised of the wind: ``computed`` times ``PROMISE_FACTOR``, at most 1.
        vessels: What vessels add (``companion.planner.risk.chance_constraint``).
        tacks: Those that may fail onto something (``companion.planner.risk.tacks``).
        total: What is promised: wind, vessels and tacks together by the union bound, at most 1.
        correlation_time_s: Of the wind [s].
    """

    legs: tuple[LegRisk, ...]
    computed: float
    wind: float
    vessels: VesselRisk
    tacks: tuple[TackAtRisk, ...]
    total: float
    correlation_time_s: float

    @property
    def of_tacks(self) -> float:
        """What tacks that fail add, at most 1."""
        return min(1.0, sum(tack.risk for tack in self.tacks))


def process_of(problem: Problem) -> WindProcess:
    """Return the wind process that the problem's sigma implies."""
    s = problem.wind.sigma
    if s.model == "forecast":
        tau = problem.risk.correlation_time_s if problem.risk is not None else DEFAULT_CORRELATION_S
        sigma = np.array(s.sigma_rad, dtype=np.float64)
        if s.half_width_rad is not None and problem.k_delta > 1e-6:
            sigma = np.maximum(sigma, np.array(s.half_width_rad) / problem.k_delta)
        return WindProcess(TABLE, tau=tau, table_t=np.array(s.horizon_s, dtype=np.float64), table_s=sigma)
    return WindProcess(s.number, s.sigma0_rad, s.later, s.rho_hz)


def path_risk(problem: Problem, plan: Plan | Sequence[Leg]) -> PathRisk:
    """Return the risk of a plan (or of its legs) under the problem's wind."""
    legs = plan.legs if isinstance(plan, Plan) else tuple(plan)
    process = process_of(problem)
    half = problem.boat.no_go_half_rad
    start = np.array([leg.start_s for leg in legs], dtype=np.float64)
    end = np.array([leg.end_s for leg in legs], dtype=np.float64)
    twa = _angles(legs)
    first = np.zeros(len(legs))
    if legs and process.model != NONE:
        _first_passage((start, end), twa, half, process, first)
    out = []
    for i, leg in enumerate(legs):
        worst = max(
            _instant(
                abs(twa[i]) - half,
                kernels.sigma_at(
                    t, process.model, process.s0, process.s1, process.rho, process.table_t, process.table_s
                ),
            )
            for t in (leg.start_s, leg.end_s, *(h for h in process.table_t if leg.start_s < h < leg.end_s))
        )
        out.append(LegRisk(first_entry=float(first[i]), worst_instant=worst))
    computed = float(min(1.0, first.sum()))
    wind, vessels = min(1.0, PROMISE_FACTOR * computed), vessel_risk(problem, legs)
    tacks = tacks_at_risk(problem, legs)
    return PathRisk(
        legs=tuple(out),
        computed=computed,
        wind=wind,
        vessels=vessels,
        tacks=tacks,
        total=min(1.0, wind + vessels.total + sum(tack.risk for tack in tacks)),
        correlation_time_s=process.correlation_time_s,
    )


def _angles(legs: Sequence[Leg]) -> NDArray[np.float64]:
    """Return heading less mean wind [rad]; a leg that the autopilot beats follows the wind and is never forced."""
    return np.array([math.pi if leg.is_beat else wrap_pi(-leg.twa_rad) for leg in legs], dtype=np.float64)


def _instant(margin_rad: float, sigma_rad: float) -> float:
    if sigma_rad <= 1e-12:
        return 0.0 if margin_rad >= -1e-9 else 1.0
    return 0.5 * math.erfc(margin_rad / sigma_rad / math.sqrt(2.0))


@functools.cache
def _full() -> NDArray[np.float64]:
    """Return what is asked for on every path: the cells' probabilities over a whole step."""
    return np.asarray(kernels.steps_of(kernels.R_STEP))


def _first_passage(
    times: tuple[NDArray[np.float64], NDArray[np.float64]],
    twa: NDArray[np.float64],
    half: float,
    p: WindProcess,
    out: NDArray[np.float64],
) -> None:
    start, end = times
    steps = kernels.first_passage(
        start,
        end,
        twa,
        float(half),
        p.model,
        float(p.s0),
        float(p.s1),
        float(p.rho),
        float(p.tau),
        p.table_t,
        p.table_s,
        _full(),
        out,
    )
    if steps < 0:  # a voyage of days in a wind of seconds: whatever is not excluded happens
        out[-1] = max(0.0, 1.0 - out[:-1].sum())


def with_risk(problem: Problem, plan: Plan) -> Plan:
    """Return the plan with ``risk`` and each leg's ``risk`` filled in: what is promised of the legs adds up to it."""
    if not plan.has_path:
        return plan
    risk = path_risk(problem, plan)
    of_tacks = tack_risks(plan.legs, risk.tacks)
    promised = risk.wind / risk.computed if risk.computed > 0.0 else 1.0
    legs = tuple(
        replace(leg, risk=min(1.0, promised * wind.first_entry + vessels + tacks))
        for leg, wind, vessels, tacks in zip(plan.legs, risk.legs, risk.vessels.legs, of_tacks, strict=True)
    )
    plan = replace(plan, legs=legs, risk=risk.total, vessel_risk=risk.vessels.total, tack_risk=risk.of_tacks)
    return replace(plan, why=with_parts(plan.why, problem, risk)) if problem.is_shared else plan


def with_parts(why: Why, problem: Problem, risk: PathRisk) -> Why:
    """Return the words and data of a plan with what its promise is made of."""
    part = problem.vessels_share
    named = ", ".join(f"{name} {100.0 * value:.2g} %" for name, value in risk.vessels.by_name[:3])
    text = (
        f"Off the plan {100.0 * risk.total:.2g} %: wind {100.0 * risk.wind:.2g} %, vessels "
        f"{100.0 * risk.vessels.total:.2g} % ({named}). At each instant {100.0 * (1.0 - problem.delta_s):.2g} %: "
        f"wind {100.0 * (1.0 - problem.wind_delta_s):.2g} %, vessels {100.0 * part:.2g} %."
    )
    data = {
        "risk": {
            "wind": risk.wind,
            "vessels": risk.vessels.total,
            "by_vessel": dict(risk.vessels.by_name),
            "instant_wind": 1.0 - problem.wind_delta_s,
            "instant_vessels": part,
            "instant_vessels_worst": risk.vessels.worst_instant,
            "count": vessel_count(problem.targets),
        }
    }
    return Why(text=f"{why.text} {text}".strip(), data={**why.data, **data})


# ------------------------------------------------------------------------------ planning within a limit
def keep_limit(problem: Problem, plan: Plan) -> Plan:
    """Return the plan with its risk filled in, or without its path when that is above ``problem.risk``."""
    plan = with_risk(problem, plan)
    if problem.risk is None or plan.risk is None or plan.risk <= problem.risk.max_path_risk:
        return plan
    reason = (
        f"the path found has a risk of {100.0 * plan.risk:.3g} %, above the limit of "
        f"{100.0 * problem.risk.max_path_risk:.3g} %"
    )
    return replace(
        plan,
        status=PlanStatus.NOT_FOUND,
        reason=reason,
        waypoints_en=np.empty((0, 2)),
        legs=(),
        cost_s=math.inf,
        first_s=None,
        why=Why(text=reason),
    )


def search_within(
    search: Search,
    problem: Problem,
    effort: Effort,
    seed: int,
    on_better: Callable[[NDArray[np.float64]], object] | None = None,
) -> Outcome:
    """Return the fastest path found whose promised risk is within ``problem.risk``; ``on_better`` is told of each.

    Any search that keeps the chance constraint at each instant can be held to a limit on the whole path: the
    no-go zone is widened by e more standard deviations, the least e whose plan keeps the limit is bisected, and the
    cheapest plan that keeps it is handed back. The bound of the first search, without the limit, stays a bound.
    """
    limit = problem.risk.max_path_risk if problem.risk is not None else 1.0
    best: Outcome | None = None
    best_s, least, bound_s = math.inf, 1.0, 0.0
    # ``low`` keeps too little away from the zone; ``high`` keeps the limit, or leaves no path at all.
    low, high, extra = 0.0, math.inf, 0.0
    over, under = 0.0, -math.inf  # log of hazard / limit's hazard at them
    settled, kept = False, 0.0
    for turn in range(RISK_TURNS):
        # Equal parts: each step of the bisection needs a good plan to judge by. What is left at its end is used up.
        seconds, steps = effort.remaining_s, (effort.limit or 0) - effort.used
        if not settled:
            seconds, steps = min(seconds, effort.budget_s / RISK_ROUNDS), min(steps, (effort.limit or 0) // RISK_ROUNDS)
        inner = Effort(
            None if math.isinf(effort.budget_s) else max(1e-3, seconds),
            None if effort.limit is None else max(1, steps),
            effort.is_wanted,
        )
        inner.judging_s, inner.needed_s = effort.judging_s / RISK_ROUNDS, effort.needed_s
        outcome = search(widened(problem, extra), inner, seed)
        effort.spend(inner.used)
        if turn == 0 or (settled and extra == 0.0):
            bound_s = max(bound_s, outcome.lower_bound_s)
        if turn == 0 and outcome.waypoints_en is None:
            return outcome  # what fails without the limit fails with it
        judged = None if outcome.waypoints_en is None else evaluate(problem, outcome.waypoints_en)
        promised = path_risk(problem, judged.legs).total if judged is not None and judged.is_feasible else math.inf
        least = min(least, promised)
        if promised <= limit and judged is not None:
            effort.found()
            if judged.time_s < best_s:
                best, best_s, kept = outcome, judged.time_s, extra
                if on_better is not None and outcome.waypoints_en is not None:
                    on_better(outcome.waypoints_en)
        if settled or effort.is_over:
            break
        if limit < promised < math.inf:
            low, over = extra, math.log(_hazard(promised) / _hazard(limit))
        elif turn == 0:
            settled = True
            continue
        else:
            high = extra
            under = math.log(_hazard(promised) / _hazard(limit)) if promised < math.inf else -math.inf
        if math.isinf(high):
            extra = low + _step_for(problem.k_delta + low, over)
        else:  # regula falsi, kept off the ends; bisection where there was no path
            part = over / (over - under) if math.isfinite(under) else 0.5
            extra = low + (high - low) * min(0.85, max(0.15, part))
        if extra > MOST_EXTRA_SIGMAS or high - low < EXTRA_RESOLUTION:
            if best is None:
                break
            settled, extra = True, kept
    if best is None:
        reason = (
            f"no path within the limit of {100.0 * limit:.3g} % on its risk; the least risky found has "
            f"{100.0 * least:.3g} %"
        )
        return Outcome(waypoints_en=None, reason=reason)
    return replace(best, lower_bound_s=bound_s, trace={**best.trace, "extra_sigmas": kept})


def _hazard(promised: float) -> float:
    """Return the accumulated hazard behind a promise: unlike the probability it does not saturate."""
    return max(1e-9, -math.log1p(-min(promised / PROMISE_FACTOR, 1.0 - 1e-9)))


def _step_for(k: float, over: float) -> float:
    """Return by how many sigmas to go from k so that the normal tail falls by the factor e^over, and a little more."""
    tail = 0.5 * math.erfc(k / math.sqrt(2.0)) * math.exp(-over)
    return max(0.1, 1.1 * (-NormalDist().inv_cdf(max(tail, 5e-31)) - k))


def widened(problem: Problem, extra: float) -> Problem:
    """Return the problem, its risk limit taken off, with its no-go zone ``extra`` standard deviations wider."""
    sigma = problem.wind.sigma
    if extra <= 0.0:
        return replace(problem, risk=None)
    if sigma.model == "forecast" and sigma.half_width_rad is not None:
        half = tuple(h + extra * s for h, s in zip(sigma.half_width_rad, sigma.sigma_rad, strict=True))
        table = replace(problem.wind, sigma=replace(sigma, half_width_rad=half))
        return _shared(replace(problem, risk=None, wind=table), problem.wind_delta_s, extra)
    k = problem.k_delta + extra
    delta_s = 1.0 - 0.5 * math.erfc(k / math.sqrt(2.0))
    return _shared(replace(problem, risk=None), min(delta_s, 1.0 - 1e-12), extra)


def _shared(problem: Problem, wind_delta_s: float, extra: float) -> Problem:
    """Return the problem with the wind's own delta_s given, and vessels kept ``extra`` more sigmas away."""
    if not problem.is_shared:
        return replace(problem, delta_s=wind_delta_s)
    count = vessel_count(problem.targets)
    k = sigmas_for(problem.vessels_share, count) + extra
    part = count * max(0.5 * math.erfc(k / math.sqrt(2.0)), LEAST_PART)
    return replace(problem, delta_s=wind_delta_s - part, vessels_part=part)

"""Sailors: who steers the boat of an environment, and how each fares in the same weather."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Literal, Protocol, TypedDict

import gymnasium
import numpy as np

from companion.errors import InputError
from lab.greedy import best_heading
from sailbench.environment import ENVIRONMENTS, Action, Observation, SailingEnv
from sailbench.planners import BASELINES, Given, Planner, answer_of, planner_named

Helm = Callable[[Observation], Action]
AGAIN_S = 30.0  # a sailor who plans plans again
BUDGET_S = 0.3
NEAR_M = 6.0  # a waypoint is passed
COMPANION = "companion"  # the whole program, which is no helm: she sails the scenario by ``sitl``


class Sailor(Protocol):
    """Who steers: given the boat at the start of a voyage, what to do with what is seen each second."""

    def __call__(self, env: SailingEnv) -> Helm:
        """Return the helm of one voyage; its actions are headings."""


def steer(heading_rad: float) -> Action:
    """Return the action that steers a heading."""
    return np.array([math.remainder(heading_rad, math.tau) / math.pi], dtype=np.float32)


def greedy(env: SailingEnv) -> Helm:
    """Steer the heading that makes most way towards the goal now (Stelzer and Pröll 2008)."""

    def helm(seen: Observation) -> Action:
        return steer(
            best_heading(
                env.boat.polar,
                twd_from_rad=math.atan2(seen[7], seen[8]),
                tws_mps=float(seen[9]),
                way_en_m=(float(seen[0]), float(seen[1])),
                heading_rad=math.atan2(seen[4], seen[5]),
            )
        )

    return helm


def by_plan(env: SailingEnv, *, planner: Planner) -> Helm:
    """Sail from waypoint to waypoint of a plan in the wind of the moment, clear of the rocks by the mission's margin.

    She plans again every 30 s; with less margin, and at last sails greedily, where nothing is found.
    """
    otherwise = greedy(env)
    way: list[tuple[float, float]] = []
    next_s = left = 0.0
    margins = [env.mission.margin_m * share for share in (1.0, 0.5, 0.0)]

    def helm(seen: Observation) -> Action:
        nonlocal next_s, left, way
        at = float(seen[2]), float(seen[3])
        if env.t_s >= next_s or seen[10] != left:
            next_s, left = env.t_s + AGAIN_S, float(seen[10])
            found = (_waypoints(planner(env.problem(margin_m), BUDGET_S, 0)) for margin_m in margins)
            way = next((points for points in found if points), [])[1:]
        while len(way) > 1 and math.dist(at, way[0]) < NEAR_M:
            way.pop(0)
        if not way:
            return otherwise(seen)
        return steer(math.atan2(way[0][0] - at[0], way[0][1] - at[1]))

    return helm


def _waypoints(given: Given) -> list[tuple[float, float]]:
    points = answer_of(given).waypoints_en
    return [] if points is None else [(float(east), float(north)) for east, north in points]


SAILORS: Mapping[str, Sailor] = MappingProxyType(
    {"greedy": greedy, **{name: partial(by_plan, planner=BASELINES[name]) for name in ("auto", "rrtstar", "astar")}}
)


def sailor_named(name: str) -> Sailor:
    """Return a sailor by name, or who sails by anybody's planner, MODULE:FUNCTION. Raises InputError: there is none."""
    if name in SAILORS:
        return SAILORS[name]
    known = (*SAILORS, *(n for n in BASELINES if n not in SAILORS), COMPANION)
    return partial(by_plan, planner=planner_named(name, wanted="sailor", known=known))


class SailRow(TypedDict):
    """One voyage. ``time_s`` is from setting sail to the last goal, of one that arrived and touched nothing."""

    environment: str
    sailor: str
    seed: int
    outcome: Literal["arrived", "touched", "late"]
    time_s: float | None


def sail(environment: str, name: str, seed: int) -> SailRow:
    """Sail one voyage in an environment that there is. Raises InputError: there is no such sailor."""
    if name == COMPANION:
        return _by_companion(environment, seed)
    made = gymnasium.make(environment)
    env = made.unwrapped
    assert isinstance(env, SailingEnv)
    sailor = sailor_named(name)
    seen, told = made.reset(seed=seed)
    helm, is_over = sailor(env), False
    while not is_over:
        seen, _, terminated, truncated, told = made.step(helm(seen))
        is_over = terminated or truncated
    return SailRow(
        environment=environment,
        sailor=name,
        seed=seed,
        outcome="touched" if told["touched"] else "arrived" if told["arrived"] else "late",
        time_s=told["t_s"] if told["arrived"] else None,
    )


def _by_companion(environment: str, seed: int) -> SailRow:
    from lab.campaigns.baselines import sail_companion

    env = SailingEnv(ENVIRONMENTS[environment])
    told = sail_companion(env.scenario, env.source, seed, shifts=None, told=COMPANION).record
    clean = told["arrived"] and not told["contacts"]
    return SailRow(
        environment=environment,
        sailor=COMPANION,
        seed=seed,
        outcome="touched" if told["contacts"] else "arrived" if told["arrived"] else "late",
        time_s=told["time_s"] if clean else None,
    )


def voyages(
    environments: Sequence[str],
    sailors: Sequence[str],
    *,
    seeds: int,
    is_made: Callable[[str, str, int], bool] = lambda *_: False,
) -> Iterator[SailRow]:
    """Yield a row for each environment, sailor and seed that is not made yet.

    Raises:
        InputError: there is no such environment or sailor, said before anybody sails.
    """
    for environment in environments:
        if environment not in ENVIRONMENTS:
            raise InputError("environment", environment, "there is none", f"one of {', '.join(ENVIRONMENTS)}")
    for name in sailors:
        if name != COMPANION:
            sailor_named(name)
    for environment in environments:
        for name in sailors:
            for seed in range(seeds):
                if not is_made(environment, name, seed):
                    yield sail(environment, name, seed)


HEADS = ("environment", "sailor", "voyages", "arrived", "touched", "late", "median s", "90 % s")


def lines(rows: Sequence[SailRow]) -> list[tuple[str, ...]]:
    """Return the cells of a row for each environment and sailor: who touches least first, then who is fastest."""
    kept = []
    for environment, sailor in dict.fromkeys((r["environment"], r["sailor"]) for r in rows):
        mine = [r for r in rows if (r["environment"], r["sailor"]) == (environment, sailor)]
        times = [r["time_s"] for r in mine if r["time_s"] is not None]
        counts = [sum(r["outcome"] == what for r in mine) for what in ("arrived", "touched", "late")]
        median_s, high_s = np.percentile(times, [50, 90]) if times else (math.inf, math.inf)
        told = [f"{t:.0f}" if times else "" for t in (median_s, high_s)]
        kept.append(
            ((environment, -counts[0], median_s), (environment, sailor, f"{len(mine)}", *map(str, counts), *told))
        )
    return [cells for _, cells in sorted(kept)]

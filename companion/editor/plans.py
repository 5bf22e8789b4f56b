"""What a plan of a draft would be in a wind that somebody assumes: made by a worker, the newest request alone."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import numpy as np

from companion.compose import planner_of
from companion.errors import InputError
from companion.geofence import Mission
from companion.page import plan_figures
from companion.planner import Plan, Problem
from companion.planner.worker import PlannerWorker
from companion.sailable.previews import Wind, leg_names, legs, onwards

BUDGET_S = 0.5       # for a leg: near the best, and while one looks
MOST_LEGS = 60


class Superseded(Exception):  # noqa: N818
    """A newer request has come."""


class Previews:
    """Plans with one worker; of requests that come meanwhile the newest is answered, the others are given up."""

    def __init__(self, worker: PlannerWorker) -> None:
        self._worker, self._newest = worker, 0
        self._turn = asyncio.Lock()

    def arrived(self) -> int:
        """Return the number of a request that has just come: those before it are given up."""
        self._newest += 1
        return self._newest

    async def make(self, mission: Mission, wind: Wind, mine: int) -> dict[str, Any]:
        """Return the plans of all legs in words and figures; ``error`` says why there is none.

        ``mine``: the request's number.

        Raises:
            Superseded: a newer request has come before this was done.
        """
        if mission.start is None:
            return {"error": "a plan begins somewhere: put the start on the chart", "legs": []}
        async with self._turn:
            by = planner_of(mission).about(mission.frame().origin)
            words, walk = leg_names(mission), legs(mission, wind, unix_s=time.time())
            made: list[dict[str, Any]] = []
            error = ""
            try:
                problem: Problem | None = next(walk, None)
                while problem is not None and len(made) < MOST_LEGS:
                    if mine != self._newest:
                        raise Superseded
                    budget_s = min(BUDGET_S, mission.skipper.planning_budget_s)
                    # Whoever hangs up must not end the worker's work, which would end the worker.
                    plan = await asyncio.shield(self._worker.plan(
                        problem, budget_s=budget_s, seed=0, algorithm=by.algorithm, settings=by.settings))
                    to = words[len(made)]
                    if not plan.has_path:
                        error = f"no way to {to} was found: {plan.reason}"
                        break
                    made.append(_in_figures(plan, to, mission))
                    problem = onwards(walk, plan)
            except (InputError, ValueError) as trouble:
                error = str(trouble)
            if len(made) == MOST_LEGS < len(words):
                error = f"only the first {MOST_LEGS} legs are planned here"
            return {"error": error, "legs": made, **_together(made)}


def _in_figures(plan: Plan, to: str, mission: Mission) -> dict[str, Any]:
    way = mission.frame().array_lonlat_from_en(plan.waypoints_en)[:, ::-1]
    return {"to": to, "why": plan.why.text, "way": np.round(way, 7).tolist(), **plan_figures(plan)}


def _together(made: list[dict[str, Any]]) -> dict[str, Any]:
    clear = [leg["clearance_m"] for leg in made if leg["clearance_m"] is not None]
    return {
        "time_s": round(sum(leg["time_s"] for leg in made), 1),
        "length_m": round(sum(leg["length_m"] for leg in made), 1),
        "tacks": sum(leg["tacks"] for leg in made), "gybes": sum(leg["gybes"] for leg in made),
        "clearance_m": min(clear) if clear else None,
    }

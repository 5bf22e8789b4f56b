"""A planner with the fates of a worker process, under the virtual clock."""

from __future__ import annotations

import asyncio
import math

from companion.clock import now_s
from companion.planner import Plan, Problem
from companion.planner.worker import DEFAULT_GRACE_S, InlinePlanner, failed

START_S = 1.5   # what it takes to start another worker


class FragilePlanner(InlinePlanner):
    """It dies and is replaced, and hangs, when told to."""

    def __init__(self) -> None:
        super().__init__()
        self._hangs_until_s = -math.inf
        self._deaths = 0

    def die(self) -> None:
        """Kill it, in the middle of whatever it computes."""
        self.is_alive = False
        self._deaths += 1

    def hang(self, until_s: float) -> None:
        """Answer nothing until ``until_s``."""
        self._hangs_until_s = until_s

    async def plan(
        self, problem: Problem, *, budget_s: float | None = None, expansions: int | None = None, seed: int = 0,
        algorithm: str = "auto",
    ) -> Plan:
        """Plan as the worker would: a dead one is replaced first, a hung one when its time is over."""
        if not self.is_alive:
            await asyncio.sleep(START_S)
            self.is_alive, self.restarts = True, self.restarts + 1
        if now_s() < self._hangs_until_s:
            await asyncio.sleep((budget_s or 0.0) + DEFAULT_GRACE_S)
            self.restarts += 1
            return failed("the planner's worker did not answer in time", seed=seed, algorithm=algorithm)
        deaths = self._deaths
        answer = await super().plan(
            problem, budget_s=budget_s, expansions=expansions, seed=seed, algorithm=algorithm)
        if deaths != self._deaths:
            return failed("the planner's worker died", seed=seed, algorithm=algorithm)
        return answer

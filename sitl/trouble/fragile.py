"""Planners with the fates of a worker process: one under the virtual clock, and the real process in real time."""

from __future__ import annotations

import asyncio
import math
import os
import resource
import signal
from pathlib import Path

from companion.clock import now_s
from companion.planner import Plan, Problem
from companion.planner.settings import Settings
from companion.planner.worker import DEFAULT_GRACE_S, InlinePlanner, PlannerWorker, failed

START_S = 1.5   # what it takes to start another worker


class FragilePlanner(InlinePlanner):
    """It dies and is replaced, hangs, and runs out of memory, when told to."""

    def __init__(self) -> None:
        super().__init__()
        self._hangs_until_s = -math.inf
        self._deaths = 0
        self._is_starved = False

    def die(self) -> None:
        """Kill it, in the middle of whatever it computes."""
        self.is_alive = False
        self._deaths += 1

    def hang(self, until_s: float) -> None:
        """Answer nothing until ``until_s``."""
        self._hangs_until_s = until_s

    def starve(self) -> None:
        """Let the next plan fail for want of memory."""
        self._is_starved = True

    async def plan(
        self, problem: Problem, *, budget_s: float | None = None, expansions: int | None = None, seed: int = 0,
        algorithm: str = "auto", settings: Settings | None = None,
    ) -> Plan:
        """Plan as the worker would: a dead one is replaced first, a hung one when its time is over."""
        if not self.is_alive:
            await asyncio.sleep(START_S)
            self.is_alive, self.restarts = True, self.restarts + 1
        if now_s() < self._hangs_until_s:
            await asyncio.sleep((budget_s or 0.0) + DEFAULT_GRACE_S)
            self.restarts += 1
            return failed("the planner's worker did not answer in time", seed=seed, algorithm=algorithm)
        if self._is_starved:
            self._is_starved = False
            return failed("the planner's worker failed: MemoryError()", seed=seed, algorithm=algorithm)
        deaths = self._deaths
        answer = await super().plan(
            problem, budget_s=budget_s, expansions=expansions, seed=seed, algorithm=algorithm, settings=settings)
        if deaths != self._deaths:
            return failed("the planner's worker died", seed=seed, algorithm=algorithm)
        return answer


class MortalPlanner(PlannerWorker):
    """The real worker process, killed, stopped and kept from more memory by signals and limits."""

    def __init__(self) -> None:
        super().__init__()
        self.fates: list[str] = []    # that befell a living process, for who counts them

    def die(self) -> None:
        """SIGKILL, as the kernel's out-of-memory killer sends it too."""
        self._signal(signal.SIGKILL)

    def hang(self, until_s: float) -> None:
        """SIGSTOP; SIGCONT at ``until_s`` to what is left of it."""
        self._signal(signal.SIGSTOP)
        if self.pid is not None and until_s < math.inf:
            asyncio.get_running_loop().call_at(until_s, self._signal, signal.SIGCONT, self.pid)

    def starve(self) -> None:
        """Forbid its address space to grow."""
        if self.pid is not None:
            pages = int(Path(f"/proc/{self.pid}/statm").read_text(encoding="ascii").split()[0])
            resource.prlimit(self.pid, resource.RLIMIT_AS, (pages * resource.getpagesize(),) * 2)
            self.fates.append("starved")

    def _signal(self, number: signal.Signals, pid: int | None = None) -> None:
        if self.pid is not None and pid in {None, self.pid}:
            os.kill(self.pid, number)
            self.fates.append(number.name)

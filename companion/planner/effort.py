"""What an algorithm may spend and what it hands back: ``search(problem, effort, seed) -> Outcome``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.clock import effort_s
from companion.planner.plan import PlanStatus
from companion.planner.problem.value import Problem


class Effort:
    """What a search may spend: expansions, or seconds, or both (then the seconds are only a backstop).

    Algorithms call ``spend`` with what they did and stop when ``is_over``. ``fraction`` is the share used of the
    limit that decides (expansions when given), so a schedule made from it does not depend on the machine when
    there is an expansion budget. ``after_s`` of the seconds are for what is done with the path afterwards.
    """

    def __init__(self, budget_s: float | None, expansions: int | None) -> None:
        self.limit = expansions
        self.budget_s = math.inf if budget_s is None else budget_s
        self.after_s = 0.0
        self.used = 0
        self.first_s: float | None = None
        self._began_s = effort_s()

    def spend(self, expansions: int) -> None:
        """Count work done."""
        self.used += expansions

    @property
    def elapsed_s(self) -> float:
        """Computing time since the plan began [s]."""
        return effort_s() - self._began_s

    @property
    def fraction(self) -> float:
        """Share of the deciding limit used, 0..1 and beyond."""
        if self.limit is not None:
            return self.used / max(1, self.limit)
        available_s = self.budget_s - self.after_s
        return self.elapsed_s / available_s if available_s > 0.0 else 1.0

    @property
    def is_over(self) -> bool:
        """Must the search stop now?"""
        if self.limit is not None and self.used >= self.limit:
            return True
        return self.remaining_s <= 0.0

    @property
    def remaining_s(self) -> float:
        """Computing time left for the search [s]; inf without a budget in seconds."""
        return self.budget_s - self.after_s - self.elapsed_s

    def part(self, share: float) -> Effort:
        """Return an effort that ends when ``share`` of this one's limits is spent; what it spends counts here."""
        return _Part(self, share)

    def remaining(self, chunk: int) -> int:
        """Return how much of a chunk of expansions is left."""
        return chunk if self.limit is None else max(0, min(chunk, self.limit - self.used))

    def found(self) -> None:
        """Note the moment of the first path."""
        if self.first_s is None:
            self.first_s = self.elapsed_s


class _Part(Effort):
    def __init__(self, whole: Effort, share: float) -> None:
        super().__init__(
            None if math.isinf(whole.budget_s) else share * whole.remaining_s,
            None if whole.limit is None else max(1, int(share * (whole.limit - whole.used))))
        self._whole = whole

    def spend(self, expansions: int) -> None:
        super().spend(expansions)
        self._whole.spend(expansions)

    def found(self) -> None:
        super().found()
        self._whole.found()


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What an algorithm hands back: waypoints or None, a bound it proved, and for a failure what it knows."""

    waypoints_en: NDArray[np.float64] | None
    lower_bound_s: float = 0.0
    status: PlanStatus | None = None
    reason: str = ""
    trace: Mapping[str, Any] = field(default_factory=dict)


Search = Callable[[Problem, Effort, int], Outcome]

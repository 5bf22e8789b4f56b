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

Judge = Callable[[NDArray[np.float64]], float]
LATE = 1.1  # of the seconds: another path is not judged beyond
SETTLES = 5.0  # times what the first path takes: so long it soon gets better, and is not judged yet
SETTLED = 0.25  # ... and no longer than this share of the seconds
HOPELESS_FROM = 1.0 / 3.0  # of a part
FASTER = 0.8  # of the time of the path that was judged last: another way, which is judged at once


class UnwantedError(Exception):
    """Nobody waits for the answer any more: raised where a search tells what it spent."""


class Effort:
    """What a search may spend: expansions, or seconds, or both (then the seconds are only a backstop).

    Algorithms call ``spend`` with what they did and stop when ``is_over``. ``fraction`` is the share used of the
    limit that decides (expansions when given), so a schedule made from it does not depend on the machine when
    there is an expansion budget. ``after_s`` of the seconds are for what is done with the path afterwards:
    ``judging_s`` of it for the judgement that is left, of which ``needed_s`` cannot be left out. ``has_answer``: a path
    has been judged to be one; ``is_at_risk``: a tack of the best of them may fail onto something. ``is_wanted``: asked
    at each ``spend``, which raises ``UnwantedError`` when it is not.
    """

    def __init__(
        self, budget_s: float | None, expansions: int | None, is_wanted: Callable[[], bool] | None = None
    ) -> None:
        self.limit, self.is_wanted = expansions, is_wanted
        self.budget_s = math.inf if budget_s is None else budget_s
        self.after_s = self.judging_s = self.needed_s = 0.0
        self.has_answer = self.is_at_risk = False
        self._judge: Judge | None = None
        self._judge_at_s: float | None = None  # None: nothing has been judged
        self._judged_s = 0.0  # the time of the path that was judged last
        self._first: NDArray[np.float64] | None = None  # the first path, until then
        self.used = 0
        self.first_s: float | None = None
        self._began_s = effort_s()

    def spend(self, expansions: int) -> None:
        """Count work done."""
        self.used += expansions
        if self.is_wanted is not None and not self.is_wanted():
            raise UnwantedError("nobody waits for it any more")

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

    def has_time(self, seconds: float) -> bool:
        """May what takes so long be begun, and the answer be judged in time? Always where expansions decide."""
        return self.limit is not None or self.elapsed_s + seconds + self.needed_s <= self.budget_s

    @property
    def is_late(self) -> bool:
        """Is there an answer, and no time to judge another path?"""
        late_s = self.elapsed_s + self.needed_s - LATE * self.budget_s
        return self.limit is None and self.has_answer and late_s > 0.0

    def reserve(self, judging_s: float) -> None:
        """Keep no more of the seconds back than what is left to be judged takes."""
        if self.limit is None:
            self.judging_s = self.after_s = judging_s

    def listen(self, judge: Judge) -> None:
        """Have the best path judged while the search goes on; never where expansions decide.

        ``judge`` is called with the path (n, 2) and returns when it is to be called next [s]. The first time it is
        called when the first path has had a little time to settle, for of a small budget one judgement may be all that
        there is time for; the first path itself follows where what it settled to is no answer or has a tack at risk.
        """
        if self.limit is None:
            self._judge = judge

    @property
    def hears_at_s(self) -> float:
        """From when on a path is judged [s]; inf without a path, and where nobody listens."""
        if self._judge is None or self.first_s is None:
            return math.inf
        if self._judge_at_s is None:
            return min(SETTLES * self.first_s, SETTLED * self.budget_s)
        return self._judge_at_s

    def improved(self, path: Callable[[], NDArray[np.float64]], time_s: float) -> bool:
        """Have a path judged that is better than those before, if it is time; return whether it was.

        It is time at once where it takes far less, ``time_s``, than the one that was judged last.
        """
        judge = self._judge
        if judge is None or self.first_s is None:
            return False
        is_far_faster = time_s < FASTER * self._judged_s and self.has_time(self.needed_s)
        if self.elapsed_s < self.hears_at_s and not is_far_faster:
            self._first = path() if self._first is None else self._first
            return False
        self._judge, self._judged_s = None, time_s  # what the judge itself searches is not judged again
        self._judge_at_s = judge(path())
        if self._first is not None and (not self.has_answer or self.is_at_risk) and self.has_time(self.needed_s):
            self._judge_at_s = judge(self._first)
        self._judge, self._first = judge, None
        return True

    def again(self, share: float, share_s: float) -> Effort:
        """Return an effort of its own for another search: a share of the expansions, or of the seconds and its
        judgement; what it spends does not count here."""  # noqa: D205, D209
        if self.limit is not None:
            return Effort(None, max(1, int(share * self.limit)), self.is_wanted)
        whole_s = None if math.isinf(self.budget_s) else share_s * self.budget_s + self.needed_s
        other = Effort(whole_s, None, self.is_wanted)
        other.after_s = other.judging_s = self.needed_s
        return other

    def part(self, share: float, hopeless_s: float = math.inf) -> Effort:
        """Return an effort that ends when ``share`` of this one's limits is spent; what it spends counts here.

        It ends after a third of that where the best path found takes longer than ``hopeless_s``.
        """
        return _Part(self, share, hopeless_s)

    def remaining(self, chunk: int) -> int:
        """Return how much of a chunk of expansions is left."""
        return chunk if self.limit is None else max(0, min(chunk, self.limit - self.used))

    def found(self) -> None:
        """Note the moment of the first path."""
        if self.first_s is None:
            self.first_s = self.elapsed_s


class _Part(Effort):
    def __init__(self, whole: Effort, share: float, hopeless_s: float) -> None:
        super().__init__(
            None if math.isinf(whole.budget_s) else share * whole.remaining_s,
            None if whole.limit is None else max(1, int(share * (whole.limit - whole.used))),
        )
        self._whole, self._hopeless_s, self._best_s = whole, hopeless_s, math.inf

    @property
    def is_over(self) -> bool:
        is_hopeless = self._hopeless_s < self._best_s < math.inf and self.fraction > HOPELESS_FROM
        return is_hopeless or super().is_over or self._whole.is_late

    def spend(self, expansions: int) -> None:
        super().spend(expansions)
        self._whole.spend(expansions)

    def found(self) -> None:
        super().found()
        self._whole.found()

    def improved(self, path: Callable[[], NDArray[np.float64]], time_s: float) -> bool:
        began_s, self._best_s = self.elapsed_s, min(self._best_s, time_s)
        is_judged = self._whole.improved(path, time_s)
        self.budget_s += self.elapsed_s - began_s  # what the judgement took is none of this part's
        return is_judged


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What an algorithm hands back: waypoints or None, a bound it proved, and for a failure what it knows."""

    waypoints_en: NDArray[np.float64] | None
    lower_bound_s: float = 0.0
    status: PlanStatus | None = None
    reason: str = ""
    trace: Mapping[str, Any] = field(default_factory=dict)


Search = Callable[[Problem, Effort, int], Outcome]

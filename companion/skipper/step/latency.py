"""How long the planner takes to answer on this computer, and by how much earlier than on a fast one it is asked.

Lead times were tuned on a server, where an answer comes within a second of its budget. What it takes longer here, as
the last answers had it, is added to them; on a computer that is as fast nothing is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

KEPT = 20  # answers
IN_TIME_S = 2.0  # what the lead times have room for, whatever the budget; and ...
BEYOND_S = 1.0  # ... how much longer than its budget an answer may take at no cost
LONGEST_S = 60.0  # later than this nothing follows an answer: the wind that it is for is another
PATIENCE = 3.0  # times what nine answers of ten take: so long an answer is waited for
MOST_PATIENCE_S = 120.0
SLOW = 0.3  # of the reference core: a computer with less is called slow


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerLatency:
    """The last answers of the planner.

    Attributes:
        answers_s: From being asked until its answer was there, the newest last; of one that was given up, until then.
        room_s: What the lead times have room for: an answer that takes no longer is as on a fast computer.
        speed: What the planner had of the reference core at the last answer (``companion.planner.worker``); None: not
            measured.

    """

    answers_s: tuple[float, ...] = ()
    room_s: float = IN_TIME_S
    speed: float | None = None

    def with_answer(self, took_s: float, budget_s: float, speed: float | None = None) -> PlannerLatency:
        """Return it with another answer, of that budget; a ``speed`` that was not measured is what it was."""
        return replace(
            self,
            answers_s=(*self.answers_s, round(max(0.0, took_s), 1))[-KEPT:],
            room_s=max(IN_TIME_S, budget_s + BEYOND_S),
            speed=self.speed if speed is None else round(speed, 2),
        )

    @property
    def median_s(self) -> float | None:
        """What half of the answers take at the most [s], None: there was none."""
        return self._quantile_s(0.5)

    @property
    def p90_s(self) -> float | None:
        """What nine answers of ten take at the most [s]; of few the slowest is left out."""
        return self._quantile_s(0.9)

    @property
    def said_p90_s(self) -> float | None:
        """What nine answers of ten took at the most [s], as it is told: of few the slowest. Nothing follows from it."""
        return _reached_s(self.answers_s, 0.9)

    def _quantile_s(self, share: float) -> float | None:
        ordered = sorted(self.answers_s)
        return ordered[math.floor(share * (len(ordered) - 1))] if ordered else None

    @property
    def late_s(self) -> float:
        """How much earlier than on a fast computer the planner is to be asked [s]."""
        return self._beyond_s(self.p90_s)

    @property
    def usually_late_s(self) -> float:
        """How much farther than on a fast computer the boat has sailed when an answer is there, as a rule [s]."""
        return self._beyond_s(self.median_s)

    def patience_s(self, least_s: float) -> float:
        """Return how long an answer is waited for, at least ``least_s`` [s]."""
        return max(least_s, min(PATIENCE * (self.p90_s or 0.0), MOST_PATIENCE_S))

    @property
    def is_slow(self) -> bool:
        """Is this computer to be called slow?"""
        return self.late_s > 0.0 or (self.speed is not None and self.speed < SLOW)

    @property
    def words(self) -> str:
        """It in words, empty: nothing is known."""
        median_s, p90_s = _reached_s(self.answers_s, 0.5), self.said_p90_s
        if median_s is None or p90_s is None:
            return ""
        share = "" if self.speed is None else f", at {100.0 * self.speed:.0f} % of the reference core's speed"
        return f"answers in {median_s:.1f} s (nine of ten within {p90_s:.1f} s){share}"

    def _beyond_s(self, took_s: float | None) -> float:
        return 0.0 if took_s is None else min(max(0.0, took_s - self.room_s), LONGEST_S)


def _reached_s(answers_s: Sequence[float], share: float) -> float | None:
    """Return what at least ``share`` of the answers took at the most [s], None: there was none."""
    return sorted(answers_s)[math.ceil(share * len(answers_s)) - 1] if answers_s else None


NO_ANSWERS = PlannerLatency()

"""The order that stands: what the boat was told to do until she is told to go on."""

from __future__ import annotations

from dataclasses import dataclass

from companion.orders import Verb
from companion.skipper.way.voyage import PointEn


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """One order that stands.

    Attributes:
        verb: what.
        by: who asked, in words.
        name: of the refuge, or of the place in words.
        en_m: where, for a goal.
        since_s: since when, in this life of the companion; None: it was taken over from before and not yet counted.
        before_s: how long it stood before that [s].
    """

    verb: Verb
    by: str
    name: str = ""
    en_m: PointEn | None = None
    since_s: float | None = None
    before_s: float = 0.0

    def age_s(self, t_s: float) -> float:
        """Return how long it has stood [s]."""
        return self.before_s + (0.0 if self.since_s is None else max(0.0, t_s - self.since_s))

    @property
    def words(self) -> str:
        """The order as it is spoken of."""
        return f"{self.verb}{f' {self.name}' if self.name else ''}"

    @property
    def why(self) -> str:
        """By whom, as a reason."""
        return f"ordered by {self.by}"

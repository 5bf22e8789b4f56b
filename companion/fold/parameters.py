"""What the autopilot told of its parameters: what is believed, what is to be asked for, what somebody has changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from companion.boat import AutopilotLimits
from companion.mavlink.wire import RANGES, Effect, believable, effect_of

# Parameters without which the autopilot's limits are not known.
_LIMITS = frozenset({"SAIL_NO_GO_ANGLE", "SAIL_XTRACK_MAX", "WP_RADIUS"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A parameter that changes what a sensor says, or how she sails, was set; ``before`` None: it was not known."""

    name: str
    before: float | None
    after: float
    effect: Effect


class ToldParameters:
    """The autopilot's parameters by ArduPilot's names, in its units."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self.limits: AutopilotLimits | None = None
        self._in_doubt: dict[str, float] = {}
        self._answered: set[str] = set()

    def take(
        self, values: Mapping[str, float], *, is_set: bool = False,
    ) -> tuple[dict[str, float], tuple[str, ...], tuple[Change, ...]]:
        """Take what was told; return what of it is believed, why the rest cannot be, and what somebody has changed.

        One that was known and has changed is in none of them: it is asked for again, and believed when it is told
        twice. With ``is_set`` a first telling of one that has an effect was not asked for by us, as when somebody sets
        it, and is treated likewise.
        """
        good, refused = believable(values)
        self._answered |= values.keys()
        changes: list[Change] = []
        for name in tuple(good):
            known, value, effect = self.values.get(name), good[name], effect_of(name)
            is_news = known is not None or (is_set and name not in RANGES) or name in self._in_doubt
            if known == value or not is_news or (name not in RANGES and effect is None):
                self._in_doubt.pop(name, None)
            elif self._in_doubt.get(name) != value:
                self._in_doubt[name] = good.pop(name)
            else:
                del self._in_doubt[name]
                if effect is not None:
                    changes.append(Change(name=name, before=known, after=value, effect=effect))
        self.values.update(good)
        if self._answered >= _LIMITS:
            self.limits = AutopilotLimits.from_params(self.values)
        return good, refused, tuple(changes)

    @property
    def unread(self) -> tuple[str, ...]:
        """The parameters that were not told yet, or once with another value: to be asked for."""
        others = tuple(name for name in self._in_doubt if name not in RANGES)
        return tuple(name for name in RANGES if name not in self._answered or name in self._in_doubt) + others

    def doubt(self) -> None:
        """Ask for all of them again: the autopilot was begun anew."""
        self._answered.clear()

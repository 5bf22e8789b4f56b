"""What the autopilot told of its parameters: what is believed, what is to be asked for."""

from __future__ import annotations

from collections.abc import Mapping

from companion.boat import AutopilotLimits
from companion.mavlink.wire import RANGES, believable

# Parameters without which the autopilot's limits are not known.
_LIMITS = frozenset({"SAIL_NO_GO_ANGLE", "SAIL_XTRACK_MAX", "WP_RADIUS"})


class ToldParameters:
    """The autopilot's parameters by ArduPilot's names, in its units."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self.limits: AutopilotLimits | None = None
        self._in_doubt: dict[str, float] = {}
        self._answered: set[str] = set()

    def take(self, values: Mapping[str, float]) -> tuple[dict[str, float], tuple[str, ...]]:
        """Take what was told; return what of it is believed, and why the rest cannot be.

        One that was known and has changed is in neither: it is asked for again, and believed when it is told twice.
        """
        good, refused = believable(values)
        self._answered |= values.keys()
        for name in tuple(good):
            known, value = self.values.get(name), good[name]
            if name in RANGES and known not in {None, value} and self._in_doubt.get(name) != value:
                self._in_doubt[name] = good.pop(name)
            else:
                self._in_doubt.pop(name, None)
        self.values.update(good)
        if self._answered >= _LIMITS:
            self.limits = AutopilotLimits.from_params(self.values)
        return good, refused

    @property
    def unread(self) -> tuple[str, ...]:
        """The parameters that were not told yet, or once with another value: to be asked for."""
        return tuple(name for name in RANGES if name not in self._answered or name in self._in_doubt)

    def doubt(self) -> None:
        """Ask for all of them again: the autopilot was begun anew."""
        self._answered.clear()

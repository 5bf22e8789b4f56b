"""What another boat would do in the same weather: a mission with other numbers, or one that knows the wind better."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import msgspec

from companion.geofence import Mission
from companion.wind import Estimator, WindTracker
from sitl.world import WindModel


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """Keys of the mission's tables that are other ones, and the wind room: of the wind and the mission's estimator."""

    tables: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    room: Callable[[WindModel, Estimator], WindTracker] | None = None

    def mission(self, mission: Mission) -> Mission:
        """Return the mission so changed."""
        changes = {
            name: msgspec.structs.replace(getattr(mission.options, name), **keys) for name, keys in self.tables.items()
        }
        return replace(mission, options=msgspec.structs.replace(mission.options, **changes))

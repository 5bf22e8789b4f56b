"""Rally points, and where a boat goes that is sent home."""

from __future__ import annotations

import math

from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.items import Item


class Rally:
    """The stored rally points."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self.items: list[Item] = []

    def refuge(self) -> tuple[float, float] | None:
        """Return home or the nearest rally point within RALLY_LIMIT_KM."""
        core, here = self._core, self._core.vehicle.position
        limit_m = core.parameters.get("RALLY_LIMIT_KM") * 1000.0
        points = [core.chart.to_en(i.x, i.y) for i in self.items]
        points = [p for p in points if limit_m <= 0.0 or math.dist(p, here) <= limit_m]
        if core.home_en is not None and (not points or core.parameters.flag("RALLY_INCL_HOME")):
            points.append(core.home_en)
        return min(points, key=lambda p: math.dist(p, here), default=None)

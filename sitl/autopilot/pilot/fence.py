"""AC_Fence: zones from the stored items, how far the boat is from forbidden water, breaches."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.mission import Item

CHECK_S = 0.1
TYPE_CIRCLE, TYPE_POLYGON = 2, 4
BACKUP_M = 20.0  # so much farther outside the home circle there is another one: a new breach and a new action
LONG_E7, PIECE_E7 = 4_500_000, 200_000  # an edge of half a degree is cut into pieces of two kilometres
_HALF_E7 = 1_800_000_000
_POLYGONS = {mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: 1.0, mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: -1.0}
_CIRCLES = {mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: 1.0, mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: -1.0}


class Polygon:
    """``sign`` +1: stay inside; -1: stay outside. ``vertices_en`` is (n, 2) [m]."""

    def __init__(self, sign: float, vertices_en: NDArray[np.float64]) -> None:
        self.sign, self.vertices_en = sign, vertices_en
        edges = np.roll(vertices_en, -1, axis=0) - vertices_en
        lengths2 = np.maximum((edges**2).sum(axis=1), 1e-12)
        self._edges = tuple(zip(*(column.tolist() for column in (*vertices_en.T, *edges.T, lengths2)), strict=True))

    def clearance_m(self, east: float, north: float) -> float:
        """Return the distance [m] to the edge, negative on the forbidden side."""
        least2, is_inside = math.inf, False
        for x, y, dx, dy, length2 in self._edges:
            px, py = east - x, north - y
            u = (px * dx + py * dy) / length2
            if u < 0.0:
                u = 0.0
            elif u > 1.0:
                u = 1.0
            least2 = min(least2, (px - u * dx) ** 2 + (py - u * dy) ** 2)
            # even-odd rule: count the edges that a ray to the east crosses
            if (y > north) != (y + dy > north) and x + py / dy * dx > east:
                is_inside = not is_inside
        return math.sqrt(least2) * (1.0 if is_inside else -1.0) * self.sign


@dataclass(frozen=True, slots=True)
class CircleZone:
    """``sign`` +1: stay inside; -1: stay outside."""

    sign: float
    east_m: float
    north_m: float
    radius_m: float

    def clearance_m(self, east: float, north: float) -> float:
        """Return the distance [m] to the edge, negative on the forbidden side."""
        return (self.radius_m - math.hypot(east - self.east_m, north - self.north_m)) * self.sign


def zones(items: Sequence[Item], to_en: Callable[[int, int], tuple[float, float]]) -> list[Polygon | CircleZone] | None:
    """Return the zones of a fence, or None when the vertex counts do not fit."""
    out: list[Polygon | CircleZone] = []
    i = 0
    while i < len(items):
        item = items[i]
        if item.command in _POLYGONS:
            count = int(item.p1)
            group = items[i : i + count]
            if count < 3 or len(group) < count or any(g.command != item.command or int(g.p1) != count for g in group):
                return None
            out.append(Polygon(_POLYGONS[item.command], np.array([to_en(*place) for place in _ring(group)])))
            i += count
        else:
            if item.command in _CIRCLES:
                if item.p1 <= 0.0:
                    return None
                out.append(CircleZone(_CIRCLES[item.command], *to_en(item.x, item.y), float(item.p1)))
            i += 1
    return out


def _ring(group: Sequence[Item]) -> list[tuple[int, int]]:
    """Return a ring's places [deg x 1e7], its long edges cut up: ArduPilot draws them straight in these degrees."""
    out: list[tuple[int, int]] = []
    for a, b in zip(group, (*group[1:], group[0]), strict=True):
        lat, lon = b.x - a.x, (b.y - a.y + _HALF_E7) % (2 * _HALF_E7) - _HALF_E7
        longest = max(abs(lat), abs(lon))
        count = 1 if longest < LONG_E7 else math.ceil(longest / PIECE_E7)
        out += [
            (a.x + lat * n // count, (a.y + lon * n // count + _HALF_E7) % (2 * _HALF_E7) - _HALF_E7)
            for n in range(count)
        ]
    return out


class FenceMonitor:
    """What is stored, whether it is on, and what it found."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._due_s = core.t_s
        self.items: list[Item] = []
        self._zones: list[Polygon | CircleZone] = []
        self.is_enabled = False
        self.is_breached = False
        self.breach_count = 0
        self.breach_type = 0
        self.breach_ms = 0
        self.is_limiting = False
        self._switched_on = 0  # its types when it was switched on: one set later waits for the next time
        self._types = TYPE_POLYGON
        self._circle_clear_m = math.inf
        self._circle_m = math.inf  # how far outside the home circle the next breach of it begins
        if core.parameters.flag("FENCE_ENABLE"):
            self.switch(enabled=True)

    @property
    def is_present(self) -> bool:
        """Whether there is anything to keep (SYS_STATUS)."""
        return bool(self._zones) or (self.is_enabled and bool(self._types & TYPE_CIRCLE))

    def load(self, items: Sequence[Item]) -> bool:
        """Take over a new list; False, and nothing changed, if it does not make sense."""
        found = zones(items, self._core.chart.to_en)
        if found is None:
            return False
        self.items, self._zones = list(items), found
        return True

    def reload(self) -> None:
        """Take the zones from the stored items again: the metres count from elsewhere."""
        self.load(self.items)

    def _clearance_m(self) -> float:
        """Return the distance [m] to the nearest forbidden water, negative in it, infinite without a fence.

        Zones are intersected: outside any inclusion zone is forbidden, also when there are several.
        """
        core = self._core
        self._types = types = core.parameters.flag("FENCE_TYPE") & self._switched_on
        found = self._circle_clear_m = math.inf
        if types & TYPE_POLYGON:
            here = core.vehicle.position
            for zone in self._zones:
                found = min(found, zone.clearance_m(*here))
        if types & TYPE_CIRCLE and core.home_en is not None:
            self._circle_clear_m = core.parameters.get("FENCE_RADIUS") - math.dist(core.vehicle.position, core.home_en)
            found = min(found, self._circle_clear_m)
        return found

    @property
    def due_s(self) -> float:
        """When to look again."""
        return self._due_s if self.is_enabled else math.inf

    def update(self) -> float | None:
        """Look at the fence: avoidance near it. Return how far outside [m] the boat is when a breach begins."""
        core = self._core
        if not self.is_enabled or core.t_s < self._due_s - 1e-9:
            return None
        self._due_s = core.t_s + CHECK_S
        if not core.has_origin:
            return None
        clearance_m = self._clearance_m()
        begins = self._judge(clearance_m)
        get = core.parameters.get
        margin_m = get("FENCE_MARGIN")
        reach_m = margin_m + get("WP_SPEED") / max(get("PSC_POS_P"), 0.01)
        avoiding = core.parameters.flag("AVOID_ENABLE") & 1 and not self.is_breached and core.is_armed
        self.is_limiting = bool(avoiding) and clearance_m <= reach_m
        core.vehicle.avoid(near=self.is_limiting, ease=self.is_limiting and clearance_m <= margin_m)
        if not begins:
            return None
        core.voice.broadcast(self.status_message())
        return -clearance_m

    def _judge(self, clearance_m: float) -> bool:
        """Note the state; True when a breach begins."""
        was = self.is_breached
        self.is_breached = clearance_m < 0.0
        farther = -self._circle_clear_m >= self._circle_m
        if self._circle_clear_m >= 0.0:
            self._circle_m = math.inf
        elif farther or self._circle_m == math.inf:
            self._circle_m = BACKUP_M - self._circle_clear_m
        if self.is_breached and (farther or not was):
            self.breach_count += 1
            self.breach_type = mav.FENCE_BREACH_BOUNDARY
            if not was:
                self.breach_ms = self._core.boot_ms
            return True
        if not self.is_breached:
            self.breach_type = 0
        return False

    def switch(self, *, enabled: bool) -> None:
        """Enable or disable."""
        self.is_enabled = enabled
        self._switched_on = self._core.parameters.flag("FENCE_TYPE") if enabled else 0
        if not enabled:
            self.is_breached = self.is_limiting = False
            self.breach_type = 0
        self._core.vehicle.avoid(near=False, ease=False)
        self._due_s = self._core.t_s

    def status_message(self) -> Any:
        """Return FENCE_STATUS."""
        mitigation = mav.FENCE_MITIGATE_VEL_LIMIT if self.is_limiting else mav.FENCE_MITIGATE_NONE
        return mav.MAVLink_fence_status_message(
            int(self.is_breached), self.breach_count, self.breach_type, self.breach_ms, mitigation
        )

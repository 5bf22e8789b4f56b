"""Positions that a boat cannot have come to: held back until the next ones agree. Pure."""

from __future__ import annotations

import math

from companion.messages import GeoPoint, VehicleState

# A fix farther off than a boat sails in the time since the last one, and this, is a leap.
LEAP_M = 20.0
LEAP_MPS = 8.0         # no boat of ours sails faster
# It is believed when so many in a row agree, or two that are this far apart in time [s].
LEAP_FIXES = 3
LEAP_S = 2.0
# After a longer silence any place is possible [s].
MEMORY_S = 10.0
DEGREE_M = 111_195.0   # of latitude, on the mean sphere


def leap_m(distance_m: float, elapsed_s: float) -> float:
    """Return how much farther two fixes are apart than a boat can have sailed [m]."""
    return max(0.0, distance_m - LEAP_MPS * max(elapsed_s, 0.0))


class FixFilter:
    """The last position that was believed, and those that leapt away from it."""

    def __init__(self) -> None:
        self._last: VehicleState | None = None
        self._held: list[VehicleState] = []

    def take(self, fix: VehicleState) -> bool:
        """Return whether ``fix`` is believed."""
        if self._last is None or fix.boot_s - self._last.boot_s > MEMORY_S or _agree(self._last, fix):
            self._believe(fix)
            return True
        if self._held and not _agree(self._held[-1], fix):
            self._held.clear()
        self._held.append(fix)
        if len(self._held) >= LEAP_FIXES or fix.boot_s - self._held[0].boot_s >= LEAP_S:
            self._believe(fix)
            return True
        return False

    def _believe(self, fix: VehicleState) -> None:
        self._last = fix
        self._held.clear()


def _agree(a: VehicleState, b: VehicleState) -> bool:
    return leap_m(_distance_m(a.position, b.position), b.boot_s - a.boot_s) < LEAP_M


def _distance_m(a: GeoPoint, b: GeoPoint) -> float:
    """Return the distance of two places [m], right to a percent where it matters here: below a kilometre."""
    north = b.lat_deg - a.lat_deg
    east = ((b.lon_deg - a.lon_deg + 180.0) % 360.0 - 180.0) * math.cos(math.radians(a.lat_deg))
    return DEGREE_M * math.hypot(north, east)

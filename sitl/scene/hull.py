"""The hull that a mission's boat has in the simulator."""

from __future__ import annotations

from companion.boat import Polar
from companion.compose import polar_of
from companion.geofence import Mission

OWN = "ardurover"   # [boat] polar: the simulator's own hull, by its equations


def own_polar(mission: Mission) -> Polar | None:
    """Return the polar that the simulated boat sails by, None for the simulator's own hull."""
    return None if mission.boat.polar == OWN else polar_of(mission)

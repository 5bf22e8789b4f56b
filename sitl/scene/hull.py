"""The hull that a mission's boat has in the simulator."""

from __future__ import annotations

from companion.boat import Polar
from companion.compose import RECENTRE_M, polar_of
from companion.geofence import Mission
from sitl.autopilot import FRAME_M

OWN = "ardurover"   # [boat] polar: the simulator's own hull, by its equations


def own_polar(mission: Mission) -> Polar | None:
    """Return the polar that the simulated boat sails by, None for the simulator's own hull."""
    return None if mission.boat.polar == OWN else polar_of(mission)


def recentre_m(mission: Mission) -> float:
    """Return how far the simulated boat's metres serve: those of a passage as far as the companion's [m]."""
    return (mission.passage.recentre_m or RECENTRE_M) if mission.is_passage else FRAME_M

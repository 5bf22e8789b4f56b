"""The world: wind, and boats as physics."""

from sitl.world.boats import LENGTH_M, SimulatedVaimos, habits_for, polar_at, summary, wind_for
from sitl.world.environment import (
    AR1,
    Constant,
    CurrentModel,
    Gusty,
    Later,
    Lee,
    Process,
    Recorded,
    Scripted,
    Waters,
    WindEvent,
    WindModel,
    parse_wind,
)

__all__ = [
    "AR1",
    "LENGTH_M",
    "Constant",
    "CurrentModel",
    "Gusty",
    "Later",
    "Lee",
    "Process",
    "Recorded",
    "Scripted",
    "SimulatedVaimos",
    "Waters",
    "WindEvent",
    "WindModel",
    "habits_for",
    "parse_wind",
    "polar_at",
    "summary",
    "wind_for",
]

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
from sitl.world.forecast import Blown, ForecastField, beneath
from sitl.world.seabed import LEAST_M, MOST_M, Bank, Seabed, SimulatedSounder, Tide

__all__ = [
    "AR1",
    "LEAST_M",
    "LENGTH_M",
    "MOST_M",
    "Bank",
    "Blown",
    "Constant",
    "CurrentModel",
    "ForecastField",
    "Gusty",
    "Later",
    "Lee",
    "Process",
    "Recorded",
    "Scripted",
    "Seabed",
    "SimulatedSounder",
    "SimulatedVaimos",
    "Tide",
    "Waters",
    "WindEvent",
    "WindModel",
    "beneath",
    "habits_for",
    "parse_wind",
    "polar_at",
    "summary",
    "wind_for",
]

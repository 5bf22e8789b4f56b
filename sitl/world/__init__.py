"""The world: wind, boats as physics, the air that radios share."""

from sitl.world.afloat import LENGTH_M, Afloat, habits_for, polar_at, summary, wind_for
from sitl.world.air import Air
from sitl.world.motorboat import MotorBoat
from sitl.world.waters import Gusty, Lee, Stream, Waters
from sitl.world.wind import AR1, Constant, Event, Later, Process, Recorded, Scripted, Wind, parse_wind

__all__ = [
    "AR1", "LENGTH_M", "Afloat", "Air", "Constant", "Event", "Gusty", "Later", "Lee", "MotorBoat", "Process",
    "Recorded", "Scripted", "Stream", "Waters", "Wind", "habits_for", "parse_wind", "polar_at", "summary", "wind_for",
]

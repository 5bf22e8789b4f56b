"""The world: wind, boats as physics, the air that radios share."""

from sitl.world.afloat import LENGTH_M, Afloat, habits_for, polar_at, summary, wind_for
from sitl.world.air import Air
from sitl.world.motorboat import MotorBoat
from sitl.world.wind import AR1, Constant, Event, Recorded, Scripted, Wind, parse_wind

__all__ = [
    "AR1", "LENGTH_M", "Afloat", "Air", "Constant", "Event", "MotorBoat", "Recorded", "Scripted", "Wind", "habits_for",
    "parse_wind", "polar_at", "summary", "wind_for",
]

"""The real ArduRover: its program, and sailing it in our weather."""

from sitl.ardurover.program import URL, fetch, fetched_path, require
from sitl.ardurover.simulation import MOTOR, ArduRover

__all__ = ["MOTOR", "URL", "ArduRover", "fetch", "fetched_path", "require"]

"""The real ArduRover: its program, and sailing it in our weather."""

from sitl.ardurover.simulation import MOTOR, URL, ArduRover, fetch, fetched_path, require

__all__ = ["MOTOR", "URL", "ArduRover", "fetch", "fetched_path", "require"]

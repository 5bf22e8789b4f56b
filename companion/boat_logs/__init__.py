"""Logs of a boat as one value each: voyage folders, .tlog, .BIN, CSV and NMEA 0183.

What cannot be used is said and skipped: a log without wind, one of two boats, one that another program cut off. Time
is the autopilot's own where there is one, because the clock of whoever wrote the log may jump.
"""

from companion.boat_logs.read import ReadLog, Skipped, logs_under, read_logs, read_wind, why_none
from companion.boat_logs.steering import read_steering

__all__ = ["ReadLog", "Skipped", "logs_under", "read_logs", "read_steering", "read_wind", "why_none"]

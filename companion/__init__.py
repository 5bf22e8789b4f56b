"""The companion of an autonomous sailboat: wind, planning and a skipper beside ArduPilot."""

__version__ = "0.3.0"

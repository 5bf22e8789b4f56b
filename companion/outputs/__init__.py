"""What other displays are told of a voyage: NMEA 0183 for OpenCPN and its like, Signal K for a boat's server."""

from companion.outputs.outputs import Outputs, checked_displays

__all__ = ["Outputs", "checked_displays"]

"""What other displays are told of a voyage: NMEA 0183 for OpenCPN and its like, Signal K for a boat's server."""

from companion.outputs.outputs import DisplayOptions, Outputs, wanted

__all__ = ["DisplayOptions", "Outputs", "wanted"]

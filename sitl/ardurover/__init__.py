"""The real ArduRover: its program, and sailing it in our weather."""

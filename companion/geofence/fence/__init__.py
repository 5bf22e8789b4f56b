"""The autopilot's own fence: an area in the few items that it holds, and the proof of them."""

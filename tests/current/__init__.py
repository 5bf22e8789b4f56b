"""The current: told by the track, expected by the mission, and the wind over the water."""

"""The clairvoyant: the best that a boat could have made of a wind, had she known it."""

from sitl.clairvoyant.best import best
from sitl.clairvoyant.race import Best, Craft, Goal, Race, Weather

__all__ = ["Best", "Craft", "Goal", "Race", "Weather", "best"]

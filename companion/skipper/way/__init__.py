"""The way: the voyage's goals and gates, legs and points, what a path is worth in a wind. Values and geometry."""

from companion.skipper.way.gates import gates_of
from companion.skipper.way.geometry import cross_track_m, moved
from companion.skipper.way.judge import half_width_rad, mean_twd_rad
from companion.skipper.way.sweeps import Sweep, length_m, sweeps_over
from companion.skipper.way.voyage import FAR_M, Box, Composed, Goal, Line, PointEn, Refuge, Search, Side, Until, Voyage

__all__ = [
    "FAR_M", "Box", "Composed", "Goal", "Line", "PointEn", "Refuge", "Search", "Side", "Sweep", "Until", "Voyage",
    "cross_track_m", "gates_of", "half_width_rad", "length_m", "mean_twd_rad", "moved", "sweeps_over",
]

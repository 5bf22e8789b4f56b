"""The way: the voyage's goals and gates, legs and points, what a path is worth in a wind. Values and geometry."""

from companion.skipper.way.drying import TIDE_DOUBT_M, DryingWater, timed
from companion.skipper.way.gates import KEEP_SHARE, SAME_M, Approach, Gate, gates_of, is_dead_end, no_room
from companion.skipper.way.geometry import along_m, bearing_rad, cross_track_m, distance_m, moved
from companion.skipper.way.judge import half_width_rad, mean_twd_rad
from companion.skipper.way.sweeps import Sweep, length_m, sweeps_over
from companion.skipper.way.voyage import (
    Box,
    Composed,
    Goal,
    Line,
    PointEn,
    Refuge,
    Search,
    Side,
    Until,
    Voyage,
    water_at,
)

__all__ = [
    "KEEP_SHARE",
    "SAME_M",
    "TIDE_DOUBT_M",
    "Approach",
    "Box",
    "Composed",
    "DryingWater",
    "Gate",
    "Goal",
    "Line",
    "PointEn",
    "Refuge",
    "Search",
    "Side",
    "Sweep",
    "Until",
    "Voyage",
    "along_m",
    "bearing_rad",
    "cross_track_m",
    "distance_m",
    "gates_of",
    "half_width_rad",
    "is_dead_end",
    "length_m",
    "mean_twd_rad",
    "moved",
    "no_room",
    "sweeps_over",
    "timed",
    "water_at",
]

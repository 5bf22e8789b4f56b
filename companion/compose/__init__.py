"""From a mission file to the values that the rooms want: boat, voyage, skipper, planner, wind and water."""

from companion.compose.boat import boat_of, polar_of
from companion.compose.links import displays_of, feeds_of, target_limits_of
from companion.compose.planner import planner_of
from companion.compose.skipper import config_of, permissions_of
from companion.compose.voyage import RECENTRE_M, voyage_of, waters_of
from companion.compose.water import water_of
from companion.compose.wind import estimator_of

__all__ = [
    "RECENTRE_M",
    "boat_of",
    "config_of",
    "displays_of",
    "estimator_of",
    "feeds_of",
    "permissions_of",
    "planner_of",
    "polar_of",
    "target_limits_of",
    "voyage_of",
    "water_of",
    "waters_of",
]

"""Planning under way: why, from where, with which step of the ladder, and what is done with the answer."""

from companion.skipper.planning.diversions import LACK_M
from companion.skipper.planning.next_tack import FOLLOWS, next_tack, next_tack_s, on_leg
from companion.skipper.planning.statement import aim_near, planned_forecast
from companion.skipper.planning.track import straight_track_m
from companion.skipper.planning.vessels import (
    ALIKE_S,
    GIVE_UP_RISK,
    HORIZON_S,
    OWN_TIMING_MPS,
    PART_BY_RUNG,
    SETTLED_M,
    soon,
)
from companion.skipper.step.route import HOME_RADIUS_M

__all__ = [
    "ALIKE_S",
    "FOLLOWS",
    "GIVE_UP_RISK",
    "HOME_RADIUS_M",
    "HORIZON_S",
    "LACK_M",
    "OWN_TIMING_MPS",
    "PART_BY_RUNG",
    "SETTLED_M",
    "aim_near",
    "next_tack",
    "next_tack_s",
    "on_leg",
    "planned_forecast",
    "soon",
    "straight_track_m",
]

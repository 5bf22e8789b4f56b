"""The rules of the road between our sailboat and another vessel: COLREGs 12, 13 and 18 (14, 15 under power).

This says what the rules say; it does not steer (``companion.traffic.encounters`` holds it through an encounter). The
default policy keeps clear of everyone: a boat of a metre is not seen, and "right of way is not an acceptable excuse"
(WRSC).
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from companion.geo.angles import difference_rad, wrap_pi
from companion.traffic.approach import Alarm, Approach, OwnShip
from companion.traffic.vessel import (
    BY_DRAUGHT,
    FISHING,
    NOT_UNDER_COMMAND,
    RESTRICTED,
    STOPPED_STATUS,
    TYPE_FISHING,
    TYPE_SAILING,
    UNDER_SAIL,
    Vessel,
)

# Rule 13(b): overtaking is coming up from more than 22.5 degrees abaft the other's beam.
OVERTAKING_RAD = math.radians(112.5)
# Rule 14 gives no number; half a point each side of right ahead is the usual reading.
HEAD_ON_RAD = math.radians(6.0)


class Rule(enum.Enum):
    """Which rule governs."""

    NONE = "none"               # not under way, or not known enough
    SAILING = "12"
    OVERTAKING = "13"
    HEAD_ON = "14"
    CROSSING = "15"
    RESPONSIBILITIES = "18"


class Role(enum.Enum):
    """What the rule asks of us."""

    GIVE_WAY = "give way"
    STAND_ON = "stand on"
    BOTH_ALTER = "both alter to starboard"
    KEEP_CLEAR = "keep clear"   # of what does not move, and of what is not known


class Policy(enum.Enum):
    """How we act on it."""

    KEEP_CLEAR = "keep clear"   # of everyone, whatever the rules give us
    RULES = "rules"             # stand on where they say so, until the alarm says ACT (rule 17)


@dataclass(frozen=True, slots=True, kw_only=True)
class Encounter:
    """The rule, our role, and why, in words for the status."""

    rule: Rule
    role: Role
    reason: str

    def must_act(self, alarm: Alarm, policy: Policy = Policy.KEEP_CLEAR) -> bool:
        """Must we keep out of its way now?"""
        if alarm is Alarm.NONE:
            return False
        return policy is Policy.KEEP_CLEAR or self.role is not Role.STAND_ON or alarm >= Alarm.ACT


def is_sailing_vessel(vessel: Vessel) -> bool:
    """Is it under sail, as far as AIS says? Type 36 without a status counts, a status of motoring (0) does not."""
    if vessel.nav_status == UNDER_SAIL:
        return True
    return vessel.ship_type == TYPE_SAILING and vessel.nav_status in {None, 15}


def classify(own: OwnShip, vessel: Vessel, approach: Approach, twd_from_rad: float | None) -> Encounter:
    """Return which rule governs and who gives way.

    Rule 13 comes first (it overrides 12 and 18), then 18, then 12 between two sailing vessels.

    Args:
        own: our boat; without a heading its course over ground serves.
        vessel: the other.
        approach: of the two, for the bearing.
        twd_from_rad: where the wind comes from; None leaves rule 12 on the safe side.

    """
    if vessel.nav_status in STOPPED_STATUS or (vessel.speed_mps is not None and vessel.speed_mps < 0.1):
        return Encounter(rule=Rule.NONE, role=Role.KEEP_CLEAR, reason="it is not moving")
    theirs, ours = vessel.bow_rad, own.heading_rad
    if ours is None and own.speed_mps >= 0.3:
        ours = math.atan2(*own.velocity_en_mps)
    if theirs is None or ours is None or not vessel.is_moving_known:
        return Encounter(rule=Rule.NONE, role=Role.KEEP_CLEAR, reason="a heading is not known")
    overtaking = _overtaking(own, vessel, approach, ours, theirs)
    if overtaking is not None:
        return overtaking
    if own.is_sailing:
        above = _above_sail(vessel)
        if above:
            return Encounter(rule=Rule.RESPONSIBILITIES, role=Role.GIVE_WAY, reason=above)
        if is_sailing_vessel(vessel):
            return _two_sails(approach, ours, theirs, twd_from_rad)
        if vessel.ship_type is None and vessel.nav_status is None:
            return Encounter(rule=Rule.RESPONSIBILITIES, role=Role.KEEP_CLEAR, reason="its kind is not known")
        return Encounter(rule=Rule.RESPONSIBILITIES, role=Role.STAND_ON, reason="power gives way to sail")
    return _under_power(vessel, approach, ours, theirs)


def _overtaking(own: OwnShip, vessel: Vessel, approach: Approach, ours: float, theirs: float) -> Encounter | None:
    """Return the verdict of rule 13, or None where nobody overtakes."""
    if not approach.is_closing:
        return None
    from_them = abs(difference_rad(approach.bearing_rad + math.pi, theirs))
    from_us = abs(difference_rad(approach.bearing_rad, ours))
    their_speed = vessel.speed_mps or 0.0
    if from_them > OVERTAKING_RAD and own.speed_mps > their_speed * max(0.0, math.cos(theirs - ours)):
        return Encounter(rule=Rule.OVERTAKING, role=Role.GIVE_WAY, reason="we are overtaking it")
    if from_us > OVERTAKING_RAD and their_speed > own.speed_mps * max(0.0, math.cos(theirs - ours)):
        return Encounter(rule=Rule.OVERTAKING, role=Role.STAND_ON, reason="it is overtaking us")
    return None


def _above_sail(vessel: Vessel) -> str:
    if vessel.nav_status == NOT_UNDER_COMMAND:
        return "it is not under command"
    if vessel.nav_status == RESTRICTED:
        return "it is restricted in its ability to manoeuvre"
    if vessel.nav_status == FISHING or (vessel.ship_type == TYPE_FISHING and vessel.nav_status is None):
        return "it is fishing"
    if vessel.nav_status == BY_DRAUGHT:
        return "it is constrained by its draught: do not impede"
    return ""


def wind_side(heading_rad: float, twd_from_rad: float) -> str:
    """Return the side that the wind comes from: the tack."""
    return "starboard" if difference_rad(twd_from_rad, heading_rad) > 0.0 else "port"


def _two_sails(approach: Approach, ours: float, theirs: float, twd_from_rad: float | None) -> Encounter:
    if twd_from_rad is None:
        return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason="the wind is not known")
    tack = wind_side(ours, twd_from_rad)
    # Close to head to wind or dead before it her tack cannot be told from her heading.
    unsure = abs(math.sin(difference_rad(twd_from_rad, theirs))) < math.sin(math.radians(10.0))
    if unsure and tack == "port":
        return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason="we are on port tack and unsure of hers")
    other = wind_side(theirs, twd_from_rad)
    if tack != other:
        if tack == "port":
            return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason="we are on port tack, she on starboard")
        return Encounter(rule=Rule.SAILING, role=Role.STAND_ON, reason="she is on port tack, we on starboard")
    # Same side: the one to windward gives way. We are to windward when the wind blows from us to her.
    down = math.cos(wrap_pi(approach.bearing_rad - (twd_from_rad + math.pi)))
    if down >= 0.0:
        return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason=f"both on {tack} tack, we are to windward")
    return Encounter(rule=Rule.SAILING, role=Role.STAND_ON, reason=f"both on {tack} tack, she is to windward")


def _under_power(vessel: Vessel, approach: Approach, ours: float, theirs: float) -> Encounter:
    above = _above_sail(vessel)
    if above or is_sailing_vessel(vessel):
        return Encounter(rule=Rule.RESPONSIBILITIES, role=Role.GIVE_WAY, reason=above or "she is under sail")
    relative = difference_rad(approach.bearing_rad, ours)
    if abs(relative) < HEAD_ON_RAD and abs(difference_rad(theirs, ours + math.pi)) < 2.0 * HEAD_ON_RAD:
        return Encounter(rule=Rule.HEAD_ON, role=Role.BOTH_ALTER, reason="meeting end on")
    if 0.0 <= relative < OVERTAKING_RAD:
        return Encounter(rule=Rule.CROSSING, role=Role.GIVE_WAY, reason="she is on our starboard side")
    return Encounter(rule=Rule.CROSSING, role=Role.STAND_ON, reason="she is on our port side")

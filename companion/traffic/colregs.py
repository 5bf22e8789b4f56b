"""The rules of the road between our sailboat and another vessel: COLREGs 12, 13 and 18 (14, 15 under power).

This says what the rules say; it does not steer (``companion.traffic.colregs`` holds it through an encounter). The
default policy keeps clear of everyone: a boat of a metre is not seen, and "right of way is not an acceptable excuse"
(WRSC).
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from companion.geo.angles import difference_rad, direction, wrap_pi
from companion.traffic.approach import Alarm, AlarmLimits, ClosestApproach, OwnShip, alarm_of, cpa
from companion.traffic.predict import MotionUncertainty, motion_of
from companion.traffic.targets import TrafficPicture
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

    NONE = "none"  # not under way, or not known enough
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
    KEEP_CLEAR = "keep clear"  # of what does not move, and of what is not known


class Policy(enum.Enum):
    """How we act on it."""

    KEEP_CLEAR = "keep clear"  # of everyone, whatever the rules give us
    RULES = "rules"  # stand on where they say so, until the alarm says ACT (rule 17)


@dataclass(frozen=True, slots=True, kw_only=True)
class Encounter:
    """The rule, our role, and why, in words for the status."""

    rule: Rule
    role: Role
    reason: str


def is_sailing_vessel(vessel: Vessel) -> bool:
    """Return whether AIS says it sails. Type 36 without a status counts, a status of motoring (0) does not."""
    if vessel.nav_status == UNDER_SAIL:
        return True
    return vessel.ship_type == TYPE_SAILING and vessel.nav_status in {None, 15}


def classify(own: OwnShip, vessel: Vessel, approach: ClosestApproach, twd_from_rad: float | None) -> Encounter:
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


def _overtaking(
    own: OwnShip, vessel: Vessel, approach: ClosestApproach, ours: float, theirs: float
) -> Encounter | None:
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


def _two_sails(approach: ClosestApproach, ours: float, theirs: float, twd_from_rad: float | None) -> Encounter:
    if twd_from_rad is None:
        return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason="the wind is not known")
    tack = wind_side(ours, twd_from_rad)
    # Close to head to wind or dead before it a vessel's tack cannot be told from its heading.
    unsure = abs(math.sin(difference_rad(twd_from_rad, theirs))) < math.sin(math.radians(10.0))
    if unsure and tack == "port":
        return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason="we are on port tack and unsure of hers")
    other = wind_side(theirs, twd_from_rad)
    if tack != other:
        if tack == "port":
            return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason="we are on port tack, she on starboard")
        return Encounter(rule=Rule.SAILING, role=Role.STAND_ON, reason="she is on port tack, we on starboard")
    # Same side: the one to windward gives way. We are to windward when the wind blows from us to the other.
    down = math.cos(wrap_pi(approach.bearing_rad - (twd_from_rad + math.pi)))
    if down >= 0.0:
        return Encounter(rule=Rule.SAILING, role=Role.GIVE_WAY, reason=f"both on {tack} tack, we are to windward")
    return Encounter(rule=Rule.SAILING, role=Role.STAND_ON, reason=f"both on {tack} tack, she is to windward")


def _under_power(vessel: Vessel, approach: ClosestApproach, ours: float, theirs: float) -> Encounter:
    above = _above_sail(vessel)
    if above or is_sailing_vessel(vessel):
        return Encounter(rule=Rule.RESPONSIBILITIES, role=Role.GIVE_WAY, reason=above or "she is under sail")
    relative = difference_rad(approach.bearing_rad, ours)
    if abs(relative) < HEAD_ON_RAD and abs(difference_rad(theirs, ours + math.pi)) < 2.0 * HEAD_ON_RAD:
        return Encounter(rule=Rule.HEAD_ON, role=Role.BOTH_ALTER, reason="meeting end on")
    if 0.0 <= relative < OVERTAKING_RAD:
        return Encounter(rule=Rule.CROSSING, role=Role.GIVE_WAY, reason="she is on our starboard side")
    return Encounter(rule=Rule.CROSSING, role=Role.STAND_ON, reason="she is on our port side")


# The picture judged: each vessel's approach, alarm and rule, the worst first.


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment:
    """One vessel seen from our boat."""

    vessel: Vessel
    approach: ClosestApproach
    alarm: Alarm
    encounter: Encounter
    age_s: float

    def sentence(self) -> str:
        """Return one line for the status."""
        a = self.approach
        kind = self.alarm.name.lower() if self.alarm is not Alarm.NONE else "clear"
        when = f"in {a.time_s:.0f} s" if a.is_closing else "opening"
        return (
            f"{self.vessel.label}: {kind}, {a.now_m:.0f} m at {direction(a.bearing_rad)}°, "
            f"CPA {a.distance_m:.0f} m {when}, "
            f"{self.encounter.role.value} (rule {self.encounter.rule.value}: {self.encounter.reason}), "
            f"report {self.age_s:.0f} s old"
        )


def assess(
    own: OwnShip, picture: TrafficPicture, limits: AlarmLimits, twd_from_rad: float | None = None
) -> tuple[Assessment, ...]:
    """Return every vessel's assessment, the worst alarm first, then the nearest approach, then the soonest."""
    out = []
    for vessel in picture.vessels:
        approach = cpa(own, vessel, picture.t_s)
        encounter = classify(own, vessel, approach, twd_from_rad)
        # An old report's spread counts against us: a stale track must not look safe. One sigma is taken off.
        alarm = alarm_of(approach, limits, growth_m=approach.sigma_m if picture.age_s(vessel) > 30.0 else 0.0)
        out.append(
            Assessment(vessel=vessel, approach=approach, alarm=alarm, encounter=encounter, age_s=picture.age_s(vessel))
        )
    return tuple(
        sorted(out, key=lambda x: (-x.alarm, x.approach.distance_m, x.approach.time_s, x.vessel.mmsi, x.vessel.branch))
    )


# Encounters under the rules of the road: what the rules ask of us, held from the beginning to past and clear.
#
# An encounter begins when both vessels, going on as they do, would come nearer than is safe (rule 7), and ends when
# they draw apart, and would on their first courses. What the rules gave at its beginning stays: an overtaking vessel
# remains one however the bearing changes (rule 13 d), and nobody's turn makes a give-way vessel of the other. Between
# two sailing vessels a tack of ours is judged anew.
#
# Where we stand on we keep course and speed (rule 17 a i) until the other has evidently not acted, that is until no
# more time is left than we need to get clear by ourselves (rule 17 a ii and b).

SOON_S = 300.0  # an approach later than this is no risk of collision yet
OVER_S = 5.0  # for so long they have drawn apart, and would on their first courses: past and clear
LEFT_S = 120.0  # for so long the other has drawn away on its own course: it does not come back
# Getting clear by ourselves: seeing it, a plan, its upload and the turn; then a way that is not straight across.
REACTION_S, DETOUR = 15.0, 1.5
SLOW_MPS = 1.0
# A change of course that is readily apparent (rule 8 b). The rule has no number: 30 degrees is the usual reading; once
# the lesser of these shows, the change is made.
APPARENT_RAD, SHOWN_RAD = math.radians(30.0), math.radians(24.0)
ACTS_RAD, OTHER_ACTS_CPA = math.radians(15.0), 0.4  # turned by this much; then this share of the distance does
TACK_RAD = math.radians(10.0)  # nearer to the wind's line than this a tack is not told from a heading

# Who stands on is bound to keep course and speed (rule 17), and who should give way and does not has shown that it
# keeps them: in an encounter no vessel is expected to wander. Reports that say otherwise make another plan.
HOLDING = MotionUncertainty(speed_mps=0.3, course_rad=math.radians(2.0), accel_mps2=0.01, turn_radps=math.radians(0.05))


def expected(vessel: Vessel) -> MotionUncertainty:
    """Return how surely a vessel in an encounter keeps course and speed: as its class does, or better."""
    usual = motion_of(vessel)
    return usual if vessel.is_stopped or usual.course_rad < HOLDING.course_rad else HOLDING


@dataclass(frozen=True, slots=True, kw_only=True)
class OngoingEncounter:
    """An encounter under way.

    Attributes:
        mmsi, branch: with whom.
        label: the other's name or number.
        encounter: what the rules gave when it began.
        since_s: when it began.
        course_rad: ours then, over ground.
        side: where the other was then: "ahead", "port", "starboard" or "astern".
        other_course_rad: the other's then; None where it was not known.
        tacks: ours and the other's, "" where it cannot be told.
        must_act: we must keep out of the other's way now.
        evident: we stood on and the other evidently does not act: it is for us to get clear now.
        altered: our change of course is apparent.
        cpa_m: how near both would come, going on as they do now.
        apart_s: since when the vessels draw apart.

    """

    mmsi: int
    branch: int
    label: str
    encounter: Encounter
    since_s: float
    course_rad: float
    side: str
    other_course_rad: float | None = None
    tacks: tuple[str, str] = ("", "")
    must_act: bool = False
    evident: bool = False
    altered: bool = False
    cpa_m: float = math.inf
    apart_s: float | None = None

    @property
    def stands_on(self) -> bool:
        """Do we keep course and speed because of the other?"""
        return not self.must_act and self.encounter.role is Role.STAND_ON

    @property
    def gives_way(self) -> bool:
        """Do the rules want us to keep out of the other's way, early and by much (rules 8 and 16)?"""
        return self.must_act and not self.evident and self.encounter.role is not Role.KEEP_CLEAR

    @property
    def not_to_port(self) -> bool:
        """Must a change of course not be to port (rules 14 and 17 c)? Rules of power-driven vessels."""
        if self.encounter.rule is Rule.HEAD_ON:
            return True
        return self.encounter.rule is Rule.CROSSING and self.evident and self.side == "port"

    def sentence(self, approach: ClosestApproach) -> str:
        """Return one line: who, where from, what the rules give and what we do."""
        rule = f"rule {self.encounter.rule.value}: {self.encounter.reason}"
        where = {"ahead": "comes from ahead", "astern": "comes from astern"}.get(self.side, f"crosses from {self.side}")
        if self.encounter.rule is Rule.OVERTAKING and self.encounter.role is Role.GIVE_WAY:
            where = "is being overtaken"
        if self.evident:
            does = "she does not give way, acting now (rule 17)"
        elif self.encounter.role is Role.STAND_ON:
            does = "standing on"
        else:
            does = self.encounter.role.value
        return f"{self.label} {where}: {does} ({rule}); CPA {approach.distance_m:.0f} m in {approach.time_s:.0f} s"


def act_limits(own: OwnShip, vessel: Vessel, clearance_m: float, *, other_acts: bool = False) -> AlarmLimits:
    """Return when an approach is an encounter, and when a vessel that stands on must act by itself.

    Where the other has turned, how near it then passes is its choice, as long as it is not too near.
    """
    way_m = DETOUR * (clearance_m + own.radius_m + vessel.reach_m)
    return AlarmLimits(
        warn_cpa_m=clearance_m,
        warn_tcpa_s=SOON_S,
        act_cpa_m=clearance_m * (OTHER_ACTS_CPA if other_acts else 1.0),
        act_tcpa_s=REACTION_S + way_m / max(own.speed_mps, SLOW_MPS),
    )


def follow(
    held: Sequence[OngoingEncounter],
    own: OwnShip,
    seen: Sequence[Assessment],
    *,
    t_s: float,
    clearance_m: float,
    twd_from_rad: float | None,
) -> tuple[OngoingEncounter, ...]:
    """Return the encounters after a look round.

    Args:
        held: the encounters so far.
        own: our boat; one that hardly moves meets nobody.
        seen: every vessel in view.
        t_s: now.
        clearance_m: between hulls, what is safe.
        twd_from_rad: where the wind comes from.

    """
    known = {(h.mmsi, h.branch): h for h in held}
    out = []
    for one in seen:
        before = known.get((one.vessel.mmsi, one.vessel.branch))
        after = (
            _begun(own, one, clearance_m, t_s, twd_from_rad)
            if before is None
            else (_gone_on(before, own, one, t_s, twd_from_rad))
        )
        if after is not None:
            out.append(_judged(after, own, one, clearance_m))
    return tuple(sorted(out, key=lambda h: (h.mmsi, h.branch)))


def _begun(
    own: OwnShip, one: Assessment, clearance_m: float, t_s: float, twd_from_rad: float | None
) -> OngoingEncounter | None:
    a = one.approach
    doubt_m = min(a.sigma_m, clearance_m)
    if own.speed_mps < 0.5 * SLOW_MPS or not a.is_closing or a.time_s > SOON_S or a.distance_m > clearance_m + doubt_m:
        return None
    course = math.atan2(*own.velocity_en_mps)
    return OngoingEncounter(
        mmsi=one.vessel.mmsi,
        branch=one.vessel.branch,
        label=one.vessel.label,
        encounter=one.encounter,
        since_s=t_s,
        course_rad=course,
        side=_side(difference_rad(a.bearing_rad, course)),
        other_course_rad=one.vessel.course_rad,
        tacks=_tacks(own, one.vessel, twd_from_rad),
    )


def _gone_on(
    held: OngoingEncounter, own: OwnShip, one: Assessment, t_s: float, twd_from_rad: float | None
) -> OngoingEncounter | None:
    a = one.approach
    if a.is_closing:
        held = replace(held, apart_s=None)
    elif held.apart_s is None:
        held = replace(held, apart_s=t_s)
    elif t_s - held.apart_s >= (LEFT_S if _meets_again(held, own, one.vessel, t_s) else OVER_S):
        return None
    if (
        own.speed_mps >= 0.5 * SLOW_MPS
        and abs(difference_rad(math.atan2(*own.velocity_en_mps), held.course_rad)) >= SHOWN_RAD
    ):
        held = replace(held, altered=True)
    tacks = _tacks(own, one.vessel, twd_from_rad)
    # The other's may change because it gives way: that relieves it of nothing.
    changed = bool(tacks[0]) and bool(held.tacks[0]) and tacks[0] != held.tacks[0]
    if held.encounter.rule is Rule.SAILING and changed and a.is_closing and not held.altered:
        return replace(held, encounter=one.encounter, tacks=tacks, evident=False)
    unknown = held.encounter.role is Role.KEEP_CLEAR and one.encounter.role is not Role.KEEP_CLEAR
    return replace(held, encounter=one.encounter) if unknown and not held.altered else held


def _meets_again(held: OngoingEncounter, own: OwnShip, vessel: Vessel, t_s: float) -> bool:
    """Would they close again, were both back on the courses that the encounter began on?"""
    if held.other_course_rad is None:
        return False
    back = replace(
        own, velocity_en_mps=(own.speed_mps * math.sin(held.course_rad), own.speed_mps * math.cos(held.course_rad))
    )
    return cpa(back, replace(vessel, course_rad=held.other_course_rad, heading_rad=None), t_s).is_closing


def _judged(held: OngoingEncounter, own: OwnShip, one: Assessment, clearance_m: float) -> OngoingEncounter:
    then, now = held.other_course_rad, one.vessel.course_rad
    other_acts = then is not None and now is not None and abs(difference_rad(now, then)) >= ACTS_RAD
    alarm = alarm_of(one.approach, act_limits(own, one.vessel, clearance_m, other_acts=other_acts))
    must_act = held.evident or held.encounter.role is not Role.STAND_ON or alarm >= Alarm.ACT
    return replace(
        held,
        must_act=must_act,
        evident=must_act and held.encounter.role is Role.STAND_ON,
        cpa_m=one.approach.distance_m,
    )


def _tacks(own: OwnShip, vessel: Vessel, twd_from_rad: float | None) -> tuple[str, str]:
    return _tack(own.heading_rad, twd_from_rad), _tack(vessel.bow_rad, twd_from_rad)


def _tack(heading_rad: float | None, twd_from_rad: float | None) -> str:
    if heading_rad is None or twd_from_rad is None:
        return ""
    if abs(math.sin(difference_rad(twd_from_rad, heading_rad))) < math.sin(TACK_RAD):
        return ""
    return wind_side(heading_rad, twd_from_rad)


def _side(relative_rad: float) -> str:
    if abs(relative_rad) < math.radians(6.0):
        return "ahead"
    if abs(relative_rad) > math.radians(112.5):
        return "astern"
    return "starboard" if relative_rad > 0.0 else "port"

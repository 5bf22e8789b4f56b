"""Encounters under the rules of the road: what the rules ask of us, held from the beginning to past and clear.

An encounter begins when both vessels, going on as they do, would come nearer than is safe (rule 7), and ends when they
draw apart, and would on their first courses. What the rules gave at its beginning stays: an overtaking vessel remains
one however the bearing changes (rule 13 d), and nobody's turn makes a give-way vessel of the other. Between two sailing
vessels a tack of ours is judged anew.

Where we stand on we keep course and speed (rule 17 a i) until the other has evidently not acted, that is until no
more time is left than we need to get clear by ourselves (rule 17 a ii and b).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from companion.geo.angles import difference_rad
from companion.traffic.approach import AlarmLimits, Approach, OwnShip, alarm_of, cpa
from companion.traffic.assess import Assessment
from companion.traffic.colregs import Encounter, Policy, Role, Rule, wind_side
from companion.traffic.predict import MotionUncertainty, motion_of
from companion.traffic.vessel import Vessel

SOON_S = 300.0               # an approach later than this is no risk of collision yet
OVER_S = 5.0                 # for so long they have drawn apart, and would on their first courses: past and clear
LEFT_S = 120.0               # for so long she has drawn away on a course of hers: she does not come back
# Getting clear by ourselves: seeing it, a plan, its upload and the turn; then a way that is not straight across.
REACTION_S, DETOUR = 15.0, 1.5
SLOW_MPS = 1.0
# A change of course that is readily apparent (rule 8 b). The rule has no number: 30 degrees is the usual reading; once
# the lesser of these shows, the change is made.
APPARENT_RAD, SHOWN_RAD = math.radians(30.0), math.radians(24.0)
ACTS_RAD, SHE_ACTS_CPA = math.radians(15.0), 0.4   # she has turned by this much; then this share of the distance does
TACK_RAD = math.radians(10.0)   # nearer to the wind's line than this a tack is not told from a heading

# Who stands on is bound to keep course and speed (rule 17), and who should give way and does not has shown that she
# keeps them: in an encounter no vessel is expected to wander. Reports that say otherwise make another plan.
HOLDING = MotionUncertainty(speed_mps=0.3, course_rad=math.radians(2.0), accel_mps2=0.01, turn_radps=math.radians(0.05))


def expected(vessel: Vessel) -> MotionUncertainty:
    """Return how surely a vessel in an encounter keeps course and speed: as her class does, or better."""
    usual = motion_of(vessel)
    return usual if vessel.is_stopped or usual.course_rad < HOLDING.course_rad else HOLDING


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """An encounter under way.

    Attributes:
        mmsi, branch: with whom.
        label: her name or number.
        encounter: what the rules gave when it began.
        since_s: when it began.
        course_rad: ours then, over ground.
        side: where she was then: "ahead", "port", "starboard" or "astern".
        her_course_rad: hers then; None where it was not known.
        tacks: ours and hers, "" where it cannot be told.
        must_act: we must keep out of her way now.
        evident: we stood on and she evidently does not act: it is for us to get clear now.
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
    her_course_rad: float | None = None
    tacks: tuple[str, str] = ("", "")
    must_act: bool = False
    evident: bool = False
    altered: bool = False
    cpa_m: float = math.inf
    apart_s: float | None = None

    @property
    def stands_on(self) -> bool:
        """Do we keep course and speed because of her?"""
        return not self.must_act and self.encounter.role is Role.STAND_ON

    @property
    def gives_way(self) -> bool:
        """Do the rules want us to keep out of her way, early and by much (rules 8 and 16)?"""
        return self.must_act and not self.evident and self.encounter.role is not Role.KEEP_CLEAR

    @property
    def not_to_port(self) -> bool:
        """Must a change of course not be to port (rules 14 and 17 c)? Rules of power-driven vessels."""
        if self.encounter.rule is Rule.HEAD_ON:
            return True
        return self.encounter.rule is Rule.CROSSING and self.evident and self.side == "port"

    def sentence(self, approach: Approach) -> str:
        """Return one line: who, where from, what the rules give and what we do."""
        rule = f"rule {self.encounter.rule.value}: {self.encounter.reason}"
        where = {"ahead": "comes from ahead", "astern": "comes from astern"}.get(
            self.side, f"crosses from {self.side}")
        if self.encounter.rule is Rule.OVERTAKING and self.encounter.role is Role.GIVE_WAY:
            where = "is being overtaken"
        if self.evident:
            does = "she does not give way, acting now (rule 17)"
        elif self.encounter.role is Role.STAND_ON:
            does = "standing on"
        else:
            does = self.encounter.role.value
        return (f"{self.label} {where}: {does} ({rule}); CPA {approach.distance_m:.0f} m in {approach.time_s:.0f} s")


def act_limits(own: OwnShip, vessel: Vessel, clearance_m: float, *, she_acts: bool = False) -> AlarmLimits:
    """Return when an approach is an encounter, and when a vessel that stands on must act by herself.

    Where the other has turned, how near she then passes is her choice, as long as it is not too near.
    """
    way_m = DETOUR * (clearance_m + own.radius_m + vessel.reach_m)
    return AlarmLimits(
        warn_cpa_m=clearance_m, warn_tcpa_s=SOON_S, act_cpa_m=clearance_m * (SHE_ACTS_CPA if she_acts else 1.0),
        act_tcpa_s=REACTION_S + way_m / max(own.speed_mps, SLOW_MPS))


def follow(
    held: Sequence[Held], own: OwnShip, seen: Sequence[Assessment], *, t_s: float, clearance_m: float,
    twd_from_rad: float | None, policy: Policy = Policy.RULES,
) -> tuple[Held, ...]:
    """Return the encounters after a look round.

    Args:
        held: the encounters so far.
        own: our boat; one that hardly moves meets nobody.
        seen: every vessel in view.
        t_s: now.
        clearance_m: between hulls, what is safe.
        twd_from_rad: where the wind comes from.
        policy: how we act on the rules.

    """
    known = {(h.mmsi, h.branch): h for h in held}
    out = []
    for one in seen:
        before = known.get((one.vessel.mmsi, one.vessel.branch))
        after = _begun(own, one, clearance_m, t_s, twd_from_rad) if before is None else (
            _gone_on(before, own, one, t_s, twd_from_rad))
        if after is not None:
            out.append(_judged(after, own, one, clearance_m, policy))
    return tuple(sorted(out, key=lambda h: (h.mmsi, h.branch)))


def _begun(
    own: OwnShip, one: Assessment, clearance_m: float, t_s: float, twd_from_rad: float | None,
) -> Held | None:
    a = one.approach
    doubt_m = min(a.sigma_m, clearance_m)
    if own.speed_mps < 0.5 * SLOW_MPS or not a.is_closing or a.time_s > SOON_S or a.distance_m > clearance_m + doubt_m:
        return None
    course = math.atan2(*own.velocity_en_mps)
    return Held(
        mmsi=one.vessel.mmsi, branch=one.vessel.branch, label=one.vessel.label, encounter=one.encounter, since_s=t_s,
        course_rad=course, side=_side(difference_rad(a.bearing_rad, course)),
        her_course_rad=one.vessel.course_rad, tacks=_tacks(own, one.vessel, twd_from_rad))


def _gone_on(held: Held, own: OwnShip, one: Assessment, t_s: float, twd_from_rad: float | None) -> Held | None:
    a = one.approach
    if a.is_closing:
        held = replace(held, apart_s=None)
    elif held.apart_s is None:
        held = replace(held, apart_s=t_s)
    elif t_s - held.apart_s >= (LEFT_S if _meets_again(held, own, one.vessel, t_s) else OVER_S):
        return None
    if own.speed_mps >= 0.5 * SLOW_MPS and abs(
            difference_rad(math.atan2(*own.velocity_en_mps), held.course_rad)) >= SHOWN_RAD:
        held = replace(held, altered=True)
    tacks = _tacks(own, one.vessel, twd_from_rad)
    # Hers may change because she gives way: that relieves her of nothing.
    changed = bool(tacks[0]) and bool(held.tacks[0]) and tacks[0] != held.tacks[0]
    if held.encounter.rule is Rule.SAILING and changed and a.is_closing and not held.altered:
        return replace(held, encounter=one.encounter, tacks=tacks, evident=False)
    unknown = held.encounter.role is Role.KEEP_CLEAR and one.encounter.role is not Role.KEEP_CLEAR
    return replace(held, encounter=one.encounter) if unknown and not held.altered else held


def _meets_again(held: Held, own: OwnShip, vessel: Vessel, t_s: float) -> bool:
    """Would they close again, were both back on the courses that the encounter began on?"""
    if held.her_course_rad is None:
        return False
    back = replace(own, velocity_en_mps=(
        own.speed_mps * math.sin(held.course_rad), own.speed_mps * math.cos(held.course_rad)))
    return cpa(back, replace(vessel, course_rad=held.her_course_rad, heading_rad=None), t_s).is_closing


def _judged(held: Held, own: OwnShip, one: Assessment, clearance_m: float, policy: Policy) -> Held:
    then, now = held.her_course_rad, one.vessel.course_rad
    she_acts = then is not None and now is not None and abs(difference_rad(now, then)) >= ACTS_RAD
    alarm = alarm_of(one.approach, act_limits(own, one.vessel, clearance_m, she_acts=she_acts))
    must_act = held.evident or held.encounter.role is not Role.STAND_ON or held.encounter.must_act(alarm, policy)
    return replace(held, must_act=must_act, evident=must_act and held.encounter.role is Role.STAND_ON,
                   cpa_m=one.approach.distance_m)


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

"""A status in 42 bytes: enough of the boat for who hears it every ten minutes, and what became of the last order."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.messages import GeoPoint
from companion.orders.far.order import REPLIES, SEAL_BYTES, STATUS, BitField, FarKey, Layout, Reply
from companion.orders.order import BY_VERB, Verb, verb_of
from companion.safety import number_of, watchdog_of

VERSION = 1
# The skipper's phases and the traffic's alarms in the order in which they were numbered: new ones go to the end.
PHASES = (
    "idle",
    "waiting",
    "standard",
    "new calculation",
    "destination approach",
    "buoy approach",
    "last resort",
    "holding",
    "operator",
    "done",
)
ALARMS = ("none", "warn", "act", "touch")
HEARD, ARMED, UNDER_WAY, TROUBLE = 1, 2, 4, 8
_NONE8, _NONE16, _NONE24, _NONE32 = 0xFF, 0xFFFF, 0xFFFFFF, -(1 << 31)
_NONE4 = 0xF

_METRE = BitField(name="goal_m", size=2, step=10.0, unit="10 m", unknown=_NONE16, says="to the goal sailed for")
_TO_WAYPOINT = BitField(name="waypoint_m", size=2, unit="m", unknown=_NONE16, says="to the autopilot's next waypoint")
_SPEED = BitField(name="sog", size=1, step=0.1, unit="0.1 m/s", unknown=_NONE8, says="speed over ground")
_TWD = BitField(
    name="twd",
    size=1,
    step=math.radians(2.0),
    unit="2 deg",
    unknown=_NONE8,
    circle=180,
    says="mean true wind, where from",
)
_TWS = BitField(name="tws", size=1, step=0.2, unit="0.2 m/s", unknown=_NONE8, says="mean true wind speed")
_SIGMA = BitField(
    name="sigma",
    size=1,
    step=math.radians(1.0),
    unit="deg",
    unknown=_NONE8,
    says="its direction's spread a minute ahead",
)
_AGE = BitField(name="plan_age", size=1, step=60.0, unit="min", unknown=_NONE8, says="since the plan was made")
_RISK = BitField(
    name="risk",
    size=1,
    step=1.0 / 250.0,
    unit="0.4 %",
    unknown=_NONE8,
    says="the plan's probability of not staying clear, at each instant",
)
_CLEAR = BitField(
    name="clearance",
    size=1,
    step=2.0,
    unit="2 m",
    unknown=_NONE8,
    says="from the hull to the nearest obstacle or fence",
)
_CPA = BitField(name="cpa", size=1, step=4.0, unit="4 m", unknown=_NONE8, says="closest approach of the worst vessel")
_BATTERY = BitField(name="battery", size=1, step=0.2, unit="0.2 V", unknown=_NONE8, says="voltage")
_GOAL = BitField(name="goal", size=1, unknown=_NONE8, says="the goal sailed for, from 1")
_GOALS = BitField(name="goals", size=1, unknown=_NONE8, says="goals in all")
_MINUTE = BitField(
    name="minute", size=3, unit="min since 2020-01-01 UTC", unknown=_NONE24, says="when, by the boat's clock"
)
_LAT = BitField(name="lat", size=4, is_signed=True, unit="1e-7 deg", unknown=_NONE32, says="position")
_LON = BitField(name="lon", size=4, is_signed=True, unit="1e-7 deg", unknown=_NONE32, says="position")

LAYOUT = Layout(
    (
        BitField(name="version", size=1, says=f"{VERSION}"),
        BitField(
            name="flags",
            size=1,
            says="1 the autopilot is heard, 2 armed, 4 under way, 8 the disk does not keep what it "
            "should; the upper four bits: the number of the order that stands, 0 none",
        ),
        _MINUTE,
        _LAT,
        _LON,
        _METRE,
        _TO_WAYPOINT,
        _SPEED,
        _TWD,
        _TWS,
        _SIGMA,
        BitField(name="phase", size=1, says=", ".join(f"{n} {word}" for n, word in enumerate(PHASES))),
        _GOAL,
        _GOALS,
        _AGE,
        _RISK,
        _CLEAR,
        _CPA,
        BitField(
            name="watchdog", size=1, says="the worst that is raised, 0 none: its number in [the table](watchdogs.md)"
        ),
        _BATTERY,
        BitField(name="order", size=2, unknown=0, says="the counter of the order that came last, 0: none has come"),
        BitField(
            name="reply",
            size=1,
            says="what became of it (lower four bits): "
            + ", ".join(f"{n} {word}" for n, word in enumerate(REPLIES, 1))
            + "; the traffic's alarm (upper four bits): "
            + ", ".join(f"{n} {word}" for n, word in enumerate(ALARMS))
            + f", {_NONE4} no vessel was ever heard",
        ),
        BitField(name="sequence", size=1, says="counts the statuses of one start, modulo 256: a gap is a loss"),
    )
)
SIZE = LAYOUT.size + SEAL_BYTES


@dataclass(frozen=True, slots=True, kw_only=True)
class FarStatus:
    """What is told; None, or an empty word, is not known. ``minute`` counts from 2020, ``goal`` from 1.

    ``order`` is the counter of the order that came last, ``reply`` what became of it; ``standing`` is the verb of the
    one that stands.
    """

    phase: str
    sequence: int = 0
    minute: int | None = None
    is_heard: bool = False
    is_armed: bool = False
    is_under_way: bool = False
    has_trouble: bool = False
    standing: Verb | None = None
    position: GeoPoint | None = None
    goal_m: float | None = None
    waypoint_m: float | None = None
    speed_mps: float | None = None
    twd_from_rad: float | None = None
    tws_mps: float | None = None
    twd_sigma_rad: float | None = None
    goal: int | None = None
    goals: int | None = None
    plan_age_s: float | None = None
    promised_risk: float | None = None
    clearance_m: float | None = None
    cpa_m: float | None = None
    alarm: str = ""
    watchdog: str = ""
    battery_v: float | None = None
    order: int | None = None
    reply: Reply | None = None


def pack_status(status: FarStatus, key: FarKey) -> bytes:
    """Return the 42 bytes of a status. What does not fit is told as the nearest that does."""
    here = status.position
    flags = (
        HEARD * status.is_heard
        | ARMED * status.is_armed
        | UNDER_WAY * status.is_under_way
        | (TROUBLE * status.has_trouble)
        | (0 if status.standing is None else BY_VERB[status.standing].number << 4)
    )
    alarm = ALARMS.index(status.alarm) if status.alarm else _NONE4
    reply = 0 if status.reply is None else REPLIES.index(status.reply) + 1
    return key.sealed(
        STATUS,
        LAYOUT.pack(
            {
                "version": VERSION,
                "flags": flags,
                "minute": _MINUTE.count(status.minute),
                "lat": _NONE32 if here is None else round(here.lat_deg * 1e7),
                "lon": _NONE32 if here is None else round(here.lon_deg * 1e7),
                "goal_m": _METRE.count(status.goal_m),
                "waypoint_m": _TO_WAYPOINT.count(status.waypoint_m),
                "sog": _SPEED.count(status.speed_mps),
                "twd": _TWD.count(status.twd_from_rad),
                "tws": _TWS.count(status.tws_mps),
                "sigma": _SIGMA.count(status.twd_sigma_rad),
                "phase": PHASES.index(status.phase),
                "goal": _GOAL.count(status.goal),
                "goals": _GOALS.count(status.goals),
                "plan_age": _AGE.count(status.plan_age_s),
                "risk": _RISK.count(status.promised_risk),
                "clearance": _CLEAR.count(status.clearance_m),
                "cpa": _CPA.count(status.cpa_m),
                "watchdog": number_of(status.watchdog),
                "battery": _BATTERY.count(status.battery_v),
                "order": status.order or 0,
                "reply": reply | alarm << 4,
                "sequence": status.sequence % 256,
            }
        ),
    )


def unpack_status(data: bytes, key: FarKey) -> FarStatus:
    """Return the status in 42 bytes.

    Raises:
        ValueError: it is none, or not of this boat; the sentence says why.
    """
    counts = LAYOUT.unpack(key.opened(STATUS, data, SIZE))
    if counts["version"] != VERSION:
        raise ValueError(f"it is of version {counts['version']}, and this is {VERSION}: another release made it")
    flags, alarm, reply = counts["flags"], counts["reply"] >> 4, counts["reply"] & 0xF
    standing = verb_of(flags >> 4) if flags >> 4 else None
    if (
        counts["phase"] >= len(PHASES)
        or reply > len(REPLIES)
        or (alarm >= len(ALARMS) and alarm != _NONE4)
        or (flags >> 4 and standing is None)
    ):
        raise ValueError("it has a phase, a reply, an alarm or an order that is not known: another release made it")
    minute, goal, goals = (field.value(counts[field.name]) for field in (_MINUTE, _GOAL, _GOALS))
    return FarStatus(
        phase=PHASES[counts["phase"]],
        sequence=counts["sequence"],
        minute=None if minute is None else int(minute),
        is_heard=bool(flags & HEARD),
        is_armed=bool(flags & ARMED),
        is_under_way=bool(flags & UNDER_WAY),
        has_trouble=bool(flags & TROUBLE),
        standing=standing,
        position=_point(counts["lat"], counts["lon"]),
        goal_m=_METRE.value(counts["goal_m"]),
        waypoint_m=_TO_WAYPOINT.value(counts["waypoint_m"]),
        speed_mps=_SPEED.value(counts["sog"]),
        twd_from_rad=_TWD.value(counts["twd"]),
        tws_mps=_TWS.value(counts["tws"]),
        twd_sigma_rad=_SIGMA.value(counts["sigma"]),
        goal=None if goal is None else int(goal),
        goals=None if goals is None else int(goals),
        plan_age_s=_AGE.value(counts["plan_age"]),
        promised_risk=_RISK.value(counts["risk"]),
        clearance_m=_CLEAR.value(counts["clearance"]),
        cpa_m=_CPA.value(counts["cpa"]),
        alarm="" if alarm == _NONE4 else ALARMS[alarm],
        watchdog=watchdog_of(counts["watchdog"]),
        battery_v=_BATTERY.value(counts["battery"]),
        order=counts["order"] or None,
        reply=REPLIES[reply - 1] if reply else None,
    )


def _point(lat_e7: int, lon_e7: int) -> GeoPoint | None:
    return None if _NONE32 in {lat_e7, lon_e7} else GeoPoint(lat_deg=lat_e7 / 1e7, lon_deg=lon_e7 / 1e7)

"""The view: one value that says all that is known of a voyage at a moment, whoever looks and however he heard of it.

It is a form for the outside, as a file is: angles are degrees, directions true and clockwise from north, and the wind's
is where it comes from. Places are metres east and north of the area's origin. What is not known is None, never 0. The
JSON form has these names; ``python -m companion.view.schema`` writes its schema and the page's types from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from companion.view.air import Laylines, NoGo, PointEn, Polar, Tack, Water, Wind

SCHEMA = "companion.view/1"

Source = Literal["live", "recorded", "radio"]
Level = Literal["critical", "error", "warning", "notice", "info"]
Grade = Literal["good", "poor", "bad", "unknown"]


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """What she does and why, in words; ``wants`` is what is missing for her to go on. ``age_s``: since it began."""

    phase: str
    why: str = ""
    task: str = ""
    age_s: float | None = None
    mode: str | None = None
    is_armed: bool | None = None
    is_sailing: bool | None = None
    is_over: bool | None = None
    has_arrived: bool | None = None
    is_planning: bool | None = None
    wants: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Something that somebody should look at: since ``age_s``."""

    code: str
    level: Level
    text: str
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Boat:
    """Where she is and how she moves. ``age_s``: of the position. ``cross_track_m`` is positive right of the leg."""

    age_s: float | None = None
    lat_deg: float | None = None
    lon_deg: float | None = None
    at_en_m: PointEn | None = None
    heading_deg: float | None = None
    cog_deg: float | None = None
    sog_mps: float | None = None
    roll_deg: float | None = None
    tack: Tack | None = None
    vmg_mps: float | None = None         # to windward, negative to leeward
    vmc_mps: float | None = None         # towards the goal
    clearance_m: float | None = None     # of the hull to the nearest obstacle or limit
    cross_track_m: float | None = None
    waypoint_m: float | None = None
    goal_m: float | None = None
    length_m: float | None = None
    battery_v: float | None = None
    battery_share: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A leg of the plan. ``starts_s`` and ``ends_s`` count from the plan; the last leg may be the loiter at the end."""

    from_en_m: PointEn
    to_en_m: PointEn
    is_done: bool = False
    is_loiter: bool = False
    is_beat: bool | None = None          # the autopilot beats it by itself
    course_deg: float | None = None
    twa_deg: float | None = None
    length_m: float | None = None
    speed_mps: float | None = None
    starts_s: float | None = None
    ends_s: float | None = None
    sigma_deg: float | None = None
    no_go_half_deg: float | None = None
    clearance_m: float | None = None     # beyond the margin, to the nearest obstacle or limit
    risk: float | None = None            # of being forced into the no-go zone, or too near to a vessel, on this leg
    manoeuvre: str = ""                  # the turn into it: tack, gybe or empty


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The plan that is sailed: ``legs`` from the one that is next; what was promised, why it was chosen."""

    number: int | None = None
    age_s: float | None = None
    reason: str = ""                     # why it was asked for
    why: str = ""
    rung: str = ""                       # the step of the ladder on which it was found; empty: as configured
    bound_for: str = ""
    twd_from_deg: float | None = None    # the wind that it was made for
    tws_mps: float | None = None
    delta_s: float | None = None
    promised_risk: float | None = None   # at each instant
    path_risk: float | None = None       # of the whole of it
    vessel_risk: float | None = None
    margin_m: float | None = None
    cost_s: float | None = None
    median_s: float | None = None        # there by then in half the winds of the forecast's spread ...
    late_s: float | None = None          # ... and in nine of ten
    expected_clearance_m: float | None = None   # of the hull on the track that is expected
    bound_s: float | None = None         # no plan is faster than that
    replans: int | None = None
    next_tack_s: float | None = None
    leg: int | None = None               # the leg that is sailed, from 1 ...
    count: int | None = None             # ... of so many
    legs: tuple[Leg, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Ahead:
    """Where she is expected ``in_s`` from now, and on which tack."""

    in_s: float
    at_en_m: PointEn
    tack: Tack | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackPoint:
    """Where she was, ``ago_s`` before."""

    ago_s: float
    at_en_m: PointEn
    tack: Tack | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Vessel:
    """Another vessel and the closest approach to her, hull to hull, if both go on; ``cpa_s`` None: she draws away."""

    name: str
    mmsi: int | None = None
    age_s: float | None = None
    at_en_m: PointEn | None = None
    course_deg: float | None = None
    speed_mps: float | None = None
    heading_deg: float | None = None
    length_m: float | None = None
    beam_m: float | None = None
    alarm: str = ""
    role: str = ""
    rule: str = ""
    range_m: float | None = None
    bearing_deg: float | None = None
    cpa_m: float | None = None
    cpa_s: float | None = None
    cpa_en_m: PointEn | None = None      # where she will be then ...
    own_cpa_en_m: PointEn | None = None  # ... and where we shall be


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A place on the chart."""

    name: str
    at_en_m: PointEn
    radius_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A goal of the voyage: a point, a buoy to round (``side``), a line, a box, a search, or a place of a field."""

    name: str
    kind: str
    at_en_m: PointEn
    radius_m: float | None = None
    side: str = ""
    line_en_m: tuple[PointEn, PointEn] | None = None
    is_next: bool | None = None
    is_reached: bool | None = None
    distance_m: float | None = None
    bearing_deg: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """The order that stands."""

    verb: str
    words: str
    by: str = ""
    at_en_m: PointEn | None = None
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Orders:
    """The order that stands, the last answer, and what the mission permits whoever may open the socket on board."""

    standing: Standing | None = None
    permitted: tuple[str, ...] | None = None
    answer: str = ""
    answer_age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """The voyage so far."""

    time_s: float | None = None
    distance_m: float | None = None
    tacks: int | None = None
    gybes: int | None = None
    plans: int | None = None
    replans: int | None = None
    contacts: int | None = None
    no_go_entries: int | None = None
    min_clearance_m: float | None = None
    promised_clearance_m: float | None = None   # the least that a plan expected which was sailed
    goals_reached: int | None = None
    goals: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """How a part of the whole is: when it was last heard of, and what is the matter with it."""

    name: str
    grade: Grade
    text: str = ""
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Everything at ``t_s`` (the voyage's own clock) and ``unix_s`` [s since 1970]; ``area`` is the hash of its Area.

    ``age_s`` is the age of the newest thing heard of the boat, at ``t_s``.
    """

    schema: str = SCHEMA
    source: Source
    name: str
    t_s: float
    unix_s: float | None = None
    age_s: float | None = None
    area: str | None = None
    state: State
    alarms: tuple[Alarm, ...] = ()
    boat: Boat = Boat()
    wind: Wind | None = None
    water: Water | None = None
    no_go: NoGo | None = None
    laylines: Laylines | None = None
    polar: Polar | None = None
    plan: Plan | None = None
    predicted: tuple[Ahead, ...] = ()
    track: tuple[TrackPoint, ...] = ()
    vessels: tuple[Vessel, ...] = ()
    goals: tuple[Goal, ...] = ()
    refuges: tuple[Place, ...] = ()
    home: Place | None = None
    safe_end: Place | None = None
    orders: Orders = Orders()
    figures: Figures = Figures()
    health: tuple[Part, ...] = ()

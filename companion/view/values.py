"""The view: one value that says all that is known of a voyage at a moment, whoever looks and however he heard of it.

It is a form for the outside, as a file is: angles are degrees, directions true and clockwise from north, and the wind's
is where it comes from. Places are metres east and north of the area's origin. What is not known is None, never 0. The
JSON form has these names; ``python -m bench.pages`` writes its schema and the page's types from here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Literal, overload

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift

PointEn = tuple[float, float]  # metres east and north of the area's origin
Tack = Literal["port", "starboard"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """The forecast at a horizon; ``half_deg``: half widths of the central intervals of ``Wind.levels``."""

    horizon_s: float
    twd_from_deg: float
    sigma_deg: float
    tws_mps: float
    tws_sigma_mps: float
    half_deg: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WindView:
    """The wind now (5 s mean), its 90 s mean, the forecast's quantiles; angles at the bow are positive to starboard.

    ``awa_deg`` and ``aws_mps`` follow from the true wind and the motion over ground. ``health`` is none, settling,
    good, light or untrusted, ``verdict`` says why it is not good.
    """

    health: str
    verdict: str = ""
    twd_from_deg: float | None = None
    tws_mps: float | None = None
    mean_twd_from_deg: float | None = None
    mean_tws_mps: float | None = None
    sigma_deg: float | None = None  # of the direction a minute ahead
    tws_sigma_mps: float | None = None
    twa_deg: float | None = None
    awa_deg: float | None = None
    aws_mps: float | None = None
    record_s: float | None = None
    correlation_s: float | None = None
    age_s: float | None = None
    levels: tuple[float, ...] = ()
    bands: tuple[Band, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WaterView:
    """The current: where it goes and how fast, the standard deviation in its most uncertain direction.

    ``is_planned``: it is strong and sure enough for plans to reckon with it; ``verdict`` says what is not known of it.
    ``twd_from_deg`` and ``tws_mps`` are the present wind over this water, which is what the boat sails by.
    """

    set_deg: float
    drift_mps: float
    sigma_mps: float | None = None
    is_planned: bool = False
    verdict: str = ""
    twd_from_deg: float | None = None
    tws_mps: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Wedge:
    """The no-go zone at a horizon: ``half_deg`` to either side of ``from_deg``, ``widening_deg`` of it the spread."""

    horizon_s: float
    from_deg: float
    half_deg: float
    widening_deg: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NoGo:
    """The no-go zone: the boat's own half angle, and with the wind's spread so that it holds with ``probability``."""

    half_deg: float
    probability: float
    wedges: tuple[Wedge, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Layline:
    """The course that fetches the mark on ``tack``, and how far it swings to either side with the wind."""

    tack: Tack
    course_deg: float
    swing_deg: float
    reach_s: float | None = None  # until the boat meets it on its present course; None: it does not


@dataclass(frozen=True, slots=True, kw_only=True)
class Laylines:
    """The laylines of a mark that is sailed to against the wind, or before it (``is_beat`` False)."""

    name: str
    mark_en_m: PointEn
    is_beat: bool
    angle_deg: float
    level: float  # probability of the swing's interval
    lines: tuple[Layline, ...] = ()


CARRIES_DEG = 8.0  # so much closer to the wind than her best angle a boat sails by the way that she has


@dataclass(frozen=True, slots=True, kw_only=True)
class PolarView:
    """The speed by true wind angle in the wind of ``tws_mps``: nodes, linear between; best angles; the boat on it.

    All of it over the water, in the current that is planned with.
    """

    name: str
    tws_mps: float
    twa_deg: tuple[float, ...]
    speed_mps: tuple[float, ...]
    beat_deg: float | None = None
    run_deg: float | None = None
    live_twa_deg: float | None = None
    live_mps: float | None = None

    def at_mps(self, twa_deg: float) -> float | None:
        """Return its speed at an angle, None where it has no nodes about it."""
        angle = abs(twa_deg)
        for (low, slow), (high, fast) in pairwise(zip(self.twa_deg, self.speed_mps, strict=True)):
            if low <= angle <= high and high > low:
                return slow + (fast - slow) * (angle - low) / (high - low)
        return None

    def live_share(self) -> float | None:
        """Return what the boat makes of it, as a share; None close to the wind, where she carries her way."""
        if self.live_twa_deg is None or self.live_mps is None:
            return None
        target = self.at_mps(self.live_twa_deg)
        is_told = target is not None and target > 0.1 and abs(self.live_twa_deg) > (self.beat_deg or 0.0) - CARRIES_DEG
        return self.live_mps / target if is_told and target is not None else None


def metres(value_m: float) -> float:
    """Return metres to the decimetre."""
    return round(float(value_m), 1)


def place(en_m: PointEn) -> PointEn:
    """Return a place to the decimetre."""
    return metres(en_m[0]), metres(en_m[1])


@overload
def rounded(value: float, digits: int = ...) -> float: ...
@overload
def rounded(value: float | None, digits: int = ...) -> float | None: ...
def rounded(value: float | None, digits: int = 2) -> float | None:
    """Return a figure rounded; None for what is unknown or not finite."""
    return None if value is None or not math.isfinite(value) else round(float(value), digits)


def compass(angle_rad: float) -> float:
    """Return a direction in degrees, [0, 360).

    >>> compass(-math.pi / 2), compass(2.0 * math.pi - 1e-9)
    (270.0, 0.0)
    """
    return round(math.degrees(wrap_two_pi(angle_rad)), 1) % 360.0


def signed(angle_rad: float) -> float:
    """Return an angle in degrees, [-180, 180)."""
    return round(math.degrees(wrap_pi(angle_rad)), 1)


def degrees(angle_rad: float) -> float:
    """Return the size of an angle in degrees."""
    return round(math.degrees(angle_rad), 2)


def tack_of(twa_rad: float) -> Tack:
    """Return the tack by the angle of the wind to the bow: starboard, when it comes over the starboard side."""
    return "starboard" if twa_rad > 0.0 else "port"


SCHEMA = "companion.view/2"

Source = Literal["live", "recorded", "radio"]
Level = Literal["critical", "error", "warning", "notice", "info"]
Grade = Literal["good", "poor", "bad", "unknown"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateView:
    """What the boat does and why, in words; ``wants`` is what is missing for it to go on. ``age_s``: since it began."""

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
class AlarmView:
    """Something that somebody should look at: since ``age_s``."""

    code: str
    level: Level
    text: str
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BoatView:
    """Place and motion of the boat. ``age_s``: of the position. ``cross_track_m`` is positive right of the leg."""

    age_s: float | None = None
    lat_deg: float | None = None
    lon_deg: float | None = None
    at_en_m: PointEn | None = None
    heading_deg: float | None = None
    cog_deg: float | None = None
    sog_mps: float | None = None
    roll_deg: float | None = None
    tack: Tack | None = None
    vmg_mps: float | None = None  # to windward, negative to leeward
    vmc_mps: float | None = None  # towards the goal
    clearance_m: float | None = None  # of the hull to the nearest obstacle or limit
    cross_track_m: float | None = None
    waypoint_m: float | None = None
    goal_m: float | None = None
    length_m: float | None = None
    battery_v: float | None = None
    battery_share: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LegView:
    """A leg of the plan as it was when it was made; the last may be the loiter at the end."""

    from_en_m: PointEn
    to_en_m: PointEn
    is_loiter: bool = False
    is_beat: bool | None = None  # the autopilot beats it by itself
    course_deg: float | None = None
    twa_deg: float | None = None
    length_m: float | None = None
    speed_mps: float | None = None
    sigma_deg: float | None = None
    no_go_half_deg: float | None = None
    clearance_m: float | None = None  # beyond the margin, to the nearest obstacle or limit
    risk: float | None = None  # of being forced into the no-go zone, or too near to a vessel, on this leg
    manoeuvre: str = ""  # the turn into it: tack, gybe or empty


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanView:
    """The plan that is sailed: ``legs`` from the one that is next; what was promised, why it was chosen.

    ``age_s``: since it was made, or held against a new one and kept; its wind and its times are of then.
    """

    number: int | None = None
    age_s: float | None = None
    reason: str = ""  # why it was asked for
    why: str = ""
    rung: str = ""  # the step of the ladder on which it was found; empty: as configured
    bound_for: str = ""
    twd_from_deg: float | None = None  # the wind that it was judged in
    tws_mps: float | None = None
    delta_s: float | None = None
    promised_risk: float | None = None  # at each instant
    path_risk: float | None = None  # off the plan before the next goal: the sum over the legs that are left
    vessel_risk: float | None = None
    margin_m: float | None = None
    cost_s: float | None = None
    median_s: float | None = None  # from there to the plan's end, in half the winds of the spread ...
    late_s: float | None = None  # ... and in nine of ten
    there_s: float | None = None  # from now until the next goal is reached, at the pace that the boat keeps ...
    there_late_s: float | None = None  # ... and in nine cases of ten
    expected_clearance_m: float | None = None  # of the hull on the track that is expected
    bound_s: float | None = None  # no plan is faster than that; None of a plan that was kept
    replans: int | None = None
    next_tack_s: float | None = None
    next_tack_is_planned: bool | None = None  # at the end of this leg; False: the autopilot's own, or farther on
    leg: int | None = None  # the leg that is sailed, from 1 ...
    count: int | None = None  # ... of so many
    legs: tuple[LegView, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class AheadView:
    """Where the boat is expected ``in_s`` from now, and on which tack; nine in ten are within ``within_m`` of there."""

    in_s: float
    at_en_m: PointEn
    tack: Tack | None = None
    within_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackPoint:
    """Where the boat was, ``ago_s`` before."""

    ago_s: float
    at_en_m: PointEn
    tack: Tack | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class VesselView:
    """Another vessel and the closest approach to it, hull to hull, if both go on; ``cpa_s`` None: it draws away."""

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
    cpa_en_m: PointEn | None = None  # where it will be then ...
    own_cpa_en_m: PointEn | None = None  # ... and where we shall be


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceView:
    """A place on the chart."""

    name: str
    at_en_m: PointEn
    radius_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalView:
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
class StandingView:
    """The order that stands."""

    verb: str
    words: str
    by: str = ""
    at_en_m: PointEn | None = None
    age_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class OrdersView:
    """The order that stands, the last answer, and what the mission permits whoever may open the socket on board."""

    standing: StandingView | None = None
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
    promised_clearance_m: float | None = None  # the least that a plan expected which was sailed
    goals_reached: int | None = None
    goals: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureView:
    """A figure of the table (``companion.figures``): its value is m/s, m, s, degrees, a share of 1, or a number.

    ``bearing`` is clockwise from north, ``angle`` positive to starboard.
    """

    name: str
    label: str
    kind: Literal["speed", "distance", "time", "bearing", "angle", "share", "number"]
    value: float
    hint: str = ""


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
    state: StateView
    alarms: tuple[AlarmView, ...] = ()
    boat: BoatView = BoatView()
    wind: WindView | None = None
    water: WaterView | None = None
    no_go: NoGo | None = None
    laylines: Laylines | None = None
    polar: PolarView | None = None
    plan: PlanView | None = None
    predicted: tuple[AheadView, ...] = ()
    track: tuple[TrackPoint, ...] = ()
    vessels: tuple[VesselView, ...] = ()
    goals: tuple[GoalView, ...] = ()
    refuges: tuple[PlaceView, ...] = ()
    home: PlaceView | None = None
    safe_end: PlaceView | None = None
    orders: OrdersView = OrdersView()
    figures: Figures = Figures()
    shown: tuple[FigureView, ...] = ()
    health: tuple[Part, ...] = ()


MOST = 3600  # samples kept: an hour at one a second, of weeks half an hour of that and each quarter of an hour


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One moment of the track and the strips; the forecast is the one that was made then, for a minute ahead."""

    t_s: float
    east_m: float | None = None
    north_m: float | None = None
    heading_deg: float | None = None
    sog_mps: float | None = None
    twd_from_deg: float | None = None
    tws_mps: float | None = None
    clearance_m: float | None = None
    starboard: bool | None = None  # tack
    polar_twa_deg: float | None = None  # of the wind over the water, as the polar is ...
    polar_mps: float | None = None  # ... and the speed through it
    ahead_twd_deg: float | None = None  # the forecast's mean for a minute ahead ...
    ahead_half_deg: float | None = None  # ... and the half width that holds 80 %
    ahead_tws_mps: float | None = None
    ahead_tws_sigma_mps: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """Samples by column, each as long as ``t_s``; names as in ``Sample``."""

    unix_s: float | None = None  # of t_s = 0
    t_s: tuple[float, ...] = ()
    east_m: tuple[float | None, ...] = ()
    north_m: tuple[float | None, ...] = ()
    heading_deg: tuple[float | None, ...] = ()
    sog_mps: tuple[float | None, ...] = ()
    twd_from_deg: tuple[float | None, ...] = ()
    tws_mps: tuple[float | None, ...] = ()
    clearance_m: tuple[float | None, ...] = ()
    starboard: tuple[bool | None, ...] = ()
    polar_twa_deg: tuple[float | None, ...] = ()
    polar_mps: tuple[float | None, ...] = ()
    ahead_twd_deg: tuple[float | None, ...] = ()
    ahead_half_deg: tuple[float | None, ...] = ()
    ahead_tws_mps: tuple[float | None, ...] = ()
    ahead_tws_sigma_mps: tuple[float | None, ...] = ()

    @classmethod
    def of(cls, samples: Sequence[Sample], unix_s: float | None) -> Past:
        """Return samples as columns."""
        return cls(unix_s=unix_s, **{f.name: tuple(getattr(s, f.name) for s in samples) for f in fields(Sample)})


class Trail:
    """The samples of a voyage under way: the newest half in full, of all before them one in so many, evenly."""

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self.samples: list[Sample] = []
        self._older = 0  # so many of them are of the older half ...
        self._passed = 0  # ... into which so many have come ...
        self._every = 1  # ... and of which one in so many was kept

    def follow(self, before: LocalFrame, after: LocalFrame) -> None:
        """Let the metres of all samples count in another frame."""
        if before != after:
            shift = Shift(before, after)
            self.samples = [_carried(sample, shift) for sample in self.samples]

    def add(self, sample: Sample) -> None:
        """Take the next one."""
        self.samples.append(sample)
        newest = self._most // 2
        if len(self.samples) - self._older <= newest:
            return
        if self._passed % self._every == 0:
            self._older += 1
        else:
            del self.samples[self._older]
        self._passed += 1
        if self._older > self._most - newest:
            older = self.samples[: self._older][::2]
            self.samples = [*older, *self.samples[self._older :]]
            self._older, self._every = len(older), 2 * self._every


def _carried(sample: Sample, shift: Shift) -> Sample:
    if sample.east_m is None or sample.north_m is None:
        return sample
    east_m, north_m = place(shift.point((sample.east_m, sample.north_m)))
    return replace(sample, east_m=east_m, north_m=north_m)


def sample_of(view: View) -> Sample:
    """Return what the track and the strips keep of a view."""
    boat, wind, polar = view.boat, view.wind, view.polar
    minute = None if wind is None else next((b for b in wind.bands if b.horizon_s == 60.0), None)
    east, north = boat.at_en_m or (None, None)
    return Sample(
        t_s=view.t_s,
        east_m=east,
        north_m=north,
        heading_deg=boat.heading_deg,
        sog_mps=boat.sog_mps,
        clearance_m=boat.clearance_m,
        starboard=None if boat.tack is None else boat.tack == "starboard",
        twd_from_deg=None if wind is None else wind.twd_from_deg,
        tws_mps=None if wind is None else wind.tws_mps,
        polar_twa_deg=None if polar is None else polar.live_twa_deg,
        polar_mps=None if polar is None else polar.live_mps,
        ahead_twd_deg=None if minute is None else minute.twd_from_deg,
        ahead_half_deg=None if minute is None or len(minute.half_deg) < 2 else minute.half_deg[1],
        ahead_tws_mps=None if minute is None else minute.tws_mps,
        ahead_tws_sigma_mps=None if minute is None else minute.tws_sigma_mps,
    )

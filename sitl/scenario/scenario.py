"""Scenario files: a situation, weather, events in time, and what must hold; the wind, water and hull they describe.

Every key has a range; what is outside of it is said with file and place as anything else in a scenario is.

The same file runs on the embedded autopilot under the virtual clock and on the real ArduRover. Numbers carry
their unit in the key; directions are where the wind comes from, degrees clockwise from true north.
"""

from __future__ import annotations

import datetime as dt
import difflib
import math
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import msgspec
import tomli_w

from companion import examples
from companion.boat import Polar
from companion.chart import parse_ascii_grid, signed
from companion.compose import RECENTRE_M, polar_of
from companion.errors import InputError, unreadable
from companion.geo.frame import LocalFrame
from companion.geofence import Mission, load_mission
from companion.geofence.mission import without_defaults
from companion.messages import Mode
from companion.weather import Box, Weather, read_weather
from companion.words import choices, expected
from sitl.autopilot import EPOCH_S, FRAME_M, Departures, Sensors, VaneState, Waves
from sitl.scenario.colregs import Craft, Manner
from sitl.world import (
    AR1,
    Bank,
    Blown,
    Constant,
    CurrentModel,
    ForecastField,
    Gusty,
    Later,
    Lee,
    Recorded,
    Scripted,
    Seabed,
    SimulatedSounder,
    Tide,
    Waters,
    WindEvent,
    WindModel,
    beneath,
)

# What a number may be. No comparison holds for a number that is none (nan), so that is refused, too.
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]
Speed = Annotated[float, msgspec.Meta(ge=0.0, le=10.0)]
Degrees = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]
Depth = Annotated[float, msgspec.Meta(ge=-100.0, le=1e4)]
Rise = Annotated[float, msgspec.Meta(ge=-1000.0, le=1000.0)]
Slope = Annotated[float, msgspec.Meta(ge=-10.0, le=10.0)]
Metres = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
Turns = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]
Factor = Annotated[float, msgspec.Meta(ge=0.2, le=2.0)]
Leeway = Annotated[float, msgspec.Meta(ge=0.0, le=30.0)]
Swing = Annotated[float, msgspec.Meta(ge=0.0, le=45.0)]
Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=600.0)]


class LeeSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An island that takes the wind from the water behind it."""

    east_m: Metres  # its middle, from the mission's origin
    north_m: Metres  # the same
    radius_m: Positive  # of the island
    loss: Share = 0.5  # of the wind's strength, close behind it
    reach_m: Positive = 150.0  # downwind of which a third of that is left


class CurrentSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The water's motion: a constant part and a tide, both stronger on one side of the water."""

    set_deg: Degrees = 0.0  # where it runs to
    drift_mps: Speed = 0.0  # of its constant part
    tide_set_deg: Degrees = 0.0  # where the tide runs to at its greatest
    tide_mps: Speed = 0.0  # the tide's greatest speed
    tide_s: Positive = 44_712.0  # from one such time to the next: 12.42 hours, the moon's
    tide_high_s: Metres = 0.0  # the first of them, after the start
    tide_turns: Turns = 0.0  # 0: to and fro; 1: turns with the clock; -1: against it; between: an ellipse
    shear_per_km: Slope = 0.0  # stronger by this share of itself for each km from the mission's origin ...
    shear_to_deg: Degrees = 0.0  # ... in this direction; it never turns round


class WavesSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A seaway."""

    from_deg: Degrees | None = None  # none: from where the wind is on the average
    loss: Share = 0.0  # of the boat's speed, head to sea; half of it abeam, none with it
    yaw_deg: Swing = 0.0  # how far the bow swings to each side
    period_s: Positive = 4.0  # of that


class HullSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A boat that is not the polar's."""

    speed: Factor = 1.0  # of the polar's, at every angle, times ...
    beat: Factor = 1.0  # ... this at 45 degrees to the true wind
    reach: Factor = 1.0  # at 90
    run: Factor = 1.0  # at 150, straight between
    leeway_deg: Leeway = 0.0  # on a beat: the apparent wind 30 degrees off the bow, three times as fast as the boat
    tack_fails: Share = 0.0  # the chance that a tack does ...
    irons_s: Seconds = 10.0  # ... and how long the boat lies near head to wind then


class SensorsSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sensors that err from the start to the end."""

    vane_deg: Degrees = 0.0  # the vane points so far to starboard of the wind
    compass_deg: Degrees = 0.0  # the heading is told so far to starboard
    deviation_deg: Swing = 0.0  # beside it, on the worst heading ...
    deviation_at_deg: Degrees = 0.0  # ... which is 90 degrees from this one, on which it is none
    gps_noise_m: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] = 0.0  # spread, east and north each, wandering ...
    gps_noise_s: Positive = 30.0  # ... with this correlation time
    gps_lag_s: Seconds = 0.0  # the position is so old


class BankSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A shoal or a bar on the bottom: an ellipse that rises smoothly to its middle."""

    east_m: Metres  # its middle, from the mission's origin
    north_m: Metres  # the same
    top_m: Depth  # the depth there, below the chart's datum; negative: it dries
    along_m: Positive = 60.0  # its longer half axis, to where nothing of it is left ...
    across_m: Positive = 60.0  # ... and the other
    bearing_deg: Degrees = 0.0  # of the longer one


class BottomSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The bottom, the tide over it, and the boat's sounder; the mission says `draft_m`."""

    depth_m: Depth = 20.0  # below the chart's datum, at the mission's origin
    file: str | None = None  # a grid of heights (Esri ASCII, degrees), relative to this one; beyond it `depth_m` holds
    rises_per_km: Rise = 0.0  # the bottom is so much higher for each km ...
    rises_to_deg: Degrees = 0.0  # ... in this direction
    banks: tuple[BankSpec, ...] = ()  # what stands on it
    tide_m: Depth = 0.0  # the water's mean height above the datum
    tide_range_m: Depth = 0.0  # from low to high water
    tide_s: Positive = 44_712.0  # from one high water to the next: 12.42 hours, the moon's
    tide_high_s: Metres = 0.0  # the first of them, after the start
    sounder: bool = True  # the boat has one ...
    nmea: bool = False  # ... and speaks NMEA 0183 to the companion's `[sounder]` by UDP, not to the autopilot
    below_m: Annotated[float, msgspec.Meta(ge=0.0, le=20.0)] = 0.0  # its transducer, below the water's surface
    noise_m: Annotated[float, msgspec.Meta(ge=0.0, le=20.0)] = 0.0  # standard deviation of a ping
    dropouts: Share = 0.0  # the share of pings without an echo
    false_bottoms: Share = 0.0  # the share of time in which weed, air or fish is told in the bottom's place ...
    false_s: Positive = 0.5  # ... for so long each


def stream_of(spec: CurrentSpec) -> CurrentModel:
    """Return the stream of a scenario's table."""
    return CurrentModel(
        set_to_rad=math.radians(spec.set_deg),
        drift_mps=spec.drift_mps,
        tide_to_rad=math.radians(spec.tide_set_deg),
        tide_mps=spec.tide_mps,
        tide_s=spec.tide_s,
        tide_high_s=spec.tide_high_s,
        tide_turns=spec.tide_turns,
        shear_per_km=spec.shear_per_km,
        shear_to_rad=math.radians(spec.shear_to_deg),
    )


def lee_of(spec: LeeSpec) -> Lee:
    """Return the island of a scenario's table."""
    return Lee(en_m=(spec.east_m, spec.north_m), radius_m=spec.radius_m, loss=spec.loss, reach_m=spec.reach_m)


def departures_of(
    boat: HullSpec | None, waves: WavesSpec | None, sensors: SensorsSpec | None, wind_from_deg: float
) -> Departures | None:
    """Return what a boat is that is not the plan's; None where no table says so."""
    if boat is None and waves is None and sensors is None:
        return None
    hull, sea, told = boat or HullSpec(), waves or WavesSpec(), sensors or SensorsSpec()
    return Departures(
        beat=hull.speed * hull.beat,
        reach=hull.speed * hull.reach,
        run=hull.speed * hull.run,
        leeway_rad=math.radians(hull.leeway_deg),
        tack_fails=hull.tack_fails,
        irons_s=hull.irons_s,
        waves=Waves(
            from_rad=math.radians(wind_from_deg if sea.from_deg is None else sea.from_deg),
            loss=sea.loss,
            yaw_rad=math.radians(sea.yaw_deg),
            period_s=sea.period_s,
        ),
        sensors=Sensors(
            vane_rad=math.radians(told.vane_deg),
            compass_rad=math.radians(told.compass_deg),
            deviation_rad=math.radians(told.deviation_deg),
            deviation_at_rad=math.radians(told.deviation_at_deg),
            gps_noise_m=told.gps_noise_m,
            gps_noise_s=told.gps_noise_s,
            gps_lag_s=told.gps_lag_s,
        ),
    )


EventKind = Literal[
    "wind_shift",  # veer_deg, over_s
    "wind_speed",  # tws_mps, over_s
    "mode",  # mode: a person's choice, by name; by: radio (the mode switch), else the ground station
    "arm",  # by the ground station
    "disarm",  # by the ground station
    "set_current",  # seq, for_s: the ground station makes an item of the mission current, and insists
    "parameter",  # parameter, value: set by the ground station, for good
    "home",  # east_m, north_m: the ground station moves home there
    "fence",  # radius_m about east_m, north_m: it draws another fence and switches it on; state
    "rally",  # east_m, north_m: it draws the list of rally points anew, this one alone
    "edit_item",  # seq, east_m, north_m: it moves one item of the mission and uploads the list again
    "refused",  # state, for_s: the autopilot refuses it
    "company",  # another companion speaks on the link with our ids; for_s
    "reboot",  # the autopilot restarts
    "link_cut",  # for_s (none: for good)
    "link_half",  # state: the companion hears and is not heard, or hears nothing; for_s
    "link_quality",  # loss, duplicate, reorder, delay_s, corrupt, noise
    "neighbour",  # another boat's autopilot, system, is on the link; for_s; vehicle_type
    "spoof",  # forgery ("MESSAGE: what it says", of sitl.faults.spoofing), rate_hz, listens, for_s
    "gps_jump",  # east_m, north_m, for_s, is_resisted (noticed by the EKF, as on the real one)
    "gps_lost",  # for_s
    "compass",  # value_deg to starboard, for_s: what the autopilot believes
    "vane",  # state, value_deg
    "kill_companion",  # restart_after_s: SIGKILL in the middle of whatever it does; saved, aged_s, clock_step_s
    "kill_planner",  # its process dies; the next request starts another
    "planner_hang",  # for_s: requests are not answered in time
    "planner_starved",  # its process gets no more memory; a replaced one does
    "disk",  # state, for_s: the companion's
    "foreign_mission",  # somebody uploads another mission
    "battery",  # volts
    "leak",  # for_s: the bilge's switch is wet
    "sensor",  # sensor, value, for_s: a script of the boat's tells it (NAMED_VALUE_FLOAT)
    "sounder",  # value, over_s, for_s: it tells this depth [m], reached so slowly from the last; then `[bottom]`
    "radio_lost",  # for_s: the transmitter is out of range
    "station",  # for_s: a ground station is heard, from then on no more
    "knockdown",  # roll_deg, for_s
    "current",  # set_deg, drift_mps, for_s
    "order",  # order: to the companion, in words (a goal at east_m, north_m); answer: what it must be
    "far_order",  # order, expires_s, late_s: over the satellite link, sent again until it is answered; answer
    "crew",  # anchors react_s after the companion first calls for it, weighs after for_s
    "vessel",  # east_m, north_m (then), course_deg, sog_mps, every_s, is_on_ais, length_m, for_s: a ship passes
    "intruder",  # gap_m off our boat on bearing_deg off its bow, sog_mps, for_s: on collision course, told by radio
    "meeting",  # course_deg off us, sog_mps, meet_s, miss_m, craft, manner, react_s, length_m, receiver, for_s: watches
    "second_boat",  # east_m, north_m, goal_east_m, goal_north_m: VAIMOS's model, steered by field, told by radio
]


Outlet = Literal["page", "page token", "socket", "satellite"]

# What an event's ``state`` may be, by its kind; the first of them is meant where it is left out.
STATES: dict[str, tuple[str, ...]] = {
    "fence": ("on", "off"),
    "refused": ("arm", *Mode.__members__),
    "link_half": ("deaf", "unheard"),
    "vane": tuple(state.value for state in VaneState),
    "disk": ("full", "sick", "read_only", "ok"),
}


class WindSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The weather; from ``gust_spread`` on also what varies in time beside it and over the water."""

    # ou wanders about its mean, forecast about what files in GRIB say for place and hour (of `begins`)
    model: Literal["constant", "ou", "recorded", "forecast"] = "ou"
    from_deg: float = 0.0  # where it comes from, on the average
    tws_mps: float = 5.0  # true wind speed, on the average
    sd_deg: float = 9.0  # standard deviation of the direction
    tau_s: float = 28.0  # 1 / rho: Wolsieffer's 0.036 Hz
    tws_sd_mps: float = 0.3  # standard deviation of the speed
    file: str | None = None  # of a recorded wind: CSV, relative to this one
    files: tuple[str, ...] = ()  # of a forecast: GRIB, relative to this one; its current runs, too
    member: Annotated[int, msgspec.Meta(ge=0, le=999)] = 0  # of the forecast's
    off_deg: Degrees = 0.0  # the forecast's wind is turned by so much ...
    off_mps: Annotated[float, msgspec.Meta(ge=-20.0, le=20.0)] = 0.0  # ... and stronger by this
    from_s: float = 0.0  # of the weather's own time: what has blown by then is over
    gust_spread: Share = 0.0  # of the strength's logarithm, about the strength that is there without gusts
    gust_s: Positive = 15.0  # their correlation time
    stronger_per_km: Slope = 0.0  # the wind is stronger by this share for each km from the mission's origin ...
    stronger_to_deg: Degrees = 0.0  # ... in this direction ...
    bends_deg_per_km: Degrees = 0.0  # ... and veers by so much there
    lees: tuple[LeeSpec, ...] = ()  # behind islands


class EventSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Something that happens at ``at_s`` [s] after the simulation's start."""

    at_s: float  # after the simulation's start
    kind: EventKind  # see below
    veer_deg: float = 0.0
    over_s: float = 0.0
    tws_mps: float | None = None
    mode: str | None = None
    by: Literal["radio", "station"] = "station"
    for_s: float | None = None
    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    corrupt: float = 0.0
    noise: float = 0.0  # of the bytes: lost, changed or inserted
    delay_s: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    is_resisted: bool = False
    is_of_one: bool = False  # of two receivers: from now on there is a second, which tells the truth
    order: str = ""
    answer: Literal["done", "refused", "not now", "unknown", "no answer", "expired"] = "done"
    expires_s: float = 3600.0  # of an order from far away
    late_s: float = 0.0  # it lies somewhere on its way for so long
    state: str | None = None
    value_deg: float = 0.0
    parameter: str = ""
    sensor: Annotated[str, msgspec.Meta(max_length=10, pattern="^[ -~]*$")] = ""
    value: float = 0.0
    restart_after_s: float | None = None
    saved: Literal["kept", "lost", "torn", "old"] = "kept"  # what becomes of the companion's saved state
    aged_s: float = 0.0  # of an old one: as it was so long before
    clock_step_s: float = 0.0  # of the companion's wall clock, when it lives again
    volts: float | None = None
    roll_deg: float = 0.0
    seq: int = 1
    radius_m: float = 100.0  # of a fence
    system: int = 7  # of a neighbour
    vehicle_type: int = 11
    forgery: str = ""
    rate_hz: float = 5.0
    listens: bool = False  # the forger hears the boat
    set_deg: float = 0.0
    drift_mps: float = 0.0
    react_s: float = 0.0  # a crew's, from being called to the anchor on the ground
    course_deg: float = 0.0
    sog_mps: float = 0.0
    every_s: float = 10.0  # between its AIS reports
    is_on_ais: bool = True
    length_m: float | None = None  # of a vessel; none: a ship of 100 m, a boat of 3.65 m; the autopilot's AIS lacks it
    gap_m: float = 0.0
    bearing_deg: float = 0.0  # clockwise
    craft: Craft = "power"
    manner: Manner = "rules"  # of whoever is met: gives way by the rules, or keeps its course whatever
    meet_s: float = 120.0  # until the closest approach, both going on ...
    miss_m: float = 0.0  # ... and how far apart the middles are then
    receiver: Literal["autopilot", "feed"] = "autopilot"  # who hears that vessel's AIS
    goal_east_m: float = 0.0
    goal_north_m: float = 0.0

    @property
    def its_state(self) -> str:
        """Return its ``state``, or what that is where it is left out."""
        return self.state or STATES[self.kind][0]


# What a boat must bear without coming nearer to anything than its mission allows.
ORDINARY = frozenset(
    {
        "wind_speed",
        "wind_shift",
        "link_cut",
        "link_half",
        "link_quality",
        "kill_planner",
        "battery",
        "leak",
        "sensor",
        "sounder",
        "vessel",
        "neighbour",
        "disk",
        "order",
        "far_order",
        "meeting",
    }
)
ORDINARY_VEER_DEG = 45.0  # a greater shift is a front
ORDINARY_CUT_S = 5.0  # a longer silence of the link is a fault of its own
ORDINARY_LOSS = 0.3  # a link that loses more is none
ORDINARY_NOISE = 0.005  # of bytes: one frame in five


def is_ordinary(event: EventSpec) -> bool:
    """Return whether an event belongs to ordinary weather, links and traffic."""
    if event.kind == "wind_shift":
        return abs(event.veer_deg) <= ORDINARY_VEER_DEG
    if event.kind in {"link_cut", "link_half"}:
        return event.for_s is not None and event.for_s <= ORDINARY_CUT_S
    if event.kind == "link_quality":
        return event.loss <= ORDINARY_LOSS and event.noise <= ORDINARY_NOISE
    return event.kind in ORDINARY


def is_all_ordinary(events: Iterable[EventSpec]) -> bool:
    """Return whether nothing but ordinary weather, links and traffic befalls the boat."""
    return all(is_ordinary(event) for event in events)


class SatelliteSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A satellite link to the boat: each message takes from ``delay_s`` to ``delay_most_s``, by a lot of its own."""

    delay_s: float = 30.0  # a message takes at least ...
    delay_most_s: float = 300.0  # ... and at most
    loss: float = 0.0  # share of messages that never come
    duplicate: float = 0.0  # share that comes twice
    status_every_s: float = 600.0  # between two statuses of the boat


class HeldSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The boat must stay where it is: from and to these times [s after the simulation's start], within ``within_m``."""

    from_s: float  # after the start
    to_s: float  # after the start
    within_m: float  # of the boat's mean place meanwhile


class ExpectSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What must hold when it is over; a check that is not asked for is not made."""

    arrived: bool | None = True  # at the last goal
    contacts: int | None = 0  # of the hull with what is solid, by the true track
    groundings: int | None = 0  # of the keel on `[bottom]`: water less deep than the mission's `draft_m`
    within_m: float | None = None  # last position to the last goal, or to what ``ends_at`` names
    ends_at: Literal["goal", "home", "refuge"] = "goal"  # home: where the boat was armed; the nearest refuge
    refuge_within_m: float | None = None  # of a refuge, at some moment
    max_time_s: float | None = None  # from setting sail to the end
    min_clearance_m: float | None = None  # from what is solid and the fence, by the true track
    min_vessel_distance_m: float | None = None  # from the boat to each vessel's hull
    second_boat_within_m: float | None = None  # of its goal, at some moment
    rules_kept: bool | None = None  # of the road, by the tracks, in every meeting
    station_radius_m: float | None = None  # about their mean, of 95 % of 5 minutes' points at the last goal
    max_silence_s: float | None = 10.0  # without a status from the companion that says why
    max_replans_per_hour: float | None = None  # plans made under way
    max_tacks: int | None = None  # before the boat first comes within ``within_m`` of the last goal
    held: HeldSpec | None = None  # the boat stays where it is
    end_phase: str | None = None  # the skipper's phase in the end
    alerts: tuple[str, ...] = ()  # announced at least once, by code
    marks_rounded: int | None = None  # in order, each on its side
    gates_crossed: int | None = None  # in order, each in its direction, laps counted
    marks_clear_m: float = 1.0  # of buoys and the gates' marks: what the boat's position keeps clear of them
    start_within_s: float | None = None  # after the gun, and not before it
    inside_s: float | None = None  # each box is not left for so long after the boat came in ...
    inside_share: float = 0.98  # ... but for the rest of this share of the time
    seen: float | None = None  # share of the water of each search, within half a swath of the track
    called_s: float | None = None  # the crew is called to the anchor this long before a contact


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One scenario file."""

    name: str  # of the voyage folder and in tables
    title: str = ""  # what it is about, in a sentence
    mission: str  # the mission file, relative to this one
    limit_s: float = 3600.0  # called off then
    speedup: float = 8.0  # when it runs in real time, separate processes
    begins: dt.datetime = dt.datetime.fromtimestamp(EPOCH_S, dt.UTC)  # UTC: what is dark, and the tide
    start_heading_deg: float | None = None  # None: as the mission says
    has_ftp: bool = True  # the embedded autopilot offers MAVFTP; else items go one by one
    is_service: bool = False  # a companion that heard no autopilot is started again
    exit_on_arrival: bool = True  # else the boat is watched in its loiter until the limit
    dry_run: bool = False  # the companion may only look
    set_auto: bool = True  # it may set modes
    policy: Literal["keep clear", "rules"] | None = None  # for vessels, in place of what the mission says
    system: int | None = None  # of our autopilot, named in place of what the mission says
    satellite: SatelliteSpec | None = None  # ``far_order`` needs one
    broken: tuple[Outlet, ...] = ()  # what is wanted beside the voyage, and cannot be used
    wind: WindSpec = msgspec.field(default_factory=WindSpec)  # the weather
    current: CurrentSpec | None = None  # of these four: what the plan does not know of, None: it is as planned
    waves: WavesSpec | None = None  # a seaway
    boat: HullSpec | None = None  # a boat that is not the polar's
    sensors: SensorsSpec | None = None  # sensors that err
    bottom: BottomSpec | None = None  # how deep the water is, which no plan knows of
    parameters: dict[str, float] = {}  # of the autopilot, by name, from its start
    without_shifts: dict[str, float] = {}  # beside those, of who does not tack on the shifts (sitl baselines)
    events: tuple[EventSpec, ...] = ()  # what befalls the boat, in any number
    expect: ExpectSpec = msgspec.field(default_factory=ExpectSpec)  # what must hold in the end

    @property
    def epoch_s(self) -> float:
        """Unix time of its start."""
        return self.begins.timestamp()

    def mission_path(self, source: Path) -> Path:
        """Return the mission file, which is named relative to the scenario; installed, ours are in the package."""
        path = (source.parent / self.mission).resolve()
        ours = examples.folder() / path.name
        return ours if path.parent.name == ours.parent.name and ours.is_file() and not path.is_file() else path


# As `companion doctor --apply` leaves it, where a scenario does not say: with bit 2, a default, the fence is a
# circle of 300 m round home, too, and a mission that keeps the fence switched on and leads further is not begun.
AS_SET_UP = MappingProxyType({"FENCE_TYPE": 4.0})


def load_scenario(path: Path) -> Scenario:
    """Read a scenario, or a mission file as the plain scenario of sailing it.

    Raises:
        InputError: naming the file, the key and the remedy.
    """
    if path.is_dir():
        raise InputError(str(path), "", "is a folder", "name the TOML file of a mission or a scenario")
    try:
        text = path.read_bytes()
    except OSError as error:
        remedy = "name the TOML file of a mission or a scenario"
        raise unreadable(str(path), error, remedy=remedy) from error
    try:
        raw: dict[str, Any] = msgspec.toml.decode(text)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise InputError(str(path), "", f"is not TOML ({str(error)[:80]})", "is it the file that was meant?") from error
    if not raw:
        raise InputError(str(path), "", "is empty", "name the TOML file of a mission or a scenario")
    if "mission" not in raw and "goal" in raw:
        raw = {"name": str(raw.get("name", path.stem)), "mission": path.name, "wind": _previewed(raw.get("wind"))}
    try:
        scenario = msgspec.convert(raw, Scenario)
    except msgspec.ValidationError as error:
        if "mission" not in raw and ("missing required field" in str(error) or "from_autopilot" in raw):
            problem = "has no [[goal]], as a mission has that is simulated, and names no mission, as a scenario does"
            raise InputError(str(path), "", problem, "add one of them, or name another file") from error
        raise InputError(str(path), _place(error), _sentence(error), _suggestion(error)) from error
    scenario = msgspec.structs.replace(scenario, parameters={**AS_SET_UP, **scenario.parameters})
    if scenario.satellite is None and any(event.kind == "far_order" for event in scenario.events):
        raise InputError(str(path), "events", "far_order needs a satellite link", "add a table [satellite]")
    if any(event.kind == "sensor" and not event.sensor for event in scenario.events):
        raise InputError(str(path), "events", "sensor has no name", 'write sensor = "NAME", as a script tells it')
    for event in scenario.events:
        if event.state is not None and event.state not in STATES.get(event.kind, ()):
            known = ", ".join(STATES.get(event.kind, ())) or "none"
            raise InputError(str(path), "events", f"{event.kind} has no state {event.state!r}", f"known: {known}")
    if not scenario.mission_path(path).is_file():
        raise InputError(str(path), "mission", f"there is no file {scenario.mission}", "paths start at the scenario")
    return scenario


def _previewed(wind: object) -> dict[str, float]:
    """Return the wind that a mission is previewed in, as a scenario has it; what is wrong the mission's reader says."""
    given = wind if isinstance(wind, dict) else {}
    keys = {"preview_from_deg": "from_deg", "preview_speed_mps": "tws_mps"}
    return {key: given[name] for name, key in keys.items() if isinstance(given.get(name), int | float)}


def beginning(scenario: Scenario, source: Path, at: dt.datetime | None = None) -> dt.datetime:
    """Return when a simulation begins: ``at``, else as a scenario says, and of a plain mission file now, to the minute.

    What is dark there is then dark here, too; only who names the time repeats a voyage of a mission bit for bit.
    """
    if at is not None:
        return at
    if scenario.mission_path(source) == source.resolve():
        return dt.datetime.now(dt.UTC).replace(second=0, microsecond=0)
    return scenario.begins


def _place(error: msgspec.ValidationError) -> str:
    _, _, place = str(error).partition(" - at `$")
    return place.rstrip("`").lstrip(".")


def _sentence(error: msgspec.ValidationError) -> str:
    return expected(str(error).partition(" - at ")[0])


def _suggestion(error: msgspec.ValidationError) -> str:
    if "Invalid enum value" in str(error):
        return "write one of " + ", ".join(choices(Scenario, str(error).partition(" - at `")[2].rstrip("`")))
    if "missing required field" in str(error):
        return "add it"
    if "unknown field" not in str(error):
        return ""
    word = str(error).partition("`")[2].partition("`")[0]
    tables = {
        "wind": WindSpec,
        "satellite": SatelliteSpec,
        "events": EventSpec,
        "expect": ExpectSpec,
        "wind.lees": LeeSpec,
        "current": CurrentSpec,
        "waves": WavesSpec,
        "boat": HullSpec,
        "sensors": SensorsSpec,
        "bottom": BottomSpec,
        "bottom.banks": BankSpec,
    }
    table = tables.get(_place(error).split("[")[0], Scenario)
    close = difflib.get_close_matches(word, table.__struct_fields__, n=1)
    return f"did you mean `{close[0]}`?" if close else f"known: {', '.join(table.__struct_fields__)}"


def scenario_text(scenario: Scenario) -> str:
    """Return the TOML of a scenario; files in it are named as it names them."""
    return tomli_w.dumps(without_defaults(scenario))


def scenario_wind(scenario: Scenario, source: Path, seed: int) -> WindModel:
    """Return the wind of ``scenario``, read from ``source``, for ``seed``."""
    spec = scenario.wind
    base: WindModel
    if spec.model == "recorded":
        base = Recorded.from_csv(source.parent / (spec.file or ""))
    elif spec.model == "forecast":
        base = _blown(scenario, source, seed)
    elif spec.model == "constant":
        base = Constant(math.radians(spec.from_deg), spec.tws_mps)
    else:
        base = AR1(
            math.radians(spec.from_deg),
            spec.tws_mps,
            seed=seed,
            sd_rad=math.radians(spec.sd_deg),
            rho_hz=1.0 / spec.tau_s,
            tws_sd_mps=spec.tws_sd_mps,
        )
    if spec.gust_spread > 0.0:
        base = Gusty(base, spread=spec.gust_spread, tau_s=spec.gust_s, seed=seed)
    if spec.from_s != 0.0 and spec.model != "forecast":  # whose hours are those of `begins`
        base = Later(base, spec.from_s)
    events = tuple(
        WindEvent(
            at_s=e.at_s,
            veer_rad=math.radians(e.veer_deg),
            tws_mps=e.tws_mps,
            over_s=e.over_s,
            for_s=math.inf if e.for_s is None else e.for_s,
        )
        for e in scenario.events
        if e.kind in {"wind_shift", "wind_speed"}
    )
    return Scripted(base, events) if events else base


def _blown(scenario: Scenario, source: Path, seed: int) -> Blown:
    """Return the wind of a forecast. Raises InputError where it does not know place and hour of the start."""
    spec = scenario.wind
    if not spec.files:
        raise InputError(str(source), "wind", "model forecast names no files", 'write files = ["FORECAST.grb2"]')
    mission = load_mission(scenario.mission_path(source))
    weather = forecast(tuple(source.parent / name for name in spec.files), mission)
    names, frame = ", ".join(spec.files), mission.frame()
    if spec.member not in weather.members:
        known = ", ".join(map(str, weather.members)) or "none"
        raise InputError(str(source), "wind.member", f"{names} has no member {spec.member}", f"known: {known}")
    field = ForecastField(weather, spec.member, frame, scenario.epoch_s)
    home_en_m = frame.en_from_geo(mission.start or mission.origin)
    why = field.why_unknown(0.0, home_en_m)
    if why:
        begins = f"{scenario.begins:%Y-%m-%d %H:%M} UTC"
        raise InputError(names, "", f"the wind of the start is not known at {begins}: {why}", "sail at another time")
    return Blown(
        field,
        home_en_m,
        seed=seed,
        sd_rad=math.radians(spec.sd_deg),
        rho_hz=1.0 / spec.tau_s,
        tws_sd_mps=spec.tws_sd_mps,
        off_rad=math.radians(spec.off_deg),
        off_mps=spec.off_mps,
    )


ROOM_DEG = 1.0  # of a forecast, about the places of a mission


def forecast(paths: tuple[Path, ...], mission: Mission) -> Weather:
    """Return what files say about the waters of a mission; asked again, no file is read again. Raises InputError."""
    points = [mission.start or mission.origin, *(goal.point for goal in mission.goals)]
    lat = [p.lat_deg for p in points]
    lon = [points[0].lon_deg + math.remainder(p.lon_deg - points[0].lon_deg, 360.0) for p in points]
    wide = ROOM_DEG / max(0.05, math.cos(math.radians(max(map(abs, lat)))))
    box = (min(lon) - wide, max(-90.0, min(lat) - ROOM_DEG), max(lon) + wide, min(90.0, max(lat) + ROOM_DEG))
    weather = _weather(paths, box)
    if not weather.wind:
        names = ", ".join(map(str, paths))
        raise InputError(names, "", "holds no wind of 10 m where the mission is", "ask for 10u and 10v of the area")
    return weather


@lru_cache(maxsize=4)
def _weather(paths: tuple[Path, ...], box: Box) -> Weather:
    return read_weather(paths, box)


def scenario_waters(scenario: Scenario, wind: WindModel, home_en_m: tuple[float, float]) -> Waters | None:
    """Return wind and stream by place, counted from ``home_en_m`` of the mission's frame; None: the same everywhere."""
    spec = scenario.wind
    blown = beneath(wind)
    if (
        scenario.current is None
        and blown is None
        and not spec.lees
        and spec.stronger_per_km == 0.0
        and spec.bends_deg_per_km == 0.0
    ):
        return None
    return Waters(
        wind=wind,
        lees=tuple(lee_of(lee) for lee in spec.lees),
        stronger_per_km=spec.stronger_per_km,
        stronger_to_rad=math.radians(spec.stronger_to_deg),
        bends_rad_per_km=math.radians(spec.bends_deg_per_km),
        stream=stream_of(scenario.current or CurrentSpec()),
        home_en_m=home_en_m,
        forecast=blown,
    )


def scenario_departures(scenario: Scenario) -> Departures | None:
    """Return what the boat of a scenario is that is not the plan's; None: nothing."""
    return departures_of(scenario.boat, scenario.waves, scenario.sensors, scenario.wind.from_deg)


def scenario_seabed(scenario: Scenario, source: Path, frame: LocalFrame) -> Seabed | None:
    """Return the bottom of ``scenario``, read from ``source``, in the metres of its mission's frame; None: none.

    Raises:
        InputError: its grid cannot be read.
    """
    spec = scenario.bottom
    if spec is None:
        return None
    grid = None
    if spec.file is not None:
        path = str(source.parent / spec.file)
        try:
            text = (source.parent / spec.file).read_text(encoding="ascii")
        except OSError as error:
            raise unreadable(path, error, remedy="name an Esri ASCII grid (.asc)") from error
        except UnicodeDecodeError as error:
            raise InputError(path, "", f"cannot be read ({error})", "name an Esri ASCII grid (.asc)") from error
        grid = signed(parse_ascii_grid(text, path), path, "auto").northwards()
    return Seabed(
        frame=frame,
        level_m=spec.depth_m,
        grid=grid,
        rises_per_km=spec.rises_per_km,
        rises_to_rad=math.radians(spec.rises_to_deg),
        banks=tuple(
            Bank(
                en_m=(bank.east_m, bank.north_m),
                along_m=bank.along_m,
                across_m=bank.across_m,
                bearing_rad=math.radians(bank.bearing_deg),
                top_m=bank.top_m,
            )
            for bank in spec.banks
        ),
        tide=Tide(mean_m=spec.tide_m, range_m=spec.tide_range_m, period_s=spec.tide_s, high_s=spec.tide_high_s),
    )


def scenario_sounder(scenario: Scenario, seabed: Seabed | None, seed: int) -> SimulatedSounder | None:
    """Return the sounder of a scenario's boat; None: it has none, or no bottom is said."""
    spec = scenario.bottom
    if spec is None or seabed is None or not spec.sounder:
        return None
    return SimulatedSounder(
        seabed=seabed,
        seed=seed,
        below_m=spec.below_m,
        noise_m=spec.noise_m,
        dropouts=spec.dropouts,
        false_bottoms=spec.false_bottoms,
        false_s=spec.false_s,
    )


OWN = "ardurover"  # [boat] polar: the simulator's own hull, by its equations


def own_polar(mission: Mission) -> Polar | None:
    """Return the polar that the simulated boat sails by, None for the simulator's own hull."""
    return None if mission.boat.polar == OWN else polar_of(mission)


def recentre_m(mission: Mission) -> float:
    """Return how far the simulated boat's metres serve: those of a passage as far as the companion's [m]."""
    return (mission.passage.recentre_m or RECENTRE_M) if mission.is_passage else FRAME_M

"""The values that several rooms share.

Every value is frozen, made of keywords, carries ``t_s`` where it has a moment, and is checked when it is made:
a value that exists is finite and in range. What is not known is ``None``.

Units are in the names: metres, seconds, radians, true north clockwise, local east-north frame. Geographic
positions are the one exception and say ``_deg``. A wind direction is where the wind comes from
(``twd_from_rad``); angles to the bow are positive to starboard (``awa_rad``, ``twa_rad``).
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


def _finite(**values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not math.isfinite(value):
            raise ValueError(f"{name} is {value}, not a finite number")


# --------------------------------------------------------------------------------------------- place
@dataclass(frozen=True, slots=True, kw_only=True)
class GeoPoint:
    """A WGS 84 position: latitude [deg, ±90] north, longitude [deg, ±180] east."""

    lat_deg: float
    lon_deg: float

    def __post_init__(self) -> None:
        _finite(lat_deg=self.lat_deg, lon_deg=self.lon_deg)
        if not -90.0 <= self.lat_deg <= 90.0:
            raise ValueError(f"latitude {self.lat_deg} is outside ±90 degrees")
        if not -180.0 <= self.lon_deg <= 180.0:
            raise ValueError(f"longitude {self.lon_deg} is outside ±180 degrees")


# ------------------------------------------------------------------------------------------- vehicle
class Mode(enum.IntEnum):
    """ArduRover's modes by their custom_mode number."""

    MANUAL = 0
    ACRO = 1
    STEERING = 3
    HOLD = 4
    LOITER = 5
    FOLLOW = 6
    SIMPLE = 7
    DOCK = 8
    CIRCLE = 9
    AUTO = 10
    RTL = 11
    SMART_RTL = 12
    GUIDED = 15
    INITIALISING = 16


class MissionState(enum.IntEnum):
    """MISSION_STATE of MISSION_CURRENT."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleState:
    """Where the boat is and how it moves (GLOBAL_POSITION_INT and ATTITUDE)."""

    t_s: float
    boot_s: float
    position: GeoPoint
    velocity_en_mps: tuple[float, float]
    heading_rad: float
    roll_rad: float | None = None
    yaw_rate_radps: float | None = None

    def __post_init__(self) -> None:
        _finite(
            t_s=self.t_s,
            boot_s=self.boot_s,
            ve=self.velocity_en_mps[0],
            vn=self.velocity_en_mps[1],
            heading_rad=self.heading_rad,
            roll_rad=self.roll_rad,
            yaw_rate_radps=self.yaw_rate_radps,
        )

    @property
    def speed_mps(self) -> float:
        """Speed over ground [m/s]."""
        return math.hypot(*self.velocity_en_mps)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotStatus:
    """What the autopilot says of itself (HEARTBEAT, MISSION_CURRENT, NAV_CONTROLLER_OUTPUT, SYS_STATUS and others)."""

    t_s: float
    boot_s: float | None = None
    vehicle_type: int | None = None
    mode: Mode | None = None
    is_armed: bool = False
    system_status: int = 0
    ekf_ok: bool = False
    gps_fix: int | None = None
    gps: GeoPoint | None = None  # what its receiver says, the filter apart; None: no fix
    gps2: GeoPoint | None = None  # the same of a second receiver, where there is one
    mission_seq: int | None = None
    mission_total: int | None = None
    mission_state: MissionState = MissionState.UNKNOWN
    waypoint_distance_m: float | None = None
    target_bearing_rad: float | None = None
    cross_track_m: float | None = None  # positive: the boat is to the RIGHT of its leg (the wire has the reverse)
    battery_v: float | None = None
    battery_remaining: float | None = None
    battery_failed: bool | None = None  # its battery failsafe has spoken, or the monitor is ill
    receiver_lost: bool | None = None  # it hears no transmitter
    fence_on: bool | None = None  # it has told of a fence, and does; None: never
    fence_breached: bool | None = None
    fence_breaches: int | None = None  # since the boot; outside the home circle one more every 20 m
    rc_us: tuple[int, ...] = ()  # what the receiver hears, by channel from 1 [us]
    servo_us: tuple[int, ...] = ()  # what its servo outputs are told, by number from 1 [us]; 0: nothing
    home: GeoPoint | None = None
    utc_at_boot_s: float | None = None  # Unix time of its start, once it knows the time
    sounds: bool | None = None  # its sounder has told of the bottom, and does; None: never
    depth_m: float | None = None  # of the water below the sounder, by several pings; None: not told, or out of reach
    depth_rate_mps: float | None = None  # how that changes, negative where it shoals
    sensors: tuple[tuple[str, float], ...] = ()  # told now by a script on it, by name (``companion.safety.SENSORS``)

    def unix_s(self, t_s: float) -> float | None:
        """Return the time at ``t_s`` [s since 1970] by the autopilot's clock, which GPS sets; None: it has told none.

        Our own clock is not asked: a board without a battery begins somewhere in the past.
        """
        if self.utc_at_boot_s is None or self.boot_s is None:
            return None
        return self.utc_at_boot_s + self.boot_s + t_s - self.t_s

    def sensor(self, name: str) -> float | None:
        """Return what a script on the autopilot tells under this name, None: nothing now."""
        return dict(self.sensors).get(name) if self.sensors else None


class Severity(enum.IntEnum):
    """MAVLink's MAV_SEVERITY, of what the companion says."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusText:
    """A STATUSTEXT: severity 0 emergency .. 7 debug."""

    t_s: float
    severity: int
    text: str
    source_component: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Sounding:
    """A ping of a sounder that the companion itself hears: the depth below its transducer [m], None without an echo.

    ``offset_m`` is what the instrument says of where that lies: positive to the water's surface, negative to the keel.
    """

    t_s: float
    depth_m: float | None = None
    offset_m: float | None = None
    most_m: float = math.inf  # it reaches no farther


# ---------------------------------------------------------------------------------------------- wind
class WindSource(enum.Enum):
    """Who made the sample."""

    AUTOPILOT_TRUE = "autopilot_true"  # WIND: low-passed by WNDVN_TRUE_FILT
    APPARENT = "apparent"  # AppWnd* with heading and ground velocity, ours
    SIMULATED = "simulated"  # by a study or a test: nothing has filtered it


class WindQuality(enum.Enum):
    """How far the sample may be believed."""

    GOOD = "good"
    TURNING = "turning"  # within a manoeuvre: compass and vane lag
    LIGHT = "light"  # direction nearly without meaning
    HELD = "held"  # the autopilot holds an old value
    SUSPECT = "suspect"  # a fault detector objects
    INVALID = "invalid"


@dataclass(frozen=True, slots=True, kw_only=True)
class WindSample:
    """One reading of the true wind over ground: from where [rad, true north], how fast [m/s]."""

    t_s: float
    twd_from_rad: float
    tws_mps: float
    source: WindSource = WindSource.AUTOPILOT_TRUE
    quality: WindQuality = WindQuality.GOOD

    def __post_init__(self) -> None:
        _finite(t_s=self.t_s, twd_from_rad=self.twd_from_rad, tws_mps=self.tws_mps)
        if not 0.0 <= self.tws_mps <= 100.0:
            raise ValueError(f"true wind speed {self.tws_mps} m/s is out of range 0..100")


@dataclass(frozen=True, slots=True, kw_only=True)
class ApparentWind:
    """The wind on the moving boat: speed [m/s], angle from the bow [rad, -π..π), starboard positive."""

    t_s: float
    awa_rad: float
    aws_mps: float

    def __post_init__(self) -> None:
        _finite(t_s=self.t_s, awa_rad=self.awa_rad, aws_mps=self.aws_mps)
        if not 0.0 <= self.aws_mps <= 100.0:
            raise ValueError(f"apparent wind speed {self.aws_mps} m/s is out of range 0..100")


@dataclass(frozen=True, slots=True, kw_only=True)
class WindForecast:
    """The wind to come, as a table over horizons that the planner interpolates.

    All arrays are float64 of shape (n,) except ``half_width_rad`` (n, m). ``horizon_s`` is strictly increasing
    and starts at 0 or later. ``half_width_rad[i, j]`` is the half width of the central interval that holds the
    direction at ``horizon_s[i]`` with probability ``level[j]``; it carries heavy tails that sigma does not.
    """

    t_s: float
    horizon_s: NDArray[np.float64]
    mean_twd_from_rad: NDArray[np.float64]
    sigma_twd_rad: NDArray[np.float64]
    mean_tws_mps: NDArray[np.float64]
    sigma_tws_mps: NDArray[np.float64]
    level: NDArray[np.float64]
    half_width_rad: NDArray[np.float64]
    correlation_time_s: float

    def __post_init__(self) -> None:
        n = self.horizon_s.shape[0]
        if n == 0 or not bool((self.horizon_s[1:] > self.horizon_s[:-1]).all()):
            raise ValueError("horizon_s must be strictly increasing and not empty")
        for name in ("mean_twd_from_rad", "sigma_twd_rad", "mean_tws_mps", "sigma_tws_mps"):
            array = getattr(self, name)
            if array.shape != (n,) or not bool(np.isfinite(array).all()):
                raise ValueError(f"{name} must be {n} finite numbers")
        if self.half_width_rad.shape != (n, self.level.shape[0]):
            raise ValueError("half_width_rad must be (horizons, levels)")
        if not self.correlation_time_s > 0.0:
            raise ValueError("correlation_time_s must be positive")


# ------------------------------------------------------------------------------------------- traffic
@dataclass(frozen=True, slots=True, kw_only=True)
class AisReport:
    """One report of another vessel; what it did not say is None. ``age_s`` is how old it was at ``t_s``."""

    t_s: float
    mmsi: int
    position: GeoPoint | None = None
    course_rad: float | None = None
    speed_mps: float | None = None
    heading_rad: float | None = None
    turn_rate_radps: float | None = None
    nav_status: int | None = None
    ship_type: int | None = None
    name: str | None = None
    bow_m: float | None = None
    stern_m: float | None = None
    port_m: float | None = None
    starboard_m: float | None = None
    is_class_b: bool = False
    age_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """The vessel behind a disc, as predicted: a Gaussian about a mean that goes the disc's way at the disc's velocity.

    The standard deviations are linear in time through the disc's window, chords of the convex prediction and so never
    less than it. Errors persist: a vessel that is one sigma ahead of its mean stays one sigma ahead of it.

    Attributes:
        vessel: whose; the windows of one vessel share it.
        x_m, y_m: the mean at t = 0 [m].
        course_rad: of the axis "along".
        keep_m: our boat's middle nearer than this to the hull's middle is what must not happen: both hulls and the
            clearance asked for.
        along_m, along_mps: standard deviation along the course at t = 0 and its growth.
        across_m, across_mps: the same across it.
        own_mps: how fast our own place along the plan becomes uncertain, one standard deviation.
        sigma_m, sigma_mps: the chord of the larger of both with our own: what the disc is sized by.

    """

    vessel: int
    x_m: float
    y_m: float
    course_rad: float
    keep_m: float
    along_m: float
    along_mps: float
    across_m: float
    across_mps: float
    own_mps: float
    sigma_m: float
    sigma_mps: float

    @property
    def numbers(self) -> tuple[float, ...]:
        """All figures, for a check that they are finite."""
        return (
            self.x_m,
            self.y_m,
            self.course_rad,
            self.keep_m,
            self.along_m,
            self.along_mps,
            self.across_m,
            self.across_mps,
            self.own_mps,
            self.sigma_m,
            self.sigma_mps,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A moving disc to keep out of: at (x + vx t, y + vy t), radius ``radius_m + growth_mps t``, in its window.

    Times count from the moment for which it was made. With a ``spread`` it is a vessel's prediction: the radius is that
    without any doubt, and how much doubt is added follows from the promise (``companion.planner.risk``). ``mmsi`` says
    whose it is; None: nobody's.
    """

    x_m: float
    y_m: float
    vx_mps: float = 0.0
    vy_mps: float = 0.0
    radius_m: float
    growth_mps: float = 0.0
    from_s: float = 0.0
    until_s: float = math.inf
    name: str = ""
    mmsi: int | None = None
    spread: Spread | None = None

    def centre_en_m(self, t_s: float) -> tuple[float, float]:
        """Return the centre at ``t_s``."""
        return self.x_m + self.vx_mps * t_s, self.y_m + self.vy_mps * t_s

    def radius_at_m(self, t_s: float) -> float:
        """Return the radius at ``t_s``."""
        return self.radius_m + self.growth_mps * t_s

    def row(self, wider_m: float = 0.0) -> tuple[float, ...]:
        """Return the disc, so much wider, as a row of what ``companion.geo.kernels.first_met`` asks for."""
        motion = self.x_m, self.y_m, self.vx_mps, self.vy_mps
        return *motion, self.radius_m + wider_m, self.growth_mps, self.from_s, self.until_s


# ------------------------------------------------------------------------------------------- mission
class MissionType(enum.IntEnum):
    """Which list of the autopilot (MAV_MISSION_TYPE)."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class Command(enum.IntEnum):
    """The MAV_CMD numbers that this project writes or understands in missions, fences and rally lists."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_DELAY = 93
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_FENCE_ENABLE = 207
    NAV_FENCE_RETURN_POINT = 5000
    NAV_FENCE_POLYGON_VERTEX_INCLUSION = 5001
    NAV_FENCE_POLYGON_VERTEX_EXCLUSION = 5002
    NAV_FENCE_CIRCLE_INCLUSION = 5003
    NAV_FENCE_CIRCLE_EXCLUSION = 5004
    NAV_RALLY_POINT = 5100


# A mission ends here: nothing behind such an item is ever sailed.
ENDING = frozenset({Command.NAV_LOITER_UNLIM, Command.NAV_RETURN_TO_LAUNCH})
MOST_FLOAT32 = 3.4028234663852886e38


def float32(value: float) -> float:
    """Return a number as MAVLink carries it: in single precision, and infinite beyond ``MOST_FLOAT32``.

    >>> float32(0.1), float32(-1e39)
    (0.10000000149011612, -inf)
    """
    return float(np.float32(value)) if abs(value) <= MOST_FLOAT32 else value * math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionItem:
    """One item of a mission, fence or rally list, as files and the wire carry it.

    ``lat_e7`` and ``lon_e7`` are the wire's integers (degrees x 1e7), so that equality after a read-back means
    equality on the autopilot. Items have no sequence number: a list's order is its numbering, and a mission's
    item 0 (home) belongs to the transfer, not to the list.
    """

    command: int
    lat_e7: int = 0
    lon_e7: int = 0
    alt_m: float = 0.0
    frame: int = 3  # MAV_FRAME_GLOBAL_RELATIVE_ALT
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    autocontinue: bool = True

    def __post_init__(self) -> None:
        if not 0 <= self.command <= 0xFFFF:
            raise ValueError(f"command {self.command} is not a MAV_CMD")
        if abs(self.lat_e7) > 900_000_000 or abs(self.lon_e7) > 1_800_000_000:
            raise ValueError(f"item at {self.lat_e7 / 1e7}, {self.lon_e7 / 1e7} is not on the globe")

    @property
    def point(self) -> GeoPoint:
        """The item's position."""
        return GeoPoint(lat_deg=self.lat_e7 / 1e7, lon_deg=self.lon_e7 / 1e7)


def sailed_part(items: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return the items up to and with the first that ends a mission: what the boat can ever sail.

    What follows it is an old tail that a shorter upload left behind.
    """
    end = next((n for n, item in enumerate(items, start=1) if item.command in ENDING), len(items))
    return tuple(items[:end])


def waypoint(point: GeoPoint, *, command: int = Command.NAV_WAYPOINT) -> MissionItem:
    """Return an item at ``point``."""
    return MissionItem(command=command, lat_e7=round(point.lat_deg * 1e7), lon_e7=round(point.lon_deg * 1e7))


# -------------------------------------------------------------------------------------------- status
@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficStatus:
    """What the companion sees of other vessels. The figures are those of the worst of them, None without one.

    ``alarm`` is none, warn, act or touch, ``role`` and ``rule`` are what COLREGs ask of us; all empty without a vessel.
    """

    vessels: int = 0
    refused: int = 0  # reports and sentences left out: too old, too far, damaged
    feeds: int = 0  # AIS feeds of our own ...
    silent_feeds: int = 0  # ... and those unheard for a minute
    shared_mmsi: int = 0  # two vessels with one MMSI, times
    clock_jumps: int = 0
    silence_s: float | None = None  # since any report; None: never
    promised_risk: float | None = None  # the vessels' part of what the plan promises at each instant ...
    path_risk: float | None = None  # ... and of the whole path
    name: str = ""
    alarm: str = ""
    role: str = ""
    rule: str = ""
    range_m: float | None = None  # between hulls, as is what follows
    bearing_rad: float | None = None
    cpa_m: float | None = None
    tcpa_s: float | None = None

    def __post_init__(self) -> None:
        _finite(promised_risk=self.promised_risk, path_risk=self.path_risk)
        _finite(
            silence_s=self.silence_s,
            range_m=self.range_m,
            bearing_rad=self.bearing_rad,
            cpa_m=self.cpa_m,
            tcpa_s=self.tcpa_s,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class CompanionStatus:
    """What the companion says of itself over the radio; the shore reads it with ``companion status``.

    Seen from the companion ``t_s`` is its own time; ages and distances are those at ``t_s``. ``promised_risk`` is the
    plan's probability of not staying clear [0..1]; ``next_tack_s`` is the time until the next tack, planned or the
    autopilot's own.
    """

    t_s: float
    state: str  # the skipper's phase in words
    goal_index: int | None = None  # the goal sailed for now, from 0
    goal_count: int | None = None
    waypoint_seq: int | None = None  # as MISSION_CURRENT counts: 1 is the first after home
    waypoint_count: int | None = None
    waypoint_distance_m: float | None = None
    goal_distance_m: float | None = None
    cross_track_m: float | None = None  # positive: right of the leg
    clearance_m: float | None = None  # to the nearest obstacle or fence now
    twd_from_rad: float | None = None
    twd_sigma_rad: float | None = None
    tws_mps: float | None = None
    tws_sigma_mps: float | None = None
    current_set_rad: float | None = None  # where the current that plans reckon with goes; None: none is known
    current_drift_mps: float | None = None
    next_tack_s: float | None = None
    promised_risk: float | None = None
    plan_id: int | None = None
    plan_age_s: float | None = None
    replans: int | None = None
    tacks: int | None = None
    battery_v: float | None = None
    position: GeoPoint | None = None
    bytes_out_per_s: float | None = None  # own traffic
    traffic: TrafficStatus | None = None  # None: no vessel was ever heard and there is no feed
    order: str = ""  # the verb of the order that stands; empty: none does
    order_age_s: float | None = None
    plan_answer_s: float | None = None  # nine plans of ten take so long, told of a slow computer; None: it is not
    figures: tuple[tuple[str, float], ...] = ()  # of the table (``companion.figures``), by name; sent beside the wind
    alert_code: str = ""  # the rule or watchdog that speaks; empty: all is well
    alert_text: str = ""
    disk_trouble: str = ""  # while it lasts, whatever else speaks; not on the air, where it is an alert if nothing is
    gone: str = ""  # likewise of a page, a socket, an output

    def __post_init__(self) -> None:
        _finite(
            t_s=self.t_s,
            waypoint_distance_m=self.waypoint_distance_m,
            goal_distance_m=self.goal_distance_m,
            cross_track_m=self.cross_track_m,
            clearance_m=self.clearance_m,
            twd_from_rad=self.twd_from_rad,
            twd_sigma_rad=self.twd_sigma_rad,
            tws_mps=self.tws_mps,
            tws_sigma_mps=self.tws_sigma_mps,
            current_set_rad=self.current_set_rad,
            current_drift_mps=self.current_drift_mps,
            next_tack_s=self.next_tack_s,
            promised_risk=self.promised_risk,
            plan_age_s=self.plan_age_s,
            battery_v=self.battery_v,
            bytes_out_per_s=self.bytes_out_per_s,
            order_age_s=self.order_age_s,
            plan_answer_s=self.plan_answer_s,
            **dict(self.figures),
        )

"""What the skipper sees: one value per step, with one ``t_s`` and the age of each part.

The application builds it about once a second. Outcomes of earlier actions and events since the last step come
in it, each exactly once.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from companion.boat import AutopilotLimits
from companion.current import STILL_WATER, VaneError, WaterCurrent, WindAngleUncertainty
from companion.geofence import Zone
from companion.mavlink.vehicle_identity import Identity
from companion.messages import AutopilotStatus, MissionItem, Mode, StatusText, VehicleState, WindForecast
from companion.orders import Order
from companion.skipper.step.config import DRY_RUN, Permissions
from companion.skipper.way.voyage import PointEn
from companion.traffic import TrafficPicture

SPEED_MPS = 5.0
SIGMA_RAD = 1e-3
SETTLED_S = 1e6
_SETTLED_AT_S = np.array([0.0, 3600.0])
_LEVELS = np.array([0.5, 0.8, 0.9, 0.95])


class WindHealth(enum.Enum):
    """How far the wind may be believed."""

    NONE = "none"  # nothing heard
    SETTLING = "settling"  # too short a record to forecast from
    GOOD = "good"
    LIGHT = "light"  # the direction is nearly without meaning
    UNTRUSTED = "untrusted"  # frozen, turned or silent vane, or none


@dataclass(frozen=True, slots=True, kw_only=True)
class WindEstimate:
    """The wind now and to come. ``mean`` is the 90 s mean and ``present`` the 5 s mean (Büsser 3.1.1)."""

    health: WindHealth = WindHealth.NONE
    forecast: WindForecast | None = None
    mean_twd_from_rad: float | None = None
    mean_tws_mps: float | None = None
    sigma_twd_rad: float | None = None
    present_twd_from_rad: float | None = None
    present_tws_mps: float | None = None
    record_s: float = 0.0  # length of the record behind the forecast
    verdict: str = ""  # why it is not GOOD, in words


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionOnBoard:
    """The mission as last read from the autopilot; ``items`` is None until it was read. Home is not in it."""

    items: tuple[MissionItem, ...] | None = None
    read_t_s: float | None = None


# ------------------------------------------------------------------------------------------- events
@dataclass(frozen=True, slots=True, kw_only=True)
class ModeChanged:
    """The heartbeat's mode changed."""

    before: Mode | None
    after: Mode | None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotRebooted:
    """The autopilot's boot time went back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Disbelieved:
    """Something heard that cannot be, or that could not be digested: said once, and not used."""

    what: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterChanged:
    """Somebody has set a parameter that changes what a sensor says or how the boat sails: old and new, in words."""

    name: str
    text: str


Event = ModeChanged | AutopilotRebooted | StatusText | Order | Disbelieved | ParameterChanged


# ----------------------------------------------------------------------------------------- outcomes
@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOutcome:
    """The answer to RequestPlan; ``plan`` is None when the worker died or the request was refused."""

    request_id: int
    plan: Any = None  # companion.planner.Plan
    text: str = ""


class UploadResult(enum.Enum):
    """How a transfer ended."""

    OK = "ok"  # written, read back, equal, and current where that was asked
    REFUSED = "refused"  # the autopilot said no; text has its words
    TIMEOUT = "timeout"
    MISMATCH = "mismatch"  # what was read back is not what was written
    LINK = "link"  # the link died


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadOutcome:
    """The answer to UploadMission or UploadFence."""

    upload_id: int
    result: UploadResult
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadOutcome:
    """The answer to ReadMission; ``items`` without home, None when it failed."""

    read_id: int
    items: tuple[MissionItem, ...] | None = None
    text: str = ""


class CommandResult(enum.Enum):
    """How a command ended."""

    ACCEPTED = "accepted"
    REFUSED = "refused"  # text has the autopilot's reason verbatim
    TIMEOUT = "timeout"


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandOutcome:
    """The answer to SetMode, Arm, SetCurrent or SetParameter."""

    command_id: int
    result: CommandResult
    text: str = ""


Outcome = PlanOutcome | UploadOutcome | ReadOutcome | CommandOutcome


@dataclass(frozen=True, slots=True, kw_only=True)
class WindBefore:
    """The wind as it was before it came to be doubted.

    ``twd_from_rad`` [rad] and ``tws_mps`` are its mean, ``turned_rad`` by how much what is told of it has turned since
    [rad, positive clockwise].
    """

    twd_from_rad: float
    tws_mps: float
    turned_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedSeen:
    """What the boat was lately seen to make of the speeds that its plans are of.

    ``share`` of them, which may be off by ``error`` (standard deviation of the logarithm) in what comes, rests on
    ``tries`` of its way; 0: nothing was seen.
    """

    share: float = 1.0
    error: float = 0.0
    tries: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """All that is known at ``t_s``. Ages are seconds since the part was heard; None: never."""

    t_s: float
    vehicle: VehicleState | None = None
    vehicle_age_s: float | None = None
    position_en_m: PointEn | None = None
    autopilot: AutopilotStatus | None = None
    autopilot_age_s: float | None = None
    heartbeat_age_s: float | None = None
    wind: WindEstimate = WindEstimate()
    current: WaterCurrent = STILL_WATER
    doubt: WindAngleUncertainty | None = None
    speed_seen: SpeedSeen = SpeedSeen()
    unsure: str = ""  # why no plan may be made for wind and water now, in words; empty: it may
    vane: VaneError | None = None  # what the boat's own motion tells of the vane
    vane_offset_rad: float | None = None  # WNDVN_DIR_OFS, as the autopilot adds it; None: not read, or it has none
    wind_before: WindBefore | None = None  # while the wind is doubted: what it was; None: not known, or believed
    mission: MissionOnBoard = MissionOnBoard()
    identity: Identity = field(default_factory=Identity)  # as far as the autopilot has told it
    neighbours: tuple[str, ...] = ()  # other autopilots on a link on which ours was not named, in words
    shore_age_s: float | None = None  # since a ground station was heard
    has_company: bool = False  # another companion speaks with our ids
    limits: AutopilotLimits | None = None  # None: not read yet
    fence: tuple[Zone, ...] = ()  # drawn on the autopilot, as last read; (): nothing is, or it was not read
    permissions: Permissions = DRY_RUN
    planner_alive: bool = True
    traffic: TrafficPicture | None = None  # None: no vessel was ever heard
    events: tuple[Event, ...] = ()
    outcomes: tuple[Outcome, ...] = ()

    def unix_s(self, t_s: float) -> float | None:
        """Return the time at ``t_s`` by the autopilot's clock (``AutopilotStatus.unix_s``)."""
        return None if self.autopilot is None else self.autopilot.unix_s(t_s)


def wind_now(snapshot: Snapshot) -> tuple[float, float] | None:
    """Return the wind to judge the present by: (from where [rad], how fast [m/s]), None when nothing is known."""
    wind = snapshot.wind
    if wind.present_twd_from_rad is not None and wind.present_tws_mps is not None:
        return wind.present_twd_from_rad, wind.present_tws_mps
    if wind.mean_twd_from_rad is not None and wind.mean_tws_mps is not None:
        return wind.mean_twd_from_rad, wind.mean_tws_mps
    if wind.forecast is not None:
        return float(wind.forecast.mean_twd_from_rad[0]), float(wind.forecast.mean_tws_mps[0])
    return None


def wind_mean(snapshot: Snapshot) -> tuple[float, float] | None:
    """Return the 90 s mean wind, or what there is of it."""
    wind = snapshot.wind
    if wind.mean_twd_from_rad is not None and wind.mean_tws_mps is not None:
        return wind.mean_twd_from_rad, wind.mean_tws_mps
    return wind_now(snapshot)


# --------------------
# The wind of a boat that does not sail: plans and rules that ask for one are given this, and none is waited for.
# A motorboat has no no-go zone and the same speed at every angle, so that any wind is as good as none; what its vane,
# if it has one, tells is on record and in the status, and steers nothing.


def still_air(t_s: float) -> WindEstimate:
    """Return the wind that a motorboat is planned in: steady, believed, and of no consequence."""
    n = len(_SETTLED_AT_S)
    forecast = WindForecast(
        t_s=t_s,
        horizon_s=_SETTLED_AT_S,
        mean_twd_from_rad=np.zeros(n),
        sigma_twd_rad=np.full(n, SIGMA_RAD),
        mean_tws_mps=np.full(n, SPEED_MPS),
        sigma_tws_mps=np.full(n, SIGMA_RAD),
        level=_LEVELS,
        half_width_rad=np.full((n, len(_LEVELS)), SIGMA_RAD),
        correlation_time_s=3600.0,
    )
    return WindEstimate(
        health=WindHealth.GOOD,
        forecast=forecast,
        mean_twd_from_rad=0.0,
        mean_tws_mps=SPEED_MPS,
        sigma_twd_rad=SIGMA_RAD,
        present_twd_from_rad=0.0,
        present_tws_mps=SPEED_MPS,
        record_s=SETTLED_S,
    )

"""What a simulated autopilot is told before it boots, and what it tells those who judge it."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from companion.boat import Polar
from companion.messages import GeoPoint, Mode
from sitl.world import SimulatedSounder, Waters


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves:
    """A seaway: what it takes from the boat's speed and how it turns the boat about.

    Attributes:
        from_rad: where the waves come from.
        loss: the share of the boat's speed that is lost head to sea; none with it, half of it abeam.
        yaw_rad: how far the boat's bow swings to each side.
        period_s: of that swing.
    """

    from_rad: float = 0.0
    loss: float = 0.0
    yaw_rad: float = 0.0
    period_s: float = 4.0

    def share(self, heading_rad: float) -> float:
        """Return the share of the boat's speed that is left on a heading."""
        return 1.0 - self.loss * 0.5 * (1.0 + math.cos(heading_rad - self.from_rad))

    def wobble_radps(self, t_s: float) -> float:
        """Return the turn that the waves give the boat."""
        rate_hz = 2.0 * math.pi / self.period_s
        return self.yaw_rad * rate_hz * math.cos(rate_hz * t_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """Sensors that err all the time, and that nobody knows of.

    Attributes:
        vane_rad: the vane points so far to starboard of the wind's true angle.
        compass_rad: the heading is told so far to starboard of the true one.
        deviation_rad: beside it, the compass errs by this times the sine of heading less ``deviation_at_rad``: what
            the iron of a boat does, in its first and greatest terms (coefficients B and C).
        deviation_at_rad: the heading on which that error is none.
        gps_noise_m: spread of the position's error, east and north each; it wanders (a Gauss-Markov process) ...
        gps_noise_s: ... with this correlation time.
        gps_lag_s: the position is so old.
    """

    vane_rad: float = 0.0
    compass_rad: float = 0.0
    deviation_rad: float = 0.0
    deviation_at_rad: float = 0.0
    gps_noise_m: float = 0.0
    gps_noise_s: float = 30.0
    gps_lag_s: float = 0.0

    def compass_error_rad(self, heading_rad: float) -> float:
        """Return how far to starboard the compass errs on a heading."""
        return self.compass_rad + self.deviation_rad * math.sin(heading_rad - self.deviation_at_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class Departures:
    """A boat that is not the plan's.

    Attributes:
        beat, reach, run: shares of the polar's speed at 45, 90 and 150 degrees to the true wind, straight between.
        leeway_rad: on a beat, the apparent wind 30 degrees off the bow and three times as fast as the boat.
        tack_fails: the chance that a tack does.
        irons_s: for so long the boat lies near head to wind then, before it falls off to the old tack.
        waves: the seaway.
        sensors: what errs.
    """

    beat: float = 1.0
    reach: float = 1.0
    run: float = 1.0
    leeway_rad: float = 0.0
    tack_fails: float = 0.0
    irons_s: float = 10.0
    waves: Waves = field(default_factory=Waves)
    sensors: Sensors = field(default_factory=Sensors)


HOME = GeoPoint(lat_deg=51.1, lon_deg=-1.3)

FRAME_M = 50_000.0  # metres about one place are good to here

# 2026-06-09, 10:13 UTC. Unix time of every simulated voyage's start: stamps must not depend on when it was run.
EPOCH_S = 1_781_000_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotConfig:
    """One boat.

    Attributes:
        home: where it lies at power-up; the origin of ``Truth.east_m`` and ``north_m`` until it is ``recentre_m`` off.
        recentre_m: so far from the origin of its metres the boat is what they count from next.
        heading_rad: of the bow at power-up.
        is_warm: powered up long ago: boot time starts at 60 s, EKF ready, filters settled, wind there from the
            first step. Otherwise it boots as the real one does: wind after 5 s, ready after 42 s.
        is_moored: lies still until it is armed. The real simulator drifts with the wind from the start.
        sysid: MAVLink system id.
        uid: of its board, as AUTOPILOT_VERSION tells it.
        vehicle_type: MAV_TYPE of its heartbeat; another than a boat's is a neighbour that only speaks like one.
        parameters: values other than the fresh boat's, by name.
        battery_v: at the start; ``SimulatedAutopilot.set_battery`` changes it.
        has_ftp: offer MAVFTP; small boards are built without it.
        polar: of a boat that is not the simulator's own; None: the simulator's.
        has_motor: an auxiliary motor, run by DO_AUX_FUNCTION 74.
        is_motorboat: it has no sail, and its motor runs; ``SAIL_ENABLE`` and ``WNDVN_TYPE`` are 0.
        epoch_s: Unix time of the start, as its GPS tells it.
        departures: what the boat is that is not the plan's; None: nothing.
        waters: wind and stream by place, in metres from home; None: the wind alone, everywhere the same.
        sounder: of the bottom under it; None: none but what a scenario's events tell.
        hears_sounder: whether it is wired to the autopilot; False: somebody else hears it.
        new_parameter_names: answer to ArduPilot 4.7's names (MAV_SYSID) instead of the older ones.
    """

    home: GeoPoint = HOME
    recentre_m: float = FRAME_M
    heading_rad: float = 0.0
    is_warm: bool = False
    is_moored: bool = False
    sysid: int = 1
    uid: bytes = b"simulated"
    vehicle_type: int = 11
    parameters: Mapping[str, float] = field(default_factory=dict)
    battery_v: float = 12.6
    new_parameter_names: bool = False
    has_ftp: bool = True
    polar: Polar | None = None
    has_motor: bool = False
    is_motorboat: bool = False
    epoch_s: float = EPOCH_S
    departures: Departures | None = None
    waters: Waters | None = None
    sounder: SimulatedSounder | None = None
    hears_sounder: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What is so, whatever the sensors and the telemetry say. Read by judges and plots, never by a companion.

    ``t_s`` is the simulated time since the ``SimulatedAutopilot`` was made (a reboot does not set it back); the wind is
    the true wind that acts on the boat now. Metres are east and north of ``AutopilotConfig.home``, as said there.
    """

    t_s: float
    boot_s: float
    east_m: float
    north_m: float
    position: GeoPoint
    heading_rad: float
    speed_mps: float
    velocity_en_mps: tuple[float, float]
    twd_from_rad: float
    tws_mps: float
    mode: Mode
    is_armed: bool
    mission_seq: int
    tacks: int


class VaneState(enum.Enum):
    """How the wind vane is broken."""

    OK = "ok"
    FROZEN = "frozen"  # its angle to the bow stays as it is
    OFFSET = "offset"  # mounted wrong by ``value_rad``
    SPIKES = "spikes"  # one reading in fifty is anywhere within ``value_rad``


@dataclass(frozen=True, slots=True, kw_only=True)
class VaneFault:
    """A fault of the wind vane."""

    state: VaneState = VaneState.OK
    value_rad: float = 0.0

    @property
    def code(self) -> int:
        """The kernel's number for it."""
        return list(VaneState).index(self.state)


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsFault:
    """A fault of the position: an offset, or no fix.

    ``is_resisted``: the EKF does as the real one did with a jump of 30 m: it holds out for 3.8 s, then takes the
    new position, and its failsafe puts the boat in HOLD one second later. Otherwise the offset is believed at once
    and in silence, as with a spoofed or slowly drifting receiver.
    ``over_s``: the offset grows evenly for so long, and the velocity that is told has it in it, as a patient forger's
    has. ``is_of_one``: it befalls one receiver of two; from then on the other is there, and tells the truth.
    """

    east_m: float = 0.0
    north_m: float = 0.0
    is_lost: bool = False
    is_resisted: bool = False
    over_s: float = 0.0
    is_of_one: bool = False

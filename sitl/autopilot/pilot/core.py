"""What every part of the autopilot stands on: the boat, its parameters, the clock since boot, home, the voice."""

from __future__ import annotations

import enum
import math

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import HomeChart, Surroundings, Vehicle
from sitl.autopilot.config import AutopilotConfig
from sitl.autopilot.link import Voice
from sitl.world import WindModel

# Entering one of these gives the navigation its limits of acceleration and jerk.
NAVIGATING = frozenset({Mode.AUTO, Mode.GUIDED, Mode.RTL, Mode.SMART_RTL})
POSITION_MODES = frozenset({Mode.AUTO, Mode.GUIDED, Mode.RTL, Mode.SMART_RTL, Mode.LOITER})
KNOWN = frozenset(
    {Mode.MANUAL, Mode.ACRO, Mode.STEERING, Mode.HOLD, Mode.LOITER, Mode.AUTO, Mode.RTL, Mode.SMART_RTL, Mode.GUIDED}
)


class MissionTask(enum.Enum):
    """What the boat is doing within its mode."""

    LEG = "leg"  # to a waypoint of the mission
    RTL = "rtl"
    GUIDED = "guided"  # to a position that was sent
    SETPOINT = "setpoint"  # a heading or turn rate that was sent
    LOITER = "loiter"
    HOLD = "hold"


INVALID_RESULT = 0x20000000
"""AP_InternalError's bit of an argument or result that cannot be."""
INTERNAL_ERROR = f"Internal errors 0x{INVALID_RESULT:x} l:90 invalid arguments"
WARM_BOOT_S = 60.0

MOTORBOAT = {"SAIL_ENABLE": 0.0, "WNDVN_TYPE": 0.0}  # there is no sail, and nothing that tells the wind


class Core:
    """State that belongs to no single part. ``power_up`` forgets what a reboot forgets."""

    def __init__(self, config: AutopilotConfig, wind: WindModel, seed: int) -> None:
        self.config = config
        self.voice = Voice(config.sysid)
        self.chart = HomeChart(config.home)
        given = {**(MOTORBOAT if config.is_motorboat else {}), **config.parameters}
        self.parameters = Parameters(given, new_names=config.new_parameter_names)
        twd, tws = wind.at(0.0)
        self.parameters.put("SIM_WIND_DIR", math.degrees(twd))
        self.parameters.put("SIM_WIND_SPD", tws)
        self.parameters.put("SYSID_THISMAV", float(config.sysid))
        self.vehicle = Vehicle(
            wind,
            self.parameters,
            heading_rad=config.heading_rad,
            is_moored=config.is_moored,
            seed=seed,
            polar=config.polar,
            surroundings=_about(config, wind, seed),
        )
        self.run_motor(on=False)
        self._told = (self.vehicle.position, self.chart.to_e7(self.vehicle.position))
        self.battery_v = config.battery_v
        self.depth_m: float | None = None  # what an event has its sounder tell; None: what it hears of the bottom
        self.sensors: dict[str, float] = {}  # what a script of the boat's tells, by name
        self.roll_rad = 0.0
        self.power_up(-WARM_BOOT_S if config.is_warm else 0.0)
        if config.is_warm:
            self.vehicle.settle()
            self.take_origin()
            self.set_home(None)
        else:
            self.vehicle.still_air()

    def power_up(self, boot_at_s: float) -> None:
        """Start as at ``boot_at_s``: disarmed, without origin and home."""
        self.boot_at_s = boot_at_s
        self.reboot_at_s = math.inf
        self.voice.restart(self.t_s)
        self.vehicle.set_armed(armed=False)
        self.vehicle.clear_tack()
        self.vehicle.avoid(near=False, ease=False)
        self.is_armed = False
        self.internal_errors = 0
        self.has_origin = False
        self.origin_en = (0.0, 0.0)
        self.home_en: tuple[float, float] | None = None
        self.home_due_s = self.t_s  # of the next look at home, while disarmed

    # ---------------------------------------------------------------------------------------------- time
    @property
    def t_s(self) -> float:
        """Simulated time since the start [s]."""
        return self.vehicle.t_s

    @property
    def boot_s(self) -> float:
        """Time since power-up or reboot [s]."""
        return self.vehicle.t_s - self.boot_at_s

    @property
    def boot_ms(self) -> int:
        """Time since boot [ms]."""
        return round(self.boot_s * 1e3)

    @property
    def boot_us(self) -> int:
        """Time since boot [us]."""
        return round(self.boot_s * 1e6)

    def reboot_soon(self) -> None:
        """Reboot a moment after the acknowledgement has left."""
        self.reboot_at_s = self.t_s + 0.5

    # --------------------------------------------------------------------------------------------- place
    @property
    def latlon_e7(self) -> tuple[int, int]:
        """Where the autopilot believes to be [deg x 1e7]."""
        here = self.vehicle.position
        if self._told[0] != here:  # several messages of one loop tell it
            self._told = (here, self.chart.to_e7(here))
        return self._told[1]

    @property
    def sounding_m(self) -> float | None:
        """What its sounder tells of the depth now [m]; None: it has none, is silent, or hears no echo."""
        sounder = self.config.sounder
        if self.depth_m is not None or sounder is None:
            return self.depth_m
        return sounder.ping_m(self.chart.point(self.vehicle.true_position), self.t_s)

    def follow(self) -> bool:
        """Let all metres count from the boat when it is far from where they do; True: places must be taken anew."""
        if math.hypot(*self.vehicle.true_position) < self.config.recentre_m:
            return False
        shift = self.chart.follow(self.vehicle.true_position)
        self.vehicle.carry(shift)
        self.origin_en = shift.point(self.origin_en)
        self.home_en = None if self.home_en is None else shift.point(self.home_en)
        self._told = (self.vehicle.position, self.chart.to_e7(self.vehicle.position))
        return True

    def take_origin(self) -> None:
        """Let local positions count from here."""
        self.has_origin, self.origin_en = True, self.vehicle.position

    def set_home(self, en: tuple[float, float] | None) -> bool:
        """Set home, there or here; False without an origin."""
        if self.has_origin:
            self.home_en = en if en is not None else self.vehicle.position
        return self.has_origin

    # --------------------------------------------------------------------------------------------- state
    def set_armed(self, *, armed: bool) -> None:
        """Arm or disarm, whatever speaks against it."""
        self.is_armed = armed
        self.vehicle.set_armed(armed=armed)
        if not armed:
            self.home_due_s = self.t_s + 1.0

    def run_motor(self, *, on: bool) -> None:
        """Run the auxiliary motor, or not: there is no assistance in tacks here.

        As on the real one (measured) nothing is said by a boat that has none.
        """
        self.vehicle.run_motor(on=self.config.is_motorboat or (on and self.config.has_motor))

    def err_internally(self) -> None:
        """Find a result that cannot be, as the S-curve of a leg without limits is: no arming until a reboot."""
        self.voice.announce_after_ack(mav.MAV_SEVERITY_CRITICAL, f"Internal Errors 0x{INVALID_RESULT:x}")
        if not self.internal_errors:
            self.voice.announce_after_ack(mav.MAV_SEVERITY_CRITICAL, f"PreArm: {INTERNAL_ERROR}")
        self.internal_errors += 1

    @property
    def battery_percent(self) -> int:
        """Charge, reckoned from a three-cell battery's 9.6 to 12.6 V."""
        return max(0, min(100, round((self.battery_v - 9.6) / 3.0 * 100.0)))


def _about(config: AutopilotConfig, wind: WindModel, seed: int) -> Surroundings | None:
    if config.departures is None and config.waters is None:
        return None
    return Surroundings(wind, config.departures, config.waters, seed)

"""The simulated autopilot's core: bytes and time in, bytes out.

Everything happens on the loops of 20 ms that the real one runs at 50 Hz: what arrives is read at the next loop,
streams are sent on the loop in which they are due. Between two loops in which there is something to do, the
compiled kernel runs alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.messages import Mode
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.chart import Chart
from sitl.autopilot.config import EKF_READY_S, INVALID_RESULT, AutopilotConfig, GpsFault, Truth, VaneFault
from sitl.autopilot.pilot.failsafe import Failsafe
from sitl.autopilot.pilot.fence import CHECK_S, Fence
from sitl.autopilot.protocol.ftp import FtpServer
from sitl.autopilot.pilot.helm import Helm
from sitl.autopilot.links.link import LOOP_S, Link
from sitl.autopilot.protocol.parameter_server import ParameterServer
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.protocol.ports import Ports
from sitl.autopilot.pilot.radio import Radio
from sitl.autopilot.pilot.storage import Storage
from sitl.autopilot.protocol.telemetry import BUILDERS, POSITION_MODES
from sitl.autopilot.protocol.ais_list import Traffic, Vessel
from sitl.autopilot.protocol.transfer import TransferServer
from sitl.autopilot.boat.vehicle import Vehicle
from sitl.world.wind import Constant, Wind

WARM_BOOT_S = 60.0
ORIGIN_S = 19.8
_CHUNK = 50
_INTERNAL_ERROR = f"Internal errors 0x{INVALID_RESULT:x} l:90 invalid arguments"
_BOOT_TEXTS: tuple[tuple[float, int, str], ...] = (
    (0.04, 6, "Calibrating barometer"), (1.64, 6, "Barometer 1 calibration complete"),
    (1.66, 6, "Beginning INS calibration. Do not move vehicle"), (2.28, 6, "ArduPilot Ready"),
    (2.28, 6, "AHRS: DCM active"), (4.29, 6, "EKF3 IMU0 initialised"),
    (5.89, 6, "EKF3 IMU0 tilt alignment complete"), (5.97, 6, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (9.57, 6, "GPS 1: probing for u-blox at 230400 baud"), (9.59, 6, "GPS 1: detected u-blox"),
    (19.77, 6, "EKF3 IMU0 origin set"), (EKF_READY_S, 6, "EKF3 IMU0 is using GPS"),
    (EKF_READY_S, 6, "AHRS: EKF3 active"),
)


class Autopilot:
    """One boat with its autopilot. See the package for how it is used."""

    def __init__(self, config: AutopilotConfig, wind: Wind, seed: int) -> None:
        self.config = config
        self.seed = seed
        self.ports: Ports = Ports(self, config.sysid)
        self.chart = Chart(config.home)
        self.parameters = Parameters(config.parameters, new_names=config.new_parameter_names)
        twd, tws = wind.at(0.0)
        self.parameters.put("SIM_WIND_DIR", math.degrees(twd))
        self.parameters.put("SIM_WIND_SPD", tws)
        self.parameters.put("SYSID_THISMAV", float(config.sysid))
        self.vehicle: Vehicle = Vehicle(
            wind, self.parameters, heading_rad=config.heading_rad, is_moored=config.is_moored, seed=seed,
            polar=config.polar,
        )
        self.battery_v = config.battery_v
        self.roll_rad = 0.0
        self._reboots = 0
        self._boot_at_s = -WARM_BOOT_S if config.is_warm else 0.0
        self._debt_s = 0.0
        self._reboot_at_s = math.inf
        self.has_origin: bool = False
        self.home_en: tuple[float, float] | None = None
        self._texts: Iterator[tuple[float, int, str]] = iter(())
        self._next_text: tuple[float, int, str] | None = None
        self._power_up()
        if config.is_warm:
            self.vehicle.settle()
            self.origin_en = self.vehicle.position
            self.has_origin = True
            self.home_en = self.vehicle.position
            self._next_text = None
        else:
            self.vehicle.still_air_until(k.WIND_DELAY_S)

    def _power_up(self) -> None:
        self.is_armed = False
        self.internal_errors = 0
        self.has_origin = False
        self.origin_en = (0.0, 0.0)
        self.home_en = None
        self._home_due_s = self.t_s
        self.fence = Fence()
        self._fence_due_s = self.t_s
        self.storage: Storage = Storage(self)
        self.helm: Helm = Helm(self)
        self.transfers = TransferServer(self.storage)
        self.ftp = FtpServer(self)
        self.traffic = Traffic(self)
        self.radio = Radio(self)
        self.failsafe = Failsafe(self)
        self.parameter_server = ParameterServer(self)
        self._texts = iter(_BOOT_TEXTS)
        self._next_text = next(self._texts, None)
        if self.parameters.flag("FENCE_ENABLE"):
            self.fence.switch(enabled=True)

    # ---------------------------------------------------------------------------------------------- time
    @property
    def t_s(self) -> float:
        """Simulated time since the start [s]."""
        return self.vehicle.t_s

    @property
    def boot_s(self) -> float:
        """Time since power-up or reboot [s]."""
        return self.vehicle.t_s - self._boot_at_s

    @property
    def boot_ms(self) -> int:
        """Time since boot [ms]."""
        return round(self.boot_s * 1e3)

    @property
    def boot_us(self) -> int:
        """Time since boot [us]."""
        return round(self.boot_s * 1e6)

    def step(self, dt_s: float = LOOP_S) -> None:
        """Let simulated time pass: as many whole loops as fit, the rest is kept for the next call."""
        self._debt_s += dt_s
        loops = math.floor(self._debt_s / LOOP_S + 1e-6)
        self._debt_s -= loops * LOOP_S
        end = self.vehicle.tick + loops
        while self.vehicle.tick < end:
            chunk = max(1, min(end - self.vehicle.tick, self._due_tick() - self.vehicle.tick, _CHUNK))
            _, events = self.vehicle.advance(chunk)
            self._loop(events)

    @property
    def next_wake_s(self) -> float:
        """Simulated time of the next loop in which something will be sent or done, at the latest known now."""
        return self._due_tick() * LOOP_S

    def _due_tick(self) -> int:
        tick = self.vehicle.tick
        if self.parameter_server.is_busy or self.ports.has_work:
            return tick + 1
        due = min(self.ports.due_s, self.helm.due_s, self.failsafe.due_s, self._reboot_at_s)
        waiting = self.transfers.due_s
        if waiting is not None:
            due = min(due, waiting)
        if self._next_text is not None:
            due = min(due, self._boot_at_s + self._next_text[0])
        if not self.is_armed:
            due = min(due, self._home_due_s)
        if self.fence.is_enabled:
            due = min(due, self._fence_due_s)
        return max(tick + 1, math.ceil(due / LOOP_S - 1e-6)) if due < math.inf else tick + _CHUNK

    def _loop(self, events: int) -> None:
        """One loop of the autopilot in which something is due."""
        t_s = self.t_s
        if t_s >= self._reboot_at_s:
            self.reboot()
            return
        while self._next_text is not None and self.boot_s >= self._next_text[0] - 1e-9:
            self.announce(self._next_text[1], self._next_text[2])
            self._next_text = next(self._texts, None)
        if not self.has_origin and self.boot_s >= ORIGIN_S and not self.gps_lost:
            self.has_origin, self.origin_en = True, self.vehicle.position
        if not self.is_armed and t_s >= self._home_due_s - 1e-9:
            self._home_due_s = t_s + 1.0
            if self.has_origin:
                self.home_en = self.vehicle.position
                self.announce(mav.MAV_SEVERITY_INFO, "Field Elevation Set: 0m")
        if events:
            self.helm.happened(events)
        self.ports.read()
        self.transfers.update(t_s)
        self.failsafe.update()
        self.helm.update()
        if self.fence.is_enabled and t_s >= self._fence_due_s - 1e-9:
            self._fence_due_s = t_s + CHECK_S
            self.failsafe.watch_fence()
        self.parameter_server.update()
        self.ports.send_due()

    # --------------------------------------------------------------------------------------------- ports
    @property
    def links(self) -> dict[int, Link]:
        """The open ports by number."""
        return self.ports.links

    def open_link(self, link_id: int) -> Link:
        """Return a port; a new one sends the default streams from now on."""
        return self.ports.open(link_id)

    def close_link(self, link_id: int) -> None:
        """Take a port away."""
        self.ports.links.pop(link_id, None)

    def receive(self, link_id: int, data: bytes) -> None:
        """Take bytes that arrived on a port; they are read at the next loop."""
        self.ports.receive(link_id, data)

    def take_outgoing(self, link_id: int) -> bytes:
        """Return the bytes to send on a port, and forget them."""
        return self.ports.open(link_id).take()

    def announce(self, severity: int, text: str) -> None:
        """STATUSTEXT on every port."""
        self.ports.announce(severity, text)

    def announce_after_ack(self, severity: int, text: str) -> None:
        """As ``announce``, behind the acknowledgement of the command being carried out."""
        self.ports.announce_after_ack(severity, text)

    def broadcast(self, message: Any) -> None:
        """Send on every port."""
        self.ports.broadcast(message)

    def mode_changed(self) -> None:
        """Tell a change of mode at once."""
        self.broadcast(BUILDERS[mav.MAVLINK_MSG_ID_HEARTBEAT](self))
        self.failsafe.mode_changed()

    def parameter_changed(self, name: str) -> None:
        """Act on a parameter that somebody set."""
        if name in {"SIM_WIND_SPD", "SIM_WIND_DIR"}:
            get = self.parameters.get
            self.vehicle.wind = Constant(math.radians(get("SIM_WIND_DIR")), max(0.0, get("SIM_WIND_SPD")))
        elif name == "FENCE_ENABLE":
            self.switch_fence(enabled=self.parameters.flag("FENCE_ENABLE") == 1)
        self.vehicle.load_parameters()

    # --------------------------------------------------------------------------------------------- place
    @property
    def latlon_e7(self) -> tuple[int, int]:
        """Where the autopilot believes to be [deg x 1e7]."""
        return self.chart.to_e7(self.vehicle.position)

    def refuge(self) -> tuple[float, float] | None:
        """Return home or the nearest rally point within RALLY_LIMIT_KM."""
        here = self.vehicle.position
        limit_m = self.parameters.get("RALLY_LIMIT_KM") * 1000.0
        points = [self.chart.to_en(i.x, i.y) for i in self.storage.rally]
        points = [p for p in points if limit_m <= 0.0 or math.dist(p, here) <= limit_m]
        if not points:
            return self.home_en
        best = min(points, key=lambda p: math.dist(p, here))
        if self.home_en is not None and self.parameters.flag("RALLY_INCL_HOME"):
            return min((best, self.home_en), key=lambda p: math.dist(p, here))
        return best

    def set_home(self, en: tuple[float, float] | None) -> bool:
        """Set home, here or there."""
        if not self.has_origin:
            return False
        self.home_en = en if en is not None else self.vehicle.position
        return True

    # ------------------------------------------------------------------------------------------- arming
    @property
    def ekf_ready(self) -> bool:
        """Whether the position can be used."""
        return self.boot_s >= EKF_READY_S and bool(self.failsafe.ekf.flags & mav.EKF_POS_HORIZ_ABS)

    @property
    def ekf_flags(self) -> int:
        """EKF_STATUS_REPORT.flags."""
        if self.boot_s < 4.3:
            return 0x400
        if self.boot_s < 6.5:
            return 0
        return self.failsafe.ekf.flags if self.boot_s >= EKF_READY_S else 0xA7

    @property
    def system_status(self) -> int:
        """HEARTBEAT.system_status."""
        if self.failsafe.is_active:
            return int(mav.MAV_STATE_CRITICAL)
        return int(mav.MAV_STATE_STANDBY if self.helm.mode is Mode.HOLD else mav.MAV_STATE_ACTIVE)

    def arm(self, *, force: bool) -> bool:
        """Arm; False, with the reasons announced behind the acknowledgement, when refused."""
        if self.is_armed:
            return True
        reasons = []
        if self.internal_errors:
            reasons.append(_INTERNAL_ERROR)
        if self.parameters.flag("SAIL_ENABLE") and not self.parameters.flag("WNDVN_TYPE"):
            reasons.append("Sailing enabled with no WindVane")
        if not self.ekf_ready and self.helm.mode is not Mode.MANUAL:
            reasons.append("Accels inconsistent")
            if self.helm.mode in POSITION_MODES:
                reasons.append("AHRS: waiting for home")
        if self.fence.is_enabled and self.fence.is_breached:
            reasons.append("Vehicle breaching Polygon fence")
        if reasons and not force:
            for reason in reasons:
                self.announce_after_ack(mav.MAV_SEVERITY_CRITICAL, f"Arm: {reason}")
            return False
        self.is_armed = True
        self.vehicle.set_armed(armed=True)
        self.helm.armed()
        self.announce_after_ack(mav.MAV_SEVERITY_INFO, "Throttle armed")
        return True

    def err_internally(self) -> None:
        """Find a result that cannot be, as the S-curve of a leg without limits is: no arming until a reboot."""
        self.announce_after_ack(mav.MAV_SEVERITY_CRITICAL, f"Internal Errors 0x{INVALID_RESULT:x}")
        if not self.internal_errors:
            self.announce_after_ack(mav.MAV_SEVERITY_CRITICAL, f"PreArm: {_INTERNAL_ERROR}")
        self.internal_errors += 1

    def disarm(self) -> bool:
        """Disarm; outside AUTO this forgets the mission's index."""
        if self.is_armed:
            self.is_armed = False
            self.vehicle.set_armed(armed=False)
            self._home_due_s = self.t_s + 1.0
            if self.helm.mode is not Mode.AUTO:
                self.helm.mission.reset()
            self.announce_after_ack(mav.MAV_SEVERITY_INFO, "Throttle disarmed")
        return True

    # -------------------------------------------------------------------------------------------- fence
    def switch_fence(self, *, enabled: bool) -> bool:
        """Enable or disable the fence."""
        self.fence.switch(enabled=enabled)
        self.vehicle.avoid(near=False, ease=False)
        self._fence_due_s = self.t_s
        return True

    # ------------------------------------------------------------------------------------ for scenarios
    @property
    def truth(self) -> Truth:
        """What is so."""
        s = self.vehicle.state
        east, north = self.vehicle.true_position
        return Truth(
            t_s=self.t_s, boot_s=self.boot_s, east_m=east, north_m=north,
            position=self.chart.point((east, north)), heading_rad=wrap_two_pi(float(s[k.S_YAW])),
            speed_mps=math.hypot(float(s[k.S_VE]), float(s[k.S_VN])),
            velocity_en_mps=(float(s[k.S_VE]), float(s[k.S_VN])), twd_from_rad=wrap_two_pi(float(s[k.S_WDIR])),
            tws_mps=float(s[k.S_WSPD]), mode=self.helm.mode, is_armed=self.is_armed,
            mission_seq=self.helm.mission.current_seq, tacks=int(s[k.S_TACKS]), sail_rad=float(s[k.S_SAIL]),
            rudder=float(s[k.S_RUDDER]),
        )

    def reboot_soon(self) -> None:
        """Reboot a moment after the acknowledgement has left."""
        self._reboot_at_s = self.t_s + 0.5

    def reboot(self) -> None:
        """Start again: boot time 0, disarmed; mission, fence, rally points and parameters are in its memory."""
        self._reboots += 1
        self._reboot_at_s = math.inf
        storage, mission, fence = self.storage, list(self.helm.mission.items), self.fence.items
        self._boot_at_s = self.t_s
        self.ports.restart(self.t_s)
        self.vehicle.set_armed(armed=False)
        self.vehicle.clear_tack()
        self.vehicle.avoid(near=False, ease=False)
        self._power_up()
        self.storage.restore(storage, mission, fence)

    def set_mode(self, mode: Mode) -> bool:
        """A person's choice at the ground station."""
        return self.helm.set_mode(int(mode))

    def set_battery(self, volts: float) -> None:
        """Change the battery's voltage."""
        self.battery_v = volts

    def set_roll(self, roll_rad: float) -> None:
        """Knock the boat down, or right it; no other effect than what the autopilot makes of it."""
        self.roll_rad = roll_rad

    @property
    def battery_percent(self) -> int:
        """Charge, reckoned from a three-cell battery's 9.6 to 12.6 V."""
        return max(0, min(100, round((self.battery_v - 9.6) / 3.0 * 100.0)))

    def set_current(self, set_to_rad: float, drift_mps: float) -> None:
        """Let the water run towards ``set_to_rad``; acts on an armed boat, as SIM_TIDE does."""
        self.parameters.put("SIM_TIDE_DIR", math.degrees(wrap_two_pi(set_to_rad + math.pi)))
        self.parameters.put("SIM_TIDE_SPEED", drift_mps)
        self.vehicle.load_parameters()

    def run_motor(self, *, on: bool) -> None:
        """Run the auxiliary motor, or not: there is no assistance in tacks here.

        As on the real one (measured) nothing is said by a boat that has none.
        """
        self.vehicle.run_motor(on=on and self.config.has_motor)

    def set_vane(self, fault: VaneFault) -> None:
        """Break or mend the wind vane."""
        self.vehicle.set_vane_fault(fault.code, wrap_pi(fault.value_rad) if fault.value_rad else 0.0)

    def set_compass(self, error_rad: float) -> None:
        """Let the compass err by so much to starboard, or mend it with 0."""
        self.vehicle.set_compass_error(error_rad)

    def set_gps(self, fault: GpsFault) -> None:
        """Break or mend the position."""
        self.failsafe.set_gps(fault)

    @property
    def gps_lost(self) -> bool:
        """Whether there is no fix."""
        return self.failsafe.ekf.gps_lost

    def hear_vessel(self, vessel: Vessel) -> None:
        """An AIS receiver at the autopilot heard a vessel."""
        self.traffic.hear(vessel)

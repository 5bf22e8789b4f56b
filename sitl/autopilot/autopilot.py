"""The simulated autopilot: bytes and time in, bytes out.

Everything happens on the loops of 20 ms that the real one runs at 50 Hz: what arrives is read at the next loop,
streams are sent on the loop in which they are due. Between two loops in which there is something to do, the
compiled kernel runs alone.
"""

from __future__ import annotations

import math

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.messages import Mode
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.config import AutopilotConfig, GpsFault, Truth, VaneFault
from sitl.autopilot.link import LOOP_S, MavlinkPort
from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.pilot import Pilot
from sitl.autopilot.protocol.handlers import Ports
from sitl.autopilot.protocol.telemetry import AisVessel, heartbeat
from sitl.world import WindModel

_CHUNK = 50


class SimulatedAutopilot:
    """One boat with its autopilot. See the package for how it is used."""

    def __init__(self, config: AutopilotConfig, wind: WindModel, seed: int) -> None:
        self.core = Core(config, wind, seed)
        self._debt_s = 0.0
        self._power_up()

    def _power_up(self) -> None:
        self.pilot = Pilot(self.core, self._tell_mode)
        self._ports = Ports(self.pilot)

    def _tell_mode(self) -> None:
        self.core.voice.broadcast(heartbeat(self.pilot))

    # ---------------------------------------------------------------------------------------------- time
    @property
    def t_s(self) -> float:
        """Simulated time since the start [s]."""
        return self.core.vehicle.t_s

    def step(self, dt_s: float = LOOP_S) -> None:
        """Let simulated time pass: as many whole loops as fit, the rest is kept for the next call."""
        self._debt_s += dt_s
        loops = math.floor(self._debt_s / LOOP_S + 1e-6)
        self._debt_s -= loops * LOOP_S
        vehicle = self.core.vehicle
        end = vehicle.tick + loops
        while vehicle.tick < end:
            left = end - vehicle.tick
            chunk = 1 if left == 1 else max(1, min(left, self._due_tick() - vehicle.tick, _CHUNK))
            _, events = vehicle.advance(chunk)
            if self.core.follow():
                self.pilot.fence.reload()
            self._loop(events)

    @property
    def next_wake_s(self) -> float:
        """Simulated time of the next loop in which something will be sent or done, at the latest known now."""
        return self._due_tick() * LOOP_S

    def _due_tick(self) -> int:
        tick = self.core.vehicle.tick
        if self._ports.has_work:
            return tick + 1
        due_s = min(self._ports.due_s, self.pilot.due_s, self.core.reboot_at_s)
        return max(tick + 1, math.ceil(due_s / LOOP_S - 1e-6)) if due_s < math.inf else tick + _CHUNK

    def _loop(self, events: int) -> None:
        """One loop of the autopilot in which something is due."""
        if self.core.t_s >= self.core.reboot_at_s:
            self.reboot()
            return
        pilot = self.pilot
        pilot.startup.update()
        if events:
            pilot.helm.happened(events)
        self._ports.read()
        pilot.failsafe.update()
        pilot.helm.update()
        pilot.failsafe.watch_fence()
        self._ports.send_due()

    # --------------------------------------------------------------------------------------------- ports
    @property
    def links(self) -> dict[int, MavlinkPort]:
        """The open ports by number."""
        return self.core.voice.links

    def open_link(self, link_id: int) -> MavlinkPort:
        """Return a port; a new one sends the default streams from now on."""
        return self.core.voice.open(link_id, self.t_s)

    def close_link(self, link_id: int) -> None:
        """Take a port away."""
        self.links.pop(link_id, None)

    def receive(self, link_id: int, data: bytes) -> None:
        """Take bytes that arrived on a port; they are read at the next loop."""
        self.open_link(link_id).hear(data)

    def take_outgoing(self, link_id: int) -> bytes:
        """Return the bytes to send on a port, and forget them."""
        return self.open_link(link_id).take()

    # ------------------------------------------------------------------------------------ for scenarios
    @property
    def truth(self) -> Truth:
        """What is so."""
        s = self.core.vehicle.state
        east, north = self.core.vehicle.true_position
        return Truth(
            t_s=self.t_s,
            boot_s=self.core.boot_s,
            east_m=east,
            north_m=north,
            position=self.core.chart.point((east, north)),
            heading_rad=wrap_two_pi(float(s[k.S_YAW])),
            speed_mps=math.hypot(float(s[k.S_VE]), float(s[k.S_VN])),
            velocity_en_mps=(float(s[k.S_VE]), float(s[k.S_VN])),
            twd_from_rad=wrap_two_pi(float(s[k.S_WDIR])),
            tws_mps=float(s[k.S_WSPD]),
            mode=self.pilot.helm.mode,
            is_armed=self.core.is_armed,
            mission_seq=self.pilot.helm.mission.current_seq,
            tacks=int(s[k.S_TACKS]),
        )

    def reboot(self) -> None:
        """Start again: boot time 0, disarmed; mission, fence, rally points and parameters are in its memory."""
        stored = self.pilot.storage
        self.core.power_up(self.core.t_s)
        self._power_up()
        self.pilot.storage.restore(stored)

    def set_mode(self, mode: Mode) -> bool:
        """A person's choice at the ground station."""
        return self.pilot.helm.set_mode(int(mode))

    def set_battery(self, volts: float) -> None:
        """Change the battery's voltage."""
        self.core.battery_v = volts

    def set_sensor(self, name: str, value: float | None) -> None:
        """Set what a script of the boat's tells of a sensor (NAMED_VALUE_FLOAT) from now on, None: nothing."""
        self.core.sensors.pop(name, None)
        if value is not None:
            self.core.sensors[name] = value

    def set_roll(self, roll_rad: float) -> None:
        """Knock the boat down, or right it; no other effect than what the autopilot makes of it."""
        self.core.roll_rad = roll_rad

    def set_current(self, set_to_rad: float, drift_mps: float) -> None:
        """Let the water run towards ``set_to_rad``; acts on an armed boat, as SIM_TIDE does."""
        self.core.parameters.put("SIM_TIDE_DIR", math.degrees(wrap_two_pi(set_to_rad + math.pi)))
        self.core.parameters.put("SIM_TIDE_SPEED", drift_mps)
        self.core.vehicle.load_parameters()

    def set_vane(self, fault: VaneFault) -> None:
        """Break or mend the wind vane."""
        self.core.vehicle.set_vane_fault(fault.code, wrap_pi(fault.value_rad) if fault.value_rad else 0.0)

    def set_compass(self, error_rad: float) -> None:
        """Let the compass err by so much to starboard, or mend it with 0."""
        self.core.vehicle.set_compass_error(error_rad)

    def set_gps(self, fault: GpsFault) -> None:
        """Break or mend the position."""
        self.pilot.failsafe.set_gps(fault)

    def hear_vessel(self, vessel: AisVessel) -> None:
        """An AIS receiver at the autopilot heard a vessel."""
        self._ports.ais_list.hear(vessel, self.t_s)

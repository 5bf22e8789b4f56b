"""Boats of live runs: the simulated autopilot in a process of its own, or the real ArduRover.

What a live runner needs of either: the companion's LINK, the truth, and the scenario's events that befall the boat.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import msgspec
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.errors import JobError, LinkError
from companion.geo.frame import LocalFrame
from companion.geofence import Mission
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.transports import open_link
from companion.mavlink.wire import Stream
from companion.messages import GeoPoint, Mode, VehicleState, waypoint
from sitl.ardurover import MOTOR, ArduRover, require
from sitl.autopilot import FORCED_REBOOT
from sitl.faults import REDRAWN, give_order, redraw, set_parameter
from sitl.run.depths import spoken_depths
from sitl.scenario import EventSpec, Scenario, SensorsSpec, free_port, scenario_waters
from sitl.world import SimulatedSounder, WindModel

# A warm simulated autopilot has been up for a minute when its simulation starts [s].
WARM_BOOT_S = 60.0
# A simulated autopilot's process may compile its kernels first [s of real time].
START_S = 90.0
# Of the real one's simulated receiver, which its filter knows of (SIM_GPS1_LAG_MS) [ms].
REAL_LAG_MS = 100.0
# What the judge asks for: the position and the bow, five times a second.
JUDGE_STREAMS = (Stream("GLOBAL_POSITION_INT", 5.0, 3.0), Stream("ATTITUDE", 5.0, 3.0))
# What an operator and a ground station do, over any autopilot's link.
OPERATORS = frozenset({"mode", "reboot", "foreign_mission", "order", "parameter"}) | REDRAWN


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveFix:
    """Where the boat truly is, and whether it sails."""

    position: GeoPoint
    heading_rad: float
    speed_mps: float
    wind: tuple[float, float]
    sails: bool

    @property
    def velocity_en_mps(self) -> tuple[float, float]:
        """Along the bow: what leeway and stream make of it is left out, as seen from another boat."""
        return self.speed_mps * math.sin(self.heading_rad), self.speed_mps * math.cos(self.heading_rad)


class LiveBoat(Protocol):
    """What a live runner needs of an autopilot that runs."""

    plays: frozenset[str]
    """The kinds of events that can befall it."""

    @property
    def link(self) -> str:
        """The companion's LINK."""
        ...

    def fix(self) -> LiveFix | None:
        """Return the truth now; None before there is any."""
        ...

    @staticmethod
    def cannot_be(scenario: Scenario) -> list[str]:
        """Return what it cannot be of the boat that a scenario's tables ask for."""
        ...

    async def play(self, event: EventSpec, frame: LocalFrame) -> None:
        """Let an event befall it, and end it after ``for_s``."""
        ...


async def _upload_foreign(url: str, event: EventSpec, frame: LocalFrame) -> None:
    """Upload a mission as a ground station does: over a link of its own, as 255/190."""
    identity = LinkIdentity(system=255, component=190)
    async with Link(open_link(url), identity=identity, streams=()) as link, Autopilot(link) as pilot:
        await pilot.upload_mission([waypoint(frame.geo_from_en(event.east_m, event.north_m))], method="items")


def heading_deg_of(scenario: Scenario, mission: Mission) -> float:
    """Return where the bow points at the start: as the scenario says, else the mission, else north [deg]."""
    if scenario.start_heading_deg is not None:
        return scenario.start_heading_deg
    return mission.options.start.heading_deg if mission.options.start else 0.0


class SimulatedBoat:
    """The simulated autopilot in a process of its own; watched over a second UDP port."""

    plays = OPERATORS

    def __init__(self, pilot: Autopilot, wind: WindModel, port: int, judge_url: str) -> None:
        self._pilot, self._wind, self._judge_url = pilot, wind, judge_url
        self.link = f"udpin:127.0.0.1:{port}"
        self._state: VehicleState | None = None
        pilot.on_value(self._take)

    def _take(self, value: object) -> None:
        if isinstance(value, VehicleState):
            self._state = value

    @classmethod
    @contextlib.asynccontextmanager
    async def start(
        cls, source: Path, wind: WindModel, seed: int, pace: float, epoch_s: float, depths_port: int = 0
    ) -> AsyncIterator[SimulatedBoat]:
        """Run it while the block runs; its sounder speaks NMEA to ``depths_port``, or to the autopilot at 0."""
        port, judge_port = free_port(), free_port()
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "sitl.run.live_boat",
            str(source),
            "--seed",
            str(seed),
            "--speedup",
            f"{pace:g}",
            "--epoch",
            f"{epoch_s:.0f}",
            "--endpoint",
            f"udpout:127.0.0.1:{port}",
            "--endpoint",
            f"udpin:127.0.0.1:{judge_port}",
            "--depths-port",
            str(depths_port),
            "--parent",
            str(os.getpid()),
        )
        judge_url = f"udpout:127.0.0.1:{judge_port}"
        try:
            async with (
                Link(
                    open_link(judge_url), identity=LinkIdentity(system=255, component=191), streams=JUDGE_STREAMS
                ) as link,
                Autopilot(link, timeout_s=START_S * pace) as pilot,
            ):
                yield cls(pilot, wind, port, judge_url)
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.terminate()
            await process.wait()

    @staticmethod
    def cannot_be(scenario: Scenario) -> list[str]:
        """Return what it cannot be: a boat whose sensors err, which its judge listens to."""
        return [] if scenario.sensors is None else ["[sensors]"]

    def fix(self) -> LiveFix | None:
        """Return what the simulated autopilot tells, whose sensors do not err unless a scenario says so."""
        state, status = self._state, self._pilot.status
        if state is None or status is None:
            return None
        # The autopilot is warm: its boot time is a minute ahead of the simulation.
        return LiveFix(
            position=state.position,
            heading_rad=state.heading_rad,
            speed_mps=state.speed_mps,
            wind=self._wind.at(max(0.0, state.boot_s - WARM_BOOT_S)),
            sails=status.is_armed and status.mode in {Mode.AUTO, Mode.GUIDED},
        )

    async def play(self, event: EventSpec, frame: LocalFrame) -> None:
        """Be the operator."""
        if event.kind == "mode":
            await self._pilot.set_mode(Mode[event.mode or "HOLD"])
        elif event.kind == "reboot":
            await self._pilot.link.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, *FORCED_REBOOT)
        else:
            await _from_ashore(self._judge_url, event, frame)


class RealBoat:
    """The real ArduRover; ``sitl.ardurover.simulation`` knows the truth and turns the simulator's knobs."""

    # At a reboot its simulation begins anew at home, too.
    plays = (OPERATORS | {"battery", "current", "gps_jump", "gps_lost", "radio_lost", "arm", "disarm"}) - {"reboot"}

    def __init__(self, rover: ArduRover) -> None:
        self._rover = rover
        self.link = rover.link

    @classmethod
    @contextlib.asynccontextmanager
    async def start(
        cls,
        scenario: Scenario,
        mission: Mission,
        wind: WindModel,
        program: Path | None,
        pace: float,
        folder: Path,
        sounder: SimulatedSounder | None = None,
        depths_port: int = 0,
    ) -> AsyncIterator[RealBoat]:
        """Run it while the block runs; its sounder speaks NMEA to ``depths_port``, or to the autopilot at 0."""
        waters = scenario_waters(scenario, wind, mission.frame().en_from_geo(mission.start or mission.origin))
        parameters = dict(scenario.parameters)
        if scenario.sensors is not None and scenario.sensors.gps_lag_s:
            parameters |= {"SIM_GPS1_LAG_MS": REAL_LAG_MS + 1e3 * scenario.sensors.gps_lag_s}
        async with ArduRover(
            require(program),
            mission.start or mission.origin,
            wind,
            speedup=pace,
            parameters=parameters,
            heading_rad=math.radians(heading_deg_of(scenario, mission)),
            model="motorboat"
            if mission.autopilot.frame == "motor"
            else ("sailboat" + (MOTOR if mission.boat.motor else "")),
            waters=waters,
            sounder=None if depths_port else sounder,
        ) as rover:
            boat = cls(rover)

            def ping_m() -> float | None:
                fix = boat.fix()
                return None if fix is None or sounder is None else sounder.ping_m(fix.position, max(0.0, rover.t_s))

            async with spoken_depths(ping_m, depths_port, 0.0 if sounder is None else sounder.below_m):
                yield boat
        (folder / "autopilot.log").write_text("\n".join(f"{t:.1f} {s} {x}" for t, s, x in rover.texts) + "\n")

    @staticmethod
    def cannot_be(scenario: Scenario) -> list[str]:
        """Return what it cannot be: no leeway, no waves, and of its sensors only the position's age."""
        told = SensorsSpec() if scenario.sensors is None else scenario.sensors
        errs = msgspec.structs.replace(told, gps_lag_s=0.0) != SensorsSpec()
        tables = {"[boat]": scenario.boat is not None, "[waves]": scenario.waves is not None, "[sensors]": errs}
        return [name for name, asked in tables.items() if asked]

    def fix(self) -> LiveFix | None:
        """Return the simulator's own state."""
        try:
            t = self._rover.truth
        except LinkError:
            return None
        return LiveFix(
            position=t.position,
            heading_rad=t.heading_rad,
            speed_mps=t.speed_mps,
            wind=(t.twd_from_rad, t.tws_mps),
            sails=t.is_armed and t.mode in {Mode.AUTO, Mode.GUIDED},
        )

    async def play(self, event: EventSpec, frame: LocalFrame) -> None:
        """Be the operator, the water, the battery or the sky."""
        rover = self._rover
        if event.kind == "mode":
            rover.set_mode(Mode[event.mode or "HOLD"])
        elif event.kind in {"arm", "disarm"}:
            rover.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, float(event.kind == "arm"))
        elif event.kind == "radio_lost":
            rover.set_parameter("SIM_RC_FAIL", 1.0)
            if event.for_s is not None:
                await asyncio.sleep(event.for_s)
                rover.set_parameter("SIM_RC_FAIL", 0.0)
        elif event.kind == "battery":
            rover.set_parameter("SIM_BATT_VOLTAGE", event.volts or 0.0)
        elif event.kind == "current":
            rover.set_current(math.radians(event.set_deg), event.drift_mps)
        elif event.kind == "gps_jump":
            there = frame.geo_from_en(event.east_m, event.north_m)
            rover.set_gps_jump(there.lat_deg - frame.origin.lat_deg, there.lon_deg - frame.origin.lon_deg)
        elif event.kind == "gps_lost":
            rover.set_gps(is_lost=True)
        else:
            await _from_ashore(rover.shore_link, event, frame)
        if event.kind in {"gps_jump", "gps_lost"} and event.for_s is not None:
            await asyncio.sleep(event.for_s)
            rover.set_gps_jump(0.0, 0.0)
            rover.set_gps(is_lost=False)


async def _from_ashore(url: str, event: EventSpec, frame: LocalFrame) -> None:
    """Do what somebody ashore does, over a link of his own; nothing for an event that is another's.

    Raises:
        JobError: it was not answered as the scenario expects.
    """
    trouble = ""
    if event.kind == "foreign_mission":
        await _upload_foreign(url, event, frame)
    elif event.kind == "order":
        trouble = await give_order(open_link(url), event, frame)
    elif event.kind == "parameter":
        trouble = await set_parameter(open_link(url), event)
    elif event.kind in REDRAWN:
        trouble = await redraw(open_link(url), event, frame)
    if trouble:
        raise JobError(trouble)

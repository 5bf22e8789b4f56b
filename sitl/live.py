"""Runs a scenario in real time with processes of their own: autopilot, companion, and a judge that listens.

The autopilot is the simulated one over UDP or the real ArduRover; the companion is ``companion run``, as on the
boat. The judge is a third party on another link: it reads where the boat is, plays the operator and the fates,
and never talks to the companion. What SIMSTATE says is the judge's to know, not the companion's.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import signal
import socket
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s, run
from companion.errors import JobError, LinkError
from companion.geo.frame import LocalFrame
from companion.geofence import Mission, load_mission
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link, LinkIdentity
from companion.mavlink.streams import Stream
from companion.mavlink.transport import open_link
from companion.messages import GeoPoint, Mode, VehicleState, waypoint
from companion.telemetry.recorder import write_atomically
from sitl.ardurover import ArduRover, require
from sitl.runner import TRUTH_EVERY_S, VERDICT, marks_of, solid_of
from sitl.scenario import EventSpec, Scenario
from sitl.verdict import Truth, Verdict, judge
from sitl.weather import scenario_wind
from sitl.wind import Wind

# A warm simulated autopilot has been up for a minute when its simulation starts [s].
WARM_BOOT_S = 60.0
# A simulated autopilot's process may compile its kernels first [s of real time].
START_S = 90.0
# What the judge asks for: the position, five times a second, and the simulator's own state.
JUDGE_STREAMS = (
    Stream("GLOBAL_POSITION_INT", 5.0, 3.0),
    Stream("ATTITUDE", 5.0, 3.0),
)
COMPANION_STOP_S = 20.0


class _Companion:
    """The companion's process: started, killed, frozen and started again."""

    def __init__(self, command: list[str]) -> None:
        self._command = command
        self._process: asyncio.subprocess.Process | None = None
        self._is_over = asyncio.Event()
        self._expects_death = False

    @property
    def exit_code(self) -> int | None:
        """Of the last process."""
        return None if self._process is None else self._process.returncode

    async def start(self) -> None:
        """Start it; its progress line is ours."""
        self._expects_death = False
        self._process = await asyncio.create_subprocess_exec(*self._command)
        self._watcher = asyncio.create_task(self._watch(self._process), name="companion process")

    async def _watch(self, process: asyncio.subprocess.Process) -> None:
        await process.wait()
        if not self._expects_death:
            self._is_over.set()

    async def ended(self, deadline_s: float) -> None:
        """Wait until it ends by itself; stop it at ``deadline_s``."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout_at(deadline_s):
                await self._is_over.wait()
        if self._process is not None and self._process.returncode is None:
            self._process.send_signal(signal.SIGINT)
            await self._process.wait()

    async def kill(self, restart_after_s: float | None) -> None:
        """SIGKILL it, whatever it does, and start it again."""
        if self._process is None or self._process.returncode is not None:
            return
        self._expects_death = restart_after_s is not None
        self._process.kill()
        await self._process.wait()
        if restart_after_s is not None:
            await asyncio.sleep(restart_after_s)
            await self.start()

    async def freeze(self, for_s: float | None) -> None:
        """Stop it for a while, or for good."""
        if self._process is None or self._process.returncode is not None:
            return
        self._process.send_signal(signal.SIGSTOP)
        if for_s is not None:
            await asyncio.sleep(for_s)
            self._process.send_signal(signal.SIGCONT)


def free_port() -> int:
    """Return a UDP port that nobody has now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def run_live(
    scenario: Scenario, source: Path, seed: int, folder: Path, *, autopilot: str, program: Path | None,
    speedup: float | None,
) -> Verdict:
    """Run ``scenario``; leaves a voyage folder with verdict.json."""
    pace = speedup or scenario.speedup
    return run(_run(scenario, source, seed, folder, autopilot, program, pace), speedup=pace)


async def _run(
    scenario: Scenario, source: Path, seed: int, folder: Path, kind: str, program: Path | None, pace: float
) -> Verdict:
    mission_path = scenario.mission_path(source)
    mission = load_mission(mission_path)
    wind = scenario_wind(scenario, source, seed)
    frame = mission.frame()
    folder.mkdir(parents=True, exist_ok=True)
    truth = Truth()
    async with contextlib.AsyncExitStack() as stack:
        boat: Boat
        if kind == "ardurover":
            boat = await stack.enter_async_context(RealBoat.start(scenario, mission, wind, program, pace, folder))
        else:
            boat = await stack.enter_async_context(SimulatedBoat.start(scenario, source, wind, seed, pace))
        companion = _Companion([
            sys.executable, "-m", "companion.cli", "run", str(mission_path), "--link", boat.link, "--out", str(folder),
            "--state", str(folder / "state.json"), "--seed", str(seed), "--speedup", f"{pace:g}",
            "--limit", f"{scenario.limit_s:g}",
        ])
        began_s = now_s()
        await companion.start()
        side = [
            asyncio.create_task(_watch(boat, frame, truth), name="judge"),
            *(asyncio.create_task(_event(e, began_s, boat, companion, mission)) for e in scenario.events),
        ]
        try:
            await companion.ended(began_s + scenario.limit_s + COMPANION_STOP_S * pace)
        finally:
            for task in side:
                task.cancel()
    summary_path = folder / "summary.json"
    if not summary_path.is_file():
        raise JobError(f"the companion left no summary in {folder}; its exit code was {companion.exit_code}")
    summary: dict[str, Any] = json.loads(summary_path.read_bytes())
    verdict = judge(
        scenario=scenario.name, seed=seed, expect=scenario.expect, truth=truth,
        solid=solid_of(mission.area.local(frame)), goal_en_m=frame.en_from_geo(mission.goals[-1].point),
        summary=summary, status_times_s=None, alerts=summary.get("alerts", {}),
        marks=marks_of(mission),
    )
    write_atomically(folder / VERDICT, json.dumps(verdict.to_dict(), indent=1).encode())
    return verdict


# --------------------------------------------------------------------------------------------- boats
@dataclass(frozen=True, slots=True, kw_only=True)
class Fix:
    """Where the boat truly is, and whether it sails."""

    position: GeoPoint
    heading_rad: float
    speed_mps: float
    wind: tuple[float, float]
    sails: bool


class Boat(Protocol):
    """What the judge needs of an autopilot that runs."""

    @property
    def link(self) -> str:
        """The companion's LINK."""
        ...

    def fix(self) -> Fix | None:
        """Return the truth now; None before there is any."""
        ...

    async def set_mode(self, mode: Mode) -> None:
        """Be the operator."""
        ...

    async def reboot(self) -> None:
        """Restart the autopilot."""
        ...

    async def upload_foreign(self, point: GeoPoint) -> None:
        """Upload somebody else's mission."""
        ...


async def _foreign(url: str, point: GeoPoint) -> None:
    identity = LinkIdentity(system=255, component=190)
    async with Link(open_link(url), identity=identity, streams=()) as link, Autopilot(link) as pilot:
        await pilot.upload_mission([waypoint(point)], method="items")


class SimulatedBoat:
    """The simulated autopilot in a process of its own; watched over a second UDP port."""

    def __init__(self, pilot: Autopilot, wind: Wind, port: int, judge_url: str) -> None:
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
        cls, scenario: Scenario, source: Path, wind: Wind, seed: int, pace: float
    ) -> AsyncIterator[SimulatedBoat]:
        """Run it while the block runs."""
        del scenario
        port, judge_port = free_port(), free_port()
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "sitl.live_boat", str(source), "--seed", str(seed), "--speedup", f"{pace:g}",
            "--endpoint", f"udpout:127.0.0.1:{port}", "--endpoint", f"udpin:127.0.0.1:{judge_port}",
        )
        judge_url = f"udpout:127.0.0.1:{judge_port}"
        try:
            async with (
                Link(open_link(judge_url), identity=LinkIdentity(system=255, component=191),
                     streams=JUDGE_STREAMS) as link,
                Autopilot(link, timeout_s=START_S * pace) as pilot,
            ):
                yield cls(pilot, wind, port, judge_url)
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.terminate()
            await process.wait()

    def fix(self) -> Fix | None:
        """Return what the simulated autopilot tells, whose sensors do not err unless a scenario says so."""
        state, status = self._state, self._pilot.status
        if state is None or status is None:
            return None
        # The autopilot is warm: its boot time is a minute ahead of the simulation.
        return Fix(
            position=state.position, heading_rad=state.heading_rad, speed_mps=state.speed_mps,
            wind=self._wind.at(max(0.0, state.boot_s - WARM_BOOT_S)),
            sails=status.is_armed and status.mode in {Mode.AUTO, Mode.GUIDED},
        )

    async def set_mode(self, mode: Mode) -> None:
        """Be the operator."""
        await self._pilot.set_mode(mode)

    async def reboot(self) -> None:
        """Restart the autopilot."""
        await self._pilot.link.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1.0)

    async def upload_foreign(self, point: GeoPoint) -> None:
        """Upload somebody else's mission."""
        await _foreign(self._judge_url, point)


class RealBoat:
    """The real ArduRover; the harness of ``sitl.ardurover`` knows the truth."""

    def __init__(self, rover: ArduRover) -> None:
        self._rover = rover
        self.link = rover.link

    @classmethod
    @contextlib.asynccontextmanager
    async def start(
        cls, scenario: Scenario, mission: Mission, wind: Wind, program: Path | None, pace: float, folder: Path,
    ) -> AsyncIterator[RealBoat]:
        """Run it while the block runs."""
        heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
        async with ArduRover(
            require(program), mission.start or mission.origin, wind, heading_rad=math.radians(heading_deg),
            speedup=pace, parameters=scenario.parameters,
        ) as rover:
            yield cls(rover)
        (folder / "autopilot.log").write_text("\n".join(f"{t:.1f} {s} {x}" for t, s, x in rover.texts) + "\n")

    def fix(self) -> Fix | None:
        """Return the simulator's own state."""
        try:
            t = self._rover.truth
        except LinkError:
            return None
        return Fix(
            position=t.position, heading_rad=t.heading_rad, speed_mps=t.speed_mps,
            wind=(t.twd_from_rad, t.tws_mps), sails=t.is_armed and t.mode in {Mode.AUTO, Mode.GUIDED},
        )

    async def set_mode(self, mode: Mode) -> None:
        """Be the operator."""
        self._rover.set_mode(mode)

    async def reboot(self) -> None:
        """Restart the autopilot."""
        self._rover.reboot()

    async def upload_foreign(self, point: GeoPoint) -> None:
        """Upload somebody else's mission."""
        await _foreign(self._rover.shore_link, point)


async def _watch(boat: Boat, frame: LocalFrame, truth: Truth) -> None:
    """Note where the boat is from the moment it sails."""
    sails = False
    while True:
        fix = boat.fix()
        if fix is not None:
            sails = sails or fix.sails
            if sails:
                truth.add(now_s(), frame.en_from_geo(fix.position), fix.heading_rad, fix.speed_mps, fix.wind)
        await asyncio.sleep(TRUTH_EVERY_S)


async def _event(event: EventSpec, began_s: float, boat: Boat, companion: _Companion, mission: Mission) -> None:
    """Play one event; wind events are in the wind. Faults inside the link or the sensors need the embedded one."""
    await asyncio.sleep(max(0.0, began_s + event.at_s - now_s()))
    if event.kind == "mode":
        await boat.set_mode(Mode[event.mode or "HOLD"])
    elif event.kind == "kill_companion":
        await companion.kill(event.restart_after_s)
    elif event.kind == "reboot":
        await boat.reboot()
    elif event.kind == "link_cut":
        # A stopped process hears and says nothing: to both sides the link is gone.
        await companion.freeze(event.for_s)
    elif event.kind == "foreign_mission":
        await boat.upload_foreign(mission.frame().geo_from_en(event.east_m, event.north_m))

"""Runs a scenario in real time with processes of their own: autopilot, companion, and a judge that listens.

The autopilot is the simulated one over UDP or the real ArduRover; the companion is ``companion run``, as on the
boat. The judge is a third party on another link: it reads where the boat is, plays the operator and the fates,
sails the other vessels, and never talks to the companion but as an AIS receiver or a radio would.

A share of a core is the kernel's own quota where that may be set (cgroup version 2 or 1, as root or in a folder that
was handed to the user), else had by stopping and continuing the processes in turn (SIGSTOP, SIGCONT), in slices of a
tenth of a second. The quota is the better likeness: it counts what is really used, stops nobody who is idle, and what
is under it goes before whatever else this machine does, as do boat and judge: a busy machine makes no slower computer.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.clock import now_s, run
from companion.disk import Disk
from companion.errors import JobError, LinkError
from companion.geo.frame import LocalFrame
from companion.geofence import load_mission
from companion.telemetry.folder import DECISIONS, SUMMARY, VERDICT
from sitl.faults import LINK_EVENTS, Relay, break_vane, impair
from sitl.run.boats import LiveBoat, RealBoat, SimulatedBoat
from sitl.run.depths import feed_of, sounder_port
from sitl.run.embedded import TRUTH_EVERY_S, keel_of, terms_of
from sitl.scenario import (
    TRAFFIC,
    EventSpec,
    Motion,
    Others,
    Scenario,
    ScenarioVerdict,
    Told,
    TrueTrack,
    free_port,
    judge,
    scenario_seabed,
    scenario_sounder,
    scenario_wind,
)

PERIOD_S = 0.1
CGROUPS = Path("/sys/fs/cgroup")
AHEAD = 32  # times the weight of another control group, or of a session


@dataclass(frozen=True, slots=True, kw_only=True)
class CpuShare:
    """A share of one core that processes can be put under.

    Attributes:
        share: Of one core, more than 0 and at most 1.
        cgroup: The folder of the control group that bounds it; None: by stopping and continuing.

    """

    share: float
    cgroup: Path | None

    @property
    def means(self) -> str:
        """How it is bounded, in words."""
        return "stopping and continuing" if self.cgroup is None else f"the quota of {self.cgroup}"

    def enter(self) -> None:
        """Put the calling process, and all that it starts, under the share: in a child, before its program begins."""
        if self.cgroup is not None:
            (self.cgroup / "cgroup.procs").write_text(str(os.getpid()))

    async def hold(self, pid: int) -> None:
        """Keep a process and its children within the share until they are gone; nothing to do under a quota."""
        while self.cgroup is None and (family := family_of(pid)):
            for number, pause_s in ((signal.SIGSTOP, 1.0 - self.share), (signal.SIGCONT, self.share)):
                for member in family:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(member, number)
                await asyncio.sleep(PERIOD_S * pause_s)


def family_of(pid: int) -> list[int]:
    """Return a process and its descendants, those that have ended left out."""
    children: dict[int, list[int]] = {}
    alive = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, ValueError):
            state, parent = stat.read_text().rpartition(")")[2].split()[:2]
            if state not in "ZX":
                alive.add(int(stat.parent.name))
                children.setdefault(int(parent), []).append(int(stat.parent.name))
    family = [pid] if pid in alive else []
    for member in family:
        family += children.get(member, [])
    return family


@contextlib.asynccontextmanager
async def cpu_share(share: float) -> AsyncIterator[CpuShare]:
    """Make a share of a core, and take it away when all that was put under it has ended.

    Meanwhile this process, and what it starts from now on, goes before other load.
    """
    period_us = int(PERIOD_S * 1e6)
    quota_us = max(1000, int(share * period_us))
    folder = _group(
        "share",
        {"cpu.shares": f"{1024 * AHEAD}", "cpu.cfs_period_us": f"{period_us}", "cpu.cfs_quota_us": f"{quota_us}"},
        {"cpu.weight": f"{100 * AHEAD}", "cpu.max": f"{quota_us} {period_us}"},
    )
    ahead = _group("ahead", {"cpu.shares": f"{1024 * AHEAD}"}, {"cpu.weight": f"{100 * AHEAD}"})
    own = None if ahead is None else _own_group(ahead.parent)
    try:
        if ahead is not None and own is not None:
            (ahead / "cgroup.procs").write_text(str(os.getpid()))
        yield CpuShare(share=share, cgroup=folder)
    finally:
        with contextlib.suppress(OSError):
            if own is not None:
                (own / "cgroup.procs").write_text(str(os.getpid()))
        for group in (folder, ahead):
            with contextlib.suppress(OSError):
                if group is not None:
                    group.rmdir()


def _own_group(root: Path) -> Path | None:
    """Return the folder, below ``root``, of the control group that this process is in."""
    for line in Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines():
        _, controllers, path = line.split(":", 2)
        if "cpu" in controllers.split(",") or (root == CGROUPS and not controllers):
            return root / path.lstrip("/")
    return None


def _group(name: str, version_1: Mapping[str, str], version_2: Mapping[str, str]) -> Path | None:
    """Return a new control group with the settings of its version, None where none may be made."""
    for parent, settings in ((CGROUPS / "cpu", version_1), (CGROUPS, version_2)):
        folder = parent / f"sitl-{name}-{os.getpid()}"
        with contextlib.suppress(OSError):
            folder.mkdir()
            try:
                for file, value in settings.items():
                    if not (folder / file).exists():
                        raise FileNotFoundError(file)
                    (folder / file).write_text(value)
            except OSError:
                folder.rmdir()
                raise
            return folder
    return None


COMPANION_STOP_S = 20.0
# What befalls the companion's process or its link, and what the wind is made of.
ON_THE_LINK = LINK_EVENTS | {"vane"}
OURS = TRAFFIC | ON_THE_LINK | {"kill_companion", "wind_shift", "wind_speed"}


class _Companion:
    """The companion's process: started, killed and started again."""

    def __init__(self, command: list[str], share: CpuShare | None = None) -> None:
        self._command, self._share = command, share
        self._process: asyncio.subprocess.Process | None = None
        self._is_over = asyncio.Event()
        self._expects_death = False

    @property
    def exit_code(self) -> int | None:
        """Of the last process."""
        return None if self._process is None else self._process.returncode

    async def start(self) -> None:
        """Start it; its progress line is ours.

        A group of its own: Ctrl-C of a terminal goes to all of a group at once, and who then stops it would end it a
        second time, without a summary.
        """
        self._expects_death = False
        share = self._share
        self._process = await asyncio.create_subprocess_exec(
            *self._command, process_group=0, preexec_fn=None if share is None else share.enter
        )
        if share is not None:
            self._holder = asyncio.create_task(share.hold(self._process.pid), name="share of a core")
        self._watcher = asyncio.create_task(self._watch(self._process), name="companion process")

    async def _watch(self, process: asyncio.subprocess.Process) -> None:
        await process.wait()
        if not self._expects_death:
            self._is_over.set()

    async def opened(self, path: Path) -> None:
        """Wait until it has made ``path``, or has ended: a slow machine takes long to load and compile."""
        while not path.exists() and not self._is_over.is_set():
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._is_over.wait(), TRUTH_EVERY_S)

    async def ended(self, deadline_s: float) -> None:
        """Wait until it ends by itself; stop it at ``deadline_s``."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout_at(deadline_s):
                await self._is_over.wait()
        await self.stop()

    async def stop(self) -> None:
        """Have it end, if it runs."""
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


def run_live(
    scenario: Scenario,
    source: Path,
    seed: int,
    folder: Path,
    *,
    autopilot: str,
    program: Path | None,
    speedup: float | None,
    truth: TrueTrack | None = None,
    page: Sequence[str] = (),
    cpu: float | None = None,
) -> ScenarioVerdict:
    """Run ``scenario``; leaves a voyage folder with verdict.json. The judge's track is noted in ``truth``.

    ``page`` is what the companion is told of its live page. ``cpu`` is the share of one core, 0 to 1, that it and its
    planner get; None: all that there is.

    Raises:
        JobError: it has an event that this autopilot cannot play, or a boat that it cannot be, or the companion left
            nothing.
    """
    kind = RealBoat if autopilot == "ardurover" else SimulatedBoat
    asked = "--autopilot ardurover" if autopilot == "ardurover" else "--live" if cpu is None else "--cpu"
    cannot = sorted({e.kind for e in scenario.events} - OURS - kind.plays)
    if cannot:
        raise JobError(
            f"{scenario.name}: {', '.join(cannot)} can be played by the embedded autopilot only; leave out {asked}"
        )
    unlike = kind.cannot_be(scenario)
    if unlike:
        raise JobError(
            f"{scenario.name}: {', '.join(unlike)} can be had of the embedded autopilot only; leave out {asked}"
        )
    pace = speedup or scenario.speedup
    track = TrueTrack() if truth is None else truth
    try:
        return run(_run(scenario, source, seed, folder, autopilot, program, pace, track, page, cpu), speedup=pace)
    except asyncio.CancelledError:  # SIGTERM
        raise KeyboardInterrupt from None


async def _run(
    scenario: Scenario,
    source: Path,
    seed: int,
    folder: Path,
    kind: str,
    program: Path | None,
    pace: float,
    truth: TrueTrack,
    page: Sequence[str],
    cpu: float | None,
) -> ScenarioVerdict:
    here = asyncio.current_task()
    assert here is not None
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, here.cancel)  # it must leave nobody behind
    mission_path = scenario.mission_path(source)
    mission = load_mission(mission_path)
    wind = scenario_wind(scenario, source, seed)
    frame = mission.frame()
    seabed = scenario_seabed(scenario, source, frame)
    depths_port = sounder_port(mission, scenario)
    folder.mkdir(parents=True, exist_ok=True)
    port = free_port()
    others = Others(frame, wind, seed, port=port)
    async with contextlib.AsyncExitStack() as stack:
        share = None if cpu is None else await stack.enter_async_context(cpu_share(cpu))
        boat: LiveBoat
        if kind == "ardurover":
            sounder = scenario_sounder(scenario, seabed, seed)
            boat = await stack.enter_async_context(
                RealBoat.start(scenario, mission, wind, program, pace, folder, sounder, depths_port)
            )
        else:
            boat = await stack.enter_async_context(
                SimulatedBoat.start(source, wind, seed, pace, scenario.epoch_s, depths_port)
            )
        relay, link = None, boat.link
        if any(e.kind in ON_THE_LINK for e in scenario.events):
            relay = await stack.enter_async_context(Relay(boat.link, seed=seed))
            link = relay.link
        feeds = ["--feed", f"udpin:127.0.0.1:{port}"] if any(e.kind in TRAFFIC for e in scenario.events) else []
        companion = _Companion(
            [
                sys.executable,
                "-m",
                "companion.cli",
                "run",
                str(mission_path),
                "--link",
                link,
                "--out",
                str(folder),
                "--state",
                str(folder / "state.json"),
                "--seed",
                str(seed),
                "--speedup",
                f"{pace:g}",
                "--limit",
                f"{scenario.limit_s:g}",
                *feeds,
                *(["--sounder", depths] if (depths := feed_of(depths_port)) is not None else []),
                *(["--exit-on-arrival"] if scenario.exit_on_arrival else []),
                *(["--dry-run"] if scenario.dry_run else []),
                *page,
                "--permit",
                "arm",
                *(["--permit", "set_auto"] if scenario.set_auto else []),
            ],
            share,
        )
        stack.push_async_callback(companion.stop)
        await companion.start()
        # The scenario's clock starts when the companion does its first work, as it does on the embedded autopilot.
        await companion.opened(folder / DECISIONS)
        began_s, summary_path = now_s(), folder / SUMMARY
        side = [
            asyncio.create_task(follow(boat, frame, truth, others, began_s, summary_path), name="judge"),
            *(
                asyncio.create_task(_event(e, began_s, boat, frame, companion, others, relay), name=f"event {e.kind}")
                for e in scenario.events
            ),
        ]
        try:
            await companion.ended(began_s + scenario.limit_s + COMPANION_STOP_S * pace)
        finally:
            for task in side:
                task.cancel()
        played = await asyncio.gather(*side, return_exceptions=True)
    errors = [f"{t.get_name()}: {e!r}" for t, e in zip(side, played, strict=True) if isinstance(e, Exception)]
    if not summary_path.is_file():
        raise JobError(f"the companion left no summary in {folder}; its exit code was {companion.exit_code}")
    summary: dict[str, Any] = json.loads(summary_path.read_bytes())
    verdict = judge(
        terms_of(scenario, mission, seed, began_s),
        truth,
        Told(summary=summary, alerts=summary.get("alerts", {}), errors=errors),
        began_s=began_s,
        keel_m=keel_of(mission, truth, seabed, began_s, scenario.epoch_s),
    )
    Disk().replace(folder / VERDICT, json.dumps(verdict.to_dict(), indent=1).encode())
    return verdict


async def follow(
    boat: LiveBoat, frame: LocalFrame, truth: TrueTrack, others: Others, began_s: float, summary: Path
) -> None:
    """Note where the boat is from the moment it sails, and how near the others come, until the voyage is summed up.

    The companion goes on after its summary: it draws a picture, for a minute where it has a twentieth of a core.
    """
    sails = False
    while not summary.exists():
        fix = boat.fix()
        if fix is not None:
            sails = sails or fix.sails
            if sails:
                here = frame.en_from_geo(fix.position)
                truth.add(now_s(), here, fix.heading_rad, fix.speed_mps, fix.wind)
                others.note(truth, here, now_s() - began_s)
        await asyncio.sleep(TRUTH_EVERY_S)


async def _event(
    event: EventSpec,
    began_s: float,
    boat: LiveBoat,
    frame: LocalFrame,
    companion: _Companion,
    others: Others,
    relay: Relay | None,
) -> None:
    """Play one event; wind events are in the wind."""
    await asyncio.sleep(max(0.0, began_s + event.at_s - now_s()))
    if event.kind in TRAFFIC:
        await others.play(event, began_s, lambda: _ours(boat, frame))
    elif event.kind == "kill_companion":
        await companion.kill(event.restart_after_s)
    elif event.kind in LINK_EVENTS and relay is not None:
        await impair(relay.line, event)
    elif event.kind == "vane" and relay is not None:
        await break_vane(relay.vane.set, event)
    elif event.kind in boat.plays:
        await boat.play(event, frame)


def _ours(boat: LiveBoat, frame: LocalFrame) -> tuple[Motion, float]:
    fix = boat.fix()
    if fix is None:
        raise LinkError("where our boat is was not told yet")
    return (frame.en_from_geo(fix.position), fix.velocity_en_mps), fix.heading_rad

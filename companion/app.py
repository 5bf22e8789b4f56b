"""The composition root: the one module that knows every room, and the one task group that a voyage lives in.

``sail`` joins a transport, a planner and a mission into a voyage and returns its summary. It does not know whether
the boat is simulated, how fast time runs, or where the planner computes: all of that is in what it is given.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from companion.clock import now_s
from companion.compose import config_of, estimator_of, feeds_of, permissions_of, target_limits_of, voyage_of
from companion.executor import Executor, Planner
from companion.fold import Step, VoyageFold
from companion.geofence import Mission
from companion.geofence.autopilot_fence import fence_for_autopilot
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.tlog import stamp
from companion.mavlink.transport import Transport
from companion.messages import CompanionStatus
from companion.options import SailOptions
from companion.plots.voyage import AREA
from companion.skipper import Skipper
from companion.skipper.actions import Severity
from companion.skipper.state import Persisted, Phase
from companion.telemetry.description import chart_record, voyage_record
from companion.telemetry.recorder import STATE, Recorder, write_atomically
from companion.telemetry.records import action_record, ais_record, outcome_record, track_row
from companion.telemetry.status import companion_status
from companion.telemetry.summary import VoyageFigures
from companion.traffic.listening import Feeds
from companion.wind import WindRoom

STEP_S = 1.0
# Status to the radio: a frame of it every so often [s]; see companion.mavlink.status_wire for its bytes.
STATUS_EVERY_S = 2.0
SYNC_EVERY_S = 5.0
LOOP_WATCH_S = 0.1
# After arrival the boat loiters; the companion watches it for a moment before it ends [s].
LINGER_S = 5.0
LINGER_BUSY_S = 60.0
# Parameters that the plan and the wind depend on; asked at the start and after a reboot.
PARAMETERS = (
    "SAIL_NO_GO_ANGLE", "SAIL_XTRACK_MAX", "SAIL_LOIT_RADIUS", "WP_RADIUS", "TURN_RADIUS", "FENCE_ENABLE",
    "FENCE_ACTION", "WNDVN_TYPE", "WNDVN_SPEED_TYPE", "WNDVN_SPEED_MIN", "WNDVN_TRUE_FILT", "WNDVN_DIR_FILT",
    "WNDVN_SPEED_FILT", "WNDVN_DIR_OFS",
)

OnStatus = Callable[[CompanionStatus, Step], None]


async def sail(
    mission: Mission, transport: Transport, planner: Planner, folder: Path, options: SailOptions,
    *, on_status: OnStatus | None = None, stop: asyncio.Event | None = None,
) -> dict[str, Any]:
    """Sail ``mission`` until it is done, stopped or out of time; return the summary.

    Raises:
        LinkError: no autopilot was heard within ``options.wait_s``.
        JobError: the folder cannot be written.
    """
    with Recorder(folder) as recorder:
        shell = _Shell(mission, planner, recorder, options, on_status, stop or asyncio.Event())
        return await shell.run(transport)


class _Shell:
    """One voyage: the fold and everything around it that has a life."""

    def __init__(
        self, mission: Mission, planner: Planner, recorder: Recorder, options: SailOptions,
        on_status: OnStatus | None, stop: asyncio.Event,
    ) -> None:
        self.mission, self.recorder, self.options = mission, recorder, options
        self.planner, self.on_status, self.stop = planner, on_status, stop
        self.voyage = voyage_of(mission)
        self.config = config_of(mission)
        self.state_path = options.state_path or recorder.folder / STATE
        self.figures = VoyageFigures()
        self.status: CompanionStatus | None = None
        self.end_reason = "stopped"
        self.loop_held_s = 0.0
        self._persisted: Persisted | None = None
        self._frames = 0
        self._announced: tuple[str, str] = ("", "")
        self._refusals: list[str] = []
        self.feeds = Feeds()

    async def run(self, transport: Transport) -> dict[str, Any]:
        """Sail and leave the folder complete, whatever happens."""
        persisted = self._load_state()
        self.fold = VoyageFold(
            Skipper(voyage=self.voyage, config=self.config),
            WindRoom(estimator=estimator_of(self.mission)),
            permissions_of(self.mission, dry_run=self.options.dry_run),
            persisted, traffic=target_limits_of(self.mission),
        )
        # Growing a jagged coast takes seconds; under way the loop must not wait for it.
        self.fold.skipper.prepare()
        if persisted is not None and self.fold.state.adoptable is None:
            self._refuse_state(self.fold.state.why)
        self._write_description(transport.name)
        self.recorder.decision(self._stamped(self._quantised(now_s())[1], {
            "kind": "start", "persisted": None if persisted is None else persisted.to_dict(),
        }))
        try:
            async with (
                Link(transport, sink=self._on_frame, signing=self.options.signing) as link,
                contextlib.AsyncExitStack() as stack,
            ):
                link.subscribe(self._on_message)
                await self._wait_autopilot(link)
                autopilot = await stack.enter_async_context(Autopilot(link))
                for text in await self.feeds.open(stack, feeds_of(self.mission), self.options.seed):
                    self._refuse("AIS feed", text)
                for text in self._refusals:
                    autopilot.say(int(Severity.WARNING), text)
                executor = Executor(autopilot, self.planner, self._on_outcome, seed=self.options.seed,
                                    expansions=self.options.expansions,
                                    budget_scale=self.options.budget_scale, config=self.config)
                if self.fold.permissions.may_upload_fence:
                    await self._upload_fence(autopilot)
                async with asyncio.TaskGroup() as group:
                    tasks = [
                        group.create_task(executor.run(), name="executor"),
                        group.create_task(self._keep_parameters(autopilot, link), name="parameters"),
                        group.create_task(self._send_status(autopilot), name="radio status"),
                        group.create_task(self._sync(), name="disk sync"),
                        group.create_task(self._watch_loop(), name="loop watch"),
                    ]
                    await self._steps(executor, link)
                    for task in tasks:
                        task.cancel()
        except asyncio.CancelledError:
            self.end_reason = "interrupted"
            raise
        finally:
            summary = self._summary()
            self.recorder.summary(summary)
        return summary

    # -------------------------------------------------------------------------------------- inputs
    def _quantised(self, t_s: float) -> tuple[int, float]:
        """Return a stamp [µs since 1970] as a tlog keeps it, and the loop time [s] that it stands for."""
        stamp_us = int((self.options.epoch_s + t_s) * 1e6) & ~3
        return stamp_us, stamp_us / 1e6 - self.options.epoch_s

    def _on_frame(self, t_s: float, frame: bytes) -> None:
        self.recorder.frame(stamp(self._quantised(t_s)[0], frame))

    def _on_message(self, t_s: float, message: Any) -> None:
        self._frames += 1
        self.fold.message(self._quantised(t_s)[1], message)

    def _on_outcome(self, outcome: Any) -> None:
        t_s = self._quantised(now_s())[1]
        self.recorder.decision(self._stamped(t_s, outcome_record(outcome)))
        self.fold.take_outcome(t_s, outcome)

    # --------------------------------------------------------------------------------------- steps
    def _tick(self, t_s: float) -> Step:
        """Fold what the feeds heard, after this step's messages as a replay does, and step."""
        for report in self.feeds.take():
            self.recorder.decision(self._stamped(t_s, ais_record(report)))
            self.fold.take(report)
        return self.fold.tick(t_s)

    async def _steps(self, executor: Executor, link: Link) -> None:
        started_s = next_s = now_s()
        done_s: float | None = None
        while True:
            t_s = self._quantised(now_s())[1]
            self.fold.planner_alive(self.planner.is_alive)
            step = self._tick(t_s)
            await self._after_step(step, link)
            executor.submit(step.actions)
            if step.state.phase is Phase.DONE:
                done_s = t_s if done_s is None else done_s
                # an upload under way is brought to its end: what stays on the autopilot is one plan
                is_busy = step.state.pending_upload is not None
                if t_s - done_s >= (LINGER_BUSY_S if is_busy else LINGER_S):
                    self.end_reason = "arrived"
                    return
            else:
                done_s = None
            if self.options.limit_s is not None and t_s - started_s >= self.options.limit_s:
                self.end_reason = "out of time"
                return
            next_s = max(next_s + STEP_S, now_s())
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(next_s):
                    await self.stop.wait()
                self.end_reason = "stopped"
                return

    async def _wait_autopilot(self, link: Link) -> None:
        """Wait for the first heartbeat, and say meanwhile that nobody is heard."""
        waiting = asyncio.create_task(link.wait_autopilot(self.options.wait_s), name="first heartbeat")
        try:
            while not (await asyncio.wait([waiting], timeout=STEP_S))[0]:
                step = self._tick(self._quantised(now_s())[1])
                await self._after_step(step, link)
            await waiting
        finally:
            waiting.cancel()

    async def _after_step(self, step: Step, link: Link) -> None:
        """Record the step; nothing of it is carried out before what a restart needs is on the disk."""
        snapshot = step.snapshot
        clearance_m = None
        if snapshot.position_en_m is not None and snapshot.vehicle is not None:
            value = self.voyage.hull_clearance_m(snapshot.position_en_m, snapshot.vehicle.heading_rad)
            clearance_m = value if math.isfinite(value) else None
        self.figures.take(step, clearance_m)
        self.recorder.track(track_row(step, self._frames, clearance_m))
        self._frames = 0
        for action in step.actions:
            self.recorder.decision(self._stamped(snapshot.t_s, action_record(action, snapshot, self.config)))
        changed = (step.state.phase.value, step.state.why)
        if changed[0] != self._announced[0]:
            self.recorder.decision(self._stamped(
                snapshot.t_s, {"kind": "phase", "phase": changed[0], "why": changed[1]}))
        self._announced = changed
        self.status = companion_status(step, self.voyage, self.figures, clearance_m, link.bytes_per_s()[1],
                                       self.feeds.open_feeds, self.feeds.dropped)
        persisted = self.fold.skipper.persisted(step.state)
        if persisted != self._persisted:
            self._persisted = persisted
            data = json.dumps(persisted.to_dict()).encode()
            await self.options.offload(lambda: write_atomically(
                self.state_path, data, is_durable=self.options.is_durable))
        if self.on_status is not None:
            self.on_status(self.status, step)

    def _stamped(self, t_s: float, record: dict[str, Any]) -> dict[str, Any]:
        utc = datetime.fromtimestamp(self.options.epoch_s + t_s, UTC).isoformat(timespec="milliseconds")
        return {"t_s": t_s, "utc": utc.replace("+00:00", "Z"), **record}

    # ----------------------------------------------------------------------------------- companions
    async def _keep_parameters(self, autopilot: Autopilot, link: Link) -> None:
        """Read the parameters that matter, again after each reboot; the fold hears them as messages."""
        reboots = -1
        while True:
            if reboots != link.stats.reboots and link.is_alive:
                reboots = link.stats.reboots
                for name in PARAMETERS:
                    await autopilot.get_parameter(name)
            await asyncio.sleep(STEP_S)

    async def _upload_fence(self, autopilot: Autopilot) -> None:
        """Put the fence of the mission's water on the autopilot and switch it on: its last line of defence."""
        mission = self.mission
        places = [g.point for g in mission.goals] + ([mission.start] if mission.start else [])
        fence = fence_for_autopilot(mission.area, mission.margin_m, inside=places)
        record: dict[str, Any] = {"kind": "fence", "status": fence.status.name, "text": fence.reason}
        if fence.items:
            done = await autopilot.upload_fence(fence.items)
            record |= {"outcome": done.outcome.value, "text": done.text, "count": len(fence.items)}
            if done.is_ok:
                record["enabled"] = (await autopilot.enable_fence()).outcome.value
        self.recorder.decision(self._stamped(self._quantised(now_s())[1], record))

    async def _send_status(self, autopilot: Autopilot) -> None:
        while True:
            if self.status is not None:
                autopilot.send_status(self.status)
            self._tell_silence(autopilot)
            await asyncio.sleep(STATUS_EVERY_S)

    def _tell_silence(self, autopilot: Autopilot) -> None:
        """Say and record that a feed has fallen silent, and that it is heard again."""
        for feed in self.feeds.changed():
            text = f"AIS feed {'silent' if feed.is_silent else 'heard again'}: {feed.sentence()}"
            self.recorder.decision(self._stamped(
                self._quantised(now_s())[1], {"kind": "feed", "silent": feed.is_silent, "text": text}))
            autopilot.say(int(Severity.WARNING if feed.is_silent else Severity.NOTICE), text)

    async def _watch_loop(self) -> None:
        """Measure how long the event loop was held: a timer that fires late was kept waiting by somebody."""
        while True:
            due_s = now_s() + LOOP_WATCH_S
            await asyncio.sleep(LOOP_WATCH_S)
            self.loop_held_s = max(self.loop_held_s, now_s() - due_s)

    async def _sync(self) -> None:
        while True:
            await asyncio.sleep(SYNC_EVERY_S)
            if self.options.is_durable:
                await self.options.offload(self.recorder.sync)

    # ---------------------------------------------------------------------------------------- files
    def _load_state(self) -> Persisted | None:
        try:
            return Persisted.from_dict(json.loads(self.state_path.read_bytes()))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            self._refuse_state(str(error))
            return None

    def _refuse_state(self, why: str) -> None:
        """Record that the saved state is not resumed, and keep the sentence for the radio."""
        self._refuse("saved state", f"{self.state_path.name} is not used: {why}")

    def _refuse(self, what: str, text: str) -> None:
        self.recorder.decision(self._stamped(now_s(), {"kind": "refusal", "what": what, "text": text}))
        self._refusals.append(text)

    def _write_description(self, link: str) -> None:
        chart = chart_record(self.mission, self.voyage, self.config.margin_m)
        write_atomically(self.recorder.folder / AREA, json.dumps(chart).encode())
        options = self.options
        self.recorder.voyage(voyage_record(self.mission, self.fold.permissions, {
            "command": options.command, "link": link, "seed": options.seed, "dry_run": options.dry_run,
            "expansions": options.expansions, "epoch_s": options.epoch_s,
            "started_utc": datetime.fromtimestamp(options.epoch_s + now_s(), UTC).isoformat(),
        }))

    def _summary(self) -> dict[str, Any]:
        state = self.fold.state
        goals = len(self.voyage.legs)
        return {
            "mission": self.mission.name,
            "arrived": state.phase is Phase.DONE,
            **self.figures.to_dict(),
            "goals_reached": min(goals, len(state.reached)),
            "goals": goals,
            "end_phase": state.phase.value,
            "end_reason": self.end_reason,
            "end_why": state.why,
            "ais_feeds": [feed.sentence() for feed in self.feeds.open_feeds],
            "ais_dropped": self.feeds.dropped,
            "records_dropped": self.recorder.dropped,
            "planner_restarts": self.planner.restarts,
            "loop_held_max_s": round(self.loop_held_s * self.options.budget_scale, 4),
        }

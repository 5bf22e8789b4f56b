"""The composition root: the one module that knows every room, and the one task group that a voyage lives in.

``sail`` joins a transport, a planner and a mission into a voyage and returns its summary. It does not know whether
the boat is simulated, how fast time runs, or where the planner computes: all of that is in what it is given.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from companion.clock import now_s
from companion.compose import config_of, estimator_of, feeds_of, permissions_of, target_limits_of, voyage_of
from companion.executor import Executor, Planner
from companion.fold import Step, VoyageFold
from companion.geofence import Mission
from companion.geofence.autopilot_fence import fence_for_autopilot
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.transport import Transport
from companion.messages import CompanionStatus
from companion.options import SailOptions
from companion.skipper import Skipper
from companion.skipper.actions import Severity
from companion.skipper.state import Phase
from companion.telemetry.logbook import Logbook
from companion.telemetry.names import STATE
from companion.telemetry.progress import DISK
from companion.telemetry.radio import Radio
from companion.telemetry.recorder import Recorder
from companion.telemetry.records import ais_record, outcome_record
from companion.telemetry.state_file import StateFile
from companion.telemetry.status import companion_status
from companion.traffic.listening import Feeds
from companion.wind import WindRoom

STEP_S = 1.0
TEND_EVERY_S = 5.0        # records are synced, and taken up again after trouble
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
        JobError: the folder's name cannot be one, or another companion is recording there.
    """
    with Recorder(folder, disk=options.disk, shelf=options.shelf, is_durable=options.is_durable) as recorder:
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
        self.log = Logbook(recorder, self.config, options.epoch_s)
        self.state_file = StateFile(
            options.state_path or recorder.folder / STATE, disk=options.disk, offload=options.offload,
            is_durable=options.is_durable, pace=1.0 / options.budget_scale)
        self.status: CompanionStatus | None = None
        self.end_reason = "stopped"
        self.loop_held_s = 0.0
        self._arrived_before = False
        self._refusals: list[str] = []
        self.feeds = Feeds()

    async def run(self, transport: Transport) -> dict[str, Any]:
        """Sail and leave the folder complete, whatever happens."""
        self._begin(transport.name)
        try:
            async with (
                Link(transport, sink=self.log.frame, signing=self.options.signing) as link,
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
                radio = Radio(autopilot, self.feeds, self.log, status=lambda: self.status, trouble=self._trouble)
                if self.fold.permissions.may_upload_fence:
                    await self._upload_fence(autopilot)
                async with asyncio.TaskGroup() as group:
                    tasks = [
                        group.create_task(executor.run(), name="executor"),
                        group.create_task(self._keep_parameters(autopilot, link), name="parameters"),
                        group.create_task(radio.run(), name="radio"),
                        group.create_task(self._tend_records(), name="records"),
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

    def _begin(self, link: str) -> None:
        """Begin the fold with what is known from before, and write that down."""
        options = self.options
        skipper = Skipper(voyage=self.voyage, config=self.config)
        persisted, known = self.state_file.load(), self.state_file.known()
        if persisted is not None and skipper.has_arrived(persisted):
            self._arrived_before = not options.is_again
            if options.is_again:
                known = (*known, *persisted.names)
                persisted = None
        self.fold = VoyageFold(
            skipper, WindRoom(estimator=estimator_of(self.mission)),
            permissions_of(self.mission, dry_run=options.dry_run), persisted, known=known,
            traffic=target_limits_of(self.mission),
        )
        # Growing a jagged coast takes seconds; under way the loop must not wait for it.
        skipper.prepare()
        t_s = self.log.now_s()
        self.log.begin(t_s, self.mission, self.voyage, self.fold.permissions, persisted, known, {
            "command": options.command, "link": link, "seed": options.seed, "dry_run": options.dry_run,
            "expansions": options.expansions,
        })
        if self.state_file.refusal:
            self._refuse("saved state", self.state_file.refusal)
        elif persisted is not None and self.fold.state.adoptable is None:
            self._refuse("saved state", f"{self.state_file.path.name} is not used: {self.fold.state.why}")

    # -------------------------------------------------------------------------------------- inputs
    def _on_message(self, t_s: float, message: Any) -> None:
        self.log.message()
        self.fold.message(self.log.quantised(t_s)[1], message)

    def _on_outcome(self, outcome: Any) -> None:
        t_s = self.log.now_s()
        self.log.note(t_s, outcome_record(outcome))
        self.fold.take_outcome(t_s, outcome)

    # --------------------------------------------------------------------------------------- steps
    def _tick(self, t_s: float) -> Step:
        """Fold what the feeds heard, after this step's messages as a replay does, and step."""
        for report in self.feeds.take():
            self.log.note(t_s, ais_record(report))
            self.fold.take(report)
        return self.fold.tick(t_s)

    async def _steps(self, executor: Executor, link: Link) -> None:
        started_s = next_s = now_s()
        done_s: float | None = None
        while True:
            t_s = self.log.now_s()
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
                step = self._tick(self.log.now_s())
                await self._after_step(step, link)
            await waiting
        finally:
            waiting.cancel()

    async def _after_step(self, step: Step, link: Link) -> None:
        """Record the step; nothing of it is carried out before what a restart needs is on the disk."""
        snapshot = step.snapshot
        clearance_m = None
        if snapshot.position_en_m is not None:
            value = float(self.voyage.area.clearance_m(np.array([snapshot.position_en_m]))[0])
            clearance_m = value if np.isfinite(value) else None
        self.log.step(step, clearance_m)
        if not self.options.dry_run:   # which must not take the place of a voyage that is interrupted
            await self.state_file.save(self.fold.skipper.persisted(step.state))
        status = companion_status(step, self.voyage, self.log.figures, clearance_m, link.bytes_per_s()[1],
                                  self.feeds.open_feeds, self.feeds.dropped)
        trouble = self._trouble()
        if trouble and not status.alert_code:
            status = replace(status, alert_code=DISK, alert_text=trouble)
        self.status = status
        if self.on_status is not None:
            self.on_status(status, step)

    def _trouble(self) -> str:
        """Return what cannot be written now and why, empty when all is well."""
        state, records = self.state_file.trouble, self.recorder.trouble
        return "; ".join(text for text in (
            f"no state for a restart is saved: {state}" if state else "",
            f"nothing is recorded: {records}" if records else "") if text)

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
        self.log.note(self.log.now_s(), record)

    async def _watch_loop(self) -> None:
        """Measure how long the event loop was held: a timer that fires late was kept waiting by somebody."""
        while True:
            due_s = now_s() + LOOP_WATCH_S
            await asyncio.sleep(LOOP_WATCH_S)
            self.loop_held_s = max(self.loop_held_s, now_s() - due_s)

    async def _tend_records(self) -> None:
        while True:
            await asyncio.sleep(TEND_EVERY_S)
            stamps = self.log.stamps(self.log.now_s())
            await self.options.offload(functools.partial(self.recorder.tend, stamps))

    # ---------------------------------------------------------------------------------------- files
    def _refuse(self, what: str, text: str) -> None:
        """Record that something given is not used, and keep the sentence for the radio."""
        self.log.note(self.log.now_s(), {"kind": "refusal", "what": what, "text": text})
        self._refusals.append(text)

    def _summary(self) -> dict[str, Any]:
        state = self.fold.state
        goals = len(self.voyage.legs)
        return {
            "mission": self.mission.name,
            "arrived": state.phase is Phase.DONE,
            "arrived_before": self._arrived_before,
            **self.log.figures.to_dict(),
            "goals_reached": min(goals, len(state.reached)),
            "goals": goals,
            "end_phase": state.phase.value,
            "end_reason": self.end_reason,
            "end_why": state.why,
            "ais_feeds": [feed.sentence() for feed in self.feeds.open_feeds],
            "ais_dropped": self.feeds.dropped,
            "records_dropped": self.recorder.dropped,
            "disk_trouble": self._trouble(),
            "planner_restarts": self.planner.restarts,
            "loop_held_max_s": round(self.loop_held_s * self.options.budget_scale, 4),
        }

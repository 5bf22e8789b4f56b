"""The composition root: the one module that knows every room, and the one task group that a voyage lives in.

``sail`` joins a transport, a planner and a mission into a voyage and returns its summary. It does not know whether
the boat is simulated, how fast time runs, or where the planner computes: all of that is in what it is given.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import math
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from companion.app.autopilot_upkeep import NOBODY, keep_fence, keep_identity, keep_parameters, make_way, others_on
from companion.app.executor import Executor, Planner
from companion.app.from_autopilot import ADOPTED, Adoption
from companion.app.local_clients import OnView, OperatorCommands, ViewBroadcast, live_page, take_orders
from companion.app.options import SailOptions, SatelliteLink
from companion.app.satellite import SatelliteMailbox
from companion.clock import now_s
from companion.compose import (
    config_of,
    estimator_of,
    feeds_of,
    permissions_of,
    sounder_of,
    target_limits_of,
    voyage_of,
    water_of,
    waters_of,
)
from companion.fold import Step, VoyageFold, begun
from companion.geofence import Mission
from companion.guard import Auxiliary, Guard
from companion.kernels.memory import trim
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.reception import LinkIdentity, LinkStats
from companion.mavlink.transports import Transport
from companion.mavlink.wire import Drop
from companion.messages import CompanionStatus, MissionItem, Severity
from companion.skipper import Skipper
from companion.skipper.step import Announce, Phase, Snapshot
from companion.telemetry.console import DISK, GONE, left_behind
from companion.telemetry.folder import (
    STATE,
    Logbook,
    Recorder,
    ais_record,
    fence_record,
    order_record,
    outcome_record,
    sounding_record,
)
from companion.telemetry.state_file import StateFile
from companion.telemetry.status import CLOCK_OFF_S, TelemetrySender, companion_status, speak_high_latency
from companion.traffic.feeds import Feeds
from companion.traffic.nmea import NmeaDecoder
from companion.traffic.soundings import SoundingDecoder, below_transducer_m

STEP_S = 1.0
TEND_EVERY_S = 5.0  # records are synced, and taken up again after trouble
LOOP_WATCH_S = 0.1
# With ``exit_on_arrival`` the loiter is watched for a moment before the program ends [s].
LINGER_S = 5.0
LINGER_BUSY_S = 60.0

_AUXILIARIES = frozenset(Auxiliary)
OnStatus = Callable[[CompanionStatus, Step], None]


async def sail(
    mission: Mission,
    transport: Transport,
    planner: Planner,
    folder: Path,
    options: SailOptions,
    *,
    on_status: OnStatus | None = None,
    on_refusal: Callable[[str], None] | None = None,
    on_view: OnView | None = None,
    stop: asyncio.Event | None = None,
    guard: Guard | None = None,
) -> dict[str, Any]:
    """Sail ``mission`` and watch the boat at its end until stopped or out of time; return the summary.

    ``on_status`` hears of every step, ``on_refusal`` of what was given and is not used (a saved state, a feed),
    ``on_view`` of every step as a view. ``guard`` knows what was gone already: it is told with this voyage.

    Raises:
        LinkError: no autopilot was heard within ``options.wait_s``.
        JobError: the folder's name cannot be one, or another companion is recording there.
    """
    with Recorder(folder, disk=options.disk, archive=options.archive, is_durable=options.is_durable) as recorder:
        shell = _Shell(mission, planner, recorder, options, stop or asyncio.Event(), guard or Guard(seed=options.seed))
        shell.on_status, shell.on_refusal = on_status, on_refusal
        if on_view is not None:
            shell.views.watchers.append(on_view)
        return await shell.run(transport)


class _Shell:
    """One voyage: the fold and everything around it that has a life."""

    def __init__(
        self,
        mission: Mission,
        planner: Planner,
        recorder: Recorder,
        options: SailOptions,
        stop: asyncio.Event,
        guard: Guard,
    ) -> None:
        self.mission, self.recorder, self.options = mission, recorder, options
        self.planner, self.stop, self.guard = planner, stop, guard
        self.on_status: OnStatus | None = None
        self.on_refusal: Callable[[str], None] | None = None
        self.voyage = voyage_of(mission)
        self.config = config_of(mission)
        self.log = Logbook(
            recorder,
            self.config,
            options.epoch_s,
            clock_epoch_s=options.clock_epoch_s,
            pace=1.0 if options.clock_epoch_s is None else 1.0 / options.budget_scale,
        )
        self.views = ViewBroadcast(self.voyage, self.config, options.epoch_s, guard)
        self.views.is_kept = options.socket is not None
        self.state_file = StateFile(
            options.state_path or recorder.folder / STATE,
            disk=options.disk,
            offload=options.offload,
            is_durable=options.is_durable,
            pace=1.0 / options.budget_scale,
        )
        self.status: CompanionStatus | None = None
        self._step: Step | None = None
        self.end_reason = "stopped"
        self._adopted = asyncio.Event()  # a drawing: this voyage gives way to it
        self.loop_held_s = 0.0
        self._arrived_before = False
        self._named = mission.autopilot.system  # of our autopilot: as named, or as of the voyage that goes on
        self._refusals: list[str] = []
        self._unsaid: dict[str, Announce] = {}  # before the autopilot was found: the last of each code
        self.feeds = Feeds("AIS feed", NmeaDecoder)
        self.depths = Feeds("sounder", SoundingDecoder)
        self._fences: list[tuple[MissionItem, ...]] = []  # that were read of the autopilot since the last step
        self._system: int | None = None  # of our autopilot, as heard
        self._others = NOBODY
        self._planner_alive = True
        self._autopilot: Autopilot | None = None
        self._crew: OperatorCommands | None = None
        self._counted = LinkStats()
        self._are_clocks_compared = False

    async def run(self, transport: Transport) -> dict[str, Any]:
        """Sail and leave the folder complete, whatever happens."""
        self._begin(transport.name)
        try:
            async with (
                Link(
                    transport,
                    sink=self.log.frame,
                    signing=self.options.signing,
                    is_starting=True,
                    identity=LinkIdentity(token=self.options.token),
                    target_system=self._named,
                    objection=self.fold.objection,
                    stamp=self.log.stamped_s,
                    on_fault=self._on_fault,
                ) as link,
                contextlib.AsyncExitStack() as stack,
            ):
                stack.push_async_callback(self.guard.end)
                self._counted = link.stats
                operator = self._crew = OperatorCommands(link, has_key=self.options.signing is not None)
                link.subscribe(self._on_message)
                if self.options.http is not None:
                    self.guard.keep(
                        Auxiliary.PAGE,
                        functools.partial(
                            live_page,
                            self.options.http,
                            self.fold,
                            self.planner,
                            operator,
                            self.views,
                            pace=1.0 / self.options.budget_scale,
                            charts=self.options.charts,
                            planned=self.options.planned,
                        ),
                    )
                if not await self._wait_autopilot(link):
                    return self._summary()
                autopilot = self._autopilot = await stack.enter_async_context(
                    Autopilot(link, assembler=self.fold.assembler)
                )
                for feeds, names, what in (
                    (self.feeds, feeds_of(self.mission), "AIS feed"),
                    (self.depths, sounder_of(self.mission), "sounder"),
                ):
                    opening = functools.partial(feeds.open, stack, names, self.options.seed)
                    for text in await self.guard.wait(Auxiliary.FEEDS, opening) or ():
                        self._refuse(what, text)
                for text in self._refusals:
                    autopilot.say(int(Severity.WARNING), text)
                adoption = Adoption(autopilot, self.options.settings, self._adopted.set)
                executor = Executor(
                    autopilot,
                    self.planner,
                    self._on_outcome,
                    seed=self.options.seed,
                    expansions=self.options.expansions,
                    budget_scale=self.options.budget_scale,
                    config=self.config,
                    on_adopt=adoption.ask,
                    on_answer=operator.answered,
                )
                executor.submit(tuple(self._unsaid.values()))
                async with asyncio.TaskGroup() as group:  # what is worth the voyage
                    orders = group.create_task(executor.run(), name="executor")
                    self._keep_auxiliaries(autopilot, operator, adoption)
                    operator.begin()
                    try:
                        await self._steps(executor, link)
                    finally:
                        await self.guard.end()
                    orders.cancel()
        except asyncio.CancelledError:
            self.end_reason = "interrupted"
            raise
        finally:
            summary = self._summary()
            self.recorder.summary(summary)
        return summary

    def _keep_auxiliaries(self, autopilot: Autopilot, operator: OperatorCommands, adoption: Adoption) -> None:
        """Begin what lives beside the voyage: of none of it the voyage ends."""
        options, keep = self.options, self.guard.keep
        if options.socket is not None:
            keep(Auxiliary.SOCKET, functools.partial(take_orders, options.socket, operator, self.views))
        if options.far is not None:
            keep(Auxiliary.FAR, self._mailbox(options.far, autopilot, operator).run)
        keep(Auxiliary.ADOPTION, adoption.run)
        keep(Auxiliary.IDENTITY, lambda: keep_identity(self.fold, autopilot))
        keep(Auxiliary.PARAMETERS, lambda: keep_parameters(self.fold, autopilot))
        keep(
            Auxiliary.FENCE,
            lambda: keep_fence(
                self.fold, autopilot, self.mission, self._record, self._fences.append, self.options.offload
            ),
        )
        keep(
            Auxiliary.RADIO,
            TelemetrySender(autopilot, self.feeds, self.log, status=lambda: self.status, trouble=self._trouble).run,
        )
        keep(
            Auxiliary.HIGH_LATENCY,
            lambda: speak_high_latency(autopilot, self._seen, lambda: operator.wants_high_latency),
        )
        keep(Auxiliary.CREW, lambda: operator.watch(autopilot, self._record))
        keep(Auxiliary.RECORDS, self._tend_records)
        keep(Auxiliary.LOOP_WATCH, self._watch_loop)

    def _mailbox(self, far: SatelliteLink, autopilot: Autopilot, operator: OperatorCommands) -> SatelliteMailbox:
        """Return the mailbox of the satellite link."""
        link, options = autopilot.link, self.options
        return SatelliteMailbox(
            far,
            link.party.target_system,
            operator,
            disk=options.disk,
            offload=options.offload,
            is_durable=options.is_durable,
            seen=self._seen,
            is_heard=lambda: link.is_alive,
            has_trouble=lambda: bool(self._trouble()),
            say=autopilot.say,
            record=self._record,
        )

    def _seen(self) -> tuple[CompanionStatus, Step] | None:
        """Return the newest status and the step that it tells of, None before there is one."""
        return None if self.status is None or self._step is None else (self.status, self._step)

    def _begin(self, link: str) -> None:
        """Begin the fold with what is known from before, and write that down."""
        options = self.options
        skipper = Skipper(voyage=self.voyage, config=self.config)
        persisted, known = self.state_file.load(), (*self.state_file.known(), *options.known)
        waters = waters_of(self.mission)
        skipper, persisted = begun(skipper, persisted, waters)
        if persisted is not None and skipper.has_arrived(persisted):
            self._arrived_before = not options.is_again
            if options.is_again:
                known = (*known, *persisted.names)
                persisted = None
        if self._named is None and persisted is not None and skipper.fits(persisted):
            self._named = persisted.system
        self.fold = VoyageFold(
            skipper,
            options.room(estimator_of(self.mission)),
            permissions_of(self.mission, dry_run=options.dry_run),
            persisted,
            known=known,
            traffic=target_limits_of(self.mission),
            waters=waters,
            water=water_of(self.mission),
        )
        # Growing a jagged coast takes seconds; under way the loop must not wait for it.
        self.fold.skipper.prepare()
        t_s = self.log.now_s()
        self.guard.call(
            Auxiliary.RECORDS,
            lambda: self.log.begin(
                t_s,
                self.mission,
                self.voyage,
                self.fold.permissions,
                persisted,
                known,
                {
                    "command": options.command,
                    "link": link,
                    "seed": options.seed,
                    "dry_run": options.dry_run,
                    "expansions": options.expansions,
                },
            ),
        )
        before, self.guard.told = dict(self.guard.gone), self._changed
        for name, why in before.items():
            self._changed(name, why, is_said=True)
        if self.state_file.refusal:
            self._refuse("saved state", self.state_file.refusal)
        elif persisted is not None and self.fold.state.mission.adoptable is None and not options.is_again:
            self._refuse("saved state", f"{self.state_file.path.name} is not used: {self.fold.state.why}")
        elif persisted is not None and (change := skipper.change_of(persisted)):
            self._refuse("saved state", change)

    # -------------------------------------------------------------------------------------- inputs
    def _on_message(self, t_s: float, message: Any) -> None:
        if self._system is None or message.get_srcSystem() == self._system:  # not a command of somebody ashore
            self.log.message()
            self.fold.message(t_s, message)

    def _record(self, record: dict[str, Any]) -> None:
        """Record something that happened now."""
        self._note(self.log.now_s(), record)

    def _note(self, t_s: float, record: dict[str, Any]) -> None:
        self.guard.call(Auxiliary.RECORDS, lambda: self.log.note(t_s, record))

    def _changed(self, name: str, why: str, *, is_said: bool = False) -> None:
        """Record, and say to the shore, what is gone beside the voyage and what is there again."""
        severity = Severity.WARNING if why else Severity.NOTICE
        text = f"sailing on without the {name}: {why}" if why else f"the {name} is there again"
        if self._autopilot is None:
            self._refusals.append(text)
        else:
            self._autopilot.say(int(severity), text)
        self._record({"kind": "auxiliary", "what": name, "gone": bool(why), "text": text})
        if self.on_refusal is not None and not is_said and name in _AUXILIARIES:  # an output speaks for itself
            self.on_refusal(text)

    def _on_fault(self, text: str) -> None:
        """Record and say a fault of whoever listens on the link; the link itself goes on."""
        if self._autopilot is not None:
            self._autopilot.say(int(Severity.ERROR), text)
        self._record({"kind": "fault", "text": text})

    def _on_outcome(self, outcome: Any) -> None:
        t_s = self.log.now_s()
        self.guard.call(Auxiliary.RECORDS, lambda: self.log.note(t_s, outcome_record(outcome)))
        self.fold.take_outcome(t_s, outcome)

    # --------------------------------------------------------------------------------------- steps
    def _tick(self, t_s: float, link: Link) -> Step:
        """Fold what is no message or outcome, recorded, after this step's messages as a replay does, and step."""
        if self.planner.is_alive != self._planner_alive:
            self._planner_alive = not self._planner_alive
            self._note(t_s, {"kind": "planner process", "alive": self._planner_alive})
            self.fold.planner_alive(self._planner_alive)
        if link.has_autopilot:
            others = others_on(link, named=self._named)
            if others != self._others:
                self._others = others
                self._note(t_s, others.to_record())
                self.fold.others(others.neighbours, has_company=others.has_company, has_shore=others.has_shore)
        for report in self.feeds.take():
            self._note(t_s, ais_record(report))
            self.fold.take(report)
        for ping in self.depths.take():
            boat = self.mission.options.boat
            below_m = below_transducer_m(ping, boat.draft_m, boat.transducer_m)
            self._note(t_s, sounding_record(below_m, ping.most_m))
            self.fold.sounded(t_s, below_m, ping.most_m)
        for items in self._fences:
            self._note(t_s, fence_record(items))
            self.fold.fence(items)
        self._fences.clear()
        for order in () if self._crew is None else self._crew.take():
            self._note(t_s, order_record(order))
            self.fold.event(order)
        return self.fold.tick(t_s)

    async def _steps(self, executor: Executor, link: Link) -> None:
        started_s = next_s = now_s()
        done_s: float | None = None
        while True:
            t_s = self.log.now_s()
            step = self._tick(t_s, link)
            await self._after_step(step, link)
            executor.submit(step.actions)
            if step.state.phase is Phase.DONE and self.options.exit_on_arrival:
                done_s = t_s if done_s is None else done_s
                # an upload under way is brought to its end: what stays on the autopilot is one plan
                is_busy = step.state.pending.upload is not None
                if t_s - done_s >= (LINGER_BUSY_S if is_busy else LINGER_S):
                    self.end_reason = "arrived" if step.state.voyage.arrived else "over"
                    return
            else:
                done_s = None
            if self.options.limit_s is not None and t_s - started_s >= self.options.limit_s:
                self.end_reason = "out of time"
                return
            if self._adopted.is_set():
                self.end_reason = ADOPTED
                return
            next_s = max(next_s + STEP_S, now_s())
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(next_s):
                    await self.stop.wait()
                self.end_reason = "stopped"
                return

    async def _wait_autopilot(self, link: Link) -> bool:
        """Wait until our autopilot is found and nobody else sails it, and say meanwhile that nobody is heard.

        Return False when the voyage is stopped before.

        Raises:
            LinkError: it is not found, or another companion is at work.
        """
        waiting = asyncio.create_task(self._find(link), name="whose boat")
        stopping = asyncio.create_task(self.stop.wait(), name="stopped before")
        try:
            while not (await asyncio.wait([waiting, stopping], timeout=STEP_S, return_when=asyncio.FIRST_COMPLETED))[0]:
                step = self._tick(self.log.now_s(), link)
                await self._after_step(step, link)
                for action in step.actions:
                    if isinstance(action, Announce):
                        self._unsaid.pop(action.code, None)  # in the order in which they were said last
                        self._unsaid[action.code] = action
            if not waiting.done():
                return False
            await waiting
            return True
        finally:
            waiting.cancel()
            stopping.cancel()

    async def _find(self, link: Link) -> None:
        self._system = (await link.wait_autopilot(self.options.wait_s)).target_system
        self._record({"kind": "autopilot", "system": self._system, "unheard": link.unheard})
        await make_way(link, named=self._named, token=self.options.token)
        link.started()

    async def _after_step(self, step: Step, link: Link) -> None:
        """Record the step; nothing of it is carried out before what a restart needs is on the disk."""
        guard = self.guard
        guard.look()
        clearance_m = guard.call(Auxiliary.STATUS, lambda: _clearance_m(step))
        guard.call(Auxiliary.RECORDS, lambda: self.log.step(step, clearance_m))
        if not self.options.dry_run:  # which must not take the place of a voyage that is interrupted
            await guard.wait(Auxiliary.STATE, lambda: self.state_file.save(self.fold.skipper.persisted(step.state)))
        guard.call(Auxiliary.RECORDS, lambda: self._compare_clocks(step.snapshot))
        status = guard.call(Auxiliary.STATUS, lambda: self._status(step, clearance_m, link)) or CompanionStatus(
            t_s=step.snapshot.t_s,
            state=step.state.phase.value,
            alert_code=GONE,
            alert_text=guard.sentence(),
            gone=guard.sentence(),
        )
        self.status, self._step = status, step
        if self.on_status is not None:
            self.on_status(status, step)
        self.views.take(step, status, self.log.figures)

    def _status(self, step: Step, clearance_m: float | None, link: Link) -> CompanionStatus:
        """Return the status at a step; where nothing else is wrong it tells what cannot be written, or is gone."""
        status = companion_status(
            step,
            step.voyage,
            self.log.figures,
            clearance_m,
            link.bytes_per_s()[1],
            self.feeds.open_feeds,
            self.feeds.dropped,
        )
        trouble, gone = self._trouble(), self.guard.sentence()
        if not (trouble or gone):
            return status
        status = replace(status, disk_trouble=trouble, gone=gone)
        return (
            status
            if status.alert_code
            else replace(status, alert_code=DISK if trouble else GONE, alert_text=trouble or gone)
        )

    def _compare_clocks(self, snapshot: Snapshot) -> None:
        """Record once by how much this computer's clock, which stamps the records, is off the autopilot's by GPS.

        A board without a battery begins in the past, and the network, which would say so, is far away. Nothing that is
        decided hangs on this clock.
        """
        boat_s = None if self._are_clocks_compared else snapshot.unix_s(snapshot.t_s)
        if boat_s is None:
            return
        self._are_clocks_compared = True
        behind_s = boat_s - self.options.epoch_s - snapshot.t_s
        if abs(behind_s) >= CLOCK_OFF_S:
            when = datetime.fromtimestamp(boat_s, UTC).isoformat(timespec="seconds")
            self._record(
                {
                    "kind": "clock",
                    "behind_s": round(behind_s, 1),
                    "text": (
                        f"it is {when} by the autopilot's clock; this computer's, which stamps these records, is "
                        f"{abs(behind_s):.0f} s {'behind' if behind_s > 0.0 else 'ahead'}"
                    ),
                }
            )

    def _trouble(self) -> str:
        """Return what cannot be written now and why, empty when all is well."""
        state, records = self.state_file.trouble, self.recorder.trouble
        return "; ".join(
            text
            for text in (
                f"no state for a restart is saved: {state}" if state else "",
                f"nothing is recorded: {records}" if records else "",
            )
            if text
        )

    # ----------------------------------------------------------------------------------- companions
    async def _watch_loop(self) -> None:
        """Measure how long the event loop was held: a timer that fires late was kept waiting by somebody."""
        while True:
            due_s = now_s() + LOOP_WATCH_S
            await asyncio.sleep(LOOP_WATCH_S)
            self._held(now_s() - due_s)

    def _held(self, late_s: float) -> None:
        self.loop_held_s = max(self.loop_held_s, late_s)

    async def _tend_records(self) -> None:
        while True:
            await asyncio.sleep(TEND_EVERY_S)
            stamps = self.log.stamps(self.log.now_s())
            await self.options.offload(functools.partial(self.recorder.tend, stamps))
            if self.options.is_durable:  # on a boat: what plans and pictures of the past have left, some 2 MB
                await self.options.offload(trim)

    # ---------------------------------------------------------------------------------------- files
    def _refuse(self, what: str, text: str) -> None:
        """Record that something given is not used, and keep the sentence for the radio."""
        self._record({"kind": "refusal", "what": what, "text": text})
        self._refusals.append(text)
        if self.on_refusal is not None:
            self.on_refusal(text)

    def _summary(self) -> dict[str, Any]:
        state = self.fold.state
        goals = len(self.voyage.legs)
        return {
            "mission": self.mission.name,
            "arrived": state.voyage.arrived,
            "arrived_before": self._arrived_before and not self.log.figures.uploads,
            **self.log.figures.to_dict(),
            "goals_reached": min(goals, len(state.progress.reached)),
            "goals_given_up": state.orders.skipped,
            "goals": goals,
            "searched": [
                {"goal": self.voyage.legs[goal].name or f"goal {goal + 1}", "covered": share}
                for goal, share in state.progress.covered
                if goal < goals
            ],
            "end_phase": state.phase.value,
            "end_reason": self.end_reason,
            "end_why": state.why,
            "left_behind": "" if self._step is None else left_behind(self._step),
            "ais_feeds": [feed.sentence() for feed in self.feeds.open_feeds],
            "ais_dropped": self.feeds.dropped,
            "frames_disbelieved": sum(
                self._counted.dropped[why] for why in (Drop.WRONG_CLOCK, Drop.OUT_OF_STEP, Drop.HELD)
            ),
            "listener_faults": dict(self._counted.faults),
            "commands_unsigned": 0 if self._crew is None else self._crew.unsigned,
            "records_dropped": self.recorder.dropped,
            "disk_trouble": self._trouble(),
            "gone": dict(self.guard.gone),
            "planner_restarts": self.planner.restarts,
            "loop_held_max_s": round(self.loop_held_s * self.options.budget_scale, 4),
        }


def _clearance_m(step: Step) -> float | None:
    """Return what the hull keeps clear of now [m], None where it is not known."""
    snapshot = step.snapshot
    if snapshot.position_en_m is None or snapshot.vehicle is None:
        return None
    value = step.voyage.hull_clearance_m(snapshot.position_en_m, snapshot.vehicle.heading_rad)
    return value if math.isfinite(value) else None

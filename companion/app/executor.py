"""Carries out what the skipper asked for, and hands back how each ended.

Transfers and commands go to the autopilot one after another, in the order asked; planning runs beside them, one
request at a time, the newest winning. The skipper hears every outcome under the id of its action.

No order outlives the skipper's patience with it: on a bad link an order that is still waiting, or still under way, when
the skipper has given it up would act on the autopilot when nobody reckons with it any more.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from companion.clock import now_s
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.microservices import CommandAnswer
from companion.mavlink.microservices import TransferOutcome as WireOutcome
from companion.planner import Plan, Problem
from companion.planners import Settings
from companion.skipper import SkipperConfig
from companion.skipper.step import (
    Acknowledge,
    Action,
    AdoptDrawing,
    Announce,
    Arm,
    CancelPlan,
    CommandOutcome,
    CommandResult,
    Outcome,
    PlanOutcome,
    ReadMission,
    ReadOutcome,
    ReplanReason,
    RequestPlan,
    RunMotor,
    SetCurrent,
    SetMode,
    SetParameter,
    SteerHeading,
    StopOrders,
    Tack,
    UploadFence,
    UploadMission,
    UploadOutcome,
    UploadResult,
)

# More orders than this waiting means that the autopilot has long stopped answering.
MAX_WAITING = 16
# Real time that a plan gets at least, however fast the simulator beside it: with less a busy machine finds no path.
LEAST_BUDGET_S = 0.5
# On a slow computer a plan that is not urgent gets more time. The first one, for which she lies still, has so much of
# its budget of the processor itself: of 2 s it takes 4 on a quarter of a core, 10 on a tenth ...
FIRST_SHARE, FIRST_MOST = 0.5, 8.0
# ... and one for a waypoint ahead, which is asked for the earlier the longer the last ones took, 2.3 times as long on a
# quarter of a core (4.6 s of 2).
LONGER_POWER, AHEAD_MOST = 0.6, 3.0
# An order ends so long before the skipper gives it up [s].
EARLY_S = 2.0

_UPLOADS = {
    WireOutcome.OK: UploadResult.OK,
    WireOutcome.REFUSED: UploadResult.REFUSED,
    WireOutcome.UNSUPPORTED: UploadResult.REFUSED,
    WireOutcome.MISMATCH: UploadResult.MISMATCH,
    WireOutcome.LINK: UploadResult.LINK,
}
_COMMANDS = {
    WireOutcome.OK: CommandResult.ACCEPTED,
    WireOutcome.TIMEOUT: CommandResult.TIMEOUT,
    WireOutcome.LINK: CommandResult.TIMEOUT,
}


class Planner(Protocol):
    """Whoever computes plans: a worker process on the boat, the same process under the virtual clock."""

    @property
    def is_alive(self) -> bool:
        """Whether it can take a request."""
        ...

    @property
    def restarts(self) -> int:
        """How often it had to be replaced."""
        ...

    @property
    def share(self) -> float:
        """What it gets of a processor, more than 0 and at most 1, as measured last."""
        ...

    async def plan(
        self,
        problem: Problem,
        *,
        budget_s: float | None = None,
        expansions: int | None = None,
        seed: int = 0,
        algorithm: str = "auto",
        settings: Settings | None = None,
    ) -> Plan:
        """Plan; never raises for a problem, however bad."""
        ...

    def overtake(self) -> None:
        """Let what is being planned end at once: its answer is not wanted."""
        ...


class Executor:
    """The orders under way. ``run`` lives in the voyage's task group."""

    def __init__(
        self,
        autopilot: Autopilot,
        planner: Planner,
        on_outcome: Callable[[Outcome], None],
        *,
        seed: int = 0,
        expansions: int | None = None,
        budget_scale: float = 1.0,
        config: SkipperConfig | None = None,
        on_adopt: Callable[[], None] = lambda: None,
        on_answer: Callable[[Acknowledge], None] = lambda _: None,
    ) -> None:
        self._autopilot, self._planner, self._on_outcome = autopilot, planner, on_outcome
        self._seed, self._expansions, self._budget_scale = seed, expansions, budget_scale
        self._config = config or SkipperConfig()
        self._on_adopt, self._on_answer = on_adopt, on_answer
        self._orders: deque[tuple[float, Action]] = deque()
        self._order_wanted = asyncio.Event()
        self._order: tuple[Action, asyncio.Task[Outcome]] | None = None  # under way
        self._cut_short = ""  # why it was ended
        self._plan: RequestPlan | None = None
        self._plan_wanted = asyncio.Event()

    def submit(self, actions: Sequence[Action]) -> None:
        """Take the actions of one step; never waits."""
        for action in actions:
            if isinstance(action, RequestPlan):
                self._plan = action
                self._planner.overtake()
                self._plan_wanted.set()
            elif isinstance(action, CancelPlan):
                if self._plan is not None and self._plan.request_id == action.request_id:
                    self._plan = None
                    self._planner.overtake()
            elif isinstance(action, SteerHeading):
                self._autopilot.steer_heading(action.heading_rad, thrust=action.thrust)
            elif isinstance(action, Announce):
                self._autopilot.say(int(action.severity), action.text)
            elif isinstance(action, Acknowledge):
                self._on_answer(action)
            elif isinstance(action, StopOrders):
                self._give_up(Action, action.text)
            elif isinstance(action, AdoptDrawing):
                self._on_adopt()
            else:
                self._enqueue(action)

    def _enqueue(self, action: Action) -> None:
        if isinstance(action, UploadMission):
            self._give_up(ReadMission, "an upload has overtaken it")  # what a read would tell is void by it
        if len(self._orders) >= MAX_WAITING:
            self._on_outcome(_gave_up(action, f"{MAX_WAITING} orders are waiting"))
            return
        self._orders.append((now_s() + self._patience_s(action), action))
        self._order_wanted.set()

    def _give_up(self, kind: Any, why: str) -> None:
        """Give up the orders of a kind: those that wait, and the one under way."""
        waiting = [action for _, action in self._orders if isinstance(action, kind)]
        self._orders = deque(order for order in self._orders if order[1] not in waiting)
        for action in waiting:
            self._on_outcome(_gave_up(action, why))
        if self._order is not None and isinstance(self._order[0], kind):
            self._cut_short = why
            self._order[1].cancel()

    def _patience_s(self, action: Action) -> float:
        """Return how long an order may take from being asked for [s]."""
        config = self._config
        if isinstance(action, ReadMission):
            return config.read_timeout_s - EARLY_S
        if isinstance(action, UploadMission | UploadFence):
            return config.upload_timeout_s - EARLY_S
        return config.command_timeout_s - EARLY_S

    async def run(self) -> None:
        """Carry out orders until cancelled."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._run_orders(), name="orders")
            group.create_task(self._run_plans(), name="plans")

    async def _run_plans(self) -> None:
        while True:
            await self._plan_wanted.wait()
            self._plan_wanted.clear()
            request = self._plan
            if request is None:
                continue
            by = request.planner
            plan = await self._planner.plan(
                request.problem,
                budget_s=self._budget_s(request),
                expansions=by.expansions or self._expansions,
                seed=self._seed + request.seed,
                algorithm=by.algorithm,
                settings=by.settings,
            )
            # A request that was cancelled or overtaken while it was computed is answered by the newer one.
            if self._plan is not None and self._plan.request_id == request.request_id:
                self._plan = None
                self._on_outcome(PlanOutcome(request_id=request.request_id, plan=plan, text=plan.reason))

    def _budget_s(self, request: RequestPlan) -> float:
        """Return the real time for a plan [s]: what was asked for, less beside a hurried simulator, never nothing."""
        longer, share = 1.0, self._planner.share
        if request.reason is ReplanReason.START:
            longer = min(FIRST_MOST, max(1.0, FIRST_SHARE / share))
        elif request.reason is ReplanReason.WAYPOINT:
            longer = min(AHEAD_MOST, share**-LONGER_POWER)
        return max(min(request.budget_s, LEAST_BUDGET_S), longer * request.budget_s * self._budget_scale)

    async def _run_orders(self) -> None:
        while True:
            while not self._orders:
                self._order_wanted.clear()
                await self._order_wanted.wait()
            until_s, action = self._orders.popleft()
            if now_s() >= until_s:
                self._on_outcome(_gave_up(action, "waited too long behind other orders"))
                continue
            try:
                async with asyncio.timeout_at(until_s):
                    outcome = await self._finish(action)
            except TimeoutError:
                outcome = _gave_up(action, "took too long")
            self._on_outcome(outcome)

    async def _finish(self, action: Action) -> Outcome:
        """Carry an order out, unless it is given up meanwhile."""
        task = asyncio.create_task(self._carry_out(action), name="order")
        self._order, self._cut_short = (action, task), ""
        try:
            await asyncio.wait({task})
            return _gave_up(action, self._cut_short) if task.cancelled() else task.result()
        finally:
            task.cancel()
            self._order = None

    async def _carry_out(self, action: Action) -> Outcome:
        autopilot = self._autopilot
        if isinstance(action, UploadMission):
            done = await autopilot.upload_mission(
                action.items, keep_first=action.keep_first, set_current=action.set_current, stopgap=action.stopgap
            )
            return UploadOutcome(
                upload_id=action.upload_id,
                result=_UPLOADS.get(done.outcome, UploadResult.TIMEOUT),
                text=_join(done.text, f"{done.method} {done.duration_s:.2f} s"),
            )
        if isinstance(action, UploadFence):
            done = await autopilot.upload_fence(action.items)
            return UploadOutcome(
                upload_id=action.upload_id, result=_UPLOADS.get(done.outcome, UploadResult.TIMEOUT), text=done.text
            )
        if isinstance(action, ReadMission):
            read = await autopilot.read_mission()
            return ReadOutcome(read_id=action.read_id, items=read.items, text=read.text)
        if isinstance(action, SetMode):
            return _command(action.command_id, await autopilot.set_mode(action.mode))
        if isinstance(action, Arm):
            return _command(action.command_id, await autopilot.arm())
        if isinstance(action, Tack):
            return _command(action.command_id, await autopilot.tack())
        if isinstance(action, RunMotor):
            return _command(action.command_id, await autopilot.run_motor(on=action.is_on))
        if isinstance(action, SetCurrent):
            return _command(action.command_id, await autopilot.set_current(action.seq, reset=action.reset))
        if isinstance(action, SetParameter):
            written = await autopilot.set_parameter(action.name, action.value)
            done_by = CommandResult.ACCEPTED if written.is_ok else CommandResult.REFUSED
            return CommandOutcome(command_id=action.command_id, result=done_by, text=written.text)
        raise TypeError(f"nobody carries out {type(action).__name__}")


def _command(command_id: int, answer: CommandAnswer) -> CommandOutcome:
    result = _COMMANDS.get(answer.outcome, CommandResult.REFUSED)
    return CommandOutcome(command_id=command_id, result=result, text=answer.text)


def _gave_up(action: Action, why: str) -> Outcome:
    if isinstance(action, UploadMission | UploadFence):
        return UploadOutcome(upload_id=action.upload_id, result=UploadResult.TIMEOUT, text=why)
    if isinstance(action, ReadMission):
        return ReadOutcome(read_id=action.read_id, text=why)
    if isinstance(action, SetMode | Arm | SetCurrent | SetParameter | RunMotor | Tack):
        return CommandOutcome(command_id=action.command_id, result=CommandResult.TIMEOUT, text=why)
    raise TypeError(f"{type(action).__name__} is no order")


def _join(*texts: str) -> str:
    return "; ".join(t for t in texts if t)

"""The planner's worker: a child process that plans, is watched, and is replaced when it hangs or dies.

Both planners here have one method, ``await plan(problem, ...)``. ``PlannerWorker`` runs ``plan`` in a child, so
the event loop never waits for it; ``InlinePlanner`` runs it at once and lets the loop's clock pass a stated time,
for the virtual clock where there may be no process. Planner trouble is an outcome (``PlanStatus.UNANSWERED``
with the reason), never an exception.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import os
import pickle
import select
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from companion.clock import effort_s, ended
from companion.errors import JobError
from companion.kernels.build import prepare
from companion.kernels.memory import settle, trim
from companion.planner.child import Child, Forked, Started
from companion.planner.fork_server import FORK_SERVER, FORK_SERVER_READY, ForkServer, call_process, load
from companion.planner.plan import Plan, PlanStatus, Why
from companion.planner.problem.value import Problem
from companion.planner.solve import DEFAULT_BUDGET_S, plan
from companion.planners import Settings

_LOG = logging.getLogger(__name__)
_LENGTH = struct.Struct("<Q")
_READY = b"ready"
DEFAULT_GRACE_S = 3.0
"""How much longer than its budget an answer may take [s] before the child is taken for hung. A child that has had no
more than its budget and half of this of the processor, and had some of it in the last such time, is waited for: it is
the computer that is slow."""
REFERENCE_PER_S = 400_000.0
"""Expansions of ``auto`` in a second of the reference core: one of an AMD EPYC server's, on which the figures of the
docs were measured. ``speed`` is held against it."""
STARTS = 3  # of a child that dies while it gets ready, at the beginning of a voyage
SPEED_EXPANSIONS = 5_000
SPEED_TRIES = 3
LEAST_RUN_S = 0.05  # a shorter run does not tell how much of the processor there was
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PULSE_S = 0.5
_LOOK_S = 0.2  # between two looks whether child and fork server live
_REST_S = 10.0  # until the watch tries again to start a child that could not be; a request tries at once
_SILENCE_S = 60.0
"""A child that gets ready may take as long as it takes, and says once in ``_BEAT_S`` that it lives; this long without a
word [s] and it is taken for hung."""
_BEAT_S = 1.0


def speed() -> float:
    """Return how fast this computer's processor plans, as a share of the reference core: its load and quota left aside.

    It takes some 40 ms of that core, kernels loaded.
    """
    from companion.planner.solve import plan as planned
    from companion.planner.solve import warm
    from companion.planner.warm import warm_problems

    warm()
    problem = warm_problems()[1]
    taken = []
    for _ in range(SPEED_TRIES):
        began_s = time.process_time()
        planned(problem, expansions=SPEED_EXPANSIONS)
        taken.append(time.process_time() - began_s)
    return SPEED_EXPANSIONS / max(min(taken), 1e-6) / REFERENCE_PER_S


def failed(reason: str, *, seed: int, algorithm: str, elapsed_s: float = 0.0) -> Plan:
    """Return the plan that says the worker did not answer."""
    return Plan(
        status=PlanStatus.UNANSWERED,
        reason=reason,
        waypoints_en=np.empty((0, 2)),
        algorithm=algorithm,
        seed=seed,
        elapsed_s=elapsed_s,
        why=Why(text=reason),
    )


def _without(reason: str, best: Plan | None, *, seed: int, algorithm: str, elapsed_s: float) -> Plan:
    """Return the answer of a worker that gave no last one: the best that it had handed out before."""
    if best is None:
        return failed(reason, seed=seed, algorithm=algorithm, elapsed_s=elapsed_s)
    return replace(best, reason=f"{best.reason}; {reason}, and this is the best that it had found", elapsed_s=elapsed_s)


class InlinePlanner:
    """Plans in place and then lets ``virtual_s`` of the loop's time pass: deterministic under the virtual clock.

    The budget in seconds is left out where there is an expansion budget: it would tie the plan to the machine.
    """

    def __init__(self, *, virtual_s: float = 1.0, expansions: int = 60_000) -> None:
        self.virtual_s, self.expansions = virtual_s, expansions
        self.is_alive = True
        self.restarts = 0
        self.share = 1.0
        self._under_way: set[asyncio.Future[None]] = set()

    async def __aenter__(self) -> Self:
        """Nothing to start."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing to end."""

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
        """Return the plan of ``expansions`` (or the default number) after ``virtual_s``."""
        del budget_s
        answer = plan(
            problem, expansions=expansions or self.expansions, seed=seed, algorithm=algorithm, settings=settings
        )
        over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._under_way.add(over)
        try:
            await asyncio.wait({over}, timeout=self.virtual_s)
        finally:
            self._under_way.discard(over)
        return answer

    def overtake(self) -> None:
        """Let the plans that are being made be answered at once: their answers are not wanted."""
        for over in self._under_way:
            if not over.done():
                over.set_result(None)


class PlannerWorker:
    """A child process with warm kernels, one request at a time; a second caller waits for the first.

    ``async with PlannerWorker() as planner`` starts the child and returns at once: it warms up while the loop runs
    and the first request waits for it: ``auto`` always, and ``algorithm``. With a ``fork_server`` the child is forked
    there, warm for ``auto`` from the beginning. A child that dies is replaced at once, between two requests too, and
    so is the fork server: on a tenth of a core the next answer would else wait for half a minute's loading.
    ``restarts`` counts replacements of the child; ``share`` is what it got of the processor when it became ready. A
    request that ``overtake`` came after is answered at once, with the best that was found or ``UNANSWERED``.
    """

    def __init__(
        self,
        *,
        grace_s: float = DEFAULT_GRACE_S,
        command: list[str] | None = None,
        algorithm: str = "auto",
        fork_server: ForkServer | None = None,
    ) -> None:
        self._grace_s, self._fork_server = grace_s, fork_server if algorithm == "auto" else None
        self._command = command or [sys.executable, "-m", "companion.planner.worker", algorithm]
        self._child: Child | None = None
        self._is_warm, self._was_warm, self._silence_s = False, False, math.inf
        self._rests_until_s = -math.inf
        self._lock = asyncio.Lock()
        self._overtaken, self._is_asked = 0, False  # how often; whether the child works
        self._watch: asyncio.Task[None] | None = None
        self.restarts = 0
        self.share = 1.0

    @property
    def is_alive(self) -> bool:
        """Is there a child that runs?"""
        return self._child is not None and self._child.is_alive

    @property
    def pid(self) -> int | None:
        """Process id of the child, or None."""
        return self._child.pid if self.is_alive and self._child is not None else None

    async def __aenter__(self) -> Self:
        """Start the child; it warms up by itself."""
        await self._start()
        self._watch = asyncio.create_task(self._keep(), name="planner's watch")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the child."""
        await ended(self._watch)
        await self._stop()

    async def ready(self, say: Callable[[str], None] = lambda _: None) -> None:
        """Wait until the child's kernels are loaded (compiled, the first time on a machine), however long that takes.

        ``say`` is told once a second what it does. A child that dies meanwhile is replaced, ``STARTS`` times in all.

        Raises:
            TimeoutError: it has fallen silent; EOFError or OSError: it died each time.
        """
        async with self._lock:
            for left in reversed(range(STARTS)):
                if not self.is_alive:
                    await self._replace()
                try:
                    await self._warm(say)
                except TimeoutError:
                    raise  # which is an OSError, too
                except (EOFError, OSError) as error:
                    if left == 0:
                        raise
                    _LOG.warning("the planner's worker died while it got ready (%r); it is replaced", error)
                    await self._replace()
                else:
                    return

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
        """Return the child's plan; when it hangs or dies the best it had found, or ``PlanStatus.UNANSWERED``.

        It is then replaced.

        With only an expansion budget there is no limit in seconds to judge a hang by: a minute is allowed.
        """
        if budget_s is None and expansions is None:
            budget_s = DEFAULT_BUDGET_S
        request = pickle.dumps(
            {
                "problem": problem,
                "budget_s": budget_s,
                "expansions": expansions,
                "seed": seed,
                "algorithm": algorithm,
                "settings": settings,
            }
        )
        overtaken = self._overtaken
        async with self._lock:
            began_s = effort_s()
            best: Plan | None = None
            try:
                if not self.is_alive:
                    await self._replace()
                await self._warm()
                began_s = effort_s()
                if overtaken != self._overtaken:
                    return failed("another plan is wanted before it", seed=seed, algorithm=algorithm)
                self._is_asked = True
                await self._send(request)
                deadline_s = effort_s() + (60.0 if budget_s is None else budget_s) + self._grace_s
                is_last = False
                allowed_s = deadline_s - effort_s() - 0.5 * self._grace_s + (self._child_cpu_s() or 0.0)
                while not is_last:
                    answer = await self._alive(deadline_s - effort_s(), allowed_s)
                    is_last, value = pickle.loads(answer)  # noqa: S301 - our own child wrote it
                    best = best if is_last else value
            except (OSError, EOFError, asyncio.IncompleteReadError, TimeoutError) as error:
                hung = isinstance(error, TimeoutError)
                reason = "the planner's worker did not answer in time" if hung else "the planner's worker died"
                if self._child is None:
                    reason = f"the planner's worker cannot be started ({error})"
                    _LOG.warning("%s", reason)
                else:
                    _LOG.warning("%s; it is replaced", reason)
                    await self._try_to_replace()
                return _without(reason, best, seed=seed, algorithm=algorithm, elapsed_s=effort_s() - began_s)
            except asyncio.CancelledError:
                await self._try_to_replace()  # its answer would be taken for that of the next request
                raise
            finally:
                self._is_asked = False
        if isinstance(value, Plan):
            return value
        return _without(
            f"the planner's worker failed: {value}",
            best,
            seed=seed,
            algorithm=algorithm,
            elapsed_s=effort_s() - began_s,
        )

    def overtake(self) -> None:
        """Let the requests that wait, and the one under way, end at once: their answers are not wanted."""
        self._overtaken += 1
        if self._is_asked and self._child is not None:
            self._child.writer.write(_LENGTH.pack(0))

    # ------------------------------------------------------------------------------------ the child
    async def _keep(self) -> None:
        """Replace child and fork server when they die."""
        while True:
            await asyncio.sleep(_LOOK_S)
            try:
                if self._fork_server is not None and self._fork_server.revive():
                    _LOG.warning("the planners' fork server died; it is begun anew")
            except OSError as error:
                _LOG.warning("the planners' fork server died and cannot be begun anew (%s)", error)
            if (
                not self._was_warm or self._lock.locked() or effort_s() < self._rests_until_s
            ):  # whoever gets it ready or has it sees it by himself
                continue
            async with self._lock:
                if not self.is_alive:
                    _LOG.warning("the planner's worker died; it is replaced")
                    if not await self._try_to_replace():
                        continue
                with contextlib.suppress(OSError, EOFError):  # the next request is told of it
                    await self._warm()

    async def _start(self) -> None:
        self._is_warm, self._silence_s = False, math.inf
        if self._fork_server is not None:
            try:
                self._child = await Forked.begin(self._fork_server)
            except JobError as error:
                _LOG.warning("%s; it is started as a program of its own", error)
            else:
                return
        self._child = await Started.begin(self._command)

    async def _warm(self, say: Callable[[str], None] = lambda _: None) -> None:
        """Wait for the child's kernels; it is alive as long as it says so, and until its first word while it runs."""
        while not self._is_warm:
            word = await self._answer(self._silence_s)
            self._silence_s = _SILENCE_S
            self._is_warm = word.startswith(_READY)
            self._was_warm = self._was_warm or self._is_warm
            if self._is_warm:
                self.share = float(word[len(_READY) :])
            else:
                say(word.decode())

    async def _stop(self) -> None:
        child, self._child = self._child, None
        if child is None:
            return
        await child.end()

    async def _replace(self) -> None:
        await self._stop()
        self.restarts += 1
        await self._start()

    async def _try_to_replace(self) -> bool:
        """Replace the child and return whether there is one: without memory or processes the watch tries again."""
        try:
            await self._replace()
        except OSError as error:
            _LOG.warning("the planner's worker cannot be started (%s); again in %g s", error, _REST_S)
            self._rests_until_s = effort_s() + _REST_S
            return False
        return True

    async def _send(self, payload: bytes) -> None:
        assert self._child is not None
        self._child.writer.write(_LENGTH.pack(len(payload)))
        self._child.writer.write(payload)
        await self._child.writer.drain()

    async def _receive(self) -> bytes:
        assert self._child is not None
        head = await self._child.reader.readexactly(_LENGTH.size)
        return await self._child.reader.readexactly(_LENGTH.unpack(head)[0])

    def _child_cpu_s(self) -> float | None:
        """Return what the child has had of the processor [s], None where the system does not tell."""
        try:
            stat = Path(f"/proc/{self.pid}/stat").read_text(encoding="ascii", errors="replace")
            user, system = stat.rpartition(")")[2].split()[11:13]
            return (int(user) + int(system)) / _TICKS_PER_S
        except (OSError, ValueError):
            return None

    async def _alive(self, limit_s: float, allowed_s: float) -> bytes:
        """Return the next message, waited for beyond ``limit_s`` while the child works and has not had ``allowed_s``.

        Raises:
            TimeoutError: it had nothing of the processor for its grace, or all that it was allowed [s].
        """
        task = asyncio.ensure_future(self._receive())
        try:
            while True:
                before_s = self._child_cpu_s()
                try:
                    return await self._answer(limit_s, task)
                except TimeoutError:
                    now_s = self._child_cpu_s()
                    if before_s is None or now_s is None or now_s <= before_s or now_s >= allowed_s:
                        raise
                limit_s = self._grace_s
        finally:
            if not task.done():
                await ended(task)

    async def _answer(self, limit_s: float, awaited: asyncio.Task[bytes] | None = None) -> bytes:
        """Return the next message; ``TimeoutError`` after ``limit_s`` of computing time (the loop may be scaled).

        It is that which is ``awaited`` already, and goes on being; else the next.
        """
        task = awaited or asyncio.ensure_future(self._receive())
        deadline_s = effort_s() + limit_s
        try:
            while True:  # looked for before the clock: this process may have been kept waiting, too
                await asyncio.wait({task}, timeout=_PULSE_S)
                if task.done():
                    return task.result()
                if effort_s() >= deadline_s:
                    raise TimeoutError
        finally:
            if awaited is None and not task.done():
                await ended(task)


# ------------------------------------------------------------------------------------- in the child
def serve(algorithm: str = "auto") -> None:
    """Get warm for ``auto`` and ``algorithm``, then answer requests on standard input: the child's main."""
    source = sys.stdin.buffer
    sink = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints must not break the frames
    call_process("planner")
    with contextlib.suppress(OSError):
        os.nice(5)

    from companion.planner.solve import warm

    with _Pulse(sink) as pulse:
        prepare(("companion",), say=pulse.say)
        warm()
        pulse.say(f"loading the kernels of {algorithm}")
        warm(algorithm)
    answer_requests(source, sink)


def answer_requests(source: Any, sink: Any) -> None:
    """Answer requests on a stream of bytes until it closes, all being loaded.

    An answer is whether it is the last, and a plan or what failed; plans that can be sailed come before it as they are
    found. What comes while a plan is being made ends it: a request of no length is for nothing else.
    """
    fd = source.fileno()  # read with nothing between: what waits in a buffer would not be seen
    began_s, cpu_s = effort_s(), time.process_time()
    own_speed = speed()
    _write(sink, _READY + f"{_share_since(began_s, cpu_s):.3f}".encode())
    while True:
        head = _exactly(fd, _LENGTH.size)
        if len(head) < _LENGTH.size:
            return
        length = _LENGTH.unpack(head)[0]
        if length == 0:
            continue
        request: dict[str, Any] = pickle.loads(_exactly(fd, length))  # noqa: S301 - our parent's
        began_s, cpu_s = effort_s(), time.process_time()
        answer: Plan | str
        try:
            found = plan(
                request.pop("problem"),
                **request,
                on_better=lambda found: _write(sink, pickle.dumps((False, found))),
                is_wanted=lambda: not select.select((fd,), (), (), 0.0)[0],
            )
            answer = replace(found, speed=own_speed * _share_since(began_s, cpu_s))
        except Exception as error:
            answer = f"{type(error).__name__}: {error}"
        _write(sink, pickle.dumps((True, answer)))
        del request, answer
        trim()  # the next plan may be an hour away


def _exactly(fd: int, size: int) -> bytes:
    """Return so many bytes; fewer: the stream has ended."""
    data = bytearray()
    while len(data) < size:
        part = os.read(fd, size - len(data))
        if not part:
            break
        data += part
    return bytes(data)


def _share_since(began_s: float, cpu_s: float) -> float:
    """Return what this process has had of a processor since the stopwatch and its own clock told these [s], 0 to 1."""
    taken_s = effort_s() - began_s
    return min(1.0, max(0.001, (time.process_time() - cpu_s) / taken_s)) if taken_s >= LEAST_RUN_S else 1.0


class _Pulse:
    """Tells the parent once a second what is being done, from a thread: compiling holds the others up."""

    def __init__(self, sink: Any) -> None:
        self._sink = sink
        self._doing = "loading kernels"
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="pulse", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *unused: object) -> None:
        self._is_over.set()
        self._thread.join()

    def say(self, text: str) -> None:
        """Tell this from now on."""
        self._doing = text

    def _run(self) -> None:
        while True:
            try:
                _write(self._sink, self._doing.encode())
            except OSError:
                os._exit(1)  # nobody waits for the kernels any more
            if self._is_over.wait(_BEAT_S):
                return


def _write(sink: Any, payload: bytes) -> None:
    sink.write(_LENGTH.pack(len(payload)))
    sink.write(payload)
    sink.flush()


def be_fork_server(fd: int) -> None:
    """Be a fork server on the socket ``fd``, in a program of its own."""
    control = socket.socket(fileno=fd)
    load()
    settle()
    with contextlib.suppress(OSError):  # who began it has gone: the fork server sees it, and ends
        control.sendall(FORK_SERVER_READY)
    ForkServer(control, answer_requests).tend()


if __name__ == "__main__":
    if sys.argv[1:2] == [FORK_SERVER]:
        be_fork_server(int(sys.argv[2]))
    else:
        serve(*sys.argv[1:2])

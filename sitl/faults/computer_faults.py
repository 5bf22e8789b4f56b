"""Faults of the companion's computer: a planner process that dies, hangs or starves, and a disk that fails."""

from __future__ import annotations

import asyncio
import errno
import math
import os
import resource
import signal
from collections import deque
from pathlib import Path
from typing import Final

from companion.clock import now_s
from companion.disk import Disk, Room
from companion.planner import Plan, Problem
from companion.planner.worker import DEFAULT_GRACE_S, InlinePlanner, PlannerWorker, failed
from companion.planners import Settings
from companion.telemetry.folder import STATE

START_S = 1.5  # what it takes to start another worker


class FaultyPlanner(InlinePlanner):
    """It dies and is replaced, hangs, and runs out of memory, when told to."""

    def __init__(self) -> None:
        super().__init__()
        self._hangs_until_s = -math.inf
        self._deaths = 0
        self._is_starved = False

    def die(self) -> None:
        """Kill it, in the middle of whatever it computes."""
        self.is_alive = False
        self._deaths += 1

    def hang(self, until_s: float) -> None:
        """Answer nothing until ``until_s``."""
        self._hangs_until_s = until_s

    def starve(self) -> None:
        """Let the next plan fail for want of memory."""
        self._is_starved = True

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
        """Plan as the worker would: a dead one is replaced first, a hung one when its time is over."""
        if not self.is_alive:
            await asyncio.sleep(START_S)
            self.is_alive, self.restarts = True, self.restarts + 1
        if now_s() < self._hangs_until_s:
            await asyncio.sleep((budget_s or 0.0) + DEFAULT_GRACE_S)
            self.restarts += 1
            return failed("the planner's worker did not answer in time", seed=seed, algorithm=algorithm)
        if self._is_starved:
            self._is_starved = False
            return failed("the planner's worker failed: MemoryError()", seed=seed, algorithm=algorithm)
        deaths = self._deaths
        answer = await super().plan(
            problem, budget_s=budget_s, expansions=expansions, seed=seed, algorithm=algorithm, settings=settings
        )
        if deaths != self._deaths:
            return failed("the planner's worker died", seed=seed, algorithm=algorithm)
        return answer


class KillablePlanner(PlannerWorker):
    """The real worker process, killed, stopped and kept from more memory by signals and limits."""

    def __init__(self) -> None:
        super().__init__()
        self.fates: list[str] = []  # that befell a living process, for who counts them

    def die(self) -> None:
        """SIGKILL, as the kernel's out-of-memory killer sends it too."""
        self._signal(signal.SIGKILL)

    def hang(self, until_s: float) -> None:
        """SIGSTOP; SIGCONT at ``until_s`` to what is left of it."""
        self._signal(signal.SIGSTOP)
        if self.pid is not None and until_s < math.inf:
            asyncio.get_running_loop().call_at(until_s, self._signal, signal.SIGCONT, self.pid)

    def starve(self) -> None:
        """Forbid its address space to grow."""
        if self.pid is not None:
            pages = int(Path(f"/proc/{self.pid}/statm").read_text(encoding="ascii").split()[0])
            resource.prlimit(self.pid, resource.RLIMIT_AS, (pages * resource.getpagesize(),) * 2)
            self.fates.append("starved")

    def _signal(self, number: signal.Signals, pid: int | None = None) -> None:
        if self.pid is not None and pid in {None, self.pid}:
            os.kill(self.pid, number)
            self.fates.append(number.name)


STATES: Final = {"full": errno.ENOSPC, "sick": errno.EIO, "read_only": errno.EROFS, "ok": 0}
KEPT = 600  # earlier contents of the saved state, which changes once a second at most


class FaultyDisk(Disk):
    """A disk that is well until ``become``. What is there can always be read."""

    def __init__(self) -> None:
        self._errno = 0
        self._states: deque[tuple[float, bytes]] = deque(maxlen=KEPT)

    def become(self, state: str) -> None:
        """Be "full", "sick", "read_only" or "ok" from now on."""
        self._errno = STATES[state]

    def _fail(self) -> None:
        if self._errno:
            raise OSError(self._errno, os.strerror(self._errno))

    def make_folder(self, path: Path) -> None:
        """Make a folder, where there is none yet."""
        if not path.is_dir():
            self._fail()
        super().make_folder(path)

    def open_to_append(self, path: Path) -> int:
        """Open a file; on a full disk too."""
        if self._errno != errno.ENOSPC:
            self._fail()
        return super().open_to_append(path)

    def create(self, path: Path) -> int:
        """Open a new file; on a full disk too, where it is nothing but a name."""
        if self._errno != errno.ENOSPC:
            self._fail()
        return super().create(path)

    def write(self, fd: int, data: bytes) -> int:
        """Write, unless there is something wrong."""
        self._fail()
        return super().write(fd, data)

    def sync(self, fd: int) -> None:
        """Sync; only a sick disk says that it could not."""
        if self._errno == errno.EIO:
            self._fail()
        super().sync(fd)

    def rename(self, source: Path, target: Path) -> None:
        """Rename, where names can be changed."""
        if self._errno in {errno.EIO, errno.EROFS}:
            self._fail()
        super().rename(source, target)
        if target.name == STATE:
            self._states.append((now_s(), target.read_bytes()))

    def spoil(self, path: Path, how: str, aged_s: float) -> None:
        """Lose or tear a saved state, or put back what it was ``aged_s`` ago; one that there is not stays so."""
        if how == "lost":
            path.unlink(missing_ok=True)
        elif how == "torn" and path.is_file():
            content = path.read_bytes()
            path.write_bytes(content[: len(content) // 2])
        elif how == "old" and self._states:
            before = [content for t_s, content in self._states if t_s <= now_s() - aged_s]
            path.write_bytes(before[-1] if before else self._states[0][1])

    def room(self, folder: Path) -> Room:
        """Return what is left: nothing on a full disk."""
        room = super().room(folder)
        return Room(free_bytes=0, reserve_bytes=room.reserve_bytes) if self._errno == errno.ENOSPC else room

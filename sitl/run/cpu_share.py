"""A slow computer: a program and its children under a share of one processor core.

By the kernel's own quota where that may be set (cgroup version 2 or 1, as root or in a folder that was handed to the
user), else by stopping and continuing the processes in turn (SIGSTOP, SIGCONT), in slices of a tenth of a second. The
quota is the better likeness: it counts what is really used, and stops nobody who is idle.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

PERIOD_S = 0.1
CGROUPS = Path("/sys/fs/cgroup")


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
    """Make a share of a core, and take it away when all that was put under it has ended."""
    folder = _quota(share)
    try:
        yield CpuShare(share=share, cgroup=folder)
    finally:
        if folder is not None:
            with contextlib.suppress(OSError):
                folder.rmdir()


def _quota(share: float) -> Path | None:
    """Return a new control group with the share as its quota, None where none may be made."""
    period_us = int(PERIOD_S * 1e6)
    quota_us = max(1000, int(share * period_us))
    for parent, settings in (
        (CGROUPS / "cpu", {"cpu.cfs_period_us": f"{period_us}", "cpu.cfs_quota_us": f"{quota_us}"}),
        (CGROUPS, {"cpu.max": f"{quota_us} {period_us}"}),
    ):
        folder = parent / f"sitl-share-{os.getpid()}"
        with contextlib.suppress(OSError):
            folder.mkdir()
            try:
                for name, value in settings.items():
                    if not (folder / name).exists():
                        raise FileNotFoundError(name)
                    (folder / name).write_text(value)
            except OSError:
                folder.rmdir()
                raise
            return folder
    return None

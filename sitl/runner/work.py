"""A job as a worker does it, in whichever process: fit for it, with room for it, its result in one way of writing."""

from __future__ import annotations

import json
import os
import platform
import resource
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.disk import Disk
from companion.errors import JobError
from sitl.runner.cargo import Cargo, localised
from sitl.runner.identity import MadeBy, made_by, processor


class UnfitError(JobError):
    """A worker that would give other results, or that does not keep voyages apart."""


class RaisedError(JobError):
    """What a job raised, in words: the exception itself may not find its way from one process to another."""


class NoRoomError(JobError):
    """A worker's disk is full: what would be sailed now says more of the disk than of the boat."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One job. ``by`` and ``cargoes`` are for a worker elsewhere."""

    work: Callable[[Any], Any]
    job: Any
    by: MadeBy | None = None
    cargoes: Mapping[Path, Cargo] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """What came of a task: the result, and apart from it what it took."""

    result: dict[str, Any]
    facts: dict[str, Any]


def perform(task: Task) -> Done:
    """Do a task.

    Raises:
        UnfitError: this process must not do it, nor any other of its program.
        NoRoomError: the disk is full.
        RaisedError: the work raised something.
    """
    if task.by is not None:
        require_fit(task.by)
    _require_room()
    began_s, worked_s = time.perf_counter(), time.process_time()
    try:
        result = task.work(localised(task.job, task.cargoes or {}))
    except Exception as error:
        _require_room()
        raise RaisedError(f"{type(error).__name__}: {error}") from None
    spent = {"wall_s": time.perf_counter() - began_s, "cpu_s": time.process_time() - worked_s}
    _require_room()   # the voyage may have met the end of the disk
    return Done(result=json.loads(json.dumps(result)), facts={
        "host": platform.node(), "pid": os.getpid(), "processor": processor(), **spent, "at": time.time(),
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0})


def require_fit(by: MadeBy) -> None:
    """Raise UnfitError unless this process is the same program as ``by``."""
    unlike = by.unlike(made_by())
    if unlike:
        raise UnfitError(f"a worker on {platform.node()} runs another version ({unlike}); install the same there")


def _require_room() -> None:
    scratch = Path(tempfile.gettempdir())
    room = Disk().room(scratch)
    if room.is_short:
        raise NoRoomError(f"{platform.node()}: {scratch}: {room.free_bytes >> 20} MB are left, too few for a voyage; "
                          "make room, and the same command goes on")

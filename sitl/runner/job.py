"""A job as a worker does it, in whichever process or machine: with its files, fit for it, with room for it.

What comes with the program is there already and only named; everything else is packed. The hash of the content tells
one water from another whose files have the same names.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import json
import os
import platform
import resource
import shutil
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec

from companion.disk import Disk
from companion.errors import InputError, JobError
from sitl.runner.result_store import ROOTS, Key, KeyValue, MadeBy, made_by, processor

SCENARIO_FOLDER = ROOTS[1] / "scenarios"
CaseT = TypeVar("CaseT")


@dataclass(frozen=True, slots=True, kw_only=True)
class Job(Generic[CaseT]):
    """One job of an experiment: a voyage of the scenario in a file, with a seed.

    ``case`` is what the experiment varies beside them. The voyage's folder stays in ``keep``.
    """

    seed: int
    case: CaseT
    scenario: Path = Path()  # none where the case is all
    keep: Path | None = None

    @contextlib.contextmanager
    def folder(self) -> Iterator[Path]:
        """Give the voyage's folder: ``keep``, or one that goes with the block.

        Raises:
            InputError: there is something in ``keep``.
        """
        if self.keep is None:
            with tempfile.TemporaryDirectory(prefix="voyage-") as scratch:
                yield Path(scratch) / "voyage"
            return
        if self.keep.is_dir() and any(self.keep.iterdir()):
            raise InputError(
                "--keep", str(self.keep), "is not empty", "a voyage's folder is taken up where it was left"
            )
        yield self.keep

    def key(self, **case: KeyValue) -> Key:
        """Return what a job is known by among results, with what it has of its own in ``case``."""
        from sitl.scenario import load_scenario

        return {
            "scenario": load_scenario(self.scenario).name,
            "hash": file_hash(self.scenario),
            **case,
            "seed": self.seed,
        }


def files_of(path: Path) -> dict[str, Path]:
    """Return the files of a scenario by what they are called in it; it itself is ``""``, its mission ``mission``."""
    from companion.geofence import load_mission  # late: a worker that begins has no use for them yet
    from sitl.scenario import load_scenario

    scenario = load_scenario(path)
    mission_path = scenario.mission_path(path)
    found = {"": path, "mission": mission_path}
    for base, plain in (
        (path, msgspec.to_builtins(scenario)),
        (mission_path, msgspec.to_builtins(load_mission(mission_path).options)),
    ):
        for word in _words(plain):
            file = base.parent / word
            if len(word) < 256 and "\n" not in word and "\0" not in word and file.is_file():
                found.setdefault(word, file)
    return found


def _words(plain: Any) -> Iterator[str]:
    if isinstance(plain, str) and plain:
        yield plain
    elif isinstance(plain, Mapping):
        for value in plain.values():
            yield from _words(value)
    elif isinstance(plain, list | tuple):
        for value in plain:
            yield from _words(value)


def file_hash(path: Path) -> str:
    """Return the hash of a scenario's content and of every file that it names, wherever they lie.

    It is taken once in a process.
    """
    return _file_hash(path.resolve())  # a relative name is another file in another folder


@cache
def _file_hash(path: Path) -> str:
    digest = hashlib.sha256()
    for file in sorted(file.read_bytes() for file in files_of(path).values()):
        digest.update(hashlib.sha256(file).digest())
    return digest.hexdigest()[:12]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioBundle:
    """A scenario to be sailed elsewhere: ``main`` among ``packed`` files, or among those of the program."""

    main: str
    hash: str
    packed: tuple[tuple[str, bytes], ...] = ()

    @classmethod
    def of(cls, path: Path) -> ScenarioBundle:
        """Pack a scenario.

        Raises:
            InputError: it names a file in a way that only this machine understands.
        """
        where = path.resolve()
        if where.is_relative_to(SCENARIO_FOLDER):
            return cls(main=where.relative_to(SCENARIO_FOLDER).as_posix(), hash=file_hash(path))
        files = {file.resolve() for file in files_of(path).values()}
        root = Path(os.path.commonpath([file.parent for file in files]))
        bundle = cls(
            main=where.relative_to(root).as_posix(),
            hash=file_hash(path),
            packed=tuple(
                sorted((file.relative_to(root).as_posix(), zlib.compress(file.read_bytes())) for file in files)
            ),
        )
        with tempfile.TemporaryDirectory(prefix="scenario-") as trial:
            try:
                is_whole = _file_hash.__wrapped__(bundle.unpack(Path(trial))) == bundle.hash
                is_own = all(
                    file.resolve().is_relative_to(Path(trial).resolve())
                    or any(file.resolve().is_relative_to(ours.parent) for ours in ROOTS)
                    for file in files_of(Path(trial) / bundle.main).values()
                )
            except InputError:
                is_whole = is_own = False
        if not (is_whole and is_own):
            raise InputError(
                str(path),
                "",
                "names a file that another machine will not find",
                "name files relative to the file that names them",
            )
        return bundle

    def unpack(self, folder: Path) -> Path:
        """Write the files below ``folder``; return the scenario's."""
        for name, data in self.packed:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(zlib.decompress(data))
        return folder / self.main

    def here(self) -> Path:
        """Return the scenario on this machine, its files put there once in a process; JobError where it is another."""
        return _here(self)


@cache
def _here(bundle: ScenarioBundle) -> Path:
    if not bundle.packed:
        path = SCENARIO_FOLDER / bundle.main
        if not path.is_file() or file_hash(path) != bundle.hash:
            raise JobError(f"the program there has another {bundle.main}; install the same version there")
        return path
    folder = tempfile.mkdtemp(prefix="scenario-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return bundle.unpack(Path(folder))


class UnfitError(JobError):
    """A worker that would give other results, or that does not keep voyages apart."""


class RaisedError(JobError):
    """What a job raised, in words: the exception itself may not find its way from one process to another."""


class NoRoomError(JobError):
    """A worker's disk is full: what would be sailed now says more of the disk than of the boat."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One job. ``by`` and ``bundle``, its scenario, are for a worker elsewhere."""

    work: Callable[[Job[Any]], Any]
    job: Job[Any]
    by: MadeBy | None = None
    bundle: ScenarioBundle | None = None


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
        job = task.job if task.bundle is None else replace(task.job, scenario=task.bundle.here())
        result = task.work(job)
    except Exception as error:
        _require_room()
        raise RaisedError(f"{type(error).__name__}: {error}") from None
    spent = {"wall_s": time.perf_counter() - began_s, "cpu_s": time.process_time() - worked_s}
    _require_room()  # the voyage may have met the end of the disk
    return Done(
        result=json.loads(json.dumps(result)),
        facts={
            "host": platform.node(),
            "pid": os.getpid(),
            "processor": processor(),
            **spent,
            "at": time.time(),
            "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        },
    )


def require_fit(by: MadeBy) -> None:
    """Raise UnfitError unless this process is the same program as ``by``."""
    unlike = by.unlike(made_by())
    if unlike:
        raise UnfitError(f"a worker on {platform.node()} runs another version ({unlike}); install the same there")


def _require_room() -> None:
    scratch = Path(tempfile.gettempdir())
    room = Disk().room(scratch)
    if room.is_short:
        raise NoRoomError(
            f"{platform.node()}: {scratch}: {room.free_bytes >> 20} MB are left, too few for a voyage; "
            "make room, and the same command goes on"
        )

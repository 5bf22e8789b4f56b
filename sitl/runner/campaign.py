"""Sailing a campaign: its jobs given to whoever does them, each result kept as it comes, and what could not be had."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from companion.errors import JobError
from companion.telemetry.console import StatusLine
from companion.words import counted
from sitl.options import CampaignOptions
from sitl.runner.executors import LOCAL, settled, settled_on
from sitl.runner.job import Done, NoRoomError, ScenarioBundle, Task, UnfitError, perform
from sitl.runner.result_store import Key, ResultStore, StoredResults, made_by, processor, table_of, text_of, write_table

JobT = TypeVar("JobT")
# Sees what there is of each job, in their order (None: nothing yet, {}: lost), when a run begins and after each result.
# Returns what is known so far, in words, and whether that is enough.
Watch = Callable[[Sequence[dict[str, Any] | None]], tuple[str, bool]]
TOLD = 10             # of the jobs that were lost
LOG_EVERY_S = 30.0    # a line of how far it is, where that is no terminal


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignResults:
    """The results that there are, in the order of the jobs; what was lost and why; what the sailing now took."""

    records: list[dict[str, Any]]
    held: StoredResults
    lost: list[tuple[str, str]]
    now: int
    wall_s: float
    cpu_s: float

    @property
    def took(self) -> str:
        """What it took, in words; nothing was sailed now: "", of which the rest was held."""
        if not self.now:
            return f"{counted(len(self.records), 'voyage')}, all of them in the file before"
        return (f"{counted(self.now, 'voyage')} in {self.wall_s:.0f} s, {self.cpu_s / self.now:.2f} CPU s each"
                + (f"; {len(self.records) - self.now} in the file before" if len(self.records) > self.now else ""))

    def exit_code(self, *, is_good: bool) -> int:
        """Say what was lost; return 0 where nothing was and all else is good."""
        for key, why in self.lost[:TOLD]:
            sys.stdout.write(f"LOST {key}: {why[:300]}\n")
        if self.lost:
            sys.stdout.write(f"{counted(len(self.lost), 'job')} without a result: the same command tries them again\n")
        return 0 if is_good and not self.lost else 1


def run_jobs(
    campaign: str, work: Callable[[JobT], dict[str, Any]], jobs: Sequence[JobT], means: CampaignOptions, *,
    key: Callable[[JobT], Key], on_record: Callable[[dict[str, Any]], None] | None = None,
    is_failed: Callable[[dict[str, Any]], bool] = lambda record: not record.get("passed", True),
    watch: Watch | None = None,
) -> CampaignResults:
    """Have every job of this part done that has no result yet, and return all results.

    ``work`` is a function of a module and gives what JSON can hold; ``key`` says what a job is known by. ``on_record``
    sees each new result as it comes; ``watch`` may end the run when it has seen enough. SIGTERM ends it as Ctrl-C does.

    Raises:
        InputError: the file of results is another campaign's or program's.
        JobError: the disk is full, no cluster answers, workers are another program or die at once. What was done is
            in the file.
    """
    if means.table is not None:
        import_module("pyarrow")   # missed now, and not when all is sailed
    mine = means.part(jobs)
    names = [text_of(key(job)) for job in mine]
    began_s, cpu_s, now, lost = time.monotonic(), 0.0, 0, []
    with contextlib.ExitStack() as stack:
        stack.enter_context(_ends_when_told())
        ledger = None if means.file is None else stack.enter_context(ResultStore(means.file, campaign))
        held = StoredResults(campaign=campaign, by=made_by()) if ledger is None else ledger.held
        there = [held.results.get(name) for name in names]
        words, is_enough = watch(there) if watch is not None else ("", False)
        left = {} if is_enough else {n: job for n, job in enumerate(mine) if there[n] is None}
        progress = _Progress(len(left))
        for n, done in stack.enter_context(contextlib.closing(_settled(work, left, means, progress.stay))):
            if isinstance(done, UnfitError | NoRoomError):
                kept = f"; {means.file} holds {len(held.results)} results" if means.file is not None else ""
                raise JobError(f"{done}{kept}") from done
            if isinstance(done, Exception):
                lost.append((names[n], str(done)))
                there[n] = {}
                progress.add(is_failed=True)
                continue
            cpu_s += done.facts["cpu_s"]
            progress.processor(done.facts)
            if ledger is None:
                held.results[names[n]] = done.result
            else:
                ledger.add(names[n], done.result, done.facts)
            now, there[n] = now + 1, done.result
            if on_record is not None:
                progress.give_way()
                on_record(done.result)
            if watch is not None:
                words, is_enough = watch(there)
            progress.add(is_failed=is_failed(done.result), words=words)
            if is_enough:
                break
        progress.end()
    if means.table is not None:
        write_table(table_of(held), means.table)
    return CampaignResults(
        records=[held.results[name] for name in names if name in held.results], held=held, lost=lost,
        now=now, wall_s=time.monotonic() - began_s, cpu_s=cpu_s)


@contextlib.contextmanager
def _ends_when_told() -> Iterator[None]:
    """Take SIGTERM, by which a queue ends what it began, for Ctrl-C: workers are ended, and nothing is left behind."""
    if threading.current_thread() is not threading.main_thread():   # where no signal comes
        yield
        return

    def end(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _settled(
    work: Callable[[JobT], Any], jobs: Mapping[int, JobT], means: CampaignOptions, say: Callable[[str], None],
) -> Generator[tuple[int, Done | Exception], None, None]:
    """Yield jobs' numbers and what came of them, by the means."""
    if not jobs:
        return
    if means.dask is None:
        numbers = list(jobs)
        tasks = [Task(work=work, job=job) for job in jobs.values()]
        with contextlib.closing(settled(perform, tasks, means.workers)) as found:
            for n, done in found:
                yield numbers[n], done
        return
    paths = set() if means.dask == LOCAL else {path for job in jobs.values() for path in _scenarios(job)}
    cargoes = {path: ScenarioBundle.of(path) for path in paths}
    tasks_on = {n: Task(work=work, job=job, by=made_by(), cargoes={
        path: cargoes[path] for path in _scenarios(job) if path in cargoes}) for n, job in jobs.items()}
    yield from settled_on(means.dask, perform, tasks_on, means.workers, say=say)


def _scenarios(job: Any) -> list[Path]:
    """Return the scenarios that a job names."""
    if not is_dataclass(job):
        return []
    values = [getattr(job, f.name) for f in fields(job)]
    return [v for v in values if isinstance(v, Path) and v.suffix == ".toml" and v.is_file()]


class _Progress(StatusLine):
    """How many are sailed, and how long the others take."""

    def __init__(self, of: int) -> None:
        super().__init__(sys.stderr, LOG_EVERY_S)
        self._of, self._done, self._failed = of, 0, 0
        self._began_s = time.monotonic()
        self._strange: set[str] = set()

    def processor(self, facts: Mapping[str, Any]) -> None:
        """Say once of a host that its processor is of another kind."""
        if facts["processor"] != processor() and facts["host"] not in self._strange:
            self._strange.add(facts["host"])
            self.stay(f"{facts['host']} has a processor of another kind: the last bit of a figure may be another there")

    def add(self, *, is_failed: bool, words: str = "") -> None:
        """Count one; ``words`` is what is known so far, of a run that may end before all are done."""
        self._done += 1
        self._failed += is_failed
        left_s = (time.monotonic() - self._began_s) / self._done * (self._of - self._done)
        line = f"{self._done}/{self._of} sailed, {self._failed} failed, {left_s:.0f} s left"
        self.show(f"{self._done} sailed, {self._of - self._done} at most to come; {words}" if words else line)

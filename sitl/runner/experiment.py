"""An experiment: jobs given to whoever does them, each result kept as it comes, and what is told of them all."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Generic

from companion.errors import JobError
from companion.telemetry.console import StatusLine
from companion.words import counted
from sitl.options import CampaignOptions
from sitl.runner.executors import LOCAL, settled, settled_on
from sitl.runner.job import CaseT, Done, Job, NoRoomError, ScenarioBundle, Task, UnfitError, perform
from sitl.runner.result_store import Key, ResultStore, StoredResults, made_by, processor, table_of, text_of, write_table

# Sees what there is of each job, in their order (None: nothing yet, {}: lost), when a run begins and after each result.
# Returns what is known so far, in words, and whether that is enough.
Watch = Callable[[Sequence[dict[str, Any] | None]], tuple[str, bool]]
TOLD = 10  # of the jobs that were lost
LOG_EVERY_S = 30.0  # a line of how far it is, where that is no terminal


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
        return f"{counted(self.now, 'voyage')} in {self.wall_s:.0f} s, {self.cpu_s / self.now:.2f} CPU s each" + (
            f"; {len(self.records) - self.now} in the file before" if len(self.records) > self.now else ""
        )

    def exit_code(self, *, is_good: bool) -> int:
        """Say what was lost; return 0 where nothing was and all else is good."""
        for key, why in self.lost[:TOLD]:
            sys.stdout.write(f"LOST {key}: {why[:300]}\n")
        if self.lost:
            sys.stdout.write(f"{counted(len(self.lost), 'job')} without a result: the same command tries them again\n")
        return 0 if is_good and not self.lost else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentSummary:
    """What is told of an experiment: lines to print, figures for JSON, whether all is as it must be."""

    lines: Sequence[str]
    figures: Any = None
    is_good: bool = True


def _is_failed(record: Mapping[str, Any]) -> bool:
    return not record.get("passed", True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment(Generic[CaseT]):
    """What is sailed, how, what its results are known by and how they are summed up.

    ``name`` marks its file of results. ``sail``, a function of a module, does a job in whichever process or machine and
    returns what JSON can hold. ``key`` says what a job is known by in that file. ``line`` is what is printed of a new
    result as it comes; None: nothing.
    """

    name: str
    jobs: Sequence[Job[CaseT]]
    sail: Callable[[Job[CaseT]], dict[str, Any]]
    key: Callable[[Job[CaseT]], Key]
    sum_up: Callable[[CampaignResults], ExperimentSummary] = lambda _: ExperimentSummary(lines=())
    line: Callable[[dict[str, Any]], str | None] = lambda _: None
    is_failed: Callable[[dict[str, Any]], bool] = _is_failed

    def run(self, options: CampaignOptions, json_path: Path | None = None) -> int:
        """Sail what has no result yet, print what came of it, write the figures; return the exit code.

        Raises:
            InputError, JobError: as of ``results``.
        """
        sailed = self.results(options)
        summary = self.sum_up(sailed)
        for line in summary.lines:
            print(line)
        if json_path is not None:
            json_path.write_text(json.dumps(summary.figures, indent=1) + "\n", encoding="utf-8")
        return sailed.exit_code(is_good=summary.is_good)

    def results(self, options: CampaignOptions, *, watch: Watch | None = None) -> CampaignResults:
        """Have every job of this part done that has no result yet, and return all results.

        ``watch`` may end the run when it has seen enough. SIGTERM ends it as Ctrl-C does.

        Raises:
            InputError: the file of results is another campaign's or program's.
            JobError: the disk is full, no cluster answers, workers are another program or die at once. What was done
                is in the file.
        """
        if options.table is not None:
            import_module("pyarrow")  # missed now, and not when all is sailed
        mine = options.part(self.jobs)
        names = [text_of(self.key(job)) for job in mine]
        began_s, cpu_s, now, lost = time.monotonic(), 0.0, 0, []
        with contextlib.ExitStack() as stack:
            stack.enter_context(ends_when_told())
            store = None if options.file is None else stack.enter_context(ResultStore(options.file, self.name))
            held = StoredResults(campaign=self.name, by=made_by()) if store is None else store.held
            there = [held.results.get(name) for name in names]
            words, is_enough = watch(there) if watch is not None else ("", False)
            left = {} if is_enough else {n: job for n, job in enumerate(mine) if there[n] is None}
            progress = _Progress(len(left))
            for n, done in stack.enter_context(contextlib.closing(_settled(self.sail, left, options, progress.stay))):
                if isinstance(done, UnfitError | NoRoomError):
                    kept = f"; {options.file} holds {len(held.results)} results" if options.file is not None else ""
                    raise JobError(f"{done}{kept}") from done
                if isinstance(done, Exception):
                    lost.append((names[n], str(done)))
                    there[n] = {}
                    progress.add(is_failed=True)
                    continue
                cpu_s += done.facts["cpu_s"]
                progress.processor(done.facts)
                if store is None:
                    held.results[names[n]] = done.result
                else:
                    store.add(names[n], done.result, done.facts)
                now, there[n] = now + 1, done.result
                line = self.line(done.result)
                if line is not None:
                    progress.give_way()
                    print(line, flush=True)
                if watch is not None:
                    words, is_enough = watch(there)
                progress.add(is_failed=self.is_failed(done.result), words=words)
                if is_enough:
                    break
            progress.end()
        if options.table is not None:
            write_table(table_of(held), options.table)
        return CampaignResults(
            records=[held.results[name] for name in names if name in held.results],
            held=held,
            lost=lost,
            now=now,
            wall_s=time.monotonic() - began_s,
            cpu_s=cpu_s,
        )


def sail_kept(sail: Callable[[Job[CaseT]], dict[str, Any]], job: Job[CaseT]) -> int:
    """Sail a job whose folder is kept, and print what came of it; return the exit code."""
    record = sail(job)
    for name, value in record.items():
        print(f"{name}: {json.dumps(value)}")
    return 0 if record["passed"] else 1


@contextlib.contextmanager
def ends_when_told() -> Iterator[None]:
    """Take SIGTERM, by which a queue ends what it began, for Ctrl-C: workers are ended, and nothing is left behind.

    A shell begins what it runs in the background with SIGINT ignored, and then nothing would come of it.
    """
    if threading.current_thread() is not threading.main_thread():  # where no signal comes
        yield
        return

    def end(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)  # which a running loop takes between its steps, and ends its tasks

    before = signal.signal(signal.SIGTERM, end), signal.getsignal(signal.SIGINT)
    if before[1] is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before[0])
        signal.signal(signal.SIGINT, before[1])


def _settled(
    work: Callable[[Job[CaseT]], Any],
    jobs: Mapping[int, Job[CaseT]],
    options: CampaignOptions,
    say: Callable[[str], None],
) -> Generator[tuple[int, Done | Exception], None, None]:
    """Yield jobs' numbers and what came of them, by the options' executor."""
    if not jobs:
        return
    if options.dask is None:
        numbers = list(jobs)
        tasks = [Task(work=work, job=job) for job in jobs.values()]
        with contextlib.closing(settled(perform, tasks, options.workers)) as found:
            for n, done in found:
                yield numbers[n], done
        return
    paths = set() if options.dask == LOCAL else {job.scenario for job in jobs.values() if job.scenario.is_file()}
    bundles = {path: ScenarioBundle.of(path) for path in paths}
    tasks_on = {n: Task(work=work, job=job, by=made_by(), bundle=bundles.get(job.scenario)) for n, job in jobs.items()}
    yield from settled_on(options.dask, perform, tasks_on, options.workers, say=say)


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

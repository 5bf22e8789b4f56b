"""Work in processes of this machine: results as they come, and a process that dies takes nothing with it.

A process that was killed or crashed breaks the whole pool that it was in, and nobody can tell whose job it had. So what
was in flight is done again, one job at a time by one process; whoever dies then, dies of its job, and twice is enough.
"""

from __future__ import annotations

import contextlib
import os
import signal
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, get_context, parent_process
from typing import TypeVar

from companion.errors import JobError

JobT = TypeVar("JobT")
ResultT = TypeVar("ResultT")
# Processes that die one after the other before any has done a job will not do one.
MOST_DEAD = 4
ENDED_S = 5.0   # within which a process ends that was told to
AHEAD = 2   # jobs in flight for each process: none waits for this one


class WorkerDiedError(JobError):
    """The process that had this job, and no other, died."""


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0))


def in_processes(work: Callable[[JobT], ResultT], jobs: Iterable[JobT], workers: int | None) -> Iterator[ResultT]:
    """Yield ``work`` of each job as it is done, by ``workers`` processes (None: one per core; 1: here, in order).

    What a job raises is raised. A process that dies is replaced, and its job done again once.
    """
    for _, result in settled(work, jobs, workers):
        if isinstance(result, Exception):
            raise result
        yield result


def settled(
    work: Callable[[JobT], ResultT], jobs: Iterable[JobT], workers: int | None,
) -> Generator[tuple[int, ResultT | Exception], None, None]:
    """Yield the number of each job, from 0, with its result or what it raised, as they are done.

    Whoever has seen enough closes it: processes under way are ended.

    Raises:
        JobError: processes die at once, whatever they are given.
    """
    count = workers or cores()
    if count == 1:
        for number, job in enumerate(jobs):
            yield number, _tried(work, job)
        return
    waiting, suspects = deque(enumerate(jobs)), deque[tuple[int, JobT]]()
    dead, has_result, died_of = 0, False, set[int]()
    while waiting or suspects:
        is_alone = bool(suspects)
        flight = _flight(work, suspects if is_alone else waiting, 1 if is_alone else count, is_alone=is_alone)
        with contextlib.closing(flight):
            while True:
                try:
                    number, result = next(flight)
                except StopIteration as ended:
                    fallen: list[tuple[int, JobT]] = ended.value
                    break
                has_result = True
                yield number, result
        if not is_alone:
            suspects.extend(fallen)
        elif fallen:
            dead += 1
            if dead >= MOST_DEAD and not has_result:
                raise JobError(f"{dead} processes died one after the other before any had done a job; is there memory?")
            number = fallen[0][0]
            if number in died_of:
                yield number, WorkerDiedError("its process died, twice and with no other job")
            else:
                died_of.add(number)
                suspects.append(fallen[0])


def _tried(work: Callable[[JobT], ResultT], job: JobT) -> ResultT | Exception:
    try:
        return work(job)
    except Exception as error:
        return error


def _flight(
    work: Callable[[JobT], ResultT], queue: deque[tuple[int, JobT]], count: int, *, is_alone: bool,
) -> Generator[tuple[int, ResultT | Exception], None, list[tuple[int, JobT]]]:
    """Yield what comes of a queue until it is empty or a process dies; return what was in flight then."""
    before = set(active_children())
    # What a process that is ended or killed leaves in its scratch folder is cleared away here.
    scratch = tempfile.TemporaryDirectory(prefix="sailing-", ignore_cleanup_errors=True)
    # spawn: workers must not inherit a loop, threads or the kernels' locks
    pool = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_begin, initargs=(scratch.name,))
    flying: dict[Future[ResultT], tuple[int, JobT]] = {}
    fallen: list[tuple[int, JobT]] = []
    is_over = False
    try:
        while flying or (queue and not fallen):
            while queue and not fallen and len(flying) < (1 if is_alone else count * AHEAD):
                entry = queue.popleft()
                try:
                    flying[pool.submit(work, entry[1])] = entry
                except BrokenProcessPool:
                    fallen.append(entry)
            # of a broken pool every future ends at once, some with a result
            for future in wait(flying, return_when=ALL_COMPLETED if fallen else FIRST_COMPLETED).done:
                entry = flying.pop(future)
                error = future.exception()
                if isinstance(error, BrokenProcessPool):
                    fallen.append(entry)
                elif error is None:
                    yield entry[0], future.result()
                elif isinstance(error, Exception):
                    yield entry[0], error
                else:
                    raise error
        is_over = True
    finally:
        pool.shutdown(wait=is_over, cancel_futures=True)
        if not is_over:   # broken off: nobody waits for voyages under way
            ended = set(active_children()) - before
            for process in ended:
                process.terminate()
            for process in ended:
                process.join(ENDED_S)
        scratch.cleanup()
    return fallen


def _begin(scratch: str) -> None:
    """Begin a worker: Ctrl-C is its parent's, it does not outlive that, and what it leaves is in ``scratch``."""
    tempfile.tempdir = scratch
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        def leave() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=leave, name="parent", daemon=True).start()

"""Executors of jobs: processes of this machine, or a Dask cluster.

A process that was killed or crashed breaks the whole pool that it was in, and nobody can tell whose job it had. So what
was in flight is done again, one job at a time by one process; whoever dies then, dies of its job, and twice is enough.

Workers must be this very program, and do one voyage at a time in each process. Both are asked when a run begins; a
worker that comes later is asked before each job (``sitl.runner.job``).
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import signal
import tempfile
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any, TypeVar

from companion.errors import JobError
from companion.kernels.build import leave_with_parent
from sitl.runner.job import UnfitError
from sitl.runner.result_store import MadeBy, made_by

JobT = TypeVar("JobT")
ResultT = TypeVar("ResultT")
# Processes that die one after the other before any has done a job will not do one.
MOST_DEAD = 4
ENDED_S = 5.0  # within which a process ends that was told to
AHEAD = 2  # jobs in flight for each process: none waits for this one


class WorkerDiedError(JobError):
    """The process that had this job, and no other, died."""


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0))


def settled(
    work: Callable[[JobT], ResultT], jobs: Iterable[JobT], workers: int | None
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
    work: Callable[[JobT], ResultT], queue: deque[tuple[int, JobT]], count: int, *, is_alone: bool
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
        if not is_over:  # broken off: nobody waits for voyages under way
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
    leave_with_parent()


LOCAL = "local"
ANSWER_S = 10.0  # within which a scheduler answers that is there
PATIENCE_S = 120.0  # until which one that went is waited for
LONELY_S = 20.0  # without a result, after which it is asked whether any worker is left
RETRIES = 1  # of a job that raised: a card or a link may be better elsewhere


class _GoneError(Exception):
    """The scheduler went, and what it knew with it."""


def settled_on(
    address: str,
    work: Callable[[JobT], ResultT],
    jobs: Mapping[int, JobT],
    workers: int | None,
    *,
    say: Callable[[str], None],
) -> Iterator[tuple[int, ResultT | Exception]]:
    """Yield the number of each job with its result or what it raised, as they are done.

    ``address`` is a scheduler's, a scheduler file (``*.json``), or "local" for a cluster of ``workers`` processes here.

    Raises:
        JobError: no scheduler answers, it went and did not come back, or it or its workers are another program.
    """
    import distributed

    # What it logs of lost links is said here, in one line each.
    logging.getLogger(distributed.__name__).setLevel(logging.CRITICAL)
    left = dict(jobs)
    with contextlib.ExitStack() as stack:
        place = stack.enter_context(_local(workers or cores())) if address == LOCAL else address
        client = _connected(place, address)
        try:
            while left:
                require_same(client, address)
                say(f"{address}: {_count(client)}; dashboard: {client.dashboard_link}")
                try:
                    for number, result in _round(client, work, left, lambda told: say(f"{address}: {told}")):
                        del left[number]
                        yield number, result
                except _GoneError:
                    say(f"{address}: the scheduler went; it is waited for ({PATIENCE_S:.0f} s); {len(left)} jobs to do")
                    _close(client)
                    client = _connected(place, address, patience_s=PATIENCE_S)
        finally:
            _close(client)


def require_same(client: Any, address: str) -> None:
    """Raise JobError unless scheduler and workers are this program, and workers do one job at a time."""
    try:
        told: dict[str, Any] = {"the scheduler": client.run_on_scheduler(_told), **client.run(_told)}
        infos = client.scheduler_info()["workers"]
    except (OSError, TimeoutError):
        return  # a worker that goes now is no worker; the scheduler's going is seen next
    except Exception as error:
        raise JobError(
            f"{address}: the scheduler or a worker cannot load this program ({type(error).__name__}: "
            f"{str(error)[:120]}); install the same version there"
        ) from error
    for who, plain in told.items():
        try:
            unlike = made_by().unlike(MadeBy.from_dict(plain))
        except (KeyError, TypeError, ValueError):
            unlike = "one that tells other things of itself"
        if unlike:
            raise JobError(f"{address}: {who} runs another version ({unlike}); install the same there")
    many = next((name for name, info in infos.items() if info["nthreads"] > 1), None)
    if many is not None:
        raise JobError(
            f"{address}: {many} has {infos[many]['nthreads']} threads, and a voyage wants a process of its "
            "own; start workers with --nthreads 1"
        )


def _told() -> dict[str, Any]:
    return made_by().to_dict()


def _count(client: Any) -> str:
    number = len(client.scheduler_info()["workers"])
    return f"{number} worker{'s' if number != 1 else ''}" if number else "no worker, waiting for one"


@contextlib.contextmanager
def _local(workers: int) -> Iterator[Any]:
    import distributed
    from dask import config

    # A voyage may have processes of its own, which a daemon may not.
    with (
        config.set({"distributed.worker.daemon": False}),
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        ) as cluster,
    ):
        yield cluster


def _connected(place: Any, address: str, patience_s: float = 0.0) -> Any:
    """Return a client, by ``patience_s`` from now."""
    from distributed import Client

    is_file = isinstance(place, str) and place.endswith(".json")
    where = {"scheduler_file": place} if is_file else {"address": place}
    until_s = time.monotonic() + patience_s
    while True:
        try:
            if is_file:
                Path(place).read_bytes()  # dask would wait for it, and say nothing
            return Client(**where, timeout=f"{ANSWER_S}s", set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            if time.monotonic() < until_s and isinstance(error, OSError):
                time.sleep(0.5)
                continue
            why = " ".join(str(error).split())[:120]
            remedy = "the same command goes on when it is back" if patience_s else "is it running, can it be reached?"
            raise JobError(f"{address}: no Dask scheduler answers ({why}); {remedy}") from error


def _close(client: Any) -> None:
    with contextlib.suppress(Exception):  # one that lost its scheduler has nothing to say goodbye to
        client.close(timeout=5)


def _round(
    client: Any, work: Callable[[JobT], ResultT], jobs: Mapping[int, JobT], tell: Callable[[str], None]
) -> Iterator[tuple[int, ResultT | Exception]]:
    """Yield what comes of the jobs until all are done; raise _GoneError when the scheduler goes.

    ``tell`` is told when no worker is left.
    """
    from distributed import CancelledError, KilledWorker

    landed: queue.SimpleQueue[Any] = queue.SimpleQueue()
    flying = {}
    try:
        for number, job in jobs.items():
            future = client.submit(work, job, pure=False, retries=RETRIES)
            flying[future.key] = (number, future)
            future.add_done_callback(landed.put)
        heard_s, is_told = time.monotonic(), False
        while flying:
            try:
                future = landed.get(timeout=1.0)
            except queue.Empty:
                if client.status != "running":
                    raise _GoneError from None
                if time.monotonic() - heard_s > LONELY_S:
                    heard_s, is_alone = time.monotonic(), not client.scheduler_info()["workers"]
                    if is_alone and not is_told:
                        tell(_count(client))
                    is_told = is_alone
                continue
            heard_s = time.monotonic()
            number = flying[future.key][0]
            try:
                result = future.result()
            except CancelledError as error:
                raise _GoneError from error
            except KilledWorker as error:
                result = WorkerDiedError(f"{error.allowed_failures + 1} workers died of it, one after the other")
            except UnfitError:
                raise
            except Exception as error:
                if client.status != "running":
                    raise _GoneError from error
                result = error
            del flying[future.key], future
            yield number, result
    except (OSError, RuntimeError) as error:
        if client.status == "running":
            raise
        raise _GoneError from error
    finally:
        flying.clear()  # gives back what is not done: the scheduler forgets it

"""Many voyages at a time: work done in processes of their own, results as they come."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TypeVar

JobT = TypeVar("JobT")
ResultT = TypeVar("ResultT")


def in_processes(work: Callable[[JobT], ResultT], jobs: Iterable[JobT], workers: int | None) -> Iterator[ResultT]:
    """Yield ``work`` of each job as it is done, by ``workers`` processes (None: one per core; 1: here, in order)."""
    count = workers or os.cpu_count() or 1
    if count == 1:
        yield from map(work, jobs)
        return
    # spawn: workers must not inherit a loop, threads or the kernels' locks
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        for future in as_completed([pool.submit(work, job) for job in jobs]):
            yield future.result()

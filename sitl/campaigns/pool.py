"""Many voyages at a time: work done in processes of their own, results as they come, on record and on the screen."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

from companion.errors import InputError

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


def sailed(
    work: Callable[[JobT], dict[str, Any]], jobs: Sequence[JobT], workers: int | None, out: Path | None = None,
    said: Callable[[dict[str, Any]], str] = lambda _: "",
) -> Iterator[dict[str, Any]]:
    """Yield the record of each job as it is done; a line of ``out`` each, and how far it is on the screen.

    ``said`` makes of a record what the progress line tells of it and of those before, "" for nothing.
    """
    began = time.perf_counter()
    with contextlib.ExitStack() as stack:
        file = None if out is None else stack.enter_context(out.open("a", encoding="utf-8"))
        for n, record in enumerate(in_processes(work, jobs, workers), 1):
            if file is not None:
                file.write(json.dumps(record, separators=(",", ":")) + "\n")
                file.flush()
            left_s = (time.perf_counter() - began) / n * (len(jobs) - n)
            sys.stderr.write(f"\r{n}/{len(jobs)} sailed{said(record)}, {left_s:.0f} s left   ")
            sys.stderr.flush()
            yield record
    sys.stderr.write("\n" if jobs else "")


def held(out: Path | None) -> list[dict[str, Any]]:
    """Return the records that a file holds; a last line that was cut short is taken out.

    Raises:
        InputError: a line is no record.
    """
    if out is None or not out.exists():
        return []
    text = out.read_text(encoding="utf-8")
    if text and not text.endswith("\n"):
        out.write_text(text[:text.rfind("\n") + 1], encoding="utf-8")
    try:
        return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]
    except ValueError as error:
        raise InputError(str(out), "", f"holds a line that is no voyage ({error})", "name another file") from error

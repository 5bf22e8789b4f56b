"""Jobs that processes elsewhere can load: quick, seeded, and some of them deadly."""

import os
import random
import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from sitl.runner import Experiment, Job


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    folder: Path  # every attempt leaves a line in it
    deadly: str = ""  # "once" or "always"
    work_s: float = 0.0


def jobs_in(folder, seeds, **more):
    return [Job(seed=n, case=Attempt(folder=folder, **more)) for n in seeds]


def quick(jobs, sail=None, line=lambda _: None):
    return Experiment(name="quick", jobs=jobs, sail=sail or work, key=key_of, line=line)


def key_of(job):
    return {"scenario": "quick", "seed": job.seed}


def work(job):
    attempts = job.case.folder / f"{job.seed}"
    with attempts.open("a") as file:
        file.write(f"{os.getpid()}\n")
    if job.case.deadly == "always" or (job.case.deadly == "once" and len(attempts.read_text().splitlines()) == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(job.case.work_s)
    rng = random.Random(job.seed)
    return {"seed": job.seed, "passed": True, "figures": {"time_s": rng.gauss(300.0, 10.0), "track": (1, 2.5)}}


def raising(job):
    if job.seed % 2:
        raise ZeroDivisionError(f"of seed {job.seed}")
    return work(job)


def leaving(job):
    return {"left": tempfile.mkdtemp(), "seed": job.seed}


def attempts(folder):
    return {int(path.name): len(path.read_text().splitlines()) for path in folder.iterdir()}

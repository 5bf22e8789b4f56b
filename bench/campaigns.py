"""What the runner of campaigns costs: empty jobs and real voyages, by processes and by a local Dask cluster.

    python -m bench.campaigns                       # a few minutes on a quiet machine
    python -m bench.campaigns --empty 2000 --voyages 32 --workers 1 2 4 8

Seconds of a processor count, not of the wall: workers beyond the cores share them, and so may others. "bare" is as many
processes, each with its share of the seeds in a loop and nothing else. What the runner adds to a job is told by jobs
that do nothing: the processor's time of all its processes, less what they take to begin.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from lab.campaigns.campaign import campaign, sail
from sitl.options import CampaignOptions
from sitl.run.compiled import compile_ahead
from sitl.runner import Experiment, Job

DEMO = Path(__file__).parents[1] / "sitl" / "scenarios" / "demo.toml"
MACHINES, CORES, VOYAGES = 100, 2, 10_000


@dataclass(frozen=True)
class Spent:
    """What a run took: seconds of the wall and of all processors."""

    jobs: int
    wall_s: float
    cpu_s: float


def nothing(job):
    return {"seed": job.seed, "passed": True}


def share(seeds):
    for job in voyages_of(seeds).jobs:
        sail(job)


def voyages_of(seeds):
    return campaign([DEMO], runs=len(seeds), first_seed=seeds.start)


def cpu_s():
    spent_by = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(by.ru_utime + by.ru_stime for by in spent_by)


def spent(jobs, run):
    began_s, worked_s = time.monotonic(), cpu_s()
    run()
    return Spent(jobs=jobs, wall_s=time.monotonic() - began_s, cpu_s=cpu_s() - worked_s)


def bare(seeds, workers):
    context = multiprocessing.get_context("spawn")
    crew = [context.Process(target=share, args=(seeds[n::workers],)) for n in range(workers)]
    for process in crew:
        process.start()
    for process in crew:
        process.join()


def voyages(seeds, means):
    return campaign([DEMO], runs=len(seeds)).results(means)


def empty(count, means):
    jobs = [Job(seed=seed, case=None) for seed in range(count)]
    return Experiment(name="empty", jobs=jobs, sail=nothing, key=lambda job: {"seed": job.seed}).results(means)


def tell(name, row):
    print(f"  {name:18} {row.jobs / row.wall_s:5.2f} a second, {row.cpu_s / row.jobs:5.2f} s CPU each", flush=True)


def main(argv=None):
    parser = argparse.ArgumentParser(prog="python -m bench.campaigns", description=__doc__.split("\n", 1)[0])
    parser.add_argument("--empty", type=int, default=4000, help="jobs that do nothing, a tenth by dask (default 4000)")
    parser.add_argument("--voyages", type=int, default=8, help="demo voyages of each row, 0 for none (default 8)")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4, 8])
    args = parser.parse_args(argv)
    compile_ahead()
    with tempfile.TemporaryDirectory() as folder:
        ways = [(f"{w} workers", CampaignOptions(workers=w)) for w in args.workers if w > 1]
        ways += [(f"{w} workers, dask", CampaignOptions(workers=w, dask="local")) for w in args.workers]
        # Last, for one sails in this process: what it held once is counted of each worker that it begins.
        ways += [("1 worker", CampaignOptions(workers=1))] if 1 in args.workers else []
        print("jobs that do nothing")
        added_s = {}
        for name, means in ways:
            count = args.empty if means.dask is None else args.empty // 10
            few = spent(10, lambda means=means: empty(10, means))
            out = CampaignOptions(workers=means.workers, dask=means.dask, out=Path(folder) / f"{name}.jsonl")
            many = spent(count, lambda out=out, count=count: empty(count, out))
            added_s[name] = (many.cpu_s - few.cpu_s) / (count - 10)
            print(
                f"  {name:18} {1000 * added_s[name]:6.2f} ms CPU a job, {few.cpu_s:5.1f} s CPU to begin and end",
                flush=True,
            )
        if not args.voyages:
            return 0
        seeds = range(args.voyages)
        print(f"{args.voyages} demo voyages, with what the workers take to begin")
        for w in args.workers:
            tell(f"bare, {w}", spent(len(seeds), lambda w=w: bare(seeds, w)))
        peaks, inner = [], []
        for name, means in ways:
            out = Path(folder) / f"v-{name}.jsonl"
            whole = CampaignOptions(workers=means.workers, dask=means.dask, out=out)
            tell(name, spent(len(seeds), lambda whole=whole: voyages(seeds, whole)))
            facts = [json.loads(line) for line in out.with_suffix(".facts.jsonl").read_text().splitlines()]
            peaks.append((name, max(fact["peak_mb"] for fact in facts)))
            inner += [fact["cpu_s"] for fact in facts]
        print("largest worker: " + ", ".join(f"{name} {mb:.0f} MB" for name, mb in peaks))
        each_s = statistics.median(inner)
        print(
            f"a voyage: {each_s:.2f} s CPU (median); the runner adds "
            + ", ".join(f"{name} {100 * s / each_s:.2f} %" for name, s in added_s.items())
        )
        last = [s for name, s in added_s.items() if "dask" in name][-1]
        print(
            f"on paper: {VOYAGES} voyages by {MACHINES} machines of {CORES} cores like these: "
            f"{VOYAGES * each_s / MACHINES / CORES / 60.0:.1f} min, of which one scheduler and client are busy "
            f"{VOYAGES * last / 60.0:.1f} min of one core"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())

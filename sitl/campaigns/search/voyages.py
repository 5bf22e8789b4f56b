"""A search over voyages: of ``sitl mismatch`` on one water, or of ``sitl faults``; what it finds is left as scenarios.

How near a voyage came is the hull's least clearance. One that touched with an excuse (``sitl faults`` says which) leads
nowhere: it counts as one that came near nothing.
"""

from __future__ import annotations

import math
import os
import random
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec

from companion.disk import Disk
from companion.words import counted
from sitl.campaigns import fault_draw, faults
from sitl.campaigns.fault_watch import UNEXCUSED
from sitl.campaigns.mismatch import draw, voyages
from sitl.campaigns.search.splitting import Point, Splitting
from sitl.means import Means
from sitl.runner import Key, file_hash, sail
from sitl.scene import Scenario, load_scenario, scenario_text

CAMPAIGN = "search"
# The water of `sitl mismatch` in which the floor was broken.
NARROW = draw.WATERS[2]
What = Literal["mismatch", "faults"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One voyage of a search: the ``number``-th of it."""

    what: What
    scenario: Path
    point: Point
    search: str
    number: int


def drawn_of(job: Job) -> Scenario:
    """Return the scenario of a job, with all that was drawn for it."""
    if job.what == "faults":
        return fault_draw.drawn_by(job.point.draws(), load_scenario(job.scenario))
    return draw.drawn_by(job.point.draws(), job.scenario).scenario


def sail_point(job: Job) -> dict[str, Any]:
    """Sail a job; return how it went and how near it came."""
    seed = job.point.seed
    if job.what == "faults":
        record = faults.sail_faults(drawn_of(job), seed, job.scenario)
        touched = [contact["excuse"] == UNEXCUSED for contact in record["contacts"]]
        near_m, drawn = record["clearance_m"], record["events"]
    else:
        record = voyages.sail_drawn(draw.drawn_by(job.point.draws(), job.scenario), voyages.Job(seed=seed))
        touched = [True] * (record.get("contacts") or 0)
        near_m, drawn = record.get("min_clearance_m"), record["kinds"]
    score_m = near_m if near_m is not None and math.isfinite(near_m) else None
    if touched:
        score_m = 0.0 if any(touched) else None
    return {"number": job.number, "seed": seed, "score_m": score_m, "violates": any(touched),
            "passed": record["passed"], "faults": record["faults"], "drawn": drawn}


def key_of(job: Job) -> Key:
    """Return what a voyage is known by: a search and its number say what was drawn."""
    return {"search": job.search, "scenario": load_scenario(job.scenario).name, "hash": file_hash(job.scenario),
            "number": job.number}


def run_search(
    *, what: What, scenario: Path, runs: int, each: int, first_seed: int, is_blind: bool, found: Path, means: Means,
) -> int:
    """Search until a voyage touches or ``runs`` are sailed; say how, and leave the scenario. Return the exit code."""
    name = f"{what} {'blind' if is_blind else 'splitting'} {each} {first_seed}"
    search = Splitting(random.Random(f"search {name}"), each=each, is_blind=is_blind)
    sailed = 0
    while sailed < runs:
        jobs = [Job(what=what, scenario=scenario, point=point, search=name, number=sailed + n)
                for n, point in enumerate(search.ask())]
        there = sail(CAMPAIGN, sail_point, jobs, means, key=key_of, is_failed=lambda record: record["violates"])
        if there.lost:
            return there.exit_code(is_good=False)
        sailed += len(jobs)
        search.tell([math.inf if r["score_m"] is None else r["score_m"] for r in there.records])
        nearest = min((r["score_m"] for r in there.records if r["score_m"] is not None), default=math.inf)
        print(f"{sailed} sailed, level {search.level}: nearer than {search.threshold_m:.1f} m (chance "
              f"{search.chance:.2g}), nearest of this generation {nearest:.1f} m", flush=True)
        bad = [record for record in there.records if record["violates"] or record["faults"]]
        for record in bad:
            path = _left(jobs[record["number"] - jobs[0].number], found)
            print(f"FOUND after {record['number'] + 1} voyages: {'; '.join(record['faults'])} "
                  f"({', '.join(record['drawn'])}); again: sitl run {path} --seed {record['seed']}", flush=True)
        if any(record["violates"] for record in bad):
            return 1
    print(f"no contact in {counted(sailed, 'voyage')}")
    return 0


def _left(job: Job, folder: Path) -> Path:
    """Write the scenario of a job into a folder; return its file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{job.what}-{job.number}-{job.point.seed}.toml"
    drawn = drawn_of(job)
    mission = os.path.relpath(drawn.mission_path(job.scenario), folder.resolve())
    Disk().replace(path, scenario_text(msgspec.structs.replace(drawn, mission=mission)).encode())
    return path

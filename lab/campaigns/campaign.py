"""Monte Carlo over seeds: many voyages of a scenario in worker processes, and the table of how they went."""

from __future__ import annotations

import contextlib
import math
import shutil
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from companion.errors import InputError
from companion.words import file_name
from lab.methods import AS_IT_SAYS, Method, why_not
from sitl.results import columns, compare
from sitl.results import comparison_text as told_pairs
from sitl.runner import CampaignResults, Experiment, ExperimentSummary, Job, Key, Table
from sitl.scenario import verdict_line

FAILURES = Path("campaign-failures")


def sail(job: Job[Method]) -> dict[str, Any]:
    """Sail one seed by the case's guidance and planner; return its verdict as a record."""
    from companion.clock import run_virtual
    from sitl.run.embedded import mission_of, run_embedded
    from sitl.scenario import load_scenario

    scenario = load_scenario(job.scenario)
    told = _name(scenario.name, job.scenario, job.case)
    name = f"{file_name(told)}-{job.seed:04d}"
    place = job.keep / name if job.keep else None
    if place is not None:
        shutil.rmtree(place, ignore_errors=True)
    with replace(job, keep=place).folder() as folder:
        try:
            variation = job.case.variation(mission_of(scenario, job.scenario))
            verdict = run_virtual(run_embedded(scenario, job.scenario, job.seed, folder, variation=variation)).to_dict()
        except Exception as error:
            verdict = {
                "scenario": scenario.name,
                "seed": job.seed,
                "passed": False,
                "checks": [{"name": "no unhandled error", "passed": False, "figure": repr(error), "required": []}],
                "figures": {},
            }
        if not verdict["passed"] and place is None:
            kept = FAILURES / name
            shutil.rmtree(kept, ignore_errors=True)
            if folder.is_dir():
                with contextlib.suppress(OSError):  # a seed repeats: its result is worth more than its folder
                    kept.parent.mkdir(exist_ok=True)
                    shutil.copytree(folder, kept)
    return {**verdict, "scenario": told}


def _name(scenario: str, path: Path, method: Method) -> str:
    """Return what a setting is called: by its file, too, where that is a copy whose scenario kept its name."""
    name = scenario if scenario == path.stem else f"{scenario} ({path.stem})"
    return f"{name}, {method.description}" if method.description else name


def key_of(job: Job[Method]) -> Key:
    """Return what a run is known by."""
    return job.key(**({"method": job.case.description} if job.case.description else {}))


def campaign(
    scenarios: Sequence[Path],
    *,
    runs: int,
    first_seed: int = 0,
    keep: Path | None = None,
    methods: Sequence[Method] = (AS_IT_SAYS,),
) -> Experiment[Method]:
    """Return the voyages of each scenario by each method that its mission allows; a table, and what failed.

    Two settings are compared, too: their voyages of a seed have the same weather as far as both say the same of it.

    Raises:
        InputError: two of them would have one name, or no mission can be sailed by any method.
    """
    from sitl.run.embedded import mission_of
    from sitl.scenario import load_scenario

    loaded = [load_scenario(path) for path in scenarios]
    missions = [mission_of(scenario, path) for scenario, path in zip(loaded, scenarios, strict=True)]
    ways, left_out = [], []
    for scenario, path, mission in zip(loaded, scenarios, missions, strict=True):
        for method in methods:
            name = _name(scenario.name, path, method)
            reason = why_not(mission, method.guidance) if method.guidance is not None else ""
            if reason:
                left_out.append(f"left out: {name}: {reason}")
            else:
                ways.append((name, path, method))
    if not ways:
        raise InputError("--guidance", "", "; ".join(left_out), "name another guidance or scenario")
    names = [name for name, _, _ in ways]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError("sitl campaign", twice, "is two of the scenarios", "give one another name = or file name")

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = sailed.records
        by_name = {name: [r for r in records if r["scenario"] == name] for name in names}
        table = [figures(name, found) for name, found in by_name.items()]
        rate = sum(t["sailed_s"] for t in table) / sailed.cpu_s if sailed.now == len(records) and sailed.cpu_s else None
        lines = [*as_lines(table), *left_out, sailed.took + (f"; {rate:.0f} times real time per core" if rate else "")]
        if len(names) == 2:
            first, second = (
                Table(
                    campaign="campaign",
                    by=sailed.held.by,
                    keys=("seed",),
                    rows=tuple({**r["figures"], "passed": r["passed"], "seed": r["seed"]} for r in by_name[name]),
                )
                for name in names
            )
            if {row["seed"] for row in first.rows} & {row["seed"] for row in second.rows}:
                lines += [
                    "",
                    f"{names[0]} (first) and {names[1]} (second), seed by seed:",
                    *told_pairs(compare(first, second)).splitlines(),
                ]
        for record in sorted((r for r in records if not r["passed"]), key=lambda r: (r["scenario"], r["seed"])):
            bad = "; ".join(f"{c['name']}: {c['figure']}" for c in record["checks"] if not c["passed"])
            lines.append(f"FAILED {record['scenario']} seed {record['seed']}: {bad[:300]}")
        return ExperimentSummary(
            lines=lines, figures={"table": table, "wall_s": sailed.wall_s}, is_good=all(r["passed"] for r in records)
        )

    return Experiment(
        name="campaign",
        sail=sail,
        key=key_of,
        sum_up=sum_up,
        line=verdict_line,
        jobs=[
            Job(scenario=path, seed=first_seed + k, keep=keep, case=method)
            for _, path, method in ways
            for k in range(runs)
        ],
    )


def figures(name: str, records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return one row of the table."""
    fs = [r["figures"] for r in records if r["figures"]]
    times = sorted(f["time_s"] for f in fs if f["arrived"])

    def numbers(key: str) -> list[float]:
        return [float(f[key]) for f in fs if f.get(key) is not None]

    entered = [f["no_go_entries"] for f in fs if f.get("no_go_entries") is not None]
    return {
        "scenario": name,
        "runs": len(records),
        "passed": sum(bool(r["passed"]) for r in records),
        "arrived": sum(bool(f["arrived"]) for f in fs),
        "touched": sum(f["contacts"] > 0 for f in fs),
        "time_median_s": _median(times),
        "time_p90_s": times[min(len(times) - 1, math.ceil(0.9 * len(times)) - 1)] if times else None,
        "tacks_median": _median(numbers("tacks")),
        "replans_median": _median(numbers("replans")),
        "below_floor": sum(any(c["name"] == "clearance, m" and not c["passed"] for c in r["checks"]) for r in records),
        "clearance_min_m": min(numbers("min_clearance_m"), default=None),
        "clearance_median_m": _median(numbers("min_clearance_m")),
        "promised_risk": _median(numbers("promised_risk")),
        "observed_no_go": sum(n > 0 for n in entered) / len(entered) if entered else None,
        "silence_max_s": max(numbers("silence_s"), default=None),
        "sailed_s": sum(f["time_s"] for f in fs),
    }


def _median(values: Iterable[float]) -> float | None:
    values = list(values)
    return statistics.median(values) if values else None


def as_lines(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Return the rows under each other."""
    heads = {
        "scenario": "scenario",
        "runs": "runs",
        "passed": "passed",
        "arrived": "arrived",
        "touched": "touched",
        "time_median_s": "time s",
        "time_p90_s": "p90 s",
        "tacks_median": "tacks",
        "replans_median": "replans",
        "below_floor": "below floor",
        "clearance_min_m": "least clearance m",
        "clearance_median_m": "median m",
        "promised_risk": "promised risk",
        "observed_no_go": "forced into no-go",
    }
    return columns([list(heads.values()), *([_cell(row[key]) for key in heads] for row in rows)], left=1)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) < 1.0 else f"{value:.1f}"
    return str(value)

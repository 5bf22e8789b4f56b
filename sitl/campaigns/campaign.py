"""Monte Carlo over seeds: many voyages of a scenario in worker processes, and the table of how they went."""

from __future__ import annotations

import contextlib
import json
import math
import shutil
import statistics
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.words import file_name
from sitl.options import CampaignOptions
from sitl.run.variation import AS_IT_SAYS, Method, can_be_sailed
from sitl.runner import Key, file_hash, run_jobs

FAILURES = Path("campaign-failures")


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One run; ``method`` takes the place of the mission's guidance and planner."""

    scenario: Path
    seed: int
    keep: Path | None
    method: Method = AS_IT_SAYS


def sail_one(job: Job) -> dict[str, Any]:
    """Sail one seed; return its verdict as a record. Runs in a worker process."""
    from companion.clock import run_virtual
    from sitl.run.embedded import mission_of, run_embedded
    from sitl.scenario import load_scenario

    scenario = load_scenario(job.scenario)
    name = file_name(_name(scenario.name, job.method))
    place = job.keep / f"{name}-{job.seed:04d}" if job.keep else None
    with tempfile.TemporaryDirectory(prefix="voyage-") as scratch:
        folder = place or Path(scratch) / "voyage"
        if place is not None:
            shutil.rmtree(place, ignore_errors=True)
        try:
            variation = job.method.variation(mission_of(scenario, job.scenario))
            verdict = run_virtual(
                run_embedded(scenario, job.scenario, job.seed, folder, variation=variation)).to_dict()
        except Exception as error:
            verdict = {"scenario": scenario.name, "seed": job.seed, "passed": False, "checks": [
                {"name": "no unhandled error", "passed": False, "figure": repr(error), "required": []}], "figures": {}}
        if not verdict["passed"] and place is None:
            kept = FAILURES / f"{name}-{job.seed:04d}"
            shutil.rmtree(kept, ignore_errors=True)
            if folder.is_dir():
                with contextlib.suppress(OSError):   # a seed repeats: its result is worth more than its folder
                    kept.parent.mkdir(exist_ok=True)
                    shutil.copytree(folder, kept)
    return {**verdict, "scenario": _name(scenario.name, job.method)}


def _name(scenario: str, method: Method) -> str:
    return f"{scenario}, {method.told}" if method.told else scenario


def key_of(job: Job) -> Key:
    """Return what a run is known by."""
    from sitl.scenario import load_scenario

    return {"scenario": load_scenario(job.scenario).name, "hash": file_hash(job.scenario),
            **({"method": job.method.told} if job.method.told else {}), "seed": job.seed}


def run_campaign(
    scenarios: Sequence[Path], *, runs: int, first_seed: int = 0, means: CampaignOptions, json_path: Path | None = None,
    keep: Path | None = None, methods: Sequence[Method] = (AS_IT_SAYS,),
) -> int:
    """Run each scenario by each method that its mission allows, and print; return the exit code."""
    from sitl.run.compiled import compile_ahead
    from sitl.run.embedded import mission_of
    from sitl.scenario import load_scenario

    loaded = [load_scenario(path) for path in scenarios]
    missions = [mission_of(scenario, path) for scenario, path in zip(loaded, scenarios, strict=True)]
    for planner in dict.fromkeys(method.planner or "auto" for method in methods):
        compile_ahead(planner)
    ways = [(scenario.name, path, method) for scenario, path, mission in zip(loaded, scenarios, missions, strict=True)
            for method in methods if method.guidance is None or can_be_sailed(mission, method.guidance)]
    names = [_name(name, method) for name, _, method in ways]
    jobs = [Job(scenario=path, seed=first_seed + k, keep=keep, method=method)
            for _, path, method in ways for k in range(runs)]
    sailed = run_jobs("campaign", sail_one, jobs, means, key=key_of,
                  on_record=lambda record: print(json.dumps(record, separators=(",", ":")), flush=True))
    records = sailed.records
    table = [figures(name, [r for r in records if r["scenario"] == name]) for name in names]
    print_table(table)
    rate = sum(t["sailed_s"] for t in table) / sailed.cpu_s if sailed.now == len(records) and sailed.cpu_s else None
    print(sailed.took + (f"; {rate:.0f} times real time per core" if rate else ""))
    for record in sorted((r for r in records if not r["passed"]), key=lambda r: (r["scenario"], r["seed"])):
        bad = "; ".join(f"{c['name']}: {c['figure']}" for c in record["checks"] if not c["passed"])
        print(f"FAILED {record['scenario']} seed {record['seed']}: {bad[:300]}")
    if json_path is not None:
        json_path.write_text(json.dumps({"table": table, "wall_s": sailed.wall_s}, indent=1) + "\n", encoding="utf-8")
    return sailed.exit_code(is_good=all(r["passed"] for r in records))


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


def print_table(rows: Sequence[dict[str, Any]]) -> None:
    """Print the rows under each other."""
    heads = {
        "scenario": "scenario", "runs": "runs", "passed": "passed", "arrived": "arrived", "touched": "touched",
        "time_median_s": "time s", "time_p90_s": "p90 s", "tacks_median": "tacks", "replans_median": "replans",
        "below_floor": "below floor", "clearance_min_m": "least clearance m",
        "clearance_median_m": "median m", "promised_risk": "promised risk",
        "observed_no_go": "forced into no-go",
    }
    texts = [[_cell(row[key]) for key in heads] for row in rows]
    widths = [max(len(head), *(len(t[i]) for t in texts)) for i, head in enumerate(heads.values())]
    print("  ".join(head.rjust(w) if i else head.ljust(w)
                    for i, (head, w) in enumerate(zip(heads.values(), widths, strict=True))))
    for cells in texts:
        print("  ".join(c.rjust(w) if i else c.ljust(w) for i, (c, w) in enumerate(zip(cells, widths, strict=True))))


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) < 1.0 else f"{value:.1f}"
    return str(value)

"""The comparison as a campaign: every sailor, scenario and seed, a line of a file each, and the table of them."""

from __future__ import annotations

import json
import math
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.errors import JobError, LinkError
from sitl.campaigns.baselines import sail_alone, sail_ardurover, sail_companion, sail_companion_ardurover
from sitl.campaigns.pool import in_processes
from sitl.scene import load_scenario

HERE = Path(__file__).parents[1] / "scenarios"
SCENARIOS = (
    HERE / "figures" / "block.toml", HERE / "two-channels.toml", HERE / "demo.toml", HERE / "lee-shore.toml",
    HERE / "figures" / "slalom.toml", HERE / "upwind.toml",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One voyage."""

    who: str
    scenario: Path
    seed: int
    speedup: float
    set_sail: tuple[float, float, float] | None = None


def sail(job: Job) -> dict[str, Any]:
    """Sail a job; what went wrong with the harness is in ``error``."""
    began = time.perf_counter()
    try:
        if job.who == "companion":
            record = sail_companion(job.scenario, job.seed)
        elif job.who == "companion-ardurover":
            record = sail_companion_ardurover(job.scenario, job.seed, job.speedup)
        elif job.who == "alone-embedded":
            record = sail_alone(job.scenario, job.seed)
        else:
            record = sail_ardurover(job.scenario, job.seed, job.who, job.speedup, job.set_sail)
    except (JobError, LinkError) as error:
        record = {"who": job.who, "scenario": load_scenario(job.scenario).name, "seed": job.seed, "error": str(error)}
    return {**record, "wall_s": time.perf_counter() - began}


def run_baselines(
    *, who: Sequence[str], scenarios: Sequence[Path], seeds: int, workers: int, speedup: float, out: Path,
) -> int:
    """Sail everything, append each voyage to ``out`` as it ends, print the table of all that ``out`` holds."""
    began = {(r["scenario"], r["seed"]): tuple(r["start"]) for r in (read(out) if out.exists() else []) if "start" in r}
    jobs = [
        Job(who=w, scenario=p, seed=s, speedup=speedup, set_sail=began.get((load_scenario(p).name, s)))
        for w in who for s in range(seeds) for p in scenarios]
    with out.open("a", encoding="utf-8") as file:
        for n, record in enumerate(in_processes(sail, jobs, workers), 1):
            file.write(json.dumps(record, separators=(",", ":")) + "\n")
            file.flush()
            sys.stderr.write(f"\r{n}/{len(jobs)} sailed   ")
            sys.stderr.flush()
    sys.stderr.write("\n")
    print(table(read(out)))
    return 0


def read(path: Path) -> list[dict[str, Any]]:
    """Return the newest record of every voyage in a file."""
    newest = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        record = json.loads(line)
        newest[record["who"], record["scenario"], record["seed"]] = record
    return list(newest.values())


def table(records: Sequence[dict[str, Any]]) -> str:
    """Return the figures as a Markdown table: a row for each scenario and sailor, losses included.

    Times are of voyages that arrived without contact; "forced" is how many of the companion's voyages met a wind shift
    into the no-go zone on a leg, to be held against the risk that the plan promised.
    """
    lines = [
        "| scenario | sailor | runs | arrived | touched | clean | median s | 90 % | tacks | least m | risk | forced |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    names = list(dict.fromkeys(load_scenario(p).name for p in SCENARIOS))
    sailed = [r for r in records if "error" not in r]
    for name in [*names, *sorted({r["scenario"] for r in sailed} - set(names))]:
        for who in ("companion", "companion, ArduRover", "alone, embedded", "alone, ArduRover", "dijkstra, ArduRover"):
            rows = [r for r in sailed if r["scenario"] == name and r["who"] == who]
            if rows:
                lines.append(_row(name, who, rows))
    lost = len(records) - len(sailed)
    if lost:
        lines.append(f"\n{lost} voyages could not be sailed (harness): " + "; ".join(
            sorted({str(r["error"]) for r in records if "error" in r})))
    return "\n".join(lines)


def _row(name: str, who: str, rows: Sequence[dict[str, Any]]) -> str:
    clean = sorted(r["time_s"] for r in rows if r["arrived"] and not r["contacts"])
    clearances = [r["clearance_m"] for r in rows if r["clearance_m"] is not None]
    risks = [r["promised_risk"] for r in rows if r.get("promised_risk") is not None]
    entered = [r["no_go_entries"] for r in rows if r.get("no_go_entries") is not None]
    cells = [
        name, who, str(len(rows)), str(sum(r["arrived"] for r in rows)), str(sum(r["contacts"] > 0 for r in rows)),
        str(len(clean)), f"{statistics.median(clean):.0f}" if clean else "-",
        f"{clean[math.ceil(0.9 * len(clean)) - 1]:.0f}" if clean else "-",
        f"{statistics.median(r['tacks'] for r in rows):g}", f"{min(clearances):.1f}" if clearances else "-",
        f"{statistics.median(risks):.2f}" if risks else "-",
        f"{sum(n > 0 for n in entered)} of {len(entered)}" if entered else "-",
    ]
    return "| " + " | ".join(cells) + " |"

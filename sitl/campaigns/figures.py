"""The comparison as a campaign: every sailor, scenario and seed, a line of a file each, and the table of them."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from msgspec import structs

from sitl.campaigns.baselines import (
    Voyage,
    sail_alone,
    sail_ardurover,
    sail_companion,
    sail_companion_ardurover,
    sail_fixed,
)
from sitl.campaigns.pairs import pairs
from sitl.means import Means
from sitl.runner import Key, file_hash, read_results, sail
from sitl.scene import Scenario, load_scenario

HERE = Path(__file__).parents[1] / "scenarios"
SCENARIOS = (
    HERE / "figures" / "block.toml", HERE / "two-channels.toml", HERE / "demo.toml", HERE / "lee-shore.toml",
    HERE / "figures" / "slalom.toml", HERE / "upwind.toml",
)
# The sailors, and as they are told in tables, in their order there.
NAMES = {
    "companion": "companion", "shifts": "companion, by shifts", "no-shifts": "companion, no shifts",
    "fixed": "fixed plan", "companion-ardurover": "companion, ArduRover", "alone-embedded": "alone, embedded",
    "alone": "alone, ArduRover", "dijkstra": "dijkstra, ArduRover",
}
TOLD = tuple(NAMES.values())
# Sailors with the companion on the embedded autopilot: by the shifts, or not; None: as the mission says.
SHIFTS: dict[str, bool | None] = {"companion": None, "shifts": True, "no-shifts": False}
# Who never tacks on them, by the parameters for that.
WITHOUT = frozenset({"no-shifts", "alone-embedded", "alone", "dijkstra"})
# A wind: its spread [deg] and correlation time [s].
WindOf = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One voyage."""

    who: str
    scenario: Path
    seed: int
    speedup: float
    set_sail: tuple[float, float, float] | None = None
    wind: WindOf | None = None      # in place of the scenario's


def scenario_of(job: Job) -> Scenario:
    """Return what a job sails: by this sailor's parameters; in another wind it has another name."""
    scenario = load_scenario(job.scenario)
    if job.who in WITHOUT:
        scenario = structs.replace(scenario, parameters={**scenario.parameters, **scenario.without_shifts})
    if job.wind is None:
        return scenario
    spread_deg, tau_s = job.wind
    told = f"{spread_deg:g}°, {tau_s:g} s" if spread_deg > 0.0 else "steady"
    model: Literal["ou", "constant"] = "ou" if spread_deg > 0.0 else "constant"
    wind = structs.replace(scenario.wind, model=model, sd_deg=spread_deg, tau_s=tau_s)
    return structs.replace(scenario, name=f"{scenario.name}, {told}", wind=wind)


def sail_one(job: Job) -> dict[str, Any]:
    """Sail a job; return what is told of it."""
    return voyage_of(job).record


def voyage_of(job: Job) -> Voyage:
    """Sail a job; JobError or LinkError where the harness fails, and then there is no result."""
    what = scenario_of(job), job.scenario, job.seed
    if job.who in SHIFTS:
        return sail_companion(*what, shifts=SHIFTS[job.who], told=NAMES[job.who])
    if job.who == "companion-ardurover":
        return sail_companion_ardurover(*what, job.speedup)
    if job.who == "fixed":
        return sail_fixed(*what)
    if job.who == "alone-embedded":
        return sail_alone(*what)
    return sail_ardurover(*what, job.who, job.speedup, job.set_sail)


def key_of(job: Job) -> Key:
    """Return what a voyage is known by: of those on the real ArduRover the pace and where they set sail, too."""
    key: dict[str, str | int | float | None] = {
        "who": job.who, "scenario": scenario_of(job).name, "hash": file_hash(job.scenario), "seed": job.seed}
    if job.who in {"companion-ardurover", "alone", "dijkstra"}:
        key["speedup"] = job.speedup
    if job.set_sail is not None and job.who in {"alone", "dijkstra"}:
        key["from"] = "{:.6f},{:.6f},{:.1f}".format(*job.set_sail)
    return key


def run_baselines(
    *, who: Sequence[str], scenarios: Sequence[Path], seeds: int, means: Means, speedup: float,
    winds: Sequence[WindOf] | None = None, against: str | None = None,
) -> int:
    """Sail everything that has no result yet, print the table of all that the file holds; return the exit code."""
    began: dict[tuple[str, int], tuple[float, float, float]] = {}
    if means.file is not None and means.file.is_file() and means.file.stat().st_size:
        began = {(key["scenario"], key["seed"]): tuple(result["start"])
                 for key, result in read_results(means.file).pairs() if "start" in result}
    jobs = [replace(job, set_sail=began.get((scenario_of(job).name, job.seed)))
            for job in jobs_of(who, scenarios, seeds, speedup, winds)]
    sailed = sail("baselines", sail_one, jobs, means, key=key_of)
    records = latest([result for _, result in sailed.held.pairs()])
    print(table(records))
    if against is not None:
        print(pairs(records, NAMES[against]))
    return sailed.exit_code(is_good=True)


def jobs_of(
    who: Sequence[str], scenarios: Sequence[Path], seeds: int, speedup: float, winds: Sequence[WindOf] | None,
) -> list[Job]:
    """Return the voyages of a campaign; ``winds`` None: those of the scenarios."""
    return [Job(who=w, scenario=p, seed=s, speedup=speedup, wind=wind)
            for s in range(seeds) for w in who for p in scenarios for wind in winds or (None,)]


def latest(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one record of every sailor, scenario and seed: of those that set sail here and there, the last."""
    return list({(r["who"], r["scenario"], r["seed"]): r for r in records}.values())


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
    for name in [*names, *sorted({r["scenario"] for r in records} - set(names))]:
        for who in TOLD:
            rows = [r for r in records if r["scenario"] == name and r["who"] == who]
            if rows:
                lines.append(_row(name, who, rows))
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

"""What a slow computer makes of a water: ``python -m bench.shares [WATER...] [--shares 1 0.25 0.1 0.05]``

    python -m bench.shares --seeds 5 --out shares.jsonl               ten waters at four shares: hours, and it resumes
    python -m bench.shares slalom narrow-channel demo --shares 0.1 --kills 50

Each voyage is ``sitl run WATER --cpu SHARE``: companion and planner under a share of one core, in real time (a voyage
takes as long as it takes), the simulated boat and its judge outside of it. With ``--kills`` the planner's process is
killed (SIGKILL) at so many moments of the voyage. Printed is a line a voyage, in the end a row for each water and
share, as docs/reference/skipper.md has them. Exit code 1 when a voyage did not pass. The share is of a core of this
machine, and is had beside other load; but what else runs takes caches and clock: run it on a quiet one, with fewer
``--workers`` than cores.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from companion.program.arguments import number, out_file, out_folder, whole
from sitl.commands.run import scenario_file
from sitl.options import add_options, options_of
from sitl.results import markdown
from sitl.run.compiled import compile_ahead
from sitl.run.live import family_of
from sitl.runner import CampaignResults, Experiment, ExperimentSummary, Job, Key

WATERS = (
    "slalom",
    "narrow-channel",
    "demo",
    "two-channels",
    "block",
    "lee-shore",
    "pond",
    "rocky-bay",
    "piers",
    "tight-slalom",
)
SHARES = (1.0, 0.25, 0.1, 0.05)
KILL_EVERY_S = (2.0, 8.0)  # drawn evenly
HEADS = (
    "water",
    "share",
    "voyages",
    "arrived",
    "time s",
    "to the full core's",
    "least clearance m",
    "plans",
    "latency s, 50 / 90 % / worst",
    "first plan s",
    "least budget s",
    "kills",
)
# ``sitl run``, told to end when the process that began it does (PR_SET_PDEATHSIG).
RUN = (
    "import ctypes, signal, sys; ctypes.CDLL(None).prctl(1, signal.SIGTERM); from sitl.cli import main; "
    "sys.exit(main())"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowComputer:
    """A share of one core, and how often the planner's process is killed in a voyage."""

    share: float
    kills: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Plans:
    """What a voyage's records tell of its plans: how long each took [s], the budgets, and when the first was there."""

    took_s: tuple[float, ...]
    budgets_s: tuple[float, ...]
    first_s: float | None


def plans_of(decisions: Path) -> Plans:
    """Read them; ``first_s`` is from the first request to the first path."""
    asked: dict[int, tuple[float, float]] = {}
    took, budgets = [], []
    began_s = first_s = None
    for line in decisions.read_text(encoding="utf-8").splitlines():
        entry = json.loads(line)
        if entry["kind"] == "start":
            asked.clear()  # another process: its numbers begin anew
        elif entry.get("action") == "RequestPlan":
            asked[entry["request_id"]] = entry["t_s"], entry["budget_s"]
            began_s = entry["t_s"] if began_s is None else began_s
        elif entry["kind"] == "plan" and entry["request_id"] in asked:
            then_s, budget_s = asked.pop(entry["request_id"])
            took.append(entry["t_s"] - then_s)
            budgets.append(budget_s)
            if first_s is None and began_s is not None and entry["status"] in {"found", "optimal"}:
                first_s = entry["t_s"] - began_s
    return Plans(took_s=tuple(took), budgets_s=tuple(budgets), first_s=first_s)


def planners(pid: int) -> Iterator[int]:
    """Yield the planner's processes below ``sitl run``, by their name."""
    for member in family_of(pid):
        with contextlib.suppress(OSError):
            if Path(f"/proc/{member}/comm").read_text(encoding="utf-8") == "planner\n":
                yield member


def sail(job: Job[SlowComputer]) -> dict[str, Any]:
    """Sail one voyage by ``sitl run``; return what came of it. Whoever ends this process ends it, too."""
    name = f"{job.scenario.stem}-{job.case.share:g}-{job.case.kills}-{job.seed}"
    with replace(job, keep=job.keep and job.keep / name).folder() as folder:
        argv = [
            sys.executable,
            "-c",
            RUN,
            "run",
            str(job.scenario),
            "--cpu",
            f"{job.case.share:g}",
            "--seed",
            str(job.seed),
            "--out",
            str(folder),
        ]
        draw, kills, load = random.Random(job.seed), 0, os.getloadavg()[0]
        with (
            tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said,
            subprocess.Popen(argv, stdout=subprocess.DEVNULL, stderr=said) as run,
        ):
            try:
                next_s = time.monotonic() + draw.uniform(*KILL_EVERY_S)
                while run.poll() is None:
                    time.sleep(0.2)
                    if kills < job.case.kills and time.monotonic() >= next_s:
                        next_s = time.monotonic() + draw.uniform(*KILL_EVERY_S)
                        for pid in list(planners(run.pid))[:1]:
                            with contextlib.suppress(ProcessLookupError):
                                os.kill(pid, signal.SIGKILL)
                                kills += 1
            finally:
                run.terminate()
                run.wait()
                said.seek(0)
                last_words = said.read()[-300:].strip()
        record = {
            "water": job.scenario.stem,
            "share": job.case.share,
            "seed": job.seed,
            "passed": False,
            "kills": kills,
            "load": load,
        }
        if not (folder / "verdict.json").is_file():
            return {**record, "arrived": False, "checks": [{"name": last_words, "passed": False}]}
        verdict, plans = json.loads((folder / "verdict.json").read_bytes()), plans_of(folder / "decisions.jsonl")
        told = {key: verdict["figures"][key] for key in ("arrived", "contacts", "time_s", "min_clearance_m", "tacks")}
        return {
            **record,
            **told,
            "passed": verdict["passed"],
            "took_s": plans.took_s,
            "budgets_s": plans.budgets_s,
            "first_s": plans.first_s,
            "checks": verdict["checks"],
        }


def key_of(job: Job[SlowComputer]) -> Key:
    """Return what a voyage is known by."""
    return job.key(share=job.case.share, kills=job.case.kills)


def shares_of(
    waters: Sequence[Path], shares: Sequence[float], *, seeds: int, kills: int = 0, keep: Path | None = None
) -> Experiment[SlowComputer]:
    """Return a voyage for each water, share and seed; the table of them, and what failed."""

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        rows = [row for water in waters for share in shares if (row := figures(water.stem, share, sailed.records))]
        failed = [
            f"FAILED {r['water']} at {r['share']:g}, seed {r['seed']}: "
            + "; ".join(f"{c['name']}: {c.get('figure')}" for c in r["checks"] if not c["passed"])
            for r in sailed.records
            if not r["passed"]
        ]
        return ExperimentSummary(
            lines=[markdown(HEADS, [as_cells(row) for row in rows]), *failed, sailed.took],
            figures=rows,
            is_good=not failed,
        )

    return Experiment(
        name="shares",
        sail=sail,
        key=key_of,
        sum_up=sum_up,
        line=line,
        jobs=[
            Job(scenario=water, seed=seed, keep=keep, case=SlowComputer(share=share, kills=kills))
            for seed in range(seeds)
            for water in waters
            for share in shares
        ],
    )


def line(record: dict[str, Any]) -> str:
    """Return a voyage in a line."""
    if "time_s" not in record:
        return f"{record['water']} at {record['share']:g}, seed {record['seed']}: no verdict"
    first_s = record["first_s"]
    return (
        f"{record['water']} at {record['share']:g}, seed {record['seed']}: "
        f"{'passed' if record['passed'] else 'FAILED'}, {record['time_s']:.0f} s, {len(record['took_s'])} plans, "
        f"the slowest in {max(record['took_s'], default=math.nan):.1f} s, the first after "
        f"{math.nan if first_s is None else first_s:.1f} s, {record['kills']} kills"
    )


def figures(water: str, share: float, records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return a row of the table: of all voyages on that water at that share; empty, there is none.

    ``of_full`` is the mean of the sailing times' ratios to the full core's, over the seeds of which both arrived.
    """
    mine = [r for r in records if r["water"] == water and r["share"] == share]
    if not mine:
        return {}
    full_s = {r["seed"]: r["time_s"] for r in records if r["water"] == water and r["share"] == 1.0 and r["arrived"]}
    there = [r for r in mine if r["arrived"]]
    ratios = [r["time_s"] / full_s[r["seed"]] for r in there if r["seed"] in full_s]
    took_s = sorted(s for r in mine for s in r.get("took_s", ()))
    return {
        "water": water,
        "share": share,
        "voyages": len(mine),
        "arrived": len(there),
        "time_s": statistics.fmean(r["time_s"] for r in there) if there else None,
        "of_full": statistics.fmean(ratios) if ratios else None,
        "clearance_m": min((r["min_clearance_m"] for r in mine if r.get("min_clearance_m") is not None), default=None),
        "plans": len(took_s),
        "median_s": statistics.median(took_s) if took_s else None,
        "late_s": took_s[math.ceil(0.9 * len(took_s)) - 1] if took_s else None,
        "worst_s": max(took_s, default=None),
        "first_s": max((r["first_s"] for r in mine if r.get("first_s") is not None), default=None),
        "budget_s": min((s for r in mine for s in r.get("budgets_s", ())), default=None),
        "kills": sum(r["kills"] for r in mine),
    }


def as_cells(row: dict[str, Any]) -> list[str]:
    """Return a row's cells."""

    def cell(key: str, kind: str = ".1f") -> str:
        return "-" if row[key] is None else format(row[key], kind)

    ratio = "-" if row["of_full"] is None else f"{100.0 * (row['of_full'] - 1.0):+.1f} %"
    return [
        row["water"],
        f"{row['share']:g}",
        str(row["voyages"]),
        str(row["arrived"]),
        cell("time_s", ".0f"),
        ratio,
        cell("clearance_m"),
        str(row["plans"]),
        f"{cell('median_s')} / {cell('late_s')} / {cell('worst_s')}",
        cell("first_s"),
        cell("budget_s", ".2f"),
        str(row["kills"]),
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Sail them."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.shares", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "waters",
        nargs="*",
        type=scenario_file,
        metavar="WATER",
        help=f"scenarios, as of sitl run (default: {', '.join(WATERS)})",
    )
    parser.add_argument("--shares", nargs="+", type=number(above=0.0, at_most=1.0), default=SHARES, metavar="SHARE")
    parser.add_argument("--seeds", type=whole(at_least=1), default=1, metavar="N", help="0 to N - 1 (default: 1)")
    parser.add_argument("--kills", type=whole(), default=0, metavar="N", help="of the planner's process in each voyage")
    parser.add_argument("--keep", type=out_folder, metavar="DIR", help="keep the voyages' folders in it")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the table's figures")
    add_options(parser, workers=1)
    args = parser.parse_args(argv)
    compile_ahead()
    experiment = shares_of(
        args.waters or [scenario_file(name) for name in WATERS],
        args.shares,
        seeds=args.seeds,
        kills=args.kills,
        keep=args.keep,
    )
    return experiment.run(options_of(args), args.json)


if __name__ == "__main__":
    sys.exit(main())

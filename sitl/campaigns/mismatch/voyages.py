"""Voyages of boats that are not the plan's, by seed: contact, floor, silence, and what was promised.

Each is sailed on the embedded autopilot under the virtual clock. A voyage passes that touches nothing, is never silent
and ends without an unhandled error; one below the margin's floor is counted and named. Arriving is counted, not
required: a boat that cannot make way against the stream has done nothing wrong by not arriving.
"""

from __future__ import annotations

import json
import math
import random
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.errors import InputError
from sitl.campaigns.mismatch.draw import Drawn, draw
from sitl.campaigns.mismatch.promises import Legs, arrival_promised, legs_promised, promised_s
from sitl.campaigns.mismatch.table import figures_of, told
from sitl.means import Means
from sitl.run.variation import Variation, drawn_method
from sitl.runner import Key, file_hash, sail

CAMPAIGN = "mismatch"
EXPANSIONS = 8_000
PLANNED = Variation(tables={"skipper": {"autopilot_beats": False}})
NO_GO_RAD = math.radians(45.0)     # SAIL_NO_GO_ANGLE of the simulated autopilot
# Of an arrival's promise: the first plan is for the first goal.
ONE_GOAL = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One voyage; with ``planned`` no beat is left to the autopilot; ``only`` as of ``draw``.

    ``draws`` names what is drawn of guidance and planner, apart from all else; else they are the mission's.
    """

    seed: int
    planned: bool = False
    only: tuple[str, ...] | None = None
    keep: Path | None = None
    draws: tuple[str, ...] = ()


def sail_one(job: Job) -> dict[str, Any]:
    """Sail a seed; return what was drawn, promised and sailed. A voyage folder is left in ``job.keep``."""
    return sail_drawn(draw(job.seed, only=job.only), job)


def sail_drawn(drawn: Drawn, job: Job) -> dict[str, Any]:
    """Sail what was drawn, with what else the job's seed decides."""
    from companion.clock import run_virtual
    from sitl.run.embedded import mission_of, run_embedded

    if job.keep is not None and job.keep.is_dir() and any(job.keep.iterdir()):
        raise InputError("--keep", str(job.keep), "is not empty", "a voyage's folder is taken up where it was left")
    mission = mission_of(drawn.scenario, drawn.source)
    method = drawn_method(random.Random(f"method {job.seed}"), job.draws, mission)
    legs = Legs(mission.frame())
    record: dict[str, Any] = {
        "seed": job.seed, "scenario": drawn.scenario.name, "planned": job.planned,
        "as_planned": job.only == (), "kinds": list(drawn.kinds),
        "drawn": drawn.told(), "method": method.told, "floor_m": mission.margin_floor_m}
    with tempfile.TemporaryDirectory(prefix="mismatch-") as scratch:
        folder = job.keep if job.keep is not None else Path(scratch) / "voyage"
        try:
            verdict = run_virtual(run_embedded(
                drawn.scenario, drawn.source, job.seed, folder, expansions=EXPANSIONS, observer=legs,
                variation=method.variation(mission, PLANNED if job.planned else None)))
        except Exception as error:
            return record | {"passed": False, "faults": [f"unhandled: {error!r}"]}
        summary = json.loads((folder / "summary.json").read_bytes())
        promised = legs_promised(folder, legs.sailed, NO_GO_RAD)
        time_s = promised_s(folder) if len(mission.goals) == ONE_GOAL else None
        arrival = arrival_promised(folder) if len(mission.goals) == ONE_GOAL else None
    figures = verdict.figures
    clear_m = figures["min_clearance_m"]
    is_low = clear_m is not None and clear_m < mission.margin_floor_m
    # the floor is counted by itself, beside what must never be
    faults = [f"{c.name}: {c.figure}" for c in verdict.checks if not c.passed and c.name != "clearance, m"]
    names = ("arrived", "contacts", "time_s", "tacks", "min_clearance_m", "silence_s", "replans", "promised_risk",
             "no_go_entries", "end_reason")
    return record | {
        "passed": not faults, "faults": faults, "below_floor": is_low, **{name: figures[name] for name in names},
        "path_risk": summary.get("path_risk"), "alerts": summary.get("alerts", {}), "promised_s": time_s,
        "arrival": arrival, "legs": promised}


def key_of(job: Job) -> Key:
    """Return what a voyage is known by."""
    drawn = draw(job.seed)
    only = "any" if job.only is None else ", ".join(job.only)
    return {"scenario": drawn.scenario.name, "hash": file_hash(drawn.source), "planned": job.planned, "only": only,
            **({"draws": ", ".join(job.draws)} if job.draws else {}), "seed": job.seed}


def run_mismatch(
    *, runs: int, first_seed: int, means: Means, planned: bool, only: tuple[str, ...] | None, json_path: Path | None,
    draws: tuple[str, ...] = (),
) -> int:
    """Sail what has no result yet, print what failed and the table; return the exit code."""
    jobs = [Job(seed=seed, planned=planned, only=only, draws=draws) for seed in range(first_seed, first_seed + runs)]

    def tell(record: dict[str, Any]) -> None:
        if not record["passed"]:
            method = f" {record['method']}" if record.get("method") else ""
            print(f"FAILED seed {record['seed']}, {record['scenario']}{method}: {'; '.join(record['faults'])} "
                  f"({', '.join(record['kinds']) or 'as planned'})", flush=True)

    sailed = sail(CAMPAIGN, sail_one, jobs, means, key=key_of, on_record=tell)
    records = sailed.records
    records.sort(key=lambda r: int(r["seed"]))
    table = figures_of(records)
    print(told(table))
    print(sailed.took)
    how = (" --planned" if planned else "") + (f" --draw {','.join(draws)}" if draws else "")
    how += " --as-planned" if only == () else "".join(f' --only "{kind}"' for kind in only or ())
    for record in records:
        if not record["passed"] or record.get("below_floor"):
            print(f"again: sitl mismatch --first-seed {record['seed']}{how} --keep DIR")
    if json_path is not None:
        json_path.write_text(json.dumps({"figures": table, "voyages": records}, indent=1) + "\n", encoding="utf-8")
    return sailed.exit_code(is_good=all(r["passed"] for r in records))

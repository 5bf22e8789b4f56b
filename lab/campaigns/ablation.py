"""What each part is worth: the same weather, seed for seed, sailed with one thing taken away or another in its place.

Asks what Wolsieffer 2020 leaves to future work: is a boat safer that plans with the wind's uncertainty?
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from companion.errors import InputError
from companion.geofence import Mission
from companion.planners import ALGORITHMS, AUTO
from lab.methods import foreknown, unspread
from sitl.results import columns
from sitl.run.variation import Variation
from sitl.runner import SCENARIO_FOLDER, CampaignResults, Experiment, ExperimentSummary, Job

SCENARIOS = tuple(
    SCENARIO_FOLDER / f"{name}.toml"
    for name in (
        "two-channels",
        "figures/two-channels-rough",
        "narrow-channel",
        "four-ships",
        "figures/ships-to-windward",
    )
)
AS_IT_IS = "as it is"
PLANNED = {"skipper": {"autopilot_beats": False}}

VARIATIONS: Mapping[str, Variation] = {
    AS_IT_IS: Variation(),
    "no spread": Variation(room=unspread),
    "wind foreknown": Variation(room=foreknown),
    "kalman": Variation(tables={"wind": {"estimator": "kalman"}}),
    "by forecast": Variation(tables={"skipper": {"replan": "forecast"}}),
    "by shifts": Variation(tables={"skipper": {"shifts": True}}),
    "rules of the road": Variation(tables={"traffic": {"policy": "rules"}}),
    "beats planned": Variation(tables=PLANNED),
    "planned, no spread": Variation(tables=PLANNED, room=unspread),
    "planned, foreknown": Variation(tables=PLANNED, room=foreknown),
    "planned, kalman": Variation(tables={**PLANNED, "wind": {"estimator": "kalman"}}),
    "planned, by forecast": Variation(tables={"skipper": {"autopilot_beats": False, "replan": "forecast"}}),
    "planned, delta_s 0.6": Variation(tables={**PLANNED, "risk": {"delta_s": 0.6}}),
    "planned, delta_s 0.8": Variation(tables={**PLANNED, "risk": {"delta_s": 0.8}}),
    "planned, delta_s 0.98": Variation(tables={**PLANNED, "risk": {"delta_s": 0.98}}),
    **{
        name: Variation(tables={"skipper": {"autopilot_beats": False, "planner": name}})
        for name in ALGORITHMS
        if name != AUTO.algorithm
    },
}
BOOTSTRAPS = 2000


def sail(job: Job[str]) -> dict[str, Any]:
    """Sail a job by the variation that its case names; return its figures. What was not foreseen is in ``error``."""
    from companion.clock import run_virtual
    from sitl.run.embedded import run_embedded
    from sitl.scenario import load_scenario

    scenario = load_scenario(job.scenario)
    said = {"scenario": scenario.name, "variation": job.case, "seed": job.seed}
    with job.folder() as folder:
        try:
            verdict = run_virtual(
                run_embedded(scenario, job.scenario, job.seed, folder, variation=VARIATIONS[job.case])
            )
        except Exception as error:
            return {**said, "error": repr(error)}
    mission = _mission(job.scenario)
    names = ("arrived", "contacts", "time_s", "tacks", "min_clearance_m", "no_go_entries", "replans", "promised_risk")
    return {
        **said,
        "error": "",
        **{name: verdict.figures[name] for name in names},
        "vessel_m": min(verdict.figures["vessel_distances_m"].values(), default=None),
        "floor_m": mission.margin_floor_m,
        "safe_m": mission.traffic.safe_distance_m,
    }


def _mission(path: Path) -> Mission:
    from sitl.run.embedded import mission_of
    from sitl.scenario import load_scenario

    return mission_of(load_scenario(path), path)


def ablation(scenarios: Sequence[Path], *, names: Sequence[str], runs: int, first_seed: int) -> Experiment[str]:
    """Return the voyages of each scenario by the variations that are named and as it is; tables of each.

    Raises:
        InputError: there is no such variation, or no such scenario.
    """
    unknown = next((name for name in names if name not in VARIATIONS), None)
    if unknown is not None:
        raise InputError("--only", unknown, "is no variation", "choose of: " + "; ".join(VARIATIONS))
    wanted = [AS_IT_IS, *(name for name in VARIATIONS if name in names and name != AS_IT_IS)]
    for path in scenarios:
        _mission(path)

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = sailed.records
        lines = []
        for scenario in dict.fromkeys(record["scenario"] for record in sorted(records, key=_order)):
            lines += [
                f"{scenario}, {runs} seeds from {first_seed}",
                table([record for record in records if record["scenario"] == scenario], wanted),
            ]
        errors = [
            f"ERROR {r['scenario']}, {r['variation']}, seed {r['seed']}: {r['error'][:300]}"
            for r in records
            if r["error"]
        ]
        return ExperimentSummary(lines=lines + errors, is_good=not errors)

    return Experiment(
        name="ablate",
        sail=sail,
        key=lambda job: job.key(variation=job.case),
        sum_up=sum_up,
        jobs=[
            Job(scenario=path, case=name, seed=first_seed + n)
            for n in range(runs)
            for path in scenarios
            for name in wanted
        ],
        is_failed=lambda record: bool(record["error"]),
    )


def _order(record: Mapping[str, Any]) -> tuple[str, int, int]:
    return record["scenario"], list(VARIATIONS).index(record["variation"]), record["seed"]


def table(records: Sequence[Mapping[str, Any]], names: Sequence[str]) -> str:
    """Return one scenario's table, a line for each variation; times are paired with those of ``AS_IT_IS``."""
    reference = {r["seed"]: r for r in records if r["variation"] == AS_IT_IS and not r["error"]}
    rows = [
        (
            "",
            "arrived",
            "touched",
            "below floor",
            "in no-go, per voyage",
            "least clearance m",
            "median m",
            "too near a vessel",
            "least m",
            "tacks",
            "replans",
            "time s",
            "share of as it is",
        )
    ]
    for name in names:
        mine = [r for r in records if r["variation"] == name and not r["error"]]
        if not mine:
            continue
        clear = [r["min_clearance_m"] for r in mine if r["min_clearance_m"] is not None]
        vessels = [(r["vessel_m"], r["safe_m"]) for r in mine if r["vessel_m"] is not None]
        shares = [
            r["time_s"] / reference[r["seed"]]["time_s"]
            for r in mine
            if r["arrived"] and r["seed"] in reference and reference[r["seed"]]["arrived"]
        ]
        middle, low, high = interval(shares)
        times = [r["time_s"] for r in mine if r["arrived"]]
        rows.append(
            (
                name,
                f"{sum(bool(r['arrived']) for r in mine)}/{len(mine)}",
                str(sum(r["contacts"] > 0 for r in mine)),
                str(sum(r["min_clearance_m"] is not None and r["min_clearance_m"] < r["floor_m"] for r in mine)),
                f"{np.mean([r['no_go_entries'] or 0 for r in mine]):.2f}",
                f"{min(clear):.1f}" if clear else "-",
                f"{np.median(clear):.1f}" if clear else "-",
                str(sum(m < safe_m for m, safe_m in vessels)) if vessels else "-",
                f"{min(m for m, _ in vessels):.1f}" if vessels else "-",
                f"{np.median([r['tacks'] for r in mine]):.0f}",
                f"{np.median([r['replans'] for r in mine]):g}",
                f"{np.median(times):.0f}" if times else "-",
                "1" if name == AS_IT_IS else f"{middle:.3f} ({low:.3f} to {high:.3f})" if shares else "-",
            )
        )
    return "\n".join(columns(rows, left=1)) + "\n"


def interval(shares: Sequence[float]) -> tuple[float, float, float]:
    """Return the geometric mean of paired shares and the bootstrap's 95 % interval of it; nan without any.

    >>> interval([1.1, 1.1, 1.1])
    (1.1, 1.1, 1.1)
    """
    if not shares:
        return math.nan, math.nan, math.nan
    logs = np.log(np.asarray(shares, dtype=np.float64))
    rng = np.random.default_rng(0)
    means = logs[rng.integers(0, logs.size, (BOOTSTRAPS, logs.size))].mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    middle, low, high = (round(math.exp(float(x)), 12) for x in (logs.mean(), low, high))
    return middle, low, high

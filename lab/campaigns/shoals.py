"""Shoals by the hundred: banks on no chart across the way, found by a sounder that errs; and hours of good water.

A seed draws bank, wind, tide and sounder. Each voyage is sailed on the embedded autopilot under the virtual clock and
judged by the true depth under the true track. A keel that strikes is held against the **counterfactual**: from when the
true depth and its slope along her track are an alarm, and what the sounder's statistics take is over, could she have
turned round, to either side, in water that is deep enough? Then it is a fault; else it is told and excused.

An hour of good water is no voyage: a boat goes straight over a bottom that is nowhere too shallow, and its sounder's
pings go through the companion's own statistics and the watchdog's thresholds. Each alarm is a false one.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from companion.geo.frame import LocalFrame
from companion.mavlink.wire import Sounder
from companion.messages import GeoPoint
from companion.safety import BY_NAME
from companion.skipper.behaviors import SHOALING, TURN_S
from companion.words import counted
from sitl.runner import SCENARIO_FOLDER, CampaignResults, Experiment, ExperimentSummary, Job, file_hash
from sitl.scenario import BankSpec, BottomSpec, ExpectSpec, Scenario, WindSpec, scenario_seabed
from sitl.world import LEAST_M, MOST_M, Bank, Seabed, SimulatedSounder

Kind = Literal["bank", "good"]
KINDS: tuple[Kind, ...] = get_args(Kind)

SOURCE = SCENARIO_FOLDER / "sandbank.toml"  # the drawn ones are as if they lay beside it
DRAFT_M, LEAST_DEPTH_M = 2.0, 2.5  # of its mission, with the room under the keel
GOAL_M = 467.0  # due north
CLEAR_M = 60.0  # of a bank: start and goal lie in deep water
LIMIT_S = 1200.0
EXPANSIONS = 4_000
STATISTICS_S = 5.0  # the middle of five pings 2.5 s, held for 2 s, a step
RADIUS_M = 10.0  # of her turn
PING_S = 0.5
HOUR_S = 3600.0


def draw(seed: int) -> Scenario:
    """Return the scenario of a seed: a bank that the keel would strike, somewhere on the way."""
    rng = random.Random(f"shoal {seed}")
    along = rng.uniform(60.0, 200.0)
    across = rng.uniform(40.0, min(along, 120.0))
    tide_m = rng.uniform(0.0, 2.0)
    while True:
        east, north = rng.uniform(-70.0, 70.0), rng.uniform(100.0, GOAL_M - 100.0)
        if min(math.hypot(east, north), math.hypot(east, GOAL_M - north)) > along + CLEAR_M:
            break
        along *= 0.95
        across = min(across, along)
    return Scenario(
        name=f"shoal-{seed}",
        mission="../missions/shoaling.toml",
        limit_s=LIMIT_S,
        wind=WindSpec(
            from_deg=round(rng.uniform(0.0, 360.0), 1),
            tws_mps=round(rng.uniform(3.5, 8.0), 2),
            sd_deg=round(rng.uniform(4.0, 10.0), 1),
        ),
        bottom=BottomSpec(
            depth_m=round(rng.uniform(6.0, 20.0), 2),
            tide_m=round(tide_m, 2),
            tide_range_m=round(rng.uniform(0.0, 2.0 * tide_m), 2),
            tide_high_s=round(rng.uniform(0.0, 44_712.0)),
            noise_m=round(rng.uniform(0.03, 0.2), 3),
            dropouts=round(rng.uniform(0.0, 0.2), 3),
            false_bottoms=round(rng.uniform(0.0, 0.08), 3),
            banks=(
                BankSpec(
                    east_m=round(east, 1),
                    north_m=round(north, 1),
                    top_m=round(rng.uniform(-2.0, 1.0) - tide_m, 2),
                    along_m=round(along, 1),
                    across_m=round(across, 1),
                    bearing_deg=round(rng.uniform(0.0, 180.0), 1),
                ),
            ),
        ),
        expect=ExpectSpec(arrived=None, groundings=None, max_silence_s=None),
    )


def could_have_turned(seabed: Seabed, t_s: Sequence[float], en_m: Sequence[tuple[float, float]]) -> tuple[bool, float]:
    """Return whether a boat that strikes at the end of a track could have turned before, and the warning it had [s].

    It has had none where the slope told nothing before it struck.
    """
    places, times = np.asarray(en_m, dtype=np.float64), np.asarray(t_s, dtype=np.float64)
    depths = seabed.depth_m(places, times)
    rates = np.gradient(depths, times) if len(times) > 2 else np.zeros(len(times))
    is_told = depths + np.minimum(rates, 0.0) * TURN_S <= LEAST_DEPTH_M
    quiet = np.flatnonzero(~is_told)
    first = 0 if not quiet.size else int(quiet[-1]) + 1
    if first >= len(times):
        return False, 0.0
    warning_s = float(times[-1] - times[first])
    begins = int(np.searchsorted(times, times[first] + STATISTICS_S))
    if begins >= len(times) - 1:
        return False, warning_s
    step = places[min(begins + 1, len(places) - 1)] - places[begins]
    course = math.atan2(float(step[0]), float(step[1]))
    for side in (1.0, -1.0):
        angles = np.linspace(0.0, math.pi, 37)
        middle = places[begins] + RADIUS_M * np.array([side * math.cos(course), -side * math.sin(course)])
        out = course - side * math.pi / 2.0 + side * angles
        arc = middle + RADIUS_M * np.column_stack([np.sin(out), np.cos(out)])
        if float(seabed.depth_m(arc, float(times[begins])).min()) >= DRAFT_M:
            return True, warning_s
    return False, warning_s


def sail(job: Job[Kind]) -> dict[str, Any]:
    """Sail a voyage over a bank, or an hour of good water, and return how it went."""
    return good_hour(job.seed) if job.case == "good" else _over_bank(job)


def _over_bank(job: Job[Kind]) -> dict[str, Any]:
    from companion.clock import run_virtual
    from companion.geofence import load_mission
    from companion.telemetry.folder import TRACK, read_rows
    from sitl.run.embedded import run_embedded
    from sitl.scenario import load_scenario

    scenario = draw(job.seed)
    frame: LocalFrame = load_mission(load_scenario(job.scenario).mission_path(job.scenario)).frame()
    seabed = scenario_seabed(scenario, job.scenario, frame)
    assert seabed is not None
    figures: dict[str, Any] = {}
    alerts: list[str] = []
    fault = ""
    turn: tuple[bool, float] | None = None
    with job.folder() as folder:
        try:
            verdict = run_virtual(run_embedded(scenario, job.scenario, job.seed, folder, expansions=EXPANSIONS))
            figures = verdict.figures
            fault = "; ".join(f"{c.name}: {c.figure}" for c in verdict.checks if not c.passed)
            alerts = read_alerts(folder)
            if figures["groundings"]:
                turn = could_have_turned(seabed, *_until_struck(seabed, frame, read_rows(folder / TRACK)))
        except Exception as error:
            fault = repr(error)
    aground = int(figures.get("groundings", 0))
    if turn is not None and turn[0]:
        fault = f"{fault}; aground, and a turn was possible".lstrip("; ")
    elif aground and SHOALING not in alerts:
        fault = f"{fault}; aground, and not told".lstrip("; ")
    return {
        "kind": "bank",
        "seed": job.seed,
        "passed": not fault,
        "fault": fault,
        "groundings": aground,
        "excused": bool(aground and not fault),
        "warning_s": None if turn is None else turn[1],
        "told": SHOALING in alerts,
        "turned": "turning back" in alerts,
        "arrived": figures.get("arrived"),
        "keel_m": figures.get("min_under_keel_m"),
        "time_s": figures.get("time_s"),
    }


def read_alerts(folder: Path) -> list[str]:
    """Return the codes that a voyage announced."""
    return sorted(json.loads((folder / "summary.json").read_bytes()).get("alerts", {}))


def _until_struck(
    seabed: Seabed, frame: LocalFrame, track: Sequence[dict[str, Any]]
) -> tuple[list[float], list[tuple[float, float]]]:
    """Return times and places of a recorded track until the keel first strikes."""
    t_s: list[float] = []
    places: list[tuple[float, float]] = []
    for row in track:
        if math.isnan(row["lat_deg"]):
            continue  # she has no position yet
        place = frame.en_from_geo(GeoPoint(lat_deg=row["lat_deg"], lon_deg=row["lon_deg"]))
        t_s.append(row["t_s"])
        places.append(place)
        if float(seabed.depth_m([place], row["t_s"])[0]) < DRAFT_M:
            break
    return t_s, places


def good_hour(seed: int) -> dict[str, Any]:
    """Return how often a boat is told of a shoal in an hour of water that is nowhere too shallow."""
    rng = random.Random(f"good water {seed}")
    level_m = rng.uniform(4.5, 25.0)
    banks = tuple(
        Bank(
            en_m=(rng.uniform(-200.0, 200.0), rng.uniform(0.0, 9000.0)),
            along_m=(along := rng.uniform(300.0, 1500.0)),
            across_m=rng.uniform(300.0, along),
            bearing_rad=rng.uniform(0.0, math.pi),
            top_m=max(4.0, level_m - rng.uniform(0.5, 4.0)),
        )
        for _ in range(6)
    )
    seabed = Seabed(frame=LocalFrame(GeoPoint(lat_deg=50.8, lon_deg=-1.3)), level_m=level_m, banks=banks)
    told = SimulatedSounder(
        seabed=seabed,
        seed=seed,
        noise_m=rng.uniform(0.03, 0.2),
        dropouts=rng.uniform(0.0, 0.2),
        false_bottoms=rng.uniform(0.0, 0.08),
    )
    speed_mps, dog, heard = rng.uniform(1.5, 3.5), BY_NAME[SHOALING], Sounder()
    since_s: float | None = None
    raised_s: float | None = None
    alarms = 0
    for n in range(int(HOUR_S / PING_S)):
        t_s = n * PING_S
        ping_m = told.ping_m(seabed.frame.geo_from_en(0.0, speed_mps * t_s), t_s)
        if ping_m is not None:
            heard.take(t_s, ping_m, LEAST_M, MOST_M)
        if n % round(1.0 / PING_S):
            continue
        depth_m = heard.depth_m(t_s)
        figure = None if depth_m is None else depth_m + min(0.0, heard.rate_mps(t_s) or 0.0) * TURN_S - LEAST_DEPTH_M
        if raised_s is not None:
            raised_s = None if figure is None or figure >= dog.exit else raised_s
            continue
        if figure is None or figure > dog.enter:
            since_s = None
            continue
        since_s = t_s if since_s is None else since_s
        if t_s - since_s >= dog.enter_s:
            alarms, raised_s, since_s = alarms + 1, t_s, None
    return {"kind": "good", "seed": seed, "passed": not alarms, "fault": f"{alarms} false alarms", "alarms": alarms}


def shoals(*, runs: int, kinds: Sequence[Kind] = KINDS, first_seed: int = 0) -> Experiment[Kind]:
    """Return ``runs`` seeds of each kind; what was struck, what was excused, and the false alarms."""

    def line(record: dict[str, Any]) -> str | None:
        return None if record["passed"] else f"FAILED {record['kind']}, seed {record['seed']}: {record['fault']}"

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = sorted(sailed.records, key=lambda r: (r["kind"], r["seed"]))
        lines = [as_text(kind, found) for kind in kinds if (found := [r for r in records if r["kind"] == kind])]
        again = [
            f"again: sitl shoals --kind {r['kind']} --first-seed {r['seed']} --keep DIR"
            for r in records
            if not r["passed"]
        ]
        return ExperimentSummary(lines=[*lines, sailed.took, *again], is_good=not again, figures=records)

    return Experiment(
        name="shoals",
        sail=sail,
        line=line,
        sum_up=sum_up,
        key=lambda job: {"scenario": "shoal", "hash": file_hash(job.scenario), "kind": job.case, "seed": job.seed},
        jobs=[job_of(kind, first_seed + n) for n in range(runs) for kind in kinds],
    )


def job_of(kind: Kind, seed: int, keep: Path | None = None) -> Job[Kind]:
    """Return a voyage or an hour as a job."""
    return Job(scenario=SOURCE, case=kind, seed=seed, keep=keep)


def as_text(kind: Kind, records: Sequence[dict[str, Any]]) -> str:
    """Return what is told of one kind."""
    if kind == "good":
        return f"good water: {sum(r['alarms'] for r in records)} false alarms in {len(records)} h"
    struck = [r for r in records if r["groundings"]]
    excused = sum(r["excused"] for r in struck)
    return (
        f"banks: {counted(len(records), 'voyage')}, {sum(r['told'] for r in records)} told of a shoal, "
        f"{sum(r['turned'] for r in records)} turned back, {sum(bool(r['arrived']) for r in records)} arrived; aground "
        f"{len(struck)}, of these {excused} excused (no turn was possible in the warning time), "
        f"{len(struck) - excused} not"
    )

"""Faults by the thousand: random but repeatable trouble on a short voyage, and what may never come of it.

A seed gives the weather and one to five faults of link, sensors, wind, process and people
(``sitl.rehearse.fault_sampling``). Each voyage is sailed on the embedded autopilot under the virtual clock and judged
on five points (``lab.campaigns.fault_judge``): no contact of the hull that was to be helped, the margin's floor kept
in ordinary weather, no mission that is a mixture of two, no silence without a status, no unhandled exception. Arriving
is counted, not required: a boat that the operator put in HOLD for half the voyage has done nothing wrong by being late.
"""

from __future__ import annotations

import asyncio
import random
import statistics
import time
from collections import Counter
from collections.abc import Coroutine, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec
import shapely

from companion.clock import RealTimeLoop
from companion.fold import Step
from companion.messages import CompanionStatus, Mode
from lab.campaigns.drawn_faults import (
    BESIDE,
    KINDS,
    MODES,
    Jump,
    draw,
    draw_beside,
    draw_jump,
    draw_planner,
    draw_turned_vane,
)
from lab.campaigns.fault_judge import (
    ALERT_S,
    EXCUSES,
    MAX_SILENCE_S,
    UNEXCUSED,
    Watch,
    avoidable,
    by_hand,
    false_wind_spans,
    mission_key,
    operator_spans,
)
from lab.methods import DRAWABLE, Method, drawn_method
from sitl.run.variation import Variation
from sitl.runner import SCENARIO_FOLDER, CampaignResults, Experiment, ExperimentSummary, Job
from sitl.scenario import EventSpec, Scenario, is_all_ordinary, load_scenario

T = TypeVar("T")


class _FromZero(RealTimeLoop):
    def __init__(self, speedup: float) -> None:
        self._zero_s = time.monotonic() * speedup
        super().__init__(speedup)

    def time(self) -> float:
        """Return loop time since the start [s]."""
        return super().time() - self._zero_s


def run_from_zero(main: Coroutine[Any, Any, T], speedup: float) -> T:
    """Run ``main`` in real time, ``speedup`` times as fast, on a clock that begins at 0."""
    with asyncio.Runner(loop_factory=lambda: _FromZero(speedup)) as runner:
        return runner.run(main)


BASE = SCENARIO_FOLDER / "faults" / "rocks.toml"
# Effort of one plan: the voyage is short and its water simple.
EXPANSIONS = 4_000
# Seeds of the campaign (not of the worker's) that are known to fail, and why nothing of ours would help.
KNOWN: Mapping[int, str] = {
    198: "a calm in 15 s, 0.8 m/s of current and a rock 9 m off: only a skipper who knew of the calm would keep clear",
    525: "the same, 0.5 m/s of current: the calm's last breath comes from ahead, and stops her 9 m from the rock",
}
WORKER_PACE = 2.0  # faster, two seconds of a busy machine would count as silence


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultCase:
    """What a seed draws its trouble of, and what is drawn beside: as of ``method_of``, and of ``BESIDE``."""

    trouble: Literal["all", "jumps", "turned-vane", "worker"] = "all"
    draws: tuple[str, ...] = ()


def job_of(seed: int, case: FaultCase = FaultCase(), keep: Path | None = None) -> Job[FaultCase]:
    """Return a seed as a job."""
    return Job(scenario=BASE, seed=seed, case=case, keep=keep)


def sail(job: Job[FaultCase]) -> dict[str, Any]:
    """Draw the faults of a seed, sail them and return how it went.

    Those of the planner's real process are sailed in real time, ``WORKER_PACE`` times as fast.
    """
    scenario = load_scenario(job.scenario)
    if job.case.trouble == "jumps":
        return sail_jump(_jump_of(job.seed, scenario, job.scenario), job)
    if job.case.trouble == "turned-vane":
        drawn = draw_turned_vane(job.seed, scenario)
    elif job.case.trouble == "worker":
        drawn = draw_planner(job.seed, scenario)
    else:
        drawn = draw(job.seed, scenario)
        if set(job.case.draws) & set(BESIDE):
            drawn = draw_beside(job.seed, drawn, job.case.draws, _jump_of(job.seed, scenario, job.scenario))
    return sail_faults(drawn, job)


def method_of(job: Job[FaultCase], scenario: Scenario) -> Method:
    """Return by which guidance and planner a seed is sailed: drawn where the case says so, else the mission's.

    They are drawn apart, of those that ``scenario`` can be sailed by: what else a seed is does not depend on them.
    """
    from sitl.run.embedded import mission_of

    if not set(job.case.draws) & set(DRAWABLE):
        return Method()
    return drawn_method(random.Random(f"method {job.seed}"), job.case.draws, mission_of(scenario, job.scenario))


def _jump_of(seed: int, base: Scenario, source: Path) -> Jump:
    """Return the false position that a seed draws in the water of ``base``."""
    from companion.geofence import load_mission
    from sitl.run.embedded import solid_of

    mission = load_mission(base.mission_path(source))
    frame = mission.frame()
    places = [frame.en_from_geo(p) for p in (mission.start or mission.origin, mission.goals[-1].point)]
    solid = solid_of(mission.area.local(frame))
    return draw_jump(
        seed,
        base,
        start_en=places[0],
        goal_en=places[1],
        solids_en=[(p.centroid.x, p.centroid.y) for p in shapely.get_parts(solid)],
    )


def sail_jump(drawn: Jump, job: Job[FaultCase]) -> dict[str, Any]:
    """Sail a voyage with a false position, and once more with a skipper who puts the boat into LOITER for good.

    The second does so as soon as anything could be known of it. What the first touches and the second does not is a
    fault.
    """
    method = method_of(job, load_scenario(job.scenario))
    ours = _sail(drawn.scenario, job, method, drawn.variation)
    reach = ours.watch.reach()
    jump = next(e for e in drawn.scenario.events if e.kind == "gps_jump" and e.for_s is not None)
    first_s = next((t for t in reach.false_s if t >= jump.at_s), jump.at_s)
    seen_s = reach.first_s(first_s + ALERT_S, drawn.scenario.limit_s)
    held = (
        None
        if seen_s is None
        else _sail(
            by_hand(drawn.scenario, seen_s, Mode.LOITER, drawn.scenario.limit_s),
            replace(job, keep=None),
            method,
            drawn.variation,
        )
    )
    touched = [t_s for t_s, _ in ours.watch.contacts() if t_s >= jump.at_s]
    held_touched = [] if held is None else [t_s for t_s, _ in held.watch.contacts() if t_s >= jump.at_s]
    faults = [f"contact at {touched[0]:.0f} s, none when held in LOITER"] if touched and not held_touched else []
    silence_s = ours.watch.silence_s(ours.status_s)
    if silence_s > MAX_SILENCE_S:
        faults.append(f"silent for {silence_s:.0f} s")
    if ours.errors:
        faults.append(f"unhandled: {ours.errors[0].strip().splitlines()[-1]}")
    return {
        "seed": job.seed,
        "passed": not faults,
        "faults": faults,
        "kind": drawn.kind,
        "mode": drawn.mode,
        "size": drawn.size_class,
        "size_m": drawn.size_m,
        "for_s": drawn.for_s,
        "events": [event_text(e) for e in drawn.scenario.events],
        "parameters": {},
        "touched_s": touched[:1],
        "held_touched_s": held_touched[:1],
        "arrived": bool(ours.figures.get("arrived")),
        "time_s": ours.figures.get("time_s"),
        "errors": ours.errors,
        "simulated_s": ours.watch.t_s[-1] if ours.watch.t_s else 0.0,
    }


def sail_faults(scenario: Scenario, job: Job[FaultCase]) -> dict[str, Any]:
    """Sail what was drawn, with what else the job's seed decides, and return how it went."""
    method = method_of(job, scenario)
    voyage = _sail(scenario, job, method)
    watch, figures, errors = voyage.watch, voyage.figures, voyage.errors

    def touches(other: Scenario) -> float | None:
        sailed = _sail(other, replace(job, keep=None), method)
        return next((t_s for t_s, _ in sailed.watch.contacts()), None)

    contacts = []
    for t_s, excuse in watch.contacts():
        helped = "" if excuse == UNEXCUSED else avoidable(scenario, excuse, t_s, watch.reach(), touches)
        contacts.append(
            {"t_s": t_s, "excuse": UNEXCUSED if helped else excuse, "looked_like": excuse, "helped": helped}
        )
    least = watch.clearance_m()
    mixture_s, silence_s = watch.mixture_s(), watch.silence_s(voyage.status_s)
    faults = [
        f"contact at {c['t_s']:.0f} s{': ' if c['helped'] else ''}{c['helped']}"
        for c in contacts
        if c["excuse"] == UNEXCUSED
    ]
    is_low = least is not None and least[0] < voyage.floor_m
    before = [e for e in scenario.events if least is not None and e.at_s <= least[1]]
    is_weather = is_all_ordinary(before)
    if is_low and is_weather and least is not None:
        faults.append(f"{least[0]:.1f} m clear at {least[1]:.0f} s, in ordinary weather")
    if mixture_s > 0.0:
        faults.append(f"a mixture for {mixture_s:.1f} s")
    if silence_s > MAX_SILENCE_S:
        faults.append(f"silent for {silence_s:.0f} s")
    if voyage.ordered:
        faults.append(f"neighbour {voyage.ordered[0]} was given orders")
    if errors:
        faults.append(f"unhandled: {errors[0].strip().splitlines()[-1]}")
    return {
        "seed": job.seed,
        "passed": not faults,
        "faults": faults,
        "events": [event_text(e) for e in scenario.events],
        "parameters": dict(scenario.parameters),
        "wind": f"{scenario.wind.tws_mps:g} m/s from {scenario.wind.from_deg:g}",
        "limit_s": scenario.limit_s,
        "set_auto": scenario.set_auto,
        "system": scenario.system,
        "method": method.description,
        "broken": list(scenario.broken),
        "kinds": sorted({e.kind for e in scenario.events}),
        "arrived": bool(figures.get("arrived")),
        "time_s": figures.get("time_s"),
        "contacts": contacts,
        "clearance_m": least and least[0],
        "clearance_t_s": least and least[1],
        "below_floor": is_low,
        "weather_only": is_weather,
        "mixture_s": mixture_s,
        "held_back_s": watch.held_back_s(),
        "silence_s": silence_s,
        "sailed": watch.has_sailed,
        "errors": errors,
        "simulated_s": watch.t_s[-1] if watch.t_s else 0.0,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Voyage:
    """A scenario that was sailed."""

    watch: Watch
    figures: dict[str, Any]
    errors: list[str]
    status_s: list[float]
    floor_m: float
    ordered: list[int]  # neighbours


def _sail(scenario: Scenario, job: Job[FaultCase], method: Method, variation: Variation | None = None) -> _Voyage:
    """Sail a scenario on the embedded autopilot under the eyes of a watch."""
    from companion.clock import run_virtual
    from companion.compose import boat_of
    from companion.geofence import load_mission
    from companion.messages import waypoint
    from sitl.run.embedded import run_embedded, solid_of

    pace = WORKER_PACE if job.case.trouble == "worker" else None
    mission = load_mission(scenario.mission_path(job.scenario))
    frame = mission.frame()
    watch = Watch(
        solid=solid_of(mission.area.local(frame)),
        frame=frame,
        hull=boat_of(mission).hull,
        operator_s=operator_spans(scenario.events, scenario.limit_s),
        false_wind_s=false_wind_spans(scenario.events, scenario.limit_s),
    )
    for event in scenario.events:
        if event.kind == "foreign_mission":
            item = waypoint(frame.geo_from_en(event.east_m, event.north_m))
            watch.foreign.add(mission_key([(item.command, item.lat_e7, item.lon_e7)]))
    status_s: list[float] = []

    def on_status(_: CompanionStatus, step: Step) -> None:
        if step.state.why:
            status_s.append(step.snapshot.t_s)
        watch.step(step)

    figures: dict[str, Any] = {}
    errors: list[str] = []
    ordered: list[int] = []
    with job.folder() as folder:
        try:
            voyage = run_embedded(
                scenario,
                job.scenario,
                job.seed,
                folder,
                on_status=on_status,
                expansions=EXPANSIONS,
                observer=watch,
                worker_pace=pace,
                variation=method.variation(mission, variation),
            )
            verdict = run_virtual(voyage) if pace is None else run_from_zero(voyage, pace)
            figures = verdict.figures
            seen = {check.name: check.figure for check in verdict.checks}
            errors, ordered = [str(e) for e in seen["no unhandled error"]], seen.get("neighbours given orders", [])
        except Exception as error:
            errors = [repr(error)]
    return _Voyage(
        watch=watch, figures=figures, errors=errors, status_s=status_s, floor_m=mission.margin_floor_m, ordered=ordered
    )


def event_text(event: EventSpec) -> str:
    """Return an event in short, with what was drawn for it."""
    plain = msgspec.to_builtins(EventSpec(at_s=0.0, kind=event.kind))
    drawn = [
        f"{key} {value}"
        for key, value in msgspec.to_builtins(event).items()
        if key not in {"at_s", "kind"} and value != plain[key]
    ]
    return f"{event.kind} at {event.at_s:.0f} s" + (f" ({', '.join(drawn)})" if drawn else "")


def faults(case: FaultCase, *, runs: int, first_seed: int = 0) -> Experiment[FaultCase]:
    """Return ``runs`` seeds; what failed that is not ``KNOWN`` to, and what was counted."""
    trouble, draws = case.trouble, case.draws
    known = KNOWN if case == FaultCase() else {}
    drawing = {"draws": ", ".join(draws)} if draws else {}

    def line(record: dict[str, Any]) -> str | None:
        if record["passed"]:
            return None
        method = [record["method"]] if record.get("method") else []
        method += [f"no {outlet}" for outlet in record.get("broken", ())]
        drawn = method + record["events"] + [f"{name} {value:g}" for name, value in record["parameters"].items()]
        word = "known to fail," if record["seed"] in known else "FAILED"
        return f"{word} seed {record['seed']}: {'; '.join(record['faults'])} ({', '.join(drawn)})"

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = sailed.records
        table = jump_figures(records) if trouble == "jumps" else figures_of(records)
        lines = jumps_text(table) if trouble == "jumps" else figures_text(table)
        lines.append(f"{table['simulated_s'] / 3600.0:.1f} h simulated; {sailed.took}")
        option = ("" if trouble == "all" else f" --{trouble}") + (f" --draw {','.join(draws)}" if draws else "")
        for record in records:
            if not record["passed"]:
                lines.append(f"again: sitl faults{option} --first-seed {record['seed']} --keep DIR")
            elif record["seed"] in known:
                lines.append(f"seed {record['seed']} passes, which was known to fail: {known[record['seed']]}")
        return ExperimentSummary(
            lines=lines,
            is_good=all(r["passed"] or r["seed"] in known for r in records),
            figures={"figures": {**table, "wall_s": sailed.wall_s, "cpu_s": sailed.cpu_s}, "voyages": records},
        )

    return Experiment(
        name="faults",
        sail=sail,
        line=line,
        sum_up=sum_up,
        key=lambda job: job.key(trouble=trouble, **drawing),
        jobs=[job_of(seed, case) for seed in range(first_seed, first_seed + runs)],
    )


def figures_of(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what was counted over all voyages."""
    touched: Counter[str] = Counter()
    low = [r for r in records if r["below_floor"]]
    kinds: Counter[str] = Counter()
    for record in records:
        touched.update({c["excuse"] for c in record["contacts"]})
        kinds.update(record["kinds"])
    times = [r["time_s"] for r in records if r["arrived"]]
    return {
        "voyages": len(records),
        "passed": sum(r["passed"] for r in records),
        "failed_seeds": [r["seed"] for r in records if not r["passed"]],
        "arrived": sum(r["arrived"] for r in records),
        "touched": touched.pop(UNEXCUSED, 0),
        "touched_excused": dict(sorted(touched.items())),
        "excused_seeds": {
            excuse: [r["seed"] for r in records if any(c["excuse"] == excuse for c in r["contacts"])]
            for excuse in sorted(touched)
        },
        "below_floor": len(low),
        "below_floor_in_weather": [r["seed"] for r in low if r["weather_only"]],
        "clearance_min_m": min((r["clearance_m"] for r in records if r["clearance_m"] is not None), default=None),
        "mixture_max_s": max((r["mixture_s"] for r in records), default=0.0),
        "held_back_max_s": max((r["held_back_s"] for r in records), default=0.0),
        "silence_max_s": max((r["silence_s"] for r in records), default=0.0),
        "unhandled": sum(bool(r["errors"]) for r in records),
        "time_median_s": statistics.median(times) if times else None,
        "faults": dict(sorted(kinds.items())),
        "simulated_s": sum(r["simulated_s"] for r in records),
    }


def figures_text(table: dict[str, Any]) -> list[str]:
    """Return what was counted, in lines."""
    return [
        f"{table['voyages']} voyages, {table['passed']} passed, {table['arrived']} arrived in time",
        (
            f"touched something: {table['touched']} voyages; longest mixture {table['mixture_max_s']:.1f} s; "
            f"longest silence {table['silence_max_s']:.1f} s; unhandled errors {table['unhandled']}"
        ),
        *(
            f"  excused: {voyages} voyages touched, {EXCUSES[excuse]}; nothing that was tried would have helped"
            for excuse, voyages in table["touched_excused"].items()
        ),
        (
            f"below the margin's floor: {table['below_floor']} voyages, {len(table['below_floor_in_weather'])} of them "
            "in ordinary weather"
        ),
        f"  a mission held back by a slow upload, ended by a loiter: {table['held_back_max_s']:.1f} s at most",
        "voyages with: " + ", ".join(f"{k} {v}" for k, v in table["faults"].items()),
    ]


def jump_figures(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return, by class of the false position and by mode, how many touched, and how many of them held in LOITER."""

    def row(name: str, of: Sequence[dict[str, Any]]) -> dict[str, Any]:
        return {
            "class": name,
            "voyages": len(of),
            "touched": sum(bool(r["touched_s"]) for r in of),
            "held_touched": sum(bool(r["held_touched_s"]) for r in of),
            "arrived": sum(r["arrived"] for r in of),
        }

    classes = [(kind, [r for r in records if r["kind"] == kind]) for kind in KINDS]
    classes += [
        (f"{kind}, {size}", [r for r in records if (r["kind"], r["size"]) == (kind, size)])
        for kind in KINDS
        for size in ("to 100 m", "to 500 m", "farther")
    ]
    classes += [(mode, [r for r in records if r["mode"] == mode]) for mode in MODES]
    return {
        "voyages": len(records),
        "passed": sum(r["passed"] for r in records),
        "failed_seeds": [r["seed"] for r in records if not r["passed"]],
        "classes": [row(name, of) for name, of in [*classes, ("all", list(records))] if of],
        "simulated_s": sum(r["simulated_s"] for r in records),
    }


def jumps_text(table: dict[str, Any]) -> list[str]:
    """Return the classes of false positions under each other."""
    return [
        f"{'false position':<24} voyages  touched  held in LOITER  arrived",
        *(
            f"{row['class']:<24} {row['voyages']:7}  {row['touched']:7}  {row['held_touched']:14}  {row['arrived']:7}"
            for row in table["classes"]
        ),
    ]

"""A boat that is not the plan's: what is drawn for it, the voyages, what was promised and what came of it.

A leg's promise is the probability that the true wind puts its heading into the no-go zone, from the spread and the
angle that it was planned with; what came of it is looked at once, half way along the leg. Both are of the bow through
the water and of the wind over it: what the sails feel. Where there is a current or leeway the bow is the one that
keeps the boat on the leg in them. A leg that the autopilot begins elsewhere than the plan (an upload begins it where
the boat is) has another course, and the promise is of the plan's: how far off it is stands beside.

Each is sailed on the embedded autopilot under the virtual clock. A voyage passes that touches nothing, is never silent
and ends without an unhandled error; one below the margin's floor is counted and named. Arriving is counted, not
required: a boat that cannot make way against the stream has done nothing wrong by not arriving.
"""

from __future__ import annotations

import json
import math
import random
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from companion.current import over_water
from companion.fold import Step
from companion.geo.angles import heading_of, wrap_pi
from companion.geo.frame import LocalFrame
from companion.messages import CompanionStatus, Mode
from companion.telemetry.folder import DECISIONS, SailingTime
from lab.campaigns.drawn_mismatch import SampledMismatch, draw
from lab.methods import drawn_method
from sitl.autopilot import MemoryLink, SimulatedAutopilot
from sitl.run.variation import Variation
from sitl.runner import CampaignResults, Experiment, ExperimentSummary, Job, Key

# A plan's waypoint and the autopilot's are one where they are this near: degrees x 1e7 are a centimetre.
_SAME_M = 0.5
# What a plan says of its arrival, and the probability of being there by then.
QUANTILES = {"p10_s": 0.1, "p50_s": 0.5, "p90_s": 0.9}
_SHORT_M = 10.0  # a leg that is shorter is the middle of a turn
_SLOW_MPS = 0.3  # slower than this the boat goes nowhere that could be kept to


@dataclass(frozen=True, slots=True, kw_only=True)
class SailedSpan:
    """A leg as it was sailed: when its middle was passed, its end, the bow that keeps to it, the wind over water."""

    t_s: float
    end_en_m: tuple[float, float]
    course_rad: float
    bow_rad: float
    twd_from_rad: float


@dataclass(slots=True)
class Legs:
    """Watches which legs a boat sails; an ``Observer`` of a run."""

    frame: LocalFrame
    sailed: list[SailedSpan] = field(default_factory=list)
    _last: tuple[tuple[float, float], tuple[float, float]] | None = None

    def truth(self, t_s: float, autopilot: SimulatedAutopilot, link: MemoryLink) -> None:
        """Look at the autopilot."""
        del link
        truth = autopilot.truth
        if not truth.is_armed or truth.mode is not Mode.AUTO:
            return
        begin, end = autopilot.core.vehicle.leg
        length_m = math.dist(begin, end)
        if (begin, end) == self._last or length_m < _SHORT_M:
            return
        here = truth.east_m, truth.north_m
        along_m = sum((h - b) * (e - b) for h, b, e in zip(here, begin, end, strict=True)) / length_m
        if along_m < 0.5 * length_m:
            return
        self._last = begin, end
        current = autopilot.core.vehicle.current_en_mps
        through = truth.velocity_en_mps[0] - current[0], truth.velocity_en_mps[1] - current[1]
        course_rad = heading_of(end[0] - begin[0], end[1] - begin[1])
        self.sailed.append(
            SailedSpan(
                t_s=t_s,
                end_en_m=self.frame.en_from_geo(autopilot.core.chart.point(end)),
                course_rad=course_rad,
                bow_rad=bow_rad(course_rad, current, through, truth.heading_rad),
                twd_from_rad=over_water(truth.twd_from_rad, truth.tws_mps, current)[0],
            )
        )

    def life(self, start_s: float, end_s: float) -> None:
        """Take one life of the companion: nothing is made of it."""


def bow_rad(
    course_rad: float, current_en_mps: tuple[float, float], through_en_mps: tuple[float, float], heading_rad: float
) -> float:
    """Return the heading that makes a course over the ground good.

    ``through_en_mps`` is how the boat goes through the water with its bow at ``heading_rad``: speed and leeway.

    >>> round(math.degrees(bow_rad(0.0, (1.0, 0.0), (0.0, 2.0), 0.0)))     # set to the east, it holds up to the west
    -30
    """
    speed_mps = math.hypot(*through_en_mps)
    if speed_mps < _SLOW_MPS:
        return course_rad
    abeam_mps = current_en_mps[0] * math.cos(course_rad) - current_en_mps[1] * math.sin(course_rad)
    slip_rad = wrap_pi(math.atan2(*through_en_mps) - heading_rad)
    return wrap_pi(course_rad - math.asin(max(-1.0, min(1.0, abeam_mps / speed_mps))) - slip_rad)


def chance_of_no_go(twa_rad: float, sigma_rad: float, half_rad: float) -> float:
    """Return the probability that a heading at ``twa_rad`` to the mean wind is within ``half_rad`` of the true one.

    >>> round(chance_of_no_go(math.pi / 4, 0.1, math.pi / 4), 3)
    0.5
    """
    scale = max(sigma_rad, 1e-6) * math.sqrt(2.0)
    off = abs(twa_rad)
    return 0.5 * (math.erf((half_rad - off) / scale) - math.erf((-half_rad - off) / scale))


def legs_promised(folder: Path, sailed: list[SailedSpan], half_rad: float) -> list[dict[str, Any]]:
    """Return of each sailed leg that a plan of the record holds: its promise, what came, whose its tacks were.

    ``off_deg`` is how far the wind's angle to the bow was from the planned one, positive to starboard; ``sigma_deg``
    how far it was expected to be; ``course_off_deg`` how far the leg's own course was from the planned one. Legs are
    of courses: the bow is nearer to the wind by the leeway that the plan was asked with.
    """
    leeway_rad = {
        d["request_id"]: math.radians(d.get("leeway_deg", 0.0))
        for d in decisions(folder)
        if d.get("action") == "RequestPlan"
    }
    plans = [
        (d["t_s"], d["plan"]["legs"], leeway_rad.get(d.get("request_id"), 0.0))
        for d in decisions(folder)
        if d["kind"] == "plan" and d.get("plan")
    ]
    found = []
    for leg in sailed:
        planned, slip_rad = next(
            (
                (p, slip_rad)
                for t_s, legs, slip_rad in reversed(plans)
                if t_s <= leg.t_s
                for p in legs
                if math.dist(p["to"], leg.end_en_m) <= _SAME_M
            ),
            (None, 0.0),
        )
        if planned is None:
            continue
        course_twa_rad, sigma_rad = math.radians(planned["twa_deg"]), math.radians(planned["sigma_deg"])
        twa_rad = math.copysign(max(0.0, abs(course_twa_rad) - slip_rad), course_twa_rad)
        came_rad = wrap_pi(leg.twd_from_rad - leg.bow_rad)
        planned_rad = heading_of(planned["to"][0] - planned["from"][0], planned["to"][1] - planned["from"][1])
        found.append(
            {
                "promised": round(chance_of_no_go(twa_rad, sigma_rad, half_rad), 5),
                "came": abs(came_rad) < half_rad,
                "sigma_deg": round(planned["sigma_deg"], 2),
                "off_deg": round(math.degrees(wrap_pi(came_rad - twa_rad)), 2),
                "course_off_deg": round(math.degrees(wrap_pi(leg.course_rad - planned_rad)), 2),
                "is_beat": bool(planned.get("is_beat")),
            }
        )
    return found


def promised_s(folder: Path) -> float | None:
    """Return the time that the first plan promised; None without one."""
    first = _first_plan(folder)
    return None if first is None else float(first["cost_s"])


def arrival_promised(folder: Path) -> dict[str, float | None] | None:
    """Return when the first plan arrives by its quantiles' names (None: in no time); None: it does not say."""
    first = _first_plan(folder)
    arrival = None if first is None else first.get("arrival")
    return None if arrival is None else {name: arrival[name] for name in QUANTILES}


def _first_plan(folder: Path) -> dict[str, Any] | None:
    return next(
        (
            d["plan"]
            for d in decisions(folder)
            if d["kind"] == "plan" and d.get("plan") and d["plan"].get("cost_s") is not None
        ),
        None,
    )


def decisions(folder: Path) -> list[dict[str, Any]]:
    """Return the record of a voyage's decisions; what a line cut short held is left out."""
    try:
        lines = (folder / DECISIONS).read_text(encoding="utf-8").splitlines(keepends=True)
    except OSError:
        return []
    return [json.loads(line) for line in lines if line.endswith("\n")]


Z95 = 1.959964  # of a normal's 95 % interval


def share_interval(hits: int, of: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share (Wilson 1927); 0 to 1 of nothing.

    >>> [round(x, 4) for x in share_interval(0, 100)]
    [0.0, 0.037]
    """
    if of == 0:
        return 0.0, 1.0
    p, z2 = hits / of, Z95 * Z95
    middle = (p + z2 / (2.0 * of)) / (1.0 + z2 / of)
    half = Z95 * math.sqrt(p * (1.0 - p) / of + z2 / (4.0 * of * of)) / (1.0 + z2 / of)
    return max(0.0, middle - half), min(1.0, middle + half)


def figures_of(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what was counted over all voyages, by kind of mismatch and by water."""
    sailed = [r for r in records if "arrived" in r]
    kinds = sorted({kind for r in records for kind in r["kinds"]})
    waters = sorted({r["scenario"] for r in records})
    ratios = [r["time_s"] / r["promised_s"] for r in sailed if r["arrived"] and r["promised_s"]]
    legs = [leg for r in sailed for leg in r["legs"] if not leg["is_beat"]]
    return {
        **_row(records),
        "failed_seeds": [r["seed"] for r in records if not r["passed"]],
        "below_floor_seeds": [r["seed"] for r in sailed if r["below_floor"]],
        "silence_max_s": max((r["silence_s"] or 0.0 for r in sailed), default=0.0),
        "time_share": [float(q) for q in _quantiles(ratios)],
        "timed": len(ratios),
        "later_than_promised": sum(ratio > 1.0 for ratio in ratios),
        "legs": len(legs),
        "legs_in_no_go": sum(leg["came"] for leg in legs),
        "legs_in_no_go_promised": sum(leg["promised"] for leg in legs),
        "kinds": {kind: _row([r for r in records if kind in r["kinds"]]) for kind in kinds},
        "waters": {water: _row([r for r in records if r["scenario"] == water]) for water in waters},
    }


def _quantiles(values: Sequence[float]) -> list[float]:
    """Return what a tenth, half and nine tenths are below; nothing of too few."""
    if len(values) < 2:
        return []
    cuts = statistics.quantiles(values, n=10, method="inclusive")
    return [cuts[0], cuts[4], cuts[8]]


def _row(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    sailed = [r for r in records if "arrived" in r]
    clear = [r["min_clearance_m"] for r in sailed if r["min_clearance_m"] is not None]
    return {
        "voyages": len(records),
        "passed": sum(r["passed"] for r in records),
        "arrived": sum(r["arrived"] for r in sailed),
        "touched": sum(r["contacts"] > 0 for r in sailed),
        "below_floor": sum(r["below_floor"] for r in sailed),
        "with_solids": len(clear),
        "clearance_min_m": min(clear, default=None),
        "clearance_median_m": statistics.median(clear) if clear else None,
    }


def as_text(table: dict[str, Any]) -> str:
    """Return what was counted, for a terminal."""
    low, high = share_interval(table["below_floor"], table["with_solids"])
    lines = [
        (
            f"{table['voyages']} voyages: {table['passed']} passed, {table['arrived']} arrived in time, "
            f"{table['touched']} touched"
        ),
        (
            f"below the margin's floor: {table['below_floor']} of {table['with_solids']} with something to be clear of "
            f"({_percent(low)} to {_percent(high)}); longest silence {table['silence_max_s']:.1f} s"
        ),
    ]
    if table["time_share"]:
        lines.append(
            f"time, share of what the first plan promised: {' / '.join(f'{q:.2f}' for q in table['time_share'])} "
            f"(10, 50, 90 % of the {table['timed']} with one goal); later than promised: {table['later_than_promised']}"
        )
    if table["legs"]:
        lines.append(
            f"legs in the no-go zone half way, of {table['legs']} that the plan sails itself: "
            f"{table['legs_in_no_go']}, promised {table['legs_in_no_go_promised']:.1f}"
        )
    for name in ("kinds", "waters"):
        rows = table[name]
        width = max((len(row) for row in rows), default=0)
        lines.append(f"{name[:-1].ljust(width)}  voyages  arrived  touched  below floor  least m  median m")
        lines += [
            f"{row.ljust(width)}  {r['voyages']:7}  {r['arrived']:7}  {r['touched']:7}  {r['below_floor']:11}  "
            f"{_metres(r['clearance_min_m'])}  {_metres(r['clearance_median_m']):>8}"
            for row, r in rows.items()
        ]
    return "\n".join(lines)


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _metres(value: float | None) -> str:
    return f"{'-':>7}" if value is None else f"{value:7.1f}"


CAMPAIGN = "mismatch"
EXPANSIONS = 8_000
PLANNED = Variation(tables={"skipper": {"autopilot_beats": False}})
NO_GO_RAD = math.radians(45.0)  # SAIL_NO_GO_ANGLE of the simulated autopilot
# Of an arrival's promise: the first plan is for the first goal.
ONE_GOAL = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class MismatchCase:
    """Whether no beat is left to the autopilot; ``only`` as of ``draw``; ``draws`` of guidance and planner."""

    planned: bool = False
    only: tuple[str, ...] | None = None
    draws: tuple[str, ...] = ()


def job_of(seed: int, case: MismatchCase = MismatchCase(), keep: Path | None = None) -> Job[MismatchCase]:
    """Return a seed as a job."""
    return Job(scenario=draw(seed).source, seed=seed, case=case, keep=keep)


def sail(job: Job[MismatchCase]) -> dict[str, Any]:
    """Sail a seed; return what was drawn, promised and sailed."""
    return sail_drawn(draw(job.seed, only=job.case.only), job)


def sail_drawn(drawn: SampledMismatch, job: Job[MismatchCase]) -> dict[str, Any]:
    """Sail what was drawn, with what else the job's seed decides."""
    from companion.clock import run_virtual
    from sitl.run.embedded import mission_of, run_embedded

    case = job.case
    mission = mission_of(drawn.scenario, drawn.source)
    method = drawn_method(random.Random(f"method {job.seed}"), case.draws, mission)
    legs, sailing = Legs(mission.frame()), SailingTime()

    def listen(_: CompanionStatus, step: Step) -> None:
        sailing.take(step)

    record: dict[str, Any] = {
        "seed": job.seed,
        "scenario": drawn.scenario.name,
        "planned": case.planned,
        "as_planned": case.only == (),
        "kinds": list(drawn.kinds),
        "drawn": drawn.to_dict(),
        "method": method.description,
        "floor_m": mission.margin_floor_m,
    }
    with job.folder() as folder:
        try:
            verdict = run_virtual(
                run_embedded(
                    drawn.scenario,
                    drawn.source,
                    job.seed,
                    folder,
                    expansions=EXPANSIONS,
                    observer=legs,
                    on_status=listen,
                    variation=method.variation(mission, PLANNED if case.planned else None),
                )
            )
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
    names = (
        "arrived",
        "contacts",
        "tacks",
        "min_clearance_m",
        "silence_s",
        "replans",
        "promised_risk",
        "no_go_entries",
        "end_reason",
    )
    return record | {
        "passed": not faults,
        "faults": faults,
        "below_floor": is_low,
        **{name: figures[name] for name in names},
        # until she is there, as plans promise it: the judge's time ends with the run, seconds later
        "time_s": sailing.time_s or 0.0,
        "path_risk": summary.get("path_risk"),
        "alerts": summary.get("alerts", {}),
        "promised_s": time_s,
        "arrival": arrival,
        "legs": promised,
    }


def key_of(job: Job[MismatchCase]) -> Key:
    """Return what a voyage is known by."""
    case = job.case
    only = "any" if case.only is None else ", ".join(case.only)
    return job.key(planned=case.planned, only=only, **({"draws": ", ".join(case.draws)} if case.draws else {}))


def mismatch(case: MismatchCase, *, runs: int, first_seed: int) -> Experiment[MismatchCase]:
    """Return ``runs`` seeds of a case; what failed, and what was counted."""

    def line(record: dict[str, Any]) -> str | None:
        method = f" {record['method']}" if record.get("method") else ""
        return (
            None
            if record["passed"]
            else (
                f"FAILED seed {record['seed']}, {record['scenario']}{method}: {'; '.join(record['faults'])} "
                f"({', '.join(record['kinds']) or 'as planned'})"
            )
        )

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = sorted(sailed.records, key=lambda r: int(r["seed"]))
        table = figures_of(records)
        how = (" --planned" if case.planned else "") + (f" --draw {','.join(case.draws)}" if case.draws else "")
        how += " --as-planned" if case.only == () else "".join(f' --only "{kind}"' for kind in case.only or ())
        again = [
            f"again: sitl mismatch --first-seed {r['seed']}{how} --keep DIR"
            for r in records
            if not r["passed"] or r.get("below_floor")
        ]
        return ExperimentSummary(
            lines=[as_text(table), sailed.took, *again],
            figures={"figures": table, "voyages": records},
            is_good=all(r["passed"] for r in records),
        )

    return Experiment(
        name=CAMPAIGN,
        sail=sail,
        key=key_of,
        line=line,
        sum_up=sum_up,
        jobs=[job_of(seed, case) for seed in range(first_seed, first_seed + runs)],
    )

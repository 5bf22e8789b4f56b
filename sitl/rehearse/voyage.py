"""One voyage of a rehearsal: sailed on the embedded autopilot under the virtual clock, and what is kept of it."""

from __future__ import annotations

import shutil
import tempfile
from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from companion.boat import Hull
from companion.fold import Step
from companion.geo.frame import LocalFrame
from companion.messages import CompanionStatus, Mode, Severity
from companion.skipper.step import Announce
from companion.telemetry.folder import SailingTime
from sitl.autopilot import MemoryLink, SimulatedAutopilot
from sitl.rehearse.changes import CAMPAIGN, MissionChange
from sitl.rehearse.sampling import Doubts, drawn
from sitl.runner import Experiment, Job, Key, file_hash
from sitl.scenario import HullTrack

TRACK_M = 1.0  # by how much a kept track may be off the true one
UNDER_WAY_S = 2.0  # what is said when the boat sets sail is of the mission and of no place
FIGURES = (
    "arrived",
    "contacts",
    "distance_m",
    "tacks",
    "gybes",
    "min_clearance_m",
    "silence_s",
    "replans",
    "promised_risk",
    "no_go_entries",
    "end_reason",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RehearsalCase:
    """What may be unlike the plan, and perhaps something changed."""

    doubts: Doubts
    change: MissionChange | None = None

    @property
    def description(self) -> str:
        """Return the change in words; "": none."""
        return "" if self.change is None else self.change.told


@dataclass(slots=True)
class Trace:
    """Watches where a boat goes, from setting sail on; an ``Observer`` of a run."""

    frame: LocalFrame
    t_s: list[float] = field(default_factory=list)
    en_m: list[tuple[float, float]] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)

    def truth(self, t_s: float, autopilot: SimulatedAutopilot, link: MemoryLink) -> None:
        """Look at the autopilot."""
        del link
        truth = autopilot.truth
        if self.t_s or (truth.is_armed and truth.mode in {Mode.AUTO, Mode.GUIDED}):
            self.t_s.append(t_s)
            self.en_m.append(self.frame.en_from_geo(truth.position))
            self.heading_rad.append(truth.heading_rad)

    def life(self, start_s: float, end_s: float) -> None:
        """Take one life of the companion: nothing is made of it."""

    def at(self, t_s: float) -> tuple[float, float] | None:
        """Return where the boat was at a time; None before it sailed."""
        index = bisect_right(self.t_s, t_s) - 1
        return self.en_m[index] if index >= 0 else None

    def track(self) -> list[list[float]]:
        """Return the way sailed, in as few points as it needs."""
        if len(self.en_m) < 2:
            return []
        line = shapely.simplify(shapely.linestrings(self.en_m), TRACK_M)
        return [[round(x, 1), round(y, 1)] for x, y in shapely.get_coordinates(line).tolist()]

    def nearest(self, solid: Any, hull: Hull) -> list[float] | None:
        """Return where the hull came nearest to what is solid, or touched it first."""
        if not self.en_m:
            return None
        _, index = HullTrack(en_m=np.asarray(self.en_m), heading_rad=np.asarray(self.heading_rad), hull=hull).least_m(
            solid
        )
        return [round(x, 1) for x in self.en_m[index]]


def sail(job: Job[RehearsalCase]) -> dict[str, Any]:
    """Sail a voyage; return what came of it."""
    from companion.clock import run_virtual
    from companion.compose import boat_of
    from sitl.run.embedded import mission_of, run_embedded, solid_of
    from sitl.scenario import load_scenario

    base = load_scenario(job.scenario)
    mission = mission_of(base, job.scenario)
    scenario, kinds = drawn(job.seed, base, mission, job.case.doubts)
    variation = None
    change = job.case.change
    if change is not None:
        scenario, variation = change.scenario(scenario), change.variation
    trace = Trace(mission.frame())
    announced: list[tuple[float, str, Severity]] = []
    sailing = SailingTime()

    def listen(_: CompanionStatus, step: Step) -> None:
        sailing.take(step)
        announced.extend(
            (step.snapshot.t_s, action.code, action.severity) for action in step.actions if isinstance(action, Announce)
        )

    record: dict[str, Any] = {
        "seed": job.seed,
        "change": job.case.description,
        "kinds": list(kinds),
        "wind_from_deg": scenario.wind.from_deg,
        "tws_mps": scenario.wind.tws_mps,
        "wind_from_s": scenario.wind.from_s,
        "faults": sorted({event.kind for event in scenario.events}),
    }
    with tempfile.TemporaryDirectory(prefix="rehearse-") as scratch:
        folder = Path(scratch) / "voyage"
        try:
            verdict = run_virtual(
                run_embedded(
                    scenario, job.scenario, job.seed, folder, observer=trace, on_status=listen, variation=variation
                )
            )
        except Exception as error:
            return record | {"passed": False, "error": repr(error)}
        if job.keep is not None:
            shutil.copytree(folder, job.keep)
    figures = verdict.figures
    clear_m = figures["min_clearance_m"]
    is_low = clear_m is not None and clear_m < mission.margin_floor_m
    errors = next(check.figure for check in verdict.checks if check.name == "no unhandled error")
    return record | {
        "passed": bool(figures["arrived"]) and not (figures["contacts"] or is_low or errors),
        "below_floor": is_low,
        **({"error": errors[0].strip().splitlines()[-1]} if errors else {}),
        **{n: figures[n] for n in FIGURES},
        # as `companion report` tells it: the judge's ends with the run, seconds after she is there
        "time_s": sailing.time_s or 0.0,
        "alerts": dict(Counter(code for _, code, _ in announced)),
        "track": trace.track(),
        "nearest": trace.nearest(solid_of(mission.water()), boat_of(mission).hull) if is_low else None,
        "troubles": [
            [code, *(round(x, 1) for x in place)]
            for t_s, code, severity in announced
            if severity <= Severity.WARNING and (place := trace.at(t_s - UNDER_WAY_S)) is not None
        ],
    }


def rehearsal(jobs: Sequence[Job[RehearsalCase]]) -> Experiment[RehearsalCase]:
    """Return voyages of a rehearsal."""
    return Experiment(name=CAMPAIGN, jobs=jobs, sail=sail, key=key_of, is_failed=lambda record: "error" in record)


def key_of(job: Job[RehearsalCase]) -> Key:
    """Return what a voyage is known by."""
    from sitl.scenario import load_scenario

    doubts = job.case.doubts
    return {
        "mission": load_scenario(job.scenario).name,
        "hash": file_hash(job.scenario),
        "wind": doubts.wind.told,
        "doubt": doubts.boat,
        "faults": doubts.faults,
        "change": job.case.description,
        "seed": job.seed,
    }

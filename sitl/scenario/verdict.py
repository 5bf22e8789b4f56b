"""The judge: what the boat really did, against what the scenario says must hold.

Works on the truth (``sitl.scenario.true_track``) and on what the companion recorded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Hull
from companion.words import clearance_words, counted, one_line
from sitl.scenario.colregs import Judgement, judge_encounter
from sitl.scenario.scenario import ExpectSpec
from sitl.scenario.tasks import Tasks, station_score
from sitl.scenario.tasks import findings as task_findings
from sitl.scenario.true_track import TrueTrack, count_roundings, count_tacks, longest_silence_s

# A call to the anchor is for what comes within this time [s].
CALL_HOLDS_S = 600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that had to hold, with its figure."""

    name: str
    passed: bool
    figure: Any
    required: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioVerdict:
    """The outcome of one run."""

    scenario: str
    seed: int
    passed: bool
    checks: tuple[Check, ...]
    figures: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        return {
            "scenario": self.scenario,
            "seed": self.seed,
            "passed": self.passed,
            "checks": [
                {"name": c.name, "passed": c.passed, "figure": c.figure, "required": c.required} for c in self.checks
            ],
            "figures": self.figures,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """What a run is held against.

    Attributes:
        scenario: its name.
        seed: of the run.
        expect: what the scenario says must hold.
        solid: what the hull must not touch.
        hull: what touches.
        goal_en_m: the last goal.
        refuges_en_m: the mission's refuges.
        marks: to be rounded, with the side that each is left to, all laps written out.
        tasks: the mission's.
        keep_m: what the mission keeps from vessels.
        floor_m: the mission's, which the hull must keep in ordinary weather; None: not asked for.

    """

    scenario: str
    seed: int
    expect: ExpectSpec
    solid: BaseGeometry
    hull: Hull
    goal_en_m: tuple[float, float]
    refuges_en_m: Sequence[tuple[float, float]] = ()
    marks: Sequence[tuple[tuple[float, float], str]] = ()
    tasks: Tasks = field(default_factory=Tasks)
    keep_m: float = 0.0
    floor_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What the companion and the shore recorded of a run; times are the track's [s].

    Attributes:
        summary: the voyage's.
        alerts: the codes of what was announced.
        errors: what was raised and not handled.
        status_times_s: when a status came; None: not known.
        called_at_s: when the companion called its crew to the anchor; None: not known.
        ordered: the systems of other autopilots that were given orders; None: there was no other.

    """

    summary: Mapping[str, Any]
    alerts: Iterable[str] = ()
    errors: Sequence[str] = ()
    status_times_s: Sequence[float] | None = None
    called_at_s: Sequence[float] | None = None
    ordered: Sequence[int] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sailed:
    """What the true track comes to.

    Attributes:
        truth: the track, whose scenario began at ``began_s`` of its time.
        positions_m: (n, 2) east, north.
        touches: the samples at which the hull came to touch something solid.
        clearance_m: the least between hull and solid; inf: there is none.
        end_m: from the nearest place where it may end; inf: none, or nothing was sailed.
        aground: how often the keel struck; None: no bottom is known.
        silence_s: the longest stretch without a status; None: not known.
        met: the encounters with vessels that came near.

    """

    truth: TrueTrack
    began_s: float
    positions_m: NDArray[np.float64]
    touches: Sequence[int]
    clearance_m: float
    end_m: float
    aground: int | None
    silence_s: float | None
    met: Mapping[str, Judgement]

    @property
    def duration_s(self) -> float:
        """Return how long it took."""
        return self.truth.t_s[-1] - self.truth.t_s[0] if self.truth.t_s else 0.0

    @property
    def distance_m(self) -> float:
        """Return how far it was."""
        return float(np.sum(np.hypot(*np.diff(self.positions_m, axis=0).T))) if len(self.positions_m) > 1 else 0.0

    def nearest_m(self, place_en_m: tuple[float, float]) -> float:
        """Return the least distance of a sample from a place."""
        return float(np.min(np.hypot(*(self.positions_m - np.asarray(place_en_m)).T)))


def _sailed(terms: Terms, truth: TrueTrack, told: Told, began_s: float, keel_m: NDArray[np.float64] | None) -> _Sailed:
    """Return what a track comes to on these terms."""
    ends = {"goal": [terms.goal_en_m], "home": truth.en_m[:1], "refuge": terms.refuges_en_m}[terms.expect.ends_at]
    hulls = truth.hull(terms.hull)
    met = {
        name: judge_encounter(
            track,
            truth.t_s,
            truth.en_m,
            truth.heading_rad,
            truth.twd_from_rad,
            keep_m=terms.keep_m,
            our_length_m=terms.hull.length_m,
        )
        for name, track in truth.met.items()
    }
    aground = None if keel_m is None else int(np.sum(np.diff(keel_m < 0.0, prepend=False) & (keel_m < 0.0)))
    silence_s = None
    if told.status_times_s is not None and truth.t_s:
        silence_s = longest_silence_s(told.status_times_s, truth.t_s[0], truth.t_s[-1])
    return _Sailed(
        truth=truth,
        began_s=began_s,
        positions_m=truth.positions_m(),
        touches=hulls.entries(terms.solid),
        clearance_m=hulls.least_m(terms.solid)[0],
        end_m=min((math.dist(truth.en_m[-1], p) for p in ends), default=math.inf) if truth.en_m else math.inf,
        aground=aground,
        silence_s=silence_s,
        met={name: encounter for name, encounter in met.items() if encounter is not None},
    )


def _at_most(name: str, figure: float | None, limit: float) -> Check:
    """Return the check that a figure is known and no more than a limit."""
    return Check(name=name, passed=figure is not None and figure <= limit, figure=figure, required=f"at most {limit}")


def _arrival(terms: Terms, sailed: _Sailed, told: Told) -> Iterator[Check]:
    """Check where the boat came to, in which time, and what it touched and came near on its way."""
    expect, has_sailed = terms.expect, bool(sailed.truth.t_s)
    if expect.arrived is not None:
        arrived = bool(told.summary.get("arrived"))
        yield Check(name="arrived", passed=arrived == expect.arrived, figure=arrived, required=expect.arrived)
    # a boat that never sailed touched nothing and does not pass
    if expect.contacts is not None:
        yield _at_most("contacts", len(sailed.touches) if has_sailed else None, expect.contacts)
    if expect.groundings is not None and sailed.aground is not None:
        yield _at_most("groundings", sailed.aground if has_sailed else None, expect.groundings)
    if expect.within_m is not None:
        yield _at_most(f"distance to the {expect.ends_at}, m", sailed.end_m, expect.within_m)
    if expect.refuge_within_m is not None:
        nearest_m = min((sailed.nearest_m(place) for place in terms.refuges_en_m), default=math.inf)
        yield _at_most("nearest to a refuge, m", nearest_m, expect.refuge_within_m)
    if expect.max_time_s is not None:
        yield _at_most("time, s", sailed.duration_s, expect.max_time_s)
    floor_m = terms.floor_m if has_sailed else None
    least_m = max((m for m in (expect.min_clearance_m, floor_m) if m is not None), default=None)
    if least_m is not None:
        figure = sailed.clearance_m if has_sailed else None
        is_kept = figure is not None and figure >= least_m
        yield Check(name="clearance, m", passed=is_kept, figure=figure, required=f"at least {least_m}")


def _vessels(terms: Terms, sailed: _Sailed) -> Iterator[Check]:
    """Check what was kept from other vessels, by the rules of the road, and what the second boat did."""
    expect, truth = terms.expect, sailed.truth
    if expect.min_vessel_distance_m is not None:
        nearest_m = min(truth.vessels_m.values(), default=-math.inf)  # nothing measured does not pass
        yield Check(
            name="distance to vessels, m",
            passed=nearest_m >= expect.min_vessel_distance_m,
            figure=truth.vessels_m,
            required=f"at least {expect.min_vessel_distance_m}",
        )
    if expect.rules_kept is not None:
        faults = [f"{name}: {fault}" for name, encounter in sailed.met.items() for fault in encounter.faults]
        is_kept = bool(sailed.met) and (not faults) == expect.rules_kept
        yield Check(name="rules of the road", passed=is_kept, figure=faults, required="kept")
    if expect.second_boat_within_m is not None:
        name = "the second boat's distance to its goal, m"
        yield _at_most(name, truth.second_boat_m, expect.second_boat_within_m)


def _handling(terms: Terms, sailed: _Sailed, told: Told) -> Iterator[Check]:
    """Check how the boat was handled: a station kept, silence, plans made again, tacks, holding, how it ended."""
    expect, truth, positions_m = terms.expect, sailed.truth, sailed.positions_m
    if expect.station_radius_m is not None:
        track = np.column_stack([truth.t_s, positions_m]) if truth.t_s else np.zeros((0, 3))
        score = station_score(track, terms.goal_en_m)
        check = _at_most("station keeping: radius of 95 %, m", score.radius95_m, expect.station_radius_m)
        yield replace(check, passed=check.passed and score.kept)
    if expect.max_silence_s is not None and sailed.silence_s is not None:
        yield _at_most("silence, s", sailed.silence_s, expect.max_silence_s)
    if expect.max_replans_per_hour is not None and sailed.duration_s > 0.0:
        rate = float(told.summary.get("replans", 0)) * 3600.0 / sailed.duration_s
        yield _at_most("replans per hour", rate, expect.max_replans_per_hour)
    if expect.max_tacks is not None:
        # past the goal the autopilot does as it likes: a loiter may tack
        there = np.flatnonzero(np.hypot(*(positions_m - terms.goal_en_m).T) <= (expect.within_m or 0.0))
        on_the_way, _ = count_tacks(truth, int(there[0]) if len(there) else None)
        yield _at_most("tacks on the way", on_the_way, expect.max_tacks)
    if expect.held is not None:
        stay = positions_m[[expect.held.from_s <= t - sailed.began_s <= expect.held.to_s for t in truth.t_s]]
        radius_m = float(np.max(np.hypot(*(stay - stay.mean(axis=0)).T))) if len(stay) else None
        yield _at_most("held within, m", radius_m, expect.held.within_m)
    if expect.end_phase is not None:
        phase = told.summary.get("end_phase")
        yield Check(name="end phase", passed=phase == expect.end_phase, figure=phase, required=expect.end_phase)


def _course(terms: Terms, sailed: _Sailed, seen: set[str]) -> Iterator[Check]:
    """Check the marks, rounded and not sailed over, and the tasks of a course."""
    expect, positions_m = terms.expect, sailed.positions_m
    if terms.marks and len(positions_m):
        near_m = min(sailed.nearest_m(mark) for mark, _ in terms.marks)
        required = f"more than {expect.marks_clear_m}"
        is_clear = near_m > expect.marks_clear_m
        yield Check(name="nearest to a mark, m", passed=is_clear, figure=near_m, required=required)
    if expect.marks_rounded is not None:
        rounded = count_roundings(positions_m, terms.marks)
        is_all = rounded == expect.marks_rounded
        yield Check(name="marks rounded", passed=is_all, figure=rounded, required=expect.marks_rounded)
    for name, passed, figure, required in task_findings(expect, terms.tasks, sailed.truth.t_s, positions_m, seen):
        yield Check(name=name, passed=passed, figure=figure, required=required)


def _crew(terms: Terms, sailed: _Sailed, told: Told, seen: set[str]) -> Iterator[Check]:
    """Check what was said to whom: calls to the crew, orders to other autopilots, what was announced."""
    expect, t_s = terms.expect, sailed.truth.t_s
    if expect.called_s is not None and told.called_at_s is not None:
        ahead_s = [
            max((t_s[i] - t for t in told.called_at_s if 0.0 <= t_s[i] - t <= CALL_HOLDS_S), default=0.0)
            for i in sailed.touches
        ]
        yield Check(
            name="called before a contact, s",
            passed=all(s >= expect.called_s for s in ahead_s),
            figure=ahead_s,
            required=f"at least {expect.called_s}",
        )
    if told.ordered is not None:
        yield Check(name="neighbours given orders", passed=not told.ordered, figure=list(told.ordered), required=[])
    for code in expect.alerts:
        yield Check(name=f"announced {code}", passed=code in seen, figure=sorted(seen), required=code)


def judge(
    terms: Terms, truth: TrueTrack, told: Told, *, began_s: float = 0.0, keel_m: NDArray[np.float64] | None = None
) -> ScenarioVerdict:
    """Hold a run against its terms.

    The scenario's beginning is ``began_s`` in the track's time; ``keel_m`` is the room under the keel along the track,
    None where no bottom is known.
    """
    sailed, seen = _sailed(terms, truth, told, began_s, keel_m), set(told.alerts)
    checks = (
        Check(name="no unhandled error", passed=not told.errors, figure=list(told.errors), required=[]),
        *_arrival(terms, sailed, told),
        *_vessels(terms, sailed),
        *_handling(terms, sailed, told),
        *_course(terms, sailed, seen),
        *_crew(terms, sailed, told, seen),
    )
    tacks, gybes = count_tacks(truth)
    figures: dict[str, Any] = {
        "arrived": bool(told.summary.get("arrived")),
        "contacts": len(sailed.touches),
        "time_s": sailed.duration_s,
        "distance_m": sailed.distance_m,
        "tacks": tacks,
        "gybes": gybes,
        "min_clearance_m": sailed.clearance_m if math.isfinite(sailed.clearance_m) else None,
        "vessel_distances_m": truth.vessels_m,
        "encounters": [encounter.to_dict() for encounter in sailed.met.values()],
        "end_distance_m": sailed.end_m,
        "silence_s": sailed.silence_s,
    }
    for key in ("replans", "promised_clearance_m", "promised_risk", "no_go_entries", "end_reason"):
        figures[key] = told.summary.get(key)
    if keel_m is not None:
        figures |= {"groundings": sailed.aground, "min_under_keel_m": float(keel_m.min(initial=math.inf))}
    return ScenarioVerdict(
        scenario=terms.scenario, seed=terms.seed, passed=all(c.passed for c in checks), checks=checks, figures=figures
    )


def verdict_line(record: Mapping[str, Any]) -> str:
    """Return a verdict's record in one line: what voyage it was, and its figures or why there are none."""
    f = record["figures"]
    if f:
        words = (
            f"{f['time_s']:.0f} s, {f['distance_m']:.0f} m and {counted(f['tacks'], 'tack')} by the true track, "
            "from arming to the run's end, "
            f"{counted(f['replans'], 'replan')}, "
        )
        if f["min_clearance_m"] is not None:
            words += f"clearance {f['min_clearance_m']:.1f} m"
        else:
            words += "no obstacle or fence" if f["time_s"] > 0.0 else "no clearance: she never set sail"
        if f["min_clearance_m"] is not None and f.get("promised_clearance_m") is not None:
            least_m = f["promised_clearance_m"]
            words += f" ({'promised' if least_m >= 0.0 else 'a plan began'} {clearance_words(least_m)})"
        if f.get("min_under_keel_m") is not None:
            aground = f", {counted(f['groundings'], 'grounding')}" if f["groundings"] else ""
            words += f", {f['min_under_keel_m']:.1f} m under the keel{aground}"
    else:
        words = "; ".join(f"{check['name']}: {check['figure']}" for check in record["checks"] if not check["passed"])
    outcome = "PASSED" if record["passed"] else "FAILED"
    return one_line(f"{outcome}  {record['scenario']} seed {record['seed']}: {words}")

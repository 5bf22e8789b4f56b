"""The judge: what the boat really did, against what the scenario says must hold.

Works on the truth (where the boat was, not where anybody believed it was) and on what the companion recorded.

The track is looked at between its samples too: the hull's outlines of two of them and all that lies between them.
Only what is near enough to matter is drawn.

WRSC 2018: within 20 m for 5 minutes from the first point inside; the score is the radius of the circle about the
mean position that holds 95 % of the points, per boat length; the mean must be within 20 m. WRSC 2019: the mean
distance, 15 m, and sqrt(1 + N) for N touches of a buoy. SailBot: a box of 40 m, 2 points a minute up to 10, -2 a
minute after 5.5 minutes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Hull, outline_en_m
from companion.current import TideTable
from companion.skipper.way import DryingWater
from companion.words import clearance_words, counted, one_line
from sitl.scenario.colregs import Met, judge_encounter
from sitl.scenario.scenario import ExpectSpec
from sitl.scenario.tasks import Tasks
from sitl.scenario.tasks import findings as task_findings
from sitl.world import Seabed


@dataclass(frozen=True, slots=True, kw_only=True)
class HullTrack:
    """Where a hull was.

    Attributes:
        en_m: (n, 2) places amidships, east north [m].
        heading_rad: (n,) true headings.
        hull: Its size.

    """

    en_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    hull: Hull

    def entries(self, solid: BaseGeometry) -> list[int]:
        """Return the samples at which the hull came to touch ``solid``, having been clear at the one before."""
        if solid.is_empty or len(self.en_m) == 0:
            return []
        shapely.prepare(solid)
        points_m = shapely.distance(solid, shapely.points(self.en_m))
        step_m = np.concatenate([[0.0], np.hypot(*np.diff(self.en_m, axis=0).T)])
        touches = np.zeros(len(self.en_m), dtype=bool)
        near = np.flatnonzero(points_m <= self.hull.reach_m + step_m)
        if near.size:
            touches[near] = shapely.intersects(solid, self._swept(near))
        return [int(i) for i in np.flatnonzero(touches & ~np.concatenate([[False], touches[:-1]]))]

    def least_m(self, solid: BaseGeometry) -> tuple[float, int]:
        """Return the outline's smallest distance to ``solid`` [m], 0 on contact, and at which sample; inf without."""
        if solid.is_empty or len(self.en_m) == 0:
            return math.inf, 0
        shapely.prepare(solid)
        points_m = np.asarray(shapely.distance(solid, shapely.points(self.en_m)))
        # No outline is nearer than its middle less its reach: the others cannot be the nearest.
        near = np.flatnonzero(points_m <= points_m.min() + 2.0 * self.hull.reach_m)
        outlines_m = np.asarray(shapely.distance(solid, self._outlines(near)))
        best = int(np.argmin(outlines_m))
        touched = self.entries(solid)
        return (0.0, touched[0]) if touched else (float(outlines_m[best]), int(near[best]))

    def _outlines(self, which: NDArray[np.intp]) -> NDArray[np.object_]:
        return np.asarray(shapely.polygons(outline_en_m(self.hull, self.en_m[which], self.heading_rad[which])))

    def _swept(self, which: NDArray[np.intp]) -> NDArray[np.object_]:
        """Return what the hull covered from the sample before each of ``which`` to it."""
        before = np.maximum(which - 1, 0)
        corners = np.concatenate(
            [outline_en_m(self.hull, self.en_m[i], self.heading_rad[i])[:, :4] for i in (before, which)], axis=1
        )
        return np.asarray(shapely.convex_hull(shapely.multipoints(corners)))


TASK_S = 300.0
SAILBOT_HALF_M = 20.0
SAILBOT_MINUTES_FREE = 5.5


@dataclass(frozen=True, slots=True, kw_only=True)
class StationScore:
    """The scores of one track; distances in metres."""

    kept: bool  # WRSC 2018: five minutes were sailed and their mean position is within the radius
    radius95_m: float  # WRSC 2018: about the mean position
    lengths: float  # WRSC 2018: that per boat length
    mean_m: float  # WRSC 2019: mean distance to the point
    sailbot: float  # SailBot: points, 10 at best, left out of the box in time
    farthest_m: float


def station_score(
    track: NDArray[np.float64], point_en: tuple[float, float], *, radius_m: float = 20.0, length_m: float = 1.0
) -> StationScore:
    """Score the five minutes from the first point inside.

    Args:
        track: (n, 3) or wider: t [s], east, north [m].
        point_en: the station.
        radius_m: of the task's circle.
        length_m: of the boat.

    """
    d = np.hypot(track[:, 1] - point_en[0], track[:, 2] - point_en[1])
    inside = np.flatnonzero(d <= radius_m)
    if not inside.size:
        return StationScore(
            kept=False,
            radius95_m=math.inf,
            lengths=math.inf,
            mean_m=math.inf,
            sailbot=0.0,
            farthest_m=float(d.max(initial=math.inf)),
        )
    begin = float(track[inside[0], 0])
    during = (track[:, 0] >= begin) & (track[:, 0] <= begin + TASK_S)
    p = track[during, 1:3]
    mean = p.mean(axis=0)
    # The organisers' rule: the farthest of the nearest 95 % of the points, their number rounded.
    apart = np.sort(np.hypot(p[:, 0] - mean[0], p[:, 1] - mean[1]))
    radius95 = float(apart[max(0, round(0.95 * len(apart)) - 1)])
    long_enough = float(track[during, 0][-1]) - begin >= TASK_S - 1.5
    return StationScore(
        kept=long_enough and math.dist((float(mean[0]), float(mean[1])), point_en) < radius_m,
        radius95_m=radius95,
        lengths=radius95 / length_m,
        mean_m=float(d[during].mean()),
        sailbot=sailbot_points(track, point_en),
        farthest_m=float(d[during].max()),
    )


def sailbot_points(track: NDArray[np.float64], point_en: tuple[float, float]) -> float:
    """Return SailBot's points: 2 per minute inside the box up to 10, -2 per minute inside after 5.5 minutes.

    The track counts from its first point inside; minutes outside are not counted.
    """
    inside = np.max(np.abs(track[:, 1:3] - np.asarray(point_en)), axis=1) <= SAILBOT_HALF_M
    if not inside.any():
        return 0.0
    t = track[:, 0] - track[int(np.argmax(inside)), 0]
    dt = np.diff(t, append=t[-1])
    free = SAILBOT_MINUTES_FREE * 60.0
    early = float(np.sum(dt[inside & (t >= 0.0) & (t < TASK_S)])) / 60.0
    late = float(np.sum(dt[inside & (t >= free)])) / 60.0
    return max(0.0, min(10.0, 2.0 * early) - 2.0 * late)


# A call to the anchor is for what comes within this time [s].
CALL_HOLDS_S = 600.0
# A tack is counted when the boat has been on the other side of the wind for this long.
TACK_SETTLED_S = 3.0


@dataclass(slots=True)
class TrueTrack:
    """The true track, sampled at a fixed rate from setting sail on."""

    t_s: list[float] = field(default_factory=list)
    en_m: list[tuple[float, float]] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)
    speed_mps: list[float] = field(default_factory=list)
    twd_from_rad: list[float] = field(default_factory=list)
    tws_mps: list[float] = field(default_factory=list)
    vessels_m: dict[str, float] = field(default_factory=dict)  # the least distance to each vessel's hull
    met: dict[str, Met] = field(default_factory=dict)  # the tracks of those who met us
    second_boat_m: float | None = None  # the second boat's least distance to its goal

    def add(
        self, t_s: float, en_m: tuple[float, float], heading_rad: float, speed_mps: float, wind: tuple[float, float]
    ) -> None:
        """Append one sample."""
        self.t_s.append(t_s)
        self.en_m.append(en_m)
        self.heading_rad.append(heading_rad)
        self.speed_mps.append(speed_mps)
        self.twd_from_rad.append(wind[0])
        self.tws_mps.append(wind[1])

    def positions_m(self) -> NDArray[np.float64]:
        """Return (n, 2) east, north [m]."""
        return np.asarray(self.en_m, dtype=np.float64).reshape(-1, 2)

    def hull(self, hull: Hull) -> HullTrack:
        """Return the track of a hull that was there."""
        return HullTrack(en_m=self.positions_m(), heading_rad=np.asarray(self.heading_rad, dtype=np.float64), hull=hull)


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


def count_tacks(truth: TrueTrack, until: int | None = None) -> tuple[int, int]:
    """Return (tacks, gybes): settled changes of the side that the wind comes from, in the first ``until`` samples."""
    tacks = gybes = 0
    side = 0
    pending = 0
    since_s = -math.inf
    deepest = last_twa = 0.0
    samples = zip(truth.t_s, truth.heading_rad, truth.twd_from_rad, strict=True)
    for t_s, heading, wind in itertools.islice(samples, until):
        twa = (heading - wind + math.pi) % (2.0 * math.pi) - math.pi
        now = 1 if twa > 0.0 else -1
        if side == 0:
            side = now
        if now == side:
            pending, deepest = 0, 0.0
            last_twa = abs(twa)
            continue
        if pending == 0:
            pending, since_s = now, t_s
            deepest = min(abs(twa), last_twa)
        if t_s - since_s >= TACK_SETTLED_S:
            if deepest < math.pi / 2.0:
                tacks += 1
            else:
                gybes += 1
            side, pending = now, 0
    return tacks, gybes


# A mark is being rounded while the boat is this near [m]; its bearing from the mark must turn by this much [rad].
ROUNDING_M = 60.0
ROUNDING_RAD = math.radians(45.0)


def count_roundings(positions_m: NDArray[np.float64], marks: Sequence[tuple[tuple[float, float], str]]) -> int:
    """Return how many of ``marks`` the track rounds in their order, each left to its side.

    A mark left to port is passed counter-clockwise: seen from it, the boat's bearing turns left.

    Args:
        positions_m: (n, 2) east, north [m].
        marks: position [m] and "port" or "starboard", in the order of the course, laps written out.
    """
    rounded, at = 0, 0
    for mark, side in marks:
        offset = positions_m[at:] - np.asarray(mark)
        # A board that only comes near, and a miss that is sailed again, are followed by the rounding itself.
        near = _stretches(np.hypot(offset[:, 0], offset[:, 1]) < ROUNDING_M)
        if not near:
            break
        ends = [end for first, end in near if _turned_rad(offset[first:end], side) >= ROUNDING_RAD]
        rounded += bool(ends)
        at += ends[0] if ends else near[0][1]
    return rounded


def _turned_rad(offset_m: NDArray[np.float64], side: str) -> float:
    """Return how far the bearing from a mark turns the way it should for its side [rad]."""
    bearing = np.unwrap(np.arctan2(offset_m[:, 0], offset_m[:, 1]))
    return float(bearing[-1] - bearing[0]) * (-1.0 if side == "port" else 1.0)


def _stretches(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where ``holds`` is true without a break, as (first, behind the last)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], holds, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def longest_silence_s(status_times_s: Sequence[float], start_s: float, end_s: float) -> float:
    """Return the longest stretch without a status [s]."""
    times = [start_s, *[t for t in status_times_s if start_s <= t <= end_s], end_s]
    return max((b - a for a, b in itertools.pairwise(times)), default=0.0)


FINE_M = 1.0  # between two looks at the bottom


def under_keel_m(truth: TrueTrack, seabed: Seabed, draft_m: float, began_s: float = 0.0) -> NDArray[np.float64]:
    """Return the room under a keel amidships all along a track, between its samples too [m]; negative: aground.

    The scenario, whose tide it is, began at ``began_s`` of the track's time.
    """
    places, t_s = truth.positions_m(), np.asarray(truth.t_s, dtype=np.float64)
    if len(places) == 0:
        return np.zeros(0)
    pieces = np.maximum(1, np.ceil(np.hypot(*np.diff(places, axis=0).T) / FINE_M)).astype(np.intp)
    first = np.repeat(np.arange(len(pieces)), pieces)
    share = np.arange(len(first)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    at = np.append(first + share / pieces[first], len(places) - 1.0)
    samples = np.arange(len(places))
    fine = np.column_stack([np.interp(at, samples, places[:, axis]) for axis in (0, 1)])
    return seabed.depth_m(fine, np.interp(at, samples, t_s) - began_s) - draft_m


def over_drying_m(
    truth: TrueTrack, waters: Sequence[DryingWater], table: TideTable, under_keel_m: float, epoch_s: float
) -> NDArray[np.float64] | None:
    """Return the room under a keel by the chart where a track is in water that dries [m]; None: it is nowhere in it.

    It is negative at its hours. ``epoch_s`` is the Unix time at 0 of the track's time.
    """
    places, room = truth.positions_m(), []
    for water in waters:
        for n in np.flatnonzero(shapely.contains_xy(water.polygon, places[:, 0], places[:, 1])).tolist():
            height_m = table.height_m(epoch_s + truth.t_s[n])
            room.append(-math.inf if height_m is None else water.room_m(height_m) + under_keel_m)
    return np.asarray(room) if room else None


def judge(
    *,
    scenario: str,
    seed: int,
    expect: ExpectSpec,
    truth: TrueTrack,
    solid: BaseGeometry,
    hull: Hull,
    goal_en_m: tuple[float, float],
    summary: dict[str, Any],
    status_times_s: Sequence[float] | None,
    alerts: Iterable[str],
    errors: Sequence[str] = (),
    marks: Sequence[tuple[tuple[float, float], str]] = (),
    refuges_en_m: Sequence[tuple[float, float]] = (),
    floor_m: float | None = None,
    called_at_s: Sequence[float] | None = None,
    ordered: Sequence[int] | None = None,
    began_s: float = 0.0,
    tasks: Tasks | None = None,
    keep_m: float = 0.0,
    keel_m: NDArray[np.float64] | None = None,
) -> ScenarioVerdict:
    """Hold a run against what its scenario expects.

    ``hull`` is what touches. ``floor_m`` is the mission's, which the hull must keep in ordinary weather; None: not
    asked for. ``called_at_s`` is when the companion called its crew to the anchor, None where that is not known.
    ``ordered`` are the systems of other autopilots that were given orders, None where there was no other. The
    scenario's beginning is ``began_s`` in the track's time; ``tasks`` are the mission's, ``keep_m`` what it keeps from
    vessels. ``keel_m`` is the room under the keel along the track, None where no bottom is known.
    """
    ends = {"goal": [goal_en_m], "home": truth.en_m[:1], "refuge": refuges_en_m}[expect.ends_at]
    positions = truth.positions_m()
    hulls = truth.hull(hull)
    touches, clearance = hulls.entries(solid), hulls.least_m(solid)[0]
    contacts = len(touches)
    tacks, gybes = count_tacks(truth)
    end_distance = min((math.dist(truth.en_m[-1], p) for p in ends), default=math.inf) if truth.en_m else math.inf
    duration_s = truth.t_s[-1] - truth.t_s[0] if truth.t_s else 0.0
    sailed_m = float(np.sum(np.hypot(*np.diff(positions, axis=0).T))) if len(positions) > 1 else 0.0
    silence_s = None
    if status_times_s is not None and truth.t_s:
        silence_s = longest_silence_s(status_times_s, truth.t_s[0], truth.t_s[-1])
    seen = set(alerts)
    checks: list[Check] = [Check(name="no unhandled error", passed=not errors, figure=list(errors), required=[])]

    def check(name: str, passed: bool, figure: Any, required: Any) -> None:
        checks.append(Check(name=name, passed=passed, figure=figure, required=required))

    arrived = bool(summary.get("arrived"))
    if expect.arrived is not None:
        check("arrived", arrived == expect.arrived, arrived, expect.arrived)
    if expect.contacts is not None:
        # a boat that never sailed touched nothing and does not pass
        check(
            "contacts",
            bool(truth.t_s) and contacts <= expect.contacts,
            contacts if truth.t_s else None,
            f"at most {expect.contacts}",
        )
    aground = 0 if keel_m is None else int(np.sum(np.diff(keel_m < 0.0, prepend=False) & (keel_m < 0.0)))
    if expect.groundings is not None and keel_m is not None:
        check(
            "groundings",
            bool(truth.t_s) and aground <= expect.groundings,
            aground if truth.t_s else None,
            f"at most {expect.groundings}",
        )
    if expect.within_m is not None:
        check(
            f"distance to the {expect.ends_at}, m",
            end_distance <= expect.within_m,
            end_distance,
            f"at most {expect.within_m}",
        )
    if expect.refuge_within_m is not None:
        nearest = min((float(np.min(np.hypot(*(positions - p).T))) for p in refuges_en_m), default=math.inf)
        check("nearest to a refuge, m", nearest <= expect.refuge_within_m, nearest, f"at most {expect.refuge_within_m}")
    if expect.max_time_s is not None:
        check("time, s", duration_s <= expect.max_time_s, duration_s, f"at most {expect.max_time_s}")
    least_m = max((m for m in (expect.min_clearance_m, floor_m) if m is not None), default=None)
    if least_m is not None:
        check("clearance, m", clearance >= least_m, clearance, f"at least {least_m}")
    if expect.min_vessel_distance_m is not None:
        nearest = min(truth.vessels_m.values(), default=-math.inf)  # nothing measured does not pass
        check(
            "distance to vessels, m",
            nearest >= expect.min_vessel_distance_m,
            truth.vessels_m,
            f"at least {expect.min_vessel_distance_m}",
        )
    met = {
        name: found
        for name, track in truth.met.items()
        if (
            found := judge_encounter(
                track,
                truth.t_s,
                truth.en_m,
                truth.heading_rad,
                truth.twd_from_rad,
                keep_m=keep_m,
                our_length_m=hull.length_m,
            )
        )
        is not None
    }
    if expect.rules_kept is not None:
        faults = [f"{name}: {fault}" for name, found in met.items() for fault in found.faults]
        check("rules of the road", bool(met) and (not faults) == expect.rules_kept, faults, "kept")
    if expect.second_boat_within_m is not None:
        nearest_m = truth.second_boat_m
        check(
            "the second boat's distance to its goal, m",
            nearest_m is not None and nearest_m <= expect.second_boat_within_m,
            nearest_m,
            f"at most {expect.second_boat_within_m}",
        )
    if expect.station_radius_m is not None:
        track = np.column_stack([truth.t_s, positions]) if truth.t_s else np.zeros((0, 3))
        score = station_score(track, goal_en_m)
        check(
            "station keeping: radius of 95 %, m",
            score.kept and score.radius95_m <= expect.station_radius_m,
            score.radius95_m,
            f"at most {expect.station_radius_m}",
        )
    if expect.max_silence_s is not None and silence_s is not None:
        check("silence, s", silence_s <= expect.max_silence_s, silence_s, f"at most {expect.max_silence_s}")
    if expect.max_replans_per_hour is not None and duration_s > 0.0:
        rate = float(summary.get("replans", 0)) * 3600.0 / duration_s
        check("replans per hour", rate <= expect.max_replans_per_hour, rate, f"at most {expect.max_replans_per_hour}")
    if expect.max_tacks is not None:
        # past the goal the autopilot does as it likes: a loiter may tack
        there = np.flatnonzero(np.hypot(*(positions - goal_en_m).T) <= (expect.within_m or 0.0))
        on_the_way, _ = count_tacks(truth, int(there[0]) if len(there) else None)
        check("tacks on the way", on_the_way <= expect.max_tacks, on_the_way, f"at most {expect.max_tacks}")
    if expect.held is not None:
        stay = positions[[expect.held.from_s <= t - began_s <= expect.held.to_s for t in truth.t_s]]
        radius_m = float(np.max(np.hypot(*(stay - stay.mean(axis=0)).T))) if len(stay) else None
        check(
            "held within, m",
            radius_m is not None and radius_m <= expect.held.within_m,
            radius_m,
            f"at most {expect.held.within_m}",
        )
    if expect.end_phase is not None:
        check("end phase", summary.get("end_phase") == expect.end_phase, summary.get("end_phase"), expect.end_phase)
    if marks and len(positions):
        near_m = min(float(np.min(np.hypot(*(positions - np.asarray(mark)).T))) for mark, _ in marks)
        check("nearest to a mark, m", near_m > expect.marks_clear_m, near_m, f"more than {expect.marks_clear_m}")
    if expect.marks_rounded is not None:
        rounded = count_roundings(positions, marks)
        check("marks rounded", rounded == expect.marks_rounded, rounded, expect.marks_rounded)
    for finding in task_findings(expect, tasks or Tasks(), truth.t_s, positions, seen):
        check(*finding)
    if expect.called_s is not None and called_at_s is not None:
        ahead_s = [
            max((truth.t_s[i] - t for t in called_at_s if 0.0 <= truth.t_s[i] - t <= CALL_HOLDS_S), default=0.0)
            for i in touches
        ]
        check(
            "called before a contact, s",
            all(s >= expect.called_s for s in ahead_s),
            ahead_s,
            f"at least {expect.called_s}",
        )
    if ordered is not None:
        check("neighbours given orders", not ordered, list(ordered), [])
    for code in expect.alerts:
        check(f"announced {code}", code in seen, sorted(seen), code)
    return ScenarioVerdict(
        scenario=scenario,
        seed=seed,
        passed=all(c.passed for c in checks),
        checks=tuple(checks),
        figures={
            "arrived": arrived,
            "contacts": contacts,
            "time_s": duration_s,
            "distance_m": sailed_m,
            "tacks": tacks,
            "gybes": gybes,
            "min_clearance_m": clearance if math.isfinite(clearance) else None,
            "vessel_distances_m": truth.vessels_m,
            "encounters": [found.to_dict() for found in met.values()],
            "end_distance_m": end_distance,
            "silence_s": silence_s,
            "replans": summary.get("replans"),
            "promised_clearance_m": summary.get("promised_clearance_m"),
            "promised_risk": summary.get("promised_risk"),
            "no_go_entries": summary.get("no_go_entries"),
            "end_reason": summary.get("end_reason"),
            **(
                {}
                if keel_m is None
                else {"groundings": aground, "min_under_keel_m": float(keel_m.min(initial=math.inf))}
            ),
        },
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
        words += "nothing to be clear of" if f["min_clearance_m"] is None else f"clearance {f['min_clearance_m']:.1f} m"
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

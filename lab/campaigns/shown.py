"""What a screen shows, held against what came: every figure of the views of whole voyages, scored.

Each voyage is sailed on the embedded autopilot under the virtual clock and its records are folded into views again, as
``companion view`` does; nothing is reckoned anew here. A moment in ``EVERY_S`` counts while the boat is being sailed.
"""

from __future__ import annotations

import math
import statistics
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from sitl.runner import SCENARIO_FOLDER, CampaignResults, Experiment, ExperimentSummary, Job, Key, file_hash

EVERY_S = 2.0
AHEAD_S = (10, 30, 60, 120)  # the places that are scored
LEFT_S = (0.0, 30.0, 60.0, 120.0, 300.0, math.inf)  # classes of what is left until the goal
TACK_WITHIN_S = 60.0  # a tack that is told for later is no promise yet
TACK_OFF_S = 5.0  # a tack that comes so near to its time holds
TACK_HOLDS_S = 4.0  # a tack that is kept for less was the sea
WIND_S = (60.0, 120.0, 300.0)
WIND_MEAN_S = 10.0  # the wind that came is the mean of so long: a vane trembles
LEVEL = 0.8  # of the wind's bands that are scored
FORCED = frozenset({"plan asked for: no go", "plan asked for: off leg"})  # the log's words: she is forced off the plan
POLAR_OFF = 0.1  # a boat that is the polar's sails within so much of it
CHORD_S = 5.0  # the way that is held against the log is measured in such chords: fixes tremble
WAY_OFF = 0.05  # a way that is so near to it holds
SCENARIOS = tuple(
    SCENARIO_FOLDER / f"{name}.toml"
    for name in (
        "demo",
        "two-channels",
        "upwind",
        "downwind",
        "narrow-channel",
        "current-across",
        "figures/slalom",
        "figures/beat-500",
    )
)


def sail(job: Job[bool]) -> dict[str, Any]:
    """Sail a job, in the case True with what ``sitl mismatch`` draws; return what was shown beside what came."""
    from companion.clock import run_virtual
    from lab.campaigns.drawn_mismatch import draw
    from sitl.run.embedded import run_embedded
    from sitl.scenario import load_scenario

    scenario = draw(job.seed).scenario if job.case else load_scenario(job.scenario)
    with job.folder() as folder:
        run_virtual(run_embedded(scenario, job.scenario, job.seed, folder))
        record = {"scenario": _name(job), "seed": job.seed, **scored(folder)}
    # what a boat makes of its polar is known of one that is the polar's
    return {**record, "polar": []} if job.case else record


def _name(job: Job[bool]) -> str:
    return "mismatch" if job.case else job.scenario.stem


def scored(folder: Path) -> dict[str, Any]:
    """Return the figures of a recorded voyage beside what came, as lists of pairs and triples."""
    from companion.view import recorded_views

    moments = list(recorded_views(folder).moments)
    views = [view for view, _ in moments]
    times = [view.t_s for view in views]
    goals = [view.figures.goals_reached or 0 for view in views]
    reached_s = [next(t for t, n in zip(times, goals, strict=True) if n >= k) for k in range(1, max(goals) + 1)]
    places = [view.boat.at_en_m for view in views]
    tacks_s = tacked_s(times, [view.boat.tack for view in views])
    out: dict[str, list[Any]] = {"there": [], "tack": [], "wind": [], "place": [], "clear": [], "polar": []}
    forced_s = [view.t_s for view, events in moments if any(event.title in FORCED for event in events)]
    last_s = -math.inf
    for view in views:
        plan = view.plan
        if not view.state.is_sailing or view.state.is_over or plan is None or view.t_s - last_s < EVERY_S:
            continue
        last_s, goal = view.t_s, view.figures.goals_reached or 0
        if plan.there_s is not None and plan.there_late_s is not None and goal < len(reached_s):
            out["there"].append([round(reached_s[goal] - view.t_s, 1), plan.there_s, plan.there_late_s])
        following = tacks_s[bisect_right(tacks_s, view.t_s) :]
        if plan.next_tack_s is not None and plan.next_tack_s <= TACK_WITHIN_S:
            came_s = round(following[0] - view.t_s, 1) if following else None
            out["tack"].append([plan.next_tack_s, came_s, bool(plan.next_tack_is_planned)])
        for ahead_s in AHEAD_S:
            told, came = _at(view.predicted, float(ahead_s)), _near(times, places, view.t_s + ahead_s)
            if told is not None and came is not None:
                out["place"].append([ahead_s, round(math.dist(told[0], came), 1), round(told[1], 1)])
        bands = () if view.wind is None else view.wind.bands
        for band in bands:
            came_deg = _wind_deg(times, views, view.t_s + band.horizon_s) if band.horizon_s in WIND_S else None
            if came_deg is not None and view.wind is not None:
                off_deg = abs(math.remainder(came_deg - band.twd_from_deg, 360.0))
                out["wind"].append([band.horizon_s, off_deg <= band.half_deg[view.wind.levels.index(LEVEL)]])
        if plan.expected_clearance_m is not None and view.boat.clearance_m is not None:
            out["clear"].append([plan.number, plan.expected_clearance_m, view.boat.clearance_m])
        if (share := None if view.polar is None else view.polar.live_share()) is not None:
            out["polar"].append(round(share, 3))
    end = views[-1].figures
    return {
        **out,
        "clear": _least(out["clear"]),
        "legs": _leg_risks(views, forced_s),
        "whole": _plan_risks(views, reached_s, forced_s),
        "way": [[end.distance_m, _way_m(times, places)]],
        "turns": [_turns(views, tacks_s)],
    }


def _turns(views: Sequence[Any], tacks_s: Sequence[float]) -> list[int]:
    """Return how many tacks and gybes were counted under way, and how many there were."""
    sailed = [view for view in views if view.state.is_sailing and not view.state.is_over]
    if not sailed:
        return [0, 0]
    end = sailed[-1]
    # one that has just been made is not yet seen to be kept
    came = sum(sailed[0].t_s <= t_s <= end.t_s - TACK_HOLDS_S for t_s in tacks_s)
    return [(end.figures.tacks or 0) + (end.figures.gybes or 0), came]


def _leg_risks(views: Sequence[Any], forced_s: Sequence[float]) -> list[list[Any]]:
    """Return, for each leg that was begun, the chance that was told then, and whether she was forced off it."""
    begun: list[tuple[float, float | None]] = []
    leg, last_s = None, 0.0
    for view in views:
        is_sailed = view.plan is not None and view.state.is_sailing and not view.state.is_over
        legs: tuple[Any, ...] = view.plan.legs if is_sailed else ()
        at = (view.plan.number, legs[0].to_en_m) if legs and not legs[0].is_loiter else None
        if at != leg:
            begun.append((view.t_s, legs[0].risk if at is not None else None))
            leg = at
        last_s = view.t_s
    ends = [t_s for t_s, _ in begun[1:]] + [last_s]
    return [
        [risk, any(t_s < t <= end for t in forced_s)]
        for (t_s, risk), end in zip(begun, ends, strict=True)
        if risk is not None
    ]


def _plan_risks(views: Sequence[Any], reached_s: Sequence[float], forced_s: Sequence[float]) -> list[list[Any]]:
    """Return, for each plan, the chance that it told at first, and whether she was forced off before its goal."""
    out: dict[int, list[Any]] = {}
    for view in views:
        plan, goal = view.plan, view.figures.goals_reached or 0
        if (
            plan is not None
            and plan.number not in out
            and plan.path_risk is not None
            and view.state.is_sailing
            and (goal < len(reached_s))
        ):
            out[plan.number] = [plan.path_risk, any(view.t_s < t <= reached_s[goal] for t in forced_s)]
    return list(out.values())


def _way_m(times: Sequence[float], places: Sequence[Any]) -> float:
    """Return the length of the way [m], in chords of ``CHORD_S``."""
    chords: list[tuple[float, Any]] = []
    for t_s, place in zip(times, places, strict=True):
        if place is not None and (not chords or t_s - chords[-1][0] >= CHORD_S):
            chords.append((t_s, place))
    return round(sum(math.dist(a, b) for (_, a), (_, b) in pairwise(chords)), 1)


def tacked_s(times: Sequence[float], tacks: Sequence[str | None]) -> list[float]:
    """Return when the boat went onto another tack and stayed on it."""
    out: list[float] = []
    now: str | None = None
    for n, (t_s, tack) in enumerate(zip(times, tacks, strict=True)):
        if tack is None or tack == now:
            continue
        end = bisect_right(times, t_s + TACK_HOLDS_S)
        if all(other == tack for other in tacks[n:end]):
            if now is not None:
                out.append(t_s)
            now = tack
    return out


def _least(rows: Iterable[Sequence[Any]]) -> list[list[float]]:
    """Return, for each plan, the clearance that it expected and the least that there was while it was sailed."""
    plans: dict[Any, list[float]] = {}
    for number, expected_m, clear_m in rows:
        seen = plans.setdefault(number, [expected_m, clear_m])
        seen[1] = min(seen[1], clear_m)
    return list(plans.values())


def _wind_deg(times: Sequence[float], views: Sequence[Any], t_s: float) -> float | None:
    """Return the mean direction that the wind was seen from about a time [deg]; None: not in all of ``WIND_MEAN_S``."""
    if t_s + WIND_MEAN_S / 2.0 > times[-1]:
        return None
    seen = views[bisect_right(times, t_s - WIND_MEAN_S / 2.0) : bisect_right(times, t_s + WIND_MEAN_S / 2.0)]
    winds = [math.radians(v.wind.twd_from_deg) for v in seen if v.wind is not None and v.wind.twd_from_deg is not None]
    return math.degrees(math.atan2(sum(map(math.sin, winds)), sum(map(math.cos, winds)))) if winds else None


def _near(times: Sequence[float], values: Sequence[Any], t_s: float) -> Any:
    """Return what there was within half a second of a time; None: nothing."""
    n = bisect_right(times, t_s + 0.5) - 1
    return values[n] if n >= 0 and abs(times[n] - t_s) <= 0.5 else None


def _at(points: Sequence[Any], in_s: float) -> tuple[tuple[float, float], float] | None:
    """Return where the boat is expected at a time, and the radius that nine of ten are within; None: not told."""
    for a, b in pairwise(points):
        if a.in_s <= in_s <= b.in_s:
            part = 0.0 if b.in_s == a.in_s else (in_s - a.in_s) / (b.in_s - a.in_s)
            at = tuple(p + part * (q - p) for p, q in zip(a.at_en_m, b.at_en_m, strict=True))
            return (at[0], at[1]), a.within_m + part * (b.within_m - a.within_m)
    return None


def table_of(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each figure and class of it: how often it was shown, its error and how often it held."""
    rows = []
    there = [row for record in records for row in record["there"]]
    # By what was left, and by what was told: of the voyages that take long most were told too little, whoever tells.
    for by, column in (("of", 0), ("told", 1)):
        for low, high in pairwise(LEFT_S):
            mine = [
                (told - left, left, left <= late)
                for left, told, late in (row for row in there if low < row[column] <= high)
            ]
            until = " or more" if math.isinf(high) else f" to {high:.0f}"
            rows.append(
                _row(
                    f"there in, {by} {low:.0f}{until} s",
                    [e for e, _, _ in mine],
                    [h for _, _, h in mine],
                    share=[e / s for e, s, _ in mine],
                )
            )
    tacks = [row for record in records for row in record["tack"]]
    for name, planned in (("next tack, of the plan", True), ("next tack, about", False)):
        own = [(told, came) for told, came, is_planned in tacks if is_planned == planned]
        rows.append(
            _row(
                name,
                [told - came for told, came in own if came is not None],
                [came is not None and abs(told - came) <= TACK_OFF_S for told, came in own],
            )
        )
    places = [row for record in records for row in record["place"]]
    for ahead_s in AHEAD_S:
        off = [(off, off <= within) for at_s, off, within in places if at_s == ahead_s]
        rows.append(_row(f"place in {ahead_s} s, m", [off for off, _ in off], [held for _, held in off]))
    winds = [row for record in records for row in record["wind"]]
    for at_s in WIND_S:
        rows.append(_row(f"wind in {at_s:.0f} s, {LEVEL:.0%} band", [], [held for s, held in winds if s == at_s]))
    clears = [row for record in records for row in record["clear"]]
    rows.append(
        _row(
            "clearance expected of a plan, m",
            [met - told for told, met in clears],
            [met >= told for told, met in clears],
        )
    )
    for name, kind in (("off the plan, on a leg", "legs"), ("off the plan, until the goal", "whole")):
        chances = [row for record in records for row in record[kind]]
        rows.append(
            {
                **_row(name, [], [not came for _, came in chances]),
                "median_share": statistics.mean(chance - came for chance, came in chances) if chances else None,
            }
        )
    polar = [share - 1.0 for record in records for share in record["polar"]]
    rows.append(_row("share of the polar", [], [abs(off) <= POLAR_OFF for off in polar], share=polar))
    ways = [row for record in records for row in record["way"]]
    rows.append(
        _row(
            "distance sailed, m",
            [told - way for told, way in ways],
            [abs(told - way) <= WAY_OFF * way for told, way in ways],
            share=[(told - way) / way for told, way in ways if way],
        )
    )
    turns = [row for record in records for row in record["turns"]]
    rows.append(
        _row("tacks and gybes counted", [told - came for told, came in turns], [told == came for told, came in turns])
    )
    return [row for row in rows if row["shown"]]


def _row(name: str, errors: Sequence[float], held: Sequence[bool], share: Sequence[float] = ()) -> dict[str, Any]:
    sizes = sorted(abs(e) for e in errors)
    return {
        "figure": name,
        "shown": len(held),
        "median_error": statistics.median(errors) if errors else None,
        "median_share": statistics.median(share) if share else None,
        "p90_error": sizes[min(len(sizes) - 1, math.ceil(0.9 * len(sizes)) - 1)] if sizes else None,
        "held": sum(held) / len(held) if held else None,
    }


def as_text(rows: Sequence[dict[str, Any]]) -> str:
    """Return the table as text."""

    def cell(value: float | None, form: str) -> str:
        return "-" if value is None else format(value, form)

    lines = [f"{'figure':34s} {'shown':>7s} {'error':>7s} {'of it':>7s} {'90 %':>7s} {'held':>7s}"]
    lines += [
        f"{row['figure']:34s} {row['shown']:7d} {cell(row['median_error'], '+.1f'):>7s} "
        f"{cell(row['median_share'], '+.1%'):>7s} {cell(row['p90_error'], '.1f'):>7s} "
        f"{cell(row['held'], '.1%'):>7s}"
        for row in rows
    ]
    return "\n".join(lines)


def shown(scenarios: Sequence[Path], *, seeds: int, first_seed: int, mismatch: bool) -> Experiment[bool]:
    """Return the voyages of each scenario, or of what ``sitl mismatch`` draws; a table of each kind and of all.

    The seeds run on from one scenario to the next: two voyages of one seed would be of one wind.
    """
    from lab.campaigns.drawn_mismatch import draw

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        names = list(dict.fromkeys(record["scenario"] for record in sailed.records))
        tables = {name: table_of([r for r in sailed.records if r["scenario"] == name]) for name in names}
        if len(names) > 1:
            tables["all"] = table_of(sailed.records)
        return ExperimentSummary(
            lines=[*(f"{name}\n{as_text(rows)}\n" for name, rows in tables.items()), sailed.took], figures=tables
        )

    def key(job: Job[bool]) -> Key:
        water = {} if job.case else {"hash": file_hash(job.scenario)}
        return {"scenario": _name(job), **water, "seed": job.seed}

    paths = scenarios or SCENARIOS
    every = range(first_seed, first_seed + seeds * (1 if mismatch else len(paths)))
    jobs = [
        Job(scenario=draw(seed).source, case=True, seed=seed)
        if mismatch
        else Job(scenario=paths[n // seeds], case=False, seed=seed)
        for n, seed in enumerate(every)
    ]
    return Experiment(name="shown", sail=sail, key=key, sum_up=sum_up, jobs=jobs)

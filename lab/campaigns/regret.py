"""Regret: the time that every sailor takes over the best that could have been made of the wind that the boat met."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from companion.errors import InputError
from companion.geofence import load_mission
from lab.campaigns.baselines import NAMES, TOLD, BaselineTrack, Sailor, key_of, latest, pairs, scenario_of, voyage_of
from lab.perfect_information import Best, Race, Weather, best
from lab.possible import possible_s, race_in
from sitl.results import markdown
from sitl.runner import CampaignResults, Experiment, ExperimentSummary, Job
from sitl.scenario import Scenario, load_scenario, scenario_departures, scenario_waters, scenario_wind

HEADS = (
    "scenario",
    "sailor",
    "runs",
    "clean",
    "median s",
    "tacks",
    "possible s",
    "over possible %",
    "best s",
    "its tacks",
    "over best %",
    "10 %",
    "90 %",
    "gap to bound %",
    "refined %",
)


def figures_of(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the figures: times [s], shares of the best time; what has no clean voyage has None.

    "regret" is time over the clairvoyant's, less 1; "gap" how far the best that was found is over the bound, "refined"
    what the search's finest grid gained: both say how well the best itself is known.
    """
    names = list(dict.fromkeys(r["scenario"] for r in records))
    return [
        _figures(name, who, rows)
        for name in names
        for who in TOLD
        if (rows := [r for r in records if r["scenario"] == name and r["who"] == who])
    ]


def _figures(name: str, who: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    clean = [r for r in rows if "best_s" in r and not r["contacts"]]
    regrets = sorted(r["time_s"] / r["best_s"] - 1.0 for r in clean)

    def median(values: Sequence[float]) -> float | None:
        return statistics.median(values) if values else None

    return {
        "scenario": name,
        "sailor": who,
        "runs": len(rows),
        "clean": len(clean),
        "time_s": median([r["time_s"] for r in clean]),
        "tacks": median([r["tacks"] for r in clean]),
        "possible_s": median([r["possible_s"] for r in clean if r.get("possible_s")]),
        "over_possible": median([r["time_s"] / r["possible_s"] - 1.0 for r in clean if r.get("possible_s")]),
        "best_s": median([r["best_s"] for r in clean]),
        "best_tacks": median([r["best_tacks"] for r in clean]),
        "regret": median(regrets),
        "regret_10": regrets[math.floor(0.1 * (len(regrets) - 1))] if regrets else None,
        "regret_90": regrets[math.ceil(0.9 * (len(regrets) - 1))] if regrets else None,
        "gap": median([r["best_s"] / r["bound_s"] - 1.0 for r in clean]),
        "refined": median([r["coarser_s"] / r["best_s"] - 1.0 for r in clean]),
    }


def as_text(records: Sequence[dict[str, Any]]) -> str:
    """Return the figures as a Markdown table."""
    return markdown(
        HEADS,
        [
            [
                f["scenario"],
                f["sailor"],
                str(f["runs"]),
                str(f["clean"]),
                _number(f["time_s"]),
                _number(f["tacks"], "g"),
                _number(f["possible_s"]),
                _percent(f["over_possible"], 1),
                _number(f["best_s"]),
                _number(f["best_tacks"], "g"),
                *(_percent(f[k], 1) for k in ("regret", "regret_10", "regret_90")),
                _percent(f["gap"], 1),
                _percent(f["refined"], 2),
            ]
            for f in figures_of(records)
        ],
    )


def _number(value: float | None, kind: str = ".0f") -> str:
    return "-" if value is None else format(value, kind)


def _percent(share: float | None, digits: int) -> str:
    return "-" if share is None else f"{100.0 * share:.{digits}f}"


# Asked for within this share of what was sailed: its polar's speeds are not passed by much for long.
UNTIL = 1.2


def require_judged(path: Path) -> None:
    """Raise InputError for a scenario that the clairvoyant does not know how to sail."""
    scenario = load_scenario(path)
    mission = load_mission(scenario.mission_path(path))
    start = mission.frame().en_from_geo(mission.start or mission.origin)
    plain = all(
        goal.gate is None and goal.box is None and goal.search is None and goal.field is None and goal.rounding is None
        for goal in mission.goals
    )
    if mission.is_passage or mission.skipper.laps > 1 or not plain:
        raise InputError(
            str(path),
            "mission",
            "has goals that are no plain marks, or laps, or is a passage",
            "the best time is known for marks to be reached in their order",
        )
    if (
        scenario_waters(scenario, scenario_wind(scenario, path, 0), start) is not None
        or scenario_departures(scenario) is not None
        or any(event.kind not in {"wind_shift", "wind_speed"} for event in scenario.events)
    ):
        raise InputError(
            str(path),
            "",
            "has a stream, lees, another boat than the plan's, or events",
            "the best time is known for one wind everywhere and the boat as planned",
        )


def race_of(scenario: Scenario, track: BaselineTrack) -> Race:
    """Return the race of a voyage: from where the boat set sail, in the wind that it met from then on."""
    truth = track.truth
    t_s = np.array(truth.t_s)
    weather = Weather(t_s=t_s - t_s[0], twd_from_rad=np.array(truth.twd_from_rad), tws_mps=np.array(truth.tws_mps))
    return race_in(scenario, track.mission, weather, truth.en_m[0])


def best_of(scenario: Scenario, track: BaselineTrack) -> Best | None:
    """Return what a clairvoyant makes of a voyage's wind; None for one that did not arrive."""
    return None if track.time_s is None else best(race_of(scenario, track), UNTIL * track.time_s)


def sail(job: Job[Sailor]) -> dict[str, Any]:
    """Sail a job; return what is told of it, and the best."""
    voyage = voyage_of(job)
    if voyage.track.time_s is None:
        return voyage.record
    race = race_of(scenario_of(job), voyage.track)
    ideal = best(race, UNTIL * voyage.track.time_s)
    return {
        **voyage.record,
        "possible_s": possible_s(scenario_of(job), race),
        "best_s": ideal.time_s,
        "bound_s": ideal.bound_s,
        "coarser_s": ideal.coarser_s,
        "best_tacks": ideal.tacks,
    }


def regret(jobs: Sequence[Job[Sailor]], *, against: str | None) -> Experiment[Sailor]:
    """Return the voyages; a table of all that there is, and one sailor against the others."""

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = latest([result for _, result in sailed.held.pairs()])
        return ExperimentSummary(
            lines=[as_text(records), *([] if against is None else [pairs(records, NAMES[against])])],
            figures=figures_of(records),
        )

    return Experiment(name="regret", sail=sail, key=key_of, sum_up=sum_up, jobs=jobs)


def draw_regret(jobs: Sequence[Job[Sailor]], plot: Path) -> None:
    """Sail jobs again and draw them over the best."""
    from lab.campaigns.plots import save_regret

    voyages = [(voyage_of(job), scenario_of(job)) for job in jobs]
    save_regret([(voyage, best_of(scenario, voyage.track)) for voyage, scenario in voyages], plot)

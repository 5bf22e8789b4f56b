"""The campaign: every sailor, scenario and seed, and for each voyage what a clairvoyant makes of the same wind."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from companion.compose import boat_of
from companion.errors import InputError
from companion.geofence import Mission, load_mission
from sitl.autopilot import TACK_RETRY_S, no_go_half_rad, settled_polar, tack_loss_s
from sitl.campaigns.baselines import Track
from sitl.campaigns.figures import NAMES, Job, WindOf, jobs_of, key_of, latest, scenario_of, voyage_of
from sitl.campaigns.pairs import pairs
from sitl.campaigns.regret.table import figures_of, told
from sitl.clairvoyant import Best, Craft, Goal, Race, Weather, best
from sitl.means import Means
from sitl.run.embedded import solid_of
from sitl.runner import sail
from sitl.scene import Scenario, load_scenario, own_polar, scenario_departures, scenario_waters, scenario_wind

# Asked for within this share of what was sailed: her polar's speeds are not passed by much for long.
UNTIL = 1.2


def require_judged(path: Path) -> None:
    """Raise InputError for a scenario that the clairvoyant does not know how to sail."""
    scenario = load_scenario(path)
    mission = load_mission(scenario.mission_path(path))
    start = mission.frame().en_from_geo(mission.start or mission.origin)
    plain = all(goal.gate is None and goal.box is None and goal.search is None and goal.field is None
                and goal.rounding is None for goal in mission.goals)
    if mission.is_passage or mission.skipper.laps > 1 or not plain:
        raise InputError(str(path), "mission", "has goals that are no plain marks, or laps, or is a passage",
                         "the best time is known for marks to be reached in their order")
    if (scenario_waters(scenario, scenario_wind(scenario, path, 0), start) is not None
            or scenario_departures(scenario) is not None
            or any(event.kind not in {"wind_shift", "wind_speed"} for event in scenario.events)):
        raise InputError(str(path), "", "has a stream, lees, another boat than the plan's, or events",
                         "the best time is known for one wind everywhere and the boat as planned")


def race_of(scenario: Scenario, track: Track) -> Race:
    """Return the race of a voyage: from where she set sail, in the wind that she met from then on."""
    mission, truth = track.mission, track.truth
    frame, boat = mission.frame(), boat_of(mission)
    t_s, tws = np.array(truth.t_s), np.array(truth.tws_mps)
    polar, parameters = own_polar(mission), scenario.parameters
    return Race(
        craft=Craft(
            polar=settled_polar(parameters) if polar is None else polar, no_go_half_rad=no_go_half_rad(parameters),
            max_twa_rad=boat.max_twa_rad, tack_s=tack_loss_s(parameters, polar, float(tws.mean())),
            board_s=TACK_RETRY_S),
        weather=Weather(t_s=t_s - t_s[0], twd_from_rad=np.array(truth.twd_from_rad), tws_mps=tws),
        start_en_m=truth.en_m[0], goals=_goals(mission), clear_m=boat.hull.reach_m,
        solid=solid_of(mission.area.local(frame)))


def _goals(mission: Mission) -> tuple[Goal, ...]:
    frame = mission.frame()
    return tuple(Goal(en_m=frame.en_from_geo(goal.point), radius_m=goal.radius_m) for goal in mission.goals)


def best_of(scenario: Scenario, track: Track) -> Best | None:
    """Return what a clairvoyant makes of a voyage's wind; None for one that did not arrive."""
    return None if track.time_s is None else best(race_of(scenario, track), UNTIL * track.time_s)


def sail_one(job: Job) -> dict[str, Any]:
    """Sail a job; return what is told of it, and the best."""
    voyage = voyage_of(job)
    ideal = best_of(scenario_of(job), voyage.track)
    if ideal is None:
        return voyage.record
    return {**voyage.record, "best_s": ideal.time_s, "bound_s": ideal.bound_s, "coarser_s": ideal.coarser_s,
            "best_tacks": ideal.tacks}


def run_regret(
    *, who: Sequence[str], scenarios: Sequence[Path], seeds: int, means: Means, speedup: float,
    json_path: Path | None, plot: Path | None, winds: Sequence[WindOf] | None, against: str | None,
) -> int:
    """Sail everything that has no result yet, print the table of all that there is; return the exit code."""
    sailed = sail("regret", sail_one, jobs_of(who, scenarios, seeds, speedup, winds), means, key=key_of)
    records = latest([result for _, result in sailed.held.pairs()])
    print(told(records))
    if against is not None:
        print(pairs(records, NAMES[against]))
    if json_path is not None:
        json_path.write_text(json.dumps(figures_of(records), indent=1) + "\n", encoding="utf-8")
    if plot is not None:
        from sitl.campaigns.regret.picture import save_regret

        drawn = [(job, voyage_of(job)) for job in jobs_of(who, scenarios[:1], 1, speedup, winds and winds[:1])]
        save_regret([(voyage, best_of(scenario_of(job), voyage.track)) for job, voyage in drawn], plot)
        print(f"drawn in {plot}")
    return sailed.exit_code(is_good=True)

"""What could have been made of a wind by who knows how it shifts and not what comes: the bound of what can be known.

python -m lab.possible demo two-channels        what margin, tacks and a widened no-go zone cost there (a minute)
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist

import numpy as np
import shapely

from companion.boat.rover import TACK_RETRY_S
from companion.compose import boat_of
from companion.geo.angles import difference_rad
from companion.geofence import Mission, load_mission
from companion.planner import Problem
from companion.planner.policy import Policy, Shifts, solve, steady, wandering
from lab.perfect_information import Race, RaceBoat, RaceMark, Weather
from sitl.autopilot import no_go_half_rad, settled_polar, tack_loss_s
from sitl.commands.run import scenario_file
from sitl.results import markdown
from sitl.run.embedded import solid_of
from sitl.scenario import Scenario, load_scenario, own_polar

CELL_M = 4.0
"""Of the chart: half of it changes no time of the waters in docs/lab/regret.md by 1 %."""
DEEPEST = 180.0


def shifts_of(scenario: Scenario) -> Shifts | None:
    """Return how a scenario's wind shifts; None: a record, gusts or events, no such process."""
    wind = scenario.wind
    told = any(event.kind in {"wind_shift", "wind_speed"} for event in scenario.events)
    if told or wind.gust_spread > 0.0 or wind.model == "recorded":
        return None
    return steady() if wind.model == "constant" else wandering(math.radians(wind.sd_deg), wind.tau_s)


def possible_s(scenario: Scenario, race: Race, *, cell_m: float = CELL_M) -> float | None:
    """Return what a race is expected to take, from the shift that it begins in, on the better tack [s].

    None where it is not known how the wind shifts.
    """
    shifts, mean_rad = shifts_of(scenario), math.radians(scenario.wind.from_deg)
    if shifts is None:
        return None
    first = policies(race, shifts, twd_from_rad=mean_rad, tws_mps=scenario.wind.tws_mps, cell_m=cell_m)[0]
    time_s = first.time_to_go_s(race.start_en_m, difference_rad(float(race.weather.twd_from_rad[0]), mean_rad))
    return time_s if math.isfinite(time_s) else None


def policies(race: Race, shifts: Shifts, *, twd_from_rad: float, tws_mps: float, cell_m: float) -> list[Policy]:
    """Return the best policy of each leg of a race, in a wind of that mean, each with what is to go from its goal."""
    found: list[Policy] = []
    starts = [race.start_en_m, *(goal.en_m for goal in race.goals[:-1])]
    for start, goal in reversed(list(zip(starts, race.goals, strict=True))):
        leg = _problem(race, start, goal.en_m, goal.radius_m, twd_from_rad=twd_from_rad, tws_mps=tws_mps)
        found.append(solve(leg, shifts, cell_m=cell_m, onward=found[-1] if found else None))
    return found[::-1]


def _problem(
    race: Race,
    start: tuple[float, float],
    goal: tuple[float, float],
    radius_m: float,
    *,
    twd_from_rad: float,
    tws_mps: float,
) -> Problem:
    craft: RaceBoat = race.craft
    angles = np.arange(math.degrees(craft.no_go_half_rad), min(DEEPEST, math.degrees(craft.max_twa_rad)) + 1e-9, 1.0)
    speeds = craft.polar.speeds_mps(np.radians(angles), tws_mps)
    solid = shapely.buffer(race.solid, race.clear_m) if race.clear_m > 0.0 else race.solid
    return Problem.from_json(
        {
            "id": "race",
            "start": {"x": start[0], "y": start[1], "heading_deg": 0.0},
            "goal": {"x": goal[0], "y": goal[1], "radius": radius_m},
            "obstacles": [part.wkt for part in shapely.get_parts(solid)],
            "wind": {"from_deg": math.degrees(twd_from_rad), "speed_mps": tws_mps, "sigma": {"model": "none"}},
            "boat": {
                "no_go_half_deg": math.degrees(craft.no_go_half_rad),
                "max_twa_deg": math.degrees(craft.max_twa_rad),
                # she follows the wind at once, and a change of side takes what it costs her
                "turn_rate_rad_s": 2.0 * craft.no_go_half_rad / max(craft.tack_s, 1e-3),
                "speed": {"model": "polar", "twa_deg": angles.tolist(), "v_mps": speeds.tolist()},
            },
            "delta_s": 0.5,
        }
    )


def race_in(scenario: Scenario, mission: Mission, weather: Weather, start_en_m: tuple[float, float]) -> Race:
    """Return the race of a scenario's boat through a mission's goals, from a place, in a wind."""
    frame, boat = mission.frame(), boat_of(mission)
    polar, parameters = own_polar(mission), scenario.parameters
    return Race(
        craft=RaceBoat(
            polar=settled_polar(parameters) if polar is None else polar,
            no_go_half_rad=no_go_half_rad(parameters),
            max_twa_rad=boat.max_twa_rad,
            tack_s=tack_loss_s(parameters, polar, float(weather.tws_mps.mean())),
            board_s=TACK_RETRY_S,
        ),
        weather=weather,
        start_en_m=start_en_m,
        goals=tuple(RaceMark(en_m=frame.en_from_geo(goal.point), radius_m=goal.radius_m) for goal in mission.goals),
        clear_m=boat.hull.reach_m,
        solid=solid_of(mission.area.local(frame)),
    )


def costs(path: Path) -> Iterator[tuple[str, float]]:
    """Yield what is given up, one thing after the other, and the time that is possible with it [s]."""
    scenario = load_scenario(path)
    mission = load_mission(scenario.mission_path(path))
    boat, wind = boat_of(mission), scenario.wind
    start = mission.frame().en_from_geo(mission.start or mission.origin)
    mean = Weather(t_s=np.zeros(1), twd_from_rad=np.radians([wind.from_deg]), tws_mps=np.full(1, wind.tws_mps))
    race = race_in(scenario, mission, mean, start)
    shifts = shifts_of(scenario)
    if shifts is None:
        return
    tack_s = 2.0 * race.craft.no_go_half_rad / boat.turn_rate_radps + boat.tack_loss_s
    kept = replace(race, clear_m=race.clear_m + mission.margin_m)
    slower = replace(kept, craft=replace(race.craft, tack_s=max(race.craft.tack_s, tack_s)))
    widened_rad = NormalDist().inv_cdf(mission.risk.delta_s) * shifts.spread_rad
    wider = replace(slower, craft=replace(slower.craft, no_go_half_rad=race.craft.no_go_half_rad + widened_rad))
    for told, its, process in (
        ("the best that can be known", race, shifts),
        (f"... {mission.margin_m:.0f} m clear of everything", kept, shifts),
        (f"... a tack in {slower.craft.tack_s:.1f} s, as the mission has it", slower, shifts),
        ("... in the mean wind alone: no shift is used", slower, steady()),
        (f"... and {math.degrees(widened_rad):.0f}° off the no-go zone, as one plan without recourse", wider, steady()),
    ):
        legs = policies(its, process, twd_from_rad=math.radians(wind.from_deg), tws_mps=wind.tws_mps, cell_m=CELL_M)
        yield told, legs[0].time_to_go_s(start, 0.0)


def main(argv: Sequence[str] | None = None) -> int:
    """Print what is given up in each water, and its cost."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.possible", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenarios", nargs="+", type=scenario_file, metavar="SCENARIO")
    args = parser.parse_args(argv)
    rows = [
        [path.stem, told, f"{time_s:.0f}" if math.isfinite(time_s) else "no way"]
        for path in args.scenarios
        for told, time_s in costs(path)
    ]
    print(markdown(("scenario", "", "time s"), rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())

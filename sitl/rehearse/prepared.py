"""A rehearsal made ready: the mission believed and planned once, and the scenario of it written beside the results."""

from __future__ import annotations

import datetime as dt
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from companion.compose import planner_of, tide_of, water_of
from companion.disk import Disk
from companion.errors import InputError
from companion.geofence import Mission
from companion.mission_check import AssumedWind, leg_names, legs, planned_legs, waits_s
from companion.planner import Plan, Problem, plan
from companion.safety import DARK, End
from sitl.rehearse.sampling import FORECASTS, Doubts, forecast_wind, given_wind
from sitl.run.embedded import EXPANSIONS, mission_of
from sitl.runner import require_free
from sitl.scenario import Scenario, WindSpec, beginning, load_scenario, scenario_text

SCENARIO = "rehearsal.toml"
SLOWER = 3.0  # a voyage may take this much longer than planned ...
AT_LEAST_S = 900.0  # ... and no less than this before it is called off
BESIDE_S = 3600.0  # beside that and what is waited, for what nobody can count: a search, a box, a field


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedRehearsal:
    """A rehearsal that can begin.

    Attributes:
        source: the scenario of it, in the folder of results.
        scenario: what it says.
        mission: what it sails.
        doubts: what a seed draws.
        plans: the way in the mean wind, goal by goal; empty where fields lead.
        waits_s: how long she waits for guns and stays in boxes, by those plans [s].
        tells_the_hour: whether it makes a difference when the boat sails: a measured wind, a tide, the dark.
    """

    source: Path
    scenario: Scenario
    mission: Mission
    doubts: Doubts
    plans: tuple[Plan, ...]
    waits_s: float
    tells_the_hour: bool

    @property
    def planned_s(self) -> float:
        """When she is there by the plans, what she waits included [s]; 0 where there are none."""
        return self.mission.skipper.laps * sum(plan.cost_s for plan in self.plans) + self.waits_s if self.plans else 0.0


def prepared(
    path: Path,
    folder: Path,
    *,
    wind: Sequence[str],
    wind_error: tuple[float, float] | None,
    doubt: float,
    faults: bool,
    depart: dt.datetime | None,
    limit_s: float | None,
) -> PreparedRehearsal:
    """Read and plan a mission (or a scenario), and write the scenario that is sailed into ``folder``.

    Raises:
        InputError: it cannot be read, sailed or planned, has no start, or the wind is none.
        JobError: another rehearsal is sailed there.
        OSError: the folder does not take it.
    """
    base = load_scenario(path)
    mission = mission_of(base, path)
    if mission.start is None:
        raise InputError(
            str(mission.path),
            "[start]",
            "is missing, and a rehearsal begins somewhere",
            "add lat and lon of where she will set sail",
        )
    begins = depart or _hour(base, mission, path, folder / SCENARIO)
    forecasts = [Path(text) for text in wind if Path(text).suffix.lower() in FORECASTS]
    if len(wind) > max(1, len(forecasts)):
        raise InputError("--wind", ", ".join(wind), "is more than one wind", "name one, or several forecasts (GRIB)")
    if forecasts:
        given, begins = forecast_wind(forecasts, mission, depart, begins, _mean(base, mission), wind_error)
    else:
        given = given_wind(wind[0] if wind else None, _mean(base, mission), wind_error)
    middle = given.middle
    plans = _planned(mission, AssumedWind(from_deg=middle[0], speed_mps=middle[1]))
    laps = mission.skipper.laps
    waiting_s = sum(waits_s(mission, [p.cost_s for p in plans], laps=laps, unix_s=begins.timestamp()))
    sailing_s = laps * sum(p.cost_s for p in plans) + mission.skipper.station_s
    needs_more = any(goal.field or goal.search or goal.box for goal in mission.goals)
    scenario = msgspec.structs.replace(
        base,
        mission=os.path.relpath(mission.path, folder),
        wind=given.beside(folder).spec,
        begins=begins,
        limit_s=limit_s or round(max(SLOWER * sailing_s, AT_LEAST_S) + waiting_s + needs_more * BESIDE_S),
    )
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / SCENARIO
    text = scenario_text(scenario).encode()
    if not source.is_file() or source.read_bytes() != text:
        for results in folder.glob("*.jsonl"):  # who sails here reads it for each voyage
            require_free(results)
        Disk().replace(source, text)
    return PreparedRehearsal(
        source=source,
        scenario=scenario,
        mission=mission,
        plans=tuple(plans),
        waits_s=waiting_s,
        doubts=Doubts(
            wind=replace(given, spec=scenario.wind),
            boat=doubt,
            faults=faults,
            voyage_s=round(max(sailing_s + waiting_s, 60.0), 1),
        ),
        tells_the_hour=given.record_s > 0.0
        or bool(given.members)
        or mission.tide_path is not None
        or bool(mission.drying)
        or mission.safety.end(DARK) is not End.SAY,
    )


def _mean(base: Scenario, mission: Mission) -> WindSpec:
    """Return the weather where none is given: a scenario's own, of a mission what its previews assume."""
    if base.wind != WindSpec():
        return base.wind
    return WindSpec(from_deg=mission.wind.preview_from_deg, tws_mps=mission.wind.preview_speed_mps)


def _hour(base: Scenario, mission: Mission, path: Path, written: Path) -> dt.datetime:
    """Return when the boat sails where nobody says: when a table of the tide begins, a scenario does, or now.

    A rehearsal that goes on keeps the hour at which it was begun: what was sailed is of that.
    """
    rows = water_of(mission).rows
    heights = tide_of(mission) if mission.drying and not rows else None
    if heights is not None and heights.rows:
        return dt.datetime.fromtimestamp(heights.rows[0].utc_s, dt.UTC)
    if rows:
        return dt.datetime.fromtimestamp(rows[0].utc_s, dt.UTC)
    try:
        return beginning(base, path) if not written.is_file() else load_scenario(written).begins
    except InputError:
        return beginning(base, path)


def _planned(mission: Mission, wind: AssumedWind) -> list[Plan]:
    """Return the plans from goal to goal; InputError for a goal to which no way leads."""
    if any(goal.field is not None for goal in mission.goals) or mission.autopilot.frame == "motor":
        return []
    by = planner_of(mission).about(mission.frame().origin)

    def answer(problem: Problem) -> Plan:
        return plan(problem, expansions=EXPANSIONS, seed=0, algorithm=by.algorithm, settings=by.settings)

    try:
        # water that dries is waited for: it closes no way for good
        plans = planned_legs(legs(replace(mission, drying=()), wind), answer)
    except ValueError as error:
        raise InputError(str(mission.path), "", str(error), "'companion mission check --plot' draws it") from None
    if not plans[-1].has_path:
        raise InputError(
            str(mission.path),
            leg_names(mission)[len(plans) - 1],
            f"no way leads there in {wind.speed_mps:g} m/s from {wind.from_deg:g}° ({plans[-1].reason})",
            "'companion mission check --plot' draws it",
        )
    return plans

"""A scene: the scenario's file, its weather, its other vessels, and the judge of what the boat did."""

from sitl.scenario.colregs import CLOSE_HAULED_DEG, Craft, Manner, Mover, duty, met_by
from sitl.scenario.scenario import (
    CurrentSpec,
    EventSpec,
    ExpectSpec,
    HullSpec,
    LeeSpec,
    Outlet,
    SatelliteSpec,
    Scenario,
    SensorsSpec,
    WavesSpec,
    WindSpec,
    beginning,
    is_all_ordinary,
    load_scenario,
    own_polar,
    recentre_m,
    scenario_departures,
    scenario_text,
    scenario_waters,
    scenario_wind,
)
from sitl.scenario.tasks import tasks_of
from sitl.scenario.traffic import TRAFFIC, Motion, Others, free_port
from sitl.scenario.verdict import (
    CALL_HOLDS_S,
    TASK_S,
    HullTrack,
    ScenarioVerdict,
    StationScore,
    TrueTrack,
    count_tacks,
    judge,
    station_score,
    verdict_line,
)

__all__ = [
    "CALL_HOLDS_S", "CLOSE_HAULED_DEG", "TASK_S", "TRAFFIC", "Craft", "CurrentSpec", "EventSpec", "ExpectSpec",
    "HullSpec", "HullTrack", "LeeSpec", "Manner", "Motion", "Mover", "Others", "Outlet", "SatelliteSpec",
    "Scenario", "ScenarioVerdict", "SensorsSpec", "StationScore", "TrueTrack", "WavesSpec", "WindSpec", "beginning",
    "count_tacks", "duty", "free_port", "is_all_ordinary", "judge", "load_scenario", "met_by", "own_polar",
    "recentre_m", "scenario_departures", "scenario_text", "scenario_waters", "scenario_wind", "station_score",
    "tasks_of", "verdict_line",
]

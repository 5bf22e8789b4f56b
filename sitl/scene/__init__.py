"""A scene: the scenario's file, its weather, its other vessels, and the judge of what the boat did."""

from sitl.scene.clearance import HullTrack
from sitl.scene.hull import own_polar, recentre_m
from sitl.scene.mariner import CLOSE_HAULED_DEG, Manner, met_by
from sitl.scene.mismatch import CurrentSpec, HullSpec, LeeSpec, SensorsSpec, WavesSpec
from sitl.scene.others import TRAFFIC, Others
from sitl.scene.road import Craft, Mover, duty
from sitl.scene.scenario import (
    EventSpec,
    ExpectSpec,
    Outlet,
    SatelliteSpec,
    Scenario,
    WindSpec,
    beginning,
    is_all_ordinary,
    load_scenario,
)
from sitl.scene.scores import TASK_S, StationScore, station_score
from sitl.scene.ships import Motion, free_port
from sitl.scene.tasks import Tasks, tasks_of
from sitl.scene.verdict import CALL_HOLDS_S, Truth, Verdict, count_tacks, judge
from sitl.scene.weather import scenario_departures, scenario_waters, scenario_wind
from sitl.scene.written import scenario_text

__all__ = [
    "CALL_HOLDS_S", "CLOSE_HAULED_DEG", "TASK_S", "TRAFFIC", "Craft", "CurrentSpec", "EventSpec", "ExpectSpec",
    "HullSpec", "HullTrack", "LeeSpec", "Manner", "Motion", "Mover", "Others", "Outlet", "SatelliteSpec", "Scenario",
    "SensorsSpec", "StationScore", "Tasks", "Truth", "Verdict", "WavesSpec", "WindSpec", "beginning",
    "count_tacks", "duty",
    "free_port", "is_all_ordinary", "judge", "load_scenario", "met_by", "own_polar", "recentre_m",
    "scenario_departures", "scenario_text", "scenario_waters", "scenario_wind", "station_score", "tasks_of",
]

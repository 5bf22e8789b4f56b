"""A scene: the scenario's file, its weather, its other vessels, and the judge of what the boat did."""

from sitl.scene.clearance import HullTrack
from sitl.scene.hull import own_polar
from sitl.scene.others import TRAFFIC, Others
from sitl.scene.scenario import (
    EventSpec,
    ExpectSpec,
    SatelliteSpec,
    Scenario,
    WindSpec,
    is_all_ordinary,
    load_scenario,
)
from sitl.scene.scores import TASK_S, StationScore, station_score
from sitl.scene.ships import Motion, free_port
from sitl.scene.tasks import Tasks, tasks_of
from sitl.scene.verdict import CALL_HOLDS_S, Truth, Verdict, count_tacks, judge
from sitl.scene.weather import scenario_wind

__all__ = [
    "CALL_HOLDS_S", "TASK_S", "TRAFFIC", "EventSpec", "ExpectSpec", "HullTrack", "Motion", "Others",
    "SatelliteSpec", "Scenario", "StationScore", "Tasks", "Truth", "Verdict", "WindSpec", "count_tacks", "free_port",
    "is_all_ordinary", "judge", "load_scenario", "own_polar", "scenario_wind", "station_score", "tasks_of",
]

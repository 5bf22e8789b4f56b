"""Weeks at sea: what is written of a voyage, and the first hours of one sailed."""

import datetime as dt
import math
from itertools import pairwise

import numpy as np
import pytest

from companion.geofence import load_mission
from companion.messages import GeoPoint
from companion.passage.frame import GEOD
from companion.telemetry.folder import read_decisions
from lab import weeks
from sitl.run.embedded import mission_of
from sitl.scenario.scenario import load_scenario


@pytest.fixture(scope="module")
def voyage(tmp_path_factory):
    return weeks.written(tmp_path_factory.mktemp("weeks"), "fixed", departure=3, days=22.0, kills=20)


def test_it_can_be_sailed_and_befalls_her_what_is_promised(voyage):
    scenario = load_scenario(voyage)
    mission = mission_of(scenario, voyage)
    points = [mission.start, *(goal.point for goal in mission.goals)]
    way_m = sum(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(points))
    assert 1.4e6 < way_m < 1.6e6
    assert scenario.expect.arrived
    kinds = [event.kind for event in scenario.events]
    assert (kinds.count("kill_companion"), kinds.count("meeting")) == (20, 44)
    assert all(event.at_s < scenario.limit_s for event in scenario.events)
    # the battery is low from dusk to dawn, by the boat's clock
    for event in (e for e in scenario.events if e.kind == "battery"):
        at = scenario.begins + dt.timedelta(seconds=event.at_s)
        assert (event.volts == weeks.FULL_V) == (weeks.DAWN_H <= at.hour < weeks.DUSK_H)


def test_islands_lie_in_her_way(voyage):
    mission = load_mission(voyage.parent / "weeks.toml")
    frame, water = mission.frame(), mission.water()
    goals = [mission.start, *(goal.point for goal in mission.goals)]
    assert min(water.clearance_m([frame.en_from_geo(p) for p in goals])) > 1000.0  # and none on a waypoint
    met = 0
    for a, b in pairwise(goals):
        count = int(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] / 200.0)
        way = GEOD.npts(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg, count)
        dry = (
            np.array([water.clearance_m([frame.en_from_geo(GeoPoint(lat_deg=y, lon_deg=x))])[0] for x, y in way]) <= 0.0
        )
        met += int(np.sum(dry[1:] & ~dry[:-1]))
    assert met == len(weeks.ISLANDS_M)


def test_a_short_one_is_not_there(tmp_path):
    scenario = load_scenario(weeks.written(tmp_path, "fixed", departure=0, days=2.0, kills=2))
    assert scenario.expect.arrived is False
    assert scenario.limit_s == 2.0 * 86_400.0


def test_a_row_in_words():
    assert weeks.line((1.5, 600.0, 300.0, 12.34, math.nan), 2) == (
        "day  1.50:   10.0 min of a processor,  300 MB, records   12.3 MB,   nan km to goal 3"
    )


@pytest.mark.timeout(1800)
def test_over_midnight_by_two_kills_a_ship_and_a_low_battery_within_a_budget(tmp_path):
    """Two and a half hours of it, which the whole has two hundred of: ``python -m lab.weeks``."""
    path = weeks.written(tmp_path, "forecast", departure=3, days=0.104, kills=2)
    assert load_scenario(path).begins.hour == 21
    told = []
    seen = weeks.Seen(records=tmp_path / "records", every_s=300.0, tell=told.append)
    verdict = weeks.sailed(path, tmp_path / "records", 0, 4.0, seen)
    assert verdict.passed, [check for check in verdict.checks if not check.passed]
    assert len(told) >= 28
    assert 2.0 < max(row[3] for row in seen.rows) < 4.0
    folder = tmp_path / "records" / "weeks"
    decisions = read_decisions(folder)
    assert sum(d["kind"] == "start" for d in decisions) == 3
    assert any(d["kind"] == "dropped" for d in decisions)
    days = {d["utc"][:10] for d in decisions if d["kind"] == "action"}
    assert len(days) == 2
    codes = {d.get("code") for d in decisions if d["kind"] == "action"}
    assert {"adopted", "battery low", "dark"} <= codes
    assert min(verdict.figures["vessel_distances_m"].values()) < 1000.0

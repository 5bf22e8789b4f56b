"""Previews: what the mission says of the current is in what the planner is asked, as it is on board."""

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from companion import cli
from companion.boat import ardurover_sitl
from companion.compose import water_of
from companion.current import CurrentEstimator, over_water
from companion.geofence import load_mission
from companion.mission_check import AssumedWind, expected_current, layline_rad, legs, planned_legs
from companion.planner import Plan, plan
from companion.planner.problem.evaluate import endpoint_error
from companion.plots.mission import _words

SOUTH = Path("sitl/missions/southern-tide.toml")
WIND = AssumedWind(from_deg=0.0, speed_mps=5.0)
HIGH_S = 1_795_262_400.0  # 2026-11-21T12:00:00Z


@pytest.fixture
def mission_with(tmp_path):
    def write(current, table=""):
        text, end = SOUTH.read_text(encoding="utf-8"), "\n[operator]"
        head, tail = text[: text.index("[current]")], text[text.index(end) :]
        (tmp_path / "m.toml").write_text(head + (f"[current]\n{current}\n" if current else "") + tail, encoding="utf-8")
        (tmp_path / "southern-tide.wkt").write_text(SOUTH.with_suffix(".wkt").read_text(encoding="utf-8"))
        (tmp_path / "tide.csv").write_text(table)
        return load_mission(tmp_path / "m.toml")

    return write


def test_a_preview_tells_what_is_waited_and_stayed(tmp_path):
    line = "port_mark = { lat = 50.8172, lon = -1.3103 }\nstarboard_mark = { lat = 50.8172, lon = -1.3097 }\n"
    water = '"POLYGON ((-1.3105 50.818, -1.3095 50.818, -1.3095 50.8185, -1.3105 50.8185, -1.3105 50.818))"'
    goals = [
        f'kind = "gate"\nname = "Gun"\n{line}after_s = 60.0\n',
        f'kind = "gate"\nname = "Hour"\n{line}not_before = 2026-11-21T13:00:00Z\n',
        f'kind = "box"\nname = "Box"\npolygon = {water}\nfor_s = 40.0\n',
        f'kind = "box"\nname = "Open"\npolygon = {water}\n',
        'name = "End"\nlat = 50.82\nlon = -1.31\n',
    ]
    start = "[start]\nlat = 50.817\nlon = -1.31\n"
    (tmp_path / "m.toml").write_text('name = "m"\n' + start + "".join(f"[[goal]]\n{goal}" for goal in goals))
    mission = load_mission(tmp_path / "m.toml")
    plans = [SimpleNamespace(cost_s=39.0, has_path=True, legs=()) for _ in goals]
    lines = "\n".join(_words(mission, plans, tws_mps=6.0, twd_from_rad=math.radians(340.0)))
    wind = "in 6 m/s of wind from 340°"
    assert lines.startswith(
        f"256 s to all 5 goals {wind}: 195 s of sailing, 61 s of waiting, Open itself not counted\n"
    )
    assert "Gun: 39 s in 0 courses, then waits 21 s for the gun\n" in lines
    assert "Hour: 39 s in 0 courses, the gun is at 2026-11-21 13:00:00 UTC\n" in lines
    assert "Box: 39 s in 0 courses, then stays 40 s\n" in lines
    assert "Open: 39 s in 0 courses, then stays until told, which is not counted\n" in lines
    assert "End: 39 s in 0 courses\n" in lines


def first_problem(mission, unix_s=None):
    return next(legs(mission, WIND, unix_s=unix_s))


def test_a_preview_reckons_with_the_current_and_the_wind_over_the_water(mission_with):
    problem = first_problem(load_mission(SOUTH))
    assert (problem.current.set_rad, problem.current.drift_mps) == pytest.approx((0.5 * math.pi, 0.4))
    from_rad, tws = over_water(0.0, 5.0, (0.4, 0.0))
    assert problem.wind.twd_from_rad == pytest.approx(from_rad)
    assert problem.wind.tws_mps == pytest.approx(tws)
    still = first_problem(mission_with(""))
    assert still.current.drift_mps == 0.0
    assert still.wind.twd_from_rad == 0.0


@pytest.mark.parametrize(
    ("current", "is_planned"),
    [
        ("set_deg = 90.0\ndrift_mps = 0.4\nsigma_mps = 0.15", True),
        ("set_deg = 90.0\ndrift_mps = 0.4\nsigma_mps = 0.3", False),  # it may as well be none
        ("set_deg = 90.0\ndrift_mps = 0.04\nsigma_mps = 0.02", False),  # too weak to matter
    ],
)
def test_a_preview_and_the_boat_at_the_start_agree_on_what_is_planned_for(mission_with, current, is_planned):
    mission = mission_with(current)
    on_board = CurrentEstimator(ardurover_sitl().speed_mps, water_of(mission))
    on_board.update(0.0, None, None)
    assert on_board.view().is_significant == is_planned
    assert expected_current(mission, None).is_significant == is_planned
    assert (first_problem(mission).current.drift_mps > 0.0) == is_planned


def test_each_leg_has_the_row_of_a_tide_table_that_it_begins_in(mission_with):
    mission = mission_with(
        'table = "tide.csv"\nsigma_mps = 0.1',
        ("time, set_deg, drift_mps\n2026-11-21T12:00:00Z, 90, 0.6\n2026-11-21T13:00:00Z, 270, 0.6\n"),
    )
    assert first_problem(mission, HIGH_S).current.set_rad == pytest.approx(0.5 * math.pi)
    assert first_problem(mission, HIGH_S + 3600.0).current.set_rad == pytest.approx(1.5 * math.pi)
    assert first_problem(mission).current.drift_mps == 0.0, "no row without a time"
    assert first_problem(mission, HIGH_S + 1e6).current.drift_mps == 0.0, "it has ended: not believed any more"


@pytest.mark.parametrize(("radius_m", "clear_m"), [(15.0, 12.0), (4.0, 8.0)])
def test_a_preview_aims_at_the_room_inside_the_radius_of_a_goal_by_a_quay_as_she_does(tmp_path, radius_m, clear_m):
    """8 m from it "no path (invalid)" was said of what she sails to; without room inside it still is."""
    ring = "-0.01 -0.01, 0.01 -0.01, 0.01 0.01, -0.01 0.01, -0.01 -0.01"
    (tmp_path / "fence.wkt").write_text(f"w|inclusion|POLYGON (({ring}))")
    (tmp_path / "m.toml").write_text(
        "[start]\nlat = 0.0\nlon = 0.0\n"
        f"[[goal]]\nlat = 0.00992765\nlon = 0.0\nradius_m = {radius_m}\n"
        '[area]\nfence = "fence.wkt"\nmargin_m = 12.0\nmargin_floor_m = 6.0\n'
    )
    mission = load_mission(tmp_path / "m.toml")
    problem = first_problem(mission)
    (aimed_m,) = mission.water().clearance_m([problem.goal_en])
    assert 0.0 <= aimed_m - clear_m < 1.0
    assert (endpoint_error(problem) is None) is (radius_m > 10.0)


def test_the_way_of_a_preview_is_another_in_a_stream_and_keeps_the_margin():
    mission = load_mission(SOUTH)
    found = planned_legs(legs(mission, WIND), lambda problem: plan(problem, expansions=2000))
    assert all(isinstance(p, Plan) and p.has_path for p in found)
    first = found[0].legs[0]
    course = math.atan2(first.to_en[0] - first.from_en[0], first.to_en[1] - first.from_en[1])
    assert abs(math.remainder(first.heading_rad - course, 2.0 * math.pi)) > math.radians(1.0), "she heads up"


def test_the_command_plans_in_it(capsys):
    assert cli.main(["plan", str(SOUTH), "--expansions", "2000"]) == 0
    assert "current: sets 090° 0.40 m/s; headings and angles are through the water" in capsys.readouterr().out


@pytest.mark.parametrize("more", ["", "no_go_error_deg = 4.0\n", "leeway_deg = 5.0\nno_go_error_deg = 4.0\n"])
def test_the_laylines_of_the_picture_are_those_that_plans_keep_to(tmp_path, more):
    (tmp_path / "m.toml").write_text(
        f'name = "m"\n[start]\nlat = 50.817\nlon = -1.31\n[[goal]]\nlat = 50.82\nlon = -1.31\n[boat]\n{more}'
    )
    mission = load_mission(tmp_path / "m.toml")
    problem = first_problem(mission)
    legs_sailed = plan(problem, expansions=5000).legs
    angle_rad = layline_rad(mission, WIND)
    assert angle_rad == pytest.approx(min(abs(leg.twa_rad) for leg in legs_sailed), abs=math.radians(2.0))
    assert angle_rad >= problem.no_go_half_rad(0.0) - 1e-6

"""No key, option or watchdog without a way to it through the program: what is promised must change something."""

import argparse
import ast
import datetime as dt
import inspect
import math
import tomllib
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import lab.options
import sitl.options
from companion import cli
from companion.commands.doctor import needs_of
from companion.compose import (
    config_of,
    displays_of,
    estimator_of,
    feeds_of,
    permissions_of,
    sounder_of,
    target_limits_of,
    voyage_of,
    water_of,
)
from companion.geofence import load_mission
from companion.geofence.mission.options import ATOMS, KINDS, tables
from companion.safety import CHOICES, ENDINGS, FAILSAFES, SETTINGS, TABLE, WORD_OF, End, Recovery
from companion.skipper.step.config import Permissions
from companion.skipper.way.gates import gates_of
from sitl import cli as sitl_cli
from sitl.scenario.scenario import load_scenario
from sitl.scenario.traffic import free_port

# One mission that has every table; the keys are given other values one by one.
MISSION = """
name = "m"
description = "d"
[start]
lat = 50.8170000
lon = -1.3100000
heading_deg = 90.0
[[goal]]
lat = 50.8190
lon = -1.3100
radius_m = 20.0
rounding = "port"
name = "mark"
[[goal]]
lat = 50.8195
lon = -1.3080
[[refuge]]
lat = 50.8172
lon = -1.3090
[area]
obstacles = ["rock.wkt"]
[operator]
arm = true
"""
ROCK = "POLYGON ((-1.3110 50.8180, -1.3105 50.8180, -1.3105 50.8183, -1.3110 50.8183, -1.3110 50.8180))"
FENCE = "POLYGON ((-1.32 50.81, -1.30 50.81, -1.30 50.83, -1.32 50.83, -1.32 50.81))"
POINT = "POINT (-1.3060 50.8175)"

# Of the kinds of goal that are no point: each in a goal of its own, behind the mission's.
TASKS = {
    "gate": {
        "kind": "gate",
        "port_mark": {"lat": 50.8200, "lon": -1.3090},
        "starboard_mark": {"lat": 50.8200, "lon": -1.3080},
        "mark_radius_m": 6.0,
        "after_s": 300.0,
    },
    "box": {"kind": "box", "polygon": "POLYGON ((-1.309 50.820, -1.308 50.820, -1.308 50.821, -1.309 50.820))"},
    "search": {
        "kind": "search",
        "swath_m": 20.0,
        "polygon": "POLYGON ((-1.309 50.820, -1.308 50.820, -1.308 50.821, -1.309 50.820))",
    },
    "field": {"kind": "field", "lat": 50.8196, "lon": -1.3082, "field": "a", "for_s": 100.0},
}
# The atoms of fields: one of each kind that has a key of its own.
HERE, THERE = {"lat": 50.8196, "lon": -1.3082}, {"lat": 50.8199, "lon": -1.3070}
ATOM = {
    "circle": {"kind": "circle", **HERE, "radius_m": 40.0},
    "line": {"kind": "line", "start": HERE, "end": THERE},
    "repulsive_point": {"kind": "repulsive_point", **HERE},
    "heading": {"kind": "heading", "heading_deg": 10.0},
    "leave": {"kind": "leave", "polygon": TASKS["box"]["polygon"]},
}
TASK_KEYS = {
    "kind": "gate",
    "port_mark": {"lat": 50.8200, "lon": -1.3092},
    "starboard_mark": {"lat": 50.8200, "lon": -1.3078},
    "polygon": "POLYGON ((-1.309 50.820, -1.3081 50.820, -1.3081 50.821, -1.309 50.820))",
    "for_s": 60.0,
    "swath_m": 30.0,
    "coverage": 0.5,
    "field": "2 * a",
    "until": "time",
    "mark_radius_m": 8.0,
    "after_s": 400.0,
    "not_before": dt.datetime(2026, 11, 21, 12, tzinfo=dt.UTC),
}

# The numbers of one planner or estimator: in a mission that asks for it.
ASTAR = {
    "expansions": 5000,
    "grid_m": 5.0,
    "room_m": 50.0,
    "goal_heading": "any",
    "turn_s_per_rad": 4.0,
    "tack_s": 9.0,
    "gybe_s": 9.0,
    "tunnel": "abrupt",
    "tunnel_width_m": 80.0,
    "heuristic_kn": 0.0,
    "min_twa_deg": 50.0,
    "max_twa_deg": 150.0,
    "max_turn_deg": 120.0,
    "ship_match_s": 30.0,
    "projection": "flat",
}
RRTSTAR = {"goal_bias": 0.1, "range_m": 70.0, "rewiring": False, "risk_weight_s": 20.0, "state_risk_weight_s": 30.0}
KALMAN = {"kalman_window": 50, "kalman_r_deg": 5.0, "kalman_r_mps": 1.0}

# Every key with another value than the mission's or its default.
OTHER = {
    "goal": {
        "lat": 50.8189,
        "lon": -1.3099,
        "radius_m": 30.0,
        "rounding": "starboard",
        "name": "other",
        "bandwidth_m": 200.0,
        "heading_deg": 40.0,
        **TASK_KEYS,
    },
    "field": {
        "kind": "station",
        "lat": 50.8197,
        "lon": -1.3083,
        "start": {"lat": 50.8191, "lon": -1.3083},
        "end": {"lat": 50.8190, "lon": -1.3070},
        "radius_m": 50.0,
        "turn": "anticlockwise",
        "zone_m": 9.0,
        "range_m": 30.0,
        "heading_deg": 20.0,
        "polygon": TASK_KEYS["polygon"],
    },
    "refuge": {"lat": 50.8173, "lon": -1.3091, "radius_m": 25.0, "name": "cove"},
    "start": {"lat": 50.8171, "lon": -1.3101, "heading_deg": 200.0},
    "area": {
        "obstacles": ["point.wkt"],
        "fence": "fence.wkt",
        "axis": "latlon",
        "margin_m": 14.0,
        "margin_floor_m": 7.0,
        "point_radius_m": 15.0,
        "under_keel_m": 1.0,
        "tide": "heights.csv",
        "drying": ["drying.geojson"],
    },
    "risk": {"delta_s": 0.8, "max_path_risk": 0.3},
    "boat": {
        "file": "boat.toml",
        "speed_error_percent": 20.0,
        "polar": 2.0,
        "no_go_half_deg": 50.0,
        "no_go_error_deg": 3.0,
        "learn": "shadow",
        "max_twa_deg": 170.0,
        "turn_rate_deg_s": 20.0,
        "tack_loss_s": 6.0,
        "gybe_loss_s": 3.0,
        "can_tack": False,
        "gybe_room_m": 40.0,
        "length_m": 3.0,
        "beam_m": 1.5,
        "motor": True,
        "draft_m": 0.8,
        "transducer_m": 0.3,
        "leeway_deg": 4.0,
        "max_tws_mps": 11.0,
        "min_tws_mps": 1.5,
        "tack_fails": 0.2,
    },
    "autopilot": {"system": 7, "frame": "motor"},
    "current": {"set_deg": 40.0, "drift_mps": 0.5, "sigma_mps": 0.3, "table": "tide.csv"},
    "wind": {"estimator": "mean90", "preview_from_deg": 40.0, "preview_speed_mps": 8.0, **KALMAN},
    "operator": {
        "arm": False,
        "set_auto": True,
        "guided": True,
        "upload_fence": True,
        "trim_vane": True,
        "replace_foreign": True,
        "orders": ["hold"],
        "local_orders": ["stop"],
        "far_orders": ["home"],
    },
    "skipper": {
        "replan": "forecast",
        "end": "home",
        "autopilot_beats": False,
        "shifts": True,
        "tacks_per_minute": 2.0,
        "guidance": "field",
        "station_s": 60.0,
        "laps": 2,
        "bandwidth_m": 90.0,
        "horizon_m": 3000.0,
        "planning_budget_s": 1.0,
        "expansions": 123,
        "seed": 7,
        "min_replan_s": 25.0,
        "max_replan_s": 700.0,
        "wind_shift_deg": 30.0,
        "off_track_m": 45.0,
        "voyage_timeout_s": 900.0,
        "planner": "astar",
    },
    "planner": {**ASTAR, **RRTSTAR},
    "passage": {"leg_m": 70_000.0, "recentre_m": 2000.0},
    "safety": {
        **{ending.key: next(str(end) for end in End if end is not ending.default) for ending in ENDINGS.values()},
        **{key: 10.0 if setting.default is None else setting.default * 0.5 for key, setting in SETTINGS.items()},
        **{
            cause.key: next(word for word in CHOICES if word != WORD_OF[cause.answer])
            for cause in FAILSAFES
            if cause.key
        },
    },
    "traffic": {
        "feeds": ["udpin:127.0.0.1:10110"],
        "safe_distance_m": 60.0,
        "safe_time_s": 80.0,
        "own_mmsi": 211234560,
        "drop_after_s": 300.0,
        "policy": "rules",
    },
    "sounder": {"feed": "udpin:127.0.0.1:10110"},
    "output": {"nmea": ["udp:127.0.0.1:10110"], "signalk": ["tcp:127.0.0.1:8375"], "signalk_token": "token"},
}
BOAT = """name = "b"
[boat]
length_m = 2.0
[polar]
tws_mps = [5.0]
twa_deg = [60, 180]
speed_mps = [[1.0], [1.5]]
"""
# What does not sail: pictures and previews, and what `companion run` itself takes. Tried below.
DRAWN = {("start", "heading_deg"), ("wind", "preview_from_deg")}
RUN = {("skipper", "expansions"), ("skipper", "seed"), ("autopilot", "system")}  # the last: test_whose


DRYING = (
    '{"type":"Feature","properties":{"kind":"exclusion","name":"the bar","depth_m":-0.5},"geometry":'
    '{"type":"Polygon","coordinates":[[[-1.32,50.8180],[-1.30,50.8180],[-1.30,50.8183],[-1.32,50.8183],'
    "[-1.32,50.8180]]]}}"
)


def folder_with(path):
    for name, text in (("rock.wkt", ROCK), ("fence.wkt", FENCE), ("point.wkt", POINT), ("boat.toml", BOAT)):
        (path / name).write_text(text)
    return path


def mission(path, table="", key="", value=None):
    """Return the mission with one key set."""
    import tomli_w

    raw = tomllib.loads(MISSION)
    if key == "signalk_token":
        raw["output"] = {"signalk": ["ws://127.0.0.1:3000"]}
    if table == "current":
        raw["current"] = {} if key == "table" else {"set_deg": 10.0, "drift_mps": 0.2}
        (path / "tide.csv").write_text("2026-11-21T12:00:00Z,90,0.6\n2026-11-21T13:00:00Z,90,0.2\n")
    if key == "drying":
        raw["boat"], raw["area"]["tide"] = {"draft_m": 1.0}, "heights.csv"
        (path / "drying.geojson").write_text(DRYING)
    if key in {"tide", "drying"}:
        (path / "heights.csv").write_text("2026-11-21T12:00:00Z, 3.1\n2026-11-21T18:00:00Z, 0.4\n")
    if table == "area" and key in {"axis", "point_radius_m"}:
        raw["area"]["obstacles"] = ["point.wkt"]
    if key in {"under_keel_m", "transducer_m"}:
        raw["boat"] = {"draft_m": 1.0}
    if (table, key) == ("area", "axis"):
        (path / "point.wkt").write_text("POINT (50.8175 -1.3060)")
    if table == "field":
        name = atom_with(key)
        raw["goal"].append(dict(TASKS["field"]))
        raw["field"] = {"a": dict(ATOM[name])}
        if value == "station":
            raw["field"]["a"] = {"kind": value, **HERE}
        elif value is not None:
            raw["field"]["a"][key] = value
    elif table == "goal" and key in {"field", "until"}:
        raw["goal"].append({**TASKS["field"], key: value})
        raw["field"] = {"a": dict(ATOM["circle"])}
    elif table == "goal" and key in TASK_KEYS:
        raw["goal"].append(dict(TASKS[value if key == "kind" else kind_with(key)]))
        if key == "not_before":
            del raw["goal"][-1]["after_s"]
        raw["goal"][-1][key] = value
    elif table == "goal-kind":
        raw["goal"].append(dict(TASKS[key]))
    elif table:
        for others, keys in (
            (RRTSTAR, {"skipper": {"planner": "rrtstar"}}),
            (ASTAR, {"skipper": {"planner": "astar"}}),
            (KALMAN, {"wind": {"estimator": "kalman"}}),
        ):
            if table in {"planner", "wind"} and key in others:
                raw |= keys
        if key == "recentre_m":
            raw["passage"] = {"leg_m": 60_000.0}
        if key == "tunnel":
            raw["planner"] = {"tunnel_width_m": 60.0}
        if (table, key) == ("goal", "heading_deg"):
            raw["skipper"] = {"planner": "astar"}
        if (table, key) == ("autopilot", "frame"):
            raw["boat"] = {"polar": 2.0}
        place = raw[table][0] if table in {"goal", "refuge"} else raw.setdefault(table, {})
        place[key] = value
    elif key:
        raw[key] = value
    (path / "m.toml").write_text(tomli_w.dumps(raw))
    return load_mission(path / "m.toml")


def kind_with(key):
    return next(kind for kind, options in KINDS.items() if kind != "point" and key in options.__struct_fields__)


def atom_with(key):
    return next(name for name, atom in ATOM.items() if key in {"kind", *ATOMS[name].__struct_fields__})


def base_for(path, table, key):
    if table == "current" and key != "table":
        return mission(path, "current", "sigma_mps", 0.2)
    if table == "field":
        return mission(path, "field", key)
    if table == "goal" and key in {"field", "until"}:
        return mission(path, "goal", key, TASKS["field"].get(key, "told"))
    if table == "goal" and key in TASK_KEYS and key != "kind":
        return mission(path, "goal-kind", kind_with(key))
    if key == "recentre_m":
        return mission(path, "passage", "leg_m", 60_000.0)
    if key == "tunnel":
        return mission(path, "planner", "tunnel_width_m", 60.0)
    if (table, key) == ("autopilot", "frame"):
        return mission(path, "boat", "polar", 2.0)
    if key in {"under_keel_m", "transducer_m"}:
        return mission(path, "boat", "draft_m", 1.0)
    if key == "drying":
        return mission(path, "area", "drying", [])
    if (table, key) == ("goal", "heading_deg"):
        return mission(path, "skipper", "planner", "astar")
    if table == "planner":
        return mission(path, "skipper", "planner", "rrtstar" if key in RRTSTAR else "astar")
    if key in KALMAN:
        return mission(path, "wind", "estimator", "kalman")
    if table == "area" and key == "point_radius_m":
        return mission(path, "area", "obstacles", ["point.wkt"])
    return mission(path)


def sailed(m):
    """Return what the program sails by, as plain text."""
    voyage, boat = voyage_of(m), voyage_of(m).boat
    speeds = [[round(boat.polar.speed_mps(twa, tws), 6) for twa in np.arange(0.6, 3.1, 0.3)] for tws in (3.0, 8.0)]
    rest = {f.name: getattr(boat, f.name) for f in fields(boat) if f.name != "polar"}
    estimator = estimator_of(m)
    for n in range(80):
        estimator.update(float(n), 0.3 * math.sin(n), 5.0 + math.cos(n))
    wind = estimator.forecast(60.0)
    return repr(
        (
            m.name,
            voyage.recentre_m,
            voyage.far_m,
            voyage.frame.origin,
            voyage.goals,
            voyage.laps,
            voyage.refuges,
            gates_of(voyage),
            voyage.area.obstacles_wkt(0.0),
            voyage.area.fence_wkt(0.0),
            [(w.name, w.opens_at_m, w.polygon.wkt) for w in voyage.drying],
            speeds,
            rest,
            config_of(m),
            permissions_of(m),
            target_limits_of(m),
            feeds_of(m),
            sounder_of(m),
            displays_of(m),
            type(estimator).__name__,
            wind,
            needs_of(m),
            water_of(m).at(None),
            water_of(m).at(1795262400.0),
        )
    )


def test_every_key_has_another_value_here():
    known = {(table, key) for table, keys in tables().items() if table for key in keys}
    assert {(table, key) for table, keys in OTHER.items() for key in keys} == known


@pytest.mark.parametrize(
    ("table", "key"), sorted({(table, key) for table, keys in OTHER.items() for key in keys} - DRAWN - RUN)
)
def test_every_key_changes_what_is_sailed(table, key, tmp_path):
    folder_with(tmp_path)
    before = sailed(base_for(tmp_path, table, key))
    assert sailed(mission(tmp_path, table, key, OTHER[table][key])) != before


def test_the_name_is_the_voyages():
    assert {"name", "description"} <= set(tables()[""])


def picture(m, out, *options):
    assert cli.main(["mission", "check", str(m.path), "--plot", str(out), *options]) == 0
    return out.read_bytes()


def test_what_only_previews_use_changes_the_picture(tmp_path, capsys):
    folder_with(tmp_path)
    plain = picture(mission(tmp_path), tmp_path / "a.png", "--no-plan")
    assert picture(mission(tmp_path, "", "description", "other"), tmp_path / "b.png", "--no-plan") != plain
    turned = mission(tmp_path, "wind", "preview_from_deg", OTHER["wind"]["preview_from_deg"])
    assert picture(turned, tmp_path / "c.png", "--no-plan") != plain
    capsys.readouterr()


def test_the_starts_heading_is_that_of_a_simulated_boat(tmp_path):
    from sitl.run.boats import heading_deg_of
    from sitl.scenario.scenario import Scenario

    folder_with(tmp_path)
    scenario = Scenario(name="s", mission="m.toml")
    assert heading_deg_of(scenario, mission(tmp_path)) == 90.0
    assert heading_deg_of(scenario, mission(tmp_path, "start", "heading_deg", 200.0)) == 200.0


def test_effort_and_seed_reach_the_voyage(tmp_path, capsys):
    """Nobody answers, and what it would have sailed with is in the folder."""
    folder_with(tmp_path)
    m = mission(tmp_path, "skipper", "expansions", 123)
    m.path.write_text(
        m.path.read_text() + "seed = 7\n"
        if m.path.read_text().rstrip().endswith("123")
        else m.path.read_text().replace("expansions = 123", "expansions = 123\nseed = 7")
    )
    code = cli.main(
        [
            "run",
            str(m.path),
            "--link",
            f"udpin:127.0.0.1:{free_port()}",
            "--out",
            str(tmp_path / "v"),
            "--wait",
            "0.1",
            "--state",
            str(tmp_path / "s.json"),
        ]
    )
    capsys.readouterr()
    assert code == 1
    run = tomllib.loads((tmp_path / "v" / "voyage.toml").read_text())["run"]
    assert (run["seed"], run["expansions"]) == (7, 123)


def test_every_permission_can_be_given(tmp_path):
    """A permission that no mission gives is a rule that nobody can reach."""
    import tomli_w

    folder_with(tmp_path)
    raw = tomllib.loads(MISSION)
    raw["operator"] = {**OTHER["operator"], "arm": True}
    (tmp_path / "m.toml").write_text(tomli_w.dumps(raw))
    given = permissions_of(load_mission(tmp_path / "m.toml"))
    assert {f.name for f in fields(Permissions) if not getattr(given, f.name)} == set()


def options_of(parser):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for sub in action.choices.values():
                yield from options_of(sub)
        elif action.dest not in {"help", "version", argparse.SUPPRESS}:
            yield action.dest


def read_names(package):
    """Return every attribute that the command modules read, and every name given to getattr.

    The options that rehearsals and campaigns share are read where they are made.
    """
    names = set()
    shared = [] if package.__name__ == "companion.commands" else [sitl.options, lab.options]
    for path in (*Path(inspect.getfile(package)).parent.rglob("*.py"), *map(Path, map(inspect.getfile, shared))):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load):
                names.add(node.attr)
            elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "getattr":
                names |= {a.value for a in node.args if isinstance(a, ast.Constant)}
    return names


@pytest.mark.parametrize(
    ("program", "of"),
    [(cli.PROGRAM, cli.PROGRAM), (sitl_cli.PROGRAM, sitl_cli.PROGRAM), (sitl_cli.PROGRAM, sitl_cli.LABORATORY)],
)
def test_every_option_is_read(program, of):
    read = read_names(import_module(of.package))
    unread = {
        (name, dest)
        for name in of.commands
        for dest in options_of(program.parser(name))
        if dest not in read and dest != "command"
    }
    assert unread == set()


def test_every_option_of_the_companions_guest_is_read():
    read = read_names(import_module("sitl.rehearse"))
    assert set(options_of(cli.PROGRAM.parser("rehearse").commands["rehearse"])) - read == set()


def test_every_watchdog_is_raised_in_a_scenario():
    """By the autopilot's own messages: the scenario files say which, and the suites sail them."""
    told = {}
    for path in Path("sitl/scenarios").glob("*.toml"):
        for code in load_scenario(path).expect.alerts:
            told.setdefault(code, path.stem)
    assert {dog.name for dog in TABLE} <= set(told)


def test_every_failsafe_that_is_answered_is_in_a_scenario():
    told = {code for path in Path("sitl/scenarios").glob("*.toml") for code in load_scenario(path).expect.alerts}
    answered = {f"{cause.name} failsafe" for cause in FAILSAFES if cause.answer is not Recovery.LEAVE}
    assert answered - told == set()

"""The doctor: each setting that would spoil a voyage is found, nothing is changed unasked, what is set reads back."""

import math
import re
from dataclasses import replace
from functools import partial

import pytest

from companion.boat import AutopilotLimits, steering_of
from companion.cli import main
from companion.clock import run_virtual
from companion.commands.doctor import as_json, as_text, diagnose, limits_at, needs_of
from companion.doctor import Examined, Level, Needs, examine
from companion.errors import LinkError
from companion.geofence import load_mission
from companion.mavlink.signing import EPOCH_S, TICKS_PER_S, SigningStore
from companion.messages import GeoPoint, MissionItem
from lab.campaigns.signed_link import Signer
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.autopilot.memory_link import frames
from sitl.world.environment import parse_wind
from tests.doctor.test_steering import RIGHT_FF, steered
from tests.page.asking import free_port
from tests.sitl.boats import boat_process

# ArduRover's sailboat as `sim_vehicle.py -f sailboat` starts it.
DEFAULTS = {
    "FRAME_CLASS": 2.0,
    "SAIL_ENABLE": 1.0,
    "SAIL_NO_GO_ANGLE": 45.0,
    "SAIL_XTRACK_MAX": 10.0,
    "SAIL_LOIT_RADIUS": 5.0,
    "LOIT_TYPE": 1.0,
    "WNDVN_TYPE": 4.0,
    "WNDVN_SPEED_TYPE": 4.0,
    "WNDVN_SPEED_MIN": 0.0,
    "WNDVN_TRUE_FILT": 0.05,
    "WP_RADIUS": 3.0,
    "TURN_RADIUS": 0.9,
    "AVOID_ENABLE": 3.0,
    "OA_TYPE": 0.0,
    "MIS_RESTART": 0.0,
    "MIS_DONE_BEHAVE": 1.0,
    "FENCE_ENABLE": 0.0,
    "FENCE_TYPE": 6.0,
    "FENCE_RADIUS": 300.0,
    "FENCE_ACTION": 1.0,
    "FS_THR_ENABLE": 1.0,
    "FS_GCS_ENABLE": 0.0,
    "FS_ACTION": 2.0,
    "FS_EKF_ACTION": 1.0,
    "FS_CRASH_CHECK": 0.0,
    "CRASH_ANGLE": 0.0,
    "BATT_MONITOR": 4.0,
    "BATT_FS_LOW_ACT": 0.0,
    "SYSID_THISMAV": 1.0,
    "SYSID_MYGCS": 255.0,
}
RATES = {"WIND": 2.0, "GLOBAL_POSITION_INT": 5.0, "ATTITUDE": 5.0, "MISSION_CURRENT": 1.0, "EKF_STATUS_REPORT": 1.0}
GOOD = {**DEFAULTS, "AVOID_ENABLE": 0.0, "FS_THR_ENABLE": 2.0}


def seen(**changes):
    parameters = {**GOOD, **{k: v for k, v in changes.items() if k.isupper()}}
    rest = {k: v for k, v in changes.items() if not k.isupper()}
    return Examined(
        **{
            "parameters": parameters,
            "version": (4, 6, 0),
            "mission": (),
            "fence": (),
            "rates_hz": RATES,
            "system_id": 1,
            **rest,
        }
    )


def codes(findings, level):
    return {f.code for f in findings if f.level is level}


def test_a_boat_that_is_set_up_has_nothing_in_its_way():
    findings = examine(seen(), Needs(speed_mps=2.5))
    assert codes(findings, Level.ERROR) == set()
    assert codes(findings, Level.WARNING) == set()


# An NMEA sounder on a port of its own, as 4.6 and before call its reach; 4.7 has metres.
NMEA = {"RNGFND1_TYPE": 17.0, "RNGFND1_ORIENT": 25.0, "SERIAL1_PROTOCOL": 2.0, "SERIAL4_PROTOCOL": 9.0}
REACH = {"RNGFND1_MIN_CM": 20.0, "RNGFND1_MAX_CM": 10000.0}
KEEL = {"least_depth_m": 1.5}


@pytest.mark.parametrize(
    ("changes", "needs", "level", "name", "wanted"),
    [
        ({"RNGFND1_TYPE": 0.0}, KEEL, Level.INFO, "RNGFND1_TYPE", None),
        ({**NMEA, **REACH, "RNGFND1_ORIENT": 0.0}, KEEL, Level.WARNING, "RNGFND1_ORIENT", 25.0),
        ({"RNGFND1_TYPE": 20.0, "RNGFND1_ORIENT": 0.0}, KEEL, Level.WARNING, None, None),
        ({**NMEA, **REACH, "SERIAL4_PROTOCOL": 5.0}, KEEL, Level.WARNING, None, None),
        ({**NMEA, **REACH, "RNGFND1_MAX_CM": 600.0}, KEEL, Level.WARNING, "RNGFND1_MAX_CM", 1200.0),
        ({**NMEA, "RNGFND1_MIN": 0.2, "RNGFND1_MAX": 6.0}, KEEL, Level.WARNING, "RNGFND1_MAX", 12.0),
        ({**NMEA, **REACH, "RNGFND1_MIN_CM": 200.0}, KEEL, Level.WARNING, "RNGFND1_MIN_CM", 20.0),
        ({**NMEA, "RNGFND1_MIN": 1.6, "RNGFND1_MAX": 50.0}, KEEL, Level.WARNING, "RNGFND1_MIN", 0.2),
        (
            {"RNGFND1_TYPE": 20.0, "RNGFND1_ORIENT": 0.0, "RNGFND3_TYPE": 17.0, "RNGFND3_ORIENT": 25.0}
            | {"SERIAL4_PROTOCOL": 9.0, "RNGFND3_MAX_CM": 300.0},
            KEEL,
            Level.WARNING,
            "RNGFND3_MAX_CM",
            1200.0,
        ),
    ],
)
def test_what_a_boat_whose_depth_is_watched_needs_of_a_rangefinder(changes, needs, level, name, wanted):
    found = [f for f in examine(seen(**changes), Needs(speed_mps=2.5, **needs)) if f.code == "sounder"]
    assert [(f.level, f.parameter, f.wanted) for f in found] == [(level, name, wanted)]
    assert [f for f in examine(seen(**changes), Needs(speed_mps=2.5)) if f.code == "sounder"] == [], "not watched"


@pytest.mark.parametrize("reach", [REACH, {"RNGFND1_MIN": 0.2, "RNGFND1_MAX": 100.0}, {}])
def test_a_sounder_that_is_set_up_is_not_complained_of_and_that_the_autopilot_does_nothing_by_it_is_said(reach):
    findings = examine(seen(**NMEA, **reach), Needs(speed_mps=2.5, **KEEL))
    assert [f for f in findings if f.code == "sounder"] == []
    (none,) = [f for f in findings if f.code == "depth failsafe"]
    assert none.level is Level.INFO
    assert "no depth failsafe of its own" in none.what
    assert "depth failsafe" not in {f.code for f in examine(seen(**NMEA), Needs(speed_mps=2.5))}


def test_the_depth_that_the_doctor_asks_for_is_the_missions():
    assert needs_of(load_mission("sitl/missions/shoaling.toml")).least_depth_m == pytest.approx(2.5)
    assert needs_of(load_mission("missions/bay.toml")).least_depth_m is None


@pytest.mark.parametrize(
    ("changes", "needs", "code", "level", "name", "wanted"),
    [
        ({"SAIL_ENABLE": 0.0}, {}, "sail_enable", Level.ERROR, "SAIL_ENABLE", 1.0),
        ({"FRAME_CLASS": 1.0}, {}, "frame_class", Level.ERROR, "FRAME_CLASS", 2.0),
        ({"SAIL_ENABLE": 1.0}, {"sails": False}, "sail_enable", Level.ERROR, "SAIL_ENABLE", 0.0),
        ({"FRAME_CLASS": 1.0, "SAIL_ENABLE": 0.0}, {"sails": False}, "frame_class", Level.ERROR, "FRAME_CLASS", 2.0),
        ({"SAIL_NO_GO_ANGLE": 90.0}, {}, "impossible", Level.ERROR, "SAIL_NO_GO_ANGLE", None),
        ({"WP_RADIUS": -1.0}, {}, "impossible", Level.ERROR, "WP_RADIUS", None),
        ({"uid": ""}, {}, "board", Level.INFO, None, None),
        ({"WNDVN_TYPE": 0.0}, {}, "vane", Level.ERROR, "WNDVN_TYPE", None),
        ({"WNDVN_TYPE": 1.0}, {}, "vane", Level.ERROR, "WNDVN_TYPE", None),
        ({"WNDVN_TYPE": 11.0}, {}, "vane", Level.ERROR, "WNDVN_TYPE", 10.0),
        ({"WNDVN_SPEED_TYPE": 0.0}, {}, "wind speed", Level.WARNING, "WNDVN_SPEED_TYPE", None),
        ({"WNDVN_TRUE_FILT": 0.01}, {}, "wind filter", Level.WARNING, "WNDVN_TRUE_FILT", 0.05),
        ({"SAIL_XTRACK_MAX": 30.0}, {}, "margin", Level.WARNING, "SAIL_XTRACK_MAX", 10.0),
        ({"SAIL_XTRACK_MAX": 0.0}, {}, "corridor", Level.WARNING, "SAIL_XTRACK_MAX", 10.0),
        ({"SAIL_XTRACK_MAX": 2.0}, {}, "corridor", Level.WARNING, "SAIL_XTRACK_MAX", 10.0),
        ({}, {"margin_m": 12.0}, "margin", Level.WARNING, "SAIL_XTRACK_MAX", 7.0),
        ({}, {"margin_m": 10.0}, "margin", Level.WARNING, "SAIL_XTRACK_MAX", None),
        ({}, {"can_tack": False}, "corridor", Level.WARNING, "SAIL_XTRACK_MAX", 0.0),
        ({"SAIL_NO_GO_ANGLE": 35.0}, {}, "no-go", Level.WARNING, "SAIL_NO_GO_ANGLE", 45.0),
        ({"SAIL_LOIT_RADIUS": 20.0}, {}, "loiter", Level.WARNING, "SAIL_LOIT_RADIUS", 6.0),
        ({"WP_RADIUS": 15.0}, {"margin_m": 30.0}, "waypoint radius", Level.WARNING, "WP_RADIUS", 3.0),
        ({"AVOID_ENABLE": 7.0}, {}, "avoidance", Level.WARNING, "AVOID_ENABLE", 0.0),
        ({"OA_TYPE": 2.0}, {}, "two planners", Level.WARNING, "OA_TYPE", 0.0),
        ({"MIS_RESTART": 1.0}, {}, "mis_restart", Level.WARNING, "MIS_RESTART", 0.0),
        ({"FENCE_ENABLE": 1.0}, {"reach_m": 400.0, "margin_m": 40.0}, "home circle", Level.ERROR, "FENCE_TYPE", 4.0),
        (
            {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0},
            {"margin_m": 40.0},
            "empty fence",
            Level.WARNING,
            "FENCE_ENABLE",
            0.0,
        ),
        ({}, {"has_fence": True, "reach_m": 10.0}, "fence off", Level.WARNING, "FENCE_ENABLE", 1.0),
        (
            {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 0.0},
            {"margin_m": 40.0},
            "fence action",
            Level.WARNING,
            "FENCE_ACTION",
            1.0,
        ),
        ({"FS_THR_ENABLE": 1.0, "FS_ACTION": 1.0}, {}, "radio failsafe", Level.WARNING, "FS_THR_ENABLE", 2.0),
        ({"FS_GCS_ENABLE": 1.0, "FS_ACTION": 6.0}, {}, "station failsafe", Level.WARNING, "FS_GCS_ENABLE", 2.0),
        (
            {"FS_GCS_ENABLE": 2.0, "FS_THR_ENABLE": 1.0, "FS_ACTION": 1.0},
            {},
            "station failsafe",
            Level.WARNING,
            "FS_THR_ENABLE",
            2.0,
        ),
        # HOLD is no failsafe for a sailboat, for a motor boat it is
        ({"FS_THR_ENABLE": 1.0}, {}, "radio failsafe", Level.ERROR, "FS_THR_ENABLE", 2.0),
        ({"FS_THR_ENABLE": 1.0}, {"sails": False}, "radio failsafe", Level.WARNING, "FS_THR_ENABLE", 2.0),
        ({"FS_GCS_ENABLE": 1.0}, {}, "station failsafe", Level.ERROR, "FS_GCS_ENABLE", 2.0),
        (
            {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 2.0},
            {"margin_m": 40.0},
            "fence action",
            Level.ERROR,
            "FENCE_ACTION",
            1.0,
        ),
        (
            {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 4.0},
            {"margin_m": 40.0},
            "fence action",
            Level.ERROR,
            "FENCE_ACTION",
            1.0,
        ),
        (
            {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 2.0},
            {"margin_m": 40.0, "sails": False},
            "fence action",
            Level.INFO,
            "FENCE_ACTION",
            None,
        ),
        ({"BATT_FS_LOW_ACT": 2.0}, {}, "battery failsafe", Level.ERROR, "BATT_FS_LOW_ACT", 1.0),
        ({"BATT_FS_CRT_ACT": 5.0}, {}, "battery failsafe", Level.ERROR, "BATT_FS_CRT_ACT", 1.0),
        ({"FS_EKF_ACTION": 0.0}, {}, "EKF failsafe", Level.WARNING, "FS_EKF_ACTION", 1.0),
        ({"FS_EKF_ACTION": 2.0}, {}, "EKF failsafe", Level.WARNING, "FS_EKF_ACTION", 1.0),
        ({"CRASH_ANGLE": 30.0}, {}, "crash check", Level.WARNING, "CRASH_ANGLE", 0.0),
        ({"SYSID_MYGCS": 1.0}, {}, "system id", Level.ERROR, "SYSID_MYGCS", 255.0),
        ({"system_id": 2}, {}, "system id", Level.WARNING, "SYSID_THISMAV", None),
        ({"version": (4, 0, 0)}, {}, "version", Level.WARNING, None, None),
        ({"version": (4, 2, 3)}, {}, "version", Level.WARNING, None, None),
        ({"mission": None}, {}, "mission", Level.WARNING, None, None),
        ({"mission": (MissionItem(command=16, lat_e7=1, lon_e7=1),)}, {}, "mission end", Level.WARNING, None, None),
        ({"fence": (MissionItem(command=5001),) * 90}, {}, "fence size", Level.ERROR, None, None),
        ({"rates_hz": {**RATES, "WIND": 0.0}}, {}, "streams", Level.ERROR, None, None),
        ({"rates_hz": {**RATES, "ATTITUDE": 0.3}}, {}, "streams", Level.WARNING, None, None),
    ],
)
def test_what_would_spoil_a_voyage_is_found(changes, needs, code, level, name, wanted):
    findings = [
        f for f in examine(seen(**changes), Needs(**{"speed_mps": 2.5, **needs})) if f.code == code and f.level is level
    ]
    assert len(findings) == 1, [f.code for f in examine(seen(**changes), Needs(**needs))]
    assert findings[0].parameter == name
    assert findings[0].wanted == wanted
    assert findings[0].why


def test_names_of_4_7_are_understood():
    parameters = {k: v for k, v in GOOD.items() if not k.startswith("SYSID")}
    parameters |= {"MAV_SYSID": 1.0, "MAV_GCS_SYSID": 1.0}
    assert "system id" in codes(examine(seen(parameters=parameters), Needs()), Level.ERROR)


def test_silence_points_at_signing_only_where_signatures_are_heard():
    findings = examine(seen(parameters={}, is_signed=True), Needs())
    assert {"signing", "no parameters"} <= codes(findings, Level.ERROR)
    assert "not signed" in next(f.why for f in findings if f.code == "no parameters")
    findings = examine(seen(parameters={}), Needs())
    assert "signing" not in codes(findings, Level.ERROR)
    assert "another program" in next(f.why for f in findings if f.code == "no parameters")


def test_what_is_wanted_cures():
    """Setting what the findings want leaves no finding that wants something else (no two that fight)."""
    parameters = {
        **DEFAULTS,
        "SAIL_XTRACK_MAX": 30.0,
        "WP_RADIUS": 15.0,
        "OA_TYPE": 2.0,
        "FENCE_ENABLE": 1.0,
        "FS_GCS_ENABLE": 1.0,
        "SAIL_LOIT_RADIUS": 20.0,
        "CRASH_ANGLE": 10.0,
    }
    needs = Needs(reach_m=500.0, margin_m=25.0, speed_mps=2.5)
    for _ in range(3):
        for finding in examine(seen(parameters=parameters, fence=(MissionItem(command=5001),)), needs):
            if finding.wanted is not None and finding.level > Level.INFO:
                parameters[finding.parameter] = finding.wanted
    left = examine(seen(parameters=parameters, fence=(MissionItem(command=5001),)), needs)
    assert [f for f in left if f.level > Level.INFO and f.wanted is not None] == []


def advice(needs, **changes):
    return [f for f in examine(seen(**changes), needs) if f.code in {"corridor", "margin"}]


@pytest.mark.parametrize("fence", [{}, {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 1.0, "FENCE_TYPE": 4.0}])
@pytest.mark.parametrize("corridor_m", [0.0, 1.0, 2.0, 5.0, 8.0, 10.0, 15.0, 30.0])
@pytest.mark.parametrize("speed_mps", [0.8, 1.5, 2.5, 2.93, 4.0])
@pytest.mark.parametrize("margin_m", [4.0, 8.0, 12.0, 15.0, 20.0, 40.0])
def test_corridor_and_margin_do_not_fight(fence, corridor_m, speed_mps, margin_m):
    """One setting cures; where no corridor does, the margin that is named; a fence changes neither."""
    needs = Needs(speed_mps=speed_mps, margin_m=margin_m)
    first = advice(needs, SAIL_XTRACK_MAX=corridor_m, **fence)
    assert [(f.code, f.wanted) for f in first] == [
        (f.code, f.wanted) for f in advice(needs, SAIL_XTRACK_MAX=corridor_m)
    ]
    wanted = {f.wanted for f in first if f.wanted is not None}
    assert len(wanted) <= 1
    set_to = next(iter(wanted), corridor_m)
    assert set_to * 2.0 * math.sqrt(2.0) / speed_mps >= 5.0 or not first  # a board outlasts the time between tacks
    again = advice(needs, SAIL_XTRACK_MAX=set_to, **fence)
    assert not [f for f in again if f.wanted is not None]
    if again:
        named_m = float(re.search(r"margin_m = (\d+)", again[0].why)[1])
        assert named_m > margin_m
        assert advice(replace(needs, margin_m=named_m), SAIL_XTRACK_MAX=set_to, **fence) == []


def test_a_new_mission_has_the_margin_that_the_doctor_finds_enough(tmp_path, capsys):
    with boat_process("--warm", "--moored", "--param", "SAIL_XTRACK_MAX=14") as (host, tcp, _):
        link = f"tcp:{host}:{tcp}"
        for name, options in (("default", []), ("asked", ["--link", link])):
            path = tmp_path / f"{name}.toml"
            assert main(["mission", "new", str(path), "--start", "51.1,-1.3", "--goal", "51.101,-1.3", *options]) == 0
            mission = load_mission(path)
            limits = limits_at(link) if options else AutopilotLimits()
            assert limits.sail_xtrack_max_m == (14.0 if options else 10.0)
            assert f"margin_m = {mission.margin_m:g}: " in capsys.readouterr().out
            findings = examine(seen(SAIL_XTRACK_MAX=limits.sail_xtrack_max_m), needs_of(mission))
            assert not [f for f in findings if f.code in {"corridor", "margin"}]
            assert 0.0 < mission.margin_floor_m < mission.margin_m
    assert load_mission(tmp_path / "asked.toml").margin_m > load_mission(tmp_path / "default.toml").margin_m


def doctor(parameters, *, apply=False, prepare=None, signing=None, steering=None):
    """Run the doctor against the simulated autopilot over a link in memory."""

    async def consult():
        autopilot = SimulatedAutopilot(
            AutopilotConfig(
                home=GeoPoint(lat_deg=50.8, lon_deg=-1.3),
                heading_rad=0.0,
                is_warm=True,
                is_moored=True,
                parameters=parameters,
            ),
            parse_wind("5@0"),
            seed=1,
        )
        link = MemoryLink("doctor", seed=1)
        if prepare is not None:
            prepare(link)
        async with serve(autopilot, [link.far]):
            return await diagnose(
                link.near, Needs(speed_mps=2.5), apply=apply, signing=signing, wait_s=5.0, steering=steering
            )

    return run_virtual(consult())


@pytest.fixture(scope="module")
def consulted():
    return doctor({"OA_TYPE": 2.0, "AVOID_ENABLE": 3.0}, apply=True)


def test_the_doctor_reads_a_living_autopilot_and_changes_nothing_unasked():
    findings, changes = doctor({"OA_TYPE": 2.0, "AVOID_ENABLE": 3.0}, apply=False)
    assert changes == ()
    assert {"two planners", "avoidance"} <= codes(findings, Level.WARNING)
    assert not any(f.code == "streams" for f in findings)
    text = as_text(findings, changes, applied=False)
    assert "set OA_TYPE 0 (now 2)" in text
    assert "nothing was changed" in text


def test_what_a_value_hid_that_was_set_is_told_at_once():
    """The next run of the doctor found a warning that was true in the first."""
    hiding = {"FENCE_ENABLE": 40.0, "FENCE_RADIUS": 2.0, "FS_ACTION": 3.0}
    findings, changes = doctor(hiding, apply=True)
    assert "empty fence" in codes(findings, Level.WARNING) | codes(findings, Level.ERROR)
    assert {change.name: change.after for change in changes}["FENCE_ENABLE"] == 0.0


def test_apply_sets_and_reads_back(consulted):
    findings, changes = consulted
    done = {c.name: c for c in changes}
    assert done["OA_TYPE"].is_done
    assert done["AVOID_ENABLE"].after == 0.0
    data = as_json(findings, changes)
    assert {c["parameter"] for c in data["changes"]} == set(done)
    assert all(math.isfinite(c["wanted"]) for c in data["changes"])


@pytest.mark.parametrize(("now", "wanted"), [(0.4, 0.52), (RIGHT_FF, None)])
def test_beside_a_living_autopilot_logs_are_held_against_what_it_has_and_of_them_nothing_is_set(now, wanted):
    """The log was sailed by 0.4, whatever is set since."""
    steering = steering_of([steered(ATC_STR_RAT_FF=0.4)])
    findings, changes = doctor({"OA_TYPE": 2.0, "ATC_STR_RAT_FF": now}, apply=True, steering=steering)
    tuning = {f.code: f for f in findings}["tuning FF"]
    assert tuning.value == pytest.approx(now)
    assert tuning.wanted == wanted
    assert "OA_TYPE" in {c.name for c in changes}
    assert not {"ATC_STR_RAT_FF", "SAIL_ANGLE_IDEAL"} & {c.name for c in changes}
    text = as_text(findings, changes, applied=True)
    assert ("set ATC_STR_RAT_FF 0.52 (now 0.4)" in text) is (wanted is not None)
    assert "apply   ATC_STR_RAT_FF" not in text
    data = as_json(findings, changes)
    assert "ATC_STR_RAT_FF" not in {c["parameter"] for c in data["changes"]}


KEY = bytes(range(32))
STAMP = 10**13


def sign(link, *, is_strict=True):
    """Let the autopilot sign what it sends and, if strict, hear only what is signed."""
    answer, ask, signer = link.far.write, link.near.write, Signer(KEY, STAMP)
    link.far.write = lambda data: answer(b"".join(map(signer.sign, frames(data))))
    link.near.write = lambda data: ask(b"".join(f for f in frames(data) if f[2] & 1 or not is_strict))


@pytest.mark.parametrize(
    ("is_strict", "level", "words"),
    [(True, Level.ERROR, "refuses what is not signed"), (False, Level.WARNING, "as on USB")],
)
def test_an_autopilot_that_signs_is_recognised(is_strict, level, words):
    findings, _ = doctor({}, prepare=partial(sign, is_strict=is_strict))
    signing = next(f for f in findings if f.code == "signing")
    assert signing.level is level
    assert words in signing.why
    assert ("no parameters" in codes(findings, Level.ERROR)) == is_strict


def test_with_the_key_a_signed_autopilot_answers_and_with_another_it_is_said(tmp_path):
    def store(name, key):
        file = tmp_path / name
        file.write_text(key.hex())
        file.chmod(0o600)
        return SigningStore(file, EPOCH_S + STAMP / TICKS_PER_S)

    findings, _ = doctor({}, prepare=sign, signing=store("right", KEY))
    assert not {"signing", "no parameters", "streams"} & {f.code for f in findings}
    with pytest.raises(LinkError, match="not signed with this key"):
        doctor({}, prepare=sign, signing=store("wrong", KEY[::-1]))


@pytest.mark.parametrize(
    ("speed", "level", "words"),
    [(0.87, Level.INFO, "87 % of the reference core"), (0.25, Level.INFO, "25 %"), (0.02, Level.WARNING, "2 %")],
)
def test_how_fast_this_computer_plans_is_said(speed, level, words):
    found = [
        f
        for f in examine(Examined(parameters={"FRAME_CLASS": 2.0}, planner_speed=speed), Needs())
        if f.code == "computer"
    ]
    assert [f.level for f in found] == [level]
    assert words in found[0].what


def test_the_doctor_says_at_once_what_it_does(capsys):
    """It was silent for a quarter of a minute, and for half of one where nobody is."""
    link = f"udpin:127.0.0.1:{free_port()}"
    assert main(["doctor", "--link", link, "--wait", "0.2"]) == 1
    first = capsys.readouterr().err.splitlines()[0]
    assert first == f"looking at the autopilot on {link}: about a quarter of a minute, by radio longer"

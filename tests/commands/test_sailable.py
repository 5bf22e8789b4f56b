"""One validation for who checks a mission and who sails it: what fails or is passed over under way is told before."""

import socket
from pathlib import Path

import pytest
import shapely

from companion import cli
from companion.commands.output import summary
from companion.compose import voyage_of
from companion.errors import InputError
from companion.geofence import Code, Document, FindingLevel, ZoneKind, load_mission
from companion.geofence.document import Mark
from companion.mission_check import check_mission, require_sailable
from companion.skipper.way.gates import Approach, gates_of
from sitl import cli as sitl_cli
from sitl.commands import run as sitl_run
from sitl.run.embedded import permitted
from sitl.scenario.scenario import load_scenario

START = "[start]\nlat = 50.8200\nlon = -1.3100\n"
PLACE = "[[goal]]\nlat = {}\nlon = -1.3100\nradius_m = {}\n"
MISSIONS = Path(__file__).parents[2] / "missions"
SCENARIOS = sorted((Path(sitl_run.__file__).parents[1] / "scenarios").glob("*.toml"))
GOOD = (MISSIONS / "archipelago.toml").read_text()
BAD = [
    (
        "estimator",
        '[wind]\nestimator = "kalmann"\n',
        "[wind] estimator: 'kalmann' is no wind estimator; did you mean 'kalman'?",
    ),
    (
        "choice",
        '[skipper]\nguidance = "fields"\n',
        """[skipper] guidance: 'fields' is none of the choices; write "plan" or "heading" or "field\"""",
    ),
    ("order", '[operator]\norders = ["holdd"]\n', "[operator] orders: there is no order 'holdd'; did you mean hold?\n"),
    ("feed", '[traffic]\nfeeds = ["upd:1234"]\n', "[traffic] feeds: 'upd:1234' is not a feed; write udpin:HOST:PORT"),
    ("floor", "margin_floor_m = 20.0", "[area] margin_floor_m: 20 m is more than margin_m"),
    ("field", '[skipper]\nguidance = "field"\n', '[skipper] guidance: "field" steers in GUIDED, which nobody allows'),
    ("heading", '[skipper]\nguidance = "heading"\n', "write guided = true in [operator]"),
    ("replan", "[skipper]\nmin_replan_s = 60.0\nmax_replan_s = 30.0\n", "[skipper] max_replan_s: 30 s is less than"),
    (
        "numbers",
        '[skipper]\nplanner = "astar"\n[planner]\nrewiring = false\n',
        "[planner] rewiring: is a number of 'rrtstar', and this mission plans by 'astar'",
    ),
    ("numbers of none", "[planner]\ngrid_m = 5.0\n", "[planner] grid_m: is a number of 'astar'"),
    ("effort", "[planner]\nexpansions = 5\n", "[planner] expansions: is for"),
    (
        "tunnel",
        '[skipper]\nplanner = "astar"\n[planner]\ntunnel = "abrupt"\n',
        "[planner] tunnel: a tunnel has a width",
    ),
    (
        "goal heading",
        "[[goal]]\nheading_deg = 40.0\n",
        "[[goal]] 1 heading_deg: is for 'astar', and this mission plans by",
    ),
    (
        "projection",
        '[planner]\nprojection = "flat"\n',
        "[planner] projection: is a number of 'astar', and this mission plans by 'auto'",
    ),
    ("filter", "[wind]\nkalman_window = 50\n", "[wind] kalman_window: is for the estimator"),
    ("polar", '[boat]\npolar = "ardurovr"\n', "[boat] polar: there is no polar 'ardurovr'"),
]


def written(folder, change):
    for name in ("archipelago.wkt", "archipelago-shore.wkt"):
        (folder / name).write_text((MISSIONS / name).read_text())
    text = GOOD
    if change.startswith("margin_floor_m"):
        text = "\n".join(line for line in text.splitlines() if "margin_floor_m" not in line)
        text = text.replace("[area]", f"[area]\n{change}")
    elif change:
        table = change.splitlines()[0]
        text = text.replace(table, change.rstrip()) if table in text else f"{text}\n{change}"
    (folder / "m.toml").write_text(text)
    return folder / "m.toml"


@pytest.mark.parametrize(("what", "change", "words"), BAD, ids=[b[0] for b in BAD])
def test_check_and_run_refuse_the_same_in_the_same_words(tmp_path, capsys, what, change, words):
    path = written(tmp_path, change)
    said = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        link = f"udpin:127.0.0.1:{free.getsockname()[1]}"  # nothing is opened before the mission is believed
        for argv in (
            ["mission", "check", str(path)],
            ["run", str(path), "--link", link, "--wait", "0.1"],
            ["doctor", "--mission", str(path), "--link", link],
        ):
            assert cli.main(argv) == 2, argv
            error = capsys.readouterr().err
            assert error.count("\n") == 1
            said.append(error.split(": ", 1)[1])
    assert words in said[0]
    assert said[1:] == said[:1] * 2


def test_a_start_on_the_other_side_of_the_world_is_named_and_not_the_files_of_the_area(tmp_path, capsys):
    path = written(tmp_path, "")
    lat = next(line for line in path.read_text().split("[start]")[1].splitlines() if line.startswith("lat"))
    goal = next(line for line in path.read_text().split("[[goal]]")[1].splitlines() if line.startswith("lat"))
    text = path.read_text().replace(lat, lat.replace("lat = ", "lat = -"), 1)
    path.write_text(f"{text}\n[[refuge]]\n{goal}\nlon = -1.31\n")
    assert cli.main(["mission", "check", str(path)]) == 2
    said = capsys.readouterr().err
    assert "[start]: is " in said
    assert "is the sign of lat wrong" in said


def test_one_file_where_a_list_belongs_is_told_how_to_be_written(tmp_path, capsys):
    path = written(tmp_path, "")
    path.write_text(path.read_text().replace('obstacles = ["archipelago.wkt"]', 'obstacles = "archipelago.wkt"'))
    assert cli.main(["mission", "check", str(path)]) == 2
    assert "write ['archipelago.wkt']" in capsys.readouterr().err


def test_a_speed_up_of_a_voyage_that_is_not_in_real_time_is_refused(capsys):
    assert sitl_cli.main(["run", "demo", "--speedup", "4"]) == 2
    assert "add --live" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["mission check", "plan"])
def test_a_wind_that_is_written_the_wrong_way_round_is_told_so(capsys, command):
    assert cli.main([*command.split(), str(MISSIONS / "archipelago.toml"), "--wind", "340@5"]) == 2
    assert "looks swapped: SPEED@FROM is 5@340" in capsys.readouterr().err


def test_a_good_mission_is_called_in_order(tmp_path, capsys):
    assert cli.main(["mission", "check", str(written(tmp_path, ""))]) == 0
    assert "in order" in capsys.readouterr().out


def test_a_fence_of_nothing_is_not_uploaded(tmp_path):
    (tmp_path / "m.toml").write_text("[[goal]]\nlat = 50.0\nlon = 1.0\n[operator]\nupload_fence = true\n")
    with pytest.raises(InputError, match="no area to make a fence of"):
        require_sailable(load_mission(tmp_path / "m.toml"))


EVERY = sorted([*MISSIONS.glob("*.toml"), *Path("sitl/missions").glob("*.toml")])


@pytest.mark.parametrize("path", EVERY, ids=lambda p: p.stem)
def test_every_example_can_be_sailed(path):
    require_sailable(permitted(load_mission(path), load_scenario(path)))


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_every_scenario_can_be_sailed(path):
    scenario = load_scenario(path)
    require_sailable(permitted(load_mission(scenario.mission_path(path)), scenario))


# ------------------------------------------------------------------------------------------ buoys without room
def buoy_by_a_rock(folder, *, west_deg, hand, radius_m, floor_m):
    """Write a mission that rounds a buoy to the west of a rock; return its file."""
    (folder / "rock.wkt").write_text(
        f"POLYGON (({west_deg} 50.8208, -1.3092 50.8208, -1.3092 50.8210, {west_deg} 50.8210, {west_deg} 50.8208))"
    )
    mission = folder / "m.toml"
    mission.write_text(
        f"""
        [start]
        lat = 50.8200
        lon = -1.3103
        [[goal]]
        lat = 50.8209
        lon = -1.3100
        radius_m = {radius_m}
        rounding = "{hand}"
        [[goal]]
        lat = 50.8218
        lon = -1.3097
        [area]
        obstacles = ["rock.wkt"]
        margin_m = 8
        margin_floor_m = {floor_m}
        """
    )
    return mission


@pytest.mark.parametrize(("hand", "told"), [("port", 1), ("starboard", 0)])
def test_a_buoy_whose_circle_has_no_room_is_told(tmp_path, hand, told):
    checked = check_mission(buoy_by_a_rock(tmp_path, west_deg=-1.30975, hand=hand, radius_m=12, floor_m=4))
    assert not checked.refusals
    found = [finding for finding in checked.findings if finding.place == "[[goal]] 1 rounding"]
    assert len(found) == told
    assert all("the margin is 8 m" in finding.text for finding in found)


@pytest.mark.parametrize(("floor_m", "level"), [(2.0, FindingLevel.WARNING), (7.0, FindingLevel.ERROR)])
def test_a_buoy_whose_circle_is_below_the_floor_is_an_error(tmp_path, floor_m, level):
    """ "In order" was said of one that lay in the fence: she loitered beside it for two hours."""
    mission = buoy_by_a_rock(tmp_path, west_deg=-1.30978, hand="port", radius_m=10, floor_m=floor_m)
    (found,) = (f for f in check_mission(mission).findings if f.place == "[[goal]] 1 rounding")
    assert found.severity is level
    assert ("never sailed" in found.text) is (level is FindingLevel.ERROR)


@pytest.mark.parametrize(("beyond_m", "is_told"), [(9.0, True), (40.0, False)])
@pytest.mark.parametrize("is_behind", [False, True])
def test_a_line_with_no_room_to_turn_at_is_an_error(tmp_path, beyond_m, is_told, is_behind):
    """10 m from a fence a gate was never crossed, from either side: no track of a plan kept clear of it."""
    quay_m = 220.0 + beyond_m
    wkt = ", ".join(
        f"{-1.31 + east / 70_435.0:.7f} {50.82 + north / 111_250.0:.7f}"
        for east, north in ((-300.0, quay_m), (300.0, quay_m), (300.0, quay_m + 30.0), (-300.0, quay_m + 30.0))
    )
    (tmp_path / "quay.wkt").write_text(f"POLYGON (({wkt}, {wkt.split(', ')[0]}))")
    lat, west, east = 50.82 + 220.0 / 111_250.0, -1.31 - 25.0 / 70_435.0, -1.31 + 25.0 / 70_435.0
    port, starboard = (east, west) if is_behind else (west, east)
    mission = tmp_path / "m.toml"
    mission.write_text(
        f"""
        [start]
        lat = 50.8200
        lon = -1.3100
        [[goal]]
        kind = "gate"
        port_mark = {{ lat = {lat}, lon = {port} }}
        starboard_mark = {{ lat = {lat}, lon = {starboard} }}
        [[goal]]
        lat = 50.8190
        lon = -1.3100
        [area]
        obstacles = ["quay.wkt"]
        margin_m = 2
        margin_floor_m = 1
        [boat]
        length_m = 6
        beam_m = 2
        turn_rate_deg_s = 30
        """
    )
    told = [f for f in check_mission(mission).findings if "never sailed" in f.text]
    assert [(f.severity, f.place) for f in told] == [(FindingLevel.ERROR, "[[goal]] 1")] * is_told


ROUND = """
[start]
lat = 50.8200
lon = -1.3100
[[goal]]
lat = 50.8220
lon = -1.3100
radius_m = {radius}
name = "{first}"
{rounding}
[[goal]]
lat = {lat}
lon = -1.3100
radius_m = 10
name = "B"
[[refuge]]
lat = 50.8210
lon = -1.3110
name = "Bay"
[[refuge]]
lat = 50.8210
lon = -1.3090
name = "{refuge}"
[operator]
set_auto = true
guided = true
[skipper]
shifts = {shifts}
guidance = "{guidance}"
"""
WELL = {
    "radius": 10,
    "first": "A",
    "rounding": "",
    "lat": 50.8230,
    "refuge": "Cove",
    "shifts": "false",
    "guidance": "field",
}
PORT = {"rounding": 'rounding = "port"', "guidance": "plan"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({}, []),
        ({"radius": 2.9}, ["[[goal]] 1 radius_m: warning: 2.9 m: a fix is good to 2.5 m"]),
        ({"radius": 3}, []),
        ({"refuge": "bay"}, ["[[refuge]] 2 name: warning: 'bay' is the name of [[refuge]] 1, too"]),
        ({"first": "B"}, ["[[goal]] 2 name: warning: 'B' is the name of [[goal]] 1, too"]),
        ({"first": "B", "lat": 50.8220}, []),  # passed twice
        ({"first": "", "refuge": ""}, []),
        ({"shifts": "true"}, ['[skipper] shifts: warning: does nothing with guidance = "field"']),
        ({"shifts": "true", "guidance": "plan"}, []),
        (
            {"radius": 300, **PORT},
            [
                "[[goal]] 2: error: lies 111.2 m from goal 1's mark; every plan keeps 150.0 m clear of that",
                "[[goal]] 1 radius_m: warning: is rounded 300 m off, and [start] lies 222 m from it: 150 m are kept",
            ],
        ),
        ({"radius": 100, **PORT}, []),
        ({"lat": 50.8220, **PORT}, []),
    ],
)
def test_what_is_hardly_meant_is_told_with_its_remedy(tmp_path, change, told):
    """A circle of 900 m about the start left no place to plan from, and a goal of a millimetre was never met."""
    mission = tmp_path / "m.toml"
    mission.write_text(ROUND.format(**(WELL | change)))
    checked = check_mission(mission)
    assert not checked.refusals
    lines = [finding.line() for finding in checked.findings]
    assert len(lines) == len(told)
    assert all(line.startswith(words) and "; " in line for line, words in zip(lines, told, strict=True))


@pytest.mark.parametrize(("end", "is_rounded"), [("home", True), ("loiter", False)])
def test_the_last_buoy_is_rounded_for_the_way_home(tmp_path, end, is_rounded):
    mission = tmp_path / "m.toml"
    mission.write_text(
        f"""
        [start]
        lat = 50.8200
        lon = -1.3100
        [[goal]]
        lat = 50.8220
        lon = -1.3100
        radius_m = 12
        rounding = "port"
        [skipper]
        end = "{end}"
        """
    )
    voyage = voyage_of(load_mission(mission))
    begun = Approach(goal=0, en_m=voyage.frame.en_from_geo(load_mission(mission).start))
    assert (len(gates_of(voyage, (begun,))) > 2) is is_rounded  # else abeam of it, and past it


@pytest.mark.parametrize(
    ("apart_m", "radius_m", "is_sailed"), [(40.0, 6.0, True), (18.0, 6.0, True), (14.0, 6.0, True), (14.0, 10.0, False)]
)
def test_marks_near_each_other_are_rounded_closer_and_said_where_no_plan_leads_between(
    tmp_path, apart_m, radius_m, is_sailed
):
    def buoy(east_m):
        return f"[[goal]]\nlat = 50.82\nlon = {-1.31 + east_m / 70_435.0}\nradius_m = {radius_m}\nrounding = 'port'\n"

    mission = tmp_path / "m.toml"
    mission.write_text(f"[start]\nlat = 50.8190\nlon = -1.31\n{buoy(0.0)}{buoy(apart_m)}")
    voyage = voyage_of(load_mission(mission))
    wanted_m = max(radius_m, load_mission(mission).margin_m)
    assert all(goal.rounding_m <= wanted_m for goal in voyage.goals)
    assert (voyage.goals[0].rounding_m == wanted_m) is (apart_m == 40.0)
    told = [f for f in check_mission(mission).findings if f.severity is FindingLevel.ERROR]
    assert (not told) is is_sailed
    assert all(f.code is Code.ROUNDING and "never sailed to" in f.text for f in told)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"{START}{PLACE.format(50.8200, 10)}", ["[[goal]] 1: warning: is reached where [start] is, 0 m from it"]),
        (f"{START}{PLACE.format(50.8220, 10)}{PLACE.format(50.8240, 10)}", []),
        (
            f"{START}{PLACE.format(50.8220, 10)}{PLACE.format(50.8240, 500)}",
            ["[[goal]] 2: warning: is reached where [[goal]] 1 is, 222 m from it: its radius is 500 m"],
        ),
        (f"{START}{PLACE.format(50.8220, 10)}{PLACE.format(50.8220, 10)}", []),  # passed twice
        (
            f"{START}{PLACE.format(50.8220, 10)}[boat]\nno_go_half_deg = 4.5\n",
            ["[boat] no_go_half_deg: warning: 4.5: no boat sails so near to the wind"],
        ),
    ],
)
def test_what_is_never_sailed_to_and_what_no_boat_can_is_told(tmp_path, text, told):
    (tmp_path / "m.toml").write_text(text)
    lines = [finding.line() for finding in check_mission(tmp_path / "m.toml").findings]
    assert len(lines) == len(told)
    assert all(line.startswith(words) for line, words in zip(lines, told, strict=True))


def test_points_and_lines_are_counted_in_words():
    rock = Mark(geometry=shapely.Point(-1.31, 50.82), kind=ZoneKind.EXCLUSION)
    assert summary(Document(marks=(rock, rock))) == "2 point or line obstacles"


QUAY = "POLYGON ((-1.32 {0}, -1.30 {0}, -1.30 50.8185, -1.32 50.8185, -1.32 {0}))"
FINISH = """
[start]
lat = 50.8165
lon = -1.31
[[goal]]
kind = "gate"
name = "Finish"
port_mark = { lat = 50.8175, lon = -1.3102 }
starboard_mark = { lat = 50.8175, lon = -1.3098 }
[area]
obstacles = ["quay.wkt"]
margin_m = 12
margin_floor_m = 6
"""


@pytest.mark.parametrize(
    ("off_m", "says"),
    [
        (25.0, ""),
        (17.0, "17 m from obstacle 1: no room to cross it with 12.0 m kept clear, 10.0 m at the most beyond it; it is"),
        (12.0, "12 m from obstacle 1: no room to cross it with 12.0 m kept clear, 5.0 m at the most beyond it; it is"),
    ],
)
def test_a_finish_line_before_a_quay_is_told_by_the_room_beyond_it(tmp_path, off_m, says):
    mission = tmp_path / "m.toml"
    mission.write_text(FINISH)
    (tmp_path / "quay.wkt").write_text(QUAY.format(50.8175 + off_m / 111_250.0))
    told = [f.text for f in check_mission(mission).findings if f.place == "[[goal]] 1"]
    assert len(told) == bool(says)
    assert not says or says in told[0]
    assert not says or ("never sailed" in told[0]) is (off_m < 7.0 + 6.0)


def test_no_preview_leads_over_a_line_that_is_never_sailed(tmp_path, capsys):
    mission = tmp_path / "m.toml"
    mission.write_text(FINISH)
    (tmp_path / "quay.wkt").write_text(QUAY.format(50.8175 + 12.0 / 111_250.0))
    assert cli.main(["plan", str(mission)]) == 2
    assert (
        "[[goal]] 1: the line Finish is 12 m from obstacle 1: no room to cross it with 6.0 m" in capsys.readouterr().err
    )


def test_a_mark_of_a_gate_may_stand_on_the_bank(tmp_path):
    mission = tmp_path / "m.toml"
    mission.write_text(FINISH)
    bank = "POLYGON ((-1.32 50.816, -1.3102 50.816, -1.3102 50.819, -1.32 50.819, -1.32 50.816))"
    (tmp_path / "quay.wkt").write_text(bank)
    assert not [f.text for f in check_mission(mission).findings if "Finish" in f.text or "marks" in f.text]
    assert require_sailable(load_mission(mission))

"""Goals that are tasks: what a mission file may say of them, and what is refused in one line."""

import pytest

from companion.cli import main
from companion.errors import InputError
from companion.geofence import load_mission
from companion.geofence.mission.text import dump_options, parse_options
from companion.mission_check import check_mission, require_sailable

GATE = """
name = "m"
[start]
lat = 50.8160
lon = -1.3100
[[goal]]
kind = "gate"
name = "Start"
port_mark = { lat = 50.8170, lon = -1.3103 }
starboard_mark = { lat = 50.8170, lon = -1.3096 }
not_before = 2026-11-21T12:00:00Z
"""


def load(tmp_path, text, **files):
    for name, content in files.items():
        (tmp_path / f"{name}.wkt").write_text(content)
    (tmp_path / "m.toml").write_text(text)
    return require_sailable(load_mission(tmp_path / "m.toml"))


def test_a_gate_is_two_marks_and_a_gun(tmp_path):
    goal = load(tmp_path, GATE).goals[0]
    assert goal.gate.not_before_s == 1795262400.0
    assert goal.gate.keep_m == 5.0
    assert goal.point.lon_deg == pytest.approx(-1.30995, abs=1e-6)


def test_what_is_written_is_read_again():
    options = parse_options(GATE, "m.toml")
    assert parse_options(dump_options(options), "m.toml") == options


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"gate"', '"gat"', "[[goal]] 1 kind: 'gat' is no kind of goal; did you mean \"gate\"?"),
        ('"gate"', '"regatta"', "is no kind of goal"),
        ("not_before", "not_befor", "unknown key; did you mean 'not_before'?"),
        ("12:00:00Z", "12:00:00", "not_before"),
        ("-1.3096", "-1.3101", "14.1 m apart: 10 m are needed between what is kept clear of them, 20 m in all"),
        ("-1.3096", "-1.2096", "its marks are 7.1 km apart"),
        ("not_before", "after_s = 20.0\nnot_before", "not_before names the gun already"),
        ("starboard_mark", "# starboard_mark", "starboard_mark: is missing"),
        ("lat = 50.8170, lon = -1.3103", "lat = 150.0, lon = -1.3103", "port_mark.lat"),
    ],
)
def test_what_is_wrong_with_a_gate_is_one_line(tmp_path, old, new, says):
    with pytest.raises(InputError) as refused:
        load(tmp_path, GATE.replace(old, new, 1))
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_gate_with_a_rock_between_its_marks_is_refused(tmp_path):
    rock = "POLYGON ((-1.30985 50.8169, -1.3098 50.8169, -1.3098 50.81705, -1.30985 50.81705, -1.30985 50.8169))"
    with pytest.raises(InputError, match=r"\[\[goal\]\] 1: between its marks there are 0 m to obstacle 1"):
        load(tmp_path, GATE + '[area]\nobstacles = ["rock.wkt"]\n', rock=rock)


def test_a_gate_is_not_sailed_by_field(tmp_path):
    text = GATE + '[skipper]\nguidance = "field"\n[operator]\nguided = true\nset_auto = true\n'
    with pytest.raises(InputError, match="knows nothing of the gate"):
        load(tmp_path, text)


def test_check_draws_it_and_convert_says_what_is_lost(tmp_path, capsys):
    load(tmp_path, GATE)
    assert main(["mission", "check", str(tmp_path / "m.toml"), "--plot", str(tmp_path / "m.png")]) == 0
    assert main(["mission", "convert", str(tmp_path / "m.toml"), str(tmp_path / "m.gpx")]) == 0
    assert "of a gate only the middle" in "".join(capsys.readouterr())


BOX = """
name = "m"
[start]
lat = 50.8160
lon = -1.3100
[[goal]]
kind = "box"
name = "Box"
polygon = "POLYGON ((-1.3103 50.8170, -1.3093 50.8170, -1.3093 50.8177, -1.3103 50.8177, -1.3103 50.8170))"
for_s = 60.0
[area]
obstacles = ["rock.wkt"]
"""
FAR = "POLYGON ((-1.31985 50.8169, -1.3198 50.8169, -1.3198 50.81705, -1.31985 50.8169))"
HALF = "POLYGON ((-1.3103 50.8170, -1.3097 50.8170, -1.3097 50.8177, -1.3103 50.8177, -1.3103 50.8170))"


def test_a_box_has_its_place_where_there_is_most_room(tmp_path):
    whole = load(tmp_path, BOX, rock=FAR).goals[0]
    assert whole.radius_m == pytest.approx(35.2, abs=0.6)
    half = load(tmp_path, BOX, rock=HALF.replace("-1.3097", "-1.3099")).goals[0]
    assert half.radius_m == pytest.approx(21.1, abs=0.6)
    assert half.point.lon_deg > whole.point.lon_deg
    assert half.box.for_s == 60.0


@pytest.mark.parametrize(
    ("rock", "floor_m", "told"), [(FAR, 6, ""), (HALF, 6, "m/s of wind and more"), (HALF, 9, "in any wind")]
)
def test_from_which_wind_on_a_box_is_given_up_is_told_before_anybody_sails(tmp_path, rock, floor_m, told):
    floor = f"[area]\nmargin_floor_m = {floor_m}\n"
    load(tmp_path, BOX.replace("[area]\n", floor), rock=rock.replace("-1.3097", "-1.3099"))
    winds = [f.text for f in check_mission(tmp_path / "m.toml").findings if f.place == "[[goal]] 1 polygon"]
    assert bool(winds) is bool(told)
    assert not told or ("has 21 m about it" in winds[0] and told in winds[0])


def test_a_boxs_water_may_be_a_file_and_is_copied_with_the_voyage(tmp_path):
    text = BOX.replace(BOX[BOX.index("POLYGON") : BOX.index('"\nfor_s')], "box.wkt")
    goal = load(tmp_path, text, rock=FAR, box=HALF).goals[0]
    assert goal.radius_m == pytest.approx(21.1, abs=0.6)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("-1.3093", "-1.3100", "[[goal]] 1: the roomiest place in it has 11 m about it: a loiter needs 16 m"),
        ("POLYGON", "POLYGN", "[[goal]] 1 polygon"),
        ("50.8177, -1.3103 50.8170))", "50.8177))", "the ring is not closed"),
        ("for_s = 60.0", "for_s = -1.0", "for_s"),
        ("for_s", "fors", "did you mean 'for_s'?"),
        ('"box"', '"bocks"', 'did you mean "box"?'),
    ],
)
def test_what_is_wrong_with_a_box_is_one_line(tmp_path, old, new, says):
    with pytest.raises(InputError) as refused:
        load(tmp_path, BOX.replace(old, new), rock=FAR)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_box_whose_file_is_not_there_is_refused(tmp_path):
    text = BOX.replace(BOX[BOX.index("POLYGON") : BOX.index('"\nfor_s')], "nowhere.wkt")
    with pytest.raises(InputError, match="there is no such file"):
        load(tmp_path, text, rock=FAR)


SEARCH = """
name = "m"
[start]
lat = 50.8160
lon = -1.3100
[[goal]]
kind = "search"
name = "Area"
polygon = "POLYGON ((-1.3103 50.8170, -1.3083 50.8170, -1.3083 50.8184, -1.3103 50.8184, -1.3103 50.8170))"
swath_m = 20.0
[area]
obstacles = ["rock.wkt"]
"""


def test_a_search_has_an_area_and_a_swath(tmp_path):
    search = load(tmp_path, SEARCH, rock=FAR).goals[0].search
    assert (search.swath_m, search.coverage) == (20.0, 0.95)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("swath_m = 20.0", "", "swath_m: is missing"),
        ("swath_m = 20.0", "swath_m = 1.0", "swath_m"),
        ("swath_m = 20.0", "swath_m = 300.0", "[[goal]] 1 swath_m: 300 m is wider than the area itself"),
        ("swath_m", "swath", "did you mean 'swath_m'?"),
        ('"search"', '"serch"', 'did you mean "search"?'),
    ],
)
def test_what_is_wrong_with_a_search_is_one_line(tmp_path, old, new, says):
    with pytest.raises(InputError) as refused:
        load(tmp_path, SEARCH.replace(old, new), rock=FAR)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_search_of_too_many_sweeps_is_refused(tmp_path):
    with pytest.raises(InputError, match="swath_m: 4 m make about"):
        load(tmp_path, SEARCH.replace("50.8184", "50.8684").replace("20.0", "4.0"), rock=FAR)


def test_a_search_mostly_ashore_is_refused(tmp_path):
    land = "POLYGON ((-1.3105 50.8160, -1.3087 50.8160, -1.3087 50.8190, -1.3105 50.8190, -1.3105 50.8160))"
    with pytest.raises(InputError, match=r"\[\[goal\]\] 1: only 20 % of it is free water"):
        load(tmp_path, SEARCH, rock=land)


def test_the_sweeps_of_a_search_are_told_and_drawn(tmp_path, capsys):
    load(tmp_path, SEARCH, rock=FAR)
    assert main(["mission", "check", str(tmp_path / "m.toml"), "--plot", str(tmp_path / "m.png"), "--no-plan"]) == 0
    assert "Area: 10 sweeps, 1" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("floor_m", "radius_m", "says"),
    [
        (4.0, 1.0, "never sailed to"),
        (4.0, 3.0, "hardly reached in 7 m/s of wind and more"),
        (4.0, 9.0, ""),
        (2.0, 1.0, "hardly reached in 7 m/s of wind and more"),
        (2.0, 9.0, ""),
    ],
)
def test_a_goal_that_every_step_of_the_ladder_keeps_clear_of_is_said_before_sailing(tmp_path, floor_m, radius_m, says):
    """It was "in order" 5 m from its fence with a floor of 4 m, and she waited before it for forty minutes.

    Inside its radius there may be room, and a fast boat's track takes more of it.
    """
    ring = "-0.01 -0.01, 0.01 -0.01, 0.01 0.01, -0.01 0.01, -0.01 -0.01"
    (tmp_path / "fence.wkt").write_text(f"w|inclusion|POLYGON (({ring}))")
    (tmp_path / "m.toml").write_text(
        "[start]\nlat = 0.0\nlon = 0.0\n"
        f"[[goal]]\nlat = 0.00995478\nlon = 0.0\nradius_m = {radius_m}\n"
        f'[area]\nfence = "fence.wkt"\nmargin_m = 8.0\nmargin_floor_m = {floor_m}\n'
    )
    told = [f.text for f in check_mission(tmp_path / "m.toml").findings if "inside its radius" in f.text]
    assert len(told) == bool(says)
    assert all(says in text for text in told)

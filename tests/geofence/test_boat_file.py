"""A boat file in a mission: what the mission is silent about is as the file says."""

import math
import shutil
from pathlib import Path

import pytest

from companion.boat import Sizes, guessed, guessed_text
from companion.compose import boat_of
from companion.errors import InputError
from companion.geofence import load_mission
from companion.geofence.mission import load_settings, parse_boat_file
from companion.geofence.mission.text import parse_options

MISSIONS = Path(__file__).parents[2] / "missions"
SIZES = Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9)
PEPPER = guessed_text("pepper", SIZES, guessed(SIZES), "2026-11-25")
GOAL = "[[goal]]\nlat = 50.82\nlon = -1.3\n[start]\nlat = 50.817\nlon = -1.3\n"


def mission(tmp_path, boat, *, head=GOAL, file=PEPPER):
    (tmp_path / "pepper.toml").write_text(file)
    path = tmp_path / "mission.toml"
    path.write_text(f"{head}[boat]\n{boat}\n")
    return path


def test_a_mission_takes_from_the_file_what_it_does_not_say_itself(tmp_path):
    loaded = load_mission(mission(tmp_path, 'file = "pepper.toml"\ntack_loss_s = 4.0'))  # the default, said
    boat = boat_of(loaded)
    assert (boat.hull.length_m, boat.hull.beam_m, boat.tack_fails) == (1.5, 0.45, 0.05)
    assert boat.tack_loss_s == 4.0
    assert math.degrees(boat.turn_rate_radps) == pytest.approx(24.5)
    assert boat.speed_error == boat.told_speed_error == 0.35
    assert boat.polar.speed_mps(math.radians(90.0), 4.0) == pytest.approx(
        guessed(SIZES).polar.speed_mps(math.radians(90.0), 4.0), abs=0.01
    )


def test_a_polar_of_the_mission_counts_before_the_file_s(tmp_path):
    boat = boat_of(load_mission(mission(tmp_path, 'file = "pepper.toml"\npolar = 1.25')))
    assert boat.polar.speed_mps(1.0, 4.0) == 1.25
    assert boat.hull.length_m == 1.5


def test_a_mission_that_is_drawn_takes_it_too(tmp_path):
    settings = load_settings(mission(tmp_path, 'file = "pepper.toml"', head="from_autopilot = true\n"))
    assert settings.boat.length_m == 1.5
    assert settings.boat.polar == "pepper.toml"


def test_the_copy_of_a_voyage_sails_the_same_boat(tmp_path):
    """It names the boat file as its polar and says the rest itself: nothing is looked up a second time."""
    loaded = load_mission(mission(tmp_path, 'file = "pepper.toml"'))
    assert loaded.polar_path == tmp_path / "pepper.toml"
    copy = tmp_path / "copy"
    copy.mkdir()
    shutil.copy(loaded.polar_path, copy)
    path = copy / "mission.toml"
    path.write_text(GOAL + '[boat]\npolar = "pepper.toml"\nlength_m = 1.5\n')
    assert boat_of(load_mission(path)).polar == boat_of(loaded).polar


@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("name = ", "is not TOML"),
        (PEPPER.replace("length_m", "lenght_m"), r"\[boat\] lenght_m: unknown key"),
        (PEPPER.replace("[boat] ", "[boat]\nfile = 'a.toml' "), r"\[boat\] file"),
        (PEPPER.replace("tack_fails = 0.05", "tack_fails = 5"), "tack_fails"),
        (PEPPER.replace('name = "pepper"', ""), "name: is missing"),
    ],
)
def test_a_boat_file_that_cannot_be_believed_is_refused_by_name_and_place(tmp_path, file, says):
    with pytest.raises(InputError, match=says) as caught:
        parse_boat_file(file, "pepper.toml")
    assert caught.value.source == "pepper.toml"
    with pytest.raises(InputError, match="pepper"):
        load_mission(mission(tmp_path, 'file = "pepper.toml"', file=file))


@pytest.mark.parametrize(
    ("file", "says"),
    [
        (PEPPER.replace("[0.43, ", "["), "rows are not of one length"),
        (PEPPER.replace("twa_deg = [40, ", "twa_deg = ["), "matching table"),
        (PEPPER.replace("0.43, 0.50", "-0.43, 0.50"), "negative"),
    ],
)
def test_a_table_that_is_no_polar_is_refused_where_it_is_sailed_by(tmp_path, file, says):
    with pytest.raises(InputError, match=rf"pepper.toml: \[polar\]: .*{says}"):
        boat_of(load_mission(mission(tmp_path, 'file = "pepper.toml"', file=file)))


def test_a_boat_file_that_is_not_there_is_said_with_what_writes_one(tmp_path):
    path = mission(tmp_path, 'file = "salt.toml"')
    with pytest.raises(InputError, match=r"\[boat\] file .*salt.toml.*companion boat guess"):
        load_mission(path)


def test_a_mission_and_a_boat_file_in_each_other_s_place_are_named_with_the_command_that_takes_them():
    with pytest.raises(
        InputError, match=r"m.toml: is a mission, not a boat file; check it by: companion mission check m.toml"
    ):
        parse_boat_file(GOAL, "m.toml")
    with pytest.raises(
        InputError, match=r"p.toml: is a boat file, not a mission; look at it by: companion boat show p.toml"
    ):
        parse_options(PEPPER, "p.toml")


def test_a_polar_in_place_of_a_boat_file_is_named_as_what_it_is():
    """ "is not TOML: Expected '=' after a key" was said of pepper.pol."""
    with pytest.raises(InputError, match="is a polar and no boat file"):
        parse_boat_file("TWA;4;6\n45;2;3\n", "pepper.pol")

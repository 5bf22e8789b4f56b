"""``[passage]`` in a mission file: what is believed, what is refused and how, and what the check tells of it."""

import pytest

from companion import cli
from companion.compose import config_of, voyage_of, waters_of
from companion.errors import InputError
from companion.geofence import load_mission
from companion.mission_check import require_sailable

START, FAR = (52.0, 179.5), (52.1, -178.9)  # 110 km over the date line
WATER = "POLYGON ((179.0 51.8, 181.5 51.8, 181.5 52.3, 179.0 52.3, 179.0 51.8))"


def written(path, *, goal=FAR, passage="leg_m = 120000.0", more="", skipper="", water=WATER):
    (path / "water.wkt").write_text(water)
    file = path / "m.toml"
    table = f"[passage]\n{passage}\n" if passage is not None else ""
    file.write_text(
        f'name = "m"\n[start]\nlat = {START[0]}\nlon = {START[1]}\n[[goal]]\nlat = {goal[0]}\nlon = {goal[1]}\n'
        f'bandwidth_m = 3000.0\n[area]\nfence = "water.wkt"\n{table}[skipper]\nbandwidth_m = 500.0\n{skipper}\n{more}'
    )
    return file


def refusal(file):
    with pytest.raises(InputError) as caught:
        require_sailable(load_mission(file))
    return caught.value


def test_a_goal_a_hundred_kilometres_off_over_the_date_line(tmp_path, capsys):
    file = written(tmp_path, skipper="horizon_m = 20000.0")
    mission = require_sailable(load_mission(file))
    voyage, made = voyage_of(mission), waters_of(mission)
    assert (voyage.is_passage, voyage.recentre_m, voyage.far_m) == (True, 10_000.0, 120_000.0)
    assert config_of(mission).horizon_m == 20_000.0
    assert [goal.bandwidth_m for goal in voyage.goals] == [3000.0]
    near = made(mission.goals[0].point)
    assert near.goals[0].en_m == pytest.approx((0.0, 0.0), abs=1e-3)
    assert near.area.reach_m == 10_000.0 + 1.5 * 20_000.0 + 10_000.0
    assert cli.main(["mission", "check", str(file)]) == 0
    told = capsys.readouterr().out
    assert "a passage of 110 km, the longest leg 110 km, bands of 3 km to either side" in told
    assert "plans for 20 km at a time, the frame moves along every 10 km" in told


def test_without_a_word_of_it_it_is_refused_as_before_and_told_the_word(tmp_path):
    error = refusal(written(tmp_path, passage=None, water=WATER))
    assert (error.place, error.problem) == ("[[goal]] 1", "is 110 km from the origin")
    assert error.remedy.startswith("are lat and lon swapped?")
    assert "[passage] leg_m" in error.remedy
    assert waters_of(load_mission(written(tmp_path, passage=None, goal=(52.05, 179.6)))) is None


@pytest.mark.parametrize(
    ("file", "place", "problem"),
    [
        ({"passage": "leg_m = 100000.0"}, "[[goal]] 1", "is 110 km from [start]"),
        ({"goal": (52.35, -178.9)}, "[[goal]] 1", "52.350000, -178.900000 is outside the fence"),
        ({"more": "[[refuge]]\nlat = 52.0\nlon = 176.0\n"}, "[[refuge]] 1", "is 240 km from every goal"),
        (
            {"passage": "recentre_m = 5000.0", "goal": (52.05, 179.6)},
            "[passage] recentre_m",
            "is of a passage, and nothing says how long its legs are",
        ),
    ],
)
def test_what_cannot_be_is_refused_by_place_and_reason(tmp_path, file, place, problem):
    error = refusal(written(tmp_path, **file))
    assert (error.place, error.problem) == (place, problem)
    assert error.remedy


def test_a_goal_that_is_near_is_not_asked_about_its_axes(tmp_path):
    """A goal 60 m away was "0 km from [start]; are lat and lon swapped?"."""
    error = refusal(written(tmp_path, passage="leg_m = 50.0", goal=(START[0] + 0.00054, START[1])))
    assert error.problem == "is 60 m from [start]"
    assert error.remedy == "write a longer one: [passage] leg_m says 50 m"


@pytest.mark.parametrize(
    "passage",
    [
        "leg_m = 0.0",
        "leg_m = 2e7",
        "leg_m = 1e5\nrecentre_m = 100.0",
        "leg = 100000.0",
        "leg_m = 1e5\nrecentre_m = 60000.0",
    ],
)
def test_numbers_out_of_range_and_unknown_keys_are_refused(tmp_path, passage):
    with pytest.raises(InputError):
        load_mission(written(tmp_path, passage=passage))


def test_a_long_edge_of_the_fence_is_its_parallel(tmp_path):
    """A goal just inside a parallel 170 km long is inside, wherever the frame is."""
    for lat, is_in in ((52.2995, True), (52.3005, False)):
        file = written(tmp_path, goal=(lat, -179.7))
        if is_in:
            require_sailable(load_mission(file))
        else:
            assert "outside the fence" in refusal(file).problem

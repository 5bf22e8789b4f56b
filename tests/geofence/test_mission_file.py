"""Mission TOML: what is wrong is said in one line with the file, the place and the remedy."""

import pathlib
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.errors import InputError
from companion.geofence import load_mission
from companion.geofence.formats.untrusted import decode
from companion.geofence.mission.options import tables
from companion.geofence.mission.text import dump_options, parse_options
from tests.geofence.strategies import QUIET

ROOT = pathlib.Path(__file__).parents[2]
MISSIONS = sorted(path for folder in ("missions", "sitl/missions") for path in (ROOT / folder).glob("*.toml"))
ROCK = "POLYGON ((-1.301 50.801, -1.300 50.801, -1.300 50.802, -1.301 50.802, -1.301 50.801))"
GOOD = """
[start]
lat = 50.8
lon = -1.3
[[goal]]
lat = 50.805
lon = -1.3005
[area]
obstacles = ["rock.wkt"]
"""


def load(tmp_path, text=GOOD, **files):
    for name, content in ({"rock": ROCK} | files).items():
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / f"{name}.wkt").write_bytes(data)
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    return load_mission(tmp_path / "m.toml")


@pytest.mark.parametrize("path", MISSIONS, ids=lambda p: p.stem)
def test_every_example_loads_and_starts_in_free_water(path):
    mission = load_mission(path)
    local = mission.area.local(mission.frame())
    places = [mission.frame().en_from_geo(p) for p in (mission.start, *(g.point for g in mission.goals))]
    assert (local.clearance_m(places) > mission.margin_m).all()


@pytest.mark.parametrize("path", MISSIONS, ids=lambda p: p.stem)
def test_options_there_and_back(path):
    options = parse_options(path.read_text(encoding="utf-8"), str(path))
    assert parse_options(dump_options(options), "again") == options


@pytest.mark.parametrize(
    ("name", "called", "words"),
    [
        ("", "m", "is empty: the mission is called 'm'"),
        ("  ", "m", "is empty"),
        ("lake/north", "lake/north", "voyages and state are called 'lake-north'"),
        ("..", "..", "voyages and state are called 'voyage'"),
        ("Lake North", "Lake North", None),
        (None, "m", None),
    ],
)
def test_a_name_that_names_nothing_is_found(tmp_path, name, called, words):
    """An empty one, or one with a slash in it, was "in order"."""
    mission = load(tmp_path, GOOD if name is None else f'name = "{name}"\n{GOOD}')
    assert mission.name == called
    assert [f.place for f in mission.findings] == ([] if words is None else ["name"])
    assert words is None or words in mission.findings[0].text


def test_defaults(tmp_path):
    mission = load(tmp_path)
    assert (mission.operator.arm, mission.operator.set_auto, mission.operator.guided) == (False, False, False)
    permitted = mission.permitting("arm").operator
    assert (permitted.arm, permitted.set_auto, permitted.guided) == (True, False, False)
    assert mission.name == "m"
    assert mission.origin == mission.start
    assert mission.area.local(mission.frame()).names == ("obstacle 1",)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[area]", "[area]\nmargn_m = 3"), ("[area] margn_m", "unknown key", "'margin_m'")),
        (("[area]", "[aera]"), ("aera", "unknown key", "'area'")),
        (("[area]", "[area]\ndelta_s = 0.9"), ("[area] delta_s", "belongs in [risk]")),
        (("lat = 50.805", "lat = 143.66"), ("[[goal]] 1 lat", "143.66", "swapped")),
        (("lat = 50.805\n", ""), ("[[goal]] 1 lat", "missing")),
        (("lat = 50.805", 'lat = "50"'), ("[[goal]] 1 lat", "'50'")),
        (("lat = 50.805", "lat = nan"), ("[[goal]] 1 lat", "finite")),
        (("lat = 50.805", "lat = 50.805\nrounding = 'left'"), ("[[goal]] 1 rounding", "'left'")),
        (("lat = 50.805", "lat = 5O.805"), ("line 6", "not TOML")),
        (("lat = 50.805", "lat = 50,805"), ("line 6", "not TOML", "decimals take a point")),
        (("[[goal]]", "[[gaol]]"), ("gaol", "unknown key")),
        (("rock.wkt", "rack.wkt"), ("[area] obstacles", "no such file", "relative")),
        (("lat = 50.805\nlon = -1.3005", "lat = 50.8015\nlon = -1.3005"), ("[[goal]] 1", "inside the obstacle")),
        (("lat = 50.8\nlon = -1.3\n", "lat = 50.8015\nlon = -1.3005\n"), ("[start]", "inside the obstacle")),
        (("lat = 50.805\nlon = -1.3005", "lat = -1.3005\nlon = 50.805"), ("[[goal]] 1", "swapped")),
        (("[area]", "[boat]\npolar = 'none.pol'\n[area]"), ("[boat] polar", "no such file")),
        (("[area]", "[risk]\ndelta_s = 1.0\n[area]"), ("[risk] delta_s", "1.0")),
    ],
)
def test_faults_of_the_mission(tmp_path, change, words):
    assert change[0] in GOOD
    with pytest.raises(InputError) as error:
        load(tmp_path, GOOD.replace(*change, 1))
    message = str(error.value)
    assert "\n" not in message
    assert message.startswith(str(tmp_path / "m.toml"))
    for word in words:
        assert word in message, message


@pytest.mark.parametrize(
    ("wkt", "words"),
    [
        ("POLYGON EMPTY", ("rock.wkt: line 1", "EMPTY")),
        ("", ("rock.wkt", "is empty")),
        (
            "POLYGON ((-1.301 50.801, -1.300 50.801, -1.300 50.802))",
            ("line 1", "not closed", "repeat the first vertex"),
        ),
        (
            "POLYGON ((-1.301 50.801, -1.300 50.802, -1.300 50.801, -1.301 50.802, -1.301 50.801))",
            ("line 1", "crosses itself", "--repair"),
        ),
        ("POLYGON ((50.801 -1.301, 50.801 -1.300, 50.802 -1.300, 50.801 -1.301))", ("swapped", 'axis = "latlon"')),
        ("POINT (50.801 -1.301)", ("mark 1", "swapped")),
        ("SRID=27700;" + ROCK, ("line 1", "27700", "4326")),
        (ROCK[:60], ("rock.wkt: line 1", "do not close", "cut off")),
        (b"\x00\x01\x02" * 30, ("rock.wkt", "binary")),
    ],
)
def test_faults_of_the_obstacles(tmp_path, wkt, words):
    with pytest.raises(InputError) as error:
        load(tmp_path, rock=wkt)
    for word in words:
        assert word in str(error.value), str(error.value)


def test_a_file_without_goals_is_told_of_those_that_are_drawn(tmp_path):
    with pytest.raises(InputError, match=r"goal: is missing; .* --from-autopilot FILE, or from_autopilot = true"):
        load(tmp_path, GOOD.replace("[[goal]]\nlat = 50.805\nlon = -1.3005\n", ""))


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ('"50.8"', "[start] lat: '50.8' is wrong: expected a number"),
        ("[50.8]", "[start] lat: expected a number, got a list"),
        ("-91.0", "[start] lat: -91.0 is wrong: expected a number of at least -90.0"),
    ],
)
def test_a_value_of_another_kind_is_told_in_words(tmp_path, value, said):
    with pytest.raises(InputError) as error:
        load(tmp_path, GOOD.replace("lat = 50.8\n", f"lat = {value}\n"))
    assert str(error.value).startswith(f"{tmp_path}/m.toml: {said}")
    assert "`" not in str(error.value)


def test_the_fence_must_hold_start_and_goal(tmp_path):
    text = GOOD.replace('["rock.wkt"]', '["rock.wkt"]\nfence = "lake.wkt"')
    lake = "POLYGON ((-1.31 50.79, -1.29 50.79, -1.29 50.804, -1.31 50.804, -1.31 50.79))"
    with pytest.raises(InputError, match="outside the fence"):
        load(tmp_path, text, lake=lake)
    local = (mission := load(tmp_path, text, lake=lake.replace("50.804", "50.814"))).area.local(mission.frame())
    assert local.fence_wkt(12.0, (0.0, 0.0)).startswith("POLYGON")
    with pytest.raises(InputError, match="stay inside"):
        load(tmp_path, text, lake="POINT (-1.3 50.8)")


def test_the_fence_and_the_obstacles_are_not_each_others_files(tmp_path):
    """The fence's file was that of the obstacles: "in order", and she sailed without a fence."""
    lake = "POLYGON ((-1.31 50.79, -1.29 50.79, -1.29 50.814, -1.31 50.814, -1.31 50.79))"
    text = GOOD.replace('["rock.wkt"]', '["rock.wkt"]\nfence = "lake.wkt"')
    with pytest.raises(InputError, match=r"lake\.wkt: holds no polygon or circle to stay inside, only what to"):
        load(tmp_path, text, lake=f"r|exclusion|{ROCK}")
    with pytest.raises(InputError, match=r"rock\.wkt: holds only what to stay inside, and is named in \[area\]"):
        load(tmp_path, text, lake=lake, rock=f"l|inclusion|{lake}")
    drawn = load(tmp_path, text, lake=f"l|inclusion|{lake}\nr|exclusion|{ROCK}", rock=ROCK)
    assert len(drawn.area.fence.zones) == 2


def test_what_has_no_name_has_one_number_in_the_area_and_on_the_page(tmp_path):
    rock = "POLYGON (({0} 50.801, {1} 50.801, {1} 50.802, {0} 50.802, {0} 50.801))"
    mission = load(
        tmp_path,
        GOOD.replace('["rock.wkt"]', '["a.wkt", "b.wkt"]'),
        a=f"POINT (-1.3030 50.803)\n{rock.format(-1.3020, -1.3015)}",
        b=f"Otter|{rock.format(-1.3010, -1.3005)}\n{rock.format(-1.2990, -1.2985)}",
    )
    local = mission.area.local(mission.frame())
    assert local.names == ("obstacle 1", "obstacle 2", "Otter", "obstacle 4")  # as in sketch.test.mjs
    assert local.polygons[1].area < local.polygons[0].area  # the point's circle
    assert sorted(local.obstacle_names()) == sorted(local.names)  # the page's and the plan's


def test_what_a_file_of_the_area_is_warned_of_is_said_in_its_name(tmp_path):
    with pytest.raises(InputError, match=r"rock\.wkt: obstacle 2: lies .* from the mission"):
        load(tmp_path, rock=f"{ROCK}\n{ROCK.replace('50.80', '51.90')}")
    (tmp_path / "rock.kml").write_text(
        "<kml><Document><NetworkLink/><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>"
        "-1.301,50.801 -1.300,50.801 -1.300,50.802 -1.301,50.801"
        "</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></Document></kml>"
    )
    (finding,) = load(tmp_path, GOOD.replace("rock.wkt", "rock.kml")).findings
    assert finding.line("m.toml") == f"{tmp_path}/rock.kml: warning: a NetworkLink is not followed"


def test_points_become_circles_of_the_configured_radius(tmp_path):
    mission = load(tmp_path, GOOD + "point_radius_m = 25.0\n", rock="POINT (-1.302 50.801)")
    local = mission.area.local(mission.frame())
    center = np.array(local.polygons[0].centroid.coords[0])
    assert local.obstacle_clearance_m(center + np.array([100.0, 0.0]))[0] == pytest.approx(75.0, abs=0.1)


WORDS = [
    b"nan",
    b"-inf",
    b"1e999",
    b"true",
    b"[]",
    b"{}",
    b"1979-05-27",
    b"'x'",
    b"9" * 400,
    b"9" * 5000,
    b"-1",
    b"\x00",
    b"[[goal]]",
    b"[area]",
    b"#",
    b'"""',
    b"=",
    b"\xff",
    b"lat = 1",
    b"." * 5,
    b"[" * 300,
]


@settings(**QUIET, max_examples=250)
@given(st.data())
def test_a_damaged_mission_is_refused_in_one_line_or_read(data):
    good = (ROOT / "missions/archipelago.toml").read_bytes()
    at = data.draw(st.integers(0, len(good)))
    word = data.draw(st.sampled_from(WORDS) | st.binary(max_size=4))
    bad = good[:at] + word + good[at + data.draw(st.integers(0, 6)) :]
    refusal = ""
    try:
        parse_options(decode(bad, "m.toml"), "m.toml")
    except InputError as error:
        refusal = str(error)
    assert "\n" not in refusal
    assert not refusal or refusal.startswith("m.toml")


def test_every_option_is_documented():
    text = (pathlib.Path(__file__).parents[2] / "docs" / "reference" / "formats.md").read_text(encoding="utf-8")
    part = text.partition("## The mission file")[2].partition("\n## ")[0]
    table, documented = "", set()
    for row in part.splitlines():
        cells = row.split("|")
        if len(cells) == 6:
            table = cells[1].strip().strip("`[]") or table
            documented |= {(table, key.strip().strip("`")) for key in cells[2].split(",")}
    safety = (pathlib.Path(__file__).parents[2] / "docs" / "reference" / "watchdogs.md").read_text(encoding="utf-8")
    documented |= {("safety", key) for key in re.findall(r"^\| `(\w+)`", safety, re.MULTILINE)}
    missing = {(name, key) for name, keys in tables().items() if name for key in keys if (name, key) not in documented}
    assert missing == set()


@pytest.mark.parametrize(
    ("start", "goal", "asked"),
    [
        ("lat = -35.28\nlon = 149.1", "lat = 35.285\nlon = 149.11", "is the sign of lat wrong, 35.285 for -35.285?"),
        ("lat = 50.8\nlon = -1.31", "lat = 50.8\nlon = 1.31", "is the sign of lon wrong, 1.31 for -1.31?"),
        ("lat = 50.8\nlon = -1.31", "lat = -1.31\nlon = 50.8", "are lat and lon swapped?"),
    ],
)
def test_a_place_that_is_far_is_asked_about_as_a_sign_where_its_mirror_is_near(tmp_path, start, goal, asked):
    file = tmp_path / "m.toml"
    file.write_text(f"name = 'm'\n[start]\n{start}\n[[goal]]\n{goal}\n")
    with pytest.raises(InputError) as error:
        load_mission(file)
    assert error.value.remedy.startswith(asked)

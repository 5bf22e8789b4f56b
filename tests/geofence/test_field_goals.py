"""Goals that are sailed by a composed field: what a mission file may say of them, and what is refused in one line."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.cli import main
from companion.compose import voyage_of, waters_of
from companion.errors import InputError
from companion.field.tree import Along, AwayFrom, AwayFromLine, Heading, OutOf, PointTo, Round, StayAt
from companion.geofence import load_mission
from companion.geofence.mission.text import dump_options, parse_options
from companion.mission_check import check_mission, require_sailable
from companion.skipper.way import Until
from companion.telemetry.folder.logbook import without_none

SQUARE = "POLYGON ((-1.3114 50.8161, -1.3086 50.8161, -1.3086 50.8179, -1.3114 50.8179, -1.3114 50.8161))"
RING = f"""
[start]
lat = 50.8170
lon = -1.3100
[[goal]]
kind = "field"
name = "The ring"
lat = 50.8178
lon = -1.3100
field = "ring + 0.5 * islet"
until = "vessel"
for_s = 600.0
polygon = "{SQUARE}"
[field.ring]
kind = "circle"
lat = 50.8185
lon = -1.3100
radius_m = 60.0
turn = "anticlockwise"
[field.islet]
kind = "repulsive_point"
lat = 50.8185
lon = -1.3100
range_m = 20.0
[operator]
set_auto = true
guided = true
"""
MORE = f"""
[field.mark]
kind = "point"
lat = 50.8185
lon = -1.3100
[field.stay]
kind = "station"
lat = 50.8185
lon = -1.3100
[field.lane]
kind = "line"
start = {{ lat = 50.8170, lon = -1.3100 }}
end = {{ lat = 50.8185, lon = -1.3100 }}
[field.shoal]
kind = "repulsive_line"
start = {{ lat = 50.8170, lon = -1.3200 }}
end = {{ lat = 50.8185, lon = -1.3200 }}
[field.east]
kind = "heading"
heading_deg = 90.0
[field.out]
kind = "leave"
polygon = "{SQUARE}"
"""


def load(tmp_path, text, **files):
    for name, content in files.items():
        (tmp_path / f"{name}.wkt").write_text(content)
    (tmp_path / "m.toml").write_text(text)
    return require_sailable(load_mission(tmp_path / "m.toml"))


def test_a_field_is_a_tree_of_atoms_in_the_local_frame(tmp_path):
    goal = voyage_of(load(tmp_path, RING)).goals[0]
    assert goal.field.tree.text == "ring + 0.5 * islet"
    assert (goal.field.until, goal.field.for_s) == (Until.VESSEL, 600.0)
    ring = goal.field.tree.atom("ring")
    assert isinstance(ring, Round)
    assert ring.at_en == pytest.approx((0.0, 166.9), abs=0.2)
    assert not ring.is_clockwise
    assert goal.field.water_en.area == pytest.approx(197.0 * 200.0, rel=0.02)


def test_every_kind_of_atom(tmp_path):
    text = RING.replace("ring + 0.5 * islet", "mark + stay + lane + shoal + max(east, out)").replace(
        "[operator]", MORE + "[operator]"
    )
    atoms = dict(voyage_of(load(tmp_path, text)).goals[0].field.tree.atoms)
    assert [type(atoms[n]) for n in ("mark", "stay", "lane", "shoal", "east", "out")] == [
        PointTo,
        StayAt,
        Along,
        AwayFromLine,
        Heading,
        OutOf,
    ]
    assert AwayFrom not in map(type, atoms.values())  # islet is not named


def test_what_is_written_is_read_again():
    options = parse_options(RING + MORE, "m.toml")
    assert parse_options(dump_options(options), "m.toml") == options
    assert options.field["mark"] != options.field["stay"]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            'kind = "circle"',
            'kind = "cicle"',
            "[field.ring] kind: 'cicle' is no kind of atom; did you mean \"circle\"?",
        ),
        ('kind = "circle"\n', "", "[field.ring] kind: is missing"),
        ("radius_m = 60.0", "radius_m = 1.0", "[field.ring] radius_m: expected a number of at least 5.0"),
        ("radius_m = 60.0", "", "[field.ring] radius_m: is missing; add it"),
        ("range_m", "rang_m", "[field.islet] rang_m: unknown key; did you mean 'range_m'?"),
        ("[field.ring]", "[field.max]", "[field.max]: is no name that an expression can have"),
        ("[field.ring]\n", '[field."north ring"]\n', "[field.north ring]: is no name that an expression can have"),
        ("0.5 * islet", "0.5 * isle", "[[goal]] 1 field, character 14: there is no atom 'isle'; did you mean 'islet'?"),
        ('until = "vessel"', 'until = "vesel"', "[[goal]] 1 until"),
        ('until = "vessel"', 'until = "told"', '[[goal]] 1 polygon: until = "told" does not ask for any water'),
        (f'polygon = "{SQUARE}"', "", '[[goal]] 1 until: "vessel" names no water; add polygon'),
        ("for_s = 600.0", "for_s = 0.0", "[[goal]] 1 for_s"),
        (SQUARE, "water.wkt", "[[goal]] 1 polygon water.wkt: there is no such file"),
        (SQUARE, SQUARE.replace("-1.3114", "-1.4114"), "is 7.2 km across; 3 km are the most"),
        ("lon = -1.3100\nradius_m", "lon = 50.8\nradius_m", "km from [[goal]] 1, which is sailed by it; are lat and"),
        (
            "guided = true",
            "guided = false",
            "a field is steered in GUIDED, which nobody allows; write guided = true in [",
        ),
        ("[field.ring]\n", "[field]\nring = 3\n[field.other]\n", "[field.ring]: 3 is no table"),
        ("lat = 50.8178", "lat = nan", "[[goal]] 1 lat"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path, old, new, says):
    assert old in RING
    with pytest.raises(InputError) as refused:
        load(tmp_path, RING.replace(old, new, 1))
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)
    assert check_mission(tmp_path / "m.toml").refusals


def test_time_needs_its_time(tmp_path):
    text = RING.replace('until = "vessel"', 'until = "time"').replace(f'polygon = "{SQUARE}"\n', "")
    assert load(tmp_path, text).goals[0].field.until == "time"
    with pytest.raises(InputError, match='"time" says no time; add for_s'):
        load(tmp_path, text.replace("for_s = 600.0\n", ""))


def test_a_line_has_two_places_and_a_motor_boat_no_no_go_zone(tmp_path):
    lane = MORE.replace("end = { lat = 50.8185, lon = -1.3100 }", "end = { lat = 50.8170, lon = -1.3100 }", 1)
    with pytest.raises(InputError, match=r"\[field.lane\]: start and end are 0.0 m apart; a line has two places"):
        load(tmp_path, RING + lane)
    motor = RING.replace("ring + 0.5", "project(ring) + 0.5") + '[autopilot]\nframe = "motor"\n[boat]\npolar = 2.0\n'
    with pytest.raises(InputError, match=r"project\(...\) keeps out of the no-go zone, and a motor boat has none"):
        load(tmp_path, motor)


@settings(max_examples=60)
@given(
    st.recursive(
        st.one_of(st.integers(), st.floats(), st.booleans(), st.text(max_size=8)),
        lambda inner: st.one_of(
            st.lists(inner, max_size=2),
            st.dictionaries(
                st.sampled_from(["lat", "lon", "radius_m", "start", "polygon", "heading_deg", "x"]), inner, max_size=4
            ),
        ),
        max_leaves=6,
    ),
    st.sampled_from(["circle", "line", "leave", "heading", "point", "odd"]),
)
def test_whatever_stands_for_an_atom_raises_input_error_alone(value, kind):
    import tomli_w

    atom = {**value, "kind": kind} if isinstance(value, dict) else value
    try:
        text = tomli_w.dumps({"field": {"a": without_none(atom) if isinstance(atom, dict) else atom}})
    except (ValueError, TypeError, UnicodeEncodeError):
        return
    try:
        parse_options(RING.partition("[field")[0] + "\n" + text, "m.toml")
    except InputError as error:
        said = str(error)
    else:
        said = ""
    assert "\n" not in said


def test_a_field_is_made_in_any_frame_of_a_passage(tmp_path):
    """A goal 300 km off has its atoms beside it: the frame comes along, and nothing is refused for being far."""
    far = (
        RING.replace("lat = 50.8178", "lat = 48.1178")
        .replace("lat = 50.8185", "lat = 48.1185")
        .replace('until = "vessel"', 'until = "told"')
        .replace(f'polygon = "{SQUARE}"', "")
        + "[passage]\nleg_m = 400000.0\n"
    )
    mission = load(tmp_path, far)
    there = waters_of(mission)(mission.goals[0].point).goals[0]
    assert there.field.tree.atom("ring").at_en == pytest.approx((0.0, 77.8), abs=0.5)
    with pytest.raises(InputError, match=r"\[field.ring\]: is 300 km from \[\[goal\]\] 1"):
        load(tmp_path, far.replace("lat = 48.1178", "lat = 50.8178"))


def test_a_motor_boat_has_a_speed_and_no_polar(tmp_path):
    text = RING + '[autopilot]\nframe = "motor"\n'
    with pytest.raises(InputError, match=r"\[boat\] polar: a motor boat has no polar, and hers is 'ardurover'; write"):
        load(tmp_path, text)
    boat = voyage_of(load(tmp_path, text + "[boat]\npolar = 2.0\n")).boat
    assert boat.no_go_half_rad == 0.0
    assert boat.polar.speed_mps(0.0, 7.0) == boat.polar.speed_mps(3.0, 1.0) == 2.0
    with pytest.raises(InputError, match='"heading" is for a boat that sails'):
        load(tmp_path, text + '[boat]\npolar = 2.0\n[skipper]\nguidance = "heading"\n')


def test_check_tells_of_atoms_that_nobody_sails_by_and_of_a_field_without_a_value(tmp_path, capsys):
    (tmp_path / "m.toml").write_text(RING + MORE.partition("[field.lane]")[0])
    assert main(["mission", "check", str(tmp_path / "m.toml")]) == 0
    told = capsys.readouterr().out
    assert "[field]: warning: no goal is sailed by mark and stay" in told
    assert "goal 1, The ring: by field ring + 0.5 * islet, until a vessel is in its water, 600 s at the most" in told
    (tmp_path / "m.toml").write_text(RING.replace("ring + 0.5 *", "0.001 * ring + 0.001 *"))
    assert main(["mission", "check", str(tmp_path / "m.toml"), "--plot", str(tmp_path / "m.png")]) == 0
    assert "has no value at the goal's own place (0.01 of 10)" in capsys.readouterr().out
    assert main(["mission", "convert", str(tmp_path / "m.toml"), str(tmp_path / "m.gpx")]) == 0
    assert "of a field only the place" in "".join(capsys.readouterr())

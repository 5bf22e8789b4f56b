"""Scenario files: bad ones are one line that names file, place and remedy; all of ours load."""

import datetime as dt
import re
import socket
from itertools import chain, count
from pathlib import Path

import msgspec
import pytest

from companion.errors import InputError
from companion.geofence import load_mission
from sitl import cli
from sitl.autopilot import EPOCH_S
from sitl.run.depths import feed_of, sounder_port
from sitl.run.embedded import mission_of
from sitl.scenario import scenario as scenario_module
from sitl.scenario.scenario import beginning, load_scenario, scenario_wind
from sitl.scenario.traffic import PORTS, free_port

OURS = sorted(Path("sitl/scenarios").glob("*.toml"))


@pytest.mark.parametrize("path", OURS, ids=lambda p: p.stem)
def test_our_scenarios_load_and_their_weather_repeats(path):
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    assert scenario.title
    a, b = scenario_wind(scenario, path, 3), scenario_wind(scenario, path, 3)
    assert [a.at(t) for t in (0.0, 100.0, 50.0)] == [b.at(t) for t in (0.0, 100.0, 50.0)]


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("name = 'x'", "", "mission"),
        ("name='x'\nmission='no.toml'", "mission", "there is no file"),
        ("name='x'\nmission='m.toml'\nlimitt_s=3", "", "limit_s"),
        ("name='x'\nmission='m.toml'\n[wind]\nmodel='gale'", "wind.model", "gale"),
        ("name='x'\nmission='m.toml'\n[[events]]\nat_s=1\nkind='kraken'", "events", "kraken"),
        ("name='x'\nmission='m.toml'\n[[events]]\nat_s=1\nkind='far_order'", "events", "[satellite]"),
        ("name='x'\nmission='m.toml'\n[[events]]\nat_s=1\nkind='vane'\nstate='frozn'", "events", "frozen"),
        ("name='x'\nmission='m.toml'\n[[events]]\nat_s=1\nkind='leak'\nstate='on'", "events", "known: none"),
        ("name='x'\nmission='m.toml'\n[satellite]\nlos=1", "", "loss"),
        ("name=", "", "TOML"),
        ("", "", "s.toml: is empty; name the TOML file of a mission or a scenario"),
        ("mission='m.toml'", "", "s.toml: `name` is missing; add it"),
        ("name='x'\nmission='m.toml'\n[[events]]\nkind='leak'", "", "s.toml: events[0]: `at_s` is missing; add it"),
        ("name='x'\nmission='m.toml'\nwidth_m=3", "", "s.toml: unknown key `width_m`; known: name,"),
        ("from_autopilot=true", "", "has no [[goal]], as a mission has"),
        ("name='x'\nmision='m.toml'", "", "did you mean `mission`?"),
    ],
)
def test_bad_scenarios(tmp_path, text, place, words):
    path = tmp_path / "s.toml"
    path.write_text(text)
    (tmp_path / "m.toml").write_text("")
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(str(path))
    assert place in line
    assert words in line


def test_a_missing_file_is_one_line(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml"):
        load_scenario(tmp_path / "none.toml")


def test_a_mission_is_a_scenario():
    scenario = load_scenario(Path("sitl/missions/open-water.toml"))
    assert scenario.mission == "open-water.toml"


def test_a_mission_is_sailed_in_the_wind_that_it_is_previewed_in(tmp_path):
    """It was 5 m/s from 000, whatever the mission said, and no line told so."""
    goal = "[[goal]]\nlat = 50.0\nlon = 1.0\n"
    for table, wind in (("preview_from_deg = 200\npreview_speed_mps = 6.5\n", (200.0, 6.5)), ("", (0.0, 5.0))):
        (tmp_path / "m.toml").write_text(f"{goal}[wind]\n{table}")
        told = load_scenario(tmp_path / "m.toml").wind
        assert (told.from_deg, told.tws_mps) == wind


def test_a_water_that_is_in_both_folders_is_the_same():
    both = [path for path in Path("sitl/missions").glob("*.wkt") if Path("missions", path.name).exists()]
    assert len(both) == 5
    assert [path.name for path in both if path.read_bytes() != Path("missions", path.name).read_bytes()] == []


def test_of_a_mission_the_fence_is_not_the_circle_of_300_m_that_an_autopilot_comes_with():
    assert load_scenario(Path("missions/bay.toml")).parameters == {"FENCE_TYPE": 4.0}


def test_of_a_scenario_neither_unless_it_says_so(tmp_path):
    """A voyage farther than that waited for ever behind a fence that nobody had drawn."""
    text = Path("sitl/scenarios/demo.toml").read_text().replace("../../missions", str(Path("missions").resolve()))
    path = tmp_path / "far.toml"
    path.write_text(f"{text}\n[parameters]\nSAIL_XTRACK_MAX = 8.0\n")
    assert load_scenario(path).parameters == {"FENCE_TYPE": 4.0, "SAIL_XTRACK_MAX": 8.0}
    path.write_text(f"{text}\n[parameters]\nFENCE_TYPE = 6.0\n")
    assert load_scenario(path).parameters == {"FENCE_TYPE": 6.0}


def test_the_example_is_a_scenario_that_can_be_read_and_nothing_is_written_over(tmp_path, capsys):
    folder = tmp_path / "squall"
    assert cli.main(["example", str(folder)]) == 0
    scenario = load_scenario(folder / "squall.toml")
    assert (scenario.name, len(scenario.events), scenario.expect.max_time_s) == ("squall", 2, 600.0)
    assert cli.main(["example", str(folder)]) == 2
    assert "nothing is written over" in capsys.readouterr().err
    bare = "\n".join(
        line.removeprefix("# ") if re.match(r"# (\w+ = |\[)", line) else line
        for line in (folder / "squall.toml").read_text().splitlines()
    )
    (folder / "all.toml").write_text(bare)  # what is commented out is right, too
    assert load_scenario(folder / "all.toml").current is not None


def test_the_page_of_all_keys_says_something_of_each():
    made = Path("docs/reference/scenarios.md").read_text()
    assert re.findall(r"^.*\| (?:of )? *\|$", made, re.MULTILINE) == []
    tables = [c for c in vars(scenario_module).values() if isinstance(c, type) and issubclass(c, msgspec.Struct)]
    keys = {key for table in tables for key in table.__struct_fields__}
    assert [key for key in keys if f"| `{key}` |" not in made] == []


def test_a_free_port_is_nobodys_of_udp_and_of_tcp_and_none_that_the_system_gives_away(monkeypatch):
    taken, numbers = free_port(), count(free_port() - PORTS.start)
    for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
        drawn = chain([taken - PORTS.start], numbers)
        monkeypatch.setattr("sitl.scenario.traffic.secrets.randbelow", lambda among, drawn=drawn: next(drawn) % among)
        with socket.socket(socket.AF_INET, kind) as other:
            other.bind(("127.0.0.1", taken))
            assert free_port() != taken
        assert next(drawn) != taken - PORTS.start  # that one was drawn
    assert PORTS.stop <= 32_768


def test_a_mission_begins_now_a_scenario_when_it_says_and_either_when_it_is_told(tmp_path):
    """It was 9 June 2026 everywhere: dark at noon in Canberra."""
    mission = Path("missions/lake.toml")
    now = dt.datetime.now(dt.UTC)
    assert abs((beginning(load_scenario(mission), mission) - now).total_seconds()) < 61.0
    named = Path("sitl/scenarios/demo.toml")
    assert beginning(load_scenario(named), named).timestamp() == EPOCH_S
    at = dt.datetime(2026, 12, 24, 3, 0, tzinfo=dt.UTC)
    assert beginning(load_scenario(mission), mission, at) == beginning(load_scenario(named), named, at) == at


def test_a_sounder_that_speaks_nmea_is_refused_where_the_mission_listens_to_none():
    source = Path("sitl/scenarios/nmea-sounder.toml")
    scenario = load_scenario(source)
    mission = mission_of(scenario, source)
    port = sounder_port(mission, scenario)
    assert mission.with_sounder(feed_of(port)).options.sounder.feed == f"udpin:127.0.0.1:{port}"
    assert mission.with_sounder(feed_of(0)) is mission
    silent = load_mission("sitl/missions/shoaling.toml")
    with pytest.raises(InputError, match="hears no sounder by UDP"):
        sounder_port(silent, scenario)
    assert sounder_port(silent, load_scenario(Path("sitl/scenarios/sandbank.toml"))) == 0

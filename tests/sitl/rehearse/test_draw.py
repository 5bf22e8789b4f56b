"""What a seed of a rehearsal is: its wind, what is drawn for it, and how what the mission knows makes that smaller."""

import math
import random
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from companion.errors import InputError
from companion.geofence.mission.options import CurrentOptions
from sitl.rehearse.changes import change_of, usual
from sitl.rehearse.sampling import Doubts, drawn, given_wind
from sitl.run.embedded import mission_of
from sitl.scenario import HullSpec, SensorsSpec, WindSpec, load_scenario, scenario_wind

ROCKS = Path("missions/rocks.toml")
SEEDS = range(40)


@pytest.fixture(scope="module")
def base():
    return load_scenario(ROCKS)


@pytest.fixture(scope="module")
def mission(base):
    return mission_of(base, ROCKS)


def doubts(**words):
    told = {"wind": given_wind("5@350", WindSpec(), None), "boat": 1.0, "faults": False, "voyage_s": 200.0}
    return Doubts(**(told | words))


def given(mission, **tables):
    options = msgspec.structs.replace(mission.options, **tables)
    return replace(mission, options=options)


def test_a_seed_is_one_voyage_and_no_doubt_is_the_plan(base, mission):
    both = [drawn(seed, base, mission, doubts()) for seed in SEEDS]
    assert both == [drawn(seed, base, mission, doubts()) for seed in SEEDS]
    assert {kind for _, kinds in both for kind in kinds} > {"polar", "leeway", "tacks fail", "vane", "compass"}
    for seed in SEEDS:
        plain, kinds = drawn(seed, base, mission, doubts(boat=0.0))
        assert kinds == ()
        assert [getattr(plain, name) for name in ("boat", "sensors", "current", "waves")] == [None] * 4
        assert plain.wind.from_deg == both[seed][0].wind.from_deg  # the same wind, whatever the boat


def test_half_the_doubt_is_half_the_error(base, mission):
    for seed in SEEDS:
        whole, half = (drawn(seed, base, mission, doubts(boat=boat))[0] for boat in (1.0, 0.5))
        a, b = (s.boat or HullSpec() for s in (whole, half))
        assert b.beat - 1.0 == pytest.approx(0.5 * (a.beat - 1.0))
        assert b.tack_fails == pytest.approx(0.5 * a.tack_fails)
        assert b.leeway_deg == pytest.approx(0.5 * a.leeway_deg)
        c, d = (s.sensors or SensorsSpec() for s in (whole, half))
        assert (d.vane_deg, d.compass_deg) == (pytest.approx(0.5 * c.vane_deg), pytest.approx(0.5 * c.compass_deg))


def test_what_the_mission_knows_makes_it_smaller(base, mission, tmp_path):
    own = given(
        mission,
        boat=msgspec.structs.replace(mission.boat, polar="own.pol", leeway_deg=4.0),
        current=CurrentOptions(set_deg=90.0, drift_mps=0.4, sigma_mps=0.05),
    )
    assert own.polar_path is not None
    for seed in SEEDS:
        a, b = (drawn(seed, base, m, doubts())[0] for m in (mission, own))
        assert (b.boat or HullSpec()).beat - 1.0 == pytest.approx(0.5 * ((a.boat or HullSpec()).beat - 1.0))
        assert 0.0 < b.boat.leeway_deg < 10.0
        assert 0.2 < b.current.drift_mps < 0.6
    sure = drawn(3, base, own, doubts(boat=0.0))[0]
    assert (sure.boat.leeway_deg, sure.current.set_deg, sure.current.drift_mps) == (4.0, 90.0, 0.4)


def test_trouble_comes_on_request_within_the_voyage_and_no_stranger_sends_her_ashore(base, mission):
    kinds = set()
    for seed in range(150):
        s = drawn(seed, base, mission, doubts(faults=True))[0]
        kinds |= {event.kind for event in s.events}
        assert min((event.at_s for event in s.events), default=0.0) <= 200.0
        assert s.is_service
        assert s.wind == drawn(seed, base, mission, doubts())[0].wind
    assert {"link_cut", "vane", "kill_companion", "current"} <= kinds
    assert "foreign_mission" not in kinds


def test_a_wind_that_is_given_is_off_by_its_error():
    wind = given_wind("6@355", WindSpec(), (10.0, 0.5))
    specs = [wind.drawn(random.Random(seed), 200.0) for seed in range(400)]
    off = [(s.from_deg - 355.0 + 180.0) % 360.0 - 180.0 for s in specs]
    assert math.sqrt(sum(x * x for x in off) / 400) == pytest.approx(10.0, rel=0.15)
    assert math.sqrt(sum((s.tws_mps - 6.0) ** 2 for s in specs) / 400) == pytest.approx(0.5, rel=0.15)
    assert given_wind("6@355", WindSpec(), (0.0, 0.0)).drawn(random.Random(1), 9.0).from_deg == 355.0


def test_a_climate_is_drawn_by_its_shares(tmp_path):
    path = tmp_path / "july.csv"
    path.write_text("# of an almanac\nwind_from_deg,wind_speed_ms,share\n240,6,30\n60,3,10\n0,9,0\n")
    wind = given_wind(str(path), WindSpec(), None)
    drawn_ = [wind.drawn(random.Random(seed), 200.0) for seed in range(400)]
    assert {(s.from_deg, s.tws_mps) for s in drawn_} == {(240.0, 6.0), (60.0, 3.0)}
    assert sum(s.from_deg == 240.0 for s in drawn_) == pytest.approx(300, abs=30)
    assert wind.middle == (240.0, 6.0)


def test_a_record_is_sailed_from_a_time_of_each_seed(tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("t_s,wind_from_deg,wind_speed_ms\n" + "".join(f"{t},{t / 10},5\n" for t in range(0, 3601, 60)))
    wind = given_wind(str(path), WindSpec(), None).beside(tmp_path)
    assert wind.spec.file == "day.csv"
    begins = [wind.drawn(random.Random(seed), 600.0).from_s for seed in range(100)]
    assert (min(begins) < 300.0, max(begins) > 2700.0, max(begins) <= 3000.0) == (True, True, True)
    scenario = msgspec.structs.replace(load_scenario(ROCKS), wind=msgspec.structs.replace(wind.spec, from_s=1200.0))
    blown = scenario_wind(scenario, tmp_path / "s.toml", 1)
    assert math.degrees(blown.at(0.0)[0]) == pytest.approx(120.0)
    assert math.degrees(blown.at(600.0)[0]) == pytest.approx(180.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("strong", "is not a wind, SPEED@FROM, as 5@350; write SPEED@FROM"),
        ("90@10", "looks swapped: SPEED@FROM is 10@90, m/s and degrees"),
        ("45@10", "is out of range: up to 40 m/s"),
        ("90@60", "is out of range"),
        ("nowhere.csv", "^--wind: nowhere.csv: no such file; write SPEED@FROM"),
    ],
)
def test_a_wind_that_is_none_is_one_line(text, words):
    with pytest.raises(InputError, match=words) as caught:
        given_wind(text, WindSpec(), None)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("wind_from_deg,wind_speed_ms,share\n1,2\n", "line 2: is not three numbers"),
        ("wind_from_deg,wind_speed_ms,share\n1,-2,1\n", "line 2: is out of range"),
        ("wind_from_deg,wind_speed_ms,share\n1,2,0\n", "holds no wind"),
        ("a,b\n1,2\n", "no column t_s"),
    ],
)
def test_a_table_that_is_none_is_one_line_with_its_place(tmp_path, lines, words):
    path = tmp_path / "w.csv"
    path.write_text(lines)
    with pytest.raises(InputError, match=words):
        given_wind(str(path), WindSpec(), None)


def test_an_error_of_a_record_is_refused(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text("t_s,wind_from_deg,wind_speed_ms\n0,1,2\n1,1,2\n")
    with pytest.raises(InputError, match="a record has none"):
        given_wind(str(path), WindSpec(), (1.0, 1.0))


def test_a_change_is_of_one_thing(base, mission):
    scenario, _ = drawn(1, base, mission, doubts())
    margin = change_of("margin_m=20", mission)
    assert margin.variation.mission(mission).margin_m == 20.0
    assert margin.scenario(scenario) == scenario
    corridor = change_of("SAIL_XTRACK_MAX=4", mission).scenario(scenario)
    assert corridor.parameters == {**scenario.parameters, "SAIL_XTRACK_MAX": 4.0}
    later = change_of("later=2h", mission).scenario(scenario)
    assert (later.begins - scenario.begins).total_seconds() == later.wind.from_s == 7200.0


@pytest.mark.parametrize(
    "text", ["margin_m", "margin_m=x", "margin_m=-1", "delta_s=1.5", "SAIL_XTRACK_MAX=-1", "later=soon", "sail=3"]
)
def test_a_change_that_is_none_is_refused(mission, text):
    with pytest.raises(InputError):
        change_of(text, mission)


def test_a_change_that_is_nearly_one_is_asked_about(mission):
    with pytest.raises(InputError, match=r"'margn_m' is no change that is known; did you mean margin_m\?"):
        change_of("margn_m=3", mission)


def test_the_usual_changes_can_all_be_sailed(mission):
    found = [change.told for change in usual(mission, tells_the_hour=False)]
    assert len(found) == len(set(found)) >= 5
    assert not any("later" in words for words in found)
    assert any("later" in change.told for change in usual(mission, tells_the_hour=True))

"""What a seed is, what a voyage of it is judged by, and what is held against the promises."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.campaigns.drawn_mismatch import KINDS, LIMIT_S, WATERS, draw
from lab.campaigns.mismatch import (
    SailedSpan,
    arrival_promised,
    as_text,
    bow_rad,
    chance_of_no_go,
    figures_of,
    job_of,
    key_of,
    legs_promised,
    promised_s,
    sail,
    share_interval,
)
from sitl import cli
from sitl.runner import ResultStore
from sitl.scenario import HullSpec, SensorsSpec

ROCKS = next(n for n, path in enumerate(WATERS) if path.stem == "rocks")  # a seed on the shortest water


@pytest.fixture(scope="module")
def drawn():
    return [draw(seed) for seed in range(60)]


def test_a_seed_is_one_boat(drawn):
    assert [draw(seed) for seed in range(5)] == drawn[:5]
    assert len({str(d.to_dict()) for d in drawn}) == len(drawn)


def test_all_waters_take_turns_and_every_kind_comes(drawn):
    assert [d.source for d in drawn[: len(WATERS)]] == list(WATERS)
    assert {kind for d in drawn for kind in d.kinds} == set(KINDS)


def test_what_is_drawn_is_what_its_name_says_and_within_what_was_asked_for(drawn):
    for d in drawn:
        s, kinds = d.scenario, d.kinds
        boat, sensors = s.boat or HullSpec(), s.sensors or SensorsSpec()
        assert ("current" in kinds) == (s.current is not None)
        assert ("waves" in kinds) == (s.waves is not None)
        assert ("gusts" in kinds) == (s.wind.gust_spread > 0.0)
        assert ("leeway" in kinds) == (boat.leeway_deg > 0.0)
        assert ("tacks fail" in kinds) == (boat.tack_fails > 0.0)
        assert ("vane" in kinds) == (sensors.vane_deg != 0.0)
        assert ("position" in kinds) == (sensors.gps_noise_m > 0.0)
        assert all(0.8 <= share <= 1.2 for share in (boat.beat, boat.reach, boat.run))
        assert abs(sensors.vane_deg) <= 10.0
        if s.current is not None:
            assert s.current.drift_mps + s.current.tide_mps <= 0.5
        assert s.limit_s == LIMIT_S


def test_the_control_is_the_same_water_and_wind_and_nothing_else(drawn):
    for seed, other in enumerate(drawn[: len(WATERS)]):
        control = draw(seed, only=())
        assert (control.source, control.kinds) == (other.source, ())
        assert control.scenario.wind.tws_mps == other.scenario.wind.tws_mps
        assert [getattr(control.scenario, name) for name in ("current", "waves", "boat", "sensors")] == [None] * 4


@pytest.mark.parametrize("kind", KINDS)
def test_one_kind_alone_is_in_every_voyage_of_the_same_water_and_wind(drawn, kind):
    for seed, other in enumerate(drawn[: len(WATERS)]):
        alone = draw(seed, only=(kind,))
        assert (alone.source, alone.kinds) == (other.source, (kind,))
        assert alone.scenario.wind.tws_mps == other.scenario.wind.tws_mps
        assert alone.to_dict() != draw(seed, only=()).to_dict()


def test_a_kind_that_is_not_drawn_is_refused_and_the_others_are_named(capsys):
    assert cli.main(["mismatch", "--runs", "1", "--only", "fog"]) == 2
    said = capsys.readouterr().err
    assert "fog" in said
    assert "tacks fail" in said


def test_a_voyage_is_judged_kept_and_repeats(tmp_path, capsys):
    records = [sail(job_of(ROCKS, keep=tmp_path / str(n))) for n in range(2)]
    assert records[0] == records[1]
    assert records[0]["scenario"] == "rocks"
    assert records[0]["legs"]
    # held against a promise of when she is there: the judge's own time had the watched loiter in it, and all were late
    assert records[0]["time_s"] == json.loads((tmp_path / "0" / "summary.json").read_bytes())["time_s"]
    assert (tmp_path / "0" / "verdict.json").is_file()
    assert cli.main(["mismatch", "--first-seed", "3", "--keep", str(tmp_path / "0")]) == 2
    assert "is not empty" in capsys.readouterr().err


def record(seed, *, kinds=(), passed=True, clear_m=12.0, time_s=100.0, arrived=True, legs=()):
    return {
        "seed": seed,
        "scenario": "demo",
        "planned": False,
        "as_planned": False,
        "kinds": list(kinds),
        "drawn": {},
        "floor_m": 8.0,
        "passed": passed,
        "faults": [] if passed else ["contacts: 1"],
        "below_floor": clear_m < 8.0,
        "arrived": arrived,
        "contacts": int(not passed),
        "time_s": time_s,
        "tacks": 3,
        "min_clearance_m": clear_m,
        "silence_s": 1.0,
        "replans": 2,
        "promised_risk": 0.1,
        "no_go_entries": 0,
        "end_reason": "arrived",
        "path_risk": 0.2,
        "alerts": {},
        "promised_s": 100.0,
        "legs": list(legs),
    }


RECORDS = [
    record(
        0,
        kinds=("vane",),
        legs=[{"promised": 0.1, "came": True, "is_beat": False}, {"promised": 0.5, "came": True, "is_beat": True}],
    ),
    record(1, kinds=("vane", "gusts"), clear_m=3.0, time_s=140.0),
    record(2, kinds=("gusts",), passed=False, clear_m=0.0, arrived=False),
    {
        "seed": 3,
        "scenario": "gates",
        "planned": False,
        "as_planned": False,
        "kinds": [],
        "drawn": {},
        "floor_m": None,
        "passed": False,
        "faults": ["unhandled: x"],
    },
]


def test_the_table_counts_losses_too():
    table = figures_of(RECORDS)
    assert (table["voyages"], table["passed"], table["touched"], table["below_floor"]) == (4, 2, 1, 2)
    assert table["failed_seeds"] == [2, 3]
    assert table["below_floor_seeds"] == [1, 2]
    assert table["kinds"]["vane"]["below_floor"] == 1
    assert table["waters"]["gates"]["passed"] == 0
    assert (table["legs"], table["legs_in_no_go"]) == (1, 1)
    assert table["later_than_promised"] == 1
    text = as_text(table)
    assert "4 voyages: 2 passed, 2 arrived in time, 1 touched" in text
    assert as_text(figures_of([]))


def test_what_a_file_holds_is_not_sailed_again(tmp_path, capsys):
    out, figures = tmp_path / "v.jsonl", tmp_path / "v.json"
    with ResultStore(out, "mismatch") as ledger:
        for record in RECORDS[:3]:
            ledger.add(json.dumps(key_of(job_of(record["seed"])), separators=(",", ":")), record, {})
    whole = out.read_bytes()
    out.write_bytes(whole + b'{"key":{"seed":9')
    argv = ["mismatch", "--runs", "3", "--out", str(out), "--json", str(figures), "--workers", "1"]
    assert cli.main(argv) == 1
    said = capsys.readouterr().out
    assert "3 voyages, all of them in the file before" in said
    assert "again: sitl mismatch --first-seed 2 --keep DIR" in said
    assert "again: sitl mismatch --first-seed 1 --keep DIR" in said
    assert json.loads(figures.read_text())["figures"]["touched"] == 1
    assert out.read_bytes() == whole


@given(st.floats(-math.pi, math.pi), st.floats(0.001, 1.0))
def test_a_chance_is_one_and_grows_towards_the_wind(twa, sigma):
    half = math.radians(45.0)
    chance = chance_of_no_go(twa, sigma, half)
    assert -1e-12 <= chance <= 1.0
    assert chance <= chance_of_no_go(0.5 * twa, sigma, half) + 1e-9


def test_a_leg_is_held_against_the_newest_plan_that_has_it(tmp_path):
    def plan(t_s, twa_deg, number=1):
        leg = {"from": [0.0, 0.0], "to": [100.0, 0.0], "twa_deg": twa_deg, "sigma_deg": 10.0}
        made = {"t_s": t_s, "kind": "plan", "request_id": number, "plan": {"cost_s": 90.0 + t_s, "legs": [leg]}}
        return json.dumps(made) + "\n"

    asked = {"t_s": 1.0, "kind": "action", "action": "RequestPlan", "request_id": 7, "leeway_deg": 5.0}
    lines = plan(1.0, 60.0) + json.dumps(asked) + "\n" + plan(50.0, 50.0, 7)
    (tmp_path / "decisions.jsonl").write_text(lines + '{"t_s": 60, "ki')
    sailed = [
        SailedSpan(t_s=t, end_en_m=end, course_rad=course, bow_rad=math.pi / 2.0, twd_from_rad=twd)
        for t, end, course, twd in (
            (20.0, (100.1, 0.0), math.pi / 2.0, 0.0),
            (70.0, (100.0, 0.1), 1.0, 1.2),
            (80.0, (120.0, 0.0), 1.0, 0.0),
        )
    ]
    found = legs_promised(tmp_path, sailed, math.radians(45.0))
    assert [leg["came"] for leg in found] == [False, True]
    assert found[0]["promised"] == pytest.approx(0.0668, abs=1e-3)  # 1.5 sigma off
    assert found[1]["promised"] == pytest.approx(0.5, abs=1e-3)  # a course at 50 degrees, 5 of them leeway
    assert [leg["course_off_deg"] for leg in found] == [0.0, pytest.approx(math.degrees(1.0) - 90.0, abs=0.01)]
    assert found[1]["off_deg"] == pytest.approx(math.degrees(1.2 - math.pi / 2.0) - 45.0, abs=0.01)
    assert promised_s(tmp_path) == 91.0
    assert promised_s(tmp_path / "none") is None
    assert arrival_promised(tmp_path) is None  # a record from before plans said so


@given(st.floats(-3.0, 3.0), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(1.0, 3.0), st.floats(-0.2, 0.2))
def test_the_bow_that_keeps_to_a_leg_makes_its_course_good(course, east, north, speed, slip):
    heading = 0.4
    through = speed * math.sin(heading + slip), speed * math.cos(heading + slip)
    bow = bow_rad(course, (east, north), through, heading)
    made = speed * math.sin(bow + slip) + east, speed * math.cos(bow + slip) + north
    across = made[0] * math.cos(course) - made[1] * math.sin(course)
    stemmed = abs(east * math.cos(course) - north * math.sin(course)) < speed
    assert not stemmed or abs(across) < 1e-6


@given(st.integers(0, 500), st.integers(1, 500))
def test_an_interval_holds_its_share(hits, of):
    hits = min(hits, of)
    low, high = share_interval(hits, of)
    assert 0.0 <= low <= hits / of + 1e-12
    assert hits / of - 1e-12 <= high <= 1.0

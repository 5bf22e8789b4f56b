"""Promised against what came: the curves of voyages whose truth is known, and the command over them."""

import json
import random

import pytest

from lab.campaigns.reliability import as_text, coverage, floor_curve, late_curve, no_go_curve, time_shares, where_begun
from sitl import cli
from sitl.runner import ResultStore


def voyage(seed, legs, *, kinds=(), clear_m=12.0, time_s=110.0, **also):
    return {
        "seed": seed,
        "scenario": "demo",
        "planned": True,
        "as_planned": not kinds,
        "kinds": list(kinds),
        "passed": True,
        "legs": legs,
        "below_floor": clear_m < 8.0,
        "min_clearance_m": clear_m,
        "arrived": True,
        "time_s": time_s,
        "promised_s": 100.0,
        **also,
    }


def honest(count, factor=1.0):
    """Voyages of ten legs each whose promises are kept, or broken ``factor`` times as often."""
    rng = random.Random(4)
    for seed in range(count):
        legs = []
        for _ in range(10):
            promised = rng.choice((0.01, 0.08, 0.3))
            legs.append(
                {
                    "promised": promised,
                    "came": rng.random() < factor * promised,
                    "is_beat": False,
                    "sigma_deg": 10.0,
                    "off_deg": rng.gauss(0.0, 10.0 * factor),
                }
            )
        beat = {"promised": 0.9, "came": False, "is_beat": True, "sigma_deg": 9.0, "off_deg": 90.0}
        yield voyage(seed, [*legs, beat])


def test_promises_that_are_kept_lie_in_the_intervals():
    bins = no_go_curve(list(honest(300)))
    assert [b.name for b in bins] == ["0.001 to 0.02", "0.05 to 0.1", "0.2 to 0.5"]  # beats are not promised
    assert sum(b.of for b in bins) == 3000
    assert all(b.interval[0] <= b.promised <= b.interval[1] for b in bins)


def test_promises_that_are_broken_do_not():
    bins = no_go_curve(list(honest(300, factor=2.0)))
    assert all(b.promised < b.interval[0] for b in bins)


def test_a_spread_that_is_true_holds_its_share_and_one_that_is_half_of_it_does_not():
    true, half = coverage(list(honest(300))), coverage(list(honest(300, factor=2.0)))
    assert [b.promised for b in true] == [0.5, 0.8, 0.9, 0.95]
    assert all(b.interval[0] <= b.promised <= b.interval[1] for b in true)
    assert all(b.interval[1] < b.promised for b in half)
    assert coverage([]) == []


def test_a_leg_that_was_begun_elsewhere_is_no_promise_of_the_wind():
    kept = list(honest(300))
    stub = {"promised": 0.05, "came": True, "is_beat": False, "sigma_deg": 9.0, "off_deg": -35.0}
    strays = [voyage(400 + n, [{**stub, "course_off_deg": -30.0}]) for n in range(100)]
    assert coverage(kept + strays) == coverage(kept)
    on, elsewhere = where_begun(kept + strays)
    assert (on.of, elsewhere.of, elsewhere.came) == (3000, 100, 100)
    assert on.interval[0] <= on.promised <= on.interval[1]
    assert "begun elsewhere: promised   5.0 %, came 100.0 %" in as_text(strays)


def test_the_floor_is_counted_by_how_much_differs():
    records = [voyage(n, [], kinds=["x"] * n, clear_m=12.0 - n) for n in range(9)]
    records.append(voyage(9, [], kinds=["x"], clear_m=9.0, min_clearance_m=None))  # open water
    bins = floor_curve(records)
    assert [(b.name, b.came, b.of) for b in bins] == [
        ("0", 0, 1),
        ("1 to 3", 0, 3),
        ("4 to 5", 1, 2),
        ("6 to 7", 2, 2),
        ("8 to 10", 1, 1),
    ]


def test_times_are_of_arrivals_only():
    assert time_shares(
        [voyage(0, []), voyage(1, [], time_s=90.0), voyage(2, [], arrived=False), voyage(3, [], promised_s=None)]
    ) == [0.9, 1.1]
    assert "later than the expected time: 1 of 2" in as_text([voyage(0, []), voyage(1, [], time_s=90.0)])


def test_arrivals_are_held_against_each_quantile_that_was_stated():
    stated = {"p10_s": 80.0, "p50_s": 100.0, "p90_s": None}
    records = [voyage(n, [], time_s=t, arrival=stated) for n, t in enumerate((70.0, 90.0, 120.0))]
    records += [voyage(3, [], arrived=False, arrival=stated), voyage(4, [])]
    bins = late_curve(records)
    assert [(b.name, b.promised, b.came, b.of) for b in bins] == [
        ("after 10 %", 0.9, 2, 3),
        ("after 50 %", 0.5, 1, 3),
        ("after 90 %", pytest.approx(0.1), 0, 3),
    ]
    assert "later than the plan's quantiles of arrival" in as_text(records)


def test_the_command_tells_draws_and_writes(tmp_path, capsys):
    path, picture, figures = tmp_path / "v.jsonl", tmp_path / "r.png", tmp_path / "r.json"
    records = [*honest(20), voyage(90, [], kinds=["vane"], clear_m=2.0)]
    with ResultStore(path, "mismatch") as ledger:
        for record in records:
            ledger.add(json.dumps({"seed": record["seed"]}, separators=(",", ":")), record, {})
    assert cli.main(["reliability", str(path), "--plot", str(picture), "--json", str(figures)]) == 0
    said = capsys.readouterr().out
    assert "as planned: 20 voyages" in said
    assert "another boat and water: 1 voyages" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert json.loads(figures.read_text())["voyages"] == 21


@pytest.mark.parametrize("campaign", ["mismatch", "faults", None])
def test_what_holds_no_voyages_is_refused(tmp_path, capsys, campaign):
    path = tmp_path / "v.jsonl"
    if campaign is None:
        path.write_text("no voyage\n")
    else:
        with ResultStore(path, campaign):
            pass
    assert cli.main(["reliability", str(path)]) == 2
    assert str(path) in capsys.readouterr().err
    assert cli.main(["reliability", str(tmp_path / "none.jsonl")]) == 2

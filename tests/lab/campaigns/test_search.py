"""The search for failures: a campaign's own drawing by a stream of numbers, moved towards what happens rarely."""

import math
import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.campaigns import drawn_faults, drawn_mismatch, search
from lab.campaigns.faults import BASE
from lab.campaigns.search import LENGTH, NARROW, Point, SearchCase, Splitting, Tape, blind, drawn_of, moved
from sitl import cli
from sitl.runner import Experiment, Job
from sitl.scenario import load_scenario


def test_a_stream_gives_its_numbers_and_goes_on_the_same_behind_its_end():
    numbers = (0.25, 0.75, 0.0)
    first, second = ([tape.random() for _ in range(6)] for tape in (Tape(numbers), Tape(numbers)))
    assert first == second
    assert first[:3] == [0.25, 0.75, 0.0]
    assert all(0.0 <= x < 1.0 for x in first)


@settings(max_examples=15)
@given(st.lists(st.floats(0.0, 0.999999), min_size=LENGTH, max_size=LENGTH), st.integers(0, 5))
def test_whatever_a_stream_holds_can_be_drawn(numbers, seed):
    point = Point(seed=seed, numbers=tuple(numbers))
    base = load_scenario(BASE)
    assert drawn_faults.drawn_by(point.draws(), base) == drawn_faults.drawn_by(point.draws(), base)
    drawn_mismatch.drawn_by(point.draws(), NARROW)


def test_blind_points_draw_what_seeds_draw():
    """By how often each kind of mismatch is there: half of the search."""
    rng = random.Random(1)
    kinds = [set(drawn_mismatch.drawn_by(blind(rng).draws(), NARROW).kinds) for _ in range(80)]
    for kind in ("gusts", "polar", "vane", "position"):
        assert 26 <= sum(kind in found for found in kinds) <= 54


def test_a_move_is_near_and_some_of_it_far():
    rng = random.Random(2)
    point = blind(rng)
    others = [moved(rng, point) for _ in range(50)]
    same = [sum(a == b for a, b in zip(point.numbers, other.numbers, strict=True)) / LENGTH for other in others]
    assert 0.7 < sum(same) / 50 < 0.85
    assert 1 < sum(other.seed == point.seed for other in others) < 50


def found_after(seed, *, is_blind, dimensions=8, beyond=0.9):
    """How many points until one has all of its first numbers beyond a bound: a chance of 1e-8, blindly."""
    search = Splitting(random.Random(seed), each=40, is_blind=is_blind)
    for generation in range(60):
        scores = [max(0.0, sum(max(0.0, beyond - x) for x in point.numbers[:dimensions])) for point in search.ask()]
        if min(scores) <= 0.0:
            return 40 * generation + scores.index(min(scores)) + 1, search
        search.tell(scores)
    return math.inf, search


def test_what_is_one_in_a_hundred_million_is_found_in_a_thousand():
    runs = [found_after(seed, is_blind=False)[0] for seed in range(3)]
    assert max(runs) < 2400
    assert found_after(0, is_blind=True)[0] == math.inf


def test_the_chance_of_a_level_is_about_true():
    """Of one number below 0.02: two in a hundred."""
    chances = []
    for seed in range(8):
        search = Splitting(random.Random(seed), each=80)
        while search.threshold_m > 0.02:
            search.tell([point.numbers[0] for point in search.ask()])
        chances.append(search.chance * 0.02 / search.threshold_m)
    assert sum(chances) / len(chances) == pytest.approx(0.02, rel=0.5)


def test_what_is_found_is_left_as_a_scenario_that_repeats_it(tmp_path, monkeypatch, capsys):
    """Sailing is left out: the third voyage of the second generation touches."""

    def results(experiment, options):
        names = [experiment.key(job) for job in experiment.jobs]
        assert len({name["number"] for name in names}) == len(names)
        records = [
            {
                "number": n,
                "seed": job.seed,
                "score_m": 5.0 + n % 3,
                "drawn": ["gusts"],
                "violates": n == 6,
                "passed": True,
                "faults": ["contacts: 1"] if n == 6 else [],
            }
            for n, job in enumerate(experiment.jobs, start=len(made))
        ]
        made.extend(experiment.jobs)
        return type("Sailed", (), {"records": records, "lost": []})

    made = []
    monkeypatch.setattr(Experiment, "results", results)
    monkeypatch.chdir(tmp_path)
    assert cli.main(["search", "mismatch", "--each", "4", "--runs", "40"]) == 1
    out = capsys.readouterr().out
    assert "FOUND after 7 voyages: contacts: 1 (gusts); again: sitl run found/mismatch-6-" in out
    (path,) = Path("found").glob("*.toml")
    assert len(made) == 8
    kept, drawn = load_scenario(path), drawn_of(made[6])
    assert (kept.wind, kept.boat, kept.sensors, kept.current) == (drawn.wind, drawn.boat, drawn.sensors, drawn.current)
    assert kept.mission_path(path).samefile(drawn.mission_path(NARROW))


def test_a_voyage_that_is_excused_leads_nowhere(monkeypatch):
    job = Job(scenario=BASE, seed=0, case=SearchCase(what="faults", point=blind(random.Random(1)), number=0))
    for excuse, score_m in (("operator", None), ("none", 0.0)):
        monkeypatch.setattr(
            search.faults,
            "sail_faults",
            lambda *_, e=excuse: {
                "contacts": [{"excuse": e}],
                "clearance_m": 0.0,
                "events": [],
                "passed": False,
                "faults": [],
            },
        )
        monkeypatch.setattr(search, "UNEXCUSED", "none")
        assert search.sail(job)["score_m"] == score_m


def test_a_water_is_of_mismatch(capsys):
    assert cli.main(["search", "faults", "--water", str(NARROW)]) == 2
    assert "faults have a water of their own" in capsys.readouterr().err

"""Two tables held against each other: pairs by seed, changes with their intervals, luck told from a worsening."""

import json
import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.errors import InputError, JobError
from sitl import cli
from sitl.options import CampaignOptions
from sitl.rehearse.changes import difference_text, is_sure
from sitl.results import LEVEL, compare, comparison_text, table_text
from sitl.runner import ResultStore, Table, made_by, read_results, read_table, write_table
from tests.sitl.runner.jobs import jobs_in, quick


def row(seed, time_s=300.0, *, scenario="demo", water="abc", **more):
    return {
        "scenario": scenario,
        "hash": water,
        "seed": seed,
        "passed": True,
        "arrived": True,
        "contacts": 0,
        "time_s": time_s,
        "min_clearance_m": 12.0,
        "tacks": 6,
        **more,
    }


def table(rows, campaign="campaign"):
    return Table(campaign=campaign, by=made_by(), keys=("scenario", "hash", "seed"), rows=tuple(rows))


def noisy(seeds, seed, share=1.0, **more):
    rng = random.Random(seed)
    return [row(n, 300.0 * share * rng.lognormvariate(0.0, 0.03), **more) for n in seeds]


def change_of(comparison, name, group="demo"):
    return next(c for c in comparison.changes if c.measure.name == name and c.group == group)


def test_the_same_is_the_same():
    found = compare(table(noisy(range(8), 1)), table(noisy(range(8), 1)))
    assert (found.same, len(found.pairs), found.worse) == (8, 8, ())
    assert compare(table(noisy(range(8), 1)), table(noisy(range(8), 1, gybes=3))).same == 8  # counted since
    assert compare(table(noisy(range(8), 1, gybes=2)), table(noisy(range(8), 1, gybes=3))).same == 0
    text = comparison_text(found)
    assert "8 pairs, 8 of them the same in every figure\nno figure that is measured here changed\nnot worse" in text


def test_two_files_of_a_scenario_each_are_two_settings_and_paired_by_seed():
    found = compare(table(noisy(range(8), 1)), table(noisy(range(8), 1, 1.1, scenario="gusty", water="def")))
    assert len(found.pairs) == 8
    assert change_of(found, "time").change == pytest.approx(1.1)
    with pytest.raises(InputError, match="no job is in both"):
        compare(table(noisy(range(8), 1)), table([row(1, scenario="a"), row(2, scenario="b")]))


def test_one_guidance_in_each_file_is_two_settings_too():
    """As the guide has it; it was "no job is in both files"."""
    keys = ("scenario", "hash", "seed", "guidance")
    one, other = (
        replace(table(noisy(range(8), 1, share, guidance=guidance)), keys=keys)
        for guidance, share in (("waypoints", 1.0), ("heading", 1.1))
    )
    assert len(compare(one, other).pairs) == len(compare(table(one.rows), other).pairs) == 8


@pytest.mark.parametrize(("pairs", "is_told"), [(1, False), (5, False), (6, True)])
def test_of_a_few_pairs_no_interval_is_told_and_nothing_is_sure(pairs, is_told):
    """ "clearance +2.7 m (+2.7 to +2.7)" of one pair read as certain."""
    found = compare(table(noisy(range(pairs), 1)), table(noisy(range(pairs), 1, 1.1)))
    change = change_of(found, "time")
    assert difference_text(change).endswith("too few for an interval)") is not is_told
    assert is_sure(change) is is_told


def test_a_ratio_is_of_pairs_and_its_interval_holds_it():
    before = noisy(range(20), 1)
    after = [{**r, "time_s": r["time_s"] * 1.1} for r in before]
    time = change_of(compare(table(before), table(after)), "time")
    assert (time.change, time.low, time.high) == pytest.approx((1.1, 1.1, 1.1))
    assert time.is_worse
    assert not change_of(compare(table(after), table(before)), "time").is_worse


@pytest.mark.parametrize(("share", "is_worse"), [(1.05, True), (1.003, False), (0.95, False)])
def test_slower_by_a_twentieth_is_found_among_noise_and_a_trifle_is_not(share, is_worse):
    found = compare(table(noisy(range(40), 1)), table(noisy(range(40), 2, share)))
    assert [c.measure.name for c in found.worse] == (["time"] if is_worse else [])


def test_luck_is_called_worse_seldom():
    """Forty figures of nothing but noise: at most LEVEL of them, and a binomial's spread."""
    worse = [compare(table(noisy(range(12), n)), table(noisy(range(12), 1000 + n))).worse for n in range(100)]
    assert sum(bool(w) for w in worse) <= 100 * LEVEL + 5


def test_voyages_that_fail_are_counted_by_those_that_changed():
    before = [row(n) for n in range(30)]
    few = compare(table(before), table([row(n, passed=n > 1) for n in range(30)]))
    many = compare(table(before), table([row(n, passed=n > 9) for n in range(30)]))
    assert change_of(few, "passed").p_worse == 0.25
    assert few.worse == ()
    assert [c.measure.name for c in many.worse] == ["passed"]
    assert change_of(many, "passed").change == pytest.approx(-1 / 3)


def test_the_worst_seeds_come_first_and_are_told():
    before = [row(n) for n in range(5)]
    after = [row(0), row(1, 310.0), row(2, 400.0), row(3, passed=False, contacts=2), row(4, 290.0)]
    found = compare(table(before), table(after))
    assert [p.name for p in found.pairs[:3]] == ["demo seed 3", "demo seed 2", "demo seed 1"]
    text = comparison_text(found, most=2)
    assert "demo seed 3: passed yes -> no, touched no -> yes\n  demo seed 2: time 300.0 -> 400.0\n" in text
    assert "demo seed 1" not in text


def test_only_pairs_count_and_what_has_none_is_said():
    found = compare(table([row(n) for n in range(5)]), table([row(n, water="other") for n in range(3, 9)]))
    assert (len(found.pairs), found.only, found.other_water) == (2, (3, 4), ("demo",))
    assert "; 3 only in the first; 4 only in the second\nthe files of demo are not the same in both" in comparison_text(
        found
    )
    with pytest.raises(InputError, match="no job is in both files"):
        compare(table([row(1)]), table([row(2)]))
    with pytest.raises(InputError, match="sitl campaign and sitl faults have no pairs"):
        compare(table([row(1)]), table([row(1)], campaign="faults"))


def test_groups_are_shown_and_all_of_them_judged():
    def rows(share):
        return noisy(range(9), 1) + [row(n, 200.0 * share, scenario="upwind") for n in range(9)]

    found = compare(table(rows(1.0)), table(rows(1.2)))
    assert {c.group for c in found.changes} == {"all", "demo", "upwind"}
    assert [(c.group, c.measure.name) for c in found.worse] == [("all", "time")]
    assert change_of(found, "time", "upwind").change == pytest.approx(1.2)


@given(st.lists(st.tuples(st.floats(10.0, 900.0), st.floats(10.0, 900.0)), min_size=1, max_size=12))
@settings(max_examples=60)
def test_a_change_lies_in_its_interval_and_turns_with_the_tables(times):
    before, after = (table([row(n, pair[k]) for n, pair in enumerate(times)]) for k in (0, 1))
    there, back = change_of(compare(before, after), "time"), change_of(compare(after, before), "time")
    assert there.low <= there.change * (1 + 1e-9)
    assert there.change <= there.high * (1 + 1e-9)
    assert there.change * back.change == pytest.approx(1.0)
    assert 0.0 < there.p_worse <= 1.0


# ------------------------------------------------------------------------------------------- files
@pytest.fixture
def ledger(tmp_path):
    (tmp_path / "attempts").mkdir()
    jobs = jobs_in(tmp_path / "attempts", range(5))
    out = tmp_path / "r.jsonl"
    quick(jobs).results(CampaignOptions(workers=1, out=out, table=tmp_path / "r.parquet"))
    return out


def test_a_table_is_what_the_file_of_results_is(ledger):
    kept = read_table(ledger.with_suffix(".parquet"))
    assert kept == read_table(ledger)
    assert kept.by == made_by()
    assert [r["seed"] for r in kept.rows] == list(range(5))
    assert kept.rows[0]["track"] == "[1,2.5]"
    again = ledger.with_name("again.parquet")
    write_table(kept, again)
    assert again.read_bytes() == ledger.with_suffix(".parquet").read_bytes()


def test_anything_that_reads_parquet_reads_it(ledger):
    from pyarrow import parquet

    found = parquet.read_table(ledger.with_suffix(".parquet")).to_pydict()
    assert found["scenario"] == ["quick"] * 5
    assert found["made_by_source"] == [made_by().source] * 5
    assert json.loads(found["made_by_libraries"][0])["numpy"]


def test_values_of_several_kinds_are_kept(tmp_path):
    rows = [{"seed": 0, "a": 1, "b": None, "c": "x"}, {"seed": 1, "a": 2.5, "b": True, "c": 3}]
    path = tmp_path / "t.parquet"
    write_table(Table(campaign="quick", by=made_by(), keys=("seed",), rows=tuple(rows)), path)
    assert read_table(path).rows == (
        {"seed": 0, "a": 1.0, "b": None, "c": "x"},
        {"seed": 1, "a": 2.5, "b": True, "c": "3"},
    )


def test_parts_are_joined_to_the_file_of_the_whole(tmp_path, ledger, capsys):
    jobs = jobs_in(tmp_path / "attempts", range(5))
    parts = []
    for number in (1, 2):
        means = CampaignOptions(workers=1, out=tmp_path / "p.jsonl", array=(number, 2))
        quick(jobs).results(means)
        parts.append(str(means.file))
    assert cli.main(["results", "join", *parts, "--out", str(tmp_path / "whole.jsonl")]) == 0
    assert (tmp_path / "whole.jsonl").read_bytes() == ledger.read_bytes()
    assert cli.main(["results", "join", *parts, "--out", str(tmp_path / "whole.parquet")]) == 0
    assert read_table(tmp_path / "whole.parquet") == read_table(ledger)
    capsys.readouterr()
    text, other = ledger.read_text(), tmp_path / "other.jsonl"
    other.write_text(text.replace('"passed":true', '"passed":false', 1))
    words = ["results", "join", str(ledger), str(other), "--out", str(tmp_path / "w.jsonl")]
    assert cli.main(words) == 2
    assert "has another result than in the files before" in capsys.readouterr().err
    other.write_text(text.replace(made_by().source, "f" * 16))
    assert cli.main(words) == 2
    assert "was made by another program (its source is ffffffffffffffff there" in capsys.readouterr().err


def test_the_command_shows_compares_and_fails_on_worse(tmp_path, ledger, capsys):
    assert cli.main(["results", "show", str(ledger)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("sitl quick: 5 results by ")
    assert "quick  5" in shown
    slow = tmp_path / "slow.jsonl"
    held = read_results(ledger)
    with ResultStore(slow, "quick") as file:
        for key, result in held.results.items():
            figures = {**result["figures"], "time_s": 2.0 * result["figures"]["time_s"]}
            file.add(key, {**result, "arrived": True, "figures": figures}, {})
    words = ["results", "compare", str(ledger.with_suffix(".parquet")), str(slow), "--json", str(tmp_path / "c.json")]
    assert cli.main([*words, "--fail-on-worse"]) == 0  # nobody arrived in the first: no pair of times
    assert "5 pairs, 0 of them the same" in capsys.readouterr().out
    faster = tmp_path / "faster.parquet"
    rows = tuple({**r, "time_s": 1.0, "seed": n} for r in read_table(slow).rows for n in range(12))
    write_table(replace(read_table(slow), rows=rows), faster)
    write_table(replace(read_table(slow), rows=tuple({**r, "time_s": 2.0} for r in rows)), slow.with_suffix(".parquet"))
    words = ["results", "compare", str(faster), str(slow.with_suffix(".parquet")), "--json", str(tmp_path / "c.json")]
    assert cli.main([*words, "--fail-on-worse"]) == 1
    assert "WORSE: time (quick)" in capsys.readouterr().out
    assert cli.main(words) == 0
    assert [c["measure"] for c in json.loads((tmp_path / "c.json").read_text())["changes"] if c["worse"]] == ["time"]


@pytest.mark.parametrize("name", ["t.parquet", "t.jsonl"])
def test_what_is_no_table_is_one_line(tmp_path, capsys, name):
    path = tmp_path / name
    for write in (lambda: None, lambda: path.write_bytes(b"PAR1 no"), path.unlink):
        write()
        assert cli.main(["results", "show", str(path)]) == 2
        err = capsys.readouterr().err
        assert str(path) in err
        assert err.count("\n") == 1
        path.write_text("")


def test_a_disk_that_takes_no_table_says_so(tmp_path):
    with pytest.raises(JobError, match=r"none/t.parquet: No such file or directory"):
        write_table(table([row(1)]), tmp_path / "none" / "t.parquet")


def test_a_table_in_words_counts_by_scenario():
    text = table_text(table([row(0), row(1, passed=False, contacts=1), row(2, scenario="upwind")]))
    lines = {line.split()[0]: line.split() for line in text.splitlines()[2:]}
    assert lines["demo"][1:5] == ["2", "1/2", "1/2", "-"]
    assert lines["upwind"][1] == "1"

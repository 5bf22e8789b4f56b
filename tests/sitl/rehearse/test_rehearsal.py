"""A rehearsal by its command: it ends when it is sure, goes on where it was, and keeps what a full disk leaves."""

import datetime as dt
import errno
import json
import math
import random
import re
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from companion import cli
from companion.disk import Disk
from companion.errors import JobError
from companion.plots.chart import save
from sitl import cli as sitl_cli
from sitl.rehearse import picture, rehearsal
from sitl.rehearse.estimates import as_lines, estimates_of, lasting, why_bad
from sitl.rehearse.picture import shares_of
from sitl.rehearse.prepared import prepared
from sitl.rehearse.rehearsal import Follower, Limits, RehearsalOutcome, _words
from sitl.rehearse.voyage import RehearsalCase, key_of, sail
from sitl.runner import CampaignResults, Job, ResultStore, ScenarioBundle, made_by
from sitl.runner.result_store import StoredResults

ROCKS = Path("missions/rocks.toml").resolve()


def record(seed, *, arrived=True, low=False, time_s=None, **more):
    return {
        "seed": seed,
        "arrived": arrived,
        "below_floor": low,
        "contacts": 0,
        "time_s": time_s or 200.0 + seed,
        "min_clearance_m": 7.0 if low else 12.0,
        "alerts": {},
        **more,
    }


# ------------------------------------------------------------------------------------------------ what is known
def test_it_ends_at_the_same_voyage_in_whatever_order_results_come():
    rng = random.Random(5)
    records = [record(n, arrived=rng.random() < 0.95) for n in range(400)]
    ends = set()
    for order in range(4):
        follower, there = Follower(Limits(width=0.15, runs=400)), [None] * 400
        seeds = list(range(400))
        for n in range(0, 400, 20):  # workers are ahead of each other by some voyages
            block = seeds[n : n + 20]
            random.Random(order).shuffle(block)
            seeds[n : n + 20] = block
        for seed in seeds:
            there[seed] = records[seed]
            if follower(there)[1]:
                break
        ends.add((follower.count, follower.ends, len(follower.known.records)))
    assert len(ends) == 1
    count, words, known = ends.pop()
    assert (words, known) == ("sure enough", count)
    assert 20 < count < 400


def test_a_quick_voyage_after_a_gap_is_not_counted_yet():
    known = estimates_of([record(0), None, record(2)])
    assert [r["seed"] for r in known.records] == [0]


def test_a_voyage_that_was_lost_is_no_voyage_and_holds_up_nothing():
    follower = Follower(Limits(width=0.1, runs=100))
    assert not follower([{} if n == 3 else record(n) for n in range(53)])[1]
    assert follower([{} if n == 3 else record(n) for n in range(54)])[1]
    assert follower.known.arrives.of == 53


def test_the_time_ends_it_too():
    follower = Follower(Limits(width=0.01, runs=9, minutes=1e-9))
    assert follower([record(0), None]) == (follower.known.line(), True)
    assert follower.ends == "the time is over"


def test_of_the_minutes_the_chances_have_their_share_and_the_page_is_told_from_the_first_voyage_on():
    shown = []
    limits = Limits(width=0.01, runs=9, minutes=1.0, began_s=time.monotonic() - 40.0)
    assert not Follower(limits)([record(0), None])[1]
    follower = Follower(limits, share=0.6, on_known=shown.append)
    assert follower([record(0), None])[1]
    assert [known.arrives.of for known in shown] == [1]


def test_the_worst_come_in_the_order_of_what_they_cost():
    records = [
        record(0),
        record(1, time_s=900.0),
        record(2, arrived=False, end_reason="out of time"),
        record(3, low=True),
        record(4, contacts=1),
        record(5, arrived=False, error="ValueError()"),
    ]
    known = estimates_of(records)
    assert [r["seed"] for r in known.worst(6)] == [5, 4, 3, 2, 1, 0]
    assert [why_bad(r).split(" ")[0] for r in known.worst(4)] == ["an", "touched", "arrived", "did"]


def test_watchdogs_are_counted_by_voyages_and_times_by_all():
    known = estimates_of(
        [record(0, alerts={"in irons": 3}), record(1, alerts={"in irons": 1, "done": 1}), record(2, arrived=False)]
    )
    assert {name: share.came for name, share in known.watchdogs.items()} == {"in irons": 2}
    assert [q.value for q in known.times] == [200.0, 201.0, math.inf]
    assert "fewer than 90 % arrive (3 min 20 s to never)" in "\n".join(as_lines(known))
    assert known.to_dict()["time_s"][2]["value"] is None
    assert json.loads(json.dumps(known.to_dict(), allow_nan=False))["voyages"] == 3
    assert lasting(59.6) == "1 min 0 s"


def test_where_nothing_was_sailed_only_that_is_said_and_no_bound_is_that_she_is_there_at_once():
    assert as_lines(estimates_of(())) == ["no voyage was sailed to its end: nothing is known yet"]
    few = "\n".join(as_lines(estimates_of([record(n) for n in range(6)])))
    assert "10 % are there within 3 min 20 s (3 min 23 s at the latest)" in few
    assert " 0 s" not in few
    assert "any time: too few voyages" in "\n".join(as_lines(estimates_of([record(0)])))


def test_what_is_waited_for_counts_in_the_plan_and_before_a_voyage_is_called_off(tmp_path, monkeypatch):
    """A gun half an hour after setting sail: every voyage was called off before it was heard."""
    kinds = {
        "line": 'kind = "gate"\nport_mark = { lat = 50.8172, lon = -1.3103 }\n'
        "starboard_mark = { lat = 50.8172, lon = -1.3097 }\n",
        "stay": 'kind = "box"\npolygon = "POLYGON ((-1.3105 50.818, -1.3095 50.818, -1.3095 50.8185, -1.3105 50.8185, '
        '-1.3105 50.818))"\n',
    }

    def limits(**keys):
        text = ROCKS.read_text().replace('obstacles = ["rocks.wkt"]\n', "")
        goals = "".join(f"[[goal]]\n{kind}{keys.get(name, '')}\n" for name, kind in kinds.items() if name in keys)
        (tmp_path / "m.toml").write_text(text.replace("[[goal]]", f"{goals}[[goal]]", 1))
        monkeypatch.setattr(
            "sitl.rehearse.prepared._planned", lambda *_: [SimpleNamespace(cost_s=200.0) for _ in range(len(keys) + 1)]
        )
        made = prepared(
            tmp_path / "m.toml",
            tmp_path / "out",
            wind=[],
            wind_error=None,
            doubt=1.0,
            faults=False,
            depart=dt.datetime(2026, 11, 21, 12, tzinfo=dt.UTC),
            limit_s=None,
        )
        return made.waits_s, made.planned_s, made.scenario.limit_s

    assert limits() == (0.0, 200.0, 900.0)
    assert limits(line="after_s = 1800.0") == (1600.0, 2000.0, 2800.0)
    assert limits(line="after_s = 60.0") == (0.0, 400.0, 1200.0)
    assert limits(line="not_before = 2026-11-21T13:00:00Z") == (3400.0, 3800.0, 4600.0)
    assert limits(line="after_s = 300.0", stay="for_s = 7200.0") == (7300.0, 7900.0, 1800.0 + 7300.0 + 3600.0)


def test_the_map_counts_voyages_and_not_how_long_they_stayed():
    there = np.array([[0.0, 5.0], [10.0, 5.0]])
    back = np.array([[0.0, 5.0], [4.9, 5.0], [0.0, 5.0]])
    shares = shares_of([there, back], (0.0, 0.0, 10.0, 10.0))
    assert shares.max() == 1.0
    row = shares[int(0.5 * shares.shape[0])]
    assert (row[0], row[-1]) == (1.0, 0.5)
    assert shares_of([], (0.0, 0.0, 1.0, 1.0)).max() == 0.0


def test_without_the_library_of_pictures_it_is_said_and_no_old_one_is_left(tmp_path, monkeypatch, capsys):
    old = tmp_path / "rehearsal.png"
    old.write_bytes(b"of another run")
    monkeypatch.delitem(sys.modules, "sitl.rehearse.picture", raising=False)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    rehearsal._draw(None, None, old)
    assert "there is no picture: matplotlib is not installed" in capsys.readouterr().out
    assert not old.exists()


# ---------------------------------------------------------------------------------------------- by the command
@pytest.fixture(scope="module")
def sailed(tmp_path_factory):
    """A rehearsal of a user's own mission, from an empty folder, three voyages and two with a change."""
    home = tmp_path_factory.mktemp("user")
    for name in ("rocks.toml", "rocks.wkt"):
        shutil.copy(ROCKS.parent / name, home / name)
    return home


def run(home, monkeypatch, capsys, *words):
    """Rehearse with voyages that are called off after a minute, one worst of them, by one process."""
    monkeypatch.chdir(home)
    monkeypatch.setattr("sitl.rehearse.rehearsal.MOST_WORST", 1)
    code = cli.main(["rehearse", "rocks.toml", "--workers", "1", "--limit", "1m", *words])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_it_is_a_command_of_the_companion_that_knows_no_simulator(capsys):
    assert "rehearse" not in cli.PROGRAM.commands
    assert "rehearse" in cli.PROGRAM.names
    assert cli.main(["rehears"]) == 2
    assert "did you mean `companion rehearse`?" in capsys.readouterr().err


def test_a_user_rehearses_a_mission_goes_on_and_looks_at_the_worst(sailed, monkeypatch, capsys):
    code, out, err = run(sailed, monkeypatch, capsys, "--runs", "1", "--pairs", "0")
    assert code == 0
    assert "1 voyage; in brackets what is 95 % sure" in out
    assert re.search(r"1 sailed, 0 at most to come; of 1: arrives 0 to \d+ %", err)
    folder = sailed / "rehearsals" / "rocks"
    whole = (folder / "results.jsonl").read_bytes()

    drawn = []
    monkeypatch.setattr(picture, "save", lambda figure, path: drawn.append(figure) or save(figure, path))
    words = ("--runs", "2", "--pairs", "1", "--try", "margin_m=15", "--minutes", "90", "--json", "figures.json")
    code, out, err = run(sailed, monkeypatch, capsys, *words)
    assert code == 0
    # of six minutes it told "1040 s left", which was how long all pairs would have taken
    assert re.search(r"1 sailed, 0 at most to come; at most \d+ s left", err)
    assert re.search(
        r"^the worst again: 1 of \d$", err, re.MULTILINE
    )  # a file that is no terminal gets no carriage return
    assert "1 in the file before" in out
    assert "margin_m 15, 1 pair: " in out
    lines = (folder / "results.jsonl").read_bytes()
    assert all(line in lines for line in whole.splitlines())
    figures = json.loads((sailed / "figures.json").read_text())
    assert figures == json.loads((folder / "rehearsal.json").read_text())
    assert (figures["voyages"], figures["arrives"]["of"], len(figures["tracks"]), len(figures["worst"])) == (2, 2, 2, 1)
    assert figures["changes"][0]["pairs"] == 1
    assert all(len(track["en_m"]) > 1 for track in figures["tracks"])

    page = (folder / "rehearsal.html").read_text()
    links = re.findall(r"href='(worst/[^']+)'", page)
    assert len(links) == 1
    assert (folder / links[0]).is_file()
    assert "http" not in re.sub(r"base64,[^']+", "", page)  # it asks nobody for anything
    assert (folder / "rehearsal.png").read_bytes()[:4] == b"\x89PNG"
    assert "prefers-color-scheme:dark){img{filter:invert(1)" in page  # no white picture on a dark page
    chart, times, changes = (
        next(axes for axes in drawn[-1].axes if words in f"{axes.get_title()}{axes.get_xlabel()}")
        for words in ("east of the start", "Times", "What a change is worth")
    )
    assert all(word.get_path_effects() for word in chart.texts)  # read where tracks run through them
    assert times.xaxis.get_major_formatter()(371.0, 0) == "6:11"
    assert changes.get_xlabel() == "time, % (95 %)"
    worst = Path(figures["worst"][0]["folder"])
    assert (worst / "track.csv").is_file()
    assert cli.main(["replay", str(worst)]) == 0


def test_a_voyage_takes_as_long_as_its_own_report_tells(tmp_path):
    """It was told seven seconds longer: those in which her loiter is watched before the program ends."""
    made = prepared(ROCKS, tmp_path, wind=["5@0"], wind_error=None, doubt=0.0, faults=False, depart=None, limit_s=None)
    found = sail(Job(scenario=made.source, seed=1, case=RehearsalCase(doubts=made.doubts), keep=tmp_path / "voyage"))
    assert found["arrived"]
    assert found["time_s"] == json.loads((tmp_path / "voyage/summary.json").read_bytes())["time_s"]


def test_a_disk_that_is_full_when_all_is_sailed_costs_no_voyage(sailed, monkeypatch, capsys):
    """The folder of the worst and the figures find no room; the answer is told, and is there again afterwards."""
    words = ("--runs", "1", "--pairs", "0", "--out", "full")
    run(sailed, monkeypatch, capsys, *words)
    folder = sailed / "full"
    before = (folder / "results.jsonl").read_bytes()
    replaced, copied = Disk.replace, shutil.copytree

    def full(source, target, *more, **words):
        if "full" in Path(target).parts:
            raise OSError(errno.ENOSPC, "No space left on device", str(target))
        return copied(source, target, *more, **words)

    def full_too(self, path, data, **words):
        if path.name == "rehearsal.json":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        replaced(self, path, data, **words)

    with monkeypatch.context() as m:
        m.setattr("sitl.rehearse.voyage.shutil.copytree", full)
        m.setattr(Disk, "replace", full_too)
        code, out, err = run(sailed, m, capsys, *words)
    assert code == 1
    assert "arrives: " in out
    assert "not written: full/rehearsal.json: No space left on device; the voyages are safe" in out
    assert "No space left on device: the folder is not kept, the result is" in err
    assert (folder / "results.jsonl").read_bytes() == before
    code, out, _ = run(sailed, monkeypatch, capsys, *words)
    assert code == 0
    assert "1 voyage, all of them in the file before" in out


def test_a_part_says_how_the_parts_come_together(sailed, monkeypatch, capsys, tmp_path):
    out = tmp_path / "parts"
    words = ("--runs", "2", "--pairs", "0", "--out", str(out))
    for number in (1, 2):
        code, said, _ = run(sailed, monkeypatch, capsys, *words, "--array", f"{number}/2")
        assert code == 0
        assert f"part {number} of 2" in said
    parts = sorted(map(str, out.glob("results.*-of-2.jsonl")))
    assert len(parts) == 2
    assert sitl_cli.main(["results", "join", *parts, "--out", str(out / "results.jsonl")]) == 0
    capsys.readouterr()
    code, said, _ = run(sailed, monkeypatch, capsys, *words)
    assert code == 0
    assert "2 voyages, all of them in the file before" in said


def test_another_rehearsal_in_the_folder_of_one_that_sails_is_refused_and_changes_nothing(sailed, monkeypatch):
    """Each voyage reads the scenario: what the first had left to sail was called off by the hours of the second."""
    monkeypatch.chdir(sailed)
    monkeypatch.setattr("sitl.rehearse.prepared._planned", lambda *_: [SimpleNamespace(cost_s=200.0)])

    def made(limit_s):
        return prepared(
            Path("rocks.toml"),
            Path("busy"),
            wind=["5@0"],
            wind_error=None,
            doubt=1.0,
            faults=False,
            depart=None,
            limit_s=limit_s,
        )

    source = made(60.0).source
    before = source.read_bytes()
    with ResultStore(Path("busy/results.jsonl"), "rehearse"):
        with pytest.raises(JobError, match=r"busy/results\.jsonl: another run writes it; wait for it"):
            made(90.0)
        assert source.read_bytes() == before
        assert made(60.0).source == source  # the parts of an array
    made(90.0)
    assert source.read_bytes() != before


def test_on_another_machine_a_rehearsal_is_whole(sailed, monkeypatch):
    """Its scenario, mission, water and measured wind are packed, and are the same there."""
    monkeypatch.chdir(sailed)
    (sailed / "day.csv").write_text("t_s,wind_from_deg,wind_speed_ms\n0,10,5\n3600,40,6\n")
    made = prepared(
        Path("rocks.toml"),
        Path("packed"),
        wind=["day.csv"],
        wind_error=None,
        doubt=1.0,
        faults=False,
        depart=None,
        limit_s=60.0,
    )
    bundle = ScenarioBundle.of(made.source)
    assert sorted(Path(name).name for name, _ in bundle.packed) == [
        "day.csv",
        "rehearsal.toml",
        "rocks.toml",
        "rocks.wkt",
    ]
    job = Job(scenario=made.source, seed=3, case=RehearsalCase(doubts=made.doubts))
    assert key_of(replace(job, scenario=bundle.here()))["hash"] == key_of(job)["hash"]
    assert made.tells_the_hour


# A ring of land round the goal: there is water on both sides, and no way from one to the other.
RING = (
    "POLYGON ((-1.3115 50.8175, -1.3085 50.8175, -1.3085 50.8195, -1.3115 50.8195, -1.3115 50.8175), "
    "(-1.3108 50.8180, -1.3108 50.8191, -1.3092 50.8191, -1.3092 50.8180, -1.3108 50.8180))\n"
)


@pytest.mark.parametrize(
    ("old", "new", "words", "told_"),
    [
        ("[start]\nlat = 50.8170000\nlon = -1.3100000\nheading_deg = 60.0\n", "", (), "[start]: is missing"),
        ("rocks.wkt", "ring.wkt", (), "no way leads there in 5 m/s from 0°"),
        ("rocks.wkt", "reef.wkt", (), "reef.wkt"),
        ("", "", ("--wind", "gale"), "'gale' is not a wind"),
        ("", "", ("--wind-error", "5"), "is no error of a wind; write DEG,MPS"),
        ("", "", ("--depart", "2026-11-24T08:00"), "has no zone"),
        ("", "", ("--try", "jib=1"), "is not a change that is known"),
        ("", "", ("--dask", "tcp://127.0.0.1:1"), "no Dask scheduler answers"),
    ],
)
def test_what_cannot_be_rehearsed_is_said_at_once_in_one_line(tmp_path, monkeypatch, capsys, old, new, words, told_):
    monkeypatch.setattr("sitl.runner.executors.ANSWER_S", 0.5)
    shutil.copy(ROCKS.parent / "rocks.wkt", tmp_path)
    (tmp_path / "ring.wkt").write_text(RING)
    assert old in ROCKS.read_text()
    (tmp_path / "rocks.toml").write_text(ROCKS.read_text().replace(old, new) if old else ROCKS.read_text())
    code, out, err = run(tmp_path, monkeypatch, capsys, "--runs", "1", "--pairs", "0", *words)
    assert code in {1, 2}
    assert "arrives" not in out
    lines = [line for line in err.replace("\r", "\n").splitlines() if line and "compiling" not in line]
    assert len(lines) == 1
    assert told_ in lines[0]


def test_where_the_first_voyage_was_not_done_no_chances_are_told():
    outcome = RehearsalOutcome(known=estimates_of([None, {"seed": 1}]), ends="the time is over")
    sailed = CampaignResults(
        records=[{"seed": 1}],
        held=StoredResults(campaign="rehearsal", by=made_by()),
        lost=[],
        now=1,
        wall_s=47.0,
        cpu_s=5.3,
    )
    assert _words(outcome, sailed, is_told=False) == [
        "the time is over; 1 voyage in 47 s, 5.30 CPU s each",
        "no chances yet, for the first seed is not done: more --minutes, and the same command goes on",
    ]

"""Months of records: parts are closed and compressed, the budget holds, decisions are kept longest, all is read."""

import itertools
import os

import pytest

from companion.mavlink.tlog import read_tlog, stamp
from companion.telemetry.folder import read_decisions, read_rows
from companion.telemetry.folder.recorder import (
    DECISIONS,
    TLOG,
    TRACK,
    TRACK_COLUMNS,
    VOYAGE,
    Recorder,
    VoyageArchive,
    closed,
    is_from_the_start,
    parts,
)

DAY_S = 86_400
BUDGET = 5_000_000  # a thousandth of what a boat has, as are the records: 330 kB a day
FRAME = bytes.fromhex("fd0900000001bf00000000000000120800040330fa")  # a heartbeat; its checksum is of no matter


def row(t_s):
    return [float(t_s), *[None] * (len(TRACK_COLUMNS) - 1)]


def used(folder):
    return sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())


def write(recorder, t_s, noise):
    """What an hour leaves, a thousandth of it: mostly telemetry."""
    recorder.frame(stamp(int(1.7e15 + t_s * 1e6), FRAME) + noise(12_000))
    recorder.track(row(t_s))
    recorder.decision({"t_s": t_s, "kind": "test", "why": noise(240).hex()})


@pytest.mark.parametrize("restarts_every_days", [90, 7], ids=["one voyage", "a voyage a week"])
def test_in_ninety_days_the_budget_is_never_exceeded(tmp_path, restarts_every_days):
    archive = VoyageArchive(folder=tmp_path, budget_bytes=BUDGET)
    noise, worst = os.urandom, 0
    for voyage, day in enumerate(range(0, 90, restarts_every_days)):
        with Recorder(tmp_path / f"{voyage:02}", archive=archive, is_durable=False) as recorder:
            recorder.voyage({"mission": {"name": "long"}})
            end_day = min(90, day + restarts_every_days)
            for n, t_s in enumerate(range(day * DAY_S, end_day * DAY_S, 3600)):
                write(recorder, t_s, noise)
                recorder.tend({"t_s": float(t_s), "utc": ""})
                if n % 5 == 0:
                    worst = max(worst, used(tmp_path))
            assert recorder.dropped == 0
            assert not recorder.trouble
    assert BUDGET / 2 < worst <= BUDGET
    decisions = list(itertools.chain.from_iterable(read_decisions(f) for f in sorted(tmp_path.iterdir())))
    noted = [d["t_s"] for d in decisions if d["kind"] == "test"]
    assert noted == [float(t) for t in range(0, 90 * DAY_S, 3600)]  # every one of them
    assert any(d["kind"] == "dropped" and "telemetry" in str(d["voyages"]) for d in decisions)


def test_parts_are_read_as_one_record(tmp_path):
    folder = tmp_path / "voyage"  # the archive drops what else is in it, and above lie other tests' voyages
    with Recorder(folder, archive=VoyageArchive(folder=tmp_path, budget_bytes=320_000), is_durable=False) as recorder:
        recorder.voyage({})
        for t_s in range(400):
            recorder.frame(stamp(int(1.7e15 + t_s * 1e6), FRAME))
            recorder.track(row(t_s))
            recorder.decision({"t_s": t_s, "kind": "test", "text": "x" * 60})
            recorder.tend({"t_s": float(t_s), "utc": ""})
    assert all(p.suffix == ".gz" for name in (TLOG, TRACK, DECISIONS) for p in closed(folder / name))
    assert len(closed(folder / DECISIONS)) > 2
    assert [d["t_s"] for d in read_decisions(folder)] == list(range(400))
    assert [r["t_s"] for r in read_rows(folder / TRACK)] == [float(t) for t in range(400)]
    assert sum(len(read_tlog(part)) for part in parts(folder / TLOG)) == 400
    assert is_from_the_start(folder / TLOG)
    closed(folder / TLOG)[0].unlink()
    assert not is_from_the_start(folder / TLOG)


def test_a_quiet_voyage_closes_its_parts_once_a_day_and_a_restart_goes_on_numbering(tmp_path):
    for life in range(2):
        with Recorder(tmp_path, is_durable=False) as recorder:
            for t_s in range(0, 3 * DAY_S, 3600):
                recorder.decision({"t_s": life * 3 * DAY_S + t_s, "kind": "test"})
                recorder.tend({"t_s": float(t_s), "utc": ""})
    assert [p.name for p in closed(tmp_path / DECISIONS)] == [f"decisions-{n:06d}.jsonl.gz" for n in range(1, 5)]
    assert len(read_decisions(tmp_path)) == 2 * 72


def test_a_part_that_a_power_cut_left_uncompressed_is_compressed_later(tmp_path):
    (tmp_path / "decisions-000001.jsonl").write_bytes(b'{"t_s":1,"kind":"test"}\n{"t_s":2,"ki')
    with Recorder(tmp_path, is_durable=False) as recorder:
        recorder.tend({"t_s": 0.0, "utc": ""})
    assert [p.name for p in closed(tmp_path / DECISIONS)] == ["decisions-000001.jsonl.gz"]
    assert [d["t_s"] for d in read_decisions(tmp_path)] == [1]
    assert VOYAGE not in {p.name for p in tmp_path.iterdir()}

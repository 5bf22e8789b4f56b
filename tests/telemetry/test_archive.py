"""All voyages of a folder together: who gives way to the budget, and who never does."""

import os

import pytest

from companion.disk import FolderLock
from companion.telemetry.folder.recorder import DECISIONS, TLOG, TRACK, VOYAGE, Recorder, VoyageArchive, read_jsonl

STAMPS = {"t_s": 1.0, "utc": "then"}


@pytest.fixture
def voyages(tmp_path):
    """Five voyages of 1200 bytes, the oldest first."""
    folder = tmp_path / "voyages"
    for age in range(5):
        voyage = folder / f"v{age}"
        (voyage / "mission").mkdir(parents=True)
        for name, size in ((TLOG, 1000), (TRACK, 70), (DECISIONS, 100), (VOYAGE, 10), ("mission/mission.toml", 20)):
            (voyage / name).write_bytes(bytes(size))
        os.utime(voyage / DECISIONS, (1000.0 + age, 1000.0 + age))
    (folder / "a.state.json").write_text("{}")
    return folder


def names(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


def test_the_oldest_telemetry_goes_first_then_tracks_decisions_last(voyages):
    assert VoyageArchive(folder=voyages, budget_bytes=6000).tidy() == ()
    dropped = VoyageArchive(folder=voyages, budget_bytes=3500).tidy()
    assert [text.split(":")[0] for text in dropped] == ["v0", "v1", "v2"]
    assert {n for n in names(voyages) if n.endswith(TLOG)} == {f"v3/{TLOG}", f"v4/{TLOG}"}
    VoyageArchive(folder=voyages, budget_bytes=600).tidy()
    assert not any(n.endswith(TLOG) for n in names(voyages))
    assert f"v0/{TRACK}" not in names(voyages)
    assert {n for n in names(voyages) if n.endswith(DECISIONS)} == {f"v{k}/{DECISIONS}" for k in range(5)}
    VoyageArchive(folder=voyages, budget_bytes=250).tidy()
    assert names(voyages) == {f"v{k}/{name}" for k in (3, 4) for name in (DECISIONS, VOYAGE)} | {"a.state.json"}
    assert not (voyages / "v0").exists()


def test_what_is_recorded_now_and_what_is_not_ours_stays(voyages):
    (voyages / "v1/notes.txt").write_text("mine")
    (voyages / "photos").mkdir()
    (voyages / "photos" / TLOG).write_bytes(bytes(9000))  # no voyage: nothing was decided there
    outside = voyages.parent / "elsewhere"
    outside.mkdir()
    (outside / DECISIONS).write_bytes(bytes(9000))
    (voyages / "link").symlink_to(outside)
    lock = FolderLock(voyages / "v0")
    assert lock.take()
    VoyageArchive(folder=voyages, budget_bytes=0).tidy()
    lock.release()
    assert {n for n in names(voyages) if n.startswith("v0")} == {
        f"v0/{n}" for n in (TLOG, TRACK, DECISIONS, VOYAGE, "mission/mission.toml")
    }
    assert {n for n in names(voyages) if not n.startswith("v0")} == {"v1/notes.txt", f"photos/{TLOG}", "a.state.json"}
    assert (outside / DECISIONS).exists()


def test_for_a_disk_that_something_else_has_filled_only_telemetry_is_given(voyages):
    VoyageArchive(folder=voyages).make_room(10**9)
    assert not any(n.endswith(TLOG) for n in names(voyages))
    assert f"v0/{TRACK}" in names(voyages)


def test_a_voyage_keeps_the_budget_from_its_start_and_says_what_it_dropped(voyages):
    """Each restart made a folder with 3 GB of its own."""
    with Recorder(voyages / "now", archive=VoyageArchive(folder=voyages, budget_bytes=2600)) as recorder:
        assert VoyageArchive(folder=voyages).used_bytes() <= 2600 + 300  # its own header has come since
        recorder.decision({"kind": "start"})
        recorder.tend(STAMPS)
        for _ in range(200):
            recorder.frame(bytes(100))
            recorder.decision({"k": 1})
    assert recorder.dropped > 0  # one voyage alone does not take more than all may
    own = sum(p.stat().st_size for p in (voyages / "now").iterdir())
    assert own <= 2600 + 300
    told = next(r for r in read_jsonl(voyages / "now" / DECISIONS) if r["kind"] == "dropped")
    assert told["voyages"][0].startswith("v0: telemetry.tlog")

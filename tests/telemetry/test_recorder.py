"""The voyage folder: what is written survives a torn last line and a sick disk; whole files are whole or absent."""

import asyncio
import contextlib
import errno
import gzip
import json
import math
import os
import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from companion.app.options import in_thread
from companion.clock import run
from companion.disk import NEW, Disk, what_is_there
from companion.errors import InputError, JobError
from companion.guard import Auxiliary, Guard
from companion.mavlink.tlog import read_tlog
from companion.telemetry.folder import recorder as module
from companion.telemetry.folder.reading import read_rows, require_files
from companion.telemetry.folder.recorder import (
    DECISIONS,
    TLOG,
    TRACK_COLUMNS,
    Recorder,
    VoyageArchive,
    closed,
    jsonable,
    read_jsonl,
)


def test_records_survive_a_torn_last_line(tmp_path):
    with Recorder(tmp_path / "v") as recorder:
        for k in range(5):
            recorder.decision({"kind": "test", "k": k})
    path = tmp_path / "v" / DECISIONS
    path.write_bytes(path.read_bytes()[:-4])
    assert [r["k"] for r in read_jsonl(path)] == [0, 1, 2, 3]


def packed_and_damaged(data):
    """Yield a packed part that is damaged as a card does it: bytes of its middle, of its end, and cut off."""
    whole = gzip.compress(data, mtime=0)
    middle = len(whole) // 2
    yield whole[:middle] + b"\xff" * 40 + whole[middle + 40 :]
    yield whole[:-8] + b"\0" * 8
    yield whole[:middle]


def test_a_closed_part_that_is_damaged_is_one_line(tmp_path):
    """The library's own error came out of `companion report` and `replay`, as a traceback."""
    lines = b"".join(b'{"k":%d,"is":"%x"}\n' % (k, k**9) for k in range(900))
    (tmp_path / DECISIONS).write_bytes(b'{"k":9}\n')
    for data in packed_and_damaged(lines):
        part = tmp_path / "decisions-000001.jsonl.gz"
        part.write_bytes(data)
        with pytest.raises(InputError, match=re.escape(f"{part}: is damaged")):
            read_jsonl(tmp_path / DECISIONS)
        log = tmp_path / "telemetry-000001.tlog.gz"
        log.write_bytes(data)
        with pytest.raises(InputError, match=re.escape(f"{log}: cannot be read")):
            read_tlog(log)


def test_damage_in_the_middle_is_not_a_torn_line(tmp_path):
    path = tmp_path / DECISIONS
    path.write_bytes(b'{"k":1}\n{"k":\n{"k":3}\n')
    with pytest.raises(InputError, match="line 2"):
        read_jsonl(path)


def test_a_second_run_appends_and_has_one_header(tmp_path):
    for _ in range(2):
        with Recorder(tmp_path) as recorder:
            recorder.track(["1.0", *[None] * (len(TRACK_COLUMNS) - 1)])
    lines = (tmp_path / "track.csv").read_text().splitlines()
    assert lines[0].split(",") == list(TRACK_COLUMNS)
    assert len(lines) == 3
    assert all(line.count(",") == len(TRACK_COLUMNS) - 1 for line in lines)


@pytest.fixture
def small(tmp_path):
    """A real file system of 600 kB."""
    folder = tmp_path / "small"
    folder.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", folder], capture_output=True, check=False
    )
    if done.returncode != 0:
        pytest.skip(f"no file system can be mounted here: {done.stderr.decode().strip()}")
    yield folder
    subprocess.run(["umount", "-l", folder], check=True)


STAMPS = {"t_s": 99.0, "utc": "then"}


def row(t_s):
    return [repr(t_s), *[None] * (len(TRACK_COLUMNS) - 1)]


def test_a_real_full_disk_pauses_all_records_leaves_none_torn_and_takes_them_up_again(small):
    with Recorder(small / "v") as recorder:
        recorder.track(row(1.0))
        filler = small / "filler"
        with filler.open("wb") as file, contextlib.suppress(OSError):
            file.write(bytes(1 << 20))
        for k in range(300):
            recorder.decision({"k": k, "text": 100 * "x"})
        assert recorder.trouble == os.strerror(errno.ENOSPC)
        kept = [r["k"] for r in read_jsonl(small / "v" / DECISIONS)]
        assert kept == list(range(len(kept)))  # not one torn line among them
        assert 0 < recorder.dropped == 300 - len(kept)
        recorder.frame(b"12345678")  # none of them tells of what another lacks
        assert (small / "v" / TLOG).stat().st_size == 0
        recorder.tend(STAMPS)
        assert recorder.trouble
        filler.unlink()
        recorder.tend(STAMPS)
        assert recorder.trouble == ""
        recorder.decision({"k": "again"})
    *_, gap, last = read_jsonl(small / "v" / DECISIONS)
    assert gap == {**STAMPS, "kind": "gap", "since_s": 1.0, "dropped": 301 - len(kept), "why": gap["why"]}
    assert last == {"k": "again"}


def test_records_stop_before_the_disk_is_full_and_the_state_still_finds_room(small):
    with Recorder(small / "v") as recorder:
        room = Disk().room(small)
        assert 0 < room.reserve_bytes < 100_000
        (small / "filler").write_bytes(bytes(room.free_bytes - room.reserve_bytes + 5000))
        recorder.tend(STAMPS)
        assert "kept for the state" in recorder.trouble
        recorder.decision({"kind": "x"})
        assert read_jsonl(small / "v" / DECISIONS) == []
        Disk().replace(small / "state.json", 20_000 * b"x")
        recorder.summary({"arrived": True})  # the last chance: it may use the reserve
        assert (small / "v" / "summary.json").exists()


def test_a_failed_whole_file_leaves_the_old_one_and_no_rubbish(small):
    path = small / "state.json"
    Disk().replace(path, b"old")
    with pytest.raises(OSError, match="No space"):
        Disk().replace(path, bytes(1 << 20))
    assert path.read_bytes() == b"old"
    assert [p.name for p in small.iterdir()] == ["state.json"]


@pytest.mark.parametrize("knows_links", [True, False])
def test_of_several_files_all_are_replaced_or_none(tmp_path, monkeypatch, knows_links):
    """They were renamed one by one: one that could not be left those before it new, and the words said otherwise."""

    def refused(*_, **__):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    if not knows_links:
        monkeypatch.setattr(os, "link", refused)
    (tmp_path / "a").write_bytes(b"old")
    (tmp_path / "d").mkdir()
    with pytest.raises(IsADirectoryError) as error:
        Disk().replace_all({tmp_path / name: b"new" for name in ("a", "b", "d", "e")})
    assert error.value.filename == str(tmp_path / "d")
    assert what_is_there(error.value) == (
        "what was there is there" if knows_links else f"{tmp_path / 'a'} is new already"
    )
    assert (tmp_path / "a").read_bytes() == (b"old" if knows_links else b"new")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "d"]
    Disk().replace_all({tmp_path / name: b"new" for name in ("a", "b")})
    assert [(tmp_path / name).read_bytes() for name in ("a", "b")] == [b"new", b"new"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b", "d"]


@pytest.mark.parametrize("is_there", [True, False])
def test_what_lies_beside_a_file_is_no_way_to_another(tmp_path, is_there):
    """A link of the name under which the new file is written: what it led to was written over."""
    path, victim = tmp_path / "state.json", tmp_path / "another's"
    if is_there:
        victim.write_bytes(b"theirs")
        victim.chmod(0o666)
    (tmp_path / f"state.json{NEW}").symlink_to(victim)
    path.symlink_to(victim)
    Disk().replace(path, b"ours")
    assert (path.is_symlink(), path.read_bytes(), path.stat().st_mode & 0o777) == (False, b"ours", 0o644)
    assert (victim.read_bytes() if victim.exists() else b"theirs") == b"theirs"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["another's"] * is_there + ["state.json"]


def test_what_a_power_cut_left_half_written_is_in_nobodys_way(tmp_path):
    (tmp_path / f"state.json{NEW}").write_bytes(b"half")
    Disk().replace(tmp_path / "state.json", b"whole")
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("state.json", b"whole")]


def test_records_are_not_appended_through_a_link(tmp_path):
    (tmp_path / "log").symlink_to(tmp_path / "another's")
    with pytest.raises(OSError, match="symbolic links"):
        Disk().open_to_append(tmp_path / "log")
    assert not (tmp_path / "another's").exists()


def test_a_read_only_disk_is_no_end_and_what_is_written_once_comes_when_it_can(small):
    (small / "v").mkdir()
    subprocess.run(["mount", "-o", "remount,ro", small], check=True)
    with Recorder(small / "v") as recorder:
        assert recorder.trouble == os.strerror(errno.EROFS)
        recorder.voyage({"name": "n"})
        recorder.whole("mission/mission.toml", b"m")
        recorder.decision({"kind": "start"})
        recorder.summary({"arrived": False})
        recorder.tend(STAMPS)
        assert recorder.trouble == os.strerror(errno.EROFS)
        subprocess.run(["mount", "-o", "remount,rw", small], check=True)
        recorder.tend(STAMPS)
        assert recorder.trouble == ""
    assert (small / "v" / "mission" / "mission.toml").read_bytes() == b"m"
    assert (small / "v" / "voyage.toml").read_text() == 'name = "n"\n'
    assert [r["kind"] for r in read_jsonl(small / "v" / DECISIONS)] == ["gap"]


def test_the_kernel_says_full_in_the_middle_of_a_write():
    """/dev/full takes the opening and no byte."""
    fd = Disk().open_to_append(Path("/dev/full"))
    with pytest.raises(OSError, match="No space"):
        Disk().append(fd, b"x")
    os.close(fd)


class FillsUp(Disk):
    """A disk with room for four bytes more."""

    def write(self, fd, data):
        if len(data) <= 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(fd, data[:4])


def test_a_disk_that_fills_in_the_middle_of_a_record_leaves_none_of_it(tmp_path):
    path = tmp_path / "log"
    path.write_bytes(b"before\n")
    fd = Disk().open_to_append(path)
    with pytest.raises(OSError, match="No space"):
        FillsUp().append(fd, b"a record\n"[:8])
    os.close(fd)
    assert path.read_bytes() == b"before\n"


def test_two_companions_do_not_record_into_one_folder(tmp_path):
    with (
        Recorder(tmp_path / "v"),
        pytest.raises(JobError, match="another companion is recording"),
        Recorder(tmp_path / "v"),
    ):
        pass
    with Recorder(tmp_path / "v") as recorder:
        assert recorder.trouble == ""


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(JobError, match="cannot write the voyage"), Recorder(tmp_path / "file" / "v"):
        pass


def test_json_holds_no_nan():
    value = jsonable({"a": math.nan, "b": np.array([1.0, math.inf]), "c": (1, np.float64(2.5))})
    assert json.loads(json.dumps(value, allow_nan=False)) == {"a": None, "b": [1.0, None], "c": [1, 2.5]}


def test_files_are_bounded_over_restarts_and_what_is_left_out_is_counted(tmp_path, monkeypatch):
    monkeypatch.setitem(module.MAX_BYTES, DECISIONS, 100)
    monkeypatch.setitem(module.MAX_BYTES, TLOG, 20)
    dropped = 0
    for _ in range(3):
        with Recorder(tmp_path) as recorder:
            for k in range(10):
                recorder.decision({"k": k})
                recorder.frame(b"12345678")
            dropped += recorder.dropped
    assert (tmp_path / DECISIONS).stat().st_size <= 100
    assert (tmp_path / TLOG).stat().st_size == 16
    assert len(read_jsonl(tmp_path / DECISIONS)) + 2 + dropped == 60


def test_a_torn_line_is_cut_off_a_long_file(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "TAIL_BYTES", 64)
    path = tmp_path / DECISIONS
    whole = b"".join(b'{"k":%d}\n' % k for k in range(100))
    path.write_bytes(whole + b'{"k":1')
    with Recorder(tmp_path):
        pass
    assert path.read_bytes() == whole


class Slow(Disk):
    """A card on which what ``tend`` asks takes a while; ``is_full`` for what is appended meanwhile."""

    is_full = False

    def room(self, folder):
        time.sleep(0.2)
        return super().room(folder)

    def sync(self, fd):
        time.sleep(0.2)
        super().sync(fd)

    def write(self, fd, data):
        if self.is_full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(fd, data)


@pytest.mark.parametrize("is_taken_up", [False, True])
def test_the_thread_that_tends_the_records_does_not_outlive_the_voyage(tmp_path, is_taken_up):
    disk, found = Slow(), []

    async def voyage():
        with Recorder(tmp_path / "v", disk=disk) as recorder:

            def tend():
                recorder.tend(STAMPS)
                found.append(recorder.trouble)

            guard = Guard()
            disk.is_full = is_taken_up
            recorder.decision({"k": 1})
            disk.is_full = False
            guard.keep(Auxiliary.RECORDS, lambda: in_thread(tend))
            await asyncio.sleep(0.05)
            await guard.end()
            assert found == [""], "the records are whole, or taken up again, before they are closed"
            recorder.summary({"arrived": True})

    run(voyage())
    with Recorder(tmp_path / "v") as recorder:  # the folder is free again
        assert recorder.trouble == ""


def test_a_whole_file_that_is_wanted_anew_while_it_is_written_is_written_anew(tmp_path):
    class Later(Disk):
        is_full = is_asked = False

        def replace(self, path, data, **how):
            if self.is_full:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            super().replace(path, data, **how)
            if self.is_asked:  # by the voyage's own loop, while the thread takes the records up
                self.is_asked = False
                recorder.whole("f", b"new")

    disk = Later()
    with Recorder(tmp_path / "v", disk=disk) as recorder:
        disk.is_full = True
        recorder.whole("f", b"old")
        disk.is_full, disk.is_asked = False, True
        recorder.tend(STAMPS)
    assert (tmp_path / "v" / "f").read_bytes() == b"new"


def test_what_is_written_while_a_part_is_closed_is_not_counted_to_the_next(tmp_path):
    class Meanwhile(Disk):
        is_tended = False

        def append(self, fd, data):
            super().append(fd, data)
            if self.is_tended:
                self.is_tended = False
                recorder.tend(STAMPS)  # in the thread, before the loop goes on

    disk, archive = Meanwhile(), VoyageArchive(folder=tmp_path, budget_bytes=6400)
    with Recorder(tmp_path / "v", disk=disk, archive=archive) as recorder:
        recorder.frame(bytes(100))
        disk.is_tended = True
        recorder.frame(bytes(100))
        assert [p.name for p in closed(tmp_path / "v" / TLOG)] == ["telemetry-000001.tlog"]
        recorder.tend(STAMPS)
        assert len(closed(tmp_path / "v" / TLOG)) == 1, "an empty file is no part"


def test_a_row_of_too_few_columns_says_how_many(tmp_path):
    """It said what zip() says."""
    path = tmp_path / "track.csv"
    path.write_text(",".join(TRACK_COLUMNS) + "\n1.0,2.0\n")
    with pytest.raises(InputError, match=f"line 2: .*2 columns in place of {len(TRACK_COLUMNS)}"):
        read_rows(path)


def test_a_folder_in_place_of_a_file_is_said(tmp_path):
    (tmp_path / "track.csv").mkdir()
    with pytest.raises(InputError, match=r"track\.csv: is a folder and no file"):
        require_files(tmp_path, "track.csv")

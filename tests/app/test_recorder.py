"""The voyage folder: what is written survives a torn last line; whole files are whole or absent."""

import json
import math

import numpy as np
import pytest

from companion.errors import JobError
from companion.telemetry import recorder as module
from companion.telemetry.recorder import (
    DECISIONS,
    TLOG,
    TRACK_COLUMNS,
    Recorder,
    jsonable,
    read_jsonl,
    write_atomically,
)


def test_records_survive_a_torn_last_line(tmp_path):
    with Recorder(tmp_path / "v") as recorder:
        for k in range(5):
            recorder.decision({"kind": "test", "k": k})
    path = tmp_path / "v" / DECISIONS
    path.write_bytes(path.read_bytes()[:-4])
    assert [r["k"] for r in read_jsonl(path)] == [0, 1, 2, 3]


def test_damage_in_the_middle_is_not_a_torn_line(tmp_path):
    path = tmp_path / DECISIONS
    path.write_bytes(b'{"k":1}\n{"k":\n{"k":3}\n')
    with pytest.raises(JobError, match="line 2"):
        read_jsonl(path)


def test_a_second_run_appends_and_has_one_header(tmp_path):
    for _ in range(2):
        with Recorder(tmp_path) as recorder:
            recorder.track(["1.0", *[None] * (len(TRACK_COLUMNS) - 1)])
    lines = (tmp_path / "track.csv").read_text().splitlines()
    assert lines[0].split(",") == list(TRACK_COLUMNS)
    assert len(lines) == 3
    assert all(line.count(",") == len(TRACK_COLUMNS) - 1 for line in lines)


def test_a_failed_whole_file_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "state.json"
    write_atomically(path, b"old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_atomically(path, b"new and longer")
    assert path.read_bytes() == b"old"


def test_a_full_disk_drops_records_and_counts_them(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with Recorder(tmp_path) as recorder:
        monkeypatch.setattr(module.os, "write", full)
        recorder.decision({"kind": "x"})
        recorder.frame(b"12345678")
        assert recorder.dropped == 2


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

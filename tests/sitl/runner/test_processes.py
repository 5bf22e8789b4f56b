"""Processes of this machine: one that dies takes nothing with it, and a job that raises no other."""

import json
from pathlib import Path

import pytest

from companion.errors import InputError
from sitl.runner import WorkerDiedError, settled
from tests.sitl.runner.jobs import Attempt, Job, attempts, jobs_in, leaving, raising, work


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "attempts").mkdir()
    return tmp_path / "attempts"


def test_a_process_that_is_killed_loses_no_job_and_only_a_deadly_job_is_lost(folder):
    deadly = {2: "once", 5: "always"}
    jobs = [Job(seed=n, case=Attempt(folder=folder, deadly=deadly.get(n, ""))) for n in range(8)]
    found = dict(settled(work, jobs, 2))
    lost = found.pop(5)
    assert isinstance(lost, WorkerDiedError)
    assert {n: result["seed"] for n, result in found.items()} == {n: n for n in range(8) if n != 5}
    assert attempts(folder)[5] >= 2
    assert max(attempts(folder).values()) <= 3


def test_alone_and_beside_others_a_seed_gives_the_same(folder):
    jobs = jobs_in(folder, range(4))
    alone, beside = dict(settled(work, jobs, 1)), dict(settled(work, jobs, 2))
    assert json.dumps(alone, sort_keys=True) == json.dumps(beside, sort_keys=True)


def test_what_a_job_raises_is_its_own(folder):
    jobs = jobs_in(folder, range(4))
    found = dict(settled(raising, jobs, 1))
    assert [n for n, result in found.items() if isinstance(result, ZeroDivisionError)] == [1, 3]
    assert "of seed 1" in str(found[1])


def test_who_has_seen_enough_ends_it_and_nothing_is_left(folder):
    found = settled(leaving, jobs_in(folder, range(9)), 2)
    left = Path(next(found)[1]["left"])
    assert left.is_dir()
    found.close()
    assert not left.exists()
    assert not left.parent.exists()


def misread(source):
    raise InputError(source, "line 3", "is no wind", "write SPEED@FROM")


def test_a_bad_file_is_told_from_another_process_as_from_here():
    told = dict(settled(misread, ["wind.csv", "wind.csv"], 2))[0]
    assert isinstance(told, InputError)
    assert str(told) == "wind.csv: line 3: is no wind; write SPEED@FROM"

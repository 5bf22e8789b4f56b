"""A scenario that goes to another machine: with every file that it names, found there, its content in its hash."""

import shutil
from pathlib import Path

import pytest

from companion.errors import InputError, JobError
from sitl.runner import Job, ScenarioBundle, file_hash
from sitl.runner.job import Task, perform
from tests.sitl.runner.conftest import ROCKS


def test_what_comes_with_the_program_is_only_named():
    packed = ScenarioBundle.of(ROCKS)
    assert (packed.main, packed.packed) == ("faults/rocks.toml", ())
    assert packed.here().samefile(ROCKS)
    other = ScenarioBundle(main=packed.main, hash="of another version")
    with pytest.raises(JobError, match=r"has another faults/rocks.toml; install the same version"):
        other.here()


def test_what_a_user_made_is_packed_whole(own):
    packed, digest = ScenarioBundle.of(own), file_hash(own)
    names = {path.relative_to(own.parent).as_posix() for path in own.parent.rglob("*") if path.is_file()}
    assert {name for name, _ in packed.packed} == names
    assert len(names) > 2
    shutil.rmtree(own.parent)
    done = perform(Task(work=where, job=Job(scenario=own, seed=3, case=None), bundle=packed))
    assert done.result["scenario"] != str(own)
    assert done.result["hash"] == digest


def test_the_hash_is_of_the_content_and_of_every_file(own, tmp_path):
    first = file_hash(own)
    shutil.copytree(own.parent, tmp_path / "moved")
    assert file_hash(tmp_path / "moved" / "mine.toml") == first
    for number, path in enumerate(sorted(p for p in own.parent.rglob("*") if p.is_file())):
        changed = tmp_path / f"changed-{number}"
        shutil.copytree(own.parent, changed)
        file = changed / path.relative_to(own.parent)
        file.write_bytes(file.read_bytes() + b"\n")
        assert file_hash(changed / "mine.toml") != first


def test_a_name_is_another_file_in_another_folder(own, tmp_path, monkeypatch):
    hashes = []
    for folder in ("a", "b"):
        shutil.copytree(own.parent, tmp_path / folder)
        file = tmp_path / folder / "mine.toml"
        file.write_text(f"{file.read_text()}# {folder}\n")
        monkeypatch.chdir(tmp_path / folder)
        hashes.append(file_hash(Path("mine.toml")))
    assert hashes[0] != hashes[1]


def test_a_file_that_only_this_machine_finds_is_told(own):
    own.write_text(own.read_text().replace("missions/mine.toml", str(own.parent / "missions" / "mine.toml")))
    with pytest.raises(InputError, match="names a file that another machine will not find; name files relative"):
        ScenarioBundle.of(own)


def where(job):
    return {"scenario": str(job.scenario), "hash": file_hash(job.scenario)}


def test_a_job_that_is_done_here_is_of_the_file_as_it_lies():
    assert perform(Task(work=where, job=Job(scenario=ROCKS, seed=3, case=None))).result["scenario"] == str(ROCKS)

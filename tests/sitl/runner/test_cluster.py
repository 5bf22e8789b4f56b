"""A real Dask scheduler and workers as processes: killed, gone and back, of another version, not there."""

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from companion.errors import JobError
from lab.campaigns.campaign import campaign
from sitl import cli
from sitl.options import CampaignOptions
from sitl.runner import Job, experiment, read_results
from sitl.runner.executors import settled_on
from tests.sitl.runner.jobs import Attempt, attempts, jobs_in, quick, work

ROOT = Path(__file__).parents[3]
JOBS = 40
WORKERS = 3


class Cluster:
    """A scheduler on one port, and its workers, as a crew starts them."""

    def __init__(self, folder, port):
        self.folder, self.port, self.address = folder, port, f"tcp://127.0.0.1:{port}"
        self.scheduler, self.workers = None, []

    def begin(self):
        self.scheduler = self.process("dask_scheduler", "--host", "127.0.0.1", "--port", self.port, "--no-show")
        self.workers = [self.worker() for _ in range(WORKERS)]

    def worker(self, *words, root=ROOT):
        return self.process("dask_worker", self.address, "--nthreads", "1", "--no-nanny", *words, root=root)

    def process(self, program, *words, root=ROOT):
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{program}", "--no-dashboard", *map(str, words)],
            cwd=root,
            env={**os.environ, "PYTHONPATH": str(root), "DASK_TEMPORARY_DIRECTORY": str(self.folder)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def kill(self):
        for process in (self.scheduler, *self.workers):
            with contextlib.suppress(OSError):
                process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    found = Cluster(tmp_path_factory.mktemp("dask"), port)
    found.begin()
    yield found
    found.kill()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "attempts").mkdir()
    return tmp_path / "attempts"


def patiently(check, timeout_s=60.0):
    until_s = time.monotonic() + timeout_s
    while not check():
        assert time.monotonic() < until_s
        time.sleep(0.05)


def test_a_killed_worker_and_a_scheduler_that_is_started_again_lose_nothing(cluster, folder, tmp_path, capsys):
    """One job kills its worker, and in the middle of the run the whole cluster is killed and begun anew."""
    jobs = [Job(seed=n, case=Attempt(folder=folder, work_s=0.02, deadly="once" if n == 4 else "")) for n in range(JOBS)]
    seen, done = [], {}

    def on_record(record):
        seen.append(record["seed"])
        is_one_killed = sum(process.poll() == -signal.SIGKILL for process in cluster.workers) == 1
        if not done and len(seen) >= JOBS // 2 and is_one_killed:  # on a busy machine its job may come later
            done.update({seed: count for seed, count in attempts(folder).items() if seed in seen})
            cluster.kill()
            cluster.begin()

    out = tmp_path / "far.jsonl"
    far = quick(jobs, line=on_record).results(CampaignOptions(dask=cluster.address, out=out))
    assert done
    assert sorted(seen) == list(range(JOBS))
    assert (far.now, far.lost) == (JOBS, [])
    said = capsys.readouterr().err
    assert "the scheduler went; it is waited for" in said
    here = tmp_path / "here.jsonl"
    quick(jobs_in(folder, range(JOBS))).results(CampaignOptions(workers=1, out=here))
    assert out.read_bytes() == here.read_bytes()
    before = [json.loads(line)["key"]["seed"] for line in (tmp_path / "far.facts.jsonl").read_text().splitlines()]
    assert before == seen
    assert all(attempts(folder)[seed] == count + 1 for seed, count in done.items())  # the one more is here's


def test_a_voyage_on_the_cluster_is_the_same_to_the_last_byte(cluster, own, tmp_path, monkeypatch):
    """A user's own scenario: the workers have none of its files."""
    monkeypatch.chdir(tmp_path)  # the folder of a voyage that failed is left here
    for name, address in (("far", cluster.address), ("here", None)):
        sailed = campaign([own], runs=1, first_seed=3).results(
            CampaignOptions(workers=1, dask=address, out=tmp_path / f"{name}.jsonl")
        )
        assert sailed.lost == []
    assert (tmp_path / "far.jsonl").read_bytes() == (tmp_path / "here.jsonl").read_bytes()
    assert "arrived" in (tmp_path / "far.jsonl").read_text()
    facts = [json.loads((tmp_path / f"{name}.facts.jsonl").read_text()) for name in ("far", "here")]
    assert facts[0]["pid"] != facts[1]["pid"] == os.getpid()


def test_a_program_of_another_version_is_said_at_once(cluster, folder, tmp_path):
    other = tmp_path / "other"
    for name in ("companion", "sitl", "missions"):
        shutil.copytree(ROOT / name, other / name, ignore=shutil.ignore_patterns("__pycache__", "*.nb*"))
    shutil.copytree(ROOT / "tests" / "sitl" / "runner", other / "tests" / "sitl" / "runner")
    with (other / "companion" / "words.py").open("a") as file:
        file.write("# of next year\n")
    stranger = cluster.worker("--name", "stranger", root=other)
    try:

        def run():
            list(settled_on(cluster.address, work, dict(enumerate(jobs_in(folder, [0]))), None, say=lambda _: None))

        def is_told():
            try:
                run()
            except JobError as error:
                told.append(str(error))
            return told

        told = []
        patiently(is_told)
        assert told[0].startswith(f"{cluster.address}: tcp://127.0.0.1:")
        assert "runs another version (its source is " in told[0]
        assert told[0].endswith("); install the same there")
        assert "\n" not in told[0]
    finally:
        stranger.kill()
        stranger.wait()


def test_a_worker_that_comes_later_is_asked_too(cluster, folder, monkeypatch):
    """By the task itself, which carries what it was made by."""
    real = experiment.made_by()
    other = type(real).from_dict({**real.to_dict(), "source": "of tomorrow"})
    monkeypatch.setattr(experiment, "made_by", lambda: other)
    with pytest.raises(JobError, match=r"a worker on .* runs another version \(its source is .* there and of tomorrow"):
        quick(jobs_in(folder, [0])).results(CampaignOptions(dask=cluster.address))
    assert attempts(folder) == {}


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("tcp://127.0.0.1:1", "tcp://127.0.0.1:1: no Dask scheduler answers ("),
        ("scheduler.json", "scheduler.json: no Dask scheduler answers ("),
        ("nonsense://x:1", "nonsense://x:1: no Dask scheduler answers ("),
    ],
)
def test_a_cluster_that_is_not_there_is_one_line(tmp_path, monkeypatch, capsys, address, told):
    monkeypatch.setattr("sitl.runner.executors.ANSWER_S", 0.3)
    monkeypatch.chdir(tmp_path)
    words = ["faults", "--runs", "1", "--dask", address, "--out", str(tmp_path / "r.jsonl")]
    assert cli.main(words) == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith(f"sitl faults: {told}")
    assert read_results(tmp_path / "r.jsonl").results == {}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--array", "4/3", "--out", "r.jsonl"], "'4/3' is no part; write I/N with I from 1 to N, as 3/100"),
        (["--array", "1/3"], "says a part, and nothing says where to keep it; add --out FILE.jsonl"),
        (["--out", "r.json"], "r.json: results are lines of JSON; end the name in .jsonl"),
        (["--dask", " "], "an empty address; write tcp://HOST:8786, or local"),
    ],
)
def test_means_that_cannot_be_are_one_line(capsys, words, told):
    assert cli.main(["faults", *words]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert err.count("\n") == 1

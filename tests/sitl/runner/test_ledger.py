"""Results stay: appended as they come, read again wherever a run was broken off, never mixed or torn."""

import asyncio
import json
import multiprocessing
import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

from companion.clock import run_virtual
from companion.disk import Disk
from companion.errors import InputError, JobError
from sitl.options import CampaignOptions
from sitl.runner import ResultStore, made_by, read_results, result_store
from sitl.runner.experiment import ends_when_told
from tests.sitl.runner.jobs import attempts, jobs_in, quick, raising, work


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "attempts").mkdir()
    return tmp_path / "attempts"


def sailed(folder, out, seeds=range(6), do=work, **means):
    return quick(jobs_in(folder, seeds), do).results(CampaignOptions(workers=1, out=out, **means))


@pytest.mark.parametrize("cut", [1, 40, 200])
def test_a_run_goes_on_where_a_power_cut_left_it(tmp_path, folder, cut):
    out = tmp_path / "r.jsonl"
    sailed(folder, out)
    whole = out.read_bytes()
    out.write_bytes(whole[:-cut])
    again = sailed(folder, out)
    assert out.read_bytes() == whole
    assert again.now == len([n for n in attempts(folder).values() if n == 2]) == (2 if cut == 200 else 1)
    assert [r["seed"] for r in again.records] == list(range(6))


def test_even_a_head_that_was_cut_short_is_no_end(tmp_path, folder):
    out = tmp_path / "r.jsonl"
    sailed(folder, out)
    whole = out.read_bytes()
    out.write_bytes(whole[:9])
    sailed(folder, out)
    assert out.read_bytes() == whole


def test_the_file_is_the_same_in_whichever_order_and_parts_it_was_made(tmp_path, folder):
    at_once, bit_by_bit = tmp_path / "a.jsonl", tmp_path / "b.jsonl"
    sailed(folder, at_once, range(12))
    for seeds in ([11, 3], [2, 10, 0], range(12)):
        sailed(folder, bit_by_bit, seeds)
    assert at_once.read_bytes() == bit_by_bit.read_bytes()
    text = at_once.read_text()
    assert not {"wall", "host", "pid", "cpu"} & set(text.replace('"', " ").replace("_", " ").split())
    facts = [json.loads(line) for line in (tmp_path / "a.facts.jsonl").read_text().splitlines()]
    assert {fact["key"]["seed"] for fact in facts} == set(range(12))
    assert all(fact["pid"] == os.getpid() and fact["wall_s"] >= 0.0 for fact in facts)


def test_parts_of_an_array_are_all_of_it_and_none_twice(tmp_path, folder):
    out = tmp_path / "r.jsonl"
    for number in (1, 2, 3):
        sailed(folder, out, range(7), array=(number, 3))
    assert attempts(folder) == dict.fromkeys(range(7), 1)
    assert sorted(p.name for p in tmp_path.glob("r.*-of-3.jsonl")) == [f"r.{n}-of-3.jsonl" for n in (1, 2, 3)]
    assert not out.exists()


def test_a_run_ends_when_enough_is_known_and_goes_on_when_more_is_wanted(tmp_path, folder, capsys):
    out, seen = tmp_path / "r.jsonl", []

    def until(count):
        def watch(there):
            seen.append(sum(result is not None for result in there))
            return f"{seen[-1]} known", seen[-1] >= count

        return watch

    for count in (2, 2, 5):
        found = quick(jobs_in(folder, range(6))).results(CampaignOptions(workers=1, out=out), watch=until(count))
        assert [r["seed"] for r in found.records] == list(range(count))
    assert seen == [0, 1, 2, 2, 2, 3, 4, 5]
    assert (found.now, attempts(folder)) == (3, dict.fromkeys(range(5), 1))
    assert "2 sailed, 4 at most to come; 2 known" in capsys.readouterr().err


@pytest.mark.parametrize("workers", [1, 2])
def test_sigterm_ends_it_as_ctrl_c_does_and_leaves_nobody(tmp_path, folder, workers):
    out, before = tmp_path / "r.jsonl", signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        quick(jobs_in(folder, range(6)), line=lambda _: os.kill(os.getpid(), signal.SIGTERM)).results(
            CampaignOptions(workers=workers, out=out)
        )
    assert signal.getsignal(signal.SIGTERM) is before
    assert not multiprocessing.active_children()
    assert len(read_results(out).results) == 1
    assert len(sailed(folder, out).records) == 6


def test_a_job_that_raises_is_told_and_tried_again(tmp_path, folder, capsys):
    out = tmp_path / "r.jsonl"
    first = sailed(folder, out, do=raising)
    assert [r["seed"] for r in first.records] == [0, 2, 4]
    assert first.exit_code(is_good=True) == 1
    said = capsys.readouterr().out
    assert 'LOST {"scenario":"quick","seed":1}: ZeroDivisionError: of seed 1\n' in said
    assert "3 jobs without a result: the same command tries them again\n" in said
    second = sailed(folder, out)
    assert (second.now, len(second.records), second.exit_code(is_good=True)) == (3, 6, 0)


def test_results_of_another_program_or_campaign_are_not_mixed(tmp_path, folder):
    out = tmp_path / "r.jsonl"
    with ResultStore(out, "faults"):
        pass
    with pytest.raises(InputError, match="holds results of sitl faults; name another file"):
        sailed(folder, out)
    head = {"results": 1, "campaign": "quick", "made_by": replace(made_by(), source="0" * 16).to_dict()}
    out.write_text(json.dumps(head) + "\n")
    with pytest.raises(InputError, match=r"its source is 0000000000000000 there and .* here.*name another file"):
        sailed(folder, out)
    out.write_text("seed,time\n1,2\n")
    with pytest.raises(InputError, match="line 1: is no line of a file of results"):
        sailed(folder, out)
    assert out.read_text() == "seed,time\n1,2\n"
    out.write_text("my notes")
    with pytest.raises(InputError, match="line 1: is no line of a file of results"):
        sailed(folder, out)
    assert out.read_text() == "my notes"


def test_another_commit_of_the_same_source_is_the_same_program(tmp_path, folder):
    out = tmp_path / "r.jsonl"
    head = {"results": 1, "campaign": "quick", "made_by": replace(made_by(), commit="f" * 12).to_dict()}
    out.write_text(json.dumps(head) + "\n")
    assert sailed(folder, out).now == 6


def test_two_runs_do_not_write_one_file(tmp_path, folder):
    out = tmp_path / "r.jsonl"
    with ResultStore(out, "quick"), pytest.raises(JobError, match="another run writes it"):
        sailed(folder, out)
    assert sailed(folder, out).now == 6


FULL = """
import resource, sys
from pathlib import Path
from tests.sitl.runner.test_ledger import sailed
resource.setrlimit(resource.RLIMIT_FSIZE, (1200, resource.RLIM_INFINITY))
sailed(Path(sys.argv[1]), Path(sys.argv[2]), range(40))
"""


def test_a_full_disk_is_said_and_what_was_done_is_kept(tmp_path, folder):
    """The limit of a file's size stands in for the end of the disk: the same write fails in the same way."""
    out = tmp_path / "r.jsonl"
    done = subprocess.run(
        [sys.executable, "-c", FULL, folder, out],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: signal.signal(signal.SIGXFSZ, signal.SIG_IGN),
    )
    held = read_results(out).results
    assert 3 < len(held) < 40
    assert done.stderr.splitlines()[-1].endswith(
        f"r.jsonl: File too large; it holds {len(held)} results: make room, and the same command goes on"
    )
    assert sailed(folder, out, range(40)).now == 40 - len(held)
    assert sum(n == 2 for n in attempts(folder).values()) == 1  # the one whose result found no room


def test_no_voyage_is_sailed_on_a_full_disk(tmp_path, folder, monkeypatch):
    """What would be sailed would say more of the disk than of the boat."""

    class Full(Disk):
        def room(self, path):
            return replace(super().room(path), free_bytes=0)

    monkeypatch.setattr("sitl.runner.job.Disk", Full)
    with pytest.raises(JobError, match="0 MB are left, too few for a voyage; make room"):
        sailed(folder, tmp_path / "r.jsonl")
    assert attempts(folder) == {}


def test_keys_are_in_the_order_of_numbers():
    assert sorted(['{"seed":10}', '{"seed":9}', '{"seed":null}'], key=result_store._order) == [
        '{"seed":null}',
        '{"seed":9}',
        '{"seed":10}',
    ]


@pytest.fixture(params=[signal.default_int_handler, signal.SIG_IGN], ids=["in front", "in the background"])
def ctrl_c(request):
    """What a shell lets Ctrl-C do: nothing, to what it runs in the background."""
    before = signal.signal(signal.SIGINT, request.param)
    yield request.param
    signal.signal(signal.SIGINT, before)


def test_a_voyage_is_ended_between_its_steps_when_the_campaign_is_told(ctrl_c):
    """SIGTERM raised in the middle of a voyage's step: 150 lines of tracebacks, and once it went on for ever."""
    steps = []

    async def voyage():
        os.kill(os.getpid(), signal.SIGTERM)
        steps.append("whole")
        try:
            await asyncio.sleep(1000.0)
        finally:
            steps.append("ended")

    with pytest.raises(KeyboardInterrupt), ends_when_told():
        run_virtual(voyage())
    assert steps == ["whole", "ended"]
    assert signal.getsignal(signal.SIGINT) is ctrl_c

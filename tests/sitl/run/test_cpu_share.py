"""A slow computer: what is put under a share of a core gets no more than that, its children too."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from bench import shares
from bench.shares import plans_of
from sitl.run.live import CpuShare, cpu_share, family_of, run_live
from sitl.scenario import load_scenario

# A child of a child that turns for a second, and says which part of a core it had.
BUSY = """
import subprocess, sys
code = "import time; b, c = time.monotonic(), time.process_time()\\nwhile time.monotonic() < b + 1.0: pass\\n" \
    "print((time.process_time() - c) / (time.monotonic() - b))"
subprocess.run([sys.executable, "-c", code])
"""


async def part_of_a_core(share: CpuShare | None) -> float:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", BUSY, stdout=asyncio.subprocess.PIPE, preexec_fn=None if share is None else share.enter
    )
    hold = None if share is None else asyncio.create_task(share.hold(process.pid))
    told, _ = await process.communicate()
    if hold is not None:
        await hold
    return float(told)


@pytest.mark.parametrize("by_quota", [True, False])
def test_a_child_of_a_child_gets_no_more_than_the_share(by_quota):
    async def sail():
        async with cpu_share(0.2) as share:
            if by_quota and share.cgroup is None:
                pytest.skip("no control group may be made here")
            bounded = share if by_quota else replace(share, cgroup=None)
            assert ("quota" in bounded.means) == by_quota
            return await part_of_a_core(bounded)

    assert asyncio.run(sail()) < 0.4


@pytest.fixture
def crowded():
    """Keep one core, which this process is kept on, busy with four others."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)})
    hogs = [subprocess.Popen([sys.executable, "-c", "while True: pass"], start_new_session=True) for _ in range(4)]
    yield
    os.sched_setaffinity(0, allowed)
    for hog in hogs:
        hog.kill()
        hog.wait()


def test_what_is_under_a_share_and_the_boat_beside_it_go_before_other_load(crowded):
    """A voyage on a tenth of a core beside seven others was one on a hundredth, and the table said a tenth."""

    async def sail():
        async with cpu_share(0.4) as share:
            if share.cgroup is None:
                pytest.skip("no control group may be made here")
            return await part_of_a_core(share), await part_of_a_core(None)

    companion, boat = asyncio.run(sail())
    assert companion > 0.3  # a fifth of the core without
    assert boat > 0.6


def test_control_groups_are_taken_away_again_and_this_process_is_where_it_was():
    before = Path("/proc/self/cgroup").read_text(encoding="utf-8")

    async def make():
        async with cpu_share(0.5) as share:
            assert share.cgroup is None or Path("/proc/self/cgroup").read_text(encoding="utf-8") != before
            return share.cgroup

    folder = asyncio.run(make())
    assert folder is None or not list(folder.parent.glob(f"sitl-*-{os.getpid()}"))
    assert Path("/proc/self/cgroup").read_text(encoding="utf-8") == before


def test_the_family_of_a_process_are_those_that_live():
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        assert process.pid in family_of(os.getpid())
        process.kill()
    assert family_of(process.pid) == []


def test_with_a_tenth_of_a_core_she_arrives_clean(tmp_path):
    """Three times as fast as time, with three tenths. How fast she is is not asked: what else this machine does is."""
    path = Path("sitl/scenarios/walls-ends.toml")
    verdict = run_live(load_scenario(path), path, 0, tmp_path, autopilot="embedded", program=None, speedup=3.0, cpu=0.3)
    assert verdict.figures["arrived"]
    assert verdict.figures["contacts"] == 0
    assert verdict.figures["min_clearance_m"] >= 6.0  # the floor of its margin
    assert plans_of(tmp_path / "decisions.jsonl").first_s is not None


def voyage(share, seed, time_s, **more):
    return {
        "water": "pond",
        "share": share,
        "seed": seed,
        "passed": True,
        "arrived": True,
        "time_s": time_s,
        "kills": 0,
        "min_clearance_m": 5.0 + seed,
        "took_s": [1.0, 2.0, 4.0 / share],
        "budgets_s": [2.0, 1.0],
        "first_s": 1.5,
        **more,
    }


def test_times_are_held_against_the_full_cores_of_the_same_seed():
    """The mean of all voyages at each share was another's: a seed that did not arrive made a computer seem faster."""
    records = [
        voyage(1.0, 0, 100.0),
        voyage(1.0, 1, 300.0),
        voyage(0.25, 0, 110.0),
        {"water": "pond", "share": 0.25, "seed": 1, "passed": False, "arrived": False, "kills": 3, "checks": []},
    ]
    row = shares.figures("pond", 0.25, records)
    assert (row["voyages"], row["arrived"], row["kills"]) == (2, 1, 3)
    assert row["of_full"] == pytest.approx(1.1)
    assert (row["median_s"], row["late_s"], row["worst_s"]) == (2.0, 16.0, 16.0)
    assert (row["first_s"], row["budget_s"], row["clearance_m"]) == (1.5, 1.0, 5.0)
    assert shares.as_cells(row) == [
        "pond",
        "0.25",
        "2",
        "1",
        "110",
        "+10.0 %",
        "5.0",
        "3",
        "2.0 / 16.0 / 16.0",
        "1.5",
        "1.00",
        "3",
    ]
    assert shares.figures("pond", 0.05, records) == {}


def test_a_voyage_without_a_verdict_is_told_and_fails_the_run(tmp_path, monkeypatch, capsys):
    """It exits with 1; what there is already is not sailed again."""
    sailed = []

    def sail(job):
        sailed.append(job.case.share)
        return {
            "water": "pond",
            "share": job.case.share,
            "seed": job.seed,
            "passed": False,
            "arrived": False,
            "kills": 0,
            "checks": [{"name": "no room", "passed": False}],
        }

    monkeypatch.setattr(shares, "sail", sail)
    monkeypatch.setattr(shares, "compile_ahead", lambda: None)
    words = ["pond", "--shares", "0.25", "0.1", "--out", str(tmp_path / "s.jsonl")]
    assert shares.main(words) == 1
    assert "FAILED pond at 0.1, seed 0: no room" in capsys.readouterr().out
    assert shares.main([*words, "--shares", "0.25", "0.05"]) == 1
    assert sailed == [0.25, 0.1, 0.05]

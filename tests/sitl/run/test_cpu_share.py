"""A slow computer: what is put under a share of a core gets no more than that, its children too."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

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


async def part_of_a_core(share: CpuShare) -> float:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", BUSY, stdout=asyncio.subprocess.PIPE, preexec_fn=share.enter)
    hold = asyncio.create_task(share.hold(process.pid))
    told, _ = await process.communicate()
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


def test_a_control_group_is_taken_away_again():
    async def make():
        async with cpu_share(0.5) as share:
            assert share.cgroup is None or share.cgroup.is_dir()
        return share.cgroup

    folder = asyncio.run(make())
    assert folder is None or not folder.exists()


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
    assert verdict.figures["min_clearance_m"] >= 6.0   # the floor of its margin
    assert plans_of(tmp_path / "decisions.jsonl").first_s is not None

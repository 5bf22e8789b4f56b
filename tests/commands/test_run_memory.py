"""What ``companion run`` and its planner take of a small computer's memory, together, and what they load."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from companion.kernels.build import is_ready, prepare
from companion.telemetry.folder.recorder import read_jsonl
from sitl.scenario.traffic import free_port

PACE = 20
MOST_MB = 160.0
ASHORE = ("/scipy/", "/matplotlib/", "mavsdk", "/ompl/")   # in the names of their libraries
MISSION = """
name = "there"
[[goal]]
lat = 50.8170000
lon = -1.3010
[operator]
arm = true
set_auto = true
"""


def family(pid):
    """The process and those below it."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in map(int, (task / "children").read_text().split()):
            found += family(child)
    return found


def memory_mb(pid):
    """Pages in common with others count by their share (PSS)."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) * 1024 / 1e6


@pytest.fixture
def boat():
    port = free_port()
    command = [sys.executable, "-m", "sitl.cli", "boat", "--port", str(port), "--udp", "0", "--speedup", str(PACE),
               "--warm", "--moored", "--home", "50.817,-1.31", "--heading", "90"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert "sitl boat" in process.stdout.readline()
        yield f"tcp:127.0.0.1:{port}"
        process.terminate()


def test_it_is_small_with_its_planner_and_leaves_no_process_behind(boat, tmp_path):
    if not is_ready(("companion",)):
        prepare(("companion",), say=lambda _: None)
    (tmp_path / "there.toml").write_text(MISSION)
    command = [sys.executable, "-m", "companion.cli", "run", "there.toml", "--link", boat, "--speedup", str(PACE),
               "--out", "voyage"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL,
                          env={**os.environ, "PYTHONPATH": str(Path.cwd())}) as companion:
        try:
            wait_for_plans(tmp_path / "voyage/decisions.jsonl", 1)
            pids = family(companion.pid)
            assert len(pids) == 3   # the companion, the nursery, the planner
            maps = "".join(Path(f"/proc/{pid}/maps").read_text() for pid in pids)
            assert [name for name in ASHORE if name in maps] == []
            assert sum(map(memory_mb, pids)) < MOST_MB
        finally:
            companion.send_signal(signal.SIGINT)
        companion.wait(60)
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


def wait_for_plans(path, count):
    end = time.monotonic() + 120.0
    while not path.exists() or sum(r["kind"] == "plan" for r in read_jsonl(path)) < count:
        assert time.monotonic() < end
        time.sleep(0.1)

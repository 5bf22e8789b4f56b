"""What ``companion run`` and its planner take of a small computer's memory, together, and what they load.

With the kernels that a package carries, as on the boat: numba in a clone takes 60 MB more.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bench.voyage import PACKAGED, alone_mb
from companion.telemetry.folder.recorder import read_jsonl
from sitl.scenario.traffic import free_port

PACE = 20
MOST_MB = 120.0  # 107 to 115, alone on the machine; while a plan is made 5 more
ASHORE = ("/scipy/", "/matplotlib/", "mavsdk", "/ompl/", "/numba/", "llvmlite")  # in the names of their libraries
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


@pytest.fixture
def boat():
    port = free_port()
    command = [
        sys.executable,
        "-m",
        "sitl.cli",
        "boat",
        "--port",
        str(port),
        "--udp",
        "0",
        "--speedup",
        str(PACE),
        "--warm",
        "--home",
        "50.817,-1.31",
        "--heading",
        "90",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert "sitl boat" in process.stdout.readline()
        yield f"tcp:127.0.0.1:{port}"
        process.terminate()


def test_it_is_small_with_its_planner_and_leaves_no_process_behind(boat, carried, tmp_path):
    (tmp_path / "there.toml").write_text(MISSION)
    command = [
        sys.executable,
        "-c",
        PACKAGED,
        str(carried),
        "run",
        "there.toml",
        "--link",
        boat,
        "--out",
        "voyage",
        "--speedup",
        str(PACE),
    ]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": str(Path.cwd())}
    ) as companion:
        try:
            wait_for_plans(tmp_path / "voyage/decisions.jsonl", 1)
            wait_for_rows(tmp_path / "voyage/track.csv", 40)  # she sails, and is told when she will be there
            pids = family(companion.pid)
            assert len(pids) == 3  # the companion, the fork server, the planner
            maps = "".join(Path(f"/proc/{pid}/maps").read_text() for pid in pids)
            assert [name for name in ASHORE if name in maps] == []
            assert alone_mb(pids) < MOST_MB
        finally:
            companion.send_signal(signal.SIGINT)
        companion.wait(60)
    end = time.monotonic() + 10.0  # the planner ends when it sees that its socket is closed
    while any(Path(f"/proc/{pid}").exists() for pid in pids):
        assert time.monotonic() < end
        time.sleep(0.05)


def wait_for_plans(path, count):
    end = time.monotonic() + 120.0
    while not path.exists() or sum(r["kind"] == "plan" for r in read_jsonl(path)) < count:
        assert time.monotonic() < end
        time.sleep(0.1)


def wait_for_rows(path, more):
    end, before = time.monotonic() + 120.0, path.read_bytes().count(b"\n")
    while path.read_bytes().count(b"\n") < before + more:
        assert time.monotonic() < end
        time.sleep(0.1)

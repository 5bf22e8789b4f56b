"""``companion run`` as a process beside ``sitl boat``: what no output, no signal of a terminal and no disk may end.

One boat, two runs, several checks in each: a process takes seconds to start.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from companion.disk import Disk
from companion.telemetry.folder.recorder import read_jsonl
from sitl.scenario.traffic import free_port

PACE = 20
MISSION = """
name = "{name}"
[[goal]]
lat = 50.8170000
lon = {lon}
radius_m = 10.0
[operator]
arm = true
set_auto = true
local_orders = ["hold", "go_on"]
"""
PATIENCE_S = 200.0
SMALL_BYTES = 16 << 20
COMPANION = [sys.executable, "-m", "companion.cli"]


@pytest.fixture(scope="module")
def link():
    """A simulated boat in a process of its own; its LINK."""
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
        "--moored",
        "--home",
        "50.817,-1.31",
        "--heading",
        "90",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as boat:
        assert "sitl boat" in boat.stdout.readline()
        yield f"tcp:127.0.0.1:{port}"
        boat.terminate()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two missions, on a small file system of its own where one can be mounted.

    Not too small for what is recorded in an hour of hers, 2 KB/s: where the orders take long that fills it, too.
    """
    folder = tmp_path_factory.mktemp("boat")
    small = ["mount", "-t", "tmpfs", "-o", f"size={SMALL_BYTES}", "tmpfs", folder]
    done = subprocess.run(small, capture_output=True, check=False)
    (folder / "first.toml").write_text(MISSION.format(name="first", lon=-1.3085))
    (folder / "second.toml").write_text(MISSION.format(name="second", lon=-1.3105))
    yield folder
    if done.returncode == 0:
        subprocess.run(["umount", "-l", folder], check=True)


def command(mission, link, *more):
    return [*COMPANION, "run", mission, "--link", link, "--speedup", str(PACE), *more]


def wait_for(what, seconds=PATIENCE_S):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end
        time.sleep(0.05)


def records(path):
    return [json.loads(line) for line in path.read_text().splitlines() if line] if path.exists() else []


ORDERS = ("why", "home", "jump", "hold")  # held, she does not arrive while nothing can be recorded
told = {}  # what orders on board were answered: the exit code, what was printed


def order(folder, *words):
    done = subprocess.run(
        [*COMPANION, "order", *words, "--socket", "s"], cwd=folder, text=True, capture_output=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def first(link, folder):
    """The first mission, sailed through everything: its exit code, its folder, what a second companion said."""
    run = subprocess.Popen(
        command("first.toml", link, "--out", "first/v", "--socket", "s"),
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert run.stdout.readline()
    run.stdout.close()  # | head -1
    second = subprocess.run(
        command("second.toml", link, "--out", "first/w"),
        cwd=folder,
        text=True,
        capture_output=True,
        check=False,
        timeout=PATIENCE_S,
    )
    decisions = folder / "first/v/decisions.jsonl"
    wait_for(lambda: any(d.get("code") == "under way" for d in records(decisions)))
    told.update((words, order(folder, *words.split())) for words in ORDERS)
    is_small = Disk().room(folder).free_bytes < SMALL_BYTES
    if is_small:
        with (folder / "filler").open("wb") as file:
            try:
                while True:
                    os.write(file.fileno(), bytes(4096))
            except OSError:
                pass
    run.send_signal(signal.SIGHUP)  # the ssh has dropped
    if is_small:
        size = decisions.stat().st_size
        time.sleep(12.0 / PACE)
        assert decisions.stat().st_size - size < 4096
        (folder / "filler").unlink()
    run.stderr.close()
    told["go_on"] = order(folder, "go_on")
    assert told["go_on"][0] == 0, told
    try:
        wait_for(lambda: any(d.get("code") == "done" for d in records(decisions)))
        time.sleep(20.0 / PACE)
        assert run.poll() is None  # the loiter is watched until somebody ends it
        run.terminate()
        return run.wait(PATIENCE_S), folder / "first/v", second, is_small
    finally:
        run.kill()


def test_orders_are_taken_from_on_board_as_the_mission_permits(first, folder):
    assert (told["why"][0], told["hold"], told["go_on"][0]) == (
        0,
        (0, "hold: loitering here, where there is room, until go_on\n"),
        0,
    )
    assert told["go_on"][1].startswith("go_on: the end of hold: ")
    assert told["home"] == (
        1,
        "home: refused: not permitted: the mission's [operator] local_orders does not name home\n",
    )
    assert told["jump"][0] == 2
    by = [d["order"] for d in records(first[1] / "decisions.jsonl") if d["kind"] == "order"]
    assert {d["source"][0] for d in by} == {"local"}
    assert not (folder / "s").exists()
    assert order(folder, "why")[0] == 3


def test_neither_a_closed_pipe_nor_a_hangup_ends_a_voyage(first):
    """Both did: the one with a traceback, the other without a summary, as a clean end."""
    code, voyage, _, _ = first
    assert code == 0
    summary = json.loads((voyage / "summary.json").read_bytes())
    assert summary["arrived"] is True
    assert summary["end_reason"] == "stopped"


def test_a_second_companion_is_refused_in_one_line(first):
    """Two companions commanded one boat."""
    _, _, second, _ = first
    assert second.returncode == 1
    assert re.fullmatch(
        r"companion run: first: another companion is sailing with the state kept here.*\n", second.stderr
    )


def test_a_real_full_disk_under_way_costs_records_only(first):
    """The companion ended with exit code 1, and so did its restart."""
    _, voyage, _, is_small = first
    if not is_small:
        pytest.skip("no file system can be mounted here")
    gaps = [d for d in read_jsonl(voyage / "decisions.jsonl") if d["kind"] == "gap"]
    assert len(gaps) == 1
    assert gaps[0]["dropped"] > 0
    assert "No space left" in gaps[0]["why"] or "kept for the state" in gaps[0]["why"]


def test_the_second_mission_sails_from_wherever_it_is_started(first, link, folder, tmp_path):
    """It met the first one's list as foreign, and waited for ever."""
    assert first[0] == 0
    (tmp_path / "second.toml").write_text((folder / "second.toml").read_text())
    run = subprocess.run(
        command("second.toml", link, "--exit-on-arrival"),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=PATIENCE_S,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    *_, end, where = run.stdout.splitlines()
    assert re.match(r"arrived; [1-9]\d* s under way by her own record, ", end)
    voyage = tmp_path / where
    said = [d["code"] for d in records(voyage / "decisions.jsonl") if d.get("action") == "Announce"]
    assert "adopted" in said or "earlier mission" in said
    assert "foreign mission" not in said

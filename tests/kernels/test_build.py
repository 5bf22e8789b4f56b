"""Compiling ahead: complete, resumed where it was, in little memory, and said."""

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from companion.kernels import build, places
from companion.kernels.build import Progress, is_ready, prepare
from companion.kernels.listed import as_text, from_text, read_list
from sitl.scenario.traffic import free_port

ALL = ("companion", "sitl")
# What is compiled while a program does all that a voyage asks for.
LEFT = """
from numba.core import event
late = []

class Listener(event.Listener):
    def on_start(self, happened):
        function = happened.data["dispatcher"].py_func
        late.append(f"{function.__module__}.{function.__qualname__} {happened.data['args']}")

    def on_end(self, happened):
        pass

event.register("numba:compile", Listener())
from companion.planner.solve import warm
from companion.wind.estimators.forecaster import compile_kernels
from sitl.autopilot.boat import kernel
warm()
compile_kernels()
print(late)
"""


@pytest.fixture(scope="module")
def whole():
    """The user's folder with every kernel."""
    prepare(ALL, say=lambda _: None)
    return places.folder()


@pytest.fixture
def empty(tmp_path, monkeypatch):
    monkeypatch.setenv("COMPANION_KERNELS", str(tmp_path / "kernels"))
    (tmp_path / "kernels").mkdir()
    return tmp_path / "kernels"


def test_everything_that_the_planner_and_the_forecaster_call_is_listed(whole):
    """After an edit of a kernel's types: `python -m bench.kernels --write`."""
    assert is_ready(ALL)
    assert whole.is_dir()
    done = subprocess.run([sys.executable, "-c", LEFT], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("package", ALL)
def test_the_list_names_what_is_there(package):
    entries = read_list(package)
    assert entries
    for entry in entries:
        assert as_text(from_text(entry.signature)) == entry.signature
        assert entry.kernel().py_func.__name__ == entry.name


def test_it_goes_on_where_it_was(whole, empty):
    """Interrupted, or one kernel edited: what is there is not compiled again."""
    edited = ("xorshift.uniform-", "gauge._chain-")
    for path in whole.iterdir():  # of earlier versions too
        if not path.name.startswith(("all-", ".", *edited)):
            shutil.copy2(path, empty)
    before = {path: path.stat().st_mtime_ns for path in empty.iterdir()}
    assert not is_ready(ALL)
    said = []
    prepare(ALL, say=said.append)
    assert is_ready(ALL)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    for kernel in edited:
        assert [path for path in empty.glob(f"{kernel}*") if (whole / path.name).exists()]
    first, last = ([int(n) for n in re.findall(r"(\d+) of (\d+)", text)[0]] for text in (said[0], said[-1]))
    assert first[0] < last[0] == last[1]
    prepare(ALL, say=pytest.fail)  # nothing is left to do


def test_a_process_that_is_killed_is_followed_by_another_and_the_third_one_ends_it(empty, monkeypatch, capsys):
    """Short of memory: what can be compiled is, and it does not hang."""
    tries = []

    class Killed:
        def __init__(self, *_, **__):
            tries.append(1)

        def __enter__(self):
            raise BrokenProcessPool("a process was killed")

        def __exit__(self, *_):
            return False

    monkeypatch.setattr("concurrent.futures.ProcessPoolExecutor", Killed)
    assert build.compile_listed(ALL) == build.KILLED
    assert len(tries) == 3
    assert capsys.readouterr().out == ""


def test_progress_says_how_long_it_takes_when_it_knows():
    first = Progress(done=10, of=100, done_s=5.0, of_s=65.0)
    assert first.say(0.2, first).endswith("10 of 100")
    assert Progress(done=40, of=100, done_s=25.0, of_s=65.0).say(20.0, first).endswith("40 of 100, about 40 s left")
    assert Progress(done=40, of=100, done_s=25.0, of_s=65.0).say(200.0, first).endswith("about 7 min left")
    assert Progress(done=100, of=100, done_s=65.0, of_s=65.0).say(60.0, first).endswith("100 of 100")


def compiling(folder):
    """Return the command lines of the processes, zombies left out, that keep their kernels in a folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if f"COMPANION_KERNELS={folder}".encode() in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" "))
    return found


def test_the_first_start_says_what_it_does_and_ctrl_c_ends_it_without_a_word(empty, tmp_path):
    """It said one line for minutes; Ctrl-C was not heard, and the planner's child printed a traceback."""
    (tmp_path / "a.toml").write_text('name = "a"\n[[goal]]\nlat = 50.817\nlon = -1.3085\n')
    manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    manager.bind(str(tmp_path / "notify"))
    manager.settimeout(60.0)
    run = subprocess.Popen(
        [sys.executable, "-m", "companion.cli", "run", "a.toml", "--link", f"udpin:127.0.0.1:{free_port()}"],
        cwd=tmp_path,
        env={**os.environ, "NOTIFY_SOCKET": str(tmp_path / "notify")},
        start_new_session=True,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with manager:
        told = manager.recv(4096).decode()
    # a busy machine is slow to see what there is, and says that first
    said = next(line for line in run.stdout if not line.startswith("loading kernels"))
    os.killpg(run.pid, signal.SIGINT)
    _, errors = run.communicate(timeout=30.0)
    assert re.match(r"STATUS=\w.*\nEXTEND_TIMEOUT_USEC=120000000$", told)
    assert re.match(r"compiling kernels, once on each machine: \d+ of \d+", said)
    assert run.returncode == 130
    assert errors == ""
    deadline_s = time.monotonic() + 5.0
    while compiling(empty):
        assert time.monotonic() < deadline_s, compiling(empty)
        time.sleep(0.1)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_whoever_compiles_ahead_ends_with_the_program_that_asked(number, empty):
    """Its processes waited for work for ever, 250 MB each, and held the terminal's output open."""
    script = "from companion.kernels import build; build.prepare(['companion'], say=lambda _: print('.', flush=True))"
    asker = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    asker.stdout.readline()
    asker.send_signal(number)
    asker.communicate(timeout=10.0)  # the end of its output: nobody else has it
    deadline_s = time.monotonic() + 5.0
    while compiling(empty):
        assert time.monotonic() < deadline_s, compiling(empty)
        time.sleep(0.1)


@pytest.mark.campaign
def test_the_first_start_on_a_busy_machine(empty, tmp_path):
    """It ended after a fixed 180 s of compiling: a clone made on a busy machine did not sail."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(8)]
    try:
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "sitl.cli",
                "run",
                "sitl/scenarios/demo.toml",
                "--live",
                "--out",
                str(tmp_path / "v"),
            ],
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        for process in busy:
            process.kill()
            process.wait()
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert is_ready(ALL)

"""Ctrl-C and SIGTERM: a command ends at once, from its first instruction on, whoever is not heard."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime

import pytest

from companion import cli
from companion.app.options import SailOptions, at_once
from companion.app.sail import sail
from companion.clock import now_s, run_virtual
from companion.commands import run
from companion.commands.run import SignalEnding, epoch_of
from companion.geofence import load_mission
from companion.planner.fork_server import ForkServer
from companion.program import INTERRUPTED
from companion.program.arguments import absent_device
from companion.telemetry.console import Console
from companion.telemetry.folder.logbook import Logbook
from sitl import cli as sitl
from sitl.autopilot import MemoryLink
from sitl.faults.computer_faults import FaultyPlanner
from sitl.scenario.traffic import free_port

MISSION = 'name = "a"\n[[goal]]\nlat = 50.817\nlon = -1.3085\nradius_m = 10.0\n'
HERE = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


def test_a_voyage_that_hears_nobody_is_stopped_when_it_is_asked(tmp_path):
    """It was asked once nobody had been heard for 30 s, and raised that."""
    (tmp_path / "a.toml").write_text(MISSION)

    async def voyage():
        stop = asyncio.Event()
        asyncio.get_running_loop().call_later(3.3, stop.set)
        options = SailOptions(epoch_s=1.78e9, offload=at_once, is_durable=False, wait_s=30.0)
        told = await sail(
            load_mission(tmp_path / "a.toml"),
            MemoryLink("nobody", seed=1).near,
            FaultyPlanner(),
            tmp_path / "v",
            options,
            stop=stop,
        )
        return told, now_s()

    summary, ended_s = run_virtual(voyage())
    assert (summary["end_reason"], summary["arrived"], ended_s) == ("stopped", False, pytest.approx(3.3))
    assert json.loads((tmp_path / "v/summary.json").read_bytes())["end_reason"] == "stopped"


def test_a_signal_ends_what_is_not_begun_stops_a_voyage_and_ends_it_the_second_time():
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    async def voyage():
        ending = SignalEnding()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        stop = ending.asked()
        signal.raise_signal(signal.SIGINT)
        await asyncio.wait_for(stop.wait(), 10.0)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)

    try:
        asyncio.run(voyage())
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


async def arrived(*given):
    """Sail to the goal, in place of ``run._sail``; a signal would stop the voyage, as it is told to it last."""
    given[-1].asked()
    counts = dict.fromkeys(("plans", "uploads", "tacks", "replans"), 1)
    reached = {"goals": 1, "goals_given_up": 0, "records_dropped": 0, "end_reason": "arrived", "time_s": 60.0}
    return {"arrived": True, "arrived_before": False, **reached, **counts}


def run_of(folder):
    """Return the command line of a voyage in ``folder``, where its mission is written."""
    (folder / "a.toml").write_text(MISSION)
    link = f"udpin:127.0.0.1:{free_port()}"
    return ["run", str(folder / "a.toml"), "--link", link, "--out", str(folder / "v")]


def test_how_a_voyage_ended_is_told_before_its_picture_is_drawn(tmp_path, monkeypatch):
    """What ended the drawing left it untold, and a fork server was there for planners of which none was to come."""
    happened = []

    class Spare:
        def close(self):
            happened.append("fork server ended")

    monkeypatch.setattr(ForkServer, "begin", lambda _: Spare())
    monkeypatch.setattr(run, "_sail", arrived)
    monkeypatch.setattr(run, "_report", lambda *_: happened.append("picture"))
    monkeypatch.setattr(Console, "write", lambda _, text: happened.append(text.partition(";")[0]))
    assert cli.main(run_of(tmp_path)) == 0
    told = happened.index("arrived")
    assert happened[told + 1 : told + 3] == ["fork server ended", "picture"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("where", ["told", "drawn"])
def test_a_signal_after_a_voyage_has_ended_by_itself_costs_its_picture_and_nothing_else(
    number, where, tmp_path, monkeypatch
):
    """It was told as "the picture could not be drawn: RuntimeError('Event loop is closed')", or was a traceback."""
    drawn, outcome_of = [], run.outcome_of

    def told(*given):
        if where == "told":
            signal.raise_signal(number)
        return outcome_of(*given)

    def plotted(*_):
        signal.raise_signal(number)
        drawn.append(True)

    monkeypatch.setattr(ForkServer, "begin", lambda _: None)
    monkeypatch.setattr(run, "_sail", arrived)
    monkeypatch.setattr(run, "outcome_of", told)
    monkeypatch.setattr("companion.plots.voyage.plot_voyage", plotted)
    monkeypatch.setattr("companion.telemetry.folder.read_voyage", lambda folder: folder)
    said = []
    monkeypatch.setattr(Console, "write", lambda _, text: said.append(text))
    assert cli.main(run_of(tmp_path)) == 0
    assert said[-1] == "companion run: the picture is not drawn; companion report draws it\n"
    assert [text.partition(";")[0] for text in said[-2:-1]] == ["arrived"]
    assert not drawn


def test_run_on_a_link_where_nobody_answers_ends_when_it_is_told_to(tmp_path):
    """It went on for 25 s; the shell of a script has what it puts into its background ignore SIGINT."""
    (tmp_path / "a.toml").write_text(MISSION)
    run = subprocess.Popen(
        [
            "/bin/sh",
            "-c",
            "trap '' INT; exec \"$@\"",
            "sh",
            sys.executable,
            "-m",
            "companion",
            "run",
            "a.toml",
            "--link",
            f"tcp:127.0.0.1:{free_port()}",
            "--wait",
            "1000",
            "--out",
            "v",
        ],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=HERE,
    )
    try:
        assert any("nothing yet" in line for line in run.stdout)
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=60.0)
    finally:
        run.kill()
    assert (run.returncode, err) == (1, "")
    assert "not arrived: stopped" in out


def test_ctrl_c_while_the_program_loads_leaves_no_traceback():
    """A library that was being imported told of it in thirty lines."""
    begin = """
import runpy, sys, time
class Slow:
    def find_spec(self, name, path=None, target=None):
        if name == "companion.cli":
            print("loading", flush=True)
            time.sleep(60)
sys.meta_path.insert(0, Slow())
runpy.run_module("companion", run_name="__main__")
"""
    run = subprocess.Popen(
        [sys.executable, "-c", begin], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=HERE
    )
    try:
        assert run.stdout.readline() == "loading\n"
        run.send_signal(signal.SIGINT)
        _, err = run.communicate(timeout=30.0)
    finally:
        run.kill()
    assert (run.returncode, err) == (-signal.SIGINT, "")


@pytest.mark.parametrize("program", ["companion", "sitl"])
def test_ctrl_c_before_main_is_called_leaves_no_traceback(program):
    """What pip installs compiles a regular expression between import and call."""
    begin = f"import {program}.__main__, time; print('here', flush=True); time.sleep(60)"
    run = subprocess.Popen(
        [sys.executable, "-c", begin], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=HERE
    )
    try:
        assert run.stdout.readline() == "here\n"
        run.send_signal(signal.SIGINT)
        _, err = run.communicate(timeout=30.0)
    finally:
        run.kill()
    assert (run.returncode, err) == (-signal.SIGINT, "")


@pytest.mark.parametrize("has_begun", [False, True])
def test_an_interrupted_simulation_says_where_its_records_are(has_begun, tmp_path, monkeypatch, capsys):
    folder = tmp_path / "v"

    def interrupted(*_):
        if has_begun:
            folder.mkdir()
            (folder / "decisions.jsonl").write_text("")
        raise KeyboardInterrupt

    monkeypatch.setattr("sitl.commands.run._sailed", interrupted)
    assert sitl.main(["run", "demo", "--out", str(folder)]) == INTERRUPTED
    kept = f"what was recorded is in {folder}" if has_begun else "nothing was recorded yet"
    assert capsys.readouterr().err == f"sitl run: interrupted, so there is no verdict; {kept}\n"


def test_an_interrupt_of_which_a_kernel_makes_an_error_of_its_own_is_one(monkeypatch, capsys):
    """`companion plan` told of it in forty lines: numba calls Python while it returns."""

    def returns(*_, **__):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr("companion.planner.plan", returns)
    assert cli.main(["plan", "sailbench/problems/four-beat-60.json"]) == INTERRUPTED
    assert capsys.readouterr().err == ""

    def fails(*_, **__):
        raise SystemError

    monkeypatch.setattr("companion.planner.plan", fails)
    with pytest.raises(SystemError):
        cli.main(["plan", "sailbench/problems/four-beat-60.json"])


def test_an_interrupt_that_falls_into_a_finalizer_comes_again(monkeypatch, capsys):
    """`companion rehearse` told that it was ignored, and went on for the forty seconds that it was watched."""

    monkeypatch.setattr(sys, "unraisablehook", sys.__unraisablehook__)  # not pytest's, which would be told

    class Leaves:
        def __del__(self):
            raise KeyboardInterrupt

    def plans(*_, **__):
        Leaves()
        time.sleep(30.0)

    monkeypatch.setattr("companion.planner.plan", plans)
    began_s = time.monotonic()
    assert cli.main(["plan", "sailbench/problems/four-beat-60.json"]) == INTERRUPTED
    assert time.monotonic() - began_s < 20.0
    assert "ignored" not in capsys.readouterr().err


@pytest.mark.parametrize("lines", [1, 100_000])  # read to the end of the buffer, and not
def test_a_reader_that_has_gone_ends_a_command_quietly(lines):
    """`companion report VOYAGE | head -3` told of a broken pipe that was ignored."""
    begin = f"""
import sys, time
import companion.commands.field as command
def run(args):
    print("first", flush=True)
    time.sleep(0.4)
    for _ in range({lines}):
        print("what nobody reads")
    return 0
command.run = run
from companion.cli import main
sys.exit(main(["field", "missions/field-ring.toml"]))
"""
    env = {**HERE, "PYTHONUNBUFFERED": ""}  # else each line is met by the pipe as it is printed
    run = subprocess.Popen(
        [sys.executable, "-c", begin], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env
    )
    try:
        assert run.stdout.readline() == "first\n"
        run.stdout.close()
        with run.stderr:
            err = run.stderr.read()
    finally:
        run.wait(30.0)
    assert (run.returncode, err) == (0, "")


@pytest.mark.parametrize("program", ["companion", "sitl"])
def test_nothing_is_read_from_a_file_before_ctrl_c_is_provided_for(program):
    """``signal`` and ``__future__`` are files: some of them printed the traceback of an import."""
    script = f"""
import sys
before = {{*sys.modules}}
import {program}.__main__
print(*({{*sys.modules}} - before - {{*sys.builtin_module_names}}))
"""
    run = subprocess.run([sys.executable, "-S", "-c", script], capture_output=True, text=True, check=True, env=HERE)
    assert {*run.stdout.split()} == {program, f"{program}.__main__"}


def test_a_port_that_is_not_there_is_told_first(tmp_path, capsys):
    """The first words were 30 s of "nothing yet"."""
    assert cli.main(["status", "--link", str(tmp_path / "ttyUSB0:57600"), "--once", "--timeout", "0.2"]) != 0
    first, *_ = capsys.readouterr().err.splitlines()
    assert first == f"companion status: {tmp_path}/ttyUSB0: no such device; is it plugged in? waiting for it"
    by_path = tmp_path / "pci-0000:01:00.0-usb-0:1"
    by_path.touch()
    assert absent_device(f"{by_path}:57600") == ""
    assert absent_device("COM3").startswith("COM3: no such device")


@pytest.mark.parametrize("rate", ["576x", "", "57", "99999999"])
@pytest.mark.parametrize("command", [["doctor"], ["status", "--once"]])
def test_a_slip_in_a_port_s_rate_is_told_and_not_waited_for(tmp_path, capsys, command, rate):
    """ "No such device; waiting for it" came before the refusal."""
    assert cli.main([*command, "--link", str(tmp_path / f"ttyUSB0:{rate}")]) == 2
    (said,) = (line for line in capsys.readouterr().err.splitlines() if not line.startswith("looking at"))
    assert f"{rate!r} is not a baud rate" in said


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["mission", "check", "a.toml"], 0, "N?rdliche B?je"),
        (["mission", "check", "ü.toml"], 2, "rename it, or set LANG"),
    ],
)
def test_a_terminal_without_umlauts_is_told_in_question_marks(tmp_path, words, code, said):
    for name in ("a", "ü"):
        (tmp_path / f"{name}.toml").write_text(MISSION.replace('"a"', '"Nördliche Böje"'), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-m", "companion", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={**HERE, "PYTHONUTF8": "0", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"},
    )
    assert run.returncode == code, run.stderr
    assert said in run.stdout + run.stderr
    assert (run.stdout + run.stderr).count("\n") == 1


def test_a_hurried_voyage_begun_again_in_its_folder_goes_on_by_its_own_epoch(tmp_path):
    """Eight times as fast as the clock, its second life's frames were stamped before the first's."""
    at_s, up_s = 1.78e9, 1_000.0
    first_s = epoch_of(tmp_path, 8.0, at_s, up_s)
    assert first_s + 8.0 * up_s == at_s
    started = datetime.fromtimestamp(at_s, UTC).isoformat()
    (tmp_path / "voyage.toml").write_text(f'[run]\nepoch_s = {first_s}\nstarted_utc = "{started}"\n')
    assert epoch_of(tmp_path, 8.0, at_s + 60.0, up_s + 60.0) == first_s
    assert epoch_of(tmp_path, 1.0, at_s + 60.0, up_s + 60.0) == at_s - up_s  # on the water the clock may be set
    assert epoch_of(tmp_path, 8.0, at_s + 60.0, 5.0) == at_s + 60.0 - 40.0  # the computer was started again


def test_utc_of_a_hurried_voyage_is_the_clocks(tmp_path):
    """It ran eight times as fast, into hours that nobody had lived yet."""
    hurried = Logbook(None, None, 1_000.0 - 8.0 * 100.0, clock_epoch_s=1_000.0 - 100.0, pace=8.0)
    assert hurried.stamps(800.0)["utc"] == "1970-01-01T00:16:40.000Z"
    assert hurried.stamps(880.0)["utc"] == "1970-01-01T00:16:50.000Z"  # ten seconds of the clock
    assert Logbook(None, None, 1_000.0).stamps(80.0)["utc"] == "1970-01-01T00:18:00.000Z"

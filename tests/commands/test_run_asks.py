"""What ``companion run`` asks at a terminal before it sails, and what it refuses there."""

import os
import pty
import sys

import pytest

from companion.app.options import at_once
from companion.clock import run_virtual
from companion.commands.run import confirm_again, hold_state_folder
from companion.disk import Disk
from companion.errors import InputError, JobError
from companion.geofence import load_mission
from companion.skipper.step.saved import Persisted
from companion.telemetry.console import Console
from companion.telemetry.state_file import StateFile


@pytest.fixture
def terminal(monkeypatch):
    """A terminal as standard input; (its keyboard, a stream to print to)."""
    keyboard, screen = pty.openpty()
    with os.fdopen(os.dup(screen)) as stdin, os.fdopen(screen, "w") as stream:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield keyboard, stream
    os.close(keyboard)


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('name = "lake"\n[[goal]]\nlat = 50.0\nlon = 1.0\n')
    return load_mission(path)


def save(path, *, arrived):
    saved = Persisted(voyage="lake", gate=1, sailing=False, route=None, pending=None, arrived=arrived)
    run_virtual(StateFile(path, disk=Disk(), offload=at_once).save(saved))


@pytest.mark.parametrize(("answer", "again"), [("y", True), ("yes", True), ("n", None), ("", None)])
def test_a_mission_that_has_arrived_is_asked_for(answer, again, terminal, mission, tmp_path):
    save(tmp_path / "state.json", arrived=True)
    keyboard, stream = terminal
    os.write(keyboard, answer.encode() + b"\n")
    with Console(stream) as console:
        assert confirm_again(mission, tmp_path / "state.json", console) is again
    seen = b""
    while b"lake has arrived already" not in seen:
        seen += os.read(keyboard, 4096)


def test_one_that_has_not_is_sailed_on_without_a_question(terminal, mission, tmp_path):
    save(tmp_path / "state.json", arrived=False)
    with Console(terminal[1]) as console:
        assert confirm_again(mission, tmp_path / "state.json", console) is False
        (tmp_path / "state.json").write_text("[" * 100_000)
        assert confirm_again(mission, tmp_path / "state.json", console) is False
        assert confirm_again(mission, tmp_path / "none.json", console) is False


def test_a_service_is_notasked(mission, tmp_path, monkeypatch):
    save(tmp_path / "state.json", arrived=True)
    monkeypatch.setattr(sys, "stdin", None)
    with Console(None) as console:
        assert confirm_again(mission, tmp_path / "state.json", console) is False


def test_one_boat_has_one_companion_whatever_it_sails(tmp_path):
    with Console(None) as console, hold_state_folder(tmp_path / "x/a.state.json", tmp_path / "v", console):
        with (
            pytest.raises(JobError, match="two must not command one boat"),
            hold_state_folder(tmp_path / "x/b.json", tmp_path / "w", console),
        ):
            pass
        with hold_state_folder(tmp_path / "y/a.state.json", tmp_path / "v", console):  # another boat
            pass
    with Console(None) as console, hold_state_folder(tmp_path / "x/a.state.json", tmp_path / "v", console):
        pass


def test_a_place_that_cannot_hold_the_state_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with Console(None) as console:
        with (
            pytest.raises(InputError, match="cannot hold the state"),
            hold_state_folder(tmp_path / "file/s.json", tmp_path / "v", console),
        ):
            pass
        with pytest.raises(InputError, match="is a folder"), hold_state_folder(tmp_path, tmp_path / "v", console):
            pass

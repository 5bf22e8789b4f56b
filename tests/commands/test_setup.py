"""``companion setup``: finds the autopilot on a serial port, writes two files, and says what is wrong."""

import errno
import fcntl
import grp
import os
import pty
import socket
import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import pytest

from companion import cli
from companion.commands import setup
from companion.disk import Disk
from companion.errors import LinkError
from companion.geofence import load_mission
from sitl.scenario.traffic import free_port

HERE = ["--start", "50.817,-1.31", "--goal", "50.8188,-1.3085"]


@pytest.fixture(scope="module")
def boat():
    port = free_port()
    with subprocess.Popen(
        [
            sys.executable,
            "-m",
            "sitl.cli",
            "boat",
            "--port",
            str(port),
            "--udp",
            "0",
            "--warm",
            "--moored",
            "--sysid",
            "7",
            "--home",
            "50.817,-1.31",
        ],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert "sitl boat" in process.stdout.readline()
        yield port
        process.terminate()


@pytest.fixture
def serial(boat):
    """The name of a serial port (a pseudo terminal) that the boat is on."""
    ours, theirs = pty.openpty()
    connection = socket.create_connection(("127.0.0.1", boat))

    def to_boat():
        try:
            while data := os.read(ours, 4096):
                connection.sendall(data)
        except OSError:
            return

    def from_boat():
        try:
            while data := connection.recv(4096):
                os.write(ours, data)
        except OSError:
            return

    for work in (to_boat, from_boat):
        threading.Thread(target=work, daemon=True).start()
    yield Path(os.ttyname(theirs))
    connection.close()
    os.close(theirs)
    os.close(ours)


def test_it_finds_the_autopilot_writes_a_mission_that_can_be_sailed_and_runs_the_doctor(
    serial, tmp_path, monkeypatch, capfd
):
    monkeypatch.setattr(setup, "serial_ports", lambda: [setup.Port(path=serial)])
    code = cli.main(["setup", "lake", "--yes", "--dir", str(tmp_path), *HERE])
    out, err = capfd.readouterr()
    assert code == 0, out + err  # the doctor's: the simulated boat is set up as it asks
    assert f"the autopilot of system 7 is on {serial}:921600" in out
    assert "0 errors, 0 warnings; nothing was changed" in out
    assert "margin" not in out  # the doctor praises what it writes
    assert sorted(p.name for p in tmp_path.iterdir()) == ["lake.env", "lake.toml"]
    assert "\n[[goal]]\nlat = " in (tmp_path / "lake.toml").read_text()  # and so is the next one, written by hand
    assert f"LINK={serial}:921600\n" in (tmp_path / "lake.env").read_text()
    mission = load_mission(tmp_path / "lake.toml")
    assert (mission.autopilot.system, mission.operator.arm, mission.operator.set_auto) == (7, False, False)
    assert cli.main(["setup", "lake", "--yes", "--dir", str(tmp_path), *HERE]) == 2
    assert "--force" in capfd.readouterr().err


def test_a_drawn_mission_is_run_as_one(tmp_path, capfd):
    assert (
        cli.main(
            [
                "setup",
                "pond",
                "--yes",
                "--drawn",
                "--no-go",
                "50",
                "--link",
                "udpin:127.0.0.1:14598",
                "--no-doctor",
                "--dir",
                str(tmp_path),
            ]
        )
        == 0
    )
    written = tomllib.loads((tmp_path / "pond.toml").read_text())
    assert (written["from_autopilot"], written["boat"]["no_go_half_deg"]) == (True, 50)
    out = capfd.readouterr().out
    assert f"companion run {tmp_path / 'pond.toml'} --link udpin:127.0.0.1:14598 --dry-run" in out
    assert "systemctl" not in out  # the unit looks in another folder


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["Lake", "--yes"], "is no name of an instance"),
        (["lake", "--yes", "--dir", "/nowhere/at/all"], "/nowhere/at/all: no such folder; make it, or name another"),
        (["lake", "--yes", "--link", "udpin:1", "--no-doctor", *HERE], "udpin:1"),
        (
            ["lake", "--yes", "--no-doctor", "--link", "udpin:127.0.0.1:14597", "--polar", "/dev/null", *HERE],
            "/dev/null",
        ),
    ],
)
def test_bad_words_are_one_line_and_write_nothing(words, said, tmp_path, capfd):
    where = [] if "--dir" in words else ["--dir", str(tmp_path)]
    assert cli.main(["setup", *words, *where]) == 2
    err = capfd.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_full_card_is_one_line_with_what_makes_room(tmp_path, monkeypatch, capfd):
    here = os.statvfs(tmp_path)
    monkeypatch.setattr(os, "statvfs", lambda _: os.statvfs_result((*here[:3], 0, 0, *here[5:10])))
    assert (
        cli.main(
            ["setup", "lake", "--yes", "--dir", str(tmp_path), "--link", "udpin:127.0.0.1:1", "--no-doctor", *HERE]
        )
        == 1
    )
    err = capfd.readouterr().err
    assert "the card is full (0.0 MB left); make room: sudo apt clean" in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_folder_that_takes_only_one_of_the_two_files_is_told_and_keeps_none(tmp_path, monkeypatch, capfd):
    """It said "lake.env: Read-only file system" and no more, and left a mission that the next try would not replace."""
    create = Disk.create

    def refuse(disk, path):
        if path.name.startswith("lake.env"):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        return create(disk, path)

    monkeypatch.setattr(Disk, "create", refuse)
    words = ["setup", "lake", "--yes", "--dir", str(tmp_path), "--link", "udpin:127.0.0.1:1", "--no-doctor", *HERE]
    assert cli.main(words) == 2
    assert capfd.readouterr().err == (
        f"companion setup: {tmp_path}/lake.env: cannot be written (Read-only file system); what was there is there; "
        "name another place\n"
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["setup", "run"])
def test_a_system_of_32_bits_is_one_line_with_what_to_install(command, monkeypatch, capfd):
    monkeypatch.setattr(sys, "maxsize", 2**31 - 1)
    assert cli.main([command]) == 1
    err = capfd.readouterr().err
    assert "32-bit system" in err
    assert "install a 64-bit one" in err
    assert err.count("\n") == 1


def refusal(found):
    with pytest.raises(LinkError) as error:
        setup.find_autopilot(found, lambda _: None)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_no_port_a_busy_one_and_one_without_permission(tmp_path, monkeypatch, serial):
    assert "there is no serial port here; wire the autopilot" in refusal(setup.serial_ports(tmp_path))
    (tmp_path / "ttyACM0").symlink_to(serial)
    (tmp_path / "autopilot").symlink_to("ttyACM0")
    assert [p.path.name for p in setup.serial_ports(tmp_path)] == ["autopilot"]  # one port, its best name
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may everything
    group = grp.getgrgid(serial.stat().st_gid).gr_name
    assert f"belongs to the group {group}, and you are not in it; sudo adduser $USER {group}" in refusal(
        setup.serial_ports(tmp_path)
    )


def test_a_busy_port_says_who_to_end(serial):
    with serial.open("r+b", buffering=0) as taken:
        fcntl.flock(taken, fcntl.LOCK_EX)
        assert "another program has it; end that, or share the port" in refusal([setup.Port(path=serial)])


def test_a_goal_that_lies_a_continent_away_is_asked_about(tmp_path, monkeypatch, capfd):
    """Latitude and longitude were swapped, and after all questions the file was refused and nothing written."""
    answers = iter(["50.817,-1.31", "-1.3085,50.8188", "no", "50.817,-1.31", "50.8188,-1.3085", ""])
    monkeypatch.setattr("builtins.input", lambda text: next(answers))
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    words = ["setup", "lake", "--link", "udpin:127.0.0.1:14598", "--no-doctor", "--no-go", "50", "--dir", str(tmp_path)]
    monkeypatch.setattr(setup.Questions, "__call__", _without_drawing(setup.Questions.__call__))
    assert cli.main(words) == 0
    assert "goal 1 (-1.3085,50.8188) is " in (out := capfd.readouterr().out)
    assert "is one of them LON,LAT, or has a sign wrong?" in out
    assert tomllib.loads((tmp_path / "lake.toml").read_text())["goal"] == [{"lat": 50.8188, "lon": -1.3085}]


def _without_drawing(asked):
    return lambda self, what, default, take: False if "drawn" in what else asked(self, what, default, take)

"""What the service manager is told, heard on a real socket, and the unit file that is handed out."""

import configparser
import errno
import io
import os
import re
import select
import shlex
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from companion import cli
from companion.telemetry.systemd import STATUS_CHARACTERS, ServiceManager
from sitl.scenario.traffic import free_port

UNIT = Path("deploy/companion@.service")


@pytest.fixture
def manager(tmp_path):
    """A service manager that listens: (environment, socket)."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind(str(tmp_path / "notify"))
        listening.setblocking(False)
        yield {"NOTIFY_SOCKET": str(tmp_path / "notify")}, listening


def heard(listening):
    out = []
    try:
        while True:
            out.append(listening.recv(4096).decode())
    except BlockingIOError:
        return out


def test_it_is_ready_once_alive_each_time_and_says_when_it_stops(manager):
    environment, listening = manager
    with ServiceManager(environment) as service:
        service.alive("waiting: for wind")
        service.alive("standard:\nitem 2 of 5 " + 500 * "x")
    first, second, last = heard(listening)
    assert first == "READY=1\nSTATUS=waiting: for wind\nWATCHDOG=1"
    status = second.splitlines()[0]
    assert status.startswith("STATUS=standard: item 2 of 5")  # one line, whatever it was
    assert len(status) <= STATUS_CHARACTERS + len("STATUS=")
    assert second.splitlines()[1] == "WATCHDOG=1"
    assert last == "STOPPING=1"


def test_between_two_voyages_its_watchdog_is_answered(manager):
    """A voyage that gives way to a drawing has another behind it: it is ready by then, and reads and compiles."""
    environment, listening = manager
    with ServiceManager(environment) as service:
        service.starting("reading the drawing")
        service.alive("waiting: for wind")
        service.starting("reading the drawing")
    before, _, between, _ = heard(listening)
    assert before == "STATUS=reading the drawing\nEXTEND_TIMEOUT_USEC=120000000"
    assert between == "STATUS=reading the drawing\nWATCHDOG=1"


def test_without_a_manager_or_with_one_that_is_gone_nothing_happens(tmp_path):
    with ServiceManager({}) as service:
        service.alive("nobody hears this")
    with ServiceManager({"NOTIFY_SOCKET": str(tmp_path / "gone")}) as service:
        service.alive("nor this")


def test_an_abstract_socket():
    name = f"companion-test-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind("\0" + name)
        listening.setblocking(False)
        with ServiceManager({"NOTIFY_SOCKET": "@" + name}) as service:
            service.alive("here")
        assert heard(listening)[0].startswith("READY=1")


def test_companion_run_tells_the_manager_while_it_waits_for_an_autopilot(manager, tmp_path):
    """Its state is in the voyage's folder, as of a live run: the two locks on it shut each other out."""
    environment, listening = manager
    link = f"udpin:127.0.0.1:{free_port()}"
    waiting = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "companion.cli",
            "run",
            "sitl/missions/open-water.toml",
            "--link",
            link,
            "--out",
            str(tmp_path / "voyage"),
            "--state",
            str(tmp_path / "voyage/state.json"),
            "--wait",
            "300",  # until it was heard twice, however slow this machine is
        ],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    told = []
    try:
        while sum("WATCHDOG=1" in text for text in told) < 2:
            select.select([listening], [], [], 1.0)
            told += heard(listening)
            assert waiting.poll() is None
        waiting.terminate()
        waiting.wait(60.0)
    finally:
        waiting.kill()
        waiting.wait()
    before, told = [], told + heard(listening)
    while not told[0].startswith("READY=1"):
        before.append(told.pop(0))
    assert all(text.endswith("EXTEND_TIMEOUT_USEC=120000000") for text in before)  # it may take long to get ready
    assert told[0].startswith("READY=1\nSTATUS=waiting: ")
    assert told[-1] == "STOPPING=1"


def test_the_unit_file_starts_the_program_as_it_is():
    unit = configparser.ConfigParser(interpolation=None, strict=False)
    unit.optionxform = str
    unit.read_string(UNIT.read_text())
    service = unit["Service"]
    assert service["Type"] == "notify"
    assert service["RestartPreventExitStatus"] == "2"
    program, *arguments = shlex.split(service["ExecStart"])
    assert Path(program).name == "companion"
    assert arguments.pop() == "$OPTIONS"
    parsed = cli.PROGRAM.parser().parse_args([word.replace("%i", "lake") for word in arguments])
    assert (str(parsed.mission), parsed.link) == ("/etc/companion/lake.toml", "${LINK}")
    # records and state of two instances are apart
    assert {service["StateDirectory"], service["LogsDirectory"]} == {"companion/%i"}
    assert service["WorkingDirectory"] == "/var/log/companion/%i"
    assert parsed.state.as_posix() == "/var/lib/companion/lake/voyage.state.json"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_the_unit_is_exposed_little(tmp_path):
    """It was 8.3, exposed."""
    said = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--no-pager", "--threshold=20", str(UNIT)],
        capture_output=True,
        text=True,
        check=False,
    )
    if "offline" in said.stderr:
        pytest.skip("this systemd-analyze reads no unit files")
    assert said.returncode == 0, said.stdout[-300:] + said.stderr
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace("/usr/bin/companion", "/bin/true"))
    checked = subprocess.run(["systemd-analyze", "verify", str(unit)], capture_output=True, text=True, check=False)
    assert "companion@" not in checked.stderr  # it names what it does not know


@pytest.mark.parametrize("number", [errno.ENOENT, errno.EIO, errno.ESTALE, errno.ENODEV, errno.ENOMEM])
@pytest.mark.parametrize("name", ["lake.toml", "rocks.wkt", "boat.pol", "key"])
def test_a_file_that_is_not_there_for_a_moment_is_no_reason_to_give_up(tmp_path, monkeypatch, capfd, name, number):
    """Exit code 2 was final for the unit: a card mounted a second late ended the voyage."""
    assert leave(tmp_path, monkeypatch, name, number) == 66
    assert re.fullmatch(
        rf"companion run: .*{re.escape(name)}.*: (no such file|cannot be read \(.*\)); .*\n", capfd.readouterr().err
    )


@pytest.mark.parametrize("number", [errno.EACCES, errno.EISDIR])
def test_a_file_that_is_no_file_or_forbidden_is_given_up(tmp_path, monkeypatch, capfd, number):
    assert leave(tmp_path, monkeypatch, "lake.toml", number) == 2
    assert ("is a folder" if number == errno.EISDIR else "cannot be read") in capfd.readouterr().err


def leave(folder, monkeypatch, name, number):
    """Run a mission with one of its files missing or failing; return the exit code."""
    (folder / "lake.toml").write_text(
        'name = "lake"\n[[goal]]\nlat = 50.817\nlon = -1.3085\n[area]\nobstacles = ["rocks.wkt"]\n'
        '[boat]\npolar = "boat.pol"\n'
    )
    (folder / "rocks.wkt").write_text("POLYGON ((-1.3 50.81, -1.299 50.81, -1.299 50.811, -1.3 50.81))")
    (folder / "boat.pol").write_text("TWA\\TWS;4;8\n0;0;0\n90;3;5\n180;2;4\n")
    (folder / "key").write_text("a passphrase")
    (folder / "key").chmod(0o600)
    if number == errno.ENOENT:
        (folder / name).unlink()
    else:
        really = io.open

        def failing(file, *args, **kwargs):
            if Path(file) == folder / name:
                raise OSError(number, os.strerror(number))
            return really(file, *args, **kwargs)

        monkeypatch.setattr(io, "open", failing)  # what pathlib calls
    monkeypatch.chdir(folder)
    return cli.main(
        [
            "run",
            str(folder / "lake.toml"),
            "--link",
            f"udpin:127.0.0.1:{free_port()}",
            "--wait",
            "1",
            "--signing-key",
            str(folder / "key"),
        ]
    )

"""``companion key``: a file for its owner only; on the autopilot and off it, as seen; what it keeps out."""

import hashlib
import io
import json
import stat
import subprocess
import sys
from contextlib import asynccontextmanager

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.cli import main
from companion.clock import run_virtual
from companion.commands.key import put_on, take_off
from companion.errors import InputError, JobError, LinkError
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.signing import SigningStore, make_key, read_key
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.scenario.traffic import free_port
from sitl.world.environment import Constant

NOW_S = 1_780_000_000.0


@pytest.fixture
def key(tmp_path):
    make_key(tmp_path / "boat.key")
    return tmp_path / "boat.key"


@asynccontextmanager
async def moored():
    """A boat with two ports: the USB, which takes unsigned frames with a key too, and a radio's."""
    usb, radio = MemoryLink("usb"), MemoryLink("radio")
    boat = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), seed=1)
    async with serve(boat, [usb.far, radio.far]):
        yield usb, radio, boat


def told(store, asks=False):
    return {"store": store, "system": None, "asks": asks, "name": "boat.key"}


async def is_answered(radio, store=None):
    try:
        async with Link(radio.near, streams=(), signing=store) as link, Autopilot(link, timeout_s=3.0) as autopilot:
            return (await autopilot.get_parameter("WP_RADIUS")).is_ok
    except LinkError:
        return False


def test_a_key_is_its_owners_and_never_written_over(key, capsys):
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    before = read_key(key)
    assert len(before) == 32
    assert main(["key", "new", str(key)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert read_key(key) == before
    assert main(["key", "new", str(key.parent / "none" / "boat.key")]) == 2


def test_a_passphrase_makes_the_key_that_ground_stations_make_of_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO("fair wind\n"))
    assert main(["key", "new", str(tmp_path / "k"), "--passphrase"]) == 0
    assert read_key(tmp_path / "k") == hashlib.sha256(b"fair wind").digest()
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    assert main(["key", "new", str(tmp_path / "l"), "--passphrase"]) == 2
    assert not (tmp_path / "l").exists()


def test_with_the_key_on_board_strangers_are_not_answered_and_without_it_they_are(key, tmp_path):
    async def work():
        async with moored() as (usb, radio, boat):
            assert await is_answered(radio)
            assert "signs with boat.key" in await put_on(lambda: usb.near, **told(SigningStore(key, NOW_S)))
            assert "already" in await put_on(lambda: usb.near, **told(SigningStore(key, NOW_S + 100.0)))
            assert await is_answered(radio, SigningStore(key, NOW_S + 200.0))
            assert not await is_answered(radio)
            make_key(tmp_path / "other.key")
            other = SigningStore(tmp_path / "other.key", NOW_S + 300.0)
            assert not await is_answered(radio, other)
            with pytest.raises(JobError, match="another key"):
                await put_on(lambda: usb.near, **told(other))
            with pytest.raises(LinkError, match="not signed with this key"):
                await take_off(lambda: usb.near, **told(other))
            boat.reboot()
            assert not await is_answered(radio)
            assert "does not sign any more" in await take_off(
                lambda: usb.near, **told(SigningStore(key, NOW_S + 400.0))
            )
            assert await is_answered(radio)
            with pytest.raises(LinkError, match=r"not signed; .companion key set"):
                await take_off(lambda: usb.near, **told(SigningStore(key, NOW_S + 500.0)))

    run_virtual(work())


def test_nothing_is_done_to_an_armed_boat_or_without_consent(key, monkeypatch):
    async def work():
        async with moored() as (usb, radio, boat):
            monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
            monkeypatch.setattr("builtins.input", lambda _: "")
            with pytest.raises(JobError, match="nothing was changed"):
                await put_on(lambda: usb.near, **told(SigningStore(key, NOW_S), asks=True))
            monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
            with pytest.raises(InputError, match=r"^--yes: is not said, and no terminal .* system 1; .*\?; say it$"):
                await put_on(lambda: usb.near, **told(SigningStore(key, NOW_S), asks=True))
            boat.core.set_armed(armed=True)
            with pytest.raises(JobError, match="armed"):
                await put_on(lambda: usb.near, **told(SigningStore(key, NOW_S)))
            async with Link(usb.near, streams=()) as link, Autopilot(link):  # and the autopilot refuses it itself
                link.send(wire.MAVLink_setup_signing_message(1, 1, [1] * 32, 5))
            assert await is_answered(radio)

    run_virtual(work())


@pytest.fixture
def port():
    """A simulated boat in a process of its own; its TCP port, which is its USB."""
    port = free_port()
    command = [sys.executable, "-m", "sitl.cli", "boat", "--port", str(port), "--udp", "0", "--warm"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as boat:
        assert "sitl boat" in boat.stdout.readline()
        yield port
        boat.terminate()


def test_the_doctor_puts_the_key_on_board(key, port, capsys):
    doctor = ["doctor", "--link", f"tcp:127.0.0.1:{port}", "--set-key"]
    assert main(doctor) == 2
    assert "--signing-key FILE" in capsys.readouterr().err
    main([*doctor, "--signing-key", str(key), "--yes", "--json"])
    out, err = capsys.readouterr()
    assert "signs with" in err
    assert "signing" not in {f["code"] for f in json.loads(out)["findings"]}

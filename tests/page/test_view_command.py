"""``companion view``: what it is given, what is half written, where it cannot serve; each in one line."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request

import pytest

from companion import cli
from companion.page import export
from companion.telemetry.folder import TLOG, TRACK
from tests.page.asking import free_port


def said(capsys, *words):
    code = cli.main(["view", *map(str, words)])
    return code, capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("nowhere",),
        ("nowhere", "--link", "udpin:127.0.0.1:1"),
        ("--link", "udpin:127.0.0.1:1", "--export", "x.html"),
        ("nowhere", "--http", "many"),
        ("nowhere", "--http", "0"),
        ("nowhere", "--http", "a b:80"),
        ("--link", "nothing"),
        ("nowhere", "--http-name", "-x-"),
        ("nowhere", "--chart", "no.mbtiles"),
        ("nowhere", "--chart", "README.md"),
        ("nowhere", "--chart", "README.md", "--export", "x.html"),
        ("--link", "udpin:127.0.0.1:1", "--beside", "nowhere"),
    ],
)
def test_what_cannot_be_viewed_is_one_line(words, capsys):
    code, err = said(capsys, *words)
    assert code == 2
    assert err.count("\n") == 1
    assert "Traceback" not in err


def test_a_voyage_is_packed_once_and_not_over_another_file(sailed, tmp_path, capsys):
    out = tmp_path / "v.html"
    assert cli.main(["view", str(sailed.folder), "--export", str(out)]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"written: {out}, ")
    assert told.endswith(" moments of the voyage; it opens in any browser\n")
    first = out.read_bytes()
    assert b"https://" not in first
    assert said(capsys, sailed.folder, "--export", out)[0] == 2
    assert cli.main(["view", str(sailed.folder), "--export", str(out), "--force"]) == 0
    capsys.readouterr()


def test_the_same_voyage_gives_the_same_file(record):
    assert export(record) == export(record)


@pytest.mark.parametrize("name", ["track.csv", "decisions.jsonl", "telemetry.tlog"])
def test_a_folder_that_is_half_written_is_shown_as_far_as_it_goes(name, sailed, tmp_path, capsys):
    folder = tmp_path / "v"
    shutil.copytree(sailed.folder, folder)
    data = (folder / name).read_bytes()
    (folder / name).write_bytes(data[: 2 * len(data) // 3])
    code = cli.main(["view", str(folder), "--export", str(tmp_path / "v.html")])
    err = capsys.readouterr().err
    assert (code == 0 and (tmp_path / "v.html").stat().st_size > 30_000) or (code == 2 and err.count("\n") == 1)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("track.csv", b""),
        ("track.csv", b"\x00\xff"),
        ("area.json", b"{"),
        ("voyage.toml", b"[run]\n"),
        ("decisions.jsonl", b"[]\n"),
    ],
)
def test_a_folder_with_rubbish_in_it_is_one_line(name, content, sailed, tmp_path, capsys):
    folder = tmp_path / "v"
    shutil.copytree(sailed.folder, folder)
    if name == "area.json":
        (folder / TLOG).unlink()
    (folder / name).write_bytes(content)
    code, err = said(capsys, folder, "--export", tmp_path / "v.html")
    assert code == 2
    assert err.count("\n") == 1
    assert name in err


def test_a_voyage_without_a_step_is_one_line(sailed, tmp_path, capsys):
    folder = tmp_path / "v"
    shutil.copytree(sailed.folder, folder)
    (folder / TRACK).write_bytes((folder / TRACK).read_bytes().split(b"\n")[0] + b"\n")
    code, err = said(capsys, folder, "--export", tmp_path / "v.html")
    assert (code, err.count("\n")) == (2, 1)


def test_it_serves_until_it_is_stopped_and_a_port_in_use_is_one_line(sailed):
    port = free_port()
    command = [sys.executable, "-m", "companion.cli", "view", str(sailed.folder), "--http", str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as serving:
        assert serving.stdout.readline().startswith(f"http://127.0.0.1:{port}/")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/hello") as answer:
            assert answer.status == 200
        second = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
        assert (second.returncode, second.stderr.count("\n")) == (1, 1)
        assert "in use" in second.stderr
        os.kill(serving.pid, signal.SIGINT)
        assert serving.wait(10) == 0
        assert serving.stderr.read() == ""


def test_ashore_the_page_shows_what_the_radio_brings():
    """From the status alone, as ``companion status`` hears it."""
    import json
    import threading

    from pymavlink.dialects.v20 import ardupilotmega as wire

    from companion.mavlink.wire.companion_status import status_messages
    from companion.mavlink.wire.frames import Codec
    from tests.view.test_heard import STATUS

    radio, port, over = free_port(), free_port(), threading.Event()

    def speak():
        autopilot, companion = Codec(system=1, component=1), Codec(system=1, component=191)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            while not over.wait(0.2):
                beat = wire.MAVLink_heartbeat_message(
                    wire.MAV_TYPE_SURFACE_BOAT, wire.MAV_AUTOPILOT_ARDUPILOTMEGA, 1, 10, 4, 3
                )
                udp.sendto(autopilot.pack(beat), ("127.0.0.1", radio))
                for message in status_messages(STATUS, 1.0, 3):
                    udp.sendto(companion.pack(message), ("127.0.0.1", radio))

    speaking = threading.Thread(target=speak, daemon=True)
    speaking.start()
    command = [sys.executable, "-m", "companion.cli", "view", "--link", f"udpin:127.0.0.1:{radio}", "--http", str(port)]
    try:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as serving:
            assert serving.stdout.readline().startswith("http://")
            until_s = time.monotonic() + 20.0
            view = {"state": {"phase": ""}}
            while view["state"]["phase"] != "standard":
                assert time.monotonic() < until_s, view
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/stream", timeout=10) as stream:
                    for line in stream:
                        if line.startswith(b"data: ") and b"companion.view/1" in line:
                            view = json.loads(line[6:])
                            break
            assert (view["source"], view["orders"]["standing"]["verb"]) == ("radio", "hold")
            assert view["boat"]["at_en_m"] == [0.0, 0.0]
            assert view["laylines"] is None
            os.kill(serving.pid, signal.SIGINT)
            assert serving.wait(10) == 0
    finally:
        over.set()
        speaking.join(5.0)

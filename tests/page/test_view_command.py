"""``companion view``: what it is given, what is half written, where it cannot serve; each in one line."""

import json
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
from companion.commands.view import read_record
from companion.geofence import load_mission
from companion.geofence.mission import MOST_PASSAGE_BYTES, planned_beside
from companion.page import export
from companion.telemetry.folder import TLOG, TRACK, Recorder, mission_copy
from companion.telemetry.folder.logbook import write_copies
from tests.page.asking import free_port
from tests.page.conftest import line_passage
from tests.view.conftest import write_mission


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
        ("nowhere", "--passage", "m.passage.json"),
        ("--link", "udpin:127.0.0.1:1", "--passage", "nowhere.passage.json"),
        ("--link", "udpin:127.0.0.1:1", "--passage", "README.md"),
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


def test_the_passage_that_she_was_planned_to_sail_goes_with_the_record(sailed, tmp_path):
    """From the copy in the folder alone: what lies beside the mission later is of another plan."""
    planned_beside(sailed.mission).rename(tmp_path / "away")
    try:
        record = read_record(sailed.folder)
    finally:
        (tmp_path / "away").rename(planned_beside(sailed.mission))
    assert record.planned == line_passage()
    assert (record.hello()["passage"], record.hello()["passage_said"]) == (True, "")
    layer = json.loads(record.passage()())
    assert layer["waypoints"][1]["at_en_m"] == [0.0, pytest.approx(100.1, abs=0.5)]
    assert {key: len(layer[key]) for key in ("band", "met", "isochrones", "members_m")} == {
        "band": 1,
        "met": 1,
        "isochrones": 1,
        "members_m": 2,
    }


def test_a_copy_of_a_passage_that_cannot_be_read_is_said_and_the_voyage_is_shown(sailed, tmp_path, capsys):
    folder = tmp_path / "v"
    shutil.copytree(sailed.folder, folder)
    planned_beside(mission_copy(folder)).write_text("{")
    record = read_record(folder)
    assert (record.planned, record.passage(), record.hello()["passage"]) == (None, None, False)
    assert "is no planned passage" in record.hello()["passage_said"]
    assert capsys.readouterr().err.count("\n") == 1
    planned_beside(mission_copy(folder)).unlink()
    assert read_record(folder).hello()["passage_said"] == ""


def test_a_passage_that_is_too_large_is_not_copied_and_the_mission_is(tmp_path):
    path = write_mission(tmp_path)
    planned_beside(path).write_bytes(b" " * (MOST_PASSAGE_BYTES + 1))
    with Recorder(tmp_path / "v") as recorder:
        assert write_copies(load_mission(path), recorder) == "mission/mission.toml"
    assert mission_copy(tmp_path / "v").is_file()
    assert not planned_beside(mission_copy(tmp_path / "v")).exists()


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


@pytest.mark.parametrize("is_named", [False, True])
def test_ashore_the_page_shows_what_the_radio_brings(is_named, tmp_path):
    """From the status alone, as ``companion status`` hears it; the passage is of a file, and without one it is said."""
    import threading

    import msgspec
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
    file = tmp_path / "m.passage.json"
    file.write_bytes(msgspec.json.encode(line_passage()))
    command = [sys.executable, "-m", "companion.cli", "view", "--link", f"udpin:127.0.0.1:{radio}", "--http", str(port)]
    command += ["--passage", str(file)] if is_named else []
    try:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as serving:
            assert serving.stdout.readline().startswith("http://")
            until_s = time.monotonic() + 20.0
            view = {"state": {"phase": ""}}
            while view["state"]["phase"] != "standard":
                assert time.monotonic() < until_s, view
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/stream", timeout=10) as stream:
                    for line in stream:
                        if line.startswith(b"data: ") and b"companion.view/2" in line:
                            view = json.loads(line[6:])
                            break
            assert (view["source"], view["orders"]["standing"]["verb"]) == ("radio", "hold")
            assert view["boat"]["at_en_m"] == [0.0, 0.0]
            assert view["laylines"] is None
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/hello") as answer:
                hello = json.load(answer)
            assert hello["passage"] is is_named
            assert ("a radio brings none" in hello["passage_said"]) is not is_named
            if is_named:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/passage") as answer:
                    assert json.load(answer)["name"] == "to the mark"
            os.kill(serving.pid, signal.SIGINT)
            assert serving.wait(10) == 0
    finally:
        over.set()
        speaking.join(5.0)

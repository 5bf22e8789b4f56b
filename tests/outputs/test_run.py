"""``companion run`` tells other displays: as the mission says, as its options say, from the first second on."""

import contextlib
import json
import os
import socket

import pytest

from companion import cli
from companion.compose import displays_of
from companion.geofence import load_mission
from companion.mission_check import require_sailable
from sitl.run.live import run_live
from sitl.scenario import TrueTrack, load_scenario
from sitl.scenario.traffic import free_port
from tests.outputs.signalk_server import MISSING, PROGRAM, Server

MISSION = """
name = "m"
[[goal]]
lat = 50.8190
lon = -1.3100
{output}
"""


@pytest.fixture
def hearing():
    """Two UDP sockets that hear."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
            each.settimeout(0.0)
        yield sockets


def mission(path, output=""):
    (path / "m.toml").write_text(MISSION.format(output=output))
    return path / "m.toml"


def run(path, *words):
    return cli.main(
        [
            "run",
            str(path),
            "--link",
            f"udpin:127.0.0.1:{free_port()}",
            "--wait",
            "1.5",
            "--out",
            str(path.parent / "v"),
            "--state",
            str(path.parent / "s.json"),
            *words,
        ]
    )


def lines(heard):
    out = []
    with contextlib.suppress(BlockingIOError):
        while True:
            out.append(heard.recv(2048).decode("ascii"))
    return out


def test_the_missions_displays_and_those_of_the_options_are_told(tmp_path, hearing, capfd):
    """No autopilot is there: they are told that there is no position."""
    first, second = (each.getsockname()[1] for each in hearing)
    path = mission(tmp_path, f'[output]\nnmea = ["udp:127.0.0.1:{first}"]')
    assert run(path, "--nmea", f"udp:127.0.0.1:{second}") == 1
    for heard in hearing:
        told = lines(heard)
        assert told
        assert all(line.startswith("$IIRMC,,V,") for line in told)
    assert f"note: NMEA 0183 udp:127.0.0.1:{second}: sending" in capfd.readouterr().out


def test_a_signal_k_server_that_is_not_there_is_told_of_once(tmp_path, capfd):
    port = free_port()
    assert run(mission(tmp_path), "--signalk", f"tcp:127.0.0.1:{port}") == 1
    said = capfd.readouterr().out
    assert said.count(f"note: Signal K tcp:127.0.0.1:{port}: nobody listens there; trying again") == 1


@pytest.mark.parametrize(
    ("output", "words", "says"),
    [
        (
            'nmea = ["udp:10110"]',
            (),
            "m.toml: [output] nmea: 'udp:10110' is no place to send NMEA 0183 to; write udp:HOST",
        ),
        (
            'signalk = ["http://h"]',
            (),
            "m.toml: [output] signalk: 'http://h' is no Signal K server; write ws://HOST:3000",
        ),
        ('signalk_token = "t"', (), "m.toml: [output] signalk_token: there is no WebSocket to use it on"),
        ("", ("--nmea", "tcp:x"), "--nmea: tcp:x: is no place to send NMEA 0183 to"),
        ("", ("--signalk", "h:3000"), "--signalk: h:3000: is no Signal K server"),
    ],
)
def test_what_cannot_be_told_is_refused_in_one_line(tmp_path, capfd, output, words, says):
    path = mission(tmp_path, f"[output]\n{output}" if output else "")
    assert run(path, *words) in {2, 66}
    said = capfd.readouterr().err
    assert says in said
    assert said.count("\n") == 1
    assert not (tmp_path / "v").exists()


def empty(path):
    path.touch(mode=0o600)


@pytest.mark.parametrize(
    ("make", "says", "where"),
    [
        (lambda path: None, "no such file", "mission"),
        (empty, "holds no token", "option"),
        (os.mkfifo, "cannot be read (it is a FIFO and no regular file)", "option"),
    ],
)
def test_without_a_token_that_can_be_used_a_server_is_told_without_one(tmp_path, capfd, make, says, where):
    """It was exit code 2 or 66: the boat stayed ashore for a display."""
    make(tmp_path / "t")
    server = f"ws://127.0.0.1:{free_port()}"
    path = mission(tmp_path, f'[output]\nsignalk = ["{server}"]\nsignalk_token = "t"' if where == "mission" else "")
    words = ("--signalk", server, "--signalk-token", str(tmp_path / "t")) if where == "option" else ()
    assert run(path, *words) == 1  # for want of an autopilot
    out, err = capfd.readouterr()
    assert f"sailed without the Signal K token: {tmp_path / 't'}: {says}" in err  # its name was said twice
    assert f"note: Signal K {server}: nobody listens there; trying again" in out
    records = (tmp_path / "v/decisions.jsonl").read_text()
    assert '"what":"Signal K token","gone":true' in records
    assert f'"what":"Signal K {server}","gone":true' in records


def test_mission_check_sees_it_too(tmp_path):
    path = mission(tmp_path, '[output]\nnmea = ["tcp:10110"]\nsignalk = ["ws://h"]\nsignalk_token = "t"')
    displays = displays_of(require_sailable(load_mission(path)))
    assert displays.token_file == tmp_path / "t"
    assert [name.host for name in displays.nmea] == ["127.0.0.1"]


@pytest.mark.signalk
@pytest.mark.skipif(PROGRAM is None, reason=MISSING)
def test_a_voyage_is_told_to_a_real_signal_k_server(tmp_path):
    """The demonstration, a minute and a half of it, at eight times its speed: what the server has at its end is what
    the voyage's own records say."""
    from pathlib import Path

    missions = Path("missions").resolve()
    with Server(tmp_path / "server") as server:
        text = (missions / "archipelago.toml").read_text()
        text = text.replace('"archipelago.wkt"', f'"{missions}/archipelago.wkt"').replace(
            '"archipelago-shore.wkt"', f'"{missions}/archipelago-shore.wkt"'
        )
        (tmp_path / "m.toml").write_text(f'{text}\n[output]\nsignalk = ["{server.ws}"]\n')
        (tmp_path / "s.toml").write_text(
            'name = "s"\nmission = "m.toml"\nlimit_s = 90.0\nspeedup = 8.0\n[wind]\nmodel = "ou"\nfrom_deg = 0.0\n'
            "tws_mps = 5.0\nsd_deg = 9.0\ntau_s = 28.0\n"
        )
        run_live(
            load_scenario(tmp_path / "s.toml"),
            tmp_path / "s.toml",
            0,
            tmp_path / "v",
            autopilot="embedded",
            program=None,
            speedup=None,
            truth=TrueTrack(),
        )
        told = {
            path: server.get(path)
            for path in (
                "navigation.position",
                "navigation.speedOverGround",
                "navigation.state",
                "environment.wind.directionTrue",
                "environment.wind.angleApparent",
                "navigation.courseGreatCircle.nextPoint.distance",
                "performance.polarSpeed",
                "steering.autopilot.state",
            )
        }
    assert all(value is not None and value["value"] is not None for value in told.values()), told
    assert {value["$source"] for value in told.values()} == {"sailboat-companion"}
    assert (told["navigation.state"]["value"], told["steering.autopilot.state"]["value"]) == ("sailing", "route")
    rows = (tmp_path / "v" / "track.csv").read_text().splitlines()
    names, last = rows[0].split(","), rows[-1].split(",")
    row = dict(zip(names, last, strict=True))
    position = told["navigation.position"]["value"]
    assert position["latitude"] == pytest.approx(float(row["lat_deg"]), abs=5e-5)
    assert position["longitude"] == pytest.approx(float(row["lon_deg"]), abs=5e-5)
    summary = json.loads((tmp_path / "v" / "summary.json").read_text())
    assert summary["loop_held_max_s"] < 0.25

"""``sitl boat`` from the command line: options, endpoints, ends."""

from __future__ import annotations

import socket
import subprocess
import sys
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.cli import main
from tests.sitl.boats import boat_process, free_port


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--wind", "storm"], "--wind: storm: is not a wind"),
        (["--home", "143,5"], "--home: latitude 143.0 is outside"),
        (["--home", "51.1"], "write LAT,LON"),
        (["--speedup", "0"], "--speedup: 0 is out of range"),
        (["--param", "WP_SPEED"], "write NAME=VALUE"),
        (["--param", "WP_SPED=1"], "did you mean WP_SPEED?"),
        (["--param", "WP_SPEED=nan"], "cannot be a parameter"),
        (["--sysid", "300"], "--sysid: 300 is out of range"),
        (["--port", "0", "--udp", "0"], "nobody could reach the boat"),
        (["--wind", "none.csv"], "none.csv: no such file"),
        (["--udp-out", "nowhere"], "host or port is missing"),
    ],
)
def test_bad_options_are_one_line_and_exit_2(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["boat", *options]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_help_names_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["boat", "--help"])
    assert end.value.code == 0
    assert "sitl boat --warm" in capsys.readouterr().out


def test_a_taken_port_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert main(["boat", "--port", port, "--udp", "0", "--for", "1"]) == 1
    assert "another boat may be running" in capsys.readouterr().err


def test_it_speaks_first_and_ends_by_itself() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(120.0)  # its kernels may have to be compiled first
        port = listener.getsockname()[1]
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "sitl.cli",
                "boat",
                "--port",
                "0",
                "--udp",
                "0",
                "--udp-out",
                f"127.0.0.1:{port}",
                "--warm",
                "--speedup",
                "20",
                "--for",
                "20",
                "--sysid",
                "7",
            ],
            stdout=subprocess.DEVNULL,
        )
        try:
            data, _ = listener.recvfrom(4096)
            began = time.monotonic()
            assert mav.MAVLink(None).parse_buffer(data)[0].get_srcSystem() == 7
        finally:
            assert process.wait(60.0) == 0
        assert time.monotonic() - began < 20.0


def test_speedup_and_two_clients_on_udp_and_tcp() -> None:
    with boat_process("--warm", "--speedup", "10") as (host, tcp, udp):
        stream = socket.create_connection((host, tcp), timeout=5.0)
        datagram = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        datagram.connect((host, udp))
        datagram.settimeout(5.0)
        codec = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        datagram.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(codec))
        parser = mav.MAVLink(None)
        parser.robust_parsing = True
        heard: list[tuple[float, float]] = []
        while len(heard) < 25:
            for m in parser.parse_buffer(stream.recv(65536)) or ():
                if m.get_type() == "SYSTEM_TIME":
                    heard.append((time.monotonic(), m.time_boot_ms / 1000.0))
        speed = (heard[-1][1] - heard[2][1]) / (heard[-1][0] - heard[2][0])
        assert speed == pytest.approx(10.0, rel=0.3)
        assert datagram.recv(65536)
        datagram.close()
        stream.close()
        # one that leaves does not disturb the other, and may come back
        again = socket.create_connection((host, tcp), timeout=5.0)
        assert again.recv(10)
        again.close()


def test_free_ports_differ() -> None:
    assert free_port(socket.SOCK_STREAM) > 0

"""`companion mission edit` as a user meets it: one line where something is wrong, an address, and a clean end."""

import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from companion import cli


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[goal]\nlat = 1\n", "is not TOML"),
        ("[[goal]]\nlat = 1.0\nlon = 2.0\nradius = 3\n", "did you mean 'radius_m'?"),
        ('[area]\nobstacles = ["gone.wkt"]\n', "no such file"),
        ("from_autopilot = true\n", "drawn on the autopilot"),
        ("\x00", "holds binary data"),
    ],
)
def test_a_file_that_cannot_be_believed_is_one_line_and_stays(capsys, tmp_path, text, words):
    path = tmp_path / "m.toml"
    path.write_text(text)
    assert cli.main(["mission", "edit", str(path)]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert path.read_text() == text


def test_a_name_that_is_no_mission_and_a_folder_that_is_not_there(capsys, tmp_path):
    assert cli.main(["mission", "edit", "drawing.plan"]) == 2
    assert "companion mission new" in capsys.readouterr().err
    assert cli.main(["mission", "edit", str(tmp_path / "no" / "m.toml")]) == 2
    assert "folder is not there" in capsys.readouterr().err
    assert cli.main(["mission", "edit", str(tmp_path)]) == 2
    told = f"companion mission: {tmp_path}: is a folder; name the TOML file of a mission in it\n"
    assert capsys.readouterr().err == told


def test_a_port_in_use_is_one_line(capsys, tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert cli.main(["mission", "edit", str(tmp_path / "m.toml"), "--http", str(port)]) == 1
    assert "the port is in use" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_it_says_where_it_is_and_ends_when_it_is_told_to(tmp_path, end):
    done = subprocess.Popen(
        [sys.executable, "-m", "companion.cli", "mission", "edit", str(tmp_path / "m.toml")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
    )
    try:
        line = done.stdout.readline()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#[\w-]{32}  \(Ctrl-C ends it\)\n", line), line
        done.send_signal(end)
        out, err = done.communicate(timeout=20.0)
    finally:
        done.kill()
        done.communicate()
    assert (out, err, done.returncode) == ("", "", 0)
    assert list(tmp_path.iterdir()) == []


def test_the_check_names_the_editor_where_something_is_wrong(capsys, tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(
        "[start]\nlat = 50.0\nlon = 1.0\n[[goal]]\nlat = 50.004\nlon = 1.0\n"
        '[area]\nobstacles = ["wall.wkt"]\nfence = "pond.wkt"\n'
    )
    (tmp_path / "wall.wkt").write_text("POLYGON ((0.99 50.002, 1.01 50.002, 1.01 50.003, 0.99 50.003, 0.99 50.002))\n")
    (tmp_path / "pond.wkt").write_text(
        "POLYGON ((0.995 49.999, 1.005 49.999, 1.005 50.005, 0.995 50.005, 0.995 49.999))\n"
    )
    assert cli.main(["mission", "check", str(path)]) == 1
    assert f"companion mission edit {path}" in capsys.readouterr().out

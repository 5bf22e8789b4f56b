"""``companion run --http`` and ``sitl run --http``: what is refused, and that no page is worth a voyage."""

import argparse
import os
import socket
import stat
from pathlib import Path

import pytest

from companion import cli
from companion.page import read_token
from sitl import cli as sitl_cli
from sitl.commands.run import page_words
from sitl.scenario.traffic import free_port
from tests.view.conftest import write_mission


def tried(tmp_path, *words):
    """Run without an autopilot: what is wrong with the page is told before, or sailed without."""
    return cli.main(
        [
            "run",
            str(write_mission(tmp_path)),
            "--link",
            f"udpin:127.0.0.1:{free_port()}",
            "--wait",
            "0.3",
            "--out",
            str(tmp_path / "v"),
            "--state",
            str(tmp_path / "s.json"),
            *map(str, words),
        ]
    )


@pytest.mark.parametrize(
    "words",
    [
        ("--http-token", "t"),
        ("--http-name", "boat.local"),
        ("--chart", "a.mbtiles"),
        ("--http", "x"),
        ("--http", "127.0.0.1:99999"),
    ],
)
def test_a_page_that_cannot_be_is_one_line(words, tmp_path, capfd):
    code = tried(tmp_path, *words)
    err = capfd.readouterr().err
    assert (code, err.count("\n")) in {(2, 1), (66, 1)}
    assert not (tmp_path / "v").exists()


def fifo(path):
    os.mkfifo(path, 0o600)


def readable(path):
    path.write_text("a-token-of-enough-characters\n")
    path.chmod(0o644)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (readable, "chmod 600"),
        (fifo, "it is a FIFO and no regular file"),
        (Path.mkdir, "is a folder; "),
        (lambda path: path.write_text("short"), "can be read by others"),
        (lambda path: None, "no such file"),
    ],
)
def test_with_a_token_that_cannot_be_used_she_is_sailed_and_the_page_takes_no_orders(make, says, tmp_path, capfd):
    """It was exit code 2 or 66: the boat stayed ashore for a page."""
    token = tmp_path / ("token" if says != "no such file" else "no/such/folder/token")
    make(token)
    assert tried(tmp_path, "--http", free_port(), "--http-token", token) == 1  # for want of an autopilot
    err = capfd.readouterr().err
    assert err.count("note: sailed without the orders on the page: ") == 1
    assert says in err
    assert '"what":"orders on the page"' in (tmp_path / "v" / "decisions.jsonl").read_text()


@pytest.mark.parametrize("left", [b"", b"\n", b"\0" * 33])
def test_a_token_that_a_power_cut_left_empty_is_made_anew(left, tmp_path):
    token = tmp_path / "token"
    token.write_bytes(left)
    token.chmod(0o644)
    assert len(read_token(token)) >= 32
    assert stat.S_IMODE(token.stat().st_mode) == 0o600


def test_with_its_port_in_use_she_is_sailed_without_a_page(tmp_path, capfd):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert tried(tmp_path, "--http", port) == 1  # for want of an autopilot, not of a page
    out, err = capfd.readouterr()
    assert out.count("sailing on without the live page: ") == 1
    assert "in use" in out
    assert "no autopilot" in err or "heard" in err
    assert '"what":"live page"' in (tmp_path / "v" / "decisions.jsonl").read_text()


def test_without_a_chart_that_is_none_she_is_sailed_all_the_same(tmp_path, capfd):
    """It is asked for again at every start of a service: a card that has lost it keeps no boat ashore."""
    chart = tmp_path / "a.mbtiles"
    chart.write_bytes(b"KAP")
    assert tried(tmp_path, "--http", free_port(), "--chart", chart, "--chart", tmp_path / "none.pmtiles") == 1
    err = capfd.readouterr().err
    assert err.count("she is sailed without this chart") == 2
    assert "gdal_translate" in err


def test_a_simulated_voyage_is_told_of_its_charts(tmp_path, capsys):
    assert sitl_cli.main(["run", "demo", "--live", "--chart", str(tmp_path / "a.mbtiles")]) == 2
    assert "--http PORT" in capsys.readouterr().err
    args = argparse.Namespace(
        http=("127.0.0.1", 8765),
        http_token=None,
        live=True,
        autopilot="embedded",
        cpu=None,
        chart=[Path("a.mbtiles"), Path("b.pmtiles")],
    )
    assert page_words(args)[-4:] == ["--chart", "a.mbtiles", "--chart", "b.pmtiles"]


def test_a_token_is_made_and_its_file_is_its_owners(tmp_path, capsys):
    token = tmp_path / "token"
    tried(tmp_path, "--http", free_port(), "--http-token", token)
    capsys.readouterr()
    assert stat.S_IMODE(token.stat().st_mode) == 0o600


def test_under_the_virtual_clock_no_browser_can_be_waited_for(tmp_path, capsys):
    write_mission(tmp_path)
    (tmp_path / "s.toml").write_text('name = "s"\nmission = "mission.toml"\n')
    assert sitl_cli.main(["run", str(tmp_path / "s.toml"), "--http", "8765", "--out", str(tmp_path / "v")]) == 2
    err = capsys.readouterr().err
    assert "--live" in err
    assert err.count("\n") == 1

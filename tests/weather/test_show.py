"""``companion weather show``: what, where, when, members and holes, in lines; or one line that says what is wrong."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from companion import cli
from companion.weather import Weather
from companion.weather.told import told_at
from tests.passage.world import LAT as LAT0
from tests.passage.world import LON as LON0
from tests.passage.world import cube, steady
from tests.weather.grib_file import GUST, message_2, wind_2

LAT, LON = np.linspace(48.0, 52.0, 5), np.linspace(-8.0, 2.0, 11)


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    """A folder with a forecast of two members, a hole and gusts; and what the command answers."""
    monkeypatch.chdir(tmp_path)
    data = [
        wind_2(LAT, LON, h, 0.0, -4.0 - m, member=m) for h in (0, 3, 6, 12, 15, 18) for m in (1, 2) if (h, m) != (15, 2)
    ]
    data += [message_2(GUST, np.full((5, 11), 9.0), LAT, LON, h, over_h=3) for h in (3, 6)]
    data += [message_2((0, 3, 1), np.full((5, 11), 101_300.0), LAT, LON, level=(101, 0))]
    (tmp_path / "f.grb2").write_bytes(b"".join(data))

    def run(*words):
        code = cli.main(["weather", "show", *map(str, words)])
        said = capsys.readouterr()
        lines = said.err.splitlines(keepends=True)
        return code, said.out, "".join(line for line in lines if not line.startswith("note: "))  # a loaded machine

    return run


def test_what_a_file_holds_is_said(shell):
    code, out, err = shell("f.grb2")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "wind of 10 m: 2026-04-20T00:00Z to 2026-04-20T18:00Z, 6 times every 3 h, 2 members",
        "  48.00 N to 52.00 N, 8.00 W to 2.00 E; a value every 1 x 1 degrees (5 x 11)",
        "  run of 2026-04-20T00:00Z: 2026-04-20T00:00Z to 2026-04-20T18:00Z",
        "  hole: nothing between 2026-04-20T06:00Z and 2026-04-20T12:00Z, 6 h",
        "  hole: 1 time of single members missing",
        "  not known: 8.3 % of it",
        "gust: 2026-04-20T03:00Z to 2026-04-20T06:00Z, 2 times every 3 h",
        "  48.00 N to 52.00 N, 8.00 W to 2.00 E; a value every 1 x 1 degrees (5 x 11)",
        "  the strongest of 3 h before each time",
        "  run of 2026-04-20T00:00Z: 2026-04-20T03:00Z to 2026-04-20T06:00Z",
        "not used: sea level pressure",
    ]


def test_the_hours_of_a_place(shell):
    code, out, _ = shell("f.grb2", "--at", "50.2,-3.1")
    assert code == 0
    assert out.splitlines()[-6:-4] == [
        "2026-04-20T00:00Z  5.5 (5.1-5.9) from 000  ?  -",
        "2026-04-20T03:00Z  5.5 (5.1-5.9) from 000  9.0  -",
    ]


def test_a_part_of_it(shell):
    _, out, _ = shell("f.grb2", "--box", "49.5,-4.2,50.5,-3.5")
    assert "49.00 N to 51.00 N, 5.00 W to 3.00 W" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["f.grb2", "--at", "10,10"], "f.grb2: --at: 10, 10 is outside of it; ask within its area"),
        (["none.grb"], "none.grb: no such file; check the path"),
        (["f.grb2", "--box", "10,10,20,20"], ("f.grb2: holds no wind of 10 m, no gust, no waves and no current there; "
         "not used: sea level pressure; ask for 10u and 10v of the area")),
        (["f.grb2", "--plot", "x.png", "--time", "2026-04-22T00:00Z"],
         "f.grb2: --time: is not within it; say another, or leave it out for its first"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(shell, words, said):
    code, _, err = shell(*words)
    assert (code, err) == (2, f"companion weather: {said}\n")


def test_the_picture_is_drawn(shell, tmp_path):
    code, out, err = shell("f.grb2", "--at", "50,-3", "--plot", "w.png", "--time", "2026-04-20T04:00Z")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == "w.png: written"
    assert (tmp_path / "w.png").stat().st_size > 20_000


def test_a_packing_that_needs_the_extra_says_so(tmp_path):
    """Section 5 says JPEG 2000: without the library it is one line, simple packing is read all the same."""
    good = wind_2(LAT, LON, 0, 1.0, 2.0)
    (tmp_path / "simple.grb").write_bytes(good)
    at = good.index(b"\x05\x00\x00\x00\x37\x00\x00")
    (tmp_path / "jpeg.grb").write_bytes(good[: at + 5] + b"\x00\x28" + good[at + 7 :])
    alone = "import sys; sys.modules['gribberish'] = None; from companion.cli import main; sys.exit(main())"
    said = [
        subprocess.run(
            [sys.executable, "-c", alone, "weather", "show", name],
            cwd=tmp_path,
            text=True,
            capture_output=True,
            check=False,
            env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        )
        for name in ("simple.grb", "jpeg.grb")
    ]
    assert (said[0].returncode, said[0].stderr) == (0, "")
    assert (said[1].returncode, said[1].stderr) == (
        1,
        (
            "companion weather: gribberish is not installed, which this needs; "
            "in the clone of this project: pip install '.[weather]'\n"
        ),
    )


def test_a_current_alone_is_told_by_its_hours_and_what_is_not_known_of_it():
    """Of a file of currents a header was printed and no line; of one without a number "nan to ?"."""
    told = told_at(Weather(wind=(), current=(cube(LAT0, LON0, [0.0, 1.0], steady(0.3, 0.0)),)), 0.0, 0.0)
    assert len(told) == 3
    assert all("0.30 to 090" in line for line in told[1:])
    unknown = told_at(Weather(wind=(), current=(cube(LAT0, LON0, [0.0, 1.0], steady(np.nan, np.nan)),)), 0.0, 0.0)
    assert all(line.endswith("?") for line in unknown[1:])

"""``companion boat``: guessed, shown, compared, exported, and sailed by a mission."""

import tomllib

import pytest

from companion.boat import read_polar
from companion.cli import main
from companion.geofence.mission import read_boat_file

SIZES = ["--length", "1.5", "--displacement", "20", "--sail-area", "0.9"]


def test_what_is_guessed_is_shown_drawn_and_written_for_opencpn(tmp_path, capsys):
    file = tmp_path / "pepper.toml"
    assert main(["boat", "guess", *SIZES, "--out", str(file)]) == 0
    assert read_boat_file(file).made.endswith("1.5 m, 20 kg, 0.9 m2")
    assert read_boat_file(file).name == "pepper"
    assert main(["boat", "guess", *SIZES, "--out", str(file)]) == 2  # it is there
    assert main(["boat", "show", str(file), "--plot", str(tmp_path / "p.png"), "--pol", str(tmp_path / "p.pol")]) == 0
    assert (tmp_path / "p.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "best beat [deg]" in said
    assert "35 %" in said
    middle = read_polar(tmp_path / "p.pol").polar.speed_mps(1.5, 3.0)
    assert main(["boat", "show", str(file), "--pol", str(tmp_path / "p.pol"), "--quantile", "0.1", "--force"]) == 0
    assert read_polar(tmp_path / "p.pol").polar.speed_mps(1.5, 3.0) == pytest.approx(0.639 * middle, rel=0.02)


def test_a_guess_without_a_file_is_printed_whole(capsys):
    assert main(["boat", "guess", *SIZES, "--name", 'a "boat"', "--beam", "0.4"]) == 0
    told = tomllib.loads(capsys.readouterr().out)
    assert told["name"] == 'a "boat"'
    assert told["boat"]["beam_m"] == 0.4


def test_two_boats_are_compared_in_the_winds_of_the_first(tmp_path, capsys):
    (tmp_path / "a.pol").write_text("TWA\\TWS;4;8\n60;2;4\n120;3;5\n")
    (tmp_path / "b.pol").write_text("TWA\\TWS;4;8\n60;3;4\n120;3;5\n")
    assert main(["boat", "compare", str(tmp_path / "a.pol"), str(tmp_path / "b.pol")]) == 0
    rows = {line.split()[0]: line.split()[1:] for line in capsys.readouterr().out.splitlines() if line[:3] == "  6"}
    assert rows == {"60": ["+50", "+0"]}


@pytest.mark.parametrize(
    "words",
    [
        ["guess", "--length", "1.5", "--displacement", "2000", "--sail-area", "0.9"],
        ["show", "nowhere.toml"],
        ["compare", "ardurover", "nowhere.pol"],
    ],
)
def test_what_cannot_be_is_one_line(words, capsys):
    assert main(["boat", *words]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1

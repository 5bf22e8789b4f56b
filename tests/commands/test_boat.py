"""``companion boat``: guessed, shown, compared, exported, and sailed by a mission."""

import json
import math
import tomllib
from pathlib import Path

import pytest

from companion.boat import Boat, Sizes, guessed, read_polar
from companion.cli import main
from companion.compose import polar_of_file, whole_polar
from companion.geofence.mission import read_boat_file
from lab.simulated_logs import Truth, sailed

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
    assert main(["boat", "show", str(file), "--signalk", str(tmp_path / "p.json")]) == 0
    assert main(["boat", "show", str(file), "--orc", str(tmp_path / "p.csv")]) == 0
    assert (tmp_path / "p.csv").read_text().startswith("TWA/TWS,4,6,")
    (told,) = json.loads((tmp_path / "p.json").read_text()).values()
    winds = {w["trueWindSpeed"]: dict(w["angleData"]) for w in told["windData"]}
    polar = polar_of_file(read_boat_file(file), "")
    sailed_by = Boat(polar=polar, leeway_rad=math.radians(5.0))
    assert told["name"] == "pepper"
    for wind, speeds in winds.items():
        assert speeds == pytest.approx({round(a, 4): polar.speed_mps(a, wind) for a in polar.twa_rad}, abs=0.001)
        best = next(w for w in told["windData"] if w["trueWindSpeed"] == wind)["optimalBeats"][0]
        assert best == pytest.approx(
            [sailed_by.best_beat(wind).twa_rad, sailed_by.best_beat(wind).speed_mps], abs=0.001
        )
        assert best[0] > math.radians(44.9)  # not inside her no-go zone
    middle = read_polar(tmp_path / "p.pol").polar.speed_mps(1.5, 3.0)
    capsys.readouterr()
    assert main(["boat", "show", str(file), "--quantile", "0.1"]) == 2
    assert "--quantile: is of the speeds in a file, and none is asked for; say --pol" in capsys.readouterr().err
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
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("how much faster")
    rows = {line.split()[0]: line.split()[1:] for line in lines if line[:3] == "  6"}
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


def season(folder, days=2):
    """Write logs of a boat that is three tenths slower than its guess, as CSV; one without wind beside them."""
    folder.mkdir()
    for day in range(days):
        log = sailed(Truth(scale=0.7), hours=0.5, seed=day, t0_s=1.75e9 + 86_400.0 * day)
        rows = [
            f"{t:.0f},{math.degrees(h):.2f},{math.degrees(math.atan2(*v)):.2f},{math.hypot(*v):.3f},"
            f"{math.degrees(a):.2f},{s:.3f}"
            for t, h, v, a, s in zip(
                log.t_s, log.heading_rad, log.velocity_en_mps.tolist(), log.awa_rad, log.aws_mps, strict=True
            )
        ]
        (folder / f"day{day}.csv").write_text("t_s,heading_deg,cog_deg,sog_mps,awa_deg,aws_mps\n" + "\n".join(rows))
    (folder / "calm.csv").write_text("t_s,heading_deg,cog_deg,sog_mps\n" + "\n".join(f"{t},9,8,1.0" for t in range(99)))
    return folder


def test_a_folder_without_logs_is_named(tmp_path, capsys):
    """ "there is no log in there" was all that was said."""
    guess, logs = tmp_path / "pepper.toml", tmp_path / "logs"
    assert main(["boat", "guess", *SIZES, "--out", str(guess)]) == 0
    logs.mkdir()
    assert main(["boat", "learn", str(logs), "--from", str(guess), "--out", str(tmp_path / "p2.toml")]) == 1
    told = f"companion boat: {logs}: no log is in there; give voyage folders, .tlog, .BIN, CSV or NMEA\n"
    assert capsys.readouterr().err == told


@pytest.mark.parametrize("name", ["log", "log.csv", "log.BIN", "log.tlog"])
def test_an_empty_log_and_an_empty_boat_file_are_called_so(tmp_path, monkeypatch, capsys, name):
    """ "it tells the boat's speed in 0 of 0 samples", and that the boat has no name, was said."""
    monkeypatch.chdir(tmp_path)
    assert main(["boat", "guess", *SIZES, "--out", "pepper.toml"]) == 0
    Path(name).touch()
    assert main(["boat", "learn", name, "--from", "pepper.toml", "--out", "p2.toml"]) == 1
    told = f"companion boat: {name}: it is empty; give voyage folders, .tlog, .BIN, CSV or NMEA"
    assert capsys.readouterr().err.splitlines()[-1] == told
    Path("none.toml").touch()
    assert main(["boat", "learn", name, "--from", "none.toml", "--out", "p2.toml"]) == 2
    assert capsys.readouterr().err == "companion boat: none.toml: is empty; companion boat guess writes one\n"


def test_a_boat_is_learned_from_its_logs_and_sailed_by_a_mission(tmp_path, capsys):
    guess, out = tmp_path / "pepper.toml", tmp_path / "learned.toml"
    assert main(["boat", "guess", *SIZES, "--out", str(guess)]) == 0
    logs = season(tmp_path / "logs")
    assert main(["boat", "learn", str(logs), "--from", str(guess), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "calm.csv: it tells the wind in 0 of 99 samples" in said.out
    assert "reading 3 of 3" in said.err
    boat = read_boat_file(out)
    assert (boat.name, boat.learned.version, len(boat.learned.logs), len(boat.learned.skipped)) == ("pepper", 1, 2, 1)
    assert boat.boat.length_m == 1.5
    assert boat.boat.speed_error_percent < 12.0
    true = 0.7 * guessed(Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9)).polar.speed_mps(1.57, 4.0)
    assert polar_of_file(boat, "").speed_mps(1.57, 4.0) == pytest.approx(true, rel=0.08)
    assert main(["boat", "show", str(out), "--plot", str(tmp_path / "p.png")]) == 0
    said = capsys.readouterr().out
    assert "stretches of steady sailing; left out:" in said
    assert "tacks, wind [m/s]" in said
    # Learned once more it is a new version, and the old one is kept; what it was learned from counts no second time.
    assert main(["boat", "learn", str(logs), "--from", str(guess), "--out", str(out)]) == 2
    assert main(["boat", "learn", str(logs), "--from", str(guess), "--out", str(out), "--force"]) == 0
    assert read_boat_file(out).learned.version == 2
    assert read_boat_file(tmp_path / "learned.v1.toml") == boat
    assert main(["boat", "learn", str(logs), "--from", str(out), "--out", str(tmp_path / "x.toml")]) == 1
    assert "was learned from it already" in capsys.readouterr().out


@pytest.mark.parametrize("what", ["nothing", "nowhere", "little"])
def test_logs_that_teach_nothing_are_one_line(tmp_path, capsys, what):
    guess = tmp_path / "pepper.toml"
    assert main(["boat", "guess", *SIZES, "--out", str(guess)]) == 0
    folder = tmp_path / "logs"
    if what != "nowhere":
        folder.mkdir()
    if what == "little":
        lines = [f"{t},90,90,1.0,80,4.0" for t in range(120)]
        (folder / "a.csv").write_text("t_s,heading_deg,cog_deg,sog_mps,awa_deg,aws_mps\n" + "\n".join(lines))
    code = main(["boat", "learn", str(folder), "--from", str(guess), "--out", str(tmp_path / "o.toml")])
    assert code == (2 if what == "nowhere" else 1)
    told = [line for line in capsys.readouterr().err.splitlines() if "reading" not in line and "learning" not in line]
    assert len(told) == 1
    assert not (tmp_path / "o.toml").exists()


def test_a_polar_with_a_gap_is_refused_here_too(tmp_path, capsys):
    """It was shown with a guess in the gap, and exported, without a word."""
    (tmp_path / "x.pol").write_text("TWA\\TWS;6;10;12\n45;3.0;4.0;4.2\n90;2.8;0;3.9\n150;3.5;4.5;4.6\n")
    assert main(["boat", "show", str(tmp_path / "x.pol")]) == 2
    assert "x.pol: line 3, column 3: a bare 0 is taken as not known" in capsys.readouterr().err


def test_the_simulated_boat_takes_a_boat_file(tmp_path):
    file = tmp_path / "pepper.toml"
    assert main(["boat", "guess", *SIZES, "--out", str(file)]) == 0
    assert whole_polar(file) == polar_of_file(read_boat_file(file), str(file))

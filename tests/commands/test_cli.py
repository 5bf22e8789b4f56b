"""The command lines: help for everything, one line for what is wrong, the exit code that was promised."""

import json
import logging
import re
import socket
import subprocess
import sys
import time
from argparse import ArgumentTypeError
from pathlib import Path

import pytest

from companion import cli
from companion.program import control
from companion.program.arguments import out_file, out_folder
from sitl import cli as sitl_cli
from sitl.scenario.traffic import free_port

GOOD = Path("missions/archipelago.toml").read_text()


@pytest.mark.parametrize("command", sorted(cli.PROGRAM.commands))
def test_every_companion_command_has_help(command, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main([command, "--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert f"companion {command}" in text
    assert len(text) > 300


@pytest.mark.parametrize("command", ["boat", "run", "campaign", "fetch"])
def test_every_sitl_command_has_help(command, capsys):
    with pytest.raises(SystemExit) as end:
        sitl_cli.main([command, "--help"])
    assert end.value.code == 0
    assert f"sitl {command}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["convert", "a.wkt", "b.plan"], "did you mean `companion fence convert` or `companion mission convert`?"),
        (["new", "a.toml"], "did you mean `companion mission new`"),
        (["replai", "v"], "did you mean `companion replay`?"),
        (["sail"], "there are run, plan, wind"),
        (["doctor", "--link", "udpin:127.0.0.1:1", "syd.toml"], "a mission is given as --mission syd.toml"),
        (["doctor", "--link", "udpin:127.0.0.1:1", "--aply"], "did you mean --apply?"),
    ],
)
def test_who_slips_is_told_in_one_line_what_was_meant(words, meant, capsys):
    assert cli.main(words) == 2
    error = capsys.readouterr().err
    assert meant in error
    assert error.count("\n") == 1


def test_no_command_is_bad_usage():
    assert cli.main([]) == 2


def mission(folder, text=GOOD, obstacles=None):
    for name in ("archipelago.wkt", "archipelago-shore.wkt"):
        (folder / name).write_text(Path("missions", name).read_text())
    if obstacles is not None:
        (folder / "archipelago.wkt").write_text(obstacles)
    (folder / "holes.pol").write_text("TWA;4;6;8\n45;2.1;3.0;3.6\n90;2.8\n150;2.0;2.9;3.6\n")
    (folder / "m.toml").write_text(text)
    return folder / "m.toml"


RING = "-1.3105 50.8180, -1.3095 50.8180, -1.3095 50.8190, -1.3105 50.8190"
BAD = [
    ("unknown key", GOOD.replace("margin_m", "marginn_m"), None, "marginn_m"),
    (
        "goal inside an obstacle",
        GOOD,
        "POLYGON ((-1.311 50.82, -1.309 50.82, -1.309 50.821, -1.311 50.821, -1.311 50.82))",
        "goal",
    ),
    ("empty", GOOD, "POLYGON EMPTY", "archipelago.wkt"),
    (
        "self-crossing",
        GOOD,
        "POLYGON ((-1.3105 50.818, -1.3095 50.819, -1.3095 50.818, -1.3105 50.819, -1.3105 50.818))",
        "archipelago.wkt",
    ),
    ("unclosed", GOOD, f"POLYGON (({RING}))", "archipelago.wkt"),
    (
        "swapped axes",
        GOOD,
        "POLYGON ((50.818 -1.3105, 50.818 -1.3095, 50.819 -1.3095, 50.818 -1.3105))",
        "archipelago.wkt",
    ),
    ("a polar with holes", GOOD + "\n[boat]\npolar = 'holes.pol'\n", None, "holes.pol"),
    ("no such polar", GOOD + "\n[boat]\npolar = 'fast'\n", None, "polar"),
    ("not TOML", "goal = [", None, "m.toml"),
]


@pytest.mark.parametrize(("what", "text", "obstacles", "words"), BAD, ids=[b[0] for b in BAD])
def test_a_bad_mission_is_one_line_and_nothing_is_sent(tmp_path, capsys, what, text, obstacles, words):
    path = mission(tmp_path, text, obstacles)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.setblocking(False)
        link = f"udpout:127.0.0.1:{autopilot.getsockname()[1]}"
        code = cli.main(["run", str(path), "--link", link, "--out", str(tmp_path / "v"), "--wait", "1"])
        error = capsys.readouterr().err
        if code == 1:
            # Repaired with a note (an unclosed ring): then it is the link that is missing.
            assert "note:" in error, what
            assert words in error.splitlines()[0]
        else:
            assert code == 2, what
            assert words in error
            assert len(error.strip().splitlines()) == 1, error
            with pytest.raises(BlockingIOError):
                autopilot.recv(2000)


def test_what_is_found_in_a_mission_is_told_in_the_words_of_its_check(tmp_path, capfd):
    """`run` printed "note: Finding(severity=<Severity.NOTE ...": what Python calls it."""
    path = mission(tmp_path, re.sub("(?m)^name = .*", 'name = "a/b"', GOOD, count=1))
    assert (
        cli.main(
            ["run", str(path), "--link", f"udpin:127.0.0.1:{free_port()}", "--out", str(tmp_path / "v"), "--wait", "1"]
        )
        == 1
    )
    said = capfd.readouterr().err.splitlines()[0]
    assert said.startswith(f"companion run: {path}: name: warning: 'a/b' cannot be part of a file's name")
    cli.main(["mission", "check", str(path)])
    assert capfd.readouterr().out.splitlines()[0] == said.removeprefix("companion run: ")


def test_a_link_that_never_answers_is_one_line(tmp_path, capsys):
    path = mission(tmp_path)
    code = cli.main(
        ["run", str(path), "--link", f"udpin:127.0.0.1:{free_port()}", "--out", str(tmp_path / "v"), "--wait", "1"]
    )
    error = capsys.readouterr().err
    assert code == 1
    assert "no autopilot" in error
    assert len(error.strip().splitlines()) == 1


@pytest.mark.parametrize("link", ["", "udpin:nowhere", "tcp:host:99999", "/dev/ttyNope:fast"])
def test_a_bad_link_is_bad_usage(tmp_path, capsys, link):
    assert cli.main(["run", str(mission(tmp_path)), "--link", link, "--out", str(tmp_path / "v")]) == 2
    assert "--link" in capsys.readouterr().err


def test_a_bad_feed_is_bad_usage(tmp_path, capsys):
    path = str(mission(tmp_path))
    assert (
        cli.main(
            [
                "run",
                path,
                "--link",
                f"udpin:127.0.0.1:{free_port()}",
                "--feed",
                "udpin:127.0.0.1:10110",
                "--feed",
                "radio",
            ]
        )
        == 2
    )
    assert "companion run: --feed: radio: is not a feed" in capsys.readouterr().err


def test_a_sounder_that_is_no_feed_is_bad_usage(tmp_path, capsys):
    link = f"udpin:127.0.0.1:{free_port()}"
    assert cli.main(["run", str(mission(tmp_path)), "--link", link, "--sounder", "radio"]) == 2
    assert "companion run: --sounder: radio: is not a feed" in capsys.readouterr().err


def test_a_scenario_is_not_sailed_into_the_folder_of_another_voyage(tmp_path, capsys):
    (tmp_path / "decisions.jsonl").touch()
    before = sorted(tmp_path.iterdir())
    assert sitl_cli.main(["run", "sitl/scenarios/demo.toml", "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "holds a voyage already" in error
    assert len(error.strip().splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("autopilot", "event"),
    [(["--live"], "gps_jump"), (["--cpu", "0.5"], "gps_jump"), (["--autopilot", "ardurover"], "kill_planner")],
)
def test_a_scenario_that_cannot_be_played_live_says_so_first(tmp_path, capsys, autopilot, event):
    mission = Path("missions/archipelago.toml").resolve()
    path, out = tmp_path / "odd.toml", tmp_path / "voyage"
    path.write_text(f'name = "odd"\nmission = "{mission}"\n[[events]]\nat_s = 9.0\nkind = "{event}"\n')
    assert sitl_cli.main(["run", str(path), *autopilot, "--out", str(out)]) == 1
    told = f"odd: {event} can be played by the embedded autopilot only; leave out {autopilot[0]}"
    assert told in capsys.readouterr().err
    assert not out.exists()


def test_report_and_replay_of_a_folder_that_is_none(tmp_path, capsys):
    for command in ("report", "replay"):
        assert cli.main([command, str(tmp_path)]) == 2
        assert "is missing" in capsys.readouterr().err


def test_status_without_a_companion_exits_3(capsys):
    assert cli.main(["status", "--link", f"udpin:127.0.0.1:{free_port()}", "--once", "--timeout", "1"]) == 3
    assert "heard" in capsys.readouterr().err


def test_the_shore_hears_the_companion_through_the_autopilot(tmp_path):
    """Three processes: simulated autopilot, companion, and the shore on another link of the autopilot."""
    port, shore = free_port(), free_port()
    boat = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "sitl.run.live_boat",
            "sitl/scenarios/demo.toml",
            "--speedup",
            "8",
            "--endpoint",
            f"udpout:127.0.0.1:{port}",
            "--endpoint",
            f"udpin:127.0.0.1:{shore}",
        ]
    )
    companion = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "companion.cli",
            "run",
            "missions/archipelago.toml",
            "--link",
            f"udpin:127.0.0.1:{port}",
            "--out",
            str(tmp_path / "v"),
            "--state",
            str(tmp_path / "state.json"),
            "--speedup",
            "8",
            "--dry-run",
        ],
        stdout=subprocess.DEVNULL,
    )
    try:
        status = [
            sys.executable,
            "-m",
            "companion.cli",
            "status",
            "--link",
            f"udpout:127.0.0.1:{shore}",
            "--once",
            "--json",
            "--timeout",
            "20",
        ]
        deadline = time.monotonic() + 100.0
        while True:
            done = subprocess.run(status, capture_output=True, text=True, timeout=60, check=False)
            document = json.loads(done.stdout) if done.returncode == 0 else {}
            # the companion may be heard before a heartbeat of the autopilot's is, and it sends more while it asks for
            # rates and parameters
            settled = document and (document["link"]["companion_bytes_per_s"] or 999) < 200
            if (settled and document["autopilot"]["armed"] is not None) or time.monotonic() > deadline:
                break
            time.sleep(1.0)
        assert done.returncode == 0, done.stderr
        assert document["schema"] == "companion.status/1"
        assert document["state"] in {"waiting", "new calculation"}
        assert document["autopilot"]["armed"] is False
        assert document["age_s"] < 10.0
        assert document["link"]["companion_bytes_per_s"] < 200
    finally:
        companion.terminate()
        companion.wait(30)
        boat.terminate()
        boat.wait(30)


@pytest.mark.parametrize(
    ("wrong", "choices"),
    [
        ('[wind]\nmodel = "gusty"\n', "write one of constant, ou, recorded"),
        ('[[events]]\nat_s = 1.0\nkind = "gale"\n', "wind_shift"),
    ],
)
def test_a_wrong_word_in_a_scenario_is_told_its_choices(wrong, choices, tmp_path, capsys):
    (tmp_path / "s.toml").write_text(f'name = "x"\nmission = "m.toml"\n{wrong}')
    assert sitl_cli.main(["run", str(tmp_path / "s.toml")]) == 2
    assert choices in capsys.readouterr().err


# What somebody else has named: a chart's island, a file, a vessel.
NASTY = "Nab\x1b]0;owned\x07\x1b[2J\x9b2J\u202egnp\r\nerror: all is well"


def test_no_name_of_a_chart_reaches_the_terminal_as_more_than_a_name(tmp_path, capsys):
    """An island's name cleared the screen of who checked the file."""
    lat, lon = 50.8203440, -1.3101419  # of the mission's goal
    ring = [[lon + e * 1e-4, lat + n * 1e-4] for e, n in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    island = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "properties": {"name": NASTY}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        ],
    }
    (tmp_path / "bay.geojson").write_text(json.dumps(island))
    (tmp_path / "bay.toml").write_text(
        f'name = "b"\n[[goal]]\nname = {json.dumps(NASTY)}\nlat = {lat}\nlon = {lon}\n'
        '[area]\nobstacles = ["bay.geojson"]\n'
    )
    assert cli.main(["mission", "check", str(tmp_path / "bay.toml")]) != 0
    told = capsys.readouterr()
    assert "Nab" in told.out + told.err
    assert all(line.isprintable() for line in (told.out + told.err).splitlines())
    assert not [line for line in told.out.splitlines() if line.startswith("error: all is well")]


@pytest.mark.parametrize(
    "words",
    [
        ["fence", "check"],
        ["mission", "check"],
        ["plan"],
        ["wind"],
        ["replay"],
        ["report"],
        ["run", "--link", "udpin:127.0.0.1:1"],
        ["doctor", "--link"],
        ["order"],
        ["far"],
        ["status", "--link"],
        ["watch", "--link"],
        ["view"],
        ["key", "new", "--x"],
        [],
    ],
)
def test_no_file_name_and_no_option_does(words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.main([*words, f"none\udcff{NASTY}.toml"]) != 0
    told = capsys.readouterr()
    assert told.err.count("\n") == 1
    assert (told.out + told.err).rstrip("\n").isprintable()


def test_whatever_a_command_prints_is_safe_and_the_streams_are_as_they_were(capsys, monkeypatch):
    before = sys.stdout, sys.stderr

    def loud(_):
        print(NASTY, "\tand\u00a0more", file=sys.stderr)
        print(NASTY)
        sys.stdout.writelines([NASTY])
        logging.getLogger("companion.test").warning("%s", NASTY)
        control(sys.stdout, "\x1b[K")
        return 0

    monkeypatch.setattr("companion.commands.replay.run", loud)
    monkeypatch.setattr(
        "companion.commands.replay.add_parser",
        lambda sub, summary: sub.add_parser("replay", help=summary).set_defaults(run=loud),
    )
    monkeypatch.setattr(logging.getLogger("companion.test"), "propagate", False)
    assert cli.main(["replay"]) == 0
    assert (sys.stdout, sys.stderr) == before
    told = capsys.readouterr()
    assert told.out.endswith("\x1b[K")
    assert "\x1b" not in told.out[:-3] + told.err
    assert "\tand\u00a0more" in told.err
    assert told.err.count(r"\x1b[2J\x9b2J\u202egnp\r") == 2


def test_nothing_writes_to_a_terminal_but_through_the_safe_streams():
    """What goes round them: the console's thread and the dashboard, each with its own text made safe; see there."""
    around = re.compile(
        r"(stdout|stderr)\.buffer|os\.write\((1|2|self\._fd|self\._out)\b|__stdout__|__stderr__|/dev/tty['\"]"
    )
    found = {
        str(path)
        for folder in ("companion", "sitl", "lab", "sailbench")
        for path in Path(folder).rglob("*.py")
        if around.search(path.read_text())
    }
    assert found == {"companion/telemetry/console.py", "companion/terminal/screen.py"}


def test_standard_output_that_is_full_is_one_line():
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        command = [sys.executable, "-m", "companion", "mission", "check", "missions/rocks.toml"]
        ended = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=120)
    assert ended.returncode == 1
    assert ended.stderr.splitlines() == ["companion mission: standard output: No space left on device"]


def test_the_leg_home_is_planned_and_light_wind_is_said(capsys):
    """The plan of a mission that ends at home ended at its last goal; in 1 m/s its times stood there as any other's."""
    words = ["plan", "missions/bay.toml", "--expansions", "20000", "--wind"]
    assert cli.main([*words, "1@0"]) == 0
    out = capsys.readouterr().out
    assert "\nbay: home\n" in out
    assert "light wind: her polar has no speeds for 1.0 m/s of wind, the least that it knows is 3.0 m/s" in out
    assert cli.main([*words, "5@0"]) == 0
    assert "light wind" not in capsys.readouterr().out


def test_a_check_that_takes_long_says_why(tmp_path, monkeypatch, capsys):
    """Of an imported chart it said nothing for eleven seconds, then it was the area's fault where there was none."""
    from companion.commands import output
    from companion.mission_check import check_mission

    def slow(*args, **words):
        time.sleep(0.2)
        return check_mission(*args, **words)

    monkeypatch.setattr(output, "PATIENCE_S", 0.02)
    monkeypatch.setattr("companion.mission_check.check_mission", slow)
    assert cli.main(["mission", "check", "missions/lake.toml"]) == 0
    assert "note: checking; an area of many positions takes long\n" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("area", "notes"),
    [
        ("margin_m = 15.0", ()),
        ("margin_m = 12.0", ("margin_m: 12 m; in 5 m/s of wind the habits",)),
        ("margin_m = 4.0\nmargin_floor_m = 6.0", ("margin_floor_m: 6 m is more than margin_m and is taken as 4 m",)),
    ],
)
def test_check_notes_a_margin_below_what_the_autopilots_habits_ask_for(tmp_path, capsys, area, notes):
    """It was said under way alone, and a floor above the margin nowhere."""
    (tmp_path / "rock.wkt").write_text("POINT (-1.32 50.817)")
    (tmp_path / "m.toml").write_text(f'[[goal]]\nlat = 50.82\nlon = -1.31\n[area]\nobstacles = ["rock.wkt"]\n{area}\n')
    assert cli.main(["mission", "check", str(tmp_path / "m.toml")]) == 0
    out = capsys.readouterr().out
    assert out.endswith("in order\n")
    assert all(f"note: [area] {note}" in out for note in notes)
    assert notes or "note: [area]" not in out


def test_a_place_that_is_read_only_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr("companion.program.arguments.os.access", lambda *_: False)
    for taken in (out_file, out_folder):
        with pytest.raises(ArgumentTypeError, match="cannot be written; name another place"):
            taken(str(tmp_path / "x"))


def test_help_of_run_says_where_the_state_is(capsys):
    with pytest.raises(SystemExit):
        cli.main(["run", "--help"])
    assert "<mission>.state.json beside the voyage's folder" in " ".join(capsys.readouterr().out.split())

"""Every command with every file that it reads or writes broken: one line that names the file, and no traceback."""

import errno
import json
import os
import re
import shutil
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from companion import cli
from companion.clock import run_virtual
from companion.commands.output import write_files
from companion.commands.run import NOT_THERE
from companion.disk import Disk
from companion.errors import InputError
from companion.plots.chart import save
from sitl import cli as sitl_cli
from sitl.run import compiled
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import ExpectSpec, Scenario, WindSpec

ROOT = Path(__file__).parents[2]
PROBLEM = ROOT / "sailbench" / "problems"
CHART = ("chart", "import", "--around", "50.8,-1.3", "--radius", "500", "--depth", "1")
DAMAGES = {
    "missing": None,
    "empty": b"",
    "binary": bytes(range(256)) * 4,
    "text": b"What is this, and who wrote it?\n",
    "list": b"[1, 2, {}]\n",
    "table": b"{}\n",
    "nulls": b'{"t_s": null, "kind": null, "run": null, "goals": [null], "name": null, "origin": null}\n',
    "deep": b"[" * 100_000,
    "nan": b"t_s,frames,lat_deg\nnan,nan,inf\n",
}


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A mission with everything that one may name, and a voyage of it."""
    folder = tmp_path_factory.mktemp("short")
    (folder / "rock.wkt").write_text(
        "POLYGON ((-1.3102 50.8175, -1.3098 50.8175, -1.3098 50.8177, -1.3102 50.8177, -1.3102 50.8175))"
    )
    (folder / "fence.wkt").write_text("POLYGON ((-1.32 50.81, -1.30 50.81, -1.30 50.83, -1.32 50.83, -1.32 50.81))")
    (folder / "boat.pol").write_text("TWA;4;6;8\n45;2.1;3.0;3.6\n90;2.8;3.4;3.9\n150;2.0;2.9;3.6\n")
    (folder / "mission.toml").write_text(
        'name = "short"\n[start]\nlat = 50.8170\nlon = -1.3100\n[[goal]]\nlat = 50.8181\nlon = -1.3100\n'
        '[area]\nobstacles = ["rock.wkt"]\nfence = "fence.wkt"\nmargin_m = 10.0\n[boat]\npolar = "boat.pol"\n'
    )
    (folder / "wind.csv").write_text(
        "t_s,wind_from_deg,wind_speed_ms\n" + "".join(f"{t},{350 + t % 7},5.0\n" for t in range(0, 1500, 2))
    )
    (folder / "scenario.toml").write_text(
        'name = "short"\nmission = "mission.toml"\nlimit_s = 60.0\n[wind]\nmodel = "recorded"\nfile = "wind.csv"\n'
    )
    shutil.copy(next(PROBLEM.glob("*.json")), folder / "problem.json")
    return folder


@pytest.fixture(scope="module")
def voyage(short, tmp_path_factory):
    out = tmp_path_factory.mktemp("voyage") / "v"
    # long enough for a plan, its upload and getting under way, which 38 s take
    scenario = Scenario(
        name="short", mission="mission.toml", limit_s=50.0, wind=WindSpec(tws_mps=5.0), expect=ExpectSpec()
    )
    run_virtual(run_embedded(scenario, short / "scenario.toml", 1, out, expansions=2000))
    return out


def ends_in_one_line(capsys, program, argv, name):
    """Run a command on a broken file: it may do without it, or refuse it in one line that names it."""
    code = program.main([str(a) for a in argv])
    err = capsys.readouterr().err
    progress = (": note: ", "compiling kernels")
    refusals = [line for line in err.splitlines() if not any(words in line for words in progress)]
    assert "Traceback" not in err
    if code != 0:
        assert code in {1, 2, NOT_THERE}, argv
        assert len(refusals) <= 1, refusals
        if refusals:
            assert Path(name).name in refusals[0], refusals[0]
            assert len(refusals[0]) < 500
    return code


def broken(folder, name, damage):
    path = folder / name
    if damage == "folder":
        path.unlink(missing_ok=True)
        path.mkdir()
    elif DAMAGES[damage] is None:
        path.unlink(missing_ok=True)
    else:
        path.write_bytes(DAMAGES[damage])


READS = [
    (cli, ("mission", "check", "mission.toml"), ("mission.toml", "rock.wkt", "fence.wkt", "boat.pol")),
    (
        cli,
        ("run", "mission.toml", "--link", "tcp:127.0.0.1:1", "--wait", "0.2", "--state", "state.json"),
        ("mission.toml", "rock.wkt", "boat.pol"),
    ),
    (cli, ("run", "mission.toml", "--link", "tcp:127.0.0.1:1", "--wait", "0.2", "--signing-key", "key"), ("key",)),
    (cli, ("doctor", "--link", "tcp:127.0.0.1:1", "--wait", "0.2", "--mission", "mission.toml"), ("mission.toml",)),
    (cli, ("doctor", "--link", "tcp:127.0.0.1:1", "--wait", "0.2", "--signing-key", "key"), ("key",)),
    (cli, ("fence", "check", "rock.wkt"), ("rock.wkt",)),
    (cli, ("fence", "convert", "rock.wkt", "out.kml"), ("rock.wkt",)),
    (cli, ("mission", "convert", "mission.toml", "out.plan"), ("mission.toml", "rock.wkt")),
    (
        cli,
        (
            "mission",
            "new",
            "new.toml",
            "--start",
            "50.817,-1.31",
            "--goal",
            "50.8181,-1.31",
            "--land",
            "rock.wkt",
            "--fence",
            "fence.wkt",
        ),
        ("rock.wkt", "fence.wkt"),
    ),
    (cli, ("mission", "new", "new.toml", "--from", "drawing.kml"), ("drawing.kml",)),
    (cli, ("mission", "upload", "drawing.kml", "--link", "tcp:127.0.0.1:1"), ("drawing.kml",)),
    (cli, ("plan", "problem.json", "--expansions", "50"), ("problem.json",)),
    (cli, ("wind", "wind.csv", "--estimator", "mean5"), ("wind.csv",)),
    (cli, ("wind", "wind.tlog", "--estimator", "mean5"), ("wind.tlog",)),
    (cli, ("wind", "wind.bin", "--estimator", "mean5"), ("wind.bin",)),
    (sitl_cli, ("run", "scenario.toml", "--out", "v"), ("scenario.toml", "mission.toml", "boat.pol", "wind.csv")),
    (sitl_cli, ("campaign", "scenario.toml", "--runs", "1", "--workers", "1"), ("scenario.toml", "boat.pol")),
    (sitl_cli, ("boat", "--polar", "boat.pol", "--port", "0", "--udp", "0"), ("boat.pol",)),
    (sitl_cli, ("boat", "--wind", "wind.csv", "--port", "0", "--udp", "0"), ("wind.csv",)),
]


@pytest.mark.parametrize("damage", [*DAMAGES, "folder"])
@pytest.mark.parametrize(
    ("program", "argv", "name"),
    [(p, a, n) for p, a, names in READS for n in names],
    ids=lambda v: "-".join(v[:2]) if isinstance(v, tuple) else v if isinstance(v, str) else "",
)
def test_what_is_read(short, tmp_path, monkeypatch, capsys, program, argv, name, damage):
    shutil.copytree(short, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    broken(tmp_path, name, damage)
    missing_on_the_boat = argv[0] == "run" and program is cli and damage == "missing"  # the unit tries again
    assert ends_in_one_line(capsys, program, argv, name) in ({NOT_THERE} if missing_on_the_boat else {1, 2})


VOYAGE_FILES = (
    "voyage.toml",
    "decisions.jsonl",
    "track.csv",
    "area.json",
    "summary.json",
    "telemetry.tlog",
    "mission/mission.toml",
)
UNREPORTED = {"telemetry.tlog", "mission/mission.toml"}


@pytest.mark.parametrize("damage", [*DAMAGES, "folder"])
@pytest.mark.parametrize("name", VOYAGE_FILES)
@pytest.mark.parametrize("command", ["report", "replay"])
def test_a_voyage_with_a_broken_file(voyage, tmp_path, capsys, command, name, damage):
    folder = tmp_path / "v"
    shutil.copytree(voyage, folder)
    broken(folder, name, damage)
    # With a broken file that a report does not read it draws the picture of the whole voyage: once is enough.
    is_drawn = command != "report" or name not in UNREPORTED or damage == "binary"
    ends_in_one_line(capsys, cli, (command, folder, *(() if is_drawn else ("--json",))), name)


@pytest.mark.parametrize("name", ["area.json", "summary.json"])
def test_a_value_of_another_kind_is_named(voyage, tmp_path, capsys, name):
    """Each value of our JSON in turn is made a text, a table, nothing."""
    folder = tmp_path / "v"
    shutil.copytree(voyage, folder)
    data = json.loads((folder / name).read_text())
    for key in data:
        for wrong in ("five", {"a": 1}, None, [1]):
            (folder / name).write_text(json.dumps({**data, key: wrong}))
            ends_in_one_line(capsys, cli, ("report", folder, "--json"), name)


@pytest.mark.parametrize("line", ["not,a,row", "x" * 30, ",".join(["five"] * 18), ",".join(["1e400"] * 18)])
def test_a_broken_row_is_named(voyage, tmp_path, capsys, line):
    folder = tmp_path / "v"
    shutil.copytree(voyage, folder)
    rows = (folder / "track.csv").read_text().splitlines()
    (folder / "track.csv").write_text("\n".join([*rows[:5], line, *rows[5:]]) + "\n")
    for command in ("report", "replay"):
        ends_in_one_line(capsys, cli, (command, folder), "track.csv")


WRITES = [
    (cli, ("plan", "problem.json", "--expansions", "50", "--out"), "plan.json"),
    (cli, ("plan", "problem.json", "--expansions", "50", "--plot"), "plan.png"),
    (cli, ("wind", "wind.csv", "--estimator", "mean5", "--plot"), "wind.png"),
    (cli, ("wind", "wind.csv", "--estimator", "mean5", "--json"), "wind.json"),
    (cli, ("mission", "check", "mission.toml", "--no-plan", "--plot"), "m.png"),
    (cli, ("fence", "check", "rock.wkt", "--plot"), "f.png"),
    (cli, ("mission", "convert", "mission.toml"), "out.plan"),
    (cli, ("fence", "convert", "mission.toml"), "out.kml"),
    (cli, ("mission", "new", "--start", "50.817,-1.31", "--goal", "50.8181,-1.31"), "new.toml"),
    (cli, ("run", "mission.toml", "--link", "tcp:127.0.0.1:1", "--wait", "0.2", "--state"), "state.json"),
    (cli, ("report", "v", "--out"), "v.png"),
    (cli, ("report", "v", "--track"), "v.gpx"),
    (sitl_cli, ("campaign", "scenario.toml", "--runs", "1", "--json"), "c.json"),
    (sitl_cli, ("faults", "--runs", "1", "--json"), "f.json"),
    (sitl_cli, ("baselines", "--seeds", "1", "--who", "companion", "--out"), "b.jsonl"),
    (sitl_cli, ("run", "scenario.toml", "--out"), "voyage"),
]


@pytest.mark.parametrize("place", ["a-file/inside", "is-a-folder"])
@pytest.mark.parametrize(("program", "argv", "name"), WRITES, ids=lambda v: v if isinstance(v, str) else "")
def test_what_is_written(short, voyage, tmp_path, monkeypatch, capsys, program, argv, name, place):
    shutil.copytree(short, tmp_path, dirs_exist_ok=True)
    shutil.copytree(voyage, tmp_path / "v")
    monkeypatch.chdir(tmp_path)
    target = Path(name)
    if place == "is-a-folder":
        if name == "voyage":
            return  # a folder is what it wants
        target.mkdir()
    else:
        Path("a-file").write_text("")
        target = Path("a-file") / name
    assert ends_in_one_line(capsys, program, (*argv, target), target.parent if "a-file" in str(target) else name) != 0


@pytest.mark.parametrize("name", ["mission.toml", "boat.pol", "wind.csv", "rock.wkt"])
def test_what_cannot_be_sailed_is_told_before_anything_is_compiled(short, tmp_path, monkeypatch, capsys, name):
    """On a machine that has no kernels yet the refusal came a minute later, behind the compiling's progress."""
    shutil.copytree(short, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compiled, "compile_ahead", lambda: pytest.fail("compiled first"))
    broken(tmp_path, name, "empty")
    for argv in (("run", "scenario.toml", "--out", "v"), ("campaign", "scenario.toml", "--runs", "1")):
        if name != "wind.csv" or argv[0] == "run":
            assert ends_in_one_line(capsys, sitl_cli, argv, name) == 2


def test_a_mission_whose_name_is_a_path_stays_in_the_voyages_folder(short, tmp_path, monkeypatch):
    """Its voyage was written beside them."""
    shutil.copytree(short, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    scenario = Path("scenario.toml").read_text()
    Path("scenario.toml").write_text(re.sub(r'name = "\w+"', 'name = "a/../../b"', scenario, count=1))
    before = set(Path().iterdir())
    sitl_cli.main(["run", "scenario.toml"])
    assert {p.name for p in set(Path().iterdir()) - before} == {"voyages"}
    assert [p.name[17:] for p in Path("voyages").iterdir()] == ["a-b"]


def test_a_picture_or_track_that_cannot_be_written_is_named_with_what_would_do(voyage, tmp_path, capsys):
    """`report --out` spoke of --plot, and `--track` offered formats that hold no track."""
    figure = plt.figure()
    with pytest.raises(InputError) as refused:
        save(figure, tmp_path / "gone" / "x.png")
    assert str(refused.value).endswith("x.png: cannot be written (No such file or directory); name a .png elsewhere")
    with pytest.raises(InputError, match=r"x\.bmpx: cannot be written \(Format 'bmpx' is not supported"):
        save(plt.figure(), tmp_path / "x.bmpx")
    save(plt.figure(), tmp_path / "x")
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["report", str(voyage), "--track", str(tmp_path / "day.wkt")]) == 2
    assert capsys.readouterr().err.strip().endswith("use .gpx, .kml, .kmz, .geojson")


@pytest.mark.parametrize(
    ("argv", "name"), [(argv, name) for _, argv, name in WRITES if name in {"plan.json", "wind.json"}], ids=str
)
def test_on_a_full_disk_what_was_written_before_is_kept(short, tmp_path, monkeypatch, capsys, argv, name):
    """It was cut to nothing, and "standard output" was blamed."""
    shutil.copytree(short, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    Path(name).write_text("before")

    def full(_disk, _fd, _data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Disk, "write", full)
    assert cli.main([*argv, name]) == 2
    said = f"companion {argv[0]}: {name}: cannot be written (No space left on device); name another place"
    assert capsys.readouterr().err.splitlines()[-1] == said
    assert Path(name).read_text() == "before"


@pytest.mark.parametrize(
    ("program", "argv", "name", "remedy"),
    [
        (cli, ("fence", "check"), "empty.wkt", "export it again, or name another file"),
        (cli, ("mission", "new", "m.toml", "--from"), "empty.gpx", "export it again, or name another file"),
        (cli, ("mission", "check"), "empty.toml", "companion mission example writes missions to begin from"),
        (cli, ("plan",), "empty.toml", "companion mission example writes missions to begin from"),
        (cli, ("passage", "plan"), "empty.toml", "write [start], [goal] and [depart]: companion passage --help"),
        (cli, ("weather", "show"), "empty.grib", "fetch it again, or name another file"),
        (cli, CHART, "empty.000", "fetch it again, or name another file"),
        (cli, CHART, "empty.tif", "fetch it again, or name another file"),
        (cli, CHART, "empty.geojson", "fetch it again, or name another file"),
        (sitl_cli, ("run",), "empty.toml", "name the TOML file of a mission or a scenario"),
        (sitl_cli, ("results", "show"), "empty.jsonl", "name another file"),
        (sitl_cli, ("results", "show"), "empty.parquet", "name another file"),
    ],
)
def test_an_empty_file_and_a_folder_are_called_so(tmp_path, monkeypatch, capsys, program, argv, name, remedy):
    """They were no obstacles, no line of results, `Is a directory`, an encrypted cell, a mission without a goal."""
    monkeypatch.chdir(tmp_path)
    Path(name).touch()
    assert program.main([*argv, name]) == 2
    assert capsys.readouterr().err.endswith(f": {name}: is empty; {remedy}\n")
    assert program.main([*argv, "."]) == 2
    assert ": .: is a folder; name " in capsys.readouterr().err


def test_a_file_in_place_of_a_folder_is_called_one(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    assert cli.main(["mission", "example", "file"]) == 2
    assert capsys.readouterr().err == "companion mission: file: is a file; name a folder\n"
    asked = ["--link", "udpin:127.0.0.1:1", "--start", "50.8170,-1.3100", "--goal", "50.8200,-1.3094"]
    assert cli.main(["setup", "lake", "--dir", "file", *asked]) == 2
    assert capsys.readouterr().err == "companion setup: file: is no folder; name another with --dir\n"


@pytest.mark.parametrize(
    ("name", "data", "why"),
    [
        ("a.BIN", b"", "it is empty"),
        ("a.tlog", b"", "it is empty"),
        ("a.BIN", b"what", "it is no .BIN log: it does not begin as one"),
        ("a.txt", b"what", "only .BIN and .tlog tell how it was steered"),
        ("", b"", "no log is in there"),
    ],
)
def test_a_single_log_that_tells_no_steering_is_one_line(tmp_path, capsys, name, data, why):
    if name:
        (tmp_path / name).write_bytes(data)
    assert cli.main(["doctor", "--log", str(tmp_path / name)]) == 1
    told = f"companion doctor: {tmp_path / name}: {why}; give .BIN or .tlog of a voyage, or its folder\n"
    assert capsys.readouterr().err == told


def test_a_mission_that_is_to_be_a_folder_or_no_toml_is_told_with_a_remedy(tmp_path, monkeypatch, capsys):
    """A folder was asked to end in .toml."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(["mission", "new", "."]) == 2
    assert capsys.readouterr().err == "companion mission: .: is a folder; name a file in it that ends in .toml\n"
    assert cli.main(["mission", "new", "bay"]) == 2
    assert capsys.readouterr().err == "companion mission: bay: a mission file ends in .toml; write bay.toml\n"


@pytest.mark.parametrize("argv", [("watch", "--socket"), ("order", "hold", "--socket")], ids=" ".join)
def test_what_is_no_socket_is_told_so(tmp_path, capsys, argv):
    """`companion watch` waited for somebody to listen at a file of text."""
    (tmp_path / "notes.txt").touch()
    assert cli.main([*argv, str(tmp_path / "notes.txt")]) == 2
    said = capsys.readouterr().err
    assert said.endswith("notes.txt: is no socket; name the one that companion run --socket made\n")
    assert cli.main([*argv, str(tmp_path)]) == 2
    assert ": is a folder; name the socket in it" in capsys.readouterr().err


def test_results_that_cannot_be_begun_have_a_remedy(capsys):
    assert sitl_cli.main(["faults", "--runs", "1", "--out", "/proc/x.jsonl"]) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert told == "sitl faults: /proc/x.jsonl: cannot be written (No such file or directory); name another place"


def test_a_device_that_is_named_is_written_to_and_stays():
    with pytest.raises(InputError, match=r"^/dev/full: cannot be written \(No space left on device\)"):
        write_files({"/dev/full": b"x"}, force=True)
    assert Path("/dev/full").is_char_device()


def test_a_picture_that_has_no_room_leaves_the_one_that_was_there(tmp_path, monkeypatch):
    """On a full card a good picture became one of no bytes."""
    there = tmp_path / "x.png"
    there.write_bytes(b"good")

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Disk, "_write", full)
    with pytest.raises(InputError, match="No space left on device"):
        save(plt.figure(), there)
    assert there.read_bytes() == b"good"
    assert [p.name for p in tmp_path.iterdir()] == ["x.png"]

"""What is installed from a wheel works from an empty folder, without the checkout beside it."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The wheel's content, and the libraries that it is installed beside; not the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)], check=True, capture_output=True
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def run(installed, folder, *words):
    return subprocess.run(
        [sys.executable, "-m", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(installed)},
    )


def test_the_boat_carries_no_laboratory_and_the_laboratory_nothing_else(installed, tmp_path):
    assert {p.name for p in installed.iterdir() if not p.name.endswith(".dist-info")} == {"companion", "sitl"}
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        check=True,
        capture_output=True,
        cwd="lab",
    )
    (wheel,) = tmp_path.glob("*.whl")
    inside = [name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name]
    assert sorted(inside) == sorted(path.as_posix() for path in Path("lab").rglob("*.py"))


def test_the_bench_for_others_is_found_by_gymnasium_where_it_is_installed(tmp_path):
    """Its wheel holds what is in the tree, and its environments are found by the name with its module."""
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        check=True,
        capture_output=True,
        cwd="sailbench",
    )
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    inside = sorted(p.relative_to(tmp_path / "site").as_posix() for p in tmp_path.glob("site/sailbench/**/*.*"))
    here = {p.as_posix() for p in Path("sailbench").rglob("*.*") if p.suffix != ".pyc"}
    assert inside == sorted(here - {"sailbench/pyproject.toml"})
    asked = "import gymnasium; print(gymnasium.make('sailbench:sailbench/Rocks-v0').reset(seed=1)[1])"
    done = subprocess.run(
        [sys.executable, "-c", asked],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": f"{tmp_path / 'site'}{os.pathsep}{Path.cwd()}"},
    )
    assert done.stdout == "{'t_s': 0.0, 'weather': 1}\n", done.stderr


def test_it_holds_what_it_needs(installed):
    for there, here in (("companion/missions", "missions"), ("sitl/missions", "sitl/missions")):
        inside, beside = (
            sorted(p.relative_to(folder) for p in folder.rglob("*.*")) for folder in (installed / there, Path(here))
        )
        assert inside == beside
    assert (installed / "companion" / "kernels.txt").is_file()
    (points,) = installed.glob("*.dist-info/entry_points.txt")
    assert "[companion.commands]\nrehearse = sitl.rehearse.command" in points.read_text()


def test_every_scenario_has_its_mission(installed, tmp_path):
    asked = """
from pathlib import Path
import sitl
from sitl.scenario.scenario import load_scenario
paths = sorted(Path(sitl.__file__).parent.glob("scenarios/**/*.toml"))
print(len(paths), [path.stem for path in paths if not load_scenario(path).mission_path(path).is_file()])
"""
    done = subprocess.run(
        [sys.executable, "-c", asked],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": str(installed)},
    )
    assert done.stdout == f"{len(list(Path('sitl/scenarios').rglob('*.toml')))} []\n"


def test_it_sails_from_an_empty_folder(installed, tmp_path):
    written = run(installed, tmp_path, "companion.cli", "mission", "example", "mine")
    assert written.returncode == 0, written.stderr
    again = run(installed, tmp_path, "companion.cli", "mission", "example", "mine")
    assert (again.returncode, again.stderr.count("\n")) == (2, 1)
    assert run(installed, tmp_path, "companion.cli", "mission", "check", "mine/lake.toml").returncode == 0
    sailed = run(installed, tmp_path, "sitl.cli", "run", "rocks", "--out", "v")
    assert sailed.returncode == 0, sailed.stdout + sailed.stderr
    assert "PASSED" in sailed.stdout
    assert (tmp_path / "v" / "voyage.png").is_file()


def test_a_scenario_that_nobody_knows_is_one_line(installed, tmp_path):
    done = run(installed, tmp_path, "sitl.cli", "run", "rokcs")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "did you mean rocks?" in done.stderr

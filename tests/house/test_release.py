"""What is handed out: one version, a bill of materials that is whole, a page for every command, scripts that parse."""

import importlib.util
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from companion import cli
from sitl import cli as sitl_cli

PACKAGING = Path("packaging")


def loaded(name):
    spec = importlib.util.spec_from_file_location(name, PACKAGING / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_version_is_in_one_place():
    project = tomllib.loads(Path("pyproject.toml").read_text())
    assert "version" not in project["project"]
    assert project["tool"]["hatch"]["version"]["path"] == "companion/__init__.py"


def test_the_bill_of_materials_names_every_library_of_the_boat():
    lock = Path("requirements.lock")
    bill = loaded("sbom").bill(lock)
    wanted = re.findall(r"^([A-Za-z0-9._-]+)==([^ ;]+)", lock.read_text(), re.MULTILINE)
    assert [(c["name"], c["version"]) for c in bill["components"]] == wanted
    assert all(c["hashes"] for c in bill["components"])
    assert sum(len(c["hashes"]) for c in bill["components"]) == lock.read_text().count("--hash=")


def test_every_command_has_a_page_and_is_completed(tmp_path):
    loaded("pages").main(tmp_path)
    pages = {p.stem for p in (tmp_path / "man1").iterdir()}
    for program in (cli.PROGRAM, sitl_cli.PROGRAM):
        assert {program.name, *(f"{program.name}-{name}" for name in program.names)} <= pages
    assert "companion-mission-new" in pages
    assert r"\-\-from\-autopilot" in (tmp_path / "man1/companion-run.1").read_text()
    asked = f"""source {tmp_path}/bash/companion
asked() {{
    COMP_WORDS=(companion "$@") COMP_CWORD=$#
    _shtab_companion companion "${{@: -1}}"
    echo "${{COMPREPLY[@]}}"
}}
asked fence up; asked run x.toml --dry; asked plan x.toml --algorithm rrt"""
    done = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["upload", "--dry-run", "rrtstar"]
    assert (tmp_path / "zsh/sitl").read_text().startswith("#compdef sitl\n")


@pytest.mark.parametrize("script", sorted(PACKAGING.glob("*.sh")) + sorted(PACKAGING.glob("debian/p*")), ids=str)
def test_scripts_can_be_read_by_their_shell(script):
    shell = script.read_text().splitlines()[0].removeprefix("#!")
    assert subprocess.run([shell, "-n", str(script)], check=False).returncode == 0


def test_the_package_of_python_is_built_by_any_python():
    assert (
        subprocess.run(
            [sys.executable, str(PACKAGING / "deb.py"), "--help"], capture_output=True, check=False
        ).returncode
        == 0
    )

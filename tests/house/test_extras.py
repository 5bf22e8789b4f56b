"""What an installation without extras lacks: known by its libraries, and said in one line with the remedy."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from companion.program.commands import EXTRAS

PROJECT = tomllib.loads(Path("pyproject.toml").read_text())["project"]
# An import of these fails, as where they are not installed.
ALONE = f"""
import sys
for name in {sorted(EXTRAS)}:
    sys.modules[name] = None
from {{program}}.cli import main
sys.exit(main())
"""


def without_extras(program, folder, *words):
    return subprocess.run(
        [sys.executable, "-c", ALONE.format(program=program), *words],
        cwd=folder,
        text=True,
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
    )


@pytest.fixture(scope="module")
def sailed(tmp_path_factory):
    """A voyage of an installation without extras: what came of it, and the folder that ``v`` is in."""
    folder = tmp_path_factory.mktemp("alone")
    return without_extras("sitl", folder, "run", "rocks", "--out", "v"), folder


def names(requirements):
    return {re.match(r"[A-Za-z0-9-]+", text)[0].lower() for text in requirements}


def test_each_extra_brings_what_it_is_known_by():
    for extra in sorted(set(EXTRAS.values())):
        assert names(PROJECT["optional-dependencies"][extra]) == {k for k, v in EXTRAS.items() if v == extra}
    assert not names(PROJECT["dependencies"]) & set(EXTRAS)
    locked = set(re.findall(r"^([a-z0-9-]+)==", Path("requirements.lock").read_text(), re.MULTILINE))
    assert not locked & set(EXTRAS)


def test_no_module_needs_an_extra_to_be_loaded_but_those_that_are_loaded_late():
    """At the top of a module only where the module is itself an extra's."""
    found = set()
    for top in ("companion", "sitl", "lab", "sailbench"):
        for path in Path(top).rglob("*.py"):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                loaded = (
                    [a.name for a in node.names]
                    if isinstance(node, ast.Import)
                    else ([node.module or ""] if isinstance(node, ast.ImportFrom) else [])
                )
                if {name.partition(".")[0] for name in loaded} & set(EXTRAS):
                    found.add((path if top == "lab" else path.parent).as_posix())
    assert found == {
        "companion/plots",
        "companion/wind/study",
        "lab/campaigns/plots.py",
        "lab/wind_fit.py",
        "sitl/rehearse",
    }


def test_without_the_laboratory_its_commands_are_one_line_and_not_in_the_help(tmp_path):
    without = "import sys; sys.modules['lab'] = None; from sitl.cli import main; sys.exit(main())"
    asked, helped = (
        subprocess.run(
            [sys.executable, "-c", without, *words],
            cwd=tmp_path,
            text=True,
            capture_output=True,
            check=False,
            env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        )
        for words in (("campaign", "demo", "--runs", "3"), ("--help",))
    )
    assert (asked.returncode, asked.stderr) == (
        1,
        (
            "sitl campaign: the laboratory is not installed, which this needs; "
            "in the clone of this project: pip install ./lab\n"
        ),
    )
    assert "campaign" not in helped.stdout


def test_the_demo_sails_without_any(sailed):
    done, _ = sailed
    assert done.returncode == 0, done.stdout + done.stderr
    assert "PASSED" in done.stdout
    assert done.stderr.endswith(
        "the picture could not be drawn: matplotlib is not installed, which this needs; in the clone of this project: "
        "pip install '.[plots]'\n"
    )


@pytest.mark.parametrize(
    ("words", "library"),
    [
        (["report", "v"], "matplotlib"),
        (["mission", "check", str(Path("sitl/missions/by-rrtstar.toml").absolute())], "filterpy"),
        (["mission", "edit", "m.toml"], "tomlkit"),
        (["mission", "download", "m.plan", "--link", "udpin:127.0.0.1:14599"], "mavsdk"),
    ],
)
def test_a_missing_extra_is_one_line(request, tmp_path, words, library):
    folder = request.getfixturevalue("sailed")[1] if words[0] == "report" else tmp_path
    done = without_extras("companion", folder, *words)
    assert done.returncode == 1
    assert done.stderr == (
        f"companion {words[0]}: {library} is not installed, which this needs; "
        f"in the clone of this project: pip install '.[{EXTRAS[library]}]'\n"
    )
    assert ("Arrived after" in done.stdout) is (words[0] == "report")  # the picture alone needs it

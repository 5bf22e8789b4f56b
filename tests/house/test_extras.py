"""What an installation without extras lacks: known by its libraries, and said in one line with the remedy."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from companion.program.extras import EXTRAS, NAME

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
    return subprocess.run([sys.executable, "-c", ALONE.format(program=program), *words], cwd=folder, text=True,
                          capture_output=True, check=False, env={**os.environ, "PYTHONPATH": str(Path.cwd())})


def names(requirements):
    return {re.match(r"[A-Za-z0-9-]+", text)[0].lower() for text in requirements}


def test_each_extra_brings_what_it_is_known_by():
    assert PROJECT["name"] == NAME
    for extra in sorted(set(EXTRAS.values())):
        assert names(PROJECT["optional-dependencies"][extra]) == {k for k, v in EXTRAS.items() if v == extra}
    assert not names(PROJECT["dependencies"]) & set(EXTRAS)
    locked = set(re.findall(r"^([a-z0-9-]+)==", Path("requirements.lock").read_text(), re.MULTILINE))
    assert not locked & set(EXTRAS)


def test_no_module_needs_an_extra_to_be_loaded_but_those_that_are_loaded_late():
    """At the top of a module only where the module is itself an extra's."""
    found = set()
    for top in ("companion", "sitl"):
        for path in Path(top).rglob("*.py"):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                loaded = [a.name for a in node.names] if isinstance(node, ast.Import) else (
                    [node.module or ""] if isinstance(node, ast.ImportFrom) else [])
                if {name.partition(".")[0] for name in loaded} & set(EXTRAS):
                    found.add(path.parent.as_posix())
    assert found == {"companion/plots", "companion/wind/study"}


def test_the_demo_sails_without_any(tmp_path):
    sailed = without_extras("sitl", tmp_path, "run", "rocks", "--out", "v")
    assert sailed.returncode == 0, sailed.stdout + sailed.stderr
    assert "PASSED" in sailed.stdout
    assert sailed.stderr.endswith(
        f"the picture could not be drawn: matplotlib is not installed, which this needs; pip install '{NAME}[plots]'\n")


@pytest.mark.parametrize(("words", "library"), [
    (["report", "v"], "matplotlib"),
    (["mission", "check", str(Path("missions/by-rrtstar.toml").absolute())], "filterpy"),
    (["mission", "download", "m.plan", "--link", "udpin:127.0.0.1:14599"], "mavsdk"),
])
def test_a_missing_extra_is_one_line(tmp_path, words, library):
    if words[0] == "report":
        without_extras("sitl", tmp_path, "run", "rocks", "--out", "v")
    done = without_extras("companion", tmp_path, *words)
    assert done.returncode == 1
    assert done.stderr == (f"companion {words[0]}: {library} is not installed, which this needs; "
                           f"pip install '{NAME}[{EXTRAS[library]}]'\n")

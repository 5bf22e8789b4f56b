"""What make says when no environment can be made: one line and the remedy. No environment is made here."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TOO_OLD = "import sys\nsys.version_info = (3, 9, 18, 'final', 0)\n"


def make(*words, **environment):
    """Run make without what a make around the tests hands down."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS", "PYTHON", "EXTRAS", "VENV"))}
    return subprocess.run(
        ["make", *words], cwd=ROOT, env=kept | environment, capture_output=True, text=True, check=False
    )


def python(tmp_path, module, text):
    """Return an environment in which the real Python finds ``module`` changed."""
    (tmp_path / f"{module}.py").write_text(text)
    return {"PYTHONPATH": str(tmp_path)}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["env", "EXTRAS=foo"], "EXTRAS=foo: there is no foo. Known: bench"),
        (["test", "EXTRAS=bench foo"], "EXTRAS=bench foo: there is no foo."),
        (["env", "PYTHON=nope"], "there is no nope here. Name a Python of 3.11 or newer: make PYTHON=python3.11"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, words, told):
    answer = make(*words, f"VENV={tmp_path / 'venv'}")
    assert answer.returncode == 2
    assert told in answer.stderr
    assert (answer.stdout + answer.stderr).count("\n") == 1
    assert not (tmp_path / "venv").exists()


@pytest.mark.parametrize(
    ("module", "text", "told"),
    [
        ("sitecustomize", TOO_OLD, "Python 3.11 or newer is needed; "),
        ("ensurepip", "raise ImportError", "sudo apt install python3."),
    ],
)
def test_a_python_that_will_not_do_is_refused_in_one_line(tmp_path, module, text, told):
    changed = python(tmp_path, module, text)
    answer = make("env", f"VENV={tmp_path / 'venv'}", f"PYTHON={sys.executable}", **changed)
    assert answer.returncode == 2
    assert told in answer.stderr
    assert (answer.stdout + answer.stderr).count("\n") == 1
    assert not (tmp_path / "venv").exists()


def environment(folder, *, interpreter, stamp):
    """Lay what is left of an environment."""
    (folder / "bin").mkdir(parents=True)
    (folder / "pyvenv.cfg").write_text("")
    (folder / "bin" / "python").symlink_to(interpreter)
    if stamp:
        (folder / ".installed").touch()
    return folder


@pytest.mark.parametrize(("interpreter", "stamp"), [(sys.executable, False), ("/gone/python3", True)])
def test_what_is_half_built_is_cleared_and_made_anew(tmp_path, interpreter, stamp):
    venv = environment(tmp_path / "venv", interpreter=interpreter, stamp=stamp)
    answer = make("-n", "env", f"VENV={venv}", f"PYTHON={sys.executable}")
    assert answer.returncode == 0
    assert "is half built: it is cleared and made anew" in answer.stdout
    assert f"-m venv --clear {venv}" in answer.stdout


def test_what_is_whole_is_left_alone_and_an_extra_comes_on_top(tmp_path):
    venv = environment(tmp_path / "venv", interpreter=sys.executable, stamp=True)
    assert "pip install" not in make("-n", "env", f"VENV={venv}").stdout
    added = make("-n", "env", f"VENV={venv}", "EXTRAS=bench").stdout
    assert added.count("pip install") == 1
    assert "-r requirements-bench.lock" in added


def test_a_folder_of_something_else_is_never_cleared(tmp_path):
    (tmp_path / "logbook.txt").write_text("dear to somebody")
    answer = make("env", f"VENV={tmp_path}", f"PYTHON={sys.executable}")
    assert answer.returncode == 2
    assert "is there and is no environment. Name another place: make VENV=.venv" in answer.stderr
    assert (tmp_path / "logbook.txt").exists()


def test_it_says_what_it_does_for_minutes_and_pip_does_not(tmp_path):
    """make demo in a fresh clone stood for minutes below a line of pip's, and then came warnings of pip's."""
    told = make("-n", "env", f"VENV={tmp_path / 'venv'}", f"PYTHON={sys.executable}").stdout
    assert "once: a minute or two, on a slow machine or line up to ten." in told
    assert told.index("Fetching and installing") < told.index("pip install -qq")

"""Which tests run: each name in the list of long ones is a test, or a renamed one would be short without a word."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ASIDE

LINES = [line for line in ASIDE.read_text().splitlines() if not line.startswith("#")]


@pytest.mark.parametrize("name", LINES)
def test_each_name_is_a_test(name):
    path, _, rest = name.partition("::")
    assert f"def {rest.partition('[')[0]}(" in (ASIDE.parents[1] / path).read_text()


def test_each_stands_once_and_in_order():
    assert sorted(set(LINES)) == LINES


def test_what_failed_last_is_run_alone(tmp_path):
    tests = tmp_path / "test_two.py"
    tests.write_text("def test_good():\n    pass\n\n\ndef test_bad():\n    raise AssertionError\n")
    words = [
        sys.executable,
        "-m",
        "pytest",
        "-c",
        str(Path("pyproject.toml").absolute()),
        "--rootdir",
        str(tmp_path),
        str(tests),
    ]
    first, second = (
        subprocess.run([*words, *more], capture_output=True, text=True, check=False, cwd=tmp_path).stdout
        for more in ([], ["--lf"])
    )
    assert "1 failed, 1 passed" in first
    assert "1 failed" in second
    assert "passed" not in second

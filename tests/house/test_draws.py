"""What `make draws` finds is kept: an @example of the test that failed, as a patch."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SINKS = """from hypothesis import given, strategies as st

@given(st.integers(0, 10**6))
def test_no_boat_is_longer_than_seven_metres(length_mm):
    assert length_mm < 7000
"""


def test_a_failing_draw_becomes_an_example_of_its_test(tmp_path):
    pytest.importorskip("libcst")
    (tmp_path / "test_boats.py").write_text(SINKS)
    words = [sys.executable, "-m", "pytest", "-q", "-p", "tests.conftest", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*words, "--hypothesis-profile=new", "test_boats.py"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "@reproduce_failure" in done.stdout  # for what no example can say: draws within a test
    (patch,) = (tmp_path / ".hypothesis/patches").iterdir()
    assert f"git apply .hypothesis/patches/{patch.name}" in done.stdout
    assert "+@example(\n+    length_mm=7000,\n+)" in patch.read_text()

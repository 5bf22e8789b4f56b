"""What a companion and its planner have in their memory for ever: each of it is there three times."""

import ast
import subprocess
import sys

import pytest

# Loaded as `companion run` does before it forks: what is there then, companion, fork server and planner all have.
LOADED = """
import sys
from pathlib import Path
from companion.kernels import places
places.CARRIED = Path(sys.argv[1])
import companion.cli
import companion.commands.run
from companion.planner.fork_server import load
from companion.planner.worker import answer_requests
load()
print(sorted(sys.modules))
"""


@pytest.fixture(scope="module")
def loaded(carried):
    command = [sys.executable, "-c", LOADED, str(carried)]
    return set(ast.literal_eval(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


@pytest.mark.parametrize("room", ["multiprocessing", "numba", "numpy.ma", "pymavlink", "pyproj", "scipy"])
def test_what_planners_have_no_use_for_is_not_in_the_memory_that_they_share(loaded, room):
    assert "companion.planner.search.auto" in loaded
    assert room not in loaded

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


# What `companion run` loads and does before she sails, but the link and the clock.
SAILS = """
import sys
from pathlib import Path
from companion.kernels import places
places.CARRIED = Path(sys.argv[1])
from companion.app.sail import sail
from companion.app.from_autopilot import ADOPTED
from companion.geofence import load_mission
from companion.mission_check import charted_findings, require_sailable
mission = require_sailable(load_mission("missions/archipelago.toml"))
charted_findings(mission, 0.0)
print(sorted(sys.modules))
"""


def test_a_companion_that_sails_has_no_masked_arrays(carried):
    command = [sys.executable, "-c", SAILS, str(carried)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    loaded = ast.literal_eval(done.stdout)
    assert "companion.skipper.rules" in loaded
    assert "numpy.ma" not in loaded

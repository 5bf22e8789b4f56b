"""Kernels that a package carries: called without numba, with the same answers, and numba's where they do not fit."""

import json
import shutil
import subprocess
import sys

import pytest

from companion.kernels import places
from companion.kernels.build import prepare
from companion.kernels.linked import INDEX, LIBRARY

SETTLED = """
import sys
from pathlib import Path
from companion.kernels import places
places.CARRIED = Path(sys.argv[1])
"""
PLAN = SETTLED + """
from companion.planner.solve import plan, warm
from companion.planner.warm import warm_problems
from companion.wind.estimators.forecaster import compile_kernels
warm()
compile_kernels()
answers = [plan(problem, expansions=5000, seed=3) for problem in warm_problems()]
print([a.waypoints_en.tobytes().hex() for a in answers], [a.cost_s for a in answers])
print([name for name in ("numba", "llvmlite") if name in sys.modules])
"""
OTHER = SETTLED + """
import numpy as np
from companion.kernels import xorshift
from companion.planner.search import moves
state = np.array([7], np.uint64)
first = xorshift.uniform(state)
assert "numba" not in sys.modules
kept = moves.kind_of
listed = kept(0.3)
assert "numba" not in sys.modules
other = kept(np.float32(0.3))   # not listed for this type
assert "numba" in sys.modules
again = np.array([7], np.uint64)
print(listed == other == kept(0.3) == moves.kind_of(0.3), first == xorshift.uniform(again), kept is moves.kind_of)
print(kept(**{kept.py_func.__code__.co_varnames[0]: 0.3}) == listed)
"""


@pytest.fixture(scope="module")
def carried(tmp_path_factory):
    """A folder as a package carries it, of the companion's kernels."""
    if shutil.which("ld") is None:
        pytest.skip("no linker here: apt install binutils")
    from companion.kernels.crew import planned
    from companion.kernels.linking import link

    prepare(("companion",), say=lambda _: None)
    folder = tmp_path_factory.mktemp("carried")
    for work in planned(("companion",)):
        shutil.copy(next(place / work.file for place in places.looked_in() if (place / work.file).is_file()), folder)
    (folder / places.mark("companion")).touch()
    assert link(("companion",), folder)
    return folder


def said(program, folder):
    return subprocess.run([sys.executable, "-c", program, str(folder)], capture_output=True, text=True, check=True)


def test_a_plan_needs_no_numba_and_is_the_same(carried, tmp_path):
    with_library, with_numba = said(PLAN, carried), said(PLAN, tmp_path)
    assert with_library.stdout.splitlines()[1] == "[]"
    assert with_numba.stdout.splitlines()[1] == "['numba', 'llvmlite']"
    assert with_library.stdout.splitlines()[0] == with_numba.stdout.splitlines()[0]


def test_another_type_loads_numba_and_all_kernels_go_on(carried):
    assert said(OTHER, carried).stdout.split() == ["True", "True", "True", "True"]


@pytest.mark.parametrize("harm", ["damaged", "gone", "of another source", "of a stranger"])
def test_a_library_that_cannot_be_used_is_left_alone(carried, tmp_path, harm):
    """Each time numba plans; the reason is said where the library should have fitted."""
    folder = shutil.copytree(carried, tmp_path / "carried")
    if harm == "damaged":
        torn = (folder / LIBRARY).read_bytes()
        (folder / LIBRARY).write_bytes(torn[:100_000] + b"?" + torn[100_001:])
    elif harm == "gone":
        (folder / LIBRARY).unlink()
    elif harm == "of another source":
        (folder / places.mark("companion")).unlink()
    else:
        index = json.loads((folder / INDEX).read_text())
        index["helpers"].append("NRT_of_no_numba")
        (folder / INDEX).write_text(json.dumps(index))
    done = said(PLAN, folder)
    assert done.stdout.splitlines()[1] == "['numba', 'llvmlite']"
    assert ("cannot be used" in done.stderr) == (harm != "of another source")

"""Kernels that a package carries: called without numba, with the same answers, and numba's where they do not fit."""

import json
import shutil
import subprocess
import sys

import pytest

from companion.kernels import places

SETTLED = """
import sys
from pathlib import Path
from companion.kernels import places
places.CARRIED = Path(sys.argv[1])
"""
PLAN = (
    SETTLED
    + """
from companion.planner.solve import plan, warm
from companion.planner.warm import warm_problems
from companion.wind.estimators.forecaster import compile_kernels
warm()
compile_kernels()
answers = [plan(problem, expansions=5000, seed=3) for problem in warm_problems()]
print([a.waypoints_en.tobytes().hex() for a in answers], [a.cost_s for a in answers])
print([name for name in ("numba", "llvmlite") if name in sys.modules])
"""
)
OTHER = (
    SETTLED
    + """
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
)


def said(program, folder):
    return subprocess.run([sys.executable, "-c", program, str(folder)], capture_output=True, text=True, check=True)


def test_a_plan_needs_no_numba_and_is_the_same(carried, tmp_path):
    with_library, with_numba = said(PLAN, carried), said(PLAN, tmp_path)
    assert with_library.stdout.splitlines()[1] == "[]"
    assert with_numba.stdout.splitlines()[1] == "['numba', 'llvmlite']"
    assert with_library.stdout.splitlines()[0] == with_numba.stdout.splitlines()[0]


def test_another_type_loads_numba_and_all_kernels_go_on(carried):
    assert said(OTHER, carried).stdout.split() == ["True", "True", "True", "True"]


THREADS = (
    SETTLED
    + """
import threading, time
import numpy as np
from companion.geo.segments import PolygonIndex
from shapely.geometry import Point
index = PolygonIndex([Point(0.0, 0.0).buffer(10.0, quad_segs=500)])
points = np.random.default_rng(1).uniform(-20.0, 20.0, (40_000, 2))
index.distance_m(points[:2])
begun, ended, ticks = time.perf_counter(), [], []
def work():
    index.distance_m(points)
    ended.append(time.perf_counter())
thread = threading.Thread(target=work)
thread.start()
while not ended:
    ticks.append(time.perf_counter())
    time.sleep(0.001)
inside = [t for t in ticks if begun + 0.2 * (ended[0] - begun) < t < begun + 0.8 * (ended[0] - begun)]
print(len(inside) > 3, [name for name in ("numba", "llvmlite") if name in sys.modules])
"""
)


def test_other_threads_run_while_a_kernel_does(carried):
    """A planner says that it lives from a thread of its own."""
    assert said(THREADS, carried).stdout.strip() == "True []"


@pytest.mark.parametrize("harm", ["damaged", "gone", "of another source", "for another Python", "no index"])
def test_an_extension_that_cannot_be_used_is_left_alone(carried, tmp_path, harm):
    """Each time numba plans; the reason is said where the extension should have fitted."""
    folder = shutil.copytree(carried, tmp_path / "carried")
    index = json.loads((folder / places.CARRIED_FOR).read_text())
    library = folder / index["library"]
    if harm == "damaged":
        torn = library.read_bytes()
        library.write_bytes(torn[:100_000] + b"?" + torn[100_001:])
    elif harm == "gone":
        library.unlink()
    elif harm == "of another source":
        index["companion"] = "another"
    elif harm == "for another Python":
        index["library"] = library.rename(folder / "carried_kernels.of-another").name
    (folder / places.CARRIED_FOR).write_text("{" if harm == "no index" else json.dumps(index))
    done = said(PLAN, folder)
    assert done.stdout.splitlines()[1] == "['numba', 'llvmlite']"
    assert ("cannot be used" in done.stderr) == (harm != "of another source")


def test_it_is_readable_by_all_and_writable_by_its_owner_alone(carried):
    for path in (carried, *carried.iterdir()):
        assert path.stat().st_mode & 0o444 == 0o444
        assert path.stat().st_mode & 0o022 == 0


MISFIT = (
    SETTLED
    + """
from companion.kernels.carried import misfit
print(misfit())
"""
)


def test_what_the_package_carries_and_does_not_fit_is_said(carried, tmp_path):
    assert said(MISFIT, tmp_path).stdout == "\n"  # it carries none
    assert said(MISFIT, carried).stdout == "\n"
    (tmp_path / places.CARRIED_FOR).write_text('{"companion": "another"}')
    assert said(MISFIT, tmp_path).stdout == "those of the package are of another source\n"

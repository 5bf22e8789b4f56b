"""Memory given back: what was read of libraries to load them."""

from __future__ import annotations

import subprocess
import sys

# Alone: what a test's own process has mapped is another each time.
LETS_GO = """
from pathlib import Path
import numpy as np, pyproj, shapely
from companion.kernels.memory import let_go

def of_files_kb():
    sums = dict.fromkeys(("Rss", "Anonymous"), 0)
    for line in Path("/proc/self/smaps_rollup").read_text().splitlines():
        name, _, rest = line.partition(":")
        if name in sums:
            sums[name] = int(rest.split()[0])
    return sums["Rss"] - sums["Anonymous"]

before = of_files_kb()
assert let_go() > 0
print(before - of_files_kb())
assert np.linalg.inv(2.0 * np.eye(3))[1, 1] == 0.5
assert shapely.box(0, 0, 1, 1).buffer(1.0).area > 4.0
assert pyproj.Geod(ellps="WGS84").inv(0.0, 0.0, 1.0, 0.0)[2] > 111_000.0
"""


def test_libraries_that_were_loaded_are_let_go_and_can_be_called():
    """Half of them lay in each process of a boat that never called it."""
    done = subprocess.run([sys.executable, "-c", LETS_GO], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 8_000  # kB, of 30,000


# A large array is freed, which makes glibc keep the next ones of its size; the last one lies under what stays.
PARTS_WITH = """
import numpy as np
from companion.kernels.memory import settle

def own_kb():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("RssAnon"))

settle()
large = np.ones(2_000_000)
del large
before = own_kb()
array = np.ones(500_000)
stays = [bytearray(2_000) for _ in range(100)]
del array
print(own_kb() - before)
"""


def test_a_large_array_is_given_back_when_it_is_freed_whatever_was_made_after_it():
    done = subprocess.run([sys.executable, "-c", PARTS_WITH], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 1_500  # kB, where the array is 4,000

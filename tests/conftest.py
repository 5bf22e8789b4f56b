"""What every test shares: their order, which of them wait to be asked for, and why they were left out."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

from companion.kernels.carry import as_packaged

# How long an example takes is the machine's business, which others share. What lands is tried on the same draws each
# time: a rare find must not stop another's change. `make draws` looks for new ones; what it finds is written as an
# @example, which is drawn from then on whatever the profile.
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("new", deadline=None, print_blob=True)
settings.load_profile("same")

# A minute of each worker's time in tests of seconds: begun first, or one worker would end with them while others wait.
LONG = "tests/voyages/test_scenarios_sail.py"

# What takes seconds of a core is marked here, in one place, by name: `make test` leaves it to `make test-long`.
ASIDE = Path(__file__).with_name("long.txt")
NAMED = pytest.StashKey[set[str]]()


def pytest_configure(config):
    config.stash[NAMED] = {line for line in ASIDE.read_text().splitlines() if not line.startswith("#")}


def pytest_itemcollected(item):
    # with an example's name, or without, and then all its examples are
    if {item.nodeid, item.nodeid.partition("[")[0]} & item.config.stash[NAMED]:
        item.add_marker("long")


@pytest.hookimpl(trylast=True)  # of what is left when the marks have been looked at
def pytest_collection_modifyitems(config, items):
    """Order what several workers share; leave out, with a reason, what needs a program that a clone does not bring."""
    items[:] = long_first(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
    if "ardurover" in (config.option.markexpr or ""):
        return
    skip = pytest.mark.skip(reason="sails the real ArduRover: asked for by `pytest -m ardurover` (see `sitl fetch`)")
    for item in items:
        if "ardurover" in item.keywords and item.get_closest_marker("ardurover"):
            item.add_marker(skip)


def long_first(items, workers):
    """Return ``items`` so that each of equal parts, which is what a worker begins with, begins with its long ones."""
    long = [item for item in items if item.nodeid.startswith(LONG)]
    rest = [item for item in items if not item.nodeid.startswith(LONG)]
    ends = [len(rest) * n // workers for n in range(workers + 1)]
    return [item for n in range(workers) for item in (*long[n::workers], *rest[ends[n] : ends[n + 1]])]


@pytest.fixture(scope="session")
def carried():
    """A folder of kernels as a package carries them, made once for the sources as they are."""
    return as_packaged()  # by one of the tests' workers

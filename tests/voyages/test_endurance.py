"""Büsser's list: twenty-four hours without a human. No growth of memory, files bounded.

``python -m pytest -m campaign -k endurance`` sails the whole day (about ten minutes of one core). That the records of a
voyage are bounded over restarts is in test_recorder.
"""

import gc
from pathlib import Path

import pytest

from companion.clock import run_virtual
from companion.telemetry.folder.recorder import DECISIONS, STATE, TLOG, TRACK
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import load_scenario

SCENARIO = Path("sitl/scenarios/endurance.toml")
SETTLED_S = 2.0 * 3600.0  # every kind of thing has happened once by then
EVERY_S = 1800.0
# Of companion, autopilot and judge together. A day has 86 400 steps: one forgotten object in each would be seen.
MAY_GROW = 20_000  # objects
MAY_GROW_BYTES = 30_000_000
PAGE_BYTES = 4096
# Twice what a day was measured to write [bytes].
AT_MOST = {TLOG: 400_000_000, DECISIONS: 20_000_000, TRACK: 25_000_000, STATE: 300_000}


def resident_bytes():
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_BYTES


@pytest.mark.campaign
@pytest.mark.timeout(4 * 3600)
def test_endurance_a_day_without_a_human(tmp_path):
    seen = []

    def look(_, step):
        if step.snapshot.t_s >= SETTLED_S + EVERY_S * len(seen):
            gc.collect()
            seen.append((step.snapshot.t_s, len(gc.get_objects()), resident_bytes()))

    verdict = run_virtual(run_embedded(load_scenario(SCENARIO), SCENARIO, 1, tmp_path, on_status=look))
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    print(f"t s, objects, bytes: {seen[0]} to {seen[-1]}; files: {sizes}")  # shown by pytest -rA
    assert verdict.passed, verdict.checks
    assert len(seen) > 40
    assert seen[-1][1] - seen[0][1] < MAY_GROW, seen
    assert seen[-1][2] - seen[0][2] < MAY_GROW_BYTES, seen
    assert all(sizes[name] <= most for name, most in AT_MOST.items()), sizes

"""After ``warm`` a boat under way waits for no compiler."""

import subprocess
import sys

from tests.planner.problems import CONSTANT, POLAR, box

PROGRAM = """
from numba.core.dispatcher import Dispatcher
from companion.planner import Problem, plan
from companion.planner.solve import warm
from tests.planner.problems import simple

warm()
late, compile_or_load = [], Dispatcher.compile

def noted(self, signature):
    late.append(self.py_func.__qualname__)
    return compile_or_load(self, signature)

Dispatcher.compile = noted
for change in CHANGES:
    assert plan(Problem.from_json(simple(**change)), expansions=3000).has_path, change
print(sorted(set(late)))
"""


def test_nothing_is_left_to_compile():
    block = ["POLYGON ((-15 40, 15 40, 15 60, -15 60, -15 40))"]
    boat = {"no_go_half_deg": 45.0, "max_twa_deg": 170.0, "turn_rate_rad_s": 0.5, "speed": POLAR}
    uncertain = {
        "from_deg": 0,
        "speed_mps": 5,
        "sigma": {"model": "kalman", "sigma0_deg": 2, "growth_deg_per_sqrt_s": 0.2},
    }
    vessel = {
        "x": 60,
        "y": 50,
        "radius_m": 5,
        "spread": {
            "vessel": 1,
            "x": 60,
            "y": 50,
            "course_deg": 270,
            "keep_m": 5,
            "along_m": 5,
            "across_m": 5,
            "sigma_m": 2,
        },
    }
    changes = [
        {"obstacles": block, "boat": {**boat, "tack_loss_s": 4.0, "gybe_loss_s": 1.0}},
        {"obstacles": block, "boat": {**boat, "can_tack": False}, "wind": uncertain},
        {"boat": boat, "wind": uncertain, "targets": [vessel]},
        {"boat": {**boat, "speed": CONSTANT}, "fence": box(-200, -60, 200, 400)},
    ]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.replace("CHANGES", repr(changes))],
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"

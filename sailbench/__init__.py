"""The bench that others can run: problems, an exact scorer, a boat to steer, baselines, and a page of who did what.

Importing it makes the environments known: ``gymnasium.make("sailbench/Rocks-v0")``, and without an import
``gymnasium.make("sailbench:sailbench/Rocks-v0")``.
"""

from sailbench.environment import SailingEnv, register
from sailbench.planners import BASELINES, IMPOSSIBLE, Answer, Planner
from sailbench.problem_set import Known, answers, problems

__all__ = ["BASELINES", "IMPOSSIBLE", "Answer", "Known", "Planner", "SailingEnv", "answers", "problems"]

register()

"""Planning: a ``Problem`` becomes a ``Plan`` that is safe with the probability it states and near the fastest.

>>> from companion.planner import Problem, plan
>>> answer = plan(Problem.from_json("problem.json"), budget_s=1.0)  # doctest: +SKIP
>>> answer.status, answer.waypoints_en, answer.cost_s, answer.lower_bound_s  # doctest: +SKIP
"""

from __future__ import annotations

from companion.planner.plan import Leg, Plan, PlanStatus, Why
from companion.planner.problem.value import Problem
from companion.planner.solve import plan
from companion.planners import ALGORITHMS

__all__ = ["ALGORITHMS", "Leg", "Plan", "PlanStatus", "Problem", "Why", "plan"]

"""The planning problem: the value, its JSON, what is wrong with it, and the exact scorer of paths."""

from companion.planner.problem.defects import defect_of
from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.json_write import strength_dict
from companion.planner.problem.parts import BoatLimits, RiskLimit, Sigma, Target, Wind
from companion.planner.problem.sharing import resolved, sigmas_for, vessel_count
from companion.planner.problem.strength import ASSUMED_SHARE, Strength, assumed
from companion.planner.problem.value import VESSELS_SHARE

__all__ = [
    "ASSUMED_SHARE", "VESSELS_SHARE", "BoatLimits", "RiskLimit", "Sigma", "Strength", "Target", "Wind", "assumed",
    "defect_of", "evaluate", "resolved", "sigmas_for", "strength_dict", "vessel_count",
]

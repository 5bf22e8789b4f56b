"""The planning problem: the value, its JSON, what is wrong with it, and the exact scorer of paths."""

from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.parts import ASSUMED_SHARE, BoatLimits, ProblemWind, RiskLimit, Sigma, Strength, assumed
from companion.planner.problem.value import VESSELS_SHARE, defect_of, resolved, sigmas_for, vessel_count

__all__ = [
    "ASSUMED_SHARE",
    "VESSELS_SHARE",
    "BoatLimits",
    "ProblemWind",
    "RiskLimit",
    "Sigma",
    "Strength",
    "assumed",
    "defect_of",
    "evaluate",
    "resolved",
    "sigmas_for",
    "vessel_count",
]

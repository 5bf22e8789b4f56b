"""The risk of a plan: from the wind over its whole length, and from vessels that are not sure."""

from companion.planner.risk.arrival import arrival, limits_in_words
from companion.planner.risk.arrival import in_words as arrival_in_words
from companion.planner.risk.chance_constraint import path_risk, with_risk
from companion.planner.risk.tacks import of_risky, tacks_at_risk

__all__ = ["arrival", "arrival_in_words", "limits_in_words", "of_risky", "path_risk", "tacks_at_risk", "with_risk"]

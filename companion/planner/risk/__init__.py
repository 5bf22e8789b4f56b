"""The risk of a plan: from the wind over its whole length, and from vessels that are not sure."""

from companion.planner.risk.wind import path_risk, simulate_entries, with_risk

__all__ = ["path_risk", "simulate_entries", "with_risk"]

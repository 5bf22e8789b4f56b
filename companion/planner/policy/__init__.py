"""What to do wherever she comes to be: the time to go by place, tack and shift, and the best action there."""

from companion.planner.policy.policy import PORT, STARBOARD, Decision, Policy
from companion.planner.policy.shifts import Shifts, steady, wandering
from companion.planner.policy.solver import room_m, solve

__all__ = ["PORT", "STARBOARD", "Decision", "Policy", "Shifts", "room_m", "solve", "steady", "wandering"]

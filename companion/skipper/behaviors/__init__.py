"""Behaviors: getting under way, steering, loitering, stopping, and taking the helm again."""

from companion.skipper.behaviors.drifting import CALL
from companion.skipper.behaviors.failsafe import TOLD_S
from companion.skipper.behaviors.shoaling import SHOALING, TURN_S

__all__ = ["CALL", "SHOALING", "TOLD_S", "TURN_S"]

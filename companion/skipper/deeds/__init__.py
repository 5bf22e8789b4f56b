"""Deeds: getting under way, steering, loitering, stopping, and taking the helm again."""

from companion.skipper.deeds.adrift import CALL
from companion.skipper.deeds.failsafe import TOLD_S

__all__ = ["CALL", "TOLD_S"]

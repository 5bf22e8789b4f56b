"""The skipper: when to plan again, how a new plan takes the place of the old one, what to do when something is wrong.

Pure rules. ``Skipper(voyage=..., config=...).step(state, snapshot) -> (state, actions)``.
"""

from companion.skipper.rules import Skipper
from companion.skipper.step import SkipperConfig, SkipperState
from companion.skipper.way.voyage import Voyage

__all__ = ["Skipper", "SkipperConfig", "SkipperState", "Voyage"]

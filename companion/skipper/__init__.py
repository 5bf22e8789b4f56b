"""The skipper: when to plan again, how a new plan takes the place of the old one, what to do when something is wrong.

Pure rules. ``Skipper(voyage=..., config=...).step(state, snapshot) -> (state, actions)``.
"""

from companion.skipper.rules import Skipper
from companion.skipper.step.config import ALL_PERMITTED, DRY_RUN, Permissions, ReplanPolicy, SafeEnd, SkipperConfig
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import Snapshot
from companion.skipper.step.state import Phase, SkipperState
from companion.skipper.way.voyage import Goal, Side, Voyage

__all__ = [
    "ALL_PERMITTED", "DRY_RUN", "Goal", "Permissions", "Persisted", "Phase", "ReplanPolicy", "SafeEnd", "Side",
    "Skipper", "SkipperConfig", "SkipperState", "Snapshot", "Voyage",
]

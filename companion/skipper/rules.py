"""The skipper: ``step(state, snapshot) -> (state, actions)``, a pure fold over a voyage's snapshots."""

from __future__ import annotations

from dataclasses import dataclass

from companion.skipper.actions import Action
from companion.skipper.config import SkipperConfig
from companion.skipper.snapshot import Snapshot
from companion.skipper.state import Persisted, SkipperState
from companion.skipper.voyage import Voyage


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipper:
    """The rules for one voyage. No state of its own: everything is in ``SkipperState``."""

    voyage: Voyage
    config: SkipperConfig

    def initial(self, persisted: Persisted | None = None) -> SkipperState:
        """Return the first state; with ``persisted`` the mission on the autopilot may be adopted by its content."""
        raise NotImplementedError

    def step(self, state: SkipperState, snapshot: Snapshot) -> tuple[SkipperState, tuple[Action, ...]]:
        """Return the next state and what to do now. Call it about once a second, always, whatever is missing."""
        raise NotImplementedError

    def persisted(self, state: SkipperState) -> Persisted:
        """Return what must be on disk before the actions of this step are carried out."""
        raise NotImplementedError

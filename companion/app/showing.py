"""Who watches a voyage: its view at each step, made once for all of them, and only where somebody watches."""

from __future__ import annotations

import functools
from collections.abc import Callable

from companion.fold import Step
from companion.guard import Auxiliary, Guard
from companion.messages import CompanionStatus
from companion.skipper.step import SkipperConfig
from companion.skipper.way import Voyage
from companion.telemetry.folder import VoyageFigures
from companion.view import Area, Event, View, ViewFold

OnView = Callable[[View, tuple[Event, ...], Step], None]


class Showing:
    """Makes the view of each step and hands it to the watchers; none of them is worth the voyage.

    ``epoch_s`` is the Unix time [s] of the loop's time 0; ``guard`` knows of what went wrong with it.
    """

    def __init__(self, voyage: Voyage, config: SkipperConfig, epoch_s: float, guard: Guard) -> None:
        self.epoch_s = epoch_s
        self._voyage, self._config = voyage, config
        self._made: ViewFold | None = None
        self._guard = guard
        self.watchers: list[OnView] = []
        self.is_kept = False   # made although nobody watches yet: who comes later wants to know of the plan in force

    @property
    def area(self) -> Area:
        """The area of the voyage, as it is drawn."""
        return self._fold.area

    @property
    def _fold(self) -> ViewFold:
        if self._made is None:
            self._made = ViewFold(self._voyage, self._config, epoch_s=self.epoch_s)
        return self._made

    def take(self, step: Step, status: CompanionStatus, figures: VoyageFigures) -> None:
        """Show one step."""
        if not (self.watchers or self.is_kept):
            return
        made = self._guard.call(Auxiliary.VIEW, lambda: self._fold.take(step, status, figures))
        if made is None:
            return
        view, events = made
        for watcher in tuple(self.watchers):
            self._guard.call(Auxiliary.VIEW, functools.partial(watcher, view, events, step))

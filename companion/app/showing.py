"""Who watches a voyage: its view at each step, made once for all of them, and only where somebody watches."""

from __future__ import annotations

from collections.abc import Callable

from companion.fold import Step
from companion.messages import CompanionStatus
from companion.skipper.step import SkipperConfig
from companion.skipper.way import Voyage
from companion.telemetry.folder import VoyageFigures
from companion.view import Area, Event, View, ViewFold

OnView = Callable[[View, tuple[Event, ...], Step], None]


class Showing:
    """Makes the view of each step and hands it to the watchers; none of them is worth the voyage.

    ``epoch_s`` is the Unix time [s] of the loop's time 0; ``on_fault`` hears, once, of what went wrong with it.
    """

    def __init__(
        self, voyage: Voyage, config: SkipperConfig, epoch_s: float, on_fault: Callable[[str], None],
    ) -> None:
        self.epoch_s = epoch_s
        self._voyage, self._config = voyage, config
        self._made: ViewFold | None = None
        self._on_fault = on_fault
        self._faults: set[str] = set()
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
        try:
            view, events = self._fold.take(step, status, figures)
        except Exception as error:
            self._failed(f"the view of this step could not be made: {error!r}")
            return
        for watcher in tuple(self.watchers):
            try:
                watcher(view, events, step)
            except Exception as error:
                self._failed(f"a view could not be shown: {error!r}")

    def _failed(self, text: str) -> None:
        if text not in self._faults and len(self._faults) < 8:
            self._faults.add(text)
            self._on_fault(text)

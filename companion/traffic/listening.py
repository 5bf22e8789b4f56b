"""The AIS feeds of a voyage: opened, listened to, and told of when they fall silent."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from companion.errors import LinkError
from companion.messages import AisReport
from companion.traffic.feeds import AisFeed, open_feed

# More AIS reports than this between two steps are noise or an attack: the rest of them is dropped.
FED_AT_MOST = 500


class Feeds:
    """The feeds that are open, and what they heard since it was last asked for."""

    def __init__(self) -> None:
        self.open_feeds: list[AisFeed] = []
        self.dropped = 0
        self._heard: list[AisReport] = []
        self._silent: set[str] = set()   # feeds of which it was said

    async def open(self, stack: contextlib.AsyncExitStack, names: Sequence[str], seed: int) -> list[str]:
        """Listen to the feeds for as long as ``stack`` lives; return why any of them could not be opened."""
        refusals = []
        for number, name in enumerate(names):
            try:
                feed = await stack.enter_async_context(open_feed(name, self._on_report, seed=seed + number))
            except LinkError as error:
                refusals.append(str(error))
            else:
                self.open_feeds.append(feed)
        return refusals

    def take(self) -> list[AisReport]:
        """Return what was heard since the last call."""
        heard, self._heard = self._heard, []
        return heard

    def changed(self) -> list[AisFeed]:
        """Return the feeds that fell silent or are heard again since the last call."""
        changed = [feed for feed in self.open_feeds if feed.is_silent != (feed.name.text in self._silent)]
        self._silent ^= {feed.name.text for feed in changed}
        return changed

    def _on_report(self, report: AisReport) -> None:
        if len(self._heard) < FED_AT_MOST:
            self._heard.append(report)
        else:
            self.dropped += 1

"""What a page is shown: a voyage under way, or one that is recorded.

A view is encoded once and lies in one slot; a client that is slow misses some. The log is a ring with numbers: who
comes back names the last that he has, and gets the rest as far as it is kept.
"""

from __future__ import annotations

import asyncio
import gzip
import math
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Self

import msgspec

from companion import __version__
from companion.orders import Answer, Wanted
from companion.planner import Plan
from companion.view import SCHEMA, AreaView, Event, Past, Trail, View, sample_of
from companion.view.passage import PlannedPassage, passage_view

KEPT = 600  # events: at most a few hundred kB


class Hub:
    """The newest view and the log. ``closed`` when the voyage is over."""

    def __init__(self, kept: int = KEPT) -> None:
        self.view: bytes | None = None
        self.is_closed = False
        self.version = 0  # of the view
        self._ring: deque[tuple[int, bytes]] = deque(maxlen=kept)
        self._waiting: set[asyncio.Event] = set()
        self.watchers = 0

    def publish(self, view: View, events: Sequence[Event]) -> None:
        """Take the next view and what has happened."""
        for event in events:
            self._ring.append((event.number, msgspec.json.encode(event)))
        self.view = msgspec.json.encode(view)
        self.version += 1
        self._wake()

    def close(self) -> None:
        """Say that nothing comes any more."""
        self.is_closed = True
        self._wake()

    def _wake(self) -> None:
        for event in self._waiting:
            event.set()

    def enter(self, news: asyncio.Event) -> None:
        """Let one more watch; ``news`` is set when there is something new."""
        self._waiting.add(news)
        self.watchers += 1

    def leave(self, news: asyncio.Event) -> None:
        """Let one go."""
        self._waiting.discard(news)
        self.watchers -= 1

    def since(self, number: int) -> tuple[tuple[int, bytes], ...]:
        """Return the events that are kept after this one, with their numbers."""
        return tuple(event for event in self._ring if event[0] > number)

    def log(self) -> Callable[[], bytes]:
        """Return what makes the JSON array of the log that is kept now; a thread may call it while more comes."""
        kept = tuple(self._ring)
        return lambda: b"[" + b",".join(data for _, data in kept) + b"]"

    @property
    def last_number(self) -> int:
        """The number of the newest event, 0: there was none."""
        return self._ring[-1][0] if self._ring else 0


class Watcher:
    """One client of a hub; ``number`` is the last event that he has. A context manager."""

    def __init__(self, hub: Hub, number: int) -> None:
        # a number that we never gave is of a voyage before this one
        self._hub, self._number = hub, number if number <= hub.last_number else 0
        self._version = -1
        self._news = asyncio.Event()

    def __enter__(self) -> Self:
        self._hub.enter(self._news)
        return self

    def __exit__(self, *unused: object) -> None:
        self._hub.leave(self._news)

    def wake(self) -> None:
        """Let ``wait`` return."""
        self._news.set()

    async def wait(self, at_most_s: float) -> bytes:
        """Return what is new as server-sent events, nothing after ``at_most_s`` [s]."""
        hub = self._hub
        if self._version == hub.version and not hub.is_closed:
            self._news.clear()
            try:
                async with asyncio.timeout(at_most_s):
                    await self._news.wait()
            except TimeoutError:
                return b": still here\n\n"
        parts = []
        for number, data in hub.since(self._number):
            parts.append(b"id: %d\nevent: log\ndata: %s\n\n" % (number, data))
            self._number = number
        if hub.view is not None and self._version != hub.version:
            parts.append(b"event: view\ndata: %s\n\n" % hub.view)
        self._version = hub.version
        if hub.is_closed:
            parts.append(b"event: over\ndata: {}\n\n")
        return b"".join(parts)


def _laid(planned: PlannedPassage, area: AreaView) -> bytes:
    """Return the JSON of a passage in an area's metres."""
    return msgspec.json.encode(passage_view(planned, area.frame.array_en_from_lonlat))


CHUNK = 60  # recorded views in one answer
MOST_MOMENTS = 7200  # of a recorded voyage: more are thinned out
GZIP_LEVEL = 5

Ask = Callable[[Wanted], Awaitable[Answer]]
Preview = Callable[[Wanted], Awaitable[dict[str, Any]]]


@dataclass(kw_only=True)
class LiveSource:
    """A voyage under way (or the radio's): ``show`` takes the steps; ``ask`` and ``preview`` None: it only shows."""

    name: str
    kind: str = "live"
    unix_s: float | None = None  # of t_s = 0
    ask: Ask | None = None
    preview: Preview | None = None
    permitted: tuple[str, ...] = ()
    hub: Hub = field(default_factory=Hub)
    area: AreaView | None = None
    trail: Trail = field(default_factory=Trail)
    planned: PlannedPassage | None = None
    passage_said: str = ""  # why no passage is shown
    _placed: tuple[str, bytes] | None = field(default=None, repr=False)  # of an area, by its hash

    def show(self, view: View, events: Sequence[Event], area: AreaView | None) -> None:
        """Show the next step."""
        if self.area is not None and area is not None and area.hash != self.area.hash:
            self.trail.follow(self.area.frame, area.frame)  # a passage: the metres count from elsewhere now
        self.area = area
        if view.unix_s is not None:
            self.unix_s = view.unix_s - view.t_s
        self.trail.add(sample_of(view))
        self.hub.publish(view, events)

    def hello(self) -> dict[str, Any]:
        """Return what a page has to know first."""
        return {
            "schema": SCHEMA,
            "version": __version__,
            "kind": self.kind,
            "name": self.name,
            "orders": list(self.permitted) if self.ask is not None else None,
            "count": None,
            "chunk": None,
            "area": None if self.area is None else self.area.hash,
            "passage": self.planned is not None,
            "passage_said": self.passage_said,
        }

    def passage(self) -> Callable[[], bytes] | None:
        """Return what makes the JSON of the planned passage in the area's metres, once for each; None: none is."""
        planned, area = self.planned, self.area
        if planned is None or area is None:
            return None

        def make() -> bytes:
            placed = self._placed
            if placed is None or placed[0] != area.hash:
                placed = self._placed = area.hash, _laid(planned, area)
            return placed[1]

        return make

    def past(self) -> Callable[[], bytes]:
        """Return what makes the JSON of the samples so far; a thread may call it while more come."""
        samples, unix_s = tuple(self.trail.samples), self.unix_s
        return lambda: msgspec.json.encode(Past.of(samples, unix_s))


class RecordedSource:
    """A recorded voyage, whole in memory: its views packed by chunks."""

    def __init__(self, name: str, area: AreaView, *, is_whole: bool, count: int) -> None:
        self.name, self.area, self.is_whole = name, area, is_whole
        self._every = max(1, -(-count // MOST_MOMENTS))
        self.trail = Trail(most=2 * MOST_MOMENTS)
        self._events: list[Event] = []
        self._waiting: list[bytes] = []
        self.chunks: list[bytes] = []
        self.times: list[float] = []
        self._seen = 0
        self.unix_s: float | None = None
        self.sails_s: float | None = None
        self.last: View | None = None
        self.beside: RecordedSource | None = None  # another voyage, to compare with
        self.planned: PlannedPassage | None = None
        self.passage_said = ""  # why no passage is shown

    def take(self, view: View, events: Sequence[Event]) -> None:
        """Take the next moment; of a very long voyage those in which nothing happened are thinned out."""
        self._events += events
        self._seen += 1
        self.last = view
        if self.sails_s is None and view.state.is_sailing:
            self.sails_s = view.t_s
        if view.unix_s is not None:
            self.unix_s = view.unix_s - view.t_s
        if self._every > 1 and self._seen % self._every and not events:
            return
        self.times.append(view.t_s)
        self.trail.add(sample_of(view))
        self._waiting.append(msgspec.json.encode(view))
        if len(self._waiting) == CHUNK:
            self._pack()

    def finish(self) -> None:
        """Pack what is left."""
        if self._waiting:
            self._pack()

    def _pack(self) -> None:
        self.chunks.append(gzip.compress(b"[" + b",".join(self._waiting) + b"]", GZIP_LEVEL, mtime=0))
        self._waiting = []

    def hello(self) -> dict[str, Any]:
        """Return what a page has to know first."""
        return {
            "schema": SCHEMA,
            "version": __version__,
            "kind": "recorded",
            "name": self.name,
            "orders": None,
            "count": len(self.times),
            "chunk": CHUNK,
            "area": self.area.hash,
            "sails_s": self.sails_s,
            "beside": None if self.beside is None else self.beside.name,
            "passage": self.planned is not None,
            "passage_said": self.passage_said,
        }

    def log(self) -> bytes:
        """Return the log, as JSON."""
        return msgspec.json.encode(self._events)

    def passage(self) -> Callable[[], bytes] | None:
        """Return what makes the JSON of the passage that was planned, in the area's metres; None: none was."""
        return None if self.planned is None else partial(_laid, self.planned, self.area)

    def compared(self) -> Callable[[], bytes] | None:
        """Return what makes the JSON of the voyage beside this one, in this one's metres; None: there is none."""
        return None if self.beside is None else partial(self._compared, self.beside)

    def _compared(self, other: RecordedSource) -> bytes:
        east_m = math.remainder(other.area.origin_lon_deg - self.area.origin_lon_deg, 360.0) * self.area.lon_m
        north_m = (other.area.origin_lat_deg - self.area.origin_lat_deg) * self.area.lat_m
        moved = [
            replace(
                s,
                east_m=None if s.east_m is None else round(s.east_m + east_m, 1),
                north_m=None if s.north_m is None else round(s.north_m + north_m, 1),
            )
            for s in other.trail.samples
        ]
        return msgspec.json.encode(
            {
                "name": other.name,
                "sails_s": other.sails_s,
                "past": Past.of(moved, other.unix_s),
                "figures": None if other.last is None else other.last.figures,
            }
        )

    def past(self) -> Callable[[], bytes]:
        """Return what makes the JSON of the whole voyage's samples: a row for each moment."""
        return lambda: msgspec.json.encode(Past.of(self.trail.samples, self.unix_s))


def plan_figures(plan: Plan) -> dict[str, Any]:
    """Return time [s], length and clearance [m], risks and manoeuvres of a plan that has a path.

    ``late_s``: there by then in nine cases of ten; None: it does not say, or not in any time.
    """
    clear = [leg.clearance_m for leg in plan.legs if leg.clearance_m is not None]
    late_s = None if plan.arrival is None or not math.isfinite(plan.arrival.late_s) else round(plan.arrival.late_s)
    return {
        "time_s": round(plan.cost_s, 1),
        "late_s": late_s,
        "length_m": round(sum(leg.length_m for leg in plan.legs), 1),
        "risk": None if plan.risk is None or not math.isfinite(plan.risk) else round(plan.risk, 4),
        "risks": [None if leg.risk is None else round(leg.risk, 4) for leg in plan.legs],
        "tacks": sum(leg.manoeuvre == "tack" for leg in plan.legs),
        "gybes": sum(leg.manoeuvre == "gybe" for leg in plan.legs),
        "clearance_m": round(min(clear), 1) if clear else None,
    }

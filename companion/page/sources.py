"""What a page is shown: a voyage under way, or one that is recorded."""

from __future__ import annotations

import gzip
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import msgspec

from companion import __version__
from companion.orders import Answer, Wanted
from companion.page.hub import Hub
from companion.view import SCHEMA, Area, Event, Past, Trail, View, sample_of

CHUNK = 60            # recorded views in one answer
MOST_MOMENTS = 7200   # of a recorded voyage: more are thinned out
GZIP_LEVEL = 5

Ask = Callable[[Wanted], Awaitable[Answer]]
Preview = Callable[[Wanted], Awaitable[dict[str, Any]]]


@dataclass(kw_only=True)
class Live:
    """A voyage under way (or the radio's): ``show`` takes the steps; ``ask`` and ``preview`` None: it only shows."""

    name: str
    kind: str = "live"
    unix_s: float | None = None          # of t_s = 0
    ask: Ask | None = None
    preview: Preview | None = None
    permitted: tuple[str, ...] = ()
    hub: Hub = field(default_factory=Hub)
    area: Area | None = None
    trail: Trail = field(default_factory=Trail)

    def show(self, view: View, events: Sequence[Event], area: Area | None) -> None:
        """Show the next step."""
        if self.area is not None and area is not None and area.hash != self.area.hash:
            self.trail.follow(self.area.frame, area.frame)   # a passage: the metres count from elsewhere now
        self.area = area
        self.trail.add(sample_of(view))
        self.hub.publish(view, events)

    def hello(self) -> dict[str, Any]:
        """Return what a page has to know first."""
        return {"schema": SCHEMA, "version": __version__, "kind": self.kind, "name": self.name,
                "orders": list(self.permitted) if self.ask is not None else None, "count": None, "chunk": None,
                "area": None if self.area is None else self.area.hash}

    def past(self) -> Callable[[], bytes]:
        """Return what makes the JSON of the samples so far; a thread may call it while more come."""
        samples, unix_s = tuple(self.trail.samples), self.unix_s
        return lambda: msgspec.json.encode(Past.of(samples, unix_s))


class Record:
    """A recorded voyage, whole in memory: its views packed by chunks."""

    def __init__(self, name: str, area: Area, *, is_whole: bool, count: int) -> None:
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
        self.beside: Record | None = None   # another voyage, to compare with

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
        return {"schema": SCHEMA, "version": __version__, "kind": "recorded", "name": self.name, "orders": None,
                "count": len(self.times), "chunk": CHUNK, "area": self.area.hash, "sails_s": self.sails_s,
                "beside": None if self.beside is None else self.beside.name}

    def log(self) -> bytes:
        """Return the log, as JSON."""
        return msgspec.json.encode(self._events)

    def compared(self) -> Callable[[], bytes] | None:
        """Return what makes the JSON of the voyage beside this one, in this one's metres; None: there is none."""
        return None if self.beside is None else partial(self._compared, self.beside)

    def _compared(self, other: Record) -> bytes:
        east_m = (other.area.origin_lon_deg - self.area.origin_lon_deg) * self.area.lon_m
        north_m = (other.area.origin_lat_deg - self.area.origin_lat_deg) * self.area.lat_m
        moved = [replace(
            s, east_m=None if s.east_m is None else round(s.east_m + east_m, 1),
            north_m=None if s.north_m is None else round(s.north_m + north_m, 1)) for s in other.trail.samples]
        return msgspec.json.encode({
            "name": other.name, "sails_s": other.sails_s, "past": Past.of(moved, other.unix_s),
            "figures": None if other.last is None else other.last.figures})

    def past(self) -> Callable[[], bytes]:
        """Return what makes the JSON of the whole voyage's samples: a row for each moment."""
        return lambda: msgspec.json.encode(Past.of(self.trail.samples, self.unix_s))

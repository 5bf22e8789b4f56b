"""AIS receivers, event feeds and depth sounders: the shell that reads them (serial, UDP, TCP) and hands over reports.

The one module of this room with sockets. A feed is named like a link::

    udpin:0.0.0.0:10110      datagrams of NMEA sentences, or of JSON (a datagram that begins with {)
    tcp:HOST:PORT            a multiplexer that serves NMEA lines
    /dev/ttyUSB0:38400       a receiver on a serial port

A feed never raises once it is open: streams connect again for ever with capped jitter, over TCP also after a minute
in which nothing came; noise is counted.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from companion.addresses import host_port
from companion.clock import ended, now_s
from companion.errors import InputError, LinkError
from companion.guard import kept
from companion.traffic.nmea import DecodeCounts

Report = TypeVar("Report", covariant=True)  # noqa: PLC0105 - what a feed tells of


class Decoder(Protocol[Report]):
    """Sentences, and datagrams of JSON, to reports; neither raises."""

    counts: DecodeCounts

    def feed(self, line: str | bytes, t_s: float) -> Report | None:
        """Return the report that a sentence completes."""

    def json(self, data: bytes, t_s: float) -> Report | None:
        """Return the report in a datagram of JSON."""


DEFAULT_BAUD = 38400  # ITU-R M.1371 receivers: NMEA 0183-HS
MAX_PARTIAL = 1024  # bytes without a line end: noise, dropped
FED_AT_MOST = 500  # reports between two steps: more are noise or an attack, and the rest is dropped
SILENT_S = 60.0  # a feed unheard for this long is stale: say so, AIS traffic or not


@dataclass(frozen=True, slots=True, kw_only=True)
class FeedName:
    """A parsed feed name."""

    text: str
    kind: str
    host: str = ""
    port: int = 0
    baud: int = DEFAULT_BAUD


def parse_feed(text: str, *, baud: int = DEFAULT_BAUD, source: str = "feed") -> FeedName:
    """Parse a feed name; ``baud``: of a serial port that names none, ``source``: where the name stands.

    Raises:
        InputError: it is not one.

    """
    kind, _, rest = text.partition(":")
    found = host_port(rest) if kind in {"udpin", "tcp"} else None
    if found is not None:
        return FeedName(text=text, kind=kind, host=found[0], port=found[1])
    match = re.fullmatch(r"(/[^\s:]+)(?::(\d{3,7}))?", text)
    if match:
        return FeedName(text=text, kind="serial", host=match[1], baud=int(match[2] or baud))
    raise InputError(source, text, "is not a feed", "write udpin:HOST:PORT, tcp:HOST:PORT or /dev/NAME:BAUD")


class Feed(Generic[Report]):
    """One feed in its life; make it with ``open_feed``."""

    def __init__(
        self, name: FeedName, on_report: Callable[[Report], None], decoder: Decoder[Report], *, seed: int = 0
    ) -> None:
        self.name = name
        self._on_report = on_report
        self._decoder = decoder
        self._seed = seed
        self._partial = b""
        self.connections = 0
        self.opened_s = now_s()
        self.last_heard_s: float | None = None
        self.last_error = ""

    @property
    def counts(self) -> DecodeCounts:
        """What came in and what became of it."""
        return self._decoder.counts

    @property
    def is_silent(self) -> bool:
        """Return whether nothing has come for a minute, since it was heard or opened."""
        return now_s() - (self.opened_s if self.last_heard_s is None else self.last_heard_s) > SILENT_S

    def sentence(self) -> str:
        """Return one line for the status."""
        c = self.counts
        heard = "never heard" if self.last_heard_s is None else f"heard {now_s() - self.last_heard_s:.0f} s ago"
        text = f"{self.name.text}: {heard}, {c.reports} reports of {c.lines} lines, {c.refused} refused"
        return f"{text}, {self.last_error}" if self.last_error else text

    # ------------------------------------------------------------------------------------------ bytes
    def datagram(self, data: bytes) -> None:
        """Take a datagram: JSON, or whole lines of NMEA."""
        t_s = now_s()
        self.last_heard_s = t_s
        if data.lstrip()[:1] == b"{":
            self.counts.lines += 1
            report = self._decoder.json(data, t_s)
            if report is None:
                self.counts.bad_form += 1
            else:
                self.counts.reports += 1
                self._on_report(report)
            return
        for line in data.splitlines()[:64]:
            self._line(line, t_s)

    def stream(self, data: bytes) -> None:
        """Take a piece of a byte stream: lines may be cut anywhere."""
        t_s = now_s()
        self.last_heard_s = t_s
        *lines, self._partial = (self._partial + data).split(b"\n")
        for line in lines:
            self._line(line, t_s)
        if len(self._partial) > MAX_PARTIAL:
            self._partial = b""
            self.counts.bad_form += 1

    def _line(self, line: bytes, t_s: float) -> None:
        if not line.strip():
            return
        report = self._decoder.feed(line, t_s)
        if report is not None:
            self._on_report(report)

    # ------------------------------------------------------------------------------------------- life
    async def run_stream(self) -> None:
        """Connect, read to the end, connect again; for ever."""

        def failed(why: str) -> None:
            self.last_error = why

        await kept(self._read_stream, failed, seed=self._seed)

    async def _read_stream(self) -> None:
        reader, writer = await self._open_stream()
        try:
            self.connections += 1
            self.last_error, self._partial = "", b""
            # Over TCP one that is half open (the other side lost its power) is as quiet as the sea.
            limit_s = SILENT_S if self.name.kind == "tcp" else None
            while data := await asyncio.wait_for(reader.read(4096), limit_s):
                self.stream(data)
        finally:
            writer.close()
        raise ConnectionError("closed by the other end")

    async def _open_stream(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        if self.name.kind == "tcp":
            async with asyncio.timeout(10.0):
                return await asyncio.open_connection(self.name.host, self.name.port)
        import serial_asyncio_fast

        return await serial_asyncio_fast.open_serial_connection(
            url=self.name.host, baudrate=self.name.baud, exclusive=True
        )


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, feed: Feed[Any]) -> None:
        self._feed = feed

    def datagram_received(self, data: bytes, addr: Any) -> None:  # noqa: ARG002 - asyncio's signature
        self._feed.datagram(data)

    def error_received(self, exc: Exception) -> None:
        self._feed.last_error = str(exc)


@contextlib.asynccontextmanager
async def open_feed(
    name: FeedName, on_report: Callable[[Report], None], decoder: Decoder[Report], what: str, *, seed: int = 0
) -> AsyncIterator[Feed[Report]]:
    """Run a feed while the block runs; ``on_report`` is called in the loop with each report; ``what`` is for words.

    Raises:
        LinkError: the local UDP port cannot be bound.

    """
    feed = Feed(name, on_report, decoder, seed=seed)
    loop = asyncio.get_running_loop()
    if feed.name.kind == "udpin":
        try:
            wire, _ = await loop.create_datagram_endpoint(
                lambda: _Datagrams(feed), local_addr=(feed.name.host, feed.name.port)
            )
        except OSError as error:
            raise LinkError(f"{what} {name.text}: {error}") from error
        feed.connections = 1
        try:
            yield feed
        finally:
            wire.close()
        return
    task = loop.create_task(feed.run_stream(), name=f"{what} {name.text}")
    try:
        yield feed
    finally:
        await ended(task)


class Feeds(Generic[Report]):
    """The feeds of a kind that are open, and what they heard since it was last asked for."""

    def __init__(self, what: str, decoder: Callable[[], Decoder[Report]]) -> None:
        self._what, self._decoder = what, decoder
        self.open_feeds: list[Feed[Report]] = []
        self.dropped = 0
        self._heard: list[Report] = []
        self._silent: set[str] = set()  # feeds of which it was said

    async def open(self, stack: contextlib.AsyncExitStack, names: Sequence[FeedName], seed: int) -> list[str]:
        """Listen to the feeds for as long as ``stack`` lives; return why any of them could not be opened."""
        refusals = []
        for number, name in enumerate(names):
            try:
                feed = await stack.enter_async_context(
                    open_feed(name, self._on_report, self._decoder(), self._what, seed=seed + number)
                )
            except LinkError as error:
                refusals.append(str(error))
            else:
                self.open_feeds.append(feed)
        return refusals

    def take(self) -> list[Report]:
        """Return what was heard since the last call."""
        heard, self._heard = self._heard, []
        return heard

    def changed(self) -> list[Feed[Report]]:
        """Return the feeds that fell silent or are heard again since the last call."""
        changed = [feed for feed in self.open_feeds if feed.is_silent != (feed.name.text in self._silent)]
        self._silent ^= {feed.name.text for feed in changed}
        return changed

    def _on_report(self, report: Report) -> None:  # type: ignore[misc]
        if len(self._heard) < FED_AT_MOST:
            self._heard.append(report)
        else:
            self.dropped += 1

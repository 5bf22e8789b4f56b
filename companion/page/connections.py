"""HTTP/1.1 by h11 on asyncio: connections, limits, and what every answer says. It never holds a voyage.

What is asked of it from elsewhere is refused: by Host (names bent to this machine), by Origin (pages of others), by the
content policy (nothing foreign is loaded). Who does not read is dropped; there is room for so many and no more.
"""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import hmac
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import h11
import msgspec

from companion.errors import JobError
from companion.page.address import Address, is_known, is_own

MOST_CONNECTIONS = 64
MOST_HEAD = 16_384        # bytes of a request's head
REQUEST_S = 10.0          # for a request to come in whole
IDLE_S = 30.0             # between two of one connection
BLOCKED_S = 10.0          # a client that does not read for so long is dropped
BUFFER = 65_536           # bytes that wait for a client
LAST_S = 0.3              # at the end
PACK_BYTES = 2_000        # less than that is not packed

POLICY = ("default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; "
          "object-src 'none'")
HEADERS = (
    ("Content-Security-Policy", POLICY),
    ("X-Content-Type-Options", "nosniff"), ("Referrer-Policy", "no-referrer"), ("X-Frame-Options", "DENY"),
    ("Cross-Origin-Resource-Policy", "same-origin"), ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Permissions-Policy", "geolocation=(), camera=(), microphone=()"),
)
JSON = "application/json"
MARK = b"x-companion"     # no form and no picture can send it


class Refused(Exception):  # noqa: N818
    """An answer other than 200."""

    def __init__(self, status: int, text: str, *, closes: bool = False) -> None:
        super().__init__(text)
        self.status, self.text, self.closes = status, text, closes


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """An answer: content and its kind; ``packed`` where it lies there gzipped already.

    ``tag``: it may be kept, and is asked for again by this. ``is_fixed``: what is at this path is never another.
    """

    kind: str = JSON
    data: bytes
    tag: str = ""
    packed: bytes | None = None
    is_fixed: bool = False


class Channel:
    """A connection that only goes on to be written to. ``on_gone`` is called when the other side hangs up."""

    def __init__(self, write: Callable[[bytes], Awaitable[None]], gone: asyncio.Task[None]) -> None:
        self.write, self._gone = write, gone

    @property
    def is_gone(self) -> bool:
        """Whether the other side has hung up."""
        return self._gone.done()

    def on_gone(self, call: Callable[[], None]) -> None:
        """Have something called then."""
        self._gone.add_done_callback(lambda _: call())


Stream = Callable[[Channel], Awaitable[None]]


class App(Protocol):
    """What is served: from a request that was let in comes a reply, or a stream of events."""

    most_body: int         # bytes that are posted at most

    async def reply(self, request: h11.Request, path: str, body: bytes) -> Reply | Stream:
        """Answer. Raises Refused."""


@contextlib.asynccontextmanager
async def listening(address: Address, app: App, *, pace: float = 1.0) -> AsyncIterator[Server]:
    """Serve while the body runs. ``pace``: seconds of the loop for each second.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    server = Server(address, app, pace)
    try:
        listener = await asyncio.start_server(
            server.accept, address.host, address.port, limit=MOST_HEAD, backlog=MOST_CONNECTIONS)
    except (OSError, UnicodeError) as error:
        words = getattr(error, "strerror", None) or str(error)
        in_use = getattr(error, "errno", None) in {98, 48, 10048}
        raise JobError(f"--http {address.host}:{address.port}: " + (
            "the port is in use; name another one" if in_use else f"cannot listen there ({words})")) from error
    if address.port == 0:   # any that is free
        server.address = replace(address, port=listener.sockets[0].getsockname()[1])
    try:
        yield server
    finally:
        listener.close()
        await server.end()


class Server:
    """The connections of an app."""

    def __init__(self, address: Address, app: App, pace: float) -> None:
        self.address, self.app, self._pace = address, app, pace
        self._talks: set[asyncio.Task[Any]] = set()
        self._writers: set[asyncio.StreamWriter] = set()
        self.dropped = 0

    def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Take a connection."""
        task = asyncio.create_task(self._talk(reader, writer), name="page: a connection")
        self._talks.add(task)
        task.add_done_callback(self._talks.discard)

    async def end(self) -> None:
        """End all connections; who watches has a moment to hear that it is over."""
        if self._talks:
            await asyncio.wait(self._talks, timeout=self.seconds(LAST_S))
        for writer in tuple(self._writers):
            writer.transport.abort()
        for task in tuple(self._talks):
            task.cancel()
        await asyncio.gather(*self._talks, return_exceptions=True)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one connection until it ends."""
        self._writers.add(writer)
        writer.transport.set_write_buffer_limits(high=BUFFER)
        try:
            if len(self._writers) <= MOST_CONNECTIONS:
                await _Connection(self, reader, writer).run()
        except (OSError, TimeoutError, h11.ProtocolError):
            pass   # gone, or speaks something else: nobody to tell
        finally:
            self._writers.discard(writer)
            writer.close()
            with contextlib.suppress(OSError, TimeoutError):
                async with asyncio.timeout(self.seconds(BLOCKED_S)):
                    await writer.wait_closed()
            writer.transport.abort()

    def seconds(self, seconds: float) -> float:
        """Return seconds as those of the loop."""
        return seconds * self._pace

    def check(self, request: h11.Request) -> None:
        """Raise for a request that does not come from our own page, or from who typed its address."""
        hosts = [v.decode("latin-1") for k, v in request.headers if k == b"host"]
        if len(hosts) != 1 or not is_known(hosts[0], self.address):
            raise Refused(421, "this is not the host that was asked for; name it with --http-name", closes=True)
        origin = header(request, b"origin")
        if origin and not is_own(origin, hosts[0]):
            raise Refused(403, "asked for by a page from elsewhere", closes=True)
        if request.method not in {b"GET", b"HEAD", b"POST"}:
            raise Refused(405, "there is GET, and POST for orders", closes=True)
        if request.method == b"POST" and not origin:
            raise Refused(403, "an order names the page that it comes from (Origin)", closes=True)


class _Connection:
    """One connection: requests one after another, or one stream of events."""

    def __init__(self, server: Server, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._server, self._reader, self._writer = server, reader, writer
        self._h11 = h11.Connection(h11.SERVER, max_incomplete_event_size=MOST_HEAD)

    async def run(self) -> None:
        """Answer until it ends."""
        wait_s = REQUEST_S
        while True:
            try:
                async with asyncio.timeout(self._server.seconds(wait_s)):
                    request = await self._event()
                    if not isinstance(request, h11.Request):
                        return
                    body = await self._body()
                self._server.check(request)
                if await self._answer(request, body):
                    return
            except Refused as refused:
                await self._send(refused.status, JSON, msgspec.json.encode({"error": refused.text}), closes=True)
                return
            except h11.RemoteProtocolError as error:
                if self._h11.our_state in {h11.IDLE, h11.SEND_RESPONSE}:
                    status = error.error_status_hint
                    await self._send(status, JSON, msgspec.json.encode({"error": "this is no request"}), closes=True)
                return
            if self._h11.our_state is not h11.DONE or self._h11.their_state is not h11.DONE:
                return
            self._h11.start_next_cycle()
            wait_s = IDLE_S

    async def _event(self) -> Any:
        while True:
            event = self._h11.next_event()
            if event is not h11.NEED_DATA:
                return event
            self._h11.receive_data(await self._reader.read(MOST_HEAD))

    async def _body(self) -> bytes:
        body, most = b"", self._server.app.most_body
        while True:
            event = await self._event()
            if isinstance(event, h11.Data):
                body += bytes(event.data)
                if len(body) > most:
                    raise Refused(413, f"at most {most} bytes are taken")
            else:
                return body

    async def _answer(self, request: h11.Request, body: bytes) -> bool:
        """Answer a request; True: the connection is used up."""
        path = request.target.decode("latin-1").partition("?")[0]
        reply = await self._server.app.reply(request, path, body)
        if not isinstance(reply, Reply):
            await self._stream(reply)
            return True
        await self._send_reply(request, reply)
        return False

    async def _send_reply(self, request: h11.Request, reply: Reply) -> None:
        kind, data, tag, packed = reply.kind, reply.data, reply.tag, reply.packed
        keeping = "private, max-age=86400, immutable" if reply.is_fixed else "no-cache" if tag else "no-store"
        headers = [("Cache-Control", keeping)]
        if tag:
            headers.append(("ETag", tag))
            if tag in header(request, b"if-none-match"):
                await self._send(304, kind, b"", headers, has_body=False)
                return
        is_head = request.method == b"HEAD"
        span = single_range(header(request, b"range"), len(data))
        if span is not None:
            if span[0] >= span[1]:
                headers.append(("Content-Range", f"bytes */{len(data)}"))
                await self._send(416, kind, b"", headers)
                return
            headers.append(("Content-Range", f"bytes {span[0]}-{span[1] - 1}/{len(data)}"))
            await self._send(206, kind, data[span[0]:span[1]], headers, has_body=not is_head)
            return
        takes_packed = "gzip" in header(request, b"accept-encoding") and not kind.startswith("image/")
        if takes_packed and packed is None and len(data) > PACK_BYTES:
            packed = await asyncio.to_thread(gzip.compress, data, 1, mtime=0)   # milliseconds: not on the voyage's loop
        if takes_packed and packed is not None:
            headers += [("Content-Encoding", "gzip"), ("Vary", "Accept-Encoding")]
            data = packed
        await self._send(200, kind, data, headers, has_body=not is_head)

    async def _send(
        self, status: int, kind: str, data: bytes, headers: list[tuple[str, str]] | None = None, *,
        has_body: bool = True, closes: bool = False,
    ) -> None:
        fields = [*HEADERS, ("Content-Type", kind), *(headers or [("Cache-Control", "no-store")])]
        if status != 304:
            fields.append(("Content-Length", str(len(data))))
        if closes:
            fields.append(("Connection", "close"))
        out = self._h11.send(h11.Response(status_code=status, headers=fields)) or b""
        if has_body and data:
            out += self._h11.send(h11.Data(data=data)) or b""
        out += self._h11.send(h11.EndOfMessage()) or b""
        await self._write(out)

    async def _write(self, data: bytes) -> None:
        self._writer.write(data)
        async with asyncio.timeout(self._server.seconds(BLOCKED_S)):
            await self._writer.drain()

    async def _stream(self, stream: Stream) -> None:
        fields = [*HEADERS, ("Content-Type", "text/event-stream"), ("Cache-Control", "no-store"),
                  ("Connection", "close")]
        await self._write(self._h11.send(h11.Response(status_code=200, headers=fields)) or b"")
        gone = asyncio.create_task(self._gone(), name="page: is he still there")
        try:
            await stream(Channel(self._write_part, gone))
        except TimeoutError:
            self._server.dropped += 1
            self._writer.transport.abort()
        finally:
            gone.cancel()

    async def _write_part(self, data: bytes) -> None:
        await self._write(self._h11.send(h11.Data(data=data)) or b"")

    async def _gone(self) -> None:
        """Return when the other side has hung up."""
        with contextlib.suppress(OSError):
            while await self._reader.read(1024):
                pass
        self._writer.transport.abort()


def require_token(request: h11.Request, token: str) -> None:
    """Raise Refused for a POST that is not JSON of a page of ours, or does not know the token."""
    if header(request, b"content-type").partition(";")[0].strip() != JSON or header(request, MARK) != "1":
        raise Refused(403, "what is posted is JSON, with X-Companion: 1")
    given = header(request, b"authorization")
    if not (token and hmac.compare_digest(given.encode(), f"Bearer {token}".encode())):
        raise Refused(401, "the token is missing or wrong")


def header(request: h11.Request, name: bytes) -> str:
    """Return a header's value, empty without it; of several the last."""
    return next((value.decode("latin-1") for key, value in reversed(request.headers.raw_items())
                 if key.lower() == name), "")


def single_range(text: str, size: int) -> tuple[int, int] | None:
    """Return the begin and the end of the one range that is asked for, None: all of it. Of several none is served.

    >>> single_range("bytes=0-99", 1000), single_range("bytes=-5", 10), single_range("bytes=0-1,3-4", 10)
    ((0, 100), (5, 10), None)
    """
    match = re.fullmatch(r"bytes=([0-9]{0,15})-([0-9]{0,15})", text.strip())
    if match is None or not (match[1] or match[2]):
        return None
    if not match[1]:
        return max(0, size - int(match[2])), size
    return int(match[1]), min(size, int(match[2]) + 1) if match[2] else size

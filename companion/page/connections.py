"""HTTP/1.1 by h11 on asyncio: connections, limits, and what every answer says. It never holds a voyage.

What is asked of it from elsewhere is refused: by Host (names bent to this machine), by Origin (pages of others), by the
content policy (nothing foreign is loaded); all of that, and who it is, before a byte of a body is read. Who does not
read is dropped, a request has to come in whole within a deadline however it drips, and there is room for so many: who
has asked for nothing the longest makes room for the next.
"""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import h11
import msgspec

from companion.clock import now_s
from companion.disk import Disk, read_regular, read_secret
from companion.errors import InputError, JobError, unreadable

LEAST_TOKEN = 22  # characters: 128 bits in base64
MOST_EMPTY = 65_536  # bytes of nothing that are looked through


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """Host and port to listen on; ``names`` are further names under which the page may be asked for."""

    host: str
    port: int
    names: tuple[str, ...] = ()
    token: str = field(default="", repr=False)  # of who may give orders; empty: nobody

    @property
    def url(self) -> str:
        """What to type into a browser.

        >>> Address(host="::1", port=80).url
        'http://[::1]:80/'
        """
        host = socket.gethostname() if self.host in {"", "0.0.0.0", "::"} else self.host  # noqa: S104
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/"


def is_known(host: str, address: Address) -> bool:
    """Return whether the Host of a request is one of ours: else a page of somebody has bent a name of his to us.

    An address is no name, and cannot be bent; the machine's own name, alone and under .local, is known too.
    """
    name, port = _split(host)
    if port != address.port:
        return False
    own = socket.gethostname().lower()
    names = {"localhost", own, f"{own.partition('.')[0]}.local", address.host.lower(), *address.names}
    return name in names or _is_ip(name)


def is_own(origin: str, host: str) -> bool:
    """Return whether an Origin is that of our own page, asked for as ``host``."""
    return origin.lower() == f"http://{host.lower()}"


def read_token(path: Path) -> str:
    """Return the token in a file, which is made, with mode 0600, where there is none.

    So is that of a file with nothing in it: a power cut left it, and nobody was given it.

    Raises:
        InputError: it cannot be read or made, others can read it, or what is in it is too short to be one.
    """
    remedy = "name a file in a folder that is there"
    try:
        if not path.exists() or not read_regular(path, MOST_EMPTY).strip(b"\0 \t\r\n"):
            Disk().replace(path, f"{secrets.token_urlsafe(24)}\n".encode(), mode=0o600)
    except OSError as error:
        raise unreadable(str(path), error, "the token", remedy) from error
    text = read_secret(path, "the token", remedy)
    if len(text) < LEAST_TOKEN or not text.isascii() or not text.isprintable() or " " in text:
        raise InputError(
            str(path),
            "",
            f"is no token: it needs {LEAST_TOKEN} characters or more, in one word",
            "remove it, and a new one is made",
        )
    return text


def _split(host: str) -> tuple[str, int]:
    """Return name and port of a Host header; port 0: it is malformed."""
    match = re.fullmatch(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9.-]+)(?::([0-9]{1,5}))?", host)
    if match is None:
        return "", 0
    return match[1].strip("[]").lower(), int(match[2] or 80)


def _is_ip(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


MOST_CONNECTIONS = 64
MOST_HEAD = 16_384  # bytes of a request's head
REQUEST_S = 10.0  # for a request to come in whole, from its first byte, or the connection's beginning
IDLE_S = 30.0  # between two of one connection
BLOCKED_S = 10.0  # a client that does not read for so long is dropped
BUFFER = 65_536  # bytes that wait for a client
LAST_S = 0.3  # at the end
LINGER_S = 1.0  # for what a refused client still sends: hung up on at once it would not read why
PACK_BYTES = 2_000  # less than that is not packed

POLICY = (
    "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; "
    "object-src 'none'"
)
HEADERS = (
    ("Content-Security-Policy", POLICY),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),
    ("X-Frame-Options", "DENY"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Permissions-Policy", "geolocation=(), camera=(), microphone=()"),
)
JSON = "application/json"
MARK = b"x-companion"  # no form and no picture can send it


class HttpRefusal(Exception):  # noqa: N818
    """An answer other than 200."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status, self.text = status, text


@dataclass(frozen=True, slots=True, kw_only=True)
class HttpReply:
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

    def admit(self, request: h11.Request, path: str) -> int:
        """Return how many bytes of a request's body are read, before any is. Raises HttpRefusal: it may not ask."""

    async def reply(self, request: h11.Request, path: str, body: bytes) -> HttpReply | Stream:
        """Answer what was let in. Raises HttpRefusal."""


class Guests:
    """Who is connected, at most so many: where it is full, who has waited the longest for nothing makes room.

    A guest is idle until a request of his is whole, however it drips, and while he does not read what he asked for; the
    former go first. Who is being answered stays.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._idle: dict[asyncio.StreamWriter, tuple[int, float] | None] = {}  # (rank, since when [s]); None: busy

    def __iter__(self) -> Iterator[asyncio.StreamWriter]:
        return iter(tuple(self._idle))

    def take(self, writer: asyncio.StreamWriter) -> bool:
        """Take one, idle from now on; False: all are busy, and there is no room."""
        if writer not in self._idle and len(self._idle) >= self._most:
            idle = [(since, each) for each, since in self._idle.items() if since is not None]
            if not idle:
                return False
            _, longest = min(idle, key=lambda found: found[0])
            del self._idle[longest]
            longest.transport.abort()
        self._idle[writer] = 0, now_s()
        return True

    def waits(self, writer: asyncio.StreamWriter, *, reads: bool = True) -> None:
        """Note that one is idle from now on: he has to ask, or with ``reads`` false to take what he asked for."""
        if writer in self._idle:
            self._idle[writer] = int(not reads), now_s()

    def is_answered(self, writer: asyncio.StreamWriter) -> None:
        """Note that one is being answered."""
        if writer in self._idle:
            self._idle[writer] = None

    def leave(self, writer: asyncio.StreamWriter) -> None:
        """Forget one."""
        self._idle.pop(writer, None)


@contextlib.asynccontextmanager
async def listening(address: Address, app: App, *, pace: float = 1.0) -> AsyncIterator[HttpServer]:
    """Serve while the body runs. ``pace``: seconds of the loop for each second.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    server = HttpServer(address, app, pace)
    try:
        listener = await asyncio.start_server(
            server.accept, address.host, address.port, limit=MOST_HEAD, backlog=MOST_CONNECTIONS
        )
    except (OSError, UnicodeError) as error:
        words = getattr(error, "strerror", None) or str(error)
        in_use = getattr(error, "errno", None) in {98, 48, 10048}
        raise JobError(
            f"--http {address.host}:{address.port}: "
            + ("the port is in use; name another one" if in_use else f"cannot listen there ({words})")
        ) from error
    if address.port == 0:  # any that is free
        server.address = replace(address, port=listener.sockets[0].getsockname()[1])
    try:
        yield server
    finally:
        listener.close()
        await server.end()


class HttpServer:
    """The connections of an app."""

    def __init__(self, address: Address, app: App, pace: float) -> None:
        self.address, self.app, self._pace = address, app, pace
        self._talks: set[asyncio.Task[Any]] = set()
        self.guests = Guests(MOST_CONNECTIONS)
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
        for writer in self.guests:
            writer.transport.abort()
        for task in tuple(self._talks):
            task.cancel()
        await asyncio.gather(*self._talks, return_exceptions=True)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one connection until it ends."""
        writer.transport.set_write_buffer_limits(high=BUFFER)
        try:
            if self.guests.take(writer):
                await _Connection(self, reader, writer).run()
        except (OSError, TimeoutError, h11.ProtocolError):
            pass  # gone, or speaks something else: nobody to tell
        finally:
            self.guests.leave(writer)
            writer.close()
            with contextlib.suppress(OSError, TimeoutError):
                async with asyncio.timeout(self.seconds(BLOCKED_S)):
                    await writer.wait_closed()
            writer.transport.abort()

    def seconds(self, seconds: float) -> float:
        """Return seconds as those of the loop."""
        return seconds * self._pace

    def admit(self, request: h11.Request) -> int:
        """Return how many bytes of body are read of a request.

        Raises:
            HttpRefusal: it does not come from our own page, nor from who typed its address, or may not be asked.
        """
        hosts = [v.decode("latin-1") for k, v in request.headers if k == b"host"]
        if len(hosts) != 1 or not is_known(hosts[0], self.address):
            raise HttpRefusal(421, "this is not the host that was asked for; name it with --http-name")
        origin = header(request, b"origin")
        if origin and not is_own(origin, hosts[0]):
            raise HttpRefusal(403, "asked for by a page from elsewhere")
        if request.method not in {b"GET", b"HEAD", b"POST"}:
            raise HttpRefusal(405, "there is GET, and POST for orders")
        if request.method == b"POST" and not origin:
            raise HttpRefusal(403, "an order names the page that it comes from (Origin)")
        if header(request, b"transfer-encoding"):  # of chunks of a byte each a body costs minutes of the loop
            raise HttpRefusal(411, "what is posted says how long it is (Content-Length)")
        most = self.app.admit(request, path_of(request))
        if int(header(request, b"content-length") or 0) > most:  # h11 has seen that it is a number
            raise HttpRefusal(413, f"at most {most} bytes are taken")
        return most


class _Connection:
    """One connection: requests one after another, or one stream of events."""

    def __init__(self, server: HttpServer, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._server, self._reader, self._writer = server, reader, writer
        self._h11 = h11.Connection(h11.SERVER, max_incomplete_event_size=MOST_HEAD)

    async def run(self) -> None:
        """Answer until it ends."""
        wait_s = REQUEST_S
        while True:
            try:
                asked = await self._request(wait_s)
                if asked is None:
                    return
                self._server.guests.is_answered(self._writer)
                if await self._answer(*asked):
                    return
            except HttpRefusal as refused:
                await self._send(refused.status, JSON, msgspec.json.encode({"error": refused.text}), closes=True)
                await self._linger()
                return
            except h11.RemoteProtocolError as error:
                if self._h11.our_state in {h11.IDLE, h11.SEND_RESPONSE}:
                    status = error.error_status_hint
                    await self._send(status, JSON, msgspec.json.encode({"error": "this is no request"}), closes=True)
                return
            if self._h11.our_state is not h11.DONE or self._h11.their_state is not h11.DONE:
                return
            self._h11.start_next_cycle()
            self._server.guests.waits(self._writer)
            wait_s = IDLE_S

    async def _request(self, wait_s: float) -> tuple[h11.Request, bytes] | None:
        """Return the next request that is let in and its body; None: there is none. Its first byte has ``wait_s``."""
        loop = asyncio.get_running_loop()
        async with asyncio.timeout(self._server.seconds(wait_s)) as limit:
            if not self._h11.trailing_data[0]:
                self._h11.receive_data(await self._reader.read(MOST_HEAD))
            limit.reschedule(loop.time() + self._server.seconds(REQUEST_S))
            request = await self._event()
            if not isinstance(request, h11.Request):
                return None
            self._server.admit(request)
            return request, await self._body()

    async def _linger(self) -> None:
        """Let a client that was refused read why: what it still sends is thrown away for a moment."""
        self._server.guests.waits(self._writer)
        with contextlib.suppress(OSError, TimeoutError):
            self._writer.write_eof()
            async with asyncio.timeout(self._server.seconds(LINGER_S)):
                while await self._reader.read(MOST_HEAD):
                    pass

    async def _event(self) -> Any:
        while True:
            event = self._h11.next_event()
            if event is not h11.NEED_DATA:
                return event
            self._h11.receive_data(await self._reader.read(MOST_HEAD))

    async def _body(self) -> bytes:
        body = bytearray()  # no longer than it said, and that is checked
        while isinstance(event := await self._event(), h11.Data):
            body += event.data
        return bytes(body)

    async def _answer(self, request: h11.Request, body: bytes) -> bool:
        """Answer a request; True: the connection is used up."""
        reply = await self._server.app.reply(request, path_of(request), body)
        if not isinstance(reply, HttpReply):
            await self._stream(reply)
            return True
        await self._send_reply(request, reply)
        return False

    async def _send_reply(self, request: h11.Request, reply: HttpReply) -> None:
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
            await self._send(206, kind, data[span[0] : span[1]], headers, has_body=not is_head)
            return
        takes_packed = "gzip" in header(request, b"accept-encoding") and not kind.startswith("image/")
        if takes_packed and packed is None and len(data) > PACK_BYTES:
            packed = await asyncio.to_thread(gzip.compress, data, 1, mtime=0)  # milliseconds: not on the voyage's loop
        if takes_packed and packed is not None:
            headers += [("Content-Encoding", "gzip"), ("Vary", "Accept-Encoding")]
            data = packed
        await self._send(200, kind, data, headers, has_body=not is_head)

    async def _send(
        self,
        status: int,
        kind: str,
        data: bytes,
        headers: list[tuple[str, str]] | None = None,
        *,
        has_body: bool = True,
        closes: bool = False,
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

    async def _write(self, data: bytes, *, is_stream: bool = False) -> None:
        self._writer.write(data)
        if not is_stream and self._writer.transport.get_write_buffer_size():
            self._server.guests.waits(self._writer, reads=False)
        async with asyncio.timeout(self._server.seconds(BLOCKED_S)):
            await self._writer.drain()

    async def _stream(self, stream: Stream) -> None:
        fields = [
            *HEADERS,
            ("Content-Type", "text/event-stream"),
            ("Cache-Control", "no-store"),
            ("Connection", "close"),
        ]
        await self._write(self._h11.send(h11.Response(status_code=200, headers=fields)) or b"", is_stream=True)
        gone = asyncio.create_task(self._gone(), name="page: is he still there")
        try:
            await stream(Channel(self._write_part, gone))
        except TimeoutError:
            self._server.dropped += 1
            self._writer.transport.abort()
        finally:
            gone.cancel()

    async def _write_part(self, data: bytes) -> None:
        await self._write(self._h11.send(h11.Data(data=data)) or b"", is_stream=True)

    async def _gone(self) -> None:
        """Return when the other side has hung up."""
        with contextlib.suppress(OSError):
            while await self._reader.read(1024):
                pass
        self._writer.transport.abort()


def require_token(request: h11.Request, token: str) -> None:
    """Raise Refused for a POST that is not JSON of a page of ours, or does not know the token."""
    if header(request, b"content-type").partition(";")[0].strip() != JSON or header(request, MARK) != "1":
        raise HttpRefusal(403, "what is posted is JSON, with X-Companion: 1")
    given = header(request, b"authorization")
    if not (token and hmac.compare_digest(given.encode(), f"Bearer {token}".encode())):
        raise HttpRefusal(401, "the token is missing or wrong")


def path_of(request: h11.Request) -> str:
    """Return what is asked for, without what is behind a question mark."""
    return request.target.decode("latin-1").partition("?")[0]


def header(request: h11.Request, name: bytes) -> str:
    """Return a header's value, empty without it; of several the last."""
    return next(
        (value.decode("latin-1") for key, value in reversed(request.headers.raw_items()) if key.lower() == name), ""
    )


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

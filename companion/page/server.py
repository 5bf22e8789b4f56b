"""The page's server: HTTP/1.1 by h11 on asyncio. It shows; it takes orders only with a token, and never holds a voyage.

What is asked of it from elsewhere is refused: by Host (names bent to this machine), by Origin (pages of others), by the
content policy (nothing foreign is loaded). Who does not read is dropped; there is room for so many and no more.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import re
from collections.abc import AsyncIterator
from typing import Any

import h11
import msgspec

from companion.errors import InputError, JobError
from companion.orders import phrase
from companion.page.address import Address, is_known, is_own
from companion.page.hub import Watcher
from companion.page.site import File, files
from companion.page.sources import Live, Record

MOST_WATCHERS = 16
MOST_CONNECTIONS = 64
MOST_HEAD = 16_384        # bytes of a request's head
MOST_BODY = 1_000
REQUEST_S = 10.0          # for a request to come in whole
IDLE_S = 30.0             # between two of one connection
BLOCKED_S = 10.0          # a client that does not read for so long is dropped
STILL_S = 15.0            # a word now and then, where nothing happens
BUFFER = 65_536           # bytes that wait for a client
LAST_S = 0.3              # at the end
ANSWER_S = 8.0            # for the answer to an order

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


class _Refused(Exception):  # noqa: N818
    """An answer other than 200."""

    def __init__(self, status: int, text: str, *, closes: bool = False) -> None:
        super().__init__(text)
        self.status, self.text, self.closes = status, text, closes


@contextlib.asynccontextmanager
async def served(address: Address, source: Live | Record, *, pace: float = 1.0) -> AsyncIterator[Server]:
    """Serve a page while the body runs. ``pace``: seconds of the loop for each second.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    server = Server(address, source, pace)
    try:
        listener = await asyncio.start_server(
            server.accept, address.host, address.port, limit=MOST_HEAD, backlog=MOST_CONNECTIONS)
    except (OSError, UnicodeError) as error:
        words = getattr(error, "strerror", None) or str(error)
        in_use = getattr(error, "errno", None) in {98, 48, 10048}
        raise JobError(f"--http {address.host}:{address.port}: " + (
            "the port is in use; name another one" if in_use else f"cannot listen there ({words})")) from error
    try:
        yield server
    finally:
        listener.close()
        if isinstance(source, Live):
            source.hub.close()
        await server.end()


class Server:
    """One page, and its connections."""

    def __init__(self, address: Address, source: Live | Record, pace: float = 1.0) -> None:
        self._address, self._source, self._pace = address, source, pace
        self._files = files()
        self._talks: set[asyncio.Task[Any]] = set()
        self._writers: set[asyncio.StreamWriter] = set()
        self._ordering = asyncio.Lock()
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

    # ------------------------------------------------------------------------------------------- requests
    def seconds(self, seconds: float) -> float:
        """Return seconds as those of the loop."""
        return seconds * self._pace

    def check(self, request: h11.Request) -> None:
        """Raise for a request that does not come from our own page, or from who typed its address."""
        hosts = [v.decode("latin-1") for k, v in request.headers if k == b"host"]
        if len(hosts) != 1 or not is_known(hosts[0], self._address):
            raise _Refused(421, "this is not the host that was asked for; name it with --http-name", closes=True)
        origin = header(request, b"origin")
        if origin and not is_own(origin, hosts[0]):
            raise _Refused(403, "asked for by a page from elsewhere", closes=True)
        if request.method not in {b"GET", b"HEAD", b"POST"}:
            raise _Refused(405, "there is GET, and POST for orders", closes=True)
        if request.method == b"POST" and not origin:
            raise _Refused(403, "an order names the page that it comes from (Origin)", closes=True)

    def found(self, path: str) -> tuple[str, bytes, str, bytes | None]:
        """Return kind, content, tag and packed content of what is read at a path."""
        file: File | None = self._files.get(path)
        if file is not None:
            return file.kind, file.data, file.tag, file.packed
        source = self._source
        if path == "/api/hello":
            return JSON, msgspec.json.encode({**source.hello(), "takes_orders": self.takes_orders}), "", None
        if path == "/api/area" and source.area is not None:
            return JSON, msgspec.json.encode(source.area), "", None
        if path == "/api/past":
            return JSON, source.past(), "", None
        if path == "/api/log":
            return JSON, source.hub.log() if isinstance(source, Live) else source.log(), "", None
        other = source.compared() if path == "/api/beside" and isinstance(source, Record) else None
        if other is not None:
            return JSON, other, "", None
        if path == "/register_service":
            return JSON, msgspec.json.encode(self.service()), "", None
        chunk = re.fullmatch(r"/api/moments/([0-9]{1,6})", path)
        if chunk is not None and isinstance(source, Record) and int(chunk[1]) < len(source.chunks):
            import gzip

            packed = source.chunks[int(chunk[1])]
            return JSON, gzip.decompress(packed), "", packed
        raise _Refused(404, "there is nothing here")

    @property
    def takes_orders(self) -> bool:
        """Whether somebody with the token may give orders."""
        return bool(self._address.token) and isinstance(self._source, Live) and self._source.ask is not None

    def service(self) -> dict[str, Any]:
        """Return how BlueOS lists the page. In a window of its own: nobody may frame it."""
        from companion import __version__

        return {"name": "Sailboat companion", "description": f"The live page of {self._source.name}.",
                "icon": "mdi-sail-boat", "company": "sailboat-companion", "version": __version__, "webpage": "",
                "api": "/api/hello", "new_page": True, "avoid_iframes": True, "works_in_relative_paths": False}

    async def order(self, request: h11.Request, body: bytes, *, is_preview: bool) -> bytes:
        """Take an order, or show what it would lead to; return the answer."""
        if not self.takes_orders or not isinstance(self._source, Live) or self._source.ask is None:
            raise _Refused(403, "orders are not taken here: begin with --http-token FILE")
        if header(request, b"content-type").partition(";")[0].strip() != JSON or header(request, MARK) != "1":
            raise _Refused(403, "an order is JSON, with X-Companion: 1")
        given = header(request, b"authorization")
        if not hmac.compare_digest(given.encode(), f"Bearer {self._address.token}".encode()):
            raise _Refused(401, "the token is missing or wrong")
        try:
            words = msgspec.json.decode(body, type=dict[str, str])["order"]
            wanted = phrase(words.split())
        except (msgspec.DecodeError, msgspec.ValidationError, KeyError, UnicodeDecodeError):
            raise _Refused(400, 'an order is {"order": "hold"}') from None
        except InputError as error:
            raise _Refused(400, str(error)) from None
        if self._ordering.locked():
            raise _Refused(409, "another order is being answered: again in a moment")
        async with self._ordering:
            try:
                async with asyncio.timeout(self.seconds(ANSWER_S)):
                    if is_preview:
                        if self._source.preview is None:
                            raise _Refused(501, "nothing can be previewed here")
                        return msgspec.json.encode(await self._source.preview(wanted))
                    answer = await self._source.ask(wanted)
            except TimeoutError:
                raise _Refused(504, "no answer: it may have been taken all the same") from None
        return msgspec.json.encode({"result": answer.result.value, "text": answer.text})

    @property
    def live(self) -> Live | None:
        """The voyage under way, where it is one."""
        return self._source if isinstance(self._source, Live) else None


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
            except _Refused as refused:
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
        body = b""
        while True:
            event = await self._event()
            if isinstance(event, h11.Data):
                body += bytes(event.data)
                if len(body) > MOST_BODY:
                    raise _Refused(413, f"at most {MOST_BODY} bytes are taken")
            else:
                return body

    async def _answer(self, request: h11.Request, body: bytes) -> bool:
        """Answer a request; True: the connection is used up."""
        path = request.target.decode("latin-1").partition("?")[0]
        if request.method == b"POST":
            if path not in {"/api/order", "/api/preview"}:
                raise _Refused(404, "there is nothing to post to here")
            await self._send(200, JSON, await self._server.order(request, body, is_preview=path == "/api/preview"))
            return False
        if path == "/api/stream" and self._server.live is not None:
            await self._stream(request, self._server.live)
            return True
        kind, data, tag, packed = self._server.found(path)
        await self._send_file(request, kind, data, tag, packed)
        return False

    async def _send_file(self, request: h11.Request, kind: str, data: bytes, tag: str, packed: bytes | None) -> None:
        headers = [("Cache-Control", "no-cache" if tag else "no-store")]
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
        if packed is None and len(data) > 2000:
            import gzip

            packed = gzip.compress(data, 1, mtime=0)
        if packed is not None and "gzip" in header(request, b"accept-encoding"):
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

    async def _stream(self, request: h11.Request, live: Live) -> None:
        server = self._server
        if live.hub.watchers >= MOST_WATCHERS:
            raise _Refused(503, f"{MOST_WATCHERS} watch already")
        last = header(request, b"last-event-id")
        number = int(last) if last.isascii() and last.isdigit() and len(last) < 12 else 0
        fields = [*HEADERS, ("Content-Type", "text/event-stream"), ("Cache-Control", "no-store"),
                  ("Connection", "close")]
        await self._write(self._h11.send(h11.Response(status_code=200, headers=fields)) or b"")
        gone = asyncio.create_task(self._gone(), name="page: is he still there")
        with Watcher(live.hub, number) as watcher:
            gone.add_done_callback(lambda _: watcher.wake())
            try:
                while not gone.done():
                    news = await watcher.wait(server.seconds(STILL_S))
                    await self._write(self._h11.send(h11.Data(data=news)) or b"")
                    if live.hub.is_closed:
                        return
            except TimeoutError:
                server.dropped += 1
                self._writer.transport.abort()
            finally:
                gone.cancel()

    async def _gone(self) -> None:
        """Return when the other side has hung up."""
        with contextlib.suppress(OSError):
            while await self._reader.read(1024):
                pass
        self._writer.transport.abort()


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

"""The page: its files, what is read at which path, and the orders that it takes, with a token only."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import gzip
import hashlib
import re
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import h11
import msgspec

from companion.errors import InputError
from companion.orders import phrase
from companion.page.charts import TileChart
from companion.page.connections import (
    Address,
    Channel,
    HttpRefusal,
    HttpReply,
    HttpServer,
    Stream,
    header,
    listening,
    require_token,
)
from companion.page.sources import LiveSource, RecordedSource, Watcher

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class File:
    """A file of the page."""

    kind: str
    data: bytes
    packed: bytes
    tag: str


def files(package: str = "companion.page") -> dict[str, File]:
    """Return the files in a package's ``web`` by their path from /; ``index.html`` is / itself, too."""
    out = {}
    for entry in sorted(resources.files(package).joinpath("web").iterdir(), key=lambda e: e.name):
        suffix = entry.name[entry.name.rfind(".") :]
        if suffix in TYPES and entry.name != "tsconfig.json" and not entry.name.startswith("package"):
            data = entry.read_bytes()
            out[f"/{entry.name}"] = File(
                kind=TYPES[suffix],
                data=data,
                packed=gzip.compress(data, 9, mtime=0),
                tag=f'"{hashlib.sha256(data).hexdigest()[:20]}"',
            )
    return {**out, "/": out["/index.html"]} if "/index.html" in out else out


def export(record: RecordedSource) -> bytes:
    """Return the page with the voyage in it.

    The modules go in as data: URLs by an import map, for a file has no neighbours that a browser would load.
    """
    site = files()
    page = site["/index.html"].data.decode()
    style = site["/style.css"].data.decode()
    modules = {path: file.data.decode() for path, file in site.items() if path.endswith(".js")}
    imports = {
        f"page{path}": "data:text/javascript;base64," + _base64(_renamed(text).encode())
        for path, text in modules.items()
    }
    data = {
        "hello": {**record.hello(), "takes_orders": False},
        "area": msgspec.to_builtins(record.area),
        "past": msgspec.Raw(record.past()()),
        "log": msgspec.Raw(record.log()),
        "moments": [base64.b64encode(chunk).decode() for chunk in record.chunks],
    }
    for name, make in (("beside", record.compared()), ("passage", record.passage())):
        if make is not None:
            data[name] = msgspec.Raw(make())
    packed = _base64(gzip.compress(msgspec.json.encode(data), 9, mtime=0))
    page = re.sub(r'<link rel="stylesheet"[^>]*>', lambda _: f"<style>{style}</style>", page)
    page = re.sub(r'<link rel="icon"[^>]*>', '<link rel="icon" href="data:,">', page)
    page = re.sub(r'<script src="/early.js"></script>', lambda _: f"<script>{modules['/early.js']}</script>", page)
    begin = (
        f'<script type="importmap">{msgspec.json.encode({"imports": imports}).decode()}</script>\n'
        f'<script type="application/octet-stream" id="voyage">{packed}</script>\n'
        '<script type="module">import "page/main.js";</script>'
    )
    page = re.sub(r'<script type="module" src="/main.js"></script>', lambda _: begin, page)
    return page.encode()


def _renamed(text: str) -> str:
    """Return a module that names its neighbours as the import map does."""
    return re.sub(r'from "\./([a-z]+\.js)"', r'from "page/\1"', text)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


MOST_WATCHERS = 16
MOST_BODY = 1_000
STILL_S = 15.0  # a word now and then, where nothing happens
ANSWER_S = 8.0  # for the answer to an order


@contextlib.asynccontextmanager
async def served(
    address: Address, source: LiveSource | RecordedSource, *, pace: float = 1.0, charts: Sequence[TileChart] = ()
) -> AsyncIterator[HttpServer]:
    """Serve a page while the body runs. ``pace``: seconds of the loop for each second; ``charts``: the lowest first.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    async with listening(address, Page(address, source, pace, charts), pace=pace) as server:
        try:
            yield server
        finally:
            if isinstance(source, LiveSource):
                source.hub.close()


class Page:
    """One page over one source."""

    def __init__(
        self, address: Address, source: LiveSource | RecordedSource, pace: float, charts: Sequence[TileChart]
    ) -> None:
        self._address, self._source, self._pace = address, source, pace
        self._charts = {chart.tag: chart for chart in charts}
        self._files = files()
        self._ordering = asyncio.Lock()

    def admit(self, request: h11.Request, path: str) -> int:
        """Let in who may ask for it; return how many bytes are read. Raises HttpRefusal."""
        if request.method != b"POST":
            return 0
        if path not in {"/api/order", "/api/preview", "/api/token"}:
            raise HttpRefusal(404, "there is nothing to post to here")
        if not self._takes_orders:
            raise HttpRefusal(403, "orders are not taken here: begin with --http-token FILE")
        require_token(request, self._address.token)
        return MOST_BODY

    async def reply(self, request: h11.Request, path: str, body: bytes) -> HttpReply | Stream:
        """Answer a request. Raises HttpRefusal."""
        if path == "/api/token" and request.method == b"POST":
            return HttpReply(data=b'{"error":null}')  # who got here has it
        if request.method == b"POST":
            return HttpReply(data=await self._order(body, is_preview=path == "/api/preview"))
        if path == "/api/stream" and isinstance(self._source, LiveSource):
            return self._stream(request, self._source)
        file = self._files.get(path)
        if file is not None:
            return HttpReply(kind=file.kind, data=file.data, tag=file.tag, packed=file.packed)
        chunk = re.fullmatch(r"/api/moments/([0-9]{1,6})", path)
        if chunk is not None and isinstance(self._source, RecordedSource) and int(chunk[1]) < len(self._source.chunks):
            packed = self._source.chunks[int(chunk[1])]
            return HttpReply(data=await asyncio.to_thread(gzip.decompress, packed), packed=packed)
        tile = await tile_at(self._charts, path)
        if tile is not None:
            return tile
        make = self._made(path)
        if make is None:
            raise HttpRefusal(404, "there is nothing here")
        # An hour of samples takes tens of milliseconds: not on the voyage's loop.
        return HttpReply(data=await asyncio.to_thread(make))

    def _made(self, path: str) -> Callable[[], bytes] | None:
        """Return what makes the content of a path from what is known now; None: there is nothing."""
        source = self._source
        if path == "/api/hello":
            charts = [chart.facts() for chart in self._charts.values()]
            return _json({**source.hello(), "takes_orders": self._takes_orders, "charts": charts})
        if path == "/api/area" and source.area is not None:
            return _json(source.area)
        if path == "/api/past":
            return source.past()
        if path == "/api/passage":
            return source.passage()
        if path == "/api/log":
            return source.hub.log() if isinstance(source, LiveSource) else source.log
        if path == "/api/beside" and isinstance(source, RecordedSource):
            return source.compared()
        if path == "/register_service":
            return _json(self._service())
        return None

    @property
    def _takes_orders(self) -> bool:
        """Whether somebody with the token may give orders."""
        return bool(self._address.token) and isinstance(self._source, LiveSource) and self._source.ask is not None

    def _service(self) -> dict[str, Any]:
        """Return how BlueOS lists the page. In a window of its own: nobody may frame it."""
        from companion import __version__

        return {
            "name": "Sailboat companion",
            "description": f"The live page of {self._source.name}.",
            "icon": "mdi-sail-boat",
            "company": "sailboat-companion",
            "version": __version__,
            "webpage": "",
            "api": "/api/hello",
            "new_page": True,
            "avoid_iframes": True,
            "works_in_relative_paths": False,
        }

    async def _order(self, body: bytes, *, is_preview: bool) -> bytes:
        """Take an order of one who was let in, or show what it would lead to; return the answer."""
        assert isinstance(self._source, LiveSource)
        assert self._source.ask is not None
        try:
            words = msgspec.json.decode(body, type=dict[str, str])["order"]
            wanted = phrase(words.split())
        except (msgspec.DecodeError, msgspec.ValidationError, KeyError, UnicodeDecodeError):
            raise HttpRefusal(400, 'an order is {"order": "hold"}') from None
        except InputError as error:
            raise HttpRefusal(400, str(error)) from None
        if self._ordering.locked():
            raise HttpRefusal(409, "another order is being answered: again in a moment")
        async with self._ordering:
            try:
                async with asyncio.timeout(ANSWER_S * self._pace):
                    if is_preview:
                        if self._source.preview is None:
                            raise HttpRefusal(501, "nothing can be previewed here")
                        return msgspec.json.encode(await self._source.preview(wanted))
                    answer = await self._source.ask(wanted)
            except TimeoutError:
                raise HttpRefusal(504, "no answer: it may have been taken all the same") from None
        return msgspec.json.encode({"result": answer.result.value, "text": answer.text})

    def _stream(self, request: h11.Request, live: LiveSource) -> Stream:
        """Return what writes the events of a voyage to one who watches."""
        if live.hub.watchers >= MOST_WATCHERS:
            raise HttpRefusal(503, f"{MOST_WATCHERS} watch already")
        last = header(request, b"last-event-id")
        number = int(last) if last.isascii() and last.isdigit() and len(last) < 12 else 0

        async def watch(channel: Channel) -> None:
            with Watcher(live.hub, number) as watcher:
                channel.on_gone(watcher.wake)
                while not channel.is_gone:
                    await channel.write(await watcher.wait(STILL_S * self._pace))
                    if live.hub.is_closed:
                        return

        return watch


async def tile_at(charts: Mapping[str, TileChart], path: str) -> HttpReply | None:
    """Return the tile of one of the charts, by their tags, that a path names; None: it names none."""
    tile = re.fullmatch(r"/tiles/([0-9a-f]{12})/([0-9]{1,2})/([0-9]{1,8})/([0-9]{1,8})", path)
    chart = charts.get(tile[1]) if tile is not None else None
    if tile is None or chart is None:
        return None
    kind, data = await asyncio.to_thread(chart.tile, int(tile[2]), int(tile[3]), int(tile[4]))
    return HttpReply(kind=kind, data=data, is_fixed=True)


def _json(value: Any) -> Callable[[], bytes]:
    return lambda: msgspec.json.encode(value)

"""The page's own files, read once and packed once, and one file that holds the page and a recorded voyage."""

from __future__ import annotations

import base64
import gzip
import hashlib
import re
from dataclasses import dataclass
from importlib import resources

import msgspec

from companion.page.sources import RecordedSource

TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8",
         ".js": "text/javascript; charset=utf-8", ".svg": "image/svg+xml", ".json": "application/json"}


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
        suffix = entry.name[entry.name.rfind("."):]
        if suffix in TYPES and entry.name != "tsconfig.json" and not entry.name.startswith("package"):
            data = entry.read_bytes()
            out[f"/{entry.name}"] = File(kind=TYPES[suffix], data=data, packed=gzip.compress(data, 9, mtime=0),
                                         tag=f'"{hashlib.sha256(data).hexdigest()[:20]}"')
    return {**out, "/": out["/index.html"]} if "/index.html" in out else out


def export(record: RecordedSource) -> bytes:
    """Return the page with the voyage in it.

    The modules go in as data: URLs by an import map, for a file has no neighbours that a browser would load.
    """
    site = files()
    page = site["/index.html"].data.decode()
    style = site["/style.css"].data.decode()
    modules = {path: file.data.decode() for path, file in site.items() if path.endswith(".js")}
    imports = {f"page{path}": "data:text/javascript;base64," + _base64(_renamed(text).encode())
               for path, text in modules.items()}
    data = {
        "hello": {**record.hello(), "takes_orders": False}, "area": msgspec.to_builtins(record.area),
        "past": msgspec.Raw(record.past()()), "log": msgspec.Raw(record.log()),
        "moments": [base64.b64encode(chunk).decode() for chunk in record.chunks],
    }
    beside = record.compared()
    if beside is not None:
        data["beside"] = msgspec.Raw(beside())
    packed = _base64(gzip.compress(msgspec.json.encode(data), 9, mtime=0))
    page = re.sub(r'<link rel="stylesheet"[^>]*>', lambda _: f"<style>{style}</style>", page)
    page = re.sub(r'<link rel="icon"[^>]*>', '<link rel="icon" href="data:,">', page)
    page = re.sub(r'<script src="/early.js"></script>', lambda _: f"<script>{modules['/early.js']}</script>", page)
    begin = (f'<script type="importmap">{msgspec.json.encode({"imports": imports}).decode()}</script>\n'
             f'<script type="application/octet-stream" id="voyage">{packed}</script>\n'
             '<script type="module">import "page/main.js";</script>')
    page = re.sub(r'<script type="module" src="/main.js"></script>', lambda _: begin, page)
    return page.encode()


def _renamed(text: str) -> str:
    """Return a module that names its neighbours as the import map does."""
    return re.sub(r'from "\./([a-z]+\.js)"', r'from "page/\1"', text)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()

"""One file that holds the page and a recorded voyage: to keep, or to send to a friend. It asks for nothing."""

from __future__ import annotations

import base64
import gzip
import re

import msgspec

from companion.page.site import files
from companion.page.sources import Record


def export(record: Record) -> bytes:
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

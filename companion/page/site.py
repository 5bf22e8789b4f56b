"""The page's own files: read once, known by a hash, packed once."""

from __future__ import annotations

import gzip
import hashlib
from dataclasses import dataclass
from importlib import resources

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

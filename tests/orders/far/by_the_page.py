"""A second reader and writer of both messages, by the tables of docs/reference/far.md alone: struct and hmac."""

import hashlib
import hmac
import re
import struct
from pathlib import Path

PAGE = Path("docs/reference/far.md")
CODES = {"u8": "B", "u16": "H", "i32": "i"}


def layout(title):
    """Return (offset, type, name) of each field in the table below a heading."""
    part = PAGE.read_text().split(f"### {title}: ")[1].split("###")[0]
    rows = re.findall(r"^\| (\d+) \| ([ui]\d+) \| `(\w+)` \|", part, re.MULTILINE)
    return [(int(at), kind, name) for at, kind, name in rows]


SIZES = {"The order": 16, "The beginning": 7, "The status": 34}


def code(key, purpose, system, body, began=0):
    since = f" began {began}" if began else ""
    own = hmac.new(key, f"companion far {purpose} 1 system {system}{since}".encode(), hashlib.sha256).digest()
    return hmac.new(own, body, hashlib.sha256).digest()[:8]


def write(title, key, system, *, since=0, **values):
    """Return a message with these counts, 0 where there is none; ``since``: the beginning that an order is of."""
    body = bytearray(SIZES[title])
    for at, kind, name in layout(title):
        value = values.get(name, 1 if name == "version" else 0)
        if kind == "u24":
            body[at : at + 3] = struct.pack("<I", value)[:3]
        else:
            struct.pack_into(f"<{CODES[kind]}", body, at, value)
    return bytes(body) + code(key, title.split()[1], system, bytes(body), since)


def read(title, data, key, system=1, since=0):
    """Return the counts of a message whose code is right."""
    assert data[-8:] == code(key, title.split()[1], system, data[:-8], since)
    counts = {}
    for at, kind, name in layout(title):
        counts[name] = (
            struct.unpack("<I", data[at : at + 3] + b"\0")[0]
            if kind == "u24"
            else struct.unpack_from(f"<{CODES[kind]}", data, at)[0]
        )
    return counts

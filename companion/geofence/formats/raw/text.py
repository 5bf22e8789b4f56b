"""Reading files that strangers wrote: size limit, encodings, decimal commas, numbers that must be finite."""

from __future__ import annotations

import math
import re
from pathlib import Path

from companion.disk import read_regular
from companion.errors import InputError, unreadable

MAX_BYTES = 16 * 1024 * 1024  # a coast of 500,000 vertices; more is a mistake or an attack
MAX_POSITIONS = 500_000       # vertices and items that one file may hold
MAX_DEPTH = 64                # brackets within brackets

_DECIMAL_COMMA = re.compile(r"(?<![\d,])(-?\d+),(\d+)(?![\d,])")


def read_bytes(path: Path, *, max_bytes: int = MAX_BYTES) -> bytes:
    """Return the file's bytes. Raises InputError if it cannot be read or is over ``max_bytes``."""
    try:
        data = read_regular(path, max_bytes + 1)
    except OSError as error:
        raise unreadable(str(path), error) from None
    if len(data) > max_bytes:
        raise InputError(str(path), "", f"is larger than {max_bytes // 2**20} MiB", "split or simplify it")
    return data


def decode(data: bytes, source: str) -> str:
    r"""Return the text of ``data``: UTF-8, UTF-16 with a BOM, or Latin-1 as old Windows programs write it.

    Line ends become ``\\n``. Raises InputError for binary data.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            text = data.decode("utf-16")
        except UnicodeDecodeError:
            raise InputError(source, "", "is not valid UTF-16", "save it as UTF-8") from None
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if "\x00" in text:
        raise InputError(source, f"byte {text.index(chr(0))}", "holds binary data, not text", "save it as UTF-8 text")
    return text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff")


def number(text: str, source: str, place: str, *, decimal_comma: bool = False) -> float:
    """Return a finite number. Raises InputError naming the place."""
    try:
        value = float(text.replace(",", ".") if decimal_comma else text)
    except ValueError:
        hint = "write a decimal point" if "," in text else ""
        raise InputError(source, place, f"{text[:40]!r} is not a number", hint) from None
    if "_" in text:
        raise InputError(source, place, f"{text[:40]!r} is not a number")
    if not math.isfinite(value):
        raise InputError(source, place, f"{text[:40]!r} is not a finite number")
    return value


def point_commas(line: str) -> str:
    """Return a line of whitespace-separated numbers with its decimal commas turned into points.

    >>> point_commas("43,6607 -72,1500")
    '43.6607 -72.1500'
    """
    return _DECIMAL_COMMA.sub(r"\1.\2", line)


def require_shallow(text: str, source: str, *, opening: str = "([{", closing: str = ")]}") -> None:
    """Raise InputError if brackets nest deeper than ``MAX_DEPTH`` (parsers written with recursion die of it)."""
    depth = 0
    for match in re.finditer("[" + re.escape(opening + closing) + "]", text):
        depth += 1 if match.group() in opening else -1
        if depth > MAX_DEPTH:
            line = text.count("\n", 0, match.start()) + 1
            raise InputError(source, f"line {line}", f"brackets nest deeper than {MAX_DEPTH}")


def printable(text: str) -> str:
    """Return the text without the control characters that XML cannot hold."""
    return "".join(c for c in text if (c.isprintable() or c in "\n\t ") and c not in "\ufffe\uffff")

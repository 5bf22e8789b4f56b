"""Reading files that strangers wrote: size limit, encodings, decimal commas, numbers that must be finite."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.messages import MOST_FLOAT32

MAX_BYTES = 16 * 1024 * 1024  # a coast of 500,000 vertices; more is a mistake or an attack
MAX_POSITIONS = 500_000  # vertices and items that one file may hold
MAX_DEPTH = 64  # brackets within brackets

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


def number(text: str, source: str, place: str) -> float:
    """Return a finite number. Raises InputError naming the place."""
    try:
        value = float(text)
    except ValueError:
        hint = "write a decimal point" if "," in text else ""
        raise InputError(source, place, f"{text[:40]!r} is not a number", hint) from None
    if "_" in text:
        raise InputError(source, place, f"{text[:40]!r} is not a number")
    if not math.isfinite(value):
        raise InputError(source, place, f"{text[:40]!r} is not a finite number")
    if abs(value) > MOST_FLOAT32:
        raise InputError(source, place, f"{value:g} is larger than any number that an autopilot holds")
    return value


def point_commas(line: str) -> str:
    """Return a line of whitespace-separated numbers with its decimal commas turned into points.

    >>> point_commas("43,6607 -72,1500")
    '43.6607 -72.1500'
    """
    return _DECIMAL_COMMA.sub(r"\1.\2", line)


def require_shallow(text: str, source: str) -> None:
    """Raise InputError if brackets nest deeper than ``MAX_DEPTH`` (parsers written with recursion die of it)."""
    depth = 0
    for match in re.finditer(r"[(\[{)\]}]", text):
        depth += 1 if match.group() in "([{" else -1
        if depth > MAX_DEPTH:
            line = text.count("\n", 0, match.start()) + 1
            raise InputError(source, f"line {line}", f"brackets nest deeper than {MAX_DEPTH}")


def printable(text: str) -> str:
    """Return the text without the control characters that XML cannot hold."""
    return "".join(c for c in text if (c.isprintable() or c in "\n\t ") and c not in "\ufffe\uffff")


# A JSON value that knows where it stands, so that every complaint names the place.


@dataclass(frozen=True, slots=True)
class JsonNode:
    """One value of a JSON file: ``path`` is its place, as ``features[2].geometry``."""

    value: object
    source: str
    path: str = ""

    def fail(self, problem: str, remedy: str = "") -> InputError:
        """Return an error about this value."""
        return InputError(self.source, self.path, problem, remedy)

    def get(self, key: str) -> JsonNode | None:
        """Return the member, None if it is absent or null. Raises InputError if this is no object."""
        if not isinstance(self.value, dict):
            raise self.fail(f"is {_kind(self.value)} where an object should be")
        value = self.value.get(key)
        return None if value is None else JsonNode(value, self.source, f"{self.path}.{key}" if self.path else key)

    def member(self, key: str) -> JsonNode:
        """Return the member. Raises InputError if it is missing."""
        node = self.get(key)
        if node is None:
            raise self.fail(f"{key!r} is missing")
        return node

    def __iter__(self) -> Iterator[JsonNode]:
        """Yield the elements of an array. Raises InputError if this is none or is too long."""
        if not isinstance(self.value, list):
            raise self.fail(f"is {_kind(self.value)} where a list should be")
        if len(self.value) > MAX_POSITIONS:
            raise self.fail(f"has more than {MAX_POSITIONS} elements", "simplify it")
        for index, element in enumerate(self.value):
            yield JsonNode(element, self.source, f"{self.path}[{index}]")

    def number(self, low: float = -MOST_FLOAT32, high: float = MOST_FLOAT32) -> float:
        """Return a finite number within bounds: those of what an autopilot holds, where none are told."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.fail(f"is {_kind(self.value)} where a number should be")
        try:
            value = float(self.value)
        except OverflowError:
            raise self.fail("is too large a number") from None
        if not math.isfinite(value) or not low <= value <= high:
            raise self.fail(f"{value:g} is outside {low:g}..{high:g}")
        return value

    def integer(self, low: int, high: int) -> int:
        """Return a whole number within bounds."""
        value = self.number(low, high)
        if value != int(value):
            raise self.fail(f"{value:g} is not a whole number")
        return int(value)

    def text(self) -> str:
        """Return a string."""
        if not isinstance(self.value, str):
            raise self.fail(f"is {_kind(self.value)} where a text should be")
        return self.value

    def flag(self) -> bool:
        """Return a truth value."""
        if not isinstance(self.value, bool):
            raise self.fail(f"is {_kind(self.value)} where true or false should be")
        return self.value


def parse_json(text: str, source: str) -> JsonNode:
    """Return the root of a JSON text. Raises InputError with the line."""
    data = text.encode("utf-8", "surrogatepass")
    try:
        return JsonNode(msgspec.json.decode(data), source)
    except msgspec.DecodeError as error:
        what, _, byte = str(error).partition("(byte ")
        number = byte.rstrip(")")
        line = data[: int(number)].count(b"\n") + 1 if number.isdigit() else data.count(b"\n") + 1
        raise InputError(
            source,
            f"line {line}",
            f"is not JSON ({what.strip().rstrip(':')})",
            "is the file cut off?" if "truncated" in what else "",
        ) from None
    except (RecursionError, UnicodeDecodeError):
        raise InputError(source, "", "is nested too deeply or not UTF-8") from None


def _kind(value: object) -> str:
    if value is None:
        return "null"
    names = {
        dict: "an object",
        list: "a list",
        str: "a text",
        bool: "true or false",
        int: "a number",
        float: "a number",
    }
    return names.get(type(value), "a value")


# XML that strangers wrote: no DTD, no entities, no external references, bounded depth.


def parse_xml(data: bytes, source: str) -> Any:
    """Return the root element. Raises InputError with the line for anything malformed or hostile."""
    import defusedxml
    from defusedxml import ElementTree

    try:
        root = ElementTree.fromstring(data, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except defusedxml.DefusedXmlException:
        raise InputError(source, "", "declares a DTD or entities, which are refused", "remove the DOCTYPE") from None
    except ElementTree.ParseError as error:
        line, column = error.position
        what = str(error).split(":", maxsplit=1)[0]
        cut = "no element" in what or "unclosed" in what
        raise InputError(
            source, f"line {line} column {column + 1}", f"is not XML ({what})", "is the file cut off?" if cut else ""
        ) from None
    except (ValueError, LookupError) as error:
        raise InputError(source, "line 1", f"is not XML ({str(error)[:60]})", "save it as UTF-8") from None
    level = [root]
    for _ in range(MAX_DEPTH):
        level = [child for element in level for child in element]
        if not level:
            return root
        if len(level) > MAX_POSITIONS:
            raise InputError(source, "", f"holds more than {MAX_POSITIONS} elements", "split or simplify it")
    raise InputError(source, "", f"elements nest deeper than {MAX_DEPTH}")


def local_name(element: Any) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]


def child_text(element: Any, name: str) -> str:
    """Return the text of the first child of that local name ("" without one)."""
    for child in element:
        if local_name(child) == name:
            return (child.text or "").strip()
    return ""

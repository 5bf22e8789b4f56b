"""A JSON value that knows where it stands, so that every complaint names the place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec

from companion.errors import InputError
from companion.geofence.formats.raw.text import MAX_POSITIONS


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

    def number(self, low: float = -math.inf, high: float = math.inf) -> float:
        """Return a finite number within bounds."""
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
        raise InputError(source, f"line {line}", f"is not JSON ({what.strip().rstrip(':')})",
                         "is the file cut off?" if "truncated" in what else "") from None
    except (RecursionError, UnicodeDecodeError):
        raise InputError(source, "", "is nested too deeply or not UTF-8") from None


def _kind(value: object) -> str:
    if value is None:
        return "null"
    names = {dict: "an object", list: "a list", str: "a text", bool: "true or false", int: "a number",
             float: "a number"}
    return names.get(type(value), "a value")

"""Words: what is counted, singular or plural; the words that an option may be; and text that can be shown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal, get_args, get_origin, get_type_hints

import msgspec


def counted(number: int, word: str, plural: str = "") -> str:
    """Return a count with its word.

    >>> counted(1, "leg"), counted(2, "gybe"), counted(0, "way", "ways"), counted(2, "loss", "losses")
    ('1 leg', '2 gybes', '0 ways', '2 losses')
    """
    return f"{number} {word if number == 1 else plural or word + 's'}"


def listed(names: Sequence[str]) -> str:
    """Return names as one enumerates them.

    >>> listed(["A"]), listed(["A", "B", "C"])
    ('A', 'A, B and C')
    """
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def printable(text: str) -> str:
    r"""Return text that can do nothing to a terminal: controls, and marks that turn the reading round, are escaped.

    Ends of lines and tabs stay.

    >>> printable(chr(27) + "[2J" + chr(0x202E) + "Nab")
    '\\x1b[2J\\u202eNab'
    """
    if text.isprintable():
        return text
    import unicodedata  # 0.8 MB of tables, for what hardly any text has

    return "".join(
        c
        if c.isprintable() or c in "\n\t" or unicodedata.category(c) == "Zs"
        else c.encode("unicode_escape").decode("ascii")
        for c in text
    )


def one_line(text: str) -> str:
    """Return text that can do nothing to a terminal and stays on its line."""
    return printable(text).replace("\n", "\\n").replace("\t", " ")


def file_name(name: str) -> str:
    """Return a name that a person gave as part of a file's.

    >>> file_name("Lake / north"), file_name("../")
    ('Lake-north', 'voyage')
    """
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-") or "voyage"


_KINDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text in quotes",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "datetime": "a date with its time",
}
_BOUNDS = {">=": "of at least", "<=": "of at most", ">": "above", "<": "below"}


def expected(problem: str) -> str:
    """Return what msgspec found wrong, in words.

    >>> expected("Expected `float` >= 5.0"), expected("Expected `str | null`, got `int`")
    ('expected a number of at least 5.0', 'expected a text in quotes, got a whole number')
    >>> expected("Object missing required field `at_s`"), expected("Object contains unknown field `lat`")
    ('`at_s` is missing', 'unknown key `lat`')
    """
    key = re.fullmatch(r"Object (missing required|contains unknown) field (`.+`)", problem)
    if key:  # as it is written, whatever kind is called the same
        return f"{key[2]} is missing" if key[1] == "missing required" else f"unknown key {key[2]}"

    def kinds(match: re.Match[str]) -> str:
        found = [_KINDS.get(name, name) for name in match[1].split(" | ") if name != "null"]
        return " or ".join(found) or "nothing"

    words = re.sub(r"`([a-z]+(?: \| [a-z]+)*)`", kinds, problem)
    words = re.sub(r" (>=|<=|>|<) ", lambda match: f" {_BOUNDS[match[1]]} ", words)
    return words[:1].lower() + words[1:]


def choices(kind: Any, path: str) -> tuple[str, ...]:
    """Return the words that an option may be: of the struct ``kind``, at msgspec's path (``$.skipper.end``)."""
    for key in re.findall(r"\.(\w+)", path):
        structs = [part for part in _parts(kind) if isinstance(part, type) and issubclass(part, msgspec.Struct)]
        kind = next((hints[key] for hints in map(get_type_hints, structs) if key in hints), None)
    words = [word for part in (kind, *get_args(kind)) if get_origin(part) is Literal for word in get_args(part)]
    return tuple(words)


def _parts(kind: Any) -> list[Any]:
    """Return a type and what it is made of: the members of unions, the items of tuples, and theirs."""
    return [kind, *(part for inner in get_args(kind) for part in _parts(inner))]


def below_words(value: float, limit: float, digits: int = 1) -> str:
    """Return a value that is below a limit with as many digits, 3 at most, as tell that it is.

    >>> below_words(2.5, 3.0), below_words(2.97, 3.0), below_words(2.9998, 3.0), below_words(7.6, 8.0, 0)
    ('2.5', '2.97', 'just under 3', '7.6')
    """
    for places in range(digits, 4):
        told = f"{value:.{places}f}"
        if float(told) < limit:
            return told
    return f"just under {limit:g}"


def clearance_words(clearance_m: float, where: str = "inside an obstacle or outside the fence") -> str:
    """Return a clearance in words: a negative one is how far she is where she must not be."""
    return f"{-clearance_m:.1f} m {where}" if clearance_m < -0.05 else f"{abs(clearance_m):.1f} m"


def time_words(seconds: float) -> str:
    """Return how long something took; a colon would make it an hour of the day.

    >>> time_words(45.2), time_words(145.0), time_words(15_380.0), time_words(105_600.0)
    ('45 s', '2 min 25 s', '4 h 16 min', '1 d 5 h 20 min')
    """
    if round(seconds) < 3600:
        minutes, rest = divmod(round(seconds), 60)
        return f"{minutes} min {rest} s" if minutes else f"{rest} s"
    hours, minutes = divmod(round(seconds / 60.0), 60)
    days, hours = divmod(hours, 24)
    return (f"{days} d " if days else "") + f"{hours} h {minutes} min"


def brief_time(seconds: float) -> str:
    """Return a time span where there is no room for words, to the nearest second.

    >>> brief_time(42.0), brief_time(99.6), brief_time(5000.0)
    ('42 s', '1:40', '1 h 23')
    """
    whole = round(max(0.0, seconds))
    if whole < 60:
        return f"{whole} s"
    return f"{whole // 60}:{whole % 60:02d}" if whole < 3600 else f"{whole // 3600} h {whole % 3600 // 60:02d}"


def goals_reached(goals: int, given_up: int) -> str:
    """Return how many of the goals were reached, of a voyage that has none left."""
    if given_up:
        return f"{goals - given_up} of {goals} goals reached, {given_up} given up by order"
    return "the goal is reached" if goals == 1 else f"all {goals} goals reached"

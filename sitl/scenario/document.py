"""Every key of a scenario as a page: ``python -m sitl.scenario.document > docs/reference/scenarios.md``.

The page is made of the source of ``sitl.scenario.scenario``: its tables are classes, a key's comment says what it is.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from sitl.scenario import scenario

_HEAD = """# Scenarios: every key

A scenario is a TOML file: a mission, the weather, what befalls the boat, and what must hold in the end. `sitl example
DIR` writes one with comments to begin from, `sitl run FILE` sails it, `sitl campaign FILE` over many seeds. Ours have
names: `sitl run --help`. A key that is not known is refused, with what it may have meant. Names end in their unit;
directions are degrees clockwise from true north, of wind where it comes from. This page is made of the code.

Two scenarios, or two settings of one, are held against each other by seed: `sitl campaign a.toml --runs 50 --table
a.parquet`, the same for `b.toml`, then `sitl results compare a.parquet b.parquet`.
"""
# The tables in the order of the page: the class, how its table is written.
_TABLES = {
    "Scenario": "At the top", "WindSpec": "`[wind]`", "LeeSpec": "`[[wind.lees]]`", "CurrentSpec": "`[current]`",
    "WavesSpec": "`[waves]`", "HullSpec": "`[boat]`", "SensorsSpec": "`[sensors]`", "SatelliteSpec": "`[satellite]`",
    "ExpectSpec": "`[expect]`", "HeldSpec": "`[expect.held]`", "EventSpec": "`[[events]]`",
}
_KEY = re.compile(r"^    (\w+): ([^#]+?)(?: = ([^#]+?))?\s*(?:#\s*(.*))?$")
_GOES_ON = re.compile(r"^\s{8,}#\s*(.*)$")
_KIND = re.compile(r'^    ((?:"\w+",\s*)+)(?:#\s*(.*))?$')


def page(source: str) -> str:
    """Return the page, of the module's source."""
    lines, tree = source.splitlines(), ast.parse(source)
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    parts, kinds = [_HEAD], list(_kinds(lines))
    for name, title in _TABLES.items():
        node = classes[name]
        last = node.end_lineno or node.lineno
        end = next((n.lineno - 2 for n in node.body if isinstance(n, ast.FunctionDef)), last)
        said = " ".join((ast.get_docstring(node) or "").split("\n\n")[0].split()).replace("``", "`")
        rows = [f"| `{key}` | {default} | {told or _read_by(key, kinds)} |"
                for key, default, told in _keys(lines[node.lineno:end])]
        table = "\n".join(["| key | default | what it is |", "|---|---|---|", *rows])
        parts.append(f"## {title}\n\n{said}\n\n{table}\n")
    parts.append("## Kinds of events\n\n| `kind` | the keys that it reads, and what happens |\n|---|---|\n"
                 + "\n".join(f"| {names} | {told} |" for names, told in kinds) + "\n")
    return "\n".join(parts)


def _keys(lines: list[str]) -> Iterator[tuple[str, str, str]]:
    """Yield each key with its default and what its comment says."""
    found: list[list[str]] = []
    for line in lines:
        if match := _KEY.match(line):
            key, kind, default, told = match[1], match[2], match[3], match[4] or ""
            choices = re.findall(r'"([^"]+)"', kind) if "Literal" in kind else []
            one_of = f"one of {', '.join(choices)}" if choices else ""
            found.append([key, _default(default), "; ".join(part for part in (told, one_of) if part)])
        elif found and (more := _GOES_ON.match(line)):
            found[-1][2] += " " + more[1]
    for key, default, told in found:
        yield key, default, _cell(told)


def _read_by(key: str, kinds: list[tuple[str, str]]) -> str:
    """Return which kinds of event read a key."""
    return "of " + ", ".join(names for names, told in kinds if re.search(rf"\b{key}\b", told))


def _default(text: str | None) -> str:
    if text is None:
        return "must be given"
    return "" if text == "None" or "(" in text or text in ("()", "{}", '""') else f"`{text.lower().strip(chr(34))}`"


def _kinds(lines: list[str]) -> Iterator[tuple[str, str]]:
    start = next(n for n, line in enumerate(lines) if line.startswith("EventKind"))
    found: list[list[str]] = []
    for line in lines[start + 1:]:
        if line.startswith("]"):
            break
        if match := _KIND.match(line):
            found.append([", ".join(f"`{kind}`" for kind in re.findall(r'"(\w+)"', match[1])), match[2] or ""])
        elif more := _GOES_ON.match(line):
            found[-1][1] += " " + more[1]
    for names, told in found:
        states = ", ".join(scenario.STATES.get(names.strip("`"), ()))
        yield names, _cell(re.sub(r"\bstate\b", f"state ({states})", told) if states else told)


def _cell(text: str) -> str:
    return text.replace("``", "`").replace("|", "or")


if __name__ == "__main__":
    sys.stdout.write(page(Path(scenario.__file__).read_text(encoding="utf-8")))

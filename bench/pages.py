"""What pages say that the code knows: ``python -m bench.pages`` writes it anew, a test checks that it is current.

Two whole pages, the tables of three more between two marks, the schema of the view's JSON and the live page's types.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from companion.orders.far import order, route, status
from companion.orders.far.order import SEAL_BYTES
from companion.orders.order import TABLE as VERBS
from companion.safety import BY_RANK, ENDINGS, FAILSAFES, SETTINGS, TABLE, WORD_OF, Cause, Recovery, Setting, Watchdog
from companion.skipper.priorities import BEHAVIORS
from companion.view.area import AreaView
from companion.view.events import Event
from companion.view.passage import PassageView
from companion.view.values import SCHEMA, Past, View
from sitl.scenario import scenario

ROOT = Path(__file__).resolve().parent.parent
BEGINS, ENDS = "<!-- made by python -m bench.pages -->", "<!-- end of what is made -->"

DOGS_HEAD = """# Watchdogs

Made from the tables in `companion/safety.py` by `python -m bench.pages`; a test checks that it is current. A watchdog
is raised when its figure has been at or beyond the entry threshold for the time given, and cleared when it has been at
or beyond the exit threshold (or cannot be told) for its time. Those marked * are watched before the boat sails and when
the voyage is over, too; those marked ° when it is over, too. Its number stands for it where there
is no room for words ([far away](far.md), HIGH_LATENCY2): 0 is none, and none is ever given to another.

| watchdog | number | watches | entry | exit | says | then | why |
|---|---|---|---|---|---|---|---|
"""
ENDS_HEAD = """
## What ends a voyage early

The keys of a mission's `[safety]`, in the order in which they come. `refuge`: to the nearest refuge, without one home
if `[skipper] end` says so; `home`: home, without a way there to the nearest refuge; `stay`: a loiter near by; `say`:
words alone. Where there is no such place she loiters near by; with one marked † she sails on. Those marked ‡ come
before the orders of the crew, too. When it is over she sails on.

| key | default | when | how long |
|---|---|---|---|
"""
FIGURES_HEAD = """
The figures of these, and what is done, with `set_auto`, when a failsafe of the autopilot [has stopped
her](#when-the-autopilot-stops-her-by-itself): `sail_on`; `stay`: a loiter near by; `refuge`; `leave`: nothing, a person
must. What she stays for ends when a person gives AUTO, that of the shore link when the link is back.

| key | default | what |
|---|---|---|
"""
CAUSES_HEAD = """
## When the autopilot stops her by itself

ArduRover tells no reason of a mode change over MAVLink. A change to HOLD, RTL, SmartRTL or LOITER, or a disarming, that
the companion did not ask for is a failsafe's if one of its signs begins within 5 s of it, and the rudder, the throttle
and the mode switch (RC_CHANNELS) have not moved; else it is a person's, and nothing is done until AUTO comes back. What
is put right needs `[operator] set_auto` and a boat that is still armed. Without, and for as long as a stop lasts, it is
said every minute where she drifts, what she meets and when, and what to press; of a person's stop only when she drifts
onto something.

| failsafe | the autopilot's words | or shows as | with `set_auto` | without: press | why |
|---|---|---|---|---|---|
"""
SCENARIOS_HEAD = """# Scenarios: every key

A scenario is a TOML file: a mission, the weather, what befalls the boat, and what must hold in the end. `sitl example
DIR` writes one with comments to begin from, `sitl run FILE` sails it, `sitl campaign FILE` over many seeds. Ours have
names: `sitl run --help`. A key that is not known is refused, with what it may have meant. Names end in their unit;
directions are degrees clockwise from true north, of wind where it comes from. This page is made of the code.

Two scenarios, or two settings of one, are held against each other by seed: `sitl campaign a.toml --runs 50 --table
a.parquet`, the same for `b.toml`, then `sitl results compare a.parquet b.parquet`.
"""
# The tables in the order of the page: the class, how its table is written.
_TABLES = {
    "Scenario": "At the top",
    "WindSpec": "`[wind]`",
    "LeeSpec": "`[[wind.lees]]`",
    "CurrentSpec": "`[current]`",
    "WavesSpec": "`[waves]`",
    "HullSpec": "`[boat]`",
    "SensorsSpec": "`[sensors]`",
    "BottomSpec": "`[bottom]`",
    "BankSpec": "`[[bottom.banks]]`",
    "SatelliteSpec": "`[satellite]`",
    "ExpectSpec": "`[expect]`",
    "HeldSpec": "`[expect.held]`",
    "EventSpec": "`[[events]]`",
}
_KEY = re.compile(r"^    (\w+): ([^#]+?)(?: = ([^#]+?))?\s*(?:#\s*(.*))?$")
_GOES_ON = re.compile(r"^\s{8,}#\s*(.*)$")
_KIND = re.compile(r'^    ((?:"\w+",\s*)+)(?:#\s*(.*))?$')


def made() -> dict[Path, str]:
    """Return what is made of the code: {file: its text}."""
    view = schema()
    between = {
        "docs/guides/orders.md": verbs(),
        "docs/reference/far.md": layouts(),
        "docs/reference/skipper.md": behaviors(),
    }
    whole = {
        "docs/reference/watchdogs.md": watchdogs(),
        "docs/reference/scenarios.md": scenarios(),
        "companion/view/view.schema.json": json.dumps(view, indent=1) + "\n",
        "companion/view/view.d.ts": types(view),
    }
    texts = whole | {path: _put(path, part) for path, part in between.items()}
    return {ROOT / path: text for path, text in texts.items()}


def _put(path: str, part: str) -> str:
    before, _, rest = (ROOT / path).read_text(encoding="utf-8").partition(BEGINS)
    return f"{before}{BEGINS}\n\n{part}\n{ENDS}{rest.partition(ENDS)[2]}"


def verbs() -> str:
    """Return the table of the orders."""
    head = ["| order | param1 | means | stands | refused when |", "|---|---|---|---|---|"]
    rows = [
        f"| `{row.verb}{f' {row.takes}' if row.takes else ''}` | {row.number} | {row.means} | "
        f"{'yes' if row.stands else '-'} | {row.refused} |"
        for row in VERBS
    ]
    return "\n".join([*head, *rows, ""])


def layouts() -> str:
    """Return the layouts of messages far away."""
    head = ["| byte | type | field | unit | not known | what |", "|---|---|---|---|---|---|"]
    parts = []
    for title, layout, size in (
        ("The order", order.LAYOUT, order.SIZE),
        ("The beginning", order.BEGINNING_LAYOUT, order.BEGINNING_SIZE),
        ("The status", status.LAYOUT, status.SIZE),
        ("The route, before its places", route.HEADER, route.HEADER.size),
        ("Each place of the route", route.PLACE, route.PLACE.size),
    ):
        code = f"| {layout.size} | {SEAL_BYTES} bytes | `code` | - | - | the authentication code |"
        sealed = size > layout.size
        parts += [f"### {title}: {size} bytes", "", *head, *layout.rows(), *([code] if sealed else []), ""]
    return "\n".join(parts)


def behaviors() -> str:
    """Return the list of the behaviors."""
    rows = [f"| {n} | {b.name} | {b.when} | {b.does} |" for n, b in enumerate(BEHAVIORS, start=1)]
    return "\n".join(["| | behavior | when | does |", "|--:|---|---|---|", *rows, ""])


def watchdogs() -> str:
    """Return docs/reference/watchdogs.md."""
    return "".join(
        (
            DOGS_HEAD,
            *map(_row, TABLE),
            ENDS_HEAD,
            *map(_ending, BY_RANK),
            FIGURES_HEAD,
            *map(_figure, SETTINGS.values()),
            *(
                f"| `{cause.key}` | `{WORD_OF[cause.answer]}` | when the {cause.name} failsafe has |\n"
                for cause in FAILSAFES
                if cause.key
            ),
            CAUSES_HEAD,
            *map(_cause, FAILSAFES),
        )
    )


def _ending(name: str) -> str:
    ending = ENDINGS[name]
    marks = "†" * ending.sails_on + "‡" * ending.over_orders
    asked = f"; watched with `{ending.asked_by}`" if ending.asked_by else ""
    return (
        f'| `{ending.key}`{marks} | `{ending.default}` | {ending.because}: watchdog "{name}"{asked} | '
        f"{ending.until or 'the voyage is over'} |\n"
    )


def _figure(setting: Setting) -> str:
    return f"| `{setting.key}` | {'none' if setting.default is None else f'{setting.default:g}'} | {setting.says} |\n"


def _row(dog: Watchdog) -> str:
    sign, back = ("≥", "≤") if dog.enter >= dog.exit else ("≤", "≥")
    unit = f" {dog.unit}" if dog.unit else ""
    mark = "*" if dog.at_rest else "°" if dog.loitering else ""
    return " | ".join(
        (
            f"| {dog.name}{mark}",
            str(dog.number),
            dog.watches,
            f"{sign} {dog.enter:g}{unit} for {dog.enter_s:g} s",
            f"{back} {dog.exit:g}{unit} for {dog.exit_s:g} s",
            dog.severity.name.lower(),
            dog.response.value,
            f"{dog.why} |\n",
        )
    )


def _cause(cause: Cause) -> str:
    words = ", ".join(f"`{text.strip()} …`" for text in cause.texts) or "–"
    first = f"waits for {cause.waits_for}; " if cause.waits_for and cause.answer is not Recovery.LEAVE else ""
    return (
        f"| {cause.name} | {words} | {cause.shown or '–'} | {first}{cause.answer.value} | {cause.press} | "
        f"{cause.why} |\n"
    )


def scenarios() -> str:
    """Return docs/reference/scenarios.md, made of the source: tables are classes, comments say what keys are."""
    source = Path(scenario.__file__).read_text(encoding="utf-8")
    lines, tree = source.splitlines(), ast.parse(source)
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    parts, kinds = [SCENARIOS_HEAD], list(_kinds(lines))
    for name, title in _TABLES.items():
        node = classes[name]
        last = node.end_lineno or node.lineno
        end = next((n.lineno - 2 for n in node.body if isinstance(n, ast.FunctionDef)), last)
        said = " ".join((ast.get_docstring(node) or "").split("\n\n")[0].split()).replace("``", "`")
        rows = [
            f"| `{key}` | {default} | {told or _read_by(key, kinds)} |"
            for key, default, told in _keys(lines[node.lineno : end])
        ]
        table = "\n".join(["| key | default | what it is |", "|---|---|---|", *rows])
        parts.append(f"## {title}\n\n{said}\n\n{table}\n")
    parts.append(
        "## Kinds of events\n\n| `kind` | the keys that it reads, and what happens |\n|---|---|\n"
        + "\n".join(f"| {names} | {told} |" for names, told in kinds)
        + "\n"
    )
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
    for line in lines[start + 1 :]:
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


def schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12): a View; Area, Event, Passage and Past beside it under ``$defs``."""
    _, made = msgspec.json.schema_components((View, AreaView, Event, PassageView, Past), ref_template="#/$defs/{name}")
    # In the JSON a WindView is the view's Wind: the classes have longer names, to mean one thing in this project.
    components = json.loads(re.sub(r'("#/\$defs/|"title": ")?(\w+)View"', r'\1\2"', json.dumps(made)))
    for component in components.values():
        if component.get("type") == "object":
            component["additionalProperties"] = False
            component["required"] = list(component["properties"])
            for part in component["properties"].values():
                part.pop("default", None)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": SCHEMA,
        "title": SCHEMA,
        "$ref": "#/$defs/View",
        "$defs": dict(sorted(components.items())),
    }


def types(of: dict[str, Any]) -> str:
    """Return the schema's definitions as TypeScript."""
    lines = ["// Made by python -m bench.pages from companion/view/values.py. Do not edit.", ""]
    for name, component in of["$defs"].items():
        if component.get("type") != "object":
            lines += [f"export type {name} = {_type(component)};", ""]
            continue
        lines += ["/**", *(f" * {line}".rstrip() for line in component.get("description", "").splitlines()), " */"]
        lines.append(f"export interface {name} {{")
        lines += [f"  {key}: {_type(part)};" for key, part in component["properties"].items()]
        lines += ["}", ""]
    return "\n".join(lines)


def _type(part: dict[str, Any]) -> str:
    if "$ref" in part:
        return str(part["$ref"].rpartition("/")[2])
    if "anyOf" in part:
        return " | ".join(_type(p) for p in part["anyOf"])
    if "enum" in part:
        return " | ".join(json.dumps(word) for word in part["enum"])
    kind = part.get("type")
    if kind == "array":
        if "prefixItems" in part:
            return f"[{', '.join(_type(p) for p in part['prefixItems'])}]"
        inner = _type(part["items"])
        return f"({inner})[]" if " | " in inner else f"{inner}[]"
    return {"integer": "number"}.get(str(kind), str(kind))


if __name__ == "__main__":
    for path, text in made().items():
        path.write_text(text, encoding="utf-8")

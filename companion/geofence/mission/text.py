"""The text of a mission TOML: its options read and written, and what is wrong in it by its place there."""

from __future__ import annotations

import datetime as dt
import difflib
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import tomli_w

from companion.errors import InputError, not_toml
from companion.geofence.formats.untrusted import decode, read_bytes
from companion.geofence.mission.options import ATOMS, KINDS, AtomOptions, MissionOptions, PointOptions, tables
from companion.words import choices, expected

MAX_TOML_BYTES = 1024 * 1024
# In which a mission's keys and tables are written.
TABLE_ORDER = (
    "name",
    "description",
    "from_autopilot",
    "start",
    "goal",
    "field",
    "refuge",
    "area",
    "wind",
    "current",
    "risk",
    "boat",
    "autopilot",
    "operator",
    "skipper",
    "planner",
    "passage",
    "safety",
    "traffic",
    "sounder",
    "output",
)


def read_options(path: Path) -> MissionOptions:
    """Read the options of a mission TOML; no file that it names is looked at. Raises InputError."""
    source = str(path)
    return parse_options(decode(read_bytes(path, max_bytes=MAX_TOML_BYTES), source), source)


def parse_options(text: str, source: str) -> MissionOptions:
    """Return the options of a mission TOML text. Raises InputError with the key and the nearest known spelling."""
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise not_toml(source, text, error) from None
    except RecursionError:
        raise InputError(source, "", "is nested too deeply") from None
    except ValueError as error:  # a number of thousands of digits
        raise not_toml(source, "", error) from None
    if "polar" in raw and "goal" not in raw:
        raise InputError(source, "", "is a boat file, not a mission", f"look at it by: companion boat show {source}")
    _refuse_odd_numbers(raw, source, "")
    goals = raw.get("goal")
    for goal in goals if isinstance(goals, list) else ():
        if isinstance(goal, dict):
            goal.setdefault("kind", "point")
    _refuse_odd_atoms(raw.get("field"), source)
    return options_in(raw, source)


def options_in(raw: dict[str, Any], source: str) -> MissionOptions:
    """Return the options that tables say. Raises InputError with the table, the key and what it may be."""
    try:
        return msgspec.convert(raw, MissionOptions)
    except msgspec.ValidationError as error:
        raise _input_error(str(error), source, raw) from None


GOAL_MISSING = (
    "add [[goal]] with lat and lon; goals drawn in a ground station are sailed by "
    "companion run --from-autopilot FILE, or from_autopilot = true in it"
)


def dump_options(options: MissionOptions) -> str:
    """Return the options as TOML, leaving out what has its default."""
    data = without_defaults(options)
    # whatever has no place in the order yet comes last, and is not lost
    return toml({k: data[k] for k in (*TABLE_ORDER, *data) if k in data})


def toml(data: Mapping[str, Any]) -> str:
    """Return the text of a mission file: each goal and refuge with a header of its own, to which more can be added.

    tomli_w alone puts short tables into one array, behind which ``[[goal]]`` may not stand any more.
    """
    pieces = [tomli_w.dumps({k: v for k, v in data.items() if not isinstance(v, dict) and not _is_tables(v)})]
    for key, value in data.items():
        if isinstance(value, dict):
            pieces.append(tomli_w.dumps({key: value}))
        elif _is_tables(value):
            for item in value:
                own = {k: v for k, v in item.items() if not isinstance(v, dict)}
                inner = "".join(f"[{key}.{k}]\n{tomli_w.dumps(v)}" for k, v in item.items() if isinstance(v, dict))
                pieces.append(f"[[{key}]]\n{tomli_w.dumps(own)}{inner}")
    return "\n".join(piece for piece in pieces if piece)


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def without_defaults(struct: msgspec.Struct) -> dict[str, Any]:
    """Return what a table of a file says where all that has its default is left out."""
    tag = struct.__struct_config__.tag
    is_default = tag is None or (tag == "point" and isinstance(struct, PointOptions))
    out: dict[str, Any] = {} if is_default else {"kind": tag}
    for field in msgspec.structs.fields(struct):
        value, made = getattr(struct, field.name), field.default_factory
        if value is None or value == (field.default if made is msgspec.NODEFAULT else made()):
            continue
        if isinstance(value, msgspec.Struct):
            out[field.name] = without_defaults(value)
        elif isinstance(value, dict):
            out[field.name] = {k: without_defaults(v) if isinstance(v, msgspec.Struct) else v for k, v in value.items()}
        elif isinstance(value, tuple):
            out[field.name] = [without_defaults(v) if isinstance(v, msgspec.Struct) else v for v in value]
        else:
            out[field.name] = value
    return out


def _refuse_odd_atoms(atoms: object, source: str) -> None:
    """Raise for an atom of a field that is wrong, by its name, which msgspec does not tell."""
    for name, atom in atoms.items() if isinstance(atoms, dict) else ():
        table = f"[field.{name[:40]}]"
        if not isinstance(atom, dict):
            raise InputError(source, table, f"{_short(atom)} is no table", f"write {table} and its kind below")
        kind = atom.get("kind")
        if kind not in ATOMS:
            near = difflib.get_close_matches(str(kind), ATOMS, n=1, cutoff=0.5)
            problem = "is missing" if kind is None else f"{_short(kind)} is no kind of atom"
            raise InputError(
                source,
                f"{table} kind",
                problem,
                f'did you mean "{near[0]}"?' if near else "write " + " or ".join(f'"{k}"' for k in ATOMS),
            )
        try:
            msgspec.convert(atom, AtomOptions)
        except msgspec.ValidationError as error:
            problem, _, path = str(error).partition(" - at `")
            key = path.rstrip("`").removeprefix("$").removeprefix(".")
            unknown = re.search(r"unknown field `(.+)`", problem)
            missing = re.search(r"missing required field `(.+)`", problem)
            if unknown:
                fields = ("kind", *ATOMS[kind].__struct_fields__)
                near = difflib.get_close_matches(unknown.group(1), fields, n=1, cutoff=0.5)
                raise InputError(
                    source,
                    f"{table} {unknown.group(1)}",
                    "unknown key",
                    f"did you mean {near[0]!r}?" if near else "known keys: " + ", ".join(fields),
                ) from None
            if missing:
                raise InputError(source, f"{table} {missing.group(1)}", "is missing", "add it") from None
            raise InputError(source, f"{table} {key}".rstrip(), expected(problem)) from None


def _refuse_odd_numbers(value: object, source: str, place: str) -> None:
    """Raise for NaN and infinities, which TOML has and no range check of msgspec refuses."""
    if isinstance(value, dict):
        for key, inner in value.items():
            _refuse_odd_numbers(inner, source, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            _refuse_odd_numbers(inner, source, f"{place}[{index}]")
    elif isinstance(value, float) and not np.isfinite(value):
        raise InputError(source, _place("$." + place), f"{value} is not a finite number")


def _place(path: str) -> str:
    """Return msgspec's ``$.goal[0].lat`` as ``[[goal]] 1 lat`` and ``$.area.margin_m`` as ``[area] margin_m``."""
    match = re.fullmatch(r"\$\.(\w+)(?:\[(\d+|\.\.\.)\])?(?:\.(\w+))?(.*)", path)
    if not match:
        return ""
    table, index, key, rest = match.groups()
    if index is not None and table in {"goal", "refuge"}:
        number = f" {int(index) + 1}" if index.isdigit() else ""
        return f"[[{table}]]{number} {key or ''}{rest}".rstrip()
    if key is None and table not in tables():
        return f"{table}{f'[{index}]' if index else ''}"
    return f"[{table}] {key or ''}{rest}".rstrip()


def _input_error(message: str, source: str, raw: dict[str, Any]) -> InputError:
    problem, _, path = message.partition(" - at `")
    path = path.rstrip("`")
    place = _place(path) if path else ""
    known = tables()
    unknown = re.search(r"unknown field `(.+)`", problem)
    if unknown:
        key = unknown.group(1)
        table = re.sub(r"^\$\.?", "", path)
        table = re.sub(r"[\[.].*", "", table)
        fields = known.get(table, ())
        goal = _value_at(raw, path)
        if table == "goal" and isinstance(goal, dict) and goal.get("kind") in KINDS:
            fields = ("kind", *KINDS[goal["kind"]].__struct_fields__)
        near = difflib.get_close_matches(key, fields, n=1, cutoff=0.5)
        elsewhere = [t for t, keys in known.items() if key in keys and t != table]
        remedy = (
            f"did you mean {near[0]!r}?"
            if near
            else f"it belongs in [{elsewhere[0]}]"
            if elsewhere and elsewhere[0]
            else "known keys: " + ", ".join(fields)
        )
        return InputError(source, f"{place} {key}".strip(), "unknown key", remedy)
    missing = re.search(r"missing required field `(.+)`", problem)
    if missing:
        key = missing.group(1)
        remedy = GOAL_MISSING if key == "goal" else "add it"
        return InputError(source, f"{place} {key}".strip(), "is missing", remedy)
    if place.endswith(" kind") and place.startswith("[[goal]]"):
        kind = _value_at(raw, path)
        near = difflib.get_close_matches(str(kind), KINDS, n=1, cutoff=0.5)
        return InputError(
            source,
            place,
            f"{_short(kind)} is no kind of goal",
            f'did you mean "{near[0]}"?' if near else "write " + " or ".join(f'"{k}"' for k in KINDS),
        )
    if problem.startswith("Invalid enum value"):
        return InputError(
            source,
            place,
            f"{_short(_value_at(raw, path))} is none of the choices",
            "write " + " or ".join(f'"{choice}"' for choice in choices(MissionOptions, path)),
        )
    value = _value_at(raw, path)
    shown = f"{_short(value)} is wrong: " if value is not None and not isinstance(value, dict | list) else ""
    swap = ""
    if place.endswith(" lat") and isinstance(value, int | float) and abs(value) > 90.0:
        swap = "are lat and lon swapped? write degrees within ±90"
    if isinstance(value, str) and "Expected `array`" in problem:
        swap = f"write [{_short(value)}]"
    words = expected(problem)
    return InputError(source, place, shown + words.partition(", got ")[0] if shown else words, swap)


def _short(value: object) -> str:
    text = str(value) if isinstance(value, dt.date | dt.time) else repr(value)
    return text if len(text) <= 40 else text[:40] + "..."


def _value_at(raw: dict[str, Any], path: str) -> object:
    value: object = raw
    for part in re.findall(r"\.(\w+)|\[(\d+)\]", path):
        try:
            value = value[part[0]] if part[0] else value[int(part[1])]  # type: ignore[index]
        except (KeyError, IndexError, TypeError):
            return None
    return value

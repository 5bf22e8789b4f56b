"""The schema of the view's JSON, and the page's types: ``python -m companion.view.schema`` writes both from the values.

Every object has all of its keys and no other; what is not known is null.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import msgspec

from companion.view.area import AreaView
from companion.view.events import Event
from companion.view.values import Past, View

HERE = Path(__file__).parent
FILE, TYPES = HERE / "view.schema.json", HERE / "view.d.ts"
TOPS = (View, AreaView, Event, Past)


def schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12): a View; Area, Event and Past beside it under ``$defs``."""
    _, made = msgspec.json.schema_components(TOPS, ref_template="#/$defs/{name}")
    # In the JSON a WindView is the view's Wind: the classes have longer names, to mean one thing in this project.
    components = json.loads(re.sub(r'("#/\$defs/|"title": ")?(\w+)View"', r'\1\2"', json.dumps(made)))
    for component in components.values():
        if component.get("type") == "object":
            component["additionalProperties"] = False
            component["required"] = list(component["properties"])
            for part in component["properties"].values():
                part.pop("default", None)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema", "$id": "companion.view/1",
        "title": "companion.view/1", "$ref": "#/$defs/View", "$defs": dict(sorted(components.items())),
    }


def types(of: dict[str, Any]) -> str:
    """Return the schema's definitions as TypeScript."""
    lines = ["// Made by python -m companion.view.schema from companion/view/values.py. Do not edit.", ""]
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


def files() -> dict[Path, str]:
    """Return what the files should hold."""
    made = schema()
    return {FILE: json.dumps(made, indent=1) + "\n", TYPES: types(made)}


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")

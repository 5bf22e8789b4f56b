"""A scenario as a file says it: what is not the default, and nothing else."""

from __future__ import annotations

from typing import Any

import msgspec
import tomli_w

from sitl.scene.scenario import Scenario


def scenario_text(scenario: Scenario) -> str:
    """Return the TOML of a scenario; files in it are named as it names them."""
    return tomli_w.dumps(_plain(scenario))


def _plain(struct: msgspec.Struct) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for field in msgspec.structs.fields(struct):
        value = getattr(struct, field.name)
        if value is None or (field.default is not msgspec.NODEFAULT and value == field.default):
            continue
        if isinstance(value, msgspec.Struct):
            out |= {field.name: table} if (table := _plain(value)) else {}
        elif isinstance(value, tuple) and value and isinstance(value[0], msgspec.Struct):
            out[field.name] = [_plain(inner) for inner in value]
        elif value not in ({}, ()):
            out[field.name] = value
    return out

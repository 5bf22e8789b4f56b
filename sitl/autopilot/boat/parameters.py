"""The autopilot's parameter table: names, values, MAVLink types, order."""

from __future__ import annotations

import difflib
import math
import struct
from collections.abc import Mapping

from companion.errors import InputError
from sitl.autopilot.boat.parameter_table import NEW_NAMES, TABLE

_TYPES = {"INT8": 2, "INT16": 4, "INT32": 6, "REAL32": 9}
_LIMITS = {2: (-128, 127), 4: (-32768, 32767), 6: (-(2**31), 2**31 - 1)}
# Counted by the autopilot, not set by anybody.
READ_ONLY = frozenset({"FENCE_TOTAL", "RALLY_TOTAL", "MIS_TOTAL", "FORMAT_VERSION", "STAT_RUNTIME", "STAT_FLTTIME"})


class Parameters:
    """Values by name; ``revision`` counts the changes.

    Args:
        overrides: values other than the fresh boat's. A name that is not in the table is added as REAL32, so a
            scenario can give a parameter that only its doctor looks at.
        new_names: answer to the names of ArduPilot 4.7 instead of the older ones; inside, the older stay.
    """

    def __init__(self, overrides: Mapping[str, float], *, new_names: bool = False) -> None:
        self.revision = 0
        self._values: dict[str, float] = {}
        self._types: dict[str, int] = {}
        for line in TABLE.splitlines():
            if line and not line.startswith("#"):
                name, value, *kind = line.split()
                self._values[name] = float(value)
                self._types[name] = _TYPES[kind[0] if kind else "REAL32"]
        self._outside = {old: new for old, new in NEW_NAMES.items() if new_names and old in self._values}
        self._inside = {new: old for old, new in self._outside.items()}
        for given, number in overrides.items():
            inside = self._inside.get(given, given)
            if inside not in self._values:
                self._types[inside] = _TYPES["REAL32"]
            self._values[inside] = float(number)
        self._order = list(self._values)

    def get(self, name: str) -> float:
        """Return a value by its older name.

        Raises:
            KeyError: there is none.
        """
        return self._values[name]

    def flag(self, name: str) -> int:
        """Return a whole-number value."""
        return int(self._values[name])

    def put(self, name: str, value: float) -> None:
        """Set a value from inside."""
        if self._values.get(name) != value:
            self._values[name] = value
            self.revision += 1

    def __len__(self) -> int:
        return len(self._order)

    def entry(self, key: str | int) -> tuple[str, float, int, int] | None:
        """Return (name as it is sent, value, MAV_PARAM_TYPE, index) by name or index, or None."""
        if isinstance(key, int):
            if not 0 <= key < len(self._order):
                return None
            inside, index = self._order[key], key
        else:
            if key in self._outside:
                return None  # this boat knows it by its new name only
            inside = self._inside.get(key, key)
            if inside not in self._values:
                return None
            index = self._order.index(inside)
        return self._outside.get(inside, inside), self._values[inside], self._types[inside], index

    def set(self, name: str, value: float) -> bool:
        """Set a value from outside; False if the name is unknown. What does not fit the type is brought into it."""
        entry = self.entry(name)
        if entry is None or not math.isfinite(value):
            return entry is not None
        inside = self._inside.get(name, name)
        if inside in READ_ONLY:
            return True
        kind = self._types[inside]
        if kind in _LIMITS:
            low, high = _LIMITS[kind]
            value = float(max(low, min(high, round(value))))
        self.put(inside, value)
        return True


def check_parameters(overrides: Mapping[str, float]) -> None:
    """Refuse parameters that the simulated boat does not have, and values that a float of the wire cannot carry.

    Raises:
        InputError: naming the parameter.
    """
    known = {line.split()[0] for line in TABLE.splitlines() if line and not line.startswith("#")}
    known |= set(NEW_NAMES.values())
    for name, value in overrides.items():
        if name not in known:
            near = difflib.get_close_matches(name.upper(), known, n=1)
            raise InputError("--param", name, "is no parameter of this boat", f"did you mean {near[0]}?" if near else
                             "docs/reference/simulated-autopilot.md says which it has")
        if not math.isfinite(value) or len(name) > 16 or struct.unpack("f", struct.pack("f", value))[0] != value:
            raise InputError("--param", name, f"{value} cannot be a parameter", "write NAME=NUMBER")

"""What a crew could do otherwise: a key of the mission, a parameter of the autopilot, a later hour; one at a time."""

from __future__ import annotations

import datetime as dt
from argparse import ArgumentTypeError
from dataclasses import dataclass

import msgspec

from companion.boat import AutopilotLimits
from companion.errors import InputError
from companion.geofence import Mission
from companion.mission_check import require_sailable
from companion.program.arguments import duration
from sitl.run.variation import Variation
from sitl.scene import Scenario

TABLES = {"margin_m": "area", "delta_s": "risk"}
CORRIDOR = "SAIL_XTRACK_MAX"
LATER = "later"
_REMEDY = f"write {', '.join(f'{name}=NUMBER' for name in (*TABLES, CORRIDOR))} or {LATER}=1h"


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One thing that is otherwise: ``name`` of it, ``value`` in its own unit (of ``later`` seconds)."""

    name: str
    value: float
    told: str

    def scenario(self, scenario: Scenario) -> Scenario:
        """Return a scenario so changed; what the mission says is changed by ``variation``."""
        if self.name == CORRIDOR:
            return msgspec.structs.replace(scenario, parameters={**scenario.parameters, CORRIDOR: self.value})
        if self.name != LATER:
            return scenario
        current = scenario.current and msgspec.structs.replace(
            scenario.current, tide_high_s=scenario.current.tide_high_s - self.value)
        return msgspec.structs.replace(
            scenario, begins=scenario.begins + dt.timedelta(seconds=self.value), current=current,
            wind=msgspec.structs.replace(scenario.wind, from_s=scenario.wind.from_s + self.value))

    @property
    def variation(self) -> Variation | None:
        """What is another in the mission."""
        return Variation(tables={TABLES[self.name]: {self.name: self.value}}) if self.name in TABLES else None


def change_of(text: str, mission: Mission) -> Change:
    """Return the change that ``--try`` says: ``margin_m=20``, ``delta_s=0.95``, ``SAIL_XTRACK_MAX=5``, ``later=1h``.

    Raises:
        InputError: there is no such thing to change, or the mission cannot be sailed with it.
    """
    name, _, value = text.partition("=")
    try:
        number = duration(value) if name == LATER else float(value)
    except (ArgumentTypeError, ValueError):
        raise InputError("--try", text, "is not a change that is known", _REMEDY) from None
    if name not in {*TABLES, CORRIDOR, LATER} or (name == CORRIDOR and not 0.0 <= number <= 1000.0):
        raise InputError("--try", text, "is not a change that is known", _REMEDY)
    change = Change(name=name, value=number, told=f"{value} {LATER}" if name == LATER else f"{name} {number:g}")
    if change.variation is not None:
        plain = msgspec.to_builtins(mission.options)
        plain[TABLES[name]][name] = number
        try:
            msgspec.convert(plain[TABLES[name]], type(getattr(mission.options, TABLES[name])))
        except msgspec.ValidationError as error:
            raise InputError("--try", text, str(error).partition(" - at ")[0], _REMEDY) from None
        require_sailable(change.variation.mission(mission))
    return change


def usual(mission: Mission, *, tells_the_hour: bool) -> list[Change]:
    """Return what a crew would think of first; ``tells_the_hour`` is whether the hour makes a difference at all."""
    margin_m, delta_s, corridor_m = mission.margin_m, mission.risk.delta_s, AutopilotLimits().sail_xtrack_max_m
    less_m = max(mission.margin_floor_m, round(margin_m / 1.5, 1))
    wanted = [f"margin_m={round(1.5 * margin_m, 1):g}", *([f"margin_m={less_m:g}"] if less_m < margin_m else []),
              f"delta_s={round(0.5 * (1.0 + delta_s), 3):g}", *([f"delta_s={round(delta_s - 0.1, 3):g}"]
                                                               if delta_s >= 0.6 else []),
              f"{CORRIDOR}={0.5 * corridor_m:g}", f"{CORRIDOR}={2.0 * corridor_m:g}",
              *([f"{LATER}=1h"] if tells_the_hour else [])]
    found = []
    for text in wanted:
        try:
            found.append(change_of(text, mission))
        except InputError:   # a margin that closes the water, say: nothing to try
            continue
    return found

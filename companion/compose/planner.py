"""A mission's planner and its numbers."""

from __future__ import annotations

import math
from typing import Any

from companion.errors import InputError
from companion.geo.units import MPS_PER_KNOT
from companion.geofence import Mission
from companion.planner.settings import AUTO, SETTINGS, Choice

# The keys of [planner] by planner, and what they are called among its settings.
_ASTAR = frozenset({"grid_m", "turn_s_per_rad", "tack_s", "gybe_s", "tunnel", "tunnel_width_m", "heuristic_kn",
                    "min_twa_deg", "max_twa_deg", "max_turn_deg", "ship_match_s", "projection"})
_RRTSTAR = frozenset({"goal_bias", "range_m", "rewiring", "risk_weight_s", "state_risk_weight_s"})
_NUMBERS = {"tunnel": "is_tunnel_abrupt", "heuristic_kn": "heuristic_mps", "min_twa_deg": "min_twa_rad",
            "max_twa_deg": "max_twa_rad", "max_turn_deg": "max_turn_rad", "rewiring": "is_rewired"}


def planner_of(mission: Mission) -> Choice:
    """Return the mission's planner and its numbers.

    Raises:
        InputError: a number is another planner's, or a tunnel has no width.
    """
    options, algorithm = mission.options.planner, mission.skipper.planner
    given = {key: value for key in options.__struct_fields__ if (value := getattr(options, key)) is not None}
    expansions = given.pop("expansions", None)
    if expansions is not None and algorithm == AUTO.algorithm:
        raise InputError(str(mission.path), "[planner] expansions", 'is for "rrtstar" and "astar"',
                         "write [skipper] expansions for auto's")
    own = _ASTAR if algorithm == "astar" else _RRTSTAR if algorithm == "rrtstar" else frozenset()
    for key in given:
        if key not in own:
            whose = "astar" if key in _ASTAR else "rrtstar"
            raise InputError(str(mission.path), f"[planner] {key}",
                             f"is a number of {whose!r}, and this mission plans by {algorithm!r}",
                             f'write [skipper] planner = "{whose}", or leave it out')
    if "tunnel" in given and "tunnel_width_m" not in given:
        raise InputError(str(mission.path), "[planner] tunnel", "a tunnel has a width", "add tunnel_width_m")
    if algorithm == AUTO.algorithm:
        return AUTO
    numbers: dict[str, Any] = {_NUMBERS.get(key, key): value for key, value in given.items()}
    for key in ("min_twa_rad", "max_twa_rad", "max_turn_rad"):
        if key in numbers:
            numbers[key] = math.radians(numbers[key])
    if "heuristic_mps" in numbers:
        numbers["heuristic_mps"] = numbers["heuristic_mps"] * MPS_PER_KNOT or None
    if "is_tunnel_abrupt" in numbers:
        numbers["is_tunnel_abrupt"] = numbers["is_tunnel_abrupt"] == "abrupt"
    return Choice(algorithm=algorithm, settings=SETTINGS[algorithm](**numbers), expansions=expansions)

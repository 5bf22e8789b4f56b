"""A mission's wind estimator."""

from __future__ import annotations

from typing import Any

from companion.errors import InputError
from companion.geofence import Mission
from companion.wind import Estimator, make

_KALMAN = {"kalman_window": "n", "kalman_r_deg": "r_deg", "kalman_r_mps": "r_mps"}


def estimator_of(mission: Mission) -> Estimator:
    """Return the mission's wind estimator. Raises InputError for a name unknown."""
    numbers = _kalman(mission)
    try:
        return make(mission.wind.estimator, **numbers)
    except InputError as error:
        name = mission.wind.estimator
        raise InputError(str(mission.path), "[wind] estimator", f"{name!r} {error.problem}", error.remedy) from error


def _kalman(mission: Mission) -> dict[str, Any]:
    """Return the numbers of Wolsieffer's filter that the mission gives. Raises InputError for another estimator."""
    given = {key: value for key in _KALMAN if (value := getattr(mission.wind, key)) is not None}
    if given and mission.wind.estimator != "kalman":
        raise InputError(str(mission.path), f"[wind] {next(iter(given))}",
                         f"is for the estimator \"kalman\", and this mission's is {mission.wind.estimator!r}",
                         'write estimator = "kalman", or leave it out')
    return {_KALMAN[key]: value for key, value in given.items()}

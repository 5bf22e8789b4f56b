"""The estimators by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from companion.errors import InputError
from companion.wind.estimator import Estimator
from companion.wind.forecaster import Forecaster
from companion.wind.ou import OrnsteinUhlenbeck

__all__ = ["NAMES", "Forecaster", "make"]

_MAKERS: dict[str, Callable[..., Estimator]] = {
    "default": Forecaster,
    "ou": OrnsteinUhlenbeck,
}

NAMES = tuple(_MAKERS)


def make(name: str, **options: Any) -> Estimator:
    """Return a new estimator; ``options`` are its constructor's keywords. Raises InputError for a name unknown."""
    maker = _MAKERS.get(name)
    if maker is None:
        raise InputError("estimator", name, "there is none of that name", "choose " + ", ".join(NAMES))
    return maker(**options)

"""The estimators by name."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from functools import partial
from typing import Any

from companion.errors import InputError
from companion.wind.estimators.estimator import Estimator
from companion.wind.estimators.forecaster import Forecaster
from companion.wind.estimators.kalman import AdaptiveKalman
from companion.wind.estimators.means import RollingMean
from companion.wind.estimators.ou import OrnsteinUhlenbeck
from companion.wind.estimators.time_series import Arma, Garch

__all__ = ["NAMES", "Forecaster", "make"]

_MAKERS: dict[str, Callable[..., Estimator]] = {
    "default": Forecaster,
    "kalman": AdaptiveKalman,
    "ou": OrnsteinUhlenbeck,
    "arma": Arma,
    "garch": Garch,
    "mean90": partial(RollingMean, window_s=90.0),
    "mean5": partial(RollingMean, window_s=5.0),
}

NAMES = tuple(_MAKERS)


def make(name: str, **options: Any) -> Estimator:
    """Return a new estimator; ``options`` are its constructor's keywords. Raises InputError for a name unknown."""
    maker = _MAKERS.get(name)
    if maker is None:
        near = difflib.get_close_matches(name, NAMES, n=1)
        remedy = f"did you mean {near[0]!r}? " if near else ""
        raise InputError("estimator", name, "is no wind estimator", f"{remedy}choose {', '.join(NAMES)}")
    return maker(**options)

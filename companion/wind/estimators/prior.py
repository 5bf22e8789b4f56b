"""What recorded wind taught: the few constants of the default forecaster, with their provenance.

Made by ``python -m companion.wind.study.fit FOLDER`` on the 14 development records (41 h on lakes, a fjord, the Baltic
and the Adriatic; docs/wind.md says which). They are shapes, not climates: how long a wind shift of a given time scale
survives, how errors grow with the horizon, how heavy their tails are. Everything about today's wind is learned on
board.

Rounded from the fit (110 to 170 evaluations); on records left out it loses less than 1 % of CRPS. ``memory`` and
``tail`` were chosen by hand: seconds of own errors, pool, quantiles, roughness, shown spread; pull of the quantiles to
their prior; shrinkage of the pool.
"""

from __future__ import annotations

import numpy as np

from companion.wind.estimators.kernel import Constants


def _array(*values: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array(values, dtype=np.float64)


CONSTANTS = Constants(
    survival=_array(9.4, 0.70),
    speed_survival=_array(2.3, 0.60),
    sigma=_array(0.16, 0.056, 0.41, -0.57, 1500.0),
    error=_array(0.164, 0.31),
    speed_error=_array(0.128, 0.21),
    quantile=_array(0.0, 0.305, 0.645, 0.91, 1.32, 1.87, 2.48, 3.4, 4.2, 8.0),
    tail=_array(0.05),
    memory=_array(3600.0, 7200.0, 3600.0, 60.0, 10800.0, 0.3, 0.3),
)

"""What recorded wind taught: the few constants of the default forecaster, with their provenance.

Made by ``python -m companion.wind.fit FOLDER`` on the 14 development records (41 h on lakes, a fjord, the Baltic and
the Adriatic; docs/wind.md says which). They are shapes, not climates: how long a wind shift of a given time scale
survives, how errors grow with the horizon, how heavy their tails are. Everything about today's wind is learned
on board.
"""

from __future__ import annotations

import numpy as np

from companion.wind.kernel import Constants


def _array(*values: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array(values, dtype=np.float64)


CONSTANTS = Constants(
    survival=_array(3.55, 0.857),
    speed_survival=_array(3.55, 0.857),
    sigma=_array(0.4, 0.06, -0.03, 0.42, 0.36, -0.28),
    error=_array(0.18, 0.27),
    speed_error=_array(0.15, 0.25),
    quantile=np.log(_array(1e-3, 0.30, 0.64, 0.90, 1.30, 1.78, 2.30, 3.0, 3.6, 5.5)),
    memory=_array(2400.0, 3600.0, 3600.0, 3600.0, 60.0, 7200.0, 0.3, 60.0),
)

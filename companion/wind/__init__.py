"""Wind: known, and known how well.

    from companion.wind import Forecaster, WindRoom, make

``Forecaster`` is the default estimator, ``make(name)`` gives any of them (``NAMES``), all behind ``Estimator``.
``WindRoom`` is what the application feeds: messages in, status and the planner's forecast table out.
"""

from companion.wind.estimators.catalogue import NAMES, Forecaster, make
from companion.wind.estimators.estimator import HORIZONS_S, LEVELS, Estimator
from companion.wind.parameters import VaneParameters
from companion.wind.room import WindRoom
from companion.wind.true_wind import apparent_wind, true_wind
from companion.wind.watch import Verdict, WindStatus, WindWatch

__all__ = [
    "HORIZONS_S", "LEVELS", "NAMES", "Estimator", "Forecaster", "VaneParameters", "Verdict", "WindRoom", "WindStatus",
    "WindWatch", "apparent_wind", "make", "true_wind",
]

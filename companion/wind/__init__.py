"""Wind: known, and known how well.

    from companion.wind import Forecaster, WindTracker, make

``Forecaster`` is the default estimator, ``make(name)`` gives any of them (``NAMES``), all behind ``Estimator``.
``WindTracker`` is what the application feeds: messages in, status and the planner's forecast table out.
"""

from companion.wind.estimators.catalogue import NAMES, Forecaster, make
from companion.wind.estimators.estimator import HORIZONS_S, Estimator
from companion.wind.parameters import OFFSET_TYPES, VANE_OFFSET, VANE_TYPE, VaneParameters
from companion.wind.sensor_faults import WindStatus, WindVerdict
from companion.wind.tracker import WindTracker
from companion.wind.true_wind import apparent_wind, true_wind

__all__ = [
    "HORIZONS_S",
    "NAMES",
    "OFFSET_TYPES",
    "VANE_OFFSET",
    "VANE_TYPE",
    "Estimator",
    "Forecaster",
    "VaneParameters",
    "WindStatus",
    "WindTracker",
    "WindVerdict",
    "apparent_wind",
    "make",
    "true_wind",
]

"""The current: what the mission expects of it, what the boat's own track tells of it, and the wind over the water."""

from companion.current.doubt import UNTOLD_MPS, Doubt
from companion.current.estimator import CurrentEstimator, Sailing, plain
from companion.current.motion import FITS_S, Motion, MotionCheck
from companion.current.over_water import forecast_over_water, over_ground, over_water
from companion.current.prior import DEFAULT_SIGMA_MPS, STILL, Expected, Prior, TableRow, read_table
from companion.current.value import STILL_WATER, WaterCurrent

__all__ = [
    "DEFAULT_SIGMA_MPS", "FITS_S", "STILL", "STILL_WATER", "UNTOLD_MPS", "CurrentEstimator", "Doubt",
    "Expected", "Motion", "MotionCheck", "Prior", "Sailing", "TableRow", "WaterCurrent", "forecast_over_water",
    "over_ground", "over_water", "plain", "read_table",
]

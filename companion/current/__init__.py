"""The current: what the mission expects of it and of the tide, what the boat's track tells, the wind over the water."""

from companion.current.estimator import UNTOLD_MPS, CurrentEstimator, Sailing, WindAngleUncertainty, plain
from companion.current.motion import FITS_S, MotionCheck, MotionSample
from companion.current.prior import STILL, Prior, TableRow, read_table
from companion.current.tide import (
    TideRow,
    TideTable,
    closed_spans,
    hour_words,
    lowest_m,
    open_spans,
    read_tide,
    span_words,
)
from companion.current.vane import VaneCheck, VaneError
from companion.current.water_current import STILL_WATER, WaterCurrent, forecast_over_water, over_ground, over_water

__all__ = [
    "FITS_S",
    "STILL",
    "STILL_WATER",
    "UNTOLD_MPS",
    "CurrentEstimator",
    "MotionCheck",
    "MotionSample",
    "Prior",
    "Sailing",
    "TableRow",
    "TideRow",
    "TideTable",
    "VaneCheck",
    "VaneError",
    "WaterCurrent",
    "WindAngleUncertainty",
    "closed_spans",
    "forecast_over_water",
    "hour_words",
    "lowest_m",
    "open_spans",
    "over_ground",
    "over_water",
    "plain",
    "read_table",
    "read_tide",
    "span_words",
]

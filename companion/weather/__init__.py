"""Weather: forecasts of wind, gusts and currents over time and place, read from GRIB files as one value.

``read_weather`` reads files, ``Weather`` is asked for a time and place; what lies beyond its edges is unknown.
"""

from companion.weather.assemble import Box, assemble
from companion.weather.dressing import Climate, ForecastError, continued, dressed, errors_of, fitted
from companion.weather.grib import GribField, Grid, Quantity, walk
from companion.weather.harmonics import KNOWN, constituent_named, phasors
from companion.weather.measured import Measured, Off, corrected, off_by
from companion.weather.packing import values_of
from companion.weather.readers import read_tides, read_weather
from companion.weather.tides import Tides, read_stations
from companion.weather.told import told_at, told_of
from companion.weather.weather import Cube, Weather, holes_of, iso

__all__ = [
    "KNOWN",
    "Box",
    "Climate",
    "Cube",
    "ForecastError",
    "GribField",
    "Grid",
    "Measured",
    "Off",
    "Quantity",
    "Tides",
    "Weather",
    "assemble",
    "constituent_named",
    "continued",
    "corrected",
    "dressed",
    "errors_of",
    "fitted",
    "holes_of",
    "iso",
    "off_by",
    "phasors",
    "read_stations",
    "read_tides",
    "read_weather",
    "told_at",
    "told_of",
    "values_of",
    "walk",
]

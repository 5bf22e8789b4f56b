"""Charts: what cells, coastlines and grids say of the water, made into obstacles and a fence.

``read_chart`` reads one file, ``area_of`` makes the area of several. No area of it is fit for navigation.
"""

from companion.chart.compile import TOLERANCE_M, ChartArea, Solid, area_of, containing
from companion.chart.features import Chart, Danger, Row, Source, Wanted
from companion.chart.grid import Grid, parse_ascii_grid, signed
from companion.chart.readers import Box, read_chart
from companion.chart.s57 import told_of
from companion.chart.tide import lowest_m, read_tide

__all__ = [
    "TOLERANCE_M",
    "Box",
    "Chart",
    "ChartArea",
    "Danger",
    "Grid",
    "Row",
    "Solid",
    "Source",
    "Wanted",
    "area_of",
    "containing",
    "lowest_m",
    "parse_ascii_grid",
    "read_chart",
    "read_tide",
    "signed",
    "told_of",
]

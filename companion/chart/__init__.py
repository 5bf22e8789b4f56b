"""Charts: what cells, coastlines and grids say of the water, made into obstacles and a fence.

``read_chart`` reads one file, ``area_of`` makes the area of several, ``read_picture`` what is drawn of one. No area of
it is fit for navigation.
"""

from companion.chart.compile import TOLERANCE_M, ChartArea, Solid, area_of, containing
from companion.chart.features import Box, Chart, Danger, Row, Source, Wanted, box_about
from companion.chart.grid import Grid, parse_ascii_grid, signed
from companion.chart.picture import ChartPicture
from companion.chart.readers import read_chart, read_picture
from companion.chart.s57 import told_of

__all__ = [
    "TOLERANCE_M",
    "Box",
    "Chart",
    "ChartArea",
    "ChartPicture",
    "Danger",
    "Grid",
    "Row",
    "Solid",
    "Source",
    "Wanted",
    "area_of",
    "box_about",
    "containing",
    "parse_ascii_grid",
    "read_chart",
    "read_picture",
    "signed",
    "told_of",
]

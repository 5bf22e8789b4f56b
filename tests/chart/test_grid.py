"""Grids of depths: whichever way they are written, what is drawn straight between their cells lies in what is solid."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point

from companion.chart import Source, Wanted
from companion.chart.grid import Grid, chart_of, parse_ascii_grid, signed, without_fill
from companion.errors import InputError

SOURCE = Source(name="g")
ASC = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 50\ncellsize 0.5\nNODATA_value -9999\n-1 -2 -3\n-4 -5 -9999\n"


def solid_of(grid, depth_m=2.0):
    dangers = chart_of(grid, SOURCE, Wanted(safety_depth_m=depth_m)).dangers
    return shapely.union_all([d.geometry for d in dangers]) if dangers else shapely.Polygon()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.integers(2, 9))
def test_what_lies_between_the_middles_is_contained(seed, rows, columns):
    rng = np.random.default_rng(seed)
    grid = Grid(
        x=np.arange(columns, dtype=float), y=np.arange(rows, dtype=float), heights_m=rng.uniform(-6, 2, (rows, columns))
    )
    solid = solid_of(grid)
    for x, y in rng.uniform((0, 0), (columns - 1, rows - 1), (60, 2)):
        c, r = min(int(x), columns - 2), min(int(y), rows - 2)
        u, v = x - c, y - r
        h = grid.heights_m
        height = (
            h[r, c] * (1 - u) * (1 - v)
            + h[r, c + 1] * u * (1 - v)
            + h[r + 1, c] * (1 - u) * v
            + h[r + 1, c + 1] * u * v
        )
        assert height <= -2.0 or shapely.intersects(solid, Point(x, y))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_grid_upside_down_or_mirrored_is_the_same_water(seed):
    heights = np.random.default_rng(seed).uniform(-6, 2, (5, 7))
    x, y = np.arange(7.0), np.arange(5.0)
    plain = solid_of(Grid(x=x, y=y, heights_m=heights))
    assert plain.equals(solid_of(Grid(x=x, y=y[::-1], heights_m=heights[::-1])))
    assert plain.equals(solid_of(Grid(x=x[::-1], y=y, heights_m=heights[:, ::-1])))


def test_what_is_not_known_is_solid():
    heights = np.full((3, 3), -9.0)
    assert solid_of(Grid(x=np.arange(3.0), y=np.arange(3.0), heights_m=heights)).is_empty
    heights[0, 0] = np.nan
    assert solid_of(Grid(x=np.arange(3.0), y=np.arange(3.0), heights_m=heights)).area == 1.0


@pytest.mark.parametrize("fill", [-9999.0, 9999.0, -32768.0, 3.4e38, -999.0, -99999.0])
def test_a_number_that_stands_for_nothing_is_no_depth(fill):
    """A hole that the file did not declare was free water 9999 m deep."""
    heights = np.full((4, 4), -9.0)
    heights[1, 2] = fill
    grid, told = without_fill(Grid(x=np.arange(4.0), y=np.arange(4.0), heights_m=heights))
    assert told == (fill,)
    assert solid_of(grid).area == 4.0
    assert np.isnan(signed(grid, "g", "down").heights_m[1, 2])


def test_a_depth_of_999_metres_among_others_is_one():
    heights = np.linspace(-1100.0, -900.0, 202)[1:-1].reshape(10, 20).round()
    heights[3, 4] = -999.0
    grid = Grid(x=np.arange(20.0), y=np.arange(10.0), heights_m=heights)
    assert without_fill(grid) == (grid, ())


def test_an_ascii_grid_begins_in_the_north():
    grid = parse_ascii_grid(ASC, "g.asc").northwards()
    assert grid.x.tolist() == [10.25, 10.75, 11.25]
    assert grid.y.tolist() == [50.25, 50.75]
    assert grid.heights_m[1].tolist() == [-1.0, -2.0, -3.0]
    assert np.isnan(grid.heights_m[0, 2])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (ASC.replace("ncols 3", "ncols inf"), "g.asc: line 1: 'inf' is not a number"),
        (ASC.replace("0.5", "nan"), "g.asc: line 5: 'nan' is not a number"),
        (ASC.replace("-5", "x"), "g.asc: line 8: holds what is not a number; save it again"),
        (ASC.removesuffix(" -9999\n"), "g.asc: line 8: ends after 5 of 6 heights; fetch it again"),
        (ASC + "1 2 3\n", "g.asc: line 9: has more than 3 x 2 heights; save it again"),
        (
            ASC.replace("cellsize 0.5\n", ""),
            "g.asc: line 1: an ASCII grid has no cellsize; save it as Esri ASCII (.asc)",
        ),
        (
            ASC.replace("ncols 3", "ncols 99999999"),
            "g.asc: line 1: 99999999 x 2 cells of 0.5 are no grid; cut it to the area",
        ),
        (
            ASC.replace("yllcorner 50\n", ""),
            "g.asc: line 1: does not say where it lies (xllcorner, yllcorner); save it again",
        ),
    ],
)
def test_a_grid_that_is_none_is_refused_by_its_line(text, told):
    with pytest.raises(InputError) as refused:
        parse_ascii_grid(text, "g.asc")
    assert str(refused.value) == told


def test_depths_as_positive_numbers_are_not_taken_for_heights():
    grid = Grid(x=np.arange(2.0), y=np.arange(2.0), heights_m=np.array([[1.0, 4.0], [9.0, 9.0]]))
    with pytest.raises(InputError, match=r"cell of 9 m: no cell is below zero.*--positive down"):
        signed(grid, "g.asc", "auto")
    assert signed(grid, "g.asc", "down").heights_m.tolist() == [[-1.0, -4.0], [-9.0, -9.0]]
    assert signed(grid, "g.asc", "up") is grid

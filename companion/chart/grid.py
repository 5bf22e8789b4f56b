"""Grids of depths: where the water is too shallow between the middles of their cells, as areas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.chart.features import Chart, Danger, Source, Wanted
from companion.errors import InputError
from companion.geo import DEGREE_M

MOST_CELLS = 25_000_000
MOST_HEIGHT_M = 11_500.0  # the deepest trench has 10,935 m, the highest mountain 8,849
_FILLED = (99.0, 999.0, 9999.0)  # what programs write for nothing, perhaps without saying so
_ALIKE = 0.1  # a height that is one has others within so much of it
BAND_M = 0.5  # of water that dries: a piece of it is no farther from its own least depth ...
MOST_BANDS = 6  # ... but where the tide is great: each band takes discs of a plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Heights above the grid's datum [m], negative under water, NaN where nothing is known.

    ``heights_m`` has a row for each of ``y`` and a column for each of ``x``: the middles of the cells, in either order,
    evenly spaced.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    heights_m: NDArray[np.float64]

    def northwards(self) -> Grid:
        """Return the grid with x and y ascending, whichever way it was written."""
        across, up = np.argsort(self.x), np.argsort(self.y)
        return Grid(x=self.x[across], y=self.y[up], heights_m=self.heights_m[np.ix_(up, across)])


def parse_ascii_grid(text: str, source: str) -> Grid:
    """Return an Esri ASCII grid (.asc), as GEBCO and EMODnet hand out. Raises InputError naming the line."""
    lines = text.splitlines()
    header: dict[str, float] = {}
    first = 0
    for first, line in enumerate(lines):
        words = line.split()
        if len(words) != 2 or not words[0][:1].isalpha():
            break
        key, wrong = words[0].lower(), InputError(source, f"line {first + 1}", f"{words[1][:20]!r} is not a number")
        try:
            header[key] = float(words[1])
        except ValueError:
            raise wrong from None
        if key != "nodata_value" and not math.isfinite(header[key]):
            raise wrong
    missing = [k for k in ("ncols", "nrows", "cellsize") if k not in header]
    if missing:
        raise InputError(source, "line 1", f"an ASCII grid has no {missing[0]}", "save it as Esri ASCII (.asc)")
    columns, rows, cell = int(header["ncols"]), int(header["nrows"]), header["cellsize"]
    if not (1 < columns * rows <= MOST_CELLS and columns > 1 and rows > 1 and cell > 0.0):
        raise InputError(source, "line 1", f"{columns} x {rows} cells of {cell:g} are no grid", "cut it to the area")
    if not {"xllcorner", "xllcenter"} & set(header) or not {"yllcorner", "yllcenter"} & set(header):
        raise InputError(source, "line 1", "does not say where it lies (xllcorner, yllcorner)", "save it again")
    west = header.get("xllcenter", header.get("xllcorner", 0.0) + 0.5 * cell)
    south = header.get("yllcenter", header.get("yllcorner", 0.0) + 0.5 * cell)
    values = np.empty(columns * rows)
    count = 0
    for number, line in enumerate(lines[first:], start=first + 1):
        try:
            row = np.array(line.split(), dtype=np.float64)
        except ValueError:
            raise InputError(source, f"line {number}", "holds what is not a number", "save it again") from None
        if count + row.size > values.size:
            raise InputError(source, f"line {number}", f"has more than {columns} x {rows} heights", "save it again")
        values[count : count + row.size] = row
        count += row.size
    if count < values.size:
        raise InputError(source, f"line {len(lines)}", f"ends after {count} of {values.size} heights", "fetch it again")
    values[values == header.get("nodata_value", -9999.0)] = np.nan
    return Grid(
        x=west + cell * np.arange(columns, dtype=np.float64),
        y=south + cell * np.arange(rows, dtype=np.float64)[::-1],  # its first line is the northernmost
        heights_m=values.reshape(rows, columns),
    )


def without_fill(grid: Grid) -> tuple[Grid, tuple[float, ...]]:
    """Return a grid in which what stands for nothing is not known, and the numbers that did.

    Those are beyond any sea or mountain, or one of 99, 999 and 9999, of either sign, with no other height near it: of a
    hole that a file does not declare would else be made the deepest water of all.
    """
    heights = grid.heights_m
    size = np.abs(heights)
    doubtful = np.unique(heights[(size > MOST_HEIGHT_M) | np.isin(size, _FILLED)])
    found = [value for value in doubtful.tolist() if abs(value) > MOST_HEIGHT_M or _is_alone(heights, value)]
    if not found:
        return grid, ()
    return Grid(x=grid.x, y=grid.y, heights_m=np.where(np.isin(heights, found), np.nan, heights)), tuple(found)


def _is_alone(heights: NDArray[np.float64], value: float) -> bool:
    """Return whether no other height is about as great."""
    return not ((heights != value) & (np.abs(heights - value) <= _ALIKE * abs(value))).any()


def signed(grid: Grid, source: str, positive: str) -> Grid:
    """Return the grid as heights. ``positive`` is what its numbers above zero are: ``up``, ``down`` or ``auto``.

    Raises InputError where ``auto`` finds nothing below zero: a grid of depths, or one of land.
    """
    known = grid.heights_m[np.isfinite(grid.heights_m)]
    if known.size == 0:
        raise InputError(source, "", "holds no height at all", "fetch it again, for the water of the mission")
    if positive == "down":
        return Grid(x=grid.x, y=grid.y, heights_m=-grid.heights_m)
    if positive == "auto" and not (known < 0.0).any():
        raise InputError(
            source,
            f"cell of {known.max():g} m",
            "no cell is below zero: depths written as positive numbers, or a grid of land alone",
            "say --positive down for depths, --positive up for heights",
        )
    return grid


def chart_of(
    grid: Grid,
    source: Source,
    wanted: Wanted,
    to_lonlat: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
    *,
    cell_m: float | None = None,
) -> Chart:
    """Return what a grid says: where the depth between its middles, drawn straight, is less than the safety depth.

    A square of four middles is solid when one of them is, so what is drawn straight between them lies within.
    ``to_lonlat`` brings (n, 2) of its x and y to longitude and latitude.
    """
    grid = grid.northwards()
    levels = _levels_m(wanted)
    pieces: list[tuple[BaseGeometry, float | None]] = []
    shallower = np.zeros_like(grid.heights_m, dtype=np.bool_)
    for level_m in levels:
        solid = ~(grid.heights_m <= -level_m)
        found = shapely.get_parts(_shape(grid, solid, shallower))
        pieces += [(piece, _least_m(grid, solid & ~shallower, piece)) for piece in found if not piece.is_empty]
        shallower = solid
    shapes = [*(piece for piece, _ in pieces), _shape(grid, np.ones_like(shallower))]
    if to_lonlat is not None:
        shapes = [shapely.transform(shape, to_lonlat) for shape in shapes]
    dangers = tuple(
        Danger(reason="shallow or land", geometry=shape, depth_m=depth_m)
        for shape, (_, depth_m) in zip(shapes[:-1], pieces, strict=True)
    )
    step = float(grid.y[1] - grid.y[0])
    return Chart(
        source=source,
        dangers=dangers,
        coverage=shapes[-1],
        resolution_m=cell_m if cell_m is not None else step * DEGREE_M,
        knows_depths=True,
    )


def _levels_m(wanted: Wanted) -> tuple[float, ...]:
    """Return the depths that a grid is cut at, the last where water is free: what some tide covers is by its depth.

    A flat that joins the shore, and slopes, would else be as deep as the land is, or as its highest part.
    """
    floats_m, free_m = wanted.floats_m, wanted.safety_depth_m
    if floats_m is None or floats_m >= free_m:
        return (free_m,)
    count = min(MOST_BANDS, math.ceil((free_m - floats_m) / BAND_M))
    return (*(floats_m + k * (free_m - floats_m) / count for k in range(count)), free_m)


def _least_m(grid: Grid, solid: NDArray[np.bool_], piece: BaseGeometry) -> float | None:
    """Return the least depth of what is solid of a piece [m]; None: no height of it is known."""
    west, south, east, north = shapely.bounds(piece)
    columns = slice(*np.searchsorted(grid.x, (west, np.nextafter(east, np.inf))))
    rows = slice(*np.searchsorted(grid.y, (south, np.nextafter(north, np.inf))))
    heights = grid.heights_m[rows, columns]
    row, column = np.nonzero(solid[rows, columns] & np.isfinite(heights))
    shapely.prepare(piece)
    own = shapely.intersects_xy(piece, grid.x[columns][column], grid.y[rows][row])
    return -float(heights[row[own], column[own]].max()) if own.any() else None


def _squares(solid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return solid[:-1, :-1] | solid[:-1, 1:] | solid[1:, :-1] | solid[1:, 1:]


def _shape(grid: Grid, solid: NDArray[np.bool_], less: NDArray[np.bool_] | None = None) -> BaseGeometry:
    """Return the squares between four middles of which one is ``solid``, and none ``less``, as one area."""
    square = _squares(solid) if less is None else _squares(solid) & ~_squares(less)
    padded = np.pad(square, 1)
    # an edge stands between two squares of which one is solid; each is a step of the grid, so they meet at its nodes
    row, column = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])
    upright = np.stack([np.stack([column, row], axis=1), np.stack([column, row + 1], axis=1)], axis=1)
    row, column = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    level = np.stack([np.stack([column, row], axis=1), np.stack([column + 1, row], axis=1)], axis=1)
    edges = np.concatenate([upright, level])
    if not len(edges):
        return shapely.Polygon()
    ends = np.stack([grid.x[edges[..., 0]], grid.y[edges[..., 1]]], axis=-1)
    return shapely.build_area(shapely.multilinestrings(shapely.linestrings(ends)))

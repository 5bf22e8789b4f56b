"""The bottom of a scenario from a real cell: a grid of heights between its soundings and contours.

``python -m bench.seabed CELL.000 MISSION.toml OUT.asc`` writes what the cell says of the water about a mission: a
triangulation of the soundings, of the edges of depth areas (at the least depth of the deeper side), of the shore, and
of places well inside an area and far from any sounding, which are midway between the depths that the area's attributes
tell; held between these. It is as true as a chart is, and no survey.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pyogrio
import shapely
from matplotlib.tri import LinearTriInterpolator, Triangulation
from numpy.typing import NDArray

from companion.geofence import load_mission

LAND_M = -1.0  # the depth of land: it dries by a metre
SPAN_M = 2300.0  # from the mission's origin
STEP_DEG = 0.0004  # 44 m of latitude
SIMPLER_DEG = 0.0001
INSIDE, EDGE_DEG, SOUNDED_DEG = 2, 0.0006, 0.0025  # every so many cells, 60 m from an edge, 250 m from a sounding
NODATA = -9999


Box = tuple[float, float, float, float]


def layer(cell: Path, name: str, box: Box) -> list[tuple[shapely.Geometry, dict[str, float]]]:
    """Return the shapes of a class within a box and the numbers said of each."""
    meta, _, shapes, columns = pyogrio.raw.read(
        cell, layer=name, bbox=box, SPLIT_MULTIPOINT="ON", ADD_SOUNDG_DEPTH="ON"
    )
    names = [str(field) for field in meta["fields"]]
    wanted = [field for field in names if field in {"DRVAL1", "DRVAL2", "DEPTH"}]
    return [
        (shapely.force_2d(shapely.from_wkb(shape)), {field: float(columns[names.index(field)][n]) for field in wanted})
        for n, shape in enumerate(shapes)
    ]


def heights(cell: Path, box: Box, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the heights at longitudes and latitudes, [len(y), len(x)], NaN where the cell says nothing."""
    known: list[NDArray[np.float64]] = []
    areas = [*layer(cell, "DEPARE", box), *layer(cell, "DRGARE", box)]
    for shape, told in sorted(areas, key=lambda a: a[1]["DRVAL1"]):  # the deeper side of an edge is kept: it comes last
        edge = shapely.get_coordinates(shapely.simplify(shapely.boundary(shape), SIMPLER_DEG))
        known.append(np.column_stack([edge, np.full(len(edge), told["DRVAL1"])]))
    for shape, _ in layer(cell, "LNDARE", box):
        edge = shapely.get_coordinates(shapely.simplify(shape, SIMPLER_DEG))
        known.append(np.column_stack([edge, np.full(len(edge), LAND_M)]))
    sounded = [(shape, told["DEPTH"]) for shape, told in layer(cell, "SOUNDG", box)]
    known += [np.array([[shape.x, shape.y, depth]]) for shape, depth in sounded]
    lattice = np.column_stack([axis.ravel() for axis in np.meshgrid(x[::INSIDE], y[::INSIDE])])
    near = shapely.buffer(shapely.multipoints([shape for shape, _ in sounded]), SOUNDED_DEG)
    lattice = lattice[~shapely.contains_xy(near, lattice[:, 0], lattice[:, 1])]
    for shape, told in areas:
        if np.isfinite(told.get("DRVAL2", np.nan)):
            here = lattice[shapely.contains_xy(shapely.buffer(shape, -EDGE_DEG), lattice[:, 0], lattice[:, 1])]
            known.append(np.column_stack([here, np.full(len(here), 0.5 * (told["DRVAL1"] + told["DRVAL2"]))]))
    points = np.vstack(known)
    last = {(round(px, 6), round(py, 6)): pz for px, py, pz in points.tolist()}
    at = np.array(list(last))
    between = LinearTriInterpolator(Triangulation(at[:, 0], at[:, 1]), np.array(list(last.values())))
    grid_x, grid_y = np.meshgrid(x, y)
    depth = np.full(grid_x.shape, np.nan)
    told_m = np.ma.filled(between(grid_x, grid_y), np.nan)
    for shape, told in areas:
        inside = shapely.contains_xy(shape, grid_x, grid_y)
        deepest = told.get("DRVAL2", np.nan)
        depth[inside] = np.clip(
            np.nan_to_num(told_m[inside], nan=told["DRVAL1"]),
            told["DRVAL1"],
            deepest if np.isfinite(deepest) else np.inf,
        )
    for shape, _ in layer(cell, "LNDARE", box):
        if shape.geom_type.endswith("Polygon"):
            depth[shapely.contains_xy(shape, grid_x, grid_y)] = LAND_M
    return -depth


def main() -> int:
    """Write the grid."""
    parser = argparse.ArgumentParser(prog="python -m bench.seabed", description=__doc__)
    parser.add_argument("cell", type=Path)
    parser.add_argument("mission", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args()
    here = load_mission(args.mission).origin
    tall = SPAN_M / 111_200.0
    wide = tall / float(np.cos(np.radians(here.lat_deg)))
    x = np.arange(here.lon_deg - wide, here.lon_deg + wide, STEP_DEG)
    y = np.arange(here.lat_deg - tall, here.lat_deg + tall, STEP_DEG)
    box = float(x[0]) - 0.01, float(y[0]) - 0.01, float(x[-1]) + 0.01, float(y[-1]) + 0.01
    found = heights(args.cell, box, x, y)
    head = (
        f"ncols {len(x)}\nnrows {len(y)}\nxllcenter {x[0]:.7f}\nyllcenter {y[0]:.7f}\n"
        f"cellsize {STEP_DEG}\nNODATA_value {NODATA}\n"
    )
    rows = [" ".join(f"{v:.1f}" if np.isfinite(v) else str(NODATA) for v in row) for row in found[::-1]]
    args.out.write_text(head + "\n".join(rows) + "\n", encoding="ascii")
    print(f"{args.out}: {len(x)} x {len(y)} heights, {100.0 * float(np.isfinite(found).mean()):.0f} % of them known")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Geometry at speed: many segments, points and distances against a coast in one call each, beside shapely's own.

python bench/geometry.py [--segments 100000] [--vertices 10000]
"""

import argparse
import math
import time

import numpy as np
import shapely
from shapely.geometry import Polygon

from companion.geo.segments import PolygonIndex


def coast(rng, islands, corners, extent_m):
    """Irregular islands of ``corners`` corners in a square of ±extent."""
    out = []
    for _ in range(islands):
        middle = rng.uniform(-extent_m, extent_m, 2)
        turns = 2.0 * math.pi * (np.arange(corners) + rng.uniform(0.0, 0.8)) / corners
        radii = rng.uniform(0.02, 0.12) * extent_m * rng.uniform(0.5, 1.0, corners)
        out.append(Polygon(middle + radii[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])).buffer(0))
    return out


def best_ms(call, repeats=5):
    """Return the shortest time of a call [ms] and its last answer."""
    took = []
    for _ in range(repeats):
        began = time.perf_counter()
        answer = call()
        took.append(1e3 * (time.perf_counter() - began))
    return min(took), answer


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=100_000)
    parser.add_argument("--vertices", type=int, default=10_000)
    args = parser.parse_args()
    rng = np.random.default_rng(1)
    extent_m = 5000.0
    polygons = coast(rng, 40, args.vertices // 40, extent_m)
    began = time.perf_counter()
    index = PolygonIndex(polygons)
    print(
        f"{index.edge_count} edges, {len(polygons)} islands, {2 * extent_m / 1000:g} km square; "
        f"index built in {1e3 * (time.perf_counter() - began):.0f} ms (compilation included)"
    )
    union = shapely.union_all(polygons)
    shapely.prepare(union)
    index.intersects(np.zeros((1, 4)))
    index.distance_m(np.zeros((1, 2)))
    index.contains(np.zeros((1, 2)))
    print(f"{'':34}{'this [ms]':>10}{'shapely [ms]':>14}  differ")
    for mean_m in (50.0, 200.0, 1000.0, 5000.0):
        start = rng.uniform(-extent_m, extent_m, (args.segments, 2))
        segments = np.hstack([start, start + rng.normal(0.0, mean_m, (args.segments, 2))])
        ours_ms, ours = best_ms(lambda s=segments: index.intersects(s))
        theirs_ms, theirs = best_ms(
            lambda s=segments: shapely.intersects(union, shapely.linestrings(s.reshape(-1, 2, 2))), repeats=1
        )
        print(
            f"{args.segments} segments of ~{1.25 * mean_m:5.0f} m       {ours_ms:10.1f}{theirs_ms:14.1f}  "
            f"{int((ours != theirs).sum())}"
        )
    points = rng.uniform(-extent_m, extent_m, (args.segments, 2))
    ours_ms, ours = best_ms(lambda: index.contains(points))
    theirs_ms, theirs = best_ms(lambda: shapely.contains_xy(union, points[:, 0], points[:, 1]), repeats=1)
    print(f"{args.segments} points inside?             {ours_ms:10.1f}{theirs_ms:14.1f}  {int((ours != theirs).sum())}")
    few = points[:2000]
    ours_ms, ours = best_ms(lambda: index.distance_m(few))
    theirs_ms, theirs = best_ms(lambda: shapely.distance(union.boundary, shapely.points(few)), repeats=1)
    print(
        f"2000 distances                      {ours_ms:8.1f}{theirs_ms:14.1f}  "
        f"{float(np.abs(np.abs(ours) - theirs).max()):.1e} m"
    )


if __name__ == "__main__":
    main()

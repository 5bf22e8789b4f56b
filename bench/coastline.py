"""A coastline of a million vertices made into an area: how long it takes, how much memory, how much is left of it.

``python -m bench.coastline [--vertices 1000000] [--format gpkg|shp]`` writes islands with shores of noise into a file
of that format, and imports it as ``companion chart import`` does, in a process of its own: 60 s of a core and 1 GB are
asked.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyogrio
import shapely

LAT_DEG, LON_DEG = 58.0, 11.0  # of skerries
REACH_M = 20_000.0
ISLANDS = 200
MOST_S, MOST_MB = 60.0, 1024.0
SEED = 1


def islands(vertices: int) -> list[shapely.Polygon]:
    """Return islands on a lattice within reach, their shores a sum of waves down to the length of a vertex."""
    rng = np.random.default_rng(SEED)
    each = vertices // ISLANDS
    turns = 2.0 * np.pi * np.arange(each) / each
    side = int(np.ceil(np.sqrt(ISLANDS)))
    pitch_m = 2.0 * 0.7 * REACH_M / side
    out = []
    for n in range(ISLANDS):
        middle = (np.array([n % side, n // side]) + 0.5 - 0.5 * side) * pitch_m
        radii = np.full(each, 0.3 * pitch_m)
        for octave in range(3, 12):
            radii += (
                0.12 * pitch_m / 2.0 ** (0.8 * (octave - 2)) * np.sin(2**octave / 4 * turns + rng.uniform(0, 2 * np.pi))
            )
        en = middle + radii[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
        scale = np.array([111_320.0 * np.cos(np.radians(LAT_DEG)), 111_200.0])
        out.append(shapely.Polygon(np.array([LON_DEG, LAT_DEG]) + en / scale))
    return out


def imported(path: Path) -> None:
    """Import the file and tell what it took: time of a core, memory at most, what came of it."""
    from companion.chart import Wanted, area_of, box_about, read_chart
    from companion.messages import GeoPoint

    center = GeoPoint(lat_deg=LAT_DEG, lon_deg=LON_DEG)
    began_s, wall_s = time.process_time(), time.perf_counter()
    chart = read_chart(path, box_about(center, REACH_M), Wanted(safety_depth_m=1.4))
    read_s = time.process_time() - began_s
    area = area_of([chart], center, REACH_M)
    size = len(area.obstacles_json())
    took_s = time.process_time() - began_s
    most_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(
        f"{path.suffix[1:]}: {took_s:.1f} s of a core ({read_s:.1f} s of it to read; "
        f"{time.perf_counter() - wall_s:.1f} s by the clock), {most_mb:.0f} MB at most; "
        f"{len(area.solids)} obstacles of {area.positions()} positions, {size / 1e6:.1f} MB of GeoJSON"
    )
    fits = took_s <= MOST_S and most_mb <= MOST_MB
    print(f"{'within' if fits else 'NOT within'} {MOST_S:.0f} s and {MOST_MB:.0f} MB")
    sys.exit(0 if fits else 1)


def main() -> int:
    """Write, import, and return 1 where that takes too much."""
    parser = argparse.ArgumentParser(prog="python -m bench.coastline", description=__doc__)
    parser.add_argument("--vertices", type=int, default=1_000_000)
    parser.add_argument("--format", choices=("gpkg", "shp"), default="gpkg")
    parser.add_argument("--import", dest="path", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.path is not None:
        imported(args.path)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"coast.{args.format}"
        shapes = islands(args.vertices)
        corners = int(shapely.get_num_coordinates(np.array(shapes)).sum())
        pyogrio.raw.write(
            path,
            geometry=shapely.to_wkb(np.array(shapes)),
            field_data=[],
            fields=[],
            geometry_type="Polygon",
            crs="EPSG:4326",
        )
        size = sum(part.stat().st_size for part in Path(folder).iterdir())
        print(
            f"{corners} vertices of {len(shapes)} islands within {REACH_M / 1000.0:.0f} km, {size / 1e6:.1f} MB",
            flush=True,
        )
        command = [sys.executable, "-m", "bench.coastline", "--import", str(path)]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())

"""Reading files grows with their size and no faster: ``python -m bench.reading``.

    python -m bench.reading                          10,000 to 500,000 points, every format, every way to fill it
    python -m bench.reading --points 10000 40000     a minute
    python -m bench.reading --formats wkt kml

Each cell is the better of two readings of a file by ``companion.geofence.read`` in a process of its own: time, and
how far the process's memory rose above what it held before. The last columns say what a point costs in the largest
file, and the power of the size that the time grew with from the file before it: 1 is in proportion. Where a format
writes more bytes a point than the limit of a file allows, the largest is smaller. The table is that of
docs/reference/formats.md.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from companion.geofence import read
from companion.geofence.formats import MAX_BYTES, MAX_POSITIONS

POINTS = (10_000, 50_000, 100_000, 500_000)
ORIGIN = (-1.31, 50.81)  # longitude, latitude
MOST = {"waypoints": 65_000}  # rows are numbered in 16 bits

LonLat = tuple[float, float]


def coast(n: int) -> list[LonLat]:
    """Return n positions of a closed ring that does not cross itself: a wavy coast, the first repeated last."""
    out = []
    for k in range(n - 1):
        turn = 2.0 * math.pi * k / (n - 1)
        reach = 0.05 * (1.0 + 0.2 * math.sin(40.0 * turn))
        out.append((round(ORIGIN[0] + reach * math.cos(turn), 7), round(ORIGIN[1] + reach * math.sin(turn), 7)))
    return [*out, out[0]]


def crossing(n: int) -> list[LonLat]:
    """Return a coast whose ends were drawn across each other."""
    ring = coast(n)
    ring[n // 3], ring[n // 3 + 1] = ring[n // 3 + 1], ring[n // 3]
    return ring


def tangle(n: int) -> list[LonLat]:
    """Return a ring whose every edge crosses nearly every other: a star with as many points as vertices."""
    odd = n - 1 - n % 2
    turns = [2.0 * math.pi * (k * (odd // 2) % odd) / odd for k in range(odd)]
    ring = [(round(ORIGIN[0] + 0.05 * math.cos(t), 7), round(ORIGIN[1] + 0.05 * math.sin(t), 7)) for t in turns]
    return [*ring, ring[0]]


def rocks(n: int) -> list[list[LonLat]]:
    """Return n positions as closed squares that do not touch each other."""
    columns = math.ceil(math.sqrt(n / 5))
    side = 0.1 / columns
    out = []
    for k in range(n // 5):
        x, y = ORIGIN[0] + side * (k % columns), ORIGIN[1] + side * (k // columns)
        corners = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0)]
        out.append([(round(x + a * side, 7), round(y + b * side, 7)) for a, b in corners])
    return out


def places(n: int) -> list[LonLat]:
    """Return n positions, no two the same."""
    return [corner for k, rock in enumerate(rocks(5 * n)) for corner in rock[:1] if k < n]


# ------------------------------------------------------------------------------------------ formats
def _pairs(ring: list[LonLat], between: str, after: str) -> str:
    return after.join(f"{x}{between}{y}" for x, y in ring)


def _swapped(ring: list[LonLat]) -> str:
    return "\n".join(f"{y} {x}" for x, y in ring)


def _geojson(features: list[tuple[str, object]], *, indent: int | None = None) -> str:
    return json.dumps(
        {
            "type": "FeatureCollection",
            "features": [
                {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": shape}}
                for kind, shape in features
            ],
        },
        indent=indent,
    )


def _plan(polygons: list[list[LonLat]], items: list[LonLat]) -> str:
    return json.dumps(
        {
            "fileType": "Plan",
            "geoFence": {
                "circles": [],
                "polygons": [{"inclusion": False, "polygon": [[y, x] for x, y in ring[:-1]]} for ring in polygons],
            },
            "mission": {
                "items": [{"type": "SimpleItem", "command": 16, "params": [0, 0, 0, 0, y, x, 0]} for x, y in items]
            },
        }
    )


def _waypoints(rows: list[tuple[int, int, LonLat]]) -> str:
    lines = [f"{n}\t0\t3\t{command}\t{p1}\t0\t0\t0\t{at[1]}\t{at[0]}\t0\t1" for n, (command, p1, at) in enumerate(rows)]
    return "\n".join(["QGC WPL 110", *lines])


def _gpx(body: str) -> str:
    return f'<gpx version="1.1" creator="b" xmlns="http://www.topografix.com/GPX/1/1">{body}</gpx>'


def _gpx_points(tag: str, ring: list[LonLat]) -> str:
    return "\n".join(f'<{tag} lat="{y}" lon="{x}"/>' for x, y in ring)


def _kml(shapes: list[str]) -> str:
    body = "\n".join(f"<Placemark>{shape}</Placemark>" for shape in shapes)
    return f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{body}</Document></kml>'


def _kml_polygon(ring: list[LonLat]) -> str:
    return (
        "<Polygon><outerBoundaryIs><LinearRing><coordinates>"
        + _pairs(ring, ",", "\n")
        + "</coordinates></LinearRing></outerBoundaryIs></Polygon>"
    )


def _name(rings: list[list[LonLat]]) -> str:
    return "\n".join(f"Name: rock {n}\n{_swapped(ring)}" for n, ring in enumerate(rings))


# What fills a file: format -> way -> n points -> text. Each way is one that a loop over a loop would hide in.
FILES: dict[str, dict[str, Callable[[int], str]]] = {
    "wkt": {
        "a coast, a vertex a line": lambda n: f"POLYGON ((\n{_pairs(coast(n), ' ', chr(44) + chr(10))}))\n",
        "a coast on one line": lambda n: f"POLYGON (({_pairs(coast(n), ' ', ', ')}))\n",
        "rocks, one a line": lambda n: "\n".join(f"POLYGON (({_pairs(r, ' ', ', ')}))" for r in rocks(n)),
        "rocks in a collection, with heights": lambda n: (
            "GEOMETRYCOLLECTION (" + ",\n".join(f"POLYGON Z (({_pairs(r, ' ', ' 0, ')} 0))" for r in rocks(n)) + ")"
        ),
        "rocks with unclosed rings": lambda n: "\n".join(f"POLYGON (({_pairs(r[:-1], ' ', ', ')}))" for r in rocks(n)),
        "a coast that crosses itself": lambda n: f"POLYGON (({_pairs(crossing(n), ' ', ', ')}))",
        "a tangle": lambda n: f"POLYGON (({_pairs(tangle(n), ' ', ', ')}))",
        "points": lambda n: f"MULTIPOINT (({_pairs(places(n), ' ', '), (')}))",
    },
    "geojson": {
        "a coast": lambda n: _geojson([("Polygon", [coast(n)])]),
        "a coast, a number a line": lambda n: _geojson([("Polygon", [coast(n)])], indent=0),
        "rocks": lambda n: _geojson([("Polygon", [r]) for r in rocks(n)]),
        "rocks in one feature": lambda n: _geojson([("MultiPolygon", [[r] for r in rocks(n)])]),
        "points": lambda n: _geojson([("MultiPoint", places(n))]),
    },
    "plan": {
        "a coast": lambda n: _plan([coast(n)], []),
        "rocks": lambda n: _plan(rocks(n), []),
        "waypoints": lambda n: _plan([], places(n)),
    },
    "waypoints": {
        "waypoints": lambda n: _waypoints([(16, 0, p) for p in places(n)]),
        "a coast": lambda n: _waypoints([(5002, n - 1, p) for p in coast(n)[:-1]]),
        "rocks": lambda n: _waypoints([(5002, 4, p) for r in rocks(n) for p in r[:-1]]),
        "fence vertices without a ring": lambda n: _waypoints([(5001 + k % 2, n, p) for k, p in enumerate(places(n))]),
    },
    "fen": {"a coast": lambda n: "# a\n" + _swapped([ORIGIN, *coast(n - 1)])},
    "poly": {"a coast": lambda n: _swapped(coast(n)), "rocks": lambda n: _name(rocks(n))},
    "gpx": {
        "a route": lambda n: _gpx(f"<rte>{_gpx_points('rtept', coast(n))}</rte>"),
        "a track": lambda n: _gpx(f"<trk><trkseg>{_gpx_points('trkpt', coast(n))}</trkseg></trk>"),
        "routes": lambda n: _gpx(
            "".join(f"<rte><type>exclusion</type>{_gpx_points('rtept', r)}</rte>" for r in rocks(n))
        ),
        "waypoints": lambda n: _gpx(_gpx_points("wpt", places(n))),
    },
    "kml": {
        "a coast": lambda n: _kml([_kml_polygon(coast(n))]),
        "rocks": lambda n: _kml([_kml_polygon(r) for r in rocks(n)]),
        "rocks in one placemark": lambda n: _kml(
            ["<MultiGeometry>" + "".join(_kml_polygon(r) for r in rocks(n)) + "</MultiGeometry>"]
        ),
        "points": lambda n: _kml([f"<Point><coordinates>{x},{y}</coordinates></Point>" for x, y in places(n)]),
    },
}


# ---------------------------------------------------------------------------------------- measuring
def _status(key: str) -> int:
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(key):
            return int(line.split()[1]) * 1024
    return 0


def _measured(path: str, sink: multiprocessing.SimpleQueue) -> None:
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the high-water mark begins again
    held = _status("VmRSS")
    began = time.process_time()
    document = read(path)
    took = time.process_time() - began
    assert not document.is_empty or document.findings
    sink.put((took, _status("VmHWM") - held))


def measure(path: Path) -> tuple[float, int]:
    """Return processor seconds and bytes that reading the file takes, in a process of its own."""
    context = multiprocessing.get_context("fork")
    best = (math.inf, 0)
    for _ in range(2):
        sink = context.SimpleQueue()
        child = context.Process(target=_measured, args=(str(path), sink))
        child.start()
        child.join()
        if child.exitcode != 0:
            raise RuntimeError(f"{path}: reading ended with {child.exitcode}")
        best = min(best, sink.get())
    return best


def largest(name: str, make: Callable[[int], str], n: int) -> int:
    """Return how many of n points fit into a file of the largest size."""
    n = min(n, MOST.get(name, MAX_POSITIONS))
    while (size := len(make(n))) > MAX_BYTES:
        n = int(0.99 * n * MAX_BYTES / size) // 1000 * 1000
    return n


def power(first: tuple[int, float], last: tuple[int, float]) -> float:
    """Return the power of the size that the time grows with between two (points, seconds)."""
    return math.log(last[1] / first[1]) / math.log(last[0] / first[0])


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, nargs="+", default=POINTS)
    parser.add_argument("--formats", nargs="+", choices=sorted(FILES), default=list(FILES))
    args = parser.parse_args(argv)
    heads = [f"{n:,}" for n in args.points]
    print(f"| format | filled with | {' [s] | '.join(heads)} [s] | µs a point | bytes a point | power |")
    print("|---|---|" + "---|" * (len(heads) + 3))
    with tempfile.TemporaryDirectory() as folder:
        for name in args.formats:
            for way, make in FILES[name].items():
                cells: list[str] = []
                figures: list[tuple[int, float]] = []
                bytes_each = 0.0
                for wanted in args.points:
                    n = largest(name, make, wanted)
                    if figures and n == figures[-1][0]:
                        cells.append("")
                        continue
                    path = Path(folder, f"file.{name}")
                    path.write_text(make(n), encoding="utf-8")
                    took, rose = measure(path)
                    figures.append((n, took))
                    bytes_each = rose / n
                    cells.append(f"{took:.2f}" + (f" ({n:,})" if n != wanted else ""))
                grew = f"{power(figures[-2], figures[-1]):.2f}" if len(figures) > 1 else ""
                print(
                    f"| {name} | {way} | "
                    + " | ".join(cells)
                    + f" | {1e6 * figures[-1][1] / figures[-1][0]:.1f} | {bytes_each:.0f} | {grew} |",
                    flush=True,
                )
    print(f"\nPython {sys.version.split()[0]}, {os.cpu_count()} cores; processor seconds, the better of two")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Charts to lay under the page: tiles that a formula paints, in MBTiles written here and PMTiles by its own library."""

import contextlib
import math
import sqlite3
import struct
import zlib

import numpy as np

PIXELS = 128
BOUNDS = (-1.90, 50.60, -1.70, 50.80)


def png(pixels):
    """Return an image (rows, columns, 3) of bytes as PNG."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows, columns, _ = pixels.shape
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(raw))
        + chunk(b"IEND", b"")
    )


def tile_of(lat_deg, lon_deg, z):
    """Return column and row, from the north, of the tile that a place lies in."""
    x, y = _share(lat_deg, lon_deg, z)
    return int(x), int(y)


def share_in_tile(lat_deg, lon_deg, z):
    """Return where in its tile a place lies, from west and from north, 0 to 1."""
    x, y = _share(lat_deg, lon_deg, z)
    return x % 1.0, y % 1.0


def _share(lat_deg, lon_deg, z):
    y = (1.0 - math.asinh(math.tan(math.radians(lat_deg))) / math.pi) / 2.0
    return (lon_deg + 180.0) / 360.0 * (1 << z), y * (1 << z)


def painted(z, x, y):
    """Return a tile: depths in steps, as charts have them, with its own edge drawn."""
    n = 1 << z
    step = (np.arange(PIXELS) + 0.5) / PIXELS
    lon = (x + step) / n * 360.0 - 180.0
    lat = np.degrees(np.arctan(np.sinh(math.pi * (1.0 - 2.0 * (y + step) / n))))
    east, north = np.meshgrid(lon * 1000.0, lat * 1500.0)
    depth = np.sin(east / 3.0) + np.sin(north / 4.0 + east / 7.0)
    bands = np.array([(244, 226, 170), (178, 220, 190), (168, 205, 232), (206, 228, 244), (250, 253, 255)], np.uint8)
    image = bands[np.digitize(depth, [-1.2, -0.9, -0.2, 0.6])]
    image[0] = image[:, 0] = 120
    return png(image)


def mbtiles(path, bounds=BOUNDS, zooms=range(10, 16), tile=painted, **said):
    """Write an MBTiles file."""
    west, south, east, north = bounds
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE metadata (name text, value text)")
        base.execute("CREATE TABLE tiles (zoom_level integer, tile_column integer, tile_row integer, tile_data blob)")
        base.execute("CREATE UNIQUE INDEX tile_index ON tiles (zoom_level, tile_column, tile_row)")
        rows = {
            "name": "Painted depths",
            "format": "png",
            "bounds": ",".join(map(str, bounds)),
            "minzoom": str(min(zooms, default=0)),
            "maxzoom": str(max(zooms, default=0)),
            "attribution": '<a href="https://example.org">&copy; nobody</a>',
            **said,
        }
        base.executemany("INSERT INTO metadata VALUES (?, ?)", [(k, v) for k, v in rows.items() if v is not None])
        for z in zooms:
            (left, top), (right, bottom) = tile_of(north, west, z), tile_of(south, east, z)
            base.executemany(
                "INSERT INTO tiles VALUES (?, ?, ?, ?)",
                [
                    (z, x, (1 << z) - 1 - y, tile(z, x, y))
                    for x in range(left, right + 1)
                    for y in range(top, bottom + 1)
                ],
            )
    base.close()
    return path


def pmtiles(path, source):
    """Turn an MBTiles file into a PMTiles file, by the library's own writer."""
    from pmtiles.convert import mbtiles_to_header_json
    from pmtiles.tile import zxy_to_tileid
    from pmtiles.writer import Writer

    with contextlib.closing(sqlite3.connect(source)) as base, path.open("wb") as file:
        writer = Writer(file)
        rows = base.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles").fetchall()
        tiles = {zxy_to_tileid(z, x, (1 << z) - 1 - y): data for z, x, y, data in rows}
        for number in sorted(tiles):
            writer.write_tile(number, tiles[number])
        header, said = mbtiles_to_header_json(dict(base.execute("SELECT name, value FROM metadata")))
        writer.finalize(header, said)
    return path

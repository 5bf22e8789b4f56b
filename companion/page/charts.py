"""Charts of the user's under the own water: raster tiles from MBTiles or PMTiles files, on Web Mercator.

MBTiles 1.3: a SQLite file, its rows counted from the south. PMTiles 3: one file with directories of its tiles.
"""

from __future__ import annotations

import contextlib
import functools
import gzip
import hashlib
import os
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from companion.disk import open_regular
from companion.errors import InputError, unreadable

MOST_ZOOM = 24
MOST_TILE = 2_000_000  # bytes
MOST_METADATA = 1_000_000  # bytes
_KEPT = 64  # directories of a PMTiles file that are kept unpacked
_RASTER = "png, jpg, jpeg or webp"
_CONVERT = "convert it ashore: gdal_translate -of MBTILES CHART OUT.mbtiles, then gdaladdo OUT.mbtiles 2 4 8 16"
# One clear pixel: a tile that is not in the file is no error in a browser.
NO_TILE = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000b4944415478da6360000200"
    "00050001e9fadcd80000000049454e44ae426082"
)


class Tiles(Protocol):
    """What reads the tiles of one file. Threads may call it."""

    def get(self, z: int, x: int, y: int) -> bytes | None:
        """Return a tile, rows counted from the north; None: it is not there. May raise anything for a broken file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TileChart:
    """A file of tiles. ``bounds_deg``: west, south, east, north; ``tag`` is another one when the file is."""

    name: str
    credit: str
    bounds_deg: tuple[float, float, float, float]
    least_zoom: int
    most_zoom: int
    tag: str
    tiles: Tiles

    def facts(self) -> dict[str, Any]:
        """Return what a page has to know of it."""
        return {
            "name": self.name,
            "credit": self.credit,
            "bounds_deg": self.bounds_deg,
            "least_zoom": self.least_zoom,
            "most_zoom": self.most_zoom,
            "tag": self.tag,
        }

    def tile(self, z: int, x: int, y: int) -> tuple[str, bytes]:
        """Return the kind and the content of a tile; what cannot be read or is no picture is clear."""
        if not (0 <= z <= MOST_ZOOM and 0 <= x < 1 << z and 0 <= y < 1 << z):
            return "image/png", NO_TILE
        try:
            data = self.tiles.get(z, x, y) or b""
        except Exception:  # a card that fails, a file that is cut short: the water is shown without it
            data = b""
        kind = picture_of(data) if len(data) <= MOST_TILE else ""
        return (kind, data) if kind else ("image/png", NO_TILE)


def picture_of(data: bytes) -> str:
    """Return the media type of a picture by how it begins, empty for anything else.

    >>> picture_of(NO_TILE), picture_of(b"<svg onload=...>")
    ('image/png', '')
    """
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "image/png"
    if data.startswith(b"\xff\xd8\xff"):
        return "image/jpeg"
    return "image/webp" if data[:4] == b"RIFF" and data[8:12] == b"WEBP" else ""


def open_charts(paths: Sequence[Path]) -> tuple[TileChart, ...]:
    """Open charts, the lowest first. Raises InputError: a file is not a chart, or cannot be read."""
    return tuple(open_chart(path) for path in paths)


def is_tiles(path: Path) -> bool:
    """Return whether a file is called as tiles are; what is in it is another question."""
    return path.suffix.lower() in {".mbtiles", ".pmtiles"}


def open_chart(path: Path) -> TileChart:
    """Open a chart. Raises InputError: it is not a chart, cannot be read, or has no pictures in it."""
    try:
        with open_regular(path) as file:
            head = file.read(16)
        stat = path.stat()
    except OSError as error:
        raise unreadable(str(path), error, "the chart") from error
    tag = hashlib.sha256(f"{path.resolve()} {stat.st_size} {stat.st_mtime_ns}".encode()).hexdigest()[:12]
    try:
        if head.startswith(b"SQLite format 3\0"):
            return _mbtiles(path, tag)
        if head.startswith(b"PMTiles\x03"):
            return _pmtiles(path, tag)
    except InputError:
        raise
    except Exception as error:  # of sqlite3, of the library, of whatever such a file makes of them
        raise InputError(str(path), "", f"is a broken chart ({_words(error)})", "copy it again") from error
    raise InputError(str(path), "", "is no chart: neither MBTiles nor PMTiles 3", _CONVERT)


def _words(error: Exception) -> str:
    return " ".join(str(error).split())[:100] or type(error).__name__


class Mbtiles:
    """The tiles of an MBTiles file."""

    def __init__(self, path: Path) -> None:
        # immutable: no journal is looked for, so that a read-only card will do
        self._uri = f"{path.resolve().as_uri()}?mode=ro&immutable=1"

    def ask(self, sql: str, *values: object) -> list[tuple[Any, ...]]:
        """Return the rows of a question, by a connection of its own: it is another thread's each time."""
        import sqlite3

        with contextlib.closing(sqlite3.connect(self._uri, uri=True)) as connection:
            return connection.execute(sql, values).fetchall()

    def get(self, z: int, x: int, y: int) -> bytes | None:
        """Return a tile."""
        rows = self.ask(
            "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ? LIMIT 1",
            z,
            x,
            (1 << z) - 1 - y,
        )
        return bytes(rows[0][0]) if rows and rows[0][0] else None


def _mbtiles(path: Path, tag: str) -> TileChart:
    import sqlite3

    tiles = Mbtiles(path)
    try:
        said = {str(name): str(value) for name, value in tiles.ask("SELECT name, value FROM metadata")}
        ((least, most),) = tiles.ask("SELECT min(zoom_level), max(zoom_level) FROM tiles")
    except sqlite3.OperationalError as error:
        raise InputError(str(path), "", f"is no chart: SQLite, but no MBTiles ({_words(error)})", _CONVERT) from error
    if least is None:
        raise InputError(str(path), "", "is a chart without tiles", "make it again")
    _require_raster(path, said.get("format", "png"))
    bounds = said.get("bounds", "").split(",")
    return _chart(
        path,
        tag,
        tiles,
        name=said.get("name"),
        credit=said.get("attribution"),
        bounds=[float(b) for b in bounds] if len(bounds) == 4 else None,
        zooms=(int(least), int(most)),
    )


class Pmtiles:
    """The tiles of a PMTiles file; its directories are kept unpacked, for the library would unpack them each time."""

    def __init__(self, path: Path) -> None:
        from pmtiles.tile import deserialize_directory, deserialize_header

        # Read, not mapped: of a map of a file that is cut short meanwhile the process dies (SIGBUS), and the voyage.
        with open_regular(path) as file:
            self._file = os.dup(file.fileno())
        weakref.finalize(self, os.close, self._file)
        self.header = deserialize_header(self._bytes(0, 127))
        self._directory = functools.lru_cache(_KEPT)(
            lambda offset, length: deserialize_directory(self._bytes(offset, length))
        )
        self._directory(self.header["root_offset"], self.header["root_length"])  # a broken one is refused at once

    def _bytes(self, offset: int, length: int) -> bytes:
        return os.pread(self._file, min(length, MOST_TILE + 1), offset)  # nothing of it is longer

    def get(self, z: int, x: int, y: int) -> bytes | None:
        """Return a tile."""
        from pmtiles.tile import find_tile, zxy_to_tileid

        number = zxy_to_tileid(z, x, y)
        offset, length = self.header["root_offset"], self.header["root_length"]
        for _ in range(4):  # directories are nested no deeper
            entry = find_tile(self._directory(offset, length), number)
            if entry is None:
                return None
            if entry.run_length > 0:
                return self._bytes(self.header["tile_data_offset"] + entry.offset, entry.length)
            offset, length = self.header["leaf_directory_offset"] + entry.offset, entry.length
        return None

    def metadata(self) -> dict[str, Any]:
        """Return what the file says of itself."""
        import msgspec

        raw = self._bytes(self.header["metadata_offset"], min(self.header["metadata_length"], MOST_METADATA))
        said = msgspec.json.decode(gzip.decompress(raw) if raw.startswith(b"\x1f\x8b") else raw or b"{}")
        return said if isinstance(said, dict) else {}


def _pmtiles(path: Path, tag: str) -> TileChart:
    tiles = Pmtiles(path)
    header = tiles.header
    _require_raster(path, header["tile_type"].name.lower())
    if header["tile_compression"].name not in {"NONE", "UNKNOWN"}:
        raise InputError(str(path), "", "holds packed pictures, which no browser unpacks", "make it again without")
    said = tiles.metadata()
    corners = header["min_lon_e7"], header["min_lat_e7"], header["max_lon_e7"], header["max_lat_e7"]
    return _chart(
        path,
        tag,
        tiles,
        name=said.get("name"),
        credit=said.get("attribution"),
        bounds=[corner / 1e7 for corner in corners],
        zooms=(header["min_zoom"], header["max_zoom"]),
    )


def _require_raster(path: Path, kind: str) -> None:
    if kind.lower() in {"pbf", "mvt", "mlt"}:
        raise InputError(
            str(path),
            "",
            "holds vector tiles, which are not drawn here",
            f"take a raster chart: tiles that are {_RASTER}",
        )
    if kind.lower() not in {"png", "jpg", "jpeg", "webp", "image/png", "image/jpeg", "image/webp"}:
        raise InputError(
            str(path),
            "",
            f"holds tiles of a kind that is not known ({kind[:20]!r})",
            f"take a chart whose tiles are {_RASTER}",
        )


def _chart(
    path: Path, tag: str, tiles: Tiles, *, name: Any, credit: Any, bounds: list[float] | None, zooms: tuple[int, int]
) -> TileChart:
    """Return a chart; where a file does not say its bounds, or says what cannot be, it is looked for everywhere."""
    west, south, east, north = bounds or (-180.0, -90.0, 180.0, 90.0)
    if not (-180.0 <= west < east <= 180.0 and -90.0 <= south < north <= 90.0):
        west, south, east, north = -180.0, -90.0, 180.0, 90.0
    return TileChart(
        name=str(name or path.stem)[:80],
        credit=_plain(str(credit or ""))[:200],
        tag=tag,
        tiles=tiles,
        bounds_deg=(west, south, east, north),
        least_zoom=max(0, min(zooms)),
        most_zoom=min(MOST_ZOOM, max(zooms)),
    )


def _plain(text: str) -> str:
    """Return a credit without its markup.

    >>> _plain('<a href="https://x.org">&copy; OpenSeaMap</a>')
    '© OpenSeaMap'
    """
    import html
    import re

    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", text)).split())

"""Metres east and north of the boat's home, or of where she was last far from it, and the wire's degrees x 1e7."""

from __future__ import annotations

from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.messages import GeoPoint

_CACHE, _TOLD = 4096, 64


class Chart:
    """One frame for the hull, the mission and the fence; what was converted once is remembered."""

    def __init__(self, home: GeoPoint) -> None:
        self._frame = LocalFrame(home)
        self._seen: dict[tuple[int, int], tuple[float, float]] = {}
        self._told: dict[tuple[float, float], tuple[int, int]] = {}

    def follow(self, en: tuple[float, float]) -> Shift:
        """Let the metres count from a place from now on; return how those of before become those."""
        shift = Shift(self._frame, LocalFrame(self._frame.geo_from_en(*en)))
        self._frame = shift.after
        self._seen.clear()
        self._told.clear()
        return shift

    def point(self, en: tuple[float, float]) -> GeoPoint:
        """Return a position in metres as a GeoPoint."""
        return self._frame.geo_from_en(*en)

    def to_e7(self, en: tuple[float, float]) -> tuple[int, int]:
        """Return (lat, lon) x 1e7 of a position in metres."""
        found = self._told.get(en)
        if found is None:   # several messages of one loop tell one place, and home or a destination is told for long
            if len(self._told) >= _TOLD:
                self._told.clear()
            point = self._frame.geo_from_en(*en)
            found = self._told[en] = round(point.lat_deg * 1e7), round(point.lon_deg * 1e7)
        return found

    def to_en(self, lat_e7: int, lon_e7: int) -> tuple[float, float]:
        """Return (east, north) [m]; what is not on the globe is brought to its edge."""
        key = (max(-900_000_000, min(900_000_000, lat_e7)), max(-1_800_000_000, min(1_800_000_000, lon_e7)))
        found = self._seen.get(key)
        if found is None:
            if len(self._seen) >= _CACHE:
                self._seen.clear()
            point = GeoPoint(lat_deg=key[0] / 1e7, lon_deg=key[1] / 1e7)
            found = self._seen[key] = self._frame.en_from_geo(point)
        return found

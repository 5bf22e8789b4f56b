"""The area of a voyage for whoever draws it: sent once, and known by its hash."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import msgspec
import shapely
from shapely.geometry import Polygon

from companion.current import closed_spans
from companion.messages import GeoPoint
from companion.skipper import Voyage
from companion.view.values import PointEn, metres, rounded

if TYPE_CHECKING:
    from companion.current import TideTable
    from companion.geo.frame import LocalFrame

SIMPLER_M = 0.25  # a coast is drawn to this; nothing is decided by the picture
HASH_DIGITS = 16

Ring = tuple[PointEn, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class DryingView:
    """Water that dries: polygons as an obstacle's, and when it is solid.

    ``solid_unix_s``: spans of Unix time [s] in order; where an end is None it has none.
    """

    name: str
    shapes: tuple[tuple[Ring, ...], ...]
    solid_unix_s: tuple[tuple[float | None, float | None], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaView:
    """Obstacles as drawn, as grown by the margin, and the limits: polygons, each an outer ring and its holes.

    Metres east and north of ``origin_lat_deg`` and ``origin_lon_deg``; ``lat_m`` and ``lon_m`` are the metres in a
    degree there. ``names`` are the obstacles', one each: of the mission's file, else "obstacle N". ``drying`` is
    solid at its hours. ``hash`` names the content.
    """

    hash: str = ""
    name: str
    origin_lat_deg: float
    origin_lon_deg: float
    lat_m: float
    lon_m: float
    obstacles: tuple[tuple[Ring, ...], ...] = ()
    names: tuple[str, ...] = ()
    grown: tuple[tuple[Ring, ...], ...] = ()
    limits: tuple[tuple[Ring, ...], ...] = ()
    drying: tuple[DryingView, ...] = ()
    margin_m: float | None = None

    @property
    def frame(self) -> LocalFrame:
        """The frame of its metres."""
        from companion.geo.frame import LocalFrame

        return LocalFrame(GeoPoint(lat_deg=self.origin_lat_deg, lon_deg=self.origin_lon_deg))


def area_of(voyage: Voyage, margin_m: float, tide: TideTable | None = None) -> AreaView:
    """Return the area of a voyage; ``tide``: the heights by which its drying water is open."""
    fence = voyage.area.fence_wkt(0.0)
    return drawn(
        voyage.name,
        voyage.frame.origin,
        voyage.area.obstacles_wkt(0.0),
        voyage.area.obstacles_wkt(margin_m),
        [] if fence is None else [fence],
        margin_m,
        voyage.area.obstacle_names(0.0),
        [(w.name, w.polygon.wkt, closed_spans(tide, w.opens_at_m)) for w in voyage.drying],
    )


def drawn(
    name: str,
    origin: GeoPoint,
    obstacles: Iterable[str],
    grown: Iterable[str],
    limits: Iterable[str],
    margin_m: float | None,
    names: Iterable[str] = (),
    drying: Iterable[tuple[str, str, Sequence[tuple[float | None, float | None]]]] = (),
) -> AreaView:
    """Return the area of WKT polygons in local metres; ``names`` are the obstacles', or there are none.

    ``drying``: name, polygon and closed spans of each piece of water that dries.
    """
    from companion.geo.frame import LocalFrame

    frame = LocalFrame(origin)
    # a hundredth of a degree towards the equator, so that it is on the globe at the poles too
    step = -0.01 if origin.lat_deg > 0.0 else 0.01
    north_m = frame.en_from_geo(GeoPoint(lat_deg=origin.lat_deg + step, lon_deg=origin.lon_deg))[1]
    aside_deg = origin.lon_deg - 0.01 if origin.lon_deg > 0.0 else origin.lon_deg + 0.01
    east_m = frame.en_from_geo(GeoPoint(lat_deg=origin.lat_deg, lon_deg=aside_deg))[0]
    area = AreaView(
        name=name,
        origin_lat_deg=origin.lat_deg,
        origin_lon_deg=origin.lon_deg,
        lat_m=round(north_m / step, 3),
        lon_m=round(abs(east_m) / 0.01, 3),
        obstacles=_shapes(obstacles),
        grown=_shapes(grown),
        limits=_shapes(limits),
        margin_m=margin_m,
        names=tuple(names),
        drying=tuple(
            DryingView(
                name=called,
                shapes=_shapes([text]),
                solid_unix_s=tuple((rounded(begin, 0), rounded(end, 0)) for begin, end in spans),
            )
            for called, text, spans in drying
        ),
    )
    return replace(area, hash=hashlib.sha256(msgspec.json.encode(area)).hexdigest()[:HASH_DIGITS])


def _shapes(texts: Iterable[str]) -> tuple[tuple[Ring, ...], ...]:
    shapes = [shapely.simplify(part, SIMPLER_M) for text in texts for part in shapely.get_parts(shapely.from_wkt(text))]
    return tuple(
        tuple(_ring(ring) for ring in (shape.exterior, *shape.interiors))
        for shape in shapes
        if isinstance(shape, Polygon) and not shape.is_empty
    )


def _ring(ring: shapely.LinearRing) -> Ring:
    return tuple((metres(x), metres(y)) for x, y in shapely.get_coordinates(ring)[:-1])

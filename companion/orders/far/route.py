"""A route in 270 bytes at the most: places, the band about each leg, and when she is there, as surely as members show.

It goes to the boat in one message of a satellite link. Of a longer route it is the begin: no leg is in it that was not
planned, and what is beyond follows in a later message.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from companion.messages import GeoPoint
from companion.orders.far.order import SEAL_BYTES, BitField, FarKey, Layout, minutes_of, unix_of

VERSION = 1
ROUTE = "route"  # the purpose of its code
MOST_BYTES = 270  # to the boat; from her 340
_NONE16 = 0xFFFF
_STEP_DEG = 2.5e-5  # 2.8 m, of what three bytes hold of half a turn
MIDDLE_S = 300.0  # to which the hours of places are told
_LATER_S = 1800.0
_BAND_M = 100.0
_EXACT = 1e-6  # of a step: what arithmetic leaves of a whole number of them
HEADER = Layout(
    (
        BitField(name="version", size=1, says=f"{VERSION}"),
        BitField(name="departs", size=3, unit="min since 2020-01-01 UTC", says="from when the times count"),
        BitField(name="base", size=3, unit="min since 2020-01-01 UTC", says="the run of the forecast"),
        BitField(name="members", size=1, says="of the forecast, at most 255"),
        BitField(name="count", size=1, says="of places that follow"),
        BitField(name="left", size=1, says="places that follow behind these, and are not in it"),
    )
)
PLACE = Layout(
    (
        BitField(name="lat", size=3, is_signed=True, step=_STEP_DEG, unit="2.5e-5 deg", says="place"),
        BitField(name="lon", size=3, is_signed=True, step=_STEP_DEG, unit="2.5e-5 deg", says="place"),
        BitField(
            name="band",
            size=1,
            step=_BAND_M,
            unit="100 m",
            says="to each side of the leg to it, rounded down; 0: less than 100 m",
        ),
        BitField(
            name="middle", size=2, step=MIDDLE_S, unit="5 min", unknown=_NONE16, says="from `departs`, as often as not"
        ),
        BitField(name="early", size=1, step=_LATER_S, unit="30 min", says="before it: a tenth of all runs are earlier"),
        BitField(name="late", size=1, step=_LATER_S, unit="30 min", says="after it: a tenth of all runs are later"),
    )
)
MOST_PLACES = (MOST_BYTES - SEAL_BYTES - HEADER.size) // PLACE.size


@dataclass(frozen=True, slots=True, kw_only=True)
class FarPlace:
    """A place, the band about the leg to it [m], and in how long she is there [s]; None: in none of the runs."""

    point: GeoPoint
    band_m: float
    middle_s: float | None = None
    early_s: float = 0.0
    late_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FarRoute:
    """Places from where she is, the hour from which their times count, the forecast's run and members [Unix s]."""

    departs_utc_s: float
    base_utc_s: float
    members: int
    places: tuple[FarPlace, ...]
    left_out: int = 0


def pack_route(route: FarRoute, key: FarKey) -> bytes:
    """Return the bytes of a route with their code. Raises ValueError for one without places."""
    if not route.places:
        raise ValueError("a route has places")
    places = route.places
    left = max(0, len(places) - MOST_PLACES)
    if left:
        places = places[:MOST_PLACES]
    body = HEADER.pack(
        {
            "version": VERSION,
            "departs": minutes_of(route.departs_utc_s),
            "base": minutes_of(route.base_utc_s),
            "members": min(255, route.members),
            "count": len(places),
            "left": min(255, left + route.left_out),
        }
    )
    return key.sealed(ROUTE, body + b"".join(PLACE.pack(_counts(place)) for place in places))


def _counts(place: FarPlace) -> dict[str, int]:
    by_name = {field.name: field for field in PLACE.fields}
    values: dict[str, float | None] = {
        "lat": place.point.lat_deg,
        "lon": place.point.lon_deg,
        "band": _BAND_M * math.floor(place.band_m / _BAND_M + _EXACT),  # a band is a limit
        "middle": place.middle_s,
        "early": _LATER_S * math.ceil(place.early_s / _LATER_S - _EXACT),  # and doubt is rounded up
        "late": _LATER_S * math.ceil(place.late_s / _LATER_S - _EXACT),
    }
    return {name: by_name[name].count(value) for name, value in values.items()}


def unpack_route(data: bytes, key: FarKey) -> FarRoute:
    """Return the route in bytes. Raises ValueError: of another length, key or version, or none that can be."""
    extra = len(data) - HEADER.size - SEAL_BYTES
    if extra <= 0 or extra % PLACE.size:
        raise ValueError(f"it has {len(data)} bytes: no {ROUTE}")
    body = key.opened(ROUTE, data, len(data))
    head = HEADER.unpack(body)
    if head["version"] != VERSION:
        raise ValueError(f"it is of version {head['version']}, and not {VERSION}")
    if head["count"] != extra // PLACE.size:
        raise ValueError(f"it says {head['count']} places and has {extra // PLACE.size}")
    rows = [PLACE.unpack(body[at : at + PLACE.size]) for at in range(HEADER.size, len(body), PLACE.size)]
    return FarRoute(
        departs_utc_s=unix_of(head["departs"]),
        base_utc_s=unix_of(head["base"]),
        members=head["members"],
        places=tuple(_place(row) for row in rows),
        left_out=head["left"],
    )


def _place(row: dict[str, int]) -> FarPlace:
    value = {field.name: field.value(row[field.name]) for field in PLACE.fields}
    lat, lon = value["lat"] or 0.0, value["lon"] or 0.0
    if not (-90.0 <= lat <= 90.0 and -180.0 <= lon <= 180.0):
        raise ValueError(f"{lat:g}, {lon:g} is no place")
    return FarPlace(
        point=GeoPoint(lat_deg=lat, lon_deg=lon),
        band_m=value["band"] or 0.0,
        middle_s=value["middle"],
        early_s=value["early"] or 0.0,
        late_s=value["late"] or 0.0,
    )


def bands_m(places: Sequence[FarPlace]) -> tuple[float, ...]:
    """Return the bands of the legs, 50 m at the least."""
    return tuple(max(50.0, place.band_m) for place in places[1:])

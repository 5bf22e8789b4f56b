"""Random fences, missions and documents, near a random place on the globe."""

import math

from hypothesis import HealthCheck
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon

from companion.geofence.document import Document, Mark, Track
from companion.geofence.shapes import Circle, Zone, ZoneKind
from companion.messages import Command, GeoPoint, MissionItem

# of every property test: a busy machine is no failure, and a seed repeats the run
QUIET = {"suppress_health_check": [HealthCheck.too_slow]}
NAMES = st.text(alphabet=st.sampled_from("abcÅß岩 -_.'&<>\"0123"), max_size=12).map(lambda s: " ".join(s.split()))


def lattice(value: float) -> float:
    """Return degrees as the wire can carry them."""
    return round(value * 1e7) / 1e7


@st.composite
def rings(draw, lat, lon, size_deg=0.01, lattice_only=True, min_corners=3, max_corners=9):
    """A simple star-shaped ring round (lat, lon), open, as (lon, lat)."""
    n = draw(st.integers(min_corners, max_corners))
    radii = draw(st.lists(st.floats(0.3, 1.0), min_size=n, max_size=n))
    turn = draw(st.floats(0.0, 1.0))
    out = []
    for i, r in enumerate(radii):
        a = 2.0 * math.pi * (i + 0.6 * turn) / n
        x, y = lon + size_deg * r * math.cos(a), lat + size_deg * r * math.sin(a)
        out.append((lattice(x), lattice(y)) if lattice_only else (x, y))
    return out


@st.composite
def places(draw):
    # 0, 0 is what formats write for "no position"
    lat, lon = draw(st.floats(-70.0, 70.0)), draw(st.floats(-179.0, 179.0))
    return (lat if abs(lat) > 0.1 else 0.5), lon


@st.composite
def zones(draw, lat, lon, circles=True, holes=True, lattice_only=True, names=True, margins=True):
    kind = draw(st.sampled_from(list(ZoneKind)))
    name = draw(NAMES) if names else ""
    margin = draw(st.none() | st.integers(1, 50).map(float)) if margins else None
    if circles and draw(st.booleans()):
        center = GeoPoint(lat_deg=lattice(lat), lon_deg=lattice(lon))
        return Zone(kind=kind, shape=Circle(center, float(draw(st.integers(5, 500)))), name=name, margin_m=margin)
    ring = draw(rings(lat, lon, lattice_only=lattice_only))
    inner = []
    if holes and draw(st.booleans()):
        inner = [draw(rings(lat, lon, size_deg=0.0008, lattice_only=lattice_only))]
        inner = [r for r in inner if Polygon(ring).buffer(-1e-6).covers(Polygon(r))]
    return Zone(kind=kind, shape=Polygon(ring, inner), name=name, margin_m=margin)


@st.composite
def items(draw, lat, lon, commands=True):
    command = draw(st.sampled_from([16, 17, 19, 16, 16])) if commands else 16
    params = tuple(float(draw(st.integers(-5, 300))) for _ in range(4)) if commands else (0.0,) * 4
    if commands and draw(st.integers(0, 6)) == 0:
        return MissionItem(command=Command.DO_CHANGE_SPEED, params=params)
    return MissionItem(
        command=command,
        lat_e7=round((lat + draw(st.floats(-0.02, 0.02))) * 1e7),
        lon_e7=round((lon + draw(st.floats(-0.02, 0.02))) * 1e7),
        params=params,
        alt_m=float(draw(st.integers(-10, 40))),
        frame=draw(st.sampled_from([0, 3])) if commands else 3,
        autocontinue=draw(st.booleans()) if commands else True,
    )


@st.composite
def documents(
    draw,
    *,
    zone_count=(0, 4),
    item_count=(0, 6),
    circles=True,
    holes=True,
    commands=True,
    marks=True,
    rally=True,
    tracks=True,
    names=True,
    margins=True,
    kinds=None,
    extras=True,
):
    """A whole document; the arguments say what a format can carry."""
    lat, lon = draw(places())
    point = GeoPoint(lat_deg=lattice(lat), lon_deg=lattice(lon))
    zs = draw(
        st.lists(zones(lat, lon, circles, holes, True, names, margins), min_size=zone_count[0], max_size=zone_count[1])
    )
    if kinds is not None:
        zs = [Zone(kind=kinds, shape=z.shape, name=z.name, margin_m=z.margin_m) for z in zs]
    ms = draw(st.lists(items(lat, lon, commands), min_size=item_count[0], max_size=item_count[1]))
    mk = []
    if marks and draw(st.booleans()):
        mk.append(Mark(geometry=Point(lattice(lon), lattice(lat)), kind=ZoneKind.EXCLUSION, name=draw(NAMES)))
        mk.append(Mark(geometry=LineString(draw(rings(lat, lon))), kind=ZoneKind.EXCLUSION, name=draw(NAMES)))
    ra = []
    if rally and draw(st.booleans()):
        ra.append(
            MissionItem(
                command=Command.NAV_RALLY_POINT,
                lat_e7=round(lat * 1e7),
                lon_e7=round(lon * 1e7),
                alt_m=float(draw(st.integers(0, 9))),
            )
        )
    tr = []
    if tracks and draw(st.booleans()):
        pts = tuple(GeoPoint(lat_deg=y, lon_deg=x) for x, y in draw(rings(lat, lon)))
        times = tuple(1.7e9 + i for i in range(len(pts))) if draw(st.booleans()) else None
        tr.append(Track(points=pts, times_s=times, name=draw(NAMES)))
    return Document(
        zones=tuple(zs),
        items=tuple(ms),
        marks=tuple(mk),
        rally=tuple(ra),
        tracks=tuple(tr),
        home=point if extras and draw(st.booleans()) else None,
        return_point=point if extras and draw(st.booleans()) else None,
    )

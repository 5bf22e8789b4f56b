"""Weather and passages made for tests: fields by formulas, in degrees near the equator."""

import math

import numpy as np

from companion.boat import Boat, constant
from companion.messages import GeoPoint
from companion.passage import Passage, PassageFrame, craft_of, land_of
from companion.weather import Cube, Weather

T0 = 1776643200.0  # 2026-04-20T00:00Z
EAST_DEG_M, NORTH_DEG_M = 111_319.5, 110_574.3  # a degree on WGS 84 at the equator


def place(lat, lon):
    return GeoPoint(lat_deg=lat, lon_deg=lon)


def cube(lat, lon, hours, field):
    """A cube of ``field(t_s, lat, lon) -> (east, north)``, or of several such fields, one a member."""
    fields = field if isinstance(field, list) else [field]
    y, x = np.meshgrid(lat, lon, indexing="ij")
    values = np.zeros((len(fields), len(hours), len(lat), len(lon), 2), dtype=np.float32)
    for m, one in enumerate(fields):
        for k, h in enumerate(hours):
            for c, part in enumerate(one(3600.0 * h, y, x)):
                values[m, k, ..., c] = part
    times = T0 + 3600.0 * np.array(hours, dtype=float)
    return Cube(
        utc_s=times,
        base_utc_s=np.full(len(times), T0),
        members=tuple(range(len(fields))),
        lat_deg=np.array(lat),
        lon_deg=np.array(lon),
        values=values,
    )


LAT, LON = np.linspace(-2.0, 2.0, 41), np.linspace(-2.0, 3.0, 51)
HOURS = np.arange(0.0, 97.0, 3.0)


def steady(east, north):
    return lambda t, y, x: (east + 0.0 * x, north + 0.0 * y)


def passage(
    start,
    goal,
    *,
    polar=None,
    wind=None,
    stream=None,
    land=(),
    radius_m=1.0,
    margin_m=0.0,
    no_go_deg=0.0,
    leeway_deg=0.0,
    tack_loss_s=0.0,
    max_tws_mps=None,
    waves=None,
    lee_shore_m=0.0,
    **craft,
):
    """A passage in a northerly of 5 m/s for a boat of 2 m/s on every course, where nothing else is said."""
    boat = Boat(
        polar=polar or constant(2.0),
        no_go_half_rad=math.radians(no_go_deg),
        leeway_rad=math.radians(leeway_deg),
        tack_loss_s=tack_loss_s,
        max_tws_mps=max_tws_mps,
    )
    frame = PassageFrame(start, goal)
    wind = cube(LAT, LON, HOURS, steady(0.0, -5.0)) if wind is None else wind
    winds = wind if isinstance(wind, tuple) else (wind,)
    west, east = sorted((start.lon_deg, goal.lon_deg))
    box = (west - 20.0, -80.0, east + 20.0, 80.0) if east - west < 180.0 else (east - 20.0, -80.0, west + 380.0, 80.0)
    return Passage(
        start=start,
        goal=goal,
        radius_m=radius_m,
        craft=craft_of(boat, **craft),
        weather=Weather(
            wind=winds, waves=() if waves is None else (waves,), current=() if stream is None else (stream,)
        ),
        land=land_of(frame, land, box, margin_m),
        frame=frame,
        lee_shore_m=lee_shore_m,
    )

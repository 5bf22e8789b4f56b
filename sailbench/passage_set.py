"""The passages of the bench: twelve routes in four seasons, one boat, one coast, weather that a seed makes.

The weather is made up after the climate (``lab.climate``); the coast is Natural Earth's at 1:110 million, in the public
domain, without its small islands; the boat is a cruiser of 12 m, guessed from her sizes. Nothing has to be downloaded.
"""

from __future__ import annotations

import datetime as dt
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.boat import Boat, read_polar
from companion.messages import GeoPoint
from companion.passage import Passage, PassageFrame, craft_of, land_of
from lab.climate import Box, truth

FOLDER = Path(__file__).parent / "passages"
POLAR, LAND = FOLDER / "cruiser.pol", FOLDER / "land.wkt"
SEASONS = {"winter": 1, "spring": 4, "summer": 7, "autumn": 10}  # of the north: the month that begins it
DAY = 15
MARGIN_M = 1000.0
MAX_TWS_MPS = 20.0
NO_GO_DEG, TACK_LOSS_S, RADIUS_M = 40.0, 20.0, 2000.0
_SLOW_MPS, _MORE_DAYS = 1.5, 4.0  # so long the weather is known
_STEP_S, _ROOM_DEG = 6 * 3600.0, 12.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """A start and a goal, latitude and longitude [deg], and why it is among them."""

    name: str
    start: tuple[float, float]
    goal: tuple[float, float]
    why: str


WAYS = (
    Way(name="celtic-sea", start=(49.6, -6.6), goal=(51.2, -9.9), why="a day or two"),
    Way(name="north-sea", start=(55.2, 0.5), goal=(59.0, 3.5), why="250 NM of open water"),
    Way(name="biscay", start=(48.4, -5.6), goal=(43.9, -8.6), why="a bay on one side"),
    Way(name="alboran", start=(39.0, 1.9), goal=(36.2, -3.2), why="round two capes"),
    Way(name="bermuda", start=(40.5, -70.5), goal=(32.9, -64.6), why="out of the westerlies"),
    Way(name="fiji-tonga", start=(-18.6, 178.9), goal=(-21.2, -175.5), why="over the date line, the trades ahead"),
    Way(name="arabian-sea", start=(18.5, 71.8), goal=(16.6, 55.0), why="a coast beyond the goal"),
    Way(name="tasman", start=(-34.0, 152.2), goal=(-38.6, 173.6), why="lows of the south"),
    Way(name="to-hawaii", start=(36.5, -122.8), goal=(21.8, -156.8), why="round a high into the trades"),
    Way(name="to-barbados", start=(27.4, -16.6), goal=(13.3, -59.2), why="before the trades"),
    Way(name="atlantic-east", start=(41.0, -69.0), goal=(49.6, -7.0), why="before the westerlies"),
    Way(name="atlantic-west", start=(51.0, -11.0), goal=(42.5, -61.0), why="against them"),
)


def departs_utc_s(season: str) -> float:
    """Return when a passage of a season departs [Unix s]."""
    return dt.datetime(2026, SEASONS[season], DAY, tzinfo=dt.UTC).timestamp()


@cache
def coast() -> tuple[BaseGeometry, ...]:
    """Return the polygons of land, longitude and latitude."""
    return tuple(shapely.from_wkt(line) for line in LAND.read_text(encoding="utf-8").splitlines())


def passage(way: Way, season: str) -> Passage:
    """Return what is asked: the way in the weather of its season."""
    start, goal = (GeoPoint(lat_deg=lat, lon_deg=lon) for lat, lon in (way.start, way.goal))
    frame, box = PassageFrame(start, goal), box_of(way)
    days = frame.length_m / (_SLOW_MPS * 86_400.0) + _MORE_DAYS
    times = departs_utc_s(season) + np.arange(0.0, days * 86_400.0 + _STEP_S, _STEP_S)
    seed = 100 * (WAYS.index(way) + 1) + SEASONS[season]
    boat = Boat(
        polar=read_polar(POLAR).polar,
        no_go_half_rad=math.radians(NO_GO_DEG),
        tack_loss_s=TACK_LOSS_S,
        max_tws_mps=MAX_TWS_MPS,
    )
    return Passage(
        start=start,
        goal=goal,
        radius_m=RADIUS_M,
        craft=craft_of(boat),
        weather=truth(seed, times, box),
        land=land_of(frame, coast(), box, MARGIN_M),
        frame=frame,
    )


def box_of(way: Way) -> Box:
    """Return the box of a way's weather, west, south, east, north [deg]."""
    (lat1, lon1), (lat2, lon2) = way.start, way.goal
    lon2 = lon1 + math.remainder(lon2 - lon1, 360.0)
    return (
        math.floor(min(lon1, lon2) - _ROOM_DEG),
        math.floor(max(-80.0, min(lat1, lat2) - _ROOM_DEG)),
        math.ceil(max(lon1, lon2) + _ROOM_DEG),
        math.ceil(min(80.0, max(lat1, lat2) + _ROOM_DEG)),
    )

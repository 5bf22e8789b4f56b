"""The passages of the bench: twelve routes (a file each) in four seasons, one boat, one coast, weather of a seed.

The weather is made up after the climate (``lab.climate``); the coast is Natural Earth's at 1:110 million, in the public
domain, without its small islands; the boat is a cruiser of 12 m, guessed from her sizes. Nothing has to be downloaded.
"""

from __future__ import annotations

import datetime as dt
import math
import tomllib
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
    """A start and a goal, latitude and longitude [deg], why it is among them, and the seed of its weather."""

    name: str
    start: tuple[float, float]
    goal: tuple[float, float]
    why: str
    seed: int


def _read(path: Path) -> Way:
    of = tomllib.loads(path.read_text(encoding="utf-8"))
    return Way(name=of["name"], start=tuple(of["start"]), goal=tuple(of["goal"]), why=of["why"], seed=of["seed"])


WAYS = tuple(sorted((_read(path) for path in FOLDER.glob("*.toml")), key=lambda way: way.seed))


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
    seed = way.seed + SEASONS[season]
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

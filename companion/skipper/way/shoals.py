"""Shoals that the sounder found: water that no chart calls too shallow, as discs with a doubt of their own.

One sounder looks straight down: of a shoal that lies ahead only the slope towards it is known, and of its shape
nothing. So it is a disc that begins where the slope meets the least depth, and the next one found near it is larger:
what turns the boat twice is a bar.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import shapely
from shapely.geometry.base import BaseGeometry

from companion.skipper.way.geometry import distance_m, moved
from companion.skipper.way.voyage import AreaLike, PointEn, outside_m

NAME = "a shoal that was sounded"
MOST_SHOALS = 200  # of a voyage: the oldest is forgotten
SOUNDED_M = 6.0  # about a sounding that is not deep enough
RADIUS_M = 20.0  # of the first that is found ahead somewhere ...
GROWS_M = 15.0  # ... and of each further one beside it by so much more
MOST_RADIUS_M = 110.0
NEAR_M = 150.0
DOUBT_M = 3.0  # where a sounding was taken ...
DOUBT_SHARE = 0.3  # ... and of the way that the slope was followed
KEPT_M = 2.0  # of the way to it that no doubt takes: the boat is not there yet
RISES_M = 0.5  # of tide over a shoal before it is tried again
_ROUND = 6  # chords of a quarter of a disc
_OUTWARDS = 1.0 / math.cos(math.pi / (4.0 * _ROUND))


@dataclass(frozen=True, slots=True, kw_only=True)
class Shoal:
    """Water less deep than she needs.

    Attributes:
        en_m: its middle.
        radius_m: of what is taken to be shoal.
        doubt_m: how far beyond that it may reach.
        depth_m: what was sounded on the way to it, or over it.
        tide_m: how high the tide stood above the chart's datum then, where a table tells it.
    """

    en_m: PointEn
    radius_m: float
    doubt_m: float
    depth_m: float
    tide_m: float | None = None

    def below_datum_m(self, transducer_m: float) -> float | None:
        """Return what was sounded as charts have it: below their datum [m]; None where no table told the tide."""
        return None if self.tide_m is None else self.depth_m + transducer_m - self.tide_m


def found(
    known: tuple[Shoal, ...],
    boat_en: PointEn,
    *,
    course_rad: float,
    speed_mps: float,
    depth_m: float,
    rate_mps: float,
    least_m: float,
    tide_m: float | None = None,
) -> Shoal:
    """Return the shoal that a boat is about to come onto, where ``depth_m`` changes by ``rate_mps``."""
    left_m = max(0.0, depth_m - least_m)
    way_m = speed_mps * left_m / -rate_mps if left_m > 0.0 and rate_mps < 0.0 else 0.0
    edge_en = moved(boat_en, course_rad, way_m)
    beside = sum(1 for s in known if s.radius_m >= RADIUS_M and distance_m(s.en_m, edge_en) <= NEAR_M + s.radius_m)
    radius_m = min(MOST_RADIUS_M, RADIUS_M + GROWS_M * beside)
    doubt_m = min(DOUBT_M + DOUBT_SHARE * way_m, max(0.0, way_m - KEPT_M))
    return Shoal(
        en_m=moved(edge_en, course_rad, radius_m),
        radius_m=radius_m,
        doubt_m=doubt_m,
        depth_m=min(depth_m, least_m),
        tide_m=tide_m,
    )


def over(boat_en: PointEn, depth_m: float, tide_m: float | None = None) -> Shoal:
    """Return the shoal that a boat is over: nothing is known of it but where she is."""
    return Shoal(en_m=boat_en, radius_m=SOUNDED_M, doubt_m=DOUBT_M, depth_m=depth_m, tide_m=tide_m)


def still_shoal(shoals: tuple[Shoal, ...], tide_m: float | None, least_m: float) -> tuple[Shoal, ...]:
    """Return those that are shoal at a height of the tide; all where it is not known, or was not when they were found.

    What lies ahead of the last sounding nobody has measured: the tide must have risen by ``RISES_M`` more than what
    was sounded there lacks. She may be wrong then, too, and turns back as before.
    """
    if tide_m is None:
        return shoals
    return tuple(s for s in shoals if s.tide_m is None or tide_m < s.tide_m + (least_m - s.depth_m) + RISES_M)


@functools.lru_cache(maxsize=8)
def water_taken(shoals: tuple[Shoal, ...]) -> BaseGeometry:
    """Return what shoals take of the water, their doubts with them; drawn around."""
    discs = [
        shapely.buffer(shapely.points(s.en_m), (s.radius_m + s.doubt_m) * _OUTWARDS, quad_segs=_ROUND) for s in shoals
    ]
    return shapely.union_all(discs)


def beyond_words(area: AreaLike, en_m: PointEn) -> str:
    """Return where a place is that is outside of the area's limits: in a shoal that was found, or outside the fence."""
    own = area.own
    is_shoal = own.edge_name.endswith(NAME) and outside_m(own, en_m) > 0.0 and outside_m(own.outer, en_m) == 0.0
    return f"inside {NAME}" if is_shoal else "outside the fence"


def shoaled(area: AreaLike, shoals: tuple[Shoal, ...]) -> AreaLike:
    """Return the area less the shoals: from within one there is only the way off it, and none through it."""
    return area.without(water_taken(shoals), NAME, is_own=True) if shoals else area

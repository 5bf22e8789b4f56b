"""Sweeps: an area laid out in parallel legs across the wind, and what a track has covered of it.

Across the wind is a beam reach both ways: every sweep is sailable, on either tack. They begin at the windward side, so
that each step to the next one leads to leeward. They are closer together than the swath, for a track strays from its
leg.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from companion.geo.angles import difference_rad
from companion.skipper.way.geometry import distance_m, leg_distance_m
from companion.skipper.way.voyage import PointEn

Sweep = tuple[PointEn, PointEn]

OVERLAP = 0.85  # of the swath: the distance between two sweeps at the most
SHORTEST = 0.25  # of the swath: a shorter sweep is none
RELAID_RAD = math.radians(30.0)  # the wind has turned so far from that which the sweeps were laid for: the rest anew
SLIVER = 0.12  # of the swath: what is narrower than twice this is no gap
STEP = 0.25  # of the swath: between two points of a track, and ...
STRAIGHT = 4.0  # ... this at the most where it is straight ...
BEND = 0.03  # ... to within this
LEAST_GAP = 0.5  # of the swath's square: what is smaller is none


def sweeps_over(area: BaseGeometry, swath_m: float, twd_from_rad: float, near_en: PointEn) -> tuple[Sweep, ...]:
    """Return the sweeps of an area [m], the windward ones first, each begun where the one before ended.

    ``near_en`` is where the boat comes from. Of several pieces the nearest is swept first. Empty: nothing is left.
    """
    out: list[Sweep] = []
    here = near_en
    pieces = [p for p in shapely.get_parts(area) if isinstance(p, Polygon) and not p.is_empty]
    while pieces:
        there = shapely.points(here)
        piece = min(pieces, key=lambda p: (float(p.distance(there)), p.bounds))
        pieces.remove(piece)
        out += _rows(piece, swath_m, twd_from_rad, here)
        here = out[-1][1] if out else here
    return tuple(out)


def _rows(piece: Polygon, swath_m: float, twd_from_rad: float, here: PointEn) -> list[Sweep]:
    """Return the sweeps of one piece. Turned so that the wind comes from above, they are rows from the top down."""
    pivot = (0.0, 0.0)
    turned = affinity.rotate(piece, twd_from_rad, origin=pivot, use_radians=True)  # shapely turns to the left
    west, south, east, north = turned.bounds
    count = max(1, math.ceil((north - south) / (OVERLAP * swath_m)))
    step = (north - south) / count
    at = affinity.rotate(shapely.points(here), twd_from_rad, origin=pivot, use_radians=True)
    x = float(at.x)
    out: list[Sweep] = []
    for n in range(count):
        row = LineString([(west - 1.0, north - (n + 0.5) * step), (east + 1.0, north - (n + 0.5) * step)])
        parts = [
            p
            for p in shapely.get_parts(shapely.intersection(turned, row))
            if isinstance(p, LineString) and p.length >= SHORTEST * swath_m
        ]
        spans = sorted((min(c[0] for c in p.coords), max(c[0] for c in p.coords)) for p in parts)
        if not spans:
            continue
        if abs(spans[0][0] - x) > abs(spans[-1][1] - x):
            spans = [(b, a) for a, b in reversed(spans)]
        y = float(row.coords[0][1])
        for a, b in spans:
            back = affinity.rotate(LineString([(a, y), (b, y)]), -twd_from_rad, origin=pivot, use_radians=True)
            (ax, ay), (bx, by) = back.coords[0], back.coords[1]
            out.append(((round(ax, 2), round(ay, 2)), (round(bx, 2), round(by, 2))))
        x = spans[-1][1]
    return out


def is_off(twd_from_rad: float, laid_for_rad: float) -> bool:
    """Return whether sweeps that were laid for one wind are to be laid anew for another: a reversed one is as good."""
    turned = abs(difference_rad(twd_from_rad, laid_for_rad))
    return min(turned, math.pi - turned) > RELAID_RAD


@lru_cache(maxsize=4)  # asked for more often than the track grows
def covered(track: tuple[PointEn, ...], swath_m: float) -> BaseGeometry:
    """Return what a track has looked at: everything within half a swath of it."""
    if not track:
        return Polygon()
    line = LineString(track) if len(track) > 1 else shapely.points(track[0])
    return shapely.buffer(line, 0.5 * swath_m, quad_segs=6)


def coverage(area: BaseGeometry, track: tuple[PointEn, ...], swath_m: float) -> float:
    """Return the share of an area that a track has covered."""
    whole = float(area.area)
    return float(shapely.intersection(area, covered(track, swath_m)).area) / whole if whole > 0.0 else 1.0


def left_over(area: BaseGeometry, track: tuple[PointEn, ...], swath_m: float) -> BaseGeometry:
    """Return what is left to look at, without slivers and specks."""
    rest = shapely.difference(area, covered(track, swath_m))
    opened = shapely.buffer(shapely.buffer(rest, -SLIVER * swath_m, quad_segs=2), SLIVER * swath_m, quad_segs=2)
    pieces = [p for p in shapely.get_parts(opened) if isinstance(p, Polygon) and p.area >= LEAST_GAP * swath_m**2]
    return shapely.MultiPolygon(pieces)


def grown(track: tuple[PointEn, ...], here: PointEn, swath_m: float) -> tuple[PointEn, ...]:
    """Return the track with one point more where it has gone far enough; straight on, in place of the last one."""
    if track and distance_m(track[-1], here) < STEP * swath_m:
        return track
    point = (round(here[0], 1), round(here[1], 1))
    is_straight = (
        len(track) > 1
        and distance_m(track[-2], point) <= STRAIGHT * swath_m
        and (leg_distance_m(track[-1], track[-2], point) <= BEND * swath_m)
    )
    return (*(track[:-1] if is_straight else track), point)


def length_m(sweeps: Sequence[Sweep]) -> float:
    """Return the length of all sweeps [m]."""
    return float(np.sum([distance_m(a, b) for a, b in sweeps]))

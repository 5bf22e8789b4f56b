"""A problem in the metres of Büsser's flat earth (2009, eq. 4.2), for ``astar``, and its path back.

Every place of the problem goes over latitude and longitude into his plane; the path's places come back the same way,
so corners lose nothing. Between them a straight leg of his plane is a slightly bent one, and his courses are not quite
true (docs/frames.md has the figures). What that may cost is kept clear of beforehand: solids are grown by the bend, the
sailable angles are narrowed by the error of course. The answer is judged in the problem's own metres by the exact
scorer, like every other.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.planner.problem.parts import Target
from companion.planner.problem.value import Problem
from companion.planner.reference.world import bounds_of

# Büsser's flat earth, kept as a reference: a plane of latitude and longitude scaled at the origin.
#
# Büsser 2009, equation 4.2: x = R_E cos(lat) π/180 lon, y = R_E π/180 lat, then an offset is subtracted; here lat in
# the cosine is the origin's, without which x would not be a function of longitude alone. Fine within a kilometre or so;
# the boat uses ``companion.geo.frame``. ``docs/frames.md`` has the table of its errors.

EARTH_RADIUS_M = 6_371_000.0  # mean radius of the sphere


def flat_en_from_lonlat(origin: GeoPoint, lonlat_deg: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) east, north [m] of (n, 2) lon, lat [deg] by Büsser's equation 4.2."""
    lonlat = np.asarray(lonlat_deg, dtype=np.float64).reshape(-1, 2)
    delta_lon = np.radians((lonlat[:, 0] - origin.lon_deg + 180.0) % 360.0 - 180.0)
    east_m = EARTH_RADIUS_M * delta_lon * math.cos(math.radians(origin.lat_deg))
    return np.column_stack([east_m, EARTH_RADIUS_M * np.radians(lonlat[:, 1] - origin.lat_deg)])


def flat_lonlat_from_en(origin: GeoPoint, en_m: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) lon, lat [deg] of (n, 2) east, north [m]; the inverse of ``flat_en_from_lonlat``."""
    en = np.asarray(en_m, dtype=np.float64).reshape(-1, 2)
    lon = origin.lon_deg + np.degrees(en[:, 0] / (EARTH_RADIUS_M * math.cos(math.radians(origin.lat_deg))))
    return np.column_stack([(lon + 180.0) % 360.0 - 180.0, origin.lat_deg + np.degrees(en[:, 1] / EARTH_RADIUS_M)])


DIRECTIONS = 24
STEP_M = 1.0
EDGE_M = 500.0        # an edge of a solid is cut into pieces so long: each bends by millimetres
OBLIQUE = 1.09        # the most of sin(course) (1 + cos² course)
SAFETY = 1.05         # of the errors found on the box's edge and in its middle


class FlatPlane:
    """The two planes about one origin: the problem's metres (``LocalFrame``) and Büsser's."""

    def __init__(self, origin: GeoPoint) -> None:
        self._origin, self._frame = origin, LocalFrame(origin)

    def to(self, en_m: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) places [m] of the problem's frame in his plane."""
        return flat_en_from_lonlat(self._origin, self._frame.array_lonlat_from_en(en_m))

    def back(self, flat_m: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) places [m] of his plane in the problem's frame."""
        return self._frame.array_en_from_lonlat(flat_lonlat_from_en(self._origin, flat_m))

    def turn_rad(self, box: tuple[float, float, float, float]) -> float:
        """Return the largest difference of a course between the two planes within a box of the frame [rad]."""
        x, y = (np.linspace(box[0], box[2], 5), np.linspace(box[1], box[3], 5))
        place = np.column_stack([g.ravel() for g in np.meshgrid(x, y)])
        here, worst = self.to(place), 0.0
        for course in np.linspace(0.0, 2.0 * math.pi, DIRECTIONS, endpoint=False):
            step = STEP_M * np.array([math.sin(course), math.cos(course)])
            moved = self.back(here + step) - place
            off = np.arctan2(moved[:, 0], moved[:, 1]) - course
            worst = max(worst, float(np.max(np.abs((off + math.pi) % (2.0 * math.pi) - math.pi))))
        return SAFETY * worst

    def bend_m(self, length_m: float, off_m: float) -> float:
        """Return how far a straight leg of his plane bends in the other at most, ``off_m`` from the origin.

        A parallel by L² tan(latitude) / 8 R; a leg that leads polewards, too, by 1.09 times that.
        """
        lat_rad = math.radians(abs(self._origin.lat_deg)) + off_m / EARTH_RADIUS_M
        steep = OBLIQUE * math.tan(min(math.radians(89.0), lat_rad)) + off_m / EARTH_RADIUS_M
        return SAFETY * length_m * length_m * steep / (8.0 * EARTH_RADIUS_M)

    def problem(self, p: Problem) -> Problem:
        """Return the problem stated in his plane, with room for what the plane is wrong by."""
        box = bounds_of(p)
        turn = self.turn_rad(box)
        scale = float(np.max(np.abs(self._scales(box))))
        far_m = max(math.hypot(x, y) for x in box[0::2] for y in box[1::2])
        bend = min(self.bend_m(math.dist(p.start_en, p.goal_en), far_m), 0.5 * _room_m(p))

        def flat(shape: shapely.Geometry) -> shapely.Geometry:
            return shapely.transform(shapely.segmentize(shape, EDGE_M), self.to)

        start, goal = (tuple(float(c) for c in row) for row in self.to([p.start_en, p.goal_en]))
        boat = replace(p.boat, no_go_half_rad=p.boat.no_go_half_rad + turn,
                       max_twa_rad=p.boat.max_twa_rad - (turn if p.boat.max_twa_rad < math.pi else 0.0))
        zone = p.zone and replace(p.zone, half_rad=p.zone.half_rad + turn)
        return replace(
            p, start_en=(start[0], start[1]), goal_en=(goal[0], goal[1]), boat=boat, zone=zone,
            obstacles=tuple(flat(shape).buffer(bend, join_style="mitre") for shape in p.obstacles),
            fence=None if p.fence is None else flat(p.fence).buffer(-bend, join_style="mitre"),
            goal_radius_m=p.goal_radius_m / (1.0 + scale), targets=tuple(self._target(t, scale) for t in p.targets),
        )

    def _scales(self, box: tuple[float, float, float, float]) -> NDArray[np.float64]:
        corner = np.array([[box[0], box[1]], [box[0], box[3]], [box[2], box[1]], [box[2], box[3]]])
        here = self.to(corner)
        return np.array([np.hypot(*(self.to(corner + d) - here).T) - 1.0 for d in ((1.0, 0.0), (0.0, 1.0))])

    def _target(self, t: Target, scale: float) -> Target:
        at = np.array([t.x_m + t.vx_mps * t.from_s, t.y_m + t.vy_mps * t.from_s])
        here, later = self.to([at, at + np.array([t.vx_mps, t.vy_mps])])
        vx, vy = later - here
        x, y = here - np.array([vx, vy]) * t.from_s
        return replace(t, x_m=float(x), y_m=float(y), vx_mps=float(vx), vy_mps=float(vy),
                       radius_m=t.radius_m * (1.0 + scale), growth_mps=t.growth_mps * (1.0 + scale))


def _room_m(p: Problem) -> float:
    """Return how far start and goal are from anything solid [m]: what is grown must not reach them."""
    ends = shapely.points([p.start_en, p.goal_en])
    shapes = [*p.obstacles, *([] if p.fence is None else [p.fence.boundary])]
    return min((float(shapely.distance(shape, end)) for shape in shapes for end in ends), default=math.inf)

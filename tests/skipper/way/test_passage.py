"""The leg of a passage: one geodesic whatever the frame, its band, and where a plan for the next miles ends."""

import math
from dataclasses import replace

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.skipper.planning.statement import aim_at, along, band, leg_line
from companion.skipper.step.config import SkipperConfig
from companion.skipper.way.gates import Gate
from tests.skipper.world import voyage

EARTH = Geod(ellps="WGS84")
A, B = GeoPoint(lat_deg=52.0, lon_deg=177.3), GeoPoint(lat_deg=52.35, lon_deg=-178.6)  # 281 km over the date line
AZIMUTH_DEG, _, LENGTH_M = EARTH.inv(A.lon_deg, A.lat_deg, B.lon_deg, B.lat_deg)
REACH_M, BAND_M, HORIZON_M = 60_000.0, 5000.0, 30_000.0


def on_leg(share, aside_m=0.0):
    """Return a place at a share of the leg, so far to the right of it."""
    lon, lat, back_deg = EARTH.fwd(A.lon_deg, A.lat_deg, AZIMUTH_DEG, share * LENGTH_M)
    lon, lat, _ = EARTH.fwd(lon, lat, back_deg + 180.0 + 90.0, aside_m)
    return GeoPoint(lat_deg=lat, lon_deg=math.remainder(lon, 360.0))


def sailing(here, shift_m=(0.0, 0.0)):
    """Return the voyage in a frame near a place, the gate at the end of the leg, and the place."""
    frame = LocalFrame(LocalFrame(here).geo_from_en(*shift_m))
    made = voyage()
    area = replace(made.area, reach_m=REACH_M) if hasattr(made.area, "reach_m") else made.area
    made = replace(made, frame=frame, recentre_m=10_000.0, area=area)
    gate = Gate(
        en_m=frame.en_from_geo(B),
        radius_m=100.0,
        goal=0,
        ends_goal=True,
        name="B",
        from_en_m=frame.en_from_geo(A),
        bandwidth_m=BAND_M,
    )
    return made, gate, frame.en_from_geo(here)


def off_leg_m(place):
    """Return how far a place is from the leg."""
    azimuth, _, far_m = EARTH.inv(A.lon_deg, A.lat_deg, place.lon_deg, place.lat_deg)
    return 6_371_000.0 * math.asin(math.sin(far_m / 6_371_000.0) * math.sin(math.radians(azimuth - AZIMUTH_DEG)))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.45, 0.7, 1.0])
@pytest.mark.parametrize("shift_m", [(0.0, 0.0), (9000.0, -4000.0), (-7000.0, 7000.0)])
def test_the_leg_is_the_same_line_in_every_frame(share, shift_m):
    made, gate, here = sailing(on_leg(share), shift_m)
    line = leg_line(made.frame, gate.from_en_m, gate.en_m, here, REACH_M)
    assert line.distance(shapely.points(here)) < 0.2
    for other in (share - 0.1, share + 0.05, share + 0.15):
        if 0.0 <= other <= 1.0:
            assert line.distance(shapely.points(made.frame.en_from_geo(on_leg(other)))) < 0.5
    if share < 0.8:
        ahead = made.frame.geo_from_en(*along(line, here, 20_000.0))
        assert EARTH.inv(ahead.lon_deg, ahead.lat_deg, *lonlat(on_leg(share + 20_000.0 / LENGTH_M)))[2] < 2.0


def lonlat(point):
    return point.lon_deg, point.lat_deg


@given(st.floats(0.05, 0.85), st.floats(-0.9, 0.9), st.tuples(st.floats(-9000.0, 9000.0), st.floats(-9000.0, 9000.0)))
def test_a_plan_ends_at_the_horizon_on_the_leg_within_its_band(share, aside, shift_m):
    made, gate, here = sailing(on_leg(share, aside * BAND_M), shift_m)
    aim = aim_at(made, SkipperConfig(horizon_m=HORIZON_M), gate, 0, here)
    assert aim.gate == -1
    place = made.frame.geo_from_en(*aim.en_m)
    assert abs(off_leg_m(place)) + aim.radius_m < BAND_M
    far_m = math.dist(aim.en_m, here)
    assert 0.3 * HORIZON_M < far_m < HORIZON_M + 2.0 * BAND_M
    corridor = band(made, gate, here, aim.en_m)
    assert corridor.covers(shapely.points(here))
    assert corridor.covers(shapely.points(aim.en_m))
    # beyond the band, and not about the boat, there is no water to plan in
    outside = made.frame.en_from_geo(on_leg(share + 0.5 * HORIZON_M / LENGTH_M, 1.05 * BAND_M))
    assert not corridor.covers(shapely.points(outside))
    inside = made.frame.en_from_geo(on_leg(share + 0.5 * HORIZON_M / LENGTH_M, 0.95 * BAND_M))
    assert corridor.covers(shapely.points(inside))


def test_the_last_plan_of_a_leg_ends_at_its_goal():
    made, gate, here = sailing(on_leg(1.0 - 20_000.0 / LENGTH_M))
    aim = aim_at(made, SkipperConfig(horizon_m=HORIZON_M), gate, 0, here)
    assert (aim.gate, aim.en_m) == (0, gate.en_m)


def test_without_a_band_it_is_straight_ahead():
    made, gate, here = sailing(on_leg(0.3, 3000.0))
    aim = aim_at(made, SkipperConfig(horizon_m=HORIZON_M), replace(gate, bandwidth_m=None), 0, here)
    assert math.dist(aim.en_m, here) == pytest.approx(HORIZON_M)
    assert band(made, replace(gate, bandwidth_m=None), here, aim.en_m) is None

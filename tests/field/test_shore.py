"""What stands still: the field points away from it, the look-ahead keeps clear of it and lets a boat out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, Polygon, box

from companion.field.guidance import RepulsiveShore, go_to, hold_heading, step
from companion.field.values import GuidanceSettings, GuidanceState, Situation
from companion.field.vector_fields import REPULSIVE
from companion.geo.angles import wrap_pi
from companion.geo.frame import LocalFrame
from companion.geofence import LocalArea
from companion.messages import GeoPoint

FRAME = LocalFrame(GeoPoint(lat_deg=51.1, lon_deg=-1.3))
HABITS = GuidanceSettings(lag_s=2.0, tack_s=2.0, turn_rate_radps=math.radians(40.0))


def area(*rocks: Polygon, limits: Polygon | None = None) -> LocalArea:
    return LocalArea(
        frame=FRAME,
        names=tuple(map(str, range(len(rocks)))),
        polygons=rocks,
        own_margins_m=(0.0,) * len(rocks),
        limits=limits,
    )


def sail(
    water: LocalArea, goal: tuple[float, float], at: tuple[float, float] = (0.0, 0.0), seconds: int = 300
) -> list[tuple[float, float]]:
    """Sail a point at 2 m/s that turns 40 degrees a second by the guidance; return its track up to the goal."""
    state, heading, track = GuidanceState(), math.pi / 2.0, [at]
    for t in range(seconds):
        seen = Situation(
            t_s=float(t),
            en_m=track[-1],
            heading_rad=heading,
            twd_from_rad=0.0,
            velocity_en_mps=(2.0 * math.sin(heading), 2.0 * math.cos(heading)),
        )
        state, setpoint = step(state, seen, replace(go_to(goal, 0.0), clearance=water.clearance_m), HABITS)
        turn = wrap_pi(setpoint.heading_rad - heading)
        heading = wrap_pi(heading + max(-0.7, min(0.7, turn)))
        track.append((track[-1][0] + 2.0 * math.sin(heading), track[-1][1] + 2.0 * math.cos(heading)))
        if math.dist(track[-1], goal) < 5.0:
            break
    return track


@settings(max_examples=100)
@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0))
def test_the_field_points_away_from_the_nearest_shore(x: float, y: float) -> None:
    rock = box(-10.0, -10.0, 10.0, 10.0)
    vector = RepulsiveShore(area(rock).clearance_m, sigma_m=16.0)((x, y))[0]
    clear = rock.distance(Point(x, y))
    assert math.hypot(*vector) <= REPULSIVE * math.exp(-((clear / 16.0) ** 2)) * 1.05 + 1e-6
    if 1.0 < clear < 40.0:
        assert rock.distance(Point(x + 0.1 * vector[0], y + 0.1 * vector[1])) > clear


def test_open_water_repels_nobody() -> None:
    vectors = RepulsiveShore(area().clearance_m, sigma_m=16.0)(np.zeros((3, 2)))
    assert not vectors.any()


@pytest.mark.parametrize("north_m", [-14.0, -6.0, 0.0, 6.0, 14.0])
def test_a_rock_on_the_way_is_gone_round(north_m: float) -> None:
    rock = box(60.0, north_m - 15.0, 80.0, north_m + 15.0)
    track = sail(area(rock), (150.0, 0.0))
    assert math.dist(track[-1], (150.0, 0.0)) < 5.0
    assert min(rock.distance(Point(p)) for p in track) > 4.0
    assert min(rock.distance(Point(p)) for p in sail(area(), (150.0, 0.0))) < 2.0


def test_a_beat_stays_inside_the_fence() -> None:
    water = box(-30.0, -20.0, 30.0, 170.0)
    track = sail(area(limits=water), (0.0, 150.0), seconds=400)
    assert math.dist(track[-1], (0.0, 150.0)) < 5.0
    assert all(water.contains(Point(p)) for p in track)
    assert max(abs(p[0]) for p in sail(area(), (0.0, 150.0), seconds=400)) > 30.0


def test_a_boat_too_near_already_is_let_out() -> None:
    rock = box(3.0, -40.0, 40.0, 40.0)
    track = sail(area(rock), (-60.0, 0.0))
    assert math.dist(track[-1], (-60.0, 0.0)) < 5.0
    assert min(rock.distance(Point(p)) for p in track[1:]) > 0.0


def test_a_heading_at_the_shore_is_not_held() -> None:
    rock = box(20.0, -200.0, 60.0, 200.0)
    seen = Situation(t_s=0.0, en_m=(0.0, 0.0), velocity_en_mps=(2.0, 0.0), heading_rad=math.pi / 2.0, twd_from_rad=0.0)
    intent = replace(hold_heading(math.pi / 2.0), clearance=area(rock).clearance_m)
    _, setpoint = step(GuidanceState(), seen, intent, HABITS)
    assert math.sin(setpoint.heading_rad) < 0.5

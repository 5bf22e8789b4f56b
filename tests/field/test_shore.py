"""What stands still: the field points away from it, the look-ahead keeps clear of it and lets a boat out."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, Polygon, box

from companion.field.guidance import RepulsiveShore, follow_line, go_to, hold_heading, step
from companion.field.values import GuidanceSettings, GuidanceState, MovingObstacle, Situation
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


# A channel of 70 m between two pools, and a small boat's polar.
NORTH = [(35.0, 260.0), (90.0, 280.0), (90.0, 380.0), (-90.0, 380.0), (-90.0, 280.0), (-35.0, 260.0)]
POOLS = Polygon([*NORTH, (-35.0, 60.0), (-90.0, 40.0), (-90.0, -60.0), (90.0, -60.0), (90.0, 40.0), (35.0, 60.0)])
SMALL = GuidanceSettings(
    no_go_half_rad=math.radians(49.0),
    polar_twa_rad=tuple(map(math.radians, (0.0, 30.0, 45.0, 60.0, 90.0, 120.0, 150.0, 180.0))),
    polar_mps=(0.0, 0.5, 1.9, 2.4, 2.8, 2.9, 2.6, 2.2),
    turn_rate_radps=math.radians(60.0),
    tack_s=2.0,
    lag_s=3.0,
    horizon_s=60.0,
    keep_m=6.5,
)


class Chased(NamedTuple):
    clear_m: float  # the least, of the shore
    off_m: float  # and of the ship's middle
    turns: int  # from one second to the next another heading, by 30 degrees and more


def chased(seed: int, twd_deg: float, ship_mps: float = 3.0) -> Chased:
    """Meet a ship that comes through the channel."""
    noise, state, at, heading, speed, twd = np.random.default_rng(seed), GuidanceState(), (0.3, 175.0), 0.0, 2.9, 0.0
    water, clear_m, off_m, turns = area(limits=POOLS), math.inf, math.inf, 0
    for t in range(150):
        twd += -twd / 20.0 + noise.normal(0.0, math.radians(2.0))
        wind = math.radians(twd_deg) + twd
        ship = (5.0, 429.0 - ship_mps * t)
        disc = MovingObstacle(en_m=ship, velocity_en_mps=(0.0, -ship_mps), keep_m=87.0, growth_mps=0.3, ring_m=50.0)
        seen = Situation(
            t_s=float(t),
            en_m=(at[0] + noise.normal(0.0, 0.3), at[1] + noise.normal(0.0, 0.3)),
            velocity_en_mps=(speed * math.sin(heading), speed * math.cos(heading)),
            heading_rad=heading,
            twd_from_rad=wind,
            obstacles=(disc,),
        )
        back = replace(follow_line((0.3, 0.0), (0.0, 320.0)), clearance=water.clearance_m)
        last = state.wanted_rad
        state, setpoint = step(state, seen, back, SMALL)
        turns += last is not None and abs(wrap_pi(setpoint.heading_rad - last)) > math.radians(30.0)
        for _ in range(10):
            heading += max(-0.105, min(0.105, wrap_pi(setpoint.heading_rad - heading)))
            twa = abs(wrap_pi(wind - heading))
            speed += (float(np.interp(twa, SMALL.polar_twa_rad, SMALL.polar_mps)) - speed) / 30.0
            at = (at[0] + 0.1 * speed * math.sin(heading), at[1] + 0.1 * speed * math.cos(heading))
        clear_m, off_m = min(clear_m, float(water.clearance_m([at])[0])), min(off_m, math.dist(at, ship))
    return Chased(clear_m, off_m, turns)


@pytest.mark.parametrize(("seed", "twd_deg"), [(1, 90.0), (3, 270.0)])
def test_no_way_that_touches_before_she_could_turn_is_taken_while_another_is_left(seed: int, twd_deg: float) -> None:
    """Along a shore that came nearer she kept away from a fast ship until no turn had room: 0.7 and 0.3 m."""
    assert chased(seed, twd_deg, 5.0).clear_m > 2.0


@pytest.mark.parametrize(("seed", "twd_deg"), [(0, 270.0), (1, 270.0), (2, 270.0), (0, 315.0), (0, 0.0), (0, 90.0)])
def test_between_a_ship_and_the_shore_she_goes_ashore_for_neither_way_round(seed: int, twd_deg: float) -> None:
    """Two ways out, each about as good: she took another each second, and none before the shore came."""
    met = chased(seed, twd_deg)
    assert met.clear_m > 2.0
    assert met.off_m > 37.0  # the ship's hull, and what is not known of her


@pytest.mark.parametrize(("seed", "twd_deg"), [(1, 270.0), (0, 90.0)])
def test_of_two_ways_alike_the_one_that_was_chosen_is_kept(seed: int, twd_deg: float) -> None:
    """In 150 s she wanted another heading 77 and 58 times."""
    assert chased(seed, twd_deg).turns < 30


@pytest.mark.parametrize(("seed", "twd_deg", "ship_mps"), [(3, 90.0, 3.0), (1, 0.0, 5.0)])
def test_distance_to_a_ship_is_given_up_before_the_shores(seed: int, twd_deg: float, ship_mps: float) -> None:
    """Held against the shore by all of a disc of 87 m, 50 of them distance kept, she came to 4.6 and 5.4 m of it."""
    assert chased(seed, twd_deg, ship_mps).clear_m > 7.0


# Between an island and two squares the water narrows to the west to nothing, and the wind veers against her way back.
ISLAND = [
    (-132.0, -30.0),
    (-56.0, 46.0),
    (-93.0, 70.0),
    (-237.0, 70.0),
    (-431.0, -181.0),
    (-89.0, -137.0),
    (-49.0, -86.0),
]
WEDGE = area(Polygon(ISLAND), box(-98.0, -270.0, 143.0, -30.0), box(-338.0, -390.0, -98.0, -150.0))
STATED_SLOW = GuidanceSettings(
    no_go_half_rad=math.radians(47.0),
    polar_twa_rad=tuple(map(math.radians, (0.0, 20.0, 35.0, 45.0, 60.0, 90.0, 120.0, 180.0))),
    polar_mps=(0.0, 1.47, 2.65, 3.31, 4.0, 4.69, 4.75, 5.13),
    turn_rate_radps=math.radians(8.0),
    tack_s=4.0,
    lag_s=3.0,
    horizon_s=60.0,
    keep_m=3.2,
)


@pytest.mark.parametrize("further_m", [0.0, 3.5])
def test_she_turns_out_of_a_wedge_while_there_is_room_to(further_m: float) -> None:
    """Straight on was clear until no way round was left, and then she touched."""
    course = math.radians(256.0)
    seen = Situation(
        t_s=0.0,
        en_m=(-14.0 + further_m * math.sin(course), -2.0 + further_m * math.cos(course)),
        velocity_en_mps=(3.8 * math.sin(course), 3.8 * math.cos(course)),
        heading_rad=course,
        twd_from_rad=math.radians(207.0),
        tws_mps=12.0,
    )
    intent = replace(hold_heading(course), clearance=WEDGE.clearance_m)
    _, setpoint = step(GuidanceState(wanted_rad=course), seen, intent, STATED_SLOW)
    assert abs(wrap_pi(setpoint.heading_rad - course)) > math.radians(60.0)


def test_a_boat_that_may_turn_faster_than_is_stated_is_not_led_into_what_that_leads_into() -> None:
    """Turned at the 8 degrees a second that are stated she passes ahead of the rock, at 60 she strikes it."""
    rock = box(12.0, -8.0, 60.0, 10.0)
    seen = Situation(
        t_s=0.0,
        en_m=(0.0, 0.0),
        velocity_en_mps=(0.0, 4.0),
        heading_rad=0.0,
        twd_from_rad=math.radians(270.0),
        tws_mps=12.0,
    )
    intent = replace(hold_heading(math.pi / 2.0), clearance=area(rock).clearance_m)
    _, setpoint = step(GuidanceState(), seen, intent, STATED_SLOW)
    assert abs(wrap_pi(setpoint.heading_rad - math.pi / 2.0)) > math.radians(30.0)


def test_the_point_of_a_rock_between_two_steps_of_what_is_foreseen_is_kept_off() -> None:
    """At 4.7 m/s they lie 11.7 m apart: the heading past its point, half a metre off, looked 5.9 m clear."""
    rock = Polygon([(17.6, 0.5), (17.1, 30.0), (18.1, 30.0)])
    east = math.pi / 2.0
    seen = Situation(
        t_s=0.0, en_m=(0.0, 0.0), velocity_en_mps=(4.69, 0.0), heading_rad=east, twd_from_rad=0.0, tws_mps=12.0
    )
    intent = replace(hold_heading(east), clearance=area(rock).clearance_m)
    _, setpoint = step(GuidanceState(wanted_rad=east), seen, intent, STATED_SLOW)
    assert wrap_pi(setpoint.heading_rad - east) > math.radians(8.0)  # to the south of it

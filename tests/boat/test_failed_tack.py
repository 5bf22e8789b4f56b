"""A tack that fails: the reckoned track holds what the simulator's hull does, in every wind, for any time in irons."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from companion.boat.boat import coefficient_of
from companion.boat.failed_tack import AGAIN_SHARE, SET_SHARE, failed_tack, lee_set
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.kernel import IRONS_RAD, side_mps
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import Surroundings, Vehicle
from sitl.autopilot.config import Departures
from sitl.world.environment import Constant

HALF = math.radians(50.0)


def sailed(tws_mps, irons_s):
    """Return her speed before the corner, and her places from there until the third try, in pieces by try."""
    departs = replace(Departures(), tack_fails=1.0, irons_s=irons_s)
    wind = Constant(0.0, tws_mps)
    vehicle = Vehicle(
        wind,
        Parameters({}),
        heading_rad=HALF,
        is_moored=False,
        seed=0,
        polar=None,
        surroundings=Surroundings(wind, departs, None, 0),
    )
    vehicle.settle()
    vehicle.set_armed(armed=True)
    vehicle.steer_heading(HALF, 1.0)

    def run(loops):
        while loops > 0:
            done, _ = vehicle.advance(loops)
            loops -= done

    run(1500)
    corner, speed = vehicle.state[[k.S_E, k.S_N]].copy(), float(vehicle.state[k.S_V])
    vehicle.steer_heading(-HALF, 1.0)
    pieces: list[list] = [[], [], [], []]
    while vehicle.state[k.S_TRIES] < 3.0:
        run(10)
        pieces[int(vehicle.state[k.S_TRIES])].append(vehicle.state[[k.S_E, k.S_N]] - corner)
    return speed, [np.array(pieces[0] + pieces[1]), np.array(pieces[2])]


@pytest.mark.parametrize("tws_mps", [3.0, 5.0, 9.0])
@pytest.mark.parametrize("irons_s", [4.0, 14.0])
def test_the_simulated_hull_stays_near_the_reckoned_tracks(tws_mps, irons_s):
    speed, pieces = sailed(tws_mps, irons_s)
    place, pace = (0.0, 0.0), speed
    for n, piece in enumerate(pieces):
        tracks = failed_tack(place, course_rad=HALF, speed_mps=pace, twd_from_rad=0.0, tws_mps=tws_mps)
        lines = shapely.MultiLineString(list(tracks))
        off = shapely.distance(shapely.points(piece), lines)
        assert float(np.max(off)) < 2.5, n
        # and not far beyond: a reckoning that is twice as long would keep her from tacks that are safe
        assert math.dist(tracks[1][-1], piece[-1]) < 1.2 * pace + 1.0
        place, pace = tuple(tracks[1][-1]), AGAIN_SHARE * speed


@given(
    course=st.floats(-math.pi, math.pi),
    twd=st.floats(-math.pi, math.pi),
    speed=st.floats(0.1, 5.0),
    tws=st.floats(0.0, 15.0),
    turn=st.floats(-math.pi, math.pi),
)
def test_the_tracks_turn_with_the_world_and_grow_with_her_speed(course, twd, speed, tws, turn):
    assume(math.cos(twd - course) > -1.0 + 1e-9)  # dead before the wind there is no side to shoot up on
    here = failed_tack((0.0, 0.0), course_rad=course, speed_mps=speed, twd_from_rad=twd, tws_mps=tws)
    there = failed_tack((0.0, 0.0), course_rad=course + turn, speed_mps=speed, twd_from_rad=twd + turn, tws_mps=tws)
    faster = failed_tack((0.0, 0.0), course_rad=course, speed_mps=2.0 * speed, twd_from_rad=twd, tws_mps=0.0)
    still = failed_tack((0.0, 0.0), course_rad=course, speed_mps=speed, twd_from_rad=twd, tws_mps=0.0)
    for a, b in zip(here, there, strict=True):
        rotated = np.column_stack(
            [a[:, 0] * math.cos(turn) + a[:, 1] * math.sin(turn), a[:, 1] * math.cos(turn) - a[:, 0] * math.sin(turn)]
        )
        assert rotated == pytest.approx(b, abs=1e-6)
    for a, b in zip(still, faster, strict=True):
        assert 2.0 * a == pytest.approx(b, abs=1e-9)


def test_a_current_carries_her_while_she_lies():
    still = failed_tack((0.0, 0.0), course_rad=0.8, speed_mps=2.0, twd_from_rad=0.0, tws_mps=5.0)
    moved = failed_tack(
        (0.0, 0.0), course_rad=0.8, speed_mps=2.0, twd_from_rad=0.0, tws_mps=5.0, current_en_mps=(0.5, 0.0)
    )
    assert moved[0][-1] - still[0][-1] == pytest.approx([5.0, 0.0])


@given(course=st.floats(-math.pi, math.pi), twd=st.floats(-math.pi, math.pi), tws=st.floats(0.0, 15.0))
def test_she_is_set_abeam_to_the_lee_of_her_old_tack(course, twd, tws):
    assume(abs(math.sin(twd - course)) > 1e-6)
    east, north = lee_set(course_rad=course, twd_from_rad=twd, lee_mps=SET_SHARE * tws)
    assert math.hypot(east, north) == pytest.approx(SET_SHARE * tws)
    assert east * math.sin(twd) + north * math.cos(twd) == pytest.approx(0.0, abs=1e-9)
    assert east * math.sin(course) + north * math.cos(course) >= -1e-9  # farther on, never back


def test_the_set_is_what_the_simulators_hull_makes_with_five_degrees_of_leeway():
    eased = side_mps(coefficient_of(math.radians(5.0)), 6.0, IRONS_RAD, 0.0, math.pi, 0.3)
    assert abs(eased) == pytest.approx(SET_SHARE * 6.0, rel=0.05)

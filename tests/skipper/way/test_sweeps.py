"""Sweeps: across the wind, to leeward, over everything; what a track covers; what is left."""

import itertools
import math

import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from shapely import affinity

from companion.geo.angles import difference_rad
from companion.skipper.way.geometry import bearing_rad, distance_m
from companion.skipper.way.sweeps import coverage, grown, is_off, left_over, length_m, sweeps_over

FIELD = shapely.box(0.0, 0.0, 200.0, 100.0)
ROCK = shapely.box(90.0, 40.0, 110.0, 60.0)
twd = st.floats(-math.pi, math.pi)
shapes = st.builds(
    lambda w, h, turn: affinity.rotate(shapely.box(0.0, 0.0, w, h), turn, use_radians=True),
    st.floats(60.0, 400.0),
    st.floats(60.0, 400.0),
    st.floats(0.0, 3.0),
)


def sailed(sweeps):
    return tuple(end for sweep in sweeps for end in sweep)


@given(area=shapes, wind=twd, swath=st.floats(12.0, 50.0))
def test_every_sweep_is_a_beam_reach(area, wind, swath):
    for a, b in sweeps_over(area, swath, wind, (0.0, 0.0)):
        assert abs(abs(difference_rad(bearing_rad(a, b), wind)) - math.pi / 2.0) < 0.02 or distance_m(a, b) < 2.0


@given(area=shapes, wind=twd, swath=st.floats(12.0, 50.0))
def test_sailed_as_they_are_laid_they_cover_most_and_lie_in_it(area, wind, swath):
    sweeps = sweeps_over(area, swath, wind, (0.0, 0.0))
    assert coverage(area, sailed(sweeps), swath) > 0.9  # corners beside a slanting edge are laid again
    assert all(area.buffer(0.1).covers(shapely.LineString(sweep)) for sweep in sweeps)


@given(area=shapes, wind=twd)
def test_each_step_leads_to_leeward_and_each_sweep_begins_at_the_near_end(area, wind):
    sweeps = sweeps_over(area, 25.0, wind, (-500.0, 300.0))
    up = (math.sin(wind), math.cos(wind))
    heights = [a[0] * up[0] + a[1] * up[1] for a, _ in sweeps]
    assert heights == sorted(heights, reverse=True)
    for (_a, b), (c, d) in itertools.pairwise(sweeps):
        assert distance_m(b, c) <= distance_m(b, d) + 1.0


def test_round_a_rock_the_sweeps_are_cut_and_do_not_touch_it():
    water = shapely.difference(FIELD, ROCK)
    sweeps = sweeps_over(water, 20.0, 0.0, (0.0, 0.0))
    assert not any(shapely.LineString(s).crosses(ROCK.buffer(-0.1)) for s in sweeps)
    assert len(sweeps) > len(sweeps_over(FIELD, 20.0, 0.0, (0.0, 0.0)))


def test_nothing_to_search_is_no_sweeps():
    assert sweeps_over(shapely.Polygon(), 20.0, 0.0, (0.0, 0.0)) == ()


def test_what_is_left_is_what_the_track_did_not_see():
    track = ((0.0, 10.0), (200.0, 10.0), (200.0, 30.0), (0.0, 30.0))
    assert coverage(FIELD, track, 20.0) == pytest.approx(0.4, abs=0.01)
    rest = left_over(FIELD, track, 20.0)
    assert rest.area == pytest.approx(12000.0, rel=0.02)
    assert length_m(sweeps_over(rest, 20.0, 0.0, (0.0, 30.0))) == pytest.approx(800.0, rel=0.02)
    assert left_over(
        FIELD, (*track, (0.0, 50.0), (200.0, 50.0), (200.0, 70.0), (0.0, 70.0), (0.0, 90.0), (200.0, 90.0)), 20.0
    ).is_empty


def test_a_gap_between_two_sweeps_is_found_and_a_sliver_is_none():
    wide = ((0.0, 10.0), (200.0, 10.0), (200.0, 42.0), (0.0, 42.0))
    assert left_over(shapely.box(0.0, 0.0, 200.0, 52.0), wide, 20.0).area == pytest.approx(2400.0, rel=0.1)
    narrow = ((0.0, 10.0), (200.0, 10.0), (200.0, 32.0), (0.0, 32.0))
    assert left_over(shapely.box(0.0, 0.0, 200.0, 42.0), narrow, 20.0).is_empty


@given(a=twd, b=twd)
def test_a_reversed_wind_is_as_good(a, b):
    assert is_off(a, b) == is_off(a + math.pi, b) == is_off(b, a)


def test_the_wind_must_turn_far():
    assert not is_off(math.radians(25.0), 0.0)
    assert is_off(math.radians(40.0), 0.0)
    assert is_off(math.radians(90.0), 0.0)


def test_a_track_grows_by_a_quarter_of_the_swath_and_keeps_its_corners():
    track = grown((), (0.0, 0.0), 20.0)
    assert grown(track, (3.0, 0.0), 20.0) == track
    for east in range(6, 60, 6):
        track = grown(track, (float(east), 0.2), 20.0)
    assert track == ((0.0, 0.0), (54.0, 0.2))
    assert grown(track, (54.0, 8.0), 20.0) == (*track, (54.0, 8.0))


WINDING = [
    0,
    0,
    0,
    0,
    -0.25,
    0,
    -0.34375,
    0.3125,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0.25,
    0,
    0,
    0,
    0,
    0,
]  # its end was counted against it


@given(st.lists(st.floats(-0.4, 0.4), min_size=30, max_size=120))
@example(WINDING)
def test_a_thinned_track_covers_what_the_whole_one_does(turns):
    here, heading, whole, thin = (0.0, 0.0), 0.0, [], ()
    for turn in turns:
        heading += turn
        here = (here[0] + 4.0 * math.sin(heading), here[1] + 4.0 * math.cos(heading))
        whole.append(here)
        thin = grown(thin, here, 20.0)
    # the thin one ends up to a quarter of the swath behind
    field = shapely.buffer(shapely.LineString(whole[:-2]), 10.0)
    assert coverage(field, thin, 20.0) > 0.95

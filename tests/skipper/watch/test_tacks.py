"""Tacks watched: what comes off and what fails is counted once, shifts are no tacks, the chance is learned."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.boat.failed_tack import SHOOT_S
from companion.skipper.step.saved import MOST_IRONS_S, MOST_LEE_MPS
from companion.skipper.step.state import NO_TACKS, PRIOR_TACKS, Tacking
from companion.skipper.watch.tacks import LIES_S, after_failure, followed

D = math.radians


def seen(headings_deg, twd_deg=0.0, step_s=1.0, begin=NO_TACKS, speeds_mps=None):
    """Return what is known after headings, one a step."""
    now = begin
    for n, heading in enumerate(headings_deg):
        twd = twd_deg(n) if callable(twd_deg) else twd_deg
        now = followed(now, step_s * n, D(heading), D(twd), 2.0 if speeds_mps is None else speeds_mps[n])
    return now


GOOD = [45, 45, 45, 25, -5, -35, -45, -45]
FAILED = [45, 45, 45, 25, 12, 14, 15, 15, 15, 30, 50, 50]


@pytest.mark.parametrize(
    ("headings", "tried", "failed"),
    [
        (GOOD, 1, 0),
        ([45, 45, -45, -45], 1, 0),
        ([45, 20, -40], 1, 0),
        (FAILED, 1, 1),
        (FAILED + GOOD, 2, 1),
        ([45, 45, 12] + [14] * 15 + [50, 50], 1, 1),
        ([45, 45, 12] + [14] * 15 + [-40, -45], 1, 1),
        ([45, 45, 45, 25, 12, 10, 30, 45], 0, 0),
        ([150, 150, 180, -150, -150], 0, 0),
        ([45, 60, 90, 120, 150], 0, 0),
        ([90, 60, 45, 60], 0, 0),
        ([], 0, 0),
    ],
)
def test_each_tack_is_counted_once_and_gybes_and_bearing_away_are_none(headings, tried, failed):
    for side in (1, -1):
        now = seen([side * h for h in headings])
        assert (now.tried, now.failed) == (tried, failed)


@pytest.mark.parametrize(("least_mps", "failed"), [(1.2, 0), (0.6, 1)])
def test_who_is_back_soon_was_told_otherwise_unless_she_had_stopped(least_mps, failed):
    headings = [45, 45, 45, 25, 12, 10, 12, 45, 45]
    now = seen(headings, speeds_mps=[2.4, 2.4, 2.4, 1.9, 1.5, least_mps, least_mps, 1.3, 2.0])
    assert (now.tried, now.failed) == (failed, failed)


@pytest.mark.parametrize(("lain_mps", "failed"), [(1.2, 0), (0.5, 1)])
def test_who_stops_short_of_the_wind_has_failed_as_a_turned_vane_has_it(lain_mps, failed):
    headings = [45, 45, 45, 30, 24, 24, 24, 24, 45, 45]  # never within 20 degrees of the wind that is measured
    now = seen(headings, speeds_mps=[2.0, 2.0, 2.0, 1.3, lain_mps, lain_mps, lain_mps, lain_mps, 1.3, 2.0])
    assert (now.tried, now.failed) == (failed, failed)


def test_a_wind_that_heads_her_is_no_tack_and_one_that_she_follows_is_none():
    heads = seen([-45] * 6 + [-52, -60, -65, -65], lambda n: 0.0 if n < 3 else -28.0)
    assert heads.tried == 0
    lifts = seen([-45, -40, -30, -20, -10, -5], lambda n: 0.0 + 8.0 * n)
    assert lifts.tried == 0


@given(turn=st.floats(-180.0, 180.0), headings=st.sampled_from([GOOD, FAILED, FAILED + GOOD]))
def test_what_is_counted_does_not_hang_on_where_the_wind_is_from(turn, headings):
    assert seen([h + turn for h in headings], turn).tried == seen(headings).tried
    assert seen([h + turn for h in headings], turn).failed == seen(headings).failed


@given(
    twd=st.floats(-math.pi, math.pi),
    is_starboard=st.booleans(),
    span_s=st.floats(LIES_S, 30.0),
    lee_mps=st.floats(0.0, 0.9),
    east_mps=st.floats(-0.5, 0.5),
    north_mps=st.floats(-0.5, 0.5),
)
def test_a_failure_tells_how_long_she_lay_and_how_she_was_set_beside_the_current_and_her_way(
    twd, is_starboard, span_s, lee_mps, east_mps, north_mps
):
    side = 1 if is_starboard else -1
    course, way_mps = twd - side * D(45.0), 2.0
    up, abeam = course + side * D(22.5), twd - side * D(90.0)
    shot_m = SHOOT_S * way_mps
    east_m = 7.0 + shot_m * math.sin(up) + span_s * (east_mps + lee_mps * math.sin(abeam))
    north_m = -3.0 + shot_m * math.cos(up) + span_s * (north_mps + lee_mps * math.cos(abeam))
    began = Tacking(side=side, settled_rad=course, settled_mps=way_mps, began_s=100.0, began_en_m=(7.0, -3.0))

    def ended(boat_en_m):
        return after_failure(began, NO_TACKS, 100.0 + span_s, boat_en_m, twd, (east_mps, north_mps))

    now = ended((east_m, north_m))
    told, other = (now.starboard_lee_mps, now.port_lee_mps)[::side]
    assert now.irons_s == pytest.approx(span_s)
    assert told == pytest.approx(lee_mps, abs=1e-9)
    assert other == 0.0
    assert ended(None).irons_s == now.irons_s  # no position: how long, and nothing more
    assert ended((1e6, 1e6)).starboard_lee_mps <= MOST_LEE_MPS  # it jumped
    assert after_failure(began, NO_TACKS, 1000.0, None, twd, (0.0, 0.0)).irons_s == MOST_IRONS_S  # a lull
    shorter = after_failure(began, now, 101.0, (7.0, -3.0), twd, (0.0, 0.0))
    assert (shorter.irons_s, shorter.starboard_lee_mps, shorter.port_lee_mps) == (
        now.irons_s,
        now.starboard_lee_mps,
        now.port_lee_mps,
    )  # the longest and the fastest of the voyage


@pytest.mark.parametrize(("turned_deg", "tried"), [(31.0, 1), (29.0, 0)])
@pytest.mark.parametrize("side", [1, -1])
def test_a_tack_between_two_looks_is_a_turn_of_30_degrees_of_her_own(turned_deg, tried, side):
    """The wind has come round as well: on the other side of it she is by her turn, or by the wind's."""
    now = seen([side * h for h in (45, 45, 45 - turned_deg)], lambda n: 0.0 if n < 2 else side * (77.0 - turned_deg))
    assert now.tried == tried


@pytest.mark.parametrize(("lain_s", "failed"), [(8, 1), (7, 0)])
def test_who_lies_near_the_wind_for_eight_seconds_has_failed(lain_s, failed):
    assert seen([45, 45] + [12] * (lain_s + 1)).failed == failed


def test_a_row_of_failures_ends_with_a_tack_that_comes_off():
    assert seen(FAILED + FAILED).in_a_row == 2
    assert seen(FAILED + FAILED + GOOD).in_a_row == 0


@given(given_p=st.floats(0.01, 0.9), tried=st.integers(0, 500), failed=st.integers(0, 500))
def test_the_chance_is_between_the_missions_and_what_was_seen_and_surer_the_more_was(given_p, tried, failed):
    failed = min(failed, tried)
    now = Tacking(tried=tried, failed=failed)
    chance = now.chance(given_p)
    low, high = sorted((given_p, failed / tried if tried else given_p))
    assert low - 1e-9 <= chance <= high + 1e-9
    assert 0.0 < chance < 1.0
    more = Tacking(tried=10 * tried, failed=10 * failed)
    assert more.spread(given_p) <= now.spread(given_p) + 0.06
    assert now.chance(0.0) == 0.0
    assert Tacking().chance(given_p) == pytest.approx(given_p)


def test_the_posterior_is_that_of_bayes():
    """Beta(a, b) with the mission's share of PRIOR_TACKS, after 3 failures in 10: its mean, by integration."""
    import numpy as np

    a, b = 0.1 * PRIOR_TACKS, 0.9 * PRIOR_TACKS
    p = np.linspace(1e-6, 1.0 - 1e-6, 200_001)
    weight = p ** (a - 1.0 + 3.0) * (1.0 - p) ** (b - 1.0 + 7.0)
    mean = float(np.sum(p * weight) / np.sum(weight))
    spread = math.sqrt(float(np.sum((p - mean) ** 2 * weight) / np.sum(weight)))
    now = Tacking(tried=10, failed=3)
    assert now.chance(0.1) == pytest.approx(mean, abs=1e-4)
    assert now.spread(0.1) == pytest.approx(spread, abs=1e-4)


def test_a_yaw_beyond_30_degrees_while_she_lies_is_no_end_of_it():
    headings = [45, 45, 17, 18, 33, 15, 12, 20, 45, 50]
    speeds = [2.1, 2.1, 1.5, 0.8, 0.7, 0.7, 0.6, 0.7, 1.0, 1.8]
    for side in (1, -1):
        now = seen([side * h for h in headings], speeds_mps=speeds)
        assert (now.tried, now.failed) == (1, 1)


@pytest.mark.parametrize(("lain_s", "failed"), [(19, 1), (20, 2), (32, 3)])
def test_who_lies_on_without_ever_being_settled_has_failed_again(lain_s, failed):
    now = seen([45, 45] + [12, 14, 13, 25] * 12, speeds_mps=[2.0, 2.0] + [0.3] * 48)
    assert seen(([45, 45] + [12, 14, 13, 25] * 12)[: lain_s + 3], speeds_mps=[2.0, 2.0] + [0.3] * 48).failed == failed
    assert now.in_a_row == now.failed

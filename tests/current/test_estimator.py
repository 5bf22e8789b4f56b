"""The estimate of the current against a boat whose water, polar, leeway, compass and vane are known."""

import math
import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import ardurover_sitl
from companion.current import STILL, CurrentEstimator, Prior, Sailing, TableRow, over_water

POLAR = ardurover_sitl()
TWD, TWS = 0.0, 5.0


def turned_vane(now, by_rad):
    """Return the moment as a boat has it whose vane is turned clockwise: the wind that she feels, turned."""
    east, north = now.velocity_en_mps
    felt_e = now.tws_mps * math.sin(now.twd_from_rad) + east
    felt_n = now.tws_mps * math.cos(now.twd_from_rad) + north
    from_e = math.cos(by_rad) * felt_e + math.sin(by_rad) * felt_n - east
    from_n = math.cos(by_rad) * felt_n - math.sin(by_rad) * felt_e - north
    return replace(now, twd_from_rad=math.atan2(from_e, from_n), tws_mps=math.hypot(from_e, from_n))


def reading(t_s, heading_deg, current, *, scale=1.0, leeway_deg=0.0, vane_deg=0.0, noise=0.0, rng=None, is_driven=True):
    """Return what a boat of this polar tells on a heading."""
    heading = math.radians(heading_deg)
    from_rad, tws = over_water(TWD, TWS, current)
    twa = (from_rad - heading + math.pi) % (2.0 * math.pi) - math.pi
    v = scale * POLAR.speed_mps(twa, tws)
    course = heading - math.copysign(math.radians(leeway_deg), twa)
    jolt = (rng.gauss(0.0, noise), rng.gauss(0.0, noise)) if rng else (0.0, 0.0)
    now = Sailing(
        t_s=t_s,
        velocity_en_mps=(v * math.sin(course) + current[0] + jolt[0], v * math.cos(course) + current[1] + jolt[1]),
        heading_rad=heading,
        twd_from_rad=TWD,
        tws_mps=TWS,
        is_driven=is_driven,
    )
    return turned_vane(now, math.radians(vane_deg)) if vane_deg else now


def sailed(headings_deg, current, *, leg_s=100.0, prior=STILL, **boat):
    """Return the estimator after a leg on each heading."""
    estimator, rng, t_s = CurrentEstimator(POLAR.speed_mps, prior), random.Random(1), 0.0
    for heading_deg in headings_deg:
        for _ in range(int(leg_s)):
            t_s += 1.0
            estimator.update(t_s, None, reading(t_s, heading_deg, current, rng=rng, **boat))
    return estimator


@settings(max_examples=30)
@given(st.floats(0.0, 6.28), st.floats(0.2, 0.9))
def test_on_both_tacks_and_a_reach_it_is_found_whichever_way_it_sets(set_rad, drift_mps):
    current = drift_mps * math.sin(set_rad), drift_mps * math.cos(set_rad)
    found = sailed((55.0, -55.0, 100.0, -100.0), current, noise=0.05).view()
    assert math.dist(found.en_mps, current) < 0.12
    assert found.sigma_mps < 0.16


def test_on_one_tack_it_is_wide_and_says_so():
    one, both = sailed((50.0,), (0.0, 0.3)).view(), sailed((50.0, -50.0), (0.0, 0.3)).view()
    assert one.sigma_mps > 1.5 * both.sigma_mps
    assert not one.is_significant, "along one heading a polar's error looks the same"
    assert "one heading" in one.sentence()
    assert "one heading" not in both.sentence()


@pytest.mark.parametrize("boat", [{"scale": 0.85}, {"scale": 1.15}, {"leeway_deg": 5.0}])
def test_in_still_water_no_error_of_the_boat_is_taken_for_a_current(boat):
    for headings in ((50.0,), (50.0, -50.0), (60.0, -60.0, 120.0)):
        assert not sailed(headings, (0.0, 0.0), noise=0.05, **boat).view().is_significant


@settings(max_examples=20)
@given(st.floats(0.88, 1.12), st.floats(-3.0, 3.0), st.floats(0.0, 6.28), st.integers(0, 999))
def test_the_stated_spread_holds_what_it_should(scale, leeway_deg, set_rad, seed):
    current = 0.4 * math.sin(set_rad), 0.4 * math.cos(set_rad)
    estimator, rng, t_s = CurrentEstimator(POLAR.speed_mps), random.Random(seed), 0.0
    for heading_deg in (48.0, -48.0, 48.0):
        for _ in range(80):
            t_s += 1.0
            estimator.update(
                t_s, None, reading(t_s, heading_deg, current, scale=scale, leeway_deg=leeway_deg, noise=0.08, rng=rng)
            )
    found = estimator.view()
    assert math.dist(found.en_mps, current) < 3.0 * found.sigma_mps


def test_it_is_the_same_however_often_it_is_looked_at_and_asked_for_nothing_new():
    a, b = sailed((55.0, -55.0), (0.3, 0.1)), sailed((55.0, -55.0), (0.3, 0.1))
    for _ in range(5):
        a.view()
    assert a.view() == b.view()


def circled(current, seconds, *, estimator=None, begin_s=0.0, late_s=0.0, **boat):
    """Return the estimator after circles of half a minute, as a boat that is held in a loiter sails them."""
    estimator = estimator or CurrentEstimator(POLAR.speed_mps)
    for n in range(int(seconds)):
        t_s = begin_s + n
        now, before = (reading(t, 12.0 * t, current, **boat) for t in (t_s, t_s - late_s))
        estimator.update(t_s, None, replace(now, velocity_en_mps=before.velocity_en_mps))
    return estimator


@pytest.mark.parametrize("boat", [{}, {"scale": 0.6}, {"leeway_deg": 3.0}, {"late_s": 0.4}])
def test_a_boat_that_is_held_in_circles_tells_what_sets_it_across_whatever_its_speed(boat):
    found, still = circled((0.5, 0.0), 300, **boat).view(), circled((0.0, 0.0), 300, **boat).view()
    assert math.dist(found.en_mps, (0.5, 0.0)) < 0.15
    assert math.hypot(*still.en_mps) < 0.15
    assert not still.is_significant


def test_a_stream_that_ended_while_it_was_waited_for_is_not_believed_for_ever():
    estimator = sailed((60.0, -60.0, 100.0, -100.0), (0.0, -1.2))
    assert estimator.view().drift_mps > 1.0
    assert circled((0.0, 0.0), 300, estimator=estimator, begin_s=401.0).view().drift_mps < 0.35


def doubted_motion(told_turned_deg):
    """Return an estimator that doubts wind or water: the boat goes astern by the wind that it is told."""
    estimator = sailed((60.0, -60.0, 100.0, -100.0), (0.0, 0.0))
    for t in range(400, 440):
        now = reading(float(t), 100.0, (0.0, 0.0))
        estimator.update(float(t), None, replace(now, velocity_en_mps=(-0.8, 0.0)))
    assert estimator.motion_doubt
    assert not estimator.doubts_wind
    for t in range(440, 740):
        now = reading(float(t), 12.0 * t, (0.0, 0.0))
        estimator.update(float(t), None, replace(now, twd_from_rad=TWD + math.radians(told_turned_deg)))
    return estimator


def test_a_doubt_ends_in_circles_that_are_sailed_as_they_should_be_and_in_no_others():
    assert not doubted_motion(0.0).motion_doubt
    assert doubted_motion(150.0).motion_doubt


@pytest.mark.parametrize(("velocity", "doubts"), [((-1.1, 0.0), True), ((2.2, 0.0), False)])
def test_a_frozen_vane_is_held_against_how_she_moves_and_teaches_nothing(velocity, doubts):
    """The wind had veered, the sheet went by the old one: driven astern for 22 minutes, and nobody was told."""
    estimator = sailed((60.0, -60.0, 100.0, -100.0), (0.0, 0.0))
    before = estimator.view().samples_s
    for t in range(400, 440):
        now = replace(reading(float(t), 90.0, (0.0, 0.0)), is_heard=False, velocity_en_mps=velocity)
        estimator.update(float(t), None, now)
    assert ("the vane is not believed, and she made 1.1 m/s astern" in estimator.motion_doubt) is doubts
    assert estimator.doubts_wind is doubts
    assert estimator.view().samples_s == before


def test_turns_stops_and_sails_that_are_eased_teach_nothing():
    estimator = circled((0.5, 0.0), 30)
    assert estimator.view().samples_s == 0.0, "a manoeuvre"
    for t in range(30, 240):
        estimator.update(float(t), None, reading(float(t), 60.0, (0.5, 0.0), is_driven=False))
    assert estimator.view().samples_s == 0.0
    circled((0.5, 0.0), 29, estimator=estimator, begin_s=240.0)
    assert estimator.view().samples_s == 0.0, "a start: turning counts from when she is driven"
    aground = reading(0.0, 60.0, (0.0, 0.0))
    for t in range(270, 430):
        estimator.update(
            float(t),
            None,
            Sailing(
                t_s=float(t),
                velocity_en_mps=(0.01, 0.0),
                heading_rad=aground.heading_rad,
                twd_from_rad=TWD,
                tws_mps=TWS,
                is_driven=True,
            ),
        )
    assert estimator.view().samples_s == 0.0, "a boat that stands is not carried by its own speed backwards"


def test_what_a_guessed_polar_is_off_by_is_the_boats():
    """Twice as fast as the guess of a file: a current of 1.2 m/s was told, and then the wind doubted, for ever."""
    told = {}
    for error in (0.0, 0.35):
        told[error] = estimator = CurrentEstimator(lambda *wind: POLAR.speed_mps(*wind) / 2.1, speed_error=error)
        for t in range(400):
            estimator.update(float(t), None, reading(float(t), (60.0, 100.0, -60.0, -100.0)[t // 100], (0.0, 0.0)))
    assert told[0.0].motion_doubt
    assert not told[0.35].motion_doubt
    assert told[0.35].scale == pytest.approx(2.1, abs=0.15)
    assert told[0.35].view().drift_mps < 0.15


def test_a_stream_that_grows_until_it_holds_her_is_followed():
    """Over the ground she stood, and was taken to be aground: 0.53 m/s were believed of 0.75."""
    slow = POLAR.speed_mps(math.pi / 2.0, TWS)
    estimator = CurrentEstimator(lambda twa, tws: 0.8 / slow * POLAR.speed_mps(twa, tws))
    for t in range(600):
        current = (min(0.8, 0.002 * t), 0.0)
        now = reading(float(t), 270.0, current, scale=0.8 / slow)
        estimator.update(float(t), None, now)
    assert math.hypot(*now.velocity_en_mps) < 0.15
    assert math.dist(estimator.view().en_mps, current) < 0.12


@pytest.mark.parametrize("period_s", [2.0, 3.5, 5.0])
def test_a_bow_that_the_waves_swing_tells_of_it_too(period_s):
    """8 degrees to either side every few seconds: 10 to 25 degrees a second, faster than she tacks."""
    current, estimator, t_s = (0.3, -0.2), CurrentEstimator(POLAR.speed_mps), 0.0
    for heading_deg in (55.0, -55.0, 100.0):
        for _ in range(100):
            t_s += 1.0
            swing = math.radians(8.0) * math.sin(2.0 * math.pi * t_s / period_s + 0.7)
            now = reading(t_s, heading_deg, current)
            estimator.update(t_s, None, replace(now, heading_rad=now.heading_rad + swing))
    assert estimator.view().samples_s > 150.0
    assert math.dist(estimator.view().en_mps, current) < 0.1


def test_a_current_that_turns_is_followed():
    estimator, t_s = CurrentEstimator(POLAR.speed_mps), 0.0
    for current in ((0.4, 0.0), (-0.4, 0.0)):
        for _ in range(8):
            for heading_deg in (55.0, -55.0):
                for _ in range(90):
                    t_s += 1.0
                    estimator.update(t_s, None, reading(t_s, heading_deg, current))
        assert math.dist(estimator.view().en_mps, current) < 0.12


def test_a_tide_that_ends_within_a_minute_is_believed_within_three():
    estimator, t_s = CurrentEstimator(POLAR.speed_mps), 0.0
    for current, legs in (((0.0, -1.0), 6), ((0.0, 0.0), 2)):
        for n in range(legs):
            for _ in range(90):
                t_s += 1.0
                estimator.update(t_s, None, reading(t_s, (55.0, -55.0)[n % 2], current))
    assert estimator.view().drift_mps < 0.35
    assert estimator.view().sigma_mps > 0.1, "and is not yet sure of it"


def test_what_the_mission_expects_is_believed_until_the_track_tells_otherwise():
    prior = Prior(east_mps=0.5, sigma_mps=0.1)
    estimator = CurrentEstimator(POLAR.speed_mps, prior)
    estimator.update(0.0, None, None)
    assert estimator.view().en_mps == pytest.approx((0.5, 0.0))
    assert estimator.view().is_significant
    wrong = sailed((55.0, -55.0, 100.0, -100.0), (0.0, 0.0), leg_s=300.0, prior=prior).view()
    assert wrong.drift_mps < 0.15


def test_a_table_is_followed_and_its_end_widens():
    rows = (TableRow(utc_s=0.0, east_mps=0.6, north_mps=0.0), TableRow(utc_s=3600.0, east_mps=0.0, north_mps=0.0))
    estimator = CurrentEstimator(POLAR.speed_mps, Prior(rows=rows, sigma_mps=0.1, name="tide.csv"))
    seen = {}
    for t in range(0, 9000, 10):
        estimator.update(float(t), float(t), None)
        seen[t] = estimator.view()
    assert seen[1800].en_mps == pytest.approx((0.3, 0.0))
    assert seen[3590].sigma_mps < 0.11
    assert seen[7500].sigma_mps > 0.5
    assert "ended" in seen[7500].verdict


def test_a_table_without_the_time_is_said_and_taken_up_when_the_time_is_known():
    rows = (TableRow(utc_s=0.0, east_mps=0.6, north_mps=0.0), TableRow(utc_s=7200.0, east_mps=0.6, north_mps=0.0))
    estimator = CurrentEstimator(POLAR.speed_mps, Prior(rows=rows, sigma_mps=0.1, name="tide.csv"))
    for t in range(60):
        estimator.update(float(t), None, None)
    assert "before the time is known" in estimator.view().verdict
    assert estimator.view().sigma_mps > 0.5
    for t in range(60, 70):
        estimator.update(float(t), 100.0 + t, None)
    assert estimator.view().en_mps == pytest.approx((0.6, 0.0), abs=0.05)
    assert estimator.view().sigma_mps < 0.12
    assert not estimator.view().verdict

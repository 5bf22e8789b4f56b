"""A wind that her motion speaks against: a vane that was turned is no current, and a current is no turned vane."""

import math
import random
from dataclasses import replace
from itertools import pairwise

import pytest

from companion.boat import ardurover_sitl
from companion.current import CurrentEstimator, MotionCheck, MotionSample, Sailing, over_water
from tests.current.test_estimator import reading, turned_vane

POLAR = ardurover_sitl()
FIRST_S = 60.0  # she has sailed so long before anything happens


def sails(moments, estimator=None):
    """Return the estimator after these moments, and when its doubt began and ended [s]."""
    estimator = estimator or CurrentEstimator(POLAR.speed_mps)
    doubted = [(now.t_s, estimator.motion_doubt) for now in moments if estimator.update(now.t_s, None, now) is None]
    return estimator, [b[0] for a, b in pairwise(doubted) if bool(a[1]) != bool(b[1])]


def boat(t_s, heading_deg, along_mps, *, twd_deg=0.0, tws_mps=5.0, vane_deg=0.0, current=(0.0, 0.0), roll_rad=None):
    """Return a moment of a boat that makes ``along_mps`` through the water, whatever her polar says."""
    heading = math.radians(heading_deg)
    now = Sailing(
        t_s=t_s,
        velocity_en_mps=(along_mps * math.sin(heading) + current[0], along_mps * math.cos(heading) + current[1]),
        heading_rad=heading,
        twd_from_rad=math.radians(twd_deg),
        tws_mps=tws_mps,
        is_driven=True,
        roll_rad=roll_rad,
    )
    return turned_vane(now, math.radians(vane_deg)) if vane_deg else now


def beats(for_s, first_s=0.0, current=(0.0, 0.0), leg_s=60, noise=0.05, headings=(50.0, -50.0)):
    rng = random.Random(3)
    return [
        reading(first_s + t, headings[(t // leg_s) % len(headings)], current, noise=noise, rng=rng)
        for t in range(1, int(for_s) + 1)
    ]


def astern(for_s, vane_deg, *, first_s=FIRST_S, heading_deg=20.0):
    """A turned vane has her point into the wind with her sails eased: she drifts astern at 0.7 m/s."""
    return [boat(first_s + t, heading_deg, -0.7, vane_deg=vane_deg) for t in range(1, int(for_s) + 1)]


@pytest.mark.parametrize("vane_deg", [90.0, -90.0, 135.0, 180.0])
def test_a_vane_that_is_turned_under_way_is_doubted_within_twenty_seconds_and_never_a_current(vane_deg):
    estimator, when = sails([*beats(FIRST_S), *astern(300.0, vane_deg)])
    assert len(when) == 1
    assert FIRST_S < when[0] < FIRST_S + 20.0
    assert estimator.doubts_wind
    assert "leapt" in estimator.motion_doubt
    assert estimator.view().drift_mps < 0.1, "it was 2.6 m/s, and never doubted"
    assert not estimator.view().is_significant


def test_without_the_check_it_is_a_current_of_more_than_two_metres_a_second():
    estimator = CurrentEstimator(POLAR.speed_mps, checked=False)
    sails([*beats(FIRST_S), *astern(60.0, 90.0)], estimator)
    assert estimator.view().drift_mps > 2.0


def test_a_vane_that_was_wrong_from_the_first_is_doubted_without_a_leap_of_the_direction():
    estimator, when = sails(astern(200.0, 90.0, first_s=0.0))
    assert len(when) == 1
    assert not estimator.doubts_wind
    assert "astern" in estimator.motion_doubt


def test_a_vane_that_is_put_right_is_believed_again():
    moments = [*beats(FIRST_S), *astern(60.0, 90.0)]
    estimator, when = sails([*moments, *beats(60.0, first_s=moments[-1].t_s)])
    assert len(when) == 2
    assert when[1] - moments[-1].t_s < 40.0
    assert estimator.view().drift_mps < 0.1


def test_a_wind_that_seems_to_fit_on_one_heading_is_not_believed_for_that():
    """Turned by 135 degrees she runs where she believes to reach, at about the speed of that."""
    moments = [*beats(FIRST_S), *astern(40.0, -135.0)]
    speed = POLAR.speed_mps(math.radians(60.0), 4.0)
    runs = [boat(moments[-1].t_s + t, 180.0, speed, twd_deg=240.0, tws_mps=4.0) for t in range(1, 200)]
    estimator, when = sails([*moments, *runs])
    assert len(when) == 1
    assert estimator.doubts_wind


def test_a_front_by_which_she_sails_is_no_turned_vane():
    after = [replace(now, t_s=FIRST_S + now.t_s) for now in beats(200.0, headings=(160.0, 60.0))]
    turned = [
        boat(now.t_s, math.degrees(now.heading_rad), math.hypot(*now.velocity_en_mps), twd_deg=110.0) for now in after
    ]
    estimator, when = sails([*beats(FIRST_S), *turned])
    assert not when
    assert not estimator.motion_doubt


def loiters(for_s, twd_deg, *, share=1.0, first_s=FIRST_S):
    """Held, she reaches to and fro across the loiter's point for some seconds each, and turns."""
    speed = share * POLAR.speed_mps(math.radians(65.0), 5.0)
    moments, off = [], 65.0
    for t in range(1, int(for_s) + 1):
        if t % 6 == 0:
            off = -off
        moments.append(boat(first_s + t, twd_deg + off, speed, twd_deg=twd_deg))
    return moments


def test_a_front_in_which_she_is_held_is_believed_once_she_loiters_by_it():
    """Held by its leap alone she turns every few seconds: no row without a break is to be had there."""
    estimator, when = sails([*beats(FIRST_S), *loiters(600.0, 150.0)])
    assert len(when) == 2, "doubted, and believed"
    assert when[0] - FIRST_S < 20.0
    assert when[1] - when[0] < 400.0
    assert not estimator.motion_doubt


def test_a_loiter_that_is_not_sailed_as_the_wind_says_ends_no_doubt():
    estimator, when = sails([*beats(FIRST_S), *loiters(900.0, 150.0, share=0.2)])
    assert len(when) == 1
    assert estimator.doubts_wind


def test_a_loiter_of_which_a_third_is_not_sailed_as_the_wind_says_ends_no_doubt():
    moments = [
        replace(now, velocity_en_mps=(0.2 * now.velocity_en_mps[0], 0.2 * now.velocity_en_mps[1]))
        if n // 6 % 3 == 0
        else now
        for n, now in enumerate(loiters(900.0, 150.0))
    ]
    estimator, when = sails([*beats(FIRST_S), *moments])
    assert len(when) == 1
    assert estimator.doubts_wind


@pytest.mark.parametrize("current", [(0.0, -2.0), (1.5, 0.0), (-0.8, 0.8)])
def test_a_tide_that_sets_in_at_once_is_followed_as_it_was(current):
    """The water of foul-tide: it sets her across her headings, too."""
    moments = [*beats(FIRST_S), *beats(300.0, first_s=FIRST_S, current=current)]
    estimator, when = sails(moments)
    assert not when
    assert math.dist(estimator.view().en_mps, current) < 0.35


def test_a_current_that_only_lies_along_her_heading_is_doubted_until_other_headings_tell():
    foul = [boat(200.0 + t, 90.0, POLAR.speed_mps(math.radians(90.0), 5.0) - 2.0) for t in range(1, 60)]
    estimator, when = sails([*beats(200.0, headings=(50.0, -50.0, 90.0)), *foul])
    assert len(when) == 1, "two metres a second within a second"
    assert not estimator.doubts_wind
    current, moments = (-2.0, 0.0), []
    for n, heading_deg in enumerate((90.0, 150.0, -120.0, 90.0)):
        heading = math.radians(heading_deg)
        from_rad, tws_mps = over_water(0.0, 5.0, current)
        twa = math.remainder(from_rad - heading, 2.0 * math.pi)
        moments += [
            boat(foul[-1].t_s + 40.0 * n + t, heading_deg, POLAR.speed_mps(twa, tws_mps), current=current)
            for t in range(1, 41)
        ]
    sails(moments, estimator)
    assert not estimator.motion_doubt
    assert math.dist(estimator.view().en_mps, current) < 0.3


def test_new_water_is_believed_from_headings_that_alone_do_not_last():
    """She turns between the foul heading and another before either is sailed for long, as she does in a loiter."""
    current = (-2.0 * math.sin(math.radians(50.0)), -2.0 * math.cos(math.radians(50.0)))
    moments = beats(300.0, headings=(50.0, -50.0, 90.0, -90.0))
    moments += [reading(float(t), 50.0 if t < 340 or (t // 18) % 2 else 130.0, current) for t in range(301, 700)]
    estimator, when = sails(moments)
    assert len(when) == 2, "doubted, and believed"
    assert math.dist(estimator.view().en_mps, current) < 0.4


@pytest.mark.parametrize("off_deg", [60.0, 80.0, -100.0])
def test_a_compass_that_errs_is_no_turned_vane(off_deg):
    """It turns the wind's direction, and her track off her bow: she makes her speed, elsewhere."""
    good = beats(200.0, first_s=FIRST_S)
    wrong = [
        replace(now, heading_rad=now.heading_rad + math.radians(off_deg), twd_from_rad=math.radians(off_deg))
        for now in good
    ]
    estimator, when = sails([*beats(FIRST_S), *wrong])
    assert not when
    assert not estimator.doubts_wind


def test_heel_to_windward_tells_of_a_vane_whose_speed_does_not():
    speed = POLAR.speed_mps(math.radians(90.0), 5.0)

    def reaches(roll_deg):
        return [boat(t, -90.0, speed, roll_rad=math.radians(roll_deg)) for t in range(1, 90)]

    assert not sails(reaches(-15.0))[0].motion_doubt, "the wind over starboard heels her to port"
    heeled, _ = sails(reaches(15.0))
    assert "to windward" in heeled.motion_doubt
    assert heeled.doubts_wind


@pytest.mark.parametrize(
    "now",
    [
        MotionSample(
            along_mps=0.05,
            across_mps=0.0,
            speed_mps=2.2,
            twa_rad=1.2,
            twd_from_rad=0.0,
            tws_mps=5.0,
            heading_rad=-1.2,
            sigma_mps=0.2,
        ),  # aground, moored
        MotionSample(
            along_mps=-0.4,
            across_mps=0.0,
            speed_mps=1.2,
            twa_rad=0.5,
            twd_from_rad=0.0,
            tws_mps=5.0,
            heading_rad=-0.5,
            sigma_mps=0.2,
        ),  # in irons
        MotionSample(
            along_mps=-0.4,
            across_mps=0.0,
            speed_mps=2.2,
            twa_rad=1.2,
            twd_from_rad=0.0,
            tws_mps=1.0,
            heading_rad=-1.2,
            sigma_mps=0.2,
        ),  # hardly any wind
    ],
)
def test_who_stands_still_or_lies_in_irons_tells_nothing(now):
    check = MotionCheck()
    for t in range(200):
        check.update(float(t), now, now)
    assert not check.doubt
    assert check.fits_s == 0.0


def test_turning_all_the_time_tells_nothing():
    moments = [boat(float(t), 12.0 * t, -0.7) for t in range(200)]
    assert not sails(moments)[0].motion_doubt


@pytest.mark.parametrize("turned_deg", [130.0, 180.0, -140.0])
def test_a_direction_that_leaps_farther_than_a_wind_shifts_is_doubted_though_she_sails_as_fast(turned_deg):
    """On a reach the wind from the other side would have her sail alike: her motion tells nothing."""
    speed = POLAR.speed_mps(math.radians(90.0), 5.0)
    reach = [boat(float(t), 90.0, speed) for t in range(1, 80)]
    angle = math.radians(turned_deg - 90.0)
    after = [boat(80.0 + t, 90.0, POLAR.speed_mps(angle, 5.0), twd_deg=turned_deg) for t in range(60)]
    estimator, when = sails([*reach, *after])
    assert len(when) == 1
    assert when[0] < 80.0 + 10.0
    assert estimator.doubts_wind
    assert estimator.wind_before_rad == pytest.approx(0.0)
    assert estimator.view().drift_mps < 0.1
    sails([boat(140.0 + t, 90.0, speed) for t in range(40)], estimator)
    assert not estimator.motion_doubt, "put right"


def test_a_wind_that_shifts_by_less_is_none():
    speed = POLAR.speed_mps(math.radians(90.0), 5.0)
    reach = [boat(float(t), 90.0, speed) for t in range(1, 80)]
    after = [boat(80.0 + t, 210.0, speed, twd_deg=120.0) for t in range(60)]
    assert not sails([*reach, *after])[1]


def test_a_light_air_and_one_that_swings_about_have_no_direction_that_leaps():
    for tws_mps, twd_deg in ((1.0, lambda t: 180.0 * (t > 80)), (5.0, lambda t: 7.0 * t)):
        moments = [boat(float(t), 90.0, 0.0, twd_deg=twd_deg(t), tws_mps=tws_mps) for t in range(1, 160)]
        assert not sails(moments)[1]


def test_at_her_mooring_a_leap_is_doubted_until_it_has_stayed_for_ten_minutes():
    moments = [replace(boat(float(t), 90.0, 0.0, twd_deg=180.0 * (t > 80)), is_driven=False) for t in range(1, 800)]
    estimator, when = sails(moments)
    assert estimator.motion_doubt == ""
    assert len(when) == 2
    assert when[1] - when[0] == pytest.approx(600.0, abs=2.0)

"""Closest approach, prediction and the discs: each claimed bound against a sampled truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.traffic import LAKE, SEA, Alarm, cpa, predict
from companion.traffic.approach import alarm_of
from companion.traffic.occupancy import Keep, needed_radius_m, planning_discs
from companion.traffic.predict import motion_of, risk_factor
from tests.traffic.conftest import own, vessel

POINT = (0.5, 0.5, 0.5, 0.5)


def test_who_lies_still_is_there_when_a_plan_would_come_late_on_purpose() -> None:
    still = vessel((0.0, 0.0), None, 0.0, nav_status=5)
    discs = planning_discs([still], 0.0, Keep(horizon_s=600.0))
    assert discs[-1].until_s == math.inf
    before, last = discs[-2:]
    assert last.from_s == before.until_s == 600.0
    assert last.radius_at_m(600.0) == pytest.approx(before.radius_at_m(600.0))
    assert last.radius_at_m(9000.0) == last.radius_at_m(600.0)
    assert last.spread is not None
    assert before.spread is not None
    assert last.spread.sigma_m == pytest.approx(before.spread.sigma_m + 600.0 * before.spread.sigma_mps)
    sails = planning_discs([vessel((0.0, 0.0), 90.0, 2.0)], 0.0, Keep(horizon_s=600.0))
    assert max(d.until_s for d in sails) == 600.0


def test_a_crossing_by_hand() -> None:
    """We go north at 2 m/s from the origin, it goes west at 2 m/s from (200, 100): CPA 70.7 m after 75 s."""
    a = cpa(own(course_deg=0.0, radius_m=0.0), vessel((200.0, 100.0), 270.0, 2.0, size=(1e-6, 1e-6, 1e-6, 1e-6)), 0.0)
    assert a.time_s == pytest.approx(75.0)
    assert a.distance_m == pytest.approx(100.0 / math.sqrt(2.0), abs=1e-3)
    assert math.degrees(a.bearing_rad) == pytest.approx(63.43, abs=0.01)


def test_hull_and_antenna_count() -> None:
    """A ship 200 m long whose antenna is at the stern has its bow 200 m further on."""
    meeting = own((0.0, 500.0), 0.0, 0.0, radius_m=0.0)
    long_bow = cpa(meeting, vessel((0.0, 0.0), 0.0, 5.0, size=(200.0, 1e-6, 10.0, 10.0)), 0.0)
    long_stern = cpa(meeting, vessel((0.0, 0.0), 0.0, 5.0, size=(1e-6, 200.0, 10.0, 10.0)), 0.0)
    assert long_bow.now_m == pytest.approx(300.0, abs=0.01)
    assert long_stern.now_m == pytest.approx(500.0, abs=0.01)
    assert long_bow.time_s == pytest.approx(60.0, abs=0.01)
    lopsided = vessel((0.0, 0.0), 0.0, 5.0, size=(50.0, 50.0, 20.0, 5.0))
    port = cpa(own((-30.0, 0.0), 0.0, 0.0, radius_m=0.0), lopsided, 0.0)
    starboard = cpa(own((30.0, 0.0), 0.0, 0.0, radius_m=0.0), lopsided, 0.0)
    assert (port.now_m, starboard.now_m) == pytest.approx((10.0, 25.0))


def test_an_alarm_needs_both() -> None:
    near_late = cpa(own(speed_mps=0.0), vessel((0.0, 5000.0), 180.0, 2.0), 0.0)
    assert near_late.distance_m == 0.0
    assert alarm_of(near_late, SEA) is Alarm.NONE
    soon_far = cpa(own(speed_mps=0.0), vessel((800.0, 300.0), 180.0, 5.0), 0.0)
    assert soon_far.time_s < SEA.act_tcpa_s
    assert alarm_of(soon_far, SEA) is Alarm.NONE
    both = cpa(own(speed_mps=0.0), vessel((100.0, 900.0), 180.0, 5.0), 0.0)
    assert alarm_of(both, SEA) is Alarm.ACT
    assert alarm_of(both, LAKE) is Alarm.NONE


def test_on_top_of_us_is_a_touch_not_a_crash() -> None:
    a = cpa(own(), vessel((0.0, 0.0), None, None), 0.0)
    assert alarm_of(a, LAKE) is Alarm.TOUCH
    assert a.distance_m == 0.0
    (disc, *_) = planning_discs([vessel((0.0, 0.0), None, None)], 0.0)
    assert math.dist(own().en_m, disc.centre_en_m(0.0)) < disc.radius_at_m(0.0)


angle = st.floats(0.0, 359.0)
coordinate = st.floats(-2000.0, 2000.0)


@settings(max_examples=200)
@given(coordinate, coordinate, angle, st.floats(0.0, 12.0), angle, st.floats(0.0, 4.0), st.floats(2.0, 150.0))
def test_cpa_is_the_least_sampled_distance(
    x: float, y: float, course: float, speed: float, ours: float, v: float, bow: float
) -> None:
    ship = vessel((x, y), course, speed, size=(bow, 20.0, 6.0, 9.0))
    we = own(course_deg=ours, speed_mps=v, radius_m=1.0)
    a = cpa(we, ship, 0.0)
    t = np.linspace(0.0, 3.0 * max(a.time_s, 100.0), 4001)
    c = math.radians(course)
    cx, cy = ship.centre_en_m
    dx = we.velocity_en_mps[0] * t - cx - speed * math.sin(c) * t
    dy = we.velocity_en_mps[1] * t - cy - speed * math.cos(c) * t
    right, ahead = dx * math.cos(c) - dy * math.sin(c), dx * math.sin(c) + dy * math.cos(c)
    gap = np.hypot(np.maximum(0.0, np.abs(right) - 7.5), np.maximum(0.0, np.abs(ahead) - 0.5 * (bow + 20.0))) - 1.0
    least = max(0.0, float(gap.min()))
    assert a.distance_m <= least + 1e-6 * (1.0 + float(t[-1]))  # slower than a micrometre a second is at rest
    step = float(t[1]) * (speed + v)
    assert a.distance_m >= least - step
    assert a.time_s >= 0.0


@settings(max_examples=100)
@given(angle, st.floats(0.0, 12.0), st.floats(-0.1, 0.1), st.floats(0.0, 900.0), st.floats(0.0, 900.0))
def test_the_spread_only_grows(course: float, speed: float, turn: float, a: float, b: float) -> None:
    ship = vessel((0.0, 0.0), course, speed, turn_rate_radps=turn)
    early, late = predict(ship, min(a, b)), predict(ship, max(a, b))
    assert late.sigma_along_m >= early.sigma_along_m - 1e-9
    assert late.sigma_across_m >= early.sigma_across_m - 1e-9
    assert late.radius_m(0.01) >= early.radius_m(0.01) - 1e-9
    assert early.radius_m(0.001) > early.radius_m(0.1)


def test_age_class_and_turn_widen_the_prediction() -> None:
    def spread(**more: object) -> float:
        p = predict(vessel(**({"speed_mps": 5.0} | more)), 120.0)
        return max(p.sigma_along_m, p.sigma_across_m)

    assert spread(t_s=-300.0) > spread() > 0.0
    assert spread(is_class_b=True) > spread()
    assert spread(turn_rate_radps=0.05) > spread()
    assert spread(ship_type=30) > spread()
    assert spread(nav_status=1, speed_mps=0.0) < spread()


def test_risk_of_the_disc_against_drawn_positions() -> None:
    p = predict(vessel((0.0, 0.0), 30.0, 5.0, is_class_b=True), 200.0)
    rng = np.random.default_rng(1)
    drawn = rng.normal(0.0, (p.sigma_along_m, p.sigma_across_m), (200_000, 2))
    for risk in (0.1, 0.01):
        radius = p.radius_m(risk) - p.reach_m
        outside = np.mean(np.hypot(*drawn.T) > radius)
        assert outside <= risk


@settings(max_examples=150)
@given(
    angle,
    st.floats(0.0, 15.0),
    st.floats(-0.1, 0.1),
    st.floats(-120.0, 0.0),
    st.floats(0.0, 900.0),
    st.booleans(),
    st.floats(0.0, 0.5),
    st.sampled_from([0.1, 1e-3, 1e-6]),
)
def test_the_discs_hold_the_region_at_every_moment(
    course: float, speed: float, turn: float, heard: float, at: float, class_b: bool, timing: float, risk: float
) -> None:
    """What a planner keeps out of contains hull, clearance and k sigma about the predicted centre, at all times."""
    ship = vessel((50.0, -20.0), course, speed, turn_rate_radps=turn, is_class_b=class_b, t_s=heard)
    keep = Keep(sigmas=risk_factor(risk), own_timing_mps=timing)
    discs = [d for d in planning_discs([ship], 0.0, keep) if d.from_s - 1e-9 <= at <= d.until_s + 1e-9]
    assert discs
    there = predict(ship, at, motion_of(ship))
    needed = needed_radius_m(there, at, keep)
    covered = max(d.radius_at_m(at) - math.dist(d.centre_en_m(at), there.mean_en_m) for d in discs)
    assert covered >= needed - 1e-6


def test_ahead_bias_holds_the_plain_disc() -> None:
    ship = vessel((0.0, 0.0), 90.0, 5.0)
    plain, biased = planning_discs([ship], 0.0)[0], planning_discs([ship], 0.0, Keep(ahead_m=60.0))[0]
    assert biased.x_m == pytest.approx(plain.x_m + 30.0)
    assert biased.radius_at_m(0.0) >= plain.radius_at_m(0.0) + 30.0 - 1e-9


def test_risk_factor() -> None:
    assert math.exp(-0.5 * risk_factor(0.01) ** 2) == pytest.approx(0.01)
    with pytest.raises(ValueError, match="risk"):
        risk_factor(0.0)

"""Position integrity: what begins a doubt of the position, what is reckoned meanwhile, what ends it."""

import math
from dataclasses import replace

import pytest
import shapely

from companion.skipper.way.position_plausibility import (
    CONFIRMED_S,
    ERROR_M,
    LASTS_S,
    QUIET_S,
    Evidence,
    PositionDoubt,
    innovation_m,
    is_impossible,
)
from tests.skipper.world import area

HERE = Evidence(t_s=0.0, en_m=(500.0, 0.0), velocity_en_mps=(0.0, 2.0), room_m=40.0)


def doubt(**changes):
    return PositionDoubt(
        **{
            "since_s": 0.0,
            "t_s": 0.0,
            "reckoned_en_m": (0.0, 0.0),
            "velocity_en_mps": HERE.velocity_en_mps,
            "farthest_m": 500.0,
            "settled_s": 0.0,
            "why": "it jumped 500 m",
            **changes,
        }
    )


def lasting(begun, seconds, **changes):
    """Return the doubt after fixes that go on from ``HERE``, one a second, and the last of them."""
    seen = replace(HERE, **changes)
    for n in range(1, seconds + 1):
        east, north = HERE.velocity_en_mps
        seen = replace(seen, t_s=float(n), en_m=(500.0 + n * east, n * north))
        begun = begun.after(seen)
        if begun.believed_for(seen):
            break
    return begun, seen


def test_she_is_reckoned_on_by_the_velocity_that_is_reported_and_errs_a_little_more_each_second():
    after, _ = lasting(doubt(), 60)
    assert after.reckoned_en_m == pytest.approx((0.0, 120.0))
    assert 0.0 < after.error_m < 10.0
    assert after.farthest_m == pytest.approx(500.0)


def test_a_position_that_only_stays_is_believed_after_ten_minutes_and_no_sooner():
    after, seen = lasting(doubt(), 700)
    assert after.believed_for(seen)
    assert seen.t_s == pytest.approx(LASTS_S, abs=1.0)


@pytest.mark.parametrize(
    "against", [{"is_jump": True}, {"is_possible": False}, {"is_well": False}, {"second_en_m": (0.0, 0.0)}]
)
def test_what_speaks_against_itself_is_not_believed_however_long_it_stays(against):
    after, seen = lasting(doubt(), 1000, **against)
    assert not after.believed_for(seen)


def test_back_where_she_is_reckoned_it_is_believed_at_once():
    after, seen = lasting(doubt(), 60)
    back = replace(seen, t_s=61.0, en_m=(6.0, 128.0), is_jump=True)
    assert "back" in after.after(back).believed_for(back)
    elsewhere = replace(back, en_m=(60.0, 160.0))
    assert not after.after(elsewhere).believed_for(elsewhere)


def test_a_short_jump_is_not_back_because_it_was_short():
    short = doubt(farthest_m=14.0)
    assert not short.is_back((14.0, 0.0))
    assert short.is_back((6.0, 0.0))


def test_a_second_receiver_is_evidence_and_its_place_is_better_than_what_is_reckoned():
    after, seen = lasting(doubt(), 20, second_en_m=(30.0, 0.0))
    assert after.reckoned_en_m == (30.0, 0.0)
    agreed = doubt()
    for n in range(1, round(CONFIRMED_S) + 3):
        seen = replace(HERE, t_s=float(n), second_en_m=HERE.en_m)
        agreed = agreed.after(seen)
    assert "second receiver" in agreed.believed_for(seen)


@pytest.mark.parametrize(
    ("changes", "seen", "after_s"),
    [
        ({"lost_m": 600.0}, {}, QUIET_S),  # the filter had lost it: the earlier place was the guess
        ({"lost_m": 100.0}, {}, LASTS_S),  # ... which cannot have been so far off
        ({}, {"is_other_possible": False}, QUIET_S),
        ({}, {"is_given": True}, QUIET_S),
        ({}, {"room_m": math.inf}, QUIET_S),
    ],
)  # whatever is true, nothing is met
def test_what_is_evidence_enough_after_some_quiet_fixes(changes, seen, after_s):
    _, last = lasting(doubt(**changes), 700, **seen)
    assert last.t_s == pytest.approx(after_s, abs=1.0)


def test_a_place_is_impossible_only_deeper_in_something_solid_than_margin_and_error_explain():
    water = area(shapely.box(0.0, 0.0, 200.0, 200.0), limits=shapely.box(-1000.0, -1000.0, 300.0, 1000.0))
    assert is_impossible(water, (100.0, 100.0), margin_m=15.0)
    assert not is_impossible(water, (15.0 + ERROR_M - 1.0, 100.0), margin_m=15.0)
    assert not is_impossible(water, (-50.0, 0.0), margin_m=15.0)
    assert not is_impossible(water, (600.0, 0.0), margin_m=15.0)  # outside the fence there is water


AHEAD, BACK, RIGHT, STILL = (0.0, 2.0), (0.0, -2.0), (2.0, 0.0), (0.0, 0.2)


@pytest.mark.parametrize(
    ("way_en_m", "dt_s", "before_mps", "now_mps"),
    [
        ((0.0, 20.0), 10.0, AHEAD, AHEAD),  # sailed on
        ((20.0, 0.0), 20.0, AHEAD, BACK),  # turned round, and abeam of where she was
        ((18.0, 20.0), 20.0, AHEAD, RIGHT),
        ((0.0, 40.0), 60.0, RIGHT, RIGHT),  # beaten across: two tacks on end
        ((0.0, 100.0), 40.0, STILL, STILL),  # in irons at both ends, and sailed between them
    ],
)
def test_what_she_can_have_sailed_in_a_silence_is_no_jump(way_en_m, dt_s, before_mps, now_mps):
    assert innovation_m(way_en_m, dt_s, before_mps, now_mps, fastest_mps=5.0) == 0.0


@pytest.mark.parametrize(
    ("way_en_m", "dt_s", "is_held"),
    [
        ((70.0, 0.0), 15.0, False),  # across her way, 70 m in 15 s
        ((0.0, 80.0), 20.0, False),  # along it, at 4 m/s
        ((0.0, -40.0), 15.0, False),  # back, and still under way ahead
        ((60.0, 0.0), 40.0, True),  # a loiter does not go so far in any time
    ],
)
def test_what_she_cannot_have_sailed_in_a_silence_is_a_jump(way_en_m, dt_s, is_held):
    assert innovation_m(way_en_m, dt_s, AHEAD, AHEAD, fastest_mps=5.0, is_held=is_held) >= 10.0


def test_over_a_silence_she_is_reckoned_on_by_the_mean_of_both_speeds_and_may_have_turned():
    after = doubt(velocity_en_mps=(0.0, 1.0)).after(replace(HERE, t_s=20.0, velocity_en_mps=(0.0, 2.0)))
    assert after.reckoned_en_m == pytest.approx((0.0, 30.0))
    assert after.error_m == pytest.approx(60.0)

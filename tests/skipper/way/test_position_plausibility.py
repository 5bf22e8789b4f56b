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


# ------------------------------------------------------------------------- each threshold, on both sides of it
@pytest.mark.parametrize(
    ("way_en_m", "dt_s", "before_mps", "now_mps", "off_m"),
    [
        ((0.0, 60.0), 1.0, AHEAD, AHEAD, 57.0),  # at the faster of both and a metre a second more
        ((0.0, -60.0), 1.0, AHEAD, AHEAD, 59.0),  # from the way between ahead and ahead: 2 m farther
        ((0.0, 60.0), 2.0, AHEAD, (0.0, 3.0), 52.0),
        ((60.0, 0.0), 2.0, (3.0, 0.0), STILL, 52.0),
        ((0.0, 90.0), 3.0, STILL, STILL, 86.4),  # three seconds are no silence
        ((0.0, 90.0), 4.0, STILL, STILL, 66.0),  # in one she may have sailed at her fastest
        ((0.0, 90.0), 4.0, AHEAD, (0.0, 0.79), 66.0),
        ((0.0, 90.0), 4.0, AHEAD, (0.0, 0.8), 78.0),  # not who is under way at both ends
        ((3.0, 0.0), 1.0, AHEAD, AHEAD, math.hypot(3.0, 2.0) - 3.0),
        ((1.0, 1.0), 1.0, AHEAD, AHEAD, 0.0),
        ((-60.0, 0.0), 2.0, (3.0, 0.0), (3.0, 0.0), 58.0),
    ],
)
def test_how_much_farther_she_is_than_she_can_be(way_en_m, dt_s, before_mps, now_mps, off_m):
    assert innovation_m(way_en_m, dt_s, before_mps, now_mps, fastest_mps=5.0) == pytest.approx(off_m)


@pytest.mark.parametrize(
    ("dt_s", "way_m", "off_m"),
    [
        (2.0, 40.0, 34.0),  # a short while as whoever sails
        (40.0, 60.0, 15.0),  # else within 25 m of her place, and half a metre a second
        (40.0, 44.0, 0.0),
        (10.0, 40.0, 10.0),
    ],
)
def test_a_boat_that_is_held_strays_25_m_and_half_a_metre_a_second(dt_s, way_m, off_m):
    assert innovation_m((0.0, -way_m), dt_s, AHEAD, AHEAD, fastest_mps=5.0, is_held=True) == pytest.approx(off_m)


@pytest.mark.parametrize(("second", "agrees"), [((500.0, 15.0), True), ((515.1, 0.0), False), (None, None)])
def test_two_receivers_agree_within_15_m(second, agrees):
    seen = replace(HERE, second_en_m=second)
    assert (seen.is_confirmed, seen.is_contradicted) == ((False, False) if agrees is None else (agrees, not agrees))


@pytest.mark.parametrize(
    ("dt_s", "place", "error_m"),
    [(2.9, (2.9, 5.8), 0.145), (3.1, (3.1, 4.65), 3.1 * (math.hypot(1.0, 2.0) + 1.0)), (-1.0, (0.0, 0.0), 0.0)],
)
def test_a_fix_is_reckoned_by_its_own_velocity_and_a_silence_by_the_mean(dt_s, place, error_m):
    begun = doubt(velocity_en_mps=(1.0, 1.0), t_s=10.0)
    after = begun.after(replace(HERE, t_s=10.0 + dt_s, velocity_en_mps=(1.0, 2.0)))
    assert after.reckoned_en_m == pytest.approx(place)
    assert after.error_m == pytest.approx(error_m)
    assert after.t_s == max(10.0, 10.0 + dt_s)
    assert after.velocity_en_mps == (1.0, 2.0)


def test_a_silence_errs_by_the_faster_end():
    slow_then_fast = doubt(velocity_en_mps=(0.0, 1.0)).after(replace(HERE, t_s=10.0, velocity_en_mps=(3.0, 4.0)))
    fast_then_slow = doubt(velocity_en_mps=(3.0, 4.0)).after(replace(HERE, t_s=10.0, velocity_en_mps=(0.0, 1.0)))
    assert slow_then_fast.error_m == fast_then_slow.error_m == pytest.approx(60.0)
    assert slow_then_fast.reckoned_en_m == fast_then_slow.reckoned_en_m == pytest.approx((15.0, 25.0))


def test_a_doubt_begins_with_nothing_but_its_jump():
    begun = PositionDoubt(
        since_s=0.0, t_s=0.0, reckoned_en_m=(0.0, 0.0), velocity_en_mps=AHEAD, settled_s=0.0, why="it jumped"
    )
    assert (begun.error_m, begun.lost_m, begun.farthest_m, begun.confirmed_s, begun.is_dispute) == (
        0.0,
        0.0,
        0.0,
        None,
        False,
    )


def test_what_is_counted_from_fix_to_fix():
    quiet = doubt(settled_s=3.0, confirmed_s=4.0, farthest_m=10.0).after(replace(HERE, t_s=20.0))
    assert (quiet.settled_s, quiet.confirmed_s) == (3.0, None)
    assert quiet.farthest_m == pytest.approx(math.dist(quiet.reckoned_en_m, HERE.en_m))
    agreed = doubt(confirmed_s=4.0).after(replace(HERE, t_s=20.0, second_en_m=HERE.en_m))
    assert agreed.confirmed_s == 4.0
    assert doubt().after(replace(HERE, t_s=20.0, second_en_m=HERE.en_m)).confirmed_s == 20.0
    for against in ({"is_jump": True}, {"is_possible": False}, {"is_well": False}):
        after = doubt(confirmed_s=4.0).after(replace(HERE, t_s=20.0, second_en_m=HERE.en_m, **against))
        assert (after.settled_s, after.confirmed_s) == (20.0, None), against
    differs = doubt(confirmed_s=4.0).after(replace(HERE, t_s=20.0, second_en_m=(0.0, 7.0)))
    assert (differs.settled_s, differs.confirmed_s, differs.reckoned_en_m) == (20.0, None, (0.0, 7.0))


@pytest.mark.parametrize(("is_jump", "is_dispute"), [(False, True), (True, False)])
def test_a_dispute_of_receivers_ends_as_such_only_without_a_jump(is_jump, is_dispute):
    seen = replace(HERE, t_s=1.0, is_jump=is_jump)
    after = doubt(is_dispute=True).after(seen)
    assert after.is_dispute is is_dispute
    assert ("receivers agree" in after.believed_for(seen)) is is_dispute
    assert not doubt().after(seen).is_dispute


@pytest.mark.parametrize(
    ("off_m", "error_m", "farthest_m", "is_back"),
    [
        (15.0, 0.0, 500.0, True),
        (15.1, 0.0, 500.0, False),
        (40.0, 40.0, 500.0, True),  # as far as the reckoning may be off
        (40.1, 40.0, 500.0, False),
        (9.9, 0.0, 20.0, True),  # and nearer than half the way that it was off
        (10.0, 0.0, 20.0, False),
    ],
)
def test_back_is_where_the_reckoning_may_be_and_nearer_than_half_of_the_way(off_m, error_m, farthest_m, is_back):
    assert doubt(error_m=error_m, farthest_m=farthest_m).is_back((0.0, off_m)) is is_back


@pytest.mark.parametrize(
    ("state", "seen", "words"),
    [
        ({"lost_m": 500.0, "settled_s": 0.0}, {"t_s": 20.0}, "the filter had lost"),
        ({"lost_m": 500.0, "settled_s": 0.1}, {"t_s": 20.0}, ""),
        ({"lost_m": 499.0, "settled_s": 0.0}, {"t_s": 20.0}, ""),
        ({"lost_m": 0.0, "farthest_m": 0.0, "settled_s": 0.0}, {"t_s": 20.0}, ""),
        ({"lost_m": 0.5, "farthest_m": 0.5, "settled_s": 0.0}, {"t_s": 20.0}, "the filter had lost"),
        ({"confirmed_s": 0.0, "settled_s": 25.0}, {"t_s": 30.0}, "a second receiver"),
        ({"confirmed_s": 0.1, "settled_s": 25.0}, {"t_s": 30.0}, ""),
        ({}, {"t_s": 20.0, "is_given": True}, "a person"),
        ({}, {"t_s": 19.9, "is_given": True}, ""),
        ({}, {"t_s": 20.0, "is_other_possible": False}, "the reckoned place cannot be"),
        ({}, {"t_s": 20.0, "room_m": 1200.0}, "nothing solid"),
        ({}, {"t_s": 20.0, "room_m": 1199.0}, ""),
        ({}, {"t_s": 600.0}, "stayed for 10 minutes"),
        ({}, {"t_s": 599.9}, ""),
        ({}, {"t_s": 600.0, "is_possible": False}, ""),
        ({"is_dispute": True}, {"t_s": 1.0, "second_en_m": (0.0, 0.0)}, ""),
    ],
)
def test_why_it_is_believed_again_and_from_when_on(state, seen, words):
    found = doubt(**state).believed_for(replace(HERE, **seen))
    assert (words in found) if words else (found == "")


@pytest.mark.parametrize(("east_m", "deep"), [(19.9, False), (20.1, True)])
def test_margin_and_five_metres_are_the_most_that_error_explains(east_m, deep):
    water = area(shapely.box(0.0, 0.0, 200.0, 200.0))
    assert is_impossible(water, (east_m, 100.0), margin_m=15.0) is deep

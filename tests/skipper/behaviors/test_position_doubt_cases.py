"""A doubt of the position, case by case: what begins one, what is remembered for who comes after a kill."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.messages import Mode
from companion.skipper.behaviors.position_doubt import follow, is_other_shut, stands_off
from companion.skipper.step import StepContext
from companion.skipper.step.actions import Announce
from companion.skipper.step.saved import Persisted, SavedPlace
from companion.skipper.step.state import Fix
from companion.skipper.way.position_plausibility import PositionDoubt
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.world import FRAME

WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))
UTC_S = 1.7e9  # now, by the autopilot's clock


def seen(*, at=(0.0, 0.0), jumped_m=0.0, clock=True, status=None, **parts):
    """A fix at ``at``, a tenth of a second old, and ``jumped_m`` east of the last."""
    position = {"last_seen": Fix(t_s=NOW_S - 1.1, en_m=(at[0] - jumped_m, at[1]), velocity_en_mps=(2.0, 0.0))}
    ctx = moment(WAY, at=at, position=position | parts.pop("position", {}), **parts)
    told = {"utc_at_boot_s": UTC_S - 100.0 if clock else None, "boot_s": 100.0, "t_s": NOW_S} | (status or {})
    snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, **told))
    return StepContext(ctx.voyage, ctx.config, ctx.state, snapshot)


def doubted(ctx):
    follow(ctx)
    return ctx.state.position.doubt


def codes(ctx):
    return [a.code for a in ctx.actions if isinstance(a, Announce)]


@pytest.mark.parametrize(("jumped_m", "is_doubted"), [(0.0, False), (12.0, False), (14.0, True)])
def test_ten_metres_farther_than_she_can_have_come_begin_a_doubt(jumped_m, is_doubted):
    found = doubted(seen(jumped_m=jumped_m))  # of which she can have sailed three in a second
    assert (found is not None) is is_doubted
    if found is not None:
        assert "it jumped" in found.why
        assert found.reckoned_en_m == pytest.approx((-jumped_m + 2.0, 0.0), abs=0.1)
        assert (found.since_s, found.lost_m) == (NOW_S, 0.0)


@pytest.mark.parametrize(("lost_s", "lost_m"), [(2.9, 0.0), (3.0, 8.0), (60.0, 65.0)])
def test_a_filter_that_was_ill_may_have_erred_by_so_much(lost_s, lost_m):
    found = doubted(seen(jumped_m=40.0, position={"lost_s": NOW_S - lost_s}))
    assert found.lost_m == pytest.approx(lost_m)


@pytest.mark.parametrize(
    ("ekf_ok", "jumped_m", "lost_s", "then_s"),
    [
        (False, 0.0, None, NOW_S),
        (False, 0.0, NOW_S - 9.0, NOW_S - 9.0),
        (True, 0.0, NOW_S - 9.0, None),
        (True, 40.0, NOW_S - 9.0, NOW_S - 9.0),  # that may be what it erred by
        (True, 0.0, None, None),
    ],
)
def test_since_when_the_filter_has_had_no_position(ekf_ok, jumped_m, lost_s, then_s):
    ctx = seen(jumped_m=jumped_m, position={"lost_s": lost_s}, status={"ekf_ok": ekf_ok})
    follow(ctx)
    assert ctx.state.position.lost_s == then_s


@pytest.mark.parametrize(
    ("off_m", "since_s", "then_s", "is_doubted"),
    [
        (20.0, None, NOW_S, False),
        (20.0, NOW_S - 2.9, NOW_S - 2.9, False),
        (20.0, NOW_S - 3.0, NOW_S - 3.0, True),
        (14.0, NOW_S - 3.0, None, False),
        (None, NOW_S - 3.0, None, False),
    ],
)
def test_receivers_that_differ_for_three_seconds(off_m, since_s, then_s, is_doubted):
    second = None if off_m is None else FRAME.geo_from_en(off_m, 0.0)
    ctx = seen(position={"disputed_s": since_s}, status={"gps2": second})
    found = doubted(ctx)
    assert ctx.state.position.disputed_s == then_s
    assert (found is not None) is is_doubted
    if found is not None:
        assert (found.is_dispute, found.farthest_m) == (True, pytest.approx(off_m, abs=0.05))
        assert codes(ctx) == ["position doubted"]


@pytest.mark.parametrize(("deep_m", "is_doubted"), [(19.9, False), (20.1, True)])
def test_a_place_deep_inside_something_is_none(deep_m, is_doubted):
    found = doubted(seen(obstacles=(box(-deep_m, -400, 400, 400),)))
    assert (found is not None) is is_doubted
    if found is not None:
        assert "inside o0" in found.why
        assert found.error_m == pytest.approx(deep_m + 15.0)


# ------------------------------------------------------------------------------------------ before this start
def restarted(*, ago_s=60.0, off_m=0.0, farthest_m=0.0, clock=True, own_mode=None):
    place = SavedPlace(utc_s=UTC_S - ago_s, en_m=(-off_m, 0.0), velocity_en_mps=(2.0, 0.0), farthest_m=farthest_m)
    saved = Persisted(voyage="test", gate=0, sailing=True, route=WAY, pending=None, own_mode=own_mode)
    return seen(
        clock=clock, position={"restored": place, "last_seen": None}, mission={"route": WAY, "adoptable": saved}
    )


@pytest.mark.parametrize(
    ("change", "is_doubted"),
    [
        ({"off_m": 120.0}, False),  # sailed meanwhile
        ({"off_m": 185.0}, False),
        ({"off_m": 195.0}, True),  # by ten metres more than at 3 m/s
        ({"off_m": 195.0, "clock": False}, False),  # nobody knows for how long
        ({"off_m": 195.0, "ago_s": -10.0}, False),  # a clock that was set back
        ({"off_m": 500.0, "farthest_m": 50.0}, True),  # it was in doubt before
        ({"off_m": 120.0, "farthest_m": 50.0}, False),  # and is back where she is reckoned
        ({"off_m": 120.0, "farthest_m": 50.0, "ago_s": 601.0}, False),  # so long ago that it is over
    ],
)
def test_a_first_fix_is_held_against_where_she_was_before_this_start(change, is_doubted):
    ctx = restarted(**change)
    found = doubted(ctx)
    assert (found is not None) is is_doubted
    if found is not None:
        assert "before this start" in found.why
    known = change.get("clock", True)
    assert (ctx.state.position.restored is None) is (known or is_doubted)


# -------------------------------------------------------------------------------------------------- remembered
@pytest.mark.parametrize(
    ("ago_s", "rock_m", "saves"),
    [
        (30.0, None, True),
        (29.8, None, False),
        (5.0, 99.0, True),  # with something near, sooner
        (4.8, 99.0, False),
        (5.0, 101.0, False),
        (-30.2, None, True),
    ],
)
def test_where_she_is_is_saved_each_half_minute_and_oftener_near_something(ago_s, rock_m, saves):
    old = SavedPlace(utc_s=UTC_S - 0.1 - ago_s, en_m=(9.0, 9.0), velocity_en_mps=(0.0, 0.0))
    rocks = () if rock_m is None else (box(-50, rock_m, 50, rock_m + 50),)
    ctx = seen(position={"place": old}, obstacles=rocks)
    follow(ctx)
    place = ctx.state.position.place
    assert (place != old) is saves
    if saves:
        assert (place.en_m, place.velocity_en_mps, place.utc_s) == ((0.0, 0.0), (2.0, 0.0), round(UTC_S - 0.1, 1))
        assert (place.error_m, place.farthest_m) == (0.0, 0.0)


def test_a_doubt_is_saved_at_once_and_nothing_without_a_clock_or_a_voyage():
    old = SavedPlace(utc_s=UTC_S - 1.0, en_m=(9.0, 9.0), velocity_en_mps=(0.0, 0.0))
    ctx = seen(jumped_m=40.0, position={"place": old})
    follow(ctx)
    assert ctx.state.position.place.farthest_m == pytest.approx(38.0, abs=0.3)
    assert ctx.state.position.place.en_m[0] == pytest.approx(-38.0, abs=0.3)
    for change in ({"clock": False}, {"voyage": {"sailing": False}}):
        none = seen(jumped_m=40.0, position={"place": old}, **change)
        follow(none)
        assert none.state.position.place == old


# ------------------------------------------------------------------------------------------------- a shut way
@pytest.mark.parametrize(
    ("rock", "error_m", "speed_mps", "is_shut"),
    [
        (box(1040.0, -5.0, 1060.0, 5.0), 0.0, 2.0, True),  # from the reckoned place 40 m are sailed in 20 s
        (box(1049.0, -5.0, 1060.0, 5.0), 0.0, 2.0, False),  # and the floor's 8 m
        (box(1049.0, -5.0, 1060.0, 5.0), 2.0, 2.0, True),  # and what it may err by
        (box(1027.0, -5.0, 1060.0, 5.0), 0.0, 0.1, True),  # at 1 m/s at least
        (box(1029.0, -5.0, 1060.0, 5.0), 0.0, 0.1, False),
        (box(40.0, -5.0, 60.0, 5.0), 0.0, 2.0, False),  # where it says that she is
    ],
)
def test_whether_the_reckoned_place_is_clear_ahead(rock, error_m, speed_mps, is_shut):
    doubt = PositionDoubt(
        since_s=NOW_S,
        t_s=NOW_S,
        reckoned_en_m=(1000.0, 0.0),
        velocity_en_mps=(2.0, 0.0),
        settled_s=NOW_S,
        error_m=error_m,
        why="it jumped",
    )
    ctx = moment(WAY, obstacles=(rock,), speed_mps=speed_mps, position={"doubt": doubt})
    assert is_other_shut(ctx) is is_shut
    assert not is_other_shut(moment(WAY, obstacles=(rock,), speed_mps=speed_mps))


@pytest.mark.parametrize("begun", [(500.0, 500.0), None])
def test_the_drift_of_a_loiter_that_is_begun_anew_is_reckoned_from_there(begun):
    """Reckoned from where the one before was begun, she circled well and was adrift for good."""
    hold = {"steering": {"own_mode": Mode.HOLD}, "adrift": {"loiter_en_m": begun, "loiter_s": 0.0}}
    ctx = seen(at=(40.0, 0.0), position={"anew": Mode.HOLD}, status={"mode": Mode.HOLD}, **hold)
    assert stands_off(ctx)
    adrift = ctx.state.adrift
    assert (adrift.loiter_en_m, adrift.loiter_s) == (((40.0, 0.0), NOW_S) if begun else (None, 0.0))

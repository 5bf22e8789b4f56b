"""A doubt of the position, case by case: what begins one, what is remembered for who comes after a kill."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.messages import Mode
from companion.safety import CRITICAL
from companion.skipper.behaviors.position_doubt import follow, is_other_shut, stands_off
from companion.skipper.step import StepContext
from companion.skipper.step.actions import Announce, SetMode
from companion.skipper.step.saved import Persisted, SavedPlace
from companion.skipper.step.state import Fix, PendingUpload, Phase
from companion.skipper.way.position_plausibility import PositionDoubt
from tests.skipper.moments import NOW_S, asked_for, moment, raised, route
from tests.skipper.world import ALL_PERMITTED, FRAME

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


# ----------------------------------------------------------------------------------------------------- in doubt
def a_doubt(**facts):
    """Return a doubt of half a minute, with the boat reckoned a kilometre east of where the fix has her."""
    told = {
        "since_s": NOW_S - 30.0,
        "t_s": NOW_S - 0.1,
        "settled_s": NOW_S - 21.0,
        "reckoned_en_m": (1000.0, 0.0),
        "velocity_en_mps": (2.0, 0.0),
        "farthest_m": 1000.0,
        "why": "it jumped",
    }
    return PositionDoubt(**(told | facts))


FAR = box(0.0, 1100.0, 1000.0, 1110.0)  # something solid that either place may come to


@pytest.mark.parametrize(
    ("change", "facts", "believed"),
    [
        ({}, {}, ""),
        ({"at": (990.0, 0.0)}, {}, "back where it was reckoned"),
        ({"at": (980.0, 0.0)}, {}, ""),
        ({"operator": {"given_back_s": NOW_S - 30.0}}, {}, "a person"),
        ({"operator": {"given_back_s": NOW_S - 31.0}}, {}, ""),  # before it was in doubt
        ({"operator": {"given_back_s": NOW_S - 9.0}, "status": {"ekf_ok": False}}, {}, ""),
        ({"operator": {"given_back_s": NOW_S - 9.0}, "status": {"system_status": CRITICAL}}, {}, ""),
        ({"operator": {"given_back_s": NOW_S - 9.0}, "obstacles": (box(-4.9, -50.0, 50.0, 50.0),)}, {}, "a person"),
        ({"operator": {"given_back_s": NOW_S - 9.0}, "obstacles": (box(-5.1, -50.0, 50.0, 50.0),)}, {}, ""),
        ({"obstacles": (FAR, box(992.9, -50.0, 1050.0, 50.0))}, {"error_m": 2.0}, "the reckoned place cannot be"),
        ({"obstacles": (FAR, box(993.1, -50.0, 1050.0, 50.0))}, {"error_m": 2.0}, ""),
        ({"obstacles": ()}, {}, "nothing solid is near"),
        ({"obstacles": (box(-10.0, 1199.0, 10.0, 1210.0),)}, {}, ""),
        ({"obstacles": (box(-10.0, 1201.0, 10.0, 1210.0),)}, {}, "nothing solid is near"),
        ({"obstacles": (box(990.0, 1199.0, 1010.0, 1210.0),)}, {}, ""),  # of the reckoned place
        ({"obstacles": (box(990.0, 1201.0, 1010.0, 1210.0),)}, {}, "nothing solid is near"),
    ],
)
def test_what_ends_a_doubt(change, facts, believed):
    ctx = seen(
        position={"doubt": a_doubt(**facts)},
        alarms={"raised": raised("position jump", "becalmed")},
        **({"obstacles": (FAR,)} | change),
    )
    found = doubted(ctx)
    said = [a.text for a in ctx.actions if isinstance(a, Announce)]
    assert (found is None) is bool(believed)
    assert ctx.state.position.back_s == (NOW_S if believed else float("-inf"))
    assert [r.name for r in ctx.state.alarms.raised] == ([] if believed else ["position jump"]) + ["becalmed"]
    assert len(said) == bool(believed), "a doubt that goes on is not said again"
    if believed:
        assert believed in said[0]
        assert codes(ctx) == ["position back" if "back where" in believed else "position believed"]
        assert ctx.state.position.place.farthest_m == 0.0
    else:
        assert ctx.state.position.place.farthest_m > 0.0


@pytest.mark.parametrize(
    ("own", "mode", "jumped_m", "anew"),
    [
        (Mode.LOITER, Mode.LOITER, 60.0, Mode.HOLD),
        (Mode.LOITER, Mode.LOITER, 0.0, None),
        (Mode.LOITER, Mode.AUTO, 60.0, None),
        (None, Mode.LOITER, 60.0, None),
        (Mode.HOLD, Mode.HOLD, 60.0, None),
    ],
)
def test_a_jump_moves_the_point_of_our_loiter_which_is_begun_anew(own, mode, jumped_m, anew):
    ctx = seen(jumped_m=jumped_m, steering={"own_mode": own}, status={"mode": mode}, position={"doubt": a_doubt()})
    follow(ctx)
    assert ctx.state.position.anew is anew


# ------------------------------------------------------------------------------------------------- standing off
STONE = box(1010.0, -5.0, 1030.0, 5.0)  # where the boat is reckoned to sail


def held(*, doubt=True, obstacles=(STONE,), own=None, mode=Mode.AUTO, anew=None, status=None, velocity=None, **parts):
    """Return a moment with the position in doubt, or believed, in a mode that is ``own`` or not."""
    ctx = moment(
        WAY,
        obstacles=obstacles,
        position={"doubt": a_doubt() if doubt is True else doubt or None, "anew": anew},
        steering={"own_mode": own},
        **parts,
    )
    told = {"mode": mode} | (status or {})
    vehicle = ctx.snapshot.vehicle
    vehicle = vehicle if velocity is None else replace(vehicle, velocity_en_mps=velocity)
    snapshot = replace(ctx.snapshot, vehicle=vehicle, autopilot=replace(ctx.snapshot.autopilot, **told))
    return StepContext(ctx.voyage, ctx.config, ctx.state, snapshot)


def modes(ctx):
    return [a.mode for a in ctx.actions if isinstance(a, SetMode)]


BUSY = {"command": (3, NOW_S - 0.5, "LOITER")}
DEEP = box(-5.1, -50.0, 50.0, 50.0)


@pytest.mark.parametrize(
    ("change", "stands", "asks"),
    [
        ({}, True, True),
        ({"doubt": False}, False, False),
        ({"obstacles": ()}, False, False),  # clear ahead: she sails on
        ({"permissions": replace(ALL_PERMITTED, may_set_mode=False)}, False, False),
        ({"status": {"ekf_ok": False}}, False, False),  # nor would it loiter then
        ({"status": {"system_status": CRITICAL}}, False, False),
        ({"pending": BUSY}, False, False),
        ({"obstacles": (), "own": Mode.HOLD, "mode": Mode.HOLD}, True, True),  # there she drifts
        ({"obstacles": (), "own": Mode.RTL, "mode": Mode.RTL}, True, True),  # and there she makes for a false place
        ({"obstacles": (), "own": Mode.HOLD, "mode": Mode.AUTO}, False, False),
        ({"obstacles": (), "own": None, "mode": Mode.HOLD}, False, False),
        ({"own": Mode.HOLD, "mode": Mode.HOLD, "pending": BUSY}, True, False),
        ({"obstacles": (DEEP,)}, True, True),  # steered for a while by a place inside something
        ({"obstacles": (box(-4.9, -50.0, 50.0, 50.0),)}, False, False),
        ({"obstacles": (DEEP,), "doubt": a_doubt(since_s=NOW_S - 2.9)}, False, False),  # a glitch may be over
        ({"obstacles": (DEEP,), "doubt": a_doubt(since_s=NOW_S - 3.0)}, True, True),
    ],
)
def test_she_loiters_while_she_may_be_near_something(change, stands, asks):
    ctx = held(**change)
    assert stands_off(ctx) is stands
    assert modes(ctx) == ([Mode.LOITER] if asks else [])
    assert ctx.state.operator.is_back is asks
    assert codes(ctx) == (["standing off"] if asks else [])


def test_once_held_it_stays_held_until_the_position_is_believed():
    ctx = held(own=Mode.LOITER, mode=Mode.LOITER, obstacles=())
    assert stands_off(ctx)
    assert not ctx.actions
    assert ctx.state.phase is Phase.HOLDING
    assert "until it can be believed" in ctx.state.why


# --------------------------------------------------------------------------------------------- a loiter's point
@pytest.mark.parametrize(
    ("change", "anew"),
    [
        ({}, True),
        ({"doubt": True}, False),  # nobody knows from where
        ({"own": None}, False),
        ({"mode": Mode.HOLD, "own": Mode.HOLD}, False),
        ({"status": {"waypoint_distance_m": 24.9}}, False),  # its circles
        ({"status": {"waypoint_distance_m": 25.0}}, True),
        ({"status": {"waypoint_distance_m": None}}, False),
        ({"status": {"target_bearing_rad": None}}, False),
        ({"status": {"target_bearing_rad": 0.0}}, False),  # the way there is clear
        ({"pending": {"accepted": ("LOITER", NOW_S - 4.9)}}, False),  # what is told is of the leg before
        ({"pending": {"accepted": ("LOITER", NOW_S - 5.0)}}, True),
        ({"pending": {"accepted": ("set current", NOW_S - 1.0)}}, True),
        ({"obstacles": (box(10.0, 0.5, 20.0, 9.0),)}, True),  # half a hull beside it
        ({"obstacles": (box(10.0, 0.55, 20.0, 9.0),)}, False),
    ],
)
def test_a_point_that_lies_beyond_something_is_not_made_for(change, anew):
    status = {"waypoint_distance_m": 60.0, "target_bearing_rad": math.pi / 2.0} | change.get("status", {})
    told = {"doubt": False, "own": Mode.LOITER, "mode": Mode.LOITER, "obstacles": (box(18.0, -5.0, 22.0, 5.0),)}
    ctx = held(**(told | change | {"status": status, "velocity": (0.0, 0.5)}))
    assert stands_off(ctx) is (anew or change.get("doubt", False))
    assert modes(ctx) == ([Mode.HOLD] if anew else [])
    assert ctx.state.position.anew is (Mode.HOLD if anew else None)
    if anew:
        assert (ctx.state.phase, "anew" in ctx.state.why) == (Phase.HOLDING, True)


PLANNED = {"plan": asked_for(WAY)}
SENT = {"upload": PendingUpload(upload_id=3, t_s=NOW_S, route=WAY, set_current=1, keep_first=0)}
AHEAD = (box(18.0, -5.0, 22.0, 5.0),)  # she runs on 16 m


@pytest.mark.parametrize(
    ("change", "asks", "then"),
    [
        ({"mode": Mode.LOITER}, [Mode.HOLD], Mode.HOLD),
        ({"mode": Mode.HOLD, "own": Mode.HOLD}, [Mode.LOITER], Mode.LOITER),
        ({"mode": Mode.HOLD, "own": Mode.HOLD, "pending": PLANNED}, [], None),  # left for a plan
        ({"mode": Mode.HOLD, "own": Mode.HOLD, "pending": SENT}, [], None),
        ({"mode": Mode.HOLD, "own": Mode.HOLD, "pending": PLANNED, "obstacles": AHEAD}, [Mode.LOITER], Mode.LOITER),
        ({"mode": Mode.HOLD, "own": Mode.HOLD, "pending": PLANNED, "doubt": True}, [Mode.LOITER], Mode.LOITER),
        ({"mode": Mode.HOLD, "own": Mode.HOLD, "pending": BUSY}, [], Mode.HOLD),  # later
        ({"mode": Mode.LOITER, "anew": Mode.LOITER}, [], None),  # it was
        ({"mode": Mode.HOLD, "anew": Mode.LOITER}, [Mode.LOITER], Mode.LOITER),
        ({"mode": Mode.AUTO}, [], None),  # somebody else's
        ({"mode": Mode.LOITER, "own": None}, [], None),
    ],
)
def test_a_loiter_is_begun_anew_through_hold(change, asks, then):
    told = {"doubt": False, "own": Mode.LOITER, "anew": Mode.HOLD, "obstacles": (), "adrift": {"loiter_en_m": None}}
    ctx = held(**(told | change))
    assert stands_off(ctx) is (then is not None)
    assert modes(ctx) == asks
    assert ctx.state.position.anew is then
    assert ctx.state.adrift.loiter_en_m is None
    if then is not None:
        assert (ctx.state.phase, "waiting to loiter anew" in ctx.state.why) == (Phase.HOLDING, True)


def test_the_drift_is_reckoned_from_where_the_loiter_is_begun_anew():
    ctx = held(
        doubt=False,
        own=Mode.HOLD,
        mode=Mode.HOLD,
        anew=Mode.HOLD,
        obstacles=(),
        at=(7.0, 3.0),
        adrift={"loiter_en_m": (90.0, 90.0), "loiter_s": 1.0},
    )
    assert stands_off(ctx)
    assert (ctx.state.adrift.loiter_en_m, ctx.state.adrift.loiter_s) == ((7.0, 3.0), NOW_S)


@pytest.mark.parametrize(
    ("east_m", "velocity", "turns_to_deg", "waits"),
    [
        (18.4, (2.0, 0.0), -90.0, True),  # 16 m in eight seconds, and two beside the hull
        (18.6, (2.0, 0.0), -90.0, False),
        (18.4, (2.0, 0.0), 90.0, False),  # LOITER leads there as well
        (18.4, (-2.0, 0.0), 90.0, False),  # she is off it already
        (18.4, (0.0, 2.0), 180.0, False),
        (18.4, (2.0, 0.0), None, False),
        (2.0, (2.0, 0.0), -90.0, True),  # from within these two metres
        (2.0, (-2.0, 0.0), 90.0, False),  # away from there is always right
    ],
)
def test_hold_waits_while_loiter_turns_her_away_from_what_she_would_run_onto(east_m, velocity, turns_to_deg, waits):
    course = None if turns_to_deg is None else math.radians(turns_to_deg)
    ctx = held(
        doubt=False,
        own=Mode.LOITER,
        mode=Mode.LOITER,
        anew=Mode.HOLD,
        obstacles=(box(east_m, -5.0, east_m + 4.0, 5.0),),
        velocity=velocity,
        status={"target_bearing_rad": course},
    )
    assert stands_off(ctx)
    assert modes(ctx) == ([] if waits else [Mode.HOLD])


def test_in_doubt_she_runs_on_from_where_she_is_reckoned():
    stone = (box(1018.4, -5.0, 1022.0, 5.0),)
    told = {"own": Mode.LOITER, "mode": Mode.LOITER, "anew": Mode.HOLD, "status": {"target_bearing_rad": -1.0}}
    assert stands_off(ctx := held(obstacles=stone, **told))
    assert not modes(ctx)
    assert stands_off(ctx := held(obstacles=(box(18.4, -5.0, 22.0, 5.0),), **told))
    assert modes(ctx) == [Mode.HOLD]


def test_a_hand_s_breadth_from_a_wall_and_sailing_off_it_hold_is_left_for_the_plan():
    wall = box(2.0, -5.0, 6.0, 5.0)
    told = {"doubt": False, "own": Mode.HOLD, "mode": Mode.HOLD, "anew": Mode.HOLD, "pending": PLANNED}
    ctx = held(obstacles=(wall,), velocity=(-2.0, 0.0), **told)
    assert not stands_off(ctx)
    assert not modes(ctx)


def test_without_a_way_on_board_she_is_held_against_where_she_drifts():
    for rock, is_shut in ((box(990.0, 8.5, 1010.0, 20.0), False), (box(1008.5, -20.0, 1020.0, 20.0), False)):
        ctx = held(obstacles=(rock,), velocity=(0.0, 0.0), mission={"route": None})
        assert is_other_shut(ctx) is is_shut
    ctx = held(obstacles=(box(990.0, 7.5, 1010.0, 20.0),), velocity=(0.0, 0.0), mission={"route": None})
    assert is_other_shut(ctx)

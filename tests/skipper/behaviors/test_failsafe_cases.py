"""Stops that we did not ask for, case by case: what is noticed, whose doing it is, what is done, when it is over."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.boat import AutopilotLimits
from companion.messages import Command, Mode, StatusText, waypoint
from companion.skipper.behaviors.failsafe import (
    _begin,
    _cause,
    _sticks,
    begin_again,
    follow_answer,
    follow_stops,
    is_answered,
    keeps_off,
    note,
    operator_has_it,
    take_over,
    waits_for,
)
from companion.skipper.step import CancelPlan, SetMode
from companion.skipper.step.actions import Announce
from companion.skipper.step.config import ALL_PERMITTED, Ends
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Adrift, Phase, Retry, Signs, Stop
from tests.skipper.moments import NOW_S, asked_for, moment, route
from tests.skipper.world import FRAME

WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))
RC = (1500, 1500, 1500, 1500, 1500, 1000, 1000, 1800)


def seen(mode=Mode.AUTO, *, armed=True, status=None, signs=None, stop=None, own=None, operator=None, **parts):
    """A step that sees the boat in ``mode``; a second ago it was sailed in AUTO."""
    told = {"helm": (Mode.AUTO, True), "helm_s": NOW_S - 1.0, "breaches": 0}
    ctx = moment(
        WAY,
        operator={"signs": Signs(**(told | (signs or {}))), "stop": stop} | (operator or {}),
        steering={"own_mode": own},
        **parts,
    )
    heard = {"mode": mode, "is_armed": armed, "fence_breaches": 0} | (status or {})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, **heard))
    return ctx


def stopped(mode=Mode.HOLD, *, cause="battery", armed=True, t_s=NOW_S - 20.0):
    return Stop(t_s=t_s, before_s=t_s - 1.0, mode=mode, is_armed=armed, cause=cause)


def codes(ctx):
    return [a.code for a in ctx.actions if isinstance(a, Announce)]


# ---------------------------------------------------------------------------------------------------- signs
@pytest.mark.parametrize(
    ("words", "cause", "is_empty"),
    [
        ("Battery 1 is low 10.2V", "battery", False),
        ("Battery 1 is critical 9.9V", "battery", True),
        ("EKF variance", "position", False),
        ("Reached waypoint", None, False),
        ("EKF variance is critical now", "position", False),
    ],
)
def test_a_text_that_is_a_sign_is_remembered(words, cause, is_empty):
    ctx = seen(signs={"seen_s": (("battery", 1.0), ("fence", 2.0))})
    note(ctx, StatusText(t_s=NOW_S, severity=4, text=words))
    before = {"battery": 1.0, "fence": 2.0}
    assert dict(ctx.state.operator.signs.seen_s) == before | ({} if cause is None else {cause: NOW_S})
    assert ctx.state.alarms.battery_critical is is_empty


@pytest.mark.parametrize(
    ("status", "signs", "seen_s"),
    [
        ({}, {}, {}),
        ({"battery_failed": True}, {}, {"battery": NOW_S}),
        ({"battery_failed": True}, {"standing": ("battery",)}, {}),  # it stood already
        ({"fence_breached": True}, {}, {"fence": NOW_S}),
        ({"fence_breaches": 1}, {}, {"fence": NOW_S}),
        ({"fence_breaches": 1}, {"breaches": None}, {}),
        ({"fence_breaches": None}, {}, {}),
        ({"system_status": 5}, {}, {"shore link": NOW_S}),
        ({"system_status": 5, "ekf_ok": False}, {}, {"position": NOW_S}),
        ({"system_status": 5}, {"seen_s": (("position", NOW_S - 30.0),)}, {"position": NOW_S - 30.0}),  # of the filter
        (
            {"system_status": 5},
            {"seen_s": (("position", NOW_S - 30.1),)},
            {"position": NOW_S - 30.1, "shore link": NOW_S},
        ),
        ({"receiver_lost": True}, {}, {"receiver": NOW_S}),
    ],
)
def test_a_sign_is_new_when_it_comes_up(status, signs, seen_s):
    ctx = seen(status=status, signs=signs)
    follow_stops(ctx)
    found = ctx.state.operator.signs
    assert dict(found.seen_s) == seen_s
    assert (found.helm, found.helm_s) == ((Mode.AUTO, True), NOW_S)
    assert found.breaches == ctx.snapshot.autopilot.fence_breaches


@pytest.mark.parametrize(
    ("failed", "standing", "critical"),
    [(False, ("battery",), False), (False, (), True), (None, ("battery",), True), (True, ("battery",), True)],
)
def test_a_battery_that_is_well_again_is_critical_no_more(failed, standing, critical):
    ctx = seen(status={"battery_failed": failed}, signs={"standing": standing}, alarms={"battery_critical": True})
    follow_stops(ctx)
    assert ctx.state.alarms.battery_critical is critical


@pytest.mark.parametrize(
    ("rc", "more", "moved"),
    [
        ({0: 1600}, {}, False),
        ({0: 1601}, {}, True),
        ({0: 1399}, {}, True),
        ({7: 1165}, {}, True),  # the mode switch
        ({4: 2000}, {}, False),  # a channel that steers nothing
        ({0: 1900}, {"receiver_lost": True}, False),
    ],
)
def test_a_stick_that_moves_is_a_person(rc, more, moved):
    ctx = seen()
    limits = AutopilotLimits.from_params({"RCMAP_ROLL": 1.0, "RCMAP_THROTTLE": 3.0, "MODE_CH": 8.0})
    channels = [n for n in limits.rc_channels if 1 <= n <= 8]
    rested = Signs(rc_us=tuple(RC[n - 1] for n in channels), rc_moved_s=5.0)
    now = tuple(rc.get(n, us) for n, us in enumerate(RC))
    found = _sticks(rested, replace(ctx.snapshot.autopilot, rc_us=now, **more), limits, NOW_S)
    assert (found.rc_moved_s == NOW_S) is moved
    assert found.rc_us == (tuple(now[n - 1] for n in channels) if moved else rested.rc_us)
    first = _sticks(Signs(), replace(ctx.snapshot.autopilot, rc_us=now), limits, NOW_S)
    assert (first.rc_us, first.rc_moved_s) == (tuple(now[n - 1] for n in channels), -math.inf)
    none = _sticks(rested, replace(ctx.snapshot.autopilot, rc_us=()), limits, NOW_S)
    assert none == rested


STOP = Stop(t_s=100.0, before_s=98.0, mode=Mode.HOLD, is_armed=True, cause="")


@pytest.mark.parametrize(
    ("seen_s", "moved_s", "cause"),
    [
        ((), -math.inf, "a person"),
        ((("battery", 93.0),), -math.inf, "battery"),  # five seconds before the last look at the boat sailing
        ((("battery", 92.9),), -math.inf, "a person"),
        ((("battery", 105.0),), -math.inf, "battery"),  # or after the stop
        ((("battery", 105.1),), -math.inf, "a person"),
        ((("battery", 99.0),), 93.0, "a person"),
        ((("battery", 99.0),), 105.0, "a person"),
        ((("battery", 99.0),), 92.9, "battery"),
        ((("battery", 99.0),), 105.1, "battery"),
        ((("battery", 99.0), ("receiver", 99.0)), 99.0, "battery"),  # a receiver that was left alone
        ((("receiver", 99.0),), -math.inf, "a person"),
        ((("battery", 99.0), ("position", 99.0)), -math.inf, "position"),  # the first of the table
    ],
)
def test_the_cause_is_sought_on_both_sides_of_the_change(seen_s, moved_s, cause):
    assert _cause(STOP, Signs(seen_s=seen_s, rc_moved_s=moved_s)) == cause


# ----------------------------------------------------------------------------------------------------- a stop
@pytest.mark.parametrize(
    ("mode", "armed", "change", "is_stop"),
    [
        (Mode.AUTO, True, {}, False),
        (Mode.MANUAL, True, {}, False),  # she is sailed, by somebody
        (Mode.HOLD, True, {}, True),
        (Mode.LOITER, True, {}, True),
        (Mode.RTL, True, {}, True),
        (Mode.AUTO, False, {}, True),
        (Mode.HOLD, True, {"signs": {"helm": (Mode.MANUAL, True)}}, False),  # she was not sailed before
        (Mode.HOLD, True, {"signs": {"helm": (Mode.AUTO, False)}}, False),
        (Mode.HOLD, True, {"signs": {"helm": (Mode.GUIDED, True)}}, True),
        (Mode.LOITER, True, {"signs": {"helm": (Mode.RTL, True)}}, True),
        (Mode.LOITER, True, {"signs": {"helm": (Mode.HOLD, True)}}, False),
        (Mode.LOITER, True, {"own": Mode.LOITER}, False),  # we asked for it
        (Mode.HOLD, True, {"signs": {"helm": None}}, False),
    ],
)
def test_a_boat_that_was_sailed_and_is_no_more_was_stopped(mode, armed, change, is_stop):
    ctx = seen(mode, armed=armed, **change)
    follow_stops(ctx)
    stop = ctx.state.operator.stop
    assert (stop is not None) is is_stop
    if is_stop:
        assert stop == Stop(t_s=NOW_S, before_s=NOW_S - 1.0, mode=mode, is_armed=armed, cause="a person")


@pytest.mark.parametrize(("sailing", "is_stop"), [(True, True), (False, False)])
def test_at_the_first_look_the_saved_state_says_whether_she_was_sailed(sailing, is_stop):
    before = Persisted(voyage="test", gate=0, sailing=sailing, route=None, pending=None)
    ctx = seen(Mode.HOLD, signs={"helm": None}, mission={"route": WAY, "adoptable": before})
    follow_stops(ctx)
    assert (ctx.state.operator.stop is not None) is is_stop


def test_a_stop_lasts_until_she_is_sailed_and_another_takes_its_place():
    old = stopped(Mode.HOLD)
    for mode in (Mode.AUTO, Mode.MANUAL, Mode.GUIDED):
        ctx = seen(mode, stop=old)
        follow_stops(ctx)
        assert ctx.state.operator.stop is None
    same = seen(Mode.HOLD, stop=old)
    follow_stops(same)
    assert same.state.operator.stop == old
    other = seen(Mode.RTL, stop=old, status={"battery_failed": True})
    follow_stops(other)
    assert other.state.operator.stop == Stop(
        t_s=NOW_S, before_s=NOW_S - 1.0, mode=Mode.RTL, is_armed=True, cause="battery"
    )
    disarmed = seen(Mode.HOLD, armed=False, stop=old)
    follow_stops(disarmed)
    assert (disarmed.state.operator.stop.t_s, disarmed.state.operator.stop.is_armed) == (NOW_S, False)
    ours = seen(Mode.LOITER, stop=old, own=Mode.LOITER)
    follow_stops(ours)
    assert ours.state.operator.stop == replace(old, mode=Mode.LOITER)


@pytest.mark.parametrize(("age_s", "cause"), [(5.0, "fence"), (5.1, "battery")])
def test_a_sign_that_comes_late_names_the_cause_for_five_seconds(age_s, cause):
    ctx = seen(Mode.HOLD, stop=stopped(t_s=NOW_S - age_s), status={"fence_breached": True})
    follow_stops(ctx)
    assert ctx.state.operator.stop.cause == cause


def test_nothing_is_noticed_of_an_autopilot_that_is_not_heard():
    ctx = seen(Mode.HOLD)
    ctx.snapshot = replace(ctx.snapshot, heartbeat_age_s=9.0)
    before = ctx.state
    follow_stops(ctx)
    assert ctx.state is before


# ------------------------------------------------------------------------------------------------- taken over
@pytest.mark.parametrize(
    ("stop", "may", "ends", "takes"),
    [
        (stopped(), ALL_PERMITTED, Ends(), True),
        (None, ALL_PERMITTED, Ends(), False),
        (stopped(armed=False), ALL_PERMITTED, Ends(), False),
        (stopped(cause="a person"), ALL_PERMITTED, Ends(), False),
        (stopped(cause="crash"), ALL_PERMITTED, Ends(), False),
        (stopped(mode=None), ALL_PERMITTED, Ends(), False),
        (stopped(), replace(ALL_PERMITTED, may_set_mode=False), Ends(), False),
        (stopped(), replace(ALL_PERMITTED, may_upload=False), Ends(), False),
        (stopped(), ALL_PERMITTED, Ends.of(battery_failsafe="leave"), False),
        (stopped(cause="fence"), ALL_PERMITTED, Ends(), True),
    ],
)
def test_which_stops_are_ours_to_end(stop, may, ends, takes):
    ctx = seen(
        Mode.HOLD,
        stop=stop,
        permissions=may,
        config={"ends": ends},
        plans={"retry": Retry(failures=3)},
        operator={"since_s": 5.0},
    )
    assert take_over(ctx) is takes
    operator = ctx.state.operator
    assert operator.is_back is takes
    assert operator.answering == (stop.cause if takes else "")
    assert (operator.since_s is None) is takes
    assert ctx.state.steering.own_mode is (Mode.HOLD if takes else None)
    assert ctx.state.plans.retry.failures == (0 if takes else 3)
    assert codes(ctx) == ([f"{stop.cause} failsafe"] if takes else [])
    if takes:
        assert ctx.state.phase is Phase.HOLDING
        assert not operator.sent_home


@pytest.mark.parametrize(("mode", "home"), [(Mode.RTL, True), (Mode.SMART_RTL, True), (Mode.LOITER, False)])
def test_a_boat_that_was_sent_home_is_known_to_be(mode, home):
    ctx = seen(mode, stop=stopped(mode))
    assert take_over(ctx)
    assert ctx.state.operator.sent_home is home


# ------------------------------------------------------------------------------------------------ somebody's way
ROCK = box(30.0, -10.0, 60.0, 10.0)
ACROSS = (waypoint(FRAME.geo_from_en(0.0, 50.0)), waypoint(FRAME.geo_from_en(200.0, 0.0)))


def foreign(items=ACROSS, *, seq=2, at=(0.0, 0.0), speed_mps=2.0, obstacles=(ROCK,), foreign="theirs", **parts):
    return seen(
        Mode.AUTO,
        at=at,
        speed_mps=speed_mps,
        obstacles=obstacles,
        mission={"route": None, "foreign": foreign, "read_items": items},
        status={"mission_seq": seq},
        **parts,
    )


@pytest.mark.parametrize(
    ("change", "keeps"),
    [
        ({}, True),
        ({"seq": 1}, False),  # the first item leads past it
        ({"seq": 0}, False),
        ({"at": (-21.9, 0.0)}, True),  # 25 s at 2 m/s are 50 m, and the hull's 2 m
        ({"at": (-22.1, 0.0)}, False),
        ({"at": (2.9, 0.0), "speed_mps": 0.1}, False),  # slow: at 1 m/s
        ({"at": (3.1, 0.0), "speed_mps": 0.1}, True),
        ({"obstacles": ()}, False),
        ({"foreign": ""}, False),
        ({"items": None}, False),
        ({"items": (ACROSS[0], replace(ACROSS[1], command=Command.DO_CHANGE_SPEED))}, False),
        ({"config": {"adopts": True}}, False),
        ({"permissions": replace(ALL_PERMITTED, may_set_mode=False)}, False),
        ({"announced": {"codes": (("kept off", NOW_S - 1799.0),)}}, False),  # he has been told, and means it
        ({"announced": {"codes": (("kept off", NOW_S - 1801.0),)}}, True),
    ],
)
def test_before_the_hull_touches_on_somebody_s_way_she_loiters(change, keeps):
    ctx = foreign(**change)
    assert keeps_off(ctx) is keeps
    assert [a.mode for a in ctx.actions if isinstance(a, SetMode)] == [Mode.LOITER] * keeps
    assert codes(ctx) == ["kept off"] * keeps
    if keeps:
        assert ctx.state.phase is Phase.HOLDING


def test_what_leads_away_from_something_near_is_let_be():
    away = (waypoint(FRAME.geo_from_en(-200.0, 0.0)),)
    assert not keeps_off(foreign(away, seq=1, at=(29.0, 0.0)))
    assert keeps_off(foreign(seq=2, at=(27.5, 0.0)))
    assert not keeps_off(foreign((waypoint(FRAME.geo_from_en(28.8, 100.0)),), seq=1, at=(28.5, 0.0)))


@pytest.mark.parametrize(
    ("mode", "cause", "may_upload", "far_m", "course_deg", "keeps"),
    [
        (Mode.RTL, "battery", False, 300.0, 90.0, True),
        (Mode.SMART_RTL, "battery", False, 300.0, 90.0, True),
        (Mode.RTL, "battery", False, 300.0, 0.0, False),
        (Mode.RTL, "battery", False, 20.0, 90.0, False),  # home is before it
        (Mode.RTL, "battery", True, 300.0, 90.0, False),  # ours to plan
        (Mode.RTL, "a person", False, 300.0, 90.0, False),
        (Mode.LOITER, "battery", False, 300.0, 90.0, False),
        (Mode.RTL, "battery", False, None, 90.0, False),
        (Mode.RTL, "battery", False, 300.0, None, False),
    ],
)
def test_the_straight_way_home_is_nobody_s_wish(mode, cause, may_upload, far_m, course_deg, keeps):
    bearing = None if course_deg is None else math.radians(course_deg)
    ctx = seen(
        mode,
        stop=stopped(mode, cause=cause),
        obstacles=(ROCK,),
        permissions=replace(ALL_PERMITTED, may_upload=may_upload),
        status={"waypoint_distance_m": far_m, "target_bearing_rad": bearing},
    )
    assert keeps_off(ctx) is keeps


@pytest.mark.parametrize(
    ("ends", "east_m", "may_set_mode", "told_s", "keeps"),
    [
        (Ends(), 3.1, True, 60.0, True),  # 12.5 s at 2 m/s, and the hull's 2 m; the first one was no more meant
        (Ends(), 2.9, True, 60.0, False),  # our own way is on board sooner
        (Ends(), 3.1, False, 60.0, False),
        (Ends.of(fence_failsafe="leave"), -21.9, True, 1801.0, True),  # nobody plans a way out of it
        (Ends.of(fence_failsafe="leave"), -21.9, True, 60.0, False),
    ],
)
def test_a_straight_way_home_that_is_answered_is_stopped_on_where_our_own_comes_too_late(
    ends, east_m, may_set_mode, told_s, keeps
):
    ctx = seen(
        Mode.RTL,
        stop=stopped(Mode.RTL, cause="fence"),
        at=(east_m, 0.0),
        speed_mps=2.0,
        obstacles=(ROCK,),
        config={"ends": ends},
        permissions=replace(ALL_PERMITTED, may_set_mode=may_set_mode),
        announced={"codes": (("kept off", NOW_S - told_s),)},
        status={"waypoint_distance_m": 300.0, "target_bearing_rad": math.radians(90.0)},
    )
    assert keeps_off(ctx) is keeps


def test_the_beginning_of_a_way():
    way = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]
    assert _begin(way, 4.0) == [(0.0, 0.0), pytest.approx((4.0, 0.0))]
    assert _begin(way, 10.0) == [(0.0, 0.0), pytest.approx((10.0, 0.0))]
    assert _begin(way, 13.0) == [(0.0, 0.0), (10.0, 0.0), pytest.approx((10.0, 3.0))]
    assert _begin(way, 99.0) == way


# --------------------------------------------------------------------------------------------- until it is over
@pytest.mark.parametrize(
    ("mode", "own", "answering", "stop", "answered"),
    [
        (Mode.HOLD, Mode.HOLD, "battery", stopped(), True),
        (Mode.HOLD, Mode.HOLD, "", stopped(), False),
        (Mode.HOLD, Mode.HOLD, "battery", None, False),
        (Mode.AUTO, Mode.HOLD, "battery", stopped(), False),
    ],
)
def test_she_lies_in_a_stop_that_is_ours_to_end(mode, own, answering, stop, answered):
    assert is_answered(seen(mode, own=own, stop=stop, operator={"answering": answering})) is answered


@pytest.mark.parametrize(
    ("status", "answering", "signs", "words"),
    [
        ({}, "battery", {}, ""),
        ({"ekf_ok": False}, "battery", {}, "position filter"),
        ({"system_status": 5}, "position", {}, "position filter"),  # it takes a jump before its failsafe is over
        ({"system_status": 5}, "battery", {}, ""),
        ({"system_status": 5}, "position", {"seen_s": (("shore link", NOW_S),)}, ""),
        ({"system_status": 5}, "position", {"seen_s": (("shore link", NOW_S - 30.0),)}, "position filter"),
    ],
)
def test_what_is_missing_before_she_can_be_planned_for(status, answering, signs, words):
    ctx = seen(Mode.HOLD, own=Mode.HOLD, stop=stopped(), status=status, signs=signs, operator={"answering": answering})
    found = waits_for(ctx)
    assert (words in found) if words else (found == "")
    ctx.snapshot = replace(ctx.snapshot, vehicle_age_s=9.0)
    assert "position" in waits_for(ctx)
    ctx.snapshot = replace(ctx.snapshot, heartbeat_age_s=9.0)
    assert "position filter" in waits_for(ctx)


@pytest.mark.parametrize(
    ("stop", "signs", "answering", "own"),
    [
        (stopped(), {}, "battery", Mode.HOLD),
        (stopped(cause="fence"), {}, "fence", Mode.HOLD),  # a better sign came late
        (stopped(cause="crash"), {}, "battery", Mode.HOLD),
        (stopped(cause="a person"), {}, "", None),
        (stopped(), {"rc_moved_s": NOW_S - 19.9}, "", None),  # somebody has taken the sticks since
        (stopped(), {"rc_moved_s": NOW_S - 20.0}, "battery", Mode.HOLD),
        (stopped(), {"rc_moved_s": NOW_S, "standing": ("receiver",)}, "battery", Mode.HOLD),
    ],
)
def test_an_answer_goes_on_until_a_person_takes_it_out_of_our_hands(stop, signs, answering, own):
    ctx = seen(Mode.HOLD, own=Mode.HOLD, stop=stop, signs=signs, operator={"answering": "battery"})
    follow_answer(ctx)
    assert (ctx.state.operator.answering, ctx.state.steering.own_mode) == (answering, own)
    if not answering:
        assert ctx.state.operator.stop.cause == "a person"


@pytest.mark.parametrize(
    ("answering", "signs", "pending", "own", "left", "said"),
    [
        ("battery", {}, {}, Mode.HOLD, "", ["answered"]),  # AUTO, and not by us
        ("battery", {}, {"command": (3, NOW_S, "AUTO")}, Mode.HOLD, "battery", []),
        ("battery", {}, {"command": (3, NOW_S, "LOITER")}, Mode.HOLD, "", ["answered"]),
        ("battery", {}, {"accepted": ("AUTO", NOW_S - 30.0)}, Mode.HOLD, "battery", []),
        ("battery", {}, {"accepted": ("AUTO", NOW_S - 30.1)}, Mode.HOLD, "", ["answered"]),
        ("battery", {}, {"accepted": ("LOITER", NOW_S)}, Mode.HOLD, "", ["answered"]),
        ("battery", {}, {}, None, "battery", []),  # it was seen before
        ("shore link", {}, {}, None, "", []),  # over
        ("shore link", {"standing": ("shore link",)}, {}, None, "shore link", []),
        ("fence", {}, {}, None, "", []),  # sailing on is all that it asked for
    ],
)
def test_an_answer_is_over(answering, signs, pending, own, left, said):
    ctx = seen(Mode.AUTO, own=own, signs=signs, pending=pending, operator={"answering": answering})
    follow_answer(ctx)
    assert (ctx.state.operator.answering, codes(ctx)) == (left, said)
    silent = seen(Mode.AUTO, operator={"answering": answering})
    silent.snapshot = replace(silent.snapshot, heartbeat_age_s=9.0)
    follow_answer(silent)
    assert silent.state.operator.answering == answering


# ------------------------------------------------------------------------------------------------------ a reboot
@pytest.mark.parametrize(
    ("phase", "since_s", "keeps"),
    [
        (Phase.OPERATOR, NOW_S - 15.1, True),  # a person had her before
        (Phase.OPERATOR, NOW_S - 15.0, False),  # it was the reboot that changed the mode
        (Phase.OPERATOR, None, False),
        (Phase.STANDARD, NOW_S - 99.0, False),
    ],
)
def test_after_a_reboot_all_but_a_person_s_turn_begins_again(phase, since_s, keeps):
    ctx = seen(
        stop=stopped(),
        own=Mode.LOITER,
        phase=phase,
        operator={"since_s": since_s, "answering": "battery"},
        pending={"command": (1, NOW_S, "AUTO")},
        adrift=Adrift(motor=True),
        mission={"route": WAY, "checked": True},
    )
    begin_again(ctx)
    state = ctx.state
    assert (state.mission.checked, state.mission.read_since_s) == (False, NOW_S)
    assert (state.steering.own_mode, state.pending.command, state.adrift) == (None, None, Adrift())
    assert (state.operator.answering, state.operator.stop, state.operator.signs) == ("", None, Signs())
    assert (state.voyage.sailing, state.phase) == ((True, phase) if keeps else (False, Phase.WAITING))
    assert state.operator.since_s == (since_s if keeps else None)


# ----------------------------------------------------------------------------------------------------- a person
PLAN = asked_for(WAY)


@pytest.mark.parametrize("plan", [None, PLAN])
def test_somebody_who_takes_her_has_her_and_all_that_was_asked_for_is_called_off(plan):
    ctx = seen(
        Mode.MANUAL, own=Mode.GUIDED, pending={"plan": plan, "command": (1, NOW_S, "AUTO")}, operator={"since_s": None}
    )
    assert operator_has_it(ctx)
    state = ctx.state
    assert (state.phase, state.operator.since_s) == (Phase.OPERATOR, NOW_S)
    assert (state.pending.plan, state.pending.command, state.steering.own_mode) == (None, None, None)
    assert [type(a) for a in ctx.actions if not isinstance(a, Announce)] == [CancelPlan] * (plan is not None)
    assert codes(ctx) == ["operator"]


def test_a_failsafe_s_stop_is_taken_over_in_its_place():
    ctx = seen(Mode.HOLD, stop=stopped())
    assert not operator_has_it(ctx)
    assert (ctx.state.phase, ctx.state.operator.answering) == (Phase.HOLDING, "battery")
    later = seen(Mode.HOLD, stop=stopped(), phase=Phase.OPERATOR)  # its sign came later
    assert not operator_has_it(later)
    assert later.state.operator.answering == "battery"


@pytest.mark.parametrize(
    "change", [{"voyage": {"sailing": False}}, {"mission": {"route": WAY, "foreign": "theirs"}}, {"silent": True}]
)
def test_who_does_not_sail_or_has_a_stranger_s_mission_is_taken_by_nobody(change):
    change = dict(change)
    is_silent = change.pop("silent", False)
    ctx = seen(Mode.MANUAL, **change)
    if is_silent:
        ctx.snapshot = replace(ctx.snapshot, heartbeat_age_s=9.0)
    assert not operator_has_it(ctx)
    assert ctx.state.phase is Phase.STANDARD


@pytest.mark.parametrize(
    ("own", "parts", "left"),
    [
        (Mode.LOITER, {}, None),  # AUTO shows: what was asked for is over
        (Mode.LOITER, {"pending": {"command": (1, NOW_S, "LOITER")}}, Mode.LOITER),  # it is on its way
    ],
)
def test_a_mode_of_ours_is_over_when_auto_shows(own, parts, left):
    ctx = seen(Mode.AUTO, own=own, **parts)
    assert not operator_has_it(ctx)
    assert ctx.state.steering.own_mode is left


@pytest.mark.parametrize(("mode", "armed"), [(Mode.MANUAL, True), (Mode.AUTO, False), (Mode.HOLD, True)])
def test_she_stays_with_him_until_auto(mode, armed):
    ctx = seen(mode, armed=armed, phase=Phase.OPERATOR, operator={"since_s": NOW_S - 60.0})
    assert operator_has_it(ctx)
    assert (ctx.state.phase, ctx.state.operator.since_s) == (Phase.OPERATOR, NOW_S - 60.0)
    assert ctx.state.why.endswith("waiting for AUTO")


def test_given_back_the_mission_is_compared_and_she_plans_from_where_she_is():
    ctx = seen(
        Mode.AUTO,
        phase=Phase.OPERATOR,
        operator={"since_s": NOW_S - 60.0, "answering": "battery"},
        plans={"retry": Retry(failures=3)},
        progress={"history": ((1.0, 2.0, 3.0, 4.0),)},
        mission={"route": WAY, "checked": True},
    )
    assert not operator_has_it(ctx)
    state = ctx.state
    assert (state.operator.since_s, state.operator.is_back, state.operator.answering) == (None, True, "")
    assert (state.operator.given_back_s, state.plans.retry.failures, state.progress.history) == (NOW_S, 0, ())
    assert (state.mission.checked, state.mission.read_since_s, state.phase) == (False, NOW_S, Phase.WAITING)
    assert codes(ctx) == ["operator back"]
    assert any("after 60 s" in a.text for a in ctx.actions)


def test_an_autopilot_that_was_only_not_known_to_be_ours_is_compared_and_nobody_gave_her_back():
    ctx = seen(Mode.AUTO, phase=Phase.OPERATOR, operator={"since_s": None})
    assert not operator_has_it(ctx)
    assert (ctx.state.phase, ctx.state.mission.checked) == (Phase.WAITING, False)
    assert (ctx.state.operator.given_back_s, codes(ctx)) == (-math.inf, [])


@pytest.mark.parametrize(
    ("mode", "armed", "cause", "words"),
    [
        (Mode.MANUAL, True, "a person", "mode MANUAL"),
        (Mode.MANUAL, False, "a person", "mode MANUAL, disarmed"),
        (None, True, "a person", "mode unknown"),
        (Mode.HOLD, True, "battery", "mode HOLD by the battery failsafe"),
    ],
)
def test_what_she_was_put_into_is_named_and_by_which_failsafe(mode, armed, cause, words):
    may = replace(ALL_PERMITTED, may_set_mode=False)  # a failsafe's stop is left to the crew, too
    stop = stopped(mode, armed=armed, cause=cause)
    ctx = seen(mode, armed=armed, stop=stop, phase=Phase.OPERATOR, operator={"since_s": NOW_S - 60.0}, permissions=may)
    assert operator_has_it(ctx)
    assert ctx.state.why == f"{words}: waiting for AUTO"


def test_the_sticks_are_read_by_the_channels_that_the_autopilot_was_read_to_have():
    swapped = AutopilotLimits.from_params({"RCMAP_ROLL": 4.0, "RCMAP_THROTTLE": 3.0, "MODE_CH": 8.0})
    for limits in (None, swapped):
        ctx = seen(Mode.AUTO, status={"rc_us": RC}, signs={"rc_us": ()})
        ctx.snapshot = replace(ctx.snapshot, limits=limits)
        follow_stops(ctx)
        channels = [n for n in (limits or AutopilotLimits()).rc_channels if 1 <= n <= len(RC)]
        assert ctx.state.operator.signs.rc_us == tuple(RC[n - 1] for n in channels)


# ------------------------------------------------------------------------------- a mode before she sets sail
@pytest.mark.parametrize(
    ("mode", "before", "change", "is_put"),
    [
        (Mode.MANUAL, Mode.HOLD, {}, True),
        (Mode.HOLD, Mode.HOLD, {}, False),  # as she was
        (Mode.HOLD, None, {}, False),  # as she was switched on
        (Mode.HOLD, Mode.INITIALISING, {}, False),
        (Mode.INITIALISING, Mode.HOLD, {}, False),
        (Mode.AUTO, Mode.HOLD, {}, False),
        (Mode.LOITER, Mode.HOLD, {"own": Mode.LOITER}, False),  # ours
        (Mode.MANUAL, Mode.HOLD, {"voyage": {"sailing": True}}, False),  # then it is a stop
        (Mode.HOLD, Mode.MANUAL, {"signs": {"seen_s": (("battery", NOW_S - 1.0),)}}, False),  # a failsafe's
        (Mode.HOLD, Mode.MANUAL, {"signs": {"seen_s": (("battery", NOW_S - 9.0),)}}, True),
    ],
)
def test_a_mode_that_somebody_sets_before_she_sails_is_noticed(mode, before, change, is_put):
    signs = {"helm": (before, True)} | change.get("signs", {})
    ctx = seen(mode, **({"voyage": {"sailing": False}} | change | {"signs": signs}))
    follow_stops(ctx)
    put = ctx.state.operator.put
    assert (put is not None) is is_put
    if put is not None:
        assert (put.t_s, put.before_s, put.mode, put.is_armed) == (NOW_S, NOW_S - 1.0, mode, True)


@pytest.mark.parametrize(
    ("mode", "age_s", "change", "is_kept"),
    [
        (Mode.MANUAL, 60.0, {}, True),
        (Mode.INITIALISING, 60.0, {}, True),  # a reboot chooses nothing
        (Mode.AUTO, 60.0, {}, False),  # it is over
        (Mode.MANUAL, 60.0, {"voyage": {"sailing": True}}, False),
        (Mode.MANUAL, 5.0, {"signs": {"seen_s": (("battery", NOW_S),)}}, False),  # its sign came late
        (Mode.MANUAL, 5.1, {"signs": {"seen_s": (("battery", NOW_S),)}}, True),
        (Mode.MANUAL, 5.0, {}, True),
    ],
)
def test_it_is_kept_until_auto(mode, age_s, change, is_kept):
    put = Stop(t_s=NOW_S - age_s, before_s=NOW_S - age_s - 1.0, mode=Mode.MANUAL, is_armed=True, cause="a person")
    signs = {"helm": (Mode.MANUAL, True)} | change.get("signs", {})
    ctx = seen(mode, operator={"put": put}, **({"voyage": {"sailing": False}} | change | {"signs": signs}))
    follow_stops(ctx)
    assert ctx.state.operator.put == (put if is_kept else None)

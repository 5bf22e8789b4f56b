"""Whose doing is it that she is not being sailed? Signs, sticks, what is answered, and what is said of a drift."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from shapely.geometry import box

from companion.messages import Command, MissionItem, Mode, StatusText, waypoint
from companion.safety import CAUSES, FAILSAFES, WORD_OF, Recovery
from companion.skipper.step import actions as act
from companion.skipper.step.config import Ends
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import make, said
from tests.skipper.world import FRAME, restarted, with_parts

ISLAND = box(-60, 80, 60, 120)
EAST = (Goal(en_m=(400.0, 0.0), radius_m=8.0),)
RESTING = (1500, 1500, 1500, 1500, 1500, 1000, 1000, 1800)
SWITCHED = (*RESTING[:7], 1165)


def text(world, words):
    world.events.append(StatusText(t_s=world.t, severity=4, text=words))


def under_way(goals=EAST, **made):
    world = make(*goals, obstacles=made.pop("obstacles", ()), **made)
    world.shown = {"rc_us": RESTING, "home": FRAME.geo_from_en(0.0, 0.0), **world.shown}
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.run(20)
    return world


def stop(world, mode=Mode.HOLD, **shown):
    world.set_mode(mode)
    world.drift_mps = 0.6
    world.shown |= shown


SIGNS = {
    "position text": ("position", {}, "EKF failsafe"),
    "battery text": ("battery", {}, "Battery 1 is low 10.20V used 0 mAh"),
    "battery shown": ("battery", {"battery_failed": True}, ""),
    "fence shown": ("fence", {"fence_breached": True}, ""),
    "radio text": ("shore link", {}, "Radio Failsafe"),
    "station text": ("shore link", {}, "GCS Failsafe"),
    "crash text": ("crash", {}, "Crash: Going to HOLD"),
    "no sign": ("a person", {}, ""),
    "recovery is no sign: it follows any change of mode outside": ("a person", {}, "Manual recovery started"),
    "an end is no sign": ("a person", {}, "Radio Failsafe Cleared"),
    "a refusal is no sign": ("a person", {}, "PreArm: Battery 1 low voltage failsafe"),
}


@pytest.mark.parametrize("late_s", [0, 3])
@pytest.mark.parametrize("what", SIGNS)
def test_each_cause_is_known_by_its_sign_before_or_after_the_change_of_mode(what, late_s):
    cause, shown, words = SIGNS[what]
    world = under_way()
    stop(world)
    world.run(late_s)
    world.shown |= shown
    if words:
        text(world, words)
    world.run(2)
    assert world.state.operator.stop.cause == cause
    expected = {c.name: c.answer is not Recovery.LEAVE for c in FAILSAFES}.get(cause, False)
    assert bool(world.state.operator.answering) is expected
    assert (world.state.phase is Phase.OPERATOR) is not expected


def test_a_sign_long_before_or_after_belongs_to_nothing():
    world = under_way()
    text(world, "Radio Failsafe")
    world.run(10)
    stop(world)
    world.run(10)
    text(world, "Radio Failsafe")
    world.run(5)
    assert world.state.operator.stop.cause == "a person"
    assert world.state.phase is Phase.OPERATOR


def test_another_breach_while_she_is_outside_is_a_sign_too():
    """The home circle: a new breach every 20 m farther out, FENCE_STATUS breached all the while."""
    world = under_way()
    world.shown |= {"fence_breached": True, "fence_breaches": 1}
    world.run(60)
    stop(world)
    world.run(2)
    assert world.state.phase is Phase.OPERATOR
    world.shown["fence_breaches"] = 2
    world.run(2)
    assert world.state.operator.stop.cause == "fence"
    assert world.run(20, lambda w: w.mode is Mode.AUTO)


def test_a_critical_heartbeat_tells_when_the_text_was_lost():
    world = under_way()
    stop(world)
    world.system_status = 5
    world.run(2)
    assert world.state.operator.stop.cause == "shore link"
    filtered = under_way()
    stop(filtered)
    filtered.system_status, filtered.ekf_ok = 5, False
    filtered.run(2)
    assert filtered.state.operator.stop.cause == "position"


@pytest.mark.parametrize("channel", [0, 2, 7])
def test_sticks_or_switch_that_moved_make_it_a_persons(channel):
    world = under_way()
    stop(world, fence_breached=True)
    moved = list(RESTING)
    moved[channel] += 300
    world.shown["rc_us"] = tuple(moved)
    world.run(3)
    assert world.state.phase is Phase.OPERATOR
    world.run(60)
    assert world.mode is Mode.HOLD


def test_trembling_sticks_and_channels_that_nobody_steers_by_are_no_person():
    world = under_way()
    stop(world, fence_breached=True, rc_us=(1540, 1100, 1460, 1900, 1100, 1000, 1000, 1830))
    assert world.run(20, lambda w: w.mode is Mode.AUTO)


def test_a_receiver_that_lost_its_transmitter_moves_no_sticks():
    world = under_way()
    stop(world, receiver_lost=True, rc_us=(900, 900, 900, 900, 900, 900, 900, 900))
    world.system_status = 5
    assert world.run(20, lambda w: w.mode is Mode.AUTO)


def test_a_person_who_takes_the_sticks_while_she_lies_in_the_failsafes_hold_has_her():
    world = under_way(obstacles=(ISLAND,), goals=(Goal(en_m=(0.0, 300.0), radius_m=8.0),))
    stop(world)
    world.system_status, world.ekf_ok = 5, False  # nothing is planned before the filter is well
    text(world, "EKF failsafe")
    world.run(10)
    assert world.state.operator.answering == "position"
    world.shown["rc_us"] = SWITCHED
    world.run(3)
    assert world.state.phase is Phase.OPERATOR
    world.system_status, world.ekf_ok = 4, True
    world.run(60)
    assert world.mode is Mode.HOLD


def test_out_of_reach_of_the_shore_she_stays_until_it_is_over_and_sails_on():
    world = under_way()
    stop(world)
    world.system_status = 5
    text(world, "GCS Failsafe")
    assert world.run(20, lambda w: w.mode is Mode.AUTO)
    here = world.position
    world.run(120)
    assert world.state.phase is Phase.HOLDING
    assert "until the link to the shore is back" in world.state.why
    assert distance_m(world.position, here) < 30.0
    world.system_status = 4
    assert world.run(600, lambda w: w.state.phase is Phase.DONE)


def test_put_into_rtl_she_is_planned_home_round_what_stands_in_the_way():
    world = under_way(goals=(Goal(en_m=(0.0, 260.0), radius_m=8.0),), obstacles=(ISLAND,), wind=lambda t: (1.5, 5.0))
    assert world.run(300, lambda w: w.position[1] > 180.0)
    stop(world, Mode.RTL)
    world.system_status = 5
    text(world, "Radio Failsafe")
    assert world.run(400, lambda w: "at home" in w.state.why)
    assert distance_m(world.position, (0.0, 0.0)) < 30.0
    assert world.clearance() > 0.0
    world.run(60)
    assert world.state.phase is Phase.HOLDING


def test_a_person_who_gives_auto_ends_the_stay():
    world = under_way()
    stop(world)
    world.system_status = 5
    text(world, "GCS Failsafe")
    assert world.run(20, lambda w: w.mode is Mode.AUTO)
    world.run(60)
    assert world.state.phase is Phase.HOLDING
    world.set_mode(Mode.MANUAL)
    world.run(5)
    assert world.state.phase is Phase.OPERATOR
    world.set_mode(Mode.AUTO)
    assert world.run(600, lambda w: w.state.phase is Phase.DONE)


def test_auto_that_a_person_sets_before_we_ask_for_it_is_his_answer():
    world = under_way()
    stop(world)
    world.system_status, world.ekf_ok = 5, False
    text(world, "EKF failsafe")
    world.run(8)
    world.system_status, world.ekf_ok = 4, True
    world.set_mode(Mode.AUTO)
    world.run(2)
    assert world.state.operator.answering == ""
    assert said(world, "answered")


@pytest.mark.parametrize("refuges", [(), ((150.0, 60.0),)])
def test_the_batterys_failsafe_leads_to_a_refuge_or_to_a_loiter_near_by(refuges):
    world = under_way(voyage={"refuges": refuges})
    here = world.position
    stop(world, battery_failed=True)
    text(world, "Battery 1 is low 10.20V used 0 mAh")
    assert world.run(300, lambda w: "waiting until a person takes her" in w.state.why)
    assert distance_m(world.position, refuges[0] if refuges else here) < 30.0
    world.run(100)
    assert world.state.phase is Phase.HOLDING
    assert world.mode is Mode.AUTO


def test_what_is_answered_survives_a_kill_of_the_companion():
    world = under_way()
    stop(world, fence_breached=True)
    world.run(2)
    assert world.state.operator.answering == "fence"
    restarted(world)
    asked = world.count(act.RequestPlan)
    assert world.run(20, lambda w: w.mode is Mode.AUTO)
    assert world.count(act.RequestPlan) > asked  # from where she has drifted to, before AUTO


def drifts(world):
    return [(t, words) for t, code, words in said(world, "adrift")]


@pytest.mark.parametrize("permission", ["may_set_mode", "may_upload"])
def test_without_permission_it_is_said_every_minute_where_she_drifts_and_what_to_press(permission):
    world = under_way(goals=(Goal(en_m=(0.0, 260.0), radius_m=8.0),), obstacles=(ISLAND,), wind=lambda t: (1.5, 5.0))
    world.permissions = replace(world.permissions, **{permission: False})
    world.heading = 0.0
    world.position = (0.0, 10.0)
    stop(world, fence_breached=True)
    world.run(200)
    assert world.mode is Mode.HOLD
    assert world.state.phase is Phase.OPERATOR
    times = [t for t, _ in drifts(world)]
    assert len(times) == 4
    assert all(59.0 <= b - a <= 61.0 for a, b in pairwise(times))
    first = drifts(world)[0][1]
    assert "HOLD by the fence failsafe" in first
    assert "0.6 m/s towards 000°" in first
    assert "onto o0 in" in first
    assert "press AUTO" in first


def test_a_knock_down_is_left_to_a_person_and_told():
    world = under_way()
    stop(world)
    text(world, "Crash: Going to HOLD")
    world.run(70)
    assert world.mode is Mode.HOLD
    assert "crash failsafe" in world.state.why
    assert len(drifts(world)) == 2
    assert "MANUAL" in drifts(world)[0][1]


def test_disarmed_by_a_failsafe_she_is_told_of_and_not_armed():
    world = under_way()
    world.armed, world.drift_mps = False, 0.5
    text(world, "Battery 1 is critical 9.50V used 0 mAh")
    world.run(70)
    assert not world.armed
    assert "disarmed by the battery failsafe" in drifts(world)[0][1]
    assert "arm her" in drifts(world)[0][1]


def test_rtl_without_permission_is_told_by_its_straight_way():
    world = under_way(goals=(Goal(en_m=(0.0, 260.0), radius_m=8.0),), obstacles=(ISLAND,), wind=lambda t: (1.5, 5.0))
    assert world.run(300, lambda w: w.position[1] > 200.0)
    world.permissions = replace(world.permissions, may_set_mode=False)
    world.sail = lambda dt: None
    world.speed = 2.0
    stop(world, Mode.RTL, fence_breached=True, waypoint_distance_m=210.0, target_bearing_rad=3.14159)
    world.run(10)
    assert "sailing straight home, 180°, onto o0 in" in drifts(world)[0][1]


def test_a_person_is_told_of_a_drift_only_when_it_leads_onto_something():
    world = under_way(goals=(Goal(en_m=(0.0, 260.0), radius_m=8.0),), obstacles=(ISLAND,), wind=lambda t: (1.5, 5.0))
    stop(world)
    world.heading, world.position = 3.14, (0.0, 0.0)
    world.run(100)
    assert drifts(world) == []
    world.heading = 0.0
    world.run(10)
    assert "HOLD by a person" in drifts(world)[0][1]


def test_a_loiter_and_the_end_of_rtl_are_no_drift():
    world = under_way(goals=(Goal(en_m=(0.0, 260.0), radius_m=8.0),), obstacles=(ISLAND,), wind=lambda t: (1.5, 5.0))
    world.position, world.heading, world.drift_mps = (0.0, 20.0), 0.0, 2.0
    world.set_mode(Mode.LOITER)
    world.run(30)
    world.set_mode(Mode.RTL)
    world.shown |= {"waypoint_distance_m": 8.0, "target_bearing_rad": 0.0}
    world.run(30)
    assert drifts(world) == []


def test_a_boat_that_was_never_sailed_is_no_stop():
    world = make(*EAST, obstacles=(), permissions=replace(make().permissions, may_arm=False, may_set_mode=False))
    world.armed, world.mode, world.drift_mps = True, Mode.HOLD, 0.5
    world.run(120)
    assert world.state.operator.stop is None
    assert drifts(world) == []


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.SMART_RTL])
@pytest.mark.parametrize("shown", [{"fence_breached": True}, {"battery_failed": True}])
def test_sailed_home_straight_she_is_back_in_auto_before_any_plan(mode, shown):
    """RTL turns her at full speed towards whatever lies between her and home; a plan takes three seconds."""
    world = under_way()
    stop(world, mode, **shown)
    world.drift_mps = 0.0
    before = len(world.actions)
    world.run(1)
    asked = [a for _, a in world.actions[before:] if isinstance(a, (act.SetMode, act.RequestPlan))]
    assert [type(a) for a in asked] == [act.SetMode]
    assert asked[0].mode is Mode.AUTO
    assert world.run(3, lambda w: w.mode is Mode.AUTO)
    world.run(3)
    assert any(isinstance(a, act.RequestPlan) for _, a in world.actions[before:])  # and then from where she is


def test_sailed_home_where_the_way_on_board_is_shut_a_plan_comes_first():
    world = under_way(goals=(Goal(en_m=(0.0, 200.0), radius_m=8.0),), obstacles=(ISLAND,))
    world.position = (0.0, 70.0)  # swept to where the island stands before her
    world.state = with_parts(world.state, position={"last_seen": None})  # in time: no jump is meant
    stop(world, Mode.RTL, fence_breached=True)
    before = len(world.actions)
    world.run(2)
    asked = [a for _, a in world.actions[before:] if isinstance(a, (act.SetMode, act.RequestPlan))]
    assert asked
    assert isinstance(asked[0], act.RequestPlan)


def test_a_loiter_laid_where_she_lies_is_sailed_to_before_she_drifts_onto_what_is_near():
    """It is the plan that she waits for; while another was waited for she drifted onto the rock."""
    world = under_way(obstacles=(box(130, -60, 170, 60),))
    world.position, world.heading, world.speed = (112.0, 0.0), math.pi / 2.0, 0.6
    # she has come there by sailing: no jump is meant
    world.state = with_parts(world.state, position={"last_seen": None})
    stop(world, battery_failed=True)
    text(world, "Battery 1 is low 10.20V used 0 mAh")
    assert world.run(8, lambda w: w.mode is Mode.AUTO)
    assert world.mission[-1].command is Command.NAV_LOITER_UNLIM
    world.run(60)
    assert world.skipper.voyage.area.clearance_m([world.position])[0] > 5.0


def test_a_loiter_that_cannot_be_sailed_to_any_more_is_laid_anew():
    world = under_way(obstacles=(box(130, -60, 170, 60),))
    stop(world, battery_failed=True)
    assert world.run(8, lambda w: w.mode is Mode.AUTO)
    world.position = (195.0, 0.0)  # set behind the island, and held there once more
    world.heading = math.pi / 2.0
    world.state = with_parts(world.state, position={"last_seen": None})  # a position that leapt would not be believed
    before = len(world.actions)
    stop(world)
    text(world, "Battery 1 is critical 9.10V used 0 mAh")
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    assert any(isinstance(a, act.UploadMission) for _, a in world.actions[before:])


@pytest.mark.parametrize(
    ("name", "words", "is_over"),
    [("battery", "", False), ("shore link", "Radio Failsafe", True), ("position", "EKF failsafe", False)],
)
@pytest.mark.parametrize("answer", list(Recovery))
def test_the_mission_says_what_is_done_about_each(name, words, is_over, answer):
    """``[safety] ..._failsafe``: left alone, sailed on, stayed near by, or to the refuge; the end of a sign."""
    refuge = (40.0, 90.0)
    world = under_way(config={"ends": Ends.of(**{CAUSES[name].key: WORD_OF[answer]})}, voyage={"refuges": (refuge,)})
    here = world.position
    sign = {"battery_failed": True} if name == "battery" else {}
    stop(world, **sign)
    world.system_status = 5 if name == "shore link" else 4
    if words:
        text(world, words)
    world.run(3)
    if answer is Recovery.LEAVE:
        world.run(120)
        assert world.mode is Mode.HOLD
        assert world.state.phase is Phase.OPERATOR
        return
    assert said(world, f"{name} failsafe")
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    world.run(260)
    if answer is Recovery.SAIL_ON:
        assert world.position[0] > 300.0
        return
    place = refuge if answer is Recovery.SHELTER else here
    assert distance_m(world.position, place) < 60.0
    assert world.state.phase is Phase.HOLDING
    world.shown.pop("battery_failed", None)
    world.system_status = 4
    world.run(200)
    assert (distance_m(world.position, place) > 100.0) is is_over


# ------------------------------------------------------------------------------ somebody else's way
def with_their_mission(*places, obstacles=(ISLAND,)):
    world = under_way(obstacles=obstacles)
    world.install((*(waypoint(FRAME.geo_from_en(*place)) for place in places), MissionItem(command=20)))
    world.seq = 1
    text(world, "Flight plan received")
    return world


def test_a_mission_of_somebody_else_s_that_leads_over_something_is_loitered_before_and_only_once():
    """Its legs led over an island, and she was let touch it: 40 s before the hull did that was known."""
    world = with_their_mission((0.0, 300.0))
    assert world.run(120, lambda w: w.mode is Mode.LOITER)
    assert world.state.mission.foreign
    assert float(world.skipper.voyage.area.clearance_m([world.position])[0]) > 15.0
    assert "which is not ours, leads over" in said(world, "kept off")[0][2]
    uploads = world.count(act.UploadMission)
    world.set_mode(Mode.AUTO)  # told, he means it
    world.run(60)
    assert world.mode is Mode.AUTO
    assert world.count(act.UploadMission) == uploads
    assert len(said(world, "kept off")) == 1


def test_a_mission_of_somebody_else_s_that_is_clear_is_left_alone():
    world = with_their_mission((300.0, 100.0))
    world.run(60)
    assert world.state.mission.foreign
    assert world.mode is Mode.AUTO
    assert not said(world, "kept off")


def test_a_failsafe_s_way_home_over_something_is_loitered_before_where_a_stranger_s_mission_is_on_board():
    world = with_their_mission((400.0, 0.0), obstacles=(box(60, -40, 100, 40),))
    world.skipper, behind = under_way(obstacles=()).skipper, world.skipper
    assert world.run(120, lambda w: w.state.mission.foreign and w.position[0] > 115.0)
    world.skipper = behind
    stop(world, Mode.RTL, fence_breached=True, waypoint_distance_m=110.0, target_bearing_rad=-0.5 * math.pi)
    world.drift_mps = 0.0
    world.run(4)
    assert world.mode is Mode.LOITER
    assert "straight way home of the fence failsafe leads over" in said(world, "kept off")[0][2]


@pytest.mark.parametrize("plan_s", [1.0, 30.0])
def test_a_failsafe_does_not_sail_her_home_over_something_while_our_own_way_is_not_there_yet(plan_s):
    behind = under_way(obstacles=(box(15, -40, 45, 40), box(200, -40, 230, 40))).skipper
    world = under_way(obstacles=())
    assert world.run(120, lambda w: w.position[0] > 90.0)
    world.skipper, world.plan_s = behind, plan_s
    stop(world, Mode.RTL, fence_breached=True, waypoint_distance_m=90.0, target_bearing_rad=-0.5 * math.pi)
    world.drift_mps = 0.0
    modes, nearest_m = [], math.inf
    for _ in range(60):
        world.run(1)
        if world.mode is Mode.RTL:  # the autopilot sails home
            world.position = (world.position[0] - 2.0, world.position[1])
        modes.append(world.mode)
        nearest_m = min(nearest_m, float(world.skipper.voyage.area.clearance_m([world.position])[0]))
    assert (Mode.LOITER in modes) is (plan_s > 10.0)
    assert (Mode.AUTO in modes) is (plan_s < 10.0)
    assert nearest_m > 2.0

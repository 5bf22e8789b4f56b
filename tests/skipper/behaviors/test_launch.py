"""Setting sail: from where she lies, and from where she drifts to meanwhile."""

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.messages import Mode, StatusText
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, Permissions
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from companion.skipper.way.voyage import Goal
from tests.skipper.world import World, skipper, voyage

LIMITS = box(-60.0, -60.0, 60.0, 200.0)
ACROSS = Goal(en_m=(0.0, 120.0), radius_m=8.0, name="one")
MAY_UPLOAD = Permissions(may_upload=True)


def make(*, goal=ACROSS, obstacles=(), limits=None, **world):
    made = voyage(goal, obstacles=obstacles, limits=limits)
    return World(skipper=skipper(made, least_depth_m=2.0), **{"wind": lambda t: (math.pi / 2.0, 6.0)} | world)


def is_sailing(world):
    return world.state.voyage.sailing


def is_done(world):
    return world.state.phase is Phase.DONE


@pytest.mark.parametrize("place", [(0.0, -62.0), (0.0, -70.0), (0.0, -90.0), (75.0, 20.0)])
def test_outside_the_fence_she_sets_sail_on_the_plan_that_leads_back_in(place):
    """Each of 29 plans was refused after its upload: "she is 44 m outside the fence"."""
    world = make(limits=LIMITS, position=place)
    assert world.run(60, is_sailing), world.state.why
    assert world.count(act.UploadMission) == 1
    assert world.state.plans.replans == 0
    assert world.run(200, is_done)


def test_drifted_out_of_the_fence_while_the_plan_was_made_she_sets_sail():
    world = make(limits=LIMITS, position=(0.0, -50.0), current=lambda t: (0.0, -1.0 if t < 25.0 else 0.0), plan_s=14.0)
    assert world.run(60, is_sailing), world.state.why
    assert min(north for _, north in world.track) < -60.0
    assert world.state.plans.replans == 0


def test_outside_the_fence_she_is_not_led_back_over_a_rock():
    """Drifted along the fence, the way to the first waypoint is another than was planned."""
    rock = box(-20.0, -90.0, 20.0, -75.0)
    world = make(limits=LIMITS, obstacles=(rock,), position=(-70.0, -70.0), permissions=MAY_UPLOAD)
    assert world.run(60, lambda w: bool(w.mission))
    world.state = replace(world.state, position=replace(world.state.position, last_seen=None))
    world.position = (30.0, -120.0)
    world.state = replace(world.state, plans=replace(world.state.plans, last_s=world.t))
    asked = world.count(act.RequestPlan)
    assert world.run(60, lambda w: w.count(act.RequestPlan) > asked and not w.state.pending.plan)
    world.permissions = ALL_PERMITTED
    assert world.run(60, is_sailing), world.state.why
    assert world.run(200, is_done)
    assert world.skipper.voyage.area.unfenced.path_clearance_m(world.track[-200:]) > 0.0


def test_far_from_her_mission_no_plan_is_uploaded_again_and_again():
    world = make(permissions=MAY_UPLOAD)
    assert world.run(60, lambda w: bool(w.mission))
    world.run(5)
    world.position = (0.0, -200_000.0)
    world.state = replace(world.state, position=replace(world.state.position, last_seen=None))
    uploads, plans = world.uploads, world.count(act.RequestPlan)
    world.permissions = ALL_PERMITTED
    world.run(300)
    assert not is_sailing(world)
    assert "is it the right mission" in world.state.why
    assert (world.uploads, world.count(act.RequestPlan)) == (uploads, plans)
    assert sum(entry[1] == "far off" for entry in world.log) == 1


@pytest.mark.parametrize("knots", [0.7, 1.2, 2.0])
def test_a_boat_that_drifts_is_planned_for_from_where_she_gathers_way_and_sets_sail(knots):
    """Planned for from where she had lain, she came to 1.7 m where 5.4 were promised, the floor 3."""
    world = make(position=(-40.0, 0.0), current=lambda t: (knots, 0.0))
    starts = []
    assert world.run(60, lambda w: starts.append(w.position) or is_sailing(w)), world.state.why
    asked_s, asked = next((t, a) for t, a in world.actions if isinstance(a, act.RequestPlan))
    ahead_m = asked.problem.start_en[0] - starts[round(asked_s) - 1][0]
    assert ahead_m > 4.0 * knots
    assert world.count(act.RequestPlan) == 1
    assert world.run(200, is_done)


def test_a_drift_that_carries_her_behind_something_before_she_gathers_way_is_planned_for_anew():
    """The way from where she lay was clear: AUTO and arming were asked for, and she was behind the rock by then."""
    rock, drift = box(-20.0, 15.0, 200.0, 25.0), [0.0]
    world = make(obstacles=(rock,), position=(-60.0, 0.0), current=lambda t: (drift[0], 0.0), permissions=MAY_UPLOAD)
    assert world.run(60, lambda w: bool(w.mission))
    world.run(30)
    first, asked, drift[0] = world.state.mission.route.points_en_m[0], world.count(act.RequestPlan), 2.0
    assert world.run(30, lambda w: w.count(act.RequestPlan) > asked)
    assert "before she gathers way she drifts" in world.actions[-1][1].text
    assert world.skipper.voyage.area.path_clearance_m([world.position, first]) > world.skipper.config.margin_floor_m
    world.permissions = ALL_PERMITTED
    assert world.run(60, is_sailing), world.state.why
    assert world.count(act.RequestPlan) <= asked + 3  # and does not plan for ever
    assert world.state.plans.replans == 0  # as the record counts them: of plans under way


def test_the_clearance_told_at_setting_sail_is_that_of_the_way_from_where_she_is():
    wall = box(-200.0, -60.0, 200.0, -20.0)
    world = make(obstacles=(wall,), position=(0.0, 0.0), permissions=MAY_UPLOAD)
    assert world.run(60, lambda w: bool(w.mission))
    promised_m = world.state.mission.route.expected_clearance_m
    world.current = lambda t: (0.0, -1.2)
    world.run(6)  # with the plan on board, and no reason for another
    world.permissions = ALL_PERMITTED
    assert world.run(60, is_sailing)
    begun = len(world.track) - 5
    told_m = world.state.mission.route.expected_clearance_m
    world.run(20)
    came_m = world.skipper.voyage.area.path_clearance_m(world.track[begun:]) - world.skipper.voyage.boat.hull.reach_m
    assert told_m < promised_m - 5.0
    assert told_m <= came_m + 0.5


def test_once_she_is_clear_of_where_she_drifted_to_the_clearance_told_is_the_plans():
    """ "clearance expected 0.4 m inside what was drawn or found since" stood on the line for a whole voyage."""
    world = make(obstacles=(box(-200.0, -60.0, 200.0, -20.0),), position=(0.0, 0.0), permissions=MAY_UPLOAD)
    assert world.run(60, lambda w: bool(w.mission))
    promised_m = world.state.mission.route.expected_clearance_m
    world.current = lambda t: (0.0, -1.2)
    world.run(6)
    world.permissions = ALL_PERMITTED
    assert world.run(60, is_sailing)
    world.current = lambda t: (0.0, 0.0)
    route = world.state.mission.route
    assert route.expected_clearance_m < promised_m - 5.0
    saved = Persisted.from_dict(world.skipper.persisted(world.state).to_dict())
    assert saved.lists[0].planned_clearance_m == promised_m
    assert world.run(60, lambda w: w.state.mission.route.planned_clearance_m is None)
    assert world.state.mission.route.plan_id == route.plan_id
    assert world.state.mission.route.expected_clearance_m == promised_m
    off_m = world.skipper.voyage.area.clearance_m([world.position])[0]
    assert promised_m <= off_m < promised_m + 8.0


def chosen(world, mode):
    """Let somebody else set a mode, as far as that, before she sets sail."""
    world.permissions = MAY_UPLOAD
    assert world.run(60, lambda w: bool(w.mission))
    world.set_mode(mode)
    world.run(2)
    world.permissions = ALL_PERMITTED
    return world


@pytest.mark.parametrize("mode", [Mode.HOLD, Mode.GUIDED, Mode.LOITER])
@pytest.mark.parametrize("way", ["AUTO", "go_on"])
def test_a_mode_that_somebody_sets_before_she_sails_is_not_overruled(mode, way):
    """HOLD that was set while the plan was made was answered with AUTO and arming."""
    world = chosen(make(), mode)
    world.run(90)
    assert (world.mode, world.armed) == (mode, False)
    assert f"{mode.name} was set by somebody else" in world.state.why
    assert sum(entry[1] == "put" for entry in world.log) == 1
    if way == "AUTO":
        world.set_mode(Mode.AUTO)
    else:
        world.order("go_on")
    assert world.run(20, is_sailing), world.state.why


@pytest.mark.parametrize("mode", [Mode.MANUAL, Mode.HOLD, Mode.LOITER])
def test_whatever_she_is_switched_on_in_she_sets_sail_from(mode):
    world = make(mode=Mode.INITIALISING)
    world.run(2)
    world.set_mode(mode)
    assert world.run(60, is_sailing), world.state.why


def test_hold_by_a_failsafe_before_she_sails_is_no_persons():
    world = make(permissions=MAY_UPLOAD)
    assert world.run(60, lambda w: bool(w.mission))
    world.set_mode(Mode.HOLD)
    world.events.append(StatusText(t_s=world.t, severity=2, text="EKF failsafe"))
    world.run(2)
    world.permissions = ALL_PERMITTED
    assert world.run(20, is_sailing), world.state.why


def test_a_reboot_before_she_sails_makes_what_she_is_switched_on_in_nobodys_choice():
    world = chosen(make(), Mode.HOLD)
    world.run(5)
    world.boot_s = -world.t
    assert world.run(60, is_sailing), world.state.why

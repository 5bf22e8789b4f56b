"""A wind that is not to be planned with: the boat waits in a loiter with sea room, and nothing is planned."""

import math

import pytest
from shapely.geometry import box

from companion.geo.angles import difference_rad
from companion.messages import Command, Mode
from companion.skipper.behaviors.wind_doubt import SEA_ROOM, STRAYS_M, WAITS, DoubtedWind, sea_room
from companion.skipper.step import ParameterChanged, Permissions, WindBefore
from companion.skipper.step import actions as act
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import is_done, make, said
from tests.skipper.world import area, restarted, with_parts

WHY = "the wind's direction leapt by +90° and she makes 0.7 m/s astern where 2.2 m/s were to be expected"
SAILS = {Phase.STANDARD, Phase.DESTINATION_APPROACH}


def under_way(**made):
    world = make(**made)
    assert world.run(120, lambda w: w.state.phase in SAILS and w.t > 40.0)
    return world


def asked_since(world, t_s, kind):
    return [a for at_s, a in world.actions if at_s >= t_s and isinstance(a, kind)]


def test_she_loiters_while_it_lasts_and_sails_on_by_a_plan_from_where_she_is():
    world = under_way()
    world.extra["unsure"], begins = WHY, world.t
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.run(120)
    assert world.mode is Mode.LOITER
    assert world.state.phase is Phase.HOLDING
    assert WHY in world.state.why
    assert not asked_since(world, begins, act.RequestPlan), "neither a plan nor a step of the ladder"
    assert said(world, "wind contradicted")
    assert 2 <= len(said(world, "held")) <= 3, "once a minute"
    world.run(300)
    assert not said(world, "no progress"), "none is looked for"
    world.extra["unsure"], ends = "", world.t
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    assert asked_since(world, ends, act.RequestPlan)[0].from_seq is None
    assert world.run(1500, is_done)


def test_the_last_goal_reached_meanwhile_does_not_take_the_loiter_away():
    """AUTO was given back "to the mission" by a wind that nobody knew, 12 m from a lee shore."""
    world = under_way()
    world.extra["unsure"], begins = WHY, world.t
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.state = with_parts(world.state, progress={"gate": 1})  # what came in meanwhile
    world.run(60)
    assert world.mode is Mode.LOITER
    assert not any(a.mode is Mode.AUTO for a in asked_since(world, begins, act.SetMode))
    assert world.state.phase is Phase.HOLDING
    world.extra["unsure"] = ""
    assert world.run(60, lambda w: is_done(w) and w.mode is Mode.AUTO)


def test_a_plan_that_is_being_made_is_called_off_and_no_rung_follows_it():
    world = under_way(plan_s=5.0)
    assert world.run(300, lambda w: w.state.pending.plan is not None)
    number = world.state.pending.plan.request_id
    world.extra["unsure"], begins = WHY, world.t
    world.run(20)
    assert [a.request_id for a in asked_since(world, begins, act.CancelPlan)] == [number]
    assert world.state.pending.plan is None
    assert not asked_since(world, begins, act.RequestPlan)


def test_without_the_permission_to_set_modes_it_is_said_and_nothing_is_planned():
    world = under_way()
    world.permissions = Permissions(may_upload=True)
    world.extra["unsure"], begins = WHY, world.t
    world.run(60)
    assert world.mode is Mode.AUTO
    assert not asked_since(world, begins, act.SetMode)
    assert not asked_since(world, begins, act.RequestPlan)
    assert said(world, "held")


def test_a_wind_that_is_contradicted_stems_no_drift_and_the_anchor_is_called_for():
    """What she could sail against the drift is reckoned from the wind that is not believed."""
    world = under_way()
    world.extra["unsure"] = WHY
    world.drift_mps, world.current = 0.0, lambda t: (0.0, 0.8)
    assert world.run(400, lambda w: bool(said(w, "anchor")))
    assert not any(text.endswith(": loiter") for _, _, text in said(world, "drift"))


@pytest.mark.parametrize("name", ["WNDVN_DIR_OFS", "SERVO1_REVERSED"])
def test_a_parameter_that_somebody_set_is_said(name):
    world = under_way()
    world.events.append(ParameterChanged(name=name, text=f"{name} was set from 0 to 1"))
    world.run(2)
    assert said(world, "parameter")[0][2] == f"{name} was set from 0 to 1"


# ------------------------------------------------------------------------------------------ sea room
ROCK = box(30.0, -60.0, 90.0, -40.0)  # to leeward of a boat that reaches east in a wind from the north
TURNED = WindBefore(twd_from_rad=0.0, tws_mps=5.0, turned_rad=math.radians(90.0))


def north_of_the_rock(obstacles=(ROCK,)):
    world = make(Goal(en_m=(400.0, 0.0)), obstacles=obstacles, wind=lambda t: (0.0, 5.0))
    assert world.run(120, lambda w: w.position[0] > 50.0)
    assert world.mode is Mode.AUTO
    return world


def doubted(world, before=TURNED):
    world.extra |= {"unsure": WHY, "wind_before": before}
    return world.t


def test_a_loiter_that_would_be_driven_onto_a_rock_waits_for_sea_room():
    world = north_of_the_rock()
    begins = doubted(world)
    assert world.state.mission.route.expected_clearance_m is not None
    assert world.run(10, lambda w: w.state.mission.route.rung == SEA_ROOM)
    assert world.state.mission.route.expected_clearance_m is None, "the old plan's"
    [item] = world.mission[-1:]
    place = world.state.mission.route.points_en_m[-1]
    assert item.command == Command.NAV_LOITER_UNLIM
    assert area(ROCK).path_clearance_m([place, (place[0], place[1] - 300.0)]) > world.skipper.config.margin_floor_m
    assert not asked_since(world, begins, act.RequestPlan)
    world.run(100)
    assert distance_m(world.position, place) < 20.0
    assert world.mode is Mode.AUTO, "in the loiter that ends the leg"
    assert world.state.why == f"{WHY}: {WAITS}"
    assert world.clearance() > world.skipper.config.margin_floor_m
    assert len(said(world, SEA_ROOM)) == 1
    world.extra = {}
    assert world.run(600, is_done), "sailed on when the wind is known"


def test_a_place_has_room_to_circle_in_and_is_reached_from_all_of_the_loiter():
    """Should the told wind be right after all: sent 40 m on to an islet, a boat that was held in a front touched it."""
    wind = DoubtedWind(true_from_rad=0.0, told_from_rad=math.radians(150.0), drift_en_mps=(0.0, -1.0))
    lee, half_rad, boat = box(-60.0, -60.0, 25.0, -40.0), math.radians(45.0), (0.0, 0.0)
    starts = [(8.0, 0.0), (0.0, 8.0), (0.0, -8.0), (-8.0, 0.0)]
    found = sea_room(area(lee), boat, starts, wind, no_go_half_rad=half_rad, clear_m=(15.0, 8.0))
    assert found is not None
    east, north = found[0]
    for islet in (
        box(east - 2.0, north + 18.0, east + 2.0, north + 22.0),
        box(0.5 * east - 1.0, 0.5 * north + 16.0, 0.5 * east + 1.0, 0.5 * north + 18.0),
    ):
        water = area(lee, islet)
        other = sea_room(water, boat, starts, wind, no_go_half_rad=half_rad, clear_m=(15.0, 8.0))
        assert other is not None
        assert other[0] != found[0]
        assert water.clearance_m([other[0]])[0] >= 8.0 + STRAYS_M
        assert min(water.path_clearance_m([start, other[0]]) for start in starts) >= 8.0


def test_a_loiter_that_has_kept_its_place_is_not_left_for_sea_room():
    """It would have been driven off by now, were the wind another than is told: it was a front."""
    world = north_of_the_rock()
    world.permissions = Permissions(may_set_mode=True)
    doubted(world)
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.run(60)
    world.permissions = Permissions(may_set_mode=True, may_upload=True)
    world.run(30)
    assert not said(world, SEA_ROOM)


@pytest.mark.parametrize(("obstacles", "turned_deg"), [((), 90.0), ((ROCK,), 30.0)])
def test_with_nothing_to_leeward_or_a_wind_that_has_hardly_turned_it_loiters_at_once(obstacles, turned_deg):
    world = north_of_the_rock(obstacles)
    doubted(world, WindBefore(twd_from_rad=0.0, tws_mps=5.0, turned_rad=math.radians(turned_deg)))
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.run(30)
    assert not said(world, SEA_ROOM)


@pytest.mark.parametrize("turned_deg", [30.0, 140.0])
@pytest.mark.parametrize(("off_m", "leaves"), [(18.0, True), (40.0, False)])
def test_a_loiter_circles_and_is_not_begun_beside_a_rock(turned_deg, off_m, leaves):
    """Driven to leeward by the wind that blew before she is clear of it; by the told one she turns about her place."""
    world = north_of_the_rock((box(0.0, off_m, 120.0, off_m + 20.0),))
    doubted(world, WindBefore(twd_from_rad=0.0, tws_mps=5.0, turned_rad=math.radians(turned_deg)))
    world.run(60)
    assert bool(said(world, SEA_ROOM)) is leaves
    if leaves:
        assert "circle too near" in said(world, SEA_ROOM)[0][2]
        place = world.state.mission.route.points_en_m[-1]
        assert world.skipper.voyage.area.clearance_m([place])[0] >= STRAYS_M + 8.0
        world.run(60)
        assert world.clearance() > 8.0


def test_beside_a_rock_a_drift_that_is_minutes_off_is_the_better():
    """Each place to go to was to be driven off no sooner than where she lay: she lay on, and came to 1.8 m of it."""
    coast = box(-2000.0, -280.0, 2000.0, -260.0)
    world = north_of_the_rock((box(0.0, 18.0, 120.0, 38.0), coast))
    doubted(world, WindBefore(twd_from_rad=0.0, tws_mps=5.0, turned_rad=math.radians(90.0)))
    assert world.run(60, lambda w: bool(said(w, SEA_ROOM)))
    assert "circle too near" in said(world, SEA_ROOM)[0][2]


def test_where_no_course_leads_to_sea_room_it_loiters():
    world = north_of_the_rock((box(-300.0, -60.0, 500.0, -40.0),))
    doubted(world)
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    assert not said(world, SEA_ROOM)


@pytest.mark.parametrize("is_sailing", [True, False])
def test_a_boat_that_makes_way_between_banks_is_not_put_into_a_loiter_that_has_no_room(is_sailing):
    """A front of 148 degrees in a channel: "the vane was turned", and she circled onto both its banks."""
    world = north_of_the_rock((box(-300.0, -60.0, 500.0, -22.0), box(-300.0, 22.0, 500.0, 60.0)))
    begins = doubted(world)
    if not is_sailing:
        world.wind, world.speed = lambda t: (math.pi / 2.0, 5.0), 0.0
    world.run(10)
    assert bool(asked_since(world, begins, act.SetMode)) is not is_sailing
    assert not asked_since(world, begins, act.RequestPlan)
    if is_sailing:
        assert world.state.why == f"{WHY}: sailing on, waiting until a loiter's circles have room"


def test_going_astern_in_a_loiter_shows_the_true_wind_that_nobody_remembers():
    world = north_of_the_rock()
    doubted(world, None)
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.run(5)
    assert not said(world, SEA_ROOM)
    world.wind, world.heading, world.current = lambda t: (math.pi / 2.0, 5.0), 0.0, lambda t: (0.0, -0.8)
    assert world.run(15, lambda w: bool(said(w, SEA_ROOM)))


def test_after_a_restart_the_wind_of_the_plan_on_board_is_the_true_one():
    world = north_of_the_rock()
    restarted(world)
    doubted(world, None)
    world.wind = lambda t: (math.pi / 2.0, 5.0)
    assert world.run(30, lambda w: bool(said(w, SEA_ROOM)))


def test_a_sternway_that_meets_something_is_a_drift_at_once():
    """Not when it has carried the boat 25 m from the loiter's point: by then there is no time for the anchor."""
    world = north_of_the_rock()
    world.permissions = Permissions(may_set_mode=True)  # what stops it is left: sea room takes an upload
    doubted(world)
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.heading, world.speed, world.current = 0.0, 0.0, lambda t: (0.0, -0.8)
    assert world.run(20, lambda w: bool(said(w, "anchor")))
    assert world.position[1] > -10.0


def test_every_turn_of_the_vane_leaves_courses_that_are_sailed_in_both_winds():
    half_rad = math.radians(45.0)
    for turned_deg in range(46, 315, 3):
        wind = DoubtedWind(true_from_rad=0.0, told_from_rad=math.radians(turned_deg), drift_en_mps=(0.0, -1.0))
        courses = [math.radians(c) for c in range(0, 360, 5) if wind.sails(math.radians(c), half_rad)]
        assert len(courses) >= 10, turned_deg
        assert all(abs(difference_rad(c, 0.0)) > half_rad for c in courses), "none in the true no-go zone"


# ---------------------------------------------------------------------------------- the loiter's point
@pytest.mark.parametrize(("obstacles", "anew"), [((ROCK,), True), ((), False)])
def test_a_loiter_whose_point_lies_beyond_something_is_begun_anew(obstacles, anew):
    world = north_of_the_rock(obstacles)
    doubted(world, None)
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.run(10)
    begins, world.shown = world.t, {"waypoint_distance_m": 90.0, "target_bearing_rad": math.pi}
    world.run(6)
    world.shown = {"waypoint_distance_m": 1.0, "target_bearing_rad": math.pi}
    modes = [a.mode for a in asked_since(world, begins, act.SetMode)]
    assert modes == ([Mode.HOLD, Mode.LOITER] if anew else [])
    world.run(10)
    assert world.mode is Mode.LOITER


def test_at_her_mooring_she_does_not_set_sail_by_a_wind_that_is_doubted():
    world = make()
    assert world.run(60, lambda w: w.state.mission.route is not None and not w.armed)
    world.extra["unsure"] = WHY
    world.run(30)
    assert not world.armed
    assert "a wind that is known" in world.state.why
    world.extra["unsure"] = ""
    assert world.run(60, lambda w: w.mode is Mode.AUTO and w.armed)

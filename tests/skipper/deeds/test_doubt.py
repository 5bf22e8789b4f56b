"""A position that jumped: believed when it is back, and stood off from while the other place is not clear ahead."""

from dataclasses import replace

import pytest
import shapely
import shapely.ops

from companion.messages import Mode, StatusText
from companion.skipper.step import actions as act
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import bearing_rad, distance_m, moved
from tests.skipper.test_voyage import GOAL, is_done, make, said


def raised(world):
    return any(r.name == "position jump" for r in world.state.raised)


def false_place(world):
    """Return a place in clear water from which the way to the waypoint is, where the boat is, the way to an island."""
    area = world.skipper.voyage.area
    rock = min(area.polygons, key=lambda p: p.distance(shapely.Point(world.position)))
    near = shapely.ops.nearest_points(rock, shapely.Point(world.position))[0]
    way = bearing_rad(world.position, (near.x, near.y))
    return moved(world.state.route.points_en_m[world.state.index], way, -150.0)


def lie(world):
    place = false_place(world)
    assert world.skipper.voyage.area.clearance_m([place])[0] > 30.0
    world.position_offset = (place[0] - world.position[0], place[1] - world.position[1])


def is_near_an_island(world):
    sails = world.state.phase in {Phase.STANDARD, Phase.DESTINATION_APPROACH}
    return sails and world.skipper.voyage.area.clearance_m([world.position])[0] < 30.0


def test_a_loiter_that_we_asked_for_in_a_failsafes_hold_is_no_persons():
    """Seed 1 of the fault campaign: put into HOLD by the jump, it stood off, and took its own LOITER for a person's."""
    world = make()
    assert world.run(600, lambda w: is_near_an_island(w) and w.skipper.voyage.area.clearance_m([w.position])[0] < 20.0)
    lie(world)
    world.set_mode(Mode.HOLD)
    world.events.append(StatusText(t_s=world.t, severity=2, text="EKF failsafe"))
    world.system_status, world.ekf_ok = 5, False
    world.run(8)
    world.system_status, world.ekf_ok = 4, True
    assert world.run(10, lambda w: w.mode is Mode.LOITER)
    world.run(3)
    assert not said(world, "operator")
    assert world.state.phase is Phase.HOLDING
    world.position_offset = (0.0, 0.0)
    assert world.run(60, lambda w: w.mode is Mode.AUTO)


@pytest.mark.parametrize("stays_s", [4, 15])
def test_a_jump_back_to_where_the_boat_was_reckoned_is_believed_at_once(stays_s):
    world = make(obstacles=())
    world.run(60)
    world.position_offset = (150.0, -40.0)
    world.run(stays_s)
    assert raised(world)
    world.position_offset = (0.0, 0.0)
    world.run(2)
    assert not raised(world)
    assert said(world, "position back")
    assert world.mode is Mode.AUTO
    assert world.run(1500, is_done)


def test_a_jump_elsewhere_is_not_taken_for_a_way_back():
    world = make(obstacles=())
    world.run(60)
    world.position_offset = (150.0, -40.0)
    world.run(5)
    world.position_offset = (60.0, 60.0)
    world.run(3)
    assert raised(world)
    assert not said(world, "position back")


def test_it_loiters_while_the_other_place_is_not_clear_ahead_and_sails_on_when_the_position_is_back():
    world = make()
    assert world.run(600, is_near_an_island)
    lie(world)
    assert world.run(6, lambda w: w.mode is Mode.LOITER)
    assert said(world, "standing off")
    world.run(30)
    assert world.mode is Mode.LOITER                    # longer than the 20 s of a jump in clear water
    assert world.state.phase is Phase.HOLDING
    asked = world.count(act.RequestPlan)
    world.position_offset = (0.0, 0.0)
    assert world.run(12, lambda w: w.mode is Mode.AUTO)
    assert world.count(act.RequestPlan) > asked         # from where it is
    assert not said(world, "operator")
    assert world.run(1500, is_done)
    assert distance_m(world.position, GOAL.en_m) < 25.0


def test_without_permission_it_does_not_touch_the_mode():
    world = make()
    assert world.run(600, is_near_an_island)
    world.permissions = replace(world.permissions, may_set_mode=False)
    lie(world)
    world.run(10)
    assert world.mode is Mode.AUTO

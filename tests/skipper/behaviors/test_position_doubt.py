"""A position that jumped: believed when it is back, and stood off from while the other place is not clear ahead."""

import itertools
import math
from dataclasses import replace

import pytest
import shapely
import shapely.ops

from companion.messages import Mode, StatusText
from companion.skipper.step import actions as act
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import bearing_rad, distance_m, moved
from tests.skipper.test_voyage import GOAL, ISLANDS, is_done, make, said
from tests.skipper.world import FRAME, restarted


def raised(world):
    return any(r.name == "position jump" for r in world.state.alarms.raised)


def false_place(world):
    """Return a place in clear water from which the way to the waypoint is, where the boat is, the way to an island."""
    area = world.skipper.voyage.area
    rock = min(area.polygons, key=lambda p: p.distance(shapely.Point(world.position)))
    near = shapely.ops.nearest_points(rock, shapely.Point(world.position))[0]
    way = bearing_rad(world.position, (near.x, near.y))
    return moved(world.state.mission.route.points_en_m[world.state.mission.index], way, -150.0)


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
    assert world.mode is Mode.LOITER  # longer than the 20 s of a jump in clear water
    assert world.state.phase is Phase.HOLDING
    asked = world.count(act.RequestPlan)
    world.position_offset = (0.0, 0.0)
    assert world.run(12, lambda w: w.mode is Mode.AUTO)
    assert world.count(act.RequestPlan) > asked  # from where it is
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


UTC_S = 1_780_000_000.0


def land(world):
    """Lie a place in the middle of an island: nothing that could be sailed from."""
    rock = min(world.skipper.voyage.area.polygons, key=lambda p: -p.distance(shapely.Point(world.position)))
    place = rock.representative_point()
    world.position_offset = (place.x - world.position[0], place.y - world.position[1])
    assert world.skipper.voyage.area.clearance_m([(place.x, place.y)])[0] < -15.0


def asked(world, since):
    return [a for _, a in world.actions[since:] if isinstance(a, (act.RequestPlan, act.UploadMission, act.SetMode))]


def on_land(**changes):
    """Return a world that loiters since its position has jumped onto an island."""
    world = make(**changes)
    assert world.run(600, is_near_an_island)
    land(world)
    assert world.run(6, lambda w: w.mode is Mode.LOITER)
    return world


def test_a_place_inside_an_island_is_never_planned_from_and_a_safe_loiter_not_left_for_it():
    """A jump of 500 m for a minute: led 140 m into free water, AUTO at 137 s and ashore at 162."""
    world = on_land()
    since = len(world.actions)
    world.run(400)
    assert not asked(world, since)
    assert world.mode is Mode.LOITER
    assert "doubted" in world.state.why
    world.position_offset = (0.0, 0.0)
    assert world.run(12, lambda w: w.mode is Mode.AUTO)
    assert world.run(1500, is_done)


def test_a_loiter_in_doubt_is_kept_whatever_way_its_circle_goes_just_now():
    world = make()
    assert world.run(600, is_near_an_island)
    lie(world)
    assert world.run(6, lambda w: w.mode is Mode.LOITER)
    since = len(world.actions)
    for n in range(240):
        world.heading, world.speed = 0.6 * n, 2.0  # as LOITER turns
        world.step()
    assert not asked(world, since)
    assert world.mode is Mode.LOITER


def test_a_loiter_whose_point_jumps_with_the_position_is_begun_anew():
    """Its point is elsewhere on earth then, and she would sail there over whatever lies between."""
    world = on_land()
    world.run(10)
    since = len(world.actions)
    world.position_offset = (world.position_offset[0] + 70.0, world.position_offset[1])
    world.run(8)
    modes = [a.mode for a in asked(world, since)]
    assert modes == [Mode.HOLD, Mode.LOITER]
    assert world.mode is Mode.LOITER
    assert not said(world, "operator")


@pytest.mark.parametrize("is_turning", [True, False])
def test_before_a_loiter_is_begun_anew_hold_waits_until_loiter_has_turned_her_away_from_what_is_ahead(is_turning):
    """In HOLD nobody steers: she ran on, and ashore. Where LOITER leads there as well HOLD does not wait."""
    world = on_land()
    world.run(10)
    place = world.state.position.doubt.reckoned_en_m
    rock = min(world.skipper.voyage.area.polygons, key=lambda p: p.distance(shapely.Point(place)))
    near = shapely.ops.nearest_points(rock, shapely.Point(place))[0]
    away_m, onto = distance_m(place, (near.x, near.y)), bearing_rad(place, (near.x, near.y))
    world.shown = {"waypoint_distance_m": 60.0, "target_bearing_rad": onto + (math.pi if is_turning else 0.0)}
    world.position_offset = (world.position_offset[0] + 70.0, world.position_offset[1])
    since = len(world.actions)
    for _ in range(2):
        world.heading, world.speed = onto, away_m / 5.0  # ashore in less than 7 s
        world.step()
    assert (not asked(world, since)) is is_turning
    world.heading = onto + math.pi
    world.run(8)
    assert [a.mode for a in asked(world, since)] == [Mode.HOLD, Mode.LOITER]


def test_a_loiter_is_begun_anew_at_once_where_hold_runs_on_onto_something():
    """A plan is asked for meanwhile, and takes the seconds that there are: she ran on in HOLD and touched."""
    world = on_land()
    world.run(10)
    since = len(world.actions)
    rock = min(world.skipper.voyage.area.polygons, key=lambda p: p.distance(shapely.Point(world.position)))
    near = shapely.ops.nearest_points(rock, shapely.Point(world.position))[0]
    onto, away_m = bearing_rad(world.position, (near.x, near.y)), distance_m(world.position, (near.x, near.y))
    world.shown = {"waypoint_distance_m": away_m + 60.0, "target_bearing_rad": onto}
    world.plan_s = 8.0
    world.position_offset = (0.0, 0.0)  # it is where she is again, and the loiter's point is not
    for _ in range(5):
        world.heading, world.speed = onto, away_m / 6.0
        world.position = moved((near.x, near.y), onto + math.pi, away_m)
        world.step()
    assert any(isinstance(a, act.RequestPlan) for _, a in world.actions[since:])
    modes = [a.mode for a in asked(world, since) if isinstance(a, act.SetMode)]
    assert modes[:2] == [Mode.HOLD, Mode.LOITER]


def test_a_start_in_the_middle_of_an_island_is_none():
    world = make(obstacles=(shapely.box(-100.0, 100.0, 100.0, 300.0),))
    world.position = (-5.0, 200.0)
    world.run(60)
    assert not world.count(act.RequestPlan)
    assert "inside" in world.state.why


def test_a_boat_that_is_set_onto_something_while_she_is_in_doubt_calls_her_crew_by_the_reckoned_track():
    world = on_land()
    place = world.skipper.voyage.area.polygons[0]
    near = shapely.ops.nearest_points(place, shapely.Point(world.position))[0]
    away = distance_m(world.position, (near.x, near.y))
    set_en = tuple((b - a) / away * 0.5 for a, b in zip(world.position, (near.x, near.y), strict=True))
    world.wind, world.current = (lambda t: (0.0, 0.1)), (lambda t: set_en)
    world.run(90)
    assert said(world, "anchor")


@pytest.mark.parametrize("knows_time", [True, False])
def test_a_doubt_outlives_the_companion(knows_time):
    world = on_land(shown={"utc_at_boot_s": UTC_S})
    world.run(20)
    if not knows_time:
        world.shown = {}
    restarted(world)
    since = len(world.actions)
    world.run(120)
    assert not asked(world, since)
    assert world.mode is Mode.LOITER
    world.position_offset = (0.0, 0.0)
    assert world.run(20, lambda w: w.mode is Mode.AUTO)


def test_a_position_that_jumped_while_the_companion_was_dead_is_doubted_by_who_comes_next():
    world = make(shown={"utc_at_boot_s": UTC_S})
    assert world.run(600, is_near_an_island)
    restarted(world)
    world.position_offset = (70.0, -40.0)  # farther than she sails in the seconds since her place was saved
    assert world.run(10, lambda w: w.state.position.doubt is not None)
    assert "before this start" in world.state.position.doubt.why
    world.position_offset = (0.0, 0.0)
    assert world.run(3, lambda w: w.state.position.doubt is None)


def silent(world, seconds):
    """Let the boat sail on while the link is dead; the companion lives."""
    for _ in range(seconds):
        world.extra = {"vehicle_age_s": 1e3, "heartbeat_age_s": 1e3, "position_en_m": None}
        world.step()
    world.extra = {}


@pytest.mark.parametrize("silent_s", [6, 15])
def test_a_position_that_jumped_while_the_link_was_silent_is_doubted_as_one_that_was_seen_to(silent_s):
    world = make()
    assert world.run(600, is_near_an_island)
    silent(world, silent_s)
    lie(world)
    assert world.run(6, lambda w: w.mode is Mode.LOITER)
    assert raised(world)
    assert "in a silence of" in world.state.position.doubt.why
    since = len(world.actions)
    world.run(60)
    assert not asked(world, since)
    world.position_offset = (0.0, 0.0)
    assert world.run(12, lambda w: w.mode is Mode.AUTO)
    assert world.run(1500, is_done)


@pytest.mark.parametrize("silent_s", [5, 20, 60])
def test_what_she_sails_on_by_herself_in_a_silence_is_no_jump(silent_s):
    world = make()
    world.run(40)
    for _ in range(4):
        silent(world, silent_s)
        world.run(15)
    assert not said(world, "position doubted")
    assert not raised(world)
    assert world.run(1500, is_done)


@pytest.mark.parametrize(("obstacles", "every_s"), [(ISLANDS, 5.0), ((), 30.0)])
def test_her_place_is_saved_with_her_speed_and_oftener_near_something_solid(obstacles, every_s):
    world = make(obstacles=obstacles, shown={"utc_at_boot_s": UTC_S})
    world.run(40)
    places = []
    for _ in range(90):
        world.step()
        place = world.state.position.place
        if place is not None and place not in places:
            places.append(place)
    apart_s = [b.utc_s - a.utc_s for a, b in itertools.pairwise(places)]
    assert min(apart_s) == pytest.approx(every_s, abs=0.2)
    assert max(apart_s) <= 30.2, "farther than 100 m off it is seldomer"
    assert math.hypot(*places[-1].velocity_en_mps) > 1.0
    saved = Persisted.from_dict(world.skipper.persisted(world.state).to_dict())
    assert saved.place == places[-1]


def test_an_ordinary_restart_doubts_nothing():
    world = make(shown={"utc_at_boot_s": UTC_S})
    for _ in range(5):
        world.run(37)
        restarted(world)
    assert not said(world, "position doubted")


def geo(en_m):
    return FRAME.geo_from_en(*en_m)


def test_of_two_receivers_that_differ_the_other_one_may_be_right():
    world = make()
    assert world.run(600, is_near_an_island)
    for n in range(12):  # the one that is sailed by creeps away, slower than a jump is seen by
        world.shown = {"gps2": geo(world.position)}
        world.position_offset = (3.0 * n, 0.0)
        world.step()
    assert world.state.position.doubt is not None
    assert "second receiver" in world.state.position.doubt.why
    world.shown = {}  # a forger's, or it has fallen silent: nothing has jumped
    world.run(3)
    assert world.state.position.doubt is None

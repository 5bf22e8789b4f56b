"""Goals that are sailed by a field of their own: begun, ended, given up by name, taken again, left for a plan."""

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.field.tree import AwayFrom, FieldTree, Heading, OutOf, PointTo, Round, StayAt, parse
from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, Guidance
from companion.skipper.step.snapshot import WindEstimate, WindHealth
from companion.skipper.step.state import Phase
from companion.skipper.way import Composed, Until
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from companion.traffic import Targets
from tests.skipper.world import FRAME, World, restarted, skipper, voyage, with_parts
from tests.traffic.conftest import report

RING = Round(at_en=(80.0, 0.0), radius_m=50.0)
SQUARE = box(-60.0, -60.0, 60.0, 60.0)
MARK = Goal(en_m=(200.0, 40.0), radius_m=8.0, name="the mark")


def field(text, until=Until.TOLD, for_s=None, water=None, **named):
    tree = FieldTree(expression=parse(text, tuple(named), "", ""), atoms=tuple(named.items()))
    return Composed(tree=tree, until=until, for_s=for_s, water_en=water)


def goal(composed, en_m=(80.0, -50.0), name="the ring"):
    return Goal(en_m=en_m, radius_m=8.0, name=name, field=composed)


def make(*goals, obstacles=(), permissions=ALL_PERMITTED, config=None, **world):
    return World(
        skipper=skipper(voyage(*goals, obstacles=obstacles), **(config or {})),
        expansions=1500,
        sigma=0.05,
        heading=math.pi / 2.0,
        permissions=permissions,
        **world,
    )


def steered(world):
    return [(t, a) for t, a in world.actions if isinstance(a, act.SteerHeading)]


def said(world):
    return [(a.code, a.text) for _, a in world.actions if isinstance(a, act.Announce)]


def codes(world):
    return [code for code, _ in said(world)]


def test_a_circle_is_sailed_for_its_time_and_a_mark_by_plan_behind_it():
    world = make(goal(field("ring", Until.TIME, 200.0, ring=RING)), MARK)
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)
    began = world.t
    assert world.run(400, lambda w: bool(w.state.progress.reached))
    assert world.t - began == pytest.approx(200.0, abs=5.0)
    assert "for 200 s" in next(text for code, text in said(world) if code == "field")
    assert "the ring: her time is over" in next(text for code, text in said(world) if code == "goal")
    way = world.track[-800:]
    assert all(25.0 < distance_m(p, RING.at_en) < 75.0 for p in way)
    bearings = [math.atan2(p[0] - 80.0, p[1]) for p in way]
    assert {round(b) for b in bearings} >= {-3, -2, -1, 0, 1, 2, 3}  # all round it
    assert all(abs(difference_rad(a.heading_rad, 0.0)) >= world.no_go - 1e-9 for _, a in steered(world))
    assert world.run(300, lambda w: w.state.phase is Phase.DONE)
    assert world.state.progress.reached == (0, 1)
    assert world.mode is Mode.AUTO
    assert "no progress" not in codes(world)
    assert "off the corridor" not in codes(world)
    assert "mission ended" not in codes(world)


def test_from_the_field_to_a_plan_she_is_steered_until_it_is_on_board():
    """The mission on board leads across a rock from where the field has brought her: AUTO waits for another."""
    world = make(goal(field("ring", Until.TIME, 120.0, ring=RING)), MARK)
    assert world.run(400, lambda w: bool(w.state.progress.reached))
    left, uploads = world.t, world.uploads
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    assert world.uploads > uploads
    assert [t for t, _ in steered(world) if t >= left]


def test_until_a_place_is_reached_by_a_field_that_goes_round_something_that_only_it_knows():
    named = {"mark": PointTo(at_en=(150.0, 0.0)), "rock": AwayFrom(at_en=(75.0, 0.0), range_m=25.0)}
    world = make(goal(field("mark + 1.5 * rock", Until.PLACE, **named), (150.0, 0.0)))
    assert world.run(300, lambda w: w.state.phase is Phase.DONE)
    assert min(distance_m(p, (75.0, 0.0)) for p in world.track) > 15.0
    assert next(text for code, text in said(world) if code == "goal").startswith("the ring: ")


def test_a_station_is_kept_until_told_to_go_on():
    world = make(
        goal(field("stay", stay=StayAt(at_en=(60.0, 0.0))), (60.0, 0.0)),
        MARK,
        permissions=replace(ALL_PERMITTED, orders=("all",)),
    )
    assert world.run(120, lambda w: distance_m(w.position, (60.0, 0.0)) < 8.0)
    world.run(150)
    assert max(distance_m(p, (60.0, 0.0)) for p in world.track[-600:]) < 20.0
    assert not world.state.progress.reached
    assert "until told to go on" in world.state.why
    world.order("go_on")
    assert world.run(10, lambda w: bool(w.state.progress.reached))
    assert world.run(300, lambda w: w.state.phase is Phase.DONE)


def test_what_stands_still_is_kept_clear_of_though_the_field_leads_over_it():
    rock = box(60.0, -62.0, 100.0, -38.0)  # on the ring
    world = make(goal(field("ring", Until.TIME, 240.0, ring=RING), (30.0, 0.0)), obstacles=(rock,))
    assert world.run(400, lambda w: w.state.phase is Phase.DONE)
    assert world.clearance() > 4.0


# -------------------------------------------------------------------------------- a field without a value
def test_a_field_that_leads_nowhere_is_given_up_by_name_and_she_loiters_at_its_place():
    world = make(goal(field("rock", rock=AwayFrom(at_en=(500.0, 500.0), range_m=10.0)), (60.0, 0.0)), MARK)
    assert world.run(120, lambda w: "no field" in codes(w))
    text = next(text for code, text in said(world) if code == "no field")
    assert text == ("the ring: its field rock has no value here (0.00 of 10): by plan to its place, and a loiter there")
    assert world.run(120, lambda w: w.state.phase is Phase.HOLDING and w.mode is Mode.AUTO)
    world.run(120)
    assert world.mode is Mode.AUTO
    assert distance_m(world.position, (60.0, 0.0)) < 30.0
    assert "has no value here" in world.state.why
    assert not world.state.progress.reached
    assert codes(world).count("no field") == 1


def test_a_field_that_has_a_value_again_steers_again():
    """Two places that pull alike: in the middle they cancel. She is carried out of it."""
    named = {
        "west": Heading(heading_rad=-math.pi / 2.0),
        "east": Heading(heading_rad=math.pi / 2.0),
        "rock": AwayFrom(at_en=(20.0, 300.0), range_m=100.0),
    }
    world = make(goal(field("west + east + 0.2 * rock", Until.TIME, 900.0, **named), (20.0, 0.0)))
    assert world.run(120, lambda w: "no field" in codes(w))
    world.run(60)
    assert world.mode is Mode.AUTO
    world.position = (20.0, 240.0)
    world.state = with_parts(world.state, position={"last_seen": None})
    assert world.run(60, lambda w: "its field leads on again" in " ".join(text for _, text in said(w)))
    assert world.run(20, lambda w: w.mode is Mode.GUIDED)


def test_without_a_wind_the_field_is_given_up_and_the_autopilot_sails_by_its_own():
    world = make(goal(field("ring", Until.TIME, 400.0, ring=RING)))
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)
    world.run(30)
    world.extra = {"wind": WindEstimate(health=WindHealth.NONE)}
    assert world.run(10, lambda w: "no field" in codes(w))
    assert "no wind is known" in next(text for code, text in said(world) if code == "no field")
    assert world.run(20, lambda w: w.mode is Mode.AUTO)
    world.extra = {}
    assert world.run(40, lambda w: w.mode is Mode.GUIDED)


def test_without_permission_to_steer_she_waits_at_its_place_and_it_is_said():
    world = make(
        goal(field("ring", Until.TIME, 150.0, ring=RING)), MARK, permissions=replace(ALL_PERMITTED, may_steer=False)
    )
    assert world.run(120, lambda w: w.state.phase is Phase.HOLDING)
    assert "steering is not permitted" in world.state.why
    assert world.run(300, lambda w: w.state.phase is Phase.DONE)
    assert not steered(world)


# -------------------------------------------------------------------------------------- others, orders, kills
def test_stay_until_a_vessel_is_in_the_square_then_leave_it():
    leave = field("out", Until.OUTSIDE, 300.0, SQUARE, out=OutOf(water_en=SQUARE))
    stay = field("stay", Until.VESSEL, 900.0, SQUARE, stay=StayAt(at_en=(0.0, 0.0)))
    world = make(
        goal(stay, (0.0, 0.0), "stay"), goal(leave, (-90.0, 0.0), "leave"), config={"traffic_clearance_m": 20.0}
    )
    heard = Targets.empty(FRAME)
    least, entered, left = math.inf, None, None
    for _ in range(400):
        there = (160.0 - 1.5 * max(0.0, world.t - 120.0), 10.0)
        heard = heard.heard(
            report(
                world.t,
                there,
                name="Nellie",
                course_rad=-math.pi / 2.0,
                speed_mps=1.5,
                heading_rad=-math.pi / 2.0,
                bow_m=2.0,
                stern_m=2.0,
                port_m=1.0,
                starboard_m=1.0,
            )
        )
        world.extra = {"traffic": heard.picture(world.t)}
        world.step()
        inside = max(abs(world.position[0]), abs(world.position[1])) < 60.0
        if entered is None and there[0] < 60.0:
            entered = world.t
        if entered is None:
            assert inside
        least = min(least, distance_m(world.position, there))
        if not inside and left is None:
            left = world.t
        if world.state.phase is Phase.DONE:
            break
    assert world.state.progress.reached == (0, 1)
    assert left - entered < 60.0
    assert least > 12.0
    assert "in its water" in " ".join(text for code, text in said(world) if code == "goal")


@pytest.mark.parametrize("after_s", [5.0, 60.0])
def test_killed_in_the_middle_of_it_she_sails_on_by_the_same_field_and_its_time_goes_on(after_s):
    world = make(goal(field("ring", Until.TIME, 150.0, ring=RING)), shown={"utc_at_boot_s": 1.8e9})
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)
    began = world.t
    world.run(after_s)
    restarted(world)
    assert world.run(30, lambda w: w.state.by_field.composed)
    assert world.run(200, lambda w: bool(w.state.progress.reached))
    assert world.t - began == pytest.approx(150.0, abs=8.0)


def test_an_order_to_hold_comes_first_and_go_on_takes_the_field_again():
    world = make(goal(field("ring", Until.TIME, 600.0, ring=RING)), permissions=replace(ALL_PERMITTED, orders=("all",)))
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)
    world.run(40)
    world.order("hold")
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    world.run(60)
    assert world.mode is Mode.AUTO
    world.order("go_on")
    assert world.run(30, lambda w: w.mode is Mode.GUIDED)


def test_a_person_may_take_her_and_auto_gives_her_back_to_the_field():
    world = make(goal(field("ring", Until.TIME, 600.0, ring=RING)))
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)
    world.run(30)
    world.set_mode(Mode.MANUAL)
    world.run(20)
    assert world.state.phase is Phase.OPERATOR
    assert world.mode is Mode.MANUAL
    world.set_mode(Mode.AUTO)
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)


def test_a_mission_that_is_sailed_by_field_throughout_has_fields_of_its_own_too():
    world = make(goal(field("ring", Until.TIME, 120.0, ring=RING)), MARK, config={"guidance": Guidance.FIELD})
    assert world.run(600, lambda w: w.state.phase is Phase.DONE)
    assert world.state.progress.reached == (0, 1)

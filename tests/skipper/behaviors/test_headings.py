"""Büsser's headings: drift (equation 3), buoys, and our own: the no-go zone, the leg's line, what GUIDED has not."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from companion.boat import constant
from companion.geo.angles import difference_rad
from companion.messages import Command, MissionItem, Mode
from companion.skipper.behaviors.drifting import CALL
from companion.skipper.behaviors.headings import (
    back_to_line_rad,
    buoy_heading_rad,
    by_the_stern_rad,
    desired_heading_rad,
    drift_correction_rad,
    sailable_rad,
)
from companion.skipper.behaviors.sailing import follow_route
from companion.skipper.planning.autopilot_beats import room_m
from companion.skipper.planning.next_tack import next_tack, next_tack_s
from companion.skipper.step import actions as act
from companion.skipper.step.config import Guidance, Permissions
from companion.skipper.step.context import StepContext
from companion.skipper.step.route import Route
from companion.skipper.step.snapshot import CommandOutcome, CommandResult, SpeedSeen
from companion.skipper.step.state import NO_TACKS, Phase
from companion.skipper.way.geometry import bearing_rad, cross_track_m
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.moments import moment, route
from tests.skipper.test_voyage import is_done, is_sailing, make, said
from tests.skipper.world import voyage, with_parts

ANGLE = st.floats(-math.pi, math.pi)
CHECK = settings(max_examples=100)


def test_pushed_to_port_means_steering_to_starboard():
    # Heading north at 2 m/s, pushed west (wind from starboard) at 0.2 m/s.
    assert drift_correction_rad((-0.2, 2.0), 0.0) == pytest.approx(math.atan(0.1))
    assert drift_correction_rad((0.2, 2.0), 0.0) == pytest.approx(-math.atan(0.1))
    assert drift_correction_rad((0.0, 2.0), 0.0) == 0.0
    assert drift_correction_rad((1.0, 0.1), 0.0) == 0.0


@CHECK
@given(ANGLE, st.floats(1.0, 4.0), st.floats(-0.3, 0.3))
def test_the_corrected_heading_makes_the_course_good(course, speed, leeway):
    # A boat whose track is its heading turned by its leeway: steering course + correction brings it onto the course.
    heading = course
    for _ in range(5):
        track = heading + leeway
        velocity = (speed * math.sin(track), speed * math.cos(track))
        heading = course + drift_correction_rad(velocity, heading)
    assert abs(difference_rad(heading + leeway, course)) < 1e-6


@CHECK
@given(ANGLE, ANGLE, ANGLE, st.floats(0.5, 1.2))
def test_nothing_is_steered_into_the_no_go_zone(wanted, heading, twd, no_go):
    out = sailable_rad(wanted, heading, twd, no_go)
    assert abs(difference_rad(out, twd)) >= no_go - 1e-9
    if abs(difference_rad(wanted, twd)) >= no_go:
        assert out == wanted


def test_dead_to_windward_it_stays_on_its_tack():
    assert sailable_rad(0.0, 0.8, 0.0, 0.785) == pytest.approx(0.785)
    assert sailable_rad(0.0, -0.8, 0.0, 0.785) == pytest.approx(-0.785)
    assert sailable_rad(0.0, -0.8, 0.02, 0.785) == pytest.approx(0.02 - 0.785)
    assert sailable_rad(0.5, -0.8, 0.0, 0.785) == pytest.approx(0.785)


BUOYS = pytest.mark.parametrize(("side", "hand"), [(Side.PORT, 1.0), (Side.STARBOARD, -1.0)])


@BUOYS
@CHECK
@given(ANGLE, ANGLE, ANGLE, st.floats(0.5, 1.2))
def test_at_a_buoy_no_manoeuvre_leads_to_its_side_of_the_wanted_heading(side, hand, wanted, heading, twd, no_go):
    """Büsser 3.2.4: "never to perform maneuvers that would result in a new direction to the left"."""
    out = sailable_rad(wanted, heading, twd, no_go, side)
    assert abs(difference_rad(out, twd)) >= no_go - 1e-9
    if abs(difference_rad(wanted, twd)) >= no_go:
        assert out == wanted
    elif hand * difference_rad(out, wanted) < -1e-9:
        # To the buoy's side only by going on as she goes, and not by more than ten degrees.
        assert difference_rad(heading, twd) * difference_rad(out, twd) >= 0.0
        assert abs(difference_rad(out, wanted)) <= math.radians(10.0) + 1e-9


@BUOYS
def test_at_a_buoy_she_goes_about_to_get_clear_and_not_to_get_nearer(side, hand):
    wanted = hand * 0.1
    assert sailable_rad(wanted, -hand * 0.8, 0.0, 0.785) == pytest.approx(hand * 0.785)  # nearer by 11 degrees
    assert sailable_rad(-wanted, -hand * 0.8, 0.0, 0.785) == pytest.approx(-hand * 0.785)
    assert sailable_rad(-wanted, -hand * 0.8, 0.0, 0.785, side) == pytest.approx(hand * 0.785)
    assert sailable_rad(-hand * 0.5, hand * 0.8, 0.0, 0.785) == pytest.approx(-hand * 0.785)
    assert sailable_rad(-hand * 0.5, hand * 0.8, 0.0, 0.785, side) == pytest.approx(hand * 0.785)
    assert sailable_rad(-hand * 0.7, -hand * 0.8, 0.0, 0.785, side) == pytest.approx(-hand * 0.785)


@pytest.mark.parametrize(("side", "sign"), [(Side.PORT, 1.0), (Side.STARBOARD, -1.0)])
def test_the_buoy_is_left_on_its_side(side, sign):
    boat, buoy = (0.0, 0.0), (30.0, 40.0)
    heading = buoy_heading_rad(boat, buoy, side, math.radians(30.0))
    assert difference_rad(heading, bearing_rad(boat, buoy)) == pytest.approx(sign * math.radians(30.0))


# ------------------------------------------------------------------------------------- the leg's line
BY_HEADING = {"guidance": Guidance.HEADING, "autopilot_beats": True}
BEAM = lambda t: (-math.pi / 2.0, 5.0)  # noqa: E731 - a wind
ISLAND = shapely.box(-60.0, 100.0, 60.0, 130.0)


def by_heading(*goals, config=None, **how):
    return make(*goals, config={**BY_HEADING, **(config or {})}, **how)


def turn_of(world, **seen):
    return StepContext(world.skipper.voyage, world.skipper.config, world.state, replace(world.snapshot(), **seen))


def is_steered(world):
    return world.mode is Mode.GUIDED and world.steer is not None


def test_off_the_line_the_heading_leads_back_to_it_and_never_away():
    assert back_to_line_rad(0.0, 3.0) == 0.0
    assert back_to_line_rad(6.0, 3.0) == pytest.approx(-math.atan2(6.0, 12.0))
    assert back_to_line_rad(-100.0, 3.0) == pytest.approx(math.radians(45.0))


def test_a_boat_set_off_her_leg_comes_back_to_it():
    """His heading leads along it from wherever the last turn ended, which may be nearer to a rock than the plan."""
    world = by_heading(Goal(en_m=(0.0, 300.0)), obstacles=(), wind=BEAM)
    assert world.run(60, is_steered)
    world.run(5)
    world.position = (world.position[0] + 6.0, world.position[1])
    world.run(12)
    leg = turn_of(world).leg()
    assert abs(cross_track_m(world.position, *leg)) < 1.0


@pytest.mark.parametrize(("left_m", "is_direct"), [(19.0, True), (21.0, False)])
def test_near_the_destination_she_is_steered_at_it_and_before_that_along_her_leg(left_m, is_direct):
    """Büsser 3.2.3: "the true course from present boat position to target position", within GRID SIZE; 3.1 before."""
    world = by_heading(Goal(en_m=(0.0, 300.0), radius_m=5.0), obstacles=(), wind=BEAM)
    assert world.run(60, is_steered)
    end = turn_of(world).leg()[1]
    assert world.run(200, lambda w: end[1] - w.position[1] < 24.0)
    assert world.skipper.config.grid_size_m == 20.0
    off = math.asin(6.0 / left_m)
    world.position = (end[0] + 6.0, end[1] - left_m * math.cos(off))
    ctx = turn_of(world)
    drift = drift_correction_rad(ctx.snapshot.vehicle.velocity_en_mps, ctx.snapshot.vehicle.heading_rad)
    course = difference_rad(desired_heading_rad(ctx), drift)
    back = back_to_line_rad(cross_track_m(world.position, *ctx.leg()), ctx.speed_mps)
    along = bearing_rad(*ctx.leg()) + back
    assert difference_rad(course, -off if is_direct else along) == pytest.approx(0.0, abs=1e-6)
    assert abs(difference_rad(along, -off)) > math.radians(5.0)


@pytest.mark.parametrize("across_mps", [0.7, -0.7])
@pytest.mark.parametrize("leeway_rad", [0.0, 0.1])
def test_a_leg_is_made_good_across_a_current_and_leeway_by_equation_3(across_mps, leeway_rad):
    """Led back to her line alone she comes to lie where that balances the drift: two metres and more to lee of it."""
    world = by_heading(Goal(en_m=(0.0, 400.0)), obstacles=(), wind=BEAM)

    def pushed(t):  # the wind is from port: leeway is to starboard
        aside = leeway_rad * world.speed
        return across_mps + aside * math.cos(world.heading), -aside * math.sin(world.heading)

    world.current = pushed
    assert world.run(60, is_steered)
    world.run(30)
    leg, off = turn_of(world).leg(), []
    assert world.run(30, lambda w: off.append(cross_track_m(w.position, *leg)) or len(off) == 25)
    assert max(map(abs, off)) < 0.5, off


@pytest.mark.parametrize("off_m", [6.0, -6.0])
def test_close_hauled_she_comes_back_on_the_legs_own_tack(off_m):
    world = by_heading(Goal(en_m=(200.0, 170.0)), Goal(en_m=(300.0, 0.0)), obstacles=(), wind=lambda t: (0.0, 5.0))
    assert world.run(60, is_steered)
    world.run(5)
    ctx = turn_of(world)
    a, b = ctx.leg()
    across = bearing_rad(a, b) + math.pi / 2.0
    side = difference_rad(bearing_rad(a, b), 0.0)
    world.position = (world.position[0] + off_m * math.sin(across), world.position[1] + off_m * math.cos(across))
    wanted = desired_heading_rad(turn_of(world))
    assert wanted * side > 0.0
    assert abs(wanted) >= world.no_go - 1e-9


# ------------------------------------------------------------------------- what the autopilot does not do in GUIDED
def test_no_beat_is_left_to_an_autopilot_that_does_not_sail_the_mission():
    """There is no corridor in GUIDED: she sailed such a leg close-hauled, as far as it was long."""
    for guidance in Guidance:
        world = make(obstacles=(), config={"autopilot_beats": True, "guidance": guidance}, wind=lambda t: (0.0, 5.0))
        assert world.run(60, is_sailing)
        beats = [a.problem.beat for _, a in world.actions if isinstance(a, act.RequestPlan)]
        assert (beats[0] is None) == (guidance is not Guidance.PLAN), guidance
        assert (room_m(turn_of(world)) is None) == (guidance is not Guidance.PLAN), guidance
        permitted = replace(world.permissions, may_steer=False)  # then the autopilot sails what was planned
        assert room_m(turn_of(world, permissions=permitted)) is not None


def test_between_islands_she_keeps_the_floor():
    world = by_heading(wind=lambda t: (0.15 * math.sin(t / 23.0), 5.0))
    assert world.run(1500, is_done)
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_on_a_leg_that_the_wind_has_closed_no_tack_of_the_autopilots_is_told():
    world = by_heading(Goal(en_m=(0.0, 300.0)), obstacles=(), wind=lambda t: (BEAM(t)[0] if t < 30.0 else 0.0, 5.0))
    world.planner = None
    assert world.run(60, is_steered)
    world.run(31.0 - world.t)
    world.winds = []
    ctx = turn_of(world)
    assert ctx.is_closed(*ctx.leg(), ctx.wind_now)
    assert next_tack_s(ctx, ctx.voyage.boat) is None


@pytest.mark.parametrize("away_m", [9.0, 14.0])
def test_too_near_to_plan_round_she_is_stopped_in_guided_too(away_m):
    world = by_heading(Goal(en_m=(0.0, 300.0), radius_m=8.0), obstacles=(ISLAND,), wind=BEAM)
    assert world.run(60, is_steered)
    world.set_mode(Mode.HOLD)
    world.run(5)
    world.position, world.heading, world.speed = (0.0, 130.0 + away_m), math.pi, 3.0
    world.track.clear()
    world.set_mode(Mode.AUTO)
    assert world.run(4, lambda w: w.mode is Mode.LOITER)
    assert said(world, "too near")
    assert world.run(900, is_done)
    assert world.clearance() > 0.0


def in_a_channel_that_shuts(*, can_tack):
    """Return a boat by headings between two banks, a second before the wind comes ahead."""
    bank = shapely.box(-100.0, 60.0, -16.0, 400.0)
    world = by_heading(
        Goal(en_m=(0.0, 320.0), radius_m=8.0),
        obstacles=(bank, shapely.box(16.0, 60.0, 100.0, 400.0)),
        wind=lambda t: (-math.pi / 2.0 if t < 45.0 else 0.0, 5.0),
        config={"margin_m": 12.0, "margin_floor_m": 5.0},
    )
    sailed = world.skipper.voyage
    world.skipper = replace(world.skipper, voyage=replace(sailed, boat=replace(sailed.boat, can_tack=can_tack)))
    return world


def test_a_closed_leg_is_followed_no_farther_than_to_the_loiter():
    """The wind comes ahead and no plan is found: close-hauled she makes for a bank, and does not tack there."""
    world = in_a_channel_that_shuts(can_tack=False)
    assert world.run(44, is_steered)
    world.run(44 - world.t)
    assert 40.0 < world.position[1] < 150.0
    world.planner = lambda problem, seed: None
    world.track.clear()
    assert world.run(30, lambda w: w.mode is Mode.LOITER)
    assert world.clearance() > 0.5
    assert not any(phase == "operator" for _, phase, _ in world.log)


def test_on_a_closed_leg_a_boat_that_tacks_keeps_the_floor_where_no_plan_is_found():
    """A loiter's circle takes more room than a tack: in a neck she was stopped too near to a wall to be turned."""
    world = in_a_channel_that_shuts(can_tack=True)
    assert world.run(44, is_steered)
    world.run(44 - world.t)
    world.planner = lambda problem, seed: None
    world.track.clear()
    world.run(60)
    assert world.clearance() > world.skipper.config.margin_floor_m
    assert not said(world, "too near")


def test_the_loiter_that_ends_a_mission_is_sailed_by_the_autopilot():
    """No heading leads to a loiter: in GUIDED she was left to herself for 154 s, in circles onto a rock."""
    world = by_heading(Goal(en_m=(0.0, 300.0), radius_m=8.0), obstacles=(), wind=BEAM)
    assert world.run(60, is_steered)
    world.run(5)
    last = len(world.state.mission.route.items) - 1
    world.planner = lambda problem, seed: None
    world.state, world.seq = with_parts(world.state, mission={"index": last, "own_index": last}), last + 1
    since = len(world.actions)
    assert world.run(5, lambda w: w.mode is Mode.AUTO)
    world.run(20)
    assert world.mode is Mode.AUTO
    assert not any(isinstance(a, act.SteerHeading) for _, a in world.actions[since:])


@CHECK
@given(st.floats(math.radians(30.0), math.pi - 0.01), st.floats(math.radians(30.0), math.pi - 0.01), ANGLE)
@example(math.pi / 6.0, math.pi / 6.0, 2.125)  # exactly half a turn: to and fro for ever
def test_a_boat_that_cannot_tack_is_turned_by_the_stern(off, to, twd):
    """Sent straight to the heading of the other tack she was turned through the wind, 21 times in vain, and touched."""
    heading, wanted = twd + off, twd - to
    throughs = 0
    for _ in range(200):
        sent = by_the_stern_rad(wanted, heading, twd)
        turn = difference_rad(sent, heading)  # the short way, as the autopilot does
        step = math.copysign(min(abs(turn), math.radians(3.0)), turn)
        before, after = difference_rad(heading, twd), difference_rad(heading + step, twd)
        throughs += before * after < 0.0 and abs(before) + abs(after) < math.pi
        heading += step
    assert abs(difference_rad(heading, wanted)) < math.radians(0.1)
    assert not throughs
    assert by_the_stern_rad(twd + to, twd + off, twd) == twd + to  # on the same tack: as it is


@pytest.mark.parametrize("can_tack", [True, False])
def test_by_headings_a_boat_that_cannot_tack_is_not_sent_to_the_other_tack_at_once(can_tack):
    ctx = moment(
        route((0.0, 300.0), (300.0, 300.0)), heading_deg=50.0, twd_deg=0.0, config={"guidance": Guidance.HEADING}
    )
    ctx.voyage = replace(ctx.voyage, boat=replace(ctx.voyage.boat, can_tack=can_tack))
    ctx.set(mission=replace(ctx.state.mission, route=route((-300.0, 250.0), (-600.0, 500.0)), index=0))
    sent = difference_rad(desired_heading_rad(ctx), 0.0)
    assert (sent < 0.0) is can_tack
    assert can_tack or sent == pytest.approx(math.radians(130.0))


def test_a_loiter_that_is_refused_leaves_her_steered():
    world = in_a_channel_that_shuts(can_tack=False)
    answer = world._answer

    def refuse(kind, action):
        if isinstance(action, act.SetMode) and action.mode is Mode.LOITER:
            return CommandOutcome(command_id=action.command_id, result=CommandResult.REFUSED, text="no")
        return answer(kind, action)

    world._answer = refuse
    assert world.run(44, is_steered)
    world.run(44 - world.t)
    world.planner = lambda problem, seed: None
    world.run(14)
    assert said(world, "refused LOITER")
    assert not any(phase == "operator" for _, phase, _ in world.log)
    assert world.steer_until > world.t


def test_becalmed_by_headings_she_is_held_and_the_crew_called():
    rock = shapely.box(60.0, -100.0, 90.0, 400.0)
    world = by_heading(
        Goal(en_m=(0.0, 400.0)),
        obstacles=(rock,),
        wind=lambda t: (-1.5, 0.0 if t >= 60.0 else 4.0),
        current=lambda t: (0.5 if t >= 60.0 else 0.0, 0.0),
    )
    assert world.run(180, lambda w: w.mode is Mode.LOITER)
    assert world.run(120, lambda w: bool(said(w, CALL)))


def test_out_of_irons_she_is_steered_on_and_not_given_to_auto():
    world = by_heading(Goal(en_m=(0.0, 300.0)), obstacles=(), wind=BEAM)
    assert world.run(60, is_steered)
    world.run(5)
    until, sail, before = world.t + 14.0, world.sail, len(world.actions)

    def held(dt):
        if world.t < until:
            world.heading, world.speed = world.wind(world.t)[0], 0.05
            return
        sail(dt)

    world.sail = held
    assert world.run(
        30, lambda w: any(isinstance(a, act.SteerHeading) and a.text == "out of irons" for _, a in w.actions[before:])
    )
    world.run(40)
    assert not any(isinstance(a, act.SetMode) and a.mode is Mode.AUTO for _, a in world.actions[before:])
    assert world.speed > 1.0


def test_a_tack_that_a_new_plan_may_move_is_told_as_about():
    """At each waypoint a new plan is asked for: "next tack 44 s" was 86 s away, for it made the board longer."""
    boat = replace(voyage().boat, polar=constant(2.0), turn_rate_radps=math.radians(30.0))

    def told(
        *points,
        asked=-1,
        pending=None,
        share=1.0,
        heading_deg=60.0,
        speed_mps=2.0,
        tacking=NO_TACKS,
        velocity=(1.7, 1.0),
        boat=boat,
        motor=False,
    ):
        route = Route(
            items=(MissionItem(command=Command.NAV_WAYPOINT),) * len(points)
            + (MissionItem(command=Command.NAV_LOITER_UNLIM),),
            leg_from_en_m=((0.0, 0.0), *points),
            points_en_m=(*points, points[-1]),
            gate_of=(*(-1,) * (len(points) - 1), 0, -1),
            plan_id=1,
            plan_t_s=0.0,
            plan_twd_from_rad=0.0,
            plan_tws_mps=5.0,
            plan_half_width_rad=0.0,
            margin_m=8.0,
            delta_s=0.9,
        )
        heading_rad = math.radians(heading_deg)
        vehicle = SimpleNamespace(speed_mps=speed_mps, heading_rad=heading_rad, velocity_en_mps=velocity)
        wind = SimpleNamespace(mean_twd_from_rad=0.0, present_twd_from_rad=0.0, mean_tws_mps=5.0, present_tws_mps=5.0)
        snapshot = SimpleNamespace(
            vehicle=vehicle,
            position_en_m=(0.0, 0.0),
            wind=wind,
            limits=None,
            autopilot=None,
            speed_seen=SpeedSeen(share=share),
        )
        state = SimpleNamespace(
            phase=Phase.STANDARD,
            mission=SimpleNamespace(route=route, index=0),
            plans=SimpleNamespace(replanned_index=asked),
            pending=SimpleNamespace(plan=pending),
            tacking=tacking,
            adrift=SimpleNamespace(motor=motor),
        )
        return next_tack(SimpleNamespace(snapshot=snapshot, state=state, is_off_plan=False), boat)

    east, on, back = (86.6, 50.0), (173.2, 100.0), (86.6, 150.0)
    turn_s = 2.0  # 60 degrees at 30 degrees a second
    assert told(east, (0.0, 100.0)) == pytest.approx((50.0 + turn_s, False), abs=0.1)  # at the end of this leg
    assert told(east, (0.0, 100.0), asked=0) == pytest.approx((50.0 + turn_s, True), abs=0.1)
    assert not told(east, (0.0, 100.0), asked=0, pending="a plan").is_planned
    assert told(east, on, back, asked=0) == pytest.approx((100.0 + turn_s, False), abs=0.1)
    failing = replace(NO_TACKS, tried=8, failed=1)
    assert not told(east, (0.0, 100.0), asked=0, tacking=failing).is_planned
    assert told(east, on, heading_deg=-30.0) == pytest.approx((1.0, True), abs=0.1)  # she is turning to this leg
    for gybes in (replace(boat, can_tack=False), replace(boat, no_go_half_rad=0.0, has_motor=True)):
        assert told(east, (0.0, 100.0), boat=gybes) is None  # she cannot tack, or does not sail
    assert told(east, (0.0, 100.0), motor=True) is None
    assert not told(east, on, heading_deg=-30.0, speed_mps=0.5).is_planned  # and may not come through the wind
    assert not told(east, on, heading_deg=-30.0, tacking=replace(NO_TACKS, is_counted=True)).is_planned
    # closed by two degrees, a leg is fetched by the close-hauled course; from a closed leg dead to windward she tacks
    closed = (100.0 * math.sin(math.radians(43.0)), 100.0 * math.cos(math.radians(43.0)))
    further = (2.0 * closed[0] - 20.0, 2.0 * closed[1])
    close_hauled = {"heading_deg": 45.0, "velocity": (math.sqrt(2.0), math.sqrt(2.0))}
    beyond = told(closed, further, (0.0, 2.0 * further[1]), **close_hauled)
    assert beyond.in_s > 75.0, "not at the first waypoint: the second leg is on this tack, too"
    assert told((0.0, 100.0), **close_hauled).in_s < 50.0
    assert told(east, on, back, share=0.8) == pytest.approx((50.0 + 50.0 / 0.8 + turn_s, False), abs=0.1)


@pytest.mark.parametrize(("may_steer", "is_said"), [(True, False), (False, True)])
def test_that_steering_is_not_permitted_is_said_where_it_is_not(may_steer, is_said):
    """In the loiter that ends a mission nothing is steered by headings, and that is no want of permission."""
    permissions = Permissions(may_upload=True, may_set_mode=True, may_steer=may_steer)
    ctx = moment(route((0.0, 300.0)), config={"guidance": Guidance.HEADING}, permissions=permissions)
    assert not ctx.steers
    follow_route(ctx)
    told = [a.text for a in ctx.actions if isinstance(a, act.Announce) and a.code == "guidance"]
    assert bool(told) is is_said


@pytest.mark.parametrize(
    ("bow_deg", "end", "wanted_deg"),
    [
        (90.0, (20.0, -60.0), 43.0),  # the turn to her leg leads across it: she leaves it on the hand where it lies
        (110.0, (20.0, -60.0), None),  # it lies on her other bow, and she turns away from it
        (90.0, (60.0, 20.0), None),  # so she does to this one
        (280.0, (20.0, -60.0), None),  # it is astern
    ],
)
def test_a_turn_across_a_buoy_close_ahead_is_put_off_until_it_is_passed(bow_deg, end, wanted_deg):
    """In his five laps she turned to her next leg 5 m before a buoy, and passed its middle by 0.1 m."""
    buoy = Goal(en_m=(5.0, -0.5), name="buoy", side=Side.PORT, rounding_m=8.0)
    way = route((0.0, 0.0), end, end, gate_of=(-1, 0, -1))

    def told(*goals):
        ctx = moment(
            way, goals=(Goal(en_m=end), *goals), heading_deg=bow_deg, speed_mps=2.5, twd_deg=310.0, mission={"index": 1}
        )
        return desired_heading_rad(ctx)

    plain, beside = told(), told(buoy)
    if wanted_deg is None:
        assert beside == plain
    else:
        at = math.degrees(bearing_rad((0.0, 0.0), buoy.en_m))
        assert math.degrees(beside) == pytest.approx(wanted_deg, abs=0.5)
        assert math.degrees(plain) > at

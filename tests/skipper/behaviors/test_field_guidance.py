"""Steering by field: the last resort begins, sends headings, ends and hands back; a voyage and a station by field."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from shapely.geometry import box

from companion.current import WaterCurrent
from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.behaviors.field_guidance import NAME, habits, situation
from companion.skipper.behaviors.sailing import _name
from companion.skipper.rules import Skipper
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, Guidance, SkipperConfig
from companion.skipper.step.context import StepContext
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from companion.traffic import Targets
from tests.skipper.moments import moment, route
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.world import FRAME, World, restarted, skipper, voyage, with_parts
from tests.traffic.conftest import report

GOAL = Goal(en_m=(900.0, 0.0), radius_m=6.0, name="the goal")  # a reach: the wind is from the north
HALF_M = 4.0


def make(*obstacles, goals=(GOAL,), permissions=ALL_PERMITTED, config=None, **world):
    made = World(
        skipper=skipper(voyage(*goals, obstacles=obstacles), **(config or {"traffic_clearance_m": 30.0})),
        expansions=1500,
        sigma=0.05,
        heading=math.pi / 2,
        permissions=permissions,
        **world,
    )
    made.heard = Targets.empty(FRAME)
    return made


class Intruder:
    """A boat of 8 m that appears ``gap_m`` away on ``bearing_deg`` and will be where ours would be."""

    def __init__(self, world, bearing_deg, gap_m=80.0, speed_mps=3.0):
        b = math.radians(bearing_deg)
        self.t, here = world.t, world.position
        self.en = here[0] + gap_m * math.sin(b), here[1] + gap_m * math.cos(b)
        vx, vy = world.speed * math.sin(world.heading), world.speed * math.cos(world.heading)
        # The speed of meeting: its course is ours to intercept.
        meet = 1.0
        for _ in range(60):
            aim = here[0] + vx * meet, here[1] + vy * meet
            meet = distance_m(self.en, aim) / speed_mps
        self.course, self.speed = math.atan2(aim[0] - self.en[0], aim[1] - self.en[1]), speed_mps

    def at(self, t):
        run = self.speed * (t - self.t)
        return self.en[0] + run * math.sin(self.course), self.en[1] + run * math.cos(self.course)

    def heard(self, t):
        return report(
            t,
            self.at(t),
            name="Nellie",
            course_rad=self.course,
            speed_mps=self.speed,
            heading_rad=self.course,
            bow_m=HALF_M,
            stern_m=HALF_M,
            port_m=1.5,
            starboard_m=1.5,
        )


def step(world, intruder):
    world.heard = world.heard.heard(intruder.heard(world.t))
    world.extra = {"traffic": world.heard.picture(world.t)}
    world.step()
    return distance_m(world.position, intruder.at(world.t))


def meet(world, intruder, seconds=60.0, until=lambda w: False):
    """Sail on; return the least distance."""
    end, least = world.t + seconds, math.inf
    while world.t < end and not until(world):
        least = min(least, step(world, intruder))
    return least


def steered(world):
    return [(t, a) for t, a in world.actions if isinstance(a, act.SteerHeading)]


def texts(world):
    return [a.text for _, a in world.actions if isinstance(a, act.Announce)]


def said(world):
    return [a.code for _, a in world.actions if isinstance(a, act.Announce)]


@pytest.mark.parametrize("bearing_deg", [45.0, 90.0, 135.0])
@pytest.mark.parametrize("gap_m", [45.0, 60.0])
def test_an_intruder_too_near_to_plan_for_is_kept_clear_of_and_the_plan_sails_on(bearing_deg, gap_m):
    world = make()
    world.run(100)
    intruder = Intruder(world, bearing_deg, gap_m)
    least = meet(world, intruder, 150.0)
    assert least > HALF_M + 8.0
    assert said(world).count("last resort") == 1
    assert said(world).count("last resort over") == 1
    assert world.mode is Mode.AUTO
    headings = steered(world)
    assert all(b[0] - a[0] <= 1.0 for a, b in pairwise(headings))  # ArduRover forgets one that is 3 s old
    assert all(abs(difference_rad(a.heading_rad, 0.0)) >= world.no_go - 1e-9 for _, a in headings)
    begun, ended = headings[0][0], headings[-1][0]
    back = [t for t, a in world.actions if isinstance(a, act.SetMode) and a.mode is Mode.AUTO and t > begun]
    planned = [t for t, a in world.actions if isinstance(a, act.RequestPlan) and begun <= t <= ended]
    assert planned  # from where the field brought it, first
    assert min(back) >= max(planned)
    assert world.run(900, lambda w: w.state.phase is Phase.DONE)


def test_the_same_intruder_comes_nearer_without_permission_to_steer_and_it_is_said():
    world = make(permissions=replace(ALL_PERMITTED, may_steer=False))
    world.run(100)
    assert meet(world, Intruder(world, 90.0, 45.0)) < HALF_M  # no plan found in time helps
    assert "no last resort" in said(world)
    assert NAME in said(world)
    assert not steered(world)
    assert not any(isinstance(a, act.SetMode) and a.mode is Mode.GUIDED for _, a in world.actions)


@pytest.mark.parametrize("may_steer", [True, False])
def test_at_rest_she_keeps_clear_and_goes_back_to_her_place(may_steer):
    world = make(
        goals=(Goal(en_m=(150.0, 0.0), radius_m=6.0, name="the goal"),),
        permissions=replace(ALL_PERMITTED, may_steer=may_steer),
    )
    assert world.run(600, lambda w: w.state.phase is Phase.DONE)
    rest = world.state.voyage.rest_en_m
    intruder = Intruder(world, 60.0, 150.0)
    east, north = (a - b for a, b in zip(rest, intruder.en, strict=True))
    intruder.course = math.atan2(east, north)  # over the place where she lies
    least = meet(world, intruder, 240.0)
    assert (least > HALF_M + 8.0) is may_steer
    assert ("no last resort" in said(world)) is not may_steer
    assert world.mode is Mode.AUTO
    assert world.state.phase is Phase.DONE
    assert distance_m(world.position, rest) < 40.0
    assert "dragged off" not in said(world)
    assert not [text for text in texts(world) if "stand on" in text]


@pytest.mark.parametrize("is_held", [True, False])
def test_with_nothing_to_plan_for_the_field_lets_go_when_the_way_is_clear(is_held):
    """Under the order hold, or with the last goal passed meanwhile, she waited for a plan that nobody asked for."""
    world = make(goals=(Goal(en_m=(150.0, 0.0), radius_m=6.0, name="the goal"),))
    world.run(40)
    if is_held:
        world.order("hold")
        world.run(30)
    intruder = Intruder(world, 90.0, 45.0)
    assert meet(world, intruder, 60.0, lambda w: w.state.by_field.resort.engaged)
    if not is_held:
        world.state = with_parts(world.state, progress={"gate": len(turn_of(world).gates)})
    meet(world, intruder, 240.0)
    assert said(world).count("last resort over") == 1
    assert world.mode is Mode.AUTO
    if is_held:
        [*_, last] = [t for t, a in world.actions if isinstance(a, act.Announce) and a.code == "last resort over"]
        assert any(t >= last for t, a in world.actions if isinstance(a, act.UploadMission))  # a loiter where she is now


def test_a_vessel_at_anchor_is_the_planners_matter():
    world = make()
    world.run(100)
    anchored = Intruder(world, 90.0, 60.0, speed_mps=3.0)
    anchored.speed = 0.0
    meet(world, anchored, 60.0)
    assert NAME not in said(world)
    assert not steered(world)


def test_what_stands_still_is_kept_clear_of_too():
    """The way out that the look-ahead takes in open water ends on a rock that is put there."""
    tracks = []
    rock = None
    for rocks in ((), "where she went"):
        world = make(*([rock] if rocks else []))
        world.run(75)
        start = len(world.track)
        meet(world, Intruder(world, 30.0, 80.0), 60.0)
        assert "last resort" in said(world)
        tracks.append(points(world.track[start:]))
        if rock is None:
            east, north = tracks[0][-1].x, tracks[0][-1].y
            rock = box(east - 15.0, north - 15.0, east + 15.0, north + 15.0)
    assert min(map(rock.distance, tracks[0])) == 0.0
    assert min(map(rock.distance, tracks[1])) > 4.0


def points(track):
    from shapely.geometry import Point

    return [Point(p) for p in track]


def engaged(bearing_deg=45.0):
    world = make()
    world.run(100)
    intruder = Intruder(world, bearing_deg, 80.0)
    meet(world, intruder, 30.0, lambda w: w.state.by_field.seen_guided)
    assert world.state.phase is Phase.LAST_RESORT
    return world, intruder


@pytest.mark.parametrize("mode", [Mode.MANUAL, Mode.HOLD, Mode.LOITER])
def test_the_operator_may_take_the_boat_in_the_middle_of_it(mode):
    world, intruder = engaged()
    world.set_mode(mode)
    step(world, intruder)
    before = len(steered(world))
    meet(world, intruder, 10.0)
    assert world.state.phase is Phase.OPERATOR
    assert len(steered(world)) == before
    assert world.mode is mode


def test_an_operator_who_sets_auto_in_the_middle_of_it_is_left_alone():
    world, intruder = engaged()
    world.set_mode(Mode.AUTO)
    before = len(steered(world))
    meet(world, intruder, 20.0)
    assert world.mode is Mode.AUTO
    assert len(steered(world)) <= before + 1
    assert world.state.phase is not Phase.OPERATOR


def test_a_companion_killed_in_the_middle_of_it_takes_the_boat_back():
    world, _ = engaged()
    restarted(world)
    world.extra = {}
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    assert world.run(900, lambda w: w.state.phase is Phase.DONE)


def test_a_guided_that_was_not_ours_is_not_taken_back_by_a_restart():
    world = make()
    world.run(100)
    restarted(world)
    world.set_mode(Mode.GUIDED)
    world.run(20)
    assert world.mode is Mode.GUIDED
    assert world.state.phase is Phase.OPERATOR


def test_a_saved_state_without_the_mode_is_read_too():
    world, _ = engaged()
    data = world.skipper.persisted(world.state).to_dict()
    assert Persisted.from_dict(data).own_mode is Mode.GUIDED
    del data["own_mode"]
    assert Persisted.from_dict(data).own_mode is None


BY_FIELD = {"guidance": Guidance.FIELD}


@pytest.mark.parametrize(
    "goals",
    [
        (Goal(en_m=(200.0, 0.0), radius_m=8.0),),
        (Goal(en_m=(0.0, 200.0), radius_m=8.0),),  # dead to windward
        (Goal(en_m=(120.0, 60.0), radius_m=8.0), Goal(en_m=(0.0, -80.0), radius_m=8.0)),
    ],
    ids=["reach", "beat", "two goals"],
)
def test_a_voyage_by_field_alone(goals):
    world = make(goals=goals, config=BY_FIELD)
    assert world.run(900, lambda w: w.state.phase is Phase.DONE)
    assert world.state.progress.reached == tuple(range(len(goals)))
    headings = steered(world)
    assert len(headings) > 60
    assert all(abs(difference_rad(a.heading_rad, 0.0)) >= world.no_go - 1e-9 for _, a in headings)
    assert world.run(20, lambda w: w.mode is Mode.AUTO)  # left in the mission's safe end
    assert not [a for t, a in world.actions if isinstance(a, act.UploadMission)][5:]


@pytest.mark.parametrize(
    ("rock", "goal"),
    [
        (box(80.0, -12.0, 110.0, 25.0), (200.0, 0.0)),
        (box(-25.0, 60.0, 25.0, 100.0), (0.0, 200.0)),  # dead to windward; one as wide as the zone of 50 m is a trap
    ],
    ids=["reach", "beat"],
)
def test_a_voyage_by_field_goes_round_a_rock(rock, goal):
    world = make(rock, goals=(Goal(en_m=goal, radius_m=8.0),), config=BY_FIELD)
    assert world.run(600, lambda w: w.state.phase is Phase.DONE)
    assert world.clearance() > 4.0


def test_a_voyage_by_field_without_permission_sails_by_plan():
    world = make(config=BY_FIELD, permissions=replace(ALL_PERMITTED, may_steer=False))
    assert world.run(900, lambda w: w.state.phase is Phase.DONE)
    assert not steered(world)
    assert "guidance" in said(world)


@pytest.mark.parametrize("guidance", list(Guidance))
def test_station_keeping_lasts_as_long_as_asked(guidance):
    goal = Goal(en_m=(150.0, 0.0), radius_m=8.0)
    world = make(goals=(goal,), config={"guidance": guidance, "station_s": 120.0})
    assert world.run(600, lambda w: bool(w.state.progress.reached))
    arrived = world.t
    far = 0.0
    while world.state.phase is not Phase.DONE:
        assert world.t < arrived + 130.0
        world.step()
        far = max(far, distance_m(world.position, goal.en_m))
    assert world.t - arrived > 115.0
    assert far < 20.0
    assert bool(steered(world)) is (guidance is not Guidance.PLAN)


def test_a_vessel_that_she_keeps_clear_of_does_not_begin_her_station_anew():
    """ "waiting 400 s more" was said after each: where vessels pass, a station need never have ended."""
    world = make(goals=(Goal(en_m=(150.0, 0.0), radius_m=8.0),), config={"station_s": 300.0})
    assert world.run(600, lambda w: "keeping station" in w.state.why)
    began = world.t
    world.run(60)
    meet(world, Intruder(world, 90.0, 60.0), 120.0)
    assert said(world).count("last resort over") == 1
    assert "dragged off" not in said(world), "the field has led her off"
    assert world.run(300, lambda w: w.state.phase is Phase.DONE)
    assert world.t - began < 320.0


@pytest.mark.parametrize(("shore_m", "boards"), [(9.0, False), (14.0, False), (40.0, True)])
def test_on_a_station_without_room_she_is_led_by_a_field_that_keeps_off_the_shore(shore_m, boards):
    """Boards and loops look out for nothing: "keeping station: waiting 90 s more" was said of a boat on the shore."""
    world = make(
        box(50.0, shore_m, 250.0, 60.0),
        goals=(Goal(en_m=(150.0, 0.0), radius_m=8.0),),
        wind=lambda t: (math.pi, 6.0),
        config={"guidance": Guidance.FIELD, "station_s": 60.0, "margin_m": 8.0, "margin_floor_m": 4.0},
    )
    assert world.run(600, lambda w: bool(w.state.progress.reached))
    since = world.t
    world.run(50)
    told = [a.text for at_s, a in world.actions if at_s > since + 2.0 and isinstance(a, act.SteerHeading)]
    assert len(told) > 40
    assert any("board" in text or "loop" in text for text in told) is boards
    assert all(text.startswith("station: ") for text in told)


def test_by_field_the_floor_is_the_hulls_and_not_the_antennas():
    """Two channels by field: 4.95 m clear, and the floor was 5."""
    world = World(skipper=skipper(voyage(), guidance=Guidance.FIELD))
    ctx = StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())
    reach_m = world.skipper.voyage.boat.hull.reach_m
    assert reach_m > 0.0
    assert habits(ctx, 5.0).keep_m == world.skipper.config.margin_floor_m + reach_m


@pytest.mark.parametrize("can_tack", [True, False])
def test_by_field_a_boat_that_cannot_tack_needs_more_way_for_one_than_there_is(can_tack):
    ctx = moment(route((0.0, 300.0)))
    ctx.voyage = replace(ctx.voyage, boat=replace(ctx.voyage.boat, can_tack=can_tack))
    assert math.isinf(habits(ctx, 5.0).tack_min_mps) is not can_tack


@pytest.mark.parametrize("drift_mps", [0.5, 4.0])
def test_by_field_it_is_said_that_a_current_keeps_her_from_her_goal(drift_mps):
    """She was carried to leeward for 900 s, and nothing was said: no plan was asked for that would have told it."""
    made = voyage(Goal(en_m=(0.0, 600.0), radius_m=6.0, name="the mark"))
    world = World(Skipper(voyage=made, config=SkipperConfig(guidance=Guidance.FIELD)))
    assert world.run(120, lambda w: w.mode is Mode.GUIDED and w.speed > 1.0)
    world.extra = {"current": WaterCurrent(east_mps=0.0, north_mps=-drift_mps, is_significant=True)}
    world.run(30)
    told = [text for text in texts(world) if "cannot make way against" in text]
    assert bool(told) == (drift_mps == 4.0)
    assert all("the mark is not reached by field" in text for text in told)


@pytest.mark.parametrize("is_guided", [True, False])
def test_with_no_plan_on_board_the_field_steers_on_and_nobody_loiters(is_guided):
    world = World(Skipper(voyage=voyage(), config=SkipperConfig(guidance=Guidance.FIELD)))
    assert world.run(120, lambda w: w.mode is Mode.GUIDED and w.speed > 1.0)
    mission = world.state.mission
    world.state = with_parts(world.state, mission={"index": len(mission.route.items) - 1})
    world.set_mode(Mode.GUIDED if is_guided else Mode.AUTO)
    ctx = StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())
    _name(ctx)
    assert ("loitering" in ctx.state.why) is not is_guided
    assert ("by field to" in ctx.state.why) is is_guided


@pytest.mark.parametrize(("is_significant", "seen"), [(True, (0.4, -0.6)), (False, (0.0, 0.0))])
def test_the_guidance_sees_the_current_that_plans_reckon_with(is_significant, seen):
    water = WaterCurrent(east_mps=0.4, north_mps=-0.6, is_significant=is_significant)
    found = situation(moment(route((0.0, 200.0), (0.0, 200.0)), seen={"current": water}))
    assert found is not None
    assert found.current_en_mps == seen

"""The skipper among vessels: the route is given up when it meets one, and only then, and at most every 20 s."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from companion.planner import plan
from companion.planner.problem.value import sigmas_for, sized, vessel_count
from companion.planner.worker import failed
from companion.skipper.planning.vessels import HORIZON_S, NEAREST, UNKNOWN_S, lies_in_the_way, meetings, near, shares
from companion.skipper.step import actions as act
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.context import StepContext
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from companion.traffic import Targets, TrafficPicture
from tests.skipper.world import FRAME, World, skipper, voyage
from tests.traffic.conftest import report, vessel

GOAL = Goal(en_m=(900.0, 0.0), radius_m=6.0, name="the goal")  # a reach: the wind is from the north
HALF_M = 20.0


def make(**world):
    return World(skipper=skipper(voyage(GOAL)), expansions=1500, sigma=0.05, heading=math.pi / 2, **world)


class Ship:
    """A ship of 40 m on a straight course, at ``en`` at t = 0."""

    def __init__(self, en, course_deg, speed_mps, name="Ship"):
        self.en, self.course, self.speed, self.name = en, math.radians(course_deg), speed_mps, name

    def at(self, t):
        run = self.speed * t
        return self.en[0] + run * math.sin(self.course), self.en[1] + run * math.cos(self.course)

    def heard(self, t, **more):
        values = {"course_rad": self.course, "speed_mps": self.speed, "heading_rad": self.course}
        size = {"bow_m": HALF_M, "stern_m": HALF_M, "port_m": 3.0, "starboard_m": 3.0}
        return report(t, self.at(t), name=self.name, **(values | size | more))


def sail(world, ship, seconds=900.0, every_s=10.0):
    """Sail until done; return the least distance to the ship's middle."""
    heard, least = Targets.empty(FRAME), math.inf
    while world.t < seconds and world.state.phase is not Phase.DONE:
        if world.t % every_s == 0.0:
            heard = heard.heard(ship.heard(world.t))
        world.extra = {"traffic": heard.picture(world.t)}
        world.step()
        least = min(least, distance_m(world.position, ship.at(world.t)))
    return least


def asked(world):
    return [(t, a) for t, a in world.actions if isinstance(a, act.RequestPlan)]


def for_traffic(world):
    return [(t, a) for t, a in asked(world) if a.reason is ReplanReason.OBSTACLE]


@pytest.mark.parametrize(("course_deg", "speed_mps"), [(180.0, 4.0), (0.0, 4.0), (270.0, 4.0), (90.0, 20.0)])
def test_a_route_that_meets_a_ship_is_given_up(course_deg, speed_mps):
    c, when = math.radians(course_deg), 170.0
    ship = Ship((450.0 - when * speed_mps * math.sin(c), -when * speed_mps * math.cos(c)), course_deg, speed_mps)
    world = make()
    least = sail(world, ship)
    assert world.state.phase is Phase.DONE
    assert least > HALF_M + 50.0
    assert for_traffic(world) or any(a.problem.targets for _, a in asked(world))
    for (before, _), (t, a) in pairwise(asked(world)):
        assert a.reason is not ReplanReason.OBSTACLE or a.rung or t - before >= 20.0


def test_the_same_ship_unheard_comes_near():
    assert sail_unheard(Ship((450.0, 170.0 * 4.0), 180.0, 4.0)) < HALF_M + 50.0


def sail_unheard(ship):
    world, least = make(), math.inf
    while world.t < 900.0 and world.state.phase is not Phase.DONE:
        world.step()
        least = min(least, distance_m(world.position, ship.at(world.t)))
    return least


def test_a_ship_that_turns_late_is_announced_by_name():
    """It appears 250 m ahead, after the boat has set sail."""
    world = make()
    world.run(120)
    ship = Ship((world.position[0] + 250.0 + 3.0 * 120.0, 0.0), 270.0, 3.0, name="Nellie")
    sail(world, ship)
    said = [text for _, code, text in world.log if code == "traffic"]
    assert said
    assert "Nellie" in said[0]
    assert for_traffic(world)
    assert "Nellie" in for_traffic(world)[0][1].text


def test_a_ship_that_passes_clear_changes_nothing():
    world, alone = make(), make()
    sail(world, Ship((-200.0, 1500.0), 90.0, 5.0))
    sail_alone = alone.run(900, lambda w: w.state.phase is Phase.DONE)
    assert sail_alone
    assert not for_traffic(world)
    assert [a.reason for _, a in asked(world)] == [a.reason for _, a in asked(alone)]
    assert np.allclose(world.position, alone.position)


@pytest.mark.parametrize(
    ("faster", "north_m", "is_replaced"),
    [
        (0.05, 60.0, False),
        (0.10, 250.0, False),  # clear of everyone: not for so little
        (0.25, 60.0, True),  # clearly faster, and it looks alike
        (0.25, 250.0, False),
        (0.45, 250.0, True),  # far apart: only for twice as much
    ],
)
def test_among_ships_a_safe_route_is_replaced_by_a_clearly_faster_one_only(faster, north_m, is_replaced):
    """A ship passes clear; the planner is made to answer with a path ``north_m`` aside that claims to be faster."""

    def planner(p, seed):
        found = plan(p, expansions=1500, seed=seed)
        if not p.targets or not armed:
            return found
        start, goal = found.waypoints_en[0], found.waypoints_en[-1]
        middle = np.array([0.5 * (start[0] + goal[0]), north_m])
        half = np.linspace(0.0, 1.0, 40)[:, None]  # more waypoints than are simplified away
        aside = np.vstack([start + half * (middle - start), middle + half[1:] * (goal - middle)])
        return replace(found, waypoints_en=aside, cost_s=(1.0 - faster) * found.cost_s)

    armed = []
    world = make(planner=planner)
    ship, heard = Ship((200.0, 1100.0), 90.0, 2.0), Targets.empty(FRAME)
    while world.t < 120.0:
        if world.t % 10.0 == 0.0:
            heard = heard.heard(ship.heard(world.t))
        world.extra = {"traffic": heard.picture(world.t)}
        if world.t == 90.0:
            armed.append(True)
            before = len([a for _, a in world.actions if isinstance(a, act.UploadMission)])
            world.order("replan")
        world.step()
    uploads = [a for _, a in world.actions if isinstance(a, act.UploadMission)][before:]
    assert asked(world)[-1][1].problem.targets
    assert bool(uploads) is is_replaced
    for upload in uploads:
        assert not upload.change.unsafe
        assert upload.change.apart_m == pytest.approx(north_m, abs=30.0)


def test_without_a_way_clear_the_old_plan_stays_and_the_operator_is_told():
    world = make(
        planner=lambda p, seed: (
            failed("none", seed=seed, algorithm="auto") if p.targets else plan(p, expansions=1500, seed=seed)
        )
    )
    world.run(60)
    before = world.mission
    sail(world, Ship((world.position[0] + 400.0 + 3.0 * 60.0, 0.0), 270.0, 3.0, name="Nellie"), seconds=140.0)
    assert for_traffic(world)
    assert any(code == "no way clear" and "Nellie" in text for _, code, text in world.log)
    assert world.mission == before


# ------------------------------------------------------------------------------------------- the discs
def turn_among(*vessels):
    world = make()
    world.run(60)
    world.extra = {"traffic": TrafficPicture(t_s=world.t, vessels=vessels)}
    return StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())


def test_a_plan_that_starts_within_a_disc_may_leave_it():
    ctx = turn_among()
    here = ctx.boat_en
    ctx = turn_among(vessel((here[0] + 80.0, here[1]), 0.0, 2.0, t_s=ctx.t_s, heard_s=ctx.t_s))
    assert meetings(ctx)
    found = shared_discs(shares(ctx, here, 0.0, 0, 0.95))
    assert found
    assert all(distance_m(here, (t.x_m, t.y_m)) > t.radius_m for t in found if t.from_s == 0.0)


@pytest.mark.parametrize("delta_s", [0.5, 0.66, 0.8, 0.95])
@pytest.mark.parametrize("rung", range(6))
def test_no_rung_among_vessels_asks_for_less_than_a_plan_can_promise(rung, delta_s):
    ctx = turn_among(vessel((300.0, 200.0), 0.0, 2.0, t_s=60.0, heard_s=60.0))
    asked = shares(ctx, ctx.boat_en, 0.0, rung, delta_s)
    assert asked.targets
    assert asked.part is not None
    assert asked.part > 0.0
    assert 0.5 <= asked.delta_s <= asked.wind_delta_s


def test_a_vessel_of_unknown_course_blocks_the_next_moments_only():
    ctx = turn_among(vessel((300.0, 200.0), None, None, t_s=60.0, heard_s=60.0))
    found = shares(ctx, ctx.boat_en, 0.0, 0, 0.95).targets
    assert found
    assert max(t.until_s for t in found) == pytest.approx(UNKNOWN_S)


def test_only_vessels_that_can_be_met_within_the_horizon_count():
    there = vessel((4.0 * HORIZON_S + 5000.0, 0.0), 0.0, 1.0, t_s=60.0, heard_s=60.0)
    assert near(turn_among(there)) == ()
    assert meetings(turn_among(there)) == ()


def shared_discs(found):
    """The discs of a plan's vessels as the planner sizes them."""
    return sized(found.targets, sigmas_for(found.part, vessel_count(found.targets)))


def test_the_promise_is_shared_between_wind_and_vessels():
    ctx = turn_among(vessel((400.0, 300.0), 180.0, 3.0, t_s=60.0, heard_s=60.0))
    found = shares(ctx, ctx.boat_en, 0.0, 0, 0.95)
    assert found.delta_s == pytest.approx(0.95)
    assert (1.0 - found.wind_delta_s) + found.part == pytest.approx(0.05)
    alone = shares(turn_among(), ctx.boat_en, 0.0, 0, 0.95)
    assert (alone.targets, alone.delta_s, alone.wind_delta_s, alone.part) == ((), 0.95, 0.95, None)


def test_later_rungs_risk_more_for_vessels_and_say_so():
    ctx = turn_among(vessel((400.0, 300.0), 180.0, 3.0, t_s=60.0, heard_s=60.0))
    first, later = (shares(ctx, ctx.boat_en, 0.0, rung, 0.95) for rung in (0, 2))
    assert later.part > first.part
    assert later.wind_delta_s == first.wind_delta_s
    assert later.delta_s < first.delta_s
    assert all(
        a.radius_m + a.growth_mps * a.from_s > b.radius_m + b.growth_mps * b.from_s
        for a, b in zip(shared_discs(first), shared_discs(later), strict=True)
    )


@pytest.mark.parametrize("comes_from", ["ahead", "abeam"])
def test_of_too_many_a_plan_is_told_of_the_ship_on_collision_course(comes_from):
    """Two dozen at their moorings near by were told of, and she was not."""
    ctx = turn_among()
    here, (ve, vn) = ctx.boat_en, ctx.snapshot.vehicle.velocity_en_mps
    moored = [
        vessel(
            (here[0] - 60.0 - 5.0 * k, here[1] + 80.0), None, 0.0, mmsi=1000 + k, nav_status=5, t_s=60.0, heard_s=60.0
        )
        for k in range(24)
    ]
    met = here[0] + 400.0 * ve, here[1] + 400.0 * vn  # where we are in 400 s
    ship = (
        vessel((met[0] + 2000.0, met[1]), 270.0, 5.0, mmsi=77, t_s=60.0, heard_s=60.0)
        if comes_from == "ahead"
        else vessel((met[0], met[1] - 2000.0), 0.0, 5.0, mmsi=77, t_s=60.0, heard_s=60.0)
    )
    told = [v.mmsi for v in near(turn_among(*moored, ship))]
    assert len(told) == NEAREST
    assert 77 in told
    assert told[:6] == [1000 + k for k in range(6)], "the soonest first, as ever"
    few = near(turn_among(*moored[:11], ship))
    assert [v.mmsi for v in few] == [*range(1000, 1011), 77], "where there is room nobody is left out"


@pytest.mark.parametrize(("en", "what"), [((905.0, 30.0), "m from the goal"), ((450.0, 30.0), "from the straight way")])
@pytest.mark.parametrize("is_told", [True, False])
def test_a_vessel_that_lies_in_the_way_is_named_before_setting_sail(en, what, is_told):
    world = make()
    lying = Ship(en, 0.0, 0.0, name="Nellie")
    untold = {} if is_told else {"bow_m": None, "stern_m": None, "port_m": None, "starboard_m": None}
    world.extra = {"traffic": Targets.empty(FRAME).heard(lying.heard(0.0, **untold)).picture(1.0)}
    ctx = StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())
    assert not ctx.state.voyage.sailing
    why = lies_in_the_way(ctx)
    assert "Nellie lies" in why
    assert what in why
    assert "skip_goal" in why
    assert ("her size is not told and taken to be 100 by 16 m" in why) is (not is_told)

"""Under the policy "rules" the skipper stands on, gives way early, by much and astern, and says so once."""

import math
from dataclasses import replace

import pytest

from companion.boat import Boat, constant
from companion.geo.angles import difference_rad
from companion.messages import Severity
from companion.planners import PlannerChoice
from companion.skipper.planning.diversions import announcement
from companion.skipper.planning.right_of_way import bow_discs, regions, stands_on
from companion.skipper.planning.vessels import meetings, near, shares
from companion.skipper.step import actions as act
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.context import StepContext
from companion.skipper.watch.watch import look_out
from companion.skipper.way.geometry import distance_m
from companion.traffic import Policy, Role, TrafficPicture
from companion.traffic.colregs import APPARENT_RAD
from tests.skipper.planning.test_traffic import Ship, asked, for_traffic, make, sail
from tests.skipper.world import with_parts
from tests.traffic.conftest import vessel

POWER, FISHING = {"nav_status": 0, "ship_type": 70}, {"nav_status": 7, "ship_type": 30}


def ruled(policy=Policy.RULES, **more):
    world = make()
    config = replace(world.skipper.config, traffic_policy=policy, **more)
    world.skipper = replace(world.skipper, config=config)
    return world


class Known(Ship):
    """A ship that says what she is."""

    def __init__(self, *args, kind=POWER, **more):
        super().__init__(*args, **more)
        self.kind = kind

    def heard(self, t, **more):
        return super().heard(t, **(self.kind | more))


def meets(world, kind, speed_mps=4.0, when_s=120.0):
    """A boat under way, and a ship from south that is where she would be after ``when_s``."""
    world.run(40)
    east, north = world.snapshot().vehicle.velocity_en_mps
    at = world.position[0] + east * when_s, world.position[1] + north * when_s
    return Known((at[0], at[1] - speed_mps * (world.t + when_s)), 0.0, speed_mps, kind=kind)


def turn_with(kind, *, away_m=400.0, course_deg=0.0, policy=Policy.RULES):
    """A boat under way, east, and a vessel that crosses ahead of her from south."""
    world = ruled(policy)
    world.run(60)
    here, speed = world.position, 3.0
    mps = max(0.1, world.snapshot().vehicle.speed_mps)
    other = vessel(
        (here[0] + mps * away_m / speed, here[1] - away_m),
        course_deg,
        speed,
        size=(10.0, 10.0, 3.0, 3.0),
        t_s=world.t,
        heard_s=world.t,
        **kind,
    )
    world.extra = {"traffic": TrafficPicture(t_s=world.t, vessels=(other,))}
    ctx = StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())
    look_out(ctx)
    return ctx


def said(ctx):
    return [a for a in ctx.actions if isinstance(a, act.Announce) and a.code == "encounter"]


def test_a_motor_ship_that_has_time_is_stood_on_to():
    ctx = turn_with(POWER)
    [held] = ctx.state.traffic.encounters
    assert held.stands_on
    assert stands_on(ctx)
    assert not meetings(ctx)
    assert shares(ctx, ctx.boat_en, 0.0, 0, 0.9).targets == ()
    [line] = said(ctx)
    assert (line.severity, "standing on" in line.text) == (Severity.WARNING, True)
    look_out(ctx)
    assert len(said(ctx)) == 1


def test_who_gives_way_to_one_keeps_clear_of_the_other_too():
    ctx = turn_with(POWER)
    here = ctx.boat_en
    [ship] = ctx.snapshot.traffic.vessels
    fisher = vessel(
        (ship.antenna_en_m[0], 2.0 * here[1] - ship.antenna_en_m[1]),
        180.0,
        3.0,
        mmsi=7,
        t_s=ctx.t_s,
        heard_s=ctx.t_s,
        size=(10.0, 10.0, 3.0, 3.0),
        **FISHING,
    )
    both = replace(ctx.snapshot, traffic=TrafficPicture(t_s=ctx.t_s, vessels=(ship, fisher)))
    ctx = StepContext(ctx.voyage, ctx.config, with_parts(ctx.state, traffic={"encounters": ()}), both)
    look_out(ctx)
    assert [h.stands_on for h in ctx.state.traffic.encounters] == [False, True]
    assert {t.name for t in shares(ctx, here, 0.0, 0, 0.9).targets} >= {"7", "211000001", "ahead of 7"}


def test_the_same_ship_is_kept_clear_of_by_default():
    ctx = turn_with(POWER, policy=Policy.KEEP_CLEAR)
    assert SkipperConfig().traffic_policy is Policy.KEEP_CLEAR
    assert not ctx.state.traffic.encounters
    assert not said(ctx)
    assert meetings(ctx)
    assert {t.name for t in shares(ctx, ctx.boat_en, 0.0, 0, 0.9).targets} == {"211000001"}


@pytest.mark.parametrize(("planner", "rung", "is_kept"), [("auto", 1, False), ("astar", 1, True), ("astar", 2, False)])
def test_the_water_that_the_rules_close_is_closed_until_something_is_given_up(planner, rung, is_kept):
    ctx = turn_with(FISHING)
    ctx.config = replace(ctx.config, planner=PlannerChoice(algorithm=planner))
    names = {t.name for t in shares(ctx, ctx.boat_en, 0.0, rung, 0.9).targets}
    assert ("ahead of 211000001" in names) is is_kept


def test_giving_way_closes_the_water_ahead_of_her_bow_and_our_old_course():
    ctx = turn_with(FISHING)
    [held] = ctx.state.traffic.encounters
    assert held.gives_way
    found = shares(ctx, ctx.boat_en, 0.0, 0, 0.9).targets
    bows = [t for t in found if t.name.startswith("ahead of")]
    [apparent] = [t for t in found if t.name.startswith("apparent")]
    assert len(bows) >= 3
    there = next(v for v in near(ctx)).centre_en_m
    assert all(t.y_m > there[1] and t.x_m == pytest.approx(there[0]) and t.vy_mps > 0.0 for t in bows)
    away = distance_m(ctx.boat_en, (apparent.x_m, apparent.y_m))
    assert math.asin(apparent.radius_m / away) == pytest.approx(APPARENT_RAD)
    course = math.atan2(apparent.x_m - ctx.boat_en[0], apparent.y_m - ctx.boat_en[1])
    assert abs(difference_rad(course, math.pi / 2.0)) < 0.1
    # The ladder's next step has none of it: to be clear comes first.
    assert {t.name for t in shares(ctx, ctx.boat_en, 0.0, 1, 0.9).targets} == {"211000001"}


def test_when_the_change_of_course_has_shown_the_old_course_is_free_again():
    ctx = turn_with(FISHING)
    ctx.state = with_parts(
        ctx.state, traffic={"encounters": tuple(replace(h, altered=True) for h in ctx.state.traffic.encounters)}
    )
    names = {t.name.partition(" ")[0] for t in regions(ctx, near(ctx), ctx.boat_en, 0.0, is_met=True)}
    assert names == {"ahead"}


def test_a_region_that_the_boat_is_in_is_left_out():
    ctx = turn_with(FISHING)
    inside = bow_discs(ctx, near(ctx), ctx.t_s)[1]
    found = regions(ctx, near(ctx), (inside.x_m, inside.y_m), 0.0, is_met=False)
    assert all(distance_m((inside.x_m, inside.y_m), (t.x_m, t.y_m)) > t.radius_m for t in found)


def test_a_vessel_that_comes_from_astern_has_no_closed_bow():
    ctx = turn_with(FISHING)
    ctx.state = with_parts(
        ctx.state,  # as if alike
        traffic={"encounters": tuple(replace(h, course_rad=0.0) for h in ctx.state.traffic.encounters)},
    )
    assert bow_discs(ctx, near(ctx), ctx.t_s) == ()


def test_under_power_the_port_side_is_closed_end_on():
    world = ruled()
    world.run(60)
    here = world.position
    ship = vessel(
        (here[0] + 500.0, here[1]), 270.0, 4.0, size=(10.0, 10.0, 3.0, 3.0), t_s=world.t, heard_s=world.t, **POWER
    )
    world.extra = {"traffic": TrafficPicture(t_s=world.t, vessels=(ship,))}
    config = replace(world.skipper.config, sails=False)
    ctx = StepContext(world.skipper.voyage, config, world.state, world.snapshot())
    look_out(ctx)
    [held] = ctx.state.traffic.encounters
    assert held.encounter.role is Role.BOTH_ALTER
    closed = [t for t in regions(ctx, near(ctx), ctx.boat_en, 0.0, is_met=True) if t.name.startswith("apparent")]
    assert len(closed) == 3
    assert all(t.y_m > ctx.boat_en[1] - 10.0 for t in closed)  # ahead and to port, which is north
    assert sum(t.y_m > ctx.boat_en[1] + 30.0 for t in closed) == 2


def test_a_motor_ship_that_never_acts_is_stood_on_to_and_then_avoided():
    world = ruled()
    least = sail(world, meets(world, POWER), every_s=2.0)
    lines = [(t, text) for t, code, text in world.log if code == "encounter"]
    stood = [t for t, text in lines if "standing on" in text]
    acted = [t for t, text in lines if "she does not give way" in text]
    assert len(stood) == len(acted) == 1
    assert acted[0] - stood[0] > 30.0
    assert all(t >= acted[0] for t, _ in for_traffic(world))
    assert for_traffic(world)
    assert least > 20.0 + 40.0
    assert any("past and clear" in text for _, text in lines)


def test_a_fishing_vessel_is_given_way_to_as_soon_as_she_is_met():
    world = ruled()
    least = sail(world, meets(world, FISHING), every_s=2.0)
    assert least > 20.0 + 50.0
    begun = next(t for t, code, text in world.log if code == "encounter" and "give way" in text)
    assert for_traffic(world)[0][0] - begun <= 25.0


def test_standing_on_no_routine_plan_is_asked_for():
    world = ruled()
    sail(world, meets(world, POWER), every_s=2.0)
    lines = [(t, text) for t, code, text in world.log if code == "encounter"]
    begun, acted = lines[0][0], next(t for t, text in lines if "does not give way" in text)
    routine = {ReplanReason.WAYPOINT, ReplanReason.FORECAST, ReplanReason.WIND_SHIFT, ReplanReason.PLAN_AGE}
    assert not [t for t, a in asked(world) if begun < t < acted and a.reason in routine]


def test_the_policy_is_said_before_setting_sail():
    boat = Boat(polar=constant(2.0))
    assert announcement(SkipperConfig(), boat).endswith("vessels: kept clear of, whoever must give way")
    assert "rules of the road" in announcement(SkipperConfig(traffic_policy=Policy.RULES), boat)
    limited = announcement(SkipperConfig(), replace(boat, max_tws_mps=12.0))
    assert "strong wind: to the nearest refuge" in limited
    assert "wind:" not in announcement(SkipperConfig(), boat)

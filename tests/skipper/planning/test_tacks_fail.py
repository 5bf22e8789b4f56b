"""A tack that failed: said once, learned from, planned for at once near something, gybed round after two in a row."""

import math
from dataclasses import replace

import pytest
import shapely

from companion.boat.failed_tack import IRONS_S
from companion.skipper.planning.asking import request
from companion.skipper.planning.autopilot_beats import gybing_radius_m, tacks_fail
from companion.skipper.step.actions import ReplanReason, RequestPlan
from companion.skipper.step.context import StepContext
from companion.skipper.step.saved import MOST_IRONS_S, MOST_LEE_MPS, Persisted
from companion.skipper.step.state import Tacking
from companion.skipper.watch.tacks import TACK_FAILED, watch_tacks
from companion.skipper.way.geometry import GYBE_RADIUS_M
from tests.skipper.test_voyage import make, said
from tests.skipper.world import with_parts

ROCK = shapely.box(25.0, 35.0, 60.0, 120.0)


def under_way(given=0.1, obstacles=(), **tacking):
    world = make(obstacles=obstacles)
    voyage = world.skipper.voyage
    world.skipper = replace(world.skipper, voyage=replace(voyage, boat=replace(voyage.boat, tack_fails=given)))
    assert world.run(120, lambda w: w.state.voyage.sailing)
    world.state = with_parts(world.state, tacking=Tacking(**tacking), plans={"asked": ""})
    return world


def turn_of(world, **changes):
    return StepContext(world.skipper.voyage, world.skipper.config, with_parts(world.state, **changes), world.snapshot())


def fallen_back(world, **seen):
    """Return the turn in which she is back on the tack that she came from."""
    snapshot = world.snapshot()
    off = math.radians(50.0)
    vehicle = replace(snapshot.vehicle, heading_rad=off)
    tacking = Tacking(side=-1, settled_rad=off, settled_s=world.t - 7.0, began_s=world.t - 6.0, **seen)
    ctx = StepContext(
        world.skipper.voyage,
        world.skipper.config,
        replace(world.state, tacking=tacking),
        replace(snapshot, vehicle=vehicle),
    )
    watch_tacks(ctx)
    return ctx


def test_a_failure_is_said_with_what_it_taught_and_asks_for_a_plan_near_something():
    ctx = fallen_back(under_way(obstacles=[ROCK]))
    assert ctx.state.tacking.failed == ctx.state.tacking.tried == 1
    [text] = [a.text for a in ctx.actions if getattr(a, "code", "") == "tack failed"]
    assert "1 of 1" in text
    assert "25 %" in text  # (0.1 * 5 + 1) / 6
    assert ctx.state.plans.asked == TACK_FAILED
    assert ctx.state.plans.asked_as is ReplanReason.TACK_FAILED


def test_far_from_everything_only_the_second_in_a_row_asks():
    assert fallen_back(under_way()).state.plans.asked == ""
    assert fallen_back(under_way(), tried=1, failed=1, in_a_row=1).state.plans.asked == TACK_FAILED


def test_a_mission_that_says_0_asks_for_nothing_and_goes_on_tacking():
    ctx = fallen_back(under_way(0.0, [ROCK]), tried=1, failed=1, in_a_row=1)
    assert ctx.state.tacking.failed == 2
    assert ctx.state.plans.asked == ""
    assert not tacks_fail(ctx)


def test_two_in_a_row_are_gybed_round_until_one_comes_off_or_ten_minutes_have_passed():
    world = under_way(tried=4, failed=2, in_a_row=2, failed_s=0.0)
    now = replace(world.state.tacking, failed_s=world.t)
    assert tacks_fail(turn_of(world, tacking=now))
    assert not tacks_fail(turn_of(world, tacking=replace(now, in_a_row=0)))
    assert not tacks_fail(turn_of(world, tacking=replace(now, failed_s=world.t - 601.0)))


def test_what_was_learned_is_in_the_next_problem():
    world = under_way(0.1, tried=5, failed=4)
    ctx = turn_of(world)
    assert request(ctx, ReplanReason.ORDER)
    [asked] = [a for a in ctx.actions if isinstance(a, RequestPlan)]
    assert asked.problem.boat.tack_fails == pytest.approx((0.5 + 4.0) / 10.0)
    assert asked.problem.wind.strength.is_known
    assert min(asked.problem.wind.strength.sigma_mps) > 0.0


def test_how_she_lay_is_in_the_next_problem_and_before_a_failure_is_not():
    for failed, irons_s, lee_mps in ((0, IRONS_S, (0.0, 0.0)), (1, 14.0, (0.4, 0.0))):
        world = under_way(0.1, tried=3, failed=failed, irons_s=14.0, starboard_lee_mps=0.4)
        ctx = turn_of(world)
        assert request(ctx, ReplanReason.ORDER)
        [asked] = [a for a in ctx.actions if isinstance(a, RequestPlan)]
        assert (asked.problem.boat.irons_s, asked.problem.boat.lee_mps) == (irons_s, lee_mps)


def test_a_plan_of_a_boat_in_irons_begins_on_the_tack_that_she_falls_off_to():
    world = under_way(0.1, tried=1, failed=1)
    lies = replace(world.state.tacking, is_counted=True, side=1, settled_rad=math.radians(-50.0), began_s=world.t - 9.0)
    ctx = turn_of(world, tacking=lies)
    assert request(ctx, ReplanReason.ORDER)
    [asked] = [a for a in ctx.actions if isinstance(a, RequestPlan)]
    assert math.degrees(asked.problem.start_heading_rad) % 360.0 == pytest.approx(310.0)


def test_what_was_counted_survives_a_restart_and_nonsense_does_not():
    world = under_way(tried=7, failed=3)
    saved = world.skipper.persisted(world.state)
    assert saved.tacks == (7, 3)
    data = saved.to_dict()
    again = world.skipper.initial(Persisted.from_dict(data))
    assert (again.tacking.tried, again.tacking.failed, again.tacking.in_a_row) == (7, 3, 0)
    assert Persisted.from_dict({k: v for k, v in data.items() if k != "tacks"}).tacks == (0, 0)
    for wrong in ([2, 3], [-1, 0], [1], "ab", [1.5, 1]):
        with pytest.raises(ValueError, match="damaged"):
            Persisted.from_dict(data | {"tacks": wrong})


def test_how_she_lay_and_was_set_survives_a_restart_and_nonsense_does_not():
    world = under_way(tried=2, failed=1, irons_s=17.5, starboard_lee_mps=0.3, port_lee_mps=0.1)
    data = world.skipper.persisted(world.state).to_dict()
    again = world.skipper.initial(Persisted.from_dict(data)).tacking
    assert (again.irons_s, again.starboard_lee_mps, again.port_lee_mps) == (17.5, 0.3, 0.1)
    old = Persisted.from_dict({k: v for k, v in data.items() if k != "failed_tack"})
    assert (old.irons_s, old.lee_mps) == (0.0, (0.0, 0.0))
    most = Persisted.from_dict(data | {"failed_tack": [1e6, -1.0, 9.0]})
    assert (most.irons_s, most.lee_mps) == (MOST_IRONS_S, (0.0, MOST_LEE_MPS))
    for wrong in ([1.0], [math.nan, 0.0, 0.0], "abc", [1.0, True, 0.0], None):
        with pytest.raises(ValueError, match="damaged"):
            Persisted.from_dict(data | {"failed_tack": wrong})


@pytest.mark.parametrize(
    ("turn_degps", "radius_m", "loses_s"), [(45.0, GYBE_RADIUS_M, (5.0, 20.0)), (4.0, 41.0, (30.0, 60.0))]
)
def test_gybing_round_is_priced_as_it_is_sailed(turn_degps, radius_m, loses_s):
    world = under_way(tried=4, failed=2, in_a_row=2)
    boat = replace(world.skipper.voyage.boat, turn_rate_radps=math.radians(turn_degps))
    world.skipper = replace(world.skipper, voyage=replace(world.skipper.voyage, boat=boat))
    asked = {}
    for in_a_row in (0, 2):
        ctx = turn_of(world, tacking=replace(world.state.tacking, in_a_row=in_a_row, failed_s=world.t))
        assert request(ctx, ReplanReason.ORDER)
        [asked[in_a_row]] = [a.problem.boat for a in ctx.actions if isinstance(a, RequestPlan)]
    assert gybing_radius_m(ctx) == pytest.approx(radius_m, rel=0.1)
    assert asked[0].tack_loss_s == boat.tack_loss_s
    assert loses_s[0] < asked[2].tack_loss_s < loses_s[1]


def test_the_loops_of_a_boat_that_turns_slowly_are_of_her_own_circle():
    world = make(obstacles=(), wind=lambda t: (0.0, 5.0), config={"no_go_patience_s": 1e9})
    boat = replace(world.skipper.voyage.boat, turn_rate_radps=math.radians(8.0))
    world.skipper = replace(world.skipper, voyage=replace(world.skipper.voyage, boat=boat))
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.state = with_parts(world.state, steering={"irons_s": (world.t - 60.0, world.t - 5.0)})
    world.order("replan")
    assert world.run(30, lambda w: said(w, "gybing round"))
    world.run(3)
    points = world.state.mission.route.points_en_m[world.state.mission.index : -1]
    radius_m = gybing_radius_m(turn_of(world))
    assert radius_m > 2.0 * GYBE_RADIUS_M
    assert any(math.dist(a, b) == pytest.approx(2.0 * radius_m) for a, b in zip(points, points[2:], strict=False))

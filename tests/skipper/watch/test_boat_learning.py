"""The boat learned under way: from which seconds, when plans are told of it, how it is frozen."""

import math
from dataclasses import replace

import pytest

from companion.boat import Afloat, LearnedAfloat, Why, as_learned, mark_of
from companion.boat.afloat import Told
from companion.messages import Mode
from companion.orders import Result
from companion.skipper.planning.asking import request
from companion.skipper.step import actions as act
from companion.skipper.step.actions import ReplanReason, RequestPlan
from companion.skipper.step.config import Learning, Permissions
from companion.skipper.step.context import StepContext
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import ParameterChanged, WindBefore, WindHealth
from companion.skipper.step.state import Phase
from companion.skipper.watch import boat_learning
from companion.skipper.watch.boat_learning import CODE, SAILED, learn_boat, poison
from companion.skipper.way.shoals import Shoal
from companion.skipper.way.voyage import Goal
from tests.skipper.world import World, restarted, skipper, voyage, with_parts

SLOW = Told(x=(-0.3, 0.0, 0.0, 0.0), wider_rad=math.radians(3.0), speed_error=0.07, tack_loss_s=6.0)


def under_way(**config):
    world = World(skipper(voyage(Goal(en_m=(900.0, 0.0))), **config))
    assert world.run(120, lambda w: w.state.voyage.sailing)
    assert world.run(60, lambda w: w.state.phase in SAILED)
    world.run(20)
    return world


def turn_of(world, changes=(), **snapshot):
    state = with_parts(world.state, **dict(changes))
    return StepContext(world.skipper.voyage, world.skipper.config, state, replace(world.snapshot(), **snapshot))


def known_of(world, **more):
    of = mark_of(world.skipper.voyage.boat)
    return LearnedAfloat(**{"of": of, "told": SLOW, "is_used": True, "sailed_s": 4000.0} | more)


def knowing(world, **more):
    return {"afloat": Afloat.of(known_of(world, **more))}


def test_steady_sailing_is_looked_at_and_no_more_than_three_minutes_are_kept():
    world = under_way()
    assert poison(turn_of(world)) is None
    assert len(world.state.afloat.looks) >= 20
    world.run(280)
    looks = world.state.afloat.looks
    assert 100 < len(looks) <= 215
    assert math.hypot(*looks[-1].velocity_en_mps) == pytest.approx(world.speed, abs=0.1)


def test_a_look_is_of_the_water_s_wind_and_way():
    """Over the ground the water's own motion is in both: 0.3 m/s to the east, and the wind from south-east."""
    world = under_way()
    ctx = turn_of(world)
    twd = math.radians(130.0)
    water = replace(ctx.snapshot.current, east_mps=0.3, north_mps=-0.1, var_ee=0.04, var_nn=0.01)
    wind = replace(ctx.snapshot.wind, present_twd_from_rad=twd, present_tws_mps=6.0)
    vehicle = replace(ctx.snapshot.vehicle, velocity_en_mps=(1.0, 2.0), heading_rad=0.0)
    seen = replace(ctx.snapshot, current=water, wind=wind, vehicle=vehicle)
    look = boat_learning._look(seen)
    assert look.velocity_en_mps == pytest.approx((0.7, 2.1))
    assert look.wind_en_mps == pytest.approx((6.0 * math.sin(twd) + 0.3, 6.0 * math.cos(twd) - 0.1))
    assert look.doubt_mps == pytest.approx(0.1)
    assert (look.here_en_m, look.heading_rad, look.t_s) == (seen.position_en_m, 0.0, seen.t_s)
    assert boat_learning._look(replace(seen, vehicle_age_s=1.5)) is not None
    for lacking in (
        {"vehicle_age_s": 1.6},
        {"vehicle_age_s": None},
        {"vehicle": None},
        {"position_en_m": None},
        {"wind": replace(wind, present_twd_from_rad=None)},
        {"wind": replace(wind, present_tws_mps=None)},
    ):
        assert boat_learning._look(replace(seen, **lacking)) is None


def with_wind(world, **wind):
    return {"wind": replace(world.snapshot().wind, **wind)}


@pytest.mark.parametrize(
    ("why", "state", "seen"),
    [
        (Why.NOT_SAILED, {"voyage": {"sailing": False}}, {}),
        (Why.NOT_SAILED, {"voyage": {"over": "all goals are reached"}}, {}),
        (Why.NOT_SAILED, {"phase": Phase.HOLDING}, {}),
        (Why.NOT_SAILED, {"phase": Phase.LAST_RESORT}, {}),
        (Why.NOT_SAILED, {"vehicle": {"is_ours": False}}, {}),
        (Why.MOTOR, {"adrift": {"motor": True}}, {}),
        (Why.RESET, {"position": {"lost_s": 1.0}}, {}),
        (Why.RESET, {"position": {"disputed_s": 1.0}}, {}),
        (Why.DOUBTED, {}, {"unsure": "the wind's direction leapt"}),
        (Why.DOUBTED, {}, {"wind_before": WindBefore(twd_from_rad=0.0, tws_mps=5.0, turned_rad=1.0)}),
        (Why.FROZEN_VANE, {}, {"health": WindHealth.UNTRUSTED}),
        (Why.LIGHT, {}, {"health": WindHealth.LIGHT}),
        (Why.LIGHT, {}, {"health": WindHealth.SETTLING}),
    ],
)
def test_what_may_be_poisoned_is_not_learned_from(why, state, seen):
    world = under_way()
    assert len(world.state.afloat.looks) >= 20
    ctx = turn_of(world, state, **(with_wind(world, **seen) if "health" in seen else seen))
    assert poison(ctx) is why
    learn_boat(ctx)
    assert ctx.state.afloat.looks == ()
    assert dict(ctx.state.afloat.left_out)[why] == 1


def test_neither_is_a_hand_at_the_helm_nor_a_filter_that_is_ill_nor_the_minute_after_a_doubt():
    world = under_way()
    status = world.snapshot().autopilot
    for why, changes in (
        (Why.NOT_SAILED, {"mode": Mode.MANUAL}),
        (Why.NOT_SAILED, {"mode": Mode.GUIDED}),
        (Why.NOT_SAILED, {"is_armed": False}),
        (Why.RESET, {"ekf_ok": False}),
    ):
        assert poison(turn_of(world, autopilot=replace(status, **changes))) is why
    assert poison(turn_of(world, {"position": {"back_s": world.t - 30.0}})) is Why.RESET
    assert poison(turn_of(world, {"position": {"back_s": world.t - 61.0}})) is None


def test_an_old_position_is_no_second_of_its_own():
    world = under_way()
    ctx = turn_of(world, vehicle_age_s=2.0)
    learn_boat(ctx)
    assert ctx.state.afloat.looks == ()


def test_plans_are_of_the_boat_that_was_learned_once_it_is_used():
    world = under_way()
    was = turn_of(world)
    ctx = turn_of(world, knowing(world))
    assert ctx.boat_of_file == world.skipper.voyage.boat == was.voyage.boat
    assert ctx.voyage.boat == as_learned(ctx.boat_of_file, SLOW)
    problems = []
    for turn in (was, ctx):
        assert request(turn, ReplanReason.ORDER)
        problems.append(next(a.problem for a in turn.actions if isinstance(a, RequestPlan)))
    before, after = (p.boat for p in problems)
    assert after.tack_loss_s == 6.0
    assert after.no_go_half_rad == pytest.approx(max(before.no_go_half_rad, math.radians(48.0)))
    fast, slow = (b.speed_mps(math.radians(90.0)) for b in (before, after))
    assert slow == pytest.approx(math.exp(-0.3) * fast, rel=0.01)


@pytest.mark.parametrize("more", [{"is_used": False}, {"of": 1}])
def test_not_before_it_is_used_and_not_of_another_file(more):
    world = under_way()
    assert turn_of(world, knowing(world, **more)).voyage.boat == world.skipper.voyage.boat


def test_in_shadow_plans_are_of_her_file_and_off_nothing_is_looked_at():
    world = under_way(learn=Learning.SHADOW)
    assert world.state.afloat.looks
    assert turn_of(world, knowing(world)).voyage.boat == world.skipper.voyage.boat
    world = under_way(learn=Learning.OFF)
    assert world.state.afloat == Afloat()
    assert turn_of(world, knowing(world)).voyage.boat == world.skipper.voyage.boat


def test_a_shoal_that_is_found_leaves_the_learned_boat():
    world = under_way()
    ctx = turn_of(world, knowing(world))
    ctx.learn_shoals((Shoal(en_m=(500.0, 200.0), radius_m=20.0, doubt_m=5.0, depth_m=1.0),))
    assert ctx.voyage.boat == as_learned(world.skipper.voyage.boat, SLOW)


@pytest.mark.parametrize("mode", [Learning.USE, Learning.SHADOW])
def test_it_is_said_when_it_is_used_and_when_no_more(monkeypatch, mode):
    world = under_way(learn=mode)
    used = replace(known_of(world), file_error=100.0, own_error=40.0)
    for then, words in (
        (used, ("60 % less wrong", "74 % at 90°", "as she sails" if mode is Learning.USE else "shadow")),
        (replace(used, is_used=False), ("plans are of her file",)),
    ):
        now = Afloat.of(replace(then, is_used=not then.is_used))
        monkeypatch.setattr(boat_learning, "followed", lambda *_, then=then: Afloat.of(then))
        ctx = turn_of(world, {"afloat": now})
        learn_boat(ctx)
        [said] = [a.text for a in ctx.actions if getattr(a, "code", "") == CODE]
        assert all(word in said for word in words)


@pytest.mark.parametrize(
    ("name", "is_void"), [("WNDVN_DIR_OFS", True), ("SAIL_ANGLE_MAX", True), ("FENCE_RADIUS", False)]
)
def test_a_parameter_that_changes_how_she_sails_or_what_is_told_of_it_voids_what_was_learned(name, is_void):
    world = under_way()
    ctx = turn_of(world, knowing(world), events=(ParameterChanged(name=name, text="was set"),))
    learn_boat(ctx)
    assert ctx.state.afloat.known.is_used is not is_void
    assert ctx.state.afloat.saved == ctx.state.afloat.known
    assert (ctx.state.afloat.known.told == Told()) is is_void


def ordered(world, words):
    world.order(words)
    world.run(2)
    return [a for _, a in world.actions if isinstance(a, act.Acknowledge)][-1]


def test_it_is_frozen_by_order_and_stays_so_over_a_restart():
    world = under_way()
    assert ordered(world, "freeze").result is Result.DONE
    looks = world.state.afloat.looks
    world.run(10)
    assert world.state.afloat.looks == looks
    saved = world.skipper.persisted(world.state)
    assert saved.afloat.is_frozen
    assert Persisted.from_dict(saved.to_dict()).afloat == saved.afloat
    assert restarted(world).state.afloat.known.is_frozen
    assert ordered(world, "learn").result is Result.DONE
    assert not world.skipper.persisted(world.state).afloat.is_frozen


def test_frozen_plans_stay_as_they_are():
    world = under_way()
    world.state = replace(world.state, **knowing(world))
    assert "as she was found to sail" in ordered(world, "freeze").text
    assert turn_of(world).voyage.boat == as_learned(world.skipper.voyage.boat, SLOW)


def test_an_order_that_is_not_permitted_or_has_nothing_to_freeze_is_refused():
    assert ordered(under_way(learn=Learning.OFF), "freeze").result is Result.REFUSED
    world = under_way()
    world.permissions = Permissions(may_upload=True, may_set_mode=True, may_arm=True, orders=("hold",))
    assert ordered(world, "freeze").result is Result.REFUSED
    assert not world.state.afloat.known.is_frozen


def test_what_is_known_survives_a_restart_and_is_used_at_once():
    world = under_way()
    world.state = replace(world.state, **knowing(world))
    restarted(world)
    assert world.state.afloat.known == known_of(world)
    assert turn_of(world).voyage.boat == as_learned(world.skipper.voyage.boat, SLOW)
    data = world.skipper.persisted(world.state).to_dict()
    assert Persisted.from_dict({k: v for k, v in data.items() if k != "afloat"}).afloat == LearnedAfloat()
    with pytest.raises(ValueError, match="damaged"):
        Persisted.from_dict(data | {"afloat": {"x": 3}})


def test_over_a_long_reach_a_slow_boat_is_learned_and_nothing_is_planned_otherwise_before_an_hour():
    def sailed(learn):
        made = voyage(Goal(en_m=(14_000.0, 0.0)))
        made = replace(made, boat=replace(made.boat, speed_error=0.3))
        world = World(skipper(made, learn=learn, plan_age_s=600.0), share=0.75, expansions=200)
        world.wind = lambda t: (0.1 * math.sin(t / 60.0), 5.0 + 0.3 * math.sin(t / 37.0))
        used_s = None
        while world.t < (5400.0 if learn is Learning.USE else 3600.0):
            world.step()
            if used_s is None and world.state.afloat.known.is_used:
                used_s = world.t
        return world, used_s

    world, used_s = sailed(Learning.USE)
    assert 3600.0 < used_s < 5400.0
    assert any(code == CODE for _, code, *_ in world.log)
    plain, _ = sailed(Learning.OFF)

    def plans(of, until_s):
        return [(t, repr(a.problem)) for t, a in of.actions if isinstance(a, RequestPlan) and t < until_s]

    assert len(plans(world, 3600.0)) > 3
    assert plans(world, 3600.0) == plans(plain, 3600.0)
    assert world.track[: len(plain.track)] == plain.track
    later = turn_of(world).voyage.boat.polar.speed_mps(math.radians(90.0), 5.0)
    assert later == pytest.approx(0.75 * world.skipper.voyage.boat.polar.speed_mps(math.radians(90.0), 5.0), rel=0.08)

"""The lookout: alarms are said when they rise, with rule and role; the mission's safe distance and time count."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from companion.compose import config_of
from companion.geofence import load_mission
from companion.messages import Severity
from companion.skipper.step import actions as act
from companion.skipper.step.context import StepContext
from companion.skipper.watch.watch import SHOWN, limits, look_out
from companion.traffic import LAKE, Alarm, Policy, Role, Rule, TrafficPicture
from tests.skipper.planning.test_traffic import Ship, make, sail
from tests.traffic.conftest import vessel


def turn_among(*vessels, world=None):
    if world is None:
        world = make()
        world.run(60)
    world.extra = {"traffic": TrafficPicture(t_s=world.t, vessels=vessels)}
    return StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())


def coming(ctx, *, away_m, speed_mps=5.0, **more):
    """A motor ship that comes straight at us from ahead, ``away_m`` away."""
    here = ctx.boat_en
    values = {"t_s": ctx.t_s, "heard_s": ctx.t_s, "ship_type": 70, "nav_status": 0}
    return vessel((here[0] + away_m, here[1]), 270.0, speed_mps, size=(10.0, 10.0, 3.0, 3.0), **(values | more))


def said(ctx):
    return [a for a in ctx.actions if isinstance(a, act.Announce)]


def test_the_default_limits_are_a_lakes():
    config = make().skipper.config
    assert limits(config) == LAKE
    assert limits(replace(config, traffic_clearance_m=100.0, traffic_time_s=300.0)).warn_tcpa_s == 300.0


def test_the_missions_safe_distance_and_time_are_the_limits(tmp_path):
    text = Path("sitl/missions/fairway.toml").read_text(encoding="utf-8")
    text = text.replace("safe_distance_m = 50.0", "safe_distance_m = 80.0\nsafe_time_s = 200.0")
    (tmp_path / "m.toml").write_text(text)
    found = limits(config_of(load_mission(tmp_path / "m.toml")))
    assert (found.warn_cpa_m, found.warn_tcpa_s) == (80.0, 200.0)


@pytest.mark.parametrize(
    ("away_m", "alarm", "severity"),
    [
        (1500.0, Alarm.NONE, None),
        (500.0, Alarm.WARN, Severity.WARNING),
        (200.0, Alarm.ACT, Severity.CRITICAL),
        (0.0, Alarm.TOUCH, Severity.CRITICAL),
    ],
)
def test_an_alarm_needs_both_limits_and_is_said_with_the_rule(away_m, alarm, severity):
    ctx = turn_among()
    ctx = turn_among(coming(ctx, away_m=away_m))
    look_out(ctx)
    assert ctx.state.traffic.watch[0].alarm is alarm
    assert [a.severity for a in said(ctx)] == ([] if severity is None else [severity])
    for announced in said(ctx):
        assert announced.code == "vessel near"
        assert alarm.name.lower() in announced.text
        assert "rule" in announced.text


@pytest.mark.parametrize(("policy", "role"), [(Policy.RULES, Role.STAND_ON), (Policy.KEEP_CLEAR, Role.KEEP_CLEAR)])
def test_power_gives_way_to_sail_and_what_she_does_is_shown(policy, role):
    ctx = turn_among()
    ctx = turn_among(coming(ctx, away_m=300.0))
    ctx.config = replace(ctx.config, traffic_policy=policy)
    look_out(ctx)
    encounter = ctx.state.traffic.watch[0].encounter
    assert (encounter.rule, encounter.role) == (Rule.RESPONSIBILITIES, role)


@pytest.mark.parametrize(
    ("off_m", "lain_s", "is_said"), [(30.0, 200.0, True), (30.0, 60.0, True), (70.0, 200.0, False)]
)
def test_a_vessel_that_lies_where_the_goal_is_is_said(off_m, lain_s, is_said):
    ctx = turn_among()
    east, north = ctx.gate.en_m
    yacht = coming(ctx, away_m=0.0, speed_mps=0.0, nav_status=None, lain_s=lain_s)
    ctx = turn_among(replace(yacht, antenna_en_m=(east + off_m, north)))
    look_out(ctx)
    told = [a.text for a in said(ctx) if "it is not reached while she lies there" in a.text]
    assert bool(told) is is_said


def test_a_vessel_has_one_line_in_half_a_minute_whatever_its_alarm_does():
    world = make()
    world.run(60)
    heard = []
    for k in range(70):
        ctx = turn_among(world=world)
        ctx = turn_among(coming(ctx, away_m=(500.0, 200.0, 1500.0)[k % 3]), world=world)
        look_out(ctx)
        world.state = ctx.state
        heard += [world.t for _ in said(ctx)]
        world.t += 1.0
    assert len(heard) == 3
    assert all(b - a >= 30.0 for a, b in pairwise(heard))


def test_among_many_one_line_comes_a_step_and_the_worst_first():
    world = make()
    world.run(60)
    heard = []
    for _ in range(60):
        ctx = turn_among(world=world)
        ctx = turn_among(*(coming(ctx, away_m=150.0 + 20.0 * i, mmsi=300 + i) for i in range(30)), world=world)
        look_out(ctx)
        world.state = ctx.state
        assert len(said(ctx)) <= 1
        heard += [(world.t, int(a.text[:3])) for a in said(ctx)]
        world.t += 1.0
    assert [mmsi for _, mmsi in heard[:SHOWN]] == list(range(300, 300 + SHOWN))
    for mmsi in {m for _, m in heard}:
        times = [t for t, m in heard if m == mmsi]
        assert all(b - a >= 30.0 for a, b in pairwise(times))
    assert len(heard) == 2 * SHOWN


def test_only_the_worst_are_kept_and_nobody_when_all_have_gone():
    ctx = turn_among()
    crowd = [coming(ctx, away_m=400.0 + 50.0 * i, mmsi=300 + i) for i in range(20)]
    ctx = turn_among(*crowd)
    look_out(ctx)
    assert len(ctx.state.traffic.watch) == SHOWN
    assert ctx.state.traffic.watch[0].vessel.mmsi == 300
    gone = turn_among()
    gone.set(traffic=ctx.state.traffic)
    look_out(gone)
    assert gone.state.traffic.watch == ()


@pytest.mark.parametrize("meets_s", [220.0, 230.0])
def test_crossing_ahead_costs_more_than_crossing_astern(meets_s):
    """The discs reach ahead of a ship: it is let pass where the shorter way, without that, would be before its bow."""
    ship = Ship((450.0, meets_s * 4.0), 180.0, 4.0)
    world, crossed = make(), []
    step = world.step

    def watched():
        before = world.position[0]
        step()
        if before < 450.0 <= world.position[0]:
            crossed.append(ship.at(world.t)[1] - world.position[1])  # it sails south: below 0 it has gone by

    world.step = watched
    sail(world, ship)
    assert crossed
    assert crossed[0] < 0.0

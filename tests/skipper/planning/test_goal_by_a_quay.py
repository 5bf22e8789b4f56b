"""A goal nearer to a quay than a margin keeps clear: aimed at the place inside its radius that keeps it."""

import math
from dataclasses import replace

import pytest
from shapely import box

from companion.messages import Severity
from companion.skipper.planning import asking
from companion.skipper.planning.ladder import Rung
from companion.skipper.planning.not_found import not_found
from companion.skipper.planning.statement import Start
from companion.skipper.planning.track import steps
from companion.skipper.step import Announce, ReplanReason
from companion.skipper.way.gates import gates_of
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.moments import asked_for, moment, route

QUAY = box(-300.0, 208.0, 300.0, 230.0)
MOLE = box(-300.0, 208.0, 300.0, 209.0)
LAND = box(-300.0, 100.0, 300.0, 195.0)
START = Start(en_m=(0.0, 0.0), heading_rad=0.0)


def aimed(goal, margin_m, *solids):
    """Return the context, the gate and the aim of a plan to ``goal`` past ``solids`` (a quay), the margin kept."""
    ctx = moment(goals=(goal,), obstacles=solids or (QUAY,))
    (target,) = gates_of(ctx.voyage)[:1]
    step = Rung(name="", margin_m=margin_m, delta_s=0.95)
    return ctx, target, asking._aim(ctx, target, 0, START, step)


@pytest.mark.parametrize(("radius_m", "margin_m"), [(15.0, 12.0), (15.0, 10.0), (10.0, 12.0), (5.0, 10.0)])
def test_it_is_aimed_at_where_the_margin_is_kept(radius_m, margin_m):
    """8 m from the quay it was refused by every step of the ladder, whatever the radius."""
    ctx, target, aim = aimed(Goal(en_m=(0.0, 200.0), radius_m=radius_m), margin_m)
    assert aim.gate == 0
    assert float(ctx.voyage.area.spare_m([aim.en_m], margin_m)[0]) >= 0.0
    assert math.dist(aim.en_m, target.en_m) + aim.radius_m < radius_m == target.radius_m
    assert aim.en_m[1] == pytest.approx(200.0 + 8.0 - margin_m * 1.0454 - 0.2, abs=0.3)


def test_beyond_a_mole_it_is_not_aimed_at():
    """The water on this side is 13 m wide, and beyond there is all the room inside the radius."""
    _, target, aim = aimed(Goal(en_m=(0.0, 200.0), radius_m=60.0), 12.0, MOLE, LAND)
    assert aim.en_m == target.en_m


@pytest.mark.parametrize(
    ("goal", "margin_m"),
    [
        (Goal(en_m=(0.0, 190.0), radius_m=15.0), 15.0),
        (Goal(en_m=(0.0, 200.0), radius_m=3.0), 12.0),
        (Goal(en_m=(0.0, 200.0), radius_m=15.0, side=Side.PORT, rounding_m=2.0), 12.0),
    ],
)
def test_another_aim_is_not_touched(goal, margin_m):
    """With room, without any inside the radius, and that of a buoy's circle."""
    _, target, aim = aimed(goal, margin_m)
    assert aim.en_m == target.en_m
    assert aim.gate == 0


@pytest.mark.parametrize(("north_m", "is_said"), [(200.0, True), (150.0, False)])
def test_when_the_ladder_finds_no_way_to_it_that_is_said_once(north_m, is_said):
    """She waited for ever, "trying again in 290 s", and neither status nor log named skip_goal."""
    goal = Goal(en_m=(0.0, north_m), radius_m=3.0, name="quay")
    ctx = moment(goals=(goal,), obstacles=[QUAY], tws_mps=9.0)
    last = next(n for n, step in enumerate(steps(ctx)) if step.nearer_goal)
    asked = replace(asked_for(route((0.0, 0.0))), rung=last - 1, reason=ReplanReason.START)
    for _ in range(2):
        not_found(ctx, asked, "none")
    told = [a for a in ctx.actions if isinstance(a, Announce) and "skip_goal" in a.text]
    assert [a.severity for a in told] == [Severity.WARNING] * is_said
    assert all("quay cannot be reached from here in this wind, 9 m/s: it lies 8.0 m from" in a.text for a in told)
    assert bool(asking.out_of_reach(ctx, ctx.gate)) is is_said

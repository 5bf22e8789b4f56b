"""A nearer place than the goal, where no way leads to that: roomy, and clear of buoys."""

import math

import pytest

from companion.skipper.planning import asking
from companion.skipper.planning.ladder import Rung
from companion.skipper.planning.statement import Start
from companion.skipper.way.gates import gates_of, marks_of
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.moments import moment, route


@pytest.mark.parametrize("north_m", [150.0, 160.0, 400.0])
def test_it_is_not_at_a_buoy(north_m):
    goals = (
        Goal(en_m=(0.0, north_m), radius_m=10.0, side=Side.PORT, rounding_m=12.0),
        Goal(en_m=(0.0, 200.0), radius_m=8.0, name="behind"),
    )
    ctx = moment(route((0.0, 200.0), (0.0, 200.0)), goals=goals)
    ((mark, keep_m, _),) = marks_of(ctx.voyage)
    target = gates_of(ctx.voyage)[-1]
    step = Rung(name="a nearer safe place", margin_m=8.0, delta_s=0.66, nearer_goal=True)
    aim = asking._aim(ctx, target, 1, Start(en_m=(0.0, 0.0), heading_rad=0.0), step)
    assert aim.gate == -1
    assert math.dist(aim.en_m, mark) >= ctx.config.loiter_radius_m + keep_m
    assert (aim.en_m == pytest.approx((0.0, 150.0))) is (north_m == 400.0)

"""A vane that is turned: put right by WNDVN_DIR_OFS where that is permitted, said where it is not, and only in need."""

import math
from dataclasses import fields, replace
from itertools import pairwise

import pytest

from companion.current import VaneError
from companion.geo.angles import wrap_pi
from companion.messages import Mode
from companion.skipper.behaviors.vane_trim import AGAIN_S, MOST_TRIMS, STUCK_S
from companion.skipper.behaviors.wind_doubt import doubted_wind
from companion.skipper.step import actions as act
from companion.skipper.step.config import Permissions
from companion.skipper.step.context import permitted
from companion.skipper.step.state import Phase
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.test_voyage import make, said

WAY = route((300.0, 0.0), (600.0, 0.0))
WHY = "she makes 0.9 m/s astern where 2.5 m/s were to be expected"
TURNED = VaneError(off_rad=math.radians(40.0), sigma_rad=math.radians(10.0), is_sure=True)


def stuck(*, permitted=True, vane=TURNED, offset_deg=5.0, unsure=WHY):
    """Return a world of a boat under way whose wind is doubted and whose vane is told to be turned."""
    world = make()
    assert world.run(120, lambda w: w.state.phase is Phase.STANDARD and w.t > 40.0)
    world.permissions = replace(world.permissions, may_trim_vane=permitted)
    world.extra |= {
        "unsure": unsure,
        "vane": vane,
        "vane_offset_rad": None if offset_deg is None else math.radians(offset_deg),
    }
    return world


def written(world):
    return [(at_s, a) for at_s, a in world.actions if isinstance(a, act.SetParameter)]


def test_it_is_turned_back_by_what_it_is_surely_wrong_by():
    world = stuck()
    begins = world.t
    world.run(STUCK_S + 5.0)
    [(at_s, action)] = written(world)
    assert at_s >= begins + STUCK_S
    assert (action.name, action.value) == ("WNDVN_DIR_OFS", -25.0)  # from 5, and 40 less 10
    assert "40±10° too far clockwise: WNDVN_DIR_OFS from 5 to -25" in said(world, "vane")[0][2]


def test_an_offset_beyond_half_a_turn_comes_round():
    world = stuck(
        vane=VaneError(off_rad=math.radians(-170.0), sigma_rad=math.radians(20.0), is_sure=True), offset_deg=90
    )
    world.run(STUCK_S + 5.0)
    assert written(world)[0][1].value == -120.0


def test_what_is_not_permitted_is_said_with_its_remedy_and_not_done():
    world = stuck(permitted=False)
    world.run(200)
    assert not written(world)
    words = [text for _, _, text in said(world, "vane")]
    assert 3 <= len(words) <= 4, "once a minute"
    assert "set WNDVN_DIR_OFS to -25, it is 5 ([operator] trim_vane)" in words[0]


def test_an_autopilot_that_does_not_tell_its_offset_is_not_written_to():
    world = stuck(offset_deg=None)
    world.run(60)
    assert not written(world)
    assert "turn it back on its mast" in said(world, "vane")[0][2]


@pytest.mark.parametrize(
    "vane",
    [
        None,
        replace(TURNED, is_sure=False),
        VaneError(off_rad=math.radians(14.0), sigma_rad=math.radians(8.0), is_sure=True),  # perhaps by six
    ],
)
def test_nothing_is_written_by_a_vane_that_may_be_right(vane):
    world = stuck(vane=vane)
    world.run(120)
    assert not written(world)
    assert not said(world, "vane")


def test_a_boat_that_sails_is_left_alone():
    world = stuck(unsure="")
    world.run(120)
    assert not written(world)


@pytest.mark.parametrize("was_right", [True, False])
def test_one_that_lies_dead_without_any_doubt_is_not_where_she_has_sailed_by_it(was_right):
    """By a current that was learned for it she went astern in AUTO for 7 minutes; a head sea stops her by any vane."""
    world = stuck(unsure="", vane=replace(TURNED, was_right=was_right))
    world.drift_mps, world.current = 0.0, lambda t: (-2.5 * math.sin(world.heading), -2.5 * math.cos(world.heading))
    world.run(60)
    assert bool(written(world)) == was_right


def test_what_did_not_help_is_tried_six_times_and_taken_back():
    assert MOST_TRIMS == 6
    world = stuck()
    world.run((MOST_TRIMS + 3) * (AGAIN_S + 5.0))
    values, times = [a.value for _, a in written(world)], [at_s for at_s, _ in written(world)]
    assert len(values) == MOST_TRIMS + 1
    assert values[-1] == 5.0, "as it was found"
    assert all(b - a >= AGAIN_S for a, b in pairwise(times))
    assert "put back" in said(world, "vane")[-1][2]
    assert world.mode is Mode.LOITER


@pytest.mark.parametrize("is_sure", [True, False])
def test_what_is_left_of_an_error_that_was_written_is_written_too_though_she_makes_way(is_sure):
    """Fitted back to front, the vane was still wrong by twenty degrees when she began to sail: she made 0.3 m/s."""
    world = stuck()
    world.run(STUCK_S + 5.0)
    world.extra |= {"unsure": "", "vane": replace(TURNED, is_sure=is_sure), "vane_offset_rad": math.radians(-25.0)}
    world.run(AGAIN_S + STUCK_S + 5.0)
    assert [a.value for _, a in written(world)] == ([-25.0, -55.0] if is_sure else [-25.0])


def test_one_that_helped_leaves_all_tries_to_the_next_fault():
    world = stuck()
    world.run(STUCK_S + 5.0)
    world.extra |= {"unsure": "", "vane": None}
    world.run(700)
    assert world.state.vane.trims == 0


@pytest.mark.parametrize(
    "name", [None, *(field.name for field in fields(Permissions) if field.name.startswith("may_"))]
)
def test_a_parameter_is_written_by_the_permission_to_trim_the_vane_and_by_no_other(name):
    action = act.SetParameter(command_id=1, name="WNDVN_DIR_OFS", value=1.0)
    permissions = Permissions(**({} if name is None else {name: True}))
    assert permitted(action, permissions) == (name == "may_trim_vane")


def test_after_it_was_written_the_wind_of_the_plan_on_board_is_not_the_true_one():
    """It was planned by the vane that was turned: sea room was sought from a wind that never blew."""
    ctx = moment(WAY, seen={"wind_before": None})
    turned = replace(ctx.state.mission.route, plan_tws_mps=5.0, plan_twd_from_rad=wrap_pi(ctx.wind_now[0] + 1.5))
    ctx.set(mission=replace(ctx.state.mission, route=turned, uploaded_s=NOW_S - 60.0))
    assert doubted_wind(ctx) is not None
    ctx.set(vane=replace(ctx.state.vane, trimmed_s=NOW_S - 30.0))
    assert doubted_wind(ctx) is None

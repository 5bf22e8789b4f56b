"""A wind that is not to be planned with: she waits in a loiter, and nothing is planned."""

import pytest

from companion.messages import Mode
from companion.skipper.step import ParameterChanged, Permissions
from companion.skipper.step import actions as act
from companion.skipper.step.state import Phase
from tests.skipper.test_voyage import is_done, make, said

WHY = "the wind's direction leapt by +90° and she makes 0.7 m/s astern where 2.2 m/s were to be expected"
SAILS = {Phase.STANDARD, Phase.DESTINATION_APPROACH}


def under_way(**made):
    world = make(**made)
    assert world.run(120, lambda w: w.state.phase in SAILS and w.t > 40.0)
    return world


def asked_since(world, t_s, kind):
    return [a for at_s, a in world.actions if at_s >= t_s and isinstance(a, kind)]


def test_she_loiters_while_it_lasts_and_sails_on_by_a_plan_from_where_she_is():
    world = under_way()
    world.extra["unsure"], begins = WHY, world.t
    assert world.run(5, lambda w: w.mode is Mode.LOITER)
    world.run(120)
    assert world.mode is Mode.LOITER
    assert world.state.phase is Phase.HOLDING
    assert WHY in world.state.why
    assert not asked_since(world, begins, act.RequestPlan), "neither a plan nor a step of the ladder"
    assert said(world, "wind contradicted")
    assert 2 <= len(said(world, "held")) <= 3, "once a minute"
    world.extra["unsure"], ends = "", world.t
    assert world.run(60, lambda w: w.mode is Mode.AUTO)
    assert asked_since(world, ends, act.RequestPlan)[0].from_seq is None
    assert world.run(1500, is_done)


def test_a_plan_that_is_being_made_is_called_off_and_no_rung_follows_it():
    world = under_way(plan_s=5.0)
    assert world.run(300, lambda w: w.state.pending.plan is not None)
    number = world.state.pending.plan.request_id
    world.extra["unsure"], begins = WHY, world.t
    world.run(20)
    assert [a.request_id for a in asked_since(world, begins, act.CancelPlan)] == [number]
    assert world.state.pending.plan is None
    assert not asked_since(world, begins, act.RequestPlan)


def test_without_the_permission_to_set_modes_it_is_said_and_nothing_is_planned():
    world = under_way()
    world.permissions = Permissions(may_upload=True)
    world.extra["unsure"], begins = WHY, world.t
    world.run(60)
    assert world.mode is Mode.AUTO
    assert not asked_since(world, begins, act.SetMode)
    assert not asked_since(world, begins, act.RequestPlan)
    assert said(world, "held")


def test_a_wind_that_is_contradicted_stems_no_drift_and_the_anchor_is_called_for():
    """What she could sail against the drift is reckoned from the wind that is not believed."""
    world = under_way()
    world.extra["unsure"] = WHY
    world.drift_mps, world.current = 0.0, lambda t: (0.0, 0.8)
    assert world.run(400, lambda w: bool(said(w, "anchor")))
    assert not any(text.endswith(": loiter") for _, _, text in said(world, "drift"))


@pytest.mark.parametrize("name", ["WNDVN_DIR_OFS", "SERVO1_REVERSED"])
def test_a_parameter_that_somebody_set_is_said(name):
    world = under_way()
    world.events.append(ParameterChanged(name=name, text=f"{name} was set from 0 to 1"))
    world.run(2)
    assert said(world, "parameter")[0][2] == f"{name} was set from 0 to 1"

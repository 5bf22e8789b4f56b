"""How long plans take on this computer: what is kept of it, what follows, and what does not on a fast one."""

import math
import re
from dataclasses import replace

import pytest

from companion.planner import plan
from companion.skipper.step import actions as act
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.latency import KEPT, NO_ANSWERS
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import saved_of
from tests.skipper.test_voyage import is_done, make, said


def after(*answers_s, budget_s=1.0, speed=None):
    latency = NO_ANSWERS
    for took_s in answers_s:
        latency = latency.with_answer(took_s, budget_s, speed)
    return latency


def test_nothing_follows_from_answers_in_time_nor_from_a_single_late_one():
    for latency in (NO_ANSWERS, after(1.0, 2.0, 1.4), after(*[1.0] * 9, 20.0), after(2.9, budget_s=2.0)):
        assert (latency.late_s, latency.usually_late_s, latency.is_slow) == (0.0, 0.0, False)
        assert latency.patience_s(20.0) == 20.0


def test_late_answers_are_asked_for_earlier_and_waited_for_longer():
    latency = after(*[5.0] * 3, *[9.0] * 8)
    assert latency.median_s == latency.p90_s == 9.0
    assert latency.late_s == 7.0
    assert latency.patience_s(20.0) == 27.0
    assert latency.is_slow
    assert after(*[900.0] * KEPT).patience_s(20.0) == 120.0
    assert after(*[900.0] * KEPT).late_s == 60.0
    assert len(after(*range(50)).answers_s) == KEPT


def test_a_slow_processor_is_called_so_though_its_answers_are_in_time():
    assert after(1.0, speed=0.1).is_slow
    assert not after(1.0, speed=0.6).is_slow
    assert "10 % of the reference core" in after(1.0, speed=0.1).words


def test_what_is_told_of_few_answers_leaves_none_out_and_what_follows_does():
    latency = after(3.0, 2.0)
    assert latency.words == "answers in 2.0 s (nine of ten within 3.0 s)"
    assert (latency.median_s, latency.p90_s) == (2.0, 2.0)
    assert after(*[1.0] * 9, 20.0).words == "answers in 1.0 s (nine of ten within 1.0 s)"
    assert after(*[1.0] * 8, 20.0).said_p90_s == 20.0
    assert (NO_ANSWERS.words, NO_ANSWERS.said_p90_s) == ("", None)


def test_it_survives_a_kill():
    latency = after(4.0, 6.0, budget_s=2.0, speed=0.12)
    saved = Persisted(voyage="v", gate=0, sailing=True, route=None, pending=None, latency=latency)
    assert Persisted.from_dict(saved.to_dict()).latency == latency
    without = saved.to_dict()
    del without["latency"]  # as it was saved before
    assert Persisted.from_dict(without).latency == NO_ANSWERS
    for damaged in ([], [["x"], 2.0, None], [[math.nan], 2.0, None], 3):
        with pytest.raises(ValueError, match=r"damaged|not"):
            Persisted.from_dict(saved.to_dict() | {"latency": damaged})


def sailed(plan_s):
    """Beat to a mark, each plan taking so long; return the world and how long before waypoints plans were asked [s]."""
    world = make(plan_s=plan_s)
    assert world.run(1500, is_done)
    asked = [a.text for _, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is ReplanReason.WAYPOINT]
    return world, [int(re.search(r"in (\d+) s", text)[1]) for text in asked]


def test_where_plans_are_late_they_are_asked_for_earlier_it_is_said_once_and_remembered():
    fast, lead_s = sailed(plan_s=1.0)
    assert max(lead_s) <= 12
    assert not said(fast, "slow computer")
    slow, lead_s = sailed(plan_s=7.0)
    assert max(lead_s) > 12
    assert len(said(slow, "slow computer")) == 1
    assert slow.clearance() > 0.0
    assert slow.state.plans.latency.p90_s >= 7.0
    again = slow.skipper.initial(saved_of(slow.state, slow.skipper.voyage.name))
    assert again.plans.latency == slow.state.plans.latency


def test_what_the_first_plan_was_given_beyond_what_was_asked_is_not_late():
    """On a quarter of a core it is given 4 s in place of 2: every later plan was then asked for a second earlier."""

    def planned(problem, seed):
        return replace(plan(problem, expansions=4_000, seed=seed), elapsed_s=4.5, speed=0.2)

    world = make(plan_s=5.0, planner=planned)
    world.run(200, lambda w: w.state.plans.latency.answers_s != ())
    assert world.state.plans.latency.answers_s == (2.5,)

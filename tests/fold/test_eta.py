"""Where the boat will be and when it is there: what is told held against what came."""

import math
import statistics
from dataclasses import replace
from pathlib import Path

import pytest

from companion import eta as companion_eta
from companion.boat import AutopilotLimits, Boat, ardurover_sitl
from companion.clock import run_virtual
from companion.eta import PRIOR_PACE, TRIED_S, PaceTrial, _Walker
from companion.messages import Command, Mode
from companion.orders import Verb
from companion.skipper.step import Announce, Phase
from companion.skipper.step.state import Raised, Standing
from companion.telemetry.status import goal_distance_m
from sitl.run.embedded import run_embedded
from sitl.scenario import load_scenario
from tests.skipper.world import with_parts

DEMO = Path("sitl/scenarios/demo.toml")


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """The demonstration's steps, and when its goal was reached."""
    steps = []
    run_virtual(
        run_embedded(
            load_scenario(DEMO),
            DEMO,
            0,
            tmp_path_factory.mktemp("demo") / "voyage",
            on_status=lambda _, step: steps.append(step),
        )
    )
    return steps, next(step.snapshot.t_s for step in steps if step.state.progress.reached)


def told(demo):
    """Yield a step, what it tells and how long it took from there [s]."""
    steps, reached_s = demo
    for step in steps:
        eta, left_s = step.eta(), reached_s - step.snapshot.t_s
        if eta.there_s is not None and left_s > 0.0:
            yield step, eta, left_s


def test_the_time_that_is_told_in_the_demo_comes(demo):
    """It said "there in 131 s (90 %: 148 s)" 15 s before the mark."""
    last = [eta.there_s - left_s for _, eta, left_s in told(demo) if left_s <= 60.0]
    assert len(last) > 50
    assert abs(statistics.median(last)) <= 10.0
    assert max(map(abs, last)) <= 20.0
    whole = [(eta, left_s) for _, eta, left_s in told(demo)]
    assert len(whole) > 200
    assert abs(statistics.median(eta.there_s - left_s for eta, left_s in whole)) <= 15.0
    assert 0.8 <= statistics.mean(left_s <= eta.there_late_s for eta, left_s in whole) <= 1.0
    assert all(eta.there_late_s > eta.there_s for eta, _ in whole)


def test_a_plan_that_is_kept_has_its_own_time_and_the_new_clock(demo):
    """It had the clock of the plan that was not taken, and the length that it had when it was made itself."""
    kept = 0
    for step in demo[0]:
        for said in step.actions:
            if isinstance(said, Announce) and "the old plan stays" in said.text:
                kept += 1
                assert f"({step.state.mission.route.cost_s:.0f} s;" in said.text
                assert step.state.mission.route.median_s is None or (
                    0.5 < step.state.mission.route.median_s / step.state.mission.route.cost_s < 2.0
                )
    assert kept > 0


def test_a_boat_that_is_not_sailing_the_plan_is_told_nothing(demo):
    step, eta, _ = next(told(demo))
    assert eta.points
    for changed in (
        replace(step, snapshot=replace(step.snapshot, autopilot=replace(step.snapshot.autopilot, mode=Mode.LOITER))),
        replace(step, state=with_parts(step.state, mission={"route": None})),
        replace(step, snapshot=replace(step.snapshot, position_en_m=None)),
    ):
        assert changed.eta().there_s is None
        assert not changed.eta().points


def test_the_time_is_to_the_goal_that_is_next_where_the_mission_leads_on_behind_it(demo):
    step, eta, _ = next(told(demo))
    route = step.state.mission.route
    on = replace(route, bound_for="home")
    assert replace(step, state=with_parts(step.state, mission={"route": on})).eta().there_s == eta.there_s
    left = replace(on, gate_of=(-1,) * len(on.items))  # a diversion: no goal is on this way
    aside = replace(step, state=with_parts(step.state, mission={"route": left}))
    assert aside.eta().there_s != eta.there_s
    assert goal_distance_m(aside, aside.voyage) is None
    assert goal_distance_m(replace(step, state=with_parts(step.state, mission={"route": on})), step.voyage) > 0.0


def test_no_time_is_told_in_a_calm_at_a_halt_or_of_a_goal_that_is_left(demo):
    """Becalmed, "there in 247 s" stood there for minutes; and on the first line after the order hold."""
    step, eta, _ = next(told(demo))
    assert eta.there_s is not None
    vehicle, wind = step.snapshot.vehicle, step.snapshot.wind
    calm = replace(wind, present_tws_mps=0.3)
    adrift = replace(vehicle, velocity_en_mps=(0.3, 0.2))
    hold = Standing(verb=Verb.HOLD, by="somebody ashore", name="", en_m=None, since_s=step.snapshot.t_s)
    silent = {
        "becalmed": replace(
            step, state=with_parts(step.state, alarms={"raised": (Raised(name="becalmed", since_s=0.0),)})
        ),
        "no wind, and slow": replace(step, snapshot=replace(step.snapshot, wind=calm, vehicle=adrift)),
        "at a halt": replace(step, pace=paced(0.3)),
        "held": replace(step, state=replace(step.state, phase=Phase.HOLDING)),
        "ordered away": replace(step, state=with_parts(step.state, orders={"standing": hold})),
    }
    assert {name: changed.eta().there_s for name, changed in silent.items()} == dict.fromkeys(silent)
    assert all(changed.eta().points for changed in silent.values())
    for sails in (
        replace(step, snapshot=replace(step.snapshot, wind=calm, vehicle=replace(vehicle, velocity_en_mps=(0.9, 0.0)))),
        replace(step, snapshot=replace(step.snapshot, vehicle=adrift)),  # in a tack
        replace(step, pace=paced(0.6)),
        replace(step, pace=paced(0.3, seconds=50.0)),  # not for long
    ):
        assert sails.eta().there_s is not None


def paced(share, *, seconds=300.0):
    """Return the pace of a boat that has made ``share`` of its polar's speed for a time."""
    pace, t_s, left_s = PRIOR_PACE, 0.0, 1000.0
    while t_s < seconds:
        if pace.is_due(t_s, 1):
            pace = pace.seen(t_s, left_s, PaceTrial(t_s=t_s, plan_id=1, until=0, winds=(), walk_s=left_s))
        t_s, left_s = t_s + 1.0, left_s - share
    return pace


@pytest.mark.parametrize("share", [0.5, 0.8, 1.2])
def test_a_boat_that_is_not_its_polars_is_there_when_it_is(share):
    pace = paced(share)
    assert pace.share == pytest.approx(share, abs=0.1 * abs(1.0 - share) + 0.02)
    assert pace.left_s(100.0) == pytest.approx(100.0 / share, rel=0.1)
    barely = replace(pace, prior=0.0, tries=2.0, took_s=40.0, made_s=40.0 * pace.share)
    assert pace.left_s(100.0) < pace.late_s(100.0, 0.3) < barely.late_s(100.0, 0.3)


def test_within_two_minutes_a_boat_that_is_slower_is_told_so_and_doubted():
    slow, fit = paced(0.8, seconds=120.0), paced(1.0, seconds=120.0)
    assert slow.share == pytest.approx(0.8, abs=0.05)
    assert slow.doubt > 1.4 * fit.doubt
    assert slow.late_s(100.0 * slow.share, 0.3) > fit.late_s(100.0, 0.3) + 5.0  # the same time, and less sure


def test_a_boat_that_has_shown_nothing_is_doubted_and_one_that_keeps_her_pace_is_not():
    assert PRIOR_PACE.late_s(200.0, 0.3) > 270.0
    assert PRIOR_PACE.late_s(200.0, 0.3) - 200.0 > 2.5 * (paced(1.0, seconds=120.0).late_s(200.0, 0.3) - 200.0)
    kept = paced(1.0)
    assert kept.late_s(200.0, 0.3) < 230.0
    assert PRIOR_PACE.late_s(200.0, 0.03) < 245.0  # a boat that was learned
    uneven = replace(PRIOR_PACE, tries=8.0, prior=0.0, took_s=160.0, made_s=160.0, scatter=8.0 * 0.3**2)
    assert uneven.late_s(40.0, 0.3) < 47.5  # what one try loses the next one gains


def test_what_tries_scatter_widens_what_is_told():
    even, uneven = PRIOR_PACE, PRIOR_PACE
    for n in range(8):
        trial = PaceTrial(t_s=0.0, plan_id=1, until=0, winds=(), walk_s=100.0)
        even = replace(even, tried=trial).seen(TRIED_S, 100.0 - TRIED_S, None)
        uneven = replace(uneven, tried=trial).seen(TRIED_S, 100.0 - TRIED_S * (1.4 if n % 2 else 0.6), None)
    assert even.spread < 0.1 < 0.3 < uneven.spread
    assert uneven.share == pytest.approx(1.0, abs=0.1)
    assert uneven.late_s(100.0, 0.3) - 100.0 / uneven.share > 2.0 * (even.late_s(100.0, 0.3) - 100.0)


def test_a_boat_that_turns_keeps_her_way():
    """Each tack stood still for its turn and its loss: 7 s, 40 s too many in a beat of six tacks."""
    boat = Boat(polar=ardurover_sitl(), turn_rate_radps=math.radians(30.0), tack_loss_s=4.0, gybe_loss_s=2.0)
    limits = AutopilotLimits(sail_no_go_angle_rad=math.radians(45.0), sail_xtrack_max_m=0.0)

    def lost(heading_deg, to_deg):
        walker = _Walker(((0.0, 5.0),), (0.0, 0.0), boat, limits, heading_rad=math.radians(heading_deg))
        end = (100.0 * math.sin(math.radians(to_deg)), 100.0 * math.cos(math.radians(to_deg)))
        return walker.steer(0.0, (0.0, 0.0), (0.0, 0.0), end)[1]

    assert lost(-50.0, -120.0) == 0.0  # a turn alone
    assert lost(-50.0, 50.0) == pytest.approx(2.78, abs=0.05)  # the arc is 1.2 s shorter than the corner
    assert lost(-155.0, 155.0) == pytest.approx(1.88, abs=0.05)


def test_a_walk_on_another_plan_or_after_a_pause_tells_nothing():
    first = PaceTrial(t_s=0.0, plan_id=1, until=3, winds=(), walk_s=100.0)
    begun = PRIOR_PACE.seen(0.0, None, first)
    assert begun.is_due(1.0, 2)
    assert not begun.is_due(1.0, 1)
    assert begun.seen(5.0, None, replace(first, plan_id=2)).share == 1.0
    assert begun.seen(2.0 * TRIED_S, 90.0, None).share == 1.0
    assert begun.seen(TRIED_S, 90.0, None).share < 1.0


@pytest.mark.parametrize("is_holding", [True, False])
def test_a_hold_tells_nothing_of_her_pace(demo, is_holding):
    """Ordered to hold 10 s after a walk of 140 s began, she had made all of it: "pace, of the plan's 160 %"."""
    step = next(step for step, *_ in told(demo) if step.pace.tried is not None)
    mission = step.state.mission
    loiter = replace(mission.route.items[mission.index], command=Command.NAV_LOITER_UNLIM)
    items = tuple(loiter if n == mission.index else item for n, item in enumerate(mission.route.items))
    before = replace(step.pace, tried=replace(step.pace.tried, t_s=step.snapshot.t_s - TRIED_S))
    state = with_parts(step.state, mission={"route": replace(mission.route, items=items)})
    state = replace(state, phase=Phase.HOLDING if is_holding else Phase.STANDARD)
    after = companion_eta.paced(before, step.snapshot, state, step.voyage)
    assert (after.tries, after.share, after.tried) == (before.tries, before.share, None)


def test_while_she_gathers_way_nothing_is_learned_of_her_pace(demo):
    """Seconds after setting sail it was 37 % of the plan's, and 11 minutes were told where four followed."""
    trials = list(dict.fromkeys(step.pace.tried for step, *_ in told(demo) if step.pace.tried is not None))
    first = next(n for n, trial in enumerate(trials) if not trial.sets_out)
    assert first > 0
    assert trials[first].t_s - trials[0].t_s >= TRIED_S  # plans that came meanwhile among them
    assert not any(trial.sets_out for trial in trials[first:])
    begun = PRIOR_PACE.seen(0.0, None, replace(trials[0], t_s=0.0, walk_s=100.0))
    assert begun.seen(TRIED_S, 95.0, trials[first]).tries == 0.0
    assert (
        PRIOR_PACE.seen(0.0, None, replace(trials[0], t_s=0.0, sets_out=False)).seen(TRIED_S, 95.0, None).tries == 1.0
    )

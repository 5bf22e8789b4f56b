"""Uncertain vessels under the bound of RRT*'s own tree: nearer than a closed disc allows, never more than promised."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.vessels import SCENES, holds, keep_of, met, problem, ship
from companion.messages import Target
from companion.planner import PlanStatus, Problem, plan
from companion.planner.effort import Effort
from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.parts import Current, RiskLimit, Sigma
from companion.planner.problem.value import resolved, uncertain
from companion.planner.reference import rrtstar_kernels as kernels
from companion.planner.reference.rrtstar import RrtTree, search
from companion.planner.reference.vessels import carried, is_kept, keep_share
from companion.planner.reference.world import world_of
from companion.planner.risk.chance_constraint import path_risk, vessel_risk
from companion.planners import RrtstarSettings
from tests.planner.problem_json import to_dict

EFFORT = 1200


def of(name, **change):
    return problem(SCENES[name], keep_of(), **({"delta_s": 0.9} | change))


def by_tree(p, seed=1, expansions=EFFORT):
    return plan(p, algorithm="rrtstar", expansions=expansions, seed=seed)


def nearest_m(p, legs):
    """How near the legs come to the predicted middle of any vessel."""
    near = math.inf
    for leg in legs:
        for t in np.linspace(leg.start_s, leg.end_s, 400):
            share = (t - leg.start_s) / (leg.end_s - leg.start_s)
            x, y = (a + share * (b - a) for a, b in zip(leg.from_en, leg.to_en, strict=True))
            for target, spread in uncertain(p.targets):
                if target.from_s <= t <= target.until_s:
                    near = min(near, math.hypot(x - spread.x_m - target.vx_mps * t, y - spread.y_m - target.vy_mps * t))
    return near


@pytest.mark.parametrize("name", ["crossing", "overtaking", "turning"])
def test_within_its_bound_it_passes_nearer_than_the_closed_disc_allowed(name):
    p = of(name)
    found = by_tree(p)
    closed = search(resolved(p), Effort(None, EFFORT), 1)
    judged = evaluate(p, closed.waypoints_en)
    assert found.has_path
    assert judged.is_feasible
    assert any("meets target" in reason for reason in evaluate(p, found.waypoints_en).reasons)
    assert nearest_m(p, found.legs) < nearest_m(p, judged.legs)
    assert found.cost_s < judged.time_s
    risk = path_risk(p, found).vessels
    assert 0.0 < risk.worst_instant <= p.vessels_share
    assert holds(risk.total, float(np.mean([met(SCENES[name], found.legs, keep_of(), seed=k) for k in range(4)])))


def test_under_a_limit_on_the_path_it_goes_round_where_that_is_tight():
    loose, tight = (of("crossing", risk=RiskLimit(max_path_risk=limit)) for limit in (0.05, 0.002))
    through, round_ = by_tree(loose), by_tree(tight)
    assert through.risk <= 0.05
    assert through.vessel_risk > 0.002
    assert round_.risk <= 0.002
    assert round_.cost_s > through.cost_s
    assert nearest_m(tight, round_.legs) > nearest_m(loose, through.legs)
    assert evaluate(tight, round_.waypoints_en).is_feasible  # clear of the closed disc, too


def test_with_a_small_part_of_the_promise_it_goes_round():
    loose, tight = of("crossing"), of("crossing", vessels_part=1e-6)
    through, round_ = by_tree(loose), by_tree(tight)
    assert nearest_m(tight, round_.legs) > nearest_m(loose, through.legs)
    assert path_risk(tight, round_).vessels.worst_instant <= 1e-6 < path_risk(loose, through).vessels.worst_instant


@settings(max_examples=8)
@given(
    st.floats(-300.0, 300.0),
    st.floats(120.0, 240.0),
    st.floats(1.0, 6.0),
    st.booleans(),
    st.sampled_from([None, 0.003, 0.02, 0.1]),
    st.floats(1e-4, 0.09),
    st.integers(0, 99),
)
def test_no_path_that_is_returned_is_above_the_bound(off_m, course_deg, speed_mps, has_other, limit, part, seed):
    back_s, course = 225.0, math.radians(course_deg)
    ships = (
        ship(
            (450.0 + off_m - back_s * speed_mps * math.sin(course), -back_s * speed_mps * math.cos(course)),
            course_deg,
            speed_mps,
            20.0,
        ),
        *(SCENES["crossing slowly"] if has_other else ()),
    )
    p = problem(
        ships, keep_of(10.0), 0.9, vessels_part=part, risk=None if limit is None else RiskLimit(max_path_risk=limit)
    )
    found = by_tree(p, seed, 200)
    if not found.has_path:
        assert found.status is not PlanStatus.FOUND
        return
    assert vessel_risk(p, found.legs).worst_instant <= part * (1.0 + 1e-9)
    assert limit is None or path_risk(p, found).total <= limit


@pytest.mark.parametrize("current", [Current(), Current(set_rad=0.7, drift_mps=0.4)])
def test_every_state_carries_what_the_judge_counts_of_its_path(current):
    """In a steady wind nothing but the vessels is risked; also after states were given other parents."""
    p = of("two", risk=RiskLimit(max_path_risk=0.1), current=current)
    p = replace(p, wind=replace(p.wind, sigma=Sigma()))
    free, vessels = carried(p)
    tree = RrtTree(free, world_of(free), 1, RrtstarSettings(), vessels)
    tree.grow(800)
    assert tree.count[kernels.REWIRED] > 0
    some = 0
    for state in range(0, tree.size, 47):
        legs = evaluate(p, tree.path_to(state)).legs
        seen = vessel_risk(p, legs)
        assert tree.node[state, kernels.R] == pytest.approx(seen.computed, rel=1e-3, abs=1e-6)
        assert is_kept(p, legs)
        some += seen.computed > 1e-4
    assert some > 5


def test_a_vessel_stays_a_disc_where_the_boat_is_in_it_or_was_let_out_of_it():
    here = problem((ship((10.0, 0.0), 0.0, 0.5, 5.0),), keep_of())
    assert carried(here) is None
    p = of("crossing")
    assert carried(p) is not None
    let_out = replace(p, targets=tuple(replace(t, radius_m=t.radius_m - 5.0) for t in p.targets))
    assert carried(let_out) is None
    assert carried(replace(p, targets=(Target(x_m=450.0, y_m=0.0, radius_m=30.0),))) is None


def test_certain_discs_stay_closed_beside_uncertain_vessels():
    p = of("crossing")
    rock = Target(x_m=250.0, y_m=0.0, radius_m=60.0)
    found = by_tree(replace(p, targets=(*p.targets, rock)))
    assert found.has_path
    assert evaluate(replace(p, targets=(rock,)), found.waypoints_en).is_feasible


@pytest.mark.parametrize("seed", [1, 2])
def test_a_path_that_is_laid_as_it_can_be_followed_keeps_the_share_too(seed):
    """Leaving a corner out may lead nearer to a vessel: what the path is laid by is held to the share as well."""
    p = of("crossing")
    tracked = Problem.from_json(to_dict(p) | {"tracking": {"floor_m": 1.0, "solids": []}})
    found = by_tree(tracked, seed)
    assert found.has_path
    assert len(found.legs) < len(by_tree(p, seed).legs)
    assert path_risk(tracked, found).vessels.worst_instant <= p.vessels_share + 1e-9


def test_a_path_above_its_share_is_not_handed_out():
    p = of("crossing")
    free, _ = carried(p)
    straight = plan(free, algorithm="rrtstar", expansions=EFFORT, seed=1)
    assert straight.has_path
    kept = keep_share(p, straight)
    assert not kept.has_path
    assert "vessel" in kept.reason

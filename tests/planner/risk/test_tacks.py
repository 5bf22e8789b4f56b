"""Tacks that fail: one near a wall is avoided where that costs little, and is counted where it is not."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat.failed_tack import MOST_FAILURES, RISKY
from companion.planner import Problem, plan
from companion.planner.problem import evaluate
from companion.planner.problem.value import defect_of
from companion.planner.risk.chance_constraint import path_risk
from companion.planner.risk.tacks import TackAtRisk, _Solids, in_words, of_risky, tacks_at_risk
from companion.planner.solve import CONTACT_S, DEARER
from tests.planner.problem_json import to_dict

BOAT = {
    "no_go_half_deg": 45.0,
    "max_twa_deg": 180.0,
    "turn_rate_rad_s": 0.5,
    "tack_loss_s": 3.0,
    "speed": {"model": "constant", "v_mps": 2.0},
}


def channel(fails=0.3, width_m=60.0, length_m=300.0, **extra):
    """Return a beat up a channel: walls on both sides, plans may go up to them."""
    half = 0.5 * width_m
    walls = [
        f"POLYGON (({x} -50, {x + s * 40} -50, {x + s * 40} {length_m + 50}, {x} {length_m + 50}, {x} -50))"
        for x, s in ((-half, -1), (half, 1))
    ]
    return Problem.from_json(
        {
            "start": {"x": 0, "y": 0, "heading_deg": 45},
            "goal": {"x": 0, "y": length_m, "radius": 5},
            "obstacles": walls,
            "fence": None,
            "wind": {"from_deg": 0, "speed_mps": 5, "sigma": {"model": "none"}},
            "boat": BOAT | {"tack_fails": fails},
            "delta_s": 0.9,
            **extra,
        }
    )


def test_without_a_chance_of_failure_a_plan_is_what_it_was():
    never = plan(channel(0.0), expansions=20_000)
    bare = plan(replace(channel(), boat=replace(channel().boat, tack_fails=0.0)), expansions=20_000)
    assert never.waypoints_en.tolist() == bare.waypoints_en.tolist()
    assert never.tack_risk == 0.0
    assert "tack_risk" not in never.to_dict()


def test_a_boat_whose_tacks_fail_tacks_earlier_within_a_tenth_of_the_time():
    careless, careful = plan(channel(0.0), expansions=20_000), plan(channel(), expansions=20_000)
    at_risk = tacks_at_risk(channel(), careless.legs)
    assert any(tack.failures == 1 for tack in at_risk)  # up to the walls, which is the fastest
    assert not any(tack.failures == 1 for tack in tacks_at_risk(channel(), careful.legs))
    assert careless.cost_s <= careful.cost_s <= DEARER * careless.cost_s
    assert careful.tack_risk < path_risk(channel(), careless).of_tacks
    assert evaluate(channel(), careful.waypoints_en).is_feasible
    again = type(careful).from_dict(careful.to_dict())
    assert again.tack_risk == careful.tack_risk > 0.0


def test_a_slower_way_is_taken_where_the_contact_that_it_spares_is_worth_the_time():
    careless = plan(channel(0.0, width_m=16.0, length_m=120.0), expansions=20_000)
    for fails, is_slow in ((0.003, False), (0.2, True)):
        found = plan(channel(fails, width_m=16.0, length_m=120.0), expansions=20_000)
        assert (found.cost_s > DEARER * careless.cost_s) is is_slow
        at_risk = of_risky(tacks_at_risk(channel(fails, width_m=16.0, length_m=120.0), careless.legs))
        assert found.cost_s + CONTACT_S * found.tack_risk <= careless.cost_s + CONTACT_S * at_risk + 0.1


def test_where_nothing_else_is_worth_it_the_risk_is_counted_and_limited():
    narrow = channel(0.003, width_m=16.0, length_m=120.0)
    found = plan(narrow, expansions=20_000)
    assert found.has_path
    assert found.tack_risk > 0.02
    assert found.risk == pytest.approx(min(1.0, found.tack_risk))
    assert found.risk == pytest.approx(min(1.0, sum(leg.risk for leg in found.legs)), abs=1e-6)
    from companion.planner.problem import RiskLimit

    limited = plan(replace(narrow, risk=RiskLimit(max_path_risk=0.01)), expansions=20_000)
    assert not limited.has_path
    assert "risk" in limited.reason


@settings(max_examples=30)
@given(gap=st.floats(0.5, 60.0), chance=st.floats(0.01, 0.6))
def test_a_tack_is_the_riskier_the_nearer_the_wall(gap, chance):
    def to_wall(gap_m):
        wall = shapely.box(40.0 + gap_m, -200.0, 90.0 + gap_m, 200.0).wkt
        p = Problem.from_json(
            {
                "start": {"x": 0, "y": 0, "heading_deg": 45},
                "goal": {"x": 0, "y": 80, "radius": 1},
                "obstacles": [wall],
                "wind": {"from_deg": 0, "speed_mps": 5, "sigma": {"model": "none"}},
                "boat": BOAT | {"tack_fails": chance, "turn_rate_rad_s": 0.02},
                "delta_s": 0.9,
            }
        )
        return tacks_at_risk(p, evaluate(p, [(0, 0), (40, 40), (0, 80)]).legs)

    near, far = to_wall(gap), to_wall(gap + 5.0)
    for tacks in (near, far):
        for tack in tacks:
            assert tack.risk == pytest.approx(chance**tack.failures)
            assert tack.is_risky == (tack.failures == 1 or chance**tack.failures > RISKY)
            assert tack.lack_m > 0.0
    assert sum(t.risk for t in far) <= sum(t.risk for t in near)
    assert bool(near) or gap > 3.0


def test_how_long_she_lies_and_how_she_is_set_is_in_the_room_of_a_tack_on_that_side_alone():
    p = channel(0.3, width_m=90.0)
    p = replace(p, boat=replace(p.boat, turn_rate_radps=0.02))  # no room to gybe: the row goes on to the wall
    legs = evaluate(p, [(0, 0), (40, 40), (0, 80), (-40, 120), (0, 160)]).legs

    def failures(**boat):
        found = {tack.leg: tack.failures for tack in tacks_at_risk(replace(p, boat=replace(p.boat, **boat)), legs)}
        return found[1], found[3]  # to the right on port tack, to the left on starboard

    right, left = failures()
    assert right == left > 2
    longer = failures(irons_s=20.0, lee_mps=(0.3, 0.3))
    assert max(longer) < left
    assert failures(lee_mps=(0.6, 0.0)) == (right, failures(lee_mps=(0.6, 0.6))[1])
    assert failures(lee_mps=(0.6, 0.0))[1] < left


def test_room_to_gybe_ends_the_row_of_failures():
    wide = channel(0.3, width_m=200.0)
    legs = evaluate(wide, [(0, 0), (93, 93), (-12, 198), (0, 300)]).legs
    slow = replace(wide, boat=replace(wide.boat, turn_rate_radps=0.02))  # 100 m of radius: she cannot
    assert [t.failures for t in tacks_at_risk(slow, legs)][:1] == [4]
    quick = replace(wide, boat=replace(wide.boat, turn_rate_radps=3.0))
    assert tacks_at_risk(quick, legs) == ()


def test_tacks_of_a_beat_left_to_the_autopilot_count():
    p = channel(0.3, width_m=50.0, beat={"no_go_half_deg": 45, "corridor_m": 20, "clearance_m": 20, "tack_s": 4})
    judged = evaluate(p, [(0, 0), (0, 300)])
    [tack] = tacks_at_risk(p, judged.legs)
    assert judged.legs[0].is_beat
    assert abs(tack.at_en[0]) == pytest.approx(20.0)
    assert tack.failures > 1
    far = channel(0.3, width_m=400.0, beat={"no_go_half_deg": 45, "corridor_m": 15, "clearance_m": 20, "tack_s": 4})
    assert tacks_at_risk(far, evaluate(far, [(0, 0), (0, 300)]).legs) == ()
    assert math.isclose(path_risk(p, judged.legs).of_tacks, tack.risk)


def test_a_current_that_is_believed_carries_her_while_a_tack_fails_and_nowhere_else():
    way = [(0, 0), (24, 24), (0, 48)]
    still, adrift = channel(), channel(adrift={"set_deg": 90.0, "drift_mps": 0.4})
    legs = evaluate(still, way).legs
    assert evaluate(adrift, way).legs == legs
    [before], [after] = tacks_at_risk(still, legs), tacks_at_risk(adrift, legs)
    assert after.failures < before.failures
    assert after.risk > before.risk
    assert Problem.from_json(to_dict(adrift)).adrift == adrift.adrift
    assert defect_of(channel(adrift={"set_deg": 90.0, "drift_mps": -0.4}))


def about(turn_deg, *, off_deg=0.0, corridor_m=20.0, length_m=300.0, walls=((-40.0, -25.0), (32.0, 60.0)), beat=True):
    """Return a channel with unlike walls, its beat ``off_deg`` from the wind, all of it turned about by one angle."""
    turn = math.radians(turn_deg)

    def turned(x, y):
        return math.cos(turn) * x + math.sin(turn) * y, math.cos(turn) * y - math.sin(turn) * x

    shapes = [
        shapely.Polygon([turned(x, y) for x, y in ((a, -50.0), (b, -50.0), (b, 400.0), (a, 400.0))]) for a, b in walls
    ]
    goal = turned(0.0, length_m)
    p = Problem.from_json(
        {
            "start": {"x": 0, "y": 0, "heading_deg": 45 + turn_deg},
            "goal": {"x": goal[0], "y": goal[1], "radius": 5},
            "obstacles": [shape.wkt for shape in shapes],
            "wind": {"from_deg": turn_deg + off_deg, "speed_mps": 5, "sigma": {"model": "none"}},
            "boat": BOAT | {"tack_fails": 0.05, "lee_mps": [0.2, 0.4]},
            "current": {"set_deg": 60 + turn_deg, "drift_mps": 0.0},
            "delta_s": 0.9,
            "beat": {"no_go_half_deg": 45, "corridor_m": corridor_m, "clearance_m": 5, "tack_s": 4} if beat else None,
        }
    )
    path = [(0.0, 0.0), goal] if beat else [(0.0, 0.0), turned(20.0, 20.0), turned(-15.0, 55.0), turned(0.0, 70.0)]
    return tacks_at_risk(p, evaluate(p, path).legs), turned


@pytest.mark.parametrize("turn_deg", [70.0, 155.0, 260.0])
@pytest.mark.parametrize("beat", [True, False])
def test_a_channel_turned_about_has_the_tacks_at_risk_that_it_has(turn_deg, beat):
    here, _ = about(0.0, off_deg=10.0 * beat, beat=beat)
    there, turned = about(turn_deg, off_deg=10.0 * beat, beat=beat)
    assert here
    for a, b in zip(here, there, strict=True):
        assert (b.leg, b.failures) == (a.leg, a.failures)
        assert (b.risk, b.lack_m) == (pytest.approx(a.risk), pytest.approx(a.lack_m, abs=1e-6))
        places = np.array([turned(*a.at_en), b.at_en]) @ np.array([turned(1.0, 0.0), turned(0.0, 1.0)]).T
        aside = places[:, :1] if beat else places  # along a straight wall all places of a beat are alike
        assert aside[1] == pytest.approx(aside[0], abs=1e-6)


@pytest.mark.parametrize(
    ("walls", "side"), [(((-40.0, -21.0), (27.0, 60.0)), -1.0), (((-60.0, -27.0), (21.0, 40.0)), 1.0)]
)
def test_of_a_beat_the_tack_that_touches_soonest_is_named_at_the_edge_of_the_corridor(walls, side):
    [tack], _ = about(0.0, walls=walls)
    [alone], _ = about(0.0, walls=[wall for wall in walls if side * wall[0] > 0.0])
    [other], _ = about(0.0, walls=[wall for wall in walls if side * wall[0] < 0.0])
    assert tack.at_en[0] == pytest.approx(side * 20.0)
    assert tack.failures == alone.failures < other.failures
    assert tack.lack_m == pytest.approx(alone.lack_m)
    assert tack.risk == pytest.approx(alone.risk + other.risk)  # of all tacks, each as likely anywhere


def test_the_edges_of_a_short_beat_are_looked_at_every_ten_metres_at_most():
    [tack], _ = about(0.0, length_m=19.0)
    assert min(abs(tack.at_en[1] - along) for along in (4.75, 14.25)) < 1e-6


def test_the_failures_in_a_row_that_are_looked_at_are_one_to_five():
    def failures(gap_m):
        p = channel(0.3, width_m=400.0)
        p = replace(p, boat=replace(p.boat, turn_rate_radps=0.001))  # no room to gybe: the row goes on
        p = replace(p, obstacles=(shapely.box(40.0 + gap_m, -900.0, 90.0 + gap_m, 900.0),))
        return [t.failures for t in tacks_at_risk(p, evaluate(p, [(0, 0), (40, 40), (0, 80)]).legs)]

    seen = [failures(float(gap_m)) for gap_m in range(2, 60)]
    assert seen == sorted(seen, key=lambda row: row or [math.inf])
    assert [row[0] for row in seen if row] == sorted(row[0] for row in seen if row)
    assert {row[0] for row in seen if row} == set(range(1, MOST_FAILURES + 1))
    assert seen[-1] == []


def test_a_tack_that_may_touch_is_told_with_how_often_it_has_to_fail():
    once, twice = (TackAtRisk(leg=1, at_en=(20.4, -31.0), failures=n, risk=0.3**n, lack_m=1.0) for n in (1, 2))
    told = list(in_words(channel(0.3), (once, twice)))
    assert told[0] == "A tack that fails once at 20 E, -31 N would bring her onto something: 30 % at 30 % for one."
    assert "fails 2 times in a row" in told[1]
    assert "9 % at 30 % for one" in told[1]


@pytest.mark.parametrize("tws_mps", [5.0, None])
def test_how_far_a_failed_tack_reaches_is_asked_in_the_wind_of_the_plan(monkeypatch, tws_mps):
    asked = []
    monkeypatch.setattr(_Solids, "far_m", lambda self, speed_mps, tws: asked.append(tws) or 0.0)
    p = channel()
    p = replace(p, wind=replace(p.wind, tws_mps=tws_mps))
    assert _Solids(p).tack(p, 0, (0.0, 100.0), 0.8, 2.0, 0.3) is None
    assert asked == [tws_mps or 0.0]

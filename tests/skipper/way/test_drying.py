"""Water that dries: when it is open, what a plan is told of it, and that plans keep out of it at its hours."""

from __future__ import annotations

import datetime as dt
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon, box

from companion.compose import drying_of, tide_of, voyage_of
from companion.current import TideRow, TideTable, closed_spans, open_spans
from companion.errors import InputError
from companion.geofence import Code, FindingLevel, load_mission
from companion.mission_check import AssumedWind, check_mission, leg_problem, tide_words_of
from companion.planner import PlanStatus, plan
from companion.planner.problem import evaluate
from companion.skipper.planning.tides import opens_next
from companion.skipper.step import StepContext
from companion.skipper.way.drying import DOUBT_S, DryingWater, discs_over, timed
from tests.skipper.moments import NOW_S, moment, route

GATE = Path("sitl/missions/tide-gate.toml")
BAR = box(-200.0, 225.0, 60.0, 295.0)
TABLE = TideTable(
    rows=(
        TideRow(utc_s=0.0, height_m=0.0),
        TideRow(utc_s=20_000.0, height_m=3.0),
        TideRow(utc_s=42_000.0, height_m=0.5),
    )
)


def water(polygon: Polygon = BAR, opens_at_m: float = 1.4) -> DryingWater:
    return DryingWater(name="the bar", polygon=polygon, margin_m=0.0, opens_at_m=opens_at_m)


@pytest.mark.parametrize("level_m", [-0.5, 0.0, 0.7, 1.4, 2.99, 3.2])
def test_it_is_open_just_when_the_table_says_so(level_m):
    spans = open_spans(TABLE, level_m)
    for t in np.linspace(0.0, 42_000.0, 997):
        height = TABLE.height_m(float(t))
        assert height is not None
        if abs(height - level_m) > 1e-6:
            assert any(a <= t <= b for a, b in spans) == (height > level_m)


@pytest.mark.parametrize("level_m", [-0.5, 0.0, 1.4, 3.2])
def test_it_is_closed_at_every_other_time_for_whoever_draws_it(level_m):
    spans = closed_spans(TABLE, level_m)
    assert (spans[0][0], spans[-1][1]) == (-math.inf, math.inf)
    for t in (-9e9, 9e9):
        assert any(a <= t <= b for a, b in spans)
    for t in np.linspace(1.0, 41_999.0, 997):
        height = TABLE.height_m(float(t))
        assert height is not None
        if abs(height - level_m) > 1e-6:
            assert any(a <= t <= b for a, b in spans) == (height < level_m)
    assert closed_spans(None, level_m) == ((-math.inf, math.inf),)


def test_without_a_time_or_a_table_and_beyond_its_rows_it_is_closed():
    assert water().closed_s(None, 100.0) == water().closed_s(TABLE, None) == ((0.0, math.inf),)
    assert water().closed_s(TABLE, 43_000.0) == ((0.0, math.inf),)
    (first, last) = water().closed_s(TABLE, 1000.0)
    assert first[0] == 0.0
    assert TABLE.height_m(1000.0 + first[1]) == pytest.approx(1.4)
    assert last[1] == math.inf
    assert water().is_closed(TABLE, 1000.0, 600.0)
    assert not water().is_closed(TABLE, 20_000.0, 0.0)


def test_it_opens_later_and_closes_earlier_for_a_plan_the_farther_off_the_more():
    closed, doubtful = water().closed_s(TABLE, 1000.0), water().doubtful_s(TABLE, 1000.0)
    assert doubtful[0][1] - closed[0][1] == pytest.approx(DOUBT_S + 0.1 * closed[0][1])
    assert closed[1][0] - doubtful[1][0] == pytest.approx(DOUBT_S + 0.1 * closed[1][0])


@pytest.mark.parametrize(
    "shape",
    [
        BAR,
        Polygon([(0, 0), (600, 40), (580, 90), (300, 60), (-20, 55)]),
        Polygon([(0, 0), (300, 0), (300, 300), (0, 300)], [[(100, 100), (200, 100), (200, 200), (100, 200)]]),
    ],
)
def test_the_discs_contain_it_with_its_margin_and_reach_little_beyond(shape):
    discs = discs_over(water(shape), 12.0)
    union = shapely.union_all([shapely.Point(x, y).buffer(r, quad_segs=64) for x, y, r in discs])
    assert discs
    assert shapely.covers(union.buffer(0.05), shape.buffer(12.0))
    assert shapely.covers(shape.buffer(12.0 * 1.06 + 80.0), union)


def test_a_boat_within_its_discs_is_let_out_and_one_far_off_is_not():
    (near, far) = (timed([water()], TABLE, 1000.0, margin_m=12.0, start_en=at) for at in ((-70.0, 218.0), (0.0, 0.0)))
    assert any(math.dist((t.x_m, t.y_m), (-70.0, 218.0)) < t.radius_m for t in far.targets if t.from_s == 0.0)
    assert not any(math.dist((t.x_m, t.y_m), (-70.0, 218.0)) < t.radius_m for t in near.targets if t.from_s == 0.0)


def test_what_is_closed_for_longer_than_a_plan_looks_ahead_is_an_obstacle():
    assert timed([water(opens_at_m=3.5)], TABLE, 1000.0, margin_m=12.0, start_en=(0.0, 0.0)).solid
    told = timed([water()], TABLE, 18_000.0, margin_m=12.0, start_en=(0.0, 0.0))
    assert not told.solid
    assert all(t.from_s > 0.0 for t in told.targets)


def sailed(problem, utc_s, table, piece):
    """Return what of a plan is sailed over the water while it is closed [m], by a reader of its own."""
    answer = plan(problem, expansions=20_000, seed=0)
    wet_m = 0.0
    for leg in answer.legs:
        for share in np.linspace(0.0, 1.0, 400):
            here = [a + share * (b - a) for a, b in zip(leg.from_en, leg.to_en, strict=True)]
            t = leg.start_s + share * (leg.end_s - leg.start_s)
            height = table.height_m(utc_s + t)
            if shapely.contains(piece.polygon, shapely.Point(here)) and (height is None or height < piece.opens_at_m):
                wet_m += leg.length_m / 400.0
    return answer, wet_m


def at(hour: str) -> float:
    return dt.datetime.fromisoformat(f"2026-06-09T{hour}+00:00").timestamp()


@pytest.mark.parametrize(("hour", "status"), [("17:50", "closed"), ("08:28", "late"), ("09:00", "over")])
def test_a_plan_goes_over_a_bar_at_its_hours_only(hour, status):
    mission = load_mission(GATE)
    piece, table = drying_of(mission, mission.frame())[0], tide_of(mission)
    goal = mission.frame().en_from_geo(mission.goals[0].point)
    wind = AssumedWind(from_deg=240.0, speed_mps=5.0)
    problem = leg_problem(mission, (0.0, 0.0), 60.0, goal, 10.0, wind=wind, unix_s=at(hour))
    answer, wet_m = sailed(problem, at(hour), table, piece)
    assert wet_m == 0.0
    if status == "closed":
        assert not answer.has_path
        return
    assert answer.has_path
    open_s = piece.closed_s(table, at(hour))[0][1] if status == "late" else 0.0
    assert answer.cost_s > open_s
    straight = [(0.0, 0.0), goal]
    assert evaluate(problem, straight).is_feasible == (status == "over")
    without = leg_problem(mission, (0.0, 0.0), 60.0, goal, 10.0, wind=wind)
    assert not evaluate(without, straight).is_feasible  # where nobody tells the hour it is solid


def test_a_plan_goes_round_the_end_of_a_bar_that_is_closed_and_over_one_that_is_open():
    mission = load_mission(GATE)
    problem = leg_problem(
        replace(mission, drying=()),
        (0.0, 0.0),
        60.0,
        (0.0, 520.0),
        10.0,
        wind=AssumedWind(from_deg=240.0, speed_mps=5.0),
    )
    costs = []
    for utc_s in (5_000.0, 20_000.0):
        told = timed([water()], TABLE, utc_s, margin_m=8.0, start_en=(0.0, 0.0))
        answer, wet_m = sailed(replace(problem, targets=told.targets), utc_s, TABLE, water())
        assert answer.status in {PlanStatus.OPTIMAL, PlanStatus.FOUND}
        assert wet_m == 0.0
        costs.append(answer.cost_s)
    assert costs[0] > costs[1] + 5.0


def test_a_mission_without_drying_water_is_planned_as_it_was():
    mission = replace(load_mission(GATE), drying=())
    problem = leg_problem(
        mission,
        (0.0, 0.0),
        60.0,
        (0.0, 520.0),
        10.0,
        wind=AssumedWind(from_deg=240.0, speed_mps=5.0),
        unix_s=at("09:00"),
    )
    assert problem.targets == ()
    assert problem.obstacles == ()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('tide = "tide-gate.csv"\n', "", "[area] tide"),
        ("draft_m = 0.6\n", "", "[boat] draft_m"),
        ('"depth_m": -0.3', '"depth_m": "three feet"', "has no depth_m"),
    ],
)
def test_what_it_needs_is_said(tmp_path, old, new, told):
    for file in Path("sitl/missions").glob("tide-gate*"):
        text = file.read_text().replace('"depth_m":-0.3', '"depth_m": -0.3')
        (tmp_path / file.name).write_text(text.replace(old, new))
    with pytest.raises(InputError, match=r"drying") as refused:
        load_mission(tmp_path / "tide-gate.toml")
    assert told in str(refused.value)


def test_a_refuge_and_a_home_that_dry_are_told_before_anybody_sails(tmp_path):
    for file in Path("sitl/missions").glob("tide-gate*"):
        (tmp_path / file.name).write_text(file.read_text())
    path = tmp_path / "tide-gate.toml"
    (bar,) = voyage_of(load_mission(path)).drying
    frame = voyage_of(load_mission(path)).frame
    there = frame.geo_from_en(bar.polygon.centroid.x, bar.polygon.centroid.y)
    path.write_text(f"{path.read_text()}\n[[refuge]]\nlat = {there.lat_deg:.7f}\nlon = {there.lon_deg:.7f}\n")
    (told,) = [f for f in check_mission(path).findings if f.code is Code.DRIES]
    assert (told.place, told.severity) == ("[[refuge]] 1", FindingLevel.WARNING)
    assert "which dries" in told.text


def test_a_bar_of_a_mission_opens_when_the_keel_is_clear_of_it_and_a_low_tide_is_reckoned_with():
    (bar,) = voyage_of(load_mission(Path("sitl/missions/tide-gate.toml"))).drying
    assert bar.opens_at_m == pytest.approx(0.6 + 0.3 + 0.3 + 0.2)  # draught, under the keel, what it dries, the doubt
    assert bar.room_m(2.0) == pytest.approx(2.0 - 1.2)


def test_what_opens_next_is_said_and_when():
    now = moment(route((0.0, 300.0), (0.0, 300.0)))
    voyage = replace(now.voyage, drying=(water(opens_at_m=1.4), water(opens_at_m=9.0)))
    status = replace(now.snapshot.autopilot, t_s=NOW_S, utc_at_boot_s=1000.0, boot_s=0.0)

    def at(tide, **told):
        snapshot = replace(now.snapshot, autopilot=replace(status, **told))
        return opens_next(StepContext(voyage, replace(now.config, tide=tide), now.state, snapshot))

    opens_s = 1000.0 + water().closed_s(TABLE, 1000.0)[0][1]
    assert at(TABLE).words == f"the bar opens at {dt.datetime.fromtimestamp(opens_s, dt.UTC):%H:%M} UTC"
    assert at(TABLE).in_s == pytest.approx(opens_s - 1000.0)
    assert at(TABLE, utc_at_boot_s=opens_s + 60.0) is None  # it is open
    assert at(None) is at(TABLE, utc_at_boot_s=None) is None


def test_what_opens_on_another_day_is_said_with_the_day_and_what_the_table_holds_for():
    """Two days and a half before the table's first row "opens at 00:10 UTC" was said."""
    now = moment(route((0.0, 300.0), (0.0, 300.0)))
    rows = (TideRow(utc_s=300_000.0, height_m=2.0), TideRow(utc_s=320_000.0, height_m=0.4))
    table = TideTable(rows=rows, name="week.csv")
    status = replace(now.snapshot.autopilot, t_s=NOW_S, utc_at_boot_s=1000.0, boot_s=0.0)
    ctx = StepContext(
        replace(now.voyage, drying=(water(),)),
        replace(now.config, tide=table),
        now.state,
        replace(now.snapshot, autopilot=status),
    )
    assert opens_next(ctx).words == (
        "the bar opens at 1970-01-04T11:20Z; nothing is known of the tide now: week.csv holds from 1970-01-04T11:20Z "
        "to 1970-01-04T16:53Z"
    )


def test_the_tide_is_told_at_the_hour_that_is_looked_at():
    """A bar that was closed, or a table that was over, was "obstacles or the fence close it"."""
    mission = load_mission(GATE)
    assert tide_words_of(mission, at("07:00")) == (
        "tide at 2026-06-09T07:00Z: 0.38 m by tide-gate.csv; closed of what dries: The bar (drying height); the first "
        "opens at 2026-06-09T08:32Z"
    )
    assert tide_words_of(mission, at("10:00")).endswith("what dries is open")
    assert tide_words_of(mission, at("20:00")) == (
        "tide at 2026-06-09T20:00Z: not known: tide-gate.csv holds from 2026-06-09T05:34Z to 2026-06-09T17:59Z; all "
        "that dries is closed"
    )
    assert tide_words_of(replace(mission, drying=()), at("07:00")) == ""


def test_a_gap_in_the_table_of_a_mission_is_found(tmp_path):
    for name in ("tide-gate.toml", "tide-gate-water.geojson", "tide-gate-drying.geojson"):
        (tmp_path / name).write_text((GATE.parent / name).read_text())
    rows = (GATE.parent / "tide-gate.csv").read_text()
    (tmp_path / "tide-gate.csv").write_text(rows + "2026-06-12T06:00:00Z, 3.0\n")
    found = [f for f in check_mission(tmp_path / "tide-gate.toml").findings if f.place == "[area] tide"]
    assert [f.severity for f in found] == [FindingLevel.WARNING]
    assert found[0].text == (
        "tide-gate.csv holds from 2026-06-09T05:34Z to 2026-06-12T06:00Z, but not between its rows of "
        "2026-06-09T17:59Z and 2026-06-12T06:00Z: nothing is known of the tide then, and what dries is closed"
    )
    assert not [f for f in check_mission(GATE).findings if f.place == "[area] tide"]

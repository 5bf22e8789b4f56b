"""Waiting for a gun and in a box: when it is, where and how long she waits."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.skipper.planning import waits
from companion.skipper.planning.waits import gun_in_s, stay_left_s, waiting_en, waits_for_gun
from companion.skipper.step import StepContext
from companion.skipper.step.state import Inside
from companion.skipper.way.voyage import Box, Goal, Line
from tests.skipper.moments import NOW_S, moment, route

LINE = Line(port_en_m=(-40.0, 200.0), starboard_en_m=(40.0, 200.0), keep_m=5.0, after_s=600.0)  # to the north
WAY = route((0.0, 600.0), (0.0, 900.0), (0.0, 900.0))


def before_line(*, line=LINE, clock=(None, None), clock_age_s=0.0, **parts):
    """Return a moment before a start line that is crossed to the north, at ``at``."""
    goals = (Goal(en_m=(0.0, 200.0), name="start", line=line), Goal(en_m=(0.0, 900.0), name="one"))
    ctx = moment(WAY, goals=goals, **parts)
    status = replace(ctx.snapshot.autopilot, t_s=NOW_S - clock_age_s, utc_at_boot_s=clock[0], boot_s=clock[1])
    return StepContext(ctx.voyage, ctx.config, ctx.state, replace(ctx.snapshot, autopilot=status))


# ------------------------------------------------------------------------------------------------- the clock
@pytest.mark.parametrize(
    ("clock", "age_s", "now_s"),
    [
        ((1.7e9, 50.0), 0.0, 1.7e9 + 50.0),
        ((1.7e9, 50.0), 2.0, 1.7e9 + 52.0),
        ((1.7e9, 50.0), -2.0, 1.7e9 + 48.0),
        ((None, 50.0), 0.0, None),
        ((1.7e9, None), 0.0, None),
    ],
)
def test_the_time_of_day_is_the_autopilot_s(clock, age_s, now_s):
    assert before_line(clock=clock, clock_age_s=age_s).utc_s == now_s
    ctx = before_line()
    silent = replace(ctx.snapshot, autopilot=None)
    assert StepContext(ctx.voyage, ctx.config, ctx.state, silent).utc_s is None


@pytest.mark.parametrize(
    ("gun", "clock", "set_sail_s", "left_s"),
    [
        ({"not_before_s": 1000.0}, (800.0, 50.0), None, 150.0),
        ({"not_before_s": 1000.0}, (1000.0, 50.0), None, -50.0),
        ({"not_before_s": 1000.0}, (None, None), None, None),  # not known, and not "gone"
        ({}, (800.0, 50.0), None, -math.inf),
        ({"after_s": 600.0}, (None, None), None, 500.0),  # counted from step to step: 100 s under way
        ({"after_s": 600.0}, (800.0, 50.0), None, 500.0),
        ({"after_s": 600.0}, (None, None), 700.0, 500.0),
        ({"after_s": 600.0}, (800.0, 50.0), 700.0, 450.0),  # or by the clock, over a restart
    ],
)
def test_how_long_it_is_to_the_gun(gun, clock, set_sail_s, left_s):
    line = replace(LINE, after_s=None, **gun) if "after_s" not in gun else replace(LINE, **gun)
    ctx = before_line(line=line, clock=clock, voyage={"under_way_s": 100.0, "set_sail_utc_s": set_sail_s})
    assert gun_in_s(ctx, line) == left_s


# ------------------------------------------------------------------------------------------- when she is to sail
def is_waiting(left_s, **parts):
    ctx = before_line(voyage={"sailing": True, "under_way_s": 600.0 - left_s}, **parts)
    return waits_for_gun(ctx, ctx.gate)


def sails_for_s(ctx_parts, way_m, twa_deg):
    """How long she sails to the line, by her polar: a closed course is made good by two boards."""
    ctx = before_line(**ctx_parts)
    closed, twa = ctx.planned_no_go_rad, math.radians(twa_deg)
    speed = ctx.voyage.boat.polar.speed_mps(max(closed, twa), ctx.wind_mean[1])
    if twa < closed:
        speed *= math.cos(closed) / max(math.cos(twa), 0.1)
    return way_m / max(0.3, speed) * (1.0 if way_m <= 120.0 else 0.6)


@pytest.mark.parametrize(
    ("parts", "way_m", "twa_deg"),
    [
        ({"at": (0.0, 150.0), "twd_deg": 90.0}, 50.0, 90.0),
        ({"at": (0.0, 150.0), "twd_deg": 0.0}, 50.0, 0.0),
        ({"at": (0.0, 150.0), "twd_deg": -30.0}, 50.0, 30.0),
        ({"at": (0.0, 150.0), "twd_deg": 180.0}, 50.0, 180.0),
        ({"at": (0.0, 80.0), "twd_deg": 90.0}, 120.0, 90.0),
        ({"at": (0.0, 79.0), "twd_deg": 90.0}, 121.0, 90.0),  # from farther away it is not foreseen so well
        ({"at": (0.0, 150.0), "twd_deg": 90.0, "tws_mps": 0.2}, 50.0, 90.0),
        ({"at": (0.0, 150.0), "twd_deg": 90.0, "tws_mps": 12.0}, 50.0, 90.0),
    ],
)
def test_she_sails_for_the_line_eight_seconds_later_than_she_could_be_there(parts, way_m, twa_deg):
    need_s = sails_for_s(parts, way_m, twa_deg) - 8.0
    assert is_waiting(need_s + 0.1, **parts)
    assert not is_waiting(need_s - 0.1, **parts)


def test_two_boards_are_longer_than_one():
    straight, beaten = ({"at": (0.0, 150.0), "twd_deg": d} for d in (90.0, 0.0))
    assert sails_for_s(beaten, 50.0, 0.0) > 1.3 * sails_for_s(straight, 50.0, 90.0)


def test_beyond_the_line_released_or_without_a_gun_she_does_not_wait():
    assert is_waiting(100.0, at=(0.0, 150.0))
    assert is_waiting(-7.9, at=(0.0, 201.0))  # where no way to the line is known only the reserve counts
    assert not is_waiting(-8.1, at=(0.0, 201.0))
    assert not is_waiting(100.0, at=(0.0, 150.0), progress={"released": 0})
    assert is_waiting(100.0, at=(0.0, 150.0), progress={"released": 1})
    ctx = before_line(at=(0.0, 150.0))
    assert not waits_for_gun(ctx, ctx.gates[-1])  # which is no line
    open_line = replace(LINE, after_s=None)
    ctx = before_line(line=open_line, at=(0.0, 150.0))
    assert not waits_for_gun(ctx, ctx.gate)


def test_while_the_time_of_day_is_not_known_she_waits():
    ctx = before_line(line=replace(LINE, after_s=None, not_before_s=1.0), at=(0.0, 150.0))
    assert waits_for_gun(ctx, ctx.gate)


def test_of_a_line_that_is_not_next_no_way_is_known():
    ctx = before_line(at=(0.0, 150.0), voyage={"sailing": True, "under_way_s": 605.0})
    other = replace(ctx.gate, goal=5)
    assert not waits_for_gun(ctx, ctx.gate)
    assert waits_for_gun(ctx, other)


# ------------------------------------------------------------------------------------------------ where she waits
def best_of(ctx, gate, *, cut):
    """The cheapest of all places, reckoned apart: room, one board away, near, and straight before the line."""
    costs = {}
    for far_m in (40.0, 70.0):
        for side_deg in (0, 15, -15, 30, -30, 45, -45):
            heading = math.radians(side_deg)
            place = (cut[0] - far_m * math.sin(heading), cut[1] - far_m * math.cos(heading))
            clear_m = float(ctx.voyage.area.clearance_m([place])[0])
            twa = abs((heading - ctx.wind_mean[0] + math.pi) % (2 * math.pi) - math.pi)
            closed = twa < ctx.planned_no_go_rad + math.radians(8.0)
            costs[place] = (
                10.0 * max(0.0, 23.0 - clear_m) + 20.0 * closed + far_m / 10.0 + abs(math.radians(side_deg)) / 15.0
            )
    return min(costs, key=costs.__getitem__)


@pytest.mark.parametrize(
    "parts",
    [
        {"twd_deg": 90.0},
        {"twd_deg": 180.0},
        {"twd_deg": 20.0},
        {"twd_deg": -20.0},
        {"twd_deg": 30.0},
        {"twd_deg": -30.0},
        {"twd_deg": 42.0},
        {"twd_deg": -42.0},
        {"twd_deg": 53.0},
        {"twd_deg": 56.0},
        {"twd_deg": 90.0, "obstacles": (box(-15, 120, 15, 170),)},
        {"twd_deg": 90.0, "obstacles": (box(15, 120, 30, 170), box(-80, 120, -30, 190))},
        {"twd_deg": 20.0, "obstacles": (box(-45, 140, -20, 180),)},
        {"twd_deg": 90.0, "obstacles": (box(-22, 130, -21, 170), box(23, 130, 24, 170))},
        {"twd_deg": 90.0, "config": {"margin_floor_m": 8.0, "margin_m": 30.0}, "obstacles": (box(22, 130, 60, 190),)},
    ],
)
@pytest.mark.parametrize("at", [(0.0, 0.0), (0.0, 260.0)])  # before the line and beyond it: another gate
def test_she_waits_where_there_is_room_and_one_board_to_the_line(parts, at):
    ctx = before_line(at=at, **parts)
    for gate in [g for g in ctx.gates if g.line is not None]:
        place = waiting_en(ctx, gate)
        assert place == pytest.approx(best_of(ctx, gate, cut=(gate.en_m[0], 200.0)), abs=1e-6)


def test_without_a_wind_she_waits_straight_before_the_line():
    ctx = before_line()
    ctx.snapshot = replace(ctx.snapshot, wind=type(ctx.snapshot.wind)())
    assert waiting_en(ctx, ctx.gate) == pytest.approx((0.0, 160.0))


def test_the_figures_of_a_wait():
    assert (waits.WAIT_M, waits.FARTHEST_M, waits.RESERVE_S, waits.NEAR_M, waits.FAR_SHARE, waits.SLOWEST_MPS) == (
        40.0,
        70.0,
        8.0,
        120.0,
        0.6,
        0.3,
    )


# ------------------------------------------------------------------------------------------------------- a box
@pytest.mark.parametrize(
    ("for_s", "inside", "left_s"),
    [
        (300.0, Inside(goal=0, t_s=NOW_S - 100.0), 200.0),
        (300.0, Inside(goal=1, t_s=NOW_S - 100.0), math.inf),
        (300.0, None, math.inf),
        (None, Inside(goal=0, t_s=NOW_S - 100.0), math.inf),
        (300.0, Inside(goal=0, t_s=NOW_S - 400.0), -100.0),
        (300.0, Inside(goal=0, t_s=NOW_S - 100.0, utc_s=1.0e6), 180.0),  # by the clock, over a restart
    ],
)
def test_how_long_she_stays_in_a_box(for_s, inside, left_s):
    goal = Goal(en_m=(0.0, 0.0), name="box", box=Box(area_en=box(-50, -50, 50, 50), for_s=for_s))
    ctx = moment(WAY, goals=(goal,), progress={"inside": inside})
    status = replace(ctx.snapshot.autopilot, t_s=NOW_S, utc_at_boot_s=1.0e6, boot_s=120.0)
    ctx = StepContext(ctx.voyage, ctx.config, ctx.state, replace(ctx.snapshot, autopilot=status))
    assert stay_left_s(ctx, ctx.gate) == left_s
    assert stay_left_s(ctx, replace(ctx.gate, box=None)) == math.inf

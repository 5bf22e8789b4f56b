"""Boards close to the wind by headings: she goes about before the floor, and is not stopped where she can."""

from dataclasses import replace

from shapely.geometry import box

from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.behaviors.headings import ahead_of, brakes, desired_heading_rad
from companion.skipper.step.config import Guidance
from tests.skipper.moments import moment, route

WALL = box(12.0, -200.0, 40.0, 400.0)


def beating(off_m, *, obstacles=(WALL,), heading_deg=45.0, **how):
    """Return the moment of a board to the north-east, ``off_m`` from a wall, on a leg that the wind has closed."""
    way = route((0.0, 300.0), (0.0, 300.0), gate_of=(0, -1))
    ctx = moment(
        way,
        obstacles=obstacles,
        at=(12.0 - off_m, 40.0),
        heading_deg=heading_deg,
        speed_mps=2.5,
        config={"guidance": Guidance.HEADING, "margin_m": 8.0, "margin_floor_m": 4.0},
        **how,
    )
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=Mode.GUIDED))
    return ctx


def test_by_headings_a_board_goes_about_before_the_floor_and_is_not_stopped_before():
    wanted = desired_heading_rad(beating(8.0))
    assert wanted is not None
    assert difference_rad(wanted, 0.0) < 0.0  # the other tack
    far = desired_heading_rad(beating(16.0))
    assert far is not None
    assert difference_rad(far, 0.0) > 0.0
    for off_m in (6.0, 8.0, 16.0):
        ctx = beating(off_m)
        assert ahead_of(ctx) is None
        assert not brakes(ctx)


def test_a_turn_that_is_begun_is_not_taken_back_for_her_speed_in_it():
    ctx = beating(8.0, heading_deg=15.0)
    ctx.snapshot = replace(ctx.snapshot, vehicle=replace(ctx.snapshot.vehicle, velocity_en_mps=(0.1, 0.3)))
    wanted = desired_heading_rad(ctx)
    assert wanted is not None
    assert difference_rad(wanted, 0.0) < 0.0


def test_between_two_walls_with_no_other_tack_she_is_stopped():
    other = box(-20.0, -200.0, 3.5, 400.0)
    ctx = beating(5.0, obstacles=(WALL, other))
    assert ahead_of(ctx) is not None

"""Tacks on the wind's shifts, on a beat that is left to the autopilot: asked for where they pay, and nowhere else."""

import itertools
import math

import pytest
import shapely

from companion.skipper.step import actions as act
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import ar1, is_done, make, said

GOAL = Goal(en_m=(0.0, 400.0), radius_m=8.0)
SPREAD_DEG = 12.0


def beating(seed=0, *, shifts=True, wind=None, corridor=50.0, spread_deg=SPREAD_DEG, obstacles=(), **config):
    return make(
        GOAL,
        obstacles=obstacles,
        wind=wind or ar1(seed, spread_deg),
        sigma=math.radians(spread_deg),
        corridor=corridor,
        config={"autopilot_beats": True, "shifts": shifts, **config},
    )


def tacks(world):
    return [a for _, a in world.actions if isinstance(a, act.Tack)]


def test_headers_are_tacked_and_said():
    world = beating()
    assert world.run(1500, is_done)
    assert said(world, "shift tack")
    assert any(a.text.startswith("headed ") and "expected gain" in a.text for a in tacks(world))


@pytest.mark.parametrize(
    "how",
    [
        {"shifts": False},
        {"corridor": 10.0},
        {"wind": lambda t: (0.0, 5.0), "spread_deg": 1.0},
        {"autopilot_beats": False},
    ],
    ids=["off", "narrow", "steady", "planned"],
)
def test_elsewhere_the_autopilot_tacks_as_it_does(how):
    world = beating(**how)
    assert world.run(1500, is_done)
    assert not tacks(world)


@pytest.mark.parametrize("shifts", [True, False])
def test_a_board_within_the_corridor_is_not_off_the_leg(shifts):
    """Planned again there, the leg would begin at the boat, and the corridor with it."""
    world = beating(shifts=shifts)
    assert world.run(1500, is_done)
    assert max(abs(x) for x, _ in world.track) > 30.0
    assert not said(world, "off the corridor")
    assert not [a for _, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.OFF_LEG]


def test_beyond_the_corridor_she_is_off_the_leg():
    world = beating()
    assert world.run(200, lambda w: w.position[1] > 100.0)
    x, y = world.position
    world.position = (x + math.copysign(100.0, x), y)
    world.run(60, lambda w: bool(said(w, "off the corridor")))
    assert said(world, "off the corridor")


@pytest.mark.parametrize("shifts", [True, False])
def test_a_corridor_that_is_too_wide_without_them_is_sailed_in_by_the_shifts(shifts):
    world = beating(shifts=shifts, corridor=200.0)
    world.run(100, lambda w: w.armed)
    places = {(item.lat_e7, item.lon_e7) for item in world.mission}
    assert (len(places) == 1) == shifts  # without them each board is planned
    assert world.run(1500, is_done)
    assert bool(tacks(world)) == shifts


@pytest.mark.parametrize("apart_s", [10.0, 40.0])
def test_tacks_that_are_asked_for_are_apart(apart_s):
    world = beating(seed=1, shift_tacks_apart_s=apart_s)
    assert world.run(1500, is_done)
    asked = [t for t, a in world.actions if isinstance(a, act.Tack)]
    assert len(asked) >= 2
    assert all(b - a >= apart_s for a, b in itertools.pairwise(asked))


def test_beside_a_rock_within_the_corridor_none_is_asked_for():
    """The beat there is not the autopilot's: nothing is sailed that the planner has not found clear."""
    rocks = tuple(shapely.box(x - 4.0, n, x + 4.0, n + 560.0) for x in (-40.0, 40.0) for n in (20.0,))
    world = beating(obstacles=rocks, margin_m=8.0, margin_floor_m=5.0)
    world.run(400, is_done)
    assert not said(world, "shift tack")
    assert world.clearance() > 0.0

"""The charge against the way to where she can wait, and a battery that is critical by it."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.safety import BATTERY
from companion.skipper.step.config import Ends
from companion.skipper.step.context import StepContext
from companion.skipper.step.state import Alarms, Charge, SkipperState
from companion.skipper.watch.measures import DETOUR, FALL, LOOK_S, lasts_s, way_s
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import make, said
from tests.skipper.world import FRAME, voyage

AWAY = Goal(en_m=(1500.0, 0.0), radius_m=8.0)


def sailing(**made):
    world = make(AWAY, obstacles=(), **made)
    world.shown = {"home": FRAME.geo_from_en(0.0, 0.0)}
    return world


def falls(world, share_per_s, first=0.9, for_s=900):
    """Sail on while the charge falls."""
    began = world.t
    for _ in range(for_s // 10):
        world.shown["battery_remaining"] = round(first - share_per_s * (world.t - began), 2)
        world.run(10)
        if any(r.name == BATTERY for r in world.state.alarms.raised):
            return


def test_it_is_critical_while_it_still_covers_the_way_to_the_refuge():
    world = sailing(voyage={"refuges": ((0.0, 0.0),)})
    falls(world, 0.9 / 1500.0)
    assert world.state.alarms.charge.last > 0.2  # long before the 10 % that are always critical
    assert "the way to where she can wait" in said(world, "charge")[0][2]
    assert world.run(60, lambda w: w.state.mission.route.bound_for == "the refuge 1")


@pytest.mark.parametrize(
    "made",
    [
        {"voyage": {"refuges": ((0.0, 0.0),)}, "config": {"ends": Ends.of(battery_reserve=0.0)}},  # not asked for
        {"voyage": {"refuges": ((1400.0, 100.0),)}},  # near by
    ],
)
def test_it_is_not_where_it_is_not_asked_for_or_the_refuge_is_near(made):
    world = sailing(**made)
    falls(world, 0.5 / 1500.0, for_s=700)
    assert not said(world, "charge")
    assert not world.state.alarms.battery_critical


def test_a_charge_that_rises_begins_anew():
    world = sailing()
    falls(world, 0.3 / 400.0, for_s=400)
    assert world.state.alarms.charge.first == 0.9
    world.shown["battery_remaining"] = 0.8
    world.run(2)
    assert world.state.alarms.charge.first == world.state.alarms.charge.last == 0.8


@given(st.floats(0.3, 1.0), st.floats(0.0, 0.3), st.floats(0.0, 20_000.0))
def test_what_is_left_at_the_mean_rate(first, fallen, after_s):
    charge = Charge(since_s=10.0, first=first, last=first - fallen)
    world = make(AWAY)
    world.t = 10.0 + after_s
    state = SkipperState(alarms=Alarms(charge=charge))
    left = lasts_s(StepContext(voyage(), world.skipper.config, state, world.snapshot()))
    if after_s < LOOK_S or first - charge.last < FALL:
        assert left is None
    else:
        assert left == pytest.approx((first - fallen) * after_s / fallen, rel=1e-6)
    assert DETOUR >= 2.0**0.5


@pytest.mark.parametrize(
    ("refuges", "home", "is_known"),
    [
        (((600.0, 0.0), (-300.0, 0.0)), True, True),  # the nearest refuge, though home is nearer still
        ((), True, True),  # without one home
        ((), False, False),  # and where there is neither nothing is reckoned
    ],
)
def test_the_way_to_where_she_can_wait(refuges, home, is_known):
    world = sailing(voyage={"refuges": refuges})
    world.run(60)
    if not home:
        world.shown = {}
    snapshot = world.snapshot()
    here = StepContext(world.skipper.voyage, world.skipper.config, world.state, snapshot)
    if not is_known:
        assert way_s(here) is None
        return
    boat = here.boat_en
    place = min(refuges or ((0.0, 0.0),), key=lambda p: distance_m(boat, p))
    fastest = world.skipper.voyage.boat.polar.max_speed_mps(here.wind_mean[1])
    assert way_s(here) == pytest.approx(DETOUR * distance_m(boat, place) / fastest)
    no_boat = replace(snapshot, vehicle=None)
    assert way_s(StepContext(world.skipper.voyage, world.skipper.config, world.state, no_boat)) is None

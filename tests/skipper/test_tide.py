"""Water that dries under way: waited for, planned over at its hours, given up where the way comes to it too late."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from companion.current import TideRow, TideTable
from companion.messages import Command
from companion.orders.order import phrase
from companion.skipper.behaviors.field_guidance import intent, situation
from companion.skipper.behaviors.operator_orders import refuge_place
from companion.skipper.behaviors.position_doubt import follow
from companion.skipper.behaviors.shoaling import depth_ahead_m
from companion.skipper.planning.asking import lacks
from companion.skipper.planning.diversions import home_trouble, refuges_by_way
from companion.skipper.planning.not_found import hold
from companion.skipper.planning.tides import closes_ahead, dries_under, opens_next
from companion.skipper.step import StepContext
from companion.skipper.step.actions import RequestPlan, UploadMission
from companion.skipper.step.missions import loiter_place
from companion.skipper.way.drying import DryingWater
from companion.skipper.way.shoals import RISES_M, Shoal, still_shoal
from companion.skipper.way.voyage import Box, Goal, Refuge
from tests.skipper.moments import moment, route
from tests.skipper.test_voyage import is_done, make, said

EAST = math.radians(90.0)
UTC_S = 1_000_000.0
GOAL = Goal(en_m=(0.0, 300.0), radius_m=6.0, name="the goal")
FLAT = DryingWater(name="the flat", polygon=box(-400.0, 500.0, 400.0, 1400.0), margin_m=0.0, opens_at_m=1.0)
BAR = DryingWater(name="the bar", polygon=box(-400.0, 130.0, 400.0, 170.0), margin_m=0.0, opens_at_m=1.0)


def voyage_over_a_bar(*heights, bar=BAR, goals=(GOAL,), **config):
    """Return a voyage across a bar by a table of ``heights`` (seconds after the start, metres), with a row an hour."""
    times, levels = zip(*heights, strict=True)
    every = sorted({*times, *np.arange(times[0], times[-1], 3600.0).tolist()})
    rows = tuple(TideRow(utc_s=UTC_S + t, height_m=float(np.interp(t, times, levels))) for t in every)
    world = make(*goals, obstacles=(), wind=lambda t: (EAST, 5.0), config={"tide": TideTable(rows=rows), **config})
    world.skipper = replace(world.skipper, voyage=replace(world.skipper.voyage, drying=(bar,)))
    world.shown |= {"utc_at_boot_s": UTC_S - world.boot_s}
    return world


def context(world):
    return StepContext(world.skipper.voyage, world.skipper.config, world.state, world.snapshot())


def test_she_waits_off_a_bar_and_goes_over_it_when_the_tide_has_risen():
    world = voyage_over_a_bar((-1000.0, 0.0), (1400.0, 2.0))
    crossed, opens_s = [], BAR.closed_s(world.skipper.config.tide, UTC_S)[0][1]

    def watch(w):
        if BAR.polygon.contains(box(*w.position, w.position[0] + 0.1, w.position[1] + 0.1)):
            crossed.append(w.t)
        return is_done(w)

    assert world.run(1500, watch)
    assert world.state.progress.reached == (0,)
    assert crossed
    assert min(crossed) > opens_s


def test_where_nothing_opens_until_later_she_holds_and_says_what_she_waits_for():
    limits = box(-60.0, -100.0, 60.0, 400.0)
    world = voyage_over_a_bar((-1000.0, 0.0), (9000.0, 2.0))
    held = world.skipper.voyage
    world.skipper = replace(world.skipper, voyage=replace(held, area=replace(held.area, limits=limits)))
    world.run(240)
    assert said(world, "waiting for the tide")
    assert world.position[1] < 130.0
    assert opens_next(context(world)).words.startswith("the bar opens at")


def test_what_opens_on_another_day_is_not_asked_for_every_other_minute():
    """204 plans were made in 50 minutes, of a bar that the table opened in 2.6 days."""
    limits = box(-60.0, -100.0, 60.0, 400.0)
    world = voyage_over_a_bar((230_000.0, 2.0), (240_000.0, 2.0))
    held = world.skipper.voyage
    world.skipper = replace(world.skipper, voyage=replace(held, area=replace(held.area, limits=limits)))
    world.run(1500)
    assert said(world, "waiting for the tide")
    assert world.count(RequestPlan) <= 8


def test_an_open_bar_that_closes_before_she_is_there_is_a_reason_to_plan_again():
    world = voyage_over_a_bar((-1000.0, 2.0), (100_000.0, 1.9))
    assert world.run(60, lambda w: w.state.voyage.sailing)
    assert closes_ahead(context(world)) is None
    world.skipper = replace(
        world.skipper,
        config=replace(
            world.skipper.config,
            tide=TideTable(
                rows=(TideRow(utc_s=UTC_S - 100.0, height_m=2.0), TideRow(utc_s=UTC_S + 80.0, height_m=0.0))
            ),
        ),
    )
    met = closes_ahead(context(world))
    assert met is not None
    assert met.name == "the bar"
    world.run(5)
    assert said(world, "tide ahead")


def test_a_place_in_water_that_has_closed_is_no_impossible_one():
    """A table closed the flat about a boat that lay in it: her position was doubted, and she circled to the ground."""
    world = voyage_over_a_bar((-1000.0, 0.0), (100_000.0, 0.0), bar=FLAT)
    world.position = (0.0, 900.0)
    now = context(world)
    assert float(now.voyage.area.clearance_m([(0.0, 900.0)])[0]) < -200.0
    assert float(now.always_solid.clearance_m([(0.0, 900.0)])[0]) > 0.0
    follow(now)
    assert now.state.position.doubt is None
    assert lacks(now) == ""


@pytest.mark.parametrize(("north_m", "leaves"), [(900.0, True), (430.0, False)])
def test_a_loiter_in_a_flat_that_dries_is_left_for_deep_water(north_m, leaves):
    """Becalmed there, it was the end of her mission, and she waited in it for the tide."""
    way = route((0.0, north_m), gate_of=(-1,))
    now = moment(way, at=(0.0, north_m), mission={"index": 0})
    voyage = replace(now.voyage, drying=(FLAT,))
    config = replace(now.config, tide=TideTable(rows=(TideRow(utc_s=0.0, height_m=0.0),)))
    now = StepContext(voyage, config, now.state, now.snapshot)
    hold(now, "no way before the tide is higher")
    sent = [a for a in now.actions if isinstance(a, UploadMission)]
    assert bool(sent) is leaves
    if leaves:
        (end,) = (item for item in sent[0].items if item.command == Command.NAV_LOITER_UNLIM)
        assert abs(voyage.frame.en_from_geo(end.point)[0]) > 400.0


def test_she_does_not_stay_in_the_middle_of_a_long_flat_and_goes_to_no_refuge_on_it():
    flat, deep = Refuge(name="flat", en_m=(0.0, 700.0)), Refuge(name="deep", en_m=(0.0, -400.0))
    world = voyage_over_a_bar((-1000.0, 2.0), (100_000.0, 1.9), bar=FLAT)
    world.skipper = replace(world.skipper, voyage=replace(world.skipper.voyage, refuges=(flat, deep)))
    world.run(60, lambda w: w.state.voyage.sailing)
    world.position = (0.0, 900.0)
    now = context(world)
    place, room_m = loiter_place(now.to_stay_in, now.config, (0.0, 900.0), 0.0)
    assert room_m > 0.0
    assert abs(place[0]) > 300.0
    assert [r.name for r in refuges_by_way(now)] == ["deep"]
    assert "which dries" in refuge_place(now, phrase(["refuge", "flat"]))
    assert refuge_place(now, phrase(["refuge", "deep"])) == ("deep", (0.0, -400.0))
    assert refuge_place(now, phrase(["refuge"])) == ("deep", (0.0, -400.0))
    status = replace(now.snapshot.autopilot, home=now.voyage.frame.geo_from_en(0.0, 800.0))
    now.snapshot = replace(now.snapshot, autopilot=status)
    assert home_trouble(now) == "home is not in free water but in the flat, which dries: the margin's floor is 8 m"


def test_her_stay_in_a_box_ends_in_time_before_it_dries():
    """She loitered in it for its 2,600 s, and grounded after 1,500."""
    stay = Goal(en_m=(0.0, 550.0), name="the box", box=Box(area_en=box(-50.0, 500.0, 50.0, 600.0), for_s=2600.0))
    home = Goal(en_m=(0.0, 300.0), radius_m=6.0, name="the goal")
    world = voyage_over_a_bar((-1000.0, 4.0), (3000.0, 0.0), bar=FLAT, goals=(stay, home))
    closes_s = FLAT.closed_s(world.skipper.config.tide, UTC_S)[0][0]
    assert world.run(1500, lambda w: said(w, "goal"))
    (told,) = [a.text for _, a in world.actions if getattr(a, "code", "") == "goal"]
    assert "the flat is about to dry" in told
    assert world.t < closes_s - 120.0
    assert world.run(600, is_done)
    assert world.state.progress.reached == (0, 1)


@pytest.mark.parametrize(
    ("north_m", "below_s", "leaves"),
    [
        (510.0, -100.0, True),
        (510.0, 200.0, False),
        (900.0, 200.0, True),
        (900.0, 1200.0, False),
        (450.0, -100.0, False),
    ],
)
def test_what_dries_is_left_sooner_the_longer_the_way_out_of_it_is(north_m, below_s, leaves):
    rows = tuple(TideRow(utc_s=t, height_m=1.0 - (t - below_s) / 3600.0) for t in (-3600.0, 0.0, 3600.0))
    now = moment(route((0.0, 400.0)))
    now = StepContext(
        replace(now.voyage, drying=(FLAT,)),
        replace(now.config, tide=TideTable(rows=rows), margin_m=10.0, margin_floor_m=10.0),
        now.state,
        now.snapshot,
    )
    now.utc_s = 0.0
    assert dries_under(now, (0.0, north_m)) == ("the flat" if leaves else "")


def test_who_steers_by_what_is_about_her_keeps_out_of_what_opens_soon():
    """For a plan it is open when she is there; by field she was taken across it twenty minutes before."""
    now = context(voyage_over_a_bar((-1000.0, 0.0), (600.0, 1.2), (100_000.0, 1.2)))
    assert float(now.voyage.area.clearance_m([(0.0, 150.0)])[0]) > 0.0
    assert float(now.water_now.area.clearance_m([(0.0, 150.0)])[0]) < 0.0
    assert float(intent(now, situation(now)).clearance(np.array([(0.0, 150.0)]))[0]) < 0.0
    soon = context(voyage_over_a_bar((-1000.0, 2.0), (0.0, 1.1), (400.0, 0.0), (100_000.0, 0.0)))
    assert float(soon.water_now.area.clearance_m([(0.0, 150.0)])[0]) < 0.0
    later = context(voyage_over_a_bar((-1000.0, 2.0), (2000.0, 2.0), (4000.0, 0.0)))
    assert float(later.water_now.area.clearance_m([(0.0, 150.0)])[0]) > 0.0


def test_a_place_to_stay_in_is_never_in_water_that_dries():
    now = context(voyage_over_a_bar((-1000.0, 2.0), (100_000.0, 1.9)))
    assert float(now.voyage.area.clearance_m([(0.0, 150.0)])[0]) > 0.0
    assert float(now.to_stay_in.area.clearance_m([(0.0, 150.0)])[0]) < 0.0


@pytest.mark.parametrize(("height_m", "is_solid"), [(0.2, True), (1.8, False)])
def test_what_is_closed_for_long_is_solid_for_all_that_looks_at_the_water(height_m, is_solid):
    now = context(voyage_over_a_bar((-1000.0, height_m), (100_000.0, height_m)))
    assert (float(now.voyage.area.clearance_m([(0.0, 150.0)])[0]) < 0.0) is is_solid


def test_the_slope_up_to_an_open_bar_is_no_alarm_and_a_sounding_is():
    world = voyage_over_a_bar((-1000.0, 2.0), (100_000.0, 2.0), least_depth_m=1.0)
    world.run(60, lambda w: w.state.voyage.sailing and w.position[1] > 60.0)
    world.shown |= {"sounds": True, "depth_m": 4.0, "depth_rate_mps": -0.3}
    now = context(world)
    now.snapshot = replace(now.snapshot, vehicle=replace(now.snapshot.vehicle, velocity_en_mps=(0.0, 6.0)))
    assert depth_ahead_m(now) == pytest.approx(BAR.room_m(2.0))
    bare = voyage_over_a_bar((-1000.0, 2.0), (100_000.0, 2.0), least_depth_m=1.0, bar=replace(BAR, opens_at_m=3.0))
    bare.state, bare.position = world.state, world.position
    bare.shown |= {"sounds": True, "depth_m": 4.0, "depth_rate_mps": -0.3}
    assert depth_ahead_m(context(bare)) == pytest.approx(4.0 - 6.0 - 1.0)
    world.shown |= {"depth_m": 0.8}
    now = context(world)
    now.snapshot = replace(now.snapshot, vehicle=replace(now.snapshot.vehicle, velocity_en_mps=(0.0, 6.0)))
    assert depth_ahead_m(now) == pytest.approx(-0.2)


def test_a_rising_tide_opens_a_shoal_that_was_sounded_again_and_a_falling_one_closes_it():
    shoal = Shoal(en_m=(0.0, 150.0), radius_m=20.0, doubt_m=3.0, depth_m=1.4, tide_m=0.5)
    untold = replace(shoal, tide_m=None)
    least_m = 2.0
    opens_m = 0.5 + 0.6 + RISES_M
    assert still_shoal((shoal, untold), opens_m - 0.01, least_m) == (shoal, untold)
    assert still_shoal((shoal, untold), opens_m, least_m) == (untold,)
    assert still_shoal((shoal, untold), None, least_m) == (shoal, untold)
    for height_m, is_solid in ((0.5, True), (opens_m + 0.1, False), (0.9, True)):
        world = voyage_over_a_bar((-1000.0, height_m), (100_000.0, height_m), bar=replace(BAR, opens_at_m=-9.0))
        world.run(1)
        world.state = replace(world.state, soundings=replace(world.state.soundings, shoals=(shoal,)))
        assert (float(context(world).voyage.area.clearance_m([(0.0, 150.0)])[0]) < 0.0) is is_solid

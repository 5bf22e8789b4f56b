"""What ends a voyage early, as the mission's ``[safety]`` says: where to, until when, and what is said of it."""

from dataclasses import replace

import pytest

from companion.safety import ENDINGS, TABLE, End
from companion.skipper.planning.diversions import announcement
from companion.skipper.step.actions import RequestPlan
from companion.skipper.step.config import Ends, SafeEnd, SkipperConfig
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import is_done, make, said
from tests.skipper.test_walk import MIDNIGHT_S
from tests.skipper.world import FRAME

FAR = Goal(en_m=(500.0, 0.0), radius_m=8.0)
REFUGE, HOME = (60.0, 90.0), (0.0, 0.0)


def under_way(ends=None, *, has_refuge=True, **config):
    world = make(
        FAR,
        obstacles=(),
        voyage={"refuges": (REFUGE,)} if has_refuge else {},
        config={"ends": ends or Ends(), **config},
    )
    world.shown["home"] = FRAME.geo_from_en(*HOME)
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.run(30)
    return world


def leak(world, *, is_wet=True):
    world.shown["sensors"] = (("LEAK", float(is_wet)),)


def night(world, *, is_dark=True):
    world.shown["utc_at_boot_s"] = MIDNIGHT_S + (0.0 if is_dark else 43_200.0)


def silence(world, *, is_silent=True):
    world.extra["shore_age_s"] = 700.0 if is_silent else 1.0


def volts(world, *, is_low=True):
    world.shown["battery_v"] = 10.4 if is_low else 12.0


CAUSES = {"leak": leak, "dark": night, "shore_lost": silence, "battery": volts}


@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize(("end", "where"), [(End.REFUGE, REFUGE), (End.HOME, HOME), (End.STAY, None), (End.SAY, None)])
def test_each_cause_leads_where_the_mission_says_and_on_when_it_is_over(cause, end, where):
    world = under_way(Ends.of(battery_v=10.5, **{cause: end}))
    here = world.position
    CAUSES[cause](world)
    if end is End.SAY:
        assert world.run(600, is_done)
        assert world.state.voyage.arrived
        return
    assert world.run(400, lambda w: "; waiting until" in w.state.why)
    assert distance_m(world.position, where or here) < (30.0 if where else 150.0)  # darkness takes half a minute
    plans = world.count(RequestPlan)
    world.run(60)
    assert world.count(RequestPlan) == plans
    CAUSES[cause](
        world,
        **{
            "leak": {"is_wet": False},
            "dark": {"is_dark": False},
            "shore_lost": {"is_silent": False},
            "battery": {"is_low": False},
        }[cause],
    )
    assert world.run(900, is_done)
    assert world.state.voyage.arrived


def test_of_two_causes_the_one_that_leads_her_says_how_long():
    world = under_way(Ends.of(dark=End.REFUGE, shore_lost=End.REFUGE))
    night(world)
    silence(world)
    assert world.run(400, lambda w: "; waiting until" in w.state.why)
    assert world.state.why.endswith("no ground station is heard; waiting until a ground station is heard")
    silence(world, is_silent=False)
    assert world.run(60, lambda w: w.state.why.endswith("it is dark; waiting until it is light"))


def test_without_a_place_to_go_to_a_leaking_boat_stays_and_one_with_an_empty_battery_sails_on():
    wet = under_way(has_refuge=False)
    leak(wet)
    assert wet.run(120, lambda w: w.state.why.startswith("staying near by: she is leaking"))
    empty = under_way(Ends.of(battery_v=10.5), has_refuge=False)
    volts(empty)
    assert empty.run(600, is_done)
    assert empty.state.voyage.arrived


def test_out_of_time_she_may_only_say_so_and_sails_on():
    world = under_way(Ends.of(out_of_time=End.SAY), voyage_timeout_s=60.0)
    assert world.run(600, is_done)
    assert world.state.voyage.arrived
    assert [": " in entry[2] for entry in said(world, "out of time")] == [False]


def test_an_order_stands_over_darkness_but_not_over_a_leak():
    world = under_way(Ends.of(dark=End.REFUGE))
    world.order("hold")
    world.run(20)
    night(world)
    world.run(60)
    assert "until told to go on" in world.state.why
    leak(world)
    assert world.run(300, lambda w: "at the refuge" in w.state.why)


def test_a_station_that_was_never_heard_and_a_clock_that_nobody_set_raise_nothing():
    world = under_way(Ends.of(dark=End.REFUGE, shore_lost=End.REFUGE))
    world.run(60)
    assert not said(world, "dark")
    assert not said(world, "shore lost")


def test_what_will_be_done_is_said_once_before_she_sails():
    world = under_way()
    world.run(300)
    [(t_s, _, text)] = said(world, "safe ends")
    assert t_s <= said(world, "under way")[0][0]
    assert "leaking: to the nearest refuge, else loiter near by" in text
    with_home = announcement(SkipperConfig(safe_end=SafeEnd.RETURN, voyage_timeout_s=60.0), world.skipper.voyage.boat)
    assert "out of time: to the nearest refuge, else home, loiter near by" in with_home


@pytest.mark.parametrize("volts", [None, 10.5])
def test_a_row_may_be_watched_only_where_a_setting_of_safety_asks_for_it(monkeypatch, volts):
    """Only keys of other tables were known: with one of ``[safety]`` the launch was a KeyError at every step."""
    monkeypatch.setitem(ENDINGS, "leaking", replace(ENDINGS["leaking"], asked_by="battery_v"))
    world = under_way(Ends.of(battery_v=volts))
    leak(world)
    world.run(30)
    assert ("leaking:" in said(world, "safe ends")[0][2]) == bool(said(world, "leaking")) == (volts is not None)


def test_every_key_that_asks_for_a_row_is_known():
    config, boat = SkipperConfig(), under_way().skipper.voyage.boat
    asked = {dog.name for dog in TABLE if not config.is_watched(dog.name, boat)}
    assert asked >= {"out of time", "strong wind", "light wind"}

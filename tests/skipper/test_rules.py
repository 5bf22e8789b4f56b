"""The skipper's face: what of a saved state is taken up, what is saved, when a passage's frame is left, one step."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from companion.boat import Afloat
from companion.orders import Verb
from companion.skipper import rules
from companion.skipper.planning.ladder import rungs
from companion.skipper.rules import Skipper
from companion.skipper.step import SkipperConfig
from companion.skipper.step.saved import Persisted, SavedPlace, Standing
from companion.skipper.step.state import Fix
from companion.skipper.way.position_plausibility import PositionDoubt
from companion.skipper.way.voyage import Goal
from tests.skipper.moments import GOALS, NOW_S, asked_for, moment, route
from tests.skipper.world import FRAME, voyage, with_parts

WAY = route((300.0, 0.0), (0.0, 600.0), (0.0, 600.0), gate_of=(-1, 0, -1))
LAST = route((300.0, 0.0), (600.0, 600.0), (600.0, 600.0), gate_of=(-1, 1, -1))


def skipper(**config):
    return Skipper(voyage=voyage(*GOALS), config=SkipperConfig(**config))


def saved(**changes):
    told = {"voyage": "test", "gate": 1, "sailing": True, "route": WAY, "pending": None}
    return Persisted(**(told | changes))


# ------------------------------------------------------------------------------------------------- taken up
def test_all_that_is_saved_is_taken_up_and_waits_for_the_mission_that_is_on_board():
    place = SavedPlace(utc_s=5.0, en_m=(1.0, 2.0), velocity_en_mps=(0.5, 0.0))
    before = saved(
        uid="5a",
        system=3,
        under_way_s=120.0,
        arrived=True,
        set_sail_utc_s=99.0,
        standing=Standing(verb=Verb.HOLD, by="crew", name="here", since_s=0.0),
        skipped=2,
        place=place,
        tacks=(7, 3),
        irons_s=12.0,
        lee_mps=(0.4, 0.6),
    )
    state = skipper().initial(before, ("hash",))
    assert (state.vehicle.uid, state.vehicle.system, state.vehicle.is_ours) == ("5a", 3, False)
    assert (state.mission.adoptable, state.mission.known, state.mission.route) == (before, ("hash",), None)
    assert (state.voyage.under_way_s, state.voyage.arrived, state.voyage.set_sail_utc_s) == (120.0, True, 99.0)
    assert (state.orders.standing, state.orders.skipped) == (before.standing, 2)
    assert (state.position.place, state.position.restored) == (place, place)
    tacking = state.tacking
    assert (tacking.tried, tacking.failed, tacking.irons_s) == (7, 3, 12.0)
    assert (tacking.starboard_lee_mps, tacking.port_lee_mps) == (0.4, 0.6)
    assert (state.plans.latency, state.soundings.shoals) == (before.latency, before.shoals)
    assert state.afloat == Afloat.of(before.afloat)


def test_of_another_voyage_only_the_names_of_its_lists_are_kept():
    state = skipper().initial(saved(voyage="another"), ("hash",))
    assert state.mission.adoptable is None
    assert state.mission.known == ("hash", *saved().names)
    assert "another voyage" in state.why
    assert skipper().initial(None, ("hash",)).mission.known == ("hash",)


@pytest.mark.parametrize(
    ("changes", "fits"),
    [
        ({}, True),
        ({"gate": 2}, True),  # past the last of two
        ({"gate": 3}, False),
        ({"voyage": "another"}, False),
        ({"route": LAST}, True),
        ({"pending": replace(LAST, gate_of=(-1, 2, -1))}, False),  # it counts for a gate that there is not
        ({"unsure": replace(LAST, gate_of=(2, -1, -1))}, False),
        ({"route": None, "gate": 0}, True),
    ],
)
@pytest.mark.parametrize("arrived", [False, True])
def test_a_saved_state_fits_the_voyage_by_name_and_gates(changes, fits, arrived):
    before = saved(arrived=arrived, **changes)
    assert skipper().fits(before) is fits
    assert skipper().has_arrived(before) is (fits and arrived)


# ----------------------------------------------------------------------------------------------------- saved
@pytest.mark.parametrize(
    ("mission", "is_the_old"),
    [
        ({"checked": False, "foreign": ""}, True),  # nothing is known of what is on board: what was saved stays
        ({"checked": True, "foreign": "theirs"}, True),
        ({"checked": True, "foreign": ""}, False),
    ],
)
def test_what_was_saved_stays_until_the_mission_on_board_is_known(mission, is_the_old):
    before = saved(gate=2, skipped=1)
    state = with_parts(skipper().initial(before), mission=mission, orders={"skipped": 5})
    kept = skipper().persisted(state)
    assert (kept.gate == 2) is is_the_old
    assert kept.skipped == 5
    assert kept.voyage == "test"
    assert kept.water == FRAME.origin
    fresh = skipper().persisted(with_parts(skipper().initial(), progress={"gate": 1}))
    assert (fresh.gate, fresh.voyage) == (1, "test")


@pytest.mark.parametrize("checked", [False, True])
def test_it_is_saved_with_the_water_that_its_metres_are_of(checked):
    passage = replace(skipper(), voyage=replace(voyage(*GOALS), recentre_m=1000.0))
    state = with_parts(passage.initial(saved()), mission={"checked": checked})
    assert passage.persisted(state).water == FRAME.origin


# ---------------------------------------------------------------------------------------------- another water
def leaves(en_m, *, recentre_m=1000.0, last=None, plan=None, doubt=None):
    ctx = moment(WAY)
    passage = Skipper(voyage=replace(ctx.voyage, recentre_m=recentre_m), config=ctx.config)
    state = with_parts(ctx.state, pending={"plan": plan}, position={"doubt": doubt, "last_seen": last})
    return passage.leaves_water(state, FRAME.geo_from_en(*en_m))


DOUBT = PositionDoubt(
    since_s=0.0, t_s=0.0, reckoned_en_m=(0.0, 0.0), velocity_en_mps=(0.0, 0.0), settled_s=0.0, why="it jumped"
)


def fix(en_m):
    return Fix(t_s=NOW_S, en_m=en_m)


def test_a_frame_is_left_when_she_is_farther_from_its_origin_than_it_serves():
    assert leaves((1001.0, 0.0))
    assert leaves((-800.0, 700.0))
    assert not leaves((999.0, 0.0))
    assert not leaves((5000.0, 0.0), recentre_m=None)
    assert leaves((1001.0, 0.0), last=fix((999.0, 0.0)))
    plan = asked_for(WAY)
    assert not leaves((1001.0, 0.0), plan=plan)  # it would come in the metres of this one
    assert not leaves((1001.0, 0.0), last=fix((1000.0, 0.0)), doubt=DOUBT)
    assert not leaves((3001.0, 0.0), last=fix((2000.0, 0.0)))  # a place that has just jumped
    assert leaves((2900.0, 0.0), last=fix((2000.0, 0.0)))


def test_the_state_is_carried_into_the_metres_of_another_frame():
    ctx = moment(WAY, position={"last_seen": fix((10.0, 20.0))})
    old = Skipper(voyage=ctx.voyage, config=ctx.config)
    frame = type(FRAME)(FRAME.geo_from_en(1000.0, 0.0))
    new, state = old.in_water(replace(ctx.voyage, frame=frame), ctx.state)
    assert new.voyage.frame is frame
    assert state.position.last_seen.en_m == pytest.approx((-990.0, 20.0), abs=0.3)
    assert state.mission.route.points_en_m[0] == pytest.approx((-700.0, 0.0), abs=0.2)


# ---------------------------------------------------------------------------------------------------- one step
def test_before_sailing_the_obstacles_are_grown_by_every_margin_of_the_first_plans():
    asked = []

    class Area:
        def obstacles_wkt(self, margin_m):
            asked.append(margin_m)
            return []

        def clearance_m(self, points):
            asked.append(points)
            return [math.inf]

    made = replace(skipper(), voyage=replace(voyage(*GOALS), area=Area()))
    made.prepare()
    margins = {0.0} | {step.margin_m for track_m in (2.0, 2.5) for step in rungs(made.config, track_m=track_m)}
    assert asked == [*sorted(margins), [(0.0, 0.0)]]
    assert len(margins) > 3


OBSERVED = (
    "judge",
    "take_events",
    "follow",
    "take_outcomes",
    "follow_stops",
    "follow_answer",
    "follow_ground",
    "follow_field",
    "locate",
    "look_out",
    "count_time",
    "follow_charge",
    "watch_water",
    "watch_tacks",
    "learn_boat",
    "watch",
    "follow_soundings",
    "take_orders",
)


@pytest.mark.parametrize("rebooted", [False, True])
def test_a_step_takes_everything_in_and_then_acts_once(monkeypatch, rebooted):
    done = []
    for name in (*OBSERVED, "begin_again", "act", "speak_of_stop", "speak_of_fence", "remember_fix"):
        monkeypatch.setattr(rules, name, lambda _, name=name: done.append(name))
    ctx = moment(WAY, vehicle={"is_ours": True, "rebooted": rebooted})
    Skipper(voyage=ctx.voyage, config=ctx.config).step(ctx.state, ctx.snapshot)
    again = ["begin_again"] if rebooted else []
    assert done == [*OBSERVED, *again, "act", "speak_of_stop", "speak_of_fence", "remember_fix"]


def test_a_step_returns_what_it_made_of_the_state():
    ctx = moment(WAY, goals=(Goal(en_m=(0.0, 600.0)),))
    state, actions = Skipper(voyage=ctx.voyage, config=ctx.config).step(ctx.state, ctx.snapshot)
    assert state is not ctx.state
    assert state.position.last_seen.en_m == (0.0, 0.0)
    assert isinstance(actions, tuple)

"""Behaviors in their order: the page tells it, and where two neighbours would act, the first does."""

import copy
import math
from dataclasses import replace
from itertools import pairwise

import pytest
import shapely

from companion.current import VaneError
from companion.messages import Mode
from companion.orders import Verb
from companion.skipper import priorities
from companion.skipper.behaviors.shoaling import BACK
from companion.skipper.priorities import BEHAVIORS, act
from companion.skipper.step.context import StepContext
from companion.skipper.step.saved import Standing
from companion.skipper.step.snapshot import WindBefore
from companion.skipper.step.state import Phase, PositionDoubt, Raised, Stop
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.test_voyage import ISLANDS
from tests.skipper.test_walk import on_collision_course, states
from tests.skipper.world import with_parts

WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))
NAMES = [behavior.name for behavior in BEHAVIORS]
PAIRS = list(pairwise(NAMES))

STRANGE = {"vehicle": {"is_ours": False}}
HELD = {"orders": {"standing": Standing(verb=Verb.HOLD, by="crew", name="here", since_s=0.0)}}
NOTHING_LEFT = {"progress": {"gate": 99}}
ASHORE = {"mission": {"checked": True, "route": None}, "voyage": {"sailing": False}}
DOUBT = {
    "position": {
        "doubt": PositionDoubt(
            since_s=0.0, t_s=0.0, settled_s=0.0, reckoned_en_m=(0.0, 0.0), velocity_en_mps=(0.0, 0.0), why="it jumped"
        )
    }
}
DRIFTS = {"alarms": {"raised": (Raised(name="drifting", since_s=0.0),)}}
LIES_DEAD, UNSEEN = {"vane": {"stuck_s": 0.0}}, {"position": {"last_seen": None}}
IN_LOITER, IN_GUIDED = {"steering": {"own_mode": Mode.LOITER}}, {"steering": {"own_mode": Mode.GUIDED}}
IN_IRONS = {"steering": {"until_s": 1e9, "heading_rad": 0.0, "own_mode": Mode.GUIDED}}


def showing(**status):
    return lambda s, state: replace(s, autopilot=replace(s.autopilot, **status))


def silent(s, state):
    return replace(s, heartbeat_age_s=None)


def unsure(s, state):
    return replace(s, unsure="the wind's direction leapt")


def mixed(state):
    return {"mission": {"repair": True, "unsure_route": state.mission.route}}


def before_island(s, state):
    """Put the boat 8 m off an island that lies between her and her waypoint, under way to it, the wind not known."""
    there = state.mission.route.points_en_m[state.mission.index]
    island = min(ISLANDS, key=lambda p: p.distance(shapely.Point(there)))
    east, north = island.centroid.x - there[0], island.centroid.y - there[1]
    far_m = math.hypot(east, north)
    off_m = next(
        m
        for m in range(500)
        if island.distance(shapely.Point(there[0] + east * (1.0 + m / far_m), there[1] + north * (1.0 + m / far_m)))
        > 8.0
        and m > 5
    )
    here = (there[0] + east * (1.0 + off_m / far_m), there[1] + north * (1.0 + off_m / far_m))
    return replace(unsure(s, state), position_en_m=here, vehicle=replace(s.vehicle, velocity_en_mps=(0.0, 3.0)))


def south_of_island(s, state):
    """Put the boat in a loiter 30 m to windward of an island's end, in a wind from the south that is told as west."""
    island = min(ISLANDS, key=lambda p: p.distance(shapely.Point(s.position_en_m)))
    west, south, _, _ = island.bounds
    held = showing(mode=Mode.LOITER)(unsure(s, state), state)
    return replace(
        held,
        position_en_m=(west + 6.0, south - 30.0),
        wind_before=WindBefore(twd_from_rad=math.pi, tws_mps=5.0, turned_rad=math.pi / 2.0),
    )


def vane_turned(s, state):
    """Hold the boat as ``south_of_island``, with a vane that her motion says is turned, and may be put right."""
    turned = VaneError(off_rad=math.pi / 2.0, sigma_rad=0.2, is_sure=True)
    may = replace(s.permissions, may_trim_vane=True)
    return replace(south_of_island(s, state), vane=turned, vane_offset_rad=0.0, permissions=may)


def homeward_over_island(s, state):
    here = s.position_en_m
    island = min(ISLANDS, key=lambda p: p.distance(shapely.Point(here)))
    bearing = math.atan2(island.centroid.x - here[0], island.centroid.y - here[1])
    way = showing(mode=Mode.RTL, waypoint_distance_m=2000.0, target_bearing_rad=bearing)(s, state)
    return replace(
        way,
        permissions=replace(s.permissions, may_upload=False),
        vehicle=replace(s.vehicle, velocity_en_mps=(9.0, 9.0)),
    )


def going_back(state):
    """Be on the way back from water that shoals."""
    return {
        "mission": {"route": replace(state.mission.route, rung=BACK)},
        "soundings": {"turned_en_m": (0.0, 0.0), "turned_s": 1e9},
        "position": {"last_seen": None},
    }


# (first, second) -> the state of tests.skipper.test_walk, the parts that are changed in it, what is seen
SITUATIONS = {
    ("await autopilot", "stand by"): ("standard", STRANGE, silent),
    ("stand by", "given up"): ("given up", STRANGE, None),
    ("keep off", "operator"): (
        "operator",
        {"operator": {"stop": Stop(t_s=0.0, before_s=0.0, mode=Mode.RTL, is_armed=True, cause="battery")}},
        homeward_over_island,
    ),
    ("operator", "await mission"): ("operator", {"mission": {"checked": False, "read_since_s": 1e9}}, None),
    ("await mission", "held ashore"): ("waiting", HELD | {"mission": {"checked": False, "read_since_s": 1e9}}, None),
    ("held ashore", "await start"): ("waiting", HELD | NOTHING_LEFT | ASHORE, None),
    ("await start", "first plan"): ("waiting", NOTHING_LEFT | ASHORE, None),
    ("first plan", "set sail"): ("waiting", ASHORE, None),
    ("set sail", "stand off"): (
        "standard",
        DOUBT | IN_LOITER | {"voyage": {"sailing": False}},
        showing(mode=Mode.LOITER),
    ),
    ("stand off", "trim the vane"): (
        "standard",
        {"position": DOUBT["position"] | UNSEEN["position"]} | IN_LOITER | LIES_DEAD,
        vane_turned,
    ),
    ("trim the vane", "seek sea room"): ("standard", IN_LOITER | LIES_DEAD | UNSEEN, vane_turned),
    ("seek sea room", "stop a drift"): ("standard", IN_LOITER | DRIFTS | UNSEEN, south_of_island),
    ("stop a drift", "rest"): ("done", IN_LOITER | DRIFTS, showing(mode=Mode.LOITER)),
    ("rest", "hold"): ("done", {}, unsure),
    ("hold", "turn back"): ("standard", going_back, unsure),
    ("turn back", "brake"): ("standard", going_back, lambda s, state: replace(before_island(s, state), unsure="")),
    ("sail on", "last resort"): ("last resort", IN_LOITER, showing(mode=Mode.LOITER)),
    ("last resort", "lie at diversion"): (
        "holding",
        {"alarms": {"raised": (Raised(name="vessel too near", since_s=0.0),)}},
        lambda s, state: replace(s, traffic=on_collision_course(s)),
    ),
    ("lie at diversion", "bear away"): ("holding", IN_IRONS, showing(mode=Mode.GUIDED)),
    ("bear away", "give back helm"): ("standard", IN_IRONS, showing(mode=Mode.GUIDED)),
    ("give back helm", "repair"): ("standard", lambda state: IN_GUIDED | mixed(state), showing(mode=Mode.GUIDED)),
    ("repair", "follow route"): ("standard", mixed, None),
}
# Neighbours that never both have something to do.
NEVER_BOTH = {
    ("given up", "keep off"): "nothing is asked of a boat that was given up",
    ("brake", "sail on"): "one is for a boat that is sailed, the other for one that shows a stop",
}


def situation(pair):
    name, parts, seen = SITUATIONS[pair]
    skipper, state, snapshot = states()[name]
    state = with_parts(state, **(parts(state) if callable(parts) else parts))
    return StepContext(skipper.voyage, skipper.config, state, snapshot if seen is None else seen(snapshot, state))


def after(ctx, do):
    """Return whether something acts, and what comes of it; the turn stays as it is."""
    trial = copy.copy(ctx)
    trial.actions = list(ctx.actions)
    return do(trial), (trial.state.phase, trial.state.why, [type(action) for action in trial.actions])


def test_of_every_two_neighbours_it_is_known_whether_their_order_matters():
    assert sorted(PAIRS) == sorted([*SITUATIONS, *NEVER_BOTH])
    assert len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize("pair", SITUATIONS, ids=" before ".join)
def test_of_two_neighbours_that_would_act_the_first_does(pair):
    ctx, by_name = situation(pair), {behavior.name: behavior for behavior in BEHAVIORS}
    (does_first, first), (does_second, second) = (after(ctx, by_name[name].act) for name in pair)
    assert does_first
    assert does_second
    assert first != second
    assert after(ctx, act)[1] == first


@pytest.mark.parametrize(("sailing", "phase"), [(True, Phase.STANDARD), (False, Phase.WAITING)])
def test_an_autopilot_that_is_not_heard_is_waited_for_and_what_sails_sails_on(sailing, phase):
    ctx = moment(WAY, voyage={"sailing": sailing}, seen={"heartbeat_age_s": 9.0})
    assert BEHAVIORS[0].act(ctx)
    assert (ctx.state.phase, ctx.actions) == (phase, [])
    assert "silent for 9 s" in ctx.state.why
    assert not BEHAVIORS[0].act(moment(WAY))


@pytest.mark.parametrize(("is_back", "foreign", "brakes"), [(True, "", 1), (False, "", 0), (True, "theirs", 0)])
def test_while_the_mission_is_not_known_a_boat_that_was_given_back_is_stopped_before_something(
    is_back, foreign, brakes, monkeypatch
):
    called = []
    monkeypatch.setattr(priorities, "brakes", called.append)
    ctx = moment(WAY, mission={"route": WAY, "foreign": foreign}, operator={"is_back": is_back})
    assert priorities._await_mission(ctx)
    assert len(called) == brakes
    known = moment(WAY, mission={"route": WAY, "checked": True, "read_t_s": NOW_S}, operator={"is_back": True})
    known.snapshot = replace(known.snapshot, autopilot=replace(known.snapshot.autopilot, mission_total=3))
    assert not priorities._await_mission(known)
    assert len(called) == brakes


def test_each_wait_has_the_step_only_while_it_waits():
    assert priorities._await_next_start(moment(WAY, voyage={"sailing": False}, progress={"gate": 2}))
    assert not priorities._await_next_start(moment(WAY, progress={"gate": 2}))
    assert not priorities._await_next_start(moment(WAY, voyage={"sailing": False}))
    assert priorities._get_first_plan(moment(None))
    assert not priorities._get_first_plan(moment(WAY))
    assert priorities._set_sail(moment(WAY, voyage={"sailing": False}))
    assert not priorities._set_sail(moment(WAY))


def test_the_last_always_acts():
    ctx = situation(("repair", "follow route"))
    assert BEHAVIORS[-1].act(ctx)

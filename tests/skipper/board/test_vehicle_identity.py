"""Whose boat: no order before the autopilot is known to be ours, none after it is another; reads are read twice."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from companion.mavlink.vehicle_identity import Identity
from companion.messages import MissionItem, Mode
from companion.skipper.step import actions as act
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from tests.skipper.test_voyage import is_done, is_sailing, make, said
from tests.skipper.world import with_parts

ORDERS = (act.UploadMission, act.SetMode, act.Arm, act.SetCurrent, act.SteerHeading)
THEIRS = (MissionItem(command=16, lat_e7=511_010_000, lon_e7=-13_000_000), MissionItem(command=20))


def orders(world):
    return sum(world.count(kind) for kind in ORDERS)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"is_confirmed": False}, "waiting for the autopilot to tell who it is"),
        ({"frame_class": None}, "waiting for the autopilot to tell its frame"),
        ({"frame_class": 1}, "FRAME_CLASS is 1, not a boat's: set it to 2"),
        ({"sails": False}, 'SAIL_ENABLE is 0, the boat does not sail: set it to 1, or write frame = "motor"'),
        ({"vehicle_type": 2}, "the vehicle is a quadrotor, not a rover"),
        ({"is_contested": True}, "two autopilots speak with one system id"),
    ],
)
def test_nothing_is_asked_of_an_autopilot_that_is_not_known_to_be_ours(change, words):
    world = make()
    ours = world.identity
    world.identity = replace(ours, **change)
    world.run(90)
    assert words in world.state.why
    assert orders(world) == 0
    world.identity = ours
    assert world.run(120, is_sailing)


def test_a_motor_boat_is_sailed_where_the_mission_asks_for_one():
    world = make(config={"sails": False})
    world.run(90)
    assert 'frame = "sailboat"' in world.state.why
    assert orders(world) == 0
    world.identity = replace(world.identity, sails=False)
    assert world.run(120, is_sailing)


def test_another_autopilot_under_way_stops_all_orders_and_ours_takes_them_up_again():
    world = make(upload_s=4.0)
    assert world.run(300, lambda w: w.state.voyage.sailing and w.pending and w.pending[-1][1] == "upload")
    ours = world.identity
    world.identity = replace(ours, uid="77")
    before, on_board = orders(world), world.mission
    world.run(60)
    assert orders(world) == before
    assert world.mission == on_board, "an upload under way is given up"
    assert len(said(world, "not ours")) == 1, "once a minute"
    assert "UID 77, not 5a" in said(world, "not ours")[0][2]
    assert world.state.phase is Phase.OPERATOR
    world.run(10)
    assert len(said(world, "not ours")) == 2
    world.identity = replace(ours, is_confirmed=False)
    world.run(5)
    assert orders(world) == before, "nor while it is asked who it is"
    world.identity = ours
    assert world.run(1500, is_done)


def test_a_neighbour_stops_us_at_the_quay_and_not_under_way():
    world = make()
    world.extra = {"neighbours": ("system 7, surface boat",)}
    world.run(60)
    assert orders(world) == 0
    assert "--system N" in world.state.why
    world.extra = {}
    assert world.run(120, is_sailing)
    world.extra = {"neighbours": ("system 7, surface boat",)}
    assert world.run(1500, is_done)


def test_the_board_is_remembered_over_a_restart():
    world = make()
    world.run(120, is_sailing)
    persisted = world.skipper.persisted(world.state)
    saved = Persisted.from_dict(json.loads(json.dumps(persisted.to_dict())))
    assert (saved.uid, saved.system) == ("5a", 1)
    world.state = world.skipper.initial(saved)
    world.identity = replace(world.identity, uid="77")
    before = orders(world)
    world.run(60)
    assert orders(world) == before
    assert "another one than this voyage began with" in world.state.why
    world.identity = replace(world.identity, uid="5a")
    assert world.run(1500, is_done)


def test_a_forged_read_is_read_again_and_costs_nothing():
    world = make(mode=Mode.AUTO, armed=False)
    world.run(200, is_sailing)
    world.run(20)
    world.forged_reads = [THEIRS]
    # somebody finished an upload
    world.state = with_parts(world.state, mission={"checked": False, "read_since_s": world.t})
    replans = world.state.plans.replans
    world.run(15)
    assert not world.forged_reads
    assert not said(world, "foreign mission")
    assert world.state.plans.replans == replans
    assert is_sailing(world)


def test_a_mission_that_is_ours_again_is_taken_up_without_a_restart():
    world = make()
    world.run(200, is_sailing)
    ours, seq = world.mission, world.seq
    world.forged_reads = [THEIRS, THEIRS]
    world.state = with_parts(world.state, mission={"checked": False, "read_since_s": world.t})
    world.run(10)
    assert world.state.mission.foreign
    saved = world.skipper.persisted(world.state)
    assert saved.route is not None
    assert saved.route.items == ours, "what was ours is still known after a kill"
    assert (world.mission, world.seq) == (ours, seq)
    world.run(60, lambda w: not w.state.mission.foreign)
    assert not world.state.mission.foreign
    assert len(said(world, "foreign mission")) == 2, "found, and the watchdog"
    assert world.run(1500, is_done)


def test_a_strangers_mission_stays_a_strangers():
    world = make()
    world.run(200, is_sailing)
    world.install(THEIRS)
    world.state = with_parts(world.state, mission={"checked": False, "read_since_s": world.t})
    before = orders(world)
    world.run(200)
    assert world.state.mission.foreign
    assert world.mission == THEIRS
    assert orders(world) == before
    assert len(said(world, "foreign mission")) == 2, "found, and the watchdog"


def test_what_was_ours_is_given_up_when_the_strangers_mission_is_replaced():
    world = make()
    world.run(200, is_sailing)
    world.install(THEIRS)
    world.state = with_parts(world.state, mission={"checked": False, "read_since_s": world.t})
    world.run(20)
    old = world.skipper.persisted(world.state).route
    world.order("replace")
    assert world.run(60, lambda w: w.mission != THEIRS)
    world.run(5)
    saved = world.skipper.persisted(world.state)
    assert saved.route is not None
    assert saved.route.items == world.mission
    assert saved.route.items != old.items


def test_an_identity_that_differs_counts_when_it_is_told_twice():
    told = Identity().with_uid(1, "5a")
    assert (told.uid, told.is_confirmed) == ("5a", True)
    once = told.with_uid(1, "77")
    assert (once.uid, once.is_confirmed) == ("5a", False)
    assert once.with_uid(1, "5a") == told
    assert once.with_uid(1, "77").uid == "77"
    assert once.with_uid(1, "88").with_uid(1, "77").uid == "5a", "twice running"
    assert not told.doubted().is_confirmed
    assert told.doubted().with_uid(1, "5a") == told

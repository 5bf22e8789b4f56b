"""Who speaks on a link: ours by its name, or the only rover; never the first that happens to be heard."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.vehicle_identity import LISTEN_S, Census, CensusState, OtherCompanion, yields_to
from companion.mavlink.wire.frames import Codec


def beat(
    system=1,
    kind=wire.MAV_TYPE_SURFACE_BOAT,
    autopilot=wire.MAV_AUTOPILOT_ARDUPILOTMEGA,
    mode=4,
    component=1,
    armed=False,
    status=wire.MAV_STATE_ACTIVE,
):
    message = wire.MAVLink_heartbeat_message(kind, autopilot, 128 if armed else 0, mode, status, 3)
    [heard] = Codec(9, 9).feed(Codec(system, component).pack(message))
    return heard


def listened(*beats, wanted=None, until_s=LISTEN_S):
    census = Census(wanted)
    for message in beats:
        census.take(0.0, message)
    return census.choice(until_s)


def test_one_rover_alone_is_ours_after_a_while_and_not_before():
    assert listened(beat(7), until_s=LISTEN_S - 0.1).standing is CensusState.LISTENING
    choice = listened(beat(7))
    assert (choice.standing, choice.system) == (CensusState.CHOSEN, 7)


def test_several_are_listed_and_none_is_taken():
    choice = listened(beat(7, armed=True, mode=10), beat(1), beat(3, wire.MAV_TYPE_QUADROTOR))
    assert choice.standing is CensusState.REFUSED
    assert choice.system is None
    assert choice.reason == (
        "3 autopilots are heard: system 1 (surface boat, ArduPilot, HOLD, disarmed); system 3 (quadrotor, ArduPilot, "
        "mode 4, disarmed); system 7 (surface boat, ArduPilot, AUTO, armed): say which is yours, with --system N or "
        "[autopilot] system in the mission"
    )


def test_the_one_that_is_named_is_taken_at_once_whoever_else_speaks():
    choice = listened(beat(7), beat(1), wanted=1, until_s=0.0)
    assert (choice.standing, choice.system) == (CensusState.CHOSEN, 1)
    assert listened(beat(7), wanted=1).standing is CensusState.LISTENING


@pytest.mark.parametrize("wanted", [None, 1])
@pytest.mark.parametrize(
    "other",
    [
        {"kind": wire.MAV_TYPE_FIXED_WING},
        {"kind": wire.MAV_TYPE_ANTENNA_TRACKER},
        {"autopilot": wire.MAV_AUTOPILOT_PX4},
    ],
)
def test_what_is_no_rover_is_no_boat_of_ours(wanted, other):
    choice = listened(beat(**other), wanted=wanted)
    assert choice.standing is CensusState.REFUSED
    assert "not a rover" in choice.reason


@pytest.mark.parametrize(
    "other",
    [
        {"kind": wire.MAV_TYPE_GCS, "autopilot": wire.MAV_AUTOPILOT_INVALID},
        {"component": 191},
        {"system": 0},
        {"kind": wire.MAV_TYPE_ONBOARD_CONTROLLER, "autopilot": wire.MAV_AUTOPILOT_INVALID},
    ],
)
def test_stations_and_companions_are_no_autopilots(other):
    assert listened(beat(**other)).standing is CensusState.LISTENING


def test_who_has_gone_is_forgotten():
    census = Census()
    census.take(0.0, beat(7))
    census.take(20.0, beat(1))
    assert [s.system for s in census.heard(20.0)] == [1]
    assert census.neighbours(20.0, 1) == ()
    census.take(21.0, beat(7))
    assert [s.system for s in census.neighbours(21.0, 1)] == [7]


def companion_beat(token, *, status=wire.MAV_STATE_ACTIVE):
    return beat(1, wire.MAV_TYPE_ONBOARD_CONTROLLER, wire.MAV_AUTOPILOT_INVALID, token, 191, status=status)


def test_a_second_companion_counts_from_its_second_word_and_while_it_speaks():
    census = Census()
    census.take_companion(0.0, companion_beat(5))
    assert census.companion(0.5, 1) is None, "perhaps the last word of a life that ended"
    census.take_companion(1.0, companion_beat(5))
    other = census.companion(1.5, 1)
    assert (other.token, other.is_starting) == (5, False)
    assert census.companion(1.5, 2) is None
    assert census.companion(20.0, 1) is None


@pytest.mark.parametrize(
    ("token", "other", "is_starting", "yields"),
    [(5, 9, False, True), (9, 5, False, True), (5, 9, True, False), (9, 5, True, True)],
)
def test_who_starts_gives_way_to_who_sails_and_of_two_that_start_one_goes_on(token, other, is_starting, yields):
    assert yields_to(token, OtherCompanion(token=other, is_starting=is_starting, beats=2, last_s=0.0)) is yields


def test_a_ground_station_is_heard_for_a_while_and_is_no_autopilot():
    census = Census()
    assert not census.hears_station(0.0)
    census.take(0.0, beat(255, wire.MAV_TYPE_GCS, wire.MAV_AUTOPILOT_INVALID, component=190))
    assert census.hears_station(9.0)
    assert not census.hears_station(11.0)
    assert census.heard(1.0) == ()

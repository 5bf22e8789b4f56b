"""Excuses are sailed again: without the fault, and by other hands."""

import dataclasses

import msgspec
import pytest

from lab.campaigns.fault_judge import CAUSES, EXCUSES, GAINED_S, Reach, avoidable, by_hand, moments, without
from lab.campaigns.faults import BASE
from sitl.scenario.scenario import EventSpec, load_scenario

JUMP = EventSpec(at_s=100.0, kind="gps_jump", east_m=50.0, for_s=20.0)
GUST = EventSpec(at_s=50.0, kind="wind_speed", tws_mps=10.0, for_s=5.0)
KILL = EventSpec(at_s=110.0, kind="kill_companion", restart_after_s=5.0)
ALWAYS = Reach(lives=((0.0, 300.0),), link_up=((0.0, True),), operator_s=())


def scenario(*events):
    import msgspec

    return msgspec.structs.replace(load_scenario(BASE), events=tuple(sorted(events, key=lambda e: e.at_s)))


def kinds(sailed):
    return [(e.kind, e.at_s, e.mode) for e in sailed.events]


def test_every_excuse_has_a_cause():
    assert set(CAUSES) == set(EXCUSES)


def test_a_skipper_acts_soon_after_each_sign_and_before_the_contact():
    assert moments((GUST, JUMP), CAUSES["false position"], 130.0, ALWAYS) == [102.0, 122.0]
    assert moments((GUST, JUMP), CAUSES["false position"], 115.0, ALWAYS) == [102.0]
    assert moments((GUST,), CAUSES["false position"], 115.0, ALWAYS) == []


def test_of_a_jump_that_is_resisted_nothing_can_be_known_before_it_is_taken():
    resisted = msgspec.structs.replace(JUMP, is_resisted=True)
    seen = dataclasses.replace(ALWAYS, false_s=(20.0, 104.0))
    assert moments((resisted,), CAUSES["false position"], 130.0, seen) == [106.0, 122.0]
    assert moments((resisted,), CAUSES["false position"], 130.0, ALWAYS) == [122.0]


@pytest.mark.parametrize(
    ("reach", "first"),
    [
        (Reach(lives=((0.0, 300.0),), link_up=((0.0, True), (95.0, False), (108.0, True)), operator_s=()), 108.0),
        (Reach(lives=((0.0, 90.0), (105.0, 300.0)), link_up=((0.0, True),), operator_s=()), 105.0),
        (Reach(lives=((0.0, 300.0),), link_up=((0.0, True),), operator_s=((98.0, 106.0),)), 106.0),
        (Reach(lives=((0.0, 90.0),), link_up=((0.0, True),), operator_s=()), None),
    ],
)
def test_he_is_as_blind_and_as_deaf_as_the_companion(reach, first):
    assert moments((JUMP,), CAUSES["false position"], 112.0, reach) == ([] if first is None else [first])


def test_the_hand_takes_the_companions_place_for_good():
    from companion.messages import Mode

    sailed = by_hand(scenario(GUST, JUMP, KILL), 102.0, Mode.LOITER, 140.0)
    assert kinds(sailed) == [
        ("wind_speed", 50.0, None),
        ("gps_jump", 100.0, None),
        ("kill_companion", 102.0, None),
        ("mode", 102.0, "LOITER"),
    ]
    assert sailed.limit_s == 141.0
    assert kinds(by_hand(scenario(JUMP), 102.0, None, 140.0))[-1] == ("kill_companion", 102.0, None)
    assert kinds(without(scenario(GUST, JUMP), "false position")) == [("wind_speed", 50.0, None)]


def test_what_touches_without_the_fault_is_not_excused_by_it():
    why = avoidable(scenario(GUST, JUMP), "false position", 115.0, ALWAYS, lambda other: 115.0)
    assert "without that fault" in why


def test_what_another_hand_avoids_is_not_excused():
    def touches(other):
        if not any(e.kind == "gps_jump" for e in other.events):
            return None
        loiters = any(e.kind == "mode" and e.mode == "LOITER" for e in other.events)
        return 115.0 + (GAINED_S + 5.0 if loiters else 3.0)

    assert avoidable(scenario(JUMP), "false position", 115.0, ALWAYS, touches) == (
        "a skipper who loiters at 102 s touches nothing"
    )


@pytest.mark.parametrize(
    ("changes", "more", "is_helped"),
    [
        ({}, (), True),
        ({"set_auto": False}, (), False),
        ({}, (EventSpec(at_s=90.0, kind="foreign_mission"),), False),  # nothing is ordered while it is on board
        ({}, (EventSpec(at_s=110.0, kind="foreign_mission"),), True),
    ],
)
def test_the_skipper_orders_no_more_than_the_companion_may(changes, more, is_helped):
    import msgspec

    def touches(other):
        is_steered = any(e.kind == "mode" for e in other.events)
        return None if is_steered or not any(e.kind == "gps_jump" for e in other.events) else 115.0

    sailed = msgspec.structs.replace(scenario(JUMP, *more), **changes)
    assert bool(avoidable(sailed, "false position", 115.0, ALWAYS, touches)) == is_helped


def test_what_nothing_avoids_is_excused():
    def touches(other):
        return 118.0 if any(e.kind == "gps_jump" for e in other.events) else None

    assert avoidable(scenario(JUMP), "false position", 115.0, ALWAYS, touches) == ""

"""Encounters: begun by risk of collision, held to past and clear, stood on until the other evidently does not act."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from companion.traffic import SEA, Alarm, Role, Rule, TrafficPicture, assess
from companion.traffic.colregs import ACTS_RAD, HOLDING, OVER_S, act_limits, expected, follow
from companion.traffic.predict import SHIP, motion_of
from tests.traffic.conftest import own, vessel

CLEAR_M = 50.0
POWER = {"nav_status": 0, "ship_type": 70}
SAIL = {"nav_status": 8, "ship_type": 36}
WIND = 0.0


def look(held, we, ship, t_s=0.0, wind_rad=WIND):
    we, ship = replace(we, t_s=t_s), replace(ship, t_s=t_s, heard_s=t_s)
    seen = assess(we, TrafficPicture(t_s=t_s, vessels=(ship,)), SEA, wind_rad)
    return follow(held, we, seen, t_s=t_s, clearance_m=CLEAR_M, twd_from_rad=wind_rad)


def crossing(from_deg=90.0, away_s=100.0, our_mps=3.0, her_mps=5.0, miss_m=0.0, **more):
    """We sail north from (0, 0); she comes from ``from_deg`` and would meet us after ``away_s``."""
    c = math.radians(from_deg + 180.0)
    en = (miss_m - her_mps * away_s * math.sin(c), our_mps * away_s - her_mps * away_s * math.cos(c))
    return own((0.0, 0.0), 0.0, our_mps), vessel(en, math.degrees(c), her_mps, size=(10.0, 10.0, 3.0, 3.0), **more)


def test_power_that_crosses_is_stood_on_to_and_then_it_is_for_us():
    we, ship = crossing(**POWER)
    [held] = look((), we, ship)
    assert (held.encounter.rule, held.encounter.role, held.side) == (Rule.RESPONSIBILITIES, Role.STAND_ON, "starboard")
    assert held.stands_on
    assert not held.evident
    limit_s = act_limits(we, ship, CLEAR_M).act_tcpa_s
    assert 30.0 < limit_s < 60.0
    before = look((held,), *crossing(away_s=limit_s + 2.0, **POWER), t_s=1.0)
    assert before[0].stands_on
    [after] = look(before, *crossing(away_s=limit_s - 2.0, **POWER), t_s=2.0)
    assert after.must_act
    assert after.evident
    assert not after.stands_on
    # It stays so: she comes to turn too late, and we have begun.
    [late] = look((after,), *crossing(away_s=limit_s + 30.0, **POWER), t_s=3.0)
    assert late.evident


def test_who_has_turned_may_pass_nearer():
    we, ship = crossing(away_s=30.0, miss_m=60.0, **POWER)
    [held] = look((), *crossing(**POWER))
    [kept] = look((held,), we, ship, t_s=1.0)
    [turned] = look((replace(held, other_course_rad=held.other_course_rad + 1.1 * ACTS_RAD),), we, ship, t_s=1.0)
    assert 0.4 * CLEAR_M < turned.cpa_m < CLEAR_M
    assert kept.evident
    assert turned.stands_on


@pytest.mark.parametrize("miss_m", [300.0, -300.0])
def test_who_passes_clear_is_no_encounter(miss_m):
    assert look((), *crossing(miss_m=miss_m, **POWER)) == ()


def test_nobody_is_met_who_is_far_off_in_time_or_by_a_boat_that_lies_still():
    assert look((), *crossing(away_s=400.0, **POWER)) == ()
    assert look((), own(speed_mps=0.1), vessel((0.0, 200.0), 180.0, 5.0, **POWER)) == ()


@pytest.mark.parametrize(
    ("more", "rule"),
    [
        ({"nav_status": 7}, Rule.RESPONSIBILITIES),
        ({"nav_status": 2}, Rule.RESPONSIBILITIES),
        ({"nav_status": 3}, Rule.RESPONSIBILITIES),
        ({"nav_status": 4}, Rule.RESPONSIBILITIES),
        ({"ship_type": 30}, Rule.RESPONSIBILITIES),
    ],
)
def test_rule_18_b_is_given_way_to_at_once(more, rule):
    [held] = look((), *crossing(**more))
    assert held.encounter.rule is rule
    assert held.gives_way
    assert not held.stands_on


def test_an_overtaking_vessel_remains_one_until_past_and_clear():
    we = own((0.0, 0.0), 0.0, 2.0)
    [held] = look((), we, vessel((0.0, -400.0), 0.0, 6.0, **POWER))
    assert (held.encounter.rule, held.encounter.role, held.side) == (Rule.OVERTAKING, Role.STAND_ON, "astern")
    # On our beam and turning in: by bearing alone a crossing vessel, by rule 13 d not.
    [on] = look((held,), we, vessel((-150.0, 30.0), 40.0, 6.0, **POWER), t_s=50.0)
    assert on.encounter.rule is Rule.OVERTAKING
    ahead = vessel((0.0, 300.0), 0.0, 6.0, **POWER)
    [opening] = look((on,), we, ahead, t_s=100.0)
    assert opening.apart_s == 100.0
    assert look((opening,), we, ahead, t_s=100.0 + OVER_S) == ()


def test_who_turned_away_and_comes_back_is_the_same_encounter():
    we, ship = crossing(**POWER)
    [held] = look((), we, ship)
    away = replace(ship, course_rad=ship.course_rad + math.pi, heading_rad=None)
    [turned] = look((held,), we, away, t_s=10.0)
    [turned] = look((turned,), we, away, t_s=10.0 + 2.0 * OVER_S)
    assert turned.encounter == held.encounter


def test_a_change_of_course_shows_once_and_stays_shown():
    we, ship = crossing(nav_status=7)
    [held] = look((), we, ship)
    assert not held.altered
    turned = own((0.0, 0.0), 40.0, 3.0)
    [altered] = look((held,), turned, ship, t_s=1.0)
    assert altered.altered
    [back] = look((altered,), we, ship, t_s=2.0)
    assert back.altered


def test_under_sail_a_tack_is_judged_anew():
    """The wind from west: we, heading north, are on port tack; the same after our tack would be another encounter."""
    west = math.radians(270.0)
    we, ship = crossing(**SAIL, her_mps=2.0)
    [held] = look((), we, ship, wind_rad=west)
    assert held.encounter.rule is Rule.SAILING
    east = math.radians(90.0)
    [again] = look((held,), we, ship, t_s=1.0, wind_rad=east)
    assert again.tacks[0] != held.tacks[0]
    assert again.encounter != held.encounter


def power(we):
    return replace(we, is_sailing=False)


def test_under_power_a_vessel_to_port_that_does_not_act_is_not_turned_to_port_for():
    we, ship = crossing(from_deg=270.0, away_s=100.0, **POWER)
    [held] = look((), power(we), ship)
    assert (held.encounter.rule, held.encounter.role) == (Rule.CROSSING, Role.STAND_ON)
    assert not held.not_to_port  # she is stood on to
    we, ship = crossing(from_deg=270.0, away_s=25.0, **POWER)
    [now] = look((held,), power(we), ship, t_s=1.0)
    assert now.evident
    assert now.not_to_port


def test_under_power_meeting_end_on_is_no_turn_to_port():
    we, ship = own((0.0, 0.0), 0.0, 3.0), vessel((0.0, 600.0), 180.0, 3.0, **POWER)
    [held] = look((), power(we), ship)
    assert held.encounter.rule is Rule.HEAD_ON
    assert held.not_to_port
    assert held.gives_way


def test_a_vessel_of_an_unknown_kind_is_only_kept_clear_of():
    [held] = look((), *crossing())
    assert held.encounter.role is Role.KEEP_CLEAR
    assert held.must_act
    assert not held.gives_way


def test_in_an_encounter_nobody_is_expected_to_wander():
    fisher, ship = vessel(nav_status=7), vessel(**POWER)
    assert expected(fisher) == HOLDING != motion_of(fisher)
    assert expected(ship) == SHIP


def test_the_line_names_her_the_rule_and_what_we_do():
    we, ship = crossing(**POWER, name="Ferry")
    [held] = look((), we, ship)
    [one] = assess(we, TrafficPicture(t_s=0.0, vessels=(ship,)), SEA, WIND)
    text = held.sentence(one.approach)
    assert one.alarm >= Alarm.WARN
    assert text.startswith("Ferry crosses from starboard: standing on (rule 18: power gives way to sail)")


def test_a_tack_by_which_she_gives_way_relieves_her_of_nothing():
    """We are on starboard tack, she on port; she turns until the wind is on her starboard side, too: by the new tacks
    another encounter, with other roles elsewhere (`sitl encounters --kind sailing`, seed 68)."""
    wind, c = math.radians(200.0), math.radians(-10.0)
    we = own((0.0, 0.0), 90.0, 3.0)
    ship = vessel((300.0 - 300.0 * math.sin(c), -300.0 * math.cos(c)), -10.0, 3.0, **SAIL)
    [held] = look((), we, ship, wind_rad=wind)
    assert held.tacks == ("starboard", "port")
    turned = replace(ship, course_rad=math.radians(60.0), heading_rad=math.radians(60.0))
    [after] = look((held,), we, turned, t_s=1.0, wind_rad=wind)
    assert after.encounter == held.encounter
    [anew] = assess(we, TrafficPicture(t_s=0.0, vessels=(turned,)), SEA, wind)
    assert anew.encounter != held.encounter

"""Rules 12, 13 and 18 against situations drawn by hand; the wind is from north unless said."""

from __future__ import annotations

import math

import pytest

from companion.traffic import LAKE, Alarm, Role, Rule, Targets, assess, classify, cpa
from tests.traffic.conftest import FRAME, own, report, vessel

SAIL = {"nav_status": 8, "size": (5.0, 5.0, 2.0, 2.0)}


def encounter(
    ours: tuple[tuple[float, float], float],
    theirs: tuple[tuple[float, float], float],
    *,
    speed: float = 2.0,
    wind_deg: float | None = 0.0,
    is_sailing: bool = True,
    our_speed: float = 2.0,
    **more: object,
):
    we = own(ours[0], ours[1], our_speed, is_sailing=is_sailing)
    ship = vessel(theirs[0], theirs[1], speed, **more)
    return classify(we, ship, cpa(we, ship, 0.0), None if wind_deg is None else math.radians(wind_deg))


@pytest.mark.parametrize(
    ("ours", "theirs", "role"),
    [
        # We close-hauled on port tack (heading 45), she on starboard (heading 315): we give way, and the reverse.
        (((0, 0), 45), ((200, 0), 315), Role.GIVE_WAY),
        (((0, 0), 315), ((-200, 0), 45), Role.STAND_ON),
        # Both on starboard tack: windward gives way.
        (((0, 0), 280), ((-200, -150), 310), Role.GIVE_WAY),
        (((0, 0), 300), ((-60, 150), 230), Role.STAND_ON),
    ],
)
def test_rule_12(ours, theirs, role) -> None:  # type: ignore[no-untyped-def]
    e = encounter(ours, theirs, **SAIL)
    assert e.rule is Rule.SAILING, e
    assert e.role is role, e


def test_rule_12_unsure_of_her_tack_on_port() -> None:
    """She runs dead before the wind: her tack cannot be told; on port tack we give way, on starboard rules decide."""
    e = encounter(((0, 0), 60), ((150, 100), 180), **SAIL)
    assert (e.rule, e.role) == (Rule.SAILING, Role.GIVE_WAY)
    assert "unsure" in e.reason
    assert encounter(((0, 0), 60), ((150, 100), 225), wind_deg=None, **SAIL).role is Role.GIVE_WAY


def test_rule_13_overrides_sail_and_status() -> None:
    """A fast sailboat that comes up from astern keeps clear of a motor ship, and a ship from astern of us."""
    e = encounter(((0, 0), 90), ((300, 10), 90), speed=0.5, nav_status=0)
    assert (e.rule, e.role) == (Rule.OVERTAKING, Role.GIVE_WAY)
    e = encounter(((0, 0), 90), ((-500, 5), 90), speed=6.0, nav_status=7, ship_type=30)
    assert (e.rule, e.role) == (Rule.OVERTAKING, Role.STAND_ON)


@pytest.mark.parametrize("bearing", [0.0, 60.0, 100.0, 130.0, 170.0, 200.0, 240.0, 300.0])
def test_rule_13_begins_two_points_abaft_the_beam(bearing: float) -> None:
    """We stand at ``bearing`` from her bow and sail at her: we overtake from more than 112.5 degrees only."""
    b = math.radians(bearing)
    at = (300.0 * math.sin(b), 300.0 * math.cos(b))
    e = encounter((at, (bearing + 180.0) % 360.0), ((0.0, 0.0), 0.0), speed=1.0, our_speed=3.0, nav_status=0)
    overtaking = 112.5 < bearing < 247.5
    assert (e.rule is Rule.OVERTAKING) is overtaking


@pytest.mark.parametrize(
    ("more", "role"),
    [
        ({"nav_status": 0, "ship_type": 70}, Role.STAND_ON),
        ({"nav_status": 2}, Role.GIVE_WAY),
        ({"nav_status": 3}, Role.GIVE_WAY),
        ({"nav_status": 4}, Role.GIVE_WAY),
        ({"nav_status": 7}, Role.GIVE_WAY),
        ({"ship_type": 30}, Role.GIVE_WAY),
        ({}, Role.KEEP_CLEAR),
    ],
)
def test_rule_18(more: dict[str, int], role: Role) -> None:
    e = encounter(((0, 0), 90), ((400, 200), 180), speed=5.0, **more)
    assert (e.rule, e.role) == (Rule.RESPONSIBILITIES, role)


def test_under_power_we_give_way_to_sail() -> None:
    assert encounter(((0, 0), 90), ((400, 200), 180), is_sailing=False, **SAIL).role is Role.GIVE_WAY
    e = encounter(((0, 0), 0), ((0, 800), 180), is_sailing=False, nav_status=0)
    assert (e.rule, e.role) == (Rule.HEAD_ON, Role.BOTH_ALTER)
    e = encounter(((0, 0), 0), ((300, 300), 270), is_sailing=False, nav_status=0)
    assert (e.rule, e.role) == (Rule.CROSSING, Role.GIVE_WAY)
    e = encounter(((0, 0), 0), ((-300, 300), 90), is_sailing=False, nav_status=0)
    assert (e.rule, e.role) == (Rule.CROSSING, Role.STAND_ON)


def test_at_anchor_or_unknown_is_kept_clear_of() -> None:
    assert encounter(((0, 0), 0), ((0, 300), 0), speed=0.0, nav_status=1).role is Role.KEEP_CLEAR
    we, ship = own(), vessel((100.0, 100.0), None, None)
    assert classify(we, ship, cpa(we, ship, 0.0), 0.0).role is Role.KEEP_CLEAR


def test_the_status_shows_the_worst_first() -> None:
    t = Targets.empty(FRAME)
    t = t.heard(report(0.0, (3000.0, 0.0), mmsi=1, course_rad=0.0, speed_mps=5.0))
    t = t.heard(report(0.0, (0.0, 150.0), mmsi=2, course_rad=math.pi, speed_mps=5.0, nav_status=0, name="BIG"))
    seen = assess(own(), t.picture(0.0), LAKE, 0.0)
    assert [a.vessel.mmsi for a in seen] == [2, 1]
    assert seen[0].alarm >= Alarm.ACT
    assert seen[0].sentence().startswith("BIG: ")

"""The judge's own reading of the rules: by hand, against the companion's over drawn situations, and on drawn tracks."""

import ast
import math
import random
from pathlib import Path

import numpy as np
import pytest

from companion.traffic import Role, classify, cpa
from sitl.scenario import colregs
from sitl.scenario.colregs import SHIP_TYPE, STATUS, Mariner, Met, Mover, closest, duty, judge_encounter, met_by
from tests.traffic.conftest import own, vessel

CRAFTS = tuple(STATUS)


def mover(en, course_deg, speed_mps=3.0, craft="power"):
    c = math.radians(course_deg)
    return Mover(en_m=en, course_rad=c, heading_rad=c, speed_mps=speed_mps, craft=craft)


@pytest.mark.parametrize("module", [colregs])
def test_the_judge_knows_nothing_of_the_companions_rules(module):
    names = [n.module for n in ast.walk(ast.parse(Path(module.__file__).read_text())) if isinstance(n, ast.ImportFrom)]
    assert not [n for n in names if n.startswith("companion")]


@pytest.mark.parametrize(
    ("ours", "hers", "expected"),
    [
        # Wind from north. Starboard tack (heading 300) meets port tack (heading 60), and the reverse.
        (((0, 0), 300, "sail"), ((-300, 0), 60, "sail"), ("12", "second")),
        (((-300, 0), 60, "sail"), ((0, 0), 300, "sail"), ("12", "first")),
        # Both on starboard tack: who is to windward.
        (((0, 200), 250, "sail"), ((-100, 0), 300, "sail"), ("12", "first")),
        (((-100, 0), 300, "sail"), ((0, 200), 250, "sail"), ("12", "second")),
        (((0, 0), 90, "sail"), ((300, 300), 180, "power"), ("18", "second")),
        (((0, 0), 90, "sail"), ((300, 300), 180, "fishing"), ("18", "first")),
        (((0, 0), 90, "sail"), ((300, 300), 180, "not under command"), ("18", "first")),
        (((0, 0), 0, "power"), ((0, 600), 180, "power"), ("14", "both")),
        (((0, 0), 0, "power"), ((300, 300), 270, "power"), ("15", "first")),
        (((0, 0), 0, "power"), ((-300, 300), 90, "power"), ("15", "second")),
    ],
)
def test_rules_by_hand(ours, hers, expected):
    assert duty(mover(*ours[:2], craft=ours[2]), mover(*hers[:2], craft=hers[2]), 0.0) == expected


def test_overtaking_comes_before_all_others():
    fast, slow = mover((0, 0), 0, 5.0, "sail"), mover((0, 300), 0, 1.0, "power")
    assert duty(fast, slow, math.pi / 2.0) == ("13", "first")
    assert duty(slow, fast, math.pi / 2.0) == ("13", "second")


def test_the_companion_and_the_judge_agree_on_situations_drawn():
    """2000 with risk of collision, none within 3 degrees of a sector's limit or of the wind's line."""
    rng, seen, differ = random.Random(5), 0, []
    while seen < 2000:
        our_craft = rng.choice(("sail", "power"))
        ours = mover((0.0, 0.0), rng.uniform(0, 360), rng.uniform(1, 4), our_craft)
        place, course = met_by(
            ((0.0, 0.0), (ours.velocity_mps.real, ours.velocity_mps.imag)),
            rng.uniform(-180, 180),
            speed := rng.uniform(1, 8),
            rng.uniform(60, 200),
            rng.uniform(-10, 10),
        )
        hers = mover(place, math.degrees(course), speed, rng.choice(CRAFTS))
        if closest(ours, hers)[1] < 1.0 or any(
            abs(abs(colregs.bearing_off_bow_deg(a, b)) - limit) < 3.0
            for a, b in ((ours, hers), (hers, ours))
            for limit in (0.0, 6.0, 12.0, 112.5, 180.0)
        ):
            continue
        if any(abs(math.sin(m.heading_rad)) < math.sin(math.radians(13.0)) for m in (ours, hers)):
            continue  # the wind is from north
        seen += 1
        we = own((0.0, 0.0), math.degrees(ours.course_rad), ours.speed_mps, is_sailing=our_craft == "sail")
        ship = vessel(
            hers.en_m,
            math.degrees(hers.course_rad),
            hers.speed_mps,
            nav_status=STATUS[hers.craft],
            ship_type=SHIP_TYPE[hers.craft],
            size=(0.1, 0.1, 0.1, 0.1),
        )
        found = classify(we, ship, cpa(we, ship, 0.0), 0.0)
        who = {Role.GIVE_WAY: "first", Role.STAND_ON: "second", Role.BOTH_ALTER: "both"}[found.role]
        expected = duty(ours, hers, 0.0)
        if (found.rule.value, who) != expected:
            differ.append((ours, hers, found, expected))
    assert not differ, differ[:3]


# ------------------------------------------------------------------------------------------- tracks
MEET_S = 120.0


def tracks(craft, *, ours=lambda t: 0.0, hers=lambda t: 0.0, her_course=0.0, her_mps=4.0, manner="keeps"):
    """We sail east at 3 m/s, she comes from south; ``ours`` and ``hers`` are what is added to the courses [deg]."""
    t_s = np.arange(0.0, 200.0, 0.5)
    at = 3.0 * MEET_S
    our_en, her_en = (
        [(0.0, 0.0)],
        [
            (
                at - her_mps * MEET_S * math.sin(math.radians(her_course)),
                -her_mps * MEET_S * math.cos(math.radians(her_course)),
            )
        ],
    )
    headings = []
    met = Met(craft=craft, manner=manner, length_m=20.0, beam_m=5.0, heard_s=0.0)
    for t in t_s:
        c, h = math.radians(90.0 + ours(t)), math.radians(her_course + hers(t))
        headings.append(c)
        met.t_s.append(float(t))
        met.en_m.append(her_en[-1])
        our_en.append((our_en[-1][0] + 1.5 * math.sin(c), our_en[-1][1] + 1.5 * math.cos(c)))
        her_en.append((her_en[-1][0] + 0.5 * her_mps * math.sin(h), her_en[-1][1] + 0.5 * her_mps * math.cos(h)))
    return judge_encounter(
        met, list(t_s), our_en[:-1], headings, [math.radians(10.0)] * len(t_s), keep_m=50.0, our_length_m=1.0
    )


def between(first, last, deg):
    return lambda t: deg if first <= t < last else 0.0


def test_standing_on_into_a_collision_keeps_the_rule_and_not_the_distance():
    found = tracks("power")
    assert (found.duty, found.faults) == ("we stand on", ())
    assert not found.kept_distance


def test_turning_away_early_from_who_must_give_way_is_a_fault():
    found = tracks("power", ours=between(10, 60, 40.0))
    assert "did not stand on" in found.faults[0]


@pytest.mark.parametrize("start_s", [15, 18, 20])
@pytest.mark.parametrize("rate_dps", [2.0, 4.0])
def test_a_turn_by_which_less_time_seems_to_be_left_does_not_excuse_itself(start_s, rate_dps):
    """By the courses of the moment the meeting comes sooner while we turn: what counts is the first course."""
    found = tracks("power", ours=lambda t: min(150.0, rate_dps * max(0.0, t - start_s)))
    assert "did not stand on" in found.faults[0]


def test_getting_clear_of_one_who_evidently_does_not_act_is_none():
    found = tracks("power", ours=between(60, 110, 70.0))
    assert (found.duty, found.faults, found.kept_distance) == ("we stand on", (), True)


def test_turning_when_she_has_given_way_is_a_fault():
    found = tracks("power", ours=between(80, 110, 40.0), hers=between(20, 100, -60.0))
    assert "did not stand on" in found.faults[0]
    assert tracks("power", hers=between(20, 100, -60.0)).faults == ()


def test_giving_way_early_large_and_astern_is_right():
    found = tracks("fishing", ours=between(8, 60, 45.0))
    assert (found.duty, found.faults, found.crossed, found.kept_distance) == ("we give way", (), "astern", True)
    assert found.altered_deg == pytest.approx(45.0, abs=1.0)


@pytest.mark.parametrize(
    ("ours", "fault"),
    [
        (lambda t: 0.0, "not apparent"),
        (between(5, 115, 18.0), "not apparent"),
        (between(85, 130, 60.0), "late"),
        (between(8, 60, -45.0), "ahead of her bow"),
    ],
)
def test_giving_way_too_little_too_late_or_across_her_bow_is_not(ours, fault):
    speed = 3.0 if "bow" in fault else 4.0
    assert any(fault in f for f in tracks("fishing", ours=ours, her_mps=speed).faults)


def test_a_vessel_that_was_never_heard_is_not_judged():
    met = Met(craft="power", manner="keeps", length_m=20.0, beam_m=5.0)
    assert judge_encounter(met, [0.0], [(0.0, 0.0)], [0.0], [0.0], keep_m=50.0, our_length_m=1.0) is None


# ------------------------------------------------------------------------------------------ mariner
def meet(craft, manner, course_deg=90.0, react_s=80.0, mps=5.0, wind_deg=0.0):
    place, course = met_by(((0.0, 0.0), (0.0, 3.0)), course_deg, mps, 120.0, 0.0)
    one = Mariner(
        mmsi=1,
        length_m=30.0,
        craft=craft,
        manner=manner,
        react_s=react_s,
        base_rad=course,
        speed_mps=mps,
        en_m=place,
        t_s=0.0,
    )
    least, courses = math.inf, []
    for t in range(1, 240):
        ours = mover((0.0, 3.0 * t), 0.0, 3.0, "sail")
        one.watch(ours, math.radians(wind_deg), float(t))
        least = min(least, math.dist(ours.en_m, one.en_m))
        courses.append(math.degrees(one.course_rad - course))
    return least, courses


def test_where_she_is_placed_she_would_hit_us_and_by_how_much_she_misses_is_asked_for():
    assert meet("power", "keeps")[0] < 5.0
    for course in (45.0, 170.0, -90.0, 5.0):
        place, way = met_by(((0.0, 0.0), (0.0, 3.0)), course, 5.0, 100.0, 20.0)
        there = mover(place, math.degrees(way), 5.0)
        assert closest(mover((0.0, 0.0), 0.0), there) == (pytest.approx(20.0), pytest.approx(100.0))


@pytest.mark.parametrize("course_deg", [90.0, -90.0, 135.0, 180.0, 10.0])
def test_a_motor_vessel_that_keeps_the_rules_gives_way_and_comes_back(course_deg):
    least, courses = meet("power", "rules", course_deg, mps=6.0)
    assert least > 80.0
    assert max(map(abs, courses[:30])) < 1.0
    assert max(map(abs, courses)) > 40.0
    assert abs(courses[-1]) < 1.0


def test_where_it_is_for_us_she_keeps_her_course():
    assert max(map(abs, meet("fishing", "rules")[1])) < 1.0


def test_under_sail_she_does_not_turn_into_the_wind():
    """She is on port tack and gives way; close-hauled, there is one side to turn to."""
    place, course = met_by(((0.0, 0.0), (0.0, 3.0)), 55.0, 3.0, 120.0, 0.0)
    one = Mariner(
        mmsi=1,
        length_m=10.0,
        craft="sail",
        manner="rules",
        react_s=90.0,
        base_rad=course,
        speed_mps=3.0,
        en_m=place,
        t_s=0.0,
    )
    for t in range(1, 200):
        one.watch(mover((0.0, 3.0 * t), 0.0, 3.0, "sail"), 0.0, float(t))
        assert abs(math.remainder(math.degrees(one.course_rad), 360.0)) > 49.0

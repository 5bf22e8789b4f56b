"""Back over water known to be deep, and a plan with what was found."""

import json
import math
from dataclasses import replace

import pytest

from companion.current import TideRow, TideTable
from companion.orders import Result
from companion.skipper.behaviors.shoaling import BACK, deep_place
from companion.skipper.step import Persisted
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED
from companion.skipper.step.state import Sounded
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.shoals import MOST_RADIUS_M, NAME, Shoal, found, over, shoaled
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import is_done, make, said
from tests.skipper.world import with_parts

EAST = math.radians(90.0)
GOAL = Goal(en_m=(0.0, 300.0), radius_m=6.0, name="the goal")
BANK_EN, BANK_M, DEEP_M, TOP_M = (0.0, 150.0), 45.0, 9.0, 0.5


def bank_depth_m(place):
    """A cone."""
    return TOP_M + (DEEP_M - TOP_M) * min(1.0, distance_m(place, BANK_EN) / BANK_M)


def sounded(world, depth_m=bank_depth_m):
    """Let the world's autopilot tell the depth, and how it changes over the last steps."""
    depths = []

    def tell(w):
        depths.append(depth_m(w.position))
        rate = 0.0 if len(depths) < 4 else (depths[-1] - depths[-4]) / 3.0
        w.shown |= {"sounds": True, "depth_m": depths[-1], "depth_rate_mps": rate}
        return False

    return tell, depths


def voyage_over_a_bank(**how):
    return make(GOAL, obstacles=(), wind=lambda t: (EAST, 5.0), **how)


def test_she_turns_back_and_is_planned_round_what_she_found():
    world = voyage_over_a_bank()
    tell, depths = sounded(world)
    assert world.run(900, lambda w: tell(w) or is_done(w))
    assert min(depths) > 1.0
    assert said(world, "turning back")
    assert said(world, "shoal")
    assert world.state.progress.reached == (0,)
    assert all(s.radius_m <= MOST_RADIUS_M for s in world.state.soundings.shoals)


def test_the_upload_that_turns_her_ends_in_a_loiter_on_her_own_track():
    world = voyage_over_a_bank()
    tell, _ = sounded(world)
    uploads = [a for _, a in world.actions if isinstance(a, act.UploadMission)]
    assert world.run(400, lambda w: tell(w) or said(w, "turning back"))
    upload = next(a for _, a in reversed(world.actions) if isinstance(a, act.UploadMission))
    assert upload not in uploads
    route = world.state.pending.upload.route
    assert route.rung == BACK
    assert world.state.mission.route.cost_s is not None
    assert route.cost_s is None, "the old plan's"
    assert min(distance_m(s.en_m, route.points_en_m[-1]) for s in world.state.soundings.track) == 0.0
    assert distance_m(world.position, route.points_en_m[-1]) >= 25.0


def test_once_she_has_turned_the_place_abeam_is_left_for_the_way_back():
    """She held on for 25 m to the side, over water that she had never sounded, and struck the bank beside her track."""
    world = voyage_over_a_bank()
    tell, _ = sounded(world)
    assert world.run(400, lambda w: tell(w) or said(w, "turning back"))
    track_east = world.position[0]
    assert world.run(10, lambda w: tell(w) or w.state.mission.route.rung == BACK)
    items = world.state.mission.route.items
    before = len(world.actions)
    world.run(12, tell)
    asked = [a for _, a in world.actions[before:] if isinstance(a, act.SetCurrent)]
    assert [a.seq for a in asked] == [len(items)]
    aside = max(abs(east - track_east) for east, _ in world.track[-20:])
    assert aside < 15.0


def test_without_the_permission_to_upload_she_is_only_told():
    world = voyage_over_a_bank()
    tell, _ = sounded(world)
    world.run(60, lambda w: tell(w) or w.state.voyage.sailing)
    world.permissions = replace(ALL_PERMITTED, may_upload=False)
    world.run(300, lambda w: tell(w) or said(w, "shoaling"))
    before = len(world.actions)
    world.run(5, tell)
    assert not [a for _, a in world.actions[before:] if isinstance(a, act.UploadMission)]


def test_a_boat_without_a_keel_in_her_mission_remembers_no_depth():
    world = voyage_over_a_bank(config={"least_depth_m": None})
    tell, depths = sounded(world)
    assert world.run(600, lambda w: tell(w) or is_done(w))
    assert min(depths) < 2.0
    assert world.state.soundings.shoals == world.state.soundings.track == ()


def test_shoals_are_kept_over_a_restart():
    world = voyage_over_a_bank()
    tell, _ = sounded(world)
    world.run(400, lambda w: tell(w) or said(w, "turning back"))
    shoals = world.state.soundings.shoals
    assert shoals
    persisted = world.skipper.persisted(world.state)
    again = Persisted.from_dict(json.loads(json.dumps(persisted.to_dict())))
    assert again.shoals == shoals
    assert world.skipper.initial(again).soundings.shoals == shoals
    assert "shoals" not in replace(persisted, shoals=()).to_dict()


def answer(world, words):
    """Give an order and return how it is answered; its own station each time, so that it is no repetition."""
    world.order(words, by=(255, 1 + len(world.actions) % 200))
    world.step()
    return [a for _, a in world.actions if isinstance(a, act.Acknowledge)][-1]


def test_a_shoal_is_forgotten_by_order_and_a_plan_leads_over_it_again():
    """Weed or a wreck's mast that is gone closed a channel for good: no order could open it."""
    world = voyage_over_a_bank()
    assert world.run(60, lambda w: w.state.voyage.sailing)
    assert (answer(world, "forget_shoal").result, answer(world, "forget_shoal 3").result) == (
        Result.NOT_NOW,
        Result.NOT_NOW,
    )
    near = Shoal(en_m=(30.0, 80.0), radius_m=20.0, doubt_m=3.0, depth_m=1.0)
    far = Shoal(en_m=(0.0, 200.0), radius_m=30.0, doubt_m=3.0, depth_m=1.5)
    world.state = with_parts(world.state, soundings=replace(world.state.soundings, shoals=(far, near)))
    assert not answer(world, "forget_shoal 3").text.startswith("the shoal")
    assert world.state.soundings.shoals == (far, near)
    plans = len([a for _, a in world.actions if isinstance(a, act.RequestPlan)])
    done = answer(world, "forget_shoal")
    assert (done.result, world.state.soundings.shoals) == (Result.DONE, (far,))
    assert "the shoal 2 of 20 m about" in done.text
    assert done.text.endswith("1 left")
    assert world.run(10, lambda w: len([a for _, a in w.actions if isinstance(a, act.RequestPlan)]) > plans)
    assert world.skipper.persisted(world.state).shoals == (far,), "over a restart, too"
    assert answer(world, "forget_shoal 1").result is Result.DONE
    assert world.state.soundings.shoals == ()


def test_while_it_shoals_no_shoal_is_forgotten():
    world = voyage_over_a_bank()
    tell, _ = sounded(world)
    assert world.run(400, lambda w: tell(w) or said(w, "turning back"))
    known = world.state.soundings.shoals
    assert answer(world, "forget_shoal").result is Result.NOT_NOW
    assert world.state.soundings.shoals == known


def test_what_is_sounded_is_told_with_the_height_of_the_tide_where_a_table_tells_it():
    rows = tuple(TideRow(utc_s=t, height_m=1.2) for t in range(1_799_990_000, 1_800_010_000, 3600))
    world = voyage_over_a_bank(config={"tide": TideTable(rows=rows)})
    tell, _ = sounded(world)
    world.shown |= {"utc_at_boot_s": 1.8e9}
    assert world.run(400, lambda w: tell(w) or said(w, "turning back"))
    known = world.state.soundings.shoals
    assert {shoal.tide_m for shoal in known} == {1.2}
    saved = Persisted.from_dict(json.loads(json.dumps(world.skipper.persisted(world.state).to_dict())))
    assert saved.shoals == known
    with_tide = replace(known[0], tide_m=1.2)
    assert with_tide.below_datum_m(0.4) == pytest.approx(known[0].depth_m - 0.8)
    again = replace(saved, shoals=(with_tide,))
    assert Persisted.from_dict(json.loads(json.dumps(again.to_dict()))).shoals == (with_tide,)


@pytest.mark.parametrize("bad", [[1.0, 2.0], [0.0, 0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 5.0, 1e9, 1.0], "shoal"])
def test_a_damaged_shoal_is_not_believed(bad):
    world = voyage_over_a_bank()
    data = world.skipper.persisted(world.state).to_dict() | {"shoals": [bad]}
    with pytest.raises((ValueError, TypeError)):
        Persisted.from_dict(data)


def test_a_shoal_begins_where_the_slope_meets_the_least_depth():
    shoal = found((), (0.0, 0.0), course_rad=EAST, speed_mps=2.0, depth_m=4.0, rate_mps=-0.2, least_m=2.0)
    assert shoal.en_m == pytest.approx((40.0, 0.0), abs=1e-9)
    assert shoal.en_m[0] - shoal.radius_m == pytest.approx(20.0)
    assert 0.0 < shoal.doubt_m < 20.0
    assert shoal.depth_m == 2.0
    beside = found((shoal,), (0.0, 30.0), course_rad=EAST, speed_mps=2.0, depth_m=4.0, rate_mps=-0.2, least_m=2.0)
    assert beside.radius_m > shoal.radius_m
    far = found((shoal,), (0.0, 900.0), course_rad=EAST, speed_mps=2.0, depth_m=4.0, rate_mps=-0.2, least_m=2.0)
    assert far.radius_m == shoal.radius_m


def test_no_doubt_reaches_to_where_she_is():
    for depth_m in (2.0, 2.1, 3.0, 8.0):
        shoal = found((), (0.0, 0.0), course_rad=EAST, speed_mps=2.0, depth_m=depth_m, rate_mps=-0.5, least_m=2.0)
        assert distance_m((0.0, 0.0), shoal.en_m) >= shoal.radius_m + shoal.doubt_m - 1e-9


def test_a_shoal_is_no_water_and_its_doubt_is_none_either():
    area = voyage_over_a_bank(voyage={}).skipper.voyage.area
    shoal = Shoal(en_m=(50.0, 50.0), radius_m=20.0, doubt_m=5.0, depth_m=1.0)
    left = shoaled(area, (shoal, over((200.0, 0.0), 1.5)))
    assert float(left.clearance_m([(50.0, 74.9)])[0]) < 0.0 < float(left.clearance_m([(50.0, 76.0)])[0])
    assert float(left.clearance_m([(200.0, 0.0)])[0]) < 0.0
    assert NAME in left.nearest_name((50.0, 76.0))
    assert shoaled(area, ()) is area


def track(*places, depth_m=9.0):
    return tuple(Sounded(en_m=place, depth_m=depth_m) for place in places)


def test_the_deep_place_is_straight_behind_on_the_track():
    straight = track(*((0.0, 4.0 * n) for n in range(50)))
    assert 25.0 <= distance_m((0.0, 200.0), deep_place(straight, (0.0, 200.0), 2.0)) <= 80.0
    shallow = track(*((0.0, 4.0 * n) for n in range(50)), depth_m=2.2)
    assert deep_place(shallow, (0.0, 200.0), 2.0) is None
    assert deep_place((), (0.0, 0.0), 2.0) is None


def test_where_nothing_was_sounded_she_floated():
    """Of a sounder that loses two pings in three "no deep water is known behind her", and she sailed on."""
    gaps = tuple(Sounded(en_m=(0.0, 4.0 * n), depth_m=9.0 if n % 10 == 0 else None) for n in range(50))
    assert deep_place(gaps, (0.0, 200.0), 2.0) in {(0.0, 120.0), (0.0, 160.0)}
    silent = tuple(Sounded(en_m=(0.0, 4.0 * n), depth_m=None) for n in range(50))
    assert 25.0 <= distance_m((0.0, 200.0), deep_place(silent, (0.0, 200.0), 2.0)) <= 80.0
    shoal = (*silent[:40], *track(*((0.0, 4.0 * n) for n in range(40, 50)), depth_m=1.0))
    assert deep_place(shoal, (0.0, 200.0), 2.0) is None  # the way back leads over what was too shallow


def test_the_water_inside_a_bend_of_the_track_is_not_known_to_be_deep():
    bent = track(*((4.0 * n, 0.0) for n in range(20)), *((80.0, 4.0 * n) for n in range(10)))
    place = deep_place(bent, (80.0, 40.0), 2.0)
    assert place is not None
    assert place[0] > 40.0


def test_after_a_turn_the_water_that_is_known_is_beside_the_track_not_behind_on_it():
    """She has come round a loop of her own: what lies behind her was sounded before it."""
    north = track(*((0.0, 4.0 * n) for n in range(30)))
    loop = track((6.0, 118.0), (10.0, 114.0), (8.0, 110.0), (4.0, 112.0))
    assert deep_place((*north, *loop), (4.0, 114.0), 2.0) is not None


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_she_turns_away_from_the_shoal_that_was_found_before(side):
    world = make(GOAL, obstacles=(), wind=lambda t: (math.pi, 5.0))
    tell, _ = sounded(world)
    world.run(20, lambda w: tell(w) or w.state.voyage.sailing)
    beside = Shoal(en_m=(side * 75.0, 90.0), radius_m=30.0, doubt_m=5.0, depth_m=1.0)
    world.state = with_parts(world.state, soundings={"shoals": (beside,)})
    assert world.run(400, lambda w: tell(w) or said(w, "turning back"))
    route = world.state.pending.upload.route
    assert len(route.points_en_m) >= 2
    assert side * (route.points_en_m[-2][0] - world.position[0]) < 0.0


def test_where_no_deep_water_is_known_behind_her_she_is_planned_for():
    world = voyage_over_a_bank()
    tell, _ = sounded(world, lambda place: 2.3 - 0.01 * place[1])
    assert world.run(400, lambda w: tell(w) or bool(said(w, "shoaling")))
    before = len(world.actions)
    world.run(20, tell)
    assert not said(world, "turning back")
    assert [a for _, a in world.actions[before:] if isinstance(a, act.RequestPlan)]

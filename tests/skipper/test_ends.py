"""Where it ends: home, refuges, the voyage's time, the loiter that is watched, a voyage finished before."""

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.messages import GeoPoint, Mode
from companion.orders import Verb
from companion.skipper.behaviors.launch import finished
from companion.skipper.behaviors.rest import comes_to_rest, rest
from companion.skipper.planning.diversions import HOME, OFF_HOME, ROOM, after_last_goal, diversion
from companion.skipper.step import actions as act
from companion.skipper.step.config import SafeEnd
from companion.skipper.step.missions import loiter_place
from companion.skipper.step.route import DiversionKind
from companion.skipper.step.saved import Persisted, Standing
from companion.skipper.step.state import Phase, Retry
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.shortest import way_m
from companion.skipper.way.voyage import Goal
from tests.skipper.behaviors.test_failsafe import text
from tests.skipper.moments import moment
from tests.skipper.planning.test_tacks_fail import turn_of
from tests.skipper.test_voyage import is_done, make, said
from tests.skipper.world import FRAME, restarted, with_parts

ISLAND = box(-60, 80, 60, 120)
BEHIND = Goal(en_m=(0.0, 220.0), radius_m=8.0)
ASIDE = {"wind": lambda t: (1.5, 5.0)}


def homeward(home=(0.0, 0.0), goals=(BEHIND,), obstacles=(ISLAND,), **more):
    world = make(
        *goals, obstacles=obstacles, config={"safe_end": SafeEnd.RETURN, **more.pop("config", {})}, **{**ASIDE, **more}
    )
    world.shown["home"] = FRAME.geo_from_en(*home) if isinstance(home, tuple) else home
    return world


def charged(world, share):
    world.shown["battery_remaining"] = share


# ------------------------------------------------------------------------------------------------------- home
def test_the_way_home_is_planned_round_the_island_and_ends_in_a_loiter():
    world = homeward()
    assert world.run(900, is_done)
    assert world.state.voyage.arrived
    assert "; home" in world.state.why
    assert distance_m(world.position, (0.0, 0.0)) < 30.0
    assert world.clearance() > 5.0
    reasons = [a.reason for _, a in world.actions if isinstance(a, act.RequestPlan)]
    assert act.ReplanReason.NEXT_GOAL in reasons  # on from the last goal, before she is there
    world.run(60)
    assert world.state.phase is Phase.DONE


@pytest.mark.parametrize(
    ("skipped", "words"), [(0, "all 2 goals reached"), (1, "1 of 2 goals reached, 1 given up by order")]
)
def test_what_was_reached_before_this_start_is_told_as_it_was(skipped, words):
    """After a goal that was given up "all goals were reached before this start" was said."""
    ctx = moment(orders={"skipped": skipped})
    finished(ctx)
    assert ctx.state.phase is Phase.DONE
    assert ctx.state.why == f"{words} before this start; --again sails the mission again"


# ------------------------------------------------------------------------------------------- room for a loiter
# A blind creek, 26 m wide, and a bar before it, so that no straight line leads out.
CREEK = (box(-60.0, 60.0, -13.0, 380.0), box(13.0, 60.0, 60.0, 380.0), box(-60.0, 380.0, 60.0, 400.0))
BAR = box(-20.0, 36.0, 20.0, 40.0)
QUAY = Goal(en_m=(0.0, 320.0), radius_m=8.0, name="Quay")


def in_creek(goal=QUAY, obstacles=(*CREEK, BAR), **state):
    """Return a turn of a boat under way to the head of the creek, across the wind."""
    world = make(goal, obstacles=obstacles, config={"margin_m": 8.0, "margin_floor_m": 5.0}, **ASIDE)
    assert world.run(120, lambda w: w.state.voyage.sailing and w.position[1] > 10.0)
    world.state = with_parts(world.state, pending={"plan": None, "upload": None}, **state)
    return turn_of(world)


def rooms_m(ctx, place):
    return float(ctx.voyage.area.clearance_m([place])[0])


def test_behind_a_goal_without_room_for_a_loiter_a_place_with_room_is_next():
    """She circled from side to side of the creek, and touched; from its middle no straight line leads to room."""
    ctx = in_creek(progress={"gate": 1})
    bound = after_last_goal(ctx)
    assert (bound.kind, bound.name) == (DiversionKind.ROOM, ROOM)
    assert bound.why == "Quay has no room for a loiter"
    assert rooms_m(ctx, bound.en_m) >= 15.0
    assert bound.en_m[1] < 100.0  # near the mouth: beside the creek, behind its bank, is farther by water
    assert math.isfinite(way_m(ctx.voyage.area, QUAY.en_m, bound.en_m, 5.0))
    assert diversion(ctx) == bound
    tried = in_creek(progress={"gate": 1}, plans={"retry": Retry(failures=3)})
    assert after_last_goal(tried) is None  # there is no way: she rests, and tries on from there
    assert after_last_goal(in_creek(Goal(en_m=(0.0, 320.0), radius_m=8.0), obstacles=(), progress={"gate": 1})) is None


def test_she_does_not_wait_for_a_plan_where_a_loiter_has_no_room():
    at_end = in_creek(plans={"retry": Retry(failures=1)})
    end = at_end.state.mission.route.points_en_m[-1]
    index = len(at_end.state.mission.route.items) - 1
    assert diversion(at_end) is None  # she is still on her way
    narrow = in_creek(plans={"retry": Retry(failures=1)}, mission={"index": index, "own_index": index})
    narrow.set(mission=replace(narrow.state.mission, route=led_to(narrow, (0.0, 300.0))))
    waits = diversion(narrow)
    assert waits.kind is DiversionKind.ROOM
    assert rooms_m(narrow, waits.en_m) >= 15.0
    assert rooms_m(at_end, end) >= 15.0
    roomy = in_creek(plans={"retry": Retry(failures=1)}, mission={"index": index, "own_index": index})
    roomy.set(mission=replace(roomy.state.mission, route=led_to(roomy, (0.0, -60.0))))
    assert diversion(roomy) is None
    narrow.set(plans=replace(narrow.state.plans, retry=Retry()))
    assert diversion(narrow) is None  # no plan was wanting


@pytest.mark.parametrize("place", [(0.0, -60.0), (0.0, 300.0)])
def test_it_is_said_once_that_she_rests_elsewhere_now_with_room_or_without(place):
    ctx = in_creek(progress={"gate": 1}, plans={"retry": Retry(failures=3)})
    ctx.set(voyage=replace(ctx.state.voyage, over="the goal is reached", arrived=True, rest_en_m=QUAY.en_m))
    route, index = led_to(ctx, place), len(ctx.state.mission.route.items) - 1
    ctx.set(mission=replace(ctx.state.mission, route=replace(route, bound_for=ROOM), index=index, own_index=index))
    vehicle = replace(ctx.snapshot.vehicle, position=FRAME.geo_from_en(*place))
    ctx.snapshot = replace(ctx.snapshot, vehicle=vehicle, position_en_m=place)  # she lies there
    for _ in range(3):
        bound = diversion(ctx)
        assert bound is None or comes_to_rest(ctx, bound)
    assert ctx.state.voyage.over == "the goal is reached; she lies where a loiter has room"
    assert ctx.state.voyage.rest_en_m == place
    assert [a.code for a in ctx.actions if isinstance(a, act.Announce)].count("done") == 1


def test_at_home_with_the_battery_critical_the_voyages_end_is_told_once():
    world = homeward()
    assert world.run(900, is_done)
    why = world.state.voyage.over
    charged(world, 0.05)
    world.run(60)
    assert any(isinstance(a, act.Announce) and a.code == "battery critical" for _, a in world.actions)
    assert world.state.voyage.over == why
    assert [a.code for _, a in world.actions if isinstance(a, act.Announce)].count("done") == 1


def led_to(ctx, place):
    """Return the route with its loiter at ``place``."""
    route = ctx.state.mission.route
    return replace(route, points_en_m=(*route.points_en_m[:-1], place))


@pytest.mark.parametrize("tws_mps", [5.0, 12.0])
def test_the_end_has_room_for_a_loiter_in_that_wind_and_the_floor(tws_mps):
    """15 m were looked for in any wind: at 12 m/s she swings 25 m, and touched a wall 19 m off her goal 39 times."""
    wall = box(-60.0, 100.0, -19.0, 400.0)
    world = make(Goal(en_m=(0.0, 200.0), radius_m=8.0), obstacles=(wall,), wind=lambda t: (math.pi / 2.0, tws_mps))
    assert world.run(120, lambda w: w.state.voyage.sailing)
    ctx = turn_of(world)
    assert ctx.loiter_swing_m == pytest.approx({5.0: 15.3, 12.0: 26.7}[tws_mps], abs=0.1)
    [room_m] = world.skipper.voyage.area.clearance_m([ctx.state.mission.route.points_en_m[-1]])
    assert room_m >= ctx.loiter_swing_m + ctx.config.margin_floor_m - 0.5  # in whole metres


@pytest.mark.parametrize("is_ordered", [False, True])
def test_home_in_a_creek_she_goes_on_to_where_a_loiter_has_room(is_ordered):
    """She lay there, "home", and touched its sides 22 times; under the order `home` without a word."""
    ctx = in_creek(progress={"gate": 1})
    order = Standing(verb=Verb.HOME, by="crew", name="home", en_m=QUAY.en_m, since_s=0.0)
    route = replace(led_to(ctx, (0.0, 310.0)), bound_for=HOME)
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.autopilot, home=FRAME.geo_from_en(*QUAY.en_m)))
    ctx.config = replace(ctx.config, safe_end=SafeEnd.RETURN)
    ctx.set(mission=replace(ctx.state.mission, route=route, index=0))
    ctx.set(orders=replace(ctx.state.orders, standing=order if is_ordered else None))
    assert (diversion(ctx).name, diversion(ctx).kind) == (HOME, DiversionKind.HOME)  # on the way
    ctx.set(mission=replace(ctx.state.mission, index=len(route.items) - 1))
    bound = diversion(ctx)
    assert (bound.name, bound.kind, bound.is_ordered) == (OFF_HOME, DiversionKind.ROOM, is_ordered)
    assert rooms_m(ctx, bound.en_m) >= 15.0
    assert not comes_to_rest(ctx, bound)
    there = replace(led_to(ctx, bound.en_m), bound_for=OFF_HOME)
    ctx.set(mission=replace(ctx.state.mission, route=there))
    assert diversion(ctx).en_m == bound.en_m
    ctx.snapshot = replace(ctx.snapshot, position_en_m=bound.en_m)
    assert comes_to_rest(ctx, diversion(ctx))
    if is_ordered:
        assert ctx.state.why.startswith("at water with room off home: ")
    else:
        assert ctx.state.voyage.over == "the goal is reached; home; she lies where a loiter has room"


def test_the_voyage_is_over_where_its_loiter_is_and_not_before():
    """Passing home at 3.5 m/s, 90 m before her place, it was over, and then: dragged off by 97 m."""
    ctx = in_creek(progress={"gate": 1}, plans={"retry": Retry(failures=3)})
    far, near = (led_to(ctx, place) for place in ((0.0, -60.0), ctx.boat_en))
    last = len(far.items) - 1
    ctx.set(mission=replace(ctx.state.mission, route=far, index=last))
    rest(ctx)
    assert not ctx.state.voyage.over
    assert "to where she is to lie" in ctx.state.why
    ctx.set(mission=replace(ctx.state.mission, route=near, index=last))
    rest(ctx)
    off_m = distance_m(*near.points_en_m[-2:])
    assert ctx.state.voyage.over == f"the goal is reached; she lies {off_m:.0f} m off, where a loiter has room"


def test_room_all_round_comes_before_more_of_it_to_leeward_alone():
    """The place with most room to leeward lay 8 m from a bank, that with 20 m all round beside it."""
    banks = (box(-200.0, 22.0, 200.0, 60.0), box(-200.0, -60.0, 200.0, -22.0))
    ctx = in_creek(obstacles=banks)
    place, room_m = loiter_place(ctx.voyage, ctx.known_config, (0.0, 6.0), 0.0)
    assert room_m >= ctx.known_config.loiter_radius_m
    assert rooms_m(ctx, place) == pytest.approx(room_m)


def test_where_she_rests_without_room_that_is_said_and_she_goes_on_to_where_it_is():
    ctx = in_creek(progress={"gate": 1}, plans={"retry": Retry(failures=3)})
    ctx.set(mission=replace(ctx.state.mission, route=led_to(ctx, (0.0, 320.0))))
    ctx.snapshot = replace(ctx.snapshot, position_en_m=(0.0, 310.0))
    rest(ctx)
    assert ctx.state.voyage.arrived
    [text] = [a.text for a in ctx.actions if isinstance(a, act.Announce) and a.code == "no room"]
    assert text == "she loiters with 13 m of room, in this wind a loiter takes 15: take her"
    assert diversion(ctx).kind is DiversionKind.ROOM
    ctx.set(voyage=replace(ctx.state.voyage, rest_en_m=(0.0, -60.0)))
    assert diversion(ctx) is None


@pytest.mark.parametrize(
    ("home", "words"),
    [
        ((0.0, 100.0), "not in free water"),
        ((0.0, 75.0), "5 m from o0"),
        (GeoPoint(lat_deg=40.0, lon_deg=-1.3), "km from"),
        (None, "has not told where home is"),
    ],
)
def test_a_home_that_cannot_be_sailed_to_is_told_at_the_start_and_at_the_end(home, words):
    world = homeward(home)
    assert world.run(900, is_done)
    assert any(words in entry[2] for entry in said(world, "home"))
    assert words in world.state.why
    assert not world.state.voyage.arrived
    assert distance_m(world.position, BEHIND.en_m) < 40.0


QUAY_SIDE = box(-80.0, -140.0, 80.0, -109.0)
DOCK_SIDES = (box(-80.0, -140.0, -9.0, -60.0), box(9.2, -140.0, 80.0, -60.0))


@pytest.mark.parametrize(("obstacles", "is_near"), [((QUAY_SIDE,), True), (DOCK_SIDES, False)], ids=["quay", "dock"])
def test_home_by_a_quay_the_plan_ends_as_near_to_it_as_one_may_or_it_is_told(obstacles, is_near):
    """ "goal is 9.0 m from o0, and 10.4 m are kept clear of it" was said every five minutes, and she was never home."""
    floor = {"margin_m": 10.0, "margin_floor_m": 5.0}
    world = homeward((0.0, -100.0), obstacles=obstacles, wind=lambda t: (1.5, 9.0), config=floor)
    assert world.run(900, is_done)
    assert world.state.voyage.arrived is is_near
    assert ("; home" if is_near else "home is 9.0 m from o0: no plan leads nearer than 10") in world.state.why
    assert world.clearance() > 5.0


def test_without_a_plan_home_she_holds_at_the_last_goal_and_says_what_she_waits_for():
    world = homeward()
    assert world.run(300, lambda w: w.position[1] > 100.0)
    world.planner = lambda problem, seed: None
    assert world.run(300, lambda w: w.state.progress.gate == 1)
    world.run(60)
    assert world.state.phase in {Phase.HOLDING, Phase.NEW_CALCULATION}
    world.planner = None
    assert world.run(900, is_done)
    assert world.state.voyage.arrived


def test_killed_on_the_way_home_she_goes_on_and_knows_the_end():
    world = homeward()
    assert world.run(600, lambda w: w.state.progress.gate == 1)
    world.run(20)
    restarted(world)
    assert world.run(600, is_done)
    assert world.state.voyage.arrived
    restarted(world)
    world.run(10)
    assert world.state.phase is Phase.DONE
    assert world.state.voyage.home_reached


# ---------------------------------------------------------------------------------------------------- refuges
def test_the_nearest_refuge_and_on_when_the_battery_is_charged():
    world = make(Goal(en_m=(500.0, 0.0), radius_m=8.0), obstacles=(), voyage={"refuges": ((60.0, 90.0), (300.0, 60.0))})
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.run(30)
    charged(world, 0.08)
    assert world.run(300, lambda w: "at the refuge 1" in w.state.why)
    assert "until the battery is charged" in world.state.why
    assert distance_m(world.position, (60.0, 90.0)) < 30.0
    plans = world.count(act.RequestPlan)
    world.run(120)
    assert world.count(act.RequestPlan) == plans
    assert not said(world, "mission ended")
    charged(world, 0.16)
    assert world.run(600, is_done)
    assert world.state.voyage.arrived


def test_the_nearest_refuge_is_the_nearest_by_water():
    """60 m off across a spit, and 1.2 km round it: the charge would not last for that way."""
    spit = box(-600, 40, 600, 50)
    world = make(
        Goal(en_m=(500.0, 0.0), radius_m=8.0), obstacles=(spit,), voyage={"refuges": ((60.0, 90.0), (60.0, -120.0))}
    )
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.run(10)
    charged(world, 0.08)
    assert world.run(300, lambda w: "at the refuge 2" in w.state.why)
    assert not any("the refuge 1" in entry[2] for entry in said(world, "diverted"))


def test_a_refuge_without_a_way_is_passed_over_for_the_next():
    ring = box(40, 70, 80, 110).difference(box(45, 75, 75, 105))
    world = make(
        Goal(en_m=(500.0, 0.0), radius_m=8.0), obstacles=(ring,), voyage={"refuges": ((60.0, 90.0), (250.0, 60.0))}
    )
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.run(10)
    charged(world, 0.08)
    assert world.run(900, lambda w: "at the refuge 2" in w.state.why)


def test_a_critical_battery_without_a_refuge_sails_home_where_the_mission_ends_there_else_on():
    home = homeward(goals=(Goal(en_m=(500.0, 0.0), radius_m=8.0),), obstacles=())
    assert home.run(60, lambda w: w.state.voyage.sailing)
    home.run(60)
    charged(home, 0.08)
    assert home.run(300, lambda w: "at home: the battery is critical" in w.state.why)
    on = make(Goal(en_m=(300.0, 0.0), radius_m=8.0), obstacles=())
    charged(on, 0.08)
    assert on.run(600, is_done)
    assert said(on, "battery critical")


# ------------------------------------------------------------------------------------------------------- time
@pytest.mark.parametrize(
    ("more", "where"),
    [
        ({"voyage": {"refuges": ((120.0, 60.0),)}}, (120.0, 60.0)),
        ({"config": {"safe_end": SafeEnd.RETURN}}, (0.0, 0.0)),
        ({}, None),
    ],
)
def test_out_of_time_the_goals_are_given_up(more, where):
    config = {"voyage_timeout_s": 60.0, **more.pop("config", {})}
    world = make(Goal(en_m=(900.0, 0.0), radius_m=8.0), obstacles=(), config=config, **more)
    world.shown["home"] = FRAME.geo_from_en(0.0, 0.0)
    assert world.run(200, lambda w: bool(said(w, "out of time")))
    under_way_s = world.state.voyage.under_way_s
    assert under_way_s == pytest.approx(60.0, abs=2.0)
    here = world.position
    assert world.run(300, is_done)
    assert not world.state.voyage.arrived
    assert "out of time: 0 of 1 goals reached" in world.state.why
    assert distance_m(world.position, where or here) < 40.0
    world.run(60)
    assert world.state.phase is Phase.DONE


def test_the_time_under_way_survives_a_kill_to_the_minute():
    world = make(Goal(en_m=(900.0, 0.0), radius_m=8.0), obstacles=(), config={"voyage_timeout_s": 200.0})
    assert world.run(300, lambda w: w.state.voyage.under_way_s > 130.0)
    restarted(world)
    assert world.state.voyage.under_way_s == 120.0
    assert world.run(100, lambda w: bool(said(w, "out of time")))


# -------------------------------------------------------------------------------------------------- the loiter
def arrived(*goals, **more):
    world = make(*goals, **{**ASIDE, **more})
    assert world.run(900, is_done)
    return world


def test_dragged_off_behind_the_island_the_way_back_is_planned():
    world = arrived(BEHIND, obstacles=(ISLAND,))
    world.run(30)
    world.position, world.track = (0.0, 20.0), []
    world.run(60)
    asked = [a for _, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.REST]
    assert "she is off the place where she was to rest" in asked[0].text
    assert world.run(300, lambda w: distance_m(w.position, BEHIND.en_m) < 20.0 and w.state.phase is Phase.DONE)
    assert world.clearance() > 0.0


def test_off_her_station_behind_the_island_the_way_back_is_planned_at_once():
    """Led round a wall by the last resort she was given back to AUTO, "keeping station", and sailed through it."""
    world = make(BEHIND, **{**ASIDE, "obstacles": (ISLAND,), "config": {"station_s": 400.0}})
    assert world.run(900, lambda w: "keeping station" in w.state.why)
    world.run(30)
    world.position, world.track, moved_s = (0.0, 20.0), [], world.t
    world.run(5)
    asked = [a.reason for t, a in world.actions if isinstance(a, act.RequestPlan) and t >= moved_s]
    assert asked == [act.ReplanReason.NEXT_GOAL]
    assert world.run(300, lambda w: distance_m(w.position, BEHIND.en_m) < 20.0 and "keeping station" in w.state.why)
    assert world.clearance() > 0.0
    assert "waiting 400 s" not in world.state.why


@pytest.mark.parametrize("lies", ["over", "station", "hold"])
def test_given_back_behind_the_island_she_is_stopped_before_it_and_planned_round(lies):
    """The leg back to the loiter that ends a mission was looked at by nothing: from 37 m off she was sailed through."""
    world = make(BEHIND, **{**ASIDE, "obstacles": (ISLAND,), "config": {"station_s": 400.0 * (lies == "station")}})
    assert world.run(900, lambda w: is_done(w) or "keeping station" in w.state.why)
    if lies == "hold":
        world.order("hold")
    world.run(30)
    world.set_mode(Mode.MANUAL)
    world.run(5)
    world.position, world.track = (0.0, 46.0), []
    world.run(20)  # until the jump is believed
    world.set_mode(Mode.AUTO)
    world.run(300)  # held, she stays on this side of it
    assert (distance_m(world.position, BEHIND.en_m) < 40.0) is (lies != "hold")
    assert world.mode is Mode.AUTO
    assert world.clearance() > 0.0


def test_a_station_is_kept_at_the_last_goal_before_she_sails_home():
    """It was kept at home: "keeping station: waiting 165 s more, 103 m off"."""
    world = homeward(config={"station_s": 60.0})
    assert world.run(900, lambda w: "keeping station" in w.state.why)
    began = world.t
    world.run(55)
    assert distance_m(world.position, BEHIND.en_m) < 40.0
    assert world.run(900, is_done)
    assert "; home" in world.state.why
    assert world.t - began > 90.0


def test_a_restart_does_not_begin_her_station_anew():
    world = make(BEHIND, **{**ASIDE, "config": {"station_s": 200.0}})
    world.shown = {"utc_at_boot_s": 1.8e9}
    assert world.run(900, lambda w: "keeping station" in w.state.why)
    began = world.t
    world.run(120)
    restarted(world)
    assert world.run(60, lambda w: "keeping station" in w.state.why)
    assert world.run(300, is_done)
    assert 195.0 < world.t - began < 230.0


def test_ordered_elsewhere_from_a_station_and_told_to_go_on_she_goes_back_to_it():
    world = make(
        BEHIND,
        **{**ASIDE, "obstacles": (ISLAND,), "config": {"station_s": 900.0}, "voyage": {"refuges": ((120.0, 160.0),)}},
    )
    assert world.run(900, lambda w: "keeping station" in w.state.why)
    world.order("refuge")
    assert world.run(300, lambda w: "at the refuge" in w.state.why)
    world.order("go_on")
    assert world.run(300, lambda w: "keeping station" in w.state.why and distance_m(w.position, BEHIND.en_m) < 20.0)
    assert world.clearance() > 5.0


def test_dragged_off_over_clear_water_the_autopilots_loiter_goes_back_alone():
    world = arrived(BEHIND, obstacles=())
    plans = world.count(act.RequestPlan)
    world.position = (180.0, 240.0)
    world.run(40)
    assert said(world, "dragged off")
    assert world.run(200, lambda w: not w.state.alarms.raised)
    assert world.count(act.RequestPlan) == plans
    assert world.state.phase is Phase.DONE


def test_stopped_by_the_fence_at_rest_she_is_given_back_to_the_loiter():
    world = arrived(BEHIND, obstacles=())
    world.set_mode(Mode.HOLD)
    world.shown["fence_breached"] = True
    assert world.run(30, lambda w: w.mode is Mode.AUTO and w.state.phase is Phase.DONE)


def test_a_battery_that_is_critical_at_rest_leads_to_the_refuge():
    world = arrived(BEHIND, obstacles=(), voyage={"refuges": ((120.0, 160.0),)})
    charged(world, 0.05)
    assert world.run(300, lambda w: "at the refuge" in w.state.why)
    assert world.state.voyage.arrived


def test_a_person_takes_her_at_rest_and_gives_her_back():
    world = arrived(BEHIND, obstacles=())
    world.set_mode(Mode.MANUAL)
    world.run(20)
    assert world.state.phase is Phase.OPERATOR
    world.set_mode(Mode.AUTO)
    assert world.run(20, is_done)


def test_at_rest_nothing_complains_of_progress_irons_or_the_corridor():
    world = arrived(BEHIND, obstacles=())
    before = len(world.log)
    world.run(600)
    assert {entry[1] for entry in world.log[before:]} <= {"done"}


# --------------------------------------------------------------------------------------------- before sailing
def test_a_voyage_that_was_finished_before_says_so_and_asks_for_nothing():
    world = arrived(BEHIND, obstacles=())
    saved = Persisted.from_dict(world.skipper.persisted(world.state).to_dict())
    world.state, world.pending = world.skipper.initial(saved), []
    world.armed, world.mode = False, Mode.MANUAL
    plans = world.count(act.RequestPlan)
    world.run(120)
    assert "--again" in world.state.why
    assert world.count(act.RequestPlan) == plans
    assert not world.armed


def test_a_plan_that_went_stale_says_why_it_is_renewed_and_is_not_sailed():
    world = make(Goal(en_m=(0.0, 220.0), radius_m=8.0), obstacles=(ISLAND,), **ASIDE)
    world.permissions = type(world.permissions)(may_upload=True)
    assert world.run(120, lambda w: bool(w.mission) and "waiting for the operator" in w.state.why)
    # it drifted
    world.position, world.track, world.state = (0.0, 130.0), [], with_parts(world.state, position={"last_seen": None})
    world.planner = lambda problem, seed: None
    world.permissions = type(world.permissions)(may_upload=True, may_set_mode=True, may_arm=True)
    assert world.run(60, lambda w: "next try in" in w.state.why and "o0" in w.state.why)
    world.run(20)
    assert not world.armed
    world.planner = None
    assert world.run(900, is_done)
    assert world.clearance() > 0.0


def test_a_wind_that_turned_before_sailing_is_named():
    turned = [0.0]
    world = make(Goal(en_m=(300.0, 0.0), radius_m=8.0), obstacles=(), wind=lambda t: (turned[0], 5.0))
    world.permissions = type(world.permissions)(may_upload=True)
    assert world.run(120, lambda w: "waiting for the operator" in w.state.why)
    turned[0] = math.radians(60.0)
    assert world.run(200, lambda w: "the wind has turned" in w.state.why)


def test_a_monitor_that_knows_no_charge_tells_by_the_autopilots_limits():
    world = make(Goal(en_m=(500.0, 0.0), radius_m=8.0), obstacles=(), voyage={"refuges": ((60.0, 90.0),)})
    assert world.run(60, lambda w: w.state.voyage.sailing)
    world.shown["battery_failed"] = True
    text(world, "Battery 1 is low 10.40V used 0 mAh")
    world.run(15)
    assert said(world, "battery low")
    assert not said(world, "battery critical")
    text(world, "Battery 1 is critical 9.70V used 0 mAh")
    assert world.run(300, lambda w: "at the refuge 1" in w.state.why)
    world.shown["battery_failed"] = False  # changed, and the autopilot restarted
    assert world.run(600, is_done)

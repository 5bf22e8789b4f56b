"""Orders: each verb, each refusal, repetitions, two stations, restarts, and that nothing moves that may not."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.eta import PRIOR_PACE, eta_of
from companion.messages import Mode
from companion.orders import Result, Verb
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, DRY_RUN, Guidance
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import bearing_rad, distance_m
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import is_done, is_sailing, make
from tests.skipper.world import FRAME, order, restarted

A, B = Goal(en_m=(0.0, 300.0), name="A"), Goal(en_m=(250.0, 300.0), name="B")
REFUGES = ((120.0, 60.0), (-300.0, 0.0))


def sailing(*goals, refuges=(), **more):
    """Return a world some way along on its way to the first goal."""
    world = make(*(goals or (A, B)), obstacles=(), voyage={"refuges": refuges}, **more)
    world.shown["home"] = FRAME.origin
    assert world.run(120, is_sailing)
    world.run(30)
    return world


def answer(world, words, by=(255, 190)):
    """Give an order and return how it is answered."""
    world.order(words, by=by)
    world.step()
    return answers(world)[-1]


def answers(world):
    return [a for _, a in world.actions if isinstance(a, act.Acknowledge)]


def moves(world):
    """Return how often the boat was asked for something."""
    return sum(world.count(k) for k in (act.UploadMission, act.SetMode, act.Arm, act.SetCurrent, act.SteerHeading))


def said(world):
    return [a.text for _, a in world.actions if isinstance(a, act.Announce) and a.code == "order"]


def geo(east_m, north_m):
    point = FRAME.geo_from_en(east_m, north_m)
    return f"goal {point.lat_deg:.7f} {point.lon_deg:.7f}"


# -------------------------------------------------------------------------------------------- hold, go on
@pytest.mark.parametrize("guidance", list(Guidance))
def test_hold_is_here_and_lasts_until_told_to_go_on(guidance):
    world = sailing(config={"guidance": guidance})
    here = world.position
    given = answer(world, "hold")
    assert (given.result, given.system, given.component, given.command) == (Result.DONE, 255, 190, 31010)
    world.run(60)
    for _ in range(120):
        world.step()
        assert distance_m(world.position, here) < 60.0
    assert world.state.phase is Phase.HOLDING
    assert "ordered by the ground station; waiting until told to go on" in world.state.why
    assert world.state.mission.route.why.endswith("loitering in open water")
    assert world.count(act.UploadMission) == 2, "the first plan and the loiter"
    assert answer(world, "go_on").text == "the end of hold: on to A"
    assert world.run(1500, is_done)
    assert world.state.progress.reached == (0, 1)


def test_told_to_hold_a_boat_that_sails_off_is_alarmed_turned_once_and_counts_no_goal(monkeypatch):
    """A loiter dead astern: she sailed 490 m, through the fence, "staying near by", and "up reached" was said."""
    goal = Goal(en_m=(350.0, 0.0), name="A")
    world = sailing(goal)
    answer(world, "hold")
    world.run(40)
    assert world.state.why.startswith("staying near by")
    with monkeypatch.context() as stuck:
        stuck.setattr(world, "_auto", lambda _: bearing_rad(world.position, goal.en_m))
        assert world.run(120, lambda w: w.state.alarms.raised)
        assert [raised.name for raised in world.state.alarms.raised] == ["dragged off"]
        assert world.run(5, lambda w: w.mode is Mode.LOITER)
        assert "staying near by" not in world.state.why
        began_s = world.t
        assert world.run(60, lambda w: w.mode is Mode.AUTO), "what does not turn in LOITER turns nowhere"
        assert world.t - began_s > 10.0, "it is kept while she turns"
        assert world.run(120, lambda w: distance_m(w.position, goal.en_m) < 3.0)
        assert "m off the place where she is to stay: ordered by" in world.state.why
        assert [a.mode for _, a in world.actions if isinstance(a, act.SetMode)][-2:] == [Mode.LOITER, Mode.AUTO]
    assert world.run(200, lambda w: not w.state.alarms.raised)
    assert "staying near by" in world.state.why
    assert world.state.progress.reached == ()


def test_hold_where_a_loiter_takes_more_than_there_is_leads_to_water_with_room():
    """In a channel of 54 m a boat that turns by 15 degrees a second was held, "where there is room", and touched."""
    dock = (box(-200.0, -400.0, -19.0, 600.0), box(19.0, -400.0, 200.0, 600.0))
    world = make(A, obstacles=dock, wind=lambda t: (math.pi / 2, 9.0))
    assert world.run(240, lambda w: w.position[1] > 150.0)
    assert answer(world, "hold").text.startswith("to water with room: here a loiter has ")
    assert world.run(600, lambda w: "waiting until told to go on" in w.state.why)
    place = world.state.mission.route.points_en_m[-1]
    assert world.skipper.voyage.area.clearance_m([place])[0] >= 21.0
    world.run(60)
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_hold_beside_room_is_planned_to_there_and_not_turned_to_unjudged():
    """The pool is 20 m off, and the turn towards it was what there was no room for: onto the bank."""
    dock = (box(-200.0, -400.0, -19.0, 175.0), box(19.0, -400.0, 200.0, 175.0))
    world = make(A, obstacles=dock, wind=lambda t: (math.pi / 2, 9.0))
    assert world.run(240, lambda w: w.position[1] > 155.0)
    planned = world.count(act.RequestPlan)
    assert answer(world, "hold").text == f"to water with room near by, until {Verb.GO_ON}"
    assert world.run(600, lambda w: "waiting until told to go on" in w.state.why)
    assert world.count(act.RequestPlan) > planned
    assert world.state.mission.route.plan_id > 0
    assert world.skipper.voyage.area.clearance_m([world.state.mission.route.points_en_m[-1]])[0] >= 21.0


def test_hold_says_how_much_room_there_lacks_where_none_is_roomier():
    dock = (box(-1200.0, -1500.0, -19.0, 1500.0), box(19.0, -1500.0, 1200.0, 1500.0))
    world = make(A, obstacles=dock, wind=lambda t: (math.pi / 2, 9.0))
    assert world.run(240, lambda w: w.position[1] > 150.0)
    assert "m less of room than a loiter takes in this wind" in answer(world, "hold").text
    assert "where there is room" in answer(sailing(), "hold").text


def test_hold_on_the_way_to_the_loiter_that_ends_the_mission_is_here_too():
    world = sailing(A)
    world.run(600, is_done)
    place = world.state.mission.route.points_en_m[-1]
    for off_m in range(0, 95, 5):  # carried off
        world.position = (place[0] + off_m, place[1])
        world.step()
    here = world.position
    assert answer(world, "hold").result is Result.DONE
    world.run(40)
    assert distance_m(world.state.mission.route.points_en_m[-1], here) < 50.0


@pytest.mark.parametrize("verb", ["hold", "stop", "home", "refuge"])
def test_what_stands_survives_a_restart_with_its_age(verb):
    world = sailing(refuges=REFUGES)
    assert answer(world, verb).result is Result.DONE
    world.run(130)
    uploads = world.count(act.UploadMission)
    stood, number = world.state.orders.standing, world.state.mission.route.plan_id
    restarted(world)
    assert world.state.plans.made == number  # the next plan is not the first again
    world.run(60)
    after = world.state.orders.standing
    assert (after.verb, after.by, after.name, after.en_m) == (stood.verb, stood.by, stood.name, stood.en_m)
    assert 120.0 <= after.age_s(world.t) <= 195.0
    assert any("since before this start she is under an order" in text for text in said(world))
    if verb != "home":  # which she may still be sailing to
        assert world.count(act.UploadMission) == uploads, "what she holds by is on board already"
    world.run(120)
    assert world.state.phase in {Phase.HOLDING, Phase.STANDARD, Phase.WAITING, Phase.OPERATOR}
    assert answer(world, "go_on").result is Result.DONE
    assert world.run(1500, is_done)


def test_a_state_of_before_there_were_orders_still_loads():
    world = sailing()
    data = world.skipper.persisted(world.state).to_dict()
    del data["standing"], data["skipped"], data["reached"]
    old = Persisted.from_dict(data)
    assert (old.standing, old.skipped, old.reached) == (None, 0, ())


@pytest.mark.parametrize(
    "standing",
    [
        {"verb": "replan", "by": "x", "name": "", "before_s": 0.0, "en_m": None},
        {"verb": "goal", "by": "x", "name": "", "before_s": 0.0, "en_m": None},
        {"verb": "goal", "by": "x", "name": "", "before_s": 0.0, "en_m": [1e99, 0.0]},
        {"verb": "nonsense", "by": "x", "name": "", "before_s": 0.0, "en_m": None},
        {},
        7,
    ],
)
def test_a_saved_order_that_cannot_be_is_refused(standing):
    data = sailing().skipper.persisted(sailing().state).to_dict() | {"standing": standing}
    with pytest.raises(ValueError, match=r"damaged|not a valid"):
        Persisted.from_dict(data)


def test_held_ashore_she_is_not_set_sailing():
    world = make(A, obstacles=())
    world.run(5)
    assert answer(world, "hold").result is Result.DONE
    world.run(120)
    assert not world.armed
    assert world.state.phase is Phase.WAITING
    assert "held, ordered by the ground station" in world.state.why
    answer(world, "go_on")
    assert world.run(120, is_sailing)


# ------------------------------------------------------------------------------------------------ places
@pytest.mark.parametrize("guidance", list(Guidance))
def test_home_is_planned_and_stayed_at(guidance):
    world = sailing(config={"guidance": guidance})
    assert answer(world, "home").text.startswith("to home, and stay there")
    assert world.run(400, lambda w: w.state.phase is Phase.HOLDING)
    world.run(120)
    assert distance_m(world.position, (0.0, 0.0)) < 40.0
    assert not world.state.voyage.over
    answer(world, "go_on")
    assert world.run(1500, is_done)


def test_a_refuge_by_name_by_number_and_the_nearest():
    for words, place in (("refuge", REFUGES[0]), ("refuge 2", REFUGES[1]), ("refuge", REFUGES[0])):
        world = sailing(refuges=REFUGES)
        assert answer(world, words).result is Result.DONE, words
        assert world.run(600, lambda w: w.state.phase is Phase.HOLDING)
        world.run(60)
        assert distance_m(world.position, place) < 45.0


@pytest.mark.parametrize("guidance", list(Guidance))
def test_a_goal_is_sailed_to_and_the_others_follow(guidance):
    world = sailing(config={"guidance": guidance})
    given = answer(world, geo(-150.0, 150.0))
    assert given.result is Result.DONE
    assert given.text.endswith("then on to A")
    assert world.run(600, lambda w: w.state.orders.standing is None)
    assert distance_m(world.position, (-150.0, 150.0)) <= 12.0
    assert any("reached" in text and "on to A" in text for text in said(world))
    assert world.run(1500, is_done)
    assert world.state.progress.reached == (0, 1)


def test_a_second_place_takes_the_place_of_the_first():
    world = sailing()
    answer(world, geo(-150.0, 150.0))
    world.run(20)
    given = answer(world, geo(150.0, 100.0), by=(254, 190))
    assert "in place of goal" in given.text
    assert "ordered by the ground station" in given.text
    assert world.run(600, lambda w: w.state.orders.standing is None)
    assert distance_m(world.position, (150.0, 100.0)) <= 12.0


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (geo(0.0, 150.0), "not in free water"),
        (geo(0.0, 172.0), "m from o0: the margin's floor is"),
        (geo(0.0, 179.0), "the place is 9.0 m from o0: no plan leads nearer than "),
        (geo(60_000.0, 0.0), "60 km from this water"),
        ("goal -1.3 51.1", "latitude and longitude are swapped?"),
        ("refuge", "the mission has no refuge"),
    ],
)
def test_a_place_that_cannot_be_is_refused_before_anything_moves(words, reason):
    from shapely.geometry import box

    world = make(A, obstacles=(box(-20.0, 130.0, 20.0, 170.0),))
    assert world.run(120, is_sailing)
    world.run(10)
    before, standing = moves(world), world.state.orders.standing
    given = answer(world, words)
    assert given.result is Result.REFUSED
    assert reason in given.text
    assert (moves(world), world.state.orders.standing) == (before, standing)


def test_a_place_outside_the_fence_is_refused():
    from shapely.geometry import box

    world = make(A, obstacles=(), voyage={"limits": box(-400.0, -100.0, 400.0, 500.0)})
    assert world.run(120, is_sailing)
    assert "outside the fence" in answer(world, geo(600.0, 100.0)).text


def test_a_refuge_unknown_is_refused_with_those_there_are():
    world = sailing(refuges=REFUGES)
    given = answer(world, "refuge Nowhere")
    assert given.result is Result.REFUSED
    assert given.text == "the mission has no such refuge: it has 1 1, 2 2"


def test_told_to_go_on_before_a_refuge_no_time_to_it_is_told_any_more():
    """ "there in 0 s" stood beside "to A" while the plan to A was made and uploaded."""
    world = sailing(refuges=REFUGES)
    answer(world, "refuge")
    bound = "the refuge 1"
    assert world.run(
        400, lambda w: w.state.mission.route.bound_for == bound and distance_m(w.position, REFUGES[0]) < 25
    )
    assert eta_s(world) == pytest.approx(5.0, abs=4.0)
    world.plan_s = world.upload_s = 3.0
    assert answer(world, "go_on").text == "the end of refuge 1: on to A"
    told = []
    while world.state.mission.route.bound_for == bound and len(told) < 60:
        told.append(eta_s(world))
        world.step()
    assert 5 < len(told) < 60
    assert set(told) == {None}


def eta_s(world):
    """Return when she is told to be there; what is on its way to the skipper stays so."""
    pending, world.pending = world.pending, []
    eta = eta_of(world.snapshot(), world.state, world.skipper.voyage, PRIOR_PACE)
    world.pending = pending
    return eta.there_s


# ------------------------------------------------------------------------------------------------ others
def test_a_goal_is_skipped_and_the_last_is_not():
    world = sailing()
    assert answer(world, "skip_goal").text == "A is given up: on to B"
    world.run(15)
    given = answer(world, "skip_goal")
    assert given.result is Result.NOT_NOW
    assert "B is the last goal" in given.text
    assert world.run(1500, is_done)
    assert world.state.progress.reached == (1,)
    assert "1 of 2 goals reached, 1 given up by order" in world.state.voyage.over


def test_a_goal_skipped_while_she_is_held_is_told_with_what_comes_before_the_next():
    world = sailing()
    answer(world, "hold")
    assert answer(world, "skip_goal").text == "A is given up: B is next when hold ends"


def test_while_stop_stands_her_number_is_that_which_the_autopilot_sails_for():
    """The line said wp 3 of 6, and the next tack in 4 minutes, of a boat that loitered at the last."""
    world = sailing()
    answer(world, "stop")
    last = len(world.state.mission.route.items) - 1
    assert world.run(600, lambda w: w.seq == last + 1)
    world.run(8)
    assert world.state.phase is Phase.OPERATOR
    assert world.state.mission.index == last
    ended = [a.text for _, a in world.actions if isinstance(a, act.Announce) and a.code == "mission ended"]
    assert ended == ["mission ended"]  # "plan again from the boat" was said, and nothing is asked of her


def test_a_refuge_without_room_for_a_loiter_is_told_with_how_far_off_she_lies():
    refuge, banks = (0.0, -100.0), (box(-60.0, -160.0, -13.0, -40.0), box(13.0, -160.0, 60.0, -40.0))
    world = make(
        A,
        obstacles=banks,
        voyage={"refuges": (refuge,)},
        config={"margin_m": 6.0, "margin_floor_m": 3.0},
        wind=lambda t: (math.pi / 2.0, 5.0),
    )
    world.shown["home"] = FRAME.origin
    assert world.run(120, is_sailing)
    world.run(30)
    answer(world, "refuge")
    assert world.run(900, lambda w: "waiting until told" in w.state.why)
    off_m = distance_m(world.state.mission.route.points_en_m[-1], refuge)
    assert off_m > 40.0
    assert f"{off_m:.0f} m from the refuge" in world.state.why
    assert "where a loiter has room" in world.state.why


def test_a_skipped_goal_stays_skipped_after_a_restart():
    world = sailing()
    answer(world, "skip_goal")
    world.run(30)
    restarted(world)
    assert world.run(1500, is_done)
    assert world.state.orders.skipped == 1
    assert world.state.progress.reached == (1,)


def test_given_up_nothing_is_asked_of_her_until_told_to_go_on():
    world = sailing(wind=lambda t: (0.0 if t < 100.0 else 2.0, 5.0))
    answer(world, "replan")
    given = answer(world, "stop")
    assert given.result is Result.DONE
    before = moves(world)
    world.run(200)
    assert moves(world) == before
    assert world.count(act.RequestPlan) == len([a for _, a in world.actions if isinstance(a, act.RequestPlan)])
    assert "given up, ordered by the ground station" in world.state.why
    assert answer(world, "hold").text.startswith("she is given up, ordered by the ground station: ")
    assert answer(world, "why").result is Result.DONE
    answer(world, "go_on")
    assert world.run(1500, is_done)


@pytest.mark.parametrize("guidance", list(Guidance))
def test_given_up_while_she_is_steered_it_is_said_that_she_stops_there(guidance):
    """Headings end after 3 s: she lay and circled in a channel, and "she is in GUIDED" was all that was said."""
    world = sailing(config={"guidance": guidance})
    text = answer(world, "stop").text
    assert ("she is in GUIDED, and stops there: set AUTO" in text) is (guidance is not Guidance.PLAN)
    assert ("she is in AUTO" in text) is (guidance is Guidance.PLAN)


def test_given_up_during_an_upload_the_upload_ends_and_nothing_follows():
    world = sailing(upload_s=6.0)
    answer(world, "replan")
    answer(world, geo(-100.0, 120.0))
    assert world.run(60, lambda w: w.state.pending.upload is not None)
    assert "the end of an upload" in answer(world, "stop").text
    world.run(10)
    assert world.state.pending.upload is None
    assert world.mission == world.state.mission.route.items, "whole, whatever it is"
    before = moves(world)
    world.run(60)
    assert moves(world) == before


def test_hold_during_an_upload_waits_for_its_end():
    world = sailing(upload_s=6.0)
    answer(world, geo(-100.0, 120.0))
    assert world.run(60, lambda w: w.state.pending.upload is not None)
    before = world.count(act.UploadMission)
    answer(world, "hold")
    assert world.count(act.UploadMission) == before
    world.run(60)
    assert world.state.phase is Phase.HOLDING
    assert world.mission == world.state.mission.route.items


def test_a_new_plan_is_made_when_it_is_asked_for():
    world = sailing()
    before = world.count(act.RequestPlan)
    assert answer(world, "replan").result is Result.DONE
    world.run(3)
    asked = [a for _, a in world.actions if isinstance(a, act.RequestPlan)][before:]
    assert [a.reason for a in asked] == [act.ReplanReason.ORDER]
    answer(world, "hold")
    world.run(30)
    assert answer(world, "replan").result is Result.NOT_NOW


def test_nothing_drawn_is_on_offer_and_nothing_is_to_be_replaced():
    world = sailing()
    assert answer(world, "adopt").text == "nothing drawn is on offer"
    assert answer(world, "replace").result is Result.NOT_NOW


def test_why_says_what_she_does_and_moves_nothing():
    world = sailing()
    before = moves(world)
    given = answer(world, "why")
    assert given.result is Result.DONE
    assert "to A" in given.text
    assert moves(world) == before


# ----------------------------------------------------------------------------------------- who, when, twice
@pytest.mark.parametrize("verb", [v for v in Verb if v not in {Verb.WHY, Verb.GOAL}])
@pytest.mark.parametrize(
    "permissions", [replace(ALL_PERMITTED, orders=()), replace(ALL_PERMITTED, orders=("why",)), DRY_RUN]
)
def test_what_is_not_permitted_is_refused_and_changes_nothing(verb, permissions):
    world = permitted_world()
    world.permissions = permissions
    before = world.state
    state, actions = world.skipper.step(
        before, replace(world.snapshot(), permissions=permissions, events=(order(str(verb), world.t),), outcomes=())
    )
    given = next(a for a in actions if isinstance(a, act.Acknowledge))
    assert given.result is Result.REFUSED
    assert "not permitted" in given.text
    assert (state.orders.standing, state.plans.asked, state.progress.gate) == (None, "", before.progress.gate)


_WORLD = []


def permitted_world():
    if not _WORLD:
        _WORLD.append(sailing(refuges=REFUGES))
    return _WORLD[0]


def test_a_verb_that_is_named_is_permitted_and_no_other():
    world = permitted_world()
    snapshot = world.snapshot()
    may = replace(ALL_PERMITTED, orders=("hold",))
    for verb, result in (("hold", Result.DONE), ("home", Result.REFUSED), ("why", Result.DONE)):
        _, actions = world.skipper.step(
            world.state, replace(snapshot, permissions=may, events=(order(verb, world.t),), outcomes=())
        )
        assert next(a for a in actions if isinstance(a, act.Acknowledge)).result is result


def test_the_same_order_again_gets_the_same_answer_and_nothing_is_done_twice():
    world = sailing(Goal(en_m=(0.0, 300.0), name="A"), B, Goal(en_m=(250.0, 0.0), name="C"))
    first = answer(world, "skip_goal")
    world.run(3)
    assert answer(world, "skip_goal") == first
    assert world.state.orders.skipped == 1
    world.run(12)
    assert answer(world, "skip_goal").text == "B is given up: on to C"


def test_a_change_of_mind_is_no_repetition():
    world = sailing()
    for words in ("hold", "go_on", "hold"):
        assert answer(world, words).result is Result.DONE
    assert world.state.orders.standing.verb is Verb.HOLD


def test_of_two_stations_in_one_step_the_later_one_stands_and_both_are_told():
    world = sailing()
    world.order("hold")
    world.order("home", by=(254, 190))
    world.step()
    first, second = answers(world)[-2:]
    assert ((first.system, second.system), second.result) == ((255, 254), Result.DONE)
    assert "in place of hold, ordered by the ground station" in second.text
    assert world.state.orders.standing.verb is Verb.HOME
    assert any("in place of hold, ordered by the ground station" in text for text in said(world))


def test_a_person_who_has_her_is_not_overruled():
    world = sailing()
    world.set_mode(Mode.MANUAL)
    world.run(5)
    for words in ("hold", "home", geo(-100.0, 100.0), "replan"):
        given = answer(world, words)
        assert given.result is Result.NOT_NOW
        assert "a person has her" in given.text
    assert world.state.orders.standing is None


def test_she_cannot_be_sent_before_she_sails_nor_where_uploading_is_not_permitted():
    ashore = make(A, obstacles=())
    ashore.shown["home"] = FRAME.origin
    ashore.run(5)
    assert "not under way" in answer(ashore, "home").text
    world = sailing()
    world.permissions = replace(ALL_PERMITTED, may_upload=False)
    assert "uploading is not permitted" in answer(world, "home").text


def test_the_battery_comes_first():
    world = sailing(refuges=REFUGES)
    world.shown["battery_remaining"] = 0.05
    world.run(40)
    given = answer(world, "hold")
    assert given.result is Result.NOT_NOW
    assert "this comes first: to the refuge 1" in given.text


def test_the_last_goals_end_does_not_end_an_order():
    """Out of time and all goals reached, she stays where she was told to."""
    world = sailing(A)
    assert world.run(1500, is_done)
    answer(world, geo(-100.0, 150.0))
    assert world.run(600, lambda w: w.state.orders.standing is None)
    world.run(120)
    assert world.state.phase is Phase.DONE

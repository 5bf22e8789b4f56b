"""Passing lines: by the track alone, at the gun and not before, in the small world of the skipper's tests."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.planner import plan
from companion.skipper.intake import _own_count
from companion.skipper.passing import pass_gates
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.asking import request
from companion.skipper.planning.diversions import diversion
from companion.skipper.planning.track import steps
from companion.skipper.step.actions import Acknowledge, Announce, ReplanReason, UploadMission
from companion.skipper.step.config import Guidance
from companion.skipper.step.context import StepContext
from companion.skipper.step.route import DiversionKind
from companion.skipper.step.snapshot import PlanOutcome
from companion.skipper.step.state import PATIENT, Phase, Retry
from companion.skipper.way.geometry import bearing_rad, moved
from companion.skipper.way.line import ahead_m
from companion.skipper.way.voyage import Box, Goal, Line, Side
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.world import World, restarted, skipper, voyage, with_parts

LINE = Line(port_en_m=(-25.0, 80.0), starboard_en_m=(25.0, 80.0), keep_m=5.0)
END = Goal(en_m=(0.0, 220.0), radius_m=10.0, name="end")
UTC_AT_BOOT = 1_800_000_000.0


def line(**when):
    return Goal(en_m=(0.0, 80.0), name="line", line=replace(LINE, **when))


def world(*goals, **changes):
    """Return a world with the wind abeam of a course north."""
    return World(skipper=skipper(voyage(*goals)), wind=lambda t: (math.pi / 2.0, 5.0), **changes)


def said(w, code):
    return [entry[2] for entry in w.log if entry[1] == code]


def carried(w, *way):
    """Take her along a way at 2 m/s, whatever she would do herself."""
    for a, b in itertools.pairwise(way):
        for share in np.arange(0.0, 1.0, 2.0 / math.dist(a, b)):
            w.position = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
            w.run(1.0)


def crossed_s(w):
    """Return when the track cuts the line northward between the marks [s]."""
    return next(
        n / 5.0
        for n, (a, b) in enumerate(zip(w.track, w.track[1:], strict=False))
        if a[1] < 80.0 <= b[1] and abs(b[0]) < 25.0
    )


def test_a_gate_is_passed_where_the_track_crosses_it():
    w = world(line(), END)
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))
    assert w.position[1] == pytest.approx(83.0, abs=5.0)
    assert said(w, "goal")[0].startswith("line crossed")
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)
    assert w.state.progress.reached == (0, 1)


def test_near_its_middle_is_not_across_it():
    w = world(line(), END, position=(0.0, 70.0))
    w.run(5.0)
    assert w.state.progress.reached == ()


def test_from_beyond_the_line_she_comes_round_and_crosses_it_the_right_way():
    w = world(line(), END, position=(0.0, 130.0), heading=math.pi)
    assert w.run(400.0, lambda w: bool(w.state.progress.reached))
    assert min(p[1] for p in w.track) < 70.0
    assert said(w, "goal")[0].startswith("line crossed")


def test_crossed_the_wrong_way_it_does_not_count_and_that_is_said():
    w = world(line(), END)
    w.run(30.0, lambda w: w.state.voyage.sailing)
    carried(w, (28.0, 0.0), (28.0, 82.0), (18.0, 82.0), (18.0, 70.0))  # round the starboard mark, and back through
    assert said(w, "wrong way") == ["line was crossed the wrong way: it does not count"]
    assert w.state.progress.reached == ()
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))


def test_a_gate_that_was_passed_by_outside_is_sailed_again():
    w = world(line(), END)
    w.run(60.0, lambda w: w.position[1] > 40.0)
    # A current sets her past the port mark, on the outside.
    w.current = lambda t: (-6.0, 0.0)
    w.run(15.0, lambda w: w.position[0] < -45.0)
    w.current = lambda t: (0.0, 2.5) if w.position[1] < 110.0 and not said(w, "gate missed") else (0.0, 0.0)
    assert w.run(500.0, lambda w: bool(w.state.progress.reached))
    assert abs(w.track[-1][0]) < 27.0


def test_beyond_the_line_beside_its_marks_it_is_missed_at_once():
    """Sailed on to the place behind it she would have lost the way back besides."""
    w = world(line(), END)
    w.run(60.0, lambda w: w.position[1] > 40.0)
    carried(w, w.position, (40.0, 60.0), (40.0, 82.0))
    assert not said(w, "gate missed")  # a hair beyond its prolongation: not yet
    carried(w, w.position, (40.0, 88.0))
    assert said(w, "gate missed") == ["line was passed by outside of its marks: again"]


def test_a_line_before_a_quay_is_crossed_with_the_floor_kept_clear():
    quay = shapely.box(-200.0, 100.0, 200.0, 120.0)
    w = World(
        skipper=skipper(voyage(line(margin_m=12.0), obstacles=(quay,)), margin_m=12.0, margin_floor_m=4.0),
        wind=lambda t: (math.pi / 2.0, 5.0),
    )
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))
    assert not said(w, "gate missed")
    assert min(100.0 - p[1] for p in w.track) > 4.0


def test_a_line_without_room_before_a_quay_is_told_in_words_of_the_line():
    quay = shapely.box(-200.0, 88.0, 200.0, 120.0)
    w = World(
        skipper=skipper(voyage(line(margin_m=12.0), obstacles=(quay,)), margin_m=12.0, margin_floor_m=6.0),
        wind=lambda t: (math.pi / 2.0, 5.0),
    )
    w.run(30.0)
    told = [text for _, code, text in w.log if code.startswith("ladder")]
    assert told
    assert all("the line line is 8 m from o0: no room to cross it with" in text for text in told)


def test_what_is_missed_for_ever_is_said_loudly():
    w = world(line(), END)
    w.run(60.0, lambda w: w.position[1] > 40.0)
    for count in (1, 2, 3):
        assert not said(w, "missed often")
        carried(w, w.position, (35.0, 50.0), (35.0, 90.0))
        assert len(said(w, "gate missed")) == count
        carried(w, w.position, (0.0, 50.0))
        assert w.state.progress.gate == 1  # at the place before it, once more
    assert said(w, "missed often") == [
        "marks were missed 3 times on this voyage; the order skip_goal gives the next one up"
    ]


@pytest.mark.parametrize(("off_m", "is_reached"), [(28.0, True), (35.0, False), (150.0, False)])
def test_how_far_she_may_be_off_a_leg_is_no_second_radius_of_a_goal(off_m, is_reached):
    """The autopilot has counted its waypoint, and she was never within its 5 m."""
    way = route((10.0, 100.0), (10.0, 200.0), (10.0, 230.0), gate_of=(0, 1, -1))
    goals = (Goal(en_m=(10.0, 100.0), radius_m=5.0), Goal(en_m=(10.0, 200.0), radius_m=5.0))
    ctx = moment(way, goals=goals, at=(10.0 + off_m, 100.0), mission={"index": 1}, config={"grid_size_m": 200.0})
    pass_gates(ctx)
    assert ctx.state.progress.reached == ((0,) if is_reached else ())
    assert ctx.state.progress.missed == (0 if is_reached else 1)


@pytest.mark.parametrize("steered", [Guidance.HEADING, Guidance.FIELD])
@pytest.mark.parametrize(("off_m", "is_reached"), [(4.0, True), (28.0, False)])
def test_what_we_steer_past_counts_by_its_radius_alone(off_m, is_reached, steered):
    """ "G1 reached, 29.6 m from it: the autopilot has passed it", by headings: nobody but we had counted it."""
    way = route((10.0, 100.0), (10.0, 200.0), (10.0, 230.0), gate_of=(0, 1, -1))
    goals = (Goal(en_m=(10.0, 100.0), radius_m=5.0), Goal(en_m=(10.0, 200.0), radius_m=5.0))
    guided = moment(way).autopilot
    ctx = moment(
        way,
        goals=goals,
        at=(10.0 + off_m, 100.0),
        mission={"index": 1},
        config={"guidance": steered, "grid_size_m": 30.0},
        seen={"autopilot": replace(guided, mode=Mode.GUIDED)},
        progress={"closest_m": off_m},
    )
    pass_gates(ctx)
    assert ctx.state.progress.reached == ((0,) if is_reached else ())
    assert ctx.state.progress.missed == (0 if is_reached else 1)


@pytest.mark.parametrize(("steered", "is_reached"), [(Guidance.HEADING, True), (Guidance.FIELD, False)])
def test_by_field_the_last_goal_is_reached_by_its_radius_and_nothing_is_missed(steered, is_reached):
    """ "G0 reached, 27 m from it: the autopilot has passed it": its loiter lay elsewhere, for want of room there."""
    ctx = moment(
        route((10.0, 100.0), (10.0, 160.0), gate_of=(0, -1)),
        goals=(Goal(en_m=(10.0, 100.0), radius_m=10.0),),
        at=(10.0, 122.0),
        mission={"index": 1},
        config={"guidance": steered, "grid_size_m": 30.0},
        seen={"autopilot": replace(moment().autopilot, mode=Mode.GUIDED)},
        progress={"closest_m": 22.0},
    )
    pass_gates(ctx)
    assert ctx.state.progress.reached == ((0,) if is_reached else ())
    assert ctx.state.progress.missed == 0


@pytest.mark.parametrize(
    ("mode", "gate_of", "own_index"),
    [(Mode.GUIDED, (0, 1, -1), 0), (Mode.GUIDED, (-1, 1, -1), 1), (Mode.AUTO, (0, 1, -1), 1)],
)
def test_the_waypoint_of_a_goal_is_not_left_before_it_while_we_steer(mode, gate_of, own_index):
    """In AUTO it is the autopilot that counts: held back there, too, our own count took it for late."""
    way = route((0.0, 100.0), (4.0, 0.0), (4.0, -30.0), gate_of=gate_of)
    status = replace(moment(way).autopilot, mode=mode)
    ctx = moment(
        way,
        goals=(Goal(en_m=(0.0, 100.0), radius_m=5.0), Goal(en_m=(4.0, 0.0), radius_m=5.0)),
        at=(3.0, 75.0),  # on the leg that follows, and within the grid size
        mission={"index": 0, "own_index": 0},
        config={"guidance": Guidance.HEADING, "grid_size_m": 30.0},
        seen={"autopilot": status},
    )
    _own_count(ctx)
    assert ctx.state.mission.own_index == own_index


@pytest.mark.parametrize(
    ("closest_m", "gate_of", "is_late"),
    [(26.0, (0, 1, -1), False), (24.0, (0, 1, -1), True), (26.0, (-1, 1, -1), True)],
)
def test_the_autopilot_is_not_late_while_she_comes_nearer_to_the_goal(closest_m, gate_of, is_late):
    """On a beat out and back she crossed the leg back; 15 s later the next item was made current: "reached, 26.4 m"."""
    way = route((0.0, 100.0), (4.0, 0.0), (4.0, -30.0), gate_of=gate_of)
    ctx = moment(
        way,
        goals=(Goal(en_m=(0.0, 100.0), radius_m=5.0), Goal(en_m=(4.0, 0.0), radius_m=5.0)),
        at=(3.0, 75.0),
        mission={"index": 0, "own_index": 1, "passed_since_s": NOW_S - 14.0, "checked": True},
        config={"grid_size_m": 30.0},
        progress={"closest_m": closest_m},
    )
    _own_count(ctx)
    assert ctx.state.mission.passed_since_s == (NOW_S - 14.0 if is_late else NOW_S)


@pytest.mark.parametrize("aside_m", [4.0, -4.0])
def test_by_headings_she_comes_within_each_goals_radius(aside_m):
    """Near the leg back, 30 m before a goal, she turned onto it, and the goal was reached from there."""
    places = [(0.0, 120.0), (aside_m, 0.0), (0.0, 100.0)]
    goals = [Goal(en_m=place, radius_m=4.0, name=f"{n}") for n, place in enumerate(places)]
    made = skipper(voyage(*goals), guidance=Guidance.HEADING, grid_size_m=30.0)
    w = World(skipper=made, wind=lambda t: (math.pi / 2.0, 5.0), position=(0.0, -40.0))
    assert w.run(900.0, lambda w: len(w.state.progress.reached) == 3)
    for place in places:
        assert min(math.dist(place, there) for there in w.track) <= 4.5, place
    assert not any("the autopilot has passed it" in text for text in said(w, "goal"))


BUOY = Goal(en_m=(0.0, 200.0), radius_m=10.0, rounding_m=10.0, side=Side.STARBOARD, name="buoy")


@pytest.mark.parametrize("hand", [1.0, -1.0])
@pytest.mark.parametrize("counted", [True, False])
@pytest.mark.parametrize("is_last", [True, False])
def test_near_a_buoy_is_not_round_it(is_last, counted, hand):
    """Inside the gate's radius before she is abeam, or abeam on the other hand when the autopilot counts it."""
    goals = (Goal(en_m=(0.0, 0.0)), BUOY) if is_last else (Goal(en_m=(0.0, 0.0)), BUOY, Goal(en_m=(0.0, 400.0)))
    way = route((-10.0, 200.0), (-10.0, 230.0), begin=(0.0, 0.0), gate_of=(1, -1))
    for north_m, is_round in ((192.0, False), (200.5, not is_last), (204.0, not is_last)):
        place = (-hand * 9.5, north_m)
        made = moment(way, goals=goals, at=place, mission={"index": int(counted)})
        turned = difference_rad(bearing_rad(BUOY.en_m, place), math.pi)
        made.set(progress=replace(made.state.progress, gate=1, reached=(0,), bearing_rad=turned))
        pass_gates(made)
        assert (1 in made.state.progress.reached) == (is_round and hand > 0.0), (place, made.state.progress)


@pytest.mark.parametrize("bend_deg", [None, 0.0, 25.0, -50.0])
@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
def test_a_buoy_straight_ahead_is_left_on_its_hand(side, bend_deg):
    """Rounded as near as it counts, the last goal or not: she turned to the loiter, and home, before she was abeam."""
    hand = 1.0 if side is Side.PORT else -1.0
    buoy = replace(BUOY, side=side)
    end = None if bend_deg is None else Goal(en_m=moved(buoy.en_m, -hand * math.radians(bend_deg), 150.0))
    w = world(buoy, *(() if end is None else (end,)), position=(0.0, -20.0))
    assert w.run(400.0, lambda w: 0 in w.state.progress.reached)
    bearings = np.unwrap([bearing_rad(buoy.en_m, place) for place in w.track])
    assert hand * (bearings[0] - bearings[-1]) > math.radians(90.0 if end is None else 30.0)
    assert w.state.progress.missed == 0
    assert said(w, "goal")[0].startswith(f"buoy reached, left to {side.value}, ")


def under_way_to_a_gate(**config):
    w = World(skipper=skipper(voyage(line(), END), **config), wind=lambda t: (math.pi / 2.0, 5.0))
    assert w.run(60.0, lambda w: w.position[1] > 10.0)
    w.state = with_parts(w.state, pending={"plan": None, "upload": None})
    return StepContext(w.skipper.voyage, w.skipper.config, w.state, w.snapshot())


@pytest.mark.parametrize(
    ("way", "is_through"), [([(2.0, 60.0), (0.0, 94.0)], True), ([(200.0, 60.0), (200.0, 120.0), (0.0, 94.0)], False)]
)
def test_a_plan_that_goes_round_the_outside_of_a_gate_is_none(way, is_through):
    ctx = under_way_to_a_gate()
    assert request(ctx, ReplanReason.ORDER)
    pending = ctx.state.pending.plan
    ctx.actions.clear()
    found = plan(pending.problem, expansions=3000)
    answer = replace(found, waypoints_en=np.asarray([pending.problem.start_en, *way]), cost_s=1.0)
    take_plan(ctx, PlanOutcome(request_id=pending.request_id, plan=answer))
    told = [a.text for a in ctx.actions if isinstance(a, Announce)]
    assert any("round the outside of line only" in text for text in told) is not is_through
    assert any(isinstance(a, UploadMission) for a in ctx.actions) is is_through


@pytest.mark.parametrize("floor_m", [4.0, 8.0, 20.0])
def test_down_the_ladder_less_is_kept_of_a_gates_marks_never_less_than_the_mission_says(floor_m):
    ctx = under_way_to_a_gate(margin_m=20.0, margin_floor_m=floor_m)
    kept_m = []
    for rung in range(len(steps(ctx))):
        assert request(ctx, ReplanReason.ORDER, rung=rung)
        problem = ctx.state.pending.plan.problem
        mark = shapely.Point(LINE.port_en_m)
        discs = [
            p for p, name in zip(problem.obstacles, problem.obstacle_names, strict=True) if name == "a mark of line"
        ]
        (disc,) = (p for p in discs if shapely.contains(p, mark))
        kept_m.append(shapely.distance(disc.exterior, mark))
    assert kept_m[0] == pytest.approx(8.0, abs=0.01)
    assert kept_m[-1] == pytest.approx(5.0, abs=0.01)
    assert kept_m == sorted(kept_m, reverse=True)


@pytest.mark.parametrize("wind_deg", [0.0, 20.0, -20.0])
def test_a_narrow_gate_dead_to_windward_is_crossed_and_not_gone_round(wind_deg):
    """At the whole of what is kept clear of its marks no board fits between them: nearer to them one does."""
    narrow = replace(LINE, port_en_m=(-11.0, 80.0), starboard_en_m=(11.0, 80.0))
    w = World(
        skipper=skipper(
            voyage(Goal(en_m=(0.0, 80.0), name="line", line=narrow), END), margin_m=8.0, margin_floor_m=4.0
        ),
        wind=lambda t: (math.radians(wind_deg), 5.0),
        position=(0.0, -20.0),
    )
    assert w.run(400.0, lambda w: w.state.phase is Phase.DONE)
    assert w.state.progress.missed == 0
    assert max(abs(p[0]) for p in w.track) < 100.0


@pytest.mark.parametrize(
    ("when", "shown"),
    [
        ({"after_s": 90.0}, {}),
        ({"after_s": 90.0}, {"utc_at_boot_s": UTC_AT_BOOT}),
        ({"not_before_s": UTC_AT_BOOT + 100.0 + 95.0}, {"utc_at_boot_s": UTC_AT_BOOT}),
    ],
)
def test_she_waits_before_the_line_and_crosses_after_the_gun(when, shown):
    w = world(line(**when), END, shown=shown)
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))
    set_sail_s = next(t for t, code, *_ in w.log if code == "under way")
    gun_s = 95.0 if "not_before_s" in when else set_sail_s + 90.0
    assert gun_s - 1.0 <= crossed_s(w) <= gun_s + 40.0
    assert not said(w, "early start")
    assert any("waiting for the gun" in entry[2] for entry in w.log)
    assert max(ahead_m(LINE, p) for p in w.track[: int(5 * (gun_s - 2.0))]) < 0.0


def test_where_she_waits_is_not_chosen_anew_on_the_way_there():
    there = (-31.0, 27.0)
    for name, keeps in (("the water before line", True), ("somewhere else", False)):
        way = route((-10.0, 10.0), there, there, bound_for=name)
        waits = diversion(moment(way, goals=(line(not_before_s=UTC_AT_BOOT), END)))
        assert waits.kind is DiversionKind.START
        assert (waits.en_m == there) is keeps


def test_without_the_time_of_day_she_waits_for_it_and_says_so():
    w = world(line(not_before_s=UTC_AT_BOOT + 160.0), END)
    w.run(200.0)
    assert w.state.progress.reached == ()
    assert "does not know the time" in w.state.why
    w.shown = {"utc_at_boot_s": UTC_AT_BOOT}
    assert w.run(200.0, lambda w: bool(w.state.progress.reached))


def test_too_early_she_comes_back_and_starts_again():
    w = world(line(after_s=120.0), END)
    w.run(60.0)
    w.current = lambda t: (0.0, 4.0) if not said(w, "early start") else (0.0, 0.0)
    assert w.run(60.0, lambda w: bool(said(w, "early start")))
    w.current = lambda t: (0.0, 0.0)
    assert w.state.progress.reached == ()
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))
    assert "after the gun" in said(w, "goal")[0]


def test_the_gun_is_kept_over_a_restart_to_the_second():
    w = world(line(after_s=150.0), END, shown={"utc_at_boot_s": UTC_AT_BOOT})
    w.run(70.0)
    gun = w.state.voyage.set_sail_utc_s
    restarted(w)
    w.run(5.0)
    assert w.state.voyage.set_sail_utc_s == gun
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))
    set_sail_s = next(t for t, code, *_ in w.log if code == "under way")
    assert set_sail_s + 149.0 <= crossed_s(w) <= set_sail_s + 190.0


def test_a_line_crossed_while_nobody_looked_counts():
    w = world(line(), END)
    w.run(100.0, lambda w: w.position[1] > 74.0)
    saved = w.skipper.persisted(w.state)
    while w.position[1] < 84.0:  # killed: the autopilot sails on
        w.sail(0.2)
        w.t += 0.2
    w.state = w.skipper.initial(saved)
    w.pending = []
    assert w.run(10.0, lambda w: bool(w.state.progress.reached))
    assert "while nobody looked" in said(w, "goal")[0]


def test_a_gate_is_given_up_by_order_and_a_hold_before_it_ends():
    w = world(line(), END)
    w.run(20.0, lambda w: w.state.voyage.sailing)
    w.order("hold")
    w.run(60.0)
    assert w.state.phase is Phase.HOLDING
    w.order("go_on")
    w.run(3.0)
    w.order("skip_goal")
    assert w.run(400.0, lambda w: w.state.phase is Phase.DONE)
    assert w.state.progress.reached == (1,)


SQUARE = shapely.box(-25.0, 75.0, 25.0, 125.0)


def box(**stay):
    return Goal(en_m=(0.0, 100.0), radius_m=25.0, name="box", box=Box(area_en=SQUARE, **stay))


def out_of_it(w, since):
    """Return how many of the track's points since a moment are out of the box."""
    return sum(not shapely.contains_xy(SQUARE, *p) for p in w.track[int(5 * since) :])


def test_she_stays_in_a_box_for_its_time_and_goes_on():
    w = world(box(for_s=200.0), END)
    assert w.run(200.0, lambda w: bool(said(w, "box")))
    entered = w.t
    assert w.run(300.0, lambda w: bool(w.state.progress.reached))
    assert w.t - entered == pytest.approx(200.0, abs=2.0)
    assert out_of_it(w, entered + 1.0) == 0
    assert any("to stay in it; waiting" in entry[2] for entry in w.log)
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)


def test_in_a_box_without_a_time_she_stays_until_told():
    w = world(box(), END)
    w.run(400.0)
    assert w.state.progress.reached == ()
    assert "until told to go on" in w.state.why
    w.order("hold")
    w.run(5.0)
    w.order("go_on")  # the end of the hold, not of the stay
    w.run(1.0)
    told = [a.text for _, a in w.actions if isinstance(a, Acknowledge)][-1]
    assert told == "the end of hold: she stays in box until told to go on"  # "on to box" was said
    w.run(19.0)
    assert w.state.progress.reached == ()
    w.order("go_on")
    w.run(3.0)
    assert w.state.progress.reached == (0,)
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)


@pytest.mark.parametrize(
    ("winds_mps", "enters", "why"),
    [
        ((4.0, 4.0), True, "her time is over"),
        ((4.0, 12.0), True, "a loiter takes"),
        ((12.0, 12.0), False, "a loiter takes"),
    ],
)
def test_in_a_dock_she_stays_while_a_loiter_has_room_in_that_wind(winds_mps, enters, why):
    """In 12 m/s she swung from wall to wall for the five minutes of her stay, and touched."""
    walls = [shapely.box(-40.0, 40.0, 40.0, 60.0), *(shapely.box(e, 60.0, e + 14.0, 140.0) for e in (-40.0, 26.0))]
    made = skipper(voyage(box(for_s=200.0), END, obstacles=walls), margin_m=6.0, margin_floor_m=4.0)
    w = World(skipper=made, wind=lambda t: (math.pi / 2.0, winds_mps[t > 150.0]))
    assert w.run(400.0, lambda w: bool(w.state.progress.reached))
    told = said(w, "box") + said(w, "goal")
    assert ("box entered" in told) is enters
    assert why in told[int(enters)]
    assert (w.state.progress.reached == (0,)) is enters


def test_a_box_that_she_gives_up_is_planned_past_without_the_wait_that_stood():
    walls = [shapely.box(-40.0, 40.0, 40.0, 60.0), *(shapely.box(e, 60.0, e + 14.0, 140.0) for e in (-40.0, 26.0))]
    way = route((0.0, 100.0), (0.0, 100.0), gate_of=(0, -1))
    waits = {"retry": Retry(failures=3, not_before_s=1e9)}
    dock = {"goals": (box(), END), "obstacles": walls, "config": {"margin_m": 6.0, "margin_floor_m": 4.0}}
    ctx = moment(way, at=(0.0, 20.0), tws_mps=12.0, plans=waits, **dock)
    pass_gates(ctx)
    assert any("box is given up: a loiter takes" in a.text for a in ctx.actions if isinstance(a, Announce))
    assert (ctx.state.progress.gate, ctx.state.orders.skipped) == (1, 1)
    assert ctx.state.plans.asked_as is ReplanReason.NEXT_GOAL
    assert ctx.state.plans.retry == PATIENT


def test_the_time_in_a_box_is_counted_on_over_a_restart():
    w = world(box(for_s=200.0), END, shown={"utc_at_boot_s": UTC_AT_BOOT})
    w.run(200.0, lambda w: bool(said(w, "box")))
    entered = w.t
    w.run(100.0)
    restarted(w)
    assert w.run(150.0, lambda w: bool(w.state.progress.reached))
    assert w.t - entered == pytest.approx(200.0, abs=3.0)


def test_a_box_is_given_up_by_order():
    w = world(box(), END)
    w.run(150.0)
    w.order("skip_goal")
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)
    assert w.state.progress.reached == (1,)


def test_a_voyage_that_ends_with_a_box_is_done_when_its_time_is_over():
    w = world(box(for_s=60.0))
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)
    assert w.state.voyage.arrived


@pytest.mark.parametrize(("at", "is_missed"), [((0.0, 78.0), False), ((0.0, 70.0), True), ((40.0, 78.0), True)])
def test_a_waypoint_close_beyond_the_line_may_be_left_a_moment_before_she_crosses_it(at, is_missed):
    way = route((0.0, 87.0), (0.0, 200.0), (0.0, 230.0), begin=(0.0, 0.0), gate_of=(1, 2, -1))
    ctx = moment(way, goals=(line(), END), at=at, mission={"index": 1})
    ctx.set(progress=replace(ctx.state.progress, gate=1))
    pass_gates(ctx)
    said_of = [a for a in ctx.actions if isinstance(a, Announce) and a.code == "gate missed"]
    assert bool(said_of) is is_missed


@pytest.mark.parametrize("off_m", [3.0, 7.0])
def test_a_mark_that_counts_beyond_its_radius_says_by_what(off_m):
    """ "goal 1 reached, 7.0 m from it" of one with a radius of 5 m: as near as she came, by the autopilot's count."""
    goals = (Goal(en_m=(0.0, 100.0), radius_m=5.0, name="one"), Goal(en_m=(0.0, 300.0), name="two"))
    way = route((0.0, 100.0), (0.0, 300.0), (0.0, 300.0), gate_of=(0, 1, -1))
    here = (off_m, 101.0)
    ctx = moment(way, goals=goals, at=here, mission={"route": way, "index": 1}, progress={"closest_m": off_m})
    pass_gates(ctx)
    words = next(a.text for a in ctx.actions if isinstance(a, Announce) and a.code == "goal")
    by_count = ": the autopilot has passed it, its radius is 5 m" if off_m > 5.0 else ""
    assert words == f"one reached, {off_m:.1f} m from it{by_count}"

"""A boat that does not sail: drifting is seen, held against the area, said and stopped; then she sails on."""

import math
from dataclasses import fields, replace
from itertools import pairwise

import pytest
import shapely
import shapely.affinity
from shapely import box

from companion.messages import Mode
from companion.skipper.behaviors.drifting import (
    CALL,
    MEANS,
    drift,
    follow_ground,
    is_cramped,
    lies_in_loiter,
    sails,
    stops_drift,
)
from companion.skipper.step import actions as act
from companion.skipper.step.context import StepContext
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from companion.skipper.way.drift import drift_ahead
from companion.skipper.way.voyage import Goal
from tests.skipper.moments import NOW_S, moment
from tests.skipper.test_voyage import is_done, make, said
from tests.skipper.world import restarted, with_parts

CALM_S = 60.0
ROCK = shapely.box(150.0, -100.0, 190.0, 400.0)  # to leeward of the way, across the whole set of the current
AHEAD = shapely.box(-20.0, 150.0, 40.0, 170.0)  # between where the current leaves her and the old waypoint


def dies(back_s=math.inf, tws_mps=0.0):
    """A breeze from the west that dies after a minute, and comes back."""
    return lambda t: (-1.5, tws_mps if CALM_S <= t < back_s else 4.0)


def sets(east_mps=0.5, until_s=math.inf):
    return lambda t: (east_mps if CALM_S <= t < until_s else 0.0, 0.0)


def world(*, obstacles=(ROCK,), goal=(0.0, 400.0), has_motor=False, **how):
    made = make(Goal(en_m=goal, radius_m=8.0), obstacles=obstacles, **{"wind": dies(), "current": sets(), **how})
    boat = replace(made.skipper.voyage.boat, has_motor=has_motor)
    made.skipper = type(made.skipper)(voyage=replace(made.skipper.voyage, boat=boat), config=made.skipper.config)
    return made


def said_at(w, code):
    return [entry[0] for entry in said(w, code)]


def contact_s(w):
    """When the track, sampled five times a second, first is in the rock [s]."""
    touches = w.skipper.voyage.area.clearance_m(w.track) <= 0.0
    return float(touches.argmax()) / 5.0 if touches.any() else math.inf


def test_half_an_hour_without_wind_in_a_current_is_no_silence():
    w = world()
    w.run(1800)
    assert said(w, "becalmed")
    assert said(w, "drifting")
    calls = said(w, CALL)
    assert "onto o0 in" in calls[0][2]
    assert "51.1" in calls[0][2]  # where, for whoever comes to help
    assert contact_s(w) - calls[0][0] >= 120.0
    assert contact_s(w) - said_at(w, "drifting")[0] >= 180.0
    before = [t for t in said_at(w, CALL) if t < contact_s(w)]
    assert len(before) >= 3
    assert all(59.0 <= b - a <= 62.0 for a, b in pairwise(before))


def test_it_is_drifting_that_is_said_and_not_sailing():
    w = world(wind=lambda t: (-1.5, 4.0), current=sets(0.5))
    assert w.run(600, is_done)
    assert not said(w, "drifting")
    assert not said(w, "drift")


def test_in_a_calm_she_loiters_and_sails_on_from_where_the_current_has_taken_her():
    """Back comes the wind: the old waypoint is behind an island now, and she does not make for it across that."""
    w = world(obstacles=(AHEAD,), goal=(0.0, 400.0), wind=dies(300.0), current=sets(0.3, 300.0))
    assert w.run(250, lambda w: w.mode is Mode.LOITER)
    w.run(5)
    assert w.state.phase is Phase.HOLDING
    assert "becalmed" in w.state.why or "adrift" in w.state.why
    asked = w.count(act.RequestPlan)
    w.run(300 - w.t)
    assert w.count(act.RequestPlan) == asked  # none for a wind that is not there
    assert w.run(200, lambda w: w.mode is Mode.AUTO)
    assert w.count(act.RequestPlan) > asked
    assert not said(w, "operator")
    assert w.run(900, is_done)
    assert w.clearance() > 0.0


@pytest.mark.parametrize(
    ("speed_mps", "how"), [(0.1, "lying still"), (0.35, "making 0.35 m/s towards 090°"), (0.6, "making 0.6 m/s")]
)
def test_in_a_loiter_she_lies_still_only_where_she_does(speed_mps, how):
    """Going round in circles her mean is nothing, and "lying still" was said at 0.4 m/s."""
    still = {"ground_en_mps": (0.0, 0.0), "ground_t_s": NOW_S, "loitered": True}
    ctx = moment(speed_mps=speed_mps, tws_mps=0.2, up=("becalmed",), adrift=still, steering={"own_mode": Mode.LOITER})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=Mode.LOITER))
    assert stops_drift(ctx)
    assert ctx.state.why.startswith(f"becalmed, {how}")


def test_in_a_loiter_who_makes_way_again_is_not_becalmed():
    """ "becalmed, making 3.1 m/s" was said for as long as the watchdog waits for the wind to last."""
    still = {"ground_en_mps": (0.0, 0.0), "ground_t_s": NOW_S, "loitered": True}
    ctx = moment(speed_mps=3.1, up=("becalmed",), adrift=still, steering={"own_mode": Mode.LOITER})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=Mode.LOITER))
    assert stops_drift(ctx)
    told = "out of the calm, making 3.1 m/s towards 090°: waiting in a loiter until the wind has lasted"
    assert ctx.state.why == told


def test_in_a_loiter_who_makes_way_in_a_breeze_comes_out_of_no_calm():
    """ "out of the calm" was said in 8 m/s of wind, after a drift by a wrong one."""
    still = {"ground_en_mps": (0.0, 0.0), "ground_t_s": NOW_S, "loitered": True}
    ctx = moment(speed_mps=2.7, tws_mps=8.0, up=("drifting",), adrift=still, steering={"own_mode": Mode.LOITER})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=Mode.LOITER))
    assert stops_drift(ctx)
    told = "adrift no more, making 2.7 m/s towards 090°: waiting in a loiter until that has lasted"
    assert ctx.state.why == told


def test_over_the_missions_own_fence_the_call_for_the_anchor_goes_on():
    """It may be the shore: she was told 386 m clear of everything, and the calls ended, while she lay over it."""
    w = world(obstacles=(), voyage={"limits": box(-60.0, -60.0, 40.0, 600.0)})
    assert w.run(400, lambda w: w.position[0] > 50.0)
    begins = w.t
    w.run(150)
    told = [text for t_s, _, text in said(w, "anchor") if t_s > begins]
    assert len(told) >= 2
    assert all("onto the fence in 0 s" in text for text in told)


def test_a_still_calm_changes_nothing():
    w = world(current=lambda t: (0.0, 0.0), wind=dies(300.0))
    w.run(300)
    assert said(w, "becalmed")
    assert w.mode is Mode.AUTO
    assert w.run(600, is_done)
    assert not said(w, "drift")


def test_a_drift_too_slow_for_the_receiver_is_seen_in_places():
    """0.06 m/s, 15 m off: five minutes."""
    near = shapely.box(20.0, -100.0, 60.0, 400.0)
    w = world(obstacles=(near,), current=sets(0.06), goal=(-60.0, 400.0))
    w.run(400)
    assert said(w, "drifting")


def test_without_permission_she_is_left_alone_and_the_crew_is_called():
    w = world()
    w.run(CALM_S)
    w.permissions = replace(w.permissions, may_set_mode=False)
    w.run(400)
    assert w.mode is Mode.AUTO
    assert said(w, CALL)


def test_a_person_who_sets_auto_in_a_calm_is_let_have_it():
    w = world(obstacles=())
    assert w.run(250, lambda w: w.mode is Mode.LOITER)
    w.run(5)
    asked = w.count(act.SetMode)
    w.set_mode(Mode.AUTO)
    w.run(120)
    assert w.mode is Mode.AUTO
    assert w.count(act.SetMode) == asked


def test_the_motor_holds_her_and_is_switched_off_when_she_sails():
    w = world(has_motor=True, wind=dies(600.0), current=sets(0.5, 600.0))
    assert w.run(400, lambda w: w.motor)
    assert Persisted.from_dict(w.skipper.persisted(w.state).to_dict()).motor or w.run(
        3, lambda w: w.skipper.persisted(w.state).motor
    )
    assert w.run(1200, is_done)
    assert not w.motor
    assert w.clearance() > 0.0
    assert [a.is_on for _, a in w.actions if isinstance(a, act.RunMotor)] == [True, False]


def test_a_motor_that_runs_is_ours_to_switch_off_after_a_restart():
    w = world(has_motor=True, wind=dies(400.0), current=sets(0.5, 400.0))
    assert w.run(400, lambda w: w.skipper.persisted(w.state).motor)
    w = restarted(w)
    assert w.run(900, lambda w: not w.motor)


@pytest.mark.parametrize(
    ("tws_mps", "has_motor", "may", "wanted"),
    [
        (0.0, False, True, "anchor"),
        (0.0, True, True, "motor"),
        (0.0, True, False, "anchor"),
        (2.0, False, True, "loiter"),
        (2.0, False, False, "anchor"),
        (0.3, False, True, "anchor"),
    ],
)
def test_the_first_means_that_will_do_is_used(tws_mps, has_motor, may, wanted):
    w = world(has_motor=has_motor)
    w.run(CALM_S)
    w.wind = lambda t: (-1.5, tws_mps)
    w.permissions = replace(w.permissions, may_set_mode=may)
    ctx = StepContext(w.skipper.voyage, w.skipper.config, w.state, w.snapshot())
    ahead = drift_ahead(w.skipper.voyage.area, w.position, (0.5, 0.0), floor_m=8.0)
    assert next(m.name for m in MEANS if m.will_do(ctx, ahead)) == wanted


def test_loiter_that_does_not_hold_ends_in_the_call():
    """Wind enough by the book, and a current that carries her out of her circles all the same."""
    w = world(wind=dies(tws_mps=0.6), current=sets(0.4))
    w.run(500)
    assert w.mode is Mode.LOITER
    assert said(w, CALL)
    assert contact_s(w) - said_at(w, CALL)[0] >= 60.0


@pytest.mark.parametrize(
    ("place", "obstacles", "stays"),
    [
        ((20.0, 0.0), (), True),  # in it
        ((60.0, 0.0), (), True),  # on her clear way to it
        ((60.0, 0.0), (shapely.box(20.0, -20.0, 30.0, 20.0),), False),  # a rock lies between
        ((90.0, 0.0), (), False),  # too far to be left to it
    ],
)
def test_the_mission_s_own_loiter_is_kept_where_she_is_in_it_or_has_a_clear_way_to_it(place, obstacles, stays):
    w = world(obstacles=obstacles)
    w.run(CALM_S)
    here = w.position
    there = (here[0] + place[0], here[1] + place[1])
    moved = tuple(shapely.affinity.translate(o, *here) for o in obstacles)
    voyage = replace(w.skipper.voyage, area=world(obstacles=moved).skipper.voyage.area) if moved else w.skipper.voyage
    route = w.state.mission.route
    end = replace(route, items=route.items[-1:], points_en_m=(there,), leg_from_en_m=(here,), gate_of=(-1,))
    ctx = StepContext(voyage, w.skipper.config, with_parts(w.state, mission={"route": end, "index": 0}), w.snapshot())
    assert lies_in_loiter(ctx) is stays


@pytest.mark.parametrize(
    ("tws_mps", "rock_m", "cramped"),
    [
        (5.0, 10.0, True),
        (5.0, 40.0, False),  # a loiter takes 12 m of room
        (0.5, 10.0, False),  # without wind she circles nowhere: LOITER keeps her from her old way
    ],
)
def test_no_loiter_is_begun_beside_a_rock_that_she_would_sail_onto(tws_mps, rock_m, cramped):
    """A boat in irons in a channel was put into one, and touched when she sailed again (sitl mismatch, seed 2)."""
    w = world(obstacles=())
    w.run(CALM_S)
    here = w.position
    rock = shapely.box(here[0] + rock_m, here[1] - 50.0, here[0] + rock_m + 20.0, here[1] + 50.0)
    voyage = replace(w.skipper.voyage, area=world(obstacles=(rock,)).skipper.voyage.area)
    w.wind = lambda t: (-1.5, tws_mps)
    w.run(15)
    assert is_cramped(StepContext(voyage, w.skipper.config, w.state, w.snapshot())) is cramped


def sailed(*track, heading_deg):
    """Return the moment after a track of (heading [deg], velocity east, velocity north [m/s]), one a second."""
    parts = {}
    for n, (heading, east, north) in enumerate(track):
        ctx = moment(heading_deg=heading, adrift=parts)
        vehicle = replace(ctx.snapshot.vehicle, velocity_en_mps=(east, north))
        ctx.snapshot = replace(ctx.snapshot, t_s=NOW_S + n, vehicle=vehicle)
        follow_ground(ctx)
        parts = {f.name: getattr(ctx.state.adrift, f.name) for f in fields(ctx.state.adrift)}
    assert heading == heading_deg
    return ctx


BOARD = ((-45.0, -1.8, 1.8),) * 30  # of a boat that beats: 2.5 m/s to the north-west


def test_a_boat_that_tacks_is_not_drifting():
    """The mean over ground was still of the board before: "anchor! drifting 2 m/s" was called in a planned tack."""
    turn = [(heading, math.sin(math.radians(heading)), math.cos(math.radians(heading))) for heading in (-20, 10, 45)]
    way = [*BOARD, *turn, *((45.0, 1.4, 1.4),) * 10]
    for n in range(len(BOARD), len(way)):
        ctx = sailed(*way[: n + 1], heading_deg=way[n][0])
        assert drift(ctx) is None, n
        assert sails(ctx), n


@pytest.mark.parametrize(
    ("now", "within_s"),
    [
        ((-45.0, 0.4, -0.4), 24),  # astern, on the heading that she had: by the mean over ground alone
        ((45.0, -0.4, -0.4), 5),  # astern behind a turn
        ((45.0, -0.6, 0.6), 5),  # sideways behind a turn
    ],
)
def test_a_boat_that_is_carried_is_drifting_soon(now, within_s):
    ctx = sailed(*BOARD, *(now,) * within_s, heading_deg=now[0])
    assert drift(ctx) is not None
    assert not sails(ctx)

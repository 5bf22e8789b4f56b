"""Whole voyages in the tiny world: the main job, and each way in which it can go wrong."""

import math
from dataclasses import replace
from itertools import accumulate, pairwise

import numpy as np
import pytest
import shapely
from shapely.geometry import box

from companion.boat import AutopilotLimits
from companion.current import WaterCurrent
from companion.geo.angles import difference_rad
from companion.messages import MissionItem, Mode, StatusText, sailed_part
from companion.planner import PlanStatus, plan
from companion.planner.worker import failed
from companion.planners import AstarSettings, PlannerChoice
from companion.skipper.planning.triggers import board_end
from companion.skipper.step import actions as act
from companion.skipper.step.config import DRY_RUN, Guidance, Permissions, ReplanPolicy
from companion.skipper.step.context import StepContext
from companion.skipper.step.missions import ends_safely, is_same_mission
from companion.skipper.step.snapshot import AutopilotRebooted, UploadResult, WindHealth
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import bearing_rad, distance_m, is_tack, moved
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.world import FRAME, World, restarted, skipper, voyage, with_parts

ISLANDS = (box(-40, 120, 30, 160), box(60, 220, 120, 260), box(-120, 230, -20, 270))
GOAL = Goal(en_m=(0.0, 400.0), radius_m=6.0, name="the goal")
FAST = {"expansions": 1500}


def swinging(t):
    return 0.15 * math.sin(t / 60.0), 5.0


def swinging_about(twd_deg):
    return lambda t: (math.radians(twd_deg) + 0.15 * math.sin(t / 20.0), 5.0)


def ar1(seed, sd_deg, rho=0.036):
    rng, a, x = np.random.default_rng(seed), math.exp(-rho), [0.0]
    for _ in range(4000):
        x.append(a * x[-1] + math.radians(sd_deg) * math.sqrt(1 - a * a) * rng.standard_normal())
    return lambda t: (x[int(t)], 5.0)


def is_done(world):
    return world.state.phase is Phase.DONE


def is_sailing(world):
    return world.state.voyage.sailing and world.state.phase is Phase.STANDARD


def make(*goals, config=None, obstacles=ISLANDS, **world):
    """Return a world whose plans have every tack as a waypoint: much to upload that can go wrong."""
    made = voyage(*(goals or (GOAL,)), obstacles=obstacles, **world.pop("voyage", {}))
    return World(
        skipper=skipper(made, **{"autopilot_beats": False, "least_depth_m": 2.0, **(config or {})}),
        **{"wind": swinging, **FAST, **world},
    )


def said(world, code):
    return [entry for entry in world.log if entry[1] == code]


# ------------------------------------------------------------------------------------- the main job
@pytest.mark.parametrize("beats", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_beats_through_islands_to_a_goal_upwind(seed, beats):
    world = make(wind=ar1(seed, 8.0), sigma=math.radians(8.0), config={"autopilot_beats": beats})
    assert world.run(1500, is_done)
    assert distance_m(world.position, GOAL.en_m) < 10.0
    assert world.clearance() > world.skipper.config.margin_floor_m
    assert ends_safely(world.mission)
    assert world.state.progress.reached == (0,)


def test_runs_to_a_goal_downwind():
    """Between the islands, never by the lee of them, and about as fast as her polar lets her get down wind."""
    world = make(wind=lambda t: (math.pi, 6.0))
    assert world.run(60, lambda w: w.state.voyage.sailing)
    began, places = world.t, [(world.position, world.heading)]
    assert world.run(600, lambda w: places.append((w.position, w.heading)) or is_done(w))
    assert world.clearance() > world.skipper.config.margin_floor_m
    assert world.state.progress.reached == (0,)
    assert distance_m(world.position, GOAL.en_m) < 10.0
    by_north = [place[1] for place, _ in places]
    assert all(b > a - 1.0 for a, b in pairwise(by_north))
    assert all(abs(difference_rad(math.pi, heading)) > math.radians(90.0) for _, heading in places[5:])
    off_wind = np.radians(np.arange(91.0, 181.0))
    polar = world.skipper.voyage.boat.polar
    best_mps = max(-math.cos(a) * polar.speed_mps(a, 6.0) for a in off_wind)
    assert world.t - began < 1.2 * GOAL.en_m[1] / best_mps


@pytest.mark.parametrize("off_m", [1.0, 5.0])
@pytest.mark.parametrize("mode", [Mode.MANUAL, Mode.LOITER])
def test_a_voyage_begins_beside_something_solid_by_leading_away_from_it(off_m, mode):
    """Below the margin's floor, as at a quay: no way from there keeps it, and none may come nearer than she is."""
    quay = box(-60.0, -off_m - 20.0, 60.0, -off_m)
    world = make(Goal(en_m=(250.0, 60.0)), obstacles=(quay,), wind=lambda t: (0.0, 5.0), mode=mode)
    assert off_m < world.skipper.config.margin_floor_m
    assert world.run(60, lambda w: w.state.voyage.sailing)
    assert world.run(300, is_done)
    assert world.clearance() >= off_m - 0.3


def test_replans_at_each_waypoint_from_the_next_one_and_before_it_is_reached():
    world = make()
    assert world.run(1500, is_done)
    asked = [
        (t, a) for t, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.WAYPOINT
    ]
    assert len(asked) >= 2
    for _, action in asked:
        assert action.from_seq is not None
    # Uploads of such plans never touch the item being sailed for.
    for t, action in world.actions:
        if isinstance(action, act.UploadMission) and action.set_current is None:
            asked_for = [a for s, a in asked if s <= t][-1]
            assert action.keep_first >= asked_for.from_seq


def test_by_forecast_policy_a_steady_wind_means_no_new_plans():
    steady = make(config={"replan_policy": ReplanPolicy.FORECAST}, wind=lambda t: (0.0, 5.0))
    assert steady.run(1500, is_done)
    reasons = [a.reason for _, a in steady.actions if isinstance(a, act.RequestPlan)]
    assert act.ReplanReason.FORECAST not in reasons
    assert act.ReplanReason.WAYPOINT not in reasons
    shifting = make(config={"replan_policy": ReplanPolicy.FORECAST}, wind=lambda t: (0.0, 5.0 if t < 30 else 9.0))
    assert shifting.run(1500, is_done)
    reasons = [a.reason for _, a in shifting.actions if isinstance(a, act.RequestPlan)]
    assert act.ReplanReason.FORECAST in reasons


def forecast_plans(world):
    return [a for _, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.FORECAST]


@pytest.mark.parametrize(("policy", "count"), [(ReplanPolicy.FORECAST, 1), (ReplanPolicy.WAYPOINT, 0)])
def test_by_forecast_policy_a_wind_that_becomes_less_certain_means_a_plan_at_once(policy, count):
    """Wolsieffer's discussion: planning again only when the uncertainty changes significantly."""
    world = make(
        Goal(en_m=(600.0, 0.0), radius_m=6.0),
        obstacles=(),
        wind=lambda t: (0.0, 5.0),
        config={"replan_policy": policy},
        sigma=math.radians(5.0),
    )
    assert world.run(60)
    assert not forecast_plans(world)
    world.sigma = math.radians(6.0)  # by a fifth: nothing
    assert world.run(20)
    assert not forecast_plans(world)
    world.sigma = math.radians(12.0)
    assert world.run(30)
    assert len(forecast_plans(world)) == count  # one: the new plan, or the old one that was kept, knows of it
    assert all(a.from_seq is None and "less certain" in a.text for a in forecast_plans(world))


def test_by_forecast_policy_a_wind_that_becomes_more_certain_is_used_at_the_next_waypoint():
    world = make(config={"replan_policy": ReplanPolicy.FORECAST}, wind=lambda t: (0.0, 5.0), sigma=math.radians(12.0))
    assert world.run(40, is_sailing)
    world.sigma = math.radians(3.0)
    assert world.run(1500, is_done)
    assert forecast_plans(world)
    assert forecast_plans(world)[0].from_seq is not None


def test_a_90_degree_shift_in_mid_leg():
    world = make(wind=lambda t: (0.0 if t < 60.0 else math.pi / 2, 5.0), obstacles=())
    assert world.run(1200, is_done)
    reasons = {a.reason for _, a in world.actions if isinstance(a, act.RequestPlan)}
    assert reasons & {act.ReplanReason.WIND_SHIFT, act.ReplanReason.NO_GO}


def plans_for(world, reason):
    return [t for t, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is reason]


@pytest.mark.parametrize(("turned_deg", "plans"), [(19.0, 0), (-19.0, 0), (21.0, 1), (-21.0, 1)])
def test_the_mean_of_the_wind_has_turned_by_twenty_degrees(turned_deg, plans):
    """Büsser 3.2.1, on a reach without a waypoint: by 19 degrees no plan, by 21 one."""
    world = make(
        Goal(en_m=(700.0, 0.0), radius_m=6.0),
        obstacles=(),
        wind=lambda t: (math.radians(turned_deg if t > 50.0 else 0.0), 5.0),
    )
    assert world.run(50)
    assert world.state.voyage.sailing
    assert world.run(120)
    assert len(plans_for(world, act.ReplanReason.WIND_SHIFT)) == plans


@pytest.mark.parametrize(("more_m", "is_planned"), [(-1.0, False), (1.0, True)])
def test_off_the_leg_by_more_than_is_allowed(more_m, is_planned):
    """Büsser 3.2.1, in open water: the grid's cell is what is allowed."""
    world = make(Goal(en_m=(700.0, 0.0), radius_m=6.0), obstacles=(), wind=lambda t: (0.0, 5.0))
    assert world.run(60)
    assert world.state.voyage.sailing
    sail, off_m = world.sail, world.skipper.config.grid_size_m + more_m

    def set_off(dt):
        sail(dt)
        world.position = (world.position[0], off_m)

    world.sail = set_off
    assert world.run(40)
    assert bool(plans_for(world, act.ReplanReason.OFF_LEG)) == is_planned


def test_a_plan_is_made_anew_when_it_is_old():
    """Büsser's 60 minutes, cut to one and a half: a leg of four minutes without a waypoint on it."""
    world = make(
        Goal(en_m=(700.0, 0.0), radius_m=6.0), obstacles=(), wind=lambda t: (0.0, 5.0), config={"plan_age_s": 90.0}
    )
    assert world.skipper.config.plan_age_s == 90.0
    assert world.run(600, is_done)
    asked = [t for t, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.PLAN_AGE]
    assert len(asked) >= 2
    assert all(b - a >= 90.0 for a, b in pairwise(asked))


def test_a_header_that_closes_the_leg_is_answered_within_seconds():
    world = make(Goal(en_m=(300.0, 330.0), radius_m=6.0), obstacles=(), wind=lambda t: (0.0 if t < 40 else 0.5, 5.0))
    assert world.run(40)
    assert is_sailing(world)
    assert world.run(
        25, lambda w: any(isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.NO_GO for _, a in w.actions)
    )
    assert world.run(900, is_done)


@pytest.mark.parametrize("step_m", [8.0, 60.0])
def test_a_board_of_short_legs_is_watched_as_one(step_m):
    """A zone that grows makes a chain of a board: each waypoint of it is near, the end of it is not."""
    world = make(Goal(en_m=(300.0, 330.0), radius_m=6.0), obstacles=(), wind=lambda t: (0.0, 5.0))
    assert world.run(40, is_sailing)
    here, route = world.position, world.state.mission.route
    bends = [math.radians(50.0 + 1.5 * n) for n in range(round(120.0 / step_m))]
    points = list(accumulate(bends, lambda at, course: moved(at, course, step_m), initial=here))
    points.append(moved(points[-1], math.radians(-50.0), 60.0))  # she tacks there
    item = route.items[0]
    chain = replace(
        route,
        items=(item,) * len(points),
        points_en_m=(*points[1:], route.points_en_m[-1]),
        leg_from_en_m=tuple(points),
        gate_of=(-1,) * len(points),
    )
    state = with_parts(world.state, mission={"route": chain, "index": 0})
    ctx = StepContext(world.skipper.voyage, world.skipper.config, state, world.snapshot())
    assert board_end(ctx, (points[0], points[1])) == points[-2]


def test_speed_is_not_lost_by_replanning():
    world = make(wind=lambda t: (0.0, 5.0))
    slow = math.inf
    world.run(60)

    def look(w):
        nonlocal slow
        turning = abs(difference_rad(w.heading, bearing_rad(w.track[-6], w.track[-1]))) > 0.3
        if not turning and w.state.pending.upload is not None:
            slow = min(slow, w.speed)
        return is_done(w)

    assert world.run(1200, look)
    assert slow > 1.4


# ------------------------------------------------------------------------------------ goals, buoys
@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
def test_five_laps_of_the_regatta_course_without_missing_a_buoy(side):
    hand = 1.0 if side is Side.PORT else -1.0
    places = [(0.0, 150.0), (-90.0 * hand, 75.0), (0.0, 0.0)]
    start = (20.0 * hand, -40.0)
    world = make(
        *(Goal(en_m=p, side=side, name=f"buoy {n}") for n, p in enumerate(places)),
        obstacles=(),
        voyage={"laps": 5},
        position=start,
        expansions=600,
    )
    seen = set()

    def look(w):
        seen.add(w.state.phase)
        return is_done(w)

    assert world.run(3000, look)
    assert len(world.state.progress.reached) == 15
    assert Phase.BUOY_APPROACH in seen
    for number, place in enumerate(places[:2]):
        turned = sum(difference_rad(bearing_rad(place, b), bearing_rad(place, a)) for a, b in pairwise(world.track))
        assert -hand * turned / (2 * math.pi) == pytest.approx(5.0, abs=0.25), number
        assert min(distance_m(place, p) for p in world.track) > 3.0


def regatta(**changes):
    places = [(0.0, 150.0), (-90.0, 75.0), (0.0, 0.0)]
    return make(
        *(Goal(en_m=p, side=Side.PORT, name=f"buoy {n}") for n, p in enumerate(places)),
        obstacles=(),
        expansions=600,
        **changes,
    )


def turned(world, buoy):
    return sum(difference_rad(bearing_rad(buoy, b), bearing_rad(buoy, a)) for a, b in pairwise(world.track))


@pytest.mark.parametrize("start", [(60.0, -40.0), (-60.0, -40.0), (-70.0, 150.0), (-50.0, 210.0)])
def test_the_first_buoy_is_rounded_from_wherever_the_voyage_begins(start):
    """Buoy course, seed 0: the first leg had no beginning, so its buoy was passed with one gate on either hand."""
    world = regatta(position=start)
    assert world.run(900, lambda w: len(w.state.progress.reached) == 1)
    first = turned(world, (0.0, 150.0))
    assert world.state.progress.missed == 0
    assert math.radians(-420.0) < first < math.radians(-20.0)


def carry_round(world, buoy, until):
    """Carry the boat to the buoy and round it clockwise, 6 m at a time."""
    while not until(world):
        off = distance_m(world.position, buoy)
        bearing = bearing_rad(buoy, world.position) + (0.4 if off < 16.0 else 0.0)
        world.position, world.speed = moved(buoy, bearing, max(15.0, off - 6.0)), 0.0
        world.run(1)


@pytest.mark.parametrize("killed", [False, True])
@pytest.mark.parametrize(
    ("under_way", "slow"), [("plan", {"plan_s": 6.0}), ("upload", {"upload_s": 8.0})], ids=["planned", "uploaded"]
)
def test_a_buoy_left_on_the_wrong_side_is_not_reached_before_it_is_rounded(killed, under_way, slow):
    """Buoy course, seeds 0 and 3: missed, and reached a second later, from where the boat had missed it.

    What was being planned or uploaded when it was missed does not count for the second rounding either.
    """
    buoy = (0.0, 150.0)
    config = {"grid_size_m": 30.0, "keep_gain_s": 0.0, "keep_gain": 0.0}  # whatever gains a little is uploaded
    world = regatta(position=(20.0, -40.0), config=config, **slow)
    assert world.run(600, lambda w: distance_m(w.position, buoy) < 60.0)
    carry_round(world, buoy, lambda w: turned(w, buoy) > math.radians(150.0))
    world.order("replan")
    carry_round(world, buoy, lambda w: getattr(w.state.pending, under_way) is not None)
    if killed:
        restarted(world)
    carry_round(world, buoy, lambda w: said(w, "buoy missed"))
    missed, since = len(world.actions), world.state.plans.made
    world.run(12)
    asked = [a for _, a in world.actions[missed - 1 :]]
    assert any(isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.MISSED_BUOY for a in asked)
    assert all(a.plan_id > since for a in asked if isinstance(a, act.UploadMission))
    assert world.state.progress.reached == ()
    assert world.run(1500, lambda w: w.state.progress.reached)
    assert turned(world, buoy) == pytest.approx(math.radians(-200.0), abs=math.radians(80.0))
    assert world.run(1500, is_done)
    assert world.state.progress.reached == (0, 1, 2)


def test_several_goals_without_a_stop_between():
    goals = [Goal(en_m=p, radius_m=6.0) for p in ((150.0, 0.0), (150.0, 150.0), (0.0, 150.0))]
    world = make(*goals, obstacles=(), wind=lambda t: (math.radians(-45), 5.0))
    assert world.run(900, is_done)
    assert world.state.progress.reached == (0, 1, 2)
    assert all(min(distance_m(p, g.en_m) for p in world.track) <= 6.0 for g in goals)
    assert not any("loitering" in entry[2] for entry in world.log if entry[1] == "holding")


def test_a_band_bounds_the_way():
    made = Goal(en_m=(0.0, 400.0), radius_m=6.0, bandwidth_m=40.0)
    world = make(made, obstacles=(), wind=lambda t: (0.0, 5.0))
    assert world.run(1200, is_done)
    assert max(abs(p[0]) for p in world.track) < 48.0


def test_a_goal_heading_set_by_hand_is_what_his_planner_is_asked_for():
    by = PlannerChoice(algorithm="astar", settings=AstarSettings(grid_m=10.0))
    places = [(0.0, 300.0), (200.0, 300.0)]
    goals = [Goal(en_m=places[0], radius_m=8.0, heading_rad=1.2), Goal(en_m=places[1], radius_m=8.0)]
    world = make(*goals, obstacles=(), wind=lambda t: (math.radians(200.0), 5.0), config={"planner": by})
    assert world.run(1200, is_done)
    asked = [a for _, a in world.actions if isinstance(a, act.RequestPlan) and a.planner.algorithm == "astar"]
    wanted = {a.problem.goal_en: a.planner.settings.goal_heading_rad for a in asked}
    assert wanted[places[0]] == 1.2
    assert wanted[places[1]] is None


def test_a_long_voyage_starts_its_numbering_again():
    places = [(0.0, 60.0), (60.0, 60.0), (60.0, 0.0), (0.0, 0.0)]
    world = make(
        *(Goal(en_m=p, radius_m=6.0) for p in places),
        obstacles=(),
        voyage={"laps": 6},
        config={"max_items": 14},
        wind=lambda t: (math.radians(45), 5.0),
        expansions=300,
    )
    assert world.run(3000, is_done)
    assert len(world.state.progress.reached) == 24
    assert max(len(a.items) for _, a in world.actions if isinstance(a, act.UploadMission)) <= 24


# ---------------------------------------------------------------------------------------- permission
def test_a_dry_run_touches_nothing_and_says_what_it_waits_for():
    world = make(permissions=DRY_RUN)
    world.run(200)
    kinds = {type(a) for _, a in world.actions}
    assert kinds <= {act.ReadMission, act.RequestPlan, act.Announce, act.CancelPlan}
    assert "permission" in world.state.why


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (Permissions(may_upload=True), "operator to set AUTO"),
        (Permissions(may_upload=True, may_set_mode=True), "operator to arm"),
    ],
)
def test_waits_for_what_it_may_not_do(given, words):
    world = make(permissions=given)
    world.run(60)
    assert words in world.state.why
    assert not world.armed
    world.set_mode(Mode.AUTO)
    world.armed = True
    world.set_mode(Mode.AUTO)
    assert world.run(30, is_sailing)


def test_does_not_take_a_boat_that_somebody_drives():
    world = make(mode=Mode.MANUAL, armed=True)
    world.run(60)
    assert world.mode is Mode.MANUAL
    assert "waiting for the operator" in world.state.why


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        ({"vehicle": None, "position_en_m": None, "vehicle_age_s": None}, "position"),
        ({"heartbeat_age_s": None}, "nothing yet"),
    ],
)
def test_waiting_names_what_is_missing(missing, words):
    world = make(extra=missing)
    world.run(10)
    assert world.state.phase is Phase.WAITING
    assert words in world.state.why
    world.extra = {}
    assert world.run(30, is_sailing)


@pytest.mark.parametrize("health", [WindHealth.NONE, WindHealth.SETTLING, WindHealth.UNTRUSTED])
def test_does_not_start_in_a_wind_that_it_cannot_believe(health):
    world = make(wind_health=health)
    world.run(30)
    assert world.state.phase is Phase.WAITING
    assert "wind" in world.state.why
    assert world.count(act.RequestPlan) == 0


# ------------------------------------------------------------------------------------------ operator
@pytest.mark.parametrize("mode", [Mode.MANUAL, Mode.HOLD, Mode.RTL, Mode.GUIDED, Mode.LOITER])
def test_the_operator_takes_over_and_gives_back(mode):
    world = make()
    world.run(60)
    world.set_mode(mode)
    world.step()
    assert world.state.phase is Phase.OPERATOR
    before = len(world.actions)
    world.run(120)
    quiet = [a for _, a in world.actions[before:] if not isinstance(a, act.Announce)]
    assert quiet == []
    assert world.mode is mode
    world.position = (world.position[0] + 30.0, world.position[1] - 20.0)
    world.set_mode(Mode.AUTO)
    assert world.run(1500, is_done)
    assert world.clearance() > world.skipper.config.margin_floor_m - 1.0
    assert any(isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.OPERATOR_BACK for _, a in world.actions)


def test_disarming_is_taking_over():
    world = make()
    world.run(60)
    world.armed = False
    world.run(30)
    assert world.state.phase is Phase.OPERATOR
    assert world.count(act.Arm) == 1
    world.armed = True
    world.set_mode(Mode.AUTO)
    assert world.run(1500, is_done)


def test_a_mission_that_the_operator_brought_is_his():
    world = make()
    world.run(60)
    theirs = (MissionItem(command=16, lat_e7=511_010_000, lon_e7=-13_000_000), MissionItem(command=20))
    world.set_mode(Mode.MANUAL)
    world.run(5)
    world.install(theirs)
    world.set_mode(Mode.AUTO)
    world.run(60)
    assert world.mission == theirs
    assert world.state.phase is Phase.OPERATOR
    assert "not ours" in world.state.why
    world.order("replace")
    assert world.run(30, lambda w: w.state.why == "making a new plan")  # "making the first plan" was said
    assert world.run(1500, is_done)


def test_a_mission_changed_under_way_is_noticed_and_left_alone():
    world = make()
    world.run(60)
    theirs = (MissionItem(command=16, lat_e7=511_010_000, lon_e7=-13_000_000), MissionItem(command=20))
    world.install(theirs)
    world.events.append(StatusText(t_s=world.t, severity=6, text="Flight plan received"))
    uploads = world.count(act.UploadMission)
    world.run(60)
    assert world.state.mission.foreign
    assert world.count(act.UploadMission) == uploads
    assert said(world, "foreign mission")


def test_a_foreign_mission_is_not_resumed_at_the_start():
    theirs = (MissionItem(command=16, lat_e7=511_010_000, lon_e7=-13_000_000), MissionItem(command=20))
    world = make(mission=theirs, seq=1)
    world.run(60)
    assert world.mission == theirs
    assert not world.armed
    assert "not ours" in world.state.why
    allowed = make(
        mission=theirs,
        seq=1,
        permissions=Permissions(may_upload=True, may_set_mode=True, may_arm=True, may_replace_foreign=True),
    )
    assert allowed.run(1500, is_done)


def test_hold_by_wish_and_go_on():
    world = make()
    world.run(60)
    world.order("hold")
    world.run(90)
    assert world.state.phase is Phase.HOLDING
    assert len(sailed_part(world.mission)) == world.seq
    world.order("go_on")
    assert world.run(1500, is_done)


# ----------------------------------------------------------------------------------- restart, reboot
@pytest.mark.parametrize("when", range(1, 60, 4))
def test_killed_at_any_moment_it_goes_on_without_an_upload(when):
    world = make(wind=lambda t: (0.0, 5.0))
    world.run(when)
    mission, uploads = world.mission, world.count(act.UploadMission)
    restarted(world)
    if mission:
        world.run(8)
        assert world.state.mission.route is not None
        assert world.count(act.UploadMission) == uploads
        assert is_same_mission(world.mission, mission)
        assert said(world, "adopted")
    assert world.run(1500, is_done)
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_the_goals_that_were_reached_are_known_over_a_restart():
    """Summary, page and "out of time" counted from nothing again."""
    near, far = Goal(en_m=(60.0, 0.0), radius_m=6.0), Goal(en_m=(160.0, 0.0), radius_m=6.0)
    world = make(near, far, obstacles=(), wind=lambda t: (0.0, 5.0))
    assert world.run(300, lambda w: w.state.progress.reached == (0,))
    restarted(world)
    assert world.run(10, lambda w: w.state.progress.reached == (0,))
    assert world.run(300, is_done)
    assert world.state.progress.reached == (0, 1)


def test_killed_in_the_middle_of_an_upload_the_mixture_is_put_right():
    world = make(uploads_fail=lambda n: UploadResult.TIMEOUT if n == 2 else UploadResult.OK)
    killed = []

    def at_mixture(w):
        if w.uploads == 2 and not killed:
            killed.append(w.t)
            restarted(w)
        return is_done(w)

    assert world.run(1800, at_mixture)
    assert killed
    assert world.clearance() > world.skipper.config.margin_floor_m


@pytest.mark.parametrize(
    "result", [UploadResult.TIMEOUT, UploadResult.REFUSED, UploadResult.MISMATCH, UploadResult.LINK]
)
def test_failed_uploads_are_looked_at_and_made_good(result):
    world = make(uploads_fail=lambda n: result if n in {2, 3, 5} else UploadResult.OK)
    assert world.run(1800, is_done)
    assert said(world, "upload failed")
    route = world.state.mission.route
    assert route is not None
    assert is_same_mission(world.mission, route.items)


def test_the_autopilot_reboots_under_way():
    world = make()
    world.run(80)
    world.boot_s -= 150.0
    world.armed, world.mode = False, Mode.MANUAL
    world.events.append(AutopilotRebooted())
    uploads = world.count(act.UploadMission)
    assert world.run(30, lambda w: w.armed and w.mode is Mode.AUTO)
    assert world.count(act.UploadMission) == uploads
    assert world.run(1500, is_done)


def test_after_a_reboot_without_permission_it_waits():
    world = make()
    world.run(80)
    world.boot_s -= 150.0
    world.armed, world.mode, world.permissions = False, Mode.MANUAL, Permissions(may_upload=True)
    world.run(60)
    assert not world.armed
    assert world.state.phase is Phase.WAITING
    assert "operator" in world.state.why


# -------------------------------------------------------------------------------------- nothing found
def nothing(problem, seed):
    """Answer as a planner that has looked and found no path."""
    return replace(failed("none was found", seed=seed, algorithm="auto"), status=PlanStatus.TIMEOUT)


def test_nothing_found_climbs_down_the_ladder_and_backs_off():
    world = make(planner=nothing)
    world.run(1800)
    asked = world.count(act.RequestPlan)
    assert 10 < asked < 120
    assert said(world, "no plan at all")
    assert world.state.phase is Phase.WAITING
    assert "next try" in world.state.why


def test_an_old_plan_that_is_sound_stays_when_nothing_better_is_found():
    world = make(wind=lambda t: (0.0, 5.0))
    assert world.run(60, is_sailing)
    world.planner = nothing
    assert world.run(1500, is_done)
    assert said(world, "no plan")
    assert world.count(act.UploadMission) == 1


def beside(world):
    """Return a planner that goes 8 m aside of the straight way, and is no faster so."""

    def planned(problem, seed):
        found = plan(problem, expansions=world.expansions, seed=seed)
        start, goal = found.waypoints_en[0], found.waypoints_en[-1]
        return replace(found, waypoints_en=np.array([start, 0.5 * (start + goal) + (0.0, 8.0), goal]))

    return planned


def test_an_old_plan_that_is_as_good_as_a_new_one_stays():
    """A new plan for the old one's age goes another way and is no faster: the one on board is sailed on."""
    world = make(
        Goal(en_m=(700.0, 0.0), radius_m=6.0), obstacles=(), wind=lambda t: (0.0, 5.0), config={"plan_age_s": 90.0}
    )
    world.planner = beside(world)
    assert world.run(600, is_done)
    asked = [t for t, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.PLAN_AGE]
    assert asked
    assert said(world, "plan kept")
    assert not [t for t, a in world.actions if isinstance(a, act.UploadMission) and t > asked[0]]


def test_an_old_plan_that_stays_is_held_to_what_it_was_kept_under():
    """A current comes and changes no way: it is planned for once, not each minute, and hides no reason behind it."""
    world = make(Goal(en_m=(900.0, 0.0), radius_m=6.0), obstacles=(), wind=lambda t: (0.0, 5.0))
    world.planner = beside(world)
    assert world.run(60, is_sailing)
    sailed = world.state.mission.route
    world.extra["current"] = WaterCurrent(east_mps=0.3, is_significant=True)
    world.run(250)
    assert said(world, "plan kept")
    asked = [t for t, a in world.actions if isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.CURRENT]
    assert len(asked) == 1
    kept = world.state.mission.route
    assert (kept.points_en_m, kept.plan_id, kept.why) == (sailed.points_en_m, sailed.plan_id, sailed.why)
    assert (kept.plan_current_east_mps, kept.plan_current_north_mps) == (0.3, 0.0)


def test_a_closed_way_ends_in_a_named_hold():
    wall = (box(-400, 150, 400, 200),)
    world = make(obstacles=wall, voyage={"limits": box(-300, -100, 300, 600)})
    world.run(300)
    assert said(world, "ladder 0")
    assert world.state.phase in {Phase.WAITING, Phase.HOLDING}
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_a_way_that_opens_only_at_the_floor_is_sailed_with_less_margin():
    gate = (box(-300, 150, -13, 200), box(13, 150, 300, 200))  # the floor, and her track beside the line
    world = make(
        Goal(en_m=(0.0, 300.0), radius_m=6.0),
        obstacles=gate,
        wind=lambda t: (math.pi / 2, 5.0),
        voyage={"limits": box(-280, -100, 280, 500)},
    )
    world.extra["limits"] = AutopilotLimits(
        sail_no_go_angle_rad=world.no_go, sail_xtrack_max_m=world.corridor, wp_speed_mps=2.0
    )
    assert world.run(900, is_done)
    assert world.clearance() > 8.0
    assert any("margin" in entry[2] for entry in world.log)


@pytest.mark.parametrize(("autopilot_deg", "is_told"), [(38.0, True), (43.0, False), (45.0, False)])
def test_an_autopilot_that_points_higher_than_the_boat_is_told(autopilot_deg, is_told):
    world = make(obstacles=())
    assert round(math.degrees(world.skipper.voyage.boat.no_go_half_rad)) == 45
    world.extra["limits"] = AutopilotLimits(sail_no_go_angle_rad=math.radians(autopilot_deg), wp_speed_mps=2.0)
    assert world.run(120, is_sailing)
    assert bool(said(world, "no-go")) is is_told


@pytest.mark.parametrize(
    ("shore_m", "corridor_m", "margin_m", "is_told"),
    # 14.3 m are asked for; without a corridor 7.2, and nothing bounds how far she beats
    [(13.0, 10.0, 12.0, True), (400.0, 10.0, 12.0, False), (400.0, 10.0, 15.0, False), (400.0, 0.0, 6.0, True)],
)
def test_a_margin_that_the_autopilot_does_not_keep_is_told_where_the_way_needs_it(
    shore_m, corridor_m, margin_m, is_told
):
    shore = box(0, -shore_m - 50, 300, -shore_m)
    config = {"margin_m": margin_m, "margin_floor_m": 5.0}
    world = make(Goal(en_m=(250.0, 0.0)), obstacles=(shore,), wind=lambda t: (0.0, 5.0), config=config)
    world.extra["limits"] = AutopilotLimits(sail_xtrack_max_m=corridor_m, wp_speed_mps=2.0)
    assert world.run(120, is_sailing)
    assert bool(said(world, "margin")) is is_told


def test_a_margin_is_told_when_an_order_leads_her_where_it_is_needed():
    rocks = (box(-40, 240, -13, 260), box(13, 240, 40, 260))
    world = make(Goal(en_m=(250.0, 0.0)), obstacles=rocks, wind=lambda t: (math.pi / 2, 5.0), config={"margin_m": 12.0})
    world.extra["limits"] = AutopilotLimits(sail_xtrack_max_m=10.0, wp_speed_mps=2.0)
    assert world.run(120, is_sailing)
    assert not said(world, "margin")
    there = FRAME.geo_from_en(0.0, 300.0)
    world.order(f"goal {there.lat_deg:.7f} {there.lon_deg:.7f}")
    assert world.run(60, lambda w: said(w, "margin"))
    assert world.run(60)
    assert len(said(world, "margin")) == 1


# ------------------------------------------------------------------------------------------ watchdogs
def test_the_boat_in_irons_bears_away_and_sails_on():
    world = make(obstacles=())
    world.run(60)
    stuck = {"until": world.t + 14.0}
    sail = world.sail

    def held(dt):
        if world.t < stuck["until"] and world.mode is Mode.AUTO:
            world.heading, world.speed = world.wind(world.t)[0], 0.05
            return
        sail(dt)

    world.sail = held
    assert world.run(20, lambda w: w.mode is Mode.GUIDED)
    assert any(isinstance(a, act.SteerHeading) for _, a in world.actions)
    assert world.run(40, lambda w: w.mode is Mode.AUTO)
    assert world.state.phase is not Phase.OPERATOR
    assert world.run(1500, is_done)
    reasons = {a.reason for _, a in world.actions if isinstance(a, act.RequestPlan)}
    assert act.ReplanReason.IN_IRONS in reasons
    assert act.ReplanReason.ORDER not in reasons


def test_after_two_failed_tacks_it_gybes_round():
    world = make(obstacles=(), wind=lambda t: (0.0, 5.0), config={"no_go_patience_s": 1e9})
    assert world.run(60, is_sailing)
    world.state = with_parts(world.state, steering={"irons_s": (world.t - 60.0, world.t - 5.0)})
    world.order("replan")
    assert world.run(30, lambda w: said(w, "gybing round"))
    world.run(3)
    points = world.state.mission.route.points_en_m[world.state.mission.index : -1]
    courses = [bearing_rad(a, b) for a, b in pairwise([world.position, *points])]
    assert len(points) >= 4  # the corner, two about the loop, the goal
    assert not any(is_tack(a, b, 0.0) for a, b in pairwise(courses[1:]))
    tacks = world.tacks
    assert world.run(1500, is_done)
    assert world.tacks == tacks


def test_becalmed_it_waits_without_plans_and_sails_on():
    world = make(wind=lambda t: (0.0, 5.0 if t < 60.0 or t > 600.0 else 0.2))
    world.run(200)
    assert any(r.name == "becalmed" for r in world.state.alarms.raised)
    asked = world.count(act.RequestPlan)
    world.run(300)
    assert world.count(act.RequestPlan) == asked
    assert world.run(2000, is_done)


def test_a_position_jump_into_an_island_moves_no_plan():
    world = make()
    world.run(60)
    asked = world.count(act.RequestPlan)
    world.position_offset = (-world.position[0], 140.0 - world.position[1])
    world.step()
    assert any(r.name == "position jump" for r in world.state.alarms.raised)
    world.position_offset = (0.0, 0.0)
    world.step()
    world.run(3)
    assert world.count(act.RequestPlan) == asked
    assert world.run(1500, is_done)
    assert world.clearance() > world.skipper.config.margin_floor_m


def test_a_position_that_jumped_is_planned_from_when_the_way_from_there_is_shut():
    """The autopilot sails by it at once: waiting for it to be believed would end on the island."""
    world = make()
    world.run(60)
    asked = world.count(act.RequestPlan)
    middle = (-5.0, 140.0)
    away = bearing_rad(world.state.mission.route.points_en_m[world.state.mission.index], middle)
    world.position = moved(middle, away, 55.0)  # moved, and truly so: behind an island, seen from the waypoint
    moved_at = len(world.track)
    world.run(3)
    assert any(r.name == "position jump" for r in world.state.alarms.raised)
    assert world.count(act.RequestPlan) > asked
    assert world.run(1500, is_done)
    assert world.skipper.voyage.area.path_clearance_m(world.track[moved_at:]) > 0.0


def test_a_boat_that_drifted_behind_something_before_it_sails_is_planned_for_again_at_once():
    world = make(permissions=Permissions(may_upload=True, may_set_mode=True))
    assert world.run(30, lambda w: bool(w.mission) and w.mode is Mode.AUTO)
    world.run(20)
    middle = (-5.0, 140.0)
    away = bearing_rad(world.state.mission.route.points_en_m[0], middle)
    there = moved(middle, away, 75.0)
    steps = math.ceil(distance_m(world.position, there) / 4.0)
    for n in range(steps):  # she drifts: a boat that leapt would not be believed
        world.position = moved(
            world.position, bearing_rad(world.position, there), distance_m(world.position, there) / (steps - n)
        )
        world.step()
    asked = world.t - steps
    assert world.run(28, lambda w: any(t >= asked for t, a in w.actions if isinstance(a, act.RequestPlan)))
    world.run(5)
    ahead = [world.position, *world.state.mission.route.points_en_m[:-1]]
    assert world.skipper.voyage.area.path_clearance_m(ahead) > 0.0


def test_a_position_failsafe_that_is_over_before_it_is_seen_is_none_of_the_operators_either():
    world = make()
    world.run(60)
    world.set_mode(Mode.HOLD)
    world.events.append(StatusText(t_s=world.t, severity=2, text="EKF failsafe"))
    assert world.run(10, lambda w: w.mode is Mode.AUTO)


def stopped_by_failsafe(world, *texts):
    world.set_mode(Mode.HOLD)
    world.system_status, world.ekf_ok, world.drift_mps = 5, False, 1.0
    world.events += [StatusText(t_s=world.t, severity=2, text=text) for text in texts]
    world.run(12)
    world.system_status, world.ekf_ok = 4, True


@pytest.mark.parametrize("text", ["EKF variance", "EKF failsafe"])
def test_a_position_failsafe_is_no_operator_and_the_boat_sails_on(text):
    world = make()
    world.run(60)
    stopped_by_failsafe(world, text)
    assert world.state.phase is Phase.HOLDING
    assert "position filter is well" in world.state.why
    assert world.mode is Mode.HOLD
    plans = world.count(act.RequestPlan)
    assert world.run(10, lambda w: w.mode is Mode.AUTO)
    assert world.count(act.RequestPlan) == plans + 1  # from where it drifted to, before AUTO
    world.drift_mps = 0.0
    assert world.run(1500, is_done)
    assert said(world, "position failsafe")
    assert not said(world, "operator")
    assert world.clearance() > 0.0


@pytest.mark.parametrize("texts", [(), ("PreArm: Battery 1 low voltage failsafe",), ("EKF failsafe cleared",)])
def test_hold_without_a_sign_of_a_failsafe_is_the_operators(texts):
    world = make()
    world.run(60)
    world.set_mode(Mode.HOLD)
    world.drift_mps = 1.0
    world.events += [StatusText(t_s=world.t, severity=2, text=text) for text in texts]
    world.run(12)
    assert world.state.phase is Phase.OPERATOR
    world.run(60)
    assert world.mode is Mode.HOLD


def test_an_operator_who_takes_another_mode_after_a_failsafe_has_the_boat():
    world = make()
    world.run(60)
    stopped_by_failsafe(world, "EKF failsafe")
    world.set_mode(Mode.MANUAL)
    world.run(3)
    assert world.state.phase is Phase.OPERATOR


def test_without_permission_a_failsafe_waits_for_the_operator():
    world = make()
    world.run(60)
    world.permissions = replace(world.permissions, may_set_mode=False)
    stopped_by_failsafe(world, "EKF failsafe")
    world.run(30)
    assert world.state.phase is Phase.OPERATOR
    assert world.mode is Mode.HOLD


def test_a_mission_held_back_by_an_upload_cut_short_is_ours_and_planned_on_from():
    world = make()
    world.run(60)
    world.uploads_fail = lambda n: UploadResult.LINK
    assert world.run(300, lambda w: any(kind == "upload" for _, kind, _ in w.pending))
    action = next(a for _, kind, a in world.pending if kind == "upload")
    assert action.stopgap is not None
    world.install((*world.mission[: action.keep_first], action.stopgap, *action.items[action.keep_first + 1 :]))
    assert world.run(10, lambda w: said(w, "held back"))
    assert world.state.mission.route.expected_clearance_m is None, "no plan was judged that ends there"
    assert not said(world, "foreign mission")
    assert is_same_mission(world.state.mission.route.items, world.mission)
    world.uploads_fail = lambda n: UploadResult.OK
    assert world.run(1500, is_done)
    assert world.clearance() > 0.0


def test_an_untrusted_wind_changes_no_plan():
    world = make()
    world.run(60)
    world.wind_health = WindHealth.UNTRUSTED
    world.run(10)
    asked = world.count(act.RequestPlan)
    world.run(30)
    assert world.count(act.RequestPlan) == asked
    assert "wind untrusted" in world.state.why
    world.wind_health = WindHealth.GOOD
    assert world.run(1500, is_done)


@pytest.mark.parametrize("seconds", [3, 30])
def test_a_silent_link_means_no_actions(seconds):
    world = make()
    world.run(60)
    before = len(world.actions)
    for n in range(seconds):
        world.heartbeat_age = 3.1 + n
        world.step()
    assert all(isinstance(a, (act.Announce, act.CancelPlan)) for _, a in world.actions[before:])
    world.heartbeat_age = 0.2
    assert world.run(1500, is_done)


def test_without_a_next_plan_it_loiters_and_goes_on_when_there_is_one():
    goals = [Goal(en_m=(150.0, 0.0), radius_m=6.0), Goal(en_m=(150.0, 150.0), radius_m=6.0)]
    world = make(*goals, obstacles=(), wind=lambda t: (math.radians(-45), 5.0))
    assert world.run(30, is_sailing)
    world.planner = lambda problem, seed: None
    world.run(150)
    assert world.state.phase is Phase.HOLDING
    assert distance_m(world.position, (150.0, 0.0)) < 20.0
    world.planner = None
    assert world.run(900, is_done)


def test_a_critical_battery_goes_to_the_refuge():
    world = make(obstacles=(), voyage={"refuges": ((120.0, 60.0),)})
    world.run(60)
    snapshot = world.snapshot

    def low():
        made = snapshot()
        return replace(made, autopilot=replace(made.autopilot, battery_remaining=0.05))

    world.snapshot = low
    assert world.run(300, lambda w: distance_m(w.position, (120.0, 60.0)) < 12.0)
    world.run(60)
    assert distance_m(world.position, (120.0, 60.0)) < 25.0


# ------------------------------------------------------------------------------------------- headings
def test_by_headings_under_guided_it_arrives_and_hands_back():
    world = make(
        Goal(en_m=(250.0, 120.0), radius_m=8.0),
        Goal(en_m=(0.0, 200.0), radius_m=8.0),
        obstacles=(),
        config={"guidance": Guidance.HEADING},
        wind=lambda t: (0.0, 5.0),
    )
    assert world.run(40, lambda w: w.mode is Mode.GUIDED)
    assert world.run(1500, is_done)
    assert world.state.progress.reached == (0, 1)
    assert world.count(act.SteerHeading) > 100
    world.run(20)
    assert world.mode is Mode.AUTO
    assert world.seq == len(sailed_part(world.mission))
    assert distance_m(world.position, (0.0, 200.0)) < 25.0


def test_by_headings_the_operator_is_still_the_operator():
    world = make(config={"guidance": Guidance.HEADING}, obstacles=())
    assert world.run(60, lambda w: w.mode is Mode.GUIDED)
    world.run(20)
    world.set_mode(Mode.HOLD)
    sent = world.count(act.SteerHeading)
    world.run(30)
    assert world.state.phase is Phase.OPERATOR
    assert world.count(act.SteerHeading) == sent
    world.set_mode(Mode.AUTO)
    assert world.run(1500, is_done)


@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
def test_by_headings_it_rounds_buoys(side):
    hand = 1.0 if side is Side.PORT else -1.0
    places = [(0.0, 150.0), (-90.0 * hand, 75.0), (0.0, 0.0)]
    world = make(
        *(Goal(en_m=p, side=side) for p in places),
        obstacles=(),
        config={"guidance": Guidance.HEADING},
        voyage={"laps": 2},
        position=(20.0 * hand, -40.0),
        expansions=600,
    )
    assert world.run(3000, is_done)
    assert len(world.state.progress.reached) == 6
    assert min(distance_m(places[0], p) for p in world.track) > 3.0


@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
@pytest.mark.parametrize("twd_deg", [-20.0, 0.0, 20.0])
def test_by_headings_nothing_is_steered_to_the_buoys_side_of_what_is_wanted(side, twd_deg):
    """Büsser 3.2.4, on the way to a windward mark: 30 degrees off the buoy, and never 10 nearer."""
    hand, buoy = 1.0 if side is Side.PORT else -1.0, (0.0, 150.0)
    world = make(
        Goal(en_m=buoy, side=side),
        Goal(en_m=(0.0, 0.0)),
        obstacles=(),
        wind=swinging_about(twd_deg),
        config={"guidance": Guidance.HEADING},
        expansions=600,
    )
    near, before = [], [(world.position, 0)]

    def look(w):
        place, seen = before[0]
        if w.state.progress.gate == 0 and 10.0 < distance_m(place, buoy) < 25.0:
            near.extend(
                hand * difference_rad(a.heading_rad, bearing_rad(place, buoy))
                for _, a in w.actions[seen:]
                if isinstance(a, act.SteerHeading)
            )
        before[0] = (w.position, len(w.actions))
        return is_done(w)

    assert world.run(1500, look)
    assert near
    assert min(near) > math.radians(19.0), np.degrees(near)
    assert world.state.progress.missed == 0


@pytest.mark.parametrize(
    ("place", "words"),
    [((0.0, -267.0), "she is 167 m outside the fence"), ((0.0, -111_000.0), "she is 111 km from the first goal")],
)
def test_a_boat_that_lies_elsewhere_is_told_so(place, words):
    """It said "next try in 10 s" and nothing else."""
    world = make(voyage={"limits": shapely.box(-200.0, -100.0, 200.0, 400.0)})
    world.position = place
    assert world.run(60, lambda w: any(words in entry[2] for entry in w.log)), world.state.why


def test_the_first_plan_is_no_replan():
    world = make()
    assert world.run(60, is_sailing)
    assert world.state.plans.replans == 0
    assert world.run(600, lambda w: w.state.plans.replans == 1)


def test_where_uploading_is_not_permitted_she_waits_for_no_plan():
    """She told that she was waiting for a plan; one was ready, and might not be uploaded."""
    world = make()
    assert world.run(60, is_sailing)
    world.planner = nothing
    world.run(5)
    world.order("hold")
    assert world.run(60, lambda w: not w.state.pending.upload and w.state.mission.index == len(w.mission) - 1)
    world.permissions = replace(world.permissions, may_upload=False)
    world.order("go_on")
    assert world.run(30, lambda w: "uploading is not permitted" in w.state.why)

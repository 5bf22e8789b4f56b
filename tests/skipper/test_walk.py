"""Every state x every event: no exception, no forbidden action, a sentence why, and the same answer twice."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely

from companion.mavlink.vehicle_identity import Identity
from companion.messages import Mode, StatusText
from companion.planner import plan
from companion.safety import FAILSAFES, SETTINGS, TABLE, WORD_OF, Response
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, DRY_RUN, Permissions
from companion.skipper.step.snapshot import (
    AutopilotRebooted,
    CommandOutcome,
    CommandResult,
    Disbelieved,
    ModeChanged,
    PlanOutcome,
    ReadOutcome,
    UploadOutcome,
    UploadResult,
    WindEstimate,
    WindHealth,
)
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import bearing_rad, moved
from companion.skipper.way.voyage import Goal, Side
from companion.traffic import TrafficPicture
from tests.skipper.test_voyage import ISLANDS, make
from tests.skipper.world import check_invariants, order, with_parts
from tests.traffic.conftest import vessel

ORDERS = (
    "hold",
    "go_on",
    "skip_goal",
    "refuge",
    "refuge 3",
    "refuge Nowhere",
    "home",
    "goal 51.1020 -1.3000",
    "goal 10 10",
    "replan",
    "stop",
    "adopt",
    "replace",
    "why",
    "forget_shoal",
    "forget_shoal 7",
)


# --------------------------------------------------------------------------------------------- states
@cache
def states():
    """Return name -> (world, state, snapshot) for each phase and for what may be pending in it."""
    out = {}

    def keep(name, world):
        snapshot, skipper = world.snapshot(), world.skipper
        boat = replace(skipper.voyage.boat, max_tws_mps=15.0, min_tws_mps=0.5)
        skipper = replace(skipper, voyage=replace(skipper.voyage, boat=boat))
        out[name] = (skipper, world.state, replace(snapshot, events=(), outcomes=()))

    fresh = make()
    keep("idle", fresh)
    fresh.run(1)
    keep("waiting", fresh)
    fresh.run(300, lambda w: w.state.phase is Phase.NEW_CALCULATION)
    keep("new calculation", fresh)
    fresh.run(300, lambda w: w.state.pending.upload is not None)
    keep("first upload", fresh)
    fresh.run(300, lambda w: w.state.voyage.sailing and w.state.phase is Phase.STANDARD)
    fresh.run(20)
    keep("standard", fresh)
    fresh.run(900, lambda w: w.state.voyage.sailing and w.state.pending.plan is not None)
    keep("planning under way", fresh)
    fresh.run(900, lambda w: w.state.voyage.sailing and w.state.pending.upload is not None)
    keep("uploading under way", fresh)
    taken = make()
    taken.run(60)
    taken.set_mode(Mode.HOLD)
    taken.run(5)
    keep("operator", taken)
    taken.set_mode(Mode.AUTO)
    taken.step()
    keep("comparing", taken)
    held = make()
    held.run(60)
    held.order("hold")
    held.run(60)
    keep("holding", held)
    held.order("stop")
    held.run(2)
    keep("given up", held)
    homeward = make()
    homeward.run(60)
    homeward.order("goal 51.1020 -1.3000")
    homeward.run(20)
    keep("to a place", homeward)
    near = make(Goal(en_m=(300.0, 0.0)), obstacles=(), heading=math.pi / 2)
    near.run(60)
    near.extra = {"traffic": on_collision_course(near.snapshot())}
    near.run(20, lambda w: w.state.by_field.seen_guided)
    keep("last resort", near)
    there = make()
    there.run(1500, lambda w: w.state.phase is Phase.DESTINATION_APPROACH)
    keep("destination approach", there)
    there.run(1500, lambda w: w.state.phase is Phase.DONE)
    keep("done", there)
    buoys = make(Goal(en_m=(0.0, 60.0), side=Side.PORT), Goal(en_m=(-60.0, 30.0), side=Side.PORT), obstacles=())
    buoys.run(900, lambda w: w.state.phase is Phase.BUOY_APPROACH)
    keep("buoy approach", buoys)
    broken = make(uploads_fail=lambda n: UploadResult.TIMEOUT if n > 1 else UploadResult.OK)
    broken.run(900, lambda w: w.state.mission.unsure_route is not None)
    keep("after a failed upload", broken)
    return out


NAMES = (
    "idle",
    "waiting",
    "new calculation",
    "first upload",
    "standard",
    "planning under way",
    "uploading under way",
    "operator",
    "comparing",
    "holding",
    "last resort",
    "destination approach",
    "done",
    "buoy approach",
    "after a failed upload",
    "to a place",
    "given up",
)


# --------------------------------------------------------------------------------------------- events
def wind(**changes):
    return lambda s: replace(s, wind=replace(s.wind, **changes))


def forecast(tws_mps):
    return lambda s: wind(
        forecast=s.wind.forecast
        and replace(s.wind.forecast, mean_tws_mps=np.full_like(s.wind.forecast.mean_tws_mps, tws_mps))
    )(s)


def status(**changes):
    return lambda s: replace(s, autopilot=replace(s.autopilot, **changes))


def vehicle(**changes):
    return lambda s: replace(s, vehicle=replace(s.vehicle, **changes))


def event(*events):
    return lambda s: replace(s, events=events)


def ids(state):
    return [
        n
        for n in (
            state.pending.plan.request_id if state.pending.plan else None,
            state.pending.upload.upload_id if state.pending.upload else None,
            state.pending.read[0] if state.pending.read else None,
            state.pending.command[0] if state.pending.command else None,
        )
        if n is not None
    ] or [99_999]


def outcomes(make_outcome):
    return lambda s, state: replace(s, outcomes=tuple(make_outcome(n) for n in ids(state)))


def beside(snapshot, state):
    """Return a place 22 m to the right of the boat's leg: off it, and not far enough for a jump."""
    heading = snapshot.vehicle.heading_rad
    route, index = state.mission.route, state.mission.index
    if route is not None:
        heading = bearing_rad(route.leg_from_en_m[index], route.points_en_m[index])
    return moved(snapshot.position_en_m, heading + math.pi / 2, 22.0)


def towards_an_island(snapshot, in_s=200.0):
    """Return the velocity that a boat without wind drifts onto the nearest island with."""
    here = snapshot.position_en_m
    island = min(ISLANDS, key=lambda p: p.distance(shapely.Point(here)))
    there = island.representative_point()
    return (there.x - here[0]) / in_s, (there.y - here[1]) / in_s


def on_collision_course(snapshot, gap_m=90.0):
    """Return the picture of a boat of 12 m that is ``gap_m`` to the east and comes straight at ours."""
    east, north = snapshot.position_en_m
    return TrafficPicture(
        t_s=snapshot.t_s,
        vessels=(
            vessel(
                en=(east + gap_m, north), course_deg=270.0, speed_mps=4.0, t_s=snapshot.t_s, size=(6.0, 6.0, 2.0, 2.0)
            ),
        ),
    )


MIDNIGHT_S = 1_780_963_200.0  # 2026-06-09, UTC


EVENTS = {
    "nothing": lambda s: s,
    # one for each watchdog, by its name
    "link silent": lambda s: replace(s, heartbeat_age_s=40.0),
    "position lost": lambda s: replace(s, vehicle_age_s=40.0),
    "position jump": lambda s: replace(s, position_en_m=(s.position_en_m[0] + 500.0, s.position_en_m[1])),
    "wind untrusted": wind(health=WindHealth.UNTRUSTED, verdict="frozen"),
    "wind contradicted": lambda s: replace(s, unsure="the wind's direction leapt by +90° and she goes astern"),
    "strong wind": forecast(25.0),
    "light wind": forecast(0.1),
    "becalmed": lambda s: replace(
        vehicle(velocity_en_mps=(0.0, 0.0))(s),
        wind=replace(s.wind, health=WindHealth.LIGHT, mean_tws_mps=0.1, present_tws_mps=0.1),
    ),
    "drifting": lambda s: replace(
        vehicle(velocity_en_mps=towards_an_island(s))(s),
        wind=replace(s.wind, health=WindHealth.LIGHT, mean_tws_mps=0.1, present_tws_mps=0.1),
    ),
    "in irons": lambda s: replace(
        vehicle(velocity_en_mps=(0.0, -0.1), heading_rad=s.wind.present_twd_from_rad or 0.0)(s)
    ),
    "vessel too near": lambda s: replace(s, traffic=on_collision_course(s)),
    "no progress": vehicle(velocity_en_mps=(0.0, 0.0)),
    "heading against course": vehicle(velocity_en_mps=(-1.0, -1.0), heading_rad=math.pi / 4),
    "off the corridor": lambda s, state: replace(s, position_en_m=beside(s, state)),
    "stuck waypoint": status(mission_seq=1),
    "mission ended": status(mission_seq=9999),
    "fence breach": status(fence_breached=True),
    "fence off": status(fence_on=False),
    "foreign mission": event(StatusText(t_s=0.0, severity=6, text="Flight plan received")),
    "reboot": event(AutopilotRebooted()),
    "battery low": status(battery_remaining=0.15),
    "battery critical": status(battery_remaining=0.02),
    "leaking": status(sensors=(("LEAK", 1.0),)),
    "dark": status(utc_at_boot_s=MIDNIGHT_S),
    "shore lost": lambda s: replace(s, shore_age_s=700.0),
    "shoaling": status(sounds=True, depth_m=1.0, depth_rate_mps=-0.1),
    "depth lost": status(sounds=False),
    "planner dead": lambda s: replace(s, planner_alive=False),
    "out of time": lambda s: replace(s, t_s=s.t_s + 7300.0),
    "dragged off": lambda s: replace(s, position_en_m=(s.position_en_m[0] + 60.0, s.position_en_m[1])),
    # modes and arming
    **{f"mode {mode.name}": status(mode=mode) for mode in Mode},
    "mode unknown": status(mode=None),
    "disarmed": status(is_armed=False),
    "armed in AUTO": status(is_armed=True, mode=Mode.AUTO),
    "EKF lost": status(ekf_ok=False),
    "boot time back": status(boot_s=1.0),
    # whose autopilot it is
    "another board": lambda s: replace(s, identity=replace(s.identity, uid="77")),
    "no board told yet": lambda s: replace(s, identity=Identity(system=1)),
    "two on one id": lambda s: replace(s, identity=replace(s.identity, is_contested=True)),
    "not a rover": lambda s: replace(s, identity=replace(s.identity, vehicle_type=2)),
    "a motor boat": lambda s: replace(s, identity=replace(s.identity, sails=False)),
    "a neighbour": lambda s: replace(s, neighbours=("system 7, surface boat",)),
    "disbelieved": event(Disbelieved(what="SAIL_NO_GO_ANGLE", text="SAIL_NO_GO_ANGLE 90 cannot be")),
    # what may be missing
    "no autopilot": lambda s: replace(s, autopilot=None, heartbeat_age_s=None),
    "no vehicle": lambda s: replace(s, vehicle=None, vehicle_age_s=None, position_en_m=None),
    "no wind": lambda s: replace(s, wind=WindEstimate()),
    "no forecast": wind(forecast=None),
    "wind light": wind(health=WindHealth.LIGHT),
    "no limits": lambda s: replace(s, limits=None),
    "seq unknown": status(mission_seq=None, mission_total=None),
    "seq 0": status(mission_seq=0, mission_total=0),
    "mission shorter": status(mission_total=1),
    # wind
    "header": lambda s: wind(present_twd_from_rad=(s.wind.present_twd_from_rad or 0.0) + 0.6)(s),
    "90 degree shift": lambda s: wind(
        mean_twd_from_rad=(s.wind.mean_twd_from_rad or 0.0) + 1.6,
        present_twd_from_rad=(s.wind.present_twd_from_rad or 0.0) + 1.6,
    )(s),
    # events and orders
    "mode changed": event(ModeChanged(before=Mode.AUTO, after=Mode.HOLD)),
    **{f"order {words}": event(order(words)) for words in ORDERS},
    "two stations": event(order("hold"), order("home", by=(254, 190))),
    "all at once": event(AutopilotRebooted(), order("replan")),
    # outcomes
    "stale outcomes": lambda s: replace(
        s,
        outcomes=(
            PlanOutcome(request_id=77_777),
            UploadOutcome(upload_id=77_777, result=UploadResult.OK),
            ReadOutcome(read_id=77_777, items=()),
            CommandOutcome(command_id=77_777, result=CommandResult.REFUSED),
        ),
    ),
    "planner died": outcomes(lambda n: PlanOutcome(request_id=n, text="killed")),
    **{f"upload {r.value}": outcomes(lambda n, r=r: UploadOutcome(upload_id=n, result=r)) for r in UploadResult},
    "read failed": outcomes(lambda n: ReadOutcome(read_id=n, text="time-out")),
    "read empty": outcomes(lambda n: ReadOutcome(read_id=n, items=())),
    **{f"command {r.value}": outcomes(lambda n, r=r: CommandOutcome(command_id=n, result=r)) for r in CommandResult},
    # permissions and time
    "dry run": lambda s: replace(s, permissions=DRY_RUN),
    "no steering": lambda s: replace(s, permissions=replace(ALL_PERMITTED, may_steer=False)),
    "upload only": lambda s: replace(s, permissions=Permissions(may_upload=True)),
    "an hour later": lambda s: replace(s, t_s=s.t_s + 3700.0),
}


def seen_after(change, snapshot, state):
    wants_state = change.__code__.co_argcount == 2
    return change(snapshot, state) if wants_state else change(snapshot)


@pytest.mark.parametrize("name", NAMES)
def test_every_state_meets_every_event(name):
    skipper, state, snapshot = states()[name]
    for what, change in EVENTS.items():
        seen = seen_after(change, snapshot, state)
        now = state
        for n in range(12):
            step = replace(seen, t_s=seen.t_s + n, **({} if n == 0 else {"events": (), "outcomes": ()}))
            after, actions = skipper.step(now, step)
            assert isinstance(after.phase, Phase), what
            check_invariants(now, after, step, actions)
            if not seen.permissions.may_upload:
                assert not any(isinstance(a, (act.UploadMission, act.SetCurrent)) for a in actions), what
            if after.phase is Phase.OPERATOR:
                assert not any(isinstance(a, (act.SetMode, act.Arm, act.SteerHeading)) for a in actions), what
            if step.heartbeat_age_s is None or step.heartbeat_age_s > 3.0:
                assert all(isinstance(a, (act.Announce, act.CancelPlan, act.RequestPlan)) for a in actions), what
            again, same = skipper.step(now, step)
            assert after.why == again.why, what
            assert [type(a) for a in same] == [type(a) for a in actions], what
            now = after


def test_the_walk_covers_all_phases_and_all_watchdogs():
    phases = {state.phase for _, state, _ in states().values()}
    assert phases == set(Phase)
    assert set(NAMES) == set(states())
    assert {dog.name for dog in TABLE} <= set(EVENTS)


@pytest.mark.parametrize("mode", [m for m in Mode if m not in {Mode.AUTO, Mode.INITIALISING}])
@pytest.mark.parametrize("name", ["standard", "planning under way", "uploading under way", "holding", "buoy approach"])
def test_any_mode_that_we_did_not_ask_for_is_the_operator(name, mode):
    skipper, state, snapshot = states()[name]
    after, _ = skipper.step(state, status(mode=mode)(snapshot))
    assert after.phase is Phase.OPERATOR
    assert mode.name in after.why


def test_a_plan_that_comes_with_the_takeover_is_not_uploaded():
    skipper, state, snapshot = states()["planning under way"]
    problem = state.pending.plan.problem
    outcome = PlanOutcome(request_id=state.pending.plan.request_id, plan=plan(problem, expansions=800))
    _, actions = skipper.step(state, replace(status(mode=Mode.HOLD)(snapshot), outcomes=(outcome,)))
    assert not any(isinstance(a, act.UploadMission) for a in actions)


# ------------------------------------------------------------------------------------------ watchdogs
# The state each is looked for in, and whether its own event alone raises it within its time.
# Those that need a track behind them are looked at one by one below and in the voyages.
TRACKS = {"no progress", "stuck waypoint", "position jump", "reboot", "out of time", "dragged off", "drifting"}


@pytest.mark.parametrize("dog", [d for d in TABLE if d.name not in TRACKS], ids=lambda dog: dog.name)
def test_each_watchdog_enters_and_leaves_and_says_so(dog):
    name = "standard"
    skipper, state, snapshot = states()[name]
    change = EVENTS[dog.name]
    texts = []

    def run(state, seen, seconds, t0):
        for n in range(seconds):
            step = replace(seen, t_s=t0 + n, **({} if n == 0 else {"events": (), "outcomes": ()}))
            state, actions = skipper.step(state, step)
            texts.extend(a.code for a in actions if isinstance(a, act.Announce))
            if any(r.name == dog.name for r in state.alarms.raised):
                return state, True
        return state, False

    if dog.name == "off the corridor":
        # the event puts her there at once, and no jump is meant
        state = with_parts(state, position={"last_seen": None})
    if dog.name == "foreign mission":
        state, _ = skipper.step(state, change(snapshot))
        from companion.messages import MissionItem

        theirs = (MissionItem(command=16, lat_e7=1, lon_e7=1), MissionItem(command=20))
        for n in (1, 3):  # read twice before it is believed
            read = state.pending.read
            assert read is not None
            assert not state.mission.foreign
            state, _ = skipper.step(
                state, replace(snapshot, t_s=snapshot.t_s + n, outcomes=(ReadOutcome(read_id=read[0], items=theirs),))
            )
            state, _ = skipper.step(state, replace(snapshot, t_s=snapshot.t_s + n + 1, outcomes=()))
        state, raised = run(state, snapshot, 4, snapshot.t_s + 5)
        assert raised
        return
    state, raised = run(state, seen_after(change, snapshot, state), int(dog.enter_s) + 4, snapshot.t_s)
    assert raised, dog.name
    assert dog.name in texts
    assert sum(r.name == dog.name for r in state.alarms.raised) == 1
    t = snapshot.t_s + dog.enter_s + 10
    for n in range(int(dog.exit_s) + 4):
        state, _ = skipper.step(state, replace(snapshot, t_s=t + n))
    assert all(r.name != dog.name for r in state.alarms.raised), dog.name


def raised_in(world, name, seconds):
    return world.run(seconds, lambda w: any(r.name == name for r in w.state.alarms.raised))


def test_no_progress_is_noticed_and_answered_with_a_plan():
    world = make(obstacles=())
    world.run(60)
    world.sail = lambda dt: None  # weed: the boat stands still in a good wind, not pointing at it
    world.speed = 0.6
    assert raised_in(world, "no progress", 400)
    assert world.run(
        60,
        lambda w: any(
            isinstance(a, act.RequestPlan) and a.reason is act.ReplanReason.NO_PROGRESS for _, a in w.actions
        ),
    )
    del world.sail
    assert world.run(300, lambda w: not any(r.name == "no progress" for r in w.state.alarms.raised))


def test_a_stuck_waypoint_is_pushed_on():
    world = make(
        Goal(en_m=(150.0, 0.0), radius_m=6.0),
        Goal(en_m=(150.0, 200.0), radius_m=6.0),
        obstacles=(),
        wind=lambda t: (math.radians(-45), 5.0),
    )
    assert world.run(60, lambda w: w.state.mission.index >= 0 and len(w.mission) > 2 and w.seq == 1)
    world.run(300, lambda w: w.position[0] > 152.0 or w.seq > 1)
    # The autopilot goes on counting the waypoint that lies behind.
    seq, world.seq = world.seq, 1
    assert seq == 2
    sail = world.sail

    def stuck(dt):
        if world.seq == 1:
            world.position = (world.position[0], world.position[1] + 0.05)
        else:
            sail(dt)

    world.sail = stuck
    assert raised_in(world, "stuck waypoint", 60)
    assert world.run(10, lambda w: w.seq == 2)


def row_of_goals():
    goals = (Goal(en_m=(80.0 * n, 0.0), radius_m=6.0) for n in range(1, 6))
    world = make(*goals, obstacles=(), wind=lambda t: (math.radians(-10), 5.0))
    assert world.run(100, lambda w: len(w.mission) == 5 and w.seq == 2)
    return world


@pytest.mark.parametrize("taken", [False, True])
def test_who_was_not_known_to_be_ours_for_a_while_was_with_an_operator_only_where_one_took_her(taken):
    """She is planned for from where she is in any case: nobody knows what became of her meanwhile."""
    world = row_of_goals()
    known, before = world.identity, len(world.actions)
    world.identity = replace(known, is_contested=True)
    world.run(3)
    world.mode = Mode.MANUAL if taken else Mode.AUTO
    world.run(8)
    world.mode = Mode.AUTO
    world.run(2)
    assert world.state.phase is Phase.OPERATOR
    world.identity = known
    assert world.run(20, lambda w: w.state.phase is Phase.STANDARD)
    assert bool([entry for entry in world.log if entry[1] == "operator back"]) is taken
    assert (world.state.operator.given_back_s > 0.0) is taken
    asked = [a.reason for _, a in world.actions[before:] if isinstance(a, act.RequestPlan)]
    assert act.ReplanReason.OPERATOR_BACK in asked


def test_a_jump_is_raised_at_once_and_forgotten_after_quiet_fixes():
    world = make(obstacles=())
    world.run(60)
    world.position_offset = (300.0, 0.0)
    world.step()
    assert any(r.name == "position jump" for r in world.state.alarms.raised)
    world.run(10)
    assert any(r.name == "position jump" for r in world.state.alarms.raised)
    world.run(20)
    assert not any(r.name == "position jump" for r in world.state.alarms.raised)


def test_a_reboot_is_raised_and_the_mission_read_again():
    skipper, state, snapshot = states()["standard"]
    after, actions = skipper.step(state, event(AutopilotRebooted())(snapshot))
    assert any(isinstance(a, act.Announce) and a.code == "reboot" for a in actions)
    assert any(isinstance(a, act.ReadMission) for a in actions)
    assert after.phase is Phase.WAITING


def test_the_table_has_an_entry_an_exit_and_an_action_for_each():
    names = [dog.name for dog in TABLE]
    assert len(names) == len(set(names))
    for dog in TABLE:
        assert dog.watches
        assert dog.why
        assert dog.enter_s >= 0.0
        assert dog.exit_s >= 0.0


# What boats and shores of other releases send, and missions say, for good: a new row is added here, none is changed.
# The watchdogs' numbers on the air, with the key in [safety] and its default where one ends the voyage early.
NUMBERS = {
    "link silent": (1,),
    "position lost": (2,),
    "position jump": (3,),
    "wind untrusted": (4,),
    "becalmed": (5,),
    "drifting": (6,),
    "in irons": (7,),
    "vessel too near": (8,),
    "no progress": (9,),
    "heading against course": (10,),
    "off the corridor": (11,),
    "stuck waypoint": (12,),
    "mission ended": (13,),
    "fence breach": (14,),
    "foreign mission": (15,),
    "reboot": (16,),
    "battery low": (17,),
    "battery critical": (18, "battery", "refuge"),
    "leaking": (19, "leak", "refuge"),
    "dark": (20, "dark", "say"),
    "shore lost": (21, "shore_lost", "say"),
    "out of time": (22, "out_of_time", "refuge"),
    "dragged off": (23,),
    "planner dead": (24,),
    "strong wind": (25, "strong_wind", "refuge"),
    "light wind": (26, "light_wind", "say"),
    "fence off": (27,),
    "wind contradicted": (28,),
    "shoaling": (29,),
    "depth lost": (30,),
}
# The figures of [safety]: default, more than, at least, at most.
FIGURES = {
    "battery_v": (None, 0.0, None, None),
    "battery_reserve": (1.5, None, 0.0, 10.0),
    "dark_below_deg": (-6.0, None, -18.0, 45.0),
    "shore_lost_s": (600.0, None, 10.0, None),
}


def test_numbers_on_the_air_and_keys_of_missions_are_given_for_good():
    assert {dog.name: (dog.number, *((dog.ends.key, str(dog.ends.default)) if dog.ends else ())) for dog in TABLE} == (
        NUMBERS
    )
    assert len({dog.number for dog in TABLE}) == len(TABLE)
    assert {s.key: (s.default, s.above, s.least, s.most) for s in SETTINGS.values()} == FIGURES
    assert {cause.key: WORD_OF[cause.answer] for cause in FAILSAFES if cause.key} == {
        "position_failsafe": "sail_on",
        "battery_failsafe": "refuge",
        "fence_failsafe": "sail_on",
        "shore_failsafe": "stay",
    }


def test_who_ends_a_voyage_says_that_the_mission_has_it_and_no_two_have_one_rank():
    ends = [dog for dog in TABLE if dog.ends is not None]
    assert ends == [dog for dog in TABLE if dog.response is Response.AS_SET]
    assert len({dog.ends.rank for dog in ends}) == len(ends)

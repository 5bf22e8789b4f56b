"""What is done and said under way, moment by moment: how she moves, what she is called to do, what stands on board."""

import math
from dataclasses import replace

import pytest
import shapely

from companion.boat import AutopilotLimits
from companion.skipper.behaviors.drifting import (
    AWAY_M,
    ROOMIER_M,
    _goes_away,
    _loiters,
    follow_ground,
    lies_in_loiter,
    over_ground,
)
from companion.skipper.behaviors.headings import _wanted_rad, drift_correction_rad
from companion.skipper.behaviors.helm import leave_passed, repair
from companion.skipper.behaviors.launch import _look_at_no_go, _misplaced, _stale
from companion.skipper.behaviors.sailing import _is_outside, _name
from companion.skipper.step import actions as act
from companion.skipper.step.config import Permissions
from companion.skipper.step.state import Fix, Phase
from companion.skipper.way.geometry import bearing_rad
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.moments import NOW_S, moment, route

WAY = route((0.0, 300.0), (0.0, 600.0), (0.0, 620.0))


# ------------------------------------------------------------------------------------------- how she moves
@pytest.mark.parametrize("boat", [(3.0, 1.0), (-2.0, 4.0), (0.5, -6.0), (-1.0, -1.0)])
@pytest.mark.parametrize("ground", [(1.0, 0.2), (-0.3, 0.8), (0.1, -0.5), (-0.6, -0.4)])
def test_she_goes_away_from_a_place_where_her_distance_to_it_grows(boat, ground):
    place = (0.2, 0.3)
    later = (boat[0] + 1e-6 * ground[0], boat[1] + 1e-6 * ground[1])
    assert _goes_away(boat, place, ground) == (math.dist(later, place) > math.dist(boat, place))


@pytest.mark.parametrize(
    ("speed_mps", "ago_s", "places"),
    [
        (0.05, None, 1),  # the first of them
        (0.05, 5.0, 1),  # one in ten seconds
        (0.05, 10.0, 2),
        (2.0, 10.0, 0),  # a velocity that is more than a receiver's noise says it itself
    ],
)
def test_of_a_boat_that_hardly_moves_a_place_is_kept_every_ten_seconds(speed_mps, ago_s, places):
    before = () if ago_s is None else (Fix(t_s=NOW_S - ago_s, en_m=(0.0, 0.0)),)
    ctx = moment(speed_mps=speed_mps, adrift={"places": before})
    follow_ground(ctx)
    assert len(ctx.state.adrift.places) == places
    follow_ground(ctx)
    assert len(ctx.state.adrift.places) == places


def test_a_slow_drift_is_told_by_the_places_of_a_minute():
    places = tuple(Fix(t_s=NOW_S - 60.0 + 10.0 * n, en_m=(0.6 * n, -0.3 * n)) for n in range(7))
    still = {"ground_en_mps": (0.01, 0.02), "ground_t_s": NOW_S - 1.0, "places": places}
    ctx = moment(at=(4.2, -2.1), speed_mps=0.02, adrift=still)
    assert over_ground(ctx) == pytest.approx((0.06, -0.03))
    follow_ground(ctx)
    assert ctx.state.adrift.places[0] == places[0], "the seventh ago is a minute ago"
    assert len(ctx.state.adrift.places) == 7


@pytest.mark.parametrize(
    ("away_m", "is_shut", "stays"),
    [
        (AWAY_M - 1.0, True, True),
        (AWAY_M + 1.0, True, False),
        (AWAY_M + 1.0, False, True),
        (AWAY_M + ROOMIER_M + 1.0, False, False),
    ],
)
def test_at_the_loiter_is_within_25_m_of_it_and_farther_off_where_the_way_is_clear(away_m, is_shut, stays):
    rock = (shapely.box(-9.0, 9.0, 9.0, 11.0),) if is_shut else ()
    assert AWAY_M == 25.0
    assert lies_in_loiter(moment(route((0.0, away_m)), obstacles=rock)) is stays


def test_without_a_mission_she_lies_in_no_loiter_of_it_and_without_an_autopilot_in_none():
    assert lies_in_loiter(moment()) is False
    assert lies_in_loiter(moment(WAY)) is False  # nor where waypoints are ahead
    assert _loiters(moment(WAY, seen={"autopilot": None}), None) is False


@pytest.mark.parametrize(("east_m", "is_out"), [(9.5, True), (9.0, True), (8.5, False), (0.0, False)])
def test_outside_is_where_nothing_is_left_to_the_edge(east_m, is_out):
    assert _is_outside(moment(WAY, at=(east_m, 0.0), obstacles=(shapely.box(9.0, -50.0, 30.0, 50.0),))) is is_out


# ------------------------------------------------------------------------------------ what stands on board
def current(ctx):
    return [action.seq for action in ctx.actions if isinstance(action, act.SetCurrent)]


BENT = ((0.0, 50.0), (0.0, 100.0), (100.0, 100.0), (200.0, 100.0))


@pytest.mark.parametrize(
    ("north_m", "rocks", "made"),
    [
        (40.0, (), []),  # it is still ahead
        (60.0, (), [2]),
        (60.0, (shapely.box(40.0, 60.0, 60.0, 90.0),), [2]),  # beside the way to the next, on none of hers
        (60.0, (shapely.box(-10.0, 75.0, 10.0, 85.0),), []),  # a rock lies on the way on
    ],
)
def test_a_waypoint_that_was_passed_while_the_list_was_sent_is_left_where_the_way_on_is_clear(north_m, rocks, made):
    ctx = moment(route(*BENT), at=(0.0, north_m), obstacles=rocks, mission={"uploaded_s": NOW_S - 1.0, "index": 0})
    leave_passed(ctx)
    assert current(ctx) == made


def test_with_no_mission_of_ours_there_is_nothing_to_repair():
    ctx = moment(mission={"repair": True})
    assert repair(ctx) is False
    assert ctx.state.mission.repair is False
    assert repair(moment(WAY)) is False
    assert repair(moment(WAY, mission={"repair": True})) is True


def test_round_a_buoy_the_set_of_the_water_is_allowed_for():
    """To the end of her leg, corrected by what she makes good beside her bow."""
    buoy = Goal(en_m=(0.0, 30.0), name="buoy", side=Side.STARBOARD, rounding_m=12.0)
    end, way = (-60.0, 40.0), route((0.0, 18.0), (-60.0, 40.0), (-90.0, 40.0), gate_of=(0, 1, -1))
    ctx = moment(way, goals=(buoy, Goal(en_m=(-90.0, 40.0))), heading_deg=300.0, twd_deg=90.0, mission={"index": 1})
    vehicle = replace(ctx.snapshot.vehicle, velocity_en_mps=(-1.2, 1.9))
    ctx.snapshot = replace(ctx.snapshot, vehicle=vehicle)
    drift = drift_correction_rad(vehicle.velocity_en_mps, vehicle.heading_rad)
    assert abs(drift) > 0.1
    assert math.remainder(_wanted_rad(ctx) - bearing_rad((0.0, 0.0), end) - drift, 2.0 * math.pi) == pytest.approx(0.0)


# ---------------------------------------------------------------------------------------------- what is said
BUOY = Goal(en_m=(0.0, 600.0), name="mark", side=Side.PORT, rounding_m=12.0)


@pytest.mark.parametrize(
    ("how", "phase", "words"),
    [
        ({}, Phase.STANDARD, "item 1 of 3 to one"),
        ({"way": replace(WAY, rung="less margin")}, Phase.STANDARD, "item 1 of 3 to one (less margin)"),
        ({"goals": (BUOY,), "at": (0.0, 560.0)}, Phase.BUOY_APPROACH, "mark to port"),
        ({"goals": (BUOY,), "at": (0.0, 500.0)}, Phase.STANDARD, "item 1 of 3 to mark"),
        ({"way": route((0.0, 300.0))}, Phase.HOLDING, "loitering in the mission's safe end: waiting for a plan"),
        (
            {"way": route((0.0, 300.0)), "permissions": Permissions(may_set_mode=True)},
            Phase.HOLDING,
            "waiting, for uploading is not permitted",
        ),
    ],
)
def test_what_she_does_is_named_with_where_to_and_by_which_kind_of_plan(how, phase, words):
    ctx = moment(**({"way": WAY} | how))
    _name(ctx)
    assert ctx.state.phase is phase
    assert words in ctx.state.why
    assert ("(" in ctx.state.why) == ("(" in words)


@pytest.mark.parametrize(
    ("at", "obstacles", "says"),
    [
        ((0.0, 0.0), (), ""),
        ((0.0, 0.0), (shapely.box(-9.0, -9.0, 9.0, 9.0),), "her position is inside o0"),
        ((0.0, -90_000.0), (), "is it the right mission"),
    ],
)
def test_before_she_sets_sail_it_is_said_where_she_cannot_lie(at, obstacles, says):
    told = _misplaced(moment(at=at, obstacles=obstacles))
    assert says in told
    assert bool(told) == bool(says)


@pytest.mark.parametrize(("angle_deg", "is_said"), [(None, False), (45.0, False), (25.0, True)])
def test_an_autopilot_that_points_higher_than_the_boat_sails_is_told_of(angle_deg, is_said):
    limits = None if angle_deg is None else AutopilotLimits(sail_no_go_angle_rad=math.radians(angle_deg))
    ctx = moment(WAY, seen={"limits": limits})
    _look_at_no_go(ctx)
    told = [a.text for a in ctx.actions if isinstance(a, act.Announce) and a.code == "no-go"]
    assert bool(told) is is_said
    assert not told or f"SAIL_NO_GO_ANGLE is {angle_deg:.0f} degrees" in told[0]


@pytest.mark.parametrize(
    ("how", "age_s", "says"),
    [
        ({}, 70.0, ""),
        ({"mean_deg": 40.0}, 70.0, "the wind has turned 40°"),
        ({"mean_deg": 40.0}, 50.0, ""),  # no plan is made anew within a minute for that
        ({"at": (60.0, 100.0)}, 70.0, "she has drifted 60 m off the first leg"),
        ({"at": (60.0, 100.0)}, 50.0, ""),
        ({"obstacles": (shapely.box(-9.0, 100.0, 9.0, 120.0),)}, 50.0, "0 m from o0 on the way to the first waypoint"),
    ],
)
def test_a_plan_that_waits_to_be_sailed_is_made_anew_where_it_no_longer_fits(how, age_s, says):
    told = _stale(moment(WAY, speed_mps=0.0, plans={"last_s": NOW_S - age_s}, **how))
    assert says in told
    assert bool(told) == bool(says)

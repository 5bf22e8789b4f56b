"""The figure of each watchdog, from a moment made by hand: what it is, and when it cannot be told."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely.geometry import box

from companion.boat.margins import AutopilotLimits
from companion.messages import MissionState, Mode
from companion.safety import BY_NAME, SENSORS, TABLE
from companion.skipper.intake import locate
from companion.skipper.planning.diversions import diversion
from companion.skipper.step.config import ALL_PERMITTED, Ends, Guidance
from companion.skipper.step.context import StepContext
from companion.skipper.step.snapshot import WaterCurrent, WindEstimate, WindHealth
from companion.skipper.step.state import Charge, Fix
from companion.skipper.watch import measures
from companion.skipper.watch.measures import corridor_m, follow_charge, lasts_s, measure, sun_height_rad, way_s
from companion.skipper.watch.watch import watch
from companion.skipper.way.position_plausibility import PositionDoubt
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.world import FRAME, with_parts

WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))


def shown(ctx, **status):
    """The same moment with another status of the autopilot."""
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, **status))
    return ctx


def silent(ctx):
    """The same with an autopilot that is not heard."""
    ctx.snapshot = replace(ctx.snapshot, heartbeat_age_s=9.0)
    return ctx


def test_every_row_has_a_figure():
    assert set(measures._MEASURES) == {dog.name for dog in TABLE if not dog.sensor}
    quiet = moment(WAY)
    for name in measures._MEASURES:
        assert measure(quiet, name) is None or math.isfinite(measure(quiet, name))


def test_ages_and_sensors_are_as_they_are_heard():
    assert measure(moment(WAY, seen={"heartbeat_age_s": 2.5}), "link silent") == 2.5
    assert measure(moment(WAY, seen={"vehicle_age_s": 4.5}), "position lost") == 4.5
    (sensor, dog) = next(iter(SENSORS.items()))
    assert measure(shown(moment(WAY), sensors=((sensor, 0.75),)), dog.name) == 0.75
    assert measure(silent(shown(moment(WAY), sensors=((sensor, 0.75),))), dog.name) is None


@pytest.mark.parametrize(
    ("off_m", "is_doubted", "jump_m"), [(0.0, False, 0.0), (57.0, False, 57.0), (0.0, True, 10.0), (57.0, True, 57.0)]
)
def test_a_jump_lasts_as_long_as_the_doubt(off_m, is_doubted, jump_m):
    last = Fix(t_s=NOW_S - 0.1, en_m=(-off_m, 0.0), velocity_en_mps=(0.0, 0.0))
    doubt = PositionDoubt(
        since_s=0.0, t_s=0.0, reckoned_en_m=(0.0, 0.0), velocity_en_mps=(0.0, 0.0), settled_s=0.0, why="it jumped"
    )
    ctx = moment(WAY, speed_mps=0.0, position={"last_seen": last, "doubt": doubt if is_doubted else None})
    assert measure(ctx, "position jump") == pytest.approx(jump_m, abs=0.2)
    assert measure(moment(WAY, seen={"position_en_m": None}), "position jump") is None


def test_a_jump_is_worked_out_once_for_all_who_ask_where_the_boat_is(monkeypatch):
    last = Fix(t_s=NOW_S - 0.1, en_m=(-57.0, 0.0), velocity_en_mps=(0.0, 0.0))
    ctx = moment(WAY, speed_mps=0.0, position={"last_seen": last})
    asked, work = [], StepContext.innovation_m
    monkeypatch.setattr(StepContext, "innovation_m", lambda self, fix: asked.append(fix) or work(self, fix))
    assert [ctx.jump_m, ctx.boat_en, ctx.jump_m][1] is None
    assert asked == [last]
    near = replace(last, en_m=(0.0, 0.0))
    ctx.set(position=replace(ctx.state.position, last_seen=near))
    assert ctx.jump_m == 0.0
    assert asked == [last, near]
    ctx.snapshot = replace(ctx.snapshot, position_en_m=(0.0, 90.0))
    assert ctx.jump_m > 80.0


@pytest.mark.parametrize(
    ("health", "sailing", "figure"),
    [
        (WindHealth.GOOD, True, 0.0),
        (WindHealth.LIGHT, True, 0.0),
        (WindHealth.UNTRUSTED, True, 1.0),
        (WindHealth.UNTRUSTED, False, 1.0),
        (WindHealth.NONE, True, 1.0),
        (WindHealth.NONE, False, 0.0),
    ],
)
def test_a_wind_is_untrusted_by_its_verdict_or_when_none_is_heard_under_way(health, sailing, figure):
    ctx = moment(WAY, voyage={"sailing": sailing})
    ctx.snapshot = replace(ctx.snapshot, wind=replace(ctx.snapshot.wind, health=health))
    assert measure(ctx, "wind untrusted") == figure
    assert measure(moment(WAY, seen={"unsure": "the vane turned"}), "wind contradicted") == 1.0
    assert measure(moment(WAY), "wind contradicted") == 0.0


def test_who_sails_is_not_becalmed():
    drifts = moment(WAY, tws_mps=0.6)
    assert measure(drifts, "becalmed") == 0.6
    sails = moment(WAY, tws_mps=0.6, adrift={"ground_en_mps": (0.6, 0.0)})
    assert measure(sails, "becalmed") == BY_NAME["becalmed"].exit
    strong = moment(WAY, tws_mps=7.0, adrift={"ground_en_mps": (0.6, 0.0)})
    assert measure(strong, "becalmed") == 7.0
    assert measure(moment(WAY, seen={"wind": WindEstimate()}), "becalmed") is None


@pytest.mark.parametrize(
    ("change", "figure"),
    [
        ({"heading_deg": 34.9}, True),
        ({"heading_deg": -34.9}, True),
        ({"heading_deg": 35.1}, False),
        ({"heading_deg": 10.0, "tws_mps": 1.4}, None),
        ({"heading_deg": 10.0, "tws_mps": 1.5}, True),
        ({"heading_deg": 10.0, "seen": {"vehicle_age_s": 9.0}}, None),
        ({"heading_deg": 10.0, "seen": {"vehicle": None}}, None),
        ({"heading_deg": 10.0, "config": {"sails": False}}, None),
    ],
)
def test_irons_are_within_35_degrees_in_a_wind(change, figure):
    found = measure(moment(WAY, speed_mps=0.25, **change), "in irons")
    assert found == (None if figure is None else pytest.approx(0.25 if figure else 0.8))


def history(*, window_s=180.0, made_m=30.0, plan=7):
    went = ((NOW_S - window_s, 0.0, 0.0, 500.0), (NOW_S, 0.0, 0.0, 500.0 - made_m))
    return {"progress": {"history": went, "history_plan": plan}}


@pytest.mark.parametrize(
    ("parts", "figure"),
    [
        (history(), 30.0),
        (history(made_m=-4.0), -4.0),
        (history(window_s=179.9), None),
        (history(plan=6), None),
        ({"progress": {"history": ()}}, None),
        (history() | {"up": ("becalmed",)}, None),
        (history() | {"mission": {"route": WAY, "index": 2}}, None),
    ],
)
def test_progress_is_the_way_made_good_in_three_minutes_of_one_plan(parts, figure):
    assert measure(moment(WAY, **parts), "no progress") == figure


@pytest.mark.parametrize("guidance", [Guidance.PLAN, Guidance.FIELD])
def test_a_new_plan_every_quarter_of_a_minute_is_no_progress_and_hides_none(guidance):
    """Steered by field into a corner she was planned for every 14 s, and the watchdog began anew with each plan."""
    guided = replace(moment().autopilot, mode=Mode.GUIDED if guidance is Guidance.FIELD else Mode.AUTO)
    ctx = moment(WAY, config={"guidance": guidance}, seen={"autopilot": guided}, **history(plan=6))
    locate(ctx)
    assert measure(ctx, "no progress") == 30.0
    is_moved = ctx.state.progress.history[-1][3] != 470.0  # by what the new plan is longer; a field follows none
    assert is_moved is (guidance is Guidance.PLAN)


@pytest.mark.parametrize(
    ("guidance", "made_m", "tws_mps", "drift_mps", "is_raised"),
    [
        (Guidance.FIELD, 20.0, 5.0, 0.0, True),
        (Guidance.FIELD, 20.0, 5.0, 2.0, False),  # against a current it is much
        (Guidance.FIELD, 20.0, 1.0, 0.0, False),  # and in a light wind
        (Guidance.FIELD, 60.0, 5.0, 0.0, False),
        (Guidance.PLAN, 20.0, 5.0, 0.0, False),
        (Guidance.PLAN, 4.0, 5.0, 0.0, True),
    ],
)
def test_by_field_a_boat_that_creeps_in_circles_makes_no_progress(guidance, made_m, tws_mps, drift_mps, is_raised):
    """Before a buoy to leeward she turned circles for four minutes: they crept, and 31 m in 170 s were progress."""
    guided = replace(moment().autopilot, mode=Mode.GUIDED if guidance is Guidance.FIELD else Mode.AUTO)
    seen = {"autopilot": guided, "current": WaterCurrent(east_mps=drift_mps, is_significant=drift_mps > 0.0)}
    config = {"guidance": guidance}
    ctx = moment(
        WAY, config=config, tws_mps=tws_mps, seen=seen, steering={"own_mode": guided.mode}, **history(made_m=made_m)
    )
    watch(ctx)
    assert ctx.is_raised("no progress") is is_raised


@pytest.mark.parametrize(("speed_mps", "off_deg"), [(0.49, 0.0), (0.51, 30.0)])
def test_a_course_below_half_a_metre_a_second_is_none(speed_mps, off_deg):
    ctx = moment(WAY, heading_deg=90.0, speed_mps=speed_mps)
    ctx.snapshot = replace(ctx.snapshot, vehicle=replace(ctx.snapshot.vehicle, heading_rad=math.radians(60.0)))
    assert measure(ctx, "heading against course") == pytest.approx(off_deg)
    assert measure(moment(WAY, seen={"vehicle_age_s": 9.0}), "heading against course") is None


# ---------------------------------------------------------------------------------------------- off the corridor
@pytest.mark.parametrize(
    ("at", "obstacles", "share"),
    [
        ((100.0, 10.0), (), 0.5),  # of the grid size, 20 m
        ((100.0, -10.0), (), 0.5),
        ((100.0, 10.0), (box(150, -20, 170, -1.0),), 10.0 / 7.0),  # of what the margin leaves: 15 m less the floor's 8
        ((100.0, 10.0), (box(150, -30, 170, -8.1 + 1.5),), 0.5),
        ((-9.0, 0.0), (), 0.0),  # before its leg: twice the 5 m by which a waypoint is announced early
        ((-14.0, 0.0), (), 0.2),
        ((-14.0, 3.0), (), (math.hypot(14.0, 3.0) - 10.0) / 20.0),
    ],
)
def test_the_share_of_the_corridor(at, obstacles, share):
    assert measure(moment(WAY, at=at, obstacles=obstacles), "off the corridor") == pytest.approx(share)


def test_what_lies_beside_the_leg_she_is_set_off_counts_and_not_only_what_lies_on_the_way_to_its_end():
    """In a known cross current she lay 5 m to leeward of her leg for 90 s, beside a wall, and was told at 2.8 m."""
    wall = box(140.0, 16.5, 250.0, 30.0)  # 6.5 m off where she goes on beside her leg
    assert measure(moment(WAY, at=(100.0, 10.0), obstacles=(wall,)), "off the corridor") == pytest.approx(10.0 / 7.0)
    assert measure(moment(WAY, at=(100.0, 10.0), obstacles=(wall,), speed_mps=0.1), "off the corridor") == 0.5


def test_a_beat_has_its_own_corridor_where_that_is_wider():
    north = route((0.0, 600.0), (300.0, 600.0), (300.0, 600.0))
    wide = moment(north, at=(15.0, 100.0), heading_deg=45.0)
    wide.snapshot = replace(wide.snapshot, limits=replace(wide.snapshot.limits, sail_xtrack_max_m=40.0))
    assert measure(wide, "off the corridor") < 0.4
    narrow = moment(north, at=(15.0, 100.0), heading_deg=45.0)
    assert measure(narrow, "off the corridor") == pytest.approx(0.75)


@pytest.mark.parametrize(
    "change",
    [
        {"seen": {"vehicle_age_s": 9.0}},
        {"mission": {"route": WAY, "index": 2}},
        {"mission": {"route": None}},
        {"steering": {"own_mode": Mode.LOITER}},
        {"steering": {"own_mode": Mode.HOLD}},
    ],
)
def test_who_follows_no_leg_is_on_none(change):
    assert measure(moment(WAY, at=(100.0, 90.0), **change), "off the corridor") is None


def test_who_is_steered_by_field_is_off_no_corridor():
    """ "off the corridor: plan again from the boat" was said, and by field nothing is planned."""
    by_field = {"config": {"guidance": Guidance.FIELD}}
    assert measure(moment(WAY, at=(100.0, 90.0), **by_field), "off the corridor") is None
    by_plan = replace(ALL_PERMITTED, may_steer=False)
    assert measure(moment(WAY, at=(100.0, 90.0), permissions=by_plan, **by_field), "off the corridor") > 1.0


def test_a_leg_without_length_has_no_corridor():
    here = route((0.9, 0.0), (600.0, 0.0), (600.0, 0.0))
    assert measure(moment(here, at=(0.0, 50.0)), "off the corridor") == 0.0
    longer = route((1.1, 0.0), (600.0, 0.0), (600.0, 0.0))
    assert measure(moment(longer, at=(0.5, 50.0)), "off the corridor") == pytest.approx(2.5)


@pytest.mark.parametrize(("margin_m", "left_m"), [(15.0, 7.0), (9.0, 3.0), (30.0, 22.0)])
def test_what_a_margin_leaves_beside_its_floor(margin_m, left_m):
    assert corridor_m(moment(replace(WAY, margin_m=margin_m))) == left_m
    assert corridor_m(moment(None, config={"margin_m": 20.0})) == 12.0


# --------------------------------------------------------------------------------------------------- the mission
def test_a_waypoint_that_was_passed_counts_from_then():
    assert measure(moment(WAY, mission={"route": WAY, "passed_since_s": NOW_S - 7.0}), "stuck waypoint") == 7.0
    assert measure(moment(WAY), "stuck waypoint") is None


@pytest.mark.parametrize(
    ("index", "state", "figure"),
    [
        (0, MissionState.ACTIVE, 0.0),
        (1, MissionState.ACTIVE, 0.0),
        (2, MissionState.ACTIVE, 1.0),
        (0, MissionState.COMPLETE, 1.0),
    ],
)
def test_a_mission_has_ended_at_its_last_item_or_as_the_autopilot_says(index, state, figure):
    there = {"route": WAY, "index": index}
    assert measure(shown(moment(WAY, mission=there), mission_state=state), "mission ended") == figure
    for change in ({"mission": there | {"route": None}}, {"progress": {"gate": 9}}):
        assert (
            measure(shown(moment(WAY, **({"mission": there} | change)), mission_state=state), "mission ended") is None
        )
    assert measure(silent(moment(WAY, mission=there)), "mission ended") is None
    doubted = moment(WAY, mission=there, seen={"unsure": "the wind's direction leapt"})
    assert measure(shown(doubted, mission_state=state), "mission ended") is None, "nothing is planned"


@pytest.mark.parametrize(
    ("name", "status", "figure"),
    [
        ("fence breach", {"fence_breached": True}, 1.0),
        ("fence breach", {"fence_breached": False}, 0.0),
        ("fence breach", {"fence_breached": None}, None),
        ("fence off", {"fence_on": False}, 1.0),
        ("fence off", {"fence_on": True}, 0.0),
        ("fence off", {"fence_on": None}, 0.0),
    ],
)
def test_the_autopilot_s_fence(name, status, figure):
    assert measure(shown(moment(WAY), **status), name) == figure
    assert measure(silent(shown(moment(WAY), **status)), name) is None


def test_what_is_on_or_off():
    assert measure(moment(WAY, mission={"route": WAY, "foreign": "x"}), "foreign mission") == 1.0
    assert measure(moment(WAY), "foreign mission") == 0.0
    assert measure(moment(WAY, vehicle={"is_ours": True, "rebooted": True}), "reboot") == 1.0
    assert measure(moment(WAY), "reboot") == 0.0
    assert measure(moment(WAY, seen={"planner_alive": False}), "planner dead") == 1.0
    assert measure(moment(WAY), "planner dead") == 0.0


@pytest.mark.parametrize(
    ("sounds", "least_m", "figure"), [(False, 2.0, 1.0), (True, 2.0, 0.0), (None, 2.0, 0.0), (False, None, None)]
)
def test_a_sounder_is_missed_where_it_is_asked_for(sounds, least_m, figure):
    ctx = shown(moment(WAY, config={"least_depth_m": least_m}), sounds=sounds)
    assert measure(ctx, "depth lost") == figure
    assert measure(silent(ctx), "depth lost") is None


# --------------------------------------------------------------------------------------------------- the battery
@pytest.mark.parametrize(
    ("name", "status", "parts", "percent"),
    [
        ("battery low", {"battery_remaining": 0.6}, {}, 60.0),
        ("battery low", {"battery_remaining": None}, {}, None),
        ("battery low", {"battery_remaining": 0.6, "battery_failed": True}, {}, 20.0),
        ("battery low", {"battery_remaining": 0.05, "battery_failed": True}, {}, 5.0),
        ("battery low", {"battery_remaining": None, "battery_failed": True}, {}, 20.0),
        ("battery critical", {"battery_remaining": 0.6}, {}, 60.0),
        ("battery critical", {"battery_remaining": 0.6, "battery_failed": True}, {}, 60.0),
        ("battery critical", {"battery_remaining": 0.6}, {"alarms": {"battery_critical": True}}, 10.0),
        ("battery critical", {"battery_remaining": None}, {"alarms": {"battery_critical": True}}, 10.0),
        ("battery critical", {"battery_remaining": 0.6, "battery_v": 10.9}, {}, 60.0),
    ],
)
def test_the_charge_and_the_autopilot_s_own_limits(name, status, parts, percent):
    ctx = shown(moment(WAY, **parts), **status)
    assert measure(ctx, name) == (None if percent is None else pytest.approx(percent))
    assert measure(silent(ctx), name) is None


@pytest.mark.parametrize(("volts", "percent"), [(10.9, 10.0), (11.0, 10.0), (11.1, 60.0), (None, 60.0)])
def test_a_voltage_that_the_mission_calls_critical(volts, percent):
    config = {"ends": Ends.of(battery_v=11.0)}
    ctx = shown(moment(WAY, config=config), battery_remaining=0.6, battery_v=volts)
    assert measure(ctx, "battery critical") == pytest.approx(percent)


@pytest.mark.parametrize(("is_short", "percent"), [(True, 10.0), (False, 60.0)])
def test_a_charge_that_does_not_cover_the_way_is_critical(is_short, percent):
    charge = Charge(since_s=0.0, first=0.9, last=0.6, is_short=is_short)
    ctx = shown(moment(WAY, alarms={"charge": charge}), battery_remaining=0.6)
    assert measure(ctx, "battery critical") == pytest.approx(percent)


# ------------------------------------------------------------------------------------- time, light, shore, place
def test_shares_of_what_the_mission_allows():
    ends = {"config": {"ends": Ends.of(shore_lost_s=300.0), "voyage_timeout_s": 1000.0}}
    assert measure(moment(WAY, seen={"shore_age_s": 150.0}, **ends), "shore lost") == 0.5
    assert measure(moment(WAY, **ends), "shore lost") is None
    assert measure(moment(WAY, voyage={"sailing": True, "under_way_s": 250.0}, **ends), "out of time") == 0.25
    assert measure(moment(WAY), "out of time") is None


def noaa_deg(lat_deg, lon_deg, unix_s):
    """The sun's height by Meeus' low series, as NOAA's calculator has it."""
    century = (unix_s / 86400.0 + 2440587.5 - 2451545.0) / 36525.0
    mean = (280.46646 + century * (36000.76983 + 0.0003032 * century)) % 360.0
    anomaly = math.radians(357.52911 + century * (35999.05029 - 0.0001537 * century))
    eccentric = 0.016708634 - century * (0.000042037 + 0.0000001267 * century)
    centre = (
        math.sin(anomaly) * (1.914602 - century * (0.004817 + 0.000014 * century))
        + math.sin(2.0 * anomaly) * (0.019993 - 0.000101 * century)
        + math.sin(3.0 * anomaly) * 0.000289
    )
    node = math.radians(125.04 - 1934.136 * century)
    longitude = math.radians(mean + centre - 0.00569 - 0.00478 * math.sin(node))
    tilt = math.radians(23.0 + (26.0 + (21.448 - century * 46.815) / 60.0) / 60.0 + 0.00256 * math.cos(node))
    declination = math.asin(math.sin(tilt) * math.sin(longitude))
    y, mean_rad = math.tan(0.5 * tilt) ** 2, math.radians(mean)
    equation_min = 4.0 * math.degrees(
        y * math.sin(2.0 * mean_rad)
        - 2.0 * eccentric * math.sin(anomaly)
        + 4.0 * eccentric * y * math.sin(anomaly) * math.cos(2.0 * mean_rad)
        - 0.5 * y * y * math.sin(4.0 * mean_rad)
        - 1.25 * eccentric**2 * math.sin(2.0 * anomaly)
    )
    minutes = (unix_s % 86400.0) / 60.0 + equation_min + 4.0 * lon_deg
    hour = math.radians(minutes / 4.0 - 180.0)
    lat = math.radians(lat_deg)
    return math.degrees(
        math.asin(math.sin(lat) * math.sin(declination) + math.cos(lat) * math.cos(declination) * math.cos(hour))
    )


@pytest.mark.parametrize("lat_deg", [-60.0, -20.0, 0.0, 51.1, 75.0])
@pytest.mark.parametrize("lon_deg", [-120.0, -1.3, 151.2])
def test_the_sun_stands_where_another_almanac_has_it(lat_deg, lon_deg):
    for days in range(0, 9000, 37):
        unix_s = 1_000_000_000.0 + 86400.0 * days + 4567.0 * days
        height = math.degrees(sun_height_rad(math.radians(lat_deg), math.radians(lon_deg), unix_s))
        assert height == pytest.approx(noaa_deg(lat_deg, lon_deg, unix_s), abs=0.02)


@pytest.mark.parametrize("limit_deg", [-6.0, 3.0])
def test_dark_is_the_sun_s_height_over_the_limit_by_the_autopilot_s_time(limit_deg):
    ctx = moment(WAY, config={"ends": Ends.of(dark_below_deg=limit_deg)})
    at = ctx.snapshot.vehicle.position
    height = math.degrees(sun_height_rad(math.radians(at.lat_deg), math.radians(at.lon_deg), 1.75e9 + 53.0))
    shown(ctx, t_s=NOW_S - 3.0)  # and its word is some seconds old
    assert measure(shown(ctx, utc_at_boot_s=1.75e9, boot_s=50.0), "dark") == pytest.approx(height - limit_deg)
    for lacking in ({"utc_at_boot_s": None, "boot_s": 50.0}, {"utc_at_boot_s": 1.75e9, "boot_s": None}):
        assert measure(shown(ctx, **lacking), "dark") is None
    assert measure(silent(shown(ctx, utc_at_boot_s=1.75e9, boot_s=50.0)), "dark") is None
    ctx.snapshot = replace(ctx.snapshot, vehicle=None)
    assert measure(ctx, "dark") is None


def test_how_far_she_is_off_the_place_of_her_loiter():
    rest = {"sailing": True, "over": "all goals are reached", "rest_en_m": (30.0, 40.0)}
    assert measure(moment(WAY, voyage=rest), "dragged off") == pytest.approx(50.0)
    assert measure(moment(WAY, voyage=rest, seen={"vehicle_age_s": 9.0}), "dragged off") is None
    assert measure(moment(WAY), "dragged off") is None
    home = moment(WAY, voyage=rest, alarms={"raised": moment(WAY, up=("dragged off",)).state.alarms.raised})
    assert measure(home, "dragged off") == pytest.approx(50.0)


@pytest.mark.parametrize(("up", "figure"), [(("dragged off",), 100.0), (("dragged off", "leaking"), None)])
def test_on_her_way_back_she_is_still_off_it_and_bound_elsewhere_it_is_not_asked(up, figure):
    rest = {"sailing": True, "over": "all goals are reached", "rest_en_m": (0.0, 100.0)}
    ctx = moment(WAY, voyage=rest, obstacles=(box(-20, 40, 20, 60),), up=up)
    assert measure(ctx, "dragged off") == figure


@pytest.mark.parametrize(
    ("nearest_m", "figure"),
    [
        (5.0, 100.0),  # she was there
        (90.0, 0.0),  # she comes to it, round a corner
        (70.0, 100.0),  # she has come no nearer, and leaves it
    ],
)
def test_told_to_stay_she_is_off_her_place_once_there_or_leaving(nearest_m, figure):
    there = route((0.0, 100.0))
    ctx = moment(there, up=("leaking",), adrift={"nearest_m": nearest_m})
    assert measure(ctx, "dragged off") == pytest.approx(figure)
    assert measure(moment(there, adrift={"nearest_m": nearest_m}), "dragged off") is None, "she is to stay nowhere"
    stopped = moment(there, up=("leaking",), adrift={"nearest_m": 5.0}, steering={"own_mode": Mode.LOITER})
    assert measure(stopped, "dragged off") is None, "that loiter is elsewhere"


def test_within_her_loiters_own_swing_she_is_at_her_place():
    """A boat of 4.5 m/s that turns by 10 degrees a second swings by 49 m, and was "dragged off" again and again."""
    rest = {"sailing": True, "over": "all goals are reached", "rest_en_m": (0.0, 55.0)}
    figures = {
        limits.rate_max_radps: measure(moment(WAY, voyage=rest, tws_mps=9.0, seen={"limits": limits}), "dragged off")
        for limits in (AutopilotLimits(), AutopilotLimits(rate_max_radps=math.radians(10.0)))
    }
    assert list(figures.values()) == [pytest.approx(55.0), 0.0]


def test_by_field_where_the_mission_on_board_ends_is_nothing_to_her():
    ends = moment(WAY, mission={"index": len(WAY.items) - 1}, config={"guidance": Guidance.FIELD})
    assert measure(ends, "mission ended") == 1.0
    assert measure(shown(ends, mode=Mode.GUIDED), "mission ended") == 0.0


def test_led_off_her_place_by_the_field_she_is_given_two_minutes_for_the_way_back():
    rest = {"sailing": True, "over": "all goals are reached", "rest_en_m": (0.0, 100.0)}
    island = box(-20, 40, 20, 60)
    for ago_s, figure in {10.0: None, 119.0: None, 121.0: 100.0}.items():
        ctx = moment(WAY, voyage=rest, obstacles=(island,), by_field={"let_go_s": NOW_S - ago_s})
        assert measure(ctx, "dragged off") == figure
        assert (diversion(ctx) is not None) == (figure is None)  # planned: the island is in the straight way


# ------------------------------------------------------------------------------------ how long the charge lasts
def charged(share, *, since_s=NOW_S - 600.0, first=0.9, last=0.7, is_short=False, **parts):
    charge = None if last is None else Charge(since_s=since_s, first=first, last=last, is_short=is_short)
    return shown(
        moment(WAY, alarms={"charge": charge}, **parts), battery_remaining=share, home=FRAME.geo_from_en(0.0, 0.0)
    )


@pytest.mark.parametrize(
    ("share", "last", "expected"),
    [
        (0.7, None, (NOW_S, 0.7, 0.7)),  # the first that is heard
        (0.65, 0.7, (NOW_S - 600.0, 0.9, 0.65)),
        (0.714, 0.7, (NOW_S - 600.0, 0.9, 0.7)),  # the last percent trembles
        (0.716, 0.7, (NOW_S, 0.716, 0.716)),  # it is charged
    ],
)
def test_where_the_fall_of_the_charge_began(share, last, expected):
    ctx = charged(share, last=last)
    follow_charge(ctx)
    charge = ctx.state.alarms.charge
    assert (charge.since_s, charge.first, charge.last) == expected
    unheard = charged(None)
    follow_charge(unheard)
    assert unheard.state.alarms.charge.last == 0.7


@pytest.mark.parametrize(
    ("since_s", "first", "left_s"),
    [(600.0, 0.9, 0.7 * 600.0 / 0.2), (300.0, 0.9, 0.7 * 300.0 / 0.2), (299.0, 0.9, None), (600.0, 0.74, None)],
)
def test_the_charge_lasts_at_the_rate_at_which_it_fell(since_s, first, left_s):
    found = lasts_s(charged(0.7, since_s=NOW_S - since_s, first=first))
    assert found == (None if left_s is None else pytest.approx(left_s))
    assert lasts_s(charged(0.7, last=None)) is None


def test_the_way_to_where_she_can_wait_is_twice_the_straight_one_at_her_best_speed():
    ctx = charged(0.7, at=(300.0, 400.0))
    best = ctx.voyage.boat.polar.max_speed_mps(5.0)
    assert way_s(ctx) == pytest.approx(2.0 * 500.0 / best)
    calm = charged(0.7, at=(300.0, 400.0), tws_mps=0.1)
    assert way_s(calm) == pytest.approx(2.0 * 500.0 / 0.5)
    assert way_s(shown(ctx, home=None)) is None
    assert way_s(charged(0.7, seen={"vehicle_age_s": 9.0})) is None


@pytest.mark.parametrize(("factor", "is_said"), [(1.01, False), (0.99, True)])
def test_a_charge_that_lasts_less_than_one_and_a_half_times_the_way_is_short(factor, is_said):
    far_m = 500.0
    ctx = charged(0.7, at=(far_m, 0.0))
    needed_s = 1.5 * way_s(ctx)
    first = 0.7 + 0.7 * 600.0 / (factor * needed_s)
    ctx = charged(0.7, at=(far_m, 0.0), first=first)
    assert lasts_s(ctx) == pytest.approx(factor * needed_s)
    follow_charge(ctx)
    assert ctx.state.alarms.charge.is_short is is_said
    assert [a.code for a in ctx.actions] == ["charge"] * is_said
    again = with_parts(ctx.state)
    follow_charge(ctx)
    assert ctx.state.alarms.charge == again.alarms.charge
    assert len(ctx.actions) == is_said  # once

"""A wind that is doubted, moment by moment: which winds are reckoned with, when sea room is sought, what is held."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from shapely import affinity
from shapely.geometry import box

from companion.geo.angles import difference_rad
from companion.messages import Command, Mode
from companion.skipper.behaviors import wind_doubt
from companion.skipper.behaviors.wind_doubt import SEA_ROOM, WAITS, DoubtedWind, doubted_wind, holds, seeks_sea_room
from companion.skipper.step import StepContext, WindBefore
from companion.skipper.step import actions as act
from companion.skipper.step.state import PATIENT, PendingUpload, Phase
from tests.skipper.moments import NOW_S, asked_for, moment, route
from tests.skipper.world import ALL_PERMITTED

WHY = "the vane was turned"
WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))
PLACE = (80.0, 0.0)
ROOM = route((300.0, 0.0), PLACE, rung=SEA_ROOM, why="waiting until there is sea room")
BEFORE = WindBefore(twd_from_rad=0.0, tws_mps=5.0, turned_rad=math.radians(90.0))
ROCK = box(-30.0, -60.0, 90.0, -40.0)  # to leeward in the wind before, which drives a LOITER south at 1 m/s
ASTERN = box(-120.0, -5.0, -90.0, 5.0)


def doubted(way=WAY, *, before=BEFORE, velocity=None, status=None, unsure=WHY, told_deg=90.0, **parts) -> StepContext:
    """Return a moment in which the wind is doubted, in AUTO, heading east at 2 m/s."""
    ctx = moment(way, twd_deg=told_deg, **parts)
    seen = ctx.snapshot
    vehicle = seen.vehicle if velocity is None else replace(seen.vehicle, velocity_en_mps=velocity)
    told = replace(seen.autopilot, **(status or {}))
    snapshot = replace(seen, vehicle=vehicle, autopilot=told, unsure=unsure, wind_before=before)
    return StepContext(ctx.voyage, ctx.config, ctx.state, snapshot)


def loitering(**changes) -> StepContext:
    """Return a moment in a LOITER that was asked for; it has no way on where none is given."""
    steering = {"own_mode": Mode.LOITER} | changes.pop("steering", {})
    return doubted(steering=steering, **({"velocity": (0.0, 0.0), "status": {"mode": Mode.LOITER}} | changes))


def plan_of(twd_deg):
    """Return a way that was planned in this wind."""
    return route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0), plan_twd_from_rad=math.radians(twd_deg))


def asked(ctx, kind):
    return [a for a in ctx.actions if isinstance(a, kind)]


def modes(ctx):
    return [a.mode for a in asked(ctx, act.SetMode)]


# ---------------------------------------------------------------------------------------------------- winds
@pytest.mark.parametrize(
    ("told_deg", "course_deg", "sails"),
    [
        (0.0, 54.0, False),  # ten degrees outside the true no-go zone, which is not measured now
        (0.0, 56.0, True),
        (0.0, 306.0, False),
        (0.0, 304.0, True),
        (110.0, 66.0, False),  # in the told one the autopilot does not follow the leg
        (110.0, 64.0, True),
        (-60.0, 144.0, False),  # a sheet that is eased for 156 degrees does not draw at 144 ...
        (-60.0, 146.0, True),  # ... that of 154 at 146 does
    ],
)
def test_a_course_is_sailed_outside_both_no_go_zones_by_a_sheet_that_draws(told_deg, course_deg, sails):
    wind = DoubtedWind(true_from_rad=0.0, told_from_rad=math.radians(told_deg), drift_en_mps=(0.0, -1.0))
    assert wind.sails(math.radians(course_deg), math.radians(45.0)) is sails


@pytest.mark.parametrize(
    ("from_deg", "turned_deg", "told_deg"), [(0.0, 46.0, 46.0), (60.0, -50.0, 10.0), (170.0, 120.0, -70.0)]
)
def test_the_wind_before_is_the_true_one_and_drives_her_to_leeward_at_a_fifth_of_its_speed(
    from_deg, turned_deg, told_deg
):
    before = WindBefore(twd_from_rad=math.radians(from_deg), tws_mps=6.0, turned_rad=math.radians(turned_deg))
    wind = doubted_wind(doubted(before=before))
    assert math.degrees(wind.true_from_rad) == pytest.approx(from_deg)
    assert math.degrees(wind.told_from_rad) == pytest.approx(told_deg)
    leeward = math.radians(from_deg + 180.0)
    assert wind.drift_en_mps == pytest.approx((1.2 * math.sin(leeward), 1.2 * math.cos(leeward)))


@pytest.mark.parametrize("turned_deg", [44.0, -44.0])
def test_a_wind_that_turned_by_less_than_the_no_go_zone_keeps_the_bow_off_the_true_one(turned_deg):
    assert doubted_wind(doubted(before=replace(BEFORE, turned_rad=math.radians(turned_deg)))) is None


@pytest.mark.parametrize(
    ("plan_mps", "trimmed_s", "is_known"),
    [
        (5.0, -math.inf, True),
        (0.0, -math.inf, False),
        (5.0, NOW_S - 99.0, False),  # the plan on board was made by a vane that was turned
        (5.0, NOW_S - 101.0, True),
    ],
)
def test_after_a_restart_it_is_the_wind_that_the_way_on_board_was_planned_in(plan_mps, trimmed_s, is_known):
    way = route((300.0, 0.0), (600.0, 0.0), plan_twd_from_rad=math.radians(20.0), plan_tws_mps=plan_mps)
    ctx = doubted(way, before=None, vane={"trimmed_s": trimmed_s}, mission={"route": way, "uploaded_s": NOW_S - 100.0})
    wind = doubted_wind(ctx)
    assert (wind is not None) is is_known
    if wind is not None:
        assert math.degrees(wind.true_from_rad) == pytest.approx(20.0)
        assert math.degrees(wind.told_from_rad) == pytest.approx(90.0)


def test_what_is_remembered_goes_before_what_the_plan_says():
    wind = doubted_wind(doubted(before=replace(BEFORE, twd_from_rad=1.0)))
    assert wind.true_from_rad == 1.0


@pytest.mark.parametrize(("astern_mps", "is_shown"), [(0.29, False), (0.31, True)])
def test_a_boat_that_goes_astern_in_a_loiter_points_into_the_true_wind(astern_mps, is_shown):
    wind = doubted_wind(loitering(before=None, told_deg=20.0, velocity=(-astern_mps, 0.0)))
    assert (wind is not None) is is_shown
    if wind is not None:
        assert math.degrees(wind.true_from_rad) == pytest.approx(90.0)
        assert math.degrees(wind.told_from_rad) == pytest.approx(20.0)
        assert wind.drift_en_mps == (-astern_mps, 0.0)


# -------------------------------------------------------------------------------------------------- sea room
def test_sea_room_is_uploaded_with_a_loiter_at_its_end_and_said_once():
    ctx = doubted(
        obstacles=(ROCK,), pending={"plan": asked_for(WAY)}, plans={"rung": 2}, adrift={"loiter_en_m": (0.0, 0.0)}
    )
    assert seeks_sea_room(ctx)
    [upload] = asked(ctx, act.UploadMission)
    assert upload.items[-1].command == Command.NAV_LOITER_UNLIM
    made = ctx.state.pending.upload.route
    assert (made.rung, len(made.items)) == (SEA_ROOM, 1)
    assert made.leg_from_en_m[0] == (0.0, 0.0)
    assert ctx.state.phase is Phase.HOLDING
    assert ctx.state.why == made.why
    assert "drift onto o0 in" in made.why
    assert made.why.endswith("sea room")
    assert [a.code for a in asked(ctx, act.Announce)].count(SEA_ROOM) == 1
    assert [a.request_id for a in asked(ctx, act.CancelPlan)] == [9]
    assert (ctx.state.pending.plan, ctx.state.plans.rung) == (None, 0)
    assert (ctx.state.adrift.looked_s, ctx.state.adrift.loiter_en_m) == (NOW_S, None)


@pytest.mark.parametrize(("index", "kept"), [(0, 0), (1, 1), (2, 2), (3, 2)])
def test_what_she_has_passed_stays_on_board_before_the_leg_to_sea_room(index, kept):
    ctx = doubted(obstacles=(ROCK,), mission={"route": WAY, "index": index})
    assert seeks_sea_room(ctx)
    assert ctx.state.pending.upload.route.points_en_m[:-1] == WAY.points_en_m[:kept]
    assert asked(ctx, act.UploadMission)[0].set_current == kept + 1


@pytest.mark.parametrize(
    ("change", "seeks"),
    [
        ({}, True),
        ({"unsure": ""}, False),
        ({"permissions": replace(ALL_PERMITTED, may_upload=False)}, False),
        ({"permissions": replace(ALL_PERMITTED, may_set_mode=False)}, False),
        ({"status": {"ekf_ok": False}}, False),
        ({"voyage": {"sailing": False}}, False),
        ({"mission": {"route": WAY, "foreign": "another's"}}, False),
        ({"mission": {"route": None}}, False),
        ({"adrift": {"looked_s": NOW_S - 4.9}}, False),  # hundreds of legs are tried
        ({"adrift": {"looked_s": NOW_S - 5.0}}, True),
        ({"pending": {"upload_retry": replace(PATIENT, not_before_s=NOW_S + 0.1)}}, False),
        ({"pending": {"upload_retry": replace(PATIENT, not_before_s=NOW_S)}}, True),
        ({"obstacles": ()}, False),
        ({"obstacles": (box(-30.0, -340.0, 90.0, -320.0),)}, False),  # more than five minutes off
        ({"before": None, "told_deg": 0.0}, False),  # as the plan's
    ],
)
def test_when_sea_room_is_sought(change, seeks):
    ctx = doubted(**({"obstacles": (ROCK,)} | change))
    assert seeks_sea_room(ctx) is seeks
    assert bool(asked(ctx, act.UploadMission)) is seeks


@pytest.mark.parametrize("from_deg", [0.0, 60.0])
@pytest.mark.parametrize(("off_deg", "meets"), [(-13.0, True), (13.0, True), (-19.0, False), (19.0, False)])
def test_the_drift_may_go_fifteen_degrees_beside_the_wind_before(from_deg, off_deg, meets):
    off = math.radians(from_deg + 180.0 + off_deg)
    at = (200.0 * math.sin(off), 200.0 * math.cos(off))
    before = replace(BEFORE, twd_from_rad=math.radians(from_deg))
    ctx = doubted(before=before, obstacles=(box(at[0] - 1.0, at[1] - 1.0, at[0] + 1.0, at[1] + 1.0),))
    assert seeks_sea_room(ctx) is meets


def test_by_a_wind_that_is_known_she_leaves_a_place_without_room_on_a_course_that_is_sailed_in_it():
    """Wind from north east, a rock south of her: the nearest places lie north and are not sailed to."""
    ctx = doubted(before=None, told_deg=45.0, obstacles=(box(-60.0, -40.0, 60.0, -20.0),), way=plan_of(45.0))
    assert seeks_sea_room(ctx)
    east, north = ctx.state.pending.upload.route.points_en_m[-1]
    assert abs(difference_rad(math.atan2(east, north), math.radians(45.0))) >= math.radians(55.0)


def test_with_water_all_about_the_place_is_near():
    ctx = doubted(obstacles=(box(-5.0, -60.0, 5.0, -50.0),))
    assert seeks_sea_room(ctx)
    assert math.hypot(*ctx.state.pending.upload.route.points_en_m[-1]) == pytest.approx(40.0)


@pytest.mark.parametrize(("off_m", "seeks"), [(22.0, True), (24.0, False)])
@pytest.mark.parametrize(("turned_deg", "before"), [(30.0, True), (90.0, True), (90.0, False)])
def test_a_loiter_needs_room_for_its_circles_by_whatever_wind(turned_deg, before, off_m, seeks):
    """Fifteen metres and the floor's eight: to windward of her nothing drifts, but she circles."""
    known = replace(BEFORE, turned_rad=math.radians(turned_deg)) if before else None
    told_deg = 90.0 if before else 0.0
    ctx = doubted(before=known, told_deg=told_deg, obstacles=(box(-60.0, off_m, 60.0, off_m + 20.0),))
    assert seeks_sea_room(ctx) is seeks
    if seeks:
        assert "circle too near to o0" in ctx.state.why


def test_the_circles_are_about_the_place_where_the_loiter_began():
    rock = box(-60.0, 40.0, 60.0, 60.0)
    begun = {"loiter_en_m": (0.0, 20.0), "loiter_s": NOW_S}
    assert seeks_sea_room(loitering(obstacles=(rock,), adrift=begun))
    assert not seeks_sea_room(loitering(obstacles=(rock,), adrift={"loiter_en_m": None}))
    assert not seeks_sea_room(doubted(obstacles=(rock,), adrift=begun)), "in AUTO it would begin here"


@pytest.mark.parametrize(
    ("since_s", "off_m", "velocity", "stays"),
    [
        (29.0, 0.0, (0.0, 0.0), False),
        (30.0, 0.0, (0.0, 0.0), True),  # twice the fifteen metres, at 1 m/s
        (30.0, 14.9, (0.0, 0.0), True),
        (30.0, 15.1, (0.0, 0.0), False),
        (30.0, 0.0, (-1.0, 0.0), False),  # astern
    ],
)
def test_a_loiter_that_would_have_been_driven_off_by_now_stays(since_s, off_m, velocity, stays):
    begun = {"loiter_en_m": (-off_m, 0.0), "loiter_s": NOW_S - since_s}
    assert seeks_sea_room(loitering(obstacles=(ROCK, ASTERN), adrift=begun, velocity=velocity)) is not stays


@pytest.mark.parametrize("rung", [SEA_ROOM, "", "wider"])
def test_while_a_way_is_being_uploaded_no_other_is_sought(rung):
    on_its_way = PendingUpload(
        upload_id=3, t_s=NOW_S - 2.0, route=replace(ROOM, rung=rung), set_current=1, keep_first=0
    )
    ctx = doubted(obstacles=(ROCK,), pending={"upload": on_its_way})
    assert seeks_sea_room(ctx) is (rung == SEA_ROOM)
    assert not ctx.actions
    assert (ctx.state.why == ROOM.why) is (rung == SEA_ROOM)
    assert (ctx.state.phase is Phase.HOLDING) is (rung == SEA_ROOM)


@pytest.mark.parametrize(
    ("change", "goes_on"),
    [
        ({}, True),
        ({"velocity": (0.31, -1.0)}, True),
        ({"velocity": (0.29, -1.0)}, False),  # made good towards it
        ({"velocity": (0.0, 0.0), "mission": {"uploaded_s": NOW_S - 19.9}}, True),  # she is turning
        ({"velocity": (0.0, 0.0), "mission": {"uploaded_s": NOW_S - 20.0}}, False),
        ({"obstacles": (ROCK, box(30.0, 1.6, 40.0, 9.0))}, True),  # a metre beside the hull
        ({"obstacles": (ROCK, box(30.0, 1.4, 40.0, 9.0))}, False),
    ],
)
def test_a_leg_to_sea_room_is_left_when_it_is_not_sailed_or_no_longer_clear(change, goes_on):
    mission = {"route": ROOM, "index": 1} | change.pop("mission", {})
    ctx = doubted(ROOM, **({"obstacles": (ROCK,), "mission": mission} | change))
    assert seeks_sea_room(ctx)
    assert bool(asked(ctx, act.UploadMission)) is not goes_on
    if goes_on:
        left_m = math.dist(ctx.boat_en, PLACE)
        told = (
            f"{WHY}: {left_m:.0f} m to where a loiter has more room; waiting until there"  # not the drift from before
        )
        assert (ctx.state.phase, ctx.state.why) == (Phase.HOLDING, told)


@pytest.mark.parametrize(
    ("east_m", "velocity", "why"),
    [
        (PLACE[0] - 15.1, (1.0, 0.0), f"{WHY}: 15 m to where a loiter has more room; waiting until there"),
        (PLACE[0] - 14.9, (0.0, 0.0), f"{WHY}: {WAITS}"),  # there, whichever way she goes
        (PLACE[0] + 14.9, (1.0, 0.0), f"{WHY}: {WAITS}"),
    ],
)
def test_at_its_end_she_waits(east_m, velocity, why):
    ctx = doubted(ROOM, obstacles=(ROCK,), at=(east_m, 0.0), velocity=velocity, mission={"route": ROOM, "index": 1})
    assert seeks_sea_room(ctx)
    assert not ctx.actions
    assert ctx.state.why == why


def test_driven_astern_in_the_loiter_at_its_end_she_seeks_another():
    ctx = doubted(
        ROOM, obstacles=(ROCK,), at=PLACE, heading_deg=0.0, velocity=(0.0, -0.8), mission={"route": ROOM, "index": 1}
    )
    assert seeks_sea_room(ctx)
    assert asked(ctx, act.UploadMission)


def test_a_boat_that_was_put_into_a_loiter_on_her_way_there_is_given_back_to_it():
    ctx = loitering(
        way=ROOM,
        obstacles=(ROCK,),
        velocity=(1.0, 0.0),
        status={"mode": Mode.LOITER, "mission_seq": 2},
        mission={"route": ROOM, "index": 1},
    )
    assert seeks_sea_room(ctx)
    assert modes(ctx) == [Mode.AUTO]


@pytest.mark.parametrize(
    ("mode", "velocity", "begins"),
    [
        (Mode.AUTO, (4.0, 3.0), [(12.0, 9.0), (6.0, 4.5), (0.0, 0.0)]),  # three seconds on, or at once
        (Mode.LOITER, (4.0, 3.0), [(12.0, 9.0), (0.0, 15.0), (15.0, 0.0), (0.0, -15.0), (-15.0, 0.0)]),  # in a circle
        (Mode.LOITER, (-1.0, 0.0), [(0.0, 0.0), (0.0, 3.0), (3.0, 0.0), (0.0, -3.0), (-3.0, 0.0)]),  # astern: stopped
    ],
)
def test_the_leg_to_sea_room_may_begin_wherever_she_has_come_to(monkeypatch, mode, velocity, begins):
    seen = []
    monkeypatch.setattr(wind_doubt, "sea_room", lambda water, boat, starts, *_, **__: seen.append(starts))
    seeks_sea_room(doubted(obstacles=(ROCK, ASTERN), velocity=velocity, status={"mode": mode}))
    assert [round(x, 6) for start in seen[0] for x in start] == [x for start in begins for x in start]


@pytest.mark.parametrize(("slope_deg", "seeks"), [(51.0, False), (52.0, True)])
def test_a_minute_more_of_drift_is_worth_a_way(slope_deg, seeks):
    """Along this coast every place is driven onto it; she can come to one that has 56 s more, or 62."""
    coast = affinity.rotate(box(-4000.0, -4000.0, 4000.0, -100.0), slope_deg, origin=(0.0, -100.0))
    ctx = doubted(obstacles=(coast,))
    assert seeks_sea_room(ctx) is seeks
    if seeks:
        assert ctx.state.why.endswith("onto o0 in 68 s; waiting until there is room for 130 s")


# ------------------------------------------------------------------------------------------------------ held
def test_in_our_loiter_the_place_is_noted_once_and_she_waits():
    ctx = loitering(adrift={"loiter_en_m": None}, at=(7.0, 3.0))
    assert holds(ctx)
    assert (ctx.state.adrift.loiter_en_m, ctx.state.adrift.loiter_s) == ((7.0, 3.0), NOW_S)
    assert (ctx.state.phase, ctx.state.why) == (Phase.HOLDING, f"{WHY}: {WAITS}")
    assert not modes(ctx)
    kept = loitering(adrift={"loiter_en_m": (0.0, 0.0), "loiter_s": 1.0}, at=(7.0, 3.0))
    assert holds(kept)
    assert (kept.state.adrift.loiter_en_m, kept.state.adrift.loiter_s) == ((0.0, 0.0), 1.0)


@pytest.mark.parametrize(("loitered", "kept"), [(False, None), (True, (1.0, 2.0))])
def test_when_the_wind_is_known_again_the_loiters_place_is_forgotten_but_that_of_a_calm(loitered, kept):
    ctx = loitering(unsure="", adrift={"loiter_en_m": (1.0, 2.0), "loitered": loitered})
    assert not holds(ctx)
    assert ctx.state.adrift.loiter_en_m == kept
    assert not ctx.actions


@pytest.mark.parametrize(
    ("change", "is_held", "asks"),
    [
        ({}, True, [Mode.LOITER]),
        ({"steering": {"until_s": NOW_S + 9.0, "heading_rad": 1.0}}, True, [Mode.LOITER]),
        ({"status": {"mode": Mode.LOITER}}, True, [Mode.LOITER]),  # the mission's, or a person's: not ours yet
        ({"permissions": replace(ALL_PERMITTED, may_set_mode=False)}, False, []),
        ({"status": {"ekf_ok": False}}, False, []),
        ({"pending": {"accepted": ("LOITER", NOW_S - 0.5)}}, True, []),
    ],
)
def test_loiter_is_asked_for_while_the_wind_is_not_known(change, is_held, asks):
    ctx = doubted(pending={"plan": asked_for(WAY)} | change.pop("pending", {}), **change)
    assert holds(ctx) is is_held
    assert modes(ctx) == asks
    assert asked(ctx, act.CancelPlan)
    assert "held" in [a.code for a in asked(ctx, act.Announce)]
    assert ctx.state.operator.is_back is bool(asks)
    if is_held:
        assert (ctx.state.phase, ctx.state.steering.until_s) == (Phase.HOLDING, None)
        assert WHY in ctx.state.why


@pytest.mark.parametrize(("ago_s", "is_said"), [(59.0, False), (61.0, True)])
def test_that_nothing_is_planned_is_said_once_a_minute(ago_s, is_said):
    ctx = doubted(announced={"codes": (("held", NOW_S - ago_s),)})
    holds(ctx)
    assert bool(asked(ctx, act.Announce)) is is_said


BANKS = (box(-300.0, -60.0, 700.0, -20.0), box(-300.0, 20.0, 700.0, 60.0))


@pytest.mark.parametrize(
    ("change", "sails_on"),
    [
        ({}, True),
        ({"velocity": (0.81, 0.0)}, True),
        ({"velocity": (0.79, 0.0)}, False),
        ({"heading_deg": 0.0, "velocity": (2.0, 0.0)}, False),  # sideways is not ahead
        ({"heading_deg": 45.0, "velocity": (0.6, 0.6)}, True),
        ({"heading_deg": 135.0, "velocity": (0.6, 0.6)}, False),
        ({"heading_deg": 225.0, "velocity": (0.6, 0.6)}, False),  # astern
        ({"heading_deg": 80.0, "velocity": (0.0, 2.0)}, False),
        ({"status": {"mode": Mode.HOLD}}, False),
        ({"mission": {"route": WAY, "index": 2}}, False),  # nothing is left but the loiter
        ({"obstacles": ()}, False),  # a loiter has room
        ({"obstacles": (*BANKS, box(200.0, -5.0, 210.0, 5.0))}, False),  # her way is shut
    ],
)
def test_making_way_where_a_loiters_circles_have_no_room_she_sails_on(change, sails_on):
    ctx = doubted(**({"obstacles": BANKS} | change))
    assert holds(ctx)
    assert modes(ctx) == ([] if sails_on else [Mode.LOITER])
    assert (ctx.state.phase, "sailing on" in ctx.state.why) == (Phase.HOLDING, sails_on)

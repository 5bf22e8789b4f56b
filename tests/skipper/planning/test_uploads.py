"""Uploads: what is asked for, what is taken of their end, and the rules of admission one by one."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest
from shapely.geometry import box

from companion.messages import Mode
from companion.planner.track import ExpectedTrack
from companion.skipper.board.mark import are_marked, marked
from companion.skipper.planning import uploads
from companion.skipper.planning.uploads import (
    _below_floor,
    _is_sailed,
    _less,
    is_begun_risky,
    is_on_board_sound,
    is_open,
    is_riskier,
    is_sound,
    leads_there,
    take_upload,
    too_risky,
    upload,
)
from companion.skipper.step import UploadMission, UploadOutcome, UploadResult
from companion.skipper.step.actions import Announce, Change, ReplanReason
from companion.skipper.step.config import DRY_RUN
from companion.skipper.step.missions import stopgap
from companion.skipper.step.snapshot import WindEstimate
from companion.skipper.step.state import Announced, PendingPlan, PendingUpload, Retry
from tests.skipper.moments import NOW_S, moment, route

OLD = route((300.0, 0.0), (600.0, 0.0), (600.0, 600.0), (600.0, 600.0), gate_of=(-1, -1, 0, -1))
OLD = replace(OLD, items=marked(OLD.items))
NEW = route((300.0, 0.0), (600.0, 0.0), (700.0, 500.0), (700.0, 500.0), gate_of=(-1, -1, 0, -1), plan_id=9)
CHECKED = {"route": OLD, "checked": True}


def pending_plan(*, gate=0, bound_for="", margin_m=15.0, delta_s=0.95, problem=None, from_index=None):
    return PendingPlan(
        request_id=5,
        t_s=NOW_S,
        reason=ReplanReason.ORDER,
        from_index=from_index,
        rung=0,
        gate=gate,
        lead_in=(),
        start_en_m=(0.0, 0.0),
        facts=replace(NEW, bound_for=bound_for, margin_m=margin_m, delta_s=delta_s),
        problem=problem,
    )


# ------------------------------------------------------------------------------------------------------ asking
@pytest.mark.parametrize(
    ("mission", "whole", "keep"),
    [
        (CHECKED, False, 2),
        (CHECKED, True, 0),
        (CHECKED | {"checked": False}, False, 0),
        (CHECKED | {"foreign": "theirs"}, False, 0),
        ({"route": None, "checked": True}, False, 0),
    ],
)
def test_what_is_on_board_and_the_same_is_kept(mission, whole, keep):
    ctx = moment(None, mission=mission, pending={"read": (3, NOW_S)}, plans={"ready_route": OLD})
    upload(ctx, NEW, 2, "why", whole=whole, change=Change(unsafe=True))
    (action,) = ctx.actions
    assert isinstance(action, UploadMission)
    assert (action.keep_first, action.set_current, action.plan_id, action.text) == (keep, 2, 9, "why")
    assert (action.items, are_marked(action.items)) == (marked(NEW.items), True)
    assert action.change.unsafe
    waits = ctx.state.pending.upload
    assert (waits.upload_id, waits.t_s, waits.set_current, waits.keep_first) == (action.upload_id, NOW_S, 2, keep)
    assert waits.route.items == action.items
    assert (ctx.state.pending.read, ctx.state.plans.ready_route) == (None, None)
    closing = stopgap(OLD, 2, 0) if keep else stopgap(NEW, 0, 0)
    assert action.stopgap == marked([closing])[0]


def test_what_is_not_known_to_be_on_board_is_no_place_to_close_it_at():
    """A list that was not compared yet may be another's: the stopgap is of the new one."""
    elsewhere = replace(NEW, items=NEW.items[1:], points_en_m=NEW.points_en_m[1:])
    ctx = moment(None, mission=CHECKED | {"checked": False})
    upload(ctx, elsewhere, None, "")
    assert ctx.actions[0].stopgap == marked([stopgap(elsewhere, 0, 0)])[0] != marked([stopgap(OLD, 0, 0)])[0]


@pytest.mark.parametrize(("armed", "is_closed"), [(True, True), (False, False)])
def test_a_boat_that_is_armed_never_has_a_stranger_s_mixture_on_board(armed, is_closed):
    ctx = moment(None, mission={"route": None, "checked": True})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, is_armed=armed))
    upload(ctx, NEW, None, "")
    assert (ctx.actions[0].stopgap is not None) is is_closed
    assert ctx.actions[0].change == Change()
    silent = moment(None, mission={"route": None, "checked": True}, seen={"heartbeat_age_s": 9.0})
    upload(silent, NEW, None, "")
    assert silent.actions[0].stopgap is None


def test_without_permission_it_stays_ready_and_is_said():
    ctx = moment(OLD, mission=CHECKED, permissions=DRY_RUN, pending={"read": (3, NOW_S)})
    upload(ctx, replace(NEW, cost_s=412.0), None, "first: optimal")
    (said,) = (a for a in ctx.actions if isinstance(a, Announce))
    assert said.code == "upload not permitted"
    assert re.fullmatch(
        r"a plan is ready: \d+ m in 412 s, \d+ legs?; first: optimal; uploading is not permitted", said.text
    )
    assert ctx.state.plans.ready_route.items == marked(NEW.items)
    assert (ctx.state.pending.upload, ctx.state.pending.read) == (None, (3, NOW_S))


@pytest.mark.parametrize(("ago_s", "is_told"), [(61.0, False), (3590.0, False), (3601.0, True)])
def test_that_uploading_is_not_permitted_is_told_of_one_plan_an_hour(ago_s, is_told):
    """A dry run plans anew each minute, and each of its plans was a warning."""
    ctx = moment(OLD, mission=CHECKED, permissions=DRY_RUN)
    ctx.set(announced=Announced(codes=(("upload not permitted", NOW_S - ago_s),)))
    upload(ctx, NEW, None, "")
    assert any(isinstance(a, Announce) for a in ctx.actions) is is_told
    assert ctx.state.plans.ready_route.items == marked(NEW.items)


# ------------------------------------------------------------------------------------------------------- its end
def ended(result=UploadResult.OK, *, number=3, set_current=None, sailing=True, text="", **parts):
    waits = PendingUpload(upload_id=3, t_s=NOW_S - 4.0, route=NEW, set_current=set_current, keep_first=2)
    told = {
        "pending": {"upload": waits, "upload_retry": Retry(failures=2)},
        "mission": {
            "route": OLD,
            "index": 1,
            "own_index": 0,
            "checked": True,
            "foreign": "theirs",
            "unsure_route": OLD,
            "replace_foreign": True,
            "asked_s": 7.0,
            "asked_seq": 9,
        },
        "plans": {"no_go_since_s": 1.0, "replanned_index": 2},
        "voyage": {"sailing": sailing},
    }
    ctx = moment(OLD, **(told | parts))
    take_upload(ctx, UploadOutcome(upload_id=number, result=result, text=text))
    return ctx


@pytest.mark.parametrize(
    ("set_current", "sailing", "index", "asked", "replanned"),
    [
        (None, True, 1, (7.0, None), 2),
        (1, True, 0, (NOW_S, 1), -1),
        (3, True, 2, (NOW_S, 3), 2),
        (3, False, 2, (NOW_S, None), 2),
    ],
)
def test_an_upload_that_came_through_sails(set_current, sailing, index, asked, replanned):
    ctx = ended(set_current=set_current, sailing=sailing)
    mission = ctx.state.mission
    assert (mission.route, mission.index, mission.own_index) == (NEW, index, index)
    assert (mission.checked, mission.foreign, mission.unsure_route, mission.replace_foreign) == (True, "", None, False)
    assert (mission.asked_s, mission.asked_seq, mission.uploaded_s) == (*asked, NOW_S)
    assert (ctx.state.pending.upload, ctx.state.pending.upload_retry) == (None, Retry())
    assert (ctx.state.plans.no_go_since_s, ctx.state.plans.replanned_index) == (None, replanned)


def test_before_the_first_item_the_count_of_our_own_begins_at_it():
    lost = ended(mission={"route": None, "index": -1, "own_index": -1})
    assert (lost.state.mission.index, lost.state.mission.own_index) == (-1, 0)


@pytest.mark.parametrize(
    ("missed_s", "left_s"), [(None, None), (NOW_S - 5.0, None), (NOW_S - 4.0, NOW_S - 4.0), (NOW_S, NOW_S)]
)
def test_an_upload_that_was_on_its_way_at_a_miss_does_not_lead_back(missed_s, left_s):
    assert ended(progress={"missed_s": missed_s}).state.progress.missed_s == left_s


@pytest.mark.parametrize("result", [r for r in UploadResult if r is not UploadResult.OK])
def test_one_that_failed_is_read_and_said(result):
    ctx = ended(result, text="no words of mine")
    mission = ctx.state.mission
    assert (mission.route, mission.unsure_route, mission.checked, mission.read_since_s) == (OLD, NEW, False, NOW_S)
    assert ctx.state.pending.upload is None
    assert ctx.state.pending.upload_retry == Retry(failures=3, not_before_s=NOW_S + 40.0)
    (said,) = [a for a in ctx.actions if isinstance(a, Announce)]
    assert (said.code, "no words of mine" in said.text) == ("upload failed", True)
    again = ended(result)
    take_upload(again, UploadOutcome(upload_id=3, result=result))
    assert len(again.actions) == 1  # it is over


def test_an_answer_to_another_upload_is_none():
    ctx = ended(number=4)
    assert ctx.state.pending.upload is not None
    assert ctx.state.mission.route is OLD


# ----------------------------------------------------------------------------------------------------- admission
def track(clearance_m, lack_m, error_m=0.0):
    return SimpleNamespace(clearance_m=clearance_m, lack_m=lack_m)


def asks(floor_m):
    return SimpleNamespace(tracking=None if floor_m is None else SimpleNamespace(floor_m=floor_m))


@pytest.mark.parametrize(
    ("new", "old", "here_m", "floor_m", "refused"),
    [
        (track(8.0, 0.0), None, 20.0, 8.0, False),
        (track(7.0, 1.0), None, 20.0, 8.0, True),
        (track(7.0, 1.0), None, 8.0, 8.0, True),
        (track(7.0, 1.0), None, 7.0, 8.0, False),  # below it already: no nearer than she is
        (track(6.7, 1.0), None, 7.0, 8.0, False),  # by more than a turn's room
        (track(6.69, 1.0), None, 7.0, 8.0, True),
        (track(3.0, 1.0), track(3.2, 1.0), 7.0, 8.0, False),  # nor than the way on board would bring her
        (track(2.8, 1.0), track(3.2, 1.0), 7.0, 8.0, True),
        (track(6.0, 1.0), track(9.0, 0.0), 7.0, 8.0, True),
        (track(-1.0, 1.0), None, 7.0, None, True),
    ],
)
def test_nothing_below_the_floor_but_from_below_it(new, old, here_m, floor_m, refused):
    says = _below_floor(asks(floor_m), new, old, here_m=here_m)
    assert bool(says) is refused
    if refused and floor_m:
        assert f"the floor is {floor_m:g} m" in says
        assert ("and the boat is" in says) is (here_m < floor_m)


@pytest.mark.parametrize(
    ("mode", "is_sailed"), [(Mode.AUTO, True), (Mode.GUIDED, True), (Mode.LOITER, False), (Mode.HOLD, False)]
)
def test_a_way_on_board_counts_while_it_is_sailed(mode, is_sailed):
    ctx = moment(OLD)
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=mode))
    assert _is_sailed(ctx) is is_sailed
    ctx.snapshot = replace(ctx.snapshot, heartbeat_age_s=9.0)
    assert not _is_sailed(ctx)


@pytest.mark.parametrize(
    ("mission", "asked", "leads"),
    [
        ({"route": OLD, "index": 0}, {"gate": 0}, True),
        ({"route": OLD, "index": 2}, {"gate": 0}, True),
        ({"route": OLD, "index": 3}, {"gate": 0}, False),
        ({"route": OLD, "index": 0}, {"gate": 1}, False),
        ({"route": OLD, "index": 0, "foreign": "theirs"}, {"gate": 0}, False),
        ({"route": None}, {"gate": 0}, False),
        ({"route": replace(OLD, bound_for="home")}, {"gate": -1, "bound_for": "home"}, True),
        ({"route": replace(OLD, bound_for="home")}, {"gate": -1, "bound_for": "the refuge"}, False),
        ({"route": OLD}, {"gate": -1}, False),
        ({"route": replace(OLD, gate_of=(-1, -1, -1, 0))}, {"gate": 0}, False),  # the loiter is no way
    ],
)
def test_where_the_mission_on_board_leads(mission, asked, leads):
    assert leads_there(moment(None, mission=mission), pending_plan(**asked)) is leads


def test_a_way_on_board_is_open_only_if_nothing_shuts_it(monkeypatch):
    ctx, good = moment(OLD), SimpleNamespace(is_within_error=True)
    for name, value in (("leads_there", True), ("meetings", ()), ("is_on_board_sound", True)):
        monkeypatch.setattr(uploads, name, lambda *_, value=value: value)
    assert is_open(ctx, pending_plan(), good)
    assert not is_open(ctx, pending_plan(), SimpleNamespace(is_within_error=False))
    for name, value in (("leads_there", False), ("meetings", ("a ship",)), ("is_on_board_sound", False)):
        before = getattr(uploads, name)
        monkeypatch.setattr(uploads, name, lambda *_, value=value: value)
        assert not is_open(ctx, pending_plan(), good), name
        monkeypatch.setattr(uploads, name, before)


NORTH, EAST = [(0.0, 0.0), (0.0, 300.0)], [(0.0, 0.0), (300.0, 0.0), (600.0, 0.0)]


@pytest.mark.parametrize(
    ("way", "change", "sound"),
    [
        (EAST, {}, True),
        (NORTH, {}, True),  # a beat, left to the autopilot
        (NORTH, {"config": {"autopilot_beats": False}}, False),
        (EAST, {"config": {"autopilot_beats": False}, "twd_deg": 90.0, "mean_deg": 0.0}, False),  # by the present wind
        (EAST, {"config": {"autopilot_beats": False}, "twd_deg": 0.0, "mean_deg": 90.0}, False),  # or by its mean
        (EAST, {"obstacles": (box(450, 7.9, 480, 40),)}, False),  # the floor is 8 m
        (EAST, {"obstacles": (box(450, 8.1, 480, 40),)}, True),
        (EAST, {"obstacles": (box(450, 5.0, 480, 40),), "config": {"margin_m": 4.9}}, True),
        (EAST, {"seen": {"wind": WindEstimate()}}, False),
    ],
)
def test_a_way_is_sound_in_both_winds_and_keeps_the_floor(way, change, sound):
    ctx = moment(route(*way[1:], way[-1]), **change)
    assert is_sound(ctx, way) is sound
    assert is_on_board_sound(ctx) is sound
    assert not is_on_board_sound(moment(None, **change))


def test_only_the_leg_that_is_sailed_is_held_against_the_present_wind():
    way = [(0.0, 0.0), (300.0, 0.0), (300.0, 300.0)]
    closed = {"config": {"autopilot_beats": False}, "mean_deg": 60.0, "twd_deg": 0.0}
    assert not is_sound(moment(OLD, config=closed["config"], mean_deg=0.0, twd_deg=0.0), way)
    assert is_sound(moment(OLD, **closed | {"mean_deg": -60.0 + 360.0 - 90.0, "twd_deg": 0.0}), way)


def compared(monkeypatch, *, tacks=(0.0, 0.0), risks=(0.0, 0.0), limit=None, has_risk=True, **asked):
    """``_less`` of a new way than the one on board, whose risks are as given: of the new one, of the old one."""
    here = SimpleNamespace(risk=object() if has_risk else None)
    ways = iter((0, 1))
    monkeypatch.setattr(uploads, "resolved", lambda problem: problem)
    monkeypatch.setattr(uploads, "replace", lambda problem, **_: problem)
    monkeypatch.setattr(uploads, "evaluate", lambda *_: SimpleNamespace(legs=next(ways)))
    monkeypatch.setattr(uploads, "tacks_at_risk", lambda _, legs: legs)
    monkeypatch.setattr(uploads, "of_risky", lambda legs: tacks[legs])
    monkeypatch.setattr(uploads, "path_risk", lambda _, legs: SimpleNamespace(total=risks[legs]))
    ctx = moment(OLD, config={"max_path_risk": limit})
    plan = pending_plan(problem=here, **asked)
    return _less(ctx, plan, [(0.0, 0.0), (1.0, 1.0)], [(0.0, 0.0), (2.0, 2.0)], heading_rad=0.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, ""),
        ({"margin_m": 14.95}, ""),
        ({"margin_m": 14.85}, "its margin is"),
        ({"margin_m": 20.0}, ""),
        ({"delta_s": 0.94}, "its delta_s is 0.94"),
        ({"delta_s": 0.96}, ""),
        ({"tacks": (0.0111, 0.01)}, "tacks of it that fail"),
        ({"tacks": (0.0109, 0.01)}, ""),
        ({"tacks": (0.01, 0.2)}, ""),
        ({"tacks": (3.0, 1.5)}, ""),  # a bound may be above 1, and both are certain then
        ({"risks": (0.2, 0.1), "limit": 0.15}, "its risk is"),
        ({"risks": (0.2, 0.1), "limit": 0.25}, ""),
        ({"risks": (0.2, 0.3), "limit": 0.15}, ""),
        ({"risks": (0.2, 0.1)}, ""),
        ({"risks": (0.2, 0.1), "limit": 0.15, "has_risk": False}, ""),
    ],
)
def test_nothing_that_promises_less_than_an_open_way_on_board(monkeypatch, change, words):
    found = compared(monkeypatch, **change)
    assert (words in found) if words else (found == "")


# ------------------------------------------------------------------------------------- a plan that is there already
@pytest.mark.parametrize(
    ("touches", "total", "most", "riskier"),
    [
        ({"old": 0.0, "new": 0.0}, 0.0, None, False),
        ({"old": 0.1, "new": 0.05}, 0.0, None, True),
        ({"old": 0.1, "new": 0.1}, 0.0, None, False),
        ({"old": 0.1, "new": 0.2}, 0.0, None, False),
        ({"old": 0.0, "new": 0.0}, 0.3, 0.2, True),
        ({"old": 0.0, "new": 0.0}, 0.2, 0.2, False),
        ({"old": 0.0, "new": 0.0}, 0.3, None, False),
    ],
)
def test_old_legs_that_are_too_risky_do_not_stay_for_being_there(monkeypatch, touches, total, most, riskier):
    monkeypatch.setattr(uploads, "tacks_at_risk", lambda _, legs: legs)
    monkeypatch.setattr(uploads, "of_risky", lambda legs: touches[legs])
    monkeypatch.setattr(uploads, "path_risk", lambda *_: SimpleNamespace(total=total))
    problem = SimpleNamespace(risk=None if most is None else SimpleNamespace(max_path_risk=most))
    assert is_riskier(problem, "old", "new") is riskier


@pytest.mark.parametrize(
    ("tacks", "is_beat", "begun"),
    [
        ([(True, 0)], False, True),
        ([(True, 0)], True, False),
        ([(True, 1)], False, False),
        ([(False, 0)], False, False),
        ([(False, 0), (True, 1), (True, 0)], False, True),
        ([], False, False),
    ],
)
def test_a_tack_that_begins_the_way(monkeypatch, tacks, is_beat, begun):
    found = [SimpleNamespace(is_risky=risky, leg=leg) for risky, leg in tacks]
    monkeypatch.setattr(uploads, "tacks_at_risk", lambda *_: found)
    assert is_begun_risky(object(), [SimpleNamespace(is_beat=is_beat)] * 2) is begun


@pytest.mark.parametrize(
    ("over", "touches", "words"),
    [
        (0.0, 0.0, ""),
        (0.12, 0.0, "its risk of 12 % is above"),
        (0.0, 0.031, "onto something: 3.1 %"),
        (0.2, 0.1, "20 %"),
    ],
)
def test_what_of_a_way_is_too_great_a_risk(monkeypatch, over, touches, words):
    monkeypatch.setattr(uploads, "replace", lambda problem, **_: problem)
    monkeypatch.setattr(uploads, "evaluate", lambda *_: SimpleNamespace(legs=()))
    monkeypatch.setattr(uploads, "_over_limit", lambda *_: over)
    monkeypatch.setattr(uploads, "tacks_at_risk", lambda *_: ())
    monkeypatch.setattr(uploads, "of_risky", lambda _: touches)
    found = too_risky(object(), [(0.0, 0.0), (1.0, 1.0)], heading_rad=0.0)
    assert (words in found) if words else (found == "")


# ------------------------------------------------------------------------------------- what is held against what
def judged(monkeypatch, *, low="", is_way_open=True, less="", set_current=None, here=(0.0, 0.0), **parts):
    """``judged`` with its parts told; return it and what each part was asked."""
    asked = {}

    def of_way(_, way, **more):
        asked.setdefault("ways", []).append((way, more))
        return ExpectedTrack()

    def below(_, new, old, *, here_m):
        asked["below"] = (old is not None, here_m)
        return low

    def less_of(_, __, new, old, *, heading_rad):
        asked["less"] = (new, old, heading_rad)
        return less

    monkeypatch.setattr(uploads, "of_way", of_way)
    monkeypatch.setattr(uploads, "_below_floor", below)
    monkeypatch.setattr(uploads, "is_open", lambda *_: is_way_open)
    monkeypatch.setattr(uploads, "_less", less_of)
    plan = parts.pop("plan", None) or pending_plan(problem=SimpleNamespace(tracking=None, start_heading_rad=0.3))
    ctx = moment(OLD, at=here, **({"mission": {"route": OLD, "index": 0}} | parts))
    return uploads.judged(ctx, NEW, set_current, plan).refused, asked, ctx


def test_both_ways_are_judged_from_where_she_is(monkeypatch):
    says, asked, ctx = judged(monkeypatch, less="less", here=(50.0, 10.0))
    assert says == "less"
    old, new = asked["ways"]
    assert old[0] == [(50.0, 10.0), *OLD.points_en_m[:-1]]
    assert new[0] == [(50.0, 10.0), *NEW.points_en_m[:-1]]
    sailed_m = math.hypot(50.0, 10.0)
    assert (old[1]["sailed_m"], new[1]["sailed_m"]) == (pytest.approx(sailed_m), pytest.approx(sailed_m))
    assert (old[1]["heading_rad"], new[1]["heading_rad"]) == (ctx.snapshot.vehicle.heading_rad,) * 2
    assert asked["below"][0]
    assert asked["less"] == (new[0], old[0], ctx.snapshot.vehicle.heading_rad)


def test_a_plan_from_the_boat_begins_where_she_is_by_the_time_that_it_is_on_board(monkeypatch):
    _, asked, _ = judged(monkeypatch, set_current=2, here=(50.0, 10.0))
    assert asked["ways"][1][0] == [(0.0, 0.0), *NEW.points_en_m[1:-1]]
    assert asked["ways"][1][1]["heading_rad"] == 0.3
    assert asked["ways"][1][1]["sailed_m"] == 0.0
    problem = SimpleNamespace(tracking=None, start_heading_rad=0.3)
    for change in ({"from_index": 1}, {"lead_in": ((1.0, 1.0),)}):
        plan = replace(pending_plan(problem=problem), **change)
        _, asked, ctx = judged(monkeypatch, set_current=2, here=(50.0, 10.0), plan=plan)
        assert asked["ways"][1][0][0] == (50.0, 10.0)
        assert asked["ways"][1][1]["heading_rad"] == ctx.snapshot.vehicle.heading_rad


@pytest.mark.parametrize(
    ("low", "is_way_open", "says"), [("low", True, "low"), ("low", False, "low"), ("", False, ""), ("", True, "less")]
)
def test_the_floor_comes_first_and_a_closed_way_promises_nothing(monkeypatch, low, is_way_open, says):
    assert judged(monkeypatch, low=low, is_way_open=is_way_open, less="less")[0] == says


def test_at_the_end_of_the_mission_there_is_nothing_to_compare_with(monkeypatch):
    says, asked, _ = judged(monkeypatch, less="less", mission={"route": OLD, "index": 3})
    assert says == ""
    assert len(asked["ways"]) == 1
    assert not asked["below"][0]


@pytest.mark.parametrize(
    "parts", [{"voyage": {"sailing": False}}, {"seen": {"vehicle_age_s": 9.0}}, {"seen": {"vehicle": None}}]
)
def test_before_she_sails_or_without_a_place_nothing_is_refused(monkeypatch, parts):
    says, asked, _ = judged(monkeypatch, low="low", **parts)
    assert (says, asked) == ("", {})


@pytest.mark.parametrize(
    ("rock_m", "floor_m", "irons", "has_loops"),
    [
        (30.0, 8.0, (), True),
        (8.5, 8.0, (), False),  # the hull is below the floor: a way of short legs is better than none
        (8.5, None, (), True),
        (30.0, 8.0, (NOW_S - 9.0, NOW_S - 5.0), False),
    ],
)
def test_short_legs_are_let_be_below_the_floor_and_where_tacks_fail(monkeypatch, rock_m, floor_m, irons, has_loops):
    tracking = None if floor_m is None else SimpleNamespace(floor_m=floor_m)
    plan = pending_plan(problem=SimpleNamespace(tracking=tracking, start_heading_rad=0.0))
    rock = box(-40.0, rock_m, 40.0, rock_m + 20.0)
    _, asked, ctx = judged(monkeypatch, plan=plan, obstacles=(rock,), steering={"irons_s": irons})
    assert asked["below"][1] == pytest.approx(rock_m - ctx.voyage.boat.hull.reach_m)
    assert [more["has_loops"] for _, more in asked["ways"]] == [has_loops] * 2


def test_a_way_on_board_that_is_not_sailed_is_no_measure_of_the_floor(monkeypatch):
    _, asked, ctx = judged(monkeypatch)
    assert asked["below"][0]
    monkeypatch.setattr(uploads, "_is_sailed", lambda _: False)
    _, asked, ctx = judged(monkeypatch)
    assert not asked["below"][0]
    assert ctx.state.voyage.sailing

"""Whose the boat and the mission on her are, case by case: what is concluded, what is asked for, what is left alone."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from companion.mavlink.vehicle_identity import Identity
from companion.mavlink.wire import mission_hash
from companion.messages import Command, MissionItem, Mode, Severity, waypoint
from companion.skipper.board.mark import MARKS, are_marked, is_remnant, marked
from companion.skipper.board.on_board import mission_is_known
from companion.skipper.board.vehicle_identity import judge, stand_by
from companion.skipper.step import CancelPlan, ReadMission, StopOrders
from companion.skipper.step.actions import Announce
from companion.skipper.step.config import ALL_PERMITTED
from companion.skipper.step.missions import HELD_BACK, NO_PLAN, is_same_mission, stopgap
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import MissionOnBoard
from companion.skipper.step.state import Inside, PendingUpload, Phase, Retry
from companion.skipper.way.gates import Approach
from tests.skipper.moments import NOW_S, asked_for, moment, route
from tests.skipper.world import FRAME

OURS = route((300.0, 0.0), (600.0, 0.0), (600.0, 600.0), (600.0, 600.0), gate_of=(-1, -1, 0, -1))
OTHER = route((-300.0, 0.0), (-600.0, 0.0), (-600.0, 90.0), (-600.0, 90.0), plan_id=8)
THEIRS = (MissionItem(command=16, lat_e7=511_010_000, lon_e7=-13_000_000), MissionItem(command=20))
MAY_REPLACE = replace(ALL_PERMITTED, may_replace_foreign=True)


def saved(**changes):
    told = {"voyage": "test", "gate": 1, "sailing": True, "route": OURS, "pending": None}
    return Persisted(**(told | changes))


def codes(ctx):
    return [action.code for action in ctx.actions if isinstance(action, Announce)]


def read(items, *, way=OURS, at_s=NOW_S, sailing=True, mission=None, **parts):
    """The step in which ``items`` were read, ``at_s``, by a boat that had not looked before."""
    told = {"route": way, "checked": False, "read_items": items, "read_t_s": at_s, "read_since_s": NOW_S - 5.0}
    voyage = parts.pop("voyage", {"sailing": sailing})
    return moment(way, mission=told | (mission or {}), voyage=voyage, **parts)


# ------------------------------------------------------------------------------------------ is there a reading?
def unread(**parts):
    return read(None, at_s=-math.inf, **parts)


def test_what_was_not_read_is_read_once_and_nothing_is_changed_before():
    ctx = unread()
    assert not mission_is_known(ctx)
    assert [type(a) for a in ctx.actions] == [ReadMission]
    assert ctx.state.pending.read == (ctx.actions[0].read_id, NOW_S)
    assert ctx.state.phase is Phase.STANDARD
    again = unread(pending={"read": (5, NOW_S - 1.0)})
    assert not mission_is_known(again)
    assert again.actions == []


def test_at_the_quay_she_waits_for_it():
    ctx = unread(sailing=False)
    assert not mission_is_known(ctx)
    assert ctx.state.phase is Phase.WAITING


@pytest.mark.parametrize(("not_before_s", "asks"), [(NOW_S, True), (NOW_S + 0.1, False)])
def test_a_reading_that_failed_has_its_patience(not_before_s, asks):
    ctx = unread(pending={"read_retry": Retry(failures=1, not_before_s=not_before_s)})
    assert not mission_is_known(ctx)
    assert bool(ctx.actions) is asks


@pytest.mark.parametrize(("age_s", "is_known"), [(4.9, True), (5.0, True), (5.1, False)])
def test_a_reading_counts_from_when_one_was_wanted(age_s, is_known):
    assert mission_is_known(read(OURS.items, at_s=NOW_S - age_s)) is is_known


@pytest.mark.parametrize(
    ("items", "read_s", "is_known"),
    [(OURS.items, NOW_S - 1.0, True), (OURS.items, NOW_S - 6.0, False), (None, NOW_S, False)],
)
def test_what_the_application_read_counts_too_where_it_is_newer(items, read_s, is_known):
    ctx = unread(seen={"mission": MissionOnBoard(items=items, read_t_s=read_s)})
    assert mission_is_known(ctx) is is_known
    older = read(OURS.items, seen={"mission": MissionOnBoard(items=THEIRS, read_t_s=NOW_S - 1.0)})
    assert mission_is_known(older)
    assert not older.state.mission.read_twice


def test_while_an_upload_of_ours_is_under_way_nothing_is_judged():
    upload = PendingUpload(upload_id=3, t_s=NOW_S, route=OURS, set_current=None, keep_first=0)
    assert mission_is_known(unread(pending={"upload": upload}))


@pytest.mark.parametrize(
    ("age_s", "sailing", "reading", "looks"),
    [
        (300.0, True, None, False),
        (300.1, True, None, True),
        (300.1, False, None, False),
        (300.1, True, (3, NOW_S - 1.0), False),
    ],
)
def test_under_way_it_is_looked_at_every_five_minutes(age_s, sailing, reading, looks):
    ctx = read(OURS.items, at_s=NOW_S - age_s, sailing=sailing, mission={"checked": True}, pending={"read": reading})
    assert mission_is_known(ctx)
    assert bool(ctx.actions) is looks


@pytest.mark.parametrize(
    ("items", "at_s", "way", "is_known"),
    [
        (THEIRS, NOW_S, OURS, False),  # read in this very step, and not what is sailed
        (THEIRS, NOW_S - 1.0, OURS, True),
        (OURS.items, NOW_S, OURS, True),
        (THEIRS, NOW_S, None, True),
        (None, NOW_S, OURS, True),
    ],
)
def test_a_look_now_and_then_that_finds_another_mission_is_judged(items, at_s, way, is_known):
    ctx = read(items, at_s=at_s, way=way, mission={"checked": True})
    assert mission_is_known(ctx) is is_known
    assert ctx.state.mission.checked is is_known


def test_a_reading_that_was_not_wanted_any_more_is_not_judged():
    ctx = read(THEIRS, mission={"checked": True, "read_since_s": NOW_S})
    assert mission_is_known(ctx)


# ---------------------------------------------------------------------------------------------------- whose is it?
@pytest.mark.parametrize(
    ("way", "unsure", "before", "found"),
    [
        (OURS, None, None, OURS),
        (OTHER, OURS, None, OURS),  # an upload that failed had come through
        (None, None, saved(), OURS),
        (None, None, saved(route=OTHER, pending=OURS), OURS),
        (None, None, saved(route=OTHER, unsure=OURS), OURS),
    ],
)
def test_each_list_of_ours_is_known_again(way, unsure, before, found):
    ctx = read(OURS.items, way=way, mission={"unsure_route": unsure, "adoptable": before, "read_twice": True})
    assert mission_is_known(ctx)
    mission = ctx.state.mission
    assert (mission.route, mission.unsure_route, mission.adoptable, mission.checked) == (found, None, None, True)
    assert (mission.read_t_s, mission.read_twice) == (NOW_S, False)
    assert codes(ctx) == ["adopted"] * (way is None)


@pytest.mark.parametrize(
    ("armed", "mode", "was_sailing", "sails"),
    [
        (True, Mode.AUTO, False, True),
        (True, Mode.MANUAL, True, True),  # somebody else has her: she was under way, and is armed
        (True, Mode.MANUAL, False, False),
        (False, Mode.AUTO, True, False),
    ],
)
def test_what_is_taken_up_with_a_mission_that_is_adopted(armed, mode, was_sailing, sails):
    before = saved(
        sailing=was_sailing,
        gate=2,
        quarters=3,
        approaches=(Approach(goal=1, en_m=(5.0, 6.0)),),
        inside=(1, 77.0),
        searched=((1.0, 2.0),),
        covered=((0, 0.5),),
        reached=(0,),
        own_mode=Mode.HOLD,
        motor=True,
    )
    ctx = read(OURS.items, way=None, sailing=False, mission={"adoptable": before, "index": 0})
    status = replace(ctx.snapshot.autopilot, is_armed=armed, mode=mode, mission_seq=3)
    ctx.snapshot = replace(ctx.snapshot, autopilot=status)
    assert mission_is_known(ctx)
    state = ctx.state
    assert (state.mission.index, state.mission.own_index) == (2, 2)
    assert state.voyage.sailing is sails
    assert (state.steering.own_mode, state.adrift.motor, state.operator.is_back) == (Mode.HOLD, True, True)
    progress = state.progress
    assert (progress.gate, progress.approaches, progress.is_blind) == (2, before.approaches, True)
    assert progress.bearing_rad == pytest.approx(1.5 * math.pi)
    assert progress.inside == Inside(goal=1, t_s=NOW_S, utc_s=77.0)
    assert (progress.searched, progress.covered) == (before.searched, before.covered)
    assert progress.reached == (0,)


def test_what_was_under_way_in_auto_needs_no_new_plan_at_once():
    ctx = read(OURS.items, way=None, sailing=False, mission={"adoptable": saved()})
    assert mission_is_known(ctx)
    assert not ctx.state.operator.is_back
    assert ctx.state.progress.inside is None
    none = read(OURS.items, way=None, sailing=False, mission={"adoptable": saved()})
    none.snapshot = replace(none.snapshot, autopilot=replace(none.snapshot.autopilot, mission_seq=None))
    assert mission_is_known(none)
    assert (none.state.mission.index, none.state.mission.own_index) == (0, 0)
    silent = read(OURS.items, way=None, sailing=False, mission={"adoptable": saved()}, seen={"heartbeat_age_s": 9.0})
    assert mission_is_known(silent)
    assert (silent.state.mission.index, silent.state.voyage.sailing) == (0, False)


def test_a_mission_that_is_adopted_while_one_sails_takes_nothing_up():
    ctx = read(OURS.items, mission={"adoptable": saved(gate=2)})
    assert mission_is_known(ctx)
    assert codes(ctx) == []
    assert ctx.state.progress.gate == 0


def test_a_list_behind_a_stopgap_is_ours_and_is_planned_on_from():
    gap = stopgap(OURS, 2, 0)
    items = (*OURS.items[:2], gap)
    ctx = read(items)
    assert mission_is_known(ctx)
    assert ctx.state.mission.route.rung == HELD_BACK
    assert is_same_mission(ctx.state.mission.route.items, items)
    assert ctx.state.mission.unsure_route is None
    assert codes(ctx) == ["held back"]
    after_kill = read(items, way=None, mission={"adoptable": saved()})
    assert mission_is_known(after_kill)
    assert codes(after_kill) == ["held back", "adopted"]


@pytest.mark.parametrize(("before", "gate"), [(None, 0), (saved(gate=2), 2)])
def test_an_autopilot_without_a_mission_is_nobody_s(before, gate):
    ctx = read((), mission={"unsure_route": OTHER, "adoptable": before})
    assert mission_is_known(ctx)
    assert (ctx.state.mission.route, ctx.state.mission.unsure_route) == (None, None)
    assert (ctx.state.progress.gate, ctx.state.progress.is_blind) == (gate, before is not None)


MIXED = (*OURS.items[:2], *OTHER.items[2:])


@pytest.mark.parametrize(
    ("way", "unsure", "before", "kept", "newest"),
    [
        (OURS, OTHER, None, OURS, OTHER),
        (None, None, saved(pending=OTHER), OTHER, OTHER),
        (None, None, saved(unsure=OTHER), OTHER, OTHER),
        (None, None, saved(route=OTHER, pending=OURS, unsure=OTHER), OURS, OURS),
    ],
)
def test_a_mixture_of_two_of_ours_is_put_right_with_the_newer(way, unsure, before, kept, newest):
    ctx = read(MIXED, way=way, sailing=False, mission={"unsure_route": unsure, "adoptable": before})
    assert mission_is_known(ctx)
    mission = ctx.state.mission
    assert (mission.route, mission.unsure_route, mission.repair) == (kept, newest, True)
    assert codes(ctx) == ["mixture"]
    assert ctx.state.voyage.sailing is (before is not None)  # armed in AUTO, as the moment is
    assert ctx.state.progress.gate == (0 if before is None else 1)


def test_a_mixture_at_the_quay_does_not_set_sail():
    ctx = read(MIXED, way=None, sailing=False, mission={"adoptable": saved(pending=OTHER)})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, is_armed=False))
    assert mission_is_known(ctx)
    assert not ctx.state.voyage.sailing


# ------------------------------------------------------------------------------------- ours, and not known which
@pytest.mark.parametrize("how", ["mark", "name"])
@pytest.mark.parametrize("under_way", [False, True])
def test_an_earlier_list_of_ours_is_sailed_on_by_or_replaced(how, under_way):
    items = marked(OTHER.items) if how == "mark" else OTHER.items
    ctx = read(items, way=None, sailing=False, mission={"known": (mission_hash(items),) if how == "name" else ()})
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, is_armed=under_way))
    assert mission_is_known(ctx)
    mission = ctx.state.mission
    if not under_way:
        assert (mission.route, mission.unsure_route, codes(ctx)) == (None, None, ["earlier mission"])
        return
    assert (mission.route.plan_id, mission.route.rung, mission.route.gate_of) == (NO_PLAN, HELD_BACK, (-1,) * 4)
    assert mission.route.items == marked(items)
    for found, point in zip(mission.route.points_en_m, OTHER.points_en_m, strict=True):
        assert found == pytest.approx(point, abs=0.02)
    assert mission.route.leg_from_en_m == (mission.route.points_en_m[0], *mission.route.points_en_m[:-1])
    assert codes(ctx) == ["adopted"]
    assert ctx.state.voyage.sailing


def test_a_list_that_goes_home_leads_to_where_home_is():
    items = marked((*OTHER.items[:2], MissionItem(command=Command.NAV_RETURN_TO_LAUNCH), *OTHER.items))
    ctx = read(items, way=None, sailing=False)
    home = ctx.voyage.frame.geo_from_en(-30.0, 12.0)
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, home=home))
    assert mission_is_known(ctx)
    assert len(ctx.state.mission.route.items) == 3  # what follows its end is an old tail
    assert ctx.state.mission.route.points_en_m[-1] == pytest.approx((-30.0, 12.0), abs=0.02)


def test_a_list_of_ours_that_a_person_sails_elsewhere_is_an_earlier_one():
    """Armed, and not in AUTO: nobody sails by it, whatever was saved."""
    ctx = read(marked(OTHER.items), way=None, sailing=False)
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=Mode.MANUAL))
    assert mission_is_known(ctx)
    assert codes(ctx) == ["earlier mission"]
    assert not ctx.state.voyage.sailing


def test_under_way_a_list_of_ours_that_we_did_not_put_there_is_somebody_s_order():
    ctx = read(marked(OTHER.items))
    assert not mission_is_known(ctx)
    assert ctx.state.mission.read_twice


# -------------------------------------------------------------------------------------------------- a stranger's
@pytest.mark.parametrize(("sailing", "phase"), [(True, Phase.STANDARD), (False, Phase.WAITING)])
def test_what_is_not_ours_is_read_twice(sailing, phase):
    before = saved()
    ctx = read(THEIRS, sailing=sailing, mission={"adoptable": before})
    assert not mission_is_known(ctx)
    mission = ctx.state.mission
    assert (mission.foreign, mission.checked, mission.read_twice, mission.adoptable) == ("", False, True, before)
    assert mission.read_since_s > NOW_S  # this very reading counts no more
    assert (ctx.state.phase, codes(ctx)) == (phase, [])


@pytest.mark.parametrize(
    ("sailing", "may", "phase"),
    [
        (True, ALL_PERMITTED, Phase.OPERATOR),
        (False, ALL_PERMITTED, Phase.WAITING),
        (True, MAY_REPLACE, Phase.OPERATOR),  # not what somebody brings while we sail
    ],
)
def test_read_twice_it_is_foreign(sailing, may, phase):
    ctx = read(THEIRS, sailing=sailing, permissions=may, mission={"read_twice": True, "unsure_route": OTHER})
    assert not mission_is_known(ctx)
    mission = ctx.state.mission
    assert mission.foreign == "the mission on the autopilot (2 items) is not ours"
    assert (mission.route, mission.unsure_route) == (None, None)
    assert mission.adoptable is not None  # as after a restart
    assert is_same_mission(mission.adoptable.route.items, OURS.items)
    assert (ctx.state.phase, codes(ctx)) == (phase, ["foreign mission", "drawn mission"])
    kept = read(THEIRS, mission={"read_twice": True, "adoptable": saved(gate=2)})
    mission_is_known(kept)
    assert kept.state.mission.adoptable == saved(gate=2)


@pytest.mark.parametrize(("may", "replaces"), [(MAY_REPLACE, False), (ALL_PERMITTED, True)])
def test_at_the_quay_it_is_replaced_where_that_is_permitted_or_ordered(may, replaces):
    mission = {"read_twice": True, "replace_foreign": replaces, "unsure_route": OTHER}
    ctx = read(THEIRS, sailing=False, permissions=may, mission=mission)
    assert mission_is_known(ctx)
    found = ctx.state.mission
    assert (found.route, found.unsure_route, found.foreign, found.replace_foreign) == (None, None, "", True)


FOREIGN = {"foreign": "theirs", "route": None, "checked": True, "adoptable": saved()}


@pytest.mark.parametrize(
    ("age_s", "reading", "not_before_s", "looks"),
    [
        (30.0, None, 0.0, False),
        (30.1, None, 0.0, True),
        (30.1, (3, NOW_S - 1.0), 0.0, False),
        (30.1, None, NOW_S, True),
        (30.1, None, NOW_S + 0.1, False),
    ],
)
def test_a_stranger_s_mission_is_looked_at_again_every_half_minute(age_s, reading, not_before_s, looks):
    pending = {"read": reading, "read_retry": Retry(not_before_s=not_before_s)}
    ctx = read(THEIRS, at_s=NOW_S - age_s, mission=FOREIGN, pending=pending)
    assert not mission_is_known(ctx)
    assert [type(a) for a in ctx.actions] == [ReadMission] * looks
    assert ctx.state.phase is Phase.OPERATOR
    assert ctx.state.why.startswith("theirs; ")
    assert mission_at_quay_phase(age_s) is Phase.WAITING


def mission_at_quay_phase(age_s):
    ctx = read(THEIRS, at_s=NOW_S - age_s, mission=FOREIGN, sailing=False)
    mission_is_known(ctx)
    return ctx.state.phase


def test_taken_away_by_the_stranger_the_voyage_is_taken_up():
    ctx = read(OURS.items, mission=FOREIGN)
    assert mission_is_known(ctx)
    assert (ctx.state.mission.foreign, ctx.state.phase) == ("", Phase.WAITING)
    assert is_same_mission(ctx.state.mission.route.items, OURS.items)
    still = read(THEIRS, mission=FOREIGN)
    assert not mission_is_known(still)
    assert still.state.mission.foreign
    assert codes(still) == []  # it was said


def test_a_permission_given_later_replaces_it():
    ctx = read(THEIRS, at_s=NOW_S - 1.0, mission=FOREIGN, sailing=False, permissions=MAY_REPLACE)
    assert mission_is_known(ctx)
    found = ctx.state.mission
    assert (found.foreign, found.route, found.adoptable, found.replace_foreign) == ("", None, None, True)


# ----------------------------------------------------------------------------------------------------- the mark
def test_marks_are_from_a_centimetre_to_41_metres_and_never_round():
    items = [waypoint(FRAME.geo_from_en(float(n), 7.0)) for n in range(3000)]
    found = {round(100.0 * item.alt_m) for item in marked(items)}
    assert min(found) >= 1
    assert max(found) <= MARKS + 7
    assert max(found) > 4000
    assert len(found) > 1800
    assert not any(cm % 50 == 0 for cm in found)


def test_an_item_without_a_place_bears_no_mark_and_needs_none():
    home = MissionItem(command=Command.NAV_RETURN_TO_LAUNCH)
    ours = marked((*OURS.items[:2], home))
    assert ours[-1] == home
    assert are_marked(ours)
    assert are_marked((*ours, *THEIRS))  # behind its end nothing is sailed
    assert not are_marked((ours[0], THEIRS[0], home))


def test_a_remnant_is_ours_in_part_and_else_of_what_was_drawn():
    ours, drawn = marked(OURS.items), (*THEIRS[:1], *OTHER.items)
    assert is_remnant((*ours[:2], *drawn[2:]), drawn)
    assert not is_remnant(drawn, drawn)
    assert not is_remnant((*ours[:2], waypoint(FRAME.geo_from_en(1.0, 1.0)), *drawn[3:]), drawn)
    assert is_remnant(ours, drawn)


# ---------------------------------------------------------------------------------------------- whose autopilot
IDENTITY = Identity(system=1, uid="5a", is_confirmed=True, vehicle_type=11, frame_class=2, sails=True)


def heard(*, sailing=True, uid="5a", is_ours=True, doubt="", sails=True, company=False, neighbours=(), **changes):
    return moment(
        OURS,
        seen={"identity": replace(IDENTITY, **changes), "has_company": company, "neighbours": neighbours},
        vehicle={"uid": uid, "system": None if uid is None else 1, "is_ours": is_ours, "doubt": doubt},
        voyage={"sailing": sailing},
        config={"sails": sails},
        mission={"route": OURS, "checked": True},
    )


WRONG = [
    ({"is_contested": True}, True, True, "two autopilots"),
    ({"vehicle_type": 2}, True, True, "not a rover"),
    ({"uid": "77"}, True, True, "another one"),
    ({"uid": None}, True, True, "UID none"),
    ({"neighbours": ("system 7",)}, True, False, "other autopilots"),
    ({"frame_class": 1}, True, False, "FRAME_CLASS is 1"),
    ({"sails": False}, True, False, "SAIL_ENABLE is 1"),  # of the mission, the boat has sails
]


@pytest.mark.parametrize(("change", "at_quay", "under_way", "words"), WRONG)
@pytest.mark.parametrize("sailing", [False, True])
def test_what_is_wrong_with_an_autopilot_at_the_quay_and_under_way(change, at_quay, under_way, words, sailing):
    identity = {k: v for k, v in change.items() if k not in {"neighbours", "sails"}}
    ctx = heard(sailing=sailing, **({k: v for k, v in change.items() if k in {"neighbours", "sails"}}))
    ctx.snapshot = replace(ctx.snapshot, identity=replace(ctx.snapshot.identity, **identity))
    judge(ctx)
    is_wrong = under_way if sailing else at_quay
    assert ctx.state.vehicle.is_ours is not is_wrong
    assert (words in ctx.state.vehicle.doubt) is is_wrong
    assert codes(ctx) == ["not ours"] * is_wrong
    if is_wrong:
        assert stand_by(ctx)
        assert ctx.state.phase is (Phase.OPERATOR if sailing else Phase.WAITING)
        assert words in ctx.state.why
    else:
        assert not stand_by(ctx)


@pytest.mark.parametrize(
    ("change", "sailing", "is_asked"),
    [
        ({"is_confirmed": False}, True, True),
        ({"is_confirmed": False}, False, True),
        ({"frame_class": None}, False, True),
        ({"frame_class": None}, True, False),
        ({"sails": None}, False, True),
        ({"sails": None}, True, False),
        ({"vehicle_type": None}, False, False),
    ],
)
def test_what_is_not_told_yet_is_waited_for(change, sailing, is_asked):
    ctx = heard(sailing=sailing)
    ctx.snapshot = replace(ctx.snapshot, identity=replace(IDENTITY, **change))
    judge(ctx)
    assert ctx.state.vehicle.is_ours is not is_asked
    assert codes(ctx) == []
    assert stand_by(ctx) is is_asked
    if is_asked:
        assert ctx.state.phase is (Phase.STANDARD if sailing else Phase.WAITING)
        assert "waiting" in ctx.state.why


def test_a_voyage_that_is_done_stays_done_whatever_is_heard():
    for change in ({"uid": "77"}, {"is_confirmed": False}):
        ctx = heard(is_ours=True)
        ctx.snapshot = replace(ctx.snapshot, identity=replace(IDENTITY, **change))
        ctx.phase(Phase.DONE, "done")
        judge(ctx)
        assert stand_by(ctx)
        assert ctx.state.phase is Phase.DONE


def test_a_mission_for_a_motor_boat_wants_one():
    motor = heard(sailing=False, sails=False)
    judge(motor)
    assert 'frame = "sailboat"' in motor.state.vehicle.doubt
    sail = heard(sailing=False)
    sail.snapshot = replace(sail.snapshot, identity=replace(IDENTITY, sails=False))
    judge(sail)
    assert 'frame = "motor"' in sail.state.vehicle.doubt


def test_the_first_autopilot_is_the_voyage_s():
    ctx = heard(uid=None, is_ours=False)
    judge(ctx)
    assert (ctx.state.vehicle.uid, ctx.state.vehicle.system, ctx.state.vehicle.is_ours) == ("5a", 1, True)
    assert codes(ctx) == []
    assert ctx.state.mission.checked


def test_known_again_the_mission_is_read_anew():
    ctx = heard(is_ours=False, doubt="another")
    judge(ctx)
    assert (ctx.state.vehicle.doubt, ctx.state.vehicle.is_ours) == ("", True)
    assert (ctx.state.mission.checked, ctx.state.mission.read_since_s) == (False, NOW_S)
    assert codes(ctx) == ["ours"]


@pytest.mark.parametrize("was_ours", [True, False])
@pytest.mark.parametrize("plans", [True, False])
def test_when_it_may_not_be_ours_all_orders_are_stopped_once(was_ours, plans):
    ctx = heard(is_ours=was_ours, doubt="so it was")
    plan = asked_for(OURS)
    ctx.set(pending=replace(ctx.state.pending, plan=plan if plans else None))
    ctx.set(steering=replace(ctx.state.steering, until_s=NOW_S + 5.0))
    ctx.snapshot = replace(ctx.snapshot, identity=replace(IDENTITY, is_confirmed=False))
    judge(ctx)
    kinds = [type(a) for a in ctx.actions]
    assert kinds == ([StopOrders] + [CancelPlan] * plans if was_ours else [])
    assert (ctx.state.pending.plan is None) is (was_ours or not plans)
    assert (ctx.state.steering.until_s is None) is was_ours
    assert (ctx.state.vehicle.is_ours, ctx.state.vehicle.doubt) == (False, "so it was")


def test_a_second_companion_is_told_of_and_changes_nothing():
    ctx = heard(company=True)
    judge(ctx)
    assert codes(ctx) == ["second companion"]
    assert ctx.actions[0].severity is Severity.ERROR
    assert ctx.state.vehicle.is_ours
    judge(ctx)
    assert codes(ctx) == ["second companion"]  # once a minute
    ctx.snapshot = replace(ctx.snapshot, t_s=NOW_S + 59.0)
    judge(ctx)
    assert len(codes(ctx)) == 1
    ctx.snapshot = replace(ctx.snapshot, t_s=NOW_S + 61.0)
    judge(ctx)
    assert len(codes(ctx)) == 2

"""What the watch says of a boat that was stopped, of the current and of vessels met by the rules; tacks followed."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import SimpleNamespace

import pytest
from shapely.geometry import box

from companion.current import TideRow, TideTable, WaterCurrent
from companion.messages import Mode, Severity
from companion.skipper import Skipper
from companion.skipper.step import StepContext
from companion.skipper.step.actions import Announce
from companion.skipper.step.config import ALL_PERMITTED, SkipperConfig
from companion.skipper.step.state import Stop, Tacking
from companion.skipper.watch import watch as watching
from companion.skipper.watch.tacks import TACK_FAILED, watch_tacks
from companion.skipper.watch.watch import speak_of_stop, watch_water
from companion.skipper.way.drying import DryingWater
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.world import World, voyage

WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))
WALL = box(100.0, -500.0, 120.0, 500.0)  # 100 m to the east
LEE = box(40.0, -500.0, 60.0, 500.0)


def spoken(ctx):
    return [a for a in ctx.actions if isinstance(a, Announce)]


# ------------------------------------------------------------------------------------------------ a boat stopped
def stopped(mode=Mode.HOLD, *, cause="battery", age_s=40.0, armed=True, answering=False, drift_mps=0.5, **parts):
    stop = Stop(t_s=NOW_S - age_s, before_s=NOW_S - age_s - 1.0, mode=mode, is_armed=armed, cause=cause)
    status = parts.pop("status", {})
    ctx = moment(
        WAY,
        speed_mps=drift_mps,
        operator={"stop": stop, "answering": cause if answering else ""},
        steering={"own_mode": mode if answering else None},
        **parts,
    )
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, mode=mode, is_armed=armed, **status))
    return ctx


@pytest.mark.parametrize(
    ("change", "severity"),
    [
        ({}, Severity.CRITICAL),
        ({"age_s": 5.0}, None),  # its sign may come yet
        ({"age_s": 5.1}, Severity.CRITICAL),
        ({"answering": True, "age_s": 30.0}, None),  # an answer is on its way
        ({"answering": True, "age_s": 30.1}, Severity.WARNING),
        ({"answering": True, "age_s": 30.1, "obstacles": (WALL,)}, Severity.CRITICAL),
        ({"announced": {"codes": (("adrift", NOW_S - 59.9),)}}, None),
        ({"announced": {"codes": (("adrift", NOW_S - 60.1),)}}, Severity.CRITICAL),
        ({"seen": {"heartbeat_age_s": 9.0}}, None),
        ({"cause": "a person"}, None),  # who has stopped her knows it
        ({"cause": "a person", "obstacles": (WALL,)}, Severity.CRITICAL),
        ({"cause": "a person", "obstacles": (LEE,), "drift_mps": 0.16}, Severity.CRITICAL),
        ({"cause": "a person", "obstacles": (box(20, -500, 60, 500),), "drift_mps": 0.14}, None),  # noise
        ({"cause": "a person", "obstacles": (WALL,), "drift_mps": 3.0}, Severity.CRITICAL),
        ({"cause": "a person", "obstacles": (WALL,), "drift_mps": 3.1}, None),  # she is towed
    ],
)
def test_of_a_stop_is_spoken_each_minute_and_of_a_person_s_only_when_she_drifts_onto_something(change, severity):
    ctx = stopped(**change)
    speak_of_stop(ctx)
    assert [(a.code, a.severity) for a in spoken(ctx)] == ([] if severity is None else [("adrift", severity)])
    nothing = moment(WAY)
    speak_of_stop(nothing)
    assert spoken(nothing) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, ["HOLD by the battery failsafe: drifting 0.5 m/s", " at 51.1", "press AUTO to sail on, MANUAL"]),
        ({"armed": False}, ["disarmed by the battery failsafe", "arm her and press AUTO"]),
        ({"cause": "a person", "obstacles": (WALL,)}, ["HOLD by a person", "onto", "press AUTO to sail on, or take"]),
        ({"drift_mps": 0.14}, ["staying there"]),
        ({"drift_mps": 0.16}, ["drifting"]),
        ({"mode": None}, ["an unknown mode by the battery failsafe"]),
        ({"seen": {"vehicle": None}}, ["her position is not known"]),
        ({"permissions": replace(ALL_PERMITTED, may_set_mode=False)}, ["[operator] set_auto would let"]),
        ({"mode": Mode.LOITER}, ["staying there"]),
        ({"answering": True}, ["just started"]),
    ],
)
def test_what_is_said_of_a_stop(change, words):
    ctx = stopped(**change)
    speak_of_stop(ctx)
    (said,) = spoken(ctx)
    for word in words:
        assert word in said.text
    assert ("set_auto" in said.text) is ("permissions" in change)


@pytest.mark.parametrize(
    ("far_m", "course_deg", "obstacles", "words"),
    [
        (900.0, 90.0, (WALL,), "sailing straight home, 090°, onto o0 in 50 s"),
        (900.0, 90.0, (box(100.0, 4.0, 120.0, 500.0),), "past o0 in"),
        (900.0, 90.0, (), "sailing straight home, 090° at"),
        (80.0, 90.0, (WALL,), "sailing straight home, 090° at"),  # home is before it
        (900.0, 0.0, (WALL,), "sailing straight home, 000° at"),
        (19.0, 90.0, (LEE,), "staying there"),  # there it loiters
        (21.0, 90.0, (box(25.0, -500.0, 60.0, 500.0),), "sailing straight home, 090°, past o0"),
        (None, 90.0, (WALL,), "staying there"),
        (900.0, None, (WALL,), "sailing straight home"),
    ],
)
def test_in_rtl_the_straight_way_home_is_looked_at(far_m, course_deg, obstacles, words):
    bearing = None if course_deg is None else math.radians(course_deg)
    status = {"waypoint_distance_m": far_m, "target_bearing_rad": bearing}
    ctx = stopped(Mode.RTL, drift_mps=2.0, obstacles=obstacles, status=status)
    speak_of_stop(ctx)
    (said,) = spoken(ctx)
    assert words in said.text


# -------------------------------------------------------------------------------------------------- the current
def water(east_mps, *, told=None, significant=True, verdict="", sailing=True, said=()):
    current = WaterCurrent(east_mps=east_mps, is_significant=significant, verdict=verdict)
    announced = {"water_en_mps": told, "codes": said}
    ctx = moment(WAY, seen={"current": current}, announced=announced, voyage={"sailing": sailing})
    watch_water(ctx)
    return ctx


@pytest.mark.parametrize(
    ("east_mps", "told", "is_said"),
    [
        (0.5, None, True),
        (0.5, (0.26, 0.0), False),
        (0.5, (0.25, 0.0), True),  # changed by a quarter of a metre a second
        (0.5, (0.5, 0.24), False),
    ],
)
def test_a_current_is_said_when_plans_begin_to_reckon_with_it_and_when_it_is_another(east_mps, told, is_said):
    ctx = water(east_mps, told=told)
    assert [a.code for a in spoken(ctx)] == ["current"] * is_said
    assert ctx.state.announced.water_en_mps == ((east_mps, 0.0) if is_said else told)
    assert spoken(water(east_mps, told=told, sailing=False)) == []


@pytest.mark.parametrize(("told", "is_said"), [((0.5, 0.0), True), (None, False)])
def test_a_current_that_is_told_no_more_is_taken_back_once(told, is_said):
    ctx = water(0.0, told=told, significant=False)
    assert [a.code for a in spoken(ctx)] == ["current"] * is_said
    assert ctx.state.announced.water_en_mps is None


@pytest.mark.parametrize(("ago_s", "is_said"), [(1799.0, False), (1801.0, True)])
def test_a_tide_table_that_ends_is_said_every_half_hour(ago_s, is_said):
    ctx = water(0.0, significant=False, verdict="ended", said=(("tide table", NOW_S - ago_s),))
    assert [a.code for a in spoken(ctx)] == ["tide table"] * is_said
    assert spoken(water(0.0, significant=False)) == []


def test_heights_that_do_not_hold_now_are_said_where_water_dries_by_them():
    rows = (TideRow(utc_s=900.0, height_m=2.0), TideRow(utc_s=20_000.0, height_m=0.4))
    bar = DryingWater(name="the bar", polygon=LEE, margin_m=0.0, opens_at_m=1.0)

    def said(utc_s, drying=(bar,)):
        ctx = moment(WAY)
        status = replace(ctx.snapshot.autopilot, t_s=NOW_S, utc_at_boot_s=utc_s, boot_s=0.0)
        ctx = StepContext(
            replace(ctx.voyage, drying=drying),
            replace(ctx.config, tide=TideTable(rows=rows, name="week.csv")),
            ctx.state,
            replace(ctx.snapshot, autopilot=status),
        )
        watch_water(ctx)
        return [a.code for a in spoken(ctx)]

    assert said(800.0) == ["tide heights"]
    assert said(1000.0) == said(800.0, drying=()) == []


# -------------------------------------------------------------------------------------------- met by the rules
def held(mmsi=7, *, evident=False, stands_on=False, role="give way", label="Nellie"):
    return SimpleNamespace(
        mmsi=mmsi,
        branch=0,
        evident=evident,
        stands_on=stands_on,
        label=label,
        encounter=SimpleNamespace(role=SimpleNamespace(value=role)),
        sentence=lambda approach: f"{label}: {role}",
    )


def meet(monkeypatch, now, *, before=(), told=()):
    @dataclass(frozen=True)
    class Seen:
        vessel: object
        approach: object = None
        encounter: object = None

    ctx = moment(WAY, traffic={"encounters": tuple(before)}, announced={"encounters": tuple(told)})
    monkeypatch.setattr(watching, "follow", lambda *_, **__: tuple(now))
    found = [Seen(vessel=SimpleNamespace(mmsi=m, branch=0)) for m in (7, 8)]
    out = watching._meet(ctx, None, found)
    assert ctx.state.traffic.encounters == tuple(now)
    for one in out:
        match = [h.encounter for h in now if h.mmsi == one.vessel.mmsi]
        assert one.encounter is (match[0] if match else None)
    return ctx


@pytest.mark.parametrize(
    ("now", "told", "severity"),
    [
        (held(), (), Severity.NOTICE),
        (held(stands_on=True), (), Severity.WARNING),
        (held(evident=True, stands_on=True), (), Severity.CRITICAL),
        (held(), ((7, 0, "give way", NOW_S - 99.0),), None),  # nothing new
        (held(), ((7, 0, "stand on", NOW_S - 29.9),), None),  # a line in half a minute
        (held(), ((7, 0, "stand on", NOW_S - 30.0),), Severity.NOTICE),
        (held(evident=True), ((7, 0, "stand on", NOW_S - 1.0),), Severity.CRITICAL),  # but for this
        (held(evident=True), ((7, 0, "evident", NOW_S - 99.0),), None),
        (held(), ((8, 0, "give way", NOW_S),), Severity.NOTICE),
    ],
)
def test_an_encounter_is_said_when_it_begins_and_when_what_we_do_changes(monkeypatch, now, told, severity):
    ctx = meet(monkeypatch, [now], told=told)
    assert [a.severity for a in spoken(ctx)] == ([] if severity is None else [severity])
    remembered = {t[0]: t for t in ctx.state.announced.encounters}
    if severity is not None:
        assert remembered[7] == (7, 0, "evident" if now.evident else "give way", NOW_S)
    assert set(remembered) == {7} | {t[0] for t in told}


def test_an_encounter_that_is_over_is_said_and_forgotten(monkeypatch):
    ctx = meet(monkeypatch, [], before=[held()], told=((7, 0, "give way", NOW_S - 60.0),))
    (said,) = spoken(ctx)
    assert (said.code, said.text) == ("encounter", "Nellie: past and clear")
    assert ctx.state.announced.encounters == ()
    still = meet(monkeypatch, [held()], before=[held()], told=((7, 0, "give way", NOW_S - 60.0),))
    assert spoken(still) == []


# -------------------------------------------------------------------------------------------------------- tacks
ON_PORT = Tacking(side=-1, settled_rad=math.radians(45.0), settled_s=NOW_S - 1.0, settled_mps=2.0)


def turning(heading_deg, tacking=ON_PORT, *, tack_fails=0.2, obstacles=(), status=None, **parts):
    ctx = moment(WAY, heading_deg=heading_deg, obstacles=obstacles, tacking=tacking, **parts)
    ctx.voyage = replace(ctx.voyage, boat=replace(ctx.voyage.boat, tack_fails=tack_fails))
    if status:
        ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, **status))
    watch_tacks(ctx)
    return ctx


def test_a_tack_that_is_tried_begins_here():
    ctx = turning(10.0, at=(3.0, 4.0))
    assert (ctx.state.tacking.began_s, ctx.state.tacking.began_en_m) == (NOW_S, (3.0, 4.0))


@pytest.mark.parametrize(
    "change",
    [
        {"tws_mps": 1.4},
        {"voyage": {"sailing": False}},
        {"status": {"is_armed": False}},
        {"status": {"mode": Mode.LOITER}},
        {"seen": {"heartbeat_age_s": 9.0}},
        {"config": {"sails": False}},
    ],
)
@pytest.mark.parametrize("begun", [True, False])
def test_who_does_not_sail_tries_no_tack(change, begun):
    before = replace(ON_PORT, began_s=NOW_S - 2.0, is_counted=True) if begun else ON_PORT
    ctx = turning(10.0, before, **change)
    assert (ctx.state.tacking.side, ctx.state.tacking.began_s, ctx.state.tacking.is_counted) == (0, None, False)
    nothing = Tacking()
    assert turning(10.0, nothing, **change).state.tacking is nothing


def failing(**change):
    """Settled back on her old tack after six seconds in irons."""
    before = replace(
        ON_PORT, began_s=NOW_S - 6.0, began_en_m=(0.0, 0.0), slowest_mps=1.5, in_a_row=change.pop("row", 0)
    )
    return turning(45.0, before, **change)


@pytest.mark.parametrize(
    ("change", "asks"),
    [
        ({}, False),
        ({"obstacles": (box(59.0, -50.0, 90.0, 50.0),)}, True),  # something is near
        ({"obstacles": (box(61.0, -50.0, 90.0, 50.0),)}, False),
        ({"row": 1}, True),  # she has tried often enough
        ({"row": 1, "tack_fails": 0.0}, False),
        ({"obstacles": (box(59.0, -50.0, 90.0, 50.0),), "tack_fails": 0.0}, False),
    ],
)
def test_a_tack_that_failed_is_said_and_planned_about_where_there_is_little_room(change, asks):
    ctx = failing(**change)
    assert (ctx.state.tacking.tried, ctx.state.tacking.failed) == (1, 1)
    assert ctx.state.tacking.irons_s == 6.0
    assert ctx.state.plans.asked == (TACK_FAILED if asks else "")
    (said,) = spoken(ctx)
    assert said.code == "tack failed"
    assert ("give or take" in said.text) is (change.get("tack_fails", 0.2) > 0.0)


def test_a_tack_that_comes_off_is_counted_and_not_said():
    before = replace(ON_PORT, began_s=NOW_S - 4.0, slowest_mps=1.5)
    ctx = turning(-45.0, before)
    assert (ctx.state.tacking.tried, ctx.state.tacking.failed, ctx.state.tacking.irons_s) == (1, 0, 0.0)
    assert spoken(ctx) == []


def test_the_end_of_irons_that_were_counted_is_looked_at_too():
    before = replace(ON_PORT, began_s=NOW_S - 20.0, began_en_m=(0.0, 0.0), is_counted=True, failed=1, tried=1)
    ctx = turning(-45.0, before)
    assert (ctx.state.tacking.tried, ctx.state.tacking.irons_s) == (1, 20.0)
    assert spoken(ctx) == []


def test_the_dark_is_said_in_a_sentence():
    """ "dark (-31.8 deg from the limit)" was all."""
    midnight_s = datetime(2026, 11, 24, 0, 0, tzinfo=UTC).timestamp()
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()), shown={"utc_at_boot_s": midnight_s})
    assert world.run(300, lambda w: any(a.code == "dark" for _, a in w.actions if isinstance(a, Announce)))
    text = next(a.text for _, a in world.actions if isinstance(a, Announce) and a.code == "dark")
    assert re.fullmatch(r"it is dark: the sun is \d+ degrees lower than where dark begins \(dark_below_deg\)", text)

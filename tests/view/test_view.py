"""The view of a voyage: whole, true to its step, the same from the records, null where nothing is known."""

import datetime as dt
import json
import math
import re
from dataclasses import replace
from itertools import islice

import jsonschema
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.pages import schema
from companion.compose import config_of, voyage_of
from companion.current import STILL_WATER, WindAngleUncertainty, over_water
from companion.eta import UNKNOWN
from companion.fold import Step
from companion.geo.angles import difference_rad
from companion.geo.frame import LocalFrame
from companion.geofence import load_mission
from companion.messages import AutopilotStatus, CompanionStatus, GeoPoint, VehicleState, WindForecast
from companion.page.sources import LiveSource
from companion.planner import Problem, plan
from companion.planner.explain import with_clearance
from companion.skipper.step import PlanOutcome, SkipperConfig, SkipperState, Snapshot, WindEstimate, WindHealth
from companion.skipper.step.actions import RequestPlan
from companion.skipper.way import Refuge
from companion.telemetry.folder import TLOG, TRACK, VoyageFigures, read_rows
from companion.telemetry.folder.logbook import chart_record
from companion.telemetry.folder.reading import RecordedChart
from companion.telemetry.status import companion_status
from companion.view import Past, ViewFold, recorded_views, sample_of, values
from companion.view.area import area_of
from companion.view.events import _plan, nearest_of
from companion.view.parts import (
    SAME_M,
    Chosen,
    _bound_s,
    _risk_left,
    apparent,
    laylines_of,
    no_go_of,
    plan_of,
    polar_of,
    refuges_of,
)
from companion.view.values import degrees, rounded
from sitl.scenario.scenario import EventSpec
from tests.skipper.world import with_parts
from tests.view.conftest import sail, write_mission

RULES = {
    name: jsonschema.Draft202012Validator({**schema(), "$ref": f"#/$defs/{name}"})
    for name in ("View", "Event", "Area", "Past")
}


def valid(of, name="View"):
    RULES[name].validate(json.loads(msgspec.json.encode(of)))


def test_every_view_event_and_area_of_a_voyage_is_what_the_schema_says(beat):
    assert len(beat.views) > 100
    for view, events in beat.moments:
        valid(view)
        for event in events:
            valid(event, "Event")
    valid(beat.area, "Area")
    valid(Past.of([sample_of(view) for view in beat.views], 0.0), "Past")


@pytest.mark.parametrize(("risks", "told"), [((0.2, 0.1), 0.3), ((0.7, 0.6), 1.0), ((0.2, None), 0.05), ((), 0.05)])
def test_the_chance_of_being_forced_off_the_plan_is_what_its_legs_add_up_to(beat, risks, told):
    """It said 0 % in all beside a leg of 20 %: it was of another part of the way than the legs beside it."""
    route = next(step.state.mission.route for step in beat.steps if step.state.mission.route is not None)
    legs = tuple(values.LegView(from_en_m=(0.0, 0.0), to_en_m=(9.0, 0.0), risk=risk) for risk in risks)
    loiter = values.LegView(from_en_m=(0.0, 0.0), to_en_m=(0.0, 0.0), is_loiter=True)
    assert _risk_left(replace(route, risk=0.05), (*legs, loiter)) == pytest.approx(told)
    for view in beat.under_way:
        known = [leg.risk for leg in view.plan.legs if leg.risk is not None]
        assert view.plan.path_risk is None or view.plan.path_risk >= max(known, default=0.0) - 1e-9


def test_the_bound_of_a_plan_is_not_told_of_what_is_left_of_it(beat):
    """A plan that was kept was told to take 2:17, "no less than 3:07": the bound was of the whole way."""
    view, step = next(
        (view, step)
        for view, step in zip(beat.views, beat.steps, strict=True)
        if view.plan is not None and view.plan.bound_s
    )
    route = step.state.mission.route
    made = (o.plan for s in beat.steps for o in s.snapshot.outcomes if isinstance(o, PlanOutcome) and o.plan.has_path)
    plan = next(islice(made, route.plan_id - 1, None))
    chosen = Chosen(t_s=0.0, reason="start", plan=plan)
    assert _bound_s(replace(route, cost_s=plan.cost_s), chosen) == pytest.approx(plan.lower_bound_s, abs=0.06)
    assert _bound_s(replace(route, cost_s=plan.cost_s - 20.0), chosen) is None
    for view in beat.under_way:
        assert view.plan.bound_s is None or view.plan.cost_s >= view.plan.bound_s - 0.1


def test_of_a_way_that_she_is_led_aside_nothing_of_a_plan_is_told(beat):
    """ "plan 1, judged 44 s ago" stood beside a loiter that was ordered, and that plan's sentence beside other legs."""
    step = next(step for step in beat.steps if step.state.mission.route is not None and step.sailed is not None)
    route = step.state.mission.route
    made = next(
        o.plan for s in beat.steps for o in s.snapshot.outcomes if isinstance(o, PlanOutcome) and o.plan.has_path
    )
    chosen = Chosen(t_s=0.0, reason="start", plan=made, why="Leg 1 passes the rock.")
    aside = route.led_aside(
        0, (0.0, 0.0), [(route.items[-1], (5.0, 5.0))], rung="hold", why="ordered; loitering in open water"
    )
    mission = replace(step.state.mission, route=aside, index=0)
    held = replace(step, state=replace(step.state, mission=mission))
    plan, sailed = (plan_of(s, s.voyage, UNKNOWN, chosen, ()) for s in (held, step))
    assert (plan.number, plan.age_s, plan.twd_from_deg, plan.reason) == (None, None, None, "")
    assert plan.why == "ordered; loitering in open water"
    assert sailed.number == route.plan_id
    assert "Leg 1 passes the rock." in sailed.why


def test_plans_are_numbered_as_they_are_made_and_their_legs_as_the_mission_on_board_has_them(beat):
    """The first of a voyage was "plan 2", then came 6 and 7, of 3 plans; and "course 1" was leg 4 of the table."""
    titles = [
        e.title for _, events in beat.moments for e in events if e.kind == "plan" and not e.title.startswith("no")
    ]
    assert [int(re.match(r"plan (\d+): ", title)[1]) for title in titles] == list(range(1, len(titles) + 1))
    last = beat.under_way[-1]
    assert last.figures.plans == len(titles) > 0
    assert {v.plan.number for v in beat.under_way} <= {None, *range(1, len(titles) + 1)}
    told = 0
    for view in beat.under_way:
        tacked = re.match(r"As it was made: .*A tack leads into legs? ([^.]*)[.]", view.plan.why)
        for number in [] if tacked is None else re.findall(r"\d+", tacked[1]):
            place = int(number) - 1 - (view.plan.count - len(view.plan.legs))
            if place >= 0:
                told += 1
                assert view.plan.legs[place].manoeuvre == "tack"
    assert told


def test_legs_are_those_of_plans_that_are_on_board(beat):
    """A plan that had been found and was on its way lent its legs to the one that was sailed."""
    made, lent = {}, 0
    for step, view in zip(beat.steps, beat.views, strict=True):
        for outcome in step.snapshot.outcomes:
            if isinstance(outcome, PlanOutcome) and outcome.plan is not None and outcome.plan.has_path:
                made[step.state.plans.made] = outcome.plan
        if view.plan is None or view.plan.number is None:
            continue
        for shown in (leg for leg in view.plan.legs if leg.risk is not None):
            same = {
                number: (degrees(leg.sigma_rad), rounded(leg.clearance_m))
                for number, plan in made.items()
                for leg in plan.legs
                if math.dist(leg.to_en, shown.to_en_m) < SAME_M
            }
            newest = max(number for number in same if number <= view.plan.number)
            assert (shown.sigma_deg, shown.clearance_m) == same[newest]
            lent += any(told != same[newest] for number, told in same.items() if number > view.plan.number)
    assert lent


def test_what_the_boat_makes_of_her_polar_is_of_the_water(beat):
    """In a current of a quarter of her speed her share of the polar was told of her way over the ground."""
    step = next(s for s in beat.steps if s.snapshot.vehicle is not None and s.snapshot.vehicle.speed_mps > 1.5)
    voyage, config = step.voyage, SkipperConfig()
    still = polar_of(step, voyage, config)
    current = (0.4, -0.3)
    vehicle, wind = step.snapshot.vehicle, step.snapshot.wind
    carried = replace(
        vehicle, velocity_en_mps=tuple(v + c for v, c in zip(vehicle.velocity_en_mps, current, strict=True))
    )
    twd_rad, tws_mps = over_water(wind.present_twd_from_rad, wind.mean_tws_mps, current)
    water = replace(STILL_WATER, east_mps=current[0], north_mps=current[1], is_significant=True)
    moving = polar_of(replace(step, snapshot=replace(step.snapshot, vehicle=carried, current=water)), voyage, config)
    assert moving.live_mps == pytest.approx(still.live_mps, abs=0.011)
    assert moving.tws_mps == pytest.approx(tws_mps, abs=0.01)
    assert math.radians(moving.live_twa_deg) == pytest.approx(difference_rad(twd_rad, vehicle.heading_rad), abs=0.01)


def test_where_she_was_on_her_polar_is_of_the_water_as_where_she_is():
    """Her past dots were of her way over the ground beside a point, and a polar, of the water."""
    polar = values.PolarView(name="", tws_mps=5.0, live_twa_deg=-75.0, live_mps=1.5, twa_deg=(), speed_mps=())
    view = values.View(
        source="live",
        name="",
        t_s=1.0,
        state=values.StateView(phase="sailing"),
        polar=polar,
        boat=values.BoatView(sog_mps=2.0, heading_deg=10.0),
    )
    kept = Past.of([sample_of(view), sample_of(replace(view, polar=None))], None)
    assert kept.polar_mps == (1.5, None)
    assert kept.polar_twa_deg == (-75.0, None)


def test_close_to_the_wind_no_share_of_the_polar_is_told():
    polar = values.PolarView(
        name="",
        tws_mps=5.0,
        live_twa_deg=-75.0,
        live_mps=1.5,
        twa_deg=(60.0, 90.0),
        speed_mps=(1.0, 3.0),
        beat_deg=45.0,
    )
    assert polar.live_share() == pytest.approx(0.75)
    assert replace(polar, beat_deg=84.0).live_share() is None
    assert replace(polar, live_mps=None).live_share() is None


def test_a_tack_that_the_autopilot_makes_by_itself_is_told_as_such(beat):
    told = {
        (bool(leg.is_beat), view.plan.next_tack_is_planned)
        for view in beat.under_way
        for leg in view.plan.legs[:1]
        if view.plan.next_tack_s is not None and leg.is_beat is not None
    }
    assert (True, False) in told
    for view in beat.under_way:
        assert (view.plan.next_tack_s is None) == (view.plan.next_tack_is_planned is None)


def test_the_schema_refuses_what_is_no_view(beat):
    for wrong in ({"source": "guess"}, {"wind": 5.0}, {"surprise": 1}):
        raw = json.loads(msgspec.json.encode(beat.views[-1])) | wrong
        with pytest.raises(jsonschema.ValidationError):
            RULES["View"].validate(raw)


def test_under_way_everything_is_there_and_agrees_with_the_step(beat):
    for view, step in zip(beat.views, beat.steps, strict=True):
        assert view.state.phase == step.state.phase.value
        assert view.state.why == step.state.why
        if step.snapshot.position_en_m is not None:
            assert view.boat.at_en_m == pytest.approx(step.snapshot.position_en_m, abs=0.06)
    seen = beat.under_way[len(beat.under_way) // 2]
    for part in (seen.wind, seen.no_go, seen.polar, seen.plan, seen.safe_end, seen.home):
        assert part is not None
    assert seen.predicted
    assert seen.plan.legs
    assert seen.area == beat.area.hash
    assert [g.name for g in seen.goals if g.is_next] == ["mark"]
    assert [r.name for r in seen.refuges] == ["Bay"]
    assert {part.name for part in seen.health} >= {"autopilot", "position", "wind", "planner", "records"}
    assert any(leg.risk is not None for view in beat.under_way for leg in view.plan.legs)
    assert any(view.laylines is not None and view.laylines.is_beat for view in beat.under_way)
    assert {v.boat.tack for v in beat.under_way} == {"port", "starboard"}


def test_the_laylines_are_of_the_place_that_she_is_bound_for(beat):
    """Under the order home they stayed at the mission's goal."""
    both = zip(beat.steps, beat.views, strict=True)
    step = next(s for s, view in both if view.laylines is not None and s.state.mission.route is not None)
    route = step.state.mission.route
    away = replace(route, bound_for="Bay", points_en_m=(*route.points_en_m[:-1], (0.0, 400.0)))
    led = replace(step, state=with_parts(step.state, mission={"route": away}))
    found = {}
    for name, one in {"mark": step, "Bay": led}.items():
        status = companion_status(one, one.voyage, VoyageFigures(), None, None)
        found[name] = ViewFold(one.voyage, SkipperConfig()).take(one, status, VoyageFigures())[0].laylines
    assert {name: lines.name for name, lines in found.items()} == {"mark": "mark", "Bay": "Bay"}


def test_the_order_that_stands_is_seen_and_logged(beat):
    held = [view for view in beat.views if view.orders.standing is not None]
    assert held
    assert {view.orders.standing.verb for view in held} == {"hold"}
    assert held[-1].orders.standing.age_s > held[0].orders.standing.age_s
    assert "hold" in held[-1].orders.answer
    assert set(held[0].orders.permitted) >= {"hold", "go_on", "goal", "stop"}
    events = [event for _, events in beat.moments for event in events]
    assert [e.number for e in events] == list(range(1, len(events) + 1))
    assert {"phase", "ask", "plan", "upload", "order", "answer"} <= {e.kind for e in events}
    plans = [e for e in events if e.kind == "plan" and e.title.endswith(("found", "optimal"))]
    assert all(e.text and dict(e.facts)["time"].endswith(" s") for e in plans)


def test_the_records_give_the_same_views(beat):
    """But for what is not in them: the loop's own words about the disk and the feeds."""
    recorded = recorded_views(beat.folder)
    assert recorded.is_whole
    assert recorded.area == beat.area
    assert len(beat.area.names) == len(beat.area.obstacles)
    assert all(beat.area.names)
    again = list(recorded.moments)
    assert len(again) == recorded.count == len(beat.moments)
    for (live, events), (then, events_then) in zip(beat.moments, again, strict=True):
        assert replace(then, source="live") == live
        assert [(e.kind, e.title, e.t_s) for e in events] == [(e.kind, e.title, e.t_s) for e in events_then]


def test_without_its_telemetry_log_a_voyage_is_seen_by_its_track(beat, tmp_path):
    for name in ("track.csv", "decisions.jsonl", "area.json", "voyage.toml"):
        (tmp_path / name).write_bytes((beat.folder / name).read_bytes())
    assert not (tmp_path / TLOG).exists()
    recorded = recorded_views(tmp_path)
    assert not recorded.is_whole
    moments = list(recorded.moments)
    assert len(moments) == recorded.count == len(beat.views)
    for (then, _), live in zip(moments, beat.views, strict=True):
        valid(then)
        if live.boat.at_en_m is not None:
            assert then.boat.at_en_m == pytest.approx(live.boat.at_en_m, abs=0.11)  # rounded twice
            assert then.boat.tack == live.boat.tack
    assert {e.kind for _, events in moments for e in events} == {"phase", "plan"}


# ------------------------------------------------------------------------------------------ nothing known
def fold_of(tmp_path):
    from companion.compose import config_of, voyage_of
    from companion.geofence import load_mission

    mission = load_mission(write_mission(tmp_path))
    return ViewFold(voyage_of(mission), config_of(mission))


@pytest.mark.parametrize(("off_s", "epoch_s"), [(86_400.0, 1_000.0 + 86_400.0), (3.0, 1_000.0)])
def test_the_time_of_day_is_the_autopilots_where_this_computers_is_another(tmp_path, off_s, epoch_s):
    """In a live simulation the page told the hour at the desk beside "it is dark" of the mission's own date."""
    fold = fold_of(tmp_path)
    fold = ViewFold(fold._voyage, fold._config, epoch_s=1_000.0)
    autopilot = AutopilotStatus(t_s=5.0, boot_s=7.0, utc_at_boot_s=1_000.0 + off_s - 2.0)
    step = Step(snapshot=Snapshot(t_s=5.0), state=SkipperState(), actions=(), voyage=fold._voyage)
    status = CompanionStatus(t_s=5.0, state="idle")
    before, _ = fold.take(step, status, VoyageFigures())
    told = replace(step, snapshot=Snapshot(t_s=6.0, autopilot=autopilot))
    view, _ = fold.take(told, status, VoyageFigures())
    assert before.unix_s == 1_005.0  # nobody has told another
    assert view.unix_s == epoch_s + 6.0
    live = LiveSource(name="test", unix_s=1_000.0)
    live.show(view, (), None)
    assert live.unix_s == epoch_s  # the strips' clock is the page's


def test_a_refuge_without_a_name_is_called_a_refuge_and_its_number(tmp_path):
    """On the chart it was "1", as the first goal's number is; in the editor it was "Refuge 1"."""
    made = replace(
        fold_of(tmp_path)._voyage, refuges=(Refuge(name="1", en_m=(1.0, 2.0)), Refuge(name="Bay", en_m=(0, 0)))
    )
    assert [refuge.name for refuge in refuges_of(made)] == ["refuge 1", "Bay"]


def test_what_is_not_known_is_null_and_never_nought(tmp_path):
    fold = fold_of(tmp_path)
    step = Step(snapshot=Snapshot(t_s=5.0), state=SkipperState(), actions=(), voyage=fold._voyage)
    view, _ = fold.take(step, CompanionStatus(t_s=5.0, state="idle"), VoyageFigures())
    valid(view)
    assert (view.wind, view.no_go, view.laylines, view.polar, view.plan, view.safe_end) == (None,) * 6
    assert view.age_s is None
    known = {k: v for k, v in msgspec.to_builtins(view.boat).items() if v is not None}
    assert known == {"length_m": 1.0}
    parts = {"autopilot", "position", "wind", "mission on board"}
    assert {p.grade for p in view.health if p.name in parts} == {"unknown"}


# -------------------------------------------------------------------------------------------- signs
ANGLES = st.floats(0.0, 2.0 * math.pi)


def vehicle(east_mps, north_mps, heading_rad=0.0):
    return VehicleState(
        t_s=0.0,
        boot_s=0.0,
        position=GeoPoint(lat_deg=50.8, lon_deg=-1.3),
        velocity_en_mps=(east_mps, north_mps),
        heading_rad=heading_rad,
    )


@given(twd=ANGLES, tws=st.floats(0.5, 20.0), heading=ANGLES)
def test_at_rest_the_apparent_wind_is_the_true_one(twd, tws, heading):
    awa, aws = apparent(twd, tws, vehicle(0.0, 0.0, heading))
    assert aws == pytest.approx(tws)
    assert difference_rad(awa, difference_rad(twd, heading)) == pytest.approx(0.0, abs=1e-9)


def test_sailing_on_the_apparent_wind_comes_from_further_ahead():
    heading = math.radians(310.0)  # wind from north: starboard tack, 50 degrees off
    awa, aws = apparent(0.0, 5.0, vehicle(2.0 * math.sin(heading), 2.0 * math.cos(heading), heading))
    assert 0.0 < awa < math.radians(50.0)
    assert aws > 5.0


def forecast(sigma_deg):
    import numpy as np

    horizons = np.array([0.0, 60.0, 300.0])
    sigma = np.radians(np.array(sigma_deg))
    return WindForecast(
        t_s=0.0,
        horizon_s=horizons,
        mean_twd_from_rad=np.zeros(3),
        sigma_twd_rad=sigma,
        mean_tws_mps=np.full(3, 5.0),
        sigma_tws_mps=np.full(3, 0.5),
        level=np.zeros(0),
        half_width_rad=np.zeros((3, 0)),
        correlation_time_s=60.0,
    )


def step_at(here, sigma_deg=(2.0, 6.0, 12.0), heading_deg=310.0):
    heading = math.radians(heading_deg)
    wind = WindEstimate(
        health=WindHealth.GOOD,
        forecast=forecast(sigma_deg),
        mean_twd_from_rad=0.0,
        mean_tws_mps=5.0,
        present_twd_from_rad=0.0,
        present_tws_mps=5.0,
    )
    snapshot = Snapshot(
        t_s=0.0,
        vehicle=vehicle(2.0 * math.sin(heading), 2.0 * math.cos(heading), heading),
        position_en_m=here,
        wind=wind,
    )
    return Step(snapshot=snapshot, state=SkipperState(), actions=(), voyage=None)


def test_the_no_go_zone_widens_by_the_promises_quantile(tmp_path):
    config = SkipperConfig(delta_s=0.95)
    zone = no_go_of(step_at((0.0, 0.0)), fold_of(tmp_path)._voyage, config)
    assert [w.horizon_s for w in zone.wedges] == [0.0, 60.0, 300.0]
    for wedge, sigma in zip(zone.wedges, (2.0, 6.0, 12.0), strict=True):
        assert wedge.widening_deg == pytest.approx(1.6449 * sigma, abs=0.02)  # the one-sided 95 % of a normal
        assert wedge.half_deg == pytest.approx(zone.half_deg + wedge.widening_deg, abs=0.02)
    assert zone.half_deg == pytest.approx(47.0, abs=0.01)


def test_the_no_go_zone_has_what_plans_allow_for(tmp_path):
    """The wedges were 10 to 24 degrees narrower to either side than the zone that the plans beside them kept out of."""
    config, voyage = SkipperConfig(delta_s=0.95), fold_of(tmp_path)._voyage
    boat = replace(voyage.boat, leeway_rad=math.radians(5.0), no_go_error_rad=math.radians(4.0))
    step = step_at((0.0, 0.0))
    tws_mps = float(np.max(step.snapshot.wind.forecast.mean_tws_mps))
    bow_rad = config.planned_no_go_rad(boat, None)
    slips_rad = boat.made_good_rad(bow_rad, tws_mps) - bow_rad  # as the estimator has seen it
    sure = WindAngleUncertainty(believed=(0.0, 0.0, 0.0, slips_rad, 0.0, 0.0), covariance=((0.0,) * 6,) * 6)
    vane = replace(sure, covariance=(*((0.0,) * 6,) * 5, (*(0.0,) * 5, math.radians(6.0) ** 2)))
    wedges = {}
    for name, doubt in {"sure": sure, "vane": vane}.items():
        told = replace(step, snapshot=replace(step.snapshot, doubt=doubt))
        zone = no_go_of(told, replace(voyage, boat=boat), config)
        made = math.degrees(boat.made_good_rad(bow_rad, float(step.snapshot.wind.forecast.mean_tws_mps[0])))
        assert zone.half_deg == pytest.approx(made, abs=0.02)
        wedges[name] = [w.widening_deg for w in zone.wedges]
    assert wedges["sure"] == pytest.approx([1.6449 * math.hypot(sigma, 4.0) for sigma in (2.0, 6.0, 12.0)], abs=0.03)
    assert all(a > b + 0.5 for a, b in zip(wedges["vane"], wedges["sure"], strict=True))
    more = replace(sure, believed=(0.0, 0.0, 0.0, slips_rad + math.radians(3.0), 0.0, 0.0))  # than her file tells of
    told = replace(step, snapshot=replace(step.snapshot, doubt=more))
    zone = no_go_of(told, replace(voyage, boat=boat), config)
    assert zone.half_deg == pytest.approx(made + 3.0, abs=0.02)
    assert [w.widening_deg for w in zone.wedges] == pytest.approx(wedges["sure"], abs=0.02)


def test_a_motor_boat_is_shown_no_no_go_zone_and_no_laylines(voyage):
    """Plans of one have none; the page of one with a vane showed a zone of 47 deg."""
    step, mark = step_at((0.0, 0.0)), (0.0, 100.0)
    for sails in (True, False):
        config = SkipperConfig(sails=sails)
        assert (no_go_of(step, voyage, config) is not None) is sails
        assert (laylines_of(step, voyage, config, "mark", mark) is not None) is sails


@given(off_deg=st.floats(-30.0, 30.0), far_m=st.floats(50.0, 500.0))
def test_a_mark_to_windward_has_two_laylines_and_each_fetches_it(off_deg, far_m, voyage):
    mark = (far_m * math.sin(math.radians(off_deg)), far_m * math.cos(math.radians(off_deg)))
    lines = laylines_of(step_at((0.0, 0.0)), voyage, SkipperConfig(), "mark", mark)
    assert lines.is_beat
    by = {line.tack: line for line in lines.lines}
    assert by["starboard"].course_deg == pytest.approx(360.0 - lines.angle_deg, abs=0.1)  # wind over the right side
    assert by["port"].course_deg == pytest.approx(lines.angle_deg, abs=0.1)
    reach = by["port"].reach_s  # she is on starboard tack, and meets the other tack's layline
    if reach is not None:
        heading, course = math.radians(310.0), math.radians(by["port"].course_deg)
        east, north = 2.0 * reach * math.sin(heading), 2.0 * reach * math.cos(heading)
        off = (mark[0] - east) * math.cos(course) - (mark[1] - north) * math.sin(course)
        assert abs(off) < 1.1  # reach_s is whole seconds
        assert (mark[0] - east) * math.sin(course) + (mark[1] - north) * math.cos(course) > -1.1


def test_a_layline_is_of_the_course_that_leeway_leaves(voyage):
    slips = replace(voyage, boat=replace(voyage.boat, leeway_rad=math.radians(5.0)))
    plain, lee = (laylines_of(step_at((0.0, 0.0)), v, SkipperConfig(), "mark", (0.0, 100.0)) for v in (voyage, slips))
    assert lee.angle_deg > plain.angle_deg + 2.0


@pytest.mark.parametrize(("mark", "is_beat"), [((0.0, 100.0), True), ((100.0, 0.0), None), ((100.0, 30.0), None)])
def test_a_mark_that_is_fetched_on_one_course_has_no_laylines(mark, is_beat, voyage):
    lines = laylines_of(step_at((0.0, 0.0)), voyage, SkipperConfig(), "mark", mark)
    assert (None if lines is None else lines.is_beat) == is_beat


@pytest.fixture(scope="module")
def voyage(tmp_path_factory):
    return fold_of(tmp_path_factory.mktemp("voyage"))._voyage


# -------------------------------------------------------------------------------- bound for elsewhere
def test_what_is_told_of_the_way_is_of_where_she_is_bound(tmp_path):
    """Bound for a refuge the page told how far the goal was, and no time; in a loiter the clearance of the old way."""
    events = (EventSpec(at_s=60.0, kind="order", order="refuge Bay"),)
    seen = sail(tmp_path, tmp_path / "voyage", *events, limit_s=200.0)
    bay = LocalFrame(load_mission(seen.mission).origin).en_from_geo(GeoPoint(lat_deg=50.8172, lon_deg=-1.3085))
    bound = [v for v in seen.under_way if v.plan is not None and v.plan.bound_for and v.boat.at_en_m is not None]
    sailed = [v for v in bound if v.plan.leg is not None and v.plan.leg < v.plan.count]
    assert len(sailed) > 10
    for view in sailed:
        assert view.boat.goal_m == pytest.approx(math.dist(view.boat.at_en_m, bay), abs=12.0)  # there within 10 m
    assert sum(v.plan.there_s is not None for v in sailed) > len(sailed) // 2
    resting = [v for v in bound if v.plan.leg == v.plan.count]
    assert resting
    assert all(v.plan.expected_clearance_m is None for v in resting)
    assert any(v.plan.expected_clearance_m is not None for v in sailed)


def test_a_plans_obstacles_have_the_names_of_the_mission(beat):
    problems = [a.problem for step in beat.steps for a in step.actions if isinstance(a, RequestPlan)]
    assert problems
    assert all(p.obstacle_names[:1] == ("rock",) for p in problems)


def test_water_that_dries_is_drawn_with_its_hours_live_and_from_the_record():
    mission = load_mission("sitl/missions/tide-gate.toml")
    voyage, config = voyage_of(mission), config_of(mission)
    (bar,) = ViewFold(voyage, config).area.drying
    opens, closes = (dt.datetime(2026, 6, 9, *at, tzinfo=dt.UTC).timestamp() for at in ((8, 31, 50), (15, 0, 35)))
    (begin, opens_s), (closes_s, end) = bar.solid_unix_s
    assert (begin, end) == (None, None)
    assert opens_s == pytest.approx(opens, abs=60.0)
    assert closes_s == pytest.approx(closes, abs=60.0)
    assert bar.name == "The bar (drying height)"
    assert len(bar.shapes[0][0]) == 4
    chart = msgspec.convert(chart_record(mission, voyage, config.margin_m, config.tide), RecordedChart)
    assert chart.drying[0].solid_unix_s == bar.solid_unix_s
    assert area_of(voyage, config.margin_m).drying[0].solid_unix_s == ((None, None),), "without a table: for ever"


@pytest.mark.parametrize("start_m", [0.0, 97.0])  # within the goal's radius the way is one place
@pytest.mark.parametrize(("obstacle_m", "name"), [(20.0, "Rock"), (60.0, "a mark")])
def test_what_a_plan_is_nearest_to_is_named(obstacle_m, name, start_m):
    """ "nearest beyond the margin" was a buoy's room, and read as a rock's."""
    import shapely

    problem = Problem.from_json(
        {
            "start": {"x": start_m, "y": 0.0, "heading_deg": 90.0},
            "goal": {"x": 100.0, "y": 0.0, "radius": 5.0},
            "obstacles": [
                shapely.box(40.0, obstacle_m, 60.0, obstacle_m + 9.0).wkt,
                shapely.box(40.0, -50.0, 60.0, -40.0).wkt,
            ],
            "obstacle_names": ["Rock", "a mark"],
            "fence": None,
            "wind": {"from_deg": 0.0, "speed_mps": 5.0, "sigma": {"model": "none"}},
            "boat": {
                "no_go_half_deg": 45.0,
                "max_twa_deg": 180.0,
                "turn_rate_rad_s": 0.5,
                "speed": {"model": "constant", "v_mps": 2.0},
            },
            "delta_s": 0.9,
        }
    )
    answer = plan(problem, expansions=200)
    assert nearest_of(problem, answer) == name
    outcome = PlanOutcome(request_id=1, plan=with_clearance(problem, answer), text="")
    told = dict(_plan(outcome, 1, "", name).facts)
    assert start_m > 0.0 or f", {name}" in told["nearest, beyond what is kept clear"]


def test_metres_are_rounded_once_where_they_are_shown(beat):
    """As the track has them: 21.46 m of clearance were 21.5 m in a view, and so 22 m on the page."""
    rows = {row["t_s"]: row for row in read_rows(beat.folder / TRACK)}
    seen = 0
    for view, _ in recorded_views(beat.folder).moments:
        row = rows[min(rows, key=lambda t_s: abs(t_s - view.t_s))]
        if view.boat.clearance_m is None or view.boat.cross_track_m is None:
            continue
        assert view.boat.clearance_m == pytest.approx(row["clearance_m"], abs=0.011)
        assert view.boat.cross_track_m == pytest.approx(row["cross_track_m"], abs=0.011)
        seen += 1
    assert seen > 60


@pytest.mark.parametrize("days", [0.04, 1.0, 20.0])
def test_of_a_voyage_of_weeks_the_page_keeps_all_of_the_track_evenly(days):
    """The older half was halved again and again: of a day the first twenty hours were one straight line."""
    trail, most = values.Trail(most=40), 40
    last = round(days * 86_400.0 / 90.0)  # a sample each minute and a half, and ninetieths of what is kept
    for n in range(last + 1):
        trail.add(values.Sample(t_s=float(n)))
    times = [sample.t_s for sample in trail.samples]
    assert len(times) <= most
    assert times[-20:] == [float(n) for n in range(last - 19, last + 1)]  # the newest in full
    assert times[0] == 0.0
    if last >= most:
        gaps = np.diff(times[:-20])
        assert len(set(gaps)) == 1
        assert 9 <= len(gaps) <= 19
        assert times[-20] - times[-21] <= gaps[0]

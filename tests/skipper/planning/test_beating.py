"""When the skipper leaves a beat to the autopilot, and when an upload may make its leg begin anew."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from companion.boat.tracking import GuidanceModel, beat_band_m
from companion.skipper.planning.autopilot_beats import is_left_to_beat, may_restart_leg, problem_beat, room_m
from companion.skipper.planning.statement import Start
from companion.skipper.planning.track import problem_tracking
from companion.skipper.step.context import StepContext
from companion.skipper.step.route import Route
from companion.skipper.step.state import Phase
from companion.skipper.way.voyage import Goal
from tests.skipper.world import World, skipper, voyage, with_parts

GOAL = Goal(en_m=(0.0, 400.0), radius_m=6.0, name="the goal")
NORTH = ((0.0, 0.0), (0.0, 300.0))


def ctx(*obstacles, at=(0.0, 0.0), xtrack_m=10.0, irons=(), **config) -> StepContext:
    """Return a turn on a leg to the north in a northerly of 5 m/s, the boat at ``at``."""
    made = voyage(GOAL, obstacles=obstacles)
    world = World(skipper=skipper(made, **config), position=at, corridor=xtrack_m)
    route = Route(
        items=(),
        points_en_m=(),
        plan_id=1,
        plan_t_s=0.0,
        plan_twd_from_rad=0.0,
        plan_tws_mps=5.0,
        plan_half_width_rad=0.0,
        margin_m=15.0,
        delta_s=0.9,
    )
    state = with_parts(world.state, mission={"route": route}, steering={"irons_s": irons})
    out = StepContext(world.skipper.voyage, world.skipper.config, state, world.snapshot())
    out.leg = lambda: NORTH  # type: ignore[method-assign]
    return out


def test_the_room_is_the_boards_band_the_hull_and_the_floor():
    now = ctx()
    helm = replace(GuidanceModel.of(now.snapshot.limits), corridor_m=10.0)
    band = beat_band_m(helm, now.voyage.boat.polar, tws_mps=5.0)
    assert 11.0 < band < 13.0
    assert room_m(now) == pytest.approx(band + now.voyage.boat.hull.reach_m + now.config.margin_floor_m)
    part = problem_beat(now, 15.0)
    assert part is not None
    assert part["clearance_m"] == pytest.approx(room_m(now) - 15.0)
    assert problem_beat(now, 100.0)["clearance_m"] == 0.0
    assert part["corridor_m"] == 10.0


def test_a_beat_is_at_the_angle_of_her_bow_whatever_leeway_she_makes():
    """At her course's angle the leg would be outside the zone, and she be steered along it, not as near as she can."""
    now = ctx()
    slips = replace(now.voyage, boat=replace(now.voyage.boat, leeway_rad=math.radians(5.0)))
    assert problem_beat(StepContext(slips, now.config, now.state, now.snapshot), 15.0) == problem_beat(now, 15.0)


def test_the_predicted_track_is_told_of_her_leeway():
    now = ctx()
    slips = replace(now.voyage, boat=replace(now.voyage.boat, leeway_rad=math.radians(5.0)))
    told = {}
    for name, sailed in {"none": now.voyage, "5": slips}.items():
        moment = StepContext(sailed, now.config, now.state, now.snapshot)
        start, forecast = Start(en_m=(0.0, 0.0), heading_rad=0.0), now.snapshot.wind.forecast
        told[name] = problem_tracking(moment, start, None, area=sailed.area, floor_m=5.0, forecast=forecast)
    assert "leeway_deg" not in told["none"]
    angles = told["5"]["leeway_deg"]
    tws_mps = float(np.max(forecast.mean_tws_mps))
    assert angles[9] == pytest.approx(math.degrees(slips.boat.leeways_rad(np.array([math.radians(45.0)]), tws_mps)[0]))


def test_no_corridor_no_permission_or_failed_tacks_leave_no_beat():
    assert room_m(ctx(xtrack_m=0.0)) is None
    assert room_m(ctx(xtrack_m=80.0)) is None
    assert room_m(ctx(autopilot_beats=False)) is None
    assert room_m(ctx(irons=(0.0, 0.5))) is None
    assert problem_beat(ctx(xtrack_m=0.0), 15.0) is None
    unknown = ctx()
    unknown.snapshot = replace(unknown.snapshot, limits=None)
    assert room_m(unknown) is None


def test_a_rock_in_the_corridor_keeps_the_beat_from_the_autopilot():
    need = room_m(ctx())
    assert need is not None
    assert is_left_to_beat(ctx(), *NORTH)
    assert is_left_to_beat(ctx(box(need + 0.5, 100, need + 20, 120)), *NORTH)
    assert not is_left_to_beat(ctx(box(need - 0.5, 100, need + 20, 120)), *NORTH)


def test_an_upload_waits_while_the_corridor_would_move_onto_a_rock():
    need = room_m(ctx())
    assert need is not None
    rock = box(need + 1.0, 100, need + 20.0, 120)
    assert may_restart_leg(ctx(rock, at=(0.0, 90.0)))  # on the line: the leg stays what it was
    assert not may_restart_leg(ctx(rock, at=(8.0, 90.0)))  # from here the corridor would reach the rock
    assert may_restart_leg(ctx(rock, at=(-8.0, 90.0)))  # and here it moves away from it
    assert may_restart_leg(ctx(at=(8.0, 90.0)))


def sailed_s(beats: bool) -> float:
    """Return how long a voyage upwind in open water takes."""
    world = World(
        skipper=skipper(voyage(GOAL), autopilot_beats=beats),
        expansions=1500,
        sigma=0.12,
        wind=lambda t: (0.15 * math.sin(t / 40.0), 5.0),
    )
    assert world.run(1500, lambda w: w.state.phase is Phase.DONE)
    return world.t


def test_in_open_water_leaving_the_beat_to_the_autopilot_is_faster():
    assert sailed_s(True) < 0.95 * sailed_s(False)

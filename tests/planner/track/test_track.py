"""Plans by the track that would be sailed: corners, floors, boards, and what is said of them."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from companion.boat import ardurover_sitl
from companion.boat.boat import Boat
from companion.boat.tracking import SHORT_S, predict
from companion.errors import InputError
from companion.planner import Plan, PlanStatus, Problem, plan
from companion.planner.effort import Effort
from companion.planner.problem.evaluate import evaluate
from companion.planner.search.auto import search
from companion.planner.track import expected
from companion.planner.track.expected import curve_mps
from companion.planner.track.kept import laid, roomier

MARGIN_M, FLOOR_M = 12.0, 6.0
WALLS = [
    shapely.box(*(-150.0, y, 40.0, y + 0.8) if n % 2 == 0 else (-40.0, y, 150.0, y + 0.8))
    for n, y in enumerate((60.0, 90.0, 120.0))
]


def problem(walls=WALLS, *, wind_deg=180.0, tws=6.0, margin=MARGIN_M, goal=(0.0, 190.0), tracking=None, **more):
    boat = Boat(polar=ardurover_sitl()).problem_boat(tws)
    track = {
        "floor_m": FLOOR_M,
        "reach_m": 0.5,
        "wp_radius_m": 3.0,
        "wp_speed_mps": 5.0,
        "solids": [shapely.to_wkt(w) for w in walls],
        "limits": None,
        **(tracking or {}),
    }
    return Problem.from_json(
        {
            "id": "walls",
            "start": {"x": 0.0, "y": 0.0, "heading_deg": 0.0},
            "goal": {"x": goal[0], "y": goal[1], "radius": 8.0},
            "obstacles": [shapely.to_wkt(shapely.buffer(w, margin, quad_segs=8)) for w in walls],
            "fence": None,
            "wind": {
                "from_deg": wind_deg,
                "speed_mps": tws,
                "sigma": {"model": "ar1", "sigma0_deg": 3.0, "sigma_inf_deg": 9.0, "rho_hz": 0.036},
            },
            "boat": {**boat, "no_go_half_deg": 47.0},
            "delta_s": 0.9,
            "leg_saving": 8e-5,
            "tracking": track,
            **more,
        }
    )


def test_round_the_ends_of_walls_the_floor_is_kept_with_fewer_waypoints():
    tracked = problem()
    lines = plan(replace(tracked, tracking=None), expansions=15_000, seed=1)
    found = plan(tracked, expansions=15_000, seed=1)
    assert found.has_path
    assert not expected(tracked, lines.waypoints_en).is_kept
    assert expected(tracked, found.waypoints_en).is_kept
    assert len(found.waypoints_en) <= 0.5 * len(lines.waypoints_en)
    assert found.cost_s <= 1.03 * lines.cost_s + 2.0
    assert evaluate(tracked, found.waypoints_en).is_feasible
    assert lines.expected_clearance_m is None
    assert found.expected_clearance_m >= FLOOR_M
    sailed = predict(
        found.waypoints_en,
        tracked.tracking.helm,
        curve_mps=curve_mps(tracked),
        twd_from_rad=tracked.wind.twd_from_rad,
        heading_rad=0.0,
    )
    near = min(shapely.distance(shapely.LineString(sailed.en_m), w) for w in WALLS)
    assert near > found.expected_clearance_m + 0.5  # the hull and the prediction's error are taken off
    again = plan(tracked, expansions=15_000, seed=1)
    assert np.array_equal(again.waypoints_en, found.waypoints_en)


@pytest.mark.parametrize("start", [(-150.0, 40.0), (-60.0, 40.0), (150.0, 35.0)])
def test_round_walls_ends_there_and_back_no_leg_is_too_short_to_be_followed(start):
    tracked = replace(problem(margin=9.0, tracking={"wp_radius_m": 8.0}), start_en=start)
    lines = plan(replace(tracked, tracking=None), expansions=8_000, seed=1)
    found = plan(tracked, expansions=8_000, seed=1)
    short_m = SHORT_S * float(np.max(curve_mps(tracked)))
    assert min(lengths_m(lines)) < short_m  # arcs, whose legs on either side meet nowhere
    assert min(lengths_m(found)) >= short_m
    assert expected(tracked, found.waypoints_en).is_kept
    assert found.cost_s <= 1.03 * lines.cost_s + 2.0


def test_a_slalom_of_thick_walls_is_sailed_in_a_sixth_of_the_legs_all_long_enough():
    walls = [
        shapely.box(*((-400.0, y, 9.0, y + 16.0) if n % 2 == 0 else (-9.0, y, 400.0, y + 16.0)))
        for n, y in enumerate(60.0 + 52.0 * k for k in range(7))
    ]
    tracked = problem(walls, tws=5.0, goal=(0.0, 480.0))
    lines = plan(replace(tracked, tracking=None), expansions=8_000, seed=1)
    found = plan(tracked, expansions=8_000, seed=1)
    assert len(lengths_m(lines)) > 80
    assert len(lengths_m(found)) <= len(lengths_m(lines)) / 6
    assert min(lengths_m(found)) >= SHORT_S * float(np.max(curve_mps(tracked)))
    assert expected(tracked, found.waypoints_en).is_kept
    assert found.cost_s <= 1.03 * lines.cost_s


def test_a_roomier_path_that_takes_too_long_is_not_laid():
    tracked = problem()
    lines = plan(replace(tracked, tracking=None), expansions=15_000, seed=1)
    path = [(float(x), float(y)) for x, y in lines.waypoints_en]
    assert roomier(search, tracked, path, Effort(None, 15_000), 1) is not None
    assert roomier(search, tracked, path, Effort(None, 15_000), 1, within_s=0.9 * lines.cost_s) is None


def test_legs_in_which_ardurover_looped_onto_a_walls_end_are_no_plan():
    short = json.loads(Path("tests/boat/tracking/short_legs.json").read_text())
    ends = np.asarray(short["wall_end_en_m"])
    back = np.asarray([-1.0, 1.0]) * (ends[0] - ends[1])[::-1] * 4.0  # square to the end
    wall = shapely.Polygon([*ends, ends[1] + back, ends[0] + back])
    path = [(float(e), float(n)) for e, n in short["legs_en_m"]]
    tracked = replace(problem([wall], wind_deg=20.0, tws=5.0), start_en=path[0], goal_en=path[-1])
    seen = expected(tracked, path)
    assert shapely.distance(wall, shapely.LineString(path)) > 12.0
    assert expected(tracked, path, has_loops=False).is_kept
    assert not seen.is_kept
    assert seen.clearance_m < shapely.distance(wall, shapely.LineString(short["sailed_en_m"])) < FLOOR_M


@pytest.mark.parametrize(("bearing_deg", "far_m"), [(52.0, 80.0), (54.0, 140.0)])
def test_along_a_zone_that_widens_on_the_way_a_leg_is_no_chain_of_short_ones(bearing_deg, far_m):
    to = math.radians(bearing_deg)
    close = problem([], wind_deg=0.0, goal=(far_m * math.sin(to), far_m * math.cos(to)))
    lines = plan(replace(close, tracking=None), expansions=8_000, seed=1)
    found = plan(close, expansions=8_000, seed=1)
    assert len(lines.legs) > 12
    assert len(found.legs) <= 6
    assert found.cost_s <= 1.03 * lines.cost_s + 2.0
    assert evaluate(close, found.waypoints_en).is_feasible


def test_a_part_of_a_path_is_judged_as_in_the_whole():
    tracked = problem()
    path = [
        (0.0, 0.0),
        (60.0, 20.0),
        (60.0, 50.0),
        (36.0, 75.0),
        (-60.0, 78.0),
        (-46.0, 105.0),
        (60.0, 110.0),
        (0.0, 190.0),
    ]
    whole, part = expected(tracked, path), expected(tracked, path, part=slice(1, 6))
    assert not whole.is_kept
    assert whole.worst_leg == part.worst_leg
    assert part.lack_m == pytest.approx(whole.lack_m, abs=0.1)


def lengths_m(found):
    return np.hypot(*np.diff(found.waypoints_en, axis=0).T)


def test_a_plan_says_it_in_its_json_and_reads_it_back():
    found = plan(problem(), expansions=15_000, seed=1)
    again = Plan.from_dict(found.to_dict())
    assert (again.expected_clearance_m, again.expected_at_en) == (found.expected_clearance_m, found.expected_at_en)
    assert "expected_clearance_m" not in plan(replace(problem(), tracking=None), expansions=5_000).to_dict()


def test_a_floor_that_cannot_be_kept_is_no_plan_and_says_where():
    found = plan(problem(tracking={"floor_m": 80.0}), expansions=15_000, seed=1)
    assert found.status is PlanStatus.NOT_FOUND
    assert "the floor is 80.0 m" in found.reason
    assert "east" in found.reason


def test_where_the_closest_path_cannot_keep_the_floor_one_with_more_room_does():
    """The search has clung to the walls for as long as it had: it was no plan at all, with 12 m of margin and less."""
    tracked = problem(tracking={"floor_m": 14.0})
    found = plan(tracked, expansions=15_000, seed=1)
    assert found.expected_clearance_m >= 14.0
    assert evaluate(tracked, found.waypoints_en).is_feasible
    lines = plan(replace(tracked, tracking=None), expansions=15_000, seed=1)
    assert not laid(tracked, [tuple(p) for p in lines.waypoints_en])[1].is_kept
    assert found.lower_bound_s <= lines.cost_s  # the bound is the problem's own, not the narrower water's


def test_open_water_has_nothing_to_be_clear_of():
    found = plan(problem([]), expansions=5_000)
    assert found.has_path
    assert found.expected_clearance_m is None


def test_what_carries_her_sideways_is_in_what_is_expected_of_a_path():
    """A reach 20 m off a wall to leeward: across the current and by leeway she lies nearer to it than her leg."""
    path, wall = [(0.0, 0.0), (0.0, 150.0)], [shapely.box(20.0, -50.0, 25.0, 250.0)]
    still = expected(problem(wall, wind_deg=270.0, tws=2.0), path).clearance_m
    zone = {"from_deg": 270.0, "half_deg": 55.0}
    current = {"current": {"set_deg": 90.0, "drift_mps": 0.4}, "zone": zone}
    carried = expected(problem(wall, wind_deg=270.0, tws=2.0, **current), path).clearance_m
    slips = expected(problem(wall, wind_deg=270.0, tws=2.0, tracking={"leeway_deg": [10.0] * 3}), path).clearance_m
    assert carried < still - 4.0
    assert slips < still - 2.0


def test_a_beat_in_a_current_is_about_the_wind_over_the_ground():
    zone = {"from_deg": 20.0, "half_deg": 55.0}
    turned = problem([], wind_deg=0.0, current={"set_deg": 90.0, "drift_mps": 0.4}, zone=zone)
    assert turned.ground_turn_rad == pytest.approx(math.radians(20.0))
    legs = [(0.0, 0.0), (0.0, 200.0)]
    sailed = {
        deg: predict(legs, turned.tracking.helm, curve_mps=curve_mps(turned), twd_from_rad=0.0, ground_turn_rad=rad)
        for deg, rad in ((0.0, 0.0), (20.0, turned.ground_turn_rad))
    }
    courses = {deg: np.degrees(np.arctan2(*np.diff(s.en_m[s.beats], axis=0).T)) for deg, s in sailed.items()}
    held = {deg: np.median(np.abs(c[np.abs(c) < 120.0]) - 45.0) for deg, c in courses.items()}
    assert held[0.0] == pytest.approx(0.0, abs=1.0)
    assert abs(held[20.0]) > 15.0  # 25 degrees off the wind over the water on one tack, 65 on the other


def test_unread_parameters_widen_what_is_kept():
    path = [(0.0, 0.0), (60.0, 0.0), (60.0, 150.0)]
    known, unread = (expected(problem(tracking={"known": k}), path).clearance_m for k in (True, False))
    assert unread < known - 1.0


def test_a_start_that_is_nearer_than_the_floor_need_only_come_no_nearer():
    wall = [shapely.box(-60.0, -4.0, 60.0, -3.5)]  # astern of her
    away, along = [(0.0, 0.0), (0.0, 150.0)], [(0.0, 0.0), (55.0, -1.5), (55.0, 150.0)]
    here = problem(wall, wind_deg=270.0)
    assert expected(here, away).is_kept
    assert expected(here, away).clearance_m < FLOOR_M
    assert not expected(here, along).is_kept


def test_the_corner_at_the_start_counts_where_the_leg_before_is_known():
    inside = [shapely.box(-22.0, 13.0, -13.0, 22.0)]  # within the corner that a wide radius cuts
    path = [(0.0, 0.0), (0.0, 150.0)]
    wide = {"wp_radius_m": 10.0}
    before = {**wide, "before": {"x": -100.0, "y": 0.0}}
    from_rest = expected(problem(inside, wind_deg=300.0, tracking=wide), path).clearance_m
    rounding = expected(problem(inside, wind_deg=300.0, tracking=before), path).clearance_m
    assert rounding < from_rest - 1.5


# ---------------------------------------------------------------------------------------------- boards
BEAT = {"no_go_half_deg": 45.0, "corridor_m": 10.0, "clearance_m": 8.0, "tack_s": 2.0}


def channel(half_m, **more):
    walls = [shapely.box(half_m, -30.0, half_m + 5.0, 330.0), shapely.box(-half_m - 5.0, -30.0, -half_m, 330.0)]
    return problem(walls, wind_deg=0.0, tws=5.0, margin=FLOOR_M, goal=(0.0, 300.0), beat=BEAT, **more)


def test_boards_that_come_too_near_are_seen_and_those_with_room_are_kept():
    path = [(0.0, 0.0), (0.0, 298.0)]
    narrow, roomy = channel(18.0), channel(22.0)
    assert evaluate(narrow, path).legs[0].is_beat
    seen = expected(narrow, path)
    assert seen.is_beat
    sailed = expected(narrow, path, has_boards=False)  # what paths are told apart by before their boards are sailed
    assert sailed.lack_m <= seen.lack_m
    assert not sailed.is_beat
    assert not seen.is_kept
    assert expected(roomy, path).is_kept
    assert expected(narrow, path, has_boards=False).is_kept  # the boards are what comes near


def test_a_path_is_predicted_once_with_loops_and_without(monkeypatch):
    module, tracks = sys.modules[expected.__module__], []
    monkeypatch.setattr(module, "predict", lambda *args, **more: tracks.append(1) or predict(*args, **more))
    path, narrow = [(0.0, 0.0), (0.0, 298.0)], channel(18.0)
    looped = expected(narrow, path)
    once = len(tracks)
    assert once > 20  # the track, and one in each wind that is drawn
    plain = expected(narrow, path, has_loops=False)
    assert len(tracks) == once
    assert (plain.is_beat, plain.worst_en) == (looped.is_beat, looped.worst_en)


def test_more_is_asked_of_boards_where_the_mission_asks_for_more():
    path = [(0.0, 0.0), (0.0, 298.0)]
    rough = {"model": "ar1", "sigma0_deg": 12.0, "sigma_inf_deg": 18.6, "rho_hz": 0.036}
    at = [
        expected(
            replace(
                channel(20.0),
                delta_s=d,
                wind=replace(
                    channel(20.0).wind,
                    sigma=replace(channel(20.0).wind.sigma, sigma_inf_rad=math.radians(rough["sigma_inf_deg"])),
                ),
            ),
            path,
        ).clearance_m
        for d in (0.6, 0.98)
    ]
    assert at[1] < at[0]


# ------------------------------------------------------------------------------------------- the format
def test_the_tracking_is_written_and_read_back():
    before = problem(
        tracking={
            "before": {"x": -40.0, "y": 3.0},
            "known": False,
            "correlation_s": 28.0,
            "limits": "POLYGON ((-200 -50, 200 -50, 200 250, -200 250, -200 -50))",
        }
    )
    again = Problem.from_json(before.to_dict() if hasattr(before, "to_dict") else _written(before))
    assert again.tracking.helm == before.tracking.helm
    for name in ("floor_m", "reach_m", "before_en", "correlation_s", "is_known"):
        assert getattr(again.tracking, name) == getattr(before.tracking, name)
    assert shapely.equals(again.tracking.limits, before.tracking.limits)
    assert [shapely.equals(a, b) for a, b in zip(again.tracking.solids, before.tracking.solids, strict=True)]


def _written(value):
    from tests.planner.problem_json import to_dict

    return to_dict(value)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"wp_speed_mps": 0.0}, "wp_speed_mps"),
        ({"solids": "POLYGON"}, "solids"),
        ({"solids": ["POINT (1 2)"]}, "Point"),
        ({"floor_m": "six"}, "floor_m"),
        ({"before": {"x": 1.0}}, "before.y"),
    ],
)
def test_what_cannot_be_read_is_named(wrong, word):
    with pytest.raises(InputError, match=word):
        problem(tracking=wrong)


def test_a_floor_that_is_no_number_cannot_be_planned():
    found = plan(problem(tracking={"floor_m": math.nan}), expansions=1000)
    assert found.status is PlanStatus.INVALID
    assert "tracking" in found.reason


def test_a_boat_that_circles_before_the_corner_for_ever_is_judged_by_her_circles():
    """Of a boat that turns 25 m wide nothing of the track was on legs of 7, 5 and 2 m: IndexError."""
    path = np.array([(136.76, 140.597), (37.692, 143.232), (30.527, 144.538), (25.965, 145.922), (23.805, 146.943)])
    wall = [shapely.box(-40.0, 100.0, 20.0, 200.0)]
    made = problem(wall, wind_deg=265.0, tws=9.4)
    angles = np.radians([0, 30, 45, 55, 70, 90, 110, 135, 160, 180])
    mps = 2.5 * np.array([0, 0, 0.5, 0.84, 0.95, 1, 1, 0.95, 0.85, 0.8])
    helm = replace(made.tracking.helm, no_go_half_rad=math.radians(50.0), rate_max_radps=math.radians(10.0))
    slow = replace(
        made,
        boat=replace(made.boat, polar_twa_rad=tuple(angles), polar_mps=tuple(mps)),
        tracking=replace(made.tracking, helm=helm),
    )
    seen = expected(slow, path, part=slice(1, None), has_boards=False)
    assert -math.inf < seen.clearance_m < 30.0

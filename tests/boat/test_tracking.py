"""The predicted track: against what the real ArduRover sailed, and by what must hold of any prediction."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.tracking.record import sail_simulated
from bench.tracking.recordings import load
from bench.tracking.residuals import boards, curve_mps, helm_of, residuals
from bench.tracking.trials import CORNERS_DEG, WINDS_MPS, Trial, beats, corners, streams
from companion.boat import AutopilotLimits, Boat, ardurover_sitl
from companion.boat import track_kernels as s
from companion.boat.tracking import (
    GuidanceModel,
    are_near_short,
    beat_band_m,
    curve_of,
    drawn_winds,
    loop_m,
    predict,
    stated_error_m,
)
from sitl.autopilot import Departures

POLAR = ardurover_sitl()
HELM = GuidanceModel(wp_radius_m=3.0, wp_speed_mps=5.0)


@pytest.fixture(scope="module")
def sailed():
    return load()


def track(points, helm=HELM, tws=5.0, twd=0.0, **more):
    return predict(points, helm, curve_mps=curve_of(POLAR, tws), twd_from_rad=twd, **more)


# ------------------------------------------------------------------------------------------- the real one
def test_the_recordings_hold_every_trial_and_every_kind_of_corner(sailed):
    assert set(sailed) == {t.name for t in [*corners(), *beats(), *streams()]}
    turns = set()
    for trial in corners():
        path = np.asarray([(0.0, 0.0), *trial.points_en_m])
        course = np.degrees(np.arctan2(*np.diff(path, axis=0).T))
        turns |= {abs(round((t + 180.0) % 360.0 - 180.0)) for t in np.diff(course)}
    assert turns >= {round(c) for c in CORNERS_DEG}


@pytest.mark.parametrize("tws", WINDS_MPS)
@pytest.mark.parametrize("near_short", [False, True])
def test_the_stated_error_is_the_99_percent_of_what_ardurover_sailed(sailed, tws, near_short):
    rows = [residuals(t, sailed[t.name]) for t in corners() if t.tws_mps == tws]
    off = np.concatenate([r.track_m[r.is_short == near_short] for r in rows])
    stated = stated_error_m(float(np.max(curve_mps(tws))), HELM, has_short=near_short)
    assert len(off) > 400
    assert 0.4 * stated <= np.quantile(off, 0.99) <= stated


def test_no_loop_about_a_short_leg_went_farther_off_than_is_allowed_for(sailed):
    for tws in WINDS_MPS:
        allowed = loop_m(float(np.max(curve_mps(tws))), HELM)
        rows = [residuals(t, sailed[t.name]) for t in corners() if t.tws_mps == tws]
        greatest = max(float(np.max(r.track_m[r.is_short], initial=0.0)) for r in rows)
        assert 0.9 * allowed <= greatest <= allowed


def test_the_loop_onto_a_walls_end_was_farther_off_than_the_99_percent_and_within_what_is_allowed_for():
    short = json.loads(Path("tests/boat/tracking/short_legs.json").read_text())
    expected = shapely.LineString(track(short["legs_en_m"], twd=math.radians(20.0)).en_m)
    off = shapely.distance(expected, shapely.points(short["sailed_en_m"]))
    best = float(np.max(curve_of(POLAR, 5.0)))
    assert np.mean(off > stated_error_m(best, HELM, has_short=True)) > 0.2
    assert np.max(off) <= loop_m(best, HELM)
    end = shapely.Point(short["wall_end_en_m"][0])
    assert shapely.distance(end, expected) > 12.0
    assert shapely.distance(end, shapely.LineString(short["sailed_en_m"])) < 3.2


def test_the_prediction_is_nearer_to_what_was_sailed_than_the_legs_are(sailed):
    rows = [residuals(t, sailed[t.name]) for t in corners()]
    ours, legs = (np.concatenate([getattr(r, name)[~r.is_short] for r in rows]) for name in ("track_m", "legs_m"))
    assert np.quantile(ours, 0.9) < 0.5 * np.quantile(legs, 0.9)


def test_a_board_goes_beyond_the_corridor_by_what_is_predicted_and_no_more_than_half_a_metre(sailed):
    for trial in beats():
        real, ours = boards(trial, sailed[trial.name])
        assert abs(len(real) - len(ours)) <= 2
        assert -0.2 <= np.median(ours) - np.median(real) <= 0.6
        assert max(real) <= max(ours) + 0.3


@pytest.mark.parametrize("trial", streams(), ids=lambda t: t.name)
def test_across_a_current_she_lies_off_her_legs_as_far_as_is_predicted(sailed, trial):
    ours = residuals(trial, sailed[trial.name])
    still = residuals(replace(trial, drift_mps=0.0), sailed[trial.name])
    best = float(np.max(curve_mps(trial.water_wind[1])))
    assert np.quantile(ours.track_m, 0.99) <= stated_error_m(best, HELM, has_short=False) + 0.3
    assert np.quantile(ours.track_m, 0.9) < 0.5 * np.quantile(still.track_m, 0.9)


# --------------------------------------------------------------------------------------------- always so
@given(
    st.floats(0.0, 2.0 * math.pi),
    st.lists(st.tuples(st.floats(25.0, 90.0), st.floats(-1.5, 1.5)), min_size=1, max_size=5),
)
@settings(max_examples=40)
def test_turned_with_the_wind_it_is_the_same_track(turn, legs):
    here, course, path = (0.0, 0.0), math.radians(110.0), [(0.0, 0.0)]
    for length, bend in legs:
        course = min(max(course + bend, math.radians(62.0)), math.radians(298.0))
        here = (here[0] + length * math.sin(course), here[1] + length * math.cos(course))
        path.append(here)
    c, n = math.cos(turn), math.sin(turn)
    rotation = np.array([[c, -n], [n, c]])
    plain, turned = track(path), track(np.asarray(path) @ rotation, twd=turn)
    assert plain.arrives
    assert turned.arrives
    away = shapely.hausdorff_distance(shapely.LineString(plain.en_m @ rotation), shapely.LineString(turned.en_m))
    assert away < 0.5
    assert np.all(np.diff(plain.leg) >= 0)
    assert plain.beats.mean() < 0.1  # beside its end the bearing may point to windward for a moment


@pytest.mark.parametrize("radius", [1.5, 3.0, 5.0])
def test_a_wider_radius_cuts_the_corner_more(radius):
    path = [(0.0, 0.0), (70.0, 0.0), (70.0, -70.0)]

    def near(r):
        sailed = track(path, GuidanceModel(wp_radius_m=r, wp_speed_mps=5.0)).en_m
        return float(shapely.distance(shapely.LineString(sailed), shapely.Point(70.0, 0.0)))

    assert near(radius) < near(2.0 * radius)
    assert near(radius) == pytest.approx(radius, rel=0.45)


def test_a_leg_to_windward_is_beaten_within_its_corridor_and_an_overshoot():
    run = track([(0.0, 0.0), (0.0, 200.0)])
    assert run.arrives
    assert run.beats.mean() > 0.9
    assert 10.0 < np.max(np.abs(run.en_m[:, 0])) < 12.5


def test_she_may_begin_beside_the_leg_and_comes_to_it():
    run = track([(0.0, 0.0), (200.0, 0.0)], start_en_m=(0.0, -12.0), heading_rad=math.pi / 2.0)
    assert run.en_m[0, 1] == pytest.approx(-12.0, abs=0.2)
    assert abs(run.en_m[-1, 1]) < 1.0


def test_a_path_without_length_is_no_track():
    assert track([(1.0, 2.0), (1.0, 2.0)]).arrives
    assert track([(1.0, 2.0), (1.0, 2.0)]).time_s <= 0.2


def test_without_wind_the_prediction_ends():
    run = track([(0.0, 0.0), (50.0, 0.0)], tws=0.0)
    assert not run.arrives
    assert len(run.en_m) < 200_000


# ----------------------------------------------------------------------------------------------- the band
def test_the_band_is_the_corridor_and_an_overshoot_that_grows_with_speed():
    assert 11.0 < beat_band_m(HELM, POLAR, tws_mps=5.0) < 12.8
    assert beat_band_m(HELM, POLAR, tws_mps=9.0) > beat_band_m(HELM, POLAR, tws_mps=3.0)
    with pytest.raises(ValueError, match="no band"):
        beat_band_m(GuidanceModel(corridor_m=0.0), POLAR, tws_mps=5.0)


@pytest.mark.parametrize("sigma_deg", [9.0, 18.6])
def test_nine_boards_of_ten_stay_within_the_band_in_a_wind_that_spreads(sigma_deg):
    band = beat_band_m(HELM, POLAR, tws_mps=5.0)
    far = []
    for wind in drawn_winds(0.0, sigma_rad=math.radians(sigma_deg), tau_s=28.0, length_s=500.0):
        run = track([(0.0, 0.0), (0.0, 250.0)], twd=wind)
        board = (run.en_m[:, 1] // 20.0).astype(int)
        far += [np.max(np.abs(run.en_m[board == b, 0])) for b in np.unique(board)]
    assert np.quantile(far, 0.9) <= band
    assert np.max(far) < band + 3.0


def test_drawn_winds_have_the_spread_and_the_memory_that_are_asked_for():
    winds = drawn_winds(1.0, sigma_rad=0.2, tau_s=20.0, length_s=400.0, count=400)
    assert float(np.mean(winds)) == pytest.approx(1.0, abs=0.02)
    assert float(np.std(winds)) == pytest.approx(0.2, rel=0.05)
    late = np.corrcoef(winds[:, 100], winds[:, 140])[0, 1]  # 20 s on
    assert late == pytest.approx(math.exp(-1.0), abs=0.12)
    steady = drawn_winds(0.0, sigma_rad=0.2, tau_s=0.0, length_s=60.0)
    assert np.ptp(steady, axis=1).max() == 0.0


def test_short_legs_taint_their_neighbours():
    assert are_near_short([50.0, 50.0, 5.0, 50.0, 50.0], 2.0).tolist() == [False, True, True, True, False]
    assert stated_error_m(9.0, HELM, has_short=False) > stated_error_m(4.4, HELM, has_short=False)


def test_a_boat_that_may_turn_slowly_only_is_where_she_is_predicted_and_off_it_by_no_more_than_is_stated():
    trials = [t for t in corners() if t.tws_mps == 3.0][:2]
    best = float(np.max(curve_mps(3.0)))
    told = np.concatenate([off_m(t, 15.0, told=True) for t in trials])
    untold = np.concatenate([off_m(t, 15.0, told=False) for t in trials])
    assert np.median(told) < 0.3 * np.median(untold)
    helm = replace(HELM, rate_max_radps=math.radians(15.0))
    assert np.quantile(told, 0.99) < stated_error_m(best, helm, has_short=True)
    assert np.quantile(untold, 0.99) > stated_error_m(best, HELM, has_short=True)


def off_m(trial, rate_deg, *, told):
    """Return how far off the predicted track the simulated boat sails a trial by an ATC_STR_RAT_MAX."""
    way = sail_simulated(trial, {"ATC_STR_RAT_MAX": rate_deg})
    helm = helm_of(trial)
    helm = replace(helm, rate_max_radps=math.radians(rate_deg)) if told else helm
    legs = [(0.0, 0.0), *trial.points_en_m]
    expected = predict(legs, helm, curve_mps=curve_mps(trial.tws_mps), twd_from_rad=0.0, speed_mps=0.0)
    return shapely.distance(shapely.LineString(expected.en_m), shapely.points(way[:, 1:3]))


@pytest.mark.parametrize(("tws", "leeway_deg"), [(2.0, 10.0), (4.0, 6.0), (6.0, 10.0)])
def test_with_leeway_she_lies_to_leeward_of_her_legs_as_far_as_is_predicted(tws, leeway_deg):
    points, here = [], np.zeros(2)
    for course in np.radians([65.0, 190.0, 296.0, 130.0]):
        here = here + 110.0 * np.array([math.sin(course), math.cos(course)])
        points.append((float(here[0]), float(here[1])))
    trial = Trial(name="leeway", points_en_m=tuple(points), tws_mps=tws)
    way = sail_simulated(trial, departures=Departures(leeway_rad=math.radians(leeway_deg)))
    boat = Boat(polar=POLAR, leeway_rad=math.radians(leeway_deg))
    slips = boat.leeways_rad(np.linspace(0.0, math.pi, 37), tws)
    off = {}
    for told in (slips, None):
        expected = predict(
            [(0.0, 0.0), *points],
            helm_of(trial),
            curve_mps=curve_mps(tws),
            twd_from_rad=0.0,
            speed_mps=0.0,
            leeway_rad=told,
        )
        off[told is None] = shapely.distance(shapely.LineString(expected.en_m), shapely.points(way[:, 1:3]))
    assert np.quantile(off[False], 0.9) < 0.5 * np.quantile(off[True], 0.9)
    best = float(np.max(curve_mps(tws)))
    assert np.quantile(off[False], 0.99) < stated_error_m(best, HELM, has_short=False)


# ---------------------------------------------------------------------------------------------- the parts
@given(st.floats(0.5, 200.0), st.floats(0.5, 8.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0))
@settings(max_examples=60)
def test_the_point_runs_a_leg_from_rest_to_rest_without_a_leap(length, fastest, accel, jerk):
    top = s.top_speed_mps(length, fastest, accel, jerk)
    rise = s.rise_s(top, accel, jerk)
    whole = s.leg_s(length, top, rise)
    rows = np.array([s.on_leg(t, length, top, rise, whole, accel, jerk) for t in np.linspace(0.0, whole, 400)])
    step = whole / 399.0
    assert rows[0, 0] == 0.0
    assert rows[-1, 0] == pytest.approx(length, rel=1e-6)
    assert np.all(np.diff(rows[:, 0]) >= -1e-9)
    assert np.max(rows[:, 1]) <= fastest + 1e-6
    assert np.max(np.abs(rows[:, 2])) <= accel + 1e-6
    assert np.max(np.abs(np.diff(rows[:, 1]))) <= accel * step + 1e-6
    assert np.max(np.abs(np.diff(rows[:, 2]))) <= 1.01 * jerk * step + 1e-6


def test_the_helm_is_that_of_the_parameters():
    limits = AutopilotLimits.from_params(
        {"WP_RADIUS": 4.0, "WP_SPEED": 5.0, "ATC_ACCEL_MAX": 1.5, "SAIL_XTRACK_MAX": 20.0, "SAIL_NO_GO_ANGLE": 40.0}
    )
    helm = GuidanceModel.of(limits)
    assert (helm.wp_radius_m, helm.wp_speed_mps, helm.accel_mps2, helm.jerk_mps3) == (4.0, 5.0, 1.5, 1.5)
    assert helm.corridor_m == 20.0
    slow = GuidanceModel.of(
        AutopilotLimits.from_params({"ATC_STR_RAT_MAX": 30.0, "ATC_STR_ACC_MAX": 0.0, "WP_PIVOT_RATE": 20.0})
    )
    assert (slow.rate_max_radps, slow.pivot_rate_radps) == (math.radians(30.0), math.radians(20.0))
    assert slow.rate_change_radps2 > GuidanceModel().rate_change_radps2  # 0: no limit
    assert GuidanceModel.of(AutopilotLimits()).stated() == {}
    assert helm.no_go_half_rad == pytest.approx(math.radians(40.0))
    assert AutopilotLimits.from_params({"ATC_ACCEL_MAX": 1.5, "WP_ACCEL": 0.8, "WP_JERK": 2.0}).wp_accel_mps2 == 0.8
    with pytest.raises(ValueError, match="wp_speed_mps"):
        GuidanceModel(wp_speed_mps=0.0)

"""The judge: contacts, clearance and tacks of tracks whose answer is known."""

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import Hull
from sitl.commands.run import print_verdict
from sitl.scenario import verdict_line
from sitl.scenario.scenario import EventSpec, ExpectSpec, HeldSpec, is_ordinary
from sitl.scenario.true_track import HullTrack, TrueTrack, count_roundings, count_tacks, longest_silence_s
from tests.sitl.judged import judged

ISLAND = shapely.Point(0.0, 0.0).buffer(10.0)


DOT = Hull(length_m=0.0, beam_m=0.0)
LONG = Hull(length_m=8.0, beam_m=2.0)


def hulls(en_m, heading_deg=0.0, hull=DOT):
    en_m = np.asarray(en_m, dtype=float).reshape(-1, 2)
    return HullTrack(en_m=en_m, heading_rad=np.radians(np.broadcast_to(heading_deg, len(en_m))), hull=hull)


def test_a_verdict_is_printed_in_words(capsys):
    """It printed "pass  no unhandled error: [] ([])"."""
    print_verdict(
        judged(
            scenario="x",
            seed=1,
            expect=ExpectSpec(arrived=True, contacts=0, min_clearance_m=2.0, alerts=("irons",)),
            truth=_truth([45.0] * 20),
            solid=shapely.Polygon(),
            hull=DOT,
            goal_en_m=(100.0, 0.0),
            summary={"arrived": True, "replans": 0},
            status_times_s=[0.0],
            alerts=[],
            ordered=[],
        )
    )
    out = capsys.readouterr().out
    assert "pass  no unhandled error: none (wanted: none)" in out
    assert "pass  arrived: yes (wanted: yes)" in out
    assert "FAIL  announced irons: none (wanted: irons)" in out
    assert "clearance, m: nothing near (wanted: at least 2.0)" in out
    assert not [mark for mark in ("[", "{", "None", "inf") if mark in out]


def test_a_boat_that_never_set_sail_has_kept_no_clearance(capsys):
    """ "pass  clearance, m: nothing near" and "no obstacle or fence" stood there of one that lay outside its fence."""
    verdict = judged(
        scenario="x",
        seed=1,
        expect=ExpectSpec(min_clearance_m=3.0),
        truth=TrueTrack(),
        solid=shapely.box(0.0, 0.0, 1.0, 1.0),
        hull=DOT,
        goal_en_m=(100.0, 0.0),
        summary={"arrived": False, "replans": 0},
        status_times_s=None,
        alerts=[],
    )
    print_verdict(verdict)
    assert "FAIL  clearance, m: not measured (wanted: at least 3.0)" in capsys.readouterr().out
    assert verdict_line(verdict.to_dict()).endswith("no clearance: she never set sail")


@pytest.mark.parametrize(("off_m", "passed"), [(0.9, False), (1.1, True)])
def test_a_buoy_is_not_sailed_over_asked_for_or_not(off_m, passed):
    truth = TrueTrack()
    for t_s in range(31):
        truth.add(float(t_s), (10.0 * t_s, 0.0), 0.0, 1.0, (0.0, 5.0))
    verdict = judged(
        scenario="x",
        seed=1,
        expect=ExpectSpec(),
        truth=truth,
        solid=shapely.Polygon(),
        hull=DOT,
        goal_en_m=(300.0, 0.0),
        summary={"arrived": True},
        status_times_s=None,
        alerts=[],
        marks=(((100.0, off_m), "port"),),
    )
    check = next(c for c in verdict.checks if c.name == "nearest to a mark, m")
    assert (check.passed, check.figure) == (passed, pytest.approx(off_m))


@pytest.mark.parametrize(("held", "within_m"), [((10.0, 20.0), 0.0), ((0.0, 30.0), 75.0), ((100.0, 200.0), None)])
def test_a_boat_that_is_to_hold_is_judged_by_how_far_she_goes_meanwhile(held, within_m):
    """Away for ten seconds at 10 m/s, still for ten, on for ten; and never seen in the time that was asked for."""
    truth = TrueTrack()
    for t_s in range(31):
        truth.add(5.0 + t_s, (10.0 * (min(t_s, 10) + max(0, t_s - 20)), 0.0), 0.0, 1.0, (0.0, 5.0))
    for limit_m in (1.0, 200.0):
        verdict = judged(
            scenario="x",
            seed=1,
            expect=ExpectSpec(held=HeldSpec(from_s=held[0], to_s=held[1], within_m=limit_m)),
            truth=truth,
            solid=shapely.Polygon(),
            hull=DOT,
            goal_en_m=(0.0, 0.0),
            summary={"arrived": True},
            status_times_s=None,
            alerts=[],
            began_s=5.0,
        )
        check = next(c for c in verdict.checks if c.name == "held within, m")
        if within_m is None:
            assert (check.passed, check.figure) == (False, None)
        else:
            assert within_m <= check.figure <= 110.0
            assert check.passed is (check.figure <= limit_m)


def test_a_track_across_an_island_touches_once_even_between_samples():
    far_apart = hulls([[-50.0, 0.0], [50.0, 0.0]])
    assert far_apart.entries(ISLAND) == [1]
    assert far_apart.least_m(ISLAND) == (0.0, 1)


def test_two_crossings_are_two_contacts():
    track = hulls([[-20.0, 0], [0, 0], [20.0, 0], [20.0, 30], [0, 30], [0, 0], [0, -30.0]])
    assert track.entries(ISLAND) == [1, 5]


def test_clearance_is_the_smallest_distance():
    track = hulls(np.column_stack([np.linspace(-50, 50, 400), np.full(400, 17.0)]))
    assert track.entries(ISLAND) == []
    assert track.least_m(ISLAND)[0] == pytest.approx(7.0, abs=0.05)


@pytest.mark.parametrize(("heading_deg", "clearance_m"), [(0.0, 0.0), (90.0, 2.0)])
def test_the_hull_is_what_touches(heading_deg, clearance_m):
    """Three metres off an island a boat of eight by two touches it bow first and passes it broadside."""
    track = hulls([[0.0, 13.0]], heading_deg, LONG)
    least_m, _ = track.least_m(ISLAND)
    assert track.entries(ISLAND) == ([0] if clearance_m == 0.0 else [])
    assert least_m == pytest.approx(clearance_m, abs=0.02)
    assert hulls([[0.0, 13.0]]).least_m(ISLAND)[0] == pytest.approx(3.0, abs=0.02)


def test_what_the_hull_sweeps_between_two_samples_is_touched():
    post = shapely.Point(0.0, 3.9).buffer(0.05)
    assert hulls([[-10.0, 0.0], [10.0, 0.0]], 0.0, LONG).entries(post) == [1]
    assert hulls([[-10.0, 0.0], [10.0, 0.0]], 90.0, LONG).entries(post) == []


def test_the_hull_is_where_the_planes_geometry_has_it():
    """Against an independent way to draw it: a box turned by shapely, whose angles run the other way."""
    rng = np.random.default_rng(4)
    for _ in range(50):
        en, heading = rng.uniform(-25, 25, 2), rng.uniform(-np.pi, np.pi)
        box = shapely.affinity.translate(
            shapely.affinity.rotate(shapely.box(-1.0, -4.0, 1.0, 4.0), -np.degrees(heading), origin=(0, 0)), *en
        )
        assert hulls([en], np.degrees(heading), LONG).least_m(ISLAND)[0] == pytest.approx(
            shapely.distance(box, ISLAND), abs=1e-9
        )


def test_a_boat_that_never_sailed_touched_nothing_and_does_not_pass():
    def verdict(truth):
        return judged(
            scenario="x",
            seed=0,
            expect=ExpectSpec(arrived=None),
            truth=truth,
            solid=ISLAND,
            hull=DOT,
            goal_en_m=(0.0, 99.0),
            summary={},
            status_times_s=None,
            alerts=(),
        )

    assert verdict(_truth([0.0] * 400)).passed is False  # through the island
    away = _truth([0.0] * 400)
    away.en_m = [(50.0, north) for _, north in away.en_m]
    assert verdict(away).passed
    assert not verdict(TrueTrack()).passed


def test_open_water_has_no_clearance():
    assert hulls(np.zeros((3, 2))).entries(shapely.Polygon()) == []
    assert hulls(np.zeros((3, 2))).least_m(shapely.Polygon())[0] == math.inf


def _truth(headings_deg, twd_deg=0.0, step_s=0.25):
    truth = TrueTrack()
    for k, heading in enumerate(headings_deg):
        truth.add(k * step_s, (0.0, float(k)), math.radians(heading), 2.0, (math.radians(twd_deg), 5.0))
    return truth


def test_a_beat_has_tacks_and_a_run_has_gybes():
    beat = [45.0] * 100 + list(np.linspace(45, -45, 12)) + [-45.0] * 100 + list(np.linspace(-45, 45, 12)) + [45.0] * 100
    assert count_tacks(_truth(beat)) == (2, 0)
    run = [150.0] * 100 + list(np.linspace(150, 210, 12)) + [210.0] * 100
    assert count_tacks(_truth(run)) == (0, 1)


def test_tacks_are_counted_on_the_way_only():
    """Past the goal the autopilot loiters as it likes."""
    late = [60.0] * 100 + [-60.0] * 60
    expect = ExpectSpec(arrived=None, within_m=5.0, max_tacks=0)

    def passed(goal_north_m):
        return (
            judged(
                scenario="s",
                seed=0,
                expect=expect,
                truth=_truth(late),
                solid=shapely.Polygon(),
                hull=DOT,
                goal_en_m=(0.0, goal_north_m),
                summary={},
                status_times_s=None,
                alerts=(),
            )
            .checks[-1]
            .passed
        )

    assert passed(50.0)
    assert not passed(500.0)


def test_a_wobble_through_the_wind_is_no_tack():
    assert count_tacks(_truth([10.0] * 40 + [-5.0] * 4 + [10.0] * 40)) == (0, 0)


@settings(max_examples=30)
@given(st.floats(-720.0, 720.0))
def test_turning_the_world_changes_no_count(turn_deg):
    beat = np.array([45.0] * 60 + [-45.0] * 60 + [45.0] * 60)
    assert count_tacks(_truth(beat + turn_deg, twd_deg=turn_deg)) == (2, 0)


def test_silence_counts_both_ends():
    assert longest_silence_s([10.0, 12.0], 0.0, 13.0) == 10.0
    assert longest_silence_s([], 0.0, 30.0) == 30.0


def test_a_verdict_fails_for_each_reason_by_name():
    truth = _truth([45.0] * 20)
    verdict = judged(
        scenario="x",
        seed=1,
        expect=ExpectSpec(arrived=True, contacts=0, within_m=1.0, alerts=("irons",)),
        truth=truth,
        solid=shapely.Point(0, 5).buffer(1.0),
        hull=DOT,
        goal_en_m=(100.0, 0.0),
        summary={"arrived": False},
        status_times_s=[0.0],
        alerts=[],
        errors=["boom"],
    )
    failed = {c.name for c in verdict.checks if not c.passed}
    assert failed == {"no unhandled error", "arrived", "contacts", "distance to the goal, m", "announced irons"}
    assert not verdict.passed


def test_roundings_count_only_on_the_right_side_and_in_order():
    marks = [((0.0, 0.0), "port"), ((200.0, 0.0), "port")]
    anticlockwise = np.array([(20 * math.sin(a), 20 * math.cos(a)) for a in np.linspace(2.5, -2.5, 40)])
    second = anticlockwise + np.array([200.0, 0.0])
    assert count_roundings(np.vstack([anticlockwise, second]), marks) == 2
    assert count_roundings(np.vstack([anticlockwise[::-1], second]), marks) == 1
    assert count_roundings(anticlockwise, marks) == 1
    assert count_roundings(second, marks) == 0


def test_a_board_near_a_mark_and_a_miss_sailed_again_are_not_the_rounding():
    """Buoy course, seed 1: a board clipped the first mark's circle, and the rounding after it was not seen."""
    marks = [((0.0, 0.0), "port"), ((200.0, 0.0), "port")]
    right = np.array([(20 * math.sin(a), 20 * math.cos(a)) for a in np.linspace(2.5, -2.5, 40)])
    second = right + np.array([200.0, 0.0])
    board, away = np.array([(-55.0, 10.0), (-55.0, 5.0)]), np.array([(-90.0, 0.0)])
    assert count_roundings(np.vstack([board, away, right, second]), marks) == 2
    assert count_roundings(np.vstack([right[::-1], away, right, second]), marks) == 2
    assert count_roundings(np.vstack([board, away, second]), marks) == 1
    # in its order: a mark that is only rounded in the next lap costs those between
    assert count_roundings(np.vstack([board, away, second, right, second]), [*marks, *marks]) < 4


def verdict_of(truth, hull=DOT, **how):
    return judged(
        scenario="x",
        seed=0,
        expect=how.pop("expect", ExpectSpec(arrived=None, contacts=9)),
        truth=truth,
        solid=ISLAND,
        hull=hull,
        goal_en_m=(0.0, 99.0),
        summary={},
        status_times_s=None,
        alerts=(),
        **how,
    )


def passes_by(off_m):
    truth = _truth([0.0] * 400)
    truth.en_m = [(10.0 + off_m, north - 200.0) for _, north in truth.en_m]
    return truth


@pytest.mark.parametrize(("off_m", "hull", "keeps"), [(8.2, DOT, True), (7.8, DOT, False), (8.8, LONG, False)])
def test_in_ordinary_weather_the_hull_keeps_the_floor(off_m, hull, keeps):
    assert verdict_of(passes_by(off_m), hull, floor_m=8.0).passed is keeps
    assert verdict_of(passes_by(off_m), hull).passed  # not asked for


def test_the_higher_of_floor_and_expectation_is_asked_for():
    expect = ExpectSpec(arrived=None, min_clearance_m=9.0)
    assert not verdict_of(passes_by(8.5), floor_m=8.0, expect=expect).passed
    assert verdict_of(passes_by(9.5), floor_m=8.0, expect=expect).passed


@pytest.mark.parametrize(
    ("called_at_s", "passed"), [((), False), ((10.0,), False), ((0.0, 60.0), True), ((200.0,), False), (None, True)]
)
def test_a_contact_is_announced_in_time(called_at_s, passed):
    """The track of 100 s touches at 50 s."""
    truth = passes_by(-5.0)
    expect = ExpectSpec(arrived=None, contacts=9, called_s=45.0)
    assert verdict_of(truth, expect=expect, called_at_s=called_at_s).passed is passed
    assert verdict_of(passes_by(5.0), expect=expect, called_at_s=()).passed


@pytest.mark.parametrize(
    ("event", "ordinary"),
    [
        (EventSpec(at_s=1.0, kind="wind_speed", tws_mps=13.0), True),
        (EventSpec(at_s=1.0, kind="wind_shift", veer_deg=40.0), True),
        (EventSpec(at_s=1.0, kind="wind_shift", veer_deg=-120.0), False),
        (EventSpec(at_s=1.0, kind="link_cut", for_s=1.2), True),
        (EventSpec(at_s=1.0, kind="link_cut", for_s=30.0), False),
        (EventSpec(at_s=1.0, kind="link_cut"), False),
        (EventSpec(at_s=1.0, kind="link_quality", loss=0.1, delay_s=1.5), True),
        (EventSpec(at_s=1.0, kind="link_quality", loss=0.6), False),
        (EventSpec(at_s=1.0, kind="gps_jump", east_m=30.0), False),
        (EventSpec(at_s=1.0, kind="mode", mode="HOLD"), False),
    ],
)
def test_what_is_ordinary(event, ordinary):
    assert is_ordinary(event) is ordinary

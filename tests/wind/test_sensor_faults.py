"""The detectors of a wind sensor's faults, each on both sides of each of its thresholds, and against an oracle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.messages import ApparentWind, VehicleState, WindQuality, WindSample, WindSource
from companion.wind import VaneParameters, WindVerdict
from companion.wind.sensor_faults import FrozenVane, Spikes, TackOffset, WindWatch
from tests.wind.boat import HERE

DEG = math.radians(1.0)


# -------------------------------------------------------------------------------------------- a frozen vane
def frozen(readings):
    """Feed (t, vane [deg], heading [deg]); return (is_suspect, is_frozen) after the last."""
    vane = FrozenVane()
    for t, awa, heading in readings:
        assert vane.update(1000.0 + t, awa * DEG, heading * DEG) is vane.is_frozen
    return vane.is_suspect, vane.is_frozen


@pytest.mark.parametrize("about_deg", [0.0, 175.0])  # of the compass: a swing over the south is a swing
@pytest.mark.parametrize(
    ("swing_deg", "found"),
    [(5.9, (False, False)), (6.1, (True, False)), (19.9, (True, False)), (20.1, (True, True)), (-20.1, (True, True))],
)
def test_a_vane_that_stands_while_she_swings_is_suspect_from_6_and_frozen_from_20_degrees(about_deg, swing_deg, found):
    readings = [(0.0, 40.0, about_deg), (1.5, 40.1, about_deg + 0.5 * swing_deg), (3.0, 40.0, about_deg + swing_deg)]
    assert frozen(readings) == found


def test_the_swing_is_from_its_farthest_on_either_side():
    assert frozen([(0.0, 40.0, 0.0), (1.0, 40.0, 11.0), (2.0, 40.0, -11.0), (3.0, 40.0, 0.0)]) == (True, True)
    assert frozen([(0.0, 40.0, 0.0), (1.0, 40.0, 11.0), (2.0, 40.0, 11.0), (3.0, 40.0, 0.0)]) == (True, False)


@pytest.mark.parametrize(("last_s", "is_frozen"), [(2.9, False), (3.0, True)])
def test_it_stands_for_three_seconds_at_least(last_s, is_frozen):
    assert frozen([(0.0, 40.0, 0.0), (last_s, 40.1, 30.0)]) == (True, is_frozen)


@pytest.mark.parametrize(("awa_deg", "moves"), [(0.39, False), (0.41, True), (-0.39, False), (-0.41, True)])
def test_a_vane_has_moved_by_more_than_0_4_degrees_from_where_it_stood(awa_deg, moves):
    around = [(0.0, 179.9, 0.0), (2.0, 179.9 + awa_deg, 15.0), (4.0, 179.9 + awa_deg, 30.0)]
    assert frozen(around) == (True, not moves)  # 15 degrees under it since it moved, or 30 in all
    creeping = [(float(n), 10.0 + 0.3 * n, 15.0 * n) for n in range(8)]  # each step too small to see
    assert frozen(creeping) == (True, False)


def test_each_move_begins_a_new_swing_from_the_heading_of_then():
    vane = FrozenVane()
    for t, awa, heading in [(0.0, 40.0, 0.0), (5.0, 40.0, 60.0)]:
        vane.update(t, awa * DEG, heading * DEG)
    assert vane.is_frozen
    assert not vane.update(6.0, 50.0 * DEG, 60.0 * DEG)
    assert not vane.is_suspect
    assert not vane.update(10.0, 50.0 * DEG, 65.0 * DEG)
    assert not vane.is_suspect
    assert vane.update(11.0, 50.0 * DEG, 80.5 * DEG)


@pytest.mark.parametrize("about_deg", [0.0, 100.0, 179.0])
@pytest.mark.parametrize(
    ("last_s", "swing_deg", "is_silent"), [(20.0, 5.1, True), (19.9, 5.1, False), (20.0, 4.9, False)]
)
def test_the_very_same_angle_for_20_s_while_she_swings_by_5_is_no_reading(last_s, swing_deg, is_silent, about_deg):
    same = [(0.0, 40.0, 0.0), (5.0, 40.0, swing_deg - 2.0), (10.0, 40.0, -2.0), (last_s, 40.0, 0.0)]
    same = [(t, awa, about_deg + heading) for t, awa, heading in same]
    assert frozen(same)[1] is is_silent
    jitter = [(t, awa + 1e-3 * (n % 2), heading) for n, (t, awa, heading) in enumerate(same)]
    assert not frozen(jitter)[1]


def test_a_swing_before_it_repeated_itself_does_not_count():
    before = [(0.0, 40.0, 0.0), (1.0, 40.1, 10.0), (2.0, 40.0, 0.0)]
    repeats = [(2.0 + n, 40.2, 0.0 if n % 2 else 3.0) for n in range(1, 40)]
    assert not frozen(before + repeats)[1]
    assert frozen(before + [(t, awa, 2.0 * heading) for t, awa, heading in repeats])[1]


def test_a_rest_forgets():
    vane = FrozenVane()
    vane.update(0.0, 0.7, 0.0)
    vane.update(5.0, 0.7, 1.0)
    assert (vane.is_suspect, vane.is_frozen) == (True, True)
    vane.rest()
    assert (vane.is_suspect, vane.is_frozen) == (False, False)
    assert not vane.update(6.0, 0.7, 2.0)
    assert not vane.is_suspect


# --------------------------------------------------------------------------------------------------- spikes
def after_calm(off_deg, *, seconds, about_deg=170.0, wander_deg=0.0):
    """Whether a reading ``off_deg`` away is a spike after so many seconds of a wind that wanders to either side."""
    spikes = Spikes()
    for t in range(seconds):
        spikes.update(float(t), (about_deg + wander_deg * (-1) ** t) * DEG)
    return spikes.update(float(seconds), (about_deg + off_deg) * DEG)


@pytest.mark.parametrize(
    ("off_deg", "seconds", "wander_deg", "is_spike"),
    [
        (47.0, 1, 0.0, False),  # six times the 8 degrees that a wind departs from its mean to begin with
        (49.0, 1, 0.0, True),
        (44.0, 300, 0.0, False),  # later 45 degrees
        (46.0, 300, 0.0, True),
        (-46.0, 300, 0.0, True),
        (85.0, 600, 20.0, False),  # six times what it departs
        (150.0, 600, 20.0, True),
    ],
)
def test_a_spike_is_farther_off_than_the_wind_departs(off_deg, seconds, wander_deg, is_spike):
    assert after_calm(off_deg, seconds=seconds, wander_deg=wander_deg) is is_spike


@pytest.mark.parametrize(("dt_s", "spikes"), [(1.0, 3), (0.5, 7), (3.0, 1), (5.0, 1)])
def test_what_stays_for_four_seconds_is_a_shift_and_was_none(dt_s, spikes):
    watch = Spikes()
    for n in range(100):
        watch.update(n * dt_s, 0.0)
    said = [watch.update((100 + n) * dt_s, 120.0 * DEG) for n in range(10)]
    assert said == [True] * spikes + [False] * (10 - spikes)
    assert watch.share == 0.0
    assert not watch.is_spiking
    assert not watch.update(110 * dt_s, 120.0 * DEG)
    back = [watch.update((111 + n) * dt_s, 0.0) for n in range(10)]  # the wind is there now, and goes back as slowly
    assert back == said


def test_a_shift_gives_back_the_share_that_was_before_it():
    watch = Spikes()
    for t in range(200):
        watch.update(float(t), math.pi * (t % 10 == 9))
    before = watch.share
    for t in range(200, 208):
        watch.update(float(t), 0.0)
    kept = watch.share
    for t in range(208, 212):
        watch.update(float(t), 90.0 * DEG)
    assert watch.share == pytest.approx(kept)
    assert watch.share < before


@settings(max_examples=30, deadline=None)
@given(lone=st.lists(st.booleans(), min_size=20, max_size=200), dt_s=st.sampled_from([0.5, 1.0, 2.0]))
def test_the_share_is_a_mean_of_a_minute_and_the_verdict_has_two_thresholds(lone, dt_s):
    watch, share, is_spiking = Spikes(), 0.0, False
    watch.update(0.0, 1.0)
    far = False
    for n, wanted in enumerate(lone, 1):
        far = wanted and not far  # never two on end
        assert watch.update(n * dt_s, 1.0 + math.pi * far) is far
        share += (1.0 - math.exp(-dt_s / 60.0)) * (float(far) - share)
        if is_spiking or not far:
            is_spiking = share > (0.02 if is_spiking else 0.04)
        assert watch.share == pytest.approx(share)
        assert watch.is_spiking is is_spiking


@pytest.mark.parametrize(("gap_s", "is_spike"), [(10.0, True), (10.1, False), (60.0, False)])
def test_after_ten_seconds_of_silence_the_wind_may_be_anywhere(gap_s, is_spike):
    watch = Spikes()
    for t in range(100):
        watch.update(float(t), 0.0)
    watch.update(99.0 + gap_s, 100.0 * DEG)
    later = watch.update(99.0 + gap_s + 1.0, 100.0 * DEG)
    again = Spikes()
    for t in range(100):
        again.update(float(t), 0.0)
    assert again.update(99.0 + gap_s, 100.0 * DEG) is is_spike
    assert not later


def test_the_verdict_of_many_is_taken_back_below_two_in_a_hundred():
    watch = Spikes()
    for t in range(100):
        watch.update(float(t), math.pi * (t % 5 == 4))
    lasts, share = 0, watch.share
    while watch.is_spiking:
        lasts += 1
        watch.update(99.0 + lasts, 0.0)
    assert share > 0.1
    assert lasts == math.ceil(60.0 * math.log(share / 0.02))


@pytest.mark.parametrize(("off_deg", "is_spike"), [(93.0, False), (105.0, True)])
def test_how_far_the_wind_departs_is_learned_within_a_minute(off_deg, is_spike):
    assert after_calm(off_deg, seconds=60, wander_deg=20.0) is is_spike


@pytest.mark.parametrize("about_deg", [0.0, 90.0, 200.0])
def test_the_mean_that_a_spike_is_held_against_follows_in_five_seconds(about_deg):
    watch = Spikes()
    for t in range(100):
        watch.update(float(t), about_deg * DEG)
    watch.update(
        100.0, (about_deg + 40.0) * DEG
    )  # the mean goes a fifth of the way: by the sines and cosines, 7.3 degrees
    share = 1.0 - math.exp(-0.2)
    mean = math.atan2(share * math.sin(40.0 * DEG), 1.0 - share + share * math.cos(40.0 * DEG))
    for off, is_spike in ((44.0, False), (46.0, True), (-44.0, False), (-46.0, True)):
        other = Spikes()
        other.__dict__.update(watch.__dict__)
        other._rough_rad = 0.0
        assert other.update(101.0, about_deg * DEG + mean + off * DEG) is is_spike


# ---------------------------------------------------------------------------------------------- tacks compared
TRUE = (0.0, 6.0)  # the wind's from-vector
PRIOR = 9.0 * DEG


class Oracle:
    """Least squares over what each tack showed, as the class describes it, from whole legs of a steady wind."""

    def __init__(self):
        self.rows = []

    def tack(self, before, after):
        matrix = np.array([after[2:4] - before[2:4], after[4:6] - before[4:6]]).T
        self.rows.append((matrix, after[:2] - before[:2], 0.12 * math.hypot(*after[:2])))

    def solution(self):
        normal, right = np.eye(2) / PRIOR**2, np.zeros(2)
        for age, (matrix, step, unrest) in enumerate(reversed(self.rows)):
            normal = normal + 0.93**age * matrix.T @ matrix / unrest**2
            right = right + 0.93**age * matrix.T @ step / unrest**2
        inverse = np.linalg.inv(normal)
        return inverse @ right, np.sqrt(np.diag(inverse))


def leg(side, vane_rad, wide_rad, velocity):
    """Return what a leg shows: the wind computed of a vane that is off, to first order, and its derivatives."""
    apparent = np.array(TRUE) + velocity
    turned_by = np.array([apparent[1], -apparent[0]])
    wind = np.array(TRUE) + vane_rad * turned_by + side * wide_rad * turned_by
    seen = wind + velocity
    by_seen = np.array([seen[1], -seen[0]])
    return np.array([*wind, *by_seen, *(side * by_seen)])


def beat(tacks, *, vane_rad=0.0, wide_rad=0.0, leg_s=60, awa_deg=40.0, wind_scale=1.0, boat_mps=1.5):
    """Sail that many legs; return the detector and the oracle."""
    watch, oracle, before, t = TackOffset(), Oracle(), None, 1000.0
    for n in range(tacks):
        side = 1 if n % 2 == 0 else -1
        velocity = np.array([-side * (boat_mps + 0.1 * n), 1.5])
        shown = leg(side, vane_rad, wide_rad, velocity) * 1.0
        for _ in range(leg_s):
            t += 1.0
            watch.update(t, tuple(wind_scale * shown[:2]), tuple(velocity), side * awa_deg * DEG, is_turning=False)
        if before is not None:
            oracle.tack(before, shown)
        before = shown
    return watch, oracle


@settings(max_examples=6, deadline=None)
@given(vane=st.floats(-0.3, 0.3), wide=st.floats(-0.3, 0.3), tacks=st.integers(2, 6))
def test_what_the_tacks_tell_of_the_vane_is_least_squares(vane, wide, tacks):
    watch, oracle = beat(tacks, vane_rad=vane, wide_rad=wide)
    assert watch.tacks == tacks - 1
    if tacks < 3:
        assert (watch.offset_rad, watch.side_rad, watch.sure_rad, watch.is_misaligned) == (None, None, 0.0, False)
        return
    (offset, side), error = oracle.solution()
    assert watch.offset_rad == pytest.approx(offset, abs=1e-9)
    assert watch.side_rad == pytest.approx(side, abs=1e-9)
    sure = sum(abs(v) for v, s in zip((offset, side), error, strict=True) if abs(v) > max(4.0 * DEG, 3.0 * s))
    assert watch.sure_rad == pytest.approx(sure, abs=1e-9)
    assert watch.is_misaligned == (sure > 0.0)


@pytest.mark.parametrize(
    ("change", "tacks"),
    [
        ({}, 1),
        ({"leg_s": 29}, 1),  # ten seconds to settle, and the weight of fifteen: nineteen on end
        ({"leg_s": 28}, 0),
        ({"leg_s": 121}, 1),
        ({"awa_deg": 12.1}, 1),
        ({"awa_deg": 11.9}, 0),
        ({"awa_deg": 129.0}, 1),
        ({"awa_deg": 131.0}, 0),
        ({"wind_scale": 0.26}, 1),
        ({"wind_scale": 0.24}, 0),
    ],
)
def test_what_counts_as_a_tack_to_compare(change, tacks):
    assert beat(2, **change)[0].tacks == tacks


@pytest.mark.parametrize(("busy_s", "tacks"), [(0, 1), (30, 1), (93, 1), (94, 0)])
def test_a_leg_that_follows_late_is_not_compared(busy_s, tacks):
    """After two minutes the wind itself has had time to change."""
    watch, t = TackOffset(), 0.0
    for side in (1, -1):
        for n in range(60 if side == 1 else busy_s + 40):
            t += 1.0
            watch.update(t, TRUE, (-1.5 * side, 1.5), side * 0.7, is_turning=side == -1 and n < busy_s)
    assert watch.tacks == tacks


@pytest.mark.parametrize(("error_deg", "is_said"), [(3.9, False), (4.4, True)])
def test_an_error_below_four_degrees_is_none_however_sure(error_deg, is_said):
    watch, oracle = beat(12, vane_rad=error_deg * DEG, boat_mps=8.0)
    (offset, _), (error, _) = oracle.solution()
    assert abs(offset) > 3.0 * error
    assert watch.is_misaligned is is_said


@pytest.mark.parametrize(("apart_s", "readings", "tacks"), [(8.0, 6, 1), (8.0, 5, 0), (-1.0, 60, 0)])
def test_a_reading_stands_for_five_seconds_at_the_most(apart_s, readings, tacks):
    watch, t = TackOffset(), 1000.0
    for side in (1, -1):
        for _ in range(60 if side == 1 else readings):
            t += 1.0 if side == 1 else apart_s
            watch.update(t, TRUE, (-1.5 * side, 1.5), side * 0.7, is_turning=False)
    assert watch.tacks == tacks


@pytest.mark.parametrize(("last_s", "tacks"), [(25, 0), (26, 1)])
def test_a_leg_is_compared_after_25_s_however_its_readings_come(last_s, tacks):
    watch = TackOffset()
    for t in range(60):
        watch.update(1000.0 + t, TRUE, (-1.5, 1.5), 0.7, is_turning=False)
    for t in (0, 5, *range(10, last_s + 1)):
        watch.update(1060.0 + t, TRUE, (1.5, 1.5), -0.7, is_turning=False)
    assert watch.tacks == tacks


@pytest.mark.parametrize(("quiet_s", "is_counted"), [(27, False), (28, True)])
def test_ten_seconds_after_a_turn_the_wind_is_believed_again(quiet_s, is_counted):
    watch, t = TackOffset(), 0.0
    for side in (1, -1):
        for n in range(60 if side == 1 else 20 + quiet_s):
            t += 1.0
            watch.update(t, TRUE, (-1.5 * side, 1.5), side * 0.7, is_turning=side == -1 and n < 20)
    assert (watch.tacks == 1) is is_counted


# --------------------------------------------------------------------------------------------------- the judge
def boat(t_s, heading_deg=0.0, speed_mps=2.0):
    heading = heading_deg * DEG
    velocity = speed_mps * math.sin(heading), speed_mps * math.cos(heading)
    return VehicleState(t_s=t_s, boot_s=t_s, position=HERE, velocity_en_mps=velocity, heading_rad=heading)


def wind(t_s, twd_deg=40.0, tws_mps=6.0, **changes):
    made = WindSample(t_s=t_s, twd_from_rad=twd_deg * DEG, tws_mps=tws_mps, source=WindSource.SIMULATED)
    return replace(made, **changes)


def quiet(parameters=None, *, seconds=20):
    """Return a watch that has judged so many good readings of a wind that is never the same."""
    watch = WindWatch(parameters)
    for t in range(seconds):
        watch.vehicle(boat(float(t)))
        watch.judge(wind(float(t), 40.0 + 0.1 * (t % 3)))
    return watch


@pytest.mark.parametrize(
    ("turn_deg", "apart_s", "after_s", "is_turning"),
    [
        (24.9, 5.0, 0.0, False),
        (25.1, 5.0, 0.0, True),
        (-25.1, 5.0, 0.0, True),
        (30.0, 9.9, 0.0, True),
        (30.0, 5.0, 1.9, True),
        (30.0, 5.0, 2.0, False),
    ],
)
def test_a_turn_is_25_degrees_in_ten_seconds_and_two_after_it(turn_deg, apart_s, after_s, is_turning):
    watch = WindWatch()
    watch.vehicle(boat(100.0, 170.0))
    watch.vehicle(boat(100.0 + apart_s, 170.0 + turn_deg))
    status = watch.judge(wind(100.0 + apart_s + after_s))
    assert (WindVerdict.TURNING in status.verdicts) is is_turning
    assert (status.weight, status.speed_weight) == ((0.3, 0.3) if is_turning else (1.0, 1.0))


def test_a_turn_of_longer_than_ten_seconds_is_a_bend():
    watch = WindWatch()
    for n in range(40):
        watch.vehicle(boat(float(n), 2.4 * n))
    assert watch.judge(wind(40.0)).is_good
    for n in range(40, 80):
        watch.vehicle(boat(float(n), 2.6 * n))
    assert not watch.judge(wind(80.0)).is_good


def test_a_clock_that_was_set_back_turns_no_boat():
    watch = WindWatch()
    watch.vehicle(boat(1000.0, 0.0))
    watch.vehicle(boat(10.0, 90.0))
    assert watch.judge(wind(10.0)).is_good
    watch.vehicle(boat(12.0, 120.0))
    assert not watch.judge(wind(12.0)).is_good


def test_what_a_sample_says_of_itself_counts():
    assert quiet().judge(wind(20.0, quality=WindQuality.TURNING)).verdicts == (WindVerdict.TURNING,)


@pytest.mark.parametrize(("frozen_s", "widening"), [(0.0, 1.5 + 1.0 / 60.0), (30.0, 2.0), (90.0, 3.0), (150.0, 3.0)])
def test_the_longer_a_vane_has_been_frozen_the_wider(frozen_s, widening):
    watch = quiet()
    watch.vehicle(boat(20.0))
    watch.apparent(ApparentWind(t_s=20.0, awa_rad=0.7, aws_mps=6.0))
    watch.vehicle(boat(24.0, 22.0))
    watch.apparent(ApparentWind(t_s=24.0, awa_rad=0.7, aws_mps=6.0))
    first = watch.judge(wind(24.0))
    assert (first.verdicts, first.weight) == ((WindVerdict.FROZEN,), 0.0)
    t, n = 24.0, 0
    while t < 24.0 + frozen_s:
        t, n = t + 2.0, n + 1
        watch.vehicle(boat(t, 22.0))
        watch.apparent(ApparentWind(t_s=t, awa_rad=0.7, aws_mps=6.0))
        first = watch.judge(wind(t, 40.0 + 0.1 * (n % 3)))
    assert first.widening == pytest.approx(widening)


def test_a_vane_that_is_suspect_moves_nothing_and_is_no_verdict():
    watch = quiet()
    for t, heading in ((20.0, 0.0), (21.0, 10.0)):
        watch.vehicle(boat(t, heading))
        watch.apparent(ApparentWind(t_s=t, awa_rad=0.7, aws_mps=6.0))
    status = watch.judge(wind(21.0))
    assert (status.is_good, status.weight, status.widening) == (True, 0.0, 1.0)


@pytest.mark.parametrize(("late_s", "is_known"), [(2.9, True), (3.0, False)])
def test_a_vane_that_is_heard_no_more_is_not_frozen(late_s, is_known):
    watch = quiet()
    for t, heading in ((20.0, 0.0), (24.0, 22.0)):
        watch.vehicle(boat(t, heading))
        watch.apparent(ApparentWind(t_s=t, awa_rad=0.7, aws_mps=6.0))
    assert (WindVerdict.FROZEN in watch.judge(wind(24.0 + late_s)).verdicts) is is_known


@pytest.mark.parametrize(("aws_mps", "apart_s", "is_frozen"), [(1.0, 1.5, True), (0.9, 0.0, False), (6.0, 1.6, False)])
def test_little_wind_and_a_heading_of_another_moment_tell_nothing_of_a_vane(aws_mps, apart_s, is_frozen):
    watch = quiet()
    for t, heading in ((20.0, 0.0), (24.0, 30.0)):
        watch.vehicle(boat(t - apart_s, heading))
        watch.apparent(ApparentWind(t_s=t, awa_rad=0.7, aws_mps=aws_mps))
    assert (WindVerdict.FROZEN in watch.judge(wind(24.0)).verdicts) is is_frozen


@pytest.mark.parametrize(
    ("gap_s", "after_s", "widening"),
    [
        (10.0, 0.0, None),
        (10.1, 0.0, 1.0 + 10.1 / 300.0),
        (150.0, 0.0, 1.5),
        (150.0, 15.0, 1.25),
        (600.0, 0.0, 2.0),
        (150.0, 29.0, 1.0 + 0.5 / 30.0),
        (150.0, 30.0, None),
    ],
)
def test_after_a_silence_of_more_than_ten_seconds_the_band_is_wider_for_thirty(gap_s, after_s, widening):
    watch = quiet()
    status, back_s = watch.judge(wind(19.0 + gap_s, 40.5)), 19.0 + gap_s
    for n in range(1, int(after_s) + 1):
        status = watch.judge(wind(back_s + n, 40.0 + 0.1 * (n % 3)))
    assert (WindVerdict.RETURNED in status.verdicts) is (widening is not None)
    assert status.widening == pytest.approx(1.0 if widening is None else widening)


@pytest.mark.parametrize(
    ("zero_s", "speed_mps", "felt_mps", "felt_age_s", "lacks"),
    [
        (9, 2.0, None, 0.0, False),
        (10, 2.0, None, 0.0, True),
        (10, 0.5, None, 0.0, False),
        (10, 0.6, None, 0.0, True),
        (10, 2.0, 2.9, 0.0, False),  # she feels a wind as fast as she goes: a calm
        (10, 2.0, 3.1, 0.0, True),
        (10, 2.0, 0.5, 0.0, False),
        (10, 2.0, 0.0, 0.0, True),  # nothing at all is no wind as fast as she goes
        (10, 2.0, 2.9, 3.0, True),
        (10, 2.0, 2.9, 2.9, False),
    ],
)
def test_a_speed_of_nothing_for_ten_seconds_on_a_boat_that_moves(zero_s, speed_mps, felt_mps, felt_age_s, lacks):
    watch = quiet()
    for n in range(zero_s):
        t = 20.0 + n
        watch.vehicle(boat(t, 0.0, speed_mps))
        if felt_mps is not None:
            watch.apparent(ApparentWind(t_s=t - felt_age_s, awa_rad=0.7 + 0.1 * (n % 2), aws_mps=felt_mps))
        status = watch.judge(wind(t, 40.0 + 0.1 * (n % 3), 0.0))
    assert (WindVerdict.NO_SPEED_SENSOR in status.verdicts) is lacks
    if lacks:
        assert status.extra_sigma_rad == pytest.approx(math.atan2(speed_mps, 3.0))
        assert WindVerdict.CALM not in status.verdicts


def test_a_sensor_that_is_known_is_asked_no_more():
    known = VaneParameters(vane_type=4, speed_type=4)
    watch = quiet(known)
    for n in range(40):
        watch.vehicle(boat(20.0 + n))
        status = watch.judge(wind(20.0 + n, 40.0 + 0.1 * (n % 3), 0.0))
    assert WindVerdict.NO_SPEED_SENSOR not in status.verdicts
    none = quiet(VaneParameters(vane_type=4, speed_type=0)).judge(wind(20.0))
    assert none.verdicts == (WindVerdict.NO_SPEED_SENSOR,)
    assert none.extra_sigma_rad == pytest.approx(math.atan2(2.0, 3.0))
    nobody = WindWatch(VaneParameters(vane_type=4, speed_type=0)).judge(wind(20.0))
    assert nobody.extra_sigma_rad == pytest.approx(math.atan2(1.0, 3.0))  # a metre a second, where she is not heard


def test_what_is_not_known_adds_up_by_squares():
    both = quiet(VaneParameters(vane_type=2, speed_type=0)).judge(wind(20.0))
    assert both.verdicts == (WindVerdict.NO_SPEED_SENSOR, WindVerdict.SYNTHESISED)
    assert both.extra_sigma_rad == pytest.approx(math.hypot(math.atan2(2.0, 3.0), 45.0 * DEG))


def held(seconds, *, watch=None, source=WindSource.AUTOPILOT_TRUE, heading=lambda n: 0.0, speed_mps=0.0, felt=None):
    """Judge the very same true wind for so long; return the last status."""
    watch = watch or WindWatch(VaneParameters(vane_type=4, speed_type=4))
    for n in range(seconds + 1):
        t = 50.0 + n
        if speed_mps is not None:
            watch.vehicle(boat(t, heading(n), speed_mps))
        if felt is not None:
            watch.apparent(replace(felt, t_s=t))
        status = watch.judge(wind(t, 40.0, 6.0, source=source))
    return status


@pytest.mark.parametrize(
    ("seconds", "change", "is_held"),
    [
        (9, {"speed_mps": 2.0}, False),
        (10, {"speed_mps": 2.0}, True),
        (10, {"speed_mps": 2.0, "source": WindSource.APPARENT}, False),
        (60, {"speed_mps": 0.3}, False),
        (60, {"speed_mps": 0.31}, True),
        (60, {"heading": lambda n: 0.9 * (n > 2)}, False),
        (60, {"heading": lambda n: 1.1 * (n == 3)}, True),  # she turned, if only once
        (60, {"heading": lambda n: 100.0 + 0.9 * (n > 2)}, False),
        (60, {"heading": lambda n: 179.9 + 0.9 * (n > 2)}, False),
        (19, {"speed_mps": None}, False),  # where her motion is not known it takes twenty seconds
        (20, {"speed_mps": None}, True),
    ],
)
def test_the_same_true_wind_for_ten_seconds_on_a_boat_that_moves_is_an_old_one(seconds, change, is_held):
    status = held(seconds, **change)
    assert (WindVerdict.HELD in status.verdicts) is is_held
    if is_held:
        assert status.widening == pytest.approx(1.0 + min(2.0, seconds / 60.0))
        assert (status.weight, status.speed_weight) == (0.0, 0.0)


def test_the_band_of_an_old_wind_is_three_times_as_wide_at_the_most():
    assert held(300, speed_mps=2.0).widening == 3.0


@pytest.mark.parametrize(
    ("awa_deg", "aws_mps", "is_held"),
    [
        (49.9, 6.0, False),
        (50.1, 6.0, True),
        (30.1, 6.0, False),
        (29.9, 6.0, True),
        (40.0, 6.4, False),
        (40.0, 6.6, True),
        (40.0, 5.6, False),
        (40.0, 5.4, True),
    ],
)
def test_vane_and_anemometer_that_make_the_same_wind_are_no_old_one(awa_deg, aws_mps, is_held):
    swings = {"heading": lambda n: 1.1 * (n == 3)}
    felt = ApparentWind(t_s=0.0, awa_rad=awa_deg * DEG, aws_mps=aws_mps)
    status = held(15, felt=felt, **swings)
    assert (WindVerdict.HELD in status.verdicts) is is_held
    if is_held:  # its direction is not believed, and its speed is what the anemometer has
        assert (status.weight, status.speed_weight) == (0.0, 1.0)
        assert status.sample.tws_mps == pytest.approx(aws_mps)


@pytest.mark.parametrize(("aws_mps", "age_s", "is_held"), [(0.9, 0.0, True), (1.0, 0.0, False), (0.9, 3.0, False)])
def test_below_the_least_speed_of_the_vane_the_wind_is_held(aws_mps, age_s, is_held):
    watch = WindWatch(VaneParameters(vane_type=4, speed_type=4, speed_min_mps=1.0))
    watch.apparent(ApparentWind(t_s=50.0 - age_s, awa_rad=0.5, aws_mps=aws_mps))
    status = watch.judge(wind(50.0, source=WindSource.AUTOPILOT_TRUE))
    assert (WindVerdict.HELD in status.verdicts) is is_held


def test_a_vane_in_too_little_wind_is_not_told_to_have_stood_still():
    watch = quiet()
    for t, heading, aws_mps in ((20.0, 0.0, 6.0), (24.0, 30.0, 0.5), (25.0, 31.0, 6.0)):
        watch.vehicle(boat(t, heading))
        watch.apparent(ApparentWind(t_s=t, awa_rad=0.7, aws_mps=aws_mps))
    assert WindVerdict.FROZEN not in watch.judge(wind(25.0)).verdicts


def test_the_tacks_are_compared_by_the_wind_that_is_judged():
    watch, apart = WindWatch(), TackOffset()
    for n in range(400):
        t, side = float(n), (1.0 if n % 160 < 80 else -1.0)
        here, seen = boat(t, 100.0 - 40.0 * side, 3.0), wind(t, 100.0 + 6.0 * side + 0.1 * (n % 3), 6.0 + 0.3 * side)
        felt = ApparentWind(t_s=t, awa_rad=side * (0.7 + 0.01 * (n % 3)), aws_mps=7.0)
        watch.vehicle(here)
        watch.apparent(felt)
        turning = WindVerdict.TURNING in watch.judge(seen).verdicts
        vector = seen.tws_mps * math.sin(seen.twd_from_rad), seen.tws_mps * math.cos(seen.twd_from_rad)
        apart.update(t, vector, here.velocity_en_mps, felt.awa_rad, is_turning=turning)
    assert watch.tacks.tacks == apart.tacks == 4
    assert watch.tacks.offset_rad == pytest.approx(apart.offset_rad)
    assert watch.tacks.side_rad == pytest.approx(apart.side_rad)
    assert abs(apart.offset_rad) + abs(apart.side_rad) > 0.02


def test_a_contradicted_vane_moves_nothing_and_doubles_the_band():
    watch = quiet()
    watch.contradicted = "the boat does not sail by it"
    status = watch.judge(wind(20.0))
    assert (status.verdicts, status.widening, status.weight) == ((WindVerdict.TURNED,), 2.0, 0.0)
    assert status.reason == "the boat does not sail by it"


@pytest.mark.parametrize(("tws_mps", "is_asked"), [(1.9, False), (2.1, True)])
def test_only_in_a_wind_of_twice_a_light_one_is_a_reading_a_spike(tws_mps, is_asked):
    watch = WindWatch()
    for t in range(60):
        watch.judge(wind(float(t), 40.0 + 0.1 * (t % 3), tws_mps))
    assert (watch.judge(wind(60.0, 200.0, tws_mps)).weight == 0.0) is is_asked


@pytest.mark.parametrize(("every", "widening"), [(3, 2.0), (12, None)])
def test_the_more_spikes_the_wider_to_twice_at_most(every, widening):
    watch = WindWatch()
    for t in range(300):
        status = watch.judge(wind(float(t), 40.0 + 180.0 * (t % every == every - 1)))
    assert WindVerdict.SPIKING in status.verdicts
    share = watch._spikes.share
    assert status.widening == pytest.approx(1.0 + min(1.0, 4.0 * share))
    assert status.widening == pytest.approx(widening or 1.0 + 4.0 / 12.0, rel=0.05)


@pytest.mark.parametrize(
    ("late_s", "vane_late_s", "is_compared"), [(0.0, 0.0, True), (1.6, 1.6, False), (0.0, 1.6, True)]
)
def test_tacks_are_compared_of_readings_of_one_instant(late_s, vane_late_s, is_compared):
    """By the vane where it is heard at that instant, else by the angle that she must have felt."""
    watch = WindWatch()
    for n in range(160):
        t, side = float(n), (1.0 if n < 80 else -1.0)
        watch.vehicle(boat(t - late_s, -40.0 * side))
        watch.apparent(ApparentWind(t_s=t - vane_late_s, awa_rad=side * (0.7 + 0.01 * (n % 3)), aws_mps=7.0))
        watch.judge(wind(t, 0.5 * (n % 3), 6.0))
    assert (watch.tacks.tacks == 1) is is_compared

"""Shoals drawn from seeds: repeatable, the judge of a turn, and false bottoms that are none."""

import numpy as np
import pytest

from companion.geo.frame import LocalFrame
from companion.mavlink.wire import Sounder
from companion.messages import GeoPoint
from companion.skipper.behaviors import TURN_S
from lab.campaigns.shoals import (
    DRAFT_M,
    GOAL_M,
    LEAST_DEPTH_M,
    as_text,
    could_have_turned,
    draw,
    good_hour,
    job_of,
    sail,
)
from sitl.scenario import scenario_seabed
from sitl.world import Bank, Seabed

FRAME = LocalFrame(GeoPoint(lat_deg=50.817, lon_deg=-1.31))


def over(level_m, across_m, *, mps=3.0, every_s=1.0):
    """Return a bar right across a straight track north, and the track until the keel strikes."""
    bar = Bank(en_m=(0.0, 300.0), along_m=5000.0, across_m=across_m, bearing_rad=np.pi / 2.0, top_m=0.0)
    seabed = Seabed(frame=FRAME, level_m=level_m, banks=(bar,))
    t_s = np.arange(0.0, 300.0 / mps, every_s)
    places = np.column_stack([np.zeros(len(t_s)), mps * t_s])
    end = int(np.argmax(seabed.depth_m(places, t_s) < DRAFT_M))
    return seabed, t_s[: end + 1].tolist(), [tuple(p) for p in places[: end + 1].tolist()]


def test_a_seed_draws_the_same_bank_which_is_on_the_way_and_strikes():
    assert draw(3) == draw(3) != draw(4)
    for seed in range(50):
        seabed = scenario_seabed(draw(seed), job_of("bank", seed).scenario, FRAME)
        bank = seabed.banks[0]
        assert float(seabed.depth_m([bank.en_m], 0.0)[0]) < DRAFT_M
        ends = seabed.depth_m([(0.0, 0.0), (0.0, GOAL_M)], 0.0)
        assert ends.min() > 5.0


def test_of_a_gentle_slope_there_was_time_to_turn_and_of_a_wall_none():
    turned, warning_s = could_have_turned(*over(9.0, 150.0))
    assert turned
    assert warning_s > 15.0
    turned, warning_s = could_have_turned(*over(9.0, 15.0))
    assert not turned
    assert warning_s < 6.0


def test_false_bottoms_and_noise_over_good_water_are_no_shoals(monkeypatch):
    """Seeds 7 and 10 are, where each ping is believed whatever the others say, and noise is a slope."""
    assert [good_hour(seed)["alarms"] for seed in (7, 10)] == [0, 0]
    monkeypatch.setattr("companion.mavlink.wire.sounder.NEAR_M", np.inf)
    monkeypatch.setattr("companion.mavlink.wire.sounder.ERRORS", 0.0)
    assert sum(good_hour(seed)["alarms"] for seed in (7, 10)) > 0


def test_three_false_bottoms_that_agree_are_no_shoal_once_the_bottom_is_heard_again(monkeypatch):
    """Seed 44 was one: two lost pings beside them kept them the middle of five for a second and a half."""
    assert good_hour(44)["alarms"] == 0
    monkeypatch.setattr("companion.mavlink.wire.sounder.HEARD_S", -1.0)
    assert good_hour(44)["alarms"] == 1


def test_five_pings_that_agree_on_nothing_tell_no_depth():
    sounder = Sounder()
    for n, depth_m in enumerate((8.0, 1.0, 3.0, 5.0, 9.5)):
        sounder.take(float(n), depth_m, 0.3, 50.0)
    assert sounder.depth_m(4.0) is None
    for n, depth_m in enumerate((8.0, 1.0, 7.9, 5.0, 8.1)):
        sounder.take(5.0 + n, depth_m, 0.3, 50.0)
    assert sounder.depth_m(9.0) == 7.9


def until_told(seabed, t_s, places, *, every=1):
    """Return how long after the true slope is an alarm the sounder's pings are one, each other lost or none [s]."""
    depths = seabed.depth_m(places, t_s)
    true = depths + np.minimum(np.gradient(depths, t_s), 0.0) * TURN_S <= LEAST_DEPTH_M
    heard = Sounder()
    for n, depth_m in enumerate(depths[::every]):
        at_s = t_s[n * every]
        heard.take(at_s, float(depth_m), 0.3, 50.0)
        told_m = heard.depth_m(at_s)
        if told_m is not None and told_m + min(0.0, heard.rate_mps(at_s) or 0.0) * TURN_S <= LEAST_DEPTH_M:
            return at_s - t_s[int(np.argmax(true))]
    return np.inf


@pytest.mark.parametrize(("across_m", "every", "at_most_s"), [(150.0, 1, 2.0), (50.0, 1, 3.0), (40.0, 2, 4.0)])
def test_a_slope_is_told_soon_and_a_steep_one_with_lost_echoes_too(across_m, every, at_most_s):
    seabed, t_s, places = over(10.6, across_m, mps=3.2, every_s=0.5)
    assert until_told(seabed, t_s, places, every=every) <= at_most_s


@pytest.mark.parametrize("seed", [0, 198])
def test_a_voyage_over_a_bank_is_judged_by_the_true_depth(seed):
    """Seed 198 is a slope of 1:3 with a tenth of the echoes lost: she was told at 2.3 m, and struck."""
    record = sail(job_of("bank", seed))
    assert record["passed"], record
    assert record["keel_m"] > 0.0
    assert as_text("bank", [record]).startswith("banks: 1 voyage, ")

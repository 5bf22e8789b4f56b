"""The table of a beat's shifts: its edges, its symmetry, its promise, what it is worth against the plain corridor."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.skipper.step.wind_shifts import shift_table

HALF_RAD = math.radians(45.0)


def table(corridor_m=50.0, spread_deg=10.0, tau_s=30.0, leg_deg=0.0, tack_s=1.0):
    return shift_table(
        corridor_m=corridor_m,
        spread_rad=math.radians(spread_deg),
        tau_s=tau_s,
        speed_mps=2.0,
        half_rad=HALF_RAD,
        leg_rad=math.radians(leg_deg),
        tack_s=tack_s,
    )


def beat(choose, corridor_m=50.0, spread_deg=10.0, tau_s=30.0, tack_s=1.0, until_s=20_000):
    """Return the speed made good by a point that follows ``choose(off, shift, is_port)`` in such a wind."""
    rng = np.random.default_rng(0)
    kept = math.exp(-1.0 / tau_s)
    noise = rng.standard_normal(until_s) * math.radians(spread_deg) * math.sqrt(1.0 - kept * kept)
    shift, off, ahead, is_port, since = 0.0, 0.0, 0.0, True, 99
    lost = 0.0
    for t in range(until_s):
        shift = kept * shift + noise[t]
        since += 1
        is_out = abs(off) > corridor_m and (off > 0.0) == is_port
        if since > 7 and (is_out or choose(off, shift, is_port)):
            is_port, since, lost = not is_port, 0, tack_s
        sailed = 2.0 * max(0.0, 1.0 - lost)
        lost = max(0.0, lost - 1.0)
        course = shift + (HALF_RAD if is_port else -HALF_RAD)
        off, ahead = off + sailed * math.sin(course), ahead + sailed * math.cos(course)
    return ahead / until_s


@pytest.mark.parametrize(("spread_deg", "least"), [(10.0, 0.03), (18.0, 0.06)])
def test_it_makes_more_good_than_the_corridors_edges_alone(spread_deg, least):
    shifts = table(spread_deg=spread_deg)
    plain = beat(lambda *_: False, spread_deg=spread_deg)
    by_table = beat(lambda off, shift, is_port: shifts.gain_s(off, shift, is_port=is_port) > 0.0, spread_deg=spread_deg)
    assert by_table / plain - 1.0 > least
    assert shifts.made_good_mps == pytest.approx(by_table, rel=0.03)


def test_a_great_header_is_tacked_and_a_lift_is_not():
    shifts = table()
    for is_port in (True, False):
        header = math.radians(15.0 if is_port else -15.0)
        assert shifts.gain_s(0.0, header, is_port=is_port) > 0.0
        assert shifts.gain_s(0.0, -header, is_port=is_port) < 0.0


def test_in_a_steady_wind_it_is_not_worth_its_name():
    steady = table(spread_deg=2.0, tau_s=500.0)
    assert steady.made_good_mps < 1.01 * steady.plainly_mps
    assert steady.gain_s(0.0, 0.0, is_port=True) < 0.0


@settings(max_examples=15)
@given(
    spread_deg=st.sampled_from([4.0, 8.0, 16.0]),
    tau_s=st.sampled_from([15.0, 60.0, 300.0]),
    leg_deg=st.sampled_from([0.0, 10.0, 25.0]),
    corridor_m=st.sampled_from([20.0, 50.0]),
)
def test_a_mirrored_leg_has_the_mirrored_table(spread_deg, tau_s, leg_deg, corridor_m):
    one = table(corridor_m, spread_deg, tau_s, leg_deg)
    other = table(corridor_m, spread_deg, tau_s, -leg_deg)
    assert np.allclose(one.worth_s[0], other.worth_s[1][::-1, ::-1], atol=1e-2)
    assert one.worth_s.max() <= one.crossing_s


def test_at_the_edge_she_tacks_and_just_after_it_stands_on():
    shifts = table()
    assert shifts.gain_s(50.0, 0.0, is_port=True) > 0.0
    assert shifts.gain_s(50.0, 0.0, is_port=False) < 0.0

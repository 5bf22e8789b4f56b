"""Intervals that hold at every look, where those for one look do not."""

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.campaigns.mismatch import share_interval
from sitl.rehearse.estimates import quantile_of, share_of

LOOKS = range(5, 200, 5)


def ever_outside(p, intervals, runs=150):
    """How many of so many runs have p outside at some look."""
    rng = random.Random(7)
    outside = 0
    for _ in range(runs):
        came = [0]
        for _ in range(max(LOOKS)):
            came.append(came[-1] + (rng.random() < p))
        spans = (intervals(came[n], n) for n in LOOKS)
        outside += any(not low <= p <= high for low, high in spans)
    return outside / runs


def at_all_looks(came, of):
    share = share_of(came, of)
    return share.low, share.high


@pytest.mark.parametrize("p", [0.5, 0.9, 0.02])
def test_one_may_look_whenever_one_likes(p):
    assert ever_outside(p, at_all_looks) <= 0.05


def test_an_interval_for_one_look_would_not_do():
    assert ever_outside(0.5, share_interval) > 0.15


@given(st.integers(1, 400).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of))))
def test_a_share_is_inside_and_its_complement_is_the_mirror(counts):
    came, of = counts
    share, other = share_of(came, of), share_of(of - came, of)
    assert 0.0 <= share.low <= came / of <= share.high <= 1.0
    assert share.low == pytest.approx(1.0 - other.high, abs=1e-9)
    assert share.high == pytest.approx(1.0 - other.low, abs=1e-9)


def test_more_voyages_make_it_narrower_and_none_leave_it_open():
    widths = [share_of(n, n).width for n in (0, 1, 5, 20, 56, 200)]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] == 1.0
    assert share_of(52, 52).width > 0.1 >= share_of(53, 53).width  # what docs/guides/rehearse.md says of --sure 10


def test_the_median_is_inside_at_all_looks_and_those_who_never_arrive_count():
    rng = random.Random(3)
    outside = 0
    for _ in range(60):
        times = [rng.random() if rng.random() < 0.8 else math.inf for _ in range(120)]
        found = (quantile_of(sorted(times[:n]), 0.5) for n in range(10, 120, 10))
        outside += any(not q.low <= 0.625 <= q.high for q in found)  # 0.8 x = 0.5
    assert outside <= 3
    late = quantile_of(sorted(times), 0.9)
    assert (late.value, late.high) == (math.inf, math.inf)
    assert 0.0 < late.low < math.inf


def test_of_few_voyages_a_quantile_is_open_at_its_ends():
    assert quantile_of([], 0.5).value == math.inf
    found = quantile_of([100.0, 120.0], 0.5)
    assert (found.low, found.value, found.high) == (0.0, 100.0, math.inf)

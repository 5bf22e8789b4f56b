"""The quick time of a changed path against the walk of the whole."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.planner import Problem
from companion.planner.search.annealing import shared, time_after, timetable
from companion.planner.search.kernels import walk
from companion.planner.search.world import make_world
from tests.planner.problems import POLAR, simple

PLAIN = simple()["boat"] | {"no_go_half_deg": 20, "speed": POLAR}
BOATS = [
    make_world(Problem.from_json(simple(boat=PLAIN | kind))).boat
    for kind in ({}, {"tack_loss_s": 5.0}, {"gybe_loss_s": 3.0, "gybe_room_m": 2.0})
]
few = st.lists(st.tuples(st.integers(-2, 2), st.integers(-2, 2)), min_size=1, max_size=5)


@settings(max_examples=400)
@given(st.sampled_from(BOATS), few, few, few, few)
def test_a_changed_path_takes_what_its_walk_takes(boat, head, middle, other, tail):
    # Points of a coarse grid: many fall on each other, and a leg of no length has no course to turn from.
    def axes(points):
        both = np.array(points, np.float64) * 5.0
        return both[:, 0].copy(), both[:, 1].copy()

    (ox, oy), (xs, ys) = axes(head + middle + tail), axes(head + other + tail)
    assume(math.isfinite(walk(boat, ox, oy, len(ox), 0.3)))
    at, course = np.empty(len(ox)), np.empty(len(ox))
    timetable(boat, ox, oy, len(ox), 0.3, at, course)
    same_head, same_tail = shared(xs, ys, len(xs), ox, oy, len(ox))
    quick = time_after(boat, xs, ys, len(xs), same_head, same_tail, at, course, len(ox))
    assert quick == pytest.approx(walk(boat, xs, ys, len(xs), 0.3), abs=1e-9)

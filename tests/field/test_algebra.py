"""The atoms against Schmitt's text, the operations against their laws, her three trees by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.field.projection import HysteresisZone, Projection, near_and_ahead
from companion.field.vector_fields import (
    AttractiveCircle,
    AttractiveLine,
    AttractivePoint,
    Field,
    RepulsiveLine,
    RepulsivePoint,
    Uniform,
    line_between,
    repulsive_line_between,
)

ATOMS: tuple[Field, ...] = (
    AttractiveLine(),
    AttractiveCircle(),
    AttractivePoint(),
    RepulsivePoint(),
    RepulsiveLine(),
    Uniform(1.0),
)
metre = st.floats(-500.0, 500.0)
angle = st.floats(-math.pi, math.pi)
atom = st.sampled_from(ATOMS)
property_test = settings(max_examples=120)


@pytest.mark.parametrize("field", ATOMS, ids=lambda f: type(f).__name__)
def test_fields_are_finite_everywhere_their_centre_included(field: Field) -> None:
    grid = np.array([(x, y) for x in (-1e4, -50.0, 0.0, 1e-12, 50.0, 1e4) for y in (-1e4, 0.0, 3.0, 1e4)])
    v = field(grid)
    assert v.shape == grid.shape
    assert np.isfinite(v).all()
    length = np.hypot(v[:, 0], v[:, 1])
    assert (length <= 20.0 + 1e-9).all()


def test_line_goes_along_and_inclines_by_45_degrees_at_most() -> None:
    v = AttractiveLine()([(0.0, 0.0), (0.0, 50.0), (0.0, -1e6)])
    assert v[0] == pytest.approx((10.0, 0.0))
    assert math.degrees(math.atan2(v[1, 1], v[1, 0])) == pytest.approx(-22.5)
    assert math.degrees(math.atan2(v[2, 1], v[2, 0])) == pytest.approx(45.0, abs=0.1)


def test_circle_is_tangent_at_ten_metres_clockwise_and_leads_there() -> None:
    v = AttractiveCircle()([(0.0, 10.0), (10.0, 0.0), (0.0, 100.0), (0.0, 1.0)])
    assert v[0] == pytest.approx((10.0, 0.0))
    assert v[1] == pytest.approx((0.0, -10.0))
    pull = math.atan(0.1 * (10.0 - 100.0))  # his equation, v0 = vr = 10 and rho = 0.1, brought to length 10
    assert v[2] == pytest.approx(10.0 * np.array([1.0, pull]) / math.hypot(1.0, pull))
    assert v[3, 1] > 0.0


def test_attractive_point_fades_within_metres() -> None:
    v = AttractivePoint()([(0.0, 0.0), (0.0, 1.0), (0.0, 500.0)])
    assert v[0] == pytest.approx((0.0, 0.0))
    assert v[1] == pytest.approx((0.0, -10.0 / math.e))
    assert v[2, 1] == pytest.approx(-10.0, abs=0.03)


def test_repulsive_atoms_are_gaussians_of_a_hundred_metres() -> None:
    v = RepulsivePoint()([(0.0, 0.0), (100.0, 0.0), (0.0, 500.0)])
    assert v[0] == pytest.approx((20.0, 0.0))
    assert v[1] == pytest.approx((20.0 / math.e, 0.0))
    assert np.hypot(*v[2]) < 1e-9
    v = RepulsiveLine()([(7.0, 100.0), (7.0, -100.0)])
    assert v == pytest.approx(np.array([(0.0, 20.0 / math.e), (0.0, -20.0 / math.e)]))


@property_test
@given(atom, metre, metre, metre, metre)
def test_shift(field: Field, x: float, y: float, dx: float, dy: float) -> None:
    assume(math.hypot(x, y) > 1e-3 and abs(y) > 1e-3)  # at a centre the direction jumps
    assert field.shifted(dx, dy)((x + dx, y + dy)) == pytest.approx(field((x, y)), abs=1e-6)


@property_test
@given(atom, metre, metre, angle)
def test_rotation_turns_pattern_and_vectors_clockwise(field: Field, x: float, y: float, a: float) -> None:
    assume(math.hypot(x, y) > 1e-3)
    s, c = math.sin(a), math.cos(a)
    turned = field.rotated(a)((c * x + s * y, -s * x + c * y))[0]
    v = field((x, y))[0]
    if abs(y) > 1e-6:  # on its line a repulsive line has two sides
        assert turned == pytest.approx((c * v[0] + s * v[1], -s * v[0] + c * v[1]), abs=1e-6)


def test_rotation_by_a_quarter_turns_east_to_south() -> None:
    assert AttractiveLine().rotated(math.pi / 2.0)((0.0, 0.0))[0] == pytest.approx((0.0, -10.0), abs=1e-9)


@property_test
@given(atom, metre, metre, st.floats(0.1, 20.0), st.floats(-5.0, 5.0))
def test_scaling(field: Field, x: float, y: float, factor: float, gain: float) -> None:
    assume(math.hypot(x, y) > 1e-3 and abs(y) > 1e-3)
    assert field.enlarged(factor)((factor * x, factor * y)) == pytest.approx(field((x, y)), abs=1e-6)
    assert (gain * field)((x, y)) == pytest.approx(gain * field((x, y)))


@property_test
@given(atom, atom, metre, metre)
def test_sum(a: Field, b: Field, x: float, y: float) -> None:
    assert (a + b)((x, y)) == pytest.approx(a((x, y)) + b((x, y)))
    assert (a + b)((x, y)) == pytest.approx((b + a)((x, y)))


def test_evaluation_of_many_points_is_that_of_each() -> None:
    tree = AttractiveCircle().enlarged(10.0) + RepulsivePoint().shifted(15.0, 5.0).rotated(0.7)
    points = np.random.default_rng(1).uniform(-200.0, 200.0, (50, 2))
    assert tree(points) == pytest.approx(np.vstack([tree(p) for p in points]))


def test_a_line_between_two_points_runs_from_one_to_the_other() -> None:
    f = line_between((10.0, 20.0), (10.0, 120.0))
    assert f((10.0, 70.0))[0] == pytest.approx((0.0, 10.0), abs=1e-9)
    assert f((60.0, 70.0))[0, 0] < 0.0
    r = repulsive_line_between((10.0, 20.0), (10.0, 120.0), 30.0)
    assert r((40.0, 70.0))[0] == pytest.approx((20.0 / math.e, 0.0), abs=1e-9)


# ------------------------------------------------------------------------------------ Schmitt's trees
def test_figure_4_1() -> None:
    """F1 = circle enlarged ten times + repulsive point at (15, 5)."""
    f1 = AttractiveCircle().enlarged(10.0) + RepulsivePoint().shifted(15.0, 5.0)
    there = (10.0, 0.0)  # on the circle: along it, clockwise
    inward = f1((0.0, 300.0))[0] - RepulsivePoint().shifted(15.0, 5.0)((0.0, 300.0))[0]
    # 30 m of the atom's own: v0 along, vr atan(0.1 (10 - 30)) outwards, brought to length 10
    pull = 10.0 * math.atan(0.1 * (10.0 - 30.0))
    assert inward == pytest.approx(10.0 * np.array([10.0, pull]) / math.hypot(10.0, pull))
    d = np.array([0.0 - 15.0, 100.0 - 5.0])
    away = 20.0 * math.exp(-float(d @ d) / 1e4) * d / np.hypot(*d)
    assert f1((0.0, 100.0))[0] == pytest.approx(there + away)
    # At the obstacle it decides (20 against 10), far away the circle does.
    assert f1((15.0 + 1e-9, 5.0))[0, 0] > 0.0
    assert f1((900.0, 5.0))[0] == pytest.approx(AttractiveCircle()((90.0, 0.5))[0], abs=1e-6)


WIND = math.radians(0.0)


def vectorfield1() -> Projection:
    """Figure 4.2: line following, the other boat, projection."""
    other = RepulsivePoint().shifted(30.0, 40.0)
    return Projection(
        field=AttractiveLine() + other,
        twd_from_rad=WIND,
        zone=HysteresisZone(at_en=(0.0, 0.0), course_rad=math.pi / 2.0),
    )


def vectorfield2() -> Projection:
    """Figure 4.3: attractive point, the other boat, projection."""
    other = RepulsivePoint().shifted(30.0, 40.0)
    return Projection(
        field=AttractivePoint() + other, twd_from_rad=WIND, zone=HysteresisZone.of_point((0.0, 0.0), WIND)
    )


@pytest.mark.parametrize("tree", [vectorfield1(), vectorfield2()])
@pytest.mark.parametrize("q", [-1, 1])
def test_the_trees_steer_to_sailable_directions_only(tree: Projection, q: int) -> None:
    points = np.random.default_rng(2).uniform(-300.0, 300.0, (2000, 2))
    v = tree.evaluate(points, q)
    twa = np.degrees(np.arctan2(v[:, 0], v[:, 1]))
    assert np.abs(twa).min() >= 45.0 - 1e-6
    raw = tree.field(points)
    assert np.hypot(v[:, 0], v[:, 1]) == pytest.approx(np.hypot(raw[:, 0], raw[:, 1]))


def test_tree_1_follows_the_line_far_from_the_boat_and_leaves_it_near() -> None:
    tree = vectorfield1()
    assert math.degrees(tree.steer((-500.0, 0.0), 1)[0]) == pytest.approx(90.0, abs=0.01)
    near = tree.steer((30.0, 30.0), 1)[0]
    assert abs(math.degrees(near)) > 110.0  # south of the boat at (30, 40): away, southwards


def test_tree_2_beats_up_to_the_point_in_boards() -> None:
    """Below the point, the wind from it: q decides the board inside the zone, the side outside it."""
    tree = vectorfield2()
    assert math.degrees(tree.steer((0.0, -300.0), 1)[0]) == pytest.approx(45.0)
    assert math.degrees(tree.steer((0.0, -300.0), -1)[0]) == pytest.approx(-45.0)
    assert tree.steer((-60.0, -300.0), -1)[2] == 1  # left of the zone: go right, and keep going right ...
    assert tree.steer((0.0, -250.0), 1)[2] == 1
    assert tree.steer((60.0, -200.0), 1)[2] == -1  # ... until the right edge


@property_test
@given(atom, metre, metre, angle, st.floats(0.3, 1.3), st.sampled_from([-1, 1]))
def test_projection_is_outside_the_zone_and_changes_nothing_else(
    field: Field, x: float, y: float, twd: float, half: float, q: int
) -> None:
    p = Projection(field=field, twd_from_rad=twd, no_go_half_rad=half)
    v, raw = p.evaluate((x, y), q)[0], field((x, y))[0]
    if np.hypot(*raw) < 1e-6:
        return
    assert math.cos(math.atan2(v[0], v[1]) - twd) <= math.cos(half) + 1e-9
    if math.cos(math.atan2(raw[0], raw[1]) - twd) < math.cos(half) - 1e-9:
        assert v == pytest.approx(raw, abs=1e-9)


def test_fan_is_one_sided_outside_the_zone() -> None:
    tree = vectorfield1()
    low, high = tree.fan([(-200.0, 0.0), (-200.0, 80.0), (-200.0, -80.0)])
    width = np.degrees(high - low)
    assert width == pytest.approx((90.0, 45.0, 45.0))
    heading = math.radians(90.0) + 0.5 * math.atan(80.0 / 50.0)
    assert high[1] == pytest.approx(heading + math.pi / 4.0, abs=0.05)  # left of the line: to the right
    assert low[2] == pytest.approx(math.pi - heading - math.pi / 4.0, abs=0.05)


def test_obstacles_behind_do_not_matter() -> None:
    assert near_and_ahead((0.0, 0.0), 0.0, (0.0, 100.0))
    assert not near_and_ahead((0.0, 0.0), 0.0, (0.0, -100.0))
    assert near_and_ahead((0.0, 0.0), 0.0, (0.0, -20.0))
    assert not near_and_ahead((0.0, 0.0), 0.0, (0.0, 1000.0))

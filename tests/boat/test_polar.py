"""The polar: its rules, its ends, its best angles."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import Boat, Hull, Polar, ardurover_sitl, avalon, constant
from companion.geo import MPS_PER_KNOT

POLARS = [constant(1.5), avalon(), ardurover_sitl()]
ANGLES = st.floats(-50.0, 50.0)
WINDS = st.floats(0.0, 60.0)


@pytest.mark.parametrize("last_deg", [95.0, 120.0, 150.0, 170.0])
def test_beyond_its_last_angle_gybing_at_that_angle_makes_more(last_deg):
    """It sailed dead before the wind as fast as at 150 degrees, and every plan ran dead."""
    twa = np.radians([0.0, 45.0, 90.0, last_deg])
    polar = Polar(twa_rad=twa, tws_mps=np.array([5.0]), speed_mps_table=np.array([[0.0], [1.5], [2.0], [2.0]]))
    assert math.degrees(polar.best_run(5.0).twa_rad) == pytest.approx(last_deg)
    made = -polar.speeds_mps(np.linspace(twa[-1], math.pi, 200), 5.0) * np.cos(np.linspace(twa[-1], math.pi, 200))
    assert made.max() <= made[0] + 1e-12
    assert polar.speed_mps(twa[-1] + 0.01, 5.0) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize(
    "polar",
    [
        *POLARS,
        Polar(
            twa_rad=np.radians([30.0, 90.0, 150.0]),
            tws_mps=np.array([2.0, 5.0, 9.0]),
            speed_mps_table=np.array([[0.3, 1.1, 1.7], [0.9, 2.3, 2.9], [0.7, 1.9, 2.7]]),
        ),
    ],
    ids=lambda p: p.name or "with ends",
)
@given(twa=ANGLES, tws=WINDS)
def test_one_speed_is_what_the_whole_curve_says_to_the_last_bit(polar, twa, tws):
    folded = abs((twa + math.pi) % (2.0 * math.pi) - math.pi)
    assert polar.speed_mps(twa, tws) == float(np.interp(folded, *polar.curve(tws)))


def test_one_speed_needs_no_whole_curve(monkeypatch):
    """A step asks for fifty, each in a wind of its own: it was a tenth of a voyage under the virtual clock."""
    polar, made = avalon(), []
    real = Polar.curve
    monkeypatch.setattr(Polar, "curve", lambda self, tws: made.append(tws) or real(self, tws))
    for n in range(50):
        polar.speed_mps(1.0, 0.1 * n)
    assert len(made) <= 1


@pytest.mark.parametrize("polar", POLARS, ids=lambda p: p.name)
@given(twa=ANGLES, tws=WINDS)
@settings(max_examples=60)
def test_speed_is_never_negative_symmetric_periodic_and_never_above_the_last_column(polar, twa, tws):
    speed = polar.speed_mps(twa, tws)
    assert speed >= 0.0
    assert speed == pytest.approx(polar.speed_mps(-twa, tws), abs=1e-9)
    assert speed == pytest.approx(polar.speed_mps(twa + 2.0 * math.pi, tws), abs=1e-9)
    assert speed <= polar.speed_mps_table.max() + 1e-12
    assert polar.speed_mps(twa, polar.tws_mps[-1] + tws) == pytest.approx(polar.speed_mps(twa, polar.tws_mps[-1]))


@pytest.mark.parametrize("polar", POLARS, ids=lambda p: p.name)
@given(tws=st.floats(0.0, 20.0))
@settings(max_examples=30)
def test_no_angle_makes_better_vmg_than_the_best_angles(polar, tws):
    beat, run = polar.best_beat(tws, no_go_half_rad=0.5), polar.best_run(tws, max_twa_rad=2.9)
    assert 0.5 <= beat.twa_rad <= math.pi / 2 <= run.twa_rad <= 2.9
    for angle in np.linspace(0.5, math.pi / 2, 400):
        assert polar.vmg_mps(angle, tws) <= beat.vmg_mps + 2e-5
    for angle in np.linspace(math.pi / 2, 2.9, 400):
        assert -polar.vmg_mps(angle, tws) <= run.vmg_mps + 2e-5


def test_speed_falls_linearly_to_nothing_below_the_first_wind_and_the_first_angle():
    polar = Polar(
        twa_rad=np.radians([40.0, 90.0]),
        tws_mps=np.array([4.0, 8.0]),
        speed_mps_table=np.array([[2.0, 3.0], [4.0, 5.0]]),
    )
    assert polar.speed_mps(math.radians(90.0), 2.0) == pytest.approx(2.0)
    assert polar.speed_mps(math.radians(90.0), 6.0) == pytest.approx(4.5)
    assert polar.speed_mps(math.radians(20.0), 4.0) == pytest.approx(1.0)
    assert polar.speed_mps(math.pi, 8.0) == pytest.approx(5.0)
    assert polar.speed_mps(1.0, 0.0) == 0.0


@pytest.mark.parametrize(
    ("twa", "tws", "table"),
    [
        ([0.0, 1.0], [1.0], [[0.0], [-1.0]]),
        ([0.0, 0.0], [1.0], [[0.0], [1.0]]),
        ([0.0, 4.0], [1.0], [[0.0], [1.0]]),
        ([0.0, 1.0], [2.0, 1.0], [[0.0, 1.0], [1.0, 2.0]]),
        ([0.0, 1.0], [1.0], [[0.0], [math.nan]]),
        ([0.0, 1.0], [math.inf], [[0.0], [1.0]]),
        ([0.0, 1.0], [1.0, 2.0], [[0.0], [1.0]]),
        ([], [], [[]]),
    ],
)
def test_a_table_that_breaks_a_rule_is_refused(twa, tws, table):
    with pytest.raises(ValueError):
        Polar(twa_rad=np.array(twa), tws_mps=np.array(tws), speed_mps_table=np.array(table))


def test_a_polar_cannot_be_changed_and_compares_by_value():
    polar = avalon()
    with pytest.raises(ValueError):
        polar.speed_mps_table[0, 0] = 9.0
    assert polar == avalon()
    assert hash(polar) == hash(avalon())
    assert polar != constant(1.0)


def test_avalon_is_equation_4_1_in_radians_and_knots():
    polar = avalon()
    for degrees in (45, 60, 90, 120, 160):
        a = math.radians(degrees)
        knots = (-0.0048 * a**4 + 0.0335 * a**3 - 0.2460 * a**2 + 0.7465 * a - 0.01109) * 10.0
        assert polar.speed_mps(a, 10.0 * MPS_PER_KNOT) == pytest.approx(knots * MPS_PER_KNOT, rel=1e-12)
    assert polar.speed_mps(0.0, 5.0) == 0.0  # the polynomial is negative there
    assert polar.speed_mps(1.5, 30.0 * MPS_PER_KNOT) == polar.speed_mps(1.5, 25.0 * MPS_PER_KNOT)


def test_ardurover_sitl_is_what_was_measured():
    polar = ardurover_sitl()
    assert polar.speed_mps(math.radians(45.0), 6.0) == pytest.approx(2.26)
    assert polar.speed_mps(math.radians(-90.0), 3.0) == pytest.approx(2.20)
    assert polar.speed_mps(0.0, 12.0) == 0.0  # it drifts astern at 1.46 m/s; that is not sailing
    beat = polar.best_beat(6.0)
    assert math.degrees(beat.twa_rad) == pytest.approx(45.0, abs=5.0)  # "best upwind VMG is near TWA 45"
    assert beat.vmg_mps == pytest.approx(1.60, abs=0.02)
    assert math.degrees(polar.best_run(6.0).twa_rad) == pytest.approx(180.0, abs=1.0)  # no gybing angles


def test_the_boat_as_a_problem_says_the_same_speeds():
    boat = Boat(polar=ardurover_sitl(), no_go_half_rad=math.radians(47.0), tack_loss_s=2.0)
    d = boat.problem_boat(5.0)
    assert d["no_go_half_deg"] == pytest.approx(47.0)
    assert d["tack_loss_s"] == 2.0
    assert "gybe_loss_s" not in d
    for degrees in np.linspace(0.0, 180.0, 37):
        assert np.interp(degrees, d["speed"]["twa_deg"], d["speed"]["v_mps"]) == pytest.approx(
            boat.polar.speed_mps(math.radians(degrees), 5.0), abs=1e-9
        )
    assert Boat(polar=constant(1.2)).problem_boat(9.0)["speed"] == {"model": "constant", "v_mps": 1.2}


@pytest.mark.parametrize(
    "change",
    [
        {"no_go_half_rad": -0.1},
        {"no_go_half_rad": 4.0},
        {"max_twa_rad": 0.2},
        {"turn_rate_radps": 0.0},
        {"turn_rate_radps": math.nan},
        {"tack_loss_s": -1.0},
        {"gybe_loss_s": math.inf},
    ],
)
def test_a_boat_that_cannot_be_is_refused(change):
    with pytest.raises(ValueError):
        Boat(polar=constant(1.0), **change)


def test_a_hull_of_negative_length_is_refused():
    with pytest.raises(ValueError):
        Hull(length_m=-1.0)

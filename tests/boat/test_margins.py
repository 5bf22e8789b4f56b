"""Margins follow the autopilot's parameters, part by part."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import AutopilotLimits, Hull, required_margin
from companion.boat.margins import Margin, MarginPart


def names(margin):
    return [part.name for part in margin.parts]


def test_the_corridor_decides_when_a_leg_can_enter_the_no_go_zone():
    wide = required_margin(AutopilotLimits(sail_xtrack_max_m=30.0), speed_mps=2.0)
    assert "corridor" in names(wide)
    part = next(p for p in wide.parts if p.name == "corridor")
    assert part.value_m == pytest.approx(30.9, abs=0.01)  # measured: 29.1-29.6 at the tack, never 0.9 m beyond 30
    tight = required_margin(AutopilotLimits(sail_xtrack_max_m=30.0), speed_mps=2.0, legs_can_enter_no_go=False)
    assert "corridor" not in names(tight)
    assert tight.total_m < wide.total_m


def test_without_a_corridor_the_beat_has_no_bound():
    margin = required_margin(AutopilotLimits(sail_xtrack_max_m=0.0), speed_mps=2.0)
    assert not margin.is_bounded
    assert "no bound" in margin.describe()
    assert required_margin(AutopilotLimits(sail_xtrack_max_m=0.0), speed_mps=2.0, legs_can_enter_no_go=False).is_bounded


def test_the_total_is_the_sum_of_the_parts_that_are_told():
    """ "14.5 m = hull 0.5 + position 2.5 + corridor 11.4"."""
    parts = tuple(MarginPart(name=name, value_m=value, why="") for name, value in (("hull", 0.54), ("corridor", 11.44)))
    assert Margin(parts=parts).describe() == "11.9 m = hull 0.5 + corridor 11.4"


def test_parameters_by_their_ardupilot_names():
    limits = AutopilotLimits.from_params(
        {
            "SAIL_NO_GO_ANGLE": 35.0,
            "SAIL_XTRACK_MAX": 12.0,
            "WP_RADIUS": 7.0,
            "TURN_RADIUS": 1.0,
            "FENCE_ENABLE": 1.0,
            "FENCE_ACTION": 2.0,
        }
    )
    assert math.degrees(limits.sail_no_go_angle_rad) == pytest.approx(35.0)
    assert limits.fence_action == 2
    assert AutopilotLimits.from_params({"FENCE_ACTION": 2.0}).fence_action is None
    assert limits.rc_channels == (1, 3, 8)
    assert AutopilotLimits.from_params({"RCMAP_ROLL": 2.0, "MODE_CH": 5.0}).rc_channels == (2, 3, 5)


@given(st.floats(0.0, 10.0), st.floats(0.0, 100.0), st.floats(0.0, 40.0))
@settings(max_examples=100)
def test_a_margin_never_shrinks_with_speed_corridor_or_radius(speed, corridor, radius):
    def total(v, x, r):
        limits = AutopilotLimits(sail_xtrack_max_m=x, wp_radius_m=r, fence_action=2)
        return required_margin(limits, speed_mps=v).total_m

    base = total(speed, corridor, radius)
    assert base >= 2.5
    assert total(speed + 1.0, corridor, radius) >= base
    assert total(speed, corridor + 1.0, radius) >= base
    assert total(speed, corridor, radius + 1.0) >= base


@pytest.mark.parametrize("speed_mps", [-1.0, math.nan])
def test_nonsense_is_refused(speed_mps):
    with pytest.raises(ValueError):
        required_margin(AutopilotLimits(), speed_mps=speed_mps)


def test_a_bigger_hull_needs_more_room():
    small = required_margin(AutopilotLimits(), speed_mps=2.0, hull=Hull(length_m=1.0, beam_m=0.3))
    large = required_margin(AutopilotLimits(), speed_mps=2.0, hull=Hull(length_m=12.0, beam_m=4.0))
    assert large.total_m - small.total_m == pytest.approx(0.5 * (math.hypot(12, 4) - math.hypot(1, 0.3)))

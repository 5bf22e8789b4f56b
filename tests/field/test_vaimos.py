"""The boat model: leeway, inertia, no-go zone, irons; steps of half the size give the same voyage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.world.boats import STEP_S, VaimosParameters, polar, sail_heading, state_at, step

P = VaimosParameters().array()


def test_leeway_is_three_percent_of_the_wind() -> None:
    s = sail_heading(state_at(0.0, 0.0, math.radians(90.0), 1.0), P, math.radians(90.0), 0.0, 8.0, 100.0, STEP_S)
    t = sail_heading(s, P, math.radians(90.0), 0.0, 8.0, 10.0, STEP_S)
    assert (t[1] - s[1]) / 10.0 == pytest.approx(-0.03 * 8.0, abs=0.06)
    assert t[0] - s[0] > 15.0


def test_inertia_she_takes_time_to_gather_and_to_lose_way() -> None:
    s = state_at(0.0, 0.0, math.radians(90.0), 0.0)
    speeds = []
    for _ in range(30):
        s = sail_heading(s, P, math.radians(90.0), 0.0, 6.0, 1.0, STEP_S)
        speeds.append(float(s[5]))
    assert speeds[0] < 0.75 * speeds[-1]
    assert speeds[-1] > 1.8
    coasting = sail_heading(s, P, math.radians(90.0), 0.0, 0.01, 5.0, STEP_S)
    assert 0.5 < float(coasting[5]) < speeds[-1]


def test_she_gathers_way_like_300_kg_under_a_small_sail_and_the_published_set_does_not() -> None:
    """At 6 m/s of wind a sail of 6 m² pushes with at most half rho v² A = 132 N."""

    def after_2_s(parameters: VaimosParameters) -> float:
        s = state_at(0.0, 0.0, math.radians(90.0), 0.0)
        return float(sail_heading(s, parameters.array(), math.radians(90.0), 0.0, 6.0, 2.0, STEP_S)[5])

    assert 0.3 < after_2_s(VaimosParameters()) < 132.0 / 300.0 * 2.0
    assert after_2_s(VaimosParameters(share=1.0)) > 1.8


@pytest.mark.parametrize("twa_deg", [50.0, 70.0, 90.0, 130.0, 170.0])
@pytest.mark.parametrize("tws_mps", [3.0, 6.0, 9.0])
def test_the_share_of_the_forces_leaves_her_speeds_where_the_published_set_has_them(
    twa_deg: float, tws_mps: float
) -> None:
    published, ours = polar(VaimosParameters(share=1.0)), polar()
    twa = math.radians(twa_deg)
    assert ours.speed_mps(twa, tws_mps) == pytest.approx(published.speed_mps(twa, tws_mps), rel=0.08)


def test_a_tack_costs_way_and_one_from_too_high_with_none_ends_in_irons() -> None:
    def tack(twa_deg: float, speed: float, seconds: int) -> tuple[float, float]:
        s, least = state_at(0.0, 0.0, math.radians(twa_deg), speed), math.inf
        for _ in range(seconds):
            s = sail_heading(s, P, math.radians(-50.0), 0.0, 6.0, 1.0, STEP_S)
            least = min(least, float(s[5]))
        return math.degrees(float(s[2])), least

    heading, least = tack(50.0, 1.7, 20)
    assert heading < -40.0
    assert least < 0.6 * 1.7
    heading, _ = tack(10.0, 0.0, 15)
    assert abs(heading) < 40.0


def test_polar_has_a_no_go_zone_and_hull_speed() -> None:
    p = polar()
    for tws in (3.0, 6.0, 10.0):
        assert p.speed_mps(math.radians(10.0), tws) < 0.1
        assert p.speed_mps(math.radians(90.0), tws) > 1.4
        assert p.speed_mps(math.radians(45.0), tws) < p.speed_mps(math.radians(90.0), tws)
    assert p.speed_mps(math.pi, 13.0) < 3.5


@settings(max_examples=60)
@given(
    st.floats(-math.pi, math.pi),
    st.floats(0.0, 3.0),
    st.floats(-math.pi, math.pi),
    st.floats(0.0, 20.0),
    st.floats(-math.pi, math.pi),
)
def test_any_wind_and_any_command_stays_finite_and_symmetric(
    heading: float, speed: float, twd: float, tws: float, wanted: float
) -> None:
    s = sail_heading(state_at(0.0, 0.0, heading, speed), P, wanted, twd, tws, 20.0, STEP_S)
    assert np.isfinite(s).all()
    assert abs(float(s[5])) < 6.0
    mirror = sail_heading(state_at(0.0, 0.0, -heading, speed), P, -wanted, -twd, tws, 20.0, STEP_S)
    # The mirrored scene is the mirrored voyage, but for the knife edges where the sail changes sides.
    if (
        abs(math.remainder(heading - twd, math.pi)) > 0.8
        and abs(math.remainder(wanted - twd, math.pi)) > 0.8
        and (math.remainder(heading - twd, 2 * math.pi) * math.remainder(wanted - twd, 2 * math.pi) > 0.0)
    ):
        assert float(mirror[0]) == pytest.approx(-float(s[0]), abs=1e-6)
        assert float(mirror[5]) == pytest.approx(float(s[5]), abs=1e-6)


def test_the_step_does_not_make_the_voyage() -> None:
    a = sail_heading(state_at(0.0, 0.0, 1.0, 1.0), P, math.radians(100.0), 0.0, 6.0, 60.0, STEP_S)
    b = sail_heading(state_at(0.0, 0.0, 1.0, 1.0), P, math.radians(100.0), 0.0, 6.0, 60.0, STEP_S / 4.0)
    assert math.hypot(a[0] - b[0], a[1] - b[1]) < 2.0


def test_rudder_to_starboard_turns_to_starboard_and_backwards_when_going_astern() -> None:
    ahead, astern = state_at(0.0, 0.0, math.radians(90.0), 1.5), state_at(0.0, 0.0, math.radians(90.0), -1.0)
    for _ in range(20):
        ahead = step(ahead, P, 0.6, 1.5, 0.0, 0.01, STEP_S)
        astern = step(astern, P, 0.6, 1.5, 0.0, 0.01, STEP_S)
    assert float(ahead[6]) > 0.0
    assert float(astern[6]) < 0.0

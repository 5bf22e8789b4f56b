"""The guidance: never into the no-go zone, tacks with way on, wears without, out of irons, clear of what moves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from companion.field.guidance import LastResort, avoiding, follow_line, go_to, helm, hold_heading, step
from companion.field.look_ahead import foresee, margins
from companion.field.values import GuidanceSettings, GuidanceState, Intent, Manoeuvre, MovingObstacle, Situation
from companion.geo.angles import wrap_pi
from sitl.world.boats import SimulatedVaimos, habits_for, wind_for
from sitl.world.environment import AR1

angle = st.floats(-math.pi, math.pi)
HABITS = GuidanceSettings()


def seen(heading_deg: float = 90.0, twd_deg: float = 0.0, speed: float = 2.0, **more: object) -> Situation:
    h = math.radians(heading_deg)
    velocity = (speed * math.sin(h), speed * math.cos(h))
    values: dict[str, object] = {
        "t_s": 0.0,
        "en_m": (0.0, 0.0),
        "heading_rad": h,
        "velocity_en_mps": velocity,
        "twd_from_rad": math.radians(twd_deg),
    }
    return Situation(**(values | more))  # type: ignore[arg-type]


@settings(max_examples=300)
@given(
    angle,
    angle,
    angle,
    st.floats(-1.0, 3.0),
    st.sampled_from(list(Manoeuvre)),
    st.floats(0.0, 100.0),
    st.sampled_from([-1, 1]),
    st.integers(0, 2),
    st.booleans(),
)
def test_no_setpoint_is_ever_inside_the_no_go_zone(
    wanted: float, heading: float, twd: float, speed: float, doing: Manoeuvre, t: float, q: int, failed: int, look: bool
) -> None:
    situation = seen(
        math.degrees(heading), math.degrees(twd), speed, t_s=t, obstacles=(MovingObstacle(en_m=(30.0, 40.0)),)
    )
    state = GuidanceState(q=q, manoeuvre=doing, failed_tacks=failed, irons_side=q)
    for out in (
        helm(state, situation, wanted, HABITS)[1],
        step(state, situation, hold_heading(wanted), replace(HABITS, look_ahead=look))[1].heading_rad,
    ):
        assert math.cos(out - twd) <= math.cos(HABITS.no_go_half_rad) + 1e-9


def test_tack_with_way_on_and_wear_without() -> None:
    state, heading, why = helm(GuidanceState(), seen(50.0, speed=2.0), math.radians(-50.0), HABITS)
    assert (state.manoeuvre, why) == (Manoeuvre.TACK, "tack")
    assert math.degrees(heading) == pytest.approx(-50.0)
    state, heading, why = helm(GuidanceState(), seen(50.0, speed=0.4), math.radians(-50.0), HABITS)
    assert state.manoeuvre is Manoeuvre.WEAR
    assert 100.0 < math.degrees(heading) < 180.0  # away from the wind


def test_wearing_goes_round_by_the_stern_to_the_other_board() -> None:
    state, h = replace(GuidanceState(), manoeuvre=Manoeuvre.WEAR), 50.0
    path = []
    for t in range(60):
        state, wanted, _ = helm(state, seen(h, speed=0.6, t_s=float(t)), math.radians(-50.0), HABITS)
        h += max(-10.0, min(10.0, math.degrees(wrap_pi(wanted - math.radians(h)))))
        path.append(abs(math.degrees(wrap_pi(math.radians(h)))))
        if state.manoeuvre is Manoeuvre.SAIL:
            break
    assert state.manoeuvre is Manoeuvre.SAIL
    assert max(path) > 170.0
    assert min(path) > 45.0


def test_a_tack_that_fails_becomes_a_wear() -> None:
    state, _, _ = helm(GuidanceState(), seen(50.0), math.radians(-50.0), HABITS)
    for t in range(1, 40):
        state, _, _ = helm(state, seen(48.0, speed=0.5, t_s=float(t)), math.radians(-50.0), HABITS)
        if state.manoeuvre is Manoeuvre.WEAR:
            break
    assert state.manoeuvre is Manoeuvre.WEAR
    assert state.failed_tacks == 1


@pytest.mark.parametrize("tws", [3.0, 5.0, 8.0])
def test_out_of_irons_on_the_boat_model(tws: float) -> None:
    """Dead in the water, head to wind: sailing on a reach within a minute and a half, every time."""
    times = []
    for seed in range(4):
        wind = wind_for(0.0, tws, seed)
        boat = SimulatedVaimos.launch(wind, np.random.default_rng(seed), (0.0, 0.0), wind.at(0.0)[0])
        boat.state[5] = 0.0
        state = GuidanceState()
        while boat.t_s < 200.0:
            s = boat.sense()
            assert s.twd_from_rad is not None
            state, heading, _ = helm(state, s, s.twd_from_rad + math.radians(90.0), habits_for(tws))
            boat.sail(heading)
            if abs(wrap_pi(wind.at(boat.t_s)[0] - boat.state[2])) > 1.2 and boat.state[5] > 0.5:
                break
        times.append(boat.t_s)
    assert max(times) < 90.0


def test_without_the_recovery_she_stays_in_irons_for_long() -> None:
    """The danger is real in the model: asking for a reach from a standstill head to wind does not soon get her out."""
    boat = SimulatedVaimos.launch(AR1(0.0, 5.0, seed=1, sd_rad=0.0), np.random.default_rng(1), (0.0, 0.0), 0.0)
    boat.state[5] = 0.0
    for _ in range(20):
        boat.sail(math.radians(90.0))
        assert abs(float(boat.state[2])) < math.radians(40.0)
        assert abs(float(boat.state[5])) < 0.3


@settings(max_examples=60)
@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(-3, 3), st.floats(-3, 3), st.floats(2.0, 30.0), angle)
def test_margins_are_the_least_sampled_ones(x: float, y: float, vx: float, vy: float, keep: float, h: float) -> None:
    obstacle = MovingObstacle(en_m=(x, y), velocity_en_mps=(vx, vy), keep_m=keep)
    track, lost = foresee(np.array([h, h + 1.0]), 0.0, seen(), HABITS)
    got = margins(track, (obstacle,))
    t = np.arange(track.shape[1]) * 2.5
    for k in range(2):
        sampled = np.hypot(track[k, :, 0] - x - vx * t, track[k, :, 1] - y - vy * t) - keep
        assert got[k] <= sampled.min() + 1e-9
        assert got[k] >= sampled.min() - 8.0
    assert (lost >= 0.0).all()


def sail(
    intent: Intent, habits: GuidanceSettings, obstacle: MovingObstacle | None, seconds: int
) -> tuple[SimulatedVaimos, float, int]:
    """Sail the model by the guidance; return the boat, the least distance and the tacks' count of irons."""
    boat = SimulatedVaimos.launch(wind_for(0.0, 6.0, 3), np.random.default_rng(3), (0.0, -150.0), math.radians(60.0))
    state, least = GuidanceState(), math.inf
    for k in range(seconds):
        moved = (
            ()
            if obstacle is None
            else (
                replace(
                    obstacle,
                    en_m=(
                        obstacle.en_m[0] + k * obstacle.velocity_en_mps[0],
                        obstacle.en_m[1] + k * obstacle.velocity_en_mps[1],
                    ),
                ),
            )
        )
        if moved:
            least = min(least, math.dist(boat.en_m, moved[0].en_m))
        state, setpoint = step(state, boat.sense(moved), intent, habits)
        boat.sail(setpoint.heading_rad, setpoint.thrust)
    return boat, least, state.irons


@pytest.mark.parametrize("look", [True, False])
def test_beating_to_a_point_dead_upwind(look: bool) -> None:
    boat, _, _ = sail(go_to((0.0, 150.0), 0.0), habits_for(6.0, look_ahead=look), None, 500)
    track = boat.positions()
    assert np.hypot(track[:, 1], track[:, 2] - 150.0).min() < 15.0
    assert np.abs(track[:, 1]).max() < 110.0


# Course off the wind [deg] -> where she settles beside her line, from 20 m to leeward of it [m, to leeward].
ACROSS_M = {60.0: 13.0, 90.0: 7.2, 120.0: 4.9, 150.0: 0.7, 180.0: -3.2}


@pytest.mark.parametrize("course_deg", ACROSS_M)
def test_beside_a_line_she_settles_where_the_field_makes_up_for_her_leeway(course_deg: float) -> None:
    """Schmitt's line has no memory: what the wind sets her to leeward is made up for by being off the line."""
    east, north = math.sin(math.radians(course_deg)), math.cos(math.radians(course_deg))
    begin = (-20.0 * north, -150.0 + 20.0 * east)
    line = follow_line(begin, (begin[0] + 900.0 * east, begin[1] + 900.0 * north))
    boat, _, _ = sail(line, habits_for(6.0), None, 400)
    track = boat.positions()
    across = (track[:, 1] - begin[0]) * north - (track[:, 2] - begin[1]) * east
    settled = across[track[:, 0] - track[0, 0] > 150.0]
    assert across[0] == pytest.approx(20.0, abs=0.5)
    assert np.median(settled) == pytest.approx(ACROSS_M[course_deg], abs=1.0)
    assert np.max(np.abs(settled - np.median(settled))) < 4.0


def test_following_a_line_past_a_boat_that_lies_on_it() -> None:
    line = follow_line((0.0, -100.0), (300.0, -100.0))
    lying = MovingObstacle(en_m=(120.0, -100.0), keep_m=15.0)
    boat, least, _ = sail(line, habits_for(6.0), lying, 260)
    assert least > 15.0
    assert boat.en_m[0] > 350.0
    assert abs(boat.en_m[1] + 100.0) < 30.0
    _, bare, _ = sail(line, habits_for(6.0, look_ahead=False), lying, 200)
    assert bare > 5.0


def test_what_is_foreseen_is_set_by_the_current() -> None:
    """Steered by field across a stream she was foreseen beside the quay that she was set onto."""
    headings = np.array([0.0, 1.0, -2.0])
    still, _ = foresee(headings, 0.5, seen(), HABITS)
    carried = seen(current_en_mps=(0.6, -0.8), velocity_en_mps=(2.6, -0.8))  # the same way through the water
    stream, _ = foresee(headings, 0.5, carried, HABITS)
    run_m = stream - still
    assert run_m[:, :, 0] / 0.6 == pytest.approx(run_m[:, :, 1] / -0.8, abs=1e-9)
    assert np.all(np.diff(np.hypot(run_m[:, :, 0], run_m[:, :, 1])) >= 0.0)
    assert np.all(np.hypot(*run_m[:, -1].T) > 0.5 * HABITS.horizon_s)


def test_a_turn_looks_the_same_from_the_middle_of_it() -> None:
    """Seen to run straight on meanwhile, a turn that was chosen for its room had none when half of it was made."""
    speed, rate = 2.0, HABITS.turn_rate_radps
    habits = replace(HABITS, polar_mps=(speed, speed))
    track, lost = foresee(np.array([math.radians(170.0)]), 0.0, seen(50.0, speed=speed), habits)
    half_s = 2.5
    h = math.radians(50.0) + rate * half_s
    middle = seen(math.degrees(h), speed=speed, en_m=tuple(track[0, 1]))
    after, left = foresee(np.array([math.radians(170.0)]), 0.0, middle, habits)
    assert left[0] == pytest.approx(lost[0] - half_s)
    assert np.hypot(*(after[0, :-1] - track[0, 1:]).T).max() < 0.5


def test_who_does_not_tack_is_foreseen_to_turn_by_the_stern() -> None:
    """Beside a lee wall a boat that cannot tack was seen to turn away from it, and wore round onto it."""
    headings, wanted = np.array([math.radians(-60.0), math.radians(100.0)]), math.radians(240.0)
    never = replace(HABITS, tack_min_mps=math.inf)
    tacked, quick_s = foresee(headings, 0.0, seen(60.0), HABITS)
    worn, lost_s = foresee(headings, 0.0, seen(60.0), never)
    assert lost_s[0] == pytest.approx(wanted / HABITS.turn_rate_radps)
    assert quick_s[0] == pytest.approx((2.0 * math.pi - wanted) / HABITS.turn_rate_radps + HABITS.tack_s)
    assert tacked[0, :, 1].min() == 0.0
    assert worn[0, :, 1].min() < -10.0
    assert np.array_equal(tacked[1], worn[1])


def test_beside_a_lee_shore_who_does_not_tack_does_not_turn_towards_it() -> None:
    """Nor does one whose tack has failed: she wears round, too."""

    def off_wall(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(points[:, 1] + 12.0)

    back = replace(go_to((-100.0, 60.0), 0.0), clearance=off_wall)
    for never, state in (
        (replace(HABITS, tack_min_mps=math.inf), GuidanceState()),
        (HABITS, GuidanceState(failed_tacks=1)),
    ):
        after, told = step(state, seen(75.0), back, never)
        assert 0.0 < told.heading_rad < math.radians(90.0)
        assert after.manoeuvre is Manoeuvre.SAIL
    assert step(GuidanceState(), seen(75.0), back, HABITS)[0].manoeuvre is Manoeuvre.TACK


def test_an_obstacle_that_comes_repels_from_astern_too() -> None:
    """By her bow alone a boat that turned away from a ship was led back to it at once, and away again."""
    comes = MovingObstacle(en_m=(0.0, 200.0), velocity_en_mps=(0.0, -3.0), keep_m=80.0)
    goes = replace(comes, velocity_en_mps=(0.0, 3.0))
    there = hold_heading(0.0).field
    plain = there((0.0, 0.0))[0][1]
    for heading_deg, other, repels in [(h, comes, True) for h in (0.0, 90.0, 180.0, 270.0)] + [
        (0.0, goes, True),
        (180.0, goes, False),
    ]:
        met = avoiding(there, seen(heading_deg, obstacles=(other,)), HABITS)((0.0, 0.0))[0][1]
        assert (met < plain - 0.5) == repels


def test_a_motorboat_needs_no_wind() -> None:
    s = seen(0.0, twd_from_rad=None)
    habits = GuidanceSettings(is_sailing=False, polar_mps=(2.0, 2.0))
    _, setpoint = step(GuidanceState(), s, hold_heading(0.0), habits)
    assert setpoint.heading_rad == pytest.approx(0.0, abs=1e-9)
    ahead = MovingObstacle(en_m=(0.0, 60.0), keep_m=20.0)
    _, setpoint = step(GuidanceState(), replace(s, obstacles=(ahead,)), hold_heading(0.0), habits)
    assert setpoint.margin_m is not None
    assert setpoint.margin_m >= 0.0


def test_last_resort_takes_over_and_hands_back() -> None:
    r = LastResort()
    assert not r.step(0.0, too_near=False, can_plan=False).engaged
    assert not r.step(0.0, too_near=True, can_plan=True).engaged
    r = r.step(1.0, too_near=True, can_plan=False)
    assert r.engaged
    r = r.step(2.0, too_near=False, can_plan=True).step(8.0, too_near=False, can_plan=True)
    assert r.engaged
    assert r.step(9.0, too_near=True, can_plan=True).clear_since_s is None
    assert not r.step(12.5, too_near=False, can_plan=True).engaged

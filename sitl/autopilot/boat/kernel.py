"""The 50 Hz loop of the boat and its autopilot, compiled: wind, hull, wind vane, guidance, rudder and sheet.

``advance`` moves one state vector through whole loops of 20 ms and stops early when something happened that
the mission logic must see. The equations are those of ArduPilot's SIM_Sailboat (hull), AP_WindVane (filters),
sailboat.cpp (tacking), AR_WPNav and AR_PosControl (legs) and AR_AttitudeControl (rudder), restated; what the legs
and the corners do was fitted to recordings of the real program. With P_L1_PERIOD the legs are followed as ArduRover up
to 4.2 did it (``companion.boat.l1``).

Frame: east, north [m] from the boat's home; headings [rad] clockwise from north. Indices of the state (``S_``),
of the settings (``P_``) and the codes below are the interface.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar
from companion.boat.boat import CROSS_FLOW
from companion.boat.l1 import STEERS_FROM_MPS, lateral_mps2
from companion.boat.rover import (
    RUDDER_MAX_RAD,
    SLOWEST_MPS,
    TACK_DONE_RAD,
    TACK_RETRY_S,
    TACK_TIMEOUT_S,
    edge,
    is_beaten,
    leads_away,
    pace_share,
    position_control,
)
from companion.geo.kernels import wrap
from companion.kernels.jit import kernel


@kernel
def clip(x: float, low: float, high: float) -> float:
    """Return ``x``, or the end of low..high that it is beyond."""
    return low if x < low else min(x, high)


@kernel
def alpha(dt_s: float, cutoff_hz: float) -> float:
    """Return the share of the new value in a low-pass filter of one pole; 1 without a cut-off."""
    return 1.0 if cutoff_hz <= 0.0 else dt_s / (dt_s + 1.0 / (2.0 * math.pi * cutoff_hz))


def hash01(seed: int, number: int) -> float:
    """Return a number on 0..1 that depends on a seed and a number only (splitmix64); not compiled."""
    z = (seed * 0x9E3779B97F4A7C15 + number * 0xBF58476D1CE4E5B9 + 1) & 0xFFFFFFFFFFFFFFFF
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & 0xFFFFFFFFFFFFFFFF
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & 0xFFFFFFFFFFFFFFFF
    return ((z ^ (z >> 31)) >> 11) / float(1 << 53)


# Of the push on a boat whose sails are eased: what hull and mast leave.
WINDAGE = 0.25
# Angles to the wind at which the shares of speed are stated, straight between and level beyond them.
BEAT_RAD, REACH_RAD, RUN_RAD = math.radians(45.0), math.radians(90.0), math.radians(150.0)
# A boat in irons lies so far off the wind, on the tack that it came from; it sails again beyond the other.
IRONS_RAD, FILLED_RAD = math.radians(15.0), math.radians(50.0)
SETTLING_HZ, FALLING_RADPS = 0.5, 0.35


@kernel
def side_mps(
    coefficient: float, aws_mps: float, awa_rad: float, speed_mps: float, sail_rad: float, ideal_rad: float
) -> float:
    """Return the speed to starboard [m/s] at which the water's push balances that of the sail.

    As ``companion.boat.boat`` has it, and an eased sail leaves ``WINDAGE`` of the push.
    """
    drawing = clip((abs(awa_rad) - sail_rad) / max(ideal_rad, 0.1), 0.0, 1.0)
    push = coefficient * aws_mps * aws_mps * abs(math.sin(awa_rad)) * (WINDAGE + (1.0 - WINDAGE) * drawing)
    if push == 0.0:
        return 0.0
    way = abs(speed_mps)
    side = 2.0 * push / (math.sqrt(way * way + 4.0 * CROSS_FLOW * push) + way)
    return -side if awa_rad > 0.0 else side


@kernel
def speed_share(angle_rad: float, beat: float, reach: float, run: float) -> float:
    """Return the share of the polar's speed that the boat makes at an angle to the true wind."""
    if angle_rad < REACH_RAD:
        return beat + (reach - beat) * clip((angle_rad - BEAT_RAD) / (REACH_RAD - BEAT_RAD), 0.0, 1.0)
    return reach + (run - reach) * clip((angle_rad - REACH_RAD) / (RUN_RAD - REACH_RAD), 0.0, 1.0)


@kernel
def falls_off(angle_rad: float, is_caught: bool) -> tuple[float, bool]:
    """Return the turn [rad/s] of a boat whose tack failed, and whether it sails again.

    ``angle_rad`` is where the wind is, positive on the side of the tack that it came from, and a positive turn
    brings it ahead. Caught, it lies near head to wind; then it falls off to the old tack.
    """
    if is_caught:
        return SETTLING_HZ * (angle_rad - IRONS_RAD), False
    return -FALLING_RADPS, angle_rad > FILLED_RAD


POLAR_STEP_MPS = 0.5
# Lift and drag of the sail per m/s of apparent wind, by angle of attack in steps of 10 degrees (SIM_Sailboat).
_LIFT = np.array([0.0, 0.5, 1.0, 1.1, 0.95, 0.75, 0.6, 0.4, 0.2, 0.0, -0.2, -0.4, -0.6, -0.75, -0.95, -1.1, -1.0, -0.5])
_DRAG = np.array([0.1, 0.1, 0.2, 0.4, 0.8, 1.2, 1.5, 1.7, 1.9, 1.95, 1.9, 1.7, 1.5, 1.2, 0.8, 0.4, 0.2, 0.1])


@kernel
def sail_force(aws_mps: float, awa_rad: float, sail_rad: float) -> float:
    """Return the driving force [N]: F = aws (CL sin|b| - CD cos b), linear in the apparent wind speed."""
    angle = abs(awa_rad)
    attack = max(math.degrees(angle - sail_rad), 0.0)
    if attack >= 170.0:
        lift, drag = _LIFT[17], _DRAG[17]
    else:
        i = int(attack / 10.0)
        share = attack / 10.0 - i
        lift = _LIFT[i] + share * (_LIFT[i + 1] - _LIFT[i])
        drag = _DRAG[i] + share * (_DRAG[i + 1] - _DRAG[i])
    return float(aws_mps * (lift * math.sin(angle) - drag * math.cos(angle)))


@kernel
def polar_speed(polar: NDArray[np.float64], twa_rad: float, tws_mps: float) -> float:
    """Return the speed [m/s] in a table by whole degrees (0..180) and steps of POLAR_STEP_MPS; its last one above."""
    row = min(abs(math.degrees(twa_rad)), 180.0)
    column = min(tws_mps / POLAR_STEP_MPS, polar.shape[1] - 1.0)
    i, j = min(int(row), 179), min(int(column), polar.shape[1] - 2)
    f, g = row - i, column - j
    low = (1.0 - g) * polar[i, j] + g * polar[i, j + 1]
    return float((1.0 - f) * low + f * ((1.0 - g) * polar[i + 1, j] + g * polar[i + 1, j + 1]))


@kernel
def polar_force(speed_mps: float, force: float, awa_rad: float, sail_rad: float, ideal_rad: float) -> float:
    """Return the driving force [N] of a boat whose polar says ``speed_mps``; ``force`` is that of SIM_Sailboat's sail.

    Sheeted as the autopilot does for full speed it balances the drag at that speed; eased by the sail's ideal angle of
    attack it is none. Near head to wind the sail pushes it astern as it does there.
    """
    eased = sail_rad - clip(abs(awa_rad) - ideal_rad, 0.0, 0.5 * math.pi)
    drawing = 1.0 - clip(eased / max(ideal_rad, 0.1), 0.0, 1.0)
    return 0.5 * speed_mps * speed_mps * drawing + min(force, 0.0)


def polar_table(polar: Polar) -> NDArray[np.float64]:
    """Return a polar as ``polar_speed`` looks it up: by whole degrees, and steps of wind up to its last and one more.

    Without wind nobody sails, not even a boat whose polar is one speed for every wind.
    """
    winds = np.arange(0.0, float(polar.tws_mps[-1]) + 2.0 * POLAR_STEP_MPS, POLAR_STEP_MPS)
    angles = np.radians(np.arange(181.0))
    table = np.stack([polar.speeds_mps(angles, float(tws)) for tws in winds], axis=1)
    table[:, 0] = 0.0
    return table


LOOP_S = 0.02
SUBSTEPS = 4

# --- state -----------------------------------------------------------------------------------------------------
S_E, S_N, S_YAW, S_V, S_VE, S_VN, S_RATE = range(7)  # position, heading, speed through water, over ground
S_WDIR, S_WSPD = 7, 8  # true wind that acts (from, speed)
S_TICK = 9  # loops since the autopilot was made
S_RUDDER, S_SAIL = 10, 11  # -1..1, and sail angle [rad]
# vane: raw apparent, filtered apparent, filtered true
S_AWA_RAW, S_AWS, S_AWA_SIN, S_AWA_COS, S_TWS, S_TWD_SIN, S_TWD_COS, S_VANE_SET = range(12, 20)
S_WANT_RATE, S_INTEGRAL = 20, 21  # rate controller
S_STEER, S_THRUST = 22, 23  # how to steer (STEER_), desired speed
S_WANT_YAW, S_WANT_TURN = 24, 25  # set-points: heading [rad], turn rate [rad/s]
S_OE, S_ON, S_DE, S_DN, S_XE, S_XN = range(26, 32)  # leg: origin, destination, the next destination
S_FAST, S_IN, S_OUT = 32, 33, 34  # corner at the end? curve lengths behind and ahead [m]
S_PE, S_PN = 35, 36  # unit vector of the previous leg
S_PHASE, S_U, S_SCALE = 37, 38, 39  # target: curve in, straight, curve out; place; pace
S_TE, S_TN = 40, 41  # target point
S_XTRACK, S_DIST, S_BEARING = 42, 43, 44  # cross-track (+: boat left of the leg), to go
S_TACKING, S_TACK_YAW, S_TACK_START, S_TACK_END, S_TACK_ASKED = range(45, 50)
S_LE, S_LN, S_LOITER_YAW = 50, 51, 52  # where to loiter
S_ARMED, S_EASE, S_NAV_YAW, S_TACKS = 54, 55, 56, 57  # sheet eased by avoidance; heading steered
S_CURRENT_E, S_CURRENT_N = 58, 59  # of the water [m/s]
S_VANE_FAULT, S_VANE_VALUE, S_AVOID = 60, 61, 62  # FAULT_, its angle [rad]; near a fence
S_MOORED, S_MOTOR, S_THROTTLE = 63, 64, 65
S_INDIRECT = 66
S_WANT_SPEED = 69  # desired speed, accelerated at P_ACCEL
S_GPS_E, S_GPS_N = 67, 68  # error of the position that the autopilot believes
S_L1_ANGLE, S_L1_NUDGE = 53, 71  # what the L1 law remembers
S_COMPASS = 70  # error of the heading that it believes [rad]
# of a boat that is not the plan's (``P_OTHER``): leeway to starboard [m/s], the share of its speed that waves leave,
# the turn that they give it [rad/s], a number on 0..1 for the next tack, tacks tried and failed, the tack that it was
# last settled on (its sign of the wind's angle), whether this one was tried, until when it lies in irons
S_SIDE, S_SEA, S_WOBBLE, S_LOT, S_TRIES, S_FAILED, S_TACK_SIDE, S_TRIED, S_IRONS_END = range(72, 81)
S_SIZE = 82

# --- settings --------------------------------------------------------------------------------------------------
(
    P_NOGO,
    P_XTRACK_MAX,
    P_IDEAL,
    P_SAIL_MIN,
    P_SAIL_MAX,
    P_LOITER_RADIUS,
    P_WP_RADIUS,
    P_WP_SPEED,
    P_PIVOT_RATE,
    P_ANG_P,
    P_RATE_P,
    P_RATE_I,
    P_RATE_FF,
    P_RATE_MAX,
    P_RATE_ACC,
    P_SCALE_BASE,
    P_POS_P,
    P_VEL_P,
    P_ACCEL,
    P_TURN_MAX_G,
    P_DIR_FILT,
    P_SPD_FILT,
    P_TRUE_FILT,
    P_WIND_TC,
    P_VANE,
    P_SPEED_MIN,
    P_TURN_RADIUS,
    P_VANE_OFFSET,
    P_SPEED_SENSOR,
) = range(29)
# of a boat that is not the plan's; none of them counts without the first
P_OTHER, P_LEEWAY, P_BEAT, P_REACH, P_RUN, P_TACK_FAILS, P_IRONS_S = range(32, 39)
# of ArduRover up to 4.2; without the first it steers by position control
P_L1_PERIOD, P_L1_DAMPING, P_L1_XTRACK_I = range(29, 32)
P_SIZE = 40

STEER_OFF, STEER_HOLD, STEER_LEG, STEER_LOITER, STEER_HEADING, STEER_RATE = range(6)
FAULT_NONE, FAULT_FROZEN, FAULT_OFFSET, FAULT_SPIKES = range(4)
REACHED, TACKED, TACK_TIMED_OUT = 1, 2, 4

MOORED, ANCHORED = 1.0, 2.0  # in S_MOORED: until it is armed; whatever it does

TACK_REQUEST_S = 0.5
MASS_KG = 2.0
MOTOR_MPS = 2.0  # speed under the auxiliary motor: what a small boat's makes
TURNING_CIRCLE_M = 1.8
WIND_DELAY_S = 5.0
# A tack is tried where the wind comes within the first of ahead, having been beyond the second.
HEAD_TO_WIND_RAD = math.radians(12.0)
SETTLED_RAD = math.radians(30.0)
IRONS_DRAG = 4.0  # in irons, sails and rudder across the stream: of the hull's own drag
FALLING_OFF_S = 8.0  # at most, until the boat sails again
# AP_WindVane filters with dt = 0.05 s, but its 20 Hz task runs at every second loop: 25 Hz.
VANE_DT_S = 0.05
VANE_LOOPS = 2

Vector = NDArray[np.float64]


@kernel
def _hull(s: Vector, p: Vector, polar: NDArray[np.float64]) -> None:
    """Move the hull by one loop: SIM_Sailboat's one-dimensional model with exact yaw kinematics."""
    dt = LOOP_S / SUBSTEPS
    we, wn = -s[S_WSPD] * math.sin(s[S_WDIR]), -s[S_WSPD] * math.cos(s[S_WDIR])
    ce, cn = (s[S_CURRENT_E], s[S_CURRENT_N]) if s[S_ARMED] else (0.0, 0.0)
    is_other = p[P_OTHER] > 0.0
    for _ in range(SUBSTEPS):
        v, yaw = s[S_V], s[S_YAW]
        ve, vn = v * math.sin(yaw) + ce, v * math.cos(yaw) + cn
        if is_other:
            ve, vn = ve + s[S_SIDE] * math.cos(yaw), vn - s[S_SIDE] * math.sin(yaw)
        ae, an = ve - we, vn - wn
        aws = math.hypot(ae, an)
        awa = wrap(math.atan2(ae, an) - yaw)
        force = sail_force(aws, awa, s[S_SAIL])
        if polar.shape[0] > 0:
            # a polar is of the wind over the water
            twa = wrap(math.atan2(ce - we, cn - wn) - yaw)
            speed = polar_speed(polar, twa, math.hypot(ce - we, cn - wn))
            force = polar_force(speed, force, awa, s[S_SAIL], p[P_IDEAL])
        rate = v * math.sin(s[S_RUDDER] * RUDDER_MAX_RAD) * 2.0 / (TURNING_CIRCLE_M * math.sin(RUDDER_MAX_RAD))
        if s[S_MOTOR] > 0.0:
            # the auxiliary motor, with the sails down: full throttle balances the drag at MOTOR_MPS
            force = s[S_THROTTLE] * 0.5 * MOTOR_MPS * MOTOR_MPS
        drag = 0.5 * v * abs(v)
        if is_other:
            twa = wrap(math.atan2(ce - we, cn - wn) - yaw)
            force, drag, rate = _depart(s, p, twa, force, drag, rate)
            s[S_SIDE] = side_mps(p[P_LEEWAY], aws, awa, v, s[S_SAIL], p[P_IDEAL])
        v += (force - drag) / MASS_KG * dt
        half = yaw + 0.5 * rate * dt
        s[S_VE], s[S_VN] = v * math.sin(half) + ce, v * math.cos(half) + cn
        if is_other:
            s[S_VE] += s[S_SIDE] * math.cos(half)
            s[S_VN] -= s[S_SIDE] * math.sin(half)
        s[S_E] += s[S_VE] * dt
        s[S_N] += s[S_VN] * dt
        s[S_YAW] = wrap(yaw + rate * dt)
        s[S_V] = v
        s[S_RATE] = rate


@kernel
def _depart(s: Vector, p: Vector, twa: float, force: float, drag: float, rate: float) -> tuple[float, float, float]:
    """Return force, drag and turn of a boat that is not the plan's: slower, thrown about by waves, caught in irons."""
    t = s[S_TICK] * LOOP_S
    if s[S_MOTOR] == 0.0:
        share = speed_share(abs(twa), p[P_BEAT], p[P_REACH], p[P_RUN])
        if force > 0.0:
            force *= (share * s[S_SEA]) ** 2  # speed goes with the root of the force
        side = 1.0 if twa > 0.0 else -1.0
        if abs(twa) > SETTLED_RAD:
            if t >= s[S_IRONS_END] or side == s[S_TACK_SIDE]:
                s[S_TACK_SIDE], s[S_TRIED] = side, 0.0
        elif abs(twa) < HEAD_TO_WIND_RAD and s[S_TRIED] == 0.0 and s[S_TACK_SIDE] != 0.0:
            s[S_TRIED] = 1.0
            s[S_TRIES] += 1.0
            if s[S_LOT] < p[P_TACK_FAILS]:
                s[S_FAILED] += 1.0
                s[S_IRONS_END] = t + p[P_IRONS_S] + FALLING_OFF_S
        if t < s[S_IRONS_END]:
            is_caught = t < s[S_IRONS_END] - FALLING_OFF_S
            rate, is_over = falls_off(twa * s[S_TACK_SIDE], is_caught)
            rate *= s[S_TACK_SIDE]
            if is_caught:
                force = min(force, 0.0)
                if s[S_V] > 0.0:
                    drag *= IRONS_DRAG
            elif is_over:
                s[S_IRONS_END] = t
    return force, drag, rate + s[S_WOBBLE]


@kernel
def _vane(s: Vector, p: Vector, noise: float) -> None:
    """AP_WindVane: raw apparent wind, its filters, true wind from it and the ground velocity, its filter."""
    if p[P_VANE] == 0.0:
        return
    if p[P_VANE] == 11.0:
        raw_speed, raw_awa = 0.0, 0.0  # "SITL apparent" is never filled by this model
    else:
        ae = s[S_WSPD] * math.sin(s[S_WDIR]) + s[S_VE]
        an = s[S_WSPD] * math.cos(s[S_WDIR]) + s[S_VN]
        raw_speed = math.hypot(ae, an)
        raw_awa = wrap(math.atan2(ae, an) - s[S_YAW] + p[P_VANE_OFFSET])
    if s[S_VANE_FAULT] == FAULT_FROZEN:
        raw_awa = s[S_AWA_RAW]
    elif s[S_VANE_FAULT] == FAULT_OFFSET:
        raw_awa = wrap(raw_awa + s[S_VANE_VALUE])
    elif s[S_VANE_FAULT] == FAULT_SPIKES:
        # now and then (one reading in fifty) the vane points anywhere within the stated angle
        raw_awa = wrap(raw_awa + (s[S_VANE_VALUE] * (noise * 100.0 - 1.0) if noise < 0.02 else 0.0))
    s[S_AWA_RAW] = raw_awa
    believed = s[S_YAW] + s[S_COMPASS]
    a_dir, a_spd = alpha(VANE_DT_S, p[P_DIR_FILT]), alpha(VANE_DT_S, p[P_SPD_FILT])
    a_true = alpha(VANE_DT_S, p[P_TRUE_FILT])
    if s[S_VANE_SET] == 0.0:
        a_dir = a_spd = a_true = 1.0
        s[S_VANE_SET] = 1.0
    s[S_AWA_SIN] += a_dir * (math.sin(raw_awa) - s[S_AWA_SIN])
    s[S_AWA_COS] += a_dir * (math.cos(raw_awa) - s[S_AWA_COS])
    if p[P_SPEED_SENSOR] == 0.0:
        # no speed sensor: the "true" direction is the apparent one turned by the heading, the speed 0
        awa = math.atan2(s[S_AWA_SIN], s[S_AWA_COS])
        s[S_AWS] = s[S_TWS] = 0.0
        s[S_TWD_SIN], s[S_TWD_COS] = math.sin(awa + believed), math.cos(awa + believed)
        return
    s[S_AWS] += a_spd * (raw_speed - s[S_AWS])
    if raw_speed < p[P_SPEED_MIN]:
        return
    # true speed and direction from the filtered apparent speed and the raw apparent direction
    from_e = s[S_AWS] * math.sin(raw_awa + believed) - s[S_VE]
    from_n = s[S_AWS] * math.cos(raw_awa + believed) - s[S_VN]
    speed = math.hypot(from_e, from_n)
    if speed > 1e-9:
        s[S_TWD_SIN] += a_true * (from_e / speed - s[S_TWD_SIN])
        s[S_TWD_COS] += a_true * (from_n / speed - s[S_TWD_COS])
    s[S_TWS] += a_true * (speed - s[S_TWS])


@kernel
def _indirect(s: Vector, p: Vector, yaw_rad: float) -> bool:
    """sailboat.cpp use_indirect_route: is this course within the no-go zone and its pad?"""
    if s[S_MOTOR] > 0.0:
        return False
    if s[S_TACKING]:
        return True
    twd = math.atan2(s[S_TWD_SIN], s[S_TWD_COS])
    return is_beaten(twd, yaw_rad, p[P_NOGO])


@kernel
def _upwind_heading(s: Vector, p: Vector, yaw_rad: float) -> tuple[float, int]:
    """sailboat.cpp calc_heading: the heading to steer for a course in the no-go zone, and events."""
    events = 0
    t = s[S_TICK] * LOOP_S
    twd = math.atan2(s[S_TWD_SIN], s[S_TWD_COS])
    on_port = math.atan2(s[S_AWA_SIN], s[S_AWA_COS]) < 0.0  # wind over the port side
    tacking = s[S_TACKING] > 0.0
    should_tack = False
    if abs(wrap(twd - yaw_rad)) > p[P_NOGO] and not tacking:
        if (wrap(twd - yaw_rad) < 0.0) == on_port:
            return yaw_rad, events
        should_tack = True
    if s[S_TACK_ASKED] > 0.0 and not should_tack and not tacking:
        should_tack = t - s[S_TACK_ASKED] < TACK_REQUEST_S
        s[S_TACK_ASKED] = 0.0
    if not should_tack and not tacking:
        should_tack = leads_away(s[S_XTRACK], p[P_XTRACK_MAX], on_port)
    if should_tack and t - s[S_TACK_END] > TACK_RETRY_S:
        s[S_TACK_YAW] = edge(twd, p[P_NOGO], not on_port)
        s[S_TACKING] = 1.0
        s[S_TACK_START] = t
        s[S_TACKS] += 1.0
        tacking = True
        events |= TACKED
    if tacking:
        if abs(wrap(s[S_TACK_YAW] - s[S_YAW] - s[S_COMPASS])) <= TACK_DONE_RAD:
            s[S_TACKING] = 0.0
            s[S_TACK_END] = t
        elif t - s[S_TACK_START] > TACK_TIMEOUT_S:
            s[S_TACKING] = 0.0
            s[S_TACK_END] = t
            events |= TACK_TIMED_OUT
        return s[S_TACK_YAW], events
    return edge(twd, p[P_NOGO], on_port), events


@kernel
def _target(s: Vector, p: Vector) -> tuple[float, float, float, float, bool]:
    """Move the target point along the leg; return its velocity, its acceleration and whether it has arrived.

    The straight part runs at WP_SPEED with acceleration and braking at P_ACCEL; a corner is the sum of braking
    on the old leg and accelerating on the new one, which is a parabola: it starts and ends d before and after
    the corner, d = 2 WP_RADIUS / sin(half the turn), and its middle, where the waypoint counts as reached, is
    WP_RADIUS from it.
    """
    le, ln = s[S_DE] - s[S_OE], s[S_DN] - s[S_ON]
    length = math.hypot(le, ln)
    if length > 1e-6:
        ue, un = le / length, ln / length
    else:
        ue, un = math.sin(s[S_YAW]), math.cos(s[S_YAW])
    accel = p[P_ACCEL]
    he, hn, a_e, a_n = ue, un, 0.0, 0.0
    phase = s[S_PHASE]
    if phase != 1.0:  # in a curve
        if phase == 0.0:
            d, fe, fn, te, tn = s[S_IN], s[S_PE], s[S_PN], ue, un
        else:
            ge, gn = s[S_XE] - s[S_DE], s[S_XN] - s[S_DN]
            g = max(math.hypot(ge, gn), 1e-6)
            d, fe, fn, te, tn = s[S_OUT], ue, un, ge / g, gn / g
        u = s[S_U]
        v0 = math.sqrt(2.0 * accel * d)
        he, hn = (1.0 - u) * v0 * fe + u * v0 * te, (1.0 - u) * v0 * fn + u * v0 * tn
        a_e, a_n = accel * (te - fe), accel * (tn - fn)
        pace = max(math.hypot(he, hn), 0.3)
        norm = max(math.hypot(he, hn), 1e-6)
        de, dn = he / norm, hn / norm
    else:
        de, dn = ue, un
        # speeding up since the last corner or the start, braking for the next corner or the end
        pace = math.sqrt(2.0 * accel * max(min(s[S_U], length - s[S_U]), 0.0))
        pace = clip(pace, 0.5, p[P_WP_SPEED])
        he, hn = pace * ue, pace * un
    # the target waits for the boat, and keeps a little ahead of it
    error = (s[S_TE] - (s[S_E] + s[S_GPS_E])) * de + (s[S_TN] - (s[S_N] + s[S_GPS_N])) * dn
    along = s[S_VE] * de + s[S_VN] * dn
    want = pace_share(along, error, pace, p[P_POS_P])
    s[S_SCALE] += (want - s[S_SCALE]) * LOOP_S
    step = s[S_SCALE] * pace * LOOP_S
    arrived = False
    if phase == 1.0:
        s[S_U] += step
        if s[S_U] >= length - s[S_OUT]:
            if s[S_FAST] and s[S_OUT] > 0.0:
                s[S_PHASE] = 2.0
                s[S_U] = 0.0
            else:
                s[S_U] = max(length - s[S_OUT], 0.0)
                arrived = True
        s[S_TE], s[S_TN] = s[S_OE] + s[S_U] * ue, s[S_ON] + s[S_U] * un
        return he, hn, a_e, a_n, arrived
    d = s[S_IN] if phase == 0.0 else s[S_OUT]
    duration = 2.0 * d / max(math.sqrt(2.0 * accel * d), 1e-6)
    s[S_U] += s[S_SCALE] * LOOP_S / max(duration, LOOP_S)
    u = min(s[S_U], 1.0)
    if phase == 0.0:
        ce, cn, fe, fn, te, tn = s[S_OE], s[S_ON], s[S_PE], s[S_PN], ue, un
    else:
        ge, gn = s[S_XE] - s[S_DE], s[S_XN] - s[S_DN]
        g = max(math.hypot(ge, gn), 1e-6)
        ce, cn, fe, fn, te, tn = s[S_DE], s[S_DN], ue, un, ge / g, gn / g
    s[S_TE] = ce - d * (1.0 - u) ** 2 * fe + d * u * u * te
    s[S_TN] = cn - d * (1.0 - u) ** 2 * fn + d * u * u * tn
    if phase == 0.0 and u >= 1.0:
        s[S_PHASE] = 1.0
        s[S_U] = d
    elif phase == 2.0 and u >= 0.5:
        arrived = True
    return he, hn, a_e, a_n, arrived


@kernel
def _leg(s: Vector, p: Vector) -> tuple[float, float, bool, int]:
    """Follow the leg: return (heading, turn rate, heading is meant, events)."""
    events = 0
    by_l1 = p[P_L1_PERIOD] > 0.0
    he, hn, a_e, a_n, arrived = (0.0, 0.0, 0.0, 0.0, True) if by_l1 else _target(s, p)
    le, ln = s[S_DE] - s[S_OE], s[S_DN] - s[S_ON]
    length = math.hypot(le, ln)
    de, dn = s[S_DE] - (s[S_E] + s[S_GPS_E]), s[S_DN] - (s[S_N] + s[S_GPS_N])
    s[S_DIST] = math.hypot(de, dn)
    s[S_BEARING] = math.atan2(de, dn)
    if length > 1e-6:
        s[S_XTRACK] = (((s[S_N] + s[S_GPS_N]) - s[S_ON]) * le - ((s[S_E] + s[S_GPS_E]) - s[S_OE]) * ln) / length
        past = ((s[S_E] + s[S_GPS_E]) - s[S_OE]) * le + ((s[S_N] + s[S_GPS_N]) - s[S_ON]) * ln >= length * length
    else:
        s[S_XTRACK], past = 0.0, True
    if arrived and ((s[S_FAST] and not by_l1) or s[S_DIST] <= p[P_WP_RADIUS] or past):
        events |= REACHED
    if s[S_AVOID] and not s[S_TACKING]:
        s[S_TACK_ASKED] = s[S_TICK] * LOOP_S  # avoidance asks for a tack; it is heard only on an upwind route
    if _indirect(s, p, s[S_BEARING]):
        s[S_INDIRECT] = 1.0
        heading, more = _upwind_heading(s, p, s[S_BEARING])
        return heading, 0.0, True, events | more
    s[S_INDIRECT] = 0.0
    limit = p[P_TURN_MAX_G] * 9.80665
    if by_l1:
        lateral, s[S_L1_ANGLE], s[S_L1_NUDGE] = lateral_mps2(
            (s[S_E] + s[S_GPS_E], s[S_N] + s[S_GPS_N]),
            (s[S_VE], s[S_VN]),
            s[S_YAW] + s[S_COMPASS],
            (s[S_OE], s[S_ON], s[S_DE], s[S_DN]),
            (p[P_L1_PERIOD], p[P_L1_DAMPING], p[P_L1_XTRACK_I], p[P_WP_RADIUS]),
            (s[S_L1_ANGLE], s[S_L1_NUDGE]),
            LOOP_S,
        )
        return 0.0, clip(lateral, -limit, limit) / max(abs(s[S_V]), STEERS_FROM_MPS), False, events
    yaw = s[S_YAW] + s[S_COMPASS]
    lateral, s[S_WANT_SPEED] = position_control(
        (s[S_TE] - (s[S_E] + s[S_GPS_E]), s[S_TN] - (s[S_N] + s[S_GPS_N])),
        (he, hn, a_e, a_n),
        (s[S_VE], s[S_VN]),
        (math.sin(yaw), math.cos(yaw)),
        s[S_WANT_SPEED],
        (p[P_POS_P], p[P_VEL_P], p[P_WP_SPEED], p[P_ACCEL], limit, p[P_TURN_RADIUS]),
        LOOP_S,
    )
    if s[S_EASE]:
        s[S_WANT_SPEED] = 0.0  # it starts from there when the sheet is hauled in again
    return 0.0, lateral / max(s[S_WANT_SPEED], SLOWEST_MPS), False, events


@kernel
def _loiter(s: Vector, p: Vector) -> tuple[float, int]:
    """Mode loiter of a sailboat: keep the heading within the radius, sail to its centre from outside."""
    de, dn = s[S_LE] - (s[S_E] + s[S_GPS_E]), s[S_LN] - (s[S_N] + s[S_GPS_N])
    s[S_DIST] = math.hypot(de, dn)
    s[S_BEARING] = math.atan2(de, dn)
    if s[S_DIST] > p[P_LOITER_RADIUS]:
        s[S_LOITER_YAW] = s[S_BEARING]
    if _indirect(s, p, s[S_LOITER_YAW]):
        s[S_INDIRECT] = 1.0
        heading, events = _upwind_heading(s, p, s[S_LOITER_YAW])
        s[S_LOITER_YAW] = heading
        return heading, events
    s[S_INDIRECT] = 0.0
    return s[S_LOITER_YAW], 0


@kernel
def _rudder(s: Vector, p: Vector, rate_rad: float) -> None:
    """AR_AttitudeControl: acceleration-limited turn rate, PI with feed-forward, less rudder at speed."""
    change = p[P_RATE_ACC] * LOOP_S
    if change > 0.0:
        rate_rad = clip(rate_rad, s[S_WANT_RATE] - change, s[S_WANT_RATE] + change)
    if p[P_RATE_MAX] > 0.0:
        rate_rad = clip(rate_rad, -p[P_RATE_MAX], p[P_RATE_MAX])
    s[S_WANT_RATE] = rate_rad
    error = rate_rad - s[S_RATE]
    s[S_INTEGRAL] = clip(s[S_INTEGRAL] + error * p[P_RATE_I] * LOOP_S, -1.0, 1.0)
    out = clip(p[P_RATE_P] * error + s[S_INTEGRAL] + p[P_RATE_FF] * rate_rad, -1.0, 1.0)
    speed = s[S_V]
    if speed < 0.0:
        out = -out
    if abs(speed) > p[P_SCALE_BASE] > 0.0:
        out *= p[P_SCALE_BASE] / abs(speed)
    s[S_RUDDER] = out


@kernel
def _control(s: Vector, p: Vector) -> int:
    """One loop of the vehicle: what to steer, rudder and sheet. Returns events."""
    steer = s[S_STEER]
    if not s[S_ARMED]:
        s[S_RUDDER], s[S_SAIL], s[S_INTEGRAL], s[S_WANT_RATE] = 0.0, 0.0, 0.0, 0.0
        s[S_THROTTLE] = 0.0
        return 0
    if steer in (STEER_HOLD, STEER_OFF):
        # HOLD eases the sheet; the throttle stick at rest hauls it in
        sail = p[P_SAIL_MAX] if steer == STEER_HOLD else p[P_SAIL_MIN]
        s[S_RUDDER], s[S_SAIL], s[S_INTEGRAL], s[S_WANT_RATE] = 0.0, sail, 0.0, 0.0
        s[S_THROTTLE] = 0.0
        return 0
    events = 0
    thrust = 1.0
    heading, rate, by_heading = 0.0, 0.0, True
    if steer == STEER_LEG:
        heading, rate, by_heading, events = _leg(s, p)
        if s[S_EASE]:
            thrust = 0.0
    elif steer == STEER_LOITER:
        heading, events = _loiter(s, p)
        if s[S_MOTOR] > 0.0 and s[S_DIST] <= p[P_LOITER_RADIUS]:
            thrust = 0.0
    elif steer == STEER_HEADING:
        heading, thrust = s[S_WANT_YAW], s[S_THRUST]
    else:
        rate, by_heading, thrust = s[S_WANT_TURN], False, s[S_THRUST]
    if by_heading:
        rate = p[P_ANG_P] * wrap(heading - s[S_YAW] - s[S_COMPASS])
        if s[S_TACKING] and p[P_PIVOT_RATE] > 0.0:
            rate = clip(rate, -p[P_PIVOT_RATE], p[P_PIVOT_RATE])
        s[S_NAV_YAW] = heading
    _rudder(s, p, rate)
    s[S_THROTTLE] = thrust
    if thrust > 0.0:
        awa = abs(math.atan2(s[S_AWA_SIN], s[S_AWA_COS]))
        s[S_SAIL] = clip(awa - p[P_IDEAL], p[P_SAIL_MIN], p[P_SAIL_MAX])
    else:
        s[S_SAIL] = p[P_SAIL_MAX]
    return events


@kernel
def advance(
    s: Vector,
    p: Vector,
    wind: NDArray[np.float64],
    first_tick: int,
    noise: Vector,
    loops: int,
    polar: NDArray[np.float64],
) -> tuple[int, int]:
    """Run up to ``loops`` loops; return (loops done, events). Stops after the loop in which an event happens.

    ``wind[i]`` is (from [rad], speed [m/s]) of the loops first_tick + 5 i .. + 4; ``noise`` is one number on 0..1
    per loop for a faulty vane, or empty; ``polar`` the table of ``polar_speed``, or empty for SIM_Sailboat's own hull.
    """
    for done in range(loops):
        s[S_TICK] += 1.0
        tick = int(s[S_TICK])
        i = (tick - first_tick) // 5
        # SITL lets the wind follow its set value with tau = SIM_WIND_TC / 2 pi, direction and speed apart
        a = alpha(LOOP_S, 1.0 / max(p[P_WIND_TC], 0.1))
        s[S_WSPD] += a * (wind[i, 1] - s[S_WSPD])
        s[S_WDIR] = wrap(s[S_WDIR] + a * wrap(wind[i, 0] - s[S_WDIR]))
        if s[S_MOORED] == ANCHORED:
            s[S_V], s[S_VE], s[S_VN], s[S_RATE] = 0.0, 0.0, 0.0, 0.0
        elif not (s[S_MOORED] and not s[S_ARMED]):
            _hull(s, p, polar)
        if tick % VANE_LOOPS == 0:
            _vane(s, p, noise[done] if noise.shape[0] > 0 else 1.0)
        events = _control(s, p)
        if events:
            return done + 1, events
    return loops, 0

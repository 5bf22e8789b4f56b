"""The predicted track, compiled: a point that runs along the legs, a boat that is steered to it, and its tacks.

The guidance is ArduRover's since 4.3, restated: AR_WPNav's point on the legs, which waits for the boat and rounds each
corner in a curve of its own acceleration, and the laws of ``companion.boat.rover``. With ``H_L1_PERIOD`` it is that of
4.2 and before: ``companion.boat.l1`` in place of the point and of AR_PosControl. The boat is a speed that follows the
polar and a yaw rate that follows what is asked: no more is known of most boats. What it leaves out is in the stated
error (``companion.boat.tracking``).

Frame: east, north [m]; headings [rad] clockwise from north; the wind's direction is where it comes from.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

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

# AR_WPNav's point on one leg, compiled: from rest to rest under a greatest speed, acceleration and jerk.
#
# Restated from ArduPilot's AP_Math/SCurve.cpp: seven phases of constant jerk. The original rounds the corners of the
# jerk off (AR_WPNAV_SNAP_MAX 15 m/s^4, a tenth of a second), which is left out.


@kernel
def top_speed_mps(length_m: float, speed_mps: float, accel: float, jerk: float) -> float:
    """Return the highest speed on a leg."""
    # to v and back takes v (v / a + a / j) metres, or 2 v sqrt(v / j) where the acceleration is never full
    full = accel * accel / jerk
    v = float((length_m * math.sqrt(jerk) / 2.0) ** (2.0 / 3.0))
    if v > full:
        b = full
        v = 0.5 * (-b + math.sqrt(b * b + 4.0 * accel * length_m))
    return max(min(v, speed_mps), 1e-3)


@kernel
def rise_s(v: float, accel: float, jerk: float) -> float:
    """Return how long it takes to gather a speed."""
    full = accel * accel / jerk
    return v / accel + accel / jerk if v >= full else 2.0 * math.sqrt(v / jerk)


@kernel
def leg_s(length_m: float, v: float, rise: float) -> float:
    """Return how long a leg takes whose top speed is ``v``, gathered in ``rise``."""
    return 2.0 * rise + max(0.0, length_m - v * rise) / v


@kernel
def along(t: float, v: float, rise: float, accel: float, jerk: float) -> tuple[float, float, float]:
    """Return place, speed and acceleration ``t`` after setting off towards top speed ``v``, gathered in ``rise``."""
    if t >= rise:
        return 0.5 * v * rise + v * (t - rise), v, 0.0
    ramp = accel / jerk if v >= accel * accel / jerk else 0.5 * rise
    top = jerk * ramp
    if t <= ramp:
        return jerk * t * t * t / 6.0, 0.5 * jerk * t * t, jerk * t
    if t <= rise - ramp:
        d = t - ramp
        v1 = 0.5 * jerk * ramp * ramp
        return jerk * ramp * ramp * ramp / 6.0 + v1 * d + 0.5 * top * d * d, v1 + top * d, top
    d = rise - t
    return 0.5 * v * rise - (v * d - jerk * d * d * d / 6.0), v - 0.5 * jerk * d * d, jerk * d


@kernel
def on_leg(
    t: float, length_m: float, v: float, rise: float, whole: float, accel: float, jerk: float
) -> tuple[float, float, float]:
    """Return place [m], speed and acceleration along a leg, ``t`` after its start; at its end at rest.

    ``rise`` and ``whole`` are ``rise_s`` and ``leg_s`` of it, which hold for the whole leg.
    """
    if t >= whole:
        return length_m, 0.0, 0.0
    if t <= 0.0:
        return 0.0, 0.0, 0.0
    if t <= 0.5 * whole:
        return along(t, v, rise, accel, jerk)
    s, w, a = along(whole - t, v, rise, accel, jerk)
    return length_m - s, w, -a


STEP_S = 0.05
WIND_STEPS = 10  # the wind is given every half second
KEEP_STEPS = 4  # of the track every fifth of a second is kept

# --- settings
(
    H_WP_RADIUS,
    H_TURN_RADIUS,
    H_WP_SPEED,
    H_ACCEL,
    H_POS_P,
    H_VEL_P,
    H_LATERAL,
    H_NO_GO,
    H_CORRIDOR,
    H_PIVOT_RATE,
    H_RATE_MAX,
    H_RATE_CHANGE,
    H_GATHER_M,
    H_ANGLE_P,
    H_WIND_LAG_S,
    H_LATENCY_S,
    H_JERK,
    H_L1_PERIOD,  # 0: position control
    H_L1_DAMPING,
    H_L1_XTRACK_I,
) = range(20)
H_SIZE = 20

# --- columns of the track
T_E, T_N, T_LEG, T_BEATS, T_SIDE, T_SIZE = 0, 1, 2, 3, 4, 5

# ATC_STR_RAT_P, _I, _FF and MOT_SPD_SCA_BASE of a boat whose rudder is tuned: the yaw rate is soon what is asked
RATE_P, RATE_I, RATE_FF = 0.2, 0.2, 0.75
RUDDER_BASE_MPS = 1.0


@kernel
def polar_at(curve: NDArray[np.float64], twa_rad: float) -> float:
    """Return the speed at an angle to the wind, from speeds at even steps from 0 to pi."""
    place = abs(twa_rad) / math.pi * (curve.shape[0] - 1)
    i = min(int(place), curve.shape[0] - 2)
    return float(curve[i] + (curve[i + 1] - curve[i]) * (place - i))


@kernel
def remembered(noise: NDArray[np.float64], first: NDArray[np.float64], phi: float) -> NDArray[np.float64]:
    """Return (count, steps) processes x' = phi x + noise, from their ``first`` values and (steps, count) noise."""
    steps, count = noise.shape
    out = np.empty((count, steps))
    for j in range(count):
        x = first[j]
        for i in range(steps):
            out[j, i] = x
            x = phi * x + noise[i, j]
    return out


@kernel
def sail(
    points: NDArray[np.float64],
    state: NDArray[np.float64],
    wind_rad: NDArray[np.float64],
    curve: NDArray[np.float64],
    leeway: NDArray[np.float64],
    water: tuple[float, float, float],
    h: NDArray[np.float64],
    out: NDArray[np.float64],
) -> int:
    """Sail the legs between ``points`` (n, 2), and fill ``out`` (m, T_SIZE); return how many rows were filled.

    ``state`` is east, north, heading and speed through the water at the start; ``wind_rad`` the direction of the wind
    over the water every WIND_STEPS steps (the last one holds on); ``curve`` the polar in this wind and ``leeway`` how
    far to leeward of her bow she goes, both by the bow's angle to it in even steps from 0 to pi; ``water`` the
    current's velocity, and what the wind over the ground, which the autopilot has, is turned by against that over the
    water; ``h`` the settings. Ends when the last point is reached or ``out`` is full.
    """
    e, n, yaw, v = state[0], state[1], state[2], state[3]
    ce, cn, turned = water
    rate, want_rate, integral = 0.0, 0.0, 0.0
    dt = STEP_S
    leg, last, looked_at = 0, points.shape[0] - 2, -1
    oe, on, de, dn, ue, un, length, v_this, whole = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    ge, gn, after, v_next, whole_next = 0.0, 0.0, 0.0, 0.0, 0.0
    rise, rise_next = 0.0, 0.0
    accel, jerk, fastest = h[H_ACCEL], h[H_JERK], h[H_WP_SPEED]
    t_prev, t_this, t_next = 0.0, 0.0, 0.0  # along the curves of the leg before, this one, the next
    l_prev, v_prev, rise_prev, whole_prev, pe, pn = 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    scale, pace = 0.0, 0.0
    he, hn, te, tn = 0.0, 0.0, points[0, 0], points[0, 1]
    want_speed = 0.0
    by_l1, l1_angle, l1_nudge = h[H_L1_PERIOD] > 0.0, 0.0, 0.0
    tacking, tack_yaw, tack_start, tack_end = False, 0.0, 0.0, -TACK_RETRY_S
    heard = wrap(wind_rad[0] + turned)
    rows, step = 0, 0
    while rows < out.shape[0]:
        t = step * dt
        i = step // WIND_STEPS
        share = (step - i * WIND_STEPS) / WIND_STEPS
        i = min(i, wind_rad.shape[0] - 1)
        j = min(i + 1, wind_rad.shape[0] - 1)
        twd = wind_rad[i] + share * wrap(wind_rad[j] - wind_rad[i])
        heard += dt / max(h[H_WIND_LAG_S], dt) * wrap(twd + turned - heard)
        # what the autopilot believes of its place is a little old
        sin, cos = math.sin(yaw), math.cos(yaw)
        slip = polar_at(leeway, wrap(twd - yaw))
        slip = -slip if wrap(twd - yaw) > 0.0 else slip
        ve, vn = v * math.sin(yaw + slip) + ce, v * math.cos(yaw + slip) + cn
        be, bn = e - ve * h[H_LATENCY_S], n - vn * h[H_LATENCY_S]
        if leg != looked_at:
            oe, on, de, dn = points[leg, 0], points[leg, 1], points[leg + 1, 0], points[leg + 1, 1]
            xe, xn = (points[leg + 2, 0], points[leg + 2, 1]) if leg < last else (de, dn)
            length = math.hypot(de - oe, dn - on)
            ue, un = ((de - oe) / length, (dn - on) / length) if length > 1e-6 else (sin, cos)
            after = max(math.hypot(xe - de, xn - dn), 1e-6)
            ge, gn = (xe - de) / after, (xn - dn) / after
            v_this, v_next = top_speed_mps(length, fastest, accel, jerk), top_speed_mps(after, fastest, accel, jerk)
            rise, rise_next = rise_s(v_this, accel, jerk), rise_s(v_next, accel, jerk)
            whole, whole_next = leg_s(length, v_this, rise), leg_s(after, v_next, rise_next)
            looked_at = leg
        # --- the point on the legs waits for the boat, or hurries with it
        want = 1.0
        if pace > 1e-6:
            re, rn = he / pace, hn / pace
            behind = (te - be) * re + (tn - bn) * rn
            want = pace_share(ve * re + vn * rn, behind, pace, h[H_POS_P])
        scale += (want - scale) * min(1.0, dt * jerk / accel)
        ahead_s = scale * dt
        t_this += ahead_s
        s1, w1, a1 = on_leg(t_this, length, v_this, rise, whole, accel, jerk)
        te, tn, he, hn, ae, an = oe + s1 * ue, on + s1 * un, w1 * ue, w1 * un, a1 * ue, a1 * un
        if l_prev > 0.0:
            # what is left of the leg before is sailed at the same time: that is the corner
            t_prev += ahead_s
            s0, w0, a0 = on_leg(t_prev, l_prev, v_prev, rise_prev, whole_prev, accel, jerk)
            te, tn = te + (s0 - l_prev) * pe, tn + (s0 - l_prev) * pn
            he, hn, ae, an = he + w0 * pe, hn + w0 * pn, ae + a0 * pe, an + a0 * pn
        arrived = t_this >= whole
        if leg < last:
            left = whole - t_this
            if t_next <= 0.0 and left < 0.5 * min(whole, whole_next):
                # the next leg may begin when the middle of the corner is within the radius, slow and soft enough
                s1, w1, a1 = on_leg(t_this + 0.5 * left, length, v_this, rise, whole, accel, jerk)
                s2, w2, a2 = on_leg(0.5 * left, after, v_next, rise_next, whole_next, accel, jerk)
                turn_m = math.hypot((s1 - length) * ue + s2 * ge, (s1 - length) * un + s2 * gn)
                if (
                    turn_m < h[H_WP_RADIUS]
                    and math.hypot(w1 * ue + w2 * ge, w1 * un + w2 * gn) < min(v_this, v_next)
                    and math.hypot(a1 * ue + a2 * ge, a1 * un + a2 * gn) < h[H_LATERAL]
                ):
                    t_next = 1e-9
            if t_next > 0.0:
                t_next += ahead_s
                s2, w2, a2 = on_leg(t_next, after, v_next, rise_next, whole_next, accel, jerk)
                te, tn, he, hn = te + s2 * ge, tn + s2 * gn, he + w2 * ge, hn + w2 * gn
                ae, an = ae + a2 * ge, an + a2 * gn
                arrived = arrived or t_next >= whole - t_this
        pace = math.hypot(he, hn)
        # --- reached?
        xtrack = (bn - on) * ue - (be - oe) * un  # to the left of the leg
        past = (be - oe) * ue + (bn - on) * un >= length
        arrived = arrived or by_l1
        reached = arrived and ((leg < last and not by_l1) or math.hypot(de - be, dn - bn) <= h[H_WP_RADIUS] or past)
        # --- what is steered
        bearing = math.atan2(de - be, dn - bn)
        beats = tacking or is_beaten(heard, bearing, h[H_NO_GO])
        if beats:
            on_port = wrap(twd - yaw) < 0.0
            should = False
            heading = edge(heard, h[H_NO_GO], on_port)
            if abs(wrap(heard - bearing)) > h[H_NO_GO] and not tacking:
                if (wrap(heard - bearing) < 0.0) == on_port:
                    heading = bearing
                else:
                    should = True
            if not tacking and not should:
                should = leads_away(xtrack, h[H_CORRIDOR], on_port)
            if should and t - tack_end > TACK_RETRY_S:
                tack_yaw = edge(heard, h[H_NO_GO], not on_port)
                tacking, tack_start = True, t
            if tacking:
                heading = tack_yaw
                if abs(wrap(tack_yaw - yaw)) <= TACK_DONE_RAD or t - tack_start > TACK_TIMEOUT_S:
                    tacking, tack_end = False, t
            asked = h[H_ANGLE_P] * wrap(heading - yaw)
            if tacking and h[H_PIVOT_RATE] > 0.0:
                asked = min(max(asked, -h[H_PIVOT_RATE]), h[H_PIVOT_RATE])
        elif by_l1:
            lateral, l1_angle, l1_nudge = lateral_mps2(
                (be, bn),
                (ve, vn),
                yaw,
                (oe, on, de, dn),
                (h[H_L1_PERIOD], h[H_L1_DAMPING], h[H_L1_XTRACK_I], h[H_WP_RADIUS]),
                (l1_angle, l1_nudge),
                dt,
            )
            asked = min(max(lateral, -h[H_LATERAL]), h[H_LATERAL]) / max(v, STEERS_FROM_MPS)
        else:
            lateral, want_speed = position_control(
                (te - be, tn - bn),
                (he, hn, ae, an),
                (ve, vn),
                (sin, cos),
                want_speed,
                (h[H_POS_P], h[H_VEL_P], h[H_WP_SPEED], h[H_ACCEL], h[H_LATERAL], h[H_TURN_RADIUS]),
                dt,
            )
            asked = lateral / max(want_speed, SLOWEST_MPS)
        # --- the boat
        asked = min(max(asked, -h[H_RATE_MAX]), h[H_RATE_MAX])
        want_rate = min(max(asked, want_rate - h[H_RATE_CHANGE] * dt), want_rate + h[H_RATE_CHANGE] * dt)
        miss = want_rate - rate
        integral = min(max(integral + RATE_I * miss * dt, -1.0), 1.0)
        rudder = min(max(RATE_P * miss + integral + RATE_FF * want_rate, -1.0), 1.0) / max(v, RUDDER_BASE_MPS)
        rate = v * math.sin(rudder * RUDDER_MAX_RAD) / (max(h[H_TURN_RADIUS], 0.1) * math.sin(RUDDER_MAX_RAD))
        top = polar_at(curve, wrap(twd - yaw))
        v = max(v + (top * top - v * v) / (2.0 * h[H_GATHER_M]) * dt, 0.0)
        half = yaw + slip + 0.5 * rate * dt
        e += (v * math.sin(half) + ce) * dt
        n += (v * math.cos(half) + cn) * dt
        yaw = wrap(yaw + rate * dt)
        if step % KEEP_STEPS == 0:
            out[rows, T_E], out[rows, T_N], out[rows, T_LEG] = e, n, leg
            out[rows, T_BEATS] = 1.0 if beats else 0.0
            out[rows, T_SIDE] = 1.0 if wrap(twd - yaw) >= 0.0 else -1.0
            rows += 1
        step += 1
        if reached:
            if leg == last:
                break
            l_prev, v_prev, pe, pn, t_prev = length, v_this, ue, un, t_this
            rise_prev, whole_prev = rise, whole
            t_this, t_next = t_next, 0.0
            leg += 1
    return rows

"""The arithmetic of the default forecaster, compiled; ``forecaster.py`` says what it means.

All directions are on a line about the first reading (``Base``), all times are seconds since it. ``State`` is a
bundle of arrays of fixed size that the functions change in place: memory does not grow.
"""

# ruff: noqa: PLR0917  (compiled functions take plain positional arguments)
# mypy: disable-error-code="no-any-return"
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

SCALE_S = np.array([1.0, 3.0, 10.0, 30.0, 90.0, 300.0, 900.0, 3600.0])   # time constants of the running means
SPEED_SCALE_S = np.array([1.0, 5.0, 20.0, 60.0, 300.0, 1800.0])
KNOT_S = np.array([3.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0])  # horizons that learn
QUANTILE_P = np.array([0.0, 0.25, 0.5, 0.65, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999])      # levels that learn
BAND_S = np.sqrt(SCALE_S[:-1] * SCALE_S[1:])
SPEED_BAND_S = np.sqrt(SPEED_SCALE_S[:-1] * SPEED_SCALE_S[1:])

EVERY_S = 5.0          # [s] between forecasts that are kept to be scored
ROWS = 728             # an hour of them, and some
ERROR_MAX_RAD = 1.5    # [rad] one wild error counts no more than this
TARGET_MIN_MPS = 1.0   # [m/s] a reading in less wind says nothing about the direction

# Columns of State.knot.
ERR, ERR_N, DE, DD, XY, XX, KAPPA, KAPPA_N, SPEED_ERR, SPEED_ERR_N = range(10)
# Entries of State.now.
CLOCK, LAST_ROW_S, HEAD, COUNT, FAST, ROUGH, ROUGH_N, CLIMATE, CLIMATE_N, WIND, WIND_N, SEEN, SPEED_LAST = range(13)
# Columns of State.ring: time, fast, long, speed sum; then blocks of one column per knot.
RING_T, RING_FAST, RING_LONG = range(3)
J = KNOT_S.size
B_TREND, B_MEAN, B_SIGMA, B_SPEED, B_OU = 3, 3 + J, 3 + 2 * J, 3 + 3 * J, 3 + 4 * J


class State(NamedTuple):
    """Everything a forecaster knows."""

    now: Array        # (13,) scalars
    sums: Array       # (scales, 2) exponential sums of speed x (sin, cos)
    mean: Array       # (scales,) their directions [rad]
    speed: Array      # (speed scales, 2) weighted sum, weight
    knot: Array       # (J, 10) learned per horizon
    quantile: Array   # (J, levels) log of the quantile of |error| / sigma
    ring: Array       # (ROWS, 3 + 5 J) forecasts to be scored
    pointer: Array    # (J,) next row to score per knot


class Constants(NamedTuple):
    """What was fitted to recorded wind, see ``prior.py``."""

    survival: Array      # (2,) c, gamma of the direction bands
    speed_survival: Array  # (2,) c, gamma of the speed bands
    sigma: Array         # (6,) a0, a1, a2 over ln(h / 60 s), exponents of roughness, own errors, speed
    error: Array         # (2,) expected |error| at 60 s [rad] and its exponent in h
    speed_error: Array   # (2,) expected |error| of speed at 60 s as a share of the speed, exponent in h
    quantile: Array      # (levels,) log quantiles of |error| / sigma
    memory: Array        # (8,) see M_*


# Entries of Constants.memory [s] (and plain numbers).
M_ERROR, M_POOL, M_KAPPA, M_QUANTILE, M_ROUGH, M_CLIMATE, M_PULL, M_PRIOR = range(8)


def new_state(constants: Constants) -> State:
    """Return the state before the first reading."""
    return State(
        now=np.zeros(13), sums=np.zeros((SCALE_S.size, 2)), mean=np.zeros(SCALE_S.size),
        speed=np.zeros((SPEED_SCALE_S.size, 2)), knot=np.zeros((J, 10)),
        quantile=np.tile(constants.quantile, (J, 1)), ring=np.zeros((ROWS, 3 + 5 * J)), pointer=np.zeros(J),
    )


@njit(nogil=True, cache=True)
def wrap(a: float) -> float:
    """Return the angle on [-π, π)."""
    return (a + math.pi) % (2.0 * math.pi) - math.pi


@njit(nogil=True, cache=True)
def _interpolation(h: float) -> tuple[int, float]:
    """Return the knot below ``h`` and the share of the next, linear in log h, flat outside."""
    if h <= KNOT_S[0]:
        return 0, 0.0
    for j in range(J - 1):
        if h < KNOT_S[j + 1]:
            return j, math.log(h / KNOT_S[j]) / math.log(KNOT_S[j + 1] / KNOT_S[j])
    return J - 2, 1.0


@njit(nogil=True, cache=True)
def _trend(st: State, con: Constants, h: float) -> float:
    """Multi-scale mean: each departure between neighbouring scales survives by a share that falls with h."""
    k = SCALE_S.size - 1
    m = st.mean[k]
    c, g = con.survival[0], con.survival[1]
    for b in range(k):
        m += wrap(st.mean[b] - st.mean[b + 1]) / (1.0 + (h / (c * BAND_S[b])) ** g)
    return m


@njit(nogil=True, cache=True)
def _speed(st: State, con: Constants, h: float) -> float:
    k = SPEED_SCALE_S.size - 1
    m = st.speed[k, 0] / st.speed[k, 1]
    c, g = con.speed_survival[0], con.speed_survival[1]
    for b in range(k):
        d = st.speed[b, 0] / st.speed[b, 1] - st.speed[b + 1, 0] / st.speed[b + 1, 1]
        m += d / (1.0 + (h / (c * SPEED_BAND_S[b])) ** g)
    return max(0.0, m)


@njit(nogil=True, cache=True)
def _prior_s(con: Constants, j: int) -> float:
    """Weight of what is expected, in seconds of evidence."""
    return con.memory[M_PRIOR] + 4.0 * KNOT_S[j]


@njit(nogil=True, cache=True)
def _own_error(st: State, con: Constants, j: int) -> float:
    prior = con.error[0] * (KNOT_S[j] / 60.0) ** con.error[1]
    pw = _prior_s(con, j)
    return (st.knot[j, ERR] + pw * prior) / (st.knot[j, ERR_N] + pw)


@njit(nogil=True, cache=True)
def _phi(st: State, j: int) -> float:
    xx = st.knot[j, XX] + 30.0 * 0.04
    return min(1.0, max(0.0, (st.knot[j, XY] + 30.0 * 0.04 * math.exp(-KNOT_S[j] / 300.0)) / xx))


@njit(nogil=True, cache=True)
def _pool(st: State, con: Constants, j: int) -> float:
    prior = con.error[0] * (KNOT_S[j] / 60.0) ** con.error[1]
    return min(1.0, max(0.0, st.knot[j, DE] / (st.knot[j, DD] + 2.0 * _prior_s(con, j) * (0.25 * prior) ** 2)))


@njit(nogil=True, cache=True)
def predict(st: State, con: Constants, h: float) -> tuple[float, float, float, float, float, float]:
    """Return mean x, sigma, mean speed, its sigma, and the two parts of the mean (trend, return)."""
    j, f = _interpolation(h)
    trend = _trend(st, con, h)
    k = SCALE_S.size - 1
    phi = (1.0 - f) * _phi(st, j) + f * _phi(st, j + 1)
    ou = st.mean[k] + phi * wrap(st.now[FAST] - st.mean[k])
    w = (1.0 - f) * _pool(st, con, j) + f * _pool(st, con, j + 1)
    m = trend + w * wrap(ou - trend)
    u = math.log(max(h, 1.0) / 60.0)
    err = (1.0 - f) * math.log(_own_error(st, con, j)) + f * math.log(_own_error(st, con, j + 1))
    rough = math.log((st.now[ROUGH] + 1.0 * 0.1) / (st.now[ROUGH_N] + 1.0))
    wind = math.log(max(0.7, st.now[WIND] / max(1e-9, st.now[WIND_N])) / 5.0)
    kap0 = (st.knot[j, KAPPA] + _prior_s(con, j) * 4.0) / (st.knot[j, KAPPA_N] + _prior_s(con, j) * 4.0)
    kap1 = (st.knot[j + 1, KAPPA] + _prior_s(con, j + 1) * 4.0) / (st.knot[j + 1, KAPPA_N] + _prior_s(con, j + 1) * 4.0)
    s = con.sigma
    log_sigma = s[0] + s[1] * u + s[2] * u * u + s[3] * rough + s[4] * err + s[5] * wind
    sigma = math.exp(log_sigma) * ((1.0 - f) * kap0 + f * kap1)
    v = _speed(st, con, h)
    p0 = con.speed_error[0] * (KNOT_S[j] / 60.0) ** con.speed_error[1] * max(2.0, v)
    p1 = con.speed_error[0] * (KNOT_S[j + 1] / 60.0) ** con.speed_error[1] * max(2.0, v)
    e0 = (st.knot[j, SPEED_ERR] + _prior_s(con, j) * p0) / (st.knot[j, SPEED_ERR_N] + _prior_s(con, j))
    e1 = (st.knot[j + 1, SPEED_ERR] + _prior_s(con, j + 1) * p1) / (st.knot[j + 1, SPEED_ERR_N] + _prior_s(con, j + 1))
    sigma_v = 1.2533 * ((1.0 - f) * e0 + f * e1)
    if h < KNOT_S[0]:
        sigma_v *= math.sqrt(max(0.1, h / KNOT_S[0]))
    return m, sigma, v, sigma_v, trend, ou


@njit(nogil=True, cache=True)
def half_width_ratio(st: State, h: float, z: Array, zp: float) -> float:
    """Return the half width in sigmas at the normal quantile ``zp``; ``z`` holds the normal quantiles of QUANTILE_P."""
    j, f = _interpolation(h)
    n = z.size
    i = 1
    while i < n - 2 and zp > z[i + 1]:
        i += 1
    if zp <= z[1]:
        q = (1.0 - f) * math.exp(st.quantile[j, 1]) + f * math.exp(st.quantile[j + 1, 1])
        return q * zp / z[1]
    g = (zp - z[i]) / (z[i + 1] - z[i])
    a = (1.0 - f) * math.exp(st.quantile[j, i]) + f * math.exp(st.quantile[j + 1, i])
    b = (1.0 - f) * math.exp(st.quantile[j, i + 1]) + f * math.exp(st.quantile[j + 1, i + 1])
    return a + g * (b - a)


@njit(nogil=True, cache=True)
def correlation_time(st: State) -> float:
    """Return where phi(h) / phi(shortest) falls to 1/e [s]; beyond the last knot by its last slope, at most an hour."""
    top = max(0.05, _phi(st, 0))
    h0, p0 = KNOT_S[0], 1.0
    for j in range(1, J - 2):
        p1 = max(1e-3, min(p0, _phi(st, j) / top))
        if p1 <= math.exp(-1.0):
            share = (math.log(p0) + 1.0) / max(1e-9, math.log(p0) - math.log(p1))
            return h0 + share * (KNOT_S[j] - h0)
        h0, p0 = KNOT_S[j], p1
    return min(3600.0, max(h0, -h0 / min(-1e-3, math.log(p0))))


@njit(nogil=True, cache=True)
def _learn(st: State, con: Constants, j: int, row: int, x: float, speed: float) -> None:
    """Score a kept forecast against the reading that it was for."""
    r, kn, mem = st.ring[row], st.knot[j], con.memory
    h = KNOT_S[j]
    error = wrap(x - r[B_MEAN + j])
    size = min(abs(error), ERROR_MAX_RAD)
    keep = math.exp(-EVERY_S / (mem[M_ERROR] + 2.0 * h))
    kn[ERR] = kn[ERR] * keep + EVERY_S * size
    kn[ERR_N] = kn[ERR_N] * keep + EVERY_S
    keep = math.exp(-EVERY_S / (mem[M_ERROR] + 2.0 * h))
    kn[SPEED_ERR] = kn[SPEED_ERR] * keep + EVERY_S * abs(speed - r[B_SPEED + j])
    kn[SPEED_ERR_N] = kn[SPEED_ERR_N] * keep + EVERY_S
    # The return model: how much of a departure from the long mean is left after h.
    keep = math.exp(-EVERY_S / (mem[M_POOL] + 2.0 * h))
    x0 = wrap(r[RING_FAST] - r[RING_LONG])
    y0 = wrap(x - r[RING_LONG])
    kn[XY] = kn[XY] * keep + EVERY_S * x0 * y0
    kn[XX] = kn[XX] * keep + EVERY_S * x0 * x0
    # The share of the return model: regression of the trend's error on the difference of the two.
    limit = 3.0 * _own_error(st, con, j)
    e = max(-limit, min(limit, wrap(x - r[B_TREND + j])))
    d = max(-limit, min(limit, wrap(r[B_OU + j] - r[B_TREND + j])))
    kn[DE] = kn[DE] * keep + EVERY_S * d * e
    kn[DD] = kn[DD] * keep + EVERY_S * d * d
    # Scale and quantiles of |error| / sigma.
    z = min(abs(error) / r[B_SIGMA + j], 8.0)
    keep = math.exp(-EVERY_S / (mem[M_KAPPA] + 4.0 * h))
    # mean of |z| of the fitted shape is about 0.85
    kn[KAPPA] = kn[KAPPA] * keep + EVERY_S * min(z, 4.0) / 0.85
    kn[KAPPA_N] = kn[KAPPA_N] * keep + EVERY_S
    step = EVERY_S / (mem[M_QUANTILE] + 4.0 * h)
    for i in range(1, QUANTILE_P.size):
        tail = 1.0 - QUANTILE_P[i]
        over = 1.0 if z > math.exp(st.quantile[j, i]) else 0.0
        pull = mem[M_PULL] * (con.quantile[i] - st.quantile[j, i])
        st.quantile[j, i] += step * ((over - tail) / max(0.08, min(tail, 0.3)) + pull)
    for i in range(2, QUANTILE_P.size):
        st.quantile[j, i] = max(st.quantile[j, i], st.quantile[j, i - 1])


@njit(nogil=True, cache=True)
def update(st: State, con: Constants, dt: float, x: float, speed: float, weight: float) -> None:
    """Take a reading ``dt`` after the last; the first has ``dt`` 0."""
    now, mem = st.now, con.memory
    now[CLOCK] += dt
    t = now[CLOCK]
    is_first = now[SEEN] == 0.0
    # 1. Score what was forecast for this moment.
    head = int(now[HEAD])
    for j in range(J):
        p = int(st.pointer[j])
        while p != head and st.ring[p, RING_T] + KNOT_S[j] <= t + 1e-6:
            late = t - st.ring[p, RING_T] - KNOT_S[j]
            if late <= max(2.05, 0.15 * KNOT_S[j]) and weight >= 0.5 and speed >= TARGET_MIN_MPS:
                _learn(st, con, j, p, x, speed)
            p = (p + 1) % ROWS
        st.pointer[j] = p
    if weight <= 0.0:
        return
    # 2. Means at every scale: of the air's motion, so light air weighs little.
    step = 1.0 if is_first else dt
    vs, vc = max(speed, 0.05) * weight * math.sin(x), max(speed, 0.05) * weight * math.cos(x)
    for k in range(SCALE_S.size):
        keep = math.exp(-step / SCALE_S[k])
        st.sums[k, 0] = st.sums[k, 0] * keep + (1.0 - keep) * vs
        st.sums[k, 1] = st.sums[k, 1] * keep + (1.0 - keep) * vc
        st.mean[k] = math.atan2(st.sums[k, 0], st.sums[k, 1])
    for k in range(SPEED_SCALE_S.size):
        keep = math.exp(-step / SPEED_SCALE_S[k])
        st.speed[k, 0] = st.speed[k, 0] * keep + (1.0 - keep) * speed * weight
        st.speed[k, 1] = st.speed[k, 1] * keep + (1.0 - keep) * weight
    long = st.mean[SCALE_S.size - 1]
    now[FAST] = x if is_first else now[FAST] + weight * -math.expm1(-step / 0.3) * wrap(x - now[FAST])
    keep = math.exp(-step / mem[M_ROUGH])
    now[ROUGH] = now[ROUGH] * keep + (1.0 - keep) * weight * mem[M_ROUGH] * min(1.2, abs(wrap(x - st.mean[4])))
    now[ROUGH_N] = now[ROUGH_N] * keep + (1.0 - keep) * weight * mem[M_ROUGH]
    keep = math.exp(-step / mem[M_CLIMATE])
    now[CLIMATE] = now[CLIMATE] * keep + (1.0 - keep) * weight * mem[M_CLIMATE] * wrap(x - long) ** 2
    now[CLIMATE_N] = now[CLIMATE_N] * keep + (1.0 - keep) * weight * mem[M_CLIMATE]
    keep = math.exp(-step / 10.0)
    now[WIND] = now[WIND] * keep + (1.0 - keep) * speed
    now[WIND_N] = now[WIND_N] * keep + (1.0 - keep)
    now[SEEN] += 1.0
    # 3. Keep a forecast to be scored.
    if is_first or t - now[LAST_ROW_S] >= EVERY_S - 1e-6:
        now[LAST_ROW_S] = t
        r = st.ring[head]
        r[RING_T], r[RING_FAST], r[RING_LONG] = t, now[FAST], long
        for j in range(J):
            m, sigma, v, _, trend, ou = predict(st, con, KNOT_S[j])
            r[B_TREND + j], r[B_MEAN + j], r[B_SIGMA + j], r[B_SPEED + j], r[B_OU + j] = trend, m, sigma, v, ou
        head = (head + 1) % ROWS
        now[HEAD] = head
        for j in range(J):
            if int(st.pointer[j]) == head:
                st.pointer[j] = (head + 1) % ROWS


@njit(nogil=True, cache=True)
def replay(
    st: State, con: Constants, t: Array, x: Array, speed: Array, ask: NDArray[np.bool_], horizon: Array,
    z: Array, zp: Array,
) -> Array:
    """Feed a record; return (asked, horizons, 4 + levels): mean, sigma, speed, its sigma, half width ratios."""
    out = np.zeros((int(ask.sum()), horizon.size, 4 + zp.size))
    q = 0
    for i in range(t.size):
        update(st, con, t[i] - t[i - 1] if i else 0.0, x[i], speed[i], 1.0)
        if ask[i]:
            for a in range(horizon.size):
                m, sigma, v, sigma_v, _, _ = predict(st, con, horizon[a])
                out[q, a, 0], out[q, a, 1], out[q, a, 2], out[q, a, 3] = m, sigma, v, sigma_v
                for b in range(zp.size):
                    out[q, a, 4 + b] = half_width_ratio(st, horizon[a], z, zp[b])
            q += 1
    return out

"""The arithmetic of the default forecaster, compiled; ``forecaster.py`` says what it means.

All directions are on a line about the first reading (``Base``), all times are seconds since it. ``ForecasterState`` is
a bundle of arrays of fixed size that the functions change in place: memory does not grow. The numbers in brackets are
the equations of ``forecaster.py``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.geo.kernels import wrap
from companion.kernels.jit import kernel

# mypy: disable-error-code="no-any-return"


Array = NDArray[np.float64]

SCALE_S = np.array([1.0, 3.0, 10.0, 30.0, 90.0, 300.0, 900.0, 3600.0])  # time constants of the running means
SPEED_SCALE_S = np.array([1.0, 5.0, 20.0, 60.0, 300.0, 1800.0])
KNOT_S = np.array([3.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0])  # horizons that learn
QUANTILE_P = np.array([0.0, 0.25, 0.5, 0.65, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999])  # levels that learn
BAND_S = np.sqrt(SCALE_S[:-1] * SCALE_S[1:])
SPEED_BAND_S = np.sqrt(SPEED_SCALE_S[:-1] * SPEED_SCALE_S[1:])
_ROUGH_SCALE = 4  # roughness is measured about the 90 s mean
_SPEED_SCALE = 3  # the 60 s mean of speed

EVERY_S = 5.0  # [s] between forecasts that are kept to be scored
ROWS = 728  # an hour of them, and some
ERROR_MAX_RAD = 1.5  # [rad] one wild error counts no more than this
Z_MAX = 8.0  # |error| / sigma, likewise
TARGET_MIN_MPS = 1.0  # [m/s] a reading in less wind says nothing about the direction
WIND_MIN_MPS = 0.7  # [m/s] below it less wind makes the direction no worse: it has none
_YOUNG_S = 60.0  # [s] weight of a 0.2 rad spread before any has been seen
_YOUNG_RAD2 = 0.04

# Entries of State.now.
CLOCK, LAST_ROW_S, HEAD, SEEN, FAST = range(5)
ROUGH, ROUGH_N, CLIMATE, CLIMATE_N, WIND, WIND_N, TYPICAL_ROUGH, TYPICAL_WIND, TYPICAL_N = range(5, 14)
# Columns of State.knot: sums with their weights, and what ``_refresh`` makes of them.
ERR, ERR_N, DE, DD, XY, XX, SPEED_ERR, SPEED_ERR_N, LOG_ERR, PHI, SHARE, SPEED_LEVEL = range(12)
# Columns of State.ring: time, fast and long mean, then blocks of one column per knot.
J = KNOT_S.size
RING_T, RING_FAST, RING_LONG = range(3)
B_TREND, B_MEAN, B_SIGMA, B_SPEED, B_RETURN = (3 + i * J for i in range(5))


class ForecasterState(NamedTuple):
    """Everything a forecaster knows."""

    now: Array  # (14,) scalars
    sums: Array  # (scales, 2) exponential sums of speed x (sin, cos)
    mean: Array  # (scales,) their directions [rad]
    speed: Array  # (speed scales, 2) weighted sum, weight
    knot: Array  # (J, 12) learned per horizon
    quantile: Array  # (J, levels) log of the quantile of |error| / sigma
    ring: Array  # (ROWS, 3 + 5 J) forecasts to be scored
    pointer: Array  # (J,) next row to score per knot


class Constants(NamedTuple):
    """What was fitted to recorded wind (``prior.py``) and how long today's is remembered."""

    survival: Array  # (2,) c, gamma of (1)
    speed_survival: Array  # (2,) the same for the speed
    sigma: Array  # (5,) log ratio to own error, tilt per ln h, exponents of roughness and wind, their h [s]
    error: Array  # (2,) expected |error| at 60 s [rad] and its exponent in h
    speed_error: Array  # (2,) expected |error| of speed at 60 s as a share of the speed, exponent in h
    quantile: Array  # (levels,) quantiles of |error| / sigma at 60 s
    tail: Array  # (1,) how much faster the tails grow with ln h
    memory: Array  # (7,) see M_*


# Entries of Constants.memory: seconds, except the last two.
M_ERROR, M_POOL, M_QUANTILE, M_ROUGH, M_CLIMATE, M_PULL, M_SHRINK = range(7)


def prior_quantile(constants: Constants) -> Array:
    """Return the expected log quantiles of |error| / sigma, (J, levels)."""
    from companion.wind.estimators.estimator import normal_half_width

    z = np.array([normal_half_width(float(p)) for p in QUANTILE_P])
    log_h = np.log(np.minimum(KNOT_S, 600.0) / 60.0)
    log_q = np.log(np.maximum(constants.quantile, 1e-3))
    return np.asarray(log_q + constants.tail[0] * np.maximum(0.0, z - 1.0) * log_h[:, None], dtype=np.float64)


def new_state(constants: Constants) -> ForecasterState:
    """Return the state before the first reading."""
    return ForecasterState(
        now=np.zeros(14),
        sums=np.zeros((SCALE_S.size, 2)),
        mean=np.zeros(SCALE_S.size),
        speed=np.zeros((SPEED_SCALE_S.size, 2)),
        knot=np.zeros((J, 12)),
        quantile=prior_quantile(constants),
        ring=np.zeros((ROWS, 3 + 5 * J)),
        pointer=np.zeros(J),
    )


@kernel
def _interpolation(h: float) -> tuple[int, float]:
    """Return the knot below ``h`` and the share of the next, linear in log h, flat outside."""
    if h <= KNOT_S[0]:
        return 0, 0.0
    for j in range(J - 1):
        if h < KNOT_S[j + 1]:
            return j, math.log(h / KNOT_S[j]) / math.log(KNOT_S[j + 1] / KNOT_S[j])
    return J - 2, 1.0


@kernel
def _trend(st: ForecasterState, con: Constants, h: float) -> float:
    """Multi-scale mean (1)."""
    k = SCALE_S.size - 1
    m = st.mean[k]
    for b in range(k):
        m += wrap(st.mean[b] - st.mean[b + 1]) / (1.0 + (h / (con.survival[0] * BAND_S[b])) ** con.survival[1])
    return m


@kernel
def _speed(st: ForecasterState, con: Constants, h: float) -> float:
    """Multi-scale mean speed, as (1)."""
    k = SPEED_SCALE_S.size - 1
    m = st.speed[k, 0] / st.speed[k, 1]
    c, g = con.speed_survival[0], con.speed_survival[1]
    for b in range(k):
        d = st.speed[b, 0] / st.speed[b, 1] - st.speed[b + 1, 0] / st.speed[b + 1, 1]
        m += d / (1.0 + (h / (c * SPEED_BAND_S[b])) ** g)
    return max(0.0, m)


@kernel
def _shown(st: ForecasterState, con: Constants, m: float, h: float) -> float:
    """Rms of the last hours' readings about ``m`` [rad], larger while less than ``h`` has been seen (4c)."""
    about = wrap(m - st.mean[SCALE_S.size - 1]) ** 2
    spread = math.sqrt((st.now[CLIMATE] + _YOUNG_S * _YOUNG_RAD2) / (st.now[CLIMATE_N] + _YOUNG_S) + about)
    return spread * max(1.0, h / (st.now[CLOCK] + _YOUNG_S)) ** con.error[1]


@kernel
def _rough(st: ForecasterState) -> float:
    """Log of the mean departure from the 90 s mean in the last minute."""
    return math.log((st.now[ROUGH] + 0.1) / (st.now[ROUGH_N] + 1.0))


@kernel
def _wind(st: ForecasterState) -> float:
    """Log of the wind speed of the last seconds."""
    return math.log(max(WIND_MIN_MPS, st.now[WIND] / max(1e-9, st.now[WIND_N])))


@kernel
def _refresh(st: ForecasterState, con: Constants) -> None:
    """Turn the sums of every knot into what ``predict`` reads."""
    m = st.mean[SCALE_S.size - 1]
    wind = max(2.0, st.speed[_SPEED_SCALE, 0] / max(1e-9, st.speed[_SPEED_SCALE, 1]))
    below = con.error[0] * (KNOT_S[0] / 60.0) ** con.error[1]
    for j in range(J):
        kn, h = st.knot[j], KNOT_S[j]
        weight = 60.0 + 4.0 * h  # what is expected counts as this many seconds
        expected = below * (h / KNOT_S[max(0, j - 1)]) ** con.error[1]
        expected = min(expected, 0.8 * _shown(st, con, m, h))  # E|x| = 0.8 sigma of a normal
        below = (kn[ERR] + weight * expected) / (kn[ERR_N] + weight)  # (4a)
        kn[LOG_ERR] = math.log(below)
        kn[PHI] = min(1.0, max(0.0, (kn[XY] + 1.2 * math.exp(-h / 300.0)) / (kn[XX] + 1.2)))  # (2)
        shrink = con.memory[M_SHRINK] * weight * (0.25 * below) ** 2
        kn[SHARE] = min(1.0, max(0.0, kn[DE] / (kn[DD] + shrink)))  # (3)
        expected = con.speed_error[0] * (h / 60.0) ** con.speed_error[1] * wind
        kn[SPEED_LEVEL] = (kn[SPEED_ERR] + weight * expected) / (kn[SPEED_ERR_N] + weight)


@kernel
def predict(st: ForecasterState, con: Constants, h: float) -> tuple[float, float, float, float, float, float]:
    """Return mean x, sigma, mean speed, its sigma, and the two parts of the mean (trend, return)."""
    j, f = _interpolation(h)
    a, b = st.knot[j], st.knot[j + 1]
    long = st.mean[SCALE_S.size - 1]
    trend = _trend(st, con, h)  # (1)
    back = long + ((1.0 - f) * a[PHI] + f * b[PHI]) * wrap(st.now[FAST] - long)  # (2)
    m = trend + ((1.0 - f) * a[SHARE] + f * b[SHARE]) * wrap(back - trend)  # (3)
    s = con.sigma
    fade = 1.0 + h / s[4]
    log_sigma = (
        s[0]
        + s[1] * math.log(min(max(h, KNOT_S[0]), 600.0) / 60.0)
        + (1.0 - f) * a[LOG_ERR]
        + f * b[LOG_ERR]
        + (s[2] * (_rough(st) - st.now[TYPICAL_ROUGH]) + s[3] * (_wind(st) - st.now[TYPICAL_WIND])) / fade
    )  # (4b)
    sigma = min(math.exp(log_sigma), _shown(st, con, m, h))  # (4c)
    sigma_speed = 1.2533 * ((1.0 - f) * a[SPEED_LEVEL] + f * b[SPEED_LEVEL])  # sqrt(π/2) mean |error|
    if h < KNOT_S[0]:
        part = max(0.1, h / KNOT_S[0]) ** con.error[1]
        sigma, sigma_speed = sigma * part, sigma_speed * part
    return m, sigma, _speed(st, con, h), sigma_speed, trend, back


@kernel
def half_width_ratio(st: ForecasterState, h: float, z: Array, zp: float) -> float:
    """Return the half width in sigmas at the normal quantile ``zp``; ``z`` holds the normal quantiles of QUANTILE_P."""
    j, f = _interpolation(h)
    i = 1
    while i < z.size - 2 and zp > z[i + 1]:
        i += 1
    if zp <= z[1]:
        return ((1.0 - f) * math.exp(st.quantile[j, 1]) + f * math.exp(st.quantile[j + 1, 1])) * zp / z[1]
    g = (zp - z[i]) / (z[i + 1] - z[i])
    a = (1.0 - f) * math.exp(st.quantile[j, i]) + f * math.exp(st.quantile[j + 1, i])
    b = (1.0 - f) * math.exp(st.quantile[j, i + 1]) + f * math.exp(st.quantile[j + 1, i + 1])
    return a + g * (b - a)


@kernel
def table(st: ForecasterState, con: Constants, h: Array, z: Array, zp: Array) -> tuple[Array, Array]:
    """Return the first four of ``predict`` (n, 4) and ``half_width_ratio`` (n, m), for horizons ``h`` and levels."""
    rows, ratio = np.empty((h.size, 4)), np.empty((h.size, zp.size))
    for i in range(h.size):
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], _, _ = predict(st, con, h[i])
        for k in range(zp.size):
            ratio[i, k] = half_width_ratio(st, h[i], z, zp[k])
    return rows, ratio


@kernel
def correlation_time(st: ForecasterState) -> float:
    """Return where phi(h) / phi(shortest) falls to 1/e [s]; beyond 600 s by its slope so far, at most an hour."""
    top = max(0.05, st.knot[0, PHI])
    h0, p0 = KNOT_S[0], 1.0
    for j in range(1, J - 2):
        p1 = max(1e-3, min(p0, st.knot[j, PHI] / top))
        if p1 <= math.exp(-1.0):
            share = (math.log(p0) + 1.0) / max(1e-9, math.log(p0) - math.log(p1))
            return h0 + share * (KNOT_S[j] - h0)
        h0, p0 = KNOT_S[j], p1
    return min(3600.0, max(h0, -h0 / min(-1e-3, math.log(p0))))


@kernel
def _learn(st: ForecasterState, con: Constants, prior: Array, j: int, row: int, x: float, speed: float) -> None:
    """Score a kept forecast against the reading that it was for."""
    r, kn, mem, h = st.ring[row], st.knot[j], con.memory, KNOT_S[j]
    error = wrap(x - r[B_MEAN + j])
    keep = math.exp(-EVERY_S / (mem[M_ERROR] + 2.0 * h))
    kn[ERR] = kn[ERR] * keep + EVERY_S * min(abs(error), ERROR_MAX_RAD)
    kn[ERR_N] = kn[ERR_N] * keep + EVERY_S
    kn[SPEED_ERR] = kn[SPEED_ERR] * keep + EVERY_S * abs(speed - r[B_SPEED + j])
    kn[SPEED_ERR_N] = kn[SPEED_ERR_N] * keep + EVERY_S
    # How much of a departure from the long mean is left after h (2).
    keep = math.exp(-EVERY_S / (mem[M_POOL] + 2.0 * h))
    x0, y0 = wrap(r[RING_FAST] - r[RING_LONG]), wrap(x - r[RING_LONG])
    kn[XY] = kn[XY] * keep + EVERY_S * x0 * y0
    kn[XX] = kn[XX] * keep + EVERY_S * x0 * x0
    # Regression of the trend's error on the difference of the two (3).
    limit = 3.0 * math.exp(kn[LOG_ERR])
    e = max(-limit, min(limit, wrap(x - r[B_TREND + j])))
    d = max(-limit, min(limit, wrap(r[B_RETURN + j] - r[B_TREND + j])))
    kn[DE] = kn[DE] * keep + EVERY_S * d * e
    kn[DD] = kn[DD] * keep + EVERY_S * d * d
    # Each level's quantile steps up when exceeded and down when not, in the proportion that balances there (5).
    z = min(abs(error) / r[B_SIGMA + j], Z_MAX)
    step = EVERY_S / (mem[M_QUANTILE] + 4.0 * h)
    for i in range(1, QUANTILE_P.size):
        tail = 1.0 - QUANTILE_P[i]
        over = 1.0 if z > math.exp(st.quantile[j, i]) else 0.0
        pull = mem[M_PULL] * (prior[j, i] - st.quantile[j, i])
        st.quantile[j, i] += step * ((over - tail) / max(0.08, min(tail, 0.3)) + pull)
        if i > 1:
            st.quantile[j, i] = max(st.quantile[j, i], st.quantile[j, i - 1])


@kernel
def _speeds(st: ForecasterState, step: float, speed: float, weight: float) -> None:
    """Move every running mean of the speed by a reading that stands for ``step`` seconds."""
    now = st.now
    for k in range(SPEED_SCALE_S.size):
        keep = math.exp(-step / SPEED_SCALE_S[k])
        st.speed[k, 0] = st.speed[k, 0] * keep + (1.0 - keep) * speed * weight
        st.speed[k, 1] = st.speed[k, 1] * keep + (1.0 - keep) * weight
    keep = math.exp(-step / 10.0)
    now[WIND] = now[WIND] * keep + (1.0 - keep) * speed
    now[WIND_N] = now[WIND_N] * keep + (1.0 - keep)


@kernel
def _directions(st: ForecasterState, con: Constants, step: float, x: float, speed: float, weight: float) -> None:
    """Move every running mean of the direction by a reading that stands for ``step`` seconds."""
    now, mem = st.now, con.memory
    # Means of the air's motion: light air weighs little.
    vs, vc = max(speed, 0.05) * weight * math.sin(x), max(speed, 0.05) * weight * math.cos(x)
    for k in range(SCALE_S.size):
        keep = math.exp(-step / SCALE_S[k])
        st.sums[k, 0] = st.sums[k, 0] * keep + (1.0 - keep) * vs
        st.sums[k, 1] = st.sums[k, 1] * keep + (1.0 - keep) * vc
        st.mean[k] = math.atan2(st.sums[k, 0], st.sums[k, 1])
    now[FAST] = x if now[SEEN] == 0.0 else now[FAST] - weight * math.expm1(-step / 0.3) * wrap(x - now[FAST])
    share = weight * -math.expm1(-step / mem[M_ROUGH]) * mem[M_ROUGH]
    keep = math.exp(-step / mem[M_ROUGH])
    now[ROUGH] = now[ROUGH] * keep + share * min(1.2, abs(wrap(x - st.mean[_ROUGH_SCALE])))
    now[ROUGH_N] = now[ROUGH_N] * keep + share
    share = weight * -math.expm1(-step / mem[M_CLIMATE]) * mem[M_CLIMATE]
    keep = math.exp(-step / mem[M_CLIMATE])
    now[CLIMATE] = now[CLIMATE] * keep + share * wrap(x - st.mean[SCALE_S.size - 1]) ** 2
    now[CLIMATE_N] = now[CLIMATE_N] * keep + share
    now[SEEN] += 1.0


@kernel
def _remember(st: ForecasterState, con: Constants) -> None:
    """Keep a forecast for every knot, to be scored when its time comes."""
    now = st.now
    now[LAST_ROW_S] = now[CLOCK]
    now[TYPICAL_N] = now[TYPICAL_N] * math.exp(-EVERY_S / con.memory[M_ERROR]) + EVERY_S
    share = EVERY_S / now[TYPICAL_N]
    now[TYPICAL_ROUGH] += share * (_rough(st) - now[TYPICAL_ROUGH])
    now[TYPICAL_WIND] += share * (_wind(st) - now[TYPICAL_WIND])
    _refresh(st, con)
    head = int(now[HEAD])
    r = st.ring[head]
    r[RING_T], r[RING_FAST], r[RING_LONG] = now[CLOCK], now[FAST], st.mean[SCALE_S.size - 1]
    for j in range(J):
        m, sigma, v, _, trend, back = predict(st, con, KNOT_S[j])
        r[B_TREND + j], r[B_MEAN + j], r[B_SIGMA + j], r[B_SPEED + j], r[B_RETURN + j] = trend, m, sigma, v, back
    head = (head + 1) % ROWS
    now[HEAD] = head
    for j in range(J):
        if int(st.pointer[j]) == head:  # the oldest row is overwritten before it came due (a long gap)
            st.pointer[j] = (head + 1) % ROWS


@kernel
def update(
    st: ForecasterState,
    con: Constants,
    prior: Array,
    dt: float,
    x: float,
    speed: float,
    weight: float,
    speed_weight: float,
) -> None:
    """Take a reading ``dt`` after the last; the first has ``dt`` 0, and a direction that is believed."""
    now = st.now
    now[CLOCK] += dt
    is_first = now[SEEN] == 0.0
    head = int(now[HEAD])
    for j in range(J):
        p = int(st.pointer[j])
        while p != head and st.ring[p, RING_T] + KNOT_S[j] <= now[CLOCK] + 1e-6:
            late = now[CLOCK] - st.ring[p, RING_T] - KNOT_S[j]
            if late <= max(2.05, 0.15 * KNOT_S[j]) and weight >= 0.5 and speed >= TARGET_MIN_MPS:
                _learn(st, con, prior, j, p, x, speed)
            p = (p + 1) % ROWS
        st.pointer[j] = p
    step = 1.0 if is_first else dt
    if speed_weight > 0.0:
        _speeds(st, step, speed, speed_weight)
    if weight <= 0.0:
        return
    _directions(st, con, step, x, speed, weight)
    if is_first or now[CLOCK] - now[LAST_ROW_S] >= EVERY_S - 1e-6:
        _remember(st, con)


@kernel
def replay(
    st: ForecasterState,
    con: Constants,
    prior: Array,
    t: Array,
    x: Array,
    speed: Array,
    ask: NDArray[np.bool_],
    horizon: Array,
    z: Array,
    zp: Array,
) -> Array:
    """Feed a record; return (asked, horizons, 4 + levels): mean, sigma, speed, its sigma, half width ratios."""
    out = np.zeros((int(ask.sum()), horizon.size, 4 + zp.size))
    q = 0
    for i in range(t.size):
        update(st, con, prior, t[i] - t[i - 1] if i else 0.0, x[i], speed[i], 1.0, 1.0)
        if ask[i]:
            for a in range(horizon.size):
                m, sigma, v, sigma_v, _, _ = predict(st, con, horizon[a])
                out[q, a, 0], out[q, a, 1], out[q, a, 2], out[q, a, 3] = m, sigma, v, sigma_v
                for b in range(zp.size):
                    out[q, a, 4 + b] = half_width_ratio(st, horizon[a], z, zp[b])
            q += 1
    return out

"""How often a boat on a leg is expected to enter the disc around an uncertain vessel: the numbers behind ``vessels``.

Seen from the vessel the boat's place is a plane Gaussian process X(t) of mean mu(t) and velocity nu(t). Three errors
make its spread, each along a fixed direction d with a standard deviation s(t) = s0 + s1 t and the same draw at all
times: the vessel's along its course and across it, and our own along the leg. The expected number of entries into the
disc of radius R in unit time is Rice's formula for a region (Belyaev 1968):

    rate = integral over the circle of density(X = R n) E[max(0, -n . V) | X = R n] R d(theta)

and the probability to be in the disc at all is at most P(inside at first) + integral of the rate.
"""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from companion.planner.problem.sigma import AR1, KALMAN, TABLE, sigma_of

# First passage of a Gaussian Markov wind into the no-go zone: the numbers behind ``risk``.
#
# The deviation of the wind from its forecast is X(t) = sigma(t) Z(t), with Z standard normal at every moment and
# Markov: Z(t + d) = r Z(t) + sqrt(1 - r^2) N(0, 1). The models differ only in sigma and in the correlation r:
#
#     none    sigma = 0
#     kalman  a random walk: r = sigma(t) / sigma(t + d)
#     ar1     an OU process: r = sigma(t) exp(-rho d) / sigma(t + d)
#     table   sigma from a table, r = exp(-d / tau)

Z_MAX = 6.5  # the grid ends here; beyond lies 4e-11 of the wind
Z_CELLS = 260  # cells of 0.05 standard deviations
NEVER = 7.0  # standard deviations that no step goes: 3e-12
MAX_STEPS = 400_000  # of one path
R_STEP = 0.965  # correlation over one step: its standard deviation, 0.26, is five cells
# Between steps a continuous process peeks over the barrier; a barrier nearer by this many step deviations
# accounts for it (Chernoff 1965; Broadie, Glasserman and Kou 1997: -zeta(1/2) / sqrt(2 pi)).
BARRIER_SHIFT = 0.5826


@kernel
def sigma_at(  # type: ignore[no-untyped-def]
    t_s, model, s0, s1, rho, table_t, table_s
):
    """Return sigma [rad] at time t, of a table too."""
    return np.interp(t_s, table_t, table_s) if model == TABLE else sigma_of(t_s, model, s0, s1, rho)


@kernel
def _step_for(t_s, r, model, s0, s1, rho, tau, table_t, table_s):  # type: ignore[no-untyped-def]
    """Return the time [s] over which the correlation falls to r; infinite when it never does."""
    sigma = sigma_at(t_s, model, s0, s1, rho, table_t, table_s)
    if model == KALMAN:
        return sigma * sigma * (1.0 / (r * r) - 1.0) / (s1 * s1) if s1 > 0.0 else np.inf
    if model == AR1:
        if rho <= 0.0 or s1 <= 0.0:
            return np.inf
        e = r * r * s1 * s1 / (sigma * sigma - r * r * (sigma * sigma - s1 * s1))
        return -0.5 * math.log(e) / rho if e > 0.0 else np.inf
    return -tau * math.log(r)


@kernel
def correlation(t_s, d_s, model, s0, s1, rho, tau, table_t, table_s):  # type: ignore[no-untyped-def]
    """Return the correlation of X(t) and X(t + d)."""
    if model == TABLE:
        return math.exp(-d_s / tau)
    a = sigma_at(t_s, model, s0, s1, rho, table_t, table_s)
    b = sigma_at(t_s + d_s, model, s0, s1, rho, table_t, table_s)
    if b <= 0.0:
        return 1.0
    r = a / b
    if model == AR1:
        r *= math.exp(-rho * d_s)
    return min(1.0, r)


@kernel
def below(z):  # type: ignore[no-untyped-def]
    """Return the chance that a standard normal value is below ``z``."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


@kernel
def _kernel(r, dz, out):  # type: ignore[no-untyped-def]
    """Fill out[i, j]: the probability to go from the centre of cell i into cell j; 0 where none goes so far."""
    n = out.shape[0]
    s = math.sqrt(max(1e-12, 1.0 - r * r))
    for i in range((n + 1) // 2):
        mean = r * (-Z_MAX + (i + 0.5) * dz)
        first = max(0, min(n, int((mean - NEVER * s + Z_MAX) / dz)))
        last = min(n, int((mean + NEVER * s + Z_MAX) / dz) + 2)
        low = below((-Z_MAX + first * dz - mean) / s)
        total = 0.0
        out[i, :] = 0.0
        for j in range(first, last):
            high = below((-Z_MAX + (j + 1.0) * dz - mean) / s)
            out[i, j] = high - low
            total += high - low
            low = high
        for j in range(first, last):
            out[i, j] /= total
        if 2 * i + 1 < n:  # the other half is its mirror image
            out[n - 1 - i, :] = out[i, ::-1]


@kernel
def steps_of(r):  # type: ignore[no-untyped-def]
    """Return the probabilities to go from each cell into each other over a step of correlation ``r``."""
    out = np.empty((Z_CELLS, Z_CELLS))
    _kernel(r, 2.0 * Z_MAX / Z_CELLS, out)
    return out


@kernel
def _spread(p, kernel, reach, r, out):  # type: ignore[no-untyped-def]
    """Move the mass one step; only cells within ``reach`` of the mean receive any."""
    n = p.shape[0]
    out[:] = 0.0
    half = 0.5 * (n - 1)
    for i in range(n):
        if p[i] > 1e-15:
            middle = int(half + r * (i - half))
            for j in range(max(0, middle - reach), min(n, middle + reach + 2)):
                out[j] += p[i] * kernel[i, j]


@kernel
def _absorb(p, low, high, dz):  # type: ignore[no-untyped-def]
    """Take the mass of cells (and parts of cells) within [low, high] out of p and return it."""
    taken = 0.0
    n = p.shape[0]
    first = max(0, int((low + Z_MAX) / dz))
    last = min(n - 1, int((high + Z_MAX) / dz))
    for j in range(first, last + 1):
        a = -Z_MAX + j * dz
        part = (min(high, a + dz) - max(low, a)) / dz
        if part > 0.0:
            part = min(1.0, part)
            taken += p[j] * part
            p[j] *= 1.0 - part
    return taken


@kernel
def first_passage(  # type: ignore[no-untyped-def]
    start_s, end_s, twa_rad, half_rad, model, s0, s1, rho, tau, table_t, table_s, full, out
):
    """Fill out[k]: the probability that the wind first forces the boat into the no-go zone on leg k.

    start_s, end_s, twa_rad: (n,) legs in order of time, heading less mean wind [rad], positive on port tack.
    half_rad: the boat's own no-go half angle, not widened [rad]. full: ``steps_of(R_STEP)``.
    Returns the steps taken, or -1 when they ran out.
    """
    n = Z_CELLS
    dz = 2.0 * Z_MAX / n
    p = np.empty(n)
    for j in range(n):
        p[j] = below(-Z_MAX + (j + 1.0) * dz) - below(-Z_MAX + j * dz)
    fresh = p.copy()
    q = np.empty(n)
    part = np.empty((n, n))
    shift = BARRIER_SHIFT * math.sqrt(1.0 - R_STEP * R_STEP)
    t = 0.0
    steps = 0
    two_pi = 2.0 * math.pi
    for k in range(start_s.shape[0]):
        out[k] = 0.0
        for phase in range(2):  # the turn before the leg, then the leg
            stop = start_s[k] if phase == 0 else end_s[k]
            at_start = phase == 1
            steady, last_share = 0, -1.0
            while t < stop or at_start:
                move = 0.0
                r = 1.0
                if not at_start:
                    sigma = sigma_at(t, model, s0, s1, rho, table_t, table_s)
                    step = _step_for(t, R_STEP, model, s0, s1, rho, tau, table_t, table_s)
                    if sigma < 1e-7:
                        step = max(step, min(0.5, stop - t))
                    r = R_STEP
                    move = stop - t
                    if step < move:
                        move = step
                    else:
                        r = correlation(t, move, model, s0, s1, rho, tau, table_t, table_s)
                    if sigma < 1e-7:
                        p[:] = fresh * np.sum(p)
                        r = 0.0
                    elif r == R_STEP:
                        s = math.sqrt(1.0 - r * r)
                        _spread(p, full, int(6.0 * s / dz) + 2, r, q)
                        p[:] = q
                    elif r < 1.0 - 1e-9:
                        s = math.sqrt(1.0 - r * r)
                        if s > dz:
                            _kernel(r, dz, part)
                            _spread(p, part, int(6.0 * s / dz) + 2, r, q)
                            p[:] = q
                    steps += 1
                    if steps > MAX_STEPS:
                        return -1
                    t = stop if move >= stop - t else t + move
                if phase == 1:
                    sigma = sigma_at(t, model, s0, s1, rho, table_t, table_s)
                    # At the leg's own start the barrier is where it is; within the leg it is watched continuously.
                    peek = 0.0 if at_start else BARRIER_SHIFT * math.sqrt(max(0.0, 1.0 - r * r))
                    peek = min(peek, shift)
                    taken, mass = 0.0, np.sum(p)
                    for turn in range(-1, 2):
                        low = twa_rad[k] - half_rad + turn * two_pi
                        high = twa_rad[k] + half_rad + turn * two_pi
                        if sigma > 1e-9:
                            taken += _absorb(p, low / sigma - peek, high / sigma + peek, dz)
                        elif low < 0.0 < high:
                            taken += np.sum(p)
                            p[:] = 0.0
                    out[k] += taken
                    # On a long leg in a settled wind the share taken per step settles too: the rest is a power.
                    share = taken / mass if mass > 1e-12 else 0.0
                    settled = (model == AR1 and abs(sigma - s1) < 1e-4 * s1) or (model == TABLE and t >= table_t[-1])
                    if settled and r == R_STEP and abs(share - last_share) <= 1e-4 * share:
                        steady += 1
                        whole = math.floor((stop - t) / move)
                        if steady >= 8 and whole >= 2:
                            left = (1.0 - share) ** whole
                            mass = np.sum(p)
                            out[k] += mass * (1.0 - left)
                            p *= left
                            t += whole * move
                    else:
                        steady = 0
                    last_share = share
                at_start = False
    return steps


@kernel
def leg_risk(  # type: ignore[no-untyped-def]
    t0, t1, twa, before_twa, before_t, half, model, s0, s1, rho, tau, table_t, table_s
):
    """Return what a leg adds to a bound on the path's risk: Boole over its entry and its up-crossings.

    The entry at the leg's start counts in full when the leg is on the other side of the wind than the one before
    (or the first: before_t < 0), else only by what the barrier came nearer. Up-crossings of a barrier at z standard
    deviations come at the rate z phi(z) (1 / tau + |sigma'| / sigma) (Aldous 1989, the clumping heuristic, which
    overstates for low barriers); below z = 1 the rate at 1 is taken. That rate holds once the wind has had time to
    come back from the barrier; at first it presses like a Brownian motion, which adds phi(z) sqrt(4 t / (pi tau)) to
    a full entry, at most the entry once more (the reflection principle).
    """
    margin = abs(twa) - half
    s_start = sigma_at(t0, model, s0, s1, rho, table_t, table_s)
    if max(s_start, sigma_at(t1, model, s0, s1, rho, table_t, table_s)) <= 1e-9:
        return 0.0 if margin >= -1e-9 else 1.0
    entry = below(-margin / max(s_start, 1e-9))
    is_full = True
    if before_t >= 0.0 and before_twa * twa > 0.0:
        s_before = max(sigma_at(before_t, model, s0, s1, rho, table_t, table_s), 1e-9)
        entry = max(0.0, entry - below((half - abs(before_twa)) / s_before))
        is_full = False
    total, press = 0.0, 0.0
    n = 16
    dt = (t1 - t0) / n
    for i in range(n):
        t = t0 + (i + 0.5) * dt
        s = max(sigma_at(t, model, s0, s1, rho, table_t, table_s), 1e-9)
        z = max(1.0, margin / s)
        inverse_tau, growth = 0.0, 0.0
        if model == KALMAN:
            inverse_tau = 0.5 * s1 * s1 / (s * s)
            growth = inverse_tau
        elif model == AR1:
            inverse_tau = rho * s1 * s1 / (s * s)
            growth = max(0.0, inverse_tau - rho)
        elif model == TABLE:
            inverse_tau = 1.0 / tau
            later = sigma_at(t + 0.5 * dt, model, s0, s1, rho, table_t, table_s)
            earlier = sigma_at(t - 0.5 * dt, model, s0, s1, rho, table_t, table_s)
            growth = max(0.0, (later - earlier) / max(dt, 1e-9) / s)
        total += z * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) * (inverse_tau + growth) * dt
        press = max(press, z * math.sqrt(4.0 / math.pi * (t1 - t0) * inverse_tau))
    if is_full:
        entry *= 1.0 + min(1.0, press)
    return min(1.0, entry + total)


FAR_SIGMAS = 6.5  # farther outside than this nothing happens
LEAST_SIGMA_M = 0.3  # a spread is not taken smaller: no report is better
MOST_ANGLES = 1440


@kernel
def spread_at(t, errors, out):  # type: ignore[no-untyped-def]
    """Fill out (9,) with S, K = Cov(V, X) and C = Cov(V), each as (xx, xy, yy).

    errors: (3, 4) rows of direction x, y, s0 [m], s1 [m/s].
    """
    out[:] = 0.0
    for j in range(errors.shape[0]):
        dx, dy, s0, s1 = errors[j]
        s = max(s0 + s1 * t, 0.0)
        a, b, c = dx * dx, dx * dy, dy * dy
        out[0] += s * s * a
        out[1] += s * s * b
        out[2] += s * s * c
        out[3] += s * s1 * a
        out[4] += s * s1 * b
        out[5] += s * s1 * c
        out[6] += s1 * s1 * a
        out[7] += s1 * s1 * b
        out[8] += s1 * s1 * c
    out[0] += LEAST_SIGMA_M * LEAST_SIGMA_M
    out[2] += LEAST_SIGMA_M * LEAST_SIGMA_M


@kernel
def axes_of(sxx, sxy, syy):  # type: ignore[no-untyped-def]
    """Return (larger sigma, smaller sigma, x and y of the larger one's direction)."""
    mean, half = 0.5 * (sxx + syy), 0.5 * (sxx - syy)
    root = math.hypot(half, sxy)
    turn = 0.5 * math.atan2(sxy, half)
    return math.sqrt(mean + root), math.sqrt(max(mean - root, 1e-12)), math.cos(turn), math.sin(turn)


@kernel
def inside(mx, my, s, radius):  # type: ignore[no-untyped-def]
    """Return P(|X| < radius) for X of mean (mx, my) and covariance s (xx, xy, yy first)."""
    big, small, ux, uy = axes_of(s[0], s[1], s[2])
    if math.hypot(mx, my) - radius > FAR_SIGMAS * big:
        return 0.0
    a, b = mx * ux + my * uy, -mx * uy + my * ux
    low, high = max(-radius, a - FAR_SIGMAS * big), min(radius, a + FAR_SIGMAS * big)
    if high <= low:
        return 0.0
    # Over the disc's chords: the half chord bends sharply at the rim, so the nodes crowd there.
    n, total = 200, 0.0
    step = math.pi / n
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for i in range(n):
        angle = (i + 0.5) * step
        u = middle - half * math.cos(angle)
        chord = math.sqrt(max(0.0, radius * radius - u * u))
        z = (u - a) / big
        weight = math.exp(-0.5 * z * z) / (big * math.sqrt(2.0 * math.pi)) * half * math.sin(angle) * step
        total += weight * (below((chord - b) / small) - below((-chord - b) / small))
    return min(1.0, total)


@kernel
def entry_rate(mx, my, vx, vy, s, radius):  # type: ignore[no-untyped-def]
    """Return the expected number of entries into the disc in a second."""
    big, small, _, _ = axes_of(s[0], s[1], s[2])
    off = abs(math.hypot(mx, my) - radius)
    if off > FAR_SIGMAS * big:
        return 0.0
    det = s[0] * s[2] - s[1] * s[1]
    ixx, ixy, iyy = s[2] / det, -s[1] / det, s[0] / det
    # B = K S^-1 and D = C - K S^-1 K: V given X has the mean nu + B (x - mu) and the covariance D.
    bxx, bxy = s[3] * ixx + s[4] * ixy, s[3] * ixy + s[4] * iyy
    byx, byy = s[4] * ixx + s[5] * ixy, s[4] * ixy + s[5] * iyy
    dxx = s[6] - bxx * s[3] - bxy * s[4]
    dxy = s[7] - bxx * s[4] - bxy * s[5]
    dyy = s[8] - byx * s[4] - byy * s[5]
    n = min(MOST_ANGLES, max(48, int(2.0 * math.pi * radius / (0.7 * small)) + 1))
    total = 0.0
    for i in range(n):
        theta = 2.0 * math.pi * (i + 0.5) / n
        nx, ny = math.cos(theta), math.sin(theta)
        ex, ey = radius * nx - mx, radius * ny - my
        q = ixx * ex * ex + 2.0 * ixy * ex * ey + iyy * ey * ey
        if q > FAR_SIGMAS * FAR_SIGMAS:
            continue
        density = math.exp(-0.5 * q) / (2.0 * math.pi * math.sqrt(det))
        m = -(nx * (vx + bxx * ex + bxy * ey) + ny * (vy + byx * ex + byy * ey))
        d = math.sqrt(max(0.0, dxx * nx * nx + 2.0 * dxy * nx * ny + dyy * ny * ny))
        if d > 1e-9:
            z = m / d
            speed = d * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) + m * below(z)
        else:
            speed = max(0.0, m)
        total += density * speed
    return total * radius * 2.0 * math.pi / n


@kernel
def piece(  # type: ignore[no-untyped-def]
    t0, t1, bx, by, wx, wy, errors, radius, before, out
):
    """Integrate over [t0, t1] and fill out (3,): expected entries, P(inside) at the end, the largest P(inside).

    bx, by: mean of boat less vessel at t0 [m]; wx, wy: its velocity [m/s]; before: P(inside) just before t0, -1 when
    nothing came before. What is inside at t0 beyond that counts as entered.
    """
    s = np.empty(9)
    spread_at(t0, errors, s)
    first = inside(bx, by, s, radius)
    worst = first
    entries = max(0.0, first - max(0.0, before))
    t = t0
    while t < t1:
        spread_at(t, errors, s)
        big, small, _, _ = axes_of(s[0], s[1], s[2])
        mx, my = bx + wx * (t - t0), by + wy * (t - t0)
        pace = math.hypot(wx, wy) + 1e-3
        gap = math.hypot(mx, my) - radius
        # Fine enough for a Gaussian that goes by; where it is far off, on to where it may matter.
        grown = 0.0
        for j in range(errors.shape[0]):
            grown += abs(errors[j, 3])
        step = max(0.6 * small / pace, 0.02)
        if gap > FAR_SIGMAS * big:
            step = max(step, (gap - FAR_SIGMAS * big) / (pace + FAR_SIGMAS * grown))
        step = min(step, t1 - t)
        middle = t + 0.5 * step
        spread_at(middle, errors, s)
        mx, my = bx + wx * (middle - t0), by + wy * (middle - t0)
        entries += step * entry_rate(mx, my, wx, wy, s, radius)
        worst = max(worst, inside(mx, my, s, radius))
        t += step
        if t1 - t < 1e-9:
            break
    spread_at(t1, errors, s)
    last = inside(bx + wx * (t1 - t0), by + wy * (t1 - t0), s, radius)
    out[0], out[1], out[2] = entries, last, max(worst, last)

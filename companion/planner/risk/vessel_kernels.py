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

FAR_SIGMAS = 6.5       # farther outside than this nothing happens
LEAST_SIGMA_M = 0.3    # a spread is not taken smaller: no report is better
MOST_ANGLES = 1440


@kernel
def _cdf(z):  # type: ignore[no-untyped-def]
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


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
        total += weight * (_cdf((chord - b) / small) - _cdf((-chord - b) / small))
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
            speed = d * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) + m * _cdf(z)
        else:
            speed = max(0.0, m)
        total += density * speed
    return total * radius * 2.0 * math.pi / n


@kernel
def piece(  # type: ignore[no-untyped-def]
    t0, t1, bx, by, wx, wy, errors, radius, before, out,
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

"""Tides by harmonic constituents: arguments of sun and moon, node factors, and the sum of cosines.

A height or a component of a stream is ``Z0 + Σ f A cos(V + u - g)``: amplitude A and phase lag g of Greenwich
[deg, UTC] are the place's, V is the equilibrium argument, f and u are what the moon's node does in 18.6 years. Source:
Schureman, Manual of Harmonic Analysis and Prediction of Tides, US C&GS special publication 98 (1958), by which
NOAA predicts; the mean longitudes are Meeus', Astronomical Algorithms (1998), chapters 22, 25 and 47.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_J2000_S = 946_728_000.0  # 2000-01-01T12:00Z
_CENTURY_S = 36_525.0 * 86_400.0
_OMEGA_RAD = math.radians(23.452)  # obliquity of the ecliptic, and the moon's inclination to it, as Schureman has them
_INCLINED_RAD = math.radians(5.145)

# Multiples of tau (lunar hour angle), s, h, p (moon, sun, perigee), p1 (perihelion), quarter turns; the node's law.
_SIMPLE: dict[str, tuple[int, int, int, int, int, int, str]] = {
    "SA": (0, 0, 1, 0, 0, 0, ""),
    "SSA": (0, 0, 2, 0, 0, 0, ""),
    "MM": (0, 1, 0, -1, 0, 0, "MM"),
    "MSF": (0, 2, -2, 0, 0, 0, "MSF"),
    "MF": (0, 2, 0, 0, 0, 0, "MF"),
    "2Q1": (1, -3, 0, 2, 0, 1, "O1"),
    "SIGMA1": (1, -3, 2, 0, 0, 1, "O1"),
    "Q1": (1, -2, 0, 1, 0, 1, "O1"),
    "RHO1": (1, -2, 2, -1, 0, 1, "O1"),
    "O1": (1, -1, 0, 0, 0, 1, "O1"),
    "M1": (1, 0, 0, 1, 0, -1, "M1"),
    "CHI1": (1, 0, 2, -1, 0, -1, "J1"),
    "PI1": (1, 1, -3, 0, 1, 1, ""),
    "P1": (1, 1, -2, 0, 0, 1, ""),
    "S1": (1, 1, -1, 0, 0, 0, ""),
    "K1": (1, 1, 0, 0, 0, -1, "K1"),
    "PSI1": (1, 1, 1, 0, -1, -1, ""),
    "PHI1": (1, 1, 2, 0, 0, -1, ""),
    "THETA1": (1, 2, -2, 1, 0, -1, "J1"),
    "J1": (1, 2, 0, -1, 0, -1, "J1"),
    "OO1": (1, 3, 0, 0, 0, -1, "OO1"),
    "EPSILON2": (2, -3, 2, 1, 0, 0, "M2"),
    "2N2": (2, -2, 0, 2, 0, 0, "M2"),
    "MU2": (2, -2, 2, 0, 0, 0, "M2"),
    "N2": (2, -1, 0, 1, 0, 0, "M2"),
    "NU2": (2, -1, 2, -1, 0, 0, "M2"),
    "M2": (2, 0, 0, 0, 0, 0, "M2"),
    "LAMBDA2": (2, 1, -2, 1, 0, 2, "M2"),
    "L2": (2, 1, 0, -1, 0, 2, "L2"),
    "T2": (2, 2, -3, 0, 1, 0, ""),
    "S2": (2, 2, -2, 0, 0, 0, ""),
    "R2": (2, 2, -1, 0, -1, 2, ""),
    "K2": (2, 2, 0, 0, 0, 0, "K2"),
    "M3": (3, 0, 0, 0, 0, 0, "M3"),
}
# Of shallow water: sums and differences of the above, with their arguments and node factors.
_COMPOUND = {
    "MNS2": "M2 N2 -S2",
    "2MS2": "M2 M2 -S2",
    "MKS2": "M2 K2 -S2",
    "MSN2": "M2 S2 -N2",
    "2MN2": "M2 M2 -N2",
    "2SM2": "S2 S2 -M2",
    "MO3": "M2 O1",
    "2MK3": "M2 M2 -K1",
    "SO3": "S2 O1",
    "MK3": "M2 K1",
    "SK3": "S2 K1",
    "N4": "N2 N2",
    "MN4": "M2 N2",
    "M4": "M2 M2",
    "SN4": "S2 N2",
    "MS4": "M2 S2",
    "MK4": "M2 K2",
    "S4": "S2 S2",
    "SK4": "S2 K2",
    "2MN6": "M2 M2 N2",
    "M6": "M2 M2 M2",
    "MSN6": "M2 S2 N2",
    "2MS6": "M2 M2 S2",
    "2MK6": "M2 M2 K2",
    "2SM6": "S2 S2 M2",
    "MSK6": "M2 S2 K2",
    "S6": "S2 S2 S2",
    "M8": "M2 M2 M2 M2",
    "2MSN8": "M2 M2 S2 N2",
    "3MS8": "M2 M2 M2 S2",
    "2MS8": "M2 M2 S2 S2",
}
_ALIASES = {
    "LAM2": "LAMBDA2",
    "LDA2": "LAMBDA2",
    "RHO": "RHO1",
    "SIG1": "SIGMA1",
    "EPS2": "EPSILON2",
    "EP2": "EPSILON2",
    "THE1": "THETA1",
    "2(MS)8": "2MS8",
}
KNOWN = (*_SIMPLE, *_COMPOUND)


def constituent_named(name: str) -> str | None:
    """Return the name by which a constituent is known here, None where it is not; Z0, the mean, is none.

    >>> constituent_named("nu2"), constituent_named("LAM2"), constituent_named("X9")
    ('NU2', 'LAMBDA2', None)
    """
    upper = name.strip().upper()
    upper = _ALIASES.get(upper, upper)
    return upper if upper in _SIMPLE or upper in _COMPOUND else None


def phasors(names: Sequence[str], utc_s: ArrayLike) -> Complexes:
    """Return (t, c): ``f exp(i (V + u))`` of constituents at Unix times.

    The tide is the sum of the real parts of its products with A exp(-i g). Names are of ``constituent_named``.
    """
    times = np.atleast_1d(np.asarray(utc_s, dtype=np.float64))
    angles = _angles_rad(times)
    nodes = _nodes(angles)
    simple: dict[str, Complexes] = {}

    def of(name: str) -> Complexes:
        if name not in simple:
            *multiples, node = _SIMPLE[name]
            turns = sum(k * angles[:, i] for i, k in enumerate(multiples[:5])) + 0.5 * math.pi * int(multiples[5])
            simple[name] = np.exp(1j * turns) * nodes[node] if node else np.exp(1j * turns)
        return simple[name]

    out = np.ones((times.size, len(names)), dtype=np.complex128)
    for column, name in enumerate(names):
        for part in _COMPOUND.get(name, name).split():
            value = of(part.lstrip("-"))
            # A difference has the difference of arguments, and both factors.
            out[:, column] *= np.conj(value) if part.startswith("-") else value
    return out


def _angles_rad(utc_s: Floats) -> Floats:
    """Return (t, 6): tau, s, h, p, p1 and N, the longitude of the moon's ascending node [rad]."""
    t = (utc_s - _J2000_S) / _CENTURY_S
    s = 218.3164477 + 481_267.88123421 * t - 0.0015786 * t**2
    h = 280.46646 + 36_000.76983 * t + 0.0003032 * t**2
    p = 83.3532465 + 4_069.0137287 * t - 0.0103200 * t**2
    p1 = 282.93735 + 1.71946 * t + 0.00046 * t**2
    n = 125.0445479 - 1_934.1362891 * t + 0.0020754 * t**2
    sun = 360.0 * np.mod(utc_s / 86_400.0, 1.0) + 180.0  # hour angle of the mean sun at Greenwich
    return np.radians(np.stack([sun + h - s, s, h, p, p1, n], axis=-1))


def _nodes(angles: Floats) -> dict[str, Complexes]:
    """Return ``f exp(i u)`` by the law of the node (Schureman, equations 65 to 78, 149, 195 to 235)."""
    half = 0.5 * (np.mod(angles[:, 5] + math.pi, 2.0 * math.pi) - math.pi)
    total, less = 0.5 * (_OMEGA_RAD + _INCLINED_RAD), 0.5 * (_OMEGA_RAD - _INCLINED_RAD)
    one = np.arctan2(math.cos(less) / math.cos(total) * np.sin(half), np.cos(half)) - half
    two = np.arctan2(math.sin(less) / math.sin(total) * np.sin(half), np.cos(half)) - half
    xi, nu = -(one + two), one - two
    inc = np.arccos(
        math.cos(_OMEGA_RAD) * math.cos(_INCLINED_RAD)
        - math.sin(_OMEGA_RAD) * math.sin(_INCLINED_RAD) * np.cos(2.0 * half)
    )
    sin_i, sin_2i = np.sin(inc), np.sin(2.0 * inc)
    big_p = angles[:, 3] - xi
    nu_1 = np.arctan2(sin_2i * np.sin(nu), sin_2i * np.cos(nu) + 0.3347)
    nu_2 = 0.5 * np.arctan2(sin_i**2 * np.sin(2.0 * nu), sin_i**2 * np.cos(2.0 * nu) + 0.0727)
    m2 = np.cos(0.5 * inc) ** 4 / 0.91544
    o1 = sin_i * np.cos(0.5 * inc) ** 2 / 0.37988
    tan2 = np.tan(0.5 * inc) ** 2
    r_a = np.arctan2(np.sin(2.0 * big_p), 1.0 / (6.0 * tan2) - np.cos(2.0 * big_p))
    q = np.arctan2(0.483 * np.sin(big_p), np.cos(big_p))
    k1 = np.sqrt(0.8965 * sin_2i**2 + 0.6001 * sin_2i * np.cos(nu) + 0.1006)
    k2 = np.sqrt(19.0444 * sin_i**4 + 2.7702 * sin_i**2 * np.cos(2.0 * nu) + 0.0981)
    l2 = m2 * np.sqrt(1.0 - 12.0 * tan2 * np.cos(2.0 * big_p) + 36.0 * tan2**2)
    m1 = o1 * np.sqrt(2.310 + 1.435 * np.cos(2.0 * big_p))

    def factor(f: Floats, u: Floats | float) -> Complexes:
        return np.asarray(f * np.exp(1j * u), dtype=np.complex128)

    u_m2 = 2.0 * (xi - nu)
    return {
        "MM": factor((2.0 / 3.0 - sin_i**2) / 0.5021, 0.0),
        "MF": factor(sin_i**2 / 0.1578, -2.0 * xi),
        "MSF": factor(m2, -u_m2),
        "O1": factor(o1, 2.0 * xi - nu),
        "J1": factor(sin_2i / 0.7214, -nu),
        "OO1": factor(sin_i * np.sin(0.5 * inc) ** 2 / 0.016358, -2.0 * xi - nu),
        "K1": factor(k1, -nu_1),
        "K2": factor(k2, -2.0 * nu_2),
        "M1": factor(m1, q - big_p - nu),
        "M2": factor(m2, u_m2),
        "M3": factor(m2**1.5, 1.5 * u_m2),
        "L2": factor(l2, u_m2 - r_a),
    }

"""How a wind's spread grows with time, compiled: what problems state of it, and search, risk and references ask."""

from __future__ import annotations

import math

from companion.kernels.jit import kernel

SIGMA_MODELS = ("none", "kalman", "ar1", "forecast")
"""By number for kernels: a table (``forecast``) is looked up by who has it."""
NONE, KALMAN, AR1, TABLE = range(4)


@kernel
def sigma_of(t_s: float, model: int, s0: float, s1: float, rho: float) -> float:
    """Return sigma [rad] at ``t_s`` >= 0: ``s1`` is the growth [rad/sqrt s] of ``kalman``, the limit [rad] of ``ar1``.

    A multiple of ``s0`` and ``s1`` gives that multiple of sigma.
    """
    if model == KALMAN:
        return math.sqrt(s0 * s0 + s1 * s1 * t_s)
    if model == AR1:
        v0, vi = s0 * s0, s1 * s1
        return math.sqrt(max(0.0, vi + (v0 - vi) * math.exp(-2.0 * rho * t_s)))
    return 0.0

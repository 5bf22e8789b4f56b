"""Small arithmetic of the compiled loop."""

from __future__ import annotations

import math

from companion.kernels.jit import kernel


@kernel
def wrap(angle: float) -> float:
    """Return an angle [rad] on -π..π."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


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

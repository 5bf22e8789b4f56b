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

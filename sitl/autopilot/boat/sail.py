"""The sail's driving force, compiled: SIM_Sailboat's, or that of a boat that sails by a polar."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar
from companion.kernels.jit import kernel
from sitl.autopilot.boat.scalars import clip

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
    attack it is none. Near head to wind the sail pushes her astern as it does there.
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

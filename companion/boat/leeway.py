"""Leeway: how far to leeward of her bow a boat goes through the water.

The sail's side force grows with the square of the apparent wind and the sine of its angle. The keel's lift, which
grows with speed times side speed, and the drag of the flow across hull and keel, with the square of the side speed,
hold against it. At small angles this is the well known leeway = K heel / speed^2 (Garrett, The Symmetry of Sailing,
1987), with the heel that goes with that force; without way on the drift stays finite.

>>> round(math.degrees(leeway_rad(coefficient_of(math.radians(5.0)), 6.0, math.radians(30.0), 2.0)), 6)
5.0
"""

from __future__ import annotations

import math

# Cross-flow drag of hull and keel as a share of the slope of the keel's lift: a plate's drag of 1.17 across the stream
# (Hoerner, Fluid-Dynamic Drag, 3) over the slope 2 pi / (1 + 2 / A) of a keel whose aspect ratio A is about 1.
CROSS_FLOW = 0.5
# Where the leeway of a boat is stated: close-hauled, the apparent wind so many times her speed.
STATED_AWA_RAD = math.radians(30.0)
STATED_RATIO = 3.0


def coefficient_of(beat_rad: float) -> float:
    """Return the coefficient of a boat whose leeway is ``beat_rad`` where it is stated."""
    slope = math.tan(beat_rad)
    return (slope + CROSS_FLOW * slope * slope) / (STATED_RATIO**2 * math.sin(STATED_AWA_RAD))


def leeway_rad(coefficient: float, aws_mps: float, awa_rad: float, speed_mps: float) -> float:
    """Return the angle from bow to course through the water [rad, 0 or more], sheeted as for full speed."""
    push = coefficient * aws_mps * aws_mps * abs(math.sin(awa_rad))
    if push == 0.0:
        return 0.0
    side_mps = 2.0 * push / (math.sqrt(speed_mps * speed_mps + 4.0 * CROSS_FLOW * push) + abs(speed_mps))
    return math.atan2(side_mps, abs(speed_mps))


def leeway_at(coefficient: float, twa_rad: float, tws_mps: float, speed_mps: float) -> float:
    """Return the same for a heading at ``twa_rad`` to the true wind."""
    across, ahead = tws_mps * math.sin(twa_rad), tws_mps * math.cos(twa_rad) + speed_mps
    return leeway_rad(coefficient, math.hypot(across, ahead), math.atan2(across, ahead), speed_mps)

"""Time cut into steps, and what the boat can do in each: headings and speeds on either tack in the wind that blows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sitl.clairvoyant.race import Floats, Race

PARTS = 3            # of a step: in each the heading follows the wind
ANGLE_RAD = math.radians(5.0)    # between the angles that are tried
PORT, STARBOARD = 0, 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Steps of ``step_s`` seconds.

    Attributes:
        angle_rad: (a,) angles to the wind that are sailed, the least first.
        twd_rad: (count * PARTS,) the wind in the middle of each part.
        speed_mps: (count * PARTS, a).
        tack_s: what a change of side takes of the steps that it begins with.
        board: steps on a tack at the least.
    """

    step_s: float
    angle_rad: Floats
    twd_rad: Floats
    speed_mps: Floats
    tack_s: float
    board: int

    @property
    def count(self) -> int:
        """Number of steps."""
        return len(self.twd_rad) // PARTS


def steps_of(race: Race, step_s: float, until_s: float, angle_rad: float = ANGLE_RAD) -> Steps:
    """Return the steps until ``until_s``, and those of a board that begins then."""
    craft = race.craft
    board = max(1, math.ceil(craft.tack_s / step_s), math.floor(craft.board_s / step_s + 1e-9))
    count = math.ceil(until_s / step_s) + 1 + board
    twd, tws = race.weather.at((np.arange(count * PARTS) + 0.5) * step_s / PARTS)
    low, high = craft.no_go_half_rad, craft.max_twa_rad
    best = craft.polar.best_beat(float(np.mean(tws)), no_go_half_rad=low).twa_rad
    angles = np.unique([*np.linspace(low, high, max(2, 1 + math.ceil((high - low) / angle_rad - 1e-9))), best])
    speeds = np.stack([craft.polar.speeds_mps(angles, float(w)) for w in tws])
    return Steps(step_s=step_s, angle_rad=angles, twd_rad=twd, speed_mps=speeds, tack_s=craft.tack_s, board=board)

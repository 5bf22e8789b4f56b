"""A motorboat with two motors, as Schmitt's (2013, section 5.2): thrust, drag, and turning by their difference.

The controller in her boat turns a rudder angle into u1 and u2 (``companion.field.controllers.motor_commands``); the
rudder is the line controller's. Numbers are those of a boat of 1.5 m and 40 kg that makes 2 m/s with both motors at
one half, which is what u1 and u2 add up to; no measured boat stands behind them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.field.controllers import motor_commands, rudder_for
from companion.geo.angles import wrap_pi

STEP_S = 0.05
MASS_KG = 40.0
INERTIA_KGM2 = 12.0
MOTOR_N = 32.0            # each at u = 1
ARM_M = 0.35              # of a motor from the keel
DRAG_KGPM = 8.0           # 2 m/s at 32 N
TURN_DRAG_NMS = 14.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorBoat:
    """Where it is: east, north [m], heading [rad], speed ahead [m/s], turn rate [rad/s] to starboard."""

    en_m: tuple[float, float] = (0.0, 0.0)
    heading_rad: float = 0.0
    speed_mps: float = 0.0
    turn_radps: float = 0.0

    @property
    def velocity_en_mps(self) -> tuple[float, float]:
        """Velocity over ground."""
        return self.speed_mps * math.sin(self.heading_rad), self.speed_mps * math.cos(self.heading_rad)

    def step(self, u1: float, u2: float, seconds: float = STEP_S) -> MotorBoat:
        """Return the boat after a step with the left motor at ``u1`` and the right one at ``u2``, both in [-1, 1]."""
        u1, u2 = max(-1.0, min(1.0, u1)), max(-1.0, min(1.0, u2))
        push = MOTOR_N * (u1 + u2) - DRAG_KGPM * self.speed_mps * abs(self.speed_mps)
        turn = MOTOR_N * ARM_M * (u1 - u2) - TURN_DRAG_NMS * self.turn_radps
        speed = self.speed_mps + seconds * push / MASS_KG
        rate = self.turn_radps + seconds * turn / INERTIA_KGM2
        heading = wrap_pi(self.heading_rad + seconds * rate)
        east = self.en_m[0] + seconds * speed * math.sin(heading)
        north = self.en_m[1] + seconds * speed * math.cos(heading)
        return MotorBoat(en_m=(east, north), heading_rad=heading, speed_mps=speed, turn_radps=rate)

    def steer(self, wanted_rad: float, seconds: float = 1.0) -> MotorBoat:
        """Return the boat after ``seconds`` of steering a heading by the rudder law and u1, u2."""
        boat = self
        for _ in range(round(seconds / STEP_S)):
            boat = boat.step(*motor_commands(rudder_for(boat.heading_rad, wanted_rad)))
        return boat

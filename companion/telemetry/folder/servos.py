"""What the servos did on a voyage, counted.

The energy of sailing goes into rudder and sheet; to spend less of it is Büsser's future work (2009, chapter 2, VI).
"""

from __future__ import annotations

from dataclasses import dataclass, field

# A smaller change is the autopilot's dither, not a movement [us]; a servo's whole way is some 1000.
MOVED_US = 10


@dataclass(slots=True)
class Servo:
    """One output: how often it set out or turned back, and how far it went in all [us]."""

    movements: int = 0
    travel_us: int = 0
    _at_us: int = 0
    _way: int = 0

    def take(self, now_us: int) -> None:
        """Take what it is told now [us]."""
        if self._at_us:
            step_us = now_us - self._at_us
            if abs(step_us) < MOVED_US:
                self._way = 0
                return
            way = 1 if step_us > 0 else -1
            self.movements += way != self._way
            self.travel_us += abs(step_us)
            self._way = way
        self._at_us = now_us


@dataclass(slots=True)
class Servos:
    """Accumulates over the outputs.

    The autopilot tells them once a second: what goes to and fro in between is not seen.
    """

    by_number: dict[int, Servo] = field(default_factory=dict)

    def take(self, servo_us: tuple[int, ...]) -> None:
        """Take the outputs of one step [us], from the first on; none: they are not told."""
        for number, now_us in enumerate(servo_us, start=1):
            if now_us:
                self.by_number.setdefault(number, Servo()).take(now_us)

    def to_dict(self) -> dict[str, dict[str, int]]:
        """Return movements and travel of each output that moved, by its number."""
        return {
            str(number): {"movements": servo.movements, "travel_us": servo.travel_us}
            for number, servo in sorted(self.by_number.items()) if servo.movements
        }

"""What a boat is that is not the plan's: her hull, her sensors, the waves that she meets. Values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves:
    """A seaway: what it takes from her speed and how it turns her about.

    Attributes:
        from_rad: where the waves come from.
        loss: the share of her speed that is lost head to sea; none with it, half of it abeam.
        yaw_rad: how far her bow swings to each side.
        period_s: of that swing.
    """

    from_rad: float = 0.0
    loss: float = 0.0
    yaw_rad: float = 0.0
    period_s: float = 4.0

    def share(self, heading_rad: float) -> float:
        """Return the share of her speed that is left on a heading."""
        return 1.0 - self.loss * 0.5 * (1.0 + math.cos(heading_rad - self.from_rad))

    def wobble_radps(self, t_s: float) -> float:
        """Return the turn that the waves give her."""
        rate_hz = 2.0 * math.pi / self.period_s
        return self.yaw_rad * rate_hz * math.cos(rate_hz * t_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """Sensors that err all the time, and that nobody knows of.

    Attributes:
        vane_rad: the vane points so far to starboard of the wind's true angle.
        compass_rad: the heading is told so far to starboard of the true one.
        deviation_rad: beside it, the compass errs by this times the sine of heading less ``deviation_at_rad``: what
            the iron of a boat does, in its first and greatest terms (coefficients B and C).
        deviation_at_rad: the heading on which that error is none.
        gps_noise_m: spread of the position's error, east and north each; it wanders (a Gauss-Markov process) ...
        gps_noise_s: ... with this correlation time.
        gps_lag_s: the position is so old.
    """

    vane_rad: float = 0.0
    compass_rad: float = 0.0
    deviation_rad: float = 0.0
    deviation_at_rad: float = 0.0
    gps_noise_m: float = 0.0
    gps_noise_s: float = 30.0
    gps_lag_s: float = 0.0

    def compass_error_rad(self, heading_rad: float) -> float:
        """Return how far to starboard the compass errs on a heading."""
        return self.compass_rad + self.deviation_rad * math.sin(heading_rad - self.deviation_at_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class Departures:
    """A boat that is not the plan's.

    Attributes:
        beat, reach, run: shares of the polar's speed at 45, 90 and 150 degrees to the true wind, straight between.
        leeway_rad: on a beat, the apparent wind 30 degrees off her bow and three times as fast as she.
        tack_fails: the chance that a tack does.
        irons_s: for so long she lies near head to wind then, before she falls off to the old tack.
        waves: the seaway.
        sensors: what errs.
    """

    beat: float = 1.0
    reach: float = 1.0
    run: float = 1.0
    leeway_rad: float = 0.0
    tack_fails: float = 0.0
    irons_s: float = 10.0
    waves: Waves = field(default_factory=Waves)
    sensors: Sensors = field(default_factory=Sensors)

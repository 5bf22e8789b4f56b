"""The current as the rest of the program sees it: one value with its doubt and where it comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.angles import heading_of, wrap_two_pi

# A weaker one turns the heading of a boat of 2 m/s by less than 3 degrees: less than she wanders about her line.
LEAST_MPS = 0.1
# Of drift' P^-1 drift, which is chi-squared with two degrees of freedom in still water: 99 % of it is below this ...
BEYOND_DOUBT = 9.21
# ... and what was planned for once stays until it is well within its doubt, or half as strong.
IN_DOUBT = 4.0

BOTH_RAD = math.radians(40.0)   # headings this far apart tell a current from a polar's error


@dataclass(frozen=True, slots=True, kw_only=True)
class WaterCurrent:
    """The motion of the water over the ground.

    Attributes:
        east_mps, north_mps: where it goes [m/s].
        var_ee, var_en, var_nn: its covariance [m²/s²].
        is_significant: it is strong and sure enough to be planned for; else plans are of still water.
        headings_rad: how far apart the headings are that told of it [rad, 0..π]; 0: one heading, or none.
        samples_s: seconds of steady sailing that told of it.
        verdict: what is wrong with it, or not known of it, in words; empty: nothing.
    """

    east_mps: float = 0.0
    north_mps: float = 0.0
    var_ee: float = 0.0
    var_en: float = 0.0
    var_nn: float = 0.0
    is_significant: bool = False
    headings_rad: float = 0.0
    samples_s: float = 0.0
    verdict: str = ""

    @property
    def en_mps(self) -> tuple[float, float]:
        """Towards east and north [m/s]."""
        return self.east_mps, self.north_mps

    @property
    def drift_mps(self) -> float:
        """How fast [m/s]."""
        return math.hypot(self.east_mps, self.north_mps)

    @property
    def set_rad(self) -> float:
        """Where to [rad, true]."""
        return wrap_two_pi(heading_of(self.east_mps, self.north_mps)) if self.drift_mps > 0.0 else 0.0

    @property
    def sigma_mps(self) -> float:
        """The standard deviation in its most uncertain direction [m/s]."""
        mean, half = 0.5 * (self.var_ee + self.var_nn), 0.5 * (self.var_ee - self.var_nn)
        return math.sqrt(max(0.0, mean + math.hypot(half, self.var_en)))

    def sigma_along_mps(self, east: float, north: float) -> float:
        """Return the standard deviation along a unit vector [m/s]."""
        return math.sqrt(max(0.0, self.var_ee * east**2 + 2.0 * self.var_en * east * north + self.var_nn * north**2))

    @property
    def beyond_doubt(self) -> float:
        """How far it is from still water: drift' P^-1 drift, inf where there is no doubt."""
        det = self.var_ee * self.var_nn - self.var_en**2
        if det <= 0.0:
            return math.inf if self.drift_mps > 0.0 else 0.0
        return (self.var_nn * self.east_mps**2 - 2.0 * self.var_en * self.east_mps * self.north_mps
                + self.var_ee * self.north_mps**2) / det

    def is_worth_planning(self, *, was: bool) -> bool:
        """Return whether plans should reckon with it; ``was``: they did."""
        if was:
            return self.drift_mps >= 0.5 * LEAST_MPS and self.beyond_doubt >= IN_DOUBT
        return self.drift_mps >= LEAST_MPS and self.beyond_doubt >= BEYOND_DOUBT

    @property
    def planned_en_mps(self) -> tuple[float, float]:
        """What plans reckon with [m/s, towards east and north]: 0 where it is not significant."""
        return self.en_mps if self.is_significant else (0.0, 0.0)

    def sentence(self) -> str:
        """Return one line: set, drift and how sure; in brackets what is not known of it."""
        remarks = [self.verdict] if self.verdict else []
        if self.samples_s > 0.0 and self.headings_rad < BOTH_RAD:
            remarks.append("told on one heading, where a polar's error or leeway looks the same")
        text = (f"current {math.degrees(self.set_rad):03.0f}° {self.drift_mps:.2f} m/s, "
                f"give or take {self.sigma_mps:.2f} m/s")
        return f"{text} ({'; '.join(remarks)})" if remarks else text


STILL_WATER = WaterCurrent()

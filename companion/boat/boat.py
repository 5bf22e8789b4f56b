"""The boat: everything about it that a plan depends on, as one value."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.boat.leeway import coefficient_of, leeway_at
from companion.boat.polar import Polar

SPEED_ANGLES = 73   # of ``Boat.problem_speeds``: 2.5 degrees apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Hull:
    """Size of the hull [m] and how far the position of its antenna can be wrong [m]."""

    length_m: float = 1.0
    beam_m: float = 0.3
    position_error_m: float = 2.5  # a plain GPS receiver's 95 % figure

    def __post_init__(self) -> None:
        for name in ("length_m", "beam_m", "position_error_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be 0 m or more")

    @property
    def reach_m(self) -> float:
        """How far the hull reaches from the place that the position is of, which is amidships [m]."""
        return 0.5 * math.hypot(self.length_m, self.beam_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Boat:
    """Polar, limits and losses.

    Attributes:
        polar: Speed by true wind angle and speed.
        no_go_half_rad: Half angle of the no-go zone about the true wind [rad, 0..π).
        max_twa_rad: Deepest angle sailed [rad, above no_go_half_rad, to π].
        turn_rate_radps: Rate of turn in a manoeuvre [rad/s, above 0].
        tack_loss_s: Time lost in a tack beyond the turn itself [s].
        gybe_loss_s: The same for a gybe [s].
        can_tack: False for a boat that does not get through the wind's eye: its plans gybe round instead.
        gybe_room_m: Leg to leeward that gybing round needs [m]; None: five turning radii at full speed.
        hull: Its size.
        has_motor: It has an auxiliary motor that the autopilot can run.
        max_tws_mps: More wind than this she is not to be out in [m/s]; None: there is no such limit.
        min_tws_mps: In less than this she makes no way [m/s].
        tack_fails: The chance that a tack fails [0..1), before any was seen; 0: they are not reckoned to fail.
        leeway_rad: On a beat, the apparent wind 30 degrees off her bow and three times as fast as she; see ``leeway``.
    """

    polar: Polar
    no_go_half_rad: float = math.radians(45.0)
    max_twa_rad: float = math.pi
    turn_rate_radps: float = math.radians(30.0)
    tack_loss_s: float = 0.0
    gybe_loss_s: float = 0.0
    can_tack: bool = True
    gybe_room_m: float | None = None
    hull: Hull = field(default_factory=Hull)
    has_motor: bool = False
    leeway_rad: float = 0.0
    max_tws_mps: float | None = None
    min_tws_mps: float | None = None
    tack_fails: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.no_go_half_rad < math.pi:
            raise ValueError(f"no-go half angle {math.degrees(self.no_go_half_rad):.1f}° is outside 0..180°")
        if not self.no_go_half_rad <= self.max_twa_rad <= math.pi + 1e-9:
            raise ValueError(f"deepest angle {math.degrees(self.max_twa_rad):.1f}° is outside the no-go angle..180°")
        if not (math.isfinite(self.turn_rate_radps) and self.turn_rate_radps > 0.0):
            raise ValueError(f"turn rate {self.turn_rate_radps} rad/s must be positive")
        for name in ("tack_loss_s", "gybe_loss_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be 0 s or more")
        if not 0.0 <= self.leeway_rad < math.pi / 4.0:
            raise ValueError(f"leeway of {math.degrees(self.leeway_rad):.1f}° is outside 0..45°")
        if not 0.0 <= self.tack_fails < 1.0:
            raise ValueError(f"tack_fails is {self.tack_fails}; it must be a chance from 0 to below 1")
        if self.gybe_room_m is not None and not (math.isfinite(self.gybe_room_m) and self.gybe_room_m >= 0.0):
            raise ValueError(f"gybe_room_m is {self.gybe_room_m}; it must be 0 m or more")

    def made_good_rad(self, twa_rad: float, tws_mps: float) -> float:
        """Return the angle to the wind of her course through the water, with her bow at ``twa_rad`` [rad, 0..π]."""
        if self.leeway_rad == 0.0:
            return twa_rad
        speed = self.polar.speed_mps(twa_rad, tws_mps)
        return min(twa_rad + leeway_at(coefficient_of(self.leeway_rad), twa_rad, tws_mps, speed), math.pi)

    def _made_good(
        self, twa_rad: NDArray[np.float64], speed_mps: NDArray[np.float64], tws_mps: float,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return a polar's curve by her course in place of her bow's angle, and the speed along it."""
        k = coefficient_of(self.leeway_rad)
        bows = np.unique(np.concatenate([twa_rad, np.radians(np.arange(0.0, 181.0, 5.0))]))
        speeds = np.interp(bows, twa_rad, speed_mps)
        slips = np.array([leeway_at(k, float(b), tws_mps, float(v)) for b, v in zip(bows, speeds, strict=True)])
        courses = np.minimum(bows + slips, math.pi)
        # Nearer to the wind than where her course comes nearest to it she only drifts more: not sailed by anybody.
        later = np.append(np.minimum.accumulate(courses[::-1])[::-1][1:], math.inf)
        kept = courses < later - 1e-6
        return courses[kept], (speeds / np.maximum(np.cos(slips), 0.1))[kept]

    def problem_boat(self, tws_mps: float) -> dict[str, Any]:
        """Return the ``boat`` part of a planning problem in this wind (degrees, as its JSON has them).

        A polar that is the same at every angle becomes the constant model. Losses and what is
        unusual are written where there are any. Angles are those of courses through the water: with leeway they are
        wider than the bow's.
        """
        twa_rad, speed_mps = self.polar.curve(tws_mps)
        if self.leeway_rad > 0.0:
            twa_rad, speed_mps = self._made_good(twa_rad, speed_mps, tws_mps)
        speed: dict[str, Any]
        if bool(np.all(speed_mps == speed_mps[0])):
            speed = {"model": "constant", "v_mps": float(speed_mps[0])}
        else:
            twa_deg = [round(float(a), 9) for a in np.degrees(twa_rad)]
            speed = {"model": "polar", "twa_deg": twa_deg, "v_mps": [float(v) for v in speed_mps]}
        out: dict[str, Any] = {
            "no_go_half_deg": math.degrees(self.made_good_rad(self.no_go_half_rad, tws_mps)),
            "max_twa_deg": math.degrees(self.max_twa_rad),
            "turn_rate_rad_s": self.turn_rate_radps,
            "speed": speed,
        }
        if self.tack_loss_s > 0.0:
            out["tack_loss_s"] = self.tack_loss_s
        if self.gybe_loss_s > 0.0:
            out["gybe_loss_s"] = self.gybe_loss_s
        if not self.can_tack:
            out["can_tack"] = False
        for name in ("gybe_room_m", "max_tws_mps", "min_tws_mps"):
            if getattr(self, name) is not None:
                out[name] = getattr(self, name)
        return out

    def problem_speeds(self) -> dict[str, Any]:
        """Return the ``boat.speeds`` of a planning problem: her speed in every wind, as her polar's columns have it."""
        return _speeds_of(self)


@lru_cache(maxsize=4)
def _speeds_of(boat: Boat) -> dict[str, Any]:
    angles = np.linspace(0.0, math.pi, SPEED_ANGLES)
    rows = []
    for tws_mps in boat.polar.tws_mps.tolist():
        twa_rad, speed_mps = boat.polar.curve(tws_mps)
        if boat.leeway_rad > 0.0:
            twa_rad, speed_mps = boat._made_good(twa_rad, speed_mps, tws_mps)  # noqa: SLF001 - the value's own module
        rows.append([round(float(v), 4) for v in np.interp(angles, twa_rad, speed_mps)])
    return {"tws_mps": boat.polar.tws_mps.tolist(), "twa_deg": [round(float(a), 6) for a in np.degrees(angles)],
            "v_mps": rows}

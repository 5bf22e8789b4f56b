"""Who sails WRSC 2013: guidance by field with look-ahead, by plan with the field as last resort, Schmitt's bare field.

All see the intruder through its datagrams alone: JSON to report, report to track, track to predicted discs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import shapely

from companion.field.guidance import go_to, step
from companion.field.look_ahead import way_out_rad
from companion.field.values import GuidanceSettings, GuidanceState, Intent, MovingObstacle, Situation
from companion.field.vector_fields import Uniform
from companion.geo.frame import LocalFrame
from companion.traffic import TargetLimits, Targets, Vessel, decode_json, predict
from companion.traffic.occupancy import Keep
from companion.traffic.predict import STEADY, risk_factor
from sitl.world import LENGTH_M

HALF_M = 100.0
SHUTTLE_M = 30.0      # while waiting: to and fro across the wind, this far each side of the centre
WAIT_BOX_M = 85.0
FAR_M = 600.0         # beyond what both can run in a minute and a half
CLEARANCE_M = 12.0    # between hulls; the task asks for 5
KEEP = Keep(sigmas=risk_factor(1e-4), clearance_m=CLEARANCE_M, own_radius_m=0.5 * LENGTH_M, own_timing_mps=0.05,
            ahead_m=25.0, horizon_s=180.0)


class FieldSkipper:
    """Waits by shuttling through the centre, leaves by the side that is soonest reached clear of the intruder."""

    def __init__(
        self, habits_for: Callable[..., GuidanceSettings], frame: LocalFrame, *, look_ahead: bool,
        half_m: float = HALF_M
    ) -> None:
        self.irons = self.plans = 0
        self.last_resort_s = 0.0
        self._habits_for = habits_for
        self._targets = Targets.empty(frame, TargetLimits())
        self._state = GuidanceState()
        self._look_ahead = look_ahead
        self._end = 1
        self._exit_rad: float | None = None
        self._half_m = half_m
        self.entered = False

    def watch(self, seen: Situation, datagram: bytes | None) -> tuple[Vessel, ...]:
        """Fold the datagram in; return the vessels now."""
        if datagram is not None:
            report = decode_json(datagram, seen.t_s)
            if report is not None:
                self._targets = self._targets.heard(report)
        vessels = self._targets.picture(seen.t_s).vessels
        for vessel in vessels:
            east, north = predict(vessel, seen.t_s, STEADY).mean_en_m
            # A metre inside, so that the noise of its position does not open the gate too early.
            if max(abs(east), abs(north)) < self._half_m - 1.5:
                self.entered = True
        return vessels

    def decide(self, seen: Situation, datagram: bytes | None) -> tuple[float, float]:
        """Return (heading, thrust)."""
        return self.by_field(seen, self.watch(seen, datagram))

    def by_field(self, seen: Situation, vessels: tuple[Vessel, ...]) -> tuple[float, float]:
        """Steer by the field."""
        seen = replace(seen, obstacles=obstacles_of(vessels, seen))
        habits = self._habits_for(seen.tws_mps, look_ahead=self._look_ahead, horizon_s=90.0 if self.entered else 60.0)
        intent = self._leave(seen, habits) if self.entered else self._wait(seen)
        self._state, setpoint = step(self._state, seen, intent, habits)
        self.irons = self._state.irons
        return setpoint.heading_rad, setpoint.thrust

    def _wait(self, seen: Situation) -> Intent:
        assert seen.twd_from_rad is not None
        across = seen.twd_from_rad + math.pi / 2.0
        # Upwind of the centre a little: leeway and tacks lose ground to leeward.
        up = 10.0
        centre = (up * math.sin(seen.twd_from_rad), up * math.cos(seen.twd_from_rad))
        reach = self._end * SHUTTLE_M
        end = (centre[0] + reach * math.sin(across), centre[1] + reach * math.cos(across))
        if math.dist(seen.en_m, end) < 15.0 or self._beyond(seen, centre, across):
            self._end = -self._end
        box = (-WAIT_BOX_M, -WAIT_BOX_M, WAIT_BOX_M, WAIT_BOX_M)
        intent = go_to(end, seen.twd_from_rad, half_m=15.0)
        is_near_edge = max(abs(seen.en_m[0]), abs(seen.en_m[1])) > 0.6 * WAIT_BOX_M
        return replace(intent, stay_in=box) if self._look_ahead and is_near_edge else intent

    def _beyond(self, seen: Situation, centre: tuple[float, float], across: float) -> bool:
        along = (seen.en_m[0] - centre[0]) * math.sin(across) + (seen.en_m[1] - centre[1]) * math.cos(across)
        return along * self._end > SHUTTLE_M

    def _leave(self, seen: Situation, habits: GuidanceSettings) -> Intent:
        """Head for the side of the square that is reached soonest on a heading that stays clear."""
        assert seen.twd_from_rad is not None
        if max(abs(seen.en_m[0]), abs(seen.en_m[1])) > self._half_m + 30.0 and self._exit_rad is not None:
            return Intent(field=Uniform(self._exit_rad))
        square = shapely.box(-self._half_m, -self._half_m, self._half_m, self._half_m)
        self._exit_rad = way_out_rad(seen, square, habits, self._exit_rad)
        return Intent(field=Uniform(self._exit_rad))


def obstacles_of(vessels: tuple[Vessel, ...], seen: Situation) -> tuple[MovingObstacle, ...]:
    """Return the discs of the vessels as obstacles of the guidance, at the sigmas and clearance of ``KEEP``."""
    out = []
    for vessel in vessels:
        now = predict(vessel, seen.t_s, STEADY)
        if math.dist(now.mean_en_m, seen.en_m) > FAR_M:
            continue
        later = predict(vessel, seen.t_s + 90.0, STEADY)
        k = KEEP.sigmas
        sigma_now = max(now.sigma_along_m, now.sigma_across_m)
        sigma_later = max(later.sigma_along_m, later.sigma_across_m)
        keep = now.reach_m + KEEP.own_radius_m + KEEP.clearance_m + k * sigma_now
        out.append(MovingObstacle(en_m=now.mean_en_m, velocity_en_mps=now.velocity_en_mps, keep_m=keep,
                            growth_mps=k * (sigma_later - sigma_now) / 90.0))
    return tuple(out)

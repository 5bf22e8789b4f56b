"""The helm: what of the autopilot's parameters and of the boat decides how she follows legs, as one value."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.boat.margins import AutopilotLimits
from companion.boat.tracking import kernel as k

DEFAULT_WP_SPEED_MPS = 2.0   # the firmware's
CURVE_NODES = 91           # of the polar: every two degrees


@dataclass(frozen=True, slots=True, kw_only=True)
class Helm:
    """How legs are followed. The parameters' defaults are ArduRover's for a sailboat.

    Attributes:
        wp_radius_m: WP_RADIUS, which the corner's curve passes the waypoint by.
        turn_radius_m: TURN_RADIUS, and the tightest circle that she turns in.
        wp_speed_mps: WP_SPEED: a boat's speed does not obey it, the point that she follows does.
        accel_mps2: WP_ACCEL or ATC_ACCEL_MAX, of that point.
        jerk_mps3: WP_JERK, of that point; 0 there means the acceleration's figure.
        pos_p: PSC_POS_P [1/s].
        vel_p: PSC_VEL_P [1/s].
        lateral_mps2: ATC_TURN_MAX_G, as an acceleration.
        no_go_half_rad: SAIL_NO_GO_ANGLE.
        corridor_m: SAIL_XTRACK_MAX; 0: none.
        pivot_rate_radps: WP_PIVOT_RATE, in a tack.
        rate_max_radps: ATC_STR_RAT_MAX.
        rate_change_radps2: ATC_STR_ACC_MAX.
        gather_m: Way in which she gathers or loses her speed [m]: 2 for the simulator's hull of 2 kg.
        angle_p: ATC_STR_ANG_P [1/s].
        wind_lag_s: Time constant of the autopilot's true wind [s]: WNDVN_TRUE_FILT 0.05 Hz.
        latency_s: How old the autopilot's position is when it steers by it [s].

    """

    wp_radius_m: float = 2.0
    turn_radius_m: float = 0.9
    wp_speed_mps: float = DEFAULT_WP_SPEED_MPS
    accel_mps2: float = 1.0
    jerk_mps3: float = 1.0
    pos_p: float = 0.2
    vel_p: float = 1.0
    lateral_mps2: float = 0.6 * 9.80665
    no_go_half_rad: float = math.radians(45.0)
    corridor_m: float = 10.0
    pivot_rate_radps: float = math.radians(60.0)
    rate_max_radps: float = math.radians(120.0)
    rate_change_radps2: float = math.radians(120.0)
    gather_m: float = 2.0
    angle_p: float = 2.0
    wind_lag_s: float = 3.2
    latency_s: float = 0.2

    def __post_init__(self) -> None:
        for name in ("wp_radius_m", "turn_radius_m", "corridor_m", "latency_s", "pivot_rate_radps"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 or more")
        for name in ("wp_speed_mps", "accel_mps2", "jerk_mps3", "pos_p", "vel_p", "lateral_mps2", "gather_m",
                     "rate_max_radps"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be above 0")

    @classmethod
    def of(cls, limits: AutopilotLimits) -> Helm:
        """Return the helm of an autopilot; what was not read is ArduRover's default."""
        speed = DEFAULT_WP_SPEED_MPS if limits.wp_speed_mps is None else limits.wp_speed_mps
        return cls(
            wp_radius_m=limits.wp_radius_m, turn_radius_m=limits.turn_radius_m, wp_speed_mps=speed,
            accel_mps2=limits.wp_accel_mps2, jerk_mps3=limits.wp_jerk_mps3,
            no_go_half_rad=limits.sail_no_go_angle_rad, corridor_m=limits.sail_xtrack_max_m)

    def settings(self) -> NDArray[np.float64]:
        """Return the kernel's settings."""
        h = np.zeros(k.H_SIZE)
        h[k.H_WP_RADIUS], h[k.H_TURN_RADIUS] = self.wp_radius_m, self.turn_radius_m
        h[k.H_WP_SPEED], h[k.H_ACCEL] = self.wp_speed_mps, self.accel_mps2
        h[k.H_POS_P], h[k.H_VEL_P], h[k.H_LATERAL] = self.pos_p, self.vel_p, self.lateral_mps2
        h[k.H_NO_GO], h[k.H_CORRIDOR] = self.no_go_half_rad, self.corridor_m
        h[k.H_PIVOT_RATE] = self.pivot_rate_radps
        h[k.H_RATE_MAX], h[k.H_RATE_CHANGE], h[k.H_GATHER_M] = (
            self.rate_max_radps, self.rate_change_radps2, self.gather_m)
        h[k.H_ANGLE_P], h[k.H_WIND_LAG_S], h[k.H_LATENCY_S] = self.angle_p, self.wind_lag_s, self.latency_s
        h[k.H_JERK] = self.jerk_mps3
        return h

"""Predict the track that the autopilot will sail along legs, in a steady wind and in winds that spread about it.

>>> from companion.boat import ardurover_sitl
>>> track = predict([(0.0, 0.0), (60.0, 0.0), (60.0, -60.0)], GuidanceModel(wp_radius_m=10.0, wp_speed_mps=5.0),
...                 curve_mps=curve_of(ardurover_sitl(), 5.0), twd_from_rad=0.0)
>>> round(float(np.min(np.hypot(track.en_m[:, 0] - 60.0, track.en_m[:, 1]))), 1)
10.5
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.boat import l1
from companion.boat import track_kernels as k
from companion.boat.margins import RATE_MAX_RADPS, AutopilotLimits, wider_s
from companion.boat.polar import Polar
from companion.geo.angles import wrap_pi

DEFAULT_WP_SPEED_MPS = 2.0  # the firmware's
HELM_KEYS = (
    "wp_radius_m",
    "turn_radius_m",
    "wp_speed_mps",
    "accel_mps2",
    "jerk_mps3",
    "corridor_m",
    "rate_max_radps",
    "rate_change_radps2",
    "pivot_rate_radps",
    "l1_period_s",
    "l1_damping",
)
"""Fields of ``GuidanceModel`` that a planning problem may state."""
CURVE_NODES = 91  # of the polar: every two degrees


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidanceModel:
    """How legs are followed: the autopilot's parameters (the defaults are ArduRover's for a sailboat) and the boat's.

    Attributes:
        wp_radius_m: WP_RADIUS, which the corner's curve passes the waypoint by.
        turn_radius_m: TURN_RADIUS, and the tightest circle that it turns in.
        wp_speed_mps: WP_SPEED: a boat's speed does not obey it, the point that it follows does.
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
        gather_m: Way in which it gathers or loses its speed [m]: 2 for the simulator's hull of 2 kg.
        angle_p: ATC_STR_ANG_P [1/s].
        wind_lag_s: Time constant of the autopilot's true wind [s]: WNDVN_TRUE_FILT 0.05 Hz.
        latency_s: How old the autopilot's position is when it steers by it [s].
        l1_period_s: NAVL1_PERIOD of ArduRover up to 4.2, which steers by L1; 0: by position control, as since 4.3.
        l1_damping: NAVL1_DAMPING.
        l1_xtrack_i: NAVL1_XTRACK_I.

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
    rate_max_radps: float = RATE_MAX_RADPS
    rate_change_radps2: float = math.radians(120.0)
    gather_m: float = 2.0
    angle_p: float = 2.0
    wind_lag_s: float = 3.2
    latency_s: float = 0.2
    l1_period_s: float = 0.0
    l1_damping: float = l1.DAMPING
    l1_xtrack_i: float = l1.XTRACK_I

    def __post_init__(self) -> None:
        for name in ("wp_radius_m", "turn_radius_m", "corridor_m", "latency_s", "pivot_rate_radps", "l1_period_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 or more")
        for name in (
            "wp_speed_mps",
            "accel_mps2",
            "jerk_mps3",
            "pos_p",
            "vel_p",
            "lateral_mps2",
            "gather_m",
            "rate_max_radps",
            "rate_change_radps2",
            "l1_damping",
        ):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be above 0")

    @classmethod
    def of(cls, limits: AutopilotLimits) -> GuidanceModel:
        """Return the helm of an autopilot; what was not read is ArduRover's default."""
        speed = DEFAULT_WP_SPEED_MPS if limits.wp_speed_mps is None else limits.wp_speed_mps
        return cls(
            wp_radius_m=limits.wp_radius_m,
            turn_radius_m=limits.turn_radius_m,
            wp_speed_mps=speed,
            accel_mps2=limits.wp_accel_mps2,
            jerk_mps3=limits.wp_jerk_mps3,
            no_go_half_rad=limits.sail_no_go_angle_rad,
            corridor_m=limits.sail_xtrack_max_m,
            rate_max_radps=limits.rate_max_radps,
            rate_change_radps2=limits.rate_change_radps2,
            pivot_rate_radps=limits.pivot_rate_radps,
            l1_period_s=limits.l1_period_s,
            l1_damping=limits.l1_damping,
        )

    def stated(self) -> dict[str, float]:
        """Return the fields that a planning problem states: those of ``HELM_KEYS`` that are not ArduRover's own."""
        own = GuidanceModel()
        return {name: value for name in HELM_KEYS if (value := getattr(self, name)) != getattr(own, name)}

    def settings(self) -> NDArray[np.float64]:
        """Return the kernel's settings."""
        h = np.zeros(k.H_SIZE)
        h[k.H_WP_RADIUS], h[k.H_TURN_RADIUS] = self.wp_radius_m, self.turn_radius_m
        h[k.H_WP_SPEED], h[k.H_ACCEL] = self.wp_speed_mps, self.accel_mps2
        h[k.H_POS_P], h[k.H_VEL_P], h[k.H_LATERAL] = self.pos_p, self.vel_p, self.lateral_mps2
        h[k.H_NO_GO], h[k.H_CORRIDOR] = self.no_go_half_rad, self.corridor_m
        h[k.H_PIVOT_RATE] = self.pivot_rate_radps
        h[k.H_RATE_MAX], h[k.H_RATE_CHANGE], h[k.H_GATHER_M] = (
            self.rate_max_radps,
            self.rate_change_radps2,
            self.gather_m,
        )
        h[k.H_ANGLE_P], h[k.H_WIND_LAG_S], h[k.H_LATENCY_S] = self.angle_p, self.wind_lag_s, self.latency_s
        h[k.H_JERK] = self.jerk_mps3
        h[k.H_L1_PERIOD], h[k.H_L1_DAMPING], h[k.H_L1_XTRACK_I] = self.l1_period_s, self.l1_damping, self.l1_xtrack_i
        return h


LONGEST_S = 20_000.0  # a track is not followed for longer
SLOWEST_MPS = 0.1  # made good: what is slower has no track worth predicting
DRAWN = 24  # winds of a spread
DRAW_SEED = 15  # one set of winds, whoever asks: a prediction is a function of its arguments


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PredictedTrack:
    """A predicted track.

    Attributes:
        en_m: (m, 2) east, north [m], a fifth of a second apart.
        leg: (m,) number of the leg sailed, from 0.
        beats: (m,) whether the autopilot holds the edge of its no-go zone there.
        arrives: Whether the last point is reached.

    """

    en_m: NDArray[np.float64]
    leg: NDArray[np.int64]
    beats: NDArray[np.bool_]
    arrives: bool

    @property
    def time_s(self) -> float:
        """How long it takes [s]."""
        return len(self.en_m) * k.KEEP_STEPS * k.STEP_S


def curve_of(polar: Polar, tws_mps: float) -> NDArray[np.float64]:
    """Return a polar's speeds in one strength of wind, as the kernel takes them: even steps of |TWA| from 0 to pi."""
    return polar.speeds_mps(np.linspace(0.0, math.pi, CURVE_NODES), tws_mps)


def predict(
    points_en_m: ArrayLike,
    helm: GuidanceModel,
    *,
    curve_mps: NDArray[np.float64],
    twd_from_rad: float | NDArray[np.float64],
    start_en_m: Sequence[float] | None = None,
    heading_rad: float | None = None,
    speed_mps: float | None = None,
    leeway_rad: NDArray[np.float64] | None = None,
    current_en_mps: tuple[float, float] = (0.0, 0.0),
    ground_turn_rad: float = 0.0,
) -> PredictedTrack:
    """Return the track along legs, over the ground.

    Across a current, or with leeway, she lies off each leg: the point that she steers to is ahead of her, and her bow
    is not on it.

    Args:
        points_en_m: (n, 2) the legs' ends, n at least 2; the first is where the first leg begins.
        helm: How the boat is steered.
        curve_mps: Speeds by the bow's |TWA| (``curve_of``).
        twd_from_rad: Where the wind comes from [rad], over the water; an array holds it every half second.
        start_en_m: Where it is; None: where the first leg begins.
        heading_rad: Its heading; None: along the first leg.
        speed_mps: Its speed through the water; None: the polar's on the first leg, at the zone's edge at the nearest.
        leeway_rad: How far to leeward of her bow she goes, in even steps of its |TWA| from 0 to pi; None: not at all.
        current_en_mps: The water's velocity over the ground, towards east and north [m/s].
        ground_turn_rad: By how much the wind over the ground, which the autopilot has, comes from further to the right
            than that over the water [rad].

    """
    points = np.ascontiguousarray(points_en_m, dtype=np.float64).reshape(-1, 2)
    keep = np.concatenate([[True], np.any(np.abs(np.diff(points, axis=0)) > 1e-6, axis=1)])
    points = points[keep]
    if len(points) < 2:
        return PredictedTrack(
            en_m=points,
            leg=np.zeros(len(points), dtype=np.int64),
            beats=np.zeros(len(points), dtype=bool),
            arrives=True,
        )
    wind = np.atleast_1d(np.asarray(twd_from_rad, dtype=np.float64))
    course = math.atan2(*(points[1] - points[0]))
    heading = course if heading_rad is None else heading_rad
    if speed_mps is None:
        off = abs(wrap_pi(float(wind[0]) - heading))
        speed_mps = float(k.polar_at(curve_mps, max(off, helm.no_go_half_rad)))
    here = points[0] if start_en_m is None else np.asarray(start_en_m, dtype=np.float64)
    state = np.array([here[0], here[1], heading, speed_mps])
    length = float(np.sum(np.hypot(*np.diff(points, axis=0).T))) + float(np.hypot(*(here - points[0])))
    slow = max(SLOWEST_MPS, 0.5 * float(np.max(curve_mps)) * math.cos(helm.no_go_half_rad))
    limit_s = min(LONGEST_S, 120.0 + 3.0 * length / slow)
    slips = np.zeros(2) if leeway_rad is None else np.ascontiguousarray(leeway_rad, dtype=np.float64)
    out = np.empty((int(limit_s / (k.STEP_S * k.KEEP_STEPS)), k.T_SIZE))
    rows = int(k.sail(points, state, wind, curve_mps, slips, (*current_en_mps, ground_turn_rad), helm.settings(), out))
    return PredictedTrack(
        en_m=out[:rows, :2].copy(),
        leg=out[:rows, k.T_LEG].astype(np.int64),
        beats=out[:rows, k.T_BEATS] > 0.0,
        arrives=rows < len(out),
    )


def drawn_winds(
    twd_from_rad: float, *, sigma_rad: float, tau_s: float, length_s: float, count: int = DRAWN
) -> NDArray[np.float64]:
    """Return (count, n) directions every half second: stationary Gaussian, correlated over ``tau_s``.

    Wolsieffer 2020, equation 17, in its exact form. ``tau_s`` of 0 or less draws one steady direction for each.
    """
    steps = int(length_s / (k.STEP_S * k.WIND_STEPS)) + 2
    rng = np.random.default_rng(DRAW_SEED)
    phi = math.exp(-k.STEP_S * k.WIND_STEPS / tau_s) if tau_s > 0.0 else 1.0
    noise = rng.standard_normal((steps, count)) * math.sqrt(1.0 - phi * phi)
    return np.asarray(twd_from_rad + sigma_rad * k.remembered(noise, rng.standard_normal(count), phi))


# How far off the line a beat that is left to the autopilot comes: the corridor, and what a tack at its edge swings.
#
# The autopilot tacks where it is a corridor off the line, at most every five seconds; what it sails beyond the edge
# depends on its speed and on how squarely it crosses it. A wind that spreads turns its course by as much as the leg
# may lie off the wind: so legs off the wind by ``SQUARE_RAD`` to either side stand for it. In winds with a spread of
# 18.6 degrees nine boards in ten stay within this (a test holds it); which share of the boards of a plan's own legs
# keeps clear is judged in drawn winds (``companion.planner.track``).

BOARDS = 10
SQUARE_RAD = math.radians(25.0)
STEP_MPS = 0.25  # the wind is rounded up to these: answers are kept


def beat_band_m(helm: GuidanceModel, polar: Polar, *, tws_mps: float) -> float:
    """Return what the boards of a beat keep within, to either side of the line [m].

    Args:
        helm: How the boat is steered; with a corridor.
        polar: Its speeds.
        tws_mps: Strength of the wind.

    Raises:
        ValueError: ``helm`` has no corridor: then a beat has no band.

    """
    if helm.corridor_m <= 0.0:
        raise ValueError("without a corridor a beat has no band")
    return _band_m(helm, polar, math.ceil(tws_mps / STEP_MPS - 1e-9) * STEP_MPS)


@lru_cache(maxsize=256)
def _band_m(helm: GuidanceModel, polar: Polar, tws_mps: float) -> float:
    curve = curve_of(polar, tws_mps)
    length_m = BOARDS * 2.0 * helm.corridor_m
    worst = helm.corridor_m
    for off in (0.0, SQUARE_RAD, -SQUARE_RAD):
        track = predict([(0.0, 0.0), (0.0, length_m)], helm, curve_mps=curve, twd_from_rad=off)
        worst = max(worst, float(np.max(np.abs(track.en_m[track.beats, 0]), initial=0.0)))
    return worst


# What the predicted track is wrong by: the 99 % of its residuals on the real ArduRover.
#
# ``python -m bench.tracking`` measures it on ArduRover 4.7.0-dev: 25 voyages of 14 to 34 legs each, WP_RADIUS 1 to 10,
# corners of 10 to 170 degrees, legs of 2 to 100 m; docs/lab/tracking.md has the figures. A leg is short when the boat
# at its best speed is there in less than ``SHORT_S``: it then overtakes the point that it follows and turns round to
# it, and which way round is chance.

SHORT_S = 4.5
# Best speed [m/s] -> 99 % of the distance between sailed and predicted track [m], where this leg, the one before and
# the one after are long, and where one of them is short. Rounded up.
SPEEDS_MPS = (0.5, 1.2, 2.3, 3.3, 4.4)
LONG_M = (1.4, 1.4, 1.4, 1.9, 6.6)
SHORT_M = (2.4, 2.4, 3.1, 6.3, 7.4)
# ... and the greatest that was sailed where one of them is short, by the best speeds that it was sailed at: a voyage
# round a row of such corners meets each of them, and the 99 % of one place is no promise for a hundred.
LOOP_SPEEDS_MPS = (0.5, 1.2, 2.3, 2.95, 3.3, 4.4)
LOOP_M = (2.7, 2.7, 4.1, 9.6, 10.0, 11.1)


def stated_error_m(best_mps: float, helm: GuidanceModel, *, has_short: bool) -> float:
    """Return the prediction's error [m] for a boat whose best speed in this wind is ``best_mps``.

    Above the fastest that was measured it grows with the speed. Where her turns are wider, so is the error, by as much.
    """
    table = SHORT_M if has_short else LONG_M
    measured_m = float(np.interp(best_mps, SPEEDS_MPS, table)) * max(1.0, best_mps / SPEEDS_MPS[-1])
    return measured_m + wider_s(helm.rate_max_radps) * best_mps


def loop_m(best_mps: float, helm: GuidanceModel) -> float:
    """Return how far off the boat's track [m] a loop about the end of a short leg takes a boat of a best speed."""
    measured_m = float(np.interp(best_mps, LOOP_SPEEDS_MPS, LOOP_M)) * max(1.0, best_mps / LOOP_SPEEDS_MPS[-1])
    return measured_m + 2.0 * wider_s(helm.rate_max_radps) * best_mps


def are_near_short(lengths_m: Sequence[float] | NDArray[np.float64], best_mps: float) -> NDArray[np.bool_]:
    """Return for each leg whether it, the one before or the one after is short."""
    short = np.asarray(lengths_m, dtype=np.float64) < SHORT_S * best_mps
    padded = np.concatenate([[False], short, [False]])
    return np.asarray(padded[:-2] | padded[1:-1] | padded[2:])

"""The track that the autopilot will sail along legs: in a steady wind, and in winds that spread about it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.boat.polar import Polar
from companion.boat.tracking import kernel as k
from companion.boat.tracking.helm import CURVE_NODES, Helm

LONGEST_S = 20_000.0       # a track is not followed for longer
SLOWEST_MPS = 0.1          # made good: what is slower has no track worth predicting
DRAWN = 24                 # winds of a spread
DRAW_SEED = 15             # one set of winds, whoever asks: a prediction is a function of its arguments


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Predicted:
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
    points_en_m: ArrayLike, helm: Helm, *, curve_mps: NDArray[np.float64], twd_from_rad: float | NDArray[np.float64],
    start_en_m: Sequence[float] | None = None, heading_rad: float | None = None, speed_mps: float | None = None,
) -> Predicted:
    """Return the track along legs.

    Args:
        points_en_m: (n, 2) the legs' ends, n at least 2; the first is where the first leg begins.
        helm: How she is steered.
        curve_mps: Speeds by |TWA| (``curve_of``).
        twd_from_rad: Where the wind comes from [rad]; an array holds it every half second.
        start_en_m: Where she is; None: where the first leg begins.
        heading_rad: Her heading; None: along the first leg.
        speed_mps: Her speed; None: the polar's on the first leg, her no-go zone's edge at the nearest.

    """
    points = np.ascontiguousarray(points_en_m, dtype=np.float64).reshape(-1, 2)
    keep = np.concatenate([[True], np.any(np.abs(np.diff(points, axis=0)) > 1e-6, axis=1)])
    points = points[keep]
    if len(points) < 2:
        return Predicted(en_m=points, leg=np.zeros(len(points), dtype=np.int64),
                         beats=np.zeros(len(points), dtype=bool), arrives=True)
    wind = np.atleast_1d(np.asarray(twd_from_rad, dtype=np.float64))
    course = math.atan2(*(points[1] - points[0]))
    heading = course if heading_rad is None else heading_rad
    if speed_mps is None:
        off = abs(float(k.turn_to(float(wind[0]) - heading)))
        speed_mps = float(k.polar_at(curve_mps, max(off, helm.no_go_half_rad)))
    here = points[0] if start_en_m is None else np.asarray(start_en_m, dtype=np.float64)
    state = np.array([here[0], here[1], heading, speed_mps])
    length = float(np.sum(np.hypot(*np.diff(points, axis=0).T))) + float(np.hypot(*(here - points[0])))
    slow = max(SLOWEST_MPS, 0.5 * float(np.max(curve_mps)) * math.cos(helm.no_go_half_rad))
    limit_s = min(LONGEST_S, 120.0 + 3.0 * length / slow)
    out = np.empty((int(limit_s / (k.STEP_S * k.KEEP_STEPS)), k.T_SIZE))
    rows = int(k.sail(points, state, wind, curve_mps, helm.settings(), out))
    return Predicted(
        en_m=out[:rows, :2].copy(), leg=out[:rows, k.T_LEG].astype(np.int64), beats=out[:rows, k.T_BEATS] > 0.0,
        arrives=rows < len(out))


def drawn_winds(
    twd_from_rad: float, *, sigma_rad: float, tau_s: float, length_s: float, count: int = DRAWN, seed: int = DRAW_SEED,
) -> NDArray[np.float64]:
    """Return (count, n) directions every half second: stationary Gaussian, correlated over ``tau_s``.

    Wolsieffer 2020, equation 17, in its exact form. ``tau_s`` of 0 or less draws one steady direction for each.
    """
    steps = int(length_s / (k.STEP_S * k.WIND_STEPS)) + 2
    rng = np.random.default_rng(seed)
    phi = math.exp(-k.STEP_S * k.WIND_STEPS / tau_s) if tau_s > 0.0 else 1.0
    noise = rng.standard_normal((steps, count)) * math.sqrt(1.0 - phi * phi)
    return np.asarray(twd_from_rad + sigma_rad * k.remembered(noise, rng.standard_normal(count), phi))

"""Sailed against predicted: the distance of every sailed place from the predicted track, by speed and kind of leg."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import shapely
from numpy.typing import NDArray

from bench.tracking.record import Track
from bench.tracking.trials import WINDS_MPS, Trial, beats, corners, streams
from companion.boat.tracking import GuidanceModel, PredictedTrack, are_near_short, predict
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import Vehicle
from sitl.world.environment import Constant

QUANTILES = (0.5, 0.9, 0.99, 1.0)
WP_SPEED_MPS = 5.0  # of sailboat.parm
SETTLED_LOOPS = 9000


@dataclass(frozen=True, slots=True, kw_only=True)
class Residuals:
    """Of one trial: distances to the predicted track and to the legs [m], and whether a short leg is near."""

    trial: Trial
    track_m: NDArray[np.float64]
    legs_m: NDArray[np.float64]
    is_short: NDArray[np.bool_]


@cache
def curve_mps(tws_mps: float) -> NDArray[np.float64]:
    """Return the simulator's own speeds in a wind: what is judged here is the tracking, not a polar."""
    angles = np.linspace(0.0, math.pi, 19)
    speeds = []
    for angle in angles:
        boat = Vehicle(Constant(0.0, tws_mps), Parameters({}), heading_rad=-float(angle), is_moored=True, seed=1)
        boat.settle()
        boat.set_armed(armed=True)
        boat.steer_heading(-float(angle), 1.0)
        boat.advance(SETTLED_LOOPS)
        speeds.append(max(0.0, float(boat.state[k.S_V])))
    return np.interp(np.linspace(0.0, math.pi, 91), angles, speeds)


def helm_of(trial: Trial, l1_period_s: float = 0.0) -> GuidanceModel:
    """Return the helm of a trial's autopilot; with a period that of one that steers by L1."""
    return GuidanceModel(
        wp_radius_m=trial.wp_radius_m, corridor_m=trial.corridor_m, wp_speed_mps=WP_SPEED_MPS, l1_period_s=l1_period_s
    )


def predicted(trial: Trial, l1_period_s: float = 0.0) -> PredictedTrack:
    """Return the prediction for a trial of corners or of a current: from rest, in its steady wind."""
    twd_rad, tws_mps = trial.water_wind
    return predict(
        [(0.0, 0.0), *trial.points_en_m],
        helm_of(trial, l1_period_s),
        curve_mps=curve_mps(tws_mps),
        twd_from_rad=twd_rad,
        speed_mps=0.0,
        current_en_mps=trial.current_en_mps,
        ground_turn_rad=-twd_rad,
    )


def residuals(trial: Trial, sailed: Track, l1_period_s: float = 0.0) -> Residuals:
    """Return the residuals of one trial, as ``predicted`` is told."""
    track = predicted(trial, l1_period_s)
    points = shapely.points(sailed[:, 1:3])
    path = np.asarray([(0.0, 0.0), *trial.points_en_m])
    nearest = shapely.STRtree(shapely.points(track.en_m)).nearest(points)
    near = are_near_short(np.hypot(*np.diff(path, axis=0).T), float(np.max(curve_mps(trial.tws_mps))))
    return Residuals(
        trial=trial,
        track_m=shapely.distance(shapely.LineString(track.en_m), points),
        legs_m=shapely.distance(shapely.LineString(path), points),
        is_short=near[track.leg[nearest]],
    )


def table(sailed: dict[str, Track]) -> Iterator[str]:
    """Yield the table's rows: by the boat's best speed, legs that are long and legs near a short one."""
    yield "best speed | legs | sailed m | residual m: 50 %, 90 %, 99 %, greatest | off the legs m: 99 %"
    for tws in WINDS_MPS:
        rows = [residuals(t, sailed[t.name]) for t in corners() if t.tws_mps == tws and t.name in sailed]
        if not rows:
            continue
        for name, want in (("long", False), ("short", True)):
            track = np.concatenate([r.track_m[r.is_short == want] for r in rows])
            legs = np.concatenate([r.legs_m[r.is_short == want] for r in rows])
            if len(track):
                figures = ", ".join(f"{q:.2f}" for q in np.quantile(track, QUANTILES))
                yield (
                    f"{np.max(curve_mps(tws)):.1f} m/s | {name} | {len(track)} | {figures} | "
                    f"{np.quantile(legs, 0.99):.2f}"
                )


def l1_table(sailed: dict[str, Track], l1_period_s: float) -> Iterator[str]:
    """Yield the rows of an autopilot that steers by L1: by its own prediction, and by that of position control."""
    yield "best speed | legs | sailed m | by L1 m: 50 %, 99 %, greatest | by position control m | off the legs m: 99 %"
    for tws in WINDS_MPS:
        trials = [t for t in corners() if t.tws_mps == tws]
        by_l1, by_position = ([residuals(t, sailed[t.name], s) for t in trials] for s in (l1_period_s, 0.0))
        for name, want in (("long", False), ("short", True)):
            own, other = (
                np.concatenate([r.track_m[r.is_short == want] for r in rows]) for rows in (by_l1, by_position)
            )
            legs = np.concatenate([r.legs_m[r.is_short == want] for r in by_l1])
            told = (", ".join(f"{q:.2f}" for q in np.quantile(off, (0.5, 0.99, 1.0))) for off in (own, other))
            yield (
                f"{np.max(curve_mps(tws)):.1f} m/s | {name} | {len(own)} | {' | '.join(told)} | "
                f"{np.quantile(legs, 0.99):.2f}"
            )


def stream_table(sailed: dict[str, Track]) -> Iterator[str]:
    """Yield the rows of the currents: each trial's residuals, and those of a prediction in still water."""
    yield "wind, current | sailed m | residual m: 50 %, 90 %, 99 % | without the current m | off the legs m: 99 %"
    for t in streams():
        if t.name in sailed:
            with_it, without = residuals(t, sailed[t.name]), residuals(replace(t, drift_mps=0.0), sailed[t.name])
            ours, still = (
                ", ".join(f"{q:.2f}" for q in np.quantile(r.track_m, QUANTILES[:3])) for r in (with_it, without)
            )
            yield (
                f"{t.tws_mps:g} m/s, {t.drift_mps:g} m/s to {math.degrees(t.set_rad):.0f}° | {len(with_it.track_m)} | "
                f"{ours} | {still} | {np.quantile(with_it.legs_m, 0.99):.2f}"
            )


def beyond_m(across_m: NDArray[np.float64], corridor_m: float) -> list[float]:
    """Return how far beyond the corridor's edge each board went."""
    parts = np.split(np.abs(across_m), np.flatnonzero(np.diff(np.sign(across_m)) != 0.0) + 1)
    return [float(np.max(p)) - corridor_m for p in parts if len(p) and np.max(p) > 0.6 * corridor_m]


def boards(trial: Trial, sailed: Track) -> tuple[list[float], list[float]]:
    """Return what each board of a beat went beyond the corridor [m]: sailed, and predicted in the wind that blew."""
    leg = sailed[sailed[:, 3] == 2.0]
    since = leg[:, 0] - leg[0, 0]
    wind = np.interp(np.arange(0.0, since[-1], 0.5), since, np.unwrap(leg[:, 4]))
    track = predict(
        trial.points_en_m,
        helm_of(trial),
        curve_mps=curve_mps(trial.tws_mps),
        twd_from_rad=wind,
        start_en_m=(float(leg[0, 1]), float(leg[0, 2])),
        heading_rad=0.0,
    )
    return (beyond_m(leg[:, 1], trial.corridor_m), beyond_m(track.en_m[track.leg == 0, 0], trial.corridor_m))


def beat_table(sailed: dict[str, Track]) -> Iterator[str]:
    """Yield the beats' rows."""
    yield "corridor, wind, spread | boards | sailed beyond the edge m: median, greatest | predicted: median, greatest"
    for t in beats():
        if t.name in sailed:
            real, ours = boards(t, sailed[t.name])
            yield (
                f"{t.corridor_m:g} m, {t.tws_mps:g} m/s, {math.degrees(t.spread_rad):.1f}° | {len(real)} | "
                f"{np.median(real):.2f}, {max(real):.2f} | {np.median(ours):.2f}, {max(ours):.2f}"
            )

"""The wind in the view: now and to come, the no-go zone as it widens, the laylines, the polar with the boat on it."""

from __future__ import annotations

import math
from functools import lru_cache

from companion.boat import AutopilotLimits, Boat
from companion.current import over_water
from companion.fold import Step
from companion.geo.angles import difference_rad, heading_of, unit_en
from companion.messages import VehicleState, WindForecast
from companion.skipper.step import SkipperConfig
from companion.skipper.way import PointEn, Voyage, half_width_rad, mean_twd_rad
from companion.view import air
from companion.view.numbers import compass, degrees, place, rounded, signed

HORIZONS_S = (0.0, 30.0, 60.0, 120.0, 300.0, 600.0)
WEDGES_S = (0.0, 60.0, 300.0)
LEVELS = (0.5, 0.8, 0.95)
SWING_LEVEL = 0.8          # of the fan that a layline is drawn with
SIGMA_AT_S = 60.0          # the spread in figures is that of a minute ahead, as in the status
HAS_WAY_MPS = 0.2


def planned_no_go_rad(config: SkipperConfig, voyage: Voyage, limits: AutopilotLimits | None) -> float:
    """Return the half angle that plans keep out of, before it is widened."""
    of_autopilot = config.no_go_half_rad if limits is None else limits.sail_no_go_angle_rad
    return max(of_autopilot + config.no_go_pad_rad, voyage.boat.no_go_half_rad)


@lru_cache(maxsize=64)   # asked for twice in every step, and the search takes longer than all else in a view
def best_angles(boat: Boat, tws_mps: float, no_go_rad: float) -> tuple[float, float]:
    """Return the best angles to windward and to leeward [rad]."""
    beat = boat.polar.best_beat(tws_mps, no_go_half_rad=no_go_rad)
    return beat.twa_rad, boat.polar.best_run(tws_mps, max_twa_rad=boat.max_twa_rad).twa_rad


def wind_of(step: Step) -> air.Wind | None:
    """Return the wind, None when none was ever heard."""
    wind, vehicle = step.snapshot.wind, step.snapshot.vehicle
    if wind.forecast is None and wind.present_twd_from_rad is None and wind.mean_twd_from_rad is None:
        return None
    forecast = wind.forecast
    twd_rad, tws_mps = wind.present_twd_from_rad, wind.present_tws_mps
    awa_rad, aws_mps = apparent(twd_rad, tws_mps, vehicle)
    return air.Wind(
        health=wind.health.value, verdict=wind.verdict,
        twd_from_deg=None if twd_rad is None else compass(twd_rad), tws_mps=rounded(tws_mps),
        mean_twd_from_deg=None if wind.mean_twd_from_rad is None else compass(wind.mean_twd_from_rad),
        mean_tws_mps=rounded(wind.mean_tws_mps),
        sigma_deg=None if forecast is None else degrees(_at(forecast, SIGMA_AT_S, "sigma_twd_rad")),
        tws_sigma_mps=None if forecast is None else rounded(_at(forecast, SIGMA_AT_S, "sigma_tws_mps")),
        twa_deg=None if twd_rad is None or vehicle is None else signed(difference_rad(twd_rad, vehicle.heading_rad)),
        awa_deg=None if awa_rad is None else signed(awa_rad), aws_mps=rounded(aws_mps),
        record_s=rounded(wind.record_s, 0),
        correlation_s=None if forecast is None else rounded(forecast.correlation_time_s, 1),
        age_s=None if forecast is None else rounded(max(0.0, step.snapshot.t_s - forecast.t_s), 1),
        levels=() if forecast is None else LEVELS, bands=() if forecast is None else bands_of(forecast))


def water_of(step: Step) -> air.Water | None:
    """Return the current, None before anything is known of the water."""
    current, wind = step.snapshot.current, step.snapshot.wind
    if current.sigma_mps == 0.0:
        return None
    over = None if wind.present_twd_from_rad is None or wind.present_tws_mps is None else over_water(
        wind.present_twd_from_rad, wind.present_tws_mps, current.planned_en_mps)
    return air.Water(
        set_deg=compass(current.set_rad), drift_mps=rounded(current.drift_mps), sigma_mps=rounded(current.sigma_mps),
        is_planned=current.is_significant, verdict=current.verdict,
        twd_from_deg=None if over is None else compass(over[0]), tws_mps=None if over is None else rounded(over[1]))


def bands_of(forecast: WindForecast) -> tuple[air.Band, ...]:
    """Return the forecast at the view's horizons, as far as it reaches."""
    last_s = float(forecast.horizon_s[-1])
    return tuple(air.Band(
        horizon_s=at_s, twd_from_deg=compass(mean_twd_rad(forecast, at_s)),
        sigma_deg=degrees(_at(forecast, at_s, "sigma_twd_rad")), tws_mps=rounded(_at(forecast, at_s, "mean_tws_mps")),
        tws_sigma_mps=rounded(_at(forecast, at_s, "sigma_tws_mps")),
        half_deg=tuple(degrees(half_width_rad(forecast, at_s, level)) for level in LEVELS),
    ) for at_s in HORIZONS_S if at_s <= last_s)


def apparent(
    twd_from_rad: float | None, tws_mps: float | None, vehicle: VehicleState | None,
) -> tuple[float | None, float | None]:
    """Return the apparent wind, angle at the bow [rad] and speed [m/s], that a true wind makes on a moving boat."""
    if twd_from_rad is None or tws_mps is None or vehicle is None:
        return None, None
    east = -tws_mps * math.sin(twd_from_rad) - vehicle.velocity_en_mps[0]
    north = -tws_mps * math.cos(twd_from_rad) - vehicle.velocity_en_mps[1]
    return difference_rad(heading_of(-east, -north), vehicle.heading_rad), math.hypot(east, north)


def no_go_of(step: Step, voyage: Voyage, config: SkipperConfig) -> air.NoGo | None:
    """Return the no-go zone now and later, widened as a plan that keeps the promise in force would have it."""
    forecast, route = step.snapshot.wind.forecast, step.state.route
    if forecast is None:
        return None
    delta_s = config.delta_s if route is None else route.delta_s
    half_rad = planned_no_go_rad(config, voyage, step.snapshot.limits)
    wedges = []
    for at_s in WEDGES_S:
        if at_s <= float(forecast.horizon_s[-1]):
            widening_rad = half_width_rad(forecast, at_s, max(0.0, 2.0 * delta_s - 1.0))
            wedges.append(air.Wedge(
                horizon_s=at_s, from_deg=compass(mean_twd_rad(forecast, at_s)),
                half_deg=degrees(min(math.pi, half_rad + widening_rad)), widening_deg=degrees(widening_rad)))
    return air.NoGo(half_deg=degrees(half_rad), probability=round(delta_s, 4), wedges=tuple(wedges))


def laylines_of(
    step: Step, voyage: Voyage, config: SkipperConfig, name: str, mark_en: PointEn,
) -> air.Laylines | None:
    """Return the laylines of a mark; None where it is fetched on one course, or the wind is not known."""
    snapshot, boat = step.snapshot, voyage.boat
    here, wind, vehicle = snapshot.position_en_m, snapshot.wind, snapshot.vehicle
    twd_rad, tws_mps, current = wind.mean_twd_from_rad, wind.mean_tws_mps, snapshot.current.planned_en_mps
    if here is None or vehicle is None or twd_rad is None or tws_mps is None or math.dist(here, mark_en) < 1.0:
        return None
    twd_rad, tws_mps = over_water(twd_rad, tws_mps, current)
    no_go_rad = planned_no_go_rad(config, voyage, snapshot.limits)
    beat, run = best_angles(boat, round(tws_mps, 1), no_go_rad)
    off_rad = abs(difference_rad(twd_rad, heading_of(mark_en[0] - here[0], mark_en[1] - here[1])))
    if off_rad < beat:
        angle_rad, is_beat = max(beat, no_go_rad), True
    elif off_rad > run + 1e-3:
        angle_rad, is_beat = run, False
    else:
        return None
    speed_mps = max(HAS_WAY_MPS, boat.polar.speed_mps(angle_rad, tws_mps))
    there_s = min(600.0, math.dist(here, mark_en) / speed_mps)
    swing = 0.0 if wind.forecast is None else half_width_rad(wind.forecast, there_s, SWING_LEVEL)
    lines = []
    for tack, side in (("starboard", 1.0), ("port", -1.0)):
        course_rad = twd_rad - side * angle_rad   # on starboard tack the wind is to the right of the bow
        if current != (0.0, 0.0):
            course_rad = heading_of(*(v * speed_mps + c for v, c in zip(unit_en(course_rad), current, strict=True)))
        lines.append(air.Layline(
            tack=tack, course_deg=compass(course_rad), swing_deg=degrees(swing),  # type: ignore[arg-type]
            reach_s=rounded(_meets_s(here, vehicle, mark_en, course_rad), 0)))
    return air.Laylines(
        name=name, mark_en_m=place(mark_en), is_beat=is_beat, angle_deg=degrees(angle_rad), level=SWING_LEVEL,
        lines=tuple(lines))


def _meets_s(here: PointEn, vehicle: VehicleState, mark_en: PointEn, course_rad: float) -> float | None:
    """Return when the boat, going on as she does, is on the line that fetches the mark [s]; None: not before it."""
    if vehicle.speed_mps < HAS_WAY_MPS:
        return None
    east, north = math.sin(course_rad), math.cos(course_rad)
    across_m = (here[0] - mark_en[0]) * north - (here[1] - mark_en[1]) * east
    across_mps = vehicle.velocity_en_mps[0] * north - vehicle.velocity_en_mps[1] * east
    if abs(across_mps) < 0.05:
        return None
    time_s = -across_m / across_mps
    along_m = sum(u * (p + v * time_s - m) for u, p, v, m in zip(
        (east, north), here, vehicle.velocity_en_mps, mark_en, strict=True))
    return time_s if time_s > 0.0 and along_m < 0.0 else None


def polar_of(step: Step, voyage: Voyage, config: SkipperConfig) -> air.Polar | None:
    """Return the polar in the present wind with the boat's point; None without a wind."""
    wind, vehicle = step.snapshot.wind, step.snapshot.vehicle
    tws_mps = wind.mean_tws_mps if wind.mean_tws_mps is not None else wind.present_tws_mps
    if tws_mps is None:
        return None
    polar = voyage.boat.polar
    angles, speeds = polar.curve(tws_mps)
    no_go_rad = planned_no_go_rad(config, voyage, step.snapshot.limits)
    twd_rad = wind.present_twd_from_rad
    beat, run = best_angles(voyage.boat, round(tws_mps, 1), no_go_rad)
    has_way = vehicle is not None and twd_rad is not None
    return air.Polar(
        name=polar.name, tws_mps=rounded(tws_mps), twa_deg=tuple(degrees(float(a)) for a in angles),
        speed_mps=tuple(rounded(float(v), 3) for v in speeds),
        beat_deg=degrees(beat), run_deg=degrees(run),
        live_twa_deg=signed(difference_rad(twd_rad, vehicle.heading_rad))
        if has_way and vehicle is not None and twd_rad is not None else None,
        live_mps=rounded(vehicle.speed_mps) if vehicle is not None else None)


def _at(forecast: WindForecast, at_s: float, name: str) -> float:
    import numpy as np

    return float(np.interp(at_s, forecast.horizon_s, getattr(forecast, name)))

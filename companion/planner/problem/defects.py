"""Why a problem cannot be planned by anybody: numbers that are none, limits that contradict each other."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.planner.problem.parts import LEAST_MPS
from companion.planner.problem.value import Problem


def _coordinates(p: Problem) -> NDArray[np.float64]:
    shapes = [*p.obstacles, *([] if p.fence is None else [p.fence])]
    return np.asarray(shapely.get_coordinates(shapes), dtype=np.float64) if shapes else np.empty((0, 2))


def defect_of(p: Problem) -> str | None:
    """Return the first thing wrong, or None."""
    b, w = p.boat, p.wind
    named = {
        "start.x": p.start_en[0], "start.y": p.start_en[1], "start.heading_deg": p.start_heading_rad,
        "goal.x": p.goal_en[0], "goal.y": p.goal_en[1], "goal.radius": p.goal_radius_m,
        "wind.from_deg": w.twd_from_rad, "wind.speed_mps": 1.0 if w.tws_mps is None else w.tws_mps,
        "boat.no_go_half_deg": b.no_go_half_rad, "boat.max_twa_deg": b.max_twa_rad,
        "boat.turn_rate_rad_s": b.turn_rate_radps, "delta_s": p.delta_s, "boat.tack_loss_s": b.tack_loss_s,
        "boat.gybe_loss_s": b.gybe_loss_s,
        "boat.gybe_room_m": b.gybe_room_m or 0.0, "current": p.current.set_rad + p.current.drift_mps,
        "adrift": p.adrift.set_rad + p.adrift.drift_mps,
        "clearance_floor_m": p.clearance_floor_m, "leg_saving": p.leg_saving,
        "wind.sigma": sum((w.sigma.sigma0_rad, w.sigma.growth_rad_per_sqrt_s, w.sigma.sigma_inf_rad,
                           w.sigma.rho_hz, *w.sigma.horizon_s, *w.sigma.sigma_rad,
                           *(w.sigma.half_width_rad or ()))),
        "boat.speed": sum((*b.polar_twa_rad, *b.polar_mps)),
    }
    for t in p.targets:
        numbers = (t.x_m, t.y_m, t.vx_mps, t.vy_mps, t.radius_m, t.growth_mps, t.from_s)
        named["targets"] = named.get("targets", 0.0) + sum(numbers) + (sum(t.spread.numbers) if t.spread else 0.0)
    for name, value in named.items():
        if not math.isfinite(value):
            return f"{name} is not a finite number"
    coordinates = _coordinates(p)
    if not bool(np.all(np.isfinite(coordinates))):
        return "an obstacle or the fence has a coordinate that is not a finite number"
    far = float(np.max(np.abs(coordinates), initial=0.0))
    if max(far, *map(abs, p.start_en), *map(abs, p.goal_en)) > 1e9:
        return "a coordinate is beyond 1e9 m: this is not a local frame in metres"
    checks = (
        (0.5 <= p.delta_s < 1.0, f"delta_s {p.delta_s:g} is outside 0.5 <= delta_s < 1"),
        (p.goal_radius_m >= 0.0, f"the goal radius {p.goal_radius_m:g} m is negative"),
        (w.tws_mps is None or w.tws_mps > 0.0, "there is no wind: wind.speed_mps is not above zero"),
        (b.turn_rate_radps > 0.0, "the turn rate is not above zero"),
        (b.no_go_half_rad >= 0.0, "the no-go half angle is negative"),
        (b.max_twa_rad > 0.0, "max_twa_deg is not above zero"),
        (min(b.polar_mps) >= 0.0, "the polar has a negative speed"),
        (max(b.polar_mps) > LEAST_MPS, "the polar is zero everywhere: the boat cannot move"),
        (b.tack_loss_s >= 0.0 and b.gybe_loss_s >= 0.0, "a tack or gybe loss is negative"),
        ((b.gybe_room_m or 0.0) >= 0.0, "gybe_room_m is negative"),
        (0.0 <= b.tack_fails < 1.0, f"tack_fails {b.tack_fails:g} is outside 0 <= tack_fails < 1"),
        (0.0 <= b.irons_s < math.inf, "irons_s is no time of 0 s or more"),
        (len(b.lee_mps) == 2 and all(0.0 <= lee < math.inf for lee in b.lee_mps),
         "lee_mps is not two speeds, each 0 or more"),
        (all(limit is None or 0.0 < limit < math.inf for limit in (b.max_tws_mps, b.min_tws_mps)),
         "a limit of wind is not above zero"),
        (b.max_tws_mps is None or b.min_tws_mps is None or b.min_tws_mps < b.max_tws_mps,
         "min_tws_mps is not below max_tws_mps"),
        (w.strength is None or w.strength.is_sound, "wind.strength has a number that is negative or not finite"),
        (b.speeds is None or b.speeds.is_sound, "boat.speeds has a number that is negative or not finite"),
        (min(p.current.drift_mps, p.adrift.drift_mps) >= 0.0, "the current's drift is negative"),
        (p.clearance_floor_m >= 0.0, "the clearance floor is negative"),
        (p.leg_saving >= 0.0, "leg_saving is negative"),
        (min((w.sigma.sigma0_rad, w.sigma.growth_rad_per_sqrt_s, w.sigma.sigma_inf_rad, w.sigma.rho_hz,
              *w.sigma.sigma_rad, *(w.sigma.half_width_rad or ()))) >= 0.0,
         "a sigma, growth or rate of the wind is negative"),
        (p.risk is None or (0.0 < p.risk.max_path_risk <= 1.0 and p.risk.correlation_time_s > 0.0),
         "risk needs 0 < max_path_risk <= 1 and correlation_time_s > 0"),
        (p.fence is None or not p.fence.is_empty, "the fence is empty"),
        (p.fence_polygon is None or not p.fence_polygon.is_empty, "the fence less the clearance floor is empty"),
        (p.vessels_part is None or 0.0 < p.vessels_part < 1.0 - p.delta_s,
         "allocation.vessels is not between 0 and 1 - delta_s"),
        (p.beat is None or (0.0 < p.beat.no_go_half_rad < 0.5 * math.pi and 0.0 < p.beat.corridor_m < math.inf
                            and 0.0 <= p.beat.clearance_m < math.inf and 0.0 <= p.beat.tack_s < math.inf),
         "beat needs 0 < no_go_half_deg < 90, corridor_m > 0, clearance_m >= 0 and tack_s >= 0"),
        (p.tracking is None or p.tracking.is_finite, "tracking has a number that is negative or not finite"),
        (p.beat is None or p.current.drift_mps == 0.0 or p.zone is not None,
         "a beat left to the autopilot in a current needs its zone"),
        (p.zone is None or (math.isfinite(p.zone.from_rad) and 0.0 <= p.zone.half_rad < math.pi),
         "zone needs a finite from_deg and 0 <= half_deg < 180"),
    )
    for holds, text in checks:
        if not holds:
            return text
    return None

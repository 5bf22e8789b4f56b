"""Writes a problem in its JSON form (docs/reference/problem-format.md); reading that gives the same problem."""

from __future__ import annotations

import math
from typing import Any

import shapely

from companion.boat.failed_tack import IRONS_S
from companion.boat.tracking import HELM_KEYS
from companion.messages import Spread
from companion.planner.problem.tracking import Tracking
from companion.planner.problem.value import LEG_SAVING, Problem


def _wkt(geometry: shapely.Geometry) -> str:
    """Return WKT with every digit (shapely's own writer rounds the last): reading it gives the same numbers."""
    if geometry.is_empty:
        return "POLYGON EMPTY"

    def rings(polygon: shapely.Geometry) -> str:
        loops = (polygon.exterior, *polygon.interiors)
        return (
            "("
            + ", ".join(
                "(" + ", ".join(f"{x!r} {y!r}" for x, y in shapely.get_coordinates(r).tolist()) + ")" for r in loops
            )
            + ")"
        )

    if geometry.geom_type == "Polygon":
        return "POLYGON " + rings(geometry)
    return "MULTIPOLYGON (" + ", ".join(rings(g) for g in geometry.geoms) + ")"


def _spread_dict(s: Spread) -> dict[str, Any]:
    return {
        "vessel": s.vessel,
        "x": s.x_m,
        "y": s.y_m,
        "course_deg": math.degrees(s.course_rad),
        "keep_m": s.keep_m,
        "along_m": s.along_m,
        "along_mps": s.along_mps,
        "across_m": s.across_m,
        "across_mps": s.across_mps,
        "own_mps": s.own_mps,
        "sigma_m": s.sigma_m,
        "sigma_mps": s.sigma_mps,
    }


def to_dict(p: Problem) -> dict[str, Any]:
    """Return the JSON object of a problem; ``Problem.from_json`` of it is the same problem."""
    deg = math.degrees
    s = p.wind.sigma
    sigma: dict[str, Any] = {"model": s.model}
    if s.model == "kalman":
        sigma |= {"sigma0_deg": deg(s.sigma0_rad), "growth_deg_per_sqrt_s": deg(s.growth_rad_per_sqrt_s)}
    elif s.model == "ar1":
        sigma |= {"sigma0_deg": deg(s.sigma0_rad), "sigma_inf_deg": deg(s.sigma_inf_rad), "rho_hz": s.rho_hz}
    elif s.model == "forecast":
        sigma |= {"horizon_s": list(s.horizon_s), "sigma_deg": [deg(x) for x in s.sigma_rad]}
        if s.half_width_rad is not None:
            sigma["half_width_deg"] = [deg(x) for x in s.half_width_rad]
    out: dict[str, Any] = {
        "id": p.id,
        "title": p.title,
        "start": {"x": p.start_en[0], "y": p.start_en[1], "heading_deg": deg(p.start_heading_rad)},
        "goal": {"x": p.goal_en[0], "y": p.goal_en[1], "radius": p.goal_radius_m},
        "obstacles": [_wkt(g) for g in p.obstacles],
        "fence": None if p.fence is None else _wkt(p.fence),
        "wind": {
            "from_deg": deg(p.wind.twd_from_rad),
            "speed_mps": p.wind.tws_mps,
            "sigma": sigma,
            **({} if p.wind.strength is None else {"strength": p.wind.strength.to_dict()}),
        },
        "boat": {
            "no_go_half_deg": deg(p.boat.no_go_half_rad),
            "max_twa_deg": deg(p.boat.max_twa_rad),
            "turn_rate_rad_s": p.boat.turn_rate_radps,
            "speed": {
                "model": "polar",
                "twa_deg": [deg(a) for a in p.boat.polar_twa_rad],
                "v_mps": list(p.boat.polar_mps),
            },
            **({"tack_loss_s": p.boat.tack_loss_s} if p.boat.tack_loss_s else {}),
            **({"gybe_loss_s": p.boat.gybe_loss_s} if p.boat.gybe_loss_s else {}),
            **({} if p.boat.can_tack else {"can_tack": False}),
            **{
                name: value
                for name in ("gybe_room_m", "max_tws_mps", "min_tws_mps")
                if (value := getattr(p.boat, name)) is not None
            },
            **({"tack_fails": p.boat.tack_fails} if p.boat.tack_fails else {}),
            **({"irons_s": p.boat.irons_s} if p.boat.irons_s != IRONS_S else {}),
            **({"lee_mps": list(p.boat.lee_mps)} if any(p.boat.lee_mps) else {}),
            **(
                {}
                if p.boat.speeds is None
                else {
                    "speeds": {
                        "tws_mps": list(p.boat.speeds.tws_mps),
                        "twa_deg": [deg(a) for a in p.boat.speeds.twa_rad],
                        "v_mps": [list(row) for row in p.boat.speeds.v_mps],
                    }
                }
            ),
        },
        "delta_s": p.delta_s,
    }
    if p.obstacle_names:
        out["obstacle_names"] = list(p.obstacle_names)
    if p.notes:
        out["notes"] = p.notes
    for name, water in (("current", p.current), ("adrift", p.adrift)):
        if water.drift_mps:
            out[name] = {"set_deg": deg(water.set_rad), "drift_mps": water.drift_mps}
    if p.targets:
        out["targets"] = [
            {
                "x": t.x_m,
                "y": t.y_m,
                "vx": t.vx_mps,
                "vy": t.vy_mps,
                "radius_m": t.radius_m,
                "growth_mps": t.growth_mps,
                "from_s": t.from_s,
                "name": t.name,
                **({"until_s": t.until_s} if math.isfinite(t.until_s) else {}),
                **({"spread": _spread_dict(t.spread)} if t.spread is not None else {}),
            }
            for t in p.targets
        ]
    if p.vessels_part is not None:
        out["allocation"] = {"vessels": p.vessels_part}
    if p.risk is not None:
        out["risk"] = {"max_path_risk": p.risk.max_path_risk, "correlation_time_s": p.risk.correlation_time_s}
    if p.clearance_floor_m:
        out["clearance_floor_m"] = p.clearance_floor_m
    if p.leg_saving != LEG_SAVING:
        out["leg_saving"] = p.leg_saving
    if p.known_en:
        out["known"] = [list(place) for place in p.known_en]
    if p.beat is not None:
        out["beat"] = {
            "no_go_half_deg": deg(p.beat.no_go_half_rad),
            "corridor_m": p.beat.corridor_m,
            "clearance_m": p.beat.clearance_m,
            "tack_s": p.beat.tack_s,
        }
    if p.tracking is not None:
        out["tracking"] = _tracking_dict(p.tracking)
    if p.zone is not None:
        out["zone"] = {"from_deg": deg(p.zone.from_rad), "half_deg": deg(p.zone.half_rad)}
    return out | dict(p.extra)


def _tracking_dict(t: Tracking) -> dict[str, Any]:
    return {
        **{name: getattr(t.helm, name) for name in HELM_KEYS},
        "no_go_half_deg": math.degrees(t.helm.no_go_half_rad),
        "floor_m": t.floor_m,
        "reach_m": t.reach_m,
        "solids": [_wkt(g) for g in t.solids],
        "limits": None if t.limits is None else _wkt(t.limits),
        "before": None if t.before_en is None else {"x": t.before_en[0], "y": t.before_en[1]},
        "correlation_s": t.correlation_s,
        "known": t.is_known,
    }

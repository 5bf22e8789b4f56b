"""Decisions as records: actions, outcomes and steps in the form that decisions.jsonl and track.csv hold.

Angles are degrees here: people read these files.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from companion.current import plain
from companion.fold import Step
from companion.geo.angles import wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.mavlink.wire import mission_hash
from companion.messages import AisReport, Command, GeoPoint
from companion.orders import Order
from companion.skipper.step import (
    Action,
    Outcome,
    PlanOutcome,
    ReadOutcome,
    RequestPlan,
    SkipperConfig,
    Snapshot,
    SteerHeading,
    UploadFence,
    UploadMission,
)
from companion.telemetry.folder.recorder import jsonable

# The no-go zone's half angle is recorded at these times after a plan was made [s].
WIDENING_S = (0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0, 300.0, 450.0, 600.0, 900.0)
# The spread shown along the track is that of a minute ahead [s].
SHOWN_HORIZON_S = 60.0


def action_record(action: Action, snapshot: Snapshot, config: SkipperConfig) -> dict[str, Any]:
    """Return an action with the numbers behind it."""
    kind = type(action).__name__
    if isinstance(action, RequestPlan):
        problem = action.problem
        return {
            "kind": "action", "action": kind, "request_id": action.request_id, "reason": action.reason.value,
            "rung": action.rung, "text": action.text, "from_seq": action.from_seq, "seed": action.seed,
            "budget_s": action.budget_s, "start": list(problem.start_en), "goal": list(problem.goal_en),
            "delta_s": problem.delta_s, "twd_deg": math.degrees(wrap_two_pi(problem.wind.twd_from_rad)),
            "tws_mps": problem.wind.tws_mps,
            "widening": [[t, math.degrees(problem.no_go_half_rad(t))] for t in WIDENING_S],
            "cross_track_m": snapshot.autopilot.cross_track_m if snapshot.autopilot else None,
            "margin_m": config.margin_m,
            **(_vessels(problem) if problem.targets else {}),
            **({"current": plain(snapshot.current)} if problem.current.drift_mps > 0.0 else {}),
        }
    if isinstance(action, UploadMission | UploadFence):
        fields = {
            f.name: getattr(action, f.name) for f in dataclasses.fields(action)
            if f.name not in {"items", "change", "stopgap"}
        }
        if isinstance(action, UploadMission) and action.change.apart_m is not None:
            fields |= {"path_distance_m": round(action.change.apart_m, 1), "old_route": action.change.unsafe or "safe"}
        items = [[i.command, i.lat_e7, i.lon_e7] for i in action.items]
        stopgap = getattr(action, "stopgap", None)
        if stopgap is not None:
            fields["stopgap"] = [stopgap.command, stopgap.lat_e7, stopgap.lon_e7]
        return {"kind": "action", "action": kind, **fields, "count": len(items), "hash": mission_hash(action.items),
                "items": items}
    if isinstance(action, SteerHeading):
        return {"kind": "action", "action": kind, "heading_deg": math.degrees(action.heading_rad),
                "thrust": action.thrust, "text": action.text}
    values = {f.name: jsonable(getattr(action, f.name)) for f in dataclasses.fields(action)}
    return {"kind": "action", "action": kind, **values}


def _vessels(problem: Any) -> dict[str, Any]:
    """Return whose discs a plan keeps out of, and how its promise at each instant is shared out."""
    return {
        "vessels": sorted({t.name for t in problem.targets}),
        "instant": {"wind": 1.0 - problem.wind_delta_s, "vessels": problem.vessels_share},
    }


def ais_record(report: AisReport) -> dict[str, Any]:
    """Return a report of a feed as it is, in the units of AisReport: a replay takes it back with ``ais_of``."""
    return {"kind": "ais", "report": {k: v for k, v in dataclasses.asdict(report).items() if v is not None}}


def ais_of(record: dict[str, Any]) -> AisReport:
    """Return the report in a record."""
    values = dict(record["report"])
    if "position" in values:
        values["position"] = GeoPoint(**values["position"])
    return AisReport(**values)


def order_record(order: Order) -> dict[str, Any]:
    """Return an order of the crew as it came: a replay takes it back with ``Order.from_dict``."""
    return {"kind": "order", "order": order.to_dict()}


def outcome_record(outcome: Outcome) -> dict[str, Any]:
    """Return how an action ended."""
    if isinstance(outcome, PlanOutcome):
        plan = outcome.plan
        return {
            "kind": "plan", "request_id": outcome.request_id, "text": outcome.text,
            "status": None if plan is None else plan.status.value, "plan": None if plan is None else plan.to_dict(),
        }
    if isinstance(outcome, ReadOutcome):
        items = outcome.items
        return {
            "kind": "outcome", "outcome": "ReadOutcome", "read_id": outcome.read_id, "text": outcome.text,
            "count": None if items is None else len(items), "hash": None if items is None else mission_hash(items),
            "items": None if items is None else [
                [i.command, i.lat_e7, i.lon_e7, i.alt_m, i.frame, list(i.params)] for i in items],
        }
    values = {f.name: jsonable(getattr(outcome, f.name)) for f in dataclasses.fields(outcome)}
    return {"kind": "outcome", "outcome": type(outcome).__name__, **values}


def water_record(step: Step, shift: Shift) -> dict[str, Any]:
    """Return that another frame has begun: the metres of a passage's records count from its origin from here on.

    ``drift_m`` is how far the route's points, which have been carried over at each change, are at most from the items
    on the autopilot, which are degrees.
    """
    origin, route = shift.after.origin, step.state.route
    apart = [] if route is None else [
        math.dist(shift.after.en_from_geo(item.point), en_m)
        for item, en_m in zip(route.items, route.points_en_m, strict=True) if item.command == Command.NAV_WAYPOINT]
    return {"kind": "water", "lat_deg": origin.lat_deg, "lon_deg": origin.lon_deg,
            "turn_deg": math.degrees(shift.turn_rad), "drift_m": max(apart, default=None)}


def track_row(step: Step, frames: int, clearance_m: float | None, frame: LocalFrame | None = None) -> tuple[Any, ...]:
    """Return one row of track.csv (see TRACK_COLUMNS); its metres are those of ``frame``, None: of the step's."""
    snapshot = step.snapshot
    vehicle, autopilot, wind = snapshot.vehicle, snapshot.autopilot, snapshot.wind
    east_m, north_m = snapshot.position_en_m or (None, None)
    if vehicle is not None and frame is not None and frame != step.voyage.frame:
        east_m, north_m = frame.en_from_geo(vehicle.position)
    sigma_rad = sigma_ahead_rad(snapshot)
    return (
        # The time is written so that reading it back gives the same number: a replay depends on it.
        repr(snapshot.t_s), frames, len(snapshot.outcomes),
        None if vehicle is None else round(vehicle.position.lat_deg, 7),
        None if vehicle is None else round(vehicle.position.lon_deg, 7),
        _round(east_m, 2), _round(north_m, 2),
        None if vehicle is None else _degrees(vehicle.heading_rad),
        None if vehicle is None else round(vehicle.speed_mps, 2),
        None if vehicle is None else _degrees(math.atan2(*vehicle.velocity_en_mps)),
        None if wind.present_twd_from_rad is None else _degrees(wind.present_twd_from_rad),
        None if sigma_rad is None else round(math.degrees(sigma_rad), 2),
        _round(wind.present_tws_mps, 2),
        "" if autopilot is None or autopilot.mode is None else autopilot.mode.name,
        step.state.phase.value,
        None if autopilot is None else autopilot.mission_seq,
        None if autopilot is None else _round(autopilot.cross_track_m, 2),
        _round(clearance_m, 2),
        _degrees(snapshot.current.set_rad), round(snapshot.current.drift_mps, 3), round(snapshot.current.sigma_mps, 3),
    )


def sigma_ahead_rad(snapshot: Snapshot) -> float | None:
    """Return the forecast's sigma of direction [rad] a minute ahead."""
    forecast = snapshot.wind.forecast
    if forecast is None:
        return None
    index = int((forecast.horizon_s >= SHOWN_HORIZON_S).argmax())
    return float(forecast.sigma_twd_rad[index])


def _round(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(wrap_two_pi(angle_rad)), 2)

"""Decisions and figures of a voyage as records: what decisions.jsonl, track.csv and summary.json hold.

Angles are degrees here: people read these files.

The energy of sailing goes into rudder and sheet; to spend less of it is Büsser's future work (2009, chapter 2, VI).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from companion.current import WaterCurrent, plain
from companion.figures import Ranges
from companion.fold import Step
from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.mavlink.wire import mission_hash
from companion.messages import AisReport, Command, GeoPoint, MissionItem, Mode, WindForecast
from companion.orders import Order
from companion.skipper import SkipperConfig
from companion.skipper.step import (
    Action,
    Announce,
    Outcome,
    Phase,
    PlanOutcome,
    ReadOutcome,
    RequestPlan,
    Snapshot,
    SteerHeading,
    UploadFence,
    UploadMission,
)
from companion.telemetry.folder.recorder import jsonable
from companion.traffic import TrafficCounts

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
            "kind": "action",
            "action": kind,
            "request_id": action.request_id,
            "reason": action.reason.value,
            "rung": action.rung,
            "text": action.text,
            "from_seq": action.from_seq,
            "seed": action.seed,
            "budget_s": action.budget_s,
            "start": list(problem.start_en),
            "goal": list(problem.goal_en),
            "delta_s": problem.delta_s,
            "twd_deg": math.degrees(wrap_two_pi(problem.wind.twd_from_rad)),
            "tws_mps": problem.wind.tws_mps,
            "leeway_deg": math.degrees(problem.boat.leeway_rad),
            "widening": [[t, math.degrees(problem.no_go_half_rad(t))] for t in WIDENING_S],
            "cross_track_m": snapshot.autopilot.cross_track_m if snapshot.autopilot else None,
            "margin_m": config.margin_m,
            **(_vessels(problem) if problem.targets else {}),
            **({"current": plain(snapshot.current)} if problem.current.drift_mps > 0.0 else {}),
        }
    if isinstance(action, UploadMission | UploadFence):
        fields = {
            f.name: getattr(action, f.name)
            for f in dataclasses.fields(action)
            if f.name not in {"items", "change", "stopgap"}
        }
        if isinstance(action, UploadMission) and action.change.apart_m is not None:
            fields |= {"path_distance_m": round(action.change.apart_m, 1), "old_route": action.change.unsafe or "safe"}
        items = [[i.command, i.lat_e7, i.lon_e7] for i in action.items]
        stopgap = getattr(action, "stopgap", None)
        if stopgap is not None:
            fields["stopgap"] = [stopgap.command, stopgap.lat_e7, stopgap.lon_e7]
        return {
            "kind": "action",
            "action": kind,
            **fields,
            "count": len(items),
            "hash": mission_hash(action.items),
            "items": items,
        }
    if isinstance(action, SteerHeading):
        return {
            "kind": "action",
            "action": kind,
            "heading_deg": math.degrees(action.heading_rad),
            "thrust": action.thrust,
            "text": action.text,
        }
    values = {f.name: jsonable(getattr(action, f.name)) for f in dataclasses.fields(action)}
    return {"kind": "action", "action": kind, **values}


def _vessels(problem: Any) -> dict[str, Any]:
    """Return whose discs a plan keeps out of, and how its promise at each instant is shared out."""
    return {
        "vessels": sorted({t.name for t in problem.targets}),
        "instant": {"wind": 1.0 - problem.wind_delta_s, "vessels": problem.vessels_share},
    }


def sounding_record(ping_m: float | None, most_m: float) -> dict[str, Any]:
    """Return a ping of a sounder that the companion hears itself."""
    reach = {} if math.isinf(most_m) else {"most_m": most_m}
    return {"kind": "sounding", "ping_m": ping_m, **reach}


def ais_record(report: AisReport) -> dict[str, Any]:
    """Return a report of a feed as it is, in the units of AisReport: a replay takes it back with ``ais_of``."""
    return {"kind": "ais", "report": {k: v for k, v in dataclasses.asdict(report).items() if v is not None}}


def ais_of(record: dict[str, Any]) -> AisReport:
    """Return the report in a record."""
    values = dict(record["report"])
    if "position" in values:
        values["position"] = GeoPoint(**values["position"])
    return AisReport(**values)


def fence_record(items: Sequence[MissionItem]) -> dict[str, Any]:
    """Return what is drawn on the autopilot as its fence, as it was read."""
    return {"kind": "fence read", "count": len(items), "items": _rows(items)}


def _rows(items: Sequence[MissionItem]) -> list[list[Any]]:
    return [[i.command, i.lat_e7, i.lon_e7, i.alt_m, i.frame, list(i.params)] for i in items]


def order_record(order: Order) -> dict[str, Any]:
    """Return an order of the crew as it came: a replay takes it back with ``Order.from_dict``."""
    return {"kind": "order", "order": order.to_dict()}


def outcome_record(outcome: Outcome) -> dict[str, Any]:
    """Return how an action ended."""
    if isinstance(outcome, PlanOutcome):
        plan = outcome.plan
        return {
            "kind": "plan",
            "request_id": outcome.request_id,
            "text": outcome.text,
            "status": None if plan is None else plan.status.value,
            "plan": None if plan is None else plan.to_dict(),
        }
    if isinstance(outcome, ReadOutcome):
        items = outcome.items
        return {
            "kind": "outcome",
            "outcome": "ReadOutcome",
            "read_id": outcome.read_id,
            "text": outcome.text,
            "count": None if items is None else len(items),
            "hash": None if items is None else mission_hash(items),
            "items": None if items is None else _rows(items),
        }
    values = {f.name: jsonable(getattr(outcome, f.name)) for f in dataclasses.fields(outcome)}
    return {"kind": "outcome", "outcome": type(outcome).__name__, **values}


def water_record(step: Step, shift: Shift) -> dict[str, Any]:
    """Return that another frame has begun: the metres of a passage's records count from its origin from here on.

    ``drift_m`` is how far the route's points, which have been carried over at each change, are at most from the items
    on the autopilot, which are degrees.
    """
    origin, route = shift.after.origin, step.state.mission.route
    apart = (
        []
        if route is None
        else [
            math.dist(shift.after.en_from_geo(item.point), en_m)
            for item, en_m in zip(route.items, route.points_en_m, strict=True)
            if item.command == Command.NAV_WAYPOINT
        ]
    )
    return {
        "kind": "water",
        "lat_deg": origin.lat_deg,
        "lon_deg": origin.lon_deg,
        "turn_deg": math.degrees(shift.turn_rad),
        "drift_m": max(apart, default=None),
    }


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
        repr(snapshot.t_s),
        frames,
        len(snapshot.outcomes),
        None if vehicle is None else round(vehicle.position.lat_deg, 7),
        None if vehicle is None else round(vehicle.position.lon_deg, 7),
        _round(east_m, 2),
        _round(north_m, 2),
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
        _degrees(snapshot.current.set_rad),
        round(snapshot.current.drift_mps, 3),
        round(snapshot.current.sigma_mps, 3),
    )


def sigma_ahead_rad(snapshot: Snapshot) -> float | None:
    """Return the forecast's sigma of direction [rad] a minute ahead."""
    forecast = snapshot.wind.forecast
    if forecast is None:
        return None
    return float(forecast.sigma_twd_rad[_ahead(forecast)])


def sigma_ahead_mps(snapshot: Snapshot) -> float | None:
    """Return the forecast's sigma of strength [m/s] a minute ahead."""
    forecast = snapshot.wind.forecast
    return None if forecast is None else float(forecast.sigma_tws_mps[_ahead(forecast)])


def _ahead(forecast: WindForecast) -> int:
    return int((forecast.horizon_s >= SHOWN_HORIZON_S).argmax())


def _round(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(wrap_two_pi(angle_rad)), 2)


# A smaller change is the autopilot's dither, not a movement [us]; a servo's whole way is some 1000.
MOVED_US = 10


@dataclass(slots=True)
class Servo:
    """One output: how often it set out or turned back, and how far it went in all [us]."""

    movements: int = 0
    travel_us: int = 0
    _at_us: int = 0
    _way: int = 0

    def take(self, now_us: int) -> None:
        """Take what it is told now [us]."""
        if self._at_us:
            step_us = now_us - self._at_us
            if abs(step_us) < MOVED_US:
                self._way = 0
                return
            way = 1 if step_us > 0 else -1
            self.movements += way != self._way
            self.travel_us += abs(step_us)
            self._way = way
        self._at_us = now_us


@dataclass(slots=True)
class Servos:
    """Accumulates over the outputs.

    The autopilot tells them once a second: what goes to and fro in between is not seen.
    """

    by_number: dict[int, Servo] = field(default_factory=dict)

    def take(self, servo_us: tuple[int, ...]) -> None:
        """Take the outputs of one step [us], from the first on; none: they are not told."""
        for number, now_us in enumerate(servo_us, start=1):
            if now_us:
                self.by_number.setdefault(number, Servo()).take(now_us)

    def to_dict(self) -> dict[str, dict[str, int]]:
        """Return movements and travel of each output that moved, by its number."""
        return {
            str(number): {"movements": servo.movements, "travel_us": servo.travel_us}
            for number, servo in sorted(self.by_number.items())
            if servo.movements
        }


# So far inside the angle to which the autopilot beats, for longer than a tack takes [s], is a no-go entry: on its edge
# it sails, and a shift takes it over.
NO_GO_ENTRY_RAD, NO_GO_ENTRY_S = math.radians(5.0), 5.0
# A tack counts when the boat has been on the new side for this long [s].
TACK_SETTLED_S = 3.0
# Positions closer together than this are GPS noise, not distance [m].
DISTANCE_STEP_M = 0.5


@dataclass(slots=True)
class SailingTime:
    """Accumulates: from the first step under way (armed, in AUTO or GUIDED) to the end of the voyage.

    What follows the end, a loiter, counts no more. ``take`` once a step.
    """

    first_s: float | None = None
    last_s: float = 0.0

    def take(self, step: Step) -> bool:
        """Take one step; return whether it counts."""
        autopilot = step.snapshot.autopilot
        sails = autopilot is not None and autopilot.is_armed and autopilot.mode in {Mode.AUTO, Mode.GUIDED}
        if step.state.voyage.over or not (sails or self.first_s is not None):
            return False
        self.last_s = step.snapshot.t_s
        if self.first_s is None:
            self.first_s = self.last_s
        return True

    @property
    def time_s(self) -> float | None:
        """How long it is; None: she has not set sail."""
        return None if self.first_s is None else self.last_s - self.first_s


@dataclass(slots=True)
class VoyageFigures:
    """Accumulates; ``take`` once a step.

    Time and distance count from the first step under way to the end of the voyage (``SailingTime``), clearance and
    contacts for as long as the boat is watched. ``promised_risk`` is the largest probability, at any instant of any
    plan that was sailed, of being forced into the no-go zone or too near to a vessel (1 - delta_s); ``path_risk`` the
    largest of a whole plan's, as if nobody replanned on the way. What vessels have of both is beside them.
    ``promised_clearance_m`` is the least clearance that a plan expected which was sailed, beside what was kept;
    ``promised_s``, ``median_s`` and ``late_s`` are the first plan's time, and when half and nine of ten of the winds of
    its spread would have brought the boat to its end: to the first goal, ``promised_to``, and no farther.
    """

    sailing: SailingTime = field(default_factory=SailingTime)
    distance_m: float = 0.0
    tacks: int = 0
    gybes: int = 0
    plans: int = 0
    replans: int = 0
    uploads: int = 0
    contacts: int = 0
    no_go_entries: int = 0
    no_go_entry_deg: float | None = None  # nearer to the wind than this, by the parameter that was read last
    min_clearance_m: float = math.inf
    promised_clearance_m: float | None = None
    promised_s: float | None = None
    promised_to: str | None = None
    median_s: float | None = None
    late_s: float | None = None
    promised_risk: float | None = None
    promised_risk_vessels: float = 0.0
    path_risk: float | None = None
    path_risk_vessels: float = 0.0
    longest_no_go_s: float = 0.0
    alerts: dict[str, int] = field(default_factory=dict)
    current: WaterCurrent | None = None
    traffic: TrafficCounts | None = None
    servos: Servos = field(default_factory=Servos)
    ranges: Ranges = field(default_factory=Ranges)
    _anchor: tuple[float, float] | None = None
    _side: int = 0
    _pending: tuple[int, float, float] | None = None
    _in_no_go_since: float | None = None
    _no_go_counted: bool = False
    _touching: bool = False

    def take(self, step: Step, clearance_m: float | None) -> None:
        """Take one step and the clearance [m] of the hull at it (None: nothing to be clear of, or no position)."""
        snapshot = step.snapshot
        if step.shift is not None and self._anchor is not None:
            self._anchor = step.shift.point(self._anchor)
        for action in step.actions:
            if isinstance(action, RequestPlan):
                self.replans += self.sailing.first_s is not None
            elif isinstance(action, UploadMission):
                self.uploads += 1
            elif isinstance(action, Announce):
                self.alerts[action.code] = self.alerts.get(action.code, 0) + 1
        self.current = snapshot.current
        if snapshot.traffic is not None:
            self.traffic = snapshot.traffic.counts
        plans = (outcome.plan for outcome in snapshot.outcomes if isinstance(outcome, PlanOutcome))
        self.plans += sum(plan is not None and plan.has_path for plan in plans)
        route = step.sailed
        if route is not None:
            self.promised_risk = max(self.promised_risk or 0.0, 1.0 - route.delta_s)
            self.promised_risk_vessels = max(self.promised_risk_vessels, route.vessels_part)
            self.path_risk_vessels = max(self.path_risk_vessels, route.vessel_risk)
            if route.expected_clearance_m is not None:
                self.promised_clearance_m = min(
                    route.expected_clearance_m,
                    math.inf if self.promised_clearance_m is None else self.promised_clearance_m,
                )
            if self.promised_s is None:
                self.promised_s, self.median_s, self.late_s = route.cost_s, route.median_s, route.late_s
                goal = next(iter(step.voyage.goals), None)
                self.promised_to = None if route.cost_s is None or goal is None else goal.name or "goal 1"
            if route.risk is not None:
                self.path_risk = max(self.path_risk or 0.0, route.risk)
        counts = self.sailing.take(step)
        if self.sailing.first_s is None:
            return
        if clearance_m is not None:
            self.min_clearance_m = min(self.min_clearance_m, clearance_m)
            self.contacts += clearance_m <= 0.0 and not self._touching
            self._touching = clearance_m <= 0.0
        if not counts:
            return  # what follows is a loiter
        self.ranges.take(step)
        if snapshot.autopilot is not None:
            self.servos.take(snapshot.autopilot.servo_us)
        if snapshot.position_en_m is not None:
            self._move(snapshot.position_en_m)
        self._wind(step)

    def _move(self, here: tuple[float, float]) -> None:
        if self._anchor is None:
            self._anchor = here
        moved_m = math.dist(here, self._anchor)
        if moved_m >= DISTANCE_STEP_M:
            self.distance_m += moved_m
            self._anchor = here

    def _wind(self, step: Step) -> None:
        snapshot = step.snapshot
        wind_rad = snapshot.wind.present_twd_from_rad
        if wind_rad is None or snapshot.vehicle is None:
            return
        t_s = snapshot.t_s
        off_rad = wrap_pi(snapshot.vehicle.heading_rad - wind_rad)
        limits = snapshot.limits
        half_rad = math.radians(45.0) if limits is None else limits.sail_no_go_angle_rad
        self.no_go_entry_deg = round(math.degrees(half_rad - NO_GO_ENTRY_RAD), 1)
        if abs(off_rad) < half_rad - NO_GO_ENTRY_RAD:
            if self._in_no_go_since is None:
                self._in_no_go_since, self._no_go_counted = t_s, False
            inside_s = t_s - self._in_no_go_since
            self.longest_no_go_s = max(self.longest_no_go_s, inside_s)
            if inside_s >= NO_GO_ENTRY_S and not self._no_go_counted:
                self.no_go_entries += 1
                self._no_go_counted = True
        else:
            self._in_no_go_since = None
        if step.state.phase is Phase.HOLDING:  # she circles round a point: no manoeuvre of the voyage's
            self._side, self._pending = 0, None
            return
        side = 1 if off_rad > 0.0 else -1
        if self._side == 0:
            self._side = side
        if side == self._side:
            self._pending = None
        elif self._pending is None:
            self._pending = (side, t_s, abs(off_rad))
        elif t_s - self._pending[1] >= TACK_SETTLED_S:
            if self._pending[2] < math.pi / 2.0:
                self.tacks += 1
            else:
                self.gybes += 1
            self._side, self._pending = side, None

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "contacts": self.contacts,
            "time_s": self.sailing.time_s,
            "distance_m": self.distance_m,
            "tacks": self.tacks,
            "gybes": self.gybes,
            "plans": self.plans,
            "replans": self.replans,
            "uploads": self.uploads,
            "min_clearance_m": self.min_clearance_m if math.isfinite(self.min_clearance_m) else None,
            "promised_clearance_m": self.promised_clearance_m,
            "promised_s": self.promised_s,
            "promised_to": self.promised_to,
            "median_s": self.median_s,
            "late_s": self.late_s,
            "promised_risk": self.promised_risk,
            "promised_risk_vessels": self.promised_risk_vessels,
            "path_risk": self.path_risk,
            "path_risk_vessels": self.path_risk_vessels,
            "no_go_entries": self.no_go_entries,
            "no_go_entry_deg": self.no_go_entry_deg,
            "current": None if self.current is None else plain(self.current),
            "servos": self.servos.to_dict(),
            "figures": self.ranges.to_dict(),
            "alerts": dict(sorted(self.alerts.items())),
            "traffic": None if self.traffic is None else asdict(self.traffic),
        }

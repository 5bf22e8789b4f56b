"""The figures of a voyage, folded step by step: what summary.json holds."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

from companion.current import WaterCurrent, plain
from companion.fold import Step
from companion.geo.angles import wrap_pi
from companion.messages import Mode
from companion.skipper.step import Announce, RequestPlan, UploadMission
from companion.telemetry.folder.servos import Servos
from companion.traffic import TrafficCounts

# Inside the no-go zone for longer than a tack takes [s] is an entry, not a tack.
NO_GO_ENTRY_S = 5.0
# A tack counts when the boat has been on the new side for this long [s].
TACK_SETTLED_S = 3.0
# Positions closer together than this are GPS noise, not distance [m].
DISTANCE_STEP_M = 0.5


@dataclass(slots=True)
class VoyageFigures:
    """Accumulates; ``take`` once a step.

    Time and distance count from the first step under way (armed, AUTO) to the end of the voyage, clearance and contacts
    for as long as the boat is watched. ``promised_risk`` is the largest probability, at any instant of any plan that
    was sailed, of being forced into the no-go zone or too near to a vessel (1 - delta_s); ``path_risk`` the largest of
    a whole plan's, as if nobody replanned on the way. What vessels have of both is beside them.
    ``promised_clearance_m`` is the least clearance that a plan expected which was sailed, beside what was kept;
    ``promised_s``, ``median_s`` and ``late_s`` are the first plan's time, and when half and nine of ten of the winds of
    its spread would have brought her to its end.
    """

    first_s: float | None = None
    last_s: float = 0.0
    distance_m: float = 0.0
    tacks: int = 0
    gybes: int = 0
    plans: int = 0
    replans: int = 0
    uploads: int = 0
    contacts: int = 0
    no_go_entries: int = 0
    min_clearance_m: float = math.inf
    promised_clearance_m: float | None = None
    promised_s: float | None = None
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
                self.plans += 1
                self.replans += self.first_s is not None
            elif isinstance(action, UploadMission):
                self.uploads += 1
            elif isinstance(action, Announce):
                self.alerts[action.code] = self.alerts.get(action.code, 0) + 1
        self.current = snapshot.current
        if snapshot.traffic is not None:
            self.traffic = snapshot.traffic.counts
        route = step.state.route
        if route is not None:
            self.promised_risk = max(self.promised_risk or 0.0, 1.0 - route.delta_s)
            self.promised_risk_vessels = max(self.promised_risk_vessels, route.vessels_part)
            self.path_risk_vessels = max(self.path_risk_vessels, route.vessel_risk)
            if route.expected_clearance_m is not None:
                self.promised_clearance_m = min(
                    route.expected_clearance_m,
                    math.inf if self.promised_clearance_m is None else self.promised_clearance_m)
            if self.promised_s is None:
                self.promised_s, self.median_s, self.late_s = route.cost_s, route.median_s, route.late_s
            if route.risk is not None:
                self.path_risk = max(self.path_risk or 0.0, route.risk)
        autopilot = snapshot.autopilot
        sails = autopilot is not None and autopilot.is_armed and autopilot.mode in {Mode.AUTO, Mode.GUIDED}
        if sails and self.first_s is None and not step.state.over:
            self.first_s = snapshot.t_s
        if self.first_s is None:
            return
        if clearance_m is not None:
            self.min_clearance_m = min(self.min_clearance_m, clearance_m)
            self.contacts += clearance_m <= 0.0 and not self._touching
            self._touching = clearance_m <= 0.0
        if step.state.over:
            return   # what follows is a loiter
        self.last_s = snapshot.t_s
        if autopilot is not None:
            self.servos.take(autopilot.servo_us)
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
        # Sailing exactly on the edge is what the autopilot does: an entry is clearly inside.
        if abs(off_rad) < half_rad - math.radians(5.0):
            if self._in_no_go_since is None:
                self._in_no_go_since, self._no_go_counted = t_s, False
            inside_s = t_s - self._in_no_go_since
            self.longest_no_go_s = max(self.longest_no_go_s, inside_s)
            if inside_s >= NO_GO_ENTRY_S and not self._no_go_counted:
                self.no_go_entries += 1
                self._no_go_counted = True
        else:
            self._in_no_go_since = None
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
            "time_s": None if self.first_s is None else self.last_s - self.first_s,
            "distance_m": self.distance_m,
            "tacks": self.tacks,
            "gybes": self.gybes,
            "plans": self.plans,
            "replans": self.replans,
            "uploads": self.uploads,
            "min_clearance_m": self.min_clearance_m if math.isfinite(self.min_clearance_m) else None,
            "promised_clearance_m": self.promised_clearance_m,
            "promised_s": self.promised_s,
            "median_s": self.median_s,
            "late_s": self.late_s,
            "promised_risk": self.promised_risk,
            "promised_risk_vessels": self.promised_risk_vessels,
            "path_risk": self.path_risk,
            "path_risk_vessels": self.path_risk_vessels,
            "no_go_entries": self.no_go_entries,
            "current": None if self.current is None else plain(self.current),
            "servos": self.servos.to_dict(),
            "alerts": dict(sorted(self.alerts.items())),
            "traffic": None if self.traffic is None else asdict(self.traffic),
        }

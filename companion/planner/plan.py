"""The answer of the planner as a value: legs, cost, bound, status and why."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.words import counted


class PlanStatus(enum.Enum):
    """How planning ended; ``Plan.reason`` says more."""

    OPTIMAL = "optimal"  # found, and within 0.1 % of a proved lower bound
    FOUND = "found"  # found; the search ended before the bound was met
    INFEASIBLE = "infeasible"  # proved: no path exists
    NOT_FOUND = "not found"  # searched to its end, or what was found may not be sailed: no proof that there is none
    TIMEOUT = "timeout"  # the effort ended first, without a path and without a proof
    INVALID = "invalid"  # the problem cannot be planned at all
    UNANSWERED = "unanswered"  # the planner died, hung or failed: nothing is known of the problem

    @property
    def has_path(self) -> bool:
        """Whether there is something to sail."""
        return self in {PlanStatus.OPTIMAL, PlanStatus.FOUND}


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """One straight leg.

    ``heading_rad`` is through the water, [0, 2π); ``twa_rad`` is [-π, π], starboard positive; ``turn_rad`` the
    heading change into the leg. ``start_s``..``end_s`` is the sailing itself, after the turn. ``sigma_rad`` and
    ``no_go_half_rad`` are the worst over that time and what the leg was checked against; ``margin_rad`` is
    |TWA| minus it. ``clearance_m`` is the distance to the nearest obstacle or fence (None: there is none).
    ``risk`` is the probability that the wind forces the leg into the no-go zone at some instant of it, and that the
    boat comes too near to an uncertain vessel (None: not
    computed). ``is_beat``: the autopilot beats it by itself, tacking about the line
    (``companion.planner.problem.evaluate``); ``speed_mps`` is then what it makes good. ``manoeuvre`` is the turn into
    the
    leg: "tack", "gybe", or "" for one that goes through neither the wind's eye nor dead down wind.
    """

    from_en: tuple[float, float]
    to_en: tuple[float, float]
    heading_rad: float
    twa_rad: float
    turn_rad: float
    length_m: float
    speed_mps: float
    start_s: float
    end_s: float
    sigma_rad: float
    no_go_half_rad: float
    risk: float | None = None
    clearance_m: float | None = None
    is_beat: bool = False
    manoeuvre: str = ""

    @property
    def margin_rad(self) -> float:
        """|TWA| minus the no-go half angle [rad]; touching the zone is 0, a beaten leg's line is inside it."""
        return abs(self.twa_rad) - self.no_go_half_rad


@dataclass(frozen=True, slots=True, kw_only=True)
class Why:
    """Why the plan looks as it does: a sentence or more, and the same as data (JSON types only)."""

    text: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """When a plan arrives as wind and boat may be [s]; inf: not within five times its own time.

    Attributes:
        early_s, median_s, late_s: it arrives so early in one case of ten, in half of them, in nine of ten.
        over_max, under_min: the chance of more wind than the boat's limit, and of less, at the worst instant until
            then; None: the boat has no such limit.
        doubts: what is not known of it, in words.

    """

    early_s: float
    median_s: float
    late_s: float
    over_max: float | None = None
    under_min: float | None = None
    doubts: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form; None for what is never."""
        return {
            "p10_s": _finite(self.early_s),
            "p50_s": _finite(self.median_s),
            "p90_s": _finite(self.late_s),
            "over_max": self.over_max,
            "under_min": self.under_min,
            "doubts": list(self.doubts),
        }

    @classmethod
    def from_dict(cls, raw: Mapping[str, Any]) -> Arrival:
        """Return the value of ``to_dict``'s form."""
        early, median, late = (math.inf if raw[key] is None else float(raw[key]) for key in ("p10_s", "p50_s", "p90_s"))
        return cls(
            early_s=early,
            median_s=median,
            late_s=late,
            over_max=raw["over_max"],
            under_min=raw["under_min"],
            doubts=tuple(raw["doubts"]),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """A plan. ``waypoints_en`` is (n, 2), starts at the start, and is empty (0, 2) without a path.

    ``cost_s`` is the time of the path (inf without one), ``lower_bound_s`` a proved bound from below (inf when
    INFEASIBLE). ``expansions`` is the effort spent, ``elapsed_s`` the computing time, ``first_s`` the computing
    time to the first path (None without one). ``risk`` is what is promised of the whole path, wind, vessels and tacks
    that fail added; ``vessel_risk`` is the vessels' part of it (0 where none is uncertain), ``tack_risk`` that of
    tacks. ``expected_clearance_m`` is the least distance from what is solid that is expected of the hull on the
    predicted track, that prediction's error taken off, and ``expected_at_en`` where (None: the problem says nothing of
    the track, or nothing is solid). ``arrival`` has the quantiles of its time (None: the problem says nothing of the
    wind's strength). ``unproven`` is what there was no time for: "search" (it was handed out while better paths were
    looked for), "bound" (no lower bound was proved); everything else that it says holds as of any plan. ``speed`` is
    what the search had of the reference core (``companion.planner.worker``), None: it was not measured.
    """

    status: PlanStatus
    reason: str
    waypoints_en: NDArray[np.float64]
    legs: tuple[Leg, ...] = ()
    cost_s: float = math.inf
    lower_bound_s: float = 0.0
    algorithm: str = "auto"
    seed: int = 0
    expansions: int = 0
    elapsed_s: float = 0.0
    first_s: float | None = None
    risk: float | None = None
    vessel_risk: float = 0.0
    tack_risk: float = 0.0
    expected_clearance_m: float | None = None
    expected_at_en: tuple[float, float] | None = None
    arrival: Arrival | None = None
    unproven: tuple[str, ...] = ()
    speed: float | None = None
    why: Why = Why()
    trace: Mapping[str, Any] = field(default_factory=dict)

    @property
    def has_path(self) -> bool:
        """Whether there is something to sail."""
        return self.status.has_path

    @property
    def gap(self) -> float:
        """(cost - bound) / bound, at least 0; inf when there is no path or no bound."""
        if not self.has_path or not self.lower_bound_s > 0.0:
            return 0.0 if self.has_path and self.cost_s <= self.lower_bound_s else math.inf
        return max(0.0, self.cost_s / self.lower_bound_s - 1.0)

    def __str__(self) -> str:
        """Return it as a line: what it is, how long it takes, the best that there may be, its risk."""
        if not self.has_path:
            return f"{self.status.value}: {self.reason}"
        length_m = sum(leg.length_m for leg in self.legs)
        risk = "" if self.risk is None else f", {100.0 * self.risk:.1f} % off the plan"
        return (
            f"{self.status.value}: {counted(len(self.legs), 'leg')}, {length_m:.0f} m, {self.cost_s:.0f} s "
            f"(at least {self.lower_bound_s:.0f} s){risk}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form: degrees, metres, seconds; None for what is not finite."""
        return {
            "status": self.status.value,
            "reason": self.reason,
            "waypoints": [[float(x), float(y)] for x, y in self.waypoints_en],
            "cost_s": _finite(self.cost_s),
            "lower_bound_s": _finite(self.lower_bound_s),
            "gap": _finite(self.gap),
            "algorithm": self.algorithm,
            "seed": self.seed,
            "expansions": self.expansions,
            "elapsed_s": self.elapsed_s,
            "first_s": self.first_s,
            "risk": self.risk,
            "vessel_risk": self.vessel_risk,
            **({"tack_risk": self.tack_risk} if self.tack_risk else {}),
            **({} if self.arrival is None else {"arrival": self.arrival.to_dict()}),
            **({"unproven": list(self.unproven)} if self.unproven else {}),
            **({} if self.speed is None else {"speed": self.speed}),
            **(
                {}
                if self.expected_clearance_m is None
                else {
                    "expected_clearance_m": self.expected_clearance_m,
                    "expected_at": None if self.expected_at_en is None else list(self.expected_at_en),
                }
            ),
            "legs": [_leg_dict(leg) for leg in self.legs],
            "why": {"text": self.why.text, "data": dict(self.why.data)},
        }

    @classmethod
    def from_dict(cls, raw: Mapping[str, Any]) -> Plan:
        """Return the plan of ``to_dict``'s form (the trace is not kept)."""
        status = PlanStatus(raw["status"])
        none = math.inf if not status.has_path else 0.0
        bound = raw["lower_bound_s"]
        return cls(
            status=status,
            reason=raw["reason"],
            waypoints_en=np.asarray(raw["waypoints"], dtype=np.float64).reshape(-1, 2),
            legs=tuple(_leg(leg) for leg in raw["legs"]),
            cost_s=none if raw["cost_s"] is None else float(raw["cost_s"]),
            lower_bound_s=math.inf if bound is None else float(bound),
            algorithm=raw["algorithm"],
            seed=int(raw["seed"]),
            expansions=int(raw["expansions"]),
            elapsed_s=float(raw["elapsed_s"]),
            first_s=raw["first_s"],
            risk=raw["risk"],
            vessel_risk=float(raw.get("vessel_risk", 0.0)),
            tack_risk=float(raw.get("tack_risk", 0.0)),
            arrival=None if raw.get("arrival") is None else Arrival.from_dict(raw["arrival"]),
            unproven=tuple(raw.get("unproven", ())),
            speed=raw.get("speed"),
            expected_clearance_m=raw.get("expected_clearance_m"),
            expected_at_en=None if raw.get("expected_at") is None else (raw["expected_at"][0], raw["expected_at"][1]),
            why=Why(text=raw["why"]["text"], data=raw["why"]["data"]),
        )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _leg_dict(leg: Leg) -> dict[str, Any]:
    return {
        "from": list(leg.from_en),
        "to": list(leg.to_en),
        "heading_deg": math.degrees(leg.heading_rad),
        "twa_deg": math.degrees(leg.twa_rad),
        "turn_deg": math.degrees(leg.turn_rad),
        "length_m": leg.length_m,
        "speed_mps": leg.speed_mps,
        "start_s": leg.start_s,
        "end_s": leg.end_s,
        "sigma_deg": math.degrees(leg.sigma_rad),
        "no_go_half_deg": math.degrees(leg.no_go_half_rad),
        "risk": leg.risk,
        "clearance_m": leg.clearance_m,
        **({"is_beat": True} if leg.is_beat else {}),
        "manoeuvre": leg.manoeuvre,
    }


def _leg(raw: Mapping[str, Any]) -> Leg:
    return Leg(
        from_en=(raw["from"][0], raw["from"][1]),
        to_en=(raw["to"][0], raw["to"][1]),
        heading_rad=math.radians(raw["heading_deg"]),
        twa_rad=math.radians(raw["twa_deg"]),
        turn_rad=math.radians(raw["turn_deg"]),
        length_m=raw["length_m"],
        speed_mps=raw["speed_mps"],
        start_s=raw["start_s"],
        end_s=raw["end_s"],
        sigma_rad=math.radians(raw["sigma_deg"]),
        no_go_half_rad=math.radians(raw["no_go_half_deg"]),
        risk=raw["risk"],
        clearance_m=raw["clearance_m"],
        is_beat=bool(raw.get("is_beat", False)),
        manoeuvre=str(raw.get("manoeuvre", "")),
    )

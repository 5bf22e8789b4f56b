"""What was promised and what came of it: the wind on each leg, the floor, the time of arrival.

A leg's promise is the probability that the true wind puts its heading into the no-go zone, from the spread and the
angle that it was planned with; what came of it is looked at once, half way along the leg. Both are of the bow through
the water and of the wind over it: what the sails feel. Where there is a current or leeway the bow is the one that
keeps her on the leg in them.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from companion.current import over_water
from companion.geo.angles import wrap_pi
from companion.geo.frame import LocalFrame
from companion.messages import Mode
from companion.telemetry.folder import DECISIONS
from sitl.autopilot import Autopilot, MemoryLink

# A plan's waypoint and the autopilot's are one where they are this near: degrees x 1e7 are a centimetre.
_SAME_M = 0.5
# What a plan says of its arrival, and the probability of being there by then.
QUANTILES = {"p10_s": 0.1, "p50_s": 0.5, "p90_s": 0.9}
_SHORT_M = 10.0       # a leg that is shorter is the middle of a turn
_SLOW_MPS = 0.3       # slower than this she goes nowhere that could be kept to


@dataclass(frozen=True, slots=True, kw_only=True)
class Sailed:
    """A leg as it was sailed: when its middle was passed, its end, the bow that keeps to it, the wind over water."""

    t_s: float
    end_en_m: tuple[float, float]
    bow_rad: float
    twd_from_rad: float


@dataclass(slots=True)
class Legs:
    """Watches which legs a boat sails; an ``Observer`` of a run."""

    frame: LocalFrame
    sailed: list[Sailed] = field(default_factory=list)
    _last: tuple[tuple[float, float], tuple[float, float]] | None = None

    def truth(self, t_s: float, autopilot: Autopilot, link: MemoryLink) -> None:
        """Look at the autopilot."""
        del link
        truth = autopilot.truth
        if not truth.is_armed or truth.mode is not Mode.AUTO:
            return
        begin, end = autopilot.core.vehicle.leg
        length_m = math.dist(begin, end)
        if (begin, end) == self._last or length_m < _SHORT_M:
            return
        here = truth.east_m, truth.north_m
        along_m = sum((h - b) * (e - b) for h, b, e in zip(here, begin, end, strict=True)) / length_m
        if along_m < 0.5 * length_m:
            return
        self._last = begin, end
        current = autopilot.core.vehicle.current_en_mps
        through = truth.velocity_en_mps[0] - current[0], truth.velocity_en_mps[1] - current[1]
        self.sailed.append(Sailed(
            t_s=t_s, end_en_m=self.frame.en_from_geo(autopilot.core.chart.point(end)),
            bow_rad=bow_rad(math.atan2(end[0] - begin[0], end[1] - begin[1]), current, through, truth.heading_rad),
            twd_from_rad=over_water(truth.twd_from_rad, truth.tws_mps, current)[0]))

    def life(self, start_s: float, end_s: float) -> None:
        """Take one life of the companion: none is taken from her here."""


def bow_rad(
    course_rad: float, current_en_mps: tuple[float, float], through_en_mps: tuple[float, float], heading_rad: float,
) -> float:
    """Return the heading that makes a course over the ground good.

    ``through_en_mps`` is how she goes through the water while her bow is at ``heading_rad``: her speed, her leeway.

    >>> round(math.degrees(bow_rad(0.0, (1.0, 0.0), (0.0, 2.0), 0.0)))     # set to the east, she holds up to the west
    -30
    """
    speed_mps = math.hypot(*through_en_mps)
    if speed_mps < _SLOW_MPS:
        return course_rad
    abeam_mps = current_en_mps[0] * math.cos(course_rad) - current_en_mps[1] * math.sin(course_rad)
    slip_rad = wrap_pi(math.atan2(*through_en_mps) - heading_rad)
    return wrap_pi(course_rad - math.asin(max(-1.0, min(1.0, abeam_mps / speed_mps))) - slip_rad)


def chance_of_no_go(twa_rad: float, sigma_rad: float, half_rad: float) -> float:
    """Return the probability that a heading at ``twa_rad`` to the mean wind is within ``half_rad`` of the true one.

    >>> round(chance_of_no_go(math.pi / 4, 0.1, math.pi / 4), 3)
    0.5
    """
    scale = max(sigma_rad, 1e-6) * math.sqrt(2.0)
    off = abs(twa_rad)
    return 0.5 * (math.erf((half_rad - off) / scale) - math.erf((-half_rad - off) / scale))


def legs_promised(folder: Path, sailed: list[Sailed], half_rad: float) -> list[dict[str, Any]]:
    """Return of each sailed leg that a plan of the record holds: its promise, what came, whose its tacks were.

    ``off_deg`` is how far the wind's angle to her bow was from the planned one, positive to starboard; ``sigma_deg``
    how far it was expected to be.
    """
    plans = [(d["t_s"], d["plan"]["legs"]) for d in decisions(folder) if d["kind"] == "plan" and d.get("plan")]
    found = []
    for leg in sailed:
        planned = next((p for t_s, legs in reversed(plans) if t_s <= leg.t_s for p in legs
                        if math.dist(p["to"], leg.end_en_m) <= _SAME_M), None)
        if planned is None:
            continue
        twa_rad, sigma_rad = math.radians(planned["twa_deg"]), math.radians(planned["sigma_deg"])
        came_rad = wrap_pi(leg.twd_from_rad - leg.bow_rad)
        found.append({
            "promised": round(chance_of_no_go(twa_rad, sigma_rad, half_rad), 5), "came": abs(came_rad) < half_rad,
            "sigma_deg": round(planned["sigma_deg"], 2), "off_deg": round(math.degrees(wrap_pi(came_rad - twa_rad)), 2),
            "is_beat": bool(planned.get("is_beat"))})
    return found


def promised_s(folder: Path) -> float | None:
    """Return the time that the first plan promised; None without one."""
    first = _first_plan(folder)
    return None if first is None else float(first["cost_s"])


def arrival_promised(folder: Path) -> dict[str, float | None] | None:
    """Return when the first plan arrives by its quantiles' names (None: in no time); None: it does not say."""
    first = _first_plan(folder)
    arrival = None if first is None else first.get("arrival")
    return None if arrival is None else {name: arrival[name] for name in QUANTILES}


def _first_plan(folder: Path) -> dict[str, Any] | None:
    return next((d["plan"] for d in decisions(folder) if d["kind"] == "plan" and d.get("plan")
                 and d["plan"].get("cost_s") is not None), None)


def decisions(folder: Path) -> list[dict[str, Any]]:
    """Return the record of a voyage's decisions; what a line cut short held is left out."""
    try:
        lines = (folder / DECISIONS).read_text(encoding="utf-8").splitlines(keepends=True)
    except OSError:
        return []
    return [json.loads(line) for line in lines if line.endswith("\n")]

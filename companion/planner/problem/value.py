"""The planning problem as a value: where from, where to, what is in the way, which wind, which boat.

The JSON format (metres, degrees) and its extensions are in docs/reference/problem-format.md. Inside, angles are radians
and geometry is shapely's, in local east-north metres. ``Problem.from_json`` raises ``InputError`` for what cannot be
read; what can be read but not planned (zero wind, NaN, delta_s out of range, a start inside an obstacle) is found
by ``defect_of`` and becomes ``PlanStatus.INVALID``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.boat.boat import SHAPE_TWA_RAD
from companion.geo.angles import wrap_pi
from companion.messages import Spread, Target
from companion.planner.problem.json_read import read_fields
from companion.planner.problem.parts import (
    FENCE,
    LEAST_MPS,
    NO_CURRENT,
    TOUCH_M,
    AutopilotBeatZone,
    Beat,
    BoatLimits,
    Current,
    ProblemWind,
    RiskLimit,
    Sigma,
    interpolated,
)

if TYPE_CHECKING:
    from companion.planner.problem.tracking import Tracking

BEAT_CLEAR_SHARE = 0.98
"""Of a beaten leg's clearance that is checked: the arcs of a grown obstacle are polygons inside the circle."""
VESSELS_SHARE = 0.1
"""Of 1 - delta_s, given to vessels where the problem does not say: a zone a few percent wider costs less than discs."""
LEG_SAVING = 1e-5
Check: TypeAlias = tuple[bool, str]  # whether it holds, and what is wrong where it does not


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """One planning problem (see the module's text). Times count from the start of the plan, t = 0.

    ``vessels_part`` is what uncertain targets get of 1 - delta_s, at each instant and together; None: a tenth of it.
    ``tracking`` says how the plan will be sailed, and what that track keeps clear of; without it the legs alone count.
    ``adrift`` is a current that is believed and not sure enough to be planned with: it carries a boat whose tack fails.
    ``leg_saving`` is what a leg must save, as a share of the path's time, for ``auto`` to keep it.
    ``known_en`` is a way that was found before, from about the start on: ``auto`` begins from it, too.
    """

    id: str = ""
    title: str = ""
    start_en: tuple[float, float]
    start_heading_rad: float
    goal_en: tuple[float, float]
    goal_radius_m: float
    obstacles: tuple[shapely.Geometry, ...] = ()
    obstacle_names: tuple[str, ...] = ()
    fence: shapely.Geometry | None = None
    fence_name: str = FENCE
    wind: ProblemWind
    boat: BoatLimits
    delta_s: float = 0.5
    current: Current = NO_CURRENT
    adrift: Current = NO_CURRENT
    zone: AutopilotBeatZone | None = None
    targets: tuple[Target, ...] = ()
    vessels_part: float | None = None
    risk: RiskLimit | None = None
    clearance_floor_m: float = 0.0
    leg_saving: float = LEG_SAVING
    beat: Beat | None = None
    tracking: Tracking | None = None
    known_en: tuple[tuple[float, float], ...] = ()
    notes: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def from_json(cls, source: str | Path | Mapping[str, Any]) -> Problem:
        """Return the problem in a JSON file or an already parsed mapping.

        Raises:
            InputError: the file cannot be read, a field is missing or not of its type, a WKT does not parse.

        """
        return cls(**read_fields(source))

    def obstacle_name(self, index: int) -> str:
        """Return what an obstacle is called: by its name, else by its number from 1."""
        names = self.obstacle_names[index : index + 1]
        return names[0] if names and names[0] else f"obstacle {index + 1}"

    # ----------------------------------------------------------------------------------------- no-go
    @property
    def is_shared(self) -> bool:
        """Do uncertain targets share the promise with the wind?"""
        return any(t.spread is not None for t in self.targets)

    @property
    def vessels_share(self) -> float:
        """What uncertain targets get of 1 - delta_s; 0 without any."""
        if not self.is_shared:
            return 0.0
        return VESSELS_SHARE * (1.0 - self.delta_s) if self.vessels_part is None else self.vessels_part

    @cached_property
    def wind_delta_s(self) -> float:
        """The wind's own delta_s: 1 - delta_s less the part of uncertain targets; delta_s without them."""
        return self.delta_s + self.vessels_share

    @cached_property
    def k_delta(self) -> float:
        """Multiplier of sigma, sqrt(2) erfinv(2 delta_s - 1) >= 0 (Wolsieffer eq. 15 with its sign put right)."""
        # sqrt(2) erfinv(2 p - 1) is the standard normal quantile of p
        return NormalDist().inv_cdf(self.wind_delta_s) if 0.5 <= self.wind_delta_s < 1.0 else math.nan

    def widening_rad(self, t_s: float) -> float:
        """Return b(t): how much the no-go half angle is widened at ``t_s`` [rad]."""
        sigma = self.wind.sigma
        if sigma.model == "forecast" and sigma.half_width_rad is not None:
            return interpolated(t_s, sigma.horizon_s, sigma.half_width_rad)
        return self.k_delta * sigma.at(t_s)

    def no_go_half_rad(self, t_s: float) -> float:
        """Return the tightened no-go half angle at ``t_s`` [rad]."""
        return self.boat.no_go_half_rad + self.widening_rad(t_s)

    @cached_property
    def no_go_min_rad(self) -> float:
        """Infimum of the no-go half angle over all t >= 0 [rad]."""
        return self.boat.no_go_half_rad + min(self._widening_extremes())

    @cached_property
    def no_go_max_rad(self) -> float:
        """Supremum of the no-go half angle over all t >= 0 [rad]; may be infinite."""
        return self.boat.no_go_half_rad + max(self._widening_extremes())

    def _widening_extremes(self) -> tuple[float, ...]:
        sigma = self.wind.sigma
        if sigma.model == "kalman":
            grows = sigma.growth_rad_per_sqrt_s > 0.0 and self.k_delta > 0.0
            return (self.widening_rad(0.0), math.inf if grows else self.widening_rad(0.0))
        if sigma.model == "ar1":
            late = sigma.sigma_inf_rad if sigma.rho_hz > 0.0 else sigma.sigma0_rad
            return (self.k_delta * sigma.sigma0_rad, self.k_delta * late)
        if sigma.model == "forecast":
            return tuple(self.widening_rad(t) for t in sigma.horizon_s)
        return (0.0,)

    @property
    def ground_turn_rad(self) -> float:
        """By how much the wind over the ground comes from further to the right than that over the water [rad]."""
        return 0.0 if self.zone is None else float(wrap_pi(self.zone.from_rad - self.wind.twd_from_rad))

    @property
    def is_time_varying(self) -> bool:
        """Whether the no-go zone changes with time."""
        extremes = self._widening_extremes()
        return max(extremes) > min(extremes)

    # -------------------------------------------------------------------------------------- geometry
    @cached_property
    def obstacle_union(self) -> shapely.Geometry:
        """All obstacles as one repaired geometry, grown by the clearance floor."""
        parts = [g if g.is_valid else shapely.make_valid(g) for g in self.obstacles if not g.is_empty]
        union = shapely.union_all(parts) if parts else shapely.Polygon()
        return union.buffer(self.clearance_floor_m) if self.clearance_floor_m > 0.0 and parts else union

    @cached_property
    def fence_polygon(self) -> shapely.Geometry | None:
        """The fence, repaired and shrunk by the clearance floor; None without a fence."""
        if self.fence is None:
            return None
        fence = self.fence if self.fence.is_valid else shapely.make_valid(self.fence)
        return fence.buffer(-self.clearance_floor_m) if self.clearance_floor_m > 0.0 else fence

    @cached_property
    def solid(self) -> shapely.Geometry:
        """Obstacles and everything outside the fence."""
        solid, fence = self.obstacle_union, self.fence_polygon
        if fence is not None:
            # as wide as whatever a path begins and ends at: one that lies wholly outside would meet nothing
            shapes = [shapely.Point(self.start_en), shapely.Point(self.goal_en), fence]
            x0, y0, x1, y1 = shapely.total_bounds([s for s in shapes if not s.is_empty])
            margin = 0.5 * max(x1 - x0, y1 - y0)
            frame = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
            solid = shapely.union(solid, frame.difference(fence))
        return solid

    @cached_property
    def eval_solid(self) -> shapely.Geometry:
        """``solid`` shrunk by the numerical slack and prepared: a leg that intersects it collides."""
        shrunk = self.solid.buffer(-TOUCH_M, join_style="mitre", mitre_limit=5.0)
        shapely.prepare(shrunk)
        return shrunk

    @cached_property
    def beat_solid(self) -> shapely.Geometry:
        """``solid`` grown by what a leg beaten by the autopilot needs, prepared; round corners cut off a little."""
        clear = self.beat.clearance_m if self.beat is not None else 0.0
        grown = self.solid.buffer(BEAT_CLEAR_SHARE * clear - TOUCH_M)
        shapely.prepare(grown)
        return grown


# Why a problem cannot be planned by anybody: numbers that are none, limits that contradict each other.


def _coordinates(p: Problem) -> NDArray[np.float64]:
    shapes = [*p.obstacles, *([] if p.fence is None else [p.fence])]
    return np.asarray(shapely.get_coordinates(shapes), dtype=np.float64) if shapes else np.empty((0, 2))


def defect_of(p: Problem) -> str | None:
    """Return the first thing wrong, or None."""
    defect = _not_finite(p)
    if defect is not None:
        return defect
    checks = (*_checks(p), *_wind_checks(p.wind), *_boat_checks(p.boat))
    return next((text for holds, text in checks if not holds), None)


def _not_finite(p: Problem) -> str | None:
    """Return what is not a finite number, or a coordinate of no local frame, or None."""
    b, w = p.boat, p.wind
    named = {
        "start.x": p.start_en[0],
        "start.y": p.start_en[1],
        "start.heading_deg": p.start_heading_rad,
        "goal.x": p.goal_en[0],
        "goal.y": p.goal_en[1],
        "goal.radius": p.goal_radius_m,
        "wind.from_deg": w.twd_from_rad,
        "wind.speed_mps": 1.0 if w.tws_mps is None else w.tws_mps,
        "boat.no_go_half_deg": b.no_go_half_rad,
        "boat.leeway_deg": b.leeway_rad,
        "boat.max_twa_deg": b.max_twa_rad,
        "boat.turn_rate_rad_s": b.turn_rate_radps,
        "delta_s": p.delta_s,
        "boat.tack_loss_s": b.tack_loss_s,
        "boat.gybe_loss_s": b.gybe_loss_s,
        "boat.gybe_room_m": b.gybe_room_m or 0.0,
        "current": p.current.set_rad + p.current.drift_mps,
        "adrift": p.adrift.set_rad + p.adrift.drift_mps,
        "clearance_floor_m": p.clearance_floor_m,
        "leg_saving": p.leg_saving,
        "known": sum(map(sum, p.known_en)),
        "wind.sigma": sum((*_rates(w.sigma), *w.sigma.horizon_s)),
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
    return None


def _rates(sigma: Sigma) -> tuple[float, ...]:
    """Return the numbers of the wind's spread, none of which is negative."""
    of_time = (*sigma.sigma_rad, *(sigma.half_width_rad or ()))
    return (sigma.sigma0_rad, sigma.growth_rad_per_sqrt_s, sigma.sigma_inf_rad, sigma.rho_hz, *of_time)


def _checks(p: Problem) -> tuple[Check, ...]:
    """Return what must hold of the promise, the water and the vessels."""
    beat, zone, risk = p.beat, p.zone, p.risk
    return (
        (0.5 <= p.delta_s < 1.0, f"delta_s {p.delta_s:g} is outside 0.5 <= delta_s < 1"),
        (p.goal_radius_m >= 0.0, f"the goal radius {p.goal_radius_m:g} m is negative"),
        (min(p.current.drift_mps, p.adrift.drift_mps) >= 0.0, "the current's drift is negative"),
        (p.clearance_floor_m >= 0.0, "the clearance floor is negative"),
        (p.leg_saving >= 0.0, "leg_saving is negative"),
        (
            risk is None or (0.0 < risk.max_path_risk <= 1.0 and risk.correlation_time_s > 0.0),
            "risk needs 0 < max_path_risk <= 1 and correlation_time_s > 0",
        ),
        (p.fence is None or not p.fence.is_empty, "the fence is empty"),
        (p.fence_polygon is None or not p.fence_polygon.is_empty, "the fence less the clearance floor is empty"),
        (
            p.vessels_part is None or 0.0 < p.vessels_part < 1.0 - p.delta_s,
            "allocation.vessels is not between 0 and 1 - delta_s",
        ),
        (
            beat is None
            or (
                0.0 < beat.no_go_half_rad < 0.5 * math.pi
                and 0.0 < beat.corridor_m < math.inf
                and 0.0 <= beat.clearance_m < math.inf
                and 0.0 <= beat.tack_s < math.inf
            ),
            "beat needs 0 < no_go_half_deg < 90, corridor_m > 0, clearance_m >= 0 and tack_s >= 0",
        ),
        (p.tracking is None or p.tracking.is_finite, "tracking has a number that is negative or not finite"),
        (
            beat is None or p.current.drift_mps == 0.0 or zone is not None,
            "a beat left to the autopilot in a current needs its zone",
        ),
        (
            zone is None or (math.isfinite(zone.from_rad) and 0.0 <= zone.half_rad < math.pi),
            "zone needs a finite from_deg and 0 <= half_deg < 180",
        ),
    )


def _wind_checks(w: ProblemWind) -> tuple[Check, ...]:
    return (
        (w.tws_mps is None or w.tws_mps > 0.0, "there is no wind: wind.speed_mps is not above zero"),
        (w.strength is None or w.strength.is_sound, "wind.strength has a number that is negative or not finite"),
        (min(_rates(w.sigma)) >= 0.0, "a sigma, growth or rate of the wind is negative"),
    )


def _boat_checks(b: BoatLimits) -> tuple[Check, ...]:
    limits = least, most = b.min_tws_mps, b.max_tws_mps
    return (
        (b.turn_rate_radps > 0.0, "the turn rate is not above zero"),
        (b.no_go_half_rad >= 0.0, "the no-go half angle is negative"),
        (b.max_twa_rad > 0.0, "max_twa_deg is not above zero"),
        (min(b.polar_mps) >= 0.0, "the polar has a negative speed"),
        (max(b.polar_mps) > LEAST_MPS, "the polar is zero everywhere: the boat cannot move"),
        (b.tack_loss_s >= 0.0 and b.gybe_loss_s >= 0.0, "a tack or gybe loss is negative"),
        ((b.gybe_room_m or 0.0) >= 0.0, "gybe_room_m is negative"),
        (0.0 <= b.tack_fails < 1.0, f"tack_fails {b.tack_fails:g} is outside 0 <= tack_fails < 1"),
        (0.0 <= b.speed_error <= 1.0, f"speed_error {b.speed_error:g} is outside 0 to 1"),
        (0.1 <= b.speed_share <= 10.0, f"speed_share {b.speed_share:g} is outside 0.1 to 10"),
        (
            len(b.shape_error) in {0, len(SHAPE_TWA_RAD)} and all(0.0 <= e <= 1.0 for e in b.shape_error),
            f"shape_error is not {len(SHAPE_TWA_RAD)} numbers from 0 to 1, every 30 degrees from 0 to 180",
        ),
        (0.0 <= b.irons_s < math.inf, "irons_s is no time of 0 s or more"),
        (
            len(b.lee_mps) == 2 and all(0.0 <= lee < math.inf for lee in b.lee_mps),
            "lee_mps is not two speeds, each 0 or more",
        ),
        (all(limit is None or 0.0 < limit < math.inf for limit in limits), "a limit of wind is not above zero"),
        (least is None or most is None or least < most, "min_tws_mps is not below max_tws_mps"),
        (b.speeds is None or b.speeds.is_sound, "boat.speeds has a number that is negative or not finite"),
    )


# One promise for the wind and for uncertain vessels: the share of each, and the vessels' discs.
#
# A ``Target`` with a ``spread`` is the prediction of a vessel, not a region: how far to keep away follows from what is
# promised. One promise, 1 - delta_s at each instant, covers the wind and the vessels, by the union bound (Boole):
#
#     1 - delta_s = (1 - wind_delta_s) + vessels_part
#
# with ``vessels_part`` split evenly over the vessels in force (Luders, Kothari and How 2010 split theirs evenly over
# obstacles). The wind's part widens the no-go zone (Wolsieffer 2020, eq. 15), a vessel's part r makes its disc hulls,
# clearance and Phi^-1(1 - r) sigma wide: a boat outside it is met with probability r at most (``tail_factor``). Without
# uncertain targets all of it is the wind's, as the problem's format has it.

LEAST_PART = 1e-12


def uncertain(targets: Sequence[Target]) -> tuple[tuple[Target, Spread], ...]:
    """Return the targets that are predictions, with their spreads."""
    return tuple((t, t.spread) for t in targets if t.spread is not None)


def vessel_count(targets: Sequence[Target]) -> int:
    """Return how many uncertain vessels are in force."""
    return len({spread.vessel for _, spread in uncertain(targets)})


def sigmas_for(part: float, vessels: int) -> float:
    """Return how many standard deviations a disc is wide when ``vessels`` share ``part``; 0 without vessels."""
    if vessels == 0:
        return 0.0
    from companion.traffic.predict import tail_factor

    return tail_factor(min(0.5, max(part / vessels, LEAST_PART)))


def sized(targets: Sequence[Target], sigmas: float) -> tuple[Target, ...]:
    """Return the targets as regions: the uncertain ones with ``sigmas`` standard deviations added to their radius."""
    return tuple(
        t
        if t.spread is None
        else replace(
            t,
            radius_m=t.radius_m + sigmas * t.spread.sigma_m,
            growth_mps=t.growth_mps + sigmas * t.spread.sigma_mps,
            spread=None,
        )
        for t in targets
    )


@lru_cache(maxsize=16)  # a search asks again and again; problems are the same by identity
def resolved(problem: Problem) -> Problem:
    """Return the same with its promise shared out: the wind's delta_s, and uncertain targets as discs of their size."""
    if not problem.is_shared:
        return problem
    sigmas = sigmas_for(problem.vessels_share, vessel_count(problem.targets))
    return replace(problem, delta_s=problem.wind_delta_s, targets=sized(problem.targets, sigmas), vessels_part=None)

"""The planning problem as a value: where from, where to, what is in the way, which wind, which boat.

The JSON format (metres, degrees) and its extensions are in docs/problem-format.md. Inside, angles are radians and
geometry is shapely's, in local east-north metres. ``Problem.from_json`` raises ``InputError`` for what cannot be
read; what can be read but not planned (zero wind, NaN, delta_s out of range, a start inside an obstacle) is found
by ``Problem.defect`` and becomes ``PlanStatus.INVALID``.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from companion.errors import InputError

if TYPE_CHECKING:
    from companion.planner.evaluate import Evaluation

T = TypeVar("T")

TOUCH_M = 1e-3
"""A path may be this deep in an obstacle [m]: numerical slack for touching."""
NO_GO_SLACK_RAD = math.radians(0.01)
"""A leg may be this far inside the no-go zone [rad]: numerical slack."""

SIGMA_MODELS = ("none", "kalman", "ar1", "forecast")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sigma:
    """How uncertain the wind direction is, t seconds from now.

    ``none``: 0. ``kalman``: s² = sigma0² + growth² t. ``ar1``: s² = sigma_inf² + (sigma0² - sigma_inf²) e^(-2 rho t).
    ``forecast``: a table over ``horizon_s``, linear between and flat beyond; where ``half_width_rad`` is given it
    is the widening of the no-go zone itself (the half width of the central interval that the direction keeps with
    probability 2 delta_s - 1) and k sigma is not used.
    """

    model: str = "none"
    sigma0_rad: float = 0.0
    growth_rad_per_sqrt_s: float = 0.0
    sigma_inf_rad: float = 0.0
    rho_hz: float = 0.0
    horizon_s: tuple[float, ...] = ()
    sigma_rad: tuple[float, ...] = ()
    half_width_rad: tuple[float, ...] | None = None

    def at(self, t_s: float) -> float:
        """Return sigma [rad] at ``t_s`` >= 0 from now."""
        if self.model == "kalman":
            return math.sqrt(self.sigma0_rad**2 + self.growth_rad_per_sqrt_s**2 * t_s)
        if self.model == "ar1":
            v0, vi = self.sigma0_rad**2, self.sigma_inf_rad**2
            return math.sqrt(vi + (v0 - vi) * math.exp(-2.0 * self.rho_hz * t_s))
        if self.model == "forecast":
            return float(np.interp(t_s, self.horizon_s, self.sigma_rad))
        return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """The wind: from where [rad, true], how fast [m/s or None], how sure. A polar is already at this speed."""

    twd_from_rad: float
    tws_mps: float | None = None
    sigma: Sigma = Sigma()


@dataclass(frozen=True, slots=True, kw_only=True)
class BoatLimits:
    """What the boat can do: no-go half angle, deepest angle, turn rate, speed by |TWA| (linear between nodes)."""

    no_go_half_rad: float
    max_twa_rad: float = math.pi
    turn_rate_radps: float
    polar_twa_rad: tuple[float, ...]
    polar_mps: tuple[float, ...]
    tack_loss_s: float = 0.0
    gybe_loss_s: float = 0.0

    def speed_mps(self, twa_rad: float) -> float:
        """Return the speed [m/s] at the true wind angle."""
        return float(np.interp(abs(twa_rad), self.polar_twa_rad, self.polar_mps))


@dataclass(frozen=True, slots=True, kw_only=True)
class Current:
    """A constant current over the ground, towards ``set_rad`` at ``drift_mps``.

    The wind is then the wind on the water, headings are through the water and legs are over the ground.
    """

    set_rad: float = 0.0
    drift_mps: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A moving disc to keep out of: at (x + vx t, y + vy t), radius ``radius_m + growth_mps t``, in its window."""

    x_m: float
    y_m: float
    vx_mps: float = 0.0
    vy_mps: float = 0.0
    radius_m: float
    growth_mps: float = 0.0
    from_s: float = 0.0
    until_s: float = math.inf
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RiskLimit:
    """Bound on the accumulated risk of the whole path, and the wind's correlation time it assumes."""

    max_path_risk: float
    correlation_time_s: float = 60.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """One planning problem (see the module's text). Times count from the start of the plan, t = 0."""

    id: str = ""
    title: str = ""
    start_en: tuple[float, float]
    start_heading_rad: float
    goal_en: tuple[float, float]
    goal_radius_m: float
    obstacles: tuple[shapely.Geometry, ...] = ()
    fence: shapely.Geometry | None = None
    wind: Wind
    boat: BoatLimits
    delta_s: float = 0.5
    current: Current = Current()
    targets: tuple[Target, ...] = ()
    risk: RiskLimit | None = None
    clearance_floor_m: float = 0.0
    notes: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)

    # ------------------------------------------------------------------------------------- in and out
    @classmethod
    def from_json(cls, source: str | Path | Mapping[str, Any]) -> Problem:
        """Return the problem in a JSON file or an already parsed mapping.

        Raises:
            InputError: the file cannot be read, a field is missing or not of its type, a WKT does not parse.

        """
        if isinstance(source, Mapping):
            return _parse(source, str(source.get("id", "problem")))
        path = Path(source)
        try:
            raw = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(str(path), "", f"cannot be read ({error.strerror})", "name a problem file") from error
        except ValueError as error:
            raise InputError(str(path), "", f"is not JSON ({error})", "see docs/problem-format.md") from error
        if not isinstance(raw, Mapping):
            raise InputError(str(path), "", "is not a JSON object", "see docs/problem-format.md")
        return _parse(raw, str(path))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form; ``from_json`` of it is the same problem."""
        return _unparse(self)

    # ----------------------------------------------------------------------------------------- no-go
    @cached_property
    def k_delta(self) -> float:
        """Multiplier of sigma, sqrt(2) erfinv(2 delta_s - 1) >= 0 (Wolsieffer eq. 15 with its sign put right)."""
        # sqrt(2) erfinv(2 p - 1) is the standard normal quantile of p
        return NormalDist().inv_cdf(self.delta_s) if 0.5 <= self.delta_s < 1.0 else math.nan

    def widening_rad(self, t_s: float) -> float:
        """Return b(t): how much the no-go half angle is widened at ``t_s`` [rad]."""
        sigma = self.wind.sigma
        if sigma.model == "forecast" and sigma.half_width_rad is not None:
            return float(np.interp(t_s, sigma.horizon_s, sigma.half_width_rad))
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
    def is_time_varying(self) -> bool:
        """Does the no-go zone change with time?"""
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
            x0, y0, x1, y1 = fence.bounds if not fence.is_empty else (0.0, 0.0, 0.0, 0.0)
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

    # ---------------------------------------------------------------------------------------- judging
    @cached_property
    def defect(self) -> str | None:
        """Why nobody can plan this (numbers only, geometry is checked by the search), or None."""
        return _defect(self)

    def evaluate(self, waypoints_en: ArrayLike) -> Evaluation:
        """Return cost, legs and every reason why the path (n, 2) is not feasible: the exact scorer."""
        from companion.planner.evaluate import evaluate

        return evaluate(self, np.asarray(waypoints_en, dtype=np.float64))


# ---------------------------------------------------------------------------------------------- reading
class _Reader:
    """Typed access to one JSON object that names the place of what is wrong."""

    def __init__(self, raw: Any, source: str, place: str) -> None:
        self.source, self.place = source, place
        if not isinstance(raw, Mapping):
            raise InputError(source, place, "is not a JSON object", "see docs/problem-format.md")
        self.raw = raw

    def _get(self, key: str, default: Any, convert: Callable[[Any], T]) -> T:
        where = f"{self.place}.{key}" if self.place else key
        if key not in self.raw:
            if default is not ...:
                return default  # type: ignore[no-any-return]
            raise InputError(self.source, where, "is missing", "see docs/problem-format.md")
        try:
            return convert(self.raw[key])
        except (TypeError, ValueError) as error:
            text = repr(self.raw[key])
            text = text if len(text) < 60 else text[:57] + "..."
            raise InputError(self.source, where, f"{text} is not what belongs here ({error})",
                             "see docs/problem-format.md") from error

    def number(self, key: str, default: Any = ...) -> float:
        """Return a float (may be NaN: that is for ``defect`` to say)."""
        return self._get(key, default, _as_float)

    def numbers(self, key: str, default: Any = ...) -> tuple[float, ...]:
        """Return a list of floats."""
        return self._get(key, default, lambda v: tuple(_as_float(x) for x in _as_list(v)))

    def text(self, key: str, default: Any = ...) -> str:
        """Return a string."""
        return self._get(key, default, str)

    def child(self, key: str) -> _Reader:
        """Return the object under ``key``."""
        where = f"{self.place}.{key}" if self.place else key
        if key not in self.raw:
            raise InputError(self.source, where, "is missing", "see docs/problem-format.md")
        return _Reader(self.raw[key], self.source, where)


def _as_float(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("a number is needed")
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _as_list(value: Any) -> Sequence[Any]:
    if not isinstance(value, (list, tuple)):
        raise TypeError("a list is needed")
    return value


def _polygon(text: Any, source: str, place: str) -> shapely.Geometry:
    if isinstance(text, shapely.Geometry):
        geometry = text
    else:
        if not isinstance(text, str):
            raise InputError(source, place, "is not WKT text", "write POLYGON ((x y, ...))")
        try:
            geometry = shapely.from_wkt(text)
        except shapely.errors.ShapelyError as error:
            first = str(error).splitlines()[0] if str(error) else "unreadable"
            raise InputError(source, place, f"is not WKT ({first})", "write POLYGON ((x y, ...))") from error
    if geometry.geom_type not in {"Polygon", "MultiPolygon"}:
        raise InputError(source, place, f"is a {geometry.geom_type}, not a POLYGON", "close the area")
    return geometry


def _parse(raw: Mapping[str, Any], source: str) -> Problem:
    top = _Reader(raw, source, "")
    start, goal, wind, boat = (top.child(k) for k in ("start", "goal", "wind", "boat"))
    obstacles = raw.get("obstacles") or []
    if not isinstance(obstacles, (list, tuple)):
        raise InputError(source, "obstacles", "is not a list", "write a list of WKT polygons")
    fence = raw.get("fence")
    current = _Reader(raw.get("current") or {}, source, "current")
    targets = raw.get("targets") or []
    if not isinstance(targets, (list, tuple)):
        raise InputError(source, "targets", "is not a list", "write a list of objects")
    twa, mps = _parse_speed(boat.child("speed"))
    known = {"id", "title", "start", "goal", "obstacles", "fence", "wind", "boat", "delta_s", "notes", "current",
             "targets", "risk", "clearance_floor_m"}
    return Problem(
        id=top.text("id", ""),
        title=top.text("title", ""),
        notes=top.text("notes", ""),
        start_en=(start.number("x"), start.number("y")),
        start_heading_rad=math.radians(start.number("heading_deg")),
        goal_en=(goal.number("x"), goal.number("y")),
        goal_radius_m=goal.number("radius"),
        obstacles=tuple(_polygon(w, source, f"obstacles[{i}]") for i, w in enumerate(obstacles)),
        fence=None if fence is None else _polygon(fence, source, "fence"),
        wind=Wind(
            twd_from_rad=math.radians(wind.number("from_deg")),
            tws_mps=wind.number("speed_mps", None) if wind.raw.get("speed_mps") is not None else None,
            sigma=_parse_sigma(wind.child("sigma")) if wind.raw.get("sigma") is not None else Sigma(),
        ),
        boat=BoatLimits(
            no_go_half_rad=math.radians(boat.number("no_go_half_deg")),
            max_twa_rad=math.radians(boat.number("max_twa_deg", 180.0)),
            turn_rate_radps=boat.number("turn_rate_rad_s"),
            polar_twa_rad=twa,
            polar_mps=mps,
            tack_loss_s=boat.number("tack_loss_s", 0.0),
            gybe_loss_s=boat.number("gybe_loss_s", 0.0),
        ),
        delta_s=top.number("delta_s"),
        current=Current(set_rad=math.radians(current.number("set_deg", 0.0)),
                        drift_mps=current.number("drift_mps", 0.0)),
        targets=tuple(_parse_target(_Reader(t, source, f"targets[{i}]")) for i, t in enumerate(targets)),
        risk=_parse_risk(_Reader(raw["risk"], source, "risk")) if raw.get("risk") is not None else None,
        clearance_floor_m=top.number("clearance_floor_m", 0.0),
        extra={k: v for k, v in raw.items() if k not in known},
    )


def _parse_speed(speed: _Reader) -> tuple[tuple[float, ...], tuple[float, ...]]:
    model = speed.text("model")
    if model == "constant":
        v_mps = speed.number("v_mps")
        return (0.0, math.pi), (v_mps, v_mps)
    if model != "polar":
        raise InputError(speed.source, f"{speed.place}.model", f"{model!r} is unknown", "write constant or polar")
    twa, mps = speed.numbers("twa_deg"), speed.numbers("v_mps")
    if len(twa) != len(mps) or not twa:
        raise InputError(speed.source, speed.place, "twa_deg and v_mps differ in length or are empty",
                         "give one speed for each angle")
    if any(b < a for a, b in itertools.pairwise(twa)):
        raise InputError(speed.source, f"{speed.place}.twa_deg", "does not increase", "sort the polar by angle")
    return tuple(math.radians(a) for a in twa), mps


def _spread(deg: float) -> float:
    """Return a sigma or growth in radians; what is below any meaning (1e-12) is 0, lest its square underflow."""
    return 0.0 if abs(deg) < 1e-12 else math.radians(deg)


def _parse_sigma(sigma: _Reader) -> Sigma:
    model = sigma.text("model")
    if model == "none":
        return Sigma()
    if model == "kalman":
        return Sigma(model=model, sigma0_rad=_spread(sigma.number("sigma0_deg")),
                     growth_rad_per_sqrt_s=_spread(sigma.number("growth_deg_per_sqrt_s")))
    if model == "ar1":
        return Sigma(model=model, sigma0_rad=_spread(sigma.number("sigma0_deg")),
                     sigma_inf_rad=_spread(sigma.number("sigma_inf_deg")), rho_hz=sigma.number("rho_hz"))
    if model != "forecast":
        raise InputError(sigma.source, f"{sigma.place}.model", f"{model!r} is unknown",
                         "write one of " + ", ".join(SIGMA_MODELS))
    horizon = sigma.numbers("horizon_s")
    degrees = sigma.numbers("sigma_deg")
    half = sigma.numbers("half_width_deg") if sigma.raw.get("half_width_deg") is not None else None
    if not horizon or len(degrees) != len(horizon) or (half is not None and len(half) != len(horizon)):
        raise InputError(sigma.source, sigma.place, "the columns differ in length or are empty",
                         "give one sigma for each horizon")
    if any(not b > a for a, b in itertools.pairwise(horizon)):
        raise InputError(sigma.source, f"{sigma.place}.horizon_s", "does not increase", "sort the table by horizon")
    return Sigma(model=model, horizon_s=horizon, sigma_rad=tuple(map(_spread, degrees)),
                 half_width_rad=None if half is None else tuple(map(_spread, half)))


def _parse_target(target: _Reader) -> Target:
    return Target(
        x_m=target.number("x"), y_m=target.number("y"), vx_mps=target.number("vx", 0.0),
        vy_mps=target.number("vy", 0.0), radius_m=target.number("radius_m"),
        growth_mps=target.number("growth_mps", 0.0), from_s=target.number("from_s", 0.0),
        until_s=target.number("until_s", math.inf), name=target.text("name", ""),
    )


def _parse_risk(risk: _Reader) -> RiskLimit:
    return RiskLimit(max_path_risk=risk.number("max_path_risk"),
                     correlation_time_s=risk.number("correlation_time_s", 60.0))


# ---------------------------------------------------------------------------------------------- writing
def _wkt(geometry: shapely.Geometry) -> str:
    """Return WKT with every digit (shapely's own writer rounds the last): reading it gives the same numbers."""
    if geometry.is_empty:
        return "POLYGON EMPTY"

    def rings(polygon: shapely.Geometry) -> str:
        loops = (polygon.exterior, *polygon.interiors)
        return "(" + ", ".join("(" + ", ".join(f"{x!r} {y!r}" for x, y in shapely.get_coordinates(r).tolist()) + ")"
                               for r in loops) + ")"

    if geometry.geom_type == "Polygon":
        return "POLYGON " + rings(geometry)
    return "MULTIPOLYGON (" + ", ".join(rings(g) for g in geometry.geoms) + ")"


def _unparse(p: Problem) -> dict[str, Any]:
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
        "id": p.id, "title": p.title,
        "start": {"x": p.start_en[0], "y": p.start_en[1], "heading_deg": deg(p.start_heading_rad)},
        "goal": {"x": p.goal_en[0], "y": p.goal_en[1], "radius": p.goal_radius_m},
        "obstacles": [_wkt(g) for g in p.obstacles],
        "fence": None if p.fence is None else _wkt(p.fence),
        "wind": {"from_deg": deg(p.wind.twd_from_rad), "speed_mps": p.wind.tws_mps, "sigma": sigma},
        "boat": {
            "no_go_half_deg": deg(p.boat.no_go_half_rad), "max_twa_deg": deg(p.boat.max_twa_rad),
            "turn_rate_rad_s": p.boat.turn_rate_radps,
            "speed": {"model": "polar", "twa_deg": [deg(a) for a in p.boat.polar_twa_rad],
                      "v_mps": list(p.boat.polar_mps)},
            **({"tack_loss_s": p.boat.tack_loss_s} if p.boat.tack_loss_s else {}),
            **({"gybe_loss_s": p.boat.gybe_loss_s} if p.boat.gybe_loss_s else {}),
        },
        "delta_s": p.delta_s,
    }
    if p.notes:
        out["notes"] = p.notes
    if p.current.drift_mps:
        out["current"] = {"set_deg": deg(p.current.set_rad), "drift_mps": p.current.drift_mps}
    if p.targets:
        out["targets"] = [
            {"x": t.x_m, "y": t.y_m, "vx": t.vx_mps, "vy": t.vy_mps, "radius_m": t.radius_m,
             "growth_mps": t.growth_mps, "from_s": t.from_s, "name": t.name,
             **({"until_s": t.until_s} if math.isfinite(t.until_s) else {})}
            for t in p.targets
        ]
    if p.risk is not None:
        out["risk"] = {"max_path_risk": p.risk.max_path_risk, "correlation_time_s": p.risk.correlation_time_s}
    if p.clearance_floor_m:
        out["clearance_floor_m"] = p.clearance_floor_m
    return out | dict(p.extra)


# ---------------------------------------------------------------------------------------------- judging
def _coordinates(p: Problem) -> NDArray[np.float64]:
    shapes = [*p.obstacles, *([] if p.fence is None else [p.fence])]
    return np.asarray(shapely.get_coordinates(shapes), dtype=np.float64) if shapes else np.empty((0, 2))


def _defect(p: Problem) -> str | None:
    b, w = p.boat, p.wind
    named = {
        "start.x": p.start_en[0], "start.y": p.start_en[1], "start.heading_deg": p.start_heading_rad,
        "goal.x": p.goal_en[0], "goal.y": p.goal_en[1], "goal.radius": p.goal_radius_m,
        "wind.from_deg": w.twd_from_rad, "wind.speed_mps": 1.0 if w.tws_mps is None else w.tws_mps,
        "boat.no_go_half_deg": b.no_go_half_rad, "boat.max_twa_deg": b.max_twa_rad,
        "boat.turn_rate_rad_s": b.turn_rate_radps, "delta_s": p.delta_s, "boat.tack_loss_s": b.tack_loss_s,
        "boat.gybe_loss_s": b.gybe_loss_s, "current": p.current.set_rad + p.current.drift_mps,
        "clearance_floor_m": p.clearance_floor_m,
        "wind.sigma": sum((w.sigma.sigma0_rad, w.sigma.growth_rad_per_sqrt_s, w.sigma.sigma_inf_rad,
                           w.sigma.rho_hz, *w.sigma.horizon_s, *w.sigma.sigma_rad,
                           *(w.sigma.half_width_rad or ()))),
        "boat.speed": sum((*b.polar_twa_rad, *b.polar_mps)),
    }
    for t in p.targets:
        named["targets"] = sum((t.x_m, t.y_m, t.vx_mps, t.vy_mps, t.radius_m, t.growth_mps, t.from_s))
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
        (max(b.polar_mps) > 0.0, "the polar is zero everywhere: the boat cannot move"),
        (b.tack_loss_s >= 0.0 and b.gybe_loss_s >= 0.0, "a tack or gybe loss is negative"),
        (p.current.drift_mps >= 0.0, "the current's drift is negative"),
        (p.clearance_floor_m >= 0.0, "the clearance floor is negative"),
        (min((w.sigma.sigma0_rad, w.sigma.growth_rad_per_sqrt_s, w.sigma.sigma_inf_rad, w.sigma.rho_hz,
              *w.sigma.sigma_rad, *(w.sigma.half_width_rad or ()))) >= 0.0,
         "a sigma, growth or rate of the wind is negative"),
        (p.risk is None or (0.0 < p.risk.max_path_risk <= 1.0 and p.risk.correlation_time_s > 0.0),
         "risk needs 0 < max_path_risk <= 1 and correlation_time_s > 0"),
        (p.fence is None or not p.fence.is_empty, "the fence is empty"),
    )
    for holds, text in checks:
        if not holds:
            return text
    return None

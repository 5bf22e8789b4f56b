"""Reads a problem's JSON (docs/reference/problem-format.md): degrees and WKT outside, radians and shapes inside."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import shapely

from companion.boat.failed_tack import IRONS_S
from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.messages import Spread, Target
from companion.planner.problem.parts import (
    FENCE,
    AutopilotBeatZone,
    Beat,
    BoatLimits,
    Current,
    ProblemWind,
    RiskLimit,
    Sigma,
    Speeds,
    Strength,
)
from companion.planner.problem.sigma import SIGMA_MODELS

if TYPE_CHECKING:
    from companion.planner.problem.tracking import Tracking

T = TypeVar("T")
_NAN = re.compile(r"\bnan\b", re.IGNORECASE)


class _JsonReader:
    """Typed access to one JSON object that names the place of what is wrong."""

    def __init__(self, raw: Any, source: str, place: str) -> None:
        self.source, self.place = source, place
        if not isinstance(raw, Mapping):
            raise InputError(source, place, "is not a JSON object", "see docs/reference/problem-format.md")
        self.raw = raw

    def _get(self, key: str, default: Any, convert: Callable[[Any], T]) -> T:
        where = f"{self.place}.{key}" if self.place else key
        if key not in self.raw:
            if default is not ...:
                return default  # type: ignore[no-any-return]
            raise InputError(self.source, where, "is missing", "see docs/reference/problem-format.md")
        try:
            return convert(self.raw[key])
        except (TypeError, ValueError) as error:
            text = repr(self.raw[key])
            text = text if len(text) < 60 else text[:57] + "..."
            raise InputError(
                self.source, where, f"{text} is not what belongs here ({error})", "see docs/reference/problem-format.md"
            ) from error

    def number(self, key: str, default: Any = ...) -> float:
        """Return a float (may be NaN: that is for ``defect`` to say)."""
        return self._get(key, default, _as_float)

    def maybe(self, key: str) -> float | None:
        """Return a float, None where it is missing or null."""
        return None if self.raw.get(key) is None else self.number(key)

    def whole(self, key: str) -> int:
        """Return an integer."""
        return self._get(key, ..., _as_int)

    def numbers(self, key: str, default: Any = ...) -> tuple[float, ...]:
        """Return a list of floats."""
        return self._get(key, default, lambda v: tuple(_as_float(x) for x in _as_list(v)))

    def rows(self, key: str) -> tuple[tuple[float, ...], ...]:
        """Return a list of lists of floats."""
        return self._get(key, ..., lambda v: tuple(tuple(_as_float(x) for x in _as_list(row)) for row in _as_list(v)))

    def places(self, key: str) -> tuple[tuple[float, float], ...]:
        """Return a list of [x, y], empty where it is missing."""
        return () if self.raw.get(key) is None else self._get(key, (), lambda v: tuple(map(_as_place, _as_list(v))))

    def flag(self, key: str, default: Any = ...) -> bool:
        """Return true or false."""
        return self._get(key, default, _as_bool)

    def text(self, key: str, default: Any = ...) -> str:
        """Return a string."""
        return self._get(key, default, str)

    def child(self, key: str) -> _JsonReader:
        """Return the object under ``key``."""
        where = f"{self.place}.{key}" if self.place else key
        if key not in self.raw:
            raise InputError(self.source, where, "is missing", "see docs/reference/problem-format.md")
        return _JsonReader(self.raw[key], self.source, where)


def _as_float(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("a number is needed")
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _as_place(value: Any) -> tuple[float, float]:
    x, y = _as_list(value)
    return _as_float(x), _as_float(y)


def _as_bool(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError("true or false is needed")
    return value


def _as_int(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError("a whole number is needed")
    return value


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
            # A ring with NaN in it is never closed; a number that is none either is for ``defect`` to say.
            geometry = shapely.from_wkt(_NAN.sub("inf", text))
        except shapely.errors.ShapelyError as error:
            first = str(error).splitlines()[0] if str(error) else "unreadable"
            raise InputError(source, place, f"is not WKT ({first})", "write POLYGON ((x y, ...))") from error
    if geometry.geom_type not in {"Polygon", "MultiPolygon"}:
        raise InputError(source, place, f"is a {geometry.geom_type}, not a POLYGON", "close the area")
    return geometry


def read_fields(source: str | Path | Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of the problem in a JSON file or an already parsed mapping: those of ``Problem``, by name.

    Raises:
        InputError: the file cannot be read, a field is missing or not of its type, a WKT does not parse.

    """
    if isinstance(source, Mapping):
        return _fields(source, str(source.get("id", "problem")))
    path = Path(source)
    try:
        data = read_regular(path)
        raw = json.loads(data)
    except OSError as error:
        raise unreadable(str(path), error, remedy="name a problem file") from error
    except (ValueError, RecursionError) as error:
        if not data.strip():
            raise InputError(str(path), "", "is empty", "name a problem file") from None
        raise InputError(str(path), "", f"is not JSON ({error})", "see docs/reference/problem-format.md") from error
    if not isinstance(raw, Mapping):
        raise InputError(str(path), "", "is not a JSON object", "see docs/reference/problem-format.md")
    return _fields(raw, str(path))


def _fields(raw: Mapping[str, Any], source: str) -> dict[str, Any]:
    top = _JsonReader(raw, source, "")
    start, goal, wind, boat = (top.child(k) for k in ("start", "goal", "wind", "boat"))
    obstacles = raw.get("obstacles") or []
    if not isinstance(obstacles, (list, tuple)):
        raise InputError(source, "obstacles", "is not a list", "write a list of WKT polygons")
    names = raw.get("obstacle_names") or []
    if not isinstance(names, (list, tuple)) or (names and len(names) != len(obstacles)):
        raise InputError(source, "obstacle_names", "is not a list as long as obstacles", "write one name for each")
    fence = raw.get("fence")
    targets = raw.get("targets") or []
    if not isinstance(targets, (list, tuple)):
        raise InputError(source, "targets", "is not a list", "write a list of objects")
    twa, mps = _parse_speed(boat.child("speed"))
    known = {
        "id",
        "title",
        "start",
        "goal",
        "obstacles",
        "fence",
        "wind",
        "boat",
        "delta_s",
        "notes",
        "current",
        "adrift",
        "targets",
        "allocation",
        "risk",
        "clearance_floor_m",
        "leg_saving",
        "beat",
        "obstacle_names",
        "fence_name",
        "tracking",
        "zone",
        "known",
    }
    fields: dict[str, Any] = dict(  # noqa: C408, the names of Problem's fields
        id=top.text("id", ""),
        title=top.text("title", ""),
        notes=top.text("notes", ""),
        start_en=(start.number("x"), start.number("y")),
        start_heading_rad=math.radians(start.number("heading_deg")),
        goal_en=(goal.number("x"), goal.number("y")),
        goal_radius_m=goal.number("radius"),
        obstacles=tuple(_polygon(w, source, f"obstacles[{i}]") for i, w in enumerate(obstacles)),
        obstacle_names=tuple(str(name) for name in names),
        fence=None if fence is None else _polygon(fence, source, "fence"),
        fence_name=top.text("fence_name", FENCE),
        wind=ProblemWind(
            twd_from_rad=math.radians(wind.number("from_deg")),
            tws_mps=wind.maybe("speed_mps"),
            sigma=_parse_sigma(wind.child("sigma")) if wind.raw.get("sigma") is not None else Sigma(),
            strength=_parse_strength(wind.child("strength")) if wind.raw.get("strength") is not None else None,
        ),
        boat=BoatLimits(
            no_go_half_rad=math.radians(boat.number("no_go_half_deg")),
            max_twa_rad=math.radians(boat.number("max_twa_deg", 180.0)),
            turn_rate_radps=boat.number("turn_rate_rad_s"),
            polar_twa_rad=twa,
            polar_mps=mps,
            tack_loss_s=boat.number("tack_loss_s", 0.0),
            gybe_loss_s=boat.number("gybe_loss_s", 0.0),
            can_tack=boat.flag("can_tack", True),
            gybe_room_m=boat.maybe("gybe_room_m"),
            speeds=_parse_speeds(boat.child("speeds")) if boat.raw.get("speeds") is not None else None,
            max_tws_mps=boat.maybe("max_tws_mps"),
            min_tws_mps=boat.maybe("min_tws_mps"),
            tack_fails=boat.number("tack_fails", 0.0),
            irons_s=boat.number("irons_s", IRONS_S),
            lee_mps=boat.numbers("lee_mps", (0.0, 0.0)),
            speed_error=boat.number("speed_error", 0.0),
            speed_share=boat.number("speed_share", 1.0),
            shape_error=boat.numbers("shape_error", ()),
            leeway_rad=math.radians(boat.number("leeway_deg", 0.0)),
        ),
        delta_s=top.number("delta_s"),
        current=_parse_current(_JsonReader(raw.get("current") or {}, source, "current")),
        adrift=_parse_current(_JsonReader(raw.get("adrift") or {}, source, "adrift")),
        known_en=top.places("known"),
        targets=tuple(_parse_target(_JsonReader(t, source, f"targets[{i}]")) for i, t in enumerate(targets)),
        vessels_part=_parse_allocation(top.child("allocation")) if raw.get("allocation") is not None else None,
        risk=_parse_risk(_JsonReader(raw["risk"], source, "risk")) if raw.get("risk") is not None else None,
        clearance_floor_m=top.number("clearance_floor_m", 0.0),
        beat=_parse_beat(top.child("beat")) if raw.get("beat") is not None else None,
        tracking=_parse_tracking(top.child("tracking")) if raw.get("tracking") is not None else None,
        zone=_parse_zone(top.child("zone")) if raw.get("zone") is not None else None,
        extra={k: v for k, v in raw.items() if k not in known},
    )
    return fields | ({"leg_saving": top.number("leg_saving")} if "leg_saving" in raw else {})


def _parse_speed(speed: _JsonReader) -> tuple[tuple[float, ...], tuple[float, ...]]:
    model = speed.text("model")
    if model == "constant":
        v_mps = speed.number("v_mps")
        return (0.0, math.pi), (v_mps, v_mps)
    if model != "polar":
        raise InputError(speed.source, f"{speed.place}.model", f"{model!r} is unknown", "write constant or polar")
    twa, mps = speed.numbers("twa_deg"), speed.numbers("v_mps")
    if len(twa) != len(mps) or not twa:
        raise InputError(
            speed.source,
            speed.place,
            "twa_deg and v_mps differ in length or are empty",
            "give one speed for each angle",
        )
    if any(b < a for a, b in itertools.pairwise(twa)):
        raise InputError(speed.source, f"{speed.place}.twa_deg", "does not increase", "sort the polar by angle")
    return tuple(math.radians(a) for a in twa), mps


def _spread(deg: float) -> float:
    """Return a sigma or growth in radians; what is below any meaning (1e-12) is 0, lest its square underflow."""
    return 0.0 if abs(deg) < 1e-12 else math.radians(deg)


def _parse_sigma(sigma: _JsonReader) -> Sigma:
    model = sigma.text("model")
    if model == "none":
        return Sigma()
    if model == "kalman":
        return Sigma(
            model=model,
            sigma0_rad=_spread(sigma.number("sigma0_deg")),
            growth_rad_per_sqrt_s=_spread(sigma.number("growth_deg_per_sqrt_s")),
        )
    if model == "ar1":
        return Sigma(
            model=model,
            sigma0_rad=_spread(sigma.number("sigma0_deg")),
            sigma_inf_rad=_spread(sigma.number("sigma_inf_deg")),
            rho_hz=sigma.number("rho_hz"),
        )
    if model != "forecast":
        raise InputError(
            sigma.source, f"{sigma.place}.model", f"{model!r} is unknown", "write one of " + ", ".join(SIGMA_MODELS)
        )
    horizon = sigma.numbers("horizon_s")
    degrees = sigma.numbers("sigma_deg")
    half = sigma.numbers("half_width_deg") if sigma.raw.get("half_width_deg") is not None else None
    _require_table(sigma, "horizon_s", horizon, degrees, *(() if half is None else (half,)))
    return Sigma(
        model=model,
        horizon_s=horizon,
        sigma_rad=tuple(map(_spread, degrees)),
        half_width_rad=None if half is None else tuple(map(_spread, half)),
    )


def _parse_strength(strength: _JsonReader) -> Strength:
    horizon, mean, sigma = (strength.numbers(key) for key in ("horizon_s", "mean_mps", "sigma_mps"))
    _require_table(strength, "horizon_s", horizon, mean, sigma)
    return Strength(
        horizon_s=horizon,
        mean_mps=mean,
        sigma_mps=sigma,
        correlation_s=strength.number("correlation_s", 60.0),
        is_known=strength.flag("known", True),
    )


def _parse_speeds(speeds: _JsonReader) -> Speeds:
    tws, twa = speeds.numbers("tws_mps"), speeds.numbers("twa_deg")
    rows = speeds.rows("v_mps")
    _require_table(speeds, "tws_mps", tws, rows)
    _require_table(speeds, "twa_deg", twa, *rows)
    return Speeds(tws_mps=tws, twa_rad=tuple(math.radians(a) for a in twa), v_mps=rows)


def _require_table(table: _JsonReader, key: str, nodes: Sequence[float], *columns: Sequence[Any]) -> None:
    if not nodes or any(len(column) != len(nodes) for column in columns):
        raise InputError(
            table.source, table.place, "the columns differ in length or are empty", f"give one value for each of {key}"
        )
    if any(not b > a for a, b in itertools.pairwise(nodes)):
        raise InputError(table.source, f"{table.place}.{key}", "does not increase", "sort the table by it")


def _parse_target(target: _JsonReader) -> Target:
    return Target(
        x_m=target.number("x"),
        y_m=target.number("y"),
        vx_mps=target.number("vx", 0.0),
        vy_mps=target.number("vy", 0.0),
        radius_m=target.number("radius_m"),
        growth_mps=target.number("growth_mps", 0.0),
        from_s=target.number("from_s", 0.0),
        until_s=target.number("until_s", math.inf),
        name=target.text("name", ""),
        spread=_parse_spread(target.child("spread")) if target.raw.get("spread") is not None else None,
    )


def _parse_spread(spread: _JsonReader) -> Spread:
    return Spread(
        vessel=spread.whole("vessel"),
        x_m=spread.number("x"),
        y_m=spread.number("y"),
        course_rad=math.radians(spread.number("course_deg")),
        keep_m=spread.number("keep_m"),
        along_m=spread.number("along_m"),
        along_mps=spread.number("along_mps", 0.0),
        across_m=spread.number("across_m"),
        across_mps=spread.number("across_mps", 0.0),
        own_mps=spread.number("own_mps", 0.0),
        sigma_m=spread.number("sigma_m"),
        sigma_mps=spread.number("sigma_mps", 0.0),
    )


def _parse_allocation(allocation: _JsonReader) -> float:
    return allocation.number("vessels")


def _parse_risk(risk: _JsonReader) -> RiskLimit:
    return RiskLimit(
        max_path_risk=risk.number("max_path_risk"), correlation_time_s=risk.number("correlation_time_s", 60.0)
    )


def _parse_current(current: _JsonReader) -> Current:
    return Current(set_rad=math.radians(current.number("set_deg", 0.0)), drift_mps=current.number("drift_mps", 0.0))


def _parse_zone(zone: _JsonReader) -> AutopilotBeatZone:
    return AutopilotBeatZone(
        from_rad=math.radians(zone.number("from_deg")), half_rad=math.radians(zone.number("half_deg"))
    )


def _parse_beat(beat: _JsonReader) -> Beat:
    return Beat(
        no_go_half_rad=math.radians(beat.number("no_go_half_deg")),
        corridor_m=beat.number("corridor_m"),
        clearance_m=beat.number("clearance_m"),
        tack_s=beat.number("tack_s", 0.0),
    )


def _parse_tracking(track: _JsonReader) -> Tracking:
    from companion.boat.tracking import HELM_KEYS, GuidanceModel
    from companion.planner.problem.tracking import Tracking

    default = GuidanceModel()
    numbers = {name: track.number(name, getattr(default, name)) for name in HELM_KEYS}
    angle = track.number("no_go_half_deg", math.degrees(default.no_go_half_rad))
    try:
        helm = GuidanceModel(**numbers, no_go_half_rad=math.radians(angle))
    except ValueError as error:
        raise InputError(track.source, track.place, str(error), "see docs/reference/problem-format.md") from error
    solids = track.raw.get("solids") or []
    if not isinstance(solids, (list, tuple)):
        raise InputError(track.source, "tracking.solids", "is not a list", "write a list of WKT polygons")
    limits, before = track.raw.get("limits"), track.raw.get("before")
    at = None if before is None else track.child("before")
    return Tracking(
        helm=helm,
        floor_m=track.number("floor_m"),
        reach_m=track.number("reach_m", 0.0),
        solids=tuple(_polygon(w, track.source, f"tracking.solids[{i}]") for i, w in enumerate(solids)),
        limits=None if limits is None else _polygon(limits, track.source, "tracking.limits"),
        before_en=None if at is None else (at.number("x"), at.number("y")),
        leeway_rad=tuple(math.radians(a) for a in track.numbers("leeway_deg", ())),
        correlation_s=track.number("correlation_s", 60.0),
        is_known=track.flag("known", True),
    )

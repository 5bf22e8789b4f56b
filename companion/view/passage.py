"""A planned passage as it is drawn: the file that lies beside its mission, and what a page gets of it.

Ashore ``companion passage plan --out M.toml`` leaves ``M.passage.json``, and the boat's page and the editor show it.
It is never sailed by: that is the mission's. Times count from the departure, ways along the route from its start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

import msgspec
import numpy as np
import shapely
from msgspec import Meta, Struct
from numpy.typing import NDArray

from companion.errors import InputError
from companion.geo.distinct import distinct
from companion.geofence.mission import MOST_PASSAGE_BYTES
from companion.view.values import PointEn
from companion.words import expected

Form = Literal["companion.passage/1"]
FORM: Form = "companion.passage/1"
_NORTH_DEG = 0.01  # how far off true north is looked for

Lat = Annotated[float, Meta(ge=-90.0, le=90.0)]
Lon = Annotated[float, Meta(ge=-180.0, le=180.0)]
Way = Annotated[float, Meta(ge=0.0, le=5e7)]
Since = Annotated[float, Meta(ge=0.0, le=1e8)]
Unix = Annotated[float, Meta(ge=0.0, le=1e11)]
Mps = Annotated[float, Meta(ge=0.0, le=150.0)]
Degrees = Annotated[float, Meta(ge=0.0, le=360.0)]
Quantile = Annotated[float, Meta(ge=0.0, le=1.0)]
Words = Annotated[str, Meta(max_length=300)]
PlaceDeg = tuple[Lat, Lon]
ToEn = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class PlannedWaypoint(Struct, frozen=True, kw_only=True):
    """A waypoint: the band about the leg to it [m], and when she is there [s]; None: so many runs are not."""

    at: PlaceDeg
    name: Annotated[str, Meta(max_length=80)]
    band_m: Way
    way_m: Way
    early_s: Since | None
    middle_s: Since | None
    late_s: Since | None


class PlannedWeather(Struct, frozen=True, kw_only=True):
    """Wind and current at a place when the middle run passes it; ``low_mps`` and ``high_mps`` are of the members."""

    at: PlaceDeg
    t_s: Since
    wind_from_deg: Degrees
    wind_mps: Mps
    low_mps: Mps
    high_mps: Mps
    current_towards_deg: Degrees | None = None
    current_mps: Mps | None = None


class PlannedIsochrone(Struct, frozen=True, kw_only=True):
    """Where she can be at the farthest after so many hours."""

    hours: Annotated[float, Meta(ge=0.0, le=30_000.0)]
    lines: Annotated[tuple[tuple[PlaceDeg, ...], ...], Meta(max_length=200)]


class PlannedEnd(Struct, frozen=True, kw_only=True):
    """Where runs end that do not arrive, and why."""

    at: PlaceDeg
    runs: Annotated[int, Meta(ge=1, le=100_000)]
    why: Words


class PlannedPassage(Struct, frozen=True, kw_only=True):
    """The file. ``line`` are (way [m], latitude, longitude [deg]).

    ``middle_m`` and each of ``members_m`` are how far along it the middle run and those of the members are at ``at_s``;
    None where a run has ended. ``arrivals_s`` are the times under way of those that
    ``arrived``, sorted. ``low`` and
    ``high`` are the quantiles of early and late. Past ``until_unix_s``, or ``climate_unix_s`` where the wind of the
    season goes on, there is no forecast. ``said`` is what the planner told, ``binds`` what keeps runs from arriving.
    """

    form: Form = FORM
    version: Annotated[str, Meta(max_length=40)] = ""
    name: Annotated[str, Meta(max_length=200)]
    departs_unix_s: Unix
    run_unix_s: Unix
    until_unix_s: Unix
    climate_unix_s: Unix | None = None
    members: Annotated[int, Meta(ge=1, le=10_000)]
    runs: Annotated[int, Meta(ge=1, le=100_000)]
    arrived: Annotated[int, Meta(ge=0, le=100_000)]
    low: Quantile
    high: Quantile
    waypoints: Annotated[tuple[PlannedWaypoint, ...], Meta(min_length=2, max_length=300)]
    line: Annotated[tuple[tuple[Way, Lat, Lon], ...], Meta(min_length=2, max_length=1000)]
    at_s: Annotated[tuple[Since, ...], Meta(min_length=2, max_length=200)]
    middle_m: Annotated[tuple[Way | None, ...], Meta(min_length=2, max_length=200)]
    members_m: Annotated[tuple[tuple[Way | None, ...], ...], Meta(max_length=64)] = ()
    met: Annotated[tuple[PlannedWeather, ...], Meta(max_length=400)] = ()
    isochrones: Annotated[tuple[PlannedIsochrone, ...], Meta(max_length=40)] = ()
    arrivals_s: Annotated[tuple[Since, ...], Meta(max_length=500)] = ()
    ends: Annotated[tuple[PlannedEnd, ...], Meta(max_length=20)] = ()
    said: Annotated[tuple[Words, ...], Meta(max_length=20)] = ()
    binds: Annotated[tuple[Words, ...], Meta(max_length=20)] = ()

    def __post_init__(self) -> None:
        """Refuse what cannot be drawn. Raises ValueError."""
        if any(len(row) != len(self.at_s) for row in (self.middle_m, *self.members_m)):
            raise ValueError("`middle_m` and each of `members_m` need a value for each of `at_s`")
        for name, column in (("at_s", self.at_s), ("line", tuple(row[0] for row in self.line))):
            if any(b < a for a, b in pairwise(column)):
                raise ValueError(f"`{name}` goes backwards")


def parse_planned(data: bytes, source: str) -> PlannedPassage:
    """Return the passage of a file. Raises InputError."""
    remedy = "write it anew with companion passage plan --out"
    if len(data) > MOST_PASSAGE_BYTES:
        raise InputError(source, "", f"is larger than {MOST_PASSAGE_BYTES // 1000} kB", remedy)
    try:
        return msgspec.json.decode(data, type=PlannedPassage)
    except msgspec.ValidationError as error:
        problem, _, path = str(error).partition(" - at `$")
        raise InputError(source, path.strip("`").lstrip("."), expected(problem), remedy) from None
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(source, "", f"is no planned passage: {str(error)[:100]}", remedy) from None


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointView:
    """A waypoint of the passage, the band about the leg to it, and when she is there [s] after the departure."""

    at_en_m: PointEn
    name: str
    band_m: float
    way_m: float
    early_s: float | None
    middle_s: float | None
    late_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class MetView:
    """Wind and current at a place as she passes it, ``t_s`` after the departure.

    ``north_deg`` is where true north is on the chart there: meridians come together.
    """

    at_en_m: PointEn
    north_deg: float
    t_s: float
    wind_from_deg: float
    wind_mps: float
    low_mps: float
    high_mps: float
    current_towards_deg: float | None
    current_mps: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class IsochroneView:
    """The places that she can be at after so many hours: lines."""

    hours: float
    lines: tuple[tuple[PointEn, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class EndView:
    """Where runs end that do not arrive, and why."""

    at_en_m: PointEn
    runs: int
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PassageView:
    """A planned passage on the chart: what it was planned to be, and never what is sailed by.

    Times are seconds after the departure, ways metres along ``line`` (way, east, north). ``middle_m`` and each of
    ``members_m`` say how far along it a run is at ``at_s``, None where it has ended; ``band`` is polygons.
    """

    name: str
    departs_unix_s: float
    run_unix_s: float
    until_unix_s: float
    climate_unix_s: float | None
    members: int
    runs: int
    arrived: int
    low: float
    high: float
    waypoints: tuple[WaypointView, ...]
    line: tuple[tuple[float, float, float], ...]
    band: tuple[tuple[tuple[PointEn, ...], ...], ...]
    at_s: tuple[float, ...]
    middle_m: tuple[float | None, ...]
    members_m: tuple[tuple[float | None, ...], ...]
    met: tuple[MetView, ...]
    isochrones: tuple[IsochroneView, ...]
    arrivals_s: tuple[float, ...]
    ends: tuple[EndView, ...]
    said: tuple[str, ...]
    binds: tuple[str, ...]


def passage_view(planned: PlannedPassage, to_en: ToEn) -> PassageView:
    """Return a passage on a chart: ``to_en`` takes (n, 2) of longitude and latitude [deg], gives metres."""

    def places(of: Sequence[PlaceDeg]) -> tuple[PointEn, ...]:
        if not of:
            return ()
        at = np.round(to_en(np.array(of, dtype=np.float64)[:, ::-1]), 1)
        return tuple((float(e), float(n)) for e, n in at)

    met_at = places([m.at for m in planned.met])
    # towards the equator, so that no pole is passed
    north = places([(m.at[0] - math.copysign(_NORTH_DEG, m.at[0]), m.at[1]) for m in planned.met])
    line = places([(lat, lon) for _, lat, lon in planned.line])
    shown = [(way, e, n) for (way, _, _), (e, n) in zip(planned.line, line, strict=True)]
    return PassageView(
        name=planned.name,
        departs_unix_s=planned.departs_unix_s,
        run_unix_s=planned.run_unix_s,
        until_unix_s=planned.until_unix_s,
        climate_unix_s=planned.climate_unix_s,
        members=planned.members,
        runs=planned.runs,
        arrived=planned.arrived,
        low=planned.low,
        high=planned.high,
        waypoints=tuple(
            WaypointView(
                at_en_m=at,
                name=w.name,
                band_m=w.band_m,
                way_m=w.way_m,
                early_s=w.early_s,
                middle_s=w.middle_s,
                late_s=w.late_s,
            )
            for w, at in zip(planned.waypoints, places([w.at for w in planned.waypoints]), strict=True)
        ),
        line=tuple(shown),
        band=_band(planned, np.array(shown)),
        at_s=planned.at_s,
        middle_m=planned.middle_m,
        members_m=planned.members_m,
        met=tuple(
            MetView(
                at_en_m=at,
                north_deg=_turned(m.at[0], at, off),
                t_s=m.t_s,
                wind_from_deg=m.wind_from_deg,
                wind_mps=m.wind_mps,
                low_mps=m.low_mps,
                high_mps=m.high_mps,
                current_towards_deg=m.current_towards_deg,
                current_mps=m.current_mps,
            )
            for m, at, off in zip(planned.met, met_at, north, strict=True)
        ),
        isochrones=tuple(
            IsochroneView(hours=i.hours, lines=tuple(places(part) for part in i.lines)) for i in planned.isochrones
        ),
        arrivals_s=planned.arrivals_s,
        ends=tuple(
            EndView(at_en_m=at, runs=e.runs, why=e.why)
            for e, at in zip(planned.ends, places([e.at for e in planned.ends]), strict=True)
        ),
        said=planned.said,
        binds=planned.binds,
    )


def _turned(lat_deg: float, at: PointEn, off: PointEn) -> float:
    """Return where true north is on the chart [deg], by a place a little nearer to the equator."""
    sign = 1.0 if math.copysign(1.0, lat_deg) > 0.0 else -1.0
    return round(math.degrees(math.atan2(sign * (at[0] - off[0]), sign * (at[1] - off[1]))), 1)


def _band(planned: PlannedPassage, line: NDArray[np.float64]) -> tuple[tuple[tuple[PointEn, ...], ...], ...]:
    """Return the band about the legs as polygons: along the route's line between two waypoints, as wide as is said."""
    parts = []
    for a, b in pairwise(planned.waypoints):
        ways = distinct([a.way_m, *line[(line[:, 0] > a.way_m) & (line[:, 0] < b.way_m), 0], b.way_m])
        points = np.stack([np.interp(ways, line[:, 0], line[:, k]) for k in (1, 2)], axis=-1)
        if len(points) > 1 and b.band_m > 0.0:
            parts.append(shapely.buffer(shapely.linestrings(points), b.band_m, quad_segs=4))
    whole = shapely.simplify(shapely.union_all(parts), 0.02 * max((w.band_m for w in planned.waypoints), default=0.0))
    return tuple(
        tuple(
            tuple((round(float(e), 1), round(float(n), 1)) for e, n in ring.coords)
            for ring in (part.exterior, *part.interiors)
        )
        for part in shapely.get_parts(whole)
        if part.geom_type == "Polygon" and not part.is_empty
    )

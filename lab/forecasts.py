"""Does a forecast help a boat of three knots? Büsser (2009, section 4.2) thought not: no storm is dodged at that speed.

    python -m lab.forecasts                                  fifty departures over 1,500 km, six ways to sail each
    python -m lab.forecasts --course south --out rows.csv --plot forecasts.png
    python -m lab.forecasts --wind era5.nc --out rows.csv    400 km in the wind of files, a reanalysis

Each departure has its own weather, made up (``lab.climate``) on a day of its own of a year: out of Biscay round
Finisterre against the westerlies (``west``), or from the Hebrides round Ireland across them (``south``). Forecasts are
its truth and a made-up error, in seven members. She sails at 0.65 of AVALON's polar and no faster than a hull of four
metres, which makes three to four knots of her,

    fixed      along waypoints set by hand: the shortest way round the land
    laid       along waypoints laid before in the mean wind of the season, as AVALON was to
    measured   planned again each day in the wind that she measures, farther off the season's mean wind: no forecast
    forecast   planned again each day in the members of a new forecast of ten days, behind it the season's mean wind
    careful    as that, and 15 m/s of wind are more than she is to be out in
    foresight  planned once in the wind that comes: what the best forecast could give

and all of it is sailed in the weather that comes by the integrator that judges passages. Rows are kept as they come.
"""

from __future__ import annotations

import argparse
import csv
import datetime as dt
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Boat, Polar, avalon
from companion.geo import EARTH_RADIUS_M
from companion.messages import GeoPoint
from companion.passage import SURE, Craft, Outcome, Passage, PassageFrame, again, craft_of, land_of, plan, sail, sweep
from companion.passage.again import left_of
from companion.passage.frame import GEOD
from companion.weather import Weather, read_weather
from lab.climate import Box, forecast_of, truth, usual

Floats = NDArray[np.float64]
RADIUS_M = 2000.0
MARGIN_M = 10_000.0
FIRST_UTC_S = dt.datetime(2026, 1, 1, tzinfo=dt.UTC).timestamp()
YEAR_S, DAY_S = 365.0 * 86_400.0, 86_400.0
EVERY_S = DAY_S  # she plans again
AHEAD_S = 10.0 * DAY_S  # a forecast knows
MOST_S = 35.0 * DAY_S
STEP_S = 12 * 3600.0
MEMBERS, CANDIDATES = 7, 2
NODES = 30
NO_GO_RAD = math.radians(45.0)
STRONG_MPS = 15.0
SHARE, HULL_MPS = 0.65, 2.5  # of AVALON's polar, and what a waterline of 4 m makes of it
STAYS_S, REACH_M = 1.5 * DAY_S, 500_000.0  # a wind that is measured is the wind so long, and so far away: to a third
FILES_KM, FILES_DAYS = 400.0, 5.0  # how far she sails in the wind of files, and how much of it is left for that
WAYS = ("fixed", "laid", "measured", "forecast", "careful", "foresight")

# Natural Earth at 1:110 million (public domain), what of it is near: longitude, latitude [deg].
_SPAIN_AND_FRANCE = """-2.2 36.7, -4.4 36.7, -5.9 36, -6.5 36.9, -7.9 36.8, -8.9 36.9, -9.5 38.7, -8.8 41.2, -9.4 43,
    -8 43.8, -6.8 43.6, -1.9 43.4, -1.4 44, -1.2 46, -3 47.6, -4.5 48, -4.6 48.7, -1.6 48.6, -1.9 49.8, 1.3 50.1,
    3 51.3, 3 36.7, -2.2 36.7"""
_BRITAIN = """-5.6 56.3, -6.2 56.8, -5.8 57.8, -5 58.6, -3 58.6, -2 57.7, -3.1 56, 0.2 53.3, 1.7 52.7, 1.4 51.3,
    0.6 50.8, -2.5 50.5, -3.6 50.2, -5.3 50, -5.8 50.2, -3.4 51.4, -5 51.6, -5.3 52, -4.2 52.3, -4.6 53.5, -3.1 53.4,
    -4.8 54.8, -5.1 55.8, -5.6 56.3"""
_IRELAND = """-5.7 54.6, -6.2 53.9, -6 53.2, -6.8 52.3, -8.6 51.7, -10 51.8, -9.2 52.9, -9.7 53.9, -7.6 55.1, -6.7 55.2,
    -5.7 54.6"""
LAND = tuple(shapely.from_wkt(f"POLYGON (({corners}))") for corners in (_SPAIN_AND_FRANCE, _BRITAIN, _IRELAND))


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """A course: start, waypoints set by hand and goal (latitude, longitude), and the box of its weather."""

    name: str
    by_hand: tuple[tuple[float, float], ...]
    box: Box
    land: tuple[BaseGeometry, ...] = LAND

    @property
    def points(self) -> list[GeoPoint]:
        """Its waypoints."""
        return [GeoPoint(lat_deg=lat, lon_deg=lon) for lat, lon in self.by_hand]

    @property
    def goal(self) -> GeoPoint:
        """Where it ends."""
        return self.points[-1]


COURSES = (
    Course(
        name="west", by_hand=((44.2, -3.5), (44.1, -7.9), (43.3, -10.0), (39.7, -20.5)), box=(-34.0, 30.0, 3.0, 54.0)
    ),
    Course(
        name="south", by_hand=((58.3, -8.5), (54.2, -10.6), (51.6, -10.8), (45.0, -9.0)), box=(-30.0, 36.0, 8.0, 68.0)
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A departure sailed in one way: hours under way (inf: not there), in a strong wind, miles sailed, land crossed."""

    course: str
    departure: int
    way: str
    hours: float
    strong_h: float
    distance_nm: float
    land_km: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Voyage:
    """A departure of a course, in a weather that is known to whoever judges; ``ends`` is when that is known no more."""

    course: Course
    departure: int
    begins: float
    ends: float
    true: Weather
    mean: Weather

    def asked(
        self, weather: Weather, here: GeoPoint, most_mps: float = math.inf, margin_m: float = MARGIN_M
    ) -> Passage:
        """Return the passage from where she is to the goal, in what is believed."""
        frame = PassageFrame(here, self.course.goal)
        return Passage(
            start=here,
            goal=self.course.goal,
            radius_m=RADIUS_M,
            craft=craft_of_hers()._replace(max_tws_mps=most_mps),
            weather=weather,
            land=land_of(frame, self.course.land, self.course.box, margin_m),
            frame=frame,
        )

    def forecast(self, now: float, run: int) -> Weather:
        """Return the forecast of a moment, the season's mean wind behind it."""
        times = now + np.arange(0.0, min(AHEAD_S, self.ends - now) + 1.0, STEP_S)
        new = forecast_of(self.true, self.departure, times, self.course.box, members=MEMBERS, run=run)
        [known], [behind] = new.wind, self.mean.wind
        each = np.broadcast_to(behind.values, (MEMBERS, *behind.values.shape[1:])).copy()
        return Weather(wind=(known, replace(behind, members=known.members, values=each)))

    def measured(self, here: GeoPoint, now: float) -> Weather:
        """Return what she believes without a forecast: the wind that is here now, away from it the season's."""
        [cube] = self.mean.wind
        blows, usually = (w.wind_en_mps(now, here.lat_deg, here.lon_deg)[0] for w in (self.true, self.mean))
        lon, lat = np.meshgrid(cube.lon_deg, cube.lat_deg)
        away = np.hypot(lat - here.lat_deg, (lon - here.lon_deg) * math.cos(math.radians(here.lat_deg)))
        far = np.exp(-math.radians(1.0) * EARTH_RADIUS_M * away / REACH_M)
        times = np.unique([now, *cube.utc_s[cube.utc_s > now]])
        left = np.exp(-(times - now) / STAYS_S)[:, None, None, None] * far[:, :, None] * (blows - usually)
        rows, columns = lat.ravel(), lon.ravel()
        values = self.mean.wind_over(times, rows, columns)[0].reshape(times.size, *lat.shape, 2) + left
        new = replace(cube, utc_s=times, base_utc_s=np.full(times.size, now), values=values[None].astype(np.float32))
        return Weather(wind=(new,))


@cache
def craft_of_hers() -> Craft:
    """Return what she can do."""
    of = avalon()
    tws_mps = np.arange(0.0, 16.0, 0.5)
    speeds = [[min(HULL_MPS, SHARE * of.speed_mps(twa, tws)) for tws in tws_mps] for twa in of.twa_rad]
    polar = Polar(twa_rad=of.twa_rad, tws_mps=tws_mps, speed_mps_table=np.array(speeds))
    return craft_of(Boat(polar=polar, no_go_half_rad=NO_GO_RAD, tack_loss_s=20.0))


def made_voyage(course: Course, departure: int, of: int) -> Voyage:
    """Return a departure of so many in a year, in a weather that is made up."""
    begins = FIRST_UTC_S + departure * YEAR_S / of
    times = begins + np.arange(0.0, MOST_S + STEP_S, STEP_S)
    true, mean = truth(departure, times, course.box), usual(times, course.box)
    return Voyage(course=course, departure=departure, begins=begins, ends=times[-1], true=true, mean=mean)


def drawn_voyage(weather: Weather, departure: int) -> Voyage:
    """Return a departure drawn by its number: place, time and course amid the wind of files, far from its edges."""
    draw = np.random.default_rng(departure)
    [cube] = weather.wind
    (south, north), (west, east) = ((float(a[0]), float(a[-1])) for a in (cube.lat_deg, cube.lon_deg))
    lat, lon = (low + draw.uniform(0.3, 0.7) * (high - low) for low, high in ((south, north), (west, east)))
    begins = float(cube.utc_s[0] + draw.uniform() * (cube.utc_s[-1] - cube.utc_s[0] - FILES_DAYS * DAY_S))
    lon2, lat2, _ = GEOD.fwd(lon, lat, draw.uniform(0.0, 360.0), 1000.0 * FILES_KM)
    reach = 8.0  # degrees, so far about her a way is looked for
    box = (lon - reach, lat - reach, lon + reach, lat + reach)
    course = Course(name="files", by_hand=((lat, lon), (float(lat2), float(lon2))), box=box, land=())
    ends = float(cube.utc_s[-1])
    mean = usual(np.append(np.arange(begins, ends, STEP_S), ends), box)
    return Voyage(course=course, departure=departure, begins=begins, ends=ends, true=weather, mean=mean)


def sailed(voyage: Voyage) -> list[tuple[Row, Floats]]:
    """Return a departure sailed in all six ways: the row, and (n, 2) the places where she was [deg]."""
    start = voyage.course.points[0]
    laid = _found(voyage, voyage.mean, start, voyage.begins, voyage.course.points)
    foreseen = _found(voyage, voyage.true, start, voyage.begins, laid)
    along = {"fixed": voyage.course.points, "laid": laid, "foresight": foreseen}
    return [_again(voyage, way) if way not in along else _along(voyage, way, along[way]) for way in WAYS]


def _found(voyage: Voyage, weather: Weather, here: GeoPoint, now: float, old: Sequence[GeoPoint]) -> list[GeoPoint]:
    """Return the best route in one weather; nearer to land where there is none, else what is left of the old."""
    for margin_m in (MARGIN_M, 0.0):
        asked = voyage.asked(weather, here, margin_m=margin_m)
        route = plan(asked, now, nodes=NODES)
        if route.outcome is Outcome.FOUND:
            return list(route.waypoints)
    return list(left_of(asked, old))


def _of_members(
    voyage: Voyage, weather: Weather, here: GeoPoint, now: float, old: Sequence[GeoPoint], most_mps: float
) -> list[GeoPoint]:
    """Return the route to sail in a new forecast, as ``companion passage again`` says: the old one unless it pays.

    Where every way leads through more than ``most_mps`` of wind she goes through it, as she has to be somewhere.
    """
    for most, margin_m in ((most_mps, MARGIN_M), (math.inf, MARGIN_M), (math.inf, 0.0)):
        asked = voyage.asked(weather, here, most, margin_m)
        [new] = sweep(asked, [now], 0.0, nodes=NODES, candidates=CANDIDATES)
        if new.runs:
            chosen = again(asked, old, new, (1.0,), by_utc_s=math.inf, sure=SURE).chosen
            return list(chosen.route.waypoints)
    return list(left_of(asked, old))


def _along(voyage: Voyage, way: str, points: Sequence[GeoPoint]) -> tuple[Row, Floats]:
    times, places, wind, arrived = _leg(voyage, points, voyage.begins)
    return _told(voyage, way, times, places, wind, arrived)


def _leg(voyage: Voyage, points: Sequence[GeoPoint], now: float) -> tuple[Floats, Floats, Floats, bool]:
    """Return times, places and winds along points in the wind that comes: no limit stops her, it is counted."""
    [found] = sail(voyage.true, craft_of_hers(), points, now, RADIUS_M, voyage.true.members[:1])
    return found.rows[:, 0], found.places, found.rows[:, 3], found.arrived


def _again(voyage: Voyage, way: str) -> tuple[Row, Floats]:
    """Sail a plan of the moment for a day, plan again from there, and so on until she is there."""
    points, here, now = voyage.course.points, voyage.course.points[0], voyage.begins
    pieces: list[tuple[Floats, Floats, Floats]] = []
    arrived = False
    for run in range(math.ceil((voyage.ends - voyage.begins) / EVERY_S)):
        if way == "measured":
            points = _found(voyage, voyage.measured(here, now), here, now, points)
        else:
            most_mps = STRONG_MPS if way == "careful" else math.inf
            points = _of_members(voyage, voyage.forecast(now, run), here, now, points, most_mps)
        times, places, wind, arrived = _leg(voyage, points, now)
        last = len(times) if times[-1] <= now + EVERY_S else int(np.searchsorted(times, now + EVERY_S)) + 1
        pieces.append((times[:last], places[:last], wind[:last]))
        if last == len(times):
            break
        arrived = False
        here = GeoPoint(lat_deg=float(places[last - 1, 0]), lon_deg=float(places[last - 1, 1]))
        now = float(times[last - 1])
    times, places, wind = (np.concatenate(part) for part in zip(*pieces, strict=True))
    return _told(voyage, way, times, places, wind, arrived)


def _told(voyage: Voyage, way: str, times: Floats, places: Floats, wind: Floats, arrived: bool) -> tuple[Row, Floats]:
    steps = np.diff(times)
    moved_m = GEOD.inv(places[:-1, 1], places[:-1, 0], places[1:, 1], places[1:, 0])[2]
    line = shapely.linestrings(places[:, ::-1])
    dry_m = sum(GEOD.geometry_length(shapely.intersection(line, land)) for land in voyage.course.land)
    row = Row(
        course=voyage.course.name,
        departure=voyage.departure,
        way=way,
        hours=float(times[-1] - times[0]) / 3600.0 if arrived else math.inf,
        strong_h=float(steps[wind[:-1] > STRONG_MPS].sum()) / 3600.0,
        distance_nm=float(np.sum(moved_m)) / 1852.0,
        land_km=float(dry_m) / 1000.0,
    )
    return row, places


HEADS = (
    "way",
    "arrived",
    "hours 10 %",
    "50 %",
    "90 %",
    "mean",
    "less than fixed",
    "95 %",
    "faster in",
    f"out in {STRONG_MPS:g} m/s",
    "h of it",
    "land",
)


def table(rows: Iterable[Row]) -> str:
    """Return a line for each way; shares are of the same departures sailed along fixed waypoints, a mean of each."""
    held = list(rows)
    hours = {(r.way, r.departure): r.hours for r in held}
    lines = ["| " + " | ".join(HEADS) + " |", "|---" * len(HEADS) + "|"]
    for way in WAYS:
        mine = [r for r in held if r.way == way]
        there = [r.hours for r in mine if math.isfinite(r.hours)]
        cells = [way, f"{len(there)} of {len(mine)}"]
        cells += (
            [f"{q:.0f}" for q in np.quantile(there, (0.1, 0.5, 0.9))] + [f"{np.mean(there):.0f}"] if there else [""] * 4
        )
        shares = saved(hours, way)
        if way == "fixed" or not shares:
            cells += ["", "", ""]
        else:
            mean, half = float(np.mean(shares)), 1.96 * float(np.std(shares, ddof=1) if len(shares) > 1 else math.nan)
            half /= math.sqrt(len(shares))
            cells += [f"{mean:.1f} %", f"{mean - half:.1f} to {mean + half:.1f}", f"{sum(s > 0.0 for s in shares)}"]
        cells += [str(sum(r.strong_h > 0.0 for r in mine)), f"{np.mean([r.strong_h for r in mine] or [0.0]):.1f}"]
        cells.append(str(sum(r.land_km > 0.0 for r in mine)))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def saved(hours: dict[tuple[str, int], float], way: str) -> list[float]:
    """Return by how much of the fixed waypoints' time each departure was sooner there [%], where both arrived."""
    pairs = [(h, hours.get(("fixed", d), math.inf)) for (w, d), h in hours.items() if w == way]
    return [100.0 * (1.0 - h / fixed) for h, fixed in pairs if math.isfinite(h) and math.isfinite(fixed)]


COLOURS = dict(zip(WAYS, ("black", "tab:gray", "tab:orange", "tab:blue", "tab:cyan", "tab:green"), strict=True))


def draw(rows: Sequence[Row], shown: Voyage, path: Path) -> None:
    """Draw one departure's ways, and of all what each way saves, into a file."""
    import matplotlib.pyplot as plt

    from companion.plots.chart import save

    figure, (chart, left) = plt.subplots(1, 2, figsize=(11.0, 5.0), layout="constrained")
    for row, places in sailed(shown):
        label = f"{row.way}: {row.hours:.0f} h" if math.isfinite(row.hours) else f"{row.way}: not there"
        chart.plot(places[:, 1], places[:, 0], color=COLOURS[row.way], lw=1.6, label=label)
    (x0, x1), (y0, y1) = chart.get_xlim(), chart.get_ylim()
    for land in shown.course.land:
        chart.fill(*land.exterior.xy, color="0.8", zorder=0)
    chart.set_xlim(x0 - 1.0, x1 + 1.0)
    chart.set_ylim(y0 - 1.0, y1 + 1.0)
    chart.set_aspect(1.0 / math.cos(math.radians(0.5 * (y0 + y1))))
    chart.set_xlabel("longitude [deg]")
    chart.set_ylabel("latitude [deg]")
    day = dt.datetime.fromtimestamp(shown.begins, tz=dt.UTC)
    chart.set_title(f"departure {shown.departure}, {day.day} {day:%B}")
    chart.legend(fontsize="small")
    hours = {(r.way, r.departure): r.hours for r in rows}
    for way in WAYS[1:]:
        shares = sorted(saved(hours, way))
        left.plot(shares, np.linspace(0.0, 1.0, len(shares)), color=COLOURS[way], lw=1.8, label=way)
    left.axvline(0.0, color="black", lw=1)
    left.set_xlabel("sooner there than along fixed waypoints [%]")
    left.set_ylabel("share of departures that save no more")
    left.legend()
    save(figure, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Sail the departures that the file does not hold, and print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.forecasts", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--course", choices=[c.name for c in COURSES], default="west")
    parser.add_argument("--departures", type=int, default=50, help="(default: 50)")
    parser.add_argument("--wind", type=Path, nargs="+", metavar="FILE", help="sail in the wind of these files")
    parser.add_argument("--out", type=Path, metavar="FILE.csv", help="keep the rows there")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw what is saved, and one departure")
    parser.add_argument("--show", type=int, default=0, metavar="N", help="the departure that is drawn (default: 0)")
    args = parser.parse_args(argv)
    weather = read_weather(args.wind) if args.wind else None
    course = next(c for c in COURSES if c.name == args.course)

    def voyage(departure: int) -> Voyage:
        return made_voyage(course, departure, args.departures) if weather is None else drawn_voyage(weather, departure)

    held = _read(args.out) if args.out is not None and args.out.exists() else []
    name = "files" if weather else course.name
    for departure in range(args.departures):
        if any((row.course, row.departure) == (name, departure) for row in held):
            continue
        held += [row for row, _ in sailed(voyage(departure))]
        if args.out is not None:
            _write(args.out, held)
    mine = [row for row in held if row.course == name]
    print(table(mine))
    if args.plot is not None:
        draw(mine, voyage(args.show), args.plot)
        print(f"{args.plot}: written")
    return 0


def _read(path: Path) -> list[Row]:
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Row(
                course=cells["course"],
                departure=int(cells["departure"]),
                way=cells["way"],
                **{f.name: float(cells[f.name]) for f in fields(Row)[3:]},
            )
            for cells in csv.DictReader(file)
        ]


def _write(path: Path, rows: Iterable[Row]) -> None:
    names = [f.name for f in fields(Row)]
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(names)
        out.writerows([[getattr(row, name) for name in names] for row in rows])


if __name__ == "__main__":
    sys.exit(main())

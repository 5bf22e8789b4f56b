"""Weeks at sea in closed loop: the real companion sails 1,500 km on the simulated boat, and is killed twenty times.

    python -m lab.weeks --out weeks                          out of Biscay round Finisterre, until she is there
    python -m lab.weeks --out weeks --days 2 --kills 2       as far as she comes in two days

``lab.forecasts`` asks of many departures what a forecast gives, by the integrator that judges passages; here one
departure of the same course is sailed by the program itself: skipper, planner and records, over MAVLink, under the
virtual clock. Her route is laid on the day of departure, in the members of a made-up forecast (``--way forecast``) or
along the waypoints set by hand, without one (``--way fixed``); what blows is the weather that the forecast is of
(``lab.climate``). There are a tide, islands in her way, a ship to meet each half day, and a battery that is low each
night. The records may take ``--budget-mb``. What she sails stays in ``--out``: ``sitl run FOLDER/scenario.toml`` sails
it again.
"""

from __future__ import annotations

import argparse
import datetime as dt
import math
import resource
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.clock import run_virtual
from companion.fold import Step
from companion.geo import MPS_PER_KNOT
from companion.geofence.mission import toml
from companion.messages import CompanionStatus, GeoPoint
from companion.passage import sweep
from companion.passage.frame import GEOD
from companion.passage.mission import goals_of
from companion.telemetry.folder import VoyageArchive
from lab.climate import truth
from lab.forecasts import CANDIDATES, COURSES, HULL_MPS, NODES, SHARE, Course, Voyage, made_voyage
from lab.grib import grib_of
from sitl.run.embedded import run_embedded
from sitl.scenario import (
    CurrentSpec,
    EventSpec,
    ExpectSpec,
    Scenario,
    ScenarioVerdict,
    WindSpec,
    load_scenario,
    scenario_text,
)

DAY_S, HOUR_S = 86_400.0, 3600.0
ENOUGH_DAYS = 20.0  # she is to be there in so many, and called off before she is in fewer
DEPARTURES = 50  # of a year, as those of ``lab.forecasts``
WEATHER_EVERY_S = 6 * HOUR_S
ISLANDS_M = (60e3, 300e3, 600e3, 900e3, 1200e3)  # so far from the start along her way
ISLAND_M, ASIDE_M = 2500.0, 1500.0  # their radius, and how far their middles are off the leg: it leads through them
BAND_M, RADIUS_M = 12_000.0, 2000.0
MARGIN_M, MARGIN_FLOOR_M = 300.0, 100.0
HORIZON_M = 30_000.0
SHIPS_EVERY_S, SHIP_STAYS_S, SHIP_MEETS_S, SHIP_MPS = DAY_S / 2.0, HOUR_S, 900.0, 6.0
FULL_V, LOW_V = 12.4, 10.1  # 93 % of what the simulated battery holds, by night 17 %: low, and not critical
DAWN_H, DUSK_H = 7, 19
WAYS = ("forecast", "fixed")


@dataclass(slots=True)
class Seen:
    """What was seen of a voyage, a row each ``every_s``: day, processor [s], resident [MB], records [MB], left [km]."""

    records: Path
    every_s: float
    tell: Callable[[str], None] = print
    rows: list[tuple[float, ...]] = field(default_factory=list)
    _began_s: float = field(default_factory=time.process_time)

    def look(self, status: CompanionStatus, step: Step) -> None:
        """Take a step of the companion."""
        t_s = step.snapshot.t_s
        if t_s < self.every_s * (1 + len(self.rows)):
            return
        left = math.nan if status.goal_distance_m is None else status.goal_distance_m / 1000.0
        row = (t_s / DAY_S, time.process_time() - self._began_s, resident_mb(), used_mb(self.records), left)
        self.rows.append(row)
        self.tell(line(row, status.goal_index or 0))


def line(row: Sequence[float], goal: int) -> str:
    """Return a row in words."""
    day, cpu_s, resident, records, left = row
    return (
        f"day {day:5.2f}: {cpu_s / 60.0:6.1f} min of a processor, {resident:4.0f} MB, records {records:6.1f} MB, "
        f"{left:5.0f} km to goal {goal + 1}"
    )


def resident_mb() -> float:
    """Return what this process has in memory [MB]."""
    try:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize() / 1e6
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def used_mb(folder: Path) -> float:
    """Return what the files below a folder take [MB]."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def written(folder: Path, way: str, departure: int, days: float, kills: int, course: Course = COURSES[0]) -> Path:
    """Write weather, boat, islands and mission of a departure, and the scenario of it, whose path is returned."""
    voyage = made_voyage(course, departure, DEPARTURES)
    points = route_of(voyage, way)
    land = [*course.land, *islands(points)]
    begins = dt.datetime.fromtimestamp(voyage.begins, dt.UTC)
    times = voyage.begins + np.arange(0.0, days * DAY_S + 2.0 * WEATHER_EVERY_S, WEATHER_EVERY_S)
    [cube] = truth(departure, times, course.box).wind
    tables = {"name": "weeks"} | goals_of(points, [BAND_M] * (len(points) - 1), RADIUS_M)
    tables |= {
        "boat": {"polar": "weeks.csv", "tack_loss_s": 20.0},
        "area": {"obstacles": ["weeks.wkt"], "margin_m": MARGIN_M, "margin_floor_m": MARGIN_FLOOR_M},
        "skipper": {"horizon_m": HORIZON_M},
    }
    scenario = Scenario(
        name="weeks",
        title="Weeks at sea, along a route that was laid on the day of departure",
        mission="weeks.toml",
        limit_s=days * DAY_S,
        begins=begins,
        wind=WindSpec(model="forecast", files=("weeks.grb2",), sd_deg=6.0),
        current=CurrentSpec(set_deg=200.0, drift_mps=0.05, tide_set_deg=70.0, tide_mps=0.25, tide_turns=0.3),
        events=tuple(sorted(events(begins, days, kills), key=lambda event: event.at_s)),
        expect=ExpectSpec(arrived=days >= ENOUGH_DAYS, contacts=0, max_silence_s=60.0, min_vessel_distance_m=50.0),
    )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "weeks.grb2").write_bytes(grib_of(cube))
    (folder / "weeks.csv").write_text(polar_text(), encoding="ascii")
    (folder / "weeks.wkt").write_text("\n".join(shape.wkt for shape in land) + "\n", encoding="ascii")
    (folder / "weeks.toml").write_text(toml(tables), encoding="utf-8")
    path = folder / "scenario.toml"
    path.write_text(scenario_text(scenario), encoding="utf-8")
    return path


def route_of(voyage: Voyage, way: str) -> list[GeoPoint]:
    """Return the waypoints of a departure: those set by hand, or the best in the members of the day's forecast."""
    if way == "fixed":
        return voyage.course.points
    asked = voyage.asked(voyage.forecast(voyage.begins, 0), voyage.course.points[0])
    [found] = sweep(asked, [voyage.begins], 0.0, nodes=NODES, candidates=CANDIDATES)
    return list(found.route.waypoints) or voyage.course.points


def islands(points: Sequence[GeoPoint]) -> list[BaseGeometry]:
    """Return islands that the legs lead through (longitude, latitude), as far along her way as it goes."""
    out: list[BaseGeometry] = []
    begins_m = 0.0
    for a, b in pairwise(points):
        azimuth, _, length_m = GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
        for at_m in (m - begins_m for m in ISLANDS_M):
            if 2.0 * BAND_M < at_m < length_m - 2.0 * BAND_M:
                lon, lat, back = GEOD.fwd(a.lon_deg, a.lat_deg, azimuth, at_m)
                lon, lat, _ = GEOD.fwd(lon, lat, back + 90.0, ASIDE_M)
                ring = [GEOD.fwd(lon, lat, turn, ISLAND_M)[:2] for turn in range(0, 360, 30)]
                out.append(shapely.Polygon([(round(x, 6), round(y, 6)) for x, y in ring]))
        begins_m += length_m
    return out


def events(begins: dt.datetime, days: float, kills: int) -> Iterator[EventSpec]:
    """Return what befalls her: kills evenly over the days, ships from both sides, and the battery's nights."""
    for n in range(kills):
        yield EventSpec(at_s=round((n + 0.7) * days * DAY_S / kills), kind="kill_companion", restart_after_s=30.0)
    for n, ship_s in enumerate(np.arange(0.1 * SHIPS_EVERY_S, days * DAY_S, SHIPS_EVERY_S)):
        yield EventSpec(
            at_s=float(ship_s),
            kind="meeting",
            course_deg=(90.0, 180.0, -90.0, -30.0)[n % 4],
            sog_mps=SHIP_MPS,
            meet_s=SHIP_MEETS_S,
            for_s=SHIP_STAYS_S,
        )
    yield EventSpec(at_s=0.0, kind="battery", volts=FULL_V if DAWN_H <= begins.hour < DUSK_H else LOW_V)
    midnight = begins.replace(hour=0, minute=0, second=0, microsecond=0)
    for day in range(math.ceil(days) + 1):
        for hour, volts in ((DAWN_H, FULL_V), (DUSK_H, LOW_V)):
            at_s = (midnight - begins).total_seconds() + day * DAY_S + hour * HOUR_S
            if 0.0 < at_s < days * DAY_S:
                yield EventSpec(at_s=at_s, kind="battery", volts=volts)


def polar_text() -> str:
    """Return the polar file of the boat of ``lab.forecasts``: 0.65 of AVALON's, no faster than her hull."""
    from companion.boat import avalon

    of, knots = avalon(), (0, 4, 6, 8, 10, 12, 15, 20, 25)
    rows = ["TWA\\TWS;" + ";".join(map(str, knots))]
    for twa_deg in (0, 30, 40, 45, 52, 60, 75, 90, 110, 120, 135, 150, 165, 180):
        speeds = [SHARE * of.speed_mps(math.radians(twa_deg), tws * MPS_PER_KNOT) for tws in knots]
        rows.append(f"{twa_deg};" + ";".join(f"{min(HULL_MPS, mps) / MPS_PER_KNOT:.2f}" for mps in speeds))
    return "\n".join(rows) + "\n"


def sailed(path: Path, records: Path, seed: int, budget_mb: float, seen: Seen) -> ScenarioVerdict:
    """Sail a scenario; its records may take so much."""
    archive = VoyageArchive(folder=records, budget_bytes=round(budget_mb * 1e6))
    return run_virtual(
        run_embedded(load_scenario(path), path, seed, records / "weeks", on_status=seen.look, archive=archive)
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Write the voyage, sail it, and tell what came of it; 1 where something did not hold."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.weeks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="keep voyage and records there")
    parser.add_argument("--way", choices=WAYS, default="forecast", help="how her route is laid (default: forecast)")
    parser.add_argument("--departure", type=int, default=0, metavar="N", help="of fifty in a year (default: 0)")
    parser.add_argument("--days", type=float, default=22.0, help="she is called off then (default: 22)")
    parser.add_argument("--kills", type=int, default=20, help="of the companion, evenly over the days (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="(default: 0)")
    parser.add_argument("--budget-mb", type=float, default=500.0, metavar="MB", help="of all records (default: 500)")
    args = parser.parse_args(argv)
    path = written(args.out, args.way, args.departure, args.days, args.kills)
    seen = Seen(records=args.out / "records", every_s=DAY_S / 8.0, tell=lambda said: print(said, flush=True))
    verdict = sailed(path, args.out / "records", args.seed, args.budget_mb, seen)
    for check in verdict.checks:
        print(f"{'ok  ' if check.passed else 'FAIL'} {check.name}: {check.figure} (required: {check.required})")
    most = max((row[3] for row in seen.rows), default=math.nan)
    print(f"records at most {most:.1f} MB of {args.budget_mb:g}")
    print(f"{time.process_time() / 60.0:.1f} min of a processor, start and all")
    return 0 if verdict.passed and not most > args.budget_mb else 1


if __name__ == "__main__":
    sys.exit(main())

"""Does a forecast help a boat of three knots? Büsser (2009, section 4.2) thought not: no storm is dodged at that speed.

    python -m lab.forecasts                        fifty departures of a year over 1,500 km, five ways to sail each
    python -m lab.forecasts --departures 10 --out rows.csv

Each departure has its own made-up weather (``lab.climate``). She sails 1,500 km of the Atlantic against the westerlies
at 0.65 of AVALON's polar, which makes three to four knots of her,

    direct     along the great circle
    fixed      along waypoints that were laid before in the mean wind of the season, as AVALON was to
    season     planned again every two days in the mean wind of the season, from where she is: no forecast
    forecast   planned again every two days in a new forecast of ten days, behind it the mean wind of the season
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
from pathlib import Path

import numpy as np
import shapely

from companion.boat import Boat, avalon
from companion.messages import GeoPoint
from companion.passage import Craft, Land, Outcome, Passage, PassageFrame, craft_of, plan, sail
from companion.weather import Weather
from lab.climate import Box, forecast, truth, usual

START, GOAL = GeoPoint(lat_deg=51.0, lon_deg=-11.5), GeoPoint(lat_deg=46.5, lon_deg=-31.0)
BOX: Box = (-42.0, 36.0, -2.0, 60.0)
RADIUS_M = 2000.0
FIRST_UTC_S = dt.datetime(2026, 1, 1, tzinfo=dt.UTC).timestamp()
YEAR_S, DAY_S = 365.0 * 86_400.0, 86_400.0
EVERY_S = 2.0 * DAY_S  # she plans again
AHEAD_S = 10.0 * DAY_S  # a forecast knows
MOST_S = 35.0 * DAY_S
STEP_S = 12 * 3600.0
NODES = 30
NO_GO_RAD = math.radians(45.0)
STRONG_MPS = 15.0
SHARE = 0.65  # of AVALON's polar
WAYS = ("direct", "fixed", "season", "forecast", "foresight")


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A departure sailed in one way: days under way (inf: not in 35), hours in a strong wind, miles sailed."""

    departure: int
    way: str
    days: float
    strong_h: float
    distance_nm: float


def sailed(departure: int, of: int) -> list[Row]:
    """Return a departure sailed in all five ways."""
    begins = FIRST_UTC_S + departure * YEAR_S / of
    times = begins + np.arange(0.0, MOST_S + STEP_S, STEP_S)
    true, mean = truth(departure, times, BOX), usual(times, BOX)
    out = []
    laid = _route(_passage(mean, START), begins)
    foreseen = _route(_passage(true, START), begins)
    for way, points in (("direct", [START, GOAL]), ("fixed", laid), ("foresight", foreseen)):
        out.append(_row(departure, way, _along(true, points, begins)))
    for way in ("season", "forecast"):
        out.append(_row(departure, way, _again(departure, way, begins, true, mean)))
    return sorted(out, key=lambda row: WAYS.index(row.way))


def _passage(weather: Weather, here: GeoPoint) -> Passage:
    return Passage(
        start=here,
        goal=GOAL,
        radius_m=RADIUS_M,
        craft=_craft(),
        weather=weather,
        land=Land(shapely.Polygon()),
        frame=PassageFrame(here, GOAL),
    )


def _craft() -> Craft:
    return craft_of(Boat(polar=avalon(), no_go_half_rad=NO_GO_RAD, tack_loss_s=20.0))._replace(share=SHARE)


def _route(asked: Passage, now_s: float) -> list[GeoPoint]:
    """Return the best route from where she is; straight to the goal where none is found."""
    found = plan(asked, now_s, nodes=NODES)
    return list(found.waypoints) if found.outcome is Outcome.FOUND else [asked.start, GOAL]


Leg = tuple[float, float, float]  # seconds, seconds in a strong wind, metres


def _along(true: Weather, points: Sequence[GeoPoint], begins: float) -> Leg:
    [found] = sail(true, _craft(), points, begins, RADIUS_M, true.members)
    return _told(found.rows) if found.arrived else (math.inf, *_told(found.rows)[1:])


def _told(rows: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Leg:
    steps = np.diff(rows[:, 0])
    return float(steps.sum()), float(steps[rows[:-1, 3] > STRONG_MPS].sum()), float(rows[-1, 1])


def _again(departure: int, way: str, begins: float, true: Weather, mean: Weather) -> Leg:
    """Sail a plan of the moment for two days, plan again from there, and so on until she is there."""
    here, now, run = START, begins, 0
    gone_s = strong_s = way_m = 0.0
    while now < begins + MOST_S - EVERY_S:
        believed = mean
        if way == "forecast":
            times = now + np.arange(0.0, AHEAD_S + STEP_S, STEP_S)
            new = forecast(departure, times, BOX, run=run)
            believed = replace(mean, wind=(*new.wind, *mean.wind))
        points = _route(_passage(believed, here), now)
        [found] = sail(true, _craft(), points, now, RADIUS_M, true.members)
        rows = found.rows
        last = len(rows) if rows[-1, 0] <= now + EVERY_S else int(np.searchsorted(rows[:, 0], now + EVERY_S)) + 1
        took_s, strong, length_m = _told(rows[:last])
        gone_s, strong_s, way_m = gone_s + took_s, strong_s + strong, way_m + length_m
        if last == len(rows):
            return (gone_s if found.arrived else math.inf), strong_s, way_m
        lat, lon = found.places[last - 1]
        here, now, run = GeoPoint(lat_deg=float(lat), lon_deg=float(lon)), float(rows[last - 1, 0]), run + 1
    return math.inf, strong_s, way_m


def _row(departure: int, way: str, leg: Leg) -> Row:
    return Row(departure=departure, way=way, days=leg[0] / DAY_S, strong_h=leg[1] / 3600.0, distance_nm=leg[2] / 1852.0)


HEADS = ("way", "arrived", "days, mean", "worst", "less than fixed", "95 %", "faster in", f"h over {STRONG_MPS:g} m/s")


def table(rows: Iterable[Row]) -> str:
    """Return a line for each way; shares are of the same departures sailed along fixed waypoints, a mean of each."""
    held = list(rows)
    days = {(r.way, r.departure): r.days for r in held}
    lines = ["| " + " | ".join(HEADS) + " |", "|---" * len(HEADS) + "|"]
    for way in WAYS:
        mine = [r for r in held if r.way == way]
        there = [r.days for r in mine if math.isfinite(r.days)]
        both = [r for r in mine if math.isfinite(r.days) and math.isfinite(days["fixed", r.departure])]
        shares = [100.0 * (1.0 - r.days / days["fixed", r.departure]) for r in both]
        cells = [way, f"{len(there)} of {len(mine)}"]
        if not there:
            cells += [""] * 5
        else:
            mean, half = float(np.mean(shares)), 1.96 * float(np.std(shares, ddof=1) if len(shares) > 1 else math.nan)
            half /= math.sqrt(len(shares))
            cells += [f"{np.mean(there):.1f}", f"{max(there):.1f}"]
            fixed = way == "fixed"
            cells += (
                ["", "", ""]
                if fixed
                else [f"{mean:.1f} %", f"{mean - half:.1f} to {mean + half:.1f}", f"{sum(s > 0.0 for s in shares)}"]
            )
        cells.append(f"{np.mean([r.strong_h for r in mine]):.1f}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Sail the departures that the file does not hold, and print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.forecasts", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--departures", type=int, default=50, help="of a year (default: 50)")
    parser.add_argument("--out", type=Path, metavar="FILE.csv", help="keep the rows there")
    args = parser.parse_args(argv)
    names = [f.name for f in fields(Row)]
    held: list[Row] = []
    if args.out is not None and args.out.exists():
        with args.out.open(newline="", encoding="utf-8") as file:
            for cells in csv.DictReader(file):
                numbers = {n: float(cells[n]) for n in names[2:]}
                held.append(Row(departure=int(cells["departure"]), way=cells["way"], **numbers))
    for departure in range(args.departures):
        if any(row.departure == departure for row in held):
            continue
        held += sailed(departure, args.departures)
        if args.out is not None:
            with args.out.open("w", newline="", encoding="utf-8") as file:
                out = csv.writer(file, lineterminator="\n")
                out.writerow(names)
                out.writerows([[getattr(row, name) for name in names] for row in held])
    print(table(held))
    return 0


if __name__ == "__main__":
    sys.exit(main())

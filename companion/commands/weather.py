"""``companion weather``: what a forecast holds."""

from __future__ import annotations

import argparse
from argparse import ArgumentTypeError
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import force_option, refuse_existing, write_files
from companion.errors import InputError
from companion.program.arguments import add_command, duration, moment, out_file, picture, place
from companion.words import counted

if TYPE_CHECKING:
    from companion.messages import GeoPoint
    from companion.weather import Box, Weather

_EPILOG = """\
examples:
  companion weather show gfs.grb2
  companion weather show run00.grb2 run12.grb2 --at 50.8,-1.3
  companion weather show ensemble.grb2 stations.toml --at 50.8,-1.3
  companion weather tide stations.toml --at 50.8,-1.3 --from 2026-04-20T00:00Z --to 2026-04-22T00:00Z --out tide.csv
  companion weather tide stations.toml --stream --at 50.8,-1.3 --from 2026-04-20T00:00Z --to 2026-04-22T00:00Z
  companion weather error run00.grb2 run12.grb2 run24.grb2
  companion weather show ensemble.grb2 --box 48,-12,56,2 --at 50,-6 --plot weather.png

Reads GRIB 1 and 2 on grids of latitudes and longitudes: wind of 10 m, gusts, wave heights, surface currents; several
files, runs that overlap (the newest counts, an older one before it, after it and in its holes), ensembles. Simple
packing is read here, every other by the extra `weather`; netCDF 4 and Zarr by the extra `currents`. What ends in .toml
are stations of the tide with their harmonic constants; `tide` makes of them the tables that a mission's [area] tide and
[current] table name. Directions are true: of a wind where it comes from, of a current where it goes.

Exit codes: 0 told, 2 an invalid file, or a place that it says nothing of.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verb."""
    parser = add_command(subparsers, "weather", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="show|tide|error", required=True)
    show = verbs.add_parser("show", help="say what, where, when, how many members, and what is missing")
    show.add_argument("files", metavar="FILE", nargs="+", type=Path)
    show.add_argument("--at", type=place, metavar="LAT,LON", help="tell the hours of one place")
    show.add_argument("--box", type=_box, metavar="S,W,N,E", help="read this part only [deg]; over the date line W > E")
    show.add_argument("--plot", type=picture, metavar="FILE", help="draw wind and gusts, with --at its hours")
    show.add_argument("--time", type=moment, metavar="TIME", help="of the picture's map: 2026-11-24T08:00Z (the first)")
    show.set_defaults(run=_show)
    tide = verbs.add_parser("tide", help="the tide of a place, by its harmonic constants, as a table for a mission")
    tide.add_argument("files", metavar="STATIONS", nargs="+", type=Path)
    tide.add_argument("--at", type=place, metavar="LAT,LON", required=True, help="of this place")
    tide.add_argument("--from", dest="begins", type=moment, metavar="TIME", required=True, help="from this time")
    tide.add_argument("--to", dest="ends", type=moment, metavar="TIME", required=True, help="to this one")
    tide.add_argument("--every", type=duration, default=600.0, metavar="10m", help="a row every (10m)")
    tide.add_argument(
        "--stream", action="store_true", help="set and drift, for [current] table (height, for [area] tide)"
    )
    tide.add_argument("--out", metavar="CSV", type=out_file, help="write it there (it is printed)")
    force_option(tide)
    tide.set_defaults(run=_tide)
    error = verbs.add_parser("error", help="by how much successive runs are off, as a passage's [weather] is dressed")
    error.add_argument("files", metavar="RUN", nargs="+", type=Path, help="a run in each file, two at the least")
    error.add_argument("--box", type=_box, metavar="S,W,N,E", help="read this part only [deg]")
    error.set_defaults(run=_error)


def _box(text: str) -> Box:
    try:
        south, west, north, east = (float(part) for part in text.split(","))
    except ValueError:
        raise ArgumentTypeError(f"{text[:40]!r} is no box; write SOUTH,WEST,NORTH,EAST in degrees") from None
    if not (-90.0 <= south < north <= 90.0 and -180.0 <= west <= 360.0 and -180.0 <= east <= 360.0 and west != east):
        raise ArgumentTypeError(f"{text[:40]} is no box; write SOUTH,WEST,NORTH,EAST in degrees, south below north")
    return (west, south, east + 360.0 * (east < west), north)


def _show(args: argparse.Namespace) -> int:
    from companion.weather import read_weather, told_at, told_of

    at: GeoPoint | None = args.at
    weather = read_weather(args.files, args.box)
    names = ", ".join(map(str, args.files))
    cubes = [*weather.wind, *weather.gust, *weather.waves, *weather.current]
    if not (cubes or weather.tides):
        where = " there" if args.box is not None else ""
        raise InputError(
            names,
            "",
            f"holds no wind of 10 m, no gust, no waves and no current{where}"
            + "".join(f"; {note}" for note in weather.notes[:3]),
            "ask for 10u and 10v of the area",
        )
    if at is not None and not weather.covers(at.lat_deg, at.lon_deg):
        raise InputError(names, "--at", f"{at.lat_deg:g}, {at.lon_deg:g} is outside of it", "ask within its area")
    for line in told_of(weather):
        print(line)
    if at is not None:
        for line in told_at(weather, at.lat_deg, at.lon_deg):
            print(line)
    if args.plot is not None:
        _plot(args, weather, names)
    return 0


MOST_ROWS = 20_000  # as a mission's tables are believed


def _tide(args: argparse.Namespace) -> int:
    """Print or write the tide of a place as a table over time."""
    import numpy as np

    from companion.weather import read_weather

    at: GeoPoint = args.at
    names = ", ".join(map(str, args.files))
    begins, ends = args.begins.timestamp(), args.ends.timestamp()
    if ends <= begins:
        raise InputError("companion weather tide", "--to", "is not later than --from", "write the earlier time first")
    if args.every < 60.0 or (ends - begins) / args.every > MOST_ROWS - 1:
        raise InputError(
            "companion weather tide",
            "--every",
            f"makes rows nearer than a minute, or more than {MOST_ROWS}",
            "say another",
        )
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    weather = read_weather(args.files)
    times = np.arange(begins, ends + 1e-6, args.every)
    if args.stream:
        found = weather.current_en_mps(times, at.lat_deg, at.lon_deg)
    else:
        found = weather.tide_m(times, at.lat_deg, at.lon_deg)[:, None]
    if np.isnan(found).any():
        what = "stream" if args.stream else "height"
        raise InputError(
            names, "--at", f"no {what} of a tide is known there for all of that time", "ask nearer to a station"
        )
    rows = ["time, set_deg, drift_mps" if args.stream else "time, height_m"]
    for t, row in zip(times.tolist(), found.tolist(), strict=True):
        when = f"{datetime.fromtimestamp(t, UTC):%Y-%m-%dT%H:%M:%SZ}"  # a table of every 90 s has seconds
        if args.stream:
            east, north = row
            set_deg = float(np.degrees(np.arctan2(east, north)) % 360.0)
            rows.append(f"{when}, {set_deg:.1f}, {float(np.hypot(east, north)):.3f}")
        else:
            rows.append(f"{when}, {row[0]:.3f}")
    if args.out is None:
        print("\n".join(rows))
    else:
        key = "[current] table" if args.stream else "[area] tide"
        write_files({str(args.out): ("\n".join(rows) + "\n").encode()}, force=args.force)
        print(f"{args.out}: written, {counted(len(rows) - 1, 'row')}: name it in {key} of a mission")
    return 0


def _error(args: argparse.Namespace) -> int:
    """Print by how much runs are off, held against the beginnings of later ones, and the keys of a passage for it."""
    from companion.weather import errors_of, fitted, read_weather

    runs = [read_weather([path], args.box) for path in args.files]
    for path, run in zip(args.files, runs, strict=True):
        if not run.wind:
            raise InputError(str(path), "", "holds no wind of 10 m", "name runs of a forecast of wind")
    errors = errors_of(runs)
    try:
        error = fitted(errors)
    except ValueError as problem:
        names = ", ".join(map(str, args.files))
        remedy = "name three runs or more of one area, each longer than the time between them"
        raise InputError(names, "", f"{problem} at which a run meets a later one", remedy) from None
    print("lead [h]  off by [m/s]  members' spread [m/s]  (of a component)")
    for lead in sorted({round(float(row[0])) for row in errors}):
        here = errors[abs(errors[:, 0] - lead) < 1.0]
        print(f"{lead / 3600.0:7.1f}  {here[:, 1].mean() ** 0.5:12.2f}  {here[:, 2].mean() ** 0.5:21.2f}")
    print("what members do not explain of it, for a passage's file:")
    print(f"[weather]\nerror_mps = {error.now_mps:.2f}\nerror_mps_per_day = {error.per_day_mps:.2f}")
    return 0


def _plot(args: argparse.Namespace, weather: Weather, names: str) -> None:
    from companion.commands.output import patience
    from companion.plots.weather import save_weather

    if not weather.wind:
        raise InputError(names, "", "holds no wind to draw", "ask for 10u and 10v of the area")
    cube = weather.wind[-1]  # of the widest area
    utc_s = cube.utc_s[0] if args.time is None else args.time.timestamp()
    if not cube.utc_s[0] <= utc_s <= cube.utc_s[-1]:
        raise InputError(names, "--time", "is not within it", "say another, or leave it out for its first")
    with patience("drawing"):
        save_weather(weather, float(utc_s), args.at, args.plot)
    print(f"{args.plot}: written")

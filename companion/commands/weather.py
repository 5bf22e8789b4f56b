"""``companion weather``: what a forecast holds."""

from __future__ import annotations

import argparse
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING

from companion.errors import InputError
from companion.program.arguments import add_command, moment, picture, place

if TYPE_CHECKING:
    from companion.messages import GeoPoint
    from companion.weather import Box, Weather

_EPILOG = """\
examples:
  companion weather show gfs.grb2
  companion weather show run00.grb2 run12.grb2 --at 50.8,-1.3
  companion weather show ensemble.grb2 --box 48,-12,56,2 --at 50,-6 --plot weather.png

Reads GRIB 1 and 2 on grids of latitudes and longitudes: wind of 10 m, gusts, wave heights, surface currents; several
files, runs that overlap (the newest counts, an older one before it, after it and in its holes), ensembles. Simple
packing is read here, every other by the extra `weather`. Directions are true: of a wind where it comes from, of a
current where it goes.

Exit codes: 0 told, 2 a file that cannot be believed, or a place that it says nothing of.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verb."""
    parser = add_command(subparsers, "weather", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="show", required=True)
    show = verbs.add_parser("show", help="say what, where, when, how many members, and what is missing")
    show.add_argument("files", metavar="FILE", nargs="+", type=Path)
    show.add_argument("--at", type=place, metavar="LAT,LON", help="tell the hours of one place")
    show.add_argument("--box", type=_box, metavar="S,W,N,E", help="read this part only [deg]; over the date line W > E")
    show.add_argument("--plot", type=picture, metavar="FILE", help="draw wind and gusts, with --at its hours")
    show.add_argument("--time", type=moment, metavar="TIME", help="of the picture's map: 2026-11-24T08:00Z (the first)")
    show.set_defaults(run=_show)


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
    cubes = (*weather.wind, *weather.gust, *weather.waves, *weather.current)
    if not cubes:
        where = " there" if args.box is not None else ""
        raise InputError(
            names,
            "",
            f"holds no wind of 10 m, no gust, no waves and no current{where}"
            + "".join(f"; {note}" for note in weather.notes[:3]),
            "ask for 10u and 10v of the area",
        )
    if at is not None and not any(cube.covers(at.lat_deg, at.lon_deg) for cube in cubes):
        raise InputError(names, "--at", f"{at.lat_deg:g}, {at.lon_deg:g} is outside of it", "ask within its area")
    for line in told_of(weather):
        print(line)
    if at is not None:
        for line in told_at(weather, at.lat_deg, at.lon_deg):
            print(line)
    if args.plot is not None:
        _plot(args, weather, names)
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

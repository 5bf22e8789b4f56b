"""``companion passage``: where to go in a forecast, and when."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.commands.output import force_option, patience, refuse_existing, write_files
from companion.errors import InputError, JobError
from companion.program.arguments import add_command, duration, moment, number, out_file, picture, place, system_id

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from companion.messages import GeoPoint
    from companion.passage import Departure, Energy, Passage, Route
    from companion.passage.file import PassageFile
    from companion.weather import Weather

_EPILOG = """\
examples:
  companion passage plan biscay.toml
  companion passage plan biscay.toml --plot biscay.png --out mission.toml
  companion passage plan biscay.toml --depart 2026-04-20T00:00Z..2026-04-22T00:00Z --every 6h --explain
  companion passage again biscay.toml mission.toml --forecast run18.grb2 --from 47.1,-6.3 --now 2026-04-20T18:00Z
  companion passage again biscay.toml mission.toml --forecast run18.grb2 --from 47.1,-6.3 --measured voyages/one
  companion passage again biscay.toml mission.toml --folder forecasts --from 47.1,-6.3 --far-key far.key --far-out r.sbd

PASSAGE.toml names start, goal, departure, forecasts in GRIB, boat and land; its keys are in docs/reference/formats.md.
Of one forecast the route is the fastest, with a time that no way can be faster than; of an ensemble the one that all
its members sail well, as surely as [depart] sure asks. Ashore, before she sails.

Exit codes: 0 planned, 1 no way was found, 2 an invalid file.
"""


NODES = 120  # from start to goal, of the first search
CANDIDATES = 7  # members whose own best routes are tried for one departure


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verb."""
    parser = add_command(subparsers, "passage", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="plan|again", required=True)
    plan = verbs.add_parser("plan", help="the fastest way through a forecast, with a bound below every way")
    plan.add_argument("file", metavar="PASSAGE.toml", type=Path)
    plan.add_argument(
        "--out",
        metavar="M",
        type=out_file,
        help="write the route as a mission with a band about each leg; M.passage.json beside it is what pages draw",
    )
    plan.add_argument(
        "--plot", metavar="FILE", type=picture, help="draw the route, isochrones and her wind, or the departures"
    )
    plan.add_argument(
        "--depart",
        type=_window,
        metavar="FROM..TO",
        help="compare departures: 2026-04-20T00:00Z..2026-04-22T00:00Z, sailed in every member of the forecast",
    )
    plan.add_argument("--every", type=duration, default=21_600.0, metavar="6h", help="of --depart (6h)")
    plan.add_argument(
        "--by", type=moment, metavar="TIME", help="she is to be there by then ([depart] by): the chance of it"
    )
    plan.add_argument("--explain", action="store_true", help="with --depart, what waiting costs and what is against it")
    _far_options(plan)
    force_option(plan)
    plan.set_defaults(run=_plan)
    again = verbs.add_parser("again", help="a new forecast: is the route under way still the one to sail")
    again.add_argument("file", metavar="PASSAGE.toml", type=Path)
    again.add_argument("mission", metavar="MISSION.toml", type=Path, help="what she sails, as plan --out wrote it")
    again.add_argument("--from", dest="here", type=place, metavar="LAT,LON", help="where she is ([start])")
    again.add_argument("--now", type=moment, metavar="TIME", help="the hour ([depart] at)")
    again.add_argument(
        "--forecast",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="in place of [weather] files; more may be given",
    )
    again.add_argument(
        "--folder", type=Path, metavar="DIR", help="where forecasts are dropped: of all in it the newest run counts"
    )
    _far_options(again)
    again.add_argument(
        "--measured",
        type=Path,
        metavar="VOYAGE|CSV",
        help="the wind that she measured, by which the first hours of the forecast are corrected: the folder of her"
        " voyage, or lines of time, lat, lon, from_deg, speed_mps",
    )
    again.add_argument("--by", type=moment, metavar="TIME", help="she is to be there by then ([depart] by)")
    again.add_argument(
        "--faster",
        type=number("percent", at_least=0.0, at_most=50.0),
        default=3.0,
        metavar="PERCENT",
        help="what another route must gain of the time that is left (3)",
    )
    again.add_argument(
        "--out", metavar="M", type=out_file, help="write the new route as a mission, if it is to be sailed"
    )
    force_option(again)
    again.set_defaults(run=_again)


def _far_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--far-out", type=out_file, metavar="SBD", help="the route in 270 bytes, for `companion far route`"
    )
    parser.add_argument("--far-key", type=Path, metavar="FILE", help="of --far-out: the key, as on board")
    parser.add_argument("--system", type=system_id, default=1, metavar="N", help="of --far-out: the boat's (1)")


def _check_far(args: argparse.Namespace) -> None:
    if (args.far_out is None) != (args.far_key is None):
        raise InputError(f"companion passage {args.verb}", "--far-out", "and --far-key go together", "say both")
    if args.far_out is not None:
        refuse_existing([str(args.far_out)], force=args.force)


def _write_far(
    args: argparse.Namespace, asked: PassageFile, passage: Passage, route: Route, of: Departure | None
) -> None:
    """Write a route as the bytes of one message to the boat, with its key's code."""
    from companion.mavlink.signing import read_key
    from companion.orders.far import MIDDLE_S, FarKey, FarPlace, FarRoute, pack_route
    from companion.passage import shown
    from companion.passage.mission import arrivals_s, mission_of

    runs = () if route.sailed is None else (route.sailed,) if of is None else of.runs
    low, high = shown(1 if of is None else of.members)
    goals = mission_of(route, passage, asked.name)["goal"]
    places = []
    for k, (point, (early, middle, late)) in enumerate(
        zip(route.waypoints, arrivals_s(runs, route.waypoints, (low, 0.5, high)), strict=True)
    ):
        known = middle if math.isfinite(middle) else None
        places.append(
            FarPlace(
                point=point,
                band_m=float(goals[k - 1]["bandwidth_m"]) if k else 0.0,
                middle_s=known,
                early_s=0.0 if known is None else known - early,
                late_s=0.0 if known is None else late - known if math.isfinite(late) else 1e9,
            )
        )
    far = FarRoute(
        departs_utc_s=route.depart_utc_s,
        base_utc_s=passage.weather.base_utc_s(route.depart_utc_s),
        members=len(passage.weather.members),
        places=tuple(places),
    )
    data = pack_route(far, FarKey(read_key(args.far_key), args.system))
    write_files({str(args.far_out): data}, force=args.force)
    print(f"{args.far_out}: written, {len(data)} bytes, hours to {MIDDLE_S / 60.0:g} minutes: {data.hex()}")


def _dropped(folder: Path) -> tuple[str, ...]:
    """Return the whole files of a folder of forecasts. Raises InputError where it holds none."""
    if not folder.is_dir():
        raise InputError(str(folder), "", "is no folder", "name the one that forecasts are dropped into")
    parts = {".part", ".tmp", ".new"}
    names = [p for p in sorted(folder.iterdir()) if p.name[0] != "." and p.suffix not in parts]
    if not names:
        raise InputError(str(folder), "", "holds no forecast", "drop one into it")
    return tuple(map(str, names))


def _again(args: argparse.Namespace) -> int:
    """Hold what she sails against a new forecast, print both; write the new route where it is worth the change."""
    from companion.compose import speed_error_of
    from companion.geofence import load_mission
    from companion.passage import again, shares_of, sweep
    from companion.passage.told import told_of, told_of_again
    from companion.weather.told import told_of_age

    _refuse_out(args)
    _check_far(args)
    if args.folder is not None and args.forecast:
        raise InputError("companion passage again", "--folder", "and --forecast do not go together", "say one of them")
    forecasts = tuple(map(str, args.forecast)) if args.folder is None else _dropped(args.folder)
    mission = load_mission(args.mission)
    points = [mission.start or mission.origin, *(goal.point for goal in mission.goals)]
    asked, passage = _read(args.file, None if args.now is None else args.now.timestamp(), args.here, forecasts, "--now")
    last, end = passage.frame.xy_from_geo(
        *zip(*((p.lat_deg, p.lon_deg) for p in (points[-1], passage.goal)), strict=True)
    )
    off_m = math.dist(last, end)
    if off_m > passage.frame.length_m:  # a route that was sent in part ends before the goal, nearer to it than she is
        raise InputError(
            str(args.mission),
            "[[goal]]",
            f"the last one is {off_m / 1000.0:.0f} km from where {args.file} leads, farther than she is",
            "name the mission that `companion passage plan --out` wrote of it",
        )
    now = (args.now or asked.depart.at).timestamp()
    print(told_of_age(passage.weather, now))
    if args.measured is not None:
        passage = _as_measured(passage, args.measured, now)
    by, error = _by(args, asked, now), speed_error_of(asked.boat)
    by_s, sure = math.inf if by is None else by, asked.depart.sure
    with patience("planning"):
        [new] = sweep(passage, [now], error, nodes=NODES, by_utc_s=by_s, sure=sure, candidates=CANDIDATES)
        found = again(passage, points, new, shares_of(error), by_utc_s=by_s, sure=sure, faster=args.faster / 100.0)
    for line in told_of_again(found, by, sure):
        print(line)
    if not found.chosen.runs:
        return JobError.exit_code
    for line in told_of(found.chosen.route, found.chosen):
        print(line)
    if args.far_out is not None:
        _write_far(args, asked, passage, found.chosen.route, found.chosen)
    if args.out is not None and found.is_changed:
        _write_mission(args, asked, passage, found.chosen.route, found.chosen)
    return 0


def _as_measured(passage: Passage, path: Path, now_s: float) -> Passage:
    """Return it in a forecast whose first hours are corrected by what she measured; print by how much."""
    from dataclasses import replace

    from companion.telemetry.winds import measured_wind
    from companion.weather import corrected, off_by
    from companion.weather.told import told_of_off

    off = off_by(passage.weather, measured_wind(path), now_s)
    if off is None:
        print(f"{path}: no wind of the 12 h before now that the forecast knows of: it stands as it is")
        return passage
    print(told_of_off(off))
    return replace(passage, weather=corrected(passage.weather, off))


MOST_DEPARTURES = 200


def _window(text: str) -> tuple[float, float]:
    first, dots, last = text.partition("..")
    if not dots:
        raise argparse.ArgumentTypeError(f"{text[:50]!r} is no span; write FROM..TO, both as 2026-04-20T00:00Z")
    begins, ends = moment(first).timestamp(), moment(last).timestamp()
    if ends <= begins:
        raise argparse.ArgumentTypeError(f"{text[:50]} ends before it begins; write the earlier time first")
    return begins, ends


def _sweep(args: argparse.Namespace) -> int:
    """Compare departures, print what each comes to."""
    import numpy as np

    from companion.compose import speed_error_of
    from companion.passage import best, sweep
    from companion.passage.told import explained, told_of_departures

    begins, ends = args.depart
    count = int((ends - begins) / args.every) + 1
    if count > MOST_DEPARTURES:
        raise InputError("companion passage plan", "--every", f"makes {count} departures of it", "say a longer time")
    asked, passage = _read(args.file, departs_utc_s=begins)
    by = _by(args, asked, begins)
    with patience("planning"):
        departures = sweep(
            passage,
            (begins + args.every * np.arange(count)).tolist(),
            speed_error_of(asked.boat),
            nodes=NODES // 2,
            by_utc_s=math.inf if by is None else by,
            sure=asked.depart.sure,
        )
    for line in told_of_departures(departures, by):
        print(line)
    if args.explain:
        for line in explained(departures, by):
            print(line)
    if args.plot is not None:
        from companion.plots.passage import save_departures

        with patience("drawing"):
            save_departures(departures, by, asked.name or args.file.stem, args.plot)
        print(f"{args.plot}: written")
    return 0 if best(departures, math.inf if by is None else by) is not None else JobError.exit_code


def _by(args: argparse.Namespace, asked: PassageFile, departs_s: float = -math.inf) -> float | None:
    """Return until when she is to be there [Unix s], None where nobody says.

    Raises InputError where that is asked for by ``--by`` and she departs no sooner.
    """
    by = asked.depart.by if args.by is None else args.by
    if args.by is not None and args.by.timestamp() <= departs_s:
        from companion.weather import iso

        said = f"{iso(args.by.timestamp())} is not after {iso(departs_s)}, when she departs"
        raise InputError("--by", "", said, "say a later time")
    return None if by is None else by.timestamp()


def _in_all(args: argparse.Namespace, asked: PassageFile, passage: Passage) -> Departure:
    """Print what an ensemble makes of a departure; return it."""
    from companion.compose import speed_error_of
    from companion.passage import sweep
    from companion.passage.told import told_of, told_of_chances

    by = _by(args, asked)
    [found] = sweep(
        passage,
        [asked.depart.at.timestamp()],
        speed_error_of(asked.boat),
        nodes=NODES,
        by_utc_s=math.inf if by is None else by,
        sure=asked.depart.sure,
        candidates=CANDIDATES,
    )
    for line in (*told_of(found.route, found), *told_of_chances(found, by, asked.depart.sure)):
        print(line)
    return found


def _plan(args: argparse.Namespace) -> int:
    from companion.passage import plan
    from companion.passage.told import told_of

    _check_far(args)
    if args.depart is not None:
        if args.out is not None or args.far_out is not None:
            raise InputError(
                "companion passage plan", "--depart", "writes no mission", "plan the best of them with --out"
            )
        return _sweep(args)
    if args.explain:
        raise InputError("companion passage plan", "--explain", "is of a --depart FROM..TO", "say it, too")
    _refuse_out(args)
    asked, passage = _read(args.file)
    if len(passage.weather.members) > 1 or _by(args, asked, asked.depart.at.timestamp()) is not None:
        with patience("planning"):
            found: Departure | None = _in_all(args, asked, passage)
        assert found is not None
        route = found.route
    else:
        found = None
        with patience("planning"):
            route = plan(passage, asked.depart.at.timestamp(), nodes=NODES)
        for line in told_of(route):
            print(line)
    if args.plot is not None and route.waypoints:
        from companion.plots.passage import save_passage

        with patience("drawing"):
            save_passage(passage, route, asked.name or args.file.stem, args.plot, found)
        print(f"{args.plot}: written")
    if not math.isfinite(route.time_s):
        return JobError.exit_code
    if args.far_out is not None:
        _write_far(args, asked, passage, route, found)
    if args.out is not None:
        _write_mission(args, asked, passage, route, found)
    return 0


def _read(
    path: Path,
    departs_utc_s: float | None = None,
    here: GeoPoint | None = None,
    forecasts: tuple[str, ...] = (),
    departs: str = "--depart",
) -> tuple[PassageFile, Passage]:
    """Return what a file asks, with the boat, forecasts and land that it names; ``here`` in place of its start.

    ``departs``: the option that ``departs_utc_s`` is of.
    """
    import msgspec

    from companion.compose import polar_named, sailed_boat
    from companion.geofence.formats import decode, read_bytes
    from companion.geofence.mission import with_boat_file
    from companion.messages import GeoPoint
    from companion.passage import Passage, PassageFrame, craft_of, land_of
    from companion.passage.file import PlaceOptions, parse_passage
    from companion.weather import read_weather

    source = str(path)
    text = decode(read_bytes(path, max_bytes=1 << 20), source)
    asked = parse_passage(text, source)
    asked = msgspec.structs.replace(asked, boat=with_boat_file(asked.boat, text, path))
    if here is not None:
        asked = msgspec.structs.replace(asked, start=PlaceOptions(lat=here.lat_deg, lon=here.lon_deg))
    if forecasts:
        files = tuple(str(Path(name).resolve()) for name in forecasts)
        asked = msgspec.structs.replace(asked, weather=msgspec.structs.replace(asked.weather, files=files))
    start, goal = (GeoPoint(lat_deg=p.lat, lon_deg=p.lon) for p in (asked.start, asked.goal))
    try:
        frame = PassageFrame(start, goal)
    except ValueError as error:
        raise InputError(source, "[goal]", str(error), "look at both") from None
    if frame.length_m < 2.0 * asked.goal.radius_m:
        raise InputError(source, "[goal] radius_m", "reaches to the start", "say a smaller one")
    box = _box(frame)
    weather = read_weather([path.parent / name for name in asked.weather.files], box)
    depart = asked.depart.at.timestamp() if departs_utc_s is None else departs_utc_s
    _check_weather(
        asked,
        weather,
        source,
        depart,
        start="[start]" if here is None else "--from",
        place="[depart] at" if departs_utc_s is None else departs,
    )
    weather = _doubted(asked, weather)
    craft = craft_of(
        sailed_boat(asked.boat, polar_named(asked.boat, path)),
        board_m=asked.sailing.board_m,
        night_share=asked.sailing.night_share,
        max_wave_m=math.inf if asked.limits.max_wave_m is None else asked.limits.max_wave_m,
        lee_tws_mps=asked.limits.lee_tws_mps,
    )
    land = land_of(frame, _solids(asked, path), box, asked.area.margin_m)
    for where, point in (("[start]" if here is None else "--from", start), ("[goal]", goal)):
        if float(land.distance_m(frame.xy_from_geo([point.lat_deg], [point.lon_deg]))[0]) <= 0.0:
            raise InputError(
                source, where, "is on land, in closed water or within [area] margin_m of it", "move it out to sea"
            )
    return asked, Passage(
        start=start,
        goal=goal,
        radius_m=asked.goal.radius_m,
        craft=craft,
        weather=weather,
        land=land,
        frame=frame,
        lee_shore_m=asked.limits.lee_shore_m or 0.0,
        energy=_energy(asked),
    )


def _doubted(asked: PassageFile, weather: Weather) -> Weather:
    """Return a forecast dressed with its error, and gone on with the wind of the season, where the file says so."""
    from companion.weather import Climate, ForecastError, continued, dressed, iso
    from companion.words import counted

    said, season = asked.weather, asked.climate
    if said.error_mps or said.error_mps_per_day:
        error = ForecastError(now_mps=said.error_mps, per_day_mps=said.error_mps_per_day)
        weather = dressed(weather, error)
        print(f"dressed with its own error: {counted(len(weather.members), 'member')}, wider with the age of the run")
    if season is not None:
        towards = math.radians(season.from_deg) + math.pi
        mean = (season.mean_mps * math.sin(towards), season.mean_mps * math.cos(towards))
        last = max(float(cube.utc_s[-1]) for cube in weather.wind)
        climate = Climate(wind_en_mps=mean, spread_mps=season.spread_mps)
        weather = continued(weather, climate, last + season.days * 86_400.0)
        print(f"from {iso(last)} on it is climatology, and no forecast")
    return weather


def _energy(asked: PassageFile) -> Energy | None:
    from companion.passage import Energy

    said = asked.energy
    if said is None:
        return None
    return Energy(
        battery_wh=said.battery_wh,
        start_wh=said.battery_wh * said.start_percent / 100.0,
        reserve_wh=said.battery_wh * said.reserve_percent / 100.0,
        solar_w=said.solar_w,
        day_w=said.day_w,
        night_w=said.day_w if said.night_w is None else said.night_w,
    )


def _box(frame: Any) -> tuple[float, float, float, float]:
    """Return the box (west, south, east, north) of the widest search, a little more."""
    import numpy as np

    from companion.passage.plan import widest_rooms_m

    side, ends = widest_rooms_m(frame.length_m)
    edge = np.linspace(0.0, 1.0, 60)
    x = -ends + edge * (frame.length_m + 2.0 * ends)
    y = -side + edge * 2.0 * side
    ring = np.concatenate(
        [
            np.stack(np.broadcast_arrays(a, b), axis=-1)
            for a, b in ((x, y[0]), (x, y[-1]), (x[0], y), (x[-1], y), (x, 0.0))
        ]
    )
    lat, lon = frame.geo_from_xy(ring)
    lon = frame.start.lon_deg + np.mod(lon - frame.start.lon_deg + 180.0, 360.0) - 180.0
    return (
        float(lon.min()) - 0.5,
        max(-90.0, float(lat.min()) - 0.5),
        float(lon.max()) + 0.5,
        min(90.0, float(lat.max()) + 0.5),
    )


def _check_weather(
    asked: PassageFile,
    weather: Weather,
    source: str,
    depart: float,
    *,
    start: str = "[start]",
    place: str = "[depart] at",
) -> None:
    """Raise InputError where the forecast knows no wind at the start when she departs.

    ``start`` and ``place``: where it is said from where she sails, and when.
    """
    from companion.weather import iso

    names = ", ".join(asked.weather.files)
    if not weather.wind:
        raise InputError(source, f"[weather] {names}", "holds no wind of 10 m here", "ask for 10u and 10v of the area")
    for where, point in ((start, asked.start), ("[goal]", asked.goal)):
        if not any(cube.covers(point.lat, point.lon) for cube in weather.wind):
            raise InputError(source, where, f"is outside the area of {names}", "ask for a larger area")
    if asked.limits.max_wave_m is not None and not weather.waves:
        raise InputError(source, "[limits] max_wave_m", f"{names} says nothing of waves", "add a forecast of them")
    if asked.limits.lee_shore_m is not None and not asked.area.obstacles:
        raise InputError(source, "[limits] lee_shore_m", "there is no shore", "name one in [area] obstacles")
    why = weather.why_unknown(depart, asked.start.lat, asked.start.lon)
    if why:
        said = f"the wind at {start} is not known at {iso(depart)}: {why}"
        raise InputError(source, place, said, "say another time, or give a forecast of it")


def _solids(asked: PassageFile, path: Path) -> list[BaseGeometry]:
    """Return the polygons (lon, lat) of the files that ``[area] obstacles`` names."""
    from companion.geofence import ZoneKind, read
    from companion.geofence.shapes import drawn

    out: list[BaseGeometry] = []
    for name in asked.area.obstacles:
        file = path.parent / name
        if not file.is_file():
            raise InputError(str(path), f"[area] obstacles {name}", "no such file", "paths are relative to this file")
        document = read(file, kind=ZoneKind.EXCLUSION, axis=asked.area.axis, areas=True, far_m=math.inf).require_clean()
        zones = [z for z in document.zones if z.kind is ZoneKind.EXCLUSION]
        if not zones:
            raise InputError(str(file), "", "holds no polygon", "give land or closed water as areas")
        out += [drawn(zone) for zone in zones]
    return out


def _refuse_out(args: argparse.Namespace) -> None:
    """Raise InputError where a mission, or the passage that is drawn beside it, is there and nobody said --force."""
    from companion.geofence.mission import planned_beside

    if args.out is not None:
        refuse_existing([str(args.out), str(planned_beside(args.out))], force=args.force)


def _write_mission(
    args: argparse.Namespace, asked: PassageFile, passage: Passage, route: Route, of: Departure | None
) -> None:
    """Write a route as a mission, and beside it as what page and editor draw of it."""
    import msgspec

    from companion import __version__
    from companion.geofence.mission import planned_beside
    from companion.view.planned import planned_of

    beside = planned_beside(args.out)
    planned = planned_of(
        passage,
        route,
        asked.name or args.file.stem,
        of,
        version=__version__,
        by_utc_s=_by(args, asked),
        sure=asked.depart.sure,
    )
    files = {
        str(args.out): _mission_text(asked, passage, route, args.file, args.out),
        str(beside): msgspec.json.encode(planned),
    }
    write_files(files, force=args.force)
    print(f"{args.out}: written: companion mission check {args.out}")
    print(f"{beside}: written, to be drawn on the live page and in the editor")


def _mission_text(asked: PassageFile, passage: Passage, route: Route, path: Path, out: Path) -> bytes:
    """Return the mission file of a route; what it names lies where the passage's file has it."""
    import os

    from companion.geofence.mission import toml, without_defaults
    from companion.passage.mission import mission_of

    def named(name: str) -> str:
        return Path(os.path.relpath(path.parent / name, out.parent)).as_posix()

    tables = mission_of(route, passage, asked.name or path.stem)
    boat = without_defaults(asked.boat)
    for key in ("file", "polar"):
        if isinstance(boat.get(key), str) and ("." in boat[key] or "/" in boat[key]):
            boat[key] = named(boat[key])
    area = without_defaults(asked.area)
    if asked.area.obstacles:
        area["obstacles"] = [named(name) for name in asked.area.obstacles]
    tables |= {key: table for key, table in (("boat", boat), ("area", area)) if table}
    return toml(tables).encode()

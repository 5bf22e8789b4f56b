"""``companion chart``: charts become the obstacles and the fence of a mission."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import force_option, refuse_existing, write_files
from companion.errors import InputError, JobError, unreadable
from companion.program.arguments import add_command, moment, number, place
from companion.words import counted, file_name, listed

if TYPE_CHECKING:
    from companion.chart import Chart, ChartArea, Wanted
    from companion.current import TideRow
    from companion.geofence.mission import MissionOptions
    from companion.messages import GeoPoint

_EPILOG = """\
examples:
  companion chart import US4MD81M.000 --mission missions/bay.toml
  companion chart import cells/*.000 land.gpkg --around 38.97,-76.47 --radius 3000 --depth 1.5
  companion chart shoals voyages/bay.state.json found.geojson --mission missions/bay.toml
  companion chart import gebco.nc emodnet.asc --mission passage.toml --out chart

Reads S-57 cells (.000, with the updates .001 ... beside them), shapefiles, GeoPackages, GeoJSON and FlatGeobuf of land,
OSM extracts with seamarks (.osm, .pbf), grids of depths (GeoTIFF, netCDF, .asc). What it writes is what [area] of a
mission and `companion fence` read; each obstacle says why it is one, and what chart says so.

Nothing that it writes is fit for navigation.
Exit codes: 0 written, 1 written but a place of the mission is not in free water, 2 an invalid file.
"""
WITHIN_M = 2000.0  # beyond a mission's farthest place
MOST_M = 50_000.0


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verb."""
    parser = add_command(subparsers, "chart", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="import|shoals", required=True)
    load = verbs.add_parser("import", help="make obstacles and a fence of charts")
    load.add_argument("files", metavar="FILE", nargs="+")
    where = load.add_mutually_exclusive_group(required=True)
    where.add_argument("--mission", metavar="M", help="the mission whose water it is, and whose boat")
    where.add_argument("--around", type=place, metavar="LAT,LON", help="the middle of the water")
    load.add_argument(
        "--radius",
        type=number("m", at_least=50.0, at_most=MOST_M),
        metavar="M",
        help=f"how far from there; of a mission from its origin ({WITHIN_M:g} m beyond its farthest place)",
    )
    load.add_argument("--out", metavar="NAME", help="writes NAME.geojson and NAME-fence.geojson (MISSION-chart)")
    load.add_argument(
        "--depth",
        type=number("m", at_least=0.0, at_most=100.0),
        metavar="M",
        help="water less deep than this below the chart's datum is solid (the mission's draft_m and under_keel_m)",
    )
    load.add_argument(
        "--tide",
        metavar="TABLE",
        help="lines of time, height above the chart's datum [m]: the lowest of --from to --to is added to every depth "
        "(the mission's [area] tide)",
    )
    load.add_argument("--from", dest="begins", type=moment, metavar="TIME", help="2026-11-24T08:00Z, with --tide")
    load.add_argument("--to", dest="ends", type=moment, metavar="TIME", help="the same, of the voyage's end")
    load.add_argument(
        "--drying",
        action="store_true",
        help="what the table's highest tide makes deep enough goes to NAME-drying.geojson, for [area] drying: it is "
        "solid at its hours",
    )
    load.add_argument(
        "--air-draft",
        type=number("m", above=0.0, at_most=100.0),
        metavar="M",
        help="bridges and cables with more room than this are passed under (none is)",
    )
    load.add_argument(
        "--buoy-radius",
        type=number("m", above=0.0, at_most=500.0),
        default=10.0,
        metavar="M",
        help="of buoys and beacons (10)",
    )
    load.add_argument(
        "--restricted",
        choices=("none", "prohibited", "all"),
        default="prohibited",
        help="which restricted areas are solid (prohibited: where entry is)",
    )
    load.add_argument(
        "--most-doubt",
        type=number("m", at_least=0.0, at_most=1000.0),
        default=50.0,
        metavar="M",
        help="the quality of a survey (CATZOC) widens a margin to no more than this (50)",
    )
    load.add_argument(
        "--tolerance",
        type=number("m", at_least=0.1, at_most=500.0),
        metavar="M",
        help="shapes may be up to twice this too large, with fewer corners (2)",
    )
    load.add_argument(
        "--positive",
        choices=("auto", "up", "down"),
        default="auto",
        help="what numbers above zero are in a grid: heights (up) or depths (down)",
    )
    load.add_argument("--without-depths", action="store_true", help="take a cell that says nothing of depths")
    force_option(load)
    load.set_defaults(run=_import)
    found = verbs.add_parser("shoals", help="write the shoals that the sounder found on a voyage")
    found.add_argument("state", metavar="STATE", help="the saved state of the voyage (state.json), or its folder")
    found.add_argument("out", metavar="OUT", help="its extension is the format: .geojson, .wkt, ...")
    found.add_argument("--mission", metavar="M", required=True, help="the mission that was sailed")
    force_option(found)
    found.set_defaults(run=_shoals)


def _shoals(args: argparse.Namespace) -> int:
    from companion.commands.output import write_out
    from companion.geo.frame import LocalFrame
    from companion.geofence import Circle, Document, Zone, ZoneKind, load_mission
    from companion.geofence.formats import write
    from companion.telemetry.state_file import read_state

    path = _state_in(args.state)
    mission = load_mission(Path(args.mission))
    frame, transducer_m = mission.frame(), mission.boat.transducer_m
    try:
        saved = read_state(path)
    except OSError as error:
        raise unreadable(str(path), error) from None
    except (ValueError, TypeError) as error:
        raise InputError(str(path), "", f"is no saved state ({error})", "name state.json of a voyage") from None
    if not saved.shoals:
        raise JobError(f"{path}: no shoal was found on this voyage")
    frame = frame if saved.water is None else LocalFrame(saved.water)
    zones = tuple(
        Zone(
            kind=ZoneKind.EXCLUSION,
            shape=Circle(center=frame.geo_from_en(*shoal.en_m), radius_m=shoal.radius_m + shoal.doubt_m),
            name=f"shoal {n}: {shoal.depth_m:.1f} m sounded"
            + (
                "" if (deep := shoal.below_datum_m(transducer_m)) is None else f", {deep:.1f} m below the chart's datum"
            ),
        )
        for n, shoal in enumerate(saved.shoals, start=1)
    )
    document = Document(source=str(path), format="shoals", zones=zones)
    write_out(write(document, args.out, part="fence"), args.out, lossy=False, force=args.force)
    print(f"{args.out}: {counted(len(zones), 'shoal')}, drawn with the doubt about each. Not fit for navigation.")
    return 0


def _state_in(named: str) -> Path:
    """Return the saved state that is named, by itself or by a folder that holds it. Raises InputError."""
    from companion.telemetry.folder import STATE, VOYAGE, believed, read_description

    path = Path(named)
    if not path.is_dir():
        return path
    if (path / STATE).exists():
        return path / STATE
    if (path / VOYAGE).is_file():
        told = read_description(path)
        with believed(path / VOYAGE, "run, mission"):
            is_dry, name = bool(told["run"]["dry_run"]), str(told["mission"]["name"])
        if is_dry:
            raise InputError(named, "", "is of a dry run, which keeps no shoals", "name a voyage that was sailed")
        beside = path.parent / f"{file_name(name)}.state.json"
        if beside.exists():
            raise InputError(
                named,
                "",
                f"holds no {STATE}",
                f"name {beside}, which `companion run` keeps of the last voyage of {name}",
            )
    raise InputError(named, "", f"is a folder without {STATE}", "name a voyage's folder, or a saved state")


def _import(args: argparse.Namespace) -> int:
    from companion.chart import TOLERANCE_M, Wanted, area_of
    from companion.geofence import Charted

    center, reach_m, places, options = _water(args)
    out = (args.out or "").removesuffix(".geojson") or (Path(args.mission).stem + "-chart" if args.mission else "chart")
    folder = Path(args.mission).parent if args.mission and not args.out else Path()
    obstacles, fence = folder / f"{out}.geojson", folder / f"{out}-fence.geojson"
    drying = folder / f"{out}-drying.geojson"
    refuse_existing([str(obstacles), str(fence), *([str(drying)] if args.drying else [])], force=args.force)
    table = _tide_table(args, options)
    tide_m = _tide_m(args, table)
    needs_m = _depth_m(args, options)
    depth_m = needs_m - tide_m
    floats_m = depth_m - _highest_m(args, table) if args.drying else None
    wanted = Wanted(
        safety_depth_m=depth_m,
        air_draft_m=math.inf if args.air_draft is None else args.air_draft,
        buoy_radius_m=args.buoy_radius,
        most_doubt_m=args.most_doubt,
        floats_m=floats_m,
        restricted=args.restricted,
    )
    charts = _read_charts(args, center, reach_m, wanted)
    if not charts:
        what = f"{args.files[0]} holds nothing" if len(args.files) == 1 else "no file holds anything"
        raise JobError(f"{obstacles}: not written: {what} of the water that is asked for")
    area = area_of(charts, center, reach_m, args.tolerance or TOLERANCE_M, floats_m)
    if area.is_too_much:
        raise JobError(
            f"{obstacles}: not written: it would hold {area.positions()} positions, more than a mission reads; "
            "say a smaller --radius or a larger --tolerance"
        )
    made_for = Charted(
        needs_m=needs_m,
        tide_m=tide_m,
        hours_s=None if args.begins is None else (args.begins.timestamp(), args.ends.timestamp()),
        drying=drying.name if area.drying else "",
    )
    files = {str(obstacles): area.obstacles_json(made_for), str(fence): area.fence_json()}
    if area.drying:
        files[str(drying)] = area.drying_json()
    write_files(files, force=args.force)
    print(
        f"{obstacles}: written: {counted(len(area.always), 'obstacle')} ({counted(area.positions(), 'position')}) "
        f"within {reach_m:.0f} m of {center.lat_deg:.5f}, {center.lon_deg:.5f}; solid is what is less deep than "
        f"{depth_m:g} m" + (f" with {tide_m:g} m of tide" if table else "")
    )
    _tell_written(area, fence, drying, is_drying=args.drying)
    if any(s.doubt_m == args.most_doubt > 0.0 for s in area.solids):
        print(f"surveys here are so doubtful that margins would be wider: cut at {args.most_doubt:g} m (--most-doubt)")
    told = f', drying = ["{drying.name}"]' if area.drying else ""
    print(f'in the mission: [area] obstacles = ["{obstacles.name}"], fence = "{fence.name}"{told}')
    _tell_shallower(args.depth, options)
    bad = _troubles(area, places)
    for line in bad:
        print(line)
    print("not fit for navigation: look at it before it is sailed by")
    return int(bool(bad))


def _read_charts(args: argparse.Namespace, center: GeoPoint, reach_m: float, wanted: Wanted) -> list[Chart]:
    """Return the charts that hold something of the water, and say what each is and what is wrong with it."""
    from companion.chart import box_about, read_chart, told_of

    charts: list[Chart] = []
    for name in args.files:
        chart = read_chart(
            Path(name), box_about(center, reach_m), wanted, positive=args.positive, without_depths=args.without_depths
        )
        for finding in chart.findings:
            print(finding.line(name))
        if chart.is_elsewhere:  # one of many cells, perhaps
            continue
        charts.append(chart)
        source = "" if str(chart.source) in {name, Path(name).name} else f"{chart.source}: "
        print(
            f"{name}: {source}{told_of(chart)}"
            + ("" if chart.knows_depths else "; it tells no depths of the water between")
        )
    return charts


def _tell_written(area: ChartArea, fence: Path, drying: Path, *, is_drying: bool) -> None:
    """Say what is written beside the obstacles; ``is_drying``: water that is solid at some hours was asked for."""
    if area.drying:
        print(
            f"{drying}: written: {counted(len(area.drying), 'piece')} of water that is too shallow at some hours only"
        )
    elif is_drying:
        old = ", and the one that is there is of before: leave it out of [area] drying" if drying.exists() else ""
        print(f"{drying}: not written: no tide of the table makes deep enough what is too shallow here{old}")
    print(f"{fence}: written: the edge of it")


def _tell_shallower(depth_m: float | None, options: MissionOptions | None) -> None:
    """Say where ``--depth`` is less than what the mission's boat needs."""
    if depth_m is None or options is None or options.boat.draft_m is None:
        return
    own_m = options.boat.draft_m + options.area.under_keel_m
    if own_m > depth_m:
        print(f"--depth {depth_m:g} is less than the {own_m:g} m of the mission's draft_m and under_keel_m")


def _water(args: argparse.Namespace) -> tuple[GeoPoint, float, list[tuple[str, GeoPoint]], MissionOptions | None]:
    """Return the middle of the water, how far it reaches [m], and the places and settings of the mission."""
    from companion.geo.frame import LocalFrame
    from companion.geofence.mission import read_course

    if args.mission is None:
        if args.radius is None:
            raise InputError("--around", "", "has no --radius", "say how far, in metres")
        return args.around, args.radius, [], None
    mission = read_course(Path(args.mission))
    frame = LocalFrame(mission.origin)
    places = [(g.name or f"[[goal]] {n}", g.point) for n, g in enumerate(mission.goals, start=1)]
    places += [(r.name or f"[[refuge]] {n}", r.point) for n, r in enumerate(mission.refuges, start=1)]
    if mission.start is not None:
        places.insert(0, ("[start]", mission.start))
    farthest_m = max(math.hypot(*frame.en_from_geo(point)) for _, point in places)
    reach_m = args.radius or farthest_m + WITHIN_M
    if reach_m > MOST_M:
        raise InputError(
            args.mission,
            "",
            f"reaches {farthest_m / 1000.0:.0f} km from its origin",
            f"say --radius, of at most {MOST_M:g} m, and import a passage in parts",
        )
    return mission.origin, reach_m, places, mission.options


def _depth_m(args: argparse.Namespace, options: MissionOptions | None) -> float:
    """Return the depth below the chart's datum from which on water is free [m]."""
    if args.depth is not None:
        return float(args.depth)
    if options is None:
        raise InputError("--depth", "", "is missing", "say the least depth that is free, in metres")
    if options.boat.draft_m is None:
        raise InputError(args.mission, "[boat] draft_m", "is missing", "say how deep the keel is, or --depth M")
    return options.boat.draft_m + options.area.under_keel_m


def _tide_table(args: argparse.Namespace, options: MissionOptions | None) -> str | None:
    """Return the table of the tide: that of the command, or the mission's where hours are asked for."""
    if args.tide is not None or options is None or options.area.tide is None:
        return args.tide if args.tide is None else str(args.tide)
    return (
        None
        if args.begins is None and args.ends is None and not args.drying
        else str(Path(args.mission).parent / options.area.tide)
    )


def _tide_m(args: argparse.Namespace, table: str | None) -> float:
    """Return the lowest height of tide in the voyage's hours [m]: 0, the chart's datum, without a table."""
    from companion.current import lowest_m

    if args.begins is None and args.ends is None and (table is None or args.drying):
        return 0.0
    if table is None or args.begins is None or args.ends is None or args.begins >= args.ends:
        raise InputError("--tide", "", "goes with --from and a later --to", "say all three, or none")
    return lowest_m(_rows(table), args.begins.timestamp(), args.ends.timestamp(), table)


def _highest_m(args: argparse.Namespace, table: str | None) -> float:
    """Return the highest tide of the table [m]."""
    if table is None or args.begins is not None or args.ends is not None:
        raise InputError(
            "--drying",
            "",
            "is by the hours of a table, not by one height",
            "say --tide, or [area] tide in the mission, without --from and --to",
        )
    return max(row.height_m for row in _rows(table))


def _rows(table: str) -> tuple[TideRow, ...]:
    from companion.current import read_tide
    from companion.current.prior import table_lines
    from companion.geofence.formats import decode, read_bytes

    text = decode(read_bytes(Path(table)), table)
    return read_tide(text, table, tuple(_utc_s(line.split(",")[0].strip()) for _, line in table_lines(text)))


def _utc_s(text: str) -> float | None:
    try:
        return moment(text).timestamp()
    except argparse.ArgumentTypeError:
        return None


def _troubles(area: ChartArea, places: list[tuple[str, GeoPoint]]) -> list[str]:
    """Return a line for each place of a mission that is not in free water, and what to look at."""
    import shapely

    from companion.geofence.shapes import polygon_en

    solids = [(s, polygon_en(s.shape, area.frame)) for s in area.solids]
    out = []
    for name, point in places:
        here = shapely.points(area.frame.en_from_geo(point))
        why = [f"{s.title} of {s.source}" if s.source else s.title for s, p in solids if shapely.covers(p, here)]
        if why:
            out.append(
                f"{name}: {point.lat_deg:.6f}, {point.lon_deg:.6f} is inside {listed(why[:3])}; "
                "move it, or say --depth or --positive where depths were misread"
            )
    return out

"""``companion mission``: check, make, draw, convert, upload and download missions."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.mission.edit import add_parser as add_edit
from companion.commands.mission.new import add_parser as add_new
from companion.commands.mission.new import point_radius_option, write_mission
from companion.commands.mission.picture import preview, preview_options, read_mission_file
from companion.commands.output import (
    force_option,
    print_findings,
    print_losses,
    refuse_existing,
    summary,
    write_out,
)
from companion.errors import InputError, JobError
from companion.words import counted

if TYPE_CHECKING:
    from companion.geofence import Document

_EPILOG = """\
examples:
  companion mission check missions/archipelago.toml --plot archipelago.png
  companion mission new bay.toml --start 50.817,-1.31 --goal 50.8203,-1.31 --land islands.wkt --margin 12 --plot bay.png
  companion mission new bay.toml --from drawn-in-qgroundcontrol.plan
  companion mission edit bay.toml                      (draw it in a browser, checked and planned as you draw)
  companion mission convert bay.toml bay.plan          (also .gpx, .kml, .geojson)
  companion mission convert bay.toml bay.waypoints --part mission
  companion mission convert route.gpx route.waypoints
  companion mission upload route.waypoints --link udpin:0.0.0.0:14550
  companion mission download boat.plan --link /dev/ttyUSB0:57600

A mission TOML holds goals and an area; the companion plans the way itself (companion run). Waypoint files are sailed
by the autopilot as they are.
Exit codes: 0 in order, 1 faults found or a failed transfer, 2 a file or option that cannot be believed.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verbs."""
    from companion.commands.fence import link_options

    parser = subparsers.add_parser(
        "mission", help=summary, description=summary[0].upper() + summary[1:] + ".", epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verbs = parser.add_subparsers(dest="verb", metavar="check|new|edit|example|convert|upload|download", required=True)
    check = verbs.add_parser("check", help="read a mission as the boat would and name what is wrong")
    check.add_argument("file", metavar="FILE")
    preview_options(check)
    check.set_defaults(run=_check)

    add_new(verbs)
    add_edit(verbs)

    example = verbs.add_parser("example", help="write the missions that come with the program, to begin from")
    example.add_argument("folder", type=Path, metavar="DIR")
    example.set_defaults(run=_example)

    convert = verbs.add_parser("convert", help="write a mission in another format and say what it does not carry")
    convert.add_argument("file", metavar="FILE")
    convert.add_argument("out", metavar="OUT", help="its extension is the format")
    convert.add_argument("--part", choices=("mission", "fence", "rally"),
                         help="write this alone (a .waypoints file holds no more than one of them)")
    convert.add_argument("--lossy", action="store_true", help="write even if zones are left out")
    point_radius_option(convert)
    force_option(convert)
    convert.set_defaults(run=_convert)

    upload = verbs.add_parser("upload", help="write a waypoint file to the autopilot, read back, compare")
    upload.add_argument("file", metavar="FILE")
    upload.add_argument("--part", choices=("mission", "rally"), default="mission")
    link_options(upload)
    upload.set_defaults(run=_upload)

    download = verbs.add_parser("download", help="read the autopilot's mission into a file")
    download.add_argument("out", metavar="OUT", help="its extension is the format")
    download.add_argument("--part", choices=("mission", "rally"), default="mission")
    force_option(download)
    link_options(download)
    download.set_defaults(run=_download)


def _example(args: argparse.Namespace) -> int:
    from companion import examples
    from companion.disk import Disk, reason

    files = sorted(path for path in examples.folder().iterdir() if path.suffix in {".toml", ".wkt"})
    there = [path.name for path in files if (args.folder / path.name).exists()]
    if there:
        raise InputError(str(args.folder), there[0], "is there already", "name another folder: nothing is written over")
    try:
        args.folder.mkdir(parents=True, exist_ok=True)
        for path in files:
            Disk().replace(args.folder / path.name, path.read_bytes())
    except OSError as error:
        raise InputError(str(args.folder), "", f"cannot be written ({reason(error)})", "name another folder") from error
    missions = [path for path in files if path.suffix == ".toml"]
    print(f"{counted(len(missions), 'mission')} in {args.folder}; next: companion mission check {args.folder}/"
          f"archipelago.toml --plot archipelago.png")
    return 0


def _check(args: argparse.Namespace) -> int:
    if Path(args.file).suffix.lower() != ".toml":
        document = read_mission_file(args.file)
        print_findings(document.findings, args.file)
        print(f"{args.file}: {document.format}: {summary(document)}: in order")
        return 0
    from companion.compose.fields import told_of
    from companion.sailable import judge, words_of
    from companion.sailable.previews import wind_limit_words

    judged = judge(Path(args.file), from_deg=args.wind[1] if args.wind else None)
    if judged.mission is None or judged.refusals:
        raise judged.refusals[0]
    mission = judged.mission
    bad = print_findings(judged.findings, args.file)
    for line in told_of(mission):
        print(f"{args.file}: {line}")
    if args.plot:
        preview(mission, args)
    if mission.is_passage:
        from companion.sailable.previews import passage_words

        print(passage_words(mission))
        print(f"{args.file}: note: a passage needs FENCE_TYPE 4 on the autopilot, its polygons alone: with bit 2 the "
              "circle round home would end it (companion doctor looks)")
    limits = wind_limit_words(mission)
    if limits:
        print(f"{args.file}: {limits}")
    for line in words_of(mission, time.time()):
        print(f"{args.file}: {line}")
    print(f"{args.file}: {mission.name}: {counted(len(mission.goals), 'goal')}, "
          f"{counted(len(mission.area.solids), 'obstacle')}: "
          f"{'NOT in order' if bad else 'in order'}")
    if bad:
        print(f"to see it on a chart and mend it: companion mission edit {args.file}")
    return int(bad)


def _only(document: Document, part: str) -> Document:
    """Return one part of a document, and say what else it holds."""
    from dataclasses import replace

    parts: dict[str, Document] = {
        "mission": replace(document, zones=(), marks=(), rally=(), return_point=None, tracks=()),
        "fence": replace(document, items=(), item_names=(), rally=(), home=None, tracks=()),
        "rally": replace(document, items=(), item_names=(), zones=(), marks=(), return_point=None, home=None,
                         tracks=()),
    }
    if summary(parts[part]) == "nothing":
        raise JobError(f"{document.source}: there is no {part} in it; it holds {summary(document)}")
    others = [summary(parts[p]) for p in parts if p != part]
    rest = ", ".join(words for words in others if words != "nothing")
    if rest:
        print(f"{document.source}: note: also holds {rest}: left out with --part {part}")
    return parts[part]


def _convert(args: argparse.Namespace) -> int:
    from companion.commands.fence import grown_marks
    from companion.geofence import read
    from companion.geofence.formats import write
    from companion.geofence.mission import goal_losses, load_mission, mission_files

    document = read_mission_file(args.file)
    print_findings(document.findings, args.file)
    if args.point_radius is not None:
        document = grown_marks(document, args.point_radius)
    if Path(args.file).suffix.lower() == ".toml":
        print_losses(tuple(goal_losses(load_mission(args.file))), args.out)
    out = Path(args.out)
    if out.suffix.lower() == ".toml":
        try:
            made = mission_files(document, out.stem)
        except ValueError as error:
            raise InputError(args.file, "", str(error)) from None
        write_mission(made, out, force=args.force)
        return 0
    if args.part is not None:
        document = _only(document, args.part)
    write_out(write(document, args.out), args.out, lossy=args.lossy, force=args.force,
              remedy="choose another format, or what to write with --part")
    print(f"{args.out}: written: {summary(read(args.out))}")   # what is in it, not what was meant to be
    return 0


def _upload(args: argparse.Namespace) -> int:
    from companion.commands.shore import Shore, upload_and_compare
    from companion.messages import MissionType

    if Path(args.file).suffix.lower() == ".toml":
        raise InputError(args.file, "", "holds goals, not the way to them",
                         "sail it with 'companion run', or convert it to .waypoints to sail straight lines")
    document = _only(read_mission_file(args.file), args.part)
    kind = MissionType.RALLY if args.part == "rally" else MissionType.MISSION
    items = document.rally if kind is MissionType.RALLY else document.items
    if not items:
        raise JobError(f"{args.file}: there is no {args.part} to upload")
    with Shore(args.link, timeout_s=args.timeout, system=args.system) as shore:
        name = upload_and_compare(shore, kind, items, home=document.home)
    print(f"{args.part} of {counted(len(items), 'item')} uploaded and read back the same, hash {name}")
    return 0


def _download(args: argparse.Namespace) -> int:
    from companion.commands.shore import Shore, download_list
    from companion.geofence import Document
    from companion.geofence.formats import format_of, write
    from companion.mavlink.wire import mission_hash
    from companion.messages import MissionType

    format_of(args.out)
    refuse_existing([args.out], force=args.force)
    kind = MissionType.RALLY if args.part == "rally" else MissionType.MISSION
    with Shore(args.link, timeout_s=args.timeout, system=args.system) as shore:
        items = download_list(shore, kind)
        home = shore.home if kind is MissionType.MISSION else None
    if not items:
        print(f"the autopilot holds no {args.part}; nothing is written", file=sys.stderr)
        return 1
    document = Document(source="autopilot", format="autopilot", items=items if args.part == "mission" else (),
                        rally=items if args.part == "rally" else (), home=home)
    write_out(write(document, args.out, part=args.part), args.out, lossy=False, force=args.force)
    print(f"{args.out}: written: {summary(document)}, hash {mission_hash(items)}")
    return 0

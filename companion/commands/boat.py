"""``companion boat``: a file that says what one boat can do: guessed, learned from its logs, shown, compared."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from companion.errors import InputError
from companion.program.arguments import add_command, number, out_file, picture, whole
from companion.words import counted

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from companion.boat import Boat, Polar, Trial
    from companion.boat_logs import ReadLog
    from companion.geo.frame import LocalFrame
    from companion.geofence import Mission
    from companion.geofence.mission import BoatFile, LearnedTable, MissionOptions

_EPILOG = """\
examples:
  companion boat guess --length 1.5 --displacement 20 --sail-area 0.9 --out pepper.toml
  companion boat learn voyages/ flights/*.BIN --from pepper.toml --out pepper-learned.toml
  companion boat trial lake.toml --from-deg 240               (writes lake-trial.toml: sail it, then learn from it)
  companion boat show pepper.toml --plot pepper.png
  companion boat show pepper.toml --pol pepper.pol            (for OpenCPN and qtVlm)
  companion boat compare pepper.toml ardurover

A mission names the file: file = "pepper.toml" in its [boat].
Exit codes: 0 written or told, 1 the logs hold too little sailing, 2 an invalid file or number.
"""
TWA_DEG = (40.0, 45.0, 52.0, 60.0, 75.0, 90.0, 110.0, 120.0, 135.0, 150.0, 165.0, 180.0)
_TAKES = "give voyage folders, .tlog, .BIN, CSV or NMEA"
TRIAL_M = 1000.0  # from the start: nobody sails an hour to a trial
MARK_M, MARK_SHARE = 10.0, 0.15  # a mark's radius, and the share of a board that it is at most
MEDIAN = 0.5  # of the speeds that are written
MOST_WINDS = 7  # columns of a table


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verbs."""
    parser = add_command(subparsers, "boat", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="guess|learn|trial|show|compare", required=True)
    guess = verbs.add_parser("guess", help="a boat file from three sizes, for a boat that nobody has sailed yet")
    guess.add_argument(
        "--length", type=number("m", above=0.0, at_most=100.0), required=True, metavar="M", help="over all [m]"
    )
    guess.add_argument(
        "--displacement",
        type=number("kg", above=0.0, at_most=1e6),
        required=True,
        metavar="KG",
        help="as she sails [kg]",
    )
    guess.add_argument(
        "--sail-area",
        type=number("m2", above=0.0, at_most=1e4),
        required=True,
        metavar="M2",
        help="of all but a spinnaker [m2]",
    )
    guess.add_argument(
        "--beam", type=number("m", above=0.0, at_most=30.0), metavar="M", help="[m] (default: 0.3 of the length)"
    )
    guess.add_argument("--name", help="what she is called (default: the file's name)")
    guess.add_argument("--out", type=out_file, metavar="FILE.toml", help="write it there (default: print it)")
    guess.add_argument("--force", action="store_true", help="take the place of a file that is there")
    guess.set_defaults(run=_guess)
    learn = verbs.add_parser("learn", help="a boat file from logs: voyage folders, .tlog, .BIN, CSV, NMEA 0183")
    learn.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="files, or folders of them")
    learn.add_argument(
        "--from",
        dest="prior",
        required=True,
        metavar="FILE.toml",
        help="what was believed of her: the file of `companion boat guess`",
    )
    learn.add_argument("--out", type=out_file, required=True, metavar="FILE.toml", help="write it there")
    learn.add_argument("--name", help="what she is called (default: as in --from)")
    learn.add_argument("--seed", type=whole(), default=0, metavar="N", help="of the draws (default: 0)")
    learn.add_argument("--force", action="store_true", help="take the place of a file, which is kept as FILE.vN.toml")
    learn.set_defaults(run=_learn)
    trial = verbs.add_parser("trial", help="a short mission in a mission's water that settles what logs leave open")
    trial.add_argument("mission", type=Path, metavar="MISSION.toml", help="whose water, boat and permissions it takes")
    trial.add_argument(
        "--from-deg",
        type=number("deg", at_least=0.0, at_most=360.0),
        metavar="DEG",
        help="where the wind comes from (default: the mission's [wind])",
    )
    trial.add_argument("--out", metavar="FILE.toml", help="beside the mission (default: MISSION-trial.toml)")
    trial.add_argument("--force", action="store_true", help="take the place of a file that is there")
    trial.set_defaults(run=_trial)
    show = verbs.add_parser("show", help="her speeds, best angles and what is not known of her")
    show.add_argument("file", metavar="FILE", help="a boat file, a polar file, ardurover or avalon")
    show.add_argument("--plot", type=picture, metavar="P.png", help="draw the polar, with its band")
    show.add_argument("--pol", type=out_file, metavar="FILE.pol", help="write the polar in knots, as OpenCPN reads it")
    show.add_argument(
        "--signalk", type=out_file, metavar="FILE.json", help="write the polar as Signal K has one (performance/polars)"
    )
    show.add_argument(
        "--orc",
        type=out_file,
        metavar="FILE.csv",
        help="write the polar as an ORC certificate has it, winds in its range",
    )
    show.add_argument(
        "--quantile",
        type=number(above=0.0, at_most=0.5),
        default=MEDIAN,
        metavar="P",
        help="of the speeds in these files, below which she is with this chance (default: 0.5; careful: 0.1)",
    )
    show.add_argument("--force", action="store_true", help="take the place of such a file that is there")
    show.set_defaults(run=_show)
    compare = verbs.add_parser("compare", help="how much faster one is than the other")
    for name in ("first", "second"):
        compare.add_argument(name, metavar=name.upper(), help="a boat file, a polar file, ardurover or avalon")
    compare.set_defaults(run=_compare)


def _guess(args: argparse.Namespace) -> int:
    from companion.boat import Sizes, guessed, guessed_text
    from companion.commands.output import write_files

    try:
        sizes = Sizes(length_m=args.length, displacement_kg=args.displacement, sail_area_m2=args.sail_area)
    except ValueError as error:
        raise InputError(
            "--length, --displacement, --sail-area", "", str(error), "give what a scale and a tape say"
        ) from None
    name = args.name or (args.out.stem if args.out is not None else "my boat")
    text = guessed_text(name, sizes, guessed(sizes), f"{datetime.now(UTC):%Y-%m-%d}", args.beam)
    if args.out is None:
        print(text, end="")
        return 0
    write_files({str(args.out): text.encode()}, force=args.force)
    print(f'{args.out}: written; a mission beside it names it: [boat] file = "{args.out.name}"')
    return 0


def _learn(args: argparse.Namespace) -> int:
    from companion.boat import learned_text, lesson_of
    from companion.boat_logs import Skipped, logs_under, read_logs, why_none
    from companion.commands.output import refuse_existing, write_files
    from companion.compose import polar_of_file, speed_error_of
    from companion.errors import JobError
    from companion.geofence.mission import read_boat_file

    believed = read_boat_file(Path(args.prior))
    refuse_existing([str(args.out)], force=args.force)
    paths = logs_under(args.logs)

    def tell(count: int, name: str) -> None:
        print(f"reading {count + 1} of {len(paths)}: {name}", file=sys.stderr)

    read, skipped = read_logs(paths, tell)
    known = {} if believed.learned is None else {log.digest: log.name for log in believed.learned.logs}
    old = f"{args.prior} was learned from it already"
    skipped += [Skipped(name=one.log.name, why=old) for one in read if one.digest in known]
    read = [one for one in read if one.digest not in known]
    if not read and len(skipped) < 2:
        raise JobError(f"{why_none(args.logs, skipped)}; {_TAKES}")
    for left in skipped:
        print(f"skipped {left.name}: {left.why}")
    for one in read:
        for note in one.log.notes:
            print(f"{one.log.name}: {note}")
    if not read:
        raise JobError(f"none of these {counted(len(paths), 'log')} can be learned from; {_TAKES}")
    print(f"learning from {counted(len(read), 'log')}", file=sys.stderr)
    try:
        lesson = lesson_of(
            [one.log for one in read],
            polar_of_file(believed, args.prior),
            speed_error_of(believed.boat),
            no_go_half_rad=math.radians(believed.boat.no_go_half_deg),
            seed=args.seed,
        )
    except ValueError as error:
        raise JobError(f"too little to learn from: {error}; {_left_out(read, believed, args.prior)}") from None
    version = 1 + max((_version(path) for path in (Path(args.prior), args.out)), default=0)
    name = args.name or believed.name
    text = learned_text(
        name,
        lesson,
        kept=_said(believed),
        made=f"learned on {datetime.now(UTC):%Y-%m-%d} from {lesson.hours:.1f} h of steady sailing in "
        f"{counted(len(read), 'log')}, about {args.prior}",
        version=version,
        logs=[(one.log.name, one.digest) for one in read],
        skipped=[(left.name, left.why) for left in skipped],
    )
    files = {str(args.out): text.encode()}
    if args.out.exists():
        kept = args.out.with_suffix(f".v{_version(args.out)}{args.out.suffix}")
        files[str(kept)] = args.out.read_bytes()
        print(f"{kept}: what stood in {args.out}")
    write_files(files, force=True)
    print("\n".join(_words(str(args.out), read_boat_file(args.out))))
    print(f"{args.out}: written, version {version}")
    return 0


def _trial(args: argparse.Namespace) -> int:
    from companion.boat import trial_in
    from companion.commands.output import print_findings, write_files
    from companion.compose import polar_of
    from companion.errors import JobError
    from companion.geofence import load_mission
    from companion.geofence.mission import dump_options, read_options
    from companion.mission_check import check_mission

    mission = load_mission(args.mission)
    out = Path(args.out or f"{args.mission.stem}-trial.toml")
    out = args.mission.parent / out if out.parent == Path() else out
    if out.parent.resolve() != args.mission.parent.resolve():  # what it names of the area is beside the mission
        raise InputError("--out", "", f"{out} is not in the folder of {args.mission}", "name a file beside the mission")
    wind = mission.wind.preview_from_deg if args.from_deg is None else args.from_deg
    frame = mission.frame()
    tws_mps = mission.wind.preview_speed_mps
    no_go_rad = math.radians(mission.boat.no_go_half_deg)
    polar = polar_of(mission)
    found = trial_in(
        _water(mission, frame),
        frame.en_from_geo(mission.origin),
        twd_from_rad=math.radians(wind),
        no_go_half_rad=no_go_rad,
        speed_mps=polar.best_beat(tws_mps).vmg_mps / math.cos(no_go_rad),
    )
    if found is None:
        raise JobError(f"{args.mission}: there is no room in its water for six tacks, a reach there and back and a run")
    options = _trial_options(read_options(args.mission), mission.name, found, frame, wind)
    text = dump_options(options)
    checked = check_mission(out, from_deg=wind, given={out: text.encode()})
    if checked.refusals:
        raise checked.refusals[0]
    print_findings(checked.findings, str(out))
    write_files({str(out): text.encode()}, force=args.force)
    print(
        f"{out}: written for wind from {wind:.0f} degrees: {counted(len(found.names), 'mark')}, boards of "
        f"{found.board_m:.0f} m. Plan it: companion mission check {out} --plot {out.stem}.png; sail it; "
        "then companion boat learn"
    )
    return 0


def _water(mission: Mission, frame: LocalFrame) -> BaseGeometry:
    """Return where plans of a mission may be [m]: its limits without what is kept clear of, at most ``TRIAL_M`` off."""
    import shapely

    local = mission.area.local(frame)
    water = shapely.Point(frame.en_from_geo(mission.origin)).buffer(TRIAL_M)
    if local.limits is not None:
        water = shapely.intersection(water, shapely.buffer(local.limits, -mission.margin_m))
    if local.polygons:
        water = shapely.difference(water, shapely.buffer(local.solid, mission.margin_m))
    return water


def _trial_options(
    options: MissionOptions, name: str, trial: Trial, frame: LocalFrame, wind_deg: float
) -> MissionOptions:
    import msgspec

    from companion.geofence.mission import PointOptions

    radius_m = round(min(MARK_M, MARK_SHARE * trial.board_m), 1)
    goals = []
    for place, what in zip(trial.marks_en_m.tolist(), trial.names, strict=True):
        at = frame.geo_from_en(*place)
        goals.append(PointOptions(lat=round(at.lat_deg, 7), lon=round(at.lon_deg, 7), radius_m=radius_m, name=what))
    return msgspec.structs.replace(
        options,
        name=f"{name}-trial",
        description=f"Trial for wind from {wind_deg:.0f} degrees: six tacks, a reach there and back, a run.",
        goal=tuple(goals),
        wind=msgspec.structs.replace(options.wind, preview_from_deg=wind_deg % 360.0),
        field={},
    )


def _said(boat: BoatFile) -> dict[str, object]:
    import msgspec

    plain = type(boat.boat)()
    return {
        field: getattr(boat.boat, field)
        for field in msgspec.structs.asdict(plain)
        if getattr(boat.boat, field) != getattr(plain, field)
    }


def _version(path: Path) -> int:
    from companion.geofence.mission import read_boat_file

    try:
        learned = read_boat_file(path).learned
    except InputError:
        return 0
    return 0 if learned is None else learned.version


def _left_out(read: list[ReadLog], believed: BoatFile, source: str) -> str:
    from companion.boat.log import stretches_of
    from companion.compose import polar_of_file, speed_error_of

    found = stretches_of([one.log for one in read], polar_of_file(believed, source), speed_error_of(believed.boat))
    return "left out: " + (", ".join(f"{n} ({why.value})" for why, n in found.left_out.most_common()) or "nothing")


def _show(args: argparse.Namespace) -> int:
    from statistics import NormalDist

    from companion.boat import orc_text, pol_text, signalk_text
    from companion.commands.output import write_files
    from companion.compose import speed_error_of

    if args.quantile != MEDIAN and not (args.pol or args.orc or args.signalk):
        raise InputError(
            "--quantile", "", "is of the speeds in a file, and none is asked for", "say --pol, --orc or --signalk, too"
        )
    polar, boat = _boat(args.file)
    sailed = _sailed(polar, boat)
    error = 0.0 if boat is None else speed_error_of(boat.boat)
    print("\n".join([*_words(args.file, boat), *_angles(sailed), "", *_table("boat speed [m/s]", polar, _speeds)]))
    slower = math.exp(error * NormalDist().inv_cdf(args.quantile))
    for file, text in (
        (args.pol, pol_text(polar, slower)),
        (args.signalk, signalk_text(sailed, slower)),
        (args.orc, orc_text(sailed, slower)),
    ):
        if file is not None:
            write_files({str(file): text.encode()}, force=args.force)
            print(f"{file}: written")
    if args.plot is not None:
        from companion.commands.output import patience
        from companion.plots.polar import save_polar

        with patience("drawing"):
            save_polar(
                polar, _errors(boat), args.plot, title=polar.name, stretches=boat.polar.stretches if boat else ()
            )
        print(f"{args.plot}: drawn")
    return 0


def _errors(boat: BoatFile | None) -> Polar | float:
    """Return the deviation of the logarithm of the speeds, by angle and wind where the file has it so."""
    from companion.boat import polar_of_table
    from companion.compose import speed_error_of

    if boat is None:
        return 0.0
    table = boat.polar
    if not table.error_percent:
        return speed_error_of(boat.boat)
    shares = [[0.01 * e for e in row] for row in table.error_percent]
    return polar_of_table(table.twa_deg, table.tws_mps, shares, name="error", source=boat.name)


def _compare(args: argparse.Namespace) -> int:
    first, second = (_boat(name)[0] for name in (args.first, args.second))

    def shares(polar: Polar, twa_deg: float, tws_mps: float) -> str:
        one, other = (p.speed_mps(math.radians(twa_deg), tws_mps) for p in (polar, second))
        return "-" if one <= 0.0 or other <= 0.0 else f"{100.0 * (other / one - 1.0):+.0f}"

    print("\n".join(_table(f"how much faster {args.second} is than {args.first} [%]", first, shares)))
    return 0


def _boat(name: str) -> tuple[Polar, BoatFile | None]:
    """Return a polar by its file or name, and the boat file that it is of, None: it is none."""
    from companion.compose import POLARS, polar_of_file, whole_polar
    from companion.geofence.mission import read_boat_file

    if name in POLARS:
        return POLARS[name](), None
    if Path(name).suffix == ".toml":
        boat = read_boat_file(Path(name))
        return polar_of_file(boat, name), boat
    return whole_polar(name), None


def _sailed(polar: Polar, boat: BoatFile | None) -> Boat:
    """Return what decides on best angles: a polar alone has neither a no-go zone nor leeway."""
    from companion.boat import Boat
    from companion.compose import sailed_boat

    return Boat(polar=polar, no_go_half_rad=0.0) if boat is None else sailed_boat(boat.boat, polar)


def _words(name: str, boat: BoatFile | None) -> list[str]:
    from companion.compose import speed_error_of

    if boat is None:
        return [f"{name}: speeds alone; `companion boat guess` writes a file that says more"]
    o, error = boat.boat, 100.0 * speed_error_of(boat.boat)
    moderate = " where the apparent wind is three times her speed" if o.leeway_deg > 0.0 else ""
    tacks = (
        f"turns {o.turn_rate_deg_s:g} degrees/s; a tack costs {o.tack_loss_s:g} s and fails in "
        f"{100.0 * o.tack_fails:g} %; leeway {o.leeway_deg:g} degrees{moderate}"
    )
    return [
        f"{boat.name}: {boat.made or 'nobody says how it was made'}",
        f"{o.length_m:g} x {o.beam_m:g} m; not nearer to the wind than {o.no_go_half_deg:g} degrees; {tacks}",
        "her speeds are taken to be as they stand here"
        if error == 0.0
        else f"her speeds may all be off by {error:g} % (standard deviation): arrivals spread by it",
        *([] if boat.learned is None else _learned_words(boat.learned)),
    ]


def _learned_words(told: LearnedTable) -> list[str]:
    out = [f"{counted(told.stretches, 'stretch', 'stretches')} of steady sailing; left out: {_counts(told.left_out)}"]
    for what, pair in (("vane", told.vane_deg), ("compass", told.compass_deg), ("leeway", told.leeway_deg)):
        out.append(f"  {what:<8}{pair[0]:+6.1f} degrees, deviation {pair[1]:.1f}")
    if told.tacks:
        out += ["", _row("tacks, wind [m/s]", [f"{t.tws_mps:g}" for t in told.tacks])]
        out.append(_row("  tried", [str(t.tried) for t in told.tacks]))
        out.append(_row("  failed", [str(t.failed) for t in told.tacks]))
        out.append(_row("  cost [s]", ["-" if t.loss_s is None else f"{t.loss_s:.1f}" for t in told.tacks]))
    return [*out, *(["", "still open, or to be mended:"] if told.findings else []), *(f"- {f}" for f in told.findings)]


def _counts(left_out: dict[str, int]) -> str:
    return ", ".join(f"{n} ({why})" for why, n in left_out.items()) or "none"


def _winds(polar: Polar) -> list[float]:
    winds = [float(w) for w in polar.tws_mps if w > 0.0] or [5.0]
    return winds[:: math.ceil(len(winds) / MOST_WINDS)]


def _angles(boat: Boat) -> list[str]:
    """Return where her bow is best held, and what she then makes good, leeway taken off."""
    winds = _winds(boat.polar)
    lines = ["", _row("wind [m/s]", [f"{w:.1f}" for w in winds])]
    for what, best in (("beat", boat.best_beat), ("run", boat.best_run)):
        found = [best(w) for w in winds]
        lines.append(_row(f"best {what} [deg]", [f"{math.degrees(a.twa_rad):.0f}" for a in found]))
        if what == "beat" and boat.leeway_rad > 0.0:
            made = [boat.made_good_rad(a.twa_rad, w) for a, w in zip(found, winds, strict=True)]
            lines.append(_row("  course [deg]", [f"{math.degrees(a):.0f}" for a in made]))
        lines.append(_row("  made good [m/s]", [f"{a.vmg_mps:.2f}" for a in found]))
    last_deg = math.degrees(boat.polar.twa_rad[-1])
    if 90.0 < last_deg < 179.9:
        deeper = "deeper she is taken to be slower, so that gybing at that makes more"
        lines.append(f"her speeds end at {last_deg:.0f} degrees: {deeper}")
    return lines


def _speeds(polar: Polar, twa_deg: float, tws_mps: float) -> str:
    return f"{polar.speed_mps(math.radians(twa_deg), tws_mps):.2f}"


def _table(title: str, polar: Polar, cell: Callable[[Polar, float, float], str]) -> list[str]:
    winds = _winds(polar)
    return [
        title,
        _row("TWA, wind [m/s]", [f"{w:.1f}" for w in winds]),
        *(_row(f"  {twa:.0f}", [cell(polar, twa, w) for w in winds]) for twa in TWA_DEG),
    ]


def _row(name: str, cells: list[str]) -> str:
    return f"{name:<18}" + "".join(f"{text:>7}" for text in cells)

"""``companion report``: a recorded voyage in words, as a picture, and its track for other programs."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.commands.output import force_option, patience, refuse_existing, write_out
from companion.errors import InputError, JobError
from companion.program.arguments import out_file, picture
from companion.program.commands import missing
from companion.words import clearance_words, counted, time_words

TRACKS = (".gpx", ".kml", ".kmz", ".geojson")  # the formats that hold a track

if TYPE_CHECKING:
    from companion.geofence import Document
    from companion.telemetry.folder import Summary, VoyageRecord


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "report",
        help=summary,
        description="Tell a recorded voyage in words, draw it, and write its track.",
        epilog="Examples: companion report voyages/*; companion report voyages/20260714T101500Z-archipelago --track "
        "day.gpx",
    )
    parser.add_argument(
        "voyage",
        type=Path,
        nargs="+",
        metavar="VOYAGE_DIR",
        help="a folder that `companion run` left; of several, files among them are passed over",
    )
    parser.add_argument("--out", type=picture, metavar="FILE", help="the picture (default: voyage.png in the folder)")
    parser.add_argument(
        "--track",
        type=out_file,
        action="append",
        default=[],
        metavar="FILE",
        help=f"write the track as {', '.join(TRACKS)}; may be given more than once",
    )
    force_option(parser)
    parser.add_argument("--json", action="store_true", help="print summary.json and draw nothing")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command: tell each voyage that can be read, and return the worst exit code."""
    voyages = args.voyage
    if len(voyages) > 1:
        voyages = [path for path in voyages if not path.is_file()]  # the state for a restart lies among them
        for option, given in (("--out", args.out), ("--track", args.track), ("--json", args.json)):
            if given:
                raise InputError(option, "", f"is of one voyage, and {len(args.voyage)} are named", "name one")
        if not voyages:
            raise InputError(str(args.voyage[0]), "", "is no voyage", "name a folder that `companion run` left")
    code = 0
    for number, folder in enumerate(voyages):
        try:
            print(end="\n" if number else "")
            _tell(folder, args)
        except (InputError, JobError) as error:
            if len(voyages) == 1:
                raise
            sys.stdout.flush()
            sys.stderr.write(f"companion report: {error}\n")
            code = max(code, error.exit_code)
    return code


def _tell(folder: Path, args: argparse.Namespace) -> None:
    """Tell and draw one voyage. Raises InputError or JobError: it cannot be read, or not be drawn."""
    from companion.geofence.formats import format_of, write
    from companion.telemetry.folder import PICTURE, read_voyage

    for path in args.track:
        format_of(path, TRACKS)
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    record = read_voyage(folder)
    for path in args.track:
        write_out(
            write(track_of(record), path), str(path), lossy=False, force=args.force, remedy=f"write {', '.join(TRACKS)}"
        )
    if args.json:
        print(json.dumps(record.figures, indent=1))
        return
    # what is told needs no library that a boat does not have
    print("\n".join([*in_words(record), *(f"Track: {path}" for path in args.track)]), flush=True)
    try:
        from companion.plots.voyage import plot_voyage
    except ModuleNotFoundError as error:
        raise missing(error) or error from None

    out = args.out or folder / PICTURE
    with patience("drawing"):
        plot_voyage(record, out)
    print(f"Picture: {out}")


def track_of(record: VoyageRecord) -> Document:
    """Return the positions of a voyage as a document with one track."""
    import numpy as np

    from companion.geofence import Document
    from companion.geofence.document import Track
    from companion.messages import GeoPoint

    c = record.columns
    known = np.flatnonzero(np.isfinite(c["lat_deg"]) & np.isfinite(c["lon_deg"]))
    track = Track(
        points=tuple(GeoPoint(lat_deg=float(c["lat_deg"][k]), lon_deg=float(c["lon_deg"][k])) for k in known),
        times_s=None if record.epoch_s is None else tuple(record.epoch_s + float(c["t_s"][k]) for k in known),
        name=record.chart.name,
    )
    return Document(source=str(record.folder), format="voyage", tracks=(track,) if len(known) else ())


PAST = "past its edge"
FILE_OFF = 0.15  # speeds that are off by so much of the file's are the file's fault, not a day's ...
FILE_TOLD_S = 600.0  # ... over so long


def clearance_line(least_m: float, expected_m: float | None, contacts: int) -> str:
    """Return how near she came, beside what her plans expected, and how often she touched.

    Below 0 she was past an edge: the record does not say how far.
    """
    touched = f"{counted(contacts, 'contact')}!" if contacts else "no contact."
    expected = ""
    if expected_m is not None:
        expected = f" (plans expected {clearance_words(expected_m, PAST)}{' or more' if expected_m >= 0.0 else ''})"
    least = PAST if least_m < 0.0 else clearance_words(least_m)
    return f"Nearest to an obstacle or the fence: {least}{expected}, {touched}"


def in_words(record: VoyageRecord) -> list[str]:
    """Return a voyage as sentences."""
    from companion.figures import ranges_in_words
    from companion.plots.chart import date_words, place_words

    s, chart = record.summary, record.chart
    where = place_words(chart.origin.lat_deg, chart.origin.lon_deg)
    head = ", ".join(word for word in (chart.name, date_words(record.began_utc), where) if word)
    if s.arrived is None:
        return [head, "The voyage has no summary: it has not ended, or its end was not recorded.", *_plans(record)]
    lines = [head, *_starts(record), _end(record)]
    lines += _plans(record)
    if s.min_clearance_m is not None:
        lines.append(clearance_line(s.min_clearance_m, s.promised_clearance_m, s.contacts))
    if s.promised_risk is not None:
        whole = (
            "" if s.path_risk is None else f"Off the plan: {100.0 * s.path_risk:.0f} % was the highest chance told. "
        )
        times = _times(s.no_go_entries) if s.no_go_entries else "never"
        nearer = "" if s.no_go_entry_deg is None else f"nearer to the wind than {s.no_go_entry_deg:g}°, "
        lines.append(
            f"{whole}At each instant the chance that the wind closed the leg that she sailed was at most "
            f"{100.0 * s.promised_risk:.0f} %. No-go entries, {nearer}5° inside the angle to which the autopilot beats "
            f"(SAIL_NO_GO_ANGLE), for 5 s on end: {times}."
        )
    lines += ranges_in_words(s.figures)
    lines += boat_file_lines(s)
    if s.servos:
        moved = "; ".join(
            f"output {number}, {_times(servo.movements)} by {servo.travel_us} us in all"
            for number, servo in s.servos.items()
        )
        lines.append(f"Servos moved: {moved}. SERVOn_FUNCTION says what they are (26 rudder, 89 sheet).")
    if s.alerts:
        said = ", ".join(f"{code} {_times(number)}" for code, number in sorted(s.alerts.items()))
        lines.append(f"Announced: {said}.")
    if s.records_dropped:
        lines.append(f"{counted(s.records_dropped, 'record')} missing: {s.disk_trouble or 'the disk took no more'}.")
    return lines


def boat_file_lines(s: Summary) -> list[str]:
    """Return that her boat file is not the boat that sailed, and the remedy; empty: nothing tells it."""
    share = speed_share(s)
    if share is None or abs(share - 1.0) < FILE_OFF:
        return []
    how = "slower" if share < 1.0 else "faster"
    found = f"She sailed {how} than her boat file says, by {100.0 * FILE_OFF:.0f} % or more"
    return [f"{found}: after some hours under sail `companion boat learn VOYAGE_DIR ...` makes a file of what she is."]


def speed_share(s: Summary) -> float | None:
    """Return what she made of her boat file's speeds over a voyage, 1: all of it; None: too little tells it.

    What was learned under way tells it; else what was sailed against what was predicted, where the pace agrees.
    """
    sailed, predicted, pace, learned = (
        s.figures.get(name, {}).get("mean") for name in ("co_sailed", "co_predict", "co_pace", "co_learned")
    )
    if learned is not None or (s.time_s or 0.0) < FILE_TOLD_S:
        return learned
    if sailed is None or pace is None or not predicted:
        return None
    share = sailed / predicted
    return share if min(abs(share - 1.0), abs(pace - 1.0)) >= FILE_OFF and (share < 1.0) == (pace < 1.0) else None


def _starts(record: VoyageRecord) -> list[str]:
    if len(record.starts_s) < 2:
        return []
    after_s = record.starts_s[-1] - record.starts_s[0]
    starts = f"The companion was started {_times(len(record.starts_s))}: picture and track are of all of it"
    return [f"{starts}, what is told here of the last start, {after_s:.0f} s after the first."]


def _end(record: VoyageRecord) -> str:
    s = record.summary
    why = ": ".join(part for part in (s.end_reason or "unknown", s.end_why) if part)
    end = "Arrived" if s.arrived else f"Not arrived ({why})"
    if s.time_s is not None:
        end += f" after {time_words(s.time_s)} and {s.distance_m or 0.0:.0f} m"
    goals = f"; {s.goals_reached} of {counted(s.goals, 'goal')} reached" if s.goals is not None else ""
    return f"{end}, with {counted(s.tacks, 'tack')} and {counted(s.gybes, 'gybe')}{goals}."


def _plans(record: VoyageRecord) -> list[str]:
    reasons: dict[str, int] = {}
    since_s = max(record.starts_s, default=-math.inf)
    plans = [plan for plan in record.plans if plan.is_made and plan.t_s >= since_s]
    for plan in plans:
        reasons[plan.reason or "unknown"] = reasons.get(plan.reason or "unknown", 0) + 1
    made = max(record.summary.plans, len(plans)) if record.summary.records_dropped else len(plans)
    if not reasons:
        return ["No plan was made." if not made else f"{counted(made, 'plan')} made, none of them recorded."]
    why = ", ".join(
        f"{reason.replace('_', ' ')} {number}" for reason, number in sorted(reasons.items(), key=lambda r: -r[1])
    )
    known = "" if made == len(plans) else f", {len(plans)} of them recorded"
    return [f"{counted(made, 'plan')} made{known}, by reason: {why}."]


def _times(number: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(number, f"{number} times")

"""``companion status``: what the companion says of itself, heard on any link of the autopilot."""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import sys
from collections.abc import Callable
from typing import Any

from companion.geo.angles import direction
from companion.orders import Verb
from companion.program.arguments import number, radio_options
from companion.words import brief_time, counted

EXIT_NO_LINK, EXIT_STALE, EXIT_ALARM = 3, 4, 5
# States of the skipper that somebody ashore should look at.
ALARM_STATES = frozenset({"holding"})
ALARMS_OF_VESSELS = frozenset({"act", "touch"})
SCHEMA = "companion.status/1"


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "status",
        help=summary,
        description="Show the companion's status from its MAVLink messages alone, on another link of the autopilot: "
        "the shore end of a telemetry radio. Speaks once when it starts, so that the autopilot routes to it, and "
        "then only listens. Goes on until Ctrl-C; --once prints one status and ends.",
        epilog="Exit codes: 0 all is well, 3 no link or no companion heard, 4 what was heard is old, 5 the companion "
        "raises an alarm. Example: companion status --link /dev/ttyUSB0:57600 --once",
    )
    radio_options(parser)
    parser.add_argument("--once", action="store_true", help="print one status and end")
    parser.add_argument("--json", action="store_true", help="JSON, one object per status; unknown is null")
    parser.add_argument(
        "--timeout",
        type=number("s", above=0.0),
        default=10.0,
        metavar="S",
        help="how long to wait for the first status (default: 10)",
    )
    parser.add_argument(
        "--max-age",
        type=number("s", above=0.0),
        default=10.0,
        metavar="S",
        help="a status older than this is stale (default: 10)",
    )
    parser.add_argument(
        "--every",
        type=number("s", above=0.0),
        default=2.0,
        metavar="S",
        help="between two statuses, without --once (default: 2)",
    )
    parser.add_argument("--units", choices=("ms", "kn"), default="ms", help="unit of speeds in the text (default: ms)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.clock import run as run_loop
    from companion.errors import LinkError
    from companion.mavlink.transports import open_link

    try:
        return run_loop(_watch(args, open_link(args.link)))
    except LinkError as error:  # nobody answers, or the port is not to be had at all
        sys.stderr.write(f"companion status: {error}\n")
        return EXIT_NO_LINK


async def _watch(args: argparse.Namespace, transport: Any) -> int:
    from companion.clock import now_s
    from companion.mavlink.link import Link
    from companion.mavlink.reception import SHORE
    from companion.mavlink.wire import StatusReader, VehicleAssembler

    reader, vehicle = StatusReader(), VehicleAssembler()
    heard = asyncio.Event()
    async with Link(transport, identity=SHORE, target_system=args.system, streams=(), is_quiet=True) as link:

        def take(t_s: float, message: Any) -> None:
            vehicle.take(t_s, message)
            reader.take(t_s, message)
            heard.set()

        def has_enough() -> bool:
            """To be printed: anything of a companion; where that is all that is printed, everything."""
            report = reader.report(now_s())
            if report is None or not args.once:
                return report is not None
            return report.has_packed and vehicle.status is not None and vehicle.status.mode is not None

        link.subscribe(take)
        until_s = now_s() + args.timeout
        await link.wait_autopilot(args.timeout)
        try:
            async with asyncio.timeout_at(until_s):
                # The parts take turns on the air; a moment more brings the packed one and a heartbeat.
                while not has_enough():
                    heard.clear()
                    await heard.wait()
        except TimeoutError:
            if reader.report(now_s()) is None:
                sys.stderr.write(
                    f"companion status: an autopilot, but no companion heard on {transport.name} in "
                    f"{args.timeout:g} s\n"
                )
                return EXIT_NO_LINK
        if not args.once:
            sys.stderr.write(f"companion status: a status every {args.every:g} s until Ctrl-C; --once prints one\n")
        write: Callable[[dict[str, Any]], None] = _write_json if args.json else (lambda d: _write_text(d, args.units))
        while True:
            report = reader.report(now_s())
            assert report is not None
            document = status_document(report, vehicle.status, link.is_alive, link.bytes_per_s()[0], link.loss())
            write(document)
            if args.once:
                return exit_code(document, args.max_age)
            await asyncio.sleep(args.every)


def exit_code(document: dict[str, Any], max_age_s: float) -> int:
    """Return how the command ends with this status."""
    if document["age_s"] > max_age_s:
        return EXIT_STALE
    worst = None if document["traffic"] is None else document["traffic"]["worst"]
    is_near = worst is not None and worst["alarm"] in ALARMS_OF_VESSELS
    # held as she was told to: under another order she holds for a reason of her own
    is_ordered = document["order"] is not None and document["order"]["verb"] == Verb.HOLD
    return EXIT_ALARM if is_near or (document["state"] in ALARM_STATES and not is_ordered) else 0


def status_document(report: Any, autopilot: Any, is_alive: bool, bytes_in: float, loss: float) -> dict[str, Any]:
    """Return the JSON form: SI units, degrees where the key says so, an age in every group."""
    s = report.status
    wind_age = min((a for n, a in report.age_s.items() if n in {"status", "wind", "co_twd"}), default=None)
    return {
        "schema": SCHEMA,
        "age_s": round(report.newest_age_s, 2),
        "state": s.state,
        "alert": {"code": s.alert_code, "text": s.alert_text, "age_s": _age(report, "status")},
        "waypoint": {
            "seq": s.waypoint_seq,
            "count": s.waypoint_count,
            "distance_m": _round(s.waypoint_distance_m),
            "cross_track_m": _round(s.cross_track_m),
            "next_tack_s": s.next_tack_s,
            "age_s": _age(report, "status"),
        },
        "goal": {
            "index": s.goal_index,
            "count": s.goal_count,
            "distance_m": _round(s.goal_distance_m),
            "age_s": _age(report, "status"),
        },
        "wind": {
            "twd_deg": None if s.twd_from_rad is None else round(math.degrees(s.twd_from_rad), 1),
            "sigma_deg": None if s.twd_sigma_rad is None else round(math.degrees(s.twd_sigma_rad), 1),
            "tws_mps": _round(s.tws_mps),
            "tws_sigma_mps": _round(s.tws_sigma_mps),
            "reference": "ground",
            "age_s": None if wind_age is None else round(wind_age, 2),
        },
        "current": None
        if s.current_drift_mps is None
        else {
            "set_deg": None if s.current_set_rad is None else round(math.degrees(s.current_set_rad), 1),
            "drift_mps": _round(s.current_drift_mps),
            "age_s": _age(report, "status"),
        },
        "plan": {
            "id": s.plan_id,
            "plan_age_s": s.plan_age_s,
            "replans": s.replans,
            "tacks": s.tacks,
            "promised_risk": _round(s.promised_risk, 4),
            "clearance_m": _round(s.clearance_m),
            "age_s": _age(report, "status"),
        },
        "slow_computer": None
        if s.plan_answer_s is None
        else {"plan_answer_s": _round(s.plan_answer_s), "age_s": _age(report, "co_plan")},
        "order": None if not s.order else {"verb": s.order, "stands_s": s.order_age_s, "age_s": _age(report, "status")},
        "traffic": None if s.traffic is None else _traffic(s.traffic) | {"age_s": _age(report, "traffic")},
        "position": None
        if s.position is None
        else {"lat_deg": s.position.lat_deg, "lon_deg": s.position.lon_deg, "age_s": _age(report, "status")},
        "autopilot": {
            "mode": None if autopilot is None or autopilot.mode is None else autopilot.mode.name,
            "armed": None if autopilot is None else autopilot.is_armed,
            "battery_v": _round(s.battery_v),
            "heard": is_alive,
        },
        "link": {
            "bytes_per_s_in": round(bytes_in),
            "loss": round(loss, 4),
            "companion_bytes_per_s": None if s.bytes_out_per_s is None else round(s.bytes_out_per_s),
        },
        "ages_s": {name: round(age, 2) for name, age in report.age_s.items()},
    }


def _traffic(seen: Any) -> dict[str, Any]:
    worst = (
        None
        if not seen.alarm
        else {
            "name": seen.name,
            "alarm": seen.alarm,
            "role": seen.role,
            "rule": seen.rule,
            "range_m": _round(seen.range_m),
            "bearing_deg": None if seen.bearing_rad is None else round(math.degrees(seen.bearing_rad), 1),
            "cpa_m": _round(seen.cpa_m),
            "tcpa_s": seen.tcpa_s,
        }
    )
    return {
        "promised_risk": _round(seen.promised_risk, 4),
        "path_risk": _round(seen.path_risk, 4),
        "vessels": seen.vessels,
        "worst": worst,
        "silence_s": seen.silence_s,
        "refused": seen.refused,
        "feeds": seen.feeds,
        "silent_feeds": seen.silent_feeds,
        "shared_mmsi": seen.shared_mmsi,
        "clock_jumps": seen.clock_jumps,
    }


def traffic_line(seen: dict[str, Any]) -> str:
    """Return the line about other vessels."""
    parts = [f"{seen['vessels']} vessel{'' if seen['vessels'] == 1 else 's'}"]
    worst = seen["worst"]
    if worst is not None:
        when = "opening" if worst["tcpa_s"] is None else f"in {worst['tcpa_s']:.0f} s"
        parts.append(
            f"{worst['name']}: {worst['alarm'].upper()}, {worst['range_m']:.0f} m "
            f"at {direction(math.radians(worst['bearing_deg']))}°, "
            f"CPA {worst['cpa_m']:.0f} m {when}, {worst['role']} (rule {worst['rule']})"
        )
    if seen["promised_risk"]:
        each, whole = 100.0 * seen["promised_risk"], 100.0 * seen["path_risk"]
        parts.append(f"too near one: {each:.1f} % at each instant, {whole:.1f} % on the way")
    if seen["feeds"]:
        parts.append(f"{seen['silent_feeds']} of {counted(seen['feeds'], 'feed')} silent")
    if seen["silence_s"] is not None:
        parts.append(f"last report {seen['silence_s']:.0f} s ago")
    if seen["refused"]:
        parts.append(f"{seen['refused']} refused")
    odd = {"shared MMSI": seen["shared_mmsi"], "clock jumps": seen["clock_jumps"]}
    parts += [f"{name} {count}" for name, count in odd.items() if count]
    return " | ".join(parts)


def _age(report: Any, part: str) -> float | None:
    age = report.age_s.get(part)
    return None if age is None else round(age, 2)


def _round(value: float | None, digits: int = 2) -> float | None:
    return None if value is None else round(value, digits)


def _write_json(document: dict[str, Any]) -> None:
    print(json.dumps(document), flush=True)


def _write_text(d: dict[str, Any], units: str) -> None:
    """Print the status as four lines; nothing without its age."""
    factor, unit = (1.943844, "kn") if units == "kn" else (1.0, "m/s")

    def show(value: float | None, form: str = ".0f", scale: float = 1.0) -> str:
        return "-" if value is None else format(value * scale, form)

    def toward(angle_deg: float | None) -> str:
        return "-" if angle_deg is None else direction(math.radians(angle_deg))

    w, wind, plan, goal, pilot = d["waypoint"], d["wind"], d["plan"], d["goal"], d["autopilot"]
    state = d["state"].upper() or "state not heard yet"
    helm = (
        "autopilot's mode not heard yet"
        if pilot["mode"] is None
        else f"{pilot['mode']} {'ARMED' if pilot['armed'] else 'disarmed'}"
    )
    tack = "-" if w["next_tack_s"] is None else f"about {brief_time(w['next_tack_s'])}"
    replans = "- replans" if plan["replans"] is None else counted(plan["replans"], "replan")
    safe = None if plan["promised_risk"] is None else 1.0 - plan["promised_risk"]
    print(f"{state}  {helm}  (age {d['age_s']:.1f} s)  {d['alert']['text']}")
    print(
        f"  WP {show(w['seq'])}/{show(w['count'])} {show(w['distance_m'])} m  xt {show(w['cross_track_m'], '+z.1f')} m"
        f"  next tack {tack} | goal {show(goal['distance_m'])} m"
        f"  ({(goal['index'] or 0) + 1} of {show(goal['count'])})"
    )
    print(
        f"  TWD {toward(wind['twd_deg'])}±{show(wind['sigma_deg'])}°"
        f"  TWS {show(wind['tws_mps'], '.1f', factor)} {unit}  (age {show(wind['age_s'], '.1f')} s)"
        f" | outside no-go {show(safe, '.2f')}  clearance {show(plan['clearance_m'])} m"
        f"  plan #{show(plan['id'])} {show(plan['plan_age_s'])} s old, {replans}"
    )
    if d["current"] is not None:
        print(
            f"  current sets {toward(d['current']['set_deg'])}° {show(d['current']['drift_mps'], '.2f', factor)} {unit}"
        )
    if d["slow_computer"] is not None:
        print(f"  slow computer: nine plans of ten within {show(d['slow_computer']['plan_answer_s'])} s")
    if d["order"] is not None:
        print(f"  order {d['order']['verb']}, for {show(d['order']['stands_s'], '.0f', 1.0 / 60.0)} min")
    if d["traffic"] is not None:
        print(f"  {traffic_line(d['traffic'])}")
    link = d["link"]
    print(
        f"  battery {show(pilot['battery_v'], '.1f')} V | link {link['bytes_per_s_in']} B/s in,"
        f" loss {100.0 * link['loss']:.0f} %, companion {show(link['companion_bytes_per_s'])} B/s",
        flush=True,
    )

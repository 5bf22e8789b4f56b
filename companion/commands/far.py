"""``companion far``: the end ashore of a satellite link: makes orders of 24 bytes, reads statuses of 42 bytes."""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import math
import os
import string
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import force_option, refuse_existing, write_files
from companion.errors import InputError, JobError, unreadable
from companion.geo.angles import direction
from companion.program.arguments import add_command, duration, system_id, whole
from companion.words import counted

if TYPE_CHECKING:
    from companion.orders.far import FarRoute, FarStatus


_EPILOG = """\
examples:
  companion key new far.key                      (the same file on board: companion run ... --far DIR --far-key far.key)
  companion far order hold --key far.key --expires 2h --out hold.sbd
  companion far order goal 50.8195 -1.3080 --key far.key --expires 90m
  companion far order refuge Mill Bay --key far.key --expires 1d
  companion far begin --key far.key --expires 1d --out begin.sbd     (the counters count from 1 again)
  companion far status status.sbd --key far.key
  companion far route route.sbd --key far.key --mission mission.toml --out new.toml
  companion far status 010600... --key far.key   (as hexadecimal digits, from a web page or a mail)

An order is 24 bytes, and is printed as hexadecimal digits for a web form. How it reaches the boat is the modem's
business: late, twice, or not at all. It counts once, and not after it has expired. What became of it is in the statuses
that follow. To send it again send the same bytes; a new `far order` is a second order. Which verbs are taken is in the
mission: [operator] far_orders = ["hold", ...]. `why` does nothing, and brings a status. Verbs: companion order --help.
Where the boat and this end have lost each other's count (a counter file that is gone, a computer on board that is new,
counters that are used up) begin anew: 15 bytes, after which the next order is number 1.
Exit codes: 0 done, 1 not, 2 an invalid file or option.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verbs."""
    parser = add_command(subparsers, "far", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="order|begin|status|route", required=True)
    order = verbs.add_parser("order", help="make an order of 24 bytes")
    order.add_argument("words", nargs="+", metavar="VERB [ARGS]", help="the order, as for `companion order`")
    begin = verbs.add_parser("begin", help="let the counters of orders count from 1 again")
    begin.set_defaults(run=run_begin)
    for verb in (order, begin):
        verb.add_argument(
            "--expires",
            type=duration,
            required=True,
            metavar="TIME",
            help="it counts for nothing after so long, at most 7d: 90m, 2h, 1d",
        )
        verb.add_argument("--out", type=Path, metavar="FILE", help="write the bytes there, too")
        force_option(verb)
    order.add_argument(
        "--counter",
        type=whole(at_least=1, at_most=0xFFFF),
        metavar="N",
        help=f"its counter (default: one more than the last, which is kept in KEY{COUNTER}; where that "
        "file is lost, the boat's status tells the last that she took)",
    )
    order.set_defaults(run=run_order)
    status = verbs.add_parser("status", help="read a status of 42 bytes")
    status.add_argument("source", metavar="FILE|HEX", help="the bytes: in a file, or as hexadecimal digits")
    status.set_defaults(run=run_status)
    route = verbs.add_parser("route", help="read a route that `companion passage ... --far-out` made, as a mission")
    route.add_argument("source", metavar="FILE|HEX", help="the bytes: in a file, or as hexadecimal digits")
    route.add_argument("--mission", type=Path, metavar="M", help="the mission under way: boat, area and the rest of it")
    route.add_argument("--out", type=Path, metavar="NEW", help="write it there, beside M, with the places of the route")
    force_option(route)
    route.set_defaults(run=run_route)
    for verb in (order, begin, status, route):
        verb.add_argument("--key", type=Path, required=True, metavar="FILE", help="the key, as on board")
        verb.add_argument(
            "--system",
            type=system_id,
            default=1,
            metavar="N",
            help="MAVLink system id of the boat's autopilot (default: 1)",
        )


COUNTER = ".far-counter"  # beside the key: the last counter that was used with it, and since which beginning


@dataclass(frozen=True, slots=True)
class _Count:
    """The last counter that was used, 0: none, since the beginning at the minute ``began``, 0: there was none."""

    last: int = 0
    began: int = 0


def run_order(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.signing import read_key
    from companion.orders import phrase
    from companion.orders.far import FarKey, FarOrder, pack_order

    wanted, key = phrase(args.words), FarKey(read_key(args.key), args.system)
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    expires_min = _expires_min(args)
    with _alone_with(args.key):
        count = _next_count(args.key, args.counter)
        try:
            data = pack_order(
                FarOrder(wanted=wanted, counter=count.last, expires_min=expires_min), key.since(count.began)
            )
        except ValueError as error:
            raise InputError(" ".join(args.words)[:40], "", str(error)) from None
        _keep_count(args.key, count)  # before anybody can send it: a counter is never used twice
    _hand_out(args, data)
    print(f"order {count.last}: {wanted.words}, counts until {moment(expires_min)}")
    return 0


def run_begin(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.signing import read_key
    from companion.orders.far import Beginning, FarKey, minutes_of, pack_beginning

    key = FarKey(read_key(args.key), args.system)
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    expires_min, now_min = _expires_min(args), minutes_of(time.time())
    with _alone_with(args.key):
        count, _ = _read_count(args.key)
        # One of a clock that was wrong ashore is not counted on from: the boat has refused it.
        began = count.began + 1 if now_min <= count.began < now_min + 60 else now_min
        data = pack_beginning(Beginning(began=began, expires_min=expires_min), key)
        _keep_count(args.key, _Count(0, began))
    _hand_out(args, data)
    print(
        f"beginning of {moment(began)}, counts until {moment(expires_min)}: send it again until a status tells "
        "it; the next order is number 1, and what was given before does not count any more"
    )
    return 0


def _expires_min(args: argparse.Namespace) -> int:
    from companion.orders.far import minutes_of

    # The last minute in which it counts is whole: what is cut off is given on top.
    return minutes_of(time.time() + args.expires) + 1


def _hand_out(args: argparse.Namespace, data: bytes) -> None:
    if args.out is not None:
        write_files({str(args.out): data}, force=args.force)
    print(data.hex())


@contextlib.contextmanager
def _alone_with(key: Path) -> Iterator[None]:
    """Let two that give orders with one key at once have one counter each."""
    fd = os.open(key, os.O_RDONLY | os.O_CLOEXEC)
    try:
        fcntl.flock(fd, fcntl.LOCK_EX)
        yield
    finally:
        os.close(fd)


def _read_count(key: Path) -> tuple[_Count, str]:
    """Return what is kept beside the key, and why it cannot be believed, empty: it can, or there is none yet."""
    from companion.orders.far import MOST_COUNTER

    path = key.with_name(key.name + COUNTER)
    try:
        text = path.read_text("ascii")
        last, began = [int(word) for word in f"{text} 0".split()[:2]]
        if not (0 <= last <= MOST_COUNTER and 0 <= began < 1 << 24):
            return _Count(), f"{text.strip()[:20]!r} is no counter"
    except FileNotFoundError:
        return _Count(), ""
    except (OSError, ValueError) as error:
        return _Count(), str(error)
    return _Count(last, began), ""


def _next_count(key: Path, given: int | None) -> _Count:
    from companion.orders.far import MOST_COUNTER, MOST_JUMP

    count, trouble = _read_count(key)
    if given is None and trouble:
        raise InputError(
            str(key.with_name(key.name + COUNTER)),
            "",
            f"the last counter cannot be read ({trouble})",
            "count from 1 again: companion far begin; or name one with --counter: one more than the "
            "last that the boat's status tells",
        )
    if given is None and count.last >= MOST_COUNTER:
        raise JobError(f"{key}: all {MOST_COUNTER} counters are used up; count from 1 again: companion far begin")
    if given is not None and not trouble and given <= count.last:
        raise InputError(
            "--counter",
            str(given),
            f"is not after the last, {count.last}, and none is used twice",
            f"leave it out, or say {count.last + 1} or more",
        )
    if given is not None and count.last and given > count.last + MOST_JUMP:
        raise InputError(
            "--counter",
            str(given),
            f"is more than {MOST_JUMP} ahead of the last, {count.last}, and the boat takes no such",
            "where she has another count, begin anew: companion far begin",
        )
    return _Count(count.last + 1 if given is None else given, count.began)


def _keep_count(key: Path, count: _Count) -> None:
    from companion.disk import Disk, reason

    path = key.with_name(key.name + COUNTER)
    try:
        Disk().replace(path, f"{count.last}{f' {count.began}' if count.began else ''}\n".encode("ascii"))
    except OSError as error:
        raise JobError(
            f"{path}: cannot be written ({reason(error)}), and without it a counter would be used twice"
        ) from error


def run_status(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.signing import read_key
    from companion.orders.far import FarKey, unpack_status

    data = _bytes_of(args.source)
    try:
        status = unpack_status(data, FarKey(read_key(args.key), args.system))
    except ValueError as error:
        raise InputError(args.source[:60], "", f"is refused: {error}") from None
    for line in lines_of(status, time.time()):
        print(line)
    return 0


def run_route(args: argparse.Namespace) -> int:
    """Print a route that came from far away; with a mission and a file for it, write it as that mission's goals."""
    from companion.mavlink.signing import read_key
    from companion.orders.far import FarKey, unpack_route

    if (args.mission is None) != (args.out is None):
        raise InputError("companion far route", "--out", "and --mission go together", "say both")
    try:
        route = unpack_route(_bytes_of(args.source), FarKey(read_key(args.key), args.system))
    except ValueError as error:
        raise InputError(args.source[:60], "", f"is refused: {error}") from None
    for line in lines_of_route(route):
        print(line)
    if args.out is not None:
        _write_route(route, args.mission, args.out, force=args.force)
        print(f"{args.out}: written: companion mission check {args.out}")
    return 0


def lines_of_route(route: FarRoute) -> list[str]:
    """Return a route in words."""

    def when(utc_s: float) -> str:
        return f"{datetime.fromtimestamp(utc_s, UTC):%Y-%m-%dT%H:%MZ}"

    from companion.orders.far import MIDDLE_S

    lines = [
        f"route of {when(route.departs_utc_s)}, by a forecast of {when(route.base_utc_s)} with"
        f" {counted(route.members, 'member')}: {counted(len(route.places), 'place')},"
        f" hours to {counted(round(MIDDLE_S / 60.0), 'minute')}"
        + (f"; {route.left_out} more are not in it: send them before she is there" if route.left_out else "")
    ]
    for k, place in enumerate(route.places):
        said = "" if place.middle_s is None or not k else f"  by {when(route.departs_utc_s + place.middle_s)}"
        if said:
            said += " as often as not" if place.early_s or place.late_s else ""
            said += f" (-{place.early_s / 3600.0:.1f} to +{place.late_s / 3600.0:.1f} h)" if route.members > 1 else ""
        band = f"  {place.band_m:.0f} m to each side" if k else ""
        lines.append(f"  {k}: {place.point.lat_deg:.5f}, {place.point.lon_deg:.5f}{band}{said}")
    return lines


def _write_route(route: FarRoute, mission: Path, out: Path, *, force: bool) -> None:
    import tomllib

    from companion.geofence import load_mission
    from companion.geofence.mission import toml
    from companion.orders.far import bands_m
    from companion.passage.mission import WAYPOINT_M, goals_of

    if out.parent.resolve() != mission.parent.resolve():
        raise InputError(str(out), "", "is in another folder", f"write it beside {mission}, whose files it names")
    load_mission(mission)  # in one line what is wrong with it
    try:
        tables = tomllib.loads(mission.read_text(encoding="utf-8"))
    except OSError as error:
        raise unreadable(str(mission), error) from None
    last = tables["goal"][-1] if tables.get("goal") else {}
    points = tuple(place.point for place in route.places)
    if len(points) < 2:
        raise InputError("the route", "", "has one place only", "send it again, from where she is")
    made = goals_of(points, bands_m(route.places), float(last.get("radius_m", 200.0)))
    if route.left_out:  # the last one is a place on the way
        made["goal"][-1] |= {"name": f"waypoint {len(points) - 1}", "radius_m": WAYPOINT_M}
    tables |= {
        "start": made["start"],
        "goal": made["goal"],
        "passage": {**tables.get("passage", {}), **made["passage"]},
    }
    write_files({str(out): toml(tables).encode()}, force=force)


def _bytes_of(source: str) -> bytes:
    """Return the bytes of a message: a file's, or hexadecimal digits, in a file too. Raises InputError."""
    path = Path(source)
    text = source
    try:
        if len(source) < 255 and path.exists():
            data = path.read_bytes()[:1000]
            text = data.decode("ascii")
            return bytes.fromhex(text)
    except OSError as error:
        raise unreadable(source, error) from error
    except ValueError:
        return data
    try:
        return bytes.fromhex(text)
    except ValueError:
        is_cut = all(c in string.hexdigits or c.isspace() for c in source)
        what = "is an odd number of hexadecimal digits" if is_cut else "no such file, and no hexadecimal digits"
        remedy = "paste all of them" if is_cut else "name the file of the message, or paste its digits"
        raise InputError(source[:60], "", what, remedy) from None


def lines_of(status: FarStatus, unix_s: float) -> list[str]:
    """Return a status in words at ``unix_s``; a figure that the boat did not know is a dash."""
    s = status
    when = "at a time that she does not know"
    if s.minute is not None:
        from companion.orders.far import unix_of

        minutes = math.floor((unix_s - unix_of(s.minute)) / 60.0)
        when = f"{moment(s.minute)}, {_age(minutes)}"
    helm = ("armed" if s.is_armed else "disarmed") if s.is_heard else "the autopilot is not heard"
    place = "-" if s.position is None else f"{s.position.lat_deg:.5f} {s.position.lon_deg:.5f}"
    standing = "" if s.standing is None else f"; under the order {s.standing}"
    goal = f"goal {_figure(s.goal)} of {_figure(s.goals)}, {_figure(s.goal_m)} m to it"
    twd = "-" if s.twd_from_rad is None else direction(s.twd_from_rad)
    wind = f"wind from {twd} ± {_degrees(s.twd_sigma_rad, '.0f')} deg, "
    safe = None if s.promised_risk is None else 1.0 - s.promised_risk
    plan = f"plan {_figure(s.plan_age_s, '.0f', 1.0 / 60.0)} min old, outside no-go {_figure(safe, '.2f')}"
    vessels = f"; vessels: {s.alarm}, CPA {_figure(s.cpa_m)} m" if s.alarm else ""
    lines = [
        f"{when} (number {s.sequence})",
        f"{s.phase.upper()}, {'under way' if s.is_under_way else 'not under way'}, {helm}{standing}",
        f"at {place}, {_figure(s.speed_mps, '.1f')} m/s; {goal}, {_figure(s.waypoint_m)} m to the waypoint",
        f"{wind}{_figure(s.tws_mps, '.1f')} m/s; {plan}, {_figure(s.clearance_m)} m clear",
        f"battery {_figure(s.battery_v, '.1f')} V; {s.watchdog.upper() or 'no watchdog is raised'}{vessels}",
    ]
    if s.has_trouble:
        lines.append("her disk does not keep what it should")
    lines.append(
        "no order has come" if s.reply is None else str(s.reply) if s.order is None else f"order {s.order}: {s.reply}"
    )
    return lines


def _age(minutes: int) -> str:
    if minutes < 0:
        return f"{-minutes} min AHEAD of the clock here"
    return f"{minutes} min ago" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min ago"


def _figure(value: float | None, form: str = ".0f", scale: float = 1.0) -> str:
    return "-" if value is None else format(value * scale, form)


def _degrees(angle_rad: float | None, form: str) -> str:
    return "-" if angle_rad is None else format(math.degrees(angle_rad), form)


def moment(minutes: int) -> str:
    """Return a minute's date and time."""
    from companion.orders.far import unix_of

    return f"{datetime.fromtimestamp(unix_of(minutes), UTC):%Y-%m-%d %H:%M} UTC"

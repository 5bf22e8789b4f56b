"""``companion far status``: reads a status of 42 bytes, and says it in words."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.far.moments import moment
from companion.errors import InputError, unreadable

if TYPE_CHECKING:
    from companion.orders.far import FarStatus


def run_status(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.transports import read_key
    from companion.orders.far import FarKey, unpack_status

    data = _bytes_of(args.source)
    try:
        status = unpack_status(data, FarKey(read_key(args.key), args.system))
    except ValueError as error:
        raise InputError(args.source[:60], "", f"is refused: {error}") from None
    for line in lines_of(status, time.time()):
        print(line)
    return 0


def _bytes_of(source: str) -> bytes:
    """Return the bytes of a file, or of hexadecimal digits, in a file too."""
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
        raise InputError(source[:60], "", "is neither a file nor hexadecimal digits",
                         "name the file with the 42 bytes, or paste its digits") from None


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
    wind = f"wind from {_degrees(s.twd_from_rad, '03.0f')} ± {_degrees(s.twd_sigma_rad, '.0f')} deg, "
    safe = None if s.promised_risk is None else 1.0 - s.promised_risk
    plan = f"plan {_figure(s.plan_age_s, '.0f', 1.0 / 60.0)} min old, P(safe) {_figure(safe, '.2f')}"
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
    lines.append("no order has come" if s.reply is None else
                 str(s.reply) if s.order is None else f"order {s.order}: {s.reply}")
    return lines


def _age(minutes: int) -> str:
    if minutes < 0:
        return f"{-minutes} min AHEAD of the clock here"
    return f"{minutes} min ago" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min ago"


def _figure(value: float | None, form: str = ".0f", scale: float = 1.0) -> str:
    return "-" if value is None else format(value * scale, form)


def _degrees(angle_rad: float | None, form: str) -> str:
    return "-" if angle_rad is None else format(math.degrees(angle_rad), form)

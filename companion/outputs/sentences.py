"""NMEA 0183 sentences, one function each: SI values in, a line of at most 82 characters out.

Fields as in NMEA 0183 version 3.01, which OpenCPN and all others understand. What is not known is an empty field, never
0; a reading that is not to be believed has the status V.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import reduce
from operator import xor

from companion.geo.angles import wrap_two_pi
from companion.geo.units import M_PER_NM, MPS_PER_KNOT
from companion.messages import GeoPoint

TALKER = "II"          # integrated instrumentation
MAX_CHARACTERS = 82    # from $ to the line end, both included
NAME_CHARACTERS = 8    # of a waypoint: more than a few do not fit into the sentences of a route
_FRAME = len("$*00\r\n")
_MOST_XTE_NM = 9.99    # what the field of a cross-track error holds


def sentence(kind: str, *fields: str) -> str:
    r"""Return a sentence with talker, checksum and line end.

    >>> sentence("HDT", "123.0", "T")
    '$IIHDT,123.0,T*22\r\n'

    Raises:
        ValueError: it is longer than ``MAX_CHARACTERS``, or a field holds a character that would end it.
    """
    body = ",".join((TALKER + kind, *fields))
    if len(body) + _FRAME > MAX_CHARACTERS:
        raise ValueError(f"{kind} has {len(body) + _FRAME} characters, NMEA 0183 allows {MAX_CHARACTERS}")
    if not re.fullmatch(r"[ -~]*", body) or re.search(r"[$!*\\^~]", body) or any("," in field for field in fields):
        raise ValueError(f"{kind} holds a character that NMEA 0183 keeps for itself: {body!r}")
    return f"${body}*{reduce(xor, body.encode('ascii'), 0):02X}\r\n"


def name_of(text: str) -> str:
    """Return a waypoint's name as the sentences carry it.

    >>> name_of("Nab Tower, north"), name_of("*")
    ('NabTower', '')
    """
    return re.sub(r"[^A-Za-z0-9_-]+", "", text)[:NAME_CHARACTERS]


def mwv(angle_rad: float, speed_mps: float, *, is_apparent: bool, is_valid: bool = True) -> str:
    """Return the wind's angle to the bow [rad, starboard positive] and its speed: on the boat, or the true one."""
    return sentence("MWV", _degrees(angle_rad), "R" if is_apparent else "T", _knots(speed_mps), "N",
                    "A" if is_valid else "V")


def mwd(from_rad: float, speed_mps: float) -> str:
    """Return the direction that the true wind comes from, and its speed."""
    return sentence("MWD", _degrees(from_rad), "T", "", "M", _knots(speed_mps), "N", f"{speed_mps:.1f}", "M")


def vdr(set_rad: float, drift_mps: float) -> str:
    """Return where the current goes, and how fast."""
    return sentence("VDR", _degrees(set_rad), "T", "", "M", _knots(drift_mps), "N")


def hdt(heading_rad: float) -> str:
    """Return the true heading."""
    return sentence("HDT", _degrees(heading_rad), "T")


def rmc(utc_s: float | None, point: GeoPoint | None, speed_mps: float | None, course_rad: float | None) -> str:
    """Return position, speed and course over ground; without a position the status is V. ``utc_s`` is Unix time."""
    when = None if utc_s is None else datetime.fromtimestamp(utc_s, UTC)
    clock, day = ("", "") if when is None else (f"{when:%H%M%S}.{when.microsecond // 10_000:02d}", f"{when:%d%m%y}")
    speed = "" if point is None or speed_mps is None else _knots(speed_mps)
    course = "" if point is None or course_rad is None else _degrees(course_rad)
    return sentence("RMC", clock, "V" if point is None else "A", *_place(point), speed, course, day, "", "",
                    "N" if point is None else "A")


def apb(
    right_of_leg_m: float, leg_rad: float, bearing_rad: float, name: str, *, is_inside: bool, is_past: bool,
    steer_rad: float | None = None,
) -> str:
    """Return what an autopilot needs: the distance off the leg, the leg's and the waypoint's bearing, what to steer.

    ``is_inside`` the circle of arrival; ``is_past`` the line across the leg at the waypoint.
    """
    off, side = _off_track(right_of_leg_m)
    return sentence(
        "APB", "A", "A", off, side, "N", _flag(is_inside), _flag(is_past), _degrees(leg_rad), "T", name,
        _degrees(bearing_rad), "T", _degrees(bearing_rad if steer_rad is None else steer_rad), "T")


def rmb(
    right_of_leg_m: float, origin: str, name: str, point: GeoPoint, distance_m: float, bearing_rad: float,
    closing_mps: float | None, *, has_arrived: bool,
) -> str:
    """Return the waypoint: where it is, how far, how fast she comes nearer to it."""
    off, side = _off_track(right_of_leg_m)
    return sentence(
        "RMB", "A", off, side, origin, name, *_place(point), _miles(distance_m),
        _degrees(bearing_rad), "" if closing_mps is None else _knots(closing_mps), _flag(has_arrived))


def wpl(point: GeoPoint, name: str) -> str:
    """Return where a waypoint is."""
    return sentence("WPL", *_place(point), name)


def rte(route: str, names: Sequence[str]) -> list[str]:
    """Return the sentences that name a route's waypoints in their order, as few as hold them."""
    room = MAX_CHARACTERS - _FRAME - len(f"{TALKER}RTE,99,99,c,{route}")
    parts: list[list[str]] = [[]]
    left = room
    for name in names:
        if parts[-1] and len(name) + 1 > left:
            parts.append([])
            left = room
        parts[-1].append(name)
        left -= len(name) + 1
    return [sentence("RTE", str(len(parts)), str(number), "c", route, *part) for number, part in enumerate(parts, 1)]


def _place(point: GeoPoint | None) -> tuple[str, str, str, str]:
    if point is None:
        return "", "", "", ""
    return (_minutes(point.lat_deg, 2), "S" if point.lat_deg < 0.0 else "N", _minutes(point.lon_deg, 3),
            "W" if point.lon_deg < 0.0 else "E")


def _minutes(degrees: float, digits: int) -> str:
    """Return degrees and minutes to 0.2 m; rounded as one number, so that no 60 minutes come of it."""
    parts = round(abs(degrees) * 600_000.0)
    whole, rest = divmod(parts, 600_000)
    return f"{whole:0{digits}d}{rest // 10_000:02d}.{rest % 10_000:04d}"


def _degrees(angle_rad: float) -> str:
    return f"{round(math.degrees(wrap_two_pi(angle_rad)), 1) % 360.0:.1f}"


def _knots(speed_mps: float) -> str:
    return f"{speed_mps / MPS_PER_KNOT:.1f}"


def _miles(distance_m: float) -> str:
    miles = min(999.9, distance_m / M_PER_NM)
    return f"{miles:.3f}" if miles < 99.0 else f"{miles:.1f}"   # the longest sentence of all has no room for more


def _off_track(right_of_leg_m: float) -> tuple[str, str]:
    """Return the distance off the leg, and the side to steer to."""
    return f"{min(_MOST_XTE_NM, abs(right_of_leg_m) / M_PER_NM):.4f}", "L" if right_of_leg_m > 0.0 else "R"


def _flag(is_so: bool) -> str:
    return "A" if is_so else "V"

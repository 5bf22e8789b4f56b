"""The view as NMEA 0183: what an instrument shows, where the boat is bound for, the route that it sails.

Fields as in NMEA 0183 version 3.01, which OpenCPN and all others understand. What is not known is an empty field, never
0; a reading that is not to be believed has the status V.
"""

from __future__ import annotations

import asyncio
import errno
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, cast

from companion.addresses import OutputName
from companion.clock import now_s
from companion.geo import M_PER_NM, MPS_PER_KNOT
from companion.geo.angles import heading_of, wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.outputs.outlet import Outlet, Say
from companion.view import View
from companion.view.values import GoalView, LegView, PointEn

TALKER = "II"  # integrated instrumentation
MAX_CHARACTERS = 82  # from $ to the line end, both included
NAME_CHARACTERS = 8  # of a waypoint: more than a few do not fit into the sentences of a route
FRESH_S = 5.0  # what is older is not told as if it were so now
INSIDE_M = 5.0  # of a waypoint: ArduRover announces it 3 to 5 m early
SAME_M = 1.0  # a waypoint nearer to a goal than this is the goal's
ROUTE = "companion"
ORIGIN = "FROM"  # the name of where the leg begins
UNTRUSTED = frozenset({"none", "untrusted"})  # of a wind's health: shown as not valid
ROUTE_EVERY_S = 60.0  # who comes to a broadcast later has the route after this long
MOST_CLIENTS = 16
BEHIND_BYTES = 16_384  # a client that has not read so much misses what comes
PATIENCE_S = 10.0  # ... and is hung up on after this long
_FRAME = len("$*00\r\n")
_MOST_XTE_NM = 9.99  # what the field of a cross-track error holds


def sentence(kind: str, *fields: str) -> str:
    r"""Return a sentence with talker, checksum and line end.

    >>> sentence("HDT", "123.0", "T")
    '$IIHDT,123.0,T*22\r\n'

    Raises:
        ValueError: it is longer than ``MAX_CHARACTERS``, or a field holds a character that would end it.
    """
    from pyais.util import compute_checksum  # 4 MB, for who has an instrument or a receiver

    body = ",".join((TALKER + kind, *fields))
    if len(body) + _FRAME > MAX_CHARACTERS:
        raise ValueError(f"{kind} has {len(body) + _FRAME} characters, NMEA 0183 allows {MAX_CHARACTERS}")
    if not re.fullmatch(r"[ -~]*", body) or re.search(r"[$!*\\^~]", body) or any("," in field for field in fields):
        raise ValueError(f"{kind} holds a character that NMEA 0183 keeps for itself: {body!r}")
    return f"${body}*{compute_checksum('$' + body):02X}\r\n"


def name_of(text: str) -> str:
    """Return a waypoint's name as the sentences carry it.

    >>> name_of("Nab Tower, north"), name_of("*")
    ('NabTower', '')
    """
    return re.sub(r"[^A-Za-z0-9_-]+", "", text)[:NAME_CHARACTERS]


def mwv(angle_rad: float, speed_mps: float, *, is_apparent: bool, is_valid: bool = True) -> str:
    """Return the wind's angle to the bow [rad, starboard positive] and its speed: on the boat, or the true one."""
    return sentence(
        "MWV", _degrees(angle_rad), "R" if is_apparent else "T", _knots(speed_mps), "N", "A" if is_valid else "V"
    )


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
    return sentence(
        "RMC",
        clock,
        "V" if point is None else "A",
        *_place(point),
        speed,
        course,
        day,
        "",
        "",
        "N" if point is None else "A",
    )


def apb(right_of_leg_m: float, leg_rad: float, bearing_rad: float, name: str, *, is_inside: bool, is_past: bool) -> str:
    """Return what an autopilot needs: the distance off the leg, the leg's bearing, the waypoint's, which it steers.

    ``is_inside`` the circle of arrival; ``is_past`` the line across the leg at the waypoint.
    """
    off, side = _off_track(right_of_leg_m)
    return sentence(
        "APB",
        "A",
        "A",
        off,
        side,
        "N",
        _flag(is_inside),
        _flag(is_past),
        _degrees(leg_rad),
        "T",
        name,
        _degrees(bearing_rad),
        "T",
        _degrees(bearing_rad),
        "T",
    )


def rmb(
    right_of_leg_m: float,
    name: str,
    point: GeoPoint,
    distance_m: float,
    bearing_rad: float,
    closing_mps: float | None,
    *,
    has_arrived: bool,
) -> str:
    """Return the waypoint: where it is, how far, how fast the boat comes nearer to it."""
    off, side = _off_track(right_of_leg_m)
    return sentence(
        "RMB",
        "A",
        off,
        side,
        ORIGIN,
        name,
        *_place(point),
        _miles(distance_m),
        _degrees(bearing_rad),
        "" if closing_mps is None else _knots(closing_mps),
        _flag(has_arrived),
    )


def wpl(point: GeoPoint, name: str) -> str:
    """Return where a waypoint is."""
    return sentence("WPL", *_place(point), name)


def rte(names: Sequence[str]) -> list[str]:
    """Return the sentences that name a route's waypoints in their order, as few as hold them."""
    room = MAX_CHARACTERS - _FRAME - len(f"{TALKER}RTE,99,99,c,{ROUTE}")
    parts: list[list[str]] = [[]]
    left = room
    for name in names:
        if parts[-1] and len(name) + 1 > left:
            parts.append([])
            left = room
        parts[-1].append(name)
        left -= len(name) + 1
    return [sentence("RTE", str(len(parts)), str(number), "c", ROUTE, *part) for number, part in enumerate(parts, 1)]


def _place(point: GeoPoint | None) -> tuple[str, str, str, str]:
    if point is None:
        return "", "", "", ""
    return (
        _minutes(point.lat_deg, 2),
        "S" if point.lat_deg < 0.0 else "N",
        _minutes(point.lon_deg, 3),
        "W" if point.lon_deg < 0.0 else "E",
    )


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
    return f"{miles:.3f}" if miles < 99.0 else f"{miles:.1f}"  # the longest sentence of all has no room for more


def _off_track(right_of_leg_m: float) -> tuple[str, str]:
    """Return the distance off the leg, and the side to steer to."""
    return f"{min(_MOST_XTE_NM, abs(right_of_leg_m) / M_PER_NM):.4f}", "L" if right_of_leg_m > 0.0 else "R"


def _flag(is_so: bool) -> str:
    return "A" if is_so else "V"


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveLeg:
    """The leg and the boat on it: ``right_m`` to the right of it, ``closing_mps`` the speed towards its end."""

    start_en_m: PointEn
    end_en_m: PointEn
    leg_rad: float
    distance_m: float
    bearing_rad: float
    right_m: float
    along_m: float  # past its end when it is longer than the leg
    length_m: float
    closing_mps: float | None

    @property
    def is_past(self) -> bool:
        """Return whether the boat is past the line across the leg at its end."""
        return self.along_m >= self.length_m


def course_of(view: View) -> ActiveLeg | None:
    """Return the course; None: the boat sails no leg, or its position is not known."""
    legs = legs_ahead(view)
    boat = view.boat
    if not legs or boat.at_en_m is None or not is_fresh(boat.age_s) or not view.state.is_sailing:
        return None
    leg = legs[0]
    way = _between(leg.from_en_m, leg.to_en_m)
    off = _between(leg.from_en_m, boat.at_en_m)
    left = _between(boat.at_en_m, leg.to_en_m)
    length_m = math.hypot(*way)
    leg_rad = heading_of(*way) if length_m > 0.0 else heading_of(*left)
    east, north = math.sin(leg_rad), math.cos(leg_rad)
    bearing_rad = heading_of(*left)
    closing_mps = None
    if boat.sog_mps is not None and boat.cog_deg is not None:
        closing_mps = boat.sog_mps * math.cos(math.radians(boat.cog_deg) - bearing_rad)
    return ActiveLeg(
        start_en_m=leg.from_en_m,
        end_en_m=leg.to_en_m,
        leg_rad=wrap_two_pi(leg_rad),
        distance_m=math.hypot(*left),
        bearing_rad=wrap_two_pi(bearing_rad),
        right_m=off[0] * north - off[1] * east,
        along_m=off[0] * east + off[1] * north,
        length_m=length_m,
        closing_mps=closing_mps,
    )


def legs_ahead(view: View) -> tuple[LegView, ...]:
    """Return the legs that are not sailed yet, but for the loiter at the end."""
    return () if view.plan is None else tuple(leg for leg in view.plan.legs if not leg.is_loiter)


def names_ahead(view: View) -> tuple[str, ...]:
    """Return a name for the end of each leg ahead: its goal's, or W and its number in the plan. No name twice."""
    first = 1 if view.plan is None or view.plan.leg is None else view.plan.leg
    names: list[str] = []
    for number, leg in enumerate(legs_ahead(view), first):
        goal = next((g for g in view.goals if _is_at(g, leg.to_en_m)), None)
        name = "" if goal is None else name_of(goal.name)
        if not name or name in names:
            name = f"W{number}"
            while name in names:  # a goal was called so
                name += "-"
        names.append(name)
    return tuple(names)


def place_of(view: View) -> GeoPoint | None:
    """Return the boat's position, None when it is not known or old."""
    boat = view.boat
    if boat.lat_deg is None or boat.lon_deg is None or not is_fresh(boat.age_s):
        return None
    return GeoPoint(lat_deg=boat.lat_deg, lon_deg=boat.lon_deg)


def is_fresh(age_s: float | None) -> bool:
    """Is something of this age told as if it were so now?"""
    return age_s is not None and age_s <= FRESH_S


def _is_at(goal: GoalView, en_m: PointEn) -> bool:
    return math.dist(goal.at_en_m, en_m) <= SAME_M


def _between(start: PointEn, end: PointEn) -> PointEn:
    return end[0] - start[0], end[1] - start[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lines:
    """Sentences: those that are told each second, and those of the route, which are told when they change."""

    now: tuple[str, ...]
    route: tuple[str, ...] = ()


def lines_of(view: View, frame: LocalFrame, utc_s: float | None) -> Lines:
    """Return the sentences; places in the view are metres in ``frame``, ``utc_s`` is the time by GPS.

    What is not known or old is left out, or its sentence says that it is not valid.
    """
    points = [_point(frame, leg.to_en_m) for leg in legs_ahead(view)]
    names = names_ahead(view)
    course = course_of(view)
    has_arrived = view.state.has_arrived is True
    underway = () if course is None else _course(course, names[0], points[0], has_arrived=has_arrived)
    route = tuple(wpl(point, name) for point, name in zip(points, names, strict=True))
    return Lines(
        now=(*_motion(view, utc_s), *_wind(view), *_water(view), *underway),
        route=(*route, *rte(names)) if names else (),
    )


def _motion(view: View, utc_s: float | None) -> list[str]:
    boat = view.boat
    point = place_of(view)
    out = [rmc(utc_s, point, boat.sog_mps, _rad(boat.cog_deg))]
    if is_fresh(boat.age_s) and boat.heading_deg is not None:
        out.append(hdt(math.radians(boat.heading_deg)))
    return out


def _wind(view: View) -> list[str]:
    wind = view.wind
    if wind is None:
        return []
    is_valid = wind.health not in UNTRUSTED and is_fresh(wind.age_s)
    moves = is_fresh(view.boat.age_s)  # an angle at the bow is as old as the heading
    out = []
    if wind.awa_deg is not None and wind.aws_mps is not None:
        out.append(mwv(math.radians(wind.awa_deg), wind.aws_mps, is_apparent=True, is_valid=is_valid and moves))
    if wind.twa_deg is not None and wind.tws_mps is not None:
        out.append(mwv(math.radians(wind.twa_deg), wind.tws_mps, is_apparent=False, is_valid=is_valid and moves))
    if is_valid and wind.twd_from_deg is not None and wind.tws_mps is not None:
        out.append(mwd(math.radians(wind.twd_from_deg), wind.tws_mps))
    return out


def _water(view: View) -> list[str]:
    """Return the current that plans reckon with."""
    water = view.water
    return [] if water is None or not water.is_planned else [vdr(math.radians(water.set_deg), water.drift_mps)]


def _course(course: ActiveLeg, name: str, point: GeoPoint, *, has_arrived: bool) -> list[str]:
    is_inside = course.distance_m <= INSIDE_M
    return [
        apb(course.right_m, course.leg_rad, course.bearing_rad, name, is_inside=is_inside, is_past=course.is_past),
        rmb(
            course.right_m,
            name,
            point,
            course.distance_m,
            course.bearing_rad,
            course.closing_mps,
            has_arrived=has_arrived or is_inside,
        ),
    ]


def _point(frame: LocalFrame, en_m: tuple[float, float]) -> GeoPoint:
    return frame.geo_from_en(*en_m)


def _rad(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else math.radians(angle_deg)


class RouteTeller:
    """When one listener is told the route: when it has changed, and now and then."""

    def __init__(self) -> None:
        self._told: tuple[str, ...] = ()
        self._told_s = -math.inf

    def data(self, lines: Lines, t_s: float) -> tuple[bytes, ...]:
        """Return the sentences that are due, one value each."""
        is_due = lines.route != self._told or t_s - self._told_s >= ROUTE_EVERY_S
        if is_due:
            self._told, self._told_s = lines.route, t_s
        return tuple(line.encode("ascii") for line in (*lines.now, *(lines.route if is_due else ())))


class UdpOutlet(Outlet[Lines]):
    """Datagrams of one sentence each, to one address; a broadcast address is one too."""

    def __init__(self, name: OutputName, say: Say, *, seed: int = 0) -> None:
        super().__init__(f"NMEA 0183 {name.text}", say, seed=seed)
        self._address = (name.host, name.port)

    async def serve(self) -> None:
        """Send until the network fails; that nobody listens is no failure."""
        failed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        wire, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: _Refusals(failed), remote_addr=self._address, allow_broadcast=True
        )
        teller = RouteTeller()
        self.became("sending", is_open=True)
        try:
            while not failed.done():
                lines = await self.slot.take()
                for data in teller.data(lines, now_s()):
                    wire.sendto(data)
                self.sent += 1
        finally:
            wire.abort()
        failed.result()


class _Refusals(asyncio.DatagramProtocol):
    def __init__(self, failed: asyncio.Future[None]) -> None:
        self._failed = failed

    def error_received(self, exc: Exception) -> None:
        """Note that the network is gone; a new socket finds the way that there is by then."""
        if getattr(exc, "errno", None) != errno.ECONNREFUSED and not self._failed.done():
            self._failed.set_exception(exc)


class TcpOutlet(Outlet[Lines]):
    """A server: whoever connects is told. Nothing that a client sends is looked at."""

    def __init__(self, name: OutputName, say: Say, *, seed: int = 0) -> None:
        super().__init__(f"NMEA 0183 {name.text}", say, seed=seed)
        self._host, self._port = name.host, name.port
        self.clients: set[_Client] = set()
        self.hung_up = 0  # clients that did not read
        self._missed = 0

    @property
    def dropped(self) -> int:
        """Values that were too much for the outlet or for one of its clients."""
        return self.slot.dropped + self._missed

    async def serve(self) -> None:
        """Listen and hand on."""
        server = await asyncio.get_running_loop().create_server(lambda: _Client(self), self._host, self._port)
        self.became("listening", is_open=True)
        try:
            while True:
                lines = await self.slot.take()
                for client in tuple(self.clients):
                    self._missed += not client.tell(lines, now_s())
                self.sent += 1
        finally:
            server.close()
            for client in tuple(self.clients):
                client.hang_up()


class _Client(asyncio.Protocol):
    def __init__(self, owner: TcpOutlet) -> None:
        self._owner, self._teller = owner, RouteTeller()
        self._wire: Any = None
        self._behind_s: float | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._wire = cast("Any", transport)
        if len(self._owner.clients) >= MOST_CLIENTS:
            self._wire.abort()
        else:
            self._owner.clients.add(self)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        self._owner.clients.discard(self)

    def tell(self, lines: Lines, t_s: float) -> bool:
        """Hand over the sentences; return False where the client is behind with its reading."""
        if self._wire.get_write_buffer_size() > BEHIND_BYTES:
            self._behind_s = t_s if self._behind_s is None else self._behind_s
            if t_s - self._behind_s >= PATIENCE_S:
                self._owner.hung_up += 1
                self.hang_up()
            return False
        self._behind_s = None
        self._wire.write(b"".join(self._teller.data(lines, t_s)))
        return True

    def hang_up(self) -> None:
        """Close without waiting for bytes that nobody takes."""
        self._wire.abort()

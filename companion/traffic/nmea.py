"""AIS sentences and the JSON feed to reports: bytes in, values out; pyais knows the bits, we keep the books.

"Not available" never becomes a number: course 360, speed 102.3, heading 511, latitude 91, longitude 181, rate of
turn -128 are None.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from companion.geo import MPS_PER_KNOT
from companion.messages import AisReport, GeoPoint

MAX_LINE = 120  # NMEA 0183 says 82; tag blocks and careless multiplexers make more
MAX_DATAGRAM = 8192
FRAGMENT_S = 10.0  # fragments of one message come within this
MAX_PENDING = 32  # messages waiting for fragments
_SPEED_LIMIT_MPS = 102.3 * MPS_PER_KNOT
_POSITION_TYPES = frozenset({1, 2, 3, 18, 19, 27})
_STATIC_TYPES = frozenset({5, 24})


@dataclass(slots=True)
class DecodeCounts:
    """What came in and what became of it."""

    lines: int = 0
    reports: int = 0
    other: int = 0  # sentences and messages that say nothing about another vessel's movement
    bad_form: int = 0  # not a sentence, not JSON, too long
    bad_checksum: int = 0
    bad_payload: int = 0  # a right checksum around nonsense
    bad_fragment: int = 0  # out of order, incomplete, too late

    @property
    def refused(self) -> int:
        """Lines that were damaged or made no sense."""
        return self.bad_form + self.bad_checksum + self.bad_payload + self.bad_fragment


class NmeaDecoder:
    """Sentences to reports; keeps the fragments of messages in several sentences, bounded in number and time.

    pyais decodes; its own assemblers (3.3) forget no fragment by time, drop what comes out of order and count nothing.
    It is loaded with the first decoder: it takes 4 MB, and most boats have no receiver.
    """

    def __init__(self) -> None:
        import pyais

        self._decoded: Callable[..., Any] = pyais.decode
        self.counts = DecodeCounts()
        self._pending: OrderedDict[tuple[str, int, str, str], tuple[float, dict[int, str]]] = OrderedDict()

    def json(self, data: bytes, t_s: float) -> AisReport | None:
        """Return the report in a datagram of JSON, None when there is none in it."""
        return decode_json(data, t_s)

    def feed(self, line: str | bytes, t_s: float) -> AisReport | None:
        """Return the report that this sentence completes, or None. Never raises.

        Args:
            line: one sentence, with or without line end and tag block.
            t_s: when it arrived.

        """
        counts, text = self.counts, whole_sentence(line, "!$", self.counts)
        if text is None:
            return None
        fields = text[1:].partition("*")[0].split(",")
        if len(fields[0]) != 5 or fields[0][2:] != "VDM":  # VDO is our own transponder
            counts.other += 1
            return None
        parts = self._collect(fields, text, t_s)
        if parts is None:
            return None
        return self._decode(parts, t_s)

    def _collect(self, fields: list[str], text: str, t_s: float) -> list[str] | None:
        """Return all sentences of the message when it is whole."""
        counts = self.counts
        try:
            total, number = int(fields[1]), int(fields[2])
        except (IndexError, ValueError):
            counts.bad_form += 1
            return None
        if len(fields) < 7 or not 1 <= number <= total <= 9:
            counts.bad_form += 1
            return None
        if total == 1:
            return [text]
        for key in [k for k, (since, _) in self._pending.items() if not 0.0 <= t_s - since <= FRAGMENT_S]:
            del self._pending[key]
            counts.bad_fragment += 1
        key = (fields[0], total, fields[3], fields[4])
        since, have = self._pending.pop(key, (t_s, {}))
        if number in have and have[number] != text:
            # The same number again with other content: the earlier message was never finished.
            counts.bad_fragment += 1
            since, have = t_s, {}
        have[number] = text
        if len(have) == total:
            return [have[i] for i in range(1, total + 1)]
        self._pending[key] = (since, have)
        if len(self._pending) > MAX_PENDING:
            self._pending.popitem(last=False)
            counts.bad_fragment += 1
        return None

    def _decode(self, parts: list[str], t_s: float) -> AisReport | None:
        try:
            report = report_from_pyais(self._decoded(*parts), t_s)
        except Exception:  # a decoder's surprise at noise must not end the feed
            self.counts.bad_payload += 1
            return None
        if report is None:
            self.counts.other += 1
        else:
            self.counts.reports += 1
        return report


def whole_sentence(line: str | bytes, begins: str, counts: DecodeCounts) -> str | None:
    """Return a sentence that begins with one of ``begins`` and has its checksum, without line end and tag block.

    None for any other; all are counted.
    """
    counts.lines += 1
    text = line.decode("ascii", "replace") if isinstance(line, bytes) else line
    text = text.strip("\r\n \0")
    if text.startswith("\\"):  # IEC 61162-450 tag block
        text = text.rpartition("\\")[2]
    if not text or len(text) > MAX_LINE or text[0] not in begins:
        counts.bad_form += 1
        return None
    if not has_right_checksum(text):
        counts.bad_checksum += 1
        return None
    return text


def has_right_checksum(text: str) -> bool:
    """Return whether the sentence's checksum is there and right. *00 is a checksum like any other."""
    from pyais.util import compute_checksum

    body, _, given = text.partition("*")
    if not text.isascii() or "\x7f" in body or len(given) < 2:
        return False
    try:
        return bool(int(given[:2], 16) == compute_checksum(body))
    except ValueError:
        return False


def report_from_pyais(message: Any, t_s: float) -> AisReport | None:
    """Return the report in a decoded message; None for types that are not about a moving vessel."""
    kind = int(message.msg_type)
    mmsi = int(message.mmsi)
    if kind in _POSITION_TYPES:
        report = AisReport(
            t_s=t_s,
            mmsi=mmsi,
            position=_position(message.lat, message.lon),
            course_rad=_course(message.course, kind),
            speed_mps=_speed(message.speed, kind),
            heading_rad=_heading(getattr(message, "heading", None)),
            turn_rate_radps=_turn(getattr(message, "turn", None)),
            nav_status=_status(getattr(message, "status", None)),
            is_class_b=kind in {18, 19},
        )
        return _with_static(report, message) if kind == 19 else report
    if kind in _STATIC_TYPES:
        return _with_static(AisReport(t_s=t_s, mmsi=mmsi, is_class_b=kind == 24), message)
    return None


def _position(lat: Any, lon: Any) -> GeoPoint | None:
    if lat is None or lon is None:
        return None
    lat, lon = float(lat), float(lon)
    return GeoPoint(lat_deg=lat, lon_deg=lon) if abs(lat) <= 90.0 and abs(lon) <= 180.0 else None


def _course(course_deg: Any, kind: int) -> float | None:
    if course_deg is None or not 0.0 <= float(course_deg) < 360.0 or (kind == 27 and float(course_deg) >= 511.0):
        return None
    return math.radians(float(course_deg))


def _speed(speed_kn: Any, kind: int) -> float | None:
    if speed_kn is None or not 0.0 <= float(speed_kn) < (63.0 if kind == 27 else 102.25):
        return None
    return float(speed_kn) * MPS_PER_KNOT


def _heading(heading_deg: Any) -> float | None:
    if heading_deg is None or not 0.0 <= float(heading_deg) < 360.0:
        return None
    return math.radians(float(heading_deg))


def _turn(turn: Any) -> float | None:
    """Return rad/s; None for pyais' enum values 'not available' and 'more than 5 degrees in 30 s' (no size)."""
    if turn is None or not isinstance(turn, (int, float)) or hasattr(turn, "name"):
        return None
    return math.radians(float(turn)) / 60.0 if abs(float(turn)) <= 720.0 else None


def _status(status: Any) -> int | None:
    return None if status is None or int(status) == 15 else int(status)


def _kind(ship_type: Any) -> int | None:
    return None if ship_type is None or int(ship_type) == 0 else int(ship_type)


def _text(text: Any) -> str | None:
    cleaned = "".join(c for c in str(text or "").strip(" @\0") if c.isprintable())
    return cleaned or None


def _with_static(report: AisReport, message: Any) -> AisReport:
    """Return the report with name, type and, where any dimension is given, size."""
    size = [float(getattr(message, side, 0) or 0.0) for side in ("to_bow", "to_stern", "to_port", "to_starboard")]
    bow, stern, port, starboard = size if any(size) else (None, None, None, None)
    return replace(
        report,
        name=_text(getattr(message, "shipname", None)),
        ship_type=_kind(getattr(message, "ship_type", None)),
        bow_m=bow,
        stern_m=stern,
        port_m=port,
        starboard_m=starboard,
    )


# ------------------------------------------------------------------------------------------------ JSON
def decode_json(datagram: bytes, t_s: float) -> AisReport | None:
    """Return the report in one datagram of the event feed, or None where it is not one. Never raises.

    The form is our own, after what WRSC 2013 broadcast of its intruder: an object with ``id`` (or ``mmsi``), ``lat``
    and ``lon`` [deg]; optional ``heading_deg``, ``course_deg``, ``speed_mps`` (or ``speed_kn``), ``length_m``,
    ``beam_m``, ``name``, ``age_s``. A heading without a course is taken for the course (the intruder keeps both).
    Keys that are not known are ignored; a value out of range is unknown; no position or an age out of range, no report.
    """
    if len(datagram) > MAX_DATAGRAM:
        return None
    try:
        raw = json.loads(datagram.decode("utf-8"))
    except (ValueError, RecursionError):
        return None
    if not isinstance(raw, dict):
        return None
    position = _json_position(raw)
    mmsi = _json_id(raw)
    age_s = 0.0 if raw.get("age_s") is None else _number(raw["age_s"], 0.0, 3600.0)
    if position is None or mmsi is None or age_s is None:  # of an unknown age it would be a place of now
        return None
    heading = _json_angle(raw.get("heading_deg"))
    course = _json_angle(raw.get("course_deg"))
    speed = _number(raw.get("speed_mps"), 0.0, _SPEED_LIMIT_MPS)
    if speed is None:
        knots = _number(raw.get("speed_kn"), 0.0, 102.2)
        speed = None if knots is None else knots * MPS_PER_KNOT
    length, beam = _number(raw.get("length_m"), 0.1, 500.0), _number(raw.get("beam_m"), 0.05, 100.0)
    length = 5.0 if length is None else length  # an event's boat, not a ship
    beam = length / 3.0 if beam is None else beam
    name = raw.get("name")
    return AisReport(
        t_s=t_s,
        mmsi=mmsi,
        position=position,
        course_rad=course if course is not None else heading,
        speed_mps=speed,
        heading_rad=heading,
        name=_text(name[:40]) if isinstance(name, str) else None,
        bow_m=length / 2,
        stern_m=length / 2,
        port_m=beam / 2,
        starboard_m=beam / 2,
        is_class_b=True,
        age_s=age_s,
    )


def _number(value: Any, low: float, high: float) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if low <= number <= high else None


def _json_angle(value: Any) -> float | None:
    degrees = _number(value, -360.0, 360.0)
    return None if degrees is None else math.radians(degrees % 360.0)


def _json_position(raw: dict[str, Any]) -> GeoPoint | None:
    lat, lon = _number(raw.get("lat"), -90.0, 90.0), _number(raw.get("lon"), -180.0, 180.0)
    return None if lat is None or lon is None else GeoPoint(lat_deg=lat, lon_deg=lon)


def _json_id(raw: dict[str, Any]) -> int | None:
    given = raw.get("mmsi", raw.get("id", 0))
    if isinstance(given, str) and given.isascii() and given.isdigit() and len(given) <= 9:
        given = int(given)
    if isinstance(given, bool) or not isinstance(given, int) or not 0 <= given <= 999_999_999:
        return None
    return given

"""The autopilot's AIS list and how it tells of it, faults of the real one included."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geo import MPS_PER_KNOT
from companion.messages import GeoPoint

LIST_MAX = 25
TIMEOUT_S = 600.0
RESEND_S = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Vessel:
    """One position report as a receiver decoded it. Unknown is None.

    ``turn_rate_dps`` in degrees per second, positive to starboard; ``cog_deg`` and ``heading_deg`` from true north.
    Names and dimensions are not here: the real one never gets them through (two-part sentences are lost).
    """

    mmsi: int
    position: GeoPoint
    cog_deg: float | None = None
    sog_mps: float | None = None
    heading_deg: float | None = None
    turn_rate_dps: float | None = None
    nav_status: int = 15
    is_class_b: bool = False


@dataclass(slots=True)
class _Entry:
    vessel: Vessel
    heard_s: float
    sent_s: dict[int, float]


class AisList:
    """Vessels heard, sent one a message to each port that asked for AIS_VESSEL."""

    def __init__(self) -> None:
        self._entries: dict[int, _Entry] = {}
        self._turn = 0

    def hear(self, vessel: Vessel, t_s: float) -> None:
        """Take a report. Class B is not decoded by the real one and leaves no trace."""
        if vessel.is_class_b:
            return
        if vessel.mmsi not in self._entries and len(self._entries) >= LIST_MAX:
            oldest = min(self._entries, key=lambda m: self._entries[m].heard_s)
            del self._entries[oldest]
        self._entries[vessel.mmsi] = _Entry(vessel, t_s, {})

    def next_message(self, link: int, t_s: float) -> Any:
        """Return the next vessel that is new or was not sent for 30 s on this port, or None."""
        for mmsi in [m for m, e in self._entries.items() if t_s - e.heard_s > TIMEOUT_S]:
            del self._entries[mmsi]
        keys = list(self._entries)
        for n in range(len(keys)):
            entry = self._entries[keys[(self._turn + n) % len(keys)]]
            if t_s - entry.sent_s.get(link, -RESEND_S) >= RESEND_S - 1e-9:
                self._turn = (self._turn + n + 1) % len(keys)
                entry.sent_s[link] = t_s
                return self._message(entry, t_s)
        return None

    @staticmethod
    def _message(entry: _Entry, t_s: float) -> Any:
        v = entry.vessel
        flags = mav.AIS_FLAGS_POSITION_ACCURACY
        if v.cog_deg is not None:
            flags |= mav.AIS_FLAGS_VALID_COG
        if v.sog_mps is not None:
            flags |= mav.AIS_FLAGS_VALID_VELOCITY
        # measured on the real one: speed in 0.1 knot though the field is in cm/s; turn rate in 0.1 deg/s and
        # without sign though it is in 0.01 deg/s; "not available" is 121 there, without the flag
        speed = 1023 if v.sog_mps is None else round(v.sog_mps / MPS_PER_KNOT * 10.0)
        if v.turn_rate_dps is None:
            turn = 121
        else:
            turn = min(120, round(abs(v.turn_rate_dps) * 10.0))
            flags |= mav.AIS_FLAGS_VALID_TURN_RATE
        return mav.MAVLink_ais_vessel_message(
            v.mmsi, round(v.position.lat_deg * 1e7), round(v.position.lon_deg * 1e7),
            36000 if v.cog_deg is None else round(v.cog_deg * 100.0),
            51100 if v.heading_deg is None else round(v.heading_deg * 100.0),
            speed, turn, v.nav_status, 0, 0, 0, 0, 0, b"", b"", min(65535, int(t_s - entry.heard_s)), flags,
        )

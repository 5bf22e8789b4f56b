"""The table of streams: which message, how often, and from what age on it is stale. Pure.

Health asks three things apart: is it fresh, does it come at its rate, can its values be trusted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire


@dataclass(frozen=True, slots=True)
class Stream:
    """One message of the autopilot.

    Attributes:
        name: MAVLink name.
        rate_hz: asked for; 0: comes by itself and is not asked for (HEARTBEAT, NAMED_VALUE_FLOAT with WIND).
        stale_s: older than this it must not be used.
        is_vital: without it nobody can sail; others may be silent (no fence, no vessel, a manual mode).
    """

    name: str
    rate_hz: float
    stale_s: float
    is_vital: bool = False

    @property
    def msg_id(self) -> int:
        """MAVLink message id."""
        return int(getattr(wire, f"MAVLINK_MSG_ID_{self.name}"))


# WIND stays at 2 Hz: ArduRover broadcasts two NAMED_VALUE_FLOATs on every link for each WIND on any link, so a
# faster one floods the telemetry radio; and its filter (3.2 s) lets nothing faster through.
DEFAULT_STREAMS = (
    Stream("HEARTBEAT", 0.0, 3.0, is_vital=True),
    Stream("GLOBAL_POSITION_INT", 5.0, 2.0, is_vital=True),
    Stream("ATTITUDE", 5.0, 2.0, is_vital=True),
    Stream("WIND", 2.0, 5.0, is_vital=True),
    Stream("NAV_CONTROLLER_OUTPUT", 2.0, 5.0),
    Stream("MISSION_CURRENT", 1.0, 5.0, is_vital=True),
    Stream("EKF_STATUS_REPORT", 1.0, 5.0, is_vital=True),
    Stream("GPS_RAW_INT", 1.0, 5.0, is_vital=True),
    Stream("GPS2_RAW", 1.0, 5.0),
    Stream("SYS_STATUS", 0.5, 10.0, is_vital=True),
    Stream("SYSTEM_TIME", 0.5, 10.0),
    Stream("FENCE_STATUS", 1.0, 10.0),
    Stream("RC_CHANNELS", 1.0, 10.0),
    Stream("SERVO_OUTPUT_RAW", 1.0, 10.0),
    Stream("AIS_VESSEL", 5.0, 60.0),
    Stream("HOME_POSITION", 0.2, 60.0),
)

# The window over which a rate is measured [s].
RATE_WINDOW_S = 10.0


@dataclass(frozen=True, slots=True)
class StreamHealth:
    """One stream now. ``age_s`` is None when it was never heard."""

    stream: Stream
    age_s: float | None
    rate_hz: float
    is_fresh: bool
    is_on_rate: bool
    is_trusted: bool


class StreamMonitor:
    """Watches the streams of one link. ``heard`` on every message, ``health`` when asked."""

    def __init__(self, table: Iterable[Stream] = DEFAULT_STREAMS) -> None:
        self.table = tuple(table)
        self._by_name = {s.name: s for s in self.table}
        self._times: dict[str, deque[float]] = {s.name: deque(maxlen=128) for s in self.table}
        self._bad: dict[str, deque[float]] = {s.name: deque(maxlen=16) for s in self.table}

    def heard(self, t_s: float, name: str) -> None:
        """Note a good message."""
        times = self._times.get(name)
        if times is not None:
            times.append(t_s)

    def bad_value(self, t_s: float, name: str) -> None:
        """Note a message whose value could not be believed."""
        bad = self._bad.get(name)
        if bad is not None:
            bad.append(t_s)

    def age_s(self, t_s: float, name: str) -> float | None:
        """Return the age of the newest message [s], None when never heard."""
        times = self._times.get(name)
        return t_s - times[-1] if times else None

    def health(self, t_s: float) -> tuple[StreamHealth, ...]:
        """Return the health of every stream of the table."""
        return tuple(self._health(t_s, stream) for stream in self.table)

    def below_rate(self, t_s: float) -> tuple[Stream, ...]:
        """Return the vital streams that come at less than half of the rate asked for."""
        return tuple(s for s in self.table if s.is_vital and not self._health(t_s, s).is_on_rate)

    def _health(self, t_s: float, stream: Stream) -> StreamHealth:
        times = self._times[stream.name]
        # rates below 0.5 Hz need a longer window to hold a few messages
        window_s = max(RATE_WINDOW_S, 4.0 / stream.rate_hz) if stream.rate_hz > 0.0 else RATE_WINDOW_S
        recent = _since(times, t_s, window_s)
        rate_hz = recent / window_s
        age_s = t_s - times[-1] if times else None
        is_fresh = age_s is not None and age_s <= stream.stale_s
        bad = _since(self._bad[stream.name], t_s, window_s)
        return StreamHealth(
            stream=stream, age_s=age_s, rate_hz=rate_hz, is_fresh=is_fresh,
            is_on_rate=rate_hz >= 0.5 * stream.rate_hz and is_fresh, is_trusted=is_fresh and bad * 4 <= recent,
        )


def _since(times: deque[float], t_s: float, window_s: float) -> int:
    """Return how many of ``times``, oldest first, are of the last ``window_s`` [s]."""
    count = 0
    for t in reversed(times):
        if t_s - t > window_s:
            break
        count += 1
    return count

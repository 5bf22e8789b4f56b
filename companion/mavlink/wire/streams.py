"""The table of streams: which message, how often, and from what age on it is stale. Pure."""

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
    Stream("DISTANCE_SENSOR", 2.0, 5.0),
    Stream("RC_CHANNELS", 1.0, 10.0),
    Stream("SERVO_OUTPUT_RAW", 1.0, 10.0),
    Stream("AIS_VESSEL", 5.0, 60.0),
    Stream("HOME_POSITION", 0.2, 60.0),
)

# The window over which a rate is measured [s].
RATE_WINDOW_S = 10.0


class StreamMonitor:
    """Watches the streams of one link: ``heard`` on every message."""

    def __init__(self, table: Iterable[Stream] = DEFAULT_STREAMS) -> None:
        self.table = tuple(table)
        self._times: dict[str, deque[float]] = {s.name: deque(maxlen=128) for s in self.table}

    def heard(self, t_s: float, name: str) -> None:
        """Note a message."""
        times = self._times.get(name)
        if times is not None:
            times.append(t_s)

    def rate_hz(self, t_s: float, stream: Stream) -> float:
        """Return the rate at which a stream comes [Hz], 0 when it is stale."""
        times = self._times[stream.name]
        if not times or t_s - times[-1] > stream.stale_s:
            return 0.0
        # rates below 0.5 Hz need a longer window to hold a few messages
        window_s = max(RATE_WINDOW_S, 4.0 / stream.rate_hz) if stream.rate_hz > 0.0 else RATE_WINDOW_S
        return _since(times, t_s, window_s) / window_s

    def below_rate(self, t_s: float) -> tuple[Stream, ...]:
        """Return the vital streams that are stale, or come at less than half of the rate asked for."""
        return tuple(
            s for s in self.table if s.is_vital and (not (rate_hz := self.rate_hz(t_s, s)) or rate_hz < 0.5 * s.rate_hz)
        )


def _since(times: deque[float], t_s: float, window_s: float) -> int:
    """Return how many of ``times``, oldest first, are of the last ``window_s`` [s]."""
    count = 0
    for t in reversed(times):
        if t_s - t > window_s:
            break
        count += 1
    return count

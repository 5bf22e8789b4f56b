"""The one live line of a voyage: on a terminal it is rewritten in place, elsewhere it is a line now and then."""

from __future__ import annotations

import math
import shutil
from types import TracebackType
from typing import Any, Protocol, Self

from companion.fold import Step
from companion.geo.angles import wrap_two_pi
from companion.skipper.state import Phase
from companion.telemetry.records import sigma_ahead_rad

# Without a terminal a line is written this often [s of the voyage], and whenever the phase changes.
PLAIN_EVERY_S = 15.0
DISK = "disk"   # the alert of trouble with the disk, which no state of the voyage tells


class Stream(Protocol):
    """What lines are written to: a file, or the console of a voyage."""

    def write(self, text: str, /) -> object:
        """Write ``text``."""
        ...

    def flush(self) -> object:
        """Let it be seen."""
        ...

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        ...


class ProgressLine:
    """Shows steps on ``stream``. A context manager: the last line is left standing."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self._is_terminal = stream.isatty()
        self._last: tuple[float, str] = (-math.inf, "")
        self._dirty = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._dirty:
            self._stream.write("\n")
            self._stream.flush()

    def show(self, status: Any, step: Step) -> None:
        """Show one step."""
        text = progress_text(step, getattr(status, "next_tack_s", None))
        if getattr(status, "alert_code", "") == DISK:
            text += f" | {status.alert_text}"
        t_s, phase = step.snapshot.t_s, step.state.phase.value
        if self._is_terminal:
            columns = shutil.get_terminal_size((120, 24)).columns
            self._stream.write("\r" + text[:columns - 1].ljust(columns - 1))
            self._stream.flush()
            self._dirty = True
        elif t_s - self._last[0] >= PLAIN_EVERY_S or phase != self._last[1]:
            self._stream.write(text + "\n")
            self._stream.flush()
            self._last = (t_s, phase)


def progress_text(step: Step, next_tack_s: float | None = None) -> str:
    """Return the line: state, waypoint, wind mean and spread, next tack, cross-track, risk."""
    snapshot, state = step.snapshot, step.state
    autopilot, wind, route = snapshot.autopilot, snapshot.wind, state.route
    parts = [state.phase.value.upper()]
    under_way = route is not None and state.sailing and state.phase is not Phase.DONE
    if under_way and route is not None and autopilot is not None:
        distance = autopilot.waypoint_distance_m
        at = "" if distance is None else f" {distance:.0f} m"
        parts.append(f"wp {state.index + 1}/{len(route.items)}{at}")
    if wind.mean_twd_from_rad is not None and wind.mean_tws_mps is not None:
        sigma_rad = sigma_ahead_rad(snapshot) or 0.0
        twd_deg = math.degrees(wrap_two_pi(wind.mean_twd_from_rad))
        parts.append(f"wind {twd_deg:03.0f}±{math.degrees(sigma_rad):.0f}° {wind.mean_tws_mps:.1f} m/s")
    if snapshot.vehicle is not None:
        parts.append(f"{snapshot.vehicle.speed_mps:.1f} m/s")
    if under_way:
        if next_tack_s is not None:
            parts.append(f"next tack {next_tack_s:.0f} s")
        if autopilot is not None and autopilot.cross_track_m is not None:
            parts.append(f"xt {autopilot.cross_track_m:+.1f} m")
    if route is not None:
        parts.append(f"risk {100.0 * (1.0 - route.delta_s):.0f} %")
        parts.append(f"replans {state.replans}")
    if not under_way or state.phase not in {Phase.STANDARD, Phase.DESTINATION_APPROACH, Phase.BUOY_APPROACH}:
        parts.append(state.why)
    return " | ".join(parts)

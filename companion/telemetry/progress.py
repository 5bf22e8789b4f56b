"""A voyage on the console: what is announced as lines that stay, and below them how it stands.

On a terminal the standing is rewritten in place, its sentence in full over as many lines as it takes; elsewhere it is a
line now and then.
"""

from __future__ import annotations

import math
import shutil
import textwrap
from datetime import UTC, datetime
from types import TracebackType
from typing import Self

from companion.fold import Step
from companion.geo.angles import wrap_two_pi
from companion.messages import CompanionStatus, Mode
from companion.program import control
from companion.skipper.step import Announce, Phase, Route, Severity
from companion.telemetry.folder.records import sigma_ahead_rad
from companion.telemetry.standing import Stream
from companion.words import one_line, printable

# Without a terminal a line is written this often [s of the voyage], and whenever the phase changes.
PLAIN_EVERY_S = 15.0
SILENT_S = 5.0           # without a heartbeat
LOUD = Severity.NOTICE   # what is said more quietly than this is in the records only
COLUMNS_MOST = 120       # longer lines are hard to read
DISK = "disk"   # the alert of trouble with the disk, which no state of the voyage tells
GONE = "gone"   # ... and of what is gone beside it: a page, a socket, an output


class ProgressLine:
    """Shows steps on ``stream``. A context manager: the last lines are left standing.

    ``epoch_s`` is the Unix time [s] of the loop's time 0.
    """

    def __init__(self, stream: Stream, epoch_s: float = 0.0) -> None:
        self._stream, self._epoch_s = stream, epoch_s
        self._is_terminal = stream.isatty()
        self._last: tuple[float, str] = (-math.inf, "")
        self._standing = 0   # lines that are rewritten
        self._notes: list[str] = []   # to be said with the next step

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._standing:
            self._stream.write("\n")
        if self._notes:
            self._stream.write("".join(f"{line}\n" for line in self._notes))
        self._stream.flush()

    def note(self, text: str) -> None:
        """Say something that is not of a step, as a line that stays."""
        self._notes.append(f"note: {one_line(text)}")

    def show(self, status: CompanionStatus, step: Step) -> None:
        """Show one step."""
        text = progress_text(step, status.next_tack_s)
        if status.alert_code in {DISK, GONE}:
            text += f" | {status.alert_text}"
        said, self._notes = self._notes, []
        said += [self._said(step.snapshot.t_s, a) for a in step.actions
                if isinstance(a, Announce) and a.severity <= LOUD]
        t_s, phase = step.snapshot.t_s, step.state.phase.value
        if self._is_terminal:
            columns = min(COLUMNS_MOST, shutil.get_terminal_size((COLUMNS_MOST, 24)).columns) - 1
            back = f"\r\x1b[{self._standing - 1}A" if self._standing > 1 else "\r"
            stays = "".join(f"{line}\n" for line in wrapped(said, columns))
            standing = wrapped([text], columns)
            # one write: a line that waits for its rest would flicker
            control(self._stream, f"{back}\x1b[J" + printable(stays + "\n".join(standing)))
            self._stream.flush()
            self._standing = len(standing)
            return
        is_due = t_s - self._last[0] >= PLAIN_EVERY_S or phase != self._last[1]
        if is_due:
            said.append(text)
            self._last = (t_s, phase)
        if said:
            self._stream.write("".join(f"{line}\n" for line in said))
            self._stream.flush()

    def _said(self, t_s: float, announced: Announce) -> str:
        clock = datetime.fromtimestamp(self._epoch_s + t_s, UTC).strftime("%H:%M:%S")
        loud = f"{announced.severity.name}: " if announced.severity <= Severity.WARNING else ""
        return f"{clock} {loud}{one_line(announced.text)}"


def wrapped(lines: list[str], columns: int) -> list[str]:
    """Return lines of at most ``columns`` characters."""
    return [part for line in lines for part in textwrap.wrap(line, max(20, columns), subsequent_indent="    ") or [""]]


def progress_text(step: Step, next_tack_s: float | None) -> str:
    """Return the line: state, waypoint, wind mean and spread, next tack, cross-track, risk."""
    snapshot, state = step.snapshot, step.state
    autopilot, wind, route = snapshot.autopilot, snapshot.wind, state.route
    parts = [state.phase.value.upper()]
    if snapshot.heartbeat_age_s is not None and snapshot.heartbeat_age_s > SILENT_S:
        parts.append(f"autopilot silent for {snapshot.heartbeat_age_s:.0f} s: what follows is old")
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
    if state.task:
        parts.append(state.task)
    if state.standing is not None:
        minutes = state.standing.age_s(snapshot.t_s) / 60.0
        parts.append(f"order {state.standing.words} of {state.standing.by}, {minutes:.0f} min")
    if route is not None:
        parts.append(f"risk {100.0 * (1.0 - route.delta_s):.0f} %")
        if route.expected_clearance_m is not None:
            parts.append(f"clear {route.expected_clearance_m:.1f} m")
        if under_way and route.median_s is not None:
            parts.append(_arrives(route, snapshot.t_s))
        parts.append(f"plans {state.replans}")
    if not under_way or state.phase not in {Phase.STANDARD, Phase.DESTINATION_APPROACH, Phase.BUOY_APPROACH}:
        parts.append(state.why)
    return " | ".join(parts)


def _arrives(route: Route, t_s: float) -> str:
    """Return when the plan's end is reached: in half of the winds, and in nine of ten."""
    gone_s = t_s - route.plan_t_s
    late = "" if route.late_s is None else f" (90 %: {max(0.0, route.late_s - gone_s):.0f} s)"
    return f"there in {max(0.0, (route.median_s or 0.0) - gone_s):.0f} s{late}"


def left_behind(step: Step) -> str:
    """Return what the boat does without us: what a person who stops the companion has to know."""
    status, route = step.snapshot.autopilot, step.state.route
    if status is None:
        return "the autopilot is not heard: what it does is not known"
    if not status.is_armed:
        return "the boat is disarmed"
    if status.mode is not Mode.AUTO or route is None or step.state.foreign:
        return f"the boat is left in {status.mode.name if status.mode is not None else 'an unknown mode'}, armed"
    end = route.items[-1].point
    left = len(route.items) - step.state.index
    way = f"{left} items to go, the last a loiter" if left > 1 else "she loiters"
    return f"the boat sails on in AUTO: {way} at {end.lat_deg:.5f}, {end.lon_deg:.5f}"

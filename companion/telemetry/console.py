"""Console output of a voyage: a stream that nobody waits for, one line rewritten in place, and the progress on it.

A reader that has gone (``| head -1``, a dropped ssh), a full disk behind ``> log`` or a terminal that was stopped with
Ctrl-S costs lines and nothing else: nothing here raises, and nobody waits for it but ``close``, and that not for long.

On a terminal the standing is rewritten in place, its sentence in full over as many lines as it takes; elsewhere it is a
line now and then.
"""

from __future__ import annotations

import contextlib
import errno
import math
import os
import queue
import shutil
import textwrap
import threading
import time
from datetime import UTC, datetime
from types import TracebackType
from typing import Protocol, Self, TextIO

from companion.figures import figure_values, in_words
from companion.fold import Step
from companion.geo.angles import direction
from companion.messages import CompanionStatus, Mode, Severity
from companion.program import control
from companion.skipper.planning import next_tack, on_leg
from companion.skipper.step import Announce, Phase, Snapshot
from companion.telemetry.folder.records import sigma_ahead_rad
from companion.telemetry.status import CLOCK_OFF_S, goal_distance_m
from companion.words import brief_time, clearance_words, one_line, printable

NEAR_M = 1.0  # what is so near to her way is what a clearance below nought is of
MOST_WAITING = 64  # lines; a reader that is this far behind misses the next
_GONE = frozenset({errno.EPIPE, errno.EIO, errno.EBADF, errno.ENXIO})
LAST_WORDS_S = 1.0  # what is still waiting at the end gets so long


class Console:
    """A stream like ``sys.stdout`` (or None, where the process was started without), for progress and last words."""

    def __init__(self, stream: TextIO | None) -> None:
        self._encoding = "utf-8" if stream is None else stream.encoding
        self._fd: int | None = None
        self._is_terminal = False
        with contextlib.suppress(OSError, ValueError, AttributeError):
            if stream is not None:
                stream.flush()
                self._is_terminal = stream.isatty()
                self._fd = stream.fileno()
        self._lines: queue.Queue[bytes | None] = queue.Queue(MOST_WAITING)
        self._thread = threading.Thread(target=self._run, name="console", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(queue.Full):
            self._lines.put(None, timeout=LAST_WORDS_S)
        self._thread.join(LAST_WORDS_S)

    def write(self, text: str) -> None:
        """Print ``text`` some time soon, if anybody reads; it can do nothing to a terminal."""
        self.control(printable(text))

    def control(self, text: str) -> None:
        """Print text as it is: what moves the cursor, and what has been made printable."""
        if self._fd is not None:
            with contextlib.suppress(queue.Full):
                self._lines.put_nowait(text.encode(self._encoding, "replace"))

    def flush(self) -> None:
        """Nothing waits to be flushed: here for those who print to a stream."""

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return self._is_terminal

    def _run(self) -> None:
        while (data := self._lines.get()) is not None:
            try:
                while data and self._fd is not None:
                    data = data[os.write(self._fd, data) :]
            except OSError as error:
                if error.errno in _GONE:
                    self._fd = None  # for good: the number may be another file's by and by


class TextStream(Protocol):
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


class StatusLine:
    """One line on ``stream``; where that is no terminal it is written every ``every_s`` at most, and at the end."""

    def __init__(self, stream: TextStream, every_s: float) -> None:
        self._stream, self._every_s = stream, every_s
        self._is_terminal = stream.isatty()
        self._widest, self._last = 0, ""
        self._unsaid, self._said_s = "", -math.inf

    def show(self, text: str) -> None:
        """Let it stand in place of what stood."""
        if text == self._last:
            return
        self._last = text
        if self._is_terminal:
            self._widest = max(self._widest, len(text) + 3)
            self._write(text.ljust(self._widest), back="\r")
            return
        self._unsaid = text
        if time.monotonic() - self._said_s >= self._every_s:
            self._say()

    def give_way(self) -> None:
        """Leave the line to what is printed next."""
        if self._is_terminal:
            self._write("", back="\r")

    def stay(self, text: str) -> None:
        """Write a line that stays, above the one that stands."""
        self.give_way()
        self._write(f"{text}\n")

    def end(self) -> None:
        """Leave what was shown last."""
        if self._widest:
            self._write("\n")
        if self._unsaid:
            self._say()

    def _say(self) -> None:
        self._write(f"{self._unsaid}\n")
        self._unsaid, self._said_s = "", time.monotonic()

    def _write(self, text: str, *, back: str = "") -> None:
        control(self._stream, back + printable(text))
        self._stream.flush()


PREPARING_PATIENCE_S = 4.0  # loading what was compiled before takes about two seconds, and nothing is said of it
PREPARING_EVERY_S = 10.0  # between two lines where there is no terminal


class CompileProgress:
    """Says how far it is on ``stream``. A context manager: the last line is left standing."""

    def __init__(self, stream: TextStream) -> None:
        self._line = StatusLine(stream, PREPARING_EVERY_S)
        self._patient_until_s = time.monotonic() + PREPARING_PATIENCE_S

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._line.end()

    def say(self, text: str) -> None:
        """Say it, if it is due."""
        if time.monotonic() >= self._patient_until_s:
            self._line.show(text)


# Without a terminal a line is written this often [s of the voyage], and whenever the phase changes.
PLAIN_EVERY_S = 15.0
SILENT_S = 5.0  # without a heartbeat
LOUD = Severity.NOTICE  # what is said more quietly than this is in the records only
BACK_S = 60.0  # what lies so far behind the time that was told last is another clock's, and is said
COLUMNS_MOST = 120  # longer lines are hard to read
DISK = "disk"  # the alert of trouble with the disk, which no state of the voyage tells
GONE = "gone"  # ... and of what is gone beside it: a page, a socket, an output


class ProgressLine:
    """Shows steps on ``stream``. A context manager: the last lines are left standing.

    ``epoch_s`` is the Unix time [s] of the loop's time 0.
    """

    def __init__(self, stream: TextStream, epoch_s: float = 0.0) -> None:
        self._stream, self._epoch_s = stream, epoch_s
        self._is_terminal = stream.isatty()
        self._last: tuple[float, str] = (-math.inf, "")
        self._standing = 0  # lines that are rewritten
        self._notes: list[str] = []  # to be said with the next step
        self._behind_s: float | None = None  # our clock's, against the autopilot's; None: no time was told yet
        self._told_s = -math.inf  # the Unix time that was told last

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
        # what is gone beside her was said once, as a note; it stays in the view's health and among its alarms
        text = " | ".join(part for part in (progress_text(step), status.disk_trouble) if part)
        said, self._notes = self._notes, []
        loud = [a for a in step.actions if isinstance(a, Announce) and a.severity <= LOUD]
        t_s, phase = step.snapshot.t_s, step.state.phase.value
        is_due = self._is_terminal or t_s - self._last[0] >= PLAIN_EVERY_S or phase != self._last[1]
        if is_due or loud:
            turned, clock = self._clock(step.snapshot)
            text = f"{clock} {text}"
            said += [*turned, *(_said(clock, announced) for announced in loud)]
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
        if is_due:
            said.append(text)
            self._last = (t_s, phase)
        if said:
            self._stream.write("".join(f"{line}\n" for line in said))
            self._stream.flush()

    def _clock(self, snapshot: Snapshot) -> tuple[list[str], str]:
        """Return the time of day, the page's, and a line where it turns from one clock to another.

        It never goes back otherwise: a frame that is read late, as under load, tells of an earlier time than the one
        before it did.
        """
        unix_s, boat_s = self._epoch_s + snapshot.t_s, snapshot.unix_s(snapshot.t_s)
        before_s, lines = self._behind_s, []
        if boat_s is not None and abs(boat_s - unix_s) >= CLOCK_OFF_S:
            self._behind_s = boat_s - unix_s
            if before_s == 0.0 or boat_s < self._told_s - BACK_S:
                self._told_s = boat_s
                lines.append(
                    f"it is {datetime.fromtimestamp(boat_s, UTC):%Y-%m-%d %H:%M:%S} UTC by the autopilot's clock"
                )
        elif before_s is None:
            self._behind_s = 0.0
        self._told_s = max(self._told_s, unix_s + (self._behind_s or 0.0))
        return lines, datetime.fromtimestamp(self._told_s, UTC).strftime("%H:%M:%S")


def _said(clock: str, announced: Announce) -> str:
    loud = f"{announced.severity.name}: " if announced.severity <= Severity.WARNING else ""
    return f"{clock} {loud}{one_line(announced.text)}"


def wrapped(lines: list[str], columns: int) -> list[str]:
    """Return lines of at most ``columns`` characters."""
    return [part for line in lines for part in textwrap.wrap(line, max(20, columns), subsequent_indent="    ") or [""]]


def progress_text(step: Step) -> str:
    """Return the line: state, waypoint, wind mean and spread, next tack, cross-track, clearance, arrival."""
    snapshot, state = step.snapshot, step.state
    autopilot, wind, route, sailed = snapshot.autopilot, snapshot.wind, state.mission.route, step.sailed
    parts = [state.phase.value.upper()]
    if snapshot.heartbeat_age_s is not None and snapshot.heartbeat_age_s > SILENT_S:
        parts.append(f"autopilot silent for {snapshot.heartbeat_age_s:.0f} s: what follows is old")
    under_way = route is not None and state.voyage.sailing and state.phase is not Phase.DONE
    if under_way and step.is_off_plan:
        parts.append(f"by field{_goal_left(step)}")
    elif under_way and route is not None and autopilot is not None:
        distance = on_leg(step).left_m
        at = "" if distance is None else f" {distance:.0f} m"
        parts.append(f"wp {state.mission.index + 1}/{len(route.items)}{at}")
    if wind.mean_twd_from_rad is not None and wind.mean_tws_mps is not None:
        sigma_rad = sigma_ahead_rad(snapshot) or 0.0
        parts.append(
            f"mean wind {direction(wind.mean_twd_from_rad)}±{math.degrees(sigma_rad):.0f}° {wind.mean_tws_mps:.1f} m/s"
        )
    if snapshot.vehicle is not None:
        parts.append(f"{snapshot.vehicle.speed_mps:.1f} m/s")
    if under_way:
        tack = next_tack(step, step.voyage.boat)
        if tack is not None:
            parts.append(f"next tack {tack.words}")
        off_m = on_leg(step).off_m
        if off_m is not None:
            parts.append(f"xt {off_m:+z.1f} m")
    if state.progress.task:
        parts.append(state.progress.task)
    if state.orders.standing is not None:
        standing = state.orders.standing
        parts.append(f"order {standing.words} of {standing.by}, {brief_time(standing.age_s(snapshot.t_s))}")
    if route is not None:
        clearance_m = None if sailed is None or not under_way else sailed.clearance_ahead_m(state.mission.index)
        if clearance_m is not None:
            parts.append(f"clearance expected {clearance_words(clearance_m, _where(step))}")
        eta = step.eta()
        if under_way and eta.there_s is not None:
            late = "" if eta.there_late_s is None else f" (90 %: {brief_time(eta.there_late_s)})"
            parts.append(f"there in {brief_time(eta.there_s)}{late}")
        parts.append(f"replans {state.plans.replans}")
    parts += in_words(figure_values(step, "line"))
    if not under_way or state.phase not in {Phase.STANDARD, Phase.DESTINATION_APPROACH, Phase.BUOY_APPROACH}:
        parts.append(state.why)
    return " | ".join(parts)


def _goal_left(step: Step) -> str:
    """Return how far it is to the goal that is next, or to the place that an order has named, in words."""
    here, order, left_m = step.snapshot.position_en_m, step.state.orders.standing, goal_distance_m(step, step.voyage)
    if order is not None and order.en_m is not None and here is not None:
        return f", {math.dist(here, order.en_m):.0f} m to {order.words}"
    return "" if left_m is None else f", goal {left_m:.0f} m"


def _where(step: Step) -> str:
    """Return where her way leads that must not: a plan begins inside of what was drawn or sounded since."""
    here, route, area = step.snapshot.position_en_m, step.state.mission.route, step.voyage.area
    places = [
        *(() if here is None else (here,)),
        *(() if route is None else route.points_en_m[step.state.mission.index :]),
    ]
    least_m, place = min(((float(area.clearance_m([p])[0]), p) for p in places), default=(math.inf, None))
    name = "" if place is None or least_m > NEAR_M else area.nearest_name(place)
    is_limit = place is not None and least_m < float(area.unfenced.clearance_m([place])[0])
    return f"{'outside' if name and is_limit else 'inside'} {name or 'what was drawn or found since'}"


def left_behind(step: Step) -> str:
    """Return what the boat does without us: what a person who stops the companion has to know."""
    status, route = step.snapshot.autopilot, step.state.mission.route
    if status is None:
        return "the autopilot is not heard: what it does is not known"
    if not status.is_armed:
        return "the boat is disarmed"
    if status.mode is not Mode.AUTO or route is None or step.state.mission.foreign:
        return f"the boat is left in {status.mode.name if status.mode is not None else 'an unknown mode'}, armed"
    end = route.items[-1].point
    left = len(route.items) - step.state.mission.index
    way = f"{left} items to go, the last a loiter" if left > 1 else "she loiters"
    return f"the boat sails on in AUTO: {way} at {end.lat_deg:.5f}, {end.lon_deg:.5f}"

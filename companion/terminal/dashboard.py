"""The dashboard: a view, what is remembered and what is typed become a screen. Pure."""

from __future__ import annotations

import textwrap
from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, datetime

from companion.terminal import figures as fig
from companion.terminal.history import History
from companion.terminal.keys import KEYS, Helm, shown
from companion.terminal.rows import body_of
from companion.terminal.screen import Frame, Style
from companion.terminal.strips import BIN_S, tape, wind_strip
from companion.view import Event, View
from companion.words import counted, one_line

LEAST_COLUMNS, LEAST_ROWS = 40, 12
STRIP_COLUMNS = (24, 36)      # of the wind's history: at least, at most
LEVELS = {"critical": Style.ALARM, "error": Style.BAD, "warning": Style.WARN, "notice": Style.BOLD}


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What is shown: ``view`` None before anything was heard on ``link``; ``orders`` are the verbs permitted here.

    ``said`` is the answer to the last order, or what became of the link.
    """

    link: str
    view: View | None
    history: History
    helm: Helm
    unix_s: float
    orders: Collection[str] | None = None
    said: str = ""
    waited_s: float = 0.0


def draw(what: Shown, columns: int, rows: int) -> Frame:
    """Return the screen."""
    frame = Frame(columns=max(1, columns), rows=max(1, rows))
    view = what.view
    if view is None:
        frame.put(0, 0, f" {what.link}".ljust(columns), Style.TITLE)
        frame.put(2, 1, f"Nothing heard yet, for {fig.span(what.waited_s)}.")
        _bottom(frame, what)
        return frame
    age_s = age_of(view)
    is_old = age_s is None or age_s > fig.OLD_S
    if columns < LEAST_COLUMNS or rows < LEAST_ROWS:
        _title(frame, what, view, age_s, is_old=is_old)
        for row, line in enumerate(textwrap.wrap(view.state.why, max(10, columns)), 1):
            frame.put(row, 0, line)
        return frame
    row = 1
    for line in textwrap.wrap(why_of(view), columns - 2, max_lines=2, placeholder=" …"):
        frame.put(row, 1, line, Style.BOLD)
        row += 1
    row = _alarms(frame, view, 3, 2 if rows >= 24 else 1)
    tape(frame, row, view)
    row += 2
    log_rows = max(4 if rows >= 24 else 3, (rows - row - 2) // 4)
    bottom = rows - 2 - log_rows
    strip = min(STRIP_COLUMNS[1], max(STRIP_COLUMNS[0], columns - 44))
    left = columns - strip - 2
    for offset, (label, text, style) in enumerate(body_of(view, knots=what.helm.knots, columns=left)[:bottom - row]):
        frame.put(row + offset, 1, label, Style.DIM)
        frame.put(row + offset, 8, text, style, width=left - 7)
    wind_strip(frame, row, left + 2, bottom - row, what.history.bins(view.t_s, BIN_S, bottom - row - 1),
               knots=what.helm.knots)
    if what.helm.has_help:
        _help(frame, bottom, log_rows, what)
    else:
        _log(frame, bottom, log_rows, what.history)
    if is_old:
        frame.fade()
    _title(frame, what, view, age_s, is_old=is_old)
    _bottom(frame, what)
    return frame


def age_of(view: View) -> float | None:
    """Return how old what is shown is: of the companion itself where it is heard over a radio."""
    companion = next((part for part in view.health if part.name == "companion"), None)
    return view.age_s if companion is None else companion.age_s


def why_of(view: View) -> str:
    """Return what she does and why, and what is missing."""
    state = view.state
    parts = [state.task, state.why, f"missing: {', '.join(state.wants)}" if state.wants else ""]
    return "; ".join(part for part in parts if part)


def _title(frame: Frame, what: Shown, view: View, age_s: float | None, *, is_old: bool) -> None:
    state = view.state
    mode = "mode not heard" if state.mode is None else state.mode
    armed = "" if state.is_armed is None else " armed" if state.is_armed else " disarmed"
    clock = datetime.fromtimestamp(what.unix_s, UTC).strftime("%H:%M:%S")
    age = "not heard" if age_s is None else f"OLD {fig.span(age_s)}" if is_old else f"age {age_s:.0f} s"
    style = Style.ALARM if is_old else Style.TITLE
    right = f"{age}  {clock} "
    left = f" {view.name or what.link}  {state.phase.upper()}  {mode}{armed}"
    room = max(0, frame.columns - len(right))
    end = frame.put(0, 0, left, style, width=room)
    frame.put(0, end, " " * (room - end) + right, style)


def _alarms(frame: Frame, view: View, row: int, rows: int) -> int:
    """Show the worst alarms on ``rows`` rows, and return the row behind them."""
    if not view.alarms:
        frame.put(row, 1, "no alarms", Style.DIM)
    for offset, alarm in enumerate(view.alarms[:rows]):
        more = len(view.alarms) - rows if offset == rows - 1 else 0
        tail = f" (+{counted(more, 'alarm')})" if more > 0 else ""
        age = "" if alarm.age_s is None else f" {fig.span(alarm.age_s)}"
        text = f"{alarm.level.upper()} {alarm.code}{age}: {alarm.text.removeprefix(f'{alarm.code}: ')}"
        style = LEVELS.get(alarm.level, Style.PLAIN)
        end = frame.put(row + offset, 1, text, style, width=frame.columns - 2 - len(tail))
        frame.put(row + offset, end, tail)
    return row + rows


def _log(frame: Frame, row: int, rows: int, history: History) -> None:
    for offset, event in enumerate(list(reversed(history.events))[:rows]):
        frame.put(row + offset, 1, event_words(event), LEVELS.get(event.level, Style.PLAIN)
                  if event.level in {"critical", "error", "warning"} else Style.PLAIN, width=frame.columns - 2)


def event_words(event: Event) -> str:
    """Return an event as a line."""
    when = "" if event.unix_s is None else datetime.fromtimestamp(event.unix_s, UTC).strftime("%H:%M:%S ")
    return one_line(f"{when}{event.title}{f': {event.text}' if event.text and event.text != event.title else ''}")


def _help(frame: Frame, row: int, rows: int, what: Shown) -> None:
    orders = what.orders
    keys = [f"{key.key} {key.label}" for key in shown(orders)]
    hidden = [key.label for key in KEYS if key not in shown(orders)]
    lines = [
        f"Orders: {', '.join(keys)}.", f"Not permitted here: {', '.join(hidden)}." if hidden else
        "Which of them she takes is in her mission." if orders is None else "",
        "u knots or m/s, ? this help, q or Ctrl-C the end. T true wind, H heading, C course, W waypoint, : no-go zone.",
        "S and P: starboard and port tack, or the side that the wind comes over.",
    ]
    wrapped = [part for line in lines if line for part in textwrap.wrap(line, frame.columns - 2)]
    for offset, line in enumerate(wrapped[:rows]):
        frame.put(row + offset, 1, line)


def _bottom(frame: Frame, what: Shown) -> None:
    helm = what.helm
    asked = helm.prompt
    frame.put(frame.rows - 2, 1, asked or helm.said or what.said, Style.WARN if asked else Style.PLAIN,
              width=frame.columns - 2)
    keys = "  ".join(f"{key.key} {key.label}" for key in shown(what.orders))
    frame.put(frame.rows - 1, 1, f"q quit  ? help  {keys}", Style.DIM, width=frame.columns - 2)

"""The dashboard: a view, what is remembered and what is typed become a screen. Pure."""

from __future__ import annotations

import math
import textwrap
from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from companion.figures import BY_NAME
from companion.geo import MPS_PER_KNOT
from companion.geo.angles import direction, wrap_pi, wrap_two_pi
from companion.terminal.keys import KEYS, KeyCommands, shown
from companion.terminal.screen import Frame, Style
from companion.view import Event, FigureView, View, WindView
from companion.words import brief_time, counted, one_line

OLD_S = 10.0  # what was heard longer ago looks old


def number_text(value: float | None, form: str = ".0f", unit: str = "", scale: float = 1.0) -> str:
    """Return a figure with its unit.

    >>> number_text(12.34, ".1f", " V"), number_text(None, ".1f", " V"), number_text(-0.2, "+.0f")
    ('12.3 V', '-', '+0')
    """
    if value is None:
        return "-"
    shown = round(value * scale, 3)
    text = format(shown, form)
    if float(text) == 0.0:
        text = text.replace("-", "+" if "+" in form else "")
    return f"{text}{unit}"


def speed_text(value_mps: float | None, *, knots: bool) -> str:
    """Return a speed without its unit."""
    return number_text(value_mps, ".1f", scale=1.0 / MPS_PER_KNOT if knots else 1.0)


def unit_text(*, knots: bool) -> str:
    """Return the unit of speeds."""
    return "kn" if knots else "m/s"


def direction_text(angle_deg: float | None) -> str:
    """Return a direction of three digits.

    >>> direction_text(7.2), direction_text(359.8)
    ('007°', '000°')
    """
    return "-" if angle_deg is None else f"{direction(math.radians(angle_deg))}°"


def side_text(angle_deg: float | None) -> str:
    """Return an angle at the bow with its side: S starboard, P port.

    >>> side_text(-38.2), side_text(120.0)
    ('38°P', '120°S')
    """
    return "-" if angle_deg is None else f"{abs(angle_deg):.0f}°{'S' if angle_deg >= 0.0 else 'P'}"


def span_text(seconds: float | None) -> str:
    """Return a time span."""
    return "-" if seconds is None else brief_time(seconds)


def length_text(value_m: float | None) -> str:
    """Return a distance.

    >>> length_text(12.4), length_text(1852.0)
    ('12 m', '1.9 km')
    """
    return "-" if value_m is None else f"{value_m:.0f} m" if value_m < 1000.0 else f"{value_m / 1000.0:.1f} km"


def share_text(value: float | None) -> str:
    """Return a probability or a charge in percent."""
    return number_text(value, ".0f", " %", 100.0)


KEPT_S = 3600.0
STEP_S = 2.0
EVENTS = 200


@dataclass(frozen=True, slots=True)
class WindBin:
    """The wind of a stretch of time: ``twd_from_deg`` is its mean, ``spread_deg`` half of what it swung through."""

    ago_s: float
    twd_from_deg: float
    tws_mps: float
    spread_deg: float
    tack: str


@dataclass(slots=True)
class _Wind:
    t_s: float
    twd_rad: float
    tws_mps: float
    tack: str


class History:
    """Takes views and events, and tells the newest."""

    def __init__(self) -> None:
        self._winds: deque[_Wind] = deque()
        self.events: deque[Event] = deque(maxlen=EVENTS)

    def take(self, view: View, events: tuple[Event, ...]) -> None:
        """Note what is new."""
        self.events.extend(events)
        wind = view.wind
        if wind is None or wind.twd_from_deg is None or wind.tws_mps is None or (wind.age_s or 0.0) > STEP_S:
            return
        if self._winds and view.t_s - self._winds[-1].t_s < STEP_S:
            return
        tack = (view.boat.tack or "")[:1].upper()
        self._winds.append(_Wind(view.t_s, math.radians(wind.twd_from_deg), wind.tws_mps, tack))
        while view.t_s - self._winds[0].t_s > KEPT_S:
            self._winds.popleft()

    def bins(self, t_s: float, each_s: float, count: int) -> list[WindBin | None]:
        """Return the last stretches of ``each_s``, the newest first; None where nothing was heard."""
        found: list[list[_Wind]] = [[] for _ in range(count)]
        for wind in reversed(self._winds):
            number = int((t_s - wind.t_s) / each_s)
            if number >= count:
                break
            found[max(0, number)].append(wind)
        return [_bin(number * each_s, winds) if winds else None for number, winds in enumerate(found)]


def _bin(ago_s: float, winds: list[_Wind]) -> WindBin:
    mean = math.atan2(sum(math.sin(w.twd_rad) for w in winds), sum(math.cos(w.twd_rad) for w in winds))
    off = [math.degrees(wrap_pi(w.twd_rad - mean)) for w in winds]
    return WindBin(
        ago_s,
        math.degrees(wrap_two_pi(mean)),
        sum(w.tws_mps for w in winds) / len(winds),
        0.5 * (max(off) - min(off)),
        winds[0].tack,
    )


BIN_S = 60.0
SCALE_DEG = 10.0  # the strip's half width is a multiple of this


def tape(frame: Frame, row: int, view: View) -> None:
    """Draw the compass on two rows, north in the middle: the no-go zone, and what points where."""
    columns, boat, wind = frame.columns, view.boat, view.wind

    def at(angle_deg: float) -> int:
        return round(((angle_deg + 180.0) % 360.0) / 360.0 * (columns - 1))

    for number, name in enumerate("N.E.S.W."):
        frame.put(row, at(45.0 * number), name, Style.DIM)
    frame.put(row, columns - 1, "S", Style.DIM)
    if wind is not None and wind.twd_from_deg is not None and view.no_go is not None:
        wedge = next((w for w in view.no_go.wedges if w.horizon_s == 0.0), None)
        half = view.no_go.half_deg if wedge is None else wedge.half_deg
        for column in range(columns):
            off = column / (columns - 1) * 360.0 - 180.0
            if abs((off - wind.twd_from_deg + 180.0) % 360.0 - 180.0) <= half:
                frame.put(row + 1, column, ":", Style.DIM)
    bearing = None
    leg = None if view.plan is None else next(iter(view.plan.legs), None)
    if leg is not None and boat.at_en_m is not None and not leg.is_loiter:
        bearing = math.degrees(math.atan2(leg.to_en_m[0] - boat.at_en_m[0], leg.to_en_m[1] - boat.at_en_m[1]))
    lines = () if view.laylines is None else view.laylines.lines
    tacks = {"port": Style.PORT, "starboard": Style.STARBOARD}
    for line in lines:
        frame.put(row + 1, at(line.course_deg), "|", tacks[line.tack])
    heading = tacks.get(boat.tack or "", Style.BOLD)
    for angle, mark, style in (
        (bearing, "W", Style.BOLD),
        (boat.cog_deg, "C", Style.PLAIN),
        (boat.heading_deg, "H", heading),
        (None if wind is None else wind.twd_from_deg, "T", Style.BOLD),
    ):
        if angle is not None:
            frame.put(row + 1, at(angle), mark, style)


def wind_strip(frame: Frame, row: int, column: int, rows: int, bins: Sequence[WindBin | None], *, knots: bool) -> None:
    """Draw the wind's history, the newest on top, a shift to the left to the left; S and P are the tack then."""
    width = frame.columns - column
    strip = width - len(" 59' 359° ") - len(" 99.9")
    known = [b for b in bins if b is not None]
    if rows < 2 or strip < 3:
        return
    if not known:
        frame.put(row, column, " no wind heard yet", Style.DIM)
        return
    centre = (
        math.degrees(
            math.atan2(
                sum(math.sin(math.radians(b.twd_from_deg)) for b in known),
                sum(math.cos(math.radians(b.twd_from_deg)) for b in known),
            )
        )
        % 360.0
    )
    centre = round(centre / 5.0) * 5.0
    off = {id(b): (b.twd_from_deg - centre + 180.0) % 360.0 - 180.0 for b in known}
    half = SCALE_DEG * max(1, math.ceil(max(abs(off[id(b)]) + b.spread_deg for b in known) / SCALE_DEG))
    half = min(180.0, half)
    frame.put(row, column, f" min  from  ±{half:.0f}°".ljust(width - 4) + unit_text(knots=knots).rjust(4), Style.DIM)
    for number, each in enumerate(bins[: rows - 1]):
        if each is None:
            continue
        line = row + 1 + number
        name = "now" if number == 0 else f"{each.ago_s / 60.0:2.0f}'"
        begin = frame.put(
            line, column, f" {name:>3} {direction_text(each.twd_from_deg)} ", Style.DIM if number else Style.PLAIN
        )

        def at(angle_deg: float, begin: int = begin) -> int:
            return begin + round((angle_deg / half + 1.0) * 0.5 * (strip - 1))

        frame.put(line, at(0.0), "|", Style.DIM)
        middle = off[id(each)]
        for cell in range(at(max(-half, middle - each.spread_deg)), at(min(half, middle + each.spread_deg)) + 1):
            frame.put(line, cell, "-", Style.DIM)
        mark = {"P": Style.PORT, "S": Style.STARBOARD}.get(each.tack, Style.PLAIN)
        frame.put(line, at(middle), each.tack or "o", mark)
        frame.put(line, begin + strip, speed_text(each.tws_mps, knots=knots).rjust(5))


Row = tuple[str, str, Style]


def body_of(view: View, *, knots: bool, columns: int) -> list[Row]:
    """Return label, text and style of each line; ``columns`` wide ones say more."""
    is_wide = columns >= 40
    return [
        _wind(view, knots=knots),
        *_water(view, knots=knots),
        _bow(view, knots=knots),
        _boat(view, knots=knots),
        _leg(view),
        _goal(view),
        _tack(view),
        _plan(view, is_wide=is_wide),
        _clear(view),
        _parts(view),
        _power(view),
        _speeds(view, knots=knots),
        *_figures(view, knots=knots),
    ]


def _figures(view: View, *, knots: bool) -> list[Row]:
    """Return the figures of the table that are shown here."""
    return [
        (figure.label, _text_of(figure, knots=knots), Style.PLAIN)
        for figure in view.shown
        if figure.name not in BY_NAME or "watch" in BY_NAME[figure.name].shown
    ]


def _text_of(figure: FigureView, *, knots: bool) -> str:
    if figure.kind == "speed":
        return f"{speed_text(figure.value, knots=knots)} {unit_text(knots=knots)}"
    return {
        "distance": length_text,
        "time": span_text,
        "bearing": direction_text,
        "angle": side_text,
        "share": share_text,
    }.get(figure.kind, number_text)(figure.value)


def _mean(wind: WindView) -> tuple[float | None, float | None]:
    """Return the mean wind that the spread is of, direction [deg] and speed [m/s]; that of now before there is one."""
    if wind.mean_twd_from_deg is None or wind.mean_tws_mps is None:
        return wind.twd_from_deg, wind.tws_mps
    return wind.mean_twd_from_deg, wind.mean_tws_mps


def _wind(view: View, *, knots: bool) -> Row:
    wind = view.wind
    if wind is None:
        return "Wind", "not heard", Style.PLAIN
    spread = "" if wind.sigma_deg is None else f"±{wind.sigma_deg:.0f}°"
    gusts = "" if wind.tws_sigma_mps is None else f"±{speed_text(wind.tws_sigma_mps, knots=knots)}"
    style = Style.PLAIN if wind.health == "good" else Style.WARN
    health = "" if wind.health == "good" else f" {wind.health}"
    has_mean = wind.mean_twd_from_deg is not None
    now = f", now {direction_text(wind.twd_from_deg)}" if has_mean and wind.twd_from_deg is not None else ""
    from_deg, tws_mps = _mean(wind)
    return (
        "Wind",
        (
            f"{direction_text(from_deg)}{spread} {speed_text(tws_mps, knots=knots)}{gusts} "
            f"{unit_text(knots=knots)}{now}{health}"
        ),
        style,
    )


def _water(view: View, *, knots: bool) -> list[Row]:
    """Return the current's line, none where plans do not reckon with one and nothing is wrong with it."""
    water = view.water
    if water is None or not (water.is_planned or water.verdict):
        return []
    spread = "" if water.sigma_mps is None else f"±{speed_text(water.sigma_mps, knots=knots)}"
    said = "" if not water.verdict else f" {water.verdict}"
    text = f"sets {direction_text(water.set_deg)} {speed_text(water.drift_mps, knots=knots)}{spread}"
    style = Style.PLAIN if water.is_planned else Style.WARN
    return [("Water", f"{text} {unit_text(knots=knots)}{said}", style)]


def _bow(view: View, *, knots: bool) -> Row:
    wind = view.wind
    if wind is None:
        return "Bow", "-", Style.PLAIN
    style = Style.PLAIN if wind.twa_deg is None else Style.STARBOARD if wind.twa_deg >= 0.0 else Style.PORT
    apparent = f", apparent {side_text(wind.awa_deg)} {speed_text(wind.aws_mps, knots=knots)}"
    return "Bow", f"{side_text(wind.twa_deg)}{'' if wind.awa_deg is None else apparent}", style


def _boat(view: View, *, knots: bool) -> Row:
    boat = view.boat
    text = (
        f"HDG {direction_text(boat.heading_deg)} COG {direction_text(boat.cog_deg)} "
        f"{speed_text(boat.sog_mps, knots=knots)} {unit_text(knots=knots)}"
    )
    is_old = boat.age_s is None or boat.age_s > OLD_S
    return "Boat", f"{text}, {span_text(boat.age_s)} ago" if is_old else text, Style.WARN if is_old else Style.PLAIN


def _leg(view: View) -> Row:
    plan, boat = view.plan, view.boat
    if plan is None or plan.leg is None:
        return "Leg", "no plan is sailed", Style.PLAIN
    bearing = ""
    leg = next(iter(plan.legs), None)
    if leg is not None and boat.at_en_m is not None:
        east, north = leg.to_en_m[0] - boat.at_en_m[0], leg.to_en_m[1] - boat.at_en_m[1]
        bearing = f" at {direction_text(math.degrees(math.atan2(east, north)) % 360.0)}"
    off = "" if boat.cross_track_m is None else f", xt {number_text(boat.cross_track_m, '+.0f')} m"
    return "Leg", f"{plan.leg}/{number_text(plan.count)} {length_text(boat.waypoint_m)}{bearing}{off}", Style.PLAIN


def _goal(view: View) -> Row:
    goal = next((g for g in view.goals if g.is_next), None)
    figures = view.figures
    number = ""
    if goal is not None and figures.goals == len(view.goals):  # else laps: the same marks again
        number = f"{view.goals.index(goal) + 1}/{figures.goals} "
    elif figures.goals is not None and figures.goals_reached is not None:
        number = f"{min(figures.goals_reached + 1, figures.goals)}/{figures.goals} "
    if goal is None:
        return "Goal", f"{number}{length_text(view.boat.goal_m)}", Style.PLAIN
    text = f"{number}{length_text(goal.distance_m)} at {direction_text(goal.bearing_deg)} {goal.name}"
    return "Goal", text, Style.PLAIN


def _tack(view: View) -> Row:
    lines = () if view.laylines is None else tuple(line for line in view.laylines.lines if line.reach_s is not None)
    nearest = min(lines, key=lambda line: line.reach_s or 0.0, default=None)
    layline = "" if nearest is None else f", layline {nearest.tack[:1].upper()} in {span_text(nearest.reach_s)}"
    next_s = None if view.plan is None else view.plan.next_tack_s
    about = "about " if view.plan is not None and view.plan.next_tack_is_planned is False else ""
    tacks = view.figures.tacks
    return (
        "Tack",
        (
            f"{'none planned' if next_s is None else f'in {about}{span_text(next_s)}'}{layline}"
            f"{'' if tacks is None else f', {tacks} done'}"
        ),
        Style.PLAIN,
    )


def _plan(view: View, *, is_wide: bool) -> Row:
    plan = view.plan
    if plan is None:
        return "Plan", "none", Style.PLAIN
    there = "" if plan.there_s is None else f"there in {span_text(plan.there_s)}"
    late = "" if plan.there_late_s is None or not is_wide else f" (90 %: {span_text(plan.there_late_s)})"
    risk = "" if plan.path_risk is None else f"off plan {share_text(plan.path_risk)}"
    which = f"#{number_text(plan.number)} {span_text(plan.age_s)} old" if plan.number is not None else plan.why
    text = ", ".join(part for part in (there + late, risk, which) if part)
    return "Plan", f"{text}, {plan.bound_for}" if plan.bound_for else text, Style.PLAIN


def _clear(view: View) -> Row:
    near = min((v for v in view.vessels if v.cpa_s is not None), key=lambda v: v.cpa_m or 0.0, default=None)
    ships = (
        ""
        if not view.vessels
        else f", {counted(len(view.vessels), 'vessel')}"
        if near is None
        else f", {near.name or near.mmsi} {length_text(near.cpa_m)} in {span_text(near.cpa_s)}"
    )
    is_alarm = any(v.alarm in {"act", "touch"} for v in view.vessels)
    return "Clear", f"{length_text(view.boat.clearance_m)} of land{ships}", Style.BAD if is_alarm else Style.PLAIN


def _parts(view: View) -> Row:
    ill = [part for part in view.health if part.grade in {"bad", "poor"}]
    if not ill:
        return "Parts", "all well", Style.PLAIN
    worst = any(part.grade == "bad" for part in ill)
    words = ", ".join(
        part.name
        + (
            f" {span_text(part.age_s)} ago"
            if (part.age_s or 0.0) > 5.0
            else f" {part.text}"
            if part.text
            else f" {part.grade}"
        )
        for part in ill
    )
    return "Parts", words, Style.BAD if worst else Style.WARN


def _power(view: View) -> Row:
    boat, standing = view.boat, view.orders.standing
    order = "" if standing is None else f", order {standing.words} {span_text(standing.age_s)}"
    charge = "" if boat.battery_share is None else f" {share_text(boat.battery_share)}"
    return "Power", f"{number_text(boat.battery_v, '.1f', ' V')}{charge}{order}", Style.PLAIN


def _speeds(view: View, *, knots: bool) -> Row:
    boat, polar = view.boat, view.polar
    ratio = None if polar is None else polar.live_share()
    heel = "" if boat.roll_deg is None else f", heel {abs(boat.roll_deg):.0f}°{'S' if boat.roll_deg > 0.0 else 'P'}"
    return (
        "VMG",
        (
            f"{speed_text(boat.vmg_mps, knots=knots)} {unit_text(knots=knots)}"
            f"{'' if ratio is None else f', {share_text(ratio)} of polar'}{heel}"
        ),
        Style.PLAIN,
    )


LEAST_COLUMNS, LEAST_ROWS = 40, 12
STRIP_COLUMNS = (24, 36)  # of the wind's history: at least, at most
LEVELS = {"critical": Style.ALARM, "error": Style.BAD, "warning": Style.WARN, "notice": Style.BOLD}


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What is shown: ``view`` None before anything was heard on ``link``; ``orders`` are the verbs permitted here.

    ``said`` is the answer to the last order, or what became of the link.
    """

    link: str
    view: View | None
    history: History
    helm: KeyCommands
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
        frame.put(2, 1, f"Nothing heard yet, for {span_text(what.waited_s)}.")
        _bottom(frame, what)
        return frame
    age_s = age_of(view)
    is_old = age_s is None or age_s > OLD_S
    if columns < LEAST_COLUMNS or rows < LEAST_ROWS:
        _title(frame, what, view, age_s, is_old=is_old)
        for row, line in enumerate(textwrap.wrap(view.state.why, max(10, columns)), 1):
            frame.put(row, 0, line)
        return frame
    row = 1
    for line in textwrap.wrap(why_of(view), columns - 2, max_lines=2, placeholder=" …"):
        frame.put(row, 1, line, Style.BOLD)
        row += 1
    row = _alarms(frame, view, 2 if rows >= 24 else 1)
    tape(frame, row, view)
    row += 2
    log_rows = max(4 if rows >= 24 else 3, (rows - row - 2) // 4)
    bottom = rows - 2 - log_rows
    strip = min(STRIP_COLUMNS[1], max(STRIP_COLUMNS[0], columns - 44))
    left = columns - strip - 2
    for offset, (label, text, style) in enumerate(body_of(view, knots=what.helm.knots, columns=left)[: bottom - row]):
        frame.put(row + offset, 1, label, Style.DIM)
        frame.put(row + offset, 8, text, style, width=left - 7)
    wind_strip(
        frame, row, left + 2, bottom - row, what.history.bins(view.t_s, BIN_S, bottom - row - 1), knots=what.helm.knots
    )
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


def age_text(view: View) -> str:
    """Return that age in words, and whose it is where the companion is not heard."""
    age_s = age_of(view)
    if age_s is not None:
        return f"{'age' if age_s <= OLD_S else 'OLD'} {span_text(age_s)}"
    if view.age_s is None:
        autopilot = next((part.age_s for part in view.health if part.name == "autopilot"), None)
    else:
        autopilot = view.age_s
    return "nothing heard yet" if autopilot is None else f"companion not heard, autopilot's age {span_text(autopilot)}"


def why_of(view: View) -> str:
    """Return what the boat does and why, and what is missing."""
    state = view.state
    parts = [state.task, state.why, f"missing: {', '.join(state.wants)}" if state.wants else ""]
    return "; ".join(part for part in parts if part)


def _title(frame: Frame, what: Shown, view: View, age_s: float | None, *, is_old: bool) -> None:
    state = view.state
    mode = "mode not heard" if state.mode is None else state.mode
    armed = "" if state.is_armed is None else " armed" if state.is_armed else " disarmed"
    clock = datetime.fromtimestamp(what.unix_s, UTC).strftime("%H:%M:%S")
    age = "not heard" if age_s is None else f"OLD {span_text(age_s)}" if is_old else f"age {age_s:.0f} s"
    style = Style.ALARM if is_old else Style.TITLE
    right = f"{age}  {clock} "
    left = f" {view.name or what.link}  {state.phase.upper()}  {mode}{armed}"
    room = max(0, frame.columns - len(right))
    end = frame.put(0, 0, left, style, width=room)
    frame.put(0, end, " " * (room - end) + right, style)


def _alarms(frame: Frame, view: View, rows: int) -> int:
    """Show the worst alarms on ``rows`` rows, and return the row behind them."""
    row = 3
    if not view.alarms:
        frame.put(row, 1, "no alarms", Style.DIM)
    for offset, alarm in enumerate(view.alarms[:rows]):
        more = len(view.alarms) - rows if offset == rows - 1 else 0
        tail = f" (+{counted(more, 'alarm')})" if more > 0 else ""
        age = "" if alarm.age_s is None else f" {span_text(alarm.age_s)}"
        text = f"{alarm.level.upper()} {alarm.code}{age}: {alarm.text.removeprefix(f'{alarm.code}: ')}"
        style = LEVELS.get(alarm.level, Style.PLAIN)
        end = frame.put(row + offset, 1, text, style, width=frame.columns - 2 - len(tail))
        frame.put(row + offset, end, tail)
    return row + rows


def _log(frame: Frame, row: int, rows: int, history: History) -> None:
    for offset, event in enumerate(list(reversed(history.events))[:rows]):
        frame.put(
            row + offset,
            1,
            event_words(event),
            LEVELS.get(event.level, Style.PLAIN) if event.level in {"critical", "error", "warning"} else Style.PLAIN,
            width=frame.columns - 2,
        )


def event_words(event: Event) -> str:
    """Return an event as a line."""
    when = "" if event.unix_s is None else datetime.fromtimestamp(event.unix_s, UTC).strftime("%H:%M:%S ")
    return one_line(f"{when}{event.title}{f': {event.text}' if event.text and event.text != event.title else ''}")


def _help(frame: Frame, row: int, rows: int, what: Shown) -> None:
    orders = what.orders
    keys = [f"{key.key} {key.label}" for key in shown(orders)]
    hidden = [key.label for key in KEYS if key not in shown(orders)]
    lines = [
        f"Orders: {', '.join(keys)}.",
        f"Not permitted here: {', '.join(hidden)}."
        if hidden
        else "Which of them she takes is in her mission."
        if orders is None
        else "",
        "u knots or m/s, ? this help, q or Ctrl-C the end. T true wind, H heading, C course, W waypoint, : no-go zone.",
        "S and P: starboard and port tack, or the side that the wind comes over.",
    ]
    wrapped = [part for line in lines if line for part in textwrap.wrap(line, frame.columns - 2)]
    for offset, line in enumerate(wrapped[:rows]):
        frame.put(row + offset, 1, line)


def _bottom(frame: Frame, what: Shown) -> None:
    helm = what.helm
    asked = helm.prompt
    frame.put(
        frame.rows - 2,
        1,
        asked or helm.said or what.said,
        Style.WARN if asked else Style.PLAIN,
        width=frame.columns - 2,
    )
    keys = "  ".join(f"{key.key} {key.label}" for key in shown(what.orders))
    frame.put(frame.rows - 1, 1, f"q quit  ? help  {keys}", Style.DIM, width=frame.columns - 2)


def line_of(view: View, unix_s: float, *, knots: bool) -> str:
    """Return the view as one line; nothing without its age."""
    state, boat, wind, plan = view.state, view.boat, view.wind, view.plan
    unit = unit_text(knots=knots)
    parts = [
        f"{datetime.fromtimestamp(unix_s, UTC):%H:%M:%S} {state.phase.upper()}",
        f"{state.mode or 'mode not heard'}{' armed' if state.is_armed else ''}",
        age_text(view),
    ]
    if wind is not None:
        from_deg, tws_mps = _mean(wind)
        parts.append(
            f"wind {direction_text(from_deg)}±{number_text(wind.sigma_deg)}° {speed_text(tws_mps, knots=knots)} {unit}"
        )
    parts.append(f"{direction_text(boat.cog_deg)} {speed_text(boat.sog_mps, knots=knots)} {unit}")
    if plan is not None and plan.leg is not None:
        parts.append(f"leg {plan.leg}/{number_text(plan.count)} {length_text(boat.waypoint_m)}")
    if boat.goal_m is not None:
        parts.append(f"goal {length_text(boat.goal_m)}")
    if plan is not None and plan.there_s is not None:
        parts.append(f"there in {span_text(plan.there_s)}")
    if plan is not None and plan.path_risk is not None:
        parts.append(f"off plan {share_text(plan.path_risk)}")
    if boat.battery_v is not None:
        parts.append(f"{boat.battery_v:.1f} V")
    parts += [f"{alarm.level.upper()} {alarm.code}" for alarm in view.alarms[:2]]
    parts.append(state.why)
    return " | ".join(part for part in parts if part)

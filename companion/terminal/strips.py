"""Pictures made of characters: the compass as a tape, the wind of the last minutes as a strip."""

from __future__ import annotations

import math
from collections.abc import Sequence

from companion.terminal import figures as fig
from companion.terminal.history import Bin
from companion.terminal.screen import Frame, Style
from companion.view import View

BIN_S = 60.0
SCALE_DEG = 10.0     # the strip's half width is a multiple of this


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
    leg = None if view.plan is None else next((leg for leg in view.plan.legs if not leg.is_done), None)
    if leg is not None and boat.at_en_m is not None and not leg.is_loiter:
        bearing = math.degrees(math.atan2(leg.to_en_m[0] - boat.at_en_m[0], leg.to_en_m[1] - boat.at_en_m[1]))
    lines = () if view.laylines is None else view.laylines.lines
    tacks = {"port": Style.PORT, "starboard": Style.STARBOARD}
    for line in lines:
        frame.put(row + 1, at(line.course_deg), "|", tacks[line.tack])
    heading = tacks.get(boat.tack or "", Style.BOLD)
    for angle, mark, style in (
        (bearing, "W", Style.BOLD), (boat.cog_deg, "C", Style.PLAIN), (boat.heading_deg, "H", heading),
        (None if wind is None else wind.twd_from_deg, "T", Style.BOLD),
    ):
        if angle is not None:
            frame.put(row + 1, at(angle), mark, style)


def wind_strip(
    frame: Frame, row: int, column: int, rows: int, bins: Sequence[Bin | None], *, knots: bool,
) -> None:
    """Draw the wind's history, the newest on top, a shift to the left to the left; S and P are the tack then."""
    width = frame.columns - column
    strip = width - len(" 59' 359° ") - len(" 99.9")
    known = [b for b in bins if b is not None]
    if rows < 2 or strip < 3:
        return
    if not known:
        frame.put(row, column, " no wind heard yet", Style.DIM)
        return
    centre = math.degrees(math.atan2(
        sum(math.sin(math.radians(b.twd_from_deg)) for b in known),
        sum(math.cos(math.radians(b.twd_from_deg)) for b in known))) % 360.0
    centre = round(centre / 5.0) * 5.0
    off = {id(b): (b.twd_from_deg - centre + 180.0) % 360.0 - 180.0 for b in known}
    half = SCALE_DEG * max(1, math.ceil(max(abs(off[id(b)]) + b.spread_deg for b in known) / SCALE_DEG))
    half = min(180.0, half)
    frame.put(row, column, f" min  from  ±{half:.0f}°".ljust(width - 4) + fig.unit(knots=knots).rjust(4), Style.DIM)
    for number, each in enumerate(bins[:rows - 1]):
        if each is None:
            continue
        line = row + 1 + number
        name = "now" if number == 0 else f"{each.ago_s / 60.0:2.0f}'"
        begin = frame.put(line, column, f" {name:>3} {fig.direction(each.twd_from_deg)} ", Style.DIM if number else
                          Style.PLAIN)

        def at(angle_deg: float, begin: int = begin) -> int:
            return begin + round((angle_deg / half + 1.0) * 0.5 * (strip - 1))

        frame.put(line, at(0.0), "|", Style.DIM)
        middle = off[id(each)]
        for cell in range(at(max(-half, middle - each.spread_deg)), at(min(half, middle + each.spread_deg)) + 1):
            frame.put(line, cell, "-", Style.DIM)
        mark = {"P": Style.PORT, "S": Style.STARBOARD}.get(each.tack, Style.PLAIN)
        frame.put(line, at(middle), each.tack or "o", mark)
        frame.put(line, begin + strip, fig.speed(each.tws_mps, knots=knots).rjust(5))

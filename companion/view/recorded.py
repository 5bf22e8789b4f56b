"""The view of a recorded voyage: its steps folded again; without its telemetry log what its track tells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from companion.geo.shift import Shift, carried
from companion.messages import GeoPoint
from companion.replay import RecordedInput
from companion.telemetry.folder import (
    TLOG,
    RecordedPlan,
    VoyageFigures,
    VoyageRecord,
    is_from_the_start,
    parts,
    read_voyage,
)
from companion.telemetry.status import companion_status
from companion.view import values
from companion.view.area import AreaView, drawn
from companion.view.events import Event
from companion.view.fold import ViewFold
from companion.view.values import View, place, rounded, tack_of


def area_of_chart(record: VoyageRecord) -> AreaView:
    """Return the area of a recorded voyage."""
    chart = record.chart
    return drawn(
        chart.name,
        GeoPoint(lat_deg=chart.origin.lat_deg, lon_deg=chart.origin.lon_deg),
        chart.obstacles,
        chart.grown,
        [chart.fence] if chart.fence else [],
        chart.margin_m,
        chart.names,
        [(water.name, water.area, water.solid_unix_s) for water in chart.drying],
    )


def views_of_rows(record: VoyageRecord, area: AreaView) -> Iterator[values.View]:
    """Yield a view for each row of the track."""
    chart, columns = record.chart, record.columns
    plans = [p for p in record.plans if p.is_made]
    goals = tuple(
        values.GoalView(
            name=g.name or f"goal {n}",
            kind="buoy" if g.side != "none" else "line" if g.line else "point",
            at_en_m=place((g.x, g.y)),
            radius_m=rounded(g.radius_m, 1),
            side="" if g.side == "none" else g.side,
            line_en_m=g.line,
        )
        for n, g in enumerate(chart.goals, start=1)
    )
    number = -1
    for row in range(len(columns["t_s"])):
        cell = {name: _known(float(column[row])) for name, column in columns.items()}
        t_s = float(columns["t_s"][row])
        while number + 1 < len(plans) and plans[number + 1].t_s <= t_s:
            number += 1
        here = None if cell["east_m"] is None or cell["north_m"] is None else (cell["east_m"], cell["north_m"])
        yield values.View(
            source="recorded",
            name=chart.name,
            t_s=round(t_s, 3),
            area=area.hash,
            age_s=0.0,
            unix_s=None if record.epoch_s is None else round(record.epoch_s + t_s, 3),
            state=values.StateView(phase=record.texts["phase"][row], mode=record.texts["mode"][row] or None),
            boat=_boat(cell, here),
            wind=_wind(cell),
            plan=None if number < 0 else _plan(plans[number], number + 1, t_s),
            goals=goals,
        )


def events_of_record(record: VoyageRecord) -> Iterator[tuple[Event, ...]]:
    """Yield, for each row of the track, what has happened since the one before: phases and plans."""
    phase, number, made, waiting = "", 0, 0, list(record.plans)
    for row, t_s in enumerate(float(t) for t in record.columns["t_s"]):
        found: list[tuple[str, str, str]] = []
        if record.texts["phase"][row] != phase:
            phase = record.texts["phase"][row]
            found.append(("phase", phase, ""))
        while waiting and waiting[0].t_s <= t_s:
            plan = waiting.pop(0)
            made += plan.is_made
            found.append(("plan", f"plan {made}" if plan.is_made else "no plan", plan.reason or ""))
        events = []
        for kind, title, text in found:
            number += 1
            unix_s = None if record.epoch_s is None else round(record.epoch_s + t_s, 3)
            events.append(Event(number=number, t_s=round(t_s, 2), unix_s=unix_s, kind=kind, title=title, text=text))
        yield tuple(events)


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _twa_deg(cell: dict[str, float | None]) -> float | None:
    if cell["twd_deg"] is None or cell["heading_deg"] is None:
        return None
    return round(math.remainder(cell["twd_deg"] - cell["heading_deg"], 360.0), 1)


def _boat(cell: dict[str, float | None], here: values.PointEn | None) -> values.BoatView:
    twa_deg = _twa_deg(cell)
    return values.BoatView(
        age_s=None if here is None else 0.0,
        lat_deg=cell["lat_deg"],
        lon_deg=cell["lon_deg"],
        at_en_m=None if here is None else place(here),
        heading_deg=cell["heading_deg"],
        cog_deg=cell["cog_deg"],
        sog_mps=cell["sog_mps"],
        clearance_m=cell["clearance_m"],
        cross_track_m=cell["cross_track_m"],
        tack=None if twa_deg is None else tack_of(math.radians(twa_deg)),
    )


def _wind(cell: dict[str, float | None]) -> values.WindView | None:
    if cell["twd_deg"] is None:
        return None
    return values.WindView(
        health="recorded",
        twd_from_deg=cell["twd_deg"],
        tws_mps=cell["tws_mps"],
        mean_twd_from_deg=cell["twd_deg"],
        mean_tws_mps=cell["tws_mps"],
        sigma_deg=cell["twd_sigma_deg"],
        twa_deg=_twa_deg(cell),
    )


def _plan(recorded: RecordedPlan, number: int, t_s: float) -> values.PlanView:
    assert recorded.plan is not None
    way = recorded.plan.waypoints
    legs = tuple(values.LegView(from_en_m=place(a), to_en_m=place(b)) for a, b in pairwise(way))
    return values.PlanView(
        number=number,
        age_s=round(t_s - recorded.t_s, 1),
        reason=recorded.reason or "",
        twd_from_deg=rounded(recorded.twd_deg, 1),
        legs=legs,
        count=len(legs),
    )


Moment = tuple[View, tuple[Event, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedViews:
    """A recorded voyage: its area, how many moments it has, and those in their order.

    ``is_whole`` is False where they come from the track alone: no plan's reasons, no forecast.
    """

    name: str
    area: AreaView
    count: int
    is_whole: bool
    moments: Iterator[Moment]


def recorded_views(folder: Path) -> RecordedViews:
    """Return the views of the voyage in ``folder``; they are made as they are asked for.

    Raises:
        InputError: it is not a voyage folder, or a file in it is damaged; from ``moments`` too.
    """
    heard = [part for part in parts(folder / TLOG) if part.stat().st_size > 0]
    if heard and is_from_the_start(folder / TLOG):
        recorded = RecordedInput(folder)
        fold = ViewFold(recorded.voyage, recorded.config, source="recorded", epoch_s=recorded.epoch_s)
        return RecordedViews(
            name=recorded.mission.name,
            area=fold.area,
            count=len(recorded.rows),
            is_whole=True,
            moments=_folded(recorded, fold, fold.area),
        )
    record = read_voyage(folder)
    area = area_of_chart(record)
    return RecordedViews(
        name=record.chart.name,
        area=area,
        count=len(record.columns["t_s"]),
        is_whole=False,
        moments=zip(views_of_rows(record, area), events_of_record(record), strict=True),
    )


def _folded(recorded: RecordedInput, fold: ViewFold, area: AreaView) -> Iterator[Moment]:
    figures = VoyageFigures()
    for folded in recorded.steps():
        if folded.step is None:
            continue
        snapshot, clearance_m = folded.step.snapshot, None
        if snapshot.position_en_m is not None and snapshot.vehicle is not None:
            value = folded.step.voyage.hull_clearance_m(snapshot.position_en_m, snapshot.vehicle.heading_rad)
            clearance_m = value if math.isfinite(value) else None
        figures.take(folded.step, clearance_m)
        status = companion_status(folded.step, folded.step.voyage, figures, clearance_m, None)
        view, events = fold.take(folded.step, status, figures)
        if folded.step.voyage.frame != recorded.voyage.frame:
            # A passage is drawn whole, in the metres of its beginning: far from there north is not quite up.
            shift = Shift(folded.step.voyage.frame, recorded.voyage.frame)
            view = replace(carried(view, shift), area=area.hash)
        yield view, events

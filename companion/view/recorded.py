"""The view of a recorded voyage: its steps folded again; without its telemetry log what its track tells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from companion.geo.shift import Shift, carried
from companion.replay import Recorded
from companion.telemetry.folder import TLOG, VoyageFigures, is_from_the_start, parts, read_voyage
from companion.telemetry.status import companion_status
from companion.view.area import Area
from companion.view.events import Event
from companion.view.fold import ViewFold
from companion.view.rows import area_of_chart, events_of_record, views_of_rows
from companion.view.values import View

Moment = tuple[View, tuple[Event, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedViews:
    """A recorded voyage: its area, how many moments it has, and those in their order.

    ``is_whole`` is False where they come from the track alone: no plan's reasons, no forecast.
    """

    name: str
    area: Area
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
        recorded = Recorded(folder)
        fold = ViewFold(recorded.voyage, recorded.config, source="recorded", epoch_s=recorded.epoch_s)
        return RecordedViews(name=recorded.mission.name, area=fold.area, count=len(recorded.rows), is_whole=True,
                             moments=_folded(recorded, fold, fold.area))
    record = read_voyage(folder)
    area = area_of_chart(record)
    return RecordedViews(name=record.chart.name, area=area, count=len(record.columns["t_s"]), is_whole=False,
                         moments=zip(views_of_rows(record, area), events_of_record(record), strict=True))


def _folded(recorded: Recorded, fold: ViewFold, area: Area) -> Iterator[Moment]:
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

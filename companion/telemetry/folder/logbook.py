"""What a voyage writes down, step by step: track, decisions, figures, and what a replay needs to sail it again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from companion.clock import now_s
from companion.fold import Step
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.geofence import Mission
from companion.mavlink.tlog import stamp
from companion.skipper.step import Permissions, Persisted, SkipperConfig
from companion.skipper.way import Voyage
from companion.telemetry.folder.copies import write_copies
from companion.telemetry.folder.description import chart_record, voyage_record
from companion.telemetry.folder.names import AREA
from companion.telemetry.folder.recorder import Recorder
from companion.telemetry.folder.records import action_record, track_row, water_record
from companion.telemetry.folder.summary import VoyageFigures


class Logbook:
    """The records of one voyage and its figures. ``epoch_s`` is the Unix time [s] of the loop's time 0."""

    def __init__(self, recorder: Recorder, config: SkipperConfig, epoch_s: float) -> None:
        self.recorder, self.figures = recorder, VoyageFigures()
        self._config, self._epoch_s = config, epoch_s
        self._frames = 0
        self._framed_s, self._framed_us = float("nan"), 0
        self._phase = ""
        self._frame: LocalFrame | None = None     # of the chart, and of the last record that says which
        self._water: LocalFrame | None = None

    # ---------------------------------------------------------------------------------------------- time
    def quantised(self, t_s: float) -> tuple[int, float]:
        """Return a stamp [µs since 1970] as a tlog keeps it, and the loop time [s] that it stands for."""
        stamp_us = 4 * round((self._epoch_s + t_s) * 1e6 / 4.0)
        return stamp_us, stamp_us / 1e6 - self._epoch_s

    def stamped_s(self, t_s: float) -> float:
        """Return a loop time [s] as the records have it."""
        return self.quantised(t_s)[1]

    def now_s(self) -> float:
        """Return the loop's time as the records have it [s]."""
        return self.stamped_s(now_s())

    def stamps(self, t_s: float) -> dict[str, Any]:
        """Return what says when in every record."""
        utc = datetime.fromtimestamp(self._epoch_s + t_s, UTC).isoformat(timespec="milliseconds")
        return {"t_s": t_s, "utc": utc.replace("+00:00", "Z")}

    # ------------------------------------------------------------------------------------------- records
    def note(self, t_s: float, record: Mapping[str, Any]) -> None:
        """Write a decision down."""
        self.recorder.decision({**self.stamps(t_s), **record})

    def frame(self, t_s: float, frame: bytes) -> None:
        """Write a frame of the link down."""
        if t_s != self._framed_s:   # the frames of one piece of bytes are of one moment
            self._framed_s, self._framed_us = t_s, self.quantised(t_s)[0]
        self.recorder.frame(stamp(self._framed_us, frame))

    def message(self) -> None:
        """Count a message that the fold has heard: a replay gives it as many before the next step."""
        self._frames += 1

    def begin(
        self, t_s: float, mission: Mission, voyage: Voyage, permissions: Permissions, persisted: Persisted | None,
        known: tuple[str, ...], run: Mapping[str, Any],
    ) -> None:
        """Write down what is sailed, with copies of its files, and what was known of earlier voyages."""
        self._frame = self._water = voyage.frame
        self.recorder.whole(AREA, json.dumps(chart_record(mission, voyage, self._config.margin_m)).encode())
        copy = write_copies(mission, self.recorder)
        started = datetime.fromtimestamp(self._epoch_s + t_s, UTC).isoformat()
        self.recorder.voyage(voyage_record(
            mission, permissions, {**run, "epoch_s": self._epoch_s, "started_utc": started}, copy))
        self.note(t_s, {
            "kind": "start", "persisted": None if persisted is None else persisted.to_dict(), "known": list(known),
            "epoch_s": self._epoch_s})

    def step(self, step: Step, clearance_m: float | None) -> None:
        """Write a step down: where the boat is, what was decided, and by which numbers."""
        snapshot, frame = step.snapshot, step.voyage.frame
        self.figures.take(step, clearance_m)
        if self._water is not None and frame != self._water:
            self.note(snapshot.t_s, water_record(step, Shift(self._water, frame)))
            self._water = frame
        self.recorder.track(track_row(step, self._frames, clearance_m, self._frame))
        self._frames = 0
        for action in step.actions:
            self.note(snapshot.t_s, action_record(action, snapshot, self._config))
        phase = step.state.phase.value
        if phase != self._phase:
            self.note(snapshot.t_s, {"kind": "phase", "phase": phase, "why": step.state.why})
        self._phase = phase

"""What every format that holds shapes, routes and points gathers while it is read."""

from __future__ import annotations

from companion.geofence.document import Mark, Track
from companion.geofence.formats.rings import Findings
from companion.geofence.formats.routes import RoutePoint
from companion.geofence.shapes import Zone, ZoneKind
from companion.messages import MissionItem


class Reading:
    """One file being read: a zone that does not say what it is, is ``kind``; read for its ``areas``, so is a pin."""

    def __init__(self, source: str, kind: ZoneKind, *, areas: bool) -> None:
        self.source, self.kind, self.areas = source, kind, areas
        self.findings = Findings()
        self.zones: list[Zone] = []
        self.marks: list[Mark] = []
        self.tracks: list[Track] = []
        self.rally: list[MissionItem] = []
        self.pins: list[RoutePoint] = []

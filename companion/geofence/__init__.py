"""Where the boat may go: obstacles, fences and missions as values, and every file format that carries them.

``load_mission(path)`` reads a mission TOML with the files that it names; ``Area.local(frame)`` is its picture in
metres for the planner. ``read(path)`` reads any single file into a ``Document``.
"""

from companion.geofence.area import Area, Fence, LocalArea
from companion.geofence.charted import Charted
from companion.geofence.document import Code, Document, Finding, FindingLevel
from companion.geofence.formats.registry import read
from companion.geofence.mission.mission import Mission, load_mission
from companion.geofence.shapes import Circle, Obstacle, Zone, ZoneKind

__all__ = [
    "Area",
    "Charted",
    "Circle",
    "Code",
    "Document",
    "Fence",
    "Finding",
    "FindingLevel",
    "LocalArea",
    "Mission",
    "Obstacle",
    "Zone",
    "ZoneKind",
    "load_mission",
    "read",
]
